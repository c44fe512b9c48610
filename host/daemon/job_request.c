#include "host/daemon/job_request.h"

#include "core/json.h"
#include "core/mem.h"
#include "host/cli/command.h"
#include "host/daemon/library_path.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

enum { MAX_OPERANDS = 1000, MAX_OPTIONS = 100, MAX_TEXT = 4096, MAX_AFTER = 100 };

typedef struct parse {
    const weft_job_rights *rights;
    const weft_job_kind *kind;
    const weft_command *command;
    weft_job *job;
} parse;

static const weft_command *find_command(const char *name)
{
    for (const weft_command *const *c = weft_commands; *c; c++)
        if (strcmp((*c)->name, name) == 0)
            return *c;
    return NULL;
}

static const weft_field *find_field(const weft_command *command, const char *key)
{
    const weft_field *const tables[] = {command->fields, weft_common_fields};
    for (int t = 0; t < 2; t++)
        for (const weft_field *f = tables[t]; f && f->key; f++)
            if (strcmp(f->key, key) == 0)
                return f;
    return NULL;
}

static weft_err check_keys(const json_t *request, weft_error *err)
{
    const char *key;
    json_t *value;
    json_object_foreach((json_t *)(uintptr_t)request, key, value)
    {
        (void)value;
        if (!weft_job_kind_lists("command|operands|options|format|hold|after", key))
            return weft_fail(err, WEFT_ERR_USAGE,
                             "\"%.40s\": a job has command, operands, options, format, hold and after", key);
    }
    return WEFT_OK;
}

static weft_err find_kind(parse *p, const json_t *request, weft_error *err)
{
    const char *name = "";
    WEFT_TRY(weft_json_get_text(request, "command", WEFT_JSON_REQUIRED, &name, "the job", err));
    p->kind = weft_job_kind_find(name);
    p->command = find_command(name);
    if (!p->kind || !p->command)
        return weft_fail(err, WEFT_ERR_USAGE, "\"%.40s\" cannot be a job; GET /v1/commands lists what can",
                         name);
    p->job->command = weft_strdup(name, err);
    p->job->hardware = p->kind->hardware;
    return p->job->command ? WEFT_OK : WEFT_ERR_NOMEM;
}

static weft_err add_word(parse *p, char *word, weft_error *err)
{
    const int failed = !word || json_array_append_new(p->job->words, json_string(word)) != 0;
    weft_free(word);
    return failed ? weft_fail(err, WEFT_ERR_NOMEM, "out of memory for the job") : WEFT_OK;
}

/* The value as it goes on the command line: a path becomes absolute and is remembered. */
static weft_err make_value(parse *p, const char *key, const char *text, char **value, weft_error *err)
{
    const bool read = weft_job_kind_lists(p->kind->reads, key),
               write = weft_job_kind_lists(p->kind->writes, key);
    if (strlen(text) > MAX_TEXT)
        return weft_fail(err, WEFT_ERR_USAGE, "%s: longer than %d bytes", key, MAX_TEXT);
    if (!read && !write) {
        *value = weft_strdup(text, err);
        return *value ? WEFT_OK : WEFT_ERR_NOMEM;
    }
    WEFT_TRY(weft_library_path(p->rights->root, p->rights->own_user, text, value, err));
    if (read)
        json_array_append_new(p->job->reads, json_string(*value));
    if (write)
        json_array_append_new(p->job->writes, json_string(*value));
    return WEFT_OK;
}

static weft_err add_option(parse *p, const char *key, const char *text, weft_error *err)
{
    char *value = NULL;
    WEFT_TRY(make_value(p, key, text, &value, err));
    char *const word = weft_asprintf(err, "--%s=%s", key, value);
    weft_free(value);
    return add_word(p, word, err);
}

/* A number or a text as text; false for anything else. */
static bool to_text(const json_t *value, char text[MAX_TEXT + 2])
{
    if (json_is_integer(value))
        snprintf(text, MAX_TEXT + 2, "%lld", (long long)json_integer_value(value));
    else if (json_is_real(value))
        snprintf(text, MAX_TEXT + 2, "%.17g", json_real_value(value));
    else if (json_is_string(value) && json_string_length(value) <= MAX_TEXT &&
             strlen(json_string_value(value)) == json_string_length(value))
        snprintf(text, MAX_TEXT + 2, "%s", json_string_value(value));
    else
        return false;
    return true;
}

/* [1, 2.5] for "1,2.5" */
static bool list_to_text(const json_t *list, char text[MAX_TEXT + 2])
{
    size_t used = 0;
    text[0] = '\0';
    for (size_t i = 0; i < json_array_size(list); i++) {
        const json_t *const item = json_array_get(list, i);
        if (!json_is_number(item) || !isfinite(json_number_value(item)) || used + 40 > MAX_TEXT)
            return false;
        used += (size_t)snprintf(text + used, MAX_TEXT + 2 - used, "%s%.17g", i ? "," : "",
                                 json_number_value(item));
    }
    return used > 0;
}

static bool is_classified(const weft_job_kind *kind, const char *key)
{
    return weft_job_kind_is_path(kind, key) || weft_job_kind_lists(kind->texts, key) ||
           weft_job_kind_is_device(key);
}

static weft_err take_option(parse *p, const char *key, const json_t *value, weft_error *err)
{
    char text[MAX_TEXT + 2];
    const weft_field *const field = find_field(p->command, key);
    if (!field || strcmp(key, "json") == 0 || strcmp(key, "help") == 0)
        return weft_fail(err, WEFT_ERR_USAGE, "\"%.40s\" is no option of %s%s", key, p->command->name,
                         field ? " for a job" : "");
    if (weft_job_kind_is_device(key) && !p->rights->own_user)
        return weft_fail(err, WEFT_ERR_RANGE, "\"%s\": the devices are the daemon's; leave the option out",
                         key);
    if (weft_job_kind_lists(p->kind->never, key) ||
        ((field->type == WEFT_FIELD_TEXT || field->type == WEFT_FIELD_TEXTS) && !is_classified(p->kind, key)))
        return weft_fail(err, WEFT_ERR_USAGE, "\"%s\" cannot be given to a job", key); /* it may be a path */
    if (field->type == WEFT_FIELD_FLAG) {
        if (!json_is_boolean(value))
            return weft_fail(err, WEFT_ERR_USAGE, "\"%s\": wanted true or false", key);
        return json_is_true(value) ? add_word(p, weft_asprintf(err, "--%s", key), err) : WEFT_OK;
    }
    if (field->type == WEFT_FIELD_TEXTS && json_is_array(value)) {
        for (size_t i = 0; i < json_array_size(value); i++) {
            if (!to_text(json_array_get(value, i), text))
                return weft_fail(err, WEFT_ERR_USAGE, "\"%s\": wanted a list of texts", key);
            WEFT_TRY(add_option(p, key, text, err));
        }
        return WEFT_OK;
    }
    if (json_is_array(value) ? field->type != WEFT_FIELD_F64S || !list_to_text(value, text)
                             : !to_text(value, text))
        return weft_fail(err, WEFT_ERR_USAGE, "\"%s\": wanted a number or a text", key);
    return add_option(p, key, text, err);
}

static weft_err take_options(parse *p, const json_t *request, weft_error *err)
{
    const json_t *options = NULL;
    const char *key;
    json_t *value;
    WEFT_TRY(weft_json_get_object(request, "options", WEFT_JSON_OPTIONAL, &options, "the job", err));
    if (json_object_size(options) > MAX_OPTIONS)
        return weft_fail(err, WEFT_ERR_USAGE, "more than %d options", MAX_OPTIONS);
    json_object_foreach((json_t *)(uintptr_t)options, key, value) WEFT_TRY(take_option(p, key, value, err));
    return WEFT_OK;
}

/* The library and the devices that the daemon was started for, where the request names none. */
static weft_err add_devices(parse *p, const json_t *request, weft_error *err)
{
    const struct {
        const char *key, *value;
    } devices[] = {{"rig", p->rights->rig}, {"port", p->rights->port}, {"camera", p->rights->camera}};
    const json_t *const options = json_object_get(request, "options");
    if (p->kind->in_library && !json_object_get(options, "library"))
        return add_option(p, "library", p->rights->root, err);
    for (int i = 0; i < 3; i++)
        if (json_object_get(options, devices[i].key))
            return WEFT_OK;
    for (int i = 0; i < 3; i++)
        if (devices[i].value && find_field(p->command, devices[i].key))
            WEFT_TRY(add_option(p, devices[i].key, devices[i].value, err));
    return WEFT_OK;
}

static weft_err take_format(parse *p, const json_t *request, weft_error *err)
{
    const char *format = "json";
    bool hold = false;
    WEFT_TRY(weft_json_get_text(request, "format", WEFT_JSON_OPTIONAL, &format, "the job", err));
    WEFT_TRY(weft_json_get_bool(request, "hold", WEFT_JSON_OPTIONAL, &hold, "the job", err));
    if (strcmp(format, "json") != 0 && strcmp(format, "text") != 0)
        return weft_fail(err, WEFT_ERR_USAGE, "\"format\": wanted json or text");
    return strcmp(format, "json") == 0 ? add_word(p, weft_strdup("--json", err), err) : WEFT_OK;
}

/* Numbers of jobs; whether there are such jobs is for the queue to see. */
static weft_err check_after(const json_t *request, weft_error *err)
{
    const json_t *after = NULL;
    WEFT_TRY(weft_json_get_array(request, "after", WEFT_JSON_OPTIONAL, &after, "the job", err));
    if (json_array_size(after) > MAX_AFTER)
        return weft_fail(err, WEFT_ERR_USAGE, "\"after\": more than %d jobs", MAX_AFTER);
    for (size_t i = 0; i < json_array_size(after); i++)
        if (!json_is_integer(json_array_get(after, i)) || json_integer_value(json_array_get(after, i)) < 1)
            return weft_fail(err, WEFT_ERR_USAGE, "\"after\": wanted a list of numbers of jobs");
    return WEFT_OK;
}

static weft_err take_operands(parse *p, const json_t *request, weft_error *err)
{
    const json_t *operands = NULL;
    WEFT_TRY(weft_json_get_array(request, "operands", WEFT_JSON_OPTIONAL, &operands, "the job", err));
    if (json_array_size(operands) > MAX_OPERANDS)
        return weft_fail(err, WEFT_ERR_USAGE, "more than %d operands", MAX_OPERANDS);
    WEFT_TRY(add_word(p, weft_strdup("--", err), err));
    for (size_t i = 0; i < json_array_size(operands); i++) {
        const json_t *const operand = json_array_get(operands, i);
        char *value = NULL;
        if (!json_is_string(operand) || strlen(json_string_value(operand)) != json_string_length(operand))
            return weft_fail(err, WEFT_ERR_USAGE, "\"operands\": wanted a list of texts");
        WEFT_TRY(make_value(p, "*", json_string_value(operand), &value, err));
        WEFT_TRY(add_word(p, value, err));
    }
    return WEFT_OK;
}

/* The command's own tables have the last word: ranges, choices, what is needed, how many operands. */
static weft_err check_words(const parse *p, weft_error *err)
{
    const size_t n = json_array_size(p->job->words);
    bool common[16] = {false}; /* the frame's flags; their offsets are small */
    const weft_field *const tables[] = {p->command->fields, weft_common_fields};
    char **const argv = weft_alloc(n + 1, sizeof *argv, err);
    const char **const operands = weft_alloc(n + 1, sizeof *operands, err);
    void *const args = weft_alloc(1, p->command->args_size, err);
    int n_operands = 0;
    weft_err status = argv && operands && args ? WEFT_OK : WEFT_ERR_NOMEM;
    if (status == WEFT_OK) {
        for (size_t i = 0; i < n; i++)
            argv[i] = (char *)(uintptr_t)json_string_value(json_array_get(p->job->words, i));
        weft_fields_set_defaults(p->command->fields, args);
        status = weft_fields_parse_argv(tables, (void *const[]){args, common}, 2, (int)n, argv, operands,
                                        &n_operands, err);
    }
    weft_free(argv);
    weft_free(operands);
    weft_free(args);
    WEFT_TRY(status);
    if (n_operands < p->command->min_operands)
        return weft_fail(err, WEFT_ERR_USAGE, "operands: %s is missing", p->command->operands);
    if (p->command->max_operands >= 0 && n_operands > p->command->max_operands)
        return weft_fail(err, WEFT_ERR_USAGE, "operands: too many: wanted %s",
                         p->command->operands[0] ? p->command->operands : "none");
    return WEFT_OK;
}

static weft_err fill(parse *p, const json_t *request, weft_error *err)
{
    p->job->words = json_array();
    p->job->reads = json_array();
    p->job->writes = json_array();
    p->job->owner = weft_strdup(p->rights->owner, err);
    if (!p->job->words || !p->job->reads || !p->job->writes || !p->job->owner)
        return weft_fail(err, WEFT_ERR_NOMEM, "out of memory for the job");
    WEFT_TRY(check_keys(request, err));
    WEFT_TRY(check_after(request, err));
    WEFT_TRY(find_kind(p, request, err));
    WEFT_TRY(take_format(p, request, err));
    WEFT_TRY(take_options(p, request, err));
    WEFT_TRY(add_devices(p, request, err));
    WEFT_TRY(take_operands(p, request, err));
    return check_words(p, err);
}

weft_err weft_job_request_parse(const char *bytes, size_t n, const weft_job_rights *rights, weft_job *job,
                                weft_error *err)
{
    json_error_t where;
    weft_job made = {.exit_status = -1};
    parse p = {.rights = rights, .job = &made};
    json_t *const request = json_loadb(bytes, n, JSON_REJECT_DUPLICATES | JSON_DECODE_ANY, &where);
    if (!request)
        return weft_fail(err, WEFT_ERR_FORMAT, "the body is not JSON: line %d: %.150s", where.line,
                         where.text);
    made.request = request;
    const weft_err status = json_is_object(request)
                                ? fill(&p, request, err)
                                : weft_fail(err, WEFT_ERR_FORMAT, "the body holds no JSON object");
    if (status != WEFT_OK) {
        weft_job_fini(&made);
        return status;
    }
    *job = made;
    return WEFT_OK;
}

bool weft_job_request_holds(const json_t *request)
{
    return json_is_true(json_object_get(request, "hold"));
}

bool weft_job_request_is_after(const json_t *request, int64_t id)
{
    const json_t *const after = json_object_get(request, "after");
    for (size_t i = 0; i < json_array_size(after); i++)
        if (json_integer_value(json_array_get(after, i)) == id)
            return true;
    return false;
}
