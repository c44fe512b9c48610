/** One row of pixels through a solver method: the loop that all the work of `weft solve` goes through. */
#ifndef WEFT_HOST_SOLVE_SOLVE_ROW_H
#define WEFT_HOST_SOLVE_SOLVE_ROW_H

#include "host/solve/incidence.h"
#include "host/solve/samples.h"

/** One row under one light. */
typedef struct weft_solve_row_in {
    const float *rgb[3];    /* [width] linear values (1/s); all three the same for grey and mosaics */
    const uint8_t *clipped; /* [width] non-zero: not to be used; NULL: none */
    float least;            /* the largest channel must reach this (3 sigma of black); 0: no rule */
    float most;             /* and not exceed this (98 % of saturation); 0: no rule */
    float read;             /* variance of black, (1/s)^2; 0 with shot 0: the noise is not known */
    float shot;             /* variance per linear value */
} weft_solve_row_in;

/** Where the answers of a row go; all [width]. */
typedef struct weft_solve_row_out {
    float *normal[3], *residual, *confidence;
    float *angle;              /* expected error of the normal, radians */
    uint8_t *lights, *quality; /* lights used; weft_solve_quality bits */
    float *albedo[3];          /* of a mosaic only [0] is written: each site's own colour */
    uint8_t *valid;            /* 255 or 0 */
} weft_solve_row_out;

/** What is the same for every row. */
typedef struct weft_solve_plan {
    const weft_incidence *incidence;
    const weft_solve_method *method;
    int width;
    weft_cfa cfa;            /* rows are of a mosaic and every site is solved by its own colour; or NONE */
    float shadow;            /* samples below this part of the pixel's brightest I' are left out; 0: none */
    const weft_gloss *gloss; /* what is known of the mirror light; NULL: nothing */
    bool search_all;         /* benchmarks only: send every answered pixel to the method's search */
} weft_solve_plan;

/**
 * Solves one row.
 *
 * A mosaic needs no demosaicing here: all samples of a site are of one colour, and the normal does not ask
 * which.  Colours made up from neighbours under ten lights would blur the normals of fine weave by degrees.
 *
 * A sample is left out when it is clipped, not finite, below `least`, above `most`, or where its light does
 * not shine. Pure and without allocation; from any thread.  The same input gives the same bits on any thread.
 *
 * @param in   [n_lights]
 * @param row  its parity tells the colours of a mosaic
 * @param out  every element is written
 */
void weft_solve_row(const weft_solve_plan *plan, int row, const weft_solve_row_in *in,
                    const weft_solve_row_out *out);

/** The samples of one block of 16 pixels as the methods see them, `view` included: for fits over a picture.
 *  @param block  column / 16 */
void weft_solve_gather(const weft_solve_plan *plan, int row, int block, const weft_solve_row_in *in,
                       weft_solve_samples *samples);

#endif
