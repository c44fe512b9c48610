/** Drawing directions: the cosine lobe, the visible normals of GGX, points of low discrepancy. */
#ifndef WEFT_SHADING_BRDF_SAMPLING_H
#define WEFT_SHADING_BRDF_SAMPLING_H

#include "shading/brdf/brdf.h"
#include "shading/brdf/ggx.h"

#include <stdint.h>

/** A direction with density cosine/pi over the upper hemisphere, from u1, u2 in [0, 1). */
static inline void weft_sample_cosine(double u1, double u2, double direction[3])
{
    const double r = sqrt(u1), phi = 2 * WEFT_PI * u2;
    direction[0] = r * cos(phi);
    direction[1] = r * sin(phi);
    direction[2] = sqrt(1 - u1);
}

static inline double weft_pdf_cosine(double nl)
{
    return nl > 0 ? nl / WEFT_PI : 0;
}

/**
 * A normal of GGX (widths at, ab) as seen from v (v.z > 0): density G1(v) max(v.h, 0) D(h)/v.z.
 * Source: Dupuy and Benyoub 2023 (spherical caps); the same density as Heitz 2018.
 */
static inline void weft_sample_ggx_visible(const double v[3], double at, double ab, double u1, double u2,
                                           double h[3])
{
    const double sx = at * v[0], sy = ab * v[1], sz = v[2];
    const double inverse = 1 / sqrt(sx * sx + sy * sy + sz * sz);
    const double phi = 2 * WEFT_PI * u1;
    const double z = (1 - u2) * (1 + sz * inverse) - sz * inverse;
    const double r = sqrt(weft_max(1 - z * z, 0));
    const double x = at * (r * cos(phi) + sx * inverse);
    const double y = ab * (r * sin(phi) + sy * inverse);
    const double up = weft_max(z + sz * inverse, 0);
    const double length2 = x * x + y * y + up * up;
    const double scale = length2 > 0 ? 1 / sqrt(length2) : 0;
    h[0] = x * scale;
    h[1] = y * scale;
    h[2] = length2 > 0 ? up * scale : 1;
}

/** Cosine n.h of a GGX normal with density D(h) (n.h), from u in [0, 1):
 *  sqrt((1 - u)/(1 + (alpha^2 - 1) u)).  Source: Walter et al. 2007 eq. 35; S-UE4-06, S-COD-02. */
static inline double weft_sample_ggx_cosine(double alpha, double u)
{
    return sqrt((1 - u) / (1 + (alpha * alpha - 1) * u));
}

/** The same normal about a unit n, azimuth 2 pi u1, in the frame t = norm(up x n), b = n x t with up = z, or
 * x where |n.z| >= 0.999.  Source: Karis 2013, ImportanceSampleGGX; S-UE4-06. */
void weft_sample_ggx_normal(const double n[3], double alpha, double u1, double u2, double h[3]);

/** Mirror of v about h. */
static inline void weft_reflect(const double v[3], const double h[3], double l[3])
{
    const double vh = v[0] * h[0] + v[1] * h[1] + v[2] * h[2];
    for (int c = 0; c < 3; c++)
        l[c] = 2 * vh * h[c] - v[c];
}

/** Density of the light direction when h was drawn by weft_sample_ggx_visible(): G1(v) D(h)/(4 v.z), which
 *  with V1 is D V1(v)/2; 0 where v.z <= 0. */
static inline double weft_pdf_ggx_visible(double d, double v1_view, double nv)
{
    return nv > 0 ? 0.5 * d * v1_view : 0;
}

/**
 * Draws light direction i of a batch: with probability `share` the reflection at a visible normal of GGX
 * (widths at, ab), else the cosine hemisphere.  u [3][n] as weft_brdf.sample takes it.
 */
void weft_sample_mixed(const weft_brdf_batch *batch, int i, double share, double at, double ab,
                       const double *const u[3], double *const light[3]);

/** Its density at light direction i, in 1/sr; 0 where n.v <= 0. */
double weft_pdf_mixed(const weft_brdf_batch *batch, int i, double share, double at, double ab);

/** A share for the lobe of a material with diffuse and specular light of these sizes: never below a tenth of
 *  either, so that neither starves; the half of both where there is no light at all. */
double weft_sample_share(double specular, double diffuse);

/** weft_brdf.sample and .pdf of models without a sharp lobe: the cosine hemisphere. */
void weft_brdf_sample_cosine(const weft_brdf_batch *batch, const double *const u[3], double *const light[3]);
void weft_brdf_pdf_cosine(const weft_brdf_batch *batch, double *density);

/** Point i of n of the Hammersley set: (i/n, base-2 radical inverse of i).  Source: S-UE4-06. */
static inline void weft_hammersley(uint32_t i, uint32_t n, double point[2])
{
    uint32_t bits = i;
    bits = bits << 16 | bits >> 16;
    bits = (bits & 0x00ff00ffu) << 8 | (bits & 0xff00ff00u) >> 8;
    bits = (bits & 0x0f0f0f0fu) << 4 | (bits & 0xf0f0f0f0u) >> 4;
    bits = (bits & 0x33333333u) << 2 | (bits & 0xccccccccu) >> 2;
    bits = (bits & 0x55555555u) << 1 | (bits & 0xaaaaaaaau) >> 1;
    point[0] = (double)i / (double)n;
    point[1] = (double)bits * 0x1p-32;
}

#endif
