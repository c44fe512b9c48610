/* Shadows of many looks: a wall's penumbra under a round lamp by its closed form, and frames that remember.
 */
#include "tests/support/support.h"

#include "shading/brdf/half_vector.h"
#include "shading/preview/preview_history.h"

#include <math.h>
#include <string.h>

enum { WIDE = 160, HIGH = 16, WALL = 110 };

/* A wall 20 texels high, from WALL on. */
static weft_image wall_height(void)
{
    weft_image height;
    assert_ok(weft_image_init(&height, WIDE, HIGH, 1, err));
    for (int y = 0; y < HIGH; y++)
        for (int x = WALL; x < WIDE; x++)
            weft_image_row(&height, 0, y)[x] = 20;
    return height;
}

static weft_preview_surface surface_of(const weft_image *height)
{
    weft_preview_surface surface = {
        .width = height->width, .height = height->height, .mm_per_px = 1, .height_mm = height};
    assert_ok(weft_brdf_find("lambert", &surface.brdf, err));
    weft_brdf_defaults(surface.brdf, surface.params);
    return surface;
}

/* The share of light: a picture with shadows over one without. */
static void shares(const weft_preview_surface *surface, weft_preview_view view, float *share)
{
    weft_image with, without;
    assert_ok(weft_preview_render(surface, &view, &with, err));
    memset(&view.shadows, 0, sizeof view.shadows);
    assert_ok(weft_preview_render(surface, &view, &without, err));
    for (int i = 0; i < view.width * view.height; i++)
        share[i] = with.data[i] / without.data[i];
    weft_image_fini(&with);
    weft_image_fini(&without);
}

/* How much of a disc is above a wall whose upper edge is q radii above its middle. */
static double above(double q)
{
    return q <= -1 ? 1 : q >= 1 ? 0 : (acos(q) - q * sqrt(1 - q * q)) / WEFT_PI;
}

/* From the closed form, over the ground before the wall; the light comes from the right at 30 degrees. */
static double penumbra_rms(const float *share, double disc_rad)
{
    double sum = 0;
    int n = 0;
    for (int y = HIGH / 2 - 4; y < HIGH / 2 + 4; y++)
        for (int x = 30; x < WALL - 4; x++, n++) {
            const double angle = atan2(20, WALL - x);
            sum += pow((double)share[y * WIDE + x] - above((angle - WEFT_PI / 6) / disc_rad), 2);
        }
    return sqrt(sum / n);
}

static weft_preview_view wall_view(double disc_rad)
{
    weft_preview_view view = weft_preview_view_defaults();
    view.width = WIDE;
    view.height = HIGH;
    view.shadows.relief = true;
    view.shadows.steps = 96;
    view.shadows.disc_rad = disc_rad;
    weft_preview_direction(0, 30, view.lights[0].direction);
    return view;
}

static void test_penumbra(void **state)
{
    (void)state;
    static float share[WIDE * HIGH];
    weft_image height = wall_height();
    const weft_preview_surface surface = surface_of(&height);
    weft_preview_view view = wall_view(0.06);
    static const int looks[] = {1, 4, 16, 64};
    double rms[4];
    for (int k = 0; k < 4; k++) {
        view.shadows.accumulate = looks[k];
        shares(&surface, view, share);
        rms[k] = penumbra_rms(share, 0.06);
        print_message("%d looks: rms %.4f from the closed form of the penumbra\n", looks[k], rms[k]);
    }
    assert_true(rms[0] > 0.05 && rms[1] < 0.5 * rms[0] && rms[2] < 0.5 * rms[1]);
    assert_true(rms[3] < 0.008);
    weft_image_fini(&height);
}

/* A lamp that jumps is not shaded by where it was: as if nothing had been before.  A small step blends. */
static void test_jumping_lamp(void **state)
{
    (void)state;
    static float share[WIDE * HIGH], alone[WIDE * HIGH];
    weft_image height = wall_height();
    const weft_preview_surface surface = surface_of(&height);
    weft_preview_view view = wall_view(0.0047);
    weft_preview_history history = {0}, fresh = {.frame = 5};
    view.shadows.history = &history;
    for (int frame = 0; frame < 5; frame++)
        shares(&surface, view, share);
    assert_int_equal(history.n_frames, 5);
    weft_preview_direction(0, 31.1, view.lights[0].direction);
    shares(&surface, view, share);
    assert_int_equal(history.n_frames, 1);
    view.shadows.history = &fresh;
    shares(&surface, view, alone);
    for (int i = 0; i < WIDE * HIGH; i++)
        assert_near((double)share[i], (double)alone[i], 0);
    weft_preview_direction(0, 32, view.lights[0].direction);
    shares(&surface, view, alone);
    assert_int_equal(fresh.n_frames, 2);
    weft_preview_history_fini(&fresh);
    weft_preview_history_fini(&history);
    weft_image_fini(&height);
}

/* A relief of round bumps. */
static weft_image bumps(void)
{
    weft_image height;
    assert_ok(weft_image_init(&height, 64, 64, 1, err));
    for (int y = 0; y < 64; y++)
        for (int x = 0; x < 64; x++)
            height.data[y * 64 + x] = (float)(6 * fmax(0, sin(x * WEFT_PI / 8) * sin(y * WEFT_PI / 8)));
    return height;
}

static double difference(const weft_image *a, const weft_image *b)
{
    double sum = 0;
    for (size_t i = 0; i < weft_image_plane_size(a); i++)
        sum += pow((double)(a->data[i] - b->data[i]), 2) / (double)weft_image_plane_size(a);
    return sqrt(sum);
}

enum { LAST = 19 };

/* Twenty frames of a sample that turns by `step` with its lamp: root mean square of what two frames differ by
 * (flicker, for nothing on the sample changes), and of the last from many looks. */
static void run_frames(weft_preview_shape shape, double fov_deg, double step,
                       const weft_preview_surface *surface, bool remembers, double *flicker, double *wrong)
{
    weft_preview_view view = weft_preview_view_defaults();
    weft_preview_history history = {0};
    weft_image picture = {0}, before = {0}, truth;
    view.width = view.height = 64;
    view.shape = shape;
    view.fov_deg = fov_deg;
    view.shadows.relief = true;
    view.shadows.blur = WEFT_PREVIEW_BLUR_ALWAYS;
    view.shadows.steps = 3;
    view.shadows.disc_rad = 0.0047;
    for (int frame = remembers ? 0 : LAST - 1; frame <= LAST; frame++) {
        static const double from[3] = {0.8, 0.4, 0.447};
        const double turn = view.turn_rad = frame * step;
        double *const to = view.lights[0].direction;
        const int b = shape == WEFT_PREVIEW_PLANE ? 1 : 2;
        const double sine = b == 1 ? sin(turn) : -sin(turn);
        to[0] = cos(turn) * from[0] - sine * from[b];
        to[b] = sine * from[0] + cos(turn) * from[b];
        to[3 - b] = from[3 - b];
        weft_preview_history single = {.frame = frame};
        view.shadows.history = remembers ? &history : &single;
        weft_image_fini(&before);
        before = picture;
        assert_ok(weft_preview_render(surface, &view, &picture, err));
        weft_preview_history_fini(&single);
    }
    *flicker = difference(&picture, &before);
    view.shadows.history = NULL;
    view.shadows.accumulate = 32;
    assert_ok(weft_preview_render(surface, &view, &truth, err));
    *wrong = difference(&picture, &truth);
    weft_image_fini(&picture);
    weft_image_fini(&before);
    weft_image_fini(&truth);
    weft_preview_history_fini(&history);
}

static void test_frames(void **state)
{
    (void)state;
    weft_image height = bumps();
    const weft_preview_surface surface = surface_of(&height);
    static const struct {
        weft_preview_shape shape;
        double fov_deg, step;
    } rows[] = {{WEFT_PREVIEW_PLANE, 0, 0},       {WEFT_PREVIEW_PLANE, 0, 0.002},
                {WEFT_PREVIEW_SPHERE, 0, 0},      {WEFT_PREVIEW_SPHERE, 0, 0.005},
                {WEFT_PREVIEW_SPHERE, 40, 0.005}, {WEFT_PREVIEW_CYLINDER, 0, 0.005}};
    for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++) {
        double flicker[2], wrong[2];
        for (int k = 0; k < 2; k++)
            run_frames(rows[i].shape, rows[i].fov_deg, rows[i].step, &surface, k == 1, &flicker[k],
                       &wrong[k]);
        print_message(
            "shape %d, field %2.0f, turned by %.3f: flicker %.4f without memory, %.4f with it; rms %.4f, "
            "%.4f\n",
            (int)rows[i].shape, rows[i].fov_deg, rows[i].step, flicker[0], flicker[1], wrong[0], wrong[1]);
        /* what is remembered from another place would be wrong by ten times as much */
        assert_true(flicker[1] < (rows[i].step > 0 ? 1 : 0.15) * flicker[0]);
        assert_true(wrong[1] < (rows[i].step > 0 ? 1.5 : 0.3) * wrong[0]);
    }
    weft_image_fini(&height);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_penumbra),
        cmocka_unit_test(test_jumping_lamp),
        cmocka_unit_test(test_frames),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
