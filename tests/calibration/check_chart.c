/* The charts' numbers against the spectra and formulas they are said to come from. */
#include "tests/support/support.h"

#include "calibration/charts/chart.h"
#include "core/linalg.h"
#include "tests/calibration/spectral_tables.h"

#include <stdio.h>
#include <string.h>

/* XYZ to linear sRGB by the inverse of the four-digit matrix, written out here on its own. */
static void to_srgb(const double xyz[3], double rgb[3])
{
    const weft_mat3 forward = {{0.4124, 0.3576, 0.1805, 0.2126, 0.7152, 0.0722, 0.0193, 0.1192, 0.9505}};
    weft_mat3 inverse;
    assert_true(weft_mat3_invert(&forward, &inverse));
    const weft_vec3 v = weft_mat3_apply(&inverse, (weft_vec3){xyz[0], xyz[1], xyz[2]});
    rgb[0] = v.x;
    rgb[1] = v.y;
    rgb[2] = v.z;
}

static void test_ohta_is_what_its_spectra_give(void **state)
{
    (void)state;
    table spectra, lights;
    spectrum observer[3], d65, patch;
    spectrum_observer(observer);
    table_read(&lights, "data/spectral/illuminants/cie_illuminants_5nm.csv");
    spectrum_from(d65, &lights, table_column(&lights, "D65"));
    table_read(&spectra, "data/spectral/colorchecker/reflectance_ohta1997_5nm.csv");
    const weft_chart *chart;
    assert_ok(weft_chart_find("macbeth", "ohta1997", &chart, err));
    for (int p = 0; p < 24; p++) {
        assert_int_equal(
            strncmp(chart->patches[p].name, spectra.names[1 + p], strlen(chart->patches[p].name)), 0);
        spectrum_from(patch, &spectra, 1 + p);
        double xyz[3], rgb[3];
        spectrum_xyz(patch, d65, (const spectrum *)observer, xyz);
        to_srgb(xyz, rgb);
        for (int c = 0; c < 3; c++)
            assert_near(chart->patches[p].linear_srgb[c], rgb[c], 1e-6);
    }
    table_free(&spectra);
    table_free(&lights);
}

static void test_published_editions_are_the_published_lab(void **state)
{
    (void)state;
    static const char *const editions[2] = {"before2014", "after2014"};
    table t;
    table_read(&t, "data/spectral/colorchecker/reference_lab_xyy_srgb.csv");
    for (int e = 0; e < 2; e++) {
        const weft_chart *chart;
        assert_ok(weft_chart_find("macbeth", editions[e], &chart, err));
        for (int c = 0; c < 3; c++) {
            char name[64];
            snprintf(name, sizeof name, "%c_srgb_lin_%s_bradford", "RGB"[c], editions[e]);
            const int column = table_column(&t, name);
            for (int p = 0; p < 24; p++) /* the staged columns use a longer matrix: 1.6e-4 at most */
                assert_near(chart->patches[p].linear_srgb[c], table_cell(&t, p, column), 2e-4);
        }
    }
    table_free(&t);
}

static void test_munsell_values_follow_the_standard(void **state)
{
    (void)state;
    table t;
    table_read(&t, "data/spectral/munsell/neutral_value_to_Y.csv");
    assert_true(t.rows >= 41);
    for (int r = 0; r < t.rows; r++)
        assert_near(100 * weft_munsell_reflectance(table_cell(&t, r, 0)), table_cell(&t, r, 1), 5e-5);
    const weft_chart *chart;
    assert_ok(weft_chart_find("munsell", "", &chart, err));
    for (int p = 0; p < 12; p++) {
        const double v = chart->patches[p].munsell_value;
        assert_true(v >= 2 && v <= 9.5); /* the matte scale */
        assert_true(p == 0 || v < chart->patches[p - 1].munsell_value);
        for (int c = 0; c < 3; c++)
            assert_near(chart->patches[p].linear_srgb[c], weft_munsell_reflectance(v), 5e-7);
    }
    table_free(&t);
}

static void test_geometry(void **state)
{
    (void)state;
    const weft_chart *chart;
    double x, y;
    assert_ok(weft_chart_find("macbeth", NULL, &chart, err));
    assert_string_equal(chart->edition, "ohta1997");
    weft_chart_patch_centre(chart, 0, &x, &y);
    assert_true(x == -50 && y == 30);
    weft_chart_patch_centre(chart, 23, &x, &y);
    assert_true(x == 50 && y == -30);
    weft_chart_patch_centre(chart, 6, &x, &y);
    assert_true(x == -50 && y == 10);
}

static void test_unknown_charts_are_refused_with_the_list(void **state)
{
    (void)state;
    const weft_chart *chart = NULL;
    assert_fails(weft_chart_find("it8", "", &chart, err), WEFT_ERR_USAGE,
                 "macbeth (ohta1997, before2014, after2014); munsell (nominal)");
    assert_fails(weft_chart_find("munsell", "2031", &chart, err), WEFT_ERR_USAGE, "of edition \"2031\"");
    assert_null(chart);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_ohta_is_what_its_spectra_give),
        cmocka_unit_test(test_published_editions_are_the_published_lab),
        cmocka_unit_test(test_munsell_values_follow_the_standard),
        cmocka_unit_test(test_geometry),
        cmocka_unit_test(test_unknown_charts_are_refused_with_the_list),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
