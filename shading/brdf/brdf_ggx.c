#include "shading/brdf/fresnel.h"
#include "shading/brdf/ggx.h"

enum { ALBEDO = 0, F0 = 3, ALPHA = 6 }; /* first planes */

/* f = (1 - F) c_diff/pi + D F V1(nl) V1(nv), S-ORD-05 and S-ORD-08 with one F = F0 + (1 - F0) w. */
WEFT_CLONES
void WEFT_KERNEL(weft_brdf_eval_ggx)(const weft_brdf_batch_real *b, weft_real *const value[3])
{
    const weft_real *const lx = b->light[0], *const ly = b->light[1], *const lz = b->light[2];
    const weft_real *const vx = b->view[0], *const vy = b->view[1], *const vz = b->view[2];
    const weft_real *const cr = b->param[ALBEDO], *const cg = b->param[ALBEDO + 1];
    const weft_real *const cb = b->param[ALBEDO + 2], *const fr = b->param[F0], *const fg = b->param[F0 + 1];
    const weft_real *const fb = b->param[F0 + 2], *const alpha = b->param[ALPHA];
    weft_real *const r = value[0], *restrict const g = value[1], *restrict const bl = value[2];
    WEFT_INDEPENDENT
    for (int i = 0; i < b->n; i++) {
        const weft_half h = weft_half_of(lx[i], ly[i], lz[i], vx[i], vy[i], vz[i]);
        const weft_real nl = h.lit;
        const weft_real dv = h.valid * weft_ggx_d(h.nh, h.s2, alpha[i]) * weft_ggx_v1(nl, alpha[i]) *
                             weft_ggx_v1(h.nv, alpha[i]);
        const weft_real w = weft_schlick_power(h.grazing);
        const weft_real diffuse = h.valid * weft_schlick_rest(h.lh) * (1 / WEFT_PI);
        r[i] = (1 - fr[i]) * (diffuse * cr[i] + dv * w) + dv * fr[i];
        g[i] = (1 - fg[i]) * (diffuse * cg[i] + dv * w) + dv * fg[i];
        bl[i] = (1 - fb[i]) * (diffuse * cb[i] + dv * w) + dv * fb[i];
    }
}

#ifndef WEFT_SINGLE /* what there is once */

#include "shading/brdf/sampling.h"

static const weft_brdf_param params[] = {
    {"albedo", "cdiff", 3, 0, 1, 0.5, "", "diffuse reflectance"},
    {"f0", NULL, 3, 0, 1, 0.04, "", "reflectance at normal incidence"},
    {"alpha", NULL, 1, 1e-4, 1, 0.3, "",
     "roughness, the width of the lobe (the square of the artist's value)"},
    {0},
};

/* Share of samples for the specular lobe: its part of the light that would be reflected. */
static double specular_share(const weft_brdf_batch *b, int i)
{
    const double f0 = (b->param[F0][i] + b->param[F0 + 1][i] + b->param[F0 + 2][i]) / 3;
    const double albedo = (b->param[ALBEDO][i] + b->param[ALBEDO + 1][i] + b->param[ALBEDO + 2][i]) / 3;
    const double specular = weft_fresnel_schlick(f0, weft_max(b->view[2][i], 0));
    return weft_sample_share(specular, (1 - specular) * albedo);
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

/* Not passive: at grazing views of smooth surfaces diffuse and specular add up to as much as 1.70 (alpha
 * 0.01, nv 0.01, white), for the half-vector Fresnel hardly sees the view angle; below 1.03 from alpha 0.5.
 */
const weft_brdf weft_brdf_ggx = {
    .name = "ggx",
    .summary = "GGX over Fresnel-balanced Lambert: the Order's standard material",
    .source = "The Order: 1886 (Neubelt, Pettineo 2013) eqs. 1-10, 15; S-ORD-05, S-ORD-08",
    .flags = WEFT_BRDF_RECIPROCAL,
    .params = params,
    .eval = weft_brdf_eval_ggx,
    .eval_f32 = weft_brdf_eval_ggx_f32,
    .sample = sample,
    .pdf = pdf,
};

#endif
