#include "shading/u3m/u3m_keep.h"

#include <ctype.h>
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

/* Half floats have eleven bits. */
#define RELATIVE 1e-3
#define ABSOLUTE 1e-5

void weft_u3m_identifier(const char *name, char *identifier, size_t size)
{
    size_t n = 0;
    if (!isalpha((unsigned char)*name))
        n += (size_t)snprintf(identifier, size, "m_");
    for (; *name && n + 1 < size; name++)
        identifier[n++] = isalnum((unsigned char)*name) ? *name : '_';
    identifier[n] = '\0';
}

static float at(const weft_baked_map *map, int plane, size_t i)
{
    return map->n_mips > 0 ? weft_image_plane(&map->mips[0], plane)[i] : map->constant[plane];
}

static bool differs(const weft_baked *a, const weft_baked *b, weft_baked_kind kind)
{
    const weft_baked_map *const one = &a->maps[kind], *const two = &b->maps[kind];
    const bool varies = one->n_mips > 0 || two->n_mips > 0;
    const size_t n = varies ? (size_t)a->width * (size_t)a->height : 1;
    for (int p = 0; p < weft_baked_rows[kind].planes; p++)
        for (size_t i = 0; i < n; i++) {
            const double x = (double)at(one, p, i), y = (double)at(two, p, i);
            if (!(fabs(x - y) <= RELATIVE * fabs(y) + ABSOLUTE))
                return true;
        }
    return false;
}

/* A picture of another size in mm is another picture. */
static bool is_of_size(const weft_baked *baked, const weft_u3m *source)
{
    for (int k = 0; k < 2; k++)
        if (source->size_mm[k] > 0 &&
            fabs(baked->size_mm[k] - source->size_mm[k]) > 1e-6 * source->size_mm[k])
            return false;
    return true;
}

static bool is_metal(const weft_baked *from)
{
    const weft_baked_map *const f0 = &from->maps[WEFT_BAKED_SPECULAR];
    return f0->n_mips > 0 || f0->constant[0] > 0.08F || f0->constant[1] > 0.08F || f0->constant[2] > 0.08F;
}

weft_err weft_u3m_keep_open(const weft_baked *baked, weft_u3m_keep *keep, weft_error *err)
{
    weft_baked from;
    char identifier[256];
    *keep = (weft_u3m_keep){0};
    WEFT_TRY(weft_u3m_open(baked->u3m, &keep->source, err));
    const weft_err status =
        weft_u3m_bake(keep->source, baked->width, baked->height, baked->size_mm, &from, err);
    if (status != WEFT_OK) {
        weft_u3m_keep_close(keep);
        return status;
    }
    const bool same_size = is_of_size(baked, keep->source);
    for (int k = 0; k < WEFT_BAKED_COUNT; k++) {
        const weft_baked_kind kind = (weft_baked_kind)k;
        if (kind == WEFT_BAKED_HEIGHT && !weft_u3m_has(keep->source, kind))
            continue; /* made from the normals */
        if (weft_baked_rows[k].planes > 0 &&
            (weft_u3m_has(keep->source, kind) || kind == WEFT_BAKED_ANISOTROPY || kind == WEFT_BAKED_CLOTH ||
             kind == WEFT_BAKED_NORMAL))
            keep->changed[k] = (!same_size && from.maps[k].n_mips > 0) || differs(baked, &from, kind);
    }
    keep->is_metal = is_metal(&from) || is_metal(baked);
    weft_u3m_identifier(keep->source->name, identifier, sizeof identifier);
    keep->same_physics = fabs(baked->thickness_mm - keep->source->thickness_mm) < 1e-9 &&
                         fabs(baked->weight_gsm - keep->source->weight_gsm) < 1e-9;
    keep->same_name = strcmp(identifier, baked->name) == 0;
    weft_baked_fini(&from);
    return WEFT_OK;
}

void weft_u3m_keep_close(weft_u3m_keep *keep)
{
    weft_u3m_close(keep->source);
    *keep = (weft_u3m_keep){0};
}

bool weft_u3m_keeps(const weft_u3m_keep *keep, const char *key)
{
    static const struct {
        const char *key;
        weft_baked_kind kinds[2];
    } rows[] = {{"roughness", {WEFT_BAKED_ROUGHNESS, WEFT_BAKED_ANISOTROPY}},
                {"anisotropy_value", {WEFT_BAKED_ANISOTROPY, WEFT_BAKED_ANISOTROPY}},
                {"anisotropy_rotation", {WEFT_BAKED_TANGENT, WEFT_BAKED_ANISOTROPY}},
                {"specular_value", {WEFT_BAKED_SPECULAR, WEFT_BAKED_SPECULAR}},
                {"specular_tint", {WEFT_BAKED_SPECULAR, WEFT_BAKED_SPECULAR}},
                {"ior", {WEFT_BAKED_SPECULAR, WEFT_BAKED_SPECULAR}},
                {"alpha", {WEFT_BAKED_OPACITY, WEFT_BAKED_OPACITY}},
                {"normal", {WEFT_BAKED_NORMAL, WEFT_BAKED_NORMAL}},
                {"sheen_value", {WEFT_BAKED_CLOTH, WEFT_BAKED_CLOTH}}};
    const bool *const changed = keep->changed;
    if (strcmp(key, "basecolor") == 0 || strcmp(key, "metalness") == 0)
        return !changed[WEFT_BAKED_ALBEDO] && !(keep->is_metal && changed[WEFT_BAKED_SPECULAR]);
    if (strcmp(key, "displacement") == 0) /* where it has no unit it goes with the normals */
        return !changed[weft_u3m_has(keep->source, WEFT_BAKED_HEIGHT) ? WEFT_BAKED_HEIGHT
                                                                      : WEFT_BAKED_NORMAL];
    if (strcmp(key, "preview") == 0)
        return weft_u3m_keeps_all(keep);
    for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++)
        if (strcmp(key, rows[i].key) == 0)
            return !changed[rows[i].kinds[0]] && !changed[rows[i].kinds[1]];
    return true;
}

bool weft_u3m_keeps_all(const weft_u3m_keep *keep)
{
    for (int k = 0; k < WEFT_BAKED_COUNT; k++)
        if (keep->changed[k])
            return false;
    return keep->same_name && keep->same_physics;
}

/* -- from 1.0 to 1.1 ---------------------------------------------------------------------------------- */

static void scale(json_t *object, const char *key, double factor)
{
    const json_t *const number = json_object_get(object, key);
    if (json_is_number(number))
        json_object_set_new(object, key, json_real(json_number_value(number) * factor));
}

/* Centimetres become millimetres, one resolution two. */
static void upgrade_image(json_t *image)
{
    const double dpi = json_number_value(json_object_get(image, "dpi"));
    scale(image, "width", 10);
    scale(image, "height", 10);
    json_object_set_new(image, "dpi", json_pack("{s:f, s:f}", "x", dpi, "y", dpi));
}

static void upgrade_side(json_t *side)
{
    const char *key;
    json_t *parameter;
    json_object_foreach(side, key, parameter)
    {
        json_t *const texture = json_object_get(parameter, "texture");
        if (json_is_object(json_object_get(texture, "image")))
            upgrade_image(json_object_get(texture, "image"));
        if (strcmp(key, "anisotropy_rotation") == 0) {
            scale(parameter, "constant", 1.0 / 360);
            scale(texture, "factor", 1.0 / 360);
            scale(texture, "offset", 1.0 / 360);
        }
        if (strcmp(key, "normal") != 0 && strcmp(key, "clearcoat_normal") != 0)
            continue;
        if (json_is_number(json_object_get(parameter, "constant")))
            json_object_set_new(parameter, "constant",
                                json_pack("{s:f, s:f, s:f}", "x", 0.0, "y", 0.0, "z", 1.0));
        if (json_is_object(texture)) {
            const json_t *const factor = json_object_get(texture, "factor");
            json_object_set_new(texture, "scale", json_real(factor ? json_number_value(factor) : 1));
            json_object_del(texture, "factor");
            json_object_del(texture, "offset");
        }
    }
    if (!json_object_get(side, "preview"))
        json_object_set_new(side, "preview", json_null());
}

static void upgrade(json_t *document)
{
    static const char *const sides[] = {"front", "back", "side"}, *const wanted[] = {"side", "physics",
                                                                                     "metadata"};
    json_t *const material = json_object_get(document, "material");
    json_object_set_new(document, "schema", json_string("1.1"));
    for (int i = 0; i < 3; i++) {
        json_t *const side = json_object_get(material, sides[i]);
        if (json_is_object(side))
            upgrade_side(side);
        if (!json_object_get(material, wanted[i]))
            json_object_set_new(material, wanted[i], json_null());
    }
}

json_t *weft_u3m_keep_document(const weft_u3m_keep *keep)
{
    json_t *const document = json_deep_copy(keep->source->document);
    if (document && keep->source->is_1_0 && !weft_u3m_keeps_all(keep))
        upgrade(document);
    return document;
}

/* -- files -------------------------------------------------------------------------------------------- */

static bool names(const json_t *node, const weft_u3m_files *files, int index)
{
    const char *const text = json_string_value(node), *key;
    json_t *member;
    size_t i;
    if (text)
        return weft_u3m_files_find(files, text) == index;
    json_array_foreach(node, i, member) if (names(member, files, index)) return true;
    json_object_foreach((json_t *)(uintptr_t)node, key, member) if (names(member, files, index)) return true;
    return false;
}

bool weft_u3m_keeps_file(const weft_u3m_keep *keep, int index, const json_t *document)
{
    const weft_u3m_files *const files = keep->source->files;
    const char *key;
    json_t *parameter;
    if (strcmp(weft_u3m_files_name(files, index), weft_u3m_files_document(files)) == 0)
        return false;
    bool was_replaced = false;
    json_object_foreach((json_t *)(uintptr_t)keep->source->side, key, parameter) was_replaced =
        was_replaced || (!weft_u3m_keeps(keep, key) && names(parameter, files, index));
    return !was_replaced || names(document, files, index);
}
