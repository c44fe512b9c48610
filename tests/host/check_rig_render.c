/* The renderer and the sensor against closed formulas, brute force and statistics. */
#include "calibration/lens/lens_model.h"
#include "core/mem.h"
#include "host/rig/render.h"
#include "host/rig/sensor.h"
#include "tests/support/support.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define WIDTH  308
#define HEIGHT 204

static weft_rig_scene scene;
static weft_rig_view view;

static void make_scene(int supersample)
{
    weft_rig_setup setup;
    weft_rig_setup_init(&setup);
    setup.size = (weft_size){WIDTH, HEIGHT};
    setup.supersample = supersample;
    weft_rig_view_fini(&view);
    assert_ok(weft_rig_scene_init(&scene, &setup, err));
    assert_ok(weft_rig_view_sensor(&view, &scene, err));
}

static int set_up(void **state)
{
    (void)state;
    make_scene(3);
    return 0;
}

static int tear_down(void **state)
{
    (void)state;
    weft_rig_view_fini(&view);
    return 0;
}

/* I = albedo * intensity * cos^m(off axis) (n.l) / r^2 * vignetting, in plain steps (docs/formats.md). */
static double lambert(int lamp, int u, int v, weft_vec3 point, weft_vec3 normal, double albedo)
{
    const weft_light *const light = &scene.lights[lamp];
    const double dx = light->position.x - point.x, dy = light->position.y - point.y,
                 dz = light->position.z - point.z;
    const double r = sqrt(dx * dx + dy * dy + dz * dz);
    const double off_axis = -(light->axis.x * dx + light->axis.y * dy + light->axis.z * dz) / r;
    const double facing = (normal.x * dx + normal.y * dy + normal.z * dz) / r;
    const int colour = v % 2 == 0 ? (u % 2 == 0 ? 0 : 1) : (u % 2 == 0 ? 1 : 2); /* RGGB */
    const double tx = (u - scene.camera.cx) / scene.camera.fx, ty = (v - scene.camera.cy) / scene.camera.fy;
    const double cos_field = 1 / sqrt(1 + tx * tx + ty * ty);
    const double q =
        ((u - scene.camera.cx) * (u - scene.camera.cx) + (v - scene.camera.cy) * (v - scene.camera.cy)) /
        ((WIDTH * WIDTH + HEIGHT * HEIGHT) / 4.0);
    const double vignetting = pow(cos_field, 4) * (1 + scene.vignetting[0] * q + scene.vignetting[1] * q * q);
    return albedo * light->intensity[colour] * pow(fmax(off_axis, 0), light->exponent) * fmax(facing, 0) /
           (r / 1000 * r / 1000) * vignetting;
}

static void sheet_follows_the_formula(void **state)
{
    (void)state;
    static weft_rig_sample sample;
    weft_rig_frames frames;
    assert_ok(weft_rig_sample_init(&sample, &scene, "white", err));
    assert_ok(weft_rig_frames_init(&frames, &scene, &view, &sample, err));
    double brightest = 0, worst = 0;
    for (int lamp = 0; lamp < WEFT_RIG_N_LIGHTS; lamp++)
        for (int v = 0; v < HEIGHT; v++)
            for (int u = 0; u < WIDTH; u++) {
                weft_vec3 point;
                assert_true(weft_camera_to_plane(&scene.camera, u, v, 0, &point));
                const double want = lambert(lamp, u, v, point, (weft_vec3){0, 0, 1}, 0.99);
                const double got = (double)frames.light[lamp][v * WIDTH + u];
                worst = fmax(worst, fabs(got / want - 1));
                brightest = fmax(brightest, got);
            }
    print_message("sheet: worst relative difference %.1e, brightest %.4f of the range at 0.04 s\n", worst,
                  brightest * 0.04);
    assert_true(worst < 2e-5);
    assert_near(brightest * 0.04, 0.75, 0.01);
    weft_rig_frames_fini(&frames);
    weft_rig_sample_fini(&sample);
}

/* Squares of a tenth of a pixel: every photosite must see their mean, not one of them. */
static void footprint_is_averaged(void **state)
{
    (void)state;
    make_scene(9);
    static weft_rig_sample sample;
    weft_rig_frames frames;
    assert_ok(weft_rig_sample_init(&sample, &scene, "board-table", err));
    sample.materials[1] = weft_spectrum_flat(0);
    sample.materials[2] = weft_spectrum_flat(1);
    sample.plate.square_mm = 0.061; /* a photosite is 0.5 mm */
    sample.plate.columns = 2 * (int)(50 / 0.061);
    sample.plate.rows = 2 * (int)(30 / 0.061);
    assert_ok(weft_rig_frames_init(&frames, &scene, &view, &sample, err));
    double sum = 0, sum2 = 0;
    int n = 0;
    for (int v = 60; v < 140; v++)
        for (int u = 80; u < 220; u++, n++) {
            weft_vec3 point;
            assert_true(weft_camera_to_plane(&scene.camera, u, v, 0, &point));
            const double share =
                (double)frames.light[9][v * WIDTH + u] / lambert(9, u, v, point, (weft_vec3){0, 0, 1}, 1);
            sum += share;
            sum2 += share * share;
        }
    const double mean = sum / n, deviation = sqrt(sum2 / n - mean * mean);
    print_message("sub-pixel checker: mean %.4f, deviation %.4f\n", mean, deviation);
    assert_near(mean, 0.5, 0.005);
    assert_true(deviation < 0.12); /* one sample a photosite would give 0.5 */
    weft_rig_frames_fini(&frames);
    weft_rig_sample_fini(&sample);
    make_scene(3);
}

/* ------------------------------------------------------------------------------------------ known relief */

/* h = A sin(2 pi x / P): whole periods in the tile. */
#define WAVE_MM     0.42
#define WAVE_PERIOD 3.84
#define WAVE_K      (6.283185307179586 / WAVE_PERIOD)

static double wave_height(double x)
{
    return WAVE_MM * sin(WAVE_K * x);
}

static weft_vec3 wave_normal(double x)
{
    return weft_normalise((weft_vec3){-WAVE_MM * WAVE_K * cos(WAVE_K * x), 0, 1});
}

static void make_wave(weft_rig_sample *sample)
{
    assert_ok(weft_rig_sample_init(sample, &scene, "plain-weave", err));
    sample->materials[0] = weft_spectrum_flat(0.6);
    weft_fabric *const cloth = &sample->cloth;
    static weft_weave matte;
    matte = *cloth->weave;
    matte.gloss = (weft_fabric_gloss){0};
    cloth->weave = &matte;
    cloth->turn_cos = 1;
    cloth->turn_sin = 0;
    memset(cloth->wave, 0, sizeof cloth->wave);
    memset(cloth->wave_k, 0, sizeof cloth->wave_k);
    cloth->highest_mm = (float)WAVE_MM;
    cloth->lowest_mm = (float)-WAVE_MM;
    cloth->steepest = (float)(WAVE_MM * WAVE_K);
    for (int row = 0; row < WEFT_CLOTH_TEXELS; row++)
        for (int column = 0; column < WEFT_CLOTH_TEXELS; column++) {
            const double x = column * WEFT_CLOTH_PERIOD_MM / WEFT_CLOTH_TEXELS;
            const size_t i = (size_t)row * WEFT_CLOTH_TEXELS + (size_t)column;
            cloth->height[i] = (float)wave_height(x);
            cloth->texels[i] = (weft_fabric_texel){.height = (float)wave_height(x),
                                                   .slope_x = (float)(WAVE_MM * WAVE_K * cos(WAVE_K * x)),
                                                   .strength = 255 / 2,
                                                   .openness = 255};
        }
}

/* 0.75 + 127 / 510, and the slow change of strength is off with the waves. */
#define WAVE_ALBEDO (0.6 * (0.75 + 127 / 510.0))

/* Where the ray through table point (x, y) meets the wave: bisection from above, no fixed point. */
static weft_vec3 meet_wave(double x, double y)
{
    const weft_vec3 c = view.centre;
    double low = -WAVE_MM, high = WAVE_MM;
    for (int i = 0; i < 60; i++) {
        const double z = (low + high) / 2, at = x + (c.x - x) * z / c.z;
        if (z > wave_height(at))
            high = z;
        else
            low = z;
    }
    return (weft_vec3){x + (c.x - x) * low / c.z, y + (c.y - y) * low / c.z, low};
}

static bool wave_sees(weft_vec3 point, weft_vec3 lamp)
{
    const weft_vec3 d = weft_sub(lamp, point);
    for (double t = 2e-5; point.z + t * d.z < WAVE_MM; t += 1e-5)
        if (point.z + t * d.z < wave_height(point.x + t * d.x) - 1e-7)
            return false;
    return true;
}

/* Pixel by pixel against an independent tracer in double precision: relief, footprint and cast shadows. */
static void relief_is_shaded_and_shadowed(void **state)
{
    (void)state;
    static weft_rig_sample sample;
    weft_rig_frames frames;
    make_wave(&sample);
    assert_ok(weft_rig_frames_init(&frames, &scene, &view, &sample, err));
    int shadowed = 0, wrong = 0, n = 0;
    double sum = 0;
    uint64_t seed = 1;
    for (int i = 0; i < 400; i++) {
        const int u = 1 + (int)((WIDTH - 2) * weft_test_random(&seed)),
                  v = 1 + (int)((HEIGHT - 2) * weft_test_random(&seed));
        const int lamp = (int)(WEFT_RIG_N_LIGHTS * weft_test_random(&seed));
        double want = 0;
        for (int k = 0; k < 9; k++) {
            weft_vec3 ground;
            assert_true(weft_camera_to_plane(&scene.camera, u + (k % 3 - 1) / 3.0, v + (k / 3 - 1) / 3.0, 0,
                                             &ground));
            const weft_vec3 point = meet_wave(ground.x, ground.y);
            const bool seen = wave_sees(point, scene.lights[lamp].position);
            shadowed += !seen;
            want += seen ? lambert(lamp, u, v, point, wave_normal(point.x), WAVE_ALBEDO) / 9 : 0;
        }
        const double got = (double)frames.light[lamp][v * WIDTH + u];
        wrong += fabs(got - want) > 0.01 * fmax(want, 0.5);
        sum += got - want;
        n++;
    }
    print_message("relief: %d of %d pixels differ by more than 1 %%, %d of %d rays in shadow\n", wrong, n,
                  shadowed, 9 * n);
    assert_true(shadowed > 40);   /* the test has shadows to speak of */
    assert_true(wrong <= n / 50); /* only where a shadow's edge crosses a sample */
    assert_near(sum / n, 0, 0.005);
    weft_rig_frames_fini(&frames);
    weft_rig_sample_fini(&sample);
}

static void truth_is_the_mean_over_the_footprint(void **state)
{
    (void)state;
    static weft_rig_sample sample;
    weft_rig_view plane;
    weft_rig_truth truth;
    make_wave(&sample);
    assert_ok(weft_rig_view_plane(&plane, &scene, 0.5, err));
    assert_ok(weft_rig_truth_maps(&scene, &plane, &sample, &truth, err));
    const int width = plane.ground.width, height = plane.ground.height;
    double worst = 0;
    for (int v = 0; v < height; v += 7)
        for (int u = 0; u < width; u++) {
            weft_vec3 sum = {0, 0, 0};
            for (int k = 0; k < 9; k++) {
                const double x = (u - (width - 1) / 2.0 + (k % 3 - 1) / 3.0) * 0.5;
                const double y = ((height - 1) / 2.0 - v - (k / 3 - 1) / 3.0) * 0.5;
                sum = weft_add(sum, wave_normal(meet_wave(x, y).x));
            }
            const weft_vec3 got = {(double)weft_image_row(&truth.normal, 0, v)[u],
                                   (double)weft_image_row(&truth.normal, 1, v)[u],
                                   (double)weft_image_row(&truth.normal, 2, v)[u]};
            worst = fmax(worst, weft_angle_between(got, sum));
            assert_near((double)weft_image_row(&truth.albedo, 1, v)[u], WAVE_ALBEDO, 1e-4);
        }
    print_message("truth of a wave: worst normal %.4f deg\n", worst * 57.29578);
    assert_true(worst * 57.29578 < 0.02);
    weft_rig_truth_fini(&truth);
    weft_rig_view_fini(&plane);
    weft_rig_sample_fini(&sample);
}

/* A leaning board has one normal and its tones; what lies beside it is the table. */
static void truth_of_a_board(void **state)
{
    (void)state;
    static weft_rig_sample sample;
    weft_rig_truth truth;
    assert_ok(weft_rig_sample_init(&sample, &scene, "board-9", err));
    assert_ok(weft_rig_truth_maps(&scene, &view, &sample, &truth, err));
    double u, v;
    assert_true(weft_camera_project(&scene.camera, weft_rig_plate_point(&sample.plate, 5, 0), &u, &v));
    const int row = (int)lround(v), column = (int)lround(u);
    const weft_vec3 got = {(double)weft_image_row(&truth.normal, 0, row)[column],
                           (double)weft_image_row(&truth.normal, 1, row)[column],
                           (double)weft_image_row(&truth.normal, 2, row)[column]};
    assert_near(weft_angle_between(got, sample.plate.normal), 0, 1e-6);
    double rgb[3];
    weft_spectra_srgb(&scene.spectra, &sample.materials[weft_rig_plate_material(&sample.plate, 5, 0)], rgb);
    assert_near((double)weft_image_row(&truth.albedo, 0, row)[column], rgb[0], 1e-6);
    weft_rig_truth_fini(&truth);
    weft_rig_sample_fini(&sample);
}

/* A board in the light throws a shadow where the straight line to the lamp passes through it. */
static void boards_cast_shadows(void **state)
{
    (void)state;
    static weft_rig_sample sample;
    weft_rig_frames frames;
    assert_ok(weft_rig_sample_init(&sample, &scene, "board-10", err));
    assert_ok(weft_rig_frames_init(&frames, &scene, &view, &sample, err));
    const weft_rig_plate *const plate = &sample.plate;
    int dark = 0, lit = 0, wrong = 0;
    for (int lamp = 0; lamp < 6; lamp++)
        for (int v = 2; v < HEIGHT; v += 5)
            for (int u = 2; u < WIDTH; u += 5) {
                weft_vec3 p;
                assert_true(weft_camera_to_plane(&scene.camera, u, v, 0, &p));
                const weft_vec3 ends[2] = {view.centre, scene.lights[lamp].position};
                double inside[2]; /* how deep the lines to camera and lamp pass the plate, mm */
                for (int i = 0; i < 2; i++) {
                    const weft_vec3 d = weft_sub(ends[i], p);
                    const double t =
                        weft_dot(plate->normal, weft_sub(plate->centre, p)) / weft_dot(plate->normal, d);
                    const weft_vec3 at = weft_sub(weft_add(p, weft_scale(d, t)), plate->centre);
                    inside[i] = fmin(plate->half_width - fabs(weft_dot(at, plate->ax)),
                                     plate->half_height - fabs(weft_dot(at, plate->ay)));
                    if (t < 0)
                        inside[i] = -1;
                }
                if (inside[0] > -2 || fabs(inside[1]) < 2)
                    continue; /* the camera sees the board, or the edge is near */
                const bool shadow = frames.light[lamp][v * WIDTH + u] == 0;
                wrong += shadow != (inside[1] > 0);
                dark += shadow;
                lit += !shadow;
            }
    assert_true(dark > 50 && lit > 50);
    assert_int_equal(wrong, 0);
    weft_rig_frames_fini(&frames);
    weft_rig_sample_fini(&sample);
}

/* ------------------------------------------------------------------------------------------ sensor */

static void expose(const weft_rig_frames *frames, const double *on, double exposure_s, double gain,
                   uint64_t sequence, uint16_t *dn)
{
    weft_rig_expose(&scene, frames, on, exposure_s, gain, sequence, dn);
}

/* Light adds up: lamp 2 and lamp 7 together are the sum of each, room light counted once. */
static void lamps_add_up(void **state)
{
    (void)state;
    static weft_rig_sample sample;
    static uint16_t dn[4][WIDTH * HEIGHT];
    weft_rig_frames frames;
    assert_ok(weft_rig_sample_init(&sample, &scene, "satin", err));
    assert_ok(weft_rig_frames_init(&frames, &scene, &view, &sample, err));
    scene.setup.noise = false;
    static const double on[4][WEFT_RIG_N_LIGHTS] = {{0}, {[2] = 1}, {[7] = 0.5}, {[2] = 1, [7] = 0.5}};
    for (int i = 0; i < 4; i++)
        expose(&frames, on[i], 0.02, 1, 0, dn[i]);
    for (int i = 0; i < WIDTH * HEIGHT; i++)
        assert_true(abs(dn[1][i] + dn[2][i] - dn[0][i] - dn[3][i]) <= 2);
    /* Twice the exposure is twice the light over black; gain multiplies like exposure. */
    expose(&frames, on[1], 0.04, 1, 0, dn[2]);
    expose(&frames, on[1], 0.02, 2, 0, dn[3]);
    for (int i = 0; i < WIDTH * HEIGHT; i++) {
        assert_true(dn[2][i] == 15871 || abs(2 * (dn[1][i] - 256) - (dn[2][i] - 256)) <= 2);
        assert_true(abs(dn[2][i] - dn[3][i]) <= 1);
    }
    scene.setup.noise = true;
    weft_rig_frames_fini(&frames);
    weft_rig_sample_fini(&sample);
}

/* Variance against mean of the difference of two frames: the slope is DN per electron, the offset the read
   noise and the rounding (photon transfer; the fixed pattern cancels). */
static void noise_is_photons_and_reading(void **state)
{
    (void)state;
    static weft_rig_sample sample;
    static uint16_t a[WIDTH * HEIGHT], b[WIDTH * HEIGHT];
    weft_rig_frames frames;
    static const double on[WEFT_RIG_N_LIGHTS] = {[0] = 1};
    assert_ok(weft_rig_sample_init(&sample, &scene, "white", err));
    assert_ok(weft_rig_frames_init(&frames, &scene, &view, &sample, err));
    for (int g = 1; g <= 4; g *= 2) {
        const double per_electron = g * (15871 - 256) / 30000.0;
        double sw = 0, sx = 0, sy = 0, sxx = 0, sxy = 0;
        for (int step = 0; step < 12; step++) {
            const double exposure_s = 0.036 / g * step / 11;
            expose(&frames, on, exposure_s, g, (uint64_t)(100 + 2 * step), a);
            expose(&frames, on, exposure_s, g, (uint64_t)(101 + 2 * step), b);
            double mean = 0, variance = 0;
            for (int i = 0; i < WIDTH * HEIGHT; i++) {
                const double d = (double)a[i] - b[i];
                mean += (a[i] + b[i]) / 2.0 - 256;
                variance += d * d / 2;
            }
            mean /= WIDTH * HEIGHT;
            variance /= WIDTH * HEIGHT;
            const double w = 1 / (variance * variance); /* a variance is known to a share of itself */
            sw += w, sx += w * mean, sy += w * variance, sxx += w * mean * mean, sxy += w * mean * variance;
        }
        const double slope = (sw * sxy - sx * sy) / (sw * sxx - sx * sx), offset = (sy - slope * sx) / sw;
        const double read = 9 * per_electron * per_electron + 1 / 12.0;
        print_message("gain %d: %.4f DN/e (made %.4f), read noise %.2f DN^2 (made %.2f)\n", g, slope,
                      per_electron, offset, read);
        assert_near(slope / per_electron, 1, 0.01);
        assert_near(offset / read, 1, 0.04);
    }
    weft_rig_frames_fini(&frames);
    weft_rig_sample_fini(&sample);
}

/* The mean of many frames keeps the fixed pattern: 0.3 %, the same in every frame. */
static void fixed_pattern_stays(void **state)
{
    (void)state;
    enum { FRAMES = 40 };
    static weft_rig_sample sample;
    static uint16_t dn[WIDTH * HEIGHT];
    static double sum[2][WIDTH * HEIGHT];
    weft_rig_frames frames;
    static const double on[WEFT_RIG_N_LIGHTS] = {[9] = 1};
    assert_ok(weft_rig_sample_init(&sample, &scene, "white", err));
    assert_ok(weft_rig_frames_init(&frames, &scene, &view, &sample, err));
    memset(sum, 0, sizeof sum);
    for (int k = 0; k < 2 * FRAMES; k++) {
        expose(&frames, on, 0.04, 1, (uint64_t)k, dn);
        for (int i = 0; i < WIDTH * HEIGHT; i++)
            sum[k % 2][i] += ((double)dn[i] - 256) / FRAMES;
    }
    /* Covariance of the two halves' relative deviations: noise is independent, the pattern is common. */
    double covariance = 0;
    for (int i = 0; i < WIDTH * HEIGHT; i++) {
        const double want = (double)frames.light[9][i] * 0.04 * 15615 + (double)frames.room[i] * 0.04 * 15615;
        covariance += (sum[0][i] / want - 1) * (sum[1][i] / want - 1) / (WIDTH * HEIGHT);
    }
    print_message("fixed pattern: %.3f %%\n", 100 * sqrt(covariance));
    assert_near(sqrt(covariance), 0.003, 0.0001);
    weft_rig_frames_fini(&frames);
    weft_rig_sample_fini(&sample);
}

static void too_much_light_is_cut(void **state)
{
    (void)state;
    static weft_rig_sample sample;
    static uint16_t dn[WIDTH * HEIGHT];
    weft_rig_frames frames;
    static const double on[WEFT_RIG_N_LIGHTS] = {1, 1, 1, 1, 1, 1, 1, 1, 1, 1};
    assert_ok(weft_rig_sample_init(&sample, &scene, "white", err));
    assert_ok(weft_rig_frames_init(&frames, &scene, &view, &sample, err));
    expose(&frames, on, 0.04, 1, 0, dn);
    for (int i = 0; i < WIDTH * HEIGHT; i++)
        assert_int_equal(dn[i], 15871);
    weft_rig_frames_fini(&frames);
    weft_rig_sample_fini(&sample);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(sheet_follows_the_formula),
        cmocka_unit_test(footprint_is_averaged),
        cmocka_unit_test(relief_is_shaded_and_shadowed),
        cmocka_unit_test(truth_is_the_mean_over_the_footprint),
        cmocka_unit_test(truth_of_a_board),
        cmocka_unit_test(boards_cast_shadows),
        cmocka_unit_test(lamps_add_up),
        cmocka_unit_test(noise_is_photons_and_reading),
        cmocka_unit_test(fixed_pattern_stays),
        cmocka_unit_test(too_much_light_is_cut),
    };
    return cmocka_run_group_tests(tests, set_up, tear_down);
}
