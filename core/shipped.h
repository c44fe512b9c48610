/**
 * What comes with the programs, found from the folder of the running one: the same words find it in a build
 * tree and after `cmake --install` under any prefix.
 */
#ifndef WEFT_CORE_SHIPPED_H
#define WEFT_CORE_SHIPPED_H

#include "core/error.h"

#include <limits.h>

/** The path of the running program.  @return WEFT_ERR_IO where /proc is not there */
weft_err weft_program_path(char path[PATH_MAX], weft_error *err);

/** The path of `name` in the first of `places` that has it, without links and "..".
 *  @param places  folders seen from that of the running program ("../share/weft"), NULL behind the last
 *  @return WEFT_ERR_MISSING with the last place, which is where an installed one would be */
weft_err weft_shipped_find(const char *name, const char *const *places, char path[PATH_MAX], weft_error *err);

/** The path of share/weft/NAME, built or installed.  @return WEFT_ERR_MISSING with the place */
weft_err weft_shipped_path(const char *name, char path[PATH_MAX], weft_error *err);

#endif
