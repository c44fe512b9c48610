/** OpenEXR files through its C core: scan lines, ZIP, named half and float channels. */
#ifndef WEFT_CORE_FORMATS_EXR_FILE_H
#define WEFT_CORE_FORMATS_EXR_FILE_H

#include "core/error.h"
#include "core/image.h"

typedef enum weft_exr_type { WEFT_EXR_HALF, WEFT_EXR_FLOAT } weft_exr_type;

/**
 * Writes the planes of an image as channels, whole or not at all.
 *
 * @param names  one name per plane ("R", "normal.X", "Y"), any order; the file sorts them
 * @param type   stored type of all channels; half overflows to the largest finite half
 */
weft_err weft_exr_write(const char *path, const weft_image *image, const char *const *names,
                        weft_exr_type type, weft_error *err);

/**
 * Reads the channels that are asked for, in the order asked for, as float (half, float and uint files;
 * any compression that OpenEXR knows; scan lines or one-level tiles).
 *
 * @param names    `n` wanted channels; each may list alternatives: "X|R" takes X or else R
 * @return WEFT_ERR_FORMAT for a damaged file, WEFT_ERR_MISSING naming channel, file and what it has
 */
weft_err weft_exr_read(const char *path, const char *const *names, int n, weft_image *image, weft_error *err);

/** As weft_exr_read() for one level of mips, 0 being the picture itself.  @return also WEFT_ERR_MISSING */
weft_err weft_exr_read_level(const char *path, const char *const *names, int n, int level, weft_image *image,
                             weft_error *err);

/** How many levels a file has; 1 without mips. */
weft_err weft_exr_levels(const char *path, int *levels, weft_error *err);

/**
 * Writes a chain of mips as a tiled file, whole or not at all.
 * @param levels  level l is max(1, w >> l) x max(1, h >> l); all levels down to 1 x 1
 */
weft_err weft_exr_write_mips(const char *path, const weft_image *levels, int n_levels,
                             const char *const *names, weft_exr_type type, weft_error *err);

/** The channel names of a file as one text "B,G,R"; free with weft_free(). */
weft_err weft_exr_channels(const char *path, char **names, weft_error *err);

#endif
