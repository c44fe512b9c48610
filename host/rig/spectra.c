#include "host/rig/spectra.h"

#include "calibration/charts/chart.h"
#include "core/colour.h"
#include "core/embedded.h"
#include "core/text.h"

#include <assert.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

extern const weft_embedded weft_rig_data[];

/* The first line of a table: skips the wavelength's heading, gives the names behind it. */
static const char *parse_heading(const char *text, char names[][16], int n)
{
    const char *p = strchr(text, ',');
    for (int i = 0; i < n && p; i++) {
        p++;
        const size_t length = strcspn(p, ",\n");
        if (names)
            snprintf(names[i], sizeof names[i], "%.*s", (int)length, p);
        p += length;
    }
    return p && *p == '\n' ? p + 1 : NULL;
}

static const char *parse_row(const char *p, double *values, int n)
{
    for (int i = 0; i < n && p; i++) {
        p = weft_text_scan_double(p, &values[i]);
        if (p && *p++ != (i + 1 < n ? ',' : '\n'))
            p = NULL;
    }
    return p;
}

/* Reads the `n` columns of a table. */
static weft_err load_table(const char *name, int n, weft_spectrum *const *columns, char names[][16],
                           weft_error *err)
{
    double row[1 + WEFT_SPECTRA_N_MACBETH] = {0};
    assert(n < (int)(sizeof row / sizeof row[0]));
    const weft_embedded *const file = weft_embedded_find(weft_rig_data, name);
    assert(file);
    const char *p = parse_heading((const char *)file->bytes, names, n);
    for (int i = 0; i < WEFT_SPECTRUM_SAMPLES; i++) {
        p = p ? parse_row(p, row, 1 + n) : NULL;
        if (!p || row[0] != WEFT_SPECTRUM_FIRST_NM + i * WEFT_SPECTRUM_STEP_NM)
            return weft_fail(err, WEFT_ERR_FORMAT, "the built-in table %s is damaged at line %d; build again",
                             name, i + 2);
        for (int c = 0; c < n; c++)
            columns[c]->v[i] = row[1 + c];
    }
    return WEFT_OK;
}

weft_err weft_spectra_load(weft_spectra *s, weft_error *err)
{
    weft_spectrum *macbeth[WEFT_SPECTRA_N_MACBETH], *dyes[WEFT_SPECTRA_N_DYES];
    for (int i = 0; i < WEFT_SPECTRA_N_MACBETH; i++)
        macbeth[i] = &s->macbeth[i];
    for (int i = 0; i < WEFT_SPECTRA_N_DYES; i++)
        dyes[i] = &s->dyes[i];
    weft_spectrum *const observer[] = {&s->observer[0], &s->observer[1], &s->observer[2]};
    weft_spectrum *const sensor[] = {&s->sensor[0], &s->sensor[1], &s->sensor[2]};
    weft_spectrum *const lights[] = {&s->d65, &s->led};
    WEFT_TRY(load_table("cie1931_2deg.csv", 3, observer, NULL, err));
    WEFT_TRY(load_table("nikon_d5100_npl.csv", 3, sensor, NULL, err));
    WEFT_TRY(load_table("illuminants.csv", 2, lights, NULL, err));
    WEFT_TRY(load_table("macbeth_ohta1997.csv", WEFT_SPECTRA_N_MACBETH, macbeth, NULL, err));
    return load_table("dyes_ampas190.csv", WEFT_SPECTRA_N_DYES, dyes, s->dye_names, err);
}

weft_err weft_spectra_find_dye(const weft_spectra *s, const char *name, const weft_spectrum **dye,
                               weft_error *err)
{
    for (int i = 0; i < WEFT_SPECTRA_N_DYES; i++)
        if (strcmp(s->dye_names[i], name) == 0) {
            *dye = &s->dyes[i];
            return WEFT_OK;
        }
    return weft_fail(err, WEFT_ERR_MISSING, "no dye is called \"%s\"", name);
}

weft_spectrum weft_spectrum_flat(double reflectance)
{
    weft_spectrum s;
    for (int i = 0; i < WEFT_SPECTRUM_SAMPLES; i++)
        s.v[i] = reflectance;
    return s;
}

weft_spectrum weft_spectra_led(const weft_spectra *spectra, double pump_scale)
{
    weft_spectrum led = spectra->led;
    for (int i = 0; i < WEFT_SPECTRUM_SAMPLES; i++) {
        const double nm = WEFT_SPECTRUM_FIRST_NM + i * WEFT_SPECTRUM_STEP_NM;
        const double t = fmin(fmax((495 - nm) / 30, 0), 1); /* 1 pump, 0 phosphor */
        led.v[i] *= 1 + (pump_scale - 1) * t * t * (3 - 2 * t);
    }
    return led;
}

static double integrate(const weft_spectrum *a, const weft_spectrum *b)
{
    double sum = 0;
    for (int i = 0; i < WEFT_SPECTRUM_SAMPLES; i++)
        sum += a->v[i] * b->v[i];
    return sum;
}

static double integrate3(const weft_spectrum *a, const weft_spectrum *b, const weft_spectrum *c)
{
    double sum = 0;
    for (int i = 0; i < WEFT_SPECTRUM_SAMPLES; i++)
        sum += a->v[i] * b->v[i] * c->v[i];
    return sum;
}

void weft_spectra_white_point(const weft_spectra *s, const weft_spectrum *illuminant, double xy[2])
{
    double xyz[3];
    for (int c = 0; c < 3; c++)
        xyz[c] = integrate(illuminant, &s->observer[c]);
    for (int c = 0; c < 2; c++)
        xy[c] = xyz[c] / (xyz[0] + xyz[1] + xyz[2]);
}

/* XYZ of the white under which the matrix of the sRGB standard gives 1, 1, 1 differs from the summed D65
   in the fourth digit; scaling each of X, Y, Z makes a flat reflectance exactly neutral. */
void weft_spectra_srgb(const weft_spectra *s, const weft_spectrum *reflectance, double rgb[3])
{
    static const double one[3] = {1, 1, 1};
    double white[3], xyz[3];
    weft_srgb_to_xyz(one, white);
    for (int c = 0; c < 3; c++)
        xyz[c] = white[c] * integrate3(reflectance, &s->d65, &s->observer[c]) /
                 integrate(&s->d65, &s->observer[c]);
    weft_xyz_to_srgb(xyz, rgb);
}

void weft_spectra_sensor_rgb(const weft_spectra *s, const weft_spectrum *reflectance,
                             const weft_spectrum *illuminant, double rgb[3])
{
    const double unit = integrate(&s->led, &s->sensor[1]);
    for (int c = 0; c < 3; c++)
        rgb[c] = integrate3(reflectance, illuminant, &s->sensor[c]) / unit;
}

weft_spectrum weft_spectra_munsell(const weft_spectra *s, double value)
{
    static const double measured[6] = {9.5, 8, 6.5, 5, 3.5, 2}; /* patches 19..24 */
    int nearest = 0;
    for (int i = 1; i < 6; i++)
        if (fabs(measured[i] - value) < fabs(measured[nearest] - value))
            nearest = i;
    weft_spectrum chip = s->macbeth[18 + nearest];
    const double luminous = integrate3(&chip, &s->d65, &s->observer[1]) / integrate(&s->d65, &s->observer[1]);
    const double scale = weft_munsell_reflectance(value) / luminous;
    for (int i = 0; i < WEFT_SPECTRUM_SAMPLES; i++)
        chip.v[i] *= scale;
    return chip;
}
