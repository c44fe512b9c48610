#include "shading/brdf/multiscatter.h"

/* f = rho/pi (fd + fb), S-COD-23. */
WEFT_CLONES
void WEFT_KERNEL(weft_brdf_eval_multiscatter)(const weft_brdf_batch_real *b, weft_real *const value[3])
{
    const weft_real *const lx = b->light[0], *const ly = b->light[1], *const lz = b->light[2];
    const weft_real *const vx = b->view[0], *const vy = b->view[1], *const vz = b->view[2];
    const weft_real *const cr = b->param[0], *const cg = b->param[1], *const cb = b->param[2];
    const weft_real *const gloss = b->param[3];
    weft_real *const r = value[0], *restrict const g = value[1], *restrict const bl = value[2];
    WEFT_INDEPENDENT
    for (int i = 0; i < b->n; i++) {
        const weft_half h = weft_half_of(lx[i], ly[i], lz[i], vx[i], vy[i], vz[i]);
        const weft_real nl = h.lit;
        const weft_multiscatter m = weft_multiscatter_of(nl, h.nv, h.nh, h.lh, gloss[i]);
        const weft_real f = h.valid * weft_multiscatter_f(&m);
        r[i] = f * cr[i];
        g[i] = f * cg[i];
        bl[i] = f * cb[i];
    }
}

#ifndef WEFT_SINGLE /* what there is once */

#include "shading/brdf/sampling.h"

static const weft_brdf_param params[] = {
    {"albedo", "cdiff", 3, 0, 1, 0.5, "", "diffuse reflectance"},
    {"gloss", NULL, 1, 0, 1, 0.3, "", "gloss of the facets: alpha = sqrt(2/(1 + 2^(18 gloss)))"},
    {0},
};

/* Not passive: at gloss 0 grazing views return up to 1.16 of the light; the mean over views stays below 1. */
const weft_brdf weft_brdf_multiscatter = {
    .name = "lambert-multiscatter",
    .summary = "diffuse light of rough facets with what scatters between them: Call of Duty: WWII's",
    .source = "Material Advances in Call of Duty: WWII (Chan 2018) pages 83-94; S-COD-23",
    .flags = WEFT_BRDF_RECIPROCAL,
    .params = params,
    .eval = weft_brdf_eval_multiscatter,
    .eval_f32 = weft_brdf_eval_multiscatter_f32,
    .sample = weft_brdf_sample_cosine,
    .pdf = weft_brdf_pdf_cosine,
};

#endif
