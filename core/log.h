/** Messages to the person at the terminal (stderr).  Results go to stdout and never through here. */
#ifndef WEFT_CORE_LOG_H
#define WEFT_CORE_LOG_H

#include "core/error.h"

typedef enum weft_log_level {
    WEFT_LOG_QUIET = 0,   /* errors only (-q) */
    WEFT_LOG_NORMAL = 1,  /* warnings and notes */
    WEFT_LOG_VERBOSE = 2, /* explains what is done (-v) */
} weft_log_level;

/** Set once by `main`, before threads start. */
void weft_log_set_level(weft_log_level level);
weft_log_level weft_log_get_level(void);

/** One line each, newline added.  Safe from any thread. */
void weft_log_error(const char *format, ...) WEFT_PRINTF(1, 2); /* always printed */
void weft_warn(const char *format, ...) WEFT_PRINTF(1, 2);      /* "warning: ...", unless quiet */
void weft_note(const char *format, ...) WEFT_PRINTF(1, 2);      /* unless quiet */
void weft_explain(const char *format, ...) WEFT_PRINTF(1, 2);   /* only verbose */

#endif
