/**
 * Ways to carry a baked material into other programs: a struct of functions each, in one array (exporters.c).
 *
 * An exporter reads a material with all its maps, as it is on disk, and writes files into a folder of its
 * own; what the format cannot carry it says by name.  The same material gives the same bytes.
 */
#ifndef WEFT_SHADING_EXPORT_EXPORTER_H
#define WEFT_SHADING_EXPORT_EXPORTER_H

#include "shading/bake/baked.h"

typedef struct weft_export_job {
    const weft_baked *baked;
    const char *folder; /* exists and is empty: the caller publishes it whole */
    json_t *lost;       /* array: a sentence for each thing that the format cannot carry */
    bool has_layers;    /* layers/layers.json will lie beside (export_layers.h); may be pointed at */
} weft_export_job;

typedef struct weft_exporter {
    const char *name;    /* "gltf": what the user types, and the folder's name */
    const char *summary; /* one line, lower case, no full stop */
    int version;         /* raised when the files change: they are then written anew */
    weft_err (*write)(const weft_export_job *job, weft_error *err);
} weft_exporter;

/** All exporters, in the order of the documents; ends with NULL. */
extern const weft_exporter *const weft_exporters[];

/** The exporter of a name.  @return WEFT_ERR_USAGE that lists the names there are */
weft_err weft_exporter_find(const char *name, const weft_exporter **exporter, weft_error *err);

/** Adds a sentence to job->lost. */
void weft_export_lose(const weft_export_job *job, const char *format, ...) WEFT_PRINTF(2, 3);

/** job->folder/NAME on the heap. */
char *weft_export_path(const weft_export_job *job, const char *name, weft_error *err);

#endif
