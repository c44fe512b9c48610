/**
 * The maps of a surface as one texture: chains of mips, all quantities of a texel side by side in 16 bits, so
 * that a look-up is one load.
 *
 * Made once for a material and used for any number of pictures of it; a picture that finds none makes its
 * own. Which maps are in it and how much of the chains, the surface says when the texture is made.
 */
#ifndef WEFT_SHADING_PREVIEW_TEXTURE_H
#define WEFT_SHADING_PREVIEW_TEXTURE_H

#include "core/error.h"

#include <stdint.h>

struct weft_preview_surface;

#define WEFT_PREVIEW_MAX_LEVELS   16
#define WEFT_PREVIEW_MAX_CHANNELS 24 /* 3 of the normal and the planes of a model, in eights */

typedef struct weft_preview_texture {
    int first, levels; /* first..levels-1 of the chain are here */
    int width[WEFT_PREVIEW_MAX_LEVELS], height[WEFT_PREVIEW_MAX_LEVELS];
    const int16_t *level[WEFT_PREVIEW_MAX_LEVELS]; /* [height][width][stride] */
    int stride, channels;                          /* stride is a multiple of 8 */
    int plane[WEFT_PREVIEW_MAX_CHANNELS];          /* of the parameters; -1, -2, -3: normal x, y, z */
    float scale[WEFT_PREVIEW_MAX_CHANNELS], offset[WEFT_PREVIEW_MAX_CHANNELS]; /* value = offset + scale q */
    int16_t *texels;
} weft_preview_texture;

/** Levels that all maps of a surface have; 1 when one of them has no chain, 0 without maps. */
int weft_preview_surface_levels(const struct weft_preview_surface *surface);

/**
 * Packs the levels from `first` on.  Parameters are kept as 1/65535 of their range, normals as 1/32767.
 * @return WEFT_ERR_NOMEM
 */
weft_err weft_preview_texture_init(weft_preview_texture *texture, const struct weft_preview_surface *surface,
                                   int first, weft_error *err);

/** `{0}` is fine. */
void weft_preview_texture_fini(weft_preview_texture *texture);

#endif
