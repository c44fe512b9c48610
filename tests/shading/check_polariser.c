/* The polarising filter of the sky: its day by hand, and what it may and may not darken. */
#include "tests/support/support.h"

#include "shading/brdf/half_vector.h"
#include "shading/lighting/environment_map.h"

#include <math.h>

static void test_day(void **state)
{
    (void)state;
    const weft_polariser_key keys[] = {{6, {1, 1, 1}}, {12, {0.4, 0.6, 0.9}}, {20, {0.8, 0.9, 1}}};
    static const struct {
        double hour, red, green;
    } rows[] = {{6, 1, 1},       {9, 0.7, 0.8},    {12, 0.4, 0.6},  {16, 0.6, 0.75},
                {20, 0.8, 0.9},  {22, 0.84, 0.92}, {0, 0.88, 0.94}, {24, 0.88, 0.94},
                {3, 0.94, 0.97}, {-2, 0.84, 0.92}, {33, 0.7, 0.8}};
    for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++) {
        double factor[3];
        weft_polariser_at(3, keys, rows[i].hour, factor);
        assert_near(factor[0], rows[i].red, 1e-12);
        assert_near(factor[1], rows[i].green, 1e-12);
        weft_polariser_at(1, keys + 1, rows[i].hour, factor);
        assert_near(factor[2], 0.9, 0);
    }
}

static void test_sky_and_ground(void **state)
{
    (void)state;
    weft_image panorama;
    weft_environment_map plain, filtered;
    const weft_sky_filter filter = {{0.3, 0.5, 0.8}, 0.25};
    assert_ok(weft_image_init(&panorama, 256, 128, 3, err));
    for (int c = 0; c < 3; c++)
        for (int y = 0; y < 128; y++)
            for (int x = 0; x < 256; x++)
                weft_image_row(&panorama, c, y)[x] =
                    (float)(y < 64 ? (1 + c) * (1.5 + sin(x * WEFT_PI / 64)) : 0.2 * (3 - c));
    assert_ok(weft_environment_map_init(&plain, &panorama, err));
    assert_ok(weft_environment_map_init_filtered(&filtered, &panorama, &filter, err));
    for (int k = 0; k < 200; k++) {
        const double z = 1 - 2 * (k + 0.5) / 200, r = sqrt(1 - z * z), roughness = k % 10 / 10.0;
        const double d[3] = {r * cos(2.4 * k), r * sin(2.4 * k), z};
        double a[3], b[3];
        weft_environment_map_look(&plain, d, fabs(z) > 0.1 ? 0 : roughness, a);
        weft_environment_map_look(&filtered, d, fabs(z) > 0.1 ? 0 : roughness, b);
        for (int c = 0; c < 3; c++) {
            if (z > 0.1) /* sky: the factor; ground: nothing; between them, and blurred: between */
                assert_near(b[c], filter.factor[c] * a[c], 1e-5);
            else if (z < -0.1)
                assert_near(b[c], a[c], 1e-6);
            else
                assert_true(b[c] <= a[c] + 1e-6 && b[c] >= filter.factor[c] * a[c] - 1e-5);
        }
    }
    /* the diffuse light is that of the unfiltered panorama, paler */
    for (int k = 0; k < WEFT_SH_COUNT; k++) {
        const double y = 0.2126 * plain.light[0][k] + 0.7152 * plain.light[1][k] + 0.0722 * plain.light[2][k];
        for (int c = 0; c < 3; c++)
            assert_near(filtered.light[c][k], 0.75 * y + 0.25 * plain.light[c][k], 1e-12);
    }
    weft_environment_map_fini(&plain);
    weft_environment_map_fini(&filtered);
    weft_image_fini(&panorama);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_day),
        cmocka_unit_test(test_sky_and_ground),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
