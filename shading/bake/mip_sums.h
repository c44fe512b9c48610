/** Footprints of the texels of a level, summed over level 0 row by row: the first half of filtering normals.
 */
#ifndef WEFT_SHADING_BAKE_MIP_SUMS_H
#define WEFT_SHADING_BAKE_MIP_SUMS_H

#include "shading/bake/baked.h"

/** What a footprint is, summed: enough for every rule but the closest. */
typedef struct weft_mip_footprint {
    double weight, mean[3], shortened[3], alpha, alpha2;
} weft_mip_footprint;

/** The texels of level 0 that a texel of a level covers, [begin, end), with the shares of the first and last.
 */
typedef struct weft_mip_extent {
    int begin, end;
    double first, last;
} weft_mip_extent;

/** Of texel i of n, where level 0 has n0. */
weft_mip_extent weft_mip_extent_of(int i, int n, int n0);

static inline double weft_mip_share(const weft_mip_extent *e, int i)
{
    return i == e->begin ? e->first : i == e->end - 1 ? e->last : 1;
}

/** All shares together. */
static inline double weft_mip_weight(const weft_mip_extent *e)
{
    return e->end - e->begin > 1 ? e->end - e->begin - 2 + e->first + e->last : e->first;
}

/** Planes of sums: normal 3, alpha, alpha squared, shortened normal 3. */
enum { WEFT_MIP_SUMS = 8 };

/**
 * Sums over the rows that a row of a level covers, for each column of level 0.
 * @param anisotropy  [w0] that of a material without a map of it
 * @param shortened   whether to sum normals as long as the mean of their GGX
 * @param sums        [WEFT_MIP_SUMS][w0], overwritten
 */
void weft_mip_sum_rows(const weft_baked *baked, const weft_mip_extent *rows, const float *anisotropy,
                       bool shortened, double *sums);

/** Of the columns that a texel covers.  @param w0  of level 0 */
weft_mip_footprint weft_mip_sum_columns(const weft_mip_extent *rows, const weft_mip_extent *columns,
                                        bool shortened, int w0, const double *sums);

#endif
