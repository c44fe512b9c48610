/** Masks of layers: from files, from what lies below, from noise. */
#ifndef WEFT_SHADING_MATERIAL_MASK_H
#define WEFT_SHADING_MATERIAL_MASK_H

#include "shading/bake/baked.h"
#include "shading/material/radattr.h"

/**
 * Evaluates a mask record over the layers below it.
 *
 * cavity is that of weft_relief_cavity() with a radius of 8 texels, height in mm about the mean, slope the
 * tangent of the tilt, noise three octaves of smooth value noise that repeats with the picture; all then map
 * :low to 0 and :high to 1, clamped.
 *
 * @param below  what has been composited so far; its width and height are the mask's
 * @param mask   1 plane, initialised here
 * @return as weft_texture_read(); WEFT_ERR_MISSING for a mask from a file without :name
 */
weft_err weft_mask_make(const weft_rad_record *record, const weft_baked *below, weft_image *mask,
                        weft_error *err);

#endif
