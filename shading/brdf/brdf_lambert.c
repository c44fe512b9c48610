#include "shading/brdf/sampling.h"

#include "core/clones.h"

static const weft_brdf_param params[] = {
    {"albedo", "cdiff", 3, 0, 1, 0.5, "", "diffuse reflectance"},
    {0},
};

/* f = c_diff/pi */
WEFT_CLONES
static void eval(const weft_brdf_batch *b, double *const value[3])
{
    const double *const lz = b->light[2];
    for (int c = 0; c < 3; c++) {
        const double *const albedo = b->param[c];
        double *const f = value[c];
        WEFT_INDEPENDENT
        for (int i = 0; i < b->n; i++)
            f[i] = albedo[i] * (lz[i] > 0 ? 1 / WEFT_PI : 0);
    }
}

const weft_brdf weft_brdf_lambert = {
    .name = "lambert",
    .summary = "constant: a perfectly matt surface",
    .source = "Lambert 1760",
    .flags = WEFT_BRDF_RECIPROCAL | WEFT_BRDF_PASSIVE,
    .params = params,
    .eval = eval,
    .sample = weft_brdf_sample_cosine,
    .pdf = weft_brdf_pdf_cosine,
};
