/** Order statistics for measuring in the presence of dust, hot pixels and glints. */
#ifndef WEFT_CALIBRATION_CHARTS_ROBUST_H
#define WEFT_CALIBRATION_CHARTS_ROBUST_H

/** The k-th smallest (0..n-1) of n > 0 values; reorders them (Hoare's quickselect, linear on average). */
double weft_select(double *values, int n, int k);

/** Median; reorders the values; 0 for n = 0. */
double weft_median(double *values, int n);

/** Mean and standard deviation without outliers. */
typedef struct weft_robust_mean {
    double mean, std_dev;
    int n, kept;
} weft_robust_mean;

/**
 * Mean and standard deviation of the values within 3.5 robust sigmas (1.4826 times the median absolute
 * deviation) of the median.  For normal noise 99.95 % are kept and the mean has the accuracy of a mean.
 *
 * @param values   n values, reordered
 * @param scratch  room for n
 */
weft_robust_mean weft_mean_robust(double *values, int n, double *scratch);

#endif
