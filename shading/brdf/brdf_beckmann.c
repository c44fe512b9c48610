#include "shading/brdf/beckmann.h"
#include "shading/brdf/fresnel.h"
#include "shading/brdf/half_vector.h"

enum { F0 = 0, ALPHA = 3 }; /* first planes */

/* f = D G1(nl) G1(nv) F / (4 nl nv) = D F V1(nl) V1(nv)/4, S-ORD-24. */
WEFT_CLONES
void WEFT_KERNEL(weft_brdf_eval_beckmann)(const weft_brdf_batch_real *b, weft_real *const value[3])
{
    const weft_real *const lx = b->light[0], *const ly = b->light[1], *const lz = b->light[2];
    const weft_real *const vx = b->view[0], *const vy = b->view[1], *const vz = b->view[2];
    const weft_real *const fr = b->param[F0], *const fg = b->param[F0 + 1], *const fb = b->param[F0 + 2];
    const weft_real *const alpha = b->param[ALPHA];
    weft_real *const r = value[0], *restrict const g = value[1], *restrict const bl = value[2];
    WEFT_INDEPENDENT
    for (int i = 0; i < b->n; i++) {
        const weft_half h = weft_half_of(lx[i], ly[i], lz[i], vx[i], vy[i], vz[i]);
        const weft_real nl = h.lit;
        const weft_real v = weft_beckmann_v1(nl, alpha[i]) * weft_beckmann_v1(h.nv, alpha[i]) / 4;
        const weft_real dv = h.valid * weft_beckmann_d(h.nh, h.s2, alpha[i]) * v;
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
    {"alpha", "m", 1, 1e-4, 1, 0.3, "", "roughness, the width of the lobe"},
    {0},
};

/* Drawn from GGX of the same width, whose tail covers Beckmann's. */
static void sample(const weft_brdf_batch *b, const double *const u[3], double *const light[3])
{
    for (int i = 0; i < b->n; i++)
        weft_sample_mixed(b, i, 1, b->param[ALPHA][i], b->param[ALPHA][i], u, light);
}

static void pdf(const weft_brdf_batch *b, double *density)
{
    for (int i = 0; i < b->n; i++)
        density[i] = weft_pdf_mixed(b, i, 1, b->param[ALPHA][i], b->param[ALPHA][i]);
}

const weft_brdf weft_brdf_beckmann = {
    .name = "beckmann",
    .summary = "Beckmann with Smith shadowing and Schlick's Fresnel: a specular lobe without GGX's long tail",
    .source = "The Order: 1886 (Neubelt, Pettineo 2013) appendix A, Walter et al. 2007; S-ORD-24",
    .flags = WEFT_BRDF_RECIPROCAL | WEFT_BRDF_PASSIVE,
    .params = params,
    .eval = weft_brdf_eval_beckmann,
    .eval_f32 = weft_brdf_eval_beckmann_f32,
    .sample = sample,
    .pdf = pdf,
};

#endif
