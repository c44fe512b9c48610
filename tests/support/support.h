/** What every test program needs: cmocka, a scratch folder, the staged data. */
#ifndef WEFT_TESTS_SUPPORT_H
#define WEFT_TESTS_SUPPORT_H

/* cmocka wants these first. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "core/error.h"

#include <stdbool.h>

/** Fails the test with the error's text unless the call gives WEFT_OK. */
#define assert_ok(call)                                                                                      \
    do {                                                                                                     \
        weft_error assert_ok_error = {0};                                                                    \
        weft_error *const err = &assert_ok_error;                                                            \
        const weft_err assert_ok_status = (call);                                                            \
        if (assert_ok_status != WEFT_OK)                                                                     \
            fail_msg("%s: %s: %s", #call, weft_err_name(assert_ok_status), assert_ok_error.text);            \
    } while (0)

/** The call (which uses `err`) must fail with `code` and a text that contains `words`. */
#define assert_fails(call, code, words)                                                                      \
    do {                                                                                                     \
        weft_error assert_fails_error = {0};                                                                 \
        weft_error *const err = &assert_fails_error;                                                         \
        const weft_err assert_fails_status = (call);                                                         \
        weft_test_check_failure(#call, assert_fails_status, (code), &assert_fails_error, (words));           \
    } while (0)

void weft_test_check_failure(const char *call, weft_err status, weft_err wanted, const weft_error *error,
                             const char *words);

/** |a - b| <= tolerance, with both values in the message. */
#define assert_near(a, b, tolerance) weft_test_near((a), (b), (tolerance), #a, __FILE__, __LINE__)
void weft_test_near(double a, double b, double tolerance, const char *what, const char *file, int line);

/** A fresh empty folder for this process, removed at exit; the same at each call. */
const char *weft_test_folder(void);
/** `name` inside it, in one of eight rotating buffers. */
const char *weft_test_path(const char *name);

/** Path of `name` in the staged data folder (WEFT_SHARED, or ../shared beside the source tree), in a
 *  rotating buffer; NULL when it is not there: then skip() after saying so. */
const char *weft_test_shared(const char *name);
/** As above, but prints why and calls cmocka's skip() when absent. */
const char *weft_test_need_shared(const char *name);

/** A small deterministic random generator; uniform in [0, 1). */
double weft_test_random(uint64_t *state);
/** Standard normal. */
double weft_test_gauss(uint64_t *state);

#endif
