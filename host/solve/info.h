/** What maps.json says about how maps were made. */
#ifndef WEFT_HOST_SOLVE_INFO_H
#define WEFT_HOST_SOLVE_INFO_H

#include "host/solve/solve.h"

typedef struct weft_solve_seconds {
    double read, solve, rectify;
} weft_solve_seconds;

/** Fills maps->info: "software", "inputs" with SHA-256 of set.json, calibration.json and every frame used,
 *  "options", "result" (pixels, answered, means) and "seconds".  @return WEFT_ERR_IO when an input cannot
 *  be hashed, WEFT_ERR_NOMEM. */
weft_err weft_solve_describe(const weft_set *set, const char *cal_folder, const weft_solve_options *options,
                             const weft_solve_seconds *seconds, weft_maps *maps, weft_error *err);

#endif
