/**
 * The queue of jobs on disk.
 *
 * A job is one run of a `weft` command.  Its way:
 *
 *     queued -> running -> done | failed | cancelled
 *       ^          |          (resume: failed or cancelled -> queued)
 *       +----------+  the daemon ended, or was killed, while it ran
 *
 * Each change is one transaction.
 */
#ifndef WEFT_HOST_LIBRARY_JOB_STORE_H
#define WEFT_HOST_LIBRARY_JOB_STORE_H

#include "host/library/library_db.h"

#include <jansson.h>
#include <stdint.h>

typedef enum weft_job_state {
    WEFT_JOB_QUEUED,
    WEFT_JOB_RUNNING,
    WEFT_JOB_DONE,
    WEFT_JOB_FAILED,
    WEFT_JOB_CANCELLED
} weft_job_state;

/** @return "queued", "running", "done", "failed", "cancelled" */
const char *weft_job_state_name(weft_job_state state);
/** false for a name that is none. */
bool weft_job_state_from_name(const char *name, weft_job_state *state);

/** A job as it is stored.  Owns what it points to: weft_job_fini(). */
typedef struct weft_job {
    int64_t id;
    char *command;          /* "capture", "calibrate lens" */
    json_t *request;        /* as it was asked for */
    json_t *words;          /* list of texts: the command line behind the command's name, paths absolute */
    json_t *reads, *writes; /* lists of absolute paths: what it needs, what it makes */
    bool hardware;          /* needs the scanner: one at a time */
    char *owner;            /* who asked: "uid 1000", "tcp" */
    weft_job_state state;
    char created[32], started[32], finished[32]; /* empty: not yet */
    int attempt;                                 /* runs so far */
    bool fresh;             /* what it writes was not there when it began: its own remains may be replaced */
    int64_t pid, pid_start; /* of its process while it runs: number and start time, 0 none */
    int exit_status;        /* -1: it has not ended by itself */
    char *error;            /* why it failed; NULL */
    json_t *result;         /* what it printed as JSON; NULL */
} weft_job;

/** Frees the members. */
void weft_job_fini(weft_job *job);

/** Adds a queued job; job->id, state and created are set.  Only command, request, words, reads, writes,
 *  hardware and owner are looked at. */
weft_err weft_job_store_add(weft_library_db *db, weft_job *job, weft_error *err);
/** @return WEFT_ERR_MISSING when there is no such job */
weft_err weft_job_store_get(weft_library_db *db, int64_t id, weft_job *job, weft_error *err);

/** Calls `visit` for each job, newest first.
 *  @param state  only these; NULL: all
 *  @param before only ids below it; 0: all
 *  @param limit  at most so many; -1: all */
weft_err weft_job_store_visit(weft_library_db *db, const weft_job_state *state, int64_t before, int limit,
                              weft_err (*visit)(void *context, weft_job *job, weft_error *err), void *context,
                              weft_error *err);
/** The same for those that are queued, oldest first. */
weft_err weft_job_store_visit_queued(weft_library_db *db, int limit,
                                     weft_err (*visit)(void *context, weft_job *job, weft_error *err),
                                     void *context, weft_error *err);

/** queued -> running: one more attempt.  `fresh` is only ever set by the first attempt. */
weft_err weft_job_store_started(weft_library_db *db, int64_t id, int64_t pid, int64_t pid_start, bool fresh,
                                weft_error *err);
/** running or queued -> done, failed, cancelled.  exit_status -1: none; error and result may be NULL. */
weft_err weft_job_store_finished(weft_library_db *db, int64_t id, weft_job_state state, int exit_status,
                                 const char *error, const json_t *result, weft_error *err);
/** running, failed, cancelled -> queued. */
weft_err weft_job_store_requeue(weft_library_db *db, int64_t id, weft_error *err);
/** Removes a job that has ended, with its log. */
weft_err weft_job_store_remove(weft_library_db *db, int64_t id, weft_error *err);

/** Keeps the newest `keep` ended jobs. */
weft_err weft_job_store_trim(weft_library_db *db, int keep, weft_error *err);

/** Adds a line that the job printed on "out" or "err". */
weft_err weft_job_store_log(weft_library_db *db, int64_t id, int line, const char *stream, const char *text,
                            weft_error *err);
/** The lines from `from` on, as a list of {"line","time","stream","text"}; json_decref() it. */
weft_err weft_job_store_read_log(weft_library_db *db, int64_t id, int from, int limit, json_t **lines,
                                 weft_error *err);
/** Number of the next line. */
weft_err weft_job_store_log_end(weft_library_db *db, int64_t id, int *line, weft_error *err);

#endif
