#include "host/set/import_list.h"

#include "core/file.h"
#include "core/formats/raw_file.h"
#include "core/log.h"
#include "core/mem.h"
#include "core/text.h"

#include <dirent.h>
#include <stdlib.h>
#include <string.h>

weft_err weft_import_list_init(weft_import_list *list, const char *kind, weft_error *err)
{
    weft_import_item *const items = weft_alloc(WEFT_LIGHTS_MAX, sizeof *items, err);
    if (!items)
        return WEFT_ERR_NOMEM;
    *list = (weft_import_list){.kind = kind, .items = items};
    return WEFT_OK;
}

void weft_import_list_fini(weft_import_list *list)
{
    for (int i = 0; i < list->n; i++)
        weft_free(list->items[i].path);
    weft_free(list->items);
    weft_free(list->mask);
    *list = (weft_import_list){0};
}

weft_err weft_import_list_add(weft_import_list *list, const char *path, weft_vec3 direction,
                              const double intensity[3], weft_error *err)
{
    if (list->n == WEFT_LIGHTS_MAX)
        return weft_fail(err, WEFT_ERR_RANGE,
                         "%s would be light %d; at most %d lights can be used (leave some out)", path,
                         list->n, WEFT_LIGHTS_MAX);
    if (!weft_text_is_utf8(path, strlen(path)))
        return weft_fail(err, WEFT_ERR_FORMAT,
                         "the name %s is not UTF-8 (rename it; set.json holds UTF-8 only)", path);
    char *const copy = weft_strdup(path, err);
    if (!copy)
        return WEFT_ERR_NOMEM;
    weft_import_item *const item = &list->items[list->n++];
    item->path = copy;
    item->direction = direction;
    memcpy(item->intensity, intensity, sizeof item->intensity);
    return WEFT_OK;
}

weft_err weft_import_find_mask(weft_import_list *list, const char *folder, weft_error *err)
{
    char *const path = weft_path_join(folder, "mask.png", err);
    if (!path)
        return WEFT_ERR_NOMEM;
    if (weft_file_exists(path))
        list->mask = path;
    else
        weft_free(path);
    return WEFT_OK;
}

static int in_natural_order(const void *a, const void *b)
{
    return strverscmp(*(char *const *)a, *(char *const *)b);
}

static weft_err append(char ***names, int *n, int *room, const char *name, weft_error *err)
{
    if (*n == *room) {
        const int more = *room ? 2 * *room : 64;
        char **const grown = weft_realloc(*names, (size_t)more, sizeof **names, err);
        if (!grown)
            return WEFT_ERR_NOMEM;
        *names = grown;
        *room = more;
    }
    char *const copy = weft_strdup(name, err);
    if (!copy)
        return WEFT_ERR_NOMEM;
    (*names)[(*n)++] = copy;
    return WEFT_OK;
}

weft_err weft_import_list_names(const char *folder, bool (*wanted)(const char *name), char ***names, int *n,
                                weft_error *err)
{
    char **found = NULL;
    int count = 0, room = 0;
    weft_err status = WEFT_OK;
    DIR *const dir = opendir(folder);
    if (!dir)
        return weft_fail_errno(err, WEFT_ERR_IO, "%s cannot be read", folder);
    for (const struct dirent *d = readdir(dir); d && status == WEFT_OK; d = readdir(dir))
        if (d->d_name[0] != '.' && wanted(d->d_name))
            status = append(&found, &count, &room, d->d_name, err);
    closedir(dir);
    if (status != WEFT_OK) {
        for (int i = 0; i < count; i++)
            weft_free(found[i]);
        weft_free(found);
        return status;
    }
    if (count > 0)
        qsort(found, (size_t)count, sizeof *found, in_natural_order);
    *names = found;
    *n = count;
    return WEFT_OK;
}

weft_err weft_import_read_raws(const char *folder, weft_import_list *list, weft_error *err)
{
    static const double one[3] = {1, 1, 1};
    char **names = NULL;
    int n = 0;
    WEFT_TRY(weft_import_list_init(list, "raw", err));
    weft_err status = weft_import_list_names(folder, weft_raw_is_name, &names, &n, err);
    for (int i = 0; i < n && status == WEFT_OK; i++) {
        char *const path = weft_path_join(folder, names[i], err);
        status = path ? weft_import_list_add(list, path, (weft_vec3){0, 0, 1}, one, err) : WEFT_ERR_NOMEM;
        weft_free(path);
    }
    if (status == WEFT_OK && n == 0)
        status = weft_fail(err, WEFT_ERR_MISSING,
                           "%s holds neither an .lp file, nor light_directions.txt, nor camera raws", folder);
    if (status == WEFT_OK)
        status = weft_import_find_mask(list, folder, err);
    for (int i = 0; i < n; i++)
        weft_free(names[i]);
    weft_free(names);
    if (status != WEFT_OK)
        weft_import_list_fini(list);
    return status;
}
