/**
 * The process that a job runs in: `weft COMMAND ...`, a child of the daemon.
 *
 * It dies with the daemon, whatever kills that (PR_SET_PDEATHSIG); it is the head of its own process group,
 * so that ending it ends what it has started; and it does nothing before weft_child_go(), so that the daemon
 * can write down that it runs.  One thread.
 */
#ifndef WEFT_HOST_PROCESS_CHILD_H
#define WEFT_HOST_PROCESS_CHILD_H

#include "core/error.h"
#include "host/process/loop.h"

#include <jansson.h>
#include <stdbool.h>
#include <stdint.h>
#include <sys/types.h>

/** What the owner hears.  From inside weft_loop_turn(). */
typedef struct weft_child_ears {
    /* A line on stream "out" or "err", valid UTF-8, without newline. */
    void (*line)(void *context, const char *stream, const char *text);
    /* A message of core/report_channel.h, lent; `picture` is a sealed memfd of the owner's, or -1. */
    void (*report)(void *context, json_t *message, int picture);
    /* It has ended and everything it said has been heard; `status` as of waitpid().  The child may be
     * destroyed. */
    void (*end)(void *context, int status);
    void *context;
} weft_child_ears;

typedef struct weft_child weft_child;

/** Starts `program` with these words (ends with NULL; the first is the program's name), waiting for go.
 *  @param nice  niceness to add */
weft_err weft_child_start(weft_loop *loop, const char *program, char *const *words, int nice,
                          const weft_child_ears *ears, weft_child **child, weft_error *err);
void weft_child_go(weft_child *child);
/** Kills it if it still runs, with its group, and frees. */
void weft_child_destroy(weft_child *child);

pid_t weft_child_pid(const weft_child *child);
/** When the process began, in the kernel's clock: with the number it names one process for good. */
int64_t weft_child_start_time(const weft_child *child);
/** Sends a signal to the process (not to its group). */
void weft_child_signal(const weft_child *child, int number);
/** SIGKILL to the whole group. */
void weft_child_kill(const weft_child *child);

/** Kills the group of a process of an earlier daemon if it is still that process, and waits until it is gone
 *  (two seconds at most).  @return whether there was one */
bool weft_child_kill_stray(int64_t pid, int64_t start_time);

#endif
