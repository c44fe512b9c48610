/* The predicted noise of a layout against noise that goes through the solver. */
#include "tests/support/support.h"

#include "core/file.h"
#include "host/solve/layout.h"
#include "host/solve/samples.h"
#include "tests/host/dome.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { LANES = WEFT_SOLVE_LANES };

static const weft_layout_options plain = {
    .plate_mm = {154, 102}, .albedo = 0.5, .fill = 0.75, .full_well_e = 30000, .read_e = 3};

/* Samples of a surface by the formula of docs/formats.md, with photon and read noise, through the solver's
 * least squares: rms error of the normals in degrees. */
static double simulate(const weft_calibration *cal, const weft_layout_options *o, const double point[3],
                       const double normal[3], double exposure, int rounds, uint64_t *seed)
{
    weft_solve_samples s = {.n_lights = cal->n_lights, .n_channels = 1};
    weft_solve_answers a;
    double squares = 0;
    for (int r = 0; r < rounds; r++) {
        for (int j = 0; j < cal->n_lights; j++) {
            const weft_light *const light = &cal->lights[j];
            const double d[3] = {light->position.x - point[0], light->position.y - point[1],
                                 light->position.z - point[2]};
            const double length = sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
            const double facing[3] = {d[0] / length, d[1] / length, d[2] / length};
            const double full = exposure * dome_radiance(light, 1, point, facing, 1);
            const double x = exposure * dome_radiance(light, 1, point, normal, o->albedo);
            const double sigma = sqrt(pow(o->read_e / o->full_well_e, 2) + x / o->full_well_e);
            for (int k = 0; k < LANES; k++) {
                const double value = (x + sigma * weft_test_gauss(seed)) / full;
                for (int c = 0; c < 3; c++)
                    s.at[j].light[c][k] = (float)facing[c];
                s.at[j].grey[k] = s.at[j].value[0][k] = x > 0 ? (float)value : 0;
                s.at[j].weight[k] = x > 0 ? 1 : 0;
            }
        }
        weft_method_lsq.solve(&s, &a);
        for (int k = 0; k < LANES; k++) {
            const double n[3] = {a.normal[0][k], a.normal[1][k], a.normal[2][k]};
            assert_true(a.valid[k] > 0);
            squares += pow(dome_angle_deg(n, normal), 2);
        }
    }
    return sqrt(squares / (rounds * (double)LANES));
}

static void prediction_is_what_noise_does(void **state)
{
    (void)state;
    uint64_t seed = 11;
    weft_calibration cal;
    const char *const given = getenv("WEFT_LAYOUT_ROUNDS");
    const int rounds = given ? (int)strtol(given, NULL, 10) : 1500; /* 24000 normals: +- 0.5 % */
    static const double points[][3] = {{0, 0, 0}, {70, 45, 0}, {-75, 10, 0}, {20, -50, 0}};
    static const double normals[][3] = {{0, 0, 1}, {0.6, 0, 0.8}, {-0.3, 0.4, 0.8660254037844386}};
    dome_init(&cal, 1232, 816);
    const double exposure = weft_layout_exposure(&cal, &plain);
    assert_true(exposure > 0);
    for (size_t p = 0; p < 4; p++)
        for (size_t n = 0; n < 3; n++) {
            const weft_vec3 point = {points[p][0], points[p][1], 0};
            const weft_vec3 normal = {normals[n][0], normals[n][1], normals[n][2]};
            const double predicted =
                57.29577951308232 * weft_layout_sigma(&cal, &plain, exposure, point, normal, -1);
            const double found = simulate(&cal, &plain, points[p], normals[n], exposure, rounds, &seed);
            print_message(
                "at %+.0f,%+.0f leaning %.0f degrees: predicted %.4f, found %.4f degrees (%+.2f %%)\n",
                point.x, point.y, 57.3 * acos(normal.z), predicted, found, 100 * (found / predicted - 1));
            assert_near(found, predicted, 0.02 * predicted);
        }
    weft_calibration_fini(&cal);
}

static void the_plate_is_the_mean_of_its_points(void **state)
{
    (void)state;
    weft_calibration cal;
    weft_layout whole, dark;
    dome_init(&cal, 1232, 816);
    assert_ok(weft_layout_predict(&cal, &plain, &whole, err));
    assert_true(whole.undetermined == 0 && whole.middle < whole.max && whole.mean < whole.max);
    assert_near(whole.map.width / (double)whole.map.height, 154.0 / 102, 0.05);
    for (int j = 0; j < cal.n_lights; j++)
        assert_true(whole.without[j] > whole.mean); /* each light helps */
    weft_layout_options black = plain;
    black.albedo = 0.05;
    assert_ok(weft_layout_predict(&cal, &black, &dark, err));
    /* photon noise: sqrt(10) times, and somewhat more by the read noise */
    assert_true(dark.mean / whole.mean > sqrt(10) && dark.mean / whole.mean < 1.1 * sqrt(10));
    weft_layout_fini(&whole);
    weft_layout_fini(&dark);
    weft_calibration_fini(&cal);
}

static void write_table(const char *name, const char *text)
{
    assert_ok(weft_file_write(weft_test_path(name), text, strlen(text), err));
}

static void tables_are_read_and_refused(void **state)
{
    (void)state;
    weft_calibration cal;
    weft_layout layout;
    write_table("four.csv", "x_mm,y_mm,z_mm,power\n200,0,200,2\n-200,0,200,1\n0,200,200,1\n0,-200,200,1\n");
    assert_ok(weft_layout_read(weft_test_path("four.csv"), &cal, err));
    assert_int_equal(cal.n_lights, 4);
    assert_near(cal.lights[0].intensity[1], 2 * cal.lights[1].intensity[1], 1e-12);
    assert_near(cal.lights[1].axis.x, sqrt(0.5), 1e-12);
    /* four lights at 45 degrees: A = diag(1, 1, 2), so the two directions have 1 + 1 */
    assert_ok(weft_layout_predict(&cal, &plain, &layout, err));
    assert_near(layout.gain, sqrt(2), 1e-9);
    weft_layout_fini(&layout);
    write_table("plane.csv", "x_mm,y_mm,z_mm\n200,0,200\n-200,0,200\n0,0,300\n");
    assert_ok(weft_layout_read(weft_test_path("plane.csv"), &cal, err));
    weft_layout_options line = plain;
    line.plate_mm[1] = 1; /* so narrow that the three lie in a plane with all of it */
    assert_fails(weft_layout_predict(&cal, &line, &layout, err), WEFT_ERR_NODATA,
                 "do not determine a normal");
    write_table("low.csv", "x_mm,y_mm,z_mm\n200,0,200\n-200,0,-5\n0,0,300\n");
    assert_fails(weft_layout_read(weft_test_path("low.csv"), &cal, err), WEFT_ERR_RANGE, "row 2");
    write_table("none.csv", "x,y,z\n1,2,3\n1,2,3\n1,2,3\n");
    assert_fails(weft_layout_read(weft_test_path("none.csv"), &cal, err), WEFT_ERR_FORMAT, "no column x_mm");
    write_table("two.csv", "x_mm,y_mm,z_mm\n1,2,3\n1,2,3\n");
    assert_fails(weft_layout_read(weft_test_path("two.csv"), &cal, err), WEFT_ERR_RANGE, "has 2 lights");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(prediction_is_what_noise_does),
        cmocka_unit_test(the_plate_is_the_mean_of_its_points),
        cmocka_unit_test(tables_are_read_and_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
