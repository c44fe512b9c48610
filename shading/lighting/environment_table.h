/** The environment BRDF of GGX (environment.h) as a table: the 5 ns form of a 3 ms integral. */
#ifndef WEFT_SHADING_LIGHTING_ENVIRONMENT_TABLE_H
#define WEFT_SHADING_LIGHTING_ENVIRONMENT_TABLE_H

#include "core/error.h"
#include "shading/lighting/environment.h"

/** Nodes along the fourth roots of n.v and of alpha: where both are small all changes at once. */
#define WEFT_ENVIRONMENT_TABLE_SIZE 64

typedef struct weft_environment_table {
    float share[2][WEFT_ENVIRONMENT_TABLE_SIZE]
               [WEFT_ENVIRONMENT_TABLE_SIZE]; /* scale, bias; [roughness][nv] */
} weft_environment_table;

/**
 * Fills the table by deterministic quadrature, spread over the cores: a quarter of a second of core time.
 *
 * Roughness 0 is a mirror: scale 1 - (1 - nv)^5, bias (1 - nv)^5.
 */
void weft_environment_table_compute(weft_environment_table *table, weft_environment_lobe lobe);

/**
 * The same, kept in the user's cache folder ($XDG_CACHE_HOME/weft, else ~/.cache/weft) under the hash of what
 * it depends on; the file ends with the SHA-256 of its numbers, and one that does not fit is computed anew. A
 * folder that cannot be written costs that time each time, nothing else.
 */
void weft_environment_table_get(weft_environment_table *table, weft_environment_lobe lobe);

/** Bicubic (Catmull-Rom) value, within 5e-4 of the integral for alpha from 1e-3 (and 6e-4 below it) and every
 *  n.v, which is raised to WEFT_ENVIRONMENT_MIN_NV. */
weft_environment_share weft_environment_table_at(const weft_environment_table *table, double nv,
                                                 double alpha);

#endif
