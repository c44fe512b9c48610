#include "host/set/import.h"

#include "core/file.h"
#include "core/formats/image_file.h"
#include "core/formats/png_file.h"
#include "core/formats/raw_file.h"
#include "core/log.h"
#include "core/mem.h"
#include "core/progress.h"
#include "core/sha256.h"
#include "host/set/frame_file.h"
#include "host/set/import_list.h"
#include "host/set/set.h"

#include <dirent.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* ---- what lies there ---- */

static bool is_lp(const char *name)
{
    return weft_path_has_suffix(name, ".lp");
}

static weft_err read_only_lp(const char *folder, weft_import_list *list, bool *found, weft_error *err)
{
    char **names = NULL;
    int n = 0;
    WEFT_TRY(weft_import_list_names(folder, is_lp, &names, &n, err));
    weft_err status = WEFT_OK;
    if (n > 1)
        status =
            weft_fail(err, WEFT_ERR_USAGE, "%s holds %d .lp files (name the one that is meant)", folder, n);
    if (n == 1) {
        char *const path = weft_path_join(folder, names[0], err);
        status = path ? weft_import_read_lp(path, list, err) : WEFT_ERR_NOMEM;
        weft_free(path);
    }
    *found = n == 1;
    for (int i = 0; i < n; i++)
        weft_free(names[i]);
    weft_free(names);
    return status;
}

static weft_err read_list(const char *path, weft_import_list *list, weft_error *err)
{
    bool found;
    if (!weft_file_exists(path) && !weft_folder_exists(path))
        return weft_fail(err, WEFT_ERR_MISSING, "%s is not there", path);
    if (!weft_folder_exists(path)) {
        if (is_lp(path))
            return weft_import_read_lp(path, list, err);
        return weft_fail(err, WEFT_ERR_USAGE, "%s is neither a folder nor an .lp file", path);
    }
    char *const directions = weft_path_join(path, "light_directions.txt", err);
    if (!directions)
        return WEFT_ERR_NOMEM;
    const bool has_directions = weft_file_exists(directions);
    weft_free(directions);
    if (has_directions)
        return weft_import_read_directions(path, list, err);
    WEFT_TRY(read_only_lp(path, list, &found, err));
    return found ? WEFT_OK : weft_import_read_raws(path, list, err);
}

/* ---- what the pictures are ---- */

static bool is_raster(const char *path)
{
    return weft_path_has_suffix(path, ".png") || weft_path_has_suffix(path, ".tif") ||
           weft_path_has_suffix(path, ".tiff");
}

static weft_err picture_size(const char *path, int *width, int *height, int *bits, weft_error *err)
{
    if (is_raster(path)) {
        weft_raster raster;
        WEFT_TRY(weft_path_has_suffix(path, ".png") ? weft_png_read(path, &raster, err)
                                                    : weft_tiff_read(path, &raster, err));
        *width = raster.width;
        *height = raster.height;
        *bits = raster.bits;
        weft_raster_fini(&raster);
        return WEFT_OK;
    }
    weft_image image;
    if (!weft_path_has_suffix(path, ".exr"))
        return weft_fail(err, WEFT_ERR_FORMAT, WEFT_FRAME_NOT_READ, path);
    WEFT_TRY(weft_image_read(path, WEFT_TRANSFER_LINEAR, &image, err));
    *width = image.width;
    *height = image.height;
    *bits = 0;
    weft_image_fini(&image);
    return WEFT_OK;
}

static weft_err check_size(const weft_import_list *list, int i, int width, int height,
                           const weft_import_result *result, weft_error *err)
{
    if (width == result->width && height == result->height)
        return WEFT_OK;
    return weft_fail(err, WEFT_ERR_MISMATCH, "%s has %d x %d pixels, %s has %d x %d", list->items[i].path,
                     width, height, list->items[0].path, result->width, result->height);
}

/* Says so when the pictures fit a matte surface clearly better under the other transfer. */
static void warn_of_transfer(const weft_import_result *r)
{
    const double as_is = r->srgb ? r->misfit_srgb : r->misfit_linear;
    const double other = r->srgb ? r->misfit_linear : r->misfit_srgb;
    if (as_is > 0 && other < 0.9 * as_is)
        weft_warn("taken as %s the pictures miss a matte surface by %.1f %%, as %s by %.1f %%: they look %s "
                  "(import again with --transfer %s)",
                  r->srgb ? "sRGB" : "linear", 100 * as_is, r->srgb ? "linear" : "sRGB", 100 * other,
                  r->srgb ? "linear" : "gamma-coded", r->srgb ? "linear" : "srgb");
    else if (r->bits == 8)
        weft_note("the 8-bit pictures are taken as %s (--transfer says otherwise)",
                  r->srgb ? "sRGB" : "linear");
}

static weft_err look_at_pictures(const weft_import_list *list, const weft_import_options *options,
                                 weft_import_result *result, weft_error *err)
{
    weft_progress progress;
    weft_err status = WEFT_OK;
    bool rasters = true;
    weft_progress_begin(&progress, "looking", "pictures", list->n);
    for (int i = 0; i < list->n && status == WEFT_OK; i++) {
        int width = 0, height = 0, bits = 0;
        status = picture_size(list->items[i].path, &width, &height, &bits, err);
        if (i == 0) {
            result->width = width;
            result->height = height;
            result->bits = bits;
        }
        rasters &= bits > 0;
        if (status == WEFT_OK)
            status = check_size(list, i, width, height, result, err);
        if (status == WEFT_OK)
            status = weft_progress_step(&progress, 1, err);
    }
    weft_progress_end(&progress);
    WEFT_TRY(status);
    result->srgb =
        options->transfer == WEFT_IMPORT_SRGB || (options->transfer == WEFT_IMPORT_AUTO && result->bits == 8);
    if (rasters && list->has_directions) {
        WEFT_TRY(weft_import_measure_misfit(list, &result->misfit_linear, &result->misfit_srgb, err));
        warn_of_transfer(result);
    }
    return WEFT_OK;
}

/* ---- writing ---- */

/* What set.json says of a file: its absolute path, or a copy's name in the set. */
static weft_err place(const char *source, const char *set_folder, const char *copy_name, bool copy,
                      char **entry, weft_error *err)
{
    if (!copy) {
        char *const real = realpath(source, NULL);
        if (!real)
            return weft_fail_errno(err, WEFT_ERR_IO, "%s cannot be read", source);
        *entry = weft_strdup(real, err);
        free(real);
        return *entry ? WEFT_OK : WEFT_ERR_NOMEM;
    }
    char *bytes = NULL;
    size_t n;
    char *const target = weft_path_join(set_folder, copy_name, err);
    weft_err status = target ? weft_file_read(source, (size_t)1 << 30, &bytes, &n, err) : WEFT_ERR_NOMEM;
    if (status == WEFT_OK)
        status = weft_file_write(target, bytes, n, err);
    weft_free(bytes);
    weft_free(target);
    if (status != WEFT_OK)
        return status;
    *entry = weft_strdup(copy_name, err);
    return *entry ? WEFT_OK : WEFT_ERR_NOMEM;
}

static const char *suffix_of(const char *path)
{
    const char *const dot = strrchr(weft_path_name(path), '.');
    return dot ? dot : "";
}

static weft_err add_frame(weft_set *set, const weft_import_list *list, int i, bool copy, weft_error *err)
{
    char name[64];
    weft_set_frame frame = {.role = WEFT_ROLE_LIGHT, .light = i, .exposure_s = 1, .gain = 1};
    snprintf(name, sizeof name, "light-%02d%.16s", i, suffix_of(list->items[i].path));
    WEFT_TRY(weft_sha256_file(list->items[i].path, frame.sha256, err));
    if (strcmp(list->kind, "raw") == 0) {
        weft_mosaic mosaic;
        weft_frame_info info;
        WEFT_TRY(weft_raw_read(list->items[i].path, &mosaic, &info, err));
        weft_mosaic_fini(&mosaic);
        frame.exposure_s = info.exposure_s > 0 ? info.exposure_s : 1;
        frame.gain = info.gain > 0 ? info.gain : 1;
    }
    weft_err status = place(list->items[i].path, set->folder, name, copy, &frame.file, err);
    if (status == WEFT_OK)
        status = weft_set_add_frame(set, &frame, err);
    weft_free(frame.file);
    return status;
}

static weft_err describe_sensor(weft_set *set, const weft_import_list *list, weft_import_result *result,
                                weft_error *err)
{
    if (strcmp(list->kind, "raw") == 0) {
        weft_mosaic mosaic;
        weft_frame_info info;
        WEFT_TRY(weft_raw_read(list->items[0].path, &mosaic, &info, err));
        result->width = mosaic.width;
        result->height = mosaic.height;
        set->cfa = mosaic.cfa;
        for (int i = 0; i < 4; i++)
            set->black[i] = (double)mosaic.black[i];
        set->white = (double)mosaic.white;
        snprintf(set->camera_model, sizeof set->camera_model, "%s", info.model);
        snprintf(set->camera_serial, sizeof set->camera_serial, "%s", info.serial);
        weft_mosaic_fini(&mosaic);
    } else {
        set->cfa = WEFT_CFA_NONE;
        set->white = 0; /* the files say where they end; EXR does not */
    }
    set->width = result->width;
    set->height = result->height;
    set->transfer = result->srgb ? WEFT_TRANSFER_SRGB : WEFT_TRANSFER_LINEAR;
    return WEFT_OK;
}

/* NAME of a path NAME.set, on the heap. */
static char *stem_of(const char *path, weft_error *err)
{
    size_t n = strlen(path);
    while (n > 1 && path[n - 1] == '/')
        n--;
    if (n > 4 && strncmp(path + n - 4, ".set", 4) == 0)
        n -= 4;
    return weft_asprintf(err, "%.*s", (int)n, path);
}

static weft_err fill_set(weft_set *set, const char *name, const weft_import_list *list, bool copy,
                         weft_import_result *result, weft_error *err)
{
    weft_progress progress;
    weft_free(set->name);
    set->name = weft_strdup(name, err);
    if (!set->name)
        return WEFT_ERR_NOMEM;
    weft_time_now_iso(set->created);
    snprintf(set->camera_backend, sizeof set->camera_backend, "import");
    WEFT_TRY(describe_sensor(set, list, result, err));
    weft_err status = WEFT_OK;
    weft_progress_begin(&progress, copy ? "copying" : "hashing", "pictures", list->n);
    for (int i = 0; i < list->n && status == WEFT_OK; i++) {
        status = add_frame(set, list, i, copy, err);
        if (status == WEFT_OK)
            status = weft_progress_step(&progress, 1, err);
    }
    weft_progress_end(&progress);
    if (status == WEFT_OK && list->mask)
        status = place(list->mask, set->folder, "mask.png", copy, &set->mask_file, err);
    set->complete = true;
    return status == WEFT_OK ? weft_set_save(set, err) : status;
}

static weft_err write_set(const char *set_folder, const weft_import_list *list,
                          const weft_import_options *options, weft_import_result *result, weft_error *err)
{
    weft_atomic folder = {0};
    weft_set set = {0};
    char *const stem = stem_of(set_folder, err);
    if (!stem)
        return WEFT_ERR_NOMEM;
    weft_err status = weft_atomic_folder_begin(&folder, set_folder, options->force, err);
    if (status == WEFT_OK)
        status = weft_set_init(&set, folder.temp_path, err);
    if (status == WEFT_OK)
        status = fill_set(&set, weft_path_name(stem), list, options->copy, result, err);
    weft_set_fini(&set);
    weft_free(stem);
    if (status == WEFT_OK)
        return weft_atomic_commit(&folder, err);
    weft_atomic_abort(&folder);
    return status;
}

static weft_err write_calibration(const char *cal_folder, const weft_import_list *list, bool force,
                                  weft_error *err)
{
    weft_calibration cal;
    weft_calibration_init(&cal);
    weft_time_now_iso(cal.created);
    cal.has_lights = true;
    cal.n_lights = list->n;
    for (int i = 0; i < list->n; i++) {
        weft_light *const light = &cal.lights[i];
        *light = (weft_light){.distant = true, .direction = list->items[i].direction, .exponent = 1};
        light->axis = weft_scale(light->direction, -1);
        for (int c = 0; c < 3; c++) {
            light->intensity[c] = list->items[i].intensity[c];
            light->white_balance[c] = list->items[i].intensity[1] / list->items[i].intensity[c];
        }
    }
    weft_err status = force ? weft_folder_remove(cal_folder, err) : WEFT_OK;
    if (status == WEFT_OK)
        status = weft_calibration_save(cal_folder, &cal, err);
    weft_calibration_fini(&cal);
    return status;
}

static weft_err import_list(const weft_import_list *list, const char *set_folder, const char *cal_folder,
                            const weft_import_options *options, weft_import_result *result, weft_error *err)
{
    result->kind = list->kind;
    result->n_lights = list->n;
    result->has_calibration = list->has_directions;
    if (list->has_directions && list->n < 3)
        return weft_fail(err, WEFT_ERR_NODATA, "%d lights are too few: a normal needs three", list->n);
    if (list->has_directions)
        WEFT_TRY(look_at_pictures(list, options, result, err));
    WEFT_TRY(write_set(set_folder, list, options, result, err));
    if (!list->has_directions) {
        weft_note("the raws say nothing about the lights: no calibration is written");
        return WEFT_OK;
    }
    return write_calibration(cal_folder, list, options->force, err);
}

weft_err weft_import(const char *path, const char *set_folder, const char *cal_folder,
                     const weft_import_options *options, weft_import_result *result, weft_error *err)
{
    weft_import_list list = {0};
    char *const stem = stem_of(set_folder, err);
    char *const cal = !stem        ? NULL
                      : cal_folder ? weft_strdup(cal_folder, err)
                                   : weft_asprintf(err, "%s.cal", stem);
    weft_err status = cal ? weft_file_refuse_existing(set_folder, options->force, err) : WEFT_ERR_NOMEM;
    if (status == WEFT_OK)
        status = weft_file_refuse_existing(cal, options->force, err);
    if (status == WEFT_OK)
        status = read_list(path, &list, err);
    weft_import_result done = {0};
    if (status == WEFT_OK)
        status = import_list(&list, set_folder, cal, options, &done, err);
    if (status == WEFT_OK)
        *result = done;
    weft_import_list_fini(&list);
    weft_free(cal);
    weft_free(stem);
    return status;
}
