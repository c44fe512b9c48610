/*
 * The capture engine: the real firmware on simulated AVR behind its serial line, and a camera that sees the
 * lamps which that firmware has on, and fails when it is told to.
 */
#include "tests/support/support.h"

#include "core/file.h"
#include "core/formats/raw_file.h"
#include "core/mem.h"
#include "core/progress.h"
#include "core/sha256.h"
#include "host/capture/capture.h"
#include "host/capture/frame_stats.h"
#include "host/rig/controller_sim.h"

#include <dirent.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

enum { WIDTH = 64, HEIGHT = 48, N_LIGHTS = WEFT_SIM_N_LIGHTS, LEASE_MS = 800 };
#define BLACK 100
#define WHITE 4095

/* What the camera does at an exposure. */
typedef enum deed { WORK, LOSE_PACKETS, SEND_NOTHING, DIE, CANCEL_IT, RESET_BOARD } deed;

/* The scanner on the bench. */
static struct {
    weft_controller_sim *sim;
    weft_controller *controller;
    weft_camera_device *camera;
    const char *serial;       /* of the camera */
    double room, power;       /* share of the range per second: of the room, of a lamp */
    uint32_t broken_lamps;    /* these stay dark */
    bool slow;                /* waits as a long exposure does, calling idle */
    int n_exposures, deed_at; /* the deed is done at that exposure (counted from 0) and n_deeds on */
    int n_deeds;
    deed deed;
    uint32_t lit_before_end[256]; /* lamps that were on at each exposure */
} bench;

static weft_err bench_list(weft_camera_found *found, int max, int *n, weft_error *err)
{
    (void)found, (void)max, (void)err;
    *n = 0;
    return WEFT_OK;
}

static weft_err bench_open(void *state, const char *address, weft_camera_state *info, weft_error *err)
{
    (void)state, (void)address, (void)err;
    *info = (weft_camera_state){.vendor = "Weft",
                                .model = "Bench",
                                .width = WIDTH,
                                .height = HEIGHT,
                                .bits = 12,
                                .cfa = WEFT_CFA_GBRG,
                                .black = {BLACK, BLACK, BLACK, BLACK},
                                .white = WHITE,
                                .gain = 1};
    snprintf(info->serial, sizeof info->serial, "%s", bench.serial);
    return WEFT_OK;
}

static weft_camera_settings bench_set;

static weft_err bench_configure(void *state, const weft_camera_settings *wanted, weft_camera_state *info,
                                weft_error *err)
{
    (void)state;
    if (wanted->exposure_s > 10)
        return weft_fail(err, WEFT_ERR_RANGE, "camera bench: only to 10 s");
    bench_set = *wanted;
    info->exposure_s = wanted->exposure_s;
    info->gain = wanted->gain;
    return WEFT_OK;
}

static double light_at(const double on[N_LIGHTS])
{
    double light = bench.room;
    for (int i = 0; i < N_LIGHTS; i++)
        if (!(bench.broken_lamps >> i & 1))
            light += bench.power * on[i];
    return light * bench_set.exposure_s * bench_set.gain;
}

/* Red, green and blue see 0.5, 1 and 0.7 of the light; a gentle slope makes the picture one. */
static uint16_t sample_at(double light, weft_cfa cfa, int u, int v)
{
    static const double colour[3] = {0.5, 1, 0.7};
    const double share = light * colour[weft_cfa_colour(cfa, u, v)] * (1 - 0.1 * u / WIDTH);
    return (uint16_t)fmin(BLACK + (WHITE - BLACK) * share + 0.5, WHITE);
}

static weft_err wait_slowly(weft_camera_idle_fn *idle, void *context, weft_error *err)
{
    const double end_s = weft_clock_s() + bench_set.exposure_s;
    while (weft_clock_s() < end_s) {
        nanosleep(&(struct timespec){.tv_nsec = 50000000}, NULL);
        WEFT_TRY(idle(context, err));
    }
    return WEFT_OK;
}

static weft_err bench_expose(void *state, double deadline_s, weft_camera_idle_fn *idle, void *context,
                             weft_captured_frame *frame, weft_error *err)
{
    const int index = bench.n_exposures++;
    const bool now = index >= bench.deed_at && index < bench.deed_at + bench.n_deeds;
    const deed what = now ? bench.deed : WORK;
    double on[N_LIGHTS];
    (void)state, (void)deadline_s;
    if (what == DIE)
        return weft_fail(err, WEFT_ERR_DEVICE, "camera bench: the connection was lost");
    if (what == CANCEL_IT)
        weft_cancel_request(true);
    if (what == RESET_BOARD)
        weft_controller_sim_reset(bench.sim);
    WEFT_TRY(idle(context, err));
    if (bench.slow && weft_controller_sim_lights(bench.sim, NULL))
        WEFT_TRY(wait_slowly(idle, context, err));
    frame->exposure_s = bench_set.exposure_s;
    frame->gain = bench_set.gain;
    frame->sequence = (uint64_t)index;
    frame->status = what == LOSE_PACKETS   ? WEFT_FRAME_INCOMPLETE
                    : what == SEND_NOTHING ? WEFT_FRAME_TIMEOUT
                                           : WEFT_FRAME_COMPLETE;
    snprintf(frame->reason, sizeof frame->reason, "%s",
             what == LOSE_PACKETS   ? "packets were lost"
             : what == SEND_NOTHING ? "no frame came"
                                    : "");
    assert_true(weft_controller_sim_expose(
        bench.sim, (uint32_t)lround(1e6 * fmin(bench_set.exposure_s, bench.slow ? 0.01 : 0.02)), on));
    bench.lit_before_end[index % 256] = weft_controller_sim_lights(bench.sim, NULL);
    if (frame->status != WEFT_FRAME_COMPLETE)
        return WEFT_OK;
    if (!frame->mosaic.data)
        WEFT_TRY(weft_mosaic_init(&frame->mosaic, WIDTH, HEIGHT, WEFT_CFA_GBRG, err));
    for (int i = 0; i < 4; i++)
        frame->mosaic.black[i] = BLACK;
    frame->mosaic.white = WHITE;
    const double light = light_at(on);
    for (int v = 0; v < HEIGHT; v++)
        for (int u = 0; u < WIDTH; u++)
            frame->mosaic.data[v * WIDTH + u] = sample_at(light, WEFT_CFA_GBRG, u, v);
    return WEFT_OK;
}

static void bench_close(void *state)
{
    (void)state;
}

static const weft_camera_backend bench_backend = {.name = "bench",
                                                  .summary = "the camera of this test",
                                                  .state_size = 1,
                                                  .list = bench_list,
                                                  .open = bench_open,
                                                  .configure = bench_configure,
                                                  .expose = bench_expose,
                                                  .close = bench_close};

static char pty[128];

static int set_up(void **state)
{
    char elf[1024];
    const char *const build = getenv("WEFT_TEST_BUILD");
    (void)state;
    memset(&bench, 0, sizeof bench);
    bench.serial = "B1";
    bench.room = 0.05;
    bench.power = 15; /* 60 % of the range at 0.04 s */
    snprintf(elf, sizeof elf, "%s/%s", build ? build : "build", "firmware/weft-firmware.elf");
    assert_ok(weft_controller_sim_create(elf, &bench.sim, pty, err));
    assert_ok(weft_camera_open_on(&bench_backend, "1", &bench.camera, err));
    assert_ok(weft_controller_open(pty, LEASE_MS, &bench.controller, err));
    return 0;
}

static int tear_down(void **state)
{
    (void)state;
    weft_cancel_request(false);
    weft_controller_close(bench.controller);
    weft_camera_close(bench.camera);
    weft_controller_sim_destroy(bench.sim);
    return 0;
}

static void plan_deed(deed what, int at, int n)
{
    bench.deed = what;
    bench.deed_at = bench.n_exposures + at;
    bench.n_deeds = n;
}

static weft_err run(const weft_capture_options *options, weft_set *set, weft_capture_report *report,
                    weft_error *err)
{
    weft_progress progress = {0};
    const weft_err status =
        weft_capture_run(options, bench.camera, bench.controller, &progress, set, report, err);
    assert_int_equal(weft_controller_sim_lights(bench.sim, NULL), 0); /* whatever happened */
    return status;
}

static void run_well(const weft_capture_options *options, weft_capture_report *report)
{
    weft_set set;
    assert_ok(run(options, &set, report, err));
    weft_set_fini(&set);
}

/* Every file of the folder is set.json or a frame in it with the recorded hash. */
static void check_folder(const char *folder, int n_frames, bool complete)
{
    weft_set set;
    int n_files = 0;
    const struct dirent *entry;
    assert_ok(weft_set_load(folder, &set, err));
    assert_int_equal(set.n_frames, n_frames);
    assert_int_equal(set.complete, complete);
    DIR *const d = opendir(folder);
    while ((entry = readdir(d)) != NULL)
        n_files += entry->d_name[0] != '.' || strncmp(entry->d_name, ".weft-", 6) == 0;
    closedir(d);
    assert_int_equal(n_files, n_frames + 1);
    for (int i = 0; i < set.n_frames; i++) {
        char hex[65];
        char *const path = weft_set_frame_path(&set, i, NULL);
        assert_ok(weft_sha256_file(path, hex, err));
        assert_string_equal(hex, set.frames[i].sha256);
        weft_free(path);
    }
    weft_set_fini(&set);
}

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
            assert_true(abs((int)m.data[p] - sample_at(light_at(on), m.cfa, p % WIDTH, p / WIDTH)) <= 1);
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
    assert_ok(weft_camera_open_on(&bench_backend, "1", &bench.camera, err));
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
    assert_string_equal(set.frames[1].file, "light-02-b0.dng");
    for (int i = 0; i < 3; i++)
        assert_near(set.frames[4 + i].exposure_s, 0.01 * pow(4, i), 1e-9);
    assert_int_equal(set.frames[7].role, WEFT_ROLE_ALL);
    assert_int_equal(bench.lit_before_end[7], 0x3ff);
    assert_int_equal(report.n_warnings, 1); /* all on clips; the long end of the bracket may */
    weft_set_fini(&set);
    weft_capture_options wide = options;
    wide.folder = weft_test_path("wide.set");
    wide.bracket = 9;
    assert_fails(run(&wide, &set, &report, err), WEFT_ERR_RANGE, "only to 10 s");
    assert_false(weft_file_exists(wide.folder));
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
        ON_BENCH(test_a_full_set),
        ON_BENCH(test_bad_frames_are_taken_again_and_it_is_told),
        ON_BENCH(test_a_lamp_that_never_lights_is_named),
        ON_BENCH(test_resume_trusts_only_what_is_whole),
        ON_BENCH(test_cancel_and_camera_loss_leave_it_dark_and_resumable),
        ON_BENCH(test_a_board_that_resets_is_noticed),
        ON_BENCH(test_a_folder_of_other_things),
        ON_BENCH(test_a_bracket),
        ON_BENCH(test_exposure_is_found),
        ON_BENCH(test_the_dark_frame_comes_last),
        ON_BENCH(test_wishes_that_cannot_be),
        ON_BENCH(test_long_exposures_stay_lit),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
