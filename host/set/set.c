#include "host/set/set.h"

#include "core/file.h"
#include "core/json.h"
#include "core/mem.h"
#include "core/text.h"

#include <stdio.h>
#include <string.h>

#define MAX_LIGHTS 256

static const char *const role_names[] = {"light", "ambient", "dark", "all"};

/* Keys that this file owns, at the top and inside "camera" and "sensor"; all others are kept in `other`. */
static const char *const top_keys[] = {"weft", "version", "name", "created", "frames", "state", "mask", NULL};
static const char *const camera_keys[] = {"backend", "model", "serial", NULL};
static const char *const sensor_keys[] = {"width", "height",   "cfa",   "black",
                                          "white", "transfer", "noise", NULL};

const char *weft_frame_role_name(weft_frame_role role)
{
    return role_names[role];
}

weft_err weft_set_init(weft_set *set, const char *folder, weft_error *err)
{
    char *const copy = weft_strdup(folder, err);
    if (!copy)
        return WEFT_ERR_NOMEM;
    *set = (weft_set){.folder = copy, .transfer = WEFT_TRANSFER_SRGB};
    weft_time_now_iso(set->created);
    return WEFT_OK;
}

void weft_set_fini(weft_set *set)
{
    for (int i = 0; i < set->n_frames; i++) {
        weft_free(set->frames[i].file);
        json_decref(set->frames[i].capture);
    }
    weft_free(set->frames);
    weft_free(set->folder);
    weft_free(set->name);
    weft_free(set->mask_file);
    json_decref(set->other);
    *set = (weft_set){0};
}

/* ---- what a frame may be ---- */

/* Inside the folder, or absolute: a set that is passed on must not reach around the receiver's disk. */
static weft_err check_file_name(const char *file, const char *place, weft_error *err)
{
    if (!*file || !weft_text_is_utf8(file, strlen(file)))
        return weft_fail(err, WEFT_ERR_FORMAT, "%s: a file name is empty or not UTF-8", place);
    if (*file == '/')
        return WEFT_OK;
    for (const char *part = file; part; part = strchr(part, '/')) {
        part += *part == '/';
        if (strncmp(part, "..", 2) == 0 && (part[2] == '/' || part[2] == '\0'))
            return weft_fail(
                err, WEFT_ERR_FORMAT,
                "%s: \"%s\" leads out of the set's folder; give an absolute path or move the file", place,
                file);
    }
    return WEFT_OK;
}

static weft_err check_sha256(const char *hex, const char *file, const char *place, weft_error *err)
{
    if (strlen(hex) == 64 && strspn(hex, "0123456789abcdef") == 64)
        return WEFT_OK;
    return weft_fail(err, WEFT_ERR_FORMAT, "%s: the \"sha256\" of %s is not 64 lower-case hex digits", place,
                     file);
}

static weft_err check_frame(const weft_set *set, const weft_set_frame *frame, const char *place,
                            weft_error *err)
{
    WEFT_TRY(check_file_name(frame->file, place, err));
    if (frame->role == WEFT_ROLE_LIGHT && (frame->light < 0 || frame->light >= MAX_LIGHTS))
        return weft_fail(err, WEFT_ERR_RANGE, "%s: %s is of light %d, wanted 0 to %d", place, frame->file,
                         frame->light, MAX_LIGHTS - 1);
    if (!(frame->exposure_s > 0 && frame->exposure_s <= 1e5))
        return weft_fail(err, WEFT_ERR_RANGE, "%s: %s has an exposure of %g s, wanted more than 0", place,
                         frame->file, frame->exposure_s);
    if (!(frame->gain > 0 && frame->gain <= 1e5))
        return weft_fail(err, WEFT_ERR_RANGE, "%s: %s has a gain of %g, wanted more than 0", place,
                         frame->file, frame->gain);
    if (frame->sha256[0])
        WEFT_TRY(check_sha256(frame->sha256, frame->file, place, err));
    for (int i = 0; i < set->n_frames; i++)
        if (strcmp(set->frames[i].file, frame->file) == 0)
            return weft_fail(err, WEFT_ERR_FORMAT, "%s: the file %s is listed twice", place, frame->file);
    return WEFT_OK;
}

static weft_err append_frame(weft_set *set, const weft_set_frame *frame, const char *place, weft_error *err)
{
    WEFT_TRY(check_frame(set, frame, place, err));
    char *const file = weft_strdup(frame->file, err);
    if (!file)
        return WEFT_ERR_NOMEM;
    weft_set_frame *const frames =
        weft_realloc(set->frames, (size_t)set->n_frames + 1, sizeof *set->frames, err);
    if (!frames) {
        weft_free(file);
        return WEFT_ERR_NOMEM;
    }
    set->frames = frames;
    frames[set->n_frames] = *frame;
    frames[set->n_frames].file = file;
    if (frame->role != WEFT_ROLE_LIGHT)
        frames[set->n_frames].light = -1;
    set->n_frames++;
    return WEFT_OK;
}

weft_err weft_set_add_frame(weft_set *set, const weft_set_frame *frame, weft_error *err)
{
    return append_frame(set, frame, set->folder, err);
}

/* ---- loading ---- */

static weft_err copy_text(const json_t *object, const char *key, char *to, size_t size, const char *place,
                          weft_error *err)
{
    const char *text = "";
    WEFT_TRY(weft_json_get_text(object, key, WEFT_JSON_OPTIONAL, &text, place, err));
    if (strlen(text) >= size)
        return weft_fail(err, WEFT_ERR_FORMAT, "%s: \"%s\" is longer than %zu letters", place, key, size - 1);
    snprintf(to, size, "%s", text);
    return WEFT_OK;
}

static weft_err read_camera(weft_set *set, const json_t *root, const char *place, weft_error *err)
{
    const json_t *camera;
    WEFT_TRY(weft_json_get_object(root, "camera", WEFT_JSON_OPTIONAL, &camera, place, err));
    if (!camera)
        return WEFT_OK;
    WEFT_TRY(copy_text(camera, "backend", set->camera_backend, sizeof set->camera_backend, place, err));
    WEFT_TRY(copy_text(camera, "model", set->camera_model, sizeof set->camera_model, place, err));
    return copy_text(camera, "serial", set->camera_serial, sizeof set->camera_serial, place, err);
}

/* "black" is a table of four, or one number for all. */
static weft_err read_black(weft_set *set, const json_t *sensor, const char *place, weft_error *err)
{
    if (!json_is_number(json_object_get(sensor, "black")))
        return weft_json_get_numbers(sensor, "black", WEFT_JSON_OPTIONAL, 4, set->black, place, err);
    WEFT_TRY(weft_json_get_number(sensor, "black", WEFT_JSON_OPTIONAL, 0, 1e9, &set->black[0], place, err));
    set->black[1] = set->black[2] = set->black[3] = set->black[0];
    return WEFT_OK;
}

/* As the capture engine measured it; without it readers find it from the pictures. */
static weft_err read_noise(weft_set *set, const json_t *sensor, const char *place, weft_error *err)
{
    const json_t *noise;
    WEFT_TRY(weft_json_get_object(sensor, "noise", WEFT_JSON_OPTIONAL, &noise, place, err));
    if (!noise)
        return WEFT_OK;
    WEFT_TRY(weft_json_get_number(noise, "read", WEFT_JSON_REQUIRED, 0, 1, &set->noise.read, place, err));
    WEFT_TRY(weft_json_get_number(noise, "shot", WEFT_JSON_REQUIRED, 0, 1, &set->noise.shot, place, err));
    WEFT_TRY(
        weft_json_get_number(noise, "gain", WEFT_JSON_REQUIRED, 1e-6, 1e5, &set->noise_gain, place, err));
    if (set->noise.read + set->noise.shot <= 0)
        return weft_fail(err, WEFT_ERR_RANGE, "%s: \"noise\" says that there is none; take it out", place);
    return WEFT_OK;
}

static weft_err read_sensor(weft_set *set, const json_t *root, const char *place, weft_error *err)
{
    const json_t *sensor;
    const char *cfa = NULL, *transfer = "srgb";
    const int most = WEFT_IMAGE_MAX_SIDE;
    WEFT_TRY(weft_json_get_object(root, "sensor", WEFT_JSON_REQUIRED, &sensor, place, err));
    WEFT_TRY(weft_json_get_int(sensor, "width", WEFT_JSON_REQUIRED, 1, most, &set->width, place, err));
    WEFT_TRY(weft_json_get_int(sensor, "height", WEFT_JSON_REQUIRED, 1, most, &set->height, place, err));
    WEFT_TRY(weft_json_get_text(sensor, "cfa", WEFT_JSON_REQUIRED, &cfa, place, err));
    if (!weft_cfa_from_name(cfa, &set->cfa))
        return weft_fail(err, WEFT_ERR_FORMAT, "%s: \"cfa\" is \"%s\", wanted RGGB, GRBG, GBRG, BGGR or none",
                         place, cfa);
    WEFT_TRY(read_black(set, sensor, place, err));
    WEFT_TRY(weft_json_get_number(sensor, "white", WEFT_JSON_OPTIONAL, 0, 1e9, &set->white, place, err));
    for (int i = 0; i < 4; i++)
        if (!(set->black[i] >= 0) || (set->white > 0 && set->black[i] >= set->white))
            return weft_fail(err, WEFT_ERR_RANGE, "%s: black level %g, wanted 0 to below white (%g)", place,
                             set->black[i], set->white);
    WEFT_TRY(read_noise(set, sensor, place, err));
    WEFT_TRY(weft_json_get_text(sensor, "transfer", WEFT_JSON_OPTIONAL, &transfer, place, err));
    if (strcmp(transfer, "srgb") != 0 && strcmp(transfer, "linear") != 0)
        return weft_fail(err, WEFT_ERR_FORMAT, "%s: \"transfer\" is \"%s\", wanted linear or srgb", place,
                         transfer);
    set->transfer = *transfer == 's' ? WEFT_TRANSFER_SRGB : WEFT_TRANSFER_LINEAR;
    return WEFT_OK;
}

static weft_err read_role(const json_t *object, weft_frame_role *role, const char *place, weft_error *err)
{
    const char *text = NULL;
    WEFT_TRY(weft_json_get_text(object, "role", WEFT_JSON_REQUIRED, &text, place, err));
    for (size_t i = 0; i < sizeof role_names / sizeof role_names[0]; i++)
        if (strcmp(text, role_names[i]) == 0) {
            *role = (weft_frame_role)i;
            return WEFT_OK;
        }
    return weft_fail(err, WEFT_ERR_FORMAT, "%s: \"role\" is \"%s\", wanted light, ambient, dark or all",
                     place, text);
}

static weft_err read_frame(weft_set *set, json_t *object, int index, const char *path, weft_error *err)
{
    char place[512];
    weft_set_frame frame = {.light = -1, .gain = 1};
    const char *file = NULL, *sha256 = "";
    snprintf(place, sizeof place, "%s: frame %d", path, index);
    if (!json_is_object(object))
        return weft_fail(err, WEFT_ERR_FORMAT, "%s: is not an object", place);
    WEFT_TRY(weft_json_get_text(object, "file", WEFT_JSON_REQUIRED, &file, place, err));
    WEFT_TRY(read_role(object, &frame.role, place, err));
    if (frame.role == WEFT_ROLE_LIGHT)
        WEFT_TRY(weft_json_get_int(object, "light", WEFT_JSON_REQUIRED, 0, MAX_LIGHTS - 1, &frame.light,
                                   place, err));
    WEFT_TRY(weft_json_get_number(object, "exposure_s", WEFT_JSON_REQUIRED, 0, 1e5, &frame.exposure_s, place,
                                  err));
    WEFT_TRY(weft_json_get_number(object, "gain", WEFT_JSON_OPTIONAL, 0, 1e5, &frame.gain, place, err));
    WEFT_TRY(weft_json_get_text(object, "sha256", WEFT_JSON_OPTIONAL, &sha256, place, err));
    if (*sha256)
        WEFT_TRY(check_sha256(sha256, file, place, err));
    snprintf(frame.sha256, sizeof frame.sha256, "%s", sha256);
    char *const name = weft_strdup(file, err);
    if (!name)
        return WEFT_ERR_NOMEM;
    frame.file = name;
    frame.capture = json_incref(json_object_get(object, "capture"));
    const weft_err status = append_frame(set, &frame, path, err);
    if (status != WEFT_OK)
        json_decref(frame.capture);
    weft_free(name);
    return status;
}

static weft_err read_frames(weft_set *set, const json_t *root, const char *path, weft_error *err)
{
    const json_t *frames;
    WEFT_TRY(weft_json_get_array(root, "frames", WEFT_JSON_REQUIRED, &frames, path, err));
    for (size_t i = 0; i < json_array_size(frames); i++)
        WEFT_TRY(read_frame(set, json_array_get(frames, i), (int)i, path, err));
    return WEFT_OK;
}

static weft_err read_state(weft_set *set, const json_t *root, const char *path, weft_error *err)
{
    const char *state = NULL;
    WEFT_TRY(weft_json_get_text(root, "state", WEFT_JSON_REQUIRED, &state, path, err));
    set->complete = strcmp(state, "complete") == 0;
    if (!set->complete && strcmp(state, "capturing") != 0)
        return weft_fail(err, WEFT_ERR_FORMAT, "%s: \"state\" is \"%s\", wanted capturing or complete", path,
                         state);
    return WEFT_OK;
}

static void delete_keys(json_t *object, const char *const *keys)
{
    for (; *keys; keys++)
        json_object_del(object, *keys);
}

/* What is left of the file when all that is known is taken out; NULL when nothing is. */
static json_t *take_unknown(json_t *root)
{
    json_t *const camera = json_object_get(root, "camera"), *const sensor = json_object_get(root, "sensor");
    delete_keys(root, top_keys);
    delete_keys(camera, camera_keys);
    delete_keys(sensor, sensor_keys);
    if (json_object_size(camera) == 0)
        json_object_del(root, "camera");
    if (json_object_size(sensor) == 0)
        json_object_del(root, "sensor");
    return json_object_size(root) ? json_incref(root) : NULL;
}

static weft_err read_set(weft_set *set, json_t *root, const char *path, weft_error *err)
{
    const char *name = "", *mask = NULL;
    WEFT_TRY(weft_json_get_text(root, "name", WEFT_JSON_OPTIONAL, &name, path, err));
    WEFT_TRY(copy_text(root, "created", set->created, sizeof set->created, path, err));
    WEFT_TRY(read_camera(set, root, path, err));
    WEFT_TRY(read_sensor(set, root, path, err));
    WEFT_TRY(read_frames(set, root, path, err));
    WEFT_TRY(read_state(set, root, path, err));
    WEFT_TRY(weft_json_get_text(root, "mask", WEFT_JSON_OPTIONAL, &mask, path, err));
    if (mask) {
        WEFT_TRY(check_file_name(mask, path, err));
        if (!(set->mask_file = weft_strdup(mask, err)))
            return WEFT_ERR_NOMEM;
    }
    if (!(set->name = weft_strdup(name, err)))
        return WEFT_ERR_NOMEM;
    set->other = take_unknown(root);
    return WEFT_OK;
}

weft_err weft_set_load(const char *folder, weft_set *set, weft_error *err)
{
    weft_set loaded = {0};
    json_t *root = NULL;
    char *path = NULL, *parent = NULL;
    weft_err status = WEFT_ERR_NOMEM;
    const bool is_file = strcmp(weft_path_name(folder), "set.json") == 0 && !weft_folder_exists(folder);
    parent = is_file ? weft_path_folder(folder, err) : weft_strdup(folder, err);
    path = parent ? weft_path_join(parent, "set.json", err) : NULL;
    if (!path || (status = weft_set_init(&loaded, parent, err)) != WEFT_OK)
        goto out;
    if (!weft_file_exists(path)) {
        status =
            weft_fail(err, WEFT_ERR_MISSING,
                      "%s: holds no set.json; give a folder made by weft capture or weft import", parent);
        goto out;
    }
    status = weft_json_load_kind(path, "set", WEFT_SET_VERSION, &root, err);
    if (status == WEFT_OK)
        status = read_set(&loaded, root, path, err);
out:
    json_decref(root);
    weft_free(path);
    weft_free(parent);
    if (status == WEFT_OK)
        *set = loaded;
    else
        weft_set_fini(&loaded);
    return status;
}

/* ---- saving ---- */

json_t *weft_set_frame_to_json(const weft_set_frame *frame)
{
    json_t *const object =
        json_pack("{s:s, s:s}", "file", frame->file, "role", weft_frame_role_name(frame->role));
    if (!object)
        return NULL;
    if (frame->role == WEFT_ROLE_LIGHT)
        json_object_set_new(object, "light", json_integer(frame->light));
    json_object_set_new(object, "exposure_s", json_real(frame->exposure_s));
    json_object_set_new(object, "gain", json_real(frame->gain));
    if (frame->sha256[0])
        json_object_set_new(object, "sha256", json_string(frame->sha256));
    if (frame->capture)
        json_object_set(object, "capture", frame->capture);
    return object;
}

json_t *weft_set_sensor_to_json(const weft_set *set)
{
    json_t *const sensor = json_pack("{s:i, s:i, s:s}", "width", set->width, "height", set->height, "cfa",
                                     weft_cfa_name(set->cfa));
    if (sensor && set->white > 0) {
        json_object_set_new(sensor, "black", weft_json_numbers(set->black, 4));
        json_object_set_new(sensor, "white", json_real(set->white));
    }
    if (sensor && set->noise_gain > 0)
        json_object_set_new(sensor, "noise",
                            json_pack("{s:f, s:f, s:f}", "read", set->noise.read, "shot", set->noise.shot,
                                      "gain", set->noise_gain));
    if (sensor && set->cfa == WEFT_CFA_NONE)
        json_object_set_new(sensor, "transfer",
                            json_string(set->transfer == WEFT_TRANSFER_SRGB ? "srgb" : "linear"));
    return sensor;
}

/* The object, with what the file had of keys that we do not know. */
static json_t *with_unknown(json_t *object, const weft_set *set, const char *key)
{
    json_t *const unknown = json_object_get(set->other, key);
    if (object && json_is_object(unknown))
        json_object_update_missing(object, unknown);
    return object;
}

static json_t *describe(const weft_set *set)
{
    json_t *const frames = json_array();
    for (int i = 0; i < set->n_frames; i++)
        json_array_append_new(frames,
                              weft_set_frame_to_json(&set->frames[i])); /* names were checked: not NULL */
    json_t *const camera = json_pack("{s:s, s:s, s:s}", "backend", set->camera_backend, "model",
                                     set->camera_model, "serial", set->camera_serial);
    json_t *const root = json_pack("{s:s, s:i, s:s, s:s, s:o, s:o, s:o, s:s}", "weft", "set", "version",
                                   WEFT_SET_VERSION, "name", set->name ? set->name : "", "created",
                                   set->created, "camera", with_unknown(camera, set, "camera"), "sensor",
                                   with_unknown(weft_set_sensor_to_json(set), set, "sensor"), "frames",
                                   frames, "state", set->complete ? "complete" : "capturing");
    if (root && set->mask_file)
        json_object_set_new(root, "mask", json_string(set->mask_file));
    if (root && set->other)
        json_object_update_missing(root, set->other);
    return root;
}

weft_err weft_set_save(const weft_set *set, weft_error *err)
{
    char *const path = weft_path_join(set->folder, "set.json", err);
    if (!path)
        return WEFT_ERR_NOMEM;
    json_t *const root = describe(set);
    const weft_err status =
        root ? weft_json_save(path, root, err)
             : weft_fail(err, WEFT_ERR_FORMAT, "%s: a name or text in it is not valid UTF-8", path);
    json_decref(root);
    weft_free(path);
    return status;
}

/* ---- asking ---- */

double weft_set_frame_time(const weft_set_frame *frame)
{
    return frame->exposure_s * frame->gain;
}

int weft_set_frame_mean_of(const weft_set_frame *frame)
{
    const json_t *const n = json_object_get(frame->capture, "mean_of");
    return json_integer_value(n) > 1 && json_integer_value(n) <= 65536 ? (int)json_integer_value(n) : 1;
}

int weft_set_n_lights(const weft_set *set)
{
    int n = 0;
    for (int i = 0; i < set->n_frames; i++)
        if (set->frames[i].role == WEFT_ROLE_LIGHT && set->frames[i].light >= n)
            n = set->frames[i].light + 1;
    return n;
}

static bool has_light(const weft_set *set, int light)
{
    for (int i = 0; i < set->n_frames; i++)
        if (set->frames[i].role == WEFT_ROLE_LIGHT && set->frames[i].light == light)
            return true;
    return false;
}

weft_err weft_set_require_lights(const weft_set *set, weft_error *err)
{
    const int n = weft_set_n_lights(set);
    if (n == 0)
        return weft_fail(err, WEFT_ERR_MISSING,
                         "%s: has no frame of any light; take it again with weft capture", set->folder);
    for (int light = 0; light < n; light++)
        if (!has_light(set, light))
            return weft_fail(err, WEFT_ERR_MISSING,
                             "%s: light %d has no frame; take it with weft capture --resume %s", set->folder,
                             light, set->folder);
    if (!set->complete)
        return weft_fail(err, WEFT_ERR_MISSING,
                         "%s: its capture was interrupted; finish it with weft capture --resume %s",
                         set->folder, set->folder);
    return WEFT_OK;
}

char *weft_set_frame_path(const weft_set *set, int frame, weft_error *err)
{
    return weft_path_join(set->folder, set->frames[frame].file, err);
}
