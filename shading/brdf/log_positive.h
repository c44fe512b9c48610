/** Logarithms in plain arithmetic, so that loops around them become vector code; libm's are
 *  calls. */
#ifndef WEFT_SHADING_BRDF_LOG_POSITIVE_H
#define WEFT_SHADING_BRDF_LOG_POSITIVE_H

#include "shading/brdf/exp_negative.h"

/*
 * A number split into 2^k and m in sqrt(1/2)..sqrt(2), and the series for ln m.
 *
 * Adding what takes the fraction of sqrt(2) to 1 carries into the exponent where m would be above it; the
 * exponent becomes a number as the low bits of a power of two whose unit is the last digit.
 */
#ifdef WEFT_SINGLE
#define WEFT_LOG_LEAST 1e-37F /* below it the logarithm is WEFT_LOG_NONE, whose e^x is a caller's 0 */
#define WEFT_LOG_NONE  (-87.0F)

WEFT_INLINE float weft_log_split(float x, float *k)
{
    uint32_t bits, magic;
    float m;
    memcpy(&bits, &x, sizeof bits);
    const uint32_t rounded = bits + 0x004afb0du;
    magic = (rounded >> 23) | 0x4b000000u;
    memcpy(k, &magic, sizeof *k);
    *k -= 0x1p23F + 127;
    bits -= (rounded & 0xff800000u) - 0x3f800000u;
    memcpy(&m, &bits, sizeof m);
    return m;
}

/* (atanh(s) - s)/s^3 of z = s^2 <= 0.0295: to the 9th power of s, the rest below 3e-9 of ln m. */
WEFT_INLINE float weft_log_series(float z)
{
    float p = 1 / 9.0F;
    p = p * z + 1 / 7.0F;
    p = p * z + 1 / 5.0F;
    return p * z + 1 / 3.0F;
}
#else
#define WEFT_LOG_LEAST 1e-300
#define WEFT_LOG_NONE  (-708.0)

WEFT_INLINE double weft_log_split(double x, double *k)
{
    uint64_t bits, magic;
    double m;
    memcpy(&bits, &x, sizeof bits);
    const uint64_t rounded = bits + 0x00095f619980c433u;
    magic = (rounded >> 52) | 0x4330000000000000u;
    memcpy(k, &magic, sizeof *k);
    *k -= 0x1p52 + 1023;
    bits -= (rounded & 0xfff0000000000000u) - 0x3ff0000000000000u;
    memcpy(&m, &bits, sizeof m);
    return m;
}

/* The same to the 21st power: the rest is below 1e-18. */
WEFT_INLINE double weft_log_series(double z)
{
    double p = 1 / 21.0;
    p = p * z + 1 / 19.0;
    p = p * z + 1 / 17.0;
    p = p * z + 1 / 15.0;
    p = p * z + 1 / 13.0;
    p = p * z + 1 / 11.0;
    p = p * z + 1 / 9.0;
    p = p * z + 1 / 7.0;
    p = p * z + 1 / 5.0;
    return p * z + 1 / 3.0;
}
#endif

/** ln of 2^k m with m - 1 given: k ln 2 + 2 atanh((m - 1)/(m + 1)), 0.7 < m < 1.42. */
WEFT_INLINE weft_real weft_log_parts(weft_real k, weft_real m_minus_1)
{
    const weft_real s = m_minus_1 / (m_minus_1 + 2), z = s * s;
    return k * WEFT_LN2 + (2 * s + 2 * s * z * weft_log_series(z));
}

/** ln x; x_minus_1 counts near x = 1, where it has the digits that x has lost.  Below 1e-300 (single
 * precision: 1e-37): -708 (-87), whose e^x is a caller's 0. */
WEFT_INLINE weft_real weft_log_of(weft_real x, weft_real x_minus_1)
{
    const weft_real in = x > WEFT_LOG_LEAST ? x : 1;
    weft_real k;
    const weft_real m = weft_log_split(in, &k);
    const weft_real log = weft_log_parts(k, k == 0 ? x_minus_1 : m - 1);
    return x > WEFT_LOG_LEAST ? log : WEFT_LOG_NONE;
}

/** ln x, x >= 0. */
WEFT_INLINE weft_real weft_log_positive(weft_real x)
{
    return weft_log_of(x, x - 1);
}

/** ln(1 - t), 0 <= t <= 1, with all digits for small t. */
WEFT_INLINE weft_real weft_log_one_minus(weft_real t)
{
    return weft_log_of(1 - t, -t);
}

#endif
