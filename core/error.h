/**
 * How a function says that the world has failed it.
 *
 * Every function that can fail returns a weft_err and takes a caller-owned `weft_error *err` (which may
 * be NULL) for the sentence a user will read: what went wrong, in which file or device, what to do.
 * The first cause is kept; layers above put words in front with weft_prefix().  On failure outputs are
 * unchanged.  Our own mistakes are `assert`, never an error; an error is never our own mistake.
 */
#ifndef WEFT_CORE_ERROR_H
#define WEFT_CORE_ERROR_H

#include <stdarg.h>
#include <stddef.h>

/** One list gives the enum, the names, the texts and the exit status of the programs. */
#define WEFT_ERROR_LIST(X) /* name, exit status, text */                                                     \
    X(OK, 0, "success")                                                                                      \
    X(USAGE, 2, "wrong usage")                                                                               \
    X(NOMEM, 1, "out of memory")                                                                             \
    X(IO, 1, "a file or folder cannot be read or written")                                                   \
    X(EXISTS, 1, "the output is there already")                                                              \
    X(FORMAT, 1, "a file is damaged or not what it should be")                                               \
    X(VERSION, 1, "a file is of a version this program does not know")                                       \
    X(MISSING, 1, "something that is needed is absent")                                                      \
    X(RANGE, 1, "a value is outside its range")                                                              \
    X(MISMATCH, 1, "two things that must fit do not")                                                        \
    X(NODATA, 1, "the data do not determine an answer")                                                      \
    X(DEVICE, 1, "a device failed or is not there")                                                          \
    X(TIMEOUT, 1, "a device did not answer in time")                                                         \
    X(PROTOCOL, 1, "a device answered what it should not")                                                   \
    X(UNSUPPORTED, 1, "this build or device cannot do it")                                                   \
    X(CANCELLED, 130, "cancelled")

typedef enum weft_err {
#define X(name, status, text) WEFT_ERR_##name,
    WEFT_ERROR_LIST(X)
#undef X
} weft_err;

#define WEFT_OK WEFT_ERR_OK

/** The text of a failure.  Lives with the caller; `{0}` is "nothing failed". */
typedef struct weft_error {
    weft_err code;
    char text[1024]; /* UTF-8, one line, ends with NUL; cut when longer */
} weft_error;

#if defined(__GNUC__)
#define WEFT_PRINTF(fmt, first) __attribute__((format(printf, fmt, first)))
#define WEFT_MUST_CHECK         __attribute__((warn_unused_result))
#else
#define WEFT_PRINTF(fmt, first)
#define WEFT_MUST_CHECK
#endif

/** Fills `err` (when not NULL) and returns `code`.  The text says what, which file, what to do. */
weft_err weft_fail(weft_error *err, weft_err code, const char *format, ...) WEFT_PRINTF(3, 4);

/** As weft_fail() for the current `errno`: ends the text with ": " and the system's words. */
weft_err weft_fail_errno(weft_error *err, weft_err code, const char *format, ...) WEFT_PRINTF(3, 4);

/** Puts "format: " in front of the text that is there and returns `code`, so that it can be returned. */
weft_err weft_prefix(weft_error *err, weft_err code, const char *format, ...) WEFT_PRINTF(3, 4);

#ifdef __clang_analyzer__
/* The analyzer cannot see that these return `code`, and would follow failures as if they were WEFT_OK. */
#define weft_fail(err, code, ...)       (weft_fail(err, code, __VA_ARGS__), (code))
#define weft_fail_errno(err, code, ...) (weft_fail_errno(err, code, __VA_ARGS__), (code))
#define weft_prefix(err, code, ...)     (weft_prefix(err, code, __VA_ARGS__), (code))
#endif

/** @return "IO", "FORMAT", ...; never NULL. */
const char *weft_err_name(weft_err code);
/** @return the general sentence of a code; never NULL. */
const char *weft_err_text(weft_err code);
/** @return what `main` exits with: 0, 1, 2 or 130. */
int weft_err_exit_status(weft_err code);

/** Returns from the calling function when `expression` is not WEFT_OK.  For functions with nothing to free.
 */
#define WEFT_TRY(expression)                                                                                 \
    do {                                                                                                     \
        const weft_err weft_try_code = (expression);                                                         \
        if (weft_try_code != WEFT_OK)                                                                        \
            return weft_try_code;                                                                            \
    } while (0)

#endif
