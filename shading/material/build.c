#include "shading/material/build_private.h"

#include "core/file.h"
#include "core/mem.h"
#include "shading/bake/material_file.h"
#include "shading/material/build_key.h"

#include <dirent.h>
#include <stdlib.h>
#include <string.h>

enum { COMPOSITE_VERSION = 4 }; /* raised when the code changes what it makes */

typedef struct input_hash {
    weft_builder *b;
    weft_build_key *key;
    json_t *seen; /* the inputs of this build alone */
    weft_err status;
    weft_error *err;
} input_hash;

static void hash_file(input_hash *h, const char *path)
{
    char hex[65];
    if (h->status == WEFT_OK)
        h->status = weft_build_key_file(path, h->b->inputs, hex, h->err);
    if (h->status != WEFT_OK)
        return;
    weft_build_key_text(h->key, path, hex);
    json_object_set(h->seen, path, json_object_get(h->b->inputs, path));
}

static int is_visible(const struct dirent *entry)
{
    return entry->d_name[0] != '.';
}

/* albedo.png beside albedo.exr is for looking at; mask.png says where the scan has an answer. */
static bool is_for_looking(const char *file)
{
    if (!weft_path_has_suffix(file, ".png"))
        return false;
    char *const twin = weft_asprintf(NULL, "%.*s.exr", (int)strlen(file) - 4, file);
    const bool has_twin = twin && weft_file_exists(twin);
    weft_free(twin);
    return has_twin;
}

/* A scan is the files of its folder. */
static void hash_input(void *context, const char *path, bool is_scan)
{
    input_hash *const h = context;
    struct dirent **names = NULL;
    if (!is_scan) {
        hash_file(h, path);
        return;
    }
    const int n = scandir(path, &names, is_visible, alphasort);
    if (n < 0 && h->status == WEFT_OK)
        h->status = weft_fail_errno(h->err, WEFT_ERR_IO, "%s: this scan cannot be read", path);
    for (int i = 0; i < n; i++) {
        char *const file = weft_path_join(path, names[i]->d_name, h->err);
        if (file && weft_file_exists(file) && !is_for_looking(file))
            hash_file(h, file);
        weft_free(file);
        free(names[i]);
    }
    free(names);
}

static weft_err key_composite(weft_builder *b, weft_error *err)
{
    const weft_build_options *const o = b->options;
    weft_build_key key = weft_build_key_begin("composite", COMPOSITE_VERSION);
    b->properties = weft_build_properties(b->assets, b->asset, err);
    if (!b->properties)
        return weft_fail(err, WEFT_ERR_NOMEM, "out of memory");
    char *const text = json_dumps(b->properties, JSON_SORT_KEYS | JSON_COMPACT);
    weft_build_key_text(&key, "properties", text ? text : "");
    free(text);
    weft_build_key_number(&key, "width", o->composite.width);
    weft_build_key_number(&key, "height", o->composite.height);
    weft_build_key_number(&key, "periodic", o->composite.periodic);
    input_hash h = {b, &key, json_object(), WEFT_OK, err};
    const weft_err status = weft_composite_inputs(b->assets, b->asset, hash_input, &h, err);
    json_decref(b->inputs);
    b->inputs = h.seen;
    weft_build_key_end(&key, b->composite_key);
    return status == WEFT_OK ? h.status : status;
}

static void hash_texels(weft_builder *b, weft_baked_kind kind)
{
    const weft_baked_map *const map = &b->baked.maps[kind];
    static const weft_image none = {0};
    weft_build_key_image(map->n_mips > 0 ? &map->mips[0] : &none, map->constant, weft_baked_rows[kind].planes,
                         b->texels[kind]);
}

static weft_err make_maps(weft_builder *b, weft_error *err)
{
    char why[1400];
    weft_builder_explain_change(b, why, sizeof why);
    weft_builder_note(b, "composite", "rebuilt", why);
    WEFT_TRY(weft_composite(b->assets, b->asset, &b->options->composite, &b->baked, err));
    WEFT_TRY(weft_folder_create(b->options->folder, err));
    for (int k = 0; k < WEFT_BAKED_COUNT; k++)
        hash_texels(b, (weft_baked_kind)k);
    WEFT_TRY(weft_builder_make_height(b, err));
    WEFT_TRY(weft_builder_make_relief(b, err));
    WEFT_TRY(weft_builder_make_detail(b, err));
    hash_texels(b, WEFT_BAKED_DETAIL_ALBEDO);
    hash_texels(b, WEFT_BAKED_DETAIL_NORMAL);
    WEFT_TRY(weft_builder_write_maps(b, err));
    weft_builder_remove_leftovers(b);
    return weft_builder_finish(b, "composite", b->composite_key, err);
}

/* Everything on disk is what the key stands for: nothing is read but the head. */
static bool keep_maps(weft_builder *b)
{
    if (!b->old || !weft_builder_is_current(b, "composite", b->composite_key))
        return false;
    if (weft_material_load_head(b->options->folder, &b->baked, NULL, NULL) != WEFT_OK)
        return false;
    for (int k = 0; k < WEFT_BAKED_COUNT; k++)
        if (b->baked.maps[k].n_mips > 0 && !weft_builder_file_is_there(b, (weft_baked_kind)k)) {
            weft_baked_fini(&b->baked);
            return false;
        }
    for (int k = 0; k < WEFT_BAKED_COUNT; k++)
        b->result->kept += b->baked.maps[k].n_mips > 0;
    weft_builder_note(b, "maps", "kept", "no property, picture or option that they depend on changed");
    return true;
}

static void key_options(weft_builder *b)
{
    weft_build_key key = weft_build_key_begin("maps", 1);
    weft_build_key_text(&key, "composite", b->composite_key);
    weft_build_key_number(&key, "reach", b->options->reach_mm);
    weft_build_key_number(&key, "detail", b->options->detail_mm);
    weft_build_key_number(&key, "rule", b->options->mips.rule);
    weft_build_key_number(&key, "coverage", b->options->mips.coverage_at);
    weft_build_key_end(&key, b->composite_key);
}

weft_err weft_build(weft_assets *assets, const weft_asset *asset, const weft_build_options *options,
                    weft_build_result *result, weft_error *err)
{
    weft_builder *const b = weft_alloc(1, sizeof *b, err);
    if (!b)
        return WEFT_ERR_NOMEM;
    *result = (weft_build_result){0};
    *b = (weft_builder){.assets = assets, .asset = asset, .options = options, .result = result};
    weft_err status = weft_builder_load(b, err);
    if (status == WEFT_OK)
        status = key_composite(b, err);
    key_options(b);
    if (status == WEFT_OK && !keep_maps(b))
        status = make_maps(b, err);
    if (status == WEFT_OK)
        status = weft_builder_make_exports(b, err);
    weft_baked_fini(&b->baked);
    json_decref(b->old);
    json_decref(b->keys);
    json_decref(b->inputs);
    json_decref(b->properties);
    weft_free(b);
    return status;
}
