/**
 * Reflectance models: a struct of functions each, in one array (brdf_table.c).
 *
 * Everything is evaluated over arrays of directions, one plane a component, in the local frame of the
 * surface: x tangent (map right), y bitangent (map up), z normal.  Directions are unit vectors that point
 * away from the surface: `light` to the light, `view` to the eye.  Values are f in 1/sr, without the
 * cosine of the light, for red, green and blue (linear, BT.709).
 *
 * Rules of all models (S-CNV-02): n.l <= 0 gives 0; n.v is raised to 1e-4, so that a back-facing view is
 * shaded as the limit of a grazing one; l = -v has no half vector and gives 0.
 *
 * Safe from any thread: the functions are pure.  docs/shading.md lists the equations, docs/add-a-brdf.md
 * says how to add a model: one file and one row.
 */
#ifndef WEFT_SHADING_BRDF_BRDF_H
#define WEFT_SHADING_BRDF_BRDF_H

#include "core/error.h"

#include <stdio.h>

/** Planes of all parameters of a model: a colour takes three. */
#define WEFT_BRDF_MAX_PLANES 20

/** A row of a model's parameters; the table ends with {0}. */
typedef struct weft_brdf_param {
    const char *name;   /* "alpha" */
    const char *symbol; /* how tables of reference values spell it ("cdiff"); NULL: as name */
    int components;     /* 1, or 3 for a colour */
    double min, max, def;
    const char *unit; /* "" when it has none */
    const char *help; /* one line, lower case, no full stop */
} weft_brdf_param;

/** What a model promises; tests/shading/check_brdf.c holds it to that. */
enum {
    WEFT_BRDF_RECIPROCAL = 1,  /* f(l, v) = f(v, l) for both cosines above 1e-4 */
    WEFT_BRDF_PASSIVE = 2,     /* directional albedo <= 1 over the ranges of its parameters */
    WEFT_BRDF_ANISOTROPIC = 4, /* turns with the tangent */
};

/** `n` directions and the parameters at each. */
typedef struct weft_brdf_batch {
    int n;
    const double *light[3];                    /* [3][n]; not read by sample */
    const double *view[3];                     /* [3][n] */
    const double *param[WEFT_BRDF_MAX_PLANES]; /* [weft_brdf_n_planes()][n], in the order of the rows */
    const void *data;                          /* the model's own */
} weft_brdf_batch;

/** The same in single precision. */
typedef struct weft_brdf_batch_f32 {
    int n;
    const float *light[3];
    const float *view[3];
    const float *param[WEFT_BRDF_MAX_PLANES];
    const void *data;
} weft_brdf_batch_f32;

typedef struct weft_brdf {
    const char *name;    /* "ggx", lower case, what the user types */
    const char *summary; /* one line */
    const char *source;  /* paper, equation, S- id */
    unsigned flags;
    const weft_brdf_param *params;
    const void *data; /* what a measured model reads (merl.h); callers put it into each batch.  NULL */

    /** Writes f [3][n], 1/sr.  Never NaN, infinite or negative for unit vectors and parameters in range. */
    void (*eval)(const weft_brdf_batch *batch, double *const value[3]);

    /** The same built in single precision from the same source (real.h), for pictures: within 1e-5 of eval,
     *  or 1e-6/sr where f itself is next to nothing, at the same rounded arguments.  Directions less than
     *  1e-12 from opposite count as opposite. */
    void (*eval_f32)(const weft_brdf_batch_f32 *batch, float *const value[3]);

    /** Draws light directions for the views (n.v > 0) from uniform numbers u [3][n] in [0, 1); a direction
     *  may lie below the surface: it carries no light but counts as a sample.  NULL: no sampling. */
    void (*sample)(const weft_brdf_batch *batch, const double *const u[3], double *const light[3]);

    /** Density of sample() at the batch's light directions, in 1/sr over the whole sphere; 0 where n.v <= 0.
     *  NULL exactly where sample is. */
    void (*pdf)(const weft_brdf_batch *batch, double *density);
} weft_brdf;

/** All models, in the order of the documents; ends with NULL. */
extern const weft_brdf *const weft_brdfs[];

/** The model of a name.  @return WEFT_ERR_USAGE that lists the names there are. */
weft_err weft_brdf_find(const char *name, const weft_brdf **brdf, weft_error *err);

/** Number of planes of the parameters. */
int weft_brdf_n_planes(const weft_brdf *brdf);

/** The row of a parameter by name or symbol, and its first plane (may be NULL); NULL when there is none. */
const weft_brdf_param *weft_brdf_find_param(const weft_brdf *brdf, const char *name, int *plane);

/** Writes the default of every plane. */
void weft_brdf_defaults(const weft_brdf *brdf, double values[WEFT_BRDF_MAX_PLANES]);

/** Checks one value of a parameter.  @return WEFT_ERR_USAGE with the range. */
weft_err weft_brdf_check_value(const weft_brdf *brdf, const weft_brdf_param *param, double value,
                               weft_error *err);

/** Sets a parameter from "name=0.3" or, for a colour, "name=0.9,0.6,0.3" or one number for all three.
 *  @return WEFT_ERR_USAGE saying what was wanted; `values` are then unchanged. */
weft_err weft_brdf_set(const weft_brdf *brdf, const char *text, double values[WEFT_BRDF_MAX_PLANES],
                       weft_error *err);

/** f of one pair of directions. */
void weft_brdf_eval_one(const weft_brdf *brdf, const double values[WEFT_BRDF_MAX_PLANES],
                        const double light[3], const double view[3], double value[3]);

/** The unit vector at `cosine` to the normal and azimuth `phi_rad` from the tangent; keeps the digits of
 *  cosines near 1 in x and y. */
void weft_brdf_direction(double cosine, double phi_rad, double direction[3]);

#endif
