#include "shading/preview/preview_samples.h"
#include "shading/preview/preview_visibility.h"

#include "shading/brdf/half_vector.h"

static double dot(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static double distance2(const double a[3])
{
    return weft_max(dot(a, a), 1e-6);
}

/* The strength of a light near the surface is given at the origin. */
static double at_origin2(const weft_preview_light *light)
{
    double middle[3];
    for (int c = 0; c < 3; c++)
        middle[c] = light->kind == WEFT_PREVIEW_TUBE ? 0.5 * (light->position_mm[c] + light->end_mm[c])
                                                     : light->position_mm[c];
    return distance2(middle);
}

/* World direction to a point and its share of the irradiance. */
static void aim_at(weft_preview_samples *s, int i, const double point_mm[3], double origin2, double weight)
{
    double d[3];
    for (int c = 0; c < 3; c++)
        d[c] = point_mm[c] - (double)s->position_mm[c][i];
    const double r2 = distance2(d), inverse = 1 / sqrt(r2);
    for (int c = 0; c < 3; c++)
        s->lamp[c][i] = (float)(d[c] * inverse);
    s->reach_mm[i] = (float)(r2 * inverse);
    s->irradiance[i] = (float)(weight * origin2 / r2);
}

/* Point k of a ball as seen from the sample: the cone that holds it, cut into equal solid angles by a
 * spiral.  Facing it, the ball gives pi L sin^2 of the cone's half angle. */
static void aim_at_ball(const weft_preview_light *light, weft_preview_samples *s, int i, int k)
{
    double d[3], t[3];
    for (int c = 0; c < 3; c++)
        d[c] = light->position_mm[c] - (double)s->position_mm[c][i];
    const double r2 = distance2(d), inverse = 1 / sqrt(r2);
    const double sine2 = fmin(light->radius_mm * light->radius_mm / r2, 0.9999), reach = 1 - sqrt(1 - sine2);
    for (int c = 0; c < 3; c++)
        d[c] *= inverse;
    const double z = 1 - reach * (k + 0.5) / WEFT_PREVIEW_AREA_POINTS, phi = 2.399963229728653 * k;
    const double r = sqrt(weft_max(1 - z * z, 0));
    const int small = fabs(d[0]) < 0.7 ? 0 : 1;
    for (int c = 0; c < 3; c++)
        t[c] = (c == small) - d[small] * d[c];
    const double unit = 1 / sqrt(dot(t, t));
    for (int c = 0; c < 3; c++)
        t[c] *= unit;
    const double b[3] = {d[1] * t[2] - d[2] * t[1], d[2] * t[0] - d[0] * t[2], d[0] * t[1] - d[1] * t[0]};
    for (int c = 0; c < 3; c++)
        s->lamp[c][i] = (float)(z * d[c] + r * (cos(phi) * t[c] + sin(phi) * b[c]));
    s->reach_mm[i] = (float)(r2 * inverse);
    /* 2 pi reach / (pi sine2) */
    s->irradiance[i] = (float)(2 * reach / sine2 * at_origin2(light) / r2 / WEFT_PREVIEW_AREA_POINTS);
}

void weft_preview_aim(const weft_preview_light *light, weft_preview_samples *s, int i, int k)
{
    const double t = (k + 0.5) / WEFT_PREVIEW_AREA_POINTS;
    double point[3];
    switch (light->kind) {
    case WEFT_PREVIEW_DISTANT:
        for (int c = 0; c < 3; c++)
            s->lamp[c][i] = (float)light->direction[c];
        s->irradiance[i] = 1;
        break;
    case WEFT_PREVIEW_POINT:
        aim_at(s, i, light->position_mm, at_origin2(light), 1);
        break;
    case WEFT_PREVIEW_BALL:
        aim_at_ball(light, s, i, k);
        break;
    case WEFT_PREVIEW_TUBE:
        for (int c = 0; c < 3; c++)
            point[c] = light->position_mm[c] + t * (light->end_mm[c] - light->position_mm[c]);
        aim_at(s, i, point, at_origin2(light), 1.0 / WEFT_PREVIEW_AREA_POINTS);
        break;
    }
}

/*
 * How much of the light the shape itself lets through where a bumpy normal still faces it.
 *
 * A plane shadows nothing until the light is below it.  On the others a hard cut at the terminator would
 * show as a line across the bumps; the soft one is Chiang et al. 2019 ("Taming the shadow terminator"):
 * S = -G^3 + G^2 + G with G = min(1, (g.l)/((n.l)(g.n))), g the normal of the shape.
 */
static float shape_shadow(const weft_preview_setup *setup, const weft_preview_samples *s, int i)
{
    const float gl = s->lamp[0][i] * s->axis[2][0][i] + s->lamp[1][i] * s->axis[2][1][i] +
                     s->lamp[2][i] * s->axis[2][2][i];
    const float nl = s->light[2][i], gn = s->normal[2][i];
    if (gl <= 0 || nl <= 0)
        return 0;
    if (setup->view->shape == WEFT_PREVIEW_PLANE)
        return 1;
    const float product = nl * (gn > 1e-3F ? gn : 1e-3F), g = gl < product ? gl / product : 1;
    const float soft = g * (1 + g * (1 - g));
    if (setup->view->shape != WEFT_PREVIEW_DRAPE || setup->view->shadows.folds != WEFT_PREVIEW_FOLDS_FORMULA)
        return soft;
    const double at[2] = {s->drape[0][i], s->drape[1][i]};
    const double lamp[3] = {(double)s->lamp[0][i], (double)s->lamp[1][i], (double)s->lamp[2][i]};
    return soft * (float)weft_preview_drape_light(at, lamp);
}

void weft_preview_shadow(const weft_preview_setup *setup, weft_preview_samples *s)
{
    for (int i = 0; i < s->n; i++)
        s->irradiance[i] *= shape_shadow(setup, s, i);
    for (int i = 0; i < s->n && setup->visibility; i++)
        s->irradiance[i] *= s->visible[i];
}

/* Adds f E for the lamp directions that are set. */
static void add_lamp(const weft_preview_setup *setup, const weft_preview_light *light,
                     weft_preview_samples *s)
{
    weft_preview_turn_lamp(s);
    weft_preview_eval(setup, s, s->value);
    weft_preview_shadow(setup, s);
    for (int c = 0; c < 3; c++) {
        const float power = (float)light->irradiance[c];
        for (int i = 0; i < s->n; i++)
            s->radiance[c][i] +=
                s->value[c][i] * s->irradiance[i] * (s->light[2][i] > 0 ? s->light[2][i] : 0) * power;
    }
}

void weft_preview_add_light(const weft_preview_setup *setup, const weft_preview_light *light,
                            weft_preview_samples *s)
{
    const bool large = light->kind == WEFT_PREVIEW_BALL || light->kind == WEFT_PREVIEW_TUBE;
    if (setup->visibility)
        weft_preview_see(setup, (int)(light - setup->view->lights), s);
    if (large && light->area == WEFT_PREVIEW_REPRESENTATIVE && setup->alpha_plane >= 0) {
        weft_preview_add_representative(setup, light, s);
        return;
    }
    for (int k = 0; k < (large ? WEFT_PREVIEW_AREA_POINTS : 1); k++) {
        for (int i = 0; i < s->n; i++)
            weft_preview_aim(light, s, i, k);
        add_lamp(setup, light, s);
    }
}
