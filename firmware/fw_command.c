#include "firmware/fw_command.h"

#include "firmware/fw_board.h"
#include "firmware/fw_config.h"
#include "firmware/fw_light.h"
#include "firmware/fw_link.h"
#include "firmware/fw_safety.h"
#include "firmware/fw_sequence.h"
#include "firmware/fw_settings.h"

#include <string.h>

_Static_assert(sizeof FW_GIT_ID - 1 <= sizeof(((weft_hello_reply *)0)->git_id), "FW_GIT_ID is too long");

static uint8_t run_hello(const weft_hello_request *request, weft_hello_reply *reply)
{
    *reply = (weft_hello_reply){
        .magic = WEFT_PROTOCOL_MAGIC,
        .proto_major = WEFT_PROTOCOL_MAJOR,
        .proto_minor = WEFT_PROTOCOL_MINOR,
        .fw_version = {FW_VERSION_MAJOR, FW_VERSION_MINOR, FW_VERSION_PATCH},
        .capabilities = WEFT_CAPABILITY_DIMMING | WEFT_CAPABILITY_SEQUENCES | WEFT_CAPABILITY_EXPOSURE |
                        WEFT_CAPABILITY_SETTINGS | WEFT_CAPABILITY_REBOOT,
        .n_lights = fw_settings()->n_lights,
        .level_max = FW_LEVEL_MAX,
        .tick_hz = FW_TICK_HZ,
        .max_on_ms = fw_settings()->max_on_ms,
        .max_steps = FW_MAX_STEPS,
        .rx_window = FW_RX_RING - 1,
        .reset_cause = fw_board_reset_cause(),
        .boot_nonce = fw_safety_hello(request->salt),
        .settings_state = fw_settings_state(),
    };
    memcpy(reply->serial_number, fw_settings()->serial_number, sizeof reply->serial_number);
    memcpy(reply->git_id, FW_GIT_ID, sizeof FW_GIT_ID - 1);
    return WEFT_STATUS_OK;
}

static uint8_t run_status(const weft_status_request *request, weft_status_reply *reply)
{
    (void)request;
    *reply = (weft_status_reply){
        .state = fw_safety_state(),
        .safe_cause = fw_safety_cause(),
        .lights = fw_light_mask() | fw_sequence_mask(),
        .level = fw_light_level() | fw_sequence_level(), /* one of them is dark */
        .ticks = fw_board_ticks(),
        .lease_left_ms = fw_safety_lease_left_ms(),
        .on_left_ms = fw_light_left_ms(),
        .boot_nonce = fw_safety_boot_nonce(),
        .frames = fw_link_frames(),
        .crc_errors = fw_link_crc_errors(),
        .overruns = fw_link_overruns(),
        .resets = fw_board_resets(),
        .max_on_offs = fw_light_max_on_offs(),
    };
    return WEFT_STATUS_OK;
}

static uint8_t run_lease(const weft_lease_request *request, weft_lease_reply *reply)
{
    return fw_safety_lease(request->lease_ms, &reply->granted_ms);
}

static uint8_t run_light(const weft_light_request *request, weft_light_reply *reply)
{
    if (request->mask >> fw_settings()->n_lights || request->level > FW_LEVEL_MAX || request->max_on_ms == 0)
        return WEFT_STATUS_BAD_ARG;
    if (request->max_on_ms > fw_settings()->max_on_ms)
        return WEFT_STATUS_LIMIT;
    const uint8_t allowed = fw_safety_allows_light();
    if (allowed != WEFT_STATUS_OK)
        return allowed;
    if (fw_sequence_is_running())
        return WEFT_STATUS_BUSY;
    fw_sequence_forgive();
    if (!fw_light_set(request->mask, request->level, request->max_on_ms))
        return WEFT_STATUS_SAFE_LATCHED;
    reply->on_tick = fw_light_on_tick();
    return WEFT_STATUS_OK;
}

static uint8_t run_off(const weft_off_request *request, weft_off_reply *reply)
{
    (void)request;
    fw_sequence_stop();
    fw_sequence_forgive();
    fw_light_off();
    reply->off_tick = fw_light_off_tick();
    return WEFT_STATUS_OK;
}

static uint8_t run_seq_set(const weft_seq_set_request *request, weft_seq_set_reply *reply)
{
    (void)reply;
    return fw_sequence_set(request);
}

static uint8_t run_seq_run(const weft_seq_run_request *request, weft_seq_run_reply *reply)
{
    return fw_sequence_run(request, &reply->start_tick);
}

static uint8_t run_seq_abort(const weft_seq_abort_request *request, weft_seq_abort_reply *reply)
{
    (void)request;
    reply->was_running = fw_sequence_is_running();
    fw_sequence_stop();
    fw_sequence_forgive();
    fw_light_off();
    return WEFT_STATUS_OK;
}

static uint8_t run_cfg_get(const weft_cfg_get_request *request, weft_cfg_get_reply *reply)
{
    return fw_settings_get(request, reply);
}

static uint8_t run_cfg_set(const weft_cfg_set_request *request, weft_cfg_set_reply *reply)
{
    if (fw_sequence_is_running() || fw_light_mask())
        return WEFT_STATUS_BUSY;
    const uint8_t status = fw_settings_set(request, reply);
    fw_sequence_clear();
    fw_safety_host_lives(); /* it was we who did not listen */
    return status;
}

static uint8_t run_reboot(const weft_reboot_request *request, weft_reboot_reply *reply)
{
    (void)reply;
    if (request->target != 0)
        return WEFT_STATUS_BAD_ARG;
    uint16_t none;
    (void)fw_safety_lease(0, &none);
    fw_board_reboot();
    return WEFT_STATUS_OK;
}

/* Request bytes to reply bytes, one function per command. */
#define WEFT_COMMAND(opcode, NAME, name, text)                                                               \
    static uint8_t command_##name(const weft_frame *frame, uint8_t *bytes)                                   \
    {                                                                                                        \
        weft_##name##_request request;                                                                       \
        weft_##name##_reply reply;                                                                           \
        weft_##name##_request_decode(frame->payload, frame->n, &request);                                    \
        const uint8_t status = run_##name(&request, &reply);                                                 \
        if (status == WEFT_STATUS_OK)                                                                        \
            weft_##name##_reply_encode(&reply, bytes);                                                       \
        return status;                                                                                       \
    }
#include "firmware/protocol.def"

static const struct {
    uint8_t opcode, request_bytes, reply_bytes;
    uint8_t (*run)(const weft_frame *frame, uint8_t *bytes);
} commands[] = {
#define WEFT_COMMAND(opcode, NAME, name, text)                                                               \
    {opcode, WEFT_##NAME##_REQUEST_BYTES, WEFT_##NAME##_REPLY_BYTES, command_##name},
#include "firmware/protocol.def"
};

enum { N_COMMANDS = sizeof commands / sizeof commands[0] };

void fw_command_run(weft_frame *frame)
{
    uint8_t status = WEFT_STATUS_BAD_CMD, n = 0;
    for (int i = 0; i < N_COMMANDS; i++) {
        if (commands[i].opcode != frame->command)
            continue;
        status = WEFT_STATUS_BAD_ARG;
        if (frame->n >= commands[i].request_bytes)
            status = commands[i].run(frame, frame->payload + 1);
        if (status == WEFT_STATUS_OK)
            n = commands[i].reply_bytes;
    }
    frame->type = WEFT_FRAME_REPLY;
    frame->payload[0] = status;
    frame->n = (uint8_t)(n + 1);
}
