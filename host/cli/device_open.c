#include "host/cli/device_open.h"

#include <stdio.h>
#include <string.h>

static weft_err choose_port(const char *dev, char port[256], weft_error *err)
{
    char **ports = NULL, list[600] = "";
    int n = 0;
    WEFT_TRY(weft_controller_list_ports_under(dev, &ports, err));
    for (; ports[n]; n++) {
        const size_t used = strlen(list);
        snprintf(list + used, sizeof list - used, "%s%s", n ? ", " : "", ports[n]);
    }
    weft_err status = WEFT_OK;
    if (n == 0)
        status =
            weft_fail(err, WEFT_ERR_MISSING,
                      "no light controller was found; check its USB cable, name its port with --port, or "
                      "start a virtual scanner (weft rig) and give --rig");
    else if (n > 1)
        status =
            weft_fail(err, WEFT_ERR_MISSING,
                      "there are %d serial ports: choose the light controller's with --port: %s", n, list);
    else
        snprintf(port, 256, "%s", ports[0]);
    weft_controller_free_ports(ports);
    return status;
}

weft_err weft_device_open_controller(const weft_device_names *names, weft_controller **controller,
                                     weft_error *err)
{
    char port[256];
    if (names->port[0])
        snprintf(port, sizeof port, "%s", names->port);
    else
        WEFT_TRY(choose_port(names->dev, port, err));
    return weft_controller_open_under(names->dev, port, WEFT_DEVICE_LEASE_MS, controller, err);
}

weft_err weft_device_open_both(const weft_device_options *options, weft_camera_device **camera,
                               weft_controller **controller, weft_error *err)
{
    weft_device_names names;
    weft_camera_device *opened = NULL;
    WEFT_TRY(weft_device_options_resolve(options, &names, err));
    WEFT_TRY(weft_camera_open(names.camera, &opened, err));
    const weft_err status = weft_device_open_controller(&names, controller, err);
    if (status == WEFT_OK)
        *camera = opened;
    else
        weft_camera_close(opened);
    return status;
}
