/** Which places of a height field see a light: rays marched over the relief (S-BLG-06). */
#ifndef WEFT_SHADING_PREVIEW_HEIGHT_SHADOW_H
#define WEFT_SHADING_PREVIEW_HEIGHT_SHADOW_H

#include "core/image.h"

#include <stdbool.h>

/** Texels along a side of a tile, whose highest place says whether a ray can be met there at all. */
#define WEFT_HEIGHT_TILE 8

/** Texels of the longest step that misses nothing worth it. */
#define WEFT_HEIGHT_STEP 0.25

/** Rays end at this many texels: a relief that shadows farther is not cloth. */
#define WEFT_HEIGHT_REACH 512

/** A rectangle of a height map, and what lies beyond it. */
typedef struct weft_height_field {
    const weft_image *height;   /* 1 plane, mm; values that are not finite are holes at height 0 */
    double per_mm;              /* texels in a mm */
    int x, y, width, height_px; /* the rectangle, in texels of the map */
    bool mirrored;    /* it repeats mirrored for ever; else only the map's own texels throw shadows */
    weft_image tiles; /* 1 plane: the highest texel of the tile and its eight neighbours, texels */
} weft_height_field;

/** How a ray is marched. */
typedef struct weft_height_march {
    int steps;     /* at most, between the first and the last place where the ray may be met */
    double dither; /* 0..1: where in a coarse step the ray is looked at; fine ones are in the middle */
} weft_height_march;

typedef struct weft_height_look {
    bool lit;
    bool coarse; /* the steps were longer than WEFT_HEIGHT_STEP: other dithers may say otherwise */
} weft_height_look;

/** Borrows the map.  @return WEFT_ERR_RANGE for a scale that is no scale, WEFT_ERR_NOMEM */
weft_err weft_height_field_init(weft_height_field *field, const weft_image *height_mm, double mm_per_px,
                                weft_error *err);
/** Makes the rectangle of the map repeat mirrored at its edges, as the preview's round shapes do. */
void weft_height_field_mirror(weft_height_field *field, int x, int y, int width, int height);
void weft_height_field_fini(weft_height_field *field);

/** Bilinear height in texels at a place in texels of the map. */
double weft_height_field_at(const weft_height_field *field, double u, double v);

/**
 * Whether the light reaches the surface at (u, v) past the relief.
 *
 * The ray starts at the surface and is looked at `steps` times: the stretch between the first and the last
 * tile that is high enough is cut into steps of WEFT_HEIGHT_STEP, or fewer and longer ones when that were
 * too many, in which case thin ridges are missed at some dithers and met at others.
 *
 * @param light  tangent frame: x along the rows, y up (rows go down), z out; z <= 0 is dark
 */
weft_height_look weft_height_field_look(const weft_height_field *field, double u, double v,
                                        const double light[3], weft_height_march march);

#endif
