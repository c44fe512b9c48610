/**
 * Light from yarn to yarn, taken off the answers.
 *
 * A valley gets light from the walls that hide the sky from it.  To first order that light is the share of
 * the sky that is hidden, times the cloth's mean reflectance m, times what falls on the flat cloth, and the
 * valley returns it by its own reflectance:
 *
 *     I'_j = k (n . l_j) + k q (z . l_j),   q = (1 - openness) m
 *
 * That is Lambert's law for the normal n + q z: no residual tells it from a flatter, brighter surface.  The
 * height that belongs to the normals does: it says how much of the sky each pixel sees.
 * (Ignored, it costs plain cotton 0.3 degrees and 3 % of albedo; compare the radiosity of one bounce, and
 * Nayar, Ikeuchi, Kanade, "Shape from interreflections", IJCV 6, 1991.)
 */
#ifndef WEFT_HOST_SOLVE_BOUNCE_H
#define WEFT_HOST_SOLVE_BOUNCE_H

#include "host/set/maps.h"

/** What was found, for the report. */
typedef struct weft_bounce_report {
    bool done;
    double relief_mm; /* rms of the height */
    double openness;  /* mean share of the sky seen */
} weft_bounce_report;

/**
 * Corrects maps->normal and maps->albedo, which are in sensor geometry and camera RGB.
 *
 * @param cfa        albedo plane 0 holds each site's own colour; NONE: three planes
 * @param mm_per_px  of the maps in the middle of the frame, > 0
 * @return WEFT_ERR_NOMEM, WEFT_ERR_CANCELLED
 */
weft_err weft_bounce_take_off(weft_maps *maps, weft_cfa cfa, double mm_per_px, weft_bounce_report *report,
                              weft_error *err);

#endif
