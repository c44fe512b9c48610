/* Which of the queued jobs may begin. */
#include "host/daemon/queue_private.h"

#include "core/log.h"
#include "core/mem.h"
#include "host/daemon/job_order.h"

/* So many of the queued jobs, the oldest, are looked at. */
enum { MAX_WAITING = 256 };

/* What is in use while the queue is gone through, oldest first. */
typedef struct survey {
    weft_queue *queue;
    int n_hardware, n_cpu; /* that run */
    bool hardware_waits;   /* an earlier job waits for the scanner: nobody overtakes it */
    const weft_job *earlier[WEFT_QUEUE_MAX_RUNNING + MAX_WAITING]; /* than the one that is looked at */
    int n_earlier;
    weft_job waiting[MAX_WAITING];
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

static void note_running(survey *s, const weft_running_job *running)
{
    *(running->job.hardware ? &s->n_hardware : &s->n_cpu) += 1;
    s->earlier[s->n_earlier++] = &running->job;
}

static weft_err collect(void *context, weft_job *job, weft_error *err)
{
    survey *const s = context;
    (void)err;
    s->waiting[s->n_waiting++] = *job;
    *job = (weft_job){0};
    return WEFT_OK;
}

void weft_queue_start_what_can(weft_queue *queue)
{
    weft_error error = {0};
    survey *const s = weft_alloc(1, sizeof *s, NULL);
    queue->look = false;
    if (!s)
        return;
    s->queue = queue;
    for (int i = 0; i < WEFT_QUEUE_MAX_RUNNING; i++)
        if (queue->running[i].queue)
            note_running(s, &queue->running[i]);
    if (weft_job_store_visit_queued(queue->db, MAX_WAITING, collect, s, &error) != WEFT_OK)
        weft_warn("the queue cannot be read: %s", error.text);
    for (int i = 0; i < s->n_waiting; i++) {
        weft_job *const job = &s->waiting[i];
        if (must_wait(s, job)) {
            s->hardware_waits |= job->hardware && !weft_job_holds_wait(&queue->holds, job->id);
            s->earlier[s->n_earlier++] = job;
            continue;
        }
        const weft_running_job *const begun = weft_queue_run(queue, job);
        if (begun)
            note_running(s, begun);
    }
    for (int i = 0; i < s->n_waiting; i++)
        weft_job_fini(&s->waiting[i]);
    weft_free(s);
}
