/* Animated WebP: written here, decoded by libwebp's demuxer, picture by picture. */
#include "tests/support/support.h"

#include "core/file.h"
#include "core/formats/webp_file.h"
#include "core/mem.h"

#include <math.h>
#include <stdlib.h>
#include <webp/demux.h>

enum { WIDTH = 37, HEIGHT = 22, FRAMES = 7 };

/* A colour wedge that moves. */
static weft_raster picture_of(int frame)
{
    weft_raster picture;
    assert_ok(weft_raster_init(&picture, WIDTH, HEIGHT, 3, 8, err));
    for (int y = 0; y < HEIGHT; y++)
        for (int x = 0; x < WIDTH; x++) {
            uint16_t *const p = picture.data + 3 * ((size_t)y * WIDTH + (size_t)x);
            p[0] = (uint16_t)((x * 5 + frame * 9) % 256);
            p[1] = (uint16_t)(y * 11 % 256);
            p[2] = (uint16_t)(255 - 4 * x);
        }
    return picture;
}

static void write_animation(const char *path, int quality, double fps)
{
    weft_webp *webp;
    assert_ok(weft_webp_begin(&webp, WIDTH, HEIGHT, fps, quality, err));
    for (int frame = 0; frame < FRAMES; frame++) {
        weft_raster picture = picture_of(frame);
        assert_ok(weft_webp_add(webp, &picture, err));
        weft_raster_fini(&picture);
    }
    assert_ok(weft_webp_write(webp, path, err));
    weft_webp_destroy(webp);
}

/* Decodes it; returns the root mean square difference in codes, over all frames. */
static double read_animation(const char *path, int *first_ms, int *last_ms)
{
    char *bytes;
    size_t n;
    double sum = 0;
    WebPAnimInfo info;
    assert_ok(weft_file_read(path, 1 << 20, &bytes, &n, err));
    WebPAnimDecoder *const decoder = WebPAnimDecoderNew(&(WebPData){(const uint8_t *)bytes, n}, NULL);
    assert_non_null(decoder);
    assert_true(WebPAnimDecoderGetInfo(decoder, &info));
    assert_int_equal(info.canvas_width, WIDTH);
    assert_int_equal(info.canvas_height, HEIGHT);
    assert_int_equal(info.frame_count, FRAMES);
    assert_int_equal(info.loop_count, 0);
    for (int frame = 0; frame < FRAMES; frame++) {
        uint8_t *rgba;
        weft_raster picture = picture_of(frame);
        assert_true(WebPAnimDecoderGetNext(decoder, &rgba, last_ms));
        *first_ms = frame == 0 ? *last_ms : *first_ms;
        for (int i = 0; i < WIDTH * HEIGHT; i++) {
            for (int c = 0; c < 3; c++)
                sum += pow(rgba[4 * i + c] - picture.data[3 * i + c], 2) / (3.0 * WIDTH * HEIGHT * FRAMES);
            assert_int_equal(rgba[4 * i + 3], 255);
        }
        weft_raster_fini(&picture);
    }
    assert_false(WebPAnimDecoderHasMoreFrames(decoder));
    WebPAnimDecoderDelete(decoder);
    weft_free(bytes);
    return sqrt(sum);
}

static void test_frames_come_back(void **state)
{
    (void)state;
    const char *const path = weft_test_path("a.webp");
    int first_ms = 0, last_ms = 0;
    write_animation(path, 100, 30); /* 33.3 ms a frame: rounded places, no drift */
    assert_near(read_animation(path, &first_ms, &last_ms), 0, 0);
    assert_int_equal(first_ms, 33);
    assert_int_equal(last_ms, 233);
    write_animation(path, 90, 10);
    const double rms = read_animation(path, &first_ms, &last_ms);
    print_message("quality 90: %.2f codes rms\n", rms);
    assert_true(rms > 0 && rms < 12);
    assert_int_equal(last_ms, 700);
}

static void test_refusals(void **state)
{
    (void)state;
    const char *const path = weft_test_path("b.webp");
    weft_webp *webp;
    weft_raster picture = picture_of(0);
    assert_fails(weft_webp_begin(&webp, 16384, 8, 10, 90, err), WEFT_ERR_RANGE, "16383");
    assert_fails(weft_webp_begin(&webp, 8, 8, 0, 90, err), WEFT_ERR_RANGE, "frames a second");
    assert_ok(weft_webp_begin(&webp, WIDTH + 1, HEIGHT, 10, 90, err));
    assert_fails(weft_webp_add(webp, &picture, err), WEFT_ERR_MISMATCH, "wanted 38 x 22");
    assert_fails(weft_webp_write(webp, path, err), WEFT_ERR_NODATA, "no frames");
    assert_false(weft_file_exists(path));
    weft_webp_destroy(webp);
    weft_webp_destroy(NULL);
    assert_ok(weft_webp_begin(&webp, WIDTH, HEIGHT, 10, 90, err));
    assert_ok(weft_webp_add(webp, &picture, err));
    assert_fails(weft_webp_write(webp, "/no/such/folder/b.webp", err), WEFT_ERR_IO, "/no/such/folder");
    weft_webp_destroy(webp);
    weft_raster_fini(&picture);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_frames_come_back),
        cmocka_unit_test(test_refusals),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
