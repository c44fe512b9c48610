/* Plain photographs, corrected by a chart in one of them: drawn charts in, colours, refusals and batches out.
 */
#include "tests/support/support.h"

#include "calibration/charts/homography.h"
#include "core/colour.h"
#include "core/file.h"
#include "core/formats/exr_file.h"
#include "core/formats/icc_profile.h"
#include "core/formats/image_file.h"
#include "core/formats/png_file.h"
#include "core/json.h"
#include "core/mem.h"
#include "host/cli/command.h"
#include "host/photo/photo_colour.h"
#include "tests/calibration/chart_scene.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static const weft_chart *macbeth(void)
{
    const weft_chart *chart;
    assert_ok(weft_chart_find("macbeth", "ohta1997", &chart, err));
    return chart;
}

/* A path of this test's folder that lasts. */
static char *path_of(const char *name)
{
    static char paths[32][300];
    static int next;
    char *const p = paths[next++ % 32];
    snprintf(p, sizeof paths[0], "%s", weft_test_path(name));
    return p;
}

/* Runs a command line (split at blanks); what it printed on stderr comes back. */
static int run(char said[4096], const char *format, ...) WEFT_PRINTF(2, 3);
static int run(char said[4096], const char *format, ...)
{
    char line[4096], *words[64], *rest = line;
    int n = 0;
    va_list list;
    va_start(list, format);
    vsnprintf(line, sizeof line, format, list);
    va_end(list);
    for (char *w; (w = strtok_r(rest, " ", &rest)) && n < 64;)
        words[n++] = w;
    FILE *const file = tmpfile();
    assert_non_null(file);
    fflush(stderr);
    const int kept = dup(2);
    dup2(fileno(file), 2);
    const int status = weft_cli_main(n, words);
    fflush(stderr);
    dup2(kept, 2);
    close(kept);
    rewind(file);
    const size_t got = fread(said, 1, 4095, file);
    said[got] = '\0';
    fclose(file);
    return status;
}

static void write_dng(const weft_image *values, const char *path, double exposure_s)
{
    weft_mosaic mosaic;
    const weft_frame_info info = {
        .exposure_s = exposure_s, .gain = 1, .iso = 100, .make = "Weft", .model = "Test"};
    assert_ok(weft_mosaic_init(&mosaic, values->width, values->height, WEFT_CFA_RGGB, err));
    for (int i = 0; i < 4; i++)
        mosaic.black[i] = 256;
    mosaic.white = 15871;
    for (size_t i = 0; i < weft_image_plane_size(values); i++)
        mosaic.data[i] = (uint16_t)lrint(256 + (15871 - 256) * fmin(fmax((double)values->data[i], 0), 1));
    assert_ok(weft_dng_write(path, &mosaic, &info, err));
    weft_mosaic_fini(&mosaic);
}

static chart_scene scene_of(weft_mat3 view)
{
    chart_scene scene = chart_scene_make(macbeth(), view);
    scene.shot = 1e-5;
    scene.read = 2e-4;
    scene.exposure = 0.8;
    return scene;
}

static void draw_dng(const chart_scene *scene, const char *path, double exposure_s)
{
    weft_image mosaic;
    weft_mask clipped;
    chart_scene_draw(scene, &mosaic, &clipped);
    write_dng(&mosaic, path, exposure_s);
    weft_image_fini(&mosaic);
    weft_mask_fini(&clipped);
}

static weft_mat3 turned(double fill, double turn, double tilt)
{
    return chart_scene_view(macbeth(), 616, 408, fill, turn, tilt, 0);
}

/* CIEDE2000 of the middle of every patch of a corrected picture (linear sRGB) against the reference. */
static double error_of(const weft_image *picture, const weft_mat3 *view, double *worst)
{
    double mean = 0;
    *worst = 0;
    for (int p = 0; p < 24; p++) {
        double x, y, u, v, rgb[3] = {0}, seen[3], wanted[3];
        weft_chart_patch_centre(macbeth(), p, &x, &y);
        assert_true(weft_homography_apply(view, x, y, &u, &v));
        for (int k = 0; k < 49; k++)
            for (int c = 0; c < 3; c++)
                rgb[c] += (double)weft_image_sample(picture, c, u + k % 7 - 3, v + k / 7 - 3) / 49;
        weft_srgb_to_lab(rgb, seen);
        weft_srgb_to_lab(macbeth()->patches[p].linear_srgb, wanted);
        const double e = weft_delta_e_2000(seen, wanted);
        mean += e / 24;
        *worst = fmax(*worst, e);
    }
    return mean;
}

/* The drawn camera is a mixture of the three colours: a matrix undoes it, whatever way the chart lies. */
static void test_any_way_round(void **state)
{
    (void)state;
    char said[4096];
    const char *const photo = path_of("way.dng"), *const out = path_of("way");
    for (int turn = 0; turn < 360; turn += 60) {
        const weft_mat3 view = turned(0.6, turn, turn % 120 ? 15 : 0);
        const chart_scene scene = scene_of(view);
        weft_image picture;
        double worst;
        draw_dng(&scene, photo, 0.01);
        assert_int_equal(
            run(said, "weft calibrate colour --apply %s --chart-photo %s -o %s --format exr --force -q",
                photo, photo, out),
            0);
        assert_ok(weft_image_read(path_of("way/way.exr"), WEFT_TRANSFER_LINEAR, &picture, err));
        const double mean = error_of(&picture, &view, &worst);
        if (turn == 180)
            print_message("upside down: patches off by %.3f CIEDE2000 in the mean, %.3f at most\n", mean,
                          worst);
        assert_true(mean < 0.35 && worst < 1.5);
        weft_image_fini(&picture);
    }
}

/* The files hold what they say: 8-bit sRGB codes, 16-bit linear ones, and a profile. */
static void test_encodings(void **state)
{
    (void)state;
    static const struct {
        const char *options, *file;
        weft_transfer transfer;
    } kinds[] = {{"--format png --bits 8", "kinds/kind.png", WEFT_TRANSFER_SRGB},
                 {"--format tiff", "kinds/kind.tif", WEFT_TRANSFER_SRGB},
                 {"--format tiff --encoding linear", "kinds/kind.tif", WEFT_TRANSFER_LINEAR},
                 {"--format png --encoding linear", "kinds/kind.png", WEFT_TRANSFER_LINEAR}};
    char said[4096], command[600];
    const char *const photo = path_of("kind.dng"), *const out = path_of("kinds");
    const weft_mat3 view = turned(0.6, 10, 0);
    const chart_scene scene = scene_of(view);
    draw_dng(&scene, photo, 0.01);
    for (size_t k = 0; k < sizeof kinds / sizeof kinds[0]; k++) {
        weft_image picture;
        double worst;
        assert_int_equal(run(said, "weft calibrate colour --apply %s --chart-photo %s -o %s %s --force -q",
                             photo, photo, out, kinds[k].options),
                         0);
        assert_ok(weft_image_read(path_of(kinds[k].file), kinds[k].transfer, &picture, err));
        assert_true(error_of(&picture, &view, &worst) < 0.4);
        weft_image_fini(&picture);
        const bool linear = kinds[k].transfer == WEFT_TRANSFER_LINEAR;
        snprintf(command, sizeof command, "exiftool -s3 -ProfileDescription '%s' 2>/dev/null | grep -qx '%s'",
                 path_of(kinds[k].file), linear ? "linear sRGB" : "sRGB");
        if (system("exiftool -ver >/dev/null 2>&1") == 0)
            assert_int_equal(system(command), 0);
    }
}

/* Light that is half as strong on one side, with and without the blank sheet. */
static void test_uneven_light(void **state)
{
    (void)state;
    char said[4096];
    const weft_mat3 view = turned(0.55, 95, 8);
    chart_scene scene = scene_of(view), sheet;
    const char *const photo = path_of("uneven.dng"), *const flat = path_of("sheet.dng");
    weft_image picture;
    double worst;
    scene.fall_u = -0.35;
    sheet = scene;
    sheet.chart = NULL;
    sheet.table = 0.9;
    sheet.clutter = 0;
    sheet.exposure = 0.5;
    draw_dng(&scene, photo, 0.01);
    draw_dng(&sheet, flat, 0.01);
    assert_int_equal(run(said,
                         "weft calibrate colour --apply %s --chart-photo %s --flat %s -o %s --format exr -q",
                         photo, photo, flat, path_of("even")),
                     0);
    assert_null(strstr(said, "warning"));
    assert_ok(weft_image_read(path_of("even/uneven.exr"), WEFT_TRANSFER_LINEAR, &picture, err));
    const double mean = error_of(&picture, &view, &worst);
    print_message("light 2 : 1 over the picture, flattened: %.3f CIEDE2000\n", mean);
    assert_true(mean < 0.4);
    weft_image_fini(&picture);
    assert_int_equal(run(said, "weft calibrate colour --apply %s --chart-photo %s -o %s --format exr", photo,
                         photo, path_of("uneven")),
                     0);
    assert_non_null(strstr(said, "the light changes by"));
    json_t *manifest;
    assert_ok(weft_json_load(path_of("uneven/corrected.json"), &manifest, err));
    const json_t *const colour = json_object_get(json_object_get(manifest, "correction"), "colour");
    const double held =
        json_number_value(json_object_get(json_object_get(colour, "delta_e_2000"), "held_out_mean"));
    print_message("not flattened, its slope allowed for in the fit: held out %.3f\n", held);
    assert_true(held < 0.6);
    json_decref(manifest);
}

/* A drawn photograph in memory, and what a fit to it says. */
static void fit_scene(const chart_scene *scene, int stained, double part, weft_photo_chart *seen)
{
    weft_photo photo = {.cfa = WEFT_CFA_RGGB};
    weft_photo_correction correction;
    const weft_texts none = {0};
    chart_scene_draw(scene, &photo.image, &photo.clipped);
    if (stained >= 0) { /* `part` of the patch's width is half as bright */
        double x, y, u, v;
        weft_chart_patch_centre(macbeth(), stained, &x, &y);
        assert_true(weft_homography_apply(&scene->to_pixel, x, y, &u, &v));
        const int half = 12;
        for (int j = -half; j <= half; j++)
            for (int i = -half; i <= -half + (int)(2 * half * part); i++)
                weft_image_row(&photo.image, 0, (int)v + j)[(int)u + i] *= 0.5F;
    }
    assert_ok(weft_photo_correction_fit(&photo, macbeth(), NULL, &none, WEFT_COLOUR_MATRIX, seen, &correction,
                                        err));
    weft_photo_fini(&photo);
}

/* A stain over a fifth or a half of a patch leaves it out by name; noise and a slope of the light do not. */
static void test_stained_patches(void **state)
{
    (void)state;
    weft_photo_chart seen;
    chart_scene scene = scene_of(turned(0.6, 0, 0));
    static const double parts[2] = {0.3, 0.5};
    for (int k = 0; k < 2; k++) {
        fit_scene(&scene, 8, parts[k], &seen);
        for (int p = 0; p < 24; p++)
            if (p == 8)
                assert_ptr_equal(seen.colours[p].excluded, weft_patch_stained);
            else
                assert_null(seen.colours[p].excluded);
        assert_int_equal(seen.fit.n_used, 23);
    }
    scene.fall_u = -0.35;
    scene.fall_v = 0.2;
    scene.shot = 1e-3; /* a full well of 1000 electrons */
    scene.read = 3e-3;
    fit_scene(&scene, -1, 0, &seen);
    for (int p = 0; p < 24; p++)
        assert_null(seen.colours[p].excluded);
}

/* Corners by hand where the chart does not stand out, and patches left out by hand. */
static void test_corners_and_patches_by_hand(void **state)
{
    (void)state;
    char said[4096], corners[200] = "";
    const weft_mat3 view = turned(0.6, 30, 0);
    const chart_scene scene = scene_of(view);
    const char *const photo = path_of("hand.dng");
    static const double sign[4][2] = {{-1, 1}, {1, 1}, {1, -1}, {-1, -1}};
    double x, y, u, v;
    weft_chart_half_size(macbeth(), &x, &y);
    for (int k = 0; k < 4; k++) {
        assert_true(weft_homography_apply(&view, sign[k][0] * x, sign[k][1] * y, &u, &v));
        snprintf(corners + strlen(corners), sizeof corners - strlen(corners), "%s%.0f,%.0f", k ? "," : "", u,
                 v);
    }
    draw_dng(&scene, photo, 0.01);
    assert_int_equal(run(said,
                         "weft calibrate colour --apply %s --chart-photo %s -o %s -q --corners %s --exclude "
                         "cyan --overlay %s",
                         photo, photo, path_of("hand"), corners, path_of("hand.png")),
                     0);
    assert_true(weft_file_exists(path_of("hand.png")));
    json_t *manifest;
    assert_ok(weft_json_load(path_of("hand/corrected.json"), &manifest, err));
    const json_t *const colour = json_object_get(json_object_get(manifest, "correction"), "colour");
    assert_int_equal(json_array_size(json_object_get(colour, "gamut")), 3 * 23);
    json_decref(manifest);
    assert_int_equal(run(said, "weft calibrate colour --apply %s --chart-photo %s -o %s --corners 1,2,3",
                         photo, photo, path_of("hand2")),
                     2);
    assert_int_equal(run(said, "weft calibrate colour --apply %s --chart-photo %s -o %s --exclude puce",
                         photo, photo, path_of("hand2")),
                     2);
}

/* Half the exposure is made up for by the files' own shutter times. */
static void test_exposures(void **state)
{
    (void)state;
    char said[4096];
    const weft_mat3 view = turned(0.6, 200, 0);
    chart_scene scene = scene_of(view);
    weft_image picture;
    double worst;
    draw_dng(&scene, path_of("full.dng"), 0.02);
    scene.exposure *= 0.5;
    draw_dng(&scene, path_of("half.dng"), 0.01);
    assert_int_equal(run(said, "weft calibrate colour --apply %s --chart-photo %s -o %s --format exr -q",
                         path_of("half.dng"), path_of("full.dng"), path_of("halves")),
                     0);
    assert_ok(weft_image_read(path_of("halves/half.exr"), WEFT_TRANSFER_LINEAR, &picture, err));
    assert_true(error_of(&picture, &view, &worst) < 0.4);
    weft_image_fini(&picture);
}

/* Each refusal: what is printed, and the exit status. */
static void refused(const char *name, const char *photo, const char *words)
{
    char said[4096];
    const int status = run(said, "weft calibrate colour --apply %s --chart-photo %s -o %s -q", photo, photo,
                           path_of("refused"));
    print_message("%s: exit %d: %s", name, status, strrchr(said, ':') ? said : "(nothing)\n");
    if (status != 1 || !strstr(said, words))
        fail_msg("%s: exit %d, wanted the words \"%s\"", name, status, words);
    assert_non_null(strstr(said, photo));
    assert_false(weft_folder_exists(path_of("refused")));
}

static void test_refusals(void **state)
{
    (void)state;
    const char *const photo = path_of("chart.dng");
    static const weft_mat3 mirror = {{-1, 0, 0, 0, 1, 0, 0, 0, 1}}, aside = {{1, 0, 230, 0, 1, 0, 0, 0, 1}};
    const weft_mat3 view = turned(0.6, 5, 0);
    chart_scene scene = scene_of(weft_mat3_multiply(&view, &mirror));
    draw_dng(&scene, photo, 0.01);
    refused("mirrored", photo, "the macbeth chart is mirrored");
    scene = scene_of(weft_mat3_multiply(&aside, &view));
    draw_dng(&scene, photo, 0.01);
    refused("partly outside", photo, "a part of it is outside the picture");
    scene = scene_of(view);
    scene.exposure = 4;
    draw_dng(&scene, photo, 0.01);
    refused("clipped", photo, "are clipped: take the chart with a shorter exposure");
    scene = scene_of(view);
    scene.blur = 26;
    draw_dng(&scene, photo, 0.01);
    refused("blurred", photo, "no macbeth chart found");
    scene = scene_of(view);
    scene.chart = NULL;
    draw_dng(&scene, photo, 0.01);
    refused("no chart", photo, "no macbeth chart found");

    weft_image left, right; /* two charts */
    weft_mask clipped;
    static const weft_mat3 shift = {{1, 0, 308, 0, 1, 0, 0, 0, 1}};
    weft_mat3 other = chart_scene_view(macbeth(), 308, 408, 0.7, 110, 0, 0);
    scene = scene_of(chart_scene_view(macbeth(), 308, 408, 0.8, 15, 0, 0));
    chart_scene_draw(&scene, &left, &clipped);
    weft_mask_fini(&clipped);
    scene = scene_of(weft_mat3_multiply(&shift, &other));
    chart_scene_draw(&scene, &right, &clipped);
    weft_mask_fini(&clipped);
    for (int v = 0; v < 408; v++)
        memcpy(weft_image_row(&left, 0, v) + 308, weft_image_row(&right, 0, v) + 308, 308 * sizeof(float));
    write_dng(&left, photo, 0.01);
    weft_image_fini(&left);
    weft_image_fini(&right);
    refused("two charts", photo, "two macbeth charts in the picture");
}

static void test_sheets_that_are_none(void **state)
{
    (void)state;
    char said[4096];
    const char *const photo = path_of("good.dng"), *const sheet = path_of("flat.dng"),
                      *const out = path_of("sheets");
    chart_scene scene = scene_of(turned(0.6, 5, 0)), blank = scene;
    draw_dng(&scene, photo, 0.01);
    assert_int_equal(run(said, "weft calibrate colour --apply %s --chart-photo %s --flat %s -o %s -q", photo,
                         photo, photo, out),
                     1);
    assert_non_null(strstr(said, "this is no blank sheet"));
    blank.chart = NULL;
    blank.clutter = 0;
    blank.table = 0.9;
    blank.exposure = 1.6;
    draw_dng(&blank, sheet, 0.01);
    assert_int_equal(run(said, "weft calibrate colour --apply %s --chart-photo %s --flat %s -o %s -q", photo,
                         photo, sheet, out),
                     1);
    assert_non_null(strstr(said, "of the sheet is clipped"));
    blank.exposure = 0.01;
    draw_dng(&blank, sheet, 0.01);
    assert_int_equal(run(said, "weft calibrate colour --apply %s --chart-photo %s --flat %s -o %s -q", photo,
                         photo, sheet, out),
                     1);
    assert_non_null(strstr(said, "too dark"));
    blank.exposure = 0.8;
    blank.width = 400;
    draw_dng(&blank, sheet, 0.01);
    assert_int_equal(run(said, "weft calibrate colour --apply %s --chart-photo %s --flat %s -o %s -q", photo,
                         photo, sheet, out),
                     1);
    assert_non_null(strstr(said, "has 616 x 408 pixels, the blank sheet 400 x 408"));
    assert_false(weft_folder_exists(out));
}

static long count_of(const char *key)
{
    json_t *manifest;
    long n = 0;
    const char *name;
    json_t *entry;
    assert_ok(weft_json_load(path_of("batch/corrected.json"), &manifest, err));
    json_object_foreach(json_object_get(manifest, "photos"), name, entry) n +=
        json_object_get(entry, key) != NULL;
    json_decref(manifest);
    return n;
}

/* Bad files among good ones; a second run does only what is missing; nothing is overwritten. */
static void test_a_batch(void **state)
{
    (void)state;
    char said[4096], line[1500];
    chart_scene scene = scene_of(turned(0.6, 5, 0));
    const char *const chart = path_of("a.dng"), *const out = path_of("batch");
    draw_dng(&scene, chart, 0.01);
    scene.table = 0.7;
    draw_dng(&scene, path_of("b.dng"), 0.01);
    draw_dng(&scene, path_of("e.dng"), 0.01);
    assert_ok(weft_file_write(path_of("bad.dng"), "no picture", 10, err));
    assert_ok(weft_file_write(path_of("c.png"), "\x89PNG\r\n\x1a\n", 8, err));
    assert_ok(weft_file_write(path_of("d.jpg"), "\xff\xd8", 2, err));
    snprintf(line, sizeof line, "weft calibrate colour --apply %s %s %s %s %s %s %s --chart-photo %s -o %s",
             path_of("bad.dng"), chart, path_of("c.png"), path_of("none.tif"), path_of("b.dng"),
             path_of("d.jpg"), path_of("nested/a.dng"), chart, out);
    assert_int_equal(run(said, "%s", line), 1);
    assert_non_null(strstr(said, "5 of 7 photographs failed"));
    assert_non_null(strstr(said, "bad.dng"));
    assert_non_null(strstr(said, "c.png"));
    assert_non_null(strstr(said, "none.tif"));
    assert_non_null(strstr(said, "a JPEG has lost"));
    assert_non_null(strstr(said, "would overwrite the result of"));
    assert_true(weft_file_exists(path_of("batch/a.tif")) && weft_file_exists(path_of("batch/b.tif")));
    assert_int_equal(count_of("error"), 4); /* two of the seven have one name */

    assert_int_equal(run(said, "weft calibrate colour --apply %s %s %s --chart-photo %s -o %s -q", chart,
                         path_of("b.dng"), path_of("e.dng"), chart, out),
                     0); /* the first two are done, also by name and content */
    assert_true(weft_file_exists(path_of("batch/e.tif")));
    assert_int_equal(run(said,
                         "weft calibrate colour --apply %s --chart-photo %s -o %s --method root-polynomial",
                         chart, chart, out),
                     1);
    assert_non_null(strstr(said, "pictures of another correction"));
    assert_ok(weft_folder_create(path_of("taken"), err));
    assert_ok(weft_file_write(path_of("taken/a.tif"), "mine", 4, err));
    assert_int_equal(
        run(said, "weft calibrate colour --apply %s --chart-photo %s -o %s", chart, chart, path_of("taken")),
        1);
    char *mine;
    size_t n;
    assert_ok(weft_file_read(path_of("taken/a.tif"), 100, &mine, &n, err));
    assert_string_equal(mine, "mine");
    weft_free(mine);
    assert_int_equal(run(said, "weft calibrate colour --apply %s -o %s", chart, path_of("x")), 2);
    assert_int_equal(run(said, "weft calibrate colour --apply %s -o %s --chart-photo %s -c x.cal", chart,
                         path_of("x"), chart),
                     2);
    assert_int_equal(run(said, "weft calibrate colour %s %s -o %s", chart, chart, path_of("x")), 2);
}

/* ICC.1: the length in the header, tags inside the file on four-byte borders, colorants that sum to D50. */
static void test_profiles(void **state)
{
    (void)state;
    for (int k = 0; k < 2; k++) {
        weft_text_buffer p = {0};
        weft_icc_profile(k ? WEFT_TRANSFER_SRGB : WEFT_TRANSFER_LINEAR, &p);
        const uint8_t *const b = (const uint8_t *)p.text;
#define WORD(at)                                                                                             \
    ((uint32_t)b[at] << 24 | (uint32_t)b[(at) + 1] << 16 | (uint32_t)b[(at) + 2] << 8 | b[(at) + 3])
        assert_int_equal(WORD(0), p.n);
        assert_memory_equal(b + 36, "acsp", 4);
        double sum[3] = {0};
        for (size_t tag = 0; tag < WORD(128); tag++) {
            const size_t at = 132 + 12 * tag, offset = WORD(at + 4), size = WORD(at + 8);
            assert_true(offset % 4 == 0 && offset + size <= p.n && size >= 8);
            if (memcmp(b + at + 1, "XYZ", 3) == 0)
                for (size_t c = 0; c < 3; c++)
                    sum[c] += (int32_t)WORD(offset + 8 + 4 * c) / 65536.0;
        }
        assert_near(sum[0], 0.9642, 2e-4);
        assert_near(sum[1], 1, 2e-4);
        assert_near(sum[2], 0.8249, 2e-4);
        weft_text_buffer_fini(&p);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_any_way_round),
        cmocka_unit_test(test_encodings),
        cmocka_unit_test(test_uneven_light),
        cmocka_unit_test(test_exposures),
        cmocka_unit_test(test_refusals),
        cmocka_unit_test(test_stained_patches),
        cmocka_unit_test(test_corners_and_patches_by_hand),
        cmocka_unit_test(test_sheets_that_are_none),
        cmocka_unit_test(test_a_batch),
        cmocka_unit_test(test_profiles),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
