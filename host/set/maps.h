/** Solved maps: `NAME.maps/` (docs/formats.md). */
#ifndef WEFT_HOST_SET_MAPS_H
#define WEFT_HOST_SET_MAPS_H

#include "core/error.h"
#include "core/image.h"
#include "host/set/flaw_bits.h"

#include <jansson.h>
#include <stdbool.h>

#define WEFT_MAPS_VERSION 1

typedef enum weft_geometry { WEFT_GEOMETRY_PLANE, WEFT_GEOMETRY_SENSOR } weft_geometry;

typedef struct weft_maps {
    int width, height;
    weft_geometry geometry;
    double mm_per_px;       /* plane only, else 0 */
    double origin_mm[2];    /* plane only: world x, y of the centre of pixel (0, 0); +y is up, rows go down */
    weft_image normal;      /* 3 planes X, Y, Z, unit; (0,0,0) where there is no answer */
    weft_image albedo;      /* 3 planes linear; planes 0 when absent */
    weft_image residual;    /* 1 plane; planes 0 when absent */
    weft_image confidence;  /* 1 plane 0..1; planes 0 when absent */
    weft_image uncertainty; /* 1 plane: expected error of the normal, rms, degrees; planes 0 when absent */
    weft_image
        height_mm; /* 1 plane: height of the surface, mean 0, mm; planes 0 when absent; written, not read */
    weft_image alpha;    /* 1 plane 0..1: share of the pixel that the sample covers; planes 0 when absent */
    weft_mask flaws;     /* weft_flaw bits; data NULL when absent */
    weft_mask lights;    /* lights that each answer rests on; data NULL when absent */
    weft_mask quality;   /* bits of docs/formats.md; data NULL when absent */
    weft_mask mask;      /* 255 where there is an answer; data NULL: everywhere */
    bool albedo_is_srgb; /* linear sRGB (colour calibrated), else camera RGB */
    json_t *info;        /* inputs with hashes, options, version, timings: goes into maps.json; may be NULL */
} weft_maps;

void weft_maps_fini(weft_maps *maps);

/** Writes the folder with EXR maps and the PNGs for looking at, whole or not at all. */
weft_err weft_maps_save(const char *folder, const weft_maps *maps, bool force, weft_error *err);

/** Reads a folder that has at least normal.exr or albedo.exr; maps.json may be absent (then sensor
 *  geometry).  Sizes must agree.  Pixels with a zero or non-finite normal are taken out of the mask. */
weft_err weft_maps_load(const char *folder, weft_maps *maps, weft_error *err);

#endif
