/**
 * The queue at work: which job runs when, in which process, and what became of it.
 *
 * - A job is a `weft` process (child.h): the same function as the command, and killing it is a cancel that
 *   always works.
 * - The scanner has one owner: jobs that need it run one at a time, in their order.  Others run beside it.
 * - A job waits for earlier ones that make what it reads or writes, and for those that read what it makes.
 * - Every change of state is in the database before anybody is told.  After SIGKILL of the daemon its
 * processes die with it, and at the next start what was running is queued again; a capture goes on with
 * --resume.
 */
#ifndef WEFT_HOST_DAEMON_QUEUE_H
#define WEFT_HOST_DAEMON_QUEUE_H

#include "host/daemon/events.h"
#include "host/daemon/live.h"
#include "host/library/job_store.h"
#include "host/process/loop.h"

#include <stdbool.h>

typedef struct weft_queue_options {
    const char *program; /* path of `weft` */
    int cpu_jobs;        /* jobs without the scanner at a time, 1.. */
} weft_queue_options;

typedef struct weft_queue weft_queue;

/** All of these outlive the queue. */
weft_err weft_queue_create(const weft_queue_options *options, weft_loop *loop, weft_library_db *db,
                           weft_events *events, weft_live *live, weft_queue **queue, weft_error *err);
/** Kills what still runs. */
void weft_queue_destroy(weft_queue *queue);

/** Puts back what an earlier daemon left running, ending processes that outlived it. */
weft_err weft_queue_recover(weft_queue *queue, weft_error *err);

/** Queues a job (job_request.h) and sets its id.  @param hold  it does not begin before weft_queue_hold(),
 * and is cancelled when nobody holds it for some seconds */
weft_err weft_queue_add(weft_queue *queue, weft_job *job, bool hold, weft_error *err);
/** Lights off first: the job gets SIGTERM and ten seconds.  Harmless for one that has ended.
 *  @return WEFT_ERR_MISSING */
weft_err weft_queue_cancel(weft_queue *queue, int64_t id, weft_error *err);
/** Queues a failed or cancelled job again; it goes on where it can.
 *  @return WEFT_ERR_MISSING, WEFT_ERR_EXISTS when it has not ended or is done */
weft_err weft_queue_resume(weft_queue *queue, int64_t id, weft_error *err);

/** Somebody holds the job, or lets it go: then it is cancelled. */
void weft_queue_hold(weft_queue *queue, int64_t id, bool hold);

/** Starts what can start, kills what does not end.  Call at least every half second. */
void weft_queue_tick(weft_queue *queue);

/** No job begins any more; those that run are asked to end and will be queued again. */
void weft_queue_stop(weft_queue *queue);
/** How many still run. */
int weft_queue_running(const weft_queue *queue);

/** A job as clients see it; NULL without memory. */
json_t *weft_queue_describe(const weft_queue *queue, const weft_job *job);

#endif
