/* Folders with light_directions.txt: the layout of the DiLiGenT benchmark. */
#include "core/file.h"
#include "core/log.h"
#include "core/mem.h"
#include "core/text.h"
#include "host/set/import_list.h"

#include <string.h>

enum { MAX_BYTES = 1 << 22 };

/* A text file's lines, blanks trimmed, empty ones left out; they point into `text`. */
typedef struct lines {
    char *text;
    int n;
    char *line[WEFT_LIGHTS_MAX + 1];
} lines;

static char *trim(char *s)
{
    s += strspn(s, " \t\r");
    size_t n = strlen(s);
    while (n > 0 && strchr(" \t\r", s[n - 1]))
        n--;
    s[n] = 0;
    return s;
}

static weft_err read_lines(const char *path, lines *to, weft_error *err)
{
    size_t n;
    *to = (lines){0};
    WEFT_TRY(weft_file_read(path, MAX_BYTES, &to->text, &n, err));
    if (memchr(to->text, 0, n)) {
        weft_free(to->text);
        return weft_fail(err, WEFT_ERR_FORMAT, "%s is not a text file", path);
    }
    for (char *next = to->text; next && to->n <= WEFT_LIGHTS_MAX;) {
        char *const line = next;
        next = strchr(line, '\n');
        if (next)
            *next++ = 0;
        char *const trimmed = trim(line);
        if (*trimmed)
            to->line[to->n++] = trimmed;
    }
    return WEFT_OK;
}

/* Up to three numbers of a line.  @return how many, -1 when something else stands there. */
static int read_numbers(const char *line, double v[3])
{
    int n = 0;
    const char *p = line;
    while (*(p += strspn(p, " \t,;"))) {
        if (n == 3 || !(p = weft_text_scan_double(p, &v[n])))
            return -1;
        n++;
    }
    return n;
}

/* Fills items' `what` from a file of one line a light; `columns` 3, or 1 where allowed. */
static weft_err read_table(const char *path, int n_lights, bool one_column, double (*values)[3], int *n_read,
                           weft_error *err)
{
    lines text;
    WEFT_TRY(read_lines(path, &text, err));
    weft_err status = WEFT_OK;
    for (int i = 0; i < text.n && i < WEFT_LIGHTS_MAX && status == WEFT_OK; i++) {
        const int n = read_numbers(text.line[i], values[i]);
        if (n == 1 && one_column)
            values[i][1] = values[i][2] = values[i][0];
        else if (n != 3)
            status = weft_fail(err, WEFT_ERR_FORMAT, "%s line %d: wanted %s, found \"%.60s\"", path, i + 1,
                               one_column ? "one or three numbers" : "three numbers", text.line[i]);
    }
    if (status == WEFT_OK && text.n > WEFT_LIGHTS_MAX)
        status = weft_fail(err, WEFT_ERR_RANGE, "%s lists more than %d lights (leave some out)", path,
                           WEFT_LIGHTS_MAX);
    if (status == WEFT_OK && n_lights >= 0 && text.n != n_lights)
        status = weft_fail(err, WEFT_ERR_MISMATCH, "%s has %d lines but light_directions.txt has %d", path,
                           text.n, n_lights);
    *n_read = text.n;
    weft_free(text.text);
    return status;
}

static bool is_picture(const char *name)
{
    return (weft_path_has_suffix(name, ".png") || weft_path_has_suffix(name, ".tif") ||
            weft_path_has_suffix(name, ".tiff") || weft_path_has_suffix(name, ".exr")) &&
           strcmp(name, "mask.png") != 0 && strncasecmp(name, "normal", 6) != 0;
}

typedef struct name_list {
    char **name;
    int n;
} name_list;

static void names_fini(name_list *list)
{
    for (int i = 0; i < list->n; i++)
        weft_free(list->name[i]);
    weft_free(list->name);
    *list = (name_list){0};
}

static weft_err read_name_file(const char *path, name_list *list, weft_error *err)
{
    lines text;
    WEFT_TRY(read_lines(path, &text, err));
    weft_err status = WEFT_OK;
    list->name = weft_alloc((size_t)text.n, sizeof *list->name, err);
    if (!list->name)
        status = WEFT_ERR_NOMEM;
    for (int i = 0; i < text.n && status == WEFT_OK; i++) {
        list->name[i] = weft_strdup(text.line[i], err);
        if (list->name[i])
            list->n++;
        else
            status = WEFT_ERR_NOMEM;
    }
    weft_free(text.text);
    return status;
}

/* filenames.txt, or else the pictures of the folder in natural order. */
static weft_err read_names(const char *folder, name_list *list, weft_error *err)
{
    char *const path = weft_path_join(folder, "filenames.txt", err);
    if (!path)
        return WEFT_ERR_NOMEM;
    const weft_err status = weft_file_exists(path)
                                ? read_name_file(path, list, err)
                                : weft_import_list_names(folder, is_picture, &list->name, &list->n, err);
    weft_free(path);
    return status;
}

static weft_err add_lights(const char *folder, const name_list *names, double (*directions)[3],
                           double (*intensities)[3], weft_import_list *list, weft_error *err)
{
    for (int i = 0; i < names->n; i++) {
        weft_vec3 d = {directions[i][0], directions[i][1], directions[i][2]};
        const double length = weft_length(d);
        if (!(length > 1e-6))
            return weft_fail(err, WEFT_ERR_RANGE, "%s/light_directions.txt line %d: the direction is zero",
                             folder, i + 1);
        for (int c = 0; c < 3; c++)
            if (!(intensities[i][c] > 0))
                return weft_fail(err, WEFT_ERR_RANGE,
                                 "%s/light_intensities.txt line %d: an intensity must be above 0", folder,
                                 i + 1);
        char *const path = weft_path_join(folder, names->name[i], err);
        if (!path)
            return WEFT_ERR_NOMEM;
        weft_err status = WEFT_OK;
        if (!weft_file_exists(path))
            status = weft_fail(err, WEFT_ERR_MISSING, "the picture %s of light %d is not there", path, i);
        else
            status = weft_import_list_add(list, path, weft_normalise(d), intensities[i], err);
        weft_free(path);
        WEFT_TRY(status);
    }
    return WEFT_OK;
}

static weft_err read_folder(const char *folder, weft_import_list *list, weft_error *err)
{
    double directions[WEFT_LIGHTS_MAX][3], intensities[WEFT_LIGHTS_MAX][3];
    int n = 0, n_intensities = 0;
    name_list names = {0};
    char *const direction_path = weft_path_join(folder, "light_directions.txt", err);
    char *const intensity_path = weft_path_join(folder, "light_intensities.txt", err);
    weft_err status = direction_path && intensity_path ? WEFT_OK : WEFT_ERR_NOMEM;
    if (status == WEFT_OK)
        status = read_table(direction_path, -1, false, directions, &n, err);
    for (int i = 0; i < WEFT_LIGHTS_MAX; i++)
        intensities[i][0] = intensities[i][1] = intensities[i][2] = 1;
    if (status == WEFT_OK && weft_file_exists(intensity_path))
        status = read_table(intensity_path, n, true, intensities, &n_intensities, err);
    if (status == WEFT_OK)
        status = read_names(folder, &names, err);
    if (status == WEFT_OK && names.n != n)
        status = weft_fail(err, WEFT_ERR_MISMATCH,
                           "%s: light_directions.txt has %d lights, but there are %d pictures", folder, n,
                           names.n);
    if (status == WEFT_OK && n == 0)
        status = weft_fail(err, WEFT_ERR_FORMAT, "%s is empty", direction_path);
    if (status == WEFT_OK)
        status = add_lights(folder, &names, directions, intensities, list, err);
    names_fini(&names);
    weft_free(direction_path);
    weft_free(intensity_path);
    return status;
}

weft_err weft_import_read_directions(const char *folder, weft_import_list *list, weft_error *err)
{
    WEFT_TRY(weft_import_list_init(list, "directions", err));
    list->has_directions = true;
    weft_err status = read_folder(folder, list, err);
    if (status == WEFT_OK)
        status = weft_import_find_mask(list, folder, err);
    if (status != WEFT_OK)
        weft_import_list_fini(list);
    return status;
}
