/* The transforms against their sums, written out. */
#include "tests/support/support.h"

#include "core/fourier.h"
#include "core/parallel.h"

#include <math.h>
#include <string.h>

static const double pi = 3.14159265358979323846;

static double basis(weft_fourier_kind kind, int n, int k, int x)
{
    if (kind == WEFT_FOURIER_COSINE)
        return sqrt((k ? 2.0 : 1.0) / n) * cos(pi * k * (2 * x + 1) / (2.0 * n));
    return sqrt(1.0 / n) * (cos(2 * pi * k * x / n) + sin(2 * pi * k * x / n));
}

static void check_size(weft_fourier_kind kind, int w, int h)
{
    float plane[64 * 64], original[64 * 64];
    uint64_t random = (uint64_t)w * 100 + (uint64_t)h;
    for (int i = 0; i < w * h; i++)
        plane[i] = original[i] = (float)weft_test_gauss(&random);
    weft_fourier *fourier;
    assert_ok(weft_fourier_create(w, h, kind, &fourier, err));
    weft_fourier_forward(fourier, plane);
    for (int v = 0; v < h; v++)
        for (int u = 0; u < w; u++) {
            double sum = 0;
            for (int y = 0; y < h; y++)
                for (int x = 0; x < w; x++)
                    sum += (double)original[y * w + x] * basis(kind, w, u, x) * basis(kind, h, v, y);
            assert_near((double)plane[v * w + u], sum, 1e-5);
        }
    weft_fourier_inverse(fourier, plane);
    for (int i = 0; i < w * h; i++)
        assert_near((double)plane[i], (double)original[i], 1e-5);
    weft_fourier_destroy(fourier);
}

static void check_against_sums(void **state)
{
    (void)state;
    static const int sizes[][2] = {{1, 1}, {2, 1}, {1, 5}, {8, 8}, {17, 6}, {33, 20}, {35, 37}};
    for (size_t i = 0; i < sizeof sizes / sizeof sizes[0]; i++) {
        check_size(WEFT_FOURIER_COSINE, sizes[i][0], sizes[i][1]);
        check_size(WEFT_FOURIER_HARTLEY, sizes[i][0], sizes[i][1]);
    }
}

/* The factor of the second difference, on each vector of the basis. */
static void check_difference(void **state)
{
    (void)state;
    enum { N = 12 };
    for (int kind = 0; kind < 2; kind++)
        for (int k = 0; k < N; k++)
            for (int x = 0; x < N; x++) {
                const bool repeats = kind == WEFT_FOURIER_HARTLEY;
                const double here = basis((weft_fourier_kind)kind, N, k, x);
                const double left = x > 0     ? basis((weft_fourier_kind)kind, N, k, x - 1)
                                    : repeats ? basis((weft_fourier_kind)kind, N, k, N - 1)
                                              : here;
                const double right = x + 1 < N ? basis((weft_fourier_kind)kind, N, k, x + 1)
                                     : repeats ? basis((weft_fourier_kind)kind, N, k, 0)
                                               : here;
                assert_near(2 * here - left - right,
                            here * weft_fourier_difference((weft_fourier_kind)kind, N, k), 1e-12);
            }
}

static void check_threads_give_the_same_bits(void **state)
{
    (void)state;
    enum { W = 96, H = 70 };
    static float one[W * H], two[W * H];
    uint64_t random = 5;
    for (int i = 0; i < W * H; i++)
        one[i] = two[i] = (float)weft_test_gauss(&random);
    weft_fourier *fourier;
    assert_ok(weft_fourier_create(W, H, WEFT_FOURIER_COSINE, &fourier, err));
    weft_parallel_set_threads(1);
    weft_fourier_forward(fourier, one);
    weft_parallel_set_threads(3);
    weft_fourier_forward(fourier, two);
    weft_parallel_set_threads(0);
    assert_memory_equal(one, two, sizeof one);
    weft_fourier_destroy(fourier);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(check_against_sums),
        cmocka_unit_test(check_difference),
        cmocka_unit_test(check_threads_give_the_same_bits),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
