#include "shading/brdf/fresnel.h"
#include "shading/brdf/ggx.h"

/*
 * f = D(nh) F(lh) V1(nl) V1(nv), S-ORD-05.
 *
 * Shadowing is applied whatever side of the horizon v is on: a back-facing view is raised to n.v = 1e-4
 * with h from the true v, instead of being black as eq. 10 of the seed has it.
 */
WEFT_CLONES
void WEFT_KERNEL(weft_brdf_eval_ggx_specular)(const weft_brdf_batch_real *b, weft_real *const value[3])
{
    const weft_real *const lx = b->light[0], *const ly = b->light[1], *const lz = b->light[2];
    const weft_real *const vx = b->view[0], *const vy = b->view[1], *const vz = b->view[2];
    const weft_real *const fr = b->param[0], *const fg = b->param[1], *const fb = b->param[2];
    const weft_real *const alpha = b->param[3];
    weft_real *const r = value[0], *restrict const g = value[1], *restrict const bl = value[2];
    WEFT_INDEPENDENT
    for (int i = 0; i < b->n; i++) {
        const weft_half h = weft_half_of(lx[i], ly[i], lz[i], vx[i], vy[i], vz[i]);
        const weft_real nl = h.lit;
        const weft_real dv = h.valid * weft_ggx_d(h.nh, h.s2, alpha[i]) * weft_ggx_v1(nl, alpha[i]) *
                             weft_ggx_v1(h.nv, alpha[i]);
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
    {"alpha", NULL, 1, 1e-4, 1, 0.3, "",
     "roughness, the width of the lobe (the square of the artist's value)"},
    {0},
};

static void sample(const weft_brdf_batch *b, const double *const u[3], double *const light[3])
{
    for (int i = 0; i < b->n; i++)
        weft_sample_mixed(b, i, 1, b->param[3][i], b->param[3][i], u, light);
}

static void pdf(const weft_brdf_batch *b, double *density)
{
    for (int i = 0; i < b->n; i++)
        density[i] = weft_pdf_mixed(b, i, 1, b->param[3][i], b->param[3][i]);
}

const weft_brdf weft_brdf_ggx_specular = {
    .name = "ggx-specular",
    .summary = "GGX with separable Smith shadowing and Schlick's Fresnel: the specular lobe alone",
    .source = "The Order: 1886 (Neubelt, Pettineo 2013) eqs. 1-10, appendix A; S-ORD-01 to S-ORD-05",
    .flags = WEFT_BRDF_RECIPROCAL | WEFT_BRDF_PASSIVE,
    .params = params,
    .eval = weft_brdf_eval_ggx_specular,
    .eval_f32 = weft_brdf_eval_ggx_specular_f32,
    .sample = sample,
    .pdf = pdf,
};

#endif
