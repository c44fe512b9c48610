#include "host/solve/solve_mask.h"

#include "host/set/plate.h"

/* A cell is inside when its four sites are. */
static weft_err halve_mask(weft_mask *mask, weft_error *err)
{
    weft_mask half;
    WEFT_TRY(weft_mask_init(&half, mask->width / 2, mask->height / 2, 0, err));
    for (int j = 0; j < half.height; j++)
        for (int i = 0; i < half.width; i++) {
            const uint8_t *const a = mask->data + (size_t)(2 * j) * (size_t)mask->width + (size_t)(2 * i);
            const uint8_t *const b = a + mask->width;
            half.data[(size_t)j * (size_t)half.width + (size_t)i] = a[0] && a[1] && b[0] && b[1] ? 255 : 0;
        }
    weft_mask_fini(mask);
    *mask = half;
    return WEFT_OK;
}

weft_err weft_solve_load_mask(const weft_set *set, bool half, weft_mask *mask, weft_error *err)
{
    if (!set->mask_file)
        return WEFT_OK;
    WEFT_TRY(weft_set_load_mask(set, mask, err));
    if (mask->width != set->width || mask->height != set->height)
        return weft_fail(err, WEFT_ERR_MISMATCH, "%s/%s has %d x %d pixels, the set has %d x %d", set->folder,
                         set->mask_file, mask->width, mask->height, set->width, set->height);
    return half ? halve_mask(mask, err) : WEFT_OK;
}
