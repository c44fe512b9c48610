#include "host/camera/camera_serve.h"

#include "core/log.h"
#include "core/mem.h"
#include "core/version.h"

#include <errno.h>
#include <poll.h>
#include <pthread.h>
#include <signal.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <unistd.h>

typedef struct server {
    const weft_camera_backend *backend;
    void *state; /* NULL: no camera is open */
    int socket;
    weft_camera_message message;
    weft_camera_state info;
    weft_camera_settings wanted;
    weft_captured_frame frame;
    bool armed; /* told for the exposure under way */
    int counts[WEFT_N_CALLS];
    const char *faults;
} server;

static atomic_bool leaving;

/* A library that hangs cannot keep the process alive when the program is gone. */
static void *watch(void *context)
{
    struct pollfd end = {.fd = *(const int *)context, .events = 0};
    for (;;)
        if (poll(&end, 1, -1) > 0 && (end.revents & (POLLHUP | POLLERR | POLLNVAL))) {
            if (!atomic_load(&leaving))
                _exit(4);
            return NULL;
        }
}

/* ---- misbehaving on purpose ---- */

static void misbehave(server *s, weft_camera_deed deed)
{
    weft_camera_message stray = {.call = WEFT_CALL_CONFIGURE, .number = s->message.number + 7};
    switch (deed) {
    case WEFT_DEED_CRASH:
        signal(SIGSEGV, SIG_DFL); /* a sanitizer's handler would call it something else */
        raise(SIGSEGV);
        break;
    case WEFT_DEED_EXIT:
        _exit(9);
    case WEFT_DEED_HANG:
        for (;;)
            pause();
    case WEFT_DEED_GARBAGE:
        weft_camera_message_send(s->socket, &(weft_camera_message){.call = 0xdeadbeef, .number = 1}, 40, -1);
        break;
    case WEFT_DEED_STRAY:
        weft_camera_message_send(s->socket, &stray, sizeof stray.body.state, -1);
        break;
    case WEFT_DEED_LOOSE:
    case WEFT_DEED_SHORT:
    case WEFT_DEED_NONE:
        break;
    }
}

/* ---- answering ---- */

static bool answer(server *s, weft_err status, const weft_error *error, size_t body_size, int fd)
{
    weft_camera_message *const m = &s->message;
    m->status = (int32_t)status;
    if (status != WEFT_OK) {
        m->body.error = *error;
        if (!m->body.error.text[0])
            snprintf(m->body.error.text, sizeof m->body.error.text, "%s", weft_err_text(status));
        body_size = sizeof m->body.error;
    }
    return weft_camera_message_send(s->socket, m, body_size, fd);
}

static bool say_hello(server *s)
{
    weft_camera_hello *const h = &s->message.body.hello;
    s->message.call = WEFT_CALL_HELLO;
    *h = (weft_camera_hello){.version = WEFT_CAMERA_MESSAGE_VERSION, .message_size = sizeof s->message};
    snprintf(h->build, sizeof h->build, "%s", WEFT_VERSION);
    snprintf(h->backend, sizeof h->backend, "%s", s->backend->name);
    return answer(s, WEFT_OK, NULL, sizeof *h, -1);
}

static weft_err list(server *s, size_t *body_size, weft_error *err)
{
    int n = 0;
    WEFT_TRY(s->backend->list(s->message.body.list.found, WEFT_CAMERA_MESSAGE_MAX_FOUND, &n, err));
    s->message.body.list.n = n;
    *body_size = offsetof(weft_camera_message, body.list.found) - offsetof(weft_camera_message, body) +
                 (size_t)n * sizeof(weft_camera_found);
    return WEFT_OK;
}

static void close_camera(server *s)
{
    if (s->state)
        s->backend->close(s->state);
    weft_free(s->state);
    s->state = NULL;
}

static weft_err open_camera(server *s, size_t *body_size, weft_error *err)
{
    char address[sizeof s->message.body.address];
    memcpy(address, s->message.body.address, sizeof address);
    address[sizeof address - 1] = '\0';
    close_camera(s);
    s->info = (weft_camera_state){0};
    s->state = weft_alloc(1, s->backend->state_size, err);
    if (!s->state)
        return WEFT_ERR_NOMEM;
    const weft_err status = s->backend->open(s->state, address, &s->info, err);
    if (status != WEFT_OK)
        close_camera(s);
    s->message.body.state = s->info;
    *body_size = sizeof s->info;
    return status;
}

static weft_err need_camera(const server *s, weft_error *err)
{
    return s->state ? WEFT_OK : weft_fail(err, WEFT_ERR_PROTOCOL, "no camera is open");
}

static weft_err configure(server *s, size_t *body_size, weft_error *err)
{
    WEFT_TRY(need_camera(s, err));
    s->wanted = s->message.body.wanted;
    WEFT_TRY(s->backend->configure(s->state, &s->wanted, &s->info, err));
    s->message.body.state = s->info;
    *body_size = sizeof s->info;
    return WEFT_OK;
}

/* Called by the backend while it waits for a frame. */
static weft_err on_idle(void *context, weft_error *err)
{
    server *const s = context;
    weft_camera_message m = {.call = WEFT_CALL_ARMED, .number = s->message.number};
    int fd = -1;
    if (!s->armed && s->wanted.trigger == WEFT_TRIGGER_WIRE)
        weft_camera_message_send(s->socket, &m, 0, -1);
    s->armed = true;
    const weft_camera_receipt got = weft_camera_message_receive(s->socket, 0, &m, &fd);
    if (fd >= 0)
        close(fd);
    if (got == WEFT_RECEIPT_NOTHING)
        return WEFT_OK;
    return weft_fail(err, WEFT_ERR_CANCELLED, "cancelled");
}

/* The samples in shared memory, or -1. */
static int share_frame(const server *s, weft_camera_deed deed)
{
    const weft_mosaic *const m = &s->frame.mosaic;
    const size_t bytes = sizeof *m->data * (size_t)m->width * (size_t)m->height;
    if (deed == WEFT_DEED_LOOSE) {
        const int fd = memfd_create("weft-loose", MFD_CLOEXEC | MFD_ALLOW_SEALING);
        if (fd >= 0 && ftruncate(fd, (off_t)bytes) != 0)
            errno = EIO; /* it is refused all the same */
        return fd;
    }
    return weft_camera_sealed_memory(m->data, deed == WEFT_DEED_SHORT ? bytes / 2 : bytes,
                                     s->frame.file.bytes, s->frame.file.size);
}

static weft_err expose(server *s, weft_camera_deed deed, size_t *body_size, int *fd, weft_error *err)
{
    const double deadline_s = s->message.body.deadline_s;
    WEFT_TRY(need_camera(s, err));
    s->armed = false;
    WEFT_TRY(s->backend->expose(s->state, deadline_s, on_idle, s, &s->frame, err));
    if (s->frame.status == WEFT_FRAME_COMPLETE) {
        *fd = share_frame(s, deed);
        if (*fd < 0)
            return weft_fail_errno(err, WEFT_ERR_NOMEM, "no shared memory for a frame");
    }
    s->message.body.frame = s->frame;
    s->message.body.frame.mosaic.data = NULL;
    s->message.body.frame.file.bytes = NULL;
    *body_size = sizeof s->frame;
    return WEFT_OK;
}

/* Obeys the request in s->message.  False when it is time to go. */
static bool obey(server *s)
{
    const weft_camera_call call = (weft_camera_call)s->message.call;
    const weft_camera_deed deed = weft_camera_deed_for(s->faults, call, ++s->counts[call]);
    weft_error error = {0};
    size_t body_size = 0;
    weft_err status = WEFT_OK;
    int fd = -1;
    misbehave(s, deed);
    switch (call) {
    case WEFT_CALL_LIST:
        status = list(s, &body_size, &error);
        break;
    case WEFT_CALL_OPEN:
        status = open_camera(s, &body_size, &error);
        break;
    case WEFT_CALL_CONFIGURE:
        status = configure(s, &body_size, &error);
        break;
    case WEFT_CALL_EXPOSE:
        status = expose(s, deed, &body_size, &fd, &error);
        break;
    case WEFT_CALL_CLOSE:
        close_camera(s);
        break;
    case WEFT_CALL_CANCEL: /* came after the answer: there is nothing to cancel */
        return true;
    case WEFT_CALL_HELLO:
    case WEFT_CALL_ARMED:
    case WEFT_N_CALLS:
        status = weft_fail(&error, WEFT_ERR_PROTOCOL, "%s is no request", weft_camera_call_name(call));
        break;
    }
    if (call == WEFT_CALL_CLOSE)
        atomic_store(&leaving, true); /* before the other end hears that it may hang up */
    const bool answered = answer(s, status, &error, body_size, fd);
    if (fd >= 0)
        close(fd);
    return answered && call != WEFT_CALL_CLOSE;
}

int weft_camera_serve(const weft_camera_backend *backend, int socket)
{
    server *const s = weft_alloc(1, sizeof *s, NULL);
    pthread_t watcher;
    if (!s)
        return 1;
    *s = (server){.backend = backend, .socket = socket, .faults = getenv("WEFT_CAMERA_FAULT")};
    misbehave(s, weft_camera_deed_for(s->faults, WEFT_CALL_HELLO, 1));
    if (pthread_create(&watcher, NULL, watch, &s->socket) != 0 || !say_hello(s)) {
        weft_free(s);
        return 1;
    }
    for (;;) {
        int fd = -1;
        const weft_camera_receipt got = weft_camera_message_receive(socket, -1, &s->message, &fd);
        if (fd >= 0)
            close(fd);
        if (got == WEFT_RECEIPT_NOTHING)
            continue;
        if (got != WEFT_RECEIPT_MESSAGE || !obey(s))
            break;
    }
    const bool in_order = atomic_load(&leaving);
    close_camera(s);
    weft_captured_frame_fini(&s->frame);
    pthread_join(watcher, NULL); /* until the program has hung up */
    weft_free(s);
    return in_order ? 0 : 1;
}
