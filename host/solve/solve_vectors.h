/** The solver behind the names of tables of reference values (core/vectors.h). */
#ifndef WEFT_HOST_SOLVE_SOLVE_VECTORS_H
#define WEFT_HOST_SOLVE_SOLVE_VECTORS_H

#include "core/vectors.h"

/** Ends with {0}. */
extern const weft_vectors_model weft_solve_vectors[];

#endif
