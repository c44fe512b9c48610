/**
 * Photometric stereo: a set and a calibration make maps (docs/solving.md; S-ORD-17, S-ORD-18).
 */
#ifndef WEFT_HOST_SOLVE_SOLVE_H
#define WEFT_HOST_SOLVE_SOLVE_H

#include "host/set/maps.h"
#include "host/set/set.h"
#include "host/solve/incidence.h"
#include "host/solve/samples.h"

typedef struct weft_solve_options {
    const weft_solve_method *method; /* NULL: the first of the table */
    bool sensor_geometry;            /* false: the plane, where the calibration has a camera */
    bool plane_geometry;             /* true: the plane or nothing */
    bool half;                       /* a pixel for each 2x2 cell, from its luminance */
    bool linear;                     /* frames are demosaiced before they are solved: for comparison */
    bool matte;                      /* true: no mirror light is looked for */
    bool no_bounce;                  /* true: light from yarn to yarn is left in */
    double memory_bytes;             /* what may be used; 0: whatever is needed */
    double mm_per_px;                /* of the plane; 0: as the sensor at the middle */
    double height_mm;                /* of the sample's surface over the calibrated plane */
    double shadow; /* samples below this part of the pixel's brightest are left out; 0: no such rule */
} weft_solve_options;

/** Where the pixels that are solved lie on the sensor. */
static inline weft_pixel_scale weft_solve_pixel(const weft_solve_options *options)
{
    return options->half ? (weft_pixel_scale){2, 0.5} : (weft_pixel_scale){1, 0};
}

/** The method of a name; WEFT_ERR_USAGE lists what there is. */
weft_err weft_solve_find_method(const char *name, const weft_solve_method **method, weft_error *err);

/**
 * Says whether a set can be solved with a calibration, before anything large is read: the set is complete,
 * the calibration has lights (near ones: and a camera with its pose), as many as the set, and is for
 * frames of this size, and the plane can be had at the scale asked for.
 *
 * @param cal_folder  only for the messages
 */
weft_err weft_solve_check(const weft_set *set, const weft_calibration *cal, const char *cal_folder,
                          const weft_solve_options *options, weft_error *err);

/**
 * Solves a set.  Mosaics are solved site by site, each by its own colour; the albedo is demosaiced at the
 * end.  Reads all frames of the lights, shows progress, can be cancelled.
 *
 * @param maps  gets normal, albedo, residual, confidence, mask and `info`: options, inputs with hashes,
 *              version, seconds per stage, and how many pixels have an answer
 * @return what weft_solve_check() and the readers say; WEFT_ERR_NODATA when no pixel has an answer
 */
weft_err weft_solve_set(const weft_set *set, const weft_calibration *cal, const char *cal_folder,
                        const weft_solve_options *options, weft_maps *maps, weft_error *err);

#endif
