#include "core/formats/zip_read.h"

#include "core/file.h"
#include "core/mem.h"
#include "core/text.h"

#include <stdlib.h>
#include <string.h>
#include <zlib.h>

enum {
    LOCAL_MARK = 0x04034b50,
    DIRECTORY_MARK = 0x02014b50,
    END_MARK = 0x06054b50,
    LOCAL_BYTES = 30,
    DIRECTORY_BYTES = 46,
    END_BYTES = 22,
    STORED = 0,
    DEFLATED = 8,
    ENCRYPTED = 1,
    DESCRIPTOR = 8,
    UTF8_NAMES = 1 << 11,
    HARMLESS_FLAGS = 6 | UTF8_NAMES, /* how hard it was packed */
    REPEATED_BYTES = 22,             /* from the flags to the length of the name: the same in both headers */
};

/* Deflate cannot do better than 1032 to 1: who promises more lies. */
#define MAX_DEFLATE_RATIO 1032

typedef struct entry {
    char *name;
    const uint8_t *packed;
    uint32_t crc, n_packed, n;
    uint16_t method;
} entry;

struct weft_zip {
    char *path, *bytes;
    size_t n;
    entry *entries;
    int *sorted; /* [n_entries] by name */
    int n_entries;
    const char *remark;
};

static uint32_t le(const uint8_t *at, int bytes)
{
    uint32_t value = 0;
    for (int i = bytes - 1; i >= 0; i--)
        value = value << 8 | at[i];
    return value;
}

static weft_err damaged(const weft_zip *zip, weft_error *err, const char *what)
{
    return weft_fail(err, WEFT_ERR_FORMAT, "%s: %s; ask for the archive again", zip->path, what);
}

static weft_err refused(const weft_zip *zip, const char *name, weft_error *err, const char *why)
{
    return weft_fail(err, WEFT_ERR_FORMAT, "%s: refused, its entry \"%s\" %s", zip->path, name, why);
}

static void remark(weft_zip *zip, bool harmless_oddity, const char *sentence)
{
    if (harmless_oddity && !zip->remark)
        zip->remark = sentence;
}

bool weft_zip_name_is_safe(const char *name)
{
    if (!weft_text_is_utf8(name, strlen(name)) || *name == '\0')
        return false;
    for (const char *part = name; *part;) {
        const size_t n = strcspn(part, "/");
        if (n == 0 || (n == 1 && part[0] == '.') || (n == 2 && part[0] == '.' && part[1] == '.'))
            return false;
        for (size_t i = 0; i < n; i++)
            if ((unsigned char)part[i] < 0x20 || strchr("<>:\"\\|?*", part[i]))
                return false;
        part += n + (part[n] == '/');
    }
    return true;
}

/* -- the directory ------------------------------------------------------------------------------------ */

/* The record is the last thing in the file: there is no comment to search through. */
static weft_err find_end(const weft_zip *zip, const uint8_t **end, weft_error *err)
{
    if (zip->n < END_BYTES || le((const uint8_t *)zip->bytes, 2) != 0x4b50) /* "PK" */
        return damaged(zip, err, "is no zip archive, or is cut short");
    *end = (const uint8_t *)zip->bytes + zip->n - END_BYTES;
    if (le(*end, 4) != END_MARK || le(*end + 20, 2) != 0)
        return damaged(zip, err, "is cut short, or something follows the archive");
    if (le(*end + 4, 4) != 0 || le(*end + 8, 2) != le(*end + 10, 2))
        return damaged(zip, err, "is one part of a split archive");
    if (le(*end + 10, 2) == 0xffff || le(*end + 12, 4) == 0xffffffff || le(*end + 16, 4) == 0xffffffff)
        return damaged(zip, err, "is a zip64 archive, which U3MA is not");
    if ((uint64_t)le(*end + 12, 4) + le(*end + 16, 4) + END_BYTES != zip->n)
        return damaged(zip, err, "its directory is not where it says");
    return WEFT_OK;
}

static weft_err check_flags(weft_zip *zip, const entry *e, const uint8_t *head, weft_error *err)
{
    const uint32_t flags = le(head + 8, 2);
    if (flags & ENCRYPTED)
        return refused(zip, e->name, err, "is encrypted");
    if (flags & DESCRIPTOR)
        return refused(zip, e->name, err, "has its sizes behind it (a data descriptor)");
    if (flags & ~(uint32_t)HARMLESS_FLAGS)
        return refused(zip, e->name, err, "needs features that U3MA does not have");
    if (e->method != STORED && e->method != DEFLATED)
        return refused(zip, e->name, err, "is packed by another method than deflate");
    remark(zip, !(flags & UTF8_NAMES), "names are not marked as UTF-8");
    remark(zip, le(head + 6, 2) != 20, "another version of zip is asked for than 2.0");
    remark(zip, le(head + 4, 2) >> 8 != 0, "entries are marked as made by another system than FAT");
    remark(zip, le(head + 36, 2) != 0 || le(head + 38, 4) != 0, "entries have file attributes");
    return WEFT_OK;
}

static weft_err check_sizes(const weft_zip *zip, const entry *e, weft_error *err)
{
    const bool is_folder = e->name[strlen(e->name) - 1] == '/';
    if (is_folder && (e->n > 0 || e->n_packed > 0))
        return refused(zip, e->name, err, "is a folder with contents");
    if (e->method == STORED && e->n != e->n_packed)
        return refused(zip, e->name, err, "is stored with two different sizes");
    if (e->method == DEFLATED && e->n > ((uint64_t)e->n_packed + 1) * MAX_DEFLATE_RATIO)
        return weft_fail(err, WEFT_ERR_RANGE,
                         "%s: refused, its entry \"%s\" promises more than can be packed", zip->path,
                         e->name);
    return WEFT_OK;
}

/* The file entry that a directory entry stands for must be the next one, and say the same. */
static weft_err check_local(weft_zip *zip, entry *e, const uint8_t *head, size_t *offset, size_t start,
                            weft_error *err)
{
    const uint8_t *const local = (const uint8_t *)zip->bytes + *offset;
    const size_t n_name = le(head + 28, 2);
    if (le(head + 42, 4) != *offset)
        return refused(zip, e->name, err, "does not follow the one before it: entries overlap or leave gaps");
    if (start - *offset < LOCAL_BYTES + n_name || le(local, 4) != LOCAL_MARK ||
        memcmp(local + 6, head + 8, REPEATED_BYTES) != 0 ||
        memcmp(local + LOCAL_BYTES, head + DIRECTORY_BYTES, n_name) != 0)
        return refused(zip, e->name, err, "and the directory say different things");
    const size_t n_extra = le(local + 28, 2), body = *offset + LOCAL_BYTES + n_name + n_extra;
    remark(zip, n_extra > 0, "entries have extra fields");
    if (body > start || start - body < e->n_packed)
        return refused(zip, e->name, err, "reaches over the end of the archive");
    e->packed = (const uint8_t *)zip->bytes + body;
    *offset = body + e->n_packed;
    return WEFT_OK;
}

static weft_err read_entry(weft_zip *zip, const uint8_t *head, size_t left, size_t *offset, size_t start,
                           entry *e, weft_error *err)
{
    if (left < DIRECTORY_BYTES || le(head, 4) != DIRECTORY_MARK ||
        left < DIRECTORY_BYTES + (size_t)le(head + 28, 2) + le(head + 30, 2) + le(head + 32, 2))
        return damaged(zip, err, "its directory is damaged");
    const size_t n_name = le(head + 28, 2);
    e->name = weft_alloc(n_name + 1, 1, err);
    if (!e->name)
        return WEFT_ERR_NOMEM;
    memcpy(e->name, head + DIRECTORY_BYTES, n_name);
    if (strlen(e->name) != n_name || !weft_zip_name_is_safe(e->name))
        return weft_fail(err, WEFT_ERR_FORMAT,
                         "%s: refused, an entry has a name that is not safe to unpack: \"%s\"", zip->path,
                         weft_text_is_utf8(e->name, strlen(e->name)) ? e->name : "(not UTF-8)");
    e->method = (uint16_t)le(head + 10, 2);
    e->crc = le(head + 16, 4);
    e->n_packed = le(head + 20, 4);
    e->n = le(head + 24, 4);
    remark(zip, le(head + 30, 2) > 0 || le(head + 32, 2) > 0, "entries have extra fields or comments");
    WEFT_TRY(check_flags(zip, e, head, err));
    WEFT_TRY(check_sizes(zip, e, err));
    return check_local(zip, e, head, offset, start, err);
}

static weft_err read_directory(weft_zip *zip, uint64_t limit, weft_error *err)
{
    const uint8_t *end = NULL;
    WEFT_TRY(find_end(zip, &end, err));
    const int n = (int)le(end + 10, 2);
    const size_t start = le(end + 16, 4);
    size_t at = start, offset = 0;
    uint64_t total = 0;
    zip->entries = weft_alloc((size_t)n + 1, sizeof *zip->entries, err);
    zip->sorted = weft_alloc((size_t)n + 1, sizeof *zip->sorted, err);
    if (!zip->entries || !zip->sorted)
        return WEFT_ERR_NOMEM;
    for (int i = 0; i < n; i++) {
        const uint8_t *const head = (const uint8_t *)zip->bytes + at;
        entry *const e = &zip->entries[zip->n_entries++];
        WEFT_TRY(read_entry(zip, head, zip->n - END_BYTES - at, &offset, start, e, err));
        at += DIRECTORY_BYTES + (size_t)le(head + 28, 2) + le(head + 30, 2) + le(head + 32, 2);
        total += e->n;
        if (total > limit)
            return weft_fail(err, WEFT_ERR_RANGE, "%s: refused, it unpacks to more than %.0f MiB", zip->path,
                             (double)limit / (1 << 20));
    }
    if (at != zip->n - END_BYTES || offset != start)
        return damaged(zip, err, "there are bytes between its entries and its directory");
    return WEFT_OK;
}

/* -- names -------------------------------------------------------------------------------------------- */

static int by_name(const void *a, const void *b, void *zip_)
{
    const weft_zip *const zip = zip_;
    return strcmp(zip->entries[*(const int *)a].name, zip->entries[*(const int *)b].name);
}

int weft_zip_find(const weft_zip *zip, const char *name)
{
    int low = 0, high = zip->n_entries;
    while (low < high) {
        const int middle = (low + high) / 2;
        const int order = strcmp(zip->entries[zip->sorted[middle]].name, name);
        if (order == 0)
            return zip->sorted[middle];
        *(order < 0 ? &low : &high) = order < 0 ? middle + 1 : middle;
    }
    return -1;
}

/* No name twice, and none that is a file here and a folder there. */
static weft_err check_names(const weft_zip *zip, weft_error *err)
{
    for (int i = 1; i < zip->n_entries; i++)
        if (strcmp(zip->entries[zip->sorted[i - 1]].name, zip->entries[zip->sorted[i]].name) == 0)
            return refused(zip, zip->entries[zip->sorted[i]].name, err, "is there twice");
    char *const folder = weft_alloc(UINT16_MAX + 1, 1, err);
    weft_err status = folder ? WEFT_OK : WEFT_ERR_NOMEM;
    for (int i = 0; i < zip->n_entries && status == WEFT_OK; i++) {
        const char *const name = zip->entries[i].name;
        for (const char *slash = strchr(name, '/'); slash && status == WEFT_OK;
             slash = strchr(slash + 1, '/')) {
            memcpy(folder, name, (size_t)(slash - name));
            folder[slash - name] = '\0';
            if (weft_zip_find(zip, folder) >= 0)
                status = refused(zip, name, err, "lies in a file");
        }
    }
    weft_free(folder);
    return status;
}

/* -- the archive -------------------------------------------------------------------------------------- */

weft_err weft_zip_open(const char *path, uint64_t limit, weft_zip **zip, weft_error *err)
{
    weft_zip *const z = weft_alloc(1, sizeof *z, err);
    if (!z)
        return WEFT_ERR_NOMEM;
    z->path = weft_strdup(path, err);
    weft_err status = z->path ? weft_file_read(path, (size_t)limit, &z->bytes, &z->n, err) : WEFT_ERR_NOMEM;
    if (status == WEFT_OK)
        status = read_directory(z, limit, err);
    if (status == WEFT_OK) {
        for (int i = 0; i < z->n_entries; i++)
            z->sorted[i] = i;
        qsort_r(z->sorted, (size_t)z->n_entries, sizeof *z->sorted, by_name, z);
        status = check_names(z, err);
    }
    if (status != WEFT_OK) {
        weft_zip_close(z);
        return status;
    }
    *zip = z;
    return WEFT_OK;
}

void weft_zip_close(weft_zip *zip)
{
    if (!zip)
        return;
    for (int i = 0; i < zip->n_entries; i++)
        weft_free(zip->entries[i].name);
    weft_free(zip->entries);
    weft_free(zip->sorted);
    weft_free(zip->bytes);
    weft_free(zip->path);
    weft_free(zip);
}

int weft_zip_count(const weft_zip *zip)
{
    return zip->n_entries;
}

const char *weft_zip_name(const weft_zip *zip, int index)
{
    return zip->entries[index].name;
}

const char *weft_zip_remark(const weft_zip *zip)
{
    return zip->remark;
}

/* Exactly as many bytes as promised come out, and all that went in is used. */
static bool inflate_all(const entry *e, char *to)
{
    z_stream z = {0};
    if (inflateInit2(&z, -15) != Z_OK)
        return false;
    z.next_in = (Bytef *)(uintptr_t)e->packed;
    z.avail_in = e->n_packed;
    z.next_out = (Bytef *)to;
    z.avail_out = e->n + 1; /* one more, so that too much shows */
    const int end = inflate(&z, Z_FINISH);
    const bool good = end == Z_STREAM_END && z.total_out == e->n && z.avail_in == 0;
    inflateEnd(&z);
    return good;
}

weft_err weft_zip_unpack(const weft_zip *zip, int index, char **bytes, size_t *n, weft_error *err)
{
    const entry *const e = &zip->entries[index];
    char *const out = weft_alloc((size_t)e->n + 1, 1, err);
    if (!out)
        return WEFT_ERR_NOMEM;
    bool good = true;
    if (e->method == STORED)
        memcpy(out, e->packed, e->n);
    else
        good = inflate_all(e, out);
    if (!good || crc32(crc32(0, NULL, 0), (const Bytef *)out, e->n) != e->crc) {
        weft_free(out);
        return weft_fail(err, WEFT_ERR_FORMAT, "%s: its entry \"%s\" is damaged; ask for the archive again",
                         zip->path, e->name);
    }
    out[e->n] = '\0';
    *bytes = out;
    *n = e->n;
    return WEFT_OK;
}
