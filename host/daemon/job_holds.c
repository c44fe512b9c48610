#include "host/daemon/job_holds.h"

#include <stddef.h>

/* The row of a job, or with id 0 a free one; NULL: there is none. */
static const weft_job_hold *find(const weft_job_holds *holds, int64_t id)
{
    for (int i = 0; i < WEFT_JOB_HOLDS_MAX; i++)
        if (holds->rows[i].id == id)
            return &holds->rows[i];
    return NULL;
}

static weft_job_hold *find_to_change(weft_job_holds *holds, int64_t id)
{
    const weft_job_hold *const row = find(holds, id);
    return row ? &holds->rows[row - holds->rows] : NULL;
}

bool weft_job_holds_have_room(const weft_job_holds *holds)
{
    return find(holds, 0) != NULL;
}

void weft_job_holds_expect(weft_job_holds *holds, int64_t id, double now_s)
{
    weft_job_hold *const row = find_to_change(holds, 0);
    if (row)
        *row = (weft_job_hold){.id = id, .since_s = now_s};
}

bool weft_job_holds_wait(const weft_job_holds *holds, int64_t id)
{
    const weft_job_hold *const row = id > 0 ? find(holds, id) : NULL;
    return row && row->holders == 0;
}

int weft_job_holds_change(weft_job_holds *holds, int64_t id, bool hold)
{
    weft_job_hold *const row = id > 0 ? find_to_change(holds, id) : NULL;
    if (!row)
        return -1;
    row->holders += hold ? 1 : -1;
    const int left = row->holders > 0 ? row->holders : 0;
    if (left == 0)
        *row = (weft_job_hold){0};
    return left;
}

void weft_job_holds_drop(weft_job_holds *holds, int64_t id)
{
    weft_job_hold *const row = id > 0 ? find_to_change(holds, id) : NULL;
    if (row)
        *row = (weft_job_hold){0};
}

int64_t weft_job_holds_take_forgotten(weft_job_holds *holds, double now_s, double patience_s)
{
    for (int i = 0; i < WEFT_JOB_HOLDS_MAX; i++) {
        const weft_job_hold row = holds->rows[i];
        if (row.id && row.holders == 0 && now_s - row.since_s > patience_s) {
            holds->rows[i] = (weft_job_hold){0};
            return row.id;
        }
    }
    return 0;
}
