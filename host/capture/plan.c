#include "host/capture/plan.h"

#include "host/capture/auto_exposure.h"
#include "host/capture/exposures.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

static void add(weft_capture_plan *plan, weft_planned_frame frame)
{
    frame.row = -1;
    plan->frames[plan->n++] = frame;
}

static void add_single(weft_capture_plan *plan, weft_frame_role role, uint32_t lights, double exposure_s)
{
    add(plan, (weft_planned_frame){.role = role,
                                   .light = -1,
                                   .lights = lights,
                                   .exposure_s = exposure_s,
                                   .bracket = -1,
                                   .middle = true,
                                   .shortest = true});
}

static void add_exposure(weft_capture_plan *plan, int light, double exposure_s, int i, int n_exposures)
{
    const int middle = (n_exposures - 1) / 2;
    add(plan, (weft_planned_frame){.role = WEFT_ROLE_LIGHT,
                                   .light = light,
                                   .lights = UINT32_C(1) << light,
                                   .exposure_s = exposure_s * pow(WEFT_CAPTURE_BRACKET_FACTOR, i - middle),
                                   .bracket = n_exposures > 1 ? i : -1,
                                   .middle = i == middle,
                                   .shortest = i == 0});
}

/* The middle of a bracket comes first: it shows whether the light is on, and the others are compared with it.
 */
static void add_light(weft_capture_plan *plan, int light, double exposure_s, int n_exposures)
{
    const int middle = (n_exposures - 1) / 2;
    add_exposure(plan, light, exposure_s, middle, n_exposures);
    for (int i = 0; i < n_exposures; i++)
        if (i != middle)
            add_exposure(plan, light, exposure_s, i, n_exposures);
}

void weft_planned_frame_words(const weft_planned_frame *frame, char text[32])
{
    if (frame->role == WEFT_ROLE_LIGHT)
        snprintf(text, 32, "light %d", frame->light);
    else if (frame->role == WEFT_ROLE_ALL)
        snprintf(text, 32, "the frame with all lights");
    else
        snprintf(text, 32, "the %s frame", weft_frame_role_name(frame->role));
}

static weft_err refuse_one_name(const char *template, const weft_planned_frame *a,
                                const weft_planned_frame *b, weft_error *err)
{
    char first[32], second[32];
    const char *const lacks = a->role != b->role     ? "{kind}"
                              : a->light != b->light ? "{light}"
                                                     : "{bracket} or {exposure}";
    weft_planned_frame_words(a, first);
    weft_planned_frame_words(b, second);
    if (a->role == b->role && a->light == b->light)
        return weft_fail(err, WEFT_ERR_USAGE,
                         "--file-name \"%s\": two exposures of %s would both be %s; add %s", template, first,
                         a->file, lacks);
    return weft_fail(err, WEFT_ERR_USAGE, "--file-name \"%s\": %s and %s would both be %s; add %s", template,
                     first, second, a->file, lacks);
}

static weft_err name_frames(const char *template, const weft_set *set, const char *suffix,
                            weft_capture_plan *plan, weft_error *err)
{
    for (int i = 0; i < plan->n; i++) {
        weft_planned_frame *const f = &plan->frames[i];
        const weft_frame_facts facts = {.set = set->name,
                                        .created = set->created,
                                        .role = f->role,
                                        .light = f->light,
                                        .bracket = f->bracket,
                                        .index = i,
                                        .exposure_s = f->exposure_s};
        WEFT_TRY(weft_frame_name_make(template, &facts, suffix, f->file, err));
        for (int j = 0; j < i; j++)
            if (weft_frame_name_equal(plan->frames[j].file, f->file))
                return refuse_one_name(template, &plan->frames[j], f, err);
    }
    return WEFT_OK;
}

weft_err weft_capture_plan_make(const weft_capture_options *o, int n_lights, const weft_set *set,
                                const char *suffix, weft_capture_plan *plan, weft_error *err)
{
    const uint32_t every = n_lights < 32 ? (UINT32_C(1) << n_lights) - 1 : UINT32_MAX;
    const char *const template = o->file_name ? o->file_name : WEFT_FRAME_NAME_DEFAULT;
    const double longest_s = weft_exposures_longest(o); /* the least noise where there is least light */
    *plan = (weft_capture_plan){0};
    if (!o->no_ambient) /* first: what the lights are compared with */
        add_single(plan, WEFT_ROLE_AMBIENT, 0, longest_s);
    for (int light = 0; light < n_lights && !o->no_lights; light++)
        if (o->lights >> light & 1)
            add_light(plan, light, o->exposures_s[light] > 0 ? o->exposures_s[light] : 1,
                      o->brackets[light] > 0 ? o->brackets[light] : WEFT_LIGHT_LEVEL_MAX_BRACKET);
    if (o->all)
        add_single(plan, WEFT_ROLE_ALL, every, weft_exposures_shortest(o));
    if (o->dark) /* last: somebody has to come and cap the lens */
        add_single(plan, WEFT_ROLE_DARK, 0, longest_s);
    WEFT_TRY(weft_frame_name_check(template, err));
    return name_frames(template, set, suffix, plan, err);
}
