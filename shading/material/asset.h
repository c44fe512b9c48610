/**
 * Materials by name: what a text means once includes are read, bases are found and properties inherited.
 *
 * A derived asset has every property of its base unless it sets it (S-ORD-25).  Records merge member by
 * member, everything else replaces; a record written with its own base replaces as a whole.  Built-in types
 * carry the defaults of the table, so that every asset is complete; each property knows who set it.
 */
#ifndef WEFT_SHADING_MATERIAL_ASSET_H
#define WEFT_SHADING_MATERIAL_ASSET_H

#include "shading/material/material_types.h"
#include "shading/material/radattr.h"

typedef struct weft_asset {
    const char *name;
    weft_place place;
    const weft_material_type *type;
    const struct weft_asset *base; /* NULL for a built-in type */
    weft_rad_record properties;    /* merged; every member's set_by names the asset that set it */
} weft_asset;

/** All materials of a file and of what it includes. */
typedef struct weft_assets weft_assets;

/**
 * Reads `path` and what it includes and resolves every material in them.
 *
 * Whatever is wrong in the texts goes to weft_assets_diagnostics(): all of it, not only the first.
 * @param library  folder of `include <...>`; NULL: there is none
 * @return WEFT_ERR_FORMAT with the first mistake as one line, WEFT_ERR_IO, WEFT_ERR_NOMEM; `assets` is made
 *         whenever there are diagnostics to print, also then: destroy it.
 */
weft_err weft_assets_load(const char *path, const char *library, weft_assets **assets, weft_error *err);
/** The same for a text in memory, as if it stood beside `path`.  @param text  ends with NUL; copied */
weft_err weft_assets_load_text(const char *path, const char *text, weft_assets **assets, weft_error *err);
void weft_assets_destroy(weft_assets *assets);

const weft_diagnostics *weft_assets_diagnostics(const weft_assets *assets);

/** The files that were read, the first being the one asked for; NULL behind the last. */
const char *weft_assets_path(const weft_assets *assets, int index);

/** The materials defined in them (not the built-in types), in order of their names; NULL behind the last. */
const weft_asset *weft_assets_get(const weft_assets *assets, int index);

/** The material of a name.  @return WEFT_ERR_MISSING with the nearest name. */
weft_err weft_assets_find(const weft_assets *assets, const char *name, const weft_asset **asset,
                          weft_error *err);

/** The last material defined in the file that was asked for: what a file is about; NULL when it has none. */
const weft_asset *weft_assets_main(const weft_assets *assets);

/** A layer's material: its base with what the layer overrides.  @param record  an item of :layers */
weft_err weft_assets_layer(weft_assets *assets, const weft_rad_record *record, weft_asset *layer,
                           weft_error *err);

/** The property at a dotted path ("mask.low"); NULL when it is absent. */
const weft_rad_member *weft_rad_at(const weft_rad_record *record, const char *path);

/* Values at a dotted path of a record, in the kind the table says; `absent` when it is not there. */
double weft_rad_number(const weft_rad_record *record, const char *path, double absent);
bool weft_rad_flag(const weft_rad_record *record, const char *path, bool absent);
const char *weft_rad_text(const weft_rad_record *record, const char *path, const char *absent);
/** Linear BT.709; a component that nobody set is `absent`. */
void weft_rad_colour(const weft_rad_record *record, const char *path, double absent, double rgb[3]);
/** Reads up to `n` numbers of a list.  @return how many. */
int weft_rad_numbers(const weft_rad_record *record, const char *path, int n, double *values);

/** Prints every property with the asset that set it: ":specular_roughness = 0.1  // bumpy_material". */
void weft_asset_print(const weft_asset *asset, FILE *out);

#endif
