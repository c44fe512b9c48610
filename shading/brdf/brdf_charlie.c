#include "shading/brdf/charlie.h"

/* f = sheen D G/(4 nl nv). */
WEFT_CLONES
void WEFT_KERNEL(weft_brdf_eval_charlie)(const weft_brdf_batch_real *b, weft_real *const value[3])
{
    const weft_real *const lx = b->light[0], *const ly = b->light[1], *const lz = b->light[2];
    const weft_real *const vx = b->view[0], *const vy = b->view[1], *const vz = b->view[2];
    const weft_real *const cr = b->param[0], *const cg = b->param[1], *const cb = b->param[2];
    const weft_real *const alpha = b->param[3];
    weft_real *const r = value[0], *restrict const g = value[1], *restrict const bl = value[2];
    WEFT_INDEPENDENT
    for (int i = 0; i < b->n; i++) {
        const weft_half h = weft_half_of(lx[i], ly[i], lz[i], vx[i], vy[i], vz[i]);
        const weft_real nl = h.lit;
        const weft_real dv = h.valid * weft_charlie_d(h.s2, alpha[i]) * weft_charlie_v(nl, h.nv, alpha[i]);
        r[i] = dv * cr[i];
        g[i] = dv * cg[i];
        bl[i] = dv * cb[i];
    }
}

#ifndef WEFT_SINGLE /* what there is once */

#include "shading/brdf/sampling.h"

static const weft_brdf_param params[] = {
    {"sheen", NULL, 3, 0, 1, 0.5, "", "colour of the sheen"},
    {"alpha", NULL, 1, 0.1, 1, 0.5, "", "width of the rim (the square of glTF's sheen roughness)"},
    {0},
};

const weft_brdf weft_brdf_charlie = {
    .name = "charlie",
    .summary = "sheen of fibres that stand up, the lobe of glTF's sheen extension: to lie over a base",
    .source = "Estevez and Kulla 2017, Production Friendly Microfacet Sheen BRDF, eqs. 2-4",
    .flags = WEFT_BRDF_RECIPROCAL | WEFT_BRDF_PASSIVE,
    .params = params,
    .eval = weft_brdf_eval_charlie,
    .eval_f32 = weft_brdf_eval_charlie_f32,
    .sample = weft_brdf_sample_cosine,
    .pdf = weft_brdf_pdf_cosine,
};

#endif
