#include "core/formats/tiff_open.h"

#include "core/log.h"

#include <stdio.h>

static int on_error(TIFF *tiff, void *user, const char *module, const char *format, va_list args)
{
    weft_tiff_log *const log = user;
    (void)tiff, (void)module;
    if (!log->failed)
        vsnprintf(log->text, sizeof log->text, format, args);
    log->failed = true;
    return 1;
}

static int on_warning(TIFF *tiff, void *user, const char *module, const char *format, va_list args)
{
    const weft_tiff_log *const log = user;
    char text[256];
    (void)tiff, (void)module;
    vsnprintf(text, sizeof text, format, args);
    weft_explain("%s: %s", log->path, text);
    return 1;
}

weft_err weft_tiff_open(TIFF **tiff, const char *file, const char *mode, weft_tiff_log *log, weft_error *err)
{
    TIFFOpenOptions *const options = TIFFOpenOptionsAlloc();
    if (!options)
        return weft_fail(err, WEFT_ERR_NOMEM, "%s: no memory for libtiff", log->path);
    TIFFOpenOptionsSetErrorHandlerExtR(options, on_error, log);
    TIFFOpenOptionsSetWarningHandlerExtR(options, on_warning, log);
    const bool reading = mode[0] == 'r';
    *tiff = TIFFOpenExt(file, reading ? "rm" : "wl", options);
    TIFFOpenOptionsFree(options);
    if (*tiff)
        return WEFT_OK;
    return reading ? weft_tiff_damaged(log, err)
                   : weft_fail(err, WEFT_ERR_IO, "%s: cannot be written: %s; is the disk full?", log->path,
                               log->text);
}

weft_err weft_tiff_damaged(const weft_tiff_log *log, weft_error *err)
{
    return weft_fail(err, WEFT_ERR_FORMAT, "%s: is a damaged TIFF%s%s", log->path, log->text[0] ? ": " : "",
                     log->text);
}

weft_err weft_tiff_close_written(TIFF *tiff, const weft_tiff_log *log, weft_error *err)
{
    TIFFClose(tiff);
    if (!log->failed)
        return WEFT_OK;
    return weft_fail(err, WEFT_ERR_IO, "%s: cannot be written: %s; is the disk full?", log->path, log->text);
}
