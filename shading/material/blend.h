/** One composited material over another; used by the compositor. */
#ifndef WEFT_SHADING_MATERIAL_BLEND_H
#define WEFT_SHADING_MATERIAL_BLEND_H

#include "shading/bake/baked.h"

/** Groups of quantities that a layer can be limited to. */
enum { WEFT_BLEND_ALBEDO = 1, WEFT_BLEND_SPECULAR = 2, WEFT_BLEND_NORMAL = 4, WEFT_BLEND_ALL = 7 };

/**
 * below <- lerp(below, above, weight) for the quantities of `channels`.
 *
 * @param mask      [height][width] of below, or NULL for 1 everywhere
 * @param alpha     multiplies the mask
 * @param reorient  normals of `above` are details on those below (S-COD-07) instead of replacing them
 * @return WEFT_ERR_UNSUPPORTED for anisotropic with cloth; WEFT_ERR_MISMATCH; WEFT_ERR_NOMEM
 */
weft_err weft_blend(weft_baked *below, const weft_baked *above, const float *mask, double alpha,
                    unsigned channels, bool reorient, weft_error *err);

/** Turns a constant into a map full of it, so that it can vary.  Needs baked->width and height. */
weft_err weft_blend_spread(weft_baked *baked, weft_baked_kind kind, weft_error *err);

#endif
