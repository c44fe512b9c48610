/** What the parts of the queue share: its state, and a job at work. */
#ifndef WEFT_HOST_DAEMON_QUEUE_PRIVATE_H
#define WEFT_HOST_DAEMON_QUEUE_PRIVATE_H

#include "host/daemon/job_holds.h"
#include "host/daemon/queue.h"
#include "host/process/child.h"

#define WEFT_QUEUE_GRACE_S 10.0 /* between the request to end and SIGKILL */

enum { WEFT_QUEUE_MAX_RUNNING = 17 };

/** A job at work: a slot of the queue. */
typedef struct weft_running_job {
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
} weft_running_job;

struct weft_queue {
    weft_queue_options options;
    weft_loop *loop;
    weft_library_db *db;
    weft_events *events;
    weft_live *live;
    weft_running_job running[WEFT_QUEUE_MAX_RUNNING];
    weft_job_holds holds;
    bool stopping, look; /* look: something has changed that may let a job begin */
    double looked_s;
};

/** Tells everybody the state that the database has of a job. */
void weft_queue_tell_state(weft_queue *queue, int64_t id);

/* -- queue_run.c */

/** Takes the job over into a free slot and starts it.  @return NULL when it does not start */
weft_running_job *weft_queue_run(weft_queue *queue, weft_job *job);
/** Stores the end of a job that has ended, and frees the slot; it stays when the database does not take it.
 */
void weft_queue_store_end(weft_running_job *running);
/** Kills what still runs in the slot, and frees it. */
void weft_queue_free_slot(weft_running_job *running);

/* -- queue_pick.c */

/** Starts every queued job that need not wait, oldest first. */
void weft_queue_start_what_can(weft_queue *queue);

#endif
