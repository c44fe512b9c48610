#include "host/daemon/events.h"

#include "core/mem.h"
#include "core/text.h"

#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { RING = 4096 };
#define RING_BYTES ((size_t)1 << 20)

struct weft_events {
    int64_t epoch;
    uint64_t begin, end;
    size_t bytes;
    weft_event ring[RING];
};

weft_err weft_events_create(int64_t epoch, weft_events **events, weft_error *err)
{
    *events = weft_alloc(1, sizeof **events, err);
    if (!*events)
        return WEFT_ERR_NOMEM;
    (*events)->epoch = epoch;
    (*events)->begin = (*events)->end = 1; /* an id with number 0 is "before the first" */
    return WEFT_OK;
}

static void drop_oldest(weft_events *e)
{
    weft_event *const oldest = &e->ring[e->begin++ % RING];
    e->bytes -= oldest->n;
    weft_free((char *)(uintptr_t)oldest->text);
    *oldest = (weft_event){0};
}

void weft_events_destroy(weft_events *events)
{
    if (!events)
        return;
    while (events->begin < events->end)
        drop_oldest(events);
    weft_free(events);
}

char *weft_events_format(const weft_events *events, const char *type, uint64_t number, json_t *data,
                         weft_error *err)
{
    char *const json = data ? json_dumps(data, JSON_COMPACT | JSON_REAL_PRECISION(9)) : NULL; /* one line */
    char *const text = json ? weft_asprintf(err, "id: %" PRId64 "-%" PRIu64 "\nevent: %s\ndata: %s\n\n",
                                            events->epoch, number, type, json)
                            : NULL;
    if (!json)
        weft_fail(err, WEFT_ERR_NOMEM, "out of memory for an event");
    json_decref(data);
    free(json);
    return text;
}

void weft_events_add(weft_events *e, const char *type, int64_t job, json_t *data)
{
    char *const text = weft_events_format(e, type, e->end, data, NULL);
    if (!text) {
        while (e->begin < e->end)
            drop_oldest(e);
        e->begin = ++e->end;
        return;
    }
    const size_t n = strlen(text);
    while (e->begin < e->end && (e->end - e->begin == RING || e->bytes + n > RING_BYTES))
        drop_oldest(e);
    e->ring[e->end % RING] = (weft_event){.number = e->end, .job = job, .text = text, .n = n};
    e->bytes += n;
    e->end++;
}

uint64_t weft_events_end(const weft_events *events)
{
    return events->end;
}

uint64_t weft_events_begin(const weft_events *events)
{
    return events->begin;
}

const weft_event *weft_events_get(const weft_events *events, uint64_t number)
{
    return number >= events->begin && number < events->end ? &events->ring[number % RING] : NULL;
}

bool weft_events_find(const weft_events *events, const char *id, uint64_t *next)
{
    int epoch, number; /* more than two milliards of events are not resumed at */
    char text[64];
    snprintf(text, sizeof text, "%s", id);
    char *const dash = strchr(text, '-');
    if (!dash)
        return false;
    *dash = '\0';
    if (!weft_text_to_int(text, &epoch) || !weft_text_to_int(dash + 1, &number) || number < 0)
        return false;
    *next = (uint64_t)number + 1;
    return epoch == events->epoch && *next >= events->begin && *next <= events->end;
}
