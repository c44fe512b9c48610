/* --rig, --port and --camera: what a hardware command is told to open. */
#include "tests/support/support.h"

#include "core/file.h"
#include "host/cli/device_options.h"

#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <sys/wait.h>
#include <unistd.h>

typedef struct sample_args {
    int before;
    weft_device_options devices;
    int level;
} sample_args;

static const weft_field sample_fields[] = {
    WEFT_DEVICE_FIELDS(sample_args, devices),
    {.key = "level", .type = WEFT_FIELD_INT, .offset = offsetof(sample_args, level), .help = "a level"},
    {0},
};

static void test_rows_fill_the_embedded_struct(void **state)
{
    (void)state;
    sample_args args = {0};
    char *argv[] = {"--rig", "/tmp/r", "--camera=aravis:10.0.0.2", "--level", "3", "--port", "/dev/ttyACM0"};
    const weft_field *const tables[] = {sample_fields};
    void *const structs[] = {&args};
    const char *operands[8];
    int n;
    assert_ok(weft_fields_parse_argv(tables, structs, 1, 7, argv, operands, &n, err));
    assert_string_equal(args.devices.rig, "/tmp/r");
    assert_string_equal(args.devices.port, "/dev/ttyACM0");
    assert_string_equal(args.devices.camera, "aravis:10.0.0.2");
    assert_true(args.level == 3 && args.before == 0 && n == 0);
}

static const char *rig_folder(const char *name, const char *text)
{
    const char *const folder = weft_test_path(name);
    char path[1100];
    assert_ok(weft_folder_create(folder, err));
    snprintf(path, sizeof path, "%s/rig.json", folder);
    if (text)
        assert_ok(weft_file_write(path, text, strlen(text), err));
    return folder;
}

static void test_a_rigs_camera_by_its_backend(void **state)
{
    (void)state;
    char text[400];
    snprintf(text, sizeof text,
             "{\"weft\":\"rig\",\"version\":1,\"pty\":\"/dev/pts/7\",\"camera\":\"aravis:127.0.0.1\","
             "\"cameras\":[\"aravis:127.0.0.1\",\"gphoto:ptpip:127.0.0.1:15740\"],\"pid\":%ld}",
             (long)getpid());
    weft_device_names names;
    weft_device_options options = {.rig = rig_folder("two", text), .camera = "gphoto"};
    assert_ok(weft_device_options_resolve(&options, &names, err));
    assert_string_equal(names.camera, "gphoto:ptpip:127.0.0.1:15740");
    assert_string_equal(names.port, "/dev/pts/7");
    options.camera = "gphoto:usb:001,004";
    assert_ok(weft_device_options_resolve(&options, &names, err));
    assert_string_equal(names.camera, "gphoto:usb:001,004");
    options.camera = "auto";
    assert_ok(weft_device_options_resolve(&options, &names, err));
    assert_string_equal(names.camera, "auto");
    options.camera = "libcamera";
    assert_fails(weft_device_options_resolve(&options, &names, err), WEFT_ERR_MISSING,
                 "has no such camera, only aravis:127.0.0.1, gphoto:ptpip:127.0.0.1:15740");
}

static void test_names_come_from_the_options_first(void **state)
{
    (void)state;
    char text[300];
    snprintf(text, sizeof text,
             "{\"weft\":\"rig\",\"version\":1,\"pty\":\"/dev/pts/7\",\"camera\":\"aravis:127.0.0.1\","
             "\"control\":\"x\",\"pid\":%ld}",
             (long)getpid());
    weft_device_names names;
    weft_device_options options = {0};
    assert_ok(weft_device_options_resolve(&options, &names, err));
    assert_string_equal(names.port, "");
    assert_string_equal(names.camera, "auto");
    options.rig = rig_folder("alive", text);
    assert_ok(weft_device_options_resolve(&options, &names, err));
    assert_string_equal(names.port, "/dev/pts/7");
    assert_string_equal(names.camera, "aravis:127.0.0.1");
    options.port = "/dev/ttyACM0";
    assert_ok(weft_device_options_resolve(&options, &names, err));
    assert_string_equal(names.port, "/dev/ttyACM0");
    assert_string_equal(names.camera, "aravis:127.0.0.1");
}

static void test_a_rig_that_is_not_there_is_named(void **state)
{
    (void)state;
    char text[300], long_name[300];
    const pid_t ended = fork();
    if (ended == 0)
        _exit(0);
    assert_int_equal(waitpid(ended, NULL, 0), ended);
    snprintf(text, sizeof text,
             "{\"weft\":\"rig\",\"version\":1,\"pty\":\"/dev/pts/7\",\"camera\":\"a:b\",\"pid\":%ld}",
             (long)ended);
    memset(long_name, 'x', sizeof long_name - 1);
    long_name[sizeof long_name - 1] = '\0';
    const struct {
        const char *name, *text;
        weft_err code;
        const char *says;
    } bad[] = {
        {"none", NULL, WEFT_ERR_MISSING, "weft rig --dir"},
        {"dead", text, WEFT_ERR_DEVICE, "has ended"},
        {"cut", "{\"weft\":\"rig\",\"ver", WEFT_ERR_FORMAT, "rig.json"},
        {"set", "{\"weft\":\"set\",\"version\":1}", WEFT_ERR_FORMAT, "rig.json"},
        {"newer", "{\"weft\":\"rig\",\"version\":9}", WEFT_ERR_VERSION, "rig.json"},
        {"nopid", "{\"weft\":\"rig\",\"version\":1,\"pty\":\"p\",\"camera\":\"c\"}", WEFT_ERR_FORMAT,
         "\"pid\""},
    };
    weft_device_names names = {.port = "as it was"};
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
        const weft_device_options options = {.rig = rig_folder(bad[i].name, bad[i].text)};
        assert_fails(weft_device_options_resolve(&options, &names, err), bad[i].code, bad[i].says);
    }
    assert_fails(weft_device_options_resolve(&(weft_device_options){.port = long_name}, &names, err),
                 WEFT_ERR_USAGE, "--port");
    assert_fails(weft_device_options_resolve(&(weft_device_options){.camera = ""}, &names, err),
                 WEFT_ERR_USAGE, "--camera");
    assert_string_equal(names.port, "as it was");
}

/* Another process: opens the control socket, says so, sees that somebody waits, then is ready or ends. */
_Noreturn static void play_starting_rig(const char *folder, const char *text, int opened)
{
    struct sockaddr_un address = {.sun_family = AF_UNIX};
    char path[64];
    snprintf(address.sun_path, sizeof address.sun_path, "%s/control.sock", folder);
    const int fd = socket(AF_UNIX, SOCK_STREAM, 0);
    if (bind(fd, (const struct sockaddr *)&address, sizeof address) != 0 || listen(fd, 4) != 0 ||
        write(opened, "o", 1) != 1 || accept(fd, NULL, NULL) < 0)
        _exit(1);
    snprintf(path, sizeof path, "%s/rig.json", folder);
    if (!text || weft_file_write(path, text, strlen(text), NULL) != WEFT_OK)
        _exit(0);
    for (;;)
        pause();
}

/* `weft rig --dir r & weft capture twill.set --rig r` */
static void test_a_rig_that_is_starting_is_waited_for(void **state)
{
    (void)state;
    char text[300], folder[] = "/tmp/weft-rig-XXXXXX", path[64], byte; /* sockets have short paths */
    assert_non_null(mkdtemp(folder));
    snprintf(text, sizeof text,
             "{\"weft\":\"rig\",\"version\":1,\"pty\":\"/dev/pts/7\",\"camera\":\"aravis:127.0.0.1\","
             "\"control\":\"x\",\"pid\":%ld}",
             (long)getpid());
    for (int ready = 0; ready < 2; ready++) {
        int opened[2];
        weft_device_names names;
        assert_int_equal(pipe(opened), 0);
        const pid_t rig = fork();
        if (rig == 0)
            play_starting_rig(folder, ready ? text : NULL, opened[1]);
        assert_int_equal(read(opened[0], &byte, 1), 1);
        const weft_device_options options = {.rig = folder};
        if (ready)
            assert_ok(weft_device_options_resolve(&options, &names, err));
        else
            assert_fails(weft_device_options_resolve(&options, &names, err), WEFT_ERR_MISSING,
                         "weft rig --dir");
        kill(rig, SIGKILL);
        assert_int_equal(waitpid(rig, NULL, 0), rig);
        close(opened[0]);
        close(opened[1]);
        for (int file = 0; file < 2; file++) {
            snprintf(path, sizeof path, "%s/%s", folder, file ? "rig.json" : "control.sock");
            (void)remove(path);
        }
    }
    assert_int_equal(rmdir(folder), 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_rows_fill_the_embedded_struct),
        cmocka_unit_test(test_a_rig_that_is_starting_is_waited_for),
        cmocka_unit_test(test_names_come_from_the_options_first),
        cmocka_unit_test(test_a_rigs_camera_by_its_backend),
        cmocka_unit_test(test_a_rig_that_is_not_there_is_named),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
