/** Keys of build steps: hashes of named values. */
#ifndef WEFT_SHADING_MATERIAL_BUILD_KEY_H
#define WEFT_SHADING_MATERIAL_BUILD_KEY_H

#include "core/image.h"
#include "core/sha256.h"
#include "shading/material/asset.h"

#include <jansson.h>

typedef struct weft_build_key {
    weft_sha256 hash;
} weft_build_key;

/** Begins a key of a step and of the version of its code. */
weft_build_key weft_build_key_begin(const char *step, int version);
void weft_build_key_text(weft_build_key *key, const char *name, const char *value);
void weft_build_key_number(weft_build_key *key, const char *name, double value);
void weft_build_key_end(weft_build_key *key, char hex[65]);

/** Hash of the texels of an image, or of the constants when it has no planes. */
void weft_build_key_image(const weft_image *image, const float constant[4], int planes, char hex[65]);

/**
 * The hash of a file's content; from `known` when size and time of change are as they were then.
 * @param known  {PATH: {"size", "mtime_ns", "sha256"}}; brought up to date
 */
weft_err weft_build_key_file(const char *path, json_t *known, char hex[65], weft_error *err);

/** All resolved properties of a material and of its layers, one line each: {"layers[0].opacity": "1  //
 * cotton"}. */
json_t *weft_build_properties(weft_assets *assets, const weft_asset *asset, weft_error *err);

#endif
