/** One constant in the place of a Toksvig map, where a map would cost the normals' compression (S-FC3-15). */
#ifndef WEFT_SHADING_BAKE_TOKSVIG_H
#define WEFT_SHADING_BAKE_TOKSVIG_H

#include "shading/bake/baked.h"

/**
 * Mean gloss of a level's Toksvig map: the mean of g' = clamp(log2(f_t m)/13) over its texels, not the gloss
 * of the mean power.
 *
 * m is the Blinn-Phong power of the material's mean alpha at level 0 (S-CNV-04), f_t Toksvig's factor of the
 * length of the level's averaged normals (S-FC3-14).  Level 0 has unit normals and so the material's own
 * gloss.
 *
 * @param level  below the number of levels of WEFT_BAKED_NORMAL_LENGTH; without that map every level has the
 *               material's own gloss
 * @return 0..1
 */
double weft_toksvig_average_gloss(const weft_baked *baked, int level);

#endif
