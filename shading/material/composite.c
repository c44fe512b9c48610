#include "shading/material/composite_private.h"

#include "core/mem.h"
#include "shading/material/blend.h"
#include "shading/material/mask.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

enum { DEFAULT_SIDE = 256 };

void weft_scan_fini(weft_scan *scan)
{
    weft_image *const images[] = {&scan->albedo,    &scan->normal, &scan->specular,
                                  &scan->roughness, &scan->height, &scan->opacity};
    for (size_t i = 0; i < sizeof images / sizeof images[0]; i++)
        weft_image_fini(images[i]);
    *scan = (weft_scan){0};
}

void weft_runtime_layers_fini(weft_runtime_layers *layers)
{
    weft_baked_fini(&layers->base);
    for (int k = 0; k < WEFT_RUNTIME_LAYERS_MAX; k++) {
        weft_baked_fini(&layers->layers[k].baked);
        weft_image_fini(&layers->layers[k].alpha);
    }
    *layers = (weft_runtime_layers){0};
}

static weft_err composite(const weft_compositor *c, const weft_asset *asset, int depth, weft_baked *baked,
                          weft_error *err);

static unsigned channels_of(const weft_rad_record *p)
{
    static const struct {
        const char *name;
        unsigned channels;
    } names[] = {{"albedo", WEFT_BLEND_ALBEDO},
                 {"specular", WEFT_BLEND_SPECULAR},
                 {"normal", WEFT_BLEND_NORMAL},
                 {"albedo_specular", WEFT_BLEND_ALBEDO | WEFT_BLEND_SPECULAR},
                 {"specular_normal", WEFT_BLEND_SPECULAR | WEFT_BLEND_NORMAL}};
    for (size_t i = 0; i < sizeof names / sizeof names[0]; i++)
        if (strcmp(weft_rad_text(p, "channels", "all"), names[i].name) == 0)
            return names[i].channels;
    return WEFT_BLEND_ALL;
}

/* The library's name, or with a number where the layer sets anything of the material itself. */
static void name_layer(const weft_rad_value *item, int index, weft_runtime_layer *layer)
{
    static const char *const of_layers[] = {"alpha", "mask", "channels", "blend"};
    bool is_own = false;
    for (const weft_rad_member *m = item->record.members; m; m = m->next) {
        bool known = false;
        for (int k = 0; k < 4; k++)
            known = known || strcmp(m->name, of_layers[k]) == 0;
        is_own = is_own || !known;
    }
    if (is_own)
        (void)snprintf(layer->name, sizeof layer->name, "%.100s_%d", item->record.base, index);
    else
        (void)snprintf(layer->name, sizeof layer->name, "%.100s", item->record.base);
}

/* Keeps a layer as it was laid: `above` and `mask` are taken over. */
static void keep_layer(weft_runtime_layer *to, weft_baked *above, weft_image *mask, float alpha)
{
    to->baked = *above;
    to->alpha = *mask;
    to->constant = alpha;
    *above = (weft_baked){0};
    *mask = (weft_image){0};
    for (size_t i = 0; to->alpha.planes && i < weft_image_plane_size(&to->alpha); i++)
        to->alpha.data[i] = fminf(fmaxf(alpha * to->alpha.data[i], 0), 1);
}

/* @param keep  gets the layer; NULL: nobody asks */
static weft_err lay(const weft_compositor *c, const weft_rad_value *item, int depth, weft_baked *below,
                    weft_runtime_layer *keep, weft_error *err)
{
    weft_asset layer;
    weft_baked above = {0};
    weft_image mask = {0};
    WEFT_TRY(weft_assets_layer(c->assets, &item->record, &layer, err));
    weft_err status = composite(c, &layer, depth + 1, &above, err);
    const weft_rad_member *const record = weft_rad_at(&layer.properties, "mask");
    if (status == WEFT_OK && record)
        status = weft_mask_make(&record->value->record, below, &mask, err);
    const double alpha = weft_rad_number(&layer.properties, "alpha", 1);
    const unsigned channels = channels_of(&layer.properties);
    const bool reorient = strcmp(weft_rad_text(&layer.properties, "blend", "slope"), "rnm") == 0;
    if (status == WEFT_OK)
        status = weft_blend(below, &above, mask.planes ? mask.data : NULL, alpha, channels, reorient, err);
    if (status == WEFT_OK && keep) {
        keep->channels = channels;
        keep->reorient = reorient;
        keep_layer(keep, &above, &mask, (float)alpha);
    }
    if (status != WEFT_OK)
        weft_prefix(err, status, "%s: layer '%s'", weft_place_text(item->place), item->record.base);
    weft_image_fini(&mask);
    weft_baked_fini(&above);
    return status;
}

/* What an engine would blend lies over everything else; here it is flattened. */
static weft_err lay_runtime(const weft_compositor *c, const weft_asset *asset, int depth, weft_baked *baked,
                            weft_error *err)
{
    const weft_rad_member *const list = weft_rad_at(&asset->properties, "runtime_layers");
    weft_runtime_layers *const keep = depth == 0 ? c->runtime : NULL;
    const weft_rad_value *item = list ? list->value->items : NULL;
    if (item && keep)
        WEFT_TRY(weft_baked_copy(baked, &keep->base, err));
    for (int index = 0; item; item = item->next, index++) {
        weft_runtime_layer *const layer =
            keep && keep->n < WEFT_RUNTIME_LAYERS_MAX ? &keep->layers[keep->n++] : NULL;
        if (layer)
            name_layer(item, index, layer);
        WEFT_TRY(lay(c, item, depth, baked, layer, err));
    }
    return WEFT_OK;
}

static weft_err composite(const weft_compositor *c, const weft_asset *asset, int depth, weft_baked *baked,
                          weft_error *err)
{
    if (depth > WEFT_COMPOSITE_MAX_DEPTH)
        return weft_fail(err, WEFT_ERR_FORMAT, "%s: layers lie in layers deeper than %d", asset->name,
                         WEFT_COMPOSITE_MAX_DEPTH);
    WEFT_TRY(weft_baked_init(baked, asset->name, asset->type, err));
    baked->width = c->width;
    baked->height = c->height;
    memcpy(baked->size_mm, c->size_mm, sizeof baked->size_mm);
    baked->periodic = c->periodic;
    const weft_rad_member *const layers = weft_rad_at(&asset->properties, "layers");
    weft_err status = WEFT_OK;
    for (const weft_rad_value *item = layers ? layers->value->items : NULL; item && status == WEFT_OK;
         item = item->next) {
        if (item == layers->value->items) { /* nothing of the type's defaults lies under the lowest */
            weft_asset lowest;
            status = weft_assets_layer(c->assets, &item->record, &lowest, err);
            if (status == WEFT_OK)
                baked->type = lowest.type;
            baked->maps[WEFT_BAKED_CLOTH].constant[0] = baked->type->model == WEFT_MATERIAL_CLOTH;
        }
        if (status == WEFT_OK)
            status = lay(c, item, depth, baked, NULL, err);
    }
    const weft_asset *layered =
        NULL; /* the asset whose text has the layers: what it derives from is below them */
    if (status == WEFT_OK && layers && layers->value->items)
        status = weft_assets_find(c->assets, layers->set_by, &layered, err);
    if (status == WEFT_OK)
        status = weft_composite_apply_own(c, baked, &asset->properties, layered ? layered->base : NULL, err);
    if (status == WEFT_OK)
        status = lay_runtime(c, asset, depth, baked, err);
    if (status != WEFT_OK)
        weft_baked_fini(baked);
    return status;
}

weft_err weft_composite_u3m(const weft_asset *asset, char **path, weft_error *err)
{
    const weft_rad_member *const member = weft_rad_at(&asset->properties, "u3m");
    *path = NULL;
    return member ? weft_composite_source_path(member, path, err) : WEFT_OK;
}

static weft_err run(weft_assets *assets, const weft_asset *asset, const weft_composite_options *options,
                    weft_runtime_layers *runtime, weft_baked *baked, weft_error *err)
{
    weft_compositor c = {
        .assets = assets, .options = options, .periodic = options->periodic, .runtime = runtime};
    const weft_rad_record *const p = &asset->properties;
    c.size_mm[0] = weft_rad_number(p, "width_mm", 0);
    c.size_mm[1] = weft_rad_number(p, "height_mm", 0);
    c.thickness_mm = weft_rad_number(p, "thickness_mm", 0);
    c.weight_gsm = weft_rad_number(p, "weight_gsm", 0);
    *baked = (weft_baked){0};
    WEFT_TRY(weft_composite_measure(&c, p, err));
    if (options->width > 0) {
        c.width = options->width;
        c.height = options->height;
    } else if (c.width == 0) {
        c.width = c.height = DEFAULT_SIDE;
    }
    const weft_err status = composite(&c, asset, 0, baked, err);
    if (status == WEFT_OK) {
        baked->thickness_mm = c.thickness_mm;
        baked->weight_gsm = c.weight_gsm;
    }
    return status;
}

weft_err weft_composite(weft_assets *assets, const weft_asset *asset, const weft_composite_options *options,
                        weft_baked *baked, weft_error *err)
{
    return run(assets, asset, options, NULL, baked, err);
}

weft_err weft_composite_runtime(weft_assets *assets, const weft_asset *asset,
                                const weft_composite_options *options, weft_runtime_layers *layers,
                                weft_error *err)
{
    weft_baked flat;
    *layers = (weft_runtime_layers){0};
    const weft_err status = run(assets, asset, options, layers, &flat, err);
    if (status == WEFT_OK)
        weft_baked_fini(&flat);
    else
        weft_runtime_layers_fini(layers);
    return status;
}
