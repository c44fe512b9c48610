#include "core/formats/exr_words.h"

#include "core/image.h"

#include <stdio.h>

/* The library calls back on the thread that failed.  While a file is written it does so with the context
 * locked, so that even exr_get_user_data() would wait for ever: the words cannot go through the context. */
static _Thread_local char last_words[256];

static void on_error(exr_const_context_t context, exr_result_t code, const char *text)
{
    (void)context, (void)code;
    snprintf(last_words, sizeof last_words, "%s", text);
}

exr_context_initializer_t weft_exr_initializer(void)
{
    exr_context_initializer_t init = EXR_DEFAULT_CONTEXT_INITIALIZER;
    last_words[0] = '\0';
    init.error_handler_fn = on_error;
    init.max_image_width = init.max_image_height = WEFT_IMAGE_MAX_SIDE;
    init.max_tile_width = init.max_tile_height = WEFT_IMAGE_MAX_SIDE;
    init.flags = EXR_CONTEXT_FLAG_DISABLE_CHUNK_RECONSTRUCTION; /* a cut file is an error */
    return init;
}

void weft_exr_note(weft_exr_failure *failure, exr_result_t code)
{
    int none = EXR_ERR_SUCCESS;
    if (code != EXR_ERR_SUCCESS && atomic_compare_exchange_strong(&failure->code, &none, code))
        snprintf(failure->text, sizeof failure->text, "%s", last_words);
    last_words[0] = '\0';
}

const char *weft_exr_words(const weft_exr_failure *failure)
{
    return failure->text[0] ? failure->text : exr_get_default_error_message(failure->code);
}
