/** ICC profiles for the colour spaces that Weft writes, so that a picture says what its numbers mean. */
#ifndef WEFT_CORE_FORMATS_ICC_PROFILE_H
#define WEFT_CORE_FORMATS_ICC_PROFILE_H

#include "core/formats/raster.h"
#include "core/text_buffer.h"

/**
 * Appends a matrix profile (ICC.1:2001-04, version 2.1) of BT.709 primaries with D65 white: linear, or with
 * the sRGB curve (1024 samples).  Colorants are adapted to D50 by Bradford.
 */
void weft_icc_profile(weft_transfer transfer, weft_text_buffer *profile);

#endif
