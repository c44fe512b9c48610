/** The evaluations in single precision against the tables of reference values (core/vectors.h). */
#ifndef WEFT_SHADING_VECTORS_VECTORS_SINGLE_H
#define WEFT_SHADING_VECTORS_VECTORS_SINGLE_H

#include "core/csv.h"
#include "core/error.h"

#include <stdbool.h>

#define WEFT_VECTORS_SINGLE_RTOL 1e-5
#define WEFT_VECTORS_SINGLE_ATOL 1e-6 /* 1/sr; as brdf.h promises */

/** Columns of a table that a model's eval_f32 gives. */
typedef struct weft_vectors_single {
    const char *stem;    /* "ord_ggx_spec" */
    const char *brdf;    /* "ggx-specular" */
    const char *planes;  /* what fills each plane of the parameters: a column, or a number */
    const char *angles;  /* columns (or numbers) of n.l, azimuth of l, n.v, azimuth of v */
    const char *outputs; /* columns of the value without "out_": one, or one a channel */
} weft_vectors_single;

/** Ends with {0}. */
extern const weft_vectors_single weft_vectors_singles[];

typedef struct weft_vectors_single_result {
    double table_rel;   /* largest |got - want|/|want| against the table, where want is above the atol */
    double kernel_rel;  /* the same against double precision at the same rounded arguments */
    double worst_share; /* largest |got - want|/(atol + rtol |want| + what rounding the arguments changes);
                           above 1 fails */
    int worst_row;      /* where, from 1 */
    double worst_got, worst_want;
} weft_vectors_single_result;

/**
 * Runs a row of the table over a csv.
 *
 * Arguments are rounded to single precision first, which alone moves narrow lobes by more than 1e-5: what
 * double precision makes of the rounded arguments is allowed on top.
 * @return WEFT_ERR_FORMAT when a column is missing or a cell is no number
 */
weft_err weft_vectors_single_run(const weft_vectors_single *single, const weft_csv *csv, const char *path,
                                 weft_vectors_single_result *result, weft_error *err);

#endif
