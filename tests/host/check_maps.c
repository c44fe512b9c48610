/* NAME.maps: what is saved is what is loaded, and foreign folders. */
#include "tests/support/support.h"

#include "core/colour.h"
#include "core/file.h"
#include "core/formats/exr_file.h"
#include "core/formats/half.h"
#include "core/formats/png_file.h"
#include "core/mem.h"
#include "host/set/maps.h"

#include <math.h>
#include <string.h>

enum { W = 45, H = 38 };

static weft_maps make_maps(void)
{
    weft_maps maps = {.width = W,
                      .height = H,
                      .geometry = WEFT_GEOMETRY_PLANE,
                      .mm_per_px = 0.125,
                      .origin_mm = {-2.75, 2.3125},
                      .albedo_is_srgb = true};
    uint64_t seed = 5;
    assert_ok(weft_image_init(&maps.normal, W, H, 3, err));
    assert_ok(weft_image_init(&maps.albedo, W, H, 3, err));
    assert_ok(weft_image_init(&maps.residual, W, H, 1, err));
    assert_ok(weft_image_init(&maps.confidence, W, H, 1, err));
    assert_ok(weft_mask_init(&maps.mask, W, H, 255, err));
    for (size_t i = 0; i < (size_t)W * H; i++) {
        const double x = weft_test_gauss(&seed), y = weft_test_gauss(&seed), z = fabs(weft_test_gauss(&seed));
        const double n = sqrt(x * x + y * y + z * z);
        const double unit[3] = {x / n, y / n, z / n};
        for (int p = 0; p < 3; p++) {
            weft_image_plane(&maps.normal, p)[i] = (float)unit[p];
            weft_image_plane(&maps.albedo, p)[i] = (float)weft_test_random(&seed);
        }
        maps.residual.data[i] = (float)weft_test_random(&seed);
        maps.confidence.data[i] = (float)weft_test_random(&seed);
    }
    maps.mask.data[3] = 0;
    for (int p = 0; p < 3; p++)
        weft_image_plane(&maps.normal, p)[3] = 0;
    maps.info = json_pack("{s:s, s:{s:s}}", "software", "weft 0.1.0", "options", "method", "lsq");
    return maps;
}

static void test_round_trip(void **state)
{
    (void)state;
    weft_maps maps = make_maps(), back;
    const char *const folder = weft_test_path("a.maps");
    assert_ok(weft_maps_save(folder, &maps, false, err));
    assert_ok(weft_maps_load(folder, &back, err));
    assert_true(back.width == W && back.height == H && back.geometry == WEFT_GEOMETRY_PLANE);
    assert_true(back.mm_per_px == 0.125 && back.origin_mm[0] == -2.75 && back.origin_mm[1] == 2.3125);
    assert_true(back.albedo_is_srgb);
    assert_memory_equal(back.normal.data, maps.normal.data, sizeof(float) * W * H * 3);
    assert_memory_equal(back.mask.data, maps.mask.data, (size_t)W * H);
    for (size_t i = 0; i < (size_t)W * H * 3; i++)
        assert_true(back.albedo.data[i] == weft_half_value(weft_half_bits(maps.albedo.data[i])));
    for (size_t i = 0; i < (size_t)W * H; i++) {
        assert_true(back.residual.data[i] == weft_half_value(weft_half_bits(maps.residual.data[i])));
        assert_true(back.confidence.data[i] == weft_half_value(weft_half_bits(maps.confidence.data[i])));
    }
    assert_true(json_equal(back.info, maps.info));
    weft_maps_fini(&back);
    weft_maps_fini(&maps);
}

static void test_pictures_for_looking_at(void **state)
{
    (void)state;
    weft_maps maps = make_maps();
    weft_raster normal, albedo;
    const float special[4][3] = {{0, 0, 1}, {-1, 0, 0}, {0, 1, 0}, {0, 0, 0}};
    for (int i = 0; i < 4; i++)
        for (int p = 0; p < 3; p++)
            weft_image_plane(&maps.normal, p)[i] = special[i][p];
    assert_ok(weft_maps_save(weft_test_path("b.maps"), &maps, false, err));
    assert_ok(weft_png_read(weft_test_path("b.maps/normal.png"), &normal, err));
    assert_ok(weft_png_read(weft_test_path("b.maps/albedo.png"), &albedo, err));
    assert_true(normal.bits == 16 && normal.channels == 3 && albedo.bits == 8 && albedo.channels == 3);
    const uint16_t codes[4][3] = {
        {32768, 32768, 65535}, {0, 32768, 32768}, {32768, 65535, 32768}, {32768, 32768, 32768}};
    assert_memory_equal(normal.data, codes, sizeof codes);
    for (size_t i = 0; i < (size_t)W * H * 3; i++) {
        const double n = (double)weft_image_plane(&maps.normal, (int)(i % 3))[i / 3];
        assert_near(normal.data[i], 65535 * (0.5 + 0.5 * n), 0.5 + 1e-6);
        const double a = (double)weft_image_plane(&maps.albedo, (int)(i % 3))[i / 3];
        assert_int_equal(albedo.data[i], weft_srgb_encode8(a));
    }
    weft_raster_fini(&normal);
    weft_raster_fini(&albedo);
    weft_maps_fini(&maps);
}

static void test_nothing_is_overwritten_unasked(void **state)
{
    (void)state;
    weft_maps maps = make_maps(), back;
    const char *const folder = weft_test_path("c.maps");
    assert_ok(weft_maps_save(folder, &maps, false, err));
    assert_fails(weft_maps_save(folder, &maps, false, err), WEFT_ERR_EXISTS, "--force");
    weft_mask_fini(&maps.mask); /* everywhere */
    maps.geometry = WEFT_GEOMETRY_SENSOR;
    maps.albedo_is_srgb = false;
    assert_ok(weft_maps_save(folder, &maps, true, err));
    assert_false(
        weft_file_exists(weft_test_path("c.maps/mask.png"))); /* the old one went with the old folder */
    assert_ok(weft_maps_load(folder, &back, err));
    assert_true(back.geometry == WEFT_GEOMETRY_SENSOR && back.mm_per_px == 0 && !back.albedo_is_srgb);
    assert_int_equal(back.mask.data[3], 0); /* its normal is nothing */
    assert_int_equal(back.mask.data[4], 255);
    weft_maps_fini(&back);
    weft_maps_fini(&maps);
}

static void test_bad_maps_are_not_saved(void **state)
{
    (void)state;
    weft_maps maps = make_maps();
    maps.mm_per_px = 0;
    assert_fails(weft_maps_save(weft_test_path("d.maps"), &maps, false, err), WEFT_ERR_RANGE, "mm per pixel");
    maps.mm_per_px = 1;
    maps.width = W + 1;
    assert_fails(weft_maps_save(weft_test_path("d.maps"), &maps, false, err), WEFT_ERR_MISMATCH,
                 "normal map");
    maps.width = W;
    assert_fails(weft_maps_save("/dev/null/d.maps", &maps, false, err), WEFT_ERR_IO, "/dev/null/d.maps");
    assert_false(weft_file_exists(weft_test_path("d.maps")));
    weft_maps_fini(&maps);
}

/* A folder of another program: R, G, B for X, Y, Z, normals of any length, NaN where there is none. */
static void test_foreign_folder(void **state)
{
    (void)state;
    static const char *const rgb[] = {"R", "G", "B"};
    weft_image normal;
    weft_maps back;
    assert_ok(weft_image_init(&normal, 4, 3, 3, err));
    for (size_t i = 0; i < 12; i++) {
        weft_image_plane(&normal, 0)[i] = 3;
        weft_image_plane(&normal, 2)[i] = 4;
    }
    normal.data[5] = NAN;
    normal.data[6] = INFINITY;
    assert_ok(weft_folder_create(weft_test_path("foreign"), err));
    assert_ok(weft_exr_write(weft_test_path("foreign/normal.exr"), &normal, rgb, WEFT_EXR_FLOAT, err));
    assert_ok(weft_maps_load(weft_test_path("foreign"), &back, err));
    assert_true(back.geometry == WEFT_GEOMETRY_SENSOR && back.width == 4 && back.height == 3);
    assert_true(back.albedo.planes == 0 && back.residual.planes == 0);
    for (size_t i = 0; i < 12; i++) {
        const bool bad = i == 5 || i == 6;
        assert_int_equal(back.mask.data[i], bad ? 0 : 255);
        assert_near((double)weft_image_plane(&back.normal, 0)[i], bad ? 0 : 0.6, 1e-7);
        assert_near((double)weft_image_plane(&back.normal, 2)[i], bad ? 0 : 0.8, 1e-7);
    }
    weft_maps_fini(&back);
    weft_image_fini(&normal);
}

static void write_text(const char *path, const char *text)
{
    assert_ok(weft_file_write(path, text, strlen(text), err));
}

static void test_damaged_folders(void **state)
{
    (void)state;
    weft_maps back;
    assert_fails(weft_maps_load(weft_test_path("absent"), &back, err), WEFT_ERR_IO,
                 "absent: is not a folder");
    assert_ok(weft_folder_create(weft_test_path("empty"), err));
    assert_fails(weft_maps_load(weft_test_path("empty"), &back, err), WEFT_ERR_MISSING,
                 "neither normal.exr nor albedo.exr");
    weft_maps maps = make_maps();
    assert_ok(weft_maps_save(weft_test_path("e.maps"), &maps, false, err));
    weft_maps_fini(&maps);
    const struct {
        const char *text;
        weft_err code;
        const char *says;
    } bad[] = {
        {"{\"weft\":\"maps\",\"version\":2,\"geometry\":\"sensor\"}", WEFT_ERR_VERSION, "update Weft"},
        {"{\"weft\":\"set\",\"version\":1}", WEFT_ERR_FORMAT, "is a \"set\""},
        {"{\"weft\":\"maps\",\"version\":1,\"geometry\":\"torus\"}", WEFT_ERR_FORMAT, "torus"},
        {"{\"weft\":\"maps\",\"version\":1,\"geometry\":\"plane\"}", WEFT_ERR_FORMAT, "mm_per_px"},
        {"{\"weft\":\"maps\",\"version\":1,\"geometry\":\"sensor\",\"width\":7}", WEFT_ERR_MISMATCH,
         "normal.exr: is 45 x 38, the rest of the folder 7 x 38"},
        {"{\"weft\":", WEFT_ERR_FORMAT, "maps.json: line 1"},
    };
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        write_text(weft_test_path("e.maps/maps.json"), bad[i].text);
        assert_fails(weft_maps_load(weft_test_path("e.maps"), &back, err), bad[i].code, bad[i].says);
    }
    write_text(weft_test_path("e.maps/maps.json"),
               "{\"weft\":\"maps\",\"version\":1,\"geometry\":\"sensor\"}");
    weft_mask mask;
    assert_ok(weft_mask_init(&mask, 5, 5, 255, err));
    assert_ok(weft_png_write_mask(weft_test_path("e.maps/mask.png"), &mask, err));
    weft_mask_fini(&mask);
    assert_fails(weft_maps_load(weft_test_path("e.maps"), &back, err), WEFT_ERR_MISMATCH,
                 "mask.png: is 5 x 5");
}

/* Every allocation fails in turn: an error, no leak, no folder left behind. */
static void test_without_memory(void **state)
{
    (void)state;
    weft_maps maps = make_maps(), back;
    long n = 0;
    for (;; n++) {
        weft_mem_fail_after(n);
        const weft_err status = weft_maps_save(weft_test_path("f.maps"), &maps, false, NULL);
        weft_mem_fail_after(-1);
        if (status == WEFT_OK)
            break;
        assert_false(weft_file_exists(weft_test_path("f.maps")));
    }
    assert_true(n > 10);
    for (n = 0;; n++) {
        weft_mem_fail_after(n);
        const weft_err status = weft_maps_load(weft_test_path("f.maps"), &back, NULL);
        weft_mem_fail_after(-1);
        if (status == WEFT_OK)
            break;
    }
    assert_true(n > 10);
    weft_maps_fini(&back);
    weft_maps_fini(&maps);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_round_trip),
        cmocka_unit_test(test_pictures_for_looking_at),
        cmocka_unit_test(test_nothing_is_overwritten_unasked),
        cmocka_unit_test(test_bad_maps_are_not_saved),
        cmocka_unit_test(test_foreign_folder),
        cmocka_unit_test(test_damaged_folders),
        cmocka_unit_test(test_without_memory),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
