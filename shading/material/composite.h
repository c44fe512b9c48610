/**
 * From the text of a material to its maps at full size: layers are laid over each other and the material's
 * own properties over them (S-ORD-26).
 *
 *     w_k = clamp(alpha_k mask_k);   P <- lerp(P, P_k, w_k) from the lowest layer up;   then the own
 * properties
 *
 * :runtime_layers are laid over the result by the same rule: an engine may do it in their stead.
 *
 * Every quantity is blended where it is meaningful: colours and F0 linear, roughness as alpha along and
 * across the tangent, normals as slopes (or reoriented, :blend = rnm), the rest linear; tints multiply.
 * Isotropic with anisotropic gives anisotropic; GGX with cloth keeps both lobes and the weight between them;
 * anisotropic with cloth is refused.
 */
#ifndef WEFT_SHADING_MATERIAL_COMPOSITE_H
#define WEFT_SHADING_MATERIAL_COMPOSITE_H

#include "shading/bake/baked.h"
#include "shading/material/asset.h"
#include "shading/material/runtime_layers.h"

/** What a scan gives; planes 0 where it has none.  The loader makes it, the compositor frees it. */
typedef struct weft_scan {
    weft_image albedo;    /* 3, linear */
    weft_image normal;    /* 3, unit */
    weft_image specular;  /* 1, F0 */
    weft_image roughness; /* 1, alpha */
    weft_image height;    /* 1, mm */
    weft_image opacity;   /* 1 */
    double mm_per_px;     /* 0: unknown */
    bool periodic;
} weft_scan;

void weft_scan_fini(weft_scan *scan);

/** Reads a folder of solved maps; the host has one. */
typedef weft_err weft_scan_load_fn(void *context, const char *path, weft_scan *scan, weft_error *err);

typedef struct weft_composite_options {
    int width, height; /* 0: those of the material's largest scan or texture; 256 x 256 without any */
    bool periodic;     /* the maps repeat */
    weft_scan_load_fn *load_scan;
    void *context;
} weft_composite_options;

/**
 * Composites a material.
 *
 * @param baked  initialised here: level 0 of the maps that are not constant
 * @return WEFT_ERR_MISSING, WEFT_ERR_FORMAT, WEFT_ERR_UNSUPPORTED with the place in the text; WEFT_ERR_NOMEM
 */
weft_err weft_composite(weft_assets *assets, const weft_asset *asset, const weft_composite_options *options,
                        weft_baked *baked, weft_error *err);

/** The same, but what weft_composite() flattens at the end is kept apart.
 *  @param layers  initialised here; n is 0 for a material without :runtime_layers */
weft_err weft_composite_runtime(weft_assets *assets, const weft_asset *asset,
                                const weft_composite_options *options, weft_runtime_layers *layers,
                                weft_error *err);

/** The path of the U3M that a material is made from, NULL of one that is not; free with weft_free(). */
weft_err weft_composite_u3m(const weft_asset *asset, char **path, weft_error *err);

/** What a file is to a material. */
typedef void weft_composite_input_fn(void *context, const char *path, bool is_scan);

/** Calls `fn` with every file that weft_composite() would read, layers and masks included, a file perhaps
 * more than once.  @return WEFT_ERR_MISSING with the place in the text */
weft_err weft_composite_inputs(weft_assets *assets, const weft_asset *asset, weft_composite_input_fn *fn,
                               void *context, weft_error *err);

#endif
