/* Tables of the models beyond the first material: Beckmann, Unreal, Call of Duty, Far Cry 3, the blog. */
#include "shading/brdf/albedo.h"
#include "shading/brdf/beckmann.h"
#include "shading/brdf/blinn_phong.h"
#include "shading/brdf/cook_torrance.h"
#include "shading/brdf/fresnel.h"
#include "shading/brdf/ggx.h"
#include "shading/brdf/metallic.h"
#include "shading/brdf/multiscatter.h"
#include "shading/brdf/schlick_smith.h"
#include "shading/vectors/vectors_pair.h"

static void beckmann(int n, const double *const *in, double *const *out)
{
    for (int i = 0; i < n; i++) {
        const double m = in[0][i], f0 = in[1][i], values[WEFT_BRDF_MAX_PLANES] = {f0, f0, f0, m};
        const weft_half h = weft_vectors_half(in[2][i], in[3][i], in[4][i]);
        out[0][i] = weft_beckmann_d(h.nh, h.s2, m);
        out[1][i] = weft_beckmann_g1(h.nl, m);
        out[2][i] = weft_beckmann_g1(h.nv, m);
        out[3][i] = weft_vectors_eval_at("beckmann", values, in[2][i], 0, in[3][i], in[4][i]);
    }
}

/* The specular lobe alone: a metal of base colour F0. */
static void unreal(int n, const double *const *in, double *const *out)
{
    for (int i = 0; i < n; i++) {
        const double roughness = in[0][i], f0 = in[1][i], alpha = roughness * roughness;
        const double values[WEFT_BRDF_MAX_PLANES] = {f0, f0, f0, 1, roughness, 1};
        const weft_half h = weft_vectors_half(in[2][i], in[3][i], in[4][i]);
        const double k = weft_schlick_k_unreal(roughness), k_image = weft_schlick_k_ggx(alpha);
        out[0][i] = weft_ggx_d(h.nh, h.s2, alpha);
        out[1][i] = weft_schlick_g1(h.nl, k) * weft_schlick_g1(h.nv, k);
        out[2][i] = weft_schlick_g1(h.nl, k_image) * weft_schlick_g1(h.nv, k_image);
        out[3][i] = weft_fresnel_gauss_ue4(f0, h.lh);
        out[4][i] = weft_vectors_eval_at("unreal", values, in[2][i], 0, in[3][i], in[4][i]);
    }
}

static void multiscatter(int n, const double *const *in, double *const *out)
{
    for (int i = 0; i < n; i++) {
        const double values[WEFT_BRDF_MAX_PLANES] = {1, 1, 1, in[0][i]};
        const weft_half h = weft_vectors_half(in[1][i], in[2][i], in[3][i]);
        const weft_multiscatter m = weft_multiscatter_of(h.nl, h.nv, h.nh, h.lh, in[0][i]);
        out[0][i] = m.rough;
        out[1][i] = m.smooth;
        out[2][i] = m.share;
        out[3][i] = m.base;
        out[4][i] = m.bump;
        out[5][i] = weft_vectors_eval_at("lambert-multiscatter", values, in[1][i], 0, in[2][i], in[3][i]);
    }
}

static void multiscatter_albedo(int n, const double *const *in, double *const *out)
{
    const weft_brdf *brdf;
    if (weft_brdf_find("lambert-multiscatter", &brdf, NULL) != WEFT_OK)
        return;
    for (int i = 0; i < n; i++) {
        const double values[WEFT_BRDF_MAX_PLANES] = {1, 1, 1, in[0][i]};
        double albedo[3] = {(double)NAN}, nv = in[1][i];
        if (weft_vectors_view(&nv))
            weft_brdf_albedo(brdf, values, nv, 0, WEFT_ALBEDO_EXACT, albedo);
        out[0][i] = albedo[0];
    }
}

static void multiscatter_slice(int n, const double *const *in, double *const *out)
{
    for (int i = 0; i < n; i++)
        out[0][i] = weft_multiscatter_slice(in[0][i], in[1][i]);
}

static void blinn_phong(int n, const double *const *in, double *const *out)
{
    for (int i = 0; i < n; i++) {
        const double f0 = in[1][i], values[WEFT_BRDF_MAX_PLANES] = {f0, f0, f0, in[0][i]};
        const weft_half h = weft_vectors_half(in[2][i], in[3][i], in[4][i]);
        const double power = weft_blinn_phong_power(in[0][i]), k = weft_schlick_k_power(power);
        out[0][i] = power;
        out[1][i] = k;
        out[2][i] = weft_blinn_phong_d(h.nh, h.s2, power) / 4;
        out[3][i] = weft_schlick_v1(h.nl, k) * weft_schlick_v1(h.nv, k);
        out[4][i] = weft_fresnel_schlick(f0, h.lh);
        out[5][i] = weft_fresnel_gauss_fc3(f0, h.lh);
        out[6][i] = weft_vectors_eval_at("blinn-phong", values, in[2][i], 0, in[3][i], in[4][i]);
    }
}

static void average_visibility(int n, const double *const *in, double *const *out)
{
    for (int i = 0; i < n; i++) {
        const double power = weft_blinn_phong_power(in[0][i]), k = weft_schlick_k_power(power);
        out[0][i] = power;
        out[1][i] = k;
        out[2][i] = weft_blinn_phong_average_visibility(k);
        out[3][i] = weft_blinn_phong_energy(power);
        out[4][i] = weft_blinn_phong_energy_fit(in[0][i]);
        out[5][i] = weft_blinn_phong_energy_shipped(power);
    }
}

static void cook_torrance(int n, const double *const *in, double *const *out)
{
    for (int i = 0; i < n; i++) {
        const weft_half h = weft_vectors_half(in[2][i], in[3][i], in[4][i]);
        int column = 0;
        for (int d = 0; d < WEFT_CT_D_COUNT; d++)
            out[column++][i] = weft_ct_d(d, &h, in[0][i]);
        for (int g = 0; g < WEFT_CT_G_COUNT; g++)
            out[column++][i] = weft_ct_v(g, &h, in[0][i]) * h.nl * h.nv;
        for (int f = 0; f < WEFT_CT_F_COUNT; f++)
            out[column++][i] = weft_ct_f(f, in[1][i], &h);
    }
}

static void disney(int n, const double *const *in, double *const *out)
{
    for (int i = 0; i < n; i++) {
        double values[WEFT_BRDF_MAX_PLANES] = {0}, f[3];
        for (int k = 0; k < 13; k++) /* the table's order is that of the parameters */
            values[k] = in[k][i];
        weft_vectors_eval_rgb("disney", values, in[13][i], in[14][i], in[15][i], in[16][i], f);
        for (int c = 0; c < 3; c++)
            out[c][i] = f[c];
    }
}

static void metallic(int n, const double *const *in, double *const *out)
{
    for (int i = 0; i < n; i++)
        for (int c = 0; c < 3; c++) {
            out[c][i] = weft_metallic_diffuse(in[c][i], in[3][i]);
            out[3 + c][i] = weft_metallic_f0(in[c][i], in[3][i], WEFT_F0_PRESET);
            out[6 + c][i] = weft_metallic_f0(in[c][i], in[3][i], WEFT_F0_UNREAL);
        }
}

const weft_vectors_model weft_vectors_more_reflectance[] = {
    {"blog_disney", "S-BLG-05",
     "r g b subsurface metallic specular specularTint roughness anisotropic sheen sheenTint clearcoat "
     "clearcoatGloss nl phi_l nv phi_v",
     "r g b", 1e-9, disney},
    {"blog_metallic", "S-BLG-01 S-UE4-12", "r g b metallic", "dr dg db s03r s03g s03b s04r s04g s04b", 1e-12,
     metallic},
    {"blog_terms", "S-BLG-04", "alpha f0 nl nv phi",
     "D_blinn D_beckmann D_ggx G_implicit G_neumann G_cooktorrance G_kelemen G_smith_beckmann G_smith_ggx "
     "G_schlick_beckmann G_schlick_ggx F_none F_schlick F_exact",
     1e-9, cook_torrance},
    {"cod_msdiffuse", "S-COD-23", "gloss nl nv phi", "f0 f1 t fd fb fr", 1e-11, multiscatter},
    {"cod_msdiffuse_albedo", "S-COD-23", "gloss nv", "albedo", 1e-11, multiscatter_albedo},
    {"cod_slice15", "S-COD-22", "nh lh", "f", 1e-11, multiscatter_slice},
    {"fc3_avgvis", "S-FC3-13", "gloss", "m a avgV E Efit Efinal", 1e-11, average_visibility},
    {"fc3_brdf", "S-FC3-09 to S-FC3-12", "gloss f0 nl nv phi", "m a D4 V Fschlick Fsg f", 1e-10, blinn_phong},
    {"ord_beckmann", "S-ORD-24", "m f0 nl nv phi", "D G1l G1v f", 1e-9, beckmann},
    {"ue4_brdf", "S-UE4-02 to S-UE4-05", "roughness f0 nl nv phi", "D G Gibl F f", 1e-9, unreal},
    {0},
};
