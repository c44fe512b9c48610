#include "host/capture/set_folder.h"

#include "core/file.h"
#include "core/json.h"
#include "core/log.h"
#include "core/mem.h"
#include "core/sha256.h"
#include "host/capture/sidecar.h"

#include <dirent.h>
#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#define TEMPORARY ".weft-"

/* Calls `visit` for each entry but "." and "..". */
static weft_err visit_folder(const char *folder,
                             weft_err (*visit)(const char *, const char *, void *, weft_error *),
                             void *context, weft_error *err)
{
    DIR *const d = opendir(folder);
    if (!d)
        return weft_fail_errno(err, WEFT_ERR_IO, "%s: the folder cannot be read", folder);
    weft_err status = WEFT_OK;
    const struct dirent *entry;
    while (status == WEFT_OK && (entry = readdir(d)) != NULL)
        if (strcmp(entry->d_name, ".") != 0 && strcmp(entry->d_name, "..") != 0)
            status = visit(folder, entry->d_name, context, err);
    closedir(d);
    return status;
}

static bool is_temporary(const char *name)
{
    return strncmp(name, TEMPORARY, strlen(TEMPORARY)) == 0;
}

static weft_err note_foreign(const char *folder, const char *name, void *foreign, weft_error *err)
{
    (void)folder, (void)err;
    *(bool *)foreign |= !is_temporary(name);
    return WEFT_OK;
}

static weft_err remove_file(const char *folder, const char *name, weft_error *err)
{
    char *const path = weft_path_join(folder, name, err);
    if (!path)
        return WEFT_ERR_NOMEM;
    weft_err status = WEFT_OK;
    if (unlink(path) != 0 && errno != ENOENT)
        status = weft_fail_errno(err, WEFT_ERR_IO, "%s: cannot be removed", path);
    weft_free(path);
    return status;
}

static weft_err remove_temporary(const char *folder, const char *name, void *context, weft_error *err)
{
    (void)context;
    return is_temporary(name) ? remove_file(folder, name, err) : WEFT_OK;
}

static bool has_set(const char *folder)
{
    char *const path = weft_path_join(folder, "set.json", NULL);
    const bool there = path && weft_file_exists(path);
    weft_free(path);
    return there;
}

weft_err weft_set_folder_inspect(const weft_capture_options *o, weft_set_found *found, weft_set *set,
                                 weft_error *err)
{
    *found = WEFT_SET_NONE;
    if (!weft_file_exists(o->folder))
        return WEFT_OK;
    if (!weft_folder_exists(o->folder))
        return weft_fail(err, WEFT_ERR_IO, "%s: is a file; give the name of a folder", o->folder);
    if (!has_set(o->folder)) {
        bool foreign = false;
        WEFT_TRY(visit_folder(o->folder, note_foreign, &foreign, err));
        if (foreign && !o->force)
            return weft_fail(
                err, WEFT_ERR_EXISTS,
                "%s: is there and holds other things than a set; give another name, or --force to "
                "put the set beside them",
                o->folder);
        return WEFT_OK;
    }
    if (o->force && !o->resume) {
        *found = WEFT_SET_REPLACE;
        return WEFT_OK;
    }
    weft_set loaded;
    WEFT_TRY(weft_set_load(o->folder, &loaded, err));
    if (!o->resume) {
        const bool complete = loaded.complete;
        weft_set_fini(&loaded);
        return weft_fail(err, WEFT_ERR_EXISTS, "%s: %s", o->folder,
                         complete ? "is a complete set; give another name, or --force to replace it"
                                  : "is a set that was interrupted; --resume goes on with it, --force begins "
                                    "it anew");
    }
    *set = loaded;
    *found = WEFT_SET_INTERRUPTED;
    return WEFT_OK;
}

/* With the sidecar of a set that has them. */
static weft_err remove_frame(const char *folder, const char *file, bool sidecars, weft_error *err)
{
    if (!sidecars)
        return remove_file(folder, file, err);
    char *const sidecar = weft_asprintf(err, "%s" WEFT_SIDECAR_SUFFIX, file);
    if (!sidecar)
        return WEFT_ERR_NOMEM;
    const weft_err status = remove_file(folder, sidecar, err);
    weft_free(sidecar);
    return status == WEFT_OK ? remove_file(folder, file, err) : status;
}

/* set.json goes first: without it the frames are just files. */
static weft_err remove_set(const char *folder, weft_error *err)
{
    weft_set old = {0};
    weft_err status = WEFT_OK;
    if (weft_set_load(folder, &old, NULL) != WEFT_OK) /* too damaged to name its frames */
        return remove_file(folder, "set.json", err);
    const bool sidecars = json_is_true(json_object_get(json_object_get(old.other, "capture"), "sidecar"));
    status = remove_file(folder, "set.json", err);
    for (int i = 0; i < old.n_frames && status == WEFT_OK; i++)
        if (!strchr(old.frames[i].file, '/')) /* what lies elsewhere is not ours */
            status = remove_frame(folder, old.frames[i].file, sidecars, err);
    weft_set_fini(&old);
    return status;
}

weft_err weft_set_folder_begin(const weft_capture_options *o, weft_set_found found, weft_error *err)
{
    if (found == WEFT_SET_REPLACE)
        WEFT_TRY(remove_set(o->folder, err));
    WEFT_TRY(weft_folder_create(o->folder, err));
    return visit_folder(o->folder, remove_temporary, NULL, err);
}

/* ---- the settings of an interrupted set ---- */

static weft_err differs(const weft_set *set, const char *option, double begun, double asked, weft_error *err)
{
    return weft_fail(err, WEFT_ERR_MISMATCH,
                     "%s: was begun with %s %g, not %g; leave the option out, or begin anew with --force",
                     set->folder, option, begun, asked);
}

static weft_err adopt_number(const weft_set *set, const json_t *stored, const char *key, double *value,
                             weft_error *err)
{
    double begun = 0;
    WEFT_TRY(
        weft_json_get_number(stored, key, WEFT_JSON_REQUIRED, 0, 4294967295.0, &begun, set->folder, err));
    if (*value > 0 && fabs(*value - begun) > 1e-6 * begun)
        return differs(set, key, begun, *value, err);
    *value = begun;
    return WEFT_OK;
}

static weft_err adopt_int(const weft_set *set, const json_t *stored, const char *key, int *value,
                          weft_error *err)
{
    double number = *value;
    WEFT_TRY(adopt_number(set, stored, key, &number, err));
    *value = (int)number;
    return WEFT_OK;
}

static weft_err adopt_more(const json_t *stored, const char *key, bool *value, const char *place,
                           weft_error *err)
{
    bool begun = false;
    WEFT_TRY(weft_json_get_bool(stored, key, WEFT_JSON_OPTIONAL, &begun, place, err));
    *value |= begun; /* more frames of the same kind do no harm */
    return WEFT_OK;
}

/* What the set has for a light; sets of before had one for all. */
static weft_err stored_of_light(const weft_set *set, const json_t *stored, const char *list,
                                const char *common, int light, double *begun, weft_error *err)
{
    const json_t *const array = json_object_get(stored, list), *const item =
                                                                   json_array_get(array, (size_t)light);
    if (!array)
        return weft_json_get_number(stored, common, WEFT_JSON_REQUIRED, 0, 4294967295.0, begun, set->folder,
                                    err);
    if (!json_is_number(item))
        return weft_fail(err, WEFT_ERR_FORMAT,
                         "%s: set.json has no \"%s\" of light %d; begin anew with --force", set->folder, list,
                         light);
    *begun = json_number_value(item);
    return WEFT_OK;
}

/* After the lights are known. */
static weft_err adopt_of_lights(const weft_set *set, const json_t *stored, weft_capture_options *o,
                                weft_error *err)
{
    for (int light = 0; light < WEFT_CAPTURE_MAX_LIGHTS; light++) {
        double exposure_s = 0, bracket = 0;
        char option[48];
        if (o->no_lights || !(o->lights >> light & 1))
            continue;
        WEFT_TRY(stored_of_light(set, stored, "exposures_s", "exposure_s", light, &exposure_s, err));
        WEFT_TRY(stored_of_light(set, stored, "brackets", "bracket", light, &bracket, err));
        if (!(exposure_s > 0) || !(bracket >= 1 && bracket <= WEFT_CAPTURE_MAX_BRACKET))
            return weft_fail(err, WEFT_ERR_RANGE,
                             "%s: set.json has %g exposures of %g s for light %d; begin anew with --force",
                             set->folder, bracket, exposure_s, light);
        snprintf(option, sizeof option, "exposure of light %d", light);
        if (o->exposures_s[light] > 0 && fabs(o->exposures_s[light] - exposure_s) > 1e-6 * exposure_s)
            return differs(set, option, exposure_s, o->exposures_s[light], err);
        snprintf(option, sizeof option, "bracket of light %d", light);
        if (o->brackets[light] > 0 && o->brackets[light] != (int)bracket)
            return differs(set, option, bracket, o->brackets[light], err);
        o->exposures_s[light] = exposure_s;
        o->brackets[light] = (int)bracket;
    }
    return WEFT_OK;
}

/* The text lives as long as the set. */
static weft_err adopt_file_name(const weft_set *set, const json_t *stored, const char **value,
                                weft_error *err)
{
    const char *begun = WEFT_FRAME_NAME_DEFAULT;
    WEFT_TRY(weft_json_get_text(stored, "file_name", WEFT_JSON_OPTIONAL, &begun, set->folder, err));
    if (*value && strcmp(*value, begun) != 0)
        return weft_fail(err, WEFT_ERR_MISMATCH,
                         "%s: was begun with --file-name \"%s\", not \"%s\"; leave the option out, or begin "
                         "anew with --force",
                         set->folder, begun, *value);
    *value = begun;
    return WEFT_OK;
}

weft_err weft_set_folder_adopt(const weft_set *set, weft_capture_options *o, weft_error *err)
{
    const json_t *const stored = json_object_get(set->other, "capture");
    double lights = o->lights;
    if (!json_is_object(stored))
        return weft_fail(err, WEFT_ERR_MISMATCH,
                         "%s: was not captured by this program and cannot be resumed; give another name",
                         set->folder);
    WEFT_TRY(adopt_number(set, stored, "lights", &lights, err));
    o->lights = (uint32_t)lights;
    WEFT_TRY(adopt_number(set, stored, "exposure_s", &o->exposure_s, err));
    WEFT_TRY(adopt_number(set, stored, "gain", &o->gain, err));
    WEFT_TRY(adopt_number(set, stored, "settle_s", &o->settle_s, err));
    WEFT_TRY(adopt_int(set, stored, "bracket", &o->bracket, err));
    if (o->bracket == 0)
        o->bracket = WEFT_CAPTURE_BRACKET_AUTO; /* resolved: each light has its own below */
    WEFT_TRY(adopt_int(set, stored, "level", &o->level, err));
    if (json_object_get(stored, "average")) /* sets of before had none */
        WEFT_TRY(adopt_int(set, stored, "average", &o->average, err));
    WEFT_TRY(adopt_file_name(set, stored, &o->file_name, err));
    WEFT_TRY(adopt_more(stored, "sidecar", &o->sidecar, set->folder, err));
    WEFT_TRY(adopt_more(stored, "no_lights", &o->no_lights, set->folder, err));
    WEFT_TRY(adopt_of_lights(set, stored, o, err));
    WEFT_TRY(adopt_more(stored, "no_ambient", &o->no_ambient, set->folder, err));
    WEFT_TRY(adopt_more(stored, "all", &o->all, set->folder, err));
    return adopt_more(stored, "dark", &o->dark, set->folder, err);
}

/* One number for each light up to the last, null for those that have no frame. */
static json_t *numbers_of_lights(const weft_capture_options *o, const double *reals, const int *integers)
{
    json_t *const list = json_array();
    for (int i = 0; i < WEFT_CAPTURE_MAX_LIGHTS && o->lights >> i; i++)
        json_array_append_new(list, !(o->lights >> i & 1) ? json_null()
                                    : reals               ? json_real(reals[i])
                                                          : json_integer(integers[i]));
    return list;
}

weft_err weft_set_folder_remember(weft_set *set, const weft_capture_options *o,
                                  const weft_controller_info *controller, weft_error *err)
{
    json_t *const capture = json_pack(
        "{s:I, s:f, s:f, s:f, s:i, s:i, s:i, s:s, s:b, s:b, s:b, s:b, s:b, s:{s:s, s:s, s:s}}", "lights",
        (json_int_t)o->lights, "exposure_s", o->exposure_s, "gain", o->gain, "settle_s", o->settle_s,
        "bracket", o->bracket > 0 ? o->bracket : 0, "level", o->level, "average", o->average, "file_name",
        o->file_name ? o->file_name : WEFT_FRAME_NAME_DEFAULT, "sidecar", o->sidecar, "no_lights",
        o->no_lights, "no_ambient", o->no_ambient, "all", o->all, "dark", o->dark, "controller", "firmware",
        controller->firmware, "git_id", controller->git_id, "serial", controller->serial_number);
    if (!set->other)
        set->other = json_object();
    if (capture && !o->no_lights) {
        json_object_set_new(capture, "exposures_s", numbers_of_lights(o, o->exposures_s, NULL));
        json_object_set_new(capture, "brackets", numbers_of_lights(o, NULL, o->brackets));
    }
    if (!capture || json_object_set_new(set->other, "capture", capture) != 0)
        return weft_fail(err, WEFT_ERR_NOMEM, "out of memory for the settings of the set");
    return WEFT_OK;
}

weft_err weft_set_folder_check_camera(const weft_set *set, const char *backend,
                                      const weft_camera_state *camera, weft_error *err)
{
    if (strcmp(set->camera_backend, backend) != 0 || strcmp(set->camera_model, camera->model) != 0 ||
        strcmp(set->camera_serial, camera->serial) != 0)
        return weft_fail(
            err, WEFT_ERR_MISMATCH,
            "%s: was begun with the camera %s %s %s, this is %s %s %s; connect that one, or begin "
            "anew with --force",
            set->folder, set->camera_backend, set->camera_model, set->camera_serial, backend, camera->model,
            camera->serial);
    if (set->width != camera->width || set->height != camera->height || set->cfa != camera->cfa)
        return weft_fail(
            err, WEFT_ERR_MISMATCH,
            "%s: was begun with frames of %d x %d %s, the camera now has %d x %d %s; begin anew with "
            "--force",
            set->folder, set->width, set->height, weft_cfa_name(set->cfa), camera->width, camera->height,
            weft_cfa_name(camera->cfa));
    return WEFT_OK;
}

weft_err weft_set_folder_check_names(const weft_capture_options *o, weft_set_found found,
                                     const weft_capture_plan *plan, weft_error *err)
{
    weft_err status = WEFT_OK;
    for (int i = 0; i < plan->n && found == WEFT_SET_NONE && status == WEFT_OK; i++) {
        char *const path = weft_path_join(o->folder, plan->frames[i].file, err);
        if (!path)
            return WEFT_ERR_NOMEM;
        if (weft_file_exists(path))
            status = weft_fail(err, WEFT_ERR_EXISTS,
                               "%s: is there and of no set; move it away, or give another --file-name", path);
        weft_free(path);
    }
    return status;
}

/* Brackets of before are known by their names alone. */
static bool is_planned(const weft_set_frame *row, const weft_planned_frame *planned)
{
    const json_t *const bracket = json_object_get(row->capture, "bracket");
    if (row->role != planned->role || (row->role == WEFT_ROLE_LIGHT && row->light != planned->light))
        return false;
    if (bracket)
        return json_integer_value(bracket) == planned->bracket;
    return planned->bracket < 0 || strcmp(row->file, planned->file) == 0;
}

static weft_err is_intact(const weft_set *set, int index, bool *intact, weft_error *err)
{
    char hex[65] = "";
    char *const path = weft_set_frame_path(set, index, err);
    if (!path)
        return WEFT_ERR_NOMEM;
    *intact = weft_file_exists(path) && weft_sha256_file(path, hex, NULL) == WEFT_OK &&
              strcmp(hex, set->frames[index].sha256) == 0;
    if (!*intact)
        weft_warn("%s: %s; it is taken again", path,
                  hex[0] ? "is not as it was captured" : "is gone or cannot be read");
    weft_free(path);
    return WEFT_OK;
}

weft_err weft_set_folder_find_frames(const weft_set *set, weft_capture_plan *plan, weft_error *err)
{
    for (int i = 0; i < plan->n; i++) {
        weft_planned_frame *const f = &plan->frames[i];
        for (int row = 0; row < set->n_frames && f->row < 0; row++)
            if (is_planned(&set->frames[row], f))
                f->row = row;
        if (f->row < 0)
            continue;
        const char *const name = set->frames[f->row].file;
        WEFT_TRY(is_intact(set, f->row, &f->have, err));
        if (!f->have && (strchr(name, '/') || strlen(name) >= sizeof f->file))
            return weft_fail(err, WEFT_ERR_MISMATCH,
                             "%s: the file %s does not lie in it, and is not overwritten; begin anew",
                             set->folder, name);
        snprintf(f->file, sizeof f->file, "%s", name);
    }
    return WEFT_OK;
}
