#include "shading/brdf/blinn_phong.h"
#include "shading/brdf/fresnel.h"
#include "shading/brdf/half_vector.h"

enum { F0 = 0, GLOSS = 3 }; /* first planes */

/* f = F D/4 V1(nl) V1(nv), S-FC3-09 to S-FC3-12. */
WEFT_CLONES
void WEFT_KERNEL(weft_brdf_eval_blinn_phong)(const weft_brdf_batch_real *b, weft_real *const value[3])
{
    const weft_real *const lx = b->light[0], *const ly = b->light[1], *const lz = b->light[2];
    const weft_real *const vx = b->view[0], *const vy = b->view[1], *const vz = b->view[2];
    const weft_real *const fr = b->param[F0], *const fg = b->param[F0 + 1], *const fb = b->param[F0 + 2];
    const weft_real *const gloss = b->param[GLOSS];
    weft_real *const r = value[0], *restrict const g = value[1], *restrict const bl = value[2];
    WEFT_INDEPENDENT
    for (int i = 0; i < b->n; i++) {
        const weft_half h = weft_half_of(lx[i], ly[i], lz[i], vx[i], vy[i], vz[i]);
        const weft_real nl = h.lit, power = weft_blinn_phong_power(gloss[i]);
        const weft_real k = weft_schlick_k_power(power);
        const weft_real dv = h.valid * weft_blinn_phong_d(h.nh, h.s2, power) / 4 * weft_schlick_v1(nl, k) *
                             weft_schlick_v1(h.nv, k);
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
    {"gloss", NULL, 1, 0, 1, 0.4, "", "the power of the lobe is 2^(13 gloss)"},
    {0},
};

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
    .eval = weft_brdf_eval_blinn_phong,
    .eval_f32 = weft_brdf_eval_blinn_phong_f32,
    .sample = sample,
    .pdf = pdf,
};

#endif
