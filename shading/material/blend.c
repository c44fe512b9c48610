#include "shading/material/blend.h"

#include "core/parallel.h"
#include "shading/bake/normal_filter.h"

#include <math.h>
#include <string.h>

static unsigned group_of(weft_baked_kind kind)
{
    switch (kind) {
    case WEFT_BAKED_ALBEDO:
    case WEFT_BAKED_CLOTH_ALBEDO:
    case WEFT_BAKED_OPACITY:
        return WEFT_BLEND_ALBEDO;
    case WEFT_BAKED_NORMAL:
    case WEFT_BAKED_HEIGHT:
        return WEFT_BLEND_NORMAL;
    case WEFT_BAKED_OCCLUSION:
        return WEFT_BLEND_ALL;
    default:
        return WEFT_BLEND_SPECULAR;
    }
}

weft_err weft_blend_spread(weft_baked *baked, weft_baked_kind kind, weft_error *err)
{
    weft_baked_map *const map = &baked->maps[kind];
    if (map->n_mips > 0)
        return WEFT_OK;
    WEFT_TRY(weft_baked_add(baked, kind, baked->width, baked->height, err));
    const size_t n = weft_image_plane_size(&map->mips[0]);
    for (int p = 0; p < map->mips[0].planes; p++)
        for (size_t i = 0; i < n; i++)
            weft_image_plane(&map->mips[0], p)[i] = map->constant[p];
    return WEFT_OK;
}

/* A quantity of one side, as a map or a constant. */
typedef struct side {
    const float *plane[4]; /* NULL: the constant */
    float constant[4];
} side;

static side side_of(const weft_baked *baked, weft_baked_kind kind)
{
    const weft_baked_map *const map = &baked->maps[kind];
    side s;
    for (int p = 0; p < 4; p++) {
        s.plane[p] = map->n_mips > 0 && p < map->mips[0].planes ? weft_image_plane(&map->mips[0], p) : NULL;
        s.constant[p] = map->constant[p];
    }
    return s;
}

static inline float at(const side *s, int plane, size_t i)
{
    return s->plane[plane] ? s->plane[plane][i] : s->constant[plane];
}

/* Which part of the surface a quantity belongs to, where there are two. */
typedef enum part { PART_BOTH, PART_GGX, PART_CLOTH } part;

typedef struct blend_job {
    weft_baked *below;
    const weft_baked *above;
    const float *mask;
    float alpha;
    bool reorient;
    weft_baked_kind kind, from; /* of `below`, and of `above` where that has another row for it */
    part part;
    side share, share_above; /* that is cloth */
} blend_job;

/*
 * The radiance (1 - c) G + c C of both materials is blended by w (S-ORD-26); so the share of cloth becomes
 * c' = c + w (c_k - c), and of the parameters of each part that of the layer counts as its part of the area:
 * w c_k/c' of the cloth's, w (1 - c_k)/(1 - c') of the smooth one's.  Where a part has no area its parameters
 * are those of the layer that has it at all: neighbours and mips see them.
 */
static inline float share_of_part(const blend_job *job, float w, size_t i)
{
    const float c = at(&job->share, 0, i), ck = at(&job->share_above, 0, i);
    const float below = job->part == PART_CLOTH ? c : 1 - c, above = job->part == PART_CLOTH ? ck : 1 - ck;
    const float area = (1 - w) * below + w * above;
    return area > 1e-6F ? w * above / area : above > 0;
}

static inline float weight_at(const blend_job *job, size_t i)
{
    const float w = job->alpha * (job->mask ? job->mask[i] : 1);
    const float clamped = w < 0 ? 0 : w > 1 ? 1 : w;
    return job->part == PART_BOTH ? clamped : share_of_part(job, clamped, i);
}

static void blend_linear(const blend_job *job, size_t begin, size_t end)
{
    weft_image *const to = &job->below->maps[job->kind].mips[0];
    const side from = side_of(job->above, job->from);
    for (int p = 0; p < to->planes; p++) {
        float *const out = weft_image_plane(to, p);
        for (size_t i = begin; i < end; i++)
            out[i] += weight_at(job, i) * (at(&from, p, i) - out[i]);
    }
}

static void blend_normal(const blend_job *job, size_t begin, size_t end)
{
    weft_image *const to = &job->below->maps[WEFT_BAKED_NORMAL].mips[0];
    const side from = side_of(job->above, WEFT_BAKED_NORMAL);
    float *const x = weft_image_plane(to, 0), *const y = weft_image_plane(to, 1),
                 *const z = weft_image_plane(to, 2);
    for (size_t i = begin; i < end; i++) {
        const double w = (double)weight_at(job, i), base[3] = {(double)x[i], (double)y[i], (double)z[i]};
        double n[3] = {(double)at(&from, 0, i), (double)at(&from, 1, i), (double)at(&from, 2, i)};
        if (job->reorient) {
            const double detail[3] = {n[0], n[1], n[2]};
            weft_normal_reorient(base, detail, n);
        }
        const double bz = fmax(base[2], 0.01), nz = fmax(n[2], 0.01);
        const double sx = base[0] / bz + w * (n[0] / nz - base[0] / bz);
        const double sy = base[1] / bz + w * (n[1] / nz - base[1] / bz);
        const double length = sqrt(sx * sx + sy * sy + 1);
        x[i] = (float)(sx / length);
        y[i] = (float)(sy / length);
        z[i] = (float)(1 / length);
    }
}

/* Widths along and across are what is blended; the tangent goes with the larger weight (S-ORD-26). */
static void blend_lobe(const blend_job *job, size_t begin, size_t end)
{
    const side a = side_of(job->below, WEFT_BAKED_ROUGHNESS), sa = side_of(job->below, WEFT_BAKED_ANISOTROPY);
    const side b = side_of(job->above, WEFT_BAKED_ROUGHNESS), sb = side_of(job->above, WEFT_BAKED_ANISOTROPY);
    const side turn = side_of(job->above, WEFT_BAKED_TANGENT);
    weft_baked_map *const maps = job->below->maps;
    float *const alpha = maps[WEFT_BAKED_ROUGHNESS].mips[0].data;
    float *const s = maps[WEFT_BAKED_ANISOTROPY].n_mips ? maps[WEFT_BAKED_ANISOTROPY].mips[0].data : NULL;
    weft_image *const tangent = maps[WEFT_BAKED_TANGENT].n_mips ? &maps[WEFT_BAKED_TANGENT].mips[0] : NULL;
    for (size_t i = begin; i < end; i++) {
        const float w = weight_at(job, i);
        const float along_a = at(&a, 0, i), along_b = at(&b, 0, i);
        const float across_a = along_a * (1 - at(&sa, 0, i)), across_b = along_b * (1 - at(&sb, 0, i));
        const float along = along_a + w * (along_b - along_a), across = across_a + w * (across_b - across_a);
        alpha[i] = along;
        if (s)
            s[i] = along > 0 ? fmaxf(1 - across / along, 0) : 0;
        for (int p = 0; tangent && w > 0.5F && p < 2; p++)
            weft_image_plane(tangent, p)[i] = at(&turn, p, i);
    }
}

static void blend_rows(void *context, int band, int row_begin, int row_end)
{
    const blend_job *const job = context;
    const size_t w = (size_t)job->below->width, begin = (size_t)row_begin * w, end = (size_t)row_end * w;
    (void)band;
    if (job->kind == WEFT_BAKED_NORMAL)
        blend_normal(job, begin, end);
    else if (job->kind == WEFT_BAKED_ROUGHNESS && job->part == PART_BOTH)
        blend_lobe(job, begin, end);
    else
        blend_linear(job, begin, end);
}

static bool varies(const weft_baked *baked, weft_baked_kind kind)
{
    return baked->maps[kind].n_mips > 0;
}

static bool differs(const weft_baked *a, const weft_baked *b, weft_baked_kind kind, weft_baked_kind of_b)
{
    if (varies(a, kind) || varies(b, of_b))
        return true;
    for (int p = 0; p < weft_baked_rows[kind].planes; p++)
        if (fabsf(a->maps[kind].constant[p] - b->maps[of_b].constant[p]) > 0)
            return true;
    return false;
}

static bool is_constant(const side *s)
{
    return !s->plane[0];
}

/* Without a mask two constants stay a constant: no map of 16 million equal numbers. */
static bool stays_constant(const blend_job *job, weft_baked_kind kind, weft_baked_kind from)
{
    return !job->mask && !varies(job->below, kind) && !varies(job->above, from) &&
           (job->part == PART_BOTH || (is_constant(&job->share) && is_constant(&job->share_above)));
}

static void blend_constants(const blend_job *job)
{
    float *const to = job->below->maps[job->kind].constant;
    const float *const from = job->above->maps[job->from].constant, w = weight_at(job, 0);
    for (int p = 0; p < weft_baked_rows[job->kind].planes; p++)
        to[p] += w * (from[p] - to[p]);
}

static weft_err blend_one(blend_job *job, weft_baked_kind kind, weft_baked_kind from, part of,
                          weft_error *err)
{
    job->kind = kind;
    job->from = from;
    job->part = of;
    if (!differs(job->below, job->above, kind, from))
        return WEFT_OK;
    if (stays_constant(job, kind, from) && kind != WEFT_BAKED_NORMAL) {
        blend_constants(job);
        return WEFT_OK;
    }
    WEFT_TRY(weft_blend_spread(job->below, kind, err));
    weft_parallel_rows(job->below->height, blend_rows, job);
    return WEFT_OK;
}

/* Roughness, anisotropy and tangent belong together. */
static weft_err blend_specular_lobe(blend_job *job, weft_error *err)
{
    weft_baked *const below = job->below;
    const weft_baked *const above = job->above;
    if (!differs(below, above, WEFT_BAKED_ROUGHNESS, WEFT_BAKED_ROUGHNESS) &&
        !differs(below, above, WEFT_BAKED_ANISOTROPY, WEFT_BAKED_ANISOTROPY) &&
        !differs(below, above, WEFT_BAKED_TANGENT, WEFT_BAKED_TANGENT))
        return WEFT_OK;
    const bool is_plain = stays_constant(job, WEFT_BAKED_ROUGHNESS, WEFT_BAKED_ROUGHNESS) &&
                          stays_constant(job, WEFT_BAKED_ANISOTROPY, WEFT_BAKED_ANISOTROPY) &&
                          stays_constant(job, WEFT_BAKED_TANGENT, WEFT_BAKED_TANGENT);
    if (is_plain) {
        float *const a = below->maps[WEFT_BAKED_ROUGHNESS].constant, *const s =
                                                                         below->maps[WEFT_BAKED_ANISOTROPY]
                                                                             .constant;
        const float *const b = above->maps[WEFT_BAKED_ROUGHNESS].constant;
        const float across =
            a[0] * (1 - s[0]) +
            job->alpha * (b[0] * (1 - above->maps[WEFT_BAKED_ANISOTROPY].constant[0]) - a[0] * (1 - s[0]));
        a[0] += job->alpha * (b[0] - a[0]);
        s[0] = a[0] > 0 ? fmaxf(1 - across / a[0], 0) : 0;
        for (int p = 0; p < 2 && job->alpha > 0.5F; p++)
            below->maps[WEFT_BAKED_TANGENT].constant[p] = above->maps[WEFT_BAKED_TANGENT].constant[p];
        return WEFT_OK;
    }
    WEFT_TRY(weft_blend_spread(below, WEFT_BAKED_ROUGHNESS, err));
    if (differs(below, above, WEFT_BAKED_ANISOTROPY, WEFT_BAKED_ANISOTROPY) ||
        below->maps[WEFT_BAKED_ANISOTROPY].constant[0] > 0)
        WEFT_TRY(weft_blend_spread(below, WEFT_BAKED_ANISOTROPY, err));
    if (differs(below, above, WEFT_BAKED_TANGENT, WEFT_BAKED_TANGENT))
        WEFT_TRY(weft_blend_spread(below, WEFT_BAKED_TANGENT, err));
    job->kind = WEFT_BAKED_ROUGHNESS;
    weft_parallel_rows(below->height, blend_rows, job);
    return WEFT_OK;
}

/* The type that can show both (S-ORD-26). */
static weft_err blend_types(weft_baked *below, const weft_baked *above, weft_error *err)
{
    const unsigned both = below->type->model | above->type->model;
    if ((both & WEFT_MATERIAL_CLOTH) && (both & WEFT_MATERIAL_ANISOTROPIC))
        return weft_fail(
            err, WEFT_ERR_UNSUPPORTED,
            "%s: a layer is anisotropic and another cloth; no model shades both, use an opaquematerial "
            "for one",
            below->name);
    if (above->type->model > below->type->model)
        below->type = above->type;
    return WEFT_OK;
}

/* The parts of one surface get parameters of their own: the same ones, to begin with. */
static weft_err separate(weft_baked *below, weft_error *err)
{
    static const weft_baked_kind kinds[] = {WEFT_BAKED_ALBEDO, WEFT_BAKED_SPECULAR, WEFT_BAKED_ROUGHNESS};
    below->two_lobes = true;
    for (int k = 0; k < 3; k++) {
        const weft_baked_map *const from = &below->maps[kinds[k]];
        weft_baked_map *const to = &below->maps[weft_baked_of_cloth(below, kinds[k])];
        memcpy(to->constant, from->constant, sizeof to->constant);
        if (from->n_mips == 0)
            continue;
        weft_image copy;
        WEFT_TRY(weft_image_copy(&copy, &from->mips[0], err));
        weft_image_fini(&to->mips[0]);
        to->mips[0] = copy;
        to->n_mips = 1;
    }
    return WEFT_OK;
}

/* Whether one of the two is cloth where the other is not. */
static bool needs_two_lobes(const weft_baked *below, const weft_baked *above)
{
    return below->two_lobes || above->two_lobes || differs(below, above, WEFT_BAKED_CLOTH, WEFT_BAKED_CLOTH);
}

static part part_of(weft_baked_kind kind)
{
    switch (kind) {
    case WEFT_BAKED_ALBEDO:
    case WEFT_BAKED_SPECULAR:
    case WEFT_BAKED_ROUGHNESS:
        return PART_GGX;
    case WEFT_BAKED_CLOTH_ALBEDO:
    case WEFT_BAKED_CLOTH_SPECULAR:
    case WEFT_BAKED_CLOTH_ROUGHNESS:
    case WEFT_BAKED_FRONT_TINT:
    case WEFT_BAKED_RIM_TINT:
    case WEFT_BAKED_RIM_AMPLITUDE:
        return PART_CLOTH;
    default:
        return PART_BOTH;
    }
}

/* Quantity by quantity, the share of cloth last: the others are weighed by what it was. */
static weft_err blend_two_lobes(blend_job *job, unsigned channels, weft_error *err)
{
    static const weft_baked_kind twins[][2] = {{WEFT_BAKED_CLOTH_ALBEDO, WEFT_BAKED_ALBEDO},
                                               {WEFT_BAKED_CLOTH_SPECULAR, WEFT_BAKED_SPECULAR},
                                               {WEFT_BAKED_CLOTH_ROUGHNESS, WEFT_BAKED_ROUGHNESS}};
    if (!job->below->two_lobes)
        WEFT_TRY(separate(job->below, err));
    job->share = side_of(job->below, WEFT_BAKED_CLOTH);
    job->share_above = side_of(job->above, WEFT_BAKED_CLOTH);
    const bool shares_stay = !(channels & WEFT_BLEND_SPECULAR); /* a coat of colour lies on both alike */
    for (int k = 0; k < WEFT_BAKED_COUNT; k++) {
        const weft_baked_kind kind = (weft_baked_kind)k;
        weft_baked_kind from = kind;
        for (int t = 0; t < 3 && !job->above->two_lobes; t++)
            from = kind == twins[t][0] ? twins[t][1] : from;
        if ((group_of(kind) & channels) && kind != WEFT_BAKED_CLOTH)
            WEFT_TRY(blend_one(job, kind, from, shares_stay ? PART_BOTH : part_of(kind), err));
    }
    return shares_stay ? WEFT_OK : blend_one(job, WEFT_BAKED_CLOTH, WEFT_BAKED_CLOTH, PART_BOTH, err);
}

weft_err weft_blend(weft_baked *below, const weft_baked *above, const float *mask, double alpha,
                    unsigned channels, bool reorient, weft_error *err)
{
    blend_job job = {
        .below = below, .above = above, .mask = mask, .alpha = (float)alpha, .reorient = reorient};
    if (above->width && below->width && (above->width != below->width || above->height != below->height))
        return weft_fail(err, WEFT_ERR_MISMATCH, "%s: its layers have different sizes", below->name);
    if (channels & WEFT_BLEND_SPECULAR)
        WEFT_TRY(blend_types(below, above, err));
    if (below->two_lobes || ((channels & WEFT_BLEND_SPECULAR) && needs_two_lobes(below, above)))
        return blend_two_lobes(&job, channels, err);
    if (channels & WEFT_BLEND_SPECULAR)
        WEFT_TRY(blend_specular_lobe(&job, err));
    for (int k = 0; k < WEFT_BAKED_COUNT; k++) {
        const weft_baked_kind kind = (weft_baked_kind)k;
        const bool is_lobe =
            kind == WEFT_BAKED_ROUGHNESS || kind == WEFT_BAKED_ANISOTROPY || kind == WEFT_BAKED_TANGENT;
        if (!is_lobe && (group_of(kind) & channels))
            WEFT_TRY(blend_one(&job, kind, kind, PART_BOTH, err));
    }
    return WEFT_OK;
}
