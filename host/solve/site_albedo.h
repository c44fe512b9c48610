/** Three colours of the albedo from the one that each site of the mosaic was solved for. */
#ifndef WEFT_HOST_SOLVE_SITE_ALBEDO_H
#define WEFT_HOST_SOLVE_SITE_ALBEDO_H

#include "host/set/maps.h"
#include "host/solve/site_demosaic.h"

/**
 * Demosaics plane 0 of maps->albedo, which holds the albedo of each site in its own colour, into all three.
 *
 * Albedo is white balanced and free of shading, so it is what a demosaicing filter expects; a photograph is
 * neither.  Sites without an answer are first filled from neighbours of the same colour, as far as the
 * filters reach, so that a hole does not colour its rim; the mask stays as it is.
 *
 * @param done  told of each part of a row that is finished; NULL: nobody
 */
weft_err weft_site_albedo_finish(weft_maps *maps, weft_cfa cfa, weft_site_done_fn *done, void *context,
                                 weft_error *err);

#endif
