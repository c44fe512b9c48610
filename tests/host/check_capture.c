/* The capture engine: frames that are right, frames that are not, and what stays on disk. */
#include "tests/host/capture_bench.h"
#include "tests/support/support.h"

#include "core/file.h"
#include "core/formats/raw_file.h"
#include "core/json.h"
#include "core/mem.h"
#include "core/progress.h"
#include "host/capture/look.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static void test_a_full_set(void **state)
{
    (void)state;
    const weft_capture_options options = {.folder = weft_test_path("full.set"), .exposure_s = 0.04};
    weft_capture_report report;
    weft_set set;
    assert_ok(run(&options, &set, &report, err));
    assert_true(report.n_frames == 11 && report.n_taken == 11 && report.n_kept == 0 && report.n_retries == 0);
    assert_string_equal(set.name, "full");
    assert_ok(weft_set_require_lights(&set, err));
    for (int i = 0; i < set.n_frames; i++) {
        weft_mosaic m;
        weft_frame_info info;
        double on[N_LIGHTS] = {0};
        const weft_set_frame *const f = &set.frames[i];
        assert_int_equal(f->role, i == 0 ? WEFT_ROLE_AMBIENT : WEFT_ROLE_LIGHT);
        assert_int_equal(f->light, i - 1);
        if (i > 0) {
            on[i - 1] = 1;
            assert_int_equal(bench.lit_before_end[i], 1 << (i - 1));
            const double hz = (double)json_integer_value(json_object_get(f->capture, "tick_hz"));
            const uint32_t lit = (uint32_t)json_integer_value(json_object_get(f->capture, "off_tick")) -
                                 (uint32_t)json_integer_value(json_object_get(f->capture, "on_tick"));
            assert_true(lit / hz >= 0.02 && lit / hz < 2);
        }
        char *const path = weft_set_frame_path(&set, i, NULL);
        assert_ok(weft_raw_read(path, &m, &info, err));
        weft_free(path);
        assert_true(m.width == WIDTH && m.height == HEIGHT && m.cfa == WEFT_CFA_GBRG && m.white == WHITE);
        assert_near(info.exposure_s, 0.04, 1e-6);
        bench_set = (weft_camera_settings){.exposure_s = 0.04, .gain = 1};
        for (int p = 0; p < WIDTH * HEIGHT; p++)
            assert_true(abs((int)m.data[p] -
                            sample_at(light_at(on, p % WIDTH, p / WIDTH), m.cfa, p % WIDTH, p / WIDTH)) <= 1);
        weft_mosaic_fini(&m);
    }
    weft_set_fini(&set);
    check_folder(options.folder, 11, true);
    assert_fails(run(&options, &set, &report, err), WEFT_ERR_EXISTS, "complete set");
    weft_capture_options again = options;
    again.resume = true;
    run_well(&again, &report); /* nothing to do, nothing done */
    assert_true(report.n_kept == 11 && report.n_taken == 0);
    again.resume = false;
    again.force = true;
    again.lights = 1 << 4;
    again.no_ambient = true;
    run_well(&again, &report);
    check_folder(options.folder, 1, true); /* the old frames are gone */
}

static void test_bad_frames_are_taken_again_and_it_is_told(void **state)
{
    (void)state;
    const weft_capture_options options = {
        .folder = weft_test_path("retry.set"), .exposure_s = 0.04, .lights = 3};
    weft_capture_report report;
    weft_set set;
    plan_deed(LOSE_PACKETS, 1, 2);
    assert_ok(run(&options, &set, &report, err));
    assert_int_equal(report.n_retries, 2);
    const json_t *const retries = json_object_get(set.frames[1].capture, "retries");
    assert_int_equal(json_array_size(retries), 2);
    assert_string_equal(json_string_value(json_array_get(retries, 1)), "packets were lost");
    assert_int_equal(json_array_size(json_object_get(set.frames[2].capture, "retries")), 0);
    weft_set_fini(&set);

    const weft_capture_options other = {
        .folder = weft_test_path("fail.set"), .exposure_s = 0.04, .lights = 3};
    plan_deed(SEND_NOTHING, 2, 3);
    assert_fails(run(&other, &set, &report, err), WEFT_ERR_DEVICE, "light 1: no frame came (tried 3 times)");
    check_folder(other.folder, 2, false);
}

static void test_a_lamp_that_never_lights_is_named(void **state)
{
    (void)state;
    weft_capture_options options = {.folder = weft_test_path("lamp.set"), .exposure_s = 0.04};
    weft_capture_report report;
    weft_set set;
    bench.broken_lamps = 1 << 3;
    assert_fails(run(&options, &set, &report, err), WEFT_ERR_DEVICE, "light 3: no brighter than without it");
    check_folder(options.folder, 4, false);
    assert_fails(run(&options, &set, &report, err), WEFT_ERR_EXISTS, "--resume goes on");
    bench.broken_lamps = 0;
    options.resume = true;
    options.exposure_s = 0.08;
    assert_fails(run(&options, &set, &report, err), WEFT_ERR_MISMATCH, "exposure_s 0.04, not 0.08");
    options.exposure_s = 0;
    options.lights = 7;
    assert_fails(run(&options, &set, &report, err), WEFT_ERR_MISMATCH, "lights");
    options.lights = 0;
    run_well(&options, &report);
    assert_true(report.n_kept == 4 && report.n_taken == 7 && report.exposure_s == 0.04);
    check_folder(options.folder, 11, true);

    const weft_capture_options board = {
        .folder = weft_test_path("board.set"), .no_lights = true, .all = true, .no_ambient = true};
    bench.broken_lamps = 0x3ff;
    bench.room = 10;
    assert_fails(run(&board, &set, &report, err), WEFT_ERR_DEVICE, "the frame with all lights: no brighter");
}

static void test_resume_trusts_only_what_is_whole(void **state)
{
    (void)state;
    weft_capture_options options = {.folder = weft_test_path("resume.set"), .exposure_s = 0.04};
    weft_capture_report report;
    weft_set set;
    char path[1200];
    run_well(&options, &report);
    snprintf(path, sizeof path, "%s/light-02.dng", options.folder);
    assert_int_equal(truncate(path, 1000), 0);
    snprintf(path, sizeof path, "%s/light-07.dng", options.folder);
    assert_int_equal(unlink(path), 0);
    snprintf(path, sizeof path, "%s/.weft-light-08.dng-1-1", options.folder);
    assert_ok(weft_file_write(path, "half", 4, err));
    options.resume = true;
    run_well(&options, &report);
    assert_true(report.n_kept == 9 && report.n_taken == 2);
    check_folder(options.folder, 11, true);

    weft_camera_close(bench.camera);
    bench.serial = "B2";
    open_bench_camera();
    assert_fails(run(&options, &set, &report, err), WEFT_ERR_MISMATCH, "camera bench Bench B1, this is");
    check_folder(options.folder, 11, true);
}

static void test_cancel_and_camera_loss_leave_it_dark_and_resumable(void **state)
{
    (void)state;
    weft_capture_options options = {.folder = weft_test_path("cancel.set"), .exposure_s = 0.04};
    weft_capture_report report;
    weft_set set;
    plan_deed(CANCEL_IT, 5, 1);
    assert_fails(run(&options, &set, &report, err), WEFT_ERR_CANCELLED, "5 of 11 frames are kept, --resume");
    check_folder(options.folder, 5, false);
    weft_cancel_request(false);
    options.resume = true;
    plan_deed(DIE, 3, 1);
    assert_fails(run(&options, &set, &report, err), WEFT_ERR_DEVICE,
                 "light 6: camera bench: the connection was lost");
    check_folder(options.folder, 7, false);
    run_well(&options, &report);
    assert_int_equal(report.n_kept, 7);
    check_folder(options.folder, 11, true);
}

static void test_a_board_that_resets_is_noticed(void **state)
{
    (void)state;
    weft_capture_options options = {.folder = weft_test_path("reset.set"), .exposure_s = 0.04, .lights = 7};
    weft_capture_report report;
    weft_set set;
    plan_deed(RESET_BOARD, 2, 1);
    assert_fails(run(&options, &set, &report, err), WEFT_ERR_DEVICE, "light 1: ");
    check_folder(options.folder, 2, false);
    weft_controller_close(bench.controller);
    bench.controller = NULL;
    assert_ok(weft_controller_open(pty, LEASE_MS, &bench.controller, err));
    options.resume = true;
    run_well(&options, &report);
    check_folder(options.folder, 4, true);
}

static void test_a_folder_of_other_things(void **state)
{
    (void)state;
    weft_capture_options options = {.folder = weft_test_path("photos"), .exposure_s = 0.04, .lights = 1};
    weft_capture_report report;
    weft_set set;
    char path[1200];
    assert_ok(weft_folder_create(options.folder, err));
    snprintf(path, sizeof path, "%s/holiday.jpg", options.folder);
    assert_ok(weft_file_write(path, "x", 1, err));
    assert_fails(run(&options, &set, &report, err), WEFT_ERR_EXISTS, "other things than a set");
    assert_int_equal(bench.n_exposures, 0);
    options.force = true;
    run_well(&options, &report);
    assert_true(weft_file_exists(path));
    options.folder = path;
    assert_fails(run(&options, &set, &report, err), WEFT_ERR_IO, "is a file");
    options.folder = "/proc/weft/x.set";
    assert_fails(run(&options, &set, &report, err), WEFT_ERR_IO, "/proc/weft");
}

/* Names from a template; set.json says what each file is, so a renamed one is found again. */
static void test_names_of_files(void **state)
{
    (void)state;
    weft_capture_options options = {.folder = weft_test_path("names.set"),
                                    .exposure_s = 0.04,
                                    .lights = 1 << 2 | 1 << 9,
                                    .bracket = 2,
                                    .file_name = "{set}_{kind}{light}_{exposure}"};
    weft_capture_report report;
    weft_set set;
    char from[1200], to[1200];
    plan_deed(CANCEL_IT, 2, 1); /* between the two exposures of light 2 */
    assert_fails(run(&options, &set, &report, err), WEFT_ERR_CANCELLED, "2 of 5 frames");
    weft_cancel_request(false);
    assert_ok(weft_set_load(options.folder, &set, err));
    assert_string_equal(set.frames[0].file, "names_ambient_0.04s.dng");
    assert_string_equal(set.frames[1].file, "names_light02_0.04s.dng");
    weft_free(set.frames[1].file); /* as a user who renames a file and says so */
    set.frames[1].file = weft_strdup("renamed.dng", NULL);
    assert_ok(weft_set_save(&set, err));
    weft_set_fini(&set);
    snprintf(from, sizeof from, "%s/names_light02_0.04s.dng", options.folder);
    snprintf(to, sizeof to, "%s/renamed.dng", options.folder);
    assert_int_equal(rename(from, to), 0);
    options.resume = true;
    options.file_name = "{kind}-{light}-{bracket}";
    assert_fails(run(&options, &set, &report, err), WEFT_ERR_MISMATCH,
                 "was begun with --file-name \"{set}_{kind}{light}_{exposure}\"");
    options.file_name = NULL;
    run_well(&options, &report);
    assert_true(report.n_kept == 2 && report.n_taken == 3);
    check_folder(options.folder, 5, true);
    assert_int_equal(truncate(to, 100), 0); /* and is taken again under its new name */
    run_well(&options, &report);
    assert_true(report.n_kept == 4 && report.n_taken == 1);
    check_folder(options.folder, 5, true);

    weft_capture_options one = {.folder = weft_test_path("one-name.set"), .file_name = "{kind}"};
    const int before = bench.n_exposures;
    assert_fails(run(&one, &set, &report, err), WEFT_ERR_USAGE,
                 "light 0 and light 1 would both be light.dng");
    assert_false(weft_file_exists(one.folder));
    assert_int_equal(bench.n_exposures, before); /* before the exposure is looked for */
}

/* What is written beside a frame says what set.json and the file say, and goes with the set. */
static void test_sidecars(void **state)
{
    (void)state;
    weft_capture_options options = {
        .folder = weft_test_path("sidecar.set"), .exposure_s = 0.04, .lights = 3, .sidecar = true};
    weft_capture_report report;
    weft_set set;
    char path[1200];
    plan_deed(CANCEL_IT, 2, 1);
    assert_fails(run(&options, &set, &report, err), WEFT_ERR_CANCELLED, "2 of 3 frames");
    weft_cancel_request(false);
    check_folder(options.folder, 2, false);
    snprintf(path, sizeof path, "%s/light-00.dng.json", options.folder);
    assert_int_equal(unlink(path), 0);
    options.resume = true;
    options.sidecar = false; /* as the set was begun */
    run_well(&options, &report);
    check_folder(options.folder, 3, true); /* the lost one is made again */
    assert_ok(weft_set_load(options.folder, &set, err));
    json_t *sidecar = NULL, *const row = weft_set_frame_to_json(&set.frames[1]);
    assert_ok(weft_json_load_kind(path, "frame", 1, &sidecar, err));
    assert_true(json_equal(json_object_get(sidecar, "frame"), row));
    assert_string_equal(json_string_value(json_object_get(json_object_get(sidecar, "camera"), "serial")),
                        "B1");
    const json_t *const tags = json_object_get(sidecar, "tags");
    assert_near(json_real_value(json_object_get(tags, "ExposureTime")), 0.04, 1e-6);
    assert_string_equal(json_string_value(json_object_get(tags, "CFAPattern")), "GBRG");
    assert_string_equal(json_string_value(json_object_get(tags, "Model")), "Bench");
    assert_near(json_number_value(json_object_get(tags, "WhiteLevel")), WHITE, 0);
    json_decref(row);
    json_decref(sidecar);
    weft_set_fini(&set);
    options.resume = false;
    options.force = true;
    run_well(&options, &report);
    check_folder(options.folder, 3, true); /* the old sidecars went with their frames */

    weft_capture_options beside = {
        .folder = weft_test_path("beside"), .exposure_s = 0.04, .lights = 1, .force = true};
    assert_ok(weft_folder_create(beside.folder, err));
    snprintf(path, sizeof path, "%s/light-00.dng", beside.folder);
    assert_ok(weft_file_write(path, "x", 1, err));
    assert_fails(run(&beside, &set, &report, err), WEFT_ERR_EXISTS, "light-00.dng: is there and of no set");
}

static weft_err cap(void *context, weft_error *err)
{
    (void)err;
    ++*(int *)context;
    bench.room = 0;
    return WEFT_OK;
}

static void test_the_dark_frame_comes_last(void **state)
{
    (void)state;
    int n_asked = 0;
    const weft_capture_options options = {.folder = weft_test_path("dark.set"),
                                          .exposure_s = 0.04,
                                          .lights = 1,
                                          .dark = true,
                                          .cap_lens = cap,
                                          .context = &n_asked};
    weft_capture_report report;
    weft_set set;
    assert_ok(run(&options, &set, &report, err));
    assert_int_equal(n_asked, 1);
    assert_int_equal(set.frames[2].role, WEFT_ROLE_DARK);
    weft_set_fini(&set);
}

static void test_wishes_that_cannot_be(void **state)
{
    (void)state;
    weft_capture_report report;
    weft_set set;
    weft_capture_options options = {
        .folder = weft_test_path("no.set"), .exposure_s = 0.04, .lights = 1 << 12};
    assert_fails(run(&options, &set, &report, err), WEFT_ERR_RANGE, "there is no light 12");
    options.lights = 1;
    options.level = 100000;
    assert_fails(run(&options, &set, &report, err), WEFT_ERR_RANGE, "level 100000");
    options = (weft_capture_options){
        .folder = options.folder, .exposure_s = 0.04, .no_lights = true, .no_ambient = true};
    assert_fails(run(&options, &set, &report, err), WEFT_ERR_USAGE, "no frame");
    assert_false(weft_file_exists(options.folder));
}

/* Longer than the lease, and longer than one command may keep a light on. */
static void test_long_exposures_stay_lit(void **state)
{
    (void)state;
    const weft_capture_options options = {
        .folder = weft_test_path("long.set"), .exposure_s = 2.3, .lights = 1 << 6, .no_ambient = true};
    weft_capture_report report;
    bench.slow = true;
    bench.power = 0.2;
    run_well(&options, &report);
    assert_int_equal(report.n_retries, 0);
    assert_int_equal(bench.lit_before_end[1], 1 << 6);
}

static void test_a_look_before_the_set(void **state)
{
    (void)state;
    const weft_capture_options options = {.exposure_s = 0.04, .lights = 7};
    weft_progress progress = {0};
    weft_capture_look look;
    const double powers[] = {0.9, 100}; /* well lit; far beyond white */
    for (int i = 0; i < 2; i++) {
        bench.power = powers[i];
        assert_ok(weft_capture_look_at(&options, bench.camera, bench.controller, &progress, &look, err));
        assert_int_equal(look.n, 4);
        assert_true(look.lights[0].light == -1 && look.lights[3].light == 2);
        assert_near(look.suggested_s * (powers[i] + bench.room), 0.70, 0.05);
        assert_int_equal(look.n_clipped, i == 0 ? 0 : 3);
        assert_int_equal(look.bracket, 1);
    }
    weft_capture_options wrong = options;
    wrong.lights = 1 << 20;
    assert_fails(weft_capture_look_at(&wrong, bench.camera, bench.controller, &progress, &look, err),
                 WEFT_ERR_RANGE, "there is no light 20");
}

int main(void)
{
#define ON_BENCH(test) cmocka_unit_test_setup_teardown(test, set_up, tear_down)
    const struct CMUnitTest tests[] = {
        ON_BENCH(test_a_look_before_the_set),
        ON_BENCH(test_a_full_set),
        ON_BENCH(test_bad_frames_are_taken_again_and_it_is_told),
        ON_BENCH(test_a_lamp_that_never_lights_is_named),
        ON_BENCH(test_resume_trusts_only_what_is_whole),
        ON_BENCH(test_cancel_and_camera_loss_leave_it_dark_and_resumable),
        ON_BENCH(test_a_board_that_resets_is_noticed),
        ON_BENCH(test_a_folder_of_other_things),
        ON_BENCH(test_names_of_files),
        ON_BENCH(test_sidecars),
        ON_BENCH(test_the_dark_frame_comes_last),
        ON_BENCH(test_wishes_that_cannot_be),
        ON_BENCH(test_long_exposures_stay_lit),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
