#include "shading/brdf/real.h"

/* f = c_diff/pi */
WEFT_CLONES
void WEFT_KERNEL(weft_brdf_eval_lambert)(const weft_brdf_batch_real *b, weft_real *const value[3])
{
    const weft_real *const lz = b->light[2];
    for (int c = 0; c < 3; c++) {
        const weft_real *const albedo = b->param[c];
        weft_real *const f = value[c];
        WEFT_INDEPENDENT
        for (int i = 0; i < b->n; i++)
            f[i] = albedo[i] * (lz[i] > 0 ? 1 / WEFT_PI : 0);
    }
}

#ifndef WEFT_SINGLE /* what there is once */

#include "shading/brdf/sampling.h"

static const weft_brdf_param params[] = {
    {"albedo", "cdiff", 3, 0, 1, 0.5, "", "diffuse reflectance"},
    {0},
};

const weft_brdf weft_brdf_lambert = {
    .name = "lambert",
    .summary = "constant: a perfectly matt surface",
    .source = "Lambert 1760",
    .flags = WEFT_BRDF_RECIPROCAL | WEFT_BRDF_PASSIVE,
    .params = params,
    .eval = weft_brdf_eval_lambert,
    .eval_f32 = weft_brdf_eval_lambert_f32,
    .sample = weft_brdf_sample_cosine,
    .pdf = weft_brdf_pdf_cosine,
};

#endif
