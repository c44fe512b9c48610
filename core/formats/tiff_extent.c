#include "core/formats/tiff_extent.h"

#include "core/file.h"

#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>

#define TAG_SUB_DIRECTORIES 330
#define TAG_EXIF            34665
#define TAG_DNG_VERSION     50706
#define MAX_DIRECTORIES     64 /* in all; a ring of directories ends here */

/* TIFF 6.0, section 2: classic files of 32-bit offsets, either byte order. */
typedef struct walk {
    FILE *file;
    uint32_t size;
    bool big_endian;
    bool is_dng;
    uint32_t todo[MAX_DIRECTORIES]; /* offsets of directories still to be looked at */
    int n_todo, n_done;
} walk;

static uint32_t number(const walk *w, const uint8_t *bytes, int n)
{
    uint32_t value = 0;
    for (int i = 0; i < n; i++)
        value = value << 8 | bytes[w->big_endian ? i : n - 1 - i];
    return value;
}

static bool read_at(const walk *w, uint32_t offset, void *bytes, size_t n)
{
    return fseek(w->file, (long)offset, SEEK_SET) == 0 && fread(bytes, 1, n, w->file) == n;
}

static void add(walk *w, uint32_t offset)
{
    if (offset && w->n_todo + w->n_done < MAX_DIRECTORIES)
        w->todo[w->n_todo++] = offset;
}

/* The offsets that a tag holds: in the entry itself when there is one, else where it points to. */
static bool add_all(walk *w, const uint8_t *entry, uint32_t count)
{
    uint8_t bytes[4];
    if (count == 1) {
        add(w, number(w, entry + 8, 4));
        return true;
    }
    for (uint32_t i = 0; i < count && i < MAX_DIRECTORIES; i++) {
        if (!read_at(w, number(w, entry + 8, 4) + 4 * i, bytes, sizeof bytes))
            return false;
        add(w, number(w, bytes, 4));
    }
    return true;
}

static bool entry_is_inside(walk *w, const uint8_t *entry)
{
    static const uint8_t sizes[14] = {0, 1, 1, 2, 4, 8, 1, 1, 2, 4, 8, 4, 8, 4};
    const uint32_t tag = number(w, entry, 2), type = number(w, entry + 2, 2), count = number(w, entry + 4, 4);
    const uint64_t bytes = type < sizeof sizes ? (uint64_t)sizes[type] * count : 0;
    if (bytes > 4 && number(w, entry + 8, 4) + bytes > w->size)
        return false;
    w->is_dng |= tag == TAG_DNG_VERSION;
    return (tag != TAG_SUB_DIRECTORIES && tag != TAG_EXIF) || add_all(w, entry, count);
}

static bool directory_is_inside(walk *w, uint32_t offset)
{
    uint8_t bytes[12];
    if (!read_at(w, offset, bytes, 2))
        return false;
    const uint32_t n = number(w, bytes, 2);
    for (uint32_t i = 0; i < n; i++)
        if (!read_at(w, offset + 2 + 12 * i, bytes, 12) || !entry_is_inside(w, bytes))
            return false;
    if (!read_at(w, offset + 2 + 12 * n, bytes, 4))
        return false;
    add(w, number(w, bytes, 4));
    return true;
}

static bool all_inside(walk *w)
{
    uint8_t head[8];
    if (!read_at(w, 0, head, sizeof head))
        return true; /* too short to be a TIFF: LibRaw will say so */
    w->big_endian = head[0] == 'M';
    if ((head[0] != 'I' && head[0] != 'M') || head[0] != head[1] || number(w, head + 2, 2) != 42)
        return true;
    bool inside = true;
    add(w, number(w, head + 4, 4));
    while (inside && w->n_todo > 0) {
        w->n_done++;
        inside = directory_is_inside(w, w->todo[--w->n_todo]);
    }
    return inside;
}

weft_err weft_dng_check_extent(const char *path, weft_error *err)
{
    walk w = {.file = fopen(path, "rb"), .is_dng = weft_path_has_suffix(path, ".dng")};
    if (!w.file)
        return weft_fail_errno(err, WEFT_ERR_IO, "%s: cannot be opened", path);
    fseek(w.file, 0, SEEK_END);
    const long size = ftell(w.file);
    w.size = size < 0 ? 0 : size > (long)UINT32_MAX ? UINT32_MAX : (uint32_t)size;
    const bool inside = all_inside(&w);
    fclose(w.file);
    if (inside || !w.is_dng)
        return WEFT_OK;
    return weft_fail(err, WEFT_ERR_FORMAT, "%s: is cut short; copy it again", path);
}
