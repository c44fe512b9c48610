/** exp(x), above all for x <= 0, in plain arithmetic, so that loops around it become vector code; libm's is a
 * call. */
#ifndef WEFT_SHADING_BRDF_EXP_NEGATIVE_H
#define WEFT_SHADING_BRDF_EXP_NEGATIVE_H

#include "shading/brdf/real.h"

#include <stdint.h>
#include <string.h>

/**
 * e^x, x < 700 (single precision: 88); relative error below 2e-16 (1e-7) down to -708 (-87), where it stays:
 * 3e-308 (2e-38), a caller's 0.
 *
 * x = k ln 2 + r with |r| <= ln(2)/2: the power series of e^r to the 13th term (the rest is below 5e-18; to
 * the 7th, 6e-9), times 2^k through the exponent bits.  Adding 1.5 times the power of two whose unit is the
 * last digit rounds to an integer; ln 2 goes in two parts.
 */
#ifdef WEFT_SINGLE
WEFT_INLINE float weft_exp_negative(float x)
{
    const float in = x > -87.0F ? x : -87.0F;
    const float shifted = in * 1.442695041F + 0x1.8p23F, k = shifted - 0x1.8p23F;
    const float r = (in - k * 0x1.62ep-1F) - k * 0x1.0bfbe9p-15F;
    float p = 1 / 5040.0F;
    p = p * r + 1 / 720.0F;
    p = p * r + 1 / 120.0F;
    p = p * r + 1 / 24.0F;
    p = p * r + 1 / 6.0F;
    p = p * r + 0.5F;
    p = p * r + 1;
    p = p * r + 1;
    uint32_t bits;
    float scale;
    memcpy(&bits, &shifted, sizeof bits);
    bits = (bits + 127) << 23;
    memcpy(&scale, &bits, sizeof scale);
    return p * scale;
}
#else
WEFT_INLINE double weft_exp_negative(double x)
{
    const double in = x > -708 ? x : -708;
    const double shifted = in * 1.4426950408889634 + 0x1.8p52, k = shifted - 0x1.8p52;
    const double r = (in - k * 0x1.62e42feep-1) - k * 0x1.a39ef35793c76p-33;
    double p = 1 / 6227020800.0;
    p = p * r + 1 / 479001600.0;
    p = p * r + 1 / 39916800.0;
    p = p * r + 1 / 3628800.0;
    p = p * r + 1 / 362880.0;
    p = p * r + 1 / 40320.0;
    p = p * r + 1 / 5040.0;
    p = p * r + 1 / 720.0;
    p = p * r + 1 / 120.0;
    p = p * r + 1 / 24.0;
    p = p * r + 1 / 6.0;
    p = p * r + 0.5;
    p = p * r + 1;
    p = p * r + 1;
    uint64_t bits;
    double scale;
    memcpy(&bits, &shifted, sizeof bits);
    bits = (bits + 1023) << 52;
    memcpy(&scale, &bits, sizeof scale);
    return p * scale;
}
#endif

#endif
