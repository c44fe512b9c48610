/**
 * Real transforms of pictures: the bases in which difference operators are diagonal.
 *
 * Both are orthonormal and real, computed row by row and column by column on top of KISS FFT:
 *
 *     COSINE   X_k = c_k sum x_n cos(pi k (2n + 1) / 2N),  c_0 = sqrt(1/N), else sqrt(2/N)   (DCT-II)
 *     HARTLEY  X_k = sqrt(1/N) sum x_n (cos + sin)(2 pi k n / N)                             (its own
 * inverse)
 *
 * A picture that is mirrored at its edges has cosines, one that repeats has Hartley's.  The second difference
 * x_(n-1) - 2 x_n + x_(n+1) multiplies X_k by -weft_fourier_difference(kind, N, k).
 *
 * Any size; sizes with a large prime factor are slow.  Single precision: relative errors of some 1e-7.
 */
#ifndef WEFT_CORE_FOURIER_H
#define WEFT_CORE_FOURIER_H

#include "core/error.h"

typedef enum weft_fourier_kind { WEFT_FOURIER_COSINE, WEFT_FOURIER_HARTLEY } weft_fourier_kind;

/** Plans and scratch for pictures of one size. */
typedef struct weft_fourier weft_fourier;

/** @return WEFT_ERR_NOMEM */
weft_err weft_fourier_create(int width, int height, weft_fourier_kind kind, weft_fourier **fourier,
                             weft_error *err);
void weft_fourier_destroy(weft_fourier *fourier);

/** Transforms a plane [height][width] in place; on several threads, the same bits whatever their number. */
void weft_fourier_forward(weft_fourier *fourier, float *plane);
void weft_fourier_inverse(weft_fourier *fourier, float *plane);

/** 2 - 2 cos(pi k / N) for cosines, 2 - 2 cos(2 pi k / N) for Hartley's. */
double weft_fourier_difference(weft_fourier_kind kind, int n, int k);

#endif
