#include "shading/vectors/vectors_pair.h"

#include "shading/brdf/albedo.h"
#include "shading/brdf/cloth.h"
#include "shading/brdf/fresnel.h"
#include "shading/brdf/sampling.h"

static void fresnel(int n, const double *const *in, double *const *out)
{
    for (int i = 0; i < n; i++) {
        const double f0 = in[0][i], u = in[1][i];
        out[0][i] = weft_fresnel_schlick(f0, u);
        out[1][i] = weft_fresnel_gauss_ue4(f0, u);
        out[2][i] = weft_fresnel_gauss_fc3(f0, u);
        out[3][i] = weft_fresnel_exact(f0, u);
    }
}

static void ggx_terms(int n, const double *const *in, double *const *out)
{
    for (int i = 0; i < n; i++) {
        const double alpha = in[0][i], x = in[1][i];
        out[0][i] = x >= 0 ? weft_ggx_d(x, (1 - x) * (1 + x), alpha) : 0;
        out[1][i] = weft_ggx_g1(x, alpha);
        out[2][i] = weft_ggx_v1(x, alpha);
    }
}

static void ggx_spec(int n, const double *const *in, double *const *out)
{
    for (int i = 0; i < n; i++) {
        const double values[WEFT_BRDF_MAX_PLANES] = {in[1][i], in[1][i], in[1][i], in[0][i]};
        out[0][i] = weft_vectors_eval_at("ggx-specular", values, in[2][i], 0, in[3][i], in[4][i]);
    }
}

static void ggx_aniso(int n, const double *const *in, double *const *out)
{
    for (int i = 0; i < n; i++) {
        const double at = in[0][i], ab = weft_ggx_alpha_b(at, in[1][i], 0);
        const double f0 = in[6][i], values[WEFT_BRDF_MAX_PLANES] = {f0, f0, f0, at, in[1][i]};
        double l[3], v[3];
        weft_brdf_direction(in[2][i], in[3][i], l);
        weft_brdf_direction(in[4][i], in[5][i], v);
        const weft_half h = weft_half_of(l[0], l[1], l[2], v[0], v[1], v[2]);
        out[0][i] = at;
        out[1][i] = ab;
        out[2][i] = weft_ggx_d_aniso(h.h[0], h.h[1], h.nh, at, ab);
        out[3][i] = weft_ggx_v1_aniso(l[0], l[1], l[2], at, ab) * weft_ggx_v1_aniso(v[0], v[1], h.nv, at, ab);
        out[4][i] = weft_vectors_eval_at("ggx-anisotropic", values, in[2][i], in[3][i], in[4][i], in[5][i]);
    }
}

static void diffuse(int n, const double *const *in, double *const *out)
{
    for (int i = 0; i < n; i++) {
        const double f0 = in[0][i], values[WEFT_BRDF_MAX_PLANES] = {1, 1, 1, f0, f0, f0};
        out[0][i] = weft_vectors_eval_at("lambert-balanced", values, in[1][i], 0, in[2][i], in[3][i]);
        out[1][i] = weft_vectors_eval_at("lambert-coupled", values, in[1][i], 0, in[2][i], in[3][i]);
    }
}

/* K of S-ORD-08: the albedo of the balanced Lambert at F0 = 0. */
static void diffuse_albedo(int n, const double *const *in, double *const *out)
{
    const weft_brdf *brdf;
    const double values[WEFT_BRDF_MAX_PLANES] = {1, 1, 1, 0, 0, 0};
    if (weft_brdf_find("lambert-balanced", &brdf, NULL) != WEFT_OK)
        return;
    for (int i = 0; i < n; i++) {
        double albedo[3] = {(double)NAN, (double)NAN, (double)NAN}, nv = in[0][i];
        if (weft_vectors_view(&nv))
            weft_brdf_albedo(brdf, values, nv, 0, WEFT_ALBEDO_EXACT, albedo);
        out[0][i] = albedo[0];
    }
}

/* D V without Fresnel, with the two forms of masking, and the Schlick part of the separable one. */
static void furnace_integrand(void *context, const weft_brdf_batch *b, double *const value[3])
{
    const double alpha = *(const double *)context;
    for (int i = 0; i < b->n; i++) {
        const weft_half h = weft_half_of(b->light[0][i], b->light[1][i], b->light[2][i], b->view[0][i],
                                         b->view[1][i], b->view[2][i]);
        const double d = h.valid > 0 ? weft_ggx_d(h.nh, h.s2, alpha) : 0, nl = weft_max(h.nl, 0);
        value[0][i] = d * weft_ggx_v1(nl, alpha) * weft_ggx_v1(h.nv, alpha);
        value[1][i] = d * weft_ggx_v_correlated(nl, h.nv, alpha);
        value[2][i] = value[0][i] * weft_schlick_weight(h.lh);
    }
}

static void ggx_furnace(int n, const double *const *in, double *const *out)
{
    for (int i = 0; i < n; i++) {
        double alpha = in[0][i], sum[3] = {(double)NAN, (double)NAN, (double)NAN}, nv = in[1][i];
        if (weft_vectors_view(&nv))
            weft_albedo_integrate(furnace_integrand, &alpha, WEFT_ALBEDO_UPPER, nv, 0, false,
                                  WEFT_ALBEDO_EXACT, sum);
        for (int c = 0; c < 3; c++)
            out[c][i] = sum[c];
    }
}

static void cloth_d(int n, const double *const *in, double *const *out)
{
    for (int i = 0; i < n; i++)
        out[0][i] = weft_cloth_d(in[2][i], (1 - in[2][i]) * (1 + in[2][i]), in[0][i], in[1][i]);
}

static void cloth_brdf(int n, const double *const *in, double *const *out)
{
    for (int i = 0; i < n; i++) {
        const double f0 = in[1][i], c = in[2][i];
        const double values[WEFT_BRDF_MAX_PLANES] = {c, c, c, f0, f0, f0, in[0][i], 4};
        out[0][i] = weft_vectors_eval_at("cloth", values, in[3][i], 0, in[4][i], in[5][i]);
    }
}

/* The albedo of the specular part is scale F0 + bias; F0 = 0 and F0 = 1 give both. */
static void cloth_albedo(int n, const double *const *in, double *const *out)
{
    const weft_brdf *brdf;
    if (weft_brdf_find("cloth", &brdf, NULL) != WEFT_OK)
        return;
    for (int i = 0; i < n; i++) {
        const double values[WEFT_BRDF_MAX_PLANES] = {0, 0, 0, 0, 1, 1, in[0][i], 4};
        double albedo[3] = {(double)NAN, (double)NAN, (double)NAN}, nv = in[1][i];
        if (weft_vectors_view(&nv))
            weft_brdf_albedo(brdf, values, nv, 0, WEFT_ALBEDO_EXACT, albedo);
        out[0][i] = albedo[1] - albedo[0];
        out[1][i] = albedo[0];
        out[2][i] = albedo[1];
    }
}

const weft_vectors_model weft_vectors_reflectance[] = {
    {"cloth_D", "S-ORD-14", "alpha A nh", "D", 1e-11, cloth_d},
    {"cloth_albedo", "S-ORD-15", "alpha nv", "scale bias white", 1e-11, cloth_albedo},
    {"cloth_brdf", "S-ORD-15", "alpha f0 cdiff nl nv phi", "f", 1e-11, cloth_brdf},
    {"fresnel", "S-UE4-05 S-FC3-11 S-BLG-04", "f0 u", "schlick ue4_sg fc3_sg exact", 1e-12, fresnel},
    {"ggx_furnace", "S-ORD-05", "alpha nv", "separable correlated bias_separable", 1e-10, ggx_furnace},
    {"ord_diffuse", "S-ORD-08 S-ORD-09", "f0 nl nv phi", "balanced coupled", 1e-12, diffuse},
    {"ord_diffuse_albedo", "S-ORD-08", "nv", "K", 1e-12, diffuse_albedo},
    {"ord_ggx_aniso", "S-ORD-06 S-ORD-07", "alpha anisotropy nl phi_l nv phi_v f0", "at ab D V f", 1e-9,
     ggx_aniso},
    {"ord_ggx_spec", "S-ORD-05", "alpha f0 nl nv phi", "f", 1e-9, ggx_spec},
    {"ord_ggx_terms", "S-ORD-02 S-ORD-03 S-ORD-04", "alpha nx", "D G1 V1", 1e-9, ggx_terms},
    {0},
};
