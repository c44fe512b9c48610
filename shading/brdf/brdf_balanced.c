#include "shading/brdf/fresnel.h"
#include "shading/brdf/sampling.h"

#include "core/clones.h"

static const weft_brdf_param params[] = {
    {"albedo", "cdiff", 3, 0, 1, 0.5, "", "diffuse reflectance below the coat"},
    {"f0", NULL, 3, 0, 1, 0.04, "", "reflectance of the coat at normal incidence"},
    {0},
};

/*
 * f = (1 - F(v.h)) c_diff/pi, S-ORD-08.
 *
 * The seed says that this breaks reciprocity.  It does not, for v.h = l.h; what it breaks, together with a
 * specular lobe, is energy conservation.  Alone it stays below 1.
 */
WEFT_CLONES
static void eval(const weft_brdf_batch *b, double *const value[3])
{
    const double *const lx = b->light[0], *const ly = b->light[1], *const lz = b->light[2];
    const double *const vx = b->view[0], *const vy = b->view[1], *const vz = b->view[2];
    const double *const ar = b->param[0], *const ag = b->param[1], *const ab = b->param[2];
    const double *const fr = b->param[3], *const fg = b->param[4], *const fb = b->param[5];
    double *const r = value[0], *restrict const g = value[1], *restrict const bl = value[2];
    WEFT_INDEPENDENT
    for (int i = 0; i < b->n; i++) {
        const weft_half h = weft_half_of(lx[i], ly[i], lz[i], vx[i], vy[i], vz[i]);
        const double k = h.valid * (1 - weft_schlick_weight(h.lh)) * (1 / WEFT_PI);
        /* 1 - F = (1 - F0)(1 - (1 - lh)^5) */
        r[i] = k * (1 - fr[i]) * ar[i];
        g[i] = k * (1 - fg[i]) * ag[i];
        bl[i] = k * (1 - fb[i]) * ab[i];
    }
}

const weft_brdf weft_brdf_balanced = {
    .name = "lambert-balanced",
    .summary = "Lambert dimmed by what the coat reflects at the half vector",
    .source = "The Order: 1886 (Neubelt, Pettineo 2013) eq. 15; S-ORD-08",
    .flags = WEFT_BRDF_RECIPROCAL | WEFT_BRDF_PASSIVE,
    .params = params,
    .eval = eval,
    .sample = weft_brdf_sample_cosine,
    .pdf = weft_brdf_pdf_cosine,
};
