/** Opening what --rig, --port and --camera name. */
#ifndef WEFT_HOST_CLI_DEVICE_OPEN_H
#define WEFT_HOST_CLI_DEVICE_OPEN_H

#include "host/camera/camera.h"
#include "host/cli/device_options.h"
#include "host/light/controller.h"

/** The lights go dark when the program is silent for so long: killed, hung, or the computer asleep. */
#define WEFT_DEVICE_LEASE_MS 800

/** Opens the light controller: names->port, or the only candidate of this machine.
 *  @return WEFT_ERR_MISSING when there is none or there are several, with what to do; else as
 *          weft_controller_open() */
weft_err weft_device_open_controller(const weft_device_names *names, weft_controller **controller,
                                     weft_error *err);

/** Opens the camera and then the light controller, whose lease runs from then on. */
weft_err weft_device_open_both(const weft_device_options *options, weft_camera_device **camera,
                               weft_controller **controller, weft_error *err);

#endif
