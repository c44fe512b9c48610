/* The lens model against OpenCV, and its inverse against itself. */
#include "tests/calibration/opencv_oracle.h"
#include "tests/support/support.h"

#include "calibration/lens/lens_model.h"

#define N 500

/* A camera 600 mm over the table, tilted and rolled; R is made from angles here, orthonormal to 1e-16. */
static weft_camera test_camera(const double distortion[WEFT_DISTORTION])
{
    const double a = 3.11, b = 0.03, c = 0.02; /* about x, y, z */
    const weft_mat3 x = {{1, 0, 0, 0, cos(a), -sin(a), 0, sin(a), cos(a)}},
                    y = {{cos(b), 0, sin(b), 0, 1, 0, -sin(b), 0, cos(b)}},
                    z = {{cos(c), -sin(c), 0, sin(c), cos(c), 0, 0, 0, 1}};
    weft_camera camera = {.width = 1232,
                          .height = 816,
                          .fx = 1210.5,
                          .fy = 1208.25,
                          .cx = 611,
                          .cy = 413.5,
                          .has_pose = true,
                          .translation = {12, -7, 604}};
    weft_mat3 xy = weft_mat3_multiply(&x, &y);
    camera.rotation = weft_mat3_multiply(&xy, &z);
    for (int i = 0; i < WEFT_DISTORTION; i++)
        camera.distortion[i] = distortion[i];
    return camera;
}

static const double lenses[][WEFT_DISTORTION] = {{0, 0, 0, 0, 0},
                                                 {-0.29, 0.10, 0, 0, 0},
                                                 {-0.2904, 0.1021, 0.0011, -0.0004, 0},
                                                 {0.08, -0.2, -0.002, 0.003, 0.15},
                                                 {0.9, 0.3, 1e-3, -5e-4, 0.02, 1.2, 0.5, 0.05}};
#define N_LENSES (int)(sizeof lenses / sizeof *lenses)

static void test_projection_is_opencvs(void **state)
{
    (void)state;
    uint64_t seed = 5;
    for (int l = 0; l < N_LENSES; l++) {
        const weft_camera camera = test_camera(lenses[l]);
        double world[N][3], wanted[N][2];
        const double translation[3] = {camera.translation.x, camera.translation.y, camera.translation.z};
        for (int i = 0; i < N; i++) {
            world[i][0] = 500 * weft_test_random(&seed) - 250;
            world[i][1] = 340 * weft_test_random(&seed) - 170;
            world[i][2] = 100 * weft_test_random(&seed) - 50;
        }
        assert_int_equal(oracle_project(camera.rotation.m, translation,
                                        (double[]){camera.fx, camera.fy, camera.cx, camera.cy},
                                        camera.distortion, N, *world, *wanted),
                         0);
        for (int i = 0; i < N; i++) {
            double u, v;
            assert_true(
                weft_camera_project(&camera, (weft_vec3){world[i][0], world[i][1], world[i][2]}, &u, &v));
            assert_near(u, wanted[i][0], 1e-8);
            assert_near(v, wanted[i][1], 1e-8);
        }
    }
}

static void test_undistortion_is_opencvs(void **state)
{
    (void)state;
    uint64_t seed = 6;
    for (int l = 0; l < N_LENSES; l++) {
        const weft_camera camera = test_camera(lenses[l]);
        double pixels[N][2], wanted[N][2];
        for (int i = 0; i < N; i++) {
            pixels[i][0] = camera.width * weft_test_random(&seed);
            pixels[i][1] = camera.height * weft_test_random(&seed);
        }
        assert_int_equal(oracle_undistort((double[]){camera.fx, camera.fy, camera.cx, camera.cy},
                                          camera.distortion, N, *pixels, *wanted),
                         0);
        for (int i = 0; i < N; i++) {
            double x, y;
            assert_true(weft_lens_undistort(camera.distortion, (pixels[i][0] - camera.cx) / camera.fx,
                                            (pixels[i][1] - camera.cy) / camera.fy, &x, &y));
            assert_near(x, wanted[i][0], 1e-9);
            assert_near(y, wanted[i][1], 1e-9);
        }
    }
}

static void test_ray_and_plane_go_back_to_the_pixel(void **state)
{
    (void)state;
    for (int l = 0; l < N_LENSES; l++) {
        const weft_camera camera = test_camera(lenses[l]);
        for (int v = 0; v < camera.height; v += 51)
            for (int u = 0; u < camera.width; u += 77) {
                weft_vec3 p;
                double u2, v2;
                assert_true(weft_camera_to_plane(&camera, u, v, 5, &p));
                assert_near(p.z, 5, 0);
                assert_true(weft_camera_project(&camera, p, &u2, &v2));
                assert_near(u2, u, 1e-9);
                assert_near(v2, v, 1e-9);
            }
    }
}

static void test_world_axes(void **state)
{
    (void)state;
    /* x right, y up in the image, z towards the camera: straight down means R = diag(1, -1, -1). */
    const weft_camera camera = {.fx = 1000,
                                .fy = 1000,
                                .cx = 500,
                                .cy = 400,
                                .has_pose = true,
                                .rotation = {{1, 0, 0, 0, -1, 0, 0, 0, -1}},
                                .translation = {0, 0, 600}};
    double u, v;
    assert_true(weft_camera_project(&camera, (weft_vec3){6, 3, 0}, &u, &v));
    assert_near(u, 510, 1e-12);
    assert_near(v, 395, 1e-12);
    assert_near(weft_camera_centre(&camera).z, 600, 1e-12);
    assert_false(weft_camera_project(&camera, (weft_vec3){0, 0, 601}, &u, &v)); /* behind */
    weft_vec3 p;
    assert_false(weft_camera_to_plane(&camera, 500, 400, 601, &p));
}

static void test_folded_lens_has_no_inverse(void **state)
{
    (void)state;
    /* k1 = -0.5: the distorted radius has its maximum 0.5443 at r = 0.8165. */
    const double fold[WEFT_DISTORTION] = {-0.5, 0, 0, 0, 0};
    double x, y;
    assert_true(weft_lens_undistort(fold, 0.54, 0, &x, &y));
    assert_true(x < 0.8165);
    assert_near(x - 0.5 * x * x * x, 0.54, 1e-12);
    assert_false(weft_lens_undistort(fold, 0.56, 0, &x, &y));
    assert_false(weft_lens_undistort(fold, 0, 4, &x, &y));
    assert_false(weft_lens_undistort(fold, NAN, 0, &x, &y));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_projection_is_opencvs),
        cmocka_unit_test(test_undistortion_is_opencvs),
        cmocka_unit_test(test_ray_and_plane_go_back_to_the_pixel),
        cmocka_unit_test(test_world_axes),
        cmocka_unit_test(test_folded_lens_has_no_inverse),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
