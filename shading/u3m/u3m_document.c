#include "shading/u3m/u3m_document.h"

#include "core/json.h"
#include "core/mem.h"

#include <math.h>
#include <string.h>

/* The parameters that are read, and what they are. */
static const struct {
    const char *key;
    enum { COLOUR, NUMBER, VECTOR } kind;
} parameters[] = {{"basecolor", COLOUR},  {"metalness", NUMBER},        {"specular_value", NUMBER},
                  {"roughness", NUMBER},  {"anisotropy_value", NUMBER}, {"anisotropy_rotation", NUMBER},
                  {"alpha", NUMBER},      {"normal", VECTOR},           {"displacement", NUMBER},
                  {"sheen_value", NUMBER}};

static weft_err wrong(const weft_u3m *u, const char *key, weft_error *err, const char *what)
{
    return weft_fail(err, WEFT_ERR_FORMAT, "%s: %s.%s %s", u->path, u->side_name, key, what);
}

static const json_t *image_of(const json_t *parameter)
{
    return json_object_get(json_object_get(parameter, "texture"), "image");
}

static bool all_numbers(const json_t *object, const char *const *keys, int n)
{
    for (int i = 0; i < n; i++)
        if (!json_is_number(json_object_get(object, keys[i])))
            return false;
    return true;
}

static weft_err check_image(weft_u3m *u, const char *key, const json_t *image, weft_error *err)
{
    static const char *const lengths[] = {"width", "height"};
    const char *const path = json_string_value(json_object_get(image, "path"));
    if (!path || !all_numbers(image, lengths, 2))
        return wrong(u, key, err, "has a texture without path, width or height");
    if (!weft_u3m_path_is_allowed(path))
        return wrong(u, key, err, "names its picture by a path that U3M does not allow");
    if (weft_u3m_files_find(u->files, path) < 0)
        return weft_fail(err, WEFT_ERR_MISSING, "%s: %s.%s: its picture \"%s\" is not there", u->path,
                         u->side_name, key, path);
    double size_mm[2];
    for (int k = 0; k < 2; k++)
        size_mm[k] = json_number_value(json_object_get(image, lengths[k])) * (u->is_1_0 ? 10 : 1);
    if (!(size_mm[0] > 0) || !(size_mm[1] > 0))
        return wrong(u, key, err, "has a picture of no width or height");
    if (!(u->size_mm[0] > 0))
        memcpy(u->size_mm, size_mm, sizeof size_mm);
    return WEFT_OK;
}

/* Version 1.0 has numbers where 1.1 has vectors; a constant is only read where there is no picture. */
static weft_err check_parameter(weft_u3m *u, size_t i, weft_error *err)
{
    static const char *const components[][3] = {[COLOUR] = {"r", "g", "b"}, [VECTOR] = {"x", "y", "z"}};
    const char *const key = parameters[i].key;
    const json_t *const p = json_object_get(u->side, key), *const texture = json_object_get(p, "texture");
    const json_t *const constant = json_object_get(p, "constant");
    if (!p)
        return wrong(u, key, err, "is not there");
    if (json_is_object(texture)) {
        static const char *const scalar[] = {"factor", "offset"};
        if (parameters[i].kind == COLOUR &&
            !all_numbers(json_object_get(texture, "factor"), components[COLOUR], 3))
            return wrong(u, key, err, "has a texture without a factor");
        if (parameters[i].kind == NUMBER && !all_numbers(texture, scalar, 2))
            return wrong(u, key, err, "has a texture without factor or offset");
        return check_image(u, key, image_of(p), err);
    }
    if (!json_is_null(texture))
        return wrong(u, key, err, "has a texture that is none");
    const bool good =
        parameters[i].kind == NUMBER
            ? json_is_number(constant)
            : json_is_number(constant) || all_numbers(constant, components[parameters[i].kind], 3);
    return good ? WEFT_OK : wrong(u, key, err, "has no constant");
}

static weft_err find_side(weft_u3m *u, const json_t *material, weft_error *err)
{
    static const char *const sides[] = {"front", "back", "side"};
    for (int i = 0; i < 3 && !u->side; i++)
        if (json_is_object(json_object_get(material, sides[i]))) {
            u->side_name = sides[i];
            u->side = json_object_get(material, sides[i]);
        }
    if (u->side)
        return WEFT_OK;
    return json_is_object(json_object_get(material, "physics"))
               ? weft_fail(err, WEFT_ERR_UNSUPPORTED, "%s: has physics alone, nothing to look at", u->path)
               : weft_fail(err, WEFT_ERR_FORMAT, "%s: has neither front nor back nor side; is it a U3M?",
                           u->path);
}

static weft_err check(weft_u3m *u, weft_error *err)
{
    const char *const version = json_string_value(json_object_get(u->document, "schema"));
    const json_t *const material = json_object_get(u->document, "material");
    if (!version)
        return weft_fail(err, WEFT_ERR_FORMAT, "%s: says no \"schema\"; is it a U3M?", u->path);
    u->is_1_0 = strcmp(version, "1.0") == 0;
    if (!u->is_1_0 && strcmp(version, "1.1") != 0)
        return weft_fail(err, WEFT_ERR_VERSION,
                         "%s: is U3M %s; 1.0 and 1.1 are known, save it as one of those", u->path, version);
    WEFT_TRY(weft_json_get_text(material, "name", WEFT_JSON_REQUIRED, &u->name, u->path, err));
    WEFT_TRY(find_side(u, material, err));
    for (size_t i = 0; i < sizeof parameters / sizeof parameters[0]; i++)
        WEFT_TRY(check_parameter(u, i, err));
    const json_t *const ours = json_object_get(json_object_get(u->document, "custom"), "weft");
    u->ours = json_is_object(ours) && json_is_string(json_object_get(ours, "model")) ? ours : NULL;
    const json_t *const physics = json_object_get(material, "physics");
    u->thickness_mm = fmin(fmax(json_number_value(json_object_get(physics, "thickness")), 0), 100);
    u->weight_gsm = fmin(fmax(json_number_value(json_object_get(physics, "weight")), 0), 1e4);
    if (u->ours && !(u->size_mm[0] > 0)) /* of constants alone no picture tells the size */
        WEFT_TRY(weft_json_get_numbers(u->ours, "size_mm", WEFT_JSON_OPTIONAL, 2, u->size_mm, u->path, err));
    return WEFT_OK;
}

weft_err weft_u3m_open(const char *path, weft_u3m **u3m, weft_error *err)
{
    weft_u3m *const u = weft_alloc(1, sizeof *u, err);
    if (!u)
        return WEFT_ERR_NOMEM;
    u->path = weft_strdup(path, err);
    weft_err status = u->path ? weft_u3m_files_open(path, &u->files, &u->document, err) : WEFT_ERR_NOMEM;
    if (status == WEFT_OK)
        status = check(u, err);
    if (status != WEFT_OK) {
        weft_u3m_close(u);
        return status;
    }
    *u3m = u;
    return WEFT_OK;
}

void weft_u3m_close(weft_u3m *u3m)
{
    if (!u3m)
        return;
    json_decref(u3m->document);
    weft_u3m_files_close(u3m->files);
    weft_free(u3m->path);
    weft_free(u3m);
}
