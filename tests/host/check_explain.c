/* What weft solve --explain says, against what was painted into the frames and what the solver answers. */
#include "tests/support/support.h"

#include "core/file.h"
#include "core/formats/png_file.h"
#include "core/mem.h"
#include "host/solve/explain.h"
#include "tests/host/dome.h"

#include <math.h>
#include <stdio.h>

enum { WIDTH = 240, HEIGHT = 160, N = 10 };

#define BLACK    1000.0
#define WHITE    60000.0
#define EXPOSURE 0.05

/* What is wrong with one light in each quarter of the picture. */
enum { QUARTER_GOOD, QUARTER_SATURATED, QUARTER_SHADOW, QUARTER_BRIGHT };
static const int bad_light[] = {-1, 2, 4, 6};

static weft_calibration cal;
static weft_set made;

static int quarter(int u, int v)
{
    return (u >= WIDTH / 2) + 2 * (v >= HEIGHT / 2);
}

static void write_frame(const char *path, int light, uint64_t *seed)
{
    weft_raster raster;
    static const double normal[3] = {0.2, -0.1, 0.9746794344808963};
    assert_ok(weft_raster_init(&raster, WIDTH, HEIGHT, 1, 16, err));
    for (int v = 0; v < HEIGHT; v++)
        for (int u = 0; u < WIDTH; u++) {
            double point[3], value;
            const int q = quarter(u, v), c = weft_cfa_colour(WEFT_CFA_RGGB, u, v);
            dome_point(&cal.camera, u, v, 0, point);
            value = EXPOSURE * dome_radiance(&cal.lights[light], c, point, normal, 0.5);
            if (light == bad_light[q])
                value = q == QUARTER_SATURATED ? 2 : q == QUARTER_SHADOW ? 0.05 * value : 1.5 * value;
            value += 0.0005 * weft_test_gauss(seed);
            raster.data[v * WIDTH + u] =
                (uint16_t)lround(fmax(0, fmin(BLACK + value * (WHITE - BLACK), WHITE)));
        }
    assert_ok(weft_png_write(path, &raster, err));
    weft_raster_fini(&raster);
}

static int make_set(void **state)
{
    (void)state;
    uint64_t seed = 3;
    const char *const folder = weft_test_path("quarters.set");
    dome_init(&cal, WIDTH, HEIGHT);
    assert_ok(weft_folder_create(folder, err));
    assert_ok(weft_set_init(&made, folder, err));
    made.width = WIDTH;
    made.height = HEIGHT;
    made.cfa = WEFT_CFA_RGGB;
    made.white = WHITE;
    made.complete = true;
    for (int i = 0; i < 4; i++)
        made.black[i] = BLACK;
    for (int j = 0; j < N; j++) {
        char name[32];
        snprintf(name, sizeof name, "light-%02d.png", j);
        char *const path = weft_path_join(folder, name, NULL);
        write_frame(path, j, &seed);
        weft_free(path);
        const weft_set_frame frame = {
            .file = name, .role = WEFT_ROLE_LIGHT, .light = j, .exposure_s = EXPOSURE, .gain = 1};
        assert_ok(weft_set_add_frame(&made, &frame, err));
    }
    assert_ok(weft_set_save(&made, err));
    assert_ok(weft_calibration_save(weft_test_path("dome.cal"), &cal, err));
    return 0;
}

static int free_set(void **state)
{
    (void)state;
    weft_set_fini(&made);
    weft_calibration_fini(&cal);
    return 0;
}

static weft_err explain(const weft_solve_options *options, int x, int y, weft_explanation *e, weft_error *err)
{
    return weft_solve_explain(&made, &cal, weft_test_path("dome.cal"), options, x, y, e, err);
}

static void each_quarter_says_what_was_painted(void **state)
{
    (void)state;
    static const weft_explain_why why[] = {WEFT_EXPLAIN_USED, WEFT_EXPLAIN_CLIPPED, WEFT_EXPLAIN_SHADOW,
                                           WEFT_EXPLAIN_CONTRADICTS};
    const weft_solve_options options = {
        .method = &weft_method_robust, .sensor_geometry = true, .matte = true};
    for (int q = 0; q < 4; q++) {
        weft_explanation e;
        assert_ok(explain(&options, 60 + 120 * (q & 1), 40 + 80 * (q >> 1), &e, err));
        assert_true(e.valid);
        assert_int_equal(e.n_lights, N);
        assert_int_equal(e.n_used, q == QUARTER_GOOD ? N : N - 1);
        for (int j = 0; j < N; j++) {
            const weft_explained_light *const l = &e.lights[j];
            assert_int_equal(l->why, j == bad_light[q] ? why[q] : WEFT_EXPLAIN_USED);
            if (j != bad_light[q])
                assert_true(fabs(l->value - l->fit) < 3 * l->sigma && l->influence_deg > 0.005);
            else
                assert_true(l->influence_deg < 1e-4);
        }
        assert_near(e.lights[0].fit,
                    0.5 * (0.2 * e.lights[0].direction[0] - 0.1 * e.lights[0].direction[1] +
                           0.9746794344808963 * e.lights[0].direction[2]),
                    0.005);
        assert_true(e.searched == (q == QUARTER_BRIGHT));
    }
}

/* The influence is that of least squares: (I - n n^T) C l_j / k per unit of the sample, C = (L^T L)^-1. */
static void influence_is_that_of_least_squares(void **state)
{
    (void)state;
    const weft_solve_options options = {.method = &weft_method_lsq, .sensor_geometry = true};
    weft_explanation e;
    double a[3][3] = {{0}}, peak = 0, k = 0;
    assert_ok(explain(&options, 60, 40, &e, err));
    for (int j = 0; j < N; j++) {
        const double *const l = e.lights[j].direction;
        peak = fmax(peak, e.lights[j].value);
        k = e.lights[j].fit / (l[0] * e.normal[0] + l[1] * e.normal[1] + l[2] * e.normal[2]);
        for (int r = 0; r < 3; r++)
            for (int c = 0; c < 3; c++)
                a[r][c] += l[r] * l[c];
    }
    weft_mat3 m;
    for (int r = 0; r < 9; r++)
        m.m[r] = a[r / 3][r % 3];
    weft_mat3 inverse;
    assert_true(weft_mat3_invert(&m, &inverse));
    for (int j = 0; j < N; j++) {
        double d[3], along = 0, turn = 0;
        for (int r = 0; r < 3; r++) {
            d[r] = 0;
            for (int c = 0; c < 3; c++)
                d[r] += inverse.m[3 * r + c] * e.lights[j].direction[c];
            along += d[r] * e.normal[r];
        }
        for (int r = 0; r < 3; r++)
            turn += pow(d[r] - along * e.normal[r], 2);
        const double wanted = sqrt(turn) * 0.01 * peak / k * 57.29577951308232;
        assert_near(e.lights[j].influence_deg, wanted, 0.02 * wanted + 1e-3);
    }
}

/* The explanation is of the maps: same normal, same number of lights, in every quarter. */
static void agrees_with_the_maps(const weft_solve_options *options)
{
    weft_maps maps;
    int off = 0, n = 0;
    assert_ok(weft_solve_set(&made, &cal, weft_test_path("dome.cal"), options, &maps, err));
    for (int y = 7; y < maps.height; y += maps.height / 2)
        for (int x = 5; x < maps.width; x += maps.width / 2) {
            weft_explanation e;
            int used = 0;
            assert_ok(explain(options, x, y, &e, err));
            for (int j = 0; j < e.n_lights; j++)
                used += e.lights[j].why == WEFT_EXPLAIN_USED;
            assert_int_equal(e.n_used, maps.lights.data[y * maps.width + x]);
            assert_int_equal(used, e.n_used);
            for (int c = 0; c < 3; c++)
                off += fabs(e.normal[c] - (double)weft_image_row(&maps.normal, c, y)[x]) > 1e-6;
            n++;
        }
    assert_int_equal(n, 4);
    assert_int_equal(off, 0);
    weft_maps_fini(&maps);
}

static void every_method_is_explained(void **state)
{
    (void)state;
    for (int i = 0; weft_solve_methods[i]; i++) {
        const weft_solve_options full = {
            .method = weft_solve_methods[i], .sensor_geometry = true, .no_bounce = true};
        const weft_solve_options half = {
            .method = weft_solve_methods[i], .sensor_geometry = true, .no_bounce = true, .half = true};
        agrees_with_the_maps(&full);
        agrees_with_the_maps(&half);
    }
}

static void the_plane_leads_to_the_sensor(void **state)
{
    (void)state;
    const weft_solve_options options = {.method = &weft_method_robust, .no_bounce = true, .matte = true};
    weft_maps maps;
    weft_explanation e;
    assert_ok(weft_solve_set(&made, &cal, weft_test_path("dome.cal"), &options, &maps, err));
    assert_ok(explain(&options, 50, 30, &e, err));
    assert_true(e.plane && e.has_world);
    assert_near(e.mm_per_px, maps.mm_per_px, 1e-12);
    assert_near(e.world_mm[0], maps.origin_mm[0] + 50 * maps.mm_per_px, maps.mm_per_px);
    assert_near(e.world_mm[1], maps.origin_mm[1] - 30 * maps.mm_per_px, maps.mm_per_px);
    assert_fails(explain(&options, maps.width, 0, &e, err), WEFT_ERR_RANGE, "is outside: the maps are");
    assert_fails(explain(&options, -1, 0, &e, err), WEFT_ERR_RANGE, "--geometry sensor");
    weft_maps_fini(&maps);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(each_quarter_says_what_was_painted),
        cmocka_unit_test(influence_is_that_of_least_squares),
        cmocka_unit_test(every_method_is_explained),
        cmocka_unit_test(the_plane_leads_to_the_sensor),
    };
    return cmocka_run_group_tests(tests, make_set, free_set);
}
