/**
 * What happened, for any number of watchers: the last few thousand events, or megabyte of them, in a ring.
 *
 * A watcher holds a position and reads at its own pace; one that falls behind the ring's tail has lost events
 * and is let go.  Nobody is waited for and nothing is kept per watcher.
 *
 * An event's id is "EPOCH-NUMBER"; the epoch counts the starts of the daemon, so that an id of an earlier run
 * is never taken for one of this.
 */
#ifndef WEFT_HOST_DAEMON_EVENTS_H
#define WEFT_HOST_DAEMON_EVENTS_H

#include "core/error.h"

#include <jansson.h>
#include <stdbool.h>
#include <stdint.h>

typedef struct weft_events weft_events;

/** One event as it goes over the wire (Server-Sent Events). */
typedef struct weft_event {
    uint64_t number;
    int64_t job; /* 0: of no job */
    const char *text;
    size_t n;
} weft_event;

weft_err weft_events_create(int64_t epoch, weft_events **events, weft_error *err);
void weft_events_destroy(weft_events *events);

/** Adds an event and releases its data.  Without memory the event is lost, and every watcher with it: they
 * come back and get a snapshot. */
void weft_events_add(weft_events *events, const char *type, int64_t job, json_t *data);

/** The number that the next event will have. */
uint64_t weft_events_end(const weft_events *events);
/** The oldest that is still there. */
uint64_t weft_events_begin(const weft_events *events);
/** Event of a number in [begin, end). */
const weft_event *weft_events_get(const weft_events *events, uint64_t number);

/** The position behind the event of an id; false when it is none of this run or has left the ring. */
bool weft_events_find(const weft_events *events, const char *id, uint64_t *next);

/** An event outside the ring, as text on the heap (weft_free()); releases the data.  `number` is the position
 *  that its id stands for: reading goes on there. */
char *weft_events_format(const weft_events *events, const char *type, uint64_t number, json_t *data,
                         weft_error *err);

#endif
