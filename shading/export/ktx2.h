/** KTX 2.0 textures in memory, with all their mips: plain RGBA of 8 bits, or UASTC for glTF. */
#ifndef WEFT_SHADING_EXPORT_KTX2_H
#define WEFT_SHADING_EXPORT_KTX2_H

#include "core/text_buffer.h"
#include "shading/export/channels.h"

typedef enum weft_ktx2_format {
    WEFT_KTX2_RGBA8, /* uncompressed; missing channels are said as "one" or "zero" */
    WEFT_KTX2_UASTC, /* KHR_texture_basisu: RGB, or RGBA where there is a fourth channel */
} weft_ktx2_format;

/** Whether KHR_texture_basisu takes pictures of this size: multiples of 4. */
bool weft_ktx2_is_basisu_size(int width, int height);

/**
 * Encodes the levels of a picture as a file.
 * @param channels  bits are 8; of RGBA8 four names
 * @param out       appended to; its failures stick
 * @return WEFT_ERR_NOMEM
 */
weft_err weft_ktx2_encode(const weft_baked *baked, const weft_channels *channels, weft_ktx2_format format,
                          weft_text_buffer *out, weft_error *err);

#endif
