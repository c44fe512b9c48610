#include "host/daemon/library_path.h"

#include "core/file.h"
#include "core/mem.h"
#include "core/text.h"

#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <linux/openat2.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

static weft_err leads_out(const char *name, weft_error *err)
{
    return weft_fail(err, WEFT_ERR_RANGE, "\"%.200s\" leads out of the library; give a name inside it", name);
}

/* Whether a component of the path is ".." or of Weft's own. */
static bool has_forbidden_part(const char *name)
{
    for (const char *p = name; *p;) {
        const size_t n = strcspn(p, "/");
        if ((n == 2 && memcmp(p, "..", 2) == 0) || (n >= 5 && memcmp(p, ".weft", 5) == 0))
            return true;
        p += n + (p[n] == '/');
    }
    return false;
}

static weft_err check_name(const char *name, weft_error *err)
{
    const size_t n = strlen(name);
    if (n == 0 || n >= PATH_MAX - 1)
        return weft_fail(err, WEFT_ERR_USAGE, "a name has 1 to %d bytes, not %zu", PATH_MAX - 2, n);
    if (!weft_text_is_utf8(name, n))
        return weft_fail(err, WEFT_ERR_USAGE, "a name is not UTF-8");
    for (const char *p = name; *p; p++)
        if ((unsigned char)*p < 0x20 || *p == 0x7f)
            return weft_fail(err, WEFT_ERR_USAGE, "a name contains a control character");
    return WEFT_OK;
}

static bool is_inside(const char *root, const char *path)
{
    const size_t n = strlen(root);
    return strcmp(root, "/") == 0 || (strncmp(root, path, n) == 0 && (path[n] == '/' || path[n] == '\0'));
}

/* Where the part of the path that is there really lies; a link must not lead out. */
static bool really_inside(const char *root, const char *path)
{
    char part[PATH_MAX], real[PATH_MAX];
    const size_t n = strlen(path);
    if (n >= sizeof part)
        return false;
    memcpy(part, path, n + 1);
    while (!realpath(part, real)) {
        struct stat s;
        if (lstat(part, &s) == 0)
            return false; /* a link that leads nowhere yet */
        char *const slash = strrchr(part, '/');
        if (!slash || slash == part)
            return false;
        *slash = '\0';
    }
    return is_inside(root, real);
}

weft_err weft_library_path(const char *root, bool anywhere, const char *name, char **path, weft_error *err)
{
    WEFT_TRY(check_name(name, err));
    if (name[0] == '/' && anywhere) {
        *path = weft_strdup(name, err);
        return *path ? WEFT_OK : WEFT_ERR_NOMEM;
    }
    const char *const inside = name[0] != '/' ? name : is_inside(root, name) ? name + strlen(root) : NULL;
    if (!inside || has_forbidden_part(inside))
        return leads_out(name, err);
    char *const joined = weft_path_join(root, name, err);
    if (!joined)
        return WEFT_ERR_NOMEM;
    size_t n = strlen(joined);
    while (n > 1 && joined[n - 1] == '/')
        joined[--n] = '\0';
    if (!anywhere && !really_inside(root, joined)) {
        weft_free(joined);
        return leads_out(name, err);
    }
    *path = joined;
    return WEFT_OK;
}

weft_err weft_library_open_file(const char *root, const char *name, int *fd, weft_error *err)
{
    struct open_how how = {.flags = O_RDONLY | O_CLOEXEC | O_NONBLOCK,
                           .resolve = RESOLVE_BENEATH | RESOLVE_NO_MAGICLINKS};
    struct stat s;
    WEFT_TRY(check_name(name, err));
    if (name[0] == '/' || has_forbidden_part(name))
        return leads_out(name, err);
    const int folder = open(root, O_PATH | O_DIRECTORY | O_CLOEXEC);
    const int file = folder < 0 ? -1 : (int)syscall(SYS_openat2, folder, name, &how, sizeof how);
    const int reason = errno;
    if (folder >= 0)
        close(folder);
    if (file < 0 && reason == EXDEV)
        return leads_out(name, err);
    if (file < 0)
        return weft_fail(err, WEFT_ERR_MISSING, "the library has no file \"%.200s\": %s", name,
                         strerror(reason));
    if (fstat(file, &s) != 0 || !S_ISREG(s.st_mode)) {
        close(file);
        return weft_fail(err, WEFT_ERR_MISSING, "\"%.200s\" is no file", name);
    }
    *fd = file;
    return WEFT_OK;
}
