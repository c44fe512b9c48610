#include "host/daemon/live.h"

#include "core/mem.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

/* Larger than any picture that a job makes. */
#define MAX_BYTES ((size_t)8 << 20)

weft_picture *weft_picture_hold(weft_picture *picture)
{
    picture->holders++;
    return picture;
}

void weft_picture_release(weft_picture *picture)
{
    if (picture && --picture->holders == 0)
        weft_free(picture);
}

/* What is sealed cannot shrink while it is read. */
static weft_err check_sealed(int memfd, size_t *n, weft_error *err)
{
    struct stat s;
    const int seals = fcntl(memfd, F_GET_SEALS);
    if (seals < 0 || (seals & (F_SEAL_WRITE | F_SEAL_SHRINK)) != (F_SEAL_WRITE | F_SEAL_SHRINK) ||
        fstat(memfd, &s) != 0 || s.st_size < 4 || (uint64_t)s.st_size > MAX_BYTES)
        return weft_fail(err, WEFT_ERR_FORMAT, "a job sent a picture that is none");
    *n = (size_t)s.st_size;
    return WEFT_OK;
}

weft_err weft_live_take(weft_live *live, const json_t *info, int memfd, weft_error *err)
{
    size_t n = 0;
    WEFT_TRY(check_sealed(memfd, &n, err));
    weft_picture *const picture = weft_alloc(1, sizeof *picture + n, err);
    if (!picture)
        return WEFT_ERR_NOMEM;
    if (pread(memfd, picture->bytes, n, 0) != (ssize_t)n) {
        weft_free(picture);
        return weft_fail_errno(err, WEFT_ERR_IO, "a job's picture cannot be read");
    }
    picture->n = n;
    picture->holders = 1;
    picture->number = ++live->number;
    weft_picture_release(live->latest);
    live->latest = picture;
    json_decref(live->info);
    live->info = json_deep_copy(info);
    return WEFT_OK;
}

void weft_live_fini(weft_live *live)
{
    weft_picture_release(live->latest);
    json_decref(live->info);
    *live = (weft_live){0};
}
