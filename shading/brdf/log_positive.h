/** Logarithms in plain arithmetic, so that loops around them become vector code; libm's are
 *  calls. */
#ifndef WEFT_SHADING_BRDF_LOG_POSITIVE_H
#define WEFT_SHADING_BRDF_LOG_POSITIVE_H

#include "core/clones.h"
#include "shading/brdf/exp_negative.h"

/**
 * ln of 2^k m with m - 1 given: k ln 2 + 2 atanh((m - 1)/(m + 1)), 0.7 < m < 1.42, by the power series of
 * atanh to the 21st power (the rest is below 1e-18).
 */
WEFT_INLINE double weft_log_parts(double k, double m_minus_1)
{
    const double s = m_minus_1 / (m_minus_1 + 2), z = s * s;
    double p = 1 / 21.0;
    p = p * z + 1 / 19.0;
    p = p * z + 1 / 17.0;
    p = p * z + 1 / 15.0;
    p = p * z + 1 / 13.0;
    p = p * z + 1 / 11.0;
    p = p * z + 1 / 9.0;
    p = p * z + 1 / 7.0;
    p = p * z + 1 / 5.0;
    p = p * z + 1 / 3.0;
    return k * 0.69314718055994530942 + (2 * s + 2 * s * z * p);
}

/** ln x, 1e-300 <= x; x_minus_1 counts near x = 1, where it has the digits that x has lost.  Below 1e-300:
 *  -708, whose e^x is a caller's 0. */
WEFT_INLINE double weft_log_of(double x, double x_minus_1)
{
    const double in = x > 1e-300 ? x : 1;
    uint64_t bits, magic;
    double m, k;
    memcpy(&bits, &in, sizeof bits);
    /* the sum carries into the exponent where the fraction is above that of sqrt(2): m is in
     * sqrt(1/2)..sqrt(2) */
    const uint64_t rounded = bits + 0x00095f619980c433u;
    magic = (rounded >> 52) | 0x4330000000000000u; /* the exponent as the low bits of 2^52 + it */
    memcpy(&k, &magic, sizeof k);
    k -= 0x1p52 + 1023;
    bits -= (rounded & 0xfff0000000000000u) - 0x3ff0000000000000u;
    memcpy(&m, &bits, sizeof m);
    const double log = weft_log_parts(k, k == 0 ? x_minus_1 : m - 1);
    return x > 1e-300 ? log : -708;
}

/** ln x, x >= 0. */
WEFT_INLINE double weft_log_positive(double x)
{
    return weft_log_of(x, x - 1);
}

/** ln(1 - t), 0 <= t <= 1, with all digits for small t. */
WEFT_INLINE double weft_log_one_minus(double t)
{
    return weft_log_of(1 - t, -t);
}

#endif
