/* Photon transfer on frames whose sensor the test made: gain, read noise, fixed pattern, saturation. */
#include "calibration/sensor_noise.h"
#include "tests/support/support.h"

#include <math.h>
#include <stdlib.h>

enum { WIDTH = 512, HEIGHT = 384 };
#define GAIN  1.92 /* e/DN */
#define READ  3.5  /* e */
#define PRNU  0.006
#define BLACK 256
#define WHITE 15871

/* A ramp over patches with dark frames between them, like a chart; `exposure` 1 brings its end to 60 %. */
static void expose(weft_mosaic *m, double exposure, uint64_t *seed)
{
    uint64_t pattern = 77; /* the sites' sensitivities are the same in every frame */
    for (int v = 0; v < HEIGHT; v++)
        for (int u = 0; u < WIDTH; u++) {
            const bool frame = u % 256 < 12 || v % 192 < 12;
            const double light = (frame ? 0.03 : 0.1 + 0.5 * u / WIDTH) * exposure * 15615 * GAIN;
            const double colour = (u + v) % 2 ? 1 : 0.6, site = 1 + PRNU * weft_test_gauss(&pattern);
            const double mean = light * colour * site;
            const double e = mean + sqrt(mean) * weft_test_gauss(seed) + READ * weft_test_gauss(seed);
            m->data[v * WIDTH + u] = (uint16_t)fmin(fmax(BLACK + e / GAIN + 0.5, 0), WHITE);
        }
}

static void a_sensor_is_measured(void **state)
{
    (void)state;
    static const double black[4] = {BLACK, BLACK, BLACK, BLACK};
    weft_mosaic m;
    weft_sensor_frames *frames;
    uint64_t seed = 1;
    assert_ok(weft_mosaic_init(&m, WIDTH, HEIGHT, WEFT_CFA_RGGB, err));
    m.white = WHITE;
    assert_ok(weft_sensor_frames_create(&m, &frames, err));
    weft_sensor_class c;
    assert_fails(weft_sensor_fit(frames, 0, &c, err), WEFT_ERR_NODATA, "take a series of exposures");
    for (double exposure = 0.01; exposure < 2.5; exposure *= 1.6) {
        expose(&m, exposure, &seed);
        assert_ok(weft_sensor_frames_add(frames, &m, black, err));
    }
    for (int site = 0; site < 4; site++) {
        assert_ok(weft_sensor_fit(frames, site, &c, err));
        print_message("site %d: gain %.4f +- %.4f e/DN, read %.2f e, fixed pattern %.2f %%, saturation %.0f "
                      "DN, %d levels\n",
                      site, c.gain_e_per_dn, c.gain_sigma, c.read_noise_e, 100 * c.prnu, c.saturation_dn,
                      c.n_levels);
        assert_near(c.gain_e_per_dn, GAIN, 0.05);
        assert_true(fabs(c.gain_e_per_dn - GAIN) < 4 * c.gain_sigma && c.gain_sigma < 0.03);
        assert_near(c.read_noise_e, READ, 0.5);
        assert_near(c.prnu, PRNU, 0.001);
        assert_near(c.saturation_dn, site == 1 || site == 2 ? WHITE : 0, 0);
    }
    weft_sensor_frames_destroy(frames);
    weft_mosaic_fini(&m);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(a_sensor_is_measured)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
