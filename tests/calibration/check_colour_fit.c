/* The colour matrix against spectral simulations of real sensors, and against staged least-squares vectors.
 */
#include "tests/support/support.h"

#include "calibration/charts/colour_fit.h"
#include "core/colour.h"
#include "tests/calibration/spectral_tables.h"

#include <math.h>
#include <string.h>

/* A camera, a lamp and a target white, and the chart they look at. */
typedef struct simulation {
    spectrum observer[3], d65, lamp, camera[3];
} simulation;

static void simulate(simulation *s, const char *camera, const char *lamps, const char *lamp)
{
    table t;
    spectrum_observer(s->observer);
    table_read(&t, "data/spectral/illuminants/cie_illuminants_5nm.csv");
    spectrum_from(s->d65, &t, table_column(&t, "D65"));
    table_free(&t);
    table_read(&t, lamps);
    spectrum_from(s->lamp, &t, table_column(&t, lamp));
    table_free(&t);
    table_read(&t, camera);
    for (int c = 0; c < 3; c++)
        spectrum_from(s->camera[c], &t, 1 + c);
    table_free(&t);
}

static void see(const simulation *s, const spectrum reflectance, weft_colour_sample *sample)
{
    spectrum one;
    double xyz[3];
    for (int i = 0; i < SPECTRUM_N; i++)
        one[i] = 1;
    for (int c = 0; c < 3; c++)
        sample->camera[c] = spectrum_response(reflectance, s->lamp, s->camera[c]) /
                            spectrum_response(one, s->lamp, s->camera[c]);
    spectrum_xyz(reflectance, s->d65, s->observer, xyz);
    weft_xyz_to_srgb(xyz, sample->reference);
    sample->used = true;
}

/* A table of reflectances; those that end before 380 or 780 nm are continued with their last value. */
static int see_all(const simulation *s, const char *file, weft_colour_sample *samples, int room)
{
    table t;
    int n = 0;
    table_read(&t, file);
    const double first = table_cell(&t, 0, 0), last = table_cell(&t, t.rows - 1, 0);
    for (int c = 1; c < t.columns && n < room; c++) {
        spectrum r;
        for (int i = 0; i < SPECTRUM_N; i++)
            r[i] = table_at(&t, c, fmin(fmax(380 + 5 * i, first), last));
        see(s, r, &samples[n++]);
    }
    table_free(&t);
    return n;
}

/* Cloth: a row per swatch, 400-700 nm in columns. */
static int see_cloth(const simulation *s, const char *file, weft_colour_sample *samples, int room)
{
    table t;
    int n = 0;
    table_read(&t, file);
    assert_int_equal(t.columns, 32);
    for (; n < t.rows && n < room; n++) {
        spectrum r;
        for (int i = 0; i < SPECTRUM_N; i++) {
            const double at = fmin(fmax((380 + 5 * i - 400) / 10.0, 0), 30);
            const int k = at < 29 ? (int)at : 29;
            r[i] = table_cell(&t, n, 1 + k) * (1 - at + k) + table_cell(&t, n, 2 + k) * (at - k);
        }
        see(s, r, &samples[n]);
    }
    table_free(&t);
    return n;
}

static const char d5100[] = "data/spectral/cameras/nikon_d5100_npl_darrodi2015_5nm.csv";
static const char cie_leds[] = "data/spectral/illuminants/cie_led_5nm.csv";
static const char nist_leds[] = "data/spectral/illuminants/nist_cqs_led_5nm.csv";
static const char babel[] = "data/spectral/colorchecker/reflectance_babelcolor_avg30_10nm.csv";

static void test_d5100_under_led_b5(void **state)
{
    (void)state;
    simulation s;
    weft_colour_sample samples[24];
    weft_colour_fit fit;
    simulate(&s, d5100, cie_leds, "LED-B5");
    assert_int_equal(see_all(&s, babel, samples, 24), 24);
    assert_ok(weft_colour_fit_matrix(samples, 24, &fit, err));
    print_message("D5100, LED-B5: before %.2f, trained %.2f/%.2f, held out %.2f/%.2f, condition %.1f\n",
                  fit.before_mean, fit.trained_mean, fit.trained_max, fit.held_out_mean, fit.held_out_max,
                  fit.condition);
    assert_near(fit.trained_mean, 0.94, 0.1); /* figures of an independent program for the same data */
    assert_near(fit.trained_max, 2.9, 0.3);
    assert_near(fit.held_out_mean, 1.08, 0.1);
    assert_near(fit.held_out_max, 3.1, 0.3);
    assert_true(fit.rank == 3 && fit.condition > 3 && fit.condition < 12);
    assert_true(fit.before_mean > 5 * fit.trained_mean);

    /* Cloth that took no part in the fit. */
    static weft_colour_sample cloth[256];
    const int n = see_cloth(&s, "data/spectral/textiles/cotton_reflectance_10nm.csv", cloth, 256);
    assert_true(n > 200);
    double mean = 0;
    for (int i = 0; i < n; i++) {
        double seen[3], wanted[3];
        const weft_vec3 v = weft_mat3_apply(
            &fit.to_linear_srgb, (weft_vec3){cloth[i].camera[0], cloth[i].camera[1], cloth[i].camera[2]});
        weft_srgb_to_lab((const double[]){v.x, v.y, v.z}, seen);
        weft_srgb_to_lab(cloth[i].reference, wanted);
        mean += weft_delta_e_2000(seen, wanted) / n;
    }
    print_message("%d cotton swatches: %.2f\n", n, mean);
    assert_near(mean, 0.86, 0.15);
}

static void test_a_lamp_without_red_is_worse(void **state)
{
    (void)state;
    simulation s;
    weft_colour_sample samples[24];
    weft_colour_fit fit;
    simulate(&s, d5100, nist_leds, "Phosphor LED YAG");
    see_all(&s, babel, samples, 24);
    assert_ok(weft_colour_fit_matrix(samples, 24, &fit, err));
    assert_near(fit.trained_mean, 1.44, 0.1);
    assert_near(fit.held_out_mean, 1.66, 0.1);
}

static void test_exposure_changes_nothing(void **state)
{
    (void)state;
    simulation s;
    weft_colour_sample samples[24];
    weft_colour_fit full, half;
    simulate(&s, d5100, cie_leds, "LED-B5");
    see_all(&s, babel, samples, 24);
    assert_ok(weft_colour_fit_matrix(samples, 24, &full, err));
    for (int i = 0; i < 24; i++)
        for (int c = 0; c < 3; c++)
            samples[i].camera[c] *= 0.5;
    assert_ok(weft_colour_fit_matrix(samples, 24, &half, err));
    for (int i = 0; i < 9; i++)
        assert_near(half.to_linear_srgb.m[i], 2 * full.to_linear_srgb.m[i], 1e-9);
    assert_near(half.held_out_mean, full.held_out_mean, 1e-9);
}

/* A camera that sees exactly linear sRGB through a known matrix gives that matrix back, whatever is left out.
 */
static void test_a_known_matrix_comes_back(void **state)
{
    (void)state;
    const weft_chart *chart;
    assert_ok(weft_chart_find("macbeth", "ohta1997", &chart, err));
    const weft_mat3 truth = {{1.7, -0.6, -0.1, -0.2, 1.5, -0.3, 0.02, -0.4, 1.38}};
    weft_mat3 inverse;
    assert_true(weft_mat3_invert(&truth, &inverse));
    weft_colour_sample samples[24];
    for (int i = 0; i < 24; i++) {
        memcpy(samples[i].reference, chart->patches[i].linear_srgb, sizeof samples[i].reference);
        const double *const r = samples[i].reference;
        const weft_vec3 v = weft_mat3_apply(&inverse, (weft_vec3){r[0], r[1], r[2]});
        samples[i].camera[0] = v.x;
        samples[i].camera[1] = v.y;
        samples[i].camera[2] = v.z;
        samples[i].used = i != 4 && i != 17;
    }
    samples[4].camera[1] *= 3; /* unused samples have no influence, but are judged */
    weft_colour_fit fit;
    assert_ok(weft_colour_fit_matrix(samples, 24, &fit, err));
    for (int i = 0; i < 9; i++)
        assert_near(fit.to_linear_srgb.m[i], truth.m[i], 1e-10);
    assert_int_equal(fit.n_used, 22);
    assert_true(fit.held_out_max < 1e-6 && fit.trained[4] > 10);
}

/* On the staged fitting problems (made for larger models) the normal equations must hold: the weighted
 * residual is orthogonal to every column. */
static void test_least_squares_is_optimal(void **state)
{
    (void)state;
    table t;
    table_read(&t, "spec/vectors/colour_correction.csv");
    const int problem = table_column(&t, "problem"), x = table_column(&t, "xr"), y = table_column(&t, "yr");
    weft_colour_sample samples[WEFT_CHART_MAX_PATCHES];
    int n = 0, problems = 0;
    for (int r = 0; r <= t.rows; r++) {
        if (r == t.rows || (r > 0 && table_cell(&t, r, problem) != table_cell(&t, r - 1, problem))) {
            weft_colour_fit fit;
            assert_ok(weft_colour_fit_matrix(samples, n, &fit, err));
            for (int out = 0; out < 3; out++)
                for (int in = 0; in < 3; in++) {
                    double product = 0, size = 0;
                    for (int i = 0; i < n; i++) {
                        const double *const ref = samples[i].reference;
                        const double w = 1 / fmax(weft_luminance(ref[0], ref[1], ref[2]), 0.01);
                        double residual = -ref[out];
                        for (int k = 0; k < 3; k++)
                            residual += fit.to_linear_srgb.m[3 * out + k] * samples[i].camera[k];
                        product += w * w * residual * samples[i].camera[in];
                        size += w * w * fabs(residual * samples[i].camera[in]);
                    }
                    assert_true(fabs(product) <= 1e-9 * size);
                }
            problems++;
            n = 0;
        }
        if (r == t.rows)
            break;
        for (int c = 0; c < 3; c++) {
            samples[n].camera[c] = table_cell(&t, r, x + c);
            samples[n].reference[c] = table_cell(&t, r, y + c);
        }
        samples[n++].used = true;
    }
    print_message("%d staged problems\n", problems);
    assert_true(problems >= 1);
    table_free(&t);
}

static void test_refusals(void **state)
{
    (void)state;
    weft_colour_sample samples[24] = {0};
    weft_colour_fit fit;
    for (int i = 0; i < 24; i++) {
        for (int c = 0; c < 3; c++)
            samples[i].camera[c] = samples[i].reference[c] = 0.03 * (i + 1);
        samples[i].used = i < 8;
    }
    assert_fails(weft_colour_fit_matrix(samples, 24, &fit, err), WEFT_ERR_NODATA, "8 patches are usable");
    for (int i = 0; i < 24; i++)
        samples[i].used = true;
    assert_fails(weft_colour_fit_matrix(samples, 24, &fit, err), WEFT_ERR_NODATA, "only 1 of 3 columns");
    samples[5].camera[1] = (double)NAN;
    assert_fails(weft_colour_fit_matrix(samples, 24, &fit, err), WEFT_ERR_NODATA, "patch 6");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_d5100_under_led_b5),       cmocka_unit_test(test_a_lamp_without_red_is_worse),
        cmocka_unit_test(test_exposure_changes_nothing), cmocka_unit_test(test_a_known_matrix_comes_back),
        cmocka_unit_test(test_least_squares_is_optimal), cmocka_unit_test(test_refusals),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
