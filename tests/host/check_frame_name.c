/* Names of frames from a template: what each field says, what vanishes, what is refused. */
#include "tests/support/support.h"

#include "host/capture/exposures.h"
#include "host/capture/frame_name.h"
#include "host/capture/plan.h"

#include <string.h>

static const weft_frame_facts light = {.set = "harris-tweed-07",
                                       .created = "2026-11-23T10:04:05Z",
                                       .role = WEFT_ROLE_LIGHT,
                                       .light = 3,
                                       .bracket = 1,
                                       .index = 11,
                                       .exposure_s = 0.04};
static const weft_frame_facts ambient = {.set = "Harris Tweed/07: w\xc3\xa4rm",
                                         .created = "2026-11-23T10:04:05Z",
                                         .role = WEFT_ROLE_AMBIENT,
                                         .light = -1,
                                         .bracket = -1,
                                         .exposure_s = 2.5e-5};

static void test_fields(void **state)
{
    (void)state;
    const struct {
        const char *template, *light, *ambient;
    } rows[] = {
        {WEFT_FRAME_NAME_DEFAULT, "light-03-b1.dng", "ambient.dng"},
        {"{light}_{kind}.{exposure}", "03_light.0.04s.dng", "ambient.2.5e-05s.dng"},
        {"{bracket}-{light}-x", "b1-03-x.dng", "x.dng"},
        {"{index}{kind}", "011light.dng", "000ambient.dng"},
        {"{date}T{time}-{kind}.DNG", "2026-11-23T100405-light.dng", "2026-11-23T100405-ambient.dng"},
        {"{set}+{kind}", "harris-tweed-07+light.dng", "Harris-Tweed-07--w\xc3\xa4rm+ambient.dng"},
        {"weft_{light}", "weft_03.dng", "weft.dng"},
        {"\xe5\xb8\x83={kind}", "\xe5\xb8\x83=light.dng", "\xe5\xb8\x83=ambient.dng"},
    };
    for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++) {
        char file[WEFT_FRAME_NAME_SIZE];
        assert_ok(weft_frame_name_check(rows[i].template, err));
        assert_ok(weft_frame_name_make(rows[i].template, &light, ".dng", file, err));
        assert_string_equal(file, rows[i].light);
        assert_ok(weft_frame_name_make(rows[i].template, &ambient, ".dng", file, err));
        assert_string_equal(file, rows[i].ambient);
    }
}

static void test_what_no_name_may_be(void **state)
{
    (void)state;
    const struct {
        const char *template, *words;
    } rows[] = {
        {"{kind}/{light}", "lie in one folder; leave out the '/'"},
        {"..\\{kind}", "begin with a letter"},
        {"a\\{kind}", "leave out the '\\'"},
        {"-rf{kind}", "begin with a letter"},
        {".{kind}", "begin with a letter"},
        {"", "begin with a letter"},
        {"{lihgt}", "there is no field {lihgt}; there are {set}, {kind}"},
        {"{kind}-{light", "there is no field {light"},
        {"{kind} {light}", "only letters, digits"},
        {"{kind}\n", "only letters, digits"},
        {"{kind}:{light}", "only letters, digits"},
        {"$({kind})", "only letters, digits"},
        {"\xff{kind}", "not UTF-8"},
    };
    char file[WEFT_FRAME_NAME_SIZE] = "untouched", longer[2 * WEFT_FRAME_NAME_SIZE];
    for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++)
        assert_fails(weft_frame_name_check(rows[i].template, err), WEFT_ERR_USAGE, rows[i].words);
    assert_fails(weft_frame_name_make("{light}", &ambient, ".dng", file, err), WEFT_ERR_USAGE,
                 "nothing is left of it for the ambient frame; add {kind}");
    memset(longer, 'x', sizeof longer);
    longer[sizeof longer - 1] = '\0';
    assert_fails(weft_frame_name_make(longer, &light, ".dng", file, err), WEFT_ERR_USAGE, "more than 127");
    const weft_frame_facts long_set = {.set = longer, .created = "", .light = -1, .bracket = -1};
    assert_fails(weft_frame_name_make("{set}", &long_set, ".dng", file, err), WEFT_ERR_USAGE,
                 "more than 127");
    assert_string_equal(file, "untouched");
}

/* Two frames of one name would be one file. */
static void test_collisions(void **state)
{
    (void)state;
    static weft_capture_plan plan;
    weft_set set = {.name = (char *)(uintptr_t) "twill", .created = "2026-11-23T10:04:05Z"};
    const struct {
        const char *template, *words;
    } rows[] = {
        {"{kind}-{bracket}", "light 0 and light 1 would both be light-b1.dng; add {light}"},
        {"{set}-{light}-{bracket}",
         "the ambient frame and the dark frame would both be twill.dng; add {kind}"},
        {"{kind}-{light}",
         "two exposures of light 0 would both be light-00.dng; add {bracket} or {exposure}"},
        {"Light-{light}-{bracket}-{set}", "would both be Light-twill.dng; add {kind}"},
    };
    weft_capture_options o = {.lights = 3, .exposure_s = 0.04, .bracket = 3, .dark = true};
    weft_exposures_apply(&o);
    for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++) {
        o.file_name = rows[i].template;
        assert_fails(weft_capture_plan_make(&o, 2, &set, ".dng", &plan, err), WEFT_ERR_USAGE, rows[i].words);
    }
    o.file_name = "{kind}-{light}-{exposure}";
    assert_ok(weft_capture_plan_make(&o, 2, &set, ".nef", &plan, err));
    assert_int_equal(plan.n, 8);
    assert_string_equal(plan.frames[0].file, "ambient-0.04s.nef");
    assert_string_equal(plan.frames[1].file, "light-00-0.04s.nef"); /* the middle first */
    assert_string_equal(plan.frames[2].file, "light-00-0.01s.nef");
    assert_string_equal(plan.frames[6].file, "light-01-0.16s.nef");
    assert_true(weft_frame_name_equal("Light-00.DNG", "light-00.dng"));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_fields),
        cmocka_unit_test(test_what_no_name_may_be),
        cmocka_unit_test(test_collisions),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
