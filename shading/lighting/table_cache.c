#include "shading/lighting/table_cache.h"

#include "core/file.h"
#include "core/log.h"
#include "core/mem.h"
#include "core/sha256.h"

#include <stdlib.h>
#include <string.h>

enum { HASH = 64 };

static void hash_of(const void *bytes, size_t n, char hex[HASH + 1])
{
    weft_sha256 hash;
    weft_sha256_init(&hash);
    weft_sha256_update(&hash, bytes, n);
    weft_sha256_final_hex(&hash, hex);
}

/* NULL where there is no place for it. */
static char *cache_path(const char *key)
{
    const char *const cache = getenv("XDG_CACHE_HOME"), *const home = getenv("HOME");
    char hex[HASH + 1];
    if (!(cache && cache[0]) && !(home && home[0]))
        return NULL;
    hash_of(key, strlen(key), hex);
    return cache && cache[0] ? weft_asprintf(NULL, "%s/weft/%s.table", cache, hex)
                             : weft_asprintf(NULL, "%s/.cache/weft/%s.table", home, hex);
}

static bool read_cached(const char *path, void *table, size_t bytes)
{
    char *file = NULL, hex[HASH + 1];
    size_t n = 0;
    if (!weft_file_exists(path) || weft_file_read(path, bytes + HASH + 1, &file, &n, NULL) != WEFT_OK)
        return false;
    bool good = n == bytes + HASH;
    if (good) {
        hash_of(file, bytes, hex);
        good = memcmp(file + bytes, hex, HASH) == 0;
    }
    if (good)
        memcpy(table, file, bytes);
    weft_free(file);
    return good;
}

static void write_cached(const char *path, const void *table, size_t bytes)
{
    char *const file = weft_alloc(bytes + HASH + 1, 1, NULL), *const folder = weft_path_folder(path, NULL);
    bool kept = file && folder;
    if (kept) {
        memcpy(file, table, bytes);
        hash_of(table, bytes, file + bytes);
        kept = weft_folder_create(folder, NULL) == WEFT_OK &&
               weft_file_write(path, file, bytes + HASH, NULL) == WEFT_OK;
    }
    if (!kept)
        weft_explain("%s: the table cannot be kept there; it is computed again next time", path);
    weft_free(file);
    weft_free(folder);
}

void weft_table_cached(const char *key, void *table, size_t bytes, void (*compute)(void *table, int what),
                       int what)
{
    char *const path = cache_path(key);
    if (!path || !read_cached(path, table, bytes)) {
        compute(table, what);
        if (path)
            write_cached(path, table, bytes);
    }
    weft_free(path);
}
