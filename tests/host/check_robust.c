/* The robust method: shadows, highlights and gloss are put into exact light and must not reach the normal. */
#include "tests/support/support.h"

#include "core/mem.h"
#include "host/solve/cloth_lobe.h"
#include "host/solve/solve_row.h"
#include "tests/host/dome.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { N = 10, LANES = WEFT_SOLVE_LANES };

static const double pi = 3.14159265358979323846;

/* ---- blocks of samples from formulas ---- */

typedef struct truth {
    double normal[LANES][3], albedo[LANES];
} truth;

static void normal_of(double slope_x, double slope_y, double n[3])
{
    const double length = sqrt(slope_x * slope_x + slope_y * slope_y + 1);
    n[0] = -slope_x / length;
    n[1] = -slope_y / length;
    n[2] = 1 / length;
}

static void light_of(int j, double l[3])
{
    const double up = (j < 6 ? 35 : j < 9 ? 60 : 80) * pi / 180;
    const double around = (j < 6 ? 60.0 * j : j < 9 ? 120.0 * (j - 6) + 30 : 200) * pi / 180;
    l[0] = cos(up) * cos(around);
    l[1] = cos(up) * sin(around);
    l[2] = sin(up);
}

static double dot(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static void set_sample(weft_solve_samples *s, int j, int k, double value)
{
    double l[3];
    light_of(j, l);
    for (int c = 0; c < 3; c++)
        s->at[j].light[c][k] = (float)l[c];
    s->at[j].value[0][k] = s->at[j].grey[k] = (float)value;
    s->at[j].weight[k] = 1;
}

/* Random slopes up to `steep` and albedos, matte, self-shadowed where they face away. */
static void make_matte(weft_solve_samples *s, truth *t, double steep, uint64_t *random)
{
    *s = (weft_solve_samples){.n_lights = N, .n_channels = 1};
    for (int k = 0; k < LANES; k++) {
        const double tilt = steep * sqrt(weft_test_random(random)),
                     around = 2 * pi * weft_test_random(random);
        normal_of(tilt * cos(around), tilt * sin(around), t->normal[k]);
        t->albedo[k] = 0.2 + 0.6 * weft_test_random(random);
        s->view[2][k] = 1;
        for (int j = 0; j < N; j++) {
            double l[3];
            light_of(j, l);
            set_sample(s, j, k, t->albedo[k] * fmax(dot(t->normal[k], l), 0));
        }
    }
}

static void solve(const weft_solve_method *method, const weft_solve_samples *s, weft_solve_answers *a)
{
    weft_solve_answers searched;
    method->solve(s, a);
    if (!method->search)
        return;
    method->search(s, &searched);
    for (int k = 0; k < LANES; k++) {
        if (!(a->search[k] > 0))
            continue;
        for (int c = 0; c < 3; c++)
            a->normal[c][k] = searched.normal[c][k];
        a->albedo[0][k] = searched.albedo[0][k];
        a->n_used[k] = searched.n_used[k];
        a->quality[k] = searched.quality[k];
        a->valid[k] = searched.valid[k];
        a->angle[k] = searched.angle[k];
    }
}

static double error_deg(const weft_solve_answers *a, const truth *t, int k)
{
    const double n[3] = {a->normal[0][k], a->normal[1][k], a->normal[2][k]};
    return dome_angle_deg(n, t->normal[k]);
}

/* ---- shadows and highlights ---- */

static void test_cast_shadows_and_highlights_do_not_reach_the_normal(void **state)
{
    (void)state;
    uint64_t random = 2024;
    double worst = 0, lsq = 0;
    int n = 0;
    for (int round = 0; round < 400; round++) {
        weft_solve_samples s;
        weft_solve_answers a;
        truth t;
        make_matte(&s, &t, 0.3, &random);
        for (int k = 0; k < LANES; k++) {
            const int shadow = (int)(6 * weft_test_random(&random)), shine = (shadow + 3) % 6;
            s.at[shadow].grey[k] *= 0.5F; /* half a penumbra: too bright to be called dark */
            s.at[(shadow + 1) % 6].grey[k] *= 0.3F;
            s.at[shine].grey[k] *= 1.4F;
            for (int j = 0; j < N; j++)
                s.at[j].value[0][k] = s.at[j].grey[k];
        }
        solve(&weft_method_robust, &s, &a);
        for (int k = 0; k < LANES; k++) {
            worst = fmax(worst, error_deg(&a, &t, k));
            assert_true(a.n_used[k] == N - 3);
            assert_true(a.quality[k] & WEFT_QUALITY_NOT_LAMBERTIAN);
            assert_near(a.albedo[0][k], t.albedo[k], 1e-4);
        }
        solve(&weft_method_lsq, &s, &a);
        for (int k = 0; k < LANES; k++, n++)
            lsq += error_deg(&a, &t, k);
    }
    print_message("two shadows and a highlight: robust at worst %.2g degrees, lsq %.1f on average\n", worst,
                  lsq / n);
    assert_true(worst < 0.01 && lsq / n > 5);
}

/* A flank of 65 degrees that only a few of the lights reach. */
/* Of many lights only some triples are tried: enough, when every third light contradicts. */
static void test_many_lights_of_which_a_third_contradicts(void **state)
{
    (void)state;
    static const int numbers[] = {11, 12, 13, 17, 24, 33, 48, 64, WEFT_LIGHTS_MAX};
    uint64_t random = 5;
    for (int i = 0; i < (int)(sizeof numbers / sizeof numbers[0]); i++) {
        const int n = numbers[i];
        double worst = 0;
        for (int round = 0; round < 20; round++) {
            static weft_solve_samples s;
            weft_solve_answers a;
            truth t;
            s = (weft_solve_samples){.n_lights = n, .n_channels = 1};
            for (int k = 0; k < LANES; k++) {
                const double tilt = 0.4 * weft_test_random(&random),
                             around = 2 * pi * weft_test_random(&random);
                normal_of(tilt * cos(around), tilt * sin(around), t.normal[k]);
                for (int j = 0; j < n; j++) { /* a spiral over the dome */
                    const double up = (35 + 50.0 * j / n) * pi / 180, angle = 2.4 * j;
                    const double l[3] = {cos(up) * cos(angle), cos(up) * sin(angle), sin(up)};
                    const bool wrong = (j + k) % 3 == 0;
                    const double off = 0.3 * weft_test_random(&random);
                    const double factor = !wrong ? 1 : j & 1 ? 1.7 + off : 0.3 + off;
                    for (int c = 0; c < 3; c++)
                        s.at[j].light[c][k] = (float)l[c];
                    s.at[j].value[0][k] = s.at[j].grey[k] = (float)(0.5 * factor * dot(t.normal[k], l));
                    s.at[j].weight[k] = 1;
                }
            }
            solve(&weft_method_robust, &s, &a);
            for (int k = 0; k < LANES; k++)
                worst = fmax(worst, error_deg(&a, &t, k));
        }
        print_message("%3d lights: at worst %.5f degrees\n", n, worst);
        assert_true(worst < 0.001);
    }
}

static void test_steep_flanks_keep_the_lights_that_reach_them(void **state)
{
    (void)state;
    uint64_t random = 7;
    double robust = 0, lsq = 0;
    int n = 0;
    for (int round = 0; round < 400; round++) {
        weft_solve_samples s;
        weft_solve_answers a;
        truth t;
        make_matte(&s, &t, 2.1, &random);
        solve(&weft_method_robust, &s, &a);
        for (int k = 0; k < LANES; k++) {
            assert_true(a.valid[k] > 0 && a.n_used[k] >= 3);
            robust = fmax(robust, error_deg(&a, &t, k));
        }
        solve(&weft_method_lsq, &s, &a);
        for (int k = 0; k < LANES; k++, n++)
            lsq += error_deg(&a, &t, k);
    }
    print_message(
        "slopes to 65 degrees, attached shadows: robust at worst %.2g degrees, lsq %.1f on average\n", robust,
        lsq / n);
    assert_true(robust < 1.5 && lsq / n > 3);
}

static void test_three_lights_are_kept_whatever_happens(void **state)
{
    (void)state;
    uint64_t random = 31;
    for (int round = 0; round < 300; round++) {
        weft_solve_samples s;
        weft_solve_answers a;
        truth t;
        make_matte(&s, &t, 0.3, &random);
        for (int k = 0; k < LANES; k++)
            for (int j = 0; j < N; j++) {
                s.at[j].grey[k] = (float)weft_test_random(&random); /* nothing agrees with anything */
                s.at[j].value[0][k] = s.at[j].grey[k];
                s.at[j].weight[k] = k < 8 || j < 3 ? 1 : 0;
                if (!(s.at[j].weight[k] > 0))
                    s.at[j].grey[k] = s.at[j].value[0][k] = 0;
            }
        solve(&weft_method_robust, &s, &a);
        for (int k = 0; k < LANES; k++) {
            assert_true(a.valid[k] > 0 && a.n_used[k] >= 3);
            assert_true(isfinite(a.normal[0][k]) && isfinite(a.albedo[0][k]) && isfinite(a.angle[k]));
        }
    }
}

static void test_matte_cloth_is_plain_least_squares(void **state)
{
    (void)state;
    uint64_t random = 5;
    for (int round = 0; round < 100; round++) {
        weft_solve_samples s;
        weft_solve_answers robust, lsq;
        truth t;
        make_matte(&s, &t, 0.4, &random);
        for (int j = 0; j < N; j++)
            for (int k = 0; k < LANES; k++) {
                s.at[j].grey[k] *= (float)(1 + 0.005 * weft_test_gauss(&random));
                s.at[j].value[0][k] = s.at[j].grey[k];
            }
        solve(&weft_method_robust, &s, &robust);
        solve(&weft_method_lsq, &s, &lsq);
        for (int k = 0; k < LANES; k++) {
            for (int c = 0; c < 3; c++)
                assert_near(robust.normal[c][k], lsq.normal[c][k], 1e-6);
            assert_true(robust.quality[k] == 0 && robust.n_used[k] == N);
        }
    }
}

static void test_quality_says_what_was_left_out(void **state)
{
    (void)state;
    uint64_t random = 12;
    weft_solve_samples s;
    weft_solve_answers a;
    truth t;
    make_matte(&s, &t, 0.1, &random);
    s.clipped[1] = 1;
    s.dark[2] = 2;
    s.at[3].grey[3] = s.at[3].value[0][3] = 0.01F; /* a black shadow */
    for (int j = 0; j < N; j++)                    /* lane 4: three lights on one side */
        if (j != 0 && j != 1 && j != 6)
            s.at[j].weight[4] = s.at[j].grey[4] = s.at[j].value[0][4] = 0;
    solve(&weft_method_robust, &s, &a);
    assert_int_equal(a.quality[0], 0);
    assert_int_equal(a.quality[1], WEFT_QUALITY_CLIPPED);
    assert_int_equal(a.quality[2], WEFT_QUALITY_SHADOWED);
    assert_int_equal(a.quality[3], WEFT_QUALITY_SHADOWED);
    assert_int_equal(a.quality[4], WEFT_QUALITY_ILL_CONDITIONED);
    assert_true(a.n_used[3] == N - 1 && a.n_used[4] == 3);
    assert_true(a.angle[4] > 3 * a.angle[0]);
}

/* ---- the row: pixels that ask for a search come back where they were ---- */

enum { WIDTH = 203 };

static void test_searched_pixels_return_to_their_place(void **state)
{
    (void)state;
    static float rgb[N][WIDTH], out[9][2][WIDTH];
    static uint8_t bytes[3][2][WIDTH];
    weft_calibration cal;
    weft_incidence incidence;
    dome_init(&cal, WIDTH, 40);
    for (int j = 0; j < N; j++)
        cal.lights[j].intensity[1] = cal.lights[j].intensity[2] = cal.lights[j].intensity[0];
    assert_ok(weft_incidence_init(&incidence, &cal, WIDTH, 40, (weft_pixel_scale){1, 0}, 0, err));
    for (int u = 0; u < WIDTH; u++) {
        double point[3], n[3];
        dome_point(&cal.camera, u, 20, 0, point);
        normal_of(0.3 * sin(u), 0.2 * cos(0.7 * u), n);
        for (int j = 0; j < N; j++)
            rgb[j][u] = (float)dome_radiance(&cal.lights[j], 0, point, n, 0.5);
        if (u % 7 == 3) /* every seventh is in half shadow of one light */
            rgb[u % 6][u] *= 0.4F;
    }
    weft_solve_plan plan = {.incidence = &incidence, .method = &weft_method_robust, .width = WIDTH};
    for (int all = 0; all < 2; all++) {
        weft_solve_row_in in[N];
        for (int j = 0; j < N; j++)
            in[j] = (weft_solve_row_in){.rgb = {rgb[j], rgb[j], rgb[j]}};
        const weft_solve_row_out to = {.normal = {out[0][all], out[1][all], out[2][all]},
                                       .albedo = {out[3][all], out[4][all], out[5][all]},
                                       .residual = out[6][all],
                                       .confidence = out[7][all],
                                       .angle = out[8][all],
                                       .lights = bytes[0][all],
                                       .quality = bytes[1][all],
                                       .valid = bytes[2][all]};
        plan.search_all = all;
        weft_solve_row(&plan, 20, in, &to);
    }
    for (int u = 0; u < WIDTH; u++) {
        double n[3];
        const double found[3] = {out[0][0][u], out[1][0][u], out[2][0][u]};
        normal_of(0.3 * sin(u), 0.2 * cos(0.7 * u), n);
        assert_true(dome_angle_deg(found, n) < 0.05);
        assert_int_equal(bytes[0][0][u], u % 7 == 3 ? N - 1 : N);
        if (u % 7 == 3) /* the same bits whatever else was in the block */
            for (int i = 0; i < 9; i++)
                assert_memory_equal(&out[i][0][u], &out[i][1][u], sizeof(float));
    }
    weft_incidence_fini(&incidence);
    weft_calibration_fini(&cal);
}

/* ---- expected error ---- */

static void test_expected_error_is_the_measured_one(void **state)
{
    (void)state;
    static const double sigmas[3] = {0.002, 0.005, 0.01};
    uint64_t random = 77;
    for (int i = 0; i < 3; i++) {
        double expected2 = 0, found2 = 0;
        for (int round = 0; round < 1500; round++) {
            weft_solve_samples s;
            weft_solve_answers a;
            truth t;
            make_matte(&s, &t, 0.3, &random);
            for (int j = 0; j < N; j++)
                for (int k = 0; k < LANES; k++) {
                    s.at[j].grey[k] += (float)(sigmas[i] * weft_test_gauss(&random));
                    s.at[j].value[0][k] = s.at[j].grey[k];
                    s.at[j].variance[k] = (float)(sigmas[i] * sigmas[i]);
                    if (k % 2 && j > 3) /* odd lanes have four lights */
                        s.at[j].weight[k] = s.at[j].grey[k] = s.at[j].value[0][k] = 0;
                }
            weft_method_lsq.solve(&s, &a);
            for (int k = 0; k < LANES; k++) {
                expected2 += pow((double)a.angle[k] * 180 / pi, 2);
                found2 += pow(error_deg(&a, &t, k), 2);
            }
        }
        const double ratio = sqrt(expected2 / found2);
        print_message("noise %.3f: expected over measured rms error %.3f\n", sigmas[i], ratio);
        assert_true(ratio > 0.95 && ratio < 1.05);
    }
}

/* What no estimate without bias goes below (Gauss and Markov): trace C - n^T C n over the squared albedo,
 * with C = (sum of l l^T / variance)^-1 by cofactors. */
static double least_variance(const weft_solve_samples *s, const truth *t, int k)
{
    double a[3][3] = {{0}}, c[3][3];
    for (int j = 0; j < N; j++)
        for (int m = 0; m < 9; m++)
            a[m / 3][m % 3] += (double)s->at[j].light[m / 3][k] * (double)s->at[j].light[m % 3][k] /
                               (double)s->at[j].variance[k];
    for (int m = 0; m < 9; m++) {
        const int i = m / 3, j = m % 3, i1 = (i + 1) % 3, i2 = (i + 2) % 3, j1 = (j + 1) % 3,
                  j2 = (j + 2) % 3;
        c[j][i] = a[i1][j1] * a[i2][j2] - a[i1][j2] * a[i2][j1];
    }
    const double det = a[0][0] * c[0][0] + a[0][1] * c[1][0] + a[0][2] * c[2][0];
    double across = c[0][0] + c[1][1] + c[2][2];
    for (int m = 0; m < 9; m++)
        across -= t->normal[k][m / 3] * c[m / 3][m % 3] * t->normal[k][m % 3];
    return across / det / (t->albedo[k] * t->albedo[k]);
}

/* Lamps of unequal strength: every third one three times as noisy. */
static void test_a_sample_counts_by_its_noise(void **state)
{
    (void)state;
    uint64_t random = 99;
    double least2 = 0, expected2 = 0, robust2 = 0, lsq2 = 0;
    for (int round = 0; round < 1500; round++) {
        weft_solve_samples s;
        weft_solve_answers robust, lsq;
        truth t;
        make_matte(&s, &t, 0.3, &random);
        for (int j = 0; j < N; j++)
            for (int k = 0; k < LANES; k++) {
                const double sigma = (j % 3 ? 0.01 : 0.03) * t.albedo[k];
                s.at[j].grey[k] += (float)(sigma * weft_test_gauss(&random));
                s.at[j].value[0][k] = s.at[j].grey[k];
                s.at[j].variance[k] = (float)(sigma * sigma);
            }
        weft_method_robust.solve(&s, &robust);
        weft_method_lsq.solve(&s, &lsq);
        for (int k = 0; k < LANES; k++) {
            least2 += least_variance(&s, &t, k) * pow(180 / pi, 2);
            expected2 += pow((double)robust.angle[k] * 180 / pi, 2);
            robust2 += pow(error_deg(&robust, &t, k), 2);
            lsq2 += pow(error_deg(&lsq, &t, k), 2);
        }
    }
    print_message("unequal noise, rms of the least possible: robust %.3f (expected %.3f), lsq %.3f\n",
                  sqrt(robust2 / least2), sqrt(expected2 / least2), sqrt(lsq2 / least2));
    assert_true(robust2 < 1.15 * least2 && robust2 > 0.95 * least2);
    assert_true(fabs(sqrt(expected2 / robust2) - 1) < 0.07);
    assert_true(lsq2 > 1.2 * robust2);
}

/* ---- gloss ---- */

/* The mirror term written out with vectors: GGX with the fibre along t, Smith's masking, Schlick. */
static double mirror(const double n[3], const double l[3], const double v[3], const double fibre[3],
                     double strength, double along, double across)
{
    double h[3], t[3], b[3], h2 = 0, t2 = 0;
    for (int i = 0; i < 3; i++) {
        h[i] = l[i] + v[i];
        t[i] = fibre[i] - dot(fibre, n) * n[i];
        h2 += h[i] * h[i];
        t2 += t[i] * t[i];
    }
    for (int i = 0; i < 3; i++) {
        h[i] /= sqrt(h2);
        t[i] /= sqrt(t2);
    }
    b[0] = n[1] * t[2] - n[2] * t[1];
    b[1] = n[2] * t[0] - n[0] * t[2];
    b[2] = n[0] * t[1] - n[1] * t[0];
    const double nl = fmax(dot(n, l), 0), nv = fmax(dot(n, v), 0);
    const double e = pow(dot(h, t) / along, 2) + pow(dot(h, b) / across, 2) + pow(dot(h, n), 2);
    const double d_pi = 1 / (along * across * e * e), a2 = along * across;
    const double masking =
        0.5 / (nl * sqrt(a2 + (1 - a2) * nv * nv) + nv * sqrt(a2 + (1 - a2) * nl * nl) + 1e-12);
    const double fresnel = (0.05 + 0.95 * pow(1 - dot(l, h), 5)) / 0.05;
    return strength * d_pi * masking * fresnel * nl;
}

/* Satin: seven of eight pixels with the fibres one way, one the other way. */
static void make_satin(weft_solve_samples *s, truth *t, double strength, double angle, uint64_t *random)
{
    const double v[3] = {0, 0, 1};
    make_matte(s, t, 0.3, random);
    for (int k = 0; k < LANES; k++) {
        const double turn = angle + (k % 8 == 5 ? pi / 2 : 0), fibre[3] = {cos(turn), sin(turn), 0};
        t->albedo[k] = 0.1 + 0.2 * weft_test_random(random);
        for (int j = 0; j < N; j++) {
            double l[3];
            light_of(j, l);
            const double value = t->albedo[k] * fmax(dot(t->normal[k], l), 0) +
                                 mirror(t->normal[k], l, v, fibre, strength, 0.2, 0.45);
            set_sample(s, j, k, value * (1 + 0.003 * weft_test_gauss(random)));
        }
    }
}

static void test_gloss_is_found_and_taken_off(void **state)
{
    (void)state;
    enum { BLOCKS = 48 };
    static weft_solve_samples store[BLOCKS];
    static truth truths[BLOCKS];
    weft_solve_samples *blocks[BLOCKS];
    uint64_t random = 99;
    weft_gloss gloss;
    for (int i = 0; i < BLOCKS; i++) {
        make_satin(&store[i], &truths[i], 0.05, 0.3, &random);
        blocks[i] = &store[i];
    }
    const weft_gloss_report report = weft_gloss_fit(blocks, BLOCKS, &gloss);
    assert_true(report.found);
    const bool turned = gloss.alpha_along > gloss.alpha_across;
    const double narrow = turned ? gloss.alpha_across : gloss.alpha_along,
                 wide = turned ? gloss.alpha_along : gloss.alpha_across;
    const double angle = remainder(atan2((double)gloss.fibre[turned][1], (double)gloss.fibre[turned][0]), pi);
    print_message(
        "strength %.4f (0.05), alpha %.3f, %.3f (0.2, 0.45), angle %.3f (0.3), chi^2 %.2f to %.2f\n",
        (double)gloss.strength, narrow, wide, angle, report.matte, report.glossy);
    assert_near(gloss.strength, 0.05, 0.002);
    assert_near(narrow, 0.2, 0.01);
    assert_near(wide, 0.45, 0.02);
    assert_near(angle, 0.3, 0.03);

    double lsq = 0, glossy = 0, albedo = 0;
    for (int i = 0; i < BLOCKS; i++) {
        weft_solve_answers a;
        weft_method_lsq.solve(&store[i], &a);
        for (int k = 0; k < LANES; k++)
            lsq += error_deg(&a, &truths[i], k) / (BLOCKS * LANES);
        store[i].gloss = &gloss;
        weft_method_robust.solve(&store[i], &a);
        for (int k = 0; k < LANES; k++) {
            glossy += error_deg(&a, &truths[i], k) / (BLOCKS * LANES);
            albedo += fabs((double)a.albedo[0][k] / truths[i].albedo[k] - 1) / (BLOCKS * LANES);
        }
    }
    print_message("satin: lsq %.2f, with the lobe %.2f degrees, albedo within %.3f\n", lsq, glossy, albedo);
    assert_true(lsq > 3 && glossy < 0.5 && albedo < 0.02);
}

static void test_no_gloss_is_found_on_matte_cloth(void **state)
{
    (void)state;
    enum { BLOCKS = 24 };
    static weft_solve_samples store[BLOCKS];
    weft_solve_samples *blocks[BLOCKS];
    uint64_t random = 123;
    weft_gloss gloss;
    for (int i = 0; i < BLOCKS; i++) {
        truth t;
        make_matte(&store[i], &t, 0.4, &random);
        for (int k = 0; k < LANES; k++) /* cast shadows are no gloss */
            if (k % 3 == 0)
                store[i].at[k % 6].grey[k] *= 0.4F;
        blocks[i] = &store[i];
    }
    assert_false(weft_gloss_fit(blocks, BLOCKS, &gloss).found);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_cast_shadows_and_highlights_do_not_reach_the_normal),
        cmocka_unit_test(test_many_lights_of_which_a_third_contradicts),
        cmocka_unit_test(test_steep_flanks_keep_the_lights_that_reach_them),
        cmocka_unit_test(test_three_lights_are_kept_whatever_happens),
        cmocka_unit_test(test_matte_cloth_is_plain_least_squares),
        cmocka_unit_test(test_quality_says_what_was_left_out),
        cmocka_unit_test(test_searched_pixels_return_to_their_place),
        cmocka_unit_test(test_expected_error_is_the_measured_one),
        cmocka_unit_test(test_a_sample_counts_by_its_noise),
        cmocka_unit_test(test_gloss_is_found_and_taken_off),
        cmocka_unit_test(test_no_gloss_is_found_on_matte_cloth),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
