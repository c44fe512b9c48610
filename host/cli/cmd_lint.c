/* weft lint: what is wrong with anybody's map set. */
#include "host/cli/command.h"

#include "core/file.h"
#include "core/mem.h"
#include "shading/export/map_lint.h"

#include <dirent.h>
#include <stdlib.h>
#include <string.h>

enum { MAX_MAPS = 64 };

typedef struct linter {
    const weft_invocation *inv;
    json_t *findings;
    const char *file;
    int wrong, notes, width, height;
    weft_map albedo, specular; /* to be held against each other; empty until met */
} linter;

static void note(void *context, weft_lint_level level, const char *check, const char *text)
{
    static const char *const names[] = {"good", "note", "WRONG"};
    linter *const l = context;
    l->wrong += level == WEFT_LINT_WRONG;
    l->notes += level == WEFT_LINT_NOTE;
    if (l->inv->json)
        json_array_append_new(l->findings, json_pack("{s:s, s:s, s:s, s:s}", "file", l->file, "level",
                                                     names[level], "check", check, "text", text));
    else
        fprintf(l->inv->out, "%-5s  %-28s %-15s %s\n", names[level], weft_path_name(l->file), check, text);
}

static void lint_size(linter *l, const weft_image *image)
{
    const weft_lint lint = {note, l};
    char text[128];
    if (!l->width) {
        l->width = image->width;
        l->height = image->height;
        weft_lint_size(&lint, image->width, image->height);
    } else if (image->width != l->width || image->height != l->height) {
        (void)snprintf(text, sizeof text, "%d x %d, but the first map of the set is %d x %d", image->width,
                       image->height, l->width, l->height);
        note(l, WEFT_LINT_WRONG, "same size", text);
    }
}

/* The first albedo stays, and the first F0 that is named as it is; they are then compared. */
static void lint_pair(linter *l, weft_map *map)
{
    const weft_lint lint = {note, l};
    weft_map *const kept = map->kind == WEFT_MAP_ALBEDO ? &l->albedo : &l->specular;
    if (kept->n_levels > 0 || (map->kind == WEFT_MAP_SPECULAR &&
                               !(l->albedo.n_levels && strcmp(map->prefix, l->albedo.prefix) == 0)))
        return;
    *kept = *map;
    *map = (weft_map){0};
    if (kept == &l->specular && kept->levels[0].width == l->albedo.levels[0].width &&
        kept->levels[0].height == l->albedo.levels[0].height)
        weft_lint_specular_pair(&lint, &l->albedo.levels[0], &kept->levels[0]);
}

static void lint_map(linter *l, weft_map *map)
{
    const weft_lint lint = {note, l};
    const weft_image *const image = &map->levels[0];
    lint_size(l, image);
    weft_lint_picture(&lint, image);
    switch (map->kind) {
    case WEFT_MAP_NORMAL:
        if (image->planes == 3)
            weft_lint_normal(&lint, image);
        else
            note(l, WEFT_LINT_WRONG, "channels", "a normal map has three");
        break;
    case WEFT_MAP_ALBEDO:
        weft_lint_albedo(&lint, image);
        break;
    case WEFT_MAP_SPECULAR:
        weft_lint_specular(&lint, image);
        break;
    case WEFT_MAP_ROUGHNESS:
    case WEFT_MAP_SCALAR:
        weft_lint_scalar(&lint, map);
        break;
    case WEFT_MAP_OTHER:
        break;
    }
    if (map->is_coded && weft_path_has_suffix(l->file, ".exr"))
        note(l, WEFT_LINT_NOTE, "coding", "floats that hold 0..1 for -1..1: write vectors, or integers");
    weft_lint_mips(&lint, map);
    if (map->kind == WEFT_MAP_ALBEDO || map->kind == WEFT_MAP_SPECULAR)
        lint_pair(l, map);
}

/* What cannot be read is a finding: the others are looked at all the same. */
static weft_err lint_file(linter *l, const char *path, weft_error *err)
{
    weft_map map;
    weft_error why = {0};
    l->file = path;
    const weft_err status = weft_map_read(path, &map, &why);
    if (status == WEFT_ERR_NOMEM || status == WEFT_ERR_MISSING) {
        if (err)
            *err = why;
        return status;
    }
    if (status != WEFT_OK) {
        note(l, WEFT_LINT_WRONG, "readable", why.text);
        return WEFT_OK;
    }
    lint_map(l, &map);
    weft_map_fini(&map);
    return WEFT_OK;
}

static int is_picture(const struct dirent *entry)
{
    static const char *const endings[] = {".png", ".exr", ".tif", ".tiff", ".jpg", ".jpeg"};
    for (size_t i = 0; i < sizeof endings / sizeof endings[0]; i++)
        if (entry->d_name[0] != '.' && weft_path_has_suffix(entry->d_name, endings[i]))
            return 1;
    return 0;
}

/* A folder: its pictures; where an EXR stands beside a PNG of the same name, the EXR. */
static weft_err lint_folder(linter *l, const char *folder, weft_error *err)
{
    struct dirent **names = NULL;
    weft_err status = WEFT_OK;
    const int n = scandir(folder, &names, is_picture, alphasort);
    if (n < 0)
        return weft_fail_errno(err, WEFT_ERR_IO, "%s: cannot be read", folder);
    if (n == 0)
        status = weft_fail(err, WEFT_ERR_MISSING, "%s: holds no pictures (.png .exr .tif .jpg)", folder);
    for (int i = 0; i < n && status == WEFT_OK; i++) {
        const size_t stem = strcspn(names[i]->d_name, ".");
        const bool twin = i > 0 && strncmp(names[i - 1]->d_name, names[i]->d_name, stem + 1) == 0 &&
                          weft_path_has_suffix(names[i - 1]->d_name, ".exr");
        char *const path = twin ? NULL : weft_path_join(folder, names[i]->d_name, err);
        if (!twin)
            status = path ? lint_file(l, path, err) : WEFT_ERR_NOMEM;
        weft_free(path);
    }
    for (int i = 0; i < n; i++)
        free(names[i]);
    free(names);
    return status;
}

static weft_err run(const weft_invocation *inv, const void *args, weft_error *err)
{
    linter l = {.inv = inv, .findings = json_array()};
    weft_err status = WEFT_OK;
    (void)args;
    for (int i = 0; i < inv->n_operands && status == WEFT_OK; i++)
        status = weft_folder_exists(inv->operands[i]) ? lint_folder(&l, inv->operands[i], err)
                                                      : lint_file(&l, inv->operands[i], err);
    if (status == WEFT_OK && inv->json)
        status = weft_print_json(
            inv, json_pack("{s:O, s:i, s:i}", "findings", l.findings, "wrong", l.wrong, "notes", l.notes),
            err);
    else if (status == WEFT_OK)
        fprintf(inv->out, "%d wrong, %d notes\n", l.wrong, l.notes);
    json_decref(l.findings);
    weft_map_fini(&l.albedo);
    weft_map_fini(&l.specular);
    if (status == WEFT_OK && l.wrong > 0)
        return weft_fail(err, WEFT_ERR_RANGE, "%d checks failed", l.wrong);
    return status;
}

const weft_command weft_cmd_lint = {
    .name = "lint",
    .summary = "what is wrong with anybody's map set",
    .operands = "MAPS|IMAGE...",
    .min_operands = 1,
    .max_operands = MAX_MAPS,
    .details = "A folder of maps or single pictures; what each is, its name tells (normal, albedo, "
               "basecolor, roughness, height, ao, ...).  Exits 1 when something is wrong.",
    .example = "weft lint downloaded-fabric/",
    .run = run,
};
