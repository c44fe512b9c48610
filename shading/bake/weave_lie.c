#include "shading/bake/weave_lie.h"

#include "core/mem.h"

#include <complex.h>
#include <math.h>

/* Threads over which the carrier is smoothed (sigma): waves of a dozen threads are followed, single threads
 * are not. */
#define SMOOTH_THREADS 2.5
/* There is no thread to read where the carrier is weaker than this share of its mean (a corner has a
 * quarter), and not many such cells may be. */
#define WEAK      0.1
#define MOST_WEAK 0.1

static const double two_pi = 6.283185307179586;

typedef struct carrier {
    int w, h; /* cells */
    double cell_px;
    double complex *z; /* [h][w] */
} carrier;

/* Sums of slope times exp(-2 pi i k . p) over cells of about a thread, whose box takes the harmonics out. */
static weft_err demodulate(const float *slope, int w, int h, const double k[2], carrier *c, weft_error *err)
{
    c->cell_px = fmax(round(1 / hypot(k[0], k[1])), 2);
    c->w = (int)(w / c->cell_px);
    c->h = (int)(h / c->cell_px);
    c->z = weft_alloc((size_t)c->w * (size_t)c->h, sizeof *c->z, err);
    if (!c->z)
        return WEFT_ERR_NOMEM;
    const int side = (int)c->cell_px;
    const double complex turn = cexp(-(double complex)I * (two_pi * k[0]));
    for (int y = 0; y < c->h * side; y++) {
        double complex *const row = c->z + (size_t)(y / side) * (size_t)c->w;
        for (int i = 0; i < c->w; i++) {
            double complex e = cexp(-(double complex)I * (two_pi * (k[0] * i * side + k[1] * y)));
            const float *const s = slope + (size_t)y * (size_t)w + (size_t)(i * side);
            for (int x = 0; x < side; x++, e *= turn)
                row[i] += (double)s[x] * e;
        }
    }
    return WEFT_OK;
}

/* A Gaussian along lines of the grid; what lies outside has no weight, so edges are not drawn inwards. */
static void smooth_lines(const double complex *from, double complex *to, int n, int stride, int lines,
                         int step)
{
    enum { REACH = 8 };
    double weight[REACH + 1];
    for (int d = 0; d <= REACH; d++)
        weight[d] = exp(-0.5 * d * d / (SMOOTH_THREADS * SMOOTH_THREADS));
    for (int l = 0; l < lines; l++)
        for (int i = 0; i < n; i++) {
            double complex sum = 0;
            for (int d = -REACH; d <= REACH; d++)
                if (i + d >= 0 && i + d < n)
                    sum += weight[d < 0 ? -d : d] *
                           from[(size_t)(i + d) * (size_t)stride + (size_t)l * (size_t)step];
            to[(size_t)i * (size_t)stride + (size_t)l * (size_t)step] = sum;
        }
}

static weft_err smooth(carrier *c, weft_error *err)
{
    double complex *const between = weft_alloc((size_t)c->w * (size_t)c->h, sizeof *between, err);
    if (!between)
        return WEFT_ERR_NOMEM;
    smooth_lines(c->z, between, c->w, 1, c->h, c->w);
    smooth_lines(between, c->z, c->h, c->w, c->w, 1);
    weft_free(between);
    return WEFT_OK;
}

/* Turns from one cell to another that is beside it: less than half a turn once smoothed. */
static float turn_between(const carrier *c, size_t from, size_t to)
{
    return (float)(carg(c->z[to] * conj(c->z[from])) / two_pi);
}

/* The angle in turns, unwrapped from the middle: along the middle row, then up and down every column. */
static void unwrap(const carrier *c, weft_image *shift)
{
    const size_t w = (size_t)c->w, h = (size_t)c->h, middle = h / 2 * w;
    float *const s = shift->data;
    for (size_t x = 1; x < w; x++)
        s[middle + x] = s[middle + x - 1] + turn_between(c, middle + x - 1, middle + x);
    for (size_t y = h / 2 + 1; y < h; y++)
        for (size_t x = 0; x < w; x++)
            s[y * w + x] = s[(y - 1) * w + x] + turn_between(c, (y - 1) * w + x, y * w + x);
    for (size_t y = h / 2; y-- > 0;)
        for (size_t x = 0; x < w; x++)
            s[y * w + x] = s[(y + 1) * w + x] + turn_between(c, (y + 1) * w + x, y * w + x);
}

/* Takes the plane of least squares out of the shift and puts its gradient into k. */
static void take_plane_out(weft_image *shift, double cell_px, double k[2])
{
    const int w = shift->width, h = shift->height;
    double mean = 0, along[2] = {0, 0}, square[2] = {0, 0};
    for (int y = 0; y < h; y++)
        for (int x = 0; x < w; x++) {
            const double d[2] = {x - 0.5 * (w - 1), y - 0.5 * (h - 1)};
            const double value = (double)shift->data[(size_t)y * (size_t)w + (size_t)x];
            mean += value / ((double)w * h);
            for (int c = 0; c < 2; c++) {
                along[c] += value * d[c];
                square[c] += d[c] * d[c];
            }
        }
    for (int c = 0; c < 2; c++) {
        along[c] = square[c] > 0 ? along[c] / square[c] : 0;
        k[c] += along[c] / cell_px;
    }
    for (int y = 0; y < h; y++)
        for (int x = 0; x < w; x++)
            shift->data[(size_t)y * (size_t)w + (size_t)x] -=
                (float)(mean + along[0] * (x - 0.5 * (w - 1)) + along[1] * (y - 0.5 * (h - 1)));
}

/* Whether there is a carrier nearly everywhere. */
static bool is_followed(const carrier *c)
{
    const size_t n = (size_t)c->w * (size_t)c->h;
    double mean = 0;
    size_t weak = 0;
    for (size_t i = 0; i < n; i++)
        mean += cabs(c->z[i]) / (double)n;
    for (size_t i = 0; i < n; i++)
        weak += cabs(c->z[i]) < WEAK * mean;
    return n > 0 && mean > 0 && (double)weak <= MOST_WEAK * (double)n;
}

weft_err weft_thread_lie_read(const float *slope, int w, int h, double k[2], weft_thread_lie *lie,
                              weft_error *err)
{
    carrier c = {0};
    *lie = (weft_thread_lie){0};
    weft_err status = demodulate(slope, w, h, k, &c, err);
    if (status == WEFT_OK)
        status = smooth(&c, err);
    if (status == WEFT_OK && !is_followed(&c))
        status = weft_fail(err, WEFT_ERR_NODATA, "the threads cannot be followed over the whole picture");
    if (status == WEFT_OK)
        status = weft_image_init(&lie->shift, c.w, c.h, 1, err);
    if (status == WEFT_OK) {
        lie->cell_px = c.cell_px;
        unwrap(&c, &lie->shift);
        take_plane_out(&lie->shift, c.cell_px, k);
    }
    weft_free(c.z);
    return status;
}

void weft_thread_lie_fini(weft_thread_lie *lie)
{
    weft_image_fini(&lie->shift);
}

double weft_thread_lie_at(const weft_thread_lie *lie, double x, double y)
{
    if (!lie->shift.planes)
        return 0;
    /* the middle of a cell of n pixels is n/2 - 1/2 pixels from its first */
    return (double)weft_image_sample(&lie->shift, 0, (x + 0.5) / lie->cell_px - 0.5,
                                     (y + 0.5) / lie->cell_px - 0.5);
}

double weft_thread_lie_bow(const weft_thread_lie *lie, int along)
{
    const weft_image *const s = &lie->shift;
    const int n = along ? s->height : s->width, lines = along ? s->width : s->height;
    const size_t step = along ? (size_t)s->width : 1, line = along ? 1 : (size_t)s->width;
    double most = 0;
    for (int l = 0; l < lines && n > 2; l++) {
        const float *const first = s->data + (size_t)l * line;
        const double a = (double)first[0], b = (double)first[(size_t)(n - 1) * step];
        for (int i = 0; i < n; i++)
            most = fmax(most, fabs((double)first[(size_t)i * step] - a - (b - a) * i / (n - 1)));
    }
    return most;
}
