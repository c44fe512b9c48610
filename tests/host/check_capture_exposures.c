/* Exposures of a set: what one is judged by, brackets, the means of frames, and how they are found. */
#include "tests/host/capture_bench.h"
#include "tests/support/support.h"

#include "core/file.h"
#include "core/progress.h"
#include "host/capture/auto_exposure.h"
#include "host/capture/average.h"
#include "host/capture/frame_stats.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

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
        cmocka_unit_test(test_statistics),      cmocka_unit_test(test_a_mean_of_frames),
        ON_BENCH(test_each_file_is_a_mean),     ON_BENCH(test_a_bracket),
        ON_BENCH(test_exposures_of_each_light), ON_BENCH(test_brackets_are_found),
        ON_BENCH(test_exposure_is_found),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
