/*
 * The gphoto backend on the virtual D5100: what it sets, what it refuses, and the rows "DSLR" of the fault
 * matrix (docs/capture.md).  WEFT_TEST_BUSY_S (default 3) is how long a body stays busy: 60 is the real
 * thing.
 */
#include "tests/support/support.h"

#include "core/file.h"
#include "core/formats/raw_file.h"
#include "core/mem.h"
#include "core/progress.h"
#include "core/text.h"
#include "host/camera/camera.h"
#include "host/camera/gphoto_bodies.h"
#include "host/camera/gphoto_session.h"
#include "tests/host/rig_process.h"

#include <dirent.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#define DEADLINE_S  1.0
#define FRAME_BYTES ((size_t)2 * 308 * 204)

extern const weft_camera_backend weft_camera_gphoto;

static rig_process rig;
static char id[128];               /* "gphoto:ptpip:127.0.0.1:15740" */
static weft_camera_device *camera; /* of the running test */
static weft_captured_frame frame;

static json_t *tell(const char *words)
{
    char line[100];
    snprintf(line, sizeof line, "dslr %s", words);
    return rig_process_tell(&rig, line);
}

static void order(const char *words)
{
    json_decref(tell(words));
}

static int state_of(const char *key)
{
    json_t *const state = tell("state");
    const int value = (int)json_integer_value(json_object_get(state, key));
    json_decref(state);
    return value;
}

static int setting(const char *code)
{
    json_t *const state = tell("state");
    const int value = (int)json_integer_value(json_object_get(json_object_get(state, "settings"), code));
    json_decref(state);
    return value;
}

static int start_rig(void **state)
{
    (void)state;
    static const char *const options[] = {"--size", "308x204", "--sample", "twill", NULL};
    setenv("HOME", weft_test_folder(), 1); /* libgphoto2 keeps its own settings there */
    rig_process_start(&rig, weft_test_path("rig"), options);
    char path[600];
    json_t *json = NULL;
    snprintf(path, sizeof path, "%s/rig.json", rig.dir);
    json = json_load_file(path, 0, NULL);
    snprintf(id, sizeof id, "%s", json_string_value(json_array_get(json_object_get(json, "cameras"), 1)));
    json_decref(json);
    return 0;
}

static int end_rig(void **state)
{
    (void)state;
    return rig_process_end(&rig, 0);
}

static int begin(void **state)
{
    (void)state;
    order("reset");
    return 0;
}

static int end(void **state)
{
    (void)state;
    weft_camera_close(camera);
    camera = NULL;
    weft_captured_frame_fini(&frame);
    frame = (weft_captured_frame){0};
    return 0;
}

/* In this process, so that sanitizers see it. */
static void open_camera(double exposure_s)
{
    const weft_camera_settings wanted = {.exposure_s = exposure_s, .gain = 1};
    assert_ok(weft_camera_open_on(&weft_camera_gphoto, id + strlen("gphoto:"), &camera, err));
    assert_ok(weft_camera_configure(camera, &wanted, err));
}

static void expose(weft_frame_status status, const char *words)
{
    assert_ok(weft_camera_expose(camera, DEADLINE_S, &frame, err));
    if (frame.status != status || !strstr(frame.reason, words))
        fail_msg("status %d: \"%s\", wanted %d: %s", frame.status, frame.reason, status, words);
}

static void expose_whole(void)
{
    expose(WEFT_FRAME_COMPLETE, "");
    assert_true(frame.mosaic.width == 308 && frame.mosaic.height == 204 && frame.mosaic.cfa == WEFT_CFA_RGGB);
    assert_string_equal(frame.file.suffix, ".nef");
}

/* ---- without a camera ---- */

static void test_shutter_speeds_as_libgphoto2_writes_them(void **state)
{
    (void)state;
    static const struct {
        const char *text;
        double seconds;
    } good[] = {{"1/30", 1.0 / 30}, {"10/25", 0.4}, {"0.0333s", 0.0333}, {"2", 2},
                {"1.3", 1.3},       {"0\"8", 0.8},  {"30\"", 30}};
    static const char *const bad[] = {"Bulb", "Time", "x 200", "",       "1/", "/30",
                                      "0",    "-1",   "1/0",   "1/30/2", "nan"};
    double s;
    for (size_t i = 0; i < sizeof good / sizeof good[0]; i++) {
        assert_true(gphoto_parse_shutter(good[i].text, &s));
        assert_near(s, good[i].seconds, 1e-12);
    }
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++)
        assert_false(gphoto_parse_shutter(bad[i], &s));
    static const char *const list[] = {"Bulb", "1/60", "1/50", "1/40", "30"};
    assert_int_equal(gphoto_nearest_shutter(list, 5, 0.0183, &s), 2); /* sqrt(1/60 * 1/50) is 0.01826 */
    assert_int_equal(gphoto_nearest_shutter(list, 5, 0.0182, &s), 1);
    assert_int_equal(gphoto_nearest_shutter(list, 1, 1, &s), -1);
}

static void test_bodies_by_name(void **state)
{
    (void)state;
    static const char *const choices[] = {"JPEG Fine", "RAW", "NEF (Raw)"};
    assert_string_equal(gphoto_body_find("Nikon Corporation", "D5100")->vendor, "Nikon");
    assert_string_equal(gphoto_body_find("Canon Inc.", "EOS 1100D")->vendor, "Canon");
    assert_string_equal(gphoto_body_find("", "")->vendor, "");
    assert_int_equal(gphoto_find_value(choices, 3, "NEF (Raw)|RAW"), 2);
    assert_int_equal(gphoto_find_value(choices, 3, "NEF|RAW"), 1);
    assert_int_equal(gphoto_find_value(choices, 3, "RA"), -1);
}

/* Each of libgphoto2's codes is one line that names the camera and what was done. */
static void test_errors_in_words(void **state)
{
    (void)state;
    static const struct {
        int code;
        weft_err status;
        const char *words;
    } some[] = {{GP_ERROR_IO_USB_CLAIM, WEFT_ERR_DEVICE, "gio mount -s gphoto2"},
                {GP_ERROR_IO_USB_FIND, WEFT_ERR_DEVICE, "plug it in"},
                {GP_ERROR_IO_LOCK, WEFT_ERR_DEVICE, "close that one"},
                {GP_ERROR_CAMERA_BUSY, WEFT_ERR_TIMEOUT, "access lamp"},
                {GP_ERROR_NO_SPACE, WEFT_ERR_DEVICE, "empty its card"},
                {GP_ERROR_TIMEOUT, WEFT_ERR_TIMEOUT, "did not answer"},
                {-1234, WEFT_ERR_DEVICE, "libgphoto2 error -1234"}};
    gphoto_session s = {.address = "usb:001,042", .port = "usb:001,042", .words = "said so"};
    for (size_t i = 0; i < sizeof some / sizeof some[0]; i++)
        assert_fails(gphoto_fail(&s, some[i].code, "connecting", err), some[i].status, some[i].words);
    for (int code = -1; code > -130; code--) {
        weft_error error = {0};
        assert_true(gphoto_fail(&s, code, "connecting", &error) != WEFT_OK);
        assert_ptr_equal(strstr(error.text, "camera usb:001,042: connecting: "), error.text);
        assert_non_null(strstr(error.text, "said so"));
        assert_null(strchr(error.text, '\n'));
    }
}

/* ---- who it is, what it is set to ---- */

static void test_opening_releases_nothing_configuring_once(void **state)
{
    (void)state;
    const int before = state_of("releases");
    assert_ok(weft_camera_open_on(&weft_camera_gphoto, id + strlen("gphoto:"), &camera, err));
    const weft_camera_state *const info = weft_camera_get_state(camera);
    assert_string_equal(info->vendor, "Nikon Corporation");
    assert_string_equal(info->model, "D5100");
    assert_string_equal(info->serial, "6001234");
    assert_int_equal(info->width, 0);
    assert_int_equal(state_of("releases"), before);
    assert_ok(weft_camera_configure(camera, &(weft_camera_settings){.exposure_s = 0.5}, err));
    assert_true(info->width == 308 && info->height == 204 && info->cfa == WEFT_CFA_RGGB && info->bits == 14);
    assert_true(info->black[0] == 0 && info->white == 15846 && info->exposure_s == 0.5 && info->gain == 1);
    assert_string_equal(info->suffix, ".nef");
    assert_int_equal(state_of("releases"), before + 1);
    assert_ok(weft_camera_configure(camera, &(weft_camera_settings){.exposure_s = 0.02}, err));
    assert_int_equal(state_of("releases"), before + 1);
}

static void test_settings_are_made(void **state)
{
    (void)state;
    order("turn 0xd06b 1");
    order("turn 0xd0c0 1");
    order("turn 0xd130 1");
    order("turn 0x5013 0x8011");
    open_camera(0.02);
    assert_int_equal(setting("0x5004"), 4); /* NEF; it began with JPEG */
    assert_int_equal(setting("0x500f"), 100);
    assert_int_equal(setting("0xd10b"), 1); /* into its memory; it began with the card */
    assert_int_equal(setting("0xd16a"), 0); /* automatic ISO; it began with on */
    assert_int_equal(setting("0xd06b"), 0); /* noise reduction */
    assert_int_equal(setting("0xd0c0"), 0); /* bracketing */
    assert_int_equal(setting("0xd130"), 0); /* HDR */
    assert_int_equal(setting("0x5013"), 1); /* single frame, was the timer */
}

static void refused(const char *turn, const char *lock, const char *words)
{
    order("reset");
    order(turn);
    if (lock)
        order(lock);
    assert_fails(weft_camera_open_on(&weft_camera_gphoto, id + strlen("gphoto:"), &camera, err),
                 WEFT_ERR_UNSUPPORTED, words);
    assert_null(camera);
}

static void test_what_it_cannot_set_is_refused(void **state)
{
    (void)state;
    refused("turn 0x5004 2", "lock 0x5004",
            "imagequality stays at \"JPEG Fine\" and must be \"NEF (Raw)\"; choose NEF");
    refused("turn 0xd06b 1", "lock 0xd06b", "longexpnr stays at \"On\"");
    refused("turn 0x500e 2", NULL, "turn the mode dial to M");
    refused("turn 0x5013 0x8011", "lock 0x5013", "set the release mode to single frame");
    refused("turn 0x500a 0x8010", NULL, "manual focus");
}

static void test_exposure_is_the_nearest_there_is(void **state)
{
    (void)state;
    weft_camera_settings wanted = {.exposure_s = 0.0415, .gain = 3};
    open_camera(0.02);
    const weft_camera_state *const info = weft_camera_get_state(camera);
    assert_near(info->exposure_s, 1.0 / 50, 1e-12);
    assert_ok(weft_camera_configure(camera, &wanted, err));
    assert_near(info->exposure_s, 1.0 / 25, 1e-12);
    assert_near(info->gain, 3.2, 1e-12);
    expose_whole();
    assert_near(frame.exposure_s, 1.0 / 25, 1e-12);
    wanted.exposure_s = 34; /* a sixth of a stop over the longest */
    assert_ok(weft_camera_configure(camera, &wanted, err));
    assert_near(info->exposure_s, 30, 1e-12);
    wanted.exposure_s = 60;
    assert_fails(weft_camera_configure(camera, &wanted, err), WEFT_ERR_RANGE, "only 0.00025 to 30 s");
    wanted = (weft_camera_settings){.exposure_s = 0.1, .gain = 500};
    assert_fails(weft_camera_configure(camera, &wanted, err), WEFT_ERR_RANGE, "ISO 50000");
    wanted = (weft_camera_settings){.trigger = WEFT_TRIGGER_WIRE};
    assert_fails(weft_camera_configure(camera, &wanted, err), WEFT_ERR_UNSUPPORTED, "trigger line");
}

/* ---- frames ---- */

/* The frame is what the file holds for any reader, and the helper brings both unchanged. */
static void check_file(void)
{
    weft_mosaic read;
    weft_frame_info info;
    char path[600];
    snprintf(path, sizeof path, "%s", weft_test_path("frame.nef"));
    assert_ok(weft_file_write(path, frame.file.bytes, frame.file.size, err));
    assert_ok(weft_raw_read(path, &read, &info, err));
    assert_true(read.width == 308 && read.height == 204 && read.white == 15846);
    assert_memory_equal(read.data, frame.mosaic.data, FRAME_BYTES);
    assert_near(info.exposure_s, 0.02, 1e-6);
    assert_near(info.iso, 100, 0);
    assert_string_equal(info.serial, "6001234");
    weft_mosaic_fini(&read);
}

static void test_frame_is_the_cameras_file(void **state)
{
    (void)state;
    open_camera(0.02);
    expose_whole();
    check_file();
    uint64_t first = frame.sequence;
    expose_whole();
    assert_true(frame.sequence == first + 1);
    end(NULL);
    assert_ok(weft_camera_open(id, &camera, err));
    assert_ok(weft_camera_configure(camera, &(weft_camera_settings){.exposure_s = 0.02, .gain = 1}, err));
    assert_string_equal(weft_camera_get_state(camera)->suffix, ".nef");
    expose_whole();
    check_file();
}

static int count_descriptors(void)
{
    int n = 0;
    DIR *const d = opendir("/proc/self/fd");
    while (readdir(d))
        n++;
    closedir(d);
    return n;
}

static void test_nothing_is_left_open(void **state)
{
    (void)state;
    open_camera(0.02);
    end(NULL);
    const int before = count_descriptors();
    for (int i = 0; i < 3; i++) {
        open_camera(0.02);
        expose_whole();
        end(NULL);
    }
    assert_int_equal(count_descriptors(), before);
    json_t *const after = tell("state");
    assert_true(json_is_false(json_object_get(after, "session")));
    json_decref(after);
}

static void test_a_second_program_is_refused(void **state)
{
    (void)state;
    weft_camera_device *other = NULL;
    open_camera(0.02);
    assert_fails(weft_camera_open_on(&weft_camera_gphoto, id + strlen("gphoto:"), &other, err),
                 WEFT_ERR_DEVICE, "another program has it");
    expose_whole();
}

static weft_err cancel_soon(void *context, weft_error *err)
{
    return ++*(int *)context > 3 ? weft_fail(err, WEFT_ERR_CANCELLED, "enough") : WEFT_OK;
}

static void test_waiting_can_be_cancelled(void **state)
{
    (void)state;
    int n = 0;
    open_camera(0.02);
    order("fault no-shutter 1");
    weft_camera_set_idle(camera, cancel_soon, &n);
    const double start_s = weft_clock_s();
    assert_fails(weft_camera_expose(camera, 30, &frame, err), WEFT_ERR_CANCELLED, "enough");
    assert_true(weft_clock_s() - start_s < 20);
    weft_camera_set_idle(camera, NULL, NULL);
    expose_whole();
}

/* ---- the fault matrix ---- */

static double busy_s(void)
{
    const char *const text = getenv("WEFT_TEST_BUSY_S");
    double seconds = 3;
    assert_true(!text || weft_text_to_double(text, &seconds));
    return seconds;
}

static void order_busy(const char *fault)
{
    char words[40];
    snprintf(words, sizeof words, "fault %s %g", fault, busy_s());
    order(words);
}

/* Busy with something else: it says so, and the next frame comes when it is done. */
static void test_dslr_busy(void **state)
{
    (void)state;
    open_camera(0.02);
    order_busy("busy");
    const double start_s = weft_clock_s();
    weft_err status = weft_camera_expose(camera, 0.5, &frame, NULL);
    assert_true(status == WEFT_OK && frame.status == WEFT_FRAME_TIMEOUT);
    assert_non_null(strstr(frame.reason, "the camera is busy"));
    while (weft_clock_s() - start_s < busy_s() + 60 && frame.status != WEFT_FRAME_COMPLETE)
        assert_ok(weft_camera_expose(camera, 0.5, &frame, err));
    expose_whole();
}

/* Busy after the release, inside libgphoto2, which would wait for 1000 s: the helper is ended. */
static void test_dslr_busy_60_s_inside_the_library(void **state)
{
    (void)state;
    assert_ok(weft_camera_open(id, &camera, err));
    assert_ok(weft_camera_configure(camera, &(weft_camera_settings){.exposure_s = 0.02, .gain = 1}, err));
    const long first = weft_camera_process(camera);
    order("fault stuck 60");
    setenv("WEFT_CAMERA_PATIENCE", "1", 1);
    const double start_s = weft_clock_s();
    assert_ok(weft_camera_expose(camera, 0.5, &frame, err));
    unsetenv("WEFT_CAMERA_PATIENCE");
    assert_int_equal(frame.status, WEFT_FRAME_ABORTED);
    assert_non_null(strstr(frame.reason, "did not answer in time"));
    assert_true(weft_clock_s() - start_s < 30);
    order("fault busy 0");
    expose_whole(); /* in a new helper, set as before */
    assert_true(weft_camera_process(camera) != first);
    assert_near(frame.exposure_s, 0.02, 1e-9);
}

static void test_dslr_io_error(void **state)
{
    (void)state;
    open_camera(0.02);
    order("fault line 1");
    expose(WEFT_FRAME_INCOMPLETE, "the line to the camera broke and was connected again");
    expose_whole();
}

static void test_dslr_raw_and_jpeg_pair(void **state)
{
    (void)state;
    open_camera(0.02);
    order("turn 0x5004 5");
    expose_whole();
    expose_whole(); /* the JPEG of the first is no trouble to the second */
}

static void test_dslr_jpeg_only(void **state)
{
    (void)state;
    open_camera(0.02);
    order("turn 0x5004 2");
    expose(WEFT_FRAME_INCOMPLETE, "the camera sent a JPEG");
    assert_int_equal(setting("0x5004"), 4); /* set again */
    expose_whole();
    order("turn 0x5004 2");
    order("lock 0x5004");
    assert_fails(weft_camera_expose(camera, DEADLINE_S, &frame, err), WEFT_ERR_UNSUPPORTED,
                 "and must be \"NEF (Raw)\"");
}

static void test_dslr_unplugged_during_download(void **state)
{
    (void)state;
    open_camera(0.02);
    order("fault unplug 40");
    const double start_s = weft_clock_s();
    assert_fails(weft_camera_expose(camera, DEADLINE_S, &frame, err), WEFT_ERR_DEVICE,
                 "does not come back; plug it in");
    assert_true(weft_clock_s() - start_s < 30);
    order("plug");
    expose(WEFT_FRAME_INCOMPLETE, "connected again");
    expose_whole();
    assert_near(frame.exposure_s, 0.02, 1e-12);
}

static void test_dslr_card_full(void **state)
{
    (void)state;
    open_camera(0.02);
    order("fault card-full 1");
    assert_fails(weft_camera_expose(camera, DEADLINE_S, &frame, err), WEFT_ERR_DEVICE, "there is no room");
    order("fault card-full 0");
    expose_whole();
}

static void test_dslr_battery_low(void **state)
{
    (void)state;
    open_camera(0.02);
    order("turn 0x5001 3");
    for (int i = 0; i < 40; i++) { /* libgphoto2 remembers a setting for 2 s */
        const weft_err status = weft_camera_expose(camera, DEADLINE_S, &frame, NULL);
        if (status != WEFT_OK)
            break;
    }
    assert_fails(weft_camera_expose(camera, DEADLINE_S, &frame, err), WEFT_ERR_DEVICE,
                 "battery is at 3 %; charge it");
    end(NULL);
    assert_fails(weft_camera_open_on(&weft_camera_gphoto, id + strlen("gphoto:"), &camera, err),
                 WEFT_ERR_DEVICE, "battery is at 3 %");
    order("turn 0x5001 90");
    open_camera(0.02);
    expose_whole();
}

static void test_dslr_picture_announced_twice(void **state)
{
    (void)state;
    open_camera(0.02);
    for (int i = 0; i < 3; i++) {
        order("fault twice 1");
        expose_whole();
    }
}

static void test_dslr_picture_before_announced_again(void **state)
{
    (void)state;
    weft_mosaic last;
    open_camera(0.02);
    expose_whole();
    assert_ok(weft_mosaic_init(&last, 308, 204, WEFT_CFA_RGGB, err));
    for (int i = 0; i < 3; i++) {
        memcpy(last.data, frame.mosaic.data, FRAME_BYTES);
        order("fault stale 1");
        expose_whole();
        assert_memory_not_equal(last.data, frame.mosaic.data, FRAME_BYTES);
    }
    weft_mosaic_fini(&last);
}

static void test_dslr_two_pictures_of_one_release(void **state)
{
    (void)state;
    open_camera(0.02);
    order("fault burst 1");
    expose(WEFT_FRAME_INCOMPLETE, "two pictures for one release");
    expose_whole();
}

static void test_dslr_shutter_does_not_fire(void **state)
{
    (void)state;
    open_camera(0.02);
    order("fault no-shutter 1");
    const double start_s = weft_clock_s();
    expose(WEFT_FRAME_TIMEOUT, "did the shutter open?");
    assert_true(weft_clock_s() - start_s < 0.02 + DEADLINE_S + 20);
    expose_whole();
}

static void test_dslr_file_cut_short(void **state)
{
    (void)state;
    open_camera(0.02);
    order("fault short 1");
    expose(WEFT_FRAME_INCOMPLETE, "is cut short");
    expose_whole();
}

static void test_dslr_dial_turned_by_hand(void **state)
{
    (void)state;
    open_camera(0.02);
    order("turn 0xd100 65566"); /* 1/30 */
    expose(WEFT_FRAME_INCOMPLETE, "0.02 s was set; was a dial turned?");
    expose_whole();
    order("turn 0x500f 800");
    expose(WEFT_FRAME_INCOMPLETE, "ISO 800 where 100 was set");
    expose_whole();
}

static void test_dslr_gone(void **state)
{
    (void)state;
    order("unplug");
    assert_fails(weft_camera_open_on(&weft_camera_gphoto, id + strlen("gphoto:"), &camera, err),
                 WEFT_ERR_DEVICE, "check the cable");
    assert_fails(weft_camera_open_on(&weft_camera_gphoto, "serial:999", &camera, err), WEFT_ERR_DEVICE,
                 "weft devices");
    assert_fails(weft_camera_open_on(&weft_camera_gphoto, "parport:1", &camera, err), WEFT_ERR_UNSUPPORTED,
                 "wanted usb:BUS,DEVICE");
}

int main(void)
{
#define ON_RIG(test) cmocka_unit_test_setup_teardown(test, begin, end)
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_shutter_speeds_as_libgphoto2_writes_them),
        cmocka_unit_test(test_bodies_by_name),
        cmocka_unit_test(test_errors_in_words),
        ON_RIG(test_opening_releases_nothing_configuring_once),
        ON_RIG(test_settings_are_made),
        ON_RIG(test_what_it_cannot_set_is_refused),
        ON_RIG(test_exposure_is_the_nearest_there_is),
        ON_RIG(test_frame_is_the_cameras_file),
        ON_RIG(test_nothing_is_left_open),
        ON_RIG(test_a_second_program_is_refused),
        ON_RIG(test_waiting_can_be_cancelled),
        ON_RIG(test_dslr_busy),
        ON_RIG(test_dslr_busy_60_s_inside_the_library),
        ON_RIG(test_dslr_io_error),
        ON_RIG(test_dslr_raw_and_jpeg_pair),
        ON_RIG(test_dslr_jpeg_only),
        ON_RIG(test_dslr_unplugged_during_download),
        ON_RIG(test_dslr_card_full),
        ON_RIG(test_dslr_battery_low),
        ON_RIG(test_dslr_picture_announced_twice),
        ON_RIG(test_dslr_picture_before_announced_again),
        ON_RIG(test_dslr_two_pictures_of_one_release),
        ON_RIG(test_dslr_shutter_does_not_fire),
        ON_RIG(test_dslr_file_cut_short),
        ON_RIG(test_dslr_dial_turned_by_hand),
        ON_RIG(test_dslr_gone),
    };
    return cmocka_run_group_tests(tests, start_rig, end_rig);
}
