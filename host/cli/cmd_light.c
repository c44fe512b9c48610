/* weft light on, level, off, status: the lights by hand. */
#include "core/log.h"
#include "core/progress.h"
#include "core/text.h"
#include "host/cli/command.h"
#include "host/cli/device_open.h"

#include <math.h>
#include <stdio.h>
#include <string.h>
#include <time.h>

typedef struct light_args {
    weft_device_options devices;
    double seconds; /* 0: until Ctrl-C */
    bool watch;
} light_args;

static const weft_field hold_fields[] = {
    WEFT_CONTROLLER_FIELDS(light_args, devices),
    {.key = "seconds",
     .short_opt = 's',
     .type = WEFT_FIELD_F64,
     .offset = offsetof(light_args, seconds),
     .unit = "s",
     .min = 0,
     .max = 86400,
     .def = "0",
     .help = "go off and end after so long; 0: when Ctrl-C is pressed"},
    {0},
};

static const weft_field plain_fields[] = {
    WEFT_CONTROLLER_FIELDS(light_args, devices),
    {0},
};

static const weft_field status_fields[] = {
    WEFT_CONTROLLER_FIELDS(light_args, devices),
    {.key = "watch",
     .short_opt = 'w',
     .type = WEFT_FIELD_FLAG,
     .offset = offsetof(light_args, watch),
     .help = "go on, a line every half a second, until Ctrl-C"},
    {0},
};

/* -- which lights --------------------------------------------------------------------------------------- */

enum { MAX_LIGHTS = 32 };

static weft_err bad_lights(const char *text, weft_error *err)
{
    return weft_fail(
        err, WEFT_ERR_USAGE,
        "\"%s\" names no lights: wanted a number from 0, a range (0-5), a list (0,2,7) or \"all\"", text);
}

/* One "3" or "0-5". */
static bool parse_range(const char *text, size_t n, uint32_t *mask)
{
    char word[16], *dash;
    int first, last;
    if (n >= sizeof word)
        return false;
    memcpy(word, text, n);
    word[n] = '\0';
    dash = strchr(word, '-');
    if (dash)
        *dash = '\0';
    if (!weft_text_to_int(word, &first) || !weft_text_to_int(dash ? dash + 1 : word, &last))
        return false;
    if (first < 0 || first > last || last >= MAX_LIGHTS)
        return false;
    for (int i = first; i <= last; i++)
        *mask |= 1u << i;
    return true;
}

/* Adds the lights of "3", "0,2,7", "0-5" to the mask; "all" gives every bit. */
static weft_err parse_lights(const char *text, uint32_t *mask, weft_error *err)
{
    if (strcmp(text, "all") == 0) {
        *mask = UINT32_MAX;
        return WEFT_OK;
    }
    for (const char *p = text;; p++) {
        const size_t n = strcspn(p, ",");
        if (!parse_range(p, n, mask))
            return bad_lights(text, err);
        p += n;
        if (!*p)
            return WEFT_OK;
    }
}

/* "0,2,7" */
static void print_mask(uint32_t mask, char *text, size_t size)
{
    size_t used = 0;
    text[0] = '\0';
    for (int i = 0; i < MAX_LIGHTS && used + 4 < size; i++)
        if (mask >> i & 1)
            used += (size_t)snprintf(text + used, size - used, "%s%d", used ? "," : "", i);
}

static json_t *mask_to_json(uint32_t mask)
{
    json_t *const list = json_array();
    for (int i = 0; i < MAX_LIGHTS; i++)
        if (mask >> i & 1)
            json_array_append_new(list, json_integer(i));
    return list;
}

/* -- on, level ------------------------------------------------------------------------------------------ */

static weft_err open_controller(const light_args *args, weft_controller **controller, weft_error *err)
{
    weft_device_names names;
    WEFT_TRY(weft_device_options_resolve(&args->devices, &names, err));
    WEFT_TRY(weft_device_open_controller(&names, controller, err));
    weft_controller_panic_on_crash(*controller);
    return WEFT_OK;
}

static weft_err say_lit(const weft_invocation *inv, const weft_controller_info *info, uint32_t mask,
                        int level, uint32_t on_tick, weft_error *err)
{
    char list[128];
    if (inv->json)
        return weft_print_json(inv,
                               json_pack("{s:s, s:o, s:i, s:i, s:I, s:I}", "port", info->port, "lights",
                                         mask_to_json(mask), "level", level, "level_max", info->level_max,
                                         "on_tick", (json_int_t)on_tick, "tick_hz",
                                         (json_int_t)info->tick_hz),
                               err);
    print_mask(mask, list, sizeof list);
    if (level == 0)
        fprintf(inv->out, "off: %s\n", list);
    else
        fprintf(inv->out, "on: %s at %.3g %%\n", list, 100.0 * level / info->level_max);
    if (fflush(inv->out) != 0)
        return weft_fail_errno(err, WEFT_ERR_IO, "the result cannot be written");
    return WEFT_OK;
}

enum { COMES_BACK_WITHIN_S = 30 };

/* `status` is a failure with `why`: one that a cable may mend that is put in again is waited out. */
static weft_err come_back(weft_controller *c, weft_err status, const weft_error *why, weft_error *err)
{
    if (!weft_controller_is_gone(c)) {
        if (err)
            *err = *why;
        return status;
    }
    weft_warn("%s; waiting %d s for it", why->text, COMES_BACK_WITHIN_S);
    return weft_controller_reopen(c, COMES_BACK_WITHIN_S, err);
}

/* Asks again often enough for lease and time limit; the firmware does not blink at that. */
static weft_err hold(weft_controller *c, uint32_t mask, int level, int max_on_ms, double seconds,
                     weft_error *err)
{
    const double begin_s = weft_clock_s(), renew_s = 0.2;
    double renewed_s = begin_s;
    for (;;) {
        const double now_s = weft_clock_s(), left_s = seconds > 0 ? seconds - (now_s - begin_s) : 1;
        if (left_s <= 0)
            return WEFT_OK;
        if (weft_cancelled())
            return seconds > 0 ? weft_fail(err, WEFT_ERR_CANCELLED, "cancelled; the lights are off")
                               : WEFT_OK;
        if (now_s - renewed_s >= renew_s) {
            weft_error why = {0};
            const weft_err status = weft_controller_light(c, mask, level, max_on_ms, NULL, &why);
            if (status == WEFT_OK)
                renewed_s = now_s;
            else
                WEFT_TRY(come_back(c, status, &why, err));
        }
        const struct timespec nap = {.tv_nsec = (long)(1e9 * fmin(left_s, 0.02))};
        nanosleep(&nap, NULL);
    }
}

static weft_err light_and_hold(const weft_invocation *inv, const light_args *args, uint32_t mask,
                               double percent, weft_error *err)
{
    weft_controller *c = NULL;
    WEFT_TRY(open_controller(args, &c, err));
    const weft_controller_info *const info = weft_controller_get_info(c);
    const int level = (int)lround(percent / 100 * info->level_max);
    const int max_on_ms = info->max_on_ms < 1000 ? info->max_on_ms : 1000;
    uint32_t on_tick = 0, off_tick = 0;
    if (mask == UINT32_MAX)
        mask = info->n_lights < MAX_LIGHTS ? (1u << info->n_lights) - 1 : UINT32_MAX;
    weft_err status = WEFT_OK;
    if (level == 0 && percent > 0)
        status = weft_fail(err, WEFT_ERR_RANGE,
                           "%g %% would be dark: the least light of this controller is %.2g %%", percent,
                           100.0 / info->level_max);
    if (status == WEFT_OK)
        status = weft_controller_light(c, mask, level, max_on_ms, &on_tick, err);
    if (status == WEFT_OK)
        status = say_lit(inv, info, mask, level, on_tick, err);
    if (status == WEFT_OK)
        status = hold(c, mask, level, max_on_ms, args->seconds, err);
    if (status == WEFT_OK)
        status = weft_controller_off(c, &off_tick, err);
    if (status == WEFT_OK && level > 0)
        weft_note("off after %.3f s", (double)(uint32_t)(off_tick - on_tick) / info->tick_hz);
    weft_controller_close(c);
    return status;
}

static weft_err run_on(const weft_invocation *inv, const void *args, weft_error *err)
{
    uint32_t mask = 0;
    for (int i = 0; i < inv->n_operands; i++)
        WEFT_TRY(parse_lights(inv->operands[i], &mask, err));
    return light_and_hold(inv, args, mask, 100, err);
}

static weft_err run_level(const weft_invocation *inv, const void *args, weft_error *err)
{
    uint32_t mask = 0;
    double percent;
    WEFT_TRY(parse_lights(inv->operands[0], &mask, err));
    if (!weft_text_to_double(inv->operands[1], &percent) || percent < 0 || percent > 100)
        return weft_fail(err, WEFT_ERR_USAGE, "\"%s\" is no level: wanted 0 to 100 per cent",
                         inv->operands[1]);
    return light_and_hold(inv, args, mask, percent, err);
}

/* -- off, status ---------------------------------------------------------------------------------------- */

static weft_err run_off(const weft_invocation *inv, const void *args, weft_error *err)
{
    weft_controller *c = NULL;
    WEFT_TRY(open_controller(args, &c, err));
    weft_controller_status s = {0};
    weft_err status = weft_controller_off(c, NULL, err);
    if (status == WEFT_OK)
        status = weft_controller_get_status(c, &s, err);
    if (status == WEFT_OK && s.lights != 0)
        status = weft_fail(err, WEFT_ERR_DEVICE, "%s: the controller says that lights 0x%x are still on",
                           weft_controller_get_info(c)->port, (unsigned)s.lights);
    if (status == WEFT_OK && inv->json)
        status = weft_print_json(
            inv, json_pack("{s:s, s:o}", "port", weft_controller_get_info(c)->port, "lights", json_array()),
            err);
    else if (status == WEFT_OK)
        fputs("all lights are off\n", inv->out);
    weft_controller_close(c);
    return status;
}

static weft_err print_status(const weft_invocation *inv, const weft_controller_info *i,
                             const weft_controller_status *s, weft_error *err)
{
    if (inv->json)
        return weft_print_json(
            inv,
            json_pack("{s:s, s:s, s:s, s:s, s:s, s:[ii], s:i, s:i, s:i, s:I, s:s, s:s, s:o, s:i, s:i, s:I, "
                      "s:I, s:I, "
                      "s:I, s:I}",
                      "port", i->port, "firmware", i->firmware, "git", i->git_id, "serial", i->serial_number,
                      "settings", i->settings, "protocol", i->protocol_major, i->protocol_minor, "n_lights",
                      i->n_lights, "level_max", i->level_max, "max_on_ms", i->max_on_ms, "tick_hz",
                      (json_int_t)i->tick_hz, "reset_cause", i->reset_cause, "state", s->state, "lights",
                      mask_to_json(s->lights), "level", s->level, "lease_left_ms", s->lease_left_ms, "frames",
                      (json_int_t)s->frames, "crc_errors", (json_int_t)s->crc_errors, "overruns",
                      (json_int_t)s->overruns, "resets", (json_int_t)s->resets, "retries",
                      (json_int_t)s->retries),
            err);
    fprintf(inv->out,
            "port        %s\n"
            "firmware    %s (%s), protocol %d.%d\n"
            "serial      %s\n"
            "settings    %s\n"
            "lights      %d, levels 0 to %d, at most %d ms at a time\n"
            "state       %s\n"
            "last start  %s, %u resets since power on\n"
            "line        %u frames, %u damaged, %u bytes lost, %u retries\n",
            i->port, i->firmware, i->git_id, i->protocol_major, i->protocol_minor,
            i->serial_number[0] ? i->serial_number : "none stored", i->settings, i->n_lights, i->level_max,
            i->max_on_ms, s->state, i->reset_cause, s->resets, s->frames, s->crc_errors, s->overruns,
            s->retries);
    return WEFT_OK;
}

/* One line, or one JSON object, every half a second. */
static weft_err watch(const weft_invocation *inv, weft_controller *c, weft_error *err)
{
    while (!weft_cancelled()) {
        weft_controller_status s;
        char lights[128];
        weft_error why = {0};
        const weft_err status = weft_controller_get_status(c, &s, &why);
        if (status != WEFT_OK) {
            WEFT_TRY(come_back(c, status, &why, err));
            continue;
        }
        print_mask(s.lights, lights, sizeof lights);
        if (inv->json)
            WEFT_TRY(print_status(inv, weft_controller_get_info(c), &s, err));
        else
            fprintf(inv->out, "%10.3f s  %-7s  lights %s  %u frames, %u damaged, %u bytes lost, %u retries\n",
                    (double)s.ticks / weft_controller_get_info(c)->tick_hz, s.state,
                    lights[0] ? lights : "none", s.frames, s.crc_errors, s.overruns, s.retries);
        if (fflush(inv->out) != 0)
            return weft_fail_errno(err, WEFT_ERR_IO, "the result cannot be written");
        for (int i = 0; i < 25 && !weft_cancelled(); i++)
            nanosleep(&(struct timespec){.tv_nsec = 20000000}, NULL);
    }
    return WEFT_OK;
}

static weft_err run_status(const weft_invocation *inv, const void *args, weft_error *err)
{
    weft_controller *c = NULL;
    weft_controller_status s;
    WEFT_TRY(open_controller(args, &c, err));
    weft_err status = weft_controller_get_status(c, &s, err);
    if (status == WEFT_OK)
        status = print_status(inv, weft_controller_get_info(c), &s, err);
    if (status == WEFT_OK && ((const light_args *)args)->watch)
        status = watch(inv, c, err);
    weft_controller_close(c);
    return status;
}

/* -- the commands --------------------------------------------------------------------------------------- */

#define HOW_LIGHTS_END                                                                                       \
    "Lights are numbered from 0.  A light goes off when its host falls silent, so the command stays and\n"   \
    "holds it until Ctrl-C, or for --seconds; when it is killed the lights go off within a second."

const weft_command weft_cmd_light_on = {
    .name = "light on",
    .summary = "turn lights on and hold them until Ctrl-C",
    .operands = "LIGHTS...",
    .min_operands = 1,
    .max_operands = -1,
    .args_size = sizeof(light_args),
    .fields = hold_fields,
    .details = "LIGHTS is a number (3), a range (0-5), a list (0,2,7) or \"all\".\n" HOW_LIGHTS_END,
    .example = "weft light on 3 --seconds 5 --port /dev/ttyACM0",
    .run = run_on,
};

const weft_command weft_cmd_light_level = {
    .name = "light level",
    .summary = "turn lights on at less than full brightness and hold them",
    .operands = "LIGHTS PERCENT",
    .min_operands = 2,
    .max_operands = 2,
    .args_size = sizeof(light_args),
    .fields = hold_fields,
    .details = "PERCENT is the share of full brightness, 0 to 100, to the nearest step of the "
               "controller (1/256).\n" HOW_LIGHTS_END,
    .example = "weft light level 0-9 12.5 --rig /tmp/rig",
    .run = run_level,
};

const weft_command weft_cmd_light_off = {
    .name = "light off",
    .summary = "turn all lights off",
    .operands = "",
    .args_size = sizeof(light_args),
    .fields = plain_fields,
    .details = "For lights that another program holds, end that program: the port is its own.",
    .example = "weft light off",
    .run = run_off,
};

const weft_command weft_cmd_light_status = {
    .name = "light status",
    .summary = "say what the light controller is and how it does",
    .operands = "",
    .args_size = sizeof(light_args),
    .fields = status_fields,
    .details = "Opening the port resets an Arduino, so its counters begin at that.",
    .example = "weft light status --json",
    .run = run_status,
};
