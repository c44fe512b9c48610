/**
 * What the solver saw at one pixel: every sample, what became of it and why.
 *
 * Which lights the answer rests on is not told by the method but measured: each sample in turn is changed a
 * little, and the answer moves or does not.  That holds for every method, and says beside it how much each
 * light decides.
 */
#ifndef WEFT_HOST_SOLVE_EXPLAIN_H
#define WEFT_HOST_SOLVE_EXPLAIN_H

#include "host/solve/cloth_lobe.h"
#include "host/solve/solve.h"

typedef enum weft_explain_why {
    WEFT_EXPLAIN_USED,
    WEFT_EXPLAIN_CLIPPED,    /* saturated, or a neighbour is */
    WEFT_EXPLAIN_BLACK,      /* within three sigma of the noise of black */
    WEFT_EXPLAIN_UNLIT,      /* its light does not shine here, or the value is no number */
    WEFT_EXPLAIN_SHADOW,     /* far darker than the brightest */
    WEFT_EXPLAIN_CONTRADICTS /* the other lights agree on something else */
} weft_explain_why;

typedef struct weft_explained_light {
    double direction[3]; /* unit, from the pixel to the light */
    double full_scale; /* the largest photosite value that counts, as part of the sensor's range; 0 unknown */
    double value;      /* I': reflected over incident light */
    double mirror;     /* part of it that is taken for the cloth's mirror light; 0 without a gloss */
    double fit;        /* k (n . l) */
    double sigma;      /* of I': the camera's noise and 2 % of the brightest */
    double influence_deg; /* how far the normal turns when the sample grows by 1 % of the brightest */
    weft_explain_why why;
} weft_explained_light;

typedef struct weft_explanation {
    int x, y;           /* as asked, in the maps' geometry */
    bool plane;         /* x, y are of the plane */
    double mm_per_px;   /* of the plane */
    int column, row;    /* solved pixel of the sensor (at half size: the cell) */
    bool has_world;     /* the calibration has a camera */
    double world_mm[2]; /* where the pixel lies on the sample */
    int colour;         /* 0, 1, 2 of a mosaic's site; -1: all three */
    const char *method;
    bool valid, searched, inside; /* has an answer; by the method's search; the set's mask has it */
    double normal[3];
    double albedo[3]; /* camera RGB; of a mosaic [0] is the site's own colour */
    double residual, confidence, uncertainty_deg;
    int n_used;
    unsigned quality; /* weft_solve_quality bits */
    bool glossy;      /* the cloth's mirror light is known: */
    weft_gloss gloss;
    int n_lights;
    weft_explained_light lights[WEFT_LIGHTS_MAX];
} weft_explanation;

/**
 * Explains pixel (x, y) of the maps that weft_solve_set() makes with these options, before light from yarn to
 * yarn is taken off.
 *
 * A pixel of the plane is answered by the photosite below its middle.
 * @return what weft_solve_check() and the readers say; WEFT_ERR_RANGE outside the picture, saying how large
 * it is
 */
weft_err weft_solve_explain(const weft_set *set, const weft_calibration *cal, const char *cal_folder,
                            const weft_solve_options *options, int x, int y, weft_explanation *explanation,
                            weft_error *err);

/** "used", "saturated", ... */
const char *weft_explain_why_name(weft_explain_why why);

#endif
