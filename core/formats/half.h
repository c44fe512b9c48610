/** IEEE 754 half precision, as EXR stores it. */
#ifndef WEFT_CORE_FORMATS_HALF_H
#define WEFT_CORE_FORMATS_HALF_H

#include <stddef.h>
#include <stdint.h>
#include <string.h>

/**
 * The half nearest to `value`, ties to even.  Finite values beyond the range become the largest finite
 * half (65504): a clipped highlight must not turn into infinity.  Infinities and NaN stay what they are.
 */
static inline uint16_t weft_half_bits(float value)
{
    uint32_t bits;
    memcpy(&bits, &value, sizeof bits);
    const uint16_t sign = (uint16_t)(bits >> 16 & 0x8000);
    const uint32_t a = bits & 0x7fffffff;
    if (a >= 0x7f800000) /* infinity, NaN */
        return (uint16_t)(sign | 0x7c00 | (a > 0x7f800000 ? 0x200 : 0));
    if (a >= 0x477ff000) /* would round to 2^16 */
        return (uint16_t)(sign | 0x7bff);
    if (a < 0x38800000) { /* below 2^-14: adding 0.5 leaves the rounded subnormal in the low bits */
        float shifted, magnitude;
        memcpy(&magnitude, &a, sizeof magnitude);
        shifted = magnitude + 0.5f;
        uint32_t s;
        memcpy(&s, &shifted, sizeof s);
        return (uint16_t)(sign | (s - 0x3f000000));
    }
    const uint32_t rounded = a + 0xfff + (a >> 13 & 1) - 0x38000000;
    return (uint16_t)(sign | rounded >> 13);
}

/** `n` floats to halves. */
static inline void weft_half_from_float(uint16_t *halves, const float *values, size_t n)
{
    for (size_t i = 0; i < n; i++)
        halves[i] = weft_half_bits(values[i]);
}

/** The value of a half, exact. */
static inline float weft_half_value(uint16_t half)
{
    const uint32_t sign = (uint32_t)(half & 0x8000) << 16, a = half & 0x7fff;
    uint32_t bits;
    float value;
    if (a >= 0x7c00)
        bits = sign | 0x7f800000 | (a & 0x3ff) << 13;
    else if (a >= 0x400)
        bits = sign | ((a << 13) + 0x38000000);
    else { /* zero and subnormal: a * 2^-24 */
        value = (float)a * 0x1p-24f;
        memcpy(&bits, &value, sizeof bits);
        bits |= sign;
    }
    memcpy(&value, &bits, sizeof value);
    return value;
}

#endif
