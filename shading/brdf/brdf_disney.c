#include "shading/brdf/disney.h"
#include "shading/brdf/fresnel.h"

/* first planes, in the order of params */
enum {
    BASE = 0,
    SUBSURFACE = 3,
    METALLIC,
    SPECULAR,
    SPECULAR_TINT,
    ROUGHNESS,
    ANISOTROPIC,
    SHEEN,
    SHEEN_TINT,
    CLEARCOAT,
    CLEARCOAT_GLOSS
};

/* What of one pair of directions does not depend on the colour. */
typedef struct terms {
    weft_real diffuse;   /* of the base colour */
    weft_real sheen;     /* of the sheen's colour */
    weft_real specular;  /* of F */
    weft_real clearcoat; /* without colour */
    weft_real weight;    /* Schlick's, of lh */
} terms;

/* Where it is not `lit` the terms are 0, and the cosines may be anything. */
WEFT_INLINE terms terms_of(const weft_brdf_batch_real *b, int i, const weft_half *h, weft_real lit)
{
    const weft_real rough = b->param[ROUGHNESS][i], metallic = b->param[METALLIC][i];
    const weft_real nl = lit > 0 ? h->lit : 1, nh = lit > 0 ? h->nh : 1;
    const weft_real *const hv = h->h;
    weft_real at, ab;
    terms t = {.weight = weft_schlick_power(h->grazing)};
    weft_disney_widths(rough, b->param[ANISOTROPIC][i], &at, &ab);
    const weft_real fd = weft_disney_diffuse(nl, h->nv, h->lh, rough);
    const weft_real ss = weft_disney_subsurface(nl, h->nv, h->lh, rough);
    t.diffuse = weft_mix(fd, ss, b->param[SUBSURFACE][i]) / WEFT_PI * (1 - metallic) * lit;
    t.sheen = lit * t.weight * b->param[SHEEN][i] * (1 - metallic);
    const weft_real ag =
        (WEFT_R(0.5) + rough / 2) * (WEFT_R(0.5) + rough / 2); /* masking of a rougher lobe than D's */
    t.specular =
        lit * weft_ggx_d_aniso(hv[0], hv[1], nh, at, ab) * weft_ggx_v1(nl, ag) * weft_ggx_v1(h->nv, ag);
    const weft_real coat =
        weft_disney_gtr1(nh, h->s2, weft_mix(WEFT_R(0.1), WEFT_R(0.001), b->param[CLEARCOAT_GLOSS][i]));
    t.clearcoat = lit * WEFT_R(0.25) * b->param[CLEARCOAT][i] * weft_mix(WEFT_R(0.04), 1, t.weight) * coat *
                  weft_ggx_v1(nl, WEFT_R(0.25)) * weft_ggx_v1(h->nv, WEFT_R(0.25));
    return t;
}

/* f = [weft_mix(Fd, ss, subsurface) C/pi + sheen] (1 - metallic) + Gs Fs Ds + clearcoat/4 Gr Fr Dr, S-BLG-05.
 * Below either horizon it is 0, as published: no raised n.v. */
WEFT_CLONES
void WEFT_KERNEL(weft_brdf_eval_disney)(const weft_brdf_batch_real *b, weft_real *const value[3])
{
    WEFT_INDEPENDENT
    for (int i = 0; i < b->n; i++) {
        const weft_half h = weft_half_of(b->light[0][i], b->light[1][i], b->light[2][i], b->view[0][i],
                                         b->view[1][i], b->view[2][i]);
        const terms t = terms_of(b, i, &h, b->view[2][i] > 0 ? h.valid : 0);
        const weft_real luminance = WEFT_R(0.3) * b->param[BASE][i] + WEFT_R(0.6) * b->param[BASE + 1][i] +
                                    WEFT_R(0.1) * b->param[BASE + 2][i];
        for (int c = 0; c < 3; c++) {
            const weft_real base = b->param[BASE + c][i],
                            tint = luminance > 0 ? base / (luminance > 0 ? luminance : 1) : 1;
            const weft_real dielectric =
                WEFT_R(0.08) * b->param[SPECULAR][i] * weft_mix(1, tint, b->param[SPECULAR_TINT][i]);
            const weft_real f0 = weft_mix(dielectric, base, b->param[METALLIC][i]);
            value[c][i] = t.diffuse * base + t.sheen * weft_mix(1, tint, b->param[SHEEN_TINT][i]) +
                          t.specular * weft_mix(f0, 1, t.weight) + t.clearcoat;
        }
    }
}

#ifndef WEFT_SINGLE /* what there is once */

#include "shading/brdf/sampling.h"

static const weft_brdf_param params[] = {
    {"base", NULL, 3, 0, 1, 0.5, "", "base colour"},
    {"subsurface", NULL, 1, 0, 1, 0, "", "share of the flatter diffuse lobe"},
    {"metallic", NULL, 1, 0, 1, 0, "", "0 dielectric, 1 metal"},
    {"specular", NULL, 1, 0, 1, 0.5, "", "F0 of dielectrics is 0.08 of this"},
    {"specular-tint", "specularTint", 1, 0, 1, 0, "", "tints F0 of dielectrics with the base colour"},
    {"roughness", NULL, 1, 0, 1, 0.5, "", "the artist's roughness; the width of the lobe is its square"},
    {"anisotropic", NULL, 1, 0, 1, 0, "", "stretches the highlight along the tangent"},
    {"sheen", NULL, 1, 0, 1, 0, "", "light at grazing angles, for cloth"},
    {"sheen-tint", "sheenTint", 1, 0, 1, 0.5, "", "tints the sheen with the base colour"},
    {"clearcoat", NULL, 1, 0, 1, 0, "", "a second lobe of F0 0.04"},
    {"clearcoat-gloss", "clearcoatGloss", 1, 0, 1, 1, "", "0 satin, 1 gloss"},
    {0},
};

static void widths(const weft_brdf_batch *b, int i, double *at, double *ab)
{
    weft_disney_widths(b->param[ROUGHNESS][i], b->param[ANISOTROPIC][i], at, ab);
}

static double specular_share(const weft_brdf_batch *b, int i)
{
    const double base = (b->param[BASE][i] + b->param[BASE + 1][i] + b->param[BASE + 2][i]) / 3;
    const double f0 = weft_mix(0.08 * b->param[SPECULAR][i], base, b->param[METALLIC][i]);
    return weft_sample_share(weft_fresnel_schlick(f0, weft_max(b->view[2][i], 0)),
                             base * (1 - b->param[METALLIC][i]));
}

static void sample(const weft_brdf_batch *b, const double *const u[3], double *const light[3])
{
    for (int i = 0; i < b->n; i++) {
        double at, ab;
        widths(b, i, &at, &ab);
        weft_sample_mixed(b, i, specular_share(b, i), at, ab, u, light);
    }
}

static void pdf(const weft_brdf_batch *b, double *density)
{
    for (int i = 0; i < b->n; i++) {
        double at, ab;
        widths(b, i, &at, &ab);
        density[i] = weft_pdf_mixed(b, i, specular_share(b, i), at, ab);
    }
}

/* Not passive: a white base returns 1.04-1.09 by default and up to 1.6 with sheen or subsurface. */
const weft_brdf weft_brdf_disney = {
    .name = "disney",
    .summary = "Disney's principled model of 2012 with its eleven parameters",
    .source = "Burley 2012, Physically-Based Shading at Disney; S-BLG-05",
    .flags = WEFT_BRDF_RECIPROCAL | WEFT_BRDF_ANISOTROPIC,
    .params = params,
    .eval = weft_brdf_eval_disney,
    .eval_f32 = weft_brdf_eval_disney_f32,
    .sample = sample,
    .pdf = pdf,
};

#endif
