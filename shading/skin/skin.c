#include "shading/skin/skin.h"

#include "shading/brdf/quadrature.h"
#include "shading/lighting/spherical_harmonics.h"

#define PI 3.14159265358979323846

enum { GAUSSIANS = 6 };

static const double variances_mm2[GAUSSIANS] = {0.0064, 0.0484, 0.187, 0.567, 1.99, 7.41};
static const double weights[GAUSSIANS][3] = {
    {0.233, 0.455, 0.649}, {0.100, 0.336, 0.344}, {0.118, 0.198, 0},
    {0.113, 0.007, 0.007}, {0.358, 0.004, 0},     {0.078, 0, 0},
};

static double variance(weft_skin_profile profile, int i)
{
    return variances_mm2[i] * (profile == WEFT_SKIN_WIDE ? sqrt(2) : 1);
}

/* What stands before exp(-d^2/(2 v)) of Gaussian i, without its weight. */
static double height(weft_skin_profile profile, int i)
{
    const double area = 2 * PI * variance(profile, i);
    return profile == WEFT_SKIN_RADIAL ? 1 / area : 1 / sqrt(area);
}

void weft_skin_reflectance(weft_skin_profile profile, double distance_mm, double rgb[3])
{
    rgb[0] = rgb[1] = rgb[2] = 0;
    for (int i = 0; i < GAUSSIANS; i++) {
        const double value =
            height(profile, i) * exp(-distance_mm * distance_mm / (2 * variance(profile, i)));
        for (int c = 0; c < 3; c++)
            rgb[c] += weights[i][c] * value;
    }
}

/* Of the chord 2 r sin(x/2) a Gaussian is exp(-k (1 - cos x)), k = r^2/v: its integral and that times the
 * clamped cosine, over begin..end, which do not cross 0 or where the cosine turns negative. */
typedef struct ring_integral {
    double light, total;
} ring_integral;

static void add_piece(const weft_quadrature *q, double theta_rad, double k, double begin, double end,
                      ring_integral *sum)
{
    for (int i = 0; i < q->n; i++) {
        const double x =
            q->at[i] < 0.5 ? begin + (end - begin) * q->at[i] : end - (end - begin) * q->to_end[i];
        const double s = sin(x / 2), w = q->weight[i] * (end - begin) * exp(-2 * k * s * s);
        const double cosine = cos(theta_rad + x);
        sum->total += w;
        sum->light += cosine > 0 ? w * cosine : 0;
    }
}

static ring_integral ring(const weft_quadrature *q, double theta_rad, double k)
{
    const double reach = k > 20 ? 2 * asin(sqrt(20 / k)) : PI; /* behind it the exponential is below e^-40 */
    /* in order: the cosine is positive between -pi/2 - theta and pi/2 - theta, and again from 3/2 pi - theta
     */
    const double cuts[] = {-reach, -PI / 2 - theta_rad, PI / 2 - theta_rad, 3 * PI / 2 - theta_rad, reach};
    ring_integral sum = {0, 0};
    double from = -reach;
    for (int i = 1; i < 5; i++) {
        const double to = fmin(fmax(cuts[i], from), reach);
        if (from < 0 && to > 0) {
            add_piece(q, theta_rad, k, from, 0, &sum);
            add_piece(q, theta_rad, k, 0, to, &sum);
        } else if (to > from) {
            add_piece(q, theta_rad, k, from, to, &sum);
        }
        from = to;
    }
    return sum;
}

static void transfer(const weft_quadrature *q, weft_skin_profile profile, double theta_rad, double radius_mm,
                     double rgb[3])
{
    double light[3] = {0}, total[3] = {0};
    for (int i = 0; i < GAUSSIANS; i++) {
        const ring_integral part = ring(q, theta_rad, radius_mm * radius_mm / variance(profile, i));
        for (int c = 0; c < 3; c++) {
            light[c] += weights[i][c] * height(profile, i) * part.light;
            total[c] += weights[i][c] * height(profile, i) * part.total;
        }
    }
    for (int c = 0; c < 3; c++)
        rgb[c] = light[c] / total[c];
}

void weft_skin_transfer(weft_skin_profile profile, double theta_rad, double radius_mm, double rgb[3])
{
    weft_quadrature q;
    weft_quadrature_init(&q, 16);
    transfer(&q, profile, theta_rad, radius_mm, rgb);
}

static void add_zonal(const weft_quadrature *q, weft_skin_profile profile, double radius_mm, double begin,
                      double end, double zonal[3][3])
{
    for (int i = 0; i < q->n; i++) {
        const double theta =
            q->at[i] < 0.5 ? begin + (end - begin) * q->at[i] : end - (end - begin) * q->to_end[i];
        const double w = 2 * PI * q->weight[i] * (end - begin) * sin(theta);
        double rgb[3];
        if (w < 1e-25)
            continue;
        transfer(q, profile, theta, radius_mm, rgb);
        for (int l = 0; l < WEFT_SH_BANDS; l++)
            for (int c = 0; c < 3; c++)
                zonal[l][c] += w * weft_sh_zonal(l, cos(theta)) * rgb[c];
    }
}

/* In two pieces: at pi/2 the transfer of a large radius has the kink of the clamped cosine. */
void weft_skin_zonal(weft_skin_profile profile, double radius_mm, double end_rad, double zonal[3][3])
{
    weft_quadrature q;
    weft_quadrature_init(&q, 16);
    for (int l = 0; l < WEFT_SH_BANDS; l++)
        for (int c = 0; c < 3; c++)
            zonal[l][c] = 0;
    add_zonal(&q, profile, radius_mm, 0, fmin(end_rad, PI / 2), zonal);
    if (end_rad > PI / 2)
        add_zonal(&q, profile, radius_mm, PI / 2, end_rad, zonal);
}
