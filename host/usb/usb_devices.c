#include "host/usb/usb_devices.h"

#include "core/mem.h"
#include "host/light/port_owner.h"

#include <errno.h>
#include <grp.h>
#include <libudev.h>
#include <poll.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

static const struct {
    const char *name;
    const char *number, *subclass, *protocol; /* of an interface */
} kinds[] = {
    {"still camera (PTP)", "06", "01", "01"},
    {"USB3 Vision camera", "ef", "05", "00"},
    {"serial board", NULL, NULL, NULL},
};

/* Makers of boards that may be a light controller: Arduino twice, the CH340 of copies. */
static const char *const board_makers[] = {"2341", "2a03", "1a86"};

const char *weft_usb_kind_name(weft_usb_kind kind)
{
    return kinds[kind].name;
}

/* ---- why it cannot be opened ---- */

/* Programs that take devices without being asked, and how to make them let go. */
static const struct {
    const char *program, *remedy;
} takers[] = {
    {"gvfsd-gphoto2",
     "the desktop has mounted it: eject it in the file manager, or \"gio mount -s gphoto2\""},
    {"gvfs-gphoto2-vo",
     "the desktop has mounted it: eject it in the file manager, or \"gio mount -s gphoto2\""},
    {"ModemManager",
     "ModemManager tries whether it is a modem: install udev/70-weft.rules, or wait half a minute"},
    {"brltty", "brltty takes it for a braille display: \"apt remove brltty\", or its version 6.5"},
};

static void say_who_has_it(weft_usb_device *d, const weft_port_user *user)
{
    for (size_t i = 0; i < sizeof takers / sizeof takers[0]; i++)
        if (strncmp(user->name, takers[i].program, strlen(takers[i].program)) == 0) {
            snprintf(d->problem, sizeof d->problem, "%s", takers[i].remedy);
            return;
        }
    snprintf(d->problem, sizeof d->problem, "another program is using it: %s (process %d); close that one",
             user->name[0] ? user->name : "a program", user->pid);
}

static void find_problem(weft_usb_device *d)
{
    struct stat at;
    weft_port_user user;
    if (!d->node[0] || stat(d->node, &at) != 0) {
        snprintf(d->problem, sizeof d->problem,
                 "its device file %s is not there: in a container, pass /dev/bus/usb through", d->node);
    } else if (access(d->node, R_OK | W_OK) != 0) {
        const struct group *const g = getgrgid(at.st_gid);
        snprintf(d->problem, sizeof d->problem,
                 "no permission to use %s (group %s, mode %03o): install udev/70-weft.rules and plug it in "
                 "again, or "
                 "join that group and log in again",
                 d->node, g ? g->gr_name : "?", (unsigned)(at.st_mode & 0777));
    } else if (weft_port_find_user(d->node, &user)) {
        say_who_has_it(d, &user);
    }
}

/* ---- what is there ---- */

static const char *attribute(struct udev_device *device, const char *name)
{
    const char *const value = udev_device_get_sysattr_value(device, name);
    return value ? value : "";
}

/* Fills what the USB device itself tells. */
static void describe(weft_usb_device *d, struct udev_device *usb)
{
    const char *const vendor = attribute(usb, "idVendor"), *const product = attribute(usb, "idProduct");
    snprintf(d->place, sizeof d->place, "%.31s", udev_device_get_sysname(usb));
    snprintf(d->serial, sizeof d->serial, "%.63s", attribute(usb, "serial"));
    snprintf(d->name, sizeof d->name, "%.47s %.47s", attribute(usb, "manufacturer"),
             attribute(usb, "product"));
    if (d->serial[0])
        snprintf(d->identity, sizeof d->identity, "%.8s:%.8s:%.63s", vendor, product, d->serial);
    else
        snprintf(d->identity, sizeof d->identity, "%.8s:%.8s@%.31s", vendor, product, d->place);
}

/* Which kind of camera this interface belongs to; -1: none. */
static int camera_kind(struct udev_device *interface)
{
    for (int k = WEFT_USB_STILL_CAMERA; k <= WEFT_USB_VISION_CAMERA; k++)
        if (strcmp(attribute(interface, "bInterfaceClass"), kinds[k].number) == 0 &&
            strcmp(attribute(interface, "bInterfaceSubClass"), kinds[k].subclass) == 0 &&
            strcmp(attribute(interface, "bInterfaceProtocol"), kinds[k].protocol) == 0)
            return k;
    return -1;
}

static bool is_board(struct udev_device *usb)
{
    for (size_t i = 0; i < sizeof board_makers / sizeof board_makers[0]; i++)
        if (strcmp(attribute(usb, "idVendor"), board_makers[i]) == 0)
            return true;
    return false;
}

/* The device that an interface or a serial line is of, when it is one of ours. */
static bool recognise(struct udev_device *part, weft_usb_device *d)
{
    struct udev_device *const usb = udev_device_get_parent_with_subsystem_devtype(part, "usb", "usb_device");
    const char *const subsystem = udev_device_get_subsystem(part);
    const char *node = NULL;
    *d = (weft_usb_device){0};
    if (!usb || !subsystem)
        return false;
    if (strcmp(subsystem, "tty") == 0) {
        if (!is_board(usb))
            return false;
        d->kind = WEFT_USB_CONTROLLER;
        node = udev_device_get_devnode(part);
    } else {
        const int kind = camera_kind(part);
        if (kind < 0)
            return false;
        d->kind = (weft_usb_kind)kind;
        node = udev_device_get_devnode(usb);
    }
    snprintf(d->node, sizeof d->node, "%.63s", node ? node : "");
    describe(d, usb);
    find_problem(d);
    return true;
}

static const weft_usb_device *find(const weft_usb_device *devices, int n, const weft_usb_device *wanted)
{
    for (int i = 0; i < n; i++)
        if (strcmp(devices[i].identity, wanted->identity) == 0 &&
            strcmp(devices[i].place, wanted->place) == 0)
            return &devices[i];
    return NULL;
}

static void list_subsystem(struct udev *udev, const char *subsystem, weft_usb_device *devices, int max,
                           int *n)
{
    struct udev_enumerate *const all = udev_enumerate_new(udev);
    struct udev_list_entry *entry;
    if (!all)
        return;
    udev_enumerate_add_match_subsystem(all, subsystem);
    udev_enumerate_scan_devices(all);
    udev_list_entry_foreach(entry, udev_enumerate_get_list_entry(all))
    {
        struct udev_device *const part = udev_device_new_from_syspath(udev, udev_list_entry_get_name(entry));
        weft_usb_device d;
        if (part && *n < max && recognise(part, &d) && !find(devices, *n, &d))
            devices[(*n)++] = d;
        if (part)
            udev_device_unref(part);
    }
    udev_enumerate_unref(all);
}

weft_err weft_usb_list(weft_usb_device *devices, int max, int *n, weft_error *err)
{
    struct udev *const udev = udev_new();
    *n = 0;
    if (!udev)
        return weft_fail(err, WEFT_ERR_DEVICE, "udev cannot be asked for USB devices");
    list_subsystem(udev, "usb", devices, max, n);
    list_subsystem(udev, "tty", devices, max, n);
    udev_unref(udev);
    return WEFT_OK;
}

/* ---- what comes and goes ---- */

struct weft_usb_watch {
    struct udev *udev;
    struct udev_monitor *monitor;
    int n_known, n_now;
    weft_usb_device known[WEFT_USB_MAX], now[WEFT_USB_MAX];
};

weft_err weft_usb_watch_open(weft_usb_watch **watch, weft_error *err)
{
    weft_usb_watch *const w = weft_alloc(1, sizeof *w, err);
    if (!w)
        return WEFT_ERR_NOMEM;
    w->udev = udev_new();
    /* "udev": told after its rules have run, so that permissions are set */
    w->monitor = w->udev ? udev_monitor_new_from_netlink(w->udev, "udev") : NULL;
    if (!w->monitor || udev_monitor_filter_add_match_subsystem_devtype(w->monitor, "usb", NULL) < 0 ||
        udev_monitor_filter_add_match_subsystem_devtype(w->monitor, "tty", NULL) < 0 ||
        udev_monitor_enable_receiving(w->monitor) < 0) {
        weft_usb_watch_close(w);
        return weft_fail(err, WEFT_ERR_DEVICE, "udev does not tell what is plugged in");
    }
    const weft_err status = weft_usb_list(w->known, WEFT_USB_MAX, &w->n_known, err);
    if (status != WEFT_OK) {
        weft_usb_watch_close(w);
        return status;
    }
    memcpy(w->now, w->known, sizeof w->now);
    w->n_now = w->n_known;
    *watch = w;
    return WEFT_OK;
}

void weft_usb_watch_close(weft_usb_watch *w)
{
    if (!w)
        return;
    if (w->monitor)
        udev_monitor_unref(w->monitor);
    if (w->udev)
        udev_unref(w->udev);
    weft_free(w);
}

/* One difference between what is known and what is there now, which is then known. */
static bool differ(weft_usb_watch *w, bool *appeared, weft_usb_device *device)
{
    for (int i = 0; i < w->n_known; i++)
        if (!find(w->now, w->n_now, &w->known[i])) {
            *device = w->known[i];
            *appeared = false;
            w->known[i] = w->known[--w->n_known];
            return true;
        }
    for (int i = 0; i < w->n_now; i++)
        if (w->n_known < WEFT_USB_MAX && !find(w->known, w->n_known, &w->now[i])) {
            *device = w->now[i];
            *appeared = true;
            w->known[w->n_known++] = w->now[i];
            return true;
        }
    return false;
}

weft_err weft_usb_watch_next(weft_usb_watch *w, int timeout_ms, bool *happened, bool *appeared,
                             weft_usb_device *device, weft_error *err)
{
    struct pollfd news = {.fd = udev_monitor_get_fd(w->monitor), .events = POLLIN};
    *happened = differ(w, appeared, device);
    if (*happened || poll(&news, 1, timeout_ms) <= 0)
        return WEFT_OK;
    struct udev_device *event;
    while ((event = udev_monitor_receive_device(w->monitor)) != NULL) /* what it is, the list tells */
        udev_device_unref(event);
    WEFT_TRY(weft_usb_list(w->now, WEFT_USB_MAX, &w->n_now, err));
    *happened = differ(w, appeared, device);
    return WEFT_OK;
}
