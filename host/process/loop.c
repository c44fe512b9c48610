#include "host/process/loop.h"

#include "core/mem.h"

#include <sys/epoll.h>
#include <unistd.h>

enum { MAX_WATCHED = 128, MAX_READY = 32 };

typedef struct watched {
    int fd; /* -1: free */
    weft_loop_fn *ready;
    void *context;
    uint32_t turn; /* counts the users of this row: events for an earlier one are stale */
} watched;

struct weft_loop {
    int epoll;
    watched rows[MAX_WATCHED];
};

weft_err weft_loop_create(weft_loop **loop, weft_error *err)
{
    weft_loop *const l = weft_alloc(1, sizeof *l, err);
    if (!l)
        return WEFT_ERR_NOMEM;
    for (int i = 0; i < MAX_WATCHED; i++)
        l->rows[i].fd = -1;
    l->epoll = epoll_create1(EPOLL_CLOEXEC);
    if (l->epoll < 0) {
        weft_free(l);
        return weft_fail_errno(err, WEFT_ERR_IO, "no epoll descriptor");
    }
    *loop = l;
    return WEFT_OK;
}

void weft_loop_destroy(weft_loop *loop)
{
    if (!loop)
        return;
    close(loop->epoll);
    weft_free(loop);
}

weft_err weft_loop_watch(weft_loop *loop, int fd, uint32_t events, weft_loop_fn *ready, void *context,
                         weft_error *err)
{
    int i = 0;
    while (i < MAX_WATCHED && loop->rows[i].fd >= 0)
        i++;
    if (i == MAX_WATCHED)
        return weft_fail(err, WEFT_ERR_RANGE, "more than %d descriptors to watch", MAX_WATCHED);
    watched *const row = &loop->rows[i];
    struct epoll_event event = {.events = events, .data.u64 = (uint64_t)(row->turn + 1) << 32 | (uint32_t)i};
    if (epoll_ctl(loop->epoll, EPOLL_CTL_ADD, fd, &event) != 0)
        return weft_fail_errno(err, WEFT_ERR_IO, "descriptor %d cannot be watched", fd);
    *row = (watched){.fd = fd, .ready = ready, .context = context, .turn = row->turn + 1};
    return WEFT_OK;
}

void weft_loop_forget(weft_loop *loop, int fd)
{
    for (int i = 0; i < MAX_WATCHED; i++)
        if (loop->rows[i].fd == fd) {
            (void)epoll_ctl(loop->epoll, EPOLL_CTL_DEL, fd, NULL);
            loop->rows[i].fd = -1;
        }
}

void weft_loop_turn(weft_loop *loop, int timeout_ms)
{
    struct epoll_event ready[MAX_READY];
    const int n = epoll_wait(loop->epoll, ready, MAX_READY, timeout_ms);
    for (int i = 0; i < n; i++) {
        const watched *const row = &loop->rows[(uint32_t)ready[i].data.u64];
        if (row->fd >= 0 && row->turn == (uint32_t)(ready[i].data.u64 >> 32))
            row->ready(row->context, ready[i].events);
    }
}
