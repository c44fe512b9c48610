/** Three colours of the albedo from the one that each site of the mosaic was solved for. */
#ifndef WEFT_HOST_SOLVE_SITE_ALBEDO_H
#define WEFT_HOST_SOLVE_SITE_ALBEDO_H

#include "host/set/maps.h"

/**
 * Demosaics plane 0 of maps->albedo, which holds the albedo of each site in its own colour, into all three.
 *
 * Albedo is white balanced and free of shading, so it is what a demosaicing filter expects; a photograph is
 * neither.  Sites without an answer are filled from their nearest neighbours of the same colour first;
 * a pixel whose filter still meets an empty site loses its answer in maps->mask.
 */
weft_err weft_site_albedo_finish(weft_maps *maps, weft_cfa cfa, weft_error *err);

#endif
