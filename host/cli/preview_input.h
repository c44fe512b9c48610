/** What "weft preview" and "weft contact" share: solved maps as a surface to look at. */
#ifndef WEFT_HOST_CLI_PREVIEW_INPUT_H
#define WEFT_HOST_CLI_PREVIEW_INPUT_H

#include "core/fields.h"
#include "host/set/maps.h"
#include "shading/bake/baked.h"
#include "shading/brdf/merl.h"
#include "shading/preview/preview.h"

/** What is looked at in memory, and the surface that borrows it. */
typedef struct weft_preview_input {
    weft_maps maps;      /* of a maps folder */
    weft_baked baked;    /* of a material */
    weft_merl *measured; /* of a model that is a file */
    weft_texts params;
    int n_extra;
    weft_image extra[WEFT_TEXTS_MAX]; /* maps of parameters: --param alpha=roughness.exr */
    weft_image height_mm;             /* of weft_preview_input_height(), when it was read */
    int level;                        /* of the material's mips that is shown */
    weft_preview_texture texture;     /* of a material for several pictures; empty until packed */
    weft_preview_surface surface;
} weft_preview_input;

/**
 * Loads solved maps (NAME.maps) or a baked material (NAME.material) for a model.
 *
 * @param brdf    name of a model, or NAME.binary: a table of the MERL form
 * @param folder  NULL: a smooth surface of the model's parameters, as large as the first picture among them
 * (else 64 x 64), a ball of which has a radius of 50 mm
 * @param params  "name=0.3", "name=r,g,b", or "name=FILE" of the same size; colours of 8 bits are sRGB, of 16
 *                linear (docs/conventions.md)
 * The albedo map becomes the parameters "albedo", "base" and "cloth_albedo" as the model has them; a material
 * also gives "f0" (from specular), "alpha" (from roughness), "anisotropy", "front" and "rim".
 */
weft_err weft_preview_input_load(weft_preview_input *input, const char *folder, const char *brdf,
                                 const weft_texts *params, weft_error *err);

/** Begins a material's chains of mips at the first level with at most 8 texels a pixel, for pictures that
 * shade every texel (WEFT_PREVIEW_SAMPLES).  Does nothing to maps.  Before this it is level 0. */
weft_err weft_preview_input_level(weft_preview_input *input, double texels_per_px, weft_error *err);

/**
 * Gives the surface its heights: of `file` (EXR, mm, the size of the maps), else the material's, else the
 * height.exr of the folder of maps.
 * @return WEFT_ERR_MISSING saying how to get one
 */
weft_err weft_preview_input_height(weft_preview_input *input, const char *folder, const char *file,
                                   weft_error *err);

/** Warns of constants that no surface has (brdf/specular_doubt.h). */
void weft_preview_input_warn(const weft_preview_input *input);

void weft_preview_input_fini(weft_preview_input *input);

/** Last part of a path, without trailing slashes and without ".maps" or ".set"; on the heap. */
char *weft_preview_title(const char *folder, weft_error *err);

#endif
