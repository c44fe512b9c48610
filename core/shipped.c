#include "core/shipped.h"

#include "core/file.h"
#include "core/mem.h"

#include <limits.h>
#include <string.h>
#include <unistd.h>

weft_err weft_shipped_path(const char *name, char **path, weft_error *err)
{
    char self[PATH_MAX];
    const ssize_t n = readlink("/proc/self/exe", self, sizeof self - 1);
    if (n <= 0)
        return weft_fail_errno(err, WEFT_ERR_IO, "/proc/self/exe cannot be read");
    self[n] = '\0';
    const int folder = (int)(strrchr(self, '/') - self);
    char *const found = weft_asprintf(err, "%.*s/../share/weft/%s", folder, self, name);
    if (!found)
        return WEFT_ERR_NOMEM;
    if (weft_file_exists(found) || weft_folder_exists(found)) {
        *path = found;
        return WEFT_OK;
    }
    weft_fail(err, WEFT_ERR_MISSING, "%s: is not there; build or install Weft whole", found);
    weft_free(found);
    return WEFT_ERR_MISSING;
}
