/** Inside the virtual DSLR: the body that dslr.c (requests) and dslr_shutter.c (photographs) share. */
#ifndef WEFT_HOST_RIG_DSLR_PRIVATE_H
#define WEFT_HOST_RIG_DSLR_PRIVATE_H

#include "host/rig/dslr.h"
#include "host/rig/dslr_properties.h"
#include "host/rig/ptp_codes.h"
#include "host/rig/ptpip_server.h"

#include <pthread.h>

enum { DSLR_MAX_OBJECTS = 4, DSLR_MAX_EVENTS = 32, DSLR_DATASET_BYTES = 4096 };

/* A photograph in the body's memory. */
typedef struct dslr_object {
    uint32_t handle; /* 0: none */
    bool jpeg;
    uint8_t *bytes;
    size_t n_bytes;
    char date[16]; /* "20261123T100000" */
} dslr_object;

typedef struct dslr_event {
    uint16_t code;
    uint32_t param;
} dslr_event;

/* What it may do wrong; each is a number, 0: nothing. */
typedef enum dslr_fault {
    DSLR_FAULT_BUSY,       /* busy for so many seconds from now on */
    DSLR_FAULT_STUCK,      /* busy for so many seconds after the next exposure */
    DSLR_FAULT_NO_SHUTTER, /* so many times the shutter does not open: no picture, no word */
    DSLR_FAULT_CARD_FULL,  /* 1: releases are refused: no room */
    DSLR_FAULT_JPEG,       /* so many pictures are JPEGs whatever is set */
    DSLR_FAULT_TWICE,      /* so many pictures are announced twice */
    DSLR_FAULT_STALE,      /* so many times the picture before is announced again before the new one */
    DSLR_FAULT_LINE,       /* so many downloads break off in the middle; the cable is good */
    DSLR_FAULT_UNPLUG,     /* the cable is pulled when so many percent of the next picture are through */
    DSLR_FAULT_SHORT,      /* so many files end in the middle, and the camera does not notice */
    DSLR_FAULT_BURST,      /* so many releases give two pictures */
    DSLR_N_FAULTS,
} dslr_fault;

struct weft_dslr {
    ptpip_server *server;
    weft_rig_stage *stage;
    weft_controller_sim *sim;
    int width, height;
    uint16_t *dn;                        /* [height][width]; the shutter thread's */
    uint8_t dataset[DSLR_DATASET_BYTES]; /* the server thread's */
    pthread_t shutter;
    bool shutter_runs;
    pthread_mutex_t lock; /* of all that follows */
    pthread_cond_t work;
    bool stop, exposing, session;
    double busy_until_s;
    dslr_properties properties;
    double faults[DSLR_N_FAULTS];
    uint32_t last_handle;
    int n_releases, n_pictures;
    dslr_object objects[DSLR_MAX_OBJECTS]; /* newest first */
    dslr_event events[DSLR_MAX_EVENTS];
    int n_events;
};

/* The thread that opens the shutter when d->exposing is set. */
void *dslr_shutter_run(void *dslr);

/* All of these are called with the lock held. */
void dslr_add_event(weft_dslr *d, uint16_t code, uint32_t param);
bool dslr_take_fault(weft_dslr *d, dslr_fault fault); /* counts one down */
void dslr_forget_objects(weft_dslr *d);
/* A response code; DeviceBusy until the picture is there. */
uint16_t dslr_release(weft_dslr *d, bool to_card);

#endif
