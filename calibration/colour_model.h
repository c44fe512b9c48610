/**
 * From camera RGB to linear sRGB: the three models that a calibration may carry, and how they are applied.
 *
 * Camera RGB is white balanced, 1 = a perfect white diffuser.  How they are fitted: charts/colour_fit.h.
 */
#ifndef WEFT_CALIBRATION_COLOUR_MODEL_H
#define WEFT_CALIBRATION_COLOUR_MODEL_H

#include "core/linalg.h"

#include <stdbool.h>

typedef enum weft_colour_method {
    WEFT_COLOUR_MATRIX,          /* 3x3 */
    WEFT_COLOUR_ROOT_POLYNOMIAL, /* r, g, b, sqrt(rg), sqrt(gb), sqrt(br): degree 2, exposure-invariant
                                    (Finlayson, Mackiewicz, Hurlbert 2015) */
    WEFT_COLOUR_SEQUENCE,        /* affine, cubic per channel, affine, in xyY (S-FC3-01, S-FC3-02) */
    WEFT_COLOUR_METHODS
} weft_colour_method;

#define WEFT_COLOUR_ROOT_TERMS 6

/** Affine, cubic, affine on three values; which space is the caller's. */
typedef struct weft_colour_sequence {
    double first[3][4]; /* out = first . (in, 1) */
    bool has_cubic;     /* false: the cubic was not monotone and is left out */
    double cubic[3][4]; /* out = c0 + c1 x + c2 x^2 + c3 x^3, per channel */
    double range[3][2]; /* of x in the fit; beyond it the cubic goes on along its tangent */
    double second[3][4];
} weft_colour_sequence;

typedef struct weft_colour_model {
    weft_colour_method method;
    weft_mat3 matrix;                       /* always there, whatever the method */
    double root[3][WEFT_COLOUR_ROOT_TERMS]; /* of WEFT_COLOUR_ROOT_POLYNOMIAL */
    weft_colour_sequence sequence;          /* of WEFT_COLOUR_SEQUENCE */
} weft_colour_model;

/** "matrix", "root-polynomial", "sequence", as `--method` and calibration.json say it. */
const char *weft_colour_method_name(weft_colour_method method);
/** The method of a name; false when there is none. */
bool weft_colour_method_from_name(const char *name, weft_colour_method *method);

/** The three roots behind r, g, b; values below 0 count as 0 under a root. */
void weft_colour_root_terms(const double rgb[3], double terms[WEFT_COLOUR_ROOT_TERMS]);

/** Applies affine, cubic, affine to three values. */
void weft_colour_sequence_apply(const weft_colour_sequence *sequence, const double in[3], double out[3]);

/** Camera RGB to linear sRGB.  Not clipped: colours outside sRGB come out below 0 or above 1. */
void weft_colour_model_apply(const weft_colour_model *model, const double camera[3], double linear_srgb[3]);

/** The same for n pixels in three rows, in place; single precision. */
void weft_colour_model_apply_row(const weft_colour_model *model, float *const rgb[3], int n);

#endif
