/**
 * Solved maps against the photographs they came from: each light of a set is rendered again, and the two
 * pictures compared.
 *
 * Both pictures are linear and show what a white sheet in the sample's place would make even: the photograph
 * is divided by the calibrated strength of the lamp at every pixel and put through the colour model, the
 * rendering is pi f(l, v) (n.l) with l and v from the calibrated positions.  Both then get back the lamp's
 * own falloff, relative to its brightest place.  Only the lamp's direct light is rendered: shadows that the
 * relief throws and light from yarn to yarn stay as differences, and are meant to.
 */
#ifndef WEFT_HOST_SOLVE_REMATCH_H
#define WEFT_HOST_SOLVE_REMATCH_H

#include "calibration/calibration.h"
#include "host/set/maps.h"
#include "host/solve/light_plates.h"
#include "shading/preview/preview.h"

/** How one light's two pictures agree, over the pixels with an answer that are not clipped. */
typedef struct weft_rematch_figures {
    int light;
    size_t n_pixels;
    double psnr_db;        /* of the sRGB codes 0..1, all channels, after the common exposure; 200 at most */
    double psnr_linear_db; /* of linear light, 1 is white after the common exposure */
    double ratio;          /* mean rendering over mean photograph, green */
} weft_rematch_figures;

/** A set ready to be matched; everything but the plates is borrowed. */
typedef struct weft_rematch {
    const weft_preview_surface *surface;
    const weft_maps *maps;
    const weft_set *set;
    weft_calibration cal; /* its lamps with the drift that the set's white strip shows */
    double height_mm;     /* of the surface over z = 0 */
    double exposure;      /* common factor: 99.9 % of the photographs' green values come below 1 */
    weft_light_plates plates;
} weft_rematch;

/**
 * Reads the set and settles the exposure.
 *
 * @param surface  of the maps: model, parameters and maps of parameters
 * @return what the readers say; WEFT_ERR_MISMATCH when maps, set and calibration do not belong together
 */
weft_err weft_rematch_init(weft_rematch *match, const weft_preview_surface *surface, const weft_maps *maps,
                           const weft_set *set, const weft_calibration *cal, const char *cal_folder,
                           double height_mm, weft_error *err);
void weft_rematch_fini(weft_rematch *match);

/**
 * Renders and compares one light.
 *
 * @param pictures  uninitialised; get the photograph and the rendering, 3 planes of the maps' size, linear,
 *                  exposed; 0 outside the mask
 */
weft_err weft_rematch_light(const weft_rematch *match, int light, weft_rematch_figures *figures,
                            weft_image pictures[2], weft_error *err);

#endif
