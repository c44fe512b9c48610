/** Ambient visibility from horizons in slices around the view axis (S-COD-11, S-COD-12). */
#ifndef WEFT_SHADING_BAKE_HORIZON_H
#define WEFT_SHADING_BAKE_HORIZON_H

/** Both horizons of a slice, from the view axis: h1 <= 0 <= h2, in radians. */
typedef struct weft_horizon_arc {
    double h1_rad, h2_rad;
} weft_horizon_arc;

/** Horizons cut to the hemisphere of the normal, whose projection into the slice is at gamma_rad from the
 * view axis: h1 not below gamma - pi/2, h2 not above gamma + pi/2.  Source: Jimenez et al. 2016; S-COD-12. */
weft_horizon_arc weft_horizon_clamp(weft_horizon_arc arc, double gamma_rad);

/**
 * Cosine-weighted visibility of one slice between clamped horizons, the integral of max(cos(t - gamma), 0)
 * |sin t|:
 *
 *     1/4 [-cos(2 h1 - gamma) + cos gamma + 2 h1 sin gamma] + the same with h2
 *
 * 1 for an open slice and gamma = 0.  Source: Jimenez et al. 2016 eq. 7; S-COD-12.
 */
double weft_horizon_visibility(weft_horizon_arc clamped, double gamma_rad);

/** Horizons of a heightfield at one place, in the slice at azimuth phi_rad: what `weft_horizon_occlusion()`
 *  asks.  h1 is that on the side of phi + pi. */
typedef weft_horizon_arc weft_horizon_fn(void *context, double phi_rad);

/**
 * Ambient visibility for a unit normal n (view axis +z): the mean over slices of |n_p| times the visibility,
 * n_p the projection of n into the slice.
 *
 * An open field seen by a normal tilted by t gives (1 + cos t)/2, for the lower half space is cut; divide by
 * (1 + n_z)/2 where that is not wanted.
 *
 * @param n_slices  evenly spaced over half a turn
 * Source: S-COD-12.
 */
double weft_horizon_occlusion(weft_horizon_fn *fn, void *context, const double n[3], int n_slices);

#endif
