#include "host/rig/sensor.h"

#include "core/parallel.h"

#include <math.h>

enum { STREAM_SHOT = 64, STREAM_PRNU };

typedef struct expose_job {
    const weft_rig_scene *scene;
    const weft_rig_frames *frames;
    float weight[WEFT_RIG_N_LIGHTS], room; /* electrons per unit of the cached value */
    double gain;
    uint64_t sequence;
    uint16_t *dn;
} expose_job;

/* xoshiro256+ (Blackman and Vigna), one per row. */
typedef struct random_state {
    uint64_t s[4];
    double spare; /* the second number of a polar pair */
    bool has_spare;
} random_state;

static double next_uniform(random_state *r)
{
    uint64_t *const s = r->s;
    const uint64_t result = s[0] + s[3], t = s[1] << 17;
    s[2] ^= s[0];
    s[3] ^= s[1];
    s[1] ^= s[2];
    s[0] ^= s[3];
    s[2] ^= t;
    s[3] = (s[3] << 45) | (s[3] >> 19);
    return (double)(result >> 11) * 0x1p-53;
}

static random_state seed_row(uint64_t seed, uint64_t stream, uint64_t row)
{
    random_state r = {0};
    for (uint64_t i = 0; i < 4; i++)
        r.s[i] = (uint64_t)(weft_rig_random(seed, stream, 4 * row + i) * 0x1p53) * 0x9e3779b97f4a7c15u + 1;
    for (int i = 0; i < 8; i++)
        (void)next_uniform(&r);
    return r;
}

/* Marsaglia's polar method. */
static double next_normal(random_state *r)
{
    if (r->has_spare) {
        r->has_spare = false;
        return r->spare;
    }
    double x, y, q;
    do {
        x = 2 * next_uniform(r) - 1;
        y = 2 * next_uniform(r) - 1;
        q = x * x + y * y;
    } while (q >= 1 || q == 0);
    const double scale = sqrt(-2 * log(q) / q);
    r->spare = y * scale;
    r->has_spare = true;
    return x * scale;
}

/* Poisson number: by multiplication of uniforms below 40 (Knuth), normal above, where it is within a
   hundredth of a sigma of the true distribution function and the read noise hides the rest. */
static double next_poisson(random_state *r, double mean)
{
    if (mean >= 40)
        return mean + sqrt(mean) * next_normal(r);
    const double limit = exp(-mean);
    int count = 0;
    double product = next_uniform(r);
    while (product > limit) {
        product *= next_uniform(r);
        count++;
    }
    return count;
}

static uint16_t convert(const weft_rig_sensor *sensor, double electrons, double gain)
{
    const double per_electron = gain * (sensor->white_dn - sensor->black_dn) / sensor->full_well_e;
    const double dn = floor(sensor->black_dn + electrons * per_electron + 0.5);
    return (uint16_t)fmin(fmax(dn, 0), sensor->white_dn);
}

static void expose_row(const expose_job *job, int v)
{
    const weft_rig_sensor *const sensor = &job->scene->sensor;
    const bool noise = job->scene->setup.noise;
    const uint64_t seed = job->scene->setup.seed;
    const size_t width = (size_t)job->frames->width, row = (size_t)v * width;
    random_state shot = seed_row(seed, STREAM_SHOT + 16 * (job->sequence + 1), (uint64_t)v);
    random_state pattern = seed_row(seed, STREAM_PRNU, (uint64_t)v);
    for (size_t u = row; u < row + width; u++) {
        float mean = job->room * job->frames->room[u];
        for (int i = 0; i < WEFT_RIG_N_LIGHTS; i++)
            if (job->weight[i] > 0)
                mean += job->weight[i] * job->frames->light[i][u];
        double electrons = (double)mean;
        if (noise) {
            electrons *= 1 + sensor->prnu * next_normal(&pattern);
            electrons = next_poisson(&shot, electrons) + sensor->read_noise_e * next_normal(&shot);
        }
        job->dn[u] = convert(sensor, electrons, job->gain);
    }
}

static void expose_rows(void *context, int band, int begin, int end)
{
    (void)band;
    for (int v = begin; v < end; v++)
        expose_row(context, v);
}

void weft_rig_expose(const weft_rig_scene *scene, const weft_rig_frames *frames,
                     const double on[WEFT_RIG_N_LIGHTS], double exposure_s, double gain, uint64_t sequence,
                     uint16_t *dn)
{
    expose_job job = {.scene = scene, .frames = frames, .gain = gain, .sequence = sequence, .dn = dn};
    const double electrons = scene->sensor.full_well_e * exposure_s;
    for (int i = 0; i < WEFT_RIG_N_LIGHTS; i++)
        job.weight[i] = (float)(electrons * on[i]);
    job.room = (float)electrons;
    weft_parallel_rows(frames->height, expose_rows, &job);
}
