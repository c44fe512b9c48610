#include "shading/bake/toksvig.h"

#include "shading/bake/normal_filter.h"
#include "shading/brdf/blinn_phong.h"

#include <math.h>

double weft_toksvig_average_gloss(const weft_baked *baked, int level)
{
    const weft_baked_map *const lengths = &baked->maps[WEFT_BAKED_NORMAL_LENGTH];
    const double alpha = (double)baked->maps[WEFT_BAKED_ROUGHNESS].constant[0];
    const double power =
        fmin(fmax(2 / (alpha * alpha) - 2, 1), 8192); /* alpha 0 is the sharpest gloss there is */
    if (level >= lengths->n_mips)
        return weft_blinn_phong_gloss(power);
    const weft_image *const map = &lengths->mips[level];
    const size_t n = weft_image_plane_size(map);
    double sum = 0;
    for (size_t i = 0; i < n; i++)
        sum += weft_blinn_phong_gloss(power * weft_toksvig_factor(fmin((double)map->data[i], 1), power));
    return sum / (double)n;
}
