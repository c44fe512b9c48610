#include "shading/brdf/fresnel.h"
#include "shading/brdf/sampling.h"

#include "core/clones.h"

static const weft_brdf_param params[] = {
    {"albedo", "cdiff", 3, 0, 1, 0.5, "", "diffuse reflectance below the coat"},
    {"f0", NULL, 3, 0, 1, 0.04, "", "reflectance of the coat at normal incidence"},
    {0},
};

/* f = 21 (1 - F0)/(20 pi) c_diff [1 - (1-nl)^5] [1 - (1-nv)^5], S-ORD-09: the albedo is exactly
 * c_diff (1 - F_Schlick(nv)). */
WEFT_CLONES
static void eval(const weft_brdf_batch *b, double *const value[3])
{
    const double *const lz = b->light[2], *const vz = b->view[2];
    for (int c = 0; c < 3; c++) {
        const double *const albedo = b->param[c], *const f0 = b->param[3 + c];
        double *const f = value[c];
        WEFT_INDEPENDENT
        for (int i = 0; i < b->n; i++) {
            const double nl = lz[i] > 0 ? lz[i] : 0, nv = weft_max(vz[i], WEFT_MIN_NV);
            const double k = 21 / (20 * WEFT_PI) * (1 - weft_schlick_weight(nl));
            f[i] = k * (1 - weft_schlick_weight(nv)) * (1 - f0[i]) * albedo[i];
        }
    }
}

const weft_brdf weft_brdf_coupled = {
    .name = "lambert-coupled",
    .summary = "matt base below a mirror-like coat: reciprocal and energy conserving",
    .source = "Shirley et al. 1997; S-ORD-09",
    .flags = WEFT_BRDF_RECIPROCAL | WEFT_BRDF_PASSIVE,
    .params = params,
    .eval = eval,
    .sample = weft_brdf_sample_cosine,
    .pdf = weft_brdf_pdf_cosine,
};
