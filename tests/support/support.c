#include "tests/support/support.h"

#include "core/file.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

void weft_test_check_failure(const char *call, weft_err status, weft_err wanted, const weft_error *error,
                             const char *words)
{
    if (status != wanted)
        fail_msg("%s: gave %s (%s), wanted %s", call, weft_err_name(status), error->text,
                 weft_err_name(wanted));
    if (!strstr(error->text, words))
        fail_msg("%s: the text \"%s\" does not say \"%s\"", call, error->text, words);
}

void weft_test_near(double a, double b, double tolerance, const char *what, const char *file, int line)
{
    if (fabs(a - b) <= tolerance)
        return;
    print_error("%s is %.12g, wanted %.12g +- %.3g\n", what, a, b, tolerance);
    _fail(file, line);
}

static char folder[64];

static void remove_folder(void)
{
    weft_folder_remove(folder, NULL);
}

const char *weft_test_folder(void)
{
    if (!folder[0]) {
        snprintf(folder, sizeof folder, "/tmp/weft-test-XXXXXX");
        if (!mkdtemp(folder)) {
            perror("mkdtemp");
            exit(1);
        }
        atexit(remove_folder);
    }
    return folder;
}

static char *next_buffer(void)
{
    static char buffers[8][1024];
    static int next;
    return buffers[next++ % 8];
}

const char *weft_test_path(const char *name)
{
    char *const path = next_buffer();
    snprintf(path, 1024, "%s/%s", weft_test_folder(), name);
    return path;
}

const char *weft_test_shared(const char *name)
{
    char *const path = next_buffer();
    const char *const given = getenv("WEFT_SHARED"), *const source = getenv("WEFT_TEST_SOURCE");
    if (given)
        snprintf(path, 1024, "%s/%s", given, name);
    else
        snprintf(path, 1024, "%s/../shared/%s", source ? source : ".", name);
    return weft_file_exists(path) ? path : NULL;
}

const char *weft_test_need_shared(const char *name)
{
    const char *const path = weft_test_shared(name);
    if (!path) {
        print_message("skipped: the staged data %s is not here (set WEFT_SHARED to its folder)\n", name);
        skip();
    }
    return path;
}

double weft_test_random(uint64_t *state)
{
    *state += 0x9e3779b97f4a7c15u; /* splitmix64, Steele et al. 2014 */
    uint64_t z = *state;
    z = (z ^ z >> 30) * 0xbf58476d1ce4e5b9u;
    z = (z ^ z >> 27) * 0x94d049bb133111ebu;
    z ^= z >> 31;
    return (double)(z >> 11) * 0x1p-53;
}

double weft_test_gauss(uint64_t *state)
{
    const double u = 1 - weft_test_random(state), v = weft_test_random(state);
    return sqrt(-2 * log(u)) * cos(6.283185307179586 * v);
}
