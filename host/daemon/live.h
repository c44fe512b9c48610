/** The latest picture of the camera, as the job that owns it reports it; for any number of watchers. */
#ifndef WEFT_HOST_DAEMON_LIVE_H
#define WEFT_HOST_DAEMON_LIVE_H

#include "core/error.h"

#include <jansson.h>
#include <stddef.h>
#include <stdint.h>

/** A JPEG that several watchers may be sending: whoever keeps one holds it. */
typedef struct weft_picture {
    int holders;
    uint64_t number; /* counts the pictures of this daemon, from 1 */
    size_t n;
    unsigned char bytes[];
} weft_picture;

typedef struct weft_live {
    weft_picture *latest; /* NULL: none yet */
    json_t *info;         /* of the latest: name, size, statistics, histogram */
    uint64_t number;
} weft_live;

/** Takes a picture from a sealed memfd, which stays the caller's.  @return WEFT_ERR_FORMAT when it is none */
weft_err weft_live_take(weft_live *live, const json_t *info, int memfd, weft_error *err);
void weft_live_fini(weft_live *live);

weft_picture *weft_picture_hold(weft_picture *picture);
/** NULL is fine. */
void weft_picture_release(weft_picture *picture);

#endif
