/* The files that a material is made of: where they are, which they are, and the size they give it. */
#include "shading/material/composite_private.h"

#include "core/file.h"
#include "core/mem.h"

#include <string.h>

const weft_composite_texture weft_composite_textures[WEFT_COMPOSITE_TEXTURES] = {
    {"albedo_map", WEFT_TEXTURE_COLOUR, WEFT_BAKED_ALBEDO, false},
    {"specular_map", WEFT_TEXTURE_SCALAR, WEFT_BAKED_SPECULAR, true},
    {"roughness_map", WEFT_TEXTURE_SCALAR, WEFT_BAKED_ROUGHNESS, true},
    {"normal_map", WEFT_TEXTURE_NORMAL, WEFT_BAKED_NORMAL, false},
    {"height_map", WEFT_TEXTURE_SCALAR, WEFT_BAKED_HEIGHT, false},
    {"occlusion_map", WEFT_TEXTURE_SCALAR, WEFT_BAKED_OCCLUSION, false},
    {"opacity_map", WEFT_TEXTURE_SCALAR, WEFT_BAKED_OPACITY, true},
};

weft_err weft_composite_source_path(const weft_rad_member *source, char **path, weft_error *err)
{
    char *const folder = weft_path_folder(source->value->place.source->path, err);
    *path =
        folder ? weft_path_join(strcmp(folder, ".") == 0 ? NULL : folder, source->value->text, err) : NULL;
    weft_free(folder);
    return *path ? WEFT_OK : WEFT_ERR_NOMEM;
}

weft_err weft_composite_load_scan(const weft_compositor *c, const weft_rad_member *member, weft_scan *scan,
                                  weft_error *err)
{
    char *path;
    if (!c->options->load_scan)
        return weft_fail(err, WEFT_ERR_UNSUPPORTED, "%s: scans cannot be read here",
                         weft_place_text(member->place));
    WEFT_TRY(weft_composite_source_path(member, &path, err));
    *scan = (weft_scan){0};
    weft_err status = c->options->load_scan(c->options->context, path, scan, err);
    weft_free(path);
    if (status == WEFT_OK && scan->normal.planes == 0 && scan->albedo.planes == 0)
        status = weft_fail(err, WEFT_ERR_MISSING, "the scan has neither normals nor albedo");
    return status == WEFT_OK ? WEFT_OK
                             : weft_prefix(err, status, "%s", weft_place_text(member->value->place));
}

weft_err weft_composite_open_u3m(const weft_rad_member *member, weft_u3m **u3m, weft_error *err)
{
    char *path;
    WEFT_TRY(weft_composite_source_path(member, &path, err));
    const weft_err status = weft_u3m_open(path, u3m, err);
    weft_free(path);
    return status == WEFT_OK ? WEFT_OK
                             : weft_prefix(err, status, "%s", weft_place_text(member->value->place));
}

typedef weft_err visit_fn(void *context, weft_assets *assets, const weft_rad_record *properties,
                          weft_error *err);

/* Calls `fn` for the material and all that lies in its layers. */
static weft_err visit(weft_assets *assets, const weft_rad_record *properties, visit_fn *fn, void *context,
                      int depth, weft_error *err)
{
    WEFT_TRY(fn(context, assets, properties, err));
    static const char *const lists[] = {"layers", "runtime_layers"};
    for (int k = 0; k < 2; k++) {
        const weft_rad_member *const layers = weft_rad_at(properties, lists[k]);
        for (const weft_rad_value *item = layers ? layers->value->items : NULL;
             item && depth < WEFT_COMPOSITE_MAX_DEPTH; item = item->next) {
            weft_asset layer;
            WEFT_TRY(weft_assets_layer(assets, &item->record, &layer, err));
            WEFT_TRY(visit(assets, &layer.properties, fn, context, depth + 1, err));
        }
    }
    return WEFT_OK;
}

typedef struct input_visit {
    weft_composite_input_fn *fn;
    void *context;
} input_visit;

static weft_err visit_texture(const input_visit *v, const weft_rad_record *record, weft_error *err)
{
    const weft_rad_member *const name = weft_rad_at(record, "name");
    char *path;
    if (!name)
        return WEFT_OK;
    WEFT_TRY(weft_texture_path(name->value, &path, err));
    v->fn(v->context, path, false);
    weft_free(path);
    return WEFT_OK;
}

/* The document, and of one that is no archive the files beside it. */
static weft_err visit_u3m(const input_visit *v, const weft_rad_member *member, weft_error *err)
{
    char *path, *folder = NULL;
    weft_u3m *u3m = NULL;
    WEFT_TRY(weft_composite_source_path(member, &path, err));
    v->fn(v->context, path, false);
    weft_err status = WEFT_OK;
    if (!weft_path_has_suffix(path, ".u3ma")) {
        folder = weft_path_folder(path, err);
        status = folder ? weft_composite_open_u3m(member, &u3m, err) : WEFT_ERR_NOMEM;
    }
    for (int i = 1; u3m && i < weft_u3m_files_count(u3m->files) && status == WEFT_OK; i++) {
        char *const file = weft_path_join(folder, weft_u3m_files_name(u3m->files, i), err);
        if (file)
            v->fn(v->context, file, false);
        else
            status = WEFT_ERR_NOMEM;
        weft_free(file);
    }
    weft_u3m_close(u3m);
    weft_free(folder);
    weft_free(path);
    return status;
}

static weft_err visit_inputs(void *context, weft_assets *assets, const weft_rad_record *p, weft_error *err)
{
    const input_visit *const v = context;
    (void)assets;
    for (int i = 0; i < WEFT_COMPOSITE_TEXTURES; i++) {
        const weft_rad_member *const m = weft_rad_at(p, weft_composite_textures[i].property);
        if (m)
            WEFT_TRY(visit_texture(v, &m->value->record, err));
    }
    const weft_rad_member *const mask = weft_rad_at(p, "mask"), *const scan = weft_rad_at(p, "scan");
    const weft_rad_member *const u3m = weft_rad_at(p, "u3m");
    if (mask)
        WEFT_TRY(visit_texture(v, &mask->value->record, err));
    if (u3m)
        WEFT_TRY(visit_u3m(v, u3m, err));
    if (scan) {
        char *path;
        WEFT_TRY(weft_composite_source_path(scan, &path, err));
        v->fn(v->context, path, true);
        weft_free(path);
    }
    return WEFT_OK;
}

weft_err weft_composite_inputs(weft_assets *assets, const weft_asset *asset, weft_composite_input_fn *fn,
                               void *context, weft_error *err)
{
    input_visit v = {fn, context};
    return visit(assets, &asset->properties, visit_inputs, &v, 0, err);
}

static void grow(weft_compositor *c, int width, int height)
{
    if ((long)width * height > (long)c->width * c->height) {
        c->width = width;
        c->height = height;
    }
}

static weft_err grow_by_u3m(weft_compositor *c, const weft_rad_member *member, weft_error *err)
{
    weft_u3m *u3m;
    int width, height;
    WEFT_TRY(weft_composite_open_u3m(member, &u3m, err));
    const weft_err status = weft_u3m_measure(u3m, &width, &height, err);
    if (status == WEFT_OK) {
        grow(c, width, height);
        if (!(c->thickness_mm > 0))
            c->thickness_mm = u3m->thickness_mm;
        if (!(c->weight_gsm > 0))
            c->weight_gsm = u3m->weight_gsm;
        if (!(c->size_mm[0] > 0)) {
            memcpy(c->size_mm, u3m->size_mm, sizeof c->size_mm);
            c->periodic = true; /* U3M's pictures repeat */
        }
    }
    weft_u3m_close(u3m);
    return status == WEFT_OK ? WEFT_OK
                             : weft_prefix(err, status, "%s", weft_place_text(member->value->place));
}

/* The largest picture decides the size; the outermost scan of known scale the millimetres. */
static weft_err visit_size(void *context, weft_assets *assets, const weft_rad_record *p, weft_error *err)
{
    weft_compositor *const c = context;
    (void)assets;
    const weft_rad_member *const scan_name = weft_rad_at(p, "scan");
    if (scan_name) {
        weft_scan scan;
        WEFT_TRY(weft_composite_load_scan(c, scan_name, &scan, err));
        const weft_image *const one = scan.normal.planes ? &scan.normal : &scan.albedo;
        grow(c, one->width, one->height);
        if (!(c->size_mm[0] > 0)) {
            c->size_mm[0] = scan.mm_per_px * one->width;
            c->size_mm[1] = scan.mm_per_px * one->height;
            c->periodic = c->periodic || scan.periodic;
        }
        weft_scan_fini(&scan);
    }
    if (weft_rad_at(p, "u3m"))
        WEFT_TRY(grow_by_u3m(c, weft_rad_at(p, "u3m"), err));
    for (int i = 0; i < WEFT_COMPOSITE_TEXTURES; i++) {
        const weft_rad_member *const m = weft_rad_at(p, weft_composite_textures[i].property);
        if (!m || !weft_rad_at(&m->value->record, "name"))
            continue;
        weft_image image;
        WEFT_TRY(weft_texture_read(&m->value->record, weft_composite_textures[i].use, &image, err));
        grow(c, image.width, image.height);
        weft_image_fini(&image);
    }
    return WEFT_OK;
}

weft_err weft_composite_measure(weft_compositor *c, const weft_rad_record *properties, weft_error *err)
{
    return visit(c->assets, properties, visit_size, c, 0, err);
}
