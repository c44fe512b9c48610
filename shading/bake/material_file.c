#include "shading/bake/material_file.h"

#include "core/file.h"
#include "core/formats/exr_file.h"
#include "core/json.h"
#include "core/mem.h"

#include <string.h>

static char *map_path(const char *folder, weft_baked_kind kind, weft_error *err)
{
    return weft_asprintf(err, "%s/%s.exr", folder, weft_baked_rows[kind].name);
}

weft_err weft_material_save_map(const char *folder, const weft_baked *baked, weft_baked_kind kind,
                                weft_error *err)
{
    char *const path = map_path(folder, kind, err);
    if (!path)
        return WEFT_ERR_NOMEM;
    const weft_baked_map *const map = &baked->maps[kind];
    const weft_exr_type type = kind == WEFT_BAKED_HEIGHT ? WEFT_EXR_FLOAT : WEFT_EXR_HALF;
    const weft_err status =
        weft_exr_write_mips(path, map->mips, map->n_mips, weft_baked_rows[kind].channels, type, err);
    weft_free(path);
    return status;
}

static json_t *describe_map(const weft_baked *baked, weft_baked_kind kind)
{
    const weft_baked_map *const map = &baked->maps[kind];
    double constant[4];
    for (int p = 0; p < 4; p++)
        constant[p] = (double)map->constant[p];
    json_t *const entry = json_pack("{s:i, s:o, s:s}", "mips", map->n_mips, "constant",
                                    weft_json_numbers(constant, weft_baked_rows[kind].planes), "unit",
                                    weft_baked_rows[kind].unit);
    if (entry && map->n_mips > 0)
        json_object_set_new(entry, "file", json_sprintf("%s.exr", weft_baked_rows[kind].name));
    return entry;
}

json_t *weft_material_describe(const weft_baked *baked)
{
    json_t *const maps = json_object();
    for (int k = 0; k < WEFT_BAKED_COUNT; k++)
        json_object_set_new(maps, weft_baked_rows[k].name, describe_map(baked, (weft_baked_kind)k));
    return json_pack("{s:s, s:i, s:s, s:s, s:s, s:i, s:i, s:o, s:b, s:b, s:b, s:b, s:f, s:f, s:o}", "weft",
                     "material", "version", WEFT_MATERIAL_VERSION, "name", baked->name, "type",
                     baked->type->name, "brdf", weft_baked_brdf(baked), "width", baked->width, "height",
                     baked->height, "size_mm", weft_json_numbers(baked->size_mm, 2), "periodic",
                     baked->periodic, "enable_diffuse", baked->enable_diffuse, "enable_specular",
                     baked->enable_specular, "two_lobes", baked->two_lobes, "thickness_mm",
                     baked->thickness_mm, "weight_gsm", baked->weight_gsm, "maps", maps);
}

static weft_err read_map_head(const json_t *maps, weft_baked *baked, weft_baked_kind kind, const char *place,
                              weft_error *err)
{
    const weft_baked_row *const row = &weft_baked_rows[kind];
    const json_t *entry;
    double constant[4] = {0};
    WEFT_TRY(weft_json_get_object(maps, row->name, WEFT_JSON_OPTIONAL, &entry, place, err));
    if (!entry)
        return WEFT_OK;
    WEFT_TRY(weft_json_get_int(entry, "mips", WEFT_JSON_REQUIRED, 0, WEFT_BAKED_MAX_MIPS,
                               &baked->maps[kind].n_mips, place, err));
    WEFT_TRY(weft_json_get_numbers(entry, "constant", WEFT_JSON_REQUIRED, row->planes, constant, place, err));
    for (int p = 0; p < row->planes; p++)
        baked->maps[kind].constant[p] = (float)constant[p];
    return WEFT_OK;
}

/* Of a side of a cloth. */
#define SMALLEST_MM 1e-3
#define LARGEST_MM  1e6

static weft_err read_head(const json_t *json, const char *place, weft_baked *baked, weft_error *err)
{
    const char *name, *type;
    const json_t *maps;
    int width = 0, height = 0;
    WEFT_TRY(weft_json_get_text(json, "name", WEFT_JSON_REQUIRED, &name, place, err));
    WEFT_TRY(weft_json_get_text(json, "type", WEFT_JSON_REQUIRED, &type, place, err));
    const weft_material_type *const known = weft_material_type_find(type);
    if (!known)
        return weft_fail(err, WEFT_ERR_FORMAT, "%s: \"%s\" is no type of material", place, type);
    WEFT_TRY(
        weft_json_get_int(json, "width", WEFT_JSON_REQUIRED, 0, WEFT_IMAGE_MAX_SIDE, &width, place, err));
    WEFT_TRY(
        weft_json_get_int(json, "height", WEFT_JSON_REQUIRED, 0, WEFT_IMAGE_MAX_SIDE, &height, place, err));
    WEFT_TRY(weft_json_get_object(json, "maps", WEFT_JSON_REQUIRED, &maps, place, err));
    WEFT_TRY(weft_baked_init(baked, name, known, err));
    baked->width = width;
    baked->height = height;
    WEFT_TRY(weft_json_get_numbers(json, "size_mm", WEFT_JSON_REQUIRED, 2, baked->size_mm, place, err));
    for (int i = 0; i < 2; i++) { /* 0: not known */
        const double size = baked->size_mm[i];
        if (size != 0 && !(size >= SMALLEST_MM && size <= LARGEST_MM))
            return weft_fail(err, WEFT_ERR_RANGE, "%s: \"size_mm\" has %g, wanted %g to %g; bake it again",
                             place, size, SMALLEST_MM, LARGEST_MM);
    }
    WEFT_TRY(weft_json_get_bool(json, "periodic", WEFT_JSON_OPTIONAL, &baked->periodic, place, err));
    WEFT_TRY(
        weft_json_get_bool(json, "enable_diffuse", WEFT_JSON_OPTIONAL, &baked->enable_diffuse, place, err));
    WEFT_TRY(
        weft_json_get_bool(json, "enable_specular", WEFT_JSON_OPTIONAL, &baked->enable_specular, place, err));
    WEFT_TRY(weft_json_get_bool(json, "two_lobes", WEFT_JSON_OPTIONAL, &baked->two_lobes, place, err));
    WEFT_TRY(weft_json_get_number(json, "thickness_mm", WEFT_JSON_OPTIONAL, 0, 100, &baked->thickness_mm,
                                  place, err));
    WEFT_TRY(
        weft_json_get_number(json, "weight_gsm", WEFT_JSON_OPTIONAL, 0, 1e4, &baked->weight_gsm, place, err));
    for (int k = 0; k < WEFT_BAKED_COUNT; k++)
        WEFT_TRY(read_map_head(maps, baked, (weft_baked_kind)k, place, err));
    return WEFT_OK;
}

weft_err weft_material_load_head(const char *folder, weft_baked *baked, json_t **state, weft_error *err)
{
    char *const path = weft_path_join(folder, "material.json", err);
    json_t *json = NULL;
    *baked = (weft_baked){0};
    if (!path)
        return WEFT_ERR_NOMEM;
    weft_err status = weft_json_load_kind(path, "material", WEFT_MATERIAL_VERSION, &json, err);
    if (status == WEFT_OK)
        status = read_head(json, path, baked, err);
    if (status != WEFT_OK)
        weft_baked_fini(baked);
    if (status == WEFT_OK && state)
        *state = json;
    else
        json_decref(json);
    weft_free(path);
    return status;
}

weft_err weft_material_load_map(const char *folder, weft_baked *baked, weft_baked_kind kind, weft_error *err)
{
    weft_baked_map *const map = &baked->maps[kind];
    char *const path = map_path(folder, kind, err);
    if (!path)
        return WEFT_ERR_NOMEM;
    weft_err status = WEFT_OK;
    for (int level = 0; level < map->n_mips && status == WEFT_OK; level++) {
        const int w = baked->width >> level, h = baked->height >> level;
        weft_image_fini(&map->mips[level]);
        status = weft_exr_read_level(path, weft_baked_rows[kind].channels, weft_baked_rows[kind].planes,
                                     level, &map->mips[level], err);
        if (status == WEFT_OK &&
            (map->mips[level].width != (w > 0 ? w : 1) || map->mips[level].height != (h > 0 ? h : 1)))
            status = weft_fail(err, WEFT_ERR_MISMATCH,
                               "%s: has another size than material.json says; bake it again", path);
    }
    weft_free(path);
    return status;
}

weft_err weft_material_load(const char *folder, weft_baked *baked, weft_error *err)
{
    WEFT_TRY(weft_material_load_head(folder, baked, NULL, err));
    for (int k = 0; k < WEFT_BAKED_COUNT; k++) {
        const weft_err status = weft_material_load_map(folder, baked, (weft_baked_kind)k, err);
        if (status != WEFT_OK) {
            weft_baked_fini(baked);
            return status;
        }
    }
    return WEFT_OK;
}
