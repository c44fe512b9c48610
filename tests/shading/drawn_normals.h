/**
 * Filtered roughness against the distribution it stands for: micro-normals are drawn about every normal of a
 * footprint, and the filtered GGX is held against them by the Kolmogorov-Smirnov distance of the polar angle,
 * over what the best GGX there is would have.
 */
#ifndef WEFT_TESTS_SHADING_DRAWN_NORMALS_H
#define WEFT_TESTS_SHADING_DRAWN_NORMALS_H

#include "shading/bake/baked.h"

#include <stdbool.h>

enum { DRAWN_SIDE = 128, DRAWN_DRAWS = 2048, DRAWN_FABRICS = 3, DRAWN_ALPHAS = 5, DRAWN_LEVELS = 6 };

/** Roughness alpha of the threads, 0.05 to 0.5. */
extern const double drawn_alphas[DRAWN_ALPHAS];

/** A material of DRAWN_SIDE texels a side with the normals of a fabric: 0 plain, 1 twill, 2 corded. */
void drawn_normals_make(weft_baked *b, int fabric);

/** A texel of a level: nine at most a level, spread evenly.  Begin with {0}; false after the last. */
typedef struct drawn_footprint {
    int level, x, y;
} drawn_footprint;
bool drawn_next(drawn_footprint *at);

/** tan of the polar angle of micro-normals against the mean normal of their footprint, sorted. */
typedef struct drawn_tangents {
    double t[DRAWN_DRAWS];
} drawn_tangents;
void drawn_normals_draw(const weft_baked *b, const drawn_footprint *at, double alpha,
                        drawn_tangents *tangents);

/** Largest distance of the cumulative distributions of the tangents and of a GGX; the least of all GGX. */
double drawn_distance(const drawn_tangents *tangents, double alpha);
double drawn_least_distance(const drawn_tangents *tangents);

#endif
