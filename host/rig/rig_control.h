/**
 * The control socket of the virtual scanner: a Unix stream socket, one line of text in, one line of JSON out.
 *
 * One thread: weft_rig_control_run() waits for lines and signals and does what they say.
 */
#ifndef WEFT_HOST_RIG_RIG_CONTROL_H
#define WEFT_HOST_RIG_RIG_CONTROL_H

#include "core/error.h"

#include <jansson.h>
#include <stdbool.h>

typedef struct weft_rig_control weft_rig_control;

/** Obeys one line.  @return the reply, {"ok": ...}; *quit is set to end the run */
typedef json_t *weft_rig_obey_fn(void *context, const char *line, bool *quit);

/** Opens the socket.  A socket that nobody answers any more is replaced.
 *  @return WEFT_ERR_EXISTS when another rig answers there, WEFT_ERR_IO, WEFT_ERR_USAGE for too long a path */
weft_err weft_rig_control_create(const char *path, weft_rig_control **control, weft_error *err);
/** Closes and removes the socket. */
void weft_rig_control_destroy(weft_rig_control *control);

/** Serves clients until `obey` says quit (WEFT_OK), SIGINT or SIGTERM come (WEFT_OK), or `alive` returns
 *  false (WEFT_ERR_DEVICE), which is asked every half second. */
weft_err weft_rig_control_run(weft_rig_control *control, weft_rig_obey_fn *obey, bool (*alive)(void *context),
                              void *context, weft_error *err);

/** The client: sends one line to the socket and waits for the reply, at most timeout_s.
 *  @return WEFT_ERR_DEVICE when no rig answers, WEFT_ERR_TIMEOUT, WEFT_ERR_PROTOCOL */
weft_err weft_rig_control_tell(const char *path, const char *line, double timeout_s, json_t **reply,
                               weft_error *err);

#endif
