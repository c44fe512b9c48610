#include "shading/brdf/cloth.h"
#include "shading/brdf/fresnel.h"
#include "shading/brdf/ggx.h"

enum {
    ALBEDO = 0,
    F0 = 3,
    ALPHA = 6,
    CLOTH = 7,
    CLOTH_ALBEDO = 8,
    CLOTH_F0 = 11,
    FRONT = 12,
    RIM = 15,
    CLOTH_ALPHA = 18,
    AMPLITUDE = 19
}; /* first planes */

/* f = (1 - w) f_ggx + w f_cloth: both shaded, each with parameters of its own, and the radiance blended. */
WEFT_CLONES
void WEFT_KERNEL(weft_brdf_eval_ggx_cloth)(const weft_brdf_batch_real *b, weft_real *const value[3])
{
    const weft_real *const lx = b->light[0], *const ly = b->light[1], *const lz = b->light[2];
    const weft_real *const vx = b->view[0], *const vy = b->view[1], *const vz = b->view[2];
    const weft_real *const alpha = b->param[ALPHA], *const weight = b->param[CLOTH];
    const weft_real *const cloth_f0 = b->param[CLOTH_F0], *const cloth_alpha = b->param[CLOTH_ALPHA];
    const weft_real *const amplitude = b->param[AMPLITUDE];
    WEFT_INDEPENDENT
    for (int i = 0; i < b->n; i++) {
        const weft_half h = weft_half_of(lx[i], ly[i], lz[i], vx[i], vy[i], vz[i]);
        const weft_real nl = h.lit, power = weft_schlick_power(h.grazing), w = weight[i];
        const weft_real diffuse = h.valid * weft_schlick_rest(h.lh) * (1 / WEFT_PI);
        const weft_real dv = h.valid * weft_ggx_d(h.nh, h.s2, alpha[i]) * weft_ggx_v1(nl, alpha[i]) *
                             weft_ggx_v1(h.nv, alpha[i]);
        const weft_real fibre = cloth_f0[i] + (1 - cloth_f0[i]) * power;
        const weft_real fv = h.valid * fibre * weft_cloth_v(nl, h.nv);
        const weft_real rim = weft_cloth_rim(h.nh, h.s2, cloth_alpha[i]);
        for (int c = 0; c < 3; c++) {
            const weft_real f0 = b->param[F0 + c][i];
            const weft_real smooth = (1 - f0) * (diffuse * b->param[ALBEDO + c][i] + dv * power) + dv * f0;
            const weft_real cloth =
                (1 - cloth_f0[i]) * diffuse * b->param[CLOTH_ALBEDO + c][i] +
                fv * weft_cloth_d_tinted(rim, b->param[FRONT + c][i], b->param[RIM + c][i], cloth_alpha[i],
                                         amplitude[i]);
            value[c][i] = weft_mix(smooth, cloth, w);
        }
    }
}

#ifndef WEFT_SINGLE /* what there is once */

#include "shading/brdf/sampling.h"

static const weft_brdf_param params[] = {
    {"albedo", "cdiff", 3, 0, 1, 0.5, "", "diffuse reflectance of the smooth part"},
    {"f0", NULL, 3, 0, 1, 0.04, "", "reflectance of the smooth part at normal incidence"},
    {"alpha", NULL, 1, 1e-4, 1, 0.3, "", "width of the GGX lobe"},
    {"cloth", NULL, 1, 0, 1, 0.5, "", "share of the surface that is cloth"},
    {"cloth_albedo", NULL, 3, 0, 1, 0.5, "", "diffuse reflectance of the cloth"},
    {"cloth_f0", NULL, 1, 0, 1, 0.04, "", "reflectance of its fibres at normal incidence, without tint"},
    {"front", NULL, 3, 0, 1, 1, "", "tint of what the fibres reflect to the front"},
    {"rim", NULL, 3, 0, 1, 1, "", "tint of the rim"},
    {"cloth_alpha", NULL, 1, 1e-4, 1, 0.5, "", "width of the rim lobe"},
    {"amplitude", "A", 1, 0, 4, 4, "", "weight of the rim lobe against the constant offset"},
    {0},
};

/* Share of samples for the GGX lobe: its part of the light that would be reflected. */
static double specular_share(const weft_brdf_batch *b, int i)
{
    const double f0 = (b->param[F0][i] + b->param[F0 + 1][i] + b->param[F0 + 2][i]) / 3;
    const double specular = weft_fresnel_schlick(f0, weft_max(b->view[2][i], 0));
    return weft_sample_share((1 - b->param[CLOTH][i]) * specular, 1 - (1 - b->param[CLOTH][i]) * specular);
}

static void sample(const weft_brdf_batch *b, const double *const u[3], double *const light[3])
{
    for (int i = 0; i < b->n; i++)
        weft_sample_mixed(b, i, specular_share(b, i), b->param[ALPHA][i], b->param[ALPHA][i], u, light);
}

static void pdf(const weft_brdf_batch *b, double *density)
{
    for (int i = 0; i < b->n; i++)
        density[i] = weft_pdf_mixed(b, i, specular_share(b, i), b->param[ALPHA][i], b->param[ALPHA][i]);
}

/* Not passive, as its GGX part is not. */
const weft_brdf weft_brdf_ggx_cloth = {
    .name = "ggx-cloth",
    .summary = "GGX and two-tone cloth side by side by a share: layers of both kinds",
    .source = "The Order: 1886 (Neubelt, Pettineo 2013), compositing; S-ORD-26 with S-ORD-08 and S-ORD-16",
    .flags = WEFT_BRDF_RECIPROCAL,
    .params = params,
    .eval = weft_brdf_eval_ggx_cloth,
    .eval_f32 = weft_brdf_eval_ggx_cloth_f32,
    .sample = sample,
    .pdf = pdf,
};

#endif
