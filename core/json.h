/**
 * JSON files through Jansson, with errors that name the file and the key.
 *
 * The getters take the object, the key and what to call the place ("harris.set/set.json") and refuse
 * wrong types, NaN and values out of range; an absent optional key leaves the value as it is.
 */
#ifndef WEFT_CORE_JSON_H
#define WEFT_CORE_JSON_H

#include "core/error.h"

#include <jansson.h>
#include <stdbool.h>

/** Reads a JSON object from a file (at most 64 MiB); json_decref() it. */
weft_err weft_json_load(const char *path, json_t **object, weft_error *err);

/** Reads a Weft file: an object whose "weft" is `kind` and whose "version" is 1..`newest`.
 *  @return WEFT_ERR_FORMAT for another kind, WEFT_ERR_VERSION with the remedy for a newer version. */
weft_err weft_json_load_kind(const char *path, const char *kind, int newest, json_t **object,
                             weft_error *err);

/** Writes an object, indented, whole or not at all (see file.h). */
weft_err weft_json_save(const char *path, const json_t *object, weft_error *err);

/** Whether a key must be there. */
typedef enum weft_json_need { WEFT_JSON_OPTIONAL, WEFT_JSON_REQUIRED } weft_json_need;

weft_err weft_json_get_number(const json_t *object, const char *key, weft_json_need need, double min,
                              double max, double *value, const char *place, weft_error *err);
weft_err weft_json_get_int(const json_t *object, const char *key, weft_json_need need, int min, int max,
                           int *value, const char *place, weft_error *err);
weft_err weft_json_get_bool(const json_t *object, const char *key, weft_json_need need, bool *value,
                            const char *place, weft_error *err);
/** The string lives as long as the object. */
weft_err weft_json_get_text(const json_t *object, const char *key, weft_json_need need, const char **value,
                            const char *place, weft_error *err);
/** Exactly `n` finite numbers. */
weft_err weft_json_get_numbers(const json_t *object, const char *key, weft_json_need need, int n,
                               double *values, const char *place, weft_error *err);
/** An array or object member, borrowed; NULL when an optional one is absent. */
weft_err weft_json_get_array(const json_t *object, const char *key, weft_json_need need, const json_t **array,
                             const char *place, weft_error *err);
weft_err weft_json_get_object(const json_t *object, const char *key, weft_json_need need,
                              const json_t **member, const char *place, weft_error *err);
/** Fails on a key that is not among `known` (NULL-ended): a misspelt one would silently leave its default.
 *  `of` says of what it is none: "a scene; docs/virtual-scanner.md lists them". */
weft_err weft_json_refuse_unknown(const json_t *object, const char *const *known, const char *of,
                                  const char *place, weft_error *err);

/** An array of `n` numbers; NULL without memory. */
json_t *weft_json_numbers(const double *values, int n);

#endif
