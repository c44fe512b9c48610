#include "shading/material/build.h"

#include "core/file.h"
#include "core/formats/exr_file.h"
#include "core/json.h"
#include "core/mem.h"
#include "core/progress.h"
#include "shading/bake/height_poisson.h"
#include "shading/bake/material_file.h"
#include "shading/bake/relief.h"
#include "shading/bake/toksvig.h"
#include "shading/export/export_layers.h"
#include "shading/material/build_key.h"

#include <dirent.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Raised when the code of a step changes what it makes. */
enum { COMPOSITE_VERSION = 4, HEIGHT_VERSION = 1, RELIEF_VERSION = 1, DETAIL_VERSION = 1, FILE_VERSION = 1 };

enum { CAVITY_RADIUS_PX = 8 };

typedef struct builder {
    weft_assets *assets;
    const weft_asset *asset;
    const weft_build_options *options;
    weft_build_result *result;
    json_t *old;    /* material.json as it was; NULL: there is none */
    json_t *keys;   /* step: hex, of what stands on disk now; saved after each step */
    json_t *inputs; /* hashes of files */
    json_t *properties;
    weft_baked baked;
    char texels[WEFT_BAKED_COUNT][65]; /* hashes of level 0 or of the constants */
    char composite_key[65];
} builder;

static void note(const builder *b, const char *step, const char *what, const char *why)
{
    if (b->options->note)
        b->options->note(b->options->context, step, what, why);
}

static bool is_current(const builder *b, const char *step, const char key[65])
{
    const char *const had = json_string_value(json_object_get(b->keys, step));
    return had && strcmp(had, key) == 0;
}

/* material.json with the keys of what is on disk: the record that a restart goes by. */
static weft_err save_state(const builder *b, weft_error *err)
{
    char *const path = weft_path_join(b->options->folder, "material.json", err);
    json_t *const json = path ? weft_material_describe(&b->baked) : NULL;
    if (!json) {
        weft_free(path);
        return WEFT_ERR_NOMEM;
    }
    json_object_set(json, "keys", b->keys);
    json_object_set(json, "inputs", b->inputs);
    json_object_set(json, "properties", b->properties);
    const weft_err status = weft_json_save(path, json, err);
    json_decref(json);
    weft_free(path);
    return status;
}

/* A step is done and on record; here a build may be cancelled, and goes on later. */
static weft_err finish(builder *b, const char *step, const char key[65], weft_error *err)
{
    json_object_set_new(b->keys, step, json_string(key));
    WEFT_TRY(save_state(b, err));
    return weft_cancelled() ? weft_fail(err, WEFT_ERR_CANCELLED, "cancelled; what is baked is kept")
                            : WEFT_OK;
}

/* -- what is there ------------------------------------------------------------------------------------ */

static weft_err refuse_strange_folder(const char *folder, weft_error *err)
{
    DIR *const list = opendir(folder);
    if (!list)
        return weft_fail_errno(err, WEFT_ERR_IO, "%s: cannot be read", folder);
    int strange = 0;
    for (const struct dirent *one; (one = readdir(list));)
        strange += one->d_name[0] != '.';
    (void)closedir(list);
    if (strange > 0)
        return weft_fail(err, WEFT_ERR_EXISTS, "%s: is there already and is no material; choose another name",
                         folder);
    return WEFT_OK;
}

/* A state that cannot be read is none: everything is built anew. */
static weft_err load_state(builder *b, weft_error *err)
{
    const char *const folder = b->options->folder;
    char *const path = weft_path_join(folder, "material.json", err);
    if (!path)
        return WEFT_ERR_NOMEM;
    weft_err status = WEFT_OK;
    if (weft_file_exists(path)) {
        weft_error ignored = {0};
        if (weft_json_load_kind(path, "material", WEFT_MATERIAL_VERSION, &b->old, &ignored) != WEFT_OK)
            note(b, "material.json", "ignored", ignored.text);
    } else if (weft_folder_exists(folder)) {
        status = refuse_strange_folder(folder, err);
    }
    weft_free(path);
    b->keys = json_deep_copy(json_object_get(b->old, "keys"));
    b->inputs = json_deep_copy(json_object_get(b->old, "inputs"));
    b->keys = json_is_object(b->keys) ? b->keys : json_object();
    b->inputs = json_is_object(b->inputs) ? b->inputs : json_object();
    return status != WEFT_OK || (b->keys && b->inputs) ? status : WEFT_ERR_NOMEM;
}

/* The first property that is not as it was, as a reason. */
static void explain_change(const builder *b, char *why, size_t size)
{
    const json_t *const had = json_object_get(b->old, "properties");
    const char *name;
    json_t *value;
    (void)snprintf(why, size, "%s", b->old ? "a picture or an option changed" : "there was nothing yet");
    json_object_foreach(b->properties, name, value)
    {
        const json_t *const before = json_object_get(had, name);
        if (had && !json_equal(before, value)) {
            (void)snprintf(why, size, "%s was %s, is %s", name,
                           before ? json_string_value(before) : "not set", json_string_value(value));
            return;
        }
    }
    json_object_foreach((json_t *)(uintptr_t)had, name, value) if (!json_object_get(b->properties, name))
    {
        (void)snprintf(why, size, "%s is no longer set", name);
        return;
    }
}

/* -- composite ---------------------------------------------------------------------------------------- */

typedef struct input_hash {
    builder *b;
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
        if (file && weft_file_exists(file) &&
            !weft_path_has_suffix(file, ".png")) /* those are for looking at */
            hash_file(h, file);
        weft_free(file);
        free(names[i]);
    }
    free(names);
}

static weft_err key_composite(builder *b, weft_error *err)
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

static void hash_texels(builder *b, weft_baked_kind kind)
{
    const weft_baked_map *const map = &b->baked.maps[kind];
    static const weft_image none = {0};
    weft_build_key_image(map->n_mips > 0 ? &map->mips[0] : &none, map->constant, weft_baked_rows[kind].planes,
                         b->texels[kind]);
}

/* -- relief and detail -------------------------------------------------------------------------------- */

static double mm_per_px(const builder *b)
{
    return b->baked.size_mm[0] > 0 ? b->baked.size_mm[0] / b->baked.width : 0;
}

/* Takes level 0 of a file that is still right; false when it cannot be read, and is then made again. */
static bool reuse(builder *b, weft_baked_kind kind)
{
    char *const path = weft_asprintf(NULL, "%s/%s.exr", b->options->folder, weft_baked_rows[kind].name);
    weft_image image = {0};
    const bool good = path &&
                      weft_exr_read(path, weft_baked_rows[kind].channels, weft_baked_rows[kind].planes,
                                    &image, NULL) == WEFT_OK &&
                      image.width == b->baked.width && image.height == b->baked.height;
    weft_free(path);
    if (good && weft_baked_add(&b->baked, kind, image.width, image.height, NULL) == WEFT_OK) {
        weft_image_fini(&b->baked.maps[kind].mips[0]);
        b->baked.maps[kind].mips[0] = image;
        return true;
    }
    weft_image_fini(&image);
    return false;
}

static void adopt(weft_baked *baked, weft_baked_kind kind, weft_image *image)
{
    weft_image_fini(&baked->maps[kind].mips[0]);
    baked->maps[kind].mips[0] = *image;
    baked->maps[kind].n_mips = 1;
    *image = (weft_image){0};
}

/* Height in millimetres; without a scale, in texels of a map 1 mm a texel. */
static weft_err make_height(builder *b, weft_error *err)
{
    char hex[65];
    weft_image height;
    weft_build_key key = weft_build_key_begin("height", HEIGHT_VERSION);
    if (b->baked.maps[WEFT_BAKED_HEIGHT].n_mips > 0 || b->baked.maps[WEFT_BAKED_NORMAL].n_mips == 0)
        return WEFT_OK;
    weft_build_key_text(&key, "normal", b->texels[WEFT_BAKED_NORMAL]);
    weft_build_key_number(&key, "mm", mm_per_px(b));
    weft_build_key_number(&key, "periodic", b->baked.periodic);
    weft_build_key_end(&key, hex);
    memcpy(b->texels[WEFT_BAKED_HEIGHT], hex,
           sizeof hex); /* the file rounds: a key of what went in, not of it */
    if (is_current(b, "step height", hex) && reuse(b, WEFT_BAKED_HEIGHT)) {
        note(b, "height", "kept", "its normals are as they were");
        return WEFT_OK;
    }
    const double scale = mm_per_px(b) > 0 ? mm_per_px(b) : 1;
    note(b, "height", "rebuilt", "the normals or the scale changed");
    WEFT_TRY(weft_height_integrate(&b->baked.maps[WEFT_BAKED_NORMAL].mips[0], NULL, scale, b->baked.periodic,
                                   &height, NULL, err));
    adopt(&b->baked, WEFT_BAKED_HEIGHT, &height);
    json_object_set_new(b->keys, "step height", json_string(hex));
    return WEFT_OK;
}

static const weft_baked_kind relief_kinds[] = {WEFT_BAKED_OCCLUSION, WEFT_BAKED_BENT_CONE, WEFT_BAKED_CAVITY,
                                               WEFT_BAKED_CURVATURE};

static bool reuse_all(builder *b, const weft_baked_kind *kinds, int n)
{
    for (int i = 0; i < n; i++)
        if (!reuse(b, kinds[i]))
            return false;
    return true;
}

static weft_err compute_relief(builder *b, weft_error *err)
{
    weft_baked *const baked = &b->baked;
    const weft_image *const height = &baked->maps[WEFT_BAKED_HEIGHT].mips[0];
    const weft_image *const normal =
        baked->maps[WEFT_BAKED_NORMAL].n_mips ? &baked->maps[WEFT_BAKED_NORMAL].mips[0] : NULL;
    const double scale = mm_per_px(b) > 0 ? mm_per_px(b) : 1;
    weft_relief_options options = weft_relief_defaults(scale);
    options.periodic = baked->periodic;
    if (b->options->reach_mm > 0)
        options.reach_mm = b->options->reach_mm;
    else if (!(mm_per_px(b) > 0))
        options.reach_mm = 32; /* texels */
    weft_image occlusion, cone, other;
    WEFT_TRY(weft_relief_occlusion(height, normal, &options, &occlusion, &cone, err));
    if (baked->maps[WEFT_BAKED_OCCLUSION].n_mips > 0)
        weft_image_fini(&occlusion); /* a picture of it was given */
    else
        adopt(baked, WEFT_BAKED_OCCLUSION, &occlusion);
    adopt(baked, WEFT_BAKED_BENT_CONE, &cone);
    WEFT_TRY(weft_relief_cavity(height, scale, CAVITY_RADIUS_PX * scale, baked->periodic, &other, err));
    adopt(baked, WEFT_BAKED_CAVITY, &other);
    if (normal) {
        WEFT_TRY(weft_relief_curvature(normal, scale, baked->periodic, &other, err));
        adopt(baked, WEFT_BAKED_CURVATURE, &other);
    }
    return WEFT_OK;
}

static weft_err make_relief(builder *b, weft_error *err)
{
    char hex[65];
    if (b->baked.maps[WEFT_BAKED_HEIGHT].n_mips == 0)
        return WEFT_OK;
    weft_build_key key = weft_build_key_begin("relief", RELIEF_VERSION);
    weft_build_key_text(&key, "height", b->texels[WEFT_BAKED_HEIGHT]);
    weft_build_key_text(&key, "normal", b->texels[WEFT_BAKED_NORMAL]);
    weft_build_key_text(&key, "occlusion", b->texels[WEFT_BAKED_OCCLUSION]);
    weft_build_key_number(&key, "mm", mm_per_px(b));
    weft_build_key_number(&key, "reach", b->options->reach_mm);
    weft_build_key_number(&key, "periodic", b->baked.periodic);
    weft_build_key_end(&key, hex);
    for (int i = 0; i < 4; i++)
        memcpy(b->texels[relief_kinds[i]], hex, sizeof hex);
    if (is_current(b, "step relief", hex) && reuse_all(b, relief_kinds, 4)) {
        note(b, "occlusion, cavity, curvature", "kept", "the height is as it was");
        return WEFT_OK;
    }
    note(b, "occlusion, cavity, curvature", "rebuilt", "the height changed");
    WEFT_TRY(compute_relief(b, err));
    json_object_set_new(b->keys, "step relief", json_string(hex));
    return WEFT_OK;
}

/* Detail over a base of low frequencies: albedo divided, slopes subtracted. */
static weft_err make_detail(builder *b, weft_error *err)
{
    weft_baked *const baked = &b->baked;
    const double scale = mm_per_px(b) > 0 ? mm_per_px(b) : 1, sigma = b->options->detail_mm / scale;
    if (!(b->options->detail_mm > 0))
        return WEFT_OK;
    for (int which = 0; which < 2; which++) {
        const weft_baked_kind from = which ? WEFT_BAKED_NORMAL : WEFT_BAKED_ALBEDO;
        const weft_baked_kind to = which ? WEFT_BAKED_DETAIL_NORMAL : WEFT_BAKED_DETAIL_ALBEDO;
        if (baked->maps[from].n_mips == 0)
            continue;
        const weft_image *const source = &baked->maps[from].mips[0];
        const size_t n = weft_image_plane_size(source);
        weft_image plane, base;
        WEFT_TRY(weft_baked_add(baked, to, baked->width, baked->height, err));
        weft_image *const out = &baked->maps[to].mips[0];
        WEFT_TRY(weft_image_init(&plane, source->width, source->height, 1, err));
        for (int p = 0; p < 3 - which; p++) { /* colours, or the slopes in x and y */
            for (size_t i = 0; i < n; i++)
                plane.data[i] =
                    which ? weft_image_plane(source, p)[i] / fmaxf(weft_image_plane(source, 2)[i], 0.01F)
                          : weft_image_plane(source, p)[i];
            const weft_err status = weft_relief_blur(&plane, fmax(sigma, 0.5), baked->periodic, &base, err);
            if (status != WEFT_OK) {
                weft_image_fini(&plane);
                return status;
            }
            for (size_t i = 0; i < n; i++)
                weft_image_plane(out, p)[i] =
                    which ? plane.data[i] - base.data[i] : plane.data[i] / fmaxf(base.data[i], 1e-4F);
            weft_image_fini(&base);
        }
        weft_image_fini(&plane);
        for (size_t i = 0; which && i < n; i++) {
            float *const x = weft_image_plane(out, 0) + i, *const y = weft_image_plane(out, 1) + i;
            const float length = sqrtf(*x * *x + *y * *y + 1);
            *x /= length;
            *y /= length;
            weft_image_plane(out, 2)[i] = 1 / length;
        }
    }
    return WEFT_OK;
}

/* -- files -------------------------------------------------------------------------------------------- */

static bool is_lobe(const builder *b, weft_baked_kind kind)
{
    return (kind == WEFT_BAKED_CLOTH_ROUGHNESS && b->baked.two_lobes) || kind == WEFT_BAKED_NORMAL ||
           kind == WEFT_BAKED_ROUGHNESS || kind == WEFT_BAKED_ANISOTROPY || kind == WEFT_BAKED_NORMAL_LENGTH;
}

/* Normals and roughness are filtered together: their files have one key. */
static void key_file(const builder *b, weft_baked_kind kind, char hex[65])
{
    weft_build_key key = weft_build_key_begin(weft_baked_rows[kind].name, FILE_VERSION);
    if (is_lobe(b, kind)) {
        weft_build_key_text(&key, "normal", b->texels[WEFT_BAKED_NORMAL]);
        weft_build_key_text(&key, "roughness", b->texels[WEFT_BAKED_ROUGHNESS]);
        weft_build_key_text(&key, "anisotropy", b->texels[WEFT_BAKED_ANISOTROPY]);
        if (b->baked.two_lobes)
            weft_build_key_text(&key, "cloth_roughness", b->texels[WEFT_BAKED_CLOTH_ROUGHNESS]);
        weft_build_key_number(&key, "rule", b->options->mips.rule);
    } else {
        weft_build_key_text(&key, "texels", b->texels[kind]);
        weft_build_key_number(&key, "coverage",
                              kind == WEFT_BAKED_OPACITY ? b->options->mips.coverage_at : 0);
    }
    weft_build_key_end(&key, hex);
}

static void drop(weft_baked *baked, weft_baked_kind kind)
{
    for (int level = 0; level < WEFT_BAKED_MAX_MIPS; level++)
        weft_image_fini(&baked->maps[kind].mips[level]);
}

static bool file_is_there(const builder *b, weft_baked_kind kind)
{
    char *const path = weft_asprintf(NULL, "%s/%s.exr", b->options->folder, weft_baked_rows[kind].name);
    const bool there = path && weft_file_exists(path);
    weft_free(path);
    return there;
}

/* The mean of a map that stays on disk and is not read again. */
static void recall_mean(builder *b, weft_baked_kind kind)
{
    const json_t *const maps = json_object_get(b->old, "maps");
    const json_t *const mean = json_object_get(json_object_get(maps, weft_baked_rows[kind].name), "constant");
    for (size_t p = 0; b->baked.maps[kind].n_mips > 0 && p < json_array_size(mean) && p < 4; p++)
        b->baked.maps[kind].constant[p] = (float)json_number_value(json_array_get(mean, p));
}

/* Makes the mips of what is not on disk as it should be, and writes those files. */
static weft_err write_maps(builder *b, weft_error *err)
{
    bool stale[WEFT_BAKED_COUNT], lobe_stale = false;
    char keys[WEFT_BAKED_COUNT][65];
    weft_baked *const baked = &b->baked;
    const bool bumpy = baked->maps[WEFT_BAKED_NORMAL].n_mips > 0;
    for (int k = 0; k < WEFT_BAKED_COUNT; k++) {
        const weft_baked_kind kind = (weft_baked_kind)k;
        const bool wanted =
            baked->maps[k].n_mips > 0 || (bumpy && is_lobe(b, kind) && kind != WEFT_BAKED_ANISOTROPY);
        key_file(b, kind, keys[k]);
        stale[k] = wanted && !(is_current(b, weft_baked_rows[k].name, keys[k]) && file_is_there(b, kind));
        lobe_stale = lobe_stale || (stale[k] && is_lobe(b, kind));
    }
    const int levels = weft_baked_levels(baked->width, baked->height);
    for (int k = 0; k < WEFT_BAKED_COUNT; k++) { /* what is current needs no texels any more */
        const weft_baked_kind kind = (weft_baked_kind)k;
        stale[k] = stale[k] || (is_lobe(b, kind) && lobe_stale && bumpy && baked->maps[k].n_mips > 0);
        if (!stale[k] && !(is_lobe(b, kind) && lobe_stale)) {
            drop(baked, kind);
            recall_mean(b, kind);
            b->result->kept += baked->maps[k].n_mips > 0;
            if (baked->maps[k].n_mips > 0)
                note(b, weft_baked_rows[k].name, "kept", "its texels are as they were");
        }
    }
    bool had[WEFT_BAKED_COUNT];
    for (int k = 0; k < WEFT_BAKED_COUNT; k++) { /* the mip maker sees only what it shall make */
        had[k] = baked->maps[k].n_mips > 0;
        if (!baked->maps[k].mips[0].data)
            baked->maps[k].n_mips = 0;
    }
    weft_mip_options mips = b->options->mips;
    mips.max_levels = 0;
    note(b, "mips", "rebuilt", "of the maps below");
    WEFT_TRY(weft_mips_make(baked, &mips, err));
    for (int k = 0; k < WEFT_BAKED_COUNT; k++) {
        const weft_baked_kind kind = (weft_baked_kind)k;
        if (!baked->maps[k].mips[0].data) {
            baked->maps[k].n_mips =
                had[k] || (bumpy && is_lobe(b, kind) && kind != WEFT_BAKED_ANISOTROPY) ? levels : 0;
            continue;
        }
        note(b, weft_baked_rows[k].name, "rebuilt", "its texels changed");
        WEFT_TRY(weft_material_save_map(b->options->folder, baked, kind, err));
        b->result->rebuilt++;
        drop(baked, kind);
        WEFT_TRY(finish(b, weft_baked_rows[k].name, keys[k], err));
    }
    return WEFT_OK;
}

/* Files of maps that the material no longer has. */
static void remove_leftovers(builder *b)
{
    for (int k = 0; k < WEFT_BAKED_COUNT; k++) {
        if (b->baked.maps[k].n_mips > 0)
            continue;
        char *const path = weft_asprintf(NULL, "%s/%s.exr", b->options->folder, weft_baked_rows[k].name);
        if (path && weft_file_exists(path))
            (void)remove(path);
        weft_free(path);
        json_object_del(b->keys, weft_baked_rows[k].name);
    }
}

static weft_err make_maps(builder *b, weft_error *err)
{
    char why[1400];
    explain_change(b, why, sizeof why);
    note(b, "composite", "rebuilt", why);
    WEFT_TRY(weft_composite(b->assets, b->asset, &b->options->composite, &b->baked, err));
    WEFT_TRY(weft_folder_create(b->options->folder, err));
    for (int k = 0; k < WEFT_BAKED_COUNT; k++)
        hash_texels(b, (weft_baked_kind)k);
    WEFT_TRY(make_height(b, err));
    WEFT_TRY(make_relief(b, err));
    WEFT_TRY(make_detail(b, err));
    hash_texels(b, WEFT_BAKED_DETAIL_ALBEDO);
    hash_texels(b, WEFT_BAKED_DETAIL_NORMAL);
    WEFT_TRY(write_maps(b, err));
    remove_leftovers(b);
    return finish(b, "composite", b->composite_key, err);
}

/* -- exports ------------------------------------------------------------------------------------------ */

static bool has_runtime_layers(const builder *b)
{
    const weft_rad_member *const list = weft_rad_at(&b->asset->properties, "runtime_layers");
    return list && list->value->items;
}

static void key_export(const builder *b, const weft_exporter *exporter, char hex[65])
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
static weft_err export_one(builder *b, const weft_exporter *exporter, const weft_baked *whole,
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
static weft_err make_runtime_layers(builder *b, weft_runtime_layers *layers, weft_error *err)
{
    if (!has_runtime_layers(b))
        return WEFT_OK;
    WEFT_TRY(weft_composite_runtime(b->assets, b->asset, &b->options->composite, layers, err));
    weft_err status = weft_mips_make(&layers->base, &b->options->mips, err);
    for (int k = 0; k < layers->n && status == WEFT_OK; k++)
        status = weft_mips_make(&layers->layers[k].baked, &b->options->mips, err);
    return status;
}

/* Exporters read the files, not what is in memory: the same bytes whether or not something was rebuilt. */
static weft_err make_exports(builder *b, weft_error *err)
{
    weft_baked whole = {0};
    weft_runtime_layers layers = {0};
    weft_err status = WEFT_OK;
    for (const weft_exporter *const *e = b->options->exporters; e && *e && status == WEFT_OK; e++) {
        char hex[65], step[80];
        char *const folder = weft_path_join(b->options->folder, (*e)->name, err);
        (void)snprintf(step, sizeof step, "export %s", (*e)->name);
        key_export(b, *e, hex);
        const bool current = folder && weft_folder_exists(folder) && is_current(b, step, hex);
        weft_free(folder);
        note(b, step, current ? "kept" : "rebuilt",
             current ? "all maps are as they were" : "a map or the exporter changed");
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
            status = export_one(b, *e, &whole, &layers, err);
        if (status == WEFT_OK)
            status = finish(b, step, hex, err);
    }
    weft_runtime_layers_fini(&layers);
    weft_baked_fini(&whole);
    return status;
}

/* Everything on disk is what the key stands for: nothing is read but the head. */
static bool keep_maps(builder *b)
{
    if (!b->old || !is_current(b, "composite", b->composite_key))
        return false;
    if (weft_material_load_head(b->options->folder, &b->baked, NULL, NULL) != WEFT_OK)
        return false;
    for (int k = 0; k < WEFT_BAKED_COUNT; k++)
        if (b->baked.maps[k].n_mips > 0 && !file_is_there(b, (weft_baked_kind)k)) {
            weft_baked_fini(&b->baked);
            return false;
        }
    for (int k = 0; k < WEFT_BAKED_COUNT; k++)
        b->result->kept += b->baked.maps[k].n_mips > 0;
    note(b, "maps", "kept", "no property, picture or option that they depend on changed");
    return true;
}

static void key_options(builder *b)
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
    builder *const b = weft_alloc(1, sizeof *b, err);
    if (!b)
        return WEFT_ERR_NOMEM;
    *result = (weft_build_result){0};
    *b = (builder){.assets = assets, .asset = asset, .options = options, .result = result};
    weft_err status = load_state(b, err);
    if (status == WEFT_OK)
        status = key_composite(b, err);
    key_options(b);
    if (status == WEFT_OK && !keep_maps(b))
        status = make_maps(b, err);
    if (status == WEFT_OK)
        status = make_exports(b, err);
    weft_baked_fini(&b->baked);
    json_decref(b->old);
    json_decref(b->keys);
    json_decref(b->inputs);
    json_decref(b->properties);
    weft_free(b);
    return status;
}
