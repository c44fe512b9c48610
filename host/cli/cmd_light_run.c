/* weft light run: a sequence file, timed by the board. */
#include "core/json.h"
#include "core/log.h"
#include "core/mem.h"
#include "host/cli/command.h"
#include "host/cli/device_open.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

typedef struct run_args {
    weft_device_options devices;
    int repeat;
} run_args;

static const weft_field fields[] = {
    WEFT_CONTROLLER_FIELDS(run_args, devices),
    {.key = "repeat",
     .short_opt = 'n',
     .type = WEFT_FIELD_INT,
     .offset = offsetof(run_args, repeat),
     .min = 1,
     .max = 1000000,
     .def = "1",
     .help = "how many times the sequence runs"},
    {0},
};

enum { MAX_STEPS = 64, MAX_LIGHTS = 32 };

/* -- the file ------------------------------------------------------------------------------------------- */

static weft_err read_lights(const json_t *object, uint32_t *mask, const char *place, weft_error *err)
{
    const json_t *list = NULL;
    WEFT_TRY(weft_json_get_array(object, "lights", WEFT_JSON_REQUIRED, &list, place, err));
    *mask = 0;
    for (size_t i = 0; i < json_array_size(list); i++) {
        const json_t *const item = json_array_get(list, i);
        const json_int_t light = json_integer_value(item);
        if (!json_is_integer(item) || light < 0 || light >= MAX_LIGHTS)
            return weft_fail(err, WEFT_ERR_FORMAT, "%s: \"lights\": wanted numbers of lights from 0", place);
        *mask |= 1u << light;
    }
    return WEFT_OK;
}

static weft_err read_us(const json_t *object, const char *key, weft_json_need need, double def_ms,
                        uint32_t *us, const char *place, weft_error *err)
{
    double ms = def_ms;
    WEFT_TRY(weft_json_get_number(object, key, need, 0, 10000, &ms, place, err));
    *us = (uint32_t)lround(1e3 * ms);
    return WEFT_OK;
}

static weft_err read_step(const json_t *object, int level_max, weft_controller_step *step, const char *place,
                          weft_error *err)
{
    static const char *const known[] = {"lights",  "level",  "settle_ms", "trigger_ms",
                                        "hold_ms", "gap_ms", "until",     NULL};
    double percent = 100;
    const char *until = "time";
    WEFT_TRY(weft_json_refuse_unknown(object, known, "a step; weft light run --help lists them", place, err));
    WEFT_TRY(read_lights(object, &step->lights, place, err));
    WEFT_TRY(weft_json_get_number(object, "level", WEFT_JSON_OPTIONAL, 0, 100, &percent, place, err));
    WEFT_TRY(read_us(object, "settle_ms", WEFT_JSON_OPTIONAL, 2, &step->settle_us, place, err));
    WEFT_TRY(read_us(object, "trigger_ms", WEFT_JSON_OPTIONAL, 0.1, &step->trigger_us, place, err));
    WEFT_TRY(read_us(object, "hold_ms", WEFT_JSON_REQUIRED, 0, &step->hold_us, place, err));
    WEFT_TRY(read_us(object, "gap_ms", WEFT_JSON_OPTIONAL, 1, &step->gap_us, place, err));
    WEFT_TRY(weft_json_get_text(object, "until", WEFT_JSON_OPTIONAL, &until, place, err));
    step->until_exposure = strcmp(until, "exposure") == 0;
    if (!step->until_exposure && strcmp(until, "time") != 0)
        return weft_fail(err, WEFT_ERR_FORMAT, "%s: \"until\" is \"%s\": wanted \"time\" or \"exposure\"",
                         place, until);
    step->level = (int)lround(percent / 100 * level_max);
    return WEFT_OK;
}

static weft_err read_steps(const json_t *root, const char *path, int level_max, weft_controller_step *steps,
                           int *n, weft_error *err)
{
    const json_t *list = NULL;
    WEFT_TRY(weft_json_get_array(root, "steps", WEFT_JSON_REQUIRED, &list, path, err));
    if (json_array_size(list) < 1 || json_array_size(list) > MAX_STEPS)
        return weft_fail(err, WEFT_ERR_FORMAT, "%s: %zu steps: wanted 1 to %d", path, json_array_size(list),
                         MAX_STEPS);
    *n = (int)json_array_size(list);
    for (int i = 0; i < *n; i++) {
        char place[512];
        snprintf(place, sizeof place, "%s, step %d", path, i);
        if (!json_is_object(json_array_get(list, (size_t)i)))
            return weft_fail(err, WEFT_ERR_FORMAT, "%s: wanted an object", place);
        WEFT_TRY(read_step(json_array_get(list, (size_t)i), level_max, &steps[i], place, err));
    }
    return WEFT_OK;
}

/* -- what it was ---------------------------------------------------------------------------------------- */

static double ms_between(const weft_controller_info *info, uint32_t from, uint32_t to)
{
    return 1e3 * (uint32_t)(to - from) / info->tick_hz;
}

static void print_lights(FILE *out, uint32_t mask)
{
    const char *comma = "";
    if (mask == 0)
        fputs("none", out);
    for (int i = 0; i < MAX_LIGHTS; i++)
        if (mask >> i & 1) {
            fprintf(out, "%s%d", comma, i);
            comma = ",";
        }
}

static void print_results(FILE *out, const weft_controller_info *info, const weft_controller_step *steps,
                          int n, const weft_controller_step_result *results)
{
    for (int i = 0; i < n; i++) {
        const weft_controller_step_result *const r = &results[i];
        fprintf(out, "step %d: lights ", i);
        print_lights(out, steps[i].lights);
        fprintf(out, " on for %.3f ms, trigger after %.3f ms, exposure ",
                ms_between(info, r->on_tick, r->off_tick), ms_between(info, r->on_tick, r->trigger_tick));
        if (!r->rose || !r->fell)
            fputs("not seen\n", out);
        else
            fprintf(out, "from %.3f to %.3f ms: %s\n", ms_between(info, r->on_tick, r->rise_tick),
                    ms_between(info, r->on_tick, r->fall_tick),
                    weft_controller_step_is_proved(info, &steps[i], r) ? "proved" : "not settled");
    }
}

static json_t *result_to_json(const weft_controller_info *info, const weft_controller_step *step,
                              const weft_controller_step_result *r)
{
    json_t *const o =
        json_pack("{s:i, s:I, s:I, s:I, s:b}", "step", r->index, "on_tick", (json_int_t)r->on_tick,
                  "trigger_tick", (json_int_t)r->trigger_tick, "off_tick", (json_int_t)r->off_tick, "proved",
                  (int)weft_controller_step_is_proved(info, step, r));
    if (o && r->rose)
        json_object_set_new(o, "rise_tick", json_integer(r->rise_tick));
    if (o && r->fell)
        json_object_set_new(o, "fall_tick", json_integer(r->fall_tick));
    return o;
}

/* -- the command ---------------------------------------------------------------------------------------- */

enum { COMES_BACK_WITHIN_S = 30, MAX_CUTS = 3 };

/* A run of which the cable was pulled out begins anew when it is in again: dark meanwhile, from the first
 * step, so that no step's lights are on without the steps before them.  A cable that falls out of each
 * attempt is not waited for. */
static weft_err run_whole(weft_controller *c, const weft_controller_step *steps, int n, int number, int *cuts,
                          weft_controller_step_result *results, weft_error *err)
{
    for (*cuts = 0;; ++*cuts) {
        weft_error why = {0};
        const weft_err status = weft_controller_run_sequence(c, steps, n, results, &why);
        if (status == WEFT_OK || !weft_controller_is_gone(c) || *cuts == MAX_CUTS) {
            if (status != WEFT_OK && err)
                *err = why;
            return status;
        }
        weft_warn("run %d was cut off, the lights are off: %s; waiting %d s for it", number, why.text,
                  COMES_BACK_WITHIN_S);
        WEFT_TRY(weft_controller_reopen(c, COMES_BACK_WITHIN_S, err));
        weft_warn("run %d begins again with its first step; what a camera took of it is void", number);
    }
}

static json_t *run_to_json(const weft_controller_info *info, const weft_controller_step *steps, int n,
                           const weft_controller_step_result *results)
{
    json_t *const run = json_array();
    for (int i = 0; i < n; i++)
        json_array_append_new(run, result_to_json(info, &steps[i], &results[i]));
    return run;
}

static weft_err run_times(const weft_invocation *inv, weft_controller *c, const weft_controller_step *steps,
                          int n, int repeat, weft_error *err)
{
    const weft_controller_info *const info = weft_controller_get_info(c);
    weft_controller_step_result results[MAX_STEPS];
    json_t *const runs = json_array(), *const cut_off = json_array();
    weft_err status = WEFT_OK;
    for (int k = 0; k < repeat && status == WEFT_OK; k++) {
        int cuts;
        status = run_whole(c, steps, n, k, &cuts, results, err);
        if (status != WEFT_OK)
            break;
        if (cuts > 0)
            json_array_append_new(cut_off, json_integer(k));
        if (inv->json)
            json_array_append_new(runs, run_to_json(info, steps, n, results));
        else
            print_results(inv->out, info, steps, n, results);
        fflush(inv->out); /* for those who follow a long series */
    }
    if (status == WEFT_OK && inv->json)
        return weft_print_json(inv,
                               json_pack("{s:I, s:o, s:o}", "tick_hz", (json_int_t)info->tick_hz, "runs",
                                         runs, "cut_off", cut_off),
                               err);
    json_decref(runs);
    json_decref(cut_off);
    return status;
}

static weft_err run(const weft_invocation *inv, const void *data, weft_error *err)
{
    const run_args *const args = data;
    weft_device_names names;
    weft_controller *c = NULL;
    weft_controller_step steps[MAX_STEPS];
    int n = 0;
    json_t *root = NULL;
    WEFT_TRY(weft_json_load_kind(inv->operands[0], "sequence", 1, &root, err));
    weft_err status = read_steps(root, inv->operands[0], 256, steps, &n, err); /* before any light */
    if (status == WEFT_OK)
        status = weft_device_options_resolve(&args->devices, &names, err);
    if (status == WEFT_OK)
        status = weft_device_open_controller(&names, &c, err);
    if (status == WEFT_OK) {
        weft_controller_panic_on_crash(c);
        status = read_steps(root, inv->operands[0], weft_controller_get_info(c)->level_max, steps, &n, err);
    }
    if (status == WEFT_OK)
        status = run_times(inv, c, steps, n, args->repeat, err);
    weft_controller_close(c);
    json_decref(root);
    return status;
}

const weft_command weft_cmd_light_run = {
    .name = "light run",
    .summary = "run a sequence of lights, timed by the controller",
    .operands = "FILE",
    .min_operands = 1,
    .max_operands = 1,
    .args_size = sizeof(run_args),
    .fields = fields,
    .details =
        "FILE is JSON: {\"weft\": \"sequence\", \"version\": 1, \"steps\": [...]}.  A step has \"lights\"\n"
        "(a list; empty for a dark frame) and \"hold_ms\" (from the trigger to lights off), and may have\n"
        "\"level\" (100 per cent), \"settle_ms\" (2; from lights on to the trigger), \"trigger_ms\" (0.1; "
        "the\n"
        "pulse), \"gap_ms\" (1; dark behind it) and \"until\": \"time\", or \"exposure\" to turn the lights "
        "off\n"
        "when the camera's exposure line falls, which must happen within hold_ms.\n"
        "\"proved\" means that the exposure line rose after settling and fell before the lights went off.\n"
        "When the controller is unplugged the lights go off within a second; plugged in again within 30 s,\n"
        "the run that was cut off begins anew (\"cut_off\" of --json lists such runs, from 0).",
    .example = "weft light run ten.json --repeat 3",
    .run = run,
};
