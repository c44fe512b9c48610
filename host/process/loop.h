/** The one loop of the daemon: descriptors and what to call when they are ready (epoll).  One thread. */
#ifndef WEFT_HOST_PROCESS_LOOP_H
#define WEFT_HOST_PROCESS_LOOP_H

#include "core/error.h"

#include <stdint.h>

typedef struct weft_loop weft_loop;

/** @param events  EPOLLIN and so on */
typedef void weft_loop_fn(void *context, uint32_t events);

weft_err weft_loop_create(weft_loop **loop, weft_error *err);
void weft_loop_destroy(weft_loop *loop);

/** Calls `ready` when `fd` has one of `events`.  Level-triggered. */
weft_err weft_loop_watch(weft_loop *loop, int fd, uint32_t events, weft_loop_fn *ready, void *context,
                         weft_error *err);
/** Before the descriptor is closed.  Also from inside a callback, for any descriptor. */
void weft_loop_forget(weft_loop *loop, int fd);

/** Waits at most timeout_ms and calls what is ready. */
void weft_loop_turn(weft_loop *loop, int timeout_ms);

#endif
