#include "host/light/usb_boards.h"

#include <libudev.h>
#include <libusb.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

const weft_usb_id weft_usb_ids[] = {
    {0x2341, 0x0001, "Arduino Uno"},
    {0x2341, 0x0043, "Arduino Uno R3"},
    {0x2341, 0x0243, "Arduino Uno R3"},
    {0x2a03, 0x0043, "Arduino Uno (arduino.org)"},
    {0x1a86, 0x7523, "copy of an Arduino with a CH340"},
    {0},
};

static const weft_usb_id *find_id(unsigned long vendor, unsigned long product)
{
    for (const weft_usb_id *id = weft_usb_ids; id->vendor; id++)
        if (id->vendor == vendor && id->product == product)
            return id;
    return NULL;
}

/* -- those with a serial port: udev --------------------------------------------------------------------- */

static unsigned long number_of(struct udev_device *usb, const char *attribute, int base)
{
    const char *const text = udev_device_get_sysattr_value(usb, attribute);
    return text ? strtoul(text, NULL, base) : 0;
}

static void copy(char *to, size_t size, const char *text)
{
    snprintf(to, size, "%s", text ? text : "");
}

static void place(weft_usb_board *board, unsigned long bus, unsigned long device)
{
    snprintf(board->place, sizeof board->place, "bus %lu, device %lu", bus, device);
}

/* True when the port belongs to a board that we know. */
static bool describe(struct udev_device *port, weft_usb_board *board)
{
    struct udev_device *const usb = udev_device_get_parent_with_subsystem_devtype(port, "usb", "usb_device");
    const char *const node = udev_device_get_devnode(port);
    const weft_usb_id *const id =
        usb ? find_id(number_of(usb, "idVendor", 16), number_of(usb, "idProduct", 16)) : NULL;
    if (!id || !node)
        return false;
    *board = (weft_usb_board){.id = id};
    copy(board->port, sizeof board->port, node);
    copy(board->serial, sizeof board->serial, udev_device_get_sysattr_value(usb, "serial"));
    copy(board->mm_ignored, sizeof board->mm_ignored,
         udev_device_get_property_value(port, "ID_MM_PORT_IGNORE"));
    place(board, number_of(usb, "busnum", 10), number_of(usb, "devnum", 10));
    return true;
}

static weft_err list_ports(weft_usb_board *boards, int max, int *n, weft_error *err)
{
    struct udev *const udev = udev_new();
    struct udev_enumerate *const ports = udev ? udev_enumerate_new(udev) : NULL;
    struct udev_list_entry *entry;
    if (!ports || udev_enumerate_add_match_subsystem(ports, "tty") < 0 ||
        udev_enumerate_scan_devices(ports) < 0) {
        udev_enumerate_unref(ports);
        udev_unref(udev);
        return weft_fail(err, WEFT_ERR_DEVICE,
                         "the serial ports cannot be listed by udev; name the port with --port");
    }
    udev_list_entry_foreach(entry, udev_enumerate_get_list_entry(ports))
    {
        struct udev_device *const port = udev_device_new_from_syspath(udev, udev_list_entry_get_name(entry));
        if (port && *n < max && describe(port, &boards[*n]))
            (*n)++;
        udev_device_unref(port);
    }
    udev_enumerate_unref(ports);
    udev_unref(udev);
    return WEFT_OK;
}

/* -- the others: libusb --------------------------------------------------------------------------------- */

static bool is_listed(const weft_usb_board *boards, int n, const weft_usb_board *board)
{
    for (int i = 0; i < n; i++)
        if (strcmp(boards[i].place, board->place) == 0)
            return true;
    return false;
}

/* A machine without USB has no such boards: nothing here is an error. */
static void list_portless(weft_usb_board *boards, int max, int *n)
{
    libusb_context *usb = NULL;
    libusb_device **devices = NULL;
    if (libusb_init(&usb) != 0)
        return;
    const ssize_t count = libusb_get_device_list(usb, &devices);
    for (ssize_t i = 0; i < count && *n < max; i++) {
        struct libusb_device_descriptor d;
        weft_usb_board board = {0};
        if (libusb_get_device_descriptor(devices[i], &d) != 0)
            continue;
        board.id = find_id(d.idVendor, d.idProduct);
        place(&board, libusb_get_bus_number(devices[i]), libusb_get_device_address(devices[i]));
        if (board.id && !is_listed(boards, *n, &board))
            boards[(*n)++] = board;
    }
    if (count >= 0)
        libusb_free_device_list(devices, 1);
    libusb_exit(usb);
}

weft_err weft_usb_boards_list(weft_usb_board *boards, int max, int *n, weft_error *err)
{
    *n = 0;
    WEFT_TRY(list_ports(boards, max, n, err));
    list_portless(boards, max, n);
    return WEFT_OK;
}
