/* The colour matrix against spectral simulations of real sensors, and against staged least-squares vectors.
 */
#include "tests/support/support.h"

#include "calibration/charts/colour_fit.h"
#include "calibration/charts/colour_sequence.h"
#include "calibration/gamut.h"
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

static double error_of(const weft_colour_sample *sample, const weft_colour_model *model)
{
    double rgb[3], seen[3], wanted[3];
    weft_colour_model_apply(model, sample->camera, rgb);
    weft_srgb_to_lab(rgb, seen);
    weft_srgb_to_lab(sample->reference, wanted);
    return weft_delta_e_2000(seen, wanted);
}

static double mean_error(const weft_colour_sample *samples, int n, const weft_colour_model *model)
{
    double mean = 0;
    for (int i = 0; i < n; i++)
        mean += error_of(&samples[i], model) / n;
    return mean;
}

/* Figures of an independent program for the same data, and what is promised. */
static const struct floor_figures {
    weft_colour_method method;
    double trained, held_out, cotton, rank;
    double held_out_most, cotton_most;
} floors[2] = {
    {WEFT_COLOUR_MATRIX, 0.94, 1.08, 0.86, 3, 1.25, 1.05},
    {WEFT_COLOUR_ROOT_POLYNOMIAL, 0.66, 0.86, 0.81, 6, 1.05, 1.00},
};

static void test_d5100_under_led_b5(void **state)
{
    (void)state;
    simulation s;
    static weft_colour_sample cloth[256];
    weft_colour_sample samples[24];
    simulate(&s, d5100, cie_leds, "LED-B5");
    assert_int_equal(see_all(&s, babel, samples, 24), 24);
    const int n = see_cloth(&s, "data/spectral/textiles/cotton_reflectance_10nm.csv", cloth, 256);
    assert_true(n > 200);
    for (int method = 0; method < WEFT_COLOUR_METHODS; method++) {
        weft_colour_fit fit;
        assert_ok(weft_colour_fit_patches(samples, 24, (weft_colour_method)method, &fit, err));
        const double cotton = mean_error(cloth, n, &fit.model);
        print_message(
            "D5100, LED-B5, %s: before %.2f, trained %.2f/%.2f, held out %.2f/%.2f, %d cotton swatches "
            "%.2f, condition %.1f\n",
            weft_colour_method_name(fit.model.method), fit.before_mean, fit.trained_mean, fit.trained_max,
            fit.held_out_mean, fit.held_out_max, n, cotton, fit.condition);
        assert_true(fit.before_mean > 3 * fit.trained_mean && fit.held_out_mean > fit.trained_mean);
        if (method >= 2) { /* more terms fit the patches better, nothing else */
            assert_true(fit.trained_mean < 2 && fit.held_out_mean < 2.5 && cotton < 2);
            continue;
        }
        const struct floor_figures *const f = &floors[method];
        assert_near(fit.trained_mean, f->trained, 0.1);
        assert_near(fit.held_out_mean, f->held_out, 0.1);
        assert_near(cotton, f->cotton, 0.15);
        assert_true(fit.held_out_mean <= f->held_out_most && cotton <= f->cotton_most);
        assert_true(fit.rank == f->rank && fit.condition > 3 && fit.condition < 300);
    }
}

/* A model fitted at one exposure, applied to pictures of half of it and brought back by a factor: what does
 * the eye see?  Nothing with matrix and root-polynomial; the sequence has offsets. */
static void test_half_the_exposure(void **state)
{
    (void)state;
    simulation s;
    weft_colour_sample samples[24];
    simulate(&s, d5100, cie_leds, "LED-B5");
    see_all(&s, babel, samples, 24);
    for (int method = 0; method < WEFT_COLOUR_METHODS; method++) {
        weft_colour_fit fit;
        double mean = 0;
        assert_ok(weft_colour_fit_patches(samples, 24, (weft_colour_method)method, &fit, err));
        for (int i = 0; i < 24; i++) {
            double half[3], rgb[3], seen[3], wanted[3];
            for (int c = 0; c < 3; c++)
                half[c] = 0.5 * samples[i].camera[c];
            weft_colour_model_apply(&fit.model, half, rgb);
            for (int c = 0; c < 3; c++)
                rgb[c] *= 2;
            weft_srgb_to_lab(rgb, seen);
            weft_srgb_to_lab(samples[i].reference, wanted);
            mean += weft_delta_e_2000(seen, wanted) / 24;
        }
        print_message("%s: %.3f at half the exposure, %.3f at the whole\n",
                      weft_colour_method_name((weft_colour_method)method), mean, fit.trained_mean);
        if (method != WEFT_COLOUR_SEQUENCE)
            assert_near(mean, fit.trained_mean, 0.05);
    }
}

/* A row of floats is what single pixels are. */
static void test_rows_are_pixels(void **state)
{
    (void)state;
    simulation s;
    weft_colour_sample samples[24];
    simulate(&s, d5100, cie_leds, "LED-B5");
    see_all(&s, babel, samples, 24);
    for (int method = 0; method < WEFT_COLOUR_METHODS; method++) {
        weft_colour_fit fit;
        float r[26], g[26], b[26];
        assert_ok(weft_colour_fit_patches(samples, 24, (weft_colour_method)method, &fit, err));
        for (int i = 0; i < 26; i++) { /* black, and noise below it, too */
            r[i] = i < 24 ? (float)samples[i].camera[0] : i == 24 ? 0 : -0.01F;
            g[i] = i < 24 ? (float)samples[i].camera[1] : 0;
            b[i] = i < 24 ? (float)samples[i].camera[2] : i == 24 ? 0 : 0.02F;
        }
        float *const rows[3] = {r, g, b};
        weft_colour_model_apply_row(&fit.model, rows, 26);
        for (int i = 0; i < 26; i++) {
            double one[3] = {i == 25 ? -0.01 : 0, 0, i == 25 ? 0.02 : 0};
            weft_colour_model_apply(&fit.model, i < 24 ? samples[i].camera : one, one);
            assert_near((double)r[i], one[0], 2e-6);
            assert_near((double)g[i], one[1], 2e-6);
            assert_near((double)b[i], one[2], 2e-6);
            assert_true(fabs(one[0]) < 2 && fabs(one[1]) < 2 && fabs(one[2]) < 2);
        }
    }
}

/* A cubic that would turn back inside the range of the patches is left out; the rest is the affine map. */
static void test_a_cubic_that_swaps_colours_is_left_out(void **state)
{
    (void)state;
    double x[24][3], y[24][3];
    weft_colour_sequence guarded, plain;
    uint64_t seed = 5;
    for (int i = 0; i < 24; i++)
        for (int c = 0; c < 3; c++) {
            x[i][c] = weft_test_random(&seed);
            y[i][c] = x[i][c] + 0.45 * sin(2 * M_PI * x[i][c]); /* falls in the middle */
        }
    assert_int_equal(
        weft_colour_sequence_fit(24, (const double(*)[3])x, (const double(*)[3])y, true, &guarded, NULL), 4);
    assert_int_equal(
        weft_colour_sequence_fit(24, (const double(*)[3])x, (const double(*)[3])y, false, &plain, NULL), 4);
    assert_true(plain.has_cubic && !guarded.has_cubic);
    double affine[3][4], out[3];
    assert_int_equal(weft_colour_affine_fit(24, (const double(*)[3])x, (const double(*)[3])y, affine, NULL),
                     4);
    weft_colour_sequence_apply(&guarded, x[3], out);
    for (int c = 0; c < 3; c++)
        assert_near(out[c],
                    affine[c][0] * x[3][0] + affine[c][1] * x[3][1] + affine[c][2] * x[3][2] + affine[c][3],
                    1e-12);
}

static void test_gamut(void **state)
{
    (void)state;
    /* A cube: six faces, distances as ruled on paper. */
    double corners[9][3];
    weft_gamut gamut;
    for (int i = 0; i < 8; i++)
        for (int c = 0; c < 3; c++)
            corners[i][c] = (i >> c & 1) ? 0.9 : 0.1;
    corners[8][0] = corners[8][1] = corners[8][2] = 0.5; /* inside: no corner of the hull */
    weft_gamut_init(&gamut, 9, (const double(*)[3])corners);
    assert_int_equal(gamut.n_faces, 6);
    assert_near(weft_gamut_distance(&gamut, (const double[]){1.2, 0.5, 0.5}), 0.3, 1e-6);
    assert_near(weft_gamut_distance(&gamut, (const double[]){0.5, 0.2, 0.5}), -0.1, 1e-6);
    const weft_chart *chart;
    double points[24][3];
    assert_ok(weft_chart_find("macbeth", "ohta1997", &chart, err));
    for (int i = 0; i < 24; i++)
        memcpy(points[i], chart->patches[i].linear_srgb, sizeof points[i]);
    weft_gamut_init(&gamut, 24, (const double(*)[3])points);
    print_message("the chart's hull has %d faces\n", gamut.n_faces);
    assert_in_range(gamut.n_faces, 12, 44);
    for (int i = 0; i < 24; i++)
        assert_true(weft_gamut_distance(&gamut, points[i]) < 1e-6);
    assert_true(weft_gamut_distance(&gamut, (const double[]){0, 0.9, 0}) > 0.1); /* no paint is so green */
    for (int i = 0; i < 24; i++)
        points[i][0] = points[i][1] = points[i][2] = i / 24.0;
    weft_gamut_init(&gamut, 24, (const double(*)[3])points); /* greys span nothing */
    assert_int_equal(gamut.n_faces, 0);
    assert_near(weft_gamut_distance(&gamut, (const double[]){9, 0, 0}), 0, 0);

    weft_image image;
    weft_gamut_survey survey;
    assert_ok(weft_image_init(&image, 4, 1, 3, err));
    static const float pixels[4][3] = {
        {0.5F, 0.5F, 0.5F}, {0.01F, 0.01F, 0.01F}, {1, 1, 1}, {0.2F, 0.89F, 0.2F}};
    for (int i = 0; i < 4; i++)
        for (int c = 0; c < 3; c++)
            weft_image_row(&image, c, 0)[i] = pixels[i][c];
    weft_gamut_init(&gamut, 9, (const double(*)[3])corners);
    weft_gamut_look(&gamut, 9, (const double(*)[3])corners, &image, NULL, &survey);
    assert_true(survey.counted == 4 && survey.outside == 2 && survey.darker == 1 && survey.brighter == 1);
    assert_near(survey.distance_max, 0.1, 1e-6);
    assert_near(survey.distance_mean, 0.095, 1e-6);
    weft_image_fini(&image);
}

static void test_a_lamp_without_red_is_worse(void **state)
{
    (void)state;
    simulation s;
    weft_colour_sample samples[24];
    weft_colour_fit fit;
    simulate(&s, d5100, nist_leds, "Phosphor LED YAG");
    see_all(&s, babel, samples, 24);
    assert_ok(weft_colour_fit_patches(samples, 24, WEFT_COLOUR_MATRIX, &fit, err));
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
    assert_ok(weft_colour_fit_patches(samples, 24, WEFT_COLOUR_MATRIX, &full, err));
    for (int i = 0; i < 24; i++)
        for (int c = 0; c < 3; c++)
            samples[i].camera[c] *= 0.5;
    assert_ok(weft_colour_fit_patches(samples, 24, WEFT_COLOUR_MATRIX, &half, err));
    for (int i = 0; i < 9; i++)
        assert_near(half.model.matrix.m[i], 2 * full.model.matrix.m[i], 1e-9);
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
    assert_ok(weft_colour_fit_patches(samples, 24, WEFT_COLOUR_MATRIX, &fit, err));
    for (int i = 0; i < 9; i++)
        assert_near(fit.model.matrix.m[i], truth.m[i], 1e-10);
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
            assert_ok(weft_colour_fit_patches(samples, n, WEFT_COLOUR_MATRIX, &fit, err));
            for (int out = 0; out < 3; out++)
                for (int in = 0; in < 3; in++) {
                    double product = 0, size = 0;
                    for (int i = 0; i < n; i++) {
                        const double *const ref = samples[i].reference;
                        const double w = 1 / fmax(weft_luminance(ref[0], ref[1], ref[2]), 0.01);
                        double residual = -ref[out];
                        for (int k = 0; k < 3; k++)
                            residual += fit.model.matrix.m[3 * out + k] * samples[i].camera[k];
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
    assert_fails(weft_colour_fit_patches(samples, 24, WEFT_COLOUR_MATRIX, &fit, err), WEFT_ERR_NODATA,
                 "8 patches are usable");
    for (int i = 0; i < 24; i++)
        samples[i].used = true;
    assert_fails(weft_colour_fit_patches(samples, 24, WEFT_COLOUR_MATRIX, &fit, err), WEFT_ERR_NODATA,
                 "only 1 of 3 columns");
    samples[5].camera[1] = (double)NAN;
    assert_fails(weft_colour_fit_patches(samples, 24, WEFT_COLOUR_MATRIX, &fit, err), WEFT_ERR_NODATA,
                 "patch 6");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_d5100_under_led_b5),
        cmocka_unit_test(test_half_the_exposure),
        cmocka_unit_test(test_rows_are_pixels),
        cmocka_unit_test(test_a_cubic_that_swaps_colours_is_left_out),
        cmocka_unit_test(test_gamut),
        cmocka_unit_test(test_a_lamp_without_red_is_worse),
        cmocka_unit_test(test_exposure_changes_nothing),
        cmocka_unit_test(test_a_known_matrix_comes_back),
        cmocka_unit_test(test_least_squares_is_optimal),
        cmocka_unit_test(test_refusals),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
