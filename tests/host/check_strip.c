/* The white strip: drift of each lamp and colour, and what is refused, on plates made by the light model's
 * formula. */
#include "calibration/lens/lens_model.h"
#include "calibration/lights/light_model.h"
#include "host/solve/strip.h"
#include "tests/host/dome.h"
#include "tests/support/support.h"

#include <math.h>
#include <string.h>

enum { WIDTH = 616, HEIGHT = 408 };

static weft_calibration cal;
static weft_light_plates plates;
static const weft_strip strip = {.rect_px = {20, 10, 595, 30}, .reflectance = 0.9};
static const weft_pixel_scale full = {1, 0};

/* What light `as` gives times `gain[colour]`, into the plate of `light`. */
static void fill(int light, int as, const double gain[3], double noise, uint64_t *seed)
{
    static const double up[3] = {0, 0, 1};
    weft_plate *const plate = &plates.plate[light];
    for (int v = 0; v < HEIGHT; v++)
        for (int u = 0; u < WIDTH; u++) {
            double point[3];
            const int c = weft_cfa_colour(WEFT_CFA_RGGB, u, v);
            if (v < 8 || v > 32)
                continue;
            dome_point(&cal.camera, u, v, 0, point);
            weft_image_row(&plate->image, 0, v)[u] =
                (float)(gain[c] * dome_radiance(&cal.lights[as], c, point, up, 0.9) *
                        (1 + noise * weft_test_gauss(seed)));
        }
}

static int set_up(void **state)
{
    (void)state;
    uint64_t seed = 3;
    static const double one[3] = {1, 1, 1};
    dome_init(&cal, WIDTH, HEIGHT);
    plates = (weft_light_plates){.n = cal.n_lights, .width = WIDTH, .height = HEIGHT, .cfa = WEFT_CFA_RGGB};
    for (int l = 0; l < cal.n_lights; l++) {
        plates.plate[l].cfa = WEFT_CFA_RGGB;
        assert_ok(weft_image_init(&plates.plate[l].image, WIDTH, HEIGHT, 1, err));
        assert_ok(weft_mask_init(&plates.plate[l].clipped, WIDTH, HEIGHT, 0, err));
        fill(l, l, one, 0.01, &seed);
    }
    return 0;
}

static int tear_down(void **state)
{
    (void)state;
    weft_light_plates_fini(&plates);
    weft_calibration_fini(&cal);
    return 0;
}

static void drift_is_measured(void **state)
{
    (void)state;
    uint64_t seed = 9;
    weft_strip_drift drift;
    fill(3, 3, (double[]){1.02, 0.99, 1.01}, 0.01, &seed);
    assert_ok(weft_strip_measure(&plates, full, &cal, &strip, &drift, err));
    assert_near(drift.gain[3][0], 1.02, 0.001);
    assert_near(drift.gain[3][1], 0.99, 0.001);
    assert_near(drift.gain[3][2], 1.01, 0.001);
    assert_near(drift.gain[8][1], 1, 0.001);
    assert_true(drift.sigma > 5e-5 && drift.sigma < 5e-4);
    fill(3, 3, (double[]){1, 1, 1}, 0.01, &seed);
}

static void what_is_no_drift_is_refused(void **state)
{
    (void)state;
    uint64_t seed = 9;
    weft_strip_drift drift;
    static const double one[3] = {1, 1, 1};
    fill(2, 5, one, 0.01, &seed);
    assert_fails(weft_strip_measure(&plates, full, &cal, &strip, &drift, err), WEFT_ERR_MISMATCH,
                 "light 2: on the white strip it looks like light 5");
    fill(2, 2, (double[]){0.6, 0.6, 0.6}, 0.01, &seed);
    assert_fails(weft_strip_measure(&plates, full, &cal, &strip, &drift, err), WEFT_ERR_MISMATCH,
                 "light 2: gives 0.60 times the light");
    fill(2, 2, one, 0.01, &seed);
    for (int v = 8; v < 32; v++) /* a thumb on its end */
        for (int u = 0; u < 90; u++)
            weft_image_row(&plates.plate[4].image, 0, v)[u] *= 0.8F;
    assert_fails(weft_strip_measure(&plates, full, &cal, &strip, &drift, err), WEFT_ERR_MISMATCH,
                 "light 4: the white strip is uneven by");
    fill(4, 4, one, 0.01, &seed);
    memset(plates.plate[6].clipped.data + (size_t)12 * WIDTH, 255, (size_t)5 * WIDTH);
    assert_fails(weft_strip_measure(&plates, full, &cal, &strip, &drift, err), WEFT_ERR_RANGE,
                 "of the white strip is saturated");
    memset(plates.plate[6].clipped.data, 0, (size_t)WIDTH * HEIGHT);
    const weft_strip narrow = {.rect_px = {20, 10, 60, 14}, .reflectance = 0.9};
    assert_fails(weft_strip_measure(&plates, full, &cal, &narrow, &drift, err), WEFT_ERR_RANGE,
                 "make it wider");
}

static void the_set_says_where_it_is(void **state)
{
    (void)state;
    weft_set set;
    weft_strip found;
    bool present = true;
    assert_ok(weft_set_init(&set, "a.set", err));
    set.width = WIDTH;
    set.height = HEIGHT;
    assert_ok(weft_strip_of_set(&set, &found, &present, err));
    assert_false(present);
    set.other = json_loads("{\"strip\": {\"rect_px\": [4, 2, 600, 30]}}", 0, NULL);
    assert_ok(weft_strip_of_set(&set, &found, &present, err));
    assert_true(present && found.rect_px[2] == 600 && found.reflectance == 0.99);
    static const char *const wrong[] = {"[4, 2, 616, 30]", "[4, 30, 600, 2]", "[-1, 2, 600, 30]", "[1, 2, 3]",
                                        "\"left\""};
    for (size_t i = 0; i < sizeof wrong / sizeof *wrong; i++) {
        char text[80];
        snprintf(text, sizeof text, "{\"strip\": {\"rect_px\": %s}}", wrong[i]);
        json_decref(set.other);
        set.other = json_loads(text, 0, NULL);
        assert_fails(weft_strip_of_set(&set, &found, &present, err), i < 3 ? WEFT_ERR_RANGE : WEFT_ERR_FORMAT,
                     "a.set/set.json: strip");
    }
    weft_set_fini(&set);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(drift_is_measured),
        cmocka_unit_test(what_is_no_drift_is_refused),
        cmocka_unit_test(the_set_says_where_it_is),
    };
    return cmocka_run_group_tests(tests, set_up, tear_down);
}
