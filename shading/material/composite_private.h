/** Inside of the compositor: what its parts share. */
#ifndef WEFT_SHADING_MATERIAL_COMPOSITE_PRIVATE_H
#define WEFT_SHADING_MATERIAL_COMPOSITE_PRIVATE_H

#include "shading/material/composite.h"
#include "shading/material/texture.h"
#include "shading/u3m/u3m_document.h"

/** Materials in layers, and layers in those, go no deeper. */
#define WEFT_COMPOSITE_MAX_DEPTH 64

/** A texture property and where it goes. */
typedef struct weft_composite_texture {
    const char *property;
    weft_texture_use use;
    weft_baked_kind kind;
    bool multiplies; /* the constant of the property beside it */
} weft_composite_texture;

#define WEFT_COMPOSITE_TEXTURES 7
extern const weft_composite_texture weft_composite_textures[WEFT_COMPOSITE_TEXTURES];

typedef struct weft_compositor {
    weft_assets *assets;
    const weft_composite_options *options;
    int width, height;
    double size_mm[2], thickness_mm, weight_gsm;
    bool periodic;
    weft_runtime_layers *runtime; /* gets the outermost material's; NULL: nobody asks */
} weft_compositor;

/** Path of a scan or a U3M: beside the text that names it. */
weft_err weft_composite_source_path(const weft_rad_member *source, char **path, weft_error *err);
/** Reads the scan that a property names; errors name the place in the text. */
weft_err weft_composite_load_scan(const weft_compositor *c, const weft_rad_member *member, weft_scan *scan,
                                  weft_error *err);
/** Opens the U3M that a property names; errors name the place in the text. */
weft_err weft_composite_open_u3m(const weft_rad_member *member, weft_u3m **u3m, weft_error *err);

/** Width, height, millimetres and the rest by the largest picture and the outermost scan in all layers. */
weft_err weft_composite_measure(weft_compositor *c, const weft_rad_record *properties, weft_error *err);

/**
 * Lays a material's own properties over what is there: U3M, constants, scan, pictures, factors.
 * @param inherited  over a composite: what lies above the asset that has the layers, and is not its own; or
 * NULL
 */
weft_err weft_composite_apply_own(const weft_compositor *c, weft_baked *baked, const weft_rad_record *p,
                                  const weft_asset *inherited, weft_error *err);

#endif
