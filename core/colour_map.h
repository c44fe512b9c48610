/** Colours for numbers: what false-colour pictures are painted with. */
#ifndef WEFT_CORE_COLOUR_MAP_H
#define WEFT_CORE_COLOUR_MAP_H

typedef enum weft_colour_map {
    WEFT_MAP_VIRIDIS,   /* from low to high; equal steps look equal, also to the colour-blind and in grey */
    WEFT_MAP_DIVERGING, /* blue below the middle, red above, nearly white in it: for signed deviations */
    WEFT_MAP_GREY,      /* black to white */
} weft_colour_map;

/**
 * The colour of t.
 *
 * @param t    0..1, clamped; NaN gives middle grey
 * @param rgb  sRGB codes as numbers 0..1 (encoded, not linear)
 */
void weft_colour_map_get(weft_colour_map map, double t, double rgb[3]);

#endif
