/* Shading: all lamps at once, a lane each, so that one trip to the surface serves ten pictures. */
#include "host/rig/render.h"

#include "calibration/lens/lens_model.h"
#include "core/clones.h"
#include "core/mem.h"
#include "core/parallel.h"
#include "host/rig/tracer.h"

#include <math.h>
#include <string.h>

/* Lamps 0..9 and idle lanes up to the vector's width. */
#define LANES  16
#define INLINE static inline __attribute__((always_inline))

/* Reflectances as the sensor sees them: per material, colour and lamp. */
typedef struct lane_colours {
    float diffuse[WEFT_RIG_MAX_MATERIALS][3][LANES];
    float bounce[WEFT_RIG_MAX_MATERIALS][3][LANES]; /* light that comes by way of a neighbouring yarn */
    float mirror[3][LANES];
    float room[WEFT_RIG_MAX_MATERIALS][3];
} lane_colours;

typedef struct lane_lamps {
    float x[LANES], y[LANES], z[LANES];    /* place, m */
    float ax[LANES], ay[LANES], az[LANES]; /* axis */
    float exponent[LANES];
} lane_lamps;

/* The lamps as one point sees them. */
typedef struct lane_rays {
    float x[LANES], y[LANES], z[LANES]; /* unit, towards the lamp */
    float strength[LANES];              /* a(theta) / r^2 */
} lane_rays;

typedef struct render_job {
    const weft_rig_scene *scene;
    const weft_rig_view *view;
    const weft_rig_sample *sample;
    weft_rig_tracer tracer;
    weft_rig_projection shadow[WEFT_RIG_N_LIGHTS]; /* of the plate, from each lamp */
    bool plate_is_raised;
    int strip;       /* material of the white strip, -1 without */
    float finest_mm; /* side of the smallest feature of a plate's pattern */
    lane_colours *colours;
    lane_lamps lamps;
    weft_fabric_gloss gloss;
    weft_rig_frames *frames;
} render_job;

/* ------------------------------------------------------------------------------------------ set-up */

static void fill_colours(render_job *job)
{
    const weft_rig_scene *const scene = job->scene;
    const weft_rig_sample *const sample = job->sample;
    const weft_spectrum white = weft_spectrum_flat(1);
    weft_spectrum mean = weft_spectrum_flat(0);
    for (int m = 0; m < sample->n_materials; m++)
        for (int k = 0; k < WEFT_SPECTRUM_SAMPLES; k++)
            mean.v[k] += sample->share[m] * sample->materials[m].v[k];
    for (int i = 0; i < WEFT_RIG_N_LIGHTS; i++) {
        double rgb[3];
        weft_spectra_sensor_rgb(&scene->spectra, &white, &scene->led[i], rgb);
        for (int c = 0; c < 3; c++)
            job->colours->mirror[c][i] = (float)rgb[c];
    }
    for (int m = 0; m < sample->n_materials; m++) {
        weft_spectrum twice = sample->materials[m];
        for (int k = 0; k < WEFT_SPECTRUM_SAMPLES; k++)
            twice.v[k] *= mean.v[k];
        double diffuse[3], bounce[3], room[3];
        for (int i = 0; i < WEFT_RIG_N_LIGHTS; i++) {
            weft_spectra_sensor_rgb(&scene->spectra, &sample->materials[m], &scene->led[i], diffuse);
            weft_spectra_sensor_rgb(&scene->spectra, &twice, &scene->led[i], bounce);
            for (int c = 0; c < 3; c++) {
                job->colours->diffuse[m][c][i] = (float)diffuse[c];
                job->colours->bounce[m][c][i] = scene->setup.interreflection ? (float)bounce[c] : 0;
            }
        }
        weft_spectra_sensor_rgb(&scene->spectra, &sample->materials[m], &scene->room, room);
        for (int c = 0; c < 3; c++)
            job->colours->room[m][c] = (float)room[c];
    }
}

static void fill_lamps(render_job *job)
{
    lane_lamps *const lamps = &job->lamps;
    for (int i = 0; i < LANES; i++) {
        const weft_light idle = {.position = {0, 0, 1000}, .axis = {0, 0, -1}, .exponent = 1};
        const weft_light *const light = i < WEFT_RIG_N_LIGHTS ? &job->scene->lights[i] : &idle;
        lamps->x[i] = (float)light->position.x / 1000;
        lamps->y[i] = (float)light->position.y / 1000;
        lamps->z[i] = (float)light->position.z / 1000;
        lamps->ax[i] = (float)light->axis.x;
        lamps->ay[i] = (float)light->axis.y;
        lamps->az[i] = (float)light->axis.z;
        lamps->exponent[i] = (float)light->exponent;
    }
    if (!job->sample->has_plate)
        return;
    job->plate_is_raised = job->sample->plate.centre.z > 0;
    for (int i = 0; i < WEFT_RIG_N_LIGHTS; i++)
        job->shadow[i] = weft_rig_project_to_plate(&job->sample->plate, job->scene->lights[i].position);
}

/* ------------------------------------------------------------------------------------------ shading */

INLINE void aim_lamps(const lane_lamps *lamps, const weft_rig_hit *hit, lane_rays *rays)
{
    const float px = hit->x / 1000, py = hit->y / 1000, pz = hit->z / 1000;
    float cosine[LANES], inverse2[LANES];
    for (int i = 0; i < LANES; i++) {
        const float x = lamps->x[i] - px, y = lamps->y[i] - py, z = lamps->z[i] - pz;
        const float r2 = x * x + y * y + z * z, scale = 1 / sqrtf(r2);
        rays->x[i] = x * scale;
        rays->y[i] = y * scale;
        rays->z[i] = z * scale;
        inverse2[i] = 1 / r2;
        const float c = -(lamps->ax[i] * rays->x[i] + lamps->ay[i] * rays->y[i] + lamps->az[i] * rays->z[i]);
        cosine[i] = c > 0 ? c : 0;
    }
    for (int i = 0; i < WEFT_RIG_N_LIGHTS; i++)
        rays->strength[i] = powf(cosine[i], lamps->exponent[i]) * inverse2[i];
    for (int i = WEFT_RIG_N_LIGHTS; i < LANES; i++)
        rays->strength[i] = 0;
}

/* A ball hides a lamp from a point when the ray passes within its radius, ahead of the point. */
INLINE void cast_ball_shadows(const weft_rig_sample *sample, const weft_rig_hit *hit, const lane_rays *rays,
                              float visible[LANES])
{
    for (int b = 0; b < sample->n_balls; b++) {
        const weft_rig_ball *const ball = &sample->balls[b];
        const float x = (float)ball->x - hit->x, y = (float)ball->y - hit->y,
                    z = (float)ball->radius - hit->z;
        const float r2 = (float)(ball->radius * ball->radius), d2 = x * x + y * y + z * z;
        if (d2 < r2 * 1.0001F) /* the point is this ball's own: facing away was dealt with */
            continue;
        for (int i = 0; i < LANES; i++) {
            const float along = x * rays->x[i] + y * rays->y[i] + z * rays->z[i];
            if (along > 0 && d2 - along * along < r2)
                visible[i] = 0;
        }
    }
}

/* What damage hides: a tear's edges its ground, a fibre the cloth under it.  The crease is gentler than any
   lamp's elevation and hides nothing; it only tilts the cloth. */
INLINE void cast_damage_shadows(const weft_rig_damage *damage, const weft_rig_hit *hit, const lane_rays *rays,
                                float visible[LANES])
{
    const bool ground = hit->flaw & WEFT_FLAW_TEAR;
    const float up = (ground ? 0 : damage->crown_mm) - hit->z;
    for (int i = 0; i < WEFT_RIG_N_LIGHTS; i++) {
        float normal[3];
        if (!(visible[i] > 0))
            continue;
        const float x = hit->x + up * rays->x[i] / rays->z[i], y = hit->y + up * rays->y[i] / rays->z[i];
        if (ground ? !weft_rig_damage_torn(damage, x, y)
                   : weft_rig_damage_fibre(damage, x, y, normal) != NULL)
            visible[i] = 0;
    }
}

INLINE void cast_cloth_shadows(const weft_rig_sample *sample, const weft_fabric_patch *patch,
                               const weft_rig_hit *hit, const lane_rays *rays, float visible[LANES])
{
    if (!sample->damage.present) {
        weft_fabric_see(&sample->cloth, patch, &hit->cloth, rays->x, rays->y, rays->z, visible);
        return;
    }
    if (hit->flaw & WEFT_FLAW_LINT)
        return;
    float z[LANES];
    for (int i = 0; i < LANES; i++)
        z[i] = rays->z[i] - (hit->lean[0] * rays->x[i] + hit->lean[1] * rays->y[i]);
    if (!(hit->flaw & WEFT_FLAW_TEAR))
        weft_fabric_see(&sample->cloth, patch, &hit->cloth, rays->x, rays->y, z, visible);
    cast_damage_shadows(&sample->damage, hit, rays, visible);
}

/* 1 where the lamp sees the point, 0 where something is between. */
INLINE void cast_shadows(const render_job *job, const weft_fabric_patch *patch, const weft_rig_hit *hit,
                         const lane_rays *rays, float visible[LANES])
{
    for (int i = 0; i < LANES; i++) /* what faces away needs no shadow; idle lanes have no strength */
        visible[i] =
            rays->strength[i] > 0 && hit->nx * rays->x[i] + hit->ny * rays->y[i] + hit->nz * rays->z[i] > 0;
    if (job->sample->n_balls) {
        cast_ball_shadows(job->sample, hit, rays, visible);
    } else if (job->sample->has_cloth && hit->material != job->strip) {
        cast_cloth_shadows(job->sample, patch, hit, rays, visible);
    } else if (job->plate_is_raised && hit->material == 0) {
        const weft_rig_plate *const plate = &job->sample->plate;
        for (int i = 0; i < WEFT_RIG_N_LIGHTS; i++) {
            double x, y;
            weft_rig_plate_coordinates(&job->shadow[i], (double)hit->x, (double)hit->y, &x, &y);
            if (fabs(x) <= plate->half_width && fabs(y) <= plate->half_height)
                visible[i] = 0;
        }
    }
}

/* The mirror term of pi f (n.l): GGX, anisotropic, with Smith's joint masking for the mean roughness
   (Burley 2012, eq. 13; Heitz 2014, eq. 99; Schlick's Fresnel). */
INLINE void add_mirror(const weft_fabric_gloss *gloss, const weft_rig_hit *hit, const float eye[3],
                       const lane_rays *rays, float term[LANES])
{
    const float bx = hit->ny * hit->tz - hit->nz * hit->ty, by = hit->nz * hit->tx - hit->nx * hit->tz,
                bz = hit->nx * hit->ty - hit->ny * hit->tx;
    const float nv0 = hit->nx * eye[0] + hit->ny * eye[1] + hit->nz * eye[2];
    const float nv = nv0 > 1e-4F ? nv0 : 1e-4F;
    const float at = 1 / gloss->alpha_along, ab = 1 / gloss->alpha_across;
    const float alpha2 = gloss->alpha_along * gloss->alpha_across;
    const float g_eye = sqrtf(alpha2 + (1 - alpha2) * nv * nv);
    for (int i = 0; i < LANES; i++) {
        const float sx = rays->x[i] + eye[0], sy = rays->y[i] + eye[1], sz = rays->z[i] + eye[2];
        const float scale = 1 / sqrtf(sx * sx + sy * sy + sz * sz);
        const float hx = sx * scale, hy = sy * scale, hz = sz * scale;
        const float nl0 = hit->nx * rays->x[i] + hit->ny * rays->y[i] + hit->nz * rays->z[i];
        const float nl = nl0 > 0 ? nl0 : 0;
        const float ht = (hit->tx * hx + hit->ty * hy + hit->tz * hz) * at,
                    hb = (bx * hx + by * hy + bz * hz) * ab;
        const float hn = hit->nx * hx + hit->ny * hy + hit->nz * hz;
        const float lobe = ht * ht + hb * hb + hn * hn;
        const float d_pi = at * ab / (lobe * lobe);
        const float g_lamp = sqrtf(alpha2 + (1 - alpha2) * nl * nl);
        const float masking = 0.5F / (nl * g_eye + nv * g_lamp);
        const float c = 1 - (rays->x[i] * hx + rays->y[i] * hy + rays->z[i] * hz);
        const float fresnel = gloss->f0 + (1 - gloss->f0) * c * c * c * c * c;
        term[i] = gloss->coverage * d_pi * masking * fresnel * nl;
    }
}

/* Of a cloth all but what lies on it and under it; of balls only they. */
INLINE bool has_mirror(const render_job *job, int material)
{
    const weft_rig_sample *const sample = job->sample;
    if (sample->n_balls)
        return material == 1;
    return material != job->strip && !(sample->ground && material >= sample->ground);
}

INLINE void shade(const render_job *job, const weft_fabric_patch *patch, const weft_rig_hit *hit,
                  const float eye[3], const lane_rays *rays, int colour, float sum[LANES], float *room)
{
    float visible[LANES], mirror[LANES] = {0};
    cast_shadows(job, patch, hit, rays, visible);
    if (job->gloss.f0 > 0 && has_mirror(job, hit->material))
        add_mirror(&job->gloss, hit, eye, rays, mirror);
    const float *const diffuse = job->colours->diffuse[hit->material][colour];
    const float *const bounce = job->colours->bounce[hit->material][colour];
    const float *const white = job->colours->mirror[colour];
    const float closed = 1 - hit->openness;
    for (int i = 0; i < LANES; i++) {
        const float nl0 = hit->nx * rays->x[i] + hit->ny * rays->y[i] + hit->nz * rays->z[i];
        const float nl = nl0 > 0 ? nl0 : 0, lz = rays->z[i] > 0 ? rays->z[i] : 0;
        const float direct = visible[i] * (hit->strength * diffuse[i] * nl + white[i] * mirror[i]);
        sum[i] += rays->strength[i] * (direct + hit->strength * closed * bounce[i] * lz);
    }
    *room += hit->strength * hit->openness * job->colours->room[hit->material][colour];
}

/* Whether all of a footprint shows one material: light then varies so slowly that its middle is its mean. */
INLINE bool is_even(const render_job *job, const weft_fabric_patch *patch, const weft_rig_footprint *at,
                    int material)
{
    weft_rig_hit hit;
    if (job->sample->has_cloth)
        return material == job->strip;
    if (!job->sample->has_plate && !job->sample->n_balls && job->strip < 0 && !job->sample->has_sheet)
        return true;
    const float across = fabsf(at->du[0]) + fabsf(at->du[1]) + fabsf(at->dv[0]) + fabsf(at->dv[1]);
    if (job->sample->has_plate && !(across < job->finest_mm))
        return false; /* a square could hide between the corners */
    for (int corner = 0; corner < 4; corner++) {
        const float du = corner & 1 ? 0.5F : -0.5F, dv = corner & 2 ? 0.5F : -0.5F;
        weft_rig_trace(&job->tracer, patch, at->x + du * at->du[0] + dv * at->dv[0],
                       at->y + du * at->du[1] + dv * at->dv[1], &hit);
        if (hit.material != material)
            return false;
    }
    return !(job->plate_is_raised && material == 0); /* the table may be in a board's shadow */
}

INLINE void render_pixel(const render_job *job, int u, int v)
{
    int n = job->scene->setup.supersample;
    const int colour = weft_cfa_colour(WEFT_CFA_RGGB, u, v);
    const weft_rig_footprint at = weft_rig_footprint_at(job->view, u, v);
    weft_fabric_patch patch = {0};
    if (job->sample->has_cloth)
        patch = weft_fabric_patch_at(&job->sample->cloth, at.x, at.y);
    const float *const c = job->tracer.centre;
    weft_rig_hit hit;
    lane_rays rays;
    float sum[LANES] = {0}, room = 0;
    weft_rig_trace(&job->tracer, &patch, at.x, at.y, &hit);
    aim_lamps(&job->lamps, &hit, &rays);
    if (is_even(job, &patch, &at, hit.material))
        n = 1;
    float aimed_z = hit.z;
    const float ex = c[0] - hit.x, ey = c[1] - hit.y, ez = c[2] - hit.z;
    const float scale = 1 / sqrtf(ex * ex + ey * ey + ez * ez), eye[3] = {ex * scale, ey * scale, ez * scale};
    for (int j = 0; j < n; j++)
        for (int i = 0; i < n; i++) {
            const float du = ((float)i + 0.5F) / (float)n - 0.5F, dv = ((float)j + 0.5F) / (float)n - 0.5F;
            weft_rig_trace(&job->tracer, &patch, at.x + du * at.du[0] + dv * at.dv[0],
                           at.y + du * at.du[1] + dv * at.dv[1], &hit);
            /* At the edge of a raised board the rays of one photosite end at two distances. */
            if (fabsf(hit.z - aimed_z) > 1) {
                aim_lamps(&job->lamps, &hit, &rays);
                aimed_z = hit.z;
            }
            shade(job, &patch, &hit, eye, &rays, colour, sum, &room);
        }
    const float share = (float)weft_rig_vignetting(job->scene, u, v) / (float)(n * n);
    const size_t index = (size_t)v * (size_t)job->frames->width + (size_t)u;
    for (int i = 0; i < WEFT_RIG_N_LIGHTS; i++)
        job->frames->light[i][index] = share * sum[i];
    job->frames->room[index] = share * room;
}

WEFT_CLONES static void render_rows(void *context, int band, int begin, int end)
{
    (void)band;
    const render_job *const job = context;
    for (int v = begin; v < end; v++)
        for (int u = 0; u < job->frames->width; u++)
            render_pixel(job, u, v);
}

static float pattern_mm(const weft_rig_plate *plate)
{
    if (plate->pattern == WEFT_RIG_CHECKER)
        return (float)plate->square_mm;
    return (float)fmin(plate->chart->patch_mm, plate->chart->pitch_mm - plate->chart->patch_mm);
}

weft_err weft_rig_frames_init(weft_rig_frames *frames, const weft_rig_scene *scene, const weft_rig_view *view,
                              const weft_rig_sample *sample, weft_error *err)
{
    weft_err status = WEFT_ERR_NOMEM;
    *frames = (weft_rig_frames){.width = view->ground.width, .height = view->ground.height};
    const size_t n = weft_image_plane_size(&view->ground);
    render_job *const job = weft_alloc(1, sizeof *job, err);
    lane_colours *const colours = weft_alloc(1, sizeof *colours, err);
    if (!job || !colours)
        goto out;
    for (int i = 0; i < WEFT_RIG_N_LIGHTS; i++)
        if (!(frames->light[i] = weft_alloc(n, sizeof(float), err)))
            goto out;
    if (!(frames->room = weft_alloc(n, sizeof(float), err)))
        goto out;
    *job = (render_job){.scene = scene,
                        .view = view,
                        .sample = sample,
                        .tracer = weft_rig_tracer_make(sample, view->centre),
                        .colours = colours,
                        .strip = sample->strip_material ? sample->strip_material : -1,
                        .frames = frames};
    if (sample->has_cloth)
        job->gloss = sample->cloth.weave->gloss;
    if (sample->has_plate)
        job->finest_mm = pattern_mm(&sample->plate);
    if (sample->n_balls) /* glazed */
        job->gloss =
            (weft_fabric_gloss){.f0 = 0.05F, .coverage = 1, .alpha_along = 0.1F, .alpha_across = 0.1F};
    fill_colours(job);
    fill_lamps(job);
    weft_parallel_rows(frames->height, render_rows, job);
    status = WEFT_OK;
out:
    weft_free(colours);
    weft_free(job);
    if (status != WEFT_OK)
        weft_rig_frames_fini(frames);
    return status;
}

void weft_rig_frames_fini(weft_rig_frames *frames)
{
    for (int i = 0; i < WEFT_RIG_N_LIGHTS; i++)
        weft_free(frames->light[i]);
    weft_free(frames->room);
    *frames = (weft_rig_frames){0};
}

/* ------------------------------------------------------------------------------------------ truth */

typedef struct truth_job {
    const weft_rig_scene *scene;
    const weft_rig_view *view;
    const weft_rig_sample *sample;
    weft_rig_tracer tracer;
    float srgb[WEFT_RIG_MAX_MATERIALS][3];
    weft_rig_truth *to;
} truth_job;

static void truth_pixel(const truth_job *job, int u, int v)
{
    const int n = job->scene->setup.supersample;
    const weft_rig_footprint at = weft_rig_footprint_at(job->view, u, v);
    weft_fabric_patch patch = {0};
    if (job->sample->has_cloth)
        patch = weft_fabric_patch_at(&job->sample->cloth, at.x, at.y);
    float normal[3] = {0}, albedo[3] = {0}, cloth = 0;
    unsigned flaws = 0;
    for (int j = 0; j < n; j++)
        for (int i = 0; i < n; i++) {
            const float du = ((float)i + 0.5F) / (float)n - 0.5F, dv = ((float)j + 0.5F) / (float)n - 0.5F;
            weft_rig_hit hit;
            weft_rig_trace(&job->tracer, &patch, at.x + du * at.du[0] + dv * at.dv[0],
                           at.y + du * at.du[1] + dv * at.dv[1], &hit);
            normal[0] += hit.nx;
            normal[1] += hit.ny;
            normal[2] += hit.nz;
            for (int c = 0; c < 3; c++)
                albedo[c] += hit.strength * job->srgb[hit.material][c];
            flaws |= hit.flaw;
            cloth += job->sample->ground && hit.material == job->sample->ground ? 0 : 1;
        }
    const float scale = 1 / sqrtf(normal[0] * normal[0] + normal[1] * normal[1] + normal[2] * normal[2]);
    for (int c = 0; c < 3; c++) {
        weft_image_row(&job->to->normal, c, v)[u] = scale * normal[c];
        weft_image_row(&job->to->albedo, c, v)[u] = albedo[c] / (float)(n * n);
    }
    if (job->to->alpha.planes)
        weft_image_row(&job->to->alpha, 0, v)[u] = cloth / (float)(n * n);
    if (job->to->flaws.data)
        job->to->flaws.data[(size_t)v * (size_t)job->to->flaws.width + (size_t)u] = (uint8_t)flaws;
}

static void truth_rows(void *context, int band, int begin, int end)
{
    (void)band;
    const truth_job *const job = context;
    for (int v = begin; v < end; v++)
        for (int u = 0; u < job->view->ground.width; u++)
            truth_pixel(job, u, v);
}

static weft_err make_truth(weft_rig_truth *to, const weft_rig_sample *sample, int width, int height,
                           weft_error *err)
{
    WEFT_TRY(weft_image_init(&to->normal, width, height, 3, err));
    WEFT_TRY(weft_image_init(&to->albedo, width, height, 3, err));
    if (sample->ground)
        WEFT_TRY(weft_image_init(&to->alpha, width, height, 1, err));
    return sample->damage.present ? weft_mask_init(&to->flaws, width, height, 0, err) : WEFT_OK;
}

void weft_rig_truth_fini(weft_rig_truth *truth)
{
    weft_image_fini(&truth->normal);
    weft_image_fini(&truth->albedo);
    weft_image_fini(&truth->alpha);
    weft_mask_fini(&truth->flaws);
}

weft_err weft_rig_truth_maps(const weft_rig_scene *scene, const weft_rig_view *view,
                             const weft_rig_sample *sample, weft_rig_truth *truth, weft_error *err)
{
    truth_job job = {.scene = scene,
                     .view = view,
                     .sample = sample,
                     .tracer = weft_rig_tracer_make(sample, view->centre),
                     .to = truth};
    for (int m = 0; m < sample->n_materials; m++) {
        double rgb[3];
        weft_spectra_srgb(&scene->spectra, &sample->materials[m], rgb);
        for (int c = 0; c < 3; c++)
            job.srgb[m][c] = (float)rgb[c];
    }
    *truth = (weft_rig_truth){0};
    const weft_err status = make_truth(truth, sample, view->ground.width, view->ground.height, err);
    if (status != WEFT_OK) {
        weft_rig_truth_fini(truth);
        return status;
    }
    weft_parallel_rows(view->ground.height, truth_rows, &job);
    return WEFT_OK;
}
