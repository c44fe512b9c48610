/** Inside of the preview: a run of samples of one row, planar and in single precision, and the steps that
 * fill it. */
#ifndef WEFT_SHADING_PREVIEW_SAMPLES_H
#define WEFT_SHADING_PREVIEW_SAMPLES_H

#include "shading/lighting/environment_planes.h"
#include "shading/preview/preview.h"

#define WEFT_PREVIEW_RUN 128 /* samples in a run: all planes together stay in the second-level cache */

typedef struct weft_preview_samples {
    int n;
    float x[WEFT_PREVIEW_RUN], y[WEFT_PREVIEW_RUN];  /* in output pixels from the middle, y up */
    float hit[WEFT_PREVIEW_RUN];                     /* 1 on the sample, 0 on the background */
    double u[WEFT_PREVIEW_RUN], v[WEFT_PREVIEW_RUN]; /* map pixels, before repeating: in a map that repeats a
                                                         thousand times floats would be too short */
    float position_mm[3][WEFT_PREVIEW_RUN];          /* world; 0 where the maps have no scale */
    float axis[3][3][WEFT_PREVIEW_RUN];              /* world: tangent, bitangent, normal of the shape */
    float eye[3][WEFT_PREVIEW_RUN];                  /* world, unit, towards the viewer */
    float frame[3][3][WEFT_PREVIEW_RUN];             /* world: tangent, bitangent, normal of the map */
    double drape[2][WEFT_PREVIEW_RUN];               /* drape: where it hangs, x and y in half widths */
    float lamp[3][WEFT_PREVIEW_RUN];                 /* world, unit, towards the light */
    float reach_mm[WEFT_PREVIEW_RUN];                /* to the light; distant ones: unset */
    float visible[WEFT_PREVIEW_RUN];                 /* share of the light past relief and folds */
    int at[4][WEFT_PREVIEW_RUN];                     /* the four texels around the place, index in a plane */
    float share[4][WEFT_PREVIEW_RUN];                /* of each; masked ones have none */
    float sign[2][WEFT_PREVIEW_RUN];   /* of the normal: -1 where a mirrored repeat turned X or Y round */
    float normal[3][WEFT_PREVIEW_RUN]; /* tangent space, from the map */
    float param[WEFT_BRDF_MAX_PLANES][WEFT_PREVIEW_RUN];
    float light[3][WEFT_PREVIEW_RUN], view[3][WEFT_PREVIEW_RUN]; /* local frame of the shading normal */
    float irradiance[WEFT_PREVIEW_RUN];                          /* share of the light's, with the cosine */
    float norm[WEFT_PREVIEW_RUN];                                /* of the lobe, for representative points */
    float value[3][WEFT_PREVIEW_RUN];                            /* BRDF */
    float matte[3][WEFT_PREVIEW_RUN];                            /* BRDF without its mirrored part */
    float radiance[3][WEFT_PREVIEW_RUN];                         /* so far */
} weft_preview_samples;

/** Planes of the parameters that say what a surface reflects evenly; -1 where the model has none. */
typedef struct weft_preview_matte {
    int albedo; /* first of three: "albedo", or "base" */
    int metallic, cavity;
    int cloth, cloth_albedo; /* share of the second surface beside the first, and its albedo */
} weft_preview_matte;

struct weft_preview_visibility;

/** What is the same for all samples of a picture. */

typedef struct weft_preview_setup {
    const weft_preview_surface *surface;
    const weft_preview_view *view;
    weft_preview_crop crop;
    int supersampling;         /* samples along a side of a pixel; even, or 1 */
    double texels_per_px;      /* plane: map pixels an output pixel; sphere: at the pole */
    double radius_px;          /* sphere: of its outline, output pixels */
    double radius_texels;      /* sphere: of the sphere, map pixels */
    double turn_cos, turn_sin; /* of the view's turn */
    double eye_distance;       /* 0: orthographic; plane: output pixels, sphere: radii */
    int albedo_plane;          /* first plane of the parameter "albedo"; -1 when the model has none */
    int alpha_plane;           /* of "alpha" of a GGX-like lobe; -1 when the model has none */
    weft_preview_matte matte;
    const struct weft_preview_visibility *visibility;             /* NULL: no shadows but those by formula */
    const weft_preview_texture *texture;                          /* NULL: the maps are sampled */
    weft_environment_planes around;                               /* the view's surroundings; empty without */
    double low[WEFT_BRDF_MAX_PLANES], high[WEFT_BRDF_MAX_PLANES]; /* ranges of the parameters */
} weft_preview_setup;

weft_preview_matte weft_preview_matte_of(const weft_brdf *brdf);

/** Adds the view's ambient light to the radiance: an even glow that the matte part reflects, albedo
 *  (1 - metallic), and that a cavity keeps off (S-UE4-11). */
void weft_preview_add_ambient(const weft_preview_setup *setup, weft_preview_samples *s);

/** Whether the model's lobe stands about the mirrored ray with the width "alpha" or "roughness" squared:
 *  what the split sum and representative points are made for. */
bool weft_preview_is_glossy(const weft_brdf *brdf);

/** Scale, camera and sampling density of the view. */
void weft_preview_setup_shape(weft_preview_setup *setup);

/** Fills hit, u, v, position, axis and eye from x and y. */
void weft_preview_hit(const weft_preview_setup *setup, weft_preview_samples *s);

/** Puts the view's lamps into the frame of the turned sample, as strong as before wherever they shine. */
void weft_preview_turn_lamps(const weft_preview_setup *setup, weft_preview_view *view);

/** Amplitude of the drape's deepest folds, in half widths. */
#define WEFT_PREVIEW_DRAPE_DEPTH 0.14

/** Height of the drape and its slopes at (x, y), -1..1; lengths in half widths. */
double weft_preview_drape_height(double x, double y, double slope[2]);

/** Share of the light that reaches a place (x, y) of the drape, in half widths, past the other folds: 1 or 0.
 */
double weft_preview_drape_light(const double place[2], const double lamp[3]);

/** Sample i from the middle of the shape, in map texels. */
void weft_preview_place(const weft_preview_setup *setup, const weft_preview_samples *s, int i,
                        double place[3]);

/** Points sample i's lamp at a light (at its point k of WEFT_PREVIEW_AREA_POINTS when it is large), and sets
 *  its irradiance and reach. */
void weft_preview_aim(const weft_preview_light *light, weft_preview_samples *s, int i, int k);

/** Shades the samples under one light of the view and adds to radiance. */
void weft_preview_add_light(const weft_preview_setup *setup, const weft_preview_light *light,
                            weft_preview_samples *s);

/** The model's f for the directions of the samples, with light and view in their local frames. */
void weft_preview_eval(const weft_preview_setup *setup, weft_preview_samples *s,
                       float value[3][WEFT_PREVIEW_RUN]);

/** Fills frame and view from normal, axis and eye. */
void weft_preview_set_frame(weft_preview_samples *s);

/** Multiplies irradiance by the share of the lamp's light that the shape itself lets through. */
void weft_preview_shadow(const weft_preview_setup *setup, weft_preview_samples *s);

/** As weft_preview_add_light() for a ball or tube by its representative point. */
void weft_preview_add_representative(const weft_preview_setup *setup, const weft_preview_light *light,
                                     weft_preview_samples *s);

/** Turns lamp into the local frames. */
void weft_preview_turn_lamp(weft_preview_samples *s);

/** The same of a GGX model by the split sum; false: the model is none. */
bool weft_preview_add_split_sum(const weft_preview_setup *setup, weft_preview_samples *s);

/** Adds the surroundings' light to radiance. */
void weft_preview_add_surroundings(const weft_preview_setup *setup, weft_preview_samples *s);

/** The same from chains of mips, by the footprints of the samples. */
void weft_preview_fetch_filtered(const weft_preview_setup *setup, weft_preview_samples *s);

/** Fills normal and param from u and v; takes masked places off hit. */
void weft_preview_fetch(const weft_preview_setup *setup, weft_preview_samples *s);

#endif
