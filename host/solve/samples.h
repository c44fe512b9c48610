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
    float variance[WEFT_SOLVE_LANES]; /* of grey by the camera's noise; 0 where that is not known */
} weft_solve_light;

/** Weights of one light's samples, 0: not used; an array of them has an element a light. */
typedef struct weft_lane_weights {
    float at[WEFT_SOLVE_LANES];
} weft_lane_weights;

/** The mirror light of a whole cloth (cloth_lobe.h). */
typedef struct weft_gloss {
    float strength;                  /* share of the surface that mirrors, times F0 */
    float alpha_along, alpha_across; /* GGX, of the fibre's direction */
    float fibre[2][2];               /* unit: the two directions that fibres run in, world x and y */
} weft_gloss;

typedef struct weft_solve_samples {
    int n_lights;
    /* 3: `value` holds the channels; 1: sites of a mosaic, each of one colour, which is value[0] and grey */
    int n_channels;
    const weft_gloss *gloss;         /* what is known of the mirror light; NULL: nothing */
    float view[3][WEFT_SOLVE_LANES]; /* unit, towards the camera; only with a gloss, or when one is fitted */
    float clipped[WEFT_SOLVE_LANES]; /* how many samples were left out as saturated, */
    float dark[WEFT_SOLVE_LANES];    /* as below the noise of black */
    _Alignas(64) weft_solve_light at[WEFT_LIGHTS_MAX];
} weft_solve_samples;

typedef struct weft_solve_answers {
    float normal[3][WEFT_SOLVE_LANES];  /* unit; (0, 0, 0) without an answer */
    float albedo[3][WEFT_SOLVE_LANES];  /* of the channels, white balanced; may leave 0..1 */
    float residual[WEFT_SOLVE_LANES];   /* rms of I' - fit over the samples, relative to the brightest fit */
    float confidence[WEFT_SOLVE_LANES]; /* 0..1, docs/solving.md */
    float valid[WEFT_SOLVE_LANES];      /* 1 or 0 */
    float angle[WEFT_SOLVE_LANES];      /* expected error of the normal: rms, radians */
    float n_used[WEFT_SOLVE_LANES];     /* lights that the answer rests on */
    uint32_t quality[WEFT_SOLVE_LANES]; /* weft_solve_quality bits */
    float search[WEFT_SOLVE_LANES];     /* 1 where the method wants its `search` to answer */
} weft_solve_answers;

/** What is to be known about an answer; bits of quality.png (docs/formats.md). */
typedef enum weft_solve_quality {
    WEFT_QUALITY_CLIPPED = 1,         /* a sample was left out because it was saturated */
    WEFT_QUALITY_SHADOWED = 2,        /* a sample was left out because it was dark */
    WEFT_QUALITY_ILL_CONDITIONED = 4, /* the lights used fix the normal badly */
    WEFT_QUALITY_NOT_LAMBERTIAN = 8   /* the samples contradict a matte surface by more than their noise */
} weft_solve_quality;

/** Pure: reads samples, writes every lane of the answers.  From any thread.  A lane's answer does not depend
 *  on the other lanes. */
typedef void weft_solve_fn(const weft_solve_samples *restrict samples, weft_solve_answers *restrict answers);

typedef struct weft_solve_method {
    const char *name;
    const char *summary; /* one line for the help */
    weft_solve_fn *solve;
    /* Answers the few pixels that `solve` marked, at many times its cost; they come 16 at a time from
     * anywhere in a row.  NULL: there are none. */
    weft_solve_fn *search;
    bool takes_gloss;  /* uses samples->gloss where there is one */
    bool takes_bounce; /* its answers are corrected for light from yarn to yarn (bounce.h) */
} weft_solve_method;

/** The methods; the default first; ends with NULL. */
extern const weft_solve_method *const weft_solve_methods[];
extern const weft_solve_method weft_method_lsq, weft_method_robust, weft_method_svd;

/** A singular value of the light matrix below this leaves the normal undetermined (S-ORD-17). */
#define WEFT_SOLVE_MIN_SINGULAR 0.05f
/** A scaled normal shorter than this is a black pixel: normal (0, 0, 1), albedo 0 (S-ORD-17). */
#define WEFT_SOLVE_BLACK 1e-6f
/** Error of the normal, in radians, at which the confidence is one half (5 degrees). */
#define WEFT_SOLVE_HALF_CONFIDENCE 0.0872664626f
/** Misfit that is assumed before any is seen, relative to the brightest fit, with the weight of one sample.
 */
#define WEFT_SOLVE_PRIOR_MISFIT 0.02f
/** Noise gain above which a pixel is called ill-conditioned: error of the direction, in radians, per relative
 *  error of a sample as bright as the surface facing the light.  Ten lights over a dome have 0.9. */
#define WEFT_SOLVE_ILL_CONDITIONED 2.0f
/** A sample darker than this part of the pixel's brightest is a shadow to the robust method. */
#define WEFT_SOLVE_SHADOW 0.1f
/** What a matte surface may differ from Lambert's law before it counts, relative to the brightest sample. */
#define WEFT_SOLVE_MISFIT 0.02f
/** What a matte surface usually differs from it by, beside the noise. */
#define WEFT_SOLVE_USUAL_MISFIT 0.01f

#endif
