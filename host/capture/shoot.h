/**
 * One exposure under known lights: light on, settle, trigger, wait, light off.
 *
 * By software the program does each step and asks the controller afterwards whether the lights were on all
 * the while.  By wire the controller does them by its own clock: it pulses the camera's trigger input and,
 * where the camera's exposure output is wired back, proves by the ticks of both edges that exactly these
 * lights, settled, covered the exposure.
 */
#ifndef WEFT_HOST_CAPTURE_SHOOT_H
#define WEFT_HOST_CAPTURE_SHOOT_H

#include "host/camera/camera.h"
#include "host/capture/frame_stats.h"
#include "host/light/controller.h"

/** Camera and lights, and what they are doing.  Zeroed but for the first group before the first use. */
typedef struct weft_shooter {
    weft_camera_device *camera;
    weft_controller *controller;
    int level;         /* of the lights */
    double settle_s;   /* between light on and trigger */
    double deadline_s; /* for the frame, after its exposure */
    weft_camera_trigger trigger;

    weft_camera_settings set; /* what the camera was last told */
    uint32_t lit;             /* lights that are on */
    int max_on_ms;            /* what the controller was last told */
    double asked_s;           /* when that was */
    double heard_s;           /* when the controller last heard anything */
    bool exposure_line;       /* by wire: the camera's exposure output has been seen to move */
    weft_controller_step step;
    weft_controller_step_result result;
    weft_err fire_status;
    weft_error fire_error;
    weft_captured_frame frame;
} weft_shooter;

/** What one exposure gave.  `reason` is empty when it is good. */
typedef struct weft_shot {
    char reason[200];
    uint32_t on_tick, off_tick; /* of the controller's clock; by software 0 without lights */
    bool proved;                /* by the exposure line: the lights covered rise to fall */
    uint32_t rise_tick, fall_tick;
    weft_frame_stats stats;
} weft_shot;

/** Lets the camera's waiting renew the lease; call once. */
void weft_shooter_begin(weft_shooter *shooter);
/** Lights off, by the panic bytes if the controller does not answer; frees the frame. */
void weft_shooter_end(weft_shooter *shooter);

/** Tells the camera, when it is not so already. */
weft_err weft_shooter_set_camera(weft_shooter *shooter, double exposure_s, double gain, weft_error *err);

/** Renews the controller's lease, at most a few times a second. */
weft_err weft_shooter_keep_alive(weft_shooter *shooter, weft_error *err);

/**
 * Exposes shooter->frame once with exactly `lights` on.  A frame that is not whole, or whose lights were
 * not on from before the trigger until after the frame (by wire: after the exposure), gives WEFT_OK with a
 * reason.
 *
 * @return WEFT_ERR_DEVICE and the like when camera or controller fail, WEFT_ERR_CANCELLED; the lights are
 *         off in any case
 */
weft_err weft_shoot(weft_shooter *shooter, uint32_t lights, double exposure_s, double gain, weft_shot *shot,
                    weft_error *err);

#endif
