/* The repeat of weaves that are given by formulas. */
#include "tests/support/support.h"

#include "shading/bake/weave.h"

#include <math.h>

static const double pi = 3.14159265358979323846;

/* Height of a weave in pitches: `up` threads over, `down` under, shifted by `shift` a row. */
static double weave_height(double u, double v, int repeat, int over, int shift)
{
    const int i = (int)floor(u), j = (int)floor(v);
    const double a = u - i - 0.5, b = v - j - 0.5;
    const int up = (((i - j * shift) % repeat) + repeat) % repeat < over ? 1 : -1;
    const double warp = 0.5 * sqrt(0.25 - 0.9 * a * a) + up * 0.2 * cos(pi * b);
    const double weft = 0.5 * sqrt(0.25 - 0.9 * b * b) - up * 0.2 * cos(pi * a);
    return fmax(warp, weft);
}

static void make(weft_image *normal, int w, int h, const double step[2][2], int repeat, int over, int shift)
{
    const double det = step[0][0] * step[1][1] - step[0][1] * step[1][0], e = 0.5;
    assert_ok(weft_image_init(normal, w, h, 3, err));
    for (int y = 0; y < h; y++)
        for (int x = 0; x < w; x++) {
            double height[4];
            static const int dx[4] = {1, -1, 0, 0}, dy[4] = {0, 0, 1, -1};
            for (int k = 0; k < 4; k++) {
                const double px = x + e * dx[k], py = y + e * dy[k];
                height[k] = 8 * weave_height((px * step[1][1] - py * step[1][0]) / det,
                                             (py * step[0][0] - px * step[0][1]) / det, repeat, over, shift);
            }
            const double a = fmin(fmax(-(height[0] - height[1]) / (2 * e), -3), 3);
            const double b = fmin(fmax((height[2] - height[3]) / (2 * e), -3), 3),
                         l = sqrt(a * a + b * b + 1);
            weft_image_row(normal, 0, y)[x] = (float)(a / l);
            weft_image_row(normal, 1, y)[x] = (float)(b / l);
            weft_image_row(normal, 2, y)[x] = (float)(1 / l);
        }
}

static void check_repeats(void **state)
{
    (void)state;
    static const struct {
        const char *name;
        double step[2][2];
        int repeat, over, shift;
    } weaves[] = {{"plain", {{8.13, 0.1}, {-0.15, 9.31}}, 2, 1, 1},
                  {"twill 2/2", {{7.4, -0.2}, {0.1, 7.9}}, 4, 2, 1},
                  {"twill 3/1", {{10.3, 0.3}, {0.2, 8.2}}, 4, 3, 1},
                  {"satin 5", {{9.2, 0}, {0, 9.9}}, 5, 4, 2}};
    const weft_image none = {0};
    for (size_t i = 0; i < sizeof weaves / sizeof weaves[0]; i++) {
        weft_image normal;
        weft_weave found;
        make(&normal, 600, 500, weaves[i].step, weaves[i].repeat, weaves[i].over, weaves[i].shift);
        assert_ok(weft_weave_find(&normal, &none, &found, err));
        print_message("%s: %d x %d threads, likeness %.2f %.2f, skew %.2f deg, steps %.3f %.3f\n",
                      weaves[i].name, found.threads[0], found.threads[1], found.likeness[0],
                      found.likeness[1], found.skew_deg, hypot(found.step_px[0][0], found.step_px[0][1]),
                      hypot(found.step_px[1][0], found.step_px[1][1]));
        for (int axis = 0; axis < 2; axis++) {
            const double truth = hypot(weaves[i].step[axis][0], weaves[i].step[axis][1]);
            assert_near(hypot(found.step_px[axis][0], found.step_px[axis][1]) / truth, 1, 0.005);
            assert_int_equal(found.threads[axis], weaves[i].repeat);
        }
        weft_weave_fini(&found);
        weft_image_fini(&normal);
    }
}

/* A tile of noisy, skewed cloth: whole repeats, and no step over its edges that is not everywhere. */
static void check_cut(void **state)
{
    (void)state;
    static const double step[2][2] = {{8.13, 0.1}, {-0.15, 9.31}};
    weft_image normal, albedo, tiles[2];
    weft_weave found;
    weft_seam seam;
    uint64_t random = 11;
    make(&normal, 500, 400, step, 4, 2, 1);
    assert_ok(weft_image_init(&albedo, 500, 400, 3, err));
    for (int i = 0; i < 500 * 400; i++) {
        weft_image_plane(&normal, 0)[i] += (float)(0.05 * weft_test_gauss(&random));
        for (int c = 0; c < 3; c++)
            weft_image_plane(&albedo, c)[i] =
                (float)(0.3 + 0.0004 * (i % 500) + 0.02 * weft_test_gauss(&random));
    }
    assert_ok(weft_weave_find(&normal, &albedo, &found, err));
    print_message("repeat %d x %d, likeness %.2f %.2f\n", found.threads[0], found.threads[1],
                  found.likeness[0], found.likeness[1]);
    const weft_image *const planes[2] = {&normal, &albedo};
    assert_ok(weft_weave_cut(planes, 2, &found, tiles, &seam, err));
    print_message(
        "%d x %d threads in %d x %d: step over the seam %.3f %.3f, inside %.3f %.3f, repetition %.3f\n",
        seam.threads[0], seam.threads[1], tiles[0].width, tiles[0].height, seam.across[0], seam.across[1],
        seam.inside[0], seam.inside[1], seam.repetition);
    for (int c = 0; c < 2; c++) {
        assert_int_equal(seam.threads[c] % 4, 0);
        assert_true(seam.across[c] < 1.15 * seam.inside[c]);
    }
    assert_near(tiles[0].width, seam.threads[0] * hypot(8.13, 0.1), 1);
    assert_true(seam.repetition > 0.02); /* the ramp in the albedo shows */
    for (int k = 0; k < 2; k++)
        weft_image_fini(&tiles[k]);
    weft_image_fini(&normal);
    weft_image_fini(&albedo);

    weft_weave_fini(&found);

    make(&normal, 60, 60, step, 5, 4, 2); /* not two repeats of 41 x 47 pixels */
    found.threads[0] = found.threads[1] = 5;
    assert_fails(weft_weave_cut(planes, 1, &found, tiles, &seam, err), WEFT_ERR_NODATA,
                 "less than two repeats");
    weft_image_fini(&normal);
}

static void check_no_weave(void **state)
{
    (void)state;
    const weft_image none = {0};
    weft_image normal;
    weft_weave found;
    uint64_t random = 4;
    assert_ok(weft_image_init(&normal, 200, 200, 3, err));
    for (int i = 0; i < 200 * 200; i++) {
        weft_image_plane(&normal, 0)[i] = (float)(0.1 * weft_test_gauss(&random));
        weft_image_plane(&normal, 1)[i] = (float)(0.1 * weft_test_gauss(&random));
        weft_image_plane(&normal, 2)[i] = 1;
    }
    assert_fails(weft_weave_find(&normal, &none, &found, err), WEFT_ERR_NODATA, "no threads are seen");
    weft_image_fini(&normal);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(check_repeats),
        cmocka_unit_test(check_cut),
        cmocka_unit_test(check_no_weave),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
