/*
 * Filtered roughness against the distribution it stands for: micro-normals are drawn about every normal of a
 * footprint, and the filtered GGX is held against them by the Kolmogorov-Smirnov distance of the polar angle,
 * over what the best GGX there is would have.
 */
#include "tests/support/support.h"

#include "shading/bake/gloss.h"
#include "shading/bake/mips.h"
#include "shading/bake/toksvig.h"
#include "shading/bake/vmf.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { SIDE = 128, DRAWS = 2048 };

static const double pi = 3.14159265358979323846;

/* Heights of three fabrics in texels; u, v in texels. */
static double plain(double u, double v)
{
    return 1.5 * sin(pi * u / 8) * cos(pi * v / 8);
}

static double twill(double u, double v)
{
    return 1.2 * sin(pi * (u + v) / 8) + 0.4 * cos(pi * u / 2) * sin(pi * v / 4);
}

static double corded(double u, double v)
{
    return 3 * fabs(sin(pi * u / 16)) + 0.15 * sin(pi * v / 2);
}

typedef double fabric_fn(double u, double v);
static fabric_fn *const fabrics[] = {plain, twill, corded};

static void make_normals(weft_baked *b, fabric_fn *fabric)
{
    const double e = 1e-3;
    assert_ok(weft_baked_init(b, "f", weft_material_type_find("opaquematerial"), err));
    assert_ok(weft_baked_add(b, WEFT_BAKED_NORMAL, SIDE, SIDE, err));
    for (int y = 0; y < SIDE; y++)
        for (int x = 0; x < SIDE; x++) {
            const double u = x + 0.5, v = y + 0.5;
            const double dx = (fabric(u + e, v) - fabric(u - e, v)) / (2 * e);
            const double dy = (fabric(u, v + e) - fabric(u, v - e)) / (2 * e),
                         l = sqrt(dx * dx + dy * dy + 1);
            weft_image *const n = &b->maps[WEFT_BAKED_NORMAL].mips[0];
            weft_image_row(n, 0, y)[x] = (float)(-dx / l);
            weft_image_row(n, 1, y)[x] = (float)(dy / l);
            weft_image_row(n, 2, y)[x] = (float)(1 / l);
        }
}

static int by_value(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* tan of the polar angle of micro-normals of a footprint against its mean normal, sorted. */
static void draw(const weft_baked *b, int level, int tx, int ty, double alpha, double *tangents)
{
    const weft_image *const n0 = &b->maps[WEFT_BAKED_NORMAL].mips[0], *const nl = &b->maps[WEFT_BAKED_NORMAL]
                                                                                       .mips[level];
    double mean[3];
    for (int c = 0; c < 3; c++)
        mean[c] = (double)weft_image_row(nl, c, ty)[tx];
    uint64_t random = (uint64_t)level * 1000 + (uint64_t)(ty * SIDE + tx) + 1;
    const int side = 1 << level;
    for (int k = 0; k < DRAWS; k++) {
        /* strata over the footprint and over the lobe */
        const int cell = side * side <= DRAWS ? k % (side * side)
                                              : (int)((k + weft_test_random(&random)) * side * side / DRAWS);
        const int x = tx * side + cell % side, y = ty * side + cell / side;
        double n[3], m[3];
        for (int c = 0; c < 3; c++)
            n[c] = (double)weft_image_row(n0, c, y)[x];
        const double u = weft_test_random(&random), phi = 2 * pi * weft_test_random(&random);
        const double cos_m = sqrt((1 - u) / (1 + (alpha * alpha - 1) * u)), sin_m = sqrt(1 - cos_m * cos_m);
        const double tl = hypot(n[0], n[2]), t[3] = {n[2] / tl, 0, -n[0] / tl};
        const double s[3] = {n[1] * t[2], n[2] * t[0] - n[0] * t[2], -n[1] * t[0]};
        for (int c = 0; c < 3; c++)
            m[c] = sin_m * (cos(phi) * t[c] + sin(phi) * s[c]) + cos_m * n[c];
        const double cosine = m[0] * mean[0] + m[1] * mean[1] + m[2] * mean[2];
        tangents[k] = cosine > 1e-3 ? sqrt(fmax(1 - cosine * cosine, 0)) / cosine : 1e3;
    }
    qsort(tangents, DRAWS, sizeof *tangents, by_value);
}

/* Largest distance of the two cumulative distributions; that of GGX is t^2/(t^2 + alpha^2). */
static double distance(const double *tangents, double alpha)
{
    double most = 0;
    for (int k = 0; k < DRAWS; k++) {
        const double t2 = tangents[k] * tangents[k], model = t2 / (t2 + alpha * alpha);
        most = fmax(most, fmax(fabs(model - (double)k / DRAWS), fabs(model - (k + 1.0) / DRAWS)));
    }
    return most;
}

static double least_distance(const double *tangents)
{
    double least = 1;
    for (double alpha = 0.01; alpha <= 1; alpha *= 1.02)
        least = fmin(least, distance(tangents, alpha));
    return least;
}

static void check_against_drawn_normals(void **state)
{
    (void)state;
    static const double roughness[] = {0.05, 0.1, 0.2, 0.35, 0.5};
    static double tangents[DRAWS];
    double sum[6] = {0}, worst[6] = {0};
    int n = 0;
    for (int f = 0; f < 3; f++)
        for (int r = 0; r < 5; r++) {
            weft_baked b[6];
            for (int rule = 0; rule < 6; rule++) {
                weft_mip_options options = {.rule = (weft_mip_rule)rule, .max_levels = 7};
                make_normals(&b[rule], fabrics[f]);
                b[rule].maps[WEFT_BAKED_ROUGHNESS].constant[0] = (float)roughness[r];
                assert_ok(weft_mips_make(&b[rule], &options, err));
            }
            for (int level = 1; level <= 6; level++) {
                const int side = SIDE >> level, step = side > 3 ? side / 3 : 1;
                for (int y = step / 2; y < side; y += step)
                    for (int x = step / 2; x < side; x += step, n++) {
                        draw(&b[0], level, x, y, roughness[r], tangents);
                        const double least = least_distance(tangents);
                        for (int rule = 0; rule < 6; rule++) {
                            const double alpha = (double)weft_image_row(
                                &b[rule].maps[WEFT_BAKED_ROUGHNESS].mips[level], 0, y)[x];
                            const double excess = fmax(distance(tangents, alpha) - least, 0);
                            sum[rule] += excess;
                            worst[rule] = fmax(worst[rule], excess);
                        }
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
    make_normals(&b, plain);
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
