#include "shading/brdf/cloth.h"
#include "shading/brdf/fresnel.h"

enum { ALBEDO = 0, F0 = 3, FRONT = 4, RIM = 7, ALPHA = 10, AMPLITUDE = 11 }; /* first planes */

/* f = (1 - F) c_diff/pi + F D_2 / (4 (nl + nv - nl nv)), S-ORD-16: the two lobes of the cloth model, each
 * with its tint. */
WEFT_CLONES
void WEFT_KERNEL(weft_brdf_eval_cloth_two_tone)(const weft_brdf_batch_real *b, weft_real *const value[3])
{
    const weft_real *const lx = b->light[0], *const ly = b->light[1], *const lz = b->light[2];
    const weft_real *const vx = b->view[0], *const vy = b->view[1], *const vz = b->view[2];
    const weft_real *const f0 = b->param[F0], *const alpha = b->param[ALPHA];
    const weft_real *const amplitude = b->param[AMPLITUDE];
    WEFT_INDEPENDENT
    for (int i = 0; i < b->n; i++) {
        const weft_half h = weft_half_of(lx[i], ly[i], lz[i], vx[i], vy[i], vz[i]);
        const weft_real nl = h.lit, fresnel = f0[i] + (1 - f0[i]) * weft_schlick_power(h.grazing);
        const weft_real fv = h.valid * fresnel * weft_cloth_v(nl, h.nv);
        const weft_real diffuse = h.valid * (1 - f0[i]) * weft_schlick_rest(h.lh) * (1 / WEFT_PI);
        const weft_real rim = weft_cloth_rim(h.nh, h.s2, alpha[i]);
        for (int c = 0; c < 3; c++)
            value[c][i] = diffuse * b->param[ALBEDO + c][i] +
                          fv * weft_cloth_d_tinted(rim, b->param[FRONT + c][i], b->param[RIM + c][i],
                                                   alpha[i], amplitude[i]);
    }
}

#ifndef WEFT_SINGLE /* what there is once */

#include "shading/brdf/sampling.h"

static const weft_brdf_param params[] = {
    {"albedo", "cdiff", 3, 0, 1, 0.5, "", "diffuse reflectance"},
    {"f0", NULL, 1, 0, 1, 0.04, "", "reflectance of the fibres at normal incidence, without tint"},
    {"front", NULL, 3, 0, 1, 1, "", "tint of what the fibres reflect to the front"},
    {"rim", NULL, 3, 0, 1, 1, "", "tint of the rim"},
    {"alpha", NULL, 1, 1e-4, 1, 0.5, "", "width of the rim lobe"},
    {"amplitude", "A", 1, 0, 4, 4, "", "weight of the rim lobe against the constant offset"},
    {0},
};

const weft_brdf weft_brdf_cloth_two_tone = {
    .name = "cloth-two-tone",
    .summary = "the Order's cloth with a tint for the front and one for the rim, for shot fabrics",
    .source = "The Order: 1886 (Neubelt, Pettineo 2013), two-tone specular of figure 5; S-ORD-16",
    .flags = WEFT_BRDF_RECIPROCAL | WEFT_BRDF_PASSIVE,
    .params = params,
    .eval = weft_brdf_eval_cloth_two_tone,
    .eval_f32 = weft_brdf_eval_cloth_two_tone_f32,
    .sample = weft_brdf_sample_cosine,
    .pdf = weft_brdf_pdf_cosine,
};

#endif
