/**
 * What ambient occlusion A (0..1, the cosine-weighted share of the sky that is seen) does to light
 * (S-COD-13 to S-COD-18).  `rho` is the reflectance of the surface, per channel for coloured occlusion.
 */
#ifndef WEFT_SHADING_LIGHTING_AMBIENT_OCCLUSION_H
#define WEFT_SHADING_LIGHTING_AMBIENT_OCCLUSION_H

#include <math.h>

/** The occluded part is white and occluded alike: A (1 - A) + A.  Source: S-COD-14. */
static inline double weft_ao_similar_white(double a)
{
    return a * (1 - a) + a;
}

/** It is of the same reflectance and open: rho (1 - A) + A.  Source: S-COD-14. */
static inline double weft_ao_same_open(double a, double rho)
{
    return rho * (1 - a) + a;
}

/** It is of the same reflectance and occluded alike: rho A (1 - A) + A.  Source: S-COD-14. */
static inline double weft_ao_same_similar(double a, double rho)
{
    return rho * a * (1 - a) + a;
}

/**
 * All bounces between places like this one, the fixed point of A' = A + (1 - A) rho A':
 *
 *     A' = A/(1 - rho (1 - A))
 *
 * rho = 1 gives 1, also at A = 0.  A <= A' <= 1.  Source: Chan 2018 page 54; S-COD-15.
 */
static inline double weft_ao_interreflect(double a, double rho)
{
    const double below = 1 - rho * (1 - a);
    return below > 0 ? a / below : 1;
}

/** Cosine of the half angle of a cone about n that is as open as visibility v: sqrt(1 - v); the printed text
 *  has lost the root.  Source: S-COD-16. */
static inline double weft_ao_cone_cosine(double v)
{
    return v < 1 ? sqrt(1 - v) : 0;
}

/** Micro-shadowing of a direct light by the cone, as one: 1 inside, 0 outside; the only one of the three that
 *  keeps the visibility on average.  Source: S-COD-17. */
static inline double weft_ao_shadow_threshold(double nl, double cone_cosine)
{
    return nl > 0 && cone_cosine < nl ? 1 : 0;
}

/** Smooth: clamp(nl/cos). */
static inline double weft_ao_shadow_smooth(double nl, double cone_cosine)
{
    return nl <= 0 ? 0 : nl < cone_cosine ? nl / cone_cosine : 1;
}

/** Sharp, as shipped: clamp(nl/cos)^2. */
static inline double weft_ao_shadow_sharp(double nl, double cone_cosine)
{
    const double smooth = weft_ao_shadow_smooth(nl, cone_cosine);
    return smooth * smooth;
}

/** Cone for indirect specular light: cos (1 - g^2)(1 - (1 - nv)^4), open for mirrors and grazing views.
 *  Source: S-COD-18, with the inner brackets that the printed text lost. */
static inline double weft_ao_specular_cone(double cone_cosine, double gloss, double nv)
{
    const double m = 1 - nv;
    return cone_cosine * (1 - gloss * gloss) * (1 - m * m * m * m);
}

#endif
