#include "shading/lighting/environment_rings.h"

#include "shading/brdf/fresnel.h"
#include "shading/brdf/ggx.h"
#include "shading/brdf/half_vector.h"
#include "shading/brdf/schlick_smith.h"

enum { GAUSS = 5 };

#define EVEN  0.25 /* the share of places that count the cosine itself */
#define REACH 12.0 /* of log tan(psi/2) beyond the places where the integrand turns */
#define RATIO 2.0  /* of neighbouring tangents */

static double width_of(double alpha, double nv)
{
    return 2 * alpha * (sqrt((1 - nv) * (1 + nv)) + alpha);
}

double weft_environment_ring_place(double alpha, double nv, double cone_cosine)
{
    const double width = width_of(alpha, nv), open = atan(nv / width), closed = atan((nv - 1) / width);
    const double fallen = (open - atan((nv - cone_cosine) / width)) / (open - closed);
    return (1 - EVEN) * fallen + EVEN * cone_cosine;
}

double weft_environment_ring_cosine(double alpha, double nv, double place)
{
    double below = 0, above = 1;
    if (place <= 0 || place >= 1)
        return place <= 0 ? 0 : 1;
    for (int i = 0; i < 50; i++) {
        const double c = 0.5 * (below + above);
        *(weft_environment_ring_place(alpha, nv, c) < place ? &below : &above) = c;
    }
    return 0.5 * (below + above);
}

static double masking(weft_environment_lobe lobe, double x, double alpha)
{
    if (lobe == WEFT_ENVIRONMENT_SMITH)
        return weft_ggx_v1(x, alpha);
    return 0.5 * weft_schlick_v1(x, weft_schlick_k_ggx(alpha)); /* 1/4 in two halves */
}

/* The ring's lights of cosine nl: what a step d(nl) of them adds.
 *
 * With q = sin^2(psi/2), Q = A^2 + B^2 q and lh^2 = g + B^2 q/4 (g at psi 0), lh^2/Q = 1/4 + e/Q, e = g -
 * A^2/4; so the ring's whole is elementary, and the part of (1 - lh)^5 is summed over even steps of log
 * tan(psi/2), at whose ends it falls off exponentially. */
static weft_environment_share ring(weft_environment_lobe lobe, double alpha, double nv, double nl)
{
    const double sl = sqrt((1 - nl) * (1 + nl)), sv = sqrt((1 - nv) * (1 + nv)), p = sl * sv;
    const double wide = alpha * (nl + nv), apart = sl - sv;
    const double a2 = wide * wide + apart * apart, sum2 = a2 + 4 * p, a = sqrt(a2), sum = sqrt(sum2);
    const double g = 0.5 * (1 + nl * nv - p), e = g - 0.25 * a2;
    if (nl <= 0 || a2 <= 0)
        return (weft_environment_share){0, 0};
    const double all =
        WEFT_PI * (1.0 / 16 + 0.5 * e / (a * sum) + 0.5 * e * e * (a2 + sum2) / (a2 * a * sum2 * sum));
    double bias = 0;
    const int steps = (int)ceil((2 * REACH - log(a / sum)) / log(RATIO));
    double t = a / sum * exp(-REACH);
    for (int i = 0; i < steps; i++, t *= RATIO) {
        const double t2 = t * t, q = t2 / (1 + t2), lh2 = g + p * q, r = lh2 / (a2 + 4 * p * q);
        bias += r * r * weft_schlick_weight(sqrt(lh2 < 1 ? lh2 : 1)) * t / (1 + t2);
    }
    bias *= 2 * log(RATIO);
    /* both sides of the view's plane; D = alpha^2/pi (4 lh^2/Q)^2 */
    const double factor =
        2 * 16 * alpha * alpha / WEFT_PI * masking(lobe, nl, alpha) * masking(lobe, nv, alpha) * nl;
    return (weft_environment_share){factor * (all - bias), factor * bias};
}

void weft_environment_rings(weft_environment_lobe lobe, double alpha, double nv, int n,
                            weft_environment_share share[])
{
    static const double at[GAUSS] = {0.04691007703066800, 0.23076534494715845, 0.5, 0.76923465505284155,
                                     0.95308992296933200};
    static const double weight[GAUSS] = {0.11846344252809454, 0.23931433524968324, 0.28444444444444444,
                                         0.23931433524968324, 0.11846344252809454};
    const double width = width_of(alpha, nv);
    double above = atan((nv - 1) / width); /* the angle whose tangent falls as the cosine rises */
    share[n - 1] = (weft_environment_share){0, 0};
    for (int k = n - 2; k >= 0; k--) {
        const double cone = weft_environment_ring_cosine(alpha, nv, k / (n - 1.0));
        const double below = atan((nv - cone) / width), wide = below - above;
        share[k] = share[k + 1];
        for (int i = 0; i < GAUSS; i++) {
            const double x = tan(above + wide * at[i]), nl = nv - width * x;
            const weft_environment_share here = ring(lobe, alpha, nv, nl > 0 ? (nl < 1 ? nl : 1) : 0);
            const double step = wide * weight[i] * width * (1 + x * x); /* of nl */
            share[k].scale += step * here.scale;
            share[k].bias += step * here.bias;
        }
        above = below;
    }
}
