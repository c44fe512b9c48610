#include "calibration/calibration_grid.h"

#include "core/formats/exr_file.h"
#include "core/mem.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

void weft_light_channels_name(weft_light_channels *channels, int n)
{
    for (int i = 0; i < n; i++) {
        snprintf(channels->text[i], sizeof channels->text[i], "light%02d.%c", (i / 3) & 0xff, "RGB"[i % 3]);
        channels->names[i] = channels->text[i];
    }
}

size_t weft_calibration_grid_size(const weft_calibration *cal)
{
    return (size_t)cal->n_lights * 3 * (size_t)cal->grid.rows * (size_t)cal->grid.columns;
}

static weft_err check_gains(const float *gain, size_t n, const char *path, weft_error *err)
{
    for (size_t i = 0; i < n; i++)
        if (!(gain[i] > 0 && isfinite(gain[i])))
            return weft_fail(err, WEFT_ERR_RANGE,
                             "%s: gain %zu is %g, wanted above 0; make the grid again with \"weft calibrate "
                             "lights\"",
                             path, i, (double)gain[i]);
    return WEFT_OK;
}

weft_err weft_calibration_grid_load(const char *path, weft_calibration *cal, weft_error *err)
{
    weft_light_channels channels;
    weft_image image = {0};
    weft_light_channels_name(&channels, 3 * cal->n_lights);
    weft_err status = weft_exr_read(path, channels.names, 3 * cal->n_lights, &image, err);
    if (status == WEFT_OK && (image.width != cal->grid.columns || image.height != cal->grid.rows))
        status = weft_fail(err, WEFT_ERR_MISMATCH, "%s: is %dx%d, but calibration.json says %dx%d nodes",
                           path, image.width, image.height, cal->grid.columns, cal->grid.rows);
    const size_t n = weft_calibration_grid_size(cal);
    if (status == WEFT_OK)
        status = check_gains(image.data, n, path, err);
    if (status == WEFT_OK) {
        cal->grid.gain = weft_alloc(n, sizeof *cal->grid.gain, err);
        if (cal->grid.gain)
            memcpy(cal->grid.gain, image.data, n * sizeof *image.data);
        else
            status = WEFT_ERR_NOMEM;
    }
    weft_image_fini(&image);
    return status;
}

weft_err weft_calibration_grid_save(const char *path, const weft_calibration *cal, weft_error *err)
{
    weft_light_channels channels;
    weft_light_channels_name(&channels, 3 * cal->n_lights);
    const weft_image image = {cal->grid.columns, cal->grid.rows, 3 * cal->n_lights, cal->grid.gain};
    WEFT_TRY(check_gains(image.data, weft_calibration_grid_size(cal), path, err));
    return weft_exr_write(path, &image, channels.names, WEFT_EXR_FLOAT, err);
}
