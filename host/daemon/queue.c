#include "host/daemon/queue_private.h"

#include "core/log.h"
#include "core/mem.h"
#include "core/progress.h"
#include "host/client/job_kinds.h"
#include "host/daemon/job_request.h"

#include <inttypes.h>
#include <signal.h>

enum { KEEP_JOBS = 2000 };
#define HOLD_S 5.0 /* for the one who wants to hold a job to come */

weft_err weft_queue_create(const weft_queue_options *options, weft_loop *loop, weft_library_db *db,
                           weft_events *events, weft_live *live, weft_queue **queue, weft_error *err)
{
    weft_queue *const q = weft_alloc(1, sizeof *q, err);
    if (!q)
        return WEFT_ERR_NOMEM;
    q->options = *options;
    if (q->options.cpu_jobs > WEFT_QUEUE_MAX_RUNNING - 1)
        q->options.cpu_jobs = WEFT_QUEUE_MAX_RUNNING - 1;
    q->loop = loop;
    q->db = db;
    q->events = events;
    q->live = live;
    q->look = true;
    *queue = q;
    return WEFT_OK;
}

void weft_queue_destroy(weft_queue *queue)
{
    if (!queue)
        return;
    for (int i = 0; i < WEFT_QUEUE_MAX_RUNNING; i++)
        if (queue->running[i].queue)
            weft_queue_free_slot(&queue->running[i]);
    weft_free(queue);
}

static weft_running_job *find_running(const weft_queue *queue, int64_t id)
{
    for (int i = 0; i < WEFT_QUEUE_MAX_RUNNING; i++)
        if (queue->running[i].queue && queue->running[i].job.id == id)
            return (weft_running_job *)(uintptr_t)&queue->running[i];
    return NULL;
}

int weft_queue_running(const weft_queue *queue)
{
    int n = 0;
    for (int i = 0; i < WEFT_QUEUE_MAX_RUNNING; i++)
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
    const weft_running_job *const r = find_running(queue, job->id);
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

void weft_queue_tell_state(weft_queue *queue, int64_t id)
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

static void let_go_of_the_forgotten(weft_queue *queue, double now_s)
{
    for (int64_t id; (id = weft_job_holds_take_forgotten(&queue->holds, now_s, HOLD_S)) > 0;)
        weft_queue_cancel(queue, id, NULL);
}

void weft_queue_tick(weft_queue *queue)
{
    const double now_s = weft_clock_s();
    for (int i = 0; i < WEFT_QUEUE_MAX_RUNNING; i++) {
        weft_running_job *const r = &queue->running[i];
        if (!r->queue)
            continue;
        if (!r->child)
            weft_queue_store_end(r);
        else if (r->asked_s > 0 && now_s - r->asked_s > WEFT_QUEUE_GRACE_S)
            weft_child_kill(r->child);
    }
    let_go_of_the_forgotten(queue, now_s);
    if (!queue->stopping && (queue->look || now_s - queue->looked_s > 2)) {
        queue->looked_s = now_s;
        weft_queue_start_what_can(queue);
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
    weft_queue_tell_state(queue, job->id);
    queue->look = true;
    return WEFT_OK;
}

weft_err weft_queue_cancel(weft_queue *queue, int64_t id, weft_error *err)
{
    weft_job job;
    weft_running_job *const r = find_running(queue, id);
    if (r) {
        const bool first = !r->cancelled;
        r->cancelled = true;
        if (first && r->child) {
            r->asked_s = weft_clock_s();
            weft_child_signal(r->child, SIGTERM);
            weft_queue_tell_state(queue, id);
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
    weft_queue_tell_state(queue, id);
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
    weft_queue_tell_state(queue, id);
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
    for (int i = 0; i < WEFT_QUEUE_MAX_RUNNING; i++) {
        weft_running_job *const r = &queue->running[i];
        if (!r->queue || !r->child || r->asked_s > 0)
            continue;
        const weft_job_kind *const kind = weft_job_kind_find(r->job.command);
        r->stopped = true;
        r->cancelled |= kind && kind->by_hand;
        r->asked_s = weft_clock_s();
        weft_child_signal(r->child, SIGTERM);
    }
}
