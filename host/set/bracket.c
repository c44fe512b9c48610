#include "host/set/bracket.h"

#include "core/mem.h"
#include "core/mem_limit.h"
#include "core/parallel.h"

#include <math.h>
#include <stdlib.h>

/* Weights where the pictures do not tell their noise: shot noise rules all but the darkest hundredth, as on
 * any sensor.  Wrong weights cost a little noise and no bias. */
static const weft_noise fallback_noise = {1e-6, 1e-4};

/* Finer than 16 bits can say; keeps weights finite. */
#define LEAST_READ 1e-10

/* Sums over the frames, longest exposure first. */
typedef struct merge {
    weft_image value;                  /* plane by plane: sum of w x */
    weft_image weight;                 /* sum of w */
    weft_image first;                  /* x of the longest exposure that counts */
    weft_noise noise;                  /* of a single frame */
    const weft_plate *plate, *shorter; /* the frame that is being added; the next, NULL: has no say */
    double time, mean_of;              /* of `plate` */
    double shorter_time, shorter_mean_of;
    double sum_time_squares; /* of all frames */
    double read;             /* deviation of the read noise as a fraction of full scale */
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

static void add_rows(void *context, int band, int row_begin, int row_end)
{
    merge *const m = context;
    const size_t width = (size_t)m->value.width;
    const float t2 = (float)(m->mean_of * m->time * m->time);
    const float read = (float)m->noise.read, shot_time = (float)(m->noise.shot * m->time);
    const float below_t2 = (float)(m->shorter_mean_of * m->shorter_time * m->shorter_time);
    const float below_shot_time = (float)(m->noise.shot * m->shorter_time);
    const float limit = (float)(WEFT_BRACKET_LIMIT / m->time);
    (void)band;
    for (int p = 0; p < m->value.planes; p++)
        for (int v = row_begin; v < row_end; v++) {
            const float *const x = weft_image_row(&m->plate->image, p, v);
            const float *const below = m->shorter ? weft_image_row(&m->shorter->image, p, v) : NULL;
            const uint8_t *const clipped = m->plate->clipped.data + (size_t)v * width;
            float *const value = weft_image_row(&m->value, p, v);
            float *const weight = weft_image_row(&m->weight, p, v);
            float *const first = weft_image_row(&m->first, p, v);
            for (size_t u = 0; u < width; u++) {
                const float reference = weight[u] > 0 ? first[u] : x[u];
                const float light = reference > 0 ? reference : 0;
                const float w = t2 / (read + shot_time * light);
                const float w_below = below ? below_t2 / (read + below_shot_time * light) : 0;
                const float both = below ? w * x[u] + w_below * below[u] : w * x[u];
                const bool counts = !clipped[u] && !(below && both > limit * (w + w_below));
                first[u] = reference;
                value[u] += counts ? w * x[u] : 0;
                weight[u] += counts ? w : 0;
            }
        }
}

/* Divides, and takes photosites that no exposure holds from `shortest`: saturated, but the best there is. */
static void merge_finish(merge *m, weft_plate *shortest)
{
    const size_t n = weft_image_plane_size(&m->value), width = (size_t)m->value.width;
    const size_t rows = (size_t)m->value.height * (size_t)m->value.planes;
    for (size_t v = 0; v < rows; v++, weft_mem_trim())
        for (size_t i = v * width; i < (v + 1) * width; i++)
            if (m->weight.data[i] > 0)
                shortest->image.data[i] = m->value.data[i] / m->weight.data[i];
    for (size_t i = 0; i < n; i++)
        shortest->clipped.data[i] = m->weight.data[i] > 0 ? 0 : 255;
}

/* ---- noise ---- */

typedef struct listed {
    int frame;
    double time, mean_of;
} listed;

static int longest_first(const void *a, const void *b)
{
    const double x = ((const listed *)a)->time, y = ((const listed *)b)->time;
    if (x != y)
        return x < y ? 1 : -1;
    return ((const listed *)a)->frame - ((const listed *)b)->frame;
}

static listed *sort_frames(const weft_set *set, const int *frames, int n, weft_error *err)
{
    listed *const list = weft_alloc((size_t)n, sizeof *list, err);
    for (int i = 0; i < n && list; i++) {
        const weft_set_frame *const f = &set->frames[frames[i]];
        list[i] = (listed){frames[i], weft_set_frame_time(f), weft_set_frame_mean_of(f)};
    }
    if (list)
        qsort(list, (size_t)n, sizeof *list, longest_first);
    return list;
}

/* What the set recorded, where it is of these frames' gain. */
static bool recorded_noise(const weft_set *set, const listed *list, int n, weft_noise *noise)
{
    for (int i = 0; i < n; i++)
        if (fabs(set->frames[list[i].frame].gain - set->noise_gain) > 1e-6 * set->noise_gain)
            return false;
    *noise = set->noise;
    return set->noise_gain > 0;
}

/* Of a single frame, by two plates that are the mean of as many frames each. */
static bool fit_noise(const weft_plate *a, const listed *of_a, const weft_plate *b, const listed *of_b,
                      weft_noise *noise)
{
    if (of_a->mean_of != of_b->mean_of ||
        !weft_noise_fit(&a->image, of_a->time, &a->clipped, &b->image, of_b->time, &b->clipped, noise))
        return false;
    noise->read *= of_a->mean_of;
    noise->shot *= of_a->mean_of;
    return true;
}

static void learn_noise(merge *m, const weft_set *set, const listed *list, int n, const weft_plate *longest,
                        const weft_plate *next)
{
    m->read = longest->noise_floor * list[0].time * sqrt(list[0].mean_of); /* an upper bound */
    if ((recorded_noise(set, list, n, &m->noise) ||
         fit_noise(longest, &list[0], next, &list[1], &m->noise)) &&
        m->noise.read > 0)
        m->read = fmin(m->read, sqrt(m->noise.read));
    m->noise.read = fmax(m->noise.read, LEAST_READ);
}

/* ---- the merge ---- */

static void add(merge *m, const weft_plate *plate, const weft_plate *shorter, const listed *of)
{
    m->plate = plate;
    m->shorter = shorter && plate->cfa != WEFT_CFA_NONE ? shorter : NULL; /* pictures may have no range */
    m->shorter_time = m->shorter ? of[1].time : 0;
    m->shorter_mean_of = m->shorter ? of[1].mean_of : 0;
    m->time = of->time;
    m->mean_of = of->mean_of;
    m->sum_time_squares += of->mean_of * of->time * of->time;
    weft_parallel_rows(m->value.height, add_rows, m);
}

static weft_err merge_list(const weft_set *set, const listed *list, int n, weft_plate *plate, weft_error *err)
{
    merge m = {.noise = fallback_noise};
    weft_plate now = {0}, next = {0};
    weft_err status = weft_plate_load_frame(set, list[0].frame, &now, err);
    if (status == WEFT_OK)
        status = merge_init(&m, &now.image, err);
    for (int i = 0; i < n && status == WEFT_OK; i++) {
        const bool last = i + 1 == n;
        if (!last && (status = weft_plate_load_frame(set, list[i + 1].frame, &next, err)) != WEFT_OK)
            break;
        if (i == 0)
            learn_noise(&m, set, list, n, &now, &next);
        add(&m, &now, last ? NULL : &next, &list[i]);
        if (!last) {
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

weft_err weft_bracket_merge(const weft_set *set, const int *frames, int n, weft_plate *plate, weft_error *err)
{
    listed *const list = sort_frames(set, frames, n, err);
    if (!list)
        return WEFT_ERR_NOMEM;
    const weft_err status = merge_list(set, list, n, plate, err);
    weft_free(list);
    return status;
}

weft_err weft_bracket_measure_noise(const weft_set *set, int light, weft_noise *noise, bool *found,
                                    weft_error *err)
{
    int *const frames = weft_alloc((size_t)set->n_frames + 1, sizeof *frames, err);
    if (!frames)
        return WEFT_ERR_NOMEM;
    int n = 0;
    for (int i = 0; i < set->n_frames; i++)
        if (set->frames[i].role == WEFT_ROLE_LIGHT && set->frames[i].light == light)
            frames[n++] = i;
    listed *const list = n >= 2 ? sort_frames(set, frames, n, err) : NULL;
    weft_err status = n >= 2 && !list ? WEFT_ERR_NOMEM : WEFT_OK;
    weft_free(frames);
    *found = false;
    weft_plate a = {0}, b = {0};
    if (list && list[0].time > list[1].time) {
        status = weft_plate_load_frame(set, list[0].frame, &a, err);
        if (status == WEFT_OK)
            status = weft_plate_load_frame(set, list[1].frame, &b, err);
        if (status == WEFT_OK)
            *found = fit_noise(&a, &list[0], &b, &list[1], noise);
    }
    weft_plate_fini(&a);
    weft_plate_fini(&b);
    weft_free(list);
    return status;
}

double weft_bracket_weight(const weft_noise *noise, const weft_set_frame *frame, double x)
{
    const double t = weft_set_frame_time(frame);
    return weft_set_frame_mean_of(frame) * t * t /
           (fmax(noise->read, LEAST_READ) + noise->shot * fmax(x, 0) * t);
}
