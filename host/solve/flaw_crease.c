/* Creases: lines across which the averaged surface bends. */
#include "host/solve/flaw_search.h"
#include "host/solve/running_mean.h"
#include "shading/bake/height.h"

#include <math.h>

enum { ROUNDS = 3 };

/* The weave is averaged out with this sigma; more would blur the crease. */
static const double crease_sigma_mm = 2;
/* Least curvature, 1/mm, and in units of the cloth's usual one. */
static const float crease_curvature = 0.03F, crease_usual = 8;

/* Slopes and weights, averaged. */
static weft_err average_slopes(const weft_flaw_search *s, weft_image *slopes, weft_error *err)
{
    const weft_maps *const maps = s->maps;
    const double sigma_px = crease_sigma_mm / maps->mm_per_px;
    const int reach = (int)lround((sqrt(4 * sigma_px * sigma_px + 1) - 1) / 2);
    const size_t n = weft_image_plane_size(slopes);
    for (size_t i = 0; i < n; i++) {
        const bool use = s->cloth->data[i];
        for (int c = 0; c < 2; c++)
            weft_image_plane(slopes, c)[i] =
                use ? (float)weft_height_slope((double)weft_image_plane(&maps->normal, c)[i],
                                               (double)weft_image_plane(&maps->normal, 2)[i])
                    : 0;
        weft_image_plane(slopes, 2)[i] = use ? 1 : 0;
    }
    WEFT_TRY(weft_running_mean(slopes, reach, ROUNDS, err));
    for (size_t i = 0; i < n; i++)
        for (int c = 0; c < 2; c++)
            weft_image_plane(slopes, c)[i] /= fmaxf(weft_image_plane(slopes, 2)[i], 1e-6F);
    return WEFT_OK;
}

/* Largest curvature of the averaged surface; 0 near what has no answer, where the average is lopsided. */
static float curvature_at(const weft_image *slopes, double mm_per_px, int u, int v)
{
    const double scale = 0.5 / mm_per_px;
    if (u < 1 || v < 1 || u + 1 >= slopes->width || v + 1 >= slopes->height)
        return 0;
    for (int k = -1; k <= 1; k++)
        if (weft_image_row(slopes, 2, v + k)[u] < 0.25F || weft_image_row(slopes, 2, v)[u + k] < 0.25F)
            return 0;
    double d[2][2]; /* of p and q, along x and y (rows go down) */
    for (int c = 0; c < 2; c++) {
        d[c][0] = scale * (double)(weft_image_row(slopes, c, v)[u + 1] - weft_image_row(slopes, c, v)[u - 1]);
        d[c][1] = scale * (double)(weft_image_row(slopes, c, v - 1)[u] - weft_image_row(slopes, c, v + 1)[u]);
    }
    const double mean = (d[0][0] + d[1][1]) / 2;
    return (float)(fabs(mean) + hypot((d[0][0] - d[1][1]) / 2, (d[0][1] + d[1][0]) / 2));
}

weft_err weft_flaw_find_creases(weft_flaw_search *s, weft_error *err)
{
    weft_image slopes, curvature = {0};
    float usual = 0;
    WEFT_TRY(weft_image_init(&slopes, s->maps->width, s->maps->height, 3, err));
    weft_err status = weft_image_init(&curvature, s->maps->width, s->maps->height, 1, err);
    if (status == WEFT_OK)
        status = average_slopes(s, &slopes, err);
    for (int v = 0; v < curvature.height && status == WEFT_OK; v++)
        for (int u = 0; u < curvature.width; u++)
            weft_image_row(&curvature, 0, v)[u] = curvature_at(&slopes, s->maps->mm_per_px, u, v);
    if (status == WEFT_OK)
        status = weft_flaw_quantile(&curvature, s->cloth, 0.5, &usual, err);
    if (status == WEFT_OK) {
        const float strong = fmaxf(crease_curvature, crease_usual * usual);
        weft_flaw_mark(&curvature, strong, strong / 2, &s->marks);
        s->least_mm = 12;
        s->widest_mm = 5;
        status = weft_components_keep(&s->marks, weft_flaw_keep, s, err);
    }
    weft_image_fini(&slopes);
    weft_image_fini(&curvature);
    return status;
}
