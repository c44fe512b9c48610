/* What a build finds in its folder and leaves there: material.json with the keys of what is on disk. */
#include "shading/material/build_private.h"

#include "core/file.h"
#include "core/json.h"
#include "core/mem.h"
#include "core/progress.h"
#include "shading/bake/material_file.h"

#include <dirent.h>
#include <stdio.h>
#include <string.h>

void weft_builder_note(const weft_builder *b, const char *step, const char *what, const char *why)
{
    if (b->options->note)
        b->options->note(b->options->context, step, what, why);
}

bool weft_builder_is_current(const weft_builder *b, const char *step, const char key[65])
{
    const char *const had = json_string_value(json_object_get(b->keys, step));
    return had && strcmp(had, key) == 0;
}

/* material.json with the keys of what is on disk: the record that a restart goes by. */
static weft_err save_state(const weft_builder *b, weft_error *err)
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

weft_err weft_builder_begin(weft_builder *b, const char *const steps[], weft_error *err)
{
    bool any = false;
    for (; *steps; steps++)
        any |= json_object_del(b->keys, *steps) == 0;
    return any ? save_state(b, err) : WEFT_OK;
}

weft_err weft_builder_finish(weft_builder *b, const char *step, const char key[65], weft_error *err)
{
    json_object_set_new(b->keys, step, json_string(key));
    WEFT_TRY(save_state(b, err));
    return weft_cancelled() ? weft_fail(err, WEFT_ERR_CANCELLED, "cancelled; what is baked is kept")
                            : WEFT_OK;
}

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

weft_err weft_builder_load(weft_builder *b, weft_error *err)
{
    const char *const folder = b->options->folder;
    char *const path = weft_path_join(folder, "material.json", err);
    if (!path)
        return WEFT_ERR_NOMEM;
    weft_err status = WEFT_OK;
    if (weft_file_exists(path)) {
        weft_error ignored = {0};
        if (weft_json_load_kind(path, "material", WEFT_MATERIAL_VERSION, &b->old, &ignored) != WEFT_OK)
            weft_builder_note(b, "material.json", "ignored", ignored.text);
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

void weft_builder_explain_change(const weft_builder *b, char *why, size_t size)
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
