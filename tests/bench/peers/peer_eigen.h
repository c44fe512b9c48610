/** What programs that use Eigen do with one pixel; only where Eigen is installed. */
#ifndef WEFT_TESTS_BENCH_PEERS_PEER_EIGEN_H
#define WEFT_TESTS_BENCH_PEERS_PEER_EIGEN_H

#ifdef __cplusplus
extern "C" {
#endif

/** Solves `n_pixels` systems of `n` rows; nanoseconds per pixel.
 *  rows: [n_pixels][n][3]; samples: [n_pixels][n]; scaled: [n_pixels][3] */
typedef double weft_peer_fn(int n_pixels, int n, const double *rows, const double *samples, double *scaled);

typedef struct weft_peer_eigen_functions {
    weft_peer_fn *jacobi_ns;  /* JacobiSVD of a fixed 10 x 3 in double, full U and V: the paper's method */
    weft_peer_fn *relight_ns; /* dynamic matrices, (L^T L).ldlt(): RelightLab's pattern */
} weft_peer_eigen_functions;

/** NULL in a build without Eigen. */
const weft_peer_eigen_functions *weft_peer_eigen(void);

#ifdef __cplusplus
}
#endif
#endif
