/** Vectors of three and matrices of three by three, row by row, double.  Everything inline. */
#ifndef WEFT_CORE_LINALG_H
#define WEFT_CORE_LINALG_H

#include <math.h>
#include <stdbool.h>
#include <stddef.h>

typedef struct weft_vec3 {
    double x, y, z;
} weft_vec3;

typedef struct weft_mat3 {
    double m[9]; /* row by row */
} weft_mat3;

static inline weft_vec3 weft_add(weft_vec3 a, weft_vec3 b)
{
    return (weft_vec3){a.x + b.x, a.y + b.y, a.z + b.z};
}

static inline weft_vec3 weft_sub(weft_vec3 a, weft_vec3 b)
{
    return (weft_vec3){a.x - b.x, a.y - b.y, a.z - b.z};
}

static inline weft_vec3 weft_scale(weft_vec3 a, double s)
{
    return (weft_vec3){a.x * s, a.y * s, a.z * s};
}

static inline double weft_dot(weft_vec3 a, weft_vec3 b)
{
    return a.x * b.x + a.y * b.y + a.z * b.z;
}

static inline weft_vec3 weft_cross(weft_vec3 a, weft_vec3 b)
{
    return (weft_vec3){a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

static inline double weft_length(weft_vec3 a)
{
    return sqrt(weft_dot(a, a));
}

/** Unit vector of `a`; (0, 0, 1) for the zero vector. */
static inline weft_vec3 weft_normalise(weft_vec3 a)
{
    const double n = weft_length(a);
    return n > 0 ? weft_scale(a, 1 / n) : (weft_vec3){0, 0, 1};
}

/** Angle between two vectors in radians, exact for small angles too. */
static inline double weft_angle_between(weft_vec3 a, weft_vec3 b)
{
    return atan2(weft_length(weft_cross(a, b)), weft_dot(a, b));
}

static inline weft_vec3 weft_mat3_apply(const weft_mat3 *a, weft_vec3 x)
{
    const double *const m = a->m;
    return (weft_vec3){m[0] * x.x + m[1] * x.y + m[2] * x.z, m[3] * x.x + m[4] * x.y + m[5] * x.z,
                       m[6] * x.x + m[7] * x.y + m[8] * x.z};
}

static inline weft_mat3 weft_mat3_transpose(const weft_mat3 *a)
{
    const double *const m = a->m;
    return (weft_mat3){{m[0], m[3], m[6], m[1], m[4], m[7], m[2], m[5], m[8]}};
}

static inline weft_mat3 weft_mat3_multiply(const weft_mat3 *a, const weft_mat3 *b)
{
    weft_mat3 c;
    for (size_t i = 0; i < 3; i++)
        for (size_t j = 0; j < 3; j++)
            c.m[3 * i + j] =
                a->m[3 * i] * b->m[j] + a->m[3 * i + 1] * b->m[3 + j] + a->m[3 * i + 2] * b->m[6 + j];
    return c;
}

static inline double weft_mat3_determinant(const weft_mat3 *a)
{
    const double *const m = a->m;
    return m[0] * (m[4] * m[8] - m[5] * m[7]) - m[1] * (m[3] * m[8] - m[5] * m[6]) +
           m[2] * (m[3] * m[7] - m[4] * m[6]);
}

/** Inverse by cofactors.  @return false (inverse untouched) when the determinant is 0 or not finite. */
static inline bool weft_mat3_invert(const weft_mat3 *a, weft_mat3 *inverse)
{
    const double *const m = a->m;
    const double det = weft_mat3_determinant(a);
    if (det == 0 || !isfinite(det))
        return false;
    const double s = 1 / det;
    *inverse = (weft_mat3){
        {(m[4] * m[8] - m[5] * m[7]) * s, (m[2] * m[7] - m[1] * m[8]) * s, (m[1] * m[5] - m[2] * m[4]) * s,
         (m[5] * m[6] - m[3] * m[8]) * s, (m[0] * m[8] - m[2] * m[6]) * s, (m[2] * m[3] - m[0] * m[5]) * s,
         (m[3] * m[7] - m[4] * m[6]) * s, (m[1] * m[6] - m[0] * m[7]) * s, (m[0] * m[4] - m[1] * m[3]) * s}};
    return true;
}

#endif
