/* Height from normals against surfaces given by formulas: what comes back, from 8, 16 bits and exact. */
#include "tests/support/support.h"

#include "shading/bake/height_poisson.h"

#include <math.h>

static const double pi = 3.14159265358979323846;

typedef struct surface {
    double height, dx, dy; /* mm, and its slopes right and down, per texel */
} surface;

/* A plain weave of 16 x 12 texels, and a drape; without `periodic` also a slope and a bend of no period. */
static surface weave(double x, double y, int n, bool periodic)
{
    const double u = 2 * pi / 16, v = 2 * pi / 12.8, k = 2 * pi / n;
    surface s = {
        0.15 * sin(u * x) * cos(v * y) + 2 * cos(k * x + 1) * sin(k * y),
        0.15 * u * cos(u * x) * cos(v * y) - 2 * k * sin(k * x + 1) * sin(k * y),
        -0.15 * v * sin(u * x) * sin(v * y) + 2 * k * cos(k * x + 1) * cos(k * y),
    };
    if (!periodic) {
        const double q = 3e-5;
        s.height += 0.01 * x - 0.004 * y + q * x * x + q * x * y;
        s.dx += 0.01 + 2 * q * x + q * y;
        s.dy += -0.004 + q * x;
    }
    return s;
}

static double quantise(double value, int bits)
{
    if (bits == 0)
        return value;
    const double top = ldexp(1, bits) - 1;
    return 2 * (floor((0.5 + 0.5 * value) * top + 0.5) / top) - 1;
}

/* Relative rms of the height that comes back from a map of so many bits (0: exact). */
static double error_of(int n, bool periodic, int bits, const float *weight, const uint8_t *hidden)
{
    const double mm_per_px = 0.25;
    weft_image normal, height;
    weft_height_info info;
    assert_ok(weft_image_init(&normal, n, n, 3, err));
    for (int y = 0; y < n; y++)
        for (int x = 0; x < n; x++) {
            const surface s = weave(x, y, n, periodic);
            const double a = -s.dx / mm_per_px, b = s.dy / mm_per_px, length = sqrt(a * a + b * b + 1);
            const double unit[3] = {a / length, b / length, 1 / length};
            for (int c = 0; c < 3; c++)
                weft_image_row(&normal, c, y)[x] =
                    hidden && hidden[y * n + x] ? 0 : (float)quantise(unit[c], bits);
        }
    assert_ok(weft_height_integrate(&normal, weight, mm_per_px, periodic, &height, &info, err));
    double mean = 0, squares = 0, all = 0;
    for (int y = 0; y < n; y++)
        for (int x = 0; x < n; x++)
            mean += weave(x, y, n, periodic).height / ((double)n * n);
    for (int y = 0; y < n; y++)
        for (int x = 0; x < n; x++) {
            const double truth = weave(x, y, n, periodic).height - mean;
            const double d = (double)weft_image_row(&height, 0, y)[x] - truth;
            squares += d * d;
            all += truth * truth;
        }
    weft_image_fini(&normal);
    weft_image_fini(&height);
    print_message("%d x %d %s, %d bits%s: relative rms %.2e, %d rounds, misfit %.1e\n", n, n,
                  periodic ? "periodic" : "open", bits, hidden ? ", holes" : "", sqrt(squares / all),
                  info.rounds, info.misfit);
    return sqrt(squares / all);
}

static void check_maps_of_bits(void **state)
{
    (void)state;
    for (int periodic = 0; periodic < 2; periodic++) {
        assert_true(error_of(512, periodic, 0, NULL, NULL) < 5e-6);
        assert_true(error_of(512, periodic, 8, NULL, NULL) < 1e-3);
        assert_true(error_of(512, periodic, 16, NULL, NULL) < 1e-5);
    }
}

/* Texels without a normal are bridged, and cost no more than what they hide. */
static void check_holes(void **state)
{
    (void)state;
    enum { N = 128 };
    static uint8_t hidden[N * N];
    uint64_t random = 3;
    for (int k = 0; k < 40; k++) {
        const int x = (int)(weft_test_random(&random) * (N - 3)),
                  y = (int)(weft_test_random(&random) * (N - 3));
        for (int i = 0; i < 9; i++)
            hidden[(y + i / 3) * N + x + i % 3] = 1;
    }
    assert_true(error_of(N, true, 0, NULL, hidden) < 0.02);
    assert_true(error_of(N, false, 0, NULL, hidden) < 0.02);
}

/* A texel of little weight that says nonsense moves nothing. */
static void check_weights(void **state)
{
    (void)state;
    enum { N = 64 };
    static float weight[N * N];
    weft_image normal, height[2];
    assert_ok(weft_image_init(&normal, N, N, 3, err));
    for (int i = 0; i < N * N; i++) {
        weft_image_plane(&normal, 2)[i] = 1;
        weight[i] = 1;
    }
    for (int y = 20; y < 30; y++)
        for (int x = 20; x < 30; x++) {
            weft_image_row(&normal, 0, y)[x] = -1; /* a ramp of 45 degrees from nowhere */
            weight[y * N + x] = 0;
        }
    assert_ok(weft_height_integrate(&normal, NULL, 1, false, &height[0], NULL, err));
    assert_ok(weft_height_integrate(&normal, weight, 1, false, &height[1], NULL, err));
    double highest[2] = {0, 0};
    for (int k = 0; k < 2; k++)
        for (int i = 0; i < N * N; i++)
            highest[k] = fmax(highest[k], fabs((double)height[k].data[i]));
    assert_true(highest[0] > 1);
    assert_true(highest[1] < 0.02);
    weft_image_fini(&normal);
    weft_image_fini(&height[0]);
    weft_image_fini(&height[1]);
}

static void check_small_and_empty(void **state)
{
    (void)state;
    weft_image normal, height;
    static const int sizes[][2] = {{1, 1}, {2, 1}, {1, 7}, {5, 3}, {13, 2}};
    for (size_t k = 0; k < sizeof sizes / sizeof sizes[0]; k++)
        for (int periodic = 0; periodic < 2; periodic++) {
            const int w = sizes[k][0], h = sizes[k][1];
            assert_ok(weft_image_init(&normal, w, h, 3, err));
            assert_fails(weft_height_integrate(&normal, NULL, 1, periodic, &height, NULL, err),
                         WEFT_ERR_NODATA, "no texel has a normal");
            for (int i = 0; i < w * h; i++) {
                weft_image_plane(&normal, 0)[i] = periodic ? 0 : -0.6F;
                weft_image_plane(&normal, 2)[i] = 0.8F;
            }
            assert_ok(weft_height_integrate(&normal, NULL, 2, periodic, &height, NULL, err));
            for (int x = 0; x < w; x++) /* a slope of 3/4 over 2 mm, about its mean */
                assert_near((double)height.data[x], periodic ? 0 : 1.5 * (x - 0.5 * (w - 1)), 1e-5);
            weft_image_fini(&normal);
            weft_image_fini(&height);
        }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(check_maps_of_bits),
        cmocka_unit_test(check_holes),
        cmocka_unit_test(check_weights),
        cmocka_unit_test(check_small_and_empty),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
