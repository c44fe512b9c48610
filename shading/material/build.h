/**
 * A material from its text to its folder, rebuilding only what depends on something that changed.
 *
 *     text, pictures -> composite -> height -> relief (occlusion, bent cone, cavity, curvature)
 *                                 -> detail      -> mips -> NAME.exr ...  -> exports
 *
 * Every step has a key: the hash of all that goes into it, content and options, not dates.  The composite's
 * key is made of the resolved properties, so that a template that changes without changing this material
 * rebuilds nothing; the steps behind it have keys of the texels, so that a tint rebuilds colours and leaves
 * the relief alone.  material.json holds the keys and is written after each step: a build that was killed
 * goes on where it was.
 */
#ifndef WEFT_SHADING_MATERIAL_BUILD_H
#define WEFT_SHADING_MATERIAL_BUILD_H

#include "shading/bake/mips.h"
#include "shading/export/exporter.h"
#include "shading/material/composite.h"

/** Says what is done to a step: "albedo.exr", "rebuilt", "its texels changed". */
typedef void weft_build_note_fn(void *context, const char *step, const char *what, const char *why);

typedef struct weft_build_options {
    const char *folder; /* NAME.material; made when it is not there */
    weft_composite_options composite;
    weft_mip_options mips;
    double reach_mm;  /* how far relief hides the sky; 0: 2 mm */
    double detail_mm; /* sigma of the base that detail maps leave out; 0: no detail maps */
    const weft_exporter *const *exporters; /* NULL: none; ends with NULL */
    weft_build_note_fn *note;              /* may be NULL */
    void *context;
} weft_build_options;

/** What was done. */
typedef struct weft_build_result {
    int rebuilt, kept; /* files and folders */
} weft_build_result;

/**
 * Builds.  A folder that holds something else than a material is refused.
 * @return WEFT_ERR_EXISTS, and what the steps return; what was done up to a failure is kept and used
 */
weft_err weft_build(weft_assets *assets, const weft_asset *asset, const weft_build_options *options,
                    weft_build_result *result, weft_error *err);

#endif
