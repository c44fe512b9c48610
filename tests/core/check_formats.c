/* Pictures to files and back: EXR, PNG, TIFF. */
#include "tests/support/support.h"

#include "core/colour.h"
#include "core/file.h"
#include "core/formats/exr_file.h"
#include "core/formats/half.h"
#include "core/formats/image_file.h"
#include "core/formats/jpeg_bytes.h"
#include "core/formats/png_file.h"
#include "core/formats/tiff_file.h"
#include "core/mem.h"
#include "core/parallel.h"
#include "core/sha256.h"

#include <math.h>
#include <openexr.h>
#include <string.h>
#include <tiffio.h>

static weft_image make_image(int width, int height, int planes)
{
    weft_image image;
    uint64_t seed = 7;
    assert_ok(weft_image_init(&image, width, height, planes, err));
    for (size_t i = 0; i < weft_image_plane_size(&image) * (size_t)planes; i++)
        image.data[i] = (float)(2 * weft_test_gauss(&seed));
    return image;
}

static void assert_same_image(const weft_image *a, const weft_image *b)
{
    assert_true(a->width == b->width && a->height == b->height && a->planes == b->planes);
    assert_memory_equal(a->data, b->data, weft_image_plane_size(a) * (size_t)a->planes * sizeof(float));
}

static void test_half_is_nearest(void **state)
{
    (void)state;
    for (uint32_t h = 0; h < 0x7c00; h++) { /* every finite half, and the middle to the next */
        const float value = weft_half_value((uint16_t)h);
        assert_int_equal(weft_half_bits(value), h);
        assert_int_equal(weft_half_bits(-value), h | 0x8000);
        if (h == 0x7bff)
            break;
        const float next = weft_half_value((uint16_t)(h + 1)), middle = (value + next) / 2;
        assert_int_equal(weft_half_bits(middle), h & 1 ? h + 1 : h); /* ties to even */
        assert_int_equal(weft_half_bits(nextafterf(middle, 0)), h);
        assert_int_equal(weft_half_bits(nextafterf(middle, 1e9f)), h + 1);
    }
    assert_true(weft_half_value(0x3c00) == 1 && weft_half_value(1) == 0x1p-24f);
    assert_int_equal(weft_half_bits(65519.0f), 0x7bff);
    assert_int_equal(weft_half_bits(1e30f), 0x7bff);
    assert_int_equal(weft_half_bits(-1e30f), 0xfbff);
    assert_int_equal(weft_half_bits(INFINITY), 0x7c00);
    assert_true(isnan(weft_half_value(weft_half_bits(NAN))));
}

static void test_exr_float_round_trip(void **state)
{
    (void)state;
    static const char *const names[] = {"normal.Z", "R", "normal.X",
                                        "a channel with quite a long name, "
                                        "longer than thirty-one letters"};
    const int sizes[][2] = {{1, 1}, {37, 16}, {5, 17}, {64, 33}, {301, 290}};
    for (size_t i = 0; i < sizeof sizes / sizeof sizes[0]; i++) {
        weft_image image = make_image(sizes[i][0], sizes[i][1], 4), back;
        image.data[0] = INFINITY;
        assert_ok(weft_exr_write(weft_test_path("f.exr"), &image, names, WEFT_EXR_FLOAT, err));
        assert_ok(weft_exr_read(weft_test_path("f.exr"), names, 4, &back, err));
        assert_same_image(&image, &back);
        weft_image_fini(&back);
        weft_image_fini(&image);
    }
    char *channels;
    assert_ok(weft_exr_channels(weft_test_path("f.exr"), &channels, err));
    assert_string_equal(channels, "R,a channel with quite a long name, longer than thirty-one letters,"
                                  "normal.X,normal.Z");
    weft_free(channels);
}

/* Every level comes back, floats exactly and halves within their step; other programs' level 0 is ours. */
static void test_exr_mips(void **state)
{
    (void)state;
    static const char *const names[] = {"X", "Y", "Z"};
    for (int type = 0; type < 2; type++) {
        weft_image levels[9], back;
        uint64_t random = 9;
        int n = 0, count;
        for (int w = 301, h = 140; n<9; w = w> 1 ? w / 2 : 1, h = h > 1 ? h / 2 : 1, n++) {
            assert_ok(weft_image_init(&levels[n], w, h, 3, err));
            for (size_t i = 0; i < 3 * weft_image_plane_size(&levels[n]); i++)
                levels[n].data[i] = (float)weft_test_random(&random);
        }
        const char *const path = weft_test_path("mips.exr");
        assert_ok(weft_exr_write_mips(path, levels, n, names, (weft_exr_type)type, err));
        assert_ok(weft_exr_levels(path, &count, err));
        assert_int_equal(count, n);
        for (int level = 0; level < n; level++) {
            assert_ok(weft_exr_read_level(path, names, 3, level, &back, err));
            assert_int_equal(back.width, levels[level].width);
            for (size_t i = 0; i < 3 * weft_image_plane_size(&back); i++)
                assert_near((double)back.data[i], (double)levels[level].data[i],
                            type == WEFT_EXR_HALF ? 2.5e-4 : 0);
            weft_image_fini(&back);
        }
        assert_ok(weft_exr_read(path, names, 3, &back, err));
        assert_int_equal(back.height, 140);
        weft_image_fini(&back);
        assert_fails(weft_exr_read_level(path, names, 3, 9, &back, err), WEFT_ERR_MISSING, "no level 9");
        for (int level = 0; level < n; level++)
            weft_image_fini(&levels[level]);
    }
}

static void test_exr_half_and_choice_of_channels(void **state)
{
    (void)state;
    static const char *const names[] = {"R", "G", "B"}, *const wanted[] = {"Z|B", "X|R", "B"};
    weft_image image = make_image(50, 40, 3), back;
    image.data[3] = 1e6f;
    assert_ok(weft_exr_write(weft_test_path("h.exr"), &image, names, WEFT_EXR_HALF, err));
    assert_ok(weft_exr_read(weft_test_path("h.exr"), wanted, 3, &back, err));
    for (size_t i = 0; i < weft_image_plane_size(&image); i++) {
        const float blue = weft_half_value(weft_half_bits(weft_image_plane(&image, 2)[i]));
        assert_true(weft_image_plane(&back, 0)[i] == blue && weft_image_plane(&back, 2)[i] == blue);
        assert_true(weft_image_plane(&back, 1)[i] ==
                    weft_half_value(weft_half_bits(weft_image_plane(&image, 0)[i])));
    }
    assert_true(weft_image_plane(&back, 1)[3] == 65504);
    weft_image_fini(&back);
    static const char *const lacking[] = {"R", "normal.X|X"};
    assert_fails(weft_exr_read(weft_test_path("h.exr"), lacking, 2, &back, err), WEFT_ERR_MISSING,
                 "h.exr: has no channel normal.X|X (it has B,G,R)");
    static const char *const twice[] = {"R", "G", "R"};
    assert_fails(weft_exr_write(weft_test_path("h.exr"), &image, twice, WEFT_EXR_HALF, err), WEFT_ERR_RANGE,
                 "given twice");
    weft_image_fini(&image);
}

/* Files that only the library writes: other compressions, tiles, whole numbers, a shifted window. */
static void write_foreign(const char *path, exr_compression_t compression, exr_storage_t storage,
                          exr_pixel_type_t type, int width, int height, const void *samples)
{
    exr_context_initializer_t init = EXR_DEFAULT_CONTEXT_INITIALIZER;
    exr_context_t context;
    exr_encode_pipeline_t pipe = {0};
    exr_attr_box2i_t window;
    exr_attr_v2f_t centre;
    window.min.x = -3, window.min.y = 5;
    window.max.x = width - 4, window.max.y = height + 4;
    centre.x = centre.y = 0;
    static const char *const names[] = {"A", "B", "Y"};
    const int size = type == EXR_PIXEL_HALF ? 2 : 4;
    int part, lines = 32;
    assert_int_equal(exr_start_write(&context, path, EXR_WRITE_FILE_DIRECTLY, &init), 0);
    assert_int_equal(exr_add_part(context, NULL, storage, &part), 0);
    assert_int_equal(exr_initialize_required_attr(context, part, &window, &window, 1, &centre, 1,
                                                  EXR_LINEORDER_INCREASING_Y, compression),
                     0);
    for (int c = 0; c < 3; c++)
        assert_int_equal(exr_add_channel(context, part, names[c], type, EXR_PERCEPTUALLY_LINEAR, 1, 1), 0);
    if (storage == EXR_STORAGE_TILED)
        assert_int_equal(
            exr_set_tile_descriptor(context, part, 48, 32, EXR_TILE_ONE_LEVEL, EXR_TILE_ROUND_DOWN), 0);
    assert_int_equal(exr_write_header(context), 0);
    if (storage == EXR_STORAGE_SCANLINE)
        exr_get_scanlines_per_chunk(context, part, &lines);
    const int step = storage == EXR_STORAGE_TILED ? 48 : width;
    bool first = true;
    for (int y = 0; y < height; y += lines)
        for (int x = 0; x < width; x += step) {
            exr_chunk_info_t chunk;
            if (storage == EXR_STORAGE_TILED)
                exr_write_tile_chunk_info(context, part, x / 48, y / 32, 0, 0, &chunk);
            else
                exr_write_scanline_chunk_info(context, part, y + 5, &chunk);
            if (first)
                exr_encoding_initialize(context, part, &chunk, &pipe);
            else
                exr_encoding_update(context, part, &chunk, &pipe);
            for (int c = 0; c < 3; c++) { /* every channel is the same samples */
                pipe.channels[c].encode_from_ptr =
                    (const uint8_t *)samples + ((size_t)y * (size_t)width + (size_t)x) * (size_t)size;
                pipe.channels[c].user_pixel_stride = size;
                pipe.channels[c].user_line_stride = size * width;
            }
            if (first)
                exr_encoding_choose_default_routines(context, part, &pipe);
            first = false;
            assert_int_equal(exr_encoding_run(context, part, &pipe), 0);
        }
    exr_encoding_destroy(context, &pipe);
    assert_int_equal(exr_finish(&context), 0);
}

static void test_exr_of_other_programs(void **state)
{
    (void)state;
    enum { W = 101, H = 75 };
    static float floats[W * H];
    static uint16_t halves[W * H];
    static uint32_t wholes[W * H];
    for (int i = 0; i < W * H; i++) {
        floats[i] = (float)sin(i * 0.01) + 2;
        halves[i] = weft_half_bits(floats[i]);
        wholes[i] = (uint32_t)i * 7;
    }
    static const char *const wanted[] = {"Y"}; /* one of three: the others must be skipped */
    const struct {
        exr_compression_t compression;
        double loss;
    } kinds[] = {{EXR_COMPRESSION_NONE, 0},   {EXR_COMPRESSION_RLE, 0},    {EXR_COMPRESSION_ZIPS, 0},
                 {EXR_COMPRESSION_ZIP, 0},    {EXR_COMPRESSION_PIZ, 0},    {EXR_COMPRESSION_PXR24, 5e-5},
                 {EXR_COMPRESSION_B44, 0.15}, {EXR_COMPRESSION_B44A, 0.15}};
    for (size_t k = 0; k < sizeof kinds / sizeof kinds[0]; k++)
        for (int tiled = 0; tiled < 2; tiled++)
            for (int type = 0; type < 3; type++) {
                const exr_pixel_type_t types[] = {EXR_PIXEL_HALF, EXR_PIXEL_FLOAT, EXR_PIXEL_UINT};
                const void *const samples[] = {halves, floats, wholes};
                const char *const path = weft_test_path("foreign.exr");
                weft_image image;
                write_foreign(path, kinds[k].compression, tiled ? EXR_STORAGE_TILED : EXR_STORAGE_SCANLINE,
                              types[type], W, H, samples[type]);
                assert_ok(weft_exr_read(path, wanted, 1, &image, err));
                assert_true(image.width == W && image.height == H);
                for (int i = 0; i < W * H; i++) {
                    const float truth = type == 0   ? weft_half_value(halves[i])
                                        : type == 1 ? floats[i]
                                                    : (float)wholes[i];
                    if (fabs((double)(image.data[i] - truth)) > (type == 2 ? 0 : kinds[k].loss))
                        fail_msg("compression %d tiled %d type %d pixel %d: %g, wanted %g",
                                 kinds[k].compression, tiled, type, i, (double)image.data[i], (double)truth);
                }
                weft_image_fini(&image);
            }
}

static void test_exr_is_the_same_with_any_threads(void **state)
{
    (void)state;
    static const char *const names[] = {"X", "Y", "Z"};
    weft_image image = make_image(210, 333, 3);
    char first[65] = "", hash[65];
    for (int threads = 1; threads <= 7; threads += 3) {
        weft_parallel_set_threads(threads);
        assert_ok(weft_exr_write(weft_test_path("t.exr"), &image, names, WEFT_EXR_HALF, err));
        assert_ok(weft_sha256_file(weft_test_path("t.exr"), hash, err));
        if (threads == 1)
            memcpy(first, hash, sizeof first);
        assert_string_equal(first, hash);
    }
    weft_parallel_set_threads(0);
    weft_image_fini(&image);
}

static weft_raster make_raster(int width, int height, int channels, int bits)
{
    weft_raster raster;
    uint64_t seed = (uint64_t)(channels * 100 + bits);
    assert_ok(weft_raster_init(&raster, width, height, channels, bits, err));
    for (size_t i = 0; i < (size_t)width * (size_t)height * (size_t)channels; i++)
        raster.data[i] = (uint16_t)(weft_test_random(&seed) * (1 << bits));
    return raster;
}

typedef weft_err raster_write_fn(const char *path, const weft_raster *raster, weft_error *err);
typedef weft_err raster_read_fn(const char *path, weft_raster *raster, weft_error *err);

static void check_raster_round_trip(const char *name, raster_write_fn *write, raster_read_fn *read)
{
    for (int bits = 8; bits <= 16; bits += 8)
        for (int channels = 1; channels <= 4; channels++)
            for (int width = 1; width < 400; width = 3 * width + 1) {
                weft_raster raster = make_raster(width, 97, channels, bits), back;
                assert_ok(write(weft_test_path(name), &raster, err));
                assert_ok(read(weft_test_path(name), &back, err));
                assert_true(back.width == width && back.height == 97 && back.channels == channels &&
                            back.bits == bits);
                assert_memory_equal(raster.data, back.data,
                                    (size_t)width * 97 * (size_t)channels * sizeof *raster.data);
                weft_raster_fini(&raster);
                weft_raster_fini(&back);
            }
}

static void test_png_round_trip(void **state)
{
    (void)state;
    check_raster_round_trip("a.png", weft_png_write, weft_png_read);
}

static void test_tiff_round_trip(void **state)
{
    (void)state;
    check_raster_round_trip("a.tif", weft_tiff_write, weft_tiff_read);
}

/* Tiles, planes apart, the other byte order, LZW, white as zero: what others' TIFFs may be. */
static void write_foreign_tiff(const char *path, const weft_raster *raster, bool tiled, bool planes_apart,
                               bool big_endian, bool inverted)
{
    TIFF *const tiff = TIFFOpen(path, big_endian ? "wb" : "wl");
    assert_non_null(tiff);
    const int channels = raster->channels, per_block = planes_apart ? 1 : channels;
    const int bw = tiled ? 32 : raster->width, bh = tiled ? 16 : 5;
    TIFFSetField(tiff, TIFFTAG_IMAGEWIDTH, raster->width);
    TIFFSetField(tiff, TIFFTAG_IMAGELENGTH, raster->height);
    TIFFSetField(tiff, TIFFTAG_BITSPERSAMPLE, raster->bits);
    TIFFSetField(tiff, TIFFTAG_SAMPLESPERPIXEL, channels);
    TIFFSetField(tiff, TIFFTAG_PLANARCONFIG, planes_apart ? PLANARCONFIG_SEPARATE : PLANARCONFIG_CONTIG);
    TIFFSetField(tiff, TIFFTAG_PHOTOMETRIC,
                 inverted        ? PHOTOMETRIC_MINISWHITE
                 : channels == 3 ? PHOTOMETRIC_RGB
                                 : PHOTOMETRIC_MINISBLACK);
    TIFFSetField(tiff, TIFFTAG_COMPRESSION, COMPRESSION_LZW);
    if (tiled) {
        TIFFSetField(tiff, TIFFTAG_TILEWIDTH, bw);
        TIFFSetField(tiff, TIFFTAG_TILELENGTH, bh);
    } else
        TIFFSetField(tiff, TIFFTAG_ROWSPERSTRIP, bh);
    uint16_t block[512 * 16 * 3];
    const int top = (1 << raster->bits) - 1;
    for (int s = 0; s < channels; s += per_block)
        for (int y0 = 0; y0 < raster->height; y0 += bh)
            for (int x0 = 0; x0 < raster->width; x0 += bw) {
                const int rows = tiled || raster->height - y0 > bh ? bh : raster->height - y0;
                for (int i = 0; i < rows * bw * per_block; i++) {
                    const int x = x0 + i / per_block % bw, y = y0 + i / per_block / bw, c = s + i % per_block;
                    int value = 0;
                    if (x < raster->width && y < raster->height)
                        value =
                            raster->data[((size_t)y * (size_t)raster->width + (size_t)x) * (size_t)channels +
                                         (size_t)c];
                    value = inverted ? top - value : value;
                    if (raster->bits == 8)
                        ((uint8_t *)block)[i] = (uint8_t)value;
                    else
                        block[i] = (uint16_t)value;
                }
                const tmsize_t bytes = (tmsize_t)rows * bw * per_block * raster->bits / 8;
                if (tiled)
                    TIFFWriteEncodedTile(tiff,
                                         TIFFComputeTile(tiff, (uint32_t)x0, (uint32_t)y0, 0, (uint16_t)s),
                                         block, bytes);
                else
                    TIFFWriteEncodedStrip(tiff, TIFFComputeStrip(tiff, (uint32_t)y0, (uint16_t)s), block,
                                          bytes);
            }
    TIFFClose(tiff);
}

static void test_tiff_of_other_programs(void **state)
{
    (void)state;
    for (int k = 0; k < 64; k++) {
        const bool tiled = k & 1, apart = k & 2, big_endian = k & 4, inverted = k & 8;
        const int bits = k & 16 ? 16 : 8, channels = k & 32 ? 3 : 1;
        if (inverted && channels == 3)
            continue;
        weft_raster raster = make_raster(75, 43, channels, bits), back;
        write_foreign_tiff(weft_test_path("foreign.tif"), &raster, tiled, apart, big_endian, inverted);
        assert_ok(weft_tiff_read(weft_test_path("foreign.tif"), &back, err));
        assert_true(back.width == 75 && back.height == 43 && back.channels == channels && back.bits == bits);
        assert_memory_equal(back.data, raster.data, (size_t)75 * 43 * (size_t)channels * sizeof *raster.data);
        weft_raster_fini(&raster);
        weft_raster_fini(&back);
    }
}

/* A 1-bit interlaced palette PNG of 3 x 2 pixels, made byte by byte from the PNG specification with
 * Python's zlib: green on red. */
static void test_png_palette_is_expanded(void **state)
{
    (void)state;
    static const uint8_t file[] = {
#include "palette_png.inc"
    };
    weft_raster raster;
    assert_ok(weft_file_write(weft_test_path("p.png"), file, sizeof file, err));
    assert_ok(weft_png_read(weft_test_path("p.png"), &raster, err));
    assert_true(raster.width == 3 && raster.height == 2 && raster.channels == 3 && raster.bits == 8);
    static const int pattern[6] = {1, 0, 1, 0, 1, 1};
    for (int i = 0; i < 6; i++) {
        const uint16_t *const pixel = raster.data + (size_t)3 * (size_t)i;
        assert_true(pixel[0] == (pattern[i] ? 0 : 255) && pixel[1] == (pattern[i] ? 255 : 0) &&
                    pixel[2] == 0);
    }
    weft_raster_fini(&raster);
}

static void test_masks(void **state)
{
    (void)state;
    weft_mask mask, back;
    assert_ok(weft_mask_init(&mask, 9, 5, 0, err));
    mask.data[7] = 1;
    mask.data[44] = 255;
    assert_ok(weft_png_write_mask(weft_test_path("m.png"), &mask, err));
    assert_ok(weft_png_read_mask(weft_test_path("m.png"), &back, err));
    for (int i = 0; i < 45; i++)
        assert_int_equal(back.data[i], mask.data[i] ? 255 : 0);
    weft_mask_fini(&back);
    weft_mask_fini(&mask);
}

static void test_jpeg_is_read_only(void **state)
{
    (void)state;
    uint8_t rgb[16 * 16 * 3];
    for (int i = 0; i < 16 * 16 * 3; i++)
        rgb[i] = (uint8_t)(40 + i / 3 % 16 * 8); /* a ramp that no coder finds hard */
    unsigned char *bytes;
    size_t n;
    weft_image image;
    assert_ok(weft_jpeg_encode(rgb, 16, 16, 100, &bytes, &n, err));
    assert_ok(weft_file_write(weft_test_path("r.JPG"), bytes, n, err));
    assert_ok(weft_file_write(weft_test_path("cut.jpeg"), bytes, 20, err));
    weft_jpeg_free(bytes);
    assert_ok(weft_image_read(weft_test_path("r.JPG"), WEFT_TRANSFER_LINEAR, &image, err));
    assert_int_equal(image.planes, 3);
    for (int i = 0; i < 256; i++)
        assert_near((double)image.data[i], (40 + i % 16 * 8) / 255.0, 3 / 255.0);
    weft_image_fini(&image);
    assert_fails(weft_image_read(weft_test_path("cut.jpeg"), WEFT_TRANSFER_LINEAR, &image, err),
                 WEFT_ERR_FORMAT, "cut.jpeg: is a damaged JPEG");
}

static void test_transfer_by_bits(void **state)
{
    (void)state;
    static const struct {
        int bits;
        weft_transfer same;
    } rows[] = {{8, WEFT_TRANSFER_SRGB}, {16, WEFT_TRANSFER_LINEAR}};
    for (int k = 0; k < 2; k++) {
        weft_image image, back;
        assert_ok(weft_image_init(&image, 1, 1, 1, err));
        image.data[0] = 0.25F;
        assert_ok(weft_image_write(weft_test_path("t.png"), &image, rows[k].bits, rows[k].same, err));
        assert_ok(weft_image_read(weft_test_path("t.png"), WEFT_TRANSFER_BY_BITS, &back, err));
        assert_near((double)back.data[0], 0.25, 0.005);
        weft_image_fini(&back);
        weft_image_fini(&image);
    }
}

static void test_pictures_by_name(void **state)
{
    (void)state;
    static const char *const names[] = {"i.exr", "i.png", "i.tif", "i.TIFF"};
    for (size_t k = 0; k < 4; k++)
        for (int planes = 1; planes <= 3; planes += 2)
            for (int bits = 8; bits <= 16; bits += 8)
                for (int srgb = 0; srgb < 2; srgb++) {
                    weft_image image, back;
                    const weft_transfer transfer = srgb ? WEFT_TRANSFER_SRGB : WEFT_TRANSFER_LINEAR;
                    assert_ok(weft_image_init(&image, 16, 16, planes, err));
                    for (int i = 0; i < 256 * planes; i++)
                        image.data[i] = (float)((i % 256) / 255.0);
                    assert_ok(weft_image_write(weft_test_path(names[k]), &image, bits, transfer, err));
                    assert_ok(weft_image_read(weft_test_path(names[k]), transfer, &back, err));
                    assert_int_equal(back.planes, planes);
                    for (int i = 0; i < 256 * planes; i++) {
                        const double x = (double)image.data[i];
                        /* half a step of the stored code, carried to linear light */
                        const double slope = srgb ? fmax(2.4 * pow(x, 0.55), 0.078) : 1;
                        const double step = k == 0 ? x / 2048 : 0.51 * slope / ((1 << bits) - 1);
                        assert_near((double)back.data[i], x, step + 1e-7);
                    }
                    weft_image_fini(&image);
                    weft_image_fini(&back);
                }
    weft_image image = make_image(4, 4, 2);
    assert_fails(weft_image_write(weft_test_path("i.jpg"), &image, 8, WEFT_TRANSFER_SRGB, err),
                 WEFT_ERR_FORMAT, "i.jpg: a picture's name must end in .exr, .png, .tif or .tiff");
    assert_fails(weft_image_write(weft_test_path("x.png"), &image, 8, WEFT_TRANSFER_SRGB, err),
                 WEFT_ERR_RANGE, "1 or 3 planes, not 2");
    weft_image_fini(&image);
}

static void test_rounding_and_clamping(void **state)
{
    (void)state;
    weft_image image;
    weft_raster raster;
    assert_ok(weft_image_init(&image, 6, 1, 1, err));
    const float values[6] = {-1, NAN, 2, 100.4f / 255, 100.6f / 255, INFINITY};
    memcpy(image.data, values, sizeof values);
    assert_ok(weft_raster_from_image(&raster, &image, 8, WEFT_TRANSFER_LINEAR, err));
    const uint16_t wanted[6] = {0, 0, 255, 100, 101, 255};
    assert_memory_equal(raster.data, wanted, sizeof wanted);
    weft_raster_fini(&raster);
    weft_image_fini(&image);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_half_is_nearest),
        cmocka_unit_test(test_exr_float_round_trip),
        cmocka_unit_test(test_exr_mips),
        cmocka_unit_test(test_exr_half_and_choice_of_channels),
        cmocka_unit_test(test_exr_of_other_programs),
        cmocka_unit_test(test_exr_is_the_same_with_any_threads),
        cmocka_unit_test(test_png_round_trip),
        cmocka_unit_test(test_tiff_round_trip),
        cmocka_unit_test(test_tiff_of_other_programs),
        cmocka_unit_test(test_png_palette_is_expanded),
        cmocka_unit_test(test_masks),
        cmocka_unit_test(test_pictures_by_name),
        cmocka_unit_test(test_jpeg_is_read_only),
        cmocka_unit_test(test_transfer_by_bits),
        cmocka_unit_test(test_rounding_and_clamping),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
