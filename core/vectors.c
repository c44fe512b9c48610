#include "core/vectors.h"

#include "core/mem.h"

#include <assert.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

const weft_vectors_model *weft_vectors_find_in(const weft_vectors_model *table, const char *stem)
{
    for (const weft_vectors_model *m = table; m->stem; m++)
        if (strcmp(m->stem, stem) == 0)
            return m;
    return NULL;
}

bool weft_vectors_word(const char *names, int index, char word[64])
{
    const char *p = names;
    for (int i = 0; i < index && *p; i++) {
        p += strcspn(p, " ");
        p += *p == ' ';
    }
    const size_t n = strcspn(p, " ");
    assert(n < 64);
    memcpy(word, p, n);
    word[n] = '\0';
    return n > 0;
}

static int count_words(const char *names)
{
    char word[64];
    int n = 0;
    while (weft_vectors_word(names, n, word))
        n++;
    assert(n <= WEFT_VECTORS_MAX_COLUMNS);
    return n;
}

/* Reads column `name` of every row. */
static weft_err read_column(const weft_csv *csv, const char *path, const char *name, double *values,
                            weft_error *err)
{
    const int column = weft_csv_column(csv, name);
    if (column < 0)
        return weft_fail(err, WEFT_ERR_FORMAT, "%s: there is no column %s", path, name);
    for (int row = 0; row < csv->rows; row++)
        WEFT_TRY(weft_csv_number(csv, row, column, path, &values[row], err));
    return WEFT_OK;
}

weft_err weft_vectors_eval(const weft_vectors_model *model, const weft_csv *csv, const char *path,
                           int *n_outputs, double **outputs, weft_error *err)
{
    const int n_in = count_words(model->inputs), n_out = count_words(model->outputs);
    const size_t rows = (size_t)csv->rows;
    double *const in = weft_alloc(rows * (size_t)n_in, sizeof *in, err);
    double *const out = in ? weft_alloc(rows * (size_t)n_out, sizeof *out, err) : NULL;
    weft_err status = out ? WEFT_OK : WEFT_ERR_NOMEM;
    const double *in_planes[WEFT_VECTORS_MAX_COLUMNS];
    double *out_planes[WEFT_VECTORS_MAX_COLUMNS];
    char word[64];
    for (int k = 0; k < n_in && status == WEFT_OK; k++) {
        weft_vectors_word(model->inputs, k, word);
        in_planes[k] = in + (size_t)k * rows;
        status = read_column(csv, path, word, in + (size_t)k * rows, err);
    }
    if (status == WEFT_OK) {
        for (int k = 0; k < n_out; k++)
            out_planes[k] = out + (size_t)k * rows;
        model->eval(csv->rows, in_planes, out_planes);
        *n_outputs = n_out;
        *outputs = out;
    } else {
        weft_free(out);
    }
    weft_free(in);
    return status;
}

static void compare(weft_vectors_column *column, const double *got, const double *want, int rows, double rtol)
{
    for (int row = 0; row < rows; row++) {
        const double error = fabs(got[row] - want[row]), size = fabs(want[row]);
        /* a NaN must count as the worst there is, not slip through comparisons */
        const double share = isfinite(got[row]) ? error / (WEFT_VECTORS_ATOL + rtol * size) : HUGE_VAL;
        if (size > 0 && !(error / size <= column->max_rel))
            column->max_rel = error / size;
        if (!(error <= column->max_abs))
            column->max_abs = error;
        if (column->worst_row == 0 || share > column->worst_share) {
            column->worst_share = share;
            column->worst_row = row + 1;
            column->worst_got = got[row];
            column->worst_want = want[row];
        }
    }
}

/* Index of the model's output that a column "out_NAME" expects; -1 when there is none. */
static int output_index(const weft_vectors_model *model, const char *column)
{
    char word[64];
    for (int k = 0; weft_vectors_word(model->outputs, k, word); k++)
        if (strcmp(column + 4, word) == 0)
            return k;
    return -1;
}

weft_err weft_vectors_run(const weft_vectors_model *model, const weft_csv *csv, const char *path, double rtol,
                          weft_vectors_column *columns, int *n_columns, weft_error *err)
{
    double *want = NULL, *got = NULL;
    int n_out, n = 0;
    WEFT_TRY(weft_vectors_eval(model, csv, path, &n_out, &got, err));
    want = weft_alloc((size_t)csv->rows, sizeof *want, err);
    weft_err status = want ? WEFT_OK : WEFT_ERR_NOMEM;
    for (int c = 0; c < csv->columns && status == WEFT_OK; c++) {
        if (strncmp(csv->names[c], "out_", 4) != 0)
            continue;
        const int k = output_index(model, csv->names[c]);
        if (k < 0) {
            status = weft_fail(err, WEFT_ERR_FORMAT, "%s: column %s: %s gives no such value", path,
                               csv->names[c], model->stem);
            break;
        }
        status = read_column(csv, path, csv->names[c], want, err);
        if (status != WEFT_OK)
            break;
        columns[n] = (weft_vectors_column){.name = csv->names[c]};
        compare(&columns[n++], got + (size_t)k * (size_t)csv->rows, want, csv->rows, rtol);
    }
    if (status == WEFT_OK && n == 0)
        status = weft_fail(err, WEFT_ERR_FORMAT,
                           "%s: no column begins with out_: there is nothing to compare", path);
    *n_columns = n;
    weft_free(want);
    weft_free(got);
    return status;
}
