#include "calibration/lens/lens_residuals.h"

#include "calibration/lens/lens_model.h"
#include "calibration/lens/lens_module.h"
#include "core/mem.h"

#include <string.h>

weft_err weft_lens_view_residuals(const weft_board *board, const weft_board_view *view,
                                  const weft_camera *camera, double *residuals, weft_error *err)
{
    const weft_lens_opencv *opencv;
    weft_lens_why why;
    const int n = board->columns * board->rows;
    double t[3], rms;
    weft_camera posed = *camera;
    WEFT_TRY(weft_lens_opencv_load(&opencv, err));
    float *const object = weft_alloc((size_t)n, 3 * sizeof *object, err);
    if (!object)
        return WEFT_ERR_NOMEM;
    for (int i = 0; i < n; i++) {
        object[3 * i] = (float)(board->square_mm * (i % board->columns));
        object[3 * i + 1] = (float)(-board->square_mm * (i / board->columns));
    }
    const int failed = opencv->solve_pose(n, object, view->corners,
                                          (const double[]){camera->fx, camera->fy, camera->cx, camera->cy},
                                          camera->distortion, posed.rotation.m, t, &rms, &why);
    posed.translation = (weft_vec3){t[0], t[1], t[2]};
    for (int i = 0; i < n && !failed; i++) {
        double *const r = residuals + 4 * (size_t)i, u = 0, v = 0;
        const weft_vec3 corner = {(double)object[3 * i], (double)object[3 * i + 1], 0};
        (void)weft_camera_project(&posed, corner, &u, &v);
        r[0] = (double)view->corners[2 * i];
        r[1] = (double)view->corners[2 * i + 1];
        r[2] = r[0] - u;
        r[3] = r[1] - v;
    }
    weft_free(object);
    return failed ? weft_fail(err, WEFT_ERR_NODATA, "%s: no pose of the board: %s", view->name, why.text)
                  : WEFT_OK;
}
