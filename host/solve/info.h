/** What maps.json says about how maps were made. */
#ifndef WEFT_HOST_SOLVE_INFO_H
#define WEFT_HOST_SOLVE_INFO_H

#include "host/solve/bounce.h"
#include "host/solve/cloth_lobe.h"
#include "host/solve/solve.h"
#include "host/solve/strip.h"

/** What a run found beside the maps. */
typedef struct weft_solve_run {
    struct {
        double read, solve, bounce, rectify;
    } seconds;
    weft_gloss_report report;
    weft_gloss gloss; /* where report.found */
    weft_bounce_report bounce;
    int n_drift; /* lights; 0 for a set without a white strip */
    weft_strip_drift drift;
} weft_solve_run;

/** Fills maps->info: "software", "inputs" with SHA-256 of set.json, calibration.json and every frame used,
 *  "options", "result" (pixels, answered, means, "gloss" where one was found, "bounce" where it was taken
 *  off, "drift" by the white strip) and "seconds".  @return WEFT_ERR_IO when an input cannot be hashed,
 *  WEFT_ERR_NOMEM. */
weft_err weft_solve_describe(const weft_set *set, const char *cal_folder, const weft_solve_options *options,
                             const weft_solve_run *run, weft_maps *maps, weft_error *err);

#endif
