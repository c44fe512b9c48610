/**
 * UASTC LDR 4x4, the texture format that KHR_texture_basisu carries: 16 texels in 16 bytes, which readers
 * turn into whatever their GPU has (Basis Universal wiki, UASTC Texture Specification, public domain).
 *
 * Of the format's 19 modes those with one subset are written, which any decoder takes: one colour (8), a line
 * through the colours (0, 5, 18; with alpha 10, 12), and a line with one component that goes its own way
 * (6; with alpha 11), each fitted by least squares, the nearest kept.  Two-subset modes would gain little on
 * cloth, whose texels vary along its light and dark.
 *
 * The hints for ETC1 and ETC2 are simple ones: on GPUs with nothing but ETC the picture is a little coarser
 * than from a searching encoder; BC7, ASTC and plain RGBA do not look at them.
 */
#ifndef WEFT_SHADING_EXPORT_UASTC_H
#define WEFT_SHADING_EXPORT_UASTC_H

#include <stdbool.h>
#include <stdint.h>

/**
 * Encodes a block.
 * @param texels     [16][4], row by row, 0..255
 * @param has_alpha  false: alpha is not looked at and reads as 255
 * @param block      [16]
 */
void weft_uastc_encode(const uint8_t texels[16][4], bool has_alpha, uint8_t block[16]);

/** What any decoder makes of a block of those modes.  @return false for another mode */
bool weft_uastc_decode(const uint8_t block[16], uint8_t texels[16][4]);

#endif
