#include "host/camera/camera_message.h"

#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

static const int all_seals = F_SEAL_SEAL | F_SEAL_SHRINK | F_SEAL_GROW | F_SEAL_WRITE;

const char *weft_camera_call_name(uint32_t call)
{
    static const char *const names[WEFT_N_CALLS] = {"HELLO",  "LIST",  "OPEN",   "CONFIGURE",
                                                    "EXPOSE", "CLOSE", "CANCEL", "ARMED"};
    return call < WEFT_N_CALLS ? names[call] : "?";
}

bool weft_camera_message_send(int socket, const weft_camera_message *message, size_t body_size, int fd)
{
    union {
        struct cmsghdr align;
        char bytes[CMSG_SPACE(sizeof(int))];
    } control = {0};
    struct iovec part = {.iov_base = (void *)(uintptr_t)message,
                         .iov_len = WEFT_CAMERA_MESSAGE_SIZE(body_size)};
    struct msghdr header = {.msg_iov = &part, .msg_iovlen = 1};
    if (fd >= 0) {
        header.msg_control = control.bytes;
        header.msg_controllen = sizeof control.bytes;
        struct cmsghdr *const first = CMSG_FIRSTHDR(&header);
        *first = (struct cmsghdr){
            .cmsg_level = SOL_SOCKET, .cmsg_type = SCM_RIGHTS, .cmsg_len = CMSG_LEN(sizeof(int))};
        memcpy(CMSG_DATA(first), &fd, sizeof fd);
    }
    ssize_t sent;
    do
        sent = sendmsg(socket, &header, MSG_NOSIGNAL | MSG_DONTWAIT);
    while (sent < 0 && errno == EINTR);
    return sent == (ssize_t)part.iov_len;
}

/* The one descriptor of the message; whatever else was sent along is closed, so that none is left over. */
static int take_descriptor(struct msghdr *header)
{
    int taken = -1;
    for (struct cmsghdr *c = CMSG_FIRSTHDR(header); c; c = CMSG_NXTHDR(header, c)) {
        if (c->cmsg_level != SOL_SOCKET || c->cmsg_type != SCM_RIGHTS)
            continue;
        const size_t n = (c->cmsg_len - CMSG_LEN(0)) / sizeof(int);
        for (size_t i = 0; i < n; i++) {
            int fd;
            memcpy(&fd, CMSG_DATA(c) + i * sizeof fd, sizeof fd);
            if (taken < 0)
                taken = fd;
            else
                close(fd);
        }
    }
    return taken;
}

static size_t least_body(const weft_camera_message *m)
{
    if (m->call == WEFT_CALL_HELLO)
        return sizeof m->body.hello;
    return m->status != WEFT_OK ? sizeof m->body.error : 0;
}

#define END_TEXT(text) ((text)[sizeof(text) - 1] = '\0')

static void end_texts(weft_camera_message *m)
{
    if (m->status != WEFT_OK) {
        END_TEXT(m->body.error.text);
        return;
    }
    switch ((weft_camera_call)m->call) {
    case WEFT_CALL_HELLO:
        END_TEXT(m->body.hello.build);
        END_TEXT(m->body.hello.backend);
        break;
    case WEFT_CALL_EXPOSE:
        END_TEXT(m->body.frame.reason);
        break;
    default:
        break;
    }
}

weft_camera_receipt weft_camera_message_receive(int socket, int timeout_ms, weft_camera_message *message,
                                                int *fd)
{
    union {
        struct cmsghdr align;
        char bytes[CMSG_SPACE(4 * sizeof(int))];
    } control;
    struct pollfd in = {.fd = socket, .events = POLLIN};
    *fd = -1;
    if (poll(&in, 1, timeout_ms) <= 0)
        return WEFT_RECEIPT_NOTHING;
    struct iovec part = {.iov_base = message, .iov_len = sizeof *message};
    struct msghdr header = {.msg_iov = &part,
                            .msg_iovlen = 1,
                            .msg_control = control.bytes,
                            .msg_controllen = sizeof control.bytes};
    memset(message, 0, sizeof *message);
    const ssize_t n = recvmsg(socket, &header, MSG_DONTWAIT | MSG_CMSG_CLOEXEC);
    if (n == 0)
        return WEFT_RECEIPT_GONE;
    if (n < 0)
        return errno == EAGAIN || errno == EINTR ? WEFT_RECEIPT_NOTHING : WEFT_RECEIPT_GONE;
    *fd = take_descriptor(&header);
    if ((size_t)n < WEFT_CAMERA_MESSAGE_SIZE(0) || (header.msg_flags & (MSG_TRUNC | MSG_CTRUNC)) ||
        message->call >= WEFT_N_CALLS || message->status < 0 ||
        (size_t)n < WEFT_CAMERA_MESSAGE_SIZE(least_body(message))) {
        if (*fd >= 0)
            close(*fd);
        *fd = -1;
        return WEFT_RECEIPT_GARBAGE;
    }
    end_texts(message);
    return WEFT_RECEIPT_MESSAGE;
}

static bool write_all(int fd, const char *bytes, size_t n)
{
    while (n > 0) {
        const ssize_t written = write(fd, bytes, n);
        if (written < 0 && errno != EINTR)
            return false;
        bytes += written > 0 ? written : 0;
        n -= written > 0 ? (size_t)written : 0;
    }
    return true;
}

int weft_camera_sealed_memory(const void *bytes, size_t n, const void *more, size_t n_more)
{
    const int fd = memfd_create("weft-frame", MFD_CLOEXEC | MFD_ALLOW_SEALING);
    if (fd >= 0 && (!write_all(fd, bytes, n) || !write_all(fd, more, n_more) ||
                    fcntl(fd, F_ADD_SEALS, all_seals) != 0)) {
        const int reason = errno;
        close(fd);
        errno = reason;
        return -1;
    }
    return fd;
}

bool weft_camera_is_sealed_memory(int fd, size_t n)
{
    struct stat at;
    const int seals = fcntl(fd, F_GET_SEALS);
    return seals >= 0 && (seals & all_seals) == all_seals && fstat(fd, &at) == 0 && at.st_size >= 0 &&
           (size_t)at.st_size == n;
}
