/* weftd: the daemon that owns the scanner, the queue and the library.  docs/daemon.md */
#include "host/daemon/daemon.h"

#include "core/log.h"
#include "core/version.h"

#include <stdio.h>
#include <string.h>

static void print_help(void)
{
    printf("weftd: %s\n\nusage: weftd --library DIR [OPTIONS]\n\n%s\n\noptions:\n", weft_daemon_summary,
           weft_daemon_details);
    weft_fields_print_help(weft_daemon_fields, stdout);
    fputs("\nexample:\n", stdout);
    for (const char *line = weft_daemon_example; *line;) {
        const size_t n = strcspn(line, "\n");
        printf("  %.*s\n", (int)n, line);
        line += n + (line[n] == '\n');
    }
}

static bool asks(int argc, char **argv, const char *option)
{
    for (int i = 1; i < argc; i++)
        if (strcmp(argv[i], option) == 0)
            return true;
    return false;
}

int main(int argc, char **argv)
{
    weft_daemon_options options = {0};
    weft_error error = {0};
    const weft_field *const tables[] = {weft_daemon_fields};
    const char *operands[64];
    int n_operands = 0;
    if (asks(argc, argv, "--help") || asks(argc, argv, "-h")) {
        print_help();
        return 0;
    }
    if (asks(argc, argv, "--version")) {
        printf("weftd %s\n", WEFT_VERSION);
        return 0;
    }
    weft_fields_set_defaults(weft_daemon_fields, &options);
    weft_err status = argc <= 64 ? WEFT_OK : weft_fail(&error, WEFT_ERR_USAGE, "too many words");
    if (status == WEFT_OK)
        status = weft_fields_parse_argv(tables, (void *[]){&options}, 1, argc - 1, argv + 1, operands,
                                        &n_operands, &error);
    if (status == WEFT_OK && n_operands > 0)
        status = weft_fail(&error, WEFT_ERR_USAGE, "%s: wanted options only", operands[0]);
    if (status == WEFT_OK) {
        weft_log_set_level(options.quiet     ? WEFT_LOG_QUIET
                           : options.verbose ? WEFT_LOG_VERBOSE
                                             : WEFT_LOG_NORMAL);
        status = weft_daemon_run(&options, &error);
    }
    if (status == WEFT_ERR_USAGE)
        weft_log_error("weftd: %s (\"weftd --help\" explains)", error.text);
    else if (status != WEFT_OK)
        weft_log_error("weftd: %s", error.text);
    return weft_err_exit_status(status);
}
