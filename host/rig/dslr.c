#include "host/rig/dslr_private.h"

#include "core/mem.h"
#include "core/progress.h"
#include "core/text.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* What a D5100 has, as its firmware 1.01 says, less what is not done here (writing to the card, live view,
 * movies, focus). */
static const uint16_t operations[] = {
    PTP_GET_DEVICE_INFO,    PTP_OPEN_SESSION,       PTP_CLOSE_SESSION,      PTP_GET_STORAGE_IDS,
    PTP_GET_STORAGE_INFO,   PTP_GET_NUM_OBJECTS,    PTP_GET_OBJECT_HANDLES, PTP_GET_OBJECT_INFO,
    PTP_GET_OBJECT,         PTP_DELETE_OBJECT,      PTP_GET_PROPERTY_DESC,  PTP_GET_PROPERTY_VALUE,
    PTP_SET_PROPERTY_VALUE, PTP_GET_PARTIAL_OBJECT, NIKON_CAPTURE_SDRAM,    NIKON_SET_CONTROL_MODE,
    NIKON_DELETE_SDRAM,     NIKON_GET_EVENT,        NIKON_DEVICE_READY,     NIKON_GET_VENDOR_PROPS,
    NIKON_AF_CAPTURE_SDRAM, NIKON_END_LIVE_VIEW,    NIKON_CAPTURE_TO_MEDIA,
};
static const uint16_t events[] = {0x4002,
                                  0x4003,
                                  0x4006,
                                  0x400a,
                                  PTP_EVENT_CAPTURE_COMPLETE,
                                  NIKON_EVENT_OBJECT_IN_SDRAM,
                                  NIKON_EVENT_CAPTURE_COMPLETE};
static const uint16_t capture_formats[] = {PTP_FORMAT_JPEG, PTP_FORMAT_UNDEFINED};
static const uint16_t image_formats[] = {PTP_FORMAT_JPEG, PTP_FORMAT_UNDEFINED, PTP_FORMAT_FOLDER};

#define COUNT(array) (sizeof(array) / sizeof *(array))

static const struct {
    const char *name;
    double most;
} fault_names[DSLR_N_FAULTS] = {
    [DSLR_FAULT_BUSY] = {"busy", 3600},
    [DSLR_FAULT_STUCK] = {"stuck", 3600},
    [DSLR_FAULT_NO_SHUTTER] = {"no-shutter", 1e6},
    [DSLR_FAULT_CARD_FULL] = {"card-full", 1},
    [DSLR_FAULT_JPEG] = {"jpeg", 1e6},
    [DSLR_FAULT_TWICE] = {"twice", 1e6},
    [DSLR_FAULT_STALE] = {"stale", 1e6},
    [DSLR_FAULT_LINE] = {"line", 1e6},
    [DSLR_FAULT_UNPLUG] = {"unplug", 100},
    [DSLR_FAULT_SHORT] = {"short", 1e6},
    [DSLR_FAULT_BURST] = {"burst", 1e6},
};

/* ------------------------------------------------------------------------------------------ helpers */

void dslr_add_event(weft_dslr *d, uint16_t code, uint32_t param)
{
    if (d->n_events < DSLR_MAX_EVENTS)
        d->events[d->n_events++] = (dslr_event){code, param};
}

bool dslr_take_fault(weft_dslr *d, dslr_fault fault)
{
    if (d->faults[fault] <= 0)
        return false;
    d->faults[fault] -= 1;
    return true;
}

void dslr_forget_objects(weft_dslr *d)
{
    for (int i = 0; i < DSLR_MAX_OBJECTS; i++)
        weft_free(d->objects[i].bytes);
    memset(d->objects, 0, sizeof d->objects);
    d->n_events = 0;
}

static bool is_busy(const weft_dslr *d)
{
    return d->exposing || weft_clock_s() < d->busy_until_s;
}

static const dslr_object *find_object(const weft_dslr *d, uint32_t handle)
{
    for (int i = 0; i < DSLR_MAX_OBJECTS; i++)
        if (handle && d->objects[i].handle == handle)
            return &d->objects[i];
    return NULL;
}

static ptp_writer begin_dataset(weft_dslr *d)
{
    return (ptp_writer){.bytes = d->dataset, .size = sizeof d->dataset};
}

static void give(ptp_reply *reply, const ptp_writer *w, uint16_t code)
{
    reply->code = w->overflow ? PTP_GENERAL_ERROR : code;
    if (reply->code == PTP_OK) {
        reply->data = w->bytes;
        reply->n_data = w->used;
    }
}

/* ------------------------------------------------------------------------------------------ operations */

static void put_device_info(ptp_writer *w)
{
    uint16_t codes[DSLR_N_PROPERTIES];
    const int n = dslr_property_codes(false, codes);
    ptp_put(w, 100, 2); /* version 1.00 of the standard */
    ptp_put(w, PTP_VENDOR_NIKON, 4);
    ptp_put(w, 100, 2);
    ptp_put_text(w, "microsoft.com: 1.0");
    ptp_put(w, 0, 2);
    ptp_put_array16(w, operations, COUNT(operations));
    ptp_put_array16(w, events, COUNT(events));
    ptp_put_array16(w, codes, (uint32_t)n);
    ptp_put_array16(w, capture_formats, COUNT(capture_formats));
    ptp_put_array16(w, image_formats, COUNT(image_formats));
    ptp_put_text(w, "Nikon Corporation");
    ptp_put_text(w, "D5100");
    ptp_put_text(w, "V1.01");
    ptp_put_text(w, WEFT_DSLR_SERIAL);
}

#define CARD_ID 0x00010001u

static uint16_t put_storage_info(const weft_dslr *d, uint32_t id, ptp_writer *w)
{
    const bool full = d->faults[DSLR_FAULT_CARD_FULL] > 0;
    if (id != CARD_ID)
        return PTP_INVALID_STORAGE_ID;
    ptp_put(w, 4, 2); /* removable RAM */
    ptp_put(w, 3, 2); /* DCF */
    ptp_put(w, 0, 2); /* read and write */
    ptp_put(w, UINT64_C(16298016768), 8);
    ptp_put(w, full ? 0 : UINT64_C(8819998720), 8);
    ptp_put(w, full ? 0 : 903, 4);
    ptp_put_text(w, "");
    ptp_put_text(w, "NIKON D5100");
    return PTP_OK;
}

static uint16_t put_object_info(const weft_dslr *d, uint32_t handle, ptp_writer *w)
{
    const dslr_object *const o = find_object(d, handle);
    if (!o)
        return PTP_INVALID_OBJECT_HANDLE;
    char name[16];
    snprintf(name, sizeof name, "DSC_%04u.%s", handle & 0xfff, o->jpeg ? "JPG" : "NEF");
    ptp_put(w, 0, 4); /* in no store: in memory */
    ptp_put(w, o->jpeg ? PTP_FORMAT_JPEG : PTP_FORMAT_UNDEFINED, 2);
    ptp_put(w, 0, 2);
    ptp_put(w, o->n_bytes, 4);
    ptp_put(w, 0, 2 + 4); /* no thumbnail */
    ptp_put(w, 0, 4 + 4);
    ptp_put(w, (uint64_t)d->width, 4);
    ptp_put(w, (uint64_t)d->height, 4);
    ptp_put(w, 0, 4);
    ptp_put(w, 0, 4); /* parent */
    ptp_put(w, 0, 2 + 4);
    ptp_put(w, 0, 4);
    ptp_put_text(w, name);
    ptp_put_text(w, o->date);
    ptp_put_text(w, o->date);
    ptp_put_text(w, "");
    return PTP_OK;
}

/* The picture's bytes from `begin` on, at most `most` of them. */
static void send_object(weft_dslr *d, uint32_t handle, size_t begin, size_t most, ptp_reply *reply)
{
    const dslr_object *const o = find_object(d, handle);
    reply->code = o ? PTP_OK : PTP_INVALID_OBJECT_HANDLE;
    if (!o)
        return;
    const size_t from = begin < o->n_bytes ? begin : o->n_bytes;
    reply->data = o->bytes + from;
    reply->n_data = o->n_bytes - from < most ? o->n_bytes - from : most;
    if (d->faults[DSLR_FAULT_UNPLUG] > 0) {
        reply->cut_after = (size_t)((double)reply->n_data * d->faults[DSLR_FAULT_UNPLUG] / 100);
        reply->cut = reply->unplug = true;
        d->faults[DSLR_FAULT_UNPLUG] = 0;
    } else if (dslr_take_fault(d, DSLR_FAULT_LINE)) {
        reply->cut_after = reply->n_data / 2;
        reply->cut = true;
    }
}

static uint16_t delete_object(weft_dslr *d, uint32_t handle)
{
    for (int i = 0; i < DSLR_MAX_OBJECTS; i++)
        if (d->objects[i].handle == handle && handle)
            return PTP_OK; /* its memory is used again by later pictures */
    return PTP_INVALID_OBJECT_HANDLE;
}

uint16_t dslr_release(weft_dslr *d, bool to_card)
{
    uint32_t numerator, denominator;
    if (is_busy(d))
        return PTP_DEVICE_BUSY;
    if (to_card)
        return PTP_STORE_NOT_AVAILABLE;
    if (d->faults[DSLR_FAULT_CARD_FULL] > 0)
        return PTP_STORE_FULL;
    if (!dslr_exposure(&d->properties, &numerator, &denominator))
        return PTP_GENERAL_ERROR; /* bulb wants a second command to end it */
    d->n_releases++;
    d->exposing = true;
    pthread_cond_signal(&d->work);
    return PTP_OK;
}

static void put_events(weft_dslr *d, ptp_writer *w)
{
    ptp_put(w, (uint64_t)d->n_events, 2);
    for (int i = 0; i < d->n_events; i++) {
        ptp_put(w, d->events[i].code, 2);
        ptp_put(w, d->events[i].param, 4);
    }
    d->n_events = 0;
}

static uint16_t open_session(weft_dslr *d)
{
    if (d->session)
        return PTP_SESSION_ALREADY_OPEN;
    d->session = true;
    return PTP_OK;
}

static void answer_dataset(weft_dslr *d, const ptp_request *r, ptp_reply *reply)
{
    static const uint32_t card[] = {CARD_ID};
    uint16_t codes[DSLR_N_PROPERTIES], code = PTP_OK;
    ptp_writer w = begin_dataset(d);
    switch (r->code) {
    case PTP_GET_DEVICE_INFO:
        put_device_info(&w);
        break;
    case PTP_GET_STORAGE_IDS:
        ptp_put_array32(&w, card, COUNT(card));
        break;
    case PTP_GET_STORAGE_INFO:
        code = put_storage_info(d, r->params[0], &w);
        break;
    case PTP_GET_OBJECT_HANDLES:
        ptp_put_array32(&w, NULL, 0); /* the card is empty */
        break;
    case PTP_GET_OBJECT_INFO:
        code = put_object_info(d, r->params[0], &w);
        break;
    case PTP_GET_PROPERTY_DESC:
        code = dslr_property_describe(&d->properties, r->params[0], &w);
        break;
    case PTP_GET_PROPERTY_VALUE:
        code = dslr_property_read(&d->properties, r->params[0], &w);
        break;
    case NIKON_GET_EVENT:
        put_events(d, &w);
        break;
    case NIKON_GET_VENDOR_PROPS:
        ptp_put_array16(&w, codes, (uint32_t)dslr_property_codes(true, codes));
        break;
    default:
        code = PTP_OPERATION_NOT_SUPPORTED;
    }
    give(reply, &w, code);
}

/* Operations whose answer is no dataset.  False when it is another one. */
static bool answer_plain(weft_dslr *d, const ptp_request *r, ptp_reply *reply)
{
    reply->code = PTP_OK;
    switch (r->code) {
    case PTP_OPEN_SESSION:
        reply->code = open_session(d);
        return true;
    case PTP_CLOSE_SESSION:
        d->session = false;
        return true;
    case PTP_GET_NUM_OBJECTS:
        reply->n_params = 1;
        return true;
    case PTP_SET_PROPERTY_VALUE:
        reply->code = dslr_property_write(&d->properties, r->params[0], r->data, r->n_data);
        return true;
    case PTP_GET_OBJECT:
        send_object(d, r->params[0], 0, SIZE_MAX, reply);
        return true;
    case PTP_GET_PARTIAL_OBJECT:
        send_object(d, r->params[0], r->params[1], r->params[2], reply);
        reply->n_params = 1;
        reply->params[0] = (uint32_t)reply->n_data;
        return true;
    case PTP_DELETE_OBJECT:
    case NIKON_DELETE_SDRAM:
        reply->code = delete_object(d, r->params[0]);
        return true;
    case NIKON_DEVICE_READY:
        reply->code = is_busy(d) ? PTP_DEVICE_BUSY : PTP_OK;
        return true;
    case NIKON_CAPTURE_SDRAM:
    case NIKON_AF_CAPTURE_SDRAM:
        reply->code = dslr_release(d, false);
        return true;
    case NIKON_CAPTURE_TO_MEDIA:
        reply->code = dslr_release(d, r->params[1] == 0);
        return true;
    case NIKON_SET_CONTROL_MODE:
    case NIKON_END_LIVE_VIEW:
        return true;
    default:
        return false;
    }
}

/* From the server's thread. */
static void answer(void *context, const ptp_request *request, ptp_reply *reply)
{
    weft_dslr *const d = context;
    pthread_mutex_lock(&d->lock);
    if (!request) {
        d->session = false;
        dslr_forget_objects(d);
    } else if (!d->session && request->code != PTP_GET_DEVICE_INFO && request->code != PTP_OPEN_SESSION) {
        reply->code = PTP_SESSION_NOT_OPEN;
    } else if (!answer_plain(d, request, reply)) {
        answer_dataset(d, request, reply);
    }
    pthread_mutex_unlock(&d->lock);
}

/* ------------------------------------------------------------------------------------------ control */

static json_t *refuse(const char *reason)
{
    return json_pack("{s:b, s:s}", "ok", 0, "error", reason);
}

static json_t *describe_settings(const weft_dslr *d)
{
    json_t *const settings = json_object();
    for (int vendor = 0; vendor < 2; vendor++) {
        uint16_t codes[DSLR_N_PROPERTIES];
        const int n = dslr_property_codes(vendor, codes);
        for (int i = 0; i < n; i++) {
            char name[8];
            snprintf(name, sizeof name, "0x%04x", codes[i]);
            json_object_set_new(settings, name,
                                json_integer((json_int_t)dslr_property_get(&d->properties, codes[i])));
        }
    }
    return settings;
}

static json_t *describe(weft_dslr *d)
{
    json_t *const faults = json_object();
    for (int i = 0; i < DSLR_N_FAULTS; i++)
        if (d->faults[i] > 0)
            json_object_set_new(faults, fault_names[i].name, json_real(d->faults[i]));
    return json_pack("{s:b, s:b, s:b, s:b, s:i, s:i, s:i, s:o, s:o}", "ok", 1, "plugged",
                     ptpip_server_is_plugged(d->server), "session", d->session, "busy", is_busy(d),
                     "releases", d->n_releases, "pictures", d->n_pictures, "battery",
                     (int)dslr_property_get(&d->properties, PTP_PROP_BATTERY), "settings",
                     describe_settings(d), "faults", faults);
}

static json_t *obey_fault(weft_dslr *d, const char *name, const char *number)
{
    double value = 1;
    for (int i = 0; i < DSLR_N_FAULTS; i++) {
        if (strcmp(name, fault_names[i].name) != 0)
            continue;
        if (number[0] &&
            (!weft_text_to_double(number, &value) || !(value >= 0 && value <= fault_names[i].most)))
            return refuse("dslr fault: the number is out of range");
        d->faults[i] = value;
        if (i == DSLR_FAULT_BUSY)
            d->busy_until_s = weft_clock_s() + value;
        return describe(d);
    }
    return refuse("dslr fault: wanted busy, stuck, no-shutter, card-full, jpeg, twice, stale, line, unplug, "
                  "short or burst");
}

static json_t *obey_setting(weft_dslr *d, const char *verb, const char *code_text, const char *value_text)
{
    char *end = NULL;
    const unsigned long code = strtoul(code_text, &end, 0);
    const bool whole = code_text[0] && *end == '\0' && code <= 0xffff;
    const unsigned long value = strtoul(value_text, &end, 0);
    bool done = false;
    if (whole && strcmp(verb, "turn") == 0)
        done = value_text[0] && *end == '\0' &&
               dslr_property_turn(&d->properties, (unsigned)code, (uint32_t)value);
    else if (whole)
        done = dslr_property_lock(&d->properties, (unsigned)code, strcmp(verb, "lock") == 0);
    return done ? describe(d) : refuse("dslr: the body has no such setting or value");
}

static json_t *obey_plug(weft_dslr *d, bool plugged)
{
    ptpip_server_plug(d->server, plugged); /* without the lock: its thread may be waiting for that */
    pthread_mutex_lock(&d->lock);
    json_t *const reply = describe(d);
    pthread_mutex_unlock(&d->lock);
    return reply;
}

static json_t *obey_reset(weft_dslr *d)
{
    pthread_mutex_lock(&d->lock);
    memset(d->faults, 0, sizeof d->faults);
    d->busy_until_s = 0;
    dslr_properties_init(&d->properties, d->width, d->height);
    pthread_mutex_unlock(&d->lock);
    return obey_plug(d, true);
}

json_t *weft_dslr_obey(weft_dslr *d, const char *line)
{
    char verb[16] = "", first[16] = "", second[16] = "";
    const int n = sscanf(line, "%15s %15s %15s", verb, first, second);
    if (n == 1 && strcmp(verb, "reset") == 0)
        return obey_reset(d);
    if (n == 1 && (strcmp(verb, "plug") == 0 || strcmp(verb, "unplug") == 0))
        return obey_plug(d, verb[0] == 'p');
    json_t *reply = NULL;
    pthread_mutex_lock(&d->lock);
    if (n == 1 && strcmp(verb, "state") == 0)
        reply = describe(d);
    else if (n >= 2 && strcmp(verb, "fault") == 0)
        reply = obey_fault(d, first, second);
    else if (n >= 2 && (strcmp(verb, "turn") == 0 || strcmp(verb, "lock") == 0 || strcmp(verb, "free") == 0))
        reply = obey_setting(d, verb, first, second);
    else
        reply = refuse("dslr: wanted state, reset, plug, unplug, turn CODE VALUE, lock CODE, free CODE, or "
                       "fault NAME [NUMBER]");
    pthread_mutex_unlock(&d->lock);
    return reply;
}

/* ------------------------------------------------------------------------------------------ life */

weft_err weft_dslr_create(const char *address, weft_rig_stage *stage, weft_controller_sim *sim,
                          weft_dslr **dslr, weft_error *err)
{
    const weft_camera *const model = &weft_rig_stage_scene(stage)->camera;
    weft_dslr *const d = weft_alloc(1, sizeof *d, err);
    if (!d)
        return WEFT_ERR_NOMEM;
    d->stage = stage;
    d->sim = sim;
    d->width = model->width;
    d->height = model->height;
    pthread_mutex_init(&d->lock, NULL);
    pthread_cond_init(&d->work, NULL);
    dslr_properties_init(&d->properties, d->width, d->height);
    d->dn = weft_alloc((size_t)d->width * (size_t)d->height, sizeof *d->dn, err);
    weft_err status = d->dn ? WEFT_OK : WEFT_ERR_NOMEM;
    if (status == WEFT_OK && pthread_create(&d->shutter, NULL, dslr_shutter_run, d) != 0)
        status = weft_fail(err, WEFT_ERR_NOMEM, "no thread could be started for the DSLR");
    else if (status == WEFT_OK)
        d->shutter_runs = true;
    if (status == WEFT_OK)
        status = ptpip_server_create(address, WEFT_DSLR_PORT, "D5100", answer, d, &d->server, err);
    if (status != WEFT_OK) {
        weft_dslr_destroy(d);
        return status;
    }
    *dslr = d;
    return WEFT_OK;
}

void weft_dslr_destroy(weft_dslr *d)
{
    if (!d)
        return;
    ptpip_server_destroy(d->server);
    pthread_mutex_lock(&d->lock);
    d->stop = true;
    pthread_cond_signal(&d->work);
    pthread_mutex_unlock(&d->lock);
    if (d->shutter_runs)
        pthread_join(d->shutter, NULL);
    dslr_forget_objects(d);
    pthread_cond_destroy(&d->work);
    pthread_mutex_destroy(&d->lock);
    weft_free(d->dn);
    weft_free(d);
}

int weft_dslr_port(const weft_dslr *d)
{
    return ptpip_server_port(d->server);
}
