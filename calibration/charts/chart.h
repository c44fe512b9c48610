/**
 * Charts of known patches: what they are, where their patches lie, what colour they should have.
 *
 * A chart is a grid of square patches in a dark frame.  Chart coordinates are millimetres from the
 * middle of the chart, +x right, +y up, seen with the first patch at the top left.
 */
#ifndef WEFT_CALIBRATION_CHARTS_CHART_H
#define WEFT_CALIBRATION_CHARTS_CHART_H

#include "core/error.h"

#define WEFT_CHART_MAX_PATCHES 48

typedef struct weft_chart_patch {
    const char *name;      /* "dark skin", "N 9.5" */
    double linear_srgb[3]; /* reference colour under D65, 1 = perfect diffuser; not clipped to 0..1 */
    double munsell_value;  /* V of a Munsell neutral; 0 for coloured patches */
} weft_chart_patch;

typedef struct weft_chart {
    const char *name;    /* "macbeth", "munsell" */
    const char *edition; /* where the reference values come from: "ohta1997", "before2014", "nominal" */
    const char *summary;
    int columns, rows;
    double pitch_mm;                                  /* from patch centre to patch centre */
    double patch_mm;                                  /* side of a patch */
    double border_mm;                                 /* dark frame outside the outermost patches */
    weft_chart_patch patches[WEFT_CHART_MAX_PATCHES]; /* row by row from the top left */
} weft_chart;

/** All charts and editions; ends with NULL. */
extern const weft_chart *const weft_charts[];

/** The chart of a name and edition ("" takes its first).  WEFT_ERR_USAGE lists what there is. */
weft_err weft_chart_find(const char *name, const char *edition, const weft_chart **chart, weft_error *err);

/** Centre of a patch, mm. */
void weft_chart_patch_centre(const weft_chart *chart, int patch, double *x_mm, double *y_mm);

/** Luminous reflectance 0..1 of a Munsell neutral value V 0..10 (ASTM D1535 quintic, S-ORD-19). */
double weft_munsell_reflectance(double value);

#endif
