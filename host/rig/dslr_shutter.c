/* The virtual DSLR's shutter: from the release to the picture in its memory. */
#include "host/rig/dslr_private.h"

#include "core/mem.h"
#include "core/progress.h"
#include "host/rig/nef_bytes.h"
#include "host/rig/preview_jpeg.h"

#include <math.h>
#include <string.h>
#include <time.h>

/* The simulator watches at most so much at a time. */
#define MOST_US 10000000u

/* The shutter is open from now on.  Gives each lamp's share of the exposure. */
static void watch_lamps(weft_controller_sim *sim, double exposure_s, double on[WEFT_RIG_N_LIGHTS])
{
    uint64_t left_us = (uint64_t)llround(1e6 * exposure_s);
    const double whole_us = (double)left_us;
    memset(on, 0, WEFT_RIG_N_LIGHTS * sizeof *on);
    while (left_us > 0) {
        const uint32_t now_us = left_us < MOST_US ? (uint32_t)left_us : MOST_US;
        double share[WEFT_RIG_N_LIGHTS] = {0};
        if (!weft_controller_sim_expose(sim, now_us, share))
            return;
        for (int i = 0; i < WEFT_RIG_N_LIGHTS; i++)
            on[i] += share[i] * now_us / whole_us;
        left_us -= now_us;
    }
}

/* The last place is the oldest picture's, which goes. */
static dslr_object *new_object(weft_dslr *d)
{
    weft_free(d->objects[DSLR_MAX_OBJECTS - 1].bytes);
    memmove(&d->objects[1], &d->objects[0], (DSLR_MAX_OBJECTS - 1) * sizeof d->objects[0]);
    d->objects[0] = (dslr_object){.handle = NIKON_SDRAM_HANDLE + d->last_handle};
    d->last_handle = (d->last_handle + 1) % 0x7ff;
    return &d->objects[0];
}

static void keep_picture(weft_dslr *d, bool jpeg, uint8_t *bytes, size_t n_bytes)
{
    const time_t now = time(NULL);
    struct tm local;
    dslr_object *const o = new_object(d);
    localtime_r(&now, &local);
    strftime(o->date, sizeof o->date, "%Y%m%dT%H%M%S", &local);
    o->jpeg = jpeg;
    o->bytes = bytes;
    o->n_bytes = n_bytes;
    if (dslr_take_fault(d, DSLR_FAULT_STALE) && d->objects[1].handle)
        dslr_add_event(d, NIKON_EVENT_OBJECT_IN_SDRAM, d->objects[1].handle);
    dslr_add_event(d, NIKON_EVENT_OBJECT_IN_SDRAM, o->handle);
    if (dslr_take_fault(d, DSLR_FAULT_TWICE))
        dslr_add_event(d, NIKON_EVENT_OBJECT_IN_SDRAM, o->handle);
}

static void develop(weft_dslr *d, const weft_nef_info *info, unsigned compression)
{
    const weft_rig_sensor *const sensor = &weft_rig_stage_scene(d->stage)->sensor;
    uint8_t *nef = NULL, *jpeg = NULL;
    size_t n_nef = 0, n_jpeg = 0;
    weft_error error = {0};
    if (compression >= NIKON_NEF)
        weft_nef_make(info, d->dn, sensor->black_dn, sensor->white_dn, &nef, &n_nef, &error);
    if (compression != NIKON_NEF)
        weft_preview_jpeg(d->width, d->height, d->dn, sensor->black_dn, sensor->white_dn, &jpeg, &n_jpeg,
                          &error);
    pthread_mutex_lock(&d->lock);
    if (nef && dslr_take_fault(d, DSLR_FAULT_SHORT))
        n_nef /= 2;
    if (nef)
        keep_picture(d, false, nef, n_nef);
    if (jpeg)
        keep_picture(d, true, jpeg, n_jpeg);
    pthread_mutex_unlock(&d->lock);
}

/* Without the lock; `d->exposing` keeps everybody else away from what is used here. */
static void photograph(weft_dslr *d, const dslr_properties *set, unsigned compression)
{
    double on[WEFT_RIG_N_LIGHTS];
    weft_nef_info info = {.width = d->width, .height = d->height, .serial = WEFT_DSLR_SERIAL};
    const time_t now = time(NULL);
    struct tm local;
    dslr_exposure(set, &info.exposure_num, &info.exposure_den);
    info.iso = dslr_property_get(set, PTP_PROP_ISO);
    localtime_r(&now, &local);
    strftime(info.date_time, sizeof info.date_time, "%Y:%m:%d %H:%M:%S", &local);
    const double exposure_s = (double)info.exposure_num / info.exposure_den;
    watch_lamps(d->sim, exposure_s, on);
    weft_rig_stage_expose(d->stage, on, exposure_s, info.iso / 100.0, d->dn);
    if (dslr_property_get(set, NIKON_PROP_LONG_NR) && exposure_s >= 1)
        watch_lamps(d->sim, exposure_s, on); /* a second frame with the shutter shut, to subtract */
    develop(d, &info, compression);
}

void *dslr_shutter_run(void *dslr)
{
    weft_dslr *const d = dslr;
    pthread_mutex_lock(&d->lock);
    for (;;) {
        while (!d->exposing && !d->stop)
            pthread_cond_wait(&d->work, &d->lock);
        if (d->stop)
            break;
        const dslr_properties set = d->properties;
        const bool opens = !dslr_take_fault(d, DSLR_FAULT_NO_SHUTTER);
        const bool jpeg = dslr_take_fault(d, DSLR_FAULT_JPEG);
        const unsigned compression = jpeg ? NIKON_JPEG_FINE : dslr_property_get(&set, PTP_PROP_COMPRESSION);
        const int n = !opens ? 0 : dslr_take_fault(d, DSLR_FAULT_BURST) ? 2 : 1;
        pthread_mutex_unlock(&d->lock);
        for (int i = 0; i < n; i++)
            photograph(d, &set, compression);
        pthread_mutex_lock(&d->lock);
        if (opens) {
            d->n_pictures += n;
            dslr_add_event(d, NIKON_EVENT_CAPTURE_COMPLETE, 0);
        }
        if (d->faults[DSLR_FAULT_STUCK] > 0) {
            d->busy_until_s = weft_clock_s() + d->faults[DSLR_FAULT_STUCK];
            d->faults[DSLR_FAULT_STUCK] = 0;
        }
        d->exposing = false;
    }
    pthread_mutex_unlock(&d->lock);
    return NULL;
}
