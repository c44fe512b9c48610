/* The settings in the board's EEPROM. */
#include "host/light/controller_private.h"

#include <string.h>

static weft_err check_can(const weft_controller_info *info, weft_error *err)
{
    if (info->capabilities & WEFT_CAPABILITY_SETTINGS)
        return WEFT_OK;
    return weft_fail(err, WEFT_ERR_UNSUPPORTED,
                     "%s: firmware %s keeps no settings; flash the firmware of this build (weft flash)",
                     info->port, info->firmware);
}

weft_err weft_controller_get_setting(weft_controller *c, int key, int index, uint8_t value[8],
                                     weft_error *err)
{
    const weft_cfg_get_request request = {.key = (uint8_t)key, .index = (uint8_t)index};
    uint8_t payload[WEFT_CFG_GET_REQUEST_BYTES];
    weft_frame frame;
    weft_cfg_get_reply reply;
    WEFT_TRY(check_can(&c->info, err));
    weft_cfg_get_request_encode(&request, payload);
    WEFT_TRY(weft_controller_command(c, WEFT_CMD_CFG_GET, payload, sizeof payload, WEFT_CFG_GET_REPLY_BYTES,
                                     &frame, err));
    weft_cfg_get_reply_decode(frame.payload + 1, (uint8_t)(frame.n - 1), &reply);
    memcpy(value, reply.value, 8);
    return WEFT_OK;
}

weft_err weft_controller_set_setting(weft_controller *c, int key, int index, const uint8_t value[8],
                                     weft_error *err)
{
    weft_cfg_set_request request = {.key = (uint8_t)key, .index = (uint8_t)index};
    uint8_t payload[WEFT_CFG_SET_REQUEST_BYTES], back[8];
    weft_frame frame;
    WEFT_TRY(check_can(&c->info, err));
    memcpy(request.value, value, 8);
    weft_cfg_set_request_encode(&request, payload);
    WEFT_TRY(weft_controller_command(c, WEFT_CMD_CFG_SET, payload, sizeof payload, WEFT_CFG_SET_REPLY_BYTES,
                                     &frame, err));
    if (key == WEFT_KEY_DEFAULTS)
        return WEFT_OK;
    WEFT_TRY(weft_controller_get_setting(c, key, index, back, err));
    if (memcmp(back, value, 8) != 0)
        return weft_fail(err, WEFT_ERR_DEVICE,
                         "%s: the setting does not read back as it was stored; try again", c->serial.name);
    return WEFT_OK;
}
