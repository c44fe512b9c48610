/* USB devices that come, go and come back elsewhere, in a machine that umockdev makes up. */
#include "tests/support/support.h"

#include "host/usb/usb_devices.h"

#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <umockdev.h>
#include <unistd.h>

static UMockdevTestbed *bed;

static int set_up(void **state)
{
    (void)state;
    bed = umockdev_testbed_new();
    return 0;
}

static int tear_down(void **state)
{
    (void)state;
    g_clear_object(&bed);
    return 0;
}

/* A USB device with one interface, as the kernel shows it.  serial NULL: it has none. */
static void plug(const char *place, const char *ids, const char *name, const char *serial,
                 const char *interface)
{
    char text[1600], line[200] = "", path[200];
    unsigned vendor, product, class, subclass, protocol;
    assert_int_equal(sscanf(ids, "%x:%x", &vendor, &product), 2);
    assert_int_equal(sscanf(interface, "%x/%x/%x", &class, &subclass, &protocol), 3);
    if (serial)
        snprintf(line, sizeof line, "A: serial=%s\\n\n", serial);
    snprintf(
        text, sizeof text,
        "P: /devices/usb1/%s\nN: bus/usb/001/00%c\nE: DEVNAME=/dev/bus/usb/001/00%c\nE: DEVTYPE=usb_device\n"
        "E: SUBSYSTEM=usb\nA: idVendor=%04x\\n\nA: idProduct=%04x\\n\nA: manufacturer=%s\\n\nA: "
        "product=body\\n\n%s\n",
        place, place[2], place[2], vendor, product, name, line);
    assert_true(umockdev_testbed_add_from_string(bed, text, NULL));
    snprintf(
        text, sizeof text,
        "P: /devices/usb1/%s/%s:1.0\nE: DEVTYPE=usb_interface\nE: SUBSYSTEM=usb\nA: bInterfaceClass=%02x\\n\n"
        "A: bInterfaceSubClass=%02x\\n\nA: bInterfaceProtocol=%02x\\n\n",
        place, place, class, subclass, protocol);
    assert_true(umockdev_testbed_add_from_string(bed, text, NULL));
    snprintf(path, sizeof path, "/sys/devices/usb1/%s/%s:1.0", place, place);
    umockdev_testbed_uevent(bed, path, "add");
}

static void unplug(const char *place)
{
    char path[200];
    snprintf(path, sizeof path, "/sys/devices/usb1/%s", place);
    umockdev_testbed_uevent(bed, path, "remove");
    snprintf(path, sizeof path, "/sys/devices/usb1/%s/%s:1.0", place, place);
    umockdev_testbed_remove_device(bed, path);
    snprintf(path, sizeof path, "/sys/devices/usb1/%s", place);
    umockdev_testbed_remove_device(bed, path);
}

static void add_line(const char *place, const char *tty)
{
    char text[400];
    snprintf(text, sizeof text,
             "P: /devices/usb1/%s/%s:1.0/tty/%s\nN: %s\nE: DEVNAME=/dev/%s\nE: SUBSYSTEM=tty\n", place, place,
             tty, tty, tty);
    assert_true(umockdev_testbed_add_from_string(bed, text, NULL));
}

static weft_usb_device next(weft_usb_watch *watch, bool wanted)
{
    weft_usb_device d;
    bool happened = false, appeared = false;
    for (int i = 0; i < 20 && !happened; i++)
        assert_ok(weft_usb_watch_next(watch, 200, &happened, &appeared, &d, err));
    assert_true(happened);
    assert_int_equal(appeared, wanted);
    return d;
}

static void test_kinds_and_identities(void **state)
{
    (void)state;
    weft_usb_device d[8];
    int n = 0;
    plug("1-1", "04b0:0429", "Nikon", "6001234", "06/01/01");
    plug("1-2", "1ab2:0001", "Allied", "U3V7", "ef/05/00");
    plug("1-3", "046d:c31c", "a keyboard", NULL, "03/01/01");
    plug("1-4", "1a86:7523", "QinHeng", NULL, "ff/01/02");
    add_line("1-4", "ttyUSB0");
    plug("1-5", "0403:6001", "not a board we know", "A5", "ff/ff/ff");
    add_line("1-5", "ttyUSB1");
    assert_ok(weft_usb_list(d, 8, &n, err));
    assert_int_equal(n, 3);
    int seen[3] = {0};
    for (int i = 0; i < n; i++) {
        seen[d[i].kind]++;
        const char *const wanted[] = {"04b0:0429:6001234", "1ab2:0001:U3V7", "1a86:7523@1-4"};
        assert_string_equal(d[i].identity, wanted[d[i].kind]);
        if (d[i].kind == WEFT_USB_STILL_CAMERA)
            assert_string_equal(d[i].name, "Nikon body");
    }
    assert_true(seen[0] == 1 && seen[1] == 1 && seen[2] == 1);
    assert_ok(weft_usb_list(d, 1, &n, err));
    assert_int_equal(n, 1);
}

static void test_a_camera_comes_goes_and_comes_back_elsewhere(void **state)
{
    (void)state;
    weft_usb_watch *watch = NULL;
    bool happened = true, appeared;
    weft_usb_device d;
    plug("1-3", "046d:c31c", "a keyboard", NULL, "03/01/01");
    assert_ok(weft_usb_watch_open(&watch, err));
    assert_ok(weft_usb_watch_next(watch, 50, &happened, &appeared, &d, err));
    assert_false(happened);
    plug("1-1", "04b0:0429", "Nikon", "6001234", "06/01/01");
    d = next(watch, true);
    assert_string_equal(d.identity, "04b0:0429:6001234");
    assert_string_equal(d.place, "1-1");
    unplug("1-1");
    d = next(watch, false);
    assert_string_equal(d.identity, "04b0:0429:6001234");
    plug("1-2", "04b0:0429", "Nikon", "6001234", "06/01/01");
    d = next(watch, true);
    assert_string_equal(d.identity, "04b0:0429:6001234"); /* the same one */
    assert_string_equal(d.place, "1-2");
    assert_string_equal(d.node, "/dev/bus/usb/001/002");
    unplug("1-2");
    unplug("1-3");
    next(watch, false);
    assert_ok(weft_usb_watch_next(watch, 50, &happened, &appeared, &d, err));
    assert_false(happened);
    weft_usb_watch_close(watch);
}

/* As somebody who is not root: exit status 0 when the only device says these words. */
static int look_as_nobody(const char *words)
{
    const pid_t pid = fork();
    int status = -1;
    if (pid == 0) {
        weft_usb_device d[2];
        int n = 0;
        if (setresuid(65534, 65534, 65534) != 0 || weft_usb_list(d, 2, &n, NULL) != WEFT_OK || n != 1)
            _exit(2);
        _exit(strstr(d[0].problem, words) ? 0 : 1);
    }
    waitpid(pid, &status, 0);
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

static void test_why_it_cannot_be_opened(void **state)
{
    (void)state;
    weft_usb_device d[2];
    int n = 0;
    char *const root = umockdev_testbed_get_root_dir(bed), *const node = g_strdup_printf(
                                                               "%s/dev/bus/usb/001/001", root);
    plug("1-1", "04b0:0429", "Nikon", "6001234", "06/01/01");
    assert_ok(weft_usb_list(d, 2, &n, err));
    assert_string_equal(d[0].problem, "");
    if (getuid() == 0) { /* root may everything */
        assert_int_equal(chmod(root, 0755) | chmod(node, 0600), 0);
        assert_int_equal(
            look_as_nobody("no permission to use /dev/bus/usb/001/001 (group root, mode 600): install "
                           "udev/70-weft.rules"),
            0);
        assert_int_equal(chmod(node, 0666), 0);
        assert_int_equal(look_as_nobody("permission"), 1);
    }
    assert_int_equal(unlink(node), 0);
    assert_ok(weft_usb_list(d, 2, &n, err));
    assert_non_null(strstr(d[0].problem, "is not there: in a container"));
    g_free(node);
    g_free(root);
}

int main(void)
{
    const char *const preload = getenv("LD_PRELOAD");
    if (!preload || !strstr(preload, "libumockdev-preload")) {
        print_message("skipped: runs under umockdev-wrapper only\n");
        return 77;
    }
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(test_kinds_and_identities, set_up, tear_down),
        cmocka_unit_test_setup_teardown(test_a_camera_comes_goes_and_comes_back_elsewhere, set_up, tear_down),
        cmocka_unit_test_setup_teardown(test_why_it_cannot_be_opened, set_up, tear_down),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
