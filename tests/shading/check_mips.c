/* Mips of normals and roughness: what they keep, against normals drawn one by one. */
#include "tests/shading/drawn_normals.h"
#include "tests/support/support.h"

#include "shading/bake/gloss.h"
#include "shading/bake/mips.h"
#include "shading/bake/toksvig.h"
#include "shading/bake/vmf.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { SIDE = DRAWN_SIDE };

static void check_against_drawn_normals(void **state)
{
    (void)state;
    double sum[6] = {0}, worst[6] = {0};
    int n = 0;
    for (int f = 0; f < DRAWN_FABRICS; f++)
        for (int r = 0; r < DRAWN_ALPHAS; r++) {
            weft_baked b[6];
            for (int rule = 0; rule < 6; rule++) {
                weft_mip_options options = {.rule = (weft_mip_rule)rule, .max_levels = 7};
                drawn_normals_make(&b[rule], f);
                b[rule].maps[WEFT_BAKED_ROUGHNESS].constant[0] = (float)drawn_alphas[r];
                assert_ok(weft_mips_make(&b[rule], &options, err));
            }
            for (drawn_footprint at = {0}; drawn_next(&at); n++) {
                drawn_tangents tangents;
                drawn_normals_draw(&b[0], &at, drawn_alphas[r], &tangents);
                const double least = drawn_least_distance(&tangents);
                for (int rule = 0; rule < 6; rule++) {
                    const weft_image *const alphas = &b[rule].maps[WEFT_BAKED_ROUGHNESS].mips[at.level];
                    const double alpha = (double)weft_image_row(alphas, 0, at.y)[at.x];
                    const double excess = fmax(drawn_distance(&tangents, alpha) - least, 0);
                    sum[rule] += excess;
                    worst[rule] = fmax(worst[rule], excess);
                }
            }
            for (int rule = 0; rule < 6; rule++)
                weft_baked_fini(&b[rule]);
        }
    static const char *const names[] = {"closest", "length", "vmf", "vmf-consistent", "toksvig", "none"};
    for (int rule = 0; rule < 6; rule++)
        print_message("%-15s mean excess %.4f, worst %.3f\n", names[rule], sum[rule] / n, worst[rule]);
    assert_true(sum[WEFT_MIP_CLOSEST] / n <= 0.02);
    for (int rule = 1; rule < 6; rule++)
        assert_true(sum[WEFT_MIP_CLOSEST] < sum[rule]);
}

/* Flat and equal is a fixed point of every rule, at any size. */
static void check_fixed_point(void **state)
{
    (void)state;
    for (int rule = 0; rule < 6; rule++) {
        weft_baked b = {0};
        weft_mip_options options = weft_mip_defaults();
        options.rule = (weft_mip_rule)rule;
        assert_ok(weft_baked_init(&b, "f", weft_material_type_find("opaquematerial"), err));
        assert_ok(weft_baked_add(&b, WEFT_BAKED_NORMAL, 37, 20, err));
        for (int i = 0; i < 37 * 20; i++)
            weft_image_plane(&b.maps[WEFT_BAKED_NORMAL].mips[0], 2)[i] = 1;
        b.maps[WEFT_BAKED_ROUGHNESS].constant[0] = 0.3F;
        assert_ok(weft_mips_make(&b, &options, err));
        assert_int_equal(b.maps[WEFT_BAKED_ROUGHNESS].n_mips, 6);
        assert_int_equal(b.maps[WEFT_BAKED_NORMAL].mips[2].width, 9);
        assert_int_equal(b.maps[WEFT_BAKED_NORMAL].mips[5].width, 1);
        for (int level = 0; level < 6; level++) {
            assert_near((double)b.maps[WEFT_BAKED_ROUGHNESS].mips[level].data[0], 0.3, 2e-4);
            assert_near((double)weft_image_plane(&b.maps[WEFT_BAKED_NORMAL].mips[level], 2)[0], 1, 1e-6);
            assert_near((double)b.maps[WEFT_BAKED_NORMAL_LENGTH].mips[level].data[0], 1, 1e-6);
        }
        weft_baked_fini(&b);
    }
}

/* Means keep their energy, whatever the size; coverage keeps the share of texels that pass. */
/* One number a level, against the power written out: 1/m' = 1/m + (1 - |n|)/|n| (S-FC3-14). */
static void check_average_toksvig(void **state)
{
    (void)state;
    weft_baked b;
    const weft_mip_options options = {.rule = WEFT_MIP_TOKSVIG};
    drawn_normals_make(&b, 0);
    b.maps[WEFT_BAKED_ROUGHNESS].constant[0] = 0.1F;
    assert_near(weft_toksvig_average_gloss(&b, 3), log2(2 / 0.01 - 2) / 13, 1e-6); /* no map of lengths yet */
    assert_ok(weft_mips_make(&b, &options, err));
    double last = 1;
    for (int level = 0; level < 6; level++) {
        const double alpha = (double)b.maps[WEFT_BAKED_ROUGHNESS].constant[0], m = 2 / (alpha * alpha) - 2;
        const int side = SIDE >> level;
        double sum = 0;
        for (int y = 0; y < side; y++)
            for (int x = 0; x < side; x++) {
                double mean[3] = {0, 0, 0}; /* of the normals of level 0 */
                for (int k = 0; k < 1 << (2 * level); k++)
                    for (int c = 0; c < 3; c++)
                        mean[c] += (double)weft_image_row(&b.maps[WEFT_BAKED_NORMAL].mips[0], c,
                                                          (y << level) +
                                                              (k >> level))[(x << level) + k % (1 << level)] /
                                   (1 << (2 * level));
                const double length =
                    fmin(sqrt(mean[0] * mean[0] + mean[1] * mean[1] + mean[2] * mean[2]), 1);
                sum += fmax(0, log2(1 / (1 / m + (1 - length) / length)) / 13);
            }
        const double gloss = weft_toksvig_average_gloss(&b, level);
        assert_near(gloss, sum / (side * side), 1e-4);
        assert_true(gloss < last + 1e-9); /* coarser levels are duller */
        last = gloss;
    }
    weft_baked_fini(&b);
}

static void check_means_and_coverage(void **state)
{
    (void)state;
    weft_baked b = {0};
    weft_mip_options options = weft_mip_defaults();
    options.coverage_at = 0.5;
    uint64_t random = 7;
    double mean = 0;
    assert_ok(weft_baked_init(&b, "lace", weft_material_type_find("opaquematerial"), err));
    assert_ok(weft_baked_add(&b, WEFT_BAKED_ALBEDO, 60, 44, err));
    assert_ok(weft_baked_add(&b, WEFT_BAKED_OPACITY, 60, 44, err));
    for (int i = 0; i < 60 * 44; i++) {
        b.maps[WEFT_BAKED_ALBEDO].mips[0].data[i] = (float)weft_test_random(&random);
        mean += (double)b.maps[WEFT_BAKED_ALBEDO].mips[0].data[i] / (60 * 44);
        b.maps[WEFT_BAKED_OPACITY].mips[0].data[i] = weft_test_random(&random) < 0.7 ? 1 : 0;
    }
    assert_ok(weft_mips_make(&b, &options, err));
    assert_near((double)b.maps[WEFT_BAKED_ALBEDO].constant[0], mean, 1e-6);
    for (int level = 1; level < b.maps[WEFT_BAKED_ALBEDO].n_mips; level++) {
        const weft_image *const a = &b.maps[WEFT_BAKED_ALBEDO].mips[level];
        double here = 0;
        for (size_t i = 0; i < weft_image_plane_size(a); i++)
            here += (double)a->data[i] / (double)weft_image_plane_size(a);
        assert_near(here, mean, 1e-5);
    }
    for (int level = 1; level <= 2; level++) {
        const weft_image *const o = &b.maps[WEFT_BAKED_OPACITY].mips[level];
        double pass = 0;
        for (size_t i = 0; i < weft_image_plane_size(o); i++)
            pass += (o->data[i] > 0.5F) / (double)weft_image_plane_size(o);
        assert_near(pass, 0.7, 0.2); /* four levels of grey cannot do better */
    }
    weft_baked_fini(&b);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(check_against_drawn_normals),
        cmocka_unit_test(check_fixed_point),
        cmocka_unit_test(check_average_toksvig),
        cmocka_unit_test(check_means_and_coverage),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
