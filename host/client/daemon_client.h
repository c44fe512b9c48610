/**
 * Talking to the daemon: HTTP/1.0 on its Unix socket, so that a reply is what comes until the end.
 */
#ifndef WEFT_HOST_CLIENT_DAEMON_CLIENT_H
#define WEFT_HOST_CLIENT_DAEMON_CLIENT_H

#include "core/error.h"

#include <jansson.h>
#include <stdbool.h>

/** Whether a daemon answers, and on which socket: $WEFT_SOCKET ("none" or empty: no daemon is asked for),
 * else the usual place.  One that is named and does not answer is given a second: it may be starting.
 * @return WEFT_ERR_DEVICE when WEFT_SOCKET names one that does not answer */
weft_err weft_daemon_find(char socket[108], bool *found, weft_error *err);

/** One request and its reply; json_decref() it.
 *  @param body  NULL: none
 *  @return WEFT_ERR_DEVICE when the daemon cannot be reached, WEFT_ERR_PROTOCOL for what is no reply; a
 * refusal (400 and above) is the daemon's own sentence with WEFT_ERR_USAGE, _MISSING, _EXISTS or _IO */
weft_err weft_daemon_call(const char *socket, const char *method, const char *path, const json_t *body,
                          json_t **reply, weft_error *err);

/** One event; *end stops. */
typedef weft_err weft_daemon_event_fn(void *context, const char *type, const json_t *data, bool *end,
                                      weft_error *err);

/** Watches /v1/events with this query ("?job=3").  `idle` is called ten times a second.
 *  @return WEFT_ERR_DEVICE when the stream ends before `*end`; what the callbacks return */
weft_err weft_daemon_watch(const char *socket, const char *query, weft_daemon_event_fn *event,
                           weft_err (*idle)(void *context, weft_error *err), void *context, weft_error *err);

#endif
