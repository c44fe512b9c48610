/* The charts: numbers and where they are from.  tests/calibration/check_chart.c computes them again. */
#include "calibration/charts/chart.h"

#include <stdbool.h>
#include <stdio.h>
#include <string.h>

/* The classic chart of 24 patches: pitch and patch of the scanner's own prints, and of the virtual one. */
#define MACBETH_GEOMETRY .columns = 6, .rows = 4, .pitch_mm = 20, .patch_mm = 16, .border_mm = 6

/*
 * One chart measured by N. Ohta, 1997 (the spectra of ISO 17321-1), 380-780 nm in steps of 5 nm, under CIE
 * D65 (5 nm), CIE 1931 observer, sums over the 81 samples, Y = 1 for the perfect diffuser; then the inverse
 * of the four-digit sRGB matrix (S-CNV-06).  Spectra as distributed by colour-science (BSD-3-Clause).
 */
static const weft_chart macbeth_ohta1997 = {
    .name = "macbeth",
    .edition = "ohta1997",
    .summary = "24 patches, colours of the spectra of Ohta 1997 under D65",
    MACBETH_GEOMETRY,
    .patches =
        {
            {"dark skin", {0.176176, 0.078216, 0.050315}, 0},
            {"light skin", {0.559430, 0.308737, 0.222828}, 0},
            {"blue sky", {0.113152, 0.199214, 0.336137}, 0},
            {"foliage", {0.094586, 0.148402, 0.049885}, 0},
            {"blue flower", {0.236274, 0.225863, 0.443819}, 0},
            {"bluish green", {0.133831, 0.517000, 0.402854}, 0},
            {"orange", {0.701415, 0.199228, 0.022921}, 0},
            {"purplish blue", {0.068376, 0.105999, 0.377106}, 0},
            {"moderate red", {0.558120, 0.090613, 0.121993}, 0},
            {"purple", {0.107788, 0.044344, 0.146820}, 0},
            {"yellow green", {0.348882, 0.501927, 0.047734}, 0},
            {"orange yellow", {0.791675, 0.364997, 0.026783}, 0},
            {"blue", {0.027213, 0.047815, 0.309137}, 0},
            {"green", {0.060131, 0.305571, 0.060616}, 0},
            {"red", {0.446115, 0.028487, 0.042072}, 0},
            {"yellow", {0.851889, 0.579564, 0.010529}, 0},
            {"magenta", {0.506085, 0.088976, 0.297206}, 0},
            {"cyan", {-0.033395, 0.248800, 0.385407}, 0},
            {"white 9.5", {0.886860, 0.888624, 0.874589}, 9.5},
            {"neutral 8", {0.586364, 0.583277, 0.582155}, 8},
            {"neutral 6.5", {0.358267, 0.358088, 0.358725}, 6.5},
            {"neutral 5", {0.203157, 0.202975, 0.203527}, 5},
            {"neutral 3.5", {0.091062, 0.092876, 0.094243}, 3.5},
            {"black 2", {0.032665, 0.033638, 0.035266}, 2},
        },
};

/*
 * X-Rite's published L*a*b* (D50, 2 degree observer) of charts made before and after November 2014 (the
 * formulation changed then; mean difference 0.85, the white patch 1.95 CIEDE2000), Bradford-adapted from
 * D50 (x 0.3457, y 0.3585) to D65 (x 0.3127, y 0.3290); then the inverse of the four-digit sRGB matrix.
 */
static const weft_chart macbeth_before2014 = {
    .name = "macbeth",
    .edition = "before2014",
    .summary = "24 patches, published L*a*b* of charts made before November 2014",
    MACBETH_GEOMETRY,
    .patches =
        {
            {"dark skin", {0.173019, 0.082120, 0.056734}, 0},
            {"light skin", {0.568276, 0.292726, 0.218381}, 0},
            {"blue sky", {0.103669, 0.195881, 0.331255}, 0},
            {"foliage", {0.101572, 0.148927, 0.051889}, 0},
            {"blue flower", {0.221556, 0.215852, 0.434627}, 0},
            {"bluish green", {0.107971, 0.514372, 0.412657}, 0},
            {"orange", {0.747341, 0.200673, 0.028108}, 0},
            {"purplish blue", {0.057556, 0.105166, 0.402969}, 0},
            {"moderate red", {0.566755, 0.084280, 0.119716}, 0},
            {"purple", {0.110987, 0.042313, 0.142931}, 0},
            {"yellow green", {0.345387, 0.508739, 0.049461}, 0},
            {"orange yellow", {0.794564, 0.359471, 0.020552}, 0},
            {"blue", {0.017091, 0.050218, 0.292211}, 0},
            {"green", {0.055929, 0.300213, 0.068718}, 0},
            {"red", {0.455856, 0.030364, 0.040873}, 0},
            {"yellow", {0.857293, 0.567624, 0.006887}, 0},
            {"magenta", {0.533474, 0.088639, 0.307527}, 0},
            {"cyan", {-0.037456, 0.246987, 0.400419}, 0},
            {"white 9.5", {0.912470, 0.914981, 0.893724}, 9.5},
            {"neutral 8", {0.579717, 0.592030, 0.593323}, 8},
            {"neutral 6.5", {0.354843, 0.365464, 0.367575}, 6.5},
            {"neutral 5", {0.190041, 0.191874, 0.193095}, 5},
            {"neutral 3.5", {0.085277, 0.088884, 0.092581}, 3.5},
            {"black 2", {0.030314, 0.031140, 0.032750}, 2},
        },
};

static const weft_chart macbeth_after2014 = {
    .name = "macbeth",
    .edition = "after2014",
    .summary = "24 patches, published L*a*b* of charts made since November 2014",
    MACBETH_GEOMETRY,
    .patches =
        {
            {"dark skin", {0.173692, 0.078783, 0.052855}, 0},
            {"light skin", {0.559806, 0.277416, 0.210889}, 0},
            {"blue sky", {0.104183, 0.188911, 0.328925}, 0},
            {"foliage", {0.105744, 0.150748, 0.050836}, 0},
            {"blue flower", {0.227424, 0.212397, 0.426440}, 0},
            {"bluish green", {0.115259, 0.507435, 0.411121}, 0},
            {"orange", {0.745954, 0.202100, 0.029869}, 0},
            {"purplish blue", {0.058719, 0.101181, 0.387742}, 0},
            {"moderate red", {0.560166, 0.080122, 0.114585}, 0},
            {"purple", {0.109166, 0.041995, 0.138135}, 0},
            {"yellow green", {0.332757, 0.497365, 0.042595}, 0},
            {"orange yellow", {0.771085, 0.357873, 0.020450}, 0},
            {"blue", {0.020938, 0.047534, 0.284124}, 0},
            {"green", {0.046052, 0.292044, 0.061477}, 0},
            {"red", {0.446203, 0.036381, 0.040551}, 0},
            {"yellow", {0.841732, 0.574357, 0.004663}, 0},
            {"magenta", {0.522364, 0.077789, 0.289310}, 0},
            {"cyan", {-0.043952, 0.233666, 0.377183}, 0},
            {"white 9.5", {0.879518, 0.884980, 0.834234}, 9.5},
            {"neutral 8", {0.584484, 0.592137, 0.584469}, 8},
            {"neutral 6.5", {0.357687, 0.367058, 0.365260}, 6.5},
            {"neutral 5", {0.190091, 0.190856, 0.189810}, 5},
            {"neutral 3.5", {0.085928, 0.088731, 0.089803}, 3.5},
            {"black 2", {0.031354, 0.031494, 0.032322}, 2},
        },
};

/*
 * Twelve chips of the matte Munsell neutral scale, lightest first; reflectance from V by ASTM D1535.
 * Below N2 only glossy chips exist, which mirror the lights and are out of place here.
 */
static const weft_chart munsell_nominal = {
    .name = "munsell",
    .edition = "nominal",
    .summary = "12 matte neutrals N9.5 to N2, nominal reflectance (ASTM D1535)",
    .columns = 6,
    .rows = 2,
    .pitch_mm = 20,
    .patch_mm = 16,
    .border_mm = 6,
    .patches =
        {
            {"N 9.5", {0.877559, 0.877559, 0.877559}, 9.5},
            {"N 9", {0.766956, 0.766956, 0.766956}, 9},
            {"N 8.5", {0.666863, 0.666863, 0.666863}, 8.5},
            {"N 8", {0.576196, 0.576196, 0.576196}, 8},
            {"N 7", {0.419854, 0.419854, 0.419854}, 7},
            {"N 6.5", {0.352964, 0.352964, 0.352964}, 6.5},
            {"N 6", {0.293012, 0.293012, 0.293012}, 6},
            {"N 5", {0.192718, 0.192718, 0.192718}, 5},
            {"N 4.5", {0.151902, 0.151902, 0.151902}, 4.5},
            {"N 3.5", {0.087783, 0.087783, 0.087783}, 3.5},
            {"N 3", {0.063912, 0.063912, 0.063912}, 3},
            {"N 2", {0.030481, 0.030481, 0.030481}, 2},
        },
};

const weft_chart *const weft_charts[] = {
    &macbeth_ohta1997, &macbeth_before2014, &macbeth_after2014, &munsell_nominal, NULL,
};

/* "macbeth (ohta1997, before2014), munsell (nominal)" for the message of weft_chart_find(). */
static void list_charts(char *text, size_t size)
{
    size_t n = 0;
    for (const weft_chart *const *c = weft_charts; *c; c++) {
        const bool first = c == weft_charts || strcmp(c[-1]->name, (*c)->name) != 0;
        const bool last = !c[1] || strcmp(c[1]->name, (*c)->name) != 0;
        const int k = snprintf(text + n, size - n, "%s%s%s%s%s", first && n ? "; " : "",
                               first ? (*c)->name : ",", first ? " (" : " ", (*c)->edition, last ? ")" : "");
        n = k > 0 && n + (size_t)k < size ? n + (size_t)k : size - 1;
    }
}

weft_err weft_chart_find(const char *name, const char *edition, const weft_chart **chart, weft_error *err)
{
    for (const weft_chart *const *c = weft_charts; *c; c++)
        if (strcmp((*c)->name, name) == 0 &&
            (!edition || !edition[0] || strcmp((*c)->edition, edition) == 0)) {
            *chart = *c;
            return WEFT_OK;
        }
    char known[256];
    list_charts(known, sizeof known);
    return weft_fail(err, WEFT_ERR_USAGE, "no chart \"%s\"%s%s%s; there are: %s", name,
                     edition && edition[0] ? " of edition \"" : "", edition && edition[0] ? edition : "",
                     edition && edition[0] ? "\"" : "", known);
}

void weft_chart_patch_centre(const weft_chart *chart, int patch, double *x_mm, double *y_mm)
{
    const int column = patch % chart->columns, row = patch / chart->columns;
    *x_mm = (column - 0.5 * (chart->columns - 1)) * chart->pitch_mm;
    *y_mm = (0.5 * (chart->rows - 1) - row) * chart->pitch_mm;
}

double weft_munsell_reflectance(double value)
{
    const double v = value;
    return 0.01 * v * (1.1914 + v * (-0.22533 + v * (0.23352 + v * (-0.020484 + v * 0.00081939))));
}
