#include "core/log.h"

#include <stdio.h>

static weft_log_level level_now = WEFT_LOG_NORMAL;

void weft_log_set_level(weft_log_level level)
{
    level_now = level;
}

weft_log_level weft_log_get_level(void)
{
    return level_now;
}

/* One fprintf per line: stdio locks the stream, so lines of two threads do not mix. */
static void print_line(const char *before, const char *format, va_list args)
{
    char line[1200];
    vsnprintf(line, sizeof line, format, args);
    fprintf(stderr, "%s%s\n", before, line);
}

#define PRINT_IF(condition, before)                                                                          \
    do {                                                                                                     \
        if (condition) {                                                                                     \
            va_list args;                                                                                    \
            va_start(args, format);                                                                          \
            print_line(before, format, args);                                                                \
            va_end(args);                                                                                    \
        }                                                                                                    \
    } while (0)

void weft_log_error(const char *format, ...)
{
    PRINT_IF(1, "weft: ");
}

void weft_warn(const char *format, ...)
{
    PRINT_IF(level_now >= WEFT_LOG_NORMAL, "warning: ");
}

void weft_note(const char *format, ...)
{
    PRINT_IF(level_now >= WEFT_LOG_NORMAL, "");
}

void weft_explain(const char *format, ...)
{
    PRINT_IF(level_now >= WEFT_LOG_VERBOSE, "");
}
