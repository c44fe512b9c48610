#include "host/capture/weights.h"

#include "core/log.h"
#include "host/set/bracket.h"

#include <math.h>
#include <stdlib.h>

enum { MOST_LIGHTS = 3 };

static bool is_of(const weft_set_frame *frame, int light)
{
    return frame->role == WEFT_ROLE_LIGHT && frame->light == light;
}

static int count_exposures(const weft_set *set, int light)
{
    int n = 0;
    for (int i = 0; i < set->n_frames; i++)
        n += is_of(&set->frames[i], light);
    return n;
}

static int by_shot(const void *a, const void *b)
{
    const double x = ((const weft_noise *)a)->shot, y = ((const weft_noise *)b)->shot;
    return (x > y) - (x < y);
}

static double mean_of_plate(const weft_plate *plate)
{
    const size_t n = weft_image_plane_size(&plate->image);
    double sum = 0;
    for (size_t i = 0; i < n; i++)
        sum += (double)plate->image.data[i];
    return sum / (double)n;
}

/* The frame with the least light shows the read noise where the lit ones are too bright for it: what is left
 * of its noise when the shot noise of its own light is taken off. */
static weft_err read_from_dark(weft_set *set, weft_error *err)
{
    int darkest = -1;
    for (int i = 0; i < set->n_frames; i++)
        if (set->frames[i].role == WEFT_ROLE_DARK ||
            (set->frames[i].role == WEFT_ROLE_AMBIENT && darkest < 0))
            darkest = i;
    if (darkest < 0 || set->noise.read > 0)
        return WEFT_OK;
    weft_plate plate;
    WEFT_TRY(weft_plate_load_frame(set, darkest, &plate, err));
    const double t = weft_set_frame_time(&set->frames[darkest]), floor = plate.noise_floor * t,
                 light = fmax(mean_of_plate(&plate) * t, 0);
    set->noise.read =
        fmax(weft_set_frame_mean_of(&set->frames[darkest]) * floor * floor - set->noise.shot * light, 0);
    weft_plate_fini(&plate);
    return WEFT_OK;
}

/* Something that moved between two exposures would pass for noise: not of most lights. */
static weft_err measure_noise(weft_set *set, weft_error *err)
{
    weft_noise measured[MOST_LIGHTS];
    int n = 0;
    for (int light = 0; light < weft_set_n_lights(set) && n < MOST_LIGHTS; light++) {
        bool found = false;
        if (count_exposures(set, light) < 2)
            continue;
        WEFT_TRY(weft_bracket_measure_noise(set, light, &measured[n], &found, err));
        n += found;
    }
    if (n == 0)
        return WEFT_OK;
    qsort(measured, (size_t)n, sizeof *measured, by_shot);
    set->noise = measured[n / 2];
    set->noise_gain = set->frames[set->n_frames - 1].gain;
    WEFT_TRY(read_from_dark(set, err));
    weft_explain("noise: read %.3g of the range, shot %.3g of it at white", sqrt(set->noise.read),
                 sqrt(set->noise.shot));
    return WEFT_OK;
}

/* Mean linear value of the shortest exposure, which clips least; below 0 when nothing was recorded. */
static double mean_value(const weft_set *set, int light)
{
    double shortest_s = INFINITY, value = -1;
    for (int i = 0; i < set->n_frames; i++) {
        const weft_set_frame *const f = &set->frames[i];
        const json_t *const mean = json_object_get(json_object_get(f->capture, "statistics"), "mean");
        if (!is_of(f, light) || weft_set_frame_time(f) >= shortest_s || json_array_size(mean) != 3)
            continue;
        shortest_s = weft_set_frame_time(f);
        value = 0;
        for (size_t c = 0; c < 3; c++)
            value += fmax(json_number_value(json_array_get(mean, c)), 0) / 3 / shortest_s;
    }
    return value;
}

static void record_light(weft_set *set, int light)
{
    const double x = mean_value(set, light);
    double sum = 0;
    for (int i = 0; i < set->n_frames; i++)
        if (is_of(&set->frames[i], light))
            sum += weft_bracket_weight(&set->noise, &set->frames[i], x);
    for (int i = 0; i < set->n_frames && x >= 0; i++)
        if (is_of(&set->frames[i], light) && set->frames[i].capture)
            json_object_set_new(set->frames[i].capture, "weight",
                                json_real(weft_bracket_weight(&set->noise, &set->frames[i], x) / sum));
}

weft_err weft_weights_record(weft_set *set, weft_error *err)
{
    if (set->noise_gain <= 0)
        WEFT_TRY(measure_noise(set, err));
    for (int light = 0; light < weft_set_n_lights(set) && set->noise_gain > 0; light++)
        if (count_exposures(set, light) > 1)
            record_light(set, light);
    return WEFT_OK;
}
