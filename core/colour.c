#include "core/colour.h"

#include "core/linalg.h"

#include <math.h>

/* The row sums of the sRGB matrix, so that linear (1, 1, 1) is exactly this white. */
const double weft_white_d65[3] = {0.9505, 1.0, 1.0890};
const double weft_white_d50[3] = {0.96422, 1.0, 0.82521}; /* ASTM E308 */

static const weft_mat3 srgb_to_xyz = {
    {0.4124, 0.3576, 0.1805, 0.2126, 0.7152, 0.0722, 0.0193, 0.1192, 0.9505}};

/* Lam 1985, as in ICC.1:2022 annex E. */
static const weft_mat3 bradford = {
    {0.8951, 0.2664, -0.1614, -0.7502, 1.7135, 0.0367, 0.0389, -0.0685, 1.0296}};

double weft_srgb_encode(double linear)
{
    const double a = fabs(linear);
    const double e = a <= 0.0031308 ? 12.92 * a : 1.055 * pow(a, 1 / 2.4) - 0.055;
    return copysign(e, linear);
}

double weft_srgb_decode(double encoded)
{
    const double a = fabs(encoded);
    const double l = a <= 0.04045 ? a / 12.92 : pow((a + 0.055) / 1.055, 2.4);
    return copysign(l, encoded);
}

int weft_srgb_encode8(double linear)
{
    if (!(linear > 0)) /* NaN too */
        return 0;
    return linear >= 1 ? 255 : (int)(255 * weft_srgb_encode(linear) + 0.5);
}

static void apply(const weft_mat3 *m, const double in[3], double out[3])
{
    const weft_vec3 v = weft_mat3_apply(m, (weft_vec3){in[0], in[1], in[2]});
    out[0] = v.x;
    out[1] = v.y;
    out[2] = v.z;
}

static void apply_inverse(const weft_mat3 *m, const double in[3], double out[3])
{
    weft_mat3 inverse = {{0}};
    weft_mat3_invert(m, &inverse); /* both matrices above are regular */
    apply(&inverse, in, out);
}

void weft_srgb_to_xyz(const double rgb[3], double xyz[3])
{
    apply(&srgb_to_xyz, rgb, xyz);
}

void weft_xyz_to_xyy(const double xyz[3], double xyy[3])
{
    const double sum = xyz[0] + xyz[1] + xyz[2];
    xyy[0] = sum > 0 ? xyz[0] / sum : 0.3127;
    xyy[1] = sum > 0 ? xyz[1] / sum : 0.3290;
    xyy[2] = sum > 0 ? xyz[1] : 0;
}

void weft_xyy_to_xyz(const double xyy[3], double xyz[3])
{
    const double x = xyy[0], y = fmax(xyy[1], 1e-6), luminance = xyy[2];
    xyz[0] = luminance * x / y;
    xyz[1] = luminance;
    xyz[2] = luminance * (1 - x - y) / y;
}

void weft_xyz_to_srgb(const double xyz[3], double rgb[3])
{
    apply_inverse(&srgb_to_xyz, xyz, rgb);
}

/* CIE 15:2004, 8.2.1: the cube root with its straight line near black; eps = (6/29)^3. */
static double lab_f(double t)
{
    const double eps = 216.0 / 24389.0, slope = 24389.0 / 27.0;
    return t > eps ? cbrt(t) : (slope * t + 16) / 116;
}

static double lab_f_inverse(double f)
{
    const double slope = 24389.0 / 27.0;
    return f > 6.0 / 29.0 ? f * f * f : (116 * f - 16) / slope;
}

void weft_xyz_to_lab(const double xyz[3], const double white[3], double lab[3])
{
    const double fx = lab_f(xyz[0] / white[0]), fy = lab_f(xyz[1] / white[1]), fz = lab_f(xyz[2] / white[2]);
    lab[0] = 116 * fy - 16;
    lab[1] = 500 * (fx - fy);
    lab[2] = 200 * (fy - fz);
}

void weft_lab_to_xyz(const double lab[3], const double white[3], double xyz[3])
{
    const double fy = (lab[0] + 16) / 116, fx = fy + lab[1] / 500, fz = fy - lab[2] / 200;
    xyz[0] = white[0] * lab_f_inverse(fx);
    xyz[1] = white[1] * lab_f_inverse(fy);
    xyz[2] = white[2] * lab_f_inverse(fz);
}

void weft_srgb_to_lab(const double rgb[3], double lab[3])
{
    double xyz[3];
    weft_srgb_to_xyz(rgb, xyz);
    weft_xyz_to_lab(xyz, weft_white_d65, lab);
}

void weft_adapt_bradford(const double xyz[3], const double from_white[3], const double to_white[3],
                         double adapted[3])
{
    double cone[3], cone_from[3], cone_to[3];
    apply(&bradford, xyz, cone);
    apply(&bradford, from_white, cone_from);
    apply(&bradford, to_white, cone_to);
    for (int i = 0; i < 3; i++)
        cone[i] *= cone_to[i] / cone_from[i];
    apply_inverse(&bradford, cone, adapted);
}

static double degrees(double rad)
{
    return rad * (180 / M_PI);
}

static double radians(double deg)
{
    return deg * (M_PI / 180);
}

/* Hue angle in degrees, 0..360; 0 for grey (eq. 7). */
static double hue_deg(double a, double b)
{
    if (a == 0 && b == 0)
        return 0;
    const double h = degrees(atan2(b, a));
    return h < 0 ? h + 360 : h;
}

static double pow7(double x)
{
    const double x3 = x * x * x;
    return x3 * x3 * x;
}

/* c^7 / (c^7 + 25^7), the weight that turns the correction of the blues off at low chroma. */
static double chroma_weight(double c)
{
    const double c7 = pow7(c);
    return sqrt(c7 / (c7 + pow7(25)));
}

/* Numbers in brackets are the equations of Sharma, Wu, Dalal 2005. */
double weft_delta_e_2000(const double lab1[3], const double lab2[3])
{
    const double c_mean_ab = (hypot(lab1[1], lab1[2]) + hypot(lab2[1], lab2[2])) / 2; /* (2), (3) */
    const double g = 0.5 * (1 - chroma_weight(c_mean_ab));                            /* (4) */
    const double a1 = (1 + g) * lab1[1], a2 = (1 + g) * lab2[1];                      /* (5) */
    const double c1 = hypot(a1, lab1[2]), c2 = hypot(a2, lab2[2]);                    /* (6) */
    const double h1 = hue_deg(a1, lab1[2]), h2 = hue_deg(a2, lab2[2]);                /* (7) */
    const int grey = c1 * c2 == 0;

    double dh = grey ? 0 : h2 - h1; /* (10) */
    dh += dh > 180 ? -360 : dh < -180 ? 360 : 0;
    const double dl = lab2[0] - lab1[0], dc = c2 - c1;             /* (8), (9) */
    const double d_hue = 2 * sqrt(c1 * c2) * sin(radians(dh / 2)); /* (11) */

    const double l_mean = (lab1[0] + lab2[0]) / 2, c_mean = (c1 + c2) / 2; /* (12), (13) */
    double h_mean = h1 + h2;                                               /* (14) */
    if (!grey) {
        if (fabs(h1 - h2) > 180)
            h_mean += h_mean < 360 ? 360 : -360;
        h_mean /= 2;
    }
    const double t = 1 - 0.17 * cos(radians(h_mean - 30)) + 0.24 * cos(radians(2 * h_mean)) +
                     0.32 * cos(radians(3 * h_mean + 6)) - 0.20 * cos(radians(4 * h_mean - 63)); /* (15) */
    const double turn_deg = 30 * exp(-pow((h_mean - 275) / 25, 2));                              /* (16) */
    const double rc = 2 * chroma_weight(c_mean);                                                 /* (17) */
    const double l50 = (l_mean - 50) * (l_mean - 50);
    const double sl = 1 + 0.015 * l50 / sqrt(20 + l50); /* (18) */
    const double sc = 1 + 0.045 * c_mean;               /* (19) */
    const double sh = 1 + 0.015 * c_mean * t;           /* (20) */
    const double rt = -sin(radians(2 * turn_deg)) * rc; /* (21) */
    const double x = dl / sl, y = dc / sc, z = d_hue / sh;
    return sqrt(x * x + y * y + z * z + rt * y * z); /* (22) */
}
