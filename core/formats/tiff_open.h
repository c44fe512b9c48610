/** libtiff with its messages in our hands: inside core/formats only. */
#ifndef WEFT_CORE_FORMATS_TIFF_OPEN_H
#define WEFT_CORE_FORMATS_TIFF_OPEN_H

#include "core/error.h"

#include <stdbool.h>
#include <tiffio.h>

/** What libtiff said about one file.  Must outlive the TIFF*. */
typedef struct weft_tiff_log {
    const char *path; /* as the user knows it */
    bool failed;      /* libtiff called it an error */
    char text[256];   /* the first error; empty when none */
} weft_tiff_log;

/**
 * TIFFOpen with errors going to `log` and warnings to weft_explain(), nothing to stderr.
 *
 * @param file  what is opened: log->path, or the temporary file that will get that name
 * @param mode  "r" (never memory-mapped: a file cut while it is read must not kill us) or "w"
 * @return      WEFT_ERR_IO or WEFT_ERR_FORMAT naming log->path
 */
weft_err weft_tiff_open(TIFF **tiff, const char *file, const char *mode, weft_tiff_log *log, weft_error *err);

/** WEFT_ERR_FORMAT with the first words of libtiff behind "is a damaged TIFF". */
weft_err weft_tiff_damaged(const weft_tiff_log *log, weft_error *err);

/** Closes a file that was written.  @return WEFT_ERR_IO when libtiff found fault at any time since it was
 *  opened: TIFFClose itself cannot say that the disk is full. */
weft_err weft_tiff_close_written(TIFF *tiff, const weft_tiff_log *log, weft_error *err);

#endif
