/* Frames to linear light: levels, exposure, clipping, brackets, ambient light, and what must agree. */
#include "tests/support/support.h"

#include "core/colour.h"
#include "core/file.h"
#include "core/formats/exr_file.h"
#include "core/formats/png_file.h"
#include "core/formats/raw_file.h"
#include "core/mem.h"
#include "core/sha256.h"
#include "host/set/noise.h"
#include "host/set/plate.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

enum { W = 96, H = 64 };

static const float black[4] = {256, 250, 260, 256};
static const double white = 15871;

/* A sensor: DN = black + (white - black) * light * time, with shot and read noise when asked, clipped. */
static weft_mosaic expose(const double *light, double time, double read_dn, double electrons, uint64_t *seed)
{
    weft_mosaic m;
    assert_ok(weft_mosaic_init(&m, W, H, WEFT_CFA_GRBG, err));
    memcpy(m.black, black, sizeof black);
    m.white = (float)white;
    for (int i = 0; i < W * H; i++) {
        const double b = (double)black[(i / W & 1) * 2 + (i % W & 1)];
        double x = light[i] * time;
        if (electrons > 0)
            x += sqrt(fmax(x, 0) / electrons) * weft_test_gauss(seed);
        double dn = b + (white - b) * x + read_dn * weft_test_gauss(seed);
        dn = fmin(fmax(floor(dn + 0.5), 0), white);
        m.data[i] = (uint16_t)dn;
    }
    return m;
}

static weft_set make_set(const char *folder)
{
    weft_set set;
    assert_ok(weft_folder_create(folder, err));
    assert_ok(weft_set_init(&set, folder, err));
    set.width = W;
    set.height = H;
    set.cfa = WEFT_CFA_GRBG;
    set.white = white;
    for (int i = 0; i < 4; i++)
        set.black[i] = (double)black[i];
    set.complete = true;
    return set;
}

static void add(weft_set *set, const char *file, weft_frame_role role, int light, double exposure_s,
                double gain)
{
    char name[64];
    snprintf(name, sizeof name, "%s", file);
    const weft_set_frame frame = {
        .file = name, .role = role, .light = light, .exposure_s = exposure_s, .gain = gain};
    assert_ok(weft_set_add_frame(set, &frame, err));
}

/* Writes the frame as DNG and lists it. */
static void shoot(weft_set *set, const char *file, weft_frame_role role, int light, const double *scene,
                  double exposure_s, double gain, double read_dn, double electrons, uint64_t *seed)
{
    weft_mosaic m = expose(scene, exposure_s * gain, read_dn, electrons / gain, seed);
    const weft_frame_info info = {.exposure_s = exposure_s};
    char path[512];
    snprintf(path, sizeof path, "%s/%s", set->folder, file);
    assert_ok(weft_dng_write(path, &m, &info, err));
    weft_mosaic_fini(&m);
    add(set, file, role, light, exposure_s, gain);
}

static void test_two_exposures_give_one_plate(void **state)
{
    (void)state;
    static double scene[W * H];
    uint64_t seed = 1;
    for (int i = 0; i < W * H; i++)
        scene[i] = 0.1 + 3 * (i % W) / (double)W;
    weft_set set = make_set(weft_test_path("two.set"));
    shoot(&set, "a.dng", WEFT_ROLE_LIGHT, 0, scene, 0.125, 1, 0, 0, &seed);
    shoot(&set, "b.dng", WEFT_ROLE_LIGHT, 1, scene, 0.02, 4, 0, 0, &seed);
    weft_plate a, b;
    assert_ok(weft_plate_load_light(&set, 0, NULL, &a, err));
    assert_ok(weft_plate_load_light(&set, 1, NULL, &b, err));
    assert_true(a.image.planes == 1 && a.cfa == WEFT_CFA_GRBG && a.image.width == W && a.image.height == H);
    for (int i = 0; i < W * H; i++) { /* half a DN of each exposure */
        assert_near((double)a.image.data[i], scene[i], 0.5 / 15611 / 0.125 + 1e-6);
        assert_near((double)b.image.data[i], scene[i], 0.5 / 15611 / 0.08 + 1e-6);
        assert_true(!a.clipped.data[i] && !b.clipped.data[i]);
    }
    weft_plate_fini(&a);
    weft_plate_fini(&b);
    assert_fails(weft_plate_load_light(&set, 2, NULL, &a, err), WEFT_ERR_MISSING,
                 "two.set: light 2 has no frame");
    weft_set_fini(&set);
}

static void test_clipping_grows_by_one_over_all_colours(void **state)
{
    (void)state;
    static double scene[W * H];
    uint64_t seed = 1;
    const int spots[][2] = {{0, 0}, {10, 10}, {W - 1, 20}, {33, H - 1}};
    for (int i = 0; i < W * H; i++)
        scene[i] = 0.5;
    for (int k = 0; k < 4; k++)
        scene[spots[k][1] * W + spots[k][0]] = 1;
    weft_set set = make_set(weft_test_path("clip.set"));
    shoot(&set, "a.dng", WEFT_ROLE_LIGHT, 0, scene, 1, 1, 0, 0, &seed);
    weft_plate plate;
    assert_ok(weft_plate_load_frame(&set, 0, &plate, err));
    for (int i = 0; i < W * H; i++) {
        bool near = false;
        for (int k = 0; k < 4; k++)
            near |= abs(i % W - spots[k][0]) <= 1 && abs(i / W - spots[k][1]) <= 1;
        assert_int_equal(plate.clipped.data[i] != 0, near);
    }
    weft_plate_fini(&plate);
    weft_set_fini(&set);
}

/* Mean square of (plate - scene) * time over unclipped pixels: noise as a fraction of full scale. */
static double error_of(const weft_plate *plate, const double *scene, double *mean)
{
    double sum = 0, squares = 0;
    int n = 0;
    for (int i = 0; i < W * H; i++)
        if (!plate->clipped.data[i]) {
            const double e = (double)plate->image.data[i] - scene[i];
            sum += e;
            squares += e * e;
            n++;
        }
    *mean = sum / n;
    return sqrt(squares / n);
}

static void test_brackets_are_merged_by_noise(void **state)
{
    (void)state;
    static double scene[W * H];
    uint64_t seed = 11;
    for (int i = 0; i < W * H; i++)
        scene[i] = 0.002 + 8 * pow(i % W / (double)W, 3); /* clips in the long exposure */
    weft_set set = make_set(weft_test_path("bracket.set"));
    shoot(&set, "short.dng", WEFT_ROLE_LIGHT, 0, scene, 0.1, 1, 6, 20000, &seed);
    shoot(&set, "long.dng", WEFT_ROLE_LIGHT, 0, scene, 0.4, 1, 6, 20000, &seed);
    shoot(&set, "only-long.dng", WEFT_ROLE_LIGHT, 1, scene, 0.4, 1, 6, 20000, &seed);
    shoot(&set, "only-short.dng", WEFT_ROLE_LIGHT, 2, scene, 0.1, 1, 6, 20000, &seed);
    weft_plate merged, longer, shorter;
    double mean, unused;
    assert_ok(weft_plate_load_light(&set, 0, NULL, &merged, err));
    assert_ok(weft_plate_load_light(&set, 1, NULL, &longer, err));
    assert_ok(weft_plate_load_light(&set, 2, NULL, &shorter, err));
    int n_clipped_long = 0;
    double ideal = 0, got = 0;
    const double read = 6 / (white - 256);
    for (int i = 0; i < W * H; i++) {
        n_clipped_long += longer.clipped.data[i] != 0;
        assert_int_equal(merged.clipped.data[i], 0); /* the short one holds everything */
        double information = 0;
        for (int k = 0; k < 2; k++) {
            const double t = k ? 0.4 : 0.1;
            if (k == 0 || !longer.clipped.data[i])
                information += t * t / (read * read + scene[i] * t / 20000);
        }
        const double e = (double)merged.image.data[i] - scene[i];
        ideal += 1;
        got += e * e * information;
    }
    assert_true(n_clipped_long > W * H / 10);
    /* the mean square error in units of the best possible (Cramer-Rao): 1 but for sampling and quantisation
     */
    print_message("merged error / best possible: %.3f\n", sqrt(got / ideal));
    assert_near(sqrt(got / ideal), 1, 0.04);
    const double error_merged = error_of(&merged, scene, &mean),
                 error_short = error_of(&shorter, scene, &unused);
    assert_true(error_merged < error_short);
    assert_near(mean, 0, 4 * error_merged / sqrt((double)W * H)); /* no bias */
    const double ideal_floor = read / sqrt(0.1 * 0.1 + 0.4 * 0.4);
    assert_near(merged.noise_floor / ideal_floor, 1, 0.15);
    weft_plate_fini(&merged);
    weft_plate_fini(&longer);
    weft_plate_fini(&shorter);
    weft_set_fini(&set);
}

static void test_what_clips_in_all_exposures_is_marked(void **state)
{
    (void)state;
    static double scene[W * H];
    uint64_t seed = 2;
    for (int i = 0; i < W * H; i++)
        scene[i] = i == 20 * W + 20 ? 100 : 2;
    weft_set set = make_set(weft_test_path("hot.set"));
    shoot(&set, "1.dng", WEFT_ROLE_LIGHT, 0, scene, 0.25, 1, 2, 30000, &seed);
    shoot(&set, "2.dng", WEFT_ROLE_LIGHT, 0, scene, 1, 1, 2, 30000, &seed);
    shoot(&set, "3.dng", WEFT_ROLE_LIGHT, 0, scene, 0.0625, 1, 2, 30000, &seed);
    weft_plate plate;
    assert_ok(weft_plate_load_light(&set, 0, NULL, &plate, err));
    for (int i = 0; i < W * H; i++) {
        const bool near = abs(i % W - 20) <= 1 && abs(i / W - 20) <= 1;
        assert_int_equal(plate.clipped.data[i] != 0, near);
        assert_true(isfinite(plate.image.data[i]));
        if (!near)
            assert_near((double)plate.image.data[i], 2, 0.2);
    }
    assert_near((double)plate.image.data[20 * W + 20], 16, 0.01); /* the shortest exposure's top */
    weft_plate_fini(&plate);
    weft_set_fini(&set);
}

static void test_ambient_light_is_subtracted(void **state)
{
    (void)state;
    static double light[W * H], room[W * H], both[W * H];
    uint64_t seed = 4;
    for (int i = 0; i < W * H; i++) {
        light[i] = 1 + 0.5 * sin(i * 0.1);
        room[i] = 0.2 + 0.1 * (i / W) / (double)H;
        both[i] = light[i] + room[i];
    }
    weft_set set = make_set(weft_test_path("ambient.set"));
    shoot(&set, "l.dng", WEFT_ROLE_LIGHT, 0, both, 0.25, 1, 5, 20000, &seed);
    weft_plate ambient, plate;
    bool present = true;
    assert_ok(weft_plate_load_ambient(&set, &ambient, &present, err));
    assert_true(!present && !ambient.image.data);
    shoot(&set, "a.dng", WEFT_ROLE_AMBIENT, -1, room, 0.5, 1, 5, 20000, &seed);
    assert_ok(weft_plate_load_ambient(&set, &ambient, &present, err));
    assert_true(present);
    assert_ok(weft_plate_load_light(&set, 0, &ambient, &plate, err));
    double mean, rms = error_of(&plate, light, &mean);
    assert_near(mean, 0, 1e-3);
    assert_true(rms < 0.03);
    weft_plate_fini(&plate);
    ambient.image.width = W / 2; /* a plate of something else */
    assert_fails(weft_plate_load_light(&set, 0, &ambient, &plate, err), WEFT_ERR_MISMATCH,
                 "ambient plate is 48 x 64");
    weft_plate_fini(&ambient);
    weft_set_fini(&set);
}

static void test_noise_is_found(void **state)
{
    (void)state;
    enum { N = 512 };
    weft_image a, b;
    weft_mask good;
    uint64_t seed = 8;
    assert_ok(weft_image_init(&a, N, N, 1, err));
    assert_ok(weft_image_init(&b, N, N, 1, err));
    assert_ok(weft_mask_init(&good, N, N, 0, err));
    const double read = 4e-4, shot = 1 / 15000.0, times[2] = {0.5, 0.125};
    for (int i = 0; i < N * N; i++) { /* a textured ramp, seen twice */
        const double x = (1.2 * (i % N) / N + 0.2 + 0.2 * sin(i * 1.7)) / 1.6 * 1.9;
        for (int k = 0; k < 2; k++) {
            const double t = times[k], sd = sqrt(read * read + shot * x * t) / t;
            (k ? &b : &a)->data[i] = (float)(x + sd * weft_test_gauss(&seed));
        }
    }
    weft_noise noise;
    assert_true(weft_noise_fit(&a, 0.5, &good, &b, 0.125, &good, &noise));
    print_message("read %.3g (true %.3g), shot %.4g (true %.4g)\n", sqrt(noise.read), read, noise.shot, shot);
    assert_near(sqrt(noise.read) / read, 1, 0.25);
    assert_near(noise.shot / shot, 1, 0.03);
    for (int i = 0; i < N * N; i++) /* no light, a gradient, two hot pixels in a hundred */
        a.data[i] = (float)(1e-3 * (i % N) + 0.01 * weft_test_gauss(&seed) + (i % 5000 == 7 ? 5 : 0));
    assert_near(weft_noise_floor(&a, 2), 0.01, 2e-4);
    assert_near(weft_noise_floor(&a, 1), 0.01, 2e-4);
    memset(good.data, 255, (size_t)N * N);
    assert_false(weft_noise_fit(&a, 0.5, &good, &b, 0.125, &good, &noise)); /* nothing to go by */
    a.width = 10;
    assert_near(weft_noise_floor(&a, 1), 0, 0);
    weft_image_fini(&a);
    weft_image_fini(&b);
    weft_mask_fini(&good);
}

/* The same mosaic as DNG, 16-bit PNG and TIFF gives the same plate. */
static void test_mosaics_in_pictures(void **state)
{
    (void)state;
    static double scene[W * H];
    uint64_t seed = 6;
    for (int i = 0; i < W * H; i++)
        scene[i] = weft_test_random(&seed);
    weft_set set = make_set(weft_test_path("pictures.set"));
    shoot(&set, "a.dng", WEFT_ROLE_LIGHT, 0, scene, 1.02, 1, 0, 0, &seed);
    weft_mosaic m = expose(scene, 1.02, 0, 0, &seed);
    const weft_raster raster = {W, H, 1, 16, m.data};
    assert_ok(weft_png_write(weft_test_path("pictures.set/a.png"), &raster, err));
    assert_ok(weft_tiff_write(weft_test_path("pictures.set/a.tif"), &raster, err));
    add(&set, "a.png", WEFT_ROLE_LIGHT, 1, 1.02, 1);
    add(&set, "a.tif", WEFT_ROLE_LIGHT, 2, 1.02, 1);
    weft_plate plates[3];
    for (int i = 0; i < 3; i++) {
        assert_ok(weft_plate_load_light(&set, i, NULL, &plates[i], err));
        assert_memory_equal(plates[i].image.data, plates[0].image.data, sizeof(float) * W * H);
        assert_memory_equal(plates[i].clipped.data, plates[0].clipped.data, (size_t)W * H);
    }
    for (int i = 0; i < 3; i++)
        weft_plate_fini(&plates[i]);
    weft_mosaic_fini(&m);
    weft_plate plate;
    set.white = 0;
    assert_ok(weft_plate_load_light(&set, 0, NULL, &plate, err)); /* the raw file has its own levels */
    weft_plate_fini(&plate);
    assert_fails(weft_plate_load_light(&set, 1, NULL, &plate, err), WEFT_ERR_MISSING,
                 "a.png: a mosaic in a PNG");
    weft_set_fini(&set);
}

static void test_rgb_and_grey_pictures(void **state)
{
    (void)state;
    weft_set set = make_set(weft_test_path("rgb.set"));
    set.cfa = WEFT_CFA_NONE;
    set.white = 0;
    weft_raster codes8, codes16, grey;
    assert_ok(weft_raster_init(&codes8, W, H, 3, 8, err));
    assert_ok(weft_raster_init(&codes16, W, H, 3, 16, err));
    assert_ok(weft_raster_init(&grey, W, H, 1, 8, err));
    for (int i = 0; i < W * H; i++)
        for (int p = 0; p < 3; p++) {
            codes8.data[3 * i + p] = (uint16_t)((i + 50 * p) % 255);
            codes16.data[3 * i + p] = (uint16_t)((i * 9 + 5000 * p) % 65535);
            grey.data[i] = (uint16_t)(i % 255);
        }
    codes8.data[3 * 7 + 1] = 255;
    codes16.data[3 * 9 + 2] = 65535;
    assert_ok(weft_png_write(weft_test_path("rgb.set/8.png"), &codes8, err));
    assert_ok(weft_tiff_write(weft_test_path("rgb.set/16.tif"), &codes16, err));
    assert_ok(weft_png_write(weft_test_path("rgb.set/grey.png"), &grey, err));
    add(&set, "8.png", WEFT_ROLE_LIGHT, 0, 0.5, 1);
    add(&set, "16.tif", WEFT_ROLE_LIGHT, 1, 0.5, 1);
    add(&set, "grey.png", WEFT_ROLE_LIGHT, 2, 0.5, 1);
    weft_plate plate;
    assert_ok(weft_plate_load_light(&set, 0, NULL, &plate, err));
    assert_true(plate.image.planes == 3 && plate.cfa == WEFT_CFA_NONE);
    for (int i = 0; i < W * H; i++)
        for (int p = 0; p < 3; p++)
            assert_near((double)weft_image_plane(&plate.image, p)[i],
                        2 * weft_srgb_decode(codes8.data[3 * i + p] / 255.0), 1e-6);
    assert_true(plate.clipped.data[7] && !plate.clipped.data[6] && !plate.clipped.data[8]);
    weft_plate_fini(&plate);
    assert_ok(weft_plate_load_light(&set, 1, NULL, &plate, err));
    for (int i = 0; i < W * H * 3; i++)
        assert_near((double)weft_image_plane(&plate.image, i % 3)[i / 3], 2 * codes16.data[i] / 65535.0,
                    1e-6);
    assert_true(plate.clipped.data[9] && !plate.clipped.data[8]);
    weft_plate_fini(&plate);
    set.transfer = WEFT_TRANSFER_LINEAR;
    assert_ok(weft_plate_load_light(&set, 2, NULL, &plate, err));
    assert_int_equal(plate.image.planes, 1);
    for (int i = 0; i < W * H; i++)
        assert_near((double)plate.image.data[i], 2 * grey.data[i] / 255.0, 1e-6);
    weft_plate_fini(&plate);
    weft_raster_fini(&codes8);
    weft_raster_fini(&codes16);
    weft_raster_fini(&grey);
    weft_set_fini(&set);
}

static void test_exr_with_nan(void **state)
{
    (void)state;
    static const char *const rgb[] = {"R", "G", "B"};
    weft_set set = make_set(weft_test_path("exr.set"));
    weft_image image;
    weft_plate plate;
    set.cfa = WEFT_CFA_NONE;
    set.white = 0;
    assert_ok(weft_image_init(&image, W, H, 3, err));
    for (int i = 0; i < W * H * 3; i++)
        image.data[i] = (float)i;
    image.data[5] = NAN;
    image.data[W * H + 6] = INFINITY;
    assert_ok(weft_exr_write(weft_test_path("exr.set/a.exr"), &image, rgb, WEFT_EXR_FLOAT, err));
    add(&set, "a.exr", WEFT_ROLE_LIGHT, 0, 0.5, 2);
    assert_ok(weft_plate_load_light(&set, 0, NULL, &plate, err));
    for (int i = 0; i < W * H; i++) {
        assert_int_equal(plate.clipped.data[i] != 0, i == 5 || i == 6);
        if (!plate.clipped.data[i])
            assert_true(plate.image.data[i] == (float)i);
        assert_true(isfinite(plate.image.data[i]));
    }
    weft_plate_fini(&plate);
    for (int i = 0; i < W * H * 3; i++)
        image.data[i] = NAN;
    assert_ok(weft_exr_write(weft_test_path("exr.set/a.exr"), &image, rgb, WEFT_EXR_FLOAT, err));
    assert_fails(weft_plate_load_light(&set, 0, NULL, &plate, err), WEFT_ERR_NODATA,
                 "a.exr: holds no finite value");
    weft_image_fini(&image);
    weft_set_fini(&set);
}

static void test_what_does_not_agree_is_named(void **state)
{
    (void)state;
    static double scene[W * H];
    uint64_t seed = 6;
    weft_plate plate;
    weft_set set = make_set(weft_test_path("bad.set"));
    shoot(&set, "a.dng", WEFT_ROLE_LIGHT, 0, scene, 1, 1, 0, 0, &seed);
    assert_ok(weft_sha256_file(weft_test_path("bad.set/a.dng"), set.frames[0].sha256, err));
    assert_ok(weft_plate_load_frame(&set, 0, &plate, err));
    weft_plate_fini(&plate);
    set.frames[0].sha256[0] ^= 1;
    assert_fails(weft_plate_load_frame(&set, 0, &plate, err), WEFT_ERR_MISMATCH,
                 "bad.set/a.dng: is not the file that was captured");
    set.frames[0].sha256[0] = '\0';
    set.white = 16383;
    assert_fails(weft_plate_load_frame(&set, 0, &plate, err), WEFT_ERR_MISMATCH,
                 "a.dng: its white level is 15871, set.json says 16383");
    set.white = white;
    set.black[2] = 0;
    assert_fails(weft_plate_load_frame(&set, 0, &plate, err), WEFT_ERR_MISMATCH, "black level 2 is 260");
    set.black[2] = 260;
    set.cfa = WEFT_CFA_RGGB;
    assert_fails(weft_plate_load_frame(&set, 0, &plate, err), WEFT_ERR_MISMATCH,
                 "filters are GRBG, set.json says RGGB");
    set.cfa = WEFT_CFA_NONE;
    assert_fails(weft_plate_load_frame(&set, 0, &plate, err), WEFT_ERR_MISMATCH, "is a camera raw file");
    set.cfa = WEFT_CFA_GRBG;
    set.width++;
    assert_fails(weft_plate_load_frame(&set, 0, &plate, err), WEFT_ERR_MISMATCH,
                 "a.dng: is 96 x 64 pixels, set.json says 97 x 64");
    set.width--;
    weft_raster raster;
    assert_ok(weft_raster_init(&raster, W, H, 3, 16, err));
    assert_ok(weft_png_write(weft_test_path("bad.set/rgb.png"), &raster, err));
    weft_raster_fini(&raster);
    add(&set, "rgb.png", WEFT_ROLE_LIGHT, 1, 1, 1);
    add(&set, "a.jpg", WEFT_ROLE_LIGHT, 2, 1, 1);
    assert_ok(weft_file_write(weft_test_path("bad.set/a.jpg"), "JPEG", 4, err));
    add(&set, "absent.dng", WEFT_ROLE_LIGHT, 3, 1, 1);
    assert_fails(weft_plate_load_frame(&set, 1, &plate, err), WEFT_ERR_MISMATCH,
                 "rgb.png: has 3 channels of 16 bits");
    assert_fails(weft_plate_load_frame(&set, 2, &plate, err), WEFT_ERR_FORMAT, "a.jpg: a mosaic must be");
    assert_fails(weft_plate_load_frame(&set, 3, &plate, err), WEFT_ERR_MISSING,
                 "absent.dng: set.json names it");
    weft_set_fini(&set);
}

static void test_mask_of_the_sample(void **state)
{
    (void)state;
    weft_set set = make_set(weft_test_path("mask.set"));
    weft_mask mask, wrong;
    assert_ok(weft_set_load_mask(&set, &mask, err));
    for (int i = 0; i < W * H; i++)
        assert_int_equal(mask.data[i], 255);
    mask.data[17] = 0;
    assert_ok(weft_png_write_mask(weft_test_path("mask.set/mask.png"), &mask, err));
    weft_mask_fini(&mask);
    set.mask_file = weft_strdup("mask.png", NULL);
    assert_ok(weft_set_load_mask(&set, &mask, err));
    assert_true(mask.data[17] == 0 && mask.data[18] == 255);
    weft_mask_fini(&mask);
    assert_ok(weft_mask_init(&wrong, 3, 4, 1, err));
    assert_ok(weft_png_write_mask(weft_test_path("mask.set/mask.png"), &wrong, err));
    weft_mask_fini(&wrong);
    assert_fails(weft_set_load_mask(&set, &mask, err), WEFT_ERR_MISMATCH, "mask.png: the mask is 3 x 4");
    weft_set_fini(&set);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_two_exposures_give_one_plate),
        cmocka_unit_test(test_clipping_grows_by_one_over_all_colours),
        cmocka_unit_test(test_brackets_are_merged_by_noise),
        cmocka_unit_test(test_what_clips_in_all_exposures_is_marked),
        cmocka_unit_test(test_ambient_light_is_subtracted),
        cmocka_unit_test(test_noise_is_found),
        cmocka_unit_test(test_mosaics_in_pictures),
        cmocka_unit_test(test_rgb_and_grey_pictures),
        cmocka_unit_test(test_exr_with_nan),
        cmocka_unit_test(test_what_does_not_agree_is_named),
        cmocka_unit_test(test_mask_of_the_sample),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
