#include "calibration/lights/ball_lights.h"

#include "calibration/lens/lens_model.h"
#include "core/mem.h"

#include <math.h>
#include <string.h>

#define BINS_ACROSS   616
#define DARK_SHARE    0.4  /* of the table's level: below it is ball */
#define AREA_LEAST    5e-4 /* of the frame */
#define OUTLINE       48   /* points */
#define AREA_OFF_MOST 0.15 /* of a ball's outline against its radius */
#define GLINT_LEAST   3    /* times the ball's own level: below it nothing is mirrored */
#define GLINT_CORE    0.5  /* of the peak: what counts for its middle */
#define MISS_MOST_MM  30

typedef struct blob {
    double u, v; /* middle, px of the frame */
    double area; /* px^2 of the frame */
    int left, top, right, bottom, n;
} blob;

weft_err weft_ball_pictures_init(weft_ball_pictures *pictures, int width, int height, int n_lights,
                                 weft_error *err)
{
    weft_ball_pictures p = {.width = width, .height = height, .n_lights = n_lights};
    p.bin_px = width > 2 * BINS_ACROSS ? (width + BINS_ACROSS) / (2 * BINS_ACROSS) * 2 : 2;
    p.columns = width / p.bin_px;
    p.rows = height / p.bin_px;
    if (p.columns < 64 || p.rows < 64)
        return weft_fail(err, WEFT_ERR_RANGE, "frames of %dx%d are too small to see balls in", width, height);
    p.value = weft_alloc((size_t)n_lights * (size_t)p.columns * (size_t)p.rows, sizeof *p.value, err);
    if (!p.value)
        return WEFT_ERR_NOMEM;
    *pictures = p;
    return WEFT_OK;
}

void weft_ball_pictures_fini(weft_ball_pictures *pictures)
{
    weft_free(pictures->value);
    *pictures = (weft_ball_pictures){0};
}

static float *picture_of(const weft_ball_pictures *p, int light)
{
    return p->value + (size_t)light * (size_t)p->columns * (size_t)p->rows;
}

weft_err weft_ball_pictures_add(weft_ball_pictures *p, int light, const weft_image *image, weft_error *err)
{
    if (image->width != p->width || image->height != p->height)
        return weft_fail(err, WEFT_ERR_MISMATCH, "light %d: its frame is %dx%d, the others are %dx%d", light,
                         image->width, image->height, p->width, p->height);
    float *const to = picture_of(p, light);
    const float share = 1.0F / (float)(p->bin_px * p->bin_px * image->planes);
    for (int j = 0; j < p->rows; j++)
        for (int i = 0; i < p->columns; i++) {
            float sum = 0;
            for (int c = 0; c < image->planes; c++)
                for (int v = j * p->bin_px; v < (j + 1) * p->bin_px; v++)
                    for (int u = i * p->bin_px; u < (i + 1) * p->bin_px; u++)
                        sum += weft_image_row(image, c, v)[u];
            to[j * p->columns + i] = isfinite(sum) ? sum * share : 0;
        }
    return WEFT_OK;
}

/* ---- the balls ---- */

/* Third brightest light of a pixel: a glint is in one or two, a shadow not in all but two. */
static float third_brightest(const weft_ball_pictures *p, int pixel)
{
    float best[3] = {0, 0, 0};
    for (int l = 0; l < p->n_lights; l++) {
        float x = picture_of(p, l)[pixel];
        for (int k = 0; k < 3; k++)
            if (x > best[k]) {
                const float pushed = best[k];
                best[k] = x;
                x = pushed;
            }
    }
    return best[2];
}

/* Level of the table: the mean of the brighter half, by two passes. */
static double table_level(const float *level, int n)
{
    double mean = 0, sum = 0;
    long above = 0;
    for (int i = 0; i < n; i++)
        mean += (double)level[i] / n;
    for (int i = 0; i < n; i++)
        if ((double)level[i] > mean) {
            sum += (double)level[i];
            above++;
        }
    return above ? sum / (double)above : 0;
}

/* Takes the dark pixels that hang together with `seed` out of `dark`. */
static blob take_blob(const weft_ball_pictures *p, uint8_t *dark, int *stack, int seed)
{
    blob b = {.left = p->columns, .top = p->rows};
    int n_stack = 0;
    double su = 0, sv = 0;
    stack[n_stack++] = seed;
    dark[seed] = 0;
    while (n_stack) {
        const int at = stack[--n_stack], i = at % p->columns, j = at / p->columns;
        su += i;
        sv += j;
        b.n++;
        b.left = i < b.left ? i : b.left;
        b.right = i > b.right ? i : b.right;
        b.top = j < b.top ? j : b.top;
        b.bottom = j > b.bottom ? j : b.bottom;
        const int next[4] = {i > 0 ? at - 1 : at, i + 1 < p->columns ? at + 1 : at,
                             j > 0 ? at - p->columns : at, j + 1 < p->rows ? at + p->columns : at};
        for (int k = 0; k < 4; k++)
            if (dark[next[k]]) {
                dark[next[k]] = 0;
                stack[n_stack++] = next[k];
            }
    }
    b.u = (su / b.n + 0.5) * p->bin_px - 0.5;
    b.v = (sv / b.n + 0.5) * p->bin_px - 0.5;
    b.area = (double)b.n * p->bin_px * p->bin_px;
    return b;
}

static bool looks_like_ball(const weft_ball_pictures *p, const blob *b)
{
    const double w = b->right - b->left + 1, h = b->bottom - b->top + 1;
    return b->n > AREA_LEAST * p->columns * p->rows && b->left > 0 && b->top > 0 &&
           b->right < p->columns - 1 && b->bottom < p->rows - 1 && fabs(w / h - 1) < 0.15 &&
           fabs(b->n / (0.785398 * w * h) - 1) < 0.1;
}

static weft_err find_blobs(const weft_ball_pictures *p, blob *blobs, int *n_blobs, weft_error *err)
{
    const int n = p->columns * p->rows;
    float *const level = weft_alloc((size_t)n, sizeof *level, err);
    uint8_t *const dark = weft_alloc((size_t)n, 1, err);
    int *const stack = weft_alloc((size_t)n, sizeof *stack, err);
    weft_err status = level && dark && stack ? WEFT_OK : WEFT_ERR_NOMEM;
    *n_blobs = 0;
    if (status == WEFT_OK) {
        for (int i = 0; i < n; i++)
            level[i] = third_brightest(p, i);
        const double limit = DARK_SHARE * table_level(level, n);
        for (int i = 0; i < n; i++)
            dark[i] = (double)level[i] < limit;
        for (int i = 0; i < n && *n_blobs < WEFT_BALLS_MAX; i++) {
            if (!dark[i])
                continue;
            const blob b = take_blob(p, dark, stack, i);
            if (looks_like_ball(p, &b))
                blobs[(*n_blobs)++] = b;
        }
    }
    weft_free(level);
    weft_free(dark);
    weft_free(stack);
    return status;
}

/* Middle and area of a ball's outline in the picture (shoelace over its points). */
static bool outline_of(const weft_camera *camera, weft_vec3 middle, double radius, double *u, double *v,
                       double *area)
{
    const weft_vec3 to_eye = weft_sub(weft_camera_centre(camera), middle), axis = weft_normalise(to_eye);
    const double distance = weft_length(to_eye), sine = radius / distance;
    const weft_vec3 centre = weft_add(middle, weft_scale(axis, radius * sine));
    const double circle = radius * sqrt(1 - sine * sine);
    const weft_vec3 a = weft_normalise(weft_cross(axis, (weft_vec3){0, 1, 0})), b = weft_cross(axis, a);
    double pu[OUTLINE + 1], pv[OUTLINE + 1], twice = 0, mu = 0, mv = 0;
    for (int k = 0; k <= OUTLINE; k++) {
        const double t = 6.283185307179586 * k / OUTLINE;
        const weft_vec3 p =
            weft_add(centre, weft_add(weft_scale(a, circle * cos(t)), weft_scale(b, circle * sin(t))));
        if (!weft_camera_project(camera, p, &pu[k], &pv[k]))
            return false;
    }
    for (int k = 0; k < OUTLINE; k++) {
        const double cross = pu[k] * pv[k + 1] - pu[k + 1] * pv[k];
        twice += cross;
        mu += cross * (pu[k] + pu[k + 1]);
        mv += cross * (pv[k] + pv[k + 1]);
    }
    *u = mu / (3 * twice);
    *v = mv / (3 * twice);
    *area = fabs(twice) / 2;
    return true;
}

/* The middle of a ball that lies on the table and is seen as the blob. */
static weft_err place_ball(const weft_camera *camera, const blob *b, double radius, weft_vec3 *middle,
                           weft_error *err)
{
    double u = b->u, v = b->v, ou = 0, ov = 0, area = 0;
    for (int i = 0; i < 6; i++) {
        if (!weft_camera_to_plane(camera, u, v, radius, middle) ||
            !outline_of(camera, *middle, radius, &ou, &ov, &area))
            return weft_fail(err, WEFT_ERR_NODATA,
                             "by the calibration, pixel (%.0f, %.0f) does not see the table", u, v);
        u += b->u - ou;
        v += b->v - ov;
    }
    if (fabs(b->area / area - 1) > AREA_OFF_MOST)
        return weft_fail(
            err, WEFT_ERR_RANGE,
            "the ball near pixel (%.0f, %.0f) seems to have a radius of %.1f mm, not %.1f; measure it again",
            b->u, b->v, radius * sqrt(b->area / area), radius);
    return WEFT_OK;
}

/* ---- the lights ---- */

/* Middle of the glint of a light in a ball, px of the frame; false when there is none. */
static bool find_glint(const weft_ball_pictures *p, int light, const blob *b, double *u, double *v)
{
    const float *const value = picture_of(p, light);
    const double mu = (b->u + 0.5) / p->bin_px - 0.5, mv = (b->v + 0.5) / p->bin_px - 0.5;
    const double inside = 0.5 * 0.9 * fmin(b->right - b->left, b->bottom - b->top);
    double peak = 0, sum = 0, weight = 0, su = 0, sv = 0;
    int n = 0, peak_i = 0, peak_j = 0;
    for (int j = b->top; j <= b->bottom; j++)
        for (int i = b->left; i <= b->right; i++) {
            const double x = (double)value[j * p->columns + i];
            if (hypot(i - mu, j - mv) > inside)
                continue;
            sum += x;
            n++;
            if (x > peak) {
                peak = x;
                peak_i = i;
                peak_j = j;
            }
        }
    const double level = n ? sum / n : 0;
    if (!(peak > GLINT_LEAST * level))
        return false;
    const int reach = (int)(inside / 2) + 1;
    for (int j = peak_j - reach; j <= peak_j + reach; j++)
        for (int i = peak_i - reach; i <= peak_i + reach; i++) {
            if (j < b->top || j > b->bottom || i < b->left || i > b->right)
                continue;
            const double w = (double)value[j * p->columns + i] - GLINT_CORE * peak;
            if (w > 0) {
                weight += w;
                su += w * i;
                sv += w * j;
            }
        }
    *u = (su / weight + 0.5) * p->bin_px - 0.5;
    *v = (sv / weight + 0.5) * p->bin_px - 0.5;
    return true;
}

/* The ray from a pixel mirrored in a ball. */
static bool mirror(const weft_camera *camera, double u, double v, weft_vec3 middle, double radius,
                   weft_vec3 *from, weft_vec3 *towards)
{
    weft_vec3 eye, ray;
    if (!weft_camera_ray(camera, u, v, &eye, &ray))
        return false;
    const weft_vec3 to = weft_sub(middle, eye);
    const double along = weft_dot(to, ray), under = radius * radius - (weft_dot(to, to) - along * along);
    if (!(under > 0))
        return false;
    *from = weft_add(eye, weft_scale(ray, along - sqrt(under)));
    const weft_vec3 n = weft_scale(weft_sub(*from, middle), 1 / radius);
    *towards = weft_sub(ray, weft_scale(n, 2 * weft_dot(n, ray)));
    return true;
}

/* Where rays meet: the point with the least squares of distances from them. */
static bool meet(int n, const weft_vec3 *from, const weft_vec3 *towards, weft_vec3 *at, double *miss)
{
    weft_mat3 h = {{0}}, inverse;
    weft_vec3 g = {0, 0, 0};
    for (int i = 0; i < n; i++) {
        const double *const d = &towards[i].x;
        weft_mat3 across; /* 1 - d d^T: what is perpendicular to the ray */
        for (size_t r = 0; r < 3; r++)
            for (size_t c = 0; c < 3; c++) {
                across.m[3 * r + c] = (r == c) - d[r] * d[c];
                h.m[3 * r + c] += across.m[3 * r + c];
            }
        g = weft_add(g, weft_mat3_apply(&across, from[i]));
    }
    if (!weft_mat3_invert(&h, &inverse))
        return false;
    *at = weft_mat3_apply(&inverse, g);
    double sum = 0;
    for (int i = 0; i < n; i++) {
        const weft_vec3 off = weft_cross(weft_sub(*at, from[i]), towards[i]);
        sum += weft_dot(off, off) / n;
    }
    *miss = sqrt(sum);
    return true;
}

static weft_err find_light(const weft_camera *camera, const weft_ball_pictures *p, const blob *blobs,
                           double radius, int light, weft_ball_lights *to, weft_error *err)
{
    weft_vec3 from[WEFT_BALLS_MAX], towards[WEFT_BALLS_MAX];
    int n = 0;
    for (int b = 0; b < to->n_balls; b++) {
        double u, v;
        n += find_glint(p, light, &blobs[b], &u, &v) &&
             mirror(camera, u, v, to->ball[b], radius, &from[n], &towards[n]);
    }
    if (n < 2 || !meet(n, from, towards, &to->position[light], &to->miss_mm[light]))
        return weft_fail(
            err, WEFT_ERR_NODATA,
            "light %d mirrors itself in %d of %d balls, wanted two or more; does the lamp work, are the "
            "balls glossy?",
            light, n, to->n_balls);
    if (!(to->miss_mm[light] < MISS_MOST_MM) || !(to->position[light].z > radius))
        return weft_fail(
            err, WEFT_ERR_NODATA,
            "light %d: its mirrored rays miss each other by %.0f mm; is it one lamp, and are the balls of "
            "%g mm radius, on the table?",
            light, to->miss_mm[light], radius);
    to->miss_mean_mm += to->miss_mm[light] / p->n_lights;
    return WEFT_OK;
}

weft_err weft_ball_lights_find(const weft_camera *camera, const weft_ball_pictures *pictures,
                               double radius_mm, weft_ball_lights *lights, weft_error *err)
{
    blob blobs[WEFT_BALLS_MAX];
    weft_ball_lights to = {0};
    if (!camera->has_pose)
        return weft_fail(err, WEFT_ERR_MISSING,
                         "the camera has no pose; make it with \"weft calibrate lens --board-on-table\"");
    WEFT_TRY(find_blobs(pictures, blobs, &to.n_balls, err));
    if (to.n_balls < 2)
        return weft_fail(
            err, WEFT_ERR_NODATA,
            "%d dark balls are wholly in the picture, wanted two or more (four are better) on a lighter "
            "table, apart from each other",
            to.n_balls);
    for (int b = 0; b < to.n_balls; b++)
        WEFT_TRY(place_ball(camera, &blobs[b], radius_mm, &to.ball[b], err));
    for (int light = 0; light < pictures->n_lights; light++)
        WEFT_TRY(find_light(camera, pictures, blobs, radius_mm, light, &to, err));
    *lights = to;
    return WEFT_OK;
}
