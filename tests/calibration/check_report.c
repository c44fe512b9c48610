/* The report: its verdict on calibrations that are good, bad, old or not there, and pages that hold together.
 */
#include "tests/support/support.h"

#include "calibration/calibration_report.h"
#include "calibration/report/report.h"
#include "core/file.h"
#include "core/mem.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const weft_finding *finding(const weft_verdict *v, const char *part, const char *words)
{
    for (int i = 0; i < v->n; i++)
        if (strcmp(v->findings[i].part, part) == 0 && strstr(v->findings[i].text, words))
            return &v->findings[i];
    fail_msg("nothing is said of %s with the words \"%s\"", part, words);
    return NULL;
}

#define assert_grade(verdict, part, words, wanted)                                                           \
    do {                                                                                                     \
        const weft_finding *const f = finding(verdict, part, words);                                         \
        assert_string_equal(weft_grade_name(f->grade), weft_grade_name(wanted));                             \
        assert_int_equal(f->remedy[0] == '\0', (wanted) == WEFT_GRADE_GOOD);                                 \
    } while (0)

/* A page must be whole HTML, load nothing, and hold no number that is none. */
static void check_page(const weft_calibration *cal, const char *name, const weft_white_sheet *sheet)
{
    static const char script[] =
        "import sys, html.parser\n"
        "void = {'meta', 'br', 'image', 'path', 'circle', 'rect'}\n"
        "class P(html.parser.HTMLParser):\n"
        "    stack = []\n"
        "    def handle_starttag(self, tag, attrs):\n"
        "        for key, value in attrs:\n"
        "            assert key not in ('src', 'onload', 'onclick'), key\n"
        "            assert key != 'href' or value.startswith('data:image/png;base64,'), value\n"
        "        assert tag not in ('script', 'link', 'iframe'), tag\n"
        "        if tag not in void or tag in ('circle', 'rect'): self.stack.append(tag)\n"
        "    def handle_startendtag(self, tag, attrs): pass\n"
        "    def handle_endtag(self, tag): assert self.stack and self.stack.pop() == tag, (tag, self.stack)\n"
        "text = open(sys.argv[1], encoding='utf-8').read()\n"
        "p = P(); p.feed(text); p.close()\n"
        "assert not p.stack, p.stack\n"
        "body = text[text.index('<body'):]\n"
        "assert '>nan' not in body and 'NaN' not in body and 'inf\"' not in body and '=\"nan' not in body\n"
        "assert '<b>bold' not in body\n";
    weft_text_buffer page = {0};
    weft_verdict verdict;
    char command[600], file[256], code[256];
    weft_report_judge(cal, &verdict);
    weft_report_page(cal, name, sheet, &verdict, &page);
    assert_ok(weft_text_buffer_status(&page, err));
    snprintf(file, sizeof file, "%s", weft_test_path("page.html"));
    snprintf(code, sizeof code, "%s", weft_test_path("page.py"));
    assert_ok(weft_file_write(file, page.text, page.n, err));
    assert_ok(weft_file_write(code, script, sizeof script - 1, err));
    snprintf(command, sizeof command, "python3 '%s' '%s'", code, file);
    assert_int_equal(system(command), 0);
    weft_text_buffer_fini(&page);
}

static weft_calibration good(void)
{
    weft_calibration cal;
    weft_calibration_init(&cal);
    snprintf(cal.created, sizeof cal.created, "2026-11-23T10:00:00Z");
    cal.has_camera = cal.has_lights = cal.has_linearity = cal.has_colour = true;
    cal.camera = (weft_camera){.width = 1232,
                               .height = 816,
                               .fx = 4800,
                               .fy = 4800,
                               .cx = 615.5,
                               .cy = 407.5,
                               .rms_px = 0.064,
                               .has_pose = true,
                               .rotation = {{1, 0, 0, 0, -1, 0, 0, 0, -1}},
                               .translation = {0, 0, 600}};
    cal.n_lights = 2;
    for (int l = 0; l < 2; l++)
        cal.lights[l] = (weft_light){.position = {l ? -150 : 150, 30, 200},
                                     .axis = {l ? 0.6 : -0.6, 0, -0.8},
                                     .exponent = 1,
                                     .intensity = {1, 1, 1},
                                     .white_balance = {1.7, 1, 1.2},
                                     .position_sigma_mm = 2,
                                     .residual = 0.0015};
    cal.linearity = (weft_linearity){{0.01, 0.9}, 0.02};
    cal.colour = (weft_colour_part){.model = {.matrix = {{1, 0, 0, 0, 1, 0, 0, 0, 1}}},
                                    .delta_e_mean = 0.95,
                                    .delta_e_max = 2.9,
                                    .delta_e_held_out_mean = 1.1};
    return cal;
}

static void report(weft_calibration *cal, const char *step, const char *json)
{
    assert_ok(weft_calibration_set_report(cal, step, json_loads(json, 0, NULL), err));
}

static void test_nothing_is_there(void **state)
{
    (void)state;
    weft_calibration cal;
    weft_verdict v;
    weft_calibration_init(&cal);
    weft_report_judge(&cal, &v);
    assert_grade(&v, "lens", "no camera", WEFT_GRADE_ABSENT);
    assert_grade(&v, "lights", "no lights", WEFT_GRADE_ABSENT);
    assert_grade(&v, "linearity", "Nobody", WEFT_GRADE_ABSENT);
    assert_grade(&v, "white", "not balanced", WEFT_GRADE_ABSENT);
    assert_grade(&v, "colour", "not turned", WEFT_GRADE_ABSENT);
    assert_int_equal(v.worst, WEFT_GRADE_ABSENT);
    check_page(&cal, "empty.cal", NULL);
    weft_calibration_fini(&cal);
}

static void test_what_is_good_needs_no_remedy(void **state)
{
    (void)state;
    weft_verdict v;
    weft_calibration cal = good();
    report(&cal, "lens",
           "{\"held_out_px\":0.065,\"coverage\":0.8,\"sigma\":{\"fx\":3.5},\"views\":[{\"image\":\"a\","
           "\"rms_px\":0.06,\"used\":true,\"corners\":[600,400,0.05,-0.02,610,400,0.01,0.04]}]}");
    report(&cal, "lights",
           "{\"settled\":true,\"reflectance\":0.99,\"rounds\":[{\"moved_mm\":40,\"rms\":0.002},"
           "{\"moved_mm\":0.05,\"rms\":0.0015}],\"lights\":[]}");
    report(&cal, "linearity",
           "{\"series\":{\"max_deviation\":0.001},\"greys\":[{\"reflectance\":0.9,\"deviation\":[0,0,"
           "0,0.01]},{\"reflectance\":0.05,\"deviation\":[0.01,0,0,0]}],\"noise\":[{\"gain_e_per_dn\":2,"
           "\"read_noise_e\":3,\"fixed_pattern\":0.003,\"black_dn\":256,\"saturation_dn\":null,"
           "\"level_dn\":[100,5000],\"variance_dn2\":[52,2501]}]}");
    report(&cal, "white", "{\"lights\":[{\"difference_from_sheet\":0.002}]}");
    weft_report_judge(&cal, &v);
    for (int i = 0; i < v.n; i++)
        assert_int_equal(v.findings[i].grade, WEFT_GRADE_GOOD);
    assert_true(v.n >= 9);
    check_page(&cal, "good.cal", NULL);
    char *text;
    size_t n_text;
    assert_ok(weft_file_read(weft_test_path("page.html"), 1 << 24, &text, &n_text, err));
    assert_non_null(strstr(text, "variance, DN^2"));
    assert_non_null(strstr(text, "The Munsell line"));
    weft_free(text);

    weft_white_sheet sheet;
    assert_ok(weft_white_sheet_init(&sheet, 1232, 816, 2, err));
    for (int i = 0; i < 6 * sheet.columns * sheet.rows; i++)
        sheet.value[i] = i % 7 ? 10 : NAN;
    check_page(&cal, "<b>bold</b> & \"quoted\".cal", &sheet);
    weft_white_sheet_fini(&sheet);
    weft_calibration_fini(&cal);
}

static void test_what_is_bad_is_named(void **state)
{
    (void)state;
    weft_verdict v;
    weft_calibration cal = good();
    cal.camera.rms_px = 0.7;
    cal.lights[1].residual = 0.02;
    cal.lights[0].position_sigma_mm = 12;
    cal.linearity.max_deviation = 0.2;
    cal.colour.delta_e_mean = 0.5;
    cal.colour.delta_e_held_out_mean = 5.4;
    report(&cal, "lens",
           "{\"held_out_px\":2.5,\"coverage\":0.3,\"sigma\":{\"fx\":90},\"board_bent\":true,\"board_bend_"
           "mm\":-0.8,\"model\":\"<b>bold\",\"tried\":[{\"model\":"
           "\"k1\",\"held_out_px\":0.1},3],\"views\":[{\"image\":\"<b>bold\","
           "\"rms_px\":9,\"used\":false,\"left_out\":\"blurred\"}]}");
    report(&cal, "lights",
           "{\"settled\":false,\"rounds\":[{},{}],\"sheet\":{\"bow_mm\":[1.5,0.1],\"bow_sigma_mm\":[0.1,0.1],"
           "\"tilt_rad\":[0.005,0],\"tilt_sigma_rad\":[0.001,0.001],\"bow_used\":true}}");
    report(&cal, "white", "{\"lights\":[{\"difference_from_sheet\":0.08}]}");
    report(&cal, "colour",
           "{\"chart\":\"macbeth\",\"edition\":\"ohta1997\",\"patches\":[{\"name\":\"dark skin\","
           "\"excluded\":\"too dark\"}]}");
    weft_report_judge(&cal, &v);
    assert_grade(&v, "lens", "0.700 px", WEFT_GRADE_REDO);
    assert_grade(&v, "lens", "2.500 px", WEFT_GRADE_REDO);
    assert_grade(&v, "lens", "30 %", WEFT_GRADE_REDO);
    assert_grade(&v, "lens", "1.875 %", WEFT_GRADE_REDO);
    assert_grade(&v, "lens", "left out: <b>bold", WEFT_GRADE_FAIR);
    assert_grade(&v, "lens", "bent by 0.80 mm", WEFT_GRADE_FAIR);
    assert_grade(&v, "lens", "<b>bold (blurred)", WEFT_GRADE_FAIR);
    assert_grade(&v, "lights", "had not settled", WEFT_GRADE_REDO);
    assert_grade(&v, "lights", "2.00 % at most (light 1)", WEFT_GRADE_REDO);
    assert_grade(&v, "lights", "light 0: +- 12.0 mm", WEFT_GRADE_FAIR);
    assert_grade(&v, "lights", "bowed by 1.50 mm", WEFT_GRADE_REDO);
    assert_grade(&v, "lights", "tilted by 0.29 degrees", WEFT_GRADE_FAIR);
    assert_grade(&v, "linearity", "20.0 %", WEFT_GRADE_REDO);
    assert_grade(&v, "linearity", "no exposure series", WEFT_GRADE_FAIR);
    assert_grade(&v, "white", "8.00 %", WEFT_GRADE_REDO);
    assert_grade(&v, "colour", "5.40 CIEDE2000", WEFT_GRADE_REDO);
    assert_grade(&v, "colour", "fits the patches", WEFT_GRADE_FAIR);
    assert_grade(&v, "colour", "dark skin (too dark)", WEFT_GRADE_FAIR);
    assert_int_equal(v.worst, WEFT_GRADE_REDO);
    check_page(&cal, "bad.cal", NULL);
    weft_calibration_fini(&cal);
}

/* Colour that is older than the lights it was divided by. */
static void test_what_is_stale_is_named(void **state)
{
    (void)state;
    weft_verdict v;
    weft_calibration cal = good();
    report(&cal, "lights", "{}");
    report(&cal, "colour", "{}");
    json_t *const colour = json_object_get(json_object_get(cal.other, "reports"), "colour");
    json_object_set_new(colour, "created", json_string("2020-01-01T00:00:00Z"));
    weft_report_judge(&cal, &v);
    assert_grade(&v, "colour", "stands on the lights", WEFT_GRADE_REDO);
    weft_calibration_fini(&cal);
}

static void test_reports_of_the_wrong_types(void **state)
{
    (void)state;
    weft_calibration cal = good();
    report(&cal, "lens", "{\"views\":7,\"sigma\":[],\"coverage\":\"much\",\"held_out_px\":null}");
    report(&cal, "lights", "{\"rounds\":[1,\"two\",null],\"lights\":{\"a\":1},\"settled\":3}");
    report(&cal, "linearity",
           "{\"greys\":[[],{\"deviation\":3}],\"series\":\"none\",\"noise\":[{\"level_dn\":[1,\"a\"],"
           "\"variance_dn2\":7},5]}");
    report(&cal, "colour", "{\"chart\":7,\"patches\":[1,2,3]}");
    check_page(&cal, "odd.cal", NULL);
    weft_calibration_fini(&cal);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_nothing_is_there),
        cmocka_unit_test(test_what_is_good_needs_no_remedy),
        cmocka_unit_test(test_what_is_bad_is_named),
        cmocka_unit_test(test_what_is_stale_is_named),
        cmocka_unit_test(test_reports_of_the_wrong_types),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
