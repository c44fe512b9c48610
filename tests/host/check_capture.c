/* The capture engine: frames that are right, frames that are not, and what stays on disk. */
#include "tests/host/capture_bench.h"
#include "tests/support/support.h"

#include "core/file.h"
#include "core/formats/raw_file.h"
#include "core/json.h"
#include "core/mem.h"
#include "core/progress.h"
#include "host/capture/auto_exposure.h"
#include "host/capture/average.h"
#include "host/capture/frame_stats.h"
#include "host/capture/look.h"

#include <math.h>
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

static void test_a_bracket(void **state)
{
    (void)state;
    const weft_capture_options options = {.folder = weft_test_path("bracket.set"),
                                          .exposure_s = 0.04,
                                          .lights = 1 << 2 | 1 << 9,
                                          .bracket = 3,
                                          .all = true};
    weft_capture_report report;
    weft_set set;
    assert_ok(run(&options, &set, &report, err));
    assert_int_equal(set.n_frames, 8); /* ambient, 2 x 3, all */
    const int order[3] = {1, 0, 2};    /* the middle first: it shows whether the light is on */
    for (int i = 0; i < 3; i++) {
        char name[32];
        snprintf(name, sizeof name, "light-02-b%d.dng", order[i]);
        assert_string_equal(set.frames[1 + i].file, name);
        assert_near(set.frames[4 + i].exposure_s, 0.01 * pow(4, order[i]), 1e-9);
        assert_int_equal(json_integer_value(json_object_get(set.frames[4 + i].capture, "bracket")), order[i]);
    }
    assert_int_equal(set.frames[7].role, WEFT_ROLE_ALL);
    assert_int_equal(bench.lit_before_end[7], 0x3ff);
    assert_int_equal(report.n_warnings, 1); /* all on clips; the long end of the bracket may */
    /* a set of a program that knew no exposures of single lights: its brackets go by their names */
    json_t *const begun = json_object_get(set.other, "capture");
    const char *const newer[] = {"exposures_s", "brackets", "file_name", "sidecar"};
    for (int i = 0; i < 4; i++)
        assert_int_equal(json_object_del(begun, newer[i]), 0);
    for (int i = 1; i < 7; i++)
        assert_int_equal(json_object_del(set.frames[i].capture, "bracket"), 0);
    set.complete = false;
    assert_ok(weft_set_save(&set, err));
    weft_set_fini(&set);
    const weft_capture_options old = {.folder = options.folder, .resume = true};
    run_well(&old, &report);
    assert_true(report.n_kept == 8 && report.n_taken == 0);
    weft_capture_options wide = options;
    wide.folder = weft_test_path("wide.set");
    wide.bracket = 9;
    assert_fails(run(&wide, &set, &report, err), WEFT_ERR_RANGE, "only to 10 s");
    assert_false(weft_file_exists(wide.folder));
}

/* Lights with their own exposures and brackets; a set that is left in mid bracket goes on with them. */
static void test_exposures_of_each_light(void **state)
{
    (void)state;
    weft_capture_options options = {.folder = weft_test_path("each.set"),
                                    .exposure_s = 0.04,
                                    .exposures_s = {[4] = 0.01},
                                    .brackets = {[4] = 3, [7] = 2},
                                    .lights = 1 << 2 | 1 << 4 | 1 << 7,
                                    .average = 2,
                                    .all = true};
    const struct {
        int light;
        double exposure_s;
    } wanted[] = {{-1, 0.04}, {2, 0.04}, {4, 0.01}, {4, 0.0025}, {4, 0.04}, {7, 0.04}, {7, 0.16}, {-1, 0.01}};
    weft_capture_options asks = options;
    weft_capture_report report;
    weft_set set;
    plan_deed(CANCEL_IT, 2 * 3 + 1, 1); /* the second of the two frames of light 4 at 0.0025 s */
    assert_fails(run(&options, &set, &report, err), WEFT_ERR_CANCELLED, "3 of 8 frames");
    weft_cancel_request(false);
    asks.resume = true;
    asks.exposures_s[4] = 0.02;
    assert_fails(run(&asks, &set, &report, err), WEFT_ERR_MISMATCH, "exposure of light 4 0.01, not 0.02");
    asks.exposures_s[4] = 0;
    asks.brackets[4] = 5;
    assert_fails(run(&asks, &set, &report, err), WEFT_ERR_MISMATCH, "bracket of light 4 3, not 5");
    const weft_capture_options go_on = {.folder = options.folder, .resume = true, .each = true};
    assert_ok(run(&go_on, &set, &report, err));
    assert_true(report.n_kept == 3 && report.n_taken == 5);
    assert_true(report.shortest_s == 0.01 && report.exposure_s == 0.04 && report.n_exposures == 6);
    assert_int_equal(set.n_frames, 8);
    for (int i = 0; i < 8; i++) {
        assert_int_equal(set.frames[i].light, wanted[i].light);
        assert_near(set.frames[i].exposure_s, wanted[i].exposure_s, 1e-9);
        assert_int_equal(json_integer_value(json_object_get(set.frames[i].capture, "mean_of")), 2);
    }
    weft_set_fini(&set);
    check_folder(options.folder, 8, true);
    weft_capture_options none = {.folder = weft_test_path("none.set"), .exposures_s = {[12] = 1}};
    assert_fails(run(&none, &set, &report, err), WEFT_ERR_RANGE, "there is no light 12");
}

/* Each light's own exposure, and the bracket that its highlights and shadows need. */
static void test_brackets_are_found(void **state)
{
    (void)state;
    const weft_light_level rows[] = {
        {.high = 7, .top = 8, .middle = 3},       /* even: one exposure holds all */
        {.high = 7, .top = 30, .middle = 3},      /* highlights */
        {.high = 7, .top = 8, .middle = 0.5},     /* shadows */
        {.high = 7, .top = 30, .middle = 0.5},    /* both */
        {.high = 7, .top = 8, .middle = 0.1},     /* deep shadows */
        {.high = 7, .top = 1000, .middle = 1e-9}, /* no more than two steps to either side */
        {.high = 7, .top = 8, .middle = 0},       /* nothing there */
    };
    const int wanted[] = {1, 3, 2, 3, 4, 5, 1};
    for (int i = 0; i < 7; i++) {
        assert_near(weft_light_level_exposure(&rows[i]), 0.1, 1e-9);
        assert_int_equal(weft_light_level_bracket(&rows[i], 0.1), wanted[i]);
    }
    weft_capture_options options = {.folder = weft_test_path("found.set"),
                                    .lights = 1 << 1 | 1 << 3,
                                    .each = true,
                                    .bracket = WEFT_CAPTURE_BRACKET_AUTO};
    weft_capture_report report;
    weft_set set;
    bench.power = 15;
    bench.faint_lamps = 1 << 3; /* a fifth of it */
    assert_ok(run(&options, &set, &report, err));
    assert_int_equal(set.n_frames, 3);
    assert_near(set.frames[1].exposure_s * (15 + bench.room), 0.70, 0.04);
    assert_near(set.frames[2].exposure_s * (3 + bench.room), 0.70, 0.04);
    assert_true(set.frames[0].exposure_s == set.frames[2].exposure_s); /* ambient: the longest */
    weft_set_fini(&set);
    options.resume = true;
    run_well(&options, &report); /* what was found is what it was begun with */
    assert_int_equal(report.n_kept, 3);
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

static void test_exposure_is_found(void **state)
{
    (void)state;
    weft_capture_options options = {.folder = weft_test_path("auto.set"), .lights = 3, .no_ambient = true};
    weft_capture_report report;
    const double powers[] = {0.9, 15, 3000};
    for (int i = 0; i < 3; i++) {
        bench.power = powers[i];
        options.force = i > 0;
        run_well(&options, &report);
        assert_near(report.exposure_s * (powers[i] + bench.room), 0.70, 0.04); /* two digits */
        assert_int_equal(report.n_warnings, 0);
    }
    weft_set set;
    bench.power = 1e7;
    assert_fails(run(&options, &set, &report, err), WEFT_ERR_NODATA, "too long for this light");
    check_folder(options.folder, 2, true); /* what was there is untouched */
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

static void test_a_mean_of_frames(void **state)
{
    (void)state;
    enum { W = 64, H = 32, N = 16, LEVEL = 1000, SIGMA = 8 };
    weft_average mean = {0};
    weft_mosaic m;
    uint64_t seed = 3;
    double error = 0, square = 0;
    assert_ok(weft_mosaic_init(&m, W, H, WEFT_CFA_RGGB, err));
    m.white = 4000;
    for (int i = 0; i < N; i++) {
        for (int p = 0; p < W * H; p++)
            m.data[p] = (uint16_t)lround(LEVEL + SIGMA * weft_test_gauss(&seed));
        m.data[5] = i == 7 ? 4000 : 3990; /* clips once */
        assert_ok(weft_average_add(&mean, &m, err));
    }
    weft_average_get(&mean, &m);
    assert_int_equal(m.data[5], 4000);
    for (int p = 6; p < W * H; p++) {
        error += m.data[p] - LEVEL;
        square += (m.data[p] - LEVEL) * (double)(m.data[p] - LEVEL);
    }
    assert_near(error / (W * H - 6), 0, 0.2);
    assert_near(sqrt(square / (W * H - 6)), sqrt(SIGMA * SIGMA / (double)N + 1 / 12.0), 0.15);
    weft_mosaic_fini(&m);
    assert_ok(weft_mosaic_init(&m, W, H / 2, WEFT_CFA_RGGB, err));
    assert_fails(weft_average_add(&mean, &m, err), WEFT_ERR_MISMATCH, "64 x 16");
    weft_mosaic_fini(&m);
    weft_average_fini(&mean);
}

static void test_each_file_is_a_mean(void **state)
{
    (void)state;
    weft_capture_options options = {
        .folder = weft_test_path("mean.set"), .exposure_s = 0.04, .lights = 1, .average = 5};
    weft_capture_report report;
    weft_set set;
    plan_deed(LOSE_PACKETS, 7, 1);
    assert_ok(run(&options, &set, &report, err));
    assert_int_equal(set.n_frames, 2);
    assert_int_equal(bench.n_exposures, 11); /* 2 x 5, and one that was taken again */
    assert_int_equal(report.n_retries, 1);
    assert_int_equal(json_integer_value(json_object_get(set.frames[1].capture, "mean_of")), 5);
    weft_set_fini(&set);
    options.resume = true;
    options.average = 4;
    assert_fails(run(&options, &set, &report, err), WEFT_ERR_MISMATCH, "average 5, not 4");
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

static void test_statistics(void **state)
{
    (void)state;
    weft_mosaic m;
    weft_frame_stats s;
    const char *colour;
    assert_ok(weft_mosaic_init(&m, 100, 40, WEFT_CFA_RGGB, err));
    for (int i = 0; i < 4; i++)
        m.black[i] = 100;
    m.white = 1100;
    for (int p = 0; p < 4000; p++)
        m.data[p] = (uint16_t)(weft_cfa_colour(m.cfa, p % 100, p / 100) == 1 ? 600 : 200);
    m.data[0] = 1100; /* one red photosite of 1000 clips */
    m.data[2] = 1200;
    assert_ok(weft_frame_stats_make(&m, &s, err));
    assert_near(s.colours[0].mean, (998 * 0.1 + 1 + 1.1) / 1000, 1e-12);
    assert_near(s.colours[1].mean, 0.5, 1e-12);
    assert_near(s.colours[0].high, 1, 1e-12);
    assert_near(s.colours[2].high, 0.1, 1e-12);
    assert_near(s.colours[0].top, 1.1, 1e-12);
    assert_near(s.colours[0].middle, 0.1, 1e-12);
    assert_near(s.colours[0].max, 1.1, 1e-12);
    assert_near(weft_frame_stats_clipped(&s, &colour), 0.002, 1e-12);
    assert_string_equal(colour, "red");
    weft_mosaic_fini(&m);
}

int main(void)
{
#define ON_BENCH(test) cmocka_unit_test_setup_teardown(test, set_up, tear_down)
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_statistics),
        cmocka_unit_test(test_a_mean_of_frames),
        ON_BENCH(test_each_file_is_a_mean),
        ON_BENCH(test_a_look_before_the_set),
        ON_BENCH(test_a_full_set),
        ON_BENCH(test_bad_frames_are_taken_again_and_it_is_told),
        ON_BENCH(test_a_lamp_that_never_lights_is_named),
        ON_BENCH(test_resume_trusts_only_what_is_whole),
        ON_BENCH(test_cancel_and_camera_loss_leave_it_dark_and_resumable),
        ON_BENCH(test_a_board_that_resets_is_noticed),
        ON_BENCH(test_a_folder_of_other_things),
        ON_BENCH(test_a_bracket),
        ON_BENCH(test_exposures_of_each_light),
        ON_BENCH(test_brackets_are_found),
        ON_BENCH(test_names_of_files),
        ON_BENCH(test_sidecars),
        ON_BENCH(test_exposure_is_found),
        ON_BENCH(test_the_dark_frame_comes_last),
        ON_BENCH(test_wishes_that_cannot_be),
        ON_BENCH(test_long_exposures_stay_lit),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
