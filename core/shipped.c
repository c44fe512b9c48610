#include "core/shipped.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

weft_err weft_program_path(char path[PATH_MAX], weft_error *err)
{
    const ssize_t n = readlink("/proc/self/exe", path, PATH_MAX - 1);
    if (n <= 0)
        return weft_fail_errno(err, WEFT_ERR_IO, "/proc/self/exe cannot be read; is /proc mounted?");
    path[n] = '\0';
    return WEFT_OK;
}

weft_err weft_shipped_find(const char *name, const char *const *places, char path[PATH_MAX], weft_error *err)
{
    char folder[PATH_MAX], looked[2 * PATH_MAX] = "";
    WEFT_TRY(weft_program_path(folder, err));
    *strrchr(folder, '/') = '\0';
    for (; *places; places++) {
        snprintf(looked, sizeof looked, "%s/%s/%s", folder, *places, name);
        if (realpath(looked, path))
            return WEFT_OK;
    }
    return weft_fail(err, WEFT_ERR_MISSING, "%s: is not there; build or install Weft whole", looked);
}

weft_err weft_shipped_path(const char *name, char path[PATH_MAX], weft_error *err)
{
    static const char *const places[] = {"../share/weft", NULL};
    return weft_shipped_find(name, places, path, err);
}
