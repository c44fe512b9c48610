#include "core/fields.h"

#include "core/text.h"

#include <assert.h>
#include <string.h>

static void *member(const weft_field *field, void *args)
{
    return (char *)args + field->offset;
}

/* Index of `text` in "a|b|c"; -1 when it is not there. */
static int choice_index(const char *choices, const char *text)
{
    const size_t n = strlen(text);
    int index = 0;
    for (const char *p = choices;; index++) {
        const char *const bar = strchr(p, '|');
        const size_t length = bar ? (size_t)(bar - p) : strlen(p);
        if (length == n && memcmp(p, text, n) == 0)
            return index;
        if (!bar)
            return -1;
        p = bar + 1;
    }
}

static bool has_range(const weft_field *field)
{
    return field->min != 0 || field->max != 0;
}

static bool in_range(const weft_field *field, double value)
{
    return !has_range(field) || (value >= field->min && value <= field->max);
}

static weft_err wanted_range(const weft_field *field, const char *text, const char *what, weft_error *err)
{
    if (!has_range(field))
        return weft_fail(err, WEFT_ERR_USAGE, "--%s %s: wanted %s", field->key, text, what);
    return weft_fail(err, WEFT_ERR_USAGE, "--%s %s: wanted %s from %g to %g%s%s", field->key, text, what,
                     field->min, field->max, field->unit ? " " : "", field->unit ? field->unit : "");
}

static bool parse_numbers(const weft_field *field, const char *text, weft_numbers *numbers)
{
    weft_numbers parsed = {0};
    for (const char *p = text;;) {
        if (parsed.n == WEFT_NUMBERS_MAX)
            return false;
        p = weft_text_scan_double(p, &parsed.values[parsed.n]);
        if (!p || !in_range(field, parsed.values[parsed.n]))
            return false;
        parsed.n++;
        if (*p == '\0')
            break;
        if (*p++ != ',')
            return false;
    }
    *numbers = parsed;
    return true;
}

static bool parse_size(const char *text, weft_size *size)
{
    double width, height;
    const char *const x = weft_text_scan_double(text, &width);
    if (!x || *x != 'x' || !weft_text_to_double(x + 1, &height))
        return false;
    if (width < 1 || height < 1 || width > 32768 || height > 32768 || width != (int)width ||
        height != (int)height)
        return false;
    *size = (weft_size){(int)width, (int)height};
    return true;
}

weft_err weft_field_parse(const weft_field *field, const char *text, void *args, weft_error *err)
{
    void *const at = member(field, args);
    double number;
    switch (field->type) {
    case WEFT_FIELD_FLAG:
        *(bool *)at = true;
        return WEFT_OK;
    case WEFT_FIELD_INT:
        if (!weft_text_to_int(text, &(int){0}))
            return wanted_range(field, text, "a whole number", err);
        weft_text_to_double(text, &number);
        if (!in_range(field, number))
            return wanted_range(field, text, "a whole number", err);
        *(int *)at = (int)number;
        return WEFT_OK;
    case WEFT_FIELD_F64:
        if (!weft_text_to_double(text, &number) || !in_range(field, number))
            return wanted_range(field, text, "a number", err);
        *(double *)at = number;
        return WEFT_OK;
    case WEFT_FIELD_TEXT:
        if (!weft_text_is_utf8(text, strlen(text)))
            return weft_fail(err, WEFT_ERR_USAGE, "--%s: the value is not UTF-8", field->key);
        *(const char **)at = text;
        return WEFT_OK;
    case WEFT_FIELD_TEXTS: {
        weft_texts *const texts = at;
        if (!weft_text_is_utf8(text, strlen(text)))
            return weft_fail(err, WEFT_ERR_USAGE, "--%s: the value is not UTF-8", field->key);
        if (texts->n == WEFT_TEXTS_MAX)
            return weft_fail(err, WEFT_ERR_USAGE, "--%s: given more than %d times", field->key,
                             WEFT_TEXTS_MAX);
        texts->values[texts->n++] = text;
        return WEFT_OK;
    }
    case WEFT_FIELD_CHOICE: {
        const int index = choice_index(field->choices, text);
        if (index < 0)
            return weft_fail(err, WEFT_ERR_USAGE, "--%s %s: wanted one of %s", field->key, text,
                             field->choices);
        *(int *)at = index;
        return WEFT_OK;
    }
    case WEFT_FIELD_SIZE:
        if (!parse_size(text, at))
            return weft_fail(err, WEFT_ERR_USAGE, "--%s %s: wanted a size such as 1232x816", field->key,
                             text);
        return WEFT_OK;
    case WEFT_FIELD_F64S:
        if (!parse_numbers(field, text, at))
            return wanted_range(
                field, text,
                has_range(field) ? "numbers with commas between, each" : "numbers with commas between", err);
        return WEFT_OK;
    }
    return WEFT_OK;
}

void weft_fields_set_defaults(const weft_field *fields, void *args)
{
    for (const weft_field *field = fields; field && field->key; field++) {
        if (!field->def)
            continue;
        const weft_err status = weft_field_parse(field, field->def, args, NULL);
        assert(status == WEFT_OK && "a default must be a valid value");
        (void)status;
    }
}

int weft_text_distance(const char *a, const char *b)
{
    enum { MAX = 40 };
    int rows[3][MAX + 1];
    const int n = (int)strlen(a), m = (int)strlen(b);
    if (n > MAX || m > MAX)
        return MAX;
    for (int j = 0; j <= m; j++)
        rows[0][j] = j;
    for (int i = 1; i <= n; i++) {
        int *const row = rows[i % 3], *const above = rows[(i + 2) % 3], *const above2 = rows[(i + 1) % 3];
        row[0] = i;
        for (int j = 1; j <= m; j++) {
            int best = above[j - 1] + (a[i - 1] != b[j - 1]);
            best = above[j] + 1 < best ? above[j] + 1 : best;
            best = row[j - 1] + 1 < best ? row[j - 1] + 1 : best;
            if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1] && above2[j - 2] + 1 < best)
                best = above2[j - 2] + 1;
            row[j] = best;
        }
    }
    return rows[n % 3][m];
}

/* The parse in progress: which tables, which structs, where in argv. */
typedef struct parse {
    const weft_field *const *tables;
    void *const *args;
    int n_tables, argc, at;
    char *const *argv;
    const char **operands; /* where words that are no options go, without `visit` */
    int n_operands;
    weft_fields_visit_fn *visit; /* NULL: values go into the structs */
    void *context;
} parse;

static const weft_field *find_long(const parse *p, const char *key, size_t n, void **args)
{
    for (int t = 0; t < p->n_tables; t++)
        for (const weft_field *f = p->tables[t]; f && f->key; f++)
            if (strlen(f->key) == n && memcmp(f->key, key, n) == 0) {
                *args = p->args ? p->args[t] : NULL;
                return f;
            }
    return NULL;
}

static const weft_field *find_short(const parse *p, char letter, void **args)
{
    for (int t = 0; t < p->n_tables; t++)
        for (const weft_field *f = p->tables[t]; f && f->key; f++)
            if (f->short_opt == letter) {
                *args = p->args ? p->args[t] : NULL;
                return f;
            }
    return NULL;
}

static weft_err unknown(const parse *p, const char *word, weft_error *err)
{
    const char *nearest = NULL;
    char key[64];
    int best = 3; /* more than two slips is another word */
    snprintf(key, sizeof key, "%.*s", (int)strcspn(word + 2, "="), word + 2);
    for (int t = 0; t < p->n_tables; t++)
        for (const weft_field *f = p->tables[t]; f && f->key; f++) {
            const int distance = weft_text_distance(key, f->key);
            if (distance < best) {
                best = distance;
                nearest = f->key;
            }
        }
    if (nearest && word[1] == '-')
        return weft_fail(err, WEFT_ERR_USAGE, "%s: no such option; did you mean --%s?", word, nearest);
    return weft_fail(err, WEFT_ERR_USAGE, "%s: no such option", word);
}

static weft_err take_value(const parse *p, const weft_field *field, const char *text, void *args,
                           weft_error *err)
{
    return p->visit ? p->visit(p->context, field, text, err) : weft_field_parse(field, text, args, err);
}

static weft_err parse_option(parse *p, weft_error *err)
{
    const char *const word = p->argv[p->at];
    const char *value = NULL;
    const weft_field *field;
    void *args = NULL;
    if (word[1] == '-') {
        const char *const equals = strchr(word, '=');
        field = find_long(p, word + 2, equals ? (size_t)(equals - word - 2) : strlen(word) - 2, &args);
        value = equals ? equals + 1 : NULL;
    } else {
        field = find_short(p, word[1], &args);
        value = word[2] ? word + 2 : NULL;
    }
    if (!field)
        return unknown(p, word, err);
    if (field->type == WEFT_FIELD_FLAG) {
        if (value)
            return weft_fail(err, WEFT_ERR_USAGE, "%s: takes no value", word);
        return take_value(p, field, "", args, err);
    }
    if (!value) {
        if (p->at + 1 >= p->argc)
            return weft_fail(err, WEFT_ERR_USAGE, "%s: wants a value (%s)", word,
                             field->unit ? field->unit : "VALUE");
        value = p->argv[++p->at];
    }
    return take_value(p, field, value, args, err);
}

static bool given(const weft_field *field, void *args)
{
    const void *const at = member(field, args);
    switch (field->type) {
    case WEFT_FIELD_TEXT:
        return *(const char *const *)at != NULL;
    case WEFT_FIELD_SIZE:
        return ((const weft_size *)at)->width != 0;
    case WEFT_FIELD_F64S:
        return ((const weft_numbers *)at)->n != 0;
    case WEFT_FIELD_TEXTS:
        return ((const weft_texts *)at)->n != 0;
    default:
        return true; /* numbers have a default where it matters */
    }
}

/* Options to take_value(), other words to the visitor or the operands. */
static weft_err walk(parse *p, weft_error *err)
{
    bool options = true;
    for (; p->at < p->argc; p->at++) {
        const char *const word = p->argv[p->at];
        if (options && strcmp(word, "--") == 0)
            options = false;
        else if (options && word[0] == '-' && word[1] != '\0')
            WEFT_TRY(parse_option(p, err));
        else if (p->visit)
            WEFT_TRY(p->visit(p->context, NULL, word, err));
        else if (p->operands)
            p->operands[p->n_operands++] = word;
    }
    return WEFT_OK;
}

weft_err weft_fields_parse_argv(const weft_field *const *tables, void *const *args, int n_tables, int argc,
                                char *const *argv, const char **operands, int *n_operands, weft_error *err)
{
    parse p = {.tables = tables,
               .args = args,
               .n_tables = n_tables,
               .argc = argc,
               .argv = argv,
               .operands = operands};
    WEFT_TRY(walk(&p, err));
    *n_operands = p.n_operands;
    for (int t = 0; t < n_tables; t++)
        for (const weft_field *f = tables[t]; f && f->key; f++)
            if (f->required && !given(f, args[t]))
                return weft_fail(err, WEFT_ERR_USAGE, "--%s is needed: %s", f->key, f->help);
    return WEFT_OK;
}

weft_err weft_fields_visit_argv(const weft_field *const *tables, int n_tables, int argc, char *const *argv,
                                weft_fields_visit_fn *visit, void *context, weft_error *err)
{
    parse p = {.tables = tables,
               .n_tables = n_tables,
               .argc = argc,
               .argv = argv,
               .visit = visit,
               .context = context};
    return walk(&p, err);
}

void weft_fields_print_help(const weft_field *fields, FILE *out)
{
    for (const weft_field *f = fields; f && f->key; f++) {
        char left[80], range[80] = "";
        const char *const value = f->type == WEFT_FIELD_FLAG     ? NULL
                                  : f->type == WEFT_FIELD_CHOICE ? f->choices
                                  : f->unit                      ? f->unit
                                  : f->type == WEFT_FIELD_SIZE   ? "WxH"
                                                                 : "VALUE";
        snprintf(left, sizeof left, "%c%c%s--%s%s%s", f->short_opt ? '-' : ' ',
                 f->short_opt ? f->short_opt : ' ', f->short_opt ? ", " : "  ", f->key, value ? " " : "",
                 value ? value : "");
        if (has_range(f))
            snprintf(range, sizeof range, ", %g to %g", f->min, f->max);
        fprintf(out, "  %-34s%s%s", left, strlen(left) > 33 ? "\n                                    " : "",
                f->help);
        if (f->def && f->type != WEFT_FIELD_FLAG)
            fprintf(out, " (default %s%s)", f->def, range);
        else if (range[0])
            fprintf(out, " (%s)", range + 2);
        else if (f->required)
            fprintf(out, " (needed)");
        fputc('\n', out);
    }
}
