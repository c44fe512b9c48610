/** weft preview --match: solved maps rendered again under each lamp of a set, beside its photographs. */
#ifndef WEFT_HOST_CLI_PREVIEW_MATCH_H
#define WEFT_HOST_CLI_PREVIEW_MATCH_H

#include "host/cli/command.h"
#include "host/cli/preview_input.h"

/** Compares, prints a row a light, and writes a sheet with photograph, rendering and their difference (times
 *  four) of every light to `output`. */
weft_err weft_preview_match(const weft_invocation *inv, const weft_preview_input *input, const char *set,
                            const char *cal, const char *output, weft_error *err);

#endif
