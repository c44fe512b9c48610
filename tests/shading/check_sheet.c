/* Contact sheets: scaling keeps the light, colours mean what they say, tiles lie where they should. */
#include "tests/support/support.h"

#include "core/colour.h"
#include "shading/preview/font.h"
#include "shading/preview/sheet.h"

#include <math.h>

static weft_image noise_image(int width, int height, int planes)
{
    weft_image image;
    uint64_t random = 7;
    assert_ok(weft_image_init(&image, width, height, planes, err));
    for (size_t i = 0; i < weft_image_plane_size(&image) * (size_t)planes; i++)
        image.data[i] = (float)weft_test_random(&random);
    return image;
}

static double mean_of(const weft_image *image, int plane)
{
    double sum = 0;
    for (size_t i = 0; i < weft_image_plane_size(image); i++)
        sum += (double)weft_image_plane(image, plane)[i];
    return sum / (double)weft_image_plane_size(image);
}

static void test_scaling_keeps_the_light(void **state)
{
    (void)state;
    weft_image image = noise_image(101, 67, 2), small, large, same;
    assert_ok(weft_image_scale(&small, &image, 13, 30, err));
    assert_near(mean_of(&small, 1), mean_of(&image, 1), 1e-6);
    assert_ok(weft_image_scale(&same, &image, 101, 67, err));
    assert_memory_equal(same.data, image.data, sizeof(float) * 2 * 101 * 67);
    assert_ok(weft_image_scale(&large, &image, 303, 67, err)); /* the middle of three is the pixel itself */
    for (int x = 0; x < 101; x++)
        assert_near((double)weft_image_row(&large, 0, 40)[3 * x + 1],
                    (double)weft_image_row(&image, 0, 40)[x], 1e-6);
    weft_image_fini(&small);
    weft_image_fini(&large);
    weft_image_fini(&same);
    weft_image_fini(&image);
}

static void test_normals_and_scalars_are_shown(void **state)
{
    (void)state;
    weft_image normal, scalar, picture;
    weft_mask mask;
    assert_ok(weft_image_init(&normal, 2, 1, 3, err)); /* the second is (0, 0, 0): no answer */
    weft_image_plane(&normal, 2)[0] = 1;
    assert_ok(weft_sheet_show_normals(&picture, &normal, err));
    assert_int_equal(weft_srgb_encode8((double)weft_image_plane(&picture, 0)[0]), 128);
    assert_int_equal(weft_srgb_encode8((double)weft_image_plane(&picture, 2)[0]), 255);
    assert_near((double)weft_image_plane(&picture, 1)[1], 0.18, 1e-6);
    weft_image_fini(&picture);
    weft_image_fini(&normal);

    const float values[5] = {0, 2, 1, NAN, 1};
    assert_ok(weft_image_init(&scalar, 5, 1, 1, err));
    assert_ok(weft_mask_init(&mask, 5, 1, 255, err));
    for (int i = 0; i < 5; i++)
        scalar.data[i] = values[i];
    mask.data[4] = 0;
    assert_ok(weft_sheet_show_scalar(&picture, &scalar, &mask, 0, 2, err));
    static const int wanted[5][3] = {
        {68, 1, 84}, {253, 231, 37}, {33, 144, 141}, {118, 118, 118}, {118, 118, 118}};
    for (int i = 0; i < 5; i++)
        for (int c = 0; c < 3; c++)
            assert_int_equal(weft_srgb_encode8((double)weft_image_plane(&picture, c)[i]), wanted[i][c]);
    double median = -1, top = -1;
    assert_ok(weft_image_quantile(&scalar, 0, &mask, 0.5, &median, err));
    assert_ok(weft_image_quantile(&scalar, 0, &mask, 1, &top, err));
    assert_true(median == 1 && top == 2);
    weft_image_fini(&picture);
    weft_image_fini(&scalar);
    weft_mask_fini(&mask);
}

static int count_ink(const weft_image *image, int x0, int y0, int x1, int y1)
{
    int n = 0;
    for (int y = y0; y < y1; y++)
        for (int x = x0; x < x1; x++)
            n += weft_image_row(image, 0, y)[x] == 1.0f;
    return n;
}

static void test_letters(void **state)
{
    (void)state;
    weft_image image;
    assert_ok(weft_image_init(&image, 40, 20, 1, err));
    weft_font_draw(&image, 1, 1, 2, "I", 1);
    assert_int_equal(count_ink(&image, 0, 0, 40, 20), 4 * (3 + 5 + 3)); /* bars of 3, stem of 5 */
    assert_int_equal(count_ink(&image, 5, 1, 7, 15), 4 * 7);            /* the stem is the middle column */
    weft_font_draw(&image, 30, 15, 2, "WWW \xc3\xbc", 1); /* cut at the edge, not written beyond */
    weft_font_draw(&image, -4, -4, 2, "W", 1);
    assert_int_equal(weft_font_width(2, "ab\xc3\xbc"), 36);
    weft_image_fini(&image);
}

static void test_tiles(void **state)
{
    (void)state;
    weft_sheet sheet;
    weft_image picture = noise_image(10, 20, 1);
    for (int i = 0; i < 200; i++)
        picture.data[i] = 1;
    assert_ok(weft_sheet_init(&sheet, 2, 2, 40, 40, "", err));
    assert_ok(weft_sheet_place(&sheet, 1, 1, &picture, "", err)); /* 20 x 40, in the middle of its tile */
    assert_int_equal(count_ink(&sheet.image, 0, 0, sheet.image.width, sheet.image.height), 20 * 40);
    assert_int_equal(count_ink(&sheet.image, 12 + 52 + 10, 12 + 52, 12 + 52 + 30, sheet.image.height),
                     20 * 40);
    weft_sheet_fini(&sheet);
    weft_image_fini(&picture);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_scaling_keeps_the_light),
        cmocka_unit_test(test_normals_and_scalars_are_shown),
        cmocka_unit_test(test_letters),
        cmocka_unit_test(test_tiles),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
