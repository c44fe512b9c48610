/**
 * The precision that a reflectance model is built in.
 *
 * The files brdf_MODEL.c and the headers of their terms are written once, over weft_real, and compiled twice:
 * as they stand in double precision, and with WEFT_SINGLE defined in single precision
 * (shading/CMakeLists.txt), where only the evaluation is left of a model.  Double is the reference; single is
 * what pictures are made with.
 *
 * What single precision asks of a term: constants in WEFT_R(), and no difference of two numbers that may be
 * nearly equal where it can be had from the directions or by factoring.
 */
#ifndef WEFT_SHADING_BRDF_REAL_H
#define WEFT_SHADING_BRDF_REAL_H

#include "core/clones.h"
#include "shading/brdf/brdf.h"

#include <math.h>

#ifdef WEFT_SINGLE
typedef float weft_real;
typedef weft_brdf_batch_f32 weft_brdf_batch_real;
#define WEFT_R(constant)    constant##F
#define WEFT_KERNEL(name)   name##_f32 /* of a function that is built in both precisions */
#define weft_sqrt(x)        sqrtf(x)
#define weft_abs(x)         fabsf(x)
#define weft_copysign(x, y) copysignf(x, y)
#else
typedef double weft_real;
typedef weft_brdf_batch weft_brdf_batch_real;
#define WEFT_R(constant)    constant
#define WEFT_KERNEL(name)   name
#define weft_sqrt(x)        sqrt(x)
#define weft_abs(x)         fabs(x)
#define weft_copysign(x, y) copysign(x, y)
#endif

#define WEFT_PI  WEFT_R(3.14159265358979323846)
#define WEFT_LN2 WEFT_R(0.69314718055994530942)

/** max(a, b) that compiles to one instruction: fmax() must care for NaN. */
WEFT_INLINE weft_real weft_max(weft_real a, weft_real b)
{
    return a > b ? a : b;
}

/** a at t = 0, b at t = 1, both exact, and to the last digits between. */
WEFT_INLINE weft_real weft_mix(weft_real a, weft_real b, weft_real t)
{
    return a * (1 - t) + b * t;
}

/** The evaluations in both precisions; brdf.h says what they do. */
#define WEFT_BRDF_KERNEL(model)                                                                              \
    void weft_brdf_eval_##model(const weft_brdf_batch *batch, double *const value[3]);                       \
    void weft_brdf_eval_##model##_f32(const weft_brdf_batch_f32 *batch, float *const value[3]);

WEFT_BRDF_KERNEL(lambert)
WEFT_BRDF_KERNEL(balanced)
WEFT_BRDF_KERNEL(coupled)
WEFT_BRDF_KERNEL(multiscatter)
WEFT_BRDF_KERNEL(ggx_specular)
WEFT_BRDF_KERNEL(ggx_aniso)
WEFT_BRDF_KERNEL(ggx)
WEFT_BRDF_KERNEL(beckmann)
WEFT_BRDF_KERNEL(blinn_phong)
WEFT_BRDF_KERNEL(cook_torrance)
WEFT_BRDF_KERNEL(unreal)
WEFT_BRDF_KERNEL(disney)
WEFT_BRDF_KERNEL(cloth)
WEFT_BRDF_KERNEL(cloth_two_tone)
WEFT_BRDF_KERNEL(ggx_cloth)
WEFT_BRDF_KERNEL(charlie)

#endif
