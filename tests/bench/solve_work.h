/** A matte cloth under near lights in memory, and the solver timed on it: what the solver's benchmarks share.
 */
#ifndef WEFT_TESTS_BENCH_SOLVE_WORK_H
#define WEFT_TESTS_BENCH_SOLVE_WORK_H

#include "host/solve/solve_row.h"

enum { WORK_OUTPUTS = 9 };

typedef struct work {
    int width, height, n;
    weft_calibration cal;
    weft_incidence incidence;
    float *in[WEFT_LIGHTS_MAX]; /* [height][width] linear values of a mosaic */
    uint8_t *clipped[WEFT_LIGHTS_MAX];
    float *out[WORK_OUTPUTS]; /* normal, albedo, residual, confidence, angle; one behind the other */
    float *sites;             /* the albedo's mosaic while it is made three planes */
    uint8_t *bytes[3];
} work;

/** Waves with slopes to 22 degrees and one part in 200 of noise under n >= 3 lights; ends the program when
 * there is no memory. */
void work_init(work *w, int width, int height, int n);
void work_fini(work *w);

/** Seconds of processor time that the program has used: what others do on the machine counts less. */
double work_now_s(void);

/** Nanoseconds per pixel of one run over all rows.  `search_all` sends every pixel to the method's search. */
double work_solve_ns(work *w, const weft_solve_method *method, const weft_gloss *gloss, bool search_all);

/** Of reading the same input planes once (summed, so that nothing can be left out) and writing the outputs
 * once: 5 n + 39 bytes a pixel, a float and a byte per light, then normal, albedo, residual, confidence and
 * uncertainty as floats, and lights, quality and mask as bytes. */
double work_move_ns(work *w);

/** Of making three planes of the albedo's one, which is overwritten. */
double work_demosaic_ns(work *w);

/** Of what seams between yarns add to the uncertainty, of the last run's answers. */
double work_seams_ns(work *w);

/** *least becomes the smaller of both; NaN counts as nothing. */
void work_take_less(double *least, double value);

#endif
