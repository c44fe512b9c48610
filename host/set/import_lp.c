/* RTI light-position files: a count, then "file x y z" a line, in all the shapes they come in. */
#include "core/file.h"
#include "core/log.h"
#include "core/mem.h"
#include "core/text.h"
#include "host/set/import_list.h"

#include <ctype.h>
#include <string.h>

enum { MAX_BYTES = 1 << 22, MAX_TOKENS = 64 };

/* Like a decimal number, but "0,577" and a comma behind it are fine too. */
static bool parse_number(const char *token, size_t n, double *value)
{
    char text[64];
    if (n > 0 && token[n - 1] == ',')
        n--;
    if (n == 0 || n >= sizeof text)
        return false;
    memcpy(text, token, n);
    text[n] = 0;
    char *const comma = strchr(text, ',');
    if (comma && !strchr(comma + 1, ',') && !strchr(text, '.'))
        *comma = '.';
    return weft_text_to_double(text, value);
}

typedef struct token {
    const char *text;
    size_t n;
} token;

/* Words between blanks and semicolons; when `commas`, also between commas. */
static int split(const char *line, bool commas, token tokens[MAX_TOKENS])
{
    const char *const between = commas ? " \t\r;," : " \t\r;";
    int n = 0;
    for (const char *p = line + strspn(line, between); *p && n < MAX_TOKENS; p += strspn(p, between)) {
        tokens[n].text = p;
        tokens[n].n = strcspn(p, between);
        p += tokens[n++].n;
    }
    return n;
}

static const char *last_component(const char *name)
{
    const char *last = name;
    for (const char *p = name; *p; p++)
        if (*p == '/' || *p == '\\')
            last = p + 1;
    return last;
}

/* The picture of a name: as written, beside the .lp, or its last component beside the .lp. */
static weft_err find_picture(const char *folder, const char *name, char **path, weft_error *err)
{
    char *const as_written = weft_path_join(folder, name, err);
    if (!as_written)
        return WEFT_ERR_NOMEM;
    if (weft_file_exists(as_written)) {
        *path = as_written;
        return WEFT_OK;
    }
    weft_free(as_written);
    char *const beside = weft_path_join(folder, last_component(name), err);
    if (!beside)
        return WEFT_ERR_NOMEM;
    *path = beside;
    return WEFT_OK;
}

/* The name in front of token `i`, without blanks and quotes around it. */
static char *name_before(const char *line, const token *tokens, int i, weft_error *err)
{
    const char *begin = tokens[0].text, *end = tokens[i - 1].text + tokens[i - 1].n;
    (void)line;
    if (end > begin && end[-1] == ',')
        end--;
    if (end - begin >= 2 && (*begin == '"' || *begin == '\'') && end[-1] == *begin) {
        begin++;
        end--;
    }
    return weft_asprintf(err, "%.*s", (int)(end - begin), begin);
}

static bool read_direction(const token *tokens, weft_vec3 *direction)
{
    double v[3];
    for (int i = 0; i < 3; i++)
        if (!parse_number(tokens[i].text, tokens[i].n, &v[i]))
            return false;
    *direction = (weft_vec3){v[0], v[1], v[2]};
    return true;
}

typedef struct entry {
    char *path;
    weft_vec3 direction;
} entry;

/* A line may be read in several ways when a name holds numbers or there are further columns: the first
 * whose picture exists is meant; else the last with three numbers, for the message. */
static weft_err read_entry(const char *folder, const char *line, entry *found, bool *is_entry,
                           weft_error *err)
{
    token tokens[MAX_TOKENS];
    weft_vec3 direction;
    *is_entry = false;
    for (int commas = 0; commas < 2 && !*is_entry; commas++) {
        const int n = split(line, commas, tokens);
        for (int i = 1; i + 3 <= n; i++) {
            if (!read_direction(tokens + i, &direction))
                continue;
            char *path = NULL, *const name = name_before(line, tokens, i, err);
            const weft_err status = name ? find_picture(folder, name, &path, err) : WEFT_ERR_NOMEM;
            weft_free(name);
            if (status != WEFT_OK) {
                weft_free(found->path);
                return status;
            }
            weft_free(found->path);
            *found = (entry){path, direction};
            *is_entry = true;
            if (weft_file_exists(path))
                return WEFT_OK;
        }
    }
    return WEFT_OK;
}

static weft_err check_direction(const char *lp, int line, weft_vec3 *direction, weft_error *err)
{
    const double length = weft_length(*direction);
    if (!(length > 1e-6))
        return weft_fail(err, WEFT_ERR_RANGE, "%s line %d: the light's direction is zero", lp, line);
    if (length < 0.98 || length > 1.02)
        weft_warn("%s line %d: the direction has length %.4g, made unit", lp, line, length);
    if (direction->z <= 0)
        weft_warn("%s line %d: the light shines from behind the surface (z = %.4g)", lp, line, direction->z);
    *direction = weft_normalise(*direction);
    return WEFT_OK;
}

static weft_err add_line(const char *lp, const char *folder, int number, const char *line,
                         weft_import_list *list, weft_error *err)
{
    static const double one[3] = {1, 1, 1};
    entry found = {0};
    bool is_entry;
    WEFT_TRY(read_entry(folder, line, &found, &is_entry, err));
    if (!is_entry)
        return weft_fail(err, WEFT_ERR_FORMAT, "%s line %d: wanted \"picture x y z\", found \"%.60s\"", lp,
                         number, line);
    weft_err status = check_direction(lp, number, &found.direction, err);
    if (status == WEFT_OK && !weft_file_exists(found.path))
        status = weft_fail(err, WEFT_ERR_MISSING,
                           "%s line %d: the picture %s is not there (put it beside the .lp)", lp, number,
                           found.path);
    if (status == WEFT_OK)
        status = weft_import_list_add(list, found.path, found.direction, one, err);
    weft_free(found.path);
    return status;
}

/* A line that is one whole number: the count. */
static bool is_count(const char *line, double *count)
{
    token tokens[MAX_TOKENS];
    return split(line, true, tokens) == 1 && parse_number(tokens[0].text, tokens[0].n, count);
}

static weft_err read_lines(const char *lp, const char *folder, char *text, weft_import_list *list,
                           weft_error *err)
{
    double count = -1;
    int number = 0;
    char *next = text;
    if (strncmp(next, "\xef\xbb\xbf", 3) == 0) /* a byte-order mark */
        next += 3;
    while (next) {
        char *const line = next;
        next = strchr(line, '\n');
        if (next)
            *next++ = 0;
        number++;
        if (line[strspn(line, " \t\r;,")] == 0 || *line == '#')
            continue;
        if (count < 0 && list->n == 0 && is_count(line, &count))
            continue;
        WEFT_TRY(add_line(lp, folder, number, line, list, err));
    }
    if (list->n == 0)
        return weft_fail(err, WEFT_ERR_FORMAT,
                         "%s names no pictures (wanted a count, then \"picture x y z\" a line)", lp);
    if (count < 0)
        weft_warn("%s does not begin with a count; it has %d lights", lp, list->n);
    else if (count != list->n)
        weft_warn("%s says %g lights and lists %d: using the %d", lp, count, list->n, list->n);
    return WEFT_OK;
}

weft_err weft_import_read_lp(const char *path, weft_import_list *list, weft_error *err)
{
    char *text = NULL;
    size_t n;
    WEFT_TRY(weft_import_list_init(list, "lp", err));
    list->has_directions = true;
    char *const folder = weft_path_folder(path, err);
    weft_err status = folder ? weft_file_read(path, MAX_BYTES, &text, &n, err) : WEFT_ERR_NOMEM;
    if (status == WEFT_OK && memchr(text, 0, n))
        status = weft_fail(err, WEFT_ERR_FORMAT, "%s is not a text file", path);
    if (status == WEFT_OK)
        status = read_lines(path, folder, text, list, err);
    if (status == WEFT_OK)
        status = weft_import_find_mask(list, folder, err);
    weft_free(text);
    weft_free(folder);
    if (status != WEFT_OK)
        weft_import_list_fini(list);
    return status;
}
