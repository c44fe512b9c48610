/** The functions of colour calibration behind the names of tables of reference values (core/vectors.h). */
#ifndef WEFT_CALIBRATION_CHARTS_COLOUR_VECTORS_H
#define WEFT_CALIBRATION_CHARTS_COLOUR_VECTORS_H

#include "core/vectors.h"

/** Ends with {0}. */
extern const weft_vectors_model weft_calibration_vectors[];

#endif
