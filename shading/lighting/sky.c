#include "shading/lighting/sky.h"

#include "shading/brdf/quadrature.h"

#define PI 3.14159265358979323846

const weft_sky weft_sky_cie_clear = {-1, -0.32, 10, -3, 0.45};
const weft_sky weft_sky_far_cry_3 = {-1, -0.08, 24, -3, 0.30};

static double gradation(const weft_sky *sky, double zenith_rad)
{
    const double cosine = cos(zenith_rad);
    return 1 + (cosine > 0 ? sky->a * exp(sky->b / cosine) : 0); /* b < 0: the exponential is 0 there */
}

static double indicatrix(const weft_sky *sky, double angle_rad)
{
    const double cosine = cos(angle_rad);
    return 1 + sky->c * (exp(sky->d * angle_rad) - exp(sky->d * PI / 2)) + sky->e * cosine * cosine;
}

/* `off_rad` is zenith_rad - sun_zenith_rad. */
static double sun_angle(double zenith_rad, double off_rad, double azimuth_rad, double sun_zenith_rad)
{
    const double across = sin(off_rad / 2), around = sin(azimuth_rad / 2);
    const double s2 = across * across + sin(zenith_rad) * sin(sun_zenith_rad) * around * around;
    return s2 < 1 ? 2 * asin(sqrt(s2)) : PI;
}

double weft_sky_sun_angle(double zenith_rad, double azimuth_rad, double sun_zenith_rad)
{
    return sun_angle(zenith_rad, zenith_rad - sun_zenith_rad, azimuth_rad, sun_zenith_rad);
}

double weft_sky_relative_to_zenith(const weft_sky *sky, double zenith_rad, double azimuth_rad,
                                   double sun_zenith_rad)
{
    const double angle = weft_sky_sun_angle(zenith_rad, azimuth_rad, sun_zenith_rad);
    return gradation(sky, zenith_rad) * indicatrix(sky, angle) /
           (gradation(sky, 0) * indicatrix(sky, sun_zenith_rad));
}

double weft_sky_relative_to_sun(const weft_sky *sky, double zenith_rad, double azimuth_rad,
                                double sun_zenith_rad)
{
    const double angle = weft_sky_sun_angle(zenith_rad, azimuth_rad, sun_zenith_rad);
    return gradation(sky, zenith_rad) * indicatrix(sky, angle) /
           (gradation(sky, sun_zenith_rad) * indicatrix(sky, 0));
}

/* Adds the ring of sky at zenith_rad to the moments 2 integral g cos(m azimuth), m = 0..2. */
static void ring_moments(const weft_sky *sky, const weft_quadrature *q, double zenith_rad, double off_rad,
                         double sun_zenith_rad, double moment[3])
{
    moment[0] = moment[1] = moment[2] = 0;
    for (int i = 0; i < q->n; i++) {
        const double azimuth = PI * q->at[i], c = cos(azimuth);
        const double g =
            2 * PI * q->weight[i] * indicatrix(sky, sun_angle(zenith_rad, off_rad, azimuth, sun_zenith_rad));
        moment[0] += g;
        moment[1] += g * c;
        moment[2] += g * (2 * c * c - 1);
    }
}

/* Adds zeniths from the sun's to `end_rad` to the projection with the sun at azimuth 0: (0,0) (1,0) (1,1)
 * (2,0) (2,1) (2,2).  The cusp at the sun lies at the end of both intervals, where nodes crowd. */
static void project_from_sun(const weft_sky *sky, const weft_quadrature *q, double sun_zenith_rad,
                             double end_rad, double sum[6])
{
    const double length = end_rad - sun_zenith_rad;
    for (int i = 0; i < q->n; i++) {
        const double zenith =
            q->at[i] < 0.5 ? sun_zenith_rad + length * q->at[i] : end_rad - length * q->to_end[i];
        const double s = sin(zenith), c = cos(zenith);
        double moment[3], basis[WEFT_SH_COUNT];
        ring_moments(sky, q, zenith, length * q->at[i], sun_zenith_rad, moment);
        weft_sh_basis(s, 0, c, basis);
        const double w = fabs(length) * q->weight[i] * s * gradation(sky, zenith);
        sum[0] += w * basis[0] * moment[0];
        sum[1] += w * basis[2] * moment[0];
        sum[2] += w * basis[3] * moment[1];
        sum[3] += w * basis[6] * moment[0];
        sum[4] += w * basis[7] * moment[1];
        sum[5] += w * basis[8] * moment[2];
    }
}

void weft_sky_project(const weft_sky *sky, double sun_zenith_rad, double sun_azimuth_rad,
                      double light[WEFT_SH_COUNT])
{
    weft_quadrature q;
    double sum[6] = {0};
    weft_quadrature_init(&q, 16);
    project_from_sun(sky, &q, sun_zenith_rad, 0, sum);
    project_from_sun(sky, &q, sun_zenith_rad, PI / 2, sum);
    const double scale = 1 / (gradation(sky, sun_zenith_rad) * indicatrix(sky, 0));
    const double c1 = cos(sun_azimuth_rad), s1 = sin(sun_azimuth_rad);
    const double c2 = cos(2 * sun_azimuth_rad), s2 = sin(2 * sun_azimuth_rad);
    light[0] = scale * sum[0];
    light[1] = scale * sum[2] * s1;
    light[2] = scale * sum[1];
    light[3] = scale * sum[2] * c1;
    light[4] = scale * sum[5] * s2;
    light[5] = scale * sum[4] * s1;
    light[6] = scale * sum[3];
    light[7] = scale * sum[4] * c1;
    light[8] = scale * sum[5] * c2;
}
