#include "shading/preview/preview_samples.h"

#include "core/clones.h"
#include "shading/brdf/half_vector.h"

#include <string.h>

#define SPHERE_SHARE      0.92 /* of the shorter side that the sphere's outline takes */
#define ROLL_SHARE        0.7  /* the same of a roll */
#define MAX_SUPERSAMPLING 16
#define FOLDS             2.5                      /* of the drape, over its width */
#define FOLD_DEPTH        WEFT_PREVIEW_DRAPE_DEPTH /* at the lower edge; a third of it at the top */

static int even_at_least(double samples)
{
    int n = 2;
    while (n < samples && n < MAX_SUPERSAMPLING)
        n += 2;
    return n;
}

/* Roll and drape: a repeat is as wide as the roll's half round, or as the drape is high. */
static void setup_upright(weft_preview_setup *setup, double side)
{
    const weft_preview_view *const view = setup->view;
    const weft_preview_crop crop = setup->crop;
    const double shorter = crop.width < crop.height ? crop.width : crop.height;
    const bool roll = view->shape == WEFT_PREVIEW_CYLINDER;
    setup->radius_px = (roll ? ROLL_SHARE : SPHERE_SHARE) * side / 2;
    setup->radius_texels = roll ? view->repeat * shorter / WEFT_PI : view->repeat * shorter / 2;
    setup->texels_per_px = setup->radius_texels / setup->radius_px;
    setup->eye_distance = 0;
    setup->supersampling = even_at_least(1.5 * setup->texels_per_px);
}

void weft_preview_setup_shape(weft_preview_setup *setup)
{
    const weft_preview_view *const view = setup->view;
    const weft_preview_crop crop = setup->crop;
    const double side = view->width < view->height ? view->width : view->height;
    const double half_fov = view->fov_deg * WEFT_PI / 360;
    if (view->shape == WEFT_PREVIEW_PLANE) {
        setup->texels_per_px = weft_max((double)crop.width / view->width, (double)crop.height / view->height);
        setup->eye_distance = view->fov_deg > 0 ? side / 2 / tan(half_fov) : 0;
        setup->supersampling = even_at_least(setup->texels_per_px);
        return;
    }
    if (view->shape != WEFT_PREVIEW_SPHERE) {
        setup_upright(setup, side);
        return;
    }
    const double shorter = crop.width < crop.height ? crop.width : crop.height;
    setup->radius_px = SPHERE_SHARE * side / 2;
    setup->radius_texels = view->repeat * shorter / WEFT_PI;
    setup->texels_per_px = setup->radius_texels / setup->radius_px;
    /* the cone that touches the sphere has sin(angle) = 1/distance, and its outline SPHERE_SHARE of the field
     */
    setup->eye_distance = view->fov_deg > 0 ? 1 / sin(atan(SPHERE_SHARE * tan(half_fov))) : 0;
    setup->supersampling = even_at_least(1.5 * setup->texels_per_px); /* texels crowd towards the outline */
}

static void set_axes(weft_preview_samples *s, int i, double x, double y, double z)
{
    /* The rotation that takes +Z to (x, y, z) the shortest way: the frame a flat cloth would keep when it is
     * laid on the sphere from the pole. */
    const double k = 1 / weft_max(1 + z, 1e-6); /* the far pole of a turned ball */
    const double axes[3][3] = {{1 - x * x * k, -x * y * k, -x}, {-x * y * k, 1 - y * y * k, -y}, {x, y, z}};
    for (int a = 0; a < 3; a++)
        for (int c = 0; c < 3; c++)
            s->axis[a][c][i] = (float)axes[a][c];
}

static void set_eye(weft_preview_samples *s, int i, double x, double y, double z)
{
    const double inverse = 1 / sqrt(x * x + y * y + z * z);
    s->eye[0][i] = (float)(x * inverse);
    s->eye[1][i] = (float)(y * inverse);
    s->eye[2][i] = (float)(z * inverse);
}

/* A camera that looks straight down on a plane sees it as an orthographic one does; only the directions to
 * the eye differ. */
WEFT_CLONES
static void hit_plane(const weft_preview_setup *setup, weft_preview_samples *s)
{
    const double scale = setup->texels_per_px, mm_per_px = setup->surface->mm_per_px;
    const double half_width = setup->crop.width / 2.0, half_height = setup->crop.height / 2.0;
    const double left = half_width - 0.5, top = half_height - 0.5; /* of the middle, map pixels */
    const double x_mm = setup->surface->origin_mm[0] + (setup->crop.x + left) * mm_per_px;
    const double y_mm = setup->surface->origin_mm[1] - (setup->crop.y + top) * mm_per_px;
    const float near = setup->eye_distance > 0 ? 1 : 0, eye = near > 0 ? (float)setup->eye_distance : 1;
    for (int a = 0; a < 3; a++)
        for (int c = 0; c < 3; c++)
            for (int i = 0; i < s->n; i++)
                s->axis[a][c][i] = a == c;
    WEFT_INDEPENDENT
    for (int i = 0; i < s->n; i++) {
        const double x = (double)s->x[i] * scale, y = (double)s->y[i] * scale;
        s->u[i] = left + x;
        s->v[i] = top - y;
        s->hit[i] = (fabs(x) <= half_width ? 1.0F : 0) * (fabs(y) <= half_height ? 1.0F : 0);
        s->position_mm[0][i] = (float)(x_mm + x * mm_per_px);
        s->position_mm[1][i] = (float)(y_mm + y * mm_per_px);
        s->position_mm[2][i] = 0;
    }
    WEFT_INDEPENDENT
    for (int i = 0; i < s->n; i++) {
        const float x = -near * s->x[i], y = -near * s->y[i], inverse = 1 / sqrtf(x * x + y * y + eye * eye);
        s->eye[0][i] = x * inverse;
        s->eye[1][i] = y * inverse;
        s->eye[2][i] = eye * inverse;
    }
}

/* From the viewer's frame to that of a shape that is turned about its upright axis. */
static void turn_back(const weft_preview_setup *setup, double v[3])
{
    const double x = v[0], z = v[2];
    v[0] = setup->turn_cos * x - setup->turn_sin * z;
    v[2] = setup->turn_sin * x + setup->turn_cos * z;
}

static void set_turned_eye(const weft_preview_setup *setup, weft_preview_samples *s, int i, double x,
                           double y, double z)
{
    double eye[3] = {x, y, z};
    turn_back(setup, eye);
    set_eye(s, i, eye[0], eye[1], eye[2]);
}

/* Where the ray of a pixel meets the unit sphere; false beside it. */
static bool meet_sphere(const weft_preview_setup *setup, double px, double py, double n[3])
{
    const double d = setup->eye_distance;
    const double x = px / setup->radius_px, y = py / setup->radius_px;
    if (d <= 0) {
        const double rest = 1 - x * x - y * y;
        n[0] = x;
        n[1] = y;
        n[2] = rest > 0 ? sqrt(rest) : 0;
        return rest > 0;
    }
    /* eye at (0, 0, d), ray (x t, y t, -1) with t the tangent of the outline's half angle */
    const double t = 1 / sqrt(d * d - 1), rx = x * t, ry = y * t;
    const double a = rx * rx + ry * ry + 1, root = d * d - a * (d * d - 1);
    if (root <= 0)
        return false;
    const double along = (d - sqrt(root)) / a;
    n[0] = rx * along;
    n[1] = ry * along;
    n[2] = d - along;
    return true;
}

static void hit_sphere(const weft_preview_setup *setup, weft_preview_samples *s)
{
    const double radius = setup->radius_texels, eye = setup->eye_distance;
    for (int i = 0; i < s->n; i++) {
        double n[3] = {0, 0, 1};
        s->hit[i] = meet_sphere(setup, (double)s->x[i], (double)s->y[i], n) ? 1 : 0;
        if (eye > 0)
            set_turned_eye(setup, s, i, -n[0], -n[1], eye - n[2]);
        else
            set_turned_eye(setup, s, i, 0, 0, 1);
        turn_back(setup, n);
        const double sine = sqrt(n[0] * n[0] + n[1] * n[1]);
        const double arc = sine > 1e-9 ? radius * atan2(sine, n[2]) / sine : radius;
        s->u[i] = setup->crop.width / 2.0 - 0.5 + n[0] * arc;
        s->v[i] = setup->crop.height / 2.0 - 0.5 - n[1] * arc;
        for (int c = 0; c < 3; c++)
            s->position_mm[c][i] = (float)(n[c] * radius * setup->surface->mm_per_px);
        set_axes(s, i, n[0], n[1], n[2]);
    }
}

static void hit_roll(const weft_preview_setup *setup, weft_preview_samples *s)
{
    const double radius = setup->radius_texels;
    for (int i = 0; i < s->n; i++) {
        const double x = (double)s->x[i] / setup->radius_px, y = (double)s->y[i] / setup->radius_px;
        const bool on = fabs(x) < 1 && fabs(y) <= SPHERE_SHARE / ROLL_SHARE;
        double n[3] = {on ? x : 0, 0, sqrt(1 - (on ? x * x : 0))};
        turn_back(setup, n);
        const double nx = n[0], nz = n[2];
        s->hit[i] = on;
        s->u[i] = setup->crop.width / 2.0 - 0.5 + radius * atan2(nx, nz);
        s->v[i] = setup->crop.height / 2.0 - 0.5 - radius * y;
        const double axes[3][3] = {{nz, 0, -nx}, {0, 1, 0}, {nx, 0, nz}}, at[3] = {nx, y, nz};
        for (int a = 0; a < 3; a++) {
            s->position_mm[a][i] = (float)(at[a] * radius * setup->surface->mm_per_px);
            for (int c = 0; c < 3; c++)
                s->axis[a][c][i] = (float)axes[a][c];
        }
        set_turned_eye(setup, s, i, 0, 0, 1);
    }
}

double weft_preview_drape_height(double x, double y, double slope[2])
{
    const double k = WEFT_PI * FOLDS, deep = FOLD_DEPTH * (2 - y) / 3; /* y 1 above: 1/3, y -1: 1 */
    const double bend = 0.35 * (y + 1);                                /* folds lean a little */
    const double phase = k * x + bend;
    slope[0] = -deep * k * sin(phase);
    slope[1] = -FOLD_DEPTH / 3 * cos(phase) - 0.35 * deep * sin(phase);
    return deep * cos(phase);
}

/* Length of the cloth from the middle to x, by Simpson's rule over short steps. */
static double drape_length(double x, double y)
{
    enum { STEPS = 16 };
    double sum = 0, slope[2];
    for (int i = 0; i <= STEPS; i++) {
        weft_preview_drape_height(x * i / STEPS, y, slope);
        sum += (i == 0 || i == STEPS ? 1 : i % 2 ? 4 : 2) * sqrt(1 + slope[0] * slope[0]);
    }
    return x * sum / (3 * STEPS);
}

static void set_drape_axes(weft_preview_samples *s, int i, const double slope[2])
{
    const double along = 1 / sqrt(1 + slope[0] * slope[0]);
    const double t[3] = {along, 0, slope[0] * along};
    const double up = 1 / sqrt(1 + slope[0] * slope[0] + slope[1] * slope[1]);
    const double n[3] = {-slope[0] * up, -slope[1] * up, up};
    const double b[3] = {n[1] * t[2] - n[2] * t[1], n[2] * t[0] - n[0] * t[2], n[0] * t[1] - n[1] * t[0]};
    for (int c = 0; c < 3; c++) {
        s->axis[0][c][i] = (float)t[c];
        s->axis[1][c][i] = (float)b[c];
        s->axis[2][c][i] = (float)n[c];
    }
}

/* A ray over the folds at one height y: where it is at t, and how far over them (0 beside the cloth). */
static double over_drape(const double from[3], const double along[3], double t, double y)
{
    const double x = from[0] + t * along[0], deep = FOLD_DEPTH * (2 - y) / 3;
    return fabs(x) <= 1 ? from[2] + t * along[2] - deep * cos(WEFT_PI * FOLDS * x + 0.35 * (y + 1)) : 0;
}

/* Where the ray of a pixel meets the turned drape: the first change of side inside of the folds' slab, in
 * steps of a thirtieth of the half width, then bisection. */
static bool meet_drape(const weft_preview_setup *setup, double px, double y, double *x)
{
    enum { HALVINGS = 16 };
    double from[3] = {px, y, 1.5}, along[3] = {0, 0, -1}, low = 0, high = 3;
    turn_back(setup, from);
    turn_back(setup, along);
    const double slab[2] = {1, FOLD_DEPTH + 1e-3};
    for (int k = 0; k < 2; k++) { /* |x| below 1, |z| below the depth */
        const int c = 2 * k;
        if (fabs(along[c]) < 1e-9)
            continue;
        const double a = (-slab[k] - from[c]) / along[c], b = (slab[k] - from[c]) / along[c];
        low = fmax(low, fmin(a, b));
        high = fmin(high, fmax(a, b));
    }
    if (low >= high || fabs(y) > 1)
        return false;
    const int steps = 2 + (int)(30 * (high - low));
    const double first = low, step = (high - low) / steps;
    double before = 0;
    bool met = false;
    for (int k = 0; k <= steps && !met; k++) {
        const double t = first + step * k, over = over_drape(from, along, t, y);
        met = over * before < 0;
        low = met ? low : t;
        high = met ? t : high;
        before = met ? before : over;
    }
    for (int k = 0; k < HALVINGS && met; k++) {
        const double t = 0.5 * (low + high);
        const bool same = over_drape(from, along, t, y) * before > 0;
        low = same ? t : low;
        high = same ? high : t;
    }
    *x = from[0] + 0.5 * (low + high) * along[0];
    return met;
}

/* The far side of the drape: its own normal points away. */
static void face_the_eye(weft_preview_samples *s, int i)
{
    double towards = 0;
    for (int c = 0; c < 3; c++)
        towards += (double)s->eye[c][i] * (double)s->axis[2][c][i];
    for (int c = 0; c < 3 && towards < 0; c++) {
        s->axis[0][c][i] = -s->axis[0][c][i];
        s->axis[2][c][i] = -s->axis[2][c][i];
    }
}

static void hit_drape(const weft_preview_setup *setup, weft_preview_samples *s)
{
    const double half = setup->radius_texels, scale = half * setup->surface->mm_per_px;
    const bool turned = setup->turn_sin != 0 || setup->turn_cos != 1;
    for (int i = 0; i < s->n; i++) {
        double slope[2], x = (double)s->x[i] / setup->radius_px;
        const double y = (double)s->y[i] / setup->radius_px;
        const bool met = turned ? meet_drape(setup, x, y, &x) : fabs(x) <= 1 && fabs(y) <= 1;
        const double z = weft_preview_drape_height(x, y, slope);
        s->hit[i] = met;
        s->drape[0][i] = x;
        s->drape[1][i] = y;
        s->u[i] = setup->crop.width / 2.0 - 0.5 + half * drape_length(x, y);
        s->v[i] = setup->crop.height / 2.0 - 0.5 - half * y;
        s->position_mm[0][i] = (float)(x * scale);
        s->position_mm[1][i] = (float)(y * scale);
        s->position_mm[2][i] = (float)(z * scale);
        set_drape_axes(s, i, slope);
        set_turned_eye(setup, s, i, 0, 0, 1);
        if (turned)
            face_the_eye(s, i);
    }
}

/* Marches towards the light until the ray is above all folds, or below them when the light is behind. */
double weft_preview_drape_light(const double place[2], const double lamp[3])
{
    enum { STEPS = 48 };
    const double x = place[0], y = place[1];
    double slope[2];
    const double z = weft_preview_drape_height(x, y, slope),
                 across = sqrt(lamp[0] * lamp[0] + lamp[1] * lamp[1]);
    const double side = lamp[2] - slope[0] * lamp[0] - slope[1] * lamp[1] < 0 ? -1 : 1, rise = side * lamp[2];
    const double reach = rise > 0 ? (FOLD_DEPTH - side * z) / rise : 2 / weft_max(across, 1e-6);
    for (int k = 1; k <= STEPS; k++) {
        const double t = 0.01 + reach * k / STEPS, px = x + t * lamp[0], py = y + t * lamp[1];
        if (fabs(px) > 1 || fabs(py) > 1)
            break;
        const double deep = FOLD_DEPTH * (2 - py) / 3,
                     fold = deep * cos(WEFT_PI * FOLDS * px + 0.35 * (py + 1));
        if (side * (z + t * lamp[2] - fold) < -1e-3)
            return 0;
    }
    return 1;
}

void weft_preview_place(const weft_preview_setup *setup, const weft_preview_samples *s, int i,
                        double place[3])
{
    const double radius = setup->radius_texels, x = s->drape[0][i], y = s->drape[1][i];
    double slope[2];
    switch (setup->view->shape) {
    case WEFT_PREVIEW_PLANE:
        place[0] = s->u[i] + 0.5 - setup->crop.width / 2.0;
        place[1] = setup->crop.height / 2.0 - 0.5 - s->v[i];
        place[2] = 0;
        break;
    case WEFT_PREVIEW_SPHERE:
    case WEFT_PREVIEW_CYLINDER:
        for (int c = 0; c < 3; c++)
            place[c] = radius * (double)s->axis[2][c][i];
        if (setup->view->shape == WEFT_PREVIEW_CYLINDER)
            place[1] = setup->crop.height / 2.0 - 0.5 - s->v[i];
        break;
    case WEFT_PREVIEW_DRAPE:
        place[0] = radius * x;
        place[1] = radius * y;
        place[2] = radius * weft_preview_drape_height(x, y, slope);
        break;
    }
}

/* The plane turns about the viewer's axis: the samples are turned back, and afterwards put where they were.
 */
static void hit_turned_plane(const weft_preview_setup *setup, weft_preview_samples *s)
{
    float x[WEFT_PREVIEW_RUN], y[WEFT_PREVIEW_RUN];
    const float c = (float)setup->turn_cos, sine = (float)setup->turn_sin;
    memcpy(x, s->x, sizeof x);
    memcpy(y, s->y, sizeof y);
    for (int i = 0; i < s->n; i++) {
        s->x[i] = c * x[i] + sine * y[i];
        s->y[i] = c * y[i] - sine * x[i];
    }
    hit_plane(setup, s);
    memcpy(s->x, x, sizeof x);
    memcpy(s->y, y, sizeof y);
}

void weft_preview_hit(const weft_preview_setup *setup, weft_preview_samples *s)
{
    switch (setup->view->shape) {
    case WEFT_PREVIEW_PLANE:
        if (setup->turn_sin != 0 || setup->turn_cos != 1)
            hit_turned_plane(setup, s);
        else
            hit_plane(setup, s);
        break;
    case WEFT_PREVIEW_SPHERE:
        hit_sphere(setup, s);
        break;
    case WEFT_PREVIEW_CYLINDER:
        hit_roll(setup, s);
        break;
    case WEFT_PREVIEW_DRAPE:
        hit_drape(setup, s);
        break;
    }
}
