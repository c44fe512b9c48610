/**
 * Light, reflectance and sensor as spectra: where the colours of the virtual scanner come from.
 *
 * Everything is sampled at 380..780 nm in steps of 5 nm and integrated as the plain sum over the 81
 * samples.  The tables are compiled in; host/rig/data/SOURCE.md says where they are from.
 */
#ifndef WEFT_HOST_RIG_SPECTRA_H
#define WEFT_HOST_RIG_SPECTRA_H

#include "core/error.h"

#define WEFT_SPECTRUM_SAMPLES  81
#define WEFT_SPECTRUM_FIRST_NM 380
#define WEFT_SPECTRUM_STEP_NM  5

#define WEFT_SPECTRA_N_MACBETH 24
#define WEFT_SPECTRA_N_DYES    15

typedef struct weft_spectrum {
    double v[WEFT_SPECTRUM_SAMPLES];
} weft_spectrum;

/** All tables.  Read-only after weft_spectra_load(). */
typedef struct weft_spectra {
    weft_spectrum observer[3];                     /* CIE 1931 2 degree, x y z */
    weft_spectrum d65, led;                        /* relative power; the LED is CIE LED-B5 */
    weft_spectrum sensor[3];                       /* R G B response per unit power, maximum 1 each */
    weft_spectrum macbeth[WEFT_SPECTRA_N_MACBETH]; /* reflectance 0..1, Ohta 1997, row by row */
    weft_spectrum dyes[WEFT_SPECTRA_N_DYES];       /* reflectance 0..1 */
    char dye_names[WEFT_SPECTRA_N_DYES][16];       /* "patch68" */
} weft_spectra;

/** Parses the tables that are compiled in.  @return WEFT_ERR_FORMAT naming table and line. */
weft_err weft_spectra_load(weft_spectra *spectra, weft_error *err);

/** The dye of a name ("patch68"); WEFT_ERR_MISSING lists nothing but names the dye. */
weft_err weft_spectra_find_dye(const weft_spectra *spectra, const char *name, const weft_spectrum **dye,
                               weft_error *err);

/** Reflectance that is the same at all wavelengths. */
weft_spectrum weft_spectrum_flat(double reflectance);

/**
 * The LED with its blue pump stronger or weaker than the phosphor's light: the spread of one bin.
 *
 * Power is multiplied by `pump_scale` below 465 nm, by 1 above 495 nm and by a smooth step between.
 * 0.9..1.1 spans about 6200..7100 K, the colour bin that makers sell as 6500 K.
 */
weft_spectrum weft_spectra_led(const weft_spectra *spectra, double pump_scale);

/** Chromaticity x, y of an illuminant. */
void weft_spectra_white_point(const weft_spectra *spectra, const weft_spectrum *illuminant, double xy[2]);

/** Linear sRGB (D65 white = 1, 1, 1) of a reflectance under D65: what a perfect colour scan would say.
 *  Not clipped: saturated dyes have negative components. */
void weft_spectra_srgb(const weft_spectra *spectra, const weft_spectrum *reflectance, double rgb[3]);

/** Sensor response to a reflectance under an illuminant; a perfect diffuser under the nominal LED gives
 *  green 1. */
void weft_spectra_sensor_rgb(const weft_spectra *spectra, const weft_spectrum *reflectance,
                             const weft_spectrum *illuminant, double rgb[3]);

/** Reflectance of a matte Munsell neutral: the shape of the measured neutral of the Macbeth chart whose
 *  value is nearest (N9.5, 8, 6.5, 5, 3.5, 2), scaled so that its luminous reflectance under D65 is
 *  weft_munsell_reflectance(value).  Real chips are off their nominal value by up to 10 % (background of
 *  the linearity tolerance); these are exact on purpose, so that a test can tell a curve from a chip. */
weft_spectrum weft_spectra_munsell(const weft_spectra *spectra, double value);

#endif
