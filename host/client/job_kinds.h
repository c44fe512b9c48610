/**
 * Which commands can be jobs of the daemon, and what it must know of each: whether it needs the scanner,
 * which of its options are paths, whether it can go on after an interruption.
 *
 * A new command becomes a job by a row here.  A test goes over every option of every row that takes a text
 * and fails unless the row says what the text is.
 */
#ifndef WEFT_HOST_CLIENT_JOB_KINDS_H
#define WEFT_HOST_CLIENT_JOB_KINDS_H

#include <stdbool.h>
#include <stddef.h>

typedef struct weft_job_kind {
    const char *command; /* "calibrate lens" */
    bool hardware; /* opens the camera or the controller: one of these at a time, and `weft` sends it here */
    bool resumes;  /* has --resume */
    bool by_hand;  /* lasts as long as somebody holds it: is not run again after an interruption */
    const char *reads;  /* options that name what it reads, "a|b"; "*" stands for the operands; NULL none */
    const char *writes; /* the same of what it makes */
    const char *texts;  /* options with a text that is no path */
    const char *never;  /* options that a job does not have: they would do what the daemon does not know of */
    bool in_library;    /* its option --library is the daemon's, when the request names none */
} weft_job_kind;

/** Ends with a row whose command is NULL. */
extern const weft_job_kind weft_job_kinds[];

/** The row of a command; NULL when it cannot be a job. */
const weft_job_kind *weft_job_kind_find(const char *command);

/** Whether "a|b|c" has the word; false for NULL. */
bool weft_job_kind_lists(const char *list, const char *word);

/** Whether the row says that the option is a path. */
bool weft_job_kind_is_path(const weft_job_kind *kind, const char *option);

/** --rig, --port, --camera: the devices, which the daemon knows best. */
bool weft_job_kind_is_device(const char *option);

#endif
