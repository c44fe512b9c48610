#include "shading/preview/preview_samples.h"

#include "shading/brdf/half_vector.h"

/* A place or direction of a lamp, turned back about the axis of weft_preview_view.turn_rad through `middle`.
 */
static void turn_vector(const weft_preview_setup *setup, const double middle[3], double v[3])
{
    const bool plane = setup->view->shape == WEFT_PREVIEW_PLANE;
    const int b = plane ? 1 : 2; /* the other axis of the turn's plane */
    const double sine = plane ? -setup->turn_sin : setup->turn_sin;
    const double x = v[0] - middle[0], y = v[b] - middle[b];
    v[0] = middle[0] + setup->turn_cos * x - sine * y;
    v[b] = middle[b] + sine * x + setup->turn_cos * y;
}

/* What a lamp's strength is given for: its distance from the origin, squared. */
static double lamp_distance2(const weft_preview_light *light)
{
    double sum = 0;
    for (int c = 0; c < 3; c++)
        sum += pow(light->kind == WEFT_PREVIEW_TUBE ? 0.5 * (light->position_mm[c] + light->end_mm[c])
                                                    : light->position_mm[c],
                   2);
    return sum;
}

void weft_preview_turn_lamps(const weft_preview_setup *setup, weft_preview_view *view)
{
    const weft_preview_surface *const surface = setup->surface;
    const weft_preview_crop crop = setup->crop;
    const double none[3] = {0};
    double middle[3] = {0};
    if (view->shape == WEFT_PREVIEW_PLANE) {
        middle[0] = surface->origin_mm[0] + (crop.x + 0.5 * (crop.width - 1)) * surface->mm_per_px;
        middle[1] = surface->origin_mm[1] - (crop.y + 0.5 * (crop.height - 1)) * surface->mm_per_px;
    }
    for (int k = 0; k < view->n_lights; k++) {
        weft_preview_light *const light = &view->lights[k];
        const double before = lamp_distance2(light);
        turn_vector(setup, none, light->direction);
        turn_vector(setup, middle, light->position_mm);
        turn_vector(setup, middle, light->end_mm);
        for (int c = 0; c < 3 && light->kind != WEFT_PREVIEW_DISTANT; c++)
            light->irradiance[c] *= before / weft_max(lamp_distance2(light), 1e-6);
    }
}
