#include "host/daemon/queue.h"

#include "core/file.h"
#include "core/json.h"
#include "core/log.h"
#include "core/mem.h"
#include "core/progress.h"
#include "host/client/job_kinds.h"
#include "host/daemon/job_holds.h"
#include "host/daemon/job_order.h"
#include "host/daemon/job_request.h"
#include "host/daemon/job_words.h"
#include "host/library/catalogue.h"
#include "host/process/child.h"

#include <inttypes.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

enum { MAX_RUNNING = 17, MAX_LOG_LINES = 2000, MAX_ATTEMPTS = 100, CPU_NICENESS = 5, KEEP_JOBS = 2000 };
#define GRACE_S 10.0 /* between the request to end and SIGKILL */
#define HOLD_S  5.0  /* for the one who wants to hold a job to come */

typedef struct running_job {
    weft_queue *queue; /* NULL: free */
    weft_job job;
    weft_child *child; /* NULL: it has ended, and the database did not take its end yet */
    int64_t pid;
    json_t *progress;
    int n_lines;
    char last_error[1024]; /* its latest line on stderr */
    json_t *result;
    bool cancelled; /* by a client */
    bool stopped;   /* because the daemon ends */
    double asked_s; /* when it was asked to end; 0: not */
    weft_job_state end_state;
    int end_status;
    char end_error[1024];
} running_job;

struct weft_queue {
    weft_queue_options options;
    weft_loop *loop;
    weft_library_db *db;
    weft_events *events;
    weft_live *live;
    running_job running[MAX_RUNNING];
    weft_job_holds holds;
    bool stopping, look; /* look: something has changed that may let a job begin */
    double looked_s;
};

weft_err weft_queue_create(const weft_queue_options *options, weft_loop *loop, weft_library_db *db,
                           weft_events *events, weft_live *live, weft_queue **queue, weft_error *err)
{
    weft_queue *const q = weft_alloc(1, sizeof *q, err);
    if (!q)
        return WEFT_ERR_NOMEM;
    q->options = *options;
    if (q->options.cpu_jobs > MAX_RUNNING - 1)
        q->options.cpu_jobs = MAX_RUNNING - 1;
    q->loop = loop;
    q->db = db;
    q->events = events;
    q->live = live;
    q->look = true;
    *queue = q;
    return WEFT_OK;
}

static void free_slot(running_job *r)
{
    weft_child_destroy(r->child);
    weft_job_fini(&r->job);
    json_decref(r->progress);
    json_decref(r->result);
    *r = (running_job){0};
}

void weft_queue_destroy(weft_queue *queue)
{
    if (!queue)
        return;
    for (int i = 0; i < MAX_RUNNING; i++)
        if (queue->running[i].queue)
            free_slot(&queue->running[i]);
    weft_free(queue);
}

static running_job *find_running(const weft_queue *queue, int64_t id)
{
    for (int i = 0; i < MAX_RUNNING; i++)
        if (queue->running[i].queue && queue->running[i].job.id == id)
            return (running_job *)(uintptr_t)&queue->running[i];
    return NULL;
}

int weft_queue_running(const weft_queue *queue)
{
    int n = 0;
    for (int i = 0; i < MAX_RUNNING; i++)
        n += queue->running[i].queue != NULL;
    return n;
}

/* ---- what clients see ---- */

static json_t *text_or_null(const char *text)
{
    return text && text[0] ? json_string(text) : json_null();
}

json_t *weft_queue_describe(const weft_queue *queue, const weft_job *job)
{
    const running_job *const r = find_running(queue, job->id);
    const json_t *const operands = json_object_get(job->request, "operands");
    const json_t *const options = json_object_get(job->request, "options");
    const json_t *const after = json_object_get(job->request, "after");
    return json_pack("{s:I, s:s, s:o, s:o, s:o, s:s, s:s, s:s, s:s, s:o, s:o, s:i, s:b, s:o, s:o, s:o, s:o}",
                     "id", (json_int_t)job->id, "command", job->command, "operands",
                     operands ? json_incref((json_t *)(uintptr_t)operands) : json_array(), "options",
                     options ? json_incref((json_t *)(uintptr_t)options) : json_object(), "after",
                     after ? json_incref((json_t *)(uintptr_t)after) : json_array(), "class",
                     job->hardware ? "hardware" : "cpu", "owner", job->owner, "state",
                     weft_job_state_name(job->state), "created", job->created, "started",
                     text_or_null(job->started), "finished", text_or_null(job->finished), "attempt",
                     job->attempt, "cancelling", r && r->cancelled, "exit_status",
                     job->exit_status >= 0 ? json_integer(job->exit_status) : json_null(), "error",
                     text_or_null(job->error), "result", job->result ? json_incref(job->result) : json_null(),
                     "progress", r && r->progress ? json_incref(r->progress) : json_null());
}

static void tell_state(weft_queue *queue, int64_t id)
{
    weft_job job;
    weft_error error = {0};
    if (weft_job_store_get(queue->db, id, &job, &error) != WEFT_OK) {
        weft_warn("job %" PRId64 ": %s", id, error.text);
        return;
    }
    weft_events_add(queue->events, "job.state", id, weft_queue_describe(queue, &job));
    weft_job_fini(&job);
}

/* ---- what a running job says ---- */

static void on_line(void *context, const char *stream, const char *text)
{
    running_job *const r = context;
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
static void tell_picture(const running_job *r, const json_t *info)
{
    json_t *const data = json_copy((json_t *)(uintptr_t)info);
    json_object_del(data, "histogram");
    json_object_set_new(data, "number", json_integer((json_int_t)r->queue->live->number));
    weft_events_add(r->queue->events, "live", r->job.id, data);
}

static void on_report(void *context, json_t *message, int picture)
{
    running_job *const r = context;
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
    const running_job *const r = context;
    weft_events_add(r->queue->events, "library", r->job.id,
                    json_pack("{s:s, s:I}", "path", path, "job", (json_int_t)r->job.id));
}

/* Enters what the job has made. */
static void catalogue_works(running_job *r)
{
    for (size_t i = 0; i < json_array_size(r->job.writes); i++) {
        weft_error error = {0};
        const char *const path = json_string_value(json_array_get(r->job.writes, i));
        if (weft_catalogue_index_works(r->queue->db, path, tell_work, r, &error) != WEFT_OK)
            weft_warn("%s: cannot be catalogued: %s", path, error.text);
    }
}

/* Stores the end that is written in the slot; the slot stays when the database does not take it. */
static void store_end(running_job *r)
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
    free_slot(r);
    tell_state(queue, id);
    queue->look = true;
}

static void on_end(void *context, int status)
{
    running_job *const r = context;
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
        snprintf(r->end_error, sizeof r->end_error, "ended by force: it did not end within %g s", GRACE_S);
    else if (!exited)
        snprintf(r->end_error, sizeof r->end_error, "its process was killed by signal %d (%s)",
                 WTERMSIG(status), strsignal(WTERMSIG(status)));
    if (!WIFEXITED(status))
        weft_job_sweep(&r->job, r->pid);
    weft_child_destroy(r->child);
    r->child = NULL;
    catalogue_works(r);
    store_end(r);
}

/* ---- starting ---- */

static weft_err start(weft_queue *queue, running_job *r, weft_error *err)
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
        tell_state(queue, r->job.id);
    }
    return status;
}

/* Takes the job over into a slot and starts it; NULL when it does not start. */
static running_job *begin(weft_queue *queue, weft_job *job)
{
    weft_error error = {0};
    running_job *r = queue->running;
    while (r->queue)
        r++;
    *r = (running_job){.queue = queue, .job = *job};
    *job = (weft_job){0};
    const int64_t id = r->job.id;
    const weft_err status = start(queue, r, &error);
    if (status == WEFT_OK)
        return r;
    weft_warn("job %" PRId64 " cannot be started: %s", id, error.text);
    free_slot(r); /* it stays queued, unless its own words are wrong */
    if (status == WEFT_ERR_FORMAT &&
        weft_job_store_finished(queue->db, id, WEFT_JOB_FAILED, -1, error.text, NULL, NULL) == WEFT_OK)
        tell_state(queue, id);
    return NULL;
}

/* What is in use while the queue is gone through, oldest first. */
typedef struct survey {
    weft_queue *queue;
    int n_hardware, n_cpu;
    bool hardware_waits; /* an earlier job waits for the scanner: nobody overtakes it */
    const weft_job *earlier[256];
    int n_earlier;
    weft_job waiting[256];
    int n_waiting;
} survey;

static bool must_wait(const survey *s, const weft_job *job)
{
    for (int i = 0; i < s->n_earlier; i++)
        if (weft_job_follows(job, s->earlier[i]))
            return true;
    if (weft_job_holds_wait(&s->queue->holds, job->id))
        return true;
    return job->hardware ? s->n_hardware > 0 || s->hardware_waits : s->n_cpu >= s->queue->options.cpu_jobs;
}

static weft_err collect(void *context, weft_job *job, weft_error *err)
{
    survey *const s = context;
    (void)err;
    if (s->n_waiting == 256) { /* newest first: the oldest stay */
        weft_job_fini(&s->waiting[0]);
        memmove(s->waiting, s->waiting + 1, 255 * sizeof s->waiting[0]);
        s->n_waiting--;
    }
    s->waiting[s->n_waiting++] = *job;
    *job = (weft_job){0};
    return WEFT_OK;
}

static void start_what_can(weft_queue *queue)
{
    static const weft_job_state queued = WEFT_JOB_QUEUED;
    weft_error error = {0};
    survey *const s = weft_alloc(1, sizeof *s, NULL);
    queue->look = false;
    if (!s)
        return;
    s->queue = queue;
    for (int i = 0; i < MAX_RUNNING; i++)
        if (queue->running[i].queue) {
            s->earlier[s->n_earlier++] = &queue->running[i].job;
            *(queue->running[i].job.hardware ? &s->n_hardware : &s->n_cpu) += 1;
        }
    if (weft_job_store_visit(queue->db, &queued, 0, -1, collect, s, &error) != WEFT_OK)
        weft_warn("the queue cannot be read: %s", error.text);
    for (int i = s->n_waiting - 1; i >= 0; i--) {
        weft_job *const job = &s->waiting[i];
        const bool hardware = job->hardware;
        if (must_wait(s, job)) {
            if (!weft_job_holds_wait(&queue->holds, job->id))
                s->hardware_waits |= hardware;
            if (s->n_earlier < 256)
                s->earlier[s->n_earlier++] = job;
            continue;
        }
        const running_job *const begun = begin(queue, job);
        if (!begun)
            continue;
        *(hardware ? &s->n_hardware : &s->n_cpu) += 1;
        if (s->n_earlier < 256)
            s->earlier[s->n_earlier++] = &begun->job;
    }
    for (int i = 0; i < s->n_waiting; i++)
        weft_job_fini(&s->waiting[i]);
    weft_free(s);
}

static void let_go_of_the_forgotten(weft_queue *queue, double now_s)
{
    for (int64_t id; (id = weft_job_holds_take_forgotten(&queue->holds, now_s, HOLD_S)) > 0;)
        weft_queue_cancel(queue, id, NULL);
}

void weft_queue_tick(weft_queue *queue)
{
    const double now_s = weft_clock_s();
    for (int i = 0; i < MAX_RUNNING; i++) {
        running_job *const r = &queue->running[i];
        if (!r->queue)
            continue;
        if (!r->child)
            store_end(r);
        else if (r->asked_s > 0 && now_s - r->asked_s > GRACE_S)
            weft_child_kill(r->child);
    }
    let_go_of_the_forgotten(queue, now_s);
    if (!queue->stopping && (queue->look || now_s - queue->looked_s > 2)) {
        queue->looked_s = now_s;
        start_what_can(queue);
    }
}

/* ---- what clients ask ---- */

static weft_err too_many_held(weft_error *err)
{
    return weft_fail(err, WEFT_ERR_RANGE, "more than %d jobs are held", WEFT_JOB_HOLDS_MAX);
}

weft_err weft_queue_add(weft_queue *queue, weft_job *job, bool hold, weft_error *err)
{
    if (hold && !weft_job_holds_have_room(&queue->holds))
        return too_many_held(err);
    WEFT_TRY(weft_job_store_add(queue->db, job, err));
    if (hold)
        weft_job_holds_expect(&queue->holds, job->id, weft_clock_s());
    (void)weft_job_store_trim(queue->db, KEEP_JOBS, NULL);
    tell_state(queue, job->id);
    queue->look = true;
    return WEFT_OK;
}

weft_err weft_queue_cancel(weft_queue *queue, int64_t id, weft_error *err)
{
    weft_job job;
    running_job *const r = find_running(queue, id);
    if (r) {
        const bool first = !r->cancelled;
        r->cancelled = true;
        if (first && r->child) {
            r->asked_s = weft_clock_s();
            weft_child_signal(r->child, SIGTERM);
            tell_state(queue, id);
        }
        return WEFT_OK;
    }
    WEFT_TRY(weft_job_store_get(queue->db, id, &job, err));
    const weft_job_state state = job.state;
    weft_job_fini(&job);
    if (state != WEFT_JOB_QUEUED)
        return WEFT_OK;
    WEFT_TRY(weft_job_store_finished(queue->db, id, WEFT_JOB_CANCELLED, -1, "cancelled before it began", NULL,
                                     err));
    weft_job_holds_drop(&queue->holds, id);
    tell_state(queue, id);
    queue->look = true;
    return WEFT_OK;
}

weft_err weft_queue_resume(weft_queue *queue, int64_t id, weft_error *err)
{
    weft_job job;
    WEFT_TRY(weft_job_store_get(queue->db, id, &job, err));
    const weft_job_state state = job.state;
    const bool hold = weft_job_request_holds(job.request);
    weft_job_fini(&job);
    if (state != WEFT_JOB_FAILED && state != WEFT_JOB_CANCELLED)
        return weft_fail(err, WEFT_ERR_EXISTS,
                         "job %" PRId64 " is %s: only a failed or cancelled one is resumed", id,
                         weft_job_state_name(state));
    if (hold && !weft_job_holds_have_room(&queue->holds))
        return too_many_held(err);
    WEFT_TRY(weft_job_store_requeue(queue->db, id, err));
    if (hold)
        weft_job_holds_expect(&queue->holds, id, weft_clock_s());
    tell_state(queue, id);
    queue->look = true;
    return WEFT_OK;
}

void weft_queue_hold(weft_queue *queue, int64_t id, bool hold)
{
    const int holders = weft_job_holds_change(&queue->holds, id, hold);
    queue->look |= hold && holders > 0;
    if (holders == 0)
        weft_queue_cancel(queue, id, NULL);
}

void weft_queue_stop(weft_queue *queue)
{
    queue->stopping = true;
    for (int i = 0; i < MAX_RUNNING; i++) {
        running_job *const r = &queue->running[i];
        if (!r->queue || !r->child || r->asked_s > 0)
            continue;
        const weft_job_kind *const kind = weft_job_kind_find(r->job.command);
        r->stopped = true;
        r->cancelled |= kind && kind->by_hand;
        r->asked_s = weft_clock_s();
        weft_child_signal(r->child, SIGTERM);
    }
}

/* ---- after an earlier daemon ---- */

typedef struct recovery {
    int n;
    struct {
        int64_t id;
        const char *problem; /* NULL: it is queued again */
    } jobs[MAX_RUNNING * 4];
} recovery;

static weft_err look_at_left_over(void *context, weft_job *job, weft_error *err)
{
    recovery *const r = context;
    const weft_job_kind *const kind = weft_job_kind_find(job->command);
    (void)err;
    weft_child_kill_stray(job->pid, job->pid_start);
    weft_job_sweep(job, job->pid);
    if (r->n == MAX_RUNNING * 4)
        return WEFT_OK;
    r->jobs[r->n].id = job->id;
    r->jobs[r->n++].problem = !kind                          ? "this weftd does not know the command"
                              : kind->by_hand                ? "weftd ended while it ran"
                              : job->attempt >= MAX_ATTEMPTS ? "given up: weftd ended each time while it ran"
                                                             : NULL;
    return WEFT_OK;
}

/* Who waited to hold a job comes back, or the job is cancelled. */
static weft_err look_at_queued(void *context, weft_job *job, weft_error *err)
{
    (void)err;
    weft_queue *const queue = context;
    if (weft_job_request_holds(job->request))
        weft_job_holds_expect(&queue->holds, job->id, weft_clock_s());
    return WEFT_OK;
}

weft_err weft_queue_recover(weft_queue *queue, weft_error *err)
{
    static const weft_job_state queued = WEFT_JOB_QUEUED;
    static const weft_job_state running = WEFT_JOB_RUNNING;
    recovery r = {0};
    WEFT_TRY(weft_job_store_visit(queue->db, &running, 0, -1, look_at_left_over, &r, err));
    WEFT_TRY(weft_job_store_visit(queue->db, &queued, 0, -1, look_at_queued, queue, err));
    for (int i = 0; i < r.n; i++) {
        if (r.jobs[i].problem)
            WEFT_TRY(weft_job_store_finished(queue->db, r.jobs[i].id, WEFT_JOB_FAILED, -1, r.jobs[i].problem,
                                             NULL, err));
        else
            WEFT_TRY(weft_job_store_requeue(queue->db, r.jobs[i].id, err));
        weft_note("job %" PRId64 ": %s", r.jobs[i].id, r.jobs[i].problem ? r.jobs[i].problem : "goes on");
    }
    return WEFT_OK;
}
