/* Foreign sets: what is found in the wild, what is refused, and figures that others measured. */
#include "tests/support/support.h"

#include "core/file.h"
#include "core/formats/jpeg_bytes.h"
#include "core/formats/png_file.h"
#include "core/mem.h"
#include "host/set/compare.h"
#include "host/set/import.h"
#include "host/solve/solve.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

enum { SIDE = 24 };

static void write_text(const char *name, const char *text)
{
    assert_ok(weft_file_write(weft_test_path(name), text, strlen(text), err));
}

/* An 8-bit picture of a matte cap under one light; `gamma`: coded as sRGB would be. */
static void write_picture(const char *name, double x, double y, double z, bool gamma)
{
    weft_raster raster;
    const double length = sqrt(x * x + y * y + z * z);
    assert_ok(weft_raster_init(&raster, SIDE, SIDE, 1, 8, err));
    for (int v = 0; v < SIDE; v++)
        for (int u = 0; u < SIDE; u++) {
            const double nx = (u - 11.5) / 20, ny = (11.5 - v) / 20, nz = sqrt(1 - nx * nx - ny * ny);
            const double shade = 0.9 * fmax(0, (nx * x + ny * y + nz * z) / length);
            raster.data[v * SIDE + u] = (uint16_t)lround(255 * (gamma ? pow(shade, 1 / 2.2) : shade));
        }
    assert_ok(weft_png_write(weft_test_path(name), &raster, err));
    weft_raster_fini(&raster);
}

static const double lights[5][3] = {
    {0, 0, 1}, {0.5, 0, 0.866}, {-0.5, 0, 0.866}, {0, 0.577, 0.8167}, {0.1, -0.6, 0.7937}};

static int make_pictures(void **state)
{
    (void)state;
    assert_ok(weft_folder_create(weft_test_path("rti/sub"), err));
    for (int i = 0; i < 5; i++) {
        char name[64];
        snprintf(name, sizeof name, "rti/shot %d.png", i);
        write_picture(name, lights[i][0], lights[i][1], lights[i][2], false);
        snprintf(name, sizeof name, "rti/gamma%d.png", i);
        write_picture(name, lights[i][0], lights[i][1], lights[i][2], true);
    }
    return 0;
}

static weft_err import_lp(const char *text, const char *name, weft_import_result *result, weft_error *err)
{
    const weft_import_options options = {.transfer = WEFT_IMPORT_LINEAR, .force = true};
    weft_import_result unused;
    write_text("rti/set.lp", text);
    return weft_import(weft_test_path("rti/set.lp"), weft_test_path(name), NULL, &options,
                       result ? result : &unused, err);
}

static void load(const char *name, weft_set *set, weft_calibration *cal)
{
    char cal_name[64];
    snprintf(cal_name, sizeof cal_name, "%.*s.cal", (int)strlen(name) - 4, name);
    assert_ok(weft_set_load(weft_test_path(name), set, err));
    assert_ok(weft_calibration_load(weft_test_path(cal_name), cal, err));
}

static void test_plain_lp(void **state)
{
    (void)state;
    weft_import_result r;
    weft_set set;
    weft_calibration cal;
    assert_ok(import_lp("5\nshot 0.png 0 0 1\nshot 1.png 0.5 0 0.866\nshot 2.png -0.5 0 0.866\n"
                        "shot 3.png 0 0.577 0.8167\nshot 4.png 0.1 -0.6 0.7937\n",
                        "plain.set", &r, err));
    assert_int_equal(r.n_lights, 5);
    assert_int_equal(r.width, SIDE);
    assert_string_equal(r.kind, "lp");
    assert_true(r.has_calibration && !r.srgb && r.bits == 8);
    load("plain.set", &set, &cal);
    assert_int_equal(weft_set_n_lights(&set), 5);
    assert_true(set.complete && set.cfa == WEFT_CFA_NONE && set.transfer == WEFT_TRANSFER_LINEAR);
    assert_int_equal(set.frames[2].file[0], '/');
    assert_int_equal(strlen(set.frames[2].sha256), 64);
    assert_true(cal.lights[3].distant);
    assert_near(cal.lights[3].direction.y, 0.577, 1e-3);
    weft_set_fini(&set);
    weft_calibration_fini(&cal);
}

/* Decimal commas, tabs, CRLF, a byte-order mark, quotes, Windows and absolute paths, further columns, numbers
 * in names, a comment, a wrong count: all one set of five lights. */
static void test_lp_of_the_wild(void **state)
{
    (void)state;
    weft_import_result r;
    weft_set set;
    weft_calibration cal;
    assert_ok(import_lp("\xef\xbb\xbf"
                        "7\r\n# by hand\r\n\"shot 0.png\"\t0,0\t0,0\t1,0\r\n"
                        "C:\\Scans 2019\\coin 3\\shot 1.png 0,5 0 0,866\r\n\r\n"
                        "/no/such/folder/shot 2.png -0.5 0 0.866 17 ok\r\n"
                        "shot 3.png, 0, 0.577, 0.8167\r\n"
                        "shot 4.png;1,0;-6,0;7,937\r\n",
                        "wild.set", &r, err));
    assert_int_equal(r.n_lights, 5);
    load("wild.set", &set, &cal);
    for (int i = 0; i < 5; i++) {
        char name[32];
        snprintf(name, sizeof name, "/shot %d.png", i);
        assert_non_null(strstr(set.frames[i].file, name));
        assert_near(cal.lights[i].direction.x, lights[i][0], 2e-3);
        assert_near(cal.lights[i].direction.y, lights[i][1], 2e-3);
        assert_near(cal.lights[i].direction.z, lights[i][2], 2e-3);
    }
    weft_set_fini(&set);
    weft_calibration_fini(&cal);
}

static void test_lp_that_is_wrong(void **state)
{
    (void)state;
    assert_fails(import_lp("3\nshot 0.png 0 0 1\nshot 9.png 0 0.5 0.8\n", "bad.set", NULL, err),
                 WEFT_ERR_MISSING, "line 3: the picture");
    assert_fails(import_lp("1\nshot 0.png 0 zero 1\n", "bad.set", NULL, err), WEFT_ERR_FORMAT,
                 "line 2: wanted \"picture x y z\"");
    assert_fails(import_lp("1\nshot 0.png 0 0 0\n", "bad.set", NULL, err), WEFT_ERR_RANGE, "is zero");
    assert_fails(import_lp("3\nshot 0.png 0 0 nan\n", "bad.set", NULL, err), WEFT_ERR_FORMAT, "line 2");
    assert_fails(import_lp("12\n", "bad.set", NULL, err), WEFT_ERR_FORMAT, "names no pictures");
    assert_fails(import_lp("", "bad.set", NULL, err), WEFT_ERR_FORMAT, "names no pictures");
    assert_fails(import_lp("2\nshot 0.png 0 0 1\nshot 1.png 0.5 0 0.866\n", "bad.set", NULL, err),
                 WEFT_ERR_NODATA, "too few");
    assert_false(weft_file_exists(weft_test_path("bad.set")));
    assert_false(weft_file_exists(weft_test_path("bad.cal")));
}

/* A JPEG is read as a texture; as a measurement it would be taken for linear light. */
static void test_jpegs_are_refused(void **state)
{
    (void)state;
    uint8_t grey[16 * 16 * 3];
    unsigned char *bytes;
    size_t n;
    memset(grey, 128, sizeof grey);
    assert_ok(weft_jpeg_encode(grey, 16, 16, 95, &bytes, &n, err));
    assert_ok(weft_file_write(weft_test_path("rti/a.jpg"), bytes, n, err));
    weft_jpeg_free(bytes);
    assert_fails(import_lp("3\na.jpg 0 0 1\na.jpg 0.5 0 0.866\na.jpg 0 0.5 0.866\n", "bad.set", NULL, err),
                 WEFT_ERR_FORMAT, "a.jpg: is no camera raw, PNG, TIFF or EXR");
}

static void test_existing_outputs_are_kept(void **state)
{
    (void)state;
    const weft_import_options options = {0};
    weft_import_result r;
    assert_ok(weft_folder_create(weft_test_path("here.set"), err));
    assert_fails(
        weft_import(weft_test_path("rti/set.lp"), weft_test_path("here.set"), NULL, &options, &r, err),
        WEFT_ERR_EXISTS, "--force");
    assert_ok(weft_folder_create(weft_test_path("there.cal"), err));
    assert_fails(
        weft_import(weft_test_path("rti/set.lp"), weft_test_path("there.set"), NULL, &options, &r, err),
        WEFT_ERR_EXISTS, "there.cal");
    assert_fails(weft_import(weft_test_path("nowhere"), weft_test_path("n.set"), NULL, &options, &r, err),
                 WEFT_ERR_MISSING, "nowhere");
    assert_fails(
        weft_import(weft_test_path("rti/shot 0.png"), weft_test_path("n.set"), NULL, &options, &r, err),
        WEFT_ERR_USAGE, "neither a folder nor an .lp");
}

static void test_directions_folder(void **state)
{
    (void)state;
    weft_import_options options = {.transfer = WEFT_IMPORT_LINEAR, .copy = true};
    weft_import_result r;
    weft_set set;
    weft_calibration cal;
    assert_ok(weft_folder_create(weft_test_path("dir"), err));
    for (int i = 0; i < 4; i++) {
        char name[64];
        snprintf(name, sizeof name, "dir/im%d.png", i + 8); /* im8 im9 im10 im11: natural order */
        write_picture(name, lights[i][0], lights[i][1], lights[i][2], false);
    }
    write_text("dir/light_directions.txt", "0 0 1\n0.5 0 0.866\n-0.5 0 0.866\n0 0.577 0.8167\n");
    write_text("dir/light_intensities.txt", "1 2 4\n1 1 1\n2 2 2\n1 1 1\n");
    assert_ok(weft_import(weft_test_path("dir"), weft_test_path("dir.set"), NULL, &options, &r, err));
    load("dir.set", &set, &cal);
    assert_string_equal(set.frames[0].file, "light-00.png");
    assert_true(weft_file_exists(weft_test_path("dir.set/light-03.png")));
    assert_near(cal.lights[0].intensity[2], 4, 0);
    assert_near(cal.lights[1].direction.x, 0.5, 1e-3);
    weft_set_fini(&set);
    weft_calibration_fini(&cal);
    write_text("dir/filenames.txt", "im11.png\nim10.png\nim9.png\n");
    options.force = true;
    assert_fails(weft_import(weft_test_path("dir"), weft_test_path("dir.set"), NULL, &options, &r, err),
                 WEFT_ERR_MISMATCH, "has 4 lights, but there are 3 pictures");
    write_text("dir/filenames.txt", "im11.png\nim10.png\nim9.png\nim7.png\n");
    assert_fails(weft_import(weft_test_path("dir"), weft_test_path("dir.set"), NULL, &options, &r, err),
                 WEFT_ERR_MISSING, "im7.png");
    write_text("dir/filenames.txt", "im11.png\nim10.png\nim9.png\nim8.png\n");
    write_text("dir/light_intensities.txt", "1 2 4\n1 1 1\n");
    assert_fails(weft_import(weft_test_path("dir"), weft_test_path("dir.set"), NULL, &options, &r, err),
                 WEFT_ERR_MISMATCH, "light_intensities.txt has 2 lines");
    write_text("dir/light_intensities.txt", "1\n0\n1\n1\n");
    assert_fails(weft_import(weft_test_path("dir"), weft_test_path("dir.set"), NULL, &options, &r, err),
                 WEFT_ERR_RANGE, "line 2");
    assert_true(weft_file_exists(weft_test_path("dir.set/set.json"))); /* the first one stands */
}

static void test_transfer_is_found_out(void **state)
{
    (void)state;
    weft_import_options options = {.force = true};
    weft_import_result r;
    char lp[1024] = "5\n";
    for (int i = 0; i < 5; i++)
        snprintf(lp + strlen(lp), sizeof lp - strlen(lp), "gamma%d.png %g %g %g\n", i, lights[i][0],
                 lights[i][1], lights[i][2]);
    write_text("rti/gamma.lp", lp);
    assert_ok(weft_import(weft_test_path("rti/gamma.lp"), weft_test_path("g.set"), NULL, &options, &r, err));
    assert_true(r.srgb && r.misfit_srgb < 0.5 * r.misfit_linear);
    assert_ok(import_lp("5\nshot 0.png 0 0 1\nshot 1.png 0.5 0 0.866\nshot 2.png -0.5 0 0.866\n"
                        "shot 3.png 0 0.577 0.8167\nshot 4.png 0.1 -0.6 0.7937\n",
                        "l.set", &r, err));
    assert_true(!r.srgb && r.misfit_linear < 0.2 * r.misfit_srgb && r.misfit_linear < 0.01);
}

/* Coded pictures that are called linear all the same are not solved. */
static void test_coded_pictures_called_linear_are_refused(void **state)
{
    (void)state;
    const weft_solve_options options = {0};
    weft_import_options import = {.force = true, .transfer = WEFT_IMPORT_LINEAR};
    weft_import_result r;
    weft_set set;
    weft_calibration cal;
    weft_maps maps = {0};
    assert_ok(
        weft_import(weft_test_path("rti/gamma.lp"), weft_test_path("coded.set"), NULL, &import, &r, err));
    load("coded.set", &set, &cal);
    assert_fails(weft_solve_set(&set, &cal, weft_test_path("coded.cal"), &options, &maps, err),
                 WEFT_ERR_FORMAT, "--transfer srgb");
    assert_null(maps.normal.data);
    weft_set_fini(&set);
    weft_calibration_fini(&cal);
    import.transfer = WEFT_IMPORT_SRGB;
    assert_ok(
        weft_import(weft_test_path("rti/gamma.lp"), weft_test_path("coded.set"), NULL, &import, &r, err));
    load("coded.set", &set, &cal);
    assert_ok(weft_solve_set(&set, &cal, weft_test_path("coded.cal"), &options, &maps, err));
    weft_maps_fini(&maps);
    weft_set_fini(&set);
    weft_calibration_fini(&cal);
}

static void test_empty_folder_and_two_lists(void **state)
{
    (void)state;
    const weft_import_options options = {0};
    weft_import_result r;
    assert_ok(weft_folder_create(weft_test_path("empty"), err));
    assert_fails(weft_import(weft_test_path("empty"), weft_test_path("e.set"), NULL, &options, &r, err),
                 WEFT_ERR_MISSING, "neither an .lp file");
    write_text("empty/a.lp", "1\n");
    write_text("empty/b.lp", "1\n");
    assert_fails(weft_import(weft_test_path("empty"), weft_test_path("e.set"), NULL, &options, &r, err),
                 WEFT_ERR_USAGE, "2 .lp files");
}

/* ---- figures that others measured (SOURCE.md of the data) ---- */

static void import_data(const char *name, const char *data, weft_set *set, weft_calibration *cal)
{
    const weft_import_options options = {.transfer = WEFT_IMPORT_LINEAR};
    weft_import_result r;
    char set_name[64];
    snprintf(set_name, sizeof set_name, "%s.set", name);
    assert_ok(weft_import(data, weft_test_path(set_name), NULL, &options, &r, err));
    load(set_name, set, cal);
}

static weft_spread solve_and_compare(const char *name, const weft_set *set, const weft_calibration *cal,
                                     const char *method, const char *truth_folder)
{
    weft_solve_options options = {0};
    weft_maps maps = {0}, truth = {0};
    weft_maps_difference d;
    char cal_name[64];
    snprintf(cal_name, sizeof cal_name, "%s.cal", name);
    assert_ok(weft_solve_find_method(method, &options.method, err));
    assert_ok(weft_solve_set(set, cal, weft_test_path(cal_name), &options, &maps, err));
    assert_ok(weft_maps_load(truth_folder, &truth, err));
    assert_ok(weft_compare_maps(&maps, &truth, NULL, &d, err));
    print_message("| %-14s | %-6s | %6.2f | %6.2f | %6zu |\n", name, method, d.normal_deg.mean,
                  d.normal_deg.median, d.normal_deg.n);
    weft_maps_fini(&maps);
    weft_maps_fini(&truth);
    return d.normal_deg;
}

/* Least squares as others measured it, to 0.05 degrees; the reference likewise; robust better. */
static void test_data_of_others(void **state)
{
    (void)state;
    static const struct {
        const char *name, *data, *truth;
        double lsq_mean;
    } sets[] = {
        {"gray", "data/ps/psm/gray/gray.lp", "data/ps/psm/gray/truth.maps", 5.54},
        {"bunny_lambert", "data/ps/bunny/bunny_lambert", "data/ps/bunny/truth.maps", 5.13},
        {"bunny_specular", "data/ps/bunny/bunny_specular", "data/ps/bunny/truth.maps", 14.15},
    };
    print_message("| data           | method |   mean | median |  px    |\n");
    for (size_t i = 0; i < sizeof sets / sizeof sets[0]; i++) {
        weft_set set;
        weft_calibration cal;
        char truth[1024];
        import_data(sets[i].name, weft_test_need_shared(sets[i].data), &set, &cal);
        snprintf(truth, sizeof truth, "%s", weft_test_need_shared(sets[i].truth));
        const double lsq = solve_and_compare(sets[i].name, &set, &cal, "lsq", truth).mean;
        const double svd = solve_and_compare(sets[i].name, &set, &cal, "svd", truth).mean;
        const double robust = solve_and_compare(sets[i].name, &set, &cal, "robust", truth).mean;
        assert_near(lsq, sets[i].lsq_mean, 0.05);
        assert_near(svd, lsq, 0.001);
        assert_true(robust < 0.9 * lsq);
        weft_set_fini(&set);
        weft_calibration_fini(&cal);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_plain_lp),
        cmocka_unit_test(test_lp_of_the_wild),
        cmocka_unit_test(test_lp_that_is_wrong),
        cmocka_unit_test(test_jpegs_are_refused),
        cmocka_unit_test(test_existing_outputs_are_kept),
        cmocka_unit_test(test_directions_folder),
        cmocka_unit_test(test_transfer_is_found_out),
        cmocka_unit_test(test_coded_pictures_called_linear_are_refused),
        cmocka_unit_test(test_empty_folder_and_two_lists),
        cmocka_unit_test(test_data_of_others),
    };
    return cmocka_run_group_tests(tests, make_pictures, NULL);
}
