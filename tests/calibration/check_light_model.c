/* What a light does at a point, against values worked out by hand, and the grid between its nodes. */
#include "tests/support/support.h"

#include "calibration/lights/light_model.h"

static void test_near_light(void **state)
{
    (void)state;
    /* 0.5 m from the point at 3-4-5; the lamp points straight down, 4/5 = cos of the angle off its axis. */
    const weft_light light = {.position = {300, 0, 400}, .axis = {0, 0, -1}, .exponent = 2};
    weft_vec3 to_light;
    assert_near(weft_light_at(&light, (weft_vec3){0, 0, 0}, &to_light), 0.8 * 0.8 / 0.25, 1e-12);
    assert_near(to_light.x, 0.6, 1e-15);
    assert_near(to_light.z, 0.8, 1e-15);
    assert_near(weft_light_at(&light, (weft_vec3){300, 0, 0}, &to_light), 1 / 0.16, 1e-12);
    assert_near(weft_light_at(&light, (weft_vec3){300, 0, 500}, &to_light), 0, 0); /* behind the lamp */
    assert_near(weft_light_at(&light, light.position, &to_light), 0, 0);
}

static void test_distant_light(void **state)
{
    (void)state;
    const weft_light light = {.distant = true, .direction = {0, 0.6, 0.8}};
    weft_vec3 to_light;
    assert_near(weft_light_at(&light, (weft_vec3){50, -20, 3}, &to_light), 1, 0);
    assert_near(to_light.y, 0.6, 0);
}

static void test_grid_is_bilinear_between_its_nodes(void **state)
{
    (void)state;
    float gain[2 * 3 * 2 * 3]; /* [light][channel][row][column] */
    for (int i = 0; i < 36; i++)
        gain[i] = (float)i;
    const weft_calibration cal = {.camera = {.width = 101, .height = 51}, .grid = {3, 2, gain}};
    assert_near(weft_light_grid_gain(&cal, 0, 0, 0, 0), 0, 0);
    assert_near(weft_light_grid_gain(&cal, 1, 2, 0, 0), 30, 0);
    assert_near(weft_light_grid_gain(&cal, 1, 2, 100, 50), 35, 1e-12);
    assert_near(weft_light_grid_gain(&cal, 1, 2, 75, 25), 33, 1e-12); /* halfway: 31 32 34 35 */
    assert_near(weft_light_grid_gain(&cal, 1, 2, 50, 50), 34, 1e-12);
    assert_near(weft_light_grid_gain(&cal, 1, 2, -9, 80), 33, 1e-12); /* outside: the edge */
    const weft_calibration bare = {.camera = {.width = 101, .height = 51}};
    assert_near(weft_light_grid_gain(&bare, 0, 0, 3, 3), 1, 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_near_light),
        cmocka_unit_test(test_distant_light),
        cmocka_unit_test(test_grid_is_bilinear_between_its_nodes),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
