/* The pixel loop of the solver: against the formula it inverts, against LAPACK, and at its edges. */
#include "tests/support/support.h"

#include "core/parallel.h"
#include "host/solve/solve_row.h"
#include "tests/host/dome.h"

#include <lapacke.h>
#include <math.h>
#include <string.h>

enum { WIDTH = 203, HEIGHT = 61, N = 10, LANES = WEFT_SOLVE_LANES }; /* 203: a last block of 11 */

typedef struct scene {
    weft_calibration cal;
    weft_incidence incidence;
    weft_solve_plan plan;
    double normal[HEIGHT][WIDTH][3], albedo[HEIGHT][WIDTH][3];
    float rgb[N][3][HEIGHT][WIDTH];
    uint8_t clipped[N][HEIGHT][WIDTH];
    float out[9][HEIGHT][WIDTH];
    uint8_t valid[HEIGHT][WIDTH], lights[HEIGHT][WIDTH], quality[HEIGHT][WIDTH];
} scene;

static scene s; /* 8 MB */

/* Hills with slopes to 0.35 and a coloured pattern. */
static void draw(double height_mm)
{
    for (int v = 0; v < HEIGHT; v++)
        for (int u = 0; u < WIDTH; u++) {
            double point[3];
            dome_point(&s.cal.camera, u, v, height_mm, point);
            const double p = 0.35 * sin(0.31 * u + 0.1 * v), q = 0.3 * cos(0.23 * v - 0.17 * u);
            const double length = sqrt(p * p + q * q + 1);
            const double n[3] = {-p / length, -q / length, 1 / length};
            memcpy(s.normal[v][u], n, sizeof n);
            for (int c = 0; c < 3; c++) {
                s.albedo[v][u][c] = 0.4 + 0.1 * c + 0.2 * sin(0.4 * u + c);
                for (int j = 0; j < N; j++)
                    s.rgb[j][c][v][u] =
                        (float)dome_radiance(&s.cal.lights[j], c, point, n, s.albedo[v][u][c]);
            }
        }
}

static void begin(double height_mm)
{
    memset(&s, 0, sizeof s);
    dome_init(&s.cal, WIDTH, HEIGHT);
    draw(height_mm);
    assert_ok(
        weft_incidence_init(&s.incidence, &s.cal, WIDTH, HEIGHT, (weft_pixel_scale){1, 0}, height_mm, err));
    s.plan = (weft_solve_plan){&s.incidence, &weft_method_lsq, WIDTH, WEFT_CFA_NONE, 0, NULL, false};
}

static void end(void)
{
    weft_incidence_fini(&s.incidence);
}

static float least, most;

static void solve_rows(void *context, int band, int row_begin, int row_end)
{
    (void)context;
    (void)band;
    for (int v = row_begin; v < row_end; v++) {
        weft_solve_row_in in[N];
        for (int j = 0; j < N; j++)
            in[j] = (weft_solve_row_in){
                {s.rgb[j][0][v], s.rgb[j][1][v], s.rgb[j][2][v]}, s.clipped[j][v], least, most, 0, 0};
        const weft_solve_row_out out = {.normal = {s.out[0][v], s.out[1][v], s.out[2][v]},
                                        .albedo = {s.out[3][v], s.out[4][v], s.out[5][v]},
                                        .residual = s.out[6][v],
                                        .confidence = s.out[7][v],
                                        .angle = s.out[8][v],
                                        .lights = s.lights[v],
                                        .quality = s.quality[v],
                                        .valid = s.valid[v]};
        weft_solve_row(&s.plan, v, in, &out);
    }
}

static void solve(void)
{
    weft_parallel_rows(HEIGHT, solve_rows, NULL);
}

static double normal_error(int u, int v)
{
    const double n[3] = {s.out[0][v][u], s.out[1][v][u], s.out[2][v][u]};
    return dome_angle_deg(n, s.normal[v][u]);
}

static void check_all(double max_deg, double max_albedo)
{
    double worst = 0, worst_albedo = 0;
    for (int v = 0; v < HEIGHT; v++)
        for (int u = 0; u < WIDTH; u++) {
            assert_int_equal(s.valid[v][u], 255);
            worst = fmax(worst, normal_error(u, v));
            for (int c = 0; c < 3; c++)
                worst_albedo = fmax(worst_albedo, fabs((double)s.out[3 + c][v][u] / s.albedo[v][u][c] - 1));
        }
    print_message("worst normal %.2g degrees, worst albedo %.2g relative\n", worst, worst_albedo);
    assert_true(worst <= max_deg);
    assert_true(worst_albedo <= max_albedo);
}

static void test_exact_light_gives_exact_normals(void **state)
{
    (void)state;
    begin(0);
    solve();
    check_all(0.002, 5e-5);
    for (int v = 0; v < HEIGHT; v++)
        for (int u = 0; u < WIDTH; u++) {
            assert_true(s.out[6][v][u] < 1e-4F); /* residual */
            assert_true(s.out[7][v][u] > 0.95F); /* confidence */
        }
    end();
}

/* A mosaic whose sites see one colour each: normals as exact, and each site's own albedo. */
static void test_mosaic_needs_no_other_colours(void **state)
{
    (void)state;
    begin(0);
    s.plan.cfa = WEFT_CFA_GBRG;
    for (int j = 0; j < N; j++)
        for (int v = 0; v < HEIGHT; v++)
            for (int u = 0; u < WIDTH; u++)
                s.rgb[j][0][v][u] = s.rgb[j][weft_cfa_colour(WEFT_CFA_GBRG, u, v)][v][u];
    s.clipped[4][20][31] = 1;
    s.rgb[4][0][20][31] = 1e9F;
    solve();
    double worst = 0, worst_albedo = 0;
    for (int v = 0; v < HEIGHT; v++)
        for (int u = 0; u < WIDTH; u++) {
            const double own = s.albedo[v][u][weft_cfa_colour(WEFT_CFA_GBRG, u, v)];
            worst = fmax(worst, normal_error(u, v));
            worst_albedo = fmax(worst_albedo, fabs((double)s.out[3][v][u] / own - 1));
            assert_true(s.out[4][v][u] == 0 && s.out[5][v][u] == 0);
        }
    print_message("worst normal %.2g degrees, worst albedo %.2g relative\n", worst, worst_albedo);
    assert_true(worst < 0.002 && worst_albedo < 5e-5);
    end();
}

static void test_height_of_the_cloth(void **state)
{
    (void)state;
    begin(5);
    solve();
    check_all(0.002, 5e-5);
    end();
}

static void test_half_size_pixels_lie_between_sites(void **state)
{
    (void)state;
    begin(0);
    weft_incidence half;
    assert_ok(weft_incidence_init(&half, &s.cal, WIDTH / 2, HEIGHT / 2, (weft_pixel_scale){2, 0.5}, 0, err));
    const int step = 1 << half.step_log2;
    double point[3];
    dome_point(&s.cal.camera, 2 * 2 * step + 0.5, 2 * 3 * step + 0.5, 0, point);
    const float *const node = half.nodes + (size_t)(3 * half.columns + 2) * (size_t)half.stride;
    assert_near(node[0], point[0], 1e-4);
    assert_near(node[1], point[1], 1e-4);
    weft_incidence_fini(&half);
    end();
}

/* ---- against LAPACK ---- */

static void random_samples(weft_solve_samples *samples, uint64_t *random, double drop)
{
    samples->n_lights = N;
    samples->n_channels = 3;
    for (int k = 0; k < LANES; k++) {
        const double normal[3] = {weft_test_gauss(random) * 0.4, weft_test_gauss(random) * 0.4, 1};
        for (int j = 0; j < N; j++) {
            const double x = weft_test_gauss(random), y = weft_test_gauss(random), z = 1;
            const double length = sqrt(x * x + y * y + z * z);
            const bool use = weft_test_random(random) >= drop;
            double shade = (normal[0] * x + normal[1] * y + normal[2] * z) / length;
            shade = fmax(shade, 0) + 0.02 * weft_test_gauss(random);
            samples->at[j].light[0][k] = (float)(x / length);
            samples->at[j].light[1][k] = (float)(y / length);
            samples->at[j].light[2][k] = (float)(z / length);
            samples->at[j].weight[k] = use;
            for (int c = 0; c < 3; c++)
                samples->at[j].value[c][k] = (float)(use * (0.2 + 0.2 * c) * shade);
            samples->at[j].grey[k] = 0.2126F * samples->at[j].value[0][k] +
                                     0.7152F * samples->at[j].value[1][k] +
                                     0.0722F * samples->at[j].value[2][k];
        }
    }
}

/* Singular value decomposition in double of the rows used.  @return how many there are. */
static int reference(const weft_solve_samples *samples, int k, double scaled[3], double *least_singular)
{
    double a[N * 3], b[N], singular[3];
    int m = 0, rank;
    for (int j = 0; j < N; j++)
        if (samples->at[j].weight[k] > 0) {
            for (int c = 0; c < 3; c++)
                a[3 * m + c] = samples->at[j].light[c][k];
            b[m++] = samples->at[j].grey[k];
        }
    *least_singular = 0;
    if (m < 3)
        return m;
    assert_int_equal(LAPACKE_dgelsd(LAPACK_ROW_MAJOR, m, 3, 1, a, 3, b, 1, singular, 0, &rank), 0);
    memcpy(scaled, b, 3 * sizeof *b);
    *least_singular = singular[2];
    return m;
}

static void agrees_with_lapack(const weft_solve_method *method)
{
    uint64_t random = 4711;
    double worst = 0;
    int compared = 0, refused = 0;
    for (int round = 0; round < 4000; round++) {
        weft_solve_samples samples;
        weft_solve_answers answers;
        random_samples(&samples, &random, round % 2 ? 0 : 0.6);
        method->solve(&samples, &answers);
        for (int k = 0; k < LANES; k++) {
            double scaled[3], singular;
            const int m = reference(&samples, k, scaled, &singular);
            if (m < 3 || singular < 0.0495) {
                assert_true(answers.valid[k] == 0);
                refused++;
            } else if (singular > 0.0505) {
                const double n[3] = {answers.normal[0][k], answers.normal[1][k], answers.normal[2][k]};
                assert_true(answers.valid[k] == 1);
                /* the rows are rounded to float; how much that turns the answer grows with 1/singular */
                worst = fmax(worst, dome_angle_deg(n, scaled) * fmin(1, singular * singular / 0.09));
                compared++;
            }
        }
    }
    print_message("%s: %d pixels, worst difference %.2g degrees, %d refused by both\n", method->name,
                  compared, worst, refused);
    assert_true(compared > 50000 && refused > 500);
    assert_true(worst < 1e-3);
}

static void test_agrees_with_svd(void **state)
{
    (void)state;
    agrees_with_lapack(&weft_method_lsq);
    agrees_with_lapack(&weft_method_svd);
}

/* ---- noise ---- */

static void test_noise_gives_the_predicted_error(void **state)
{
    (void)state;
    begin(0);
    uint64_t random = 99;
    const double sigma = 0.004; /* of I' of a white patch */
    double predicted = 0, found = 0;
    for (int v = 0; v < HEIGHT; v++)
        for (int u = 0; u < WIDTH; u++) {
            double point[3], a[9] = {0};
            dome_point(&s.cal.camera, u, v, 0, point);
            double up[3] = {0, 0, 1};
            for (int j = 0; j < N; j++) {
                const weft_light *const light = &s.cal.lights[j];
                const weft_vec3 d = {light->position.x - point[0], light->position.y - point[1],
                                     light->position.z};
                const weft_vec3 l = weft_normalise(d);
                const double noise = sigma * weft_test_gauss(&random);
                for (int c = 0; c < 3; c++) /* the same relative noise in all channels: grey has it too */
                    s.rgb[j][c][v][u] += (float)(noise * dome_radiance(light, c, point, up, 1) /
                                                 weft_dot(l, (weft_vec3){0, 0, 1}));
                const double row[3] = {l.x, l.y, l.z};
                for (int i = 0; i < 9; i++)
                    a[i] += row[i / 3] * row[i % 3];
            }
            weft_mat3 normal_matrix, c = {{0}};
            memcpy(normal_matrix.m, a, sizeof a);
            assert_true(weft_mat3_invert(&normal_matrix, &c));
            const double *const n = s.normal[v][u];
            const weft_vec3 nv = {n[0], n[1], n[2]};
            const double k =
                0.2126 * s.albedo[v][u][0] + 0.7152 * s.albedo[v][u][1] + 0.0722 * s.albedo[v][u][2];
            const double across = c.m[0] + c.m[4] + c.m[8] - weft_dot(nv, weft_mat3_apply(&c, nv));
            predicted += sigma * sigma * across / (k * k);
        }
    solve();
    for (int v = 0; v < HEIGHT; v++)
        for (int u = 0; u < WIDTH; u++)
            found += pow(normal_error(u, v) / 57.29577951308232, 2);
    const double ratio = sqrt(found / predicted);
    print_message("rms error %.4f degrees, predicted %.4f\n",
                  sqrt(found / (WIDTH * HEIGHT)) * 57.29577951308232,
                  sqrt(predicted / (WIDTH * HEIGHT)) * 57.29577951308232);
    assert_near(ratio, 1, 0.02);
    end();
}

/* ---- edges ---- */

static void test_bad_samples_are_left_out(void **state)
{
    (void)state;
    begin(0);
    s.clipped[3][10][20] = 1;
    s.rgb[3][1][10][20] = 1e6F; /* what a clipped sample says must not matter */
    s.rgb[4][0][10][21] = NAN;
    s.rgb[5][2][10][22] = INFINITY;
    s.rgb[6][2][10][23] = -INFINITY;
    for (int c = 0; c < 3; c++)
        s.rgb[7][c][10][24] = 1e-4F; /* below three sigma of black */
    s.rgb[8][1][10][25] = 900;       /* nearly saturated */
    s.clipped[9][10][WIDTH - 1] = 255;
    s.rgb[9][0][10][WIDTH - 1] = 0;
    least = 1e-3F;
    most = 800;
    solve();
    least = most = 0;
    check_all(0.002, 5e-5);
    end();
}

static void test_too_few_or_badly_placed_lights_give_no_answer(void **state)
{
    (void)state;
    begin(0);
    for (int j = 0; j < N; j++) {
        s.clipped[j][7][100] = j > 1; /* two left */
        s.clipped[j][7][101] = j > 2; /* three left: enough */
        s.clipped[j][7][102] = 1;     /* none */
        for (int c = 0; c < 3; c++)
            s.rgb[j][c][7][103] = NAN;
    }
    solve();
    for (int u = 99; u <= 104; u++) {
        const bool none = u == 100 || u == 102 || u == 103;
        assert_int_equal(s.valid[7][u], none ? 0 : 255);
        for (int i = 0; i < 8; i++)
            assert_true(none ? s.out[i][7][u] == 0 : isfinite(s.out[i][7][u]));
    }
    assert_true(normal_error(101, 7) < 0.002);
    end();
}

static void test_lights_in_one_plane_give_no_answer(void **state)
{
    (void)state;
    weft_solve_samples samples = {.n_lights = 4, .n_channels = 3};
    weft_solve_answers answers;
    for (int k = 0; k < LANES; k++) /* lane k: the fourth light leaves the plane y = 0 by ever more */
        for (int j = 0; j < 4; j++) {
            const double x = -0.6 + 0.4 * j, y = j == 3 ? 0.012 * k : 0, z = 0.8;
            const double length = sqrt(x * x + y * y + z * z);
            samples.at[j].light[0][k] = (float)(x / length);
            samples.at[j].light[1][k] = (float)(y / length);
            samples.at[j].light[2][k] = (float)(z / length);
            samples.at[j].weight[k] = 1;
            for (int c = 0; c < 3; c++)
                samples.at[j].value[c][k] = (float)(z / length);
            samples.at[j].grey[k] = (float)(z / length);
        }
    weft_method_lsq.solve(&samples, &answers);
    for (int k = 0; k < LANES; k++) {
        double singular, a[12], b[4], values[3];
        int rank;
        for (int j = 0; j < 4; j++) {
            for (int c = 0; c < 3; c++)
                a[3 * j + c] = samples.at[j].light[c][k];
            b[j] = samples.at[j].grey[k];
        }
        assert_int_equal(LAPACKE_dgelsd(LAPACK_ROW_MAJOR, 4, 3, 1, a, 3, b, 1, values, 0, &rank), 0);
        singular = values[2];
        assert_true(answers.valid[k] == (singular > 0.05 ? 1 : 0));
    }
    assert_true(answers.valid[0] == 0 && answers.valid[LANES - 1] == 1);
}

static void test_black_pixel_faces_up(void **state)
{
    (void)state;
    begin(0);
    for (int j = 0; j < N; j++)
        for (int c = 0; c < 3; c++)
            s.rgb[j][c][0][0] = 0;
    solve();
    assert_int_equal(s.valid[0][0], 255);
    assert_true(s.out[0][0][0] == 0 && s.out[1][0][0] == 0 && s.out[2][0][0] == 1);
    assert_true(s.out[3][0][0] == 0 && s.out[6][0][0] == 0 && s.out[7][0][0] == 0);
    end();
}

static void test_confidence_falls_with_noise_and_lights(void **state)
{
    (void)state;
    begin(0);
    const int v = 30;
    for (int j = 0; j < N; j++) {
        for (int c = 0; c < 3; c++)
            s.rgb[j][c][v][50] *= j % 2 ? 1.15F : 0.85F;
        s.clipped[j][v][60] = j > 2;
    }
    solve();
    assert_true(s.out[7][v][50] < 0.5F * s.out[7][v][51]);
    assert_true(s.out[7][v][60] < s.out[7][v][61]);
    assert_near(s.out[6][v][50], 0.1, 0.05);
    end();
}

static void test_shadow_rule_leaves_the_dark_out(void **state)
{
    (void)state;
    begin(0);
    for (int c = 0; c < 3; c++)
        s.rgb[2][c][20][77] *= 0.02F; /* a cast shadow */
    solve();
    assert_true(normal_error(77, 20) > 1);
    s.plan.shadow = 0.05F;
    solve();
    check_all(0.002, 5e-5);
    end();
}

static void test_same_bits_on_any_number_of_threads(void **state)
{
    (void)state;
    begin(0);
    static float first[9][HEIGHT][WIDTH];
    static const int threads[] = {1, 2, 7};
    for (int i = 0; i < 3; i++) {
        weft_parallel_set_threads(threads[i]);
        memset(s.out, 0x55, sizeof s.out);
        solve();
        if (i == 0)
            memcpy(first, s.out, sizeof first);
        assert_memory_equal(first, s.out, sizeof first);
    }
    weft_parallel_set_threads(0);
    end();
}

static void test_writes_nothing_past_the_row(void **state)
{
    (void)state;
    begin(0);
    s.plan.width = 37;
    memset(s.out, 0x55, sizeof s.out);
    memset(s.valid, 7, sizeof s.valid);
    solve();
    float guard;
    memset(&guard, 0x55, sizeof guard);
    for (int i = 0; i < 9; i++)
        assert_true(s.out[i][3][37] == guard);
    assert_int_equal(s.valid[3][37], 7);
    assert_int_equal(s.valid[3][36], 255);
    end();
}

static void test_near_lights_need_a_pose(void **state)
{
    (void)state;
    weft_calibration cal;
    weft_incidence incidence = {0};
    dome_init(&cal, 64, 48);
    cal.camera.has_pose = false;
    assert_fails(weft_incidence_init(&incidence, &cal, 64, 48, (weft_pixel_scale){1, 0}, 0, err),
                 WEFT_ERR_MISSING, "weft calibrate lens");
    assert_null(incidence.nodes);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_exact_light_gives_exact_normals),
        cmocka_unit_test(test_mosaic_needs_no_other_colours),
        cmocka_unit_test(test_height_of_the_cloth),
        cmocka_unit_test(test_half_size_pixels_lie_between_sites),
        cmocka_unit_test(test_agrees_with_svd),
        cmocka_unit_test(test_noise_gives_the_predicted_error),
        cmocka_unit_test(test_bad_samples_are_left_out),
        cmocka_unit_test(test_too_few_or_badly_placed_lights_give_no_answer),
        cmocka_unit_test(test_lights_in_one_plane_give_no_answer),
        cmocka_unit_test(test_black_pixel_faces_up),
        cmocka_unit_test(test_confidence_falls_with_noise_and_lights),
        cmocka_unit_test(test_shadow_rule_leaves_the_dark_out),
        cmocka_unit_test(test_same_bits_on_any_number_of_threads),
        cmocka_unit_test(test_writes_nothing_past_the_row),
        cmocka_unit_test(test_near_lights_need_a_pose),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
