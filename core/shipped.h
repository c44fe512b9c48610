/** Files that come with the programs: ../share/weft beside the folder of the running program. */
#ifndef WEFT_CORE_SHIPPED_H
#define WEFT_CORE_SHIPPED_H

#include "core/error.h"

/** The path of share/weft/NAME, built or installed; free with weft_free().
 *  @return WEFT_ERR_MISSING with the place that was looked at */
weft_err weft_shipped_path(const char *name, char **path, weft_error *err);

#endif
