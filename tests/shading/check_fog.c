/* Light in the air before the sample, against closed forms and against marches that leave nothing out. */
#include "tests/support/support.h"

#include "shading/brdf/half_vector.h"
#include "shading/lighting/volume_light.h"
#include "shading/preview/preview.h"

#include <math.h>

static weft_preview_surface surface_of(int side)
{
    weft_preview_surface surface = {
        .width = side, .height = side, .mm_per_px = 1, .origin_mm = {-(side - 1) / 2.0, (side - 1) / 2.0}};
    assert_ok(weft_brdf_find("lambert", &surface.brdf, err));
    weft_brdf_defaults(surface.brdf, surface.params);
    return surface;
}

static weft_preview_view view_of(weft_preview_shape shape, int side)
{
    weft_preview_view view = weft_preview_view_defaults();
    view.width = view.height = side;
    view.shape = shape;
    view.background = 0.1;
    view.fog = (weft_preview_fog){.depth = 0.8, .g = 0.6, .steps = 12};
    return view;
}

static double at(const weft_image *picture, int x, int y)
{
    return (double)weft_image_row(picture, 0, y)[x];
}

/* Even light over a plane: p E (1 - e^-tau) before what is left of the cloth, in any density; the blog's
 * mean.
 */
static void test_even_light(void **state)
{
    (void)state;
    weft_preview_surface surface = surface_of(40);
    weft_preview_view view = view_of(WEFT_PREVIEW_PLANE, 40);
    weft_image picture;
    view.exposure_ev = 1;
    weft_preview_direction(70, 35, view.lights[0].direction);
    const double sine = sin(35 * WEFT_PI / 180), p = weft_phase_henyey_greenstein(0.6, -sine);
    const double cloth = surface.params[0] * sine;
    static const double depths[] = {0.8, 30, 1000}; /* the dither may not show, however thick the steps are */
    for (int k = 0; k < 3; k++) {
        const double left = exp(-depths[k]);
        view.fog.depth = depths[k];
        assert_ok(weft_preview_render(&surface, &view, &picture, err));
        for (int i = 0; i < 40 * 40; i++)
            assert_near(at(&picture, i % 40, i / 40), 2 * (left * cloth + p * WEFT_PI * (1 - left)), 1e-4);
        weft_image_fini(&picture);
    }
    view.fog.depth = 0.8;
    view.fog.even = true;
    assert_ok(weft_preview_render(&surface, &view, &picture, err));
    for (int i = 0; i < 28 * 28; i++) /* at the edge the dither is not whole */
        assert_near(at(&picture, 6 + i % 28, 6 + i / 28), 2 * (cloth + 0.8 * p * WEFT_PI), 5e-4);
    weft_image_fini(&picture);
}

/* The ball's shadow in the air, of a lamp from the right: beside it the ray is dark where y^2 + z^2 < 1. */
static double shaft(double y, double p)
{
    const double sigma = 0.4, z = fabs(y) < 1 ? sqrt(1 - y * y) : 0;
    return p * WEFT_PI * (1 - exp(-sigma * (1 - z)) + exp(-sigma * (1 + z)) - exp(-2 * sigma));
}

static void test_shaft_of_the_ball(void **state)
{
    (void)state;
    enum { SIDE = 120 };
    weft_preview_surface surface = surface_of(40);
    weft_preview_view view = view_of(WEFT_PREVIEW_SPHERE, SIDE);
    const double radius = 0.92 * SIDE / 2, p = weft_phase_henyey_greenstein(0.6, 0);
    weft_preview_direction(0, 0, view.lights[0].direction);
    static const struct {
        int steps;
        bool plain;
        double limit;
    } rows[] = {{12, true, 0.02}, {12, false, 0.006}, {100, true, 0.003}, {1000, true, 0.0008}};
    for (size_t k = 0; k < sizeof rows / sizeof rows[0]; k++) {
        weft_image picture;
        double dark = 0, bright = 0;
        int n = 0;
        view.fog.steps = rows[k].steps;
        view.fog.plain = rows[k].plain;
        assert_ok(weft_preview_render(&surface, &view, &picture, err));
        for (int y = 0; y < SIDE; y++)
            for (int x = 0; x < SIDE; x++) {
                const double px = (x + 0.5 - SIDE / 2.0) / radius, py = (SIDE / 2.0 - y - 0.5) / radius;
                /* beside the ball, and not within two places of an edge, over which the picture may blur */
                if (hypot(px, py) < 1.08 || (px < 0 && fabs(fabs(py) - 1) < 0.1))
                    continue;
                const double want = 0.1 * exp(-0.8) + shaft(px < 0 ? py : 1, p);
                const double off = at(&picture, x, y) - want;
                if (px < 0)
                    dark += off * off;
                else
                    bright = fmax(bright, fabs(off));
                n += px < 0;
            }
        dark = sqrt(dark / n);
        print_message(
            "%4d steps, %s: rms %.5f in the ball's shadow (%.3f there at its middle, %.3f in the light)\n",
            rows[k].steps, rows[k].plain ? "plain" : "dithered, half size", dark, shaft(0, p), shaft(1, p));
        assert_true(dark < rows[k].limit);
        assert_true(bright < 2e-3);
        weft_image_fini(&picture);
    }
}

/* The drape under a lamp from the side: a few dithered looks at half size against a thousand at every pixel,
 * and against half as many without dither; turned, too. */
static void test_drape(void **state)
{
    (void)state;
    enum { SIDE = 64 };
    weft_preview_surface surface = surface_of(16);
    for (int turned = 0; turned < 2; turned++) {
        weft_preview_view view = view_of(WEFT_PREVIEW_DRAPE, SIDE);
        weft_image truth, soft, plain;
        double wrong[2] = {0};
        view.n_lights = 1;
        view.lights[0] = (weft_preview_light){.kind = WEFT_PREVIEW_POINT,
                                              .position_mm = {14, 3, 1.5},
                                              .irradiance = {WEFT_PI, WEFT_PI, WEFT_PI}};
        view.turn_rad = 0.8 * turned;
        view.draft = true;
        view.fog.plain = true;
        view.fog.steps = 400;
        assert_ok(weft_preview_render(&surface, &view, &truth, err));
        view.fog.steps = 12;
        assert_ok(weft_preview_render(&surface, &view, &plain, err));
        view.fog.plain = false;
        assert_ok(weft_preview_render(&surface, &view, &soft, err));
        for (int i = 0; i < SIDE * SIDE; i++) {
            wrong[0] += pow((double)(plain.data[i] - truth.data[i]), 2) / (SIDE * SIDE);
            wrong[1] += pow((double)(soft.data[i] - truth.data[i]), 2) / (SIDE * SIDE);
        }
        print_message("drape turned by %.1f: 12 steps from 400: rms %.5f plain, %.5f dithered at half size\n",
                      view.turn_rad, sqrt(wrong[0]), sqrt(wrong[1]));
        assert_true(sqrt(wrong[1]) < 0.01);
        weft_image_fini(&truth);
        weft_image_fini(&soft);
        weft_image_fini(&plain);
    }
}

static void test_refusals(void **state)
{
    (void)state;
    weft_preview_surface surface = surface_of(16);
    weft_preview_view view = view_of(WEFT_PREVIEW_PLANE, 16);
    weft_image picture;
    view.fog.g = 1;
    assert_fails(weft_preview_render(&surface, &view, &picture, err), WEFT_ERR_RANGE, "fog");
    view.fog.g = 0;
    view.fog.steps = 0;
    assert_fails(weft_preview_render(&surface, &view, &picture, err), WEFT_ERR_RANGE, "steps");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_even_light),
        cmocka_unit_test(test_shaft_of_the_ball),
        cmocka_unit_test(test_drape),
        cmocka_unit_test(test_refusals),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
