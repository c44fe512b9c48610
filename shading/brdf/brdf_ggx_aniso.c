#include "shading/brdf/fresnel.h"
#include "shading/brdf/ggx.h"

#define ALPHA_FLOOR WEFT_R(1e-5) /* of the bitangent at anisotropy 1 (S-ORD-06 trap b) */

enum { F0 = 0, ALPHA = 3, ANISOTROPY = 4 }; /* first planes */

/* f = D F V1(l) V1(v) with the widths alpha and alpha (1 - anisotropy), S-ORD-07. */
WEFT_CLONES
void WEFT_KERNEL(weft_brdf_eval_ggx_aniso)(const weft_brdf_batch_real *b, weft_real *const value[3])
{
    const weft_real *const lx = b->light[0], *const ly = b->light[1], *const lz = b->light[2];
    const weft_real *const vx = b->view[0], *const vy = b->view[1], *const vz = b->view[2];
    const weft_real *const fr = b->param[F0], *const fg = b->param[F0 + 1], *const fb = b->param[F0 + 2];
    const weft_real *const alpha = b->param[ALPHA], *const anisotropy = b->param[ANISOTROPY];
    weft_real *const r = value[0], *restrict const g = value[1], *restrict const bl = value[2];
    WEFT_INDEPENDENT
    for (int i = 0; i < b->n; i++) {
        const weft_half h = weft_half_of(lx[i], ly[i], lz[i], vx[i], vy[i], vz[i]);
        const weft_real at = alpha[i], ab = weft_ggx_alpha_b(at, anisotropy[i], ALPHA_FLOOR);
        const weft_real nl = h.lit;
        const weft_real d = weft_ggx_d_aniso(h.h[0], h.h[1], h.nh, at, ab);
        const weft_real dv = h.valid > 0 ? d * weft_ggx_v1_aniso(lx[i], ly[i], nl, at, ab) *
                                               weft_ggx_v1_aniso(vx[i], vy[i], h.nv, at, ab)
                                         : 0;
        const weft_real w = weft_schlick_power(h.grazing);
        r[i] = dv * (fr[i] + (1 - fr[i]) * w);
        g[i] = dv * (fg[i] + (1 - fg[i]) * w);
        bl[i] = dv * (fb[i] + (1 - fb[i]) * w);
    }
}

#ifndef WEFT_SINGLE /* what there is once */

#include "shading/brdf/sampling.h"

static const weft_brdf_param params[] = {
    {"f0", NULL, 3, 0, 1, 0.04, "", "reflectance at normal incidence"},
    {"alpha", NULL, 1, 1e-4, 1, 0.4, "", "roughness along the tangent, the width of the lobe"},
    {"anisotropy", NULL, 1, 0, 1, 0.5, "",
     "how much smoother the bitangent is: its roughness is alpha (1 - anisotropy)"},
    {0},
};

static double bitangent_width(const weft_brdf_batch *b, int i)
{
    return weft_ggx_alpha_b(b->param[ALPHA][i], b->param[ANISOTROPY][i], ALPHA_FLOOR);
}

static void sample(const weft_brdf_batch *b, const double *const u[3], double *const light[3])
{
    for (int i = 0; i < b->n; i++)
        weft_sample_mixed(b, i, 1, b->param[ALPHA][i], bitangent_width(b, i), u, light);
}

static void pdf(const weft_brdf_batch *b, double *density)
{
    for (int i = 0; i < b->n; i++)
        density[i] = weft_pdf_mixed(b, i, 1, b->param[ALPHA][i], bitangent_width(b, i));
}

const weft_brdf weft_brdf_ggx_aniso = {
    .name = "ggx-anisotropic",
    .summary = "GGX with two widths, for yarns that lie one way: the specular lobe alone",
    .source = "The Order: 1886 (Neubelt, Pettineo 2013) eqs. 11-14 after Burley; S-ORD-06, S-ORD-07",
    .flags = WEFT_BRDF_RECIPROCAL | WEFT_BRDF_PASSIVE | WEFT_BRDF_ANISOTROPIC,
    .params = params,
    .eval = weft_brdf_eval_ggx_aniso,
    .eval_f32 = weft_brdf_eval_ggx_aniso_f32,
    .sample = sample,
    .pdf = pdf,
};

#endif
