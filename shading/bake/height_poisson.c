#include "shading/bake/height_poisson.h"

#include "core/fourier.h"
#include "core/mem.h"
#include "core/parallel.h"
#include "shading/bake/height.h"

#include <math.h>
#include <string.h>

enum { NODES = 12, MAX_ROUNDS = 200 };

/* Weight of unknown texels: enough to bridge them, too little to bend what is known. */
#define UNKNOWN_WEIGHT 1e-3F
/* Relative residual at which the rounds stop: the relief is then good to some 1e-6. */
#define TOLERANCE 1e-7

/* The weights q of  integral from j to j + 1 of f = sum q_i f(i)  for the polynomial through n nodes 0..n-1,
 * from the moments  sum q_i i^m = ((j+1)^(m+1) - j^(m+1))/(m+1)  by elimination around the middle. */
static void step_weights(int n, int j, double q[NODES])
{
    double a[NODES][NODES + 1];
    const double middle = j + 0.5;
    for (int m = 0; m < n; m++) {
        for (int i = 0; i < n; i++)
            a[m][i] = pow((i - middle) / n, m);
        a[m][n] = m % 2 ? 0 : 2 * pow(0.5 / n, m + 1) * n / (m + 1);
    }
    for (int k = 0; k < n; k++) {
        int best = k;
        for (int m = k + 1; m < n; m++)
            if (fabs(a[m][k]) > fabs(a[best][k]))
                best = m;
        for (int i = 0; i <= n; i++) {
            const double t = a[k][i];
            a[k][i] = a[best][i];
            a[best][i] = t;
        }
        for (int m = 0; m < n; m++) {
            const double factor = m == k ? 0 : a[m][k] / a[k][k];
            for (int i = k; i <= n && factor != 0; i++)
                a[m][i] -= factor * a[k][i];
        }
    }
    for (int i = 0; i < n; i++)
        q[i] = a[i][n] / a[i][i];
}

/* How the rise over step j of a line of n texels is made from `count` slopes from `first` on. */
typedef struct stencil {
    int first, count;
    double q[NODES];
} stencil;

typedef struct solver {
    int w, h;
    bool periodic;
    const float *weight;       /* [h][w], never NULL inside */
    stencil *across, *down;    /* [w], [h]; the last step of a line that does not repeat is unused */
    const float *p, *q;        /* slopes in mm a texel, right and down */
    float *x, *r, *z, *d, *ad; /* height, residual, preconditioned, direction, operator times direction */
    weft_fourier *fourier;
    double *sums;       /* per band */
    const float *a, *b; /* operands of the pass under way */
    double factor;
    float *out;
} solver;

/* Inside, twelve nodes; near a border that does not continue, the six nearest: more would amplify noise. */
static weft_err plan_steps(int n, bool periodic, stencil **steps, weft_error *err)
{
    stencil *const s = weft_alloc((size_t)n, sizeof *s, err);
    if (!s)
        return WEFT_ERR_NOMEM;
    stencil inside = {.count = NODES}, *previous = NULL;
    step_weights(NODES, NODES / 2 - 1, inside.q);
    for (int j = 0; j + !periodic < n; j++) {
        const int first = j - NODES / 2 + 1;
        if (n >= NODES && (periodic || (first >= 0 && first + NODES <= n))) {
            s[j] = inside;
            s[j].first = first;
            continue;
        }
        const int count = n < 6 ? n : 6;
        int from = periodic ? j - count / 2 + 1 : j - count / 2 + 1 < 0 ? 0 : j - count / 2 + 1;
        if (!periodic && from + count > n)
            from = n - count;
        s[j] = (stencil){.first = from, .count = count};
        if (previous && previous->count == count && j - from == (int)(previous - s) - previous->first)
            memcpy(s[j].q, previous->q, sizeof s[j].q);
        else
            step_weights(count, j - from, s[j].q);
        previous = &s[j];
    }
    *steps = s;
    return WEFT_OK;
}

static inline double rise(const stencil *s, const float *slopes, size_t stride, int n)
{
    double sum = 0;
    if (s->first >= 0 && s->first + s->count <= n) {
        for (int i = 0; i < s->count; i++)
            sum += s->q[i] * (double)slopes[(size_t)(s->first + i) * stride];
        return sum;
    }
    for (int i = 0; i < s->count; i++)
        sum += s->q[i] * (double)slopes[(size_t)((s->first + i + n) % n) * stride];
    return sum;
}

static inline float edge_weight(const solver *s, size_t a, size_t b)
{
    return fminf(s->weight[a], s->weight[b]);
}

/* The neighbours of (x, y) by index; the texel itself where the picture ends. */
typedef struct around {
    size_t here, left, right, up, down;
} around;

static inline around neighbours(const solver *s, int x, int y)
{
    const size_t w = (size_t)s->w, row = (size_t)y * w, here = row + (size_t)x;
    const bool p = s->periodic;
    return (around){
        here,
        x > 0 ? here - 1
        : p   ? row + w - 1
              : here,
        x + 1 < s->w ? here + 1
        : p          ? row
                     : here,
        y > 0 ? here - w
        : p   ? (size_t)(s->h - 1) * w + (size_t)x
              : here,
        y + 1 < s->h ? here + w
        : p          ? (size_t)x
                     : here,
    };
}

/* r = -div (w rise), what the least-squares surface must answer: L x = r. */
static void right_side_rows(void *context, int band, int begin, int end)
{
    solver *const s = context;
    (void)band;
    for (int y = begin; y < end; y++)
        for (int x = 0; x < s->w; x++) {
            const around n = neighbours(s, x, y);
            const float *const p = s->p + (size_t)y * (size_t)s->w, *const q = s->q + x;
            const size_t w = (size_t)s->w;
            double sum = 0;
            if (n.left != n.here)
                sum += (double)edge_weight(s, n.left, n.here) *
                       rise(&s->across[x > 0 ? x - 1 : s->w - 1], p, 1, s->w);
            if (n.right != n.here)
                sum -= (double)edge_weight(s, n.right, n.here) * rise(&s->across[x], p, 1, s->w);
            if (n.up != n.here)
                sum += (double)edge_weight(s, n.up, n.here) *
                       rise(&s->down[y > 0 ? y - 1 : s->h - 1], q, w, s->h);
            if (n.down != n.here)
                sum -= (double)edge_weight(s, n.down, n.here) * rise(&s->down[y], q, w, s->h);
            s->r[n.here] = (float)sum;
        }
}

/* ad = L d, and the partial sums of d . ad. */
static void operator_rows(void *context, int band, int begin, int end)
{
    solver *const s = context;
    const float *const d = s->d;
    double sum = 0;
    for (int y = begin; y < end; y++)
        for (int x = 0; x < s->w; x++) {
            const around n = neighbours(s, x, y);
            const float here = d[n.here];
            const float value = edge_weight(s, n.left, n.here) * (here - d[n.left]) +
                                edge_weight(s, n.right, n.here) * (here - d[n.right]) +
                                edge_weight(s, n.up, n.here) * (here - d[n.up]) +
                                edge_weight(s, n.down, n.here) * (here - d[n.down]);
            s->ad[n.here] = value;
            sum += (double)here * (double)value;
        }
    s->sums[band] = sum;
}

static void dot_rows(void *context, int band, int begin, int end)
{
    solver *const s = context;
    double sum = 0;
    for (size_t i = (size_t)begin * (size_t)s->w; i < (size_t)end * (size_t)s->w; i++)
        sum += (double)s->a[i] * (double)s->b[i];
    s->sums[band] = sum;
}

/* out = a + factor b */
static void add_rows(void *context, int band, int begin, int end)
{
    solver *const s = context;
    const float factor = (float)s->factor;
    (void)band;
    for (size_t i = (size_t)begin * (size_t)s->w; i < (size_t)end * (size_t)s->w; i++)
        s->out[i] = s->a[i] + factor * s->b[i];
}

static double total(const solver *s)
{
    double sum = 0;
    for (int band = 0; band < weft_parallel_n_bands(s->h); band++)
        sum += s->sums[band];
    return sum;
}

static double dot(solver *s, const float *a, const float *b)
{
    s->a = a;
    s->b = b;
    weft_parallel_rows(s->h, dot_rows, s);
    return total(s);
}

static void add(solver *s, float *out, const float *a, double factor, const float *b)
{
    s->out = out;
    s->a = a;
    s->b = b;
    s->factor = factor;
    weft_parallel_rows(s->h, add_rows, s);
}

/* z = the surface that answers r with equal weights. */
static void divide_rows(void *context, int band, int begin, int end)
{
    solver *const s = context;
    const weft_fourier_kind kind = s->periodic ? WEFT_FOURIER_HARTLEY : WEFT_FOURIER_COSINE;
    (void)band;
    for (int v = begin; v < end; v++) {
        const double down = weft_fourier_difference(kind, s->h, v);
        float *const row = s->z + (size_t)v * (size_t)s->w;
        for (int u = 0; u < s->w; u++) {
            const double sum = down + weft_fourier_difference(kind, s->w, u);
            row[u] = sum > 0 ? (float)((double)row[u] / sum) : 0;
        }
    }
}

static void precondition(solver *s)
{
    memcpy(s->z, s->r, (size_t)s->w * (size_t)s->h * sizeof *s->z);
    weft_fourier_forward(s->fourier, s->z);
    weft_parallel_rows(s->h, divide_rows, s);
    weft_fourier_inverse(s->fourier, s->z);
}

/* Conjugate gradients (Hestenes, Stiefel 1952).  With equal weights the first step is the answer but for the
 * rounding of single precision, which the second takes away.  @return rounds */
static int solve(solver *s)
{
    const size_t n = (size_t)s->w * (size_t)s->h;
    const double start = dot(s, s->r, s->r);
    memset(s->x, 0, n * sizeof *s->x);
    double rz = 0;
    int round = 0;
    while (round < MAX_ROUNDS) {
        if (dot(s, s->r, s->r) <= TOLERANCE * TOLERANCE * start)
            break;
        precondition(s);
        const double next = dot(s, s->r, s->z);
        if (round == 0)
            memcpy(s->d, s->z, n * sizeof *s->d);
        else
            add(s, s->d, s->z, next / rz, s->d);
        rz = next;
        weft_parallel_rows(s->h, operator_rows, s);
        const double curvature = total(s);
        if (!(curvature > 0) || !(rz > 0)) /* rounding: nothing more to win */
            break;
        add(s, s->x, s->x, rz / curvature, s->d);
        add(s, s->r, s->r, -rz / curvature, s->ad);
        round++;
    }
    return round;
}

/* Slopes in mm a texel and weights from the normals; unknown ones are level and light. */
static size_t read_normals(const weft_image *normal, const float *weight, double mm_per_px, float *p,
                           float *q, float *w)
{
    const float *const nx = weft_image_plane(normal, 0), *const ny = weft_image_plane(normal, 1);
    const float *const nz = weft_image_plane(normal, 2);
    size_t known = 0;
    for (size_t i = 0; i < weft_image_plane_size(normal); i++) {
        const double x = (double)nx[i], y = (double)ny[i], z = (double)nz[i];
        const double length = sqrt(x * x + y * y + z * z);
        const bool is_known = isfinite(length) && length > 0 && (!weight || weight[i] > 0);
        /* rows go down where y goes up */
        p[i] = is_known ? (float)(mm_per_px * weft_height_slope(x / length, z / length)) : 0;
        q[i] = is_known ? (float)(-mm_per_px * weft_height_slope(y / length, z / length)) : 0;
        w[i] = !is_known ? UNKNOWN_WEIGHT : weight ? fmaxf(weight[i], UNKNOWN_WEIGHT) : 1;
        known += is_known;
    }
    return known;
}

/* Rms of what the surface leaves of the rises, relative to theirs. */
static double misfit(const solver *s)
{
    double left = 0, all = 0;
    for (int y = 0; y < s->h; y++)
        for (int x = 0; x < s->w; x++) {
            const around n = neighbours(s, x, y);
            const double across =
                n.right == n.here ? 0 : rise(&s->across[x], s->p + (size_t)y * (size_t)s->w, 1, s->w);
            const double down = n.down == n.here ? 0 : rise(&s->down[y], s->q + x, (size_t)s->w, s->h);
            const double dx = (double)(s->x[n.right] - s->x[n.here]) - across;
            const double dy = (double)(s->x[n.down] - s->x[n.here]) - down;
            left += dx * dx + dy * dy;
            all += across * across + down * down;
        }
    return all > 0 ? sqrt(left / all) : 0;
}

static double centre(float *height, size_t n)
{
    double sum = 0, squares = 0;
    for (size_t i = 0; i < n; i++)
        sum += (double)height[i];
    const double mean = sum / (double)n;
    for (size_t i = 0; i < n; i++) {
        height[i] = (float)((double)height[i] - mean);
        squares += (double)height[i] * (double)height[i];
    }
    return sqrt(squares / (double)n);
}

weft_err weft_height_integrate(const weft_image *normal, const float *weight, double mm_per_px, bool periodic,
                               weft_image *height, weft_height_info *info, weft_error *err)
{
    const int w = normal->width, h = normal->height;
    const size_t n = (size_t)w * (size_t)h;
    solver s = {.w = w, .h = h, .periodic = periodic};
    weft_image planes = {0};
    *height = (weft_image){0};
    weft_err status = weft_image_init(&planes, w, h, 7, err);
    if (status == WEFT_OK)
        status = weft_image_init(height, w, h, 1, err);
    if (status == WEFT_OK)
        status = plan_steps(w, periodic, &s.across, err);
    if (status == WEFT_OK)
        status = plan_steps(h, periodic, &s.down, err);
    if (status == WEFT_OK)
        status =
            weft_fourier_create(w, h, periodic ? WEFT_FOURIER_HARTLEY : WEFT_FOURIER_COSINE, &s.fourier, err);
    if (status == WEFT_OK && !(s.sums = weft_alloc((size_t)weft_parallel_n_bands(h), sizeof *s.sums, err)))
        status = WEFT_ERR_NOMEM;
    if (status != WEFT_OK)
        goto out;

    float *const p = weft_image_plane(&planes, 0), *const q = weft_image_plane(&planes, 1);
    float *const weights = weft_image_plane(&planes, 2);
    if (read_normals(normal, weight, mm_per_px, p, q, weights) == 0) {
        status = weft_fail(err, WEFT_ERR_NODATA, "no texel has a normal: there is no height");
        goto out;
    }
    s.p = p;
    s.q = q;
    s.weight = weights;
    s.x = height->data;
    s.r = weft_image_plane(&planes, 3);
    s.z = weft_image_plane(&planes, 4);
    s.d = weft_image_plane(&planes, 5);
    s.ad = weft_image_plane(&planes, 6);
    weft_parallel_rows(h, right_side_rows, &s);
    const int rounds = solve(&s);
    const double relief = centre(height->data, n);
    if (info)
        *info = (weft_height_info){.rounds = rounds, .misfit = misfit(&s), .relief_mm = relief};
out:
    if (status != WEFT_OK)
        weft_image_fini(height);
    weft_image_fini(&planes);
    weft_fourier_destroy(s.fourier);
    weft_free(s.across);
    weft_free(s.down);
    weft_free(s.sums);
    return status;
}
