/* Finding charts: drawn in every direction, tilted, in the dark, on any table; and things that are no charts.
 */
#include "tests/support/support.h"

#include "calibration/charts/chart_find.h"
#include "calibration/charts/chart_measure.h"
#include "calibration/charts/homography.h"
#include "calibration/charts/robust.h"
#include "tests/calibration/chart_scene.h"

#include <math.h>
#include <string.h>

static const weft_chart *chart_of(const char *name)
{
    const weft_chart *chart = NULL;
    assert_ok(weft_chart_find(name, "", &chart, err));
    return chart;
}

static weft_err locate(const chart_scene *scene, const weft_chart *wanted, weft_chart_pose *pose,
                       weft_error *err)
{
    weft_image mosaic;
    weft_mask clipped;
    chart_scene_draw(scene, &mosaic, &clipped);
    const weft_chart_picture picture = {&mosaic, WEFT_CFA_RGGB, &clipped};
    const weft_err status = weft_chart_locate(wanted, &picture, pose, err);
    weft_image_fini(&mosaic);
    weft_mask_fini(&clipped);
    return status;
}

static double corner_error(const weft_chart *chart, const weft_mat3 *truth, const weft_chart_pose *pose)
{
    static const double sign[4][2] = {{-1, 1}, {1, 1}, {1, -1}, {-1, -1}};
    double x, y, worst = 0;
    weft_chart_half_size(chart, &x, &y);
    for (int k = 0; k < 4; k++) {
        double u, v;
        assert_true(weft_homography_apply(truth, sign[k][0] * x, sign[k][1] * y, &u, &v));
        worst = fmax(worst, hypot(u - pose->corners[k][0], v - pose->corners[k][1]));
    }
    return worst;
}

/* Ways to make it hard. */
typedef struct condition {
    const char *name;
    double fill, tilt_x, tilt_y, table, clutter, fall_u, fall_v, exposure, blur;
} condition;

static const condition conditions[] = {
    {"plain", 0.60, 0, 0, 0.25, 0.1, 0, 0, 0.8, 0.5},
    {"tilted 20 degrees on a bright table", 0.55, 20, 0, 0.8, 0.1, 0.1, 0, 0.8, 0.5},
    {"tilted 25 degrees on a dark table", 0.55, 0, -25, 0.03, 0.1, 0.1, 0, 0.8, 0.5},
    {"small on a cluttered table", 0.30, 5, 5, 0.25, 0.8, 0.3, 0, 0.8, 0.5},
    {"dark, light falling off 2 : 1", 0.55, 0, 10, 0.25, 0.8, 0, -0.35, 0.02, 0.5},
    {"out of focus", 0.60, 0, 0, 0.4, 0.3, 0.1, 0.1, 0.8, 2.5},
};

static void test_charts_are_found_in_every_direction(void **state)
{
    (void)state;
    static const char *const names[2] = {"macbeth", "munsell"};
    const int n_conditions = (int)(sizeof conditions / sizeof *conditions);
    int found = 0, all = 0;
    double errors[512];
    for (int n = 0; n < 2; n++)
        for (int k = 0; k < n_conditions; k++)
            for (int turn = 0; turn < 360; turn += 30) {
                const condition *const c = &conditions[k];
                const weft_chart *const chart = chart_of(names[n]);
                const weft_mat3 view = chart_scene_view(chart, 616, 408, c->fill * (n ? 1 : 0.9),
                                                        turn + 3 * k, c->tilt_x, c->tilt_y);
                chart_scene scene = chart_scene_make(chart, view);
                scene.table = c->table;
                scene.clutter = c->clutter;
                scene.fall_u = c->fall_u;
                scene.fall_v = c->fall_v;
                scene.exposure = c->exposure;
                scene.blur = c->blur;
                scene.shot = 1e-4; /* full well 10 000 electrons */
                scene.read = 5e-4;
                scene.seed = (uint64_t)(turn + 1000 * k + 1);
                weft_chart_pose pose = {0};
                weft_error error = {0};
                all++;
                if (locate(&scene, chart, &pose, &error) != WEFT_OK) {
                    print_message("%s, %s, turned %d: %s\n", names[n], c->name, turn, error.text);
                    continue;
                }
                const double e = corner_error(chart, &view, &pose);
                if (e > 1.5)
                    print_message("%s, %s, turned %d: corners off by %.2f px\n", names[n], c->name, turn, e);
                errors[found++] = e;
            }
    double mean = 0, worst = 0;
    for (int i = 0; i < found; i++) {
        mean += errors[i] / found;
        worst = fmax(worst, errors[i]);
    }
    print_message("%d of %d found; worst corner off by: mean %.3f px, median %.3f, worst %.3f\n", found, all,
                  mean, weft_median(errors, found), worst);
    assert_int_equal(found, all);
    assert_true(mean < 0.35 && worst < 1.5);
}

static void test_other_kinds_of_pictures(void **state)
{
    (void)state;
    const weft_chart *const chart = chart_of("macbeth");
    const weft_mat3 view = chart_scene_view(chart, 616, 408, 0.6, 200, 10, 0);
    chart_scene scene = chart_scene_make(chart, view);
    weft_image mosaic, rgb;
    weft_mask clipped;
    weft_chart_pose pose;
    chart_scene_draw(&scene, &mosaic, &clipped);
    /* Grey: the luminance of 2x2 cells; the greys alone must tell the rotation. */
    assert_ok(weft_image_init(&rgb, 308, 204, 3, err));
    for (int v = 0; v < 204; v++)
        for (int u = 0; u < 308; u++) {
            weft_image_row(&rgb, 0, v)[u] = weft_image_row(&mosaic, 0, 2 * v)[2 * u];
            weft_image_row(&rgb, 1, v)[u] = 0.5F * (weft_image_row(&mosaic, 0, 2 * v)[2 * u + 1] +
                                                    weft_image_row(&mosaic, 0, 2 * v + 1)[2 * u]);
            weft_image_row(&rgb, 2, v)[u] = weft_image_row(&mosaic, 0, 2 * v + 1)[2 * u + 1];
        }
    const weft_chart_picture colour = {&rgb, WEFT_CFA_NONE, NULL};
    assert_ok(weft_chart_locate(chart, &colour, &pose, err));
    double u, v;
    assert_true(weft_homography_apply(&view, 0, 0, &u, &v));
    double seen_u, seen_v;
    assert_true(weft_homography_apply(&pose.to_pixel, 0, 0, &seen_u, &seen_v));
    assert_near(seen_u, (u + 0.5) / 2 - 0.5, 0.3);
    assert_near(seen_v, (v + 0.5) / 2 - 0.5, 0.3);
    weft_image green = {308, 204, 1, weft_image_plane(&rgb, 1)};
    const weft_chart_picture grey = {&green, WEFT_CFA_NONE, NULL};
    assert_ok(weft_chart_locate(chart, &grey, &pose, err));
    assert_true(weft_homography_apply(&pose.to_pixel, 0, 0, &seen_u, &seen_v));
    assert_near(seen_u, (u + 0.5) / 2 - 0.5, 0.3);
    weft_image_fini(&rgb);
    weft_image_fini(&mosaic);
    weft_mask_fini(&clipped);
}

static void test_mirrored_is_refused(void **state)
{
    (void)state;
    static const char *const names[2] = {"macbeth", "munsell"};
    static const weft_mat3 mirror = {{-1, 0, 0, 0, 1, 0, 0, 0, 1}};
    for (int n = 0; n < 2; n++)
        for (int turn = 0; turn < 360; turn += 72) {
            const weft_chart *const chart = chart_of(names[n]);
            const weft_mat3 view = chart_scene_view(chart, 616, 408, 0.55, turn, 10, 0);
            const chart_scene scene = chart_scene_make(chart, weft_mat3_multiply(&view, &mirror));
            weft_chart_pose pose;
            assert_fails(locate(&scene, chart, &pose, err), WEFT_ERR_NODATA, "mirrored");
        }
}

static void test_two_charts_are_refused(void **state)
{
    (void)state;
    const weft_chart *const chart = chart_of("macbeth");
    const weft_mat3 view = chart_scene_view(chart, 308, 408, 0.8, 15, 0, 0);
    weft_mat3 other = chart_scene_view(chart, 308, 408, 0.7, 110, 0, 0);
    const weft_mat3 shift = {{1, 0, 308, 0, 1, 0, 0, 0, 1}};
    other = weft_mat3_multiply(&shift, &other);
    chart_scene a = chart_scene_make(chart, view), b = chart_scene_make(chart, other);
    weft_image left, right;
    weft_mask mask_a, mask_b;
    chart_scene_draw(&a, &left, &mask_a);
    chart_scene_draw(&b, &right, &mask_b);
    for (int v = 0; v < 408; v++)
        memcpy(weft_image_row(&left, 0, v) + 308, weft_image_row(&right, 0, v) + 308, 308 * sizeof(float));
    const weft_chart_picture picture = {&left, WEFT_CFA_RGGB, NULL};
    weft_chart_pose pose;
    assert_fails(weft_chart_locate(chart, &picture, &pose, err), WEFT_ERR_NODATA,
                 "two macbeth charts in the picture");
    weft_image_fini(&left);
    weft_image_fini(&right);
    weft_mask_fini(&mask_a);
    weft_mask_fini(&mask_b);
}

/* A chart of the same layout with other colours. */
static weft_chart recoloured(const weft_chart *like, uint64_t seed, int kind)
{
    weft_chart chart = *like;
    const int n = chart.columns * chart.rows;
    for (int p = 0; p < n; p++)
        for (int c = 0; c < 3; c++)
            chart.patches[p].linear_srgb[c] =
                kind == 0   ? 0.05 + 0.8 * pow(weft_test_random(&seed), 2)  /* random */
                : kind == 1 ? 0.4                                           /* tiles */
                : kind == 2 ? like->patches[(p * 7 + 5) % n].linear_srgb[c] /* shuffled */
                            : ((p + p / chart.columns) % 2 ? 0.8 : 0.15);   /* chequers */
    return chart;
}

static void test_what_is_no_chart_is_refused(void **state)
{
    (void)state;
    static const char *const names[2] = {"macbeth", "munsell"};
    int refused = 0, all = 0;
    for (int n = 0; n < 2; n++) {
        const weft_chart *const chart = chart_of(names[n]);
        for (int i = 0; i < 24; i++) {
            const weft_mat3 view = chart_scene_view(chart, 616, 408, 0.6, 15 * i, i % 3 * 8, 0);
            const weft_chart other = recoloured(chart, (uint64_t)i + 1, i < 12 ? 0 : 1 + i % 3);
            chart_scene scene = chart_scene_make(&other, view);
            scene.seed = (uint64_t)i + 1;
            if (i >= 20) { /* tables without anything that is meant */
                scene.chart = NULL;
                scene.clutter = 0.4 * (i - 19);
                scene.shot = 1e-3;
            }
            weft_chart_pose pose;
            weft_error error = {0};
            all++;
            if (locate(&scene, chart, &pose, &error) == WEFT_ERR_NODATA)
                refused++;
            else
                print_message("%s, clutter %d was taken for a chart, score %.2f\n", names[n], i, pose.score);
        }
    }
    print_message("%d of %d refused\n", refused, all);
    assert_int_equal(refused, all);
}

static void test_the_wrong_chart_is_refused(void **state)
{
    (void)state;
    const weft_chart *const macbeth = chart_of("macbeth"), *const munsell = chart_of("munsell");
    weft_chart_pose pose;
    chart_scene scene = chart_scene_make(macbeth, chart_scene_view(macbeth, 616, 408, 0.6, 5, 0, 0));
    assert_fails(locate(&scene, munsell, &pose, err), WEFT_ERR_NODATA, "are not its 6 x 2");
    scene = chart_scene_make(munsell, chart_scene_view(munsell, 616, 408, 0.6, 5, 0, 0));
    assert_fails(locate(&scene, macbeth, &pose, err), WEFT_ERR_NODATA, "no macbeth chart found");
}

static void test_a_chart_half_outside_is_refused(void **state)
{
    (void)state;
    const weft_chart *const chart = chart_of("macbeth");
    weft_mat3 view = chart_scene_view(chart, 616, 408, 0.6, 5, 0, 0);
    const weft_mat3 shift = {{1, 0, 220, 0, 1, 0, 0, 0, 1}};
    view = weft_mat3_multiply(&shift, &view);
    const chart_scene scene = chart_scene_make(chart, view);
    weft_chart_pose pose;
    assert_fails(locate(&scene, chart, &pose, err), WEFT_ERR_NODATA, "no macbeth chart found");
}

static void test_greys_out_of_order_are_refused(void **state)
{
    (void)state;
    const weft_chart *const chart = chart_of("macbeth");
    weft_chart changed = *chart; /* a shadow, or a stain */
    for (int c = 0; c < 3; c++)
        changed.patches[20].linear_srgb[c] *= 0.5;
    const chart_scene scene = chart_scene_make(&changed, chart_scene_view(chart, 616, 408, 0.6, 5, 0, 0));
    weft_chart_pose pose;
    assert_fails(locate(&scene, chart, &pose, err), WEFT_ERR_NODATA,
                 "\"neutral 6.5\" is darker than \"neutral 5\"");
}

static void test_corners_by_hand(void **state)
{
    (void)state;
    const weft_chart *const chart = chart_of("macbeth");
    const weft_mat3 view = chart_scene_view(chart, 616, 408, 0.6, 130, 12, -8);
    const chart_scene scene = chart_scene_make(chart, view);
    weft_image mosaic;
    weft_mask clipped;
    chart_scene_draw(&scene, &mosaic, &clipped);
    const weft_chart_picture picture = {&mosaic, WEFT_CFA_RGGB, &clipped};
    static const double sign[4][2] = {{-1, 1}, {1, 1}, {1, -1}, {-1, -1}};
    double x, y, corners[4][2], turned[4][2], crossed[4][2], far[4][2];
    weft_chart_half_size(chart, &x, &y);
    for (int k = 0; k < 4; k++) {
        assert_true(
            weft_homography_apply(&view, sign[k][0] * x, sign[k][1] * y, &corners[k][0], &corners[k][1]));
        corners[k][0] += k % 2 ? 1.3 : -0.8; /* a hand is not exact */
        corners[k][1] += k / 2 ? -1.1 : 0.9;
    }
    weft_chart_pose pose;
    assert_ok(weft_chart_place(chart, &picture, (const double(*)[2])corners, &pose, err));
    assert_true(pose.n_edges > 200);
    assert_true(corner_error(chart, &view, &pose) < 0.3);

    for (int k = 0; k < 4; k++) {
        memcpy(turned[k], corners[(k + 2) % 4], sizeof turned[k]);
        memcpy(crossed[k], corners[k < 2 ? 1 - k : k], sizeof crossed[k]);
        far[k][0] = corners[k][0] + 400;
        far[k][1] = corners[k][1];
    }
    assert_fails(weft_chart_place(chart, &picture, (const double(*)[2])turned, &pose, err), WEFT_ERR_NODATA,
                 "\"dark skin\" is at corner 3");
    assert_fails(weft_chart_place(chart, &picture, (const double(*)[2])crossed, &pose, err), WEFT_ERR_USAGE,
                 "clockwise");
    assert_fails(weft_chart_place(chart, &picture, (const double(*)[2])far, &pose, err), WEFT_ERR_USAGE,
                 "outside");
    weft_image_fini(&mosaic);
    weft_mask_fini(&clipped);
}

static void test_patches_are_measured_site_by_site(void **state)
{
    (void)state;
    const weft_chart *const chart = chart_of("macbeth");
    const weft_mat3 view = chart_scene_view(chart, 616, 408, 0.6, 40, 5, 0);
    chart_scene scene = chart_scene_make(chart, view);
    scene.shot = 1e-4;
    scene.read = 5e-4;
    weft_image mosaic;
    weft_mask clipped;
    chart_scene_draw(&scene, &mosaic, &clipped);
    const weft_chart_picture picture = {&mosaic, WEFT_CFA_RGGB, &clipped};
    weft_chart_pose pose;
    weft_patch_reading readings[24];
    assert_ok(weft_chart_locate(chart, &picture, &pose, err));
    int u, v;
    assert_ok(weft_chart_measure(chart, &picture, &pose, readings, err));
    u = (int)readings[3].u;
    v = (int)readings[3].v;
    weft_image_row(&mosaic, 0, v)[u] = 0.9F; /* a hot pixel changes nothing */
    clipped.data[v * 616 + u + 1] = 1;       /* and a clipped one is counted */
    assert_ok(weft_chart_measure(chart, &picture, &pose, readings, err));
    assert_near(readings[3].clipped,
                1.0 / (readings[3].n[0] + readings[3].n[1] + readings[3].n[2] + readings[3].n[3] + 2), 1e-3);
    double worst = 0;
    for (int p = 0; p < 24; p++) {
        double camera[3];
        chart_scene_camera(chart->patches[p].linear_srgb, camera);
        for (int s = 0; s < WEFT_SITES; s++) {
            const double truth = 0.8 * camera[weft_site_colour[s]];
            const double sigma = sqrt(1e-4 * truth + 25e-8);
            const double error = (readings[p].mean[s] - truth) / (sigma / sqrt(readings[p].n[s]));
            worst = fmax(worst, fabs(error));
            assert_true(readings[p].n[s] > 100);
            assert_near(readings[p].std_dev[s] / sigma, 1, 0.3);
        }
    }
    assert_true(worst < 4.5); /* 96 means of normal noise */
    weft_image_fini(&mosaic);
    weft_mask_fini(&clipped);
}

static void test_robust_means(void **state)
{
    (void)state;
    double values[200], scratch[200];
    uint64_t seed = 3;
    for (int i = 0; i < 200; i++)
        values[i] = i < 190 ? 5 + 0.1 * weft_test_gauss(&seed) : 50;
    const weft_robust_mean m = weft_mean_robust(values, 200, scratch);
    assert_near(m.mean, 5, 0.03);
    assert_near(m.std_dev, 0.1, 0.02);
    assert_true(m.kept <= 190 && m.kept >= 186);
    double same[4] = {2, 2, 2, 2};
    assert_true(weft_mean_robust(same, 4, scratch).mean == 2);
    double even[4] = {4, 1, 3, 2};
    assert_true(weft_median(even, 4) == 2.5);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_charts_are_found_in_every_direction),
        cmocka_unit_test(test_other_kinds_of_pictures),
        cmocka_unit_test(test_mirrored_is_refused),
        cmocka_unit_test(test_two_charts_are_refused),
        cmocka_unit_test(test_what_is_no_chart_is_refused),
        cmocka_unit_test(test_the_wrong_chart_is_refused),
        cmocka_unit_test(test_a_chart_half_outside_is_refused),
        cmocka_unit_test(test_greys_out_of_order_are_refused),
        cmocka_unit_test(test_corners_by_hand),
        cmocka_unit_test(test_patches_are_measured_site_by_site),
        cmocka_unit_test(test_robust_means),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
