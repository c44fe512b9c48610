#include "host/cli/command.h"

#include "core/log.h"
#include "core/mem.h"
#include "core/progress.h"
#include "core/report_channel.h"
#include "core/version.h"
#include "host/cli/remote.h"

#include <errno.h>
#include <fcntl.h>
#include <stdlib.h>
#include <string.h>

/* The options that every command has. */
typedef struct common_args {
    bool help, json, force, quiet, verbose;
} common_args;

const weft_field weft_common_fields[] = {
    {.key = "json",
     .type = WEFT_FIELD_FLAG,
     .offset = offsetof(common_args, json),
     .help = "print one JSON object on stdout"},
    {.key = "force",
     .type = WEFT_FIELD_FLAG,
     .offset = offsetof(common_args, force),
     .help = "replace outputs that exist"},
    {.key = "quiet",
     .short_opt = 'q',
     .type = WEFT_FIELD_FLAG,
     .offset = offsetof(common_args, quiet),
     .help = "say nothing but errors"},
    {.key = "verbose",
     .short_opt = 'v',
     .type = WEFT_FIELD_FLAG,
     .offset = offsetof(common_args, verbose),
     .help = "explain what is done"},
    {.key = "help",
     .short_opt = 'h',
     .type = WEFT_FIELD_FLAG,
     .offset = offsetof(common_args, help),
     .help = "print this help"},
    {0},
};

weft_err weft_print_json(const weft_invocation *inv, json_t *object, weft_error *err)
{
    if (!object)
        return weft_fail(err, WEFT_ERR_NOMEM, "out of memory for the result");
    const int failed = json_dumpf(object, inv->out, JSON_COMPACT | JSON_REAL_PRECISION(9));
    json_decref(object);
    if (failed || fputc('\n', inv->out) == EOF || fflush(inv->out) != 0)
        return weft_fail_errno(err, WEFT_ERR_IO, "the result cannot be written");
    return WEFT_OK;
}

static void print_overview(FILE *out)
{
    fprintf(out,
            "Weft, an open-source textile scanner (version %s)\n\n"
            "usage: weft COMMAND [OPTIONS] ...\n\n",
            WEFT_VERSION);
    for (const weft_command *const *c = weft_commands; *c; c++)
        fprintf(out, "  %-22s %s\n", (*c)->name, (*c)->summary);
    fprintf(out, "\n\"weft COMMAND --help\" explains a command and shows an example.\n");
}

static void print_help(const weft_command *command, FILE *out)
{
    fprintf(out, "weft %s: %s\n\nusage: weft %s%s%s%s\n", command->name, command->summary, command->name,
            command->operands[0] ? " " : "", command->operands, command->fields ? " [OPTIONS]" : "");
    if (command->details)
        fprintf(out, "\n%s\n", command->details);
    fputs("\noptions:\n", out);
    weft_fields_print_help(command->fields, out);
    weft_fields_print_help(weft_common_fields, out);
    fprintf(out, "\nexample:\n  %s\n", command->example);
}

/* The words of `name` that argv starts with: 0 when the command is not meant. */
static int match_words(const char *name, int argc, char **argv)
{
    int words = 0;
    for (const char *p = name; *p;) {
        const size_t n = strcspn(p, " ");
        if (words >= argc || strlen(argv[words]) != n || memcmp(argv[words], p, n) != 0)
            return 0;
        words++;
        p += n + (p[n] == ' ');
    }
    return words;
}

static const weft_command *find_command(int argc, char **argv, int *words)
{
    const weft_command *best = NULL;
    *words = 0;
    for (const weft_command *const *c = weft_commands; *c; c++) {
        const int n = match_words((*c)->name, argc, argv);
        if (n > *words) {
            best = *c;
            *words = n;
        }
    }
    return best;
}

/* "weft calibrate" alone, or "weft calibrate --help": the commands that begin with the word. */
static int list_group(const char *word)
{
    const size_t n = strlen(word);
    int found = 0;
    for (const weft_command *const *c = weft_commands; *c; c++)
        if (strncmp((*c)->name, word, n) == 0 && (*c)->name[n] == ' ') {
            if (!found++)
                printf("usage: weft %s STEP ...\n\n", word);
            printf("  weft %-22s %s\n", (*c)->name, (*c)->summary);
        }
    return found;
}

/* The first words of argv, as many as `name` has, with blanks between. */
static void join_words(const char *name, int argc, char **argv, char joined[64])
{
    int words = 1, used = 0;
    for (const char *p = name; (p = strchr(p, ' ')) != NULL; p++)
        words++;
    joined[0] = '\0';
    for (int i = 0; i < words && i < argc && used < 64; i++)
        used += snprintf(joined + used, (size_t)(64 - used), "%s%s", i > 0 ? " " : "", argv[i]);
}

static int unknown_command(int argc, char **argv)
{
    const char *nearest = NULL;
    char joined[64], meant[64] = "";
    int best = 3; /* more than two slips is another word */
    bool begins = false;
    for (const weft_command *const *c = weft_commands; *c; c++) {
        const size_t n = strlen(argv[0]);
        begins |= strncmp((*c)->name, argv[0], n) == 0 && (*c)->name[n] == ' ';
        join_words((*c)->name, argc, argv, joined);
        const int distance = weft_text_distance(joined, (*c)->name);
        if (distance < best) {
            best = distance;
            nearest = (*c)->name;
            memcpy(meant, joined, sizeof meant);
        }
    }
    if (argv[0][0] == '-')
        weft_log_error("%s: no such option; those of a command go behind its name (weft COMMAND --help)",
                       argv[0]);
    else if (nearest)
        weft_log_error("%s: no such command; did you mean \"weft %s\"?", meant, nearest);
    else if (begins)
        weft_log_error("%s %s: no such command; \"weft %s --help\" lists those that begin so", argv[0],
                       argv[1], argv[0]);
    else
        weft_log_error("%s: no such command; \"weft --help\" lists them", argv[0]);
    return weft_err_exit_status(WEFT_ERR_USAGE);
}

static int report(const weft_command *command, weft_err status, const weft_error *error)
{
    if (status == WEFT_OK)
        return 0;
    const char *const text = error->text[0] ? error->text : weft_err_text(status);
    if (status == WEFT_ERR_USAGE)
        weft_log_error("%s: %s (\"weft %s --help\" explains)", command->name, text, command->name);
    else
        weft_log_error("%s: %s", command->name, text);
    return weft_err_exit_status(status);
}

static weft_err check_operand_count(const weft_command *command, int n, weft_error *err)
{
    if (n < command->min_operands)
        return weft_fail(err, WEFT_ERR_USAGE, "%s is missing", command->operands);
    if (command->max_operands >= 0 && n > command->max_operands)
        return weft_fail(err, WEFT_ERR_USAGE, "too many words: wanted %s",
                         command->operands[0] ? command->operands : "options only");
    return WEFT_OK;
}

/* Here, or in the daemon that owns the scanner; then *exit_status is the command's there. */
static weft_err run_here_or_there(const weft_command *command, int argc, char **argv,
                                  const weft_invocation *inv, const void *args, int *exit_status,
                                  weft_error *err)
{
    char socket[108];
    bool there;
    if (command->stays_here && command->stays_here(args))
        return command->run(inv, args, err);
    WEFT_TRY(weft_remote_wanted(command, socket, &there, err));
    return there ? weft_remote_run(command, argc, argv, inv, socket, exit_status, err)
                 : command->run(inv, args, err);
}

static int run_command(const weft_command *command, int argc, char **argv)
{
    weft_error error = {0};
    common_args common = {0};
    weft_invocation inv = {.out = stdout};
    weft_err status = WEFT_ERR_NOMEM;
    int there_status = 0;
    void *const args = weft_alloc(1, command->args_size, &error);
    const char **const operands = weft_alloc((size_t)argc + 1, sizeof *operands, &error);
    if (args && operands) {
        weft_fields_set_defaults(command->fields, args);
        const weft_field *const tables[] = {command->fields, weft_common_fields};
        void *const structs[] = {args, &common};
        for (int i = 0; i < argc && strcmp(argv[i], "--") != 0; i++) /* --help wins over what is missing */
            common.help |= strcmp(argv[i], "--help") == 0 || strcmp(argv[i], "-h") == 0;
        if (common.help) {
            print_help(command, stdout);
            status = WEFT_OK;
        } else {
            status =
                weft_fields_parse_argv(tables, structs, 2, argc, argv, operands, &inv.n_operands, &error);
            if (status == WEFT_OK)
                status = check_operand_count(command, inv.n_operands, &error);
            if (status == WEFT_OK) {
                weft_log_set_level(common.quiet     ? WEFT_LOG_QUIET
                                   : common.verbose ? WEFT_LOG_VERBOSE
                                                    : WEFT_LOG_NORMAL);
                inv.operands = operands;
                inv.json = common.json;
                inv.force = common.force;
                weft_cancel_on_signals();
                status = run_here_or_there(command, argc, argv, &inv, args, &there_status, &error);
            }
        }
    }
    const int exit_status = status == WEFT_OK ? there_status : report(command, status, &error);
    weft_free(operands);
    weft_free(args);
    return exit_status;
}

/* "weft help", "weft help calibrate", "weft help calibrate lens" */
static int help_about(int argc, char **argv)
{
    int words;
    if (argc == 0) {
        print_overview(stdout);
        return 0;
    }
    const weft_command *const command = find_command(argc, argv, &words);
    if (command)
        print_help(command, stdout);
    return command || list_group(argv[0]) ? 0 : unknown_command(argc, argv);
}

static int dispatch(int argc, char **argv)
{
    int words;
    if (argc == 0) {
        print_overview(stderr);
        return weft_err_exit_status(WEFT_ERR_USAGE);
    }
    if (strcmp(argv[0], "--help") == 0 || strcmp(argv[0], "-h") == 0 || strcmp(argv[0], "help") == 0)
        return help_about(argc - 1, argv + 1);
    if (strcmp(argv[0], "--version") == 0) {
        printf("weft %s\n", WEFT_VERSION);
        return 0;
    }
    const weft_command *const command = find_command(argc, argv, &words);
    if (command)
        return run_command(command, argc - words, argv + words);
    if ((argc == 1 || argv[1][0] == '-') && list_group(argv[0]))
        return argc == 1 ? weft_err_exit_status(WEFT_ERR_USAGE) : 0;
    return unknown_command(argc, argv);
}

/* A standard stream that is closed (weft ... >&-) would be the number of the next file opened, and the
 * results would go into it: instead they fail. */
static void occupy_standard_streams(void)
{
    for (int fd = 0; fd <= 2; fd++)
        if (fcntl(fd, F_GETFD) < 0)
            (void)open("/dev/null", fd == 0 ? O_WRONLY : O_RDONLY);
}

int weft_cli_main(int argc, char **argv)
{
    occupy_standard_streams();
    weft_report_open();
    const int exit_status = dispatch(argc - 1, argv + 1);
    const int flushed = fflush(stdout), number = errno;
    if (flushed == 0 && !ferror(stdout))
        return exit_status;
    if (exit_status == 0) /* who failed before has said why */
        weft_log_error("the results cannot be written to stdout: %s",
                       flushed == 0 ? "part of them is lost" : strerror(number));
    return exit_status ? exit_status : weft_err_exit_status(WEFT_ERR_IO);
}
