#include "shading/brdf/cloth.h"
#include "shading/brdf/fresnel.h"

enum { ALBEDO = 0, F0 = 3, ALPHA = 6, AMPLITUDE = 7 }; /* first planes */

/* f = (1 - F) c_diff/pi + F D / (4 (nl + nv - nl nv)), S-ORD-15. */
WEFT_CLONES
void WEFT_KERNEL(weft_brdf_eval_cloth)(const weft_brdf_batch_real *b, weft_real *const value[3])
{
    const weft_real *const lx = b->light[0], *const ly = b->light[1], *const lz = b->light[2];
    const weft_real *const vx = b->view[0], *const vy = b->view[1], *const vz = b->view[2];
    const weft_real *const cr = b->param[ALBEDO], *const cg = b->param[ALBEDO + 1];
    const weft_real *const cb = b->param[ALBEDO + 2], *const fr = b->param[F0], *const fg = b->param[F0 + 1];
    const weft_real *const fb = b->param[F0 + 2], *const alpha = b->param[ALPHA];
    const weft_real *const amplitude = b->param[AMPLITUDE];
    weft_real *const r = value[0], *restrict const g = value[1], *restrict const bl = value[2];
    WEFT_INDEPENDENT
    for (int i = 0; i < b->n; i++) {
        const weft_half h = weft_half_of(lx[i], ly[i], lz[i], vx[i], vy[i], vz[i]);
        const weft_real nl = h.lit;
        const weft_real dv =
            h.valid * weft_cloth_d(h.nh, h.s2, alpha[i], amplitude[i]) * weft_cloth_v(nl, h.nv);
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
    {"f0", NULL, 3, 0, 1, 0.04, "", "reflectance of the fibres at normal incidence, the tint of the rim"},
    {"alpha", NULL, 1, 1e-4, 1, 0.5, "", "width of the rim lobe"},
    {"amplitude", "A", 1, 0, 4, 4, "", "weight of the rim lobe against the constant offset"},
    {0},
};

const weft_brdf weft_brdf_cloth = {
    .name = "cloth",
    .summary = "velvet-like rim lobe over Lambert: the Order's cloth",
    .source = "The Order: 1886 (Neubelt, Pettineo 2013) eqs. 21-23 after Ashikhmin; S-ORD-14, S-ORD-15",
    .flags = WEFT_BRDF_RECIPROCAL | WEFT_BRDF_PASSIVE,
    .params = params,
    .eval = weft_brdf_eval_cloth,
    .eval_f32 = weft_brdf_eval_cloth_f32,
    .sample = weft_brdf_sample_cosine,
    .pdf = weft_brdf_pdf_cosine,
};

#endif
