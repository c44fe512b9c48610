/* weft lint: what is wrong with anybody's map set. */
#include "host/cli/command.h"

#include "core/file.h"
#include "core/formats/image_file.h"
#include "core/mem.h"
#include "shading/export/map_lint.h"

#include <dirent.h>
#include <stdlib.h>
#include <string.h>

enum { MAX_MAPS = 64, LONGEST_NAME = 256 };

typedef enum map_kind { MAP_NORMAL, MAP_ALBEDO, MAP_SPECULAR, MAP_SCALAR, MAP_OTHER } map_kind;

typedef struct linter {
    const weft_invocation *inv;
    json_t *findings;
    const char *file;
    int wrong, notes, width, height;
    weft_image albedo, specular; /* to be held against each other; empty until met */
    char prefix[LONGEST_NAME];   /* of the albedo's name */
} linter;

/* What a picture is by its name, and what stands there before the word that says so, in lower case. */
static map_kind kind_of(const char *path, char prefix[LONGEST_NAME])
{
    static const struct {
        const char *word;
        map_kind kind;
    } words[] = {{"normal", MAP_NORMAL},     {"nrm", MAP_NORMAL},     {"nml", MAP_NORMAL},
                 {"bump", MAP_NORMAL},       {"albedo", MAP_ALBEDO},  {"basecolor", MAP_ALBEDO},
                 {"base_color", MAP_ALBEDO}, {"diffuse", MAP_ALBEDO}, {"specular", MAP_SPECULAR},
                 {"_f0", MAP_SPECULAR},      {"rough", MAP_SCALAR},   {"gloss", MAP_SCALAR},
                 {"occlusion", MAP_SCALAR},  {"height", MAP_SCALAR},  {"displacement", MAP_SCALAR},
                 {"metal", MAP_SCALAR}};
    char name[LONGEST_NAME];
    const char *const from = weft_path_name(path);
    size_t n = 0;
    for (; from[n] && n + 1 < sizeof name; n++)
        name[n] = from[n] >= 'A' && from[n] <= 'Z' ? (char)(from[n] + 32) : from[n];
    name[n] = '\0';
    memset(prefix, 0, LONGEST_NAME);
    if (strstr(name, "normal_length"))
        return MAP_SCALAR;
    for (size_t i = 0; i < sizeof words / sizeof words[0]; i++) {
        const char *const found = strstr(name, words[i].word);
        if (found) {
            memcpy(prefix, name, (size_t)(found - name));
            return words[i].kind;
        }
    }
    return MAP_OTHER;
}

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

/* The first albedo stays, and the first F0 that is named as it is; the image is then empty. */
static void keep(linter *l, map_kind kind, const char *prefix, weft_image *image)
{
    weft_image *const kept = kind == MAP_ALBEDO ? &l->albedo : &l->specular;
    if (kept->data || (kind == MAP_SPECULAR && !(l->albedo.data && strcmp(prefix, l->prefix) == 0)))
        return;
    if (kind == MAP_ALBEDO)
        memcpy(l->prefix, prefix, sizeof l->prefix);
    *kept = *image;
    *image = (weft_image){0};
}

static void lint_kind(linter *l, map_kind kind, bool is_coded, weft_image *image)
{
    const weft_lint lint = {note, l};
    switch (kind) {
    case MAP_NORMAL:
        if (image->planes != 3) {
            note(l, WEFT_LINT_WRONG, "channels", "a normal map has three");
            break;
        }
        for (size_t i = 0; is_coded && i < 3 * weft_image_plane_size(image); i++)
            image->data[i] = 2 * image->data[i] - 1;
        weft_lint_normal(&lint, image);
        break;
    case MAP_ALBEDO:
        weft_lint_albedo(&lint, image);
        break;
    case MAP_SPECULAR:
        weft_lint_specular(&lint, image);
        break;
    case MAP_SCALAR:
        weft_lint_scalar(&lint, image);
        break;
    case MAP_OTHER:
        break;
    }
}

static void lint_size(linter *l, const weft_image *image)
{
    if (l->width && (image->width != l->width || image->height != l->height)) {
        char text[128];
        (void)snprintf(text, sizeof text, "%d x %d, but the first map of the set is %d x %d", image->width,
                       image->height, l->width, l->height);
        note(l, WEFT_LINT_WRONG, "same size", text);
    }
    l->width = l->width ? l->width : image->width;
    l->height = l->height ? l->height : image->height;
}

static weft_err lint_file(linter *l, const char *path, weft_error *err)
{
    static const weft_transfer transfers[] = {[MAP_ALBEDO] = WEFT_TRANSFER_SRGB,
                                              [MAP_SPECULAR] = WEFT_TRANSFER_BY_BITS,
                                              [MAP_OTHER] = WEFT_TRANSFER_LINEAR};
    const weft_lint lint = {note, l};
    char prefix[LONGEST_NAME];
    const map_kind kind = kind_of(path, prefix);
    weft_image image;
    l->file = path;
    WEFT_TRY(weft_image_read(path, transfers[kind], &image, err));
    weft_lint_picture(&lint, &image);
    lint_size(l, &image);
    lint_kind(l, kind, !weft_path_has_suffix(path, ".exr"), &image);
    if (kind == MAP_ALBEDO || kind == MAP_SPECULAR) {
        const bool had = l->specular.data;
        keep(l, kind, prefix, &image);
        if (!had && l->specular.data && l->specular.width == l->albedo.width &&
            l->specular.height == l->albedo.height)
            weft_lint_specular_pair(&lint, &l->albedo, &l->specular);
    }
    weft_image_fini(&image);
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
    weft_image_fini(&l.albedo);
    weft_image_fini(&l.specular);
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
               "basecolor, roughness, "
               "height, ...).  Exits 1 when something is wrong.",
    .example = "weft lint downloaded-fabric/",
    .run = run,
};
