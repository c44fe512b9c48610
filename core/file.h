/**
 * Files and folders that are whole or absent.
 *
 * A writer writes to a temporary name in the same folder, commits (fsync, rename, fsync of the folder),
 * or aborts.  A name without the temporary prefix ".weft-" is therefore always a complete result, also
 * after SIGKILL or a full disk.
 */
#ifndef WEFT_CORE_FILE_H
#define WEFT_CORE_FILE_H

#include "core/error.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/** A file or a folder under construction. */
typedef struct weft_atomic {
    char *final_path;
    char *temp_path; /* write here; NULL when none is under way */
} weft_atomic;

/** Begins the file `path`: creates an empty temporary file beside it.  An existing `path` is replaced at
 *  commit (the caller asks first).  @return WEFT_ERR_IO naming the path and what to do, also when it is a
 *  folder, device or pipe. */
weft_err weft_atomic_file_begin(weft_atomic *a, const char *path, weft_error *err);

/** Begins the folder `path`: creates an empty temporary folder beside it.
 *  @param force  whether an existing `path` may be replaced at commit.
 *  @return WEFT_ERR_EXISTS when it is there and `force` is false; WEFT_ERR_IO. */
weft_err weft_atomic_folder_begin(weft_atomic *a, const char *path, bool force, weft_error *err);

/** Makes it durable and gives it its final name, in one step also where there is an older one (on a file
 * system that can exchange two names; NFS has a moment without either).  On failure the temporary is removed.
 */
weft_err weft_atomic_commit(weft_atomic *a, weft_error *err);

/** Removes the temporary, if any.  Harmless on `{0}` and after commit. */
void weft_atomic_abort(weft_atomic *a);

/** Writes `n` bytes as the file `path`, whole or not at all. */
weft_err weft_file_write(const char *path, const void *bytes, size_t n, weft_error *err);

/** Reads a whole regular file of at most `limit` bytes; adds a NUL behind; free with weft_free().
 *  @return WEFT_ERR_FORMAT when it is larger; WEFT_ERR_IO when it is absent, no file, or not readable */
weft_err weft_file_read(const char *path, size_t limit, char **bytes, size_t *n, weft_error *err);

/** Says before any work is done that `path` would be overwritten: WEFT_ERR_EXISTS with the remedy. */
weft_err weft_file_refuse_existing(const char *path, bool force, weft_error *err);

/** Says before any work is done that the folder which `path` shall be in is not there: WEFT_ERR_IO. */
weft_err weft_file_require_parent(const char *path, weft_error *err);

/** Size in bytes of a regular file that can be opened for reading.
 *  @return WEFT_ERR_IO naming the path when it is absent, a folder or device, or not readable. */
weft_err weft_file_size(const char *path, uint64_t *bytes, weft_error *err);

bool weft_file_exists(const char *path);
bool weft_folder_exists(const char *path);
/** Creates the folder and its parents. */
weft_err weft_folder_create(const char *path, weft_error *err);
/** Removes a folder with all in it; absent is fine. */
weft_err weft_folder_remove(const char *path, weft_error *err);
/** Free bytes of the file system that holds `path` (its nearest existing parent). */
weft_err weft_disk_free(const char *path, uint64_t *bytes, weft_error *err);

/** "folder/name" on the heap; `name` alone when it is absolute or `folder` is NULL or empty. */
char *weft_path_join(const char *folder, const char *name, weft_error *err);
/** The folder part of a path, on the heap; "." when there is none. */
char *weft_path_folder(const char *path, weft_error *err);
/** The part behind the last '/', inside `path`; trailing slashes are not looked through. */
const char *weft_path_name(const char *path);
/** Compares the end of a path, ASCII case ignored: weft_path_has_suffix("A.DNG", ".dng"). */
bool weft_path_has_suffix(const char *path, const char *suffix);

/** "2026-11-23T10:00:00Z" */
void weft_time_now_iso(char text[32]);

#endif
