#include "core/report_channel.h"

#include "core/text.h"

#include <fcntl.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <unistd.h>

static int channel = -1;

void weft_report_open(void)
{
    const char *const text = getenv(WEFT_REPORT_ENV);
    int fd;
    if (!text || !weft_text_to_int(text, &fd) || fd < 3 || fcntl(fd, F_SETFD, FD_CLOEXEC) != 0)
        return;
    channel = fd;
    unsetenv(WEFT_REPORT_ENV);
}

bool weft_report_active(void)
{
    return channel >= 0;
}

/* One message, with a descriptor unless fd is negative. */
static void send_message(json_t *message, int fd)
{
    char text[WEFT_REPORT_MAX];
    union { /* aligned as the kernel wants it */
        struct cmsghdr header;
        char bytes[CMSG_SPACE(sizeof(int))];
    } control;
    const size_t n = message ? json_dumpb(message, text, sizeof text, JSON_COMPACT) : 0;
    if (n == 0 || n > sizeof text)
        return;
    struct iovec data = {.iov_base = text, .iov_len = n};
    struct msghdr envelope = {.msg_iov = &data, .msg_iovlen = 1};
    if (fd >= 0) {
        memset(&control, 0, sizeof control);
        envelope.msg_control = control.bytes;
        envelope.msg_controllen = sizeof control.bytes;
        struct cmsghdr *const header = CMSG_FIRSTHDR(&envelope);
        header->cmsg_level = SOL_SOCKET;
        header->cmsg_type = SCM_RIGHTS;
        header->cmsg_len = CMSG_LEN(sizeof(int));
        memcpy(CMSG_DATA(header), &fd, sizeof fd);
    }
    (void)!sendmsg(channel, &envelope, MSG_DONTWAIT | MSG_NOSIGNAL); /* a full channel loses the message */
}

void weft_report_send(json_t *message)
{
    if (channel >= 0)
        send_message(message, -1);
    json_decref(message);
}

/* The bytes in memory that nobody can change any more; -1 when there is none. */
static int seal(const void *bytes, size_t n)
{
    const int fd = memfd_create("weft-picture", MFD_CLOEXEC | MFD_ALLOW_SEALING);
    size_t done = 0;
    while (fd >= 0 && done < n) {
        const ssize_t written = write(fd, (const char *)bytes + done, n - done);
        if (written <= 0)
            break;
        done += (size_t)written;
    }
    if (fd >= 0 &&
        (done < n || fcntl(fd, F_ADD_SEALS, F_SEAL_SHRINK | F_SEAL_GROW | F_SEAL_WRITE | F_SEAL_SEAL) != 0)) {
        close(fd);
        return -1;
    }
    return fd;
}

void weft_report_send_picture(json_t *message, const void *bytes, size_t n)
{
    const int fd = channel >= 0 ? seal(bytes, n) : -1;
    if (fd >= 0) {
        send_message(message, fd);
        close(fd);
    }
    json_decref(message);
}
