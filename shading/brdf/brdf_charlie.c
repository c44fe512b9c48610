#include "shading/brdf/charlie.h"
#include "shading/brdf/sampling.h"

static const weft_brdf_param params[] = {
    {"sheen", NULL, 3, 0, 1, 0.5, "", "colour of the sheen"},
    {"alpha", NULL, 1, 0.1, 1, 0.5, "", "width of the rim (the square of glTF's sheen roughness)"},
    {0},
};

/* f = sheen D G/(4 nl nv). */
static void eval(const weft_brdf_batch *b, double *const value[3])
{
    for (int i = 0; i < b->n; i++) {
        const weft_half h = weft_half_of(b->light[0][i], b->light[1][i], b->light[2][i], b->view[0][i],
                                         b->view[1][i], b->view[2][i]);
        const double alpha = b->param[3][i];
        const double dv = h.valid > 0 ? weft_charlie_d(h.s2, alpha) * weft_charlie_v(h.nl, h.nv, alpha) : 0;
        for (int c = 0; c < 3; c++)
            value[c][i] = dv * b->param[c][i];
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
