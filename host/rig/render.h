/**
 * Light transport of the virtual scanner: what each lamp alone puts on the sensor.
 *
 * Every photosite integrates its footprint: n x n rays through a grid over its square are traced to the
 * surface, shaded and averaged.  A value is linear light as docs/formats.md defines it (1/s at gain 1).
 *
 *     value = intensity-weighted reflectance * vignetting * a(theta) / r^2
 *             * ( (n.l) visible + mirror term + light from yarn to yarn )
 *
 * with lamp direction, distance and lobe taken at the point of the surface.
 */
#ifndef WEFT_HOST_RIG_RENDER_H
#define WEFT_HOST_RIG_RENDER_H

#include "core/image.h"
#include "host/rig/sample.h"
#include "host/rig/scene.h"

/** Rays of the camera: where each pixel's ray meets the plane z = 0.  All start at `centre`. */
typedef struct weft_rig_view {
    weft_image ground; /* [2][h][w]: x, y in mm */
    weft_vec3 centre;
} weft_rig_view;

/** The sensor's own pixels. */
weft_err weft_rig_view_sensor(weft_rig_view *view, const weft_rig_scene *scene, weft_error *err);

/** A regular grid on z = 0, pixel centres symmetric about the origin, row 0 at the top (+y): as many whole
 *  pixels as the sensor's field holds, an even number each way as in the solver's grids. */
weft_err weft_rig_view_plane(weft_rig_view *view, const weft_rig_scene *scene, double mm_per_px,
                             weft_error *err);
void weft_rig_view_fini(weft_rig_view *view);

/** The expected value of every photosite per lamp at full power, and with the room light alone. */
typedef struct weft_rig_frames {
    int width, height;
    float *light[WEFT_RIG_N_LIGHTS]; /* [h][w] each, RGGB mosaic, 1/s */
    float *room;                     /* [h][w] */
} weft_rig_frames;

weft_err weft_rig_frames_init(weft_rig_frames *frames, const weft_rig_scene *scene, const weft_rig_view *view,
                              const weft_rig_sample *sample, weft_error *err);
void weft_rig_frames_fini(weft_rig_frames *frames);

/** The maps that a perfect scan would give, per pixel of a view. */
typedef struct weft_rig_truth {
    weft_image normal; /* [3]: normalised mean of the unit normals over the pixel's footprint */
    weft_image albedo; /* [3]: mean diffuse reflectance over the footprint, linear sRGB D65 (not clipped) */
    weft_image alpha;  /* [1]: share of the footprint that is not the ground; planes 0 of a closed cloth */
    weft_mask flaws;   /* weft_flaw bits of any ray; data NULL of a cloth without */
} weft_rig_truth;

weft_err weft_rig_truth_maps(const weft_rig_scene *scene, const weft_rig_view *view,
                             const weft_rig_sample *sample, weft_rig_truth *truth, weft_error *err);
void weft_rig_truth_fini(weft_rig_truth *truth);

#endif
