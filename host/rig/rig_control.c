#include "host/rig/rig_control.h"

#include "core/mem.h"
#include "core/progress.h"
#include "core/unix_socket.h"

#include <errno.h>
#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

enum { MAX_CLIENTS = 16, MAX_LINE = 4096, MAX_REPLY = 65536, WAIT_MS = 500 };

typedef struct client {
    int fd;
    size_t used;
    char line[MAX_LINE];
} client;

struct weft_rig_control {
    int fd;
    char path[sizeof((struct sockaddr_un *)0)->sun_path];
    int n_clients;
    client clients[MAX_CLIENTS];
};

static weft_err make_address(const char *path, struct sockaddr_un *address, weft_error *err)
{
    *address = (struct sockaddr_un){.sun_family = AF_UNIX};
    if (strlen(path) >= sizeof address->sun_path)
        return weft_fail(err, WEFT_ERR_USAGE,
                         "%s: the path of a socket has at most %zu bytes; use a shorter --dir", path,
                         sizeof address->sun_path - 1);
    snprintf(address->sun_path, sizeof address->sun_path, "%s", path);
    return WEFT_OK;
}

weft_err weft_rig_control_create(const char *path, weft_rig_control **control, weft_error *err)
{
    struct sockaddr_un address;
    WEFT_TRY(make_address(path, &address, err));
    const int other = weft_unix_socket_connect(path);
    if (other >= 0) {
        close(other);
        return weft_fail(err, WEFT_ERR_EXISTS,
                         "%s: a virtual scanner runs there already; end it or use another --dir", path);
    }
    weft_rig_control *const c = weft_alloc(1, sizeof *c, err);
    if (!c)
        return WEFT_ERR_NOMEM;
    snprintf(c->path, sizeof c->path, "%s", path);
    (void)unlink(path);
    c->fd = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
    if (c->fd < 0 || bind(c->fd, (const struct sockaddr *)&address, sizeof address) != 0 ||
        listen(c->fd, MAX_CLIENTS) != 0) {
        const weft_err status =
            weft_fail_errno(err, WEFT_ERR_IO, "%s: the control socket cannot be opened", path);
        if (c->fd >= 0)
            close(c->fd);
        weft_free(c);
        return status;
    }
    *control = c;
    return WEFT_OK;
}

void weft_rig_control_destroy(weft_rig_control *control)
{
    if (!control)
        return;
    for (int i = 0; i < control->n_clients; i++)
        close(control->clients[i].fd);
    close(control->fd);
    (void)unlink(control->path);
    weft_free(control);
}

static void drop(weft_rig_control *control, int i)
{
    close(control->clients[i].fd);
    control->clients[i] = control->clients[--control->n_clients];
}

static void greet(weft_rig_control *control)
{
    const int fd = accept4(control->fd, NULL, NULL, SOCK_CLOEXEC | SOCK_NONBLOCK);
    if (fd < 0)
        return;
    if (control->n_clients == MAX_CLIENTS) {
        close(fd);
        return;
    }
    client *const new = &control->clients[control->n_clients++];
    new->fd = fd;
    new->used = 0;
}

/* A client that does not read its reply within a second is left alone with it. */
static bool send_all(int fd, const char *bytes, size_t n)
{
    while (n > 0) {
        const ssize_t sent = send(fd, bytes, n, MSG_NOSIGNAL);
        if (sent > 0) {
            bytes += sent;
            n -= (size_t)sent;
            continue;
        }
        struct pollfd room = {.fd = fd, .events = POLLOUT};
        if ((sent < 0 && errno != EAGAIN && errno != EINTR) || poll(&room, 1, 1000) == 0)
            return false;
    }
    return true;
}

static bool answer(int fd, json_t *reply)
{
    char *const text = reply ? json_dumps(reply, JSON_COMPACT) : NULL;
    static const char sorry[] = "{\"ok\":false,\"error\":\"out of memory\"}";
    const char *const line = text ? text : sorry;
    const bool sent = send_all(fd, line, strlen(line)) && send_all(fd, "\n", 1);
    free(text);
    json_decref(reply);
    return sent;
}

/* Obeys the whole lines that client `c` has sent.  False when it is to be dropped. */
static bool serve(client *c, weft_rig_obey_fn *obey, void *context, bool *quit)
{
    const ssize_t n = recv(c->fd, c->line + c->used, sizeof c->line - 1 - c->used, 0);
    if (n <= 0)
        return n < 0 && (errno == EAGAIN || errno == EINTR);
    c->used += (size_t)n;
    for (;;) {
        char *const end = memchr(c->line, '\n', c->used);
        if (!end)
            break;
        const bool whole = memchr(c->line, '\0', (size_t)(end - c->line)) == NULL;
        *end = '\0';
        if (end > c->line && end[-1] == '\r')
            end[-1] = '\0';
        json_t *const reply =
            whole ? obey(context, c->line, quit)
                  : json_pack("{s:b, s:s}", "ok", 0, "error", "a line must not contain a zero byte");
        if (!answer(c->fd, reply))
            return false;
        const size_t taken = (size_t)(end + 1 - c->line);
        memmove(c->line, end + 1, c->used - taken);
        c->used -= taken;
    }
    if (c->used < sizeof c->line - 1)
        return true;
    (void)answer(c->fd, json_pack("{s:b, s:s}", "ok", 0, "error", "a line must be shorter than 4096 bytes"));
    return false;
}

weft_err weft_rig_control_run(weft_rig_control *control, weft_rig_obey_fn *obey, bool (*alive)(void *context),
                              void *context, weft_error *err)
{
    bool quit = false;
    while (!quit && !weft_cancelled()) {
        struct pollfd fds[1 + MAX_CLIENTS];
        const int n = control->n_clients;
        fds[0] = (struct pollfd){.fd = control->fd, .events = POLLIN};
        for (int i = 0; i < n; i++)
            fds[1 + i] = (struct pollfd){.fd = control->clients[i].fd, .events = POLLIN};
        const int ready = poll(fds, 1 + (nfds_t)n, WAIT_MS);
        if (!alive(context))
            return weft_fail(
                err, WEFT_ERR_DEVICE,
                "the simulated light controller has crashed; start the rig again, and if it was a "
                "firmware of your own look at it in a debugger");
        if (ready <= 0)
            continue;
        for (int i = n - 1; i >= 0; i--) /* backwards: drop() moves the last one */
            if (fds[1 + i].revents && !serve(&control->clients[i], obey, context, &quit))
                drop(control, i);
        if (fds[0].revents)
            greet(control);
    }
    return WEFT_OK;
}

/* ------------------------------------------------------------------------------------------ client */

static weft_err read_line(int fd, double timeout_s, char *line, size_t size, weft_error *err)
{
    const double deadline_s = weft_clock_s() + timeout_s;
    size_t used = 0;
    while (used + 1 < size) {
        struct pollfd in = {.fd = fd, .events = POLLIN};
        if (weft_cancelled())
            return weft_fail(err, WEFT_ERR_CANCELLED, "cancelled");
        if (weft_clock_s() > deadline_s)
            return weft_fail(err, WEFT_ERR_TIMEOUT, "no reply within %g s", timeout_s);
        if (poll(&in, 1, 100) <= 0)
            continue;
        const ssize_t n = recv(fd, line + used, size - 1 - used, 0);
        if (n <= 0)
            return weft_fail(err, WEFT_ERR_DEVICE, "the virtual scanner ended without a reply");
        used += (size_t)n;
        line[used] = '\0';
        if (line[used - 1] == '\n')
            return WEFT_OK;
    }
    return weft_fail(err, WEFT_ERR_PROTOCOL, "the reply has no end");
}

static weft_err converse(int fd, const char *line, double timeout_s, json_t **reply, weft_error *err)
{
    char *const text = weft_alloc(MAX_REPLY, 1, err);
    if (!text)
        return WEFT_ERR_NOMEM;
    weft_err status = WEFT_OK;
    if (!send_all(fd, line, strlen(line)) || !send_all(fd, "\n", 1))
        status = weft_fail_errno(err, WEFT_ERR_DEVICE, "the line cannot be sent");
    if (status == WEFT_OK)
        status = read_line(fd, timeout_s, text, MAX_REPLY, err);
    if (status == WEFT_OK) {
        *reply = json_loads(text, 0, NULL);
        if (!*reply)
            status = weft_fail(err, WEFT_ERR_PROTOCOL, "the reply is no JSON: %.80s", text);
    }
    weft_free(text);
    return status;
}

weft_err weft_rig_control_tell(const char *path, const char *line, double timeout_s, json_t **reply,
                               weft_error *err)
{
    if (strchr(line, '\n') || strlen(line) >= MAX_LINE - 1)
        return weft_fail(err, WEFT_ERR_USAGE, "a command to the rig is one line of less than %d bytes",
                         MAX_LINE);
    const int fd = weft_unix_socket_connect(path);
    if (fd < 0)
        return weft_fail_errno(err, WEFT_ERR_DEVICE,
                               "%s: no virtual scanner answers; start one with \"weft rig --dir\"", path);
    weft_err status = converse(fd, line, timeout_s, reply, err);
    close(fd);
    if (status != WEFT_OK)
        weft_prefix(err, status, "%s", path);
    return status;
}
