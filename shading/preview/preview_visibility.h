/**
 * Which places of a picture each lamp reaches: a buffer beside the picture, made before it is shaded.
 *
 * A place is looked up once (a ray through the relief, the folds, or both), its start dithered by Bayer's
 * matrix; the bilateral blur over five by five places, whose weights see each value of the matrix equally
 * often, turns the dots into shares.  Large lamps are dithered too: each place looks at another point of
 * the lamp, so that their shadows are soft.  Source: S-BLG-06, S-BLG-09, S-BLG-10.
 */
#ifndef WEFT_SHADING_PREVIEW_VISIBILITY_H
#define WEFT_SHADING_PREVIEW_VISIBILITY_H

#include "shading/preview/height_shadow.h"
#include "shading/preview/preview_samples.h"
#include "shading/preview/voxel_grid.h"

typedef struct weft_preview_visibility {
    int scale;               /* places along a side of a pixel */
    weft_image lit;          /* a plane for each lamp: the share of it that is seen, 0..1 */
    weft_image depth;        /* 1 plane: towards the viewer, map texels; NaN beside the sample */
    weft_height_field field; /* height NULL: the relief throws no shadows */
    weft_voxels voxels;      /* bits NULL: the folds are asked by their formula */
} weft_preview_visibility;

/** The drape's mesh as voxels, `n_across` of them along its width; lengths in half widths. */
weft_err weft_preview_drape_voxels(weft_voxels *voxels, int n_across, weft_error *err);

/** Makes the buffer of a view that wants it; `setup` is complete but for its visibility. */
weft_err weft_preview_visibility_init(weft_preview_visibility *visibility, const weft_preview_setup *setup,
                                      weft_error *err);
void weft_preview_visibility_fini(weft_preview_visibility *visibility);

/** Fills the samples of a run of the buffer: hit, u, v, axis and eye at its places from `first` on. */
void weft_preview_visibility_hit(const weft_preview_setup *setup, const weft_preview_visibility *visibility,
                                 int first, int row, weft_preview_samples *samples);

/** Fills s->visible for a lamp of the view. */
void weft_preview_see(const weft_preview_setup *setup, int light, weft_preview_samples *s);

#endif
