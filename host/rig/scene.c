#include "host/rig/scene.h"

#include "calibration/lens/lens_model.h"
#include "calibration/lights/light_model.h"

#include <math.h>
#include <string.h>

#define RAD_PER_DEG 0.017453292519943295

/* Where a seeded number is used; new uses get new numbers, so that old seeds keep their scanner. */
enum {
    STREAM_LAMP_PLACE = 1,
    STREAM_LAMP_AIM,
    STREAM_LAMP_LOBE,
    STREAM_LAMP_POWER,
    STREAM_LAMP_PUMP,
    STREAM_CAMERA,
    STREAM_DRIFT
};

double weft_rig_random(uint64_t seed, uint64_t stream, uint64_t index)
{
    uint64_t z = seed * 0x9e3779b97f4a7c15u + stream * 0xd1b54a32d192ed03u + index * 0x8cb92ba72f3d8dd7u;
    for (int i = 0; i < 2; i++) {
        z += 0x9e3779b97f4a7c15u;
        z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
        z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
        z ^= z >> 31;
    }
    return (double)(z >> 11) * 0x1p-53;
}

static double uniform(const weft_rig_setup *setup, uint64_t stream, uint64_t index, double low, double high)
{
    return low + (high - low) * weft_rig_random(setup->seed, stream, index);
}

/* Standard normal by Box and Muller. */
static double normal(const weft_rig_setup *setup, uint64_t stream, uint64_t index)
{
    const double radius = sqrt(-2 * log(1 - weft_rig_random(setup->seed, stream, 2 * index)));
    return radius * cos(6.283185307179586 * weft_rig_random(setup->seed, stream, 2 * index + 1));
}

static weft_mat3 rotation_x(double angle)
{
    const double c = cos(angle), s = sin(angle);
    return (weft_mat3){{1, 0, 0, 0, c, -s, 0, s, c}};
}

static weft_mat3 rotation_y(double angle)
{
    const double c = cos(angle), s = sin(angle);
    return (weft_mat3){{c, 0, s, 0, 1, 0, -s, 0, c}};
}

static weft_mat3 rotation_z(double angle)
{
    const double c = cos(angle), s = sin(angle);
    return (weft_mat3){{c, -s, 0, s, c, 0, 0, 0, 1}};
}

/* Pinhole over the table, looking down, about 0.125 mm/px at the default size. */
static void place_camera(weft_rig_scene *scene)
{
    const weft_rig_setup *const setup = &scene->setup;
    const double scale = setup->size.width / (double)WEFT_RIG_WIDTH;
    double r[10];
    for (int i = 0; i < 10; i++)
        r[i] = uniform(setup, STREAM_CAMERA, (uint64_t)i, -1, 1);
    weft_camera *const camera = &scene->camera;
    *camera = (weft_camera){
        .width = setup->size.width,
        .height = setup->size.height,
        .fx = scale * 4800 * (1 + 0.005 * r[0]),
        .cx = (setup->size.width - 1) / 2.0 + scale * 8 * r[1],
        .cy = (setup->size.height - 1) / 2.0 + scale * 8 * r[2],
        .distortion = {-0.20 + 0.03 * r[3], 0.6, 0.0008 * r[4], 0.0008 * r[5], 0},
        .has_pose = true,
    };
    camera->fy = camera->fx;
    static const weft_mat3 down = {{1, 0, 0, 0, -1, 0, 0, 0, -1}};
    const weft_mat3 tilt_x = rotation_x(RAD_PER_DEG * (0.8 + 0.4 * r[6]));
    const weft_mat3 tilt_y = rotation_y(RAD_PER_DEG * (-0.6 + 0.4 * r[7]));
    const weft_mat3 roll = rotation_z(RAD_PER_DEG * (0.7 + 0.5 * r[8]));
    const weft_mat3 tilt = weft_mat3_multiply(&tilt_x, &tilt_y);
    const weft_mat3 turn = weft_mat3_multiply(&roll, &tilt);
    camera->rotation = weft_mat3_multiply(&turn, &down);
    /* The optical axis meets the table a millimetre or so from the middle, as a person would set it up. */
    const double distance = 600 + 4 * r[9];
    const weft_mat3 to_world = weft_mat3_transpose(&camera->rotation);
    const weft_vec3 axis = weft_mat3_apply(&to_world, (weft_vec3){0, 0, 1});
    const weft_vec3 target = {1.5 * r[1], -1.0 * r[2], 0};
    const weft_vec3 centre = weft_sub(target, weft_scale(axis, distance));
    camera->translation = weft_scale(weft_mat3_apply(&camera->rotation, centre), -1);
    scene->vignetting[0] = -0.06;
    scene->vignetting[1] = -0.02;
}

/* A unit vector at most `angle` from `axis`. */
static weft_vec3 aim_off(weft_vec3 axis, double angle, double turn)
{
    const weft_vec3 side =
        weft_normalise(weft_cross(axis, fabs(axis.z) < 0.9 ? (weft_vec3){0, 0, 1} : (weft_vec3){1, 0, 0}));
    const weft_vec3 other = weft_cross(axis, side);
    const weft_vec3 off = weft_add(weft_scale(side, cos(turn)), weft_scale(other, sin(turn)));
    return weft_normalise(weft_add(weft_scale(axis, cos(angle)), weft_scale(off, sin(angle))));
}

static void place_lamp(const weft_rig_setup *setup, int i, weft_light *light)
{
    static const double elevation_deg[WEFT_RIG_N_LIGHTS] = {35, 35, 35, 35, 35, 35, 60, 60, 60, 80};
    static const double azimuth_deg[WEFT_RIG_N_LIGHTS] = {15, 75, 135, 195, 255, 315, 45, 165, 285, 100};
    const double el = RAD_PER_DEG * elevation_deg[i], az = RAD_PER_DEG * azimuth_deg[i];
    const uint64_t k = (uint64_t)i;
    const weft_vec3 jitter = {normal(setup, STREAM_LAMP_PLACE, 3 * k),
                              normal(setup, STREAM_LAMP_PLACE, 3 * k + 1),
                              normal(setup, STREAM_LAMP_PLACE, 3 * k + 2)};
    light->position = weft_add((weft_vec3){300 * cos(el) * cos(az), 300 * cos(el) * sin(az), 300 * sin(el)},
                               weft_scale(jitter, setup->light_jitter_mm));
    const weft_vec3 to_middle = weft_normalise(weft_scale(light->position, -1));
    light->axis =
        aim_off(to_middle, RAD_PER_DEG * uniform(setup, STREAM_LAMP_AIM, 2 * k, 0, setup->aim_jitter_deg),
                uniform(setup, STREAM_LAMP_AIM, 2 * k + 1, 0, 6.283185307179586));
    light->exponent = uniform(setup, STREAM_LAMP_LOBE, k, 1.0, 1.4);
}

/* Relative power and pump of lamp i, and its place. */
static void make_lamp(weft_rig_scene *scene, int i)
{
    const weft_rig_setup *const setup = &scene->setup;
    weft_light *const light = &scene->lights[i];
    double power, pump;
    *light = (weft_light){.white_balance = {1, 1, 1}};
    if (setup->has_lights) {
        light->position = (weft_vec3){setup->lights[i].position_mm[0], setup->lights[i].position_mm[1],
                                      setup->lights[i].position_mm[2]};
        light->axis = weft_normalise(
            (weft_vec3){setup->lights[i].axis[0], setup->lights[i].axis[1], setup->lights[i].axis[2]});
        light->exponent = setup->lights[i].exponent;
        power = setup->lights[i].power;
        pump = setup->lights[i].pump_scale;
    } else {
        place_lamp(setup, i, light);
        power = uniform(setup, STREAM_LAMP_POWER, (uint64_t)i, 0.85, 1.15);
        pump = uniform(setup, STREAM_LAMP_PUMP, (uint64_t)i, 0.9, 1.1);
    }
    scene->led[i] = weft_spectra_led(&scene->spectra, pump);
    for (int k = 0; k < WEFT_SPECTRUM_SAMPLES; k++)
        scene->led[i].v[k] *= power;
}

static void measure_intensity(weft_rig_scene *scene, int i)
{
    const weft_spectrum sheet = weft_spectrum_flat(1);
    weft_light *const light = &scene->lights[i];
    weft_spectra_sensor_rgb(&scene->spectra, &sheet, &scene->led[i], light->intensity);
    for (int c = 0; c < 3; c++)
        light->white_balance[c] = light->intensity[1] / light->intensity[c];
}

/* The brightest linear value of a 99 % sheet on the table over lamps, channels and a grid of the frame. */
static double brightest_sheet(const weft_rig_scene *scene)
{
    double brightest = 0;
    for (int i = 0; i < WEFT_RIG_N_LIGHTS; i++)
        for (int step = 0; step < 41 * 41; step++) {
            const int column = step % 41, row = step / 41;
            const double u = column / 40.0 * (scene->camera.width - 1);
            const double v = row / 40.0 * (scene->camera.height - 1);
            weft_vec3 point, to_light;
            if (!weft_camera_to_plane(&scene->camera, u, v, 0, &point))
                continue;
            const double strength = weft_light_at(&scene->lights[i], point, &to_light);
            const double *const rgb = scene->lights[i].intensity;
            const double value = 0.99 * fmax(rgb[0], fmax(rgb[1], rgb[2])) * strength * fmax(to_light.z, 0) *
                                 weft_rig_vignetting(scene, u, v);
            brightest = fmax(brightest, value);
        }
    return brightest;
}

weft_err weft_rig_scene_init(weft_rig_scene *scene, const weft_rig_setup *setup, weft_error *err)
{
    memset(scene, 0, sizeof *scene);
    scene->setup = *setup;
    WEFT_TRY(weft_spectra_load(&scene->spectra, err));
    scene->sensor = (weft_rig_sensor){
        .black_dn = 256, .white_dn = 15871, .full_well_e = 30000, .read_noise_e = 3, .prnu = 0.003};
    place_camera(scene);
    for (int i = 0; i < WEFT_RIG_N_LIGHTS; i++) {
        make_lamp(scene, i);
        measure_intensity(scene, i);
    }
    const double brightest = brightest_sheet(scene);
    if (!(brightest > 0))
        return weft_fail(err, WEFT_ERR_RANGE, "no lamp of the scene lights the table; check \"lights\"");
    for (int i = 0; i < WEFT_RIG_N_LIGHTS; i++) {
        for (int k = 0; k < WEFT_SPECTRUM_SAMPLES; k++)
            scene->led[i].v[k] *= 0.75 / 0.04 / brightest;
        measure_intensity(scene, i);
    }
    const weft_spectrum sheet = weft_spectrum_flat(1);
    double room[3];
    weft_spectra_sensor_rgb(&scene->spectra, &sheet, &scene->spectra.d65, room);
    for (int k = 0; k < WEFT_SPECTRUM_SAMPLES; k++)
        scene->room.v[k] = scene->spectra.d65.v[k] / room[1] * setup->room_light / 0.04;
    return WEFT_OK;
}

uint64_t weft_rig_name_hash(const char *name)
{
    uint64_t hash = 0xcbf29ce484222325u;
    for (const char *p = name; *p; p++)
        hash = (hash ^ (unsigned char)*p) * 0x100000001b3u;
    return hash;
}

double weft_rig_drift(const weft_rig_scene *scene, const char *sample, int light)
{
    if (!(scene->setup.light_drift > 0) || strcmp(sample, "white") == 0)
        return 1;
    const uint64_t index = (weft_rig_name_hash(sample) >> 24 << 8) + (uint64_t)light;
    return fmax(1 + scene->setup.light_drift * normal(&scene->setup, STREAM_DRIFT, index), 0);
}

double weft_rig_vignetting(const weft_rig_scene *scene, double u, double v)
{
    const weft_camera *const c = &scene->camera;
    const double du = u - c->cx, dv = v - c->cy;
    const double tangent2 = du * du / (c->fx * c->fx) + dv * dv / (c->fy * c->fy);
    const double corner2 = (c->width * (double)c->width + c->height * (double)c->height) / 4;
    const double q = (du * du + dv * dv) / corner2;
    const double cos2 = 1 / (1 + tangent2);
    return cos2 * cos2 * (1 + scene->vignetting[0] * q + scene->vignetting[1] * q * q);
}
