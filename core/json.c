#include "core/json.h"

#include "core/file.h"
#include "core/mem.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define JSON_FILE_LIMIT ((size_t)64 << 20)

weft_err weft_json_load(const char *path, json_t **object, weft_error *err)
{
    char *text;
    size_t n;
    WEFT_TRY(weft_file_read(path, JSON_FILE_LIMIT, &text, &n, err));
    json_error_t where;
    json_t *const root = json_loadb(text, n, JSON_REJECT_DUPLICATES, &where);
    weft_free(text);
    if (!root)
        return weft_fail(err, WEFT_ERR_FORMAT, "%s: line %d: not JSON: %s", path, where.line, where.text);
    if (!json_is_object(root)) {
        json_decref(root);
        return weft_fail(err, WEFT_ERR_FORMAT, "%s: holds no JSON object", path);
    }
    *object = root;
    return WEFT_OK;
}

weft_err weft_json_load_kind(const char *path, const char *kind, int newest, json_t **object, weft_error *err)
{
    json_t *root;
    const char *found = "";
    int version = 0;
    WEFT_TRY(weft_json_load(path, &root, err));
    weft_err status = weft_json_get_text(root, "weft", WEFT_JSON_REQUIRED, &found, path, err);
    if (status == WEFT_OK && strcmp(found, kind) != 0)
        status = weft_fail(err, WEFT_ERR_FORMAT, "%s: is a \"%s\", wanted a \"%s\"", path, found, kind);
    if (status == WEFT_OK)
        status = weft_json_get_int(root, "version", WEFT_JSON_REQUIRED, 1, 1 << 20, &version, path, err);
    if (status == WEFT_OK && version > newest)
        status = weft_fail(err, WEFT_ERR_VERSION,
                           "%s: version %d of \"%s\" is newer than this program knows (%d); update Weft",
                           path, version, kind, newest);
    if (status != WEFT_OK) {
        json_decref(root);
        return status;
    }
    *object = root;
    return WEFT_OK;
}

weft_err weft_json_save(const char *path, const json_t *object, weft_error *err)
{
    char *const text = json_dumps(object, JSON_INDENT(2) | JSON_REAL_PRECISION(17));
    if (!text)
        return weft_fail(err, WEFT_ERR_NOMEM, "%s: no memory for its text, or a number in it is not finite",
                         path);
    char *const whole = weft_asprintf(err, "%s\n", text);
    const weft_err status = whole ? weft_file_write(path, whole, strlen(whole), err) : WEFT_ERR_NOMEM;
    weft_free(whole);
    free(text);
    return status;
}

/* The member, or NULL; says when a required one is absent or of the wrong type. */
static weft_err find(const json_t *object, const char *key, weft_json_need need,
                     bool (*is_type)(const json_t *), const char *type, const json_t **member,
                     const char *place, weft_error *err)
{
    const json_t *const value = json_object_get(object, key);
    *member = NULL;
    if (!value || json_is_null(value))
        return need == WEFT_JSON_OPTIONAL
                   ? WEFT_OK
                   : weft_fail(err, WEFT_ERR_FORMAT, "%s: \"%s\" is missing (wanted %s)", place, key, type);
    if (!is_type(value))
        return weft_fail(err, WEFT_ERR_FORMAT, "%s: \"%s\" is not %s", place, key, type);
    *member = value;
    return WEFT_OK;
}

static bool is_number(const json_t *v)
{
    return json_is_number(v) && isfinite(json_number_value(v));
}

static bool is_integer(const json_t *v)
{
    return json_is_integer(v);
}

static bool is_bool(const json_t *v)
{
    return json_is_boolean(v);
}

static bool is_text(const json_t *v)
{
    return json_is_string(v);
}

static bool is_array(const json_t *v)
{
    return json_is_array(v);
}

static bool is_object(const json_t *v)
{
    return json_is_object(v);
}

weft_err weft_json_get_number(const json_t *object, const char *key, weft_json_need need, double min,
                              double max, double *value, const char *place, weft_error *err)
{
    const json_t *member;
    WEFT_TRY(find(object, key, need, is_number, "a number", &member, place, err));
    if (!member)
        return WEFT_OK;
    const double number = json_number_value(member);
    if (number < min || number > max)
        return weft_fail(err, WEFT_ERR_RANGE, "%s: \"%s\" is %g, wanted %g to %g", place, key, number, min,
                         max);
    *value = number;
    return WEFT_OK;
}

weft_err weft_json_get_int(const json_t *object, const char *key, weft_json_need need, int min, int max,
                           int *value, const char *place, weft_error *err)
{
    const json_t *member;
    WEFT_TRY(find(object, key, need, is_integer, "a whole number", &member, place, err));
    if (!member)
        return WEFT_OK;
    const json_int_t number = json_integer_value(member);
    if (number < min || number > max)
        return weft_fail(err, WEFT_ERR_RANGE, "%s: \"%s\" is %lld, wanted %d to %d", place, key,
                         (long long)number, min, max);
    *value = (int)number;
    return WEFT_OK;
}

weft_err weft_json_get_bool(const json_t *object, const char *key, weft_json_need need, bool *value,
                            const char *place, weft_error *err)
{
    const json_t *member;
    WEFT_TRY(find(object, key, need, is_bool, "true or false", &member, place, err));
    if (member)
        *value = json_is_true(member);
    return WEFT_OK;
}

weft_err weft_json_get_text(const json_t *object, const char *key, weft_json_need need, const char **value,
                            const char *place, weft_error *err)
{
    const json_t *member;
    WEFT_TRY(find(object, key, need, is_text, "a text", &member, place, err));
    if (member)
        *value = json_string_value(member);
    return WEFT_OK;
}

weft_err weft_json_get_numbers(const json_t *object, const char *key, weft_json_need need, int n,
                               double *values, const char *place, weft_error *err)
{
    const json_t *member;
    WEFT_TRY(find(object, key, need, is_array, "a list of numbers", &member, place, err));
    if (!member)
        return WEFT_OK;
    if (json_array_size(member) != (size_t)n)
        return weft_fail(err, WEFT_ERR_FORMAT, "%s: \"%s\" has %zu numbers, wanted %d", place, key,
                         json_array_size(member), n);
    for (int i = 0; i < n; i++)
        if (!is_number(json_array_get(member, (size_t)i)))
            return weft_fail(err, WEFT_ERR_FORMAT, "%s: \"%s\"[%d] is not a number", place, key, i);
    for (int i = 0; i < n; i++)
        values[i] = json_number_value(json_array_get(member, (size_t)i));
    return WEFT_OK;
}

weft_err weft_json_get_array(const json_t *object, const char *key, weft_json_need need, const json_t **array,
                             const char *place, weft_error *err)
{
    return find(object, key, need, is_array, "a list", array, place, err);
}

weft_err weft_json_get_object(const json_t *object, const char *key, weft_json_need need,
                              const json_t **member, const char *place, weft_error *err)
{
    return find(object, key, need, is_object, "an object", member, place, err);
}

weft_err weft_json_refuse_unknown(const json_t *object, const char *const *known, const char *of,
                                  const char *place, weft_error *err)
{
    const char *key;
    const json_t *value;
    json_object_foreach((json_t *)object, key, value)
    {
        const char *const *k = known;
        while (*k && strcmp(*k, key) != 0)
            k++;
        if (!*k)
            return weft_fail(err, WEFT_ERR_FORMAT, "%s: \"%s\" is not a key of %s", place, key, of);
    }
    return WEFT_OK;
}

json_t *weft_json_numbers(const double *values, int n)
{
    json_t *const array = json_array();
    for (int i = 0; array && i < n; i++)
        json_array_append_new(array, json_real(values[i]));
    return array;
}
