/** What GenICam cameras send: raw formats by name, and the quirks of models. */
#ifndef WEFT_HOST_CAMERA_ARAVIS_FORMATS_H
#define WEFT_HOST_CAMERA_ARAVIS_FORMATS_H

#include "core/image.h"

#include <stdint.h>

/** How the samples of a format lie in memory (GenICam PFNC 2.4, GigE Vision 2.0 section 27). */
typedef enum weft_packing {
    WEFT_PACKING_16,   /* little-endian 16 bit, right-aligned: 10, 12, 14 and 16 bit formats */
    WEFT_PACKING_8,    /* a byte each */
    WEFT_PACKING_P,    /* PFNC "10p", "12p", "14p": bit after bit, low bits first */
    WEFT_PACKING_12GV, /* GigE Vision "12Packed": high bytes outside, low nibbles in the middle byte */
} weft_packing;

/** A raw Bayer format. */
typedef struct weft_raw_format {
    char name[32]; /* "BayerRG16" */
    weft_cfa cfa;
    int bits;
    weft_packing packing;
} weft_raw_format;

/** The format with this GenICam name; false when it is no raw Bayer format. */
bool weft_raw_format_from_name(const char *name, weft_raw_format *format);

/** The format with the most bits (unpacked before packed) among `n` names; false when none is raw Bayer. */
bool weft_raw_format_best(const char *const *names, unsigned n, weft_raw_format *format);

/** Bytes of `n` samples. */
size_t weft_raw_format_bytes(const weft_raw_format *format, size_t n);

/** Unpacks `n` samples. */
void weft_raw_format_unpack(const weft_raw_format *format, const uint8_t *bytes, size_t n, uint16_t *samples);

/** What a model's number for gain means. */
typedef enum weft_gain_scale {
    WEFT_GAIN_DB,     /* linear = 10^(value / 20): the meaning of "Gain" in GenICam's SFNC */
    WEFT_GAIN_LINEAR, /* linear = value / unit */
    WEFT_GAIN_FIXED,  /* unknown: left where it is least, called 1 */
} weft_gain_scale;

/** What a model does not tell of itself. */
typedef struct weft_camera_quirk {
    const char *vendor, *model; /* of the camera's own description; "" ends the table */
    double black, white;        /* DN; white 0: all bits of the format */
    weft_gain_scale gain;
    double gain_unit; /* for WEFT_GAIN_LINEAR */
} weft_camera_quirk;

/** The row of this model, or NULL. */
const weft_camera_quirk *weft_camera_find_quirk(const char *vendor, const char *model);

#endif
