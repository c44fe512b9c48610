#include "shading/export/export_layers.h"

#include "core/file.h"
#include "core/formats/png_file.h"
#include "core/json.h"
#include "core/mem.h"
#include "shading/material/blend.h"

#include <string.h>

/* One mask a channel; alpha only where there is a fourth layer: viewers take it for opacity. */
static weft_err write_masks(const char *folder, const weft_runtime_layers *layers, weft_error *err)
{
    weft_raster raster = {0};
    char *const path = weft_path_join(folder, "masks.png", err);
    if (!path)
        return WEFT_ERR_NOMEM;
    const int channels = layers->n > 3 ? 4 : 3;
    weft_err status = weft_raster_init(&raster, layers->base.width, layers->base.height, channels, 8, err);
    for (int k = 0; k < layers->n && status == WEFT_OK; k++) {
        const weft_runtime_layer *const layer = &layers->layers[k];
        for (size_t i = 0; i < (size_t)raster.width * (size_t)raster.height; i++) {
            const float w = layer->alpha.planes ? layer->alpha.data[i] : layer->constant;
            raster.data[i * (size_t)channels + (size_t)k] = (uint16_t)(w * 255 + 0.5F);
        }
    }
    if (status == WEFT_OK)
        status = weft_png_write(path, &raster, err);
    weft_raster_fini(&raster);
    weft_free(path);
    return status;
}

/* What does not vary has no picture in any format. */
static json_t *describe_constants(const weft_baked *baked)
{
    json_t *const constants = json_object();
    for (int k = 0; k < WEFT_BAKED_COUNT; k++) {
        double values[4];
        for (int p = 0; p < 4; p++)
            values[p] = (double)baked->maps[k].constant[p];
        if (baked->maps[k].n_mips == 0)
            json_object_set_new(constants, weft_baked_rows[k].name,
                                weft_json_numbers(values, weft_baked_rows[k].planes));
    }
    return constants;
}

static json_t *describe(const weft_baked *baked, const char *folder)
{
    return json_pack("{s:s, s:s, s:s, s:s, s:o}", "material", baked->name, "folder", folder, "type",
                     baked->type->name, "brdf", weft_baked_brdf(baked), "constants",
                     describe_constants(baked));
}

static json_t *describe_channels(unsigned channels)
{
    json_t *const list = json_array();
    if (channels & WEFT_BLEND_ALBEDO)
        json_array_append_new(list, json_string("albedo"));
    if (channels & WEFT_BLEND_SPECULAR)
        json_array_append_new(list, json_string("specular"));
    if (channels & WEFT_BLEND_NORMAL)
        json_array_append_new(list, json_string("normal"));
    return list;
}

static weft_err write_description(const char *folder, const weft_runtime_layers *layers, weft_error *err)
{
    static const char *const masks[] = {"r", "g", "b", "a"};
    json_t *const list = json_array();
    for (int k = 0; k < layers->n; k++) {
        char shared[160];
        const weft_runtime_layer *const layer = &layers->layers[k];
        (void)snprintf(shared, sizeof shared, "shared/%s", layer->name);
        json_t *const entry = describe(&layer->baked, shared);
        json_object_set_new(entry, "mask", json_string(masks[k]));
        json_object_set_new(entry, "channels", describe_channels(layer->channels));
        json_object_set_new(entry, "normals", json_string(layer->reorient ? "reorient" : "slope"));
        json_array_append_new(list, entry);
    }
    json_t *const json =
        json_pack("{s:s, s:i, s:s, s:s, s:o, s:o}", "weft", "runtime-layers", "version", 1, "rule",
                  "from the first layer up P = P + mask (P_layer - P): colours and F0 linear, roughness as "
                  "alpha (the square "
                  "of glTF's), normals as slopes x/z, y/z or the layer's reoriented on those below; "
                  "quantities of channels "
                  "that are not named stay",
                  "masks", "masks.png", "base", describe(&layers->base, "base"), "layers", list);
    char *const path = weft_path_join(folder, "layers.json", err);
    const weft_err status = json && path ? weft_json_save(path, json, err) : WEFT_ERR_NOMEM;
    json_decref(json);
    weft_free(path);
    return status;
}

static weft_err write_material(const weft_exporter *exporter, const char *folder, const char *name,
                               const weft_baked *baked, weft_error *err)
{
    char *const inside = weft_path_join(folder, name, err);
    weft_err status = inside ? WEFT_OK : WEFT_ERR_NOMEM;
    if (status == WEFT_OK && !weft_folder_exists(inside)) { /* shared: once */
        const weft_export_job job = {baked, inside, json_array(), false};
        status = weft_folder_create(inside, err);
        if (status == WEFT_OK)
            status = exporter->write(&job, err);
        json_decref(job.lost); /* the main file's report says the same */
    }
    weft_free(inside);
    return status;
}

weft_err weft_export_runtime_layers(const weft_exporter *exporter, const weft_export_job *job,
                                    const weft_runtime_layers *layers, weft_error *err)
{
    char *const folder = weft_path_join(job->folder, "layers", err);
    weft_err status = folder ? weft_folder_create(folder, err) : WEFT_ERR_NOMEM;
    if (status == WEFT_OK)
        status = write_material(exporter, folder, "base", &layers->base, err);
    for (int k = 0; k < layers->n && status == WEFT_OK; k++) {
        char shared[160];
        (void)snprintf(shared, sizeof shared, "shared/%s", layers->layers[k].name);
        status = write_material(exporter, folder, shared, &layers->layers[k].baked, err);
    }
    if (status == WEFT_OK)
        status = write_masks(folder, layers, err);
    if (status == WEFT_OK)
        status = write_description(folder, layers, err);
    weft_free(folder);
    weft_export_lose(
        job,
        "run-time layers: %s has none; its own files are the flattened material, layers/ has the masks "
        "and the %d materials to blend",
        exporter->name, layers->n + 1);
    for (int k = 0; k < layers->n; k++)
        if (layers->layers[k].baked.type->model != layers->base.type->model)
            weft_export_lose(job,
                             "run-time layer '%s': is of another model than the base; an engine that blends "
                             "parameters shades the mix by one of them",
                             layers->layers[k].name);
    return status;
}
