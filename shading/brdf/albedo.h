/**
 * Integrals over all light directions: directional albedo, and whether a density integrates to 1.
 *
 * The integral runs over half vectors (dl = 4 (v.h) dh), whose polar angle is cut at fixed decades of its
 * tangent and where the horizon begins and ends to bite: lobes of any width keep all digits, and the model
 * is only seen through its functions.
 */
#ifndef WEFT_SHADING_BRDF_ALBEDO_H
#define WEFT_SHADING_BRDF_ALBEDO_H

#include "shading/brdf/brdf.h"

#include <stdbool.h>

/** How hard to work. */
typedef enum weft_albedo_effort {
    WEFT_ALBEDO_QUICK, /* about 6 digits, 0.5 ms */
    WEFT_ALBEDO_EXACT, /* all digits, 3 ms */
} weft_albedo_effort;

/** A function of n directions of light and one view, as weft_brdf.eval takes them; `context` is the caller's.
 */
typedef void weft_albedo_fn(void *context, const weft_brdf_batch *batch, double *const value[3]);

/** What part of the sphere of light directions. */
typedef enum weft_albedo_domain {
    WEFT_ALBEDO_UPPER,   /* n.l > 0, weighted by n.l: reflectance */
    WEFT_ALBEDO_VISIBLE, /* every l whose half vector is in the upper hemisphere, not weighted: densities of
                            sampled half vectors.  Each such l has n.l > -nv. */
} weft_albedo_domain;

/** Integral of fn over the domain for the view at cosine `nv` (0 < nv <= 1) and azimuth phi_rad.
 *  `anisotropic` says that fn turns with the tangent and may be narrow along it or across.  Only
 *  batch->light and batch->view are set. */
void weft_albedo_integrate(weft_albedo_fn *fn, void *context, weft_albedo_domain domain, double nv,
                           double phi_rad, bool anisotropic, weft_albedo_effort effort, double value[3]);

/** The same over lights with n.l >= min_nl only (0..1), weighted by n.l, for functions that do not turn. */
void weft_albedo_integrate_cone(weft_albedo_fn *fn, void *context, double nv, double min_nl,
                                weft_albedo_effort effort, double value[3]);

/** Directional albedo of a model: the share of light that comes back when all of the hemisphere shines,
 *  seen from (nv, phi_rad); by reciprocity also what a beam from there gives back in all. */
void weft_brdf_albedo(const weft_brdf *brdf, const double values[WEFT_BRDF_MAX_PLANES], double nv,
                      double phi_rad, weft_albedo_effort effort, double albedo[3]);

/** Integral of the model's pdf over the whole sphere; 1 when it is right. */
double weft_brdf_pdf_integral(const weft_brdf *brdf, const double values[WEFT_BRDF_MAX_PLANES], double nv,
                              double phi_rad, weft_albedo_effort effort);

#endif
