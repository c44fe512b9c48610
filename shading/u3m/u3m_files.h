/**
 * The files of a U3M material: one .u3ma archive, or a .u3m with its pictures beside it.
 *
 * Names are those of the archive, or relative to the folder of the .u3m.  Whatever an archive holds is
 * listed, also what nothing refers to: who passes a U3M on must not drop it.  Of a folder it is the document
 * and every file in it that a text of the document names.
 */
#ifndef WEFT_SHADING_U3M_U3M_FILES_H
#define WEFT_SHADING_U3M_U3M_FILES_H

#include "core/error.h"

#include <jansson.h>
#include <stdbool.h>
#include <stddef.h>

/** What a U3M may unpack to. */
#define WEFT_U3M_LIMIT_BYTES (2ULL << 30)

typedef struct weft_u3m_files weft_u3m_files;

/**
 * Opens the material and parses its document.
 *
 * @param document  the JSON; json_decref() it
 * @return as weft_zip_open(); WEFT_ERR_MISSING for an archive without exactly one .u3m; WEFT_ERR_FORMAT for a
 *         document that is no JSON object
 */
weft_err weft_u3m_files_open(const char *path, weft_u3m_files **files, json_t **document, weft_error *err);
void weft_u3m_files_close(weft_u3m_files *files);

int weft_u3m_files_count(const weft_u3m_files *files);
const char *weft_u3m_files_name(const weft_u3m_files *files, int index);
/** The name of the document. */
const char *weft_u3m_files_document(const weft_u3m_files *files);

/** Reads a file of the list; free with weft_free(). */
weft_err weft_u3m_files_read(const weft_u3m_files *files, int index, char **bytes, size_t *n,
                             weft_error *err);

/** The file that a path in the document means, or -1. */
int weft_u3m_files_find(const weft_u3m_files *files, const char *path_in_document);

/** Whether a path in a document is one that U3M allows: relative, within its folder, no reserved name of
 * Windows, no variables (u3m_additional_spec.txt, "paths"). */
bool weft_u3m_path_is_allowed(const char *path);

#endif
