/* The maps with their mips on disk: written where their texels changed, kept else. */
#include "shading/material/build_private.h"

#include "core/file.h"
#include "core/mem.h"
#include "shading/bake/material_file.h"
#include "shading/material/build_key.h"

#include <stdio.h>

enum { FILE_VERSION = 1 }; /* raised when the code changes what it writes */

static bool is_lobe(const weft_builder *b, weft_baked_kind kind)
{
    return (kind == WEFT_BAKED_CLOTH_ROUGHNESS && b->baked.two_lobes) || kind == WEFT_BAKED_NORMAL ||
           kind == WEFT_BAKED_ROUGHNESS || kind == WEFT_BAKED_ANISOTROPY || kind == WEFT_BAKED_NORMAL_LENGTH;
}

/* Normals and roughness are filtered together: their files have one key. */
static void key_file(const weft_builder *b, weft_baked_kind kind, char hex[65])
{
    weft_build_key key = weft_build_key_begin(weft_baked_rows[kind].name, FILE_VERSION);
    if (is_lobe(b, kind)) {
        weft_build_key_text(&key, "normal", b->texels[WEFT_BAKED_NORMAL]);
        weft_build_key_text(&key, "roughness", b->texels[WEFT_BAKED_ROUGHNESS]);
        weft_build_key_text(&key, "anisotropy", b->texels[WEFT_BAKED_ANISOTROPY]);
        if (b->baked.two_lobes)
            weft_build_key_text(&key, "cloth_roughness", b->texels[WEFT_BAKED_CLOTH_ROUGHNESS]);
        weft_build_key_number(&key, "rule", b->options->mips.rule);
    } else {
        weft_build_key_text(&key, "texels", b->texels[kind]);
        weft_build_key_number(&key, "coverage",
                              kind == WEFT_BAKED_OPACITY ? b->options->mips.coverage_at : 0);
    }
    weft_build_key_end(&key, hex);
}

static void drop(weft_baked *baked, weft_baked_kind kind)
{
    for (int level = 0; level < WEFT_BAKED_MAX_MIPS; level++)
        weft_image_fini(&baked->maps[kind].mips[level]);
}

bool weft_builder_file_is_there(const weft_builder *b, weft_baked_kind kind)
{
    char *const path = weft_asprintf(NULL, "%s/%s.exr", b->options->folder, weft_baked_rows[kind].name);
    const bool there = path && weft_file_exists(path);
    weft_free(path);
    return there;
}

bool weft_builder_file_is_current(const weft_builder *b, weft_baked_kind kind)
{
    char key[65];
    key_file(b, kind, key);
    return weft_builder_is_current(b, weft_baked_rows[kind].name, key) && weft_builder_file_is_there(b, kind);
}

/* The mean of a map that stays on disk and is not read again. */
static void recall_mean(weft_builder *b, weft_baked_kind kind)
{
    const json_t *const maps = json_object_get(b->old, "maps");
    const json_t *const mean = json_object_get(json_object_get(maps, weft_baked_rows[kind].name), "constant");
    for (size_t p = 0; b->baked.maps[kind].n_mips > 0 && p < json_array_size(mean) && p < 4; p++)
        b->baked.maps[kind].constant[p] = (float)json_number_value(json_array_get(mean, p));
}

weft_err weft_builder_write_maps(weft_builder *b, weft_error *err)
{
    bool stale[WEFT_BAKED_COUNT], lobe_stale = false;
    char keys[WEFT_BAKED_COUNT][65];
    weft_baked *const baked = &b->baked;
    const bool bumpy = baked->maps[WEFT_BAKED_NORMAL].n_mips > 0;
    for (int k = 0; k < WEFT_BAKED_COUNT; k++) {
        const weft_baked_kind kind = (weft_baked_kind)k;
        const bool wanted =
            baked->maps[k].n_mips > 0 || (bumpy && is_lobe(b, kind) && kind != WEFT_BAKED_ANISOTROPY);
        key_file(b, kind, keys[k]);
        stale[k] = wanted && !weft_builder_file_is_current(b, kind);
        lobe_stale = lobe_stale || (stale[k] && is_lobe(b, kind));
    }
    const int levels = weft_baked_levels(baked->width, baked->height);
    for (int k = 0; k < WEFT_BAKED_COUNT; k++) { /* what is current needs no texels any more */
        const weft_baked_kind kind = (weft_baked_kind)k;
        stale[k] = stale[k] || (is_lobe(b, kind) && lobe_stale && bumpy && baked->maps[k].n_mips > 0);
        if (!stale[k] && !(is_lobe(b, kind) && lobe_stale)) {
            drop(baked, kind);
            recall_mean(b, kind);
            b->result->kept += baked->maps[k].n_mips > 0;
            if (baked->maps[k].n_mips > 0)
                weft_builder_note(b, weft_baked_rows[k].name, "kept", "its texels are as they were");
        }
    }
    bool had[WEFT_BAKED_COUNT];
    for (int k = 0; k < WEFT_BAKED_COUNT; k++) { /* the mip maker sees only what it shall make */
        had[k] = baked->maps[k].n_mips > 0;
        if (!baked->maps[k].mips[0].data)
            baked->maps[k].n_mips = 0;
    }
    weft_mip_options mips = b->options->mips;
    mips.max_levels = 0;
    weft_builder_note(b, "mips", "rebuilt", "of the maps below");
    WEFT_TRY(weft_mips_make(baked, &mips, err));
    const char *written[WEFT_BAKED_COUNT + 2] = {"composite"};
    int n_written = 1;
    for (int k = 0; k < WEFT_BAKED_COUNT; k++)
        if (baked->maps[k].mips[0].data)
            written[n_written++] = weft_baked_rows[k].name;
    if (n_written > 1)
        WEFT_TRY(weft_builder_begin(b, written, err));
    for (int k = 0; k < WEFT_BAKED_COUNT; k++) {
        const weft_baked_kind kind = (weft_baked_kind)k;
        if (!baked->maps[k].mips[0].data) {
            baked->maps[k].n_mips =
                had[k] || (bumpy && is_lobe(b, kind) && kind != WEFT_BAKED_ANISOTROPY) ? levels : 0;
            continue;
        }
        weft_builder_note(b, weft_baked_rows[k].name, "rebuilt", "its texels changed");
        WEFT_TRY(weft_material_save_map(b->options->folder, baked, kind, err));
        b->result->rebuilt++;
        drop(baked, kind);
        WEFT_TRY(weft_builder_finish(b, weft_baked_rows[k].name, keys[k], err));
    }
    return WEFT_OK;
}

void weft_builder_remove_leftovers(weft_builder *b)
{
    for (int k = 0; k < WEFT_BAKED_COUNT; k++) {
        if (b->baked.maps[k].n_mips > 0)
            continue;
        char *const path = weft_asprintf(NULL, "%s/%s.exr", b->options->folder, weft_baked_rows[k].name);
        if (path && weft_file_exists(path))
            (void)remove(path);
        weft_free(path);
        json_object_del(b->keys, weft_baked_rows[k].name);
    }
}
