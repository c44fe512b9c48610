/* Call of Duty: WWII's spheres at gloss 0, 60, 120, 180 and 240 of 255, lit from where they are seen. */
#include "shading/figures/figures.h"

#include "core/parallel.h"
#include "shading/bake/gloss.h"
#include "shading/brdf/facet_walk.h"
#include "shading/brdf/half_vector.h"
#include "shading/brdf/multiscatter.h"

#include <stdio.h>

enum { SPHERES = 5, ANGLES = 96, WALKS = 30000, SIDE = 150 };

/* The walks' pi f for light and view that are one, at the cosines (i + 1/2)/ANGLES. */
typedef struct sphere {
    double gloss, walked[ANGLES];
    double (*left)(const struct sphere *, double cosine), (*right)(const struct sphere *, double cosine);
} sphere;

static void walk_angles(void *context, int band, int row_begin, int row_end)
{
    sphere *const spheres = context;
    (void)band;
    for (int row = row_begin; row < row_end; row++) {
        sphere *const s = &spheres[row / ANGLES];
        const double nv = (row % ANGLES + 0.5) / ANGLES, at[3] = {sqrt(1 - nv * nv), 0, nv};
        const weft_facet_surface surface = {weft_gloss_alpha(s->gloss), 0.04, WEFT_FACET_FIRST, 100000};
        s->walked[row % ANGLES] = WEFT_PI * weft_facet_walk(&surface, at, at, WALKS, (uint64_t)row);
    }
}

static double lambert(const sphere *s, double cosine)
{
    (void)s, (void)cosine;
    return 1;
}

static double walked(const sphere *s, double cosine)
{
    const double at = cosine * ANGLES - 0.5;
    const int i = at < 0 ? 0 : at > ANGLES - 2 ? ANGLES - 2 : (int)at;
    return s->walked[i] + (at - i) * (s->walked[i + 1] - s->walked[i]);
}

static double fitted(const sphere *s, double cosine)
{
    const weft_multiscatter m = weft_multiscatter_of(cosine, cosine, cosine, 1, s->gloss);
    return WEFT_PI * weft_multiscatter_f(&m);
}

static void shade(const void *context, const double n[3], double radiance[3])
{
    const sphere *const s = context;
    const double lit = (n[0] < 0 ? s->left : s->right)(s, n[2]) * n[2];
    for (int c = 0; c < 3; c++)
        radiance[c] = 0.8 * lit;
}

weft_err weft_figure_cod_spheres(const char *folder, weft_error *err)
{
    sphere spheres[SPHERES];
    weft_image pictures[2 * SPHERES] = {0}, *each[2 * SPHERES];
    char words[2 * SPHERES][40];
    const char *labels[2 * SPHERES];
    weft_err status = WEFT_OK;
    for (int i = 0; i < SPHERES; i++)
        spheres[i].gloss = 60 * i / 255.0;
    weft_parallel_rows(SPHERES * ANGLES, walk_angles, spheres);
    for (int i = 0; i < 2 * SPHERES; i++) {
        sphere *const s = &spheres[i % SPHERES];
        s->left = i < SPHERES ? lambert : walked;
        s->right = i < SPHERES ? walked : fitted;
        each[i] = &pictures[i];
        labels[i] = words[i];
        snprintf(words[i], sizeof words[i], "%d  %s", i % SPHERES * 60,
                 i < SPHERES ? "Lambert|walks" : "walks|fit");
        if (status == WEFT_OK)
            status = weft_figure_sphere(&pictures[i], SIDE, shade, s, err);
    }
    if (status == WEFT_OK)
        status = weft_figure_save(folder, "cod-walks.png", SPHERES, 2, each, labels, WEFT_TONE_NONE, err);
    for (int i = 0; i < 2 * SPHERES; i++)
        weft_image_fini(&pictures[i]);
    return status;
}
