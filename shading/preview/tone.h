/** Tone curves: from scene-linear light to display-linear 0..1 that the sRGB curve then encodes. */
#ifndef WEFT_SHADING_PREVIEW_TONE_H
#define WEFT_SHADING_PREVIEW_TONE_H

#include "core/image.h"

typedef enum weft_tone {
    WEFT_TONE_NONE, /* cut at 1 */
    WEFT_TONE_ACES, /* per channel (x (2.51 x + 0.03))/(x (2.43 x + 0.59) + 0.14), Narkowicz 2015's fit to the
                       ACES reference, x times 0.6: like it, not it; bright colours keep their hue */
    WEFT_TONE_AGX,  /* log2 from -12.47 to 4.03 stops in a wider gamut, through a curve of sixth degree: a fit
                       to Sobotka's AgX by Wrensch; bright colours fade to white */
} weft_tone;

/** "none|aces|agx", in the order of the enum. */
extern const char weft_tone_names[];

/** One colour in place.  Not finite or negative values count as 0. */
void weft_tone_apply(weft_tone tone, double rgb[3]);

/** A picture of 3 planes in place; WEFT_TONE_NONE leaves it as it is. */
void weft_tone_image(weft_tone tone, weft_image *picture);

#endif
