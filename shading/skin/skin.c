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

/* What light does at an offset x around the ring, in up to MOMENTS numbers, and where that has kinks. */
enum { MOMENTS = 3, MAX_CUTS = 3 };
typedef struct receiver {
    void (*fn)(double x_rad, double angle_rad, double value[MOMENTS]);
    double angle_rad; /* theta of the transfer; end of the zonal integral */
    int n_cuts;
    double cuts_rad[MAX_CUTS]; /* rising */
} receiver;

/* Mean of the receiver's numbers over a Gaussian of the chord 2 r sin(x/2), which is exp(-k (1 - cos x)) with
 * k = r^2/v, and the Gaussian's integral. */
typedef struct ring_integral {
    double value[MOMENTS], total;
} ring_integral;

static void add_piece(const weft_quadrature *q, const receiver *to, double k, double begin, double end,
                      ring_integral *sum)
{
    for (int i = 0; i < q->n; i++) {
        const double x =
            q->at[i] < 0.5 ? begin + (end - begin) * q->at[i] : end - (end - begin) * q->to_end[i];
        const double s = sin(x / 2), w = q->weight[i] * (end - begin) * exp(-2 * k * s * s);
        double value[MOMENTS] = {0};
        to->fn(x, to->angle_rad, value);
        sum->total += w;
        for (int m = 0; m < MOMENTS; m++)
            sum->value[m] += w * value[m];
    }
}

static ring_integral ring(const weft_quadrature *q, const receiver *to, double k)
{
    const double reach = k > 20 ? 2 * asin(sqrt(20 / k)) : PI; /* behind it the exponential is below e^-40 */
    ring_integral sum = {{0}, 0};
    double from = -reach;
    for (int i = 0; i <= to->n_cuts; i++) {
        const double until = i < to->n_cuts ? fmin(fmax(to->cuts_rad[i], from), reach) : reach;
        if (from < 0 && until > 0) {
            add_piece(q, to, k, from, 0, &sum);
            add_piece(q, to, k, 0, until, &sum);
        } else if (until > from) {
            add_piece(q, to, k, from, until, &sum);
        }
        from = until;
    }
    return sum;
}

/* The receiver under the whole profile, normalised: moments by channel. */
static void under_profile(const receiver *to, weft_skin_profile profile, double radius_mm,
                          double moments[MOMENTS][3])
{
    weft_quadrature q;
    double total[3] = {0};
    weft_quadrature_init(&q, 16);
    for (int m = 0; m < MOMENTS; m++)
        moments[m][0] = moments[m][1] = moments[m][2] = 0;
    for (int i = 0; i < GAUSSIANS; i++) {
        const ring_integral part = ring(&q, to, radius_mm * radius_mm / variance(profile, i));
        for (int c = 0; c < 3; c++) {
            const double a = weights[i][c] * height(profile, i);
            total[c] += a * part.total;
            for (int m = 0; m < MOMENTS; m++)
                moments[m][c] += a * part.value[m];
        }
    }
    for (int m = 0; m < MOMENTS; m++)
        for (int c = 0; c < 3; c++)
            moments[m][c] /= total[c];
}

static void clamped_cosine(double x_rad, double theta_rad, double value[MOMENTS])
{
    value[0] = fmax(cos(theta_rad + x_rad), 0);
}

void weft_skin_transfer(weft_skin_profile profile, double theta_rad, double radius_mm, double rgb[3])
{
    double moments[MOMENTS][3];
    const receiver to = {
        clamped_cosine, theta_rad, 3, {-PI / 2 - theta_rad, PI / 2 - theta_rad, 3 * PI / 2 - theta_rad}};
    under_profile(&to, profile, radius_mm, moments);
    for (int c = 0; c < 3; c++)
        rgb[c] = moments[0][c];
}

/* Antiderivatives in theta of sin cos^l cos(theta + x), l = 0..2, by sums of angles. */
static void antiderivatives(double theta, double x, double value[3])
{
    const double twice = cos(2 * theta + x), flat = theta * sin(x);
    value[0] = -(twice / 2 + flat) / 2;
    value[1] = -(cos(3 * theta + x) / 3 + cos(theta - x)) / 4;
    value[2] = -(twice / 2 + flat + cos(4 * theta + x) / 4 + cos(2 * theta - x) / 2) / 8;
}

/* Zonal coefficients of max(cos(theta + x), 0) over theta 0..end: turn of theta and x in closed form. */
static void zonal_cosine(double x_rad, double end_rad, double value[MOMENTS])
{
    double moment[3] = {0};
    for (int turn = 0; turn < 2; turn++) {
        double high[3], low[3];
        const double from = fmax(2 * PI * turn - PI / 2 - x_rad, 0);
        const double to = fmin(2 * PI * turn + PI / 2 - x_rad, end_rad);
        if (to <= from)
            continue;
        antiderivatives(to, x_rad, high);
        antiderivatives(from, x_rad, low);
        for (int m = 0; m < 3; m++)
            moment[m] += high[m] - low[m];
    }
    value[0] = 2 * PI * weft_sh_zonal(0, 0) * moment[0];
    value[1] = 2 * PI * weft_sh_zonal(1, 1) * moment[1];
    value[2] =
        2 * PI * (weft_sh_zonal(2, 0) * moment[0] + (weft_sh_zonal(2, 1) - weft_sh_zonal(2, 0)) * moment[2]);
}

void weft_skin_zonal(weft_skin_profile profile, double radius_mm, double end_rad, double zonal[3][3])
{
    /* the lit arc begins or ends at one end of 0..end_rad; that at pi/2 - end_rad is 0 or -pi/2 for the two
     * ends in use, and costs a few digits for others */
    const receiver to = {zonal_cosine, end_rad, 3, {-PI / 2, PI / 2 - end_rad, PI / 2}};
    under_profile(&to, profile, radius_mm, zonal);
}
