/** Image files as textures of a material: found, decoded and brought to the size of the bake. */
#ifndef WEFT_SHADING_MATERIAL_TEXTURE_H
#define WEFT_SHADING_MATERIAL_TEXTURE_H

#include "core/image.h"
#include "shading/material/radattr.h"

typedef enum weft_texture_use {
    WEFT_TEXTURE_SCALAR, /* 1 plane; the mean of RGB where no channel is named; linear unless :transfer says
                            so */
    WEFT_TEXTURE_COLOUR, /* 3 planes, linear BT.709; PNG, TIFF and JPEG are sRGB unless :transfer says so */
    WEFT_TEXTURE_NORMAL, /* 3 planes, unit; integers decoded as 2v - 1, :green = down turned up */
} weft_texture_use;

/**
 * The path of a file that a property names: beside the text that names it; without an ending, .exr .png .tif
 * .tiff .jpg .jpeg are tried in turn.  Free with weft_free().
 * @return WEFT_ERR_MISSING with the place in the text and the path that was looked at
 */
weft_err weft_texture_path(const weft_rad_value *name, char **path, weft_error *err);

/** Reads a texture record (:name, :channel, :transfer, :green, :scale, :offset) at its own size.
 *  @return as weft_image_read(), with the place in the text in front */
weft_err weft_texture_read(const weft_rad_record *record, weft_texture_use use, weft_image *image,
                           weft_error *err);

/**
 * `image` repeated tiling[0] times across and tiling[1] times down over w x h texels: linear between texels,
 * the mean over the texel where the image is finer; it wraps at its edges.  Normals are made unit again.
 */
weft_err weft_texture_resample(const weft_image *image, weft_texture_use use, int w, int h,
                               const double tiling[2], weft_image *out, weft_error *err);

/** Where a text says something, for the front of a message: "coat.radattr:12:5"; in a rotating buffer a
 *  thread. */
const char *weft_place_text(weft_place place);

#endif
