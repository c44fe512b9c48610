/*
 * weft rig: starts the virtual scanner, or tells a running one what to do.
 *
 * The scanner is the program weft-rig beside this one: it links libsimavr (GPL-3.0), which weft does not.
 */
#include "core/file.h"
#include "core/log.h"
#include "core/mem.h"
#include "core/shipped.h"
#include "host/cli/command.h"
#include "host/cli/rig_start.h"
#include "host/rig/rig_control.h"
#include "host/rig/rig_options.h"

#include <errno.h>
#include <limits.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

/* Rendering a large fabric at the largest size takes a minute on a slow machine. */
#define TELL_TIMEOUT_S 300

typedef struct rig_args {
    weft_rig_options rig;
    const char *tell;
} rig_args;

static const weft_field fields[] = {
    WEFT_RIG_OPTION_FIELDS(rig_args, rig),
    {.key = "tell",
     .type = WEFT_FIELD_TEXT,
     .offset = offsetof(rig_args, tell),
     .unit = "COMMAND",
     .help = "sends a command to the rig that runs in DIR and prints its reply"},
    {0},
};

/* "truth out" means a folder of the one who asks, not of the rig. */
static weft_err make_line(const char *tell, char line[2 * PATH_MAX], weft_error *err)
{
    static const char truth[] = "truth ";
    char folder[PATH_MAX];
    const char *const rest = tell + strlen(truth);
    int n;
    if (strncmp(tell, truth, strlen(truth)) == 0 && rest[0] != '/' && rest[0] != '\0') {
        if (!getcwd(folder, sizeof folder))
            return weft_fail_errno(err, WEFT_ERR_IO, "the current folder has no name; give an absolute one");
        n = snprintf(line, (size_t)2 * PATH_MAX, "%s%s/%s", truth, folder, rest);
    } else {
        n = snprintf(line, (size_t)2 * PATH_MAX, "%s", tell);
    }
    return n < 2 * PATH_MAX ? WEFT_OK : weft_fail(err, WEFT_ERR_USAGE, "--tell: the command is too long");
}

static weft_err tell(const weft_invocation *inv, const rig_args *args, weft_error *err)
{
    char line[2 * PATH_MAX];
    json_t *reply = NULL;
    WEFT_TRY(make_line(args->tell, line, err));
    WEFT_TRY(weft_rig_start_wait(args->rig.dir, err));
    char *const socket = weft_path_join(args->rig.dir, "control.sock", err);
    if (!socket)
        return WEFT_ERR_NOMEM;
    weft_err status = weft_rig_control_tell(socket, line, TELL_TIMEOUT_S, &reply, err);
    weft_free(socket);
    if (status != WEFT_OK)
        return status;
    if (!json_is_true(json_object_get(reply, "ok"))) {
        const char *const reason = json_string_value(json_object_get(reply, "error"));
        status = weft_fail(err, WEFT_ERR_DEVICE, "%s", reason ? reason : "the rig gives no reason");
        json_decref(reply);
        return status;
    }
    return weft_print_json(inv, reply, err);
}

/* Becomes weft-rig; returns only when that fails. */
static weft_err become_rig(const weft_rig_options *o, weft_error *err)
{
    static const char *const places[] = {".", NULL};
    char program[PATH_MAX], size[32], seed[16], supersample[16];
    if (weft_shipped_find("weft-rig", places, program, err) != WEFT_OK)
        return weft_prefix(err, WEFT_ERR_MISSING, "the virtual scanner is not installed beside this program");
    snprintf(size, sizeof size, "%dx%d", o->size.width, o->size.height);
    snprintf(seed, sizeof seed, "%d", o->seed);
    snprintf(supersample, sizeof supersample, "%d", o->supersample);
    const char *words[32] = {program,     "--dir",         o->dir,     "--sample", o->sample,
                             "--address", o->address,      "--size",   size,       "--seed",
                             seed,        "--supersample", supersample};
    int k = 13;
    if (o->scene) {
        words[k++] = "--scene";
        words[k++] = o->scene;
    }
    if (o->firmware) {
        words[k++] = "--firmware";
        words[k++] = o->firmware;
    }
    if (o->bootloader) {
        words[k++] = "--bootloader";
        words[k++] = o->bootloader;
    }
    if (weft_log_get_level() != WEFT_LOG_NORMAL)
        words[k++] = weft_log_get_level() == WEFT_LOG_QUIET ? "--quiet" : "--verbose";
    words[k] = NULL;
    execv(program, (char *const *)(void *)words);
    return weft_fail_errno(err, WEFT_ERR_MISSING, "%s: the virtual scanner cannot be started", program);
}

static weft_err run(const weft_invocation *inv, const void *args, weft_error *err)
{
    const rig_args *const a = args;
    return a->tell ? tell(inv, a, err) : become_rig(&a->rig, err);
}

const weft_command weft_cmd_rig = {
    .name = "rig",
    .summary = "run the virtual scanner: firmware, lamps, camera and cloth without hardware",
    .operands = "",
    .args_size = sizeof(rig_args),
    .fields = fields,
    .details =
        "Prints one JSON line when it is ready (also DIR/rig.json) and runs until Ctrl-C, SIGTERM or\n"
        "--tell quit.  Hardware commands use it with --rig DIR.  Commands for --tell: sample NAME,\n"
        "samples, state, truth DIR [MM_PER_PX], reset, quit.  docs/virtual-scanner.md says what it models.",
    .example = "weft rig --dir r --sample twill &  # when it is ready: weft capture twill.set --rig r",
    .run = run,
};
