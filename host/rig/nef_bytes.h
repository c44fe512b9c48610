/** A Nikon D5100 raw file in memory, as the virtual DSLR hands it out. */
#ifndef WEFT_HOST_RIG_NEF_BYTES_H
#define WEFT_HOST_RIG_NEF_BYTES_H

#include "core/error.h"

#include <stddef.h>
#include <stdint.h>

/** LibRaw crops a D5100 file by so many columns at the right (the masked photosites of the sensor). */
#define WEFT_NEF_MASKED_COLUMNS 44
/** Where the numbers of a D5100 end.  Its black is 0: the body subtracts it. */
#define WEFT_NEF_WHITE 15846

typedef struct weft_nef_info {
    int width, height;                   /* of the picture */
    uint32_t exposure_num, exposure_den; /* seconds as a fraction, as the body shows them */
    unsigned iso;
    const char *serial;
    char date_time[20]; /* "2026:11:23 10:00:00" */
} weft_nef_info;

/**
 * An uncompressed 14-bit RGGB NEF: a little-endian TIFF with Nikon's Make and Model, CFA tags and an EXIF
 * directory; 16 bits per sample.  LibRaw, dcraw and exiftool take it for a D5100's file.  (Bodies compress
 * their NEFs with Nikon's own Huffman code; decoding that is LibRaw's own affair, and is not covered by
 * this.)
 *
 * @param dn     [height][width], black_dn at no light, white_dn at saturation: scaled to 0..WEFT_NEF_WHITE
 * @param bytes  weft_free() it
 */
weft_err weft_nef_make(const weft_nef_info *info, const uint16_t *dn, double black_dn, double white_dn,
                       uint8_t **bytes, size_t *n_bytes, weft_error *err);

#endif
