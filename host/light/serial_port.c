#include "host/light/serial_port.h"

#include "core/progress.h"
#include "host/light/port_owner.h"

#include <errno.h>
#include <fcntl.h>
#include <math.h>
#include <poll.h>
#include <stdio.h>
#include <sys/file.h>
#include <sys/ioctl.h>
#include <termios.h>
#include <unistd.h>

static weft_err why_not_open(const char *port, weft_error *err)
{
    weft_port_user user;
    switch (errno) {
    case ENOENT:
    case ENXIO:
    case ENODEV:
        return weft_fail(err, WEFT_ERR_DEVICE,
                         "%s: there is no such port; is the light controller plugged in?", port);
    case EACCES:
    case EPERM:
        return weft_fail(err, WEFT_ERR_DEVICE,
                         "%s: no permission; install udev/70-weft.rules, or join the group of the port "
                         "(sudo usermod -aG dialout $USER) and log in again",
                         port);
    case EBUSY:
        (void)weft_port_find_user(port, &user);
        return weft_port_fail_used(port, &user, err);
    default:
        return weft_fail_errno(err, WEFT_ERR_DEVICE, "%s: the port cannot be opened", port);
    }
}

/* TIOCEXCL does not stop root, and a pty may not know it; the lock works for every program that asks. */
static int lock(int fd)
{
    if (flock(fd, LOCK_EX | LOCK_NB) != 0) {
        errno = errno == EWOULDBLOCK ? EBUSY : errno;
        return -1;
    }
    return ioctl(fd, TIOCEXCL) != 0 && errno != ENOTTY ? -1 : 0;
}

static int set_speed(struct termios *t, int rate)
{
    const speed_t speed = rate == 500000 ? B500000 : B38400;
    return cfsetispeed(t, speed) != 0 || cfsetospeed(t, speed) != 0 ? -1 : 0;
}

static int make_raw(int fd, int rate)
{
    struct termios t;
    if (tcgetattr(fd, &t) != 0)
        return -1;
    cfmakeraw(&t);
    t.c_cflag |= CLOCAL | CREAD;
    t.c_cflag &= ~(tcflag_t)(HUPCL | CSTOPB | CRTSCTS);
    t.c_cc[VMIN] = 0;
    t.c_cc[VTIME] = 0;
    if (set_speed(&t, rate) != 0)
        return -1;
    return tcsetattr(fd, TCSANOW, &t);
}

weft_err weft_serial_open(weft_serial *serial, const char *port, weft_error *err)
{
    serial->fd = -1;
    WEFT_TRY(weft_port_reserve(port, &serial->reservation, err));
    serial->fd = open(port, O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
    if (serial->fd < 0) {
        const weft_err failed = why_not_open(port, err);
        weft_serial_close(serial);
        return failed;
    }
    snprintf(serial->name, sizeof serial->name, "%s", port);
    serial->rate = 500000;
    serial->gone = false;
    weft_err status = WEFT_OK;
    if (lock(serial->fd) != 0)
        status = why_not_open(port, err);
    else if (make_raw(serial->fd, serial->rate) != 0)
        status = errno == ENOTTY ? weft_fail(err, WEFT_ERR_DEVICE, "%s: this is not a serial port", port)
                                 : weft_fail_errno(err, WEFT_ERR_DEVICE,
                                                   "%s: the port cannot be set to 500 000 baud", port);
    else
        tcflush(serial->fd, TCIOFLUSH);
    if (status != WEFT_OK)
        weft_serial_close(serial);
    return status;
}

weft_err weft_serial_set_rate(weft_serial *serial, int rate, weft_error *err)
{
    struct termios t;
    if (rate == serial->rate)
        return WEFT_OK;
    if (tcgetattr(serial->fd, &t) != 0 || set_speed(&t, rate) != 0 || tcsetattr(serial->fd, TCSANOW, &t) != 0)
        return weft_fail_errno(err, WEFT_ERR_DEVICE, "%s: the port cannot be set to %d baud", serial->name,
                               rate);
    tcflush(serial->fd, TCIFLUSH);
    serial->rate = rate;
    return WEFT_OK;
}

/* close() would wait up to 30 s for a device that takes nothing (closing_wait of the kernel). */
static void drain(int fd)
{
    int waiting = 0;
    for (int i = 0; i < 20 && ioctl(fd, TIOCOUTQ, &waiting) == 0 && waiting > 0; i++)
        poll(NULL, 0, 10);
    if (waiting > 0)
        tcflush(fd, TCOFLUSH);
}

void weft_serial_close(weft_serial *serial)
{
    if (serial->fd >= 0) {
        if (!serial->gone)
            drain(serial->fd);
        close(serial->fd);
    }
    if (serial->reservation >= 0)
        close(serial->reservation);
    serial->fd = serial->reservation = -1;
}

static weft_err gone(weft_serial *serial, weft_error *err)
{
    serial->gone = true;
    return weft_fail(err, WEFT_ERR_DEVICE, "%s: the light controller has vanished; is its USB cable in?",
                     serial->name);
}

/* Waits for `events`; *ready is false at the deadline. */
static weft_err wait_for(weft_serial *serial, short events, double deadline_s, bool *ready, weft_error *err)
{
    for (;;) {
        const double left_s = deadline_s - weft_clock_s();
        struct pollfd p = {.fd = serial->fd, .events = events};
        const int n = poll(&p, 1, left_s <= 0 ? 0 : (int)ceil(1e3 * left_s));
        *ready = n > 0 && (p.revents & events);
        if (n < 0 && errno != EINTR)
            return weft_fail_errno(err, WEFT_ERR_DEVICE, "%s: waiting for the port", serial->name);
        if (n > 0 && !*ready)
            return gone(serial, err);
        if (*ready || (n == 0 && weft_clock_s() >= deadline_s))
            return WEFT_OK;
    }
}

weft_err weft_serial_write(weft_serial *serial, const uint8_t *bytes, size_t n, double deadline_s,
                           weft_error *err)
{
    while (n > 0) {
        const ssize_t written = write(serial->fd, bytes, n);
        if (written > 0) {
            bytes += written;
            n -= (size_t)written;
        } else if (written < 0 && errno != EAGAIN && errno != EINTR) {
            return gone(serial, err);
        } else {
            bool ready;
            WEFT_TRY(wait_for(serial, POLLOUT, deadline_s, &ready, err));
            if (!ready)
                return weft_fail(err, WEFT_ERR_TIMEOUT,
                                 "%s: the port takes no bytes; unplug the controller and plug it in again",
                                 serial->name);
        }
    }
    return WEFT_OK;
}

weft_err weft_serial_read(weft_serial *serial, uint8_t *bytes, size_t room, double deadline_s, size_t *n,
                          weft_error *err)
{
    bool ready;
    *n = 0;
    WEFT_TRY(wait_for(serial, POLLIN, deadline_s, &ready, err));
    if (!ready)
        return WEFT_OK;
    const ssize_t count = read(serial->fd, bytes, room);
    if (count == 0 || (count < 0 && errno != EAGAIN && errno != EINTR))
        return gone(serial, err); /* readable, and nothing to read: hung up */
    if (count > 0)
        *n = (size_t)count;
    return WEFT_OK;
}
