#include "core/file.h"

#include "core/mem.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <inttypes.h>
#include <limits.h>
#include <stdatomic.h>
#include <stdio.h>
#include <string.h>
#include <strings.h>
#include <sys/stat.h>
#include <sys/statvfs.h>
#include <time.h>
#include <unistd.h>

char *weft_path_join(const char *folder, const char *name, weft_error *err)
{
    if (!folder || !*folder || *name == '/')
        return weft_strdup(name, err);
    const size_t n = strlen(folder);
    return weft_asprintf(err, "%s%s%s", folder, folder[n - 1] == '/' ? "" : "/", name);
}

char *weft_path_folder(const char *path, weft_error *err)
{
    const char *const slash = strrchr(path, '/');
    if (!slash)
        return weft_strdup(".", err);
    const int n = slash == path ? 1 : (int)(slash - path);
    return weft_asprintf(err, "%.*s", n, path);
}

const char *weft_path_name(const char *path)
{
    const char *const slash = strrchr(path, '/');
    return slash ? slash + 1 : path;
}

bool weft_path_has_suffix(const char *path, const char *suffix)
{
    const size_t n = strlen(path), m = strlen(suffix);
    return n >= m && strcasecmp(path + n - m, suffix) == 0;
}

void weft_time_now_iso(char text[32])
{
    const time_t now = time(NULL);
    struct tm utc;
    gmtime_r(&now, &utc);
    strftime(text, 32, "%Y-%m-%dT%H:%M:%SZ", &utc);
}

bool weft_file_exists(const char *path)
{
    struct stat s;
    return stat(path, &s) == 0;
}

bool weft_folder_exists(const char *path)
{
    struct stat s;
    return stat(path, &s) == 0 && S_ISDIR(s.st_mode);
}

/* Opens a regular file for reading; a folder, pipe or device is an error, and does not hold us up. */
static weft_err open_regular(const char *path, int *fd, uint64_t *bytes, weft_error *err)
{
    struct stat s;
    const int opened = open(path, O_RDONLY | O_NONBLOCK | O_CLOEXEC);
    if (opened < 0)
        return weft_fail_errno(err, WEFT_ERR_IO, "%s: cannot be opened", path);
    weft_err status = WEFT_OK;
    if (fstat(opened, &s) != 0)
        status = weft_fail_errno(err, WEFT_ERR_IO, "%s: cannot be looked at", path);
    else if (!S_ISREG(s.st_mode))
        status = weft_fail(err, WEFT_ERR_IO, "%s: is a %s, not a file", path,
                           S_ISDIR(s.st_mode) ? "folder" : "device or pipe");
    if (status != WEFT_OK) {
        close(opened);
        return status;
    }
    *fd = opened;
    *bytes = (uint64_t)s.st_size;
    return WEFT_OK;
}

weft_err weft_file_size(const char *path, uint64_t *bytes, weft_error *err)
{
    int fd;
    WEFT_TRY(open_regular(path, &fd, bytes, err));
    close(fd);
    return WEFT_OK;
}

weft_err weft_folder_create(const char *path, weft_error *err)
{
    char *const partial = weft_strdup(path, err);
    if (!partial)
        return WEFT_ERR_NOMEM;
    weft_err status = WEFT_OK;
    for (char *p = partial + 1; status == WEFT_OK; p++) {
        if (*p != '/' && *p != '\0')
            continue;
        const char was = *p;
        *p = '\0';
        if (mkdir(partial, 0777) != 0 && errno != EEXIST)
            status = weft_fail_errno(err, WEFT_ERR_IO, "%s: the folder cannot be created", partial);
        *p = was;
        if (was == '\0')
            break;
    }
    weft_free(partial);
    if (status == WEFT_OK && !weft_folder_exists(path))
        status = weft_fail(err, WEFT_ERR_IO, "%s: is there and is not a folder; give another name", path);
    return status;
}

weft_err weft_folder_remove(const char *path, weft_error *err)
{
    DIR *const folder = opendir(path);
    if (!folder)
        return errno == ENOENT ? WEFT_OK
                               : weft_fail_errno(err, WEFT_ERR_IO, "%s: the folder cannot be read", path);
    weft_err status = WEFT_OK;
    const struct dirent *entry;
    while (status == WEFT_OK && (entry = readdir(folder)) != NULL) {
        if (strcmp(entry->d_name, ".") == 0 || strcmp(entry->d_name, "..") == 0)
            continue;
        char *const inside = weft_path_join(path, entry->d_name, err);
        struct stat s;
        if (!inside)
            status = WEFT_ERR_NOMEM;
        else if (lstat(inside, &s) == 0 && S_ISDIR(s.st_mode))
            status = weft_folder_remove(inside, err);
        else if (unlink(inside) != 0 && errno != ENOENT)
            status = weft_fail_errno(err, WEFT_ERR_IO, "%s: cannot be removed", inside);
        weft_free(inside);
    }
    closedir(folder);
    if (status == WEFT_OK && rmdir(path) != 0)
        status = weft_fail_errno(err, WEFT_ERR_IO, "%s: cannot be removed", path);
    return status;
}

weft_err weft_disk_free(const char *path, uint64_t *bytes, weft_error *err)
{
    char *at = weft_strdup(path, err);
    struct statvfs s;
    weft_err status = at ? WEFT_OK : WEFT_ERR_NOMEM;
    while (at && statvfs(at, &s) != 0) {
        if (errno != ENOENT || strcmp(at, ".") == 0 || strcmp(at, "/") == 0) {
            status = weft_fail_errno(err, WEFT_ERR_IO, "%s: the file system cannot be asked", path);
            break;
        }
        char *const parent = weft_path_folder(at, err);
        weft_free(at);
        at = parent;
        status = at ? WEFT_OK : WEFT_ERR_NOMEM;
    }
    weft_free(at);
    if (status == WEFT_OK)
        *bytes = (uint64_t)s.f_bavail * s.f_frsize;
    return status;
}

weft_err weft_file_refuse_existing(const char *path, bool force, weft_error *err)
{
    if (!force && weft_file_exists(path))
        return weft_fail(err, WEFT_ERR_EXISTS,
                         "%s: is there already; give --force to replace it, or another name", path);
    return WEFT_OK;
}

weft_err weft_file_require_parent(const char *path, weft_error *err)
{
    char *const parent = weft_path_folder(path, err);
    if (!parent)
        return WEFT_ERR_NOMEM;
    const weft_err status =
        weft_folder_exists(parent)
            ? WEFT_OK
            : weft_fail(err, WEFT_ERR_IO, "%s cannot be made: there is no folder %s", path, parent);
    weft_free(parent);
    return status;
}

/* A name beside `path` that no other process or thread has: ".weft-NAME-PID-N". */
static weft_err make_names(weft_atomic *a, const char *path, weft_error *err)
{
    static atomic_uint counter;
    char *const folder = weft_path_folder(path, err);
    char *final_path = weft_strdup(path, err), *temp = NULL;
    size_t n = strlen(path);
    while (final_path && n > 1 && final_path[n - 1] == '/')
        final_path[--n] = '\0'; /* "out/" is the folder "out" */
    if (folder && final_path) {
        char *const parent = weft_path_folder(final_path, err);
        if (parent)
            temp = weft_asprintf(err, "%s/.weft-%s-%ld-%u", parent, weft_path_name(final_path),
                                 (long)getpid(), atomic_fetch_add(&counter, 1));
        weft_free(parent);
    }
    weft_free(folder);
    if (!temp) {
        weft_free(final_path);
        return WEFT_ERR_NOMEM;
    }
    *a = (weft_atomic){final_path, temp};
    return WEFT_OK;
}

static void forget(weft_atomic *a)
{
    weft_free(a->final_path);
    weft_free(a->temp_path);
    *a = (weft_atomic){0};
}

weft_err weft_atomic_file_begin(weft_atomic *a, const char *path, weft_error *err)
{
    weft_atomic begun;
    struct stat s;
    if (stat(path, &s) == 0 && !S_ISREG(s.st_mode)) /* root would put a file in the place of /dev/null */
        return weft_fail(err, WEFT_ERR_IO, "%s: is a %s; give the name of a file", path,
                         S_ISDIR(s.st_mode) ? "folder" : "device or pipe");
    WEFT_TRY(make_names(&begun, path, err));
    const int fd = open(begun.temp_path, O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
    if (fd < 0) {
        weft_fail_errno(err, WEFT_ERR_IO, "%s: cannot be written; check that its folder is there and yours",
                        path);
        forget(&begun);
        return WEFT_ERR_IO;
    }
    close(fd);
    *a = begun;
    return WEFT_OK;
}

weft_err weft_atomic_folder_begin(weft_atomic *a, const char *path, bool force, weft_error *err)
{
    weft_atomic begun;
    WEFT_TRY(weft_file_refuse_existing(path, force, err));
    WEFT_TRY(make_names(&begun, path, err));
    weft_err status = weft_folder_remove(begun.temp_path, err);
    if (status != WEFT_OK)
        weft_prefix(err, status, "%s", path);
    else if (mkdir(begun.temp_path, 0777) != 0)
        status = weft_fail_errno(
            err, WEFT_ERR_IO, "%s: cannot be created; check that its parent folder is there and yours", path);
    if (status != WEFT_OK) {
        forget(&begun);
        return status;
    }
    *a = begun;
    return WEFT_OK;
}

static weft_err sync_path(const char *path, weft_error *err)
{
    const int fd = open(path, O_RDONLY | O_CLOEXEC);
    if (fd < 0)
        return weft_fail_errno(err, WEFT_ERR_IO, "%s: cannot be opened to make it durable", path);
    const int result = fsync(fd);
    const int number = errno;
    close(fd);
    errno = number;
    if (result != 0 && errno != EINVAL && errno != EROFS) /* some file systems cannot sync a folder */
        return weft_fail_errno(err, WEFT_ERR_IO, "%s: cannot be made durable; is the disk full?", path);
    return WEFT_OK;
}

/* For file systems that cannot exchange two names: a moment without the old folder and without the new one.
 */
static weft_err step_aside(const weft_atomic *a, weft_error *err)
{
    char *const aside = weft_asprintf(err, "%s-old", a->temp_path);
    if (!aside)
        return WEFT_ERR_NOMEM;
    weft_err status = WEFT_OK;
    if (rename(a->final_path, aside) != 0)
        status = weft_fail_errno(err, WEFT_ERR_IO, "%s: cannot be replaced", a->final_path);
    else if (rename(a->temp_path, a->final_path) == 0)
        (void)rename(aside, a->temp_path);
    else {
        status = weft_fail_errno(err, WEFT_ERR_IO, "%s: cannot be put in place", a->final_path);
        if (rename(aside, a->final_path) != 0)
            status = weft_fail_errno(err, WEFT_ERR_IO, "%s: cannot be put back; it is in %s", a->final_path,
                                     aside);
    }
    weft_free(aside);
    return status;
}

/* Puts the new in the old one's place.  rename(2) does it for a file, not for a folder with something in it:
 * the two change places, and what was replaced has the temporary's name. */
static weft_err rename_over(const weft_atomic *a, weft_error *err)
{
    if (rename(a->temp_path, a->final_path) == 0)
        return WEFT_OK;
    if ((errno != ENOTEMPTY && errno != EEXIST) || !weft_folder_exists(a->final_path))
        return weft_fail_errno(err, WEFT_ERR_IO, "%s: cannot be put in place", a->final_path);
    if (renameat2(AT_FDCWD, a->temp_path, AT_FDCWD, a->final_path, RENAME_EXCHANGE) == 0)
        return WEFT_OK;
    return step_aside(a, err);
}

static void remove_temporary(const weft_atomic *a)
{
    if (weft_folder_exists(a->temp_path))
        weft_folder_remove(a->temp_path, NULL);
    else
        unlink(a->temp_path);
}

weft_err weft_atomic_commit(weft_atomic *a, weft_error *err)
{
    char *const parent = weft_path_folder(a->final_path, err);
    weft_err status = parent ? sync_path(a->temp_path, err) : WEFT_ERR_NOMEM;
    if (status == WEFT_OK)
        status = rename_over(a, err);
    if (status == WEFT_OK)
        status = sync_path(parent, err);
    remove_temporary(a); /* what could not be put in place, or was replaced */
    weft_free(parent);
    forget(a);
    return status;
}

void weft_atomic_abort(weft_atomic *a)
{
    if (a->temp_path)
        remove_temporary(a);
    forget(a);
}

weft_err weft_file_write(const char *path, const void *bytes, size_t n, weft_error *err)
{
    weft_atomic a;
    WEFT_TRY(weft_atomic_file_begin(&a, path, err));
    FILE *const file = fopen(a.temp_path, "wbe");
    size_t written = 0;
    int closed = EOF;
    if (file) {
        written = fwrite(bytes, 1, n, file);
        closed = fclose(file);
    }
    if (!file || written != n || closed != 0) {
        weft_fail_errno(err, WEFT_ERR_IO, "%s: cannot be written; is the disk full?", path);
        weft_atomic_abort(&a);
        return WEFT_ERR_IO;
    }
    return weft_atomic_commit(&a, err);
}

/* Up to `n` bytes, fewer at the file's end; -1 with errno. */
static ssize_t read_all(int fd, char *bytes, size_t n)
{
    size_t done = 0;
    while (done < n) {
        const ssize_t more = read(fd, bytes + done, n - done);
        if (more < 0 && errno == EINTR)
            continue;
        if (more < 0)
            return -1;
        if (more == 0)
            break;
        done += (size_t)more;
    }
    return (ssize_t)done;
}

weft_err weft_file_read(const char *path, size_t limit, char **bytes, size_t *n, weft_error *err)
{
    uint64_t size;
    int fd;
    WEFT_TRY(open_regular(path, &fd, &size, err));
    weft_err status = WEFT_OK;
    char *text = NULL;
    ssize_t got = 0;
    if (size > limit)
        status =
            weft_fail(err, WEFT_ERR_FORMAT, "%s: %" PRIu64 " bytes is more than such a file can have (%zu)",
                      path, size, limit);
    else if (!(text = weft_alloc((size_t)size + 1, 1, err)))
        status = WEFT_ERR_NOMEM;
    else if ((got = read_all(fd, text, (size_t)size)) < 0)
        status = weft_fail_errno(err, WEFT_ERR_IO, "%s: cannot be read to its end", path);
    close(fd);
    if (status == WEFT_OK) {
        *bytes = text;
        *n = (size_t)got;
    } else {
        weft_free(text);
    }
    return status;
}
