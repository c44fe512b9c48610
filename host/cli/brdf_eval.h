/** "weft brdf NAME --eval TABLE": a model, or a function behind a table of reference values, at the rows of
 *  a CSV file. */
#ifndef WEFT_HOST_CLI_BRDF_EVAL_H
#define WEFT_HOST_CLI_BRDF_EVAL_H

#include "core/csv.h"
#include "shading/brdf/brdf.h"

#include <stdbool.h>

/**
 * Values of a model at the rows of a table.
 *
 * Directions are columns nl, nv and phi (azimuth from l to v; or phi_l and phi_v), or lx ly lz vx vy vz;
 * parameters are columns by name or symbol, a colour also as name_r name_g name_b; what the table does not
 * give is taken from `values`.  Columns out_*, tag and note are left alone.
 *
 * @param rgb    gets whether a colour differs between channels, so that one value would not tell all
 * @param value  gets [3][rows]; weft_free() it
 * @return WEFT_ERR_FORMAT naming column and row
 */
weft_err weft_brdf_eval_table(const weft_brdf *brdf, const double values[WEFT_BRDF_MAX_PLANES],
                              const weft_csv *csv, const char *path, bool *rgb, double **value,
                              weft_error *err);

#endif
