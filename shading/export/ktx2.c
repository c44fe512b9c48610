#include "shading/export/ktx2.h"

#include "core/mem.h"
#include "core/parallel.h"
#include "core/version.h"
#include "shading/export/uastc.h"

#include <string.h>
#include <zstd.h>

enum {
    VK_UNDEFINED = 0,
    VK_R8G8B8A8_UNORM = 37,
    VK_R8G8B8A8_SRGB = 43,
    HEADER_BYTES = 80,
    LEVEL_BYTES = 24,
    SAMPLE_BYTES = 16,
    BLOCK_HEAD_BYTES = 24,
    RGBSDA = 1,
    UASTC = 166,
    UASTC_RGB = 0,
    UASTC_RGBA = 3,
    ZSTANDARD = 2,
    ZSTANDARD_LEVEL = 9, /* 18 saves 3 to 9 % more in ten times the time */
};

void weft_ktx2_size(const weft_baked *baked, weft_ktx2_format format, int size[2])
{
    const int block = format == WEFT_KTX2_UASTC ? 4 : 1;
    size[0] = (baked->width + block - 1) / block * block;
    size[1] = (baked->height + block - 1) / block * block;
}

static void pad_to(weft_text_buffer *out, size_t alignment)
{
    for (size_t gap = (alignment - out->n % alignment) % alignment; gap > 0; gap--)
        weft_text_add_bytes(out, "", 1);
}

/* The head of the basic data format descriptor (Khronos Data Format 1.3, section 5): data that is no colour
 * has no primaries. */
static void add_descriptor_head(weft_text_buffer *out, int model, int n_samples, bool srgb, int texels,
                                int bytes)
{
    const uint64_t size = BLOCK_HEAD_BYTES + SAMPLE_BYTES * (uint64_t)n_samples;
    weft_text_add_le(out, 4 + size, 4);
    weft_text_add_le(out, 0, 4); /* Khronos, basic format */
    weft_text_add_le(out, 2, 2); /* version of KDF 1.3 */
    weft_text_add_le(out, size, 2);
    weft_text_add_le(out, (uint64_t)model, 1);
    weft_text_add_le(out, srgb ? 1 : 0, 1); /* BT.709, or unspecified */
    weft_text_add_le(out, srgb ? 2 : 1, 1); /* sRGB, or linear */
    weft_text_add_le(out, 0, 1);            /* straight alpha */
    weft_text_add_le(out, (uint64_t)(texels - 1), 1);
    weft_text_add_le(out, (uint64_t)(texels - 1), 1);
    weft_text_add_le(out, 0, 2);
    weft_text_add_le(out, (uint64_t)bytes, 8); /* of the only plane, before supercompression */
}

static void add_sample(weft_text_buffer *out, int offset, int bits, int channel, uint64_t upper)
{
    weft_text_add_le(out, (uint64_t)offset, 2);
    weft_text_add_le(out, (uint64_t)(bits - 1), 1);
    weft_text_add_le(out, (uint64_t)channel, 1);
    weft_text_add_le(out, 0, 4);
    weft_text_add_le(out, 0, 4);
    weft_text_add_le(out, upper, 4);
}

static void add_descriptor(weft_text_buffer *out, weft_ktx2_format format, const weft_channels *channels)
{
    static const int ids[4] = {0, 1, 2, 15};
    const bool srgb = channels->srgb;
    if (format == WEFT_KTX2_UASTC) {
        add_descriptor_head(out, UASTC, 1, srgb, 4, 16);
        add_sample(out, 0, 128, channels->names[3] ? UASTC_RGBA : UASTC_RGB, 0xffffffff);
        return;
    }
    add_descriptor_head(out, RGBSDA, 4, srgb, 1, 4);
    for (int c = 0; c < 4; c++) /* alpha is linear also beside sRGB */
        add_sample(out, 8 * c, 8, ids[c] | (srgb && c == 3 ? 0x10 : 0), 255);
}

static void add_pair(weft_text_buffer *out, const char *key, const char *value)
{
    weft_text_add_le(out, strlen(key) + 1 + strlen(value) + 1, 4);
    weft_text_add_bytes(out, key, strlen(key) + 1);
    weft_text_add_bytes(out, value, strlen(value) + 1);
    pad_to(out, 4);
}

/* -- levels ------------------------------------------------------------------------------------------- */

typedef struct block_job {
    const weft_raster *raster;
    uint8_t *blocks;
} block_job;

/* Blocks over the edge repeat the last row and column. */
static void encode_rows(void *context, int band, int begin, int end)
{
    const block_job *const job = context;
    const weft_raster *const r = job->raster;
    const int across = (r->width + 3) / 4;
    (void)band;
    for (int row = begin; row < end; row++)
        for (int column = 0; column < across; column++) {
            uint8_t texels[16][4];
            for (int i = 0; i < 16; i++) {
                const int x = 4 * column + i % 4, y = 4 * row + i / 4;
                const size_t at = (size_t)(y < r->height ? y : r->height - 1) * (size_t)r->width +
                                  (size_t)(x < r->width ? x : r->width - 1);
                for (int c = 0; c < 4; c++)
                    texels[i][c] =
                        c < r->channels ? (uint8_t)r->data[at * (size_t)r->channels + (size_t)c] : 255;
            }
            weft_uastc_encode((const uint8_t(*)[4])texels, r->channels == 4,
                              job->blocks + 16 * ((size_t)row * (size_t)across + (size_t)column));
        }
}

/* A level without supercompression: the blocks, or the texels. */
static uint8_t *encode_level(const weft_raster *raster, weft_ktx2_format format, size_t *n, weft_error *err)
{
    const size_t w = (size_t)raster->width, h = (size_t)raster->height;
    *n = format == WEFT_KTX2_UASTC ? 16 * ((w + 3) / 4) * ((h + 3) / 4) : 4 * w * h;
    uint8_t *const bytes = weft_alloc(*n, 1, err);
    block_job job = {raster, bytes};
    if (bytes && format == WEFT_KTX2_UASTC)
        weft_parallel_rows((raster->height + 3) / 4, encode_rows, &job);
    for (size_t i = 0; bytes && format == WEFT_KTX2_RGBA8 && i < *n; i++)
        bytes[i] = (uint8_t)raster->data[i];
    return bytes;
}

static weft_err add_compressed(weft_text_buffer *out, const uint8_t *bytes, size_t n, weft_error *err)
{
    const size_t bound = ZSTD_compressBound(n);
    char *const packed = weft_alloc(bound, 1, err);
    if (!packed)
        return WEFT_ERR_NOMEM;
    const size_t size = ZSTD_compress(packed, bound, bytes, n, ZSTANDARD_LEVEL);
    weft_err status = WEFT_OK;
    if (ZSTD_isError(size))
        status = weft_fail(err, WEFT_ERR_NOMEM, "Zstandard: %s", ZSTD_getErrorName(size));
    else
        weft_text_add_bytes(out, packed, size);
    weft_free(packed);
    return status == WEFT_OK ? weft_text_buffer_status(out, err) : status;
}

/* Where a level lies, from the first byte of the levels on, and what it is before Zstandard. */
typedef struct extent {
    size_t offset, packed, plain;
} extent;

static weft_err add_level(weft_text_buffer *levels, const weft_baked *baked, const weft_channels *channels,
                          weft_ktx2_format format, const int size[2], int level, extent *where,
                          weft_error *err)
{
    weft_raster raster;
    const int w = size[0] >> level, h = size[1] >> level;
    WEFT_TRY(weft_channels_raster_sized(baked, channels, level, w > 0 ? w : 1, h > 0 ? h : 1, &raster, err));
    uint8_t *const bytes = encode_level(&raster, format, &where->plain, err);
    weft_raster_fini(&raster);
    where->offset = levels->n;
    const weft_err status = bytes ? add_compressed(levels, bytes, where->plain, err) : WEFT_ERR_NOMEM;
    where->packed = levels->n - where->offset;
    weft_free(bytes);
    return status;
}

/* -- the file ----------------------------------------------------------------------------------------- */

/* What stands before the levels: header, their index, descriptor, key/values (KTX 2.0, section 3).
 * Supercompressed levels need no alignment. */
static void add_head(weft_text_buffer *out, const weft_channels *channels, weft_ktx2_format format,
                     const int size[2], int n_levels, const extent *levels)
{
    static const char identifier[12] = {'\xAB', 'K',    'T',  'X',  ' ',    '2',
                                        '0',    '\xBB', '\r', '\n', '\x1A', '\n'};
    weft_text_buffer descriptor = {0}, pairs = {0};
    add_descriptor(&descriptor, format, channels);
    add_pair(&pairs, "KTXorientation", "rd");
    add_pair(&pairs, "KTXwriter", "Weft " WEFT_VERSION);
    const size_t dfd = HEADER_BYTES + (size_t)n_levels * LEVEL_BYTES, kvd = dfd + descriptor.n,
                 data = kvd + pairs.n;
    const uint64_t vk = format == WEFT_KTX2_UASTC ? VK_UNDEFINED
                        : channels->srgb          ? VK_R8G8B8A8_SRGB
                                                  : VK_R8G8B8A8_UNORM;
    const uint64_t header[] = {vk,
                               1,
                               (uint64_t)size[0],
                               (uint64_t)size[1],
                               0,
                               0,
                               1,
                               (uint64_t)n_levels,
                               ZSTANDARD,
                               dfd,
                               descriptor.n,
                               kvd,
                               pairs.n};
    weft_text_add_bytes(out, identifier, sizeof identifier);
    for (size_t i = 0; i < sizeof header / sizeof header[0]; i++)
        weft_text_add_le(out, header[i], 4);
    weft_text_add_le(out, 0, 8); /* no data for all levels together */
    weft_text_add_le(out, 0, 8);
    for (int level = 0; level < n_levels; level++) {
        weft_text_add_le(out, data + levels[level].offset, 8);
        weft_text_add_le(out, levels[level].packed, 8);
        weft_text_add_le(out, levels[level].plain, 8);
    }
    weft_text_add_bytes(out, descriptor.text, descriptor.n);
    weft_text_add_bytes(out, pairs.text, pairs.n);
    if (!out->failure.code && (descriptor.failure.code || pairs.failure.code))
        out->failure = descriptor.failure.code ? descriptor.failure : pairs.failure;
    weft_text_buffer_fini(&descriptor);
    weft_text_buffer_fini(&pairs);
}

weft_err weft_ktx2_encode(const weft_baked *baked, const weft_channels *channels, weft_ktx2_format format,
                          weft_text_buffer *out, weft_error *err)
{
    int size[2];
    weft_ktx2_size(baked, format, size);
    const int n_levels = weft_baked_levels(size[0], size[1]);
    extent levels[WEFT_BAKED_MAX_MIPS];
    weft_text_buffer data = {0};
    weft_err status = WEFT_OK;
    for (int level = n_levels - 1; status == WEFT_OK && level >= 0; level--) /* the smallest comes first */
        status = add_level(&data, baked, channels, format, size, level, &levels[level], err);
    if (status == WEFT_OK) {
        add_head(out, channels, format, size, n_levels, levels);
        weft_text_add_bytes(out, data.text, data.n);
        status = weft_text_buffer_status(out, err);
    }
    weft_text_buffer_fini(&data);
    return status;
}
