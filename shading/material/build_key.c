#include "shading/material/build_key.h"

#include "core/mem.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

weft_build_key weft_build_key_begin(const char *step, int version)
{
    weft_build_key key;
    weft_sha256_init(&key.hash);
    weft_build_key_number(&key, step, version);
    return key;
}

void weft_build_key_text(weft_build_key *key, const char *name, const char *value)
{
    weft_sha256_update(&key->hash, name, strlen(name) + 1);
    weft_sha256_update(&key->hash, value, strlen(value) + 1);
}

void weft_build_key_number(weft_build_key *key, const char *name, double value)
{
    char text[40];
    (void)snprintf(text, sizeof text, "%.17g", value);
    weft_build_key_text(key, name, text);
}

void weft_build_key_end(weft_build_key *key, char hex[65])
{
    weft_sha256_final_hex(&key->hash, hex);
}

void weft_build_key_image(const weft_image *image, const float constant[4], int planes, char hex[65])
{
    weft_build_key key = weft_build_key_begin("image", planes);
    if (image->planes > 0) {
        weft_build_key_number(&key, "width", image->width);
        weft_sha256_update(&key.hash, image->data,
                           weft_image_plane_size(image) * (size_t)image->planes * sizeof *image->data);
    } else {
        weft_sha256_update(&key.hash, constant, (size_t)planes * sizeof *constant);
    }
    weft_build_key_end(&key, hex);
}

weft_err weft_build_key_file(const char *path, json_t *known, char hex[65], weft_error *err)
{
    struct stat now;
    if (stat(path, &now) != 0)
        return weft_fail_errno(err, WEFT_ERR_IO, "%s: cannot be read", path);
    const json_int_t mtime = (json_int_t)now.st_mtim.tv_sec * 1000000000 + now.st_mtim.tv_nsec;
    const json_t *const entry = json_object_get(known, path);
    const char *const sha = json_string_value(json_object_get(entry, "sha256"));
    if (sha && strlen(sha) == 64 &&
        json_integer_value(json_object_get(entry, "size")) == (json_int_t)now.st_size &&
        json_integer_value(json_object_get(entry, "mtime_ns")) == mtime) {
        memcpy(hex, sha, 65);
        return WEFT_OK;
    }
    WEFT_TRY(weft_sha256_file(path, hex, err));
    json_object_set_new(
        known, path,
        json_pack("{s:I, s:I, s:s}", "size", (json_int_t)now.st_size, "mtime_ns", mtime, "sha256", hex));
    return WEFT_OK;
}

static weft_err add_properties(weft_assets *assets, const weft_asset *asset, const char *place, int depth,
                               json_t *lines, weft_error *err);

/* The value as weft_asset_print() writes it: one line a property, with the asset that set it. */
static weft_err add_lines(const weft_asset *asset, const char *place, json_t *lines, weft_error *err)
{
    char *text = NULL;
    size_t n = 0;
    FILE *const out = open_memstream(&text, &n);
    if (!out)
        return weft_fail(err, WEFT_ERR_NOMEM, "out of memory");
    weft_asset_print(asset, out);
    (void)fclose(out);
    char *rest = text;
    for (char *line; (line = strsep(&rest, "\n"));) {
        char *const equals = strstr(line, " = ");
        if (strncmp(line, "    :", 5) != 0 || !equals)
            continue;
        *equals = '\0';
        char name[512];
        (void)snprintf(name, sizeof name, "%s%s", place, line + 5);
        json_object_set_new(lines, name, json_string(equals + 3));
    }
    free(text);
    char type[512];
    (void)snprintf(type, sizeof type, "%stype", place);
    json_object_set_new(lines, type, json_string(asset->type->name));
    return WEFT_OK;
}

static weft_err add_layers(weft_assets *assets, const weft_asset *asset, const char *list, const char *place,
                           int depth, json_t *lines, weft_error *err)
{
    const weft_rad_member *const layers = weft_rad_at(&asset->properties, list);
    int index = 0;
    for (const weft_rad_value *item = layers ? layers->value->items : NULL; item;
         item = item->next, index++) {
        weft_asset layer;
        char inside[512];
        WEFT_TRY(weft_assets_layer(assets, &item->record, &layer, err));
        (void)snprintf(inside, sizeof inside, "%s%s[%d].", place, list, index);
        WEFT_TRY(add_properties(assets, &layer, inside, depth + 1, lines, err));
    }
    return WEFT_OK;
}

static weft_err add_properties(weft_assets *assets, const weft_asset *asset, const char *place, int depth,
                               json_t *lines, weft_error *err)
{
    if (depth > 64)
        return weft_fail(err, WEFT_ERR_FORMAT, "%s: layers lie in layers without end", asset->name);
    WEFT_TRY(add_lines(asset, place, lines, err));
    WEFT_TRY(add_layers(assets, asset, "layers", place, depth, lines, err));
    return add_layers(assets, asset, "runtime_layers", place, depth, lines, err);
}

json_t *weft_build_properties(weft_assets *assets, const weft_asset *asset, weft_error *err)
{
    json_t *const lines = json_object();
    if (lines && add_properties(assets, asset, "", 0, lines, err) == WEFT_OK)
        return lines;
    json_decref(lines);
    return NULL;
}
