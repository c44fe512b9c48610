/* Opening a light controller by its port or its serial number, and finding it again. */
#include "core/log.h"
#include "core/mem.h"
#include "core/progress.h"
#include "host/light/controller_crash.h"
#include "host/light/controller_private.h"

#include <stdio.h>
#include <string.h>
#include <sys/random.h>
#include <time.h>

static const double hello_every_s = 0.2, hello_within_s = 3; /* an Uno's bootloader takes up to 1.5 s */
enum { usual_rate = 500000, fallback_rate = 38400 };

/* -- shaking hands -------------------------------------------------------------------------------------- */

static weft_err nobody_there(const weft_controller *c, weft_error *err)
{
    if (c->n_bytes == 0)
        return weft_fail(err, WEFT_ERR_TIMEOUT,
                         "%s: nobody answers within %.0f s; is this the light controller, and has it the "
                         "Weft firmware (\"weft flash\" brings it)?",
                         c->serial.name, hello_within_s);
    return weft_fail(err, WEFT_ERR_PROTOCOL,
                     "%s: something answers, but it is no Weft light controller (bytes without sense: %zu); "
                     "try another port, or flash the firmware (weft flash)",
                     c->serial.name, c->n_bytes);
}

static weft_err other_version(const weft_controller *c, int major, weft_error *err)
{
    return weft_fail(err, WEFT_ERR_PROTOCOL,
                     "%s: the light controller speaks protocol %d, this program %d; flash the firmware of "
                     "this build (weft flash)",
                     c->serial.name, major, WEFT_PROTOCOL_MAJOR);
}

/* The rate of the next try.  A board that has just been reset is in its bootloader, for up to 1.5 s: until
 * then there is no reason to doubt the usual rate. */
static int rate_of_try(int i)
{
    return i * hello_every_s < 1.6 || i % 2 == 0 ? usual_rate : fallback_rate;
}

/* One HELLO and its reply; *got is false when none came. */
static weft_err try_hello(weft_controller *c, const uint8_t *wire, uint8_t length, weft_hello_reply *hello,
                          bool *got, weft_error *err)
{
    weft_frame reply;
    const double deadline_s = weft_clock_s() + hello_every_s;
    WEFT_TRY(weft_serial_write(&c->serial, wire, length, deadline_s, err));
    WEFT_TRY(weft_controller_next_reply(c, c->seq, WEFT_CMD_HELLO, deadline_s, &reply, got, err));
    *got = *got && reply.payload[0] != WEFT_STATUS_BAD_CRC;
    if (!*got)
        return WEFT_OK;
    if (reply.version != WEFT_PROTOCOL_MAJOR)
        return other_version(c, reply.version, err);
    if (reply.payload[0] != WEFT_STATUS_OK)
        return weft_controller_refused(c, WEFT_CMD_HELLO, reply.payload[0], err);
    weft_hello_reply_decode(reply.payload + 1, (uint8_t)(reply.n - 1), hello);
    if (hello->magic != WEFT_PROTOCOL_MAGIC)
        return nobody_there(c, err);
    if (hello->proto_major != WEFT_PROTOCOL_MAJOR)
        return other_version(c, hello->proto_major, err);
    return WEFT_OK;
}

/* HELLO until there is an answer, or it is clear that none will come. */
static weft_err say_hello(weft_controller *c, weft_hello_reply *hello, weft_error *err)
{
    weft_hello_request request = {.proto_major = WEFT_PROTOCOL_MAJOR, .proto_minor = WEFT_PROTOCOL_MINOR};
    uint8_t payload[WEFT_HELLO_REQUEST_BYTES], wire[1 + WEFT_FRAME_WIRE_MAX];
    if (getrandom(&request.salt, sizeof request.salt, 0) != sizeof request.salt)
        request.salt = (uint32_t)(1e6 * weft_clock_s());
    c->seq = (uint8_t)request.salt; /* not the last program's number again */
    weft_hello_request_encode(&request, payload);
    wire[0] = 0; /* ends whatever a modem probe or an old program left half-said */
    const uint8_t length =
        (uint8_t)(1 + weft_controller_encode(c, WEFT_CMD_HELLO, payload, sizeof payload, wire + 1));
    const double end_s = weft_clock_s() + hello_within_s;
    for (int i = 0; weft_clock_s() < end_s; i++) {
        bool got = false;
        if (weft_cancelled())
            return weft_fail(err, WEFT_ERR_CANCELLED, "cancelled");
        WEFT_TRY(weft_serial_set_rate(&c->serial, rate_of_try(i), err));
        WEFT_TRY(try_hello(c, wire, length, hello, &got, err));
        if (got)
            return WEFT_OK;
    }
    return nobody_there(c, err);
}

static void fill_info(weft_controller *c, const weft_hello_reply *hello)
{
    weft_controller_info *const info = &c->info;
    *info = (weft_controller_info){
        .protocol_major = hello->proto_major,
        .protocol_minor = hello->proto_minor,
        .n_lights = hello->n_lights,
        .level_max = hello->level_max,
        .max_on_ms = hello->max_on_ms,
        .tick_hz = hello->tick_hz,
        .boot_nonce = hello->boot_nonce,
        .baud = c->serial.rate,
        .capabilities = hello->capabilities,
        .max_steps = hello->max_steps,
        .settings = weft_protocol_settings_name(hello->settings_state),
    };
    snprintf(info->port, sizeof info->port, "%s", c->serial.name);
    snprintf(info->firmware, sizeof info->firmware, "%d.%d.%d", hello->fw_version[0], hello->fw_version[1],
             hello->fw_version[2]);
    snprintf(info->git_id, sizeof info->git_id, "%.*s", (int)sizeof hello->git_id,
             (const char *)hello->git_id);
    snprintf(info->serial_number, sizeof info->serial_number, "%.*s", (int)sizeof hello->serial_number,
             (const char *)hello->serial_number);
    snprintf(info->reset_cause, sizeof info->reset_cause, "%s", weft_protocol_reset_name(hello->reset_cause));
}

static weft_err take_lease(weft_controller *c, int lease_ms, weft_error *err)
{
    const weft_lease_request request = {.lease_ms = (uint16_t)lease_ms};
    uint8_t payload[WEFT_LEASE_REQUEST_BYTES];
    weft_frame reply;
    weft_lease_request_encode(&request, payload);
    return weft_controller_command(c, WEFT_CMD_LEASE, payload, sizeof payload, WEFT_LEASE_REPLY_BYTES, &reply,
                                   err);
}

/* Opens the port and shakes hands; the port is closed when it fails. */
static weft_err meet(weft_controller *c, const char *port, weft_error *err)
{
    weft_hello_reply hello = {0};
    c->n = c->unread_at = c->unread_n = c->n_bytes = 0;
    c->too_long = false;
    c->n_events = 0;
    weft_err status = weft_serial_open(&c->serial, port, err);
    if (status == WEFT_OK)
        status = say_hello(c, &hello, err);
    if (status == WEFT_OK)
        fill_info(c, &hello);
    else
        weft_serial_close(&c->serial);
    return status;
}

/* -- by number ------------------------------------------------------------------------------------------ */

static const char by_number[] = "serial:";

/* The first port with the board of this number; without a number, the only port there is, with a board that
 * has none either.  *found is false when it is not (yet) there; only a cancellation is an error. */
static weft_err look_for(weft_controller *c, const char *number, bool *found, weft_error *err)
{
    char **ports = NULL;
    int n = 0;
    *found = false;
    WEFT_TRY(weft_controller_list_ports_under(c->dev, &ports, err));
    while (ports[n])
        n++;
    weft_err status = WEFT_OK;
    for (int i = 0; i < n && !*found && status == WEFT_OK && (number[0] || n == 1); i++) {
        weft_error why = {0};
        status = meet(c, ports[i], &why);
        if (status == WEFT_OK)
            *found = strcmp(c->info.serial_number, number) == 0;
        else
            weft_explain("not the light controller: %s", why.text);
        if (!*found)
            weft_serial_close(&c->serial);
        if (status == WEFT_ERR_CANCELLED && err)
            *err = why;
        else
            status = WEFT_OK;
    }
    weft_controller_free_ports(ports);
    return status;
}

static weft_err open_by_number(weft_controller *c, const char *number, weft_error *err)
{
    bool found;
    if (!number[0] || strlen(number) >= sizeof c->info.serial_number)
        return weft_fail(err, WEFT_ERR_USAGE,
                         "serial:%s: wanted the number of a light controller, 1 to 8 letters", number);
    WEFT_TRY(look_for(c, number, &found, err));
    if (!found)
        return weft_fail(
            err, WEFT_ERR_MISSING,
            "no light controller with the serial number %s was found under %s; check its cable, and "
            "with \"weft devices\" its number",
            number, c->dev);
    return WEFT_OK;
}

weft_err weft_controller_open_under(const char *dev, const char *port, int lease_ms,
                                    weft_controller **controller, weft_error *err)
{
    if (lease_ms < 100 || lease_ms > 5000)
        return weft_fail(err, WEFT_ERR_RANGE, "a lease of %d ms: wanted 100 to 5000", lease_ms);
    weft_controller *const c = weft_alloc(1, sizeof *c, err);
    if (!c)
        return WEFT_ERR_NOMEM;
    c->serial.fd = c->serial.reservation = -1;
    c->lease_ms = lease_ms;
    snprintf(c->dev, sizeof c->dev, "%s", dev);
    const bool has_number = strncmp(port, by_number, sizeof by_number - 1) == 0;
    weft_err status = has_number ? open_by_number(c, port + sizeof by_number - 1, err) : meet(c, port, err);
    if (status == WEFT_OK)
        status = take_lease(c, lease_ms, err);
    if (status == WEFT_OK) {
        weft_explain("%s: light controller %s, firmware %s (%s), %d lights, %d baud, last start: %s",
                     c->serial.name, c->info.serial_number[0] ? c->info.serial_number : "without a number",
                     c->info.firmware, c->info.git_id, c->info.n_lights, c->info.baud, c->info.reset_cause);
        *controller = c;
    } else {
        weft_serial_close(&c->serial);
        weft_free(c);
    }
    return status;
}

weft_err weft_controller_open(const char *port, int lease_ms, weft_controller **controller, weft_error *err)
{
    return weft_controller_open_under("/dev", port, lease_ms, controller, err);
}

/* -- and again ------------------------------------------------------------------------------------------ */

static weft_err not_back(const weft_controller *c, const weft_controller_info *before, double timeout_s,
                         weft_error *err)
{
    if (before->serial_number[0])
        return weft_fail(
            err, WEFT_ERR_DEVICE,
            "%s: the light controller %s has vanished and did not come back within %g s; its lights are "
            "off; plug it in and begin again",
            before->port, before->serial_number, timeout_s);
    return weft_fail(
        err, WEFT_ERR_DEVICE,
        "%s: the light controller has vanished; it has no serial number, so that it is known again only "
        "as the one serial port under %s, and that was not so within %g s; \"weft light set serial\" "
        "gives it one",
        before->port, c->dev, timeout_s);
}

weft_err weft_controller_reopen(weft_controller *c, double timeout_s, weft_error *err)
{
    const weft_controller_info before = c->info;
    const bool watched = weft_controller_forget_crash(c->serial.fd);
    const double end_s = weft_clock_s() + timeout_s;
    bool found = false;
    weft_serial_close(&c->serial);
    while (!found) {
        WEFT_TRY(look_for(c, before.serial_number, &found, err));
        if (!found && weft_clock_s() > end_s)
            break;
        if (!found)
            nanosleep(&(struct timespec){.tv_nsec = 100000000}, NULL);
        if (weft_cancelled())
            return weft_fail(err, WEFT_ERR_CANCELLED, "cancelled; the lights are off");
    }
    if (!found) {
        c->serial.gone = true;
        c->info = before;
        return not_back(c, &before, timeout_s, err);
    }
    WEFT_TRY(take_lease(c, c->lease_ms, err));
    if (watched)
        weft_controller_watch_crash(c->serial.fd);
    if (c->info.n_lights != before.n_lights || c->info.level_max != before.level_max)
        return weft_fail(err, WEFT_ERR_DEVICE,
                         "%s: the light controller came back with other settings; begin again", c->info.port);
    weft_note("the light controller%s%s is back on %s", before.serial_number[0] ? " " : "",
              c->info.serial_number, c->info.port);
    return WEFT_OK;
}

/* -- closing -------------------------------------------------------------------------------------------- */

void weft_controller_close(weft_controller *c)
{
    if (!c)
        return;
    static const uint8_t panic[WEFT_PANIC_ZEROS];
    if (take_lease(c, 0, NULL) != WEFT_OK)
        (void)weft_serial_write(&c->serial, panic, sizeof panic, weft_clock_s() + 0.1, NULL);
    weft_controller_forget_crash(c->serial.fd);
    weft_serial_close(&c->serial);
    weft_free(c);
}
