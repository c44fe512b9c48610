/*
 * KTX 2.0 textures with the whole chain of filtered mips, RGBA of 8 bits: what an engine can load as it is,
 * without making mips of its own that forget what normals do to roughness.
 */
#include "shading/export/exporter.h"

#include "core/file.h"
#include "core/mem.h"
#include "core/text_buffer.h"
#include "core/version.h"
#include "shading/export/channels.h"

#include <string.h>

enum {
    VK_R8G8B8A8_UNORM = 37,
    VK_R8G8B8A8_SRGB = 43,
    HEADER_BYTES = 80,
    LEVEL_BYTES = 24,
    DFD_BYTES = 4 + 24 + 4 * 16
};

static void pad_to(weft_text_buffer *out, size_t alignment)
{
    while (out->n % alignment)
        weft_text_add_bytes(out, "", 1);
}

/* The basic data format descriptor of RGBA8 (Khronos Data Format 1.3, section 5): data that is no colour has
 * no primaries, and alpha is linear also beside sRGB. */
static void add_descriptor(weft_text_buffer *out, bool srgb)
{
    static const int ids[4] = {0, 1, 2, 15};
    weft_text_add_le(out, DFD_BYTES, 4);
    weft_text_add_le(out, 0, 4); /* Khronos, basic format */
    weft_text_add_le(out, 2, 2); /* version of KDF 1.3 */
    weft_text_add_le(out, DFD_BYTES - 4, 2);
    weft_text_add_le(out, 1, 1);            /* RGBSDA */
    weft_text_add_le(out, srgb ? 1 : 0, 1); /* BT.709, or unspecified */
    weft_text_add_le(out, srgb ? 2 : 1, 1); /* sRGB, or linear */
    weft_text_add_le(out, 0, 1);            /* straight alpha */
    weft_text_add_le(out, 0, 4);            /* texel blocks of 1 x 1 x 1 x 1 */
    weft_text_add_le(out, 4, 8);            /* bytes of the only plane */
    for (int c = 0; c < 4; c++) {
        weft_text_add_le(out, 8 * (uint64_t)c, 2);
        weft_text_add_le(out, 7, 1); /* 8 bits */
        weft_text_add_le(out, (uint64_t)(ids[c] | (srgb && c == 3 ? 0x10 : 0)), 1);
        weft_text_add_le(out, 0, 4);
        weft_text_add_le(out, 0, 4);
        weft_text_add_le(out, 255, 4);
    }
}

static void add_pair(weft_text_buffer *out, const char *key, const char *value)
{
    weft_text_add_le(out, strlen(key) + 1 + strlen(value) + 1, 4);
    weft_text_add_bytes(out, key, strlen(key) + 1);
    weft_text_add_bytes(out, value, strlen(value) + 1);
    pad_to(out, 4);
}

static weft_err add_level(weft_text_buffer *out, const weft_baked *baked, const weft_channels *channels,
                          int level, weft_error *err)
{
    weft_raster raster;
    WEFT_TRY(weft_channels_raster(baked, channels, level, &raster, err));
    const size_t n = (size_t)raster.width * (size_t)raster.height * (size_t)raster.channels;
    char *const bytes = weft_alloc(n, 1, err);
    for (size_t i = 0; bytes && i < n; i++)
        bytes[i] = (char)raster.data[i];
    if (bytes)
        weft_text_add_bytes(out, bytes, n);
    weft_free(bytes);
    weft_raster_fini(&raster);
    return bytes ? WEFT_OK : WEFT_ERR_NOMEM;
}

/* Header, index, descriptor, key/values, then the levels from the smallest to the largest (KTX 2.0, section
 * 3). */
static weft_err write_texture(const weft_export_job *job, const char *suffix, const weft_channels *channels,
                              weft_error *err)
{
    const weft_baked *const b = job->baked;
    const int levels = weft_baked_levels(b->width, b->height);
    weft_text_buffer out = {0}, pairs = {0};
    static const char identifier[12] = {'\xAB', 'K',    'T',  'X',  ' ',    '2',
                                        '0',    '\xBB', '\r', '\n', '\x1A', '\n'};
    char *const path = weft_asprintf(err, "%s/%s_%s.ktx2", job->folder, b->name, suffix);
    add_pair(&pairs, "KTXorientation", "rd");
    add_pair(&pairs, "KTXwriter", "Weft " WEFT_VERSION);
    const size_t dfd = HEADER_BYTES + (size_t)levels * LEVEL_BYTES, kvd = dfd + DFD_BYTES;
    weft_text_add_bytes(&out, identifier, sizeof identifier);
    const uint64_t header[] = {channels->srgb ? VK_R8G8B8A8_SRGB : VK_R8G8B8A8_UNORM,
                               1,
                               (uint64_t)b->width,
                               (uint64_t)b->height,
                               0,
                               0,
                               1,
                               (uint64_t)levels,
                               0,
                               dfd,
                               DFD_BYTES,
                               kvd,
                               pairs.n};
    for (size_t i = 0; i < sizeof header / sizeof header[0]; i++)
        weft_text_add_le(&out, header[i], 4);
    weft_text_add_le(&out, 0, 16); /* no supercompression data */
    size_t offset = kvd + pairs.n, offsets[WEFT_BAKED_MAX_MIPS], sizes[WEFT_BAKED_MAX_MIPS];
    for (int level = levels - 1; level >= 0; level--) {
        const int w = b->width >> level, h = b->height >> level;
        sizes[level] = 4 * (size_t)(w > 0 ? w : 1) * (size_t)(h > 0 ? h : 1);
        offsets[level] = offset;
        offset += sizes[level];
    }
    for (int level = 0; level < levels; level++) {
        weft_text_add_le(&out, offsets[level], 8);
        weft_text_add_le(&out, sizes[level], 8);
        weft_text_add_le(&out, sizes[level], 8);
    }
    add_descriptor(&out, channels->srgb);
    weft_text_add_bytes(&out, pairs.text, pairs.n);
    weft_err status = path ? WEFT_OK : WEFT_ERR_NOMEM;
    for (int level = levels - 1; level >= 0 && status == WEFT_OK; level--)
        status = add_level(&out, b, channels, level, err);
    if (status == WEFT_OK)
        status = weft_text_buffer_status(&out, err);
    if (status == WEFT_OK)
        status = weft_file_write(path, out.text, out.n, err);
    weft_text_buffer_fini(&out);
    weft_text_buffer_fini(&pairs);
    weft_free(path);
    return status;
}

static weft_err write(const weft_export_job *job, weft_error *err)
{
    static const struct {
        const char *suffix;
        weft_channels channels;
    } textures[] = {{"base_color", {{"base.r", "base.g", "base.b", "opacity"}, 8, true}},
                    {"normal", {{"normal.x", "normal.y", "normal.z", "one"}, 8, false}},
                    {"orm", {{"occlusion", "roughness", "metallic", "one"}, 8, false}}};
    for (size_t i = 0; i < sizeof textures / sizeof textures[0]; i++) {
        bool varies = false;
        for (int c = 0; c < 4; c++)
            varies = varies || weft_channel_varies(job->baked, textures[i].channels.names[c]);
        if (varies)
            WEFT_TRY(write_texture(job, textures[i].suffix, &textures[i].channels, err));
    }
    weft_export_lose(
        job, "glTF: KHR_texture_basisu wants Basis compression, so these stand beside the .glb, not in it");
    weft_export_lose(job, "cloth lobe, anisotropy, height: not in these textures");
    if (job->baked->two_lobes)
        weft_export_lose(job, "two lobes: roughness is the smooth part's, the colour is that of both");
    return WEFT_OK;
}

const weft_exporter weft_exporter_ktx2 = {
    .name = "ktx2",
    .summary = "KTX 2.0 textures that carry the filtered mips",
    .version = 1,
    .write = write,
};
