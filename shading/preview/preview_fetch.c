#include "shading/preview/samples.h"

#include "shading/brdf/half.h"

/* The four texels around a place and their shares; masked ones have none. */
typedef struct taps {
    size_t at[4];
    double share[4];
    double sign[3]; /* of the normal: -1 where a mirrored repeat turned the axis round */
} taps;

/* Folds a coordinate into 0..size-1 by mirroring at the edges of the texels (-0.5 and size - 0.5). */
static double mirror(double t, int size, double *sign)
{
    const double period = 2.0 * size, from_edge = t + 0.5;
    const double within = from_edge - period * floor(from_edge / period);
    *sign = within < size ? 1 : -1;
    const double folded = (within < size ? within : period - within) - 0.5;
    return folded < 0 ? 0 : folded > size - 1 ? size - 1 : folded;
}

/* @return the share of the place that is not masked, 0..1 */
static double place_taps(const weft_preview_setup *setup, double u, double v, taps *t)
{
    const weft_preview_crop crop = setup->crop;
    const weft_mask *const mask = setup->surface->mask;
    t->sign[2] = 1;
    const double x = crop.x + mirror(u, crop.width, &t->sign[0]);
    const double y = crop.y + mirror(v, crop.height, &t->sign[1]);
    const int x0 = (int)x, y0 = (int)y;
    const int x1 = x0 + 1 < crop.x + crop.width ? x0 + 1 : x0,
              y1 = y0 + 1 < crop.y + crop.height ? y0 + 1 : y0;
    const double fx = x - x0, fy = y - y0;
    const int columns[4] = {x0, x1, x0, x1}, rows[4] = {y0, y0, y1, y1};
    const double shares[4] = {(1 - fx) * (1 - fy), fx * (1 - fy), (1 - fx) * fy, fx * fy};
    double sum = 0;
    for (int k = 0; k < 4; k++) {
        t->at[k] = (size_t)rows[k] * (size_t)setup->surface->width + (size_t)columns[k];
        t->share[k] = !mask || mask->data[t->at[k]] ? shares[k] : 0;
        sum += t->share[k];
    }
    for (int k = 0; k < 4 && sum > 0; k++)
        t->share[k] /= sum;
    return sum;
}

static double fetch(const weft_image *image, int plane, const taps *t)
{
    const float *const from = weft_image_plane(image, plane);
    double sum = 0;
    for (int k = 0; k < 4; k++)
        sum += t->share[k] > 0 ? t->share[k] * (double)from[t->at[k]] : 0;
    return sum;
}

static void fetch_normal(const weft_preview_setup *setup, const taps *t, weft_preview_samples *s, int i)
{
    double n[3] = {0, 0, 1};
    if (setup->surface->normal) {
        for (int c = 0; c < 3; c++)
            n[c] = t->sign[c] * fetch(setup->surface->normal, c, t);
        const double length2 = n[0] * n[0] + n[1] * n[1] + n[2] * n[2];
        const double inverse = length2 > 1e-12 ? 1 / sqrt(length2) : 0; /* NaN fails the test too */
        for (int c = 0; c < 3; c++)
            n[c] = inverse > 0 ? n[c] * inverse : c == 2;
    }
    for (int c = 0; c < 3; c++)
        s->normal[c][i] = n[c];
}

void weft_preview_fetch(const weft_preview_setup *setup, weft_preview_samples *s)
{
    const weft_preview_surface *const surface = setup->surface;
    const int n_planes = weft_brdf_n_planes(surface->brdf);
    for (int i = 0; i < s->n; i++) {
        taps t = {0};
        if (s->hit[i] > 0 && place_taps(setup, s->u[i], s->v[i], &t) < 0.5)
            s->hit[i] = 0;
        fetch_normal(setup, &t, s, i);
        for (int k = 0; k < n_planes; k++) {
            const weft_preview_map map = surface->maps[k];
            double value = surface->params[k];
            if (map.image)
                value = fetch(map.image, map.plane, &t);
            /* NaN fails both tests and becomes the lower end */
            s->param[k][i] =
                value > setup->low[k] ? (value < setup->high[k] ? value : setup->high[k]) : setup->low[k];
        }
    }
}
