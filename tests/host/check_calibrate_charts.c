/* The chart commands on photographs of the virtual scanner, judged by what the scanner is made of. */
#include "tests/support/support.h"

#include "calibration/calibration_report.h"
#include "calibration/charts/colour_fit.h"
#include "calibration/charts/homography.h"
#include "calibration/lens/lens_model.h"
#include "core/file.h"
#include "core/formats/png_file.h"
#include "core/json.h"
#include "core/mem.h"
#include "host/cli/command.h"
#include "host/rig/render.h"
#include "host/rig/sensor.h"
#include "host/set/set.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

enum { WIDTH = 616, HEIGHT = 408, NODES_X = 17, NODES_Y = 12 };

static weft_rig_scene scene;
static weft_rig_view view;

/* Runs a command line; its words are split at blanks. */
static int run(const char *line)
{
    char text[1024], *words[40], *rest = text;
    int n = 0;
    snprintf(text, sizeof text, "%s", line);
    for (char *w; (w = strtok_r(rest, " ", &rest)) && n < 40;)
        words[n++] = w;
    return weft_cli_main(n, words);
}

static int runf(const char *format, ...) WEFT_PRINTF(1, 2);
static int runf(const char *format, ...)
{
    char line[1024];
    va_list list;
    va_start(list, format);
    vsnprintf(line, sizeof line, format, list);
    va_end(list);
    return run(line);
}

/* What the sensor makes of a number; NULL is nothing. */
typedef uint16_t bend_fn(uint16_t dn);

static void write_frame(weft_set *set, const weft_rig_frames *frames, int light, double exposure_s,
                        int sequence, bend_fn *bend)
{
    char name[64];
    double on[WEFT_RIG_N_LIGHTS] = {0};
    weft_mosaic mosaic;
    if (light >= 0)
        on[light] = 1;
    assert_ok(weft_mosaic_init(&mosaic, WIDTH, HEIGHT, WEFT_CFA_RGGB, err));
    for (int i = 0; i < 4; i++)
        mosaic.black[i] = (float)scene.sensor.black_dn;
    mosaic.white = (float)scene.sensor.white_dn;
    weft_rig_expose(&scene, frames, on, exposure_s, 1, (uint64_t)sequence, mosaic.data);
    for (int i = 0; bend && i < WIDTH * HEIGHT; i++)
        mosaic.data[i] = bend(mosaic.data[i]);
    snprintf(name, sizeof name, "frame-%03d.dng", sequence);
    char *const path = weft_path_join(set->folder, name, NULL);
    const weft_frame_info info = {.exposure_s = exposure_s, .gain = 1, .iso = 100};
    assert_ok(weft_dng_write(path, &mosaic, &info, err));
    weft_free(path);
    weft_mosaic_fini(&mosaic);
    weft_set_frame frame = {.file = name,
                            .role = light >= 0 ? WEFT_ROLE_LIGHT : WEFT_ROLE_AMBIENT,
                            .light = light,
                            .exposure_s = exposure_s,
                            .gain = 1};
    assert_ok(weft_set_add_frame(set, &frame, err));
}

static void write_set(const char *folder, const char *sample_name, const double *exposures_s, int n_exposures,
                      bend_fn *bend)
{
    weft_rig_sample sample;
    weft_rig_frames frames;
    weft_set set;
    int sequence = 1;
    assert_ok(weft_rig_sample_init(&sample, &scene, sample_name, err));
    assert_ok(weft_rig_frames_init(&frames, &scene, &view, &sample, err));
    assert_ok(weft_folder_create(folder, err));
    assert_ok(weft_set_init(&set, folder, err));
    set.width = WIDTH;
    set.height = HEIGHT;
    set.cfa = WEFT_CFA_RGGB;
    for (int i = 0; i < 4; i++)
        set.black[i] = scene.sensor.black_dn;
    set.white = scene.sensor.white_dn;
    for (int e = 0; e < n_exposures; e++)
        for (int light = 0; light < WEFT_RIG_N_LIGHTS; light++)
            write_frame(&set, &frames, light, exposures_s[e], sequence++, bend);
    write_frame(&set, &frames, -1, exposures_s[n_exposures - 1], sequence, bend);
    set.complete = true;
    assert_ok(weft_set_save(&set, err));
    weft_set_fini(&set);
    weft_rig_frames_fini(&frames);
    weft_rig_sample_fini(&sample);
}

/* The scanner as it is: its camera, its lights, the vignetting as the grid. */
static void write_true_calibration(const char *folder)
{
    weft_calibration cal;
    weft_calibration_init(&cal);
    cal.has_camera = cal.has_lights = true;
    cal.camera = scene.camera;
    cal.n_lights = WEFT_RIG_N_LIGHTS;
    memcpy(cal.lights, scene.lights, sizeof scene.lights);
    cal.grid = (weft_light_grid){.columns = NODES_X, .rows = NODES_Y};
    cal.grid.gain = weft_alloc((size_t)(WEFT_RIG_N_LIGHTS * 3 * NODES_X * NODES_Y), sizeof(float), NULL);
    assert_non_null(cal.grid.gain);
    for (int i = 0; i < WEFT_RIG_N_LIGHTS * 3 * NODES_X * NODES_Y; i++) {
        const double u = i % NODES_X * (WIDTH - 1.0) / (NODES_X - 1);
        const double v = i / NODES_X % NODES_Y * (HEIGHT - 1.0) / (NODES_Y - 1);
        cal.grid.gain[i] = (float)weft_rig_vignetting(&scene, u, v);
    }
    assert_ok(weft_calibration_save(folder, &cal, err));
    weft_calibration_fini(&cal);
}

static int set_up(void **state)
{
    (void)state;
    static const double one[1] = {0.04}, three[3] = {0.01, 0.02, 0.04};
    weft_rig_setup setup;
    weft_rig_setup_init(&setup);
    setup.size = (weft_size){WIDTH, HEIGHT};
    assert_ok(weft_rig_scene_init(&scene, &setup, err));
    assert_ok(weft_rig_view_sensor(&view, &scene, err));
    write_set(weft_test_path("munsell.set"), "munsell", three, 3, NULL);
    write_set(weft_test_path("macbeth.set"), "macbeth", one, 1, NULL);
    return 0;
}

static int tear_down(void **state)
{
    (void)state;
    weft_rig_view_fini(&view);
    return 0;
}

/* Gains that make a flat reflectance neutral under a lamp, by the lamp's intensity. */
static double true_gain(int light, int channel)
{
    return scene.lights[light].intensity[1] / scene.lights[light].intensity[channel];
}

static void test_linearity_before_and_after_the_lights(void **state)
{
    (void)state;
    weft_calibration cal;
    const char *const set = weft_test_path("munsell.set"), *const bare = weft_test_path("bare.cal"),
                      *const full = weft_test_path("linear.cal");
    assert_int_equal(runf("weft calibrate linearity %s -o %s", set, bare), 0);
    assert_ok(weft_calibration_load(bare, &cal, err));
    assert_true(cal.has_linearity && !cal.has_lights);
    assert_true(cal.linearity.max_deviation < 0.002); /* of the series; the sensor is linear */
    assert_true(cal.linearity.range[0] <= 0.015 && cal.linearity.range[1] > 0.5);
    const json_t *report = weft_calibration_get_report(&cal, "linearity");
    assert_string_equal(json_string_value(json_object_get(report, "illumination")), "common");
    const double common = json_real_value(json_object_get(report, "greys_max_deviation"));
    weft_calibration_fini(&cal);

    write_true_calibration(full);
    assert_int_equal(runf("weft calibrate linearity %s -o %s", set, full), 0);
    assert_ok(weft_calibration_load(full, &cal, err));
    report = weft_calibration_get_report(&cal, "linearity");
    assert_string_equal(json_string_value(json_object_get(report, "illumination")), "modelled");
    const double modelled = json_real_value(json_object_get(report, "greys_max_deviation"));
    print_message("greys off by %.4f with the common light of the lamps, %.4f with the true lights\n", common,
                  modelled);
    assert_true(modelled < 0.05 && common < 0.05);
    assert_true(cal.has_camera && cal.has_lights && cal.grid.gain); /* the other parts stay */
    weft_calibration_fini(&cal);
    assert_int_equal(runf("weft calibrate linearity %s -o %s -q", set, full), 1); /* there already */
    assert_int_equal(runf("weft calibrate linearity %s -o %s --force --json", set, full), 0);
}

static void test_white_balance_is_that_of_the_lamps(void **state)
{
    (void)state;
    weft_calibration cal;
    const char *const set = weft_test_path("munsell.set"), *const bare = weft_test_path("white-bare.cal"),
                      *const full = weft_test_path("white.cal");
    assert_int_equal(runf("weft calibrate white %s -o %s", set, bare), 0);
    assert_ok(weft_calibration_load(bare, &cal, err));
    assert_true(!cal.has_lights && weft_calibration_get_report(&cal, "white"));
    weft_calibration_fini(&cal);

    write_true_calibration(full);
    assert_int_equal(runf("weft calibrate white %s -o %s", set, full), 0);
    assert_ok(weft_calibration_load(full, &cal, err));
    double worst = 0;
    for (int light = 0; light < WEFT_RIG_N_LIGHTS; light++) {
        assert_true(cal.lights[light].white_balance[1] == 1);
        for (int c = 0; c < 3; c += 2)
            worst = fmax(worst, fabs(cal.lights[light].white_balance[c] / true_gain(light, c) - 1));
    }
    print_message("white balance off by %.4f at most (the chips themselves are off neutral by up to 0.02)\n",
                  worst);
    assert_true(worst < 0.03);
    weft_calibration_fini(&cal);
}

/* What each patch is in white-balanced camera RGB: the mean over the lamps of its spectrum under each. */
static void true_camera(int patch, double camera[3])
{
    camera[0] = camera[1] = camera[2] = 0;
    for (int light = 0; light < WEFT_RIG_N_LIGHTS; light++) {
        double rgb[3];
        weft_spectra_sensor_rgb(&scene.spectra, &scene.spectra.macbeth[patch], &scene.led[light], rgb);
        for (int c = 0; c < 3; c++)
            camera[c] += rgb[c] / scene.lights[light].intensity[c] / WEFT_RIG_N_LIGHTS;
    }
}

static void test_colour_is_that_of_the_spectra(void **state)
{
    (void)state;
    weft_calibration cal;
    const char *const folder = weft_test_path("colour.cal"), *const overlay = weft_test_path("overlay.png"),
                      *const patches = weft_test_path("patches.csv");
    write_true_calibration(folder);
    assert_int_equal(runf("weft calibrate colour %s -o %s --overlay %s --patches %s",
                          weft_test_path("macbeth.set"), folder, overlay, patches),
                     0);
    assert_ok(weft_calibration_load(folder, &cal, err));
    const json_t *const report = weft_calibration_get_report(&cal, "colour");
    double worst = 0;
    weft_colour_sample samples[24];
    weft_colour_fit ideal;
    const weft_chart *chart;
    assert_ok(weft_chart_find("macbeth", "ohta1997", &chart, err));
    for (int p = 0; p < 24; p++) {
        const json_t *const patch = json_array_get(json_object_get(report, "patches"), (size_t)p);
        double camera[3];
        assert_ok(weft_json_get_numbers(patch, "camera", WEFT_JSON_REQUIRED, 3, camera, "report", err));
        assert_null(json_object_get(patch, "excluded"));
        true_camera(p, samples[p].camera);
        memcpy(samples[p].reference, chart->patches[p].linear_srgb, sizeof samples[p].reference);
        samples[p].used = true;
        for (int c = 0; c < 3; c++)
            worst = fmax(worst, fabs(camera[c] / samples[p].camera[c] - 1));
    }
    assert_ok(weft_colour_fit_patches(samples, 24, WEFT_COLOUR_MATRIX, &ideal, err));
    print_message("patch colours off by %.4f at most; held out %.2f (from the spectra themselves %.2f)\n",
                  worst, cal.colour.delta_e_held_out_mean, ideal.held_out_mean);
    assert_true(worst < 0.02);
    assert_near(cal.colour.delta_e_held_out_mean, ideal.held_out_mean, 0.1);
    assert_near(cal.colour.delta_e_mean, ideal.trained_mean, 0.1);
    for (int i = 0; i < 9; i++)
        assert_near(cal.colour.model.matrix.m[i], ideal.model.matrix.m[i], 0.03);

    /* The corners: where the true camera puts the plate of the virtual scanner. */
    double corners[8];
    weft_rig_sample sample;
    assert_ok(weft_json_get_numbers(report, "corners_px", WEFT_JSON_REQUIRED, 8, corners, "report", err));
    assert_ok(weft_rig_sample_init(&sample, &scene, "macbeth", err));
    static const double sign[4][2] = {{-1, 1}, {1, 1}, {1, -1}, {-1, -1}};
    for (int k = 0; k < 4; k++) {
        double u, v;
        const weft_vec3 at = weft_rig_plate_point(&sample.plate, sign[k][0] * sample.plate.half_width,
                                                  sign[k][1] * sample.plate.half_height);
        assert_true(weft_camera_project(&cal.camera, at, &u, &v));
        assert_near(corners[2 * k], u, 1.5); /* the lens bends the plane by about a pixel */
        assert_near(corners[2 * k + 1], v, 1.5);
    }
    weft_rig_sample_fini(&sample);
    weft_calibration_fini(&cal);
    weft_raster raster;
    assert_ok(weft_png_read(overlay, &raster, err));
    assert_true(raster.width == WIDTH / 2 && raster.height == HEIGHT / 2);
    weft_raster_fini(&raster);
    assert_true(weft_file_exists(patches));
}

static double held_out(const char *folder)
{
    weft_calibration cal;
    assert_ok(weft_calibration_load(folder, &cal, err));
    const double value = cal.colour.delta_e_held_out_mean;
    weft_calibration_fini(&cal);
    return value;
}

/* Every method, at the exposure of the set and at half of it; and maps solved with it. */
static void test_methods_and_exposures(void **state)
{
    (void)state;
    static const double half[1] = {0.02}, most[3] = {1.25, 1.05, 2.6};
    static const char *const names[3] = {"matrix", "root-polynomial", "sequence"};
    char folder[256], set[256], darker[256], maps[256], path[300];
    snprintf(folder, sizeof folder, "%s", weft_test_path("methods.cal"));
    snprintf(set, sizeof set, "%s", weft_test_path("macbeth.set"));
    snprintf(darker, sizeof darker, "%s", weft_test_path("half.set"));
    write_set(darker, "macbeth", half, 1, NULL);
    write_true_calibration(folder);
    for (int k = 0; k < 3; k++) {
        assert_int_equal(runf("weft calibrate colour %s -o %s --method %s --force", darker, folder, names[k]),
                         0);
        const double at_half = held_out(folder);
        assert_int_equal(runf("weft calibrate colour %s -o %s --method %s --force", set, folder, names[k]),
                         0);
        print_message("%s: held out %.3f, with half the exposure %.3f\n", names[k], held_out(folder),
                      at_half);
        assert_true(held_out(folder) <= most[k]);
        assert_near(held_out(folder), at_half, 0.05);
        snprintf(maps, sizeof maps, "%s", weft_test_path("methods.maps"));
        assert_int_equal(
            runf("weft solve %s -c %s -o %s --geometry sensor --resolution half --force", set, folder, maps),
            0);
        snprintf(path, sizeof path, "%s/maps.json", maps);
        json_t *info;
        assert_ok(weft_json_load(path, &info, err));
        const json_t *const gamut = json_object_get(json_object_get(info, "result"), "gamut");
        assert_true(json_is_object(gamut));
        json_decref(info);
    }
}

static void test_patches_left_out_by_hand(void **state)
{
    (void)state;
    weft_calibration cal;
    char folder[256], set[256];
    snprintf(folder, sizeof folder, "%s", weft_test_path("exclude.cal"));
    snprintf(set, sizeof set, "%s", weft_test_path("macbeth.set"));
    write_true_calibration(folder);
    assert_int_equal(runf("weft calibrate colour %s -o %s --exclude cyan --exclude 1", set, folder), 0);
    assert_ok(weft_calibration_load(folder, &cal, err));
    const json_t *const patches = json_object_get(weft_calibration_get_report(&cal, "colour"), "patches");
    for (size_t p = 0; p < 24; p++) {
        const char *const why = json_string_value(json_object_get(json_array_get(patches, p), "excluded"));
        assert_true(p == 0 || p == 17 ? why && strcmp(why, "by hand") == 0 : !why);
    }
    assert_int_equal(cal.colour.n_gamut, 22);
    weft_calibration_fini(&cal);
    assert_int_equal(runf("weft calibrate colour %s -o %s --force --exclude magenta-ish", set, folder), 2);
    assert_int_equal(runf("weft calibrate colour %s -o %s --force --exclude 25", set, folder), 2);
}

static void test_the_report_is_written(void **state)
{
    (void)state;
    char folder[256], report[256], page[300];
    snprintf(folder, sizeof folder, "%s", weft_test_path("colour.cal"));
    snprintf(report, sizeof report, "%s", weft_test_path("report"));
    snprintf(page, sizeof page, "%s/index.html", report);
    assert_int_equal(runf("weft calibrate report %s -o %s", folder, report), 0);
    char *text;
    size_t n;
    assert_ok(weft_file_read(page, 1 << 24, &text, &n, err));
    assert_non_null(strstr(text, "macbeth ohta1997, method matrix"));
    assert_non_null(strstr(text, "The Munsell line") ? text : strstr(text, "Not checked"));
    weft_free(text);
    assert_int_equal(runf("weft calibrate report %s -o %s", folder, report), 1); /* is there */
    assert_int_equal(runf("weft calibrate report %s -o %s --force --json", folder, report), 0);
    assert_int_equal(runf("weft calibrate report %s -o %s", folder, weft_test_path("one.html")), 0);
    assert_true(weft_file_exists(weft_test_path("one.html")));
    assert_int_equal(
        runf("weft calibrate report %s -o %s", weft_test_path("none.cal"), weft_test_path("no.html")), 1);
    assert_false(weft_file_exists(weft_test_path("no.html")));
    assert_int_equal(runf("weft calibrate report %s", folder), 2);
}

static void test_corners_by_hand_give_the_same(void **state)
{
    (void)state;
    weft_calibration found, given;
    const char *const folder = weft_test_path("hand.cal");
    double c[8];
    write_true_calibration(folder);
    assert_ok(weft_calibration_load(weft_test_path("colour.cal"), &found, err));
    assert_ok(weft_json_get_numbers(weft_calibration_get_report(&found, "colour"), "corners_px",
                                    WEFT_JSON_REQUIRED, 8, c, "report", err));
    assert_int_equal(runf("weft calibrate colour %s -o %s --corners %.0f,%.0f,%.0f,%.0f,%.0f,%.0f,%.0f,%.0f",
                          weft_test_path("macbeth.set"), folder, c[0], c[1], c[2], c[3], c[4], c[5], c[6],
                          c[7]),
                     0);
    assert_ok(weft_calibration_load(folder, &given, err));
    for (int i = 0; i < 9; i++)
        assert_near(given.colour.model.matrix.m[i], found.colour.model.matrix.m[i], 2e-3);
    weft_calibration_fini(&found);
    weft_calibration_fini(&given);
}

static uint16_t gamma_bend(uint16_t dn)
{
    const double x = ((double)dn - 256) / (15871 - 256);
    return (uint16_t)(256.5 + (15871 - 256) * (x > 0 ? pow(x, 0.8) : 0));
}

static uint16_t slight_gamma_bend(uint16_t dn)
{
    const double x = ((double)dn - 256) / (15871 - 256);
    return (uint16_t)(256.5 + (15871 - 256) * (x > 0 ? pow(x, 0.92) : 0));
}

static void test_a_slight_gamma_is_seen_in_one_exposure(void **state)
{
    (void)state;
    static const double one[1] = {0.04};
    char set[256], none[256], full[256];
    snprintf(set, sizeof set, "%s", weft_test_path("gamma.set"));
    snprintf(none, sizeof none, "%s", weft_test_path("gamma-none.cal"));
    snprintf(full, sizeof full, "%s", weft_test_path("gamma.cal"));
    write_set(set, "munsell", one, 1, slight_gamma_bend);
    write_true_calibration(full);
    assert_int_equal(runf("weft calibrate linearity %s -o %s", set, full), 1);
    assert_int_equal(runf("weft calibrate linearity %s -o %s", set, none), 1);
    assert_false(weft_folder_exists(none));
}

static void test_refusals_leave_the_calibration_alone(void **state)
{
    (void)state;
    static const double three[3] = {0.01, 0.02, 0.04}, one[1] = {0.04}, longer[1] = {0.3};
    char folder[256], none[256], macbeth[256]; /* the paths of weft_test_path() do not last */
    snprintf(folder, sizeof folder, "%s", weft_test_path("refused.cal"));
    snprintf(none, sizeof none, "%s", weft_test_path("none.cal"));
    snprintf(macbeth, sizeof macbeth, "%s", weft_test_path("macbeth.set"));
    write_set(weft_test_path("bent.set"), "munsell", three, 3, gamma_bend);
    write_set(weft_test_path("white.set"), "white", one, 1, NULL);
    write_set(weft_test_path("over.set"), "macbeth", longer, 1, NULL);
    assert_int_equal(runf("weft calibrate linearity %s -o %s", weft_test_path("bent.set"), none), 1);
    assert_int_equal(runf("weft calibrate linearity %s -o %s", weft_test_path("white.set"), none),
                     1);                                                        /* no chart */
    assert_int_equal(runf("weft calibrate white %s -o %s", macbeth, none), 1);  /* another one */
    assert_int_equal(runf("weft calibrate colour %s -o %s", macbeth, none), 1); /* no lights */
    assert_false(weft_folder_exists(none));

    write_true_calibration(folder);
    assert_int_equal(runf("weft calibrate colour %s -o %s", weft_test_path("over.set"), folder),
                     1); /* clipped */
    assert_int_equal(runf("weft calibrate colour %s -o %s --edition 1976", macbeth, folder), 2);
    weft_calibration other; /* of a camera with other frames */
    assert_ok(weft_calibration_load(folder, &other, err));
    other.camera.width *= 2;
    assert_ok(weft_calibration_save(weft_test_path("other.cal"), &other, err));
    weft_calibration_fini(&other);
    assert_int_equal(runf("weft calibrate colour %s -o %s", macbeth, weft_test_path("other.cal")), 1);
    assert_int_equal(runf("weft calibrate colour %s -o %s --corners 1,2,3", macbeth, folder), 2);
    assert_int_equal(
        runf("weft calibrate colour %s -o %s --overlay %s", macbeth, folder, weft_test_path("overlay.png")),
        1);
    assert_int_equal(runf("weft calibrate colour %s", macbeth), 2);
    weft_calibration cal;
    assert_ok(weft_calibration_load(folder, &cal, err));
    assert_false(cal.has_colour);
    weft_calibration_fini(&cal);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_linearity_before_and_after_the_lights),
        cmocka_unit_test(test_white_balance_is_that_of_the_lamps),
        cmocka_unit_test(test_colour_is_that_of_the_spectra),
        cmocka_unit_test(test_methods_and_exposures),
        cmocka_unit_test(test_patches_left_out_by_hand),
        cmocka_unit_test(test_the_report_is_written),
        cmocka_unit_test(test_corners_by_hand_give_the_same),
        cmocka_unit_test(test_a_slight_gamma_is_seen_in_one_exposure),
        cmocka_unit_test(test_refusals_leave_the_calibration_alone),
    };
    return cmocka_run_group_tests(tests, set_up, tear_down);
}
