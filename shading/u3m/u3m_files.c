#include "shading/u3m/u3m_files.h"

#include "core/file.h"
#include "core/formats/zip_read.h"
#include "core/log.h"
#include "core/mem.h"

#include <ctype.h>
#include <string.h>
#include <strings.h>

enum { MAX_DOCUMENT_BYTES = 64 << 20, MAX_FOLDER_FILES = 4096 };

struct weft_u3m_files {
    char *path, *folder; /* the folder only without an archive */
    weft_zip *zip;
    char **names; /* [n], without an archive; the document first */
    int n, document;
};

/* -- paths -------------------------------------------------------------------------------------------- */

/* CON, NUL, COM1 ... with or without an ending are devices on Windows. */
static bool is_reserved(const char *part, size_t n)
{
    static const char *const names[] = {"con",  "prn",  "aux",  "nul",  "clock$", "com1", "com2", "com3",
                                        "com4", "com5", "com6", "com7", "com8",   "com9", "lpt1", "lpt2",
                                        "lpt3", "lpt4", "lpt5", "lpt6", "lpt7",   "lpt8", "lpt9"};
    const char *const dot = memchr(part, '.', n);
    const size_t stem = dot ? (size_t)(dot - part) : n;
    for (size_t i = 0; i < sizeof names / sizeof names[0]; i++)
        if (strlen(names[i]) == stem && strncasecmp(names[i], part, stem) == 0)
            return true;
    return false;
}

bool weft_u3m_path_is_allowed(const char *path)
{
    if (!weft_zip_name_is_safe(path) || path[strlen(path) - 1] == '/')
        return false;
    for (const char *part = path; *part;) {
        const size_t n = strcspn(part, "/");
        if (is_reserved(part, n) || n > 255 || part[n - 1] == '.' || part[n - 1] == ' ' ||
            memchr(part, '%', n) || memchr(part, '$', n) || (n == 1 && *part == '~'))
            return false;
        part += n + (part[n] == '/');
    }
    return true;
}

/* -- a folder ----------------------------------------------------------------------------------------- */

static weft_err add_name(weft_u3m_files *f, const char *name, weft_error *err)
{
    for (int i = 0; i < f->n; i++)
        if (strcmp(f->names[i], name) == 0)
            return WEFT_OK;
    if (f->n >= MAX_FOLDER_FILES)
        return weft_fail(err, WEFT_ERR_RANGE, "%s: names more than %d files", f->path, MAX_FOLDER_FILES);
    char **const names = weft_realloc(f->names, (size_t)f->n + 1, sizeof *names, err);
    if (!names)
        return WEFT_ERR_NOMEM;
    f->names = names;
    f->names[f->n] = weft_strdup(name, err);
    return f->names[f->n] ? (f->n++, WEFT_OK) : WEFT_ERR_NOMEM;
}

/* Every text that is the path of a file that is there: also in sections that are not ours to understand. */
static weft_err add_named_files(weft_u3m_files *f, const json_t *node, weft_error *err)
{
    const char *const text = json_string_value(node), *key;
    json_t *member;
    size_t i;
    weft_err status = WEFT_OK;
    if (text && weft_u3m_path_is_allowed(text)) {
        char *const path = weft_path_join(f->folder, text, err);
        if (!path)
            return WEFT_ERR_NOMEM;
        if (weft_file_exists(path))
            status = add_name(f, text, err);
        weft_free(path);
    }
    json_array_foreach(node, i, member) if (status == WEFT_OK) status = add_named_files(f, member, err);
    json_object_foreach((json_t *)(uintptr_t)node, key, member) if (status == WEFT_OK) status =
        add_named_files(f, member, err);
    return status;
}

/* -- an archive --------------------------------------------------------------------------------------- */

static weft_err open_archive(weft_u3m_files *f, weft_error *err)
{
    WEFT_TRY(weft_zip_open(f->path, WEFT_U3M_LIMIT_BYTES, &f->zip, err));
    int found = 0;
    for (int i = 0; i < weft_zip_count(f->zip); i++)
        if (weft_path_has_suffix(weft_zip_name(f->zip, i), ".u3m")) {
            f->document = i;
            found++;
        }
    if (found != 1)
        return weft_fail(err, WEFT_ERR_MISSING, "%s: an archive of a material has one .u3m, this has %d",
                         f->path, found);
    for (int i = 0; i < weft_zip_count(f->zip); i++) { /* damage shows now, not when half is written */
        char *bytes;
        size_t n;
        WEFT_TRY(weft_zip_unpack(f->zip, i, &bytes, &n, err));
        weft_free(bytes);
    }
    if (weft_zip_remark(f->zip))
        weft_warn("%s: is not a strict U3MA: %s; read all the same", f->path, weft_zip_remark(f->zip));
    return WEFT_OK;
}

/* -- both --------------------------------------------------------------------------------------------- */

static weft_err parse_document(weft_u3m_files *f, json_t **document, weft_error *err)
{
    char *text;
    size_t n;
    json_error_t why;
    WEFT_TRY(weft_u3m_files_read(f, f->document, &text, &n, err));
    *document = n <= MAX_DOCUMENT_BYTES ? json_loadb(text, n, JSON_REJECT_DUPLICATES, &why) : NULL;
    weft_err status = WEFT_OK;
    if (n > MAX_DOCUMENT_BYTES)
        status = weft_fail(err, WEFT_ERR_RANGE, "%s: its document is larger than 64 MiB", f->path);
    else if (!*document)
        status =
            weft_fail(err, WEFT_ERR_FORMAT, "%s: line %d: %s; is it a U3M?", f->path, why.line, why.text);
    else if (!json_is_object(*document))
        status = weft_fail(err, WEFT_ERR_FORMAT, "%s: holds no JSON object; is it a U3M?", f->path);
    if (status != WEFT_OK) {
        json_decref(*document);
        *document = NULL;
    }
    weft_free(text);
    return status;
}

weft_err weft_u3m_files_open(const char *path, weft_u3m_files **files, json_t **document, weft_error *err)
{
    weft_u3m_files *const f = weft_alloc(1, sizeof *f, err);
    *document = NULL;
    if (!f)
        return WEFT_ERR_NOMEM;
    f->path = weft_strdup(path, err);
    const bool is_archive = weft_path_has_suffix(path, ".u3ma");
    f->folder = is_archive ? NULL : weft_path_folder(path, err);
    weft_err status = f->path && (is_archive || f->folder) ? WEFT_OK : WEFT_ERR_NOMEM;
    if (status == WEFT_OK)
        status = is_archive ? open_archive(f, err) : add_name(f, weft_path_name(path), err);
    if (status == WEFT_OK)
        status = parse_document(f, document, err);
    if (status == WEFT_OK && !is_archive) {
        status = add_named_files(f, *document, err);
        if (status != WEFT_OK) {
            json_decref(*document);
            *document = NULL;
        }
    }
    if (status != WEFT_OK) {
        weft_u3m_files_close(f);
        return status;
    }
    *files = f;
    return WEFT_OK;
}

void weft_u3m_files_close(weft_u3m_files *files)
{
    if (!files)
        return;
    for (int i = 0; i < files->n; i++)
        weft_free(files->names[i]);
    weft_free(files->names);
    weft_zip_close(files->zip);
    weft_free(files->folder);
    weft_free(files->path);
    weft_free(files);
}

int weft_u3m_files_count(const weft_u3m_files *files)
{
    return files->zip ? weft_zip_count(files->zip) : files->n;
}

const char *weft_u3m_files_name(const weft_u3m_files *files, int index)
{
    return files->zip ? weft_zip_name(files->zip, index) : files->names[index];
}

const char *weft_u3m_files_document(const weft_u3m_files *files)
{
    return weft_u3m_files_name(files, files->document);
}

weft_err weft_u3m_files_read(const weft_u3m_files *files, int index, char **bytes, size_t *n, weft_error *err)
{
    if (files->zip)
        return weft_zip_unpack(files->zip, index, bytes, n, err);
    char *const path = weft_path_join(files->folder, files->names[index], err);
    const weft_err status = path ? weft_file_read(path, WEFT_U3M_LIMIT_BYTES, bytes, n, err) : WEFT_ERR_NOMEM;
    weft_free(path);
    return status;
}

/* Paths are relative to the document, which may lie in a folder of the archive. */
int weft_u3m_files_find(const weft_u3m_files *files, const char *path_in_document)
{
    if (!weft_u3m_path_is_allowed(path_in_document))
        return -1;
    const char *const document = weft_u3m_files_document(files);
    const size_t prefix = (size_t)(weft_path_name(document) - document);
    for (int i = 0; i < weft_u3m_files_count(files); i++) {
        const char *const name = weft_u3m_files_name(files, i);
        if (strncmp(name, document, prefix) == 0 && strcmp(name + prefix, path_in_document) == 0)
            return i;
    }
    return -1;
}
