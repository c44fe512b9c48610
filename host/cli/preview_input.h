/** What "weft preview" and "weft contact" share: solved maps as a surface to look at. */
#ifndef WEFT_HOST_CLI_PREVIEW_INPUT_H
#define WEFT_HOST_CLI_PREVIEW_INPUT_H

#include "core/fields.h"
#include "host/set/maps.h"
#include "shading/preview/preview.h"

/** Maps in memory and the surface that borrows them. */
typedef struct weft_preview_input {
    weft_maps maps;
    int n_extra;
    weft_image extra[WEFT_TEXTS_MAX]; /* maps of parameters: --param alpha=roughness.exr */
    weft_preview_surface surface;
} weft_preview_input;

/**
 * Loads a maps folder for a model.
 *
 * @param params  "name=0.3", "name=r,g,b", or "name=FILE" (EXR, or PNG/TIFF as linear 0..1) of the same size
 * The albedo map becomes the parameter "albedo" where the model has one.
 */
weft_err weft_preview_input_load(weft_preview_input *input, const char *folder, const char *brdf,
                                 const weft_texts *params, weft_error *err);
void weft_preview_input_fini(weft_preview_input *input);

/** Last part of a path, without trailing slashes and without ".maps" or ".set"; on the heap. */
char *weft_preview_title(const char *folder, weft_error *err);

#endif
