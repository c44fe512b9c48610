/* The folders that exporters write beside the maps, each with its report. */
#include "shading/material/build_private.h"

#include "core/file.h"
#include "core/json.h"
#include "core/mem.h"
#include "shading/bake/material_file.h"
#include "shading/bake/toksvig.h"
#include "shading/export/export_layers.h"
#include "shading/material/build_key.h"

#include <stdio.h>
#include <stdlib.h>

static bool has_runtime_layers(const weft_builder *b)
{
    const weft_rad_member *const list = weft_rad_at(&b->asset->properties, "runtime_layers");
    return list && list->value->items;
}

static void key_export(const weft_builder *b, const weft_exporter *exporter, char hex[65])
{
    weft_build_key key = weft_build_key_begin(exporter->name, exporter->version);
    for (int k = 0; k < WEFT_BAKED_COUNT; k++) {
        const char *const had = json_string_value(json_object_get(b->keys, weft_baked_rows[k].name));
        weft_build_key_text(&key, weft_baked_rows[k].name, had ? had : "");
        for (int p = 0; p < weft_baked_rows[k].planes; p++)
            weft_build_key_number(&key, "constant", (double)b->baked.maps[k].constant[p]);
    }
    const char *path;
    json_t *input;
    if (weft_rad_at(&b->asset->properties, "u3m")) /* what of it no map holds is exported too */
        json_object_foreach(b->inputs, path, input)
            weft_build_key_text(&key, path, json_string_value(json_object_get(input, "sha256")));
    if (has_runtime_layers(b)) /* what a mask hides in the flattened maps is exported too */
        weft_build_key_text(&key, "runtime layers", b->composite_key);
    char *const properties = json_dumps(b->properties, JSON_SORT_KEYS | JSON_COMPACT);
    weft_build_key_text(&key, "properties", properties ? properties : ""); /* the report tells them */
    free(properties);
    weft_build_key_number(&key, "periodic", b->baked.periodic);
    weft_build_key_text(&key, "name", b->baked.name);
    weft_build_key_text(&key, "type", b->baked.type->name);
    weft_build_key_number(&key, "width_mm", b->baked.size_mm[0]);
    weft_build_key_number(&key, "height_mm", b->baked.size_mm[1]);
    weft_build_key_number(&key, "thickness_mm", b->baked.thickness_mm);
    weft_build_key_number(&key, "weight_gsm", b->baked.weight_gsm);
    weft_build_key_end(&key, hex);
}

/* Average Toksvig gloss of every level (S-FC3-15): for engines that take one number a level. */
static json_t *average_glosses(const weft_baked *whole)
{
    double gloss[WEFT_BAKED_MAX_MIPS] = {0};
    const int n = whole->maps[WEFT_BAKED_NORMAL_LENGTH].n_mips;
    for (int level = 0; level < n; level++)
        gloss[level] = weft_toksvig_average_gloss(whole, level);
    return weft_json_numbers(gloss, n);
}

/* @param layers  n is 0: there are none */
static weft_err export_one(weft_builder *b, const weft_exporter *exporter, const weft_baked *whole,
                           const weft_runtime_layers *layers, weft_error *err)
{
    char *const folder = weft_path_join(b->options->folder, exporter->name, err);
    weft_atomic a = {0};
    if (!folder)
        return WEFT_ERR_NOMEM;
    weft_err status = weft_atomic_folder_begin(&a, folder, true, err);
    if (status == WEFT_OK) {
        const weft_export_job job = {whole, a.temp_path, json_array(), layers->n > 0};
        status = exporter->write(&job, err);
        if (status == WEFT_OK && layers->n > 0)
            status = weft_export_runtime_layers(exporter, &job, layers, err);
        char *const lost = weft_path_join(a.temp_path, "report.json", err);
        json_t *const report = json_pack(
            "{s:s, s:s, s:o, s:o, s:o, s:O, s:O}", "exporter", exporter->name, "material", whole->name,
            "size_mm", weft_json_numbers(whole->size_mm, 2), "average_toksvig_gloss", average_glosses(whole),
            "cannot_carry", job.lost, "inputs", b->inputs, "properties", b->properties);
        if (status == WEFT_OK)
            status = lost && report ? weft_json_save(lost, report, err) : WEFT_ERR_NOMEM;
        json_decref(report);
        weft_free(lost);
        if (status == WEFT_OK)
            status = weft_atomic_commit(&a, err);
        else
            weft_atomic_abort(&a);
    }
    weft_free(folder);
    return status == WEFT_OK ? WEFT_OK : weft_prefix(err, status, "export %s", exporter->name);
}

/* Base and layers with mips of their own: an engine filters each by itself. */
static weft_err make_runtime_layers(weft_builder *b, weft_runtime_layers *layers, weft_error *err)
{
    if (!has_runtime_layers(b))
        return WEFT_OK;
    WEFT_TRY(weft_composite_runtime(b->assets, b->asset, &b->options->composite, layers, err));
    weft_err status = weft_mips_make(&layers->base, &b->options->mips, err);
    for (int k = 0; k < layers->n && status == WEFT_OK; k++)
        status = weft_mips_make(&layers->layers[k].baked, &b->options->mips, err);
    return status;
}

weft_err weft_builder_make_exports(weft_builder *b, weft_error *err)
{
    weft_baked whole = {0};
    weft_runtime_layers layers = {0};
    weft_err status = WEFT_OK;
    for (const weft_exporter *const *e = b->options->exporters; e && *e && status == WEFT_OK; e++) {
        char hex[65], step[80];
        char *const folder = weft_path_join(b->options->folder, (*e)->name, err);
        (void)snprintf(step, sizeof step, "export %s", (*e)->name);
        key_export(b, *e, hex);
        const bool current = folder && weft_folder_exists(folder) && weft_builder_is_current(b, step, hex);
        weft_free(folder);
        weft_builder_note(b, step, current ? "kept" : "rebuilt",
                          current ? "all that it writes is as it was"
                                  : "a map, a property or the exporter changed");
        *(current ? &b->result->kept : &b->result->rebuilt) += 1;
        if (current)
            continue;
        if (!whole.type) {
            status = weft_material_load(b->options->folder, &whole, err);
            if (status == WEFT_OK)
                status = weft_composite_u3m(b->asset, &whole.u3m, err);
            if (status == WEFT_OK)
                status = make_runtime_layers(b, &layers, err);
        }
        if (status == WEFT_OK)
            status = weft_builder_begin(b, (const char *const[]){step, NULL}, err);
        if (status == WEFT_OK)
            status = export_one(b, *e, &whole, &layers, err);
        if (status == WEFT_OK)
            status = weft_builder_finish(b, step, hex, err);
    }
    weft_runtime_layers_fini(&layers);
    weft_baked_fini(&whole);
    return status;
}
