/** Half vector and cosines of a pair of directions in the local frame, without cancellation. */
#ifndef WEFT_SHADING_BRDF_HALF_H
#define WEFT_SHADING_BRDF_HALF_H

#include <math.h>

#define WEFT_PI 3.14159265358979323846

/** Lower bound of n.v (S-CNV-02). */
#define WEFT_MIN_NV 1e-4

/* max(a, b) that compiles to one instruction: fmax() must care for NaN. */
static inline double weft_max(double a, double b)
{
    return a > b ? a : b;
}

/** What the models need of l and v (S-CNV-01). */
typedef struct weft_half {
    double nl; /* n.l as it is */
    double nv; /* n.v raised to WEFT_MIN_NV */
    double nh; /* n.h, 0..1 */
    double s2; /* |n x h|^2 = 1 - nh^2 from the components, exact near nh = 1; 1 where nh was clamped to 0 */
    double lh; /* l.h = v.h, 0..1 */
    double valid; /* 1; 0 where n.l <= 0 or l = -v */
    double h[3];  /* the half vector, unit; its length is 0 where l = -v */
    double up;    /* 1 where h exists and n.h > 0, whatever l: where a normal distribution has density */
} weft_half;

/**
 * Half vector of unit vectors l and v; h is built from the true v, also below the horizon (S-ORD-05).
 *
 *     h = (l + v)/|l + v|,   lh = |l + v|/2
 */
static inline weft_half weft_half_of(double lx, double ly, double lz, double vx, double vy, double vz)
{
    const double hx = lx + vx, hy = ly + vy, hz = lz + vz;
    const double length2 = hx * hx + hy * hy + hz * hz;
    const double safe2 = length2 > 0 ? length2 : 1;
    const double inverse = 1 / sqrt(safe2);
    const double nh = hz * inverse, lh = 0.5 * safe2 * inverse;
    weft_half half;
    half.nl = lz;
    half.nv = weft_max(vz, WEFT_MIN_NV);
    half.nh = nh > 0 ? (nh < 1 ? nh : 1) : 0;
    half.s2 = nh > 0 ? (hx * hx + hy * hy) / safe2 : 1;
    half.lh = lh < 1 ? lh : 1;
    half.valid = lz > 0 ? (length2 > 0 ? 1 : 0) : 0;
    half.h[0] = hx * inverse;
    half.h[1] = hy * inverse;
    half.h[2] = nh;
    half.up = nh > 0 ? 1 : 0;
    return half;
}

#endif
