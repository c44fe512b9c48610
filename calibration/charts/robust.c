#include "calibration/charts/robust.h"

#include <assert.h>
#include <math.h>

double weft_select(double *values, int n, int k)
{
    assert(n > 0 && k >= 0 && k < n);
    int lo = 0, hi = n - 1;
    while (lo < hi) {
        const double pivot = values[lo + (hi - lo) / 2];
        int i = lo, j = hi;
        while (i <= j) {
            while (values[i] < pivot)
                i++;
            while (values[j] > pivot)
                j--;
            if (i <= j) {
                const double swap = values[i];
                values[i++] = values[j];
                values[j--] = swap;
            }
        }
        if (k <= j)
            hi = j;
        else if (k >= i)
            lo = i;
        else
            break;
    }
    return values[k];
}

double weft_median(double *values, int n)
{
    if (n == 0)
        return 0;
    const double upper = weft_select(values, n, n / 2);
    if (n % 2)
        return upper;
    double lower = values[0]; /* the lower half lies in front of the upper median */
    for (int i = 1; i < n / 2; i++)
        lower = fmax(lower, values[i]);
    return 0.5 * (lower + upper);
}

weft_robust_mean weft_mean_robust(double *values, int n, double *scratch)
{
    weft_robust_mean result = {.n = n};
    if (n == 0)
        return result;
    const double median = weft_median(values, n);
    double sum = 0, square = 0;
    for (int i = 0; i < n; i++) {
        scratch[i] = fabs(values[i] - median);
        sum += scratch[i];
    }
    const double deviation = weft_median(scratch, n);
    /* Where most values are the same number (8-bit pictures), the mean deviation still tells their spread. */
    const double limit = 3.5 * (deviation > 0 ? 1.4826 * deviation : 1.2533 * sum / n);
    sum = 0;
    for (int i = 0; i < n; i++) {
        const double d = values[i] - median;
        if (fabs(d) > limit)
            continue;
        sum += d;
        square += d * d;
        result.kept++;
    }
    const double mean = sum / result.kept;
    result.mean = median + mean;
    result.std_dev = result.kept > 1 ? sqrt(fmax(square - sum * mean, 0) / (result.kept - 1)) : 0;
    return result;
}
