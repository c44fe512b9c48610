/** Point, sphere and tube lights by a representative point (S-UE4-14 to S-UE4-18).  Lengths share one unit.
 */
#ifndef WEFT_SHADING_LIGHTING_AREA_LIGHT_H
#define WEFT_SHADING_LIGHTING_AREA_LIGHT_H

/**
 * Windowed inverse square: clamp(1 - (d/radius)^4)^2 / (d^2 + 1); 0 from `radius` on.
 *
 * The 1 is an area: it depends on the unit of length.  Source: Karis 2013 eq. 9; S-UE4-14.
 */
double weft_light_falloff(double distance, double radius);

/** Width of a GGX lobe widened by the light's size: clamp(alpha + half_size/(3 distance)); 1 at distance 0.
 *  Source: Karis 2013 eq. 10; S-UE4-15. */
double weft_light_widened_alpha(double alpha, double half_size, double distance);

/** What stands for an area light at one place of the surface. */
typedef struct weft_light_point {
    double l[3];  /* unit vector to the representative point */
    double alpha; /* widened width, for the normalisation only: D keeps the material's */
    double norm;  /* factor on the specular term */
} weft_light_point;

/**
 * Sphere light: the point of the sphere that is nearest to the mirrored ray.
 *
 *     c = (L.r) r - L,   P = L + c clamp(radius/|c|),   norm = (alpha/alpha')^2
 *
 * The printed c = L - (L.r) r points the wrong way.  A ray through the centre gives L itself.  Leaves glossy
 * surfaces too bright, by 4 at alpha 0.05 and radius/distance 0.2.
 *
 * @param to_centre  L, from the surface; not 0
 * @param r          mirrored view, unit
 * Source: Karis 2013 eqs. 11, 14; S-UE4-16.
 */
weft_light_point weft_light_sphere(const double to_centre[3], const double r[3], double radius, double alpha);

/** A tube light of ends L0, L1 as seen from the surface, r the mirrored view (unit). */
typedef struct weft_light_tube {
    double smallest_angle;    /* t of eq. 18 along L0..L1, not cut */
    double smallest_distance; /* t of eq. 19, not cut; where L1 - L0 is along r: 0 or 1, the nearer end */
    double t;                 /* the latter in 0..1 */
    weft_light_point point;   /* norm = alpha/alpha', alpha' from half the length over the point's distance */
} weft_light_tube;

/** Source: Karis 2013 eqs. 17-20; S-UE4-17 (which settles alpha' of a line). */
weft_light_tube weft_light_tube_of(const double l0[3], const double l1[3], const double r[3], double alpha);

/** Irradiance of a tube of unit power, the mean of n.l/d^2 along it: eq. 15, right while all of it is above
 *  the horizon. */
double weft_light_tube_irradiance(const double l0[3], const double l1[3], const double n[3]);

/** Its practical form with the 1 in the denominator and the horizon cut: eq. 16; for L0 = L1 it is
 *  clamp(n.l)/(d^2 + 1). */
double weft_light_tube_irradiance_soft(const double l0[3], const double l1[3], const double n[3]);

#endif
