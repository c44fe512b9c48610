/**
 * Cameras and light controllers on USB: which are plugged in, why one cannot be opened, and which come and
 * go.
 *
 * A device is known by its identity, which does not depend on the socket: maker, product and serial number;
 * one without a serial number is known by the socket.  Nothing is opened here: a device that has just
 * appeared is not ready yet, and opening an Arduino resets it.
 */
#ifndef WEFT_HOST_USB_DEVICES_H
#define WEFT_HOST_USB_DEVICES_H

#include "core/error.h"

#include <stdbool.h>

enum { WEFT_USB_MAX = 64 };

typedef enum weft_usb_kind {
    WEFT_USB_STILL_CAMERA,  /* interface class 06/01/01: PTP */
    WEFT_USB_VISION_CAMERA, /* ef/05/00: USB3 Vision */
    WEFT_USB_CONTROLLER,    /* a serial line that may be the light controller */
} weft_usb_kind;

typedef struct weft_usb_device {
    weft_usb_kind kind;
    char identity[96]; /* "04b0:0429:6001234", without serial number "1a86:7523@1-2" */
    char serial[64];
    char name[96];     /* as the device calls itself */
    char node[64];     /* "/dev/bus/usb/001/004", "/dev/ttyACM0" */
    char place[32];    /* the socket: "1-2.4" */
    char problem[320]; /* why it cannot be opened, and the remedy; empty when it can */
} weft_usb_device;

/** "still camera (PTP)", ... */
const char *weft_usb_kind_name(weft_usb_kind kind);

/** What is plugged in.  @return WEFT_ERR_DEVICE when udev cannot be asked */
weft_err weft_usb_list(weft_usb_device *devices, int max, int *n, weft_error *err);

typedef struct weft_usb_watch weft_usb_watch;

/** Begins to watch; what is there now is known and not told.  @return WEFT_ERR_DEVICE, WEFT_ERR_NOMEM */
weft_err weft_usb_watch_open(weft_usb_watch **watch, weft_error *err);
void weft_usb_watch_close(weft_usb_watch *watch);

/**
 * Waits at most timeout_ms for a device to appear or vanish; a device that was exchanged quickly does both.
 *
 * @param happened  false: nothing within the time
 * @param appeared  else it vanished
 */
weft_err weft_usb_watch_next(weft_usb_watch *watch, int timeout_ms, bool *happened, bool *appeared,
                             weft_usb_device *device, weft_error *err);

#endif
