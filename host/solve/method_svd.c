/* The reference: least squares by singular values in double, pixel by pixel, as the paper prescribes. */
#include "core/linalg.h"
#include "host/solve/samples.h"

#include <math.h>
#include <string.h>

enum { SWEEPS = 30 };

/* Columns of L (scaled singular directions after the rotations) and the rotations V of one pixel. */
typedef struct decomposition {
    int n;
    double column[3][WEFT_LIGHTS_MAX];
    double v[3][3]; /* columns are right singular vectors */
} decomposition;

static double dot(const double *a, const double *b, int n)
{
    double sum = 0;
    for (int i = 0; i < n; i++)
        sum += a[i] * b[i];
    return sum;
}

static void rotate(double *a, double *b, int n, double c, double s)
{
    for (int i = 0; i < n; i++) {
        const double x = a[i], y = b[i];
        a[i] = c * x - s * y;
        b[i] = s * x + c * y;
    }
}

/* One-sided Jacobi (Hestenes 1958): turns pairs of columns until all are orthogonal. */
static void decompose(decomposition *d)
{
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            d->v[i][j] = i == j;
    bool moved = true;
    for (int sweep = 0; sweep < SWEEPS && moved; sweep++) {
        moved = false;
        for (int p = 0; p < 2; p++)
            for (int q = p + 1; q < 3; q++) {
                const double alpha = dot(d->column[p], d->column[p], d->n),
                             beta = dot(d->column[q], d->column[q], d->n),
                             gamma = dot(d->column[p], d->column[q], d->n);
                if (fabs(gamma) <= 1e-16 * sqrt(alpha * beta))
                    continue;
                const double zeta = (beta - alpha) / (2 * gamma);
                const double t = copysign(1, zeta) / (fabs(zeta) + sqrt(1 + zeta * zeta));
                const double c = 1 / sqrt(1 + t * t);
                rotate(d->column[p], d->column[q], d->n, c, c * t);
                rotate(d->v[p], d->v[q], 3, c, c * t);
                moved = true;
            }
    }
}

typedef struct pixel {
    int n;
    int light[WEFT_LIGHTS_MAX]; /* the lights used */
    decomposition d;
    double singular[3], least;
    double scaled[3]; /* k n */
} pixel;

static void take(const weft_solve_samples *s, int k, pixel *p)
{
    p->n = 0;
    for (int j = 0; j < s->n_lights; j++) {
        if (!(s->at[j].weight[k] > 0))
            continue;
        for (int i = 0; i < 3; i++)
            p->d.column[i][p->n] = (double)s->at[j].light[i][k];
        p->light[p->n++] = j;
    }
    p->d.n = p->n;
}

/* The scaled normal by the pseudo-inverse: V diag(1 / s) U^T I'. */
static void solve_pixel(const weft_solve_samples *s, int k, pixel *p)
{
    decompose(&p->d);
    p->least = INFINITY;
    for (int i = 0; i < 3; i++) {
        p->singular[i] = sqrt(dot(p->d.column[i], p->d.column[i], p->n));
        p->least = fmin(p->least, p->singular[i]);
        p->scaled[i] = 0;
    }
    for (int i = 0; i < 3 && p->least > 0; i++) {
        double along = 0;
        for (int j = 0; j < p->n; j++)
            along += p->d.column[i][j] * (double)s->at[p->light[j]].grey[k];
        for (int a = 0; a < 3; a++)
            p->scaled[a] += p->d.v[i][a] * along / (p->singular[i] * p->singular[i]);
    }
}

static double facing(const weft_solve_samples *s, int j, int k, const double n[3])
{
    return n[0] * (double)s->at[j].light[0][k] + n[1] * (double)s->at[j].light[1][k] +
           n[2] * (double)s->at[j].light[2][k];
}

static void answer_albedo(const weft_solve_samples *s, int k, const pixel *p, const double n[3],
                          weft_solve_answers *a)
{
    for (int c = 0; c < s->n_channels; c++) {
        double above = 0, below = 0;
        for (int i = 0; i < p->n; i++) {
            const double cosine = facing(s, p->light[i], k, n);
            above += cosine * (double)s->at[p->light[i]].value[c][k];
            below += cosine * cosine;
        }
        a->albedo[c][k] = below > 0 ? (float)(above / below) : 0;
    }
}

/* Variance of a sample: the noise counts as eight samples beside the residuals, or as none where they are
 * three sigma above it; where it is not known the prior counts as two. */
static double sample_variance(double squares, double noise, double prior2, int n)
{
    const double dof = n - 3;
    if (!(noise > 0))
        return (squares + 2 * prior2) / (dof + 2);
    return squares > noise * (dof + 3 * sqrt(2 * dof)) ? squares / dof : (squares + 8 * noise) / (dof + 8);
}

/* The formulas of weft_lane_judge() and its neighbours, from the singular values. */
static void answer_quality(const weft_solve_samples *s, int k, const pixel *p, const double n[3],
                           double length, weft_solve_answers *a)
{
    double squares = 0, peak = 0, noise = 0, spread = 0;
    for (int i = 0; i < p->n; i++) {
        const double fit = facing(s, p->light[i], k, p->scaled);
        const double d = (double)s->at[p->light[i]].grey[k] - fit;
        squares += d * d;
        peak = fmax(peak, fit);
        noise += (double)s->at[p->light[i]].variance[k] / p->n;
    }
    if (!(peak > (double)WEFT_SOLVE_BLACK))
        return;
    for (int i = 0; i < 3; i++) {
        const double along = dot(p->d.v[i], n, 3);
        spread += (1 - along * along) / (p->singular[i] * p->singular[i]);
    }
    const double prior2 = pow((double)WEFT_SOLVE_PRIOR_MISFIT * peak, 2);
    const double angle2 = (squares + prior2) / (p->n - 2) * spread / (length * length);
    const double half2 = pow((double)WEFT_SOLVE_HALF_CONFIDENCE, 2);
    const double sample2 = sample_variance(squares, noise, prior2, p->n);
    const double limit2 = noise + pow((double)WEFT_SOLVE_MISFIT * peak, 2);
    a->residual[k] = (float)(sqrt(squares / p->n) / peak);
    a->confidence[k] = (float)(half2 / (half2 + angle2));
    a->angle[k] = (float)(sqrt(sample2 * spread) / length);
    if (sqrt(spread) > (double)WEFT_SOLVE_ILL_CONDITIONED)
        a->quality[k] |= (uint32_t)WEFT_QUALITY_ILL_CONDITIONED;
    if (p->n > 3 && squares > (p->n - 3) * limit2)
        a->quality[k] |= (uint32_t)WEFT_QUALITY_NOT_LAMBERTIAN;
}

static void answer(const weft_solve_samples *s, int k, const pixel *p, weft_solve_answers *a)
{
    const double length = sqrt(dot(p->scaled, p->scaled, 3));
    double n[3] = {0, 0, 1};
    a->valid[k] = 1;
    a->n_used[k] = (float)p->n;
    if (length >= (double)WEFT_SOLVE_BLACK)
        for (int i = 0; i < 3; i++)
            n[i] = p->scaled[i] / length;
    for (int i = 0; i < 3; i++)
        a->normal[i][k] = (float)n[i];
    if (length < (double)WEFT_SOLVE_BLACK)
        return;
    answer_albedo(s, k, p, n, a);
    answer_quality(s, k, p, n, length, a);
}

static void solve_svd(const weft_solve_samples *restrict samples, weft_solve_answers *restrict answers)
{
    pixel p;
    memset(answers, 0, sizeof *answers);
    for (int k = 0; k < WEFT_SOLVE_LANES; k++) {
        answers->quality[k] = (samples->clipped[k] > 0 ? (uint32_t)WEFT_QUALITY_CLIPPED : 0U) |
                              (samples->dark[k] > 0 ? (uint32_t)WEFT_QUALITY_SHADOWED : 0U);
        take(samples, k, &p);
        if (p.n < 3)
            continue;
        solve_pixel(samples, k, &p);
        if (p.least > (double)WEFT_SOLVE_MIN_SINGULAR)
            answer(samples, k, &p, answers);
    }
}

const weft_solve_method weft_method_svd = {.name = "svd",
                                           .summary =
                                               "least squares by singular values in double: a slow reference",
                                           .solve = solve_svd};
