#include "shading/brdf/facet_walk.h"

#include "shading/brdf/fresnel.h"
#include "shading/brdf/sampling.h"

#include <stdbool.h>

enum { EVEN = 10 }; /* numbers of a walk that are of low discrepancy: the first two meetings */

/* The random numbers of one walk. */
typedef struct source {
    double shift[EVEN], step[EVEN];
    long walk;
    int used;
    uint64_t state;
} source;

/* Steele, Lea and Flood 2014 (SplitMix64), as a number in [0, 1). */
static double scrambled(uint64_t *state)
{
    uint64_t z = *state += 0x9e3779b97f4a7c15u;
    z = (z ^ z >> 30) * 0xbf58476d1ce4e5b9u;
    z = (z ^ z >> 27) * 0x94d049bb133111ebu;
    return (double)((z ^ z >> 31) >> 11) * 0x1p-53;
}

/* Kronecker sequence of the powers of 1/x, x^(EVEN + 1) = x + 1, then scrambled numbers. */
static double next(source *from)
{
    if (from->used >= EVEN)
        return scrambled(&from->state);
    const double at = from->shift[from->used] + (double)from->walk * from->step[from->used];
    from->used++;
    return at - floor(at);
}

double weft_facet_lambda(double alpha, double cosine)
{
    const double z = fabs(cosine) > 1e-9 ? cosine : 1e-9;
    const double slope2 = alpha * alpha * (1 - z * z) / (z * z), root = sqrt(1 + slope2);
    return 0.5 * (cosine < 0 ? -1 - root : slope2 / (1 + root)); /* (root - 1)/2 without cancellation */
}

/* Where the ray meets the surface next; false where it leaves. */
static bool meet(const weft_facet_surface *on, double cosine, double u, double *share)
{
    const double lambda = weft_facet_lambda(on->alpha, cosine);
    if (cosine > 0 && (lambda <= 0 || u > 1 - pow(*share, lambda)))
        return false;
    const double met = *share * pow(1 - u, -1 / lambda);
    *share = met < 1 ? met : 1;
    return true;
}

/* A direction with cosine density about the unit vector m. */
static void leave_about(const double m[3], double u1, double u2, double direction[3])
{
    double local[3];
    weft_sample_cosine(u1, u2, local);
    /* Frisvad 2012 as Duff et al. 2017 mend it; m.z >= 0 here */
    const double k = -1 / (1 + m[2]), b = m[0] * m[1] * k;
    const double t[3] = {1 + m[0] * m[0] * k, b, -m[0]}, s[3] = {b, 1 + m[1] * m[1] * k, -m[1]};
    for (int c = 0; c < 3; c++)
        direction[c] = local[0] * t[c] + local[1] * s[c] + local[2] * m[c];
}

static double dot(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static double passes(const weft_facet_surface *on, double cosine)
{
    const double u = cosine > 0 ? (cosine < 1 ? cosine : 1) : 0;
    return on->coat == WEFT_FACET_BARE ? 1 : 1 - weft_fresnel_schlick(on->f0, u);
}

/* What one walk of light sends to the view: f n.v. */
static double walk(const weft_facet_surface *on, const double light[3], const double view[3],
                   double lambda_view, source *from)
{
    double ray[3] = {-light[0], -light[1], -light[2]}, share = 1, weight = 1, sum = 0;
    for (int k = 0; k < on->meetings && meet(on, ray[2], next(from), &share); k++) {
        const double back[3] = {-ray[0], -ray[1], -ray[2]};
        double m[3];
        const double u1 = next(from), u2 = next(from);
        weft_sample_ggx_visible(back, on->alpha, on->alpha, u1, u2, m);
        if (k == 0 || on->coat != WEFT_FACET_FIRST)
            weight *= passes(on, dot(back, m));
        const double seen = dot(view, m);
        const double out = on->coat == WEFT_FACET_BOTH ? passes(on, seen) : 1;
        if (seen > 0)
            sum += weight * out * seen / WEFT_PI * pow(share, lambda_view);
        const double v1 = next(from), v2 = next(from);
        leave_about(m, v1, v2, ray);
        if (on->coat == WEFT_FACET_BOTH)
            weight *= passes(on, dot(ray, m));
    }
    return sum;
}

double weft_facet_walk(const weft_facet_surface *surface, const double light[3], const double view[3],
                       long n_walks, uint64_t seed)
{
    const double lambda_view = weft_facet_lambda(surface->alpha, view[2]);
    double sum = 0, step = 1;
    source from = {.state = seed};
    for (int k = 0; k < EVEN; k++) {
        from.shift[k] = scrambled(&from.state);
        from.step[k] = step /= 1.0682971889208412;
    }
    for (from.walk = 0; from.walk < n_walks; from.walk++) {
        from.used = 0;
        sum += walk(surface, light, view, lambda_view, &from);
    }
    return sum / (double)n_walks / view[2];
}
