#include "shading/brdf/charlie.h"
#include "shading/brdf/sampling.h"

#include "core/clones.h"

static const weft_brdf_param params[] = {
    {"sheen", NULL, 3, 0, 1, 0.5, "", "colour of the sheen"},
    {"alpha", NULL, 1, 0.1, 1, 0.5, "", "width of the rim (the square of glTF's sheen roughness)"},
    {0},
};

/* f = sheen D G/(4 nl nv). */
WEFT_CLONES
static void eval(const weft_brdf_batch *b, double *const value[3])
{
    const double *const lx = b->light[0], *const ly = b->light[1], *const lz = b->light[2];
    const double *const vx = b->view[0], *const vy = b->view[1], *const vz = b->view[2];
    const double *const cr = b->param[0], *const cg = b->param[1], *const cb = b->param[2];
    const double *const alpha = b->param[3];
    double *const r = value[0], *restrict const g = value[1], *restrict const bl = value[2];
    WEFT_INDEPENDENT
    for (int i = 0; i < b->n; i++) {
        const weft_half h = weft_half_of(lx[i], ly[i], lz[i], vx[i], vy[i], vz[i]);
        const double nl = h.valid > 0 ? h.nl : 1;
        const double dv = h.valid * weft_charlie_d(h.s2, alpha[i]) * weft_charlie_v(nl, h.nv, alpha[i]);
        r[i] = dv * cr[i];
        g[i] = dv * cg[i];
        bl[i] = dv * cb[i];
    }
}

const weft_brdf weft_brdf_charlie = {
    .name = "charlie",
    .summary = "sheen of fibres that stand up, the lobe of glTF's sheen extension: to lie over a base",
    .source = "Estevez and Kulla 2017, Production Friendly Microfacet Sheen BRDF, eqs. 2-4",
    .flags = WEFT_BRDF_RECIPROCAL | WEFT_BRDF_PASSIVE,
    .params = params,
    .eval = eval,
    .sample = weft_brdf_sample_cosine,
    .pdf = weft_brdf_pdf_cosine,
};
