/* The material language: the seed's example, inheritance, and what is said of every mistake. */
#include "tests/support/support.h"

#include "core/file.h"
#include "core/mem.h"
#include "shading/bake/baked.h"
#include "shading/material/asset.h"

#include <dirent.h>
#include <stdlib.h>
#include <string.h>

/* The Order: 1886, Inheritance-based Data Format, as printed: the second base misspells the first name. */
static const char order_example[] = ":bumpy_material := ( opaquematerial\n"
                                    ":enable_diffuse_ = true\n"
                                    ":enable_specular_ = true\n"
                                    ":specular_map = (\n"
                                    ":name = \"bumpy_material_spc\"\n"
                                    ")\n"
                                    ":normal_map = (\n"
                                    ":name = \"bumpy_material_nml\"\n"
                                    ")\n"
                                    ":specular_intensity = 0.05\n"
                                    ":specular_roughness = 0.1\n"
                                    ")\n"
                                    ":bumpy_material_red := ( bumpymaterial\n"
                                    ":albedo_tint_color = (\n"
                                    ":r = 1.0\n"
                                    ":g = 0.0\n"
                                    ":b = 0.0\n"
                                    ")\n"
                                    ")\n";

static const char *write_text(const char *name, const char *text)
{
    const char *const path = weft_test_path(name);
    assert_ok(weft_file_write(path, text, strlen(text), err));
    return path;
}

/* What the user reads, in a static buffer, with the folder of the test cut away. */
static const char *printed(const weft_assets *assets)
{
    static char text[8192];
    char *raw = NULL;
    size_t n = 0;
    FILE *const out = open_memstream(&raw, &n);
    assert_non_null(out);
    weft_diagnostics_print(weft_assets_diagnostics(assets), out);
    (void)fclose(out);
    const size_t folder = strlen(weft_test_folder()) + 1;
    char *to = text;
    for (const char *from = raw; *from && to < text + sizeof text - 1;)
        if (strncmp(from, weft_test_folder(), folder - 1) == 0)
            from += folder;
        else
            *to++ = *from++;
    *to = '\0';
    free(raw);
    return text;
}

static void expect(const char *text, weft_err code, const char *diagnostics)
{
    weft_assets *assets;
    weft_error why = {0};
    const weft_err status = weft_assets_load(write_text("t.radattr", text), NULL, &assets, &why);
    if (status != code)
        fail_msg("got %s (%s) for:\n%s", weft_err_name(status), why.text, text);
    assert_non_null(assets);
    assert_string_equal(printed(assets), diagnostics);
    weft_assets_destroy(assets);
}

static void check_order_example_as_printed(void **state)
{
    (void)state;
    expect(order_example, WEFT_ERR_FORMAT,
           "t.radattr:13:26: error: there is no material 'bumpymaterial'; did you mean 'bumpy_material'?\n"
           " 13 | :bumpy_material_red := ( bumpymaterial\n"
           "    |                          ^~~~~~~~~~~~~\n");
}

static void check_order_example_corrected(void **state)
{
    (void)state;
    char text[sizeof order_example + 1] = "";
    const char *const split = strstr(order_example, "bumpymaterial");
    (void)snprintf(text, sizeof text, "%.*sbumpy_material%s", (int)(split - order_example), order_example,
                   split + strlen("bumpymaterial"));
    weft_assets *assets;
    const weft_asset *red;
    assert_ok(weft_assets_load(write_text("order.radattr", text), NULL, &assets, err));
    assert_string_equal(printed(assets), "");
    assert_ok(weft_assets_find(assets, "bumpy_material_red", &red, err));
    assert_ptr_equal(weft_assets_main(assets), red);
    assert_string_equal(red->type->name, "opaquematerial");

    const weft_rad_record *const p = &red->properties;
    double rgb[3];
    weft_rad_colour(p, "albedo_tint_color", -1, rgb);
    assert_true(rgb[0] == 1 && rgb[1] == 0 && rgb[2] == 0);
    assert_true(weft_rad_number(p, "specular_roughness", -1) == 0.1);
    assert_string_equal(weft_rad_text(p, "specular_map.name", ""), "bumpy_material_spc");
    assert_true(weft_rad_flag(p, "enable_diffuse", false));
    assert_string_equal(weft_rad_at(p, "albedo_tint_color")->set_by, "bumpy_material_red");
    assert_string_equal(weft_rad_at(p, "specular_roughness")->set_by, "bumpy_material");
    assert_string_equal(weft_rad_at(p, "normal_strength")->set_by, "opaquematerial");
    weft_assets_destroy(assets);
}

static void check_inheritance(void **state)
{
    (void)state;
    weft_assets *assets;
    const weft_asset *asset;
    double rgb[3], tiling[2];
    assert_ok(weft_assets_load(
        write_text("i.radattr", ":leaf := ( middle :albedo_tint_color = ( :r = 0.25 ) ) // defined later\n"
                                ":middle := ( root :normal_map = ( :name = \"b.png\" ) )\n"
                                ":root := ( clothmaterial\n"
                                "    :albedo_tint_color = #ff8000 :rim_tint_color = [0.1, 0.2, 0.3]\n"
                                "    :front_tint_color = 0.5\n"
                                "    :normal_map = ( :name = \"a.png\" :green = down :tiling = [3, 4] )\n"
                                ")\n"),
        NULL, &assets, err));
    assert_string_equal(printed(assets), "");
    assert_ok(weft_assets_find(assets, "leaf", &asset, err));
    const weft_rad_record *const p = &asset->properties;
    weft_rad_colour(p, "albedo_tint_color", -1, rgb);
    assert_near(rgb[0], 0.25, 0);           /* its own */
    assert_near(rgb[1], 0.215860500, 1e-9); /* sRGB 128, IEC 61966-2-1 */
    assert_near(rgb[2], 0, 0);
    weft_rad_colour(p, "rim_tint_color", -1, rgb);
    assert_near(rgb[2], 0.3, 0);
    weft_rad_colour(p, "front_tint_color", -1, rgb);
    assert_near(rgb[1], 0.5, 0);
    assert_string_equal(weft_rad_text(p, "normal_map.name", ""), "b.png");
    assert_string_equal(weft_rad_text(p, "normal_map.green", ""), "down"); /* merged, not replaced */
    assert_int_equal(weft_rad_numbers(p, "normal_map.tiling", 2, tiling), 2);
    assert_true(tiling[0] == 3 && tiling[1] == 4);
    assert_string_equal(weft_rad_at(p, "normal_map.name")->set_by, "middle");
    assert_string_equal(weft_rad_at(p, "normal_map.green")->set_by, "root");
    weft_assets_destroy(assets);
}

static void check_layers(void **state)
{
    (void)state;
    weft_assets *assets;
    weft_asset layer;
    assert_ok(weft_assets_load(
        write_text("l.radattr",
                   ":dirt := ( opaquematerial :albedo_color = 0.1 :specular_roughness = 0.9 )\n"
                   ":dirty := ( clothmaterial :layers = [\n"
                   "    ( dirt :alpha = 0.5 :specular_roughness = 0.7 :mask = ( :from = cavity ) )\n"
                   "] )\n"),
        NULL, &assets, err));
    assert_string_equal(printed(assets), "");
    const weft_rad_member *const list = weft_rad_at(&weft_assets_main(assets)->properties, "layers");
    assert_ok(weft_assets_layer(assets, &list->value->items->record, &layer, err));
    assert_near(weft_rad_number(&layer.properties, "alpha", 1), 0.5, 0);
    assert_near(weft_rad_number(&layer.properties, "specular_roughness", 1), 0.7, 0);
    assert_near(weft_rad_number(&layer.properties, "albedo_color.g", 1), 0.1, 0);
    assert_string_equal(weft_rad_text(&layer.properties, "mask.from", ""), "cavity");
    weft_assets_destroy(assets);
}

static void check_mistakes(void **state)
{
    (void)state;
    static const struct {
        const char *text, *said;
    } mistakes[] = {
        {":a := ( opaquematerial :specular_roughness = 2 )",
         "t.radattr:1:46: error: specular_roughness is 0.001 to 1, not 2\n"
         " 1 | :a := ( opaquematerial :specular_roughness = 2 )\n"
         "   |                                              ^\n"},
        {":a := ( opaquematerial :specular_roughness = true )",
         "t.radattr:1:46: error: specular_roughness is a number, not true or false\n"
         " 1 | :a := ( opaquematerial :specular_roughness = true )\n"
         "   |                                              ^~~~\n"},
        {":a := ( opaquematerial\n\t:normal_map = ( :green = dwn ) )",
         "t.radattr:2:27: error: green is one of up|down, not 'dwn'; did you mean 'down'?\n"
         " 2 | \t:normal_map = ( :green = dwn ) )\n"
         "   | \t                         ^~~\n"},
        {":a := ( b ) :b := ( c ) :c := ( a )",
         "t.radattr:1:9: error: materials derive from each other in a circle: a -> b -> c -> a\n"
         " 1 | :a := ( b ) :b := ( c ) :c := ( a )\n"
         "   |         ^\n"},
        {":a := ( opaquematerial :opacity = 1 :opacity = 1 )",
         "t.radattr:1:38: error: 'opacity' has been set in line 1; keep one of the two\n"
         " 1 | :a := ( opaquematerial :opacity = 1 :opacity = 1 )\n"
         "   |                                      ^~~~~~~\n"},
        {":a := ( opaquematerial ) :a := ( clothmaterial )",
         "t.radattr:1:27: error: 'a' is also defined in t.radattr:1; rename one\n"
         " 1 | :a := ( opaquematerial ) :a := ( clothmaterial )\n"
         "   |                           ^\n"},
        {":a := ( opaquematerial :\xc3\xa4 = 1 )",
         "t.radattr:1:25: error: this character has no meaning here\n"
         " 1 | :a := ( opaquematerial :\xc3\xa4 = 1 )\n"
         "   |                         ^\n"},
        {":a := ( opaquematerial", "t.radattr:1:7: error: this '(' is never closed\n"
                                   " 1 | :a := ( opaquematerial\n"
                                   "   |       ^\n"},
        {":a := ( opaquematerial :scan = \"x )",
         "t.radattr:1:32: error: this text is never closed with '\"'\n"
         " 1 | :a := ( opaquematerial :scan = \"x )\n"
         "   |                                ^\n"},
        {":a := ( opaquematerial :opacity = nan )", "t.radattr:1:35: error: opacity is a number, not a name\n"
                                                    " 1 | :a := ( opaquematerial :opacity = nan )\n"
                                                    "   |                                   ^~~\n"},
        {"include \"gone.radattr\"",
         "t.radattr:1:9: error: gone.radattr: cannot be opened: No such file or directory\n"
         " 1 | include \"gone.radattr\"\n"
         "   |         ^~~~~~~~~~~~~~\n"},
        {":a := ( opaquematerial :layers = [ ( a ) ] )",
         "t.radattr:1:38: error: 'a' would lie in itself: 'a' is made of it\n"
         " 1 | :a := ( opaquematerial :layers = [ ( a ) ] )\n"
         "   |                                      ^\n"},
        {":a := ( opaquematerial :mine = 1 ) :b := ( a :mine = \"x\" )", NULL},
    };
    for (size_t i = 0; i < sizeof mistakes / sizeof mistakes[0]; i++)
        if (mistakes[i].said)
            expect(mistakes[i].text, WEFT_ERR_FORMAT, mistakes[i].said);
    weft_assets *assets;
    assert_fails(weft_assets_load(write_text("k.radattr", mistakes[12].text), NULL, &assets, err),
                 WEFT_ERR_FORMAT, "'mine' is a text here, but a number in 'a'");
    weft_assets_destroy(assets);
}

static void check_unknown_properties_are_kept(void **state)
{
    (void)state;
    expect(":a := ( opaquematerial :specular_rougness = 0.5 :my_studio_tag = \"x\" )", WEFT_OK,
           "t.radattr:1:25: warning: nothing reads 'specular_rougness'; did you mean 'specular_roughness'?\n"
           " 1 | :a := ( opaquematerial :specular_rougness = 0.5 :my_studio_tag = \"x\" )\n"
           "   |                         ^~~~~~~~~~~~~~~~~\n"
           "t.radattr:1:50: warning: nothing reads 'my_studio_tag'\n"
           " 1 | :a := ( opaquematerial :specular_rougness = 0.5 :my_studio_tag = \"x\" )\n"
           "   |                                                  ^~~~~~~~~~~~~\n");
}

static void check_files_that_are_no_text(void **state)
{
    (void)state;
    weft_assets *assets;
    assert_ok(weft_file_write(weft_test_path("latin1.radattr"), ":\xe4", 2, err));
    assert_fails(weft_assets_load(weft_test_path("latin1.radattr"), NULL, &assets, err), WEFT_ERR_FORMAT,
                 "UTF-8");
    assert_null(assets);
    assert_fails(weft_assets_load(weft_test_path("none.radattr"), NULL, &assets, err), WEFT_ERR_IO,
                 "none.radattr");
    char deep[300] = ":a := ( opaquematerial :x = ";
    memset(deep + strlen(deep), '[', 200);
    assert_fails(weft_assets_load(write_text("deep.radattr", deep), NULL, &assets, err), WEFT_ERR_FORMAT,
                 "nested deeper than 64");
    weft_assets_destroy(assets);
}

static char *formatted(const char *text)
{
    weft_arena arena = {0};
    weft_diagnostics diagnostics = {.arena = &arena};
    const weft_source source = {"f.radattr", text, strlen(text)};
    const weft_rad_file *const file = weft_rad_parse(&source, &arena, &diagnostics);
    assert_non_null(file);
    char *out = NULL;
    size_t n = 0;
    FILE *const stream = open_memstream(&out, &n);
    assert_non_null(stream);
    weft_rad_format(file, stream);
    (void)fclose(stream);
    weft_arena_fini(&arena);
    return out;
}

static void check_formatter(void **state)
{
    (void)state;
    char *const once =
        formatted("// swatches\ninclude <cotton.radattr>\n"
                  ":a:=(opaquematerial:opacity=1.50 // half\n\n\n\n // why\n :scan=\"x.maps\"\n"
                  ":albedo_tint_color=(:r=1:g=2)/*both*/:layers=[(b:alpha=1)(c)] /* end */ ) // a\n"
                  "// last");
    assert_string_equal(once, "// swatches\n"
                              "include <cotton.radattr>\n"
                              "\n"
                              ":a := ( opaquematerial\n"
                              "    :opacity = 1.50  // half\n"
                              "\n"
                              "    // why\n"
                              "    :scan = \"x.maps\"\n"
                              "    :albedo_tint_color = ( :r = 1 :g = 2 )  /*both*/\n"
                              "    :layers = [\n"
                              "        ( b :alpha = 1 )\n"
                              "        ( c )\n"
                              "    ]  /* end */\n"
                              ")  // a\n"
                              "// last\n");
    char *const twice = formatted(once);
    assert_string_equal(twice, once);
    free(once);
    free(twice);
}

/* Every template of the library resolves without a word, and is written as the formatter writes. */
static void check_library(void **state)
{
    (void)state;
    char folder[1024];
    (void)snprintf(folder, sizeof folder, "%s/shading/material/library", getenv("WEFT_TEST_SOURCE"));
    DIR *const list = opendir(folder);
    assert_non_null(list);
    int n_files = 0, n_materials = 0;
    for (const struct dirent *one; (one = readdir(list));) {
        if (!weft_path_has_suffix(one->d_name, ".radattr"))
            continue;
        char path[2048], *text;
        size_t n;
        weft_assets *assets;
        (void)snprintf(path, sizeof path, "%s/%s", folder, one->d_name);
        assert_ok(weft_assets_load(path, folder, &assets, err));
        assert_string_equal(printed(assets), "");
        while (weft_assets_get(assets, n_materials))
            n_materials++;
        weft_assets_destroy(assets);
        assert_ok(weft_file_read(path, 1 << 20, &text, &n, err));
        char *const again = formatted(text);
        assert_string_equal(again, text);
        free(again);
        weft_free(text);
        n_files++;
    }
    (void)closedir(list);
    assert_true(n_files >= 9 && n_materials > 0);
}

/* The container of baked maps: defaults by type, one size for all maps, names. */
static void check_baked_container(void **state)
{
    (void)state;
    weft_baked baked;
    assert_ok(weft_baked_init(&baked, "velvet", weft_material_type_find("clothmaterial"), err));
    assert_true(baked.maps[WEFT_BAKED_CLOTH].constant[0] == 1 &&
                baked.maps[WEFT_BAKED_NORMAL].constant[2] == 1);
    assert_ok(weft_baked_add(&baked, WEFT_BAKED_ALBEDO, 8, 4, err));
    assert_fails(weft_baked_add(&baked, WEFT_BAKED_HEIGHT, 8, 8, err), WEFT_ERR_MISMATCH, "height is 8 x 8");
    assert_int_equal(weft_baked_levels(8, 4), 4);
    assert_int_equal(weft_baked_levels(32768, 1), WEFT_BAKED_MAX_MIPS);
    for (int kind = 0; kind < WEFT_BAKED_COUNT; kind++)
        assert_int_equal(weft_baked_find(weft_baked_rows[kind].name), kind);
    weft_baked_fini(&baked);
}

/* Damaged texts: an answer or an error, never a crash (the sanitizers watch). */
static void check_damaged_texts(void **state)
{
    (void)state;
    uint64_t random = 886;
    static const char bits[] = ":=()[]\"<>#,/* \n_a1.-";
    for (int round = 0; round < 400; round++) {
        char text[sizeof order_example];
        memcpy(text, order_example, sizeof text);
        for (int k = 0; k < 1 + round % 5; k++)
            text[(size_t)(weft_test_random(&random) * (sizeof text - 1))] =
                bits[(size_t)(weft_test_random(&random) * (sizeof bits - 1))];
        weft_assets *assets;
        weft_error why = {0};
        const weft_err status = weft_assets_load(write_text("d.radattr", text), NULL, &assets, &why);
        assert_true(status == WEFT_OK || status == WEFT_ERR_FORMAT);
        if (assets)
            (void)printed(assets);
        weft_assets_destroy(assets);
    }
}

static void check_memory_runs_out(void **state)
{
    (void)state;
    const char *const path = write_text("m.radattr", order_example);
    for (long n = 0; n < 20; n++) {
        weft_assets *assets;
        weft_error why = {0};
        weft_mem_fail_after(n);
        const weft_err status = weft_assets_load(path, NULL, &assets, &why);
        weft_mem_fail_after(-1);
        assert_true(status == WEFT_ERR_NOMEM || status == WEFT_ERR_FORMAT);
        weft_assets_destroy(assets);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(check_order_example_as_printed),
        cmocka_unit_test(check_order_example_corrected),
        cmocka_unit_test(check_inheritance),
        cmocka_unit_test(check_layers),
        cmocka_unit_test(check_mistakes),
        cmocka_unit_test(check_unknown_properties_are_kept),
        cmocka_unit_test(check_files_that_are_no_text),
        cmocka_unit_test(check_formatter),
        cmocka_unit_test(check_library),
        cmocka_unit_test(check_baked_container),
        cmocka_unit_test(check_damaged_texts),
        cmocka_unit_test(check_memory_runs_out),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
