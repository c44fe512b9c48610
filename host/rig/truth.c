/* Writes the true calibration and the true maps. */
#include "core/file.h"
#include "core/mem.h"
#include "core/version.h"
#include "host/rig/stage.h"
#include "host/set/maps.h"

#include <string.h>

/* Nodes of the light grid: the vignetting is smooth, so linear steps of 1/63 of the frame are exact to 1e-5.
 */
#define GRID_COLUMNS 64
#define GRID_ROWS    42

static weft_err fill_grid(const weft_rig_scene *scene, weft_light_grid *grid, weft_error *err)
{
    const size_t plane = (size_t)GRID_COLUMNS * GRID_ROWS;
    *grid = (weft_light_grid){.columns = GRID_COLUMNS, .rows = GRID_ROWS};
    grid->gain = weft_alloc(plane * 3 * WEFT_RIG_N_LIGHTS, sizeof *grid->gain, err);
    if (!grid->gain)
        return WEFT_ERR_NOMEM;
    for (int j = 0; j < GRID_ROWS; j++)
        for (int i = 0; i < GRID_COLUMNS; i++) {
            const double u = i * (scene->camera.width - 1.0) / (GRID_COLUMNS - 1);
            const double v = j * (scene->camera.height - 1.0) / (GRID_ROWS - 1);
            const float gain = (float)weft_rig_vignetting(scene, u, v);
            for (size_t k = 0; k < (size_t)3 * WEFT_RIG_N_LIGHTS; k++)
                grid->gain[k * plane + (size_t)j * GRID_COLUMNS + (size_t)i] = gain;
        }
    return WEFT_OK;
}

weft_err weft_rig_truth_calibration(const weft_rig_scene *scene, const char *path, weft_error *err)
{
    weft_calibration cal;
    weft_calibration_init(&cal);
    weft_time_now_iso(cal.created);
    cal.has_camera = true;
    cal.camera = scene->camera;
    cal.has_linearity = true;
    cal.linearity = (weft_linearity){.range = {0, 1}};
    cal.has_lights = true;
    cal.n_lights = WEFT_RIG_N_LIGHTS;
    memcpy(cal.lights, scene->lights, sizeof scene->lights);
    weft_err status = fill_grid(scene, &cal.grid, err);
    if (status == WEFT_OK)
        status = weft_calibration_save(path, &cal, err);
    weft_calibration_fini(&cal);
    return status;
}

static weft_err write_maps(const weft_rig_stage *stage, const weft_rig_view *view, double mm_per_px,
                           const char *path, weft_error *err)
{
    const weft_rig_scene *const scene = weft_rig_stage_scene(stage);
    const weft_rig_sample *const sample = weft_rig_stage_sample(stage);
    weft_rig_truth truth = {0};
    weft_maps maps = {
        .width = view->ground.width,
        .height = view->ground.height,
        .geometry = mm_per_px > 0 ? WEFT_GEOMETRY_PLANE : WEFT_GEOMETRY_SENSOR,
        .mm_per_px = mm_per_px,
        .albedo_is_srgb = true,
    };
    if (mm_per_px > 0) {
        maps.origin_mm[0] = (double)weft_image_row(&view->ground, 0, 0)[0];
        maps.origin_mm[1] = (double)weft_image_row(&view->ground, 1, 0)[0];
    }
    maps.info = json_pack("{s:s, s:s, s:I, s:i, s:s}", "truth of", sample->name, "made by",
                          "weft-rig " WEFT_VERSION, "seed", (json_int_t)scene->setup.seed, "supersample",
                          scene->setup.supersample, "rays", "from the camera");
    weft_err status = maps.info ? WEFT_OK : weft_fail(err, WEFT_ERR_NOMEM, "out of memory");
    if (status == WEFT_OK)
        status = weft_rig_truth_maps(scene, view, sample, &truth, err);
    maps.normal = truth.normal;
    maps.albedo = truth.albedo;
    maps.alpha = truth.alpha;
    maps.flaws = truth.flaws;
    if (status == WEFT_OK)
        status = weft_maps_save(path, &maps, false, err);
    weft_maps_fini(&maps);
    return status;
}

weft_err weft_rig_truth_write(const weft_rig_stage *stage, const char *folder, double mm_per_px,
                              weft_error *err)
{
    static const char *const names[3] = {"truth.cal", "sensor.maps", "plane.maps"};
    char *paths[3] = {NULL};
    weft_rig_view plane = {0};
    weft_err status = weft_folder_create(folder, err);
    for (int i = 0; i < 3 && status == WEFT_OK; i++) {
        paths[i] = weft_path_join(folder, names[i], err);
        status = paths[i] ? weft_file_refuse_existing(paths[i], false, err) : WEFT_ERR_NOMEM;
    }
    if (status == WEFT_OK)
        status = weft_rig_view_plane(&plane, weft_rig_stage_scene(stage), mm_per_px, err);
    if (status == WEFT_OK)
        status = weft_rig_truth_calibration(weft_rig_stage_scene(stage), paths[0], err);
    if (status == WEFT_OK)
        status = write_maps(stage, weft_rig_stage_view(stage), 0, paths[1], err);
    if (status == WEFT_OK)
        status = write_maps(stage, &plane, mm_per_px, paths[2], err);
    weft_rig_view_fini(&plane);
    for (int i = 0; i < 3; i++)
        weft_free(paths[i]);
    return status;
}
