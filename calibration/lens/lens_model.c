#include "calibration/lens/lens_model.h"

/* (1 + k1 r2 + k2 r2^2 + k3 r2^3) / (1 + k4 r2 + k5 r2^2 + k6 r2^3) and its derivative by r2. */
static double radial_at(const double d[WEFT_DISTORTION], double r2, double *slope)
{
    const double over = 1 + r2 * (d[0] + r2 * (d[1] + r2 * d[4]));
    const double under = 1 + r2 * (d[5] + r2 * (d[6] + r2 * d[7]));
    const double over_slope = d[0] + r2 * (2 * d[1] + r2 * 3 * d[4]);
    const double under_slope = d[5] + r2 * (2 * d[6] + r2 * 3 * d[7]);
    *slope = (over_slope - over / under * under_slope) / under;
    return over / under;
}

void weft_lens_distort(const double distortion[WEFT_DISTORTION], double x, double y, double *xd, double *yd)
{
    const double p1 = distortion[2], p2 = distortion[3], r2 = x * x + y * y;
    double unused;
    const double radial = radial_at(distortion, r2, &unused);
    *xd = x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x);
    *yd = y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y;
}

/* Derivatives of weft_lens_distort(): [dxd/dx, dxd/dy, dyd/dy]; the matrix is symmetric. */
static void distort_jacobian(const double distortion[WEFT_DISTORTION], double x, double y, double j[3])
{
    const double p1 = distortion[2], p2 = distortion[3];
    double slope;
    const double radial = radial_at(distortion, x * x + y * y, &slope);
    j[0] = radial + 2 * x * x * slope + 2 * p1 * y + 6 * p2 * x;
    j[1] = 2 * x * y * slope + 2 * p1 * x + 2 * p2 * y;
    j[2] = radial + 2 * y * y * slope + 6 * p1 * y + 2 * p2 * x;
}

bool weft_lens_undistort(const double distortion[WEFT_DISTORTION], double xd, double yd, double *x, double *y)
{
    double px = xd, py = yd, ex, ey, j[3];
    for (int i = 0; i < 50; i++) {
        weft_lens_distort(distortion, px, py, &ex, &ey);
        ex -= xd;
        ey -= yd;
        distort_jacobian(distortion, px, py, j);
        const double det = j[0] * j[2] - j[1] * j[1];
        /* On the branch that holds the centre both eigenvalues stay positive; past the fold it is another
         * point of the scene that lands on the same pixel. */
        if (!(det > 1e-9) || !(j[0] + j[2] > 0))
            return false;
        if (hypot(ex, ey) < 1e-13) {
            *x = px;
            *y = py;
            return true;
        }
        const double dx = (j[2] * ex - j[1] * ey) / det, dy = (j[0] * ey - j[1] * ex) / det;
        /* A long step could jump over the fold. */
        const double limit = 0.25 * (hypot(px, py) + 0.1), length = hypot(dx, dy);
        const double scale = length > limit ? limit / length : 1;
        if (scale * length < 1e-16 * (1 + hypot(px, py))) { /* as near as doubles get */
            *x = px;
            *y = py;
            return hypot(ex, ey) < 1e-12;
        }
        px -= scale * dx;
        py -= scale * dy;
    }
    return false;
}

bool weft_camera_project(const weft_camera *camera, weft_vec3 world, double *u, double *v)
{
    const weft_vec3 p = weft_add(weft_mat3_apply(&camera->rotation, world), camera->translation);
    if (!(p.z > 0))
        return false;
    double xd, yd;
    weft_lens_distort(camera->distortion, p.x / p.z, p.y / p.z, &xd, &yd);
    *u = camera->fx * xd + camera->cx;
    *v = camera->fy * yd + camera->cy;
    return true;
}

bool weft_camera_ray(const weft_camera *camera, double u, double v, weft_vec3 *origin, weft_vec3 *direction)
{
    double x, y;
    if (!weft_lens_undistort(camera->distortion, (u - camera->cx) / camera->fx, (v - camera->cy) / camera->fy,
                             &x, &y))
        return false;
    const weft_mat3 to_world = weft_mat3_transpose(&camera->rotation);
    *origin = weft_camera_centre(camera);
    *direction = weft_normalise(weft_mat3_apply(&to_world, (weft_vec3){x, y, 1}));
    return true;
}

bool weft_camera_to_plane(const weft_camera *camera, double u, double v, double height_mm, weft_vec3 *world)
{
    weft_vec3 origin, direction;
    if (!weft_camera_ray(camera, u, v, &origin, &direction))
        return false;
    const double along = (height_mm - origin.z) / direction.z;
    if (!(along > 0) || !isfinite(along))
        return false;
    *world = weft_add(origin, weft_scale(direction, along));
    world->z = height_mm;
    return true;
}

weft_vec3 weft_camera_centre(const weft_camera *camera)
{
    const weft_mat3 to_world = weft_mat3_transpose(&camera->rotation);
    return weft_scale(weft_mat3_apply(&to_world, camera->translation), -1);
}
