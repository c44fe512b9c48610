/** Tables of text with a header line (RFC 4180: commas, quotes, LF or CRLF). */
#ifndef WEFT_CORE_CSV_H
#define WEFT_CORE_CSV_H

#include "core/error.h"

typedef struct weft_csv {
    int columns, rows;  /* rows without the header */
    const char **names; /* [columns] */
    const char **cells; /* [rows][columns]; unquoted, never NULL */
    char *text;         /* what the pointers above point into */
} weft_csv;

/**
 * Reads a whole table of at most 64 MiB.  Blank lines are skipped; a byte-order mark is dropped.
 * @return WEFT_ERR_FORMAT naming file and line for a ragged row, an unclosed quote, text that is no UTF-8
 *         or a file without a header; WEFT_ERR_IO.
 */
weft_err weft_csv_read(const char *path, weft_csv *csv, weft_error *err);
void weft_csv_fini(weft_csv *csv);

static inline const char *weft_csv_cell(const weft_csv *csv, int row, int column)
{
    return csv->cells[row * csv->columns + column];
}

/** Index of a column; -1 when there is none. */
int weft_csv_column(const weft_csv *csv, const char *name);

/** A cell as a finite number.  @return WEFT_ERR_FORMAT naming `path`, the row and the column. */
weft_err weft_csv_number(const weft_csv *csv, int row, int column, const char *path, double *value,
                         weft_error *err);

#endif
