/* A job at work: its process, what it says, its end. */
#include "host/daemon/queue_private.h"

#include "core/log.h"
#include "host/daemon/job_words.h"
#include "host/library/catalogue.h"

#include <inttypes.h>
#include <stdio.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

enum { MAX_LOG_LINES = 2000, CPU_NICENESS = 5 };

void weft_queue_free_slot(weft_running_job *r)
{
    weft_child_destroy(r->child);
    weft_job_fini(&r->job);
    json_decref(r->progress);
    json_decref(r->result);
    *r = (weft_running_job){0};
}

/* ---- what a running job says ---- */

static void on_line(void *context, const char *stream, const char *text)
{
    weft_running_job *const r = context;
    weft_error error = {0};
    if (strcmp(stream, "err") == 0)
        snprintf(r->last_error, sizeof r->last_error, "%s", text);
    else if (text[0] == '{' && !r->result)
        r->result = json_loads(text, 0, NULL);
    if (r->n_lines >= MAX_LOG_LINES)
        return;
    if (r->n_lines == MAX_LOG_LINES - 1)
        text = "(what follows is not kept)";
    if (weft_job_store_log(r->queue->db, r->job.id, r->n_lines, stream, text, &error) != WEFT_OK)
        weft_warn("job %" PRId64 ": its log: %s", r->job.id, error.text);
    weft_events_add(r->queue->events, "job.log", r->job.id,
                    json_pack("{s:I, s:i, s:s, s:s}", "job", (json_int_t)r->job.id, "line", r->n_lines,
                              "stream", stream, "text", text));
    r->n_lines++;
}

/* That there is a picture; its histogram is for those who ask. */
static void tell_picture(const weft_running_job *r, const json_t *info)
{
    json_t *const data = json_copy((json_t *)(uintptr_t)info);
    json_object_del(data, "histogram");
    json_object_set_new(data, "number", json_integer((json_int_t)r->queue->live->number));
    weft_events_add(r->queue->events, "live", r->job.id, data);
}

static void on_report(void *context, json_t *message, int picture)
{
    weft_running_job *const r = context;
    json_t *const progress = json_object_get(message, "progress"), *const info =
                                                                       json_object_get(message, "picture");
    weft_error error = {0};
    if (json_is_object(progress)) {
        json_decref(r->progress);
        r->progress = json_incref(progress);
        json_t *const data = json_copy(progress);
        json_object_set_new(data, "job", json_integer(r->job.id));
        weft_events_add(r->queue->events, "job.progress", r->job.id, data);
    }
    if (json_is_object(info) && picture >= 0) {
        json_object_set_new(info, "job", json_integer(r->job.id));
        if (weft_live_take(r->queue->live, info, picture, &error) != WEFT_OK)
            weft_warn("job %" PRId64 ": %s", r->job.id, error.text);
        else
            tell_picture(r, info);
    }
    if (picture >= 0)
        close(picture);
}

static void tell_work(void *context, const char *path)
{
    const weft_running_job *const r = context;
    weft_events_add(r->queue->events, "library", r->job.id,
                    json_pack("{s:s, s:I}", "path", path, "job", (json_int_t)r->job.id));
}

/* Enters what the job has made. */
static void catalogue_works(weft_running_job *r)
{
    for (size_t i = 0; i < json_array_size(r->job.writes); i++) {
        weft_error error = {0};
        const char *const path = json_string_value(json_array_get(r->job.writes, i));
        if (weft_catalogue_index_works(r->queue->db, path, tell_work, r, &error) != WEFT_OK)
            weft_warn("%s: cannot be catalogued: %s", path, error.text);
    }
}

void weft_queue_store_end(weft_running_job *r)
{
    weft_queue *const queue = r->queue;
    const int64_t id = r->job.id;
    weft_error error = {0};
    weft_err status;
    if (r->stopped && r->end_state != WEFT_JOB_DONE && !r->cancelled)
        status = weft_job_store_requeue(queue->db, id, &error);
    else
        status = weft_job_store_finished(queue->db, id, r->end_state, r->end_status,
                                         r->end_error[0] ? r->end_error : NULL, r->result, &error);
    if (status != WEFT_OK) {
        weft_warn("job %" PRId64 ": its end cannot be stored yet: %s", id, error.text);
        return;
    }
    weft_job_holds_drop(&queue->holds, id);
    weft_queue_free_slot(r);
    weft_queue_tell_state(queue, id);
    queue->look = true;
}

static void on_end(void *context, int status)
{
    weft_running_job *const r = context;
    const bool early =
        WIFSIGNALED(status) && WTERMSIG(status) == SIGTERM && r->asked_s > 0; /* before it could catch it */
    const bool exited = WIFEXITED(status) || early;
    const int code = early ? weft_err_exit_status(WEFT_ERR_CANCELLED) : exited ? WEXITSTATUS(status) : -1;
    static const char prefix[] = "weft: ";
    const char *said = r->last_error;
    if (strncmp(said, prefix, strlen(prefix)) == 0)
        said += strlen(prefix);
    r->end_status = code;
    r->end_state = code == 0 ? WEFT_JOB_DONE : r->cancelled ? WEFT_JOB_CANCELLED : WEFT_JOB_FAILED;
    if (code == 127 && !r->last_error[0])
        snprintf(r->end_error, sizeof r->end_error, "%s cannot be run", r->queue->options.program);
    else if (early)
        snprintf(r->end_error, sizeof r->end_error, "cancelled");
    else if (code != 0 && exited)
        snprintf(r->end_error, sizeof r->end_error, "%s", said[0] ? said : "it failed without a word");
    else if (!exited && r->asked_s > 0)
        snprintf(r->end_error, sizeof r->end_error, "ended by force: it did not end within %g s",
                 WEFT_QUEUE_GRACE_S);
    else if (!exited)
        snprintf(r->end_error, sizeof r->end_error, "its process was killed by signal %d (%s)",
                 WTERMSIG(status), strsignal(WTERMSIG(status)));
    if (!WIFEXITED(status))
        weft_job_sweep(&r->job, r->pid);
    weft_child_destroy(r->child);
    r->child = NULL;
    catalogue_works(r);
    weft_queue_store_end(r);
}

/* ---- starting ---- */

static weft_err start(weft_queue *queue, weft_running_job *r, weft_error *err)
{
    char **words = NULL;
    const weft_child_ears ears = {.line = on_line, .report = on_report, .end = on_end, .context = r};
    const bool fresh = weft_job_writes_nothing_there(&r->job);
    WEFT_TRY(weft_job_words_make(&r->job, &words, err));
    weft_err status = weft_job_store_log_end(queue->db, r->job.id, &r->n_lines, err);
    if (status == WEFT_OK)
        status = weft_child_start(queue->loop, queue->options.program, words,
                                  r->job.hardware ? 0 : CPU_NICENESS, &ears, &r->child, err);
    weft_job_words_free(words);
    if (status == WEFT_OK) {
        r->pid = weft_child_pid(r->child);
        status =
            weft_job_store_started(queue->db, r->job.id, r->pid, weft_child_start_time(r->child), fresh, err);
    }
    if (status == WEFT_OK) {
        weft_child_go(r->child);
        weft_queue_tell_state(queue, r->job.id);
    }
    return status;
}

weft_running_job *weft_queue_run(weft_queue *queue, weft_job *job)
{
    weft_error error = {0};
    weft_running_job *r = queue->running;
    while (r->queue)
        r++;
    *r = (weft_running_job){.queue = queue, .job = *job};
    *job = (weft_job){0};
    const int64_t id = r->job.id;
    const weft_err status = start(queue, r, &error);
    if (status == WEFT_OK)
        return r;
    weft_warn("job %" PRId64 " cannot be started: %s", id, error.text);
    weft_queue_free_slot(r); /* it stays queued, unless its own words are wrong */
    if (status == WEFT_ERR_FORMAT &&
        weft_job_store_finished(queue->db, id, WEFT_JOB_FAILED, -1, error.text, NULL, NULL) == WEFT_OK)
        weft_queue_tell_state(queue, id);
    return NULL;
}
