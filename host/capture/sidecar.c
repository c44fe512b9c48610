#include "host/capture/sidecar.h"

#include "core/file.h"
#include "core/formats/raw_file.h"
#include "core/json.h"
#include "core/mem.h"
#include "core/version.h"

#include <string.h>

static char *sidecar_path(const weft_set *set, int frame, weft_error *err)
{
    char *const path = weft_set_frame_path(set, frame, err);
    char *const made = path ? weft_asprintf(err, "%s" WEFT_SIDECAR_SUFFIX, path) : NULL;
    weft_free(path);
    return made;
}

static void set_text(json_t *object, const char *key, const char *text)
{
    if (text[0])
        json_object_set_new(object, key, json_string(text));
}

static void set_number(json_t *object, const char *key, double value)
{
    if (value > 0)
        json_object_set_new(object, key, json_real(value));
}

/* By the names that EXIF and DNG give them; what the file does not say is left out. */
static json_t *describe_tags(const weft_frame_info *info, const weft_mosaic *m)
{
    json_t *const tags = json_object();
    bool has_matrix = false;
    for (int i = 0; i < 9; i++)
        has_matrix |= info->xyz_to_camera[i] != 0;
    set_text(tags, "Make", info->make);
    set_text(tags, "Model", info->model);
    set_text(tags, "CameraSerialNumber", info->serial);
    set_text(tags, "DateTimeOriginal", info->date_time);
    set_number(tags, "ExposureTime", info->exposure_s);
    set_number(tags, "ISOSpeedRatings", info->iso);
    set_number(tags, "FNumber", info->f_number);
    if (info->as_shot_neutral[1] > 0)
        json_object_set_new(tags, "AsShotNeutral", weft_json_numbers(info->as_shot_neutral, 3));
    if (has_matrix)
        json_object_set_new(tags, "ColorMatrix1", weft_json_numbers(info->xyz_to_camera, 9));
    const double black[4] = {(double)m->black[0], (double)m->black[1], (double)m->black[2],
                             (double)m->black[3]};
    json_object_set_new(tags, "BlackLevel", weft_json_numbers(black, 4));
    json_object_set_new(tags, "WhiteLevel", json_real((double)m->white));
    json_object_set_new(tags, "CFAPattern", json_string(weft_cfa_name(m->cfa)));
    json_object_set_new(tags, "ImageWidth", json_integer(m->width));
    json_object_set_new(tags, "ImageLength", json_integer(m->height));
    return tags;
}

static weft_err read_tags(const char *path, json_t **tags, weft_error *err)
{
    weft_mosaic mosaic;
    weft_frame_info info = {0};
    WEFT_TRY(weft_raw_read(path, &mosaic, &info, err));
    *tags = describe_tags(&info, &mosaic);
    weft_mosaic_fini(&mosaic);
    return WEFT_OK;
}

static json_t *describe(const weft_set *set, int frame, json_t *tags)
{
    const json_t *const capture = json_object_get(set->other, "capture");
    json_t *const root =
        json_pack("{s:s, s:i, s:s, s:s, s:s, s:{s:s, s:s, s:s}, s:o, s:o, s:o*}", "weft", "frame", "version",
                  WEFT_SIDECAR_VERSION, "set", set->name ? set->name : "", "created", set->created,
                  "software", "weft " WEFT_VERSION, "camera", "backend", set->camera_backend, "model",
                  set->camera_model, "serial", set->camera_serial, "sensor", weft_set_sensor_to_json(set),
                  "frame", weft_set_frame_to_json(&set->frames[frame]), "tags", tags);
    if (root && json_object_get(capture, "controller"))
        json_object_set(root, "controller", json_object_get(capture, "controller"));
    return root;
}

weft_err weft_sidecar_write(const weft_set *set, int frame, weft_error *err)
{
    char *const raw = weft_set_frame_path(set, frame, err), *const path = sidecar_path(set, frame, err);
    weft_err status = raw && path ? WEFT_OK : WEFT_ERR_NOMEM;
    json_t *tags = NULL, *root = NULL;
    if (status == WEFT_OK)
        status = read_tags(raw, &tags, err);
    if (status == WEFT_OK) {
        root = describe(set, frame, tags);
        status = root ? weft_json_save(path, root, err)
                      : weft_fail(err, WEFT_ERR_FORMAT, "%s: a name or text in it is not valid UTF-8", path);
    }
    json_decref(root);
    weft_free(raw);
    weft_free(path);
    return status;
}

weft_err weft_sidecar_write_missing(const weft_set *set, weft_error *err)
{
    weft_err status = WEFT_OK;
    for (int i = 0; i < set->n_frames && status == WEFT_OK; i++) {
        char *const path = sidecar_path(set, i, err);
        if (!path)
            return WEFT_ERR_NOMEM;
        if (!weft_file_exists(path))
            status = weft_sidecar_write(set, i, err);
        weft_free(path);
    }
    return status;
}
