/** Boards on USB that may be a light controller: Arduino Unos and their copies. */
#ifndef WEFT_HOST_LIGHT_USB_BOARDS_H
#define WEFT_HOST_LIGHT_USB_BOARDS_H

#include "core/error.h"

#include <stdint.h>

/** USB numbers of the boards, as in udev/70-weft.rules; ends with a vendor of 0. */
typedef struct weft_usb_id {
    uint16_t vendor, product;
    const char *name;
} weft_usb_id;
extern const weft_usb_id weft_usb_ids[];

typedef struct weft_usb_board {
    const weft_usb_id *id;
    char port[64];      /* "/dev/ttyACM0"; empty when the kernel gives it no serial port */
    char serial[64];    /* of the USB chip; a CH340 has none */
    char place[32];     /* "bus 1, device 5" */
    char mm_ignored[4]; /* "1" when udev keeps ModemManager away from the port */
} weft_usb_board;

/** The boards that are plugged in: those with a serial port from udev, the others from libusb.
 *  @return WEFT_ERR_DEVICE when this system has no udev */
weft_err weft_usb_boards_list(weft_usb_board *boards, int max, int *n, weft_error *err);

#endif
