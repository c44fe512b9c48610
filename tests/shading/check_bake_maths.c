/* Filtering of gloss and normals, height, horizons and skin against printed tables and plain integrals. */
#include "tests/support/support.h"

#include "shading/bake/gloss.h"
#include "shading/bake/height.h"
#include "shading/bake/horizon.h"
#include "shading/bake/normal_filter.h"
#include "shading/bake/vmf.h"
#include "shading/brdf/half_vector.h"
#include "shading/lighting/spherical_harmonics.h"
#include "shading/skin/skin.h"

#include <string.h>

#define SEED 20261125u

static double between(uint64_t *random, double min, double max)
{
    return min + (max - min) * weft_test_random(random);
}

/* The deck's table was averaged from random normals: 4e-6 is its own noise. */
static void test_lengths_are_those_of_the_printed_table(void **state)
{
    (void)state;
    static const double printed[][2] = {{0, 0.666670},   {1, 0.669966},   {2, 0.673329},   {3, 0.676758},
                                        {252, 0.999952}, {253, 0.999954}, {254, 0.999956}, {255, 0.999958}};
    for (size_t i = 0; i < sizeof printed / sizeof printed[0]; i++) {
        const double gloss = printed[i][0] / 255;
        assert_near(1 - weft_gloss_missing_length(gloss), printed[i][1], 4e-6);
        assert_near(weft_gloss_of_missing_length(weft_gloss_missing_length(gloss)), gloss, 1e-12);
        assert_near(weft_gloss_of_alpha(weft_gloss_alpha(gloss)), gloss, 1e-14);
    }
    assert_near(weft_gloss_combine(0.5, 1), 0.49957, 5e-6); /* S-COD-08 */
    assert_near(weft_gloss_combine(1, 1), 0.93877, 5e-6);
    assert_near(weft_gloss_of_missing_length(0), 1, 0);
    assert_near(weft_gloss_of_missing_length(1), 0, 0);
}

static void test_closed_form_of_the_length(void **state)
{
    (void)state;
    enum { N = 200000 };
    static const double alphas[] = {0.2, 0.4, 0.88, 0.9, 1, 1.09, 1.11, 2};
    for (size_t k = 0; k < sizeof alphas / sizeof alphas[0]; k++) {
        const double a2 = alphas[k] * alphas[k];
        double sum = 0; /* 2 alpha^2 integral of c^2/((alpha^2 - 1) c^2 + 1)^2 */
        for (int i = 0; i < N; i++) {
            const double c = (i + 0.5) / N, t = (a2 - 1) * c * c + 1;
            sum += 2 * a2 * c * c / (t * t) / N;
        }
        assert_near(1 - weft_ggx_missing_length(alphas[k]), sum, 1e-7);
    }
    assert_near(weft_ggx_missing_length(1e-9), 1e-18 * (log(2e9) - 1), 1e-30); /* alpha to 0, S-COD-03 */
    assert_near(weft_ggx_missing_length(0), 0, 0);
}

static void test_filtering_texels(void **state)
{
    (void)state;
    const weft_gloss_texel same = {{0.6, 0, 0.8}, 0.7, 0};
    const weft_gloss_texel constant[] = {same, same, same}, opposite[] = {same, {{-0.6, 0, -0.8}, 0.7, 0}};
    const weft_gloss_texel spread[] = {same, {{-0.6, 0, 0.8}, 0.9, 0}};
    const double sharpening[] = {1.7, -0.5, -0.2};
    weft_gloss_texel t = weft_gloss_filter(3, constant, NULL);
    assert_near(t.gloss, 0.7, 1e-10);
    assert_near(t.normal[0], 0.6, 1e-14);
    t = weft_gloss_filter(2, opposite, NULL);
    assert_near(t.gloss, 0, 0);
    assert_near(t.normal[2], 1, 0);
    t = weft_gloss_filter(2, spread, NULL);
    assert_true(t.gloss < 0.3 && t.normal[2] > 0.99);
    const weft_gloss_texel bent[] = {{{0, 0, 1}, 1, 0}, {{1, 0, 0}, 1, 0}, {{-1, 0, 0}, 1, 0}};
    t = weft_gloss_filter(3, bent, sharpening); /* longer than any normal may be */
    assert_near(t.gloss, 1, 0);
}

static void test_vmf(void **state)
{
    (void)state;
    enum { N = 100000 };
    static const double kappas[] = {0, 0.1, 3, 200}, at_ten[] = {1, 0.9000, 0.7300, 0.5350, 0.3555};
    for (int k = 0; k < 4; k++) {
        double sum = 0, mean = 0;
        for (int i = 0; i < N; i++) {
            const double c = -1 + 2 * (i + 0.5) / N, p = 4 * WEFT_PI / N * weft_vmf_density(kappas[k], c);
            sum += p;
            mean += p * c;
        }
        assert_near(sum, 1, 1e-5);
        assert_near(mean, weft_vmf_coefficient(kappas[k], 1), 1e-5);
    }
    for (int l = 0; l < 5; l++)
        assert_near(weft_vmf_coefficient(10, l), at_ten[l], 5e-5); /* S-ORD-20 */
    for (double kappa = 0.01; kappa < 1e5; kappa *= 1.7) {
        const double length = weft_vmf_coefficient(kappa, 1);
        assert_near(weft_vmf_kappa_exact(length) / kappa, 1, 1e-15 * kappa + 1e-12);
        assert_near(weft_vmf_kappa(length) / kappa, 1.0247, 0.0248); /* high by 0 to 4.94 % (S-ORD-21) */
    }
    assert_true(isinf(weft_vmf_kappa(1.0000001)) && isinf(weft_vmf_kappa_exact(1)));
    assert_near(weft_vmf_kappa_exact(0), 0, 0);
    assert_near(weft_vmf_roughness(0.1, HUGE_VAL, WEFT_VMF_LISTING), 0.1,
                1e-16); /* a flat mirror stays one */
}

static void test_toksvig(void **state)
{
    (void)state;
    for (double length = 0.05; length <= 1; length += 0.05) /* 1/m' = 1/m + (1 - |n|)/|n| */
        assert_near(1 / (weft_toksvig_factor(length, 300) * 300), 1 / 300.0 + (1 - length) / length, 1e-12);
    assert_near(weft_toksvig_factor(0, 0), 0, 0);
    assert_near(weft_blinn_phong_gloss(0), 0, 0);
}

/* The detail is turned as a whole: lengths and angles stay, z goes to the base. */
static void test_reoriented_normals(void **state)
{
    (void)state;
    uint64_t random = SEED;
    const double up[3] = {0, 0, 1}, down[3] = {0, 0, -1};
    for (int i = 0; i < 200; i++) {
        double b[3], d[3], r[3];
        const double pb = between(&random, 0, 7), pd = between(&random, 0, 7), cb = between(&random, -0.9, 1);
        const double cd = between(&random, 0, 1), sb = sqrt(1 - cb * cb), sd = sqrt(1 - cd * cd);
        memcpy(b, (double[]){sb * cos(pb), sb * sin(pb), cb}, sizeof b);
        memcpy(d, (double[]){sd * cos(pd), sd * sin(pd), cd}, sizeof d);
        weft_normal_reorient(b, d, r);
        assert_near(r[0] * r[0] + r[1] * r[1] + r[2] * r[2], 1, 1e-13);
        assert_near(r[0] * b[0] + r[1] * b[1] + r[2] * b[2], d[2], 1e-13);
        weft_normal_reorient(up, d, r);
        assert_near(r[0], d[0], 1e-15);
        weft_normal_reorient(down, d, r);
        assert_true(isfinite(r[0] + r[1] + r[2]));
    }
}

enum { MOST = 96 * 64 };

static void slopes_of(int w, int h, const double *height, double *dx, double *dy)
{
    for (int y = 0; y < h; y++)
        for (int x = 0; x < w; x++) {
            dx[y * w + x] = height[y * w + (x + 1) % w] - height[y * w + x];
            dy[y * w + x] = height[(y + 1) % h * w + x] - height[y * w + x];
        }
}

static void test_height_comes_back(void **state)
{
    (void)state;
    static const int sizes[][2] = {{1, 1}, {1, 8}, {2, 2}, {12, 12}, {20, 33}, {31, 17}, {96, 64}};
    static double truth[MOST], dx[MOST], dy[MOST], height[MOST];
    uint64_t random = SEED;
    for (size_t k = 0; k < sizeof sizes / sizeof sizes[0]; k++) {
        const int w = sizes[k][0], h = sizes[k][1], n = w * h;
        double mean = 0;
        for (int i = 0; i < n; i++) {
            truth[i] = between(&random, -1, 1) + 5 * sin(2 * WEFT_PI * (i % w) / w);
            mean += truth[i] / n;
        }
        slopes_of(w, h, truth, dx, dy);
        assert_ok(weft_height_from_slopes(w, h, dx, dy, 1e-11, height, err));
        for (int i = 0; i < n; i++)
            assert_near(height[i], truth[i] - mean, 1e-9);
    }
}

/* Slopes of no surface: each height is then the mean of what its neighbours say (the minus signs, S-COD-10).
 */
static void test_height_is_the_least_squares_one(void **state)
{
    (void)state;
    enum { W = 24, H = 16 };
    double dx[W * H], dy[W * H], z[W * H];
    uint64_t random = SEED;
    for (int i = 0; i < W * H; i++) {
        dx[i] = between(&random, -1, 1);
        dy[i] = between(&random, -1, 1);
    }
    assert_ok(weft_height_from_slopes(W, H, dx, dy, 1e-12, z, err));
    for (int y = 0; y < H; y++)
        for (int x = 0; x < W; x++) {
            const int i = y * W + x, left = y * W + (x + W - 1) % W, right = y * W + (x + 1) % W;
            const int above = (y + H - 1) % H * W + x, below = (y + 1) % H * W + x;
            assert_near(z[i],
                        (z[left] + dx[left] + z[right] - dx[i] + z[above] + dy[above] + z[below] - dy[i]) / 4,
                        1e-10);
        }
    dx[5] = (double)NAN;
    z[0] = -7;
    assert_fails(weft_height_from_slopes(W, H, dx, dy, 1e-12, z, err), WEFT_ERR_FORMAT, "x 5, y 0");
    assert_near(z[0], -7, 0);
    assert_near(weft_height_slope(0.5, 0), -WEFT_HEIGHT_MAX_SLOPE, 0);
    assert_near(weft_height_slope(-0.6, 0.8), 0.75, 1e-15);
}

static weft_horizon_arc open_field(void *context, double phi_rad)
{
    (void)context;
    (void)phi_rad;
    return (weft_horizon_arc){-WEFT_PI / 2, WEFT_PI / 2};
}

static void test_horizons(void **state)
{
    (void)state;
    enum { N = 100000 };
    uint64_t random = SEED;
    for (int k = 0; k < 10; k++) { /* the arc against its integral */
        const double gamma = between(&random, -1.4, 1.4);
        const weft_horizon_arc arc = weft_horizon_clamp(
            (weft_horizon_arc){between(&random, -WEFT_PI / 2, 0), between(&random, 0, WEFT_PI / 2)}, gamma);
        double sum = 0;
        for (int i = 0; i < N; i++) {
            const double t = arc.h1_rad + (arc.h2_rad - arc.h1_rad) * (i + 0.5) / N;
            sum += fmax(cos(t - gamma), 0) * fabs(sin(t)) * (arc.h2_rad - arc.h1_rad) / N;
        }
        assert_near(weft_horizon_visibility(arc, gamma), sum, 1e-8);
    }
    static const double tilts[][2] = {{0, 1}, {0.3, 0.97767}, {0.8, 0.84835}}; /* (1 + cos t)/2, S-COD-12 */
    for (int i = 0; i < 3; i++) {
        const double n[3] = {sin(tilts[i][0]), 0, cos(tilts[i][0])};
        assert_near(weft_horizon_occlusion(open_field, NULL, n, 200), tilts[i][1], 1e-5);
    }
}

static void test_skin(void **state)
{
    (void)state;
    enum { N = 200000 };
    double sum[3] = {0}, rgb[3], zonal[3][3];
    for (int i = 0; i < N; i++) { /* over the plane, to 20 mm */
        const double d = 20 * (i + 0.5) / N;
        weft_skin_reflectance(WEFT_SKIN_RADIAL, d, rgb);
        for (int c = 0; c < 3; c++)
            sum[c] += rgb[c] * 2 * WEFT_PI * d * 20 / N;
    }
    for (int c = 0; c < 3; c++)
        assert_near(sum[c], 1, 1e-6);
    static const double at_8_mm[] = {0.9932661, 0.9839966, 0.9792657}; /* S-ORD-10, red */
    for (int p = 0; p < 3; p++) {
        weft_skin_transfer((weft_skin_profile)p, 0.1, 8, rgb);
        assert_near(rgb[0], at_8_mm[p], 6e-8);
    }
    weft_skin_transfer(WEFT_SKIN_WIDE, 0.1, 15, rgb); /* a public worksheet of the technique */
    assert_near(rgb[0], 0.990641, 6e-7);
    weft_skin_transfer(WEFT_SKIN_RADIAL, 0.8, 1e4, rgb); /* flat: the cosine */
    assert_near(rgb[0], cos(0.8), 1e-6);
    weft_skin_transfer(WEFT_SKIN_RADIAL, 2, 1e-3, rgb); /* a pin: the mean of the clamped cosine */
    assert_near(rgb[0], 1 / WEFT_PI, 1e-4);
    weft_skin_zonal(WEFT_SKIN_RADIAL, 1, WEFT_PI, zonal); /* S-ORD-12, an independent quadrature */
    assert_near(zonal[0][0], 0.92083977900, 1e-10);
    assert_near(zonal[1][0], 0.93741364030, 1e-10);
    assert_near(zonal[2][0], 0.41899211586, 1e-10);
    weft_skin_zonal(WEFT_SKIN_RADIAL, 1e4, WEFT_PI, zonal);
    for (int l = 0; l < 3; l++)
        assert_near(zonal[l][2], weft_sh_cosine[l], 1e-6);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_lengths_are_those_of_the_printed_table),
        cmocka_unit_test(test_closed_form_of_the_length),
        cmocka_unit_test(test_filtering_texels),
        cmocka_unit_test(test_vmf),
        cmocka_unit_test(test_toksvig),
        cmocka_unit_test(test_reoriented_normals),
        cmocka_unit_test(test_height_comes_back),
        cmocka_unit_test(test_height_is_the_least_squares_one),
        cmocka_unit_test(test_horizons),
        cmocka_unit_test(test_skin),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
