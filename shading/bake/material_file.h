/** Baked materials on disk: NAME.material/ with material.json and one EXR with mips a map (docs/formats.md).
 */
#ifndef WEFT_SHADING_BAKE_MATERIAL_FILE_H
#define WEFT_SHADING_BAKE_MATERIAL_FILE_H

#include "shading/bake/baked.h"

#define WEFT_MATERIAL_VERSION 1

/** Writes one map's chain as FOLDER/NAME.exr, whole or not at all: half floats, height in full ones. */
weft_err weft_material_save_map(const char *folder, const weft_baked *baked, weft_baked_kind kind,
                                weft_error *err);

/** What material.json says of a material, without its maps: {"weft": "material", "version": 1, "name",
 * "type", "brdf", "width", "height", "size_mm", "periodic", "maps": {NAME: {"mips", "constant", "unit"[,
 * "file"]}}}. NULL without memory. */
json_t *weft_material_describe(const weft_baked *baked);

/** Reads material.json alone: everything but the pictures (n_mips says how many there are on disk). */
weft_err weft_material_load_head(const char *folder, weft_baked *baked, json_t **state, weft_error *err);

/** Reads the levels of one map of a head into memory. */
weft_err weft_material_load_map(const char *folder, weft_baked *baked, weft_baked_kind kind, weft_error *err);

/** Reads a whole material.  @return WEFT_ERR_FORMAT, WEFT_ERR_VERSION, WEFT_ERR_IO naming the file */
weft_err weft_material_load(const char *folder, weft_baked *baked, weft_error *err);

#endif
