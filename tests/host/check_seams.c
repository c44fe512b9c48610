/* Straight seams between two surfaces, painted with the exact share of each pixel: what is stated beside what
 * the mean weighted by albedo is off by. */
#include "tests/support/support.h"

#include "core/mem.h"
#include "host/solve/seams.h"

#include <math.h>
#include <string.h>

enum { SIDE = 9, MIDDLE = 4, FINE = 16 };

static const double degrees = 57.29577951308232;

typedef struct surface {
    double albedo, normal[3];
} surface;

static surface tilted(double albedo, double degrees_x)
{
    const double angle = degrees_x / degrees;
    return (surface){albedo, {sin(angle), 0, cos(angle)}};
}

static void make_maps(weft_maps *m)
{
    *m = (weft_maps){.width = SIDE, .height = SIDE};
    assert_ok(weft_image_init(&m->normal, SIDE, SIDE, 3, err));
    assert_ok(weft_image_init(&m->albedo, SIDE, SIDE, 3, err));
    assert_ok(weft_image_init(&m->uncertainty, SIDE, SIDE, 1, err));
    assert_ok(weft_mask_init(&m->mask, SIDE, SIDE, 255, err));
}

/* A pixel as the solver sees it, `share` of it covered by surface a.  @return degrees off the area's mean */
static double paint(weft_maps *m, int u, int v, const surface *a, const surface *b, double share)
{
    double seen[3], area[3], length = 0, mean = 0, dot = 0;
    for (int c = 0; c < 3; c++) {
        seen[c] = share * a->albedo * a->normal[c] + (1 - share) * b->albedo * b->normal[c];
        area[c] = share * a->normal[c] + (1 - share) * b->normal[c];
        length += seen[c] * seen[c];
        mean += area[c] * area[c];
    }
    for (int c = 0; c < 3; c++) {
        weft_image_row(&m->normal, c, v)[u] = (float)(seen[c] / sqrt(length));
        weft_image_row(&m->albedo, c, v)[u] = (float)sqrt(length);
        dot += seen[c] * area[c];
    }
    return degrees * acos(fmin(1, dot / sqrt(length * mean)));
}

/* Share of a pixel on one side of a line through (at, MIDDLE). */
static double covered(int u, int v, double at, double angle)
{
    int inside = 0;
    for (int i = 0; i < FINE * FINE; i++) {
        const double x = u - 0.5 + (i % FINE + 0.5) / FINE - at,
                     y = v - 0.5 + (i / FINE + 0.5) / FINE - MIDDLE;
        inside += x * cos(angle) + y * sin(angle) < 0;
    }
    return (double)inside / (FINE * FINE);
}

/* Over all places of seams of a contrast: rms error over rms of what is stated. */
static double measured_over_stated(double albedo, double apart)
{
    const surface dark = tilted(0.1, -apart / 2), bright = tilted(albedo, apart / 2);
    double measured2 = 0, stated2 = 0;
    weft_maps m;
    make_maps(&m);
    for (int i = 0; i < 150; i++) {
        const double at = MIDDLE - 3 + 6 * (i + 0.5) / 150, angle = 2.39996 * i;
        double error = 0;
        for (int v = MIDDLE - 1; v <= MIDDLE + 1; v++)
            for (int u = MIDDLE - 1; u <= MIDDLE + 1; u++) {
                const double off = paint(&m, u, v, &bright, &dark, covered(u, v, at, angle));
                error = u == MIDDLE && v == MIDDLE ? off : error;
            }
        memset(m.uncertainty.data, 0, SIDE * SIDE * sizeof(float));
        weft_seams_doubt(&m);
        measured2 += error * error;
        stated2 += pow((double)weft_image_row(&m.uncertainty, 0, MIDDLE)[MIDDLE], 2);
    }
    weft_maps_fini(&m);
    return sqrt(measured2 / stated2);
}

static void seams_are_as_wrong_as_stated(void **state)
{
    (void)state;
    static const double albedos[] = {0.11, 0.3, 0.9}, apart[] = {4, 40};
    for (int i = 0; i < 6; i++) {
        const double ratio = measured_over_stated(albedos[i / 2], apart[i % 2]);
        print_message("albedos 0.1 and %.2f, %.0f degrees apart: rms error over stated %.3f\n",
                      albedos[i / 2], apart[i % 2], ratio);
        assert_true(ratio > 0.9 && ratio < 1.1);
    }
}

static void nothing_is_added_without_a_seam(void **state)
{
    (void)state;
    weft_maps m;
    make_maps(&m);
    for (int v = 0; v < SIDE; v++)
        for (int u = 0; u < SIDE; u++) {
            const surface s = v < 3 ? tilted(u < 4 ? 0.1 : 0.6, 10) /* one normal, two albedos */
                                    : tilted(0.3, 5.0 * u);         /* one albedo, curved */
            paint(&m, u, v, &s, &s, 1);
            weft_image_row(&m.uncertainty, 0, v)[u] = 0.4F;
        }
    weft_seams_doubt(&m);
    for (int v = 0; v < SIDE; v++)
        for (int u = 0; u < SIDE; u++)
            if (v < 2 || v > 3)
                assert_near(weft_image_row(&m.uncertainty, 0, v)[u], 0.4, 1e-3);
    weft_maps_fini(&m);
}

static void holes_have_no_say(void **state)
{
    (void)state;
    const surface one = tilted(0.3, 10);
    weft_maps m;
    make_maps(&m);
    for (int v = 0; v < SIDE; v++)
        for (int u = 0; u < SIDE; u++) {
            const bool hole = (u + 2 * v) % 5 == 0;
            paint(&m, u, v, &one, &one, 1);
            for (int c = 0; c < 3 && hole; c++)
                weft_image_row(&m.normal, c, v)[u] = weft_image_row(&m.albedo, c, v)[u] = 0;
            m.mask.data[v * SIDE + u] = hole ? 0 : 255;
            weft_image_row(&m.uncertainty, 0, v)[u] = hole ? 0 : 0.4F;
        }
    weft_seams_doubt(&m);
    for (int i = 0; i < SIDE * SIDE; i++)
        assert_near(m.uncertainty.data[i], m.mask.data[i] ? 0.4 : 0, 1e-5);
    weft_maps_fini(&m);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(seams_are_as_wrong_as_stated),
        cmocka_unit_test(nothing_is_added_without_a_seam),
        cmocka_unit_test(holes_have_no_say),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
