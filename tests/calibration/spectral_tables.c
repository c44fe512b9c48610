#include "tests/calibration/spectral_tables.h"

#include "tests/support/support.h"

#include "core/csv.h"
#include "core/mem.h"
#include "core/text.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

void table_read(table *t, const char *name)
{
    weft_csv csv;
    assert_ok(weft_csv_read(weft_test_need_shared(name), &csv, err));
    *t = (table){.columns = csv.columns, .rows = csv.rows};
    assert_true(t->columns <= TABLE_MAX_COLUMNS);
    t->cells = weft_alloc((size_t)t->rows * (size_t)t->columns, sizeof *t->cells, NULL);
    assert_non_null(t->cells);
    for (int c = 0; c < t->columns; c++)
        snprintf(t->names[c], sizeof t->names[c], "%s", csv.names[c]);
    for (int i = 0; i < t->rows * t->columns; i++)
        if (!weft_text_to_double(csv.cells[i], &t->cells[i]))
            t->cells[i] = (double)NAN;
    weft_csv_fini(&csv);
}

void table_free(table *t)
{
    weft_free(t->cells);
    t->cells = NULL;
}

int table_column(const table *t, const char *name)
{
    for (int c = 0; c < t->columns; c++)
        if (strcmp(t->names[c], name) == 0)
            return c;
    fail_msg("no column %s", name);
    return -1;
}

double table_cell(const table *t, int row, int column)
{
    return t->cells[(size_t)row * (size_t)t->columns + (size_t)column];
}

double table_at(const table *t, int column, double x)
{
    for (int r = 0; r + 1 < t->rows; r++) {
        const double x0 = table_cell(t, r, 0), x1 = table_cell(t, r + 1, 0);
        if (x < x0 || x > x1)
            continue;
        const double y0 = table_cell(t, r, column), y1 = table_cell(t, r + 1, column);
        const double f = (x - x0) / (x1 - x0);
        if (x == x0 || x == x1) {
            const double y = x == x0 ? y0 : y1;
            return isnan(y) ? 0 : y;
        }
        return isnan(y0) || isnan(y1) ? 0 : y0 + f * (y1 - y0);
    }
    return 0;
}

void spectrum_from(spectrum s, const table *t, int column)
{
    for (int i = 0; i < SPECTRUM_N; i++)
        s[i] = table_at(t, column, 380 + 5 * i);
}

void spectrum_observer(spectrum observer[3])
{
    table t;
    table_read(&t, "data/spectral/observers/cie1931_2deg_xyz_1nm.csv");
    for (int c = 0; c < 3; c++)
        spectrum_from(observer[c], &t, 1 + c);
    table_free(&t);
}

double spectrum_response(const spectrum reflectance, const spectrum light, const spectrum sensitivity)
{
    double sum = 0;
    for (int i = 0; i < SPECTRUM_N; i++)
        sum += reflectance[i] * light[i] * sensitivity[i];
    return sum;
}

void spectrum_xyz(const spectrum reflectance, const spectrum light, const spectrum observer[3], double xyz[3])
{
    spectrum one;
    for (int i = 0; i < SPECTRUM_N; i++)
        one[i] = 1;
    const double white = spectrum_response(one, light, observer[1]);
    for (int c = 0; c < 3; c++)
        xyz[c] = spectrum_response(reflectance, light, observer[c]) / white;
}
