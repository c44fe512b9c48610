/* weft compare's arithmetic, on differences that are known. */
#include "tests/support/support.h"

#include "host/set/compare.h"
#include "tests/host/dome.h"

#include <math.h>
#include <string.h>

static void test_spread(void **state)
{
    (void)state;
    float values[1000];
    for (int i = 0; i < 1000; i++)
        values[(i * 7) % 1000] = (float)i; /* every one once, out of order */
    const weft_spread s = weft_spread_of(values, 1000);
    assert_near(s.mean, 499.5, 1e-9);
    assert_near(s.median, 499, 0);
    assert_near(s.p95, 949, 0);
    assert_near(s.p99, 989, 0);
    assert_near(s.max, 999, 0);
    assert_near(s.rms, sqrt(332833.5), 1e-6);
    float one = 3;
    assert_near(weft_spread_of(&one, 1).median, 3, 0);
    assert_int_equal(weft_spread_of(NULL, 0).n, 0);
}

/* Plane maps over [x0, x0 + w) x ... of one world pattern, so that any two of them agree where they overlap.
 */
static void make(weft_maps *m, int width, int height, double x_mm, double y_mm, double mm_per_px, double tilt)
{
    *m = (weft_maps){.width = width,
                     .height = height,
                     .geometry = WEFT_GEOMETRY_PLANE,
                     .mm_per_px = mm_per_px,
                     .origin_mm = {x_mm, y_mm},
                     .albedo_is_srgb = true};
    assert_ok(weft_image_init(&m->normal, width, height, 3, err));
    assert_ok(weft_image_init(&m->albedo, width, height, 3, err));
    assert_ok(weft_mask_init(&m->mask, width, height, 255, err));
    for (int j = 0; j < height; j++)
        for (int i = 0; i < width; i++) {
            const double x = x_mm + i * mm_per_px, y = y_mm - j * mm_per_px;
            const double about = 0.3 * sin(x) + tilt, across = 0.2 * cos(y);
            weft_image_row(&m->normal, 0, j)[i] = (float)(sin(about) * cos(across));
            weft_image_row(&m->normal, 1, j)[i] = (float)sin(across);
            weft_image_row(&m->normal, 2, j)[i] = (float)(cos(about) * cos(across));
            for (int c = 0; c < 3; c++)
                weft_image_row(&m->albedo, c, j)[i] = (float)(0.4 + 0.1 * c + 0.05 * sin(x + y));
        }
}

static void test_plane_maps_are_laid_over_each_other(void **state)
{
    (void)state;
    weft_maps a, b;
    weft_maps_difference d;
    make(&a, 60, 40, -5.9, 3.9, 0.2, 0);
    make(&b, 50, 46, -5.1, 4.3, 0.2, 0);
    assert_ok(weft_compare_maps(&a, &b, NULL, &d, err));
    assert_int_equal(d.offset_px[0], -4);
    assert_int_equal(d.offset_px[1], 2);
    assert_int_equal(d.normal_deg.n, 50 * 40);
    assert_true(d.normal_deg.max < 1e-4 && d.delta_e.max < 1e-3 && d.luminance.max < 1e-5);
    weft_maps_fini(&b);
    make(&b, 50, 46, -5.1 + 0.08, 4.3, 0.2, 0);
    assert_fails(weft_compare_maps(&a, &b, NULL, &d, err), WEFT_ERR_MISMATCH, "off by -4.4 pixels");
    b.origin_mm[0] = 1000;
    assert_fails(weft_compare_maps(&a, &b, NULL, &d, err), WEFT_ERR_MISMATCH, "not a whole number");
    b.origin_mm[0] = 1000.1;
    assert_fails(weft_compare_maps(&a, &b, NULL, &d, err), WEFT_ERR_NODATA, "do not overlap");
    b.mm_per_px = 0.25;
    assert_fails(weft_compare_maps(&a, &b, NULL, &d, err), WEFT_ERR_MISMATCH, "--mm-per-px");
    b.geometry = WEFT_GEOMETRY_SENSOR;
    assert_fails(weft_compare_maps(&a, &b, NULL, &d, err), WEFT_ERR_MISMATCH, "60 x 40");
    weft_maps_fini(&a);
    weft_maps_fini(&b);
}

static void test_a_turn_is_measured(void **state)
{
    (void)state;
    weft_maps a, b;
    weft_maps_difference d;
    weft_mask mask;
    make(&a, 60, 40, -5.9, 3.9, 0.2, 0.05);
    make(&b, 60, 40, -5.9, 3.9, 0.2, 0);
    for (int i = 0; i < 600; i++)
        b.mask.data[i] = 0;
    for (int i = 0; i < 60; i++)
        weft_image_row(&a.normal, 0, 39)[i] = NAN;
    assert_ok(weft_mask_init(&mask, 60, 40, 1, err));
    for (int i = 1200; i < 1260; i++)
        mask.data[i] = 0;
    assert_ok(weft_compare_maps(&a, &b, &mask, &d, err));
    assert_int_equal(d.normal_deg.n, 60 * 40 - 600 - 60 - 60);
    assert_int_equal(d.only_a, 600);
    assert_int_equal(d.only_b, 60);
    assert_near(d.normal_deg.mean, 0.05 * 57.29578, 0.06); /* a little less where the normal leans */
    assert_true(d.normal_deg.max <= 0.05 * 57.29578 + 1e-3);
    assert_near(d.mean_normal_deg[0], 0.05 * 57.29578, 1e-3);
    assert_near(d.mean_normal_deg[1], 0, 0.01);
    mask.width = 59;
    assert_fails(weft_compare_maps(&a, &b, &mask, &d, err), WEFT_ERR_MISMATCH, "the mask has 59");
    mask.width = 60;
    memset(mask.data, 0, 2400);
    assert_fails(weft_compare_maps(&a, &b, &mask, &d, err), WEFT_ERR_NODATA, "no pixel");
    weft_mask_fini(&mask);
    weft_maps_fini(&a);
    weft_maps_fini(&b);
}

static void test_delta_e_of_known_greys(void **state)
{
    (void)state;
    weft_image a, b;
    weft_picture_difference d;
    assert_ok(weft_image_init(&a, 8, 8, 1, err));
    assert_ok(weft_image_init(&b, 8, 8, 3, err));
    for (int i = 0; i < 64; i++) { /* L* 50 and L* 60: CIEDE2000 8.7396 by hand: 10 / S_L, S_L at 55 */
        a.data[i] = 0.18418652F;
        for (int c = 0; c < 3; c++)
            b.data[64 * c + i] = 0.28123290F;
    }
    const double s_l = 1 + 0.015 * 25 / sqrt(20 + 25.0);
    assert_ok(weft_compare_pictures(&a, &b, NULL, &d, err));
    assert_near(d.delta_e.mean, 10 / s_l, 0.02); /* white of the four-digit matrix is not exactly neutral */
    assert_near(d.rms, 0.0970464, 1e-5);
    assert_true(d.psnr_db > 19 && d.psnr_db < 21); /* codes 0.466 and 0.567: 20 log10(1 / 0.1009) = 19.9 */
    assert_ok(weft_compare_pictures(&a, &a, NULL, &d, err));
    assert_true(isinf(d.psnr_db) && d.delta_e.max == 0);
    b.width = 4;
    assert_fails(weft_compare_pictures(&a, &b, NULL, &d, err), WEFT_ERR_MISMATCH, "8 x 8");
    weft_image_fini(&a);
    weft_image_fini(&b);
}

static void test_calibrations(void **state)
{
    (void)state;
    weft_calibration a, b;
    weft_calibration_difference d;
    dome_init(&a, 1232, 816);
    dome_init(&b, 1232, 816);
    b.lights[3].position.x += 3;
    b.lights[3].position.z += 4;
    for (int j = 0; j < 10; j++)
        for (int c = 0; c < 3; c++)
            b.lights[j].intensity[c] *= j % 2 ? 2.2 : 1.8;
    b.camera.fx *= 1.01;
    b.camera.cx += 3;
    b.camera.cy -= 4;
    assert_ok(weft_compare_calibrations(&a, &b, &d, err));
    assert_near(d.position_mm[0], 0.5, 1e-9);
    assert_near(d.position_mm[1], 5, 1e-9);
    assert_near(d.position_mm[2], 3, 0);
    assert_near(d.intensity_ratio_mean, 0.5 * (1 / 2.2 + 1 / 1.8), 1e-9);
    assert_near(d.intensity_ratio_spread, 0.1, 1e-9); /* +-10 % of the mean */
    assert_near(d.focal_ratio, 1 / 1.01, 1e-12);
    assert_near(d.principal_px, 5, 1e-9);
    assert_near(d.centre_mm, 0, 1e-9);
    assert_true(d.projection_px[0] > 4 && d.projection_px[1] < 15);
    b.n_lights = 9;
    assert_fails(weft_compare_calibrations(&a, &b, &d, err), WEFT_ERR_MISMATCH, "10 lights");
    b = (weft_calibration){.has_colour = true};
    assert_fails(weft_compare_calibrations(&a, &b, &d, err), WEFT_ERR_NODATA, "no part in common");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_spread),
        cmocka_unit_test(test_plane_maps_are_laid_over_each_other),
        cmocka_unit_test(test_a_turn_is_measured),
        cmocka_unit_test(test_delta_e_of_known_greys),
        cmocka_unit_test(test_calibrations),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
