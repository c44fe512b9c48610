/** Anybody's map: what it is by its name, and its numbers. */
#ifndef WEFT_SHADING_EXPORT_MAP_READ_H
#define WEFT_SHADING_EXPORT_MAP_READ_H

#include "core/image.h"

enum { WEFT_MAP_LONGEST_NAME = 256 };

typedef enum weft_map_kind {
    WEFT_MAP_NORMAL,    /* x right, y up or down, z out of the surface */
    WEFT_MAP_ALBEDO,    /* colour */
    WEFT_MAP_SPECULAR,  /* F0 */
    WEFT_MAP_ROUGHNESS, /* roughness, gloss: filtered mips change its mean */
    WEFT_MAP_SCALAR,    /* occlusion, height, metal: numbers */
    WEFT_MAP_OTHER,
} weft_map_kind;

/** By the words of the name, as studios and libraries of textures use them: fabric_Normal-dx.png,
 *  cloth_nor_gl.exr, Fabric032_1K_Color.jpg, wall_ao.tif.  WEFT_MAP_OTHER where none is known.
 *  @param prefix  gets what stands before the word, in lower case: the same for the maps of one set */
weft_map_kind weft_map_kind_of(const char *path, char prefix[WEFT_MAP_LONGEST_NAME]);

/** Planes of a map as its file has them, all levels of mips. */
typedef struct weft_map {
    weft_map_kind kind;
    int n_levels; /* 1 without mips */
    weft_image levels[16];
    char prefix[WEFT_MAP_LONGEST_NAME];
    bool is_coded; /* normals: 0..1 stands for -1..1; they are decoded here */
} weft_map;

/**
 * Reads EXR (R G B, X Y Z, Y, or else its first channel), PNG, TIFF and JPEG; integers of colours as sRGB, of
 * F0 where they have 8 bits.
 * @return WEFT_ERR_MISSING when there is no such file; otherwise as weft_image_read()
 */
weft_err weft_map_read(const char *path, weft_map *map, weft_error *err);

/** Frees the levels; `{0}` is fine. */
void weft_map_fini(weft_map *map);

#endif
