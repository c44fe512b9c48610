/** A small bitmap font of our own, for labels on contact sheets. */
#ifndef WEFT_SHADING_PREVIEW_FONT_H
#define WEFT_SHADING_PREVIEW_FONT_H

#include "core/image.h"

#define WEFT_FONT_WIDTH  6 /* pixels from letter to letter at scale 1; the letters are 5 wide */
#define WEFT_FONT_HEIGHT 8 /* of them the last is for descenders */

/** Draws ASCII text with its upper left corner at (x, y), cut at the edges of the picture; other bytes show
 *  as '?', one for each letter of UTF-8. */
void weft_font_draw(weft_image *image, int x, int y, int scale, const char *text, float grey);

/** Width of a text in pixels. */
int weft_font_width(int scale, const char *text);

#endif
