#include "shading/material/asset.h"

#include "core/fields.h"
#include "core/file.h"
#include "core/mem.h"
#include "core/text.h"
#include "shading/material/asset_check.h"
#include "shading/material/asset_merge.h"

#include <stdint.h>
#include <stdlib.h>
#include <string.h>

enum { MAX_FILE_BYTES = 16 << 20, MAX_FILES = 1000, MAX_CHAIN = 64 };

typedef enum entry_state { ENTRY_NEW, ENTRY_OPEN, ENTRY_DONE, ENTRY_BROKEN } entry_state;

/* A material on its way from text to asset. */
typedef struct entry {
    weft_asset asset;
    weft_rad_item *item;
    entry_state state;
    struct entry *next;
} entry;

typedef struct file_entry {
    weft_source source;
    char *id; /* real path: a file is read once however it is named */
    weft_rad_file *tree;
    struct file_entry *next;
} file_entry;

struct weft_assets {
    weft_arena arena;
    weft_diagnostics diagnostics;
    const char *library;
    file_entry *files, *last_file;
    int n_files;
    entry *entries, *last_entry; /* as they were read, built-in types first */
    entry **sorted;              /* [n_entries] by name, built-in types among them */
    int n_entries;
};

/* -- reading ------------------------------------------------------------------------------------------ */

static weft_err read_text(weft_assets *a, file_entry *file, weft_error *err)
{
    char *bytes;
    size_t n;
    WEFT_TRY(weft_file_read(file->source.path, MAX_FILE_BYTES, &bytes, &n, err));
    weft_err status = WEFT_OK;
    if (!weft_text_is_utf8(bytes, n))
        status =
            weft_fail(err, WEFT_ERR_FORMAT, "%s: is not UTF-8 text; save it as UTF-8", file->source.path);
    else if (!(file->source.text = weft_arena_text(&a->arena, bytes, n, err)))
        status = WEFT_ERR_NOMEM;
    file->source.n = n;
    weft_free(bytes);
    return status;
}

static file_entry *find_file(const weft_assets *a, const char *id)
{
    for (file_entry *f = a->files; f; f = f->next)
        if (strcmp(f->id, id) == 0)
            return f;
    return NULL;
}

/* Reads a file once and puts it at the end of the list; its own includes are read later, in turn. */
static weft_err add_file(weft_assets *a, const char *path, weft_error *err)
{
    char *const real = realpath(path, NULL);
    if (!real)
        return weft_fail_errno(err, WEFT_ERR_IO, "%s: cannot be opened", path);
    weft_err status = WEFT_OK;
    file_entry *const file = weft_arena_alloc(&a->arena, sizeof *file, err);
    if (find_file(a, real)) /* included twice, or in a circle: once is enough */
        goto out;
    if (a->n_files >= MAX_FILES) {
        status = weft_fail(err, WEFT_ERR_FORMAT, "%s: more than %d files are included", path, MAX_FILES);
        goto out;
    }
    status = WEFT_ERR_NOMEM;
    if (!file || !(file->id = weft_arena_text(&a->arena, real, strlen(real), err)) ||
        !(file->source.path = weft_arena_text(&a->arena, path, strlen(path), err)))
        goto out;
    status = read_text(a, file, err);
    if (status != WEFT_OK)
        goto out;
    *(a->last_file ? &a->last_file->next : &a->files) = file;
    a->last_file = file;
    a->n_files++;
    file->tree = weft_rad_parse(&file->source, &a->arena, &a->diagnostics);
out:
    free(real);
    return status;
}

static void include(weft_assets *a, const file_entry *file, const weft_rad_item *item)
{
    weft_error why = {0};
    char *folder = NULL, *path = NULL;
    if (item->from_library && !a->library) {
        weft_diagnose(&a->diagnostics, WEFT_SEVERITY_ERROR, item->place,
                      "there is no library folder; give --library");
        return;
    }
    if (!item->from_library)
        folder = weft_path_folder(file->source.path, &why);
    path = weft_path_join(item->from_library ? a->library : folder, item->name, &why);
    if (!path || add_file(a, path, &why) != WEFT_OK)
        weft_diagnose(&a->diagnostics, WEFT_SEVERITY_ERROR, item->place, "%s", why.text);
    weft_free(folder);
    weft_free(path);
}

static weft_err read_files(weft_assets *a, const char *path, weft_error *err)
{
    WEFT_TRY(add_file(a, path, err));
    for (const file_entry *file = a->files; file; file = file->next)
        for (const weft_rad_item *item = file->tree ? file->tree->items : NULL; item; item = item->next)
            if (item->is_include)
                include(a, file, item);
    return WEFT_OK;
}

/* -- names -------------------------------------------------------------------------------------------- */

static int by_name(const void *a, const void *b)
{
    return strcmp((*(entry *const *)a)->asset.name, (*(entry *const *)b)->asset.name);
}

static entry *find_entry(const weft_assets *a, const char *name)
{
    int low = 0, high = a->n_entries;
    while (low < high) {
        const int middle = (low + high) / 2;
        const int order = strcmp(a->sorted[middle]->asset.name, name);
        if (order == 0)
            return a->sorted[middle];
        *(order < 0 ? &low : &high) = order < 0 ? middle + 1 : middle;
    }
    return NULL;
}

static const char *nearest_name(const weft_assets *a, const char *name)
{
    const char *nearest = NULL;
    int least = 2 + (int)strlen(name) / 4;
    for (int i = 0; i < a->n_entries; i++) {
        const int distance = weft_text_distance(a->sorted[i]->asset.name, name);
        if (distance > 0 && distance < least) {
            least = distance;
            nearest = a->sorted[i]->asset.name;
        }
    }
    return nearest;
}

static weft_err add_entry(weft_assets *a, weft_rad_item *item, const weft_material_type *type,
                          weft_error *err)
{
    entry *const one = weft_arena_alloc(&a->arena, sizeof *one, err);
    if (!one)
        return WEFT_ERR_NOMEM;
    *one = (entry){.asset = {.name = item->name, .place = item->place, .type = type}, .item = item};
    *(a->last_entry ? &a->last_entry->next : &a->entries) = one;
    a->last_entry = one;
    a->n_entries++;
    return WEFT_OK;
}

/* The defaults of a type, as a text in the language itself: one parser and one set of checks for all. */
static weft_err add_type(weft_assets *a, const weft_material_type *type, weft_error *err)
{
    weft_source *const source = weft_arena_alloc(&a->arena, sizeof *source, err);
    char *text = weft_arena_printf(&a->arena, err, ":%s := ( builtin", type->name);
    for (const weft_property *p = weft_material_properties; text && p->name; p++)
        if (p->def && (!p->models || (p->models & type->model)))
            text = weft_arena_printf(&a->arena, err, "%s\n    :%s = %s", text, p->name, p->def);
    text = text ? weft_arena_printf(&a->arena, err, "%s\n)\n", text) : NULL;
    if (!source || !text)
        return WEFT_ERR_NOMEM;
    *source = (weft_source){.path = "built-in", .text = text, .n = strlen(text)};
    const weft_rad_file *const tree = weft_rad_parse(source, &a->arena, &a->diagnostics);
    return tree ? add_entry(a, tree->items, type, err) : WEFT_ERR_NOMEM;
}

static void diagnose_duplicates(weft_assets *a)
{
    for (int i = 1; i < a->n_entries; i++) {
        const entry *const one = a->sorted[i - 1], *const two = a->sorted[i];
        if (strcmp(one->asset.name, two->asset.name) != 0)
            continue;
        const bool second_later = one->asset.type || two->asset.place.source != one->asset.place.source ||
                                  two->asset.place.begin > one->asset.place.begin;
        const entry *const blamed = two->asset.type || !second_later ? one : two;
        const entry *const other = blamed == one ? two : one;
        int line, column;
        weft_place_position(other->asset.place, &line, &column);
        weft_diagnose(&a->diagnostics, WEFT_SEVERITY_ERROR, blamed->asset.place,
                      "'%s' is also defined in %s:%d; rename one", blamed->asset.name,
                      other->asset.place.source->path, line);
    }
}

static weft_err index_names(weft_assets *a, weft_error *err)
{
    for (const weft_material_type *type = weft_material_types; type->name; type++)
        WEFT_TRY(add_type(a, type, err));
    for (const file_entry *file = a->files; file; file = file->next)
        for (weft_rad_item *item = file->tree ? file->tree->items : NULL; item; item = item->next)
            if (!item->is_include)
                WEFT_TRY(add_entry(a, item, NULL, err));
    a->sorted = weft_arena_alloc(&a->arena, (size_t)a->n_entries * sizeof(entry *), err);
    if (!a->sorted)
        return WEFT_ERR_NOMEM;
    int n = 0;
    for (entry *one = a->entries; one; one = one->next)
        a->sorted[n++] = one;
    qsort(a->sorted, (size_t)n, sizeof(entry *), by_name);
    diagnose_duplicates(a);
    return WEFT_OK;
}

/* -- inheritance -------------------------------------------------------------------------------------- */

static void diagnose_missing(weft_assets *a, weft_place place, const char *name)
{
    const char *const near = nearest_name(a, name);
    weft_diagnose(&a->diagnostics, WEFT_SEVERITY_ERROR, place, "there is no material '%s'%s%s%s", name,
                  near ? "; did you mean '" : "", near ? near : "", near ? "'?" : "");
}

/* "a derives from b, which derives from a" */
static void diagnose_cycle(weft_assets *a, entry *start)
{
    const char *chain = start->asset.name;
    const entry *one = start;
    do {
        one = find_entry(a, one->item->record.base);
        chain = one ? weft_arena_printf(&a->arena, NULL, "%s -> %s", chain, one->asset.name) : NULL;
    } while (one && chain && one != start);
    weft_diagnose(&a->diagnostics, WEFT_SEVERITY_ERROR, start->item->record.base_place,
                  "materials derive from each other in a circle: %s", chain ? chain : start->asset.name);
}

static bool resolve_type(weft_assets *a, entry *one)
{
    const weft_property *const tables[2] = {weft_material_properties, NULL};
    weft_asset_check(&one->item->record, tables, one->asset.type->model, one->asset.name, &a->arena,
                     &a->diagnostics);
    one->asset.properties = one->item->record;
    one->asset.properties.base = NULL;
    return true;
}

static bool resolve(weft_assets *a, entry *one, int depth);

static bool resolve_derived(weft_assets *a, entry *one, int depth)
{
    weft_rad_record *const own = &one->item->record;
    entry *const base = find_entry(a, own->base);
    if (!base) {
        diagnose_missing(a, own->base_place, own->base);
        return false;
    }
    if (base->state == ENTRY_OPEN) {
        diagnose_cycle(a, base);
        return false;
    }
    if (depth > MAX_CHAIN) {
        weft_diagnose(&a->diagnostics, WEFT_SEVERITY_ERROR, own->base_place,
                      "more than %d materials derive in a row", MAX_CHAIN);
        return false;
    }
    if (!resolve(a, base, depth + 1))
        return false; /* has been said where it is */
    one->asset.base = &base->asset;
    one->asset.type = base->asset.type;
    const weft_property *const tables[2] = {weft_material_properties, NULL};
    const int n_errors = a->diagnostics.n_errors;
    weft_asset_check(own, tables, one->asset.type->model, one->asset.name, &a->arena, &a->diagnostics);
    if (a->diagnostics.n_errors == n_errors)
        weft_rad_merge(&base->asset.properties, own, &one->asset.properties, &a->arena, &a->diagnostics);
    one->asset.properties.base = NULL;
    return a->diagnostics.n_errors == n_errors;
}

static bool resolve(weft_assets *a, entry *one, int depth)
{
    if (one->state == ENTRY_NEW) {
        one->state = ENTRY_OPEN;
        const bool good = one->asset.type ? resolve_type(a, one) : resolve_derived(a, one, depth);
        one->state = good ? ENTRY_DONE : ENTRY_BROKEN;
    }
    return one->state == ENTRY_DONE;
}

/* Layers name materials too: each must be there, and none may lie in itself. */
static bool uses(const weft_assets *a, const entry *one, const entry *target, int depth);

static bool layers_use(const weft_assets *a, const weft_rad_record *record, const entry *target, int depth)
{
    static const char *const lists[] = {"layers", "runtime_layers"};
    for (int k = 0; k < 2; k++) {
        const weft_rad_member *const m = weft_rad_find(record, lists[k]);
        for (const weft_rad_value *item = m ? m->value->items : NULL; item; item = item->next) {
            const entry *const layer = item->record.base ? find_entry(a, item->record.base) : NULL;
            if (layer && (layer == target || uses(a, layer, target, depth + 1)))
                return true;
        }
    }
    return false;
}

static bool uses(const weft_assets *a, const entry *one, const entry *target, int depth)
{
    return depth < MAX_CHAIN && one->state == ENTRY_DONE &&
           layers_use(a, &one->asset.properties, target, depth);
}

static void check_layers(weft_assets *a, const entry *one, const char *list)
{
    const weft_rad_member *const m = weft_rad_find(&one->asset.properties, list);
    int n = 0;
    for (const weft_rad_value *item = m ? m->value->items : NULL; item; item = item->next, n++) {
        const entry *const layer = item->record.base ? find_entry(a, item->record.base) : NULL;
        if (item->record.base && !layer)
            diagnose_missing(a, item->record.base_place, item->record.base);
        else if (layer && (layer == one || uses(a, layer, one, 0)))
            weft_diagnose(&a->diagnostics, WEFT_SEVERITY_ERROR, item->record.base_place,
                          "'%s' would lie in itself: '%s' is made of it", one->asset.name, item->record.base);
    }
    if (n > 4 && strcmp(list, "runtime_layers") == 0)
        weft_diagnose(&a->diagnostics, WEFT_SEVERITY_ERROR, m->place,
                      "at most 4 layers are blended at run time, not %d", n);
}

static void resolve_all(weft_assets *a)
{
    for (entry *one = a->entries; one; one = one->next)
        resolve(a, one, 0);
    for (const entry *one = a->entries; one; one = one->next)
        if (one->state == ENTRY_DONE) {
            check_layers(a, one, "layers");
            check_layers(a, one, "runtime_layers");
        }
}

static weft_err take_text(weft_assets *a, const char *path, const char *text, weft_error *err)
{
    file_entry *const file = weft_arena_alloc(&a->arena, sizeof *file, err);
    if (!file || !(file->source.path = weft_arena_text(&a->arena, path, strlen(path), err)) ||
        !(file->source.text = weft_arena_text(&a->arena, text, strlen(text), err)))
        return WEFT_ERR_NOMEM;
    file->source.n = strlen(text);
    file->id = (char *)(uintptr_t)file->source.path;
    a->files = a->last_file = file;
    a->n_files = 1;
    file->tree = weft_rad_parse(&file->source, &a->arena, &a->diagnostics);
    return WEFT_OK;
}

/* @param text  NULL: the file's */
static weft_err load(const char *path, const char *text, const char *library, weft_assets **assets,
                     weft_error *err)
{
    *assets = NULL;
    weft_assets *const a = weft_alloc(1, sizeof *a, err);
    if (!a)
        return WEFT_ERR_NOMEM;
    a->diagnostics.arena = &a->arena;
    a->library = library;
    weft_err status = text ? take_text(a, path, text, err) : read_files(a, path, err);
    if (status == WEFT_OK)
        status = index_names(a, err);
    if (status != WEFT_OK) {
        weft_assets_destroy(a);
        return status;
    }
    resolve_all(a);
    *assets = a;
    return weft_diagnostics_status(&a->diagnostics, err);
}

weft_err weft_assets_load(const char *path, const char *library, weft_assets **assets, weft_error *err)
{
    return load(path, NULL, library, assets, err);
}

weft_err weft_assets_load_text(const char *path, const char *text, weft_assets **assets, weft_error *err)
{
    return load(path, text, NULL, assets, err);
}

/* -- asking ------------------------------------------------------------------------------------------- */

void weft_assets_destroy(weft_assets *assets)
{
    if (!assets)
        return;
    weft_arena_fini(&assets->arena);
    weft_free(assets);
}

const weft_diagnostics *weft_assets_diagnostics(const weft_assets *assets)
{
    return &assets->diagnostics;
}

const char *weft_assets_path(const weft_assets *assets, int index)
{
    const file_entry *file = assets->files;
    while (file && index-- > 0)
        file = file->next;
    return file ? file->source.path : NULL;
}

const weft_asset *weft_assets_get(const weft_assets *assets, int index)
{
    for (int i = 0; i < assets->n_entries; i++)
        if (assets->sorted[i]->asset.base && index-- == 0)
            return &assets->sorted[i]->asset;
    return NULL;
}

weft_err weft_assets_find(const weft_assets *assets, const char *name, const weft_asset **asset,
                          weft_error *err)
{
    const entry *const one = find_entry(assets, name);
    if (one && one->state == ENTRY_DONE) {
        *asset = &one->asset;
        return WEFT_OK;
    }
    const char *const near = nearest_name(assets, name);
    return weft_fail(err, WEFT_ERR_MISSING, "%s: there is no material '%s'%s%s%s",
                     weft_assets_path(assets, 0), name, near ? "; did you mean '" : "", near ? near : "",
                     near ? "'?" : "");
}

const weft_asset *weft_assets_main(const weft_assets *assets)
{
    const entry *last = NULL;
    for (const weft_rad_item *item = assets->files->tree ? assets->files->tree->items : NULL; item;
         item = item->next)
        if (!item->is_include)
            last = find_entry(assets, item->name);
    return last && last->state == ENTRY_DONE ? &last->asset : NULL;
}

weft_err weft_assets_layer(weft_assets *assets, const weft_rad_record *record, weft_asset *layer,
                           weft_error *err)
{
    const weft_asset *base;
    WEFT_TRY(weft_assets_find(assets, record->base, &base, err));
    *layer = *base;
    layer->base = base;
    weft_rad_record own = *record;
    own.base = NULL;
    weft_rad_merge(&base->properties, &own, &layer->properties, &assets->arena, &assets->diagnostics);
    return weft_diagnostics_status(&assets->diagnostics, err);
}
