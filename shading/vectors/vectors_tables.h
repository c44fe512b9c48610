/**
 * The functions of this folder behind the names of the tables of reference values (core/vectors.h); a new
 * function is one row in a file vectors_SUBJECT.c.
 */
#ifndef WEFT_SHADING_VECTORS_VECTORS_TABLES_H
#define WEFT_SHADING_VECTORS_VECTORS_TABLES_H

#include "core/vectors.h"

/** The tables by subject, one file each; each ends with {0}. */
extern const weft_vectors_model weft_vectors_reflectance[];
extern const weft_vectors_model weft_vectors_more_reflectance[];
extern const weft_vectors_model weft_vectors_lighting[];
extern const weft_vectors_model weft_vectors_bake[];
extern const weft_vectors_model weft_vectors_skin[];

/** The model of a stem; NULL when this library has none. */
const weft_vectors_model *weft_vectors_find(const char *stem);

#endif
