/* The lens fit on real photographs with a published result, and on boards whose truth the test made. */
#include "tests/calibration/opencv_oracle.h"
#include "tests/support/support.h"

#include "calibration/lens/lens_fit.h"
#include "calibration/lens/lens_model.h"
#include "calibration/lens/lens_module.h"
#include "core/mem.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const weft_board board = {9, 6, 10};

enum { CORNERS = 54, MAX_VIEWS = 16 };

/* What needs no choice of model does not pay for one. */
static const weft_lens_options plain = {WEFT_LENS_K1K2P1P2, 0};

typedef struct views {
    int n;
    weft_board_view views[MAX_VIEWS];
    float corners[MAX_VIEWS][2 * CORNERS];
    char names[MAX_VIEWS][16];
} views;

static void need_module(void)
{
    const weft_lens_opencv *opencv;
    weft_error error = {0};
    if (weft_lens_opencv_load(&opencv, &error) != WEFT_OK) {
        print_message("skipped: %s\n", error.text);
        skip();
    }
}

static void add_name(views *all)
{
    const int i = all->n++;
    snprintf(all->names[i], sizeof all->names[i], "view-%d", i);
    all->views[i] = (weft_board_view){.name = all->names[i], .corners = all->corners[i]};
}

static void load_photographs(views *all)
{
    static uint8_t grey[640 * 480];
    const char *const folder = weft_test_need_shared("data/images/opencv_left");
    for (int i = 1; i <= 14; i++) {
        char path[1200];
        int w, h;
        bool found = false;
        if (i == 10)
            continue; /* upstream has none */
        snprintf(path, sizeof path, "%s/left%02d.jpg", folder, i);
        assert_int_equal(oracle_read_grey(path, grey, sizeof grey, &w, &h), 0);
        assert_ok(weft_board_find(grey, w, h, &board, all->corners[all->n], &found, err));
        assert_true(found);
        add_name(all);
    }
}

/* The figures of another program (Python, OpenCV 4.6) on the same pictures: SOURCE.md of the data. */
static void test_real_photographs(void **state)
{
    (void)state;
    need_module();
    views all = {0};
    load_photographs(&all);
    weft_camera camera;
    weft_lens_report report;
    static const weft_lens_options flat = {WEFT_LENS_AUTO, 0};
    assert_ok(weft_lens_fit(&board, 640, 480, all.views, all.n, &flat, &camera, &report, err));
    print_message(
        "13 photographs: rms %.4f px, held out %.4f px, fx %.2f +- %.2f, cx %.2f, cy %.2f, k1 %.4f\n",
        camera.rms_px, report.held_out_px, camera.fx, report.sigma[0], camera.cx, camera.cy,
        camera.distortion[0]);
    assert_int_equal(report.n_used, 13);
    assert_near(camera.rms_px, 0.1774, 0.003);
    assert_near(report.held_out_px, 0.1826, 0.003);
    assert_near(camera.fx, 533.35, 0.55);
    assert_near(camera.fy, 533.42, 0.55);
    assert_near(camera.cx, 342.18, 0.5);
    assert_near(camera.cy, 234.04, 0.5);
    assert_near(camera.distortion[0], -0.2904, 0.003);
    assert_near(camera.distortion[1], 0.1021, 0.01);
    assert_near(camera.distortion[4], 0, 0);
    assert_near(report.sigma[0], 0.55, 0.1);
    assert_true(report.coverage > 0.6 && report.coverage < 1);
    assert_false(camera.has_pose);
    assert_int_equal(report.model, WEFT_LENS_K1K2P1P2); /* more coefficients predict no better */
    assert_near(report.tried_px[0][WEFT_LENS_K3], 0.1829, 0.001);
    assert_near(report.tried_px[0][WEFT_LENS_RATIONAL], 0.1846, 0.001);
    int corners = 0;
    for (int r = 0; r < WEFT_COVERAGE_ROWS; r++)
        for (int c = 0; c < WEFT_COVERAGE_COLUMNS; c++)
            corners += report.map[r][c];
    assert_int_equal(corners, 13 * CORNERS);
}

/* The board of these pictures is bent by half a millimetre: what the other program finds too. */
static void test_the_bent_board_of_the_photographs(void **state)
{
    (void)state;
    need_module();
    static float residuals[MAX_VIEWS][2 * CORNERS];
    views all = {0};
    load_photographs(&all);
    for (int i = 0; i < all.n; i++)
        all.views[i].residuals = residuals[i];
    const weft_board large = {9, 6, 25};
    weft_camera camera;
    weft_lens_report report;
    assert_ok(weft_lens_fit(&large, 640, 480, all.views, all.n, NULL, &camera, &report, err));
    print_message("bent: rms %.4f px, held out %.4f px, fx %.2f, bend %.2f mm\n", camera.rms_px,
                  report.held_out_px, camera.fx, report.bend_mm);
    assert_true(report.bent);
    assert_near(camera.rms_px, 0.1045, 0.002);
    assert_near(report.held_out_px, 0.1224, 0.002);
    assert_near(camera.fx, 533.97, 0.3);
    assert_near(camera.cy, 238.8, 0.3);
    assert_true(report.bend_mm > 0.3 && report.bend_mm < 0.9);
    double sum = 0;
    for (int i = 0; i < all.n; i++)
        for (int k = 0; k < 2 * CORNERS; k++)
            sum += (double)residuals[i][k] * (double)residuals[i][k];
    assert_near(sqrt(sum / (all.n * CORNERS)), camera.rms_px, 1e-3);
}

static void test_a_blurred_view_is_left_out(void **state)
{
    (void)state;
    need_module();
    views all = {0};
    load_photographs(&all);
    for (int i = 0; i < all.n; i++)
        all.views[i].edge_px = i == 6 ? 9 : 2.5;
    weft_camera camera;
    weft_lens_report report;
    assert_ok(weft_lens_fit(&board, 640, 480, all.views, all.n, &plain, &camera, &report, err));
    assert_int_equal(report.n_used, 12);
    assert_true(all.views[6].blurred && !all.views[6].used && !all.views[5].blurred);
}

/* A lens that only the rational model describes: twelve views by OpenCV's own projection. */
static void test_a_rational_lens_is_recognised(void **state)
{
    (void)state;
    need_module();
    static const double distortion[8] = {0.9, 0.3, 1e-3, -5e-4, 0.02, 1.25, 0.55, 0.05};
    static const double camera_matrix[4] = {420, 421, 325, 236};
    views all = {0};
    uint64_t seed = 4;
    double world[CORNERS][3] = {{0}}, seen[CORNERS][2];
    for (int i = 0; i < CORNERS; i++) {
        world[i][0] = 10 * (i % 9 - 4);
        world[i][1] = 10 * (2.5 - (double)(i / 9));
    }
    for (int v = 0; v < 14; v++) {
        const double a = 3.14159 + 0.6 * (weft_test_random(&seed) - 0.5) + (v % 2 ? 0.3 : -0.3),
                     b = 0.6 * (weft_test_random(&seed) - 0.5) + (v % 4 < 2 ? 0.3 : -0.3);
        const weft_mat3 x = {{1, 0, 0, 0, cos(a), -sin(a), 0, sin(a), cos(a)}},
                        y = {{cos(b), 0, sin(b), 0, 1, 0, -sin(b), 0, cos(b)}};
        const weft_mat3 r = weft_mat3_multiply(&x, &y);
        const double t[3] = {50 * (v % 3 - 1), 35 * (v / 3 % 3 - 1), 85};
        assert_int_equal(oracle_project(r.m, t, camera_matrix, distortion, CORNERS, *world, *seen), 0);
        for (int i = 0; i < 2 * CORNERS; i++)
            all.corners[v][i] = (float)(seen[i / 2][i % 2] + 0.05 * weft_test_gauss(&seed));
        add_name(&all);
    }
    weft_camera camera;
    weft_lens_report report;
    assert_ok(weft_lens_fit(&board, 640, 480, all.views, all.n, NULL, &camera, &report, err));
    print_message("rational lens: held out %.3f, %.3f, %.3f px; fx %.2f +- %.2f\n", report.tried_px[0][0],
                  report.tried_px[0][1], report.tried_px[0][2], camera.fx, report.sigma[0]);
    assert_int_equal(report.model, WEFT_LENS_RATIONAL);
    assert_true(report.held_out_px < 0.09);
    assert_true(fabs(camera.fx - 420) < 4 * report.sigma[0] + 0.1);
    for (double w = -250; w <= 250; w += 50) { /* in the field, the lens is what it was made as */
        double px, py, qx, qy;
        weft_lens_distort(camera.distortion, w / 420, w / 700, &px, &py);
        weft_lens_distort(distortion, w / 420, w / 700, &qx, &qy);
        assert_near(camera.fx * px + camera.cx, 420 * qx + 325, 0.6);
    }
}

static void test_a_wrong_view_is_left_out(void **state)
{
    (void)state;
    need_module();
    views all = {0};
    load_photographs(&all);
    for (int i = 0; i < CORNERS; i++) /* the board bent: a parabola of 4 px along view 4 */
        all.corners[4][2 * i] += 4.0F * (float)((i % 9 - 4) * (i % 9 - 4)) / 16;
    weft_camera camera;
    weft_lens_report report;
    assert_ok(weft_lens_fit(&board, 640, 480, all.views, all.n, &plain, &camera, &report, err));
    assert_int_equal(report.n_used, 12);
    for (int i = 0; i < all.n; i++)
        assert_int_equal(all.views[i].used, i != 4);
    assert_true(all.views[4].rms_px > 0.5);
    assert_near(camera.fx, 533.35, 1);
}

static void test_views_that_do_not_determine_a_lens(void **state)
{
    (void)state;
    need_module();
    views all = {0};
    load_photographs(&all);
    weft_camera camera = {.width = 7};
    weft_lens_report report;
    assert_fails(weft_lens_fit(&board, 640, 480, all.views, 4, &plain, &camera, &report, err),
                 WEFT_ERR_NODATA, "4 views of the board; wanted 5 or more");
    for (int i = 1; i < all.n; i++) /* one picture thirteen times */
        memcpy(all.corners[i], all.corners[0], sizeof all.corners[0]);
    assert_fails(weft_lens_fit(&board, 640, 480, all.views, all.n, &plain, &camera, &report, err),
                 WEFT_ERR_NODATA, "tilt the board");
    assert_int_equal(camera.width, 7);
}

static void test_outliers_that_are_too_many_are_named(void **state)
{
    (void)state;
    need_module();
    views all = {0};
    load_photographs(&all);
    uint64_t seed = 3;
    for (int v = 3; v < 8; v++)
        for (int i = 0; i < 2 * CORNERS; i++)
            all.corners[v][i] += (float)(20 * (1 + v) * weft_test_gauss(&seed));
    weft_camera camera;
    weft_lens_report report;
    assert_fails(weft_lens_fit(&board, 640, 480, all.views, all.n, &plain, &camera, &report, err),
                 WEFT_ERR_NODATA, "contradict the others (view-");
}

/* A camera 600 mm over the table as the scanner has it, tilted by 3 degrees. */
static weft_camera scanner_camera(void)
{
    const double a = 3.14159265358979 - 0.05, c = 0.02;
    const weft_mat3 x = {{1, 0, 0, 0, cos(a), -sin(a), 0, sin(a), cos(a)}},
                    z = {{cos(c), -sin(c), 0, sin(c), cos(c), 0, 0, 0, 1}};
    return (weft_camera){.width = 1232,
                         .height = 816,
                         .fx = 4810,
                         .fy = 4795,
                         .cx = 622,
                         .cy = 401,
                         .distortion = {-0.15, 0.3, 4e-4, -3e-4, 0},
                         .has_pose = true,
                         .rotation = weft_mat3_multiply(&x, &z),
                         .translation = {3, -5, 602}};
}

/* Corners of a board whose middle is at (x0, y0) on the table, its rows turned by `turn`. */
static void project_board(const weft_camera *camera, double x0, double y0, double turn, float *corners)
{
    for (int i = 0; i < CORNERS; i++) {
        const double x = 10 * (i % 9 - 4), y = 10 * (2.5 - (double)(i / 9));
        double u, v;
        assert_true(weft_camera_project(
            camera, (weft_vec3){x0 + cos(turn) * x - sin(turn) * y, y0 + sin(turn) * x + cos(turn) * y, 0},
            &u, &v));
        corners[2 * i] = (float)u;
        corners[2 * i + 1] = (float)v;
    }
}

static void reverse(float *corners)
{
    for (int i = 0; i < CORNERS / 2; i++)
        for (int k = 0; k < 2; k++) {
            const float t = corners[2 * i + k];
            corners[2 * i + k] = corners[2 * (CORNERS - 1 - i) + k];
            corners[2 * (CORNERS - 1 - i) + k] = t;
        }
}

static void test_pose_of_a_board_on_the_table(void **state)
{
    (void)state;
    need_module();
    const weft_camera truth = scanner_camera();
    float corners[2 * CORNERS];
    for (int from_the_other_end = 0; from_the_other_end < 2; from_the_other_end++) {
        project_board(&truth, 12.5, -4, 0, corners);
        if (from_the_other_end)
            reverse(corners);
        weft_camera camera = truth;
        camera.has_pose = false;
        camera.rotation = (weft_mat3){{0}};
        double rms;
        const weft_board_view view = {.name = "table", .corners = corners};
        assert_ok(weft_lens_fit_pose(&board, &view, (const double[]){12.5, -4}, &camera, &rms, err));
        assert_true(camera.has_pose);
        for (int i = 0; i < 9; i++)
            assert_near(camera.rotation.m[i], truth.rotation.m[i], 2e-5);
        assert_near(camera.translation.x, 3, 0.01);
        assert_near(camera.translation.y, -5, 0.01);
        assert_near(camera.translation.z, 602, 0.02);
        assert_true(rms < 1e-3);
        assert_true(weft_camera_centre(&camera).z > 590);
    }
}

static void test_a_board_across_is_refused(void **state)
{
    (void)state;
    need_module();
    weft_camera camera = scanner_camera();
    float corners[2 * CORNERS];
    double rms;
    const weft_board_view view = {.name = "table.dng", .corners = corners};
    project_board(&camera, 0, 0, 1.2, corners);
    assert_fails(weft_lens_fit_pose(&board, &view, (const double[]){0, 0}, &camera, &rms, err),
                 WEFT_ERR_RANGE, "table.dng: the board's rows of 9 corners are turned by");
}

/* A row of squares of 10 mm as +1 and -1 under a Gaussian blur; 0 outside its n squares. */
static double squares(double x, int n, double sigma)
{
    double sum = 0;
    for (int i = 0; i <= n; i++) {
        const double edge = 10 * (i - 0.5 * n), step = i == 0 || i == n ? 0.5 : 1;
        sum += (i % 2 ? -step : step) * erf((x - edge) / (sigma * 1.4142135623731));
    }
    return sum;
}

/* What a pixel sees of the board: 10 x 7 squares of 4 % and 90 % on a grey table, blurred by lens and pixel
 * together as a Gaussian of 0.75 px. */
static double seen_reflectance(const weft_camera *camera, int u, int v)
{
    weft_vec3 p;
    assert_true(weft_camera_to_plane(camera, u, v, 0, &p));
    const double sigma = 0.75 * 600 / 4800;
    return (0.47 + 0.43 * squares(p.x, 10, sigma) * squares(p.y, 7, sigma)) * (1 + p.x / 200);
}

/* A Bayer picture of the board under uneven tinted light, with noise. */
static void render_board(const weft_camera *camera, weft_image *mosaic)
{
    static const double tint[3] = {0.5, 1, 0.7};
    uint64_t seed = 11;
    for (int v = 0; v < camera->height; v++)
        for (int u = 0; u < camera->width; u++) {
            const double light =
                0.4 * tint[weft_cfa_colour(WEFT_CFA_RGGB, u, v)] * seen_reflectance(camera, u, v);
            weft_image_row(mosaic, 0, v)[u] = (float)(light + 0.004 * weft_test_gauss(&seed));
        }
}

static void test_corners_of_a_bayer_picture(void **state)
{
    (void)state;
    need_module();
    const weft_camera camera = scanner_camera();
    weft_image mosaic;
    assert_ok(weft_image_init(&mosaic, camera.width, camera.height, 1, err));
    render_board(&camera, &mosaic);
    mosaic.data[5] = 1e6F; /* a hot pixel */
    mosaic.data[77] = NAN;
    uint8_t *const grey = weft_alloc(weft_image_plane_size(&mosaic), 1, NULL);
    weft_board_grey(&mosaic, WEFT_CFA_RGGB, grey);
    float found_at[2 * CORNERS], truth[2 * CORNERS];
    bool found = false;
    assert_ok(weft_board_find(grey, camera.width, camera.height, &board, found_at, &found, err));
    assert_true(found);
    project_board(&camera, 0, 0, 0, truth);
    if (hypot((double)(found_at[0] - truth[0]), (double)(found_at[1] - truth[1])) > 100)
        reverse(found_at);
    double sum = 0, worst = 0;
    for (int i = 0; i < CORNERS; i++) {
        const double e =
            hypot((double)(found_at[2 * i] - truth[2 * i]), (double)(found_at[2 * i + 1] - truth[2 * i + 1]));
        sum += e * e / CORNERS;
        worst = fmax(worst, e);
    }
    double share;
    const double edge = weft_board_edge_width(grey, camera.width, camera.height, &board, found_at, &share);
    print_message("edges of the Bayer picture: %.2f px, %.3f of a square\n", edge, share);
    assert_true(edge > 1.8 && edge < 4.5 && share < 0.06); /* a Gaussian of 0.75 px is 1.9 */
    for (int round = 0; round < 6; round++) { /* out of focus: a box of 25 px three times each way */
        const int step = round % 2 ? camera.width : 1;
        const int last = camera.width * camera.height - 25 * step;
        for (int i = 0; i < last; i++) {
            int box = 0;
            for (int k = 0; k < 25; k++)
                box += grey[i + k * step];
            grey[i] = (uint8_t)(box / 25);
        }
    }
    for (int i = 0; i < 2 * CORNERS; i++)
        found_at[i] -= 36; /* the boxes reach ahead */
    weft_board_edge_width(grey, camera.width, camera.height, &board, found_at, &share);
    assert_true(share > 0.2);
    print_message("corners of a rendered Bayer picture: rms %.4f px, worst %.4f px\n", sqrt(sum), worst);
    assert_true(sqrt(sum) < 0.04);
    assert_true(worst < 0.12);
    weft_free(grey);
    weft_image_fini(&mosaic);
}

static void test_two_boards_are_refused(void **state)
{
    (void)state;
    need_module();
    const weft_camera camera = scanner_camera();
    weft_image mosaic;
    assert_ok(weft_image_init(&mosaic, camera.width, camera.height, 1, err));
    render_board(&camera, &mosaic);
    const size_t w = (size_t)camera.width, h = (size_t)camera.height;
    uint8_t *const one = weft_alloc(w * h, 1, NULL), *const two = weft_alloc(2 * w * h, 1, NULL);
    weft_board_grey(&mosaic, WEFT_CFA_RGGB, one);
    for (size_t v = 0; v < h; v++)
        for (size_t k = 0; k < 2; k++)
            memcpy(two + (2 * v + k) * w, one + v * w, w);
    float corners[2 * CORNERS];
    bool found = false;
    assert_fails(weft_board_find(two, 2 * camera.width, camera.height, &board, corners, &found, err),
                 WEFT_ERR_NODATA, "there are two boards of 9x6 inner corners in it");
    weft_free(one);
    weft_free(two);
    weft_image_fini(&mosaic);
}

static void test_no_board_is_no_error(void **state)
{
    (void)state;
    need_module();
    uint8_t *const grey = weft_alloc((size_t)320 * 240, 1, NULL);
    weft_image flat;
    assert_ok(weft_image_init(&flat, 320, 240, 3, err));
    weft_board_grey(&flat, WEFT_CFA_NONE, grey);
    float corners[2 * CORNERS];
    bool found = true;
    assert_ok(weft_board_find(grey, 320, 240, &board, corners, &found, err));
    assert_false(found);
    assert_fails(weft_board_find(grey, 320, 240, &(weft_board){2, 6, 10}, corners, &found, err),
                 WEFT_ERR_USAGE, "2x6 inner corners");
    weft_image_fini(&flat);
    weft_free(grey);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_real_photographs),
        cmocka_unit_test(test_the_bent_board_of_the_photographs),
        cmocka_unit_test(test_a_blurred_view_is_left_out),
        cmocka_unit_test(test_a_rational_lens_is_recognised),
        cmocka_unit_test(test_two_boards_are_refused),
        cmocka_unit_test(test_a_wrong_view_is_left_out),
        cmocka_unit_test(test_views_that_do_not_determine_a_lens),
        cmocka_unit_test(test_outliers_that_are_too_many_are_named),
        cmocka_unit_test(test_pose_of_a_board_on_the_table),
        cmocka_unit_test(test_a_board_across_is_refused),
        cmocka_unit_test(test_corners_of_a_bayer_picture),
        cmocka_unit_test(test_no_board_is_no_error),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
