/* Lights found from white sheets that the test computes by its own closed formula. */
#include "tests/support/support.h"

#include "calibration/lens/lens_model.h"
#include "calibration/lights/light_fit.h"
#include "calibration/lights/light_model.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#define PI      3.14159265358979323846
#define N       10
#define DEGREES (PI / 180)

/* A lamp of the truth. */
typedef struct lamp {
    double x, y, z, aim_x, aim_y, exponent, phi[3];
} lamp;

typedef struct scene {
    weft_camera camera;
    lamp lamps[N];
    double vignetting; /* loss at the corner beside the cosine law */
    double off_centre; /* px of its middle from the camera's, in u */
    double noise;      /* standard deviation of a cell's mean, relative */
    double reflectance;
    double bow_mm;   /* the middle over the edges at x = +-77 mm */
    double tilt_deg; /* rises towards +X */
} scene;

/* Ten lamps near a dome of 300 mm: not on it, not evenly spread, aimed within a degree. */
static scene make_scene(uint64_t seed, double aim_deg, double noise)
{
    scene s = {.camera = {.width = 1232,
                          .height = 816,
                          .fx = 4810,
                          .fy = 4795,
                          .cx = 622,
                          .cy = 401,
                          .distortion = {-0.15, 0.3, 4e-4, -3e-4, 0},
                          .has_pose = true,
                          .translation = {3, -5, 602}},
               .vignetting = 0.06,
               .noise = noise,
               .reflectance = 0.99};
    const double a = PI - 0.04;
    s.camera.rotation = (weft_mat3){{1, 0, 0, 0, cos(a), -sin(a), 0, sin(a), cos(a)}};
    for (int i = 0; i < N; i++) {
        const double elevation = (i < 6 ? 35 : i < 9 ? 60 : 80) * DEGREES;
        const double azimuth = (i < 6 ? 60 * i : i < 9 ? 30 + 120 * (i - 6) : 75) * DEGREES;
        lamp *const l = &s.lamps[i];
        l->x = 300 * cos(elevation) * cos(azimuth) + 4 * weft_test_gauss(&seed);
        l->y = 300 * cos(elevation) * sin(azimuth) + 4 * weft_test_gauss(&seed);
        l->z = 300 * sin(elevation) + 4 * weft_test_gauss(&seed);
        l->aim_x = 300 * tan(aim_deg * DEGREES) * (2 * weft_test_random(&seed) - 1);
        l->aim_y = 300 * tan(aim_deg * DEGREES) * (2 * weft_test_random(&seed) - 1);
        l->exponent = 1 + 0.4 * weft_test_random(&seed);
        for (int c = 0; c < 3; c++)
            l->phi[c] = (0.85 + 0.3 * weft_test_random(&seed)) * (double[]){1.1, 2, 1.5}[c];
    }
    return s;
}

static double vignetting_at(const scene *s, double u, double v)
{
    const double x = (u - s->camera.cx - s->off_centre) / s->camera.fx, y = (v - s->camera.cy) / s->camera.fy;
    const double corner2 = (616.0 * 616 + 408 * 408) / (4800.0 * 4800), t2 = x * x + y * y;
    return (1 - s->vignetting * t2 / corner2) / ((1 + t2) * (1 + t2)); /* cos^4 and a lens's own */
}

/* The formula of docs/formats.md, written down once more: what the sheet gives in a pixel. */
static double sheet_light(const scene *s, int light, int channel, double u, double v)
{
    const lamp *const l = &s->lamps[light];
    weft_vec3 p = {0};
    const double c = s->bow_mm / (77 * 77), t = tan(s->tilt_deg * DEGREES);
    double z = 0;
    for (int i = 0; i < (c != 0 || t != 0 ? 5 : 1); i++) {
        assert_true(weft_camera_to_plane(&s->camera, u, v, z, &p));
        z = s->bow_mm - c * p.x * p.x + t * p.x;
    }
    const double slope = t - 2 * c * p.x;
    const double dx = l->x - p.x, dy = l->y - p.y, dz = l->z - z, r = sqrt(dx * dx + dy * dy + dz * dz);
    const double bx = l->x - l->aim_x, by = l->y - l->aim_y, b = sqrt(bx * bx + by * by + l->z * l->z);
    const double cos_theta = (bx * dx + by * dy + l->z * dz) / (r * b), r_m = r / 1000;
    const double facing = (dz - slope * dx) / (r * sqrt(1 + slope * slope));
    return s->reflectance * l->phi[channel] * pow(cos_theta, l->exponent) * facing / (r_m * r_m);
}

static void fill_sheet(const scene *s, weft_white_sheet *sheet, uint64_t seed)
{
    assert_ok(weft_white_sheet_init(sheet, s->camera.width, s->camera.height, N, err));
    for (int l = 0; l < N; l++)
        for (int c = 0; c < 3; c++)
            for (int j = 0; j < sheet->rows; j++)
                for (int i = 0; i < sheet->columns; i++) {
                    const double u = weft_white_sheet_centre(sheet, i), v = weft_white_sheet_centre(sheet, j);
                    const double value = sheet_light(s, l, c, u, v) * vignetting_at(s, u, v);
                    weft_white_sheet_plane(sheet, l, c)[j * sheet->columns + i] =
                        (float)(value * (1 + s->noise * weft_test_gauss(&seed)));
                }
}

/* How far the calibration is from the truth. */
typedef struct error {
    double position_mean, position_max; /* mm */
    double field_max;                   /* of model times grid against the sheet, relative */
    double intensity_max;               /* relative */
    double direction_max_deg;           /* of the light's direction at the middle of the plate */
    double sigmas;                      /* rms of the coordinates' errors over their standard deviations */
} error;

static error compare(const scene *s, const weft_calibration *cal)
{
    error e = {0};
    for (int l = 0; l < N; l++) {
        const weft_light *const light = &cal->lights[l];
        const lamp *const t = &s->lamps[l];
        const weft_vec3 d = {light->position.x - t->x, light->position.y - t->y, light->position.z - t->z};
        e.position_mean += weft_length(d) / N;
        e.position_max = fmax(e.position_max, weft_length(d));
        e.direction_max_deg =
            fmax(e.direction_max_deg,
                 weft_angle_between(light->position, (weft_vec3){t->x, t->y, t->z}) / DEGREES);
        for (int c = 0; c < 3; c++) {
            e.intensity_max = fmax(e.intensity_max, fabs(light->intensity[c] / t->phi[c] - 1));
            for (int v = 0; v < 816; v += 41)
                for (int u = 0; u < 1232; u += 43) {
                    weft_vec3 p, to_light;
                    assert_true(weft_camera_to_plane(&s->camera, u, v, 0, &p));
                    const double a = weft_light_at(light, p, &to_light);
                    const double model = s->reflectance * light->intensity[c] * a * to_light.z *
                                         weft_light_grid_gain(cal, l, c, u, v);
                    scene flat = *s; /* the plate, whatever the sheet was like */
                    flat.bow_mm = flat.tilt_deg = 0;
                    const double truth = sheet_light(&flat, l, c, u, v) * vignetting_at(s, u, v);
                    e.field_max = fmax(e.field_max, fabs(model / truth - 1));
                }
        }
    }
    return e;
}

static error run(const scene *s, const char *what, const weft_light_fit_options *options,
                 weft_light_fit_report *report)
{
    weft_white_sheet sheet;
    weft_calibration cal = {.has_camera = true, .camera = s->camera};
    fill_sheet(s, &sheet, 77);
    assert_ok(weft_light_fit(&s->camera, &sheet, options, &cal, report, err));
    error e = compare(s, &cal);
    double sigma = 0;
    for (int l = 0; l < N; l++) {
        sigma += cal.lights[l].position_sigma_mm / N;
        for (int k = 0; k < 3; k++) {
            const double off = (&cal.lights[l].position.x)[k] - (&s->lamps[l].x)[k];
            e.sigmas += pow(off / report->sigma[l].position_mm[k], 2) / (3 * N);
        }
    }
    e.sigmas = sqrt(e.sigmas);
    print_message(
        "%s: position off by %.2f mm mean, %.2f max (sigma %.2f mean), direction %.2f deg max, field %.3f %% "
        "max, intensity %.2f %% max, errors/sigmas %.2f, %d rounds\n",
        what, e.position_mean, e.position_max, sigma, e.direction_max_deg, 100 * e.field_max,
        100 * e.intensity_max, e.sigmas, report->n_rounds);
    assert_true(report->settled);
    for (int l = 0; l < N; l++) { /* what is left is the noise */
        assert_near(cal.lights[l].residual, s->noise, 0.1 * s->noise + 2e-4);
        assert_near(weft_length(cal.lights[l].axis), 1, 1e-12);
    }
    weft_calibration_fini(&cal);
    weft_white_sheet_fini(&sheet);
    return e;
}

static void test_exact_sheets(void **state)
{
    (void)state;
    weft_light_fit_report report;
    const scene s = make_scene(1, 0, 0);
    const error e = run(&s, "no noise, lamps aimed at the middle", &weft_light_fit_defaults, &report);
    assert_true(e.position_mean < 0.02 && e.position_max < 0.1);
    assert_true(e.direction_max_deg < 0.01);
    assert_true(e.field_max < 0.0005 && e.intensity_max < 0.0005);
    /* The vignetting of the corner, cos^4 and the lens's, is told from the lamps' own fall-off. */
    const double corner = vignetting_at(&s, s.camera.cx, s.camera.cy) / vignetting_at(&s, 0, 815);
    double log_corner = 0;
    for (int k = 0; k < 3; k++)
        log_corner -= report.vignetting[k];
    assert_near(log_corner, log(corner), 0.01);
}

/* Loose priors, exact data: the truth itself is the answer. */
static void test_exact_recovery_without_priors(void **state)
{
    (void)state;
    weft_light_fit_report report;
    const scene s = make_scene(1, 0, 0);
    weft_light_fit_options options = weft_light_fit_defaults;
    options.exponent_sigma = 5;
    options.settled_mm = 1; /* beyond that the rounds trace the single precision of the sheet */
    const error e = run(&s, "no noise, exponents free", &options, &report);
    assert_true(e.position_mean < 0.02 && e.position_max < 0.1);
}

static void test_noisy_sheets(void **state)
{
    (void)state;
    weft_light_fit_report report;
    const scene s = make_scene(3, 1, 0.002);
    const error e = run(&s, "0.2 % noise a cell, aim within 1 degree", &weft_light_fit_defaults, &report);
    assert_true(e.position_mean < 2 && e.position_max < 7);
    assert_true(e.direction_max_deg < 0.4);
    assert_true(e.field_max < 0.003);
    assert_true(e.intensity_max < 0.05);
    assert_false(report.sheet.bow_used);
    /* Noise, a twentieth of it as of 16 x 16 photosites of a bright sheet: the error is what sigma says. */
    const scene quiet = make_scene(3, 1, 0.0005);
    const error q = run(&quiet, "0.05 % noise a cell", &weft_light_fit_defaults, &report);
    assert_true(q.position_mean < 0.8 && q.sigmas > 0.5 && q.sigmas < 1.3);
}

/* Lamps where nobody would expect them, and a vignetting that is not centred on the lens's axis. */
static void test_lamps_off_the_dome(void **state)
{
    (void)state;
    weft_light_fit_report report;
    uint64_t seed = 99;
    scene s = make_scene(4, 1, 0.002);
    s.off_centre = 60;
    for (int i = 0; i < N; i++) {
        const double elevation = (20 + 65 * weft_test_random(&seed)) * DEGREES;
        const double azimuth = 360 * weft_test_random(&seed) * DEGREES,
                     r = 200 + 300 * weft_test_random(&seed);
        s.lamps[i].x = r * cos(elevation) * cos(azimuth);
        s.lamps[i].y = r * cos(elevation) * sin(azimuth);
        s.lamps[i].z = r * sin(elevation);
    }
    const error e = run(&s, "lamps at 200 to 500 mm anywhere", &weft_light_fit_defaults, &report);
    assert_true(e.position_mean < 5);
    assert_true(e.direction_max_deg < 0.7);
    assert_true(e.field_max < 0.003);
}

static void test_a_rough_guess_leads_to_the_same_lights(void **state)
{
    (void)state;
    weft_light_fit_report report;
    uint64_t seed = 8;
    const scene s = make_scene(2, 1, 0.002);
    weft_light_fit_options options = weft_light_fit_defaults;
    options.n_guess = N;
    for (int i = 0; i < N; i++) /* the 44 mm of S-ORD-18 */
        options.guess[i] = (weft_vec3){s.lamps[i].x + 25 * weft_test_gauss(&seed),
                                       s.lamps[i].y + 25 * weft_test_gauss(&seed),
                                       s.lamps[i].z + 25 * weft_test_gauss(&seed)};
    const error e = run(&s, "from a guess 43 mm off", &options, &report);
    assert_true(e.position_mean < 2);
    assert_true(e.field_max < 0.003);
    weft_white_sheet sheet;
    weft_calibration cal = {0};
    fill_sheet(&s, &sheet, 1);
    options.n_guess = 9;
    assert_fails(weft_light_fit(&s.camera, &sheet, &options, &cal, &report, err), WEFT_ERR_MISMATCH,
                 "the guess has 9 lights, the sheet 10");
    options.n_guess = N;
    options.guess[3].z = -50;
    assert_fails(weft_light_fit(&s.camera, &sheet, &options, &cal, &report, err), WEFT_ERR_RANGE,
                 "light 3: the guess");
    weft_white_sheet_fini(&sheet);
}

static void test_sheets_out_of_shape(void **state)
{
    (void)state;
    weft_light_fit_report report;
    weft_white_sheet sheet;
    weft_calibration cal = {0};
    scene s = make_scene(5, 1, 0.0005);
    s.bow_mm = 0.5;
    const error e = run(&s, "bowed by 0.5 mm", &weft_light_fit_defaults, &report);
    assert_true(report.sheet.bow_used && e.position_mean < 2.5);
    assert_near(report.sheet.bow_mm[0], 0.5, 4 * report.sheet.bow_sigma_mm[0]);
    assert_near(report.sheet.bow_mm[1], 0, 4 * report.sheet.bow_sigma_mm[1]);
    assert_true(report.sheet.bow_sigma_mm[0] < 0.1);
    assert_true(e.field_max < 0.01); /* of a flat plate: the bow did not go into the gains */
    s.bow_mm = -3;
    fill_sheet(&s, &sheet, 1);
    assert_fails(weft_light_fit(&s.camera, &sheet, &weft_light_fit_defaults, &cal, &report, err),
                 WEFT_ERR_RANGE, "the sheet is not flat: its middle stands 3.");
    weft_white_sheet_fini(&sheet);
    s.bow_mm = 0;
    s.tilt_deg = 3;
    fill_sheet(&s, &sheet, 1);
    assert_fails(weft_light_fit(&s.camera, &sheet, &weft_light_fit_defaults, &cal, &report, err),
                 WEFT_ERR_RANGE, "it rises towards the right");
    weft_white_sheet_fini(&sheet);
    assert_false(cal.has_lights);
}

static void test_expected_positions(void **state)
{
    (void)state;
    weft_light_fit_report report;
    weft_white_sheet sheet;
    weft_calibration cal = {0};
    uint64_t seed = 5;
    const scene s = make_scene(6, 1, 0.002);
    weft_light_fit_options options = weft_light_fit_defaults;
    options.n_guess = N;
    for (int i = 0; i < N; i++)
        options.guess[i] = (weft_vec3){s.lamps[i].x + 0.3 * weft_test_gauss(&seed),
                                       s.lamps[i].y + 0.3 * weft_test_gauss(&seed),
                                       s.lamps[i].z + 0.3 * weft_test_gauss(&seed)};
    options.guess_sigma_mm = 0.3;
    const error e = run(&s, "positions measured to 0.3 mm", &options, &report);
    assert_true(e.position_mean < 0.5 && e.sigmas < 1.5);
    const weft_vec3 third = options.guess[2];
    options.guess_sigma_mm = 0;
    options.guess[2] = options.guess[7];
    options.guess[7] = third;
    fill_sheet(&s, &sheet, 1);
    assert_fails(weft_light_fit(&s.camera, &sheet, &options, &cal, &report, err), WEFT_ERR_MISMATCH,
                 "light 2 is where light 7 was expected, and the other way round");
    weft_white_sheet_fini(&sheet);
}

static void test_dust_is_left_out(void **state)
{
    (void)state;
    const scene s = make_scene(2, 1, 0.002);
    weft_white_sheet sheet;
    weft_calibration cal = {.has_camera = true, .camera = s.camera};
    weft_light_fit_report report;
    fill_sheet(&s, &sheet, 77);
    for (int k = 0; k < 20; k++) /* specks of 30 %, at the same places under every light */
        for (int plane = 0; plane < 3 * N; plane++)
            sheet.value[plane * sheet.columns * sheet.rows + (k * 331 + 50) % (sheet.columns * sheet.rows)] *=
                0.7F;
    assert_ok(weft_light_fit(&s.camera, &sheet, &weft_light_fit_defaults, &cal, &report, err));
    const error e = compare(&s, &cal);
    assert_true(e.position_mean < 2);
    assert_true(e.field_max < 0.003);
    assert_near(report.left_out[4], 20.0 / (sheet.columns * sheet.rows), 1e-9);
    weft_calibration_fini(&cal);
    weft_white_sheet_fini(&sheet);
}

static void test_sheets_that_are_none_are_refused(void **state)
{
    (void)state;
    scene s = make_scene(2, 1, 0.002);
    weft_white_sheet sheet;
    weft_calibration cal = {.n_lights = 5};
    weft_light_fit_report report;
    fill_sheet(&s, &sheet, 3);
    const int cells = sheet.columns * sheet.rows;
    for (int plane = 0; plane < 3 * N; plane++)
        for (int i = 0; i < cells; i++)
            if (i % sheet.columns > 0.85 * sheet.columns)
                sheet.value[plane * cells + i] *= 0.05F; /* the table beside it */
    assert_fails(weft_light_fit(&s.camera, &sheet, &weft_light_fit_defaults, &cal, &report, err),
                 WEFT_ERR_NODATA, "does the sheet fill the frame");
    weft_white_sheet_fini(&sheet);
    fill_sheet(&s, &sheet, 3);
    for (int i = 0; i < 3 * cells; i++)
        sheet.value[6 * 3 * cells + i] = 1e-5F;
    assert_fails(weft_light_fit(&s.camera, &sheet, &weft_light_fit_defaults, &cal, &report, err),
                 WEFT_ERR_NODATA, "light 6: the sheet is dark");
    for (int i = 0; i < 3 * cells / 5; i++)
        sheet.value[2 * 3 * cells + cells + i] = NAN;
    assert_fails(weft_light_fit(&s.camera, &sheet, &weft_light_fit_defaults, &cal, &report, err),
                 WEFT_ERR_NODATA, "light 2: 60 % of the sheet's cells are missing");
    s.camera.has_pose = false;
    assert_fails(weft_light_fit(&s.camera, &sheet, &weft_light_fit_defaults, &cal, &report, err),
                 WEFT_ERR_MISSING, "weft calibrate lens --board-on-table");
    s.camera.has_pose = true;
    s.camera.width = 616;
    assert_fails(weft_light_fit(&s.camera, &sheet, &weft_light_fit_defaults, &cal, &report, err),
                 WEFT_ERR_MISMATCH, "1232x816");
    assert_int_equal(cal.n_lights, 5);
    weft_white_sheet_fini(&sheet);
}

static void test_cells_of_a_plate(void **state)
{
    (void)state;
    weft_white_sheet sheet;
    weft_image mosaic;
    weft_mask clipped;
    assert_ok(weft_white_sheet_init(&sheet, 1232, 816, 2, err));
    assert_int_equal(sheet.cell_px, 16);
    assert_int_equal(sheet.columns, 77);
    assert_int_equal(sheet.rows, 51);
    assert_ok(weft_image_init(&mosaic, 1232, 816, 1, err));
    assert_ok(weft_mask_init(&clipped, 1232, 816, 0, err));
    for (int v = 0; v < 816; v++)
        for (int u = 0; u < 1232; u++) /* red 1, green 2, blue 3, rising by 0.001 per column */
            weft_image_row(&mosaic, 0, v)[u] =
                (float)(1 + weft_cfa_colour(WEFT_CFA_RGGB, u, v)) + 0.001F * (float)(u / 2);
    clipped.data[40 * 1232 + 35] = 1; /* a hot pixel in cell (2, 2) */
    assert_ok(weft_white_sheet_add(&sheet, 1, &mosaic, WEFT_CFA_RGGB, &clipped, err));
    assert_true(isnan(weft_white_sheet_plane(&sheet, 0, 1)[5]));
    assert_true(isnan(weft_white_sheet_plane(&sheet, 1, 0)[2 * 77 + 2]));
    assert_near((double)weft_white_sheet_plane(&sheet, 1, 0)[3 * 77 + 10], 1 + 0.001 * 83.5, 1e-6);
    assert_near((double)weft_white_sheet_plane(&sheet, 1, 1)[3 * 77 + 10], 2 + 0.001 * 83.5, 1e-6);
    assert_near((double)weft_white_sheet_plane(&sheet, 1, 2)[3 * 77 + 10], 3 + 0.001 * 83.5, 1e-6);
    assert_near(weft_white_sheet_centre(&sheet, 10), 167.5, 0);
    mosaic.data[400 * 1232 + 600] = NAN;
    assert_fails(weft_white_sheet_add(&sheet, 0, &mosaic, WEFT_CFA_RGGB, &clipped, err), WEFT_ERR_RANGE,
                 "light 0: its frame has no number near pixel (592, 400)");
    for (int i = 0; i < 40; i++)
        memset(clipped.data + (size_t)(i + 200) * 1232 + 300, 1, 50);
    assert_fails(weft_white_sheet_add(&sheet, 0, &mosaic, WEFT_CFA_RGGB, &clipped, err), WEFT_ERR_RANGE,
                 "light 0: 0.2 % of the white sheet is saturated");
    weft_white_sheet_fini(&sheet);
    assert_ok(weft_white_sheet_init(&sheet, 1000, 816, 2, err));
    assert_fails(weft_white_sheet_add(&sheet, 0, &mosaic, WEFT_CFA_RGGB, &clipped, err), WEFT_ERR_MISMATCH,
                 "1232x816");
    assert_fails(weft_white_sheet_init(&sheet, 10, 816, 2, err), WEFT_ERR_RANGE, "too small");
    weft_white_sheet_fini(&sheet);
    weft_image_fini(&mosaic);
    weft_mask_fini(&clipped);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_exact_sheets),
        cmocka_unit_test(test_exact_recovery_without_priors),
        cmocka_unit_test(test_noisy_sheets),
        cmocka_unit_test(test_lamps_off_the_dome),
        cmocka_unit_test(test_a_rough_guess_leads_to_the_same_lights),
        cmocka_unit_test(test_sheets_out_of_shape),
        cmocka_unit_test(test_expected_positions),
        cmocka_unit_test(test_dust_is_left_out),
        cmocka_unit_test(test_sheets_that_are_none_are_refused),
        cmocka_unit_test(test_cells_of_a_plate),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
