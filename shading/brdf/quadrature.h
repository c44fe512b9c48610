/** Double-exponential (tanh-sinh) quadrature: exact to rounding for functions that are smooth inside the
 *  interval, whatever they do at its ends (roots, kinks).  Source: Takahasi and Mori 1974. */
#ifndef WEFT_SHADING_BRDF_QUADRATURE_H
#define WEFT_SHADING_BRDF_QUADRATURE_H

#define WEFT_QUADRATURE_MAX 128

/** Nodes of the interval 0..1. */
typedef struct weft_quadrature {
    int n;
    double at[WEFT_QUADRATURE_MAX];     /* position, 0..1 */
    double to_end[WEFT_QUADRATURE_MAX]; /* 1 - position, with full digits near the end */
    double weight[WEFT_QUADRATURE_MAX]; /* sum 1 */
} weft_quadrature;

/** `per_unit` steps per unit of the transformed variable: 8 gives about 8 digits, 16 all of them. */
void weft_quadrature_init(weft_quadrature *q, int per_unit);

#endif
