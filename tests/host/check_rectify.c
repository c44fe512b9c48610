/* Resampling to the sample plane: against patterns that are known at every point of the world. */
#include "tests/support/support.h"

#include "core/parallel.h"
#include "host/solve/rectify.h"
#include "tests/host/dome.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { WIDTH = 400, HEIGHT = 264 };

static const double pi = 3.14159265358979323846;

/* Waves of slope 0.36 (20 degrees) in both directions with a period in mm, and an albedo to match. */
static void pattern(const double point[3], double period_mm, double normal[3], double albedo[3])
{
    const double p = 0.36 * sin(2 * pi * point[0] / period_mm), q = 0.36 * cos(2 * pi * point[1] / period_mm);
    const double length = sqrt(p * p + q * q + 1);
    normal[0] = -p / length;
    normal[1] = -q / length;
    normal[2] = 1 / length;
    for (int c = 0; c < 3; c++)
        albedo[c] = 0.3 + 0.1 * c + 0.1 * sin(2 * pi * (point[0] + point[1]) / period_mm);
}

static void make(weft_maps *m, int width, int height, weft_geometry geometry)
{
    *m = (weft_maps){.width = width, .height = height, .geometry = geometry};
    assert_ok(weft_image_init(&m->normal, width, height, 3, err));
    assert_ok(weft_image_init(&m->albedo, width, height, 3, err));
    assert_ok(weft_image_init(&m->residual, width, height, 1, err));
    assert_ok(weft_image_init(&m->confidence, width, height, 1, err));
    assert_ok(weft_mask_init(&m->mask, width, height, 255, err));
}

static void draw(weft_maps *m, const weft_camera *camera, double period_mm, double height_mm)
{
    for (int v = 0; v < m->height; v++)
        for (int u = 0; u < m->width; u++) {
            double point[3], normal[3], albedo[3];
            dome_point(camera, u, v, height_mm, point);
            pattern(point, period_mm, normal, albedo);
            for (int c = 0; c < 3; c++) {
                weft_image_row(&m->normal, c, v)[u] = (float)normal[c];
                weft_image_row(&m->albedo, c, v)[u] = (float)albedo[c];
            }
            weft_image_row(&m->residual, 0, v)[u] = 0.02F;
            weft_image_row(&m->confidence, 0, v)[u] = 0.9F;
        }
}

typedef struct figures {
    double mean_deg, max_deg, mean_albedo;
    int n;
} figures;

/* Whether the kernel of a pixel lies in the picture: its neighbours 5 pixels away have answers. */
static bool deep_inside(const weft_maps *plane, int i, int j)
{
    if (i < 5 || j < 5 || i + 5 >= plane->width || j + 5 >= plane->height)
        return false;
    for (int k = 0; k < 9; k++)
        if (!plane->mask.data[(j + 5 * (k / 3 - 1)) * plane->width + i + 5 * (k % 3 - 1)])
            return false;
    return true;
}

static figures measure(const weft_maps *plane, double period_mm)
{
    figures f = {0};
    for (int j = 0; j < plane->height; j++)
        for (int i = 0; i < plane->width; i++) {
            if (!deep_inside(plane, i, j))
                continue;
            const double point[3] = {plane->origin_mm[0] + i * plane->mm_per_px,
                                     plane->origin_mm[1] - j * plane->mm_per_px, 0};
            double normal[3], albedo[3], found[3];
            pattern(point, period_mm, normal, albedo);
            for (int c = 0; c < 3; c++) {
                found[c] = weft_image_row(&plane->normal, c, j)[i];
                f.mean_albedo += fabs((double)weft_image_row(&plane->albedo, c, j)[i] - albedo[c]) / 3;
            }
            const double e = dome_angle_deg(found, normal);
            f.mean_deg += e;
            f.max_deg = fmax(f.max_deg, e);
            f.n++;
        }
    f.mean_deg /= f.n;
    f.mean_albedo /= f.n;
    return f;
}

static figures round_trip(double period_px, double mm_per_px, double height_mm)
{
    weft_calibration cal;
    weft_maps sensor, plane = {0};
    weft_plane_grid grid;
    dome_init(&cal, WIDTH, HEIGHT);
    const double period_mm = period_px * 154.0 / WIDTH;
    make(&sensor, WIDTH, HEIGHT, WEFT_GEOMETRY_SENSOR);
    draw(&sensor, &cal.camera, period_mm, height_mm);
    assert_ok(weft_plane_grid_init(&grid, &cal.camera, mm_per_px, height_mm, err));
    assert_ok(weft_rectify(&sensor, &cal.camera, (weft_pixel_scale){1, 0}, &grid, &plane, err));
    const figures f = measure(&plane, period_mm);
    print_message("period %4.1f px, %.3f mm/px, height %g: mean %.3f max %.3f degrees, albedo %.5f, %d px\n",
                  period_px, mm_per_px, height_mm, f.mean_deg, f.max_deg, f.mean_albedo, f.n);
    weft_maps_fini(&sensor);
    weft_maps_fini(&plane);
    return f;
}

static void test_waves_keep_their_slope(void **state)
{
    (void)state;
    const figures slow = round_trip(20, 0.385, 0), weave = round_trip(6, 0.385, 0),
                  fine = round_trip(4, 0.385, 0), lifted = round_trip(6, 0.385, 4);
    assert_true(slow.mean_deg < 0.1 && slow.max_deg < 0.2 && slow.mean_albedo < 5e-4);
    assert_true(weave.mean_deg < 0.25 && weave.max_deg < 0.8);
    assert_true(fine.mean_deg < 0.25);
    assert_true(lifted.mean_deg < 0.25);
    assert_true(slow.n > 0.9 * WIDTH * HEIGHT);
}

/* A grid half as fine as the sensor must average, not skip: waves it cannot hold become flat. */
static void test_coarser_grid_averages(void **state)
{
    (void)state;
    const figures slow = round_trip(40, 4 * 0.385, 0);
    assert_true(slow.mean_deg < 1.0);
    weft_calibration cal;
    weft_maps sensor, plane = {0};
    weft_plane_grid grid;
    dome_init(&cal, WIDTH, HEIGHT);
    make(&sensor, WIDTH, HEIGHT, WEFT_GEOMETRY_SENSOR);
    draw(&sensor, &cal.camera, 4 * 154.0 / WIDTH, 0);
    assert_ok(weft_plane_grid_init(&grid, &cal.camera, 4 * 0.385, 0, err));
    assert_ok(weft_rectify(&sensor, &cal.camera, (weft_pixel_scale){1, 0}, &grid, &plane, err));
    for (int j = 0; j < plane.height; j++)
        for (int i = 0; i < plane.width; i++)
            assert_true(!deep_inside(&plane, i, j) ||
                        weft_image_row(&plane.normal, 2, j)[i] > 0.998F); /* 3.6 degrees */
    weft_maps_fini(&sensor);
    weft_maps_fini(&plane);
}

static void test_grid_is_symmetric_and_holds_the_view(void **state)
{
    (void)state;
    weft_calibration cal;
    weft_plane_grid grid;
    double scale;
    dome_init(&cal, 1232, 816);
    assert_ok(weft_plane_scale(&cal.camera, (weft_pixel_scale){1, 0}, 0, &scale, err));
    assert_near(scale, 0.125, 1e-12);
    assert_ok(weft_plane_scale(&cal.camera, (weft_pixel_scale){2, 0.5}, 0, &scale, err));
    assert_near(scale, 0.25, 0.002);
    assert_ok(weft_plane_grid_init(&grid, &cal.camera, 0.125, 0, err));
    assert_true(grid.width % 2 == 0 && grid.height % 2 == 0);
    double corner[3], reach = 0;
    for (int i = 0; i < 4; i++) {
        dome_point(&cal.camera, i % 2 * 1231, i / 2 * 815, 0, corner);
        reach = fmax(reach, fabs(corner[0]));
    }
    const double last = 0.5 * (grid.width - 1) * 0.125;
    assert_true(last <= reach && last > reach - 0.25); /* the very edge may bow out by a little */
    assert_fails(weft_plane_grid_init(&grid, &cal.camera, 1e-4, 0, err), WEFT_ERR_RANGE, "--mm-per-px");
    assert_fails(weft_plane_grid_init(&grid, &cal.camera, 500, 0, err), WEFT_ERR_RANGE, "--mm-per-px");
}

static void test_camera_that_looks_away_is_refused(void **state)
{
    (void)state;
    weft_calibration cal;
    weft_plane_grid grid;
    double scale;
    dome_init(&cal, WIDTH, HEIGHT);
    cal.camera.translation.z = -600;
    assert_fails(weft_plane_scale(&cal.camera, (weft_pixel_scale){1, 0}, 0, &scale, err), WEFT_ERR_RANGE,
                 "does not look at the sample plane");
    assert_fails(weft_plane_grid_init(&grid, &cal.camera, 0.385, 0, err), WEFT_ERR_RANGE,
                 "--geometry sensor");
}

static void test_holes_stay_holes(void **state)
{
    (void)state;
    weft_calibration cal;
    weft_maps sensor, plane = {0};
    weft_plane_grid grid;
    dome_init(&cal, WIDTH, HEIGHT);
    make(&sensor, WIDTH, HEIGHT, WEFT_GEOMETRY_SENSOR);
    draw(&sensor, &cal.camera, 8, 0);
    for (int v = 100; v < 140; v++) /* what stands in a hole must not leak */
        for (int u = 150; u < 200; u++) {
            sensor.mask.data[v * WIDTH + u] = 0;
            for (int c = 0; c < 3; c++)
                weft_image_row(&sensor.normal, c, v)[u] = weft_image_row(&sensor.albedo, c, v)[u] = NAN;
        }
    assert_ok(weft_plane_grid_init(&grid, &cal.camera, 0.385, 0, err));
    assert_ok(weft_rectify(&sensor, &cal.camera, (weft_pixel_scale){1, 0}, &grid, &plane, err));
    int holes = 0;
    for (int j = 30; j < plane.height - 30; j++)
        for (int i = 30; i < plane.width - 30; i++) {
            const int at = j * plane.width + i;
            const float *const n[3] = {weft_image_row(&plane.normal, 0, j),
                                       weft_image_row(&plane.normal, 1, j),
                                       weft_image_row(&plane.normal, 2, j)};
            const float length = n[0][i] * n[0][i] + n[1][i] * n[1][i] + n[2][i] * n[2][i];
            holes += plane.mask.data[at] == 0;
            if (plane.mask.data[at])
                assert_near((double)length, 1, 1e-5);
            else
                assert_true(length == 0);
            assert_true(isfinite(weft_image_row(&plane.albedo, 1, j)[i]));
        }
    assert_near(holes, 2000, 100);
    assert_near((double)weft_image_row(&plane.residual, 0, 50)[50], 0.02, 1e-6);
    weft_maps_fini(&sensor);
    weft_maps_fini(&plane);
}

static void test_same_bits_on_any_number_of_threads(void **state)
{
    (void)state;
    static const int threads[] = {1, 2, 7};
    weft_calibration cal;
    weft_maps sensor, plane[3] = {{0}};
    weft_plane_grid grid;
    dome_init(&cal, WIDTH, HEIGHT);
    make(&sensor, WIDTH, HEIGHT, WEFT_GEOMETRY_SENSOR);
    draw(&sensor, &cal.camera, 5, 0);
    assert_ok(weft_plane_grid_init(&grid, &cal.camera, 0.385, 0, err));
    for (int i = 0; i < 3; i++) {
        weft_parallel_set_threads(threads[i]);
        assert_ok(weft_rectify(&sensor, &cal.camera, (weft_pixel_scale){1, 0}, &grid, &plane[i], err));
        assert_memory_equal(plane[0].normal.data, plane[i].normal.data,
                            3 * weft_image_plane_size(&plane[0].normal) * sizeof(float));
    }
    weft_parallel_set_threads(0);
    for (int i = 0; i < 3; i++)
        weft_maps_fini(&plane[i]);
    weft_maps_fini(&sensor);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_waves_keep_their_slope),
        cmocka_unit_test(test_coarser_grid_averages),
        cmocka_unit_test(test_grid_is_symmetric_and_holds_the_view),
        cmocka_unit_test(test_camera_that_looks_away_is_refused),
        cmocka_unit_test(test_holes_stay_holes),
        cmocka_unit_test(test_same_bits_on_any_number_of_threads),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
