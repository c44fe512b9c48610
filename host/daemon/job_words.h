/** The command line of a job's next run: as it was asked for, or so that it goes on where it was interrupted.
 */
#ifndef WEFT_HOST_DAEMON_JOB_WORDS_H
#define WEFT_HOST_DAEMON_JOB_WORDS_H

#include "host/library/job_store.h"

#include <stdbool.h>

/** Whether nothing of what the job makes is there yet. */
bool weft_job_writes_nothing_there(const weft_job *job);

/** Removes what a process of the job that was killed has left half made: ".weft-NAME-PID-N" beside what it
 * makes and, where that is a folder, in it. */
void weft_job_sweep(const weft_job *job, int64_t pid);

/**
 * The words, ended by NULL, beginning with "weft"; weft_job_words_free() them.
 *
 * A first run has the words of the request.  A later one of a command with --resume gets that option, in
 * place of --force unless the set that is there is older than the job: then nothing of it is the job's own
 * yet. A later run of another command gets --force when nothing of what it makes was there at its first: what
 * is there now is its own.
 */
weft_err weft_job_words_make(const weft_job *job, char ***words, weft_error *err);
void weft_job_words_free(char **words);

#endif
