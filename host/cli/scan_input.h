/** Solved maps as the scan of a material. */
#ifndef WEFT_HOST_CLI_SCAN_INPUT_H
#define WEFT_HOST_CLI_SCAN_INPUT_H

#include "shading/material/composite.h"

/** A weft_scan_load_fn: reads a maps folder; texels without an answer get the mean albedo and lie flat. */
weft_err weft_scan_input_load(void *context, const char *path, weft_scan *scan, weft_error *err);

#endif
