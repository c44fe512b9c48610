/* Reports survive a save, replace their former selves and leave foreign keys alone. */
#include "tests/support/support.h"

#include "calibration/calibration_report.h"
#include "core/file.h"

#include <string.h>

static void test_reports_come_back(void **state)
{
    (void)state;
    const char *const folder = weft_test_path("report.cal");
    weft_calibration cal;
    assert_ok(weft_calibration_open(folder, &cal, err)); /* nothing there: an empty one */
    assert_null(weft_calibration_get_report(&cal, "lens"));
    cal.other = json_pack("{s:s}", "owner", "somebody else");
    assert_ok(weft_calibration_set_report(&cal, "lens", json_pack("{s:f}", "rms_px", 0.5), err));
    assert_ok(weft_calibration_set_report(&cal, "lens", json_pack("{s:f}", "rms_px", 0.2), err));
    assert_ok(weft_calibration_set_report(&cal, "colour", json_pack("{s:s}", "chart", "macbeth"), err));
    assert_fails(weft_calibration_set_report(&cal, "white", NULL, err), WEFT_ERR_NOMEM, "white");
    assert_ok(weft_calibration_save(folder, &cal, err));
    weft_calibration_fini(&cal);

    assert_ok(weft_calibration_open(folder, &cal, err));
    const json_t *const lens = weft_calibration_get_report(&cal, "lens");
    assert_true(json_real_value(json_object_get(lens, "rms_px")) == 0.2);
    assert_int_equal(strncmp(json_string_value(json_object_get(lens, "software")), "weft ", 5), 0);
    assert_non_null(json_string_value(json_object_get(lens, "created")));
    assert_non_null(weft_calibration_get_report(&cal, "colour"));
    assert_null(weft_calibration_get_report(&cal, "white"));
    assert_string_equal(json_string_value(json_object_get(cal.other, "owner")), "somebody else");
    weft_calibration_fini(&cal);
}

static void test_a_damaged_calibration_is_not_replaced(void **state)
{
    (void)state;
    const char *const folder = weft_test_path("damaged.cal");
    weft_calibration cal;
    assert_ok(weft_folder_create(folder, err));
    assert_ok(weft_file_write(weft_test_path("damaged.cal/calibration.json"), "{", 1, err));
    assert_fails(weft_calibration_open(folder, &cal, err), WEFT_ERR_FORMAT, "calibration.json");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_reports_come_back),
        cmocka_unit_test(test_a_damaged_calibration_is_not_replaced),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
