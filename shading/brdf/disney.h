/** Terms of Disney's principled model of 2012 (S-BLG-05) that no other model has. */
#ifndef WEFT_SHADING_BRDF_DISNEY_H
#define WEFT_SHADING_BRDF_DISNEY_H

#include "shading/brdf/ggx.h"
#include "shading/brdf/log_positive.h"

/** One factor of the two lobes of retro-reflection: 1 + (f90 - 1) w, w = Schlick's weight of a cosine. */
static inline double weft_disney_edge(double f90, double w)
{
    return 1 + (f90 - 1) * w;
}

/** Diffuse without 1/pi: Fd90 = 1/2 + 2 lh^2 rough; wl, wv are Schlick's weights of nl and nv. */
static inline double weft_disney_diffuse(double wl, double wv, double lh, double roughness)
{
    const double f90 = 0.5 + 2 * lh * lh * roughness;
    return weft_disney_edge(f90, wl) * weft_disney_edge(f90, wv);
}

/** The flatter lobe that stands for subsurface light: 5/4 (Fss (1/(nl + nv) - 1/2) + 1/2), nl + nv > 0. */
static inline double weft_disney_subsurface(double wl, double wv, double nl, double nv, double lh,
                                            double roughness)
{
    const double f90 = lh * lh * roughness;
    const double edges = weft_disney_edge(f90, wl) * weft_disney_edge(f90, wv);
    return 1.25 * (edges * (1 / (nl + nv) - 0.5) + 0.5);
}

/** Clearcoat's distribution, GTR of exponent 1: (a^2 - 1)/(pi ln(a^2) (a^2 nh^2 + s2)), 0 < a < 1. */
static inline double weft_disney_gtr1(double nh, double s2, double a)
{
    const double a2 = a * a;
    return (a2 - 1) / (WEFT_PI * weft_log_positive(a2) * (a2 * nh * nh + s2));
}

/** Widths along tangent and bitangent: aspect = sqrt(1 - 0.9 anisotropic), not below 0.001. */
static inline void weft_disney_widths(double roughness, double anisotropic, double *at, double *ab)
{
    const double alpha = roughness * roughness, aspect = sqrt(1 - 0.9 * anisotropic);
    *at = weft_max(alpha / aspect, 1e-3);
    *ab = weft_max(alpha * aspect, 1e-3);
}

#endif
