/**
 * Functions behind the names of tables of reference values: NAME.csv with columns of inputs and columns
 * out_*.
 *
 * build/bin/weft-vectors runs them against the tables.  Each library lists its own functions, e.g.
 * shading/vectors/vectors_tables.h; this is what compares.
 */
#ifndef WEFT_CORE_VECTORS_H
#define WEFT_CORE_VECTORS_H

#include "core/csv.h"
#include "core/error.h"

#include <stdbool.h>

#define WEFT_VECTORS_MAX_COLUMNS 64

/** A function over all rows of a table at once, one array a column.  Rows stand alone unless said. */
typedef struct weft_vectors_model {
    const char *stem;    /* "ord_ggx_spec", the name of the table without .csv */
    const char *ids;     /* "S-ORD-05" */
    const char *inputs;  /* column names with blanks between, in the order of `in` */
    const char *outputs; /* likewise, of `out`; the table's columns are out_NAME */
    double rtol;         /* the least that it is held to; a MANIFEST.csv beside the table may allow more */
    void (*eval)(int n, const double *const *in /* [n_in][n] */, double *const *out /* [n_out][n] */);
} weft_vectors_model;

/** The model of a stem in a table that ends with {0}; NULL when it has none. */
const weft_vectors_model *weft_vectors_find_in(const weft_vectors_model *table, const char *stem);

/** Where got and wanted differ most. */
typedef struct weft_vectors_column {
    const char *name;   /* "out_D", in the csv */
    double max_rel;     /* |got - want|/|want|, over rows where want is not 0 */
    double max_abs;     /* |got - want| */
    double worst_share; /* largest |got - want|/(atol + rtol |want|); above 1 fails */
    int worst_row;      /* where, from 1 */
    double worst_got, worst_want;
} weft_vectors_column;

#define WEFT_VECTORS_ATOL 1e-12

/**
 * Runs a model over a table.
 *
 * @param columns  gets one entry an expected column that the model gives; room for WEFT_VECTORS_MAX_COLUMNS
 * @return WEFT_ERR_FORMAT when an input column is missing, a cell is no number, or the table has an out_
 *         column that the model does not give
 */
weft_err weft_vectors_run(const weft_vectors_model *model, const weft_csv *csv, const char *path, double rtol,
                          weft_vectors_column *columns, int *n_columns, weft_error *err);

/**
 * Evaluates a model at the rows of a table.
 *
 * @param n_outputs  gets the number of the model's outputs
 * @param outputs    gets [n_outputs][rows], to be freed with weft_free()
 */
weft_err weft_vectors_eval(const weft_vectors_model *model, const weft_csv *csv, const char *path,
                           int *n_outputs, double **outputs, weft_error *err);

/** Copies word `index` of names with blanks between to `word`; false behind the last. */
bool weft_vectors_word(const char *names, int index, char word[64]);

#endif
