#include "host/solve/light_plates.h"

#include "calibration/calibration_report.h"

#include "core/progress.h"

#include <math.h>

void weft_light_plates_fini(weft_light_plates *p)
{
    for (int j = 0; j < p->n; j++)
        weft_plate_fini(&p->plate[j]);
    *p = (weft_light_plates){0};
}

static weft_err demosaic(weft_plate *plate, weft_demosaic how, weft_error *err)
{
    weft_plate rgb = {0};
    WEFT_TRY(weft_plate_demosaic(plate, how, &rgb, err));
    rgb.noise_floor = plate->noise_floor;
    weft_plate_fini(plate);
    *plate = rgb;
    return WEFT_OK;
}

/* S-ORD-17 drops what exceeds 98 % of saturation: of a bracket the shortest exposure's, as the merging has
 * left out the others there.  Pictures made by others do not say where their sensor saturates. */
static double saturation_limit(const weft_set *set, int light)
{
    double limit = 0;
    for (int i = 0; i < set->n_frames; i++)
        if (set->frames[i].role == WEFT_ROLE_LIGHT && set->frames[i].light == light)
            limit = fmax(limit, WEFT_SATURATION_SHARE / weft_set_frame_time(&set->frames[i]));
    return set->cfa != WEFT_CFA_NONE ? limit : 0;
}

static void sum_times(const weft_set *set, int light, double *time, double *gathered)
{
    *time = *gathered = 0;
    for (int i = 0; i < set->n_frames; i++)
        if (set->frames[i].role == WEFT_ROLE_LIGHT && set->frames[i].light == light) {
            const double t = weft_set_frame_time(&set->frames[i]);
            *time += t;
            *gathered += t * weft_set_frame_mean_of(&set->frames[i]);
        }
}

static weft_err load_light(const weft_set *set, int light, const weft_plate *ambient,
                           weft_light_reading reading, weft_plate *plate, weft_error *err)
{
    WEFT_TRY(weft_plate_load_light(set, light, ambient, plate, err));
    if (plate->image.width != set->width || plate->image.height != set->height)
        return weft_fail(err, WEFT_ERR_MISMATCH, "%s: light %d has %d x %d pixels, the set says %d x %d",
                         set->folder, light, plate->image.width, plate->image.height, set->width,
                         set->height);
    if (reading == WEFT_READ_HALF)
        return demosaic(plate, WEFT_DEMOSAIC_HALF, err);
    if (reading == WEFT_READ_LINEAR && plate->cfa != WEFT_CFA_NONE)
        return demosaic(plate, WEFT_DEMOSAIC_LINEAR, err);
    return WEFT_OK;
}

weft_err weft_light_plates_load(const weft_set *set, weft_light_reading reading, weft_light_plates *p,
                                weft_error *err)
{
    weft_plate ambient = {0};
    bool present = false;
    weft_progress progress;
    const int n = weft_set_n_lights(set);
    WEFT_TRY(weft_plate_load_ambient(set, &ambient, &present, err));
    weft_err status = WEFT_OK;
    weft_progress_begin(&progress, "reading", "lights", n);
    while (p->n < n && status == WEFT_OK) {
        weft_plate *const plate = &p->plate[p->n];
        p->most[p->n] = saturation_limit(set, p->n);
        sum_times(set, p->n, &p->time[p->n], &p->gathered[p->n]);
        p->n++; /* a plate that fails half way is freed with the others */
        status = load_light(set, p->n - 1, present ? &ambient : NULL, reading, plate, err);
        if (status == WEFT_OK)
            status = weft_progress_step(&progress, 1, err);
    }
    weft_progress_end(&progress);
    weft_plate_fini(&ambient);
    for (int j = 1; j < p->n && status == WEFT_OK; j++)
        if (p->plate[j].cfa != p->plate[0].cfa)
            status = weft_fail(err, WEFT_ERR_MISMATCH, "%s: light %d is %s, light 0 is %s", set->folder, j,
                               weft_cfa_name(p->plate[j].cfa), weft_cfa_name(p->plate[0].cfa));
    if (status != WEFT_OK) {
        weft_light_plates_fini(p);
        return status;
    }
    p->cfa = p->plate[0].cfa;
    p->width = p->plate[0].image.width;
    p->height = p->plate[0].image.height;
    return WEFT_OK;
}

/* Photon transfer of the four sites, averaged, in parts of full scale.  @return its gain; 0: there is none */
static double transferred_noise(const weft_set *set, const weft_calibration *cal, weft_noise *noise)
{
    const json_t *const report = weft_calibration_get_report(cal, "linearity"), *const sites =
                                                                                    json_object_get(report,
                                                                                                    "noise");
    const double range = set->white - set->black[0],
                 gain = json_number_value(json_object_get(report, "noise_gain"));
    const size_t n = json_array_size(sites);
    *noise = (weft_noise){0};
    for (size_t i = 0; i < n; i++) {
        const json_t *const site = json_array_get(sites, i);
        const double e_per_dn = json_number_value(json_object_get(site, "gain_e_per_dn")),
                     read_e = json_number_value(json_object_get(site, "read_noise_e"));
        if (!(e_per_dn > 0) || !(read_e >= 0) || !(range > 0))
            return 0;
        noise->shot += 1 / (e_per_dn * range) / (double)n;
        noise->read += pow(read_e / (e_per_dn * range), 2) / (double)n;
    }
    return n ? (gain > 0 ? gain : 1) : 0;
}

void weft_light_plates_know_noise(weft_light_plates *plates, const weft_set *set, const weft_calibration *cal)
{
    weft_noise noise = set->noise;
    double measured_at = set->noise_gain, used = 0;
    int frames[WEFT_LIGHTS_MAX] = {0};
    if (!(measured_at > 0))
        measured_at = transferred_noise(set, cal, &noise);
    if (!(measured_at > 0))
        return;
    for (int i = 0; i < set->n_frames; i++)
        if (set->frames[i].role == WEFT_ROLE_LIGHT) {
            used = fmax(used, set->frames[i].gain);
            frames[set->frames[i].light]++;
        }
    noise.shot *= used / measured_at;
    noise.read *= pow(used / measured_at, 2);
    plates->noise = noise;
    for (int j = 0; j < plates->n; j++)
        if (frames[j] == 1) /* a lit frame's darkest tenth is an upper bound; a bracket knows better */
            plates->plate[j].noise_floor = fmin(plates->plate[j].noise_floor,
                                                sqrt(noise.read / (plates->time[j] * plates->gathered[j])));
}

void weft_light_plates_row(const weft_light_plates *plates, int row, weft_solve_row_in in[WEFT_LIGHTS_MAX])
{
    for (int j = 0; j < plates->n; j++) {
        const weft_plate *const p = &plates->plate[j];
        for (int c = 0; c < 3; c++)
            in[j].rgb[c] = weft_image_row(&p->image, p->image.planes == 3 ? c : 0, row);
        in[j].clipped = p->clipped.data ? p->clipped.data + (size_t)row * (size_t)p->clipped.width : NULL;
        in[j].least = (float)(3 * p->noise_floor);
        in[j].most = (float)plates->most[j];
        in[j].read = (float)(p->noise_floor * p->noise_floor);
        in[j].shot = (float)(plates->noise.shot / plates->gathered[j]);
    }
}
