#include "host/cli/preview_watch.h"

#include "core/file.h"
#include "core/mem.h"
#include "core/progress.h"

#include <dirent.h>
#include <string.h>
#include <sys/stat.h>
#include <time.h>

#define LOOK_NS 200000000 /* between two looks at the files */

/* FNV-1a, of whole numbers. */
static uint64_t mix(uint64_t hash, uint64_t value)
{
    return (hash ^ value) * 0x100000001b3ULL;
}

static uint64_t state_of_file(const char *path)
{
    struct stat s = {0};
    uint64_t hash = 0xcbf29ce484222325ULL;
    if (stat(path, &s) != 0)
        return 0;
    for (const char *p = path; *p; p++)
        hash = mix(hash, (unsigned char)*p);
    hash = mix(mix(hash, (uint64_t)s.st_mtim.tv_sec), (uint64_t)s.st_mtim.tv_nsec);
    return mix(mix(hash, (uint64_t)s.st_size), (uint64_t)s.st_ino);
}

static bool is_same(const char *a, const char *b)
{
    struct stat x, y;
    return stat(a, &x) == 0 && stat(b, &y) == 0 && x.st_ino == y.st_ino && x.st_dev == y.st_dev;
}

/* A sum, for folders come in any order.  The picture itself may lie there. */
static uint64_t state_of_folder(const char *folder, const char *output)
{
    uint64_t sum = 0;
    DIR *const open = opendir(folder);
    if (!open)
        return 0;
    for (const struct dirent *entry; (entry = readdir(open)) != NULL;) {
        char *const path = entry->d_name[0] == '.' ? NULL : weft_path_join(folder, entry->d_name, NULL);
        sum += path && !is_same(path, output) ? state_of_file(path) : 0;
        weft_free(path);
    }
    closedir(open);
    return sum;
}

uint64_t weft_preview_watch_state(const char *input, const weft_preview_options *options)
{
    const char *const files[] = {options->env, options->height_map, options->brdf};
    uint64_t sum = input ? state_of_folder(input, options->output) : 0;
    for (size_t i = 0; i < sizeof files / sizeof files[0]; i++)
        sum += files[i] ? state_of_file(files[i]) : 0;
    for (int i = 0; i < options->params.n; i++) {
        const char *const equals = strchr(options->params.values[i], '=');
        sum += equals ? state_of_file(equals + 1) : 0;
    }
    return sum;
}

weft_err weft_preview_watch_wait(const char *input, const weft_preview_options *options, uint64_t *state,
                                 weft_error *err)
{
    uint64_t last = *state;
    for (;;) {
        if (weft_cancelled())
            return weft_fail(err, WEFT_ERR_CANCELLED, "cancelled");
        const uint64_t now = weft_preview_watch_state(input, options);
        if (now != *state && now == last) {
            *state = now;
            return WEFT_OK;
        }
        last = now;
        nanosleep(&(struct timespec){.tv_nsec = LOOK_NS}, NULL);
    }
}
