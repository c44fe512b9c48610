/* What else can lie under the virtual scanner: a sheet out of shape, a white strip, balls; and lamps that
 * drift. */
#include "calibration/lens/lens_model.h"
#include "host/rig/render.h"
#include "tests/support/support.h"

#include <math.h>
#include <string.h>

#define WIDTH  308
#define HEIGHT 204

static weft_rig_scene scene;
static weft_rig_view view;
static weft_rig_sample sample;
static weft_rig_frames frames;

static void render(const weft_rig_setup *setup, const char *name)
{
    assert_ok(weft_rig_scene_init(&scene, setup, err));
    assert_ok(weft_rig_view_sensor(&view, &scene, err));
    assert_ok(weft_rig_sample_init(&sample, &scene, name, err));
    assert_ok(weft_rig_frames_init(&frames, &scene, &view, &sample, err));
}

static void clear(void)
{
    weft_rig_frames_fini(&frames);
    weft_rig_sample_fini(&sample);
    weft_rig_view_fini(&view);
}

static weft_rig_setup small_setup(void)
{
    weft_rig_setup setup;
    weft_rig_setup_init(&setup);
    setup.size = (weft_size){WIDTH, HEIGHT};
    return setup;
}

/* A matte patch of reflectance 0.99 under a lamp, green or what the site has (docs/formats.md). */
static double matte(int lamp, int u, int v, weft_vec3 p, weft_vec3 normal)
{
    const weft_light *const light = &scene.lights[lamp];
    const weft_vec3 d = weft_sub(light->position, p);
    const double r = weft_length(d), off = -weft_dot(light->axis, d) / r;
    const int colour = v % 2 == 0 ? u % 2 : 1 + u % 2;
    return 0.99 * light->intensity[colour] * pow(off, light->exponent) * (weft_dot(normal, d) / r) /
           (r * r * 1e-6) * weft_rig_vignetting(&scene, u, v);
}

/* Where a pixel's ray meets h(x, y), by halving, and the normal there by differences. */
static double height(const weft_rig_sheet *s, double x, double y)
{
    return s->bow_mm[0] * (1 - x * x / (77 * 77)) + s->bow_mm[1] * (1 - y * y / (51 * 51)) +
           tan(s->tilt_deg[0] * 0.0174532925199) * x + tan(s->tilt_deg[1] * 0.0174532925199) * y;
}

static weft_vec3 meet(const weft_rig_sheet *s, int u, int v, weft_vec3 *normal)
{
    double low = -40, high = 40;
    weft_vec3 p = {0};
    for (int i = 0; i < 60; i++) {
        const double z = (low + high) / 2;
        assert_true(weft_camera_to_plane(&scene.camera, u, v, z, &p));
        if (z < height(s, p.x, p.y))
            low = z;
        else
            high = z;
    }
    const double e = 1e-3;
    *normal = weft_normalise((weft_vec3){-(height(s, p.x + e, p.y) - height(s, p.x - e, p.y)) / (2 * e),
                                         -(height(s, p.x, p.y + e) - height(s, p.x, p.y - e)) / (2 * e), 1});
    return p;
}

static void bent_sheets_follow_the_formula(void **state)
{
    (void)state;
    weft_rig_setup setup = small_setup();
    setup.sheet = (weft_rig_sheet){
        .bow_mm = {0.5, -1.5}, .tilt_deg = {2, -3}, .offset_mm = {10, 0}, .size_mm = {100, 0}};
    render(&setup, "white");
    double worst = 0;
    int n_table = 0;
    for (int v = 0; v < HEIGHT; v += 3)
        for (int u = 0; u < WIDTH; u += 3) {
            weft_vec3 normal;
            const weft_vec3 p = meet(&setup.sheet, u, v, &normal);
            const double ratio = (double)frames.light[4][v * WIDTH + u] / matte(4, u, v, p, normal);
            if (fabs(fabs(p.x - 10) - 50) < 1)
                continue; /* its edge */
            if (fabs(p.x - 10) < 50)
                worst = fmax(worst, fabs(ratio - 1));
            else
                n_table += ratio < 0.5;
        }
    print_message("bent sheet: worst relative difference %.1e\n", worst);
    assert_true(worst < 2e-5);
    assert_true(n_table > 1500);
    clear();
}

static void strip_is_white_in_any_scan(void **state)
{
    (void)state;
    weft_rig_setup setup = small_setup();
    memcpy(setup.strip_mm, (double[]){-70, 44, 70, 49}, sizeof setup.strip_mm);
    render(&setup, "satin");
    int n = 0;
    for (int v = 0; v < HEIGHT; v++)
        for (int u = 0; u < WIDTH; u++) {
            weft_vec3 p;
            assert_true(weft_camera_to_plane(&scene.camera, u, v, 0, &p));
            if (fabs(p.x) > 69 || p.y < 45 || p.y > 48)
                continue;
            n++;
            assert_near((double)frames.light[7][v * WIDTH + u] / matte(7, u, v, p, (weft_vec3){0, 0, 1}), 1,
                        2e-5);
        }
    assert_true(n > 1000);
    clear();
}

/* The brightest site of a ball mirrors the lamp into the camera; a lamp's rays that end in a ball leave
 * shade. */
static void balls_mirror_and_shade(void **state)
{
    (void)state;
    const weft_rig_setup setup = small_setup();
    render(&setup, "balls");
    const weft_vec3 eye = weft_camera_centre(&scene.camera);
    for (int lamp = 0; lamp < WEFT_RIG_N_LIGHTS; lamp++)
        for (int b = 0; b < WEFT_RIG_N_BALLS; b++) {
            const weft_vec3 middle = {sample.balls[b].x, sample.balls[b].y, sample.balls[b].radius};
            double best = 0, off = 10;
            for (int v = 0; v < HEIGHT; v += 2)
                for (int u = 1; u < WIDTH; u += 2) { /* green sites */
                    weft_vec3 from, ray;
                    assert_true(weft_camera_ray(&scene.camera, u, v, &from, &ray));
                    const weft_vec3 to = weft_sub(middle, eye);
                    const double along = weft_dot(to, ray), d2 = weft_dot(to, to) - along * along;
                    if (d2 > 144 || (double)frames.light[lamp][v * WIDTH + u] <= best)
                        continue;
                    best = (double)frames.light[lamp][v * WIDTH + u];
                    const weft_vec3 p = weft_add(eye, weft_scale(ray, along - sqrt(144 - d2)));
                    const weft_vec3 n = weft_scale(weft_sub(p, middle), 1 / 12.0);
                    const weft_vec3 out = weft_sub(weft_scale(n, -2 * weft_dot(n, ray)), weft_scale(ray, -1));
                    off = weft_angle_between(out, weft_sub(scene.lights[lamp].position, p)) * 57.29578;
                }
            /* The next green site may be 0.7 mm off: 5 degrees of the normal, 10 of the ray. */
            assert_true(off < 12);
        }
    const weft_vec3 l = scene.lights[0].position, m = {sample.balls[2].x, sample.balls[2].y, 12};
    const weft_vec3 shade =
        weft_add(m, weft_scale(weft_sub(l, m), -12 / (l.z - 12))); /* on the table, under it */
    double u, v;
    assert_true(weft_camera_project(&scene.camera, shade, &u, &v));
    assert_near((double)frames.light[0][(int)(v + 0.5) * WIDTH + (int)(u + 0.5)], 0, 1e-9);
    clear();
}

static void lamps_drift_between_samples(void **state)
{
    (void)state;
    weft_rig_setup setup = small_setup();
    setup.light_drift = 0.01;
    assert_ok(weft_rig_scene_init(&scene, &setup, err));
    double sum = 0, sum2 = 0;
    char name[16];
    for (int k = 0; k < 100; k++) {
        snprintf(name, sizeof name, "sample %d", k);
        for (int i = 0; i < WEFT_RIG_N_LIGHTS; i++) {
            const double drift = weft_rig_drift(&scene, name, i) - 1;
            assert_true(drift == weft_rig_drift(&scene, name, i) - 1);
            sum += drift / 1000;
            sum2 += drift * drift / 1000;
            assert_true(weft_rig_drift(&scene, "white", i) == 1);
        }
    }
    assert_near(sum, 0, 0.001);
    assert_near(sqrt(sum2), 0.01, 0.0007);
}

/* How far (x, y) is from the crease's line, mm. */
static double from_crease(double x, double y)
{
    const weft_rig_crease *const c = &sample.damage.crease;
    return (x - (double)c->x) * (double)c->across_x + (y - (double)c->y) * (double)c->across_y;
}

/* Tears are as large as their formula says and as dark as velvet; the crease leans to both sides as it
 * should; lint is dark on a light cloth. */
static void damage_is_what_the_formulas_say(void **state)
{
    (void)state;
    const weft_rig_setup setup = small_setup();
    weft_rig_truth truth;
    render(&setup, "plain-weave+flaws");
    assert_ok(weft_rig_truth_maps(&scene, &view, &sample, &truth, err));
    const weft_rig_damage *const damage = &sample.damage;
    const size_t n = (size_t)WIDTH * HEIGHT;
    double bare_mm2 = 0, tears_mm2 = 0, lean[2] = {0}, albedo[2] = {0}, lit[2] = {0}, flagged[2] = {0};
    size_t count[2] = {0}, lint = 0;
    for (int i = 0; i < WEFT_RIG_N_TEARS; i++) /* integral of 2 w (1 - (a / l)^2) */
        tears_mm2 += 8.0 / 3 * (double)(damage->tears[i].half_width * damage->tears[i].half_length);
    for (size_t i = 0; i < n; i++) {
        const double x = (double)view.ground.data[i], y = (double)view.ground.data[n + i];
        const double d = from_crease(x, y), alpha = (double)truth.alpha.data[i];
        bare_mm2 += (1 - alpha) * 0.5 * 0.5;
        if (fabs(d) > 1 && fabs(d) < 2) {
            lean[d > 0] += (double)truth.normal.data[i] * (double)damage->crease.across_x +
                           (double)truth.normal.data[n + i] * (double)damage->crease.across_y;
            count[d > 0]++;
        }
        lit[alpha == 0] += (double)frames.light[9][i];
        flagged[alpha == 0]++;
        const bool is_lint = truth.flaws.data[i] & WEFT_FLAW_LINT;
        lint += is_lint;
        albedo[is_lint] += (double)truth.albedo.data[n + i];
        assert_true(alpha == 1 || truth.flaws.data[i] & WEFT_FLAW_TEAR);
    }
    const double fold = lean[1] / (double)count[1] - lean[0] / (double)count[0];
    print_message("damage: %.2f mm2 bare, formula %.2f; crease leans by %.3f; %zu px of lint\n", bare_mm2,
                  tears_mm2, fold, lint);
    assert_near(bare_mm2 / tears_mm2, 1, 0.05);
    assert_near(fold, 2 * 0.147, 0.04); /* 0.9 / 4 exp(-1.55 / 4) 1.5 / 1.55 */
    assert_true(lit[1] / flagged[1] < 0.1 * lit[0] / flagged[0]);
    assert_true(lint > 60 && albedo[1] / (double)lint < 0.9 * albedo[0] / (double)(n - lint));
    weft_rig_truth_fini(&truth);
    clear();
}

/* Yarns cover 0.45 of their pitch both ways: 1 - 0.55^2 = 0.70, less what their width varies by. */
static void lace_is_open(void **state)
{
    (void)state;
    const weft_rig_setup setup = small_setup();
    weft_rig_truth truth;
    render(&setup, "lace");
    assert_ok(weft_rig_truth_maps(&scene, &view, &sample, &truth, err));
    const size_t n = (size_t)WIDTH * HEIGHT;
    double cover = 0;
    for (size_t i = 0; i < n; i++)
        cover += (double)truth.alpha.data[i] / (double)n;
    print_message("lace: %.3f covered\n", cover);
    assert_near(cover, 0.685, 0.02);
    assert_null(truth.flaws.data);
    weft_rig_truth_fini(&truth);
    clear();
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(bent_sheets_follow_the_formula),  cmocka_unit_test(strip_is_white_in_any_scan),
        cmocka_unit_test(balls_mirror_and_shade),          cmocka_unit_test(lamps_drift_between_samples),
        cmocka_unit_test(damage_is_what_the_formulas_say), cmocka_unit_test(lace_is_open),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
