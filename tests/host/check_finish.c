/* Flattened detail and height, on surfaces given by a formula. */
#include "tests/support/support.h"

#include "host/solve/finish.h"

#include <math.h>
#include <stdio.h>

enum { WIDTH = 640, HEIGHT = 448 };

#define MM_PER_PX 0.125
#define PI        3.14159265358979323846

/* Weave: 1.6 mm, slopes to 0.4.  Bend: 80 mm, slopes to 0.1. */
static double weave_slope(double mm)
{
    return 0.4 * sin(2 * PI * mm / 1.6);
}

static double bend_slope(double mm)
{
    return 0.1 * cos(2 * PI * mm / 80 + 0.7);
}

static void make_maps(weft_maps *m, double weave, double bend)
{
    *m = (weft_maps){
        .width = WIDTH, .height = HEIGHT, .geometry = WEFT_GEOMETRY_PLANE, .mm_per_px = MM_PER_PX};
    assert_ok(weft_image_init(&m->normal, WIDTH, HEIGHT, 3, err));
    assert_ok(weft_mask_init(&m->mask, WIDTH, HEIGHT, 255, err));
    for (int v = 0; v < HEIGHT; v++)
        for (int u = 0; u < WIDTH; u++) {
            const double x = u * MM_PER_PX, y = -v * MM_PER_PX;
            const double p = weave * weave_slope(x) + bend * bend_slope(x), q = weave * weave_slope(y);
            const double length = sqrt(1 + p * p + q * q);
            const double n[3] = {-p / length, -q / length, 1 / length};
            for (int c = 0; c < 3; c++)
                weft_image_row(&m->normal, c, v)[u] = (float)n[c];
        }
}

static double slope(const weft_maps *m, int c, int u, int v)
{
    return -(double)weft_image_row(&m->normal, c, v)[u] / (double)weft_image_row(&m->normal, 2, v)[u];
}

/* Amplitude of the slopes along x at a wavelength, over whole waves in the middle of the picture. */
static double amplitude(const weft_maps *m, double wavelength_mm, double margin_mm)
{
    const double wave_px = wavelength_mm / MM_PER_PX;
    const int first = (int)(margin_mm / MM_PER_PX);
    const int n = (int)(floor((WIDTH - 2 * first) / wave_px) * wave_px);
    double c = 0, s = 0;
    for (int u = first; u < first + n; u++) {
        c += slope(m, 0, u, HEIGHT / 2) * cos(2 * PI * u / wave_px);
        s += slope(m, 0, u, HEIGHT / 2) * sin(2 * PI * u / wave_px);
    }
    return 2 * hypot(c, s) / n;
}

static void bends_go_and_the_weave_stays(void **state)
{
    (void)state;
    weft_maps both, weave;
    make_maps(&both, 1, 1);
    make_maps(&weave, 1, 0);
    const double before = amplitude(&both, 1.6, 8), bend = amplitude(&both, 80, 0);
    assert_ok(weft_maps_flatten(&both, 20, err));
    const double after = amplitude(&both, 1.6, 8), left = amplitude(&both, 80, 0);
    double squares = 0, detail = 0;
    for (int v = 40; v < HEIGHT - 40; v++)
        for (int u = 80; u < WIDTH - 80; u++) {
            squares += pow(slope(&both, 0, u, v) - slope(&weave, 0, u, v), 2);
            detail += pow(slope(&weave, 0, u, v), 2);
        }
    print_message("weave %.5f to %.5f (%+.3f %%), bend %.4f to %.4f, slopes off by %.2f %% rms\n", before,
                  after, 100 * (after / before - 1), bend, left, 100 * sqrt(squares / detail));
    assert_near(after, before, 0.002 * before);
    assert_true(left < 0.08 * bend);
    assert_true(sqrt(squares / detail) < 0.02);
    for (int u = 0; u < WIDTH; u += 7) { /* unit normals, towards the camera */
        const double x = weft_image_row(&both.normal, 0, 9)[u], y = weft_image_row(&both.normal, 1, 9)[u],
                     z = weft_image_row(&both.normal, 2, 9)[u];
        assert_near(x * x + y * y + z * z, 1, 1e-6);
        assert_true(z > 0);
    }
    weft_maps_fini(&both);
    weft_maps_fini(&weave);
}

/* One half stays at the wavelength that is asked for. */
static void half_stays_at_the_wavelength(void **state)
{
    (void)state;
    weft_maps m;
    make_maps(&m, 0, 0);
    for (int v = 0; v < HEIGHT; v++)
        for (int u = 0; u < WIDTH; u++) {
            const double p = 0.2 * sin(2 * PI * u * MM_PER_PX / 10), over = 1 / sqrt(1 + p * p);
            weft_image_row(&m.normal, 0, v)[u] = (float)(-p * over);
            weft_image_row(&m.normal, 2, v)[u] = (float)over;
        }
    const double before = amplitude(&m, 10, 20);
    assert_ok(weft_maps_flatten(&m, 10, err));
    assert_near(amplitude(&m, 10, 20) / before, 0.5, 0.03);
    assert_fails(weft_maps_flatten(&m, 0.1, err), WEFT_ERR_RANGE, "less than four pixels");
    m.geometry = WEFT_GEOMETRY_SENSOR;
    assert_fails(weft_maps_flatten(&m, 10, err), WEFT_ERR_MISSING, "needs maps of the plane");
    weft_maps_fini(&m);
}

static void height_is_in_mm(void **state)
{
    (void)state;
    static const weft_height_how how[] = {WEFT_HEIGHT_POISSON, WEFT_HEIGHT_RELAX};
    for (int i = 0; i < 2; i++) {
        weft_maps m;
        double squares = 0, truth = 0;
        make_maps(&m, 1, 0);
        assert_ok(weft_maps_integrate(&m, how[i], err));
        assert_int_equal(m.height_mm.planes, 1);
        for (int v = 40; v < HEIGHT - 40; v++)
            for (int u = 40; u < WIDTH - 40; u++) {
                const double a = 0.4 * 1.6 / (2 * PI);
                const double z = -a * (cos(2 * PI * u * MM_PER_PX / 1.6) + cos(2 * PI * v * MM_PER_PX / 1.6));
                squares += pow((double)weft_image_row(&m.height_mm, 0, v)[u] - z, 2);
                truth += z * z;
            }
        print_message("%s: height off by %.3f %% of its rms\n", i ? "relax" : "poisson",
                      100 * sqrt(squares / truth));
        assert_true(sqrt(squares / truth) < (i ? 0.03 : 0.01));
        m.geometry = WEFT_GEOMETRY_SENSOR;
        assert_fails(weft_maps_integrate(&m, how[i], err), WEFT_ERR_MISSING, "needs maps of the plane");
        weft_maps_fini(&m);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(bends_go_and_the_weave_stays),
        cmocka_unit_test(half_stays_at_the_wavelength),
        cmocka_unit_test(height_is_in_mm),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
