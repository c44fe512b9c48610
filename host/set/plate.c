#include "host/set/plate.h"

#include "core/file.h"
#include "core/formats/png_file.h"
#include "core/mem.h"
#include "core/parallel.h"
#include "host/set/frame_file.h"
#include "host/set/noise.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

void weft_plate_fini(weft_plate *plate)
{
    weft_image_fini(&plate->image);
    weft_mask_fini(&plate->clipped);
    *plate = (weft_plate){0};
}

static double frame_time(const weft_set_frame *frame)
{
    return frame->exposure_s * frame->gain;
}

static int site_step(weft_cfa cfa)
{
    return cfa == WEFT_CFA_NONE ? 1 : 2;
}

weft_err weft_plate_load_frame(const weft_set *set, int frame, weft_plate *plate, weft_error *err)
{
    weft_plate loaded = {.cfa = set->cfa};
    WEFT_TRY(weft_frame_read(set, frame, 1 / frame_time(&set->frames[frame]), &loaded.image, &loaded.clipped,
                             err));
    loaded.noise_floor = weft_noise_floor(&loaded.image, site_step(set->cfa));
    *plate = loaded;
    return WEFT_OK;
}

/* ---- merging a bracket ---- */

/* Sums over the frames of one light, longest exposure first.  The first unclipped value of a pixel decides
 * the weights of all its values: were each weighted by itself, dark outliers would count more. */
typedef struct merge {
    weft_image value;  /* plane by plane: sum of w x */
    weft_image weight; /* sum of w */
    weft_image first;  /* x of the longest unclipped exposure */
    weft_noise noise;
    const weft_plate *plate; /* the frame that is being added */
    double time;
    double sum_time_squares; /* of all frames */
    double read;             /* standard deviation of the read noise as a fraction of full scale */
} merge;

static weft_err merge_init(merge *m, const weft_image *like, weft_error *err)
{
    WEFT_TRY(weft_image_init(&m->value, like->width, like->height, like->planes, err));
    WEFT_TRY(weft_image_init(&m->weight, like->width, like->height, like->planes, err));
    return weft_image_init(&m->first, like->width, like->height, like->planes, err);
}

static void merge_fini(merge *m)
{
    weft_image_fini(&m->value);
    weft_image_fini(&m->weight);
    weft_image_fini(&m->first);
}

/* Inverse variance of x: time^2 / (read + shot x time). */
static void add_rows(void *context, int band, int row_begin, int row_end)
{
    merge *const m = context;
    const size_t width = (size_t)m->value.width;
    const float t2 = (float)(m->time * m->time);
    const float read = (float)m->noise.read, shot_time = (float)(m->noise.shot * m->time);
    (void)band;
    for (int p = 0; p < m->value.planes; p++)
        for (int v = row_begin; v < row_end; v++) {
            const float *const x = weft_image_row(&m->plate->image, p, v);
            const uint8_t *const clipped = m->plate->clipped.data + (size_t)v * width;
            float *const value = weft_image_row(&m->value, p, v), *const weight =
                                                                      weft_image_row(&m->weight, p, v);
            float *const first = weft_image_row(&m->first, p, v);
            for (size_t u = 0; u < width; u++) {
                const float reference = weight[u] > 0 ? first[u] : x[u];
                const float w = clipped[u] ? 0 : t2 / (read + shot_time * (reference > 0 ? reference : 0));
                first[u] = reference;
                value[u] += w * x[u];
                weight[u] += w;
            }
        }
}

static void merge_add(merge *m, const weft_plate *plate, double time)
{
    m->plate = plate;
    m->time = time;
    m->sum_time_squares += time * time;
    weft_parallel_rows(m->value.height, add_rows, m);
}

/* Divides, and takes pixels that no exposure holds from `shortest`: saturated, but the best there is. */
static void merge_finish(merge *m, weft_plate *shortest)
{
    const size_t n = weft_image_plane_size(&m->value), all = n * (size_t)m->value.planes;
    for (size_t i = 0; i < all; i++)
        if (m->weight.data[i] > 0)
            shortest->image.data[i] = m->value.data[i] / m->weight.data[i];
    for (size_t i = 0; i < n; i++)
        shortest->clipped.data[i] = m->weight.data[i] > 0 ? 0 : 255;
}

typedef struct listed {
    int frame;
    double time;
} listed;

static int longest_first(const void *a, const void *b)
{
    const double x = ((const listed *)a)->time, y = ((const listed *)b)->time;
    if (x != y)
        return x < y ? 1 : -1;
    return ((const listed *)a)->frame - ((const listed *)b)->frame;
}

/* Weights where the pictures do not tell their noise: shot noise rules all but the darkest hundredth, as on
 * any sensor.  Wrong weights cost a little noise and no bias. */
static const weft_noise fallback_noise = {1e-6, 1e-4};

static weft_err merge_frames(const weft_set *set, const listed *frames, int n, weft_plate *plate,
                             weft_error *err)
{
    merge m = {.noise = fallback_noise};
    weft_plate now = {0}, next = {0};
    weft_err status = weft_plate_load_frame(set, frames[0].frame, &now, err);
    if (status == WEFT_OK)
        status = merge_init(&m, &now.image, err);
    for (int i = 0; i < n && status == WEFT_OK; i++) {
        if (i + 1 < n && (status = weft_plate_load_frame(set, frames[i + 1].frame, &next, err)) != WEFT_OK)
            break;
        if (i == 0) {
            m.read = now.noise_floor * frames[0].time; /* an upper bound */
            if (weft_noise_fit(&now.image, frames[0].time, &now.clipped, &next.image, frames[1].time,
                               &next.clipped, &m.noise) &&
                m.noise.read > 0)
                m.read = fmin(m.read, sqrt(m.noise.read));
            m.noise.read = fmax(m.noise.read, 1e-10); /* finer than 16 bits can say; keeps weights finite */
        }
        merge_add(&m, &now, frames[i].time);
        if (i + 1 < n) {
            weft_plate_fini(&now);
            now = next;
            next = (weft_plate){0};
        }
    }
    if (status == WEFT_OK) {
        merge_finish(&m, &now);
        now.noise_floor = m.read / sqrt(m.sum_time_squares);
        *plate = now;
        now = (weft_plate){0};
    }
    merge_fini(&m);
    weft_plate_fini(&now);
    weft_plate_fini(&next);
    return status;
}

/* All frames of a role (and light), merged.  `*n_found` 0: there is none, and the plate is untouched. */
static weft_err load_role(const weft_set *set, weft_frame_role role, int light, weft_plate *plate,
                          int *n_found, weft_error *err)
{
    listed *const frames = weft_alloc((size_t)set->n_frames, sizeof *frames, err);
    int n = 0;
    if (!frames)
        return WEFT_ERR_NOMEM;
    for (int i = 0; i < set->n_frames; i++)
        if (set->frames[i].role == role && (role != WEFT_ROLE_LIGHT || set->frames[i].light == light))
            frames[n++] = (listed){i, frame_time(&set->frames[i])};
    qsort(frames, (size_t)n, sizeof *frames, longest_first);
    weft_err status = WEFT_OK;
    if (n == 1)
        status = weft_plate_load_frame(set, frames[0].frame, plate, err);
    else if (n > 1)
        status = merge_frames(set, frames, n, plate, err);
    weft_free(frames);
    *n_found = n;
    return status;
}

/* ---- what others call ---- */

static weft_err subtract(weft_plate *plate, const weft_plate *ambient, const weft_set *set, weft_error *err)
{
    const weft_image *const a = &plate->image, *const b = &ambient->image;
    if (a->width != b->width || a->height != b->height || a->planes != b->planes ||
        plate->cfa != ambient->cfa)
        return weft_fail(err, WEFT_ERR_MISMATCH,
                         "%s: the ambient plate is %d x %d x %d, the light %d x %d x %d", set->folder,
                         b->width, b->height, b->planes, a->width, a->height, a->planes);
    const size_t n = weft_image_plane_size(a);
    for (size_t i = 0; i < n * (size_t)a->planes; i++)
        a->data[i] -= b->data[i];
    for (size_t i = 0; i < n; i++)
        plate->clipped.data[i] |= ambient->clipped.data[i];
    return WEFT_OK;
}

/* A lit frame shows its noise floor only where it is dark; the ambient frames show it everywhere. */
static double floor_from_ambient(const weft_set *set, const weft_plate *ambient, int light)
{
    double ambient_t2 = 0, light_t2 = 0;
    for (int i = 0; i < set->n_frames; i++) {
        const double time = frame_time(&set->frames[i]);
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
