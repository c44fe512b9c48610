/**
 * Light that walks on a rough surface of matte facets: the simulation that Call of Duty: WWII's diffuse model
 * (multiscatter.h) was fitted to.  Slow, for tools and tests.
 *
 * The surface is Smith's with GGX normals; a ray's next meeting with it follows from the share of the surface
 * that is lower, C (1 above all of it).  Each facet is a Lambertian reflector of 100 %; light that its coat
 * mirrors (Schlick, F0) is lost.
 *
 *     free way:  C' = C (1 - U)^(-1/Lambda(w));  an upward ray leaves where U > 1 - C^Lambda(w)
 *     facet:     visible normal of GGX for the ray, also from below;   next ray: cosine about it
 *     f n.v    = mean over walks of the sum over meetings of w (1 - F) max(v.m, 0)/pi C^Lambda(v)
 *
 * Source: Heitz, Hanika, d'Eon and Dachsbacher 2016, Multiple-Scattering Microfacet BSDFs with the Smith
 * Model; Chan 2018 pages 83-88; S-COD-24.
 */
#ifndef WEFT_SHADING_BRDF_FACET_WALK_H
#define WEFT_SHADING_BRDF_FACET_WALK_H

#include <stdint.h>

/** Where the coat takes its share.  The deck says "we apply Fresnel to determine energy reflected diffusely",
 *  which has several readings; its own fit of gloss 0 is nearest to the first (docs/shading.md). */
typedef enum weft_facet_coat {
    WEFT_FACET_BARE,  /* none: all light comes back */
    WEFT_FACET_FIRST, /* of the light from outside, at the facet that it meets first */
    WEFT_FACET_EACH,  /* of light that enters a facet, at each */
    WEFT_FACET_BOTH,  /* of light that enters and of light that leaves, at each: the one that is reciprocal */
} weft_facet_coat;

typedef struct weft_facet_surface {
    double alpha; /* of GGX, above 0 */
    double f0;    /* of the coat */
    weft_facet_coat coat;
    int meetings; /* walks end after so many; 1: single scattering */
} weft_facet_surface;

/**
 * f in 1/sr for light from `light` seen from `view`, both with z > 0.
 *
 * @param n_walks  their mean; the first numbers of the walks are of low discrepancy
 * @param seed     the same seed gives the same value, whatever else is computed
 */
double weft_facet_walk(const weft_facet_surface *surface, const double light[3], const double view[3],
                       long n_walks, uint64_t seed);

/** Lambda of Smith's masking for GGX, for upward and downward directions (there -1 - Lambda of the upward).
 */
double weft_facet_lambda(double alpha, double cosine);

#endif
