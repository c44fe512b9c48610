/** Which jobs may not run side by side, by the paths that they read and write. */
#ifndef WEFT_HOST_DAEMON_JOB_ORDER_H
#define WEFT_HOST_DAEMON_JOB_ORDER_H

#include "host/library/job_store.h"

/**
 * Whether a job has to wait for the end of an earlier one: that makes what it needs or makes, or needs what
 * it makes, or the request names it in "after".  A job that looks at a folder does not wait for all that is
 * made in it: the library would stand still while it is indexed.
 */
bool weft_job_follows(const weft_job *job, const weft_job *earlier);

#endif
