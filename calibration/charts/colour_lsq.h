/** Small weighted least squares for colour: columns scaled, pivoted QR, rank and condition told. */
#ifndef WEFT_CALIBRATION_CHARTS_COLOUR_LSQ_H
#define WEFT_CALIBRATION_CHARTS_COLOUR_LSQ_H

#include "calibration/charts/chart.h"

enum { WEFT_LSQ_TERMS_MAX = 6, WEFT_LSQ_SIDES_MAX = 3 };

/** Rows w (a x = b); the members are filled by the caller up to n_rows, n_terms, n_sides. */
typedef struct weft_colour_lsq {
    int n_rows, n_terms, n_sides;
    double a[WEFT_CHART_MAX_PATCHES][WEFT_LSQ_TERMS_MAX];
    double b[WEFT_CHART_MAX_PATCHES][WEFT_LSQ_SIDES_MAX];
    double weight[WEFT_CHART_MAX_PATCHES];
} weft_colour_lsq;

/**
 * Solves by LAPACK's dgelsy (QR with column pivoting) on columns of length 1.
 *
 * @param x          [side][term]
 * @param condition  of the scaled columns, by their singular values; may be NULL
 * @return the rank; -1 with fewer rows than terms or when LAPACK refuses
 */
int weft_colour_lsq_solve(const weft_colour_lsq *system, double x[WEFT_LSQ_SIDES_MAX][WEFT_LSQ_TERMS_MAX],
                          double *condition);

#endif
