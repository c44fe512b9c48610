/** OpenEXRCore with its messages in our hands: inside core/formats only. */
#ifndef WEFT_CORE_FORMATS_EXR_WORDS_H
#define WEFT_CORE_FORMATS_EXR_WORDS_H

#include "core/error.h"

#include <OpenEXR/openexr.h>
#include <stdatomic.h>

/** The first failure of a file whose chunks are done on several threads; `{0}` is none. */
typedef struct weft_exr_failure {
    atomic_int code; /* exr_result_t */
    char text[256];  /* what the library said to it */
} weft_exr_failure;

/** How to open a file: messages kept instead of printed, our limits of size, no repair of cut files.
 *  Forgets what this thread was told before. */
exr_context_initializer_t weft_exr_initializer(void);

/** Keeps `code` with the library's words on this thread, if it is a failure and the first.  Any thread. */
void weft_exr_note(weft_exr_failure *failure, exr_result_t code);

/** The words of a noted failure, or the library's general ones. */
const char *weft_exr_words(const weft_exr_failure *failure);

#endif
