/**
 * What a solver method sees: the samples of 16 neighbouring pixels under all lights, and its answers.
 *
 * Structure of arrays, 16 lanes, so that every line of a method is one loop over the lanes which the
 * compiler turns into vectors.  The whole block stays in the first-level cache.
 */
#ifndef WEFT_HOST_SOLVE_SAMPLES_H
#define WEFT_HOST_SOLVE_SAMPLES_H

#include "calibration/calibration.h"

#define WEFT_SOLVE_LANES 16

/** One light's samples: reflected light over incident light, I'_j = k (n . l_j) for a Lambertian surface
 *  (S-ORD-17). */
typedef struct weft_solve_light {
    float light[3][WEFT_SOLVE_LANES]; /* unit, towards the light, world X Y Z */
    float value[3][WEFT_SOLVE_LANES]; /* I', white balanced; finite */
    float grey[WEFT_SOLVE_LANES];     /* 0.2126 R + 0.7152 G + 0.0722 B of it */
    float weight[WEFT_SOLVE_LANES];   /* 1 to be used, 0 left out (values are then 0) */
} weft_solve_light;

typedef struct weft_solve_samples {
    int n_lights;
    /* 3: `value` holds the channels; 1: sites of a mosaic, each of one colour, which is value[0] and grey */
    int n_channels;
    _Alignas(64) weft_solve_light at[WEFT_LIGHTS_MAX];
} weft_solve_samples;

typedef struct weft_solve_answers {
    float normal[3][WEFT_SOLVE_LANES];  /* unit; (0, 0, 0) without an answer */
    float albedo[3][WEFT_SOLVE_LANES];  /* of the channels, white balanced; may leave 0..1 */
    float residual[WEFT_SOLVE_LANES];   /* rms of I' - fit over the samples, relative to the brightest fit */
    float confidence[WEFT_SOLVE_LANES]; /* 0..1, docs/solving.md */
    float valid[WEFT_SOLVE_LANES];      /* 1 or 0 */
} weft_solve_answers;

/** Pure: reads samples, writes every lane of the answers.  From any thread. */
typedef void weft_solve_fn(const weft_solve_samples *restrict samples, weft_solve_answers *restrict answers);

typedef struct weft_solve_method {
    const char *name;
    const char *summary; /* one line for the help */
    weft_solve_fn *solve;
} weft_solve_method;

/** The methods; the default first; ends with {0}. */
extern const weft_solve_method weft_solve_methods[];

/** A singular value of the light matrix below this leaves the normal undetermined (S-ORD-17). */
#define WEFT_SOLVE_MIN_SINGULAR 0.05f
/** A scaled normal shorter than this is a black pixel: normal (0, 0, 1), albedo 0 (S-ORD-17). */
#define WEFT_SOLVE_BLACK 1e-6f
/** Error of the normal, in radians, at which the confidence is one half (5 degrees). */
#define WEFT_SOLVE_HALF_CONFIDENCE 0.0872664626f
/** Misfit that is assumed before any is seen, relative to the brightest fit, with the weight of one sample.
 */
#define WEFT_SOLVE_PRIOR_MISFIT 0.02f

/** Least squares by normal equations (method_lsq.c). */
weft_solve_fn weft_solve_lsq;

#endif
