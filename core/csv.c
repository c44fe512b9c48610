#include "core/csv.h"

#include "core/file.h"
#include "core/mem.h"
#include "core/text.h"

#include <stdbool.h>
#include <string.h>

#define LIMIT_BYTES ((size_t)64 << 20)

/* Reading position; text is unquoted in place. */
typedef struct scanner {
    const char *path;
    char *at;
    int line;
} scanner;

typedef enum cell_end { CELL_COMMA, CELL_LINE, CELL_FILE } cell_end;

/* Ends the cell at `out`, where the reading stands on the separator. */
static cell_end end_cell(scanner *s, char *out)
{
    const char separator = *s->at;
    if (separator == '\r' && s->at[1] == '\n')
        s->at++;
    const bool at_end = *s->at == '\0';
    if (!at_end)
        s->at++;
    *out = '\0';
    if (separator == ',')
        return CELL_COMMA;
    s->line++;
    return at_end ? CELL_FILE : CELL_LINE;
}

static weft_err scan_quoted(scanner *s, char **cell, cell_end *end, weft_error *err)
{
    const int first_line = s->line;
    char *out = ++s->at;
    *cell = out;
    for (; *s->at; s->at++) {
        if (*s->at == '"') {
            if (s->at[1] != '"')
                break;
            s->at++;
        }
        s->line += *s->at == '\n';
        *out++ = *s->at;
    }
    if (*s->at != '"' || !strchr(",\r\n", s->at[1])) /* strchr() finds the final NUL too */
        return weft_fail(err, WEFT_ERR_FORMAT, "%s: line %d: a quote is not closed", s->path, first_line);
    s->at++;
    *end = end_cell(s, out);
    return WEFT_OK;
}

static weft_err scan_cell(scanner *s, char **cell, cell_end *end, weft_error *err)
{
    if (*s->at == '"')
        return scan_quoted(s, cell, end, err);
    *cell = s->at;
    s->at += strcspn(s->at, ",\r\n");
    *end = end_cell(s, s->at);
    return WEFT_OK;
}

/* Upper bound of the number of cells. */
static size_t count_cells(const char *text)
{
    size_t n = 1;
    for (const char *p = text; *p; p++)
        n += *p == ',' || *p == '\n' || *p == '\r';
    return n;
}

static bool skip_blank_lines(scanner *s)
{
    while (*s->at == '\n' || *s->at == '\r') {
        s->line += *s->at == '\n';
        s->at++;
    }
    return *s->at != '\0';
}

static weft_err scan_rows(scanner *s, weft_csv *csv, weft_error *err)
{
    int n = 0; /* cells so far, the header's first */
    while (skip_blank_lines(s)) {
        const int line = s->line, begin = n;
        cell_end end = CELL_COMMA;
        while (end == CELL_COMMA) {
            char *cell;
            WEFT_TRY(scan_cell(s, &cell, &end, err));
            csv->names[n++] = cell;
        }
        if (begin == 0)
            csv->columns = n;
        else if (n - begin != csv->columns)
            return weft_fail(err, WEFT_ERR_FORMAT, "%s: line %d has %d cells, the header has %d", s->path,
                             line, n - begin, csv->columns);
        else
            csv->rows++;
    }
    if (csv->columns == 0)
        return weft_fail(err, WEFT_ERR_FORMAT, "%s: the file is empty; wanted a table with a header line",
                         s->path);
    csv->cells = csv->names + csv->columns;
    return WEFT_OK;
}

weft_err weft_csv_read(const char *path, weft_csv *csv, weft_error *err)
{
    weft_csv loaded = {0};
    size_t n;
    WEFT_TRY(weft_file_read(path, LIMIT_BYTES, &loaded.text, &n, err));
    weft_err status = WEFT_OK;
    if (!weft_text_is_utf8(loaded.text, n))
        status = weft_fail(err, WEFT_ERR_FORMAT, "%s: the text is not UTF-8", path);
    if (status == WEFT_OK) {
        loaded.names = weft_alloc(count_cells(loaded.text), sizeof *loaded.names, err);
        status = loaded.names ? WEFT_OK : WEFT_ERR_NOMEM;
    }
    if (status == WEFT_OK) {
        const bool mark = strncmp(loaded.text, "\xef\xbb\xbf", 3) == 0;
        status = scan_rows(&(scanner){path, loaded.text + (mark ? 3 : 0), 1}, &loaded, err);
    }
    if (status != WEFT_OK)
        weft_csv_fini(&loaded);
    else
        *csv = loaded;
    return status;
}

void weft_csv_fini(weft_csv *csv)
{
    weft_free(csv->names);
    weft_free(csv->text);
    *csv = (weft_csv){0};
}

int weft_csv_column(const weft_csv *csv, const char *name)
{
    for (int i = 0; i < csv->columns; i++)
        if (strcmp(csv->names[i], name) == 0)
            return i;
    return -1;
}

weft_err weft_csv_number(const weft_csv *csv, int row, int column, const char *path, double *value,
                         weft_error *err)
{
    const char *const cell = weft_csv_cell(csv, row, column);
    if (weft_text_to_double(cell, value))
        return WEFT_OK;
    return weft_fail(err, WEFT_ERR_FORMAT, "%s: row %d, column %s: \"%.40s\" is not a number", path, row + 1,
                     csv->names[column], cell);
}
