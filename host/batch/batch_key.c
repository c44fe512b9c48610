/* What the maps of a set follow from, as one hash. */
#include "host/batch/batch.h"

#include "calibration/calibration.h"
#include "calibration/calibration_grid.h"
#include "core/file.h"
#include "core/mem.h"
#include "core/sha256.h"
#include "core/version.h"
#include "host/set/set.h"

#include <stdlib.h>
#include <string.h>

/* With the NUL, so that no two lists of words give the same bytes. */
static void add_text(weft_sha256 *hash, const char *text)
{
    weft_sha256_update(hash, text, strlen(text) + 1);
}

static weft_err add_file(weft_sha256 *hash, const char *folder, const char *name, weft_error *err)
{
    char hex[65];
    char *const path = weft_path_join(folder, name, err);
    const weft_err status = path ? weft_sha256_file(path, hex, err) : WEFT_ERR_NOMEM;
    weft_free(path);
    if (status == WEFT_OK)
        add_text(hash, hex);
    return status;
}

static int compare_words(const void *a, const void *b)
{
    return strcmp(*(const char *const *)a, *(const char *const *)b);
}

static weft_err add_options(weft_sha256 *hash, const char *const *options, int n, weft_error *err)
{
    const char **const sorted = weft_alloc((size_t)n, sizeof *sorted, err);
    if (!sorted)
        return WEFT_ERR_NOMEM;
    for (int i = 0; i < n; i++)
        sorted[i] = options[i];
    qsort(sorted, (size_t)n, sizeof *sorted, compare_words);
    for (int i = 0; i < n; i++)
        add_text(hash, sorted[i]);
    weft_free(sorted);
    return WEFT_OK;
}

static weft_err add_calibration(weft_sha256 *hash, const char *folder, weft_error *err)
{
    weft_calibration cal;
    WEFT_TRY(weft_calibration_load(folder, &cal, err));
    const weft_err status = add_file(hash, folder, "calibration.json", err);
    if (cal.grid.gain)
        weft_sha256_update(hash, cal.grid.gain, weft_calibration_grid_size(&cal) * sizeof *cal.grid.gain);
    weft_calibration_fini(&cal);
    return status;
}

static weft_err add_frames(weft_sha256 *hash, const weft_set *set, weft_error *err)
{
    for (int i = 0; i < set->n_frames; i++) {
        const weft_set_frame *const f = &set->frames[i];
        add_text(hash, f->file);
        if (f->sha256[0])
            add_text(hash, f->sha256);
        else
            WEFT_TRY(add_file(hash, set->folder, f->file, err));
    }
    return set->mask_file ? add_file(hash, set->folder, set->mask_file, err) : WEFT_OK;
}

/* A float and a byte per site and light, and about forty floats per pixel for maps, plane and bounce. */
static double memory_of(const weft_set *set)
{
    return (double)set->width * set->height * (5.0 * weft_set_n_lights(set) + 160);
}

weft_err weft_batch_key(const char *set_folder, const char *calibration, const char *const *options,
                        int n_options, char key[65], double *memory, weft_error *err)
{
    weft_set set;
    weft_sha256 hash;
    WEFT_TRY(weft_set_load(set_folder, &set, err));
    weft_sha256_init(&hash);
    add_text(&hash, "weft batch 1, weft " WEFT_VERSION);
    weft_err status = add_options(&hash, options, n_options, err);
    if (status == WEFT_OK)
        status = add_calibration(&hash, calibration, err);
    if (status == WEFT_OK)
        status = add_file(&hash, set.folder, "set.json", err);
    if (status == WEFT_OK)
        status = add_frames(&hash, &set, err);
    weft_sha256_final_hex(&hash, key);
    if (memory)
        *memory = memory_of(&set);
    weft_set_fini(&set);
    return status;
}
