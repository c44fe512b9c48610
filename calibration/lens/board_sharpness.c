/* How wide the edges of a board's squares are in a picture: blur of focus or motion. */
#include "calibration/lens/lens_fit.h"

#include <math.h>
#include <stdlib.h>

#define MIDDLE  20 /* of the samples */
#define SAMPLES (2 * MIDDLE + 1)
#define REACH   0.36 /* of the spacing, to both sides of the edge */

static double grey_at(const uint8_t *grey, int width, int height, double u, double v)
{
    const double x = fmin(fmax(u, 0), width - 1.001), y = fmin(fmax(v, 0), height - 1.001);
    const int i = (int)x, j = (int)y;
    const double a = x - i, b = y - j;
    const uint8_t *const p = grey + (size_t)j * (size_t)width + (size_t)i, *const q = p + width;
    return (1 - b) * ((1 - a) * p[0] + a * p[1]) + b * ((1 - a) * q[0] + a * q[1]);
}

/* Width of the edge between two neighbouring corners, px: contrast over the steepest slope, across its
 * middle. */
static double edge_width(const uint8_t *grey, int width, int height, const float *p, const float *q)
{
    const double du = (double)(q[0] - p[0]), dv = (double)(q[1] - p[1]), length = hypot(du, dv);
    const double mu = 0.5 * (double)(p[0] + q[0]), mv = 0.5 * (double)(p[1] + q[1]);
    const double step = 2 * REACH * length / (SAMPLES - 1);
    double profile[SAMPLES], least = 255, most = 0, slope = 0;
    for (int k = 0; k < SAMPLES; k++) {
        const double t = (k - MIDDLE) * step;
        profile[k] = grey_at(grey, width, height, mu - dv / length * t, mv + du / length * t);
        least = fmin(least, profile[k]);
        most = fmax(most, profile[k]);
    }
    const int pitch =
        step < 1 ? (int)(1 / step) + 1 : 1; /* over a pixel or more, so that noise is no slope */
    for (int k = pitch; k < SAMPLES; k++)
        slope = fmax(slope, fabs(profile[k] - profile[k - pitch]) / (pitch * step));
    return slope > 0 ? (most - least) / slope : length;
}

static int compare_doubles(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

double weft_board_edge_width(const uint8_t *grey, int width, int height, const weft_board *board,
                             const float *corners, double *share)
{
    double widths[2 * WEFT_BOARD_MAX_SIDE], spacings[2 * WEFT_BOARD_MAX_SIDE];
    int n = 0;
    /* The diagonal's edges, along and across: enough, and spread over the board. */
    for (int k = 0; k < board->columns - 1 || k < board->rows - 1; k++) {
        const int r = k % (board->rows - 1), c = k % (board->columns - 1);
        const float *const p = corners + 2 * ((size_t)r * (size_t)board->columns + (size_t)c);
        for (int across = 0; across < 2; across++, n++) {
            const float *const q = across ? p + 2 * (size_t)board->columns : p + 2;
            widths[n] = edge_width(grey, width, height, p, q);
            spacings[n] = hypot((double)(q[0] - p[0]), (double)(q[1] - p[1]));
        }
    }
    qsort(widths, (size_t)n, sizeof *widths, compare_doubles);
    qsort(spacings, (size_t)n, sizeof *spacings, compare_doubles);
    *share = widths[n / 2] / spacings[n / 2];
    return widths[n / 2];
}
