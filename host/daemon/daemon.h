/** weftd: the options of its command line and its life. */
#ifndef WEFT_HOST_DAEMON_DAEMON_H
#define WEFT_HOST_DAEMON_DAEMON_H

#include "core/error.h"
#include "core/fields.h"

#include <stdbool.h>

typedef struct weft_daemon_options {
    const char *library, *socket, *group, *listen, *token, *certificate, *key;
    weft_texts hosts;
    int cpu_jobs;
    const char *rig, *port, *camera;
    bool quiet, verbose, help, version;
} weft_daemon_options;

/** Ends with {0}. */
extern const weft_field weft_daemon_fields[];
/** For --help and the manual: one line, paragraphs, lines to type. */
extern const char weft_daemon_summary[], weft_daemon_details[], weft_daemon_example[];

/** Serves until SIGTERM or SIGINT.  @return WEFT_OK when it was asked to end */
weft_err weft_daemon_run(const weft_daemon_options *options, weft_error *err);

#endif
