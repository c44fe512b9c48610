/* Demosaicing of the albedo: exact where it must be, along edges, around holes. */
#include "tests/support/support.h"

#include "core/parallel.h"
#include "host/set/plate.h"
#include "host/solve/site_albedo.h"
#include "host/solve/site_demosaic.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { WIDTH = 70, HEIGHT = 52 };

typedef void colour_fn(double u, double v, double rgb[3]);

/* Colours that keep their differences while they rise and fall. */
static void gentle(double u, double v, double rgb[3])
{
    const double wave = 0.1 * sin(u / 6) + 0.1 * cos(v / 5);
    rgb[0] = 0.5 + wave;
    rgb[1] = 0.4 + wave;
    rgb[2] = 0.3 + wave;
}

/* Squares of undyed and indigo yarn, 13 pixels each. */
static void denim(double u, double v, double rgb[3])
{
    static const double yarn[2][3] = {{0.72, 0.66, 0.55}, {0.04, 0.07, 0.16}};
    memcpy(rgb, yarn[((int)floor(u / 13) + (int)floor(v / 13)) & 1], sizeof yarn[0]);
}

static weft_image mosaic_of(colour_fn *colour, weft_cfa cfa)
{
    weft_image mosaic = {0};
    assert_ok(weft_image_init(&mosaic, WIDTH, HEIGHT, 1, err));
    for (int v = 0; v < HEIGHT; v++)
        for (int u = 0; u < WIDTH; u++) {
            double rgb[3];
            colour(u, v, rgb);
            weft_image_row(&mosaic, 0, v)[u] = (float)rgb[weft_cfa_colour(cfa, u, v)];
        }
    return mosaic;
}

static double mean_error(const weft_image *rgb, colour_fn *colour)
{
    double sum = 0;
    for (int v = 0; v < HEIGHT; v++)
        for (int u = 0; u < WIDTH; u++) {
            double want[3];
            colour(u, v, want);
            for (int c = 0; c < 3; c++)
                sum += fabs((double)weft_image_row(rgb, c, v)[u] - want[c]) / 3;
        }
    return sum / (WIDTH * HEIGHT);
}

static void test_own_sites_are_kept_and_gentle_colours_found(void **state)
{
    (void)state;
    for (weft_cfa cfa = WEFT_CFA_RGGB; cfa <= WEFT_CFA_BGGR; cfa++) {
        weft_image mosaic = mosaic_of(gentle, cfa), rgb = {0};
        assert_ok(weft_site_demosaic(&mosaic, cfa, &rgb, err));
        for (int v = 0; v < HEIGHT; v++)
            for (int u = 0; u < WIDTH; u++)
                assert_true(weft_image_row(&rgb, weft_cfa_colour(cfa, u, v), v)[u] ==
                            weft_image_row(&mosaic, 0, v)[u]);
        const double error = mean_error(&rgb, gentle);
        print_message("%s: mean error %.2g\n", weft_cfa_name(cfa), error);
        assert_true(error < 2e-4);
        weft_image_fini(&mosaic);
        weft_image_fini(&rgb);
    }
}

/* At borders of two yarns it must beat the linear filters by far: that is what it is here for. */
static void test_edges_between_yarns(void **state)
{
    (void)state;
    weft_plate plate = {.image = mosaic_of(denim, WEFT_CFA_RGGB), .cfa = WEFT_CFA_RGGB}, linear = {0};
    weft_image rgb = {0};
    assert_ok(weft_mask_init(&plate.clipped, WIDTH, HEIGHT, 0, err));
    assert_ok(weft_plate_demosaic(&plate, WEFT_DEMOSAIC_LINEAR, &linear, err));
    assert_ok(weft_site_demosaic(&plate.image, WEFT_CFA_RGGB, &rgb, err));
    const double here = mean_error(&rgb, denim), there = mean_error(&linear.image, denim);
    print_message("mean error %.5f, of the linear filters %.5f\n", here, there);
    assert_true(here < 0.2 * there);
    weft_plate_fini(&plate);
    weft_plate_fini(&linear);
    weft_image_fini(&rgb);
}

/* ---- against the formulas, pixel by pixel in double ---- */

static int mirrored(int i, int n)
{
    return i < 0 ? -i : i >= n ? 2 * n - 2 - i : i;
}

static double site_at(const weft_image *m, int u, int v)
{
    return (double)weft_image_row(m, 0, mirrored(v, m->height))[mirrored(u, m->width)];
}

/* Green minus the other colour of the row (or column) at a site. */
static double difference_at(const weft_image *m, weft_cfa cfa, int u, int v, int du, int dv)
{
    const double here = site_at(m, u, v);
    const double there =
        0.5 * (site_at(m, u - du, v - dv) + site_at(m, u + du, v + dv)) +
        0.25 * (2 * here - site_at(m, u - 2 * du, v - 2 * dv) - site_at(m, u + 2 * du, v + 2 * dv));
    return weft_cfa_colour(cfa, u & 1, v & 1) == 1 ? here - there : there - here;
}

static double green_at(const weft_image *m, weft_cfa cfa, int u, int v)
{
    static const int directions[4][2] = {{1, 0}, {-1, 0}, {0, 1}, {0, -1}};
    double sum = 0, sum_weight = 0;
    if (weft_cfa_colour(cfa, u & 1, v & 1) == 1)
        return site_at(m, u, v);
    for (int d = 0; d < 4; d++) {
        const int du = abs(directions[d][0]), dv = abs(directions[d][1]);
        double mean = 0, change = 1e-6;
        for (int i = 0; i < 5; i++) {
            const int x = u + i * directions[d][0], y = v + i * directions[d][1];
            mean += 0.2 * difference_at(m, cfa, x, y, du, dv);
            for (int j = -2; j <= 2; j++)
                change += fabs(difference_at(m, cfa, x + j * dv + du, y + j * du + dv, du, dv) -
                               difference_at(m, cfa, x + j * dv - du, y + j * du - dv, du, dv));
        }
        sum += mean / (change * change);
        sum_weight += 1 / (change * change);
    }
    return site_at(m, u, v) + sum / sum_weight;
}

static double colour_at(const weft_image *m, weft_cfa cfa, int u, int v, int colour)
{
    const double green = green_at(m, cfa, u, v);
    double sum = 0, sum_weight = 0;
    if (colour == 1 || weft_cfa_colour(cfa, u, v) == colour)
        return colour == 1 ? green : site_at(m, u, v);
    for (int dv = -2; dv <= 2; dv++)
        for (int du = -2; du <= 2; du++) {
            if (weft_cfa_colour(cfa, (u + du) & 1, (v + dv) & 1) != colour)
                continue;
            const double other = green_at(m, cfa, u + du, v + dv), apart = other - green;
            const double near = 0.05 * (fabs(other) + fabs(green)) + 1e-3;
            const double weight = 1 / ((apart * apart + near * near) * (1 + du * du + dv * dv));
            sum += weight * (other - site_at(m, u + du, v + dv));
            sum_weight += weight;
        }
    return green - sum / sum_weight;
}

/* Wider and higher than what is worked on at a time, an odd number of pixels, noise with yarns: wherever a
 * pixel lies, it is what the formulas say. */
static void test_every_pixel_is_what_the_formulas_say(void **state)
{
    enum { WIDE = 531, HIGH = 269 };
    static const int around[] = {0, 1, 2, 9, 127, 128, 129, 255, 256, 257, 266, 267, 268, 511, 512, 528, 530};
    weft_image m = {0}, rgb = {0};
    uint64_t random = 11;
    double worst = 0;
    (void)state;
    assert_ok(weft_image_init(&m, WIDE, HIGH, 1, err));
    for (int v = 0; v < HIGH; v++)
        for (int u = 0; u < WIDE; u++) {
            double yarn[3];
            denim(u, v, yarn);
            weft_image_row(&m, 0, v)[u] =
                (float)(yarn[weft_cfa_colour(WEFT_CFA_GBRG, u, v)] + 0.02 * weft_test_gauss(&random));
        }
    assert_ok(weft_site_demosaic(&m, WEFT_CFA_GBRG, &rgb, err));
    for (int j = 0; j < (int)(sizeof around / sizeof around[0]) && around[j] < HIGH; j++)
        for (int i = 0; i < (int)(sizeof around / sizeof around[0]); i++)
            for (int c = 0; c < 3; c++)
                worst = fmax(worst, fabs((double)weft_image_row(&rgb, c, around[j])[around[i]] -
                                         colour_at(&m, WEFT_CFA_GBRG, around[i], around[j], c)));
    print_message("furthest from the formulas %.2g\n", worst);
    assert_true(worst < 2e-6);
    weft_image_fini(&m);
    weft_image_fini(&rgb);
}

static void make_maps(weft_maps *m, colour_fn *colour)
{
    *m = (weft_maps){.width = WIDTH, .height = HEIGHT};
    weft_image mosaic = mosaic_of(colour, WEFT_CFA_GRBG);
    assert_ok(weft_image_init(&m->albedo, WIDTH, HEIGHT, 3, err));
    assert_ok(weft_mask_init(&m->mask, WIDTH, HEIGHT, 255, err));
    memcpy(m->albedo.data, mosaic.data, sizeof(float) * WIDTH * HEIGHT);
    weft_image_fini(&mosaic);
}

static void test_a_hole_does_not_colour_its_rim(void **state)
{
    (void)state;
    weft_maps m;
    make_maps(&m, gentle);
    for (int v = 20; v < 40; v++)
        for (int u = 25; u < 50; u++) {
            m.mask.data[v * WIDTH + u] = 0;
            weft_image_row(&m.albedo, 0, v)[u] = 0;
        }
    assert_ok(weft_site_albedo_finish(&m, WEFT_CFA_GRBG, NULL, NULL, err));
    double worst = 0;
    for (int v = 0; v < HEIGHT; v++)
        for (int u = 0; u < WIDTH; u++) {
            double want[3];
            gentle(u, v, want);
            for (int c = 0; c < 3 && m.mask.data[v * WIDTH + u]; c++)
                worst = fmax(worst, fabs((double)weft_image_row(&m.albedo, c, v)[u] - want[c]));
        }
    print_message("worst error outside the hole %.4f\n", worst);
    assert_true(worst < 0.02); /* black there would give 0.1 and more */
    assert_int_equal(m.mask.data[30 * WIDTH + 30], 0);
    weft_maps_fini(&m);
}

static void test_same_bits_on_any_number_of_threads(void **state)
{
    (void)state;
    static const int threads[] = {1, 2, 7};
    weft_image mosaic = mosaic_of(denim, WEFT_CFA_BGGR), rgb[3] = {{0}};
    for (int i = 0; i < 3; i++) {
        weft_parallel_set_threads(threads[i]);
        assert_ok(weft_site_demosaic(&mosaic, WEFT_CFA_BGGR, &rgb[i], err));
        assert_memory_equal(rgb[0].data, rgb[i].data, 3 * sizeof(float) * WIDTH * HEIGHT);
    }
    weft_parallel_set_threads(0);
    for (int i = 0; i < 3; i++)
        weft_image_fini(&rgb[i]);
    weft_image_fini(&mosaic);
}

static void test_too_small_is_refused(void **state)
{
    (void)state;
    weft_image mosaic, rgb = {0};
    assert_ok(weft_image_init(&mosaic, 9, 40, 1, err));
    assert_fails(weft_site_demosaic(&mosaic, WEFT_CFA_RGGB, &rgb, err), WEFT_ERR_RANGE, "9 x 40");
    weft_image_fini(&mosaic);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_own_sites_are_kept_and_gentle_colours_found),
        cmocka_unit_test(test_edges_between_yarns),
        cmocka_unit_test(test_every_pixel_is_what_the_formulas_say),
        cmocka_unit_test(test_a_hole_does_not_colour_its_rim),
        cmocka_unit_test(test_same_bits_on_any_number_of_threads),
        cmocka_unit_test(test_too_small_is_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
