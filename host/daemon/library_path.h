/**
 * Names that come from clients, and where in the library they lead.
 */
#ifndef WEFT_HOST_DAEMON_LIBRARY_PATH_H
#define WEFT_HOST_DAEMON_LIBRARY_PATH_H

#include "core/error.h"

#include <stdbool.h>

/**
 * The absolute path of a name that a client gave.
 *
 * A relative name is one inside the library.  It must not contain "..", nor lead out by a symbolic link, nor
 * name anything of Weft's own (".weft..."); an absolute one must lie in the library too.
 *
 * @param root      absolute path of the library, without symbolic links
 * @param anywhere  the client is the daemon's own user, who can do to any file what the daemon can: absolute
 *                  names may then lead anywhere
 * @param path      gets it on the heap
 * @return WEFT_ERR_RANGE for a name that leads out, WEFT_ERR_USAGE for one that is none
 */
weft_err weft_library_path(const char *root, bool anywhere, const char *name, char **path, weft_error *err);

/**
 * Opens a file of the library for reading; the kernel itself keeps to the library (openat2, RESOLVE_BENEATH).
 *
 * @param name  relative, as above
 * @param fd    gets the descriptor, of a regular file
 * @return WEFT_ERR_MISSING, WEFT_ERR_RANGE, WEFT_ERR_USAGE
 */
weft_err weft_library_open_file(const char *root, const char *name, int *fd, weft_error *err);

#endif
