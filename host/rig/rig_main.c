/*
 * weft-rig: the virtual scanner.  The firmware's ELF on libsimavr with its serial line on a pty, and a GigE
 * Vision camera on an address of this machine that sees the lit sample.
 *
 * This program links libsimavr, which is under the GNU General Public License, version 3: the whole program
 * weft-rig is therefore distributed under GPL-3.0.  Its sources that are Weft's own stay under Weft's
 * licence, and `weft` itself links none of it.
 */
#include "core/file.h"
#include "core/json.h"
#include "core/log.h"
#include "core/mem.h"
#include "core/progress.h"
#include "core/shipped.h"
#include "core/text.h"
#include "core/version.h"
#include "host/rig/dslr.h"
#include "host/rig/render_set.h"
#include "host/rig/rig_board.h"
#include "host/rig/rig_camera.h"
#include "host/rig/rig_control.h"
#include "host/rig/rig_options.h"

#include <errno.h>
#include <limits.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#define RIG_VERSION 1

typedef struct rig_args {
    weft_rig_options options;
    const char *render;
    weft_numbers exposures;
    bool quiet, verbose, help, json, force;
} rig_args;

static const weft_field fields[] = {
    WEFT_RIG_OPTION_FIELDS(rig_args, options),
    {.key = "render",
     .type = WEFT_FIELD_TEXT,
     .offset = offsetof(rig_args, render),
     .unit = "DIR",
     .help = "no scanner: writes a captured set of each --sample (A,B,...) and truth.cal into DIR"},
    {.key = "exposure",
     .type = WEFT_FIELD_F64S,
     .offset = offsetof(rig_args, exposures),
     .unit = "S,S,...",
     .help = "of --render: seconds, each frame once with each (default: 75 % of the range)"},
    {.key = "force",
     .type = WEFT_FIELD_FLAG,
     .offset = offsetof(rig_args, force),
     .help = "of --render: replaces sets that are there"},
    {.key = "quiet",
     .short_opt = 'q',
     .type = WEFT_FIELD_FLAG,
     .offset = offsetof(rig_args, quiet),
     .help = "no notes"},
    {.key = "verbose",
     .short_opt = 'v',
     .type = WEFT_FIELD_FLAG,
     .offset = offsetof(rig_args, verbose),
     .help = "explains what is done"},
    {.key = "json",
     .type = WEFT_FIELD_FLAG,
     .offset = offsetof(rig_args, json),
     .help = "always so: one JSON line when ready"},
    {.key = "help",
     .short_opt = 'h',
     .type = WEFT_FIELD_FLAG,
     .offset = offsetof(rig_args, help),
     .help = "prints this"},
    {0},
};

/** All of a running rig. */
typedef struct rig {
    const rig_args *args;
    char *firmware, *json_path, *socket_path;
    weft_rig_stage *stage;
    weft_controller_sim *sim;
    weft_rig_board board;
    weft_rig_camera *camera;
    weft_dslr *dslr;
    weft_rig_control *control;
} rig;

/* rig.json, and at the start the same on stdout. */
static weft_err announce(const rig *r, bool print, weft_error *err)
{
    char camera[80], dslr[112];
    const weft_rig_scene *const scene = weft_rig_stage_scene(r->stage);
    snprintf(camera, sizeof camera, "aravis:%s", r->args->options.address);
    snprintf(dslr, sizeof dslr, "gphoto:ptpip:%s:%d", r->args->options.address, weft_dslr_port(r->dslr));
    json_t *const json = json_pack(
        "{s:s, s:i, s:s, s:s, s:[s,s], s:s, s:i, s:[i,i], s:I, s:s, s:s}", "weft", "rig", "version",
        RIG_VERSION, "pty", r->board.pty, "camera", camera, "cameras", camera, dslr, "control",
        r->socket_path, "pid", (int)getpid(), "size", scene->camera.width, scene->camera.height, "seed",
        (json_int_t)scene->setup.seed, "firmware", r->firmware, "program", "weft-rig " WEFT_VERSION);
    if (!json)
        return weft_fail(err, WEFT_ERR_NOMEM, "out of memory");
    const weft_err status = weft_json_save(r->json_path, json, err);
    if (status == WEFT_OK && print) {
        json_dumpf(json, stdout, JSON_COMPACT);
        putchar('\n');
        fflush(stdout);
    }
    json_decref(json);
    return status;
}

/* ------------------------------------------------------------------------------------------ commands */

static json_t *reply_error(const weft_error *error)
{
    return json_pack("{s:b, s:s}", "ok", 0, "error", error->text);
}

static json_t *obey_sample(rig *r, const char *name)
{
    weft_error error = {0};
    const double start_s = weft_clock_s();
    if (weft_rig_stage_set_sample(r->stage, name, &error) != WEFT_OK)
        return reply_error(&error);
    const double seconds = weft_clock_s() - start_s;
    weft_note("sample %s, ready after %.2f s", name, seconds);
    return json_pack("{s:b, s:s, s:f}", "ok", 1, "sample", name, "seconds", seconds);
}

static json_t *obey_samples(void)
{
    char name[32], summary[128];
    json_t *const list = json_array();
    for (int i = 0; weft_rig_sample_describe(i, name, summary); i++)
        json_array_append_new(list, json_pack("{s:s, s:s}", "name", name, "summary", summary));
    return json_pack("{s:b, s:o}", "ok", 1, "samples", list);
}

static json_t *list_lamps(uint32_t mask)
{
    json_t *const list = json_array();
    for (int i = 0; i < WEFT_SIM_N_LIGHTS; i++)
        if (mask & UINT32_C(1) << i)
            json_array_append_new(list, json_integer(i));
    return list;
}

static json_t *obey_state(const rig *r)
{
    weft_controller_sim_counters counters;
    double dark_for_s = 0;
    weft_controller_sim_get_counters(r->sim, &counters);
    const uint32_t lit = weft_controller_sim_lights(r->sim, &dark_for_s);
    return json_pack("{s:b, s:s, s:o, s:o, s:f, s:I, s:i, s:i, s:f}", "ok", 1, "sample",
                     weft_rig_stage_sample(r->stage)->name, "lights_on", list_lamps(lit), "lights_driven",
                     list_lamps(weft_controller_sim_driven(r->sim)), "dark_for_s", dark_for_s, "frames",
                     (json_int_t)weft_rig_stage_frames(r->stage), "resets", (int)counters.resets, "overruns",
                     (int)counters.overruns, "simulated_s", counters.simulated_s);
}

/* "truth DIR [MM_PER_PX]": the last word is a number or part of the folder's name. */
static json_t *obey_truth(const rig *r, const char *words)
{
    weft_error error = {0};
    char folder[PATH_MAX];
    double mm_per_px = 0.125;
    if (snprintf(folder, sizeof folder, "%s", words) >= (int)sizeof folder || !folder[0])
        return json_pack("{s:b, s:s}", "ok", 0, "error", "truth wants a folder: truth DIR [MM_PER_PX]");
    char *const last = strrchr(folder, ' ');
    if (last && weft_text_to_double(last + 1, &mm_per_px)) {
        *last = '\0';
        if (!(mm_per_px >= 0.005 && mm_per_px <= 10))
            return json_pack("{s:b, s:s}", "ok", 0, "error", "truth: MM_PER_PX must be 0.005 to 10");
    }
    if (weft_rig_truth_write(r->stage, folder, mm_per_px, &error) != WEFT_OK)
        return reply_error(&error);
    return json_pack("{s:b, s:s, s:s, s:f}", "ok", 1, "truth", folder, "sample",
                     weft_rig_stage_sample(r->stage)->name, "mm_per_px", mm_per_px);
}

static json_t *obey_board(rig *r, const char *words)
{
    weft_error error = {0};
    bool moved = false;
    json_t *const reply = weft_rig_board_obey(&r->board, words, &moved);
    if (!moved || announce(r, false, &error) == WEFT_OK)
        return reply;
    json_decref(reply);
    return reply_error(&error);
}

static json_t *obey_camera(const rig *r, const char *words)
{
    weft_error error = {0};
    if (weft_rig_camera_fail(r->camera, words, &error) != WEFT_OK)
        return reply_error(&error);
    return json_pack("{s:b}", "ok", 1);
}

/* "frame FILE EXPOSURE_S": what a camera at the GigE camera's place sees from now on, under the lamps that
 * are on: 16 bits a photosite in the order of memory, nothing else, written over the file. */
static json_t *obey_frame(const rig *r, const char *words)
{
    const weft_camera *const camera = &weft_rig_stage_scene(r->stage)->camera;
    const size_t n = (size_t)camera->width * (size_t)camera->height;
    const char *const space = strrchr(words, ' ');
    double exposure_s = 0, on[WEFT_RIG_N_LIGHTS] = {0};
    char path[PATH_MAX];
    weft_error error = {0};
    if (!space || space == words || !weft_text_to_double(space + 1, &exposure_s) ||
        !(exposure_s >= 1e-5 && exposure_s <= 10))
        return json_pack("{s:b, s:s}", "ok", 0, "error", "wanted: frame FILE EXPOSURE_S, 0.00001 to 10 s");
    snprintf(path, sizeof path, "%.*s", (int)(space - words), words);
    uint16_t *const dn = weft_alloc(n, sizeof *dn, &error);
    if (!dn)
        return reply_error(&error);
    if (!weft_controller_sim_expose(r->sim, (uint32_t)(1e6 * exposure_s), on))
        memset(on, 0, sizeof on);
    weft_rig_stage_expose(r->stage, on, exposure_s, 1, dn);
    FILE *const file = fopen(path, "wb");
    const bool written = file && fwrite(dn, sizeof *dn, n, file) == n;
    if (!file || fclose(file) != 0 || !written)
        weft_fail_errno(&error, WEFT_ERR_IO, "%s: cannot be written", path);
    weft_free(dn);
    if (error.code != WEFT_OK)
        return reply_error(&error);
    return json_pack("{s:b, s:i, s:i}", "ok", 1, "width", camera->width, "height", camera->height);
}

static json_t *obey(void *context, const char *line, bool *quit)
{
    rig *const r = context;
    const size_t word = strcspn(line, " ");
    const char *const rest = line + word + strspn(line + word, " ");
    const struct {
        const char *name;
        bool wants_more;
    } commands[] = {{"sample", true}, {"truth", true}, {"samples", false}, {"state", false}, {"reset", false},
                    {"quit", false},  {"dslr", true},  {"board", true},    {"camera", true}, {"frame", true}};
    int which = -1;
    for (int i = 0; i < (int)(sizeof commands / sizeof commands[0]); i++)
        if (strlen(commands[i].name) == word && strncmp(line, commands[i].name, word) == 0)
            which = i;
    if (which < 0 || commands[which].wants_more != (rest[0] != '\0'))
        return json_pack("{s:b, s:s}", "ok", 0, "error",
                         "wanted: sample NAME, samples, state, truth DIR [MM_PER_PX], dslr WORDS, board "
                         "WORDS, camera FAULT, frame FILE EXPOSURE_S, reset or quit");
    switch (which) {
    case 0:
        return obey_sample(r, rest);
    case 1:
        return obey_truth(r, rest);
    case 2:
        return obey_samples();
    case 3:
        return obey_state(r);
    case 4:
        weft_controller_sim_reset(r->sim);
        return json_pack("{s:b}", "ok", 1);
    case 6:
        return weft_dslr_obey(r->dslr, rest);
    case 7:
        return obey_board(r, rest);
    case 8:
        return obey_camera(r, rest);
    case 9:
        return obey_frame(r, rest);
    default:
        *quit = true;
        return json_pack("{s:b}", "ok", 1);
    }
}

static bool alive(void *context)
{
    const rig *const r = context;
    weft_controller_sim_counters counters;
    weft_controller_sim_get_counters(r->sim, &counters);
    return counters.running;
}

/* ------------------------------------------------------------------------------------------ start and end */

/* The one that was asked for, or that of this build. */
static weft_err find_firmware(rig *r, weft_error *err)
{
    static const char *const places[] = {"../firmware", "../share/weft", NULL};
    const char *const given = r->args->options.firmware;
    char built[PATH_MAX];
    if (!given && weft_shipped_find("weft-firmware.elf", places, built, err) != WEFT_OK)
        return weft_prefix(err, WEFT_ERR_MISSING,
                           "no firmware there; build it (./dev build) or give --firmware ELF");
    if (given && strcmp(given, "none") != 0 && !weft_file_exists(given))
        return weft_fail(err, WEFT_ERR_MISSING, "%s: no firmware there; give the name of an ELF file", given);
    r->firmware = weft_strdup(given ? given : built, err);
    return r->firmware ? WEFT_OK : WEFT_ERR_NOMEM;
}

static weft_err read_setup(const weft_rig_options *options, weft_rig_setup *setup, weft_error *err)
{
    weft_rig_setup_init(setup);
    if (options->scene)
        WEFT_TRY(weft_rig_setup_load(options->scene, setup, err));
    const weft_size size = options->size;
    if (size.width % 2 || size.height % 2 || size.width < 64 || size.height < 64 ||
        size.width > WEFT_RIG_MAX_WIDTH || size.height > WEFT_RIG_MAX_HEIGHT)
        return weft_fail(err, WEFT_ERR_USAGE, "--size: wanted even numbers from 64x64 to %dx%d, not %dx%d",
                         WEFT_RIG_MAX_WIDTH, WEFT_RIG_MAX_HEIGHT, size.width, size.height);
    setup->size = size;
    if (options->seed)
        setup->seed = (uint64_t)options->seed;
    if (options->supersample && options->supersample < 3)
        return weft_fail(err, WEFT_ERR_USAGE, "--supersample: wanted 3 to 9, not %d", options->supersample);
    if (options->supersample)
        setup->supersample = options->supersample;
    return WEFT_OK;
}

static weft_err render(const rig_args *args, weft_error *err)
{
    weft_rig_setup setup;
    const weft_rig_render_plan plan = {args->render, args->options.sample, args->exposures, args->force};
    for (int i = 0; i < plan.exposures.n; i++)
        if (!(plan.exposures.values[i] >= 1e-6 && plan.exposures.values[i] <= 60))
            return weft_fail(err, WEFT_ERR_USAGE, "--exposure %g: wanted 1e-6 to 60 s",
                             plan.exposures.values[i]);
    WEFT_TRY(read_setup(&args->options, &setup, err));
    return weft_rig_render_sets(&setup, &plan, err);
}

static weft_err make_paths(rig *r, weft_error *err)
{
    char *absolute = NULL;
    WEFT_TRY(weft_folder_create(r->args->options.dir, err));
    absolute = realpath(r->args->options.dir, NULL);
    if (!absolute)
        return weft_fail_errno(err, WEFT_ERR_IO, "%s: not a folder that can be used", r->args->options.dir);
    r->json_path = weft_path_join(absolute, "rig.json", err);
    r->socket_path = weft_path_join(absolute, "control.sock", err);
    free(absolute);
    return r->json_path && r->socket_path ? WEFT_OK : WEFT_ERR_NOMEM;
}

static weft_err start(rig *r, weft_error *err)
{
    const weft_rig_options *const options = &r->args->options;
    weft_rig_setup setup;
    WEFT_TRY(read_setup(options, &setup, err));
    WEFT_TRY(find_firmware(r, err));
    WEFT_TRY(make_paths(r, err));
    WEFT_TRY(weft_rig_control_create(r->socket_path, &r->control, err));
    (void)remove(r->json_path); /* of one that was killed: whoever waits for it waits for ours */
    weft_explain("rendering %s at %d x %d", options->sample, setup.size.width, setup.size.height);
    WEFT_TRY(weft_rig_stage_create(&setup, options->sample, &r->stage, err));
    const weft_controller_sim_program program = {
        .firmware = strcmp(r->firmware, "none") == 0 ? NULL : r->firmware,
        .bootloader = options->bootloader,
    };
    WEFT_TRY(weft_controller_sim_create_with(&program, &r->sim, r->board.pty, err));
    WEFT_TRY(weft_rig_camera_create(options->address, options->dir, r->stage, r->sim, &r->camera, err));
    WEFT_TRY(weft_dslr_create(options->address, r->stage, r->sim, &r->dslr, err));
    WEFT_TRY(weft_rig_board_begin(&r->board, r->sim, options->dir, err));
    return announce(r, true, err);
}

static void end(rig *r)
{
    if (r->control && r->json_path)
        (void)remove(r->json_path);
    weft_rig_board_end(&r->board);
    weft_dslr_destroy(r->dslr);
    weft_rig_camera_destroy(r->camera);
    weft_controller_sim_destroy(r->sim);
    weft_rig_stage_destroy(r->stage);
    weft_rig_control_destroy(r->control);
    weft_free(r->socket_path);
    weft_free(r->json_path);
    weft_free(r->firmware);
}

static weft_err parse(int argc, char **argv, rig_args *args, weft_error *err)
{
    const weft_field *const tables[] = {fields};
    void *const structs[] = {args};
    int n_operands = 0;
    const char **const operands = weft_alloc((size_t)argc + 1, sizeof *operands, err);
    if (!operands)
        return WEFT_ERR_NOMEM;
    weft_fields_set_defaults(fields, args);
    weft_err status =
        weft_fields_parse_argv(tables, structs, 1, argc - 1, argv + 1, operands, &n_operands, err);
    if (status == WEFT_OK && n_operands > 0)
        status = weft_fail(err, WEFT_ERR_USAGE, "\"%s\" is no option", operands[0]);
    weft_free(operands);
    return status;
}

int main(int argc, char **argv)
{
    weft_error error = {0};
    rig_args args = {0};
    rig r = {.args = &args};
    weft_err status = parse(argc, argv, &args, &error);
    if (status == WEFT_OK && args.help) {
        puts("weft-rig: the virtual scanner (\"weft rig\" starts it)\n\noptions:");
        weft_fields_print_help(fields, stdout);
        return 0;
    }
    weft_log_set_level(args.quiet ? WEFT_LOG_QUIET : args.verbose ? WEFT_LOG_VERBOSE : WEFT_LOG_NORMAL);
    weft_cancel_on_signals();
    (void)signal(SIGPIPE, SIG_IGN);
    if (status == WEFT_OK && !args.render)
        status = start(&r, &error);
    if (status == WEFT_OK && args.render)
        status = render(&args, &error);
    else if (status == WEFT_OK)
        status = weft_rig_control_run(r.control, obey, alive, &r, &error);
    end(&r);
    if (status != WEFT_OK)
        weft_log_error("rig: %s", error.text[0] ? error.text : weft_err_text(status));
    return weft_err_exit_status(status);
}
