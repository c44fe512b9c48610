/* Rays to the surface of a sample: shared by the renderer and the truth, so that both see the same points. */
#ifndef WEFT_HOST_RIG_TRACER_H
#define WEFT_HOST_RIG_TRACER_H

#include "host/rig/render.h"

/** Maps a point of the table to plate coordinates along rays from one fixed point (camera or lamp):
 *  (x, y) = (h0 g + h1, ...) / (...), g = (gx, gy, 1). */
typedef struct weft_rig_projection {
    double h[9];
} weft_rig_projection;

typedef struct weft_rig_tracer {
    const weft_rig_sample *sample;
    float centre[3];              /* where the rays come from, mm */
    weft_rig_projection to_plate; /* along the camera's rays */
} weft_rig_tracer;

/** A point of the surface, world frame. */
typedef struct weft_rig_hit {
    float x, y, z;            /* mm */
    float nx, ny, nz;         /* unit normal */
    float tx, ty, tz;         /* unit tangent along the fibres (fabric only) */
    float strength, openness; /* reflectance factor; share of the sky seen */
    int material;
    unsigned flaw;           /* weft_flaw bits */
    float lean[2];           /* slopes of the bent cloth under the weave */
    weft_fabric_point cloth; /* fabric only */
} weft_rig_hit;

/** Rays from `centre` through points of the table to the plate. */
weft_rig_projection weft_rig_project_to_plate(const weft_rig_plate *plate, weft_vec3 centre);

/** Plate coordinates of the ray through table point (gx, gy). */
static inline void weft_rig_plate_coordinates(const weft_rig_projection *p, double gx, double gy, double *x,
                                              double *y)
{
    const double w = 1 / (p->h[6] * gx + p->h[7] * gy + p->h[8]);
    *x = w * (p->h[0] * gx + p->h[1] * gy + p->h[2]);
    *y = w * (p->h[3] * gx + p->h[4] * gy + p->h[5]);
}

weft_rig_tracer weft_rig_tracer_make(const weft_rig_sample *sample, weft_vec3 centre);

/** Where the ray through table point (gx, gy) meets the sample.  `patch` holds around it (fabric only). */
void weft_rig_trace(const weft_rig_tracer *tracer, const weft_fabric_patch *patch, float gx, float gy,
                    weft_rig_hit *hit);

/** Table point of pixel (u, v) and its change per pixel, from the view's grid. */
typedef struct weft_rig_footprint {
    float x, y;
    float du[2], dv[2];
} weft_rig_footprint;

weft_rig_footprint weft_rig_footprint_at(const weft_rig_view *view, int u, int v);

#endif
