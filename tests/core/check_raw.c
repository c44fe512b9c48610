/* Bayer frames as DNG: what is written is what LibRaw, dcraw and exiftool find. */
#include "tests/support/support.h"

#include "core/file.h"
#include "core/formats/png_file.h"
#include "core/formats/raw_file.h"
#include "core/formats/tiff_file.h"
#include "core/mem.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static weft_mosaic make_mosaic(int width, int height, weft_cfa cfa)
{
    weft_mosaic mosaic;
    uint64_t seed = 3;
    assert_ok(weft_mosaic_init(&mosaic, width, height, cfa, err));
    mosaic.white = 15871;
    for (int i = 0; i < 4; i++)
        mosaic.black[i] = (float)(250 + 3 * i);
    for (size_t i = 0; i < (size_t)width * (size_t)height; i++)
        mosaic.data[i] = (uint16_t)(weft_test_random(&seed) * 16384);
    return mosaic;
}

static const weft_frame_info full_info = {
    .exposure_s = 0.125,
    .iso = 200,
    .f_number = 5.6,
    .make = "Example",
    .model = "Bayer 4",
    .serial = "A-17",
    .date_time = "2026:11:23 10:00:00",
    .as_shot_neutral = {0.5, 1, 0.625},
    .xyz_to_camera = {0.9, -0.3, -0.1, -0.4, 1.2, 0.2, -0.05, 0.2, 0.6}};

static void test_round_trip_is_exact(void **state)
{
    (void)state;
    const int sizes[][2] = {{22, 22}, {640, 480}, {333, 65}, {1232, 816}};
    for (int s = 0; s < 4; s++)
        for (int cfa = WEFT_CFA_RGGB; cfa <= WEFT_CFA_BGGR; cfa++) {
            weft_mosaic mosaic = make_mosaic(sizes[s][0], sizes[s][1], (weft_cfa)cfa), back;
            weft_frame_info info;
            const char *const path = weft_test_path("frame.dng");
            assert_ok(weft_dng_write(path, &mosaic, &full_info, err));
            assert_ok(weft_raw_read(path, &back, &info, err));
            assert_true(back.width == mosaic.width && back.height == mosaic.height);
            assert_int_equal(back.cfa, mosaic.cfa);
            assert_memory_equal(back.data, mosaic.data,
                                (size_t)mosaic.width * (size_t)mosaic.height * sizeof *mosaic.data);
            assert_memory_equal(back.black, mosaic.black, sizeof mosaic.black);
            assert_true(back.white == 15871);
            weft_mosaic_fini(&back);
            weft_mosaic_fini(&mosaic);
        }
}

static void test_the_file_says_how_it_was_taken(void **state)
{
    (void)state;
    weft_mosaic mosaic = make_mosaic(100, 80, WEFT_CFA_GRBG), back;
    weft_frame_info info;
    assert_ok(weft_dng_write(weft_test_path("info.dng"), &mosaic, &full_info, err));
    assert_ok(weft_raw_read(weft_test_path("info.dng"), &back, &info, err));
    weft_mosaic_fini(&back);
    assert_near(info.exposure_s, 0.125, 0);
    assert_near(info.iso, 200, 0);
    assert_near(info.f_number, 5.6, 1e-6);
    assert_near(info.gain, 0, 0);
    assert_string_equal(info.make, "Example");
    assert_string_equal(info.model, "Bayer 4");
    assert_string_equal(info.serial, "A-17");
    assert_string_equal(info.date_time, "2026:11:23 10:00:00");
    for (int i = 0; i < 3; i++)
        assert_near(info.as_shot_neutral[i], full_info.as_shot_neutral[i], 1e-6);
    for (int i = 0; i < 9; i++)
        assert_near(info.xyz_to_camera[i], full_info.xyz_to_camera[i], 1e-6);
    const weft_frame_info bare = {0};
    assert_ok(weft_dng_write(weft_test_path("bare.dng"), &mosaic, &bare, err));
    assert_ok(weft_raw_read(weft_test_path("bare.dng"), &back, &info, err));
    assert_true(info.exposure_s == 0 && info.iso == 0 && info.f_number == 0 && !info.date_time[0]);
    weft_mosaic_fini(&back);
    weft_mosaic_fini(&mosaic);
}

static void test_exposures_keep_their_digits(void **state)
{
    (void)state;
    weft_mosaic mosaic = make_mosaic(32, 32, WEFT_CFA_RGGB), back;
    const double exposures[] = {1e-5, 1 / 8000.0, 0.04, 1 / 3.0, 0.0123456789, 30};
    for (size_t i = 0; i < sizeof exposures / sizeof *exposures; i++) {
        weft_frame_info info = {.exposure_s = exposures[i]};
        assert_ok(weft_dng_write(weft_test_path("e.dng"), &mosaic, &info, err));
        assert_ok(weft_raw_read(weft_test_path("e.dng"), &back, &info, err));
        assert_near(info.exposure_s / exposures[i], 1, 1e-6);
        weft_mosaic_fini(&back);
    }
    weft_mosaic_fini(&mosaic);
}

static void test_libtiff_finds_the_same_plane(void **state)
{
    (void)state;
    weft_mosaic mosaic = make_mosaic(130, 200, WEFT_CFA_BGGR);
    weft_raster raster;
    assert_ok(weft_dng_write(weft_test_path("plane.dng"), &mosaic, &full_info, err));
    assert_ok(weft_tiff_read(weft_test_path("plane.dng"), &raster, err));
    assert_true(raster.width == 130 && raster.height == 200 && raster.channels == 1 && raster.bits == 16);
    assert_memory_equal(raster.data, mosaic.data, (size_t)130 * 200 * sizeof *mosaic.data);
    weft_raster_fini(&raster);
    weft_mosaic_fini(&mosaic);
}

/* Output of a program, or NULL when it is not installed. */
static char *output_of(const char *program, const char *command)
{
    static char text[16384];
    char line[2048];
    snprintf(line, sizeof line, "command -v %s >/dev/null 2>&1", program);
    if (system(line) != 0) {
        print_message("skipped: %s is not installed\n", program);
        return NULL;
    }
    FILE *const pipe = popen(command, "r");
    assert_non_null(pipe);
    text[fread(text, 1, sizeof text - 1, pipe)] = '\0';
    assert_int_equal(pclose(pipe), 0);
    return text;
}

static void assert_says(const char *text, const char *words)
{
    if (!strstr(text, words))
        fail_msg("\"%s\" is not in:\n%s", words, text);
}

static void test_dcraw_accepts_it(void **state)
{
    (void)state;
    weft_mosaic mosaic = make_mosaic(320, 200, WEFT_CFA_GBRG);
    char command[2048];
    const char *const path = weft_test_path("judge.dng");
    assert_ok(weft_dng_write(path, &mosaic, &full_info, err));
    snprintf(command, sizeof command, "LC_ALL=C TZ=UTC dcraw -i -v %s 2>&1", path);
    const char *const text = output_of("dcraw", command);
    if (text) {
        assert_says(text, "Camera: Example Bayer 4");
        assert_says(text, "ISO speed: 200");
        assert_says(text, "Shutter: 1/8.0 sec");
        assert_says(text, "Aperture: f/5.6");
        assert_says(text, "Full size:    320 x 200");
        assert_says(text, "Filter pattern: GB/RG");
        assert_says(text, "Daylight multipliers:");
        /* -D: the plane itself, nothing scaled */
        snprintf(command, sizeof command, "dcraw -D -4 -j -t 0 -T -c %s > %s", path,
                 weft_test_path("d.tiff"));
        assert_non_null(output_of("dcraw", command));
        weft_raster raster;
        assert_ok(weft_tiff_read(weft_test_path("d.tiff"), &raster, err));
        assert_true(raster.width == 320 && raster.height == 200);
        assert_memory_equal(raster.data, mosaic.data, (size_t)320 * 200 * sizeof *mosaic.data);
        weft_raster_fini(&raster);
    }
    weft_mosaic_fini(&mosaic);
    if (!text)
        skip();
}

static void test_exiftool_finds_no_fault(void **state)
{
    (void)state;
    weft_mosaic mosaic = make_mosaic(320, 200, WEFT_CFA_RGGB);
    char command[2048];
    const char *const path = weft_test_path("valid.dng");
    assert_ok(weft_dng_write(path, &mosaic, &full_info, err));
    weft_mosaic_fini(&mosaic);
    snprintf(command, sizeof command,
             "LC_ALL=C exiftool -validate -warning -error -a -G0 -DNGVersion "
             "-BlackLevel -WhiteLevel -CFAPattern2 -ExposureTime -ISO -FNumber %s",
             path);
    const char *const text = output_of("exiftool", command);
    if (!text)
        skip();
    assert_says(text, "Validate                        : OK");
    assert_says(text, "DNG Version                     : 1.4.0.0");
    assert_says(text, "Black Level                     : 250 253 256 259");
    assert_says(text, "White Level                     : 15871");
    assert_says(text, "CFA Pattern 2                   : 0 1 1 2");
    assert_says(text, "Exposure Time                   : 1/8");
    assert_says(text, "ISO                             : 200");
}

static void test_what_is_no_bayer_frame_is_refused(void **state)
{
    (void)state;
    weft_mosaic mosaic = make_mosaic(22, 22, WEFT_CFA_NONE), back;
    assert_fails(weft_dng_write(weft_test_path("none.dng"), &mosaic, &full_info, err), WEFT_ERR_UNSUPPORTED,
                 "none.dng: a DNG holds a colour mosaic");
    mosaic.cfa = WEFT_CFA_RGGB;
    mosaic.width = 21;
    assert_fails(weft_dng_write(weft_test_path("none.dng"), &mosaic, &full_info, err), WEFT_ERR_RANGE,
                 "no raw frame smaller than 22 x 22");
    mosaic.width = 22;
    mosaic.black[2] = 20000;
    assert_fails(weft_dng_write(weft_test_path("none.dng"), &mosaic, &full_info, err), WEFT_ERR_RANGE,
                 "black level 20000");
    assert_false(weft_file_exists(weft_test_path("none.dng")));
    weft_mosaic_fini(&mosaic);
    weft_raster raster;
    assert_ok(weft_raster_init(&raster, 64, 64, 3, 16, err));
    assert_ok(weft_tiff_write(weft_test_path("rgb.tif"), &raster, err));
    assert_ok(weft_png_write(weft_test_path("rgb.png"), &raster, err));
    weft_raster_fini(&raster);
    assert_fails(weft_raw_read(weft_test_path("rgb.tif"), &back, NULL, err), WEFT_ERR_FORMAT, "rgb.tif: ");
    assert_fails(weft_raw_read(weft_test_path("rgb.png"), &back, NULL, err), WEFT_ERR_FORMAT,
                 "rgb.png: is not a raw file");
    assert_fails(weft_raw_read(weft_test_path("absent.dng"), &back, NULL, err), WEFT_ERR_IO,
                 "absent.dng: cannot be opened: No such file");
    assert_fails(weft_raw_read(weft_test_folder(), &back, NULL, err), WEFT_ERR_IO, "is a folder");
    assert_true(weft_raw_is_name("a/B.NEF") && weft_raw_is_name("x.dng") && !weft_raw_is_name("x.png"));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_round_trip_is_exact),
        cmocka_unit_test(test_the_file_says_how_it_was_taken),
        cmocka_unit_test(test_exposures_keep_their_digits),
        cmocka_unit_test(test_libtiff_finds_the_same_plane),
        cmocka_unit_test(test_dcraw_accepts_it),
        cmocka_unit_test(test_exiftool_finds_no_fault),
        cmocka_unit_test(test_what_is_no_bayer_frame_is_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
