/* NAME.cal/ written, read and refused. */
#include "tests/support/support.h"

#include "calibration/calibration.h"
#include "calibration/calibration_grid.h"
#include "core/file.h"
#include "core/json.h"
#include "core/mem.h"

#include <math.h>
#include <string.h>

static weft_calibration whole_calibration(void)
{
    weft_calibration cal = {
        .created = "2026-11-23T10:00:00Z",
        .has_camera = true,
        .has_linearity = true,
        .has_lights = true,
        .has_colour = true,
        .camera = {1232,
                   816,
                   4801.25,
                   4799.5,
                   615.125,
                   407.75,
                   {-0.0613, 0.11, 3e-4, -2e-4, 0},
                   0.04,
                   true,
                   {{0.6, 0.8, 0, 0.8, -0.6, 0, 0, 0, -1}},
                   {1.5, -2.25, 600.0 + 1.0 / 3}},
        .linearity = {{0.01, 0.92}, 0.004},
        .n_lights = 2,
        .colour = {.model.matrix = {{1.6, -0.5, -0.1, -0.2, 1.5, -0.3, 0, -0.6, 1.6}},
                   .delta_e_mean = 1.2,
                   .delta_e_max = 3.4,
                   .delta_e_held_out_mean = 1.5,
                   .n_gamut = 2,
                   .gamut = {{0.1, 0.2, 0.3}, {0.9, 0.8, 0.7}}},
    };
    cal.lights[0] = (weft_light){.position = {200, 30, 180},
                                 .axis = {-0.6, 0, -0.8},
                                 .exponent = 1.25,
                                 .intensity = {0.7, 1.1, 0.9},
                                 .white_balance = {1.7, 1, 1.4},
                                 .position_sigma_mm = 0.2,
                                 .residual = 0.001};
    cal.lights[1] = (weft_light){
        .distant = true, .direction = {0, 0.6, 0.8}, .intensity = {1, 1, 1}, .white_balance = {1, 1, 1}};
    return cal;
}

static void add_grid(weft_calibration *cal, float first)
{
    cal->grid.columns = 5;
    cal->grid.rows = 3;
    const size_t n = weft_calibration_grid_size(cal);
    cal->grid.gain = weft_alloc(n, sizeof *cal->grid.gain, NULL);
    for (size_t i = 0; i < n; i++)
        cal->grid.gain[i] = first + (float)i / 64;
}

static void test_round_trip_is_exact(void **state)
{
    (void)state;
    const char *const folder = weft_test_path("exact.cal");
    weft_calibration cal = whole_calibration(), back;
    add_grid(&cal, 0.875F);
    cal.other = json_pack("{s:{s:[i,i]}, s:s}", "reports", "lens", 1, 2, "owner", "the lab");
    assert_ok(weft_calibration_save(folder, &cal, err));
    assert_ok(weft_calibration_load(folder, &back, err));
    assert_string_equal(back.created, cal.created);
    assert_memory_equal(&back.camera, &cal.camera, sizeof cal.camera);
    assert_memory_equal(&back.linearity, &cal.linearity, sizeof cal.linearity);
    assert_memory_equal(&back.colour, &cal.colour, sizeof cal.colour);
    assert_int_equal(back.n_lights, 2);
    assert_near(back.lights[0].position.y, 30, 0);
    assert_near(back.lights[0].axis.z, -0.8, 1e-15);
    assert_near(back.lights[0].exponent, 1.25, 0);
    assert_near(back.lights[0].intensity[1], 1.1, 0);
    assert_near(back.lights[0].white_balance[2], 1.4, 0);
    assert_near(back.lights[0].position_sigma_mm, 0.2, 0);
    assert_true(back.lights[1].distant);
    assert_near(back.lights[1].direction.y, 0.6, 1e-15);
    assert_memory_equal(back.grid.gain, cal.grid.gain, weft_calibration_grid_size(&cal) * sizeof(float));
    assert_true(json_equal(back.other, cal.other));
    weft_calibration_fini(&cal);
    weft_calibration_fini(&back);
}

/* A matrix alone is written as version 1, which older programs read; what they would not apply is version 2.
 */
static void test_colour_models_come_back(void **state)
{
    (void)state;
    char path[300], folder[256];
    snprintf(folder, sizeof folder, "%s", weft_test_path("models.cal"));
    snprintf(path, sizeof path, "%s/calibration.json", folder);
    for (int method = 0; method < WEFT_COLOUR_METHODS; method++) {
        weft_calibration cal = whole_calibration(), back;
        json_t *root;
        int version = 0;
        weft_colour_model *const model = &cal.colour.model;
        model->method = (weft_colour_method)method;
        for (int i = 0; i < 18 && method == WEFT_COLOUR_ROOT_POLYNOMIAL; i++)
            model->root[i / 6][i % 6] = 1.0 / (i + 3);
        for (int i = 0; i < 12 && method == WEFT_COLOUR_SEQUENCE; i++) {
            model->sequence.first[i / 4][i % 4] = 1.0 / (i + 7);
            model->sequence.cubic[i / 4][i % 4] = -1.0 / (i + 11);
            model->sequence.second[i / 4][i % 4] = 2.0 / (i + 13);
            model->sequence.range[i / 4][1] = 1;
            model->sequence.has_cubic = true;
        }
        assert_ok(weft_calibration_save(folder, &cal, err));
        assert_ok(weft_json_load(path, &root, err));
        assert_ok(weft_json_get_int(root, "version", WEFT_JSON_REQUIRED, 0, 9, &version, path, err));
        assert_int_equal(version, method == WEFT_COLOUR_MATRIX ? 1 : 2);
        json_decref(root);
        assert_ok(weft_calibration_load(folder, &back, err));
        assert_memory_equal(&back.colour, &cal.colour, sizeof cal.colour);
        weft_calibration_fini(&back);
        weft_calibration_fini(&cal);
    }
}

static void test_parts_may_be_absent(void **state)
{
    (void)state;
    const char *const folder = weft_test_path("bare.cal");
    weft_calibration cal = {0}, back;
    assert_ok(weft_calibration_save(folder, &cal, err));
    assert_ok(weft_calibration_load(folder, &back, err));
    assert_false(back.has_camera || back.has_lights || back.has_colour || back.has_linearity);
    assert_true(back.created[0]); /* dated by the first save */
    assert_fails(weft_calibration_require(&back, WEFT_CALIBRATION_CAMERA, "my.cal", err), WEFT_ERR_MISSING,
                 "my.cal: has no camera; make it with \"weft calibrate lens ... -o my.cal\"");
    assert_fails(weft_calibration_require(&back, WEFT_CALIBRATION_LIGHTS, "my.cal", err), WEFT_ERR_MISSING,
                 "weft calibrate lights");
    back.has_camera = true;
    back.camera.width = 1232;
    back.camera.height = 816;
    assert_ok(weft_calibration_require(&back, WEFT_CALIBRATION_CAMERA, "my.cal", err));
    assert_fails(
        weft_calibration_require(&back, WEFT_CALIBRATION_CAMERA | WEFT_CALIBRATION_POSE, "my.cal", err),
        WEFT_ERR_MISSING, "--board-on-table");
    assert_ok(weft_calibration_require_size(&back, 1232, 816, "my.cal", err));
    assert_fails(weft_calibration_require_size(&back, 616, 408, "my.cal", err), WEFT_ERR_MISMATCH,
                 "1232x816, these are 616x408");
    weft_calibration_fini(&back);
}

static void test_replacing_a_grid_leaves_one_file(void **state)
{
    (void)state;
    const char *const folder = weft_test_path("twice.cal");
    const char *const first = weft_test_path("twice.cal/light-grid.exr");
    const char *const second = weft_test_path("twice.cal/light-grid-b.exr");
    weft_calibration cal = whole_calibration(), back;
    add_grid(&cal, 1);
    assert_ok(weft_calibration_save(folder, &cal, err));
    assert_ok(weft_calibration_save(folder, &cal, err)); /* unchanged: stays where it is */
    assert_true(weft_file_exists(first) && !weft_file_exists(second));
    cal.grid.gain[7] = 3;
    assert_ok(weft_calibration_save(folder, &cal, err));
    assert_true(!weft_file_exists(first) && weft_file_exists(second));
    assert_ok(weft_calibration_load(folder, &back, err));
    assert_near((double)back.grid.gain[7], 3, 0);
    weft_calibration_fini(&back);
    weft_free(cal.grid.gain);
    cal.grid = (weft_light_grid){0};
    assert_ok(weft_calibration_save(folder, &cal, err));
    assert_true(!weft_file_exists(first) && !weft_file_exists(second));
    weft_calibration_fini(&cal);
}

static void test_numbers_that_are_none_are_not_written(void **state)
{
    (void)state;
    const char *const folder = weft_test_path("nan.cal");
    weft_calibration cal = whole_calibration();
    assert_ok(weft_calibration_save(folder, &cal, err));
    cal.camera.fx = NAN;
    assert_fails(weft_calibration_save(folder, &cal, err), WEFT_ERR_RANGE, "not written");
    cal = whole_calibration();
    cal.lights[0].position.z = INFINITY;
    assert_fails(weft_calibration_save(folder, &cal, err), WEFT_ERR_FORMAT, "not written");
    cal = whole_calibration();
    add_grid(&cal, 1);
    cal.grid.gain[3] = -1;
    assert_fails(weft_calibration_save(folder, &cal, err), WEFT_ERR_RANGE, "weft calibrate lights");
    weft_calibration_fini(&cal);
    assert_ok(weft_calibration_load(folder, &cal, err)); /* the first one stands */
    assert_near(cal.camera.fx, 4801.25, 0);
    weft_calibration_fini(&cal);
}

/* Each row is a calibration.json that must be refused with these words. */
static const struct {
    const char *text;
    weft_err code;
    const char *words;
} refused[] = {
    {"{\"weft\":\"calibration\",\"version\":3}", WEFT_ERR_VERSION, "update Weft"},
    {"{\"weft\":\"calibration\",\"version\":2,\"colour\":{\"to_linear_srgb\":[1,0,0,0,1,0,0,0,1],"
     "\"method\":\"neural\"}}",
     WEFT_ERR_UNSUPPORTED, "does not know the method \"neural\""},
    {"{\"weft\":\"calibration\",\"version\":2,\"colour\":{\"to_linear_srgb\":[1,0,0,0,1,0,0,0,1],"
     "\"method\":\"root-polynomial\",\"root_polynomial\":[1,2]}}",
     WEFT_ERR_FORMAT, "root_polynomial"},
    {"{\"weft\":\"calibration\",\"version\":2,\"colour\":{\"to_linear_srgb\":[1,0,0,0,1,0,0,0,1],"
     "\"method\":\"sequence\"}}",
     WEFT_ERR_FORMAT, "sequence"},
    {"{\"weft\":\"calibration\",\"version\":2,\"colour\":{\"to_linear_srgb\":[1,0,0,0,1,0,0,0,1],"
     "\"gamut\":[1,2]}}",
     WEFT_ERR_RANGE, "3 a colour"},
    {"{\"weft\":\"set\",\"version\":1}", WEFT_ERR_FORMAT, "wanted a \"calibration\""},
    {"{\"weft\":\"calibration\",\"version\":1", WEFT_ERR_FORMAT, "not JSON"},
    {"\xff\xfe", WEFT_ERR_FORMAT, "calibration.json"},
    {"{\"weft\":\"calibration\",\"version\":1,\"camera\":{\"width\":10}}", WEFT_ERR_FORMAT,
     "\"height\" is missing"},
    {"{\"weft\":\"calibration\",\"version\":1,\"camera\":{\"width\":10,\"height\":99999999,\"fx\":1}}",
     WEFT_ERR_RANGE, "height"},
    {"{\"weft\":\"calibration\",\"version\":1,\"camera\":{\"width\":10,\"height\":10,\"fx\":NaN}}",
     WEFT_ERR_FORMAT, "not JSON"},
    {"{\"weft\":\"calibration\",\"version\":1,\"camera\":{\"width\":10,\"height\":10,\"fx\":9,\"fy\":9,"
     "\"cx\":5,"
     "\"cy\":5,\"rotation\":[1,0,0,0,1,0,0,0,2],\"translation_mm\":[0,0,600]}}",
     WEFT_ERR_RANGE, "not a rotation"},
    {"{\"weft\":\"calibration\",\"version\":1,\"camera\":{\"width\":10,\"height\":10,\"fx\":9,\"fy\":9,"
     "\"cx\":5,"
     "\"cy\":5,\"rotation\":[1,0,0,0,1,0,0,0,-1],\"translation_mm\":[0,0,600]}}",
     WEFT_ERR_RANGE, "not a rotation"}, /* a mirror */
    {"{\"weft\":\"calibration\",\"version\":1,\"lights\":[]}", WEFT_ERR_RANGE, "0 lights"},
    {"{\"weft\":\"calibration\",\"version\":1,\"lights\":[7]}", WEFT_ERR_FORMAT, "light 0"},
    {"{\"weft\":\"calibration\",\"version\":1,\"lights\":[{\"position_mm\":[0,0]}]}", WEFT_ERR_FORMAT,
     "\"position_mm\" has 2 numbers"},
    {"{\"weft\":\"calibration\",\"version\":1,\"lights\":[{\"direction\":[0,0,7]}]}", WEFT_ERR_RANGE,
     "wanted a unit vector"},
    {"{\"weft\":\"calibration\",\"version\":1,\"lights\":[{\"direction\":[0,0,1],\"intensity\":[1,0,1]}]}",
     WEFT_ERR_RANGE, "above 0"},
    {"{\"weft\":\"calibration\",\"version\":1,\"light_grid\":{\"file\":\"g.exr\",\"columns\":4,\"rows\":4}}",
     WEFT_ERR_FORMAT, "without the camera"},
    {"{\"weft\":\"calibration\",\"version\":1,\"light_grid\":{\"file\":\"../"
     "g.exr\",\"columns\":4,\"rows\":4}}",
     WEFT_ERR_FORMAT, "same folder"},
    {"{\"weft\":\"calibration\",\"version\":1,\"linearity\":{\"range\":[0,1],\"curve\":[1,2]}}",
     WEFT_ERR_UNSUPPORTED, "curve"},
    {"{\"weft\":\"calibration\",\"version\":1,\"colour\":{\"to_linear_srgb\":[0,0,0,0,0,0,0,0,0]}}",
     WEFT_ERR_RANGE, "singular"},
};

static void test_bad_files_are_refused_by_name(void **state)
{
    (void)state;
    const char *const folder = weft_test_path("bad.cal");
    const char *const path = weft_test_path("bad.cal/calibration.json");
    weft_calibration cal = {.n_lights = 77};
    assert_fails(weft_calibration_load(weft_test_path("none.cal"), &cal, err), WEFT_ERR_IO,
                 "weft calibrate lens");
    assert_ok(weft_folder_create(folder, err));
    for (size_t i = 0; i < sizeof refused / sizeof *refused; i++) {
        assert_ok(weft_file_write(path, refused[i].text, strlen(refused[i].text), err));
        assert_fails(weft_calibration_load(folder, &cal, err), refused[i].code, refused[i].words);
    }
    assert_int_equal(cal.n_lights, 77); /* untouched by failures */
}

static void test_a_grid_that_does_not_fit_is_refused(void **state)
{
    (void)state;
    const char *const folder = weft_test_path("misfit.cal");
    const char *const grid = weft_test_path("misfit.cal/light-grid.exr");
    weft_calibration cal = whole_calibration(), back;
    add_grid(&cal, 1);
    assert_ok(weft_calibration_save(folder, &cal, err));
    assert_ok(weft_file_write(grid, "v/1\x01 cut", 8, err));
    assert_fails(weft_calibration_load(folder, &back, err), WEFT_ERR_FORMAT, "light-grid.exr");
    cal.grid.rows = 2;
    assert_ok(weft_calibration_grid_save(grid, &cal, err));
    assert_fails(weft_calibration_load(folder, &back, err), WEFT_ERR_MISMATCH,
                 "5x2, but calibration.json says 5x3");
    cal.n_lights = 1;
    assert_ok(weft_calibration_grid_save(grid, &cal, err));
    assert_fails(weft_calibration_load(folder, &back, err), WEFT_ERR_MISSING, "light01.R");
    weft_calibration_fini(&cal);
}

/* Every allocation of a load and of a save fails in turn: one error, nothing leaked, nothing half done. */
static void test_running_out_of_memory(void **state)
{
    (void)state;
    const char *const folder = weft_test_path("oom.cal");
    weft_calibration cal = whole_calibration(), back;
    weft_error error;
    add_grid(&cal, 1);
    assert_ok(weft_calibration_save(folder, &cal, err));
    long n = 0;
    for (weft_err status = WEFT_ERR_NOMEM; status != WEFT_OK; n++) {
        error = (weft_error){0};
        weft_mem_fail_after(n);
        status = weft_calibration_load(folder, &back, &error);
        weft_mem_fail_after(-1);
        assert_true(status == WEFT_OK || (status == WEFT_ERR_NOMEM && error.text[0]));
    }
    assert_true(n > 3);
    weft_calibration_fini(&back);
    n = 0;
    for (weft_err status = WEFT_ERR_NOMEM; status != WEFT_OK; n++) {
        cal.grid.gain[0] += 1; /* so that there is a grid to write */
        weft_mem_fail_after(n);
        status = weft_calibration_save(folder, &cal, &error);
        weft_mem_fail_after(-1);
        assert_ok(weft_calibration_load(folder, &back, err)); /* the old or the new one */
        weft_calibration_fini(&back);
        assert_true(n < 200);
    }
    weft_calibration_fini(&cal);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_round_trip_is_exact),
        cmocka_unit_test(test_colour_models_come_back),
        cmocka_unit_test(test_parts_may_be_absent),
        cmocka_unit_test(test_replacing_a_grid_leaves_one_file),
        cmocka_unit_test(test_numbers_that_are_none_are_not_written),
        cmocka_unit_test(test_bad_files_are_refused_by_name),
        cmocka_unit_test(test_a_grid_that_does_not_fit_is_refused),
        cmocka_unit_test(test_running_out_of_memory),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
