/* The virtual scanner's geometry: lamps, camera, boards, scene files. */
#include "calibration/lens/lens_model.h"
#include "core/file.h"
#include "host/rig/sample.h"
#include "host/rig/scene.h"
#include "tests/support/support.h"

#include <math.h>
#include <string.h>

#define DEG 57.29577951308232

static weft_rig_scene scene;

static void make_scene(uint64_t seed)
{
    weft_rig_setup setup;
    weft_rig_setup_init(&setup);
    setup.seed = seed;
    assert_ok(weft_rig_scene_init(&scene, &setup, err));
}

static void lamps_stand_on_the_dome(void **state)
{
    (void)state;
    for (uint64_t seed = 1; seed <= 5; seed++) {
        make_scene(seed);
        for (int i = 0; i < WEFT_RIG_N_LIGHTS; i++) {
            const weft_light *const light = &scene.lights[i];
            const double wanted = i < 6 ? 35 : i < 9 ? 60 : 80;
            assert_near(weft_length(light->position), 300, 9);
            assert_near(DEG * asin(light->position.z / weft_length(light->position)), wanted, 2.5);
            assert_true(DEG * weft_angle_between(light->axis, weft_scale(light->position, -1)) <= 1.0001);
            assert_true(light->exponent >= 1 && light->exponent <= 1.4);
        }
    }
}

/* Seeds differ, and the same seed is the same scanner. */
static void seeds_repeat(void **state)
{
    (void)state;
    make_scene(7);
    const weft_vec3 first = scene.lights[3].position;
    const double fx = scene.camera.fx;
    make_scene(8);
    assert_true(weft_length(weft_sub(first, scene.lights[3].position)) > 0.01 && scene.camera.fx != fx);
    make_scene(7);
    assert_true(weft_length(weft_sub(first, scene.lights[3].position)) == 0 && scene.camera.fx == fx);
}

static void camera_sees_the_agreed_field(void **state)
{
    (void)state;
    for (uint64_t seed = 1; seed <= 5; seed++) {
        make_scene(seed);
        const weft_camera *const camera = &scene.camera;
        weft_vec3 left, right, top, bottom;
        assert_true(weft_camera_to_plane(camera, 0, 408, 0, &left) &&
                    weft_camera_to_plane(camera, 1231, 408, 0, &right));
        assert_true(weft_camera_to_plane(camera, 616, 0, 0, &top) &&
                    weft_camera_to_plane(camera, 616, 815, 0, &bottom));
        assert_near(right.x - left.x, 154, 3);
        assert_near(top.y - bottom.y, 102, 2);
        assert_near(weft_camera_centre(camera).z, 600, 6);
        double x, y;
        weft_lens_distort(camera->distortion, 615.0 / camera->fx, 407.0 / camera->fy, &x, &y);
        const double shift = hypot(x * camera->fx - 615, y * camera->fy - 407);
        assert_true(shift > 1 && shift < 8); /* a few pixels at the corner */
    }
}

static void other_sizes_see_the_same_field(void **state)
{
    (void)state;
    make_scene(1);
    weft_vec3 small, large;
    assert_true(weft_camera_to_plane(&scene.camera, -0.5, -0.5, 0, &small));
    weft_rig_setup setup = scene.setup;
    setup.size = (weft_size){4928, 3264};
    assert_ok(weft_rig_scene_init(&scene, &setup, err));
    assert_true(weft_camera_to_plane(&scene.camera, -0.5, -0.5, 0, &large));
    assert_near(small.x, large.x, 0.02);
    assert_near(small.y, large.y, 0.02);
}

/* All 15 boards are wholly in view, no part is under the table, and their corners cover the frame. */
static void boards_fill_the_frame(void **state)
{
    (void)state;
    for (uint64_t seed = 1; seed <= 6; seed++) {
        make_scene(seed);
        bool covered[6][4] = {{false}};
        double steepest = 0;
        for (int board = 0; board < WEFT_RIG_N_BOARDS; board++) {
            char name[16];
            static weft_rig_sample sample;
            snprintf(name, sizeof name, "board-%d", board);
            assert_ok(weft_rig_sample_init(&sample, &scene, name, err));
            const weft_rig_plate *const plate = &sample.plate;
            steepest = fmax(steepest, DEG * acos(plate->normal.z));
            for (int i = 0; i < 4; i++) {
                double u, v;
                const weft_vec3 corner =
                    weft_rig_plate_point(plate, i & 1 ? plate->half_width : -plate->half_width,
                                         i & 2 ? plate->half_height : -plate->half_height);
                assert_true(corner.z > 1 && corner.z < 130);
                assert_true(weft_camera_project(&scene.camera, corner, &u, &v));
                if (!(u > 1 && v > 1 && u < 1230 && v < 814))
                    fail_msg("seed %d, %s: a corner lies at (%.1f, %.1f)", (int)seed, name, u, v);
            }
            for (int i = 0; i < 9 * 6; i++) {
                double u, v;
                const weft_vec3 corner =
                    weft_rig_plate_point(plate, (i % 9 - 4) * 10.0, (i / 9 - 2.5) * 10.0);
                assert_true(weft_camera_project(&scene.camera, corner, &u, &v));
                covered[(int)(u / 1232 * 6)][(int)(v / 816 * 4)] = true;
            }
            weft_rig_sample_fini(&sample);
        }
        for (int i = 0; i < 24; i++)
            if (!covered[i % 6][i / 6])
                fail_msg("seed %d: no corner of any board in cell %d, %d", (int)seed, i % 6, i / 6);
        assert_true(steepest > 35 && steepest < 42);
    }
}

static void checker_has_inner_corners(void **state)
{
    (void)state;
    make_scene(1);
    static weft_rig_sample sample;
    assert_ok(weft_rig_sample_init(&sample, &scene, "board-table", err));
    assert_int_equal(weft_rig_plate_material(&sample.plate, -49, 34), 1); /* first square is dark */
    assert_int_equal(weft_rig_plate_material(&sample.plate, -39, 34), 2);
    assert_int_equal(weft_rig_plate_material(&sample.plate, 52, 0), 2); /* margin */
    assert_int_equal(weft_rig_plate_material(&sample.plate, 60, 0), 0); /* table */
    /* Around each of 9 x 6 inner corners the colours of the four squares alternate. */
    for (int i = 0; i < 9 * 6; i++) {
        const double x = (i % 9 - 4) * 10.0, y = (i / 9 - 2.5) * 10.0;
        const int a = weft_rig_plate_material(&sample.plate, x - 1, y - 1);
        const int b = weft_rig_plate_material(&sample.plate, x + 1, y - 1);
        assert_int_equal(a, weft_rig_plate_material(&sample.plate, x + 1, y + 1));
        assert_int_equal(b, weft_rig_plate_material(&sample.plate, x - 1, y + 1));
        assert_int_equal(a + b, 3);
    }
    assert_near(sample.plate.ax.x, 1, 0);
    weft_rig_sample_fini(&sample);
}

static void samples_are_named(void **state)
{
    (void)state;
    make_scene(1);
    static weft_rig_sample sample;
    char name[32], summary[128];
    int n = 0;
    while (weft_rig_sample_describe(n, name, summary))
        n++;
    assert_true(n >= 5 + WEFT_RIG_N_BOARDS + 5);
    assert_fails(weft_rig_sample_init(&sample, &scene, "twil", err), WEFT_ERR_USAGE,
                 "did you mean \"twill\"");
    assert_fails(weft_rig_sample_init(&sample, &scene, "board-15", err), WEFT_ERR_USAGE, "board-1");
}

static const char *write_scene(const char *text)
{
    const char *const path = weft_test_path("scene.json");
    assert_ok(weft_file_write(path, text, strlen(text), err));
    return path;
}

static void scene_file_overrides(void **state)
{
    (void)state;
    weft_rig_setup setup;
    weft_rig_setup_init(&setup);
    const char *const path = write_scene("{\"weft\":\"scene\",\"version\":1,\"seed\":5,\"noise\":false,"
                                         "\"light_jitter_mm\":0,\"aim_jitter_deg\":0,\"room_light\":0.01}");
    assert_ok(weft_rig_setup_load(path, &setup, err));
    assert_ok(weft_rig_scene_init(&scene, &setup, err));
    assert_near(weft_length(scene.lights[4].position), 300, 1e-9);
    assert_near(weft_angle_between(scene.lights[4].axis, weft_scale(scene.lights[4].position, -1)), 0, 1e-12);
    assert_true(!setup.noise && setup.seed == 5);
}

static void bad_scene_files_are_refused(void **state)
{
    (void)state;
    weft_rig_setup setup, before;
    memset(&setup, 0, sizeof setup);
    weft_rig_setup_init(&setup);
    before = setup;
    assert_fails(
        weft_rig_setup_load(write_scene("{\"weft\":\"scene\",\"version\":1,\"sead\":5}"), &setup, err),
        WEFT_ERR_FORMAT, "sead");
    assert_fails(weft_rig_setup_load(write_scene("{\"weft\":\"scene\",\"version\":9}"), &setup, err),
                 WEFT_ERR_VERSION, "scene.json");
    assert_fails(
        weft_rig_setup_load(write_scene("{\"weft\":\"scene\",\"version\":1,\"room_light\":7}"), &setup, err),
        WEFT_ERR_RANGE, "room_light");
    assert_fails(
        weft_rig_setup_load(write_scene("{\"weft\":\"scene\",\"version\":1,\"lights\":[]}"), &setup, err),
        WEFT_ERR_FORMAT, "10 lights");
    assert_fails(weft_rig_setup_load(write_scene("{\"weft\":\"scene\",\"version\":1,\"lights\":["
                                                 "{\"position_mm\":[0,0,-5]},1,1,1,1,1,1,1,1,1]}"),
                                     &setup, err),
                 WEFT_ERR_RANGE, "light 0");
    assert_memory_equal(&setup, &before, sizeof setup);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(lamps_stand_on_the_dome),
        cmocka_unit_test(seeds_repeat),
        cmocka_unit_test(camera_sees_the_agreed_field),
        cmocka_unit_test(other_sizes_see_the_same_field),
        cmocka_unit_test(boards_fill_the_frame),
        cmocka_unit_test(checker_has_inner_corners),
        cmocka_unit_test(samples_are_named),
        cmocka_unit_test(scene_file_overrides),
        cmocka_unit_test(bad_scene_files_are_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
