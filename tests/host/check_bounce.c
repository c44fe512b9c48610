/*
 * Light from yarn to yarn: a corrugated cloth whose valleys are lit by their walls, ray by ray.
 *
 * The reference knows nothing of openness: rays leave each point over its own hemisphere, find the wall they
 * meet, and bring the light that the lamps put there.
 */
#include "tests/support/support.h"

#include "host/solve/bounce.h"
#include "host/solve/samples.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum {
    WIDTH = 192,
    HEIGHT = 32,
    PERIOD = 24,
    FINE = 4,
    POINTS = PERIOD * FINE,
    N = 10,
    RAYS = 24,
    STEPS = 200
};

static const double pi = 3.14159265358979323846;

#define PIXEL_MM 0.125
#define ALBEDO   0.6

typedef struct profile {
    double swing_mm;
    double direct[N][POINTS], bounced[N][POINTS]; /* irradiance over that of a patch facing the lamp */
} profile;

static double wave(double x_px)
{
    return cos(2 * pi * x_px / PERIOD);
}

static double height_mm(const profile *p, double x_px)
{
    return p->swing_mm * wave(x_px);
}

static double slope(const profile *p, double x_px)
{
    return -p->swing_mm * 2 * pi / (PERIOD * PIXEL_MM) * sin(2 * pi * x_px / PERIOD);
}

static void lamp(int j, double l[3])
{
    const double up = (j < 6 ? 35 : j < 9 ? 60 : 80) * pi / 180;
    const double around = (j < 6 ? 60.0 * j : j < 9 ? 120.0 * (j - 6) + 30 : 200) * pi / 180;
    l[0] = cos(up) * cos(around);
    l[1] = cos(up) * sin(around);
    l[2] = sin(up);
}

/* Where a ray from x meets the cloth, in pixels; false when it leaves. */
static bool meets(const profile *p, double x_px, double dx, double dz, double *at_px)
{
    const double z = height_mm(p, x_px), far_px = 3 * PERIOD;
    const double per_px = dz / (fabs(dx) + 1e-9) * PIXEL_MM;
    for (int i = 1; i < STEPS; i++) {
        const double away = far_px * i / STEPS, x = x_px + (dx < 0 ? -away : away);
        if (z + away * per_px > p->swing_mm + 1e-9)
            return false;
        if (z + away * per_px < height_mm(p, x) - 1e-9) {
            *at_px = x;
            return true;
        }
    }
    return false;
}

static void light_directly(profile *p)
{
    for (int j = 0; j < N; j++)
        for (int i = 0; i < POINTS; i++) {
            double l[3], at;
            lamp(j, l);
            const double x = (double)i / FINE, s = slope(p, x);
            const double facing = (-s * l[0] + l[2]) / sqrt(1 + s * s);
            p->direct[j][i] = facing > 0 && !meets(p, x, l[0], l[2], &at) ? facing : 0;
        }
}

/* One bounce over the hemisphere of each point's normal; the cloth is the same along y. */
static void light_by_walls(profile *p)
{
    for (int i = 0; i < POINTS; i++) {
        const double x = (double)i / FINE, s = slope(p, x), length = sqrt(1 + s * s);
        const double n[2] = {-s / length, 1 / length};
        double sum[N] = {0};
        for (int a = 0; a < RAYS; a++)
            for (int b = 0; b < 2 * RAYS; b++) { /* cosine-weighted: equal parts of the disc */
                const double r = sqrt((a + 0.5) / RAYS), turn = 2 * pi * (b + 0.5) / (2 * RAYS);
                const double across = r * cos(turn), out = sqrt(1 - r * r);
                const double dx = across * n[1] + out * n[0], dz = -across * n[0] + out * n[1];
                double at;
                if (!meets(p, x, dx, dz, &at))
                    continue;
                const int hit = (int)lround(at * FINE) % POINTS;
                for (int j = 0; j < N; j++)
                    sum[j] += p->direct[j][(hit + POINTS) % POINTS];
            }
        for (int j = 0; j < N; j++)
            p->bounced[j][i] = ALBEDO * sum[j] / (RAYS * 2 * RAYS);
    }
}

/* Least squares over the lit lamps of each column, with and without the bounce. */
static void solve(const profile *p, bool bounce, weft_maps *m)
{
    for (int u = 0; u < WIDTH; u++) {
        weft_solve_samples s = {.n_lights = N, .n_channels = 1};
        weft_solve_answers a, searched;
        for (int j = 0; j < N; j++)
            for (int k = 0; k < WEFT_SOLVE_LANES; k++) {
                double l[3];
                const int i = u * FINE % POINTS;
                lamp(j, l);
                for (int c = 0; c < 3; c++)
                    s.at[j].light[c][k] = (float)l[c];
                s.at[j].grey[k] = (float)(ALBEDO * (p->direct[j][i] + (bounce ? p->bounced[j][i] : 0)));
                s.at[j].value[0][k] = s.at[j].grey[k];
                s.at[j].weight[k] = 1;
            }
        weft_method_robust.solve(&s, &a);
        weft_method_robust.search(&s, &searched);
        const weft_solve_answers *const use = a.search[0] > 0 ? &searched : &a;
        for (int v = 0; v < HEIGHT; v++) {
            for (int c = 0; c < 3; c++) {
                weft_image_row(&m->normal, c, v)[u] = use->normal[c][0];
                weft_image_row(&m->albedo, c, v)[u] = use->albedo[0][0];
            }
            m->mask.data[v * WIDTH + u] = 255;
        }
    }
}

typedef struct figures {
    double normal_deg, albedo;
} figures;

static figures measure(const profile *p, const weft_maps *m)
{
    figures f = {0};
    const int first = PERIOD, last = WIDTH - PERIOD; /* the edges see no walls beyond them */
    for (int u = first; u < last; u++) {
        const double s = slope(p, u), length = sqrt(1 + s * s);
        const double x = weft_image_row(&m->normal, 0, HEIGHT / 2)[u],
                     z = weft_image_row(&m->normal, 2, HEIGHT / 2)[u];
        f.normal_deg += fabs(atan2(x, z) - atan2(-s / length, 1 / length)) * 180 / pi / (last - first);
        f.albedo += fabs((double)weft_image_row(&m->albedo, 0, HEIGHT / 2)[u] / ALBEDO - 1) / (last - first);
    }
    return f;
}

static void make_maps(weft_maps *m)
{
    *m = (weft_maps){.width = WIDTH, .height = HEIGHT, .geometry = WEFT_GEOMETRY_SENSOR};
    assert_ok(weft_image_init(&m->normal, WIDTH, HEIGHT, 3, err));
    assert_ok(weft_image_init(&m->albedo, WIDTH, HEIGHT, 3, err));
    assert_ok(weft_mask_init(&m->mask, WIDTH, HEIGHT, 0, err));
}

static void test_valleys_lit_by_their_walls(void **state)
{
    (void)state;
    static profile p;
    static const double steepest_deg[3] = {20, 30, 40};
    for (int i = 0; i < 3; i++)
        for (int rgb = 0; rgb < 2; rgb++) {
            weft_maps m;
            weft_bounce_report report = {0};
            p.swing_mm = tan(steepest_deg[i] * pi / 180) * PERIOD * PIXEL_MM / (2 * pi);
            light_directly(&p);
            light_by_walls(&p);
            make_maps(&m);
            solve(&p, true, &m);
            const figures before = measure(&p, &m);
            assert_ok(weft_bounce_take_off(&m, rgb ? WEFT_CFA_NONE : WEFT_CFA_RGGB, PIXEL_MM, &report, err));
            const figures after = measure(&p, &m);
            print_message(
                "slopes to %2.0f degrees: normal %.3f to %.3f degrees, albedo %.4f to %.4f, open %.3f\n",
                steepest_deg[i], before.normal_deg, after.normal_deg, before.albedo, after.albedo,
                report.openness);
            assert_true(report.done);
            assert_true(after.normal_deg < 0.8 * before.normal_deg);
            assert_true(after.albedo < 0.5 * before.albedo);
            weft_maps_fini(&m);
        }
}

static void test_flat_cloth_stays_what_it_is(void **state)
{
    (void)state;
    weft_maps m;
    weft_bounce_report report = {0};
    make_maps(&m);
    for (int i = 0; i < WIDTH * HEIGHT; i++) {
        weft_image_plane(&m.normal, 2)[i] = 1;
        weft_image_plane(&m.albedo, 0)[i] = 0.5F;
        m.mask.data[i] = i % 97 ? 255 : 0;
    }
    assert_ok(weft_bounce_take_off(&m, WEFT_CFA_RGGB, PIXEL_MM, &report, err));
    assert_near(report.openness, 1, 1e-5);
    for (int i = 0; i < WIDTH * HEIGHT; i++) {
        assert_near((double)weft_image_plane(&m.normal, 2)[i], 1, 1e-6);
        assert_near((double)weft_image_plane(&m.albedo, 0)[i], 0.5, 1e-5);
    }
    weft_maps_fini(&m);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_valleys_lit_by_their_walls),
        cmocka_unit_test(test_flat_cloth_stays_what_it_is),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
