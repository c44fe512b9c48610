/** The raw formats of libcamera by name: "SRGGB16", "SBGGR12", "SGRBG10_CSI2P". */
#ifndef WEFT_HOST_CAMERA_LIBCAMERA_FORMATS_H
#define WEFT_HOST_CAMERA_LIBCAMERA_FORMATS_H

#include "core/image.h"

typedef struct weft_raw_layout {
    weft_cfa cfa;
    int bits;
    bool csi2; /* MIPI CSI-2 packing: the high bytes of a group of samples, then a byte of their low bits */
} weft_raw_layout;

/** False for a format that is no raw Bayer format, or packed in a way that is not known. */
bool weft_raw_layout_from_name(const char *name, weft_raw_layout *layout);

/** Bytes of a row of `width` samples. */
size_t weft_raw_layout_row_bytes(const weft_raw_layout *layout, int width);

/** Unpacks a row.  CSI-2: MIPI CSI-2 v1.3, 11.4.4 (RAW10), 11.4.5 (RAW12), 11.4.6 (RAW14). */
void weft_raw_layout_unpack(const weft_raw_layout *layout, const uint8_t *bytes, int width,
                            uint16_t *samples);

#endif
