#include "core/formats/ihex_file.h"

#include "core/file.h"
#include "core/mem.h"

#include <stdbool.h>
#include <string.h>

/* Far more text than any program of a small processor needs. */
#define MAX_TEXT (4u << 20)

enum { DATA = 0, END = 1, SEGMENT = 2, START_SEGMENT = 3, LINEAR = 4, START_LINEAR = 5 };

/* A line: ':' n, address (2), type, n bytes, checksum; all in hexadecimal. */
typedef struct record {
    uint8_t n, type;
    uint16_t address;
    uint8_t bytes[255];
} record;

static int digit(char c)
{
    if (c >= '0' && c <= '9')
        return c - '0';
    if (c >= 'A' && c <= 'F')
        return c - 'A' + 10;
    return c >= 'a' && c <= 'f' ? c - 'a' + 10 : -1;
}

static bool read_byte(const char *text, uint8_t *byte)
{
    const int high = digit(text[0]), low = high < 0 ? -1 : digit(text[1]);
    *byte = (uint8_t)(high * 16 + low);
    return low >= 0;
}

/* The record of a line of `length` characters; false when it is damaged. */
static bool parse(const char *line, size_t length, record *r)
{
    uint8_t bytes[5 + 255] = {0}, sum = 0;
    const size_t n = length / 2;
    if (length < 11 || length % 2 == 0 || line[0] != ':' || n > sizeof bytes)
        return false;
    for (size_t i = 0; i < n; i++) {
        if (!read_byte(line + 1 + 2 * i, &bytes[i]))
            return false;
        sum = (uint8_t)(sum + bytes[i]);
    }
    if (sum != 0 || bytes[0] + 5u != n)
        return false;
    r->n = bytes[0];
    r->address = (uint16_t)(bytes[1] << 8 | bytes[2]);
    r->type = bytes[3];
    memcpy(r->bytes, bytes + 4, r->n);
    return r->type <= START_LINEAR && ((r->type != SEGMENT && r->type != LINEAR) || r->n == 2);
}

static weft_err bad_line(const char *path, int line, const char *what, weft_error *err)
{
    return weft_fail(err, WEFT_ERR_FORMAT, "%s: line %d %s", path, line, what);
}

static weft_err read_records(const char *path, const char *text, uint8_t *memory, size_t size,
                             uint32_t *begin, uint32_t *end, weft_error *err)
{
    uint32_t base = 0, lowest = UINT32_MAX, highest = 0;
    record r = {0};
    for (int line = 1; *text && !(line > 1 && r.type == END); line++) {
        const size_t length = strcspn(text, "\r\n");
        if (!parse(text, length, &r))
            return bad_line(path, line, "is no good record of an Intel hex file", err);
        const uint32_t value = (uint32_t)r.bytes[0] << 8 | r.bytes[1];
        const uint64_t at = (uint64_t)base + r.address;
        if (r.type == SEGMENT)
            base = value << 4;
        if (r.type == LINEAR)
            base = value << 16;
        if (r.type == DATA && at + r.n > size)
            return bad_line(path, line, "is beyond the end of the chip's memory", err);
        if (r.type == DATA && r.n > 0) {
            memcpy(memory + at, r.bytes, r.n);
            lowest = at < lowest ? (uint32_t)at : lowest;
            highest = at + r.n > highest ? (uint32_t)at + r.n : highest;
        }
        text += length;
        text += strspn(text, "\r\n");
    }
    if (r.type != END)
        return weft_fail(err, WEFT_ERR_FORMAT, "%s: the Intel hex file is cut: it has no end record", path);
    if (highest == 0)
        return weft_fail(err, WEFT_ERR_FORMAT, "%s: the Intel hex file holds no program", path);
    *begin = lowest;
    *end = highest;
    return WEFT_OK;
}

weft_err weft_ihex_read(const char *path, uint8_t *memory, size_t size, uint32_t *begin, uint32_t *end,
                        weft_error *err)
{
    char *text = NULL;
    size_t n;
    WEFT_TRY(weft_file_read(path, MAX_TEXT, &text, &n, err));
    const weft_err status = strlen(text) == n ? read_records(path, text, memory, size, begin, end, err)
                                              : bad_line(path, 1, "or a later one holds a zero byte", err);
    weft_free(text);
    return status;
}
