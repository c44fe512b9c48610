/* Grey scales and exposure series: slopes, white balance, bends, and a real camera. */
#include "tests/support/support.h"

#include "calibration/charts/linearity.h"
#include "calibration/charts/white_balance.h"
#include "core/formats/tiff_file.h"

#include <dirent.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

enum { PATCHES = 12 };

static const weft_chart *munsell(void)
{
    const weft_chart *chart = NULL;
    assert_ok(weft_chart_find("munsell", "", &chart, err));
    return chart;
}

/* Readings of a sensor with known slopes under a known light; `bend` is what the sensor makes of a share of
 * its range. */
typedef struct sensor {
    double slope[WEFT_SITES]; /* reading per reflectance in the middle of the chart */
    double gx, gy;            /* log units per mm */
    double full_scale, noise;
    double (*bend)(double share);
    uint64_t seed;
} sensor;

static void read_greys(const weft_chart *chart, sensor *s, weft_patch_reading *readings)
{
    for (int p = 0; p < chart->columns * chart->rows; p++) {
        double x, y;
        weft_chart_patch_centre(chart, p, &x, &y);
        memset(&readings[p], 0, sizeof readings[p]);
        for (int k = 0; k < WEFT_SITES; k++) {
            const double light = exp(s->gx * x + s->gy * y);
            double share = s->slope[k] * weft_munsell_reflectance(chart->patches[p].munsell_value) * light *
                           s->full_scale;
            if (s->bend)
                share = s->bend(share);
            share += s->noise * weft_test_gauss(&s->seed);
            readings[p].clipped = fmax(readings[p].clipped, share >= 1);
            readings[p].mean[k] = share / s->full_scale;
            readings[p].n[k] = 400;
        }
    }
}

static sensor plain_sensor(void)
{
    return (sensor){{8.0, 17.0, 16.8, 12.0}, 0, 0, 0.04, 0, NULL, 11};
}

static void test_slopes_and_white_balance_come_back(void **state)
{
    (void)state;
    const weft_chart *const chart = munsell();
    weft_patch_reading readings[PATCHES];
    sensor s = plain_sensor();
    s.gx = 0.004;
    s.gy = -0.006;
    s.noise = 2e-5;
    read_greys(chart, &s, readings);
    const weft_grey_light light = {readings, NULL, s.full_scale};
    weft_grey_fit fit;
    assert_ok(weft_grey_fit_light(chart, &light, &fit, err));
    for (int k = 0; k < WEFT_SITES; k++)
        assert_near(fit.slope[k], s.slope[k], 1e-3 * s.slope[k]);
    assert_near(fit.gradient[0], 0.004, 2e-5);
    assert_near(fit.gradient[1], -0.006, 5e-5);
    assert_true(fit.max_deviation < 5e-3);
    const weft_white_balance w = weft_white_balance_from(&fit);
    assert_near(w.gain[0], 16.9 / 8.0, 2e-3);
    assert_true(w.gain[1] == 1);
    assert_near(w.gain[2], 16.9 / 12.0, 2e-3);
    assert_near(w.site_gain[WEFT_SITE_G1], 16.9 / 17.0, 1e-3); /* the greens are kept apart */
    assert_near(w.site_gain[WEFT_SITE_G2], 16.9 / 16.8, 1e-3);
}

static void test_given_irradiance_is_divided_out(void **state)
{
    (void)state;
    const weft_chart *const chart = munsell();
    weft_patch_reading readings[PATCHES];
    double irradiance[PATCHES][3];
    sensor s = plain_sensor();
    read_greys(chart, &s, readings);
    for (int p = 0; p < PATCHES; p++)
        for (int c = 0; c < 3; c++) {
            irradiance[p][c] = 5 + sin(p * 1.7 + c); /* nothing smooth: only division can undo it */
            for (int k = 0; k < WEFT_SITES; k++)
                if (weft_site_colour[k] == c)
                    readings[p].mean[k] *= irradiance[p][c] / 7;
        }
    const weft_grey_light light = {readings, (const double(*)[3])irradiance, s.full_scale};
    weft_grey_fit fit;
    assert_ok(weft_grey_fit_light(chart, &light, &fit, err));
    for (int k = 0; k < WEFT_SITES; k++)
        assert_near(fit.slope[k], s.slope[k] / 7, 1e-9);
    assert_true(fit.max_deviation < 1e-9);
    assert_true(fit.gradient[0] == 0 && fit.gradient[1] == 0);
}

static void test_a_linear_sensor_passes_with_its_range(void **state)
{
    (void)state;
    const weft_chart *const chart = munsell();
    weft_patch_reading readings[2][PATCHES];
    weft_grey_fit fits[2];
    double scales[2];
    const weft_patch_reading *all[2] = {readings[0], readings[1]};
    for (int l = 0; l < 2; l++) {
        sensor s = plain_sensor();
        s.gx = l ? 0.003 : -0.003;
        s.noise = 1e-4;
        s.full_scale = l ? 0.05 : 0.03;
        s.seed = (uint64_t)l;
        scales[l] = s.full_scale;
        read_greys(chart, &s, readings[l]);
        const weft_grey_light light = {readings[l], NULL, s.full_scale};
        assert_ok(weft_grey_fit_light(chart, &light, &fits[l], err));
    }
    weft_linearity linearity;
    assert_ok(weft_linearity_from_greys(chart, fits, all, scales, 2, &linearity, err));
    assert_true(linearity.max_deviation < 0.02);
    assert_true(linearity.range[0] >= WEFT_GREY_RANGE_MIN && linearity.range[0] < 0.02);
    assert_true(linearity.range[1] > 0.6 && linearity.range[1] <= WEFT_GREY_RANGE_MAX);
}

static double gamma_bend(double share)
{
    return pow(share, 0.85);
}

static double strong_gamma_bend(double share)
{
    return pow(share, 0.7);
}

static double offset_bend(double share)
{
    return share + 0.006; /* a black level of 100 DN too little, at 14 bit */
}

static double shoulder_bend(double share)
{
    return share < 0.82 ? share : 0.82 + 0.5 * (share - 0.82); /* saturation begins softly */
}

static weft_err judge(const weft_chart *chart, sensor *s, bool with_light, weft_linearity *linearity,
                      weft_error *err)
{
    weft_patch_reading readings[PATCHES];
    double irradiance[PATCHES][3];
    weft_grey_fit fit;
    for (int p = 0; p < PATCHES; p++)
        irradiance[p][0] = irradiance[p][1] = irradiance[p][2] = 1;
    read_greys(chart, s, readings);
    const weft_patch_reading *const all = readings;
    const weft_grey_light light = {readings, with_light ? (const double(*)[3])irradiance : NULL,
                                   s->full_scale};
    WEFT_TRY(weft_grey_fit_light(chart, &light, &fit, err));
    return weft_linearity_from_greys(chart, &fit, &all, &s->full_scale, 1, linearity, err);
}

static void test_bends_are_refused(void **state)
{
    (void)state;
    const weft_chart *const chart = munsell();
    weft_linearity linearity = {{0, 0}, 0};
    sensor s = plain_sensor();
    s.bend = gamma_bend;
    assert_fails(judge(chart, &s, true, &linearity, err), WEFT_ERR_NODATA, "not linear");
    s.bend = offset_bend;
    assert_fails(judge(chart, &s, true, &linearity, err), WEFT_ERR_NODATA, "\"N 2\" reads +");
    /* A fitted illumination takes part of a gamma for a gradient: 0.85 would still pass, 0.7 does not. */
    s.bend = strong_gamma_bend;
    assert_fails(judge(chart, &s, false, &linearity, err), WEFT_ERR_NODATA, "not linear");
}

static void test_a_soft_shoulder_is_cut_off(void **state)
{
    (void)state;
    const weft_chart *const chart = munsell();
    weft_linearity linearity;
    sensor s = plain_sensor();
    s.slope[1] = s.slope[2] = 17.0;
    s.slope[0] = s.slope[3] = 15.0;
    s.full_scale = 0.063; /* N9.5 would be at 0.96, N9 at 0.84 */
    s.bend = shoulder_bend;
    assert_ok(judge(chart, &s, true, &linearity, err));
    assert_true(linearity.range[1] < 0.9 && linearity.range[1] > 0.7);
}

static void test_too_little_is_refused(void **state)
{
    (void)state;
    const weft_chart *const chart = munsell();
    weft_patch_reading readings[PATCHES];
    weft_grey_fit fit;
    sensor s = plain_sensor();
    s.full_scale = 0.4; /* all but the dark ones clip */
    read_greys(chart, &s, readings);
    const weft_grey_light light = {readings, NULL, s.full_scale};
    assert_fails(weft_grey_fit_light(chart, &light, &fit, err), WEFT_ERR_NODATA, "grey patches are usable");
    s = plain_sensor();
    read_greys(chart, &s, readings);
    readings[4].mean[WEFT_SITE_G1] = readings[3].mean[WEFT_SITE_G1] * 1.1;
    const weft_grey_light glint = {readings, NULL, s.full_scale};
    assert_fails(weft_grey_fit_light(chart, &glint, &fit, err), WEFT_ERR_NODATA,
                 "\"N 8\" does not answer more than \"N 7\"");
}

/* An exposure series of drawn readings. */
static weft_err run_series(const weft_chart *chart, double (*bend)(double), double offset,
                           weft_exposure_fit *fit, weft_error *err)
{
    static weft_patch_reading readings[5][PATCHES];
    weft_exposure exposures[5];
    for (int e = 0; e < 5; e++) {
        sensor s = plain_sensor();
        s.full_scale = 0.004 * pow(2, e);
        s.bend = bend;
        s.noise = 2e-5;
        s.seed = (uint64_t)e + 5;
        read_greys(chart, &s, readings[e]);
        for (int p = 0; p < PATCHES; p++)
            for (int k = 0; k < WEFT_SITES; k++)
                readings[e][p].mean[k] += offset / s.full_scale;
        exposures[e] = (weft_exposure){s.full_scale, readings[e]};
    }
    return weft_linearity_from_series(chart, exposures, 5, fit, err);
}

static void test_exposure_series(void **state)
{
    (void)state;
    const weft_chart *const chart = munsell();
    weft_exposure_fit fit;
    assert_ok(run_series(chart, NULL, 0.003, &fit, err));
    assert_true(fit.max_deviation < 2e-4);
    for (int k = 0; k < WEFT_SITES; k++)
        assert_near(fit.offset[k], 0.003, 5e-5); /* a wrong black level is found, not called a bend */
    assert_true(fit.range[0] < 0.01 && fit.range[1] > 0.7);
    assert_ok(run_series(chart, gamma_bend, 0, &fit, err));
    assert_true(fit.max_deviation > WEFT_LINEARITY_SERIES_MAX);
    assert_ok(run_series(chart, shoulder_bend, 0, &fit, err));
    assert_true(fit.max_deviation > WEFT_LINEARITY_SERIES_MAX);

    weft_patch_reading readings[PATCHES];
    sensor s = plain_sensor();
    read_greys(chart, &s, readings);
    const weft_exposure same[3] = {{0.01, readings}, {0.0101, readings}, {0.02, readings}};
    assert_fails(weft_linearity_from_series(chart, same, 3, &fit, err), WEFT_ERR_NODATA,
                 "2 different exposures");
}

/* A real CCD: 48 blocks of a picture take the part of patches. */
static bool read_disks(const char *folder, int nanometres, int milliseconds, weft_chart *blocks,
                       weft_patch_reading *readings)
{
    DIR *const dir = opendir(folder);
    char prefix[64], path[1400] = "";
    snprintf(prefix, sizeof prefix, "d1_disks32cmV2_%dnm_%dms_", nanometres, milliseconds);
    for (const struct dirent *e; dir && (e = readdir(dir));)
        if (strncmp(e->d_name, prefix, strlen(prefix)) == 0)
            snprintf(path, sizeof path, "%s/%s", folder, e->d_name);
    if (dir)
        closedir(dir);
    if (!path[0])
        return false;
    weft_raster raster;
    weft_image image;
    weft_mask clipped;
    assert_ok(weft_tiff_read(path, &raster, err));
    assert_ok(weft_image_init(&image, raster.width, raster.height, 1, err));
    assert_ok(weft_mask_init(&clipped, raster.width, raster.height, 0, err));
    for (int v = 0; v < raster.height; v++)
        for (int u = 0; u < raster.width; u++) {
            const uint16_t dn = raster.data[(v * raster.width + u) * raster.channels];
            weft_image_row(&image, 0, v)[u] = (float)dn / 255 / ((float)milliseconds * 1e-3F);
            if (dn >= 250)
                for (int k = 0; k < 9; k++) { /* grown by one pixel over all colours */
                    const int nu = u + k % 3 - 1, nv = v + k / 3 - 1;
                    if (nu >= 0 && nv >= 0 && nu < raster.width && nv < raster.height)
                        clipped.data[nv * raster.width + nu] = 1;
                }
        }
    *blocks = (weft_chart){.name = "blocks", .columns = 8, .rows = 6, .pitch_mm = 10, .patch_mm = 10};
    for (int p = 0; p < 48; p++)
        blocks->patches[p].name = "block";
    const weft_chart_pose pose = {.to_pixel = {{raster.width / 84.0, 0, 0.5 * (raster.width - 1), 0,
                                                -raster.height / 64.0, 0.5 * (raster.height - 1), 0, 0, 1}}};
    const weft_chart_picture picture = {&image, WEFT_CFA_GBRG, &clipped};
    assert_ok(weft_chart_measure(blocks, &picture, &pose, readings, err));
    weft_raster_fini(&raster);
    weft_image_fini(&image);
    weft_mask_fini(&clipped);
    return true;
}

static void test_a_real_sensor(void **state)
{
    (void)state;
    const char *const folder = weft_test_need_shared("data/images/gige_disks");
    static const int wavelengths[3] = {450, 600, 650}, times[6] = {25, 50, 100, 250, 500, 2000};
    for (int w = 0; w < 3; w++) {
        static weft_patch_reading readings[6][48];
        weft_chart blocks;
        weft_exposure exposures[6];
        for (int t = 0; t < 6; t++) {
            assert_true(read_disks(folder, wavelengths[w], times[t], &blocks, readings[t]));
            exposures[t] = (weft_exposure){times[t] * 1e-3, readings[t]};
        }
        for (int p = 0; p < 48; p++) /* blocks with an edge of a disk in them are no patches */
            for (int k = 0; k < WEFT_SITES; k++) {
                const weft_patch_reading *const r = &readings[2][p];
                if (r->std_dev[k] * 0.1 > 0.008 + 0.06 * r->mean[k] * 0.1)
                    for (int t = 0; t < 6; t++)
                        readings[t][p].clipped = 1;
            }
        weft_exposure_fit fit;
        assert_ok(weft_linearity_from_series(&blocks, exposures, 6, &fit, err));
        print_message("GigE CCD at %d nm: %d readings, %.3f to %.3f of the range, off by %.4f at %.3f\n",
                      wavelengths[w], fit.n_points, fit.range[0], fit.range[1], fit.max_deviation,
                      fit.worst_at);
        assert_true(fit.range[1] > 0.2);
        assert_true(fit.max_deviation < WEFT_LINEARITY_SERIES_MAX);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_slopes_and_white_balance_come_back),
        cmocka_unit_test(test_given_irradiance_is_divided_out),
        cmocka_unit_test(test_a_linear_sensor_passes_with_its_range),
        cmocka_unit_test(test_bends_are_refused),
        cmocka_unit_test(test_a_soft_shoulder_is_cut_off),
        cmocka_unit_test(test_too_little_is_refused),
        cmocka_unit_test(test_exposure_series),
        cmocka_unit_test(test_a_real_sensor),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
