#include "calibration/lights/white_sheet_file.h"

#include "calibration/calibration_grid.h"
#include "calibration/lens/lens_model.h"
#include "calibration/lights/light_model.h"
#include "core/file.h"
#include "core/formats/exr_file.h"
#include "core/mem.h"

#include <math.h>
#include <string.h>

weft_err weft_white_sheet_save(const char *folder, const weft_white_sheet *sheet, weft_error *err)
{
    weft_light_channels channels;
    const int n = 3 * sheet->n_lights;
    const weft_image image = {sheet->columns, sheet->rows, n, sheet->value};
    char *const path = weft_path_join(folder, WEFT_WHITE_SHEET_FILE, err);
    weft_light_channels_name(&channels, n);
    const weft_err status =
        path ? weft_exr_write(path, &image, channels.names, WEFT_EXR_FLOAT, err) : WEFT_ERR_NOMEM;
    weft_free(path);
    return status;
}

weft_err weft_white_sheet_load(const char *folder, const weft_calibration *cal, weft_white_sheet *sheet,
                               weft_error *err)
{
    weft_light_channels channels;
    weft_image image = {0};
    weft_white_sheet made = {0};
    char *const path = weft_path_join(folder, WEFT_WHITE_SHEET_FILE, err);
    weft_light_channels_name(&channels, 3 * cal->n_lights);
    weft_err status =
        path ? weft_exr_read(path, channels.names, 3 * cal->n_lights, &image, err) : WEFT_ERR_NOMEM;
    if (status == WEFT_OK)
        status = weft_white_sheet_init(&made, cal->camera.width, cal->camera.height, cal->n_lights, err);
    if (status == WEFT_OK && (image.width != made.columns || image.height != made.rows))
        status = weft_fail(err, WEFT_ERR_MISMATCH, "%s: has %d x %d cells, the calibration's frames %d x %d",
                           path, image.width, image.height, made.columns, made.rows);
    if (status == WEFT_OK) {
        memcpy(made.value, image.data,
               weft_image_plane_size(&image) * (size_t)image.planes * sizeof *made.value);
        *sheet = made;
    } else
        weft_white_sheet_fini(&made);
    weft_image_fini(&image);
    weft_free(path);
    return status;
}

double weft_white_sheet_predict(const weft_white_sheet *sheet, const weft_calibration *cal,
                                const weft_sheet_kind *kind, int light, int channel, int column, int row,
                                bool with_grid)
{
    const double u = weft_white_sheet_centre(sheet, column), v = weft_white_sheet_centre(sheet, row);
    weft_vec3 world, to_light;
    if (!weft_camera_to_plane(&cal->camera, u, v, kind->height_mm, &world))
        return (double)NAN;
    const double strength = weft_light_at(&cal->lights[light], world, &to_light) * fmax(to_light.z, 0);
    const double gain = with_grid ? weft_light_grid_gain(cal, light, channel, u, v) : 1;
    return kind->reflectance * cal->lights[light].intensity[channel] * strength * gain;
}
