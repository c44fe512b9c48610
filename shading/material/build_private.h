/** Inside of a build: its state on disk and in memory, and the steps in files of their own. */
#ifndef WEFT_SHADING_MATERIAL_BUILD_PRIVATE_H
#define WEFT_SHADING_MATERIAL_BUILD_PRIVATE_H

#include "shading/material/build.h"

typedef struct weft_builder {
    weft_assets *assets;
    const weft_asset *asset;
    const weft_build_options *options;
    weft_build_result *result;
    json_t *old;    /* material.json as it was; NULL: there is none */
    json_t *keys;   /* step: hex, of what stands on disk now; saved after each step */
    json_t *inputs; /* hashes of files */
    json_t *properties;
    weft_baked baked;
    char texels[WEFT_BAKED_COUNT][65]; /* hashes of level 0 or of the constants */
    char composite_key[65];
} weft_builder;

/* ---- state: build_state.c ---- */

/** Tells whoever asked for --why. */
void weft_builder_note(const weft_builder *b, const char *step, const char *what, const char *why);
/** Whether what is on disk was made from what this key stands for. */
bool weft_builder_is_current(const weft_builder *b, const char *step, const char key[65]);
/** Reads material.json; one that cannot be read is none, and everything is built anew.
 *  @return WEFT_ERR_EXISTS for a folder that is no material */
weft_err weft_builder_load(weft_builder *b, weft_error *err);
/** A step is done and on record; here a build may be cancelled, and goes on later. */
weft_err weft_builder_finish(weft_builder *b, const char *step, const char key[65], weft_error *err);
/**
 * Strikes steps off the record on disk before their files are written: a build that is killed between a file
 * and its record must not leave the new file under the old key, which a change that is taken back would then
 * trust.
 * @param steps  NULL behind the last
 */
weft_err weft_builder_begin(weft_builder *b, const char *const steps[], weft_error *err);
/** The first property that is not as it was, as a reason. */
void weft_builder_explain_change(const weft_builder *b, char *why, size_t size);

/* ---- relief and detail: build_relief.c ---- */

/** Height in millimetres from the normals; without a scale, in texels of a map 1 mm a texel. */
weft_err weft_builder_make_height(weft_builder *b, weft_error *err);
/** Occlusion with the bent cone, cavity, curvature from the height. */
weft_err weft_builder_make_relief(weft_builder *b, weft_error *err);
/** Detail over a base of low frequencies: albedo divided, slopes subtracted. */
weft_err weft_builder_make_detail(weft_builder *b, weft_error *err);

/* ---- files: build_files.c ---- */

bool weft_builder_file_is_there(const weft_builder *b, weft_baked_kind kind);
/** Whether the file on disk holds the texels that b->texels[kind] stands for. */
bool weft_builder_file_is_current(const weft_builder *b, weft_baked_kind kind);
/** Makes the mips of what is not on disk as it should be, and writes those files. */
weft_err weft_builder_write_maps(weft_builder *b, weft_error *err);
/** Removes files of maps that the material no longer has. */
void weft_builder_remove_leftovers(weft_builder *b);

/* ---- exports: build_exports.c ---- */

/** Exporters read the files, not what is in memory: the same bytes whether or not something was rebuilt. */
weft_err weft_builder_make_exports(weft_builder *b, weft_error *err);

#endif
