/**
 * The camera of the virtual scanner: a GigE Vision camera on an address of this machine, by Aravis'
 * ArvGvFakeCamera with a description of our own (data/virtual-scanner.xml).
 *
 * A frame begins when the trigger comes (software trigger, or on Line1 the controller's trigger pin) or at
 * the frame rate; it sees the lamps that the firmware has on, in simulated time.  The exposure output is
 * wired to the controller.
 */
#ifndef WEFT_HOST_RIG_RIG_CAMERA_H
#define WEFT_HOST_RIG_RIG_CAMERA_H

#include "host/rig/controller_sim.h"
#include "host/rig/stage.h"

typedef struct weft_rig_camera weft_rig_camera;

/** Starts the camera.  Its description is written to FOLDER/camera.xml.
 *  @return WEFT_ERR_DEVICE when UDP port 3956 of the address is taken or the address is not of this machine
 */
weft_err weft_rig_camera_create(const char *address, const char *folder, weft_rig_stage *stage,
                                weft_controller_sim *sim, weft_rig_camera **camera, weft_error *err);
void weft_rig_camera_destroy(weft_rig_camera *camera);

/**
 * Makes the camera fail: "lost RATIO" of the packets, "blackout S" (answers nothing for so long, from its
 * next frame on), "stray" (a frame that nobody asked for), "format BayerRG8" (sends another format than it
 * was told).
 *
 * @return WEFT_ERR_USAGE for other words
 */
weft_err weft_rig_camera_fail(weft_rig_camera *camera, const char *words, weft_error *err);

#endif
