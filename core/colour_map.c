#include "core/colour_map.h"

#include <math.h>

enum { STATIONS = 9 };

/* Nine stations each, 8-bit sRGB codes, straight lines between. */
static const unsigned char stations[2][STATIONS][3] = {
    /* viridis, van der Walt and Smith 2015, CC0 */
    {{68, 1, 84},
     {71, 44, 122},
     {59, 81, 139},
     {44, 113, 142},
     {33, 144, 141},
     {39, 173, 129},
     {92, 200, 99},
     {170, 220, 50},
     {253, 231, 37}},
    /* "cool to warm" after Moreland 2009: hues of equal luminance on both sides of light grey */
    {{59, 76, 192},
     {98, 130, 234},
     {141, 176, 254},
     {184, 208, 249},
     {221, 221, 221},
     {245, 196, 173},
     {244, 154, 123},
     {222, 96, 77},
     {180, 4, 38}},
};

void weft_colour_map_get(weft_colour_map map, double t, double rgb[3])
{
    if (isnan(t)) {
        rgb[0] = rgb[1] = rgb[2] = 0.5;
        return;
    }
    const double clamped = t < 0 ? 0 : t > 1 ? 1 : t;
    if (map == WEFT_MAP_GREY) {
        rgb[0] = rgb[1] = rgb[2] = clamped;
        return;
    }
    const double at = (STATIONS - 1) * clamped;
    const int first = at < STATIONS - 2 ? (int)at : STATIONS - 2;
    const unsigned char *const a = stations[map][first], *const b = stations[map][first + 1];
    for (int c = 0; c < 3; c++)
        rgb[c] = (a[c] + (at - first) * (b[c] - a[c])) / 255;
}
