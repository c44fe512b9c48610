#include "shading/brdf/cook_torrance.h"

enum { F0 = 0, ALPHA = 3, DISTRIBUTION = 4, MASKING = 5, FRESNEL = 6 }; /* first planes */

/* f = D F G/(4 nl nv), S-BLG-04. */
WEFT_CLONES
void WEFT_KERNEL(weft_brdf_eval_cook_torrance)(const weft_brdf_batch_real *b, weft_real *const value[3])
{
    const weft_real *const lx = b->light[0], *const ly = b->light[1], *const lz = b->light[2];
    const weft_real *const vx = b->view[0], *const vy = b->view[1], *const vz = b->view[2];
    const weft_real *const fr = b->param[F0], *const fg = b->param[F0 + 1], *const fb = b->param[F0 + 2];
    const weft_real *const alpha = b->param[ALPHA], *const distribution = b->param[DISTRIBUTION];
    const weft_real *const masking = b->param[MASKING], *const fresnel = b->param[FRESNEL];
    weft_real *const r = value[0], *restrict const g = value[1], *restrict const bl = value[2];
    WEFT_INDEPENDENT
    for (int i = 0; i < b->n; i++) {
        const weft_half h = weft_half_of(lx[i], ly[i], lz[i], vx[i], vy[i], vz[i]);
        const weft_real dv =
            h.valid * weft_ct_d(distribution[i], &h, alpha[i]) * weft_ct_v(masking[i], &h, alpha[i]) / 4;
        r[i] = dv * weft_ct_f(fresnel[i], fr[i], &h);
        g[i] = dv * weft_ct_f(fresnel[i], fg[i], &h);
        bl[i] = dv * weft_ct_f(fresnel[i], fb[i], &h);
    }
}

#ifndef WEFT_SINGLE /* what there is once */

#include "shading/brdf/sampling.h"

static const weft_brdf_param params[] = {
    {"f0", NULL, 3, 0, 1, 0.04, "", "reflectance at normal incidence"},
    {"alpha", NULL, 1, 1e-3, 1, 0.3, "", "width of the lobe, the same for every distribution"},
    {"distribution", NULL, 1, 0, WEFT_CT_D_COUNT - 1, WEFT_CT_D_GGX, "", "0 Blinn-Phong, 1 Beckmann, 2 GGX"},
    {"masking", NULL, 1, 0, WEFT_CT_G_COUNT - 1, WEFT_CT_G_SMITH_GGX, "",
     "0 implicit, 1 Neumann, 2 Cook-Torrance, 3 Kelemen, 4 Smith of Beckmann, 5 Smith of GGX, 6 and 7 "
     "Schlick for these"},
    {"fresnel", NULL, 1, 0, WEFT_CT_F_COUNT - 1, WEFT_CT_F_SCHLICK, "", "0 none, 1 Schlick, 2 exact"},
    {0},
};

static void sample(const weft_brdf_batch *b, const double *const u[3], double *const light[3])
{
    for (int i = 0; i < b->n; i++)
        weft_sample_mixed(b, i, 0.9, b->param[ALPHA][i], b->param[ALPHA][i], u, light);
}

static void pdf(const weft_brdf_batch *b, double *density)
{
    for (int i = 0; i < b->n; i++)
        density[i] = weft_pdf_mixed(b, i, 0.9, b->param[ALPHA][i], b->param[ALPHA][i]);
}

const weft_brdf weft_brdf_cook_torrance = {
    .name = "cook-torrance",
    .summary = "one specular lobe with distribution, masking and Fresnel to swap, for comparing",
    .source = "Cook and Torrance 1982, Karis 2013 (Specular BRDF Reference); S-BLG-04",
    .flags = WEFT_BRDF_RECIPROCAL,
    .params = params,
    .eval = weft_brdf_eval_cook_torrance,
    .eval_f32 = weft_brdf_eval_cook_torrance_f32,
    .sample = sample,
    .pdf = pdf,
};

#endif
