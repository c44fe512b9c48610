/* Whole sets: mosaics on disk, with black level and ambient light, to maps. */
#include "tests/support/support.h"

#include "core/file.h"
#include "core/formats/png_file.h"
#include "core/mem.h"
#include "core/mem_limit.h"
#include "core/parallel.h"
#include "core/progress.h"
#include "host/set/compare.h"
#include "host/solve/light_plates.h"
#include "host/solve/relight.h"
#include "host/solve/solve.h"
#include "tests/host/dome.h"

#include <math.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

enum { WIDTH = 240, HEIGHT = 160, N = 10 };

#define BLACK    1000.0
#define WHITE    60000.0
#define EXPOSURE 0.05
#define AMBIENT  0.03 /* of full scale */

static weft_calibration cal;

/* Long waves of slope, and an albedo that changes slowly enough for the demosaicing. */
static void surface(const double point[3], double normal[3], double albedo[3])
{
    const double p = 0.3 * sin(point[0] / 9), q = 0.25 * cos(point[1] / 7);
    const double length = sqrt(p * p + q * q + 1);
    normal[0] = -p / length;
    normal[1] = -q / length;
    normal[2] = 1 / length;
    for (int c = 0; c < 3; c++)
        albedo[c] = 0.5 + 0.1 * c + 0.1 * sin(point[0] / 20 + c);
}

static void write_frame(const char *path, int light)
{
    weft_raster raster;
    assert_ok(weft_raster_init(&raster, WIDTH, HEIGHT, 1, 16, err));
    for (int v = 0; v < HEIGHT; v++)
        for (int u = 0; u < WIDTH; u++) {
            double point[3], normal[3], albedo[3], value = AMBIENT;
            const int c = weft_cfa_colour(WEFT_CFA_GRBG, u, v);
            dome_point(&cal.camera, u, v, 0, point);
            surface(point, normal, albedo);
            if (light >= 0)
                value += EXPOSURE * dome_radiance(&cal.lights[light], c, point, normal, albedo[c]);
            raster.data[v * WIDTH + u] = (uint16_t)lround(fmin(BLACK + value * (WHITE - BLACK), WHITE));
        }
    assert_ok(weft_png_write(path, &raster, err));
    weft_raster_fini(&raster);
}

static weft_set made;

static int make_set(void **state)
{
    (void)state;
    const char *const folder = weft_test_path("waves.set");
    dome_init(&cal, WIDTH, HEIGHT);
    assert_ok(weft_folder_create(folder, err));
    assert_ok(weft_set_init(&made, folder, err));
    made.width = WIDTH;
    made.height = HEIGHT;
    made.cfa = WEFT_CFA_GRBG;
    made.white = WHITE;
    made.complete = true;
    for (int i = 0; i < 4; i++)
        made.black[i] = BLACK;
    for (int j = -1; j < N; j++) {
        char name[32];
        if (j < 0)
            snprintf(name, sizeof name, "ambient.png");
        else
            snprintf(name, sizeof name, "light-%02d.png", j);
        char *const path = weft_path_join(folder, name, NULL);
        write_frame(path, j);
        weft_free(path);
        const weft_set_frame frame = {.file = name,
                                      .role = j < 0 ? WEFT_ROLE_AMBIENT : WEFT_ROLE_LIGHT,
                                      .light = j,
                                      .exposure_s = EXPOSURE,
                                      .gain = 1};
        assert_ok(weft_set_add_frame(&made, &frame, err));
    }
    assert_ok(weft_set_save(&made, err));
    assert_ok(weft_calibration_save(weft_test_path("dome.cal"), &cal, err));
    return 0;
}

static int free_set(void **state)
{
    (void)state;
    weft_set_fini(&made);
    weft_calibration_fini(&cal);
    return 0;
}

static weft_err solve_with(weft_set *set, const weft_solve_options *options, weft_maps *maps, weft_error *err)
{
    return weft_solve_set(set, &cal, weft_test_path("dome.cal"), options, maps, err);
}

typedef struct figures {
    double normal_mean, normal_max, albedo_mean;
    int n;
} figures;

/* Errors of maps whose pixel (i, j) lies at a known world point; two pixels at the edge are left out. */
static figures measure(const weft_maps *m, bool half)
{
    figures f = {0};
    for (int j = 2; j < m->height - 2; j++)
        for (int i = 2; i < m->width - 2; i++) {
            double point[3] = {m->origin_mm[0] + i * m->mm_per_px, m->origin_mm[1] - j * m->mm_per_px, 0};
            double normal[3], albedo[3], found[3];
            if (!m->mask.data[j * m->width + i])
                continue;
            if (m->geometry == WEFT_GEOMETRY_SENSOR)
                dome_point(&cal.camera, half ? 2 * i + 0.5 : i, half ? 2 * j + 0.5 : j, 0, point);
            surface(point, normal, albedo);
            for (int c = 0; c < 3; c++) {
                found[c] = weft_image_row(&m->normal, c, j)[i];
                f.albedo_mean += fabs((double)weft_image_row(&m->albedo, c, j)[i] - albedo[c]) / 3;
            }
            const double e = dome_angle_deg(found, normal);
            f.normal_mean += e;
            f.normal_max = fmax(f.normal_max, e);
            f.n++;
        }
    f.normal_mean /= f.n;
    f.albedo_mean /= f.n;
    print_message("%d x %d: normal mean %.4f max %.3f degrees, albedo %.5f\n", m->width, m->height,
                  f.normal_mean, f.normal_max, f.albedo_mean);
    return f;
}

static void test_sensor_geometry(void **state)
{
    (void)state;
    weft_maps full = {0}, half = {0};
    weft_solve_options options = {.sensor_geometry = true, .no_bounce = true};
    assert_ok(solve_with(&made, &options, &full, err));
    const figures f = measure(&full, false);
    assert_true(f.normal_mean < 0.05 && f.normal_max < 0.4 && f.albedo_mean < 0.001);
    assert_int_equal(f.n, (WIDTH - 4) * (HEIGHT - 4));
    options.half = true;
    assert_ok(solve_with(&made, &options, &half, err));
    assert_int_equal(half.width, WIDTH / 2);
    const figures g = measure(&half, true);
    assert_true(g.normal_mean < 0.3 && g.albedo_mean < 0.003);
    weft_maps_fini(&full);
    weft_maps_fini(&half);
}

static void test_plane_geometry(void **state)
{
    (void)state;
    weft_maps maps = {0};
    const weft_solve_options options = {.no_bounce = true}; /* the formulas know no light from the walls */
    assert_ok(solve_with(&made, &options, &maps, err));
    assert_int_equal(maps.geometry, WEFT_GEOMETRY_PLANE);
    assert_near(maps.mm_per_px, 0.642, 1e-9); /* 154 mm / 240 px to 3 digits */
    assert_near(maps.origin_mm[0], -0.5 * (maps.width - 1) * maps.mm_per_px, 1e-9);
    const figures f = measure(&maps, false);
    assert_true(f.normal_mean < 0.1 && f.albedo_mean < 0.002);
    assert_true(f.n > 0.9 * WIDTH * HEIGHT);
    weft_maps_fini(&maps);
}

static void test_maps_say_how_they_were_made(void **state)
{
    (void)state;
    weft_maps maps = {0}, back = {0};
    const weft_solve_options options = {.sensor_geometry = true, .shadow = 0.01};
    assert_ok(solve_with(&made, &options, &maps, err));
    const json_t *const inputs = json_object_get(maps.info, "inputs");
    const json_t *const frames = json_object_get(json_object_get(inputs, "set"), "frames");
    assert_int_equal(json_object_size(frames), N + 1);
    assert_int_equal(strlen(json_string_value(json_object_get(frames, "light-03.png"))), 64);
    assert_non_null(json_object_get(json_object_get(inputs, "calibration"), "calibration.json"));
    assert_string_equal(json_string_value(json_object_get(json_object_get(maps.info, "options"), "method")),
                        "robust");
    assert_true(json_number_value(json_object_get(json_object_get(maps.info, "seconds"), "solve")) > 0);
    const char *const folder = weft_test_path("said.maps");
    assert_ok(weft_maps_save(folder, &maps, false, err));
    assert_ok(weft_maps_load(folder, &back, err));
    weft_maps_difference d;
    assert_ok(weft_compare_maps(&maps, &back, NULL, &d, err));
    assert_true(d.normal_deg.max < 1e-4 && d.delta_e.max < 0.2);
    weft_maps_fini(&maps);
    weft_maps_fini(&back);
}

/* On 1, 2 and 4 threads, with all memory there is, and with all planes in files that are given back after
 * each band. */
static void test_mask_and_same_bits(void **state)
{
    (void)state;
    static const int threads[] = {1, 2, 4};
    static const double limits[] = {0, 1, 0};
    weft_mask mask;
    weft_maps maps[3] = {{0}};
    assert_ok(weft_mask_init(&mask, WIDTH, HEIGHT, 255, err));
    for (int v = 40; v < 60; v++)
        memset(mask.data + v * WIDTH + 100, 0, 30);
    assert_ok(weft_png_write_mask(weft_test_path("waves.set/mask.png"), &mask, err));
    weft_mask_fini(&mask);
    made.mask_file = weft_strdup("mask.png", NULL);
    for (int m = 0; weft_solve_methods[m]; m++) {
        const weft_solve_options options = {.method = weft_solve_methods[m]};
        for (int i = 0; i < 3; i++) {
            weft_parallel_set_threads(threads[i]);
            weft_mem_set_limit(limits[i]);
            weft_maps_fini(&maps[i]);
            assert_ok(solve_with(&made, &options, &maps[i], err));
            assert_true(limits[i] == 0 || weft_mem_in_files() > 0);
            const size_t n = weft_image_plane_size(&maps[0].normal);
            assert_memory_equal(maps[0].normal.data, maps[i].normal.data, 3 * n * sizeof(float));
            assert_memory_equal(maps[0].albedo.data, maps[i].albedo.data, 3 * n * sizeof(float));
            assert_memory_equal(maps[0].confidence.data, maps[i].confidence.data, n * sizeof(float));
            assert_memory_equal(maps[0].uncertainty.data, maps[i].uncertainty.data, n * sizeof(float));
            assert_memory_equal(maps[0].lights.data, maps[i].lights.data, n);
            assert_memory_equal(maps[0].quality.data, maps[i].quality.data, n);
        }
    }
    weft_mem_set_limit(0);
    weft_parallel_set_threads(0);
    weft_solve_options sensor = {.sensor_geometry = true};
    weft_maps_fini(&maps[1]);
    assert_ok(solve_with(&made, &sensor, &maps[1], err));
    int holes = 0;
    for (int i = 0; i < WIDTH * HEIGHT; i++)
        holes += maps[1].mask.data[i] == 0;
    assert_int_equal(holes, 20 * 30);
    weft_free(made.mask_file);
    made.mask_file = NULL;
    for (int i = 0; i < 3; i++)
        weft_maps_fini(&maps[i]);
}

static void test_ambient_is_subtracted(void **state)
{
    (void)state;
    weft_maps maps = {0};
    const weft_solve_options options = {.sensor_geometry = true, .no_bounce = true};
    const weft_frame_role role = made.frames[0].role;
    made.frames[0].role = WEFT_ROLE_DARK; /* without it the error is plain to see */
    assert_ok(solve_with(&made, &options, &maps, err));
    made.frames[0].role = role;
    assert_true(measure(&maps, false).normal_mean > 0.3);
    weft_maps_fini(&maps);
}

/* What the set recorded at another analogue gain, or what the calibration measured. */
static void test_noise_is_the_sensors(void **state)
{
    (void)state;
    weft_light_plates plates = {0};
    weft_solve_row_in in[WEFT_LIGHTS_MAX];
    weft_set set = made;
    weft_calibration measured = cal;
    assert_ok(weft_light_plates_load(&made, WEFT_READ_SITES, &plates, err));
    const double floor = plates.plate[0].noise_floor;
    weft_light_plates_know_noise(&plates, &set, &cal);
    assert_true(plates.noise.shot == 0 && plates.plate[0].noise_floor == floor);

    set.noise = (weft_noise){4e-12, 1e-4};
    set.noise_gain = 2;
    weft_light_plates_know_noise(&plates, &set, &cal);
    weft_light_plates_row(&plates, 3, in);
    assert_near((double)in[0].shot, 0.5e-4 / EXPOSURE, 1e-9);
    assert_near((double)in[0].read, 1e-12 / (EXPOSURE * EXPOSURE), 1e-14);
    weft_light_plates_fini(&plates);

    int first = 0; /* its file is the mean of four frames: a quarter of both variances */
    while (made.frames[first].role != WEFT_ROLE_LIGHT || made.frames[first].light != 0)
        first++;
    json_t *const before = made.frames[first].capture;
    made.frames[first].capture = json_pack("{s:i}", "mean_of", 4);
    assert_ok(weft_light_plates_load(&made, WEFT_READ_SITES, &plates, err));
    json_decref(made.frames[first].capture);
    made.frames[first].capture = before;
    weft_light_plates_know_noise(&plates, &set, &cal);
    weft_light_plates_row(&plates, 3, in);
    assert_near((double)in[0].shot, 0.125e-4 / EXPOSURE, 1e-9);
    assert_near((double)in[1].shot, 0.5e-4 / EXPOSURE, 1e-9);
    assert_near((double)in[0].read, 0.25e-12 / (EXPOSURE * EXPOSURE), 1e-14);

    set.noise_gain = 0;
    measured.other = json_pack("{s:{s:{s:f, s:[{s:f, s:f}]}}}", "reports", "linearity", "noise_gain", 1.0,
                               "noise", "gain_e_per_dn", 2.0, "read_noise_e", 3.0);
    weft_light_plates_know_noise(&plates, &set, &measured);
    assert_near(plates.noise.shot, 1 / (2 * (WHITE - BLACK)), 1e-12);
    assert_near(plates.noise.read, pow(1.5 / (WHITE - BLACK), 2), 1e-15);
    json_decref(measured.other);
    weft_light_plates_fini(&plates);
}

static void test_refuses_what_does_not_fit(void **state)
{
    (void)state;
    weft_maps maps = {0};
    const weft_solve_options options = {.no_bounce = true}; /* the formulas know no light from the walls */
    weft_set_frame kept = made.frames[4];
    made.frames[4].role = WEFT_ROLE_DARK;
    assert_fails(solve_with(&made, &options, &maps, err), WEFT_ERR_MISSING, "weft capture");
    made.frames[4] = kept;
    made.complete = false;
    assert_fails(solve_with(&made, &options, &maps, err), WEFT_ERR_MISSING, "--resume");
    made.complete = true;
    cal.n_lights = 9;
    assert_fails(solve_with(&made, &options, &maps, err), WEFT_ERR_MISMATCH, "has 9");
    cal.n_lights = N;
    cal.camera.width = 1232;
    assert_fails(solve_with(&made, &options, &maps, err), WEFT_ERR_MISMATCH, "1232");
    cal.camera.width = WIDTH;
    cal.camera.has_pose = false;
    assert_fails(solve_with(&made, &options, &maps, err), WEFT_ERR_MISSING, "weft calibrate lens");
    cal.camera.has_pose = true;
    cal.has_lights = false;
    assert_fails(solve_with(&made, &options, &maps, err), WEFT_ERR_MISSING, "weft calibrate lights");
    cal.has_lights = true;
    const weft_solve_method *method;
    assert_fails(weft_solve_find_method("lsqr", &method, err), WEFT_ERR_USAGE, "lsq");
    assert_null(maps.normal.data);
}

static void test_damaged_frame_is_named(void **state)
{
    (void)state;
    weft_maps maps = {0};
    const weft_solve_options options = {.no_bounce = true}; /* the formulas know no light from the walls */
    char *bytes;
    size_t n;
    const char *const path = weft_test_path("waves.set/light-05.png");
    assert_ok(weft_file_read(path, 1 << 24, &bytes, &n, err));
    assert_ok(weft_file_write(path, bytes, n / 2, err));
    assert_fails(solve_with(&made, &options, &maps, err), WEFT_ERR_FORMAT, "light-05.png");
    assert_ok(weft_file_write(path, bytes, n, err));
    weft_free(bytes);
    assert_null(maps.normal.data);
}

static void test_black_frames_have_no_answer(void **state)
{
    (void)state;
    weft_maps maps = {0};
    const weft_solve_options options = {.no_bounce = true}; /* the formulas know no light from the walls */
    const double white = made.white;
    for (int i = 0; i < 4; i++)
        made.black[i] = 0;
    made.white = 900; /* every pixel is saturated */
    assert_fails(solve_with(&made, &options, &maps, err), WEFT_ERR_NODATA, "exposure");
    made.white = white;
    for (int i = 0; i < 4; i++)
        made.black[i] = BLACK;
    assert_null(maps.normal.data);
}

static void test_cancel_leaves_nothing(void **state)
{
    (void)state;
    weft_maps maps = {0};
    const weft_solve_options options = {.no_bounce = true}; /* the formulas know no light from the walls */
    weft_cancel_request(true);
    assert_fails(solve_with(&made, &options, &maps, err), WEFT_ERR_CANCELLED, "");
    weft_cancel_request(false);
    assert_null(maps.normal.data);
}

static void test_every_failed_allocation_is_an_error(void **state)
{
    (void)state;
    const weft_solve_options options = {.half = true};
    int failures = 0;
    for (long n = 0; n < 400; n += 1 + n / 4) {
        weft_maps maps = {0};
        weft_error error = {0};
        weft_mem_fail_after(n);
        const weft_err status = solve_with(&made, &options, &maps, &error);
        weft_mem_fail_after(-1);
        if (status == WEFT_OK) {
            weft_maps_fini(&maps);
            continue;
        }
        failures++;
        assert_int_equal(status, WEFT_ERR_NOMEM);
        assert_null(maps.normal.data);
    }
    assert_true(failures > 12);
}

static void test_distant_lights_need_no_camera(void **state)
{
    (void)state;
    weft_calibration distant = {.has_lights = true, .n_lights = N};
    weft_maps maps = {0};
    for (int j = 0; j < N; j++) {
        distant.lights[j] = (weft_light){.distant = true,
                                         .direction = weft_normalise(cal.lights[j].position),
                                         .intensity = {1, 1, 1},
                                         .exponent = 1};
    }
    weft_solve_options options = {0};
    assert_ok(weft_solve_set(&made, &distant, weft_test_path("dome.cal"), &options, &maps, err));
    assert_int_equal(maps.geometry, WEFT_GEOMETRY_SENSOR);
    weft_maps_fini(&maps);
    options.plane_geometry = true;
    assert_fails(weft_solve_set(&made, &distant, weft_test_path("dome.cal"), &options, &maps, err),
                 WEFT_ERR_MISSING, "weft calibrate lens");
}

/* ---- nonsense ---- */

static void test_lights_in_a_cone_are_refused(void **state)
{
    (void)state;
    weft_calibration narrow = cal;
    weft_maps maps = {0};
    const weft_solve_options options = {0};
    for (int j = 0; j < N; j++)
        narrow.lights[j].position = (weft_vec3){20 * cos(j), 20 * sin(j), 300};
    assert_fails(weft_solve_set(&made, &narrow, weft_test_path("dome.cal"), &options, &maps, err),
                 WEFT_ERR_RANGE, "within 7.6 degrees");
    for (int j = 0; j < N; j++)
        narrow.lights[j].position = (weft_vec3){300 * cos(0.3 * (j + 1)), 0, 300 * sin(0.3 * (j + 1))};
    assert_fails(weft_solve_set(&made, &narrow, weft_test_path("dome.cal"), &options, &maps, err),
                 WEFT_ERR_RANGE, "in a plane");
}

/* The set's frames, all but three of them saturated by a lower white level. */
static void test_three_lights_are_too_few(void **state)
{
    (void)state;
    weft_set three;
    weft_calibration few = cal;
    weft_maps maps = {0};
    const weft_solve_options options = {0};
    assert_ok(weft_set_load(weft_test_path("waves.set"), &three, err));
    for (int i = 0, n = 0; i < three.n_frames; i++)
        if (three.frames[i].role == WEFT_ROLE_LIGHT && three.frames[i].light >= 3)
            three.frames[i].role = WEFT_ROLE_ALL;
        else
            n++;
    few.n_lights = 3;
    weft_light_grid none = {0};
    few.grid = none;
    assert_fails(weft_solve_set(&three, &few, weft_test_path("dome.cal"), &options, &maps, err),
                 WEFT_ERR_NODATA, "fewer than four usable lights");
    assert_null(maps.normal.data);
    weft_set_fini(&three);
}

static void test_memory_is_asked_before_it_is_used(void **state)
{
    (void)state;
    weft_maps maps = {0};
    weft_solve_options options = {.memory_bytes = 50e6};
    assert_fails(solve_with(&made, &options, &maps, err), WEFT_ERR_NOMEM, "give --memory");
    options.memory_bytes = 100e6;
    assert_ok(solve_with(&made, &options, &maps, err));
    weft_maps_fini(&maps);
}

/* ---- relighting ---- */

static void test_lights_predict_each_other(void **state)
{
    (void)state;
    weft_relight r = {0};
    weft_calibration wrong = cal;
    weft_solve_options options = {.method = &weft_method_lsq};
    assert_ok(weft_relight_set(&made, &cal, weft_test_path("dome.cal"), &options, &r, err));
    print_message("exact light: rms %.5f of full scale, %.5f relative, %zu px\n", r.rms_all, r.relative_all,
                  r.pixels);
    assert_true(r.rms_all < 1e-4 && r.relative_all < 1e-3 && r.pixels == (size_t)WIDTH * HEIGHT);
    assert_true(weft_image_row(&r.map, 0, 50)[70] < 1e-3F);
    weft_relight_fini(&r);
    for (int c = 0; c < 3; c++)
        wrong.lights[3].intensity[c] *= 1.05; /* the lamp has lost a twentieth since */
    assert_ok(weft_relight_set(&made, &wrong, weft_test_path("dome.cal"), &options, &r, err));
    for (int j = 0; j < N; j++)
        print_message("light %d: rms %.4f relative, bias %+.4f\n", j, r.relative[j], r.bias[j]);
    for (int j = 0; j < N; j++)
        assert_true(j == 3 ? r.bias[j] > 0.04 && r.bias[j] < 0.06 : fabs(r.bias[j]) < 0.025);
    weft_relight_fini(&r);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_sensor_geometry),
        cmocka_unit_test(test_plane_geometry),
        cmocka_unit_test(test_maps_say_how_they_were_made),
        cmocka_unit_test(test_mask_and_same_bits),
        cmocka_unit_test(test_ambient_is_subtracted),
        cmocka_unit_test(test_noise_is_the_sensors),
        cmocka_unit_test(test_refuses_what_does_not_fit),
        cmocka_unit_test(test_damaged_frame_is_named),
        cmocka_unit_test(test_black_frames_have_no_answer),
        cmocka_unit_test(test_cancel_leaves_nothing),
        cmocka_unit_test(test_every_failed_allocation_is_an_error),
        cmocka_unit_test(test_distant_lights_need_no_camera),
        cmocka_unit_test(test_lights_in_a_cone_are_refused),
        cmocka_unit_test(test_three_lights_are_too_few),
        cmocka_unit_test(test_memory_is_asked_before_it_is_used),
        cmocka_unit_test(test_lights_predict_each_other),
    };
    return cmocka_run_group_tests(tests, make_set, free_set);
}
