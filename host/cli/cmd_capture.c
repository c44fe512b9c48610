/* weft capture: photographs a sample under every light. */
#include "host/capture/average.h"
#include "host/capture/capture.h"
#include "host/capture/frame_name.h"
#include "host/capture/look.h"

#include "core/log.h"
#include "core/text.h"
#include "host/cli/command.h"
#include "host/cli/device_open.h"

#include <math.h>
#include <poll.h>
#include <string.h>
#include <unistd.h>

typedef struct capture_args {
    weft_device_options devices;
    const char *lights, *exposure, *name, *trigger, *file_name, *bracket;
    double gain, settle_s;
    int average, level;
    bool ambient, no_ambient, dark, all_frame, only_all, resume, dry_run, sidecar;
} capture_args;

static const weft_field capture_fields[] = {
    WEFT_DEVICE_FIELDS(capture_args, devices),
    {.key = "lights",
     .type = WEFT_FIELD_TEXT,
     .offset = offsetof(capture_args, lights),
     .unit = "LIST",
     .help = "which lights, one frame each: all, or numbers as 0,3,5 (default all)"},
    {.key = "exposure",
     .short_opt = 'e',
     .type = WEFT_FIELD_TEXT,
     .offset = offsetof(capture_args, exposure),
     .unit = "S|LIST",
     .help = "seconds; auto: the brightest thousandth of the brightest light at 70 % of the range; each: of "
             "each light; LIGHT:S: that light, as each,3:0.01 (default auto)"},
    {.key = "gain",
     .type = WEFT_FIELD_F64,
     .offset = offsetof(capture_args, gain),
     .unit = "FACTOR",
     .min = 1,
     .max = 1000,
     .help = "analogue gain, 1 = base (default: the camera's least)"},
    {.key = "bracket",
     .type = WEFT_FIELD_TEXT,
     .offset = offsetof(capture_args, bracket),
     .unit = "N|LIST",
     .help = "exposures of each light, a factor of 4 apart, around --exposure; auto: as many as it needs; "
             "LIGHT:N: of that light, as 1,3:5 (default 1)"},
    {.key = "average",
     .type = WEFT_FIELD_INT,
     .offset = offsetof(capture_args, average),
     .unit = "N",
     .min = 1,
     .max = WEFT_AVERAGE_MAX,
     .help = "each file is the mean of so many frames: less noise (default 1)"},
    {.key = "dry-run",
     .type = WEFT_FIELD_FLAG,
     .offset = offsetof(capture_args, dry_run),
     .help =
         "keep nothing: print what clips under each light, and the exposure that suits; SET may be left out"},
    {.key = "level",
     .type = WEFT_FIELD_INT,
     .offset = offsetof(capture_args, level),
     .unit = "STEPS",
     .min = 1,
     .max = 65535,
     .help = "brightness of the lights (default full)"},
    {.key = "settle",
     .type = WEFT_FIELD_F64,
     .offset = offsetof(capture_args, settle_s),
     .unit = "s",
     .min = 0.0001,
     .max = 10,
     .help = "wait between light on and trigger (default 0.005)"},
    {.key = "trigger",
     .type = WEFT_FIELD_TEXT,
     .offset = offsetof(capture_args, trigger),
     .unit = "HOW",
     .help =
         "software, or wire: the light controller's trigger line, with proof by the camera's exposure line "
         "where that is wired (default software)"},
    {.key = "ambient",
     .type = WEFT_FIELD_FLAG,
     .offset = offsetof(capture_args, ambient),
     .help = "a frame with all lights off (the default; with --only-all it must be asked for)"},
    {.key = "no-ambient",
     .type = WEFT_FIELD_FLAG,
     .offset = offsetof(capture_args, no_ambient),
     .help = "no such frame"},
    {.key = "dark",
     .type = WEFT_FIELD_FLAG,
     .offset = offsetof(capture_args, dark),
     .help = "also a frame with the lens capped, at the end; asks for it on a terminal"},
    {.key = "all-frame",
     .type = WEFT_FIELD_FLAG,
     .offset = offsetof(capture_args, all_frame),
     .help = "also a frame with all lights on"},
    {.key = "only-all",
     .type = WEFT_FIELD_FLAG,
     .offset = offsetof(capture_args, only_all),
     .help = "nothing but the frame with all lights on (a checkerboard for the lens)"},
    {.key = "resume",
     .type = WEFT_FIELD_FLAG,
     .offset = offsetof(capture_args, resume),
     .help = "go on with a set that was interrupted, with the settings it was begun with"},
    {.key = "name",
     .type = WEFT_FIELD_TEXT,
     .offset = offsetof(capture_args, name),
     .unit = "NAME",
     .help = "name of the sample (default: the folder's name without .set)"},
    {.key = "file-name",
     .type = WEFT_FIELD_TEXT,
     .offset = offsetof(capture_args, file_name),
     .unit = "TEMPLATE",
     .help = "names of the frames, of {set} {kind} {light} {bracket} {exposure} {index} {date} {time} "
             "(default " WEFT_FRAME_NAME_DEFAULT ")"},
    {.key = "sidecar",
     .type = WEFT_FIELD_FLAG,
     .offset = offsetof(capture_args, sidecar),
     .help = "also FILE.json beside each frame: what set.json and the raw file say of it"},
    {0},
};

/* "all", "0,3,5" to a mask; 0 for all */
static weft_err parse_lights(const char *text, uint32_t *mask, weft_error *err)
{
    *mask = 0;
    if (!text || strcmp(text, "all") == 0)
        return WEFT_OK;
    for (const char *p = text;; p++) {
        double number;
        p = weft_text_scan_double(p, &number);
        if (!p || number < 0 || number >= WEFT_CAPTURE_MAX_LIGHTS || number != (int)number ||
            (*p != ',' && *p != '\0'))
            return weft_fail(err, WEFT_ERR_USAGE, "--lights %s: wanted all, or numbers from 0 to %d as 0,3,5",
                             text, WEFT_CAPTURE_MAX_LIGHTS - 1);
        *mask |= UINT32_C(1) << (int)number;
        if (*p == '\0')
            return WEFT_OK;
    }
}

/* One item of a list as "each,3:0.01,7:0.1": a word or number for all lights, or LIGHT:NUMBER. */
typedef struct list_item {
    int light;        /* -1: for all */
    const char *text; /* the word or number */
    size_t n;
    double number; /* NAN: it is a word */
} list_item;

/* @return what follows the item, or NULL when it is none */
static const char *next_item(const char *text, list_item *item)
{
    double light;
    const char *p = weft_text_scan_double(text, &light);
    *item = (list_item){.light = -1, .text = text, .number = NAN};
    if (p && *p == ':') {
        if (light < 0 || light >= WEFT_CAPTURE_MAX_LIGHTS || light != (int)light)
            return NULL;
        item->light = (int)light;
        item->text = p + 1;
    }
    item->n = strcspn(item->text, ",");
    p = weft_text_scan_double(item->text, &item->number);
    if (!p || p != item->text + item->n)
        item->number = NAN;
    return item->n > 0 && (item->text[item->n] == '\0' || item->text[item->n + 1])
               ? item->text + item->n + (item->text[item->n] == ',')
               : NULL;
}

static bool is_word(const list_item *item, const char *word)
{
    return item->light < 0 && item->n == strlen(word) && memcmp(item->text, word, item->n) == 0;
}

static weft_err parse_exposures(const char *text, weft_capture_options *o, weft_error *err)
{
    bool has_common = false;
    list_item item;
    for (const char *p = text; p && *p;) {
        p = next_item(p, &item);
        const bool in_range = item.number >= 1e-6 && item.number <= 600;
        double *const exposure_s = item.light >= 0 ? &o->exposures_s[item.light] : &o->exposure_s;
        if (!p || (item.light < 0 ? has_common : *exposure_s > 0) ||
            !(in_range || is_word(&item, "auto") || is_word(&item, "each")))
            return weft_fail(err, WEFT_ERR_USAGE,
                             "--exposure %s: wanted auto, each or 0.000001 to 600 s, and LIGHT:S for lights "
                             "that differ, each once, as 0.04,3:0.01",
                             text);
        has_common |= item.light < 0;
        o->each |= is_word(&item, "each");
        if (in_range)
            *exposure_s = item.number;
    }
    return WEFT_OK;
}

static weft_err parse_brackets(const char *text, weft_capture_options *o, weft_error *err)
{
    list_item item;
    for (const char *p = text; p && *p;) {
        p = next_item(p, &item);
        const bool in_range =
            item.number >= 1 && item.number <= WEFT_CAPTURE_MAX_BRACKET && item.number == (int)item.number;
        int *const n = item.light >= 0 ? &o->brackets[item.light] : &o->bracket;
        if (!p || *n || !(in_range || is_word(&item, "auto")))
            return weft_fail(err, WEFT_ERR_USAGE,
                             "--bracket %s: wanted auto or 1 to %d, and LIGHT:N for lights that differ, each "
                             "once, as 1,3:5",
                             text, WEFT_CAPTURE_MAX_BRACKET);
        *n = in_range ? (int)item.number : WEFT_CAPTURE_BRACKET_AUTO;
    }
    return WEFT_OK;
}

/* A light that has its own exposure but no frame is a slip. */
static weft_err check_lights_have_frames(const weft_capture_options *o, weft_error *err)
{
    for (int i = 0; i < WEFT_CAPTURE_MAX_LIGHTS && o->lights; i++)
        if (!(o->lights >> i & 1) && (o->exposures_s[i] > 0 || o->brackets[i] > 0))
            return weft_fail(err, WEFT_ERR_USAGE, "light %d has its own %s but is not in --lights", i,
                             o->exposures_s[i] > 0 ? "--exposure" : "--bracket");
    return WEFT_OK;
}

static weft_err make_options(const weft_invocation *inv, const capture_args *a, weft_capture_options *o,
                             weft_error *err)
{
    *o = (weft_capture_options){
        .folder = inv->n_operands > 0 ? inv->operands[0] : NULL,
        .name = a->name,
        .no_lights = a->only_all,
        .gain = a->gain,
        .average = a->average,
        .level = a->level,
        .no_ambient = a->no_ambient || (a->only_all && !a->ambient),
        .all = a->all_frame || a->only_all,
        .dark = a->dark,
        .settle_s = a->settle_s,
        .file_name = a->file_name,
        .sidecar = a->sidecar,
        .resume = a->resume,
        .force = inv->force,
    };
    if (a->trigger && strcmp(a->trigger, "wire") == 0)
        o->trigger = WEFT_TRIGGER_WIRE;
    else if (a->trigger && strcmp(a->trigger, "software") != 0)
        return weft_fail(err, WEFT_ERR_USAGE, "--trigger %s: wanted software or wire", a->trigger);
    if (inv->n_operands == 0 && !a->dry_run)
        return weft_fail(err, WEFT_ERR_USAGE, "SET is missing");
    if (a->ambient && a->no_ambient)
        return weft_fail(err, WEFT_ERR_USAGE, "--ambient and --no-ambient exclude each other");
    if (a->only_all && (a->lights || a->bracket))
        return weft_fail(err, WEFT_ERR_USAGE,
                         "--only-all takes no single lights: leave out --lights and --bracket");
    if (a->resume && inv->force)
        return weft_fail(err, WEFT_ERR_USAGE,
                         "--resume keeps what is there and --force replaces it: give one");
    if (a->file_name)
        WEFT_TRY(weft_frame_name_check(a->file_name, err));
    WEFT_TRY(parse_lights(a->lights, &o->lights, err));
    WEFT_TRY(parse_exposures(a->exposure, o, err));
    WEFT_TRY(parse_brackets(a->bracket, o, err));
    return check_lights_have_frames(o, err);
}

/* Asks for the lens cap while the controller's lease is kept alive. */
static weft_err cap_lens(void *controller, weft_error *err)
{
    if (!isatty(STDIN_FILENO)) {
        weft_note("dark frame: taken as the camera is now; cap the lens before, or take it from a terminal");
        return WEFT_OK;
    }
    weft_note("\ncap the lens, then press Enter");
    for (;;) {
        struct pollfd input = {.fd = STDIN_FILENO, .events = POLLIN};
        char line[256];
        if (weft_cancelled())
            return weft_fail(err, WEFT_ERR_CANCELLED, "cancelled before the dark frame");
        if (poll(&input, 1, WEFT_DEVICE_LEASE_MS / 4) > 0)
            return read(STDIN_FILENO, line, sizeof line) >= 0
                       ? WEFT_OK
                       : weft_fail_errno(err, WEFT_ERR_IO, "the terminal cannot be read");
        WEFT_TRY(weft_controller_keep_alive(controller, err));
    }
}

static weft_err print_result(const weft_invocation *inv, const weft_set *set, const weft_capture_report *r,
                             weft_error *err)
{
    char exposures[64];
    if (inv->json)
        return weft_print_json(inv,
                               json_pack("{s:s, s:s, s:i, s:i, s:i, s:i, s:i, s:f, s:f, s:f, s:f}", "set",
                                         set->folder, "name", set->name, "frames", r->n_frames, "taken",
                                         r->n_taken, "kept", r->n_kept, "retries", r->n_retries, "warnings",
                                         r->n_warnings, "exposure_s", r->exposure_s, "shortest_s",
                                         r->shortest_s, "gain", r->gain, "seconds", r->seconds),
                               err);
    if (r->shortest_s < r->exposure_s)
        snprintf(exposures, sizeof exposures, "exposures %.4g to %.4g s", r->shortest_s, r->exposure_s);
    else
        snprintf(exposures, sizeof exposures, "exposure %.4g s", r->exposure_s);
    fprintf(inv->out, "%s: %d frames (%d taken, %d kept, %d repeated), %s, gain %.3g, in %.1f s\n",
            set->folder, r->n_frames, r->n_taken, r->n_kept, r->n_retries, exposures, r->gain, r->seconds);
    return WEFT_OK;
}

/* ---- a dry run ---- */

static json_t *numbers(const weft_frame_stats *s, double (*get)(const weft_colour_stats *c))
{
    return json_pack("[f, f, f]", get(&s->colours[0]), get(&s->colours[1]), get(&s->colours[2]));
}

static double high_of(const weft_colour_stats *c)
{
    return c->high;
}

static double clipped_of(const weft_colour_stats *c)
{
    return c->clipped;
}

static json_t *look_to_json(const weft_capture_look *look)
{
    json_t *const lights = json_array();
    for (int i = 0; i < look->n; i++) {
        const weft_light_look *const l = &look->lights[i];
        json_array_append_new(lights,
                              json_pack("{s:i, s:o, s:o, s:f, s:f, s:i, s:s}", "light", l->light, "high",
                                        numbers(&l->stats, high_of), "clipped",
                                        numbers(&l->stats, clipped_of), "mean", l->stats.mean, "suggested_s",
                                        l->suggested_s, "bracket", l->bracket, "problem", l->reason));
    }
    return json_pack("{s:f, s:f, s:f, s:f, s:i, s:i, s:o}", "exposure_s", look->exposure_s, "gain",
                     look->gain, "suggested_s", look->suggested_s, "longest_s", look->longest_s, "bracket",
                     look->bracket, "clipped_lights", look->n_clipped, "lights", lights);
}

/* Longest over shortest exposure of the lights, from which on it is worth to give each its own. */
#define LIGHTS_DIFFER 1.5

static void print_look(const weft_capture_look *look, FILE *out)
{
    fprintf(out, "at %.4g s, gain %.3g       brightest thousandth, %%    clipped, %%\n", look->exposure_s,
            look->gain);
    fprintf(out, "%-10s %8s   %6s %6s %6s    %6s %6s %6s   suits      bracket\n", "light", "mean, %", "red",
            "green", "blue", "red", "green", "blue");
    for (int i = 0; i < look->n; i++) {
        const weft_light_look *const l = &look->lights[i];
        const weft_colour_stats *const c = l->stats.colours;
        char name[16], suits[32] = "";
        snprintf(name, sizeof name, "%d", l->light);
        if (l->suggested_s > 0)
            snprintf(suits, sizeof suits, "%-10.3g %d", l->suggested_s, l->bracket);
        else if (l->light >= 0 && !l->reason[0])
            snprintf(suits, sizeof suits, "%s",
                     weft_frame_stats_high(&l->stats) > 0.5 ? "shorter" : "longer");
        if (l->reason[0])
            fprintf(out, "%-10s %s\n", l->light < 0 ? "all off" : name, l->reason);
        else
            fprintf(out, "%-10s %8.2f   %6.1f %6.1f %6.1f    %6.3f %6.3f %6.3f   %s\n",
                    l->light < 0 ? "all off" : name, 100 * l->stats.mean, 100 * c[0].high, 100 * c[1].high,
                    100 * c[2].high, 100 * c[0].clipped, 100 * c[1].clipped, 100 * c[2].clipped, suits);
    }
    if (look->suggested_s <= 0)
        return;
    fprintf(out, "suggestion: --exposure %.2g%s%s\n", look->suggested_s,
            look->bracket > 1 ? " --bracket auto" : "",
            look->bracket > 1 ? " (highlights or shadows need it)" : "");
    if (look->longest_s > LIGHTS_DIFFER * look->suggested_s)
        fprintf(out, "        or: --exposure each%s, from %.2g to %.2g s: the lights differ much\n",
                look->bracket > 1 ? " --bracket auto" : "", look->suggested_s, look->longest_s);
}

static weft_err dry_run(const weft_invocation *inv, const weft_capture_options *options,
                        const weft_device_options *devices, weft_error *err)
{
    weft_camera_device *camera = NULL;
    weft_controller *controller = NULL;
    weft_progress progress = {0};
    weft_capture_look look;
    WEFT_TRY(weft_device_open_both(devices, &camera, &controller, err));
    const weft_err status = weft_capture_look_at(options, camera, controller, &progress, &look, err);
    weft_controller_close(controller);
    weft_camera_close(camera);
    WEFT_TRY(status);
    if (inv->json)
        return weft_print_json(inv, look_to_json(&look), err);
    print_look(&look, inv->out);
    return WEFT_OK;
}

static weft_err run_capture(const weft_invocation *inv, const void *args, weft_error *err)
{
    const capture_args *const a = args;
    weft_capture_options options;
    weft_camera_device *camera = NULL;
    weft_controller *controller = NULL;
    weft_progress progress = {0};
    weft_capture_report report = {0};
    weft_set set = {0};
    WEFT_TRY(make_options(inv, a, &options, err));
    if (a->dry_run)
        return dry_run(inv, &options, &a->devices, err);
    WEFT_TRY(weft_capture_check_folder(&options, err));
    WEFT_TRY(weft_device_open_both(&a->devices, &camera, &controller, err));
    options.cap_lens = cap_lens;
    options.context = controller;
    weft_err status = weft_capture_run(&options, camera, controller, &progress, &set, &report, err);
    weft_controller_close(controller);
    weft_camera_close(camera);
    if (status == WEFT_OK)
        status = print_result(inv, &set, &report, err);
    weft_set_fini(&set);
    return status;
}

const weft_command weft_cmd_capture = {
    .name = "capture",
    .summary = "photograph a sample under every light",
    .operands = "SET",
    .min_operands = 0,
    .max_operands = 1,
    .args_size = sizeof(capture_args),
    .fields = capture_fields,
    .details =
        "Takes a frame with all lights off, then one with each light alone, looks at each (is it whole, is\n"
        "the light on, does it clip), takes it again when it is not good, and writes it as a DNG into the\n"
        "folder SET beside set.json (docs/formats.md).  Ctrl-C switches the lights off and keeps what was\n"
        "taken; --resume goes on with it.",
    .example = "weft capture twill.set --exposure 0.04",
    .run = run_capture,
};
