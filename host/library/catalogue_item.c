#include "host/library/catalogue_item.h"

#include "calibration/calibration.h"
#include "core/file.h"
#include "core/json.h"
#include "core/mem.h"
#include "core/text.h"
#include "host/set/set.h"

#include <dirent.h>
#include <inttypes.h>
#include <limits.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <time.h>

static json_t *describe_set(const char *path, weft_catalogue_item *item, weft_error *err)
{
    weft_set set;
    if (weft_set_load(path, &set, err) != WEFT_OK)
        return NULL;
    snprintf(item->created, sizeof item->created, "%s", set.created);
    json_t *const info = json_pack(
        "{s:s, s:s, s:i, s:i, s:i, s:i, s:s, s:s}", "name", set.name ? set.name : "", "state",
        set.complete ? "complete" : "capturing", "frames", set.n_frames, "lights", weft_set_n_lights(&set),
        "width", set.width, "height", set.height, "camera", set.camera_model, "cfa", weft_cfa_name(set.cfa));
    weft_set_fini(&set);
    return info;
}

static json_t *describe_calibration(const char *path, weft_catalogue_item *item, weft_error *err)
{
    weft_calibration *const cal = weft_alloc(1, sizeof *cal, err);
    json_t *info = NULL;
    if (cal && weft_calibration_load(path, cal, err) == WEFT_OK) {
        snprintf(item->created, sizeof item->created, "%s", cal->created);
        info = json_pack("{s:b, s:b, s:i, s:b, s:b, s:i, s:i}", "camera", cal->has_camera, "pose",
                         cal->has_camera && cal->camera.has_pose, "lights",
                         cal->has_lights ? cal->n_lights : 0, "linearity", cal->has_linearity, "colour",
                         cal->has_colour, "width", cal->camera.width, "height", cal->camera.height);
        weft_calibration_fini(cal);
    }
    weft_free(cal);
    return info;
}

/* The parts of a JSON file that are short. */
static json_t *describe_json(const char *folder, const char *file, weft_catalogue_item *item, weft_error *err)
{
    json_t *object = NULL;
    const char *created = NULL;
    char *const path = weft_path_join(folder, file, err);
    const weft_err status = path ? weft_json_load(path, &object, err) : WEFT_ERR_NOMEM;
    weft_free(path);
    if (status != WEFT_OK)
        return NULL;
    if (weft_json_get_text(object, "created", WEFT_JSON_OPTIONAL, &created, file, NULL) == WEFT_OK && created)
        snprintf(item->created, sizeof item->created, "%s", created);
    json_t *const info = json_object();
    const char *key;
    json_t *value;
    json_object_foreach(object, key, value)
    {
        const bool is_short = json_is_object(value)
                                  ? json_object_size(value) <= 12 && strcmp(key, "inputs") != 0
                                  : !json_is_array(value) || json_array_size(value) <= 12;
        if (is_short && strcmp(key, "weft") != 0)
            json_object_set(info, key, value);
    }
    json_decref(object);
    return info;
}

static json_t *describe_maps(const char *path, weft_catalogue_item *item, weft_error *err)
{
    return describe_json(path, "maps.json", item, err);
}

static json_t *describe_material(const char *path, weft_catalogue_item *item, weft_error *err)
{
    return describe_json(path, "material.json", item, err);
}

static json_t *describe_picture(const char *path, weft_catalogue_item *item, weft_error *err)
{
    (void)item, (void)err;
    return json_pack("{s:s}", "type", strrchr(path, '.') + 1);
}

static const struct {
    const char *kind, *file; /* the file of a folder that says what it is; NULL: it is the file itself */
    json_t *(*describe)(const char *path, weft_catalogue_item *item, weft_error *err);
} kinds[] = {
    {"set", "set.json", describe_set},    {"calibration", "calibration.json", describe_calibration},
    {"maps", "maps.json", describe_maps}, {"material", "material.json", describe_material},
    {"picture", NULL, describe_picture},
};

enum { N_KINDS = sizeof kinds / sizeof kinds[0] };

static int index_of(const char *kind)
{
    int i = 0;
    while (i < N_KINDS - 1 && strcmp(kinds[i].kind, kind) != 0)
        i++;
    return i;
}

const char *weft_catalogue_item_kind(const char *path, bool is_folder)
{
    static const char *const suffixes[] = {".png", ".jpg", ".jpeg", ".tif", ".tiff", ".exr", NULL};
    if (!is_folder) {
        for (const char *const *s = suffixes; *s; s++)
            if (weft_path_has_suffix(path, *s))
                return "picture";
        return NULL;
    }
    for (int i = 0; i < N_KINDS - 1; i++) {
        char file[PATH_MAX];
        const int n = snprintf(file, sizeof file, "%s/%s", path, kinds[i].file);
        if (n < (int)sizeof file && weft_file_exists(file))
            return kinds[i].kind;
    }
    return NULL;
}

bool weft_catalogue_item_stamp(const char *path, const char *kind, char stamp[64])
{
    char file[PATH_MAX];
    struct stat s;
    const char *const inside = kinds[index_of(kind)].file;
    const int n = snprintf(file, sizeof file, "%s%s%s", path, inside ? "/" : "", inside ? inside : "");
    if (n >= (int)sizeof file || stat(file, &s) != 0)
        return false;
    snprintf(stamp, 64, "%" PRId64 ".%09ld-%" PRId64 "-%" PRIu64, (int64_t)s.st_mtim.tv_sec,
             s.st_mtim.tv_nsec, (int64_t)s.st_size, (uint64_t)s.st_ino);
    return true;
}

/* Size of the files of a folder, or of one; and when it last changed. */
static int64_t measure(const char *path, time_t *changed)
{
    struct stat s;
    int64_t bytes = 0;
    *changed = 0;
    if (stat(path, &s) != 0)
        return 0;
    *changed = s.st_mtim.tv_sec;
    if (!S_ISDIR(s.st_mode))
        return s.st_size;
    DIR *const folder = opendir(path);
    const struct dirent *entry;
    while (folder && (entry = readdir(folder)) != NULL) {
        char file[PATH_MAX];
        if (snprintf(file, sizeof file, "%s/%s", path, entry->d_name) < (int)sizeof file &&
            lstat(file, &s) == 0 && S_ISREG(s.st_mode))
            bytes += s.st_size;
    }
    if (folder)
        closedir(folder);
    return bytes;
}

static void name_it(const char *path, const char *kind, char name[256])
{
    const char *const last = weft_path_name(path);
    const char *const dot = strrchr(last, '.');
    const bool strip = dot && dot != last && strcmp(kind, "picture") != 0;
    snprintf(name, 256, "%.*s", strip ? (int)(dot - last) : (int)strlen(last), last);
    if (!weft_text_is_utf8(name, strlen(name)))
        snprintf(name, 256, "(no UTF-8)");
}

weft_err weft_catalogue_item_read(const char *path, const char *kind, weft_catalogue_item *item,
                                  weft_error *err)
{
    weft_error problem = {0};
    time_t changed;
    struct tm utc;
    *item = (weft_catalogue_item){.kind = kind};
    if (!weft_catalogue_item_stamp(path, kind, item->stamp))
        return weft_fail(err, WEFT_ERR_MISSING, "%s: is gone", path);
    name_it(path, kind, item->name);
    item->bytes = measure(path, &changed);
    item->info = kinds[index_of(kind)].describe(path, item, &problem);
    if (!item->info) {
        snprintf(item->problem, sizeof item->problem, "%.500s",
                 problem.text[0] ? problem.text : "cannot be read");
        if (!weft_text_is_utf8(item->problem, strlen(item->problem)))
            snprintf(item->problem, sizeof item->problem, "cannot be read");
        item->info = json_object();
    }
    if (!item->created[0] && gmtime_r(&changed, &utc))
        strftime(item->created, sizeof item->created, "%Y-%m-%dT%H:%M:%SZ", &utc);
    return item->info ? WEFT_OK : weft_fail(err, WEFT_ERR_NOMEM, "out of memory for %s", path);
}

void weft_catalogue_item_fini(weft_catalogue_item *item)
{
    json_decref(item->info);
    item->info = NULL;
}
