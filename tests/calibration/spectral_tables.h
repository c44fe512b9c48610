/**
 * Tables of numbers from CSV files and the spectral arithmetic that tests compare with.
 */
#ifndef WEFT_TESTS_CALIBRATION_SPECTRAL_TABLES_H
#define WEFT_TESTS_CALIBRATION_SPECTRAL_TABLES_H

#include <stddef.h>

#define TABLE_MAX_COLUMNS 256

/** A CSV file with one header line.  Empty and non-numeric cells are NaN. */
typedef struct table {
    int columns, rows;
    char names[TABLE_MAX_COLUMNS][64];
    double *cells; /* [rows][columns] */
} table;

/** Reads `name` of the staged data; skips the test when it is not there. */
void table_read(table *t, const char *name);
void table_free(table *t);

/** Column of a header name; fails the test when there is none. */
int table_column(const table *t, const char *name);
double table_cell(const table *t, int row, int column);

/** Value of a column at `x` in the first column, linear between rows, 0 outside and for NaN. */
double table_at(const table *t, int column, double x);

/** 380, 385 ... 780 nm */
#define SPECTRUM_N 81
typedef double spectrum[SPECTRUM_N];
void spectrum_from(spectrum s, const table *t, int column);

/** The CIE 1931 observer, [x y z][wavelength]. */
void spectrum_observer(spectrum observer[3]);

/** Tristimulus values of a reflectance under a light, Y = 1 for the perfect diffuser. */
void spectrum_xyz(const spectrum reflectance, const spectrum light, const spectrum observer[3],
                  double xyz[3]);

/** Sum of the product of three spectra: what a sensor channel sees. */
double spectrum_response(const spectrum reflectance, const spectrum light, const spectrum sensitivity);

#endif
