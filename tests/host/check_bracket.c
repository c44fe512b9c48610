/* Brackets of a satin on the virtual scanner's sensor, against the light that its renderer put on it. */
#include "core/file.h"
#include "core/formats/raw_file.h"
#include "core/mem.h"
#include "host/capture/average.h"
#include "host/capture/weights.h"
#include "host/rig/render.h"
#include "host/rig/sensor.h"
#include "host/set/bracket.h"
#include "tests/support/support.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

enum { WIDTH = 308, HEIGHT = 204, N = WIDTH * HEIGHT, LIGHT = 3 };

static weft_rig_scene scene;
static weft_rig_frames frames;
static uint64_t sequence;

/* Light and room: the plates below have no ambient subtracted. */
static double truth(int i)
{
    return (double)frames.light[LIGHT][i] + (double)frames.room[i];
}

static int set_up(void **state)
{
    (void)state;
    static weft_rig_sample sample;
    weft_rig_setup setup;
    weft_rig_view view;
    weft_rig_setup_init(&setup);
    setup.size = (weft_size){WIDTH, HEIGHT};
    setup.supersample = 1;
    assert_ok(weft_rig_scene_init(&scene, &setup, err));
    scene.sensor.prnu = 0; /* no merging takes away what every frame has */
    assert_ok(weft_rig_view_sensor(&view, &scene, err));
    assert_ok(weft_rig_sample_init(&sample, &scene, "satin", err));
    assert_ok(weft_rig_frames_init(&frames, &scene, &view, &sample, err));
    weft_rig_view_fini(&view);
    return 0;
}

static int tear_down(void **state)
{
    (void)state;
    weft_rig_frames_fini(&frames);
    return 0;
}

static weft_set make_set(const char *name)
{
    weft_set set;
    assert_ok(weft_folder_create(weft_test_path(name), err));
    assert_ok(weft_set_init(&set, weft_test_path(name), err));
    set.width = WIDTH;
    set.height = HEIGHT;
    set.cfa = WEFT_CFA_RGGB;
    set.white = scene.sensor.white_dn;
    for (int i = 0; i < 4; i++)
        set.black[i] = scene.sensor.black_dn;
    set.complete = true;
    return set;
}

/* One file of the set, the mean of so many exposures; light -1: ambient. */
static void shoot(weft_set *set, int light, double exposure_s, int mean_of)
{
    double on[WEFT_RIG_N_LIGHTS] = {[LIGHT] = light >= 0};
    weft_mosaic m;
    weft_average mean = {0};
    char file[32];
    snprintf(file, sizeof file, "%d.dng", set->n_frames);
    assert_ok(weft_mosaic_init(&m, WIDTH, HEIGHT, WEFT_CFA_RGGB, err));
    m.white = (float)scene.sensor.white_dn;
    for (int i = 0; i < 4; i++)
        m.black[i] = (float)scene.sensor.black_dn;
    for (int i = 0; i < mean_of; i++) {
        weft_rig_expose(&scene, &frames, on, exposure_s, 1, sequence++, m.data);
        assert_ok(weft_average_add(&mean, &m, err));
    }
    weft_average_get(&mean, &m);
    weft_average_fini(&mean);
    char *const path = weft_path_join(set->folder, file, NULL);
    assert_ok(weft_dng_write(path, &m, &(weft_frame_info){.exposure_s = exposure_s}, err));
    weft_free(path);
    weft_mosaic_fini(&m);
    const weft_set_frame row = {.file = file,
                                .role = light >= 0 ? WEFT_ROLE_LIGHT : WEFT_ROLE_AMBIENT,
                                .light = light,
                                .exposure_s = exposure_s,
                                .gain = 1,
                                .capture = json_pack("{s:i, s:{s:[f,f,f]}}", "mean_of", mean_of, "statistics",
                                                     "mean", 0.1, 0.1, 0.1)};
    assert_ok(weft_set_add_frame(set, &row, err));
}

/* What a plate is worth: share that is clipped; rms error over the rest, in units of the light's mean; the
 * same over the best that these exposures allow (Cramer-Rao); mean error in its own standard deviations, of
 * all and of those whose longest exposure ends near white, where wrong rules show. */
typedef struct worth {
    double clipped, rms, over_best, bias, bias_near_white;
} worth;

static double variance(double x, double t, int mean_of)
{
    const double read = scene.sensor.read_noise_e / scene.sensor.full_well_e,
                 step = 1 / (scene.sensor.white_dn - scene.sensor.black_dn);
    return ((read * read + x * t / scene.sensor.full_well_e) / mean_of + step * step / 12) / (t * t);
}

/* @param used  [n_times] plates of the single exposures, longest first: where they are saturated, or beside
 */
static worth judge(const weft_plate *plate, const weft_plate *used, const double *times, int n_times,
                   int mean_of)
{
    worth w = {0};
    double n = 0, squares = 0, light = 0, normed = 0, sum = 0, n_near = 0, sum_near = 0;
    for (int i = 0; i < N; i++) {
        const double x = truth(i), e = (double)plate->image.data[i] - x;
        double information = 0;
        if (plate->clipped.data[i]) {
            w.clipped += 1.0 / N;
            continue;
        }
        for (int k = 0; k < n_times; k++)
            if (!(used[k].clipped.data && used[k].clipped.data[i]) &&
                (k + 1 == n_times || x * times[k] < WEFT_BRACKET_LIMIT))
                information += 1 / variance(x, times[k], mean_of);
        n++;
        light += x;
        squares += e * e;
        normed += e * e * information;
        sum += e * sqrt(information);
        if (x * times[0] > 0.9 && x * times[0] < 1.05) {
            n_near++;
            sum_near += e * sqrt(information);
        }
    }
    w.rms = sqrt(squares / n) / (light / n);
    w.over_best = sqrt(normed / n);
    w.bias = sum / sqrt(n);
    w.bias_near_white = n_near > 0 ? sum_near / sqrt(n_near) : 0;
    return w;
}

static worth judge_light(const weft_set *set, int light, const double *times, int n_times, int mean_of,
                         const char *what)
{
    weft_plate plate, used[3];
    memset(used, 0, sizeof used);
    assert_ok(weft_plate_load_light(set, light, NULL, &plate, err));
    for (int i = 0; i < set->n_frames; i++)
        for (int k = 0; k < n_times; k++)
            if (set->frames[i].light == light && set->frames[i].exposure_s == times[k])
                assert_ok(weft_plate_load_frame(set, i, &used[k], err));
    const worth w = judge(&plate, used, times, n_times, mean_of);
    for (int k = 0; k < n_times; k++)
        weft_plate_fini(&used[k]);
    weft_plate_fini(&plate);
    print_message("%-24s clipped %6.3f %%  rms error %.3f %%  over the best possible %.3f  bias %.1f, near "
                  "white %.1f sigma\n",
                  what, 100 * w.clipped, 100 * w.rms, w.over_best, w.bias, w.bias_near_white);
    return w;
}

/* Where satin shines, the exposure that suits the rest clips; a bracket holds both, and is less noisy. */
static void a_bracket_of_satin(void **state)
{
    (void)state;
    const double times[] = {0.4, 0.1, 0.025};
    enum { BRACKET, LONG, MIDDLE, SHORT };
    weft_set set = make_set("satin.set");
    for (int k = 2; k >= 0; k--) {
        shoot(&set, BRACKET, times[k], 1);
        shoot(&set, LONG + k, times[k], 1);
    }
    shoot(&set, -1, times[1], 1);
    const worth merged = judge_light(&set, BRACKET, times, 3, 1, "three exposures merged");
    const worth longest = judge_light(&set, LONG, times, 1, 1, "0.4 s alone");
    const worth middle = judge_light(&set, MIDDLE, times + 1, 1, 1, "0.1 s alone");
    const worth shortest = judge_light(&set, SHORT, times + 2, 1, 1, "0.025 s alone");
    assert_true(longest.clipped > 0.3);
    assert_near(merged.clipped, 0, 0);
    assert_true(merged.rms < 0.95 * middle.rms && merged.rms < 0.5 * shortest.rms);
    assert_near(merged.over_best, 1, 0.02);
    assert_near(merged.bias, 0, 4);
    assert_near(merged.bias_near_white, 0, 4);

    assert_ok(weft_weights_record(&set, err));
    const double shot = set.noise.shot * scene.sensor.full_well_e,
                 read = sqrt(set.noise.read) * scene.sensor.full_well_e;
    print_message("noise found: shot %.3f of the truth, read %.2f electrons (truth %.2f)\n", shot, read,
                  scene.sensor.read_noise_e);
    assert_near(shot, 1, 0.03);
    assert_near(read / scene.sensor.read_noise_e, 1, 0.2);
    double sum = 0, last = 0;
    for (int i = 0; i < set.n_frames; i++) {
        const json_t *const weight = json_object_get(set.frames[i].capture, "weight");
        assert_int_equal(weight != NULL, set.frames[i].light == BRACKET);
        if (!weight)
            continue;
        assert_true(json_real_value(weight) > 2 * last); /* the longer, the more */
        sum += last = json_real_value(weight);
    }
    assert_near(sum, 1, 1e-12);
    assert_ok(weft_set_save(&set, err)); /* the weights of the file are those that readers use */
    weft_set again;
    assert_ok(weft_set_load(set.folder, &again, err));
    assert_true(again.noise_gain == 1 && again.noise.shot == set.noise.shot &&
                again.noise.read == set.noise.read);
    const worth recorded = judge_light(&again, BRACKET, times, 3, 1, "by the recorded noise");
    assert_near(recorded.over_best, 1, 0.02);
    again.noise_gain = 2; /* of other settings: not used */
    again.noise = (weft_noise){0.01, 0};
    assert_near(judge_light(&again, BRACKET, times, 3, 1, "noise of another gain").over_best,
                merged.over_best, 1e-6);
    weft_set_fini(&again);
    weft_set_fini(&set);
}

/* Files that are means of frames: less noise, the same weights, and the noise of a single frame is told. */
static void a_bracket_of_means(void **state)
{
    (void)state;
    const double times[] = {0.4, 0.1};
    weft_set set = make_set("means.set");
    for (int k = 0; k < 2; k++)
        shoot(&set, 0, times[k], 4);
    const worth merged = judge_light(&set, 0, times, 2, 4, "two means of four");
    assert_near(merged.over_best, 1, 0.03);
    assert_near(merged.clipped, 0, 0);
    weft_noise noise;
    bool found = false;
    assert_ok(weft_bracket_measure_noise(&set, 0, &noise, &found, err));
    assert_true(found);
    assert_near(noise.shot * scene.sensor.full_well_e, 1, 0.04);
    assert_near(weft_bracket_weight(&noise, &set.frames[0], 1), 4 * 0.16 / (noise.read + noise.shot * 0.4),
                1e-3 * weft_bracket_weight(&noise, &set.frames[0], 1));
    weft_set_fini(&set);
}

enum { STEPS = 12 };

static int step_of(int i)
{
    return i / WIDTH * STEPS / HEIGHT;
}

/* Which values count must not depend on their own noise: grey steps about the limit, each must keep its mean.
 */
static void no_bias_where_values_cease_to_count(void **state)
{
    (void)state;
    const double times[] = {1, 0.25, 0.0625};
    float *const light = frames.light[LIGHT], *const room = frames.room;
    frames.light[LIGHT] = weft_alloc(N, sizeof *light, NULL);
    frames.room = weft_alloc(N, sizeof *room, NULL);
    for (int i = 0; i < N; i++)
        frames.light[LIGHT][i] = 0.87F + 0.012F * (float)step_of(i);
    weft_set set = make_set("steps.set");
    for (int k = 0; k < 3; k++)
        shoot(&set, 0, times[k], 1);
    weft_plate plate;
    double sum[STEPS] = {0}, n[STEPS] = {0}, worst = 0;
    assert_ok(weft_plate_load_light(&set, 0, NULL, &plate, err));
    for (int i = 0; i < N; i++) {
        const int step = step_of(i);
        sum[step] += (double)plate.image.data[i] / truth(i) - 1;
        n[step]++;
    }
    for (int step = 0; step < STEPS; step++)
        worst = fmax(worst, fabs(sum[step] / n[step]));
    print_message("mean of grey steps from 0.87 to 1.00: off by %.3f %% at most\n", 100 * worst);
    assert_true(worst < 1e-3);
    weft_plate_fini(&plate);
    weft_set_fini(&set);
    weft_free(frames.light[LIGHT]);
    weft_free(frames.room);
    frames.light[LIGHT] = light;
    frames.room = room;
}

/* A longer exposure that is clipped nearly everywhere, and frames that tell no noise. */
static void brackets_that_tell_little(void **state)
{
    (void)state;
    const double times[] = {10, 0.04};
    weft_set set = make_set("little.set");
    shoot(&set, 0, 10, 1);
    shoot(&set, 0, 0.04, 1);
    const worth merged = judge_light(&set, 0, times, 2, 1, "10 s and 0.04 s");
    assert_near(merged.over_best, 1, 0.02);
    assert_near(merged.clipped, 0, 0);
    assert_ok(weft_weights_record(&set, err));
    assert_true(set.noise_gain == 0 && !json_object_get(set.frames[0].capture, "weight"));
    weft_set_fini(&set);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_bracket_of_satin),
        cmocka_unit_test(a_bracket_of_means),
        cmocka_unit_test(no_bias_where_values_cease_to_count),
        cmocka_unit_test(brackets_that_tell_little),
    };
    return cmocka_run_group_tests(tests, set_up, tear_down);
}
