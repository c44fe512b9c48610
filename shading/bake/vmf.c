#include "shading/bake/vmf.h"

#include <math.h>

#define PI 3.14159265358979323846

double weft_vmf_density(double kappa, double cosine)
{
    const double norm = kappa > 0 ? kappa / -expm1(-2 * kappa) : 0.5;
    return norm / (2 * PI) * exp(kappa * (cosine - 1));
}

/* I_(l+1/2)/I_(l-1/2) from above: each is 1/((2l+1)/kappa + the next), which forgets where it began. */
double weft_vmf_coefficient(double kappa, int l)
{
    double ratio = 0, product = 1;
    if (kappa <= 0)
        return l == 0 ? 1 : 0;
    for (int k = l + 40 + (int)(8 * sqrt(kappa)); k >= 1; k--) {
        ratio = 1 / ((2 * k + 1) / kappa + ratio);
        if (k <= l)
            product *= ratio;
    }
    return product;
}

double weft_vmf_coefficient_gauss(double kappa, int l)
{
    return exp(-(double)l * l / (2 * kappa));
}

double weft_vmf_kappa(double r)
{
    return r < 1 ? (3 * r - r * r * r) / ((1 - r) * (1 + r)) : HUGE_VAL;
}

double weft_vmf_kappa_listing(double r)
{
    return r < 1 ? weft_vmf_kappa(r) : 10000;
}

/* Newton on 1 - r, from the approximation; the two forms keep digits at either end. */
double weft_vmf_kappa_exact(double r)
{
    double kappa = weft_vmf_kappa(r);
    if (r <= 0 || r >= 1)
        return r <= 0 ? 0 : HUGE_VAL;
    for (int i = 0; i < 30; i++) {
        double off, slope;
        if (kappa < 10) {
            const double length = weft_vmf_coefficient(kappa, 1);
            off = length - r;
            slope = 1 - length * length - 2 * length / kappa;
        } else {
            const double tail = expm1(2 * kappa);
            off = (1 - r) - 1 / kappa + 2 / tail;
            slope = 1 / (kappa * kappa) - 4 * (1 + 1 / tail) / tail;
        }
        const double step = off / slope;
        kappa -= step;
        if (fabs(step) <= 1e-15 * kappa)
            break;
    }
    return kappa;
}

double weft_vmf_roughness(double alpha, double kappa, weft_vmf_widening widening)
{
    const double times = widening == WEFT_VMF_EQ_37 ? 0.5 : widening == WEFT_VMF_CONSISTENT ? 2 : 1;
    return sqrt(alpha * alpha + times / kappa);
}
