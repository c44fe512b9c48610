#include "core/formats/zip_file.h"

#include "core/file.h"
#include "core/mem.h"
#include "core/text_buffer.h"

#include <stdbool.h>
#include <stdint.h>
#include <string.h>
#include <zlib.h>

enum { STORED = 0, DEFLATED = 8, UTF8_NAMES = 1 << 11, NEEDED = 20, MADE_BY_FAT = 63 };

/* What the directory repeats of each entry. */
typedef struct record {
    uint32_t crc, packed, size, offset;
    uint16_t method;
} record;

static void dos_time(time_t when, uint32_t *date, uint32_t *clock)
{
    struct tm t;
    gmtime_r(&when, &t);
    *date = (uint32_t)((t.tm_year - 80) << 9 | (t.tm_mon + 1) << 5 | t.tm_mday);
    *clock = (uint32_t)(t.tm_hour << 11 | t.tm_min << 5 | t.tm_sec / 2);
}

/* From "version needed" to the two lengths: the same in both headers. */
static void add_common(weft_text_buffer *out, const record *r, const char *name, time_t when)
{
    uint32_t date, clock;
    dos_time(when, &date, &clock);
    weft_text_add_le(out, NEEDED, 2);
    weft_text_add_le(out, UTF8_NAMES, 2);
    weft_text_add_le(out, r->method, 2);
    weft_text_add_le(out, clock, 2);
    weft_text_add_le(out, date, 2);
    weft_text_add_le(out, r->crc, 4);
    weft_text_add_le(out, r->packed, 4);
    weft_text_add_le(out, r->size, 4);
    weft_text_add_le(out, (uint32_t)strlen(name), 2);
    weft_text_add_le(out, 0, 2); /* extra field */
}

/* Raw deflate; what does not shrink (PNG) is stored. */
static weft_err add_entry(weft_text_buffer *out, const weft_zip_entry *entry, time_t when, record *r,
                          weft_error *err)
{
    z_stream z = {0};
    const uLong bound = compressBound((uLong)entry->n) + 64;
    uint8_t *const packed = weft_alloc(bound, 1, err);
    if (!packed)
        return WEFT_ERR_NOMEM;
    if (deflateInit2(&z, 6, Z_DEFLATED, -15, 8, Z_DEFAULT_STRATEGY) != Z_OK) {
        weft_free(packed);
        return weft_fail(err, WEFT_ERR_NOMEM, "out of memory");
    }
    z.next_in = (Bytef *)(uintptr_t)entry->bytes;
    z.avail_in = (uInt)entry->n;
    z.next_out = packed;
    z.avail_out = (uInt)bound;
    deflate(&z, Z_FINISH);
    deflateEnd(&z);
    const bool shrinks = z.total_out < entry->n;
    *r = (record){.crc = (uint32_t)crc32(crc32(0, NULL, 0), entry->bytes, (uInt)entry->n),
                  .packed = (uint32_t)(shrinks ? z.total_out : entry->n),
                  .size = (uint32_t)entry->n,
                  .offset = (uint32_t)out->n,
                  .method = shrinks ? DEFLATED : STORED};
    weft_text_add_le(out, 0x04034b50, 4);
    add_common(out, r, entry->name, when);
    weft_text_add_bytes(out, entry->name, strlen(entry->name));
    weft_text_add_bytes(out, shrinks ? (const char *)packed : entry->bytes, r->packed);
    weft_free(packed);
    return WEFT_OK;
}

static void add_directory(weft_text_buffer *out, const weft_zip_entry *entries, const record *records, int n,
                          time_t when)
{
    const size_t start = out->n;
    for (int i = 0; i < n; i++) {
        weft_text_add_le(out, 0x02014b50, 4);
        weft_text_add_le(out, MADE_BY_FAT, 2);
        add_common(out, &records[i], entries[i].name, when);
        weft_text_add_le(out, 0, 2); /* comment */
        weft_text_add_le(out, 0, 2); /* disk */
        weft_text_add_le(out, 0, 2); /* internal attributes */
        weft_text_add_le(out, 0, 4); /* external attributes */
        weft_text_add_le(out, records[i].offset, 4);
        weft_text_add_bytes(out, entries[i].name, strlen(entries[i].name));
    }
    const size_t size = out->n - start;
    weft_text_add_le(out, 0x06054b50, 4);
    weft_text_add_le(out, 0, 4); /* both disks */
    weft_text_add_le(out, (uint32_t)n, 2);
    weft_text_add_le(out, (uint32_t)n, 2);
    weft_text_add_le(out, (uint32_t)size, 4);
    weft_text_add_le(out, (uint32_t)start, 4);
    weft_text_add_le(out, 0, 2);
}

weft_err weft_zip_write(const char *path, const weft_zip_entry *entries, int n_entries, time_t when,
                        weft_error *err)
{
    size_t total = 0;
    for (int i = 0; i < n_entries; i++)
        total += entries[i].n + 2 * strlen(entries[i].name) + 100;
    if (n_entries > 65535 || total > 0xffffffffU)
        return weft_fail(err, WEFT_ERR_RANGE, "%s: is too large for a zip archive without zip64 (4 GiB)",
                         path);
    weft_text_buffer out = {0};
    record *const records = weft_alloc((size_t)n_entries, sizeof *records, err);
    weft_err status = records ? WEFT_OK : WEFT_ERR_NOMEM;
    for (int i = 0; i < n_entries && status == WEFT_OK; i++)
        status = add_entry(&out, &entries[i], when, &records[i], err);
    if (status == WEFT_OK) {
        add_directory(&out, entries, records, n_entries, when);
        status = weft_text_buffer_status(&out, err);
    }
    if (status == WEFT_OK)
        status = weft_file_write(path, out.text, out.n, err);
    weft_text_buffer_fini(&out);
    weft_free(records);
    return status;
}
