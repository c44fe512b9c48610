/*
 * peer_colour DIR: one picture of a chart for Weft and for ArgyllCMS, and Weft's figures on it.
 *
 * A Nikon D5100 under CIE LED-B5 photographs a ColorChecker (mean spectra of 30 charts), tilted, with noise;
 * what it would see of 204 cotton swatches is known too.  Writes picture.tif (linear, demosaiced), chart.cht
 * and chart.cie for scanin, cotton.ti3 for profcheck, fiducials for its -F.  The script colour_argyll.sh does
 * the rest.
 */
#include "tests/support/support.h"

#include "calibration/charts/chart_find.h"
#include "calibration/charts/homography.h"
#include "calibration/charts/patch_colour.h"
#include "core/colour.h"
#include "core/formats/image_file.h"
#include "host/photo/photo_colour.h"
#include "tests/calibration/chart_scene.h"
#include "tests/calibration/spectral_tables.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { WIDTH = 1232, HEIGHT = 816, PATCHES = 24, CLOTH_MOST = 256 };
static const double exposure = 0.8;

static spectrum observer[3], d65, lamp, sensor[3];

static void load_spectra(void)
{
    table t;
    spectrum_observer(observer);
    table_read(&t, "data/spectral/illuminants/cie_illuminants_5nm.csv");
    spectrum_from(d65, &t, table_column(&t, "D65"));
    table_free(&t);
    table_read(&t, "data/spectral/illuminants/cie_led_5nm.csv");
    spectrum_from(lamp, &t, table_column(&t, "LED-B5"));
    table_free(&t);
    table_read(&t, "data/spectral/cameras/nikon_d5100_npl_darrodi2015_5nm.csv");
    for (int c = 0; c < 3; c++)
        spectrum_from(sensor[c], &t, 1 + c);
    table_free(&t);
}

static void see(const spectrum reflectance, weft_colour_sample *sample)
{
    spectrum one;
    double xyz[3];
    for (int i = 0; i < SPECTRUM_N; i++)
        one[i] = 1;
    for (int c = 0; c < 3; c++)
        sample->camera[c] =
            spectrum_response(reflectance, lamp, sensor[c]) / spectrum_response(one, lamp, sensor[c]);
    spectrum_xyz(reflectance, d65, (const spectrum *)observer, xyz);
    weft_xyz_to_srgb(xyz, sample->reference);
    sample->used = true;
}

static void see_chart(weft_colour_sample *samples)
{
    table t;
    table_read(&t, "data/spectral/colorchecker/reflectance_babelcolor_avg30_10nm.csv");
    const double first = table_cell(&t, 0, 0), last = table_cell(&t, t.rows - 1, 0);
    for (int p = 0; p < PATCHES; p++) {
        spectrum r;
        for (int i = 0; i < SPECTRUM_N; i++)
            r[i] = table_at(&t, 1 + p, fmin(fmax(380 + 5 * i, first), last));
        see(r, &samples[p]);
    }
    table_free(&t);
}

static int see_cotton(weft_colour_sample *samples)
{
    table t;
    int n = 0;
    table_read(&t, "data/spectral/textiles/cotton_reflectance_10nm.csv");
    for (; n < t.rows && n < CLOTH_MOST; n++) {
        spectrum r;
        for (int i = 0; i < SPECTRUM_N; i++) {
            const double at = fmin(fmax((380 + 5 * i - 400) / 10.0, 0), 30);
            const int k = at < 29 ? (int)at : 29;
            r[i] = table_cell(&t, n, 1 + k) * (1 - at + k) + table_cell(&t, n, 2 + k) * (at - k);
        }
        see(r, &samples[n]);
    }
    table_free(&t);
    return n;
}

/* D50 XYZ 0..100 of linear sRGB, as ArgyllCMS counts. */
static void to_d50(const double rgb[3], double xyz[3])
{
    double d[3];
    weft_srgb_to_xyz(rgb, d);
    weft_adapt_bradford(d, weft_white_d65, weft_white_d50, xyz);
    for (int c = 0; c < 3; c++)
        xyz[c] *= 100;
}

/* The judge of both programs: CIEDE2000 in L*a*b* under D50. */
static double judge(const double seen[3], const double wanted[3])
{
    double a[3], b[3], lab_a[3], lab_b[3];
    to_d50(seen, a);
    to_d50(wanted, b);
    for (int c = 0; c < 3; c++) {
        a[c] /= 100;
        b[c] /= 100;
    }
    weft_xyz_to_lab(a, weft_white_d50, lab_a);
    weft_xyz_to_lab(b, weft_white_d50, lab_b);
    return weft_delta_e_2000(lab_a, lab_b);
}

/* A chart whose patches the drawn camera sees as the D5100 sees the real ones. */
static weft_chart drawn_chart(const weft_chart *like, const weft_colour_sample *samples)
{
    weft_chart chart = *like;
    weft_mat3 camera, back = {{0}};
    for (int k = 0; k < 3; k++) {
        double unit[3] = {0}, seen[3];
        unit[k] = 1;
        chart_scene_camera(unit, seen);
        for (int c = 0; c < 3; c++)
            camera.m[3 * c + k] = seen[c];
    }
    assert_true(weft_mat3_invert(&camera, &back));
    for (int p = 0; p < PATCHES; p++) {
        const double *const s = samples[p].camera;
        const weft_vec3 v = weft_mat3_apply(&back, (weft_vec3){s[0], s[1], s[2]});
        chart.patches[p].linear_srgb[0] = v.x;
        chart.patches[p].linear_srgb[1] = v.y;
        chart.patches[p].linear_srgb[2] = v.z;
    }
    return chart;
}

static FILE *create(const char *folder, const char *name)
{
    char path[1024];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    FILE *const file = fopen(path, "w");
    assert_non_null(file);
    return file;
}

static void write_recognition(const char *folder, const weft_chart *chart)
{
    double half_x, half_y;
    FILE *const f = create(folder, "chart.cht");
    weft_chart_half_size(chart, &half_x, &half_y);
    fprintf(f,
            "\nBOXES 25\n  F _ _ 0 0  %g 0  %g %g  0 %g\n  D ALL ALL _ _ %g %g 0 0 0 0\n"
            "  Y 1 6 A D %g %g %g %g %g %g\n\nBOX_SHRINK 4.0\n\nREF_ROTATION 0.0\n\n",
            2 * half_x, 2 * half_x, 2 * half_y, 2 * half_y, 2 * half_x, 2 * half_y, chart->patch_mm,
            chart->patch_mm, chart->border_mm, chart->border_mm, chart->pitch_mm, chart->pitch_mm);
    fprintf(f, "XLIST 12\n");
    for (int k = 0; k < 12; k++)
        fprintf(f, "  %g 1.0 1.0\n", chart->border_mm + k / 2 * chart->pitch_mm + k % 2 * chart->patch_mm);
    fprintf(f, "\nYLIST 8\n");
    for (int k = 0; k < 8; k++)
        fprintf(f, "  %g 1.0 1.0\n", chart->border_mm + k / 2 * chart->pitch_mm + k % 2 * chart->patch_mm);
    fclose(f);
}

static void write_reference(const char *folder, const weft_colour_sample *samples)
{
    FILE *const f = create(folder, "chart.cie");
    fprintf(
        f,
        "IT8.7/2\n\nNUMBER_OF_FIELDS 4\nBEGIN_DATA_FORMAT\nSAMPLE_ID XYZ_X XYZ_Y XYZ_Z\nEND_DATA_FORMAT\n\n"
        "NUMBER_OF_SETS 24\nBEGIN_DATA\n");
    for (int p = 0; p < PATCHES; p++) {
        double xyz[3];
        to_d50(samples[p].reference, xyz);
        fprintf(f, "%c%d %.6f %.6f %.6f\n", 'A' + p / 6, p % 6 + 1, xyz[0], xyz[1], xyz[2]);
    }
    fprintf(f, "END_DATA\n");
    fclose(f);
}

static void write_cotton(const char *folder, const weft_colour_sample *cotton, int n)
{
    FILE *const f = create(folder, "cotton.ti3");
    fprintf(f,
            "CTI3\n\nDESCRIPTOR \"cotton\"\nORIGINATOR \"weft\"\nDEVICE_CLASS \"INPUT\"\nCOLOR_REP "
            "\"XYZ_RGB\"\n\n"
            "NUMBER_OF_FIELDS 7\nBEGIN_DATA_FORMAT\nSAMPLE_ID XYZ_X XYZ_Y XYZ_Z RGB_R RGB_G "
            "RGB_B\nEND_DATA_FORMAT\n\n"
            "NUMBER_OF_SETS %d\nBEGIN_DATA\n",
            n);
    for (int i = 0; i < n; i++) {
        double xyz[3];
        to_d50(cotton[i].reference, xyz);
        fprintf(f, "%d %.6f %.6f %.6f %.6f %.6f %.6f\n", i + 1, xyz[0], xyz[1], xyz[2],
                100 * exposure * cotton[i].camera[0], 100 * exposure * cotton[i].camera[1],
                100 * exposure * cotton[i].camera[2]);
    }
    fprintf(f, "END_DATA\n");
    fclose(f);
}

static double mean_over(const weft_colour_sample *samples, int n, const weft_colour_model *model, double *max)
{
    double mean = 0;
    *max = 0;
    for (int i = 0; i < n; i++) {
        double rgb[3];
        weft_colour_model_apply(model, samples[i].camera, rgb);
        const double e = judge(rgb, samples[i].reference);
        mean += e / n;
        *max = fmax(*max, e);
    }
    return mean;
}

/* What was measured in the picture: as samples of a scale of one. */
static void measure(const weft_chart *chart, const weft_chart_pose *pose, const weft_chart_picture *picture,
                    const weft_colour_sample *truth, weft_colour_sample *samples)
{
    weft_patch_reading readings[WEFT_CHART_MAX_PATCHES];
    assert_ok(weft_chart_measure(chart, picture, pose, readings, err));
    for (int p = 0; p < PATCHES; p++) {
        samples[p] = truth[p];
        samples[p].camera[0] = readings[p].mean[WEFT_SITE_R] / exposure;
        samples[p].camera[1] =
            0.5 * (readings[p].mean[WEFT_SITE_G1] + readings[p].mean[WEFT_SITE_G2]) / exposure;
        samples[p].camera[2] = readings[p].mean[WEFT_SITE_B] / exposure;
    }
}

int main(int argc, char **argv)
{
    static weft_colour_sample truth[PATCHES], seen[PATCHES], cotton[CLOTH_MOST];
    const weft_chart *chart;
    char path[1024];
    if (argc != 2 || !weft_test_shared("data/spectral/SOURCE.md")) {
        fprintf(stderr, "usage: peer_colour DIR (needs the staged spectra: WEFT_SHARED)\n");
        return argc != 2 ? 2 : 77;
    }
    load_spectra();
    see_chart(truth);
    const int n_cotton = see_cotton(cotton);
    assert_ok(weft_chart_find("macbeth", "ohta1997", &chart, err));
    const weft_chart drawn = drawn_chart(chart, truth);
    const weft_mat3 view = chart_scene_view(chart, WIDTH, HEIGHT, 0.7, 3, 12, 0);
    chart_scene scene = chart_scene_make(&drawn, view);
    scene.width = WIDTH;
    scene.height = HEIGHT;
    scene.exposure = exposure;
    scene.shot = 1e-4;
    scene.read = 5e-4;
    weft_image mosaic;
    weft_photo photo = {.cfa = WEFT_CFA_RGGB};
    chart_scene_draw(&scene, &mosaic, &photo.clipped);
    const weft_chart_picture picture = {&mosaic, WEFT_CFA_RGGB, &photo.clipped};
    weft_chart_pose pose;
    assert_ok(weft_chart_locate(chart, &picture, &pose, err));
    measure(chart, &pose, &picture, truth, seen);

    photo.image = mosaic;
    assert_ok(weft_photo_develop(&photo, (const double[]){1, 1, 1}, err));
    snprintf(path, sizeof path, "%s/picture.tif", argv[1]);
    assert_ok(weft_image_write(path, &photo.image, 16, WEFT_TRANSFER_LINEAR, err));
    write_recognition(argv[1], chart);
    write_reference(argv[1], truth);
    write_cotton(argv[1], cotton, n_cotton);
    FILE *const f = create(argv[1], "fiducials");
    for (int k = 0; k < 4; k++)
        fprintf(f, "%s%.2f,%.2f", k ? "," : "", pose.corners[k][0], pose.corners[k][1]);
    fclose(f);
    weft_photo_fini(&photo);

    printf("%-28s %8s %8s %8s %8s %8s\n", "mean CIEDE2000 (D50)", "trained", "max", "held out", "cotton",
           "max");
    for (int method = 0; method < WEFT_COLOUR_METHODS; method++) {
        weft_colour_fit fit;
        char name[64];
        double max, cotton_max;
        assert_ok(weft_colour_fit_patches(seen, PATCHES, (weft_colour_method)method, &fit, err));
        const double mean = mean_over(seen, PATCHES, &fit.model, &max);
        const double cloth = mean_over(cotton, n_cotton, &fit.model, &cotton_max);
        snprintf(name, sizeof name, "weft %s", weft_colour_method_name((weft_colour_method)method));
        printf("%-28s %8.2f %8.2f %8.2f %8.2f %8.2f\n", name, mean, max, fit.held_out_mean, cloth,
               cotton_max);
    }
    return 0;
}
