#include "calibration/calibration.h"

#include "calibration/calibration_grid.h"
#include "calibration/calibration_json.h"
#include "core/file.h"
#include "core/json.h"
#include "core/mem.h"

#include <stdio.h>
#include <string.h>
#include <unistd.h>

void weft_calibration_init(weft_calibration *cal)
{
    *cal = (weft_calibration){0};
}

void weft_calibration_fini(weft_calibration *cal)
{
    weft_free(cal->grid.gain);
    json_decref(cal->other);
    weft_calibration_init(cal);
}

static weft_err load_grid(const char *folder, const char *grid_file, weft_calibration *cal, weft_error *err)
{
    char *const path = weft_path_join(folder, grid_file, err);
    const weft_err status = path ? weft_calibration_grid_load(path, cal, err) : WEFT_ERR_NOMEM;
    weft_free(path);
    return status;
}

weft_err weft_calibration_load(const char *folder, weft_calibration *cal, weft_error *err)
{
    json_t *root = NULL;
    const char *grid_file = NULL;
    weft_calibration loaded = {0};
    char *const path = weft_path_join(folder, "calibration.json", err);
    if (!path)
        return WEFT_ERR_NOMEM;
    weft_err status;
    if (!weft_file_exists(path))
        status = weft_fail(err, WEFT_ERR_IO,
                           "%s: there is no calibration here; \"weft calibrate lens\" begins one", path);
    else
        status = weft_json_load_kind(path, "calibration", WEFT_CALIBRATION_VERSION, &root, err);
    if (status == WEFT_OK)
        status = weft_calibration_from_json(root, path, &loaded, &grid_file, err);
    if (status == WEFT_OK && grid_file)
        status = load_grid(folder, grid_file, &loaded, err);
    if (status == WEFT_OK)
        *cal = loaded;
    else
        weft_calibration_fini(&loaded);
    json_decref(root);
    weft_free(path);
    return status;
}

static bool same_grid(const weft_calibration *a, const weft_calibration *b)
{
    return a->grid.gain && b->grid.gain && a->n_lights == b->n_lights && a->grid.columns == b->grid.columns &&
           a->grid.rows == b->grid.rows &&
           memcmp(a->grid.gain, b->grid.gain, weft_calibration_grid_size(a) * sizeof *a->grid.gain) == 0;
}

/* The grid's file before and after a save. */
typedef struct grid_files {
    char name[256];  /* to be named by calibration.json; empty without a grid */
    char stale[256]; /* no longer named by it; empty when nothing becomes stale */
    bool unchanged;  /* `name` already holds these gains */
} grid_files;

static const char *const grid_names[] = {"light-grid.exr", "light-grid-b.exr"};

/*
 * A changed grid never takes the name which the present calibration.json refers to: until the new
 * calibration.json is in place the old pair must stay whole.
 */
static void choose_grid_file(const char *folder, const char *json_path, const weft_calibration *cal,
                             grid_files *files)
{
    json_t *root = NULL;
    const char *present = NULL;
    weft_calibration old = {0};
    *files = (grid_files){0};
    /* A calibration that cannot be read is replaced like one without a grid. */
    if (weft_json_load_kind(json_path, "calibration", WEFT_CALIBRATION_VERSION, &root, NULL) == WEFT_OK &&
        weft_calibration_from_json(root, json_path, &old, &present, NULL) == WEFT_OK && present &&
        strlen(present) < sizeof files->name) {
        files->unchanged = load_grid(folder, present, &old, NULL) == WEFT_OK && same_grid(&old, cal);
        snprintf(files->unchanged ? files->name : files->stale, sizeof files->name, "%s", present);
    }
    if (cal->grid.gain && !files->unchanged)
        snprintf(files->name, sizeof files->name, "%s", grid_names[strcmp(files->stale, grid_names[0]) == 0]);
    weft_calibration_fini(&old);
    json_decref(root);
}

/* Whether this module made the file; others' files in the folder are left alone. */
static bool is_own_grid(const char *name)
{
    return strcmp(name, grid_names[0]) == 0 || strcmp(name, grid_names[1]) == 0;
}

static weft_err save_grid(const char *folder, const char *name, const weft_calibration *cal, weft_error *err)
{
    char *const path = weft_path_join(folder, name, err);
    const weft_err status = path ? weft_calibration_grid_save(path, cal, err) : WEFT_ERR_NOMEM;
    weft_free(path);
    return status;
}

static void remove_stale(const char *folder, const grid_files *files)
{
    if (!is_own_grid(files->stale) || strcmp(files->stale, files->name) == 0)
        return;
    char *const path = weft_path_join(folder, files->stale, NULL);
    if (path)
        unlink(path); /* a file left behind does no harm */
    weft_free(path);
}

/* What is written must be what a reader takes: catches NaN and parts that a step left half filled. */
static weft_err check_readable(const json_t *root, const char *path, const weft_calibration *cal,
                               weft_error *err)
{
    weft_calibration again = {0};
    const char *grid_file;
    weft_err status = weft_calibration_from_json(root, path, &again, &grid_file, err);
    if (status == WEFT_OK &&
        (again.has_camera != cal->has_camera || again.has_linearity != cal->has_linearity ||
         again.has_lights != cal->has_lights || again.has_colour != cal->has_colour))
        status = weft_fail(err, WEFT_ERR_RANGE, "%s: a part holds a number that is not finite", path);
    weft_calibration_fini(&again);
    return status == WEFT_OK ? WEFT_OK : weft_prefix(err, status, "not written");
}

weft_err weft_calibration_save(const char *folder, const weft_calibration *cal, weft_error *err)
{
    grid_files files;
    char now[32];
    char *const path = weft_path_join(folder, "calibration.json", err);
    if (!path)
        return WEFT_ERR_NOMEM;
    choose_grid_file(folder, path, cal, &files);
    weft_time_now_iso(now);
    json_t *const root = weft_calibration_to_json(cal, cal->created[0] ? cal->created : now,
                                                  files.name[0] ? files.name : NULL);
    weft_err status = root ? check_readable(root, path, cal, err)
                           : weft_fail(err, WEFT_ERR_NOMEM, "%s: out of memory", path);
    if (status == WEFT_OK)
        status = weft_folder_create(folder, err);
    if (status == WEFT_OK && files.name[0] && !files.unchanged)
        status = save_grid(folder, files.name, cal, err);
    if (status == WEFT_OK)
        status = weft_json_save(path, root, err);
    if (status == WEFT_OK)
        remove_stale(folder, &files);
    json_decref(root);
    weft_free(path);
    return status;
}

weft_err weft_calibration_require(const weft_calibration *cal, unsigned parts, const char *folder,
                                  weft_error *err)
{
    const struct {
        unsigned part;
        bool present;
        const char *what, *command;
    } rows[] = {
        {WEFT_CALIBRATION_CAMERA, cal->has_camera, "no camera", "weft calibrate lens"},
        {WEFT_CALIBRATION_POSE, cal->has_camera && cal->camera.has_pose, "no camera pose",
         "weft calibrate lens --board-on-table IMAGE"},
        {WEFT_CALIBRATION_LIGHTS, cal->has_lights, "no lights", "weft calibrate lights"},
        {WEFT_CALIBRATION_COLOUR, cal->has_colour, "no colour matrix", "weft calibrate colour"},
        {WEFT_CALIBRATION_LINEARITY, cal->has_linearity, "no linearity check", "weft calibrate linearity"},
    };
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++)
        if ((parts & rows[i].part) && !rows[i].present)
            return weft_fail(err, WEFT_ERR_MISSING, "%s: has %s; make it with \"%s ... -o %s\"", folder,
                             rows[i].what, rows[i].command, folder);
    return WEFT_OK;
}

weft_err weft_calibration_require_size(const weft_calibration *cal, int width, int height, const char *folder,
                                       weft_error *err)
{
    if (!cal->has_camera || (cal->camera.width == width && cal->camera.height == height))
        return WEFT_OK;
    return weft_fail(err, WEFT_ERR_MISMATCH,
                     "%s: was made for frames of %dx%d, these are %dx%d; take them with the same camera "
                     "settings or calibrate again",
                     folder, cal->camera.width, cal->camera.height, width, height);
}
