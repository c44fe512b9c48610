/**
 * The normal that most lights agree on, searched for among those that three lights fix (method_robust.c).
 *
 * Truncated least squares: the cost of a normal is the sum of min(r^2 / sigma^2, 9) over the lights.
 */
#ifndef WEFT_HOST_SOLVE_TRIPLES_H
#define WEFT_HOST_SOLVE_TRIPLES_H

#include "host/solve/samples.h"

typedef struct weft_lane_vectors {
    float x[WEFT_SOLVE_LANES], y[WEFT_SOLVE_LANES], z[WEFT_SOLVE_LANES];
} weft_lane_vectors;

/** One light as the search sees it. */
typedef struct weft_triple_light {
    weft_lane_vectors light;      /* 0 where it is left out, */
    float grey[WEFT_SOLVE_LANES]; /* as in the samples */
    weft_lane_vectors scaled;     /* light and grey over sigma; 0 where it is left out */
    float scaled_grey[WEFT_SOLVE_LANES];
    float over[WEFT_SOLVE_LANES]; /* 1 / sigma; 0 where it is left out */
} weft_triple_light;

typedef struct weft_triple_best {
    weft_lane_vectors normal;     /* scaled by the albedo */
    float cost[WEFT_SOLVE_LANES]; /* WEFT_TRIPLE_NONE: no three lights fix a normal */
} weft_triple_best;

#define WEFT_TRIPLE_NONE 1e30F
/** Squares beyond three sigma count no more. */
#define WEFT_TRIPLE_CUT2 9.0F

/** Every triple of up to 12 lights, of more 220 that are spread evenly.
 *  @param lights  [n], n >= 3, finite */
void weft_triples_search(const weft_triple_light *lights, int n, weft_triple_best *best);

#endif
