/* The whole virtual scanner as a process: firmware over its pty, camera over GigE Vision, control socket. */
#include "core/file.h"
#include "host/camera/camera.h"
#include "host/light/controller.h"
#include "host/rig/render.h"
#include "host/rig/rig_control.h"
#include "host/set/maps.h"
#include "tests/host/rig_process.h"
#include "tests/support/support.h"

#include <math.h>
#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#define WIDTH  308
#define HEIGHT 204

static const char *const options[] = {"--size", "308x204", "--seed", "3", "--sample", "white", NULL};

static weft_rig_scene scene;
static weft_rig_view view;

/* The same scanner, made here. */
static void make_scene(void)
{
    weft_rig_setup setup;
    weft_rig_setup_init(&setup);
    setup.size = (weft_size){WIDTH, HEIGHT};
    setup.seed = 3;
    assert_ok(weft_rig_scene_init(&scene, &setup, err));
    assert_ok(weft_rig_view_sensor(&view, &scene, err));
}

static void render(const char *name, weft_rig_frames *frames)
{
    static weft_rig_sample sample;
    assert_ok(weft_rig_sample_init(&sample, &scene, name, err));
    assert_ok(weft_rig_frames_init(frames, &scene, &view, &sample, err));
    weft_rig_sample_fini(&sample);
}

static void take(weft_camera_device *camera, double exposure_s, double gain, weft_captured_frame *frame)
{
    assert_ok(
        weft_camera_configure(camera, &(weft_camera_settings){.exposure_s = exposure_s, .gain = gain}, err));
    for (int tries = 0; tries < 3; tries++) {
        assert_ok(weft_camera_expose(camera, 5, frame, err));
        if (frame->status == WEFT_FRAME_COMPLETE)
            return;
        print_message("frame not complete (%s), again\n", frame->reason);
    }
    fail_msg("no complete frame in three tries");
}

/* Every photosite is what lamp and room make there, within its noise; lamp -1: none. */
static void compare(const weft_captured_frame *frame, const weft_rig_frames *frames, int lamp)
{
    const double scale = frame->exposure_s * frame->gain * (15871 - 256);
    const double per_electron = frame->gain * (15871 - 256) / 30000;
    double sum = 0, sum2 = 0;
    for (int i = 0; i < WIDTH * HEIGHT; i++) {
        const double light = (lamp >= 0 ? (double)frames->light[lamp][i] : 0) + (double)frames->room[i];
        const double mean = 256 + scale * light;
        const double variance = (mean - 256) * per_electron + 9 * per_electron * per_electron +
                                pow(0.003 * (mean - 256), 2) + 1 / 12.0;
        const double off = (frame->mosaic.data[i] - mean) / sqrt(variance);
        sum += off;
        sum2 += off * off;
    }
    const double n = WIDTH * HEIGHT, mean = sum / n, sigma = sqrt(sum2 / n - mean * mean);
    print_message("lamp %2d, %.3f s, gain %.3f: off by %+.3f sigma, spread %.3f sigma\n", lamp,
                  frame->exposure_s, frame->gain, mean, sigma);
    assert_near(mean, 0, 0.05);
    assert_near(sigma, 1, 0.02);
}

static void frames_show_the_lamp_that_is_on(void **state)
{
    (void)state;
    rig_process rig;
    weft_rig_frames frames;
    weft_captured_frame frame = {0};
    weft_controller *controller;
    weft_camera_device *camera;
    make_scene();
    rig_process_start(&rig, weft_test_path("rig"), options);
    assert_ok(weft_camera_open(rig.camera, &camera, err));
    const weft_camera_state *const info = weft_camera_get_state(camera);
    assert_string_equal(info->vendor, "Weft");
    assert_string_equal(info->model, "Virtual scanner");
    assert_true(info->width == WIDTH && info->height == HEIGHT && info->cfa == WEFT_CFA_RGGB);
    assert_true(info->black[0] == 256 && info->white == 15871);
    render("white", &frames);
    assert_ok(weft_controller_open(rig.pty, 5000, &controller, err));
    const int level = weft_controller_get_info(controller)->level_max;
    take(camera, 0.04, 1, &frame);
    compare(&frame, &frames, -1);
    for (int lamp = 0; lamp < WEFT_RIG_N_LIGHTS; lamp += 3) {
        assert_ok(weft_controller_light(controller, UINT32_C(1) << lamp, level, 2000, NULL, err));
        take(camera, 0.03, 1, &frame);
        compare(&frame, &frames, lamp);
    }
    take(camera, 0.01, 2, &frame); /* lamp 9 again */
    assert_near(frame.gain, 2, 0.002);
    compare(&frame, &frames, 9);
    weft_rig_frames_fini(&frames);

    weft_controller_close(controller); /* rendering may take longer than the longest lease */
    json_decref(rig_process_tell(&rig, "sample houndstooth"));
    render("houndstooth", &frames);
    assert_ok(weft_controller_open(rig.pty, 5000, &controller, err));
    assert_ok(weft_controller_light(controller, 1u << 4, level, 2000, NULL, err));
    take(camera, 0.04, 1, &frame);
    compare(&frame, &frames, 4);
    weft_rig_frames_fini(&frames);

    json_t *const reply = rig_process_tell(&rig, "state");
    assert_string_equal(json_string_value(json_object_get(reply, "sample")), "houndstooth");
    assert_int_equal(json_integer_value(json_array_get(json_object_get(reply, "lights_on"), 0)), 4);
    assert_int_equal(json_array_size(json_object_get(reply, "lights_on")), 1);
    json_decref(reply);

    weft_mosaic_fini(&frame.mosaic);
    weft_camera_close(camera);
    weft_controller_close(controller);
    assert_int_equal(rig_process_end(&rig, 0), 0);
    assert_false(weft_file_exists(weft_test_path("rig/rig.json")));
    assert_false(weft_file_exists(weft_test_path("rig/control.sock")));
    assert_false(weft_file_exists(weft_test_path("rig/camera.xml")));
}

static void truth_is_written_and_read(void **state)
{
    (void)state;
    rig_process rig;
    char line[700];
    weft_maps maps;
    weft_calibration cal;
    rig_process_start(&rig, weft_test_path("rig-truth"), options);
    json_decref(rig_process_tell(&rig, "sample twill"));
    snprintf(line, sizeof line, "truth %s 0.5", weft_test_path("truth"));
    json_decref(rig_process_tell(&rig, line));

    assert_ok(weft_calibration_load(weft_test_path("truth/truth.cal"), &cal, err));
    assert_ok(weft_calibration_require(
        &cal, WEFT_CALIBRATION_CAMERA | WEFT_CALIBRATION_POSE | WEFT_CALIBRATION_LIGHTS, "truth.cal", err));
    assert_near(cal.camera.fx, scene.camera.fx, 1e-9);
    assert_int_equal(cal.n_lights, WEFT_RIG_N_LIGHTS);
    assert_near(cal.lights[7].position.x, scene.lights[7].position.x, 1e-9);
    assert_near(cal.lights[7].intensity[2], scene.lights[7].intensity[2], 1e-9);
    assert_true(cal.grid.columns == 64 && cal.grid.rows == 42);
    assert_near((double)cal.grid.gain[0], weft_rig_vignetting(&scene, 0, 0), 1e-3);
    weft_calibration_fini(&cal);

    assert_ok(weft_maps_load(weft_test_path("truth/sensor.maps"), &maps, err));
    assert_true(maps.width == WIDTH && maps.height == HEIGHT && maps.geometry == WEFT_GEOMETRY_SENSOR);
    weft_maps_fini(&maps);
    assert_ok(weft_maps_load(weft_test_path("truth/plane.maps"), &maps, err));
    assert_true(maps.geometry == WEFT_GEOMETRY_PLANE && maps.albedo_is_srgb);
    assert_near(maps.mm_per_px, 0.5, 0);
    assert_near(maps.origin_mm[0], -(maps.width - 1) * 0.25, 1e-9);
    assert_near(maps.origin_mm[1], (maps.height - 1) * 0.25, 1e-9);
    weft_maps_fini(&maps);

    /* Written once; a second time is refused. */
    json_t *reply = NULL;
    assert_ok(weft_rig_control_tell(weft_test_path("rig-truth/control.sock"), line, 30, &reply, err));
    assert_true(json_is_false(json_object_get(reply, "ok")));
    assert_non_null(strstr(json_string_value(json_object_get(reply, "error")), "truth.cal"));
    json_decref(reply);
    assert_int_equal(rig_process_end(&rig, SIGTERM), 0);
}

static void check_refused(const rig_process *rig, const char *line, const char *words)
{
    char socket[600];
    json_t *reply = NULL;
    snprintf(socket, sizeof socket, "%s/control.sock", rig->dir);
    assert_ok(weft_rig_control_tell(socket, line, 30, &reply, err));
    assert_true(json_is_false(json_object_get(reply, "ok")));
    const char *const error = json_string_value(json_object_get(reply, "error"));
    if (!strstr(error, words))
        fail_msg("\"%s\" gave \"%s\", wanted \"%s\"", line, error, words);
    json_decref(reply);
}

static void nonsense_is_refused(void **state)
{
    (void)state;
    rig_process rig;
    char words[2000];
    rig_process_start(&rig, weft_test_path("rig-nonsense"), options);
    check_refused(&rig, "", "wanted");
    check_refused(&rig, "dance", "wanted");
    check_refused(&rig, "sample", "wanted");
    check_refused(&rig, "quit now", "wanted");
    check_refused(&rig, "sample twil", "did you mean \"twill\"");
    check_refused(&rig, "truth /proc/nowhere", "/proc/nowhere");
    check_refused(&rig, "truth /tmp/x 1e9", "MM_PER_PX");
    json_t *const reply = rig_process_tell(&rig, "samples");
    assert_true(json_array_size(json_object_get(reply, "samples")) >= 25);
    json_decref(reply);

    /* A second rig in the same folder, then one elsewhere that finds the camera's port taken. */
    assert_int_equal(rig_process_run((const char *const[]){"--dir", rig.dir, "--size", "64x64", NULL}, words,
                                     sizeof words),
                     1);
    assert_non_null(strstr(words, "runs there already"));
    assert_int_equal(rig_process_run((const char *const[]){"--dir", weft_test_path("rig2"), "--size", "64x64",
                                                           "--sample", "white", NULL},
                                     words, sizeof words),
                     1);
    assert_non_null(strstr(words, "port 3956 of 127.0.0.1"));
    assert_false(weft_file_exists(weft_test_path("rig2/rig.json")));
    assert_int_equal(rig_process_end(&rig, SIGINT), 0);
}

static void the_board_is_unplugged_and_comes_back(void **state)
{
    (void)state;
    rig_process rig;
    weft_controller *controller = NULL;
    char dev[600], line[700];
    rig_process_start(&rig, weft_test_path("rig-board"), options);
    snprintf(dev, sizeof dev, "%s/dev", rig.dir);
    assert_ok(weft_controller_open_under(dev, rig.pty, 1000, &controller, err));
    assert_ok(
        weft_controller_set_setting(controller, WEFT_KEY_SERIAL_NUMBER, 0, (const uint8_t *)"WL-00011", err));
    weft_controller_close(controller);
    assert_ok(weft_controller_open_under(dev, "serial:WL-00011", 1000, &controller, err));
    json_decref(rig_process_tell(&rig, "board unplug"));
    snprintf(line, sizeof line, "%s/ttyACM0", dev);
    assert_int_not_equal(access(line, F_OK), 0);
    assert_fails(weft_controller_keep_alive(controller, err), WEFT_ERR_DEVICE, "has vanished");
    json_t *const back = rig_process_tell(&rig, "board plug");
    assert_string_not_equal(json_string_value(json_object_get(back, "pty")), rig.pty);
    json_decref(back);
    assert_ok(weft_controller_reopen(controller, 5, err));
    json_decref(rig_process_tell(&rig, "board lamp 6 open"));
    json_decref(rig_process_tell(&rig, "board lamp 2 on"));
    assert_ok(weft_controller_light(controller, 1 << 6, 256, 2000, NULL, err));
    json_t *const broken = rig_process_tell(&rig, "state");
    assert_int_equal(json_integer_value(json_array_get(json_object_get(broken, "lights_on"), 0)), 2);
    assert_int_equal(json_integer_value(json_array_get(json_object_get(broken, "lights_driven"), 0)), 6);
    json_decref(broken);
    json_decref(rig_process_tell(&rig, "board line both drop 1"));
    assert_fails(weft_controller_keep_alive(controller, err), WEFT_ERR_TIMEOUT, "does not answer");
    json_decref(rig_process_tell(&rig, "board line both"));
    json_decref(rig_process_tell(&rig, "board hang"));
    check_refused(&rig, "board dance", "wanted: board reset, hang");
    check_refused(&rig, "board lamp 10 on", "lamp 0..9");
    check_refused(&rig, "board lamp 1 late", "lamp 0..9");
    check_refused(&rig, "board line both drop 2", "P is 0 to 1");
    check_refused(&rig, "board line both drop", "P is 0 to 1");
    check_refused(&rig, "board line sideways", "in, out or both");
    check_refused(&rig, "board unplug mains", "unplug [power]");
    weft_controller_close(controller);
    assert_int_equal(rig_process_end(&rig, 0), 0);
    assert_int_not_equal(access(dev, F_OK), 0);
}

static void bad_starts_say_why(void **state)
{
    (void)state;
    char words[2000];
    const struct {
        const char *option, *value, *words;
        int status;
    } cases[] = {
        {"--firmware", "/nonexistent.elf", "/nonexistent.elf: no firmware", 1},
        {"--size", "101x100", "even numbers", 2},
        {"--size", "9000x6000", "4928x3264", 2},
        {"--scene", "/nonexistent.json", "/nonexistent.json", 1},
        {"--dir", "/proc/version/x", "/proc/version", 1},
        {"--sample", "tweed", "no sample \"tweed\"", 2},
        {"--address", "203.0.113.7", "at 203.0.113.7: no network interface has that address", 1},
        {"--address", "127.0.0.5", "at 127.0.0.5: no network interface has that address", 1},
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        const char *const words_of[] = {
            "--dir", weft_test_path("rig-bad"), "--size",       "64x64", "--sample",
            "white", cases[i].option,           cases[i].value, NULL};
        const int status = rig_process_run(words_of, words, sizeof words);
        if (status != cases[i].status || !strstr(words, cases[i].words))
            fail_msg("%s %s: exit %d, \"%s\"", cases[i].option, cases[i].value, status, words);
    }
    json_t *reply = NULL;
    assert_fails(weft_rig_control_tell(weft_test_path("rig-bad/control.sock"), "state", 1, &reply, err),
                 WEFT_ERR_DEVICE, "weft rig --dir");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(frames_show_the_lamp_that_is_on),
        cmocka_unit_test(truth_is_written_and_read),
        cmocka_unit_test(nonsense_is_refused),
        cmocka_unit_test(the_board_is_unplugged_and_comes_back),
        cmocka_unit_test(bad_starts_say_why),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
