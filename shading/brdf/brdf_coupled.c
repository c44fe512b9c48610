#include "shading/brdf/fresnel.h"
#include "shading/brdf/half_vector.h"

/* f = 21 (1 - F0)/(20 pi) c_diff [1 - (1-nl)^5] [1 - (1-nv)^5], S-ORD-09: the albedo is exactly
 * c_diff (1 - F_Schlick(nv)). */
WEFT_CLONES
void WEFT_KERNEL(weft_brdf_eval_coupled)(const weft_brdf_batch_real *b, weft_real *const value[3])
{
    const weft_real *const lz = b->light[2], *const vz = b->view[2];
    for (int c = 0; c < 3; c++) {
        const weft_real *const albedo = b->param[c], *const f0 = b->param[3 + c];
        weft_real *const f = value[c];
        WEFT_INDEPENDENT
        for (int i = 0; i < b->n; i++) {
            const weft_real nl = lz[i] > 0 ? lz[i] : 0, nv = weft_max(vz[i], WEFT_MIN_NV);
            const weft_real k = 21 / (20 * WEFT_PI) * weft_schlick_rest(nl);
            f[i] = k * weft_schlick_rest(nv) * (1 - f0[i]) * albedo[i];
        }
    }
}

#ifndef WEFT_SINGLE /* what there is once */

#include "shading/brdf/sampling.h"

static const weft_brdf_param params[] = {
    {"albedo", "cdiff", 3, 0, 1, 0.5, "", "diffuse reflectance below the coat"},
    {"f0", NULL, 3, 0, 1, 0.04, "", "reflectance of the coat at normal incidence"},
    {0},
};

const weft_brdf weft_brdf_coupled = {
    .name = "lambert-coupled",
    .summary = "matt base below a mirror-like coat: reciprocal and energy conserving",
    .source = "Shirley et al. 1997; S-ORD-09",
    .flags = WEFT_BRDF_RECIPROCAL | WEFT_BRDF_PASSIVE,
    .params = params,
    .eval = weft_brdf_eval_coupled,
    .eval_f32 = weft_brdf_eval_coupled_f32,
    .sample = weft_brdf_sample_cosine,
    .pdf = weft_brdf_pdf_cosine,
};

#endif
