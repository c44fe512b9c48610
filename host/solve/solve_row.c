#include "host/solve/solve_row.h"

#include "core/clones.h"

#include <math.h>
#include <string.h>

enum {
    LANES = WEFT_SOLVE_LANES,
    AHEAD = 256,
    STRIDE_MAX = (WEFT_INCIDENCE_PLANES(WEFT_LIGHTS_MAX) + 15) / 16 * 16
};

/* The nodes of one row of pixels under a block: at most 16 cells, so 17 nodes. */
typedef struct block_nodes {
    float at[LANES + 1][STRIDE_MAX];
    float part[LANES]; /* of the way to the next node */
} block_nodes;

WEFT_INLINE void interpolate_nodes(const weft_incidence *inc, int step_log2, int row, int block,
                                   block_nodes *to)
{
    const int node_row = row >> step_log2, n = LANES >> step_log2;
    const float t = (float)(row - (node_row << step_log2)) / (float)(1 << step_log2);
    const size_t row_floats = (size_t)inc->columns * (size_t)inc->stride;
    const float *const top = inc->nodes + (size_t)node_row * row_floats;
    for (int i = 0; i <= n; i++) {
        const float *const a = top + ((size_t)block * (size_t)n + (size_t)i) * (size_t)inc->stride;
        const float *const b = a + row_floats;
        for (int p = 0; p < inc->stride; p += LANES)
#pragma omp simd
            for (int k = 0; k < LANES; k++)
                to->at[i][p + k] = a[p + k] + t * (b[p + k] - a[p + k]);
    }
}

/* One plane from its nodes to the lanes, cells of 1 << step_log2 lanes.  The step is a constant where this is
 * called, so that the usual one, a single cell, becomes straight vector code. */
WEFT_INLINE void expand(const block_nodes *nodes, int step_log2, int plane, float to[LANES])
{
    const int step = 1 << step_log2;
    if (step_log2 ==
        3) { /* both cells in one vector: two halves would have to be put together by the memory */
        const float a0 = nodes->at[0][plane], d0 = nodes->at[1][plane] - a0;
        const float a1 = nodes->at[1][plane], d1 = nodes->at[2][plane] - a1;
#pragma omp simd
        for (int k = 0; k < LANES; k++)
            to[k] = k < 8 ? a0 + nodes->part[k] * d0 : a1 + (nodes->part[k] - 1) * d1;
        return;
    }
    for (int i = 0; i < LANES >> step_log2; i++) {
        const float a = nodes->at[i][plane], d = nodes->at[i + 1][plane] - a;
#pragma omp simd
        for (int k = 0; k < step; k++)
            to[i * step + k] = a + nodes->part[k] * d;
    }
}

/* The unit vector to the light: y <- y (3 - d^2 y^2) / 2 squares the error of the interpolated reciprocal of
 * the distance d, which is below 1e-4, to less than a float's. */
WEFT_INLINE void point_at_light(const weft_incidence *inc, const block_nodes *nodes, int step_log2, int j,
                                const float x[LANES], const float y[LANES], weft_solve_samples *s)
{
    const float px = inc->light[j][0], py = inc->light[j][1], pz = inc->light[j][2];
    const float far = inc->distant[j] ? 0.0F : 1.0F, dz = pz - far * inc->height_mm;
    float start[LANES] = {0};
    expand(nodes, step_log2, WEFT_INCIDENCE_OVER_DISTANCE(j), start);
#pragma omp simd
    for (int k = 0; k < LANES; k++) {
        const float dx = far > 0 ? px - x[k] : px, dy = far > 0 ? py - y[k] : py;
        const float d2 = dx * dx + dy * dy + dz * dz, half = 0.5F * start[k];
        const float inverse = half * (3 - d2 * (start[k] * start[k]));
        s->at[j].light[0][k] = dx * inverse;
        s->at[j].light[1][k] = dy * inverse;
        s->at[j].light[2][k] = dz * inverse;
    }
}

WEFT_INLINE void point_at_eye(const weft_incidence *inc, const float x[LANES], const float y[LANES],
                              weft_solve_samples *s)
{
    const float z = inc->height_mm;
#pragma omp simd
    for (int k = 0; k < LANES; k++) {
        const float dx = inc->has_eye ? inc->eye[0] - x[k] : 0.0F,
                    dy = inc->has_eye ? inc->eye[1] - y[k] : 0.0F, dz = inc->has_eye ? inc->eye[2] - z : 1.0F;
        const float inverse = 1 / sqrtf(dx * dx + dy * dy + dz * dz);
        s->view[0][k] = dx * inverse;
        s->view[1][k] = dy * inverse;
        s->view[2][k] = dz * inverse;
    }
}

WEFT_INLINE void read_colours(const block_nodes *nodes, int step_log2, int j, const weft_solve_row_in *in,
                              int first, weft_solve_samples *s)
{
    float scale[3][LANES];
    for (int c = 0; c < 3; c++)
        expand(nodes, step_log2, WEFT_INCIDENCE_STRENGTH(j, c), scale[c]);
    const float limit = in->most > 0 ? in->most : INFINITY;
    const float *const red = in->rgb[0] + first, *const green = in->rgb[1] + first,
                       *const blue = in->rgb[2] + first;
#pragma omp simd
    for (int k = 0; k < LANES; k++) {
        const float r = red[k] * scale[0][k], g = green[k] * scale[1][k], b = blue[k] * scale[2][k];
        const float rg = red[k] > green[k] ? red[k] : green[k], most = rg > blue[k] ? rg : blue[k];
        const int finite = fabsf(r) + fabsf(g) + fabsf(b) < 1e30F; /* false for NaN */
        const int dark = most<in->least, clipped = most> limit;
        const int use = finite & !dark & !clipped;
        const float wr = 0.2126F * scale[0][k], wg = 0.7152F * scale[1][k], wb = 0.0722F * scale[2][k];
        const float shot = 0.2126F * wr * r + 0.7152F * wg * g + 0.0722F * wb * b;
        const float variance = in->read * (wr * wr + wg * wg + wb * wb) + in->shot * (shot > 0 ? shot : 0.0F);
        s->at[j].variance[k] = use ? variance : 0.0F;
        s->dark[k] += dark ? 1.0F : 0.0F;
        s->clipped[k] += clipped ? 1.0F : 0.0F;
        s->at[j].weight[k] = use ? 1.0F : 0.0F;
        s->at[j].value[0][k] = use ? r : 0.0F;
        s->at[j].value[1][k] = use ? g : 0.0F;
        s->at[j].value[2][k] = use ? b : 0.0F;
        s->at[j].grey[k] = use ? 0.2126F * r + 0.7152F * g + 0.0722F * b : 0.0F;
    }
}

/* Sites of a mosaic: even columns have colour even, odd ones the other. */
WEFT_INLINE void read_sites(const block_nodes *nodes, int step_log2, int j, const weft_solve_row_in *in,
                            int first, int even, int odd, weft_solve_samples *s)
{
    float scale[2][LANES];
    expand(nodes, step_log2, WEFT_INCIDENCE_STRENGTH(j, even), scale[0]);
    expand(nodes, step_log2, WEFT_INCIDENCE_STRENGTH(j, odd), scale[1]);
    const float limit = in->most > 0 ? in->most : INFINITY;
    const float *const site = in->rgb[0] + first;
#pragma omp simd
    for (int k = 0; k < LANES; k++) {
        const float over = k & 1 ? scale[1][k] : scale[0][k], value = site[k] * over;
        const int dark = site[k]<in->least, clipped = site[k]> limit;
        const int use = (fabsf(value) < 1e30F) & !dark & !clipped;
        const float variance = over * (in->read * over + in->shot * (value > 0 ? value : 0.0F));
        s->at[j].variance[k] = use ? variance : 0.0F;
        s->dark[k] += dark ? 1.0F : 0.0F;
        s->clipped[k] += clipped ? 1.0F : 0.0F;
        s->at[j].weight[k] = use ? 1.0F : 0.0F;
        s->at[j].value[0][k] = use ? value : 0.0F;
        s->at[j].grey[k] = use ? value : 0.0F;
    }
}

WEFT_INLINE void leave_out(weft_solve_samples *s, int j, const int leave[LANES])
{
#pragma omp simd
    for (int k = 0; k < LANES; k++) {
        s->at[j].weight[k] = leave[k] ? 0.0F : s->at[j].weight[k];
        s->at[j].grey[k] = leave[k] ? 0.0F : s->at[j].grey[k];
    }
    for (int c = 0; c < s->n_channels; c++)
#pragma omp simd
        for (int k = 0; k < LANES; k++)
            s->at[j].value[c][k] = leave[k] ? 0.0F : s->at[j].value[c][k];
}

/* Most blocks have none: sixteen bytes are looked at as two words. */
WEFT_INLINE bool any_clipped(const uint8_t *clipped)
{
    uint64_t words[LANES / 8];
    memcpy(words, clipped, sizeof words);
    return (words[0] | words[1]) != 0;
}

WEFT_INLINE void leave_out_clipped(const uint8_t *clipped, int j, weft_solve_samples *s)
{
    int leave[LANES];
#pragma omp simd
    for (int k = 0; k < LANES; k++) {
        leave[k] = clipped[k] != 0;
        s->clipped[k] += leave[k] ? 1.0F : 0.0F;
    }
    leave_out(s, j, leave);
}

/* Takes out what is far darker than the pixel's brightest sample. */
WEFT_INLINE void leave_out_shadow(weft_solve_samples *s, float part)
{
    float limit[LANES] = {0};
    for (int j = 0; j < s->n_lights; j++)
#pragma omp simd
        for (int k = 0; k < LANES; k++)
            limit[k] = s->at[j].grey[k] > limit[k] ? s->at[j].grey[k] : limit[k];
    for (int j = 0; j < s->n_lights; j++) {
        int leave[LANES];
#pragma omp simd
        for (int k = 0; k < LANES; k++) {
            leave[k] = s->at[j].grey[k] < part * limit[k];
            s->dark[k] += leave[k] ? 1.0F : 0.0F;
        }
        leave_out(s, j, leave);
    }
}

/* The last block of a row may be narrower than the lanes: it is worked on in a copy. */
typedef struct margin {
    float rgb[3][LANES];
    uint8_t clipped[LANES];
} margin;

WEFT_INLINE weft_solve_row_in copy_margin(const weft_solve_row_in *in, int first, int n, margin *m)
{
    memset(m, 0, sizeof *m);
    memset(m->clipped, 255, sizeof m->clipped);
    for (int c = 0; c < 3; c++)
        memcpy(m->rgb[c], in->rgb[c] + first, (size_t)n * sizeof(float));
    if (in->clipped)
        memcpy(m->clipped, in->clipped + first, (size_t)n);
    else
        memset(m->clipped, 0, (size_t)n);
    return (weft_solve_row_in){
        {m->rgb[0], m->rgb[1], m->rgb[2]}, m->clipped, in->least, in->most, in->read, in->shot};
}

/* More planes are read at once than the processor follows by itself: asks for what comes AHEAD pixels later
 * (past the row's end: for the next row). */
WEFT_INLINE void fetch_ahead(const weft_solve_row_in *in, int first, int block)
{
    __builtin_prefetch(in->rgb[0] + first + AHEAD);
    if (in->rgb[1] != in->rgb[0]) {
        __builtin_prefetch(in->rgb[1] + first + AHEAD);
        __builtin_prefetch(in->rgb[2] + first + AHEAD);
    }
    if (in->clipped && block % (64 / LANES) == 0)
        __builtin_prefetch(in->clipped + first + AHEAD);
}

WEFT_INLINE void gather_with_step(const weft_solve_plan *plan, int step_log2, int row, int block,
                                  const weft_solve_row_in *in, bool with_view, block_nodes *nodes,
                                  weft_solve_samples *s)
{
    const weft_incidence *const inc = plan->incidence;
    const int first = block * LANES, n = plan->width - first < LANES ? plan->width - first : LANES;
    const int even = weft_cfa_colour(plan->cfa, 0, row), odd = weft_cfa_colour(plan->cfa, 1, row);
    float x[LANES] = {0}, y[LANES] = {0};
    interpolate_nodes(inc, step_log2, row, block, nodes);
    expand(nodes, step_log2, 0, x);
    expand(nodes, step_log2, 1, y);
    if (s->gloss || with_view)
        point_at_eye(inc, x, y, s);
    memset(s->clipped, 0, sizeof s->clipped);
    memset(s->dark, 0, sizeof s->dark);
    for (int j = 0; j < inc->n_lights; j++) {
        margin m;
        const bool whole = n == LANES;
        const weft_solve_row_in source = whole ? in[j] : copy_margin(&in[j], first, n, &m);
        fetch_ahead(&in[j], first, block);
        point_at_light(inc, nodes, step_log2, j, x, y, s);
        if (plan->cfa == WEFT_CFA_NONE)
            read_colours(nodes, step_log2, j, &source, whole ? first : 0, s);
        else
            read_sites(nodes, step_log2, j, &source, whole ? first : 0, even, odd, s);
        if (source.clipped && any_clipped(source.clipped + (whole ? first : 0)))
            leave_out_clipped(source.clipped + (whole ? first : 0), j, s);
    }
    if (plan->shadow > 0)
        leave_out_shadow(s, plan->shadow);
}

WEFT_CLONES static void gather(const weft_solve_plan *plan, int row, int block, const weft_solve_row_in *in,
                               bool with_view, block_nodes *nodes, weft_solve_samples *s)
{
    if (plan->incidence->step_log2 == 4)
        gather_with_step(plan, 4, row, block, in, with_view, nodes, s);
    else if (plan->incidence->step_log2 == 3) /* half size, and cameras of a megapixel */
        gather_with_step(plan, 3, row, block, in, with_view, nodes, s);
    else
        gather_with_step(plan, plan->incidence->step_log2, row, block, in, with_view, nodes, s);
}

static void begin_row(const weft_solve_plan *plan, block_nodes *nodes, weft_solve_samples *samples)
{
    *nodes = (block_nodes){0};
    for (int k = 0; k < LANES; k++)
        nodes->part[k] = (float)k / (float)(1 << plan->incidence->step_log2);
    samples->n_lights = plan->incidence->n_lights;
    samples->n_channels = plan->cfa == WEFT_CFA_NONE ? 3 : 1;
    samples->gloss = plan->gloss;
}

void weft_solve_gather(const weft_solve_plan *plan, int row, int block, const weft_solve_row_in *in,
                       weft_solve_samples *samples)
{
    block_nodes nodes;
    begin_row(plan, &nodes, samples);
    gather(plan, row, block, in, true, &nodes, samples);
}

/* Lanes [0, n) of the answers to columns [first, first + n). */
WEFT_INLINE void scatter_lanes(const weft_solve_answers *a, int n_channels, const weft_solve_row_out *out,
                               int first, int n)
{
    const size_t bytes = (size_t)n * sizeof(float);
    uint8_t lights[LANES], quality[LANES], valid[LANES];
    for (int c = 0; c < 3; c++)
        memcpy(out->normal[c] + first, a->normal[c], bytes);
    for (int c = 0; c < n_channels; c++)
        memcpy(out->albedo[c] + first, a->albedo[c], bytes);
    memcpy(out->residual + first, a->residual, bytes);
    memcpy(out->confidence + first, a->confidence, bytes);
    memcpy(out->angle + first, a->angle, bytes);
#pragma omp simd
    for (int k = 0; k < LANES; k++) {
        lights[k] = (uint8_t)(int)a->n_used[k];
        quality[k] = (uint8_t)a->quality[k];
        valid[k] = a->valid[k] > 0 ? 255 : 0;
    }
    memcpy(out->lights + first, lights, (size_t)n);
    memcpy(out->quality + first, quality, (size_t)n);
    memcpy(out->valid + first, valid, (size_t)n);
}

/* Most blocks are whole, and their copies of a constant size. */
WEFT_CLONES static void scatter(const weft_solve_answers *a, int n_channels, const weft_solve_row_out *out,
                                int first, int n)
{
    if (n == LANES)
        scatter_lanes(a, n_channels, out, first, LANES);
    else
        scatter_lanes(a, n_channels, out, first, n);
}

/* ---- pixels that ask for a search: gathered over the row until they fill the lanes ---- */

typedef struct search_queue {
    int n, column[LANES];
    weft_solve_samples samples;
} search_queue;

static void copy_lane(const weft_solve_samples *from, int k, weft_solve_samples *to, int q)
{
    for (int j = 0; j < from->n_lights; j++) {
        const weft_solve_light *const a = &from->at[j];
        weft_solve_light *const b = &to->at[j];
        for (int c = 0; c < 3; c++)
            b->light[c][q] = a->light[c][k];
        for (int c = 0; c < from->n_channels; c++)
            b->value[c][q] = a->value[c][k];
        b->grey[q] = a->grey[k];
        b->weight[q] = a->weight[k];
        b->variance[q] = a->variance[k];
    }
    for (int c = 0; from->gloss && c < 3; c++)
        to->view[c][q] = from->view[c][k];
    to->clipped[q] = from->clipped[k];
    to->dark[q] = from->dark[k];
}

static void copy_answer(const weft_solve_answers *from, int q, int n_channels, const weft_solve_row_out *out,
                        int column)
{
    for (int c = 0; c < 3; c++)
        out->normal[c][column] = from->normal[c][q];
    for (int c = 0; c < n_channels; c++)
        out->albedo[c][column] = from->albedo[c][q];
    out->residual[column] = from->residual[q];
    out->confidence[column] = from->confidence[q];
    out->angle[column] = from->angle[q];
    out->lights[column] = (uint8_t)from->n_used[q];
    out->quality[column] = (uint8_t)from->quality[q];
    out->valid[column] = from->valid[q] > 0 ? 255 : 0;
}

static void flush(const weft_solve_plan *plan, search_queue *queue, const weft_solve_row_out *out)
{
    weft_solve_answers answers;
    if (queue->n == 0)
        return;
    for (int q = queue->n; q < LANES; q++)
        copy_lane(&queue->samples, 0, &queue->samples, q);
    plan->method->search(&queue->samples, &answers);
    for (int q = 0; q < queue->n; q++)
        copy_answer(&answers, q, queue->samples.n_channels, out, queue->column[q]);
    queue->n = 0;
}

static void enqueue(const weft_solve_plan *plan, const weft_solve_samples *samples,
                    const weft_solve_answers *answers, int first, int n, search_queue *queue,
                    const weft_solve_row_out *out)
{
    for (int k = 0; k < n; k++) {
        if (!(answers->search[k] > 0 || (plan->search_all && answers->valid[k] > 0)))
            continue;
        copy_lane(samples, k, &queue->samples, queue->n);
        queue->column[queue->n++] = first + k;
        if (queue->n == LANES)
            flush(plan, queue, out);
    }
}

void weft_solve_row(const weft_solve_plan *plan, int row, const weft_solve_row_in *in,
                    const weft_solve_row_out *out)
{
    block_nodes nodes;
    weft_solve_samples samples;
    weft_solve_answers answers;
    search_queue queue;
    begin_row(plan, &nodes, &samples);
    queue.samples.n_lights = samples.n_lights;
    queue.samples.n_channels = samples.n_channels;
    queue.samples.gloss = samples.gloss;
    queue.n = 0;
    for (int first = 0; first < plan->width; first += LANES) {
        const int n = plan->width - first < LANES ? plan->width - first : LANES;
        gather(plan, row, first / LANES, in, false, &nodes, &samples);
        plan->method->solve(&samples, &answers);
        scatter(&answers, samples.n_channels, out, first, n);
        if (plan->method->search)
            enqueue(plan, &samples, &answers, first, n, &queue, out);
    }
    flush(plan, &queue, out);
}
