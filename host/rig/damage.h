/**
 * What goes wrong with a cloth: a crease across it, tears that show the ground, lint on top of it.
 *
 * All of it is a formula, so that the truth knows it to the ray.  Places and shapes follow from the seed.
 */
#ifndef WEFT_HOST_RIG_DAMAGE_H
#define WEFT_HOST_RIG_DAMAGE_H

#include "host/set/flaw_bits.h"

#include <stdbool.h>
#include <stdint.h>

enum { WEFT_RIG_N_TEARS = 3, WEFT_RIG_N_FIBRES = 8 };

/** A fold that was pressed and opened again: height h exp(-sqrt(d^2 + r^2) / w) at the distance d from it. */
typedef struct weft_rig_crease {
    float x, y, across_x, across_y; /* a point of it, the unit vector across it */
    float height_mm, width_mm, radius_mm;
} weft_rig_crease;

/** A slit: |across| < half_width (1 - (along / half_length)^2). */
typedef struct weft_rig_tear {
    float x, y, along_x, along_y;
    float half_length, half_width; /* mm */
} weft_rig_tear;

/** Part of a circle, of a fibre that lies on the highest yarns. */
typedef struct weft_rig_fibre {
    float x, y, bend_mm;      /* the circle */
    float middle_x, middle_y; /* unit, to the middle of the arc */
    float cos_half;           /* of half its angle */
    float radius;             /* of the fibre, mm */
} weft_rig_fibre;

typedef struct weft_rig_damage {
    bool present;
    int ground, lint;         /* materials */
    float floor_mm, crown_mm; /* the ground's height; that of the highest yarns */
    weft_rig_crease crease;
    weft_rig_tear tears[WEFT_RIG_N_TEARS];
    weft_rig_fibre fibres[WEFT_RIG_N_FIBRES];
} weft_rig_damage;

/** Places everything; `present`, materials and heights are the caller's. */
void weft_rig_damage_init(weft_rig_damage *damage, uint64_t seed);

/** Height of the crease at (x, y), and its slopes. */
void weft_rig_damage_bend(const weft_rig_damage *damage, float x, float y, float *height, float slope[2]);

/** Whether (x, y) is within 0.25 mm of the crease's line. */
bool weft_rig_damage_on_crease(const weft_rig_damage *damage, float x, float y);

/** Whether the cloth is torn away at (x, y). */
bool weft_rig_damage_torn(const weft_rig_damage *damage, float x, float y);

/** The fibre that covers (x, y) and the normal of its surface there; NULL: none does. */
const weft_rig_fibre *weft_rig_damage_fibre(const weft_rig_damage *damage, float x, float y, float normal[3]);

#endif
