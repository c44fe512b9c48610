/**
 * A serial port (or pty) in raw mode, every wait with its deadline.  Private to host/light.
 */
#ifndef WEFT_HOST_LIGHT_SERIAL_PORT_H
#define WEFT_HOST_LIGHT_SERIAL_PORT_H

#include "core/error.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

typedef struct weft_serial {
    int fd;          /* -1 when closed */
    int reservation; /* of the port (port_owner.h); -1 when closed */
    int rate;        /* bits per second */
    bool gone;       /* the port has vanished */
    char name[256];  /* for messages */
} weft_serial;

/** Opens exclusively: 500 000 baud, 8N1, raw, no modem lines, not hanging up on close (that would reset the
 *  board at the next open).  A pty that knows no modem lines is fine.  Forgets what came in before.
 *  @return WEFT_ERR_DEVICE with the remedy */
weft_err weft_serial_open(weft_serial *serial, const char *port, weft_error *err);
/** What is still to be sent gets 0.2 s, whatever is at the other end. */
void weft_serial_close(weft_serial *serial);

/** 500000 or 38400; nothing happens when it is so already.  Forgets what came in at the other rate. */
weft_err weft_serial_set_rate(weft_serial *serial, int rate, weft_error *err);

/** Writes all bytes until `deadline_s` of weft_clock_s().
 *  @return WEFT_ERR_DEVICE when the port is gone, WEFT_ERR_TIMEOUT */
weft_err weft_serial_write(weft_serial *serial, const uint8_t *bytes, size_t n, double deadline_s,
                           weft_error *err);

/** Reads what there is, waiting for the first byte until `deadline_s`; *n is 0 when none came.
 *  @return WEFT_ERR_DEVICE when the port is gone */
weft_err weft_serial_read(weft_serial *serial, uint8_t *bytes, size_t room, double deadline_s, size_t *n,
                          weft_error *err);

#endif
