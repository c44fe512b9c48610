#include "shading/bake/weave.h"

#include "core/fourier.h"
#include "core/mem.h"

#include <math.h>
#include <string.h>

enum { LONGEST_REPEAT = 16, LEAST_THREADS = 6, SLOWEST = 9 /* threads of a wave that counts */ };

/* Peaks are looked for within this slope of an axis (6 degrees), and above this frequency (cycles a picture).
 */
#define AXIS_SLOPE 0.1

/* A field prepared for spectra: mean taken away, a Hann window, its cas-cas transform. */
typedef struct spectrum {
    int w, h;
    float *t; /* [h][w] */
    weft_fourier *fourier;
} spectrum;

static double hann(int i, int n)
{
    const double s = sin(acos(-1) * (i + 0.5) / n);
    return s * s;
}

static weft_err transform(spectrum *s, const float *field, weft_error *err)
{
    const size_t n = (size_t)s->w * (size_t)s->h;
    double sum = 0;
    for (size_t i = 0; i < n; i++)
        sum += (double)field[i];
    if (!s->t && !(s->t = weft_alloc(n, sizeof *s->t, err)))
        return WEFT_ERR_NOMEM;
    for (int y = 0; y < s->h; y++)
        for (int x = 0; x < s->w; x++) {
            const size_t i = (size_t)y * (size_t)s->w + (size_t)x;
            s->t[i] = (float)(((double)field[i] - sum / (double)n) * hann(x, s->w) * hann(y, s->h));
        }
    weft_fourier_forward(s->fourier, s->t);
    return WEFT_OK;
}

/* |F(u, v)|^2 from the cas-cas transform T: Re F(u, v) = (T(u, -v) + T(-u, v))/2, Im = (T(-u, -v) - T(u,
 * v))/2. */
static double power(const spectrum *s, int u, int v)
{
    const int a = ((u % s->w) + s->w) % s->w, b = ((v % s->h) + s->h) % s->h;
    const int na = a ? s->w - a : 0, nb = b ? s->h - b : 0;
    const float *const t = s->t;
    const size_t w = (size_t)s->w;
    const double re = 0.5 * ((double)t[(size_t)nb * w + (size_t)a] + (double)t[(size_t)b * w + (size_t)na]);
    const double im = 0.5 * ((double)t[(size_t)nb * w + (size_t)na] - (double)t[(size_t)b * w + (size_t)a]);
    return re * re + im * im;
}

/* Vertex of the parabola through the logs of three neighbours: exact for a Gaussian, good for a Hann window.
 */
static double vertex(double left, double middle, double right)
{
    const double a = log(left + 1e-30), b = log(middle + 1e-30), c = log(right + 1e-30);
    const double curve = a - 2 * b + c;
    return curve < 0 ? fmin(fmax(0.5 * (a - c) / curve, -0.5), 0.5) : 0;
}

/* The strongest peak near an axis (0: along u), as cycles a pixel; false when it does not stand out. */
static bool find_peak(const spectrum *s, int axis, double k[2])
{
    const int n = axis ? s->h : s->w, across = axis ? s->w : s->h;
    double best = 0, all = 0;
    int best_f = 0, best_o = 0;
    for (int f = LEAST_THREADS; f < n / 2 - 1; f++) {
        const int reach = (int)(AXIS_SLOPE * f * across / n) + 1;
        for (int o = -reach; o <= reach; o++) {
            /* slopes of heights: a harmonic of the same relief counts by its frequency squared less */
            const double p = (axis ? power(s, o, f) : power(s, f, o)) / ((double)f * f);
            all += p;
            if (p > best) {
                best = p;
                best_f = f;
                best_o = o;
            }
        }
    }
    if (best_f == 0 || best < 0.05 * all)
        return false;
    const double df =
        axis ? vertex(power(s, best_o, best_f - 1), power(s, best_o, best_f), power(s, best_o, best_f + 1))
             : vertex(power(s, best_f - 1, best_o), power(s, best_f, best_o), power(s, best_f + 1, best_o));
    const double d_o =
        axis ? vertex(power(s, best_o - 1, best_f), power(s, best_o, best_f), power(s, best_o + 1, best_f))
             : vertex(power(s, best_f, best_o - 1), power(s, best_f, best_o), power(s, best_f, best_o + 1));
    k[axis] = (best_f + df) / n;
    k[1 - axis] = (best_o + d_o) / across;
    return true;
}

/* What tells threads apart: everything but the multiples of both thread frequencies, which all threads have.
 * Of slopes, what counts is the height, but no steeper than noise of long waves allows. */
static double interlacing_weight(const spectrum *s, const weft_weave *weave, int u, int v)
{
    const double x = (double)u / s->w, y = (double)v / s->h;
    const double lowest = 0.5 * fmin(weave->threads_per_px[0], weave->threads_per_px[1]);
    bool shared = true;
    if (hypot(x, y) < 2 * lowest / SLOWEST)
        return 0; /* shading of the whole piece is no thread's */
    for (int axis = 0; axis < 2; axis++) {
        const double cycles = x * weave->step_px[axis][0] + y * weave->step_px[axis][1]; /* a thread */
        const double bin = fabs(weave->step_px[axis][axis]) / (axis ? s->h : s->w);
        shared = shared && fabs(cycles - round(cycles)) < 2.5 * bin;
    }
    const double wide = 1 / (x * x + y * y + lowest * lowest);
    return shared ? 0 : wide * wide; /* smooth enough to be read between pixels */
}

/* The autocorrelation of what was transformed: the transform of its power, mirrored in y.
 * @return the share of the power that is not common to all threads */
static double correlate(spectrum *s, const weft_weave *weave)
{
    double kept = 0, all = 0;
    const double lowest = 0.5 * fmin(weave->threads_per_px[0], weave->threads_per_px[1]);
    float *const p = s->t;
    const size_t w = (size_t)s->w;
    /* pairs (u, v) and (-u, v), (u, -v), (-u, -v) share what they need: done together, in place */
    for (int v = 0; v <= s->h / 2; v++)
        for (int u = 0; u <= s->w / 2; u++) {
            const int nu = u ? s->w - u : 0, nv = v ? s->h - v : 0;
            const double same = interlacing_weight(s, weave, u, v) * power(s, u, v);
            const double mirrored = interlacing_weight(s, weave, u, -v) * power(s, u, -v);
            kept += same + mirrored;
            const double square = pow((double)u / s->w, 2) + pow((double)v / s->h, 2) + lowest * lowest;
            if (square > lowest * lowest * (1 + 4.0 / (SLOWEST * SLOWEST)))
                all += (power(s, u, v) + power(s, u, -v)) / (square * square);
            p[(size_t)v * w + (size_t)u] = p[(size_t)nv * w + (size_t)nu] = (float)same;
            p[(size_t)nv * w + (size_t)u] = p[(size_t)v * w + (size_t)nu] = (float)mirrored;
        }
    weft_fourier_forward(s->fourier, s->t);
    return all > 0 ? kept / all : 0;
}

/* Correlation at a shift in pixels, against none; what the window takes away is given back. */
static double likeness_at(const spectrum *s, double dx, double dy)
{
    const double fx = floor(dx), fy = floor(-dy), a = dx - fx, b = -dy - fy; /* mirrored in y */
    double sum = 0;
    for (int j = 0; j < 2; j++)
        for (int i = 0; i < 2; i++) {
            const int x = (((int)fx + i) % s->w + s->w) % s->w, y = (((int)fy + j) % s->h + s->h) % s->h;
            sum += (i ? a : 1 - a) * (j ? b : 1 - b) * (double)s->t[(size_t)y * (size_t)s->w + (size_t)x];
        }
    double window = 1;
    const double shift[2] = {fabs(dx) / s->w, fabs(dy) / s->h};
    for (int c = 0; c < 2; c++) { /* overlap of two Hann windows */
        const double t = shift[c], pi = acos(-1);
        window *= t < 1 ? ((1 - t) * (2 + cos(2 * pi * t)) + 3 / (2 * pi) * sin(2 * pi * t)) / 3 : 0;
    }
    return window > 1e-3 ? sum / (double)s->t[0] / window : 0;
}

/* The best correlation within a pixel and a half of a shift: threads are not that even. */
static double likeness_near(const spectrum *s, double dx, double dy)
{
    double best = -1;
    for (int j = -3; j <= 3; j++)
        for (int i = -3; i <= 3; i++)
            best = fmax(best, likeness_at(s, dx + 0.5 * i, dy + 0.5 * j));
    return best;
}

/* How much more the picture is like itself after every n threads than after other numbers. */
static double repeat_score(const double *likeness, int longest, int n)
{
    double at = 0, beside = 0;
    int n_at = 0;
    for (int k = 1; k <= longest; k++) {
        *(k % n ? &beside : &at) += likeness[k];
        n_at += k % n == 0;
    }
    return n > 1 && n_at > 0 ? at / n_at - beside / (longest - n_at) : 0;
}

/* The number of threads that stands out most from those between; the smallest, where multiples stand out as
 * well. */
static void find_repeat(const spectrum *s, weft_weave *weave, int axis)
{
    double likeness[LONGEST_REPEAT + 1], best = 0.1; /* less is noise: every thread is like the next */
    int longest = LONGEST_REPEAT;
    const double size = axis ? s->h : s->w;
    while (longest > 1 && longest * hypot(weave->step_px[axis][0], weave->step_px[axis][1]) > 0.4 * size)
        longest--;
    for (int n = 1; n <= longest; n++)
        likeness[n] = likeness_near(s, n * weave->step_px[axis][0], n * weave->step_px[axis][1]);
    weave->threads[axis] = 1;
    for (int n = 2; n <= longest; n++) {
        const double score = repeat_score(likeness, longest, n);
        if (score > best) {
            best = 1.05 * score;
            weave->threads[axis] = n;
        }
    }
    weave->likeness[axis] = fmin(fmax(likeness[weave->threads[axis]], 0), 1);
}

static void slope_field(const weft_image *normal, int plane, float *field)
{
    const float *const a = weft_image_plane(normal, plane), *const z = weft_image_plane(normal, 2);
    for (size_t i = 0; i < weft_image_plane_size(normal); i++) {
        const float slope = a[i] / fmaxf(z[i], 0.05F);
        field[i] = isfinite(slope) ? slope : 0;
    }
}

/* Spacings from the wave vectors: k_i . step_j is 1 for i = j, else 0. */
static void invert(const double k[2][2], weft_weave *weave)
{
    const double det = k[0][0] * k[1][1] - k[0][1] * k[1][0];
    weave->step_px[0][0] = k[1][1] / det;
    weave->step_px[0][1] = -k[1][0] / det;
    weave->step_px[1][0] = -k[0][1] / det;
    weave->step_px[1][1] = k[0][0] / det;
    for (int i = 0; i < 2; i++)
        weave->threads_per_px[i] = hypot(k[i][0], k[i][1]);
    const double warp = atan2(k[0][1], k[0][0]), weft = atan2(-k[1][0], k[1][1]);
    weave->skew_deg = (weft - warp) * 180 / acos(-1);
}

weft_err weft_weave_find(const weft_image *normal, const weft_image *albedo, weft_weave *weave,
                         weft_error *err)
{
    spectrum s = {.w = normal->width, .h = normal->height};
    float *const field = weft_alloc(weft_image_plane_size(normal), sizeof *field, err);
    double k[2][2];
    weft_err status =
        field ? weft_fourier_create(s.w, s.h, WEFT_FOURIER_HARTLEY, &s.fourier, err) : WEFT_ERR_NOMEM;
    for (int axis = 0; axis < 2 && status == WEFT_OK; axis++) {
        slope_field(normal, axis, field);
        status = transform(&s, field, err);
        if (status == WEFT_OK && !find_peak(&s, axis, k[axis]))
            status = weft_fail(err, WEFT_ERR_NODATA,
                               "no threads are seen %s: is it a weave, flat and along the picture?",
                               axis ? "down the picture" : "across the picture");
    }
    if (status == WEFT_OK) {
        invert((const double(*)[2])k, weave);
        /* colours repeat too: both slopes and the albedo in one field */
        for (size_t i = 0; i < weft_image_plane_size(normal); i++)
            field[i] += weft_image_plane(normal, 0)[i] / fmaxf(weft_image_plane(normal, 2)[i], 0.05F) +
                        (albedo->planes ? 2 * weft_image_plane(albedo, albedo->planes > 1)[i] : 0);
        status = transform(&s, field, err);
    }
    if (status == WEFT_OK) {
        const double own = correlate(&s, weave);
        for (int axis = 0; axis < 2; axis++)
            if (own > 5e-4)
                find_repeat(&s, weave, axis);
            else /* every thread is like the next: a net, or too blurred to see more */
                weave->threads[axis] = 1, weave->likeness[axis] = 1;
    }
    weft_fourier_destroy(s.fourier);
    weft_free(s.t);
    weft_free(field);
    return status;
}
