/* UASTC blocks: what comes back, in numbers; the independent decoder is that of cli_exports
 * (basis_transcoder). */
#include "tests/support/support.h"

#include "shading/export/uastc.h"

#include <math.h>
#include <string.h>

static double psnr(uint8_t (*make)(uint64_t *random, int block, int i, int c), int n, bool has_alpha)
{
    uint64_t random = 3;
    double sum = 0;
    const int components = has_alpha ? 4 : 3;
    for (int b = 0; b < n; b++) {
        uint8_t in[16][4], block[16], out[16][4];
        for (int i = 0; i < 16; i++)
            for (int c = 0; c < 4; c++)
                in[i][c] = make(&random, b, i, c);
        weft_uastc_encode((const uint8_t(*)[4])in, has_alpha, block);
        assert_true(weft_uastc_decode(block, out));
        for (int i = 0; i < 16; i++)
            for (int c = 0; c < components; c++)
                sum += (in[i][c] - out[i][c]) * (in[i][c] - out[i][c]);
        if (!has_alpha)
            assert_int_equal(out[5][3], 255);
    }
    return 10 * log10(255.0 * 255.0 / fmax(sum / (16.0 * components * n), 1e-9));
}

static uint8_t solid(uint64_t *random, int block, int i, int c)
{
    (void)random, (void)i;
    return (uint8_t)(block * (37 + 20 * c));
}

/* Every component along one line: what a block of one subset is made for. */
static uint8_t line(uint64_t *random, int block, int i, int c)
{
    static double t;
    if (c == 0)
        t = weft_test_random(random);
    (void)i;
    return (uint8_t)(60 + (block * (17 + c) % 120) * t + 20 * c);
}

/* Roughness and occlusion have nothing to do with each other; blue is 0. */
static uint8_t two_planes(uint64_t *random, int block, int i, int c)
{
    (void)block, (void)i;
    return (uint8_t)(c == 2 ? 0 : c == 3 ? 255 : 100 + 40 * weft_test_random(random));
}

static uint8_t noise(uint64_t *random, int block, int i, int c)
{
    (void)block, (void)i, (void)c;
    return (uint8_t)(256 * weft_test_random(random));
}

/* Floors from the format: half a step of 16 or 32 weights over the line's length; 4 weights in each of two
 * planes. */
static void check_quality(void **state)
{
    (void)state;
    const double of[] = {psnr(solid, 256, false), psnr(solid, 256, true),        psnr(line, 4000, false),
                         psnr(line, 4000, true),  psnr(two_planes, 4000, false), psnr(noise, 2000, false),
                         psnr(noise, 2000, true)};
    print_message(
        "  psnr dB: solid %.0f %.0f, line %.1f, with alpha %.1f, two planes %.1f, noise %.1f %.1f\n", of[0],
        of[1], of[2], of[3], of[4], of[5], of[6]);
    assert_true(of[0] > 100 && of[1] > 100); /* exact */
    assert_true(of[2] > 45 && of[3] > 42);
    assert_true(of[4] > 36);
    assert_true(of[5] > 12 && of[6] > 10);
}

/* Every code of every block decodes, and only modes that are written are taken. */
static void check_any_block(void **state)
{
    (void)state;
    uint64_t random = 9;
    int taken = 0;
    for (int k = 0; k < 100000; k++) {
        uint8_t block[16], texels[16][4];
        for (int i = 0; i < 16; i++)
            block[i] = (uint8_t)(256 * weft_test_random(&random));
        taken += weft_uastc_decode(block, texels);
    }
    assert_true(taken > 50000 && taken < 90000); /* modes 0, 5, 6, 8, 10, 11, 12, 18: codes of 25/32 of all */
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(check_quality), cmocka_unit_test(check_any_block)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
