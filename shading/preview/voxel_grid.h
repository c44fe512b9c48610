/** A solid's surface as full and empty cells, and rays through them (S-BLG-10). */
#ifndef WEFT_SHADING_PREVIEW_VOXEL_GRID_H
#define WEFT_SHADING_PREVIEW_VOXEL_GRID_H

#include "core/error.h"

#include <stdbool.h>
#include <stdint.h>

/** Cells that a ray starts away from the surface, along its normal: less, and the surface's own cells shadow
 *  it. */
#define WEFT_VOXEL_OFFSET 1.5

typedef struct weft_voxels {
    int n[3];       /* cells along x, y, z */
    double low[3];  /* corner */
    double side;    /* of the cubic cells */
    uint32_t *bits; /* one a cell, x fastest; 1 is full */
} weft_voxels;

/** An empty grid over a box, `n_longest` cells (8..1024) along its longest side, and a rim of one cell all
 *  round.  @return WEFT_ERR_RANGE, WEFT_ERR_NOMEM */
weft_err weft_voxels_init(weft_voxels *voxels, const double low[3], const double high[3], int n_longest,
                          weft_error *err);
void weft_voxels_fini(weft_voxels *voxels);

/** Fills every cell that the triangle touches, by separating axes.  Source: Akenine-Moller 2001. */
void weft_voxels_add_triangle(weft_voxels *voxels, const double a[3], const double b[3], const double c[3]);

/** Whether the cell around a point is full; outside of the grid all is empty. */
bool weft_voxels_full(const weft_voxels *voxels, const double point[3]);

/** A ray from a surface to a light. */
typedef struct weft_voxel_ray {
    double from[3];   /* on the surface */
    double normal[3]; /* unit; zero: the ray starts in the air, right at `from` */
    double to[3];     /* unit, towards the light */
    double reach;     /* to the light, or where the grid has been left */
} weft_voxel_ray;

/** Cells in a step of weft_voxels_lit_marched(). */
double weft_voxels_step(const weft_voxels *voxels, const weft_voxel_ray *ray, int steps);

/**
 * Marched: `steps` looks between the start and the light or the end of the grid, each `dither` (0..1) of a
 * step on.  Thin surfaces are missed where a step is longer than a cell.  @return false in the shadow
 * Source: S-BLG-10.
 */
bool weft_voxels_lit_marched(const weft_voxels *voxels, const weft_voxel_ray *ray, int steps, double dither);

/** Walked from cell to cell, none left out.  Source: Amanatides and Woo 1987; S-BLG-10. */
bool weft_voxels_lit_walked(const weft_voxels *voxels, const weft_voxel_ray *ray);

#endif
