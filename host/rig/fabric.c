/* Weaving the tile, and meeting its surface. */
#include "host/rig/fabric.h"

#include "core/mem.h"
#include "core/parallel.h"
#include "host/rig/scene.h"

#include <assert.h>
#include <string.h>

#define N         WEFT_CLOTH_TEXELS
#define TEXEL_MM  (WEFT_CLOTH_PERIOD_MM / N)
#define MAX_YARNS 64
#define TWO_PI    6.283185307179586

enum { STREAM_YARN = 32, STREAM_NOISE, STREAM_WAVE };

/* One yarn of a system: how it differs from its neighbours. */
typedef struct yarn {
    double bulge, crimp, width; /* factors around 1 */
    double wobble_mm[2], wobble_phase[2];
    double slub_phase, ply_phase;
    double strength;
} yarn;

/* A yarn where it passes a texel row (warp) or column (weft). */
typedef struct yarn_place {
    float centre_mm, half_width_mm, sagitta_mm, axis_mm;
} yarn_place;

/* All warp or all weft yarns of the tile. */
typedef struct yarn_system {
    bool is_warp;
    int n;
    double pitch_mm, other_pitch_mm, bulge_mm, crimp_mm;
    double cover, reach; /* width over pitch; half widths from a yarn's middle at which it still counts */
    const char *sett;
    yarn yarns[MAX_YARNS];
    yarn_place *places; /* [n][N] */
} yarn_system;

typedef struct loom {
    weft_fabric *cloth;
    uint64_t seed;
    yarn_system warp, weft;
    float *openness; /* [COARSE][COARSE] */
} loom;

/* ------------------------------------------------------------------------------------------ noise */

static int wrap(int i, int n)
{
    const int r = i % n;
    return r < 0 ? r + n : r;
}

/* Smooth noise -1..1 with `nx` x `ny` cells in the tile, periodic. */
static double noise(uint64_t seed, int field, double x_mm, double y_mm, int nx, int ny)
{
    const double x = x_mm / WEFT_CLOTH_PERIOD_MM * nx, y = y_mm / WEFT_CLOTH_PERIOD_MM * ny;
    const int i = (int)floor(x), j = (int)floor(y);
    const double fx = x - i, fy = y - j;
    const double sx = fx * fx * (3 - 2 * fx), sy = fy * fy * (3 - 2 * fy);
    double corner[2][2];
    for (int b = 0; b < 2; b++)
        for (int a = 0; a < 2; a++)
            corner[b][a] =
                weft_rig_random(seed, STREAM_NOISE + 16 * (uint64_t)field,
                                (uint64_t)wrap(j + b, ny) * (uint64_t)nx + (uint64_t)wrap(i + a, nx));
    const double top = corner[0][0] + sx * (corner[0][1] - corner[0][0]);
    const double bottom = corner[1][0] + sx * (corner[1][1] - corner[1][0]);
    return 2 * (top + sy * (bottom - top)) - 1;
}

/* ------------------------------------------------------------------------------------------ yarns */

static void spin_yarns(yarn_system *system, uint64_t seed)
{
    for (int k = 0; k < system->n; k++) {
        double r[9];
        for (int i = 0; i < 9; i++)
            r[i] = weft_rig_random(seed, STREAM_YARN + (system->is_warp ? 0 : 16), (uint64_t)(9 * k + i));
        system->yarns[k] = (yarn){
            .bulge = 0.90 + 0.20 * r[0],
            .crimp = 0.88 + 0.24 * r[1],
            .width = 0.93 + 0.09 * r[2],
            .wobble_mm = {0.06 * system->pitch_mm * r[3], 0.04 * system->pitch_mm * r[4]},
            .wobble_phase = {TWO_PI * r[5], TWO_PI * r[6]},
            .slub_phase = TWO_PI * r[7],
            .ply_phase = TWO_PI * r[8],
            .strength = 0.985 + 0.03 * r[1],
        };
    }
}

/* +1 where yarn k of the system is on top at its crossing m, else -1. */
static double on_top(const weft_weave *weave, const yarn_system *system, int k, int m)
{
    const int row = system->is_warp ? m : k, column = system->is_warp ? k : m;
    const bool warp_up = weave->draft[wrap(row, weave->n_draft)][wrap(column, weave->n_draft)] == 'X';
    return warp_up == system->is_warp ? 1 : -1;
}

/* Where a point is on a yarn. */
typedef struct on_yarn {
    double height; /* mm, of the smooth yarn; -1e9 beside it */
    double next;   /* of the second highest of the system */
    double across; /* -1..1 */
    int k;
} on_yarn;

/* Circular arc of the given sagitta over -1..1 times the half width; falls away steeply outside. */
static double lens_section(double u, double half_width, double sagitta)
{
    const double a = fabs(u);
    if (a >= 1)
        return -1.2 * (a - 1) * half_width;
    const double radius = (half_width * half_width + sagitta * sagitta) / (2 * sagitta);
    const double d = a * half_width;
    return sqrt(radius * radius - d * d) - (radius - sagitta);
}

/* Where yarn k runs: it wanders, swells and dives under the yarns of the other system. */
static void place_yarn(const weft_weave *weave, yarn_system *system, int k)
{
    const yarn *const y = &system->yarns[k];
    for (int texel = 0; texel < N; texel++) {
        const double along = texel * TEXEL_MM, turn = TWO_PI * along / WEFT_CLOTH_PERIOD_MM;
        const double q = along / system->other_pitch_mm - 0.5;
        const int m = (int)floor(q);
        const double blend = 0.5 - 0.5 * cos(0.5 * TWO_PI * (q - m));
        const double before = on_top(weave, system, k, m), after = on_top(weave, system, k, m + 1);
        const double slub =
            1 + 0.05 * sin(3 * turn + y->slub_phase) + 0.03 * sin(11 * turn + 2 * y->slub_phase);
        system->places[k * N + texel] = (yarn_place){
            .centre_mm =
                (float)((k + 0.5) * system->pitch_mm + y->wobble_mm[0] * sin(2 * turn + y->wobble_phase[0]) +
                        y->wobble_mm[1] * sin(5 * turn + y->wobble_phase[1])),
            .half_width_mm = (float)(0.5 * system->pitch_mm * system->cover * y->width * slub),
            .sagitta_mm = (float)(system->bulge_mm * y->bulge * slub),
            .axis_mm = (float)(system->crimp_mm * y->crimp * (before + (after - before) * blend)),
        };
    }
}

/* The highest yarn of a system at a point; `along` is the texel with the yarns, `across` mm over them. */
static on_yarn highest_yarn(const yarn_system *system, int along, double across)
{
    on_yarn best = {.height = -1e9, .next = -1e9};
    const int nearest = (int)floor(across / system->pitch_mm);
    for (int i = nearest - 1; i <= nearest + 1; i++) {
        const int k = i < 0 ? i + system->n : i >= system->n ? i - system->n : i;
        const yarn_place *const place = &system->places[k * N + along];
        const double centre = (double)place->centre_mm + (i - k) * system->pitch_mm;
        const double half_width = (double)place->half_width_mm;
        const double u = (across - centre) / half_width;
        if (fabs(u) > system->reach)
            continue;
        const double h = (double)place->axis_mm + lens_section(u, half_width, (double)place->sagitta_mm);
        if (h > best.height)
            best = (on_yarn){.height = h, .next = best.height, .across = u, .k = k};
        else
            best.next = fmax(best.next, h);
    }
    return best;
}

static uint8_t to_byte(double x)
{
    return (uint8_t)lround(fmin(fmax(x, 0), 1) * 255);
}

/* Between the yarns of an open cloth: the ground. */
static void open_texel(const weft_weave *weave, weft_fabric_texel *texel)
{
    texel->height = fmaxf(texel->height, (float)-WEFT_CLOTH_GROUND_MM);
    texel->dye = (uint8_t)weft_weave_n_dyes(weave);
    texel->strength = to_byte(0.5);
}

/* Woven surface at a texel: the higher of warp and weft, with the ribs of its twist. */
static void weave_texel(const loom *l, int column, int row, weft_fabric_texel *texel)
{
    const weft_weave *const weave = l->cloth->weave;
    const double x = column * TEXEL_MM, y = row * TEXEL_MM;
    const on_yarn warp = highest_yarn(&l->warp, row, x);
    const on_yarn weft = highest_yarn(&l->weft, column, y);
    const bool is_warp = warp.height >= weft.height;
    const yarn_system *const system = is_warp ? &l->warp : &l->weft;
    const on_yarn *const top = is_warp ? &warp : &weft;
    const yarn *const spun = &system->yarns[top->k];
    const double along = is_warp ? y : x;
    const double second = fmax(fmin(warp.height, weft.height), top->next);
    const double gap = top->height - second;
    /* Fibres of two yarns fill the seam between them: a smooth maximum instead of a knife's edge.  Fine
       relief fades out there, so that the seam does not become a cliff. */
    const double reach = fmin(weave->warp_bulge_mm, weave->weft_bulge_mm) * 2 / 3;
    const double near = fmax(1 - gap / reach, 0);
    const double seam = 0.25 * reach * near * near;
    const double margin = fmin(gap / (0.3 * reach), 1);
    const double edge = sqrt(fmax(1 - top->across * top->across, 0));
    const double fade = margin * fmin(edge * 2, 1);
    const double arc = asin(fmin(fmax(top->across, -1), 1)) * system->pitch_mm / 2;
    const double twist = weave->ply_angle_deg * TWO_PI / 360;
    const double ply =
        cos(TWO_PI / weave->ply_mm * (arc * cos(twist) - along * sin(twist)) + spun->ply_phase);
    const int fine = (int)(WEFT_CLOTH_PERIOD_MM / 0.2), coarse = (int)(WEFT_CLOTH_PERIOD_MM / 0.6);
    const double hair =
        is_warp ? noise(l->seed, 0, x, y, fine, coarse) : noise(l->seed, 1, x, y, coarse, fine);
    texel->height = (float)(top->height + seam +
                            fade * (weave->ply_relief_mm * ply + 0.35 * weave->ply_relief_mm * hair));
    texel->dye = (uint8_t)(system->sett[top->k % (int)strlen(system->sett)] - '0');
    const double patchy = noise(l->seed, is_warp ? 2 : 3, x, y, 30, 30);
    const double strength = spun->strength + 0.03 * hair + 0.01 * patchy;
    texel->strength = to_byte((strength - 0.75) * 2);
    const double angle =
        (is_warp ? 0.25 * TWO_PI : 0) + (is_warp ? 1 : -1) * 0.4 * twist * (is_warp ? 1 : -1);
    texel->fibre = (uint8_t)((int)lround(angle / (0.5 * TWO_PI) * 256) & 255);
    /* The flank of one yarn, drawn down to the ground, may hide the other where that dives under it. */
    if (weave->cover > 0 && fabs(warp.across) >= 1 && fabs(weft.across) >= 1)
        open_texel(weave, texel);
}

/* Corduroy: ribs of cut pile along y, rounded tops, steep flanks down to the ground weave. */
static void wale_texel(const loom *l, double x, double y, weft_fabric_texel *texel)
{
    const weft_weave *const weave = l->cloth->weave;
    const double turn = TWO_PI * y / WEFT_CLOTH_PERIOD_MM;
    const int k = wrap((int)floor(x / weave->warp_pitch_mm), l->warp.n);
    const yarn *const wale = &l->warp.yarns[k];
    const double wander =
        0.04 * sin(2 * turn + TWO_PI * x / WEFT_CLOTH_PERIOD_MM) + 0.05 * noise(l->seed, 4, x, y, 24, 32);
    const double u =
        2 * ((x + wander) / weave->warp_pitch_mm - floor((x + wander) / weave->warp_pitch_mm)) - 1;
    /* 1 - |u|^p: broad top, flank falling to the ground at u = +-0.92. */
    const double a = fmin(fabs(u) / 0.92, 1);
    const double profile = 1 - a * a * a * (0.35 + 0.65 * a);
    const double tuft = noise(l->seed, 5, x, y, 130, 100), pile = noise(l->seed, 6, x, y, 300, 300);
    const double height = weave->warp_bulge_mm * profile * (1 + 0.04 * noise(l->seed, 7, x, y, 16, 40));
    texel->height = (float)(height + weave->ply_relief_mm * profile * (1.2 * tuft + 0.35 * pile));
    texel->dye = 0;
    texel->strength = to_byte((0.97 + 0.03 * (wale->strength - 1) + 0.03 * pile + 0.03 * tuft - 0.75) * 2);
    texel->fibre = 128;
}

/* ------------------------------------------------------------------------------------------ tile passes */

static weft_fabric_texel *texel_at(const weft_fabric *cloth, int row, int column)
{
    return &cloth->texels[(size_t)(row & (N - 1)) * N + (size_t)(column & (N - 1))];
}

static void weave_rows(void *context, int band, int begin, int end)
{
    (void)band;
    const loom *const l = context;
    for (int row = begin; row < end; row++)
        for (int column = 0; column < N; column++) {
            weft_fabric_texel *const texel = texel_at(l->cloth, row, column);
            if (l->cloth->weave->wales)
                wale_texel(l, column * TEXEL_MM, row * TEXEL_MM, texel);
            else
                weave_texel(l, column, row, texel);
        }
}

static void slope_rows(void *context, int band, int begin, int end)
{
    (void)band;
    const loom *const l = context;
    const float scale = (float)(0.5 / TEXEL_MM);
    for (int row = begin; row < end; row++)
        for (int column = 0; column < N; column++) {
            weft_fabric_texel *const texel = texel_at(l->cloth, row, column);
            texel->slope_x = scale * (texel_at(l->cloth, row, column + 1)->height -
                                      texel_at(l->cloth, row, column - 1)->height);
            texel->slope_y = scale * (texel_at(l->cloth, row + 1, column)->height -
                                      texel_at(l->cloth, row - 1, column)->height);
            l->cloth->height[(size_t)row * N + (size_t)column] = texel->height;
        }
}

/* Openness is smooth: one value for 4 x 4 texels, interpolated between. */
#define COARSE (N / 4)

/* Cosine-weighted share of the sky above the horizon of eight directions, seen by a level patch:
   1 - mean sin^2(horizon elevation). */
static double openness_at(const weft_fabric *cloth, int row, int column)
{
    static const double step_mm[] = {0.06, 0.12, 0.2, 0.3, 0.45, 0.65, 0.9, 1.3, 1.9};
    const double here = texel_at(cloth, row, column)->height;
    double closed = 0;
    for (int direction = 0; direction < 8; direction++) {
        const double c = cos(TWO_PI * direction / 8), s = sin(TWO_PI * direction / 8);
        double tangent = 0;
        for (int i = 0; i < (int)(sizeof step_mm / sizeof step_mm[0]); i++) {
            const double d = step_mm[i] / TEXEL_MM;
            const float there =
                texel_at(cloth, row + (int)lround(s * d), column + (int)lround(c * d))->height;
            tangent = fmax(tangent, ((double)there - here) / step_mm[i]);
        }
        closed += tangent * tangent / (1 + tangent * tangent);
    }
    return 1 - closed / 8;
}

static void openness_rows(void *context, int band, int begin, int end)
{
    (void)band;
    const loom *const l = context;
    for (int row = begin; row < end; row++)
        for (int column = 0; column < COARSE; column++)
            l->openness[(size_t)row * COARSE + (size_t)column] =
                (float)openness_at(l->cloth, 4 * row, 4 * column);
}

static void spread_openness_rows(void *context, int band, int begin, int end)
{
    (void)band;
    const loom *const l = context;
    for (int row = begin; row < end; row++)
        for (int column = 0; column < N; column++) {
            const int i = row / 4, j = column / 4, i1 = (i + 1) % COARSE, j1 = (j + 1) % COARSE;
            const float fy = (float)(row % 4) / 4, fx = (float)(column % 4) / 4;
            const float *const o = l->openness;
            const float top = (1 - fx) * o[i * COARSE + j] + fx * o[i * COARSE + j1];
            const float bottom = (1 - fx) * o[i1 * COARSE + j] + fx * o[i1 * COARSE + j1];
            texel_at(l->cloth, row, column)->openness = to_byte((double)((1 - fy) * top + fy * bottom));
        }
}

/* Brings the mean height to 0 and gathers the extremes and the share of each dye. */
static void level(weft_fabric *cloth)
{
    const size_t n = (size_t)N * N;
    double sum = 0;
    for (size_t i = 0; i < n; i++)
        sum += (double)cloth->texels[i].height;
    const float mean = (float)(sum / (double)n);
    cloth->lowest_mm = 1e9F;
    cloth->highest_mm = -1e9F;
    for (size_t i = 0; i < n; i++) {
        weft_fabric_texel *const texel = &cloth->texels[i];
        texel->height -= mean;
        cloth->lowest_mm = fminf(cloth->lowest_mm, texel->height);
        cloth->highest_mm = fmaxf(cloth->highest_mm, texel->height);
        cloth->dye_share[texel->dye] += (0.75 + texel->strength / 510.0) / (double)n;
    }
}

static void find_steepest(weft_fabric *cloth)
{
    float steepest2 = 0;
    for (size_t i = 0; i < (size_t)N * N; i++) {
        const weft_fabric_texel *const t = &cloth->texels[i];
        steepest2 = fmaxf(steepest2, t->slope_x * t->slope_x + t->slope_y * t->slope_y);
    }
    cloth->steepest = sqrtf(steepest2);
}

/* The long waves in which the fabric lies, and its turn on the table. */
static void lay_down(weft_fabric *cloth, uint64_t seed)
{
    const double turn = 0.03 * (2 * weft_rig_random(seed, STREAM_WAVE, 0) - 1);
    cloth->turn_cos = (float)cos(turn);
    cloth->turn_sin = (float)sin(turn);
    for (int i = 0; i < 256; i++) {
        cloth->fibre[i][0] = (float)cos(0.5 * TWO_PI * i / 256);
        cloth->fibre[i][1] = (float)sin(0.5 * TWO_PI * i / 256);
    }
    for (int term = 0; term < 3; term++) {
        const double wavelength = 35 + 25 * term;
        const double angle = TWO_PI * weft_rig_random(seed, STREAM_WAVE, 10 + (uint64_t)term);
        cloth->wave_k[term][0] = (float)(TWO_PI / wavelength * cos(angle));
        cloth->wave_k[term][1] = (float)(TWO_PI / wavelength * sin(angle));
        for (int c = 0; c < 2; c++) {
            cloth->wave[term][c][0] = (float)(0.10 + 0.08 * term);
            cloth->wave[term][c][1] =
                (float)(TWO_PI * weft_rig_random(seed, STREAM_WAVE, 20 + 2 * (uint64_t)term + (uint64_t)c));
        }
    }
}

int weft_weave_n_dyes(const weft_weave *weave)
{
    int n = 0;
    while (n < WEFT_CLOTH_MAX_DYES && weave->dyes[n])
        n++;
    return n;
}

static yarn_system make_system(const weft_weave *weave, bool is_warp)
{
    const double pitch = is_warp ? weave->warp_pitch_mm : weave->weft_pitch_mm;
    const yarn_system system = {
        .is_warp = is_warp,
        .n = (int)lround(WEFT_CLOTH_PERIOD_MM / pitch),
        .pitch_mm = pitch,
        .other_pitch_mm = is_warp ? weave->weft_pitch_mm : weave->warp_pitch_mm,
        .bulge_mm = is_warp ? weave->warp_bulge_mm : weave->weft_bulge_mm,
        .crimp_mm = is_warp ? weave->warp_crimp_mm : weave->weft_crimp_mm,
        .cover = weave->cover > 0 ? weave->cover : 1,
        .reach = weave->cover > 0 ? 3 : 1.3,
        .sett = is_warp ? weave->warp_sett : weave->weft_sett,
    };
    assert(system.n <= MAX_YARNS && fabs(system.n * pitch - WEFT_CLOTH_PERIOD_MM) < 1e-9);
    assert(system.n % (int)strlen(system.sett) == 0 && (weave->wales || system.n % weave->n_draft == 0));
    return system;
}

weft_err weft_fabric_init(weft_fabric *cloth, const weft_weave *weave, uint64_t seed, weft_error *err)
{
    weft_err status = WEFT_ERR_NOMEM;
    *cloth = (weft_fabric){.weave = weave};
    loom *const l = weft_alloc(1, sizeof *l, err);
    float *const openness = weft_alloc((size_t)COARSE * COARSE, sizeof *openness, err);
    cloth->texels = weft_alloc((size_t)N * N, sizeof *cloth->texels, err);
    cloth->height = weft_alloc((size_t)N * N, sizeof *cloth->height, err);
    if (!l || !openness || !cloth->texels || !cloth->height)
        goto out;
    *l = (loom){.cloth = cloth, .seed = seed, .openness = openness};
    l->warp = make_system(weave, true);
    l->weft = make_system(weave, false);
    yarn_system *const systems[2] = {&l->warp, &l->weft};
    for (int i = 0; i < 2; i++) {
        spin_yarns(systems[i], seed);
        systems[i]->places = weft_alloc((size_t)systems[i]->n * N, sizeof(yarn_place), err);
        if (!systems[i]->places)
            goto out;
        for (int k = 0; k < systems[i]->n && !weave->wales; k++)
            place_yarn(weave, systems[i], k);
    }
    weft_parallel_rows(N, weave_rows, l);
    level(cloth);
    weft_parallel_rows(N, slope_rows, l);
    find_steepest(cloth);
    weft_parallel_rows(COARSE, openness_rows, l);
    weft_parallel_rows(N, spread_openness_rows, l);
    lay_down(cloth, seed);
    status = WEFT_OK;
out:
    if (l) {
        weft_free(l->warp.places);
        weft_free(l->weft.places);
    }
    weft_free(openness);
    weft_free(l);
    if (status != WEFT_OK)
        weft_fabric_fini(cloth);
    return status;
}

void weft_fabric_fini(weft_fabric *cloth)
{
    weft_free(cloth->texels);
    weft_free(cloth->height);
    *cloth = (weft_fabric){0};
}
