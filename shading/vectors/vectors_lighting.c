/* Tables of lights, sky, environment, occlusion, and of colour. */
#include "core/colour.h"
#include "shading/bake/gloss.h"
#include "shading/brdf/ggx.h"
#include "shading/brdf/sampling.h"
#include "shading/lighting/ambient_occlusion.h"
#include "shading/lighting/area_light.h"
#include "shading/lighting/environment.h"
#include "shading/lighting/sky.h"
#include "shading/lighting/volume_light.h"
#include "shading/preview/bilateral.h"
#include "shading/vectors/vectors_pair.h"

static void falloff(int n, const double *const *in, double *const *out)
{
    for (int i = 0; i < n; i++)
        out[0][i] = weft_light_falloff(in[0][i], in[1][i]);
}

static void put_point(const weft_light_point *point, int i, double *const *out)
{
    for (int c = 0; c < 3; c++)
        out[c][i] = point->l[c];
}

static void sphere(int n, const double *const *in, double *const *out)
{
    for (int i = 0; i < n; i++) {
        const double centre[3] = {in[0][i], in[1][i], in[2][i]}, r[3] = {in[3][i], in[4][i], in[5][i]};
        const weft_light_point point = weft_light_sphere(centre, r, in[6][i], in[7][i]);
        put_point(&point, i, out);
        out[3][i] = point.alpha;
        out[4][i] = point.norm;
    }
}

static void tube(int n, const double *const *in, double *const *out)
{
    for (int i = 0; i < n; i++) {
        const double l0[3] = {in[0][i], in[1][i], in[2][i]}, l1[3] = {in[3][i], in[4][i], in[5][i]};
        const double normal[3] = {in[6][i], in[7][i], in[8][i]}, r[3] = {in[9][i], in[10][i], in[11][i]};
        const weft_light_tube t = weft_light_tube_of(l0, l1, r, in[12][i]);
        out[0][i] = out[1][i] = weft_light_tube_irradiance(l0, l1, normal);
        out[2][i] = weft_light_tube_irradiance_soft(l0, l1, normal);
        out[3][i] = t.smallest_angle;
        out[4][i] = t.smallest_distance;
        out[5][i] = t.t;
        put_point(&t.point, i, &out[6]);
        out[9][i] = t.point.norm;
    }
}

static void hammersley(int n, const double *const *in, double *const *out)
{
    for (int i = 0; i < n; i++) {
        double point[2];
        weft_hammersley((uint32_t)in[0][i], (uint32_t)in[1][i], point);
        out[0][i] = point[0];
        out[1][i] = point[1];
    }
}

static void importance(int n, const double *const *in, double *const *out)
{
    for (int i = 0; i < n; i++) {
        const double normal[3] = {in[3][i], in[4][i], in[5][i]}, alpha = in[2][i] * in[2][i], u2 = in[1][i];
        const double cosine = weft_sample_ggx_cosine(alpha, u2);
        double h[3];
        weft_sample_ggx_normal(normal, alpha, in[0][i], u2, h);
        for (int c = 0; c < 3; c++)
            out[c][i] = h[c];
        out[3][i] = cosine;
        out[4][i] = weft_ggx_d(cosine, (1 - cosine) * (1 + cosine), alpha) * cosine;
    }
}

static void prefilter(int n, const double *const *in, double *const *out)
{
    for (int i = 0; i < n; i++) {
        double moments[3];
        weft_environment_prefilter(in[0][i], 3, moments);
        for (int l = 0; l < 3; l++)
            out[l][i] = moments[l];
    }
}

static void put_share(weft_environment_share share, int i, double *const *out)
{
    out[0][i] = share.scale;
    out[1][i] = share.bias;
}

static void environment_unreal(int n, const double *const *in, double *const *out)
{
    for (int i = 0; i < n; i++)
        put_share(weft_environment_brdf(WEFT_ENVIRONMENT_SCHLICK, in[0][i] * in[0][i], in[1][i], 0), i, out);
}

static void environment(int n, const double *const *in, double *const *out)
{
    for (int i = 0; i < n; i++)
        put_share(weft_environment_brdf(WEFT_ENVIRONMENT_SMITH, weft_gloss_alpha(in[0][i]), in[1][i], 0), i,
                  out);
}

static void environment_cone(int n, const double *const *in, double *const *out)
{
    for (int i = 0; i < n; i++)
        put_share(
            weft_environment_brdf(WEFT_ENVIRONMENT_SMITH, weft_gloss_alpha(in[0][i]), in[1][i], in[2][i]), i,
            out);
}

static void conserving_lambert(int n, const double *const *in, double *const *out)
{
    for (int i = 0; i < n; i++)
        out[0][i] = weft_environment_diffuse(
            weft_environment_brdf(WEFT_ENVIRONMENT_SMITH, weft_gloss_alpha(in[0][i]), in[2][i], 0), in[1][i]);
}

static void occlusion(int n, const double *const *in, double *const *out)
{
    for (int i = 0; i < n; i++) {
        const double a = in[0][i], rho = in[1][i], nl = in[2][i], v = weft_ao_interreflect(a, rho);
        const double cone = weft_ao_cone_cosine(v);
        out[0][i] = weft_ao_similar_white(a);
        out[1][i] = weft_ao_same_open(a, rho);
        out[2][i] = weft_ao_same_similar(a, rho);
        out[3][i] = v;
        out[4][i] = cone;
        out[5][i] = weft_ao_shadow_threshold(nl, cone);
        out[6][i] = weft_ao_shadow_smooth(nl, cone);
        out[7][i] = weft_ao_shadow_sharp(nl, cone);
        out[8][i] = weft_ao_specular_cone(cone, in[3][i], in[4][i]);
    }
}

static void sky(int n, const double *const *in, double *const *out)
{
    for (int i = 0; i < n; i++) {
        const weft_sky s = {in[0][i], in[1][i], in[2][i], in[3][i], in[4][i]};
        const double zenith = in[5][i], azimuth = in[6][i], sun = in[7][i];
        out[0][i] = weft_sky_sun_angle(zenith, azimuth, sun);
        out[1][i] = weft_sky_relative_to_zenith(&s, zenith, azimuth, sun);
        out[2][i] = weft_sky_relative_to_sun(&s, zenith, azimuth, sun);
    }
}

static void sky_projection(int n, const double *const *in, double *const *out)
{
    for (int i = 0; i < n; i++) {
        const weft_sky s = {in[0][i], in[1][i], in[2][i], in[3][i], in[4][i]};
        double light[WEFT_SH_COUNT];
        weft_sky_project(&s, in[5][i], in[6][i], light);
        for (int k = 0; k < WEFT_SH_COUNT; k++)
            out[k][i] = light[k];
    }
}

static void phase(int n, const double *const *in, double *const *out)
{
    for (int i = 0; i < n; i++)
        out[0][i] = weft_phase_henyey_greenstein(in[0][i], in[1][i]);
}

static void upsample(int n, const double *const *in, double *const *out)
{
    for (int i = 0; i < n; i++) {
        const double depths[4] = {in[1][i], in[2][i], in[3][i], in[4][i]};
        const double values[4] = {in[5][i], in[6][i], in[7][i], in[8][i]};
        out[0][i] = weft_bilateral_mean(in[0][i], 4, depths, values, WEFT_BILATERAL_SLOPE);
    }
}

static void chromaticity(int n, const double *const *in, double *const *out)
{
    for (int i = 0; i < n; i++) {
        double rgb[3], xyz[3], xyy[3];
        for (int c = 0; c < 3; c++)
            rgb[c] = weft_srgb_decode(in[c][i]);
        weft_srgb_to_xyz(rgb, xyz);
        weft_xyz_to_xyy(xyz, xyy);
        for (int c = 0; c < 3; c++)
            out[c][i] = xyy[c];
    }
}

const weft_vectors_model weft_vectors_lighting[] = {
    {"blog_hg", "S-BLG-08", "g cosine", "p", 1e-12, phase},
    {"blog_upsample", "S-BLG-09", "z z0 z1 z2 z3 c0 c1 c2 c3", "c", 1e-12, upsample},
    {"cie_sky", "S-FC3-05 S-FC3-06", "a b c d e zenith_angle azimuth sun_zenith", "chi rel_zenith rel_sun",
     1e-11, sky},
    {"cie_sky_sh", "S-FC3-07", "a b c d e sun_zenith sun_azimuth", "L0 L1 L2 L3 L4 L5 L6 L7 L8", 1e-10,
     sky_projection},
    {"cod_ao", "S-COD-13 to S-COD-18", "A rho nl gloss nv",
     "similar_white same_open same_similar interreflect cos threshold smooth sharp cos_adj", 1e-12,
     occlusion},
    {"cod_envbrdf", "S-COD-19", "gloss nv", "scale bias", 1e-10, environment},
    {"cod_envbrdf_cone", "S-COD-20", "gloss nv cos_theta", "scale bias", 1e-9, environment_cone},
    {"cod_lambert_ec", "S-COD-21", "gloss f0 nl", "factor", 1e-10, conserving_lambert},
    {"colour_xyY", "S-FC3-02", "r g b", "x y Y", 1e-10, chromaticity},
    {"hammersley", "S-UE4-06", "i N", "x y", 1e-15, hammersley},
    {"ue4_envbrdf", "S-UE4-09", "roughness nv", "A B", 1e-10, environment_unreal},
    {"ue4_falloff", "S-UE4-14", "distance light_radius", "falloff", 1e-12, falloff},
    {"ue4_importance", "S-UE4-06", "xi1 xi2 roughness nx ny nz", "hx hy hz cos pdf_h", 1e-10, importance},
    {"ue4_prefilter", "S-UE4-08", "roughness", "P1 P2 P3", 1e-11, prefilter},
    {"ue4_sphere", "S-UE4-16", "Lx Ly Lz rx ry rz radius alpha", "lx ly lz alpha norm", 1e-10, sphere},
    {"ue4_tube", "S-UE4-17", "L0x L0y L0z L1x L1y L1z nx ny nz rx ry rz alpha",
     "eq15 integral eq16 t18 t19 t_clamped lx ly lz line_norm", 1e-9, tube},
    {0},
};
