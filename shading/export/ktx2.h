/** KTX 2.0 textures in memory, with all their mips: plain RGBA of 8 bits, or UASTC for glTF, each
 *  level supercompressed with Zstandard. */
#ifndef WEFT_SHADING_EXPORT_KTX2_H
#define WEFT_SHADING_EXPORT_KTX2_H

#include "core/text_buffer.h"
#include "shading/export/channels.h"

typedef enum weft_ktx2_format {
    WEFT_KTX2_RGBA8, /* uncompressed; missing channels are said as "one" or "zero" */
    WEFT_KTX2_UASTC, /* KHR_texture_basisu: RGB, or RGBA where there is a fourth channel */
} weft_ktx2_format;

/**
 * Sides of a material's pictures in the file: its own, or for UASTC the next multiples of 4, which
 * KHR_texture_basisu asks for; its pictures are then brought to that size (channels.h).
 */
void weft_ktx2_size(const weft_baked *baked, weft_ktx2_format format, int size[2]);

/**
 * Encodes the levels of a picture as a file.
 * @param channels  bits are 8; of RGBA8 four names
 * @param out       appended to; its failures stick
 * @return WEFT_ERR_NOMEM
 */
weft_err weft_ktx2_encode(const weft_baked *baked, const weft_channels *channels, weft_ktx2_format format,
                          weft_text_buffer *out, weft_error *err);

#endif
