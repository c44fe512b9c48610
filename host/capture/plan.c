#include "host/capture/plan.h"

#include <math.h>
#include <stdio.h>

static void add(weft_capture_plan *plan, weft_planned_frame frame)
{
    plan->frames[plan->n++] = frame;
}

static void add_single(weft_capture_plan *plan, weft_frame_role role, uint32_t lights, double exposure_s,
                       const char *suffix)
{
    weft_planned_frame frame = {.role = role,
                                .light = -1,
                                .lights = lights,
                                .exposure_s = exposure_s,
                                .middle = true,
                                .shortest = true};
    snprintf(frame.file, sizeof frame.file, "%s%s", weft_frame_role_name(role), suffix);
    add(plan, frame);
}

static void add_light(weft_capture_plan *plan, int light, double exposure_s, int n_exposures,
                      const char *suffix)
{
    const int middle = (n_exposures - 1) / 2;
    for (int i = 0; i < n_exposures; i++) {
        weft_planned_frame frame = {.role = WEFT_ROLE_LIGHT,
                                    .light = light,
                                    .lights = UINT32_C(1) << light,
                                    .exposure_s = exposure_s * pow(WEFT_CAPTURE_BRACKET_FACTOR, i - middle),
                                    .middle = i == middle,
                                    .shortest = i == 0};
        if (n_exposures == 1)
            snprintf(frame.file, sizeof frame.file, "light-%02d%s", light, suffix);
        else
            snprintf(frame.file, sizeof frame.file, "light-%02d-b%d%s", light, i, suffix);
        add(plan, frame);
    }
}

void weft_capture_plan_make(const weft_capture_options *o, int n_lights, const char *suffix,
                            weft_capture_plan *plan)
{
    const uint32_t every = n_lights < 32 ? (UINT32_C(1) << n_lights) - 1 : UINT32_MAX;
    *plan = (weft_capture_plan){0};
    if (!o->no_ambient) /* first: what the lights are compared with */
        add_single(plan, WEFT_ROLE_AMBIENT, 0, o->exposure_s, suffix);
    for (int light = 0; light < n_lights && !o->no_lights; light++)
        if (o->lights >> light & 1)
            add_light(plan, light, o->exposure_s, o->bracket, suffix);
    if (o->all)
        add_single(plan, WEFT_ROLE_ALL, every, o->exposure_s, suffix);
    if (o->dark) /* last: somebody has to come and cap the lens */
        add_single(plan, WEFT_ROLE_DARK, 0, o->exposure_s, suffix);
}
