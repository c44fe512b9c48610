#include "host/set/plate.h"

#include "core/file.h"
#include "core/formats/png_file.h"
#include "core/mem.h"
#include "core/parallel.h"
#include "host/set/bracket.h"
#include "host/set/frame_file.h"

#include <math.h>

void weft_plate_fini(weft_plate *plate)
{
    weft_image_fini(&plate->image);
    weft_mask_fini(&plate->clipped);
    *plate = (weft_plate){0};
}

static int site_step(weft_cfa cfa)
{
    return cfa == WEFT_CFA_NONE ? 1 : 2;
}

weft_err weft_plate_load_frame(const weft_set *set, int frame, weft_plate *plate, weft_error *err)
{
    weft_plate loaded = {.cfa = set->cfa};
    WEFT_TRY(weft_frame_read(set, frame, 1 / weft_set_frame_time(&set->frames[frame]), &loaded.image,
                             &loaded.clipped, err));
    loaded.noise_floor = weft_noise_floor(&loaded.image, site_step(set->cfa));
    *plate = loaded;
    return WEFT_OK;
}

/* All frames of a role (and light), merged.  `*n_found` 0: there is none, and the plate is untouched. */
static weft_err load_role(const weft_set *set, weft_frame_role role, int light, weft_plate *plate,
                          int *n_found, weft_error *err)
{
    int *const frames = weft_alloc((size_t)set->n_frames + 1, sizeof *frames, err);
    int n = 0;
    if (!frames)
        return WEFT_ERR_NOMEM;
    for (int i = 0; i < set->n_frames; i++)
        if (set->frames[i].role == role && (role != WEFT_ROLE_LIGHT || set->frames[i].light == light))
            frames[n++] = i;
    weft_err status = WEFT_OK;
    if (n == 1)
        status = weft_plate_load_frame(set, frames[0], plate, err);
    else if (n > 1)
        status = weft_bracket_merge(set, frames, n, plate, err);
    weft_free(frames);
    *n_found = n;
    return status;
}

/* ---- what others call ---- */

typedef struct difference {
    weft_plate *plate;
    const weft_plate *ambient;
} difference;

static void subtract_rows(void *context, int band, int row_begin, int row_end)
{
    const difference *const d = context;
    const weft_image *const a = &d->plate->image, *const b = &d->ambient->image;
    const size_t begin = (size_t)row_begin * (size_t)a->width, end = (size_t)row_end * (size_t)a->width;
    (void)band;
    for (int p = 0; p < a->planes; p++) {
        float *const from = weft_image_plane(a, p);
        const float *const what = weft_image_plane(b, p);
        for (size_t i = begin; i < end; i++)
            from[i] -= what[i];
    }
    for (size_t i = begin; i < end; i++)
        d->plate->clipped.data[i] |= d->ambient->clipped.data[i];
}

static weft_err subtract(weft_plate *plate, const weft_plate *ambient, const weft_set *set, weft_error *err)
{
    const weft_image *const a = &plate->image, *const b = &ambient->image;
    if (a->width != b->width || a->height != b->height || a->planes != b->planes ||
        plate->cfa != ambient->cfa)
        return weft_fail(err, WEFT_ERR_MISMATCH,
                         "%s: the ambient plate is %d x %d x %d, the light %d x %d x %d", set->folder,
                         b->width, b->height, b->planes, a->width, a->height, a->planes);
    difference d = {plate, ambient};
    weft_parallel_rows(a->height, subtract_rows, &d);
    return WEFT_OK;
}

/* A lit frame shows its noise floor only where it is dark; the ambient frames show it everywhere. */
static double floor_from_ambient(const weft_set *set, const weft_plate *ambient, int light)
{
    double ambient_t2 = 0, light_t2 = 0;
    for (int i = 0; i < set->n_frames; i++) {
        const double time = weft_set_frame_time(&set->frames[i]);
        if (set->frames[i].role == WEFT_ROLE_AMBIENT)
            ambient_t2 += time * time;
        else if (set->frames[i].role == WEFT_ROLE_LIGHT && set->frames[i].light == light)
            light_t2 += time * time;
    }
    return ambient->noise_floor * sqrt(ambient_t2 / light_t2);
}

weft_err weft_plate_load_light(const weft_set *set, int light, const weft_plate *ambient, weft_plate *plate,
                               weft_error *err)
{
    weft_plate loaded = {0};
    int n = 0;
    WEFT_TRY(load_role(set, WEFT_ROLE_LIGHT, light, &loaded, &n, err));
    if (n == 0)
        return weft_fail(err, WEFT_ERR_MISSING,
                         "%s: light %d has no frame; take it with weft capture --resume %s", set->folder,
                         light, set->folder);
    if (ambient) {
        const weft_err status = subtract(&loaded, ambient, set, err);
        if (status != WEFT_OK) {
            weft_plate_fini(&loaded);
            return status;
        }
        const double read = floor_from_ambient(set, ambient, light);
        if (read > 0 && (loaded.noise_floor <= 0 || read < loaded.noise_floor))
            loaded.noise_floor = read;
        loaded.noise_floor = hypot(loaded.noise_floor, ambient->noise_floor);
    }
    *plate = loaded;
    return WEFT_OK;
}

weft_err weft_plate_load_ambient(const weft_set *set, weft_plate *plate, bool *present, weft_error *err)
{
    int n = 0;
    weft_plate loaded = {0};
    WEFT_TRY(load_role(set, WEFT_ROLE_AMBIENT, -1, &loaded, &n, err));
    *present = n > 0;
    *plate = loaded;
    return WEFT_OK;
}

weft_err weft_set_load_mask(const weft_set *set, weft_mask *mask, weft_error *err)
{
    if (!set->mask_file)
        return weft_mask_init(mask, set->width, set->height, 255, err);
    char *const path = weft_path_join(set->folder, set->mask_file, err);
    if (!path)
        return WEFT_ERR_NOMEM;
    weft_mask loaded = {0};
    weft_err status = weft_png_read_mask(path, &loaded, err);
    if (status == WEFT_OK && (loaded.width != set->width || loaded.height != set->height))
        status = weft_fail(err, WEFT_ERR_MISMATCH, "%s: the mask is %d x %d, the set's frames are %d x %d",
                           path, loaded.width, loaded.height, set->width, set->height);
    weft_free(path);
    if (status == WEFT_OK)
        *mask = loaded;
    else
        weft_mask_fini(&loaded);
    return status;
}
