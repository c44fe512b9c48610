#include "shading/brdf/blinn_phong.h"
#include "shading/brdf/fresnel.h"
#include "shading/brdf/sampling.h"

enum { F0 = 0, GLOSS = 3 }; /* first planes */

static const weft_brdf_param params[] = {
    {"f0", NULL, 3, 0, 1, 0.04, "", "reflectance at normal incidence"},
    {"gloss", NULL, 1, 0, 1, 0.4, "", "the power of the lobe is 2^(13 gloss)"},
    {0},
};

/* f = F D/4 V1(nl) V1(nv), S-FC3-09 to S-FC3-12. */
static void eval(const weft_brdf_batch *b, double *const value[3])
{
    for (int i = 0; i < b->n; i++) {
        const weft_half h = weft_half_of(b->light[0][i], b->light[1][i], b->light[2][i], b->view[0][i],
                                         b->view[1][i], b->view[2][i]);
        const double nl = h.valid > 0 ? h.nl : 1, power = weft_blinn_phong_power(b->param[GLOSS][i]);
        const double k = weft_schlick_k_power(power);
        const double dv =
            h.valid * weft_blinn_phong_d(h.s2, power) / 4 * weft_schlick_v1(nl, k) * weft_schlick_v1(h.nv, k);
        for (int c = 0; c < 3; c++)
            value[c][i] = dv * weft_fresnel_schlick(b->param[F0 + c][i], h.lh);
    }
}

static double lobe_width(const weft_brdf_batch *b, int i)
{
    return weft_blinn_phong_alpha_of_power(weft_blinn_phong_power(b->param[GLOSS][i]));
}

static void sample(const weft_brdf_batch *b, const double *const u[3], double *const light[3])
{
    for (int i = 0; i < b->n; i++)
        weft_sample_mixed(b, i, 1, lobe_width(b, i), lobe_width(b, i), u, light);
}

static void pdf(const weft_brdf_batch *b, double *density)
{
    for (int i = 0; i < b->n; i++)
        density[i] = weft_pdf_mixed(b, i, 1, lobe_width(b, i), lobe_width(b, i));
}

const weft_brdf weft_brdf_blinn_phong = {
    .name = "blinn-phong",
    .summary = "normalised Blinn-Phong with Schlick-Smith visibility: Far Cry 3's specular lobe",
    .source = "Lighting Far Cry 3 (McAuley 2012); S-FC3-09 to S-FC3-12",
    .flags = WEFT_BRDF_RECIPROCAL | WEFT_BRDF_PASSIVE,
    .params = params,
    .eval = eval,
    .sample = sample,
    .pdf = pdf,
};
