/* Compositing against the formula worked by hand, textures' conventions, and what cannot be mixed. */
#include "tests/support/support.h"

#include "core/colour.h"
#include "core/file.h"
#include "core/formats/png_file.h"
#include "shading/brdf/brdf.h"
#include "shading/material/composite.h"

#include <math.h>
#include <string.h>

static weft_err bake(const char *text, int side, weft_baked *baked, weft_error *err)
{
    const char *const path = weft_test_path("c.radattr");
    weft_assets *assets = NULL;
    weft_composite_options options = {.width = side, .height = side};
    weft_err status = weft_file_write(path, text, strlen(text), err);
    if (status == WEFT_OK)
        status = weft_assets_load(path, NULL, &assets, err);
    if (status == WEFT_OK)
        status = weft_composite(assets, weft_assets_main(assets), &options, baked, err);
    weft_assets_destroy(assets);
    return status;
}

static void write_png(const char *name, int side, int channels, const uint16_t *data, int bits)
{
    weft_raster raster;
    assert_ok(weft_raster_init(&raster, side, side, channels, bits, err));
    memcpy(raster.data, data, (size_t)side * (size_t)side * (size_t)channels * sizeof *data);
    assert_ok(weft_png_write(weft_test_path(name), &raster, err));
    weft_raster_fini(&raster);
}

/* Three constants: each over the one below, then what the material itself sets (S-ORD-26). */
static void check_constants(void **state)
{
    (void)state;
    weft_baked b = {0};
    assert_ok(bake(":a := ( opaquematerial :albedo_color = 0.2 :specular_roughness = 0.4 )\n"
                   ":b := ( opaquematerial :albedo_color = [1, 0, 0.5] :specular_roughness = 0.8 )\n"
                   ":m := ( opaquematerial :specular_intensity = 0.08 :albedo_tint_color = [1, 1, 0.5]\n"
                   "    :layers = [ ( a ) ( b :alpha = 0.25 ) ( a :alpha = 0.5 :channels = albedo ) ] )",
                   8, &b, err));
    const double red = 0.5 * (0.2 + 0.25 * (1 - 0.2)) + 0.5 * 0.2,
                 blue = 0.5 * (0.2 + 0.25 * 0.3) + 0.5 * 0.2;
    assert_int_equal(b.maps[WEFT_BAKED_ALBEDO].n_mips, 0);
    assert_near((double)b.maps[WEFT_BAKED_ALBEDO].constant[0], red, 1e-6);
    assert_near((double)b.maps[WEFT_BAKED_ALBEDO].constant[2], 0.5 * blue, 1e-6); /* the tint multiplies */
    assert_near((double)b.maps[WEFT_BAKED_ROUGHNESS].constant[0], 0.5, 1e-6);     /* alpha, not its square */
    assert_near((double)b.maps[WEFT_BAKED_SPECULAR].constant[1], 0.08, 1e-6);     /* its own */
    weft_baked_fini(&b);
}

static void check_mask_and_normals(void **state)
{
    (void)state;
    static const uint16_t mask[4] = {0, 65535, 32768, 65535};
    /* 8 bit: x = 0.6, y = 0, z = 0.8 as nearly as the codes have it */
    static const uint16_t normals[12] = {204, 128, 230, 204, 128, 230, 204, 128, 230, 204, 128, 230};
    weft_baked b = {0};
    write_png("mask.png", 2, 1, mask, 16);
    write_png("nml.png", 2, 3, normals, 8);
    assert_ok(
        bake(":flat := ( opaquematerial )\n"
             ":bumpy := ( opaquematerial :normal_map = ( :name = \"nml\" ) )\n"
             ":m := ( opaquematerial :layers = [ ( flat ) ( bumpy :mask = ( :name = \"mask.png\" ) ) ] )",
             2, &b, err));
    const weft_image *const n = &b.maps[WEFT_BAKED_NORMAL].mips[0];
    const double slope = (204 / 127.5 - 1) / (230 / 127.5 - 1); /* x/z of the layer */
    for (int i = 0; i < 4; i++) {
        const double w = mask[i] / 65535.0, x = (double)n->data[i], z = (double)weft_image_plane(n, 2)[i];
        assert_near(x / z, w * slope, 1e-5);
        assert_near(x * x + z * z + (double)(weft_image_plane(n, 1)[i] * weft_image_plane(n, 1)[i]), 1, 1e-6);
    }
    weft_baked_fini(&b);
}

static void check_texture_conventions(void **state)
{
    (void)state;
    static const uint16_t colour[3] = {128, 255, 0}, normal[3] = {128, 255, 128};
    weft_baked b = {0};
    write_png("colour.png", 1, 3, colour, 8);
    write_png("down.png", 1, 3, normal, 8);
    assert_ok(bake(":m := ( opaquematerial :albedo_map = ( :name = \"colour.png\" )\n"
                   "  :specular_map = ( :name = \"colour.png\" :channel = r :scale = 2 :offset = -0.5 )\n"
                   "  :roughness_map = ( :name = \"colour.png\" ) :specular_roughness = 0.6\n"
                   "  :normal_map = ( :name = \"down.png\" :green = down ) )",
                   0, &b, err));
    assert_int_equal(b.width, 1);
    assert_near((double)b.maps[WEFT_BAKED_ALBEDO].mips[0].data[0], weft_srgb_decode(128 / 255.0), 1e-6);
    assert_near((double)b.maps[WEFT_BAKED_SPECULAR].mips[0].data[0], 0.04 * (2 * 128 / 255.0 - 0.5), 1e-6);
    assert_near((double)b.maps[WEFT_BAKED_ROUGHNESS].mips[0].data[0], 0.6 * (128 + 255) / 765.0, 1e-6);
    assert_true(b.maps[WEFT_BAKED_NORMAL].mips[0].data[1] < -0.99F);
    weft_baked_fini(&b);
}

static void check_lobes(void **state)
{
    (void)state;
    weft_baked b = {0};
    assert_ok(bake(":iso := ( opaquematerial :specular_roughness = 0.2 )\n"
                   ":silk := ( anisotropicmaterial :specular_roughness = 0.6 :anisotropy = 0.5\n"
                   "          :tangent_rotation_deg = 90 )\n"
                   ":m := ( opaquematerial :layers = [ ( iso ) ( silk :alpha = 0.75 ) ] )",
                   4, &b, err));
    assert_string_equal(b.type->name, "anisotropicmaterial");
    const double along = 0.2 + 0.75 * 0.4, across = 0.2 + 0.75 * 0.1;
    assert_near((double)b.maps[WEFT_BAKED_ROUGHNESS].constant[0], along, 1e-6);
    assert_near((double)b.maps[WEFT_BAKED_ANISOTROPY].constant[0], 1 - across / along, 1e-6);
    assert_near((double)b.maps[WEFT_BAKED_TANGENT].constant[1], 1, 1e-6); /* the heavier layer's */
    weft_baked_fini(&b);

    assert_ok(bake(":wet := ( opaquematerial ) :wool := ( clothmaterial )\n"
                   ":m := ( clothmaterial :layers = [ ( wool ) ( wet :alpha = 0.3 ) ] )",
                   4, &b, err));
    assert_string_equal(b.type->name, "clothmaterial");
    assert_near((double)b.maps[WEFT_BAKED_CLOTH].constant[0], 0.7, 1e-6);
    weft_baked_fini(&b);

    assert_fails(bake(":silk := ( anisotropicmaterial ) :wool := ( clothmaterial )\n"
                      ":m := ( clothmaterial :layers = [ ( wool ) ( silk :alpha = 0.3 ) ] )",
                      4, &b, err),
                 WEFT_ERR_UNSUPPORTED, "no model shades both");
}

static double at_texel(const weft_baked *b, weft_baked_kind kind, int plane, size_t i)
{
    const weft_baked_map *const map = &b->maps[kind];
    return (double)(map->n_mips ? weft_image_plane(&map->mips[0], plane)[i] : map->constant[plane]);
}

/* The parameters of ggx-cloth at a texel, in its order. */
static void values_at(const weft_baked *b, size_t i, double values[WEFT_BRDF_MAX_PLANES])
{
    static const struct {
        weft_baked_kind kind;
        int planes;
    } rows[] = {{WEFT_BAKED_ALBEDO, 3},       {WEFT_BAKED_SPECULAR, 3},     {WEFT_BAKED_ROUGHNESS, 1},
                {WEFT_BAKED_CLOTH, 1},        {WEFT_BAKED_CLOTH_ALBEDO, 3}, {WEFT_BAKED_CLOTH_SPECULAR, 1},
                {WEFT_BAKED_FRONT_TINT, 3},   {WEFT_BAKED_RIM_TINT, 3},     {WEFT_BAKED_CLOTH_ROUGHNESS, 1},
                {WEFT_BAKED_RIM_AMPLITUDE, 1}};
    for (size_t r = 0; r < sizeof rows / sizeof rows[0]; r++)
        for (int p = 0; p < rows[r].planes; p++)
            *values++ = at_texel(b, rows[r].kind, p, i);
}

/* GGX with cloth: what is seen is the blend of what both would show, for every mask, light and view. */
static void check_two_lobes(void **state)
{
    (void)state;
    static const uint16_t mask[4] = {0, 65535, 20000, 50000};
    const weft_brdf *ggx, *cloth, *both;
    double of_ggx[WEFT_BRDF_MAX_PLANES], of_cloth[WEFT_BRDF_MAX_PLANES], values[WEFT_BRDF_MAX_PLANES];
    uint64_t random = 7;
    weft_baked b = {0};
    write_png("mask.png", 2, 1, mask, 16);
    assert_ok(weft_brdf_find("ggx", &ggx, err));
    assert_ok(weft_brdf_find("cloth-two-tone", &cloth, err));
    assert_ok(weft_brdf_find("ggx-cloth", &both, err));
    weft_brdf_defaults(ggx, of_ggx);
    weft_brdf_defaults(cloth, of_cloth);
    assert_ok(weft_brdf_set(ggx, "albedo=0.1,0.2,0.3", of_ggx, err));
    assert_ok(weft_brdf_set(ggx, "f0=0.08", of_ggx, err));
    assert_ok(weft_brdf_set(ggx, "alpha=0.15", of_ggx, err));
    assert_ok(weft_brdf_set(cloth, "albedo=0.6,0.5,0.1", of_cloth, err));
    assert_ok(weft_brdf_set(cloth, "f0=0.05", of_cloth, err));
    assert_ok(weft_brdf_set(cloth, "alpha=0.7", of_cloth, err));
    assert_ok(weft_brdf_set(cloth, "rim=1,0.5,0.2", of_cloth, err));
    assert_ok(weft_brdf_set(cloth, "amplitude=3", of_cloth, err));
    assert_ok(
        bake(":wet := ( opaquematerial :albedo_color = [0.1, 0.2, 0.3] :specular_intensity = 0.08\n"
             "         :specular_roughness = 0.15 )\n"
             ":wool := ( clothmaterial :albedo_color = [0.6, 0.5, 0.1] :specular_intensity = 0.05\n"
             "          :specular_roughness = 0.7 :rim_tint_color = [1, 0.5, 0.2] :rim_amplitude = 3 )\n"
             ":m := ( clothmaterial :layers = [ ( wet ) ( wool :mask = ( :name = \"mask.png\" ) )\n"
             "        ( wet :alpha = 0.3 ) ( wool :alpha = 0.2 ) ] )",
             2, &b, err));
    assert_true(b.two_lobes);
    assert_string_equal(weft_baked_brdf(&b), "ggx-cloth");
    for (size_t i = 0; i < 4; i++) {
        const double share = mask[i] / 65535.0 * 0.7 * 0.8 + 0.2;
        values_at(&b, i, values);
        for (int k = 0; k < 50; k++) {
            double l[3], v[3], one[3], two[3], f[3];
            weft_brdf_direction(0.05 + 0.95 * weft_test_random(&random), 6 * weft_test_random(&random), l);
            weft_brdf_direction(0.05 + 0.95 * weft_test_random(&random), 6 * weft_test_random(&random), v);
            weft_brdf_eval_one(ggx, of_ggx, l, v, one);
            weft_brdf_eval_one(cloth, of_cloth, l, v, two);
            weft_brdf_eval_one(both, values, l, v, f);
            for (int c = 0; c < 3; c++)
                assert_near(f[c], (1 - share) * one[c] + share * two[c], 1e-5 * (one[c] + two[c]));
        }
    }
    weft_baked_fini(&b);

    /* a coat of colour alone lies on both; the material's own tint too; where cloth alone is left it is one
     * lobe */
    assert_ok(
        bake(":wet := ( opaquematerial :albedo_color = 0.2 ) :wool := ( clothmaterial :albedo_color = 0.4 )\n"
             ":dye := ( opaquematerial :albedo_color = [1, 0, 0] )\n"
             ":m := ( clothmaterial :layers = [ ( wet ) ( wool :alpha = 0.5 )\n"
             "        ( dye :alpha = 0.5 :channels = albedo ) ] :albedo_tint_color = 0.5 )",
             2, &b, err));
    assert_near((double)b.maps[WEFT_BAKED_CLOTH].constant[0], 0.5, 1e-6);
    assert_near((double)b.maps[WEFT_BAKED_ALBEDO].constant[0], 0.5 * 0.6, 1e-6);
    assert_near((double)b.maps[WEFT_BAKED_ALBEDO].constant[1], 0.5 * 0.1, 1e-6);
    assert_near((double)b.maps[WEFT_BAKED_CLOTH_ALBEDO].constant[0], 0.5 * 0.7, 1e-6);
    assert_near((double)b.maps[WEFT_BAKED_CLOTH_ALBEDO].constant[1], 0.5 * 0.2, 1e-6);
    weft_baked_fini(&b);
    assert_ok(bake(":wool := ( clothmaterial :specular_roughness = 0.4 )\n"
                   ":m := ( clothmaterial :layers = [ ( wool ) ( wool :alpha = 0.5 ) ] )",
                   2, &b, err));
    assert_false(b.two_lobes);
    weft_baked_fini(&b);
}

/* Every mask is 0..1, and one from noise repeats. */
static void check_generated_masks(void **state)
{
    (void)state;
    static const char *const kinds[] = {"noise", "slope", "height", "cavity"};
    static uint16_t normals[16 * 16 * 3];
    for (int i = 0; i < 256; i++) {
        normals[3 * (size_t)i] = (uint16_t)(128 + 60 * sin(i * 0.39269908));
        normals[3 * (size_t)i + 1] = 128;
        normals[3 * (size_t)i + 2] = 240;
    }
    write_png("waves.png", 16, 3, normals, 8);
    for (size_t k = 0; k < sizeof kinds / sizeof kinds[0]; k++) {
        char text[512];
        weft_baked b = {0};
        (void)snprintf(text, sizeof text,
                       ":w := ( opaquematerial :normal_map = ( :name = \"waves\" ) :albedo_color = 0 )\n"
                       ":m := ( opaquematerial :layers = [ ( w ) ( opaquematerial :albedo_color = 1\n"
                       "  :channels = albedo :mask = ( :from = %s :low = %s :high = %s ) ) ] )",
                       kinds[k], k == 2 ? "-0.5" : "0.2", k == 2 ? "0.5" : "0.8");
        assert_ok(bake(text, 0, &b, err));
        float least = 1, most = 0;
        for (int i = 0; i < 256; i++) {
            least = fminf(least, b.maps[WEFT_BAKED_ALBEDO].mips[0].data[i]);
            most = fmaxf(most, b.maps[WEFT_BAKED_ALBEDO].mips[0].data[i]);
        }
        assert_true(least >= 0 && most <= 1 && most - least > 0.3F);
        weft_baked_fini(&b);
    }
}

static void check_missing_files(void **state)
{
    (void)state;
    weft_baked b = {0};
    assert_fails(bake(":m := ( opaquematerial :normal_map = ( :name = \"gone\" ) )", 4, &b, err),
                 WEFT_ERR_MISSING, "c.radattr:1:48: there is no image");
    assert_fails(bake(":m := ( opaquematerial :scan = \"x.maps\" )", 4, &b, err), WEFT_ERR_UNSUPPORTED,
                 "1:25: scans");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(check_constants),           cmocka_unit_test(check_mask_and_normals),
        cmocka_unit_test(check_texture_conventions), cmocka_unit_test(check_lobes),
        cmocka_unit_test(check_two_lobes),           cmocka_unit_test(check_generated_masks),
        cmocka_unit_test(check_missing_files),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
