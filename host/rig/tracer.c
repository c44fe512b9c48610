#include "host/rig/tracer.h"

#include "calibration/lens/lens_model.h"
#include "core/parallel.h"

#include <math.h>

#define RAD_PER_DEG 0.017453292519943295

weft_rig_projection weft_rig_project_to_plate(const weft_rig_plate *plate, weft_vec3 centre)
{
    /* The ray C + s (g - C) meets the plate at s = n.(o - C) / n.(g - C); its plate coordinate along axis a
       is a.(C - o) + s a.(g - C).  With g = (gx, gy, 0) numerator and denominator are affine in gx, gy. */
    const weft_vec3 n = plate->normal, to_plate = weft_sub(plate->centre, centre);
    const double distance = weft_dot(n, to_plate), through = weft_dot(n, centre);
    const weft_vec3 axes[2] = {plate->ax, plate->ay};
    weft_rig_projection p;
    for (size_t i = 0; i < 2; i++) {
        const weft_vec3 a = axes[i];
        const double offset = -weft_dot(a, to_plate);
        p.h[3 * i] = offset * n.x + distance * a.x;
        p.h[3 * i + 1] = offset * n.y + distance * a.y;
        p.h[3 * i + 2] = -offset * through - distance * weft_dot(a, centre);
    }
    p.h[6] = n.x;
    p.h[7] = n.y;
    p.h[8] = -through;
    return p;
}

weft_rig_tracer weft_rig_tracer_make(const weft_rig_sample *sample, weft_vec3 centre)
{
    weft_rig_tracer tracer = {.sample = sample,
                              .centre = {(float)centre.x, (float)centre.y, (float)centre.z}};
    if (sample->has_plate)
        tracer.to_plate = weft_rig_project_to_plate(&sample->plate, centre);
    return tracer;
}

static void hit_table(weft_rig_hit *hit, float gx, float gy)
{
    *hit = (weft_rig_hit){.x = gx, .y = gy, .nz = 1, .tx = 1, .strength = 1, .openness = 1};
}

static void trace_plate(const weft_rig_tracer *tracer, float gx, float gy, weft_rig_hit *hit)
{
    const weft_rig_plate *const plate = &tracer->sample->plate;
    double x, y;
    weft_rig_plate_coordinates(&tracer->to_plate, (double)gx, (double)gy, &x, &y);
    const int material = weft_rig_plate_material(plate, x, y);
    hit_table(hit, gx, gy);
    if (material == 0)
        return;
    const weft_vec3 point = weft_rig_plate_point(plate, x, y);
    hit->x = (float)point.x;
    hit->y = (float)point.y;
    hit->z = (float)point.z;
    hit->nx = (float)plate->normal.x;
    hit->ny = (float)plate->normal.y;
    hit->nz = (float)plate->normal.z;
    hit->material = material;
}

/* What is seen in place of the cloth: a fibre on it, the ground where it is torn. */
static void hit_damage(const weft_rig_damage *damage, float gx, float gy, float dx, float dy, float bent,
                       weft_rig_hit *hit)
{
    float normal[3];
    const float top = damage->crown_mm + bent;
    hit->flaw = weft_rig_damage_on_crease(damage, hit->x, hit->y) ? WEFT_FLAW_CREASE : 0;
    const weft_rig_fibre *const fibre = weft_rig_damage_fibre(damage, gx + top * dx, gy + top * dy, normal);
    if (fibre) {
        hit->flaw |= WEFT_FLAW_LINT;
        hit->z = top + fibre->radius * normal[2];
        hit->material = damage->lint;
    } else if (weft_rig_damage_torn(damage, gx, gy)) {
        hit->flaw |= WEFT_FLAW_TEAR;
        hit->z = damage->floor_mm;
        hit->material = damage->ground;
        normal[0] = normal[1] = 0;
        normal[2] = 1;
    } else {
        return;
    }
    hit->x = gx + hit->z * dx;
    hit->y = gy + hit->z * dy;
    hit->nx = normal[0];
    hit->ny = normal[1];
    hit->nz = normal[2];
    hit->strength = 1;
    hit->openness = hit->flaw & WEFT_FLAW_LINT ? 1 : 0.3F;
}

static void trace_cloth(const weft_rig_tracer *tracer, const weft_fabric_patch *patch, float gx, float gy,
                        weft_rig_hit *hit)
{
    const float *const c = tracer->centre;
    const float dx = (c[0] - gx) / c[2], dy = (c[1] - gy) / c[2];
    weft_fabric_point *const point = &hit->cloth;
    const weft_rig_damage *const damage = &tracer->sample->damage;
    float bent = 0;
    hit->flaw = 0;
    hit->lean[0] = hit->lean[1] = 0;
    if (damage->present)
        weft_rig_damage_bend(damage, gx, gy, &bent, hit->lean);
    weft_fabric_meet(&tracer->sample->cloth, patch, gx + bent * dx, gy + bent * dy, dx, dy, point);
    point->slope_x += hit->lean[0];
    point->slope_y += hit->lean[1];
    const float z = point->height + bent;
    const float scale = 1 / sqrtf(1 + point->slope_x * point->slope_x + point->slope_y * point->slope_y);
    hit->x = gx + z * dx;
    hit->y = gy + z * dy;
    hit->z = z;
    hit->nx = -point->slope_x * scale;
    hit->ny = -point->slope_y * scale;
    hit->nz = scale;
    /* The fibre lies in the surface: its level direction, lifted by the slope along it. */
    const float rise = point->slope_x * point->fibre_x + point->slope_y * point->fibre_y;
    const float level = 1 / sqrtf(1 + rise * rise);
    hit->tx = point->fibre_x * level;
    hit->ty = point->fibre_y * level;
    hit->tz = rise * level;
    hit->strength = point->strength;
    hit->openness = point->openness;
    hit->material = point->dye;
    if (damage->present)
        hit_damage(damage, gx, gy, dx, dy, bent, hit);
}

/* A sheet that is bent or tilted: the ray is followed up to the height it meets. */
static void trace_sheet(const weft_rig_tracer *tracer, float gx, float gy, weft_rig_hit *hit)
{
    const weft_rig_sheet *const s = &tracer->sample->sheet;
    const double dx = ((double)tracer->centre[0] - (double)gx) / (double)tracer->centre[2],
                 dy = ((double)tracer->centre[1] - (double)gy) / (double)tracer->centre[2];
    const double cx = s->bow_mm[0] / (WEFT_RIG_HALF_FIELD_X * WEFT_RIG_HALF_FIELD_X),
                 cy = s->bow_mm[1] / (WEFT_RIG_HALF_FIELD_Y * WEFT_RIG_HALF_FIELD_Y);
    const double tx = tan(RAD_PER_DEG * s->tilt_deg[0]), ty = tan(RAD_PER_DEG * s->tilt_deg[1]);
    double x = (double)gx, y = (double)gy, z = 0;
    for (int i = 0; i < 6; i++) { /* each turn leaves a hundredth of the error */
        z = s->bow_mm[0] + s->bow_mm[1] - cx * x * x - cy * y * y + tx * x + ty * y;
        x = (double)gx + z * dx;
        y = (double)gy + z * dy;
    }
    hit_table(hit, gx, gy);
    if ((s->size_mm[0] > 0 && fabs(x - s->offset_mm[0]) > s->size_mm[0] / 2) ||
        (s->size_mm[1] > 0 && fabs(y - s->offset_mm[1]) > s->size_mm[1] / 2)) {
        hit->material = 1;
        return;
    }
    const weft_vec3 n = weft_normalise((weft_vec3){2 * cx * x - tx, 2 * cy * y - ty, 1});
    hit->x = (float)x;
    hit->y = (float)y;
    hit->z = (float)z;
    hit->nx = (float)n.x;
    hit->ny = (float)n.y;
    hit->nz = (float)n.z;
}

static void trace_balls(const weft_rig_tracer *tracer, float gx, float gy, weft_rig_hit *hit)
{
    const weft_rig_sample *const sample = tracer->sample;
    const float *const c = tracer->centre;
    const weft_vec3 eye = {(double)c[0], (double)c[1], (double)c[2]};
    const weft_vec3 ray = weft_normalise(weft_sub((weft_vec3){(double)gx, (double)gy, 0}, eye));
    hit_table(hit, gx, gy);
    for (int i = 0; i < sample->n_balls; i++) {
        const weft_rig_ball *const ball = &sample->balls[i];
        const weft_vec3 middle = {ball->x, ball->y, ball->radius}, to = weft_sub(middle, eye);
        const double along = weft_dot(to, ray),
                     under = ball->radius * ball->radius - (weft_dot(to, to) - along * along);
        if (!(under > 0))
            continue;
        const weft_vec3 p = weft_add(eye, weft_scale(ray, along - sqrt(under)));
        const weft_vec3 n = weft_scale(weft_sub(p, middle), 1 / ball->radius);
        const weft_vec3 t =
            weft_normalise(weft_cross(n, fabs(n.z) < 0.9 ? (weft_vec3){0, 0, 1} : (weft_vec3){1, 0, 0}));
        *hit = (weft_rig_hit){.x = (float)p.x,
                              .y = (float)p.y,
                              .z = (float)p.z,
                              .nx = (float)n.x,
                              .ny = (float)n.y,
                              .nz = (float)n.z,
                              .tx = (float)t.x,
                              .ty = (float)t.y,
                              .tz = (float)t.z,
                              .strength = 1,
                              .openness = 1,
                              .material = 1};
    }
}

static bool on_strip(const weft_rig_sample *sample, float gx, float gy)
{
    const double *const s = sample->strip_mm;
    const double x = (double)gx, y = (double)gy;
    return sample->strip_material && x >= s[0] && x <= s[2] && y >= s[1] && y <= s[3];
}

void weft_rig_trace(const weft_rig_tracer *tracer, const weft_fabric_patch *patch, float gx, float gy,
                    weft_rig_hit *hit)
{
    const weft_rig_sample *const sample = tracer->sample;
    const bool strip = on_strip(sample, gx, gy);
    if (sample->has_plate)
        trace_plate(tracer, gx, gy, hit);
    else if (sample->n_balls)
        trace_balls(tracer, gx, gy, hit);
    else if (sample->has_cloth && !strip)
        trace_cloth(tracer, patch, gx, gy, hit);
    else if (sample->has_sheet && !strip)
        trace_sheet(tracer, gx, gy, hit);
    else
        hit_table(hit, gx, gy);
    if (strip && hit->z == 0 && !(sample->has_plate && hit->material))
        hit->material = sample->strip_material;
}

/* ------------------------------------------------------------------------------------------ views */

typedef struct view_job {
    weft_rig_view *view;
    const weft_camera *camera;
} view_job;

static void sensor_rows(void *context, int band, int begin, int end)
{
    (void)band;
    const view_job *const job = context;
    for (int v = begin; v < end; v++)
        for (int u = 0; u < job->camera->width; u++) {
            weft_vec3 point = {0};
            (void)weft_camera_to_plane(job->camera, u, v, 0, &point);
            weft_image_row(&job->view->ground, 0, v)[u] = (float)point.x;
            weft_image_row(&job->view->ground, 1, v)[u] = (float)point.y;
        }
}

weft_err weft_rig_view_sensor(weft_rig_view *view, const weft_rig_scene *scene, weft_error *err)
{
    *view = (weft_rig_view){.centre = weft_camera_centre(&scene->camera)};
    WEFT_TRY(weft_image_init(&view->ground, scene->camera.width, scene->camera.height, 2, err));
    view_job job = {view, &scene->camera};
    weft_parallel_rows(scene->camera.height, sensor_rows, &job);
    return WEFT_OK;
}

weft_err weft_rig_view_plane(weft_rig_view *view, const weft_rig_scene *scene, double mm_per_px,
                             weft_error *err)
{
    const weft_camera *const camera = &scene->camera;
    weft_vec3 middle[4];
    const double right = camera->width - 1, bottom = camera->height - 1;
    const double at[4][2] = {{0, bottom / 2}, {right, bottom / 2}, {right / 2, 0}, {right / 2, bottom}};
    for (int i = 0; i < 4; i++)
        if (!weft_camera_to_plane(camera, at[i][0], at[i][1], 0, &middle[i]))
            return weft_fail(err, WEFT_ERR_RANGE, "the camera does not see the table");
    const double half_width = fmin(-middle[0].x, middle[1].x), half_height = fmin(middle[2].y, -middle[3].y);
    const double columns = 2 * floor(half_width / mm_per_px), rows = 2 * floor(half_height / mm_per_px);
    if (!(columns >= 1 && rows >= 1 && columns <= WEFT_IMAGE_MAX_SIDE && rows <= WEFT_IMAGE_MAX_SIDE))
        return weft_fail(err, WEFT_ERR_RANGE,
                         "a grid of %g mm per pixel does not fit the field of %.0f x %.0f mm", mm_per_px,
                         2 * half_width, 2 * half_height);
    *view = (weft_rig_view){.centre = weft_camera_centre(camera)};
    WEFT_TRY(weft_image_init(&view->ground, (int)columns, (int)rows, 2, err));
    for (int v = 0; v < view->ground.height; v++)
        for (int u = 0; u < view->ground.width; u++) {
            weft_image_row(&view->ground, 0, v)[u] = (float)((u - (columns - 1) / 2) * mm_per_px);
            weft_image_row(&view->ground, 1, v)[u] = (float)(((rows - 1) / 2 - v) * mm_per_px);
        }
    return WEFT_OK;
}

void weft_rig_view_fini(weft_rig_view *view)
{
    weft_image_fini(&view->ground);
}

/* Central differences inside, one-sided at the frame's edge. */
weft_rig_footprint weft_rig_footprint_at(const weft_rig_view *view, int u, int v)
{
    const weft_image *const g = &view->ground;
    const int u0 = u > 0 ? u - 1 : u, u1 = u + 1 < g->width ? u + 1 : u;
    const int v0 = v > 0 ? v - 1 : v, v1 = v + 1 < g->height ? v + 1 : v;
    const float su = u1 > u0 ? 1.0F / (float)(u1 - u0) : 0, sv = v1 > v0 ? 1.0F / (float)(v1 - v0) : 0;
    weft_rig_footprint f;
    f.x = weft_image_row(g, 0, v)[u];
    f.y = weft_image_row(g, 1, v)[u];
    for (int c = 0; c < 2; c++) {
        f.du[c] = su * (weft_image_row(g, c, v)[u1] - weft_image_row(g, c, v)[u0]);
        f.dv[c] = sv * (weft_image_row(g, c, v1)[u] - weft_image_row(g, c, v0)[u]);
    }
    return f;
}
