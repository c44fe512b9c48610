/**
 * Light of surroundings over planes of directions in single precision: what environment_map.h and
 * environment_table.h give one at a time, for loops that become vector code.
 */
#ifndef WEFT_SHADING_LIGHTING_ENVIRONMENT_PLANES_H
#define WEFT_SHADING_LIGHTING_ENVIRONMENT_PLANES_H

#include "shading/lighting/environment_map.h"
#include "shading/lighting/environment_table.h"

/** Nodes of the resampled table along the fourth roots of n.v and of alpha. */
#define WEFT_ENVIRONMENT_PLANES_SIZE 64

typedef struct weft_environment_planes {
    float *texels; /* [level][row][column][3], radiance */
    int offset[WEFT_ENVIRONMENT_LEVELS], width[WEFT_ENVIRONMENT_LEVELS], height[WEFT_ENVIRONMENT_LEVELS];
    float light[3][WEFT_SH_COUNT]; /* of the irradiance: the cosine's factors inside */
    float share[WEFT_ENVIRONMENT_PLANES_SIZE][WEFT_ENVIRONMENT_PLANES_SIZE][2]; /* [alpha][nv]: scale, bias */
} weft_environment_planes;

/** Copies and resamples both, some milliseconds.  @return WEFT_ERR_NOMEM */
weft_err weft_environment_planes_init(weft_environment_planes *planes, const weft_environment_map *map,
                                      const weft_environment_table *table, weft_error *err);
/** `{0}` is fine. */
void weft_environment_planes_fini(weft_environment_planes *planes);

/** Irradiance of `n` surfaces with unit normals; not below 0. */
void weft_environment_planes_irradiance(const weft_environment_planes *planes, int n,
                                        const float *const normal[3], float *const e[3]);

/** Filtered radiance along `n` unit directions: bilinear within a level, linear in the root of alpha between
 *  two.  @param alpha  0..1 */
void weft_environment_planes_look(const weft_environment_planes *planes, int n,
                                  const float *const direction[3], const float *alpha,
                                  float *const radiance[3]);

/** The environment BRDF's F0 scale and bias, within 1.5e-3 of the table: bilinear. */
void weft_environment_planes_share(const weft_environment_planes *planes, int n, const float *nv,
                                   const float *alpha, float *scale, float *bias);

#endif
