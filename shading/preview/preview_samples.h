/** Inside of the preview: a run of samples of one row, planar, and the steps that fill it. */
#ifndef WEFT_SHADING_PREVIEW_SAMPLES_H
#define WEFT_SHADING_PREVIEW_SAMPLES_H

#include "shading/preview/preview.h"

#define WEFT_PREVIEW_RUN 128 /* samples in a run: all planes together stay in the second-level cache */

typedef struct weft_preview_samples {
    int n;
    double x[WEFT_PREVIEW_RUN], y[WEFT_PREVIEW_RUN]; /* in output pixels from the middle, y up */
    double hit[WEFT_PREVIEW_RUN];                    /* 1 on the sample, 0 on the background */
    double u[WEFT_PREVIEW_RUN], v[WEFT_PREVIEW_RUN]; /* map pixels, before repeating */
    double position_mm[3][WEFT_PREVIEW_RUN];         /* world; 0 where the maps have no scale */
    double axis[3][3][WEFT_PREVIEW_RUN];             /* world: tangent, bitangent, normal of the shape */
    double eye[3][WEFT_PREVIEW_RUN];                 /* world, unit, towards the viewer */
    double frame[3][3][WEFT_PREVIEW_RUN];            /* world: tangent, bitangent, normal of the map */
    double lamp[3][WEFT_PREVIEW_RUN];                /* world, unit, towards the light */
    int at[4][WEFT_PREVIEW_RUN];                     /* the four texels around the place, index in a plane */
    double share[4][WEFT_PREVIEW_RUN];               /* of each; masked ones have none */
    double sign[2][WEFT_PREVIEW_RUN];   /* of the normal: -1 where a mirrored repeat turned X or Y round */
    double normal[3][WEFT_PREVIEW_RUN]; /* tangent space, from the map */
    double param[WEFT_BRDF_MAX_PLANES][WEFT_PREVIEW_RUN];
    double light[3][WEFT_PREVIEW_RUN], view[3][WEFT_PREVIEW_RUN]; /* local frame of the shading normal */
    double irradiance[WEFT_PREVIEW_RUN];                          /* share of the light's, with the cosine */
    double norm[WEFT_PREVIEW_RUN];                                /* of the lobe, for representative points */
    double value[3][WEFT_PREVIEW_RUN];                            /* BRDF */
    double matte[3][WEFT_PREVIEW_RUN];                            /* BRDF without its mirrored part */
    double radiance[3][WEFT_PREVIEW_RUN];                         /* so far */
} weft_preview_samples;

/** What is the same for all samples of a picture. */
typedef struct weft_preview_setup {
    const weft_preview_surface *surface;
    const weft_preview_view *view;
    weft_preview_crop crop;
    int supersampling;    /* samples along a side of a pixel; even, or 1 */
    double texels_per_px; /* plane: map pixels an output pixel; sphere: at the pole */
    double radius_px;     /* sphere: of its outline, output pixels */
    double radius_texels; /* sphere: of the sphere, map pixels */
    double eye_distance;  /* 0: orthographic; plane: output pixels, sphere: radii */
    int albedo_plane;     /* first plane of the parameter "albedo"; -1 when the model has none */
    int alpha_plane;      /* of "alpha"; -1 when the model has none */
    double low[WEFT_BRDF_MAX_PLANES], high[WEFT_BRDF_MAX_PLANES]; /* ranges of the parameters */
} weft_preview_setup;

/** Scale, camera and sampling density of the view. */
void weft_preview_setup_shape(weft_preview_setup *setup);

/** Fills hit, u, v, position, axis and eye from x and y. */
void weft_preview_hit(const weft_preview_setup *setup, weft_preview_samples *s);

/** Share of the light that reaches a place of the drape past the other folds: 1 or 0. */
double weft_preview_drape_light(const weft_preview_setup *setup, const double position_px[3],
                                const double lamp[3]);

/** Shades the samples under one light of the view and adds to radiance. */
void weft_preview_add_light(const weft_preview_setup *setup, const weft_preview_light *light,
                            weft_preview_samples *s);

/** The model's f for the directions of the samples, with light and view in their local frames. */
void weft_preview_eval(const weft_preview_setup *setup, weft_preview_samples *s,
                       double value[3][WEFT_PREVIEW_RUN]);

/** Turns lamp into the local frames. */
void weft_preview_turn_lamp(weft_preview_samples *s);

/** Adds the surroundings' light to radiance. */
void weft_preview_add_surroundings(const weft_preview_setup *setup, weft_preview_samples *s);

/** Fills normal and param from u and v; takes masked places off hit. */
void weft_preview_fetch(const weft_preview_setup *setup, weft_preview_samples *s);

#endif
