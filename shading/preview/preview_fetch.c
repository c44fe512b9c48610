#define WEFT_SINGLE /* shading/brdf/real.h */

#include "shading/preview/preview_samples.h"

#include "shading/brdf/real.h"

/* Folds a coordinate into 0..size-1 by mirroring at the edges of the texels (-0.5 and size - 0.5). */
static inline double mirror(double t, double size, double *sign)
{
    const double periods = (t + 0.5) / (2 * size), within = 2 * size * (periods - floor(periods));
    const double folded = (within < size ? within : 2 * size - within) - 0.5;
    *sign = within < size ? 1 : -1;
    return folded < 0 ? 0 : folded > size - 1 ? size - 1 : folded;
}

WEFT_CLONES
static void place_taps(const weft_preview_setup *setup, weft_preview_samples *s)
{
    const weft_preview_crop crop = setup->crop;
    const int right = crop.x + crop.width - 1, bottom = crop.y + crop.height - 1;
    const int stride = setup->surface->width;
    WEFT_INDEPENDENT
    for (int i = 0; i < s->n; i++) {
        double sign_x, sign_y;
        const double x = crop.x + mirror(s->u[i], crop.width, &sign_x);
        const double y = crop.y + mirror(s->v[i], crop.height, &sign_y);
        const int x0 = (int)x, y0 = (int)y, x1 = x0 < right ? x0 + 1 : x0, y1 = y0 < bottom ? y0 + 1 : y0;
        const float fx = (float)(x - x0), fy = (float)(y - y0);
        s->at[0][i] = y0 * stride + x0;
        s->at[1][i] = y0 * stride + x1;
        s->at[2][i] = y1 * stride + x0;
        s->at[3][i] = y1 * stride + x1;
        s->share[0][i] = (1 - fx) * (1 - fy);
        s->share[1][i] = fx * (1 - fy);
        s->share[2][i] = (1 - fx) * fy;
        s->share[3][i] = fx * fy;
        s->sign[0][i] = (float)sign_x;
        s->sign[1][i] = (float)sign_y;
    }
}

/* Takes the shares of masked texels away; where most is masked, so is the place. */
static void apply_mask(const weft_mask *mask, weft_preview_samples *s)
{
    for (int i = 0; i < s->n; i++) {
        float sum = 0;
        for (int k = 0; k < 4; k++) {
            s->share[k][i] = mask->data[s->at[k][i]] ? s->share[k][i] : 0;
            sum += s->share[k][i];
        }
        for (int k = 0; k < 4 && sum > 0; k++)
            s->share[k][i] /= sum;
        if (sum < 0.5F)
            s->hit[i] = 0;
    }
}

WEFT_CLONES
static void fetch(const weft_image *image, int plane, const weft_preview_samples *s, float *to)
{
    const float *const from = weft_image_plane(image, plane);
    WEFT_INDEPENDENT
    for (int i = 0; i < s->n; i++) {
        float sum = 0;
        for (int k = 0; k < 4; k++) {
            const float texel = from[s->at[k][i]];
            sum += s->share[k][i] > 0 ? s->share[k][i] * texel : 0; /* a masked texel may be NaN */
        }
        to[i] = sum;
    }
}

WEFT_CLONES
static void fetch_normals(const weft_image *normal, weft_preview_samples *s)
{
    for (int c = 0; c < 3; c++)
        fetch(normal, c, s, s->normal[c]);
    WEFT_INDEPENDENT
    for (int i = 0; i < s->n; i++) {
        const float x = s->sign[0][i] * s->normal[0][i], y = s->sign[1][i] * s->normal[1][i];
        const float z = s->normal[2][i], length2 = x * x + y * y + z * z;
        const float known = length2 > 1e-12F ? 1 : 0; /* NaN fails the test too */
        const float inverse = 1 / sqrtf(known > 0 ? length2 : 1);
        s->normal[0][i] = known > 0 ? x * inverse : 0;
        s->normal[1][i] = known > 0 ? y * inverse : 0;
        s->normal[2][i] = known > 0 ? z * inverse : 1;
    }
}

static void flat_normals(weft_preview_samples *s)
{
    for (int c = 0; c < 3; c++)
        for (int i = 0; i < s->n; i++)
            s->normal[c][i] = c == 2;
}

WEFT_CLONES
static void clamp(float *values, int n, float low, float high)
{
    WEFT_INDEPENDENT
    for (int i = 0; i < n; i++) { /* NaN fails both tests and becomes the lower end */
        const float above = values[i] > low ? values[i] : low;
        values[i] = above < high ? above : high;
    }
}

void weft_preview_fetch(const weft_preview_setup *setup, weft_preview_samples *s)
{
    const weft_preview_surface *const surface = setup->surface;
    place_taps(setup, s);
    if (surface->mask)
        apply_mask(surface->mask, s);
    if (surface->normal)
        fetch_normals(surface->normal, s);
    else
        flat_normals(s);
    for (int k = 0; k < weft_brdf_n_planes(surface->brdf); k++) {
        const weft_preview_map map = surface->maps[k];
        if (map.image)
            fetch(map.image, map.plane, s, s->param[k]);
        for (int i = 0; i < s->n && !map.image; i++)
            s->param[k][i] = (float)surface->params[k];
        clamp(s->param[k], s->n, (float)setup->low[k], (float)setup->high[k]);
    }
}
