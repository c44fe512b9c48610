/** What is made of solved normals when asked for: flattened detail, height in millimetres. */
#ifndef WEFT_HOST_SOLVE_FINISH_H
#define WEFT_HOST_SOLVE_FINISH_H

#include "host/set/maps.h"

/** @param what  the option that needs them
 *  @return WEFT_ERR_MISSING for maps that are not of the plane */
weft_err weft_maps_require_plane(const weft_maps *maps, const char *what, weft_error *err);

/**
 * Takes slow bends off the normals: a high pass of the slopes -n_x/n_z, -n_y/n_z.
 *
 * The low pass is three running means over the answered pixels (a Gaussian in all but name); at the
 * wavelength given one half of a slope stays, at a tenth of it all of it.
 *
 * @param wavelength_mm  at least four pixels
 * @return WEFT_ERR_MISSING for maps that are not of the plane, WEFT_ERR_RANGE, WEFT_ERR_NOMEM
 */
weft_err weft_maps_flatten(weft_maps *maps, double wavelength_mm, weft_error *err);

typedef enum weft_height_how {
    WEFT_HEIGHT_NONE,
    WEFT_HEIGHT_POISSON, /* shading/bake/height_poisson.h, weighted by confidence */
    WEFT_HEIGHT_RELAX    /* shading/bake/height.h: grids of half the size; the picture is taken to repeat */
} weft_height_how;

/** Fills maps->height, mm, mean 0 over the answered pixels and 0 elsewhere, and notes relief and misfit under
 *  "result" of maps->info.  @return as above, WEFT_ERR_NODATA */
weft_err weft_maps_integrate(weft_maps *maps, weft_height_how how, weft_error *err);

#endif
