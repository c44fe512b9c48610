#include "tests/host/cloth_piece.h"

#include "host/rig/fabric.h"
#include "tests/support/support.h"

#include <string.h>

static const weft_weave *find_weave(const char *name)
{
    const weft_weave *weave = weft_weaves;
    while (weave->name && strcmp(weave->name, name) != 0)
        weave++;
    assert_non_null(weave->name);
    return weave;
}

void cloth_piece_init(cloth_piece *piece, const char *name, int w, int h, double mm_per_px)
{
    const weft_weave *const weave = find_weave(name);
    weft_fabric cloth;
    assert_ok(weft_fabric_init(&cloth, weave, 1, err));
    assert_ok(weft_image_init(&piece->normal, w, h, 3, err));
    assert_ok(weft_image_init(&piece->albedo, w, h, 1, err));
    for (int c = 0; c < 2; c++)
        assert_ok(weft_image_init(&piece->count[c], w, h, 1, err));
    piece->mm_per_px = mm_per_px;
    piece->threads_per_mm[0] = 1 / weave->warp_pitch_mm;
    piece->threads_per_mm[1] = 1 / weave->weft_pitch_mm;
    piece->draft = weave->n_draft;
    for (int y = 0; y < h; y++)
        for (int x = 0; x < w; x++) {
            const float x_mm = (float)((x - 0.5 * (w - 1)) * mm_per_px),
                        y_mm = (float)((0.5 * (h - 1) - y) * mm_per_px);
            const weft_fabric_patch patch = weft_fabric_patch_at(&cloth, x_mm, y_mm);
            weft_fabric_point at;
            weft_fabric_meet(&cloth, &patch, x_mm, y_mm, 0, 0, &at);
            const float length = sqrtf(at.slope_x * at.slope_x + at.slope_y * at.slope_y + 1);
            weft_image_row(&piece->normal, 0, y)[x] = -at.slope_x / length;
            weft_image_row(&piece->normal, 1, y)[x] = -at.slope_y / length;
            weft_image_row(&piece->normal, 2, y)[x] = 1 / length;
            weft_image_row(&piece->albedo, 0, y)[x] = 0.3F * at.strength;
            weft_image_row(&piece->count[0], 0, y)[x] = (float)((double)at.tile_x / weave->warp_pitch_mm);
            weft_image_row(&piece->count[1], 0, y)[x] = (float)(-(double)at.tile_y / weave->weft_pitch_mm);
        }
    weft_fabric_fini(&cloth);
}

void cloth_piece_fini(cloth_piece *piece)
{
    weft_image_fini(&piece->normal);
    weft_image_fini(&piece->albedo);
    for (int c = 0; c < 2; c++)
        weft_image_fini(&piece->count[c]);
}
