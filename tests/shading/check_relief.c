/* Occlusion against rays that are cast through the field, curvature and cavity of known surfaces. */
#include "tests/support/support.h"

#include "shading/bake/relief.h"

#include <math.h>
#include <stdlib.h>

static const double pi = 3.14159265358979323846;

enum { N = 64, RAYS = 1024, REACH = 24 };

/* Crossing yarns over 16 texels, in mm at 0.1 mm a texel, and a groove; repeats every 64 texels. */
static double relief(double x, double y)
{
    const double warp = 0.25 * sin(2 * pi * x / 16) * cos(2 * pi * y / 16);
    return warp - 1.2 * exp(-0.02 * (x - 40.5) * (x - 40.5));
}

static double sampled(const weft_image *h, double x, double y)
{
    const double fx = floor(x), fy = floor(y), s = x - fx, t = y - fy;
    const int x0 = ((int)fx % N + N) % N, y0 = ((int)fy % N + N) % N, x1 = (x0 + 1) % N, y1 = (y0 + 1) % N;
    const double a = (double)h->data[y0 * N + x0], b = (double)h->data[y0 * N + x1];
    const double c = (double)h->data[y1 * N + x0], d = (double)h->data[y1 * N + x1];
    return (1 - t) * (a + s * (b - a)) + t * (c + s * (d - c));
}

/* Cosine-weighted rays about the normal, marched in quarter texels: the share that leaves, and whither. */
static double cast(const weft_image *h, const double n[3], int px, int py, double scale, double open[3])
{
    uint64_t random = (uint64_t)py * N + (uint64_t)px + 1;
    int escaped = 0;
    open[0] = open[1] = open[2] = 0;
    for (int k = 0; k < RAYS; k++) {
        const double u = (k + weft_test_random(&random)) / RAYS, phi = 2 * pi * weft_test_random(&random);
        const double r = sqrt(u), z = sqrt(1 - u);
        const double t[3] = {n[2], 0, -n[0]}, tl = sqrt(n[2] * n[2] + n[0] * n[0]);
        const double tx[3] = {t[0] / tl, 0, t[2] / tl};
        const double b[3] = {n[1] * tx[2], n[2] * tx[0] - n[0] * tx[2], -n[1] * tx[0]};
        double d[3];
        for (int c = 0; c < 3; c++)
            d[c] = r * cos(phi) * tx[c] + r * sin(phi) * b[c] + z * n[c];
        const double flat = hypot(d[0], d[1]);
        bool hit = false;
        for (double s = 0.5; flat > 1e-6 && s < REACH && !hit; s += 0.25)
            hit = sampled(h, px + s * d[0] / flat, py - s * d[1] / flat) * scale >
                  (double)h->data[py * N + px] * scale + s * d[2] / flat + 1e-9;
        if (hit)
            continue;
        escaped++;
        for (int c = 0; c < 3; c++)
            open[c] += d[c];
    }
    const double length = sqrt(open[0] * open[0] + open[1] * open[1] + open[2] * open[2]);
    for (int c = 0; c < 3; c++)
        open[c] /= length > 0 ? length : 1;
    return (double)escaped / RAYS;
}

static void check_occlusion_against_rays(void **state)
{
    (void)state;
    weft_image height, normal, occlusion, cone;
    const double mm = 0.1;
    assert_ok(weft_image_init(&height, N, N, 1, err));
    assert_ok(weft_image_init(&normal, N, N, 3, err));
    for (int y = 0; y < N; y++)
        for (int x = 0; x < N; x++) {
            const double e = 1e-4, a = -(relief(x + e, y) - relief(x - e, y)) / (2 * e * mm);
            const double b = (relief(x, y + e) - relief(x, y - e)) / (2 * e * mm),
                         l = sqrt(a * a + b * b + 1);
            height.data[y * N + x] = (float)relief(x, y);
            weft_image_row(&normal, 0, y)[x] = (float)(a / l);
            weft_image_row(&normal, 1, y)[x] = (float)(b / l);
            weft_image_row(&normal, 2, y)[x] = (float)(1 / l);
        }
    weft_relief_options options = weft_relief_defaults(mm);
    options.reach_mm = REACH * mm;
    options.periodic = true;
    assert_ok(weft_relief_occlusion(&height, &normal, &options, &occlusion, &cone, err));
    double sum = 0, worst = 0, turned = 0, least = 1;
    int n = 0;
    for (int y = 0; y < N; y += 3)
        for (int x = 0; x < N; x += 3, n++) {
            double normal_here[3], open[3];
            for (int c = 0; c < 3; c++)
                normal_here[c] = (double)weft_image_row(&normal, c, y)[x];
            const double truth = cast(&height, normal_here, x, y, 1 / mm, open);
            const double error = fabs((double)weft_image_row(&occlusion, 0, y)[x] - truth);
            double along = 0;
            for (int c = 0; c < 3; c++)
                along += open[c] * (double)weft_image_row(&cone, c, y)[x];
            sum += error;
            worst = fmax(worst, error);
            least = fmin(least, truth);
            turned += acos(fmin(along, 1)) * 180 / pi;
        }
    print_message(
        "occlusion against rays: mean %.4f, worst %.3f (darkest %.2f); bent direction off by %.2f deg\n",
        sum / n, worst, least, turned / n);
    assert_true(least < 0.5); /* the field is a hard one */
    assert_true(sum / n < 0.02);
    assert_true(turned / n < 3);
    weft_image_fini(&height);
    weft_image_fini(&normal);
    weft_image_fini(&occlusion);
    weft_image_fini(&cone);
}

static void check_slope_is_open(void **state)
{
    (void)state;
    weft_image height, occlusion, cone;
    assert_ok(weft_image_init(&height, N, N, 1, err));
    for (int i = 0; i < N * N; i++)
        height.data[i] = (float)(0.05 * (i % N)); /* 45 degrees at 0.05 mm a texel */
    weft_relief_options options = weft_relief_defaults(0.05);
    assert_ok(weft_relief_occlusion(&height, NULL, &options, &occlusion, &cone, err));
    for (int i = 0; i < N * N; i++)
        assert_near((double)occlusion.data[i], 1, 2e-5);
    const double half = sqrt(0.5);
    assert_near((double)weft_image_row(&cone, 0, 32)[32], -half, 0.02);
    assert_near((double)weft_image_row(&cone, 2, 32)[32], half, 0.02);
    weft_image_fini(&height);
    weft_image_fini(&occlusion);
    weft_image_fini(&cone);
}

static void check_curvature_of_a_dome(void **state)
{
    (void)state;
    weft_image normal, curvature;
    const double mm = 0.1, per_mm = 0.05;
    assert_ok(weft_image_init(&normal, N, N, 3, err));
    for (int y = 0; y < N; y++)
        for (int x = 0; x < N; x++) { /* z = -k/2 (x^2 + y^2): x/z of the normal is k x */
            const double a = per_mm * (x - 32) * mm, b = -per_mm * (y - 32) * mm, l = sqrt(a * a + b * b + 1);
            weft_image_row(&normal, 0, y)[x] = (float)(a / l);
            weft_image_row(&normal, 1, y)[x] = (float)(b / l);
            weft_image_row(&normal, 2, y)[x] = (float)(1 / l);
        }
    assert_ok(weft_relief_curvature(&normal, mm, false, &curvature, err));
    for (int i = 0; i < N * N; i++)
        assert_near((double)curvature.data[i], per_mm, 1e-4);
    weft_image_fini(&normal);
    weft_image_fini(&curvature);
}

static void check_cavity_of_a_groove(void **state)
{
    (void)state;
    weft_image height, cavity;
    assert_ok(weft_image_init(&height, N, N, 1, err));
    assert_ok(weft_relief_cavity(&height, 0.1, 0.5, true, &cavity, err));
    for (int i = 0; i < N * N; i++)
        assert_near((double)cavity.data[i], 0.5, 0); /* flat */
    weft_image_fini(&cavity);
    for (int i = 0; i < N * N; i++)
        height.data[i] = i % N == 20 ? -1 : 0;
    assert_ok(weft_relief_cavity(&height, 0.1, 0.5, true, &cavity, err));
    for (int y = 0; y < N; y++) {
        assert_near((double)weft_image_row(&cavity, 0, y)[20], 0, 1e-6);
        assert_true(weft_image_row(&cavity, 0, y)[22] > 0.5F); /* its rim stands above the mean */
        assert_near((double)weft_image_row(&cavity, 0, y)[50], 0.5, 1e-3);
    }
    weft_image_fini(&height);
    weft_image_fini(&cavity);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(check_occlusion_against_rays),
        cmocka_unit_test(check_slope_is_open),
        cmocka_unit_test(check_curvature_of_a_dome),
        cmocka_unit_test(check_cavity_of_a_groove),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
