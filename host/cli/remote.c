#include "host/cli/remote.h"

#include "core/file.h"
#include "core/log.h"
#include "core/mem.h"
#include "core/progress.h"
#include "host/client/daemon_client.h"
#include "host/client/job_kinds.h"

#include <inttypes.h>
#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

/* A daemon that is started again takes a moment; its jobs go on. */
#define COME_BACK_S 20.0
#define PATIENCE_S  1.0 /* until it is said what is waited for */

weft_err weft_remote_wanted(const weft_command *command, char socket[108], bool *wanted, weft_error *err)
{
    const weft_job_kind *const kind = weft_job_kind_find(command->name);
    *wanted = false;
    return kind && kind->hardware ? weft_daemon_find(socket, wanted, err) : WEFT_OK;
}

/* ---- the request ---- */

typedef struct request {
    const weft_job_kind *kind;
    json_t *operands, *options;
} request;

/* The daemon has another working folder. */
static char *absolute(const char *path, weft_error *err)
{
    char here[PATH_MAX];
    if (path[0] == '/')
        return weft_strdup(path, err);
    if (!getcwd(here, sizeof here)) {
        weft_fail_errno(err, WEFT_ERR_IO, "the current folder has no name; give absolute ones");
        return NULL;
    }
    return weft_path_join(here, path, err);
}

/* "a/../b" is refused by the daemon for good reasons, and a user may type it. */
static char *tidy(char *path, weft_error *err)
{
    char real[PATH_MAX];
    if (!path || !strstr(path, ".."))
        return path;
    char *const folder = weft_path_folder(path, err);
    const char *const name = weft_path_name(path);
    char *tidied = NULL;
    if (realpath(path, real))
        tidied = weft_strdup(real, err);
    else if (folder && strcmp(name, "..") != 0 && realpath(folder, real))
        tidied = weft_path_join(real, name, err);
    else
        weft_fail(err, WEFT_ERR_MISSING, "%s: there is no such folder", folder ? folder : path);
    weft_free(folder);
    weft_free(path);
    return tidied;
}

static weft_err add(void *context, const weft_field *field, const char *text, weft_error *err)
{
    request *const r = context;
    const char *const key = field ? field->key : "*";
    if (field && weft_job_kind_lists("json|quiet", key)) /* json is the format; quiet is what is shown here */
        return WEFT_OK;
    if (field && field->type == WEFT_FIELD_FLAG)
        return json_object_set_new(r->options, key, json_true()) == 0
                   ? WEFT_OK
                   : weft_fail(err, WEFT_ERR_NOMEM, "out of memory for the job");
    const bool is_path = weft_job_kind_lists(r->kind->reads, key) ||
                         weft_job_kind_lists(r->kind->writes, key) || strcmp(key, "rig") == 0;
    char *const value = is_path ? tidy(absolute(text, err), err) : weft_strdup(text, err);
    if (!value)
        return err && err->code != WEFT_OK ? err->code : WEFT_ERR_NOMEM;
    json_t *list = json_object_get(r->options, key);
    if (field && field->type == WEFT_FIELD_TEXTS && !list) {
        list = json_array();
        json_object_set_new(r->options, key, list);
    }
    const int failed = !field ? json_array_append_new(r->operands, json_string(value))
                       : field->type == WEFT_FIELD_TEXTS
                           ? json_array_append_new(list, json_string(value))
                           : json_object_set_new(r->options, key, json_string(value));
    weft_free(value);
    return failed ? weft_fail(err, WEFT_ERR_USAGE, "%s: is not UTF-8", key) : WEFT_OK;
}

/* Takes the references of operands and options. */
static weft_err post(const weft_command *command, const request *r, bool json, const char *socket,
                     int64_t *id, weft_error *err)
{
    json_t *reply = NULL;
    json_t *const body =
        json_pack("{s:s, s:o, s:o, s:s, s:b}", "command", command->name, "operands", r->operands, "options",
                  r->options, "format", json ? "json" : "text", "hold", r->kind->by_hand);
    if (!body)
        return weft_fail(err, WEFT_ERR_NOMEM, "out of memory for the job");
    const weft_err status = weft_daemon_call(socket, "POST", "/v1/jobs", body, &reply, err);
    json_decref(body);
    WEFT_TRY(status);
    *id = json_integer_value(json_object_get(reply, "id"));
    json_decref(reply);
    return WEFT_OK;
}

/* ---- following it ---- */

typedef struct follower {
    const weft_invocation *inv;
    const char *socket;
    int64_t id;
    bool by_hand, asked; /* to cancel */
    bool queued, told;   /* that it waits */
    double begin_s;
    int next_line;
    weft_progress progress;
    char what[64], unit[32];
    bool error_shown;
    int exit_status;
} follower;

static weft_err on_idle(void *context, weft_error *err)
{
    follower *const f = context;
    char path[64];
    json_t *reply = NULL;
    if (f->queued && !f->told && weft_clock_s() - f->begin_s > PATIENCE_S) {
        weft_note("the scanner is in use; waiting as job %" PRId64, f->id);
        f->told = true;
    }
    if (!weft_cancelled() || f->asked)
        return WEFT_OK;
    f->asked = true;
    snprintf(path, sizeof path, "/v1/jobs/%" PRId64 "/cancel", f->id);
    WEFT_TRY(weft_daemon_call(f->socket, "POST", path, NULL, &reply, err));
    json_decref(reply);
    return WEFT_OK;
}

static void show_progress(follower *f, const json_t *data)
{
    const char *const what = json_string_value(json_object_get(data, "what"));
    const char *const unit = json_string_value(json_object_get(data, "unit"));
    const long done = (long)json_integer_value(json_object_get(data, "done"));
    const long total = (long)json_integer_value(json_object_get(data, "total"));
    if (!what || !unit)
        return;
    if (!f->progress.what || strcmp(what, f->what) != 0 || done < f->progress.done ||
        total != f->progress.total) {
        weft_progress_end(&f->progress);
        snprintf(f->what, sizeof f->what, "%s", what);
        snprintf(f->unit, sizeof f->unit, "%s", unit);
        weft_progress_begin(&f->progress, f->what, f->unit, total);
    }
    (void)weft_progress_step(&f->progress, done - f->progress.done, NULL); /* cancelling is the daemon's */
}

static void show_line(follower *f, const json_t *data)
{
    const char *const stream = json_string_value(json_object_get(data, "stream"));
    const char *const text = json_string_value(json_object_get(data, "text"));
    f->next_line = (int)json_integer_value(json_object_get(data, "line")) + 1;
    if (!stream || !text)
        return;
    if (f->progress.shown && f->progress.terminal)
        fputs("\r\033[K", stderr);
    if (strcmp(stream, "out") == 0) {
        fprintf(f->inv->out, "%s\n", text);
        fflush(f->inv->out);
        return;
    }
    const bool is_error = strncmp(text, "weft: ", 6) == 0;
    f->error_shown |= is_error;
    if (is_error || weft_log_get_level() > WEFT_LOG_QUIET)
        fprintf(stderr, "%s\n", text);
}

static void take_end(follower *f, const char *state, const json_t *data)
{
    const json_t *const status = json_object_get(data, "exit_status");
    const char *const error = json_string_value(json_object_get(data, "error"));
    weft_progress_end(&f->progress);
    f->exit_status = strcmp(state, "done") == 0        ? 0
                     : strcmp(state, "cancelled") == 0 ? weft_err_exit_status(WEFT_ERR_CANCELLED)
                     : json_is_integer(status) && json_integer_value(status) > 0
                         ? (int)json_integer_value(status)
                         : 1;
    if (f->exit_status != 0 && !f->error_shown)
        weft_log_error("%s: %s", json_string_value(json_object_get(data, "command")), error ? error : state);
}

static weft_err on_event(void *context, const char *type, const json_t *data, bool *end, weft_error *err)
{
    follower *const f = context;
    (void)err;
    if (strcmp(type, "job.progress") == 0)
        show_progress(f, data);
    else if (strcmp(type, "job.log") == 0)
        show_line(f, data);
    else if (strcmp(type, "job.state") == 0) {
        const char *const state = json_string_value(json_object_get(data, "state"));
        f->queued = state && strcmp(state, "queued") == 0;
        *end = state && strcmp(state, "queued") != 0 && strcmp(state, "running") != 0;
        if (*end)
            take_end(f, state, data);
    }
    return WEFT_OK;
}

/* Watches until the job has ended, through restarts of the daemon. */
static weft_err follow(follower *f, weft_error *err)
{
    double lost_s = 0;
    for (;;) {
        char query[100];
        const int before = f->next_line;
        snprintf(query, sizeof query, "?job=%" PRId64 "&log=%d&hold=%d", f->id, f->next_line, f->by_hand);
        const weft_err status = weft_daemon_watch(f->socket, query, on_event, on_idle, f, err);
        if (status != WEFT_ERR_DEVICE)
            return status;
        if (f->next_line > before || lost_s == 0)
            lost_s = weft_clock_s();
        if (weft_cancelled() || weft_clock_s() - lost_s > COME_BACK_S)
            return weft_prefix(err, status, "job %" PRId64 " goes on when weftd runs again", f->id);
        if (err)
            *err = (weft_error){0};
        nanosleep(&(struct timespec){.tv_nsec = 200000000}, NULL);
    }
}

weft_err weft_remote_run(const weft_command *command, int argc, char *const *argv, const weft_invocation *inv,
                         const char *socket, int *exit_status, weft_error *err)
{
    const weft_field *const tables[] = {command->fields, weft_common_fields};
    request r = {
        .kind = weft_job_kind_find(command->name), .operands = json_array(), .options = json_object()};
    follower f = {.inv = inv, .socket = socket, .by_hand = r.kind->by_hand, .begin_s = weft_clock_s()};
    const weft_err status = weft_fields_visit_argv(tables, 2, argc, argv, add, &r, err);
    if (status != WEFT_OK) {
        json_decref(r.operands);
        json_decref(r.options);
        return status;
    }
    WEFT_TRY(post(command, &r, inv->json, socket, &f.id, err));
    weft_explain("job %" PRId64 " of the daemon on %s", f.id, socket);
    WEFT_TRY(follow(&f, err));
    *exit_status = f.exit_status;
    return WEFT_OK;
}
