/* What lint says of maps that were spoilt in a known way, where a file of such maps is hard to come by. */
#include "tests/support/support.h"

#include "shading/export/map_lint.h"

#include <stdio.h>
#include <string.h>

/* The last finding of a check. */
typedef struct finding {
    const char *check;
    weft_lint_level level;
    char text[512];
} finding;

static void keep(void *context, weft_lint_level level, const char *check, const char *text)
{
    finding *const f = context;
    if (strcmp(check, f->check) != 0)
        return;
    f->level = level;
    (void)snprintf(f->text, sizeof f->text, "%s", text);
}

/* A chain of `n` levels of 8 x 8 texels; level l is `scale` to the power of l times as bright. */
static finding lint_chain(weft_map_kind kind, int n, float scale)
{
    finding f = {.check = "mip chain"};
    const weft_lint lint = {keep, &f};
    weft_map map = {.kind = kind, .n_levels = n};
    weft_error err = {0};
    float value = 0.4F;
    for (int level = 0; level < n; level++, value *= scale) {
        assert_int_equal(weft_image_init(&map.levels[level], 8 >> level, 8 >> level, 1, &err), WEFT_OK);
        for (size_t i = 0; i < weft_image_plane_size(&map.levels[level]); i++)
            map.levels[level].data[i] = value;
    }
    weft_lint_mips(&lint, &map);
    weft_map_fini(&map);
    return f;
}

static void test_mip_chains(void **state)
{
    (void)state;
    assert_int_equal(lint_chain(WEFT_MAP_ALBEDO, 4, 1).level, WEFT_LINT_GOOD);
    assert_non_null(strstr(lint_chain(WEFT_MAP_ALBEDO, 4, 1).text, "4 levels"));
    assert_int_equal(lint_chain(WEFT_MAP_ALBEDO, 4, 0.95F).level, WEFT_LINT_WRONG);
    assert_non_null(strstr(lint_chain(WEFT_MAP_ALBEDO, 4, 0.95F).text, "-14.3 % (level 3)"));
    assert_int_equal(lint_chain(WEFT_MAP_ALBEDO, 3, 1).level, WEFT_LINT_WRONG);
    assert_non_null(strstr(lint_chain(WEFT_MAP_ALBEDO, 3, 1).text, "end at 2 x 2"));
    assert_int_equal(lint_chain(WEFT_MAP_ROUGHNESS, 4, 1.1F).level, WEFT_LINT_GOOD);
    assert_int_equal(lint_chain(WEFT_MAP_ROUGHNESS, 4, 0.9F).level, WEFT_LINT_WRONG);
    assert_int_equal(lint_chain(WEFT_MAP_SCALAR, 4, 0.5F).level, WEFT_LINT_GOOD);
    assert_string_equal(lint_chain(WEFT_MAP_ALBEDO, 1, 1).text, ""); /* no mips, nothing to say */
}

/* Names as libraries of textures and engines have them. */
static void test_names(void **state)
{
    static const struct {
        const char *name;
        weft_map_kind kind;
    } rows[] = {
        {"Fabric032_1K-PNG_NormalGL.png", WEFT_MAP_NORMAL},
        {"fabric_pattern_07_nor_gl_1k.exr", WEFT_MAP_NORMAL},
        {"t_cloth_n.png", WEFT_MAP_NORMAL},
        {"Fabric032_1K-PNG_Color.png", WEFT_MAP_ALBEDO},
        {"fabric_pattern_07_col_1_1k.jpg", WEFT_MAP_ALBEDO},
        {"denim_diff_2k.jpg", WEFT_MAP_ALBEDO},
        {"T_Cloth_BaseColor.tga", WEFT_MAP_ALBEDO},
        {"Denim_F0.png", WEFT_MAP_SPECULAR},
        {"maps/Rough.PNG", WEFT_MAP_ROUGHNESS},
        {"Fabric_AmbientOcclusion.png", WEFT_MAP_SCALAR},
        {"denim_ao_2k.jpg", WEFT_MAP_SCALAR},
        {"cloth_disp.png", WEFT_MAP_SCALAR},
        {"cloth_bump.png", WEFT_MAP_SCALAR},
        {"chaos.png", WEFT_MAP_OTHER},
        {"collar.png", WEFT_MAP_OTHER},
        {"normals/scan.png", WEFT_MAP_OTHER},
    };
    char prefix[WEFT_MAP_LONGEST_NAME];
    (void)state;
    for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++)
        if (weft_map_kind_of(rows[i].name, prefix) != rows[i].kind)
            fail_msg("%s is read as another kind", rows[i].name);
    (void)weft_map_kind_of("set/Denim_F0.png", prefix);
    assert_string_equal(prefix, "denim_");
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_mip_chains), cmocka_unit_test(test_names)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
