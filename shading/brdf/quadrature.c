#include "shading/brdf/quadrature.h"

#include <assert.h>
#include <math.h>

#define HALF_PI 1.57079632679489661923
#define REACH   3.5 /* the weights behind it are below 1e-20 */

void weft_quadrature_init(weft_quadrature *q, int per_unit)
{
    const double step = 1.0 / per_unit;
    const int half = (int)(REACH * per_unit);
    double sum = 0;
    assert(per_unit > 0 && 2 * half + 1 <= WEFT_QUADRATURE_MAX);
    q->n = 2 * half + 1;
    for (int i = 0; i < q->n; i++) {
        const double t = (i - half) * step, s = HALF_PI * sinh(t), c = cosh(s);
        q->at[i] = 1 / (1 + exp(-2 * s)); /* (1 + tanh s)/2, without cancellation at either end */
        q->to_end[i] = 1 / (1 + exp(2 * s));
        q->weight[i] = 0.5 * step * HALF_PI * cosh(t) / (c * c);
        sum += q->weight[i];
    }
    assert(fabs(sum - 1) < 1e-6);
}
