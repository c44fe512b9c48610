/**
 * The environment BRDF (environment.h) by rings of lights of one n.l: many cones at once, for tables.
 *
 * Along a ring, at azimuth pi - psi from the view, the GGX density has the closed shape
 *
 *     D = alpha^2/pi (2 lh)^4 / (A^2 + B^2 sin^2(psi/2))^2,   A^2 = alpha^2 (nl + nv)^2 + (sl - sv)^2,
 *     B^2 = 4 sl sv   (s: sines)
 *
 * and tan(psi/2) = A/sqrt(A^2 + B^2) tan(chi) turns D dpsi into 2 k/A^4 (cos^2 chi + k^2 sin^2 chi) dchi:
 * smooth at any alpha.  Across the rings, places 0..1 are spread as the lobe falls off: three quarters count
 * the way of atan((nv - c)/(2 alpha sv + 2 alpha^2)) from c = 0 to c = 1, a quarter the cosine c itself.
 */
#ifndef WEFT_SHADING_LIGHTING_ENVIRONMENT_RINGS_H
#define WEFT_SHADING_LIGHTING_ENVIRONMENT_RINGS_H

#include "shading/lighting/environment.h"

/** Place 0..1 of a cone's cosine 0..1, and back: 0 is the whole hemisphere, 1 closed. */
double weft_environment_ring_place(double alpha, double nv, double cone_cosine);
double weft_environment_ring_cosine(double alpha, double nv, double place);

/**
 * The share above each of `n` cones, at even places 0..1; share[0] is the whole hemisphere, share[n - 1] is
 * 0.
 *
 * @param alpha  above 0, to 1
 * @param nv     0..1, as it is
 * Within 5e-5 of the integral for n from 32; some 50 us.
 */
void weft_environment_rings(weft_environment_lobe lobe, double alpha, double nv, int n,
                            weft_environment_share share[]);

#endif
