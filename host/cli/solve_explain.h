/** weft solve --explain: one pixel's samples in words, as JSON, and as a plot. */
#ifndef WEFT_HOST_CLI_SOLVE_EXPLAIN_H
#define WEFT_HOST_CLI_SOLVE_EXPLAIN_H

#include "host/cli/command.h"
#include "host/solve/solve.h"

/**
 * Explains pixel xy of the set's maps on inv->out.
 *
 * @param xy    two whole numbers
 * @param plot  SVG file to write; NULL: none
 * @return WEFT_ERR_USAGE for other numbers; what weft_solve_explain() says
 */
weft_err weft_print_explanation(const weft_invocation *inv, const char *set_folder,
                                const weft_calibration *cal, const char *cal_folder,
                                const weft_solve_options *options, const weft_numbers *xy, const char *plot,
                                weft_error *err);

#endif
