/* Bayer to RGB: the published filters, written down once more and slowly; ramps; better than bilinear. */
#include "tests/support/support.h"

#include "core/parallel.h"
#include "host/set/plate.h"

#include <math.h>
#include <string.h>

/* Figure 2 of Malvar, He, Cutler 2004, in sixteenths, rows from top to bottom. */
static const int green_at_red_or_blue[5][5] = {
    {0, 0, -2, 0, 0}, {0, 0, 4, 0, 0}, {-2, 4, 8, 4, -2}, {0, 0, 4, 0, 0}, {0, 0, -2, 0, 0}};
static const int red_at_green_in_red_row[5][5] = {
    {0, 0, 1, 0, 0}, {0, -2, 0, -2, 0}, {-2, 8, 10, 8, -2}, {0, -2, 0, -2, 0}, {0, 0, 1, 0, 0}};
static const int red_at_green_in_blue_row[5][5] = {
    {0, 0, -2, 0, 0}, {0, -2, 8, -2, 0}, {1, 0, 10, 0, 1}, {0, -2, 8, -2, 0}, {0, 0, -2, 0, 0}};
static const int red_at_blue[5][5] = {
    {0, 0, -3, 0, 0}, {0, 4, 0, 4, 0}, {-3, 0, 12, 0, -3}, {0, 4, 0, 4, 0}, {0, 0, -3, 0, 0}};

static int mirrored(int i, int n)
{
    while (i < 0 || i >= n)
        i = i < 0 ? -i : 2 * n - 2 - i;
    return i;
}

static double filtered(const weft_image *m, int u, int v, const int f[5][5])
{
    double sum = 0;
    for (int j = 0; j < 5; j++)
        for (int i = 0; i < 5; i++)
            sum +=
                f[j][i] / 16.0 *
                (double)weft_image_row(m, 0, mirrored(v + j - 2, m->height))[mirrored(u + i - 2, m->width)];
    return sum;
}

static double reference(const weft_image *m, weft_cfa cfa, int u, int v, int wanted)
{
    const int own = weft_cfa_colour(cfa, u, v);
    if (own == wanted)
        return (double)weft_image_row(m, 0, v)[u];
    if (wanted == 1)
        return filtered(m, u, v, green_at_red_or_blue);
    if (own != 1)
        return filtered(m, u, v, red_at_blue);
    return filtered(m, u, v,
                    weft_cfa_colour(cfa, u + 1, v) == wanted ? red_at_green_in_red_row
                                                             : red_at_green_in_blue_row);
}

static weft_plate make_plate(int width, int height, weft_cfa cfa)
{
    weft_plate plate = {.cfa = cfa, .noise_floor = 0.5};
    assert_ok(weft_image_init(&plate.image, width, height, 1, err));
    assert_ok(weft_mask_init(&plate.clipped, width, height, 0, err));
    return plate;
}

static void test_filters_are_the_published_ones(void **state)
{
    (void)state;
    uint64_t seed = 1;
    const int sizes[][2] = {{2, 2}, {3, 2}, {2, 7}, {4, 4}, {5, 5}, {6, 3}, {37, 29}, {64, 40}, {131, 18}};
    for (int cfa = WEFT_CFA_RGGB; cfa <= WEFT_CFA_BGGR; cfa++)
        for (size_t s = 0; s < sizeof sizes / sizeof *sizes; s++) {
            weft_plate m = make_plate(sizes[s][0], sizes[s][1], (weft_cfa)cfa), rgb;
            for (size_t i = 0; i < weft_image_plane_size(&m.image); i++)
                m.image.data[i] = (float)weft_test_random(&seed);
            assert_ok(weft_plate_demosaic(&m, WEFT_DEMOSAIC_LINEAR, &rgb, err));
            assert_true(rgb.image.planes == 3 && rgb.image.width == sizes[s][0] &&
                        rgb.image.height == sizes[s][1]);
            assert_true(rgb.cfa == WEFT_CFA_NONE && rgb.noise_floor == 0.5);
            for (int p = 0; p < 3; p++)
                for (int v = 0; v < m.image.height; v++)
                    for (int u = 0; u < m.image.width; u++)
                        assert_near((double)weft_image_row(&rgb.image, p, v)[u],
                                    reference(&m.image, (weft_cfa)cfa, u, v, p), 1e-6);
            weft_plate_fini(&rgb);
            weft_plate_fini(&m);
        }
}

static void test_linear_ramps_are_exact(void **state)
{
    (void)state;
    for (int cfa = WEFT_CFA_RGGB; cfa <= WEFT_CFA_BGGR; cfa++) {
        weft_plate m = make_plate(40, 30, (weft_cfa)cfa), rgb;
        for (int v = 0; v < 30; v++)
            for (int u = 0; u < 40; u++) /* one grey plane */
                weft_image_row(&m.image, 0, v)[u] = (float)(0.1 + 0.01 * u - 0.003 * v);
        assert_ok(weft_plate_demosaic(&m, WEFT_DEMOSAIC_LINEAR, &rgb, err));
        for (int p = 0; p < 3; p++)
            for (int v = 2; v < 28; v++) /* the mirror bends a ramp at the border */
                for (int u = 2; u < 38; u++)
                    assert_near((double)weft_image_row(&rgb.image, p, v)[u], 0.1 + 0.01 * u - 0.003 * v,
                                1e-6);
        weft_plate_fini(&rgb);
        for (int v = 0; v < 30; v++) /* flat colours, the border included */
            for (int u = 0; u < 40; u++)
                weft_image_row(&m.image, 0, v)[u] = (float)(0.2 + 0.3 * weft_cfa_colour(m.cfa, u, v));
        assert_ok(weft_plate_demosaic(&m, WEFT_DEMOSAIC_LINEAR, &rgb, err));
        for (int p = 0; p < 3; p++)
            for (size_t i = 0; i < 40 * 30; i++)
                assert_near((double)weft_image_plane(&rgb.image, p)[i], 0.2 + 0.3 * p, 1e-6);
        weft_plate_fini(&rgb);
        weft_plate_fini(&m);
    }
}

/* Mean of the neighbours of a colour within 3 x 3: what bilinear interpolation is. */
static double bilinear(const weft_image *m, weft_cfa cfa, int u, int v, int wanted)
{
    double sum = 0;
    int n = 0;
    if (weft_cfa_colour(cfa, u, v) == wanted)
        return (double)weft_image_row(m, 0, v)[u];
    for (int j = -1; j <= 1; j++)
        for (int i = -1; i <= 1; i++)
            if (weft_cfa_colour(cfa, u + i + 2, v + j + 2) == wanted && (wanted != 1 || i == 0 || j == 0)) {
                sum += (double)weft_image_row(m, 0, mirrored(v + j, m->height))[mirrored(u + i, m->width)];
                n++;
            }
    return sum / n;
}

static void test_better_than_bilinear_on_fine_detail(void **state)
{
    (void)state;
    enum { N = 256 };
    weft_plate m = make_plate(N, N, WEFT_CFA_RGGB), rgb;
    static const double colour[3] = {0.9, 1, 0.7};
    double squares[2] = {0, 0};
    for (int v = 0; v < N; v++)
        for (int u = 0; u < N; u++) { /* a zone plate up to a quarter of the sampling rate */
            const double r2 = (double)(u * u + v * v) / (N * N);
            const double y = 0.5 + 0.4 * cos(M_PI * N / 4 * r2);
            weft_image_row(&m.image, 0, v)[u] = (float)(colour[weft_cfa_colour(m.cfa, u, v)] * y);
        }
    assert_ok(weft_plate_demosaic(&m, WEFT_DEMOSAIC_LINEAR, &rgb, err));
    for (int v = 0; v < N; v++)
        for (int u = 0; u < N; u++)
            for (int p = 0; p < 3; p++) {
                const double y = 0.5 + 0.4 * cos(M_PI * N / 4 * (double)(u * u + v * v) / (N * N));
                const double a = (double)weft_image_row(&rgb.image, p, v)[u] - colour[p] * y;
                const double b = bilinear(&m.image, m.cfa, u, v, p) - colour[p] * y;
                squares[0] += a * a;
                squares[1] += b * b;
            }
    const double psnr[2] = {-10 * log10(squares[0] / (3 * N * N)), -10 * log10(squares[1] / (3 * N * N))};
    print_message("zone plate: %.1f dB, bilinear %.1f dB\n", psnr[0], psnr[1]);
    assert_true(psnr[0] > psnr[1] + 3); /* the paper reports 5.5 dB over bilinear on photographs */
    weft_plate_fini(&rgb);
    weft_plate_fini(&m);
}

static void test_half(void **state)
{
    (void)state;
    for (int cfa = WEFT_CFA_RGGB; cfa <= WEFT_CFA_BGGR; cfa++) {
        weft_plate m = make_plate(9, 7, (weft_cfa)cfa), rgb;
        for (int i = 0; i < 63; i++)
            m.image.data[i] = (float)i;
        m.clipped.data[2 * 9 + 5] = 255;
        assert_ok(weft_plate_demosaic(&m, WEFT_DEMOSAIC_HALF, &rgb, err));
        assert_true(rgb.image.width == 4 && rgb.image.height == 3);
        for (int v = 0; v < 3; v++)
            for (int u = 0; u < 4; u++) {
                double wanted[3] = {0, 0, 0};
                for (int k = 0; k < 4; k++) {
                    const int x = 2 * u + k % 2, y = 2 * v + k / 2, c = weft_cfa_colour(m.cfa, x, y);
                    wanted[c] += (y * 9 + x) * (c == 1 ? 0.5 : 1);
                }
                for (int p = 0; p < 3; p++)
                    assert_near((double)weft_image_row(&rgb.image, p, v)[u], wanted[p], 0);
                assert_int_equal(rgb.clipped.data[v * 4 + u] != 0, u == 2 && v == 1);
            }
        weft_plate_fini(&rgb);
        weft_plate_fini(&m);
    }
}

/* Clipped must be every pixel that changes when the clipped site does: found by changing it. */
static void test_clipping_reaches_as_far_as_the_filters(void **state)
{
    (void)state;
    weft_plate m = make_plate(20, 16, WEFT_CFA_GBRG), before, after;
    const int sites[][2] = {{0, 0}, {1, 0}, {10, 7}, {19, 15}, {11, 8}};
    for (int i = 0; i < 5; i++) {
        const size_t at = (size_t)sites[i][1] * 20 + (size_t)sites[i][0];
        assert_ok(weft_plate_demosaic(&m, WEFT_DEMOSAIC_LINEAR, &before, err));
        m.clipped.data[at] = 255;
        m.image.data[at] = 1;
        assert_ok(weft_plate_demosaic(&m, WEFT_DEMOSAIC_LINEAR, &after, err));
        m.clipped.data[at] = 0;
        m.image.data[at] = 0;
        for (size_t k = 0; k < 20 * 16; k++) {
            bool changed = false;
            for (int p = 0; p < 3; p++)
                changed |= weft_image_plane(&before.image, p)[k] != weft_image_plane(&after.image, p)[k];
            if (changed && !after.clipped.data[k])
                fail_msg("site %d,%d changes pixel %zu, which is not marked", sites[i][0], sites[i][1], k);
        }
        weft_plate_fini(&before);
        weft_plate_fini(&after);
    }
    weft_plate_fini(&m);
}

static void test_pictures(void **state)
{
    (void)state;
    weft_plate grey = make_plate(8, 6, WEFT_CFA_NONE), out;
    for (int i = 0; i < 48; i++)
        grey.image.data[i] = (float)i;
    grey.clipped.data[0] = 255;
    assert_ok(weft_plate_demosaic(&grey, WEFT_DEMOSAIC_LINEAR, &out, err));
    for (int p = 0; p < 3; p++)
        assert_memory_equal(weft_image_plane(&out.image, p), grey.image.data, 48 * sizeof(float));
    assert_true(out.clipped.data[0] && !out.clipped.data[1]);
    weft_plate_fini(&out);
    assert_ok(weft_plate_demosaic(&grey, WEFT_DEMOSAIC_HALF, &out, err));
    assert_true(out.image.width == 4 && out.image.height == 3);
    assert_near((double)weft_image_row(&out.image, 1, 1)[2], (20 + 21 + 28 + 29) / 4.0, 1e-6);
    assert_true(out.clipped.data[0] && !out.clipped.data[1]);
    weft_plate_fini(&out);
    grey.image.width = 1;
    assert_fails(weft_plate_demosaic(&grey, WEFT_DEMOSAIC_LINEAR, &out, err), WEFT_ERR_RANGE, "too small");
    weft_plate_fini(&grey);
}

static void test_same_bits_with_any_threads(void **state)
{
    (void)state;
    weft_plate m = make_plate(203, 151, WEFT_CFA_BGGR), rgb[3];
    uint64_t seed = 3;
    for (size_t i = 0; i < weft_image_plane_size(&m.image); i++)
        m.image.data[i] = (float)weft_test_random(&seed);
    for (int k = 0; k < 3; k++) {
        weft_parallel_set_threads(1 + 3 * k);
        assert_ok(weft_plate_demosaic(&m, WEFT_DEMOSAIC_LINEAR, &rgb[k], err));
        assert_memory_equal(rgb[k].image.data, rgb[0].image.data, 203 * 151 * 3 * sizeof(float));
    }
    weft_parallel_set_threads(0);
    for (int k = 0; k < 3; k++)
        weft_plate_fini(&rgb[k]);
    weft_plate_fini(&m);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_filters_are_the_published_ones),
        cmocka_unit_test(test_linear_ramps_are_exact),
        cmocka_unit_test(test_better_than_bilinear_on_fine_detail),
        cmocka_unit_test(test_half),
        cmocka_unit_test(test_clipping_reaches_as_far_as_the_filters),
        cmocka_unit_test(test_pictures),
        cmocka_unit_test(test_same_bits_with_any_threads),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
