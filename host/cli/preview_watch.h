/** weft preview --watch: draw again when what is looked at changes. */
#ifndef WEFT_HOST_CLI_PREVIEW_WATCH_H
#define WEFT_HOST_CLI_PREVIEW_WATCH_H

#include "host/cli/preview_options.h"

#include <stdint.h>

/** A number that changes when a file that the picture is made of is written, added, replaced or removed: the
 *  files of INPUT (NULL: none), pictures of --param, --env, --height-map, and a table of --brdf. */
uint64_t weft_preview_watch_state(const char *input, const weft_preview_options *options);

/**
 * Waits until the files are no longer in `state` and have been left alone for a moment; updates `state`.
 *
 * @return WEFT_ERR_CANCELLED by Ctrl-C
 */
weft_err weft_preview_watch_wait(const char *input, const weft_preview_options *options, uint64_t *state,
                                 weft_error *err);

#endif
