#define WEFT_SINGLE /* shading/brdf/real.h */

#include "shading/preview/preview_samples.h"

#include "shading/lighting/representative.h"

#include <string.h>

/* Where the light is as seen from a sample. */
WEFT_INLINE void look_from(const weft_preview_samples *s, int i, const float point_mm[3], float to[3])
{
    for (int c = 0; c < 3; c++)
        to[c] = point_mm[c] - s->position_mm[c][i];
}

/* Aims at the middle of the light and sets its share of the irradiance, which is 1 at the origin. */
WEFT_CLONES
static void aim_at_middle(const float middle[3], weft_preview_samples *s)
{
    const float origin2 = weft_max(weft_dot3(middle, middle), 1e-6F);
    WEFT_INDEPENDENT
    for (int i = 0; i < s->n; i++) {
        float d[3];
        look_from(s, i, middle, d);
        const float r2 = weft_max(weft_dot3(d, d), 1e-6F), inverse = 1 / sqrtf(r2);
        for (int c = 0; c < 3; c++)
            s->lamp[c][i] = d[c] * inverse;
        s->irradiance[i] = origin2 / r2;
    }
}

/* Aims at the point of a ball that stands for it in the highlight. */
WEFT_CLONES
static void aim_at_ball(const float centre[3], float radius, const float *alpha, weft_preview_samples *s)
{
    WEFT_INDEPENDENT
    for (int i = 0; i < s->n; i++) {
        float to[3], r[3];
        look_from(s, i, centre, to);
        for (int c = 0; c < 3; c++)
            r[c] = 2 * s->view[2][i] * s->frame[2][c][i] - s->eye[c][i];
        const weft_representative point = weft_representative_sphere(to, r, radius, alpha[i]);
        for (int c = 0; c < 3; c++)
            s->lamp[c][i] = point.l[c];
        s->norm[i] = point.norm;
    }
}

/* The same of a tube. */
WEFT_CLONES
static void aim_at_tube(const float start[3], const float end[3], const float *alpha, weft_preview_samples *s)
{
    WEFT_INDEPENDENT
    for (int i = 0; i < s->n; i++) {
        float l0[3], l1[3], r[3], t;
        look_from(s, i, start, l0);
        look_from(s, i, end, l1);
        for (int c = 0; c < 3; c++)
            r[c] = 2 * s->view[2][i] * s->frame[2][c][i] - s->eye[c][i];
        const weft_representative point = weft_representative_tube(l0, l1, r, alpha[i], &t);
        for (int c = 0; c < 3; c++)
            s->lamp[c][i] = point.l[c];
        s->norm[i] = point.norm;
    }
}

/* Adds what the matte part, the first evaluation less the second, sends back. */
WEFT_CLONES
static void add_matte(const weft_preview_light *light, weft_preview_samples *s)
{
    for (int c = 0; c < 3; c++) {
        const float power = (float)light->irradiance[c];
        WEFT_INDEPENDENT
        for (int i = 0; i < s->n; i++)
            s->radiance[c][i] += weft_max(s->matte[c][i] - s->value[c][i], 0) * s->irradiance[i] *
                                 weft_max(s->light[2][i], 0) * power;
    }
}

WEFT_CLONES
static void add_mirrored(const weft_preview_light *light, weft_preview_samples *s)
{
    for (int c = 0; c < 3; c++) {
        const float power = (float)light->irradiance[c];
        WEFT_INDEPENDENT
        for (int i = 0; i < s->n; i++)
            s->radiance[c][i] +=
                s->value[c][i] * s->norm[i] * s->irradiance[i] * weft_max(s->light[2][i], 0) * power;
    }
}

void weft_preview_add_representative(const weft_preview_setup *setup, const weft_preview_light *light,
                                     weft_preview_samples *s)
{
    float albedo[3][WEFT_PREVIEW_RUN], start[3], end[3], middle[3];
    const int plane = setup->albedo_plane;
    const bool tube = light->kind == WEFT_PREVIEW_TUBE;
    const float *const alpha = s->param[setup->alpha_plane];
    for (int c = 0; c < 3; c++) {
        start[c] = (float)light->position_mm[c];
        end[c] = tube ? (float)light->end_mm[c] : start[c];
        middle[c] = 0.5F * (start[c] + end[c]);
    }
    aim_at_middle(middle, s);
    weft_preview_turn_lamp(s);
    weft_preview_eval(setup, s, s->matte);
    for (int c = 0; c < 3 && plane >= 0; c++) {
        memcpy(albedo[c], s->param[plane + c], sizeof albedo[c]);
        memset(s->param[plane + c], 0, sizeof albedo[c]);
    }
    weft_preview_eval(setup, s, s->value);
    weft_preview_shadow(setup, s);
    add_matte(light, s);
    if (tube)
        aim_at_tube(start, end, alpha, s);
    else
        aim_at_ball(start, (float)light->radius_mm, alpha, s);
    weft_preview_turn_lamp(s);
    weft_preview_eval(setup, s, s->value);
    add_mirrored(light, s);
    for (int c = 0; c < 3 && plane >= 0; c++)
        memcpy(s->param[plane + c], albedo[c], sizeof albedo[c]);
}
