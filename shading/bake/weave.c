#include "shading/bake/weave.h"

#include "core/fourier.h"
#include "core/mem.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum {
    LONGEST_REPEAT = 48,
    SKIRT = 4 /* bins */,
    LEAST_THREADS = 6,
    SLOWEST = 9 /* threads of a wave that counts */
};

/* Peaks are looked for within this slope of an axis (6 degrees), and above this frequency (cycles a picture).
 */
#define AXIS_SLOPE 0.1

/* Times the mean around it that a peak is of threads. */
#define LEAST_PEAK 25

/* Correlations less apart are noise: every thread is like the next. */
#define LEAST_SCORE 0.1
/* A multiple of a repeat that was found must do better by this: a sett of colours does. */
#define LEAST_GAIN 0.35

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

static double power_along(const spectrum *s, int axis, int f, int o)
{
    return axis ? power(s, o, f) : power(s, f, o);
}

/* Whether a peak is more than the strongest of so much noise: its power over the mean of its surroundings in
 * the wedge, from 0.7 to 1.4 of its frequency and without its own skirt.  Of noise the strongest of ten
 * thousand has nine times the mean. */
static bool stands_out(const spectrum *s, int axis, int peak_f, int peak_o)
{
    const int n = axis ? s->h : s->w, across = axis ? s->w : s->h,
              reach = (int)(AXIS_SLOPE * peak_f * across / n) + 3;
    const int highest = n / 2 - 1, last = (int)fmin(1.4 * peak_f + 4, highest);
    double sum = 0;
    int count = 0;
    for (int f = (int)fmax(0.7 * peak_f - 4, 2); f <= last; f++)
        for (int o = -reach; o <= reach; o++)
            if (abs(f - peak_f) > SKIRT || abs(o - peak_o) > SKIRT) {
                sum += power_along(s, axis, f, o);
                count++;
            }
    return power_along(s, axis, peak_f, peak_o) * count > LEAST_PEAK * sum;
}

/* The strongest peak near an axis (0: along u), as cycles a pixel; false when it does not stand out. */
static bool find_peak(const spectrum *s, int axis, double k[2])
{
    const int n = axis ? s->h : s->w, across = axis ? s->w : s->h;
    double best = 0;
    int best_f = 0, best_o = 0;
    for (int f = LEAST_THREADS; f < n / 2 - 1; f++) {
        const int reach = (int)(AXIS_SLOPE * f * across / n) + 1;
        for (int o = -reach; o <= reach; o++) {
            /* slopes of heights: a harmonic of the same relief counts by its frequency squared less */
            const double p = power_along(s, axis, f, o) / ((double)f * f);
            if (p > best) {
                best = p;
                best_f = f;
                best_o = o;
            }
        }
    }
    if (best_f == 0 || !stands_out(s, axis, best_f, best_o))
        return false;
    const double at = power_along(s, axis, best_f, best_o);
    const double df =
        vertex(power_along(s, axis, best_f - 1, best_o), at, power_along(s, axis, best_f + 1, best_o));
    const double d_o =
        vertex(power_along(s, axis, best_f, best_o - 1), at, power_along(s, axis, best_f, best_o + 1));
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

/* By how much the picture is more like itself after every n threads than after the other multiples of m; 0
 * when that is within what chance does to single threads (three sigma of the others). */
static double repeat_score(const double *likeness, int longest, int m, int n)
{
    double at = 0, beside = 0, squares = 0;
    int n_at = 0, n_beside = 0;
    for (int k = m; k <= longest; k += m) {
        *(k % n ? &beside : &at) += likeness[k];
        squares += k % n ? likeness[k] * likeness[k] : 0;
        *(k % n ? &n_beside : &n_at) += 1;
    }
    if (n_at == 0 || n_beside == 0)
        return 0;
    beside /= n_beside;
    const double score = at / n_at - beside, chance = sqrt(fmax(squares / n_beside - beside * beside, 0));
    return score > (m > 1 ? LEAST_GAIN : LEAST_SCORE) && score > 3 * chance / sqrt(n_at) ? score : 0;
}

/* The number of threads that stands out most from those between; the smallest, where multiples stand out no
 * more. */
static void find_repeat(const spectrum *s, weft_weave *weave, int axis)
{
    double likeness[LONGEST_REPEAT + 1], best = 0;
    int longest = LONGEST_REPEAT;
    const double size = axis ? s->h : s->w;
    while (longest > 1 && longest * hypot(weave->step_px[axis][0], weave->step_px[axis][1]) > 0.4 * size)
        longest--;
    for (int n = 1; n <= longest; n++)
        likeness[n] = likeness_near(s, n * weave->step_px[axis][0], n * weave->step_px[axis][1]);
    weave->threads[axis] = 1;
    for (int n = 2; n <= longest; n++) {
        const int m = weave->threads[axis];
        const double score = repeat_score(likeness, longest, 1, n);
        if (n % m == 0 ? repeat_score(likeness, longest, m, n) > 0 : score > 1.05 * best) {
            best = score;
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

/* Follows the threads of one system and mends its wave vector.  Threads that cannot be followed are left
 * where the lattice says they are. */
static weft_err follow(const weft_image *normal, const float *slope, int axis, double k[2], weft_weave *weave,
                       weft_error *err)
{
    weft_thread_lie *const lie = &weave->lie[axis];
    const weft_err status = weft_thread_lie_read(slope, normal->width, normal->height, k, lie, err);
    if (status == WEFT_OK) {
        const double chord_px = lie->cell_px * ((axis ? lie->shift.width : lie->shift.height) - 1);
        weave->bow[axis] = weft_thread_lie_bow(lie, !axis) / hypot(k[0], k[1]) / fmax(chord_px, 1);
    }
    return status == WEFT_ERR_NODATA ? WEFT_OK : status;
}

/* The two wave vectors, from the spectra of the slopes, and how the threads lie. */
static weft_err find_threads(spectrum *s, const weft_image *normal, float *field, weft_weave *weave,
                             weft_error *err)
{
    double k[2][2];
    for (int axis = 0; axis < 2; axis++) {
        slope_field(normal, axis, field);
        WEFT_TRY(transform(s, field, err));
        if (!find_peak(s, axis, k[axis]))
            return weft_fail(err, WEFT_ERR_NODATA,
                             "no threads are seen %s: is it a weave, flat and along the picture?",
                             axis ? "down the picture" : "across the picture");
        WEFT_TRY(follow(normal, field, axis, k[axis], weave, err));
    }
    invert((const double(*)[2])k, weave);
    return WEFT_OK;
}

void weft_weave_fini(weft_weave *weave)
{
    for (int axis = 0; axis < 2; axis++)
        weft_thread_lie_fini(&weave->lie[axis]);
}

void weft_weave_place(const weft_weave *weave, const double even[2], double at[2])
{
    at[0] = even[0];
    at[1] = even[1];
    /* the shift changes by a hundredth of a thread a thread: three steps settle it */
    for (int i = 0; i < 3; i++) {
        const double warp = weft_thread_lie_at(&weave->lie[0], at[0], at[1]);
        const double weft = weft_thread_lie_at(&weave->lie[1], at[0], at[1]);
        for (int c = 0; c < 2; c++)
            at[c] = even[c] - warp * weave->step_px[0][c] - weft * weave->step_px[1][c];
    }
}

/* What tells threads apart, laid straight: both slopes and the albedo in one field. */
static weft_err lay_straight(const weft_image *normal, const weft_image *albedo, const weft_weave *weave,
                             float *field, weft_error *err)
{
    weft_image both;
    WEFT_TRY(weft_image_init(&both, normal->width, normal->height, 1, err));
    slope_field(normal, 0, both.data);
    slope_field(normal, 1, field);
    for (size_t i = 0; i < weft_image_plane_size(normal); i++)
        both.data[i] += field[i] + (albedo->planes ? 2 * weft_image_plane(albedo, albedo->planes > 1)[i] : 0);
    for (int y = 0; y < both.height; y++)
        for (int x = 0; x < both.width; x++) {
            double at[2];
            weft_weave_place(weave, (const double[2]){x, y}, at);
            field[(size_t)y * (size_t)both.width + (size_t)x] = weft_image_sample(&both, 0, at[0], at[1]);
        }
    weft_image_fini(&both);
    return WEFT_OK;
}

weft_err weft_weave_find(const weft_image *normal, const weft_image *albedo, weft_weave *weave,
                         weft_error *err)
{
    spectrum s = {.w = normal->width, .h = normal->height};
    float *const field = weft_alloc(weft_image_plane_size(normal), sizeof *field, err);
    *weave = (weft_weave){0};
    weft_err status =
        field ? weft_fourier_create(s.w, s.h, WEFT_FOURIER_HARTLEY, &s.fourier, err) : WEFT_ERR_NOMEM;
    if (status == WEFT_OK)
        status = find_threads(&s, normal, field, weave, err);
    if (status == WEFT_OK)
        status = lay_straight(normal, albedo, weave, field, err);
    if (status == WEFT_OK)
        status = transform(&s, field, err);
    if (status == WEFT_OK) {
        const double own = correlate(&s, weave);
        for (int axis = 0; axis < 2; axis++)
            if (own > 5e-4)
                find_repeat(&s, weave, axis);
            else /* every thread is like the next: a net, or too blurred to see more */
                weave->threads[axis] = 1, weave->likeness[axis] = 1;
    }
    if (status != WEFT_OK)
        weft_weave_fini(weave);
    weft_fourier_destroy(s.fourier);
    weft_free(s.t);
    weft_free(field);
    return status;
}
