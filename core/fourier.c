#include "core/fourier.h"

#include "core/mem.h"
#include "core/parallel.h"

#include <kiss_fft.h>
#include <math.h>
#include <stdbool.h>

/* One direction of the picture: transforms of length n over `lines` lines. */
typedef struct axis {
    int n, lines;
    kiss_fft_cfg forward, inverse;
    float *turn; /* [n + 1][2]: cos and sin of pi k / 2n */
} axis;

struct weft_fourier {
    weft_fourier_kind kind;
    axis across, down;
    float *transposed;     /* [width][height] */
    kiss_fft_cpx *scratch; /* two lines for each band of the longer list of lines */
    size_t scratch_line;   /* complex numbers of one line of it */
};

/* What one pass over lines needs. */
typedef struct pass {
    const weft_fourier *fourier;
    const axis *axis;
    float *plane;
    bool inverse;
} pass;

static weft_err plan_axis(axis *a, int n, int lines, weft_error *err)
{
    a->n = n;
    a->lines = lines;
    a->forward = kiss_fft_alloc(n, 0, NULL, NULL);
    a->inverse = kiss_fft_alloc(n, 1, NULL, NULL);
    a->turn = weft_alloc((size_t)n + 1, 2 * sizeof *a->turn, err);
    if (!a->forward || !a->inverse || !a->turn)
        return weft_fail(err, WEFT_ERR_NOMEM, "out of memory for a transform of %d numbers", n);
    for (int k = 0; k <= n; k++) {
        a->turn[2 * (size_t)k] = (float)cos(acos(-1) * k / (2.0 * n));
        a->turn[2 * (size_t)k + 1] = (float)sin(acos(-1) * k / (2.0 * n));
    }
    return WEFT_OK;
}

static void drop_axis(axis *a)
{
    kiss_fft_free(a->forward);
    kiss_fft_free(a->inverse);
    weft_free(a->turn);
}

weft_err weft_fourier_create(int width, int height, weft_fourier_kind kind, weft_fourier **fourier,
                             weft_error *err)
{
    weft_fourier *const f = weft_alloc(1, sizeof *f, err);
    if (!f)
        return WEFT_ERR_NOMEM;
    f->kind = kind;
    f->scratch_line = (size_t)(width > height ? width : height);
    const int bands = weft_parallel_n_bands(width > height ? width : height);
    weft_err status = plan_axis(&f->across, width, height, err);
    if (status == WEFT_OK)
        status = plan_axis(&f->down, height, width, err);
    if (status == WEFT_OK) {
        f->transposed = weft_alloc((size_t)width * (size_t)height, sizeof *f->transposed, err);
        f->scratch = weft_alloc((size_t)bands * 2 * f->scratch_line, sizeof *f->scratch, err);
        status = f->transposed && f->scratch ? WEFT_OK : WEFT_ERR_NOMEM;
    }
    if (status == WEFT_OK)
        *fourier = f;
    else
        weft_fourier_destroy(f);
    return status;
}

void weft_fourier_destroy(weft_fourier *fourier)
{
    if (!fourier)
        return;
    drop_axis(&fourier->across);
    drop_axis(&fourier->down);
    weft_free(fourier->transposed);
    weft_free(fourier->scratch);
    weft_free(fourier);
}

/* Two real lines travel as one complex one; at the end of an odd number the second is the first again.
 * V_k = A_k + i B_k with A, B Hermitian, so A_k = (V_k + conj V_-k)/2 and B_k = (V_k - conj V_-k)/2i. */
typedef struct pair {
    float ar, ai, br, bi;
} pair;

static inline pair split(const kiss_fft_cpx *v, int n, int k)
{
    const kiss_fft_cpx p = v[k], q = v[k ? n - k : 0];
    return (pair){0.5F * (p.r + q.r), 0.5F * (p.i - q.i), 0.5F * (p.i + q.i), 0.5F * (q.r - p.r)};
}

static void hartley(const axis *a, float *x, float *y, kiss_fft_cpx *in, kiss_fft_cpx *out)
{
    const float scale = 1 / sqrtf((float)a->n);
    for (int n = 0; n < a->n; n++)
        in[n] = (kiss_fft_cpx){x[n], y[n]};
    kiss_fft(a->forward, in, out);
    for (int k = 0; k < a->n; k++) {
        const pair p = split(out, a->n, k);
        x[k] = scale * (p.ar - p.ai); /* the transform has e^-i: cos + sin is Re - Im */
        y[k] = scale * (p.br - p.bi);
    }
}

/* Makhoul 1980: even samples forwards, odd ones backwards, one transform of length n, a turn of a quarter. */
static void cosine(const axis *a, float *x, float *y, kiss_fft_cpx *in, kiss_fft_cpx *out)
{
    const int n = a->n;
    for (int i = 0; i < n; i++) {
        const int from = 2 * i < n ? 2 * i : 2 * (n - i) - 1;
        in[i] = (kiss_fft_cpx){x[from], y[from]};
    }
    kiss_fft(a->forward, in, out);
    for (int k = 0; k < n; k++) {
        const float scale = sqrtf((k ? 2.0F : 1.0F) / (float)n);
        const float c = scale * a->turn[2 * (size_t)k], s = scale * a->turn[2 * (size_t)k + 1];
        const pair p = split(out, n, k);
        x[k] = c * p.ar + s * p.ai;
        y[k] = c * p.br + s * p.bi;
    }
}

static void cosine_inverse(const axis *a, float *x, float *y, kiss_fft_cpx *in, kiss_fft_cpx *out)
{
    const int n = a->n;
    for (int k = 0; k < n; k++) {
        const float scale = sqrtf((k ? 0.5F : 1.0F) / (float)n);
        const float c = scale * a->turn[2 * (size_t)k], s = scale * a->turn[2 * (size_t)k + 1];
        const float xm = k ? x[n - k] : 0, ym = k ? y[n - k] : 0;
        const float ar = c * x[k] + s * xm, ai = s * x[k] - c * xm;
        const float br = c * y[k] + s * ym, bi = s * y[k] - c * ym;
        in[k] = (kiss_fft_cpx){ar - bi, ai + br};
    }
    kiss_fft(a->inverse, in, out);
    for (int i = 0; i < n; i++) {
        const int to = 2 * i < n ? 2 * i : 2 * (n - i) - 1;
        x[to] = out[i].r;
        y[to] = out[i].i;
    }
}

static void do_lines(void *context, int band, int begin, int end)
{
    const pass *const p = context;
    const axis *const a = p->axis;
    kiss_fft_cpx *const in = p->fourier->scratch + (size_t)band * 2 * p->fourier->scratch_line;
    kiss_fft_cpx *const out = in + p->fourier->scratch_line;
    for (int line = begin; line < end; line += 2) {
        float *const x = p->plane + (size_t)line * (size_t)a->n;
        float *const y = line + 1 < end ? x + a->n : x;
        if (p->fourier->kind == WEFT_FOURIER_HARTLEY)
            hartley(a, x, y, in, out);
        else if (p->inverse)
            cosine_inverse(a, x, y, in, out);
        else
            cosine(a, x, y, in, out);
    }
}

/* A transposition in blocks that fit the cache. */
typedef struct turn {
    const float *from;
    float *to;
    int width, height; /* of `from` */
} turn;

enum { BLOCK = WEFT_BAND_ROWS };

static void turn_rows(void *context, int band, int begin, int end)
{
    const turn *const t = context;
    (void)band;
    for (int x0 = 0; x0 < t->width; x0 += BLOCK)
        for (int x = x0; x < x0 + BLOCK && x < t->width; x++)
            for (int y = begin; y < end; y++)
                t->to[(size_t)x * (size_t)t->height + (size_t)y] =
                    t->from[(size_t)y * (size_t)t->width + (size_t)x];
}

static void transform(weft_fourier *f, float *plane, bool inverse)
{
    pass p = {f, &f->across, plane, inverse};
    weft_parallel_rows(f->across.lines, do_lines, &p);
    turn there = {plane, f->transposed, f->across.n, f->down.n};
    weft_parallel_rows(there.height, turn_rows, &there);
    p.axis = &f->down;
    p.plane = f->transposed;
    weft_parallel_rows(f->down.lines, do_lines, &p);
    turn back = {f->transposed, plane, f->down.n, f->across.n};
    weft_parallel_rows(back.height, turn_rows, &back);
}

void weft_fourier_forward(weft_fourier *fourier, float *plane)
{
    transform(fourier, plane, false);
}

void weft_fourier_inverse(weft_fourier *fourier, float *plane)
{
    transform(fourier, plane, true);
}

double weft_fourier_difference(weft_fourier_kind kind, int n, int k)
{
    const double half = sin(acos(-1) * k / ((kind == WEFT_FOURIER_COSINE ? 2.0 : 1.0) * n));
    return 4 * half * half;
}
