/** Answers that never end: events and pictures for as long as somebody watches. */
#ifndef WEFT_HOST_DAEMON_HTTP_WATCH_H
#define WEFT_HOST_DAEMON_HTTP_WATCH_H

#include "host/daemon/http_private.h"

/** What a watcher of events gets. */
typedef struct weft_watch_options {
    char *first;   /* text before the events, on the heap, taken over; NULL */
    uint64_t next; /* number of the first event */
    int64_t job;   /* only of this job; 0: all */
    bool hold;     /* holds the job: when the watcher goes, the job is cancelled */
} weft_watch_options;

/** Answers with a stream of events. */
enum MHD_Result weft_watch_events(weft_http_request *request, const weft_watch_options *options);

/** Answers with a stream of pictures (multipart/x-mixed-replace), at most max_hz a second. */
enum MHD_Result weft_watch_pictures(weft_http_request *request, double max_hz);

#endif
