/** Half vector and cosines of a pair of directions in the local frame, without cancellation. */
#ifndef WEFT_SHADING_BRDF_HALF_H
#define WEFT_SHADING_BRDF_HALF_H

#include "shading/brdf/real.h"

/** Lower bound of n.v (S-CNV-02). */
#define WEFT_MIN_NV WEFT_R(1e-4)

/** Lower bound of the n.l that models divide by: below it f n.l is nothing, and f might be infinite. */
#ifdef WEFT_SINGLE
#define WEFT_MIN_NL 1e-30F
#else
#define WEFT_MIN_NL 1e-300
#endif

/** What the models need of l and v (S-CNV-01). */
typedef struct weft_half {
    weft_real nl;  /* n.l as it is */
    weft_real lit; /* n.l for terms that want 0 < n.l: raised to WEFT_MIN_NL, and 1 where not valid */
    weft_real nv;  /* n.v raised to WEFT_MIN_NV */
    weft_real nh;  /* n.h, 0..1 */
    weft_real s2;  /* |n x h|^2 = 1 - nh^2 from the components, exact near nh = 1; 1 where nh was clamped */
    weft_real lh;  /* l.h = v.h, 0..1 */
    weft_real grazing; /* 1 - lh from |l - v|, exact near lh = 1 */
    weft_real valid;   /* 1; 0 where n.l <= 0 or l = -v */
    weft_real h[3];    /* the half vector, unit; its length is 0 where l = -v */
    weft_real up;      /* 1 where h exists and n.h > 0, whatever l: where a normal distribution has density */
} weft_half;

/**
 * Half vector of unit vectors l and v; h is built from the true v, also below the horizon (S-ORD-05).
 *
 *     h = (l + v)/|l + v|,   lh = |l + v|/2,   1 - lh = (|l - v|/2)^2/(1 + lh)
 */
WEFT_INLINE weft_half weft_half_of(weft_real lx, weft_real ly, weft_real lz, weft_real vx, weft_real vy,
                                   weft_real vz)
{
    const weft_real hx = lx + vx, hy = ly + vy, hz = lz + vz;
    const weft_real dx = lx - vx, dy = ly - vy, dz = lz - vz;
    const weft_real length2 = hx * hx + hy * hy + hz * hz, apart2 = dx * dx + dy * dy + dz * dz;
    const weft_real safe2 = length2 > 0 ? length2 : 1;
    const weft_real inverse = 1 / weft_sqrt(safe2);
    const weft_real nh = hz * inverse, lh = WEFT_R(0.5) * safe2 * inverse;
    weft_half half;
    half.nl = lz;
    half.nv = weft_max(vz, WEFT_MIN_NV);
    half.nh = nh > 0 ? (nh < 1 ? nh : 1) : 0;
    half.s2 = nh > 0 ? (hx * hx + hy * hy) / safe2 : 1;
    half.lh = lh < 1 ? lh : 1;
    half.grazing = apart2 / (4 * (1 + half.lh));
    half.valid = lz > 0 ? (length2 > 0 ? 1 : 0) : 0;
    half.lit = half.valid > 0 ? weft_max(lz, WEFT_MIN_NL) : 1;
    half.h[0] = hx * inverse;
    half.h[1] = hy * inverse;
    half.h[2] = nh;
    half.up = nh > 0 ? 1 : 0;
    return half;
}

#endif
