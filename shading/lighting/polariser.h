/** The fake polarising filter of a sky (S-FC3-08). */
#ifndef WEFT_SHADING_LIGHTING_POLARISER_H
#define WEFT_SHADING_LIGHTING_POLARISER_H

/** Share of the sky's light that is let through at an hour of the day, per channel, 0..1. */
typedef struct weft_polariser_key {
    double hour; /* 0..24 */
    double factor[3];
} weft_polariser_key;

/**
 * The factor at an hour: linear between the keys, and over midnight from the last to the first.
 *
 * @param keys  n >= 1 of them, by ascending hour; of two of the same hour the later counts from then on
 * @param hour  any; taken modulo 24
 * Source: McAuley 2012 (Far Cry 3), figure 14; S-FC3-08.
 */
void weft_polariser_at(int n, const weft_polariser_key *keys, double hour, double factor[3]);

/**
 * What a filter before the camera does to the light of the sky that is seen, directly or in a mirror.
 *
 * A polarising filter darkens the sky and what mirrors it; the diffuse light of the ground it leaves, for
 * that is no longer polarised.  So the factor is on the panorama's upper half where it is looked at, not on
 * the light by which diffuse surfaces are lit; that may be made paler instead.
 */
typedef struct weft_sky_filter {
    double factor[3];          /* weft_polariser_at(); all 1: no filter */
    double ambient_saturation; /* s in C' = Y + s (C - Y) of the diffuse light; 1: as it is */
} weft_sky_filter;

#endif
