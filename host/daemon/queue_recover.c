/* What a daemon that was killed has left behind. */
#include "host/daemon/queue_private.h"

#include "core/log.h"
#include "core/progress.h"
#include "host/client/job_kinds.h"
#include "host/daemon/job_request.h"
#include "host/daemon/job_words.h"

#include <inttypes.h>

enum { MAX_ATTEMPTS = 100 };

typedef struct recovery {
    int n;
    struct {
        int64_t id;
        const char *problem; /* NULL: it is queued again */
    } jobs[WEFT_QUEUE_MAX_RUNNING * 4];
} recovery;

static weft_err look_at_left_over(void *context, weft_job *job, weft_error *err)
{
    recovery *const r = context;
    const weft_job_kind *const kind = weft_job_kind_find(job->command);
    (void)err;
    weft_child_kill_stray(job->pid, job->pid_start);
    weft_job_sweep(job, job->pid);
    if (r->n == WEFT_QUEUE_MAX_RUNNING * 4)
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
    static const weft_job_state running = WEFT_JOB_RUNNING;
    recovery r = {0};
    WEFT_TRY(weft_job_store_visit(queue->db, &running, 0, -1, look_at_left_over, &r, err));
    WEFT_TRY(weft_job_store_visit_queued(queue->db, -1, look_at_queued, queue, err));
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
