/** Inside the capture engine: what its parts share.  capture.c goes through a set, good_frame.c takes a frame
 *  until it is good, keep_frame.c writes it. */
#ifndef WEFT_HOST_CAPTURE_CAPTURE_PRIVATE_H
#define WEFT_HOST_CAPTURE_CAPTURE_PRIVATE_H

#include "host/capture/capture.h"
#include "host/capture/light_print.h"
#include "host/capture/plan.h"
#include "host/capture/shoot.h"

/** A capture under way. */
typedef struct weft_capture_state {
    weft_capture_options o; /* with nothing left to default */
    weft_shooter shooter;
    weft_capture_plan plan;
    weft_set set;
    weft_capture_report report;
    weft_progress *progress;
    bool has_dark_mean;
    double dark_mean; /* mean of a frame without lights, share of the range per second and gain */
    weft_light_print dark_print;
    weft_light_print prints[WEFT_CAPTURE_MAX_LIGHTS]; /* of the middle exposures that there are */
} weft_capture_state;

/** Takes the frame, or the mean of so many, each until it is good; shooter.frame has it.  `retries` gets the
 *  reason for each one that was not.
 *  @return WEFT_ERR_DEVICE after so many tries */
weft_err weft_capture_shoot(weft_capture_state *run, const weft_planned_frame *frame, weft_shot *shot,
                            json_t *retries, weft_error *err);

/** A frame without lights is what the others are compared with; warns of a bright room. */
void weft_capture_remember_dark(weft_capture_state *run, const weft_shot *shot);
/** Takes one that is not kept, for a set that has or gets none now. */
weft_err weft_capture_look_at_the_dark(weft_capture_state *run, weft_error *err);
/** Remembers the shape of a light's frame (its middle exposure), for the frames after it. */
void weft_capture_remember_light(weft_capture_state *run, const weft_planned_frame *frame);
/** The same of frames from before: a set that is resumed is judged as one that is taken in one go. */
weft_err weft_capture_read_prints(weft_capture_state *run, weft_error *err);

void weft_capture_warn_of_clipping(weft_capture_state *run, const weft_planned_frame *frame,
                                   const weft_shot *shot);

/** After a failure of the controller: WEFT_OK when it had been unplugged and is there again.  `why` is what
 *  failed with `status`, and stays the error when it had not. */
weft_err weft_capture_come_back(weft_capture_state *run, weft_err status, weft_error *why, weft_error *err);

/** What set.json is to say of how the frame was taken; a new reference, NULL without memory. */
json_t *weft_capture_describe_shot(const weft_capture_state *run, const weft_planned_frame *frame,
                                   const weft_shot *shot, json_t *retries);

/** Writes shooter.frame, its sidecar and set.json, while the controller's lease is kept alive: a disk may
 * take longer than that lasts. */
weft_err weft_capture_keep(weft_capture_state *run, weft_planned_frame *frame, json_t *capture,
                           weft_error *err);

#endif
