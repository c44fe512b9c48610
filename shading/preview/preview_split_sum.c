#define WEFT_SINGLE /* shading/brdf/real.h */

#include "shading/preview/preview_samples.h"

#include "shading/brdf/half_vector.h"
#include "shading/brdf/metallic.h"

#include <string.h>

/* What the split sum needs of a GGX model, from its planes. */
typedef struct glossy {
    int albedo, f0, alpha, roughness, base, metallic, cavity; /* planes, -1: none */
} glossy;

bool weft_preview_is_glossy(const weft_brdf *brdf)
{
    static const char *const models[] = {"ggx", "ggx-specular", "unreal", "beckmann"};
    for (size_t i = 0; i < sizeof models / sizeof models[0]; i++)
        if (strcmp(brdf->name, models[i]) == 0)
            return true;
    return false;
}

static glossy glossy_of(const weft_brdf *brdf)
{
    glossy g;
    const char *const names[] = {"albedo", "f0", "alpha", "roughness", "base", "metallic", "cavity"};
    int *const planes[] = {&g.albedo, &g.f0, &g.alpha, &g.roughness, &g.base, &g.metallic, &g.cavity};
    for (size_t i = 0; i < sizeof names / sizeof names[0]; i++)
        if (!weft_brdf_find_param(brdf, names[i], planes[i]))
            *planes[i] = -1;
    return g;
}

/* Planes of a run on the way from directions to light. */
typedef struct around {
    float normal[3][WEFT_PREVIEW_RUN], mirror[3][WEFT_PREVIEW_RUN]; /* the panorama's frame, unit */
    float irradiance[3][WEFT_PREVIEW_RUN], mirrored[3][WEFT_PREVIEW_RUN];
    float alpha[WEFT_PREVIEW_RUN], nv[WEFT_PREVIEW_RUN];
    float scale[WEFT_PREVIEW_RUN], bias[WEFT_PREVIEW_RUN];
} around;

WEFT_CLONES
static void aim_mirror(const weft_preview_setup *setup, const glossy *g, const weft_preview_samples *s,
                       around *a)
{
    const float lies = setup->view->shape == WEFT_PREVIEW_PLANE ? 1 : 0;
    const float *const width = s->param[g->alpha >= 0 ? g->alpha : g->roughness];
    const float squared = g->alpha >= 0 ? 0 : 1;
    WEFT_INDEPENDENT
    for (int i = 0; i < s->n; i++) {
        const float nv = weft_max(s->view[2][i], WEFT_MIN_NV);
        float n[3], r[3];
        for (int c = 0; c < 3; c++) {
            n[c] = s->frame[2][c][i];
            r[c] = 2 * nv * n[c] - s->eye[c][i];
        }
        const float length2 = weft_max(r[0] * r[0] + r[1] * r[1] + r[2] * r[2], 1e-12F);
        const float inverse = 1 / sqrtf(length2);
        /* beside the plane the zenith is +Y */
        a->normal[0][i] = n[0];
        a->normal[1][i] = lies * n[1] - (1 - lies) * n[2];
        a->normal[2][i] = lies * n[2] + (1 - lies) * n[1];
        a->mirror[0][i] = r[0] * inverse;
        a->mirror[1][i] = (lies * r[1] - (1 - lies) * r[2]) * inverse;
        a->mirror[2][i] = (lies * r[2] + (1 - lies) * r[1]) * inverse;
        a->nv[i] = nv < 1 ? nv : 1;
        a->alpha[i] = width[i] * (1 - squared + squared * width[i]);
    }
}

/* Directions in the frame of a turned shape to those of the panorama, whose zenith is the axis of the turn.
 */
WEFT_CLONES
static void turn_round(float cosine, float sine, int n, float *x, float *y)
{
    WEFT_INDEPENDENT
    for (int i = 0; i < n; i++) {
        const float was = x[i];
        x[i] = cosine * was - sine * y[i];
        y[i] = sine * was + cosine * y[i];
    }
}

/* Adds light to one channel; parameters that the model has not are planes of a constant. */
WEFT_CLONES
static void add_channel(const float *albedo, const float *f0, const float *open, const around *a, int c,
                        float scale, weft_preview_samples *s)
{
    WEFT_INDEPENDENT
    for (int i = 0; i < s->n; i++) {
        const float lobe = f0[i] * a->scale[i] + a->bias[i];
        s->radiance[c][i] +=
            scale * open[i] *
            (albedo[i] * (1 - lobe) * a->irradiance[c][i] * (1 / WEFT_PI) + a->mirrored[c][i] * lobe);
    }
}

/* Base colour and metallic to albedo and F0 (S-UE4-12). */
WEFT_CLONES
static void split_base(const float *base, const float *metallic, int n, float *albedo, float *f0)
{
    WEFT_INDEPENDENT
    for (int i = 0; i < n; i++) {
        albedo[i] = weft_metallic_diffuse(base[i], metallic[i]);
        f0[i] = weft_metallic_f0(base[i], metallic[i], WEFT_F0_UNREAL);
    }
}

static void add_glossy(const weft_preview_setup *setup, const glossy *g, weft_preview_samples *s)
{
    static const float none[WEFT_PREVIEW_RUN];
    float ones[WEFT_PREVIEW_RUN];
    const float scale = (float)setup->view->surroundings.scale;
    around a;
    aim_mirror(setup, g, s, &a);
    if (setup->turn_sin != 0 || setup->turn_cos != 1) {
        turn_round((float)setup->turn_cos, (float)setup->turn_sin, s->n, a.normal[0], a.normal[1]);
        turn_round((float)setup->turn_cos, (float)setup->turn_sin, s->n, a.mirror[0], a.mirror[1]);
    }
    const float *const normal[3] = {a.normal[0], a.normal[1], a.normal[2]};
    const float *const mirror[3] = {a.mirror[0], a.mirror[1], a.mirror[2]};
    float *const irradiance[3] = {a.irradiance[0], a.irradiance[1], a.irradiance[2]};
    float *const mirrored[3] = {a.mirrored[0], a.mirrored[1], a.mirrored[2]};
    weft_environment_planes_irradiance(&setup->around, s->n, normal, irradiance);
    weft_environment_planes_look(&setup->around, s->n, mirror, a.alpha, mirrored);
    weft_environment_planes_share(&setup->around, s->n, a.nv, a.alpha, a.scale, a.bias);
    for (int i = 0; i < s->n; i++)
        ones[i] = 1;
    const float *const open = g->cavity >= 0 ? s->param[g->cavity] : ones;
    for (int c = 0; c < 3; c++) {
        float albedo[WEFT_PREVIEW_RUN], f0[WEFT_PREVIEW_RUN];
        if (g->base >= 0)
            split_base(s->param[g->base + c], s->param[g->metallic], s->n, albedo, f0);
        const float *const matte = g->albedo >= 0 ? s->param[g->albedo + c] : none;
        const float *const coat = g->f0 >= 0 ? s->param[g->f0 + c] : none;
        add_channel(g->base >= 0 ? albedo : matte, g->base >= 0 ? f0 : coat, open, &a, c, scale, s);
    }
}

bool weft_preview_add_split_sum(const weft_preview_setup *setup, weft_preview_samples *s)
{
    if (!weft_preview_is_glossy(setup->surface->brdf))
        return false;
    const glossy g = glossy_of(setup->surface->brdf);
    add_glossy(setup, &g, s);
    return true;
}
