#include "shading/export/channels.h"

#include "core/colour.h"
#include "core/parallel.h"

#include <math.h>
#include <string.h>

typedef enum coding {
    CODE_PLAIN,
    CODE_SIGNED,
    CODE_NEGATED,
    CODE_ROOT,
    CODE_SMOOTH,
    CODE_HEIGHT,
    CODE_BASE,
    CODE_REST,
    CODE_METALLIC,
    CODE_CONSTANT
} coding;

typedef struct channel {
    const char *name;
    weft_baked_kind kind;
    int plane;
    coding code;
    double constant;
} channel;

static const channel channels[] = {
    {"albedo.r", WEFT_BAKED_ALBEDO, 0, CODE_PLAIN, 0},
    {"albedo.g", WEFT_BAKED_ALBEDO, 1, CODE_PLAIN, 0},
    {"albedo.b", WEFT_BAKED_ALBEDO, 2, CODE_PLAIN, 0},
    {"base.r", WEFT_BAKED_ALBEDO, 0, CODE_BASE, 0},
    {"base.g", WEFT_BAKED_ALBEDO, 1, CODE_BASE, 0},
    {"base.b", WEFT_BAKED_ALBEDO, 2, CODE_BASE, 0},
    {"metallic", WEFT_BAKED_SPECULAR, 0, CODE_METALLIC, 0},
    {"specular.r", WEFT_BAKED_SPECULAR, 0, CODE_PLAIN, 0},
    {"specular.g", WEFT_BAKED_SPECULAR, 1, CODE_PLAIN, 0},
    {"specular.b", WEFT_BAKED_SPECULAR, 2, CODE_PLAIN, 0},
    {"alpha", WEFT_BAKED_ROUGHNESS, 0, CODE_PLAIN, 0},
    {"roughness", WEFT_BAKED_ROUGHNESS, 0, CODE_ROOT, 0},
    {"smoothness", WEFT_BAKED_ROUGHNESS, 0, CODE_SMOOTH, 0},
    {"normal.x", WEFT_BAKED_NORMAL, 0, CODE_SIGNED, 0},
    {"normal.y", WEFT_BAKED_NORMAL, 1, CODE_SIGNED, 0},
    {"-normal.y", WEFT_BAKED_NORMAL, 1, CODE_NEGATED, 0},
    {"normal.z", WEFT_BAKED_NORMAL, 2, CODE_SIGNED, 0},
    {"detail_normal.x", WEFT_BAKED_DETAIL_NORMAL, 0, CODE_SIGNED, 0},
    {"detail_normal.y", WEFT_BAKED_DETAIL_NORMAL, 1, CODE_SIGNED, 0},
    {"detail_albedo.r", WEFT_BAKED_DETAIL_ALBEDO, 0, CODE_PLAIN, 0},
    {"tangent.x", WEFT_BAKED_TANGENT, 0, CODE_SIGNED, 0},
    {"tangent.y", WEFT_BAKED_TANGENT, 1, CODE_SIGNED, 0},
    {"anisotropy", WEFT_BAKED_ANISOTROPY, 0, CODE_PLAIN, 0},
    {"height", WEFT_BAKED_HEIGHT, 0, CODE_HEIGHT, 0},
    {"occlusion", WEFT_BAKED_OCCLUSION, 0, CODE_PLAIN, 0},
    {"cavity", WEFT_BAKED_CAVITY, 0, CODE_PLAIN, 0},
    {"opacity", WEFT_BAKED_OPACITY, 0, CODE_PLAIN, 0},
    {"cloth", WEFT_BAKED_CLOTH, 0, CODE_PLAIN, 0},
    {"smooth", WEFT_BAKED_CLOTH, 0, CODE_REST, 0},
    {"front.r", WEFT_BAKED_FRONT_TINT, 0, CODE_PLAIN, 0},
    {"front.g", WEFT_BAKED_FRONT_TINT, 1, CODE_PLAIN, 0},
    {"front.b", WEFT_BAKED_FRONT_TINT, 2, CODE_PLAIN, 0},
    {"rim.r", WEFT_BAKED_RIM_TINT, 0, CODE_PLAIN, 0},
    {"rim.g", WEFT_BAKED_RIM_TINT, 1, CODE_PLAIN, 0},
    {"rim.b", WEFT_BAKED_RIM_TINT, 2, CODE_PLAIN, 0},
    {"zero", WEFT_BAKED_COUNT, 0, CODE_CONSTANT, 0},
    {"half", WEFT_BAKED_COUNT, 0, CODE_CONSTANT, 0.5},
    {"one", WEFT_BAKED_COUNT, 0, CODE_CONSTANT, 1},
};

static const channel *find(const char *name)
{
    for (size_t i = 0; i < sizeof channels / sizeof channels[0]; i++)
        if (strcmp(channels[i].name, name) == 0)
            return &channels[i];
    return NULL;
}

bool weft_channel_known(const char *name)
{
    return find(name) != NULL;
}

static double row_at(const weft_baked *b, weft_baked_kind kind, int plane, int level, size_t i)
{
    const weft_baked_map *const map = &b->maps[kind];
    if (level >= 0 && level < map->n_mips && map->mips[level].data)
        return (double)weft_image_plane(&map->mips[level], plane)[i];
    return (double)map->constant[plane];
}

/* Where GGX and cloth lie side by side, formats have one diffuse colour for both: what is seen of them
 * together. */
static double value_at(const weft_baked *b, weft_baked_kind kind, int plane, int level, size_t i)
{
    const double value = row_at(b, kind, plane, level, i);
    if (kind != WEFT_BAKED_ALBEDO || !b->two_lobes)
        return value;
    const double share = row_at(b, WEFT_BAKED_CLOTH, 0, level, i);
    return value + share * (row_at(b, WEFT_BAKED_CLOTH_ALBEDO, plane, level, i) - value);
}

/* How much of the surface is metal: nothing diffuse, and an F0 that no dielectric has. */
static double metallic_at(const weft_baked *b, int level, size_t i)
{
    double albedo = 0, f0 = 0;
    for (int p = 0; p < 3; p++) {
        albedo = fmax(albedo, value_at(b, WEFT_BAKED_ALBEDO, p, level, i));
        f0 = fmax(f0, value_at(b, WEFT_BAKED_SPECULAR, p, level, i));
    }
    return f0 > 0.2 ? f0 / (f0 + albedo) : 0;
}

/* @param level  -1: the means */
static double coded(const weft_baked *b, const channel *c, int level, size_t i, const double range_mm[2])
{
    if (c->code == CODE_CONSTANT)
        return c->constant;
    if (c->code == CODE_METALLIC)
        return metallic_at(b, level, i);
    const double v = value_at(b, c->kind, c->plane, level, i);
    switch (c->code) {
    case CODE_SIGNED:
        return 0.5 + 0.5 * v;
    case CODE_NEGATED:
        return 0.5 - 0.5 * v;
    case CODE_ROOT:
        return sqrt(fmax(v, 0));
    case CODE_REST:
        return 1 - v;
    case CODE_SMOOTH:
        return 1 - sqrt(fmax(v, 0));
    case CODE_HEIGHT:
        return range_mm[1] > range_mm[0] ? (v - range_mm[0]) / (range_mm[1] - range_mm[0]) : 0.5;
    case CODE_BASE: {
        const double metal = metallic_at(b, level, i);
        return v + metal * (value_at(b, WEFT_BAKED_SPECULAR, c->plane, level, i) - v);
    }
    case CODE_PLAIN:
    case CODE_METALLIC:
    case CODE_CONSTANT:
        break;
    }
    return v;
}

void weft_channels_height_range(const weft_baked *baked, double range_mm[2])
{
    const weft_baked_map *const map = &baked->maps[WEFT_BAKED_HEIGHT];
    range_mm[0] = range_mm[1] = 0;
    if (map->n_mips == 0)
        return;
    range_mm[0] = INFINITY;
    range_mm[1] = -INFINITY;
    for (size_t i = 0; i < weft_image_plane_size(&map->mips[0]); i++) {
        range_mm[0] = fmin(range_mm[0], (double)map->mips[0].data[i]);
        range_mm[1] = fmax(range_mm[1], (double)map->mips[0].data[i]);
    }
}

bool weft_channel_varies(const weft_baked *baked, const char *name)
{
    const channel *const c = find(name);
    if (!c || c->code == CODE_CONSTANT)
        return false;
    if (c->code == CODE_METALLIC)
        return false; /* a material is metal or not, as a whole; a mix goes into the base colour */
    if (c->code == CODE_BASE && baked->maps[WEFT_BAKED_SPECULAR].n_mips > 0 && metallic_at(baked, -1, 0) > 0)
        return true;
    if (c->kind == WEFT_BAKED_ALBEDO && baked->two_lobes &&
        (baked->maps[WEFT_BAKED_CLOTH].n_mips > 0 || baked->maps[WEFT_BAKED_CLOTH_ALBEDO].n_mips > 0))
        return true;
    return baked->maps[c->kind].n_mips > 0;
}

double weft_channel_mean(const weft_baked *baked, const char *name)
{
    static const double none[2] = {0, 0};
    const channel *const c = find(name);
    return c ? coded(baked, c, -1, 0, none) : 0;
}

/* What a level is read with. */
typedef struct level_job {
    const weft_baked *baked;
    const weft_channels *wanted;
    const channel *from[WEFT_CHANNELS_MAX];
    int n, level, width, height;
    double range_mm[2];
    weft_raster *raster; /* one of the two is written */
    weft_image *planes;
} level_job;

static weft_err plan_level(const weft_baked *baked, const weft_channels *wanted, int level, level_job *job,
                           weft_error *err)
{
    const int w = baked->width >> level, h = baked->height >> level;
    *job = (level_job){.baked = baked, .wanted = wanted, .level = level};
    for (; job->n < WEFT_CHANNELS_MAX && wanted->names[job->n]; job->n++)
        if (!(job->from[job->n] = find(wanted->names[job->n])))
            return weft_fail(err, WEFT_ERR_USAGE, "'%s' is no channel", wanted->names[job->n]);
    job->width = w > 0 ? w : 1;
    job->height = h > 0 ? h : 1;
    weft_channels_height_range(baked, job->range_mm);
    return WEFT_OK;
}

static void raster_rows(void *context, int band, int begin, int end)
{
    const level_job *const job = context;
    const double top = (double)((1 << job->raster->bits) - 1);
    (void)band;
    for (size_t i = (size_t)begin * (size_t)job->width; i < (size_t)end * (size_t)job->width; i++)
        for (int c = 0; c < job->n; c++) {
            double v = fmin(fmax(coded(job->baked, job->from[c], job->level, i, job->range_mm), 0), 1);
            if (job->wanted->srgb && c < 3)
                v = weft_srgb_encode(v);
            job->raster->data[i * (size_t)job->n + (size_t)c] = (uint16_t)(v * top + 0.5);
        }
}

weft_err weft_channels_raster(const weft_baked *baked, const weft_channels *wanted, int level,
                              weft_raster *raster, weft_error *err)
{
    level_job job;
    WEFT_TRY(plan_level(baked, wanted, level, &job, err));
    WEFT_TRY(weft_raster_init(raster, job.width, job.height, job.n, wanted->bits, err));
    job.raster = raster;
    weft_parallel_rows(raster->height, raster_rows, &job);
    return WEFT_OK;
}

static void plane_rows(void *context, int band, int begin, int end)
{
    const level_job *const job = context;
    (void)band;
    for (int c = 0; c < job->n; c++)
        for (size_t i = (size_t)begin * (size_t)job->width; i < (size_t)end * (size_t)job->width; i++)
            weft_image_plane(job->planes, c)[i] =
                (float)coded(job->baked, job->from[c], job->level, i, job->range_mm);
}

weft_err weft_channels_planes(const weft_baked *baked, const weft_channels *wanted, int level,
                              weft_image *planes, weft_error *err)
{
    level_job job;
    WEFT_TRY(plan_level(baked, wanted, level, &job, err));
    WEFT_TRY(weft_image_init(planes, job.width, job.height, job.n, err));
    job.planes = planes;
    weft_parallel_rows(planes->height, plane_rows, &job);
    return WEFT_OK;
}
