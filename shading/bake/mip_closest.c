#include "shading/bake/mip_closest.h"

#include "core/clones.h"

#include <math.h>

enum { ROOT_ROUNDS = 24 };

/* A function of one number, for its root. */
typedef double root_fn(const void *context, double x);

/* A root of what has f0 at x0 and f1 of the other sign at x1 > x0, by false position (Illinois): until f is
 * within `near_f`, or x within `near_x` of x1 times that. */
WEFT_INLINE double find_root(root_fn *f, const void *context, double x0, double x1, double f0, double f1,
                             double near_f, double near_x)
{
    for (int round = 0; round < ROOT_ROUNDS && x1 - x0 > near_x * x1; round++) {
        const double x = x0 - f0 * (x1 - x0) / (f1 - f0), at = f(context, x);
        if (fabs(at) < near_f)
            return x;
        if ((at < 0) == (f0 < 0)) {
            x0 = x;
            f0 = at;
            f1 *= 0.5;
        } else {
            x1 = x;
            f1 = at;
            f0 *= 0.5;
        }
    }
    return 0.5 * (x0 + x1);
}

/* Sums go on side by side, so that the compiler may use vectors; footprints are padded to whole lanes. */
enum { LANES = WEFT_MIP_LANES };

typedef struct slopes {
    int n;                    /* a multiple of LANES */
    const float *d2, *a2, *w; /* [n] squared slope against the mean normal, squared alpha, weight */
} slopes;

/* Sum of w (2 P(t) - 1) over a footprint, P the share of GGX slopes within t of the mean normal. */
static double balance(const void *context, double square)
{
    const slopes *const of = context;
    const float *const d2 = of->d2, *const a2 = of->a2, *const w = of->w, t2 = (float)square;
    float sum[LANES] = {0};
    for (int i = 0; i < of->n; i += LANES)
        for (int k = 0; k < LANES; k++) {
            const float s = t2 + d2[i + k] + a2[i + k], under = s * s - 4 * t2 * d2[i + k];
            sum[k] += w[i + k] * (t2 - d2[i + k] - a2[i + k]) / sqrtf(under > 1e-20F ? under : 1e-20F);
        }
    return (double)((sum[0] + sum[1]) + (sum[2] + sum[3]));
}

/* Fills the last lanes with texels of no weight.  @return n rounded up to whole lanes */
static int pad(int n, float *d2, float *a2, float *w)
{
    for (; n % LANES; n++) {
        d2[n] = d2[n - 1];
        a2[n] = a2[n - 1];
        w[n] = 0;
    }
    return n;
}

/* The square of the median slope. */
static double median2(const slopes *of)
{
    double x0 = 1e9, x1 = 0;
    for (int i = 0; i < of->n; i++) {
        x0 = fmin(x0, (double)of->a2[i]);
        x1 = fmax(x1, (double)(of->d2[i] + of->a2[i]));
    }
    if (x1 - x0 < 1e-5 * x1)
        return x1;
    const double f0 = balance(of, x0), f1 = balance(of, x1);
    if (f0 >= 0 || f1 <= 0) /* rounding */
        return f0 >= 0 ? x0 : x1;
    return find_root(balance, of, x0, x1, f0, f1, 1e-4 * f1, 1e-4);
}

/* Slopes at which the two distributions are held against each other, as factors of the median squared: where
 * a GGX has 5, 15, 30, 50, 70, 85 and 95 per cent. */
static const double probes[] = {0.0526, 0.1765, 0.4286, 1, 2.3333, 5.6667, 19};

enum { PROBES = sizeof probes / sizeof probes[0] };

typedef struct probed {
    double squares[PROBES], shares[PROBES]; /* of slopes, of the footprint within them */
} probed;

/* By how much more the model lies above the footprint somewhere than below it elsewhere; falls with alpha2,
 * as each share of the model does. */
static double excess(const void *context, double alpha2)
{
    const probed *const p = context;
    double above = -1, below = -1;
    for (int k = 0; k < PROBES; k++) {
        const double off = p->squares[k] / (p->squares[k] + alpha2) - p->shares[k];
        above = off > above ? off : above;
        below = -off > below ? -off : below;
    }
    return above - below;
}

/* alpha of the GGX that is nowhere far from the footprint: where it is as far above as below. */
static double closest(const slopes *of)
{
    probed p;
    double weight = 0;
    const double middle = median2(of), x0 = middle / 7.4, x1 = middle * 7.4;
    for (int i = 0; i < of->n; i++)
        weight += (double)of->w[i];
    for (int k = 0; k < PROBES; k++) {
        p.squares[k] = probes[k] * middle;
        p.shares[k] = 0.5 + 0.5 * balance(of, p.squares[k]) / weight;
    }
    const double f0 = excess(&p, x0), f1 = excess(&p, x1);
    if (f0 <= 0 || f1 >= 0)
        return sqrt(f0 <= 0 ? x0 : x1);
    return sqrt(find_root(excess, &p, x0, x1, f0, f1, 1e-5, 4e-4));
}

double weft_mip_closest(int n, float *d2, float *a2, float *w)
{
    const slopes of = {pad(n, d2, a2, w), d2, a2, w};
    return closest(&of);
}
