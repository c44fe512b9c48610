/**
 * Real orthonormal spherical harmonics of three bands, without Condon-Shortley sign, z up (S-CNV-05).
 *
 * Coefficient k = l (l + 1) + m, so the order is (0,0) (1,-1) (1,0) (1,1) (2,-2) ... (2,2).
 */
#ifndef WEFT_SHADING_LIGHTING_SPHERICAL_HARMONICS_H
#define WEFT_SHADING_LIGHTING_SPHERICAL_HARMONICS_H

#include <math.h>

enum { WEFT_SH_BANDS = 3, WEFT_SH_COUNT = 9 };

/** The nine values at the unit vector (x, y, z).  Source: S-CNV-05. */
static inline void weft_sh_basis(double x, double y, double z, double basis[WEFT_SH_COUNT])
{
    const double k1 = 0.48860251190291992159, k2 = 1.09254843059207907054;
    basis[0] = 0.28209479177387814347;
    basis[1] = k1 * y;
    basis[2] = k1 * z;
    basis[3] = k1 * x;
    basis[4] = k2 * x * y;
    basis[5] = k2 * y * z;
    basis[6] = 0.31539156525252000603 * (3 * z * z - 1);
    basis[7] = k2 * x * z;
    basis[8] = 0.54627421529603953527 * (x * x - y * y);
}

/** Y_l0 at a cosine to the axis; l 0..2. */
static inline double weft_sh_zonal(int l, double cosine)
{
    return l == 0   ? 0.28209479177387814347
           : l == 1 ? 0.48860251190291992159 * cosine
                    : 0.31539156525252000603 * (3 * cosine * cosine - 1);
}

/** Zonal coefficients of the clamped cosine: sqrt(pi)/2, sqrt(pi/3), sqrt(5 pi)/8.  Source: S-ORD-12. */
static const double weft_sh_cosine[WEFT_SH_BANDS] = {0.88622692545275801365, 1.02332670794648848847,
                                                     0.49541591220075136667};

/**
 * A kernel that is round about the axis n, with zonal coefficients A_l, applied to light L_lm:
 *
 *     sum over l, m of sqrt(4 pi/(2 l + 1)) A_l L_lm Y_lm(n),   m = -l..l
 *
 * With weft_sh_cosine it is the irradiance; with the zonal coefficients of skin its transfer.  The seed
 * prints m from -1, which would lose (2, -2).  Source: The Order eq. 20; S-ORD-13, S-FC3-07.
 */
static inline double weft_sh_convolve(const double n[3], const double zonal[WEFT_SH_BANDS],
                                      const double light[WEFT_SH_COUNT])
{
    double basis[WEFT_SH_COUNT], sum = 0;
    weft_sh_basis(n[0], n[1], n[2], basis);
    for (int l = 0, k = 0; l < WEFT_SH_BANDS; l++) {
        const double turn = sqrt(4 * 3.14159265358979323846 / (2 * l + 1)) * zonal[l];
        for (int m = -l; m <= l; m++, k++)
            sum += turn * light[k] * basis[k];
    }
    return sum;
}

#endif
