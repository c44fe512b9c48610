#include "host/daemon/listen.h"

#include "core/text.h"

#include <arpa/inet.h>
#include <errno.h>
#include <fcntl.h>
#include <grp.h>
#include <netinet/in.h>
#include <stdio.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <systemd/sd-daemon.h>
#include <unistd.h>

enum { BACKLOG = 512 };

typedef union address {
    struct sockaddr any;
    struct sockaddr_in v4;
    struct sockaddr_in6 v6;
    struct sockaddr_un un;
    struct sockaddr_storage room;
} address;

/* Whether somebody answers on the socket. */
static bool is_alive(const address *a)
{
    const int fd = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
    const bool alive = fd >= 0 && (connect(fd, &a->any, sizeof a->un) == 0 || errno == EAGAIN);
    if (fd >= 0)
        close(fd);
    return alive;
}

static weft_err give_to_group(const char *path, const char *name, weft_error *err)
{
    const struct group *const group = getgrnam(name);
    if (!group)
        return weft_fail(err, WEFT_ERR_USAGE, "--group %s: there is no such group", name);
    if (chown(path, (uid_t)-1, group->gr_gid) != 0)
        return weft_fail_errno(err, WEFT_ERR_IO, "%s: cannot be given to the group %s", path, name);
    return WEFT_OK;
}

static weft_err bind_unix(int fd, const address *a, const char *group, weft_error *err)
{
    const char *const path = a->un.sun_path;
    struct stat s;
    if (lstat(path, &s) == 0 && !S_ISSOCK(s.st_mode))
        return weft_fail(err, WEFT_ERR_EXISTS, "%s: is there and is no socket; give another --socket", path);
    (void)unlink(path);
    const mode_t mask = umask(0777); /* nobody connects before mode and group are right */
    const int failed = bind(fd, &a->any, sizeof a->un);
    umask(mask);
    if (failed != 0)
        return weft_fail_errno(err, WEFT_ERR_IO, "%s: the socket cannot be made", path);
    weft_err status = group ? give_to_group(path, group, err) : WEFT_OK;
    if (status == WEFT_OK && (chmod(path, 0660) != 0 || listen(fd, BACKLOG) != 0))
        status = weft_fail_errno(err, WEFT_ERR_IO, "%s: the socket cannot be opened", path);
    if (status != WEFT_OK)
        (void)unlink(path);
    return status;
}

weft_err weft_listen_unix(const char *path, const char *group, int *fd, weft_error *err)
{
    address a = {.un = {.sun_family = AF_UNIX}};
    if (strlen(path) >= sizeof a.un.sun_path)
        return weft_fail(err, WEFT_ERR_USAGE,
                         "%s: the path of a socket has at most %zu bytes; give a shorter --socket", path,
                         sizeof a.un.sun_path - 1);
    snprintf(a.un.sun_path, sizeof a.un.sun_path, "%s", path);
    if (is_alive(&a))
        return weft_fail(err, WEFT_ERR_EXISTS, "%s: a daemon answers there already", path);
    const int opened = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
    if (opened < 0)
        return weft_fail_errno(err, WEFT_ERR_IO, "%s: no socket", path);
    const weft_err status = bind_unix(opened, &a, group, err);
    if (status != WEFT_OK) {
        close(opened);
        return status;
    }
    *fd = opened;
    return WEFT_OK;
}

static bool parse_address(const char *text, address *a)
{
    char host[64];
    int port;
    const char *const colon = strrchr(text, ':');
    const size_t n = colon ? (size_t)(colon - text) : 0;
    if (!colon || n >= sizeof host || !weft_text_to_int(colon + 1, &port) || port < 0 || port > 65535)
        return false;
    memcpy(host, text, n);
    host[n] = '\0';
    *a = (address){0};
    if (n >= 2 && host[0] == '[' && host[n - 1] == ']') {
        host[n - 1] = '\0';
        a->v6.sin6_family = AF_INET6;
        a->v6.sin6_port = htons((uint16_t)port);
        return inet_pton(AF_INET6, host + 1, &a->v6.sin6_addr) == 1;
    }
    a->v4.sin_family = AF_INET;
    a->v4.sin_port = htons((uint16_t)port);
    return inet_pton(AF_INET, n == 0 || strcmp(host, "localhost") == 0 ? "127.0.0.1" : host,
                     &a->v4.sin_addr) == 1;
}

weft_err weft_listen_tcp(const char *text, int *fd, weft_error *err)
{
    address a;
    const int on = 1;
    if (!parse_address(text, &a))
        return weft_fail(err, WEFT_ERR_USAGE,
                         "--listen %s: wanted an address as 127.0.0.1:8080 or [::1]:8080", text);
    const int opened = socket(a.any.sa_family, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
    if (opened < 0)
        return weft_fail_errno(err, WEFT_ERR_IO, "--listen %s: no socket", text);
    (void)setsockopt(opened, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
    if (bind(opened, &a.any, a.any.sa_family == AF_INET6 ? sizeof a.v6 : sizeof a.v4) != 0 ||
        listen(opened, BACKLOG) != 0) {
        const weft_err status =
            weft_fail_errno(err, WEFT_ERR_IO, "--listen %s: the port cannot be opened", text);
        close(opened);
        return status;
    }
    *fd = opened;
    return WEFT_OK;
}

bool weft_listen_is_loopback(int fd)
{
    address a = {0};
    socklen_t n = sizeof a;
    if (getsockname(fd, &a.any, &n) != 0)
        return false;
    return a.any.sa_family == AF_INET6 ? IN6_IS_ADDR_LOOPBACK(&a.v6.sin6_addr) != 0
                                       : ntohl(a.v4.sin_addr.s_addr) >> 24 == 127;
}

void weft_listen_name(int fd, char text[80])
{
    address a = {0};
    socklen_t n = sizeof a;
    char host[INET6_ADDRSTRLEN] = "?";
    (void)getsockname(fd, &a.any, &n);
    if (a.any.sa_family == AF_INET6) {
        inet_ntop(AF_INET6, &a.v6.sin6_addr, host, sizeof host);
        snprintf(text, 80, "[%s]:%d", host, ntohs(a.v6.sin6_port));
    } else {
        inet_ntop(AF_INET, &a.v4.sin_addr, host, sizeof host);
        snprintf(text, 80, "%s:%d", host, ntohs(a.v4.sin_port));
    }
}

weft_err weft_listen_from_systemd(weft_listen_given *given, int max, int *n, weft_error *err)
{
    const int found = sd_listen_fds(1);
    *n = 0;
    if (found < 0)
        return weft_fail(err, WEFT_ERR_IO, "systemd's sockets cannot be taken: %s", strerror(-found));
    for (int fd = SD_LISTEN_FDS_START; fd < SD_LISTEN_FDS_START + found; fd++) {
        const bool local = sd_is_socket_unix(fd, SOCK_STREAM, 1, NULL, 0) > 0;
        const bool tcp = !local && sd_is_socket_inet(fd, AF_UNSPEC, SOCK_STREAM, 1, 0) > 0;
        if (!local && !tcp)
            return weft_fail(err, WEFT_ERR_USAGE,
                             "systemd hands over descriptor %d, which is no listening stream socket", fd);
        if (*n == max)
            return weft_fail(err, WEFT_ERR_USAGE, "systemd hands over more than %d sockets", max);
        (void)fcntl(fd, F_SETFL, O_NONBLOCK);
        given[(*n)++] = (weft_listen_given){.fd = fd, .tcp = tcp};
    }
    return WEFT_OK;
}
