#include "tests/host/dome.h"

#include "tests/support/support.h"

#include <math.h>

static weft_mat3 rotation_xyz(double rx, double ry, double rz)
{
    const weft_mat3 x = {{1, 0, 0, 0, cos(rx), -sin(rx), 0, sin(rx), cos(rx)}};
    const weft_mat3 y = {{cos(ry), 0, sin(ry), 0, 1, 0, -sin(ry), 0, cos(ry)}};
    const weft_mat3 z = {{cos(rz), -sin(rz), 0, sin(rz), cos(rz), 0, 0, 0, 1}};
    const weft_mat3 yx = weft_mat3_multiply(&y, &x);
    return weft_mat3_multiply(&z, &yx);
}

void dome_init(weft_calibration *cal, int width, int height)
{
    *cal = (weft_calibration){0};
    const weft_mat3 down = {{1, 0, 0, 0, -1, 0, 0, 0, -1}}, bent = rotation_xyz(0.02, -0.015, 0.01);
    cal->has_camera = cal->has_lights = true;
    cal->camera = (weft_camera){.width = width,
                                .height = height,
                                .fx = width * 600 / 154.0,
                                .fy = width * 600 / 154.0,
                                .cx = 0.5 * (width - 1) + 0.002 * width,
                                .cy = 0.5 * (height - 1) - 0.003 * width,
                                .distortion = {-0.08, 0.05, 0.0005, -0.0007, 0},
                                .has_pose = true,
                                .rotation = weft_mat3_multiply(&bent, &down),
                                .translation = {1, -2, 600}};
    uint64_t random = 20240611;
    cal->n_lights = 10;
    for (int j = 0; j < 10; j++) {
        const double degrees = 3.14159265358979 / 180;
        const double up = (j < 6 ? 35 : j < 9 ? 60 : 80) * degrees;
        const double around = (j < 6 ? 60.0 * j : j < 9 ? 120.0 * (j - 6) + 30 : 200) * degrees;
        weft_light *const l = &cal->lights[j];
        *l = (weft_light){.exponent = 1 + 0.4 * weft_test_random(&random), .white_balance = {1, 1, 1}};
        l->position = (weft_vec3){300 * cos(up) * cos(around) + 4 * weft_test_gauss(&random),
                                  300 * cos(up) * sin(around) + 4 * weft_test_gauss(&random),
                                  300 * sin(up) + 4 * weft_test_gauss(&random)};
        l->axis = weft_normalise(weft_scale(l->position, -1));
        for (int c = 0; c < 3; c++)
            l->intensity[c] = 0.5 + 0.3 * weft_test_random(&random);
    }
}

/* Pixel of a world point, written out (OpenCV's model). */
static void project(const weft_camera *c, const double w[3], double *u, double *v)
{
    const double *const r = c->rotation.m, *const d = c->distortion;
    const double t[3] = {c->translation.x, c->translation.y, c->translation.z};
    double p[3];
    for (int i = 0; i < 3; i++)
        p[i] = r[3 * i] * w[0] + r[3 * i + 1] * w[1] + r[3 * i + 2] * w[2] + t[i];
    const double x = p[0] / p[2], y = p[1] / p[2], q = x * x + y * y;
    const double radial = 1 + d[0] * q + d[1] * q * q + d[4] * q * q * q;
    *u = c->fx * (x * radial + 2 * d[2] * x * y + d[3] * (q + 2 * x * x)) + c->cx;
    *v = c->fy * (y * radial + d[2] * (q + 2 * y * y) + 2 * d[3] * x * y) + c->cy;
}

void dome_point(const weft_camera *camera, double u, double v, double height_mm, double point[3])
{
    const double mm_per_px = 600 / camera->fx;
    point[0] = point[1] = 0;
    point[2] = height_mm;
    for (int i = 0; i < 14; i++) { /* the map is nearly a scaling: this contracts by a factor of 20 */
        double pu, pv;
        project(camera, point, &pu, &pv);
        point[0] += (u - pu) * mm_per_px;
        point[1] -= (v - pv) * mm_per_px;
    }
}

double dome_radiance(const weft_light *light, int channel, const double point[3], const double normal[3],
                     double albedo)
{
    const double d[3] = {light->position.x - point[0], light->position.y - point[1],
                         light->position.z - point[2]};
    const double r = sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
    const double facing = (normal[0] * d[0] + normal[1] * d[1] + normal[2] * d[2]) / r;
    const double lobe = -(light->axis.x * d[0] + light->axis.y * d[1] + light->axis.z * d[2]) / r;
    const double metres = r / 1000;
    return albedo * light->intensity[channel] * pow(lobe, light->exponent) * fmax(facing, 0) /
           (metres * metres);
}

double dome_angle_deg(const double a[3], const double b[3])
{
    const double x = a[1] * b[2] - a[2] * b[1], y = a[2] * b[0] - a[0] * b[2], z = a[0] * b[1] - a[1] * b[0];
    return atan2(sqrt(x * x + y * y + z * z), a[0] * b[0] + a[1] * b[1] + a[2] * b[2]) * 57.29577951308232;
}
