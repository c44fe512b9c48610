/* The virtual scanner's colours against published numbers. */
#include "calibration/charts/chart.h"
#include "core/colour.h"
#include "core/csv.h"
#include "host/rig/spectra.h"
#include "tests/support/support.h"

#include <math.h>

static weft_spectra spectra;

static int load(void **state)
{
    (void)state;
    assert_ok(weft_spectra_load(&spectra, err));
    return 0;
}

/* CIE 015:2018: D65 x 0.31272 y 0.32903 (5 nm sums), LED-B5 x 0.3118 y 0.3236 (6598 K). */
static void white_points(void **state)
{
    (void)state;
    double xy[2];
    weft_spectra_white_point(&spectra, &spectra.d65, xy);
    assert_near(xy[0], 0.31272, 2e-5);
    assert_near(xy[1], 0.32903, 2e-5);
    weft_spectra_white_point(&spectra, &spectra.led, xy);
    assert_near(xy[0], 0.31181, 2e-5);
    assert_near(xy[1], 0.32364, 2e-5);
}

static void perfect_diffuser_is_white(void **state)
{
    (void)state;
    const weft_spectrum sheet = weft_spectrum_flat(0.5);
    double rgb[3];
    weft_spectra_srgb(&spectra, &sheet, rgb);
    for (int c = 0; c < 3; c++)
        assert_near(rgb[c], 0.5, 1e-9);
    weft_spectra_sensor_rgb(&spectra, &sheet, &spectra.led, rgb);
    assert_near(rgb[1], 0.5, 1e-12);
    assert_true(rgb[0] > 0.2 && rgb[0] < 0.5 && rgb[2] > 0.2 && rgb[2] < 0.5);
}

/* McCamy 1992 from chromaticity: good to a few kelvin here. */
static double correlated_temperature(const weft_spectrum *light)
{
    double xy[2];
    weft_spectra_white_point(&spectra, light, xy);
    const double n = (xy[0] - 0.3320) / (0.1858 - xy[1]);
    return 449 * n * n * n + 3525 * n * n + 6823.3 * n + 5520.33;
}

/* One ANSI bin of 6500 K LEDs: 6020..7040 K by the standard, 6170..7093 K for pumps 0.9..1.1 of LED-B5. */
static void pump_scales_span_a_bin(void **state)
{
    (void)state;
    const weft_spectrum weak = weft_spectra_led(&spectra, 0.9), strong = weft_spectra_led(&spectra, 1.1);
    assert_near(correlated_temperature(&spectra.led), 6597, 15);
    assert_near(correlated_temperature(&weak), 6170, 60);
    assert_near(correlated_temperature(&strong), 7093, 60);
}

/* The spectra of Ohta 1997 against X-Rite's L*a*b* of charts before November 2014: one chart against the
   mean of many; measured elsewhere as mean 0.97, maximum 1.68 (D50).  Here through D65. */
static void chart_matches_published_lab(void **state)
{
    (void)state;
    const char *const path = weft_test_need_shared("data/spectral/colorchecker/reference_lab_xyy_srgb.csv");
    weft_csv table = {0};
    assert_ok(weft_csv_read(path, &table, err));
    const int column = weft_csv_column(&table, "R_srgb_lin_before2014_bradford");
    assert_true(column > 0);
    double sum = 0, worst = 0;
    for (int patch = 0; patch < WEFT_SPECTRA_N_MACBETH; patch++) {
        double want[3], got[3], lab_want[3], lab_got[3];
        for (int c = 0; c < 3; c++)
            assert_ok(weft_csv_number(&table, patch, column + c, path, &want[c], err));
        weft_spectra_srgb(&spectra, &spectra.macbeth[patch], got);
        weft_srgb_to_lab(want, lab_want);
        weft_srgb_to_lab(got, lab_got);
        const double difference = weft_delta_e_2000(lab_want, lab_got);
        sum += difference;
        worst = fmax(worst, difference);
    }
    print_message("spectra against L*a*b*: dE2000 mean %.2f, max %.2f\n", sum / 24, worst);
    assert_true(sum / 24 < 1.2 && worst < 2.2);
    weft_csv_fini(&table);
}

static void chart_reference_is_the_same_chart(void **state)
{
    (void)state;
    const weft_chart *chart;
    assert_ok(weft_chart_find("macbeth", "ohta1997", &chart, err));
    for (int patch = 0; patch < WEFT_SPECTRA_N_MACBETH; patch++) {
        double rgb[3];
        weft_spectra_srgb(&spectra, &spectra.macbeth[patch], rgb);
        for (int c = 0; c < 3; c++)
            assert_near(rgb[c], chart->patches[patch].linear_srgb[c], 5e-4);
    }
}

static void munsell_chips_have_their_value(void **state)
{
    (void)state;
    for (double value = 2; value <= 9.5; value += 0.25) {
        const weft_spectrum chip = weft_spectra_munsell(&spectra, value);
        double rgb[3], xyz[3], white[3];
        weft_spectra_srgb(&spectra, &chip, rgb);
        weft_srgb_to_xyz(rgb, xyz);
        weft_srgb_to_xyz((double[]){1, 1, 1}, white);
        assert_near(xyz[1] / white[1], weft_munsell_reflectance(value), 1e-6);
    }
}

static void dyes_are_found_by_name(void **state)
{
    (void)state;
    const weft_spectrum *dye;
    assert_ok(weft_spectra_find_dye(&spectra, "patch142", &dye, err));
    double rgb[3];
    weft_spectra_srgb(&spectra, dye, rgb);
    assert_true(rgb[2] > 1.5 * rgb[1] && rgb[1] > rgb[0]); /* indigo */
    assert_fails(weft_spectra_find_dye(&spectra, "puce", &dye, err), WEFT_ERR_MISSING, "puce");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(white_points),
        cmocka_unit_test(perfect_diffuser_is_white),
        cmocka_unit_test(pump_scales_span_a_bin),
        cmocka_unit_test(chart_matches_published_lab),
        cmocka_unit_test(chart_reference_is_the_same_chart),
        cmocka_unit_test(munsell_chips_have_their_value),
        cmocka_unit_test(dyes_are_found_by_name),
    };
    return cmocka_run_group_tests(tests, load, NULL);
}
