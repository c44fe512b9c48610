#include "shading/brdf/beckmann.h"
#include "shading/brdf/blinn_phong.h"
#include "shading/brdf/cook_torrance.h"
#include "shading/brdf/fresnel.h"
#include "shading/brdf/sampling.h"

enum { F0 = 0, ALPHA = 3, DISTRIBUTION = 4, MASKING = 5, FRESNEL = 6 }; /* first planes */

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

double weft_ct_d(weft_ct_distribution which, const weft_half *h, double alpha)
{
    switch (which) {
    case WEFT_CT_D_BLINN_PHONG:
        return weft_blinn_phong_d(h->s2, weft_blinn_phong_power_of_alpha(alpha));
    case WEFT_CT_D_BECKMANN:
        return weft_beckmann_d(h->nh, h->s2, alpha);
    default:
        return weft_ggx_d(h->nh, h->s2, alpha);
    }
}

double weft_ct_g(weft_ct_masking which, const weft_half *h, double alpha)
{
    const double nl = h->nl, nv = h->nv, product = nl * nv;
    const double lh = weft_max(h->lh, 1e-100);
    switch (which) {
    case WEFT_CT_G_IMPLICIT:
        return product;
    case WEFT_CT_G_NEUMANN:
        return nl < nv ? nl : nv;
    case WEFT_CT_G_COOK_TORRANCE:
        return fmin(1, 2 * h->nh * fmin(nl, nv) / lh);
    case WEFT_CT_G_KELEMEN:
        return product / (lh * lh);
    case WEFT_CT_G_SMITH_BECKMANN:
        return weft_beckmann_g1(nl, alpha) * weft_beckmann_g1(nv, alpha);
    case WEFT_CT_G_SCHLICK_BECKMANN: {
        const double k = weft_schlick_k_beckmann(alpha);
        return weft_schlick_g1(nl, k) * weft_schlick_g1(nv, k);
    }
    case WEFT_CT_G_SCHLICK_GGX: {
        const double k = weft_schlick_k_ggx(alpha);
        return weft_schlick_g1(nl, k) * weft_schlick_g1(nv, k);
    }
    default:
        return weft_ggx_g1(nl, alpha) * weft_ggx_g1(nv, alpha);
    }
}

double weft_ct_f(weft_ct_fresnel which, double f0, double lh)
{
    if (which == WEFT_CT_F_NONE)
        return f0;
    return which == WEFT_CT_F_EXACT ? weft_fresnel_exact(f0, lh) : weft_fresnel_schlick(f0, lh);
}

/* A choice is a number so that it can be set as any other parameter; the nearest counts. */
static int choice(const weft_brdf_batch *b, int plane, int i)
{
    return (int)(b->param[plane][i] + 0.5);
}

/* f = D F G/(4 nl nv), S-BLG-04. */
static void eval(const weft_brdf_batch *b, double *const value[3])
{
    for (int i = 0; i < b->n; i++) {
        const weft_half h = weft_half_of(b->light[0][i], b->light[1][i], b->light[2][i], b->view[0][i],
                                         b->view[1][i], b->view[2][i]);
        double dg = 0;
        if (h.valid > 0)
            dg = weft_ct_d((weft_ct_distribution)choice(b, DISTRIBUTION, i), &h, b->param[ALPHA][i]) *
                 weft_ct_g((weft_ct_masking)choice(b, MASKING, i), &h, b->param[ALPHA][i]) /
                 (4 * h.nl * h.nv);
        for (int c = 0; c < 3; c++)
            value[c][i] = dg * weft_ct_f((weft_ct_fresnel)choice(b, FRESNEL, i), b->param[F0 + c][i], h.lh);
    }
}

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
    .eval = eval,
    .sample = sample,
    .pdf = pdf,
};
