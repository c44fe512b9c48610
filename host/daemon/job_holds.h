/** Jobs that live as long as somebody holds them: a capture ends when the one who watches it goes. */
#ifndef WEFT_HOST_DAEMON_JOB_HOLDS_H
#define WEFT_HOST_DAEMON_JOB_HOLDS_H

#include <stdbool.h>
#include <stdint.h>

#define WEFT_JOB_HOLDS_MAX 64

typedef struct weft_job_hold {
    int64_t id; /* 0: free */
    int holders;
    double since_s; /* when it began to wait for its holder */
} weft_job_hold;

/** Begin with {0}. */
typedef struct weft_job_holds {
    weft_job_hold rows[WEFT_JOB_HOLDS_MAX];
} weft_job_holds;

/** Whether one more job can be held. */
bool weft_job_holds_have_room(const weft_job_holds *holds);
/** The job waits for its holder from now on; nothing when there is no room. */
void weft_job_holds_expect(weft_job_holds *holds, int64_t id, double now_s);
/** Whether the job waits for a holder who has not come yet. */
bool weft_job_holds_wait(const weft_job_holds *holds, int64_t id);
/** A holder comes or goes.  @return how many there are now, at 0 the job is no longer held; -1: it was not */
int weft_job_holds_change(weft_job_holds *holds, int64_t id, bool hold);
/** The job is over. */
void weft_job_holds_drop(weft_job_holds *holds, int64_t id);
/** Drops a job whose holder did not come within `patience_s`.  @return its id; 0: there is none */
int64_t weft_job_holds_take_forgotten(weft_job_holds *holds, double now_s, double patience_s);

#endif
