#include "shading/brdf/fresnel.h"
#include "shading/brdf/ggx.h"
#include "shading/brdf/metallic.h"
#include "shading/brdf/schlick_smith.h"

enum { BASE = 0, METALLIC = 3, ROUGHNESS = 4, CAVITY = 5 }; /* first planes */

/* f = c_diff/pi + cavity D F V1(nl) V1(nv)/4: GGX of roughness^2, Schlick's masking with k = (roughness +
 * 1)^2/8. */
WEFT_CLONES
void WEFT_KERNEL(weft_brdf_eval_unreal)(const weft_brdf_batch_real *b, weft_real *const value[3])
{
    const weft_real *const lx = b->light[0], *const ly = b->light[1], *const lz = b->light[2];
    const weft_real *const vx = b->view[0], *const vy = b->view[1], *const vz = b->view[2];
    const weft_real *const metallic = b->param[METALLIC], *const roughness = b->param[ROUGHNESS];
    const weft_real *const cavity = b->param[CAVITY];
    WEFT_INDEPENDENT
    for (int i = 0; i < b->n; i++) {
        const weft_half h = weft_half_of(lx[i], ly[i], lz[i], vx[i], vy[i], vz[i]);
        const weft_real nl = h.lit, k = weft_schlick_k_unreal(roughness[i]);
        const weft_real d = weft_ggx_d(h.nh, h.s2, roughness[i] * roughness[i]);
        const weft_real dv = cavity[i] * h.valid * d * weft_schlick_v1(nl, k) * weft_schlick_v1(h.nv, k) / 4;
        const weft_real w = weft_gauss_weight_ue4(h.lh), lit = h.valid / WEFT_PI;
        for (int c = 0; c < 3; c++) {
            const weft_real base = b->param[BASE + c][i];
            const weft_real f0 = weft_metallic_f0(base, metallic[i], WEFT_F0_UNREAL);
            value[c][i] = lit * weft_metallic_diffuse(base, metallic[i]) + dv * (f0 + (1 - f0) * w);
        }
    }
}

#ifndef WEFT_SINGLE /* what there is once */

#include "shading/brdf/sampling.h"

static const weft_brdf_param params[] = {
    {"base", NULL, 3, 0, 1, 0.5, "", "base colour: diffuse reflectance of dielectrics, F0 of metals"},
    {"metallic", NULL, 1, 0, 1, 0, "", "0 dielectric (F0 0.04), 1 metal"},
    {"roughness", NULL, 1, 0.01, 1, 0.5, "", "the artist's roughness; the width of the lobe is its square"},
    {"cavity", NULL, 1, 0, 1, 1, "",
     "0 in grooves too small for the normals: a shadow on the specular light"},
    {0},
};

static double specular_share(const weft_brdf_batch *b, int i)
{
    const double base = (b->param[BASE][i] + b->param[BASE + 1][i] + b->param[BASE + 2][i]) / 3;
    const double f0 = weft_metallic_f0(base, b->param[METALLIC][i], WEFT_F0_UNREAL);
    return weft_sample_share(b->param[CAVITY][i] * weft_fresnel_schlick(f0, weft_max(b->view[2][i], 0)),
                             weft_metallic_diffuse(base, b->param[METALLIC][i]));
}

static void sample(const weft_brdf_batch *b, const double *const u[3], double *const light[3])
{
    for (int i = 0; i < b->n; i++) {
        const double alpha = b->param[ROUGHNESS][i] * b->param[ROUGHNESS][i];
        weft_sample_mixed(b, i, specular_share(b, i), alpha, alpha, u, light);
    }
}

static void pdf(const weft_brdf_batch *b, double *density)
{
    for (int i = 0; i < b->n; i++) {
        const double alpha = b->param[ROUGHNESS][i] * b->param[ROUGHNESS][i];
        density[i] = weft_pdf_mixed(b, i, specular_share(b, i), alpha, alpha);
    }
}

/* Not passive: Lambert and the lobe are added without balance. */
const weft_brdf weft_brdf_unreal = {
    .name = "unreal",
    .summary = "Lambert and GGX by base colour, metallic and roughness: Unreal Engine 4's standard material",
    .source =
        "Real Shading in Unreal Engine 4 (Karis 2013) eqs. 1-5; S-UE4-01 to S-UE4-05, S-UE4-11, S-UE4-12",
    .flags = WEFT_BRDF_RECIPROCAL,
    .params = params,
    .eval = weft_brdf_eval_unreal,
    .eval_f32 = weft_brdf_eval_unreal_f32,
    .sample = sample,
    .pdf = pdf,
};

#endif
