#include "host/client/daemon_client.h"

#include "core/mem.h"
#include "core/progress.h"
#include "core/text.h"
#include "core/unix_socket.h"
#include "host/client/daemon_socket.h"

#include <errno.h>
#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

/* A daemon that writes to a slow disk is given so long. */
#define CALL_TIMEOUT_S 30.0
/* For a daemon that was named and is just starting, or starting again. */
#define START_S     1.0
#define REPLY_LIMIT ((size_t)64 << 20)

weft_err weft_daemon_find(char path[108], bool *found, weft_error *err)
{
    const char *const named = getenv("WEFT_SOCKET");
    *found = false;
    if (named && (named[0] == '\0' || strcmp(named, "none") == 0))
        return WEFT_OK;
    if (named && strlen(named) >= 108)
        return weft_fail(err, WEFT_ERR_USAGE, "WEFT_SOCKET: the path of a socket has at most 107 bytes");
    if (named)
        snprintf(path, 108, "%s", named);
    else
        weft_daemon_default_socket(path);
    const double begin_s = weft_clock_s();
    int fd = weft_unix_socket_connect(path);
    while (fd < 0 && named && weft_clock_s() - begin_s < START_S) {
        usleep(50000);
        fd = weft_unix_socket_connect(path);
    }
    if (fd < 0 && named)
        return weft_fail_errno(
            err, WEFT_ERR_DEVICE,
            "%s: no daemon answers; start weftd, or set WEFT_SOCKET=none to use the devices directly", path);
    *found = fd >= 0;
    if (fd >= 0)
        close(fd);
    return WEFT_OK;
}

/* ---- bytes ---- */

typedef struct stream {
    int fd;
    size_t used, at; /* bytes in the buffer, and of those taken */
    char bytes[16384];
} stream;

/* More bytes, within timeout_s; *n 0 at the end. */
static weft_err fill(stream *s, double timeout_s, bool *waiting, weft_error *err)
{
    struct pollfd in = {.fd = s->fd, .events = POLLIN};
    *waiting = false;
    s->at = s->used = 0;
    if (poll(&in, 1, (int)(1e3 * timeout_s)) <= 0) {
        *waiting = true;
        return WEFT_OK;
    }
    const ssize_t n = recv(s->fd, s->bytes, sizeof s->bytes, 0);
    if (n < 0 && errno == EINTR)
        *waiting = true;
    else if (n < 0)
        return weft_fail_errno(err, WEFT_ERR_DEVICE, "the daemon hung up");
    else
        s->used = (size_t)n;
    return WEFT_OK;
}

static weft_err send_request(int fd, const char *method, const char *path, const json_t *body,
                             weft_error *err)
{
    char *const json = body ? json_dumps(body, JSON_COMPACT | JSON_REAL_PRECISION(17)) : NULL;
    char *const text = weft_asprintf(err,
                                     "%s %s HTTP/1.0\r\nHost: localhost\r\nContent-Type: application/json\r\n"
                                     "Content-Length: %zu\r\n\r\n%s",
                                     method, path, json ? strlen(json) : 0, json ? json : "");
    free(json);
    if (!text)
        return WEFT_ERR_NOMEM;
    const size_t n = strlen(text);
    const ssize_t sent = send(fd, text, n, MSG_NOSIGNAL);
    weft_free(text);
    return sent == (ssize_t)n ? WEFT_OK
                              : weft_fail_errno(err, WEFT_ERR_DEVICE, "the daemon does not take the request");
}

/* A buffer that grows. */
typedef struct text {
    char *bytes;
    size_t n, room;
} text;

static weft_err append(text *t, const char *bytes, size_t n, weft_error *err)
{
    if (n == 0)
        return WEFT_OK;
    if (t->n + n + 1 > REPLY_LIMIT)
        return weft_fail(err, WEFT_ERR_PROTOCOL, "the daemon's reply has no end");
    if (!t->bytes || t->n + n + 1 > t->room) {
        const size_t room = 2 * (t->n + n + 1);
        char *const grown = weft_realloc(t->bytes, room, 1, err);
        if (!grown)
            return WEFT_ERR_NOMEM;
        t->bytes = grown;
        t->room = room;
    }
    memcpy(t->bytes + t->n, bytes, n);
    t->n += n;
    t->bytes[t->n] = '\0';
    return WEFT_OK;
}

static weft_err read_all(int fd, text *reply, weft_error *err)
{
    stream s = {.fd = fd};
    const double deadline_s = weft_clock_s() + CALL_TIMEOUT_S;
    for (;;) {
        bool waiting;
        WEFT_TRY(fill(&s, 0.1, &waiting, err));
        if (waiting && weft_clock_s() > deadline_s)
            return weft_fail(err, WEFT_ERR_TIMEOUT, "the daemon does not answer within %g s", CALL_TIMEOUT_S);
        if (!waiting && s.used == 0)
            return WEFT_OK;
        WEFT_TRY(append(reply, s.bytes, s.used, err));
    }
}

/* The daemon's own sentence. */
static weft_err refused(int status, const json_t *reply, weft_error *err)
{
    const char *const message =
        json_string_value(json_object_get(json_object_get(reply, "error"), "message"));
    const weft_err code = status == 404                   ? WEFT_ERR_MISSING
                          : status == 409                 ? WEFT_ERR_EXISTS
                          : status >= 400 && status < 500 ? WEFT_ERR_USAGE
                                                          : WEFT_ERR_IO;
    return weft_fail(err, code, "%s", message ? message : "the daemon refuses without a word");
}

static weft_err understand(const text *raw, json_t **reply, weft_error *err)
{
    int status = 0;
    const char *const body = raw->bytes ? strstr(raw->bytes, "\r\n\r\n") : NULL;
    char digits[4] = "";
    if (body && strncmp(raw->bytes, "HTTP/1.", 7) == 0)
        snprintf(digits, sizeof digits, "%.3s", raw->bytes + 9);
    json_t *const value = weft_text_to_int(digits, &status) ? json_loads(body + 4, 0, NULL) : NULL;
    if (!value)
        return weft_fail(err, WEFT_ERR_PROTOCOL, "what answers there is no weftd");
    if (status >= 400) {
        const weft_err code = refused(status, value, err);
        json_decref(value);
        return code;
    }
    *reply = value;
    return WEFT_OK;
}

weft_err weft_daemon_call(const char *path_of_socket, const char *method, const char *path,
                          const json_t *body, json_t **reply, weft_error *err)
{
    text raw = {0};
    const int fd = weft_unix_socket_connect(path_of_socket);
    if (fd < 0)
        return weft_fail_errno(err, WEFT_ERR_DEVICE, "%s: the daemon does not answer", path_of_socket);
    weft_err status = send_request(fd, method, path, body, err);
    if (status == WEFT_OK)
        status = read_all(fd, &raw, err);
    if (status == WEFT_OK)
        status = understand(&raw, reply, err);
    close(fd);
    weft_free(raw.bytes);
    return status;
}

/* ---- events ---- */

typedef struct event_reader {
    weft_daemon_event_fn *event;
    void *context;
    text line, data;
    char type[32];
    int n_lines; /* of the head; -1 behind it */
    bool good, end;
} event_reader;

static weft_err end_of_event(event_reader *r, weft_error *err)
{
    weft_err status = WEFT_OK;
    json_t *const data = r->data.n > 0 ? json_loadb(r->data.bytes, r->data.n, JSON_DECODE_ANY, NULL) : NULL;
    if (data && r->type[0])
        status = r->event(r->context, r->type, data, &r->end, err);
    json_decref(data);
    r->data.n = 0;
    r->type[0] = '\0';
    return status;
}

static weft_err take_line(event_reader *r, weft_error *err)
{
    const char *const line = r->line.bytes ? r->line.bytes : "";
    if (r->n_lines >= 0) {
        if (r->n_lines++ == 0)
            r->good = strncmp(line, "HTTP/1.", 7) == 0 && strncmp(line + 8, " 200", 4) == 0;
        if (r->line.n == 0)
            r->n_lines = -1;
        return WEFT_OK;
    }
    if (r->line.n == 0)
        return end_of_event(r, err);
    if (strncmp(line, "event: ", 7) == 0)
        snprintf(r->type, sizeof r->type, "%s", line + 7);
    else if (strncmp(line, "data: ", 6) == 0)
        return append(&r->data, line + 6, r->line.n - 6, err);
    return WEFT_OK;
}

static weft_err take_bytes(event_reader *r, const char *bytes, size_t n, weft_error *err)
{
    for (size_t i = 0; i < n && !r->end; i++) {
        if (bytes[i] != '\n') {
            if (bytes[i] != '\r')
                WEFT_TRY(append(&r->line, bytes + i, 1, err));
            continue;
        }
        WEFT_TRY(take_line(r, err));
        r->line.n = 0;
        if (r->line.bytes)
            r->line.bytes[0] = '\0';
    }
    return WEFT_OK;
}

static weft_err read_events(int fd, event_reader *r, weft_err (*idle)(void *context, weft_error *err),
                            weft_error *err)
{
    stream s = {.fd = fd};
    while (!r->end) {
        bool waiting;
        WEFT_TRY(fill(&s, 0.1, &waiting, err));
        if (waiting || s.used > 0)
            WEFT_TRY(idle(r->context, err));
        if (!waiting && s.used == 0)
            return weft_fail(err, WEFT_ERR_DEVICE, "%s",
                             r->good || r->n_lines == 0 ? "the daemon has ended"
                                                        : "the daemon refuses to tell its events");
        WEFT_TRY(take_bytes(r, s.bytes, s.used, err));
    }
    return WEFT_OK;
}

weft_err weft_daemon_watch(const char *path_of_socket, const char *query, weft_daemon_event_fn *event,
                           weft_err (*idle)(void *context, weft_error *err), void *context, weft_error *err)
{
    event_reader r = {.event = event, .context = context};
    char path[200];
    snprintf(path, sizeof path, "/v1/events%s", query);
    const int fd = weft_unix_socket_connect(path_of_socket);
    if (fd < 0)
        return weft_fail_errno(err, WEFT_ERR_DEVICE, "%s: the daemon does not answer", path_of_socket);
    weft_err status = send_request(fd, "GET", path, NULL, err);
    if (status == WEFT_OK)
        status = read_events(fd, &r, idle, err);
    close(fd);
    weft_free(r.line.bytes);
    weft_free(r.data.bytes);
    return status;
}
