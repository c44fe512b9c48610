#include "calibration/charts/chart_light.h"

#include "calibration/charts/homography.h"
#include "calibration/lens/lens_model.h"
#include "calibration/lights/light_model.h"

weft_err weft_chart_irradiance(const weft_calibration *cal, int light, const weft_chart *chart,
                               const weft_chart_pose *pose, double height_mm, double (*irradiance)[3],
                               weft_error *err)
{
    for (int p = 0; p < chart->columns * chart->rows; p++) {
        double x, y, u, v;
        weft_vec3 world, to_light;
        weft_chart_patch_centre(chart, p, &x, &y);
        if (!weft_homography_apply(&pose->to_pixel, x, y, &u, &v) ||
            !weft_camera_to_plane(&cal->camera, u, v, height_mm, &world))
            return weft_fail(err, WEFT_ERR_NODATA,
                             "patch \"%s\" does not lie on the sample plane of the calibration",
                             chart->patches[p].name);
        const double strength = weft_light_at(&cal->lights[light], world, &to_light) * to_light.z;
        if (!(strength > 0))
            return weft_fail(
                err, WEFT_ERR_NODATA,
                "patch \"%s\" gets no light from light %d of the calibration: calibrate the lights again",
                chart->patches[p].name, light);
        for (int c = 0; c < 3; c++)
            irradiance[p][c] = strength * weft_light_grid_gain(cal, light, c, u, v);
    }
    return WEFT_OK;
}
