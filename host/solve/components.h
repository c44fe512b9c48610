/** Connected regions of marked pixels. */
#ifndef WEFT_HOST_SOLVE_COMPONENTS_H
#define WEFT_HOST_SOLVE_COMPONENTS_H

#include "core/image.h"

/** A mark: a pixel of a region, and one without which there is no region. */
enum { WEFT_MARK_WEAK = 1, WEFT_MARK_STRONG = 2 };

/** One region, pixels that touch by side or corner. */
typedef struct weft_component {
    size_t area, strong; /* pixels; of them strong ones */
    int left, top, right, bottom;
    double length; /* diagonal of its bounding box, pixels */
} weft_component;

/** Whether to keep a region; called once for each, row by row of their first pixels. */
typedef bool weft_component_keep_fn(const weft_component *component, void *context);

/**
 * Leaves 255 on the regions that have a strong pixel and that `keep` wants, 0 elsewhere.
 *
 * @param marks  0, WEFT_MARK_WEAK or WEFT_MARK_STRONG
 * @return WEFT_ERR_NOMEM
 */
weft_err weft_components_keep(weft_mask *marks, weft_component_keep_fn *keep, void *context, weft_error *err);

#endif
