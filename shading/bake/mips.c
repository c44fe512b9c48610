#include "shading/bake/mips.h"

#include "core/mem.h"
#include "core/parallel.h"
#include "shading/bake/gloss.h"
#include "shading/bake/mip_closest.h"
#include "shading/bake/mip_sums.h"
#include "shading/bake/normal_filter.h"
#include "shading/bake/vmf.h"

#include <math.h>
#include <string.h>

const char weft_mip_rule_names[] = "closest|length|vmf|vmf-consistent|toksvig|none";

/* A footprint beyond this is read in strides: a distribution of 4096 slopes is known well enough. */
enum { MAX_SIDE = 64, MAX_TEXELS = MAX_SIDE * MAX_SIDE };

weft_mip_options weft_mip_defaults(void)
{
    return (weft_mip_options){.rule = WEFT_MIP_CLOSEST};
}

/* -- one footprint ------------------------------------------------------------------------------------ */

static void gather(weft_mip_footprint *f, const double n[3], double alpha, double weight, weft_mip_rule rule)
{
    const double length = rule == WEFT_MIP_LENGTH ? 1 - weft_ggx_missing_length(alpha) : 0;
    f->weight += weight;
    f->alpha += weight * alpha;
    f->alpha2 += weight * alpha * alpha;
    for (int c = 0; c < 3; c++) {
        f->mean[c] += weight * n[c];
        f->shortened[c] += weight * length * n[c];
    }
}

static double norm(const double v[3])
{
    return sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
}

/* alpha whose GGX has a mean normal of length 1 - missing, by the gloss table's exact inverse. */
static double alpha_of_missing(double missing)
{
    if (missing >= 1.0 / 3)
        return 1;
    double low = 0, high = 1;
    for (int k = 0; k < 48; k++) {
        const double middle = 0.5 * (low + high);
        *(weft_ggx_missing_length(middle) < missing ? &low : &high) = middle;
    }
    return high;
}

static double by_sums(weft_mip_rule rule, const weft_mip_footprint *f)
{
    const double r = fmin(norm(f->mean) / f->weight, 1), alpha2 = f->alpha2 / f->weight;
    switch (rule) {
    case WEFT_MIP_LENGTH:
        return alpha_of_missing(1 - norm(f->shortened) / f->weight);
    case WEFT_MIP_VMF:
        return fmin(weft_vmf_roughness(sqrt(alpha2), weft_vmf_kappa(r), WEFT_VMF_LISTING), 1);
    case WEFT_MIP_VMF_CONSISTENT:
        return fmin(weft_vmf_roughness(sqrt(alpha2), weft_vmf_kappa(r), WEFT_VMF_CONSISTENT), 1);
    case WEFT_MIP_TOKSVIG: {
        const double power = fmax(2 / alpha2 - 2, 0); /* S-CNV-04 */
        return sqrt(2 / (power * weft_toksvig_factor(r, power) + 2));
    }
    case WEFT_MIP_CLOSEST:
    case WEFT_MIP_NONE:
        break;
    }
    return f->alpha / f->weight;
}

/* Slope of a normal against the mean normal (unit), squared: tan^2 of the angle between them. */
static inline float slope2(const float n[3], const double mean[3])
{
    const double c = (double)n[0] * mean[0] + (double)n[1] * mean[1] + (double)n[2] * mean[2];
    const double s2 = fmax(1 - c * c, 0), c2 = fmax(c, 0.01);
    return (float)(s2 / (c2 * c2));
}

double weft_mip_roughness(weft_mip_rule rule, int n, const float (*normals)[3], const float *weights,
                          const float *alphas)
{
    weft_mip_footprint f = {0};
    for (int i = 0; i < n; i++) {
        const double v[3] = {(double)normals[i][0], (double)normals[i][1], (double)normals[i][2]};
        gather(&f, v, (double)alphas[i], (double)weights[i], rule);
    }
    if (rule != WEFT_MIP_CLOSEST)
        return by_sums(rule, &f);
    float d2[MAX_TEXELS], a2[MAX_TEXELS], w[MAX_TEXELS];
    const double length = norm(f.mean);
    double mean[3] = {0, 0, 1};
    for (int c = 0; c < 3 && length > 0; c++)
        mean[c] = f.mean[c] / length;
    const int kept = n < MAX_TEXELS ? n : MAX_TEXELS;
    for (int i = 0; i < kept; i++) {
        const int from = (int)((long)i * n / kept);
        d2[i] = slope2(normals[from], mean);
        a2[i] = alphas[from] * alphas[from];
        w[i] = weights[from];
    }
    return fmin(weft_mip_closest(kept, d2, a2, w), 1);
}

/* -- levels of normals and roughness ------------------------------------------------------------------ */

typedef struct level_job {
    weft_baked *baked;
    weft_mip_rule rule;
    int level;
    float *scratch;          /* per band: [3][MAX_TEXELS] */
    double *sums;            /* per band: [WEFT_MIP_SUMS][w0] */
    const float *anisotropy; /* [w0] the constant, for where there is no map */
} level_job;

static double alpha_at(const weft_baked *b, int x, int y)
{
    const weft_baked_map *const map = &b->maps[WEFT_BAKED_ROUGHNESS];
    return (double)(map->n_mips > 0 ? weft_image_row(&map->mips[0], 0, y)[x] : map->constant[0]);
}

static double anisotropy_at(const weft_baked *b, int x, int y)
{
    const weft_baked_map *const map = &b->maps[WEFT_BAKED_ANISOTROPY];
    return (double)(map->n_mips > 0 ? weft_image_row(&map->mips[0], 0, y)[x] : map->constant[0]);
}

static double closest_of(const level_job *job, const weft_mip_extent *ex, const weft_mip_extent *ey,
                         const double mean[3], float *scratch)
{
    const weft_image *const normal = &job->baked->maps[WEFT_BAKED_NORMAL].mips[0];
    const int step_x = (ex->end - ex->begin + MAX_SIDE - 1) / MAX_SIDE;
    const int step_y = (ey->end - ey->begin + MAX_SIDE - 1) / MAX_SIDE;
    float *const d2 = scratch, *const a2 = scratch + (size_t)MAX_TEXELS, *const w = a2 + (size_t)MAX_TEXELS;
    int n = 0;
    for (int y = ey->begin; y < ey->end; y += step_y)
        for (int x = ex->begin; x < ex->end; x += step_x, n++) {
            const float v[3] = {weft_image_row(normal, 0, y)[x], weft_image_row(normal, 1, y)[x],
                                weft_image_row(normal, 2, y)[x]};
            const double alpha = alpha_at(job->baked, x, y);
            d2[n] = slope2(v, mean);
            a2[n] = (float)(alpha * alpha * (1 - anisotropy_at(job->baked, x, y)));
            w[n] = (float)(weft_mip_share(ex, x) * weft_mip_share(ey, y));
        }
    return weft_mip_closest(n, d2, a2, w);
}

/* What the normals add is added to both axes: alpha_t^2 + more, alpha_b^2 + more. */
static void store_lobe(const level_job *job, int x, int y, double alpha, const weft_mip_footprint *f)
{
    weft_baked_map *const maps = job->baked->maps;
    weft_baked_map *const s = &maps[WEFT_BAKED_ANISOTROPY];
    float *const out = weft_image_row(&maps[WEFT_BAKED_ROUGHNESS].mips[job->level], 0, y);
    if (s->n_mips == 0 && !(s->constant[0] > 0)) {
        out[x] = (float)fmin(alpha, 1);
        return;
    }
    const double ratio =
        1 - (double)(s->n_mips > 0 ? weft_image_row(&s->mips[job->level], 0, y)[x] : s->constant[0]);
    const double base2 = f->alpha2 / f->weight, more = fmax(alpha * alpha - base2, 0);
    const double along2 = base2 / fmax(ratio, 1e-3) + more, across2 = base2 * ratio + more;
    out[x] = (float)fmin(sqrt(along2), 1);
    if (s->n_mips > 0)
        weft_image_row(&s->mips[job->level], 0, y)[x] = (float)fmax(1 - sqrt(across2 / along2), 0);
}

static void normal_rows(void *context, int band, int begin, int end)
{
    const level_job *const job = context;
    weft_baked_map *const maps = job->baked->maps;
    weft_image *const normal = &maps[WEFT_BAKED_NORMAL].mips[job->level];
    const bool shortened = job->rule == WEFT_MIP_LENGTH;
    float *const scratch = job->scratch + (size_t)band * 3 * MAX_TEXELS;
    double *const sums = job->sums + (size_t)band * WEFT_MIP_SUMS * (size_t)job->baked->width;
    for (int y = begin; y < end; y++) {
        const weft_mip_extent ey = weft_mip_extent_of(y, normal->height, job->baked->height);
        weft_mip_sum_rows(job->baked, &ey, job->anisotropy, shortened, sums);
        for (int x = 0; x < normal->width; x++) {
            const weft_mip_extent ex = weft_mip_extent_of(x, normal->width, job->baked->width);
            const weft_mip_footprint f = weft_mip_sum_columns(&ey, &ex, shortened, job->baked->width, sums);
            const double length = norm(f.mean);
            double mean[3] = {0, 0, 1};
            for (int c = 0; c < 3; c++) {
                mean[c] = length > 0 ? f.mean[c] / length : mean[c];
                weft_image_row(normal, c, y)[x] = (float)mean[c];
            }
            weft_image_row(&maps[WEFT_BAKED_NORMAL_LENGTH].mips[job->level], 0, y)[x] =
                (float)fmin(length / f.weight, 1);
            const double alpha = job->rule == WEFT_MIP_CLOSEST ? closest_of(job, &ex, &ey, mean, scratch)
                                                               : by_sums(job->rule, &f);
            store_lobe(job, x, y, alpha, &f);
        }
    }
}

/* -- levels of everything else ------------------------------------------------------------------------ */

typedef struct mean_job {
    const weft_image *from;
    weft_image *to;
} mean_job;

static void mean_rows(void *context, int band, int begin, int end)
{
    const mean_job *const job = context;
    (void)band;
    for (int p = 0; p < job->to->planes; p++)
        for (int y = begin; y < end; y++) {
            const weft_mip_extent ey = weft_mip_extent_of(y, job->to->height, job->from->height);
            for (int x = 0; x < job->to->width; x++) {
                const weft_mip_extent ex = weft_mip_extent_of(x, job->to->width, job->from->width);
                double sum = 0, weight = 0;
                for (int v = ey.begin; v < ey.end; v++)
                    for (int u = ex.begin; u < ex.end; u++) {
                        const double w = weft_mip_share(&ex, u) * weft_mip_share(&ey, v);
                        sum += w * (double)weft_image_row(job->from, p, v)[u];
                        weight += w;
                    }
                weft_image_row(job->to, p, y)[x] = (float)(sum / weight);
            }
        }
}

static void make_unit(weft_image *image, int planes)
{
    const size_t n = weft_image_plane_size(image);
    for (size_t i = 0; i < n; i++) {
        double squares = 0;
        for (int p = 0; p < planes; p++)
            squares += (double)image->data[(size_t)p * n + i] * (double)image->data[(size_t)p * n + i];
        for (int p = 0; p < planes; p++)
            image->data[(size_t)p * n + i] =
                squares > 0 ? (float)((double)image->data[(size_t)p * n + i] / sqrt(squares))
                            : p == planes - 1;
    }
}

static double covered(const weft_image *image, double scale, double at)
{
    size_t count = 0;
    for (size_t i = 0; i < weft_image_plane_size(image); i++)
        count += (double)image->data[i] * scale > at;
    return (double)count / (double)weft_image_plane_size(image);
}

/* The factor with which as many texels pass the test as in level 0 (Castano 2010). */
static void keep_coverage(const weft_image *level0, weft_image *level, double at)
{
    const double wanted = covered(level0, 1, at);
    double low = 0, high = 8;
    for (int k = 0; k < 24; k++) {
        const double middle = 0.5 * (low + high);
        *(covered(level, middle, at) < wanted ? &low : &high) = middle;
    }
    const double above = covered(level, high, at) - wanted, below = wanted - covered(level, low, at);
    const double scale = above <= below ? high : low;
    for (size_t i = 0; i < weft_image_plane_size(level); i++)
        level->data[i] = fminf((float)((double)level->data[i] * scale), 1);
}

static weft_err begin_level(weft_baked *baked, weft_baked_kind kind, int level, weft_error *err)
{
    weft_baked_map *const map = &baked->maps[kind];
    const int w = baked->width >> level, h = baked->height >> level;
    weft_image_fini(&map->mips[level]);
    return weft_image_init(&map->mips[level], w > 0 ? w : 1, h > 0 ? h : 1, weft_baked_rows[kind].planes,
                           err);
}

/* From the level above when that is exactly half: the same mean for a quarter of the work. */
static weft_err average_level(weft_baked *baked, weft_baked_kind kind, int level,
                              const weft_mip_options *options, weft_error *err)
{
    weft_baked_map *const map = &baked->maps[kind];
    WEFT_TRY(begin_level(baked, kind, level, err));
    const bool halves = baked->width % (1 << level) == 0 && baked->height % (1 << level) == 0;
    const bool is_plain = kind != WEFT_BAKED_OPACITY && kind != WEFT_BAKED_TANGENT &&
                          kind != WEFT_BAKED_ANISOTROPY && kind != WEFT_BAKED_BENT_CONE &&
                          kind != WEFT_BAKED_DETAIL_NORMAL;
    mean_job job = {&map->mips[halves && is_plain ? level - 1 : 0], &map->mips[level]};
    weft_parallel_rows(map->mips[level].height, mean_rows, &job);
    if (kind == WEFT_BAKED_TANGENT)
        make_unit(&map->mips[level], 2);
    if (kind == WEFT_BAKED_BENT_CONE || kind == WEFT_BAKED_DETAIL_NORMAL)
        make_unit(&map->mips[level], 3);
    if (kind == WEFT_BAKED_OPACITY && options->coverage_at > 0)
        keep_coverage(&map->mips[0], &map->mips[level], options->coverage_at);
    return WEFT_OK;
}

static weft_err spread_roughness(weft_baked *baked, weft_baked_kind kind, weft_error *err)
{
    weft_baked_map *const map = &baked->maps[kind];
    if (map->n_mips > 0)
        return WEFT_OK;
    WEFT_TRY(weft_baked_add(baked, kind, baked->width, baked->height, err));
    for (size_t i = 0; i < weft_image_plane_size(&map->mips[0]); i++)
        map->mips[0].data[i] = map->constant[0];
    return WEFT_OK;
}

/* What all levels of normals need. */
typedef struct filter_scratch {
    float *texels, *anisotropy;
    double *sums;
} filter_scratch;

static void fini_scratch(filter_scratch *s)
{
    weft_free(s->texels);
    weft_free(s->anisotropy);
    weft_free(s->sums);
}

static weft_err init_scratch(filter_scratch *s, const weft_baked *baked, weft_error *err)
{
    const size_t bands = (size_t)weft_parallel_n_bands((baked->height + 1) / 2), width = (size_t)baked->width;
    *s = (filter_scratch){.texels = weft_alloc(bands * 3 * MAX_TEXELS, sizeof *s->texels, err)};
    if (s->texels)
        s->anisotropy = weft_alloc(width, sizeof *s->anisotropy, err);
    if (s->anisotropy)
        s->sums = weft_alloc(bands * WEFT_MIP_SUMS * width, sizeof *s->sums, err);
    for (size_t i = 0; s->sums && i < width; i++)
        s->anisotropy[i] = baked->maps[WEFT_BAKED_ANISOTROPY].constant[0];
    if (s->sums)
        return WEFT_OK;
    fini_scratch(s);
    return WEFT_ERR_NOMEM;
}

static weft_err filter_level(weft_baked *baked, int level, const weft_mip_options *options,
                             const filter_scratch *scratch, weft_error *err)
{
    WEFT_TRY(begin_level(baked, WEFT_BAKED_NORMAL, level, err));
    WEFT_TRY(begin_level(baked, WEFT_BAKED_NORMAL_LENGTH, level, err));
    WEFT_TRY(begin_level(baked, WEFT_BAKED_ROUGHNESS, level, err));
    level_job job = {baked, options->rule, level, scratch->texels, scratch->sums, scratch->anisotropy};
    const int rows = baked->maps[WEFT_BAKED_NORMAL].mips[level].height;
    return weft_parallel_rows_progress(rows, normal_rows, &job, "mips", err);
}

static bool is_filtered(const weft_baked *baked, weft_baked_kind kind)
{
    return (kind == WEFT_BAKED_CLOTH_ROUGHNESS && baked->two_lobes) || kind == WEFT_BAKED_NORMAL ||
           kind == WEFT_BAKED_NORMAL_LENGTH || kind == WEFT_BAKED_ROUGHNESS;
}

/*
 * The cloth part's roughness where two lobes lie side by side: alpha^2 + 2/kappa (S-ORD-22) from the length
 * of the averaged normal.  Its distribution is no GGX, which the other rules are about; and this one costs
 * next to nothing.
 */
static weft_err filter_cloth(weft_baked *baked, int levels, const weft_mip_options *options, weft_error *err)
{
    weft_baked_map *const map = &baked->maps[WEFT_BAKED_CLOTH_ROUGHNESS];
    const bool widens = options->rule != WEFT_MIP_NONE;
    weft_image source;
    WEFT_TRY(spread_roughness(baked, WEFT_BAKED_CLOTH_ROUGHNESS, err));
    WEFT_TRY(weft_image_copy(&source, &map->mips[0], err));
    for (size_t i = 0; widens && i < weft_image_plane_size(&source); i++)
        source.data[i] *= source.data[i];
    weft_err status = WEFT_OK;
    for (int level = 1; level < levels && status == WEFT_OK; level++) {
        status = begin_level(baked, WEFT_BAKED_CLOTH_ROUGHNESS, level, err);
        if (status != WEFT_OK)
            break;
        const float *const lengths = baked->maps[WEFT_BAKED_NORMAL_LENGTH].mips[level].data;
        weft_image *const to = &map->mips[level];
        mean_job job = {&source, to};
        weft_parallel_rows(to->height, mean_rows, &job);
        for (size_t i = 0; widens && i < weft_image_plane_size(to); i++) {
            const double alpha = sqrt((double)to->data[i]),
                         kappa = weft_vmf_kappa(fmin((double)lengths[i], 1));
            to->data[i] = (float)fmin(weft_vmf_roughness(alpha, kappa, WEFT_VMF_CONSISTENT), 1);
        }
    }
    weft_image_fini(&source);
    return status;
}

static void note_means(weft_baked *baked)
{
    for (int k = 0; k < WEFT_BAKED_COUNT; k++) {
        weft_baked_map *const map = &baked->maps[k];
        const size_t n = map->n_mips > 0 ? weft_image_plane_size(&map->mips[0]) : 0;
        for (int p = 0; n > 0 && p < weft_baked_rows[k].planes; p++) {
            double sum = 0;
            for (size_t i = 0; i < n; i++)
                sum += (double)weft_image_plane(&map->mips[0], p)[i];
            map->constant[p] = (float)(sum / (double)n);
        }
    }
}

weft_err weft_mips_make(weft_baked *baked, const weft_mip_options *options, weft_error *err)
{
    const bool bumpy = baked->maps[WEFT_BAKED_NORMAL].n_mips > 0;
    if (baked->width == 0)
        return WEFT_OK;
    int levels = weft_baked_levels(baked->width, baked->height);
    if (options->max_levels > 0 && options->max_levels < levels)
        levels = options->max_levels;
    filter_scratch scratch;
    WEFT_TRY(init_scratch(&scratch, baked, err));
    weft_err status = WEFT_OK;
    if (bumpy && (status = spread_roughness(baked, WEFT_BAKED_ROUGHNESS, err)) == WEFT_OK &&
        (status = weft_baked_add(baked, WEFT_BAKED_NORMAL_LENGTH, baked->width, baked->height, err)) ==
            WEFT_OK)
        for (size_t i = 0; i < weft_image_plane_size(&baked->maps[WEFT_BAKED_NORMAL_LENGTH].mips[0]); i++)
            baked->maps[WEFT_BAKED_NORMAL_LENGTH].mips[0].data[i] = 1;
    for (int level = 1; level < levels && status == WEFT_OK; level++) {
        for (int k = 0; k < WEFT_BAKED_COUNT && status == WEFT_OK;
             k++) /* anisotropy before the lobe needs it */
            if (baked->maps[k].n_mips > 0 && !(bumpy && is_filtered(baked, (weft_baked_kind)k)))
                status = average_level(baked, (weft_baked_kind)k, level, options, err);
        if (status == WEFT_OK && bumpy)
            status = filter_level(baked, level, options, &scratch, err);
    }
    if (status == WEFT_OK && bumpy && baked->two_lobes)
        status = filter_cloth(baked, levels, options, err);
    for (int k = 0; k < WEFT_BAKED_COUNT && status == WEFT_OK; k++)
        if (baked->maps[k].n_mips > 0)
            baked->maps[k].n_mips = levels;
    if (status == WEFT_OK)
        note_means(baked);
    fini_scratch(&scratch);
    return status;
}
