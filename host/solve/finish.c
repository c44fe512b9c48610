#include "host/solve/finish.h"

#include "core/mem.h"
#include "host/solve/running_mean.h"
#include "shading/bake/height.h"
#include "shading/bake/height_poisson.h"

#include <math.h>

weft_err weft_maps_require_plane(const weft_maps *maps, const char *what, weft_error *err)
{
    return maps->geometry == WEFT_GEOMETRY_PLANE
               ? WEFT_OK
               : weft_fail(
                     err, WEFT_ERR_MISSING,
                     "%s needs maps of the plane, whose pixels are millimetres (a calibration with a camera, "
                     "and not --geometry sensor)",
                     what);
}

/* ---- flattening ---- */

enum { ROUNDS = 3 };

/* Slopes times weight, and the weight: means of both give the mean slope over what is answered. */
static void fill_slopes(const weft_maps *maps, weft_image *slopes)
{
    const size_t n = weft_image_plane_size(slopes);
    for (size_t i = 0; i < n; i++) {
        const bool known = !maps->mask.data || maps->mask.data[i];
        const double z = (double)weft_image_plane(&maps->normal, 2)[i];
        for (int c = 0; c < 2; c++)
            weft_image_plane(slopes, c)[i] =
                known ? (float)weft_height_slope((double)weft_image_plane(&maps->normal, c)[i], z) : 0;
        weft_image_plane(slopes, 2)[i] = known ? 1 : 0;
    }
}

static void take_off(weft_maps *maps, const weft_image *slow)
{
    const size_t n = weft_image_plane_size(slow);
    for (size_t i = 0; i < n; i++) {
        const double weight = (double)weft_image_plane(slow, 2)[i];
        if ((maps->mask.data && !maps->mask.data[i]) || !(weight > 0))
            continue;
        double slope[2];
        for (int c = 0; c < 2; c++)
            slope[c] = weft_height_slope((double)weft_image_plane(&maps->normal, c)[i],
                                         (double)weft_image_plane(&maps->normal, 2)[i]) -
                       (double)weft_image_plane(slow, c)[i] / weight;
        const double over = 1 / sqrt(1 + slope[0] * slope[0] + slope[1] * slope[1]);
        for (int c = 0; c < 2; c++)
            weft_image_plane(&maps->normal, c)[i] = (float)(-slope[c] * over);
        weft_image_plane(&maps->normal, 2)[i] = (float)over;
    }
}

weft_err weft_maps_flatten(weft_maps *maps, double wavelength_mm, weft_error *err)
{
    WEFT_TRY(weft_maps_require_plane(maps, "--flatten", err));
    /* a Gaussian of sigma has exp(-2 pi^2 sigma^2 / wavelength^2) left: 1/2 at sigma = 0.1874 wavelength;
     * three means over n pixels have the variance (n^2 - 1) / 4 */
    const double sigma_px = sqrt(log(2) / 2) / 3.141592653589793 * wavelength_mm / maps->mm_per_px;
    const int reach = (int)lround((sqrt(4 * sigma_px * sigma_px + 1) - 1) / 2);
    if (reach < 1)
        return weft_fail(err, WEFT_ERR_RANGE, "--flatten %g: less than four pixels of %.4g mm", wavelength_mm,
                         maps->mm_per_px);
    weft_image slopes;
    WEFT_TRY(weft_image_init(&slopes, maps->width, maps->height, 3, err));
    fill_slopes(maps, &slopes);
    const weft_err status = weft_running_mean(&slopes, reach, ROUNDS, err);
    if (status == WEFT_OK)
        take_off(maps, &slopes);
    weft_image_fini(&slopes);
    return status;
}

/* ---- height ---- */

/* Rises between neighbours of a picture that repeats; rows go down. */
static weft_err relax(const weft_maps *maps, weft_image *height, weft_error *err)
{
    const int w = maps->width, h = maps->height;
    const size_t n = (size_t)w * (size_t)h;
    double *const rises = weft_alloc(3 * n, sizeof *rises, err);
    if (!rises)
        return WEFT_ERR_NOMEM;
    double *const dx = rises, *const dy = rises + n, *const z = rises + 2 * n;
    const float *const nx = weft_image_plane(&maps->normal, 0),
                       *const ny = weft_image_plane(&maps->normal, 1),
                       *const nz = weft_image_plane(&maps->normal, 2);
    for (size_t i = 0; i < n; i++) {
        const size_t u = i % (size_t)w, right = i - u + (u + 1) % (size_t)w, below = (i + (size_t)w) % n;
        const bool here = nz[i] > 0;
        dx[i] = here && nz[right] > 0 ? maps->mm_per_px / 2 *
                                            (weft_height_slope((double)nx[i], (double)nz[i]) +
                                             weft_height_slope((double)nx[right], (double)nz[right]))
                                      : 0;
        dy[i] = here && nz[below] > 0 ? -maps->mm_per_px / 2 *
                                            (weft_height_slope((double)ny[i], (double)nz[i]) +
                                             weft_height_slope((double)ny[below], (double)nz[below]))
                                      : 0;
    }
    weft_err status = weft_height_from_slopes(w, h, dx, dy, 1e-4 * maps->mm_per_px, z, err);
    if (status == WEFT_OK)
        status = weft_image_init(height, w, h, 1, err);
    for (size_t i = 0; i < n && status == WEFT_OK; i++)
        height->data[i] = (float)z[i];
    weft_free(rises);
    return status;
}

/* Mean 0 over the answers, 0 elsewhere.  @return the rms */
static double settle(const weft_maps *maps, weft_image *height)
{
    const size_t n = weft_image_plane_size(height);
    double sum = 0, squares = 0;
    size_t count = 0;
    for (size_t i = 0; i < n; i++)
        if (!maps->mask.data || maps->mask.data[i]) {
            sum += (double)height->data[i];
            count++;
        }
    const double mean = count ? sum / (double)count : 0;
    for (size_t i = 0; i < n; i++) {
        const bool known = !maps->mask.data || maps->mask.data[i];
        height->data[i] = known ? (float)((double)height->data[i] - mean) : 0;
        squares += (double)height->data[i] * (double)height->data[i];
    }
    return count ? sqrt(squares / (double)count) : 0;
}

weft_err weft_maps_integrate(weft_maps *maps, weft_height_how how, weft_error *err)
{
    weft_image height = {0};
    weft_height_info info = {0};
    if (how == WEFT_HEIGHT_NONE)
        return WEFT_OK;
    WEFT_TRY(weft_maps_require_plane(maps, "--height", err));
    const float *const weight = maps->confidence.planes ? maps->confidence.data : NULL;
    WEFT_TRY(how == WEFT_HEIGHT_RELAX
                 ? relax(maps, &height, err)
                 : weft_height_integrate(&maps->normal, weight, maps->mm_per_px, false, &height, &info, err));
    weft_image_fini(&maps->height_mm);
    const double relief_mm = settle(maps, &height);
    maps->height_mm = height;
    json_t *const result = json_object_get(maps->info, "result");
    json_t *const note = json_pack("{s:s, s:f}", "method", how == WEFT_HEIGHT_RELAX ? "relax" : "poisson",
                                   "relief_mm", relief_mm);
    if (note && how == WEFT_HEIGHT_POISSON)
        json_object_set_new(note, "misfit", json_real(info.misfit));
    if (result && note)
        json_object_set(result, "height_map", note); /* "height" is the number of rows */
    json_decref(note);
    return WEFT_OK;
}
