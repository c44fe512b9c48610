#include "shading/export/map_read.h"

#include "core/file.h"
#include "core/formats/exr_file.h"
#include "core/formats/image_file.h"
#include "core/mem.h"

#include <string.h>

/* -- the name ----------------------------------------------------------------------------------------- */

/* Words found anywhere, the first that fits; short ones must stand alone between _ - . digits. */
static const struct {
    const char *word;
    weft_map_kind kind;
    bool is_alone;
} words[] = {
    {"normal_length", WEFT_MAP_SCALAR, false},
    {"normal", WEFT_MAP_NORMAL, false},
    {"nrm", WEFT_MAP_NORMAL, false},
    {"nml", WEFT_MAP_NORMAL, false},
    {"nor", WEFT_MAP_NORMAL, true},
    {"n", WEFT_MAP_NORMAL, true},
    {"albedo", WEFT_MAP_ALBEDO, false},
    {"basecolor", WEFT_MAP_ALBEDO, false},
    {"base_color", WEFT_MAP_ALBEDO, false},
    {"diffuse", WEFT_MAP_ALBEDO, false},
    {"diff", WEFT_MAP_ALBEDO, true},
    {"color", WEFT_MAP_ALBEDO, true},
    {"colour", WEFT_MAP_ALBEDO, true},
    {"col", WEFT_MAP_ALBEDO, true},
    {"specular", WEFT_MAP_SPECULAR, false},
    {"f0", WEFT_MAP_SPECULAR, true},
    {"rough", WEFT_MAP_ROUGHNESS, false},
    {"gloss", WEFT_MAP_ROUGHNESS, false},
    {"smoothness", WEFT_MAP_ROUGHNESS, false},
    {"occlusion", WEFT_MAP_SCALAR, false},
    {"ao", WEFT_MAP_SCALAR, true},
    {"height", WEFT_MAP_SCALAR, false},
    {"bump", WEFT_MAP_SCALAR, false},
    {"displacement", WEFT_MAP_SCALAR, false},
    {"disp", WEFT_MAP_SCALAR, true},
    {"metal", WEFT_MAP_SCALAR, false},
};

static bool is_letter(char c)
{
    return c >= 'a' && c <= 'z';
}

static const char *find_word(const char *name, const char *word, bool is_alone)
{
    const size_t n = strlen(word);
    for (const char *at = strstr(name, word); at; at = strstr(at + 1, word))
        if (!is_alone || ((at == name || !is_letter(at[-1])) && !is_letter(at[n])))
            return at;
    return NULL;
}

weft_map_kind weft_map_kind_of(const char *path, char prefix[WEFT_MAP_LONGEST_NAME])
{
    char name[WEFT_MAP_LONGEST_NAME];
    const char *const from = weft_path_name(path), *const dot = strrchr(from, '.');
    size_t n = 0;
    for (; from[n] && from + n != dot && n + 1 < sizeof name; n++)
        name[n] = from[n] >= 'A' && from[n] <= 'Z' ? (char)(from[n] + 32) : from[n];
    name[n] = '\0';
    memset(prefix, 0, WEFT_MAP_LONGEST_NAME);
    for (size_t i = 0; i < sizeof words / sizeof words[0]; i++) {
        const char *const at = find_word(name, words[i].word, words[i].is_alone);
        if (at) {
            memcpy(prefix, name, (size_t)(at - name));
            return words[i].kind;
        }
    }
    return WEFT_MAP_OTHER;
}

/* -- the numbers -------------------------------------------------------------------------------------- */

/* Colour, vectors, grey, or whatever channel comes first. */
static weft_err read_exr(const char *path, weft_map *map, weft_error *err)
{
    static const char *const three[] = {"R|X", "G|Y", "B|Z"}, *const grey[] = {"Y"};
    char *channels = NULL;
    weft_error ignored = {0};
    int n = 3;
    const char *const *names = three;
    WEFT_TRY(weft_exr_channels(path, &channels, err));
    channels[strcspn(channels, ",")] = '\0';
    const char *const first[] = {channels};
    weft_err status = weft_exr_read(path, three, 3, &map->levels[0], &ignored);
    for (int i = 0; i < 2 && status == WEFT_ERR_MISSING; i++) {
        names = i == 0 ? grey : first;
        n = 1;
        ignored = (weft_error){0};
        status = weft_exr_read(path, names, n, &map->levels[0], &ignored);
    }
    if (status != WEFT_OK && err)
        *err = ignored;
    map->n_levels = status == WEFT_OK;
    int n_levels = 1;
    if (status == WEFT_OK)
        status = weft_exr_levels(path, &n_levels, err);
    for (int level = 1; level < n_levels && level < 16 && status == WEFT_OK; level++) {
        status = weft_exr_read_level(path, names, n, level, &map->levels[level], err);
        map->n_levels += status == WEFT_OK;
    }
    weft_free(channels);
    return status;
}

/* Vectors have signs: a file of floats without a negative number in x and y holds codes, as integers do. */
static bool looks_coded(const weft_image *normals)
{
    for (size_t i = 0; i < 2 * weft_image_plane_size(normals); i++)
        if (normals->data[i] < 0)
            return false;
    for (size_t i = 0; i < 2 * weft_image_plane_size(normals); i++)
        if (normals->data[i] > 0.25F) /* a flat map of vectors is 0, one of codes 0.5 */
            return true;
    return false;
}

static void decode_normals(weft_map *map)
{
    for (int level = 0; level < map->n_levels; level++)
        for (size_t i = 0; i < 3 * weft_image_plane_size(&map->levels[level]); i++)
            map->levels[level].data[i] = 2 * map->levels[level].data[i] - 1;
}

weft_err weft_map_read(const char *path, weft_map *map, weft_error *err)
{
    static const weft_transfer transfers[] = {[WEFT_MAP_ALBEDO] = WEFT_TRANSFER_SRGB,
                                              [WEFT_MAP_SPECULAR] = WEFT_TRANSFER_BY_BITS,
                                              [WEFT_MAP_OTHER] = WEFT_TRANSFER_LINEAR};
    weft_err status;
    *map = (weft_map){0};
    map->kind = weft_map_kind_of(path, map->prefix);
    if (!weft_file_exists(path))
        return weft_fail(err, WEFT_ERR_MISSING, "%s: is not there, or is no file", path);
    if (weft_path_has_suffix(path, ".exr")) {
        status = read_exr(path, map, err);
    } else {
        status = weft_image_read(path, transfers[map->kind], &map->levels[0], err);
        map->n_levels = status == WEFT_OK;
    }
    if (status != WEFT_OK) {
        weft_map_fini(map);
        return status;
    }
    map->is_coded = map->kind == WEFT_MAP_NORMAL && map->levels[0].planes == 3 &&
                    (!weft_path_has_suffix(path, ".exr") || looks_coded(&map->levels[0]));
    if (map->is_coded)
        decode_normals(map);
    return WEFT_OK;
}

void weft_map_fini(weft_map *map)
{
    for (size_t level = 0; level < sizeof map->levels / sizeof map->levels[0]; level++)
        weft_image_fini(&map->levels[level]);
    *map = (weft_map){0};
}
