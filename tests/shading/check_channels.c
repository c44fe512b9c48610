/* Pictures of a material at another size: against the function that the texels were drawn from. */
#include "tests/support/support.h"

#include "shading/brdf/real.h"
#include "shading/export/channels.h"
#include "shading/export/ktx2.h"

#include <math.h>
#include <string.h>

enum { WIDTH = 61, HEIGHT = 45, SIZED_WIDTH = 64, SIZED_HEIGHT = 48 };

/* At a place of the picture, 0..1 across and down; it closes at the edges. */
static double wave(double u, double v)
{
    return 0.5 + 0.3 * sin(2 * M_PI * 3 * u) * cos(2 * WEFT_PI * 2 * v);
}

static double slant(double u, double v)
{
    return 0.2 + 0.5 * u + 0.1 * v;
}

static void draw(weft_baked *baked, double (*f)(double u, double v), bool periodic)
{
    weft_error err = {0};
    assert_int_equal(weft_baked_init(baked, "drawn", &weft_material_types[0], &err), WEFT_OK);
    assert_int_equal(weft_baked_add(baked, WEFT_BAKED_OCCLUSION, WIDTH, HEIGHT, &err), WEFT_OK);
    weft_image *const level = &baked->maps[WEFT_BAKED_OCCLUSION].mips[0];
    for (int y = 0; y < HEIGHT; y++)
        for (int x = 0; x < WIDTH; x++)
            weft_image_row(level, 0, y)[x] = (float)f((x + 0.5) / WIDTH, (y + 0.5) / HEIGHT);
    baked->periodic = periodic;
}

/* The largest error over the texels that lie `margin` from the edge, in the units of the function. */
static double worst(double (*f)(double u, double v), bool periodic, int margin)
{
    static const weft_channels channels = {{"occlusion"}, 16, false};
    weft_baked baked;
    weft_raster raster;
    weft_error err = {0};
    double most = 0;
    draw(&baked, f, periodic);
    assert_int_equal(
        weft_channels_raster_sized(&baked, &channels, 0, SIZED_WIDTH, SIZED_HEIGHT, &raster, &err), WEFT_OK);
    assert_int_equal(raster.width, SIZED_WIDTH);
    assert_int_equal(raster.height, SIZED_HEIGHT);
    for (int y = margin; y < SIZED_HEIGHT - margin; y++)
        for (int x = margin; x < SIZED_WIDTH - margin; x++)
            most = fmax(most, fabs(raster.data[y * SIZED_WIDTH + x] / 65535.0 -
                                   f((x + 0.5) / SIZED_WIDTH, (y + 0.5) / SIZED_HEIGHT)));
    weft_raster_fini(&raster);
    weft_baked_fini(&baked);
    return most;
}

/* Cubic interpolation of a sine of 20 texels is off by less than (2 pi / 20)^3 / 24 of its height; a straight
 * line it keeps, but for the last texels. */
static void test_keeps_the_function(void **state)
{
    (void)state;
    assert_true(worst(wave, true, 0) < 4e-4);
    assert_true(worst(slant, false, 2) < 2e-5);
    assert_true(worst(slant, false, 0) < 0.02);
    assert_true(worst(wave, false, 0) > 4e-4); /* an edge that is not known to go on is seen */
}

/* The file of the size that glTF asks for, its own size for an engine. */
static void test_ktx2_sizes(void **state)
{
    weft_baked baked;
    weft_error err = {0};
    int size[2];
    (void)state;
    draw(&baked, wave, true);
    weft_ktx2_size(&baked, WEFT_KTX2_UASTC, size);
    assert_int_equal(size[0], SIZED_WIDTH);
    assert_int_equal(size[1], SIZED_HEIGHT);
    weft_ktx2_size(&baked, WEFT_KTX2_RGBA8, size);
    assert_int_equal(size[0], WIDTH);
    for (int format = 0; format < 2; format++) {
        static const weft_channels channels = {{"occlusion", "zero", "zero", "one"}, 8, false};
        weft_text_buffer file = {0};
        assert_int_equal(
            weft_ktx2_encode(&baked, &channels, format ? WEFT_KTX2_UASTC : WEFT_KTX2_RGBA8, &file, &err),
            WEFT_OK);
        assert_memory_equal(file.text + 1, "KTX 20", 6);
        assert_int_equal((uint8_t)file.text[44], 2);              /* Zstandard */
        assert_int_equal((uint8_t)file.text[40], format ? 7 : 6); /* levels */
        weft_text_buffer_fini(&file);
    }
    weft_baked_fini(&baked);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_keeps_the_function),
                                       cmocka_unit_test(test_ktx2_sizes)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
