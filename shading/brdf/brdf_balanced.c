#include "shading/brdf/fresnel.h"
#include "shading/brdf/half_vector.h"

/*
 * f = (1 - F(v.h)) c_diff/pi, S-ORD-08.
 *
 * The seed says that this breaks reciprocity.  It does not, for v.h = l.h; what it breaks, together with a
 * specular lobe, is energy conservation.  Alone it stays below 1.
 */
WEFT_CLONES
void WEFT_KERNEL(weft_brdf_eval_balanced)(const weft_brdf_batch_real *b, weft_real *const value[3])
{
    const weft_real *const lx = b->light[0], *const ly = b->light[1], *const lz = b->light[2];
    const weft_real *const vx = b->view[0], *const vy = b->view[1], *const vz = b->view[2];
    const weft_real *const ar = b->param[0], *const ag = b->param[1], *const ab = b->param[2];
    const weft_real *const fr = b->param[3], *const fg = b->param[4], *const fb = b->param[5];
    weft_real *const r = value[0], *restrict const g = value[1], *restrict const bl = value[2];
    WEFT_INDEPENDENT
    for (int i = 0; i < b->n; i++) {
        const weft_half h = weft_half_of(lx[i], ly[i], lz[i], vx[i], vy[i], vz[i]);
        const weft_real k = h.valid * weft_schlick_rest(h.lh) * (1 / WEFT_PI);
        /* 1 - F = (1 - F0)(1 - (1 - lh)^5) */
        r[i] = k * (1 - fr[i]) * ar[i];
        g[i] = k * (1 - fg[i]) * ag[i];
        bl[i] = k * (1 - fb[i]) * ab[i];
    }
}

#ifndef WEFT_SINGLE /* what there is once */

#include "shading/brdf/sampling.h"

static const weft_brdf_param params[] = {
    {"albedo", "cdiff", 3, 0, 1, 0.5, "", "diffuse reflectance below the coat"},
    {"f0", NULL, 3, 0, 1, 0.04, "", "reflectance of the coat at normal incidence"},
    {0},
};

const weft_brdf weft_brdf_balanced = {
    .name = "lambert-balanced",
    .summary = "Lambert dimmed by what the coat reflects at the half vector",
    .source = "The Order: 1886 (Neubelt, Pettineo 2013) eq. 15; S-ORD-08",
    .flags = WEFT_BRDF_RECIPROCAL | WEFT_BRDF_PASSIVE,
    .params = params,
    .eval = weft_brdf_eval_balanced,
    .eval_f32 = weft_brdf_eval_balanced_f32,
    .sample = weft_brdf_sample_cosine,
    .pdf = weft_brdf_pdf_cosine,
};

#endif
