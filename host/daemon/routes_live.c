/* What the camera sees. */
#include "host/daemon/http_watch.h"

#include <inttypes.h>
#include <stdio.h>
#include <string.h>

enum { MAX_RATE_HZ = 5 };

static enum MHD_Result no_picture(weft_http_request *r)
{
    return weft_reply_problem(r, 404, "no_picture",
                              "no picture yet: they come while a capture or live job runs (POST /v1/jobs)");
}

enum MHD_Result weft_route_live(weft_http_request *r)
{
    const weft_live *const live = r->server->house.live;
    if (!live->latest)
        return no_picture(r);
    json_t *const info = json_deep_copy(live->info);
    if (info)
        json_object_set_new(info, "number", json_integer((json_int_t)live->number));
    return weft_reply_json(r, 200, info);
}

static void release(void *picture)
{
    weft_picture_release(picture);
}

/* Copies on: libmicrohttpd 0.9.75 has no buffer with an owner of its own. */
static ssize_t read_picture(void *context, uint64_t position, char *buffer, size_t room)
{
    const weft_picture *const picture = context;
    const size_t left = position < picture->n ? picture->n - (size_t)position : 0,
                 n = left < room ? left : room;
    if (n == 0)
        return MHD_CONTENT_READER_END_OF_STREAM;
    memcpy(buffer, picture->bytes + position, n);
    return (ssize_t)n;
}

enum MHD_Result weft_route_live_picture(weft_http_request *r)
{
    weft_picture *const latest = r->server->house.live->latest;
    char number[32];
    if (!latest)
        return no_picture(r);
    struct MHD_Response *const response =
        MHD_create_response_from_callback(latest->n, 32768, read_picture, weft_picture_hold(latest), release);
    if (!response) {
        weft_picture_release(latest);
        return MHD_NO;
    }
    snprintf(number, sizeof number, "%" PRIu64, latest->number);
    MHD_add_response_header(response, "Weft-Picture", number);
    return weft_reply(r, 200, response, "image/jpeg");
}

enum MHD_Result weft_route_live_stream(weft_http_request *r)
{
    enum MHD_Result result = MHD_NO;
    int rate = MAX_RATE_HZ;
    if (!weft_http_query_int(r, "rate", 1, MAX_RATE_HZ, &rate, &result))
        return result;
    return weft_watch_pictures(r, rate);
}
