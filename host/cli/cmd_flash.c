/* weft flash: the firmware of this build into the light controller. */
#include "core/log.h"
#include "core/mem.h"
#include "core/progress.h"
#include "host/cli/board_port.h"
#include "host/cli/command.h"
#include "host/light/flash.h"

#include <stdio.h>
#include <string.h>

typedef struct flash_args {
    weft_device_options devices;
    const char *image;
    int baud;
} flash_args;

static const weft_field fields[] = {
    WEFT_RIG_FIELD(flash_args, devices),
    {.key = "port",
     .type = WEFT_FIELD_TEXT,
     .offset = offsetof(flash_args, devices) + offsetof(weft_device_options, port),
     .unit = "TTY",
     .help = "serial line of the board (else the rig's, else the only Arduino on USB)"},
    {.key = "image",
     .type = WEFT_FIELD_TEXT,
     .offset = offsetof(flash_args, image),
     .unit = "HEX",
     .help = "another firmware of a Weft light controller (default: the one of this build)"},
    {.key = "baud",
     .type = WEFT_FIELD_INT,
     .offset = offsetof(flash_args, baud),
     .min = 0,
     .max = 921600,
     .help = "rate of the bootloader (0: 115200, then 57600)"},
    {0},
};

typedef struct flashing {
    char port[256];
    weft_flash_image image;
    bool was_known;
    weft_flash_board before, now;
    int baud;
    double seconds;
    char changes[256];
} flashing;

/* What is on the board.  One that is empty or runs something else is no reason not to flash it. */
static weft_err look_before(flashing *f, weft_error *err)
{
    weft_error why = {0};
    const weft_err status = weft_flash_board_read(f->port, &f->before, &why);
    f->was_known = status == WEFT_OK;
    if (status == WEFT_OK)
        return WEFT_OK;
    if (status != WEFT_ERR_TIMEOUT && status != WEFT_ERR_PROTOCOL)
        return weft_fail(err, status, "%s", why.text);
    weft_explain("before flashing: %s", why.text);
    return WEFT_OK;
}

static weft_err look_after(flashing *f, weft_error *err)
{
    const weft_err status = weft_flash_board_read(f->port, &f->now, err);
    if (status != WEFT_OK)
        return weft_prefix(err, status,
                           "written and verified, but the new firmware does not answer; try again");
    if (strcmp(f->now.info.firmware, f->image.firmware) != 0 ||
        strcmp(f->now.info.git_id, f->image.git_id) != 0)
        return weft_fail(
            err, WEFT_ERR_DEVICE,
            "%s: the board says that it runs %s (%s), not %s (%s) of the image; unplug it, plug it in and "
            "run \"weft flash\" again",
            f->port, f->now.info.firmware, f->now.info.git_id, f->image.firmware, f->image.git_id);
    return WEFT_OK;
}

/* "serial:WL-00042" is for a board that answers: its port is what avrdude wants. */
static weft_err find_by_number(flashing *f, weft_error *err)
{
    if (strncmp(f->port, "serial:", 7) != 0)
        return WEFT_OK;
    WEFT_TRY(weft_flash_board_read(f->port, &f->before, err));
    snprintf(f->port, sizeof f->port, "%s", f->before.info.port);
    return WEFT_OK;
}

/* -- telling -------------------------------------------------------------------------------------------- */

static const char *settings_word(const flashing *f)
{
    if (!f->now.has_settings)
        return "unreadable";
    if (!f->was_known || !f->before.has_settings)
        return "unknown before";
    return f->changes[0] ? "changed" : "kept";
}

static json_t *board_to_json(const weft_flash_board *b)
{
    return json_pack("{s:s, s:s, s:[ii], s:s, s:s}", "firmware", b->info.firmware, "git", b->info.git_id,
                     "protocol", b->info.protocol_major, b->info.protocol_minor, "serial",
                     b->info.serial_number, "settings", b->info.settings);
}

static weft_err print_result(const weft_invocation *inv, const flashing *f, weft_error *err)
{
    const weft_flash_board *const now = &f->now;
    if (inv->json)
        return weft_print_json(inv,
                               json_pack("{s:s, s:s, s:i, s:i, s:f, s:o, s:o, s:s}", "port", f->port, "image",
                                         f->image.path, "bytes", (int)f->image.bytes, "baud", f->baud,
                                         "seconds", f->seconds, "before",
                                         f->was_known ? board_to_json(&f->before) : json_null(), "now",
                                         board_to_json(now), "settings", settings_word(f)),
                               err);
    fprintf(inv->out, "port      %s\nimage     %s\n", f->port, f->image.path);
    fprintf(inv->out, "flashed   %u bytes in %.1f s at %d baud, verified\n", (unsigned)f->image.bytes,
            f->seconds, f->baud);
    if (f->was_known)
        fprintf(inv->out, "firmware  %s (%s) -> %s (%s)\n", f->before.info.firmware, f->before.info.git_id,
                now->info.firmware, now->info.git_id);
    else
        fprintf(inv->out, "firmware  none that is known -> %s (%s)\n", now->info.firmware, now->info.git_id);
    fprintf(inv->out, "settings  %s", settings_word(f));
    if (now->has_settings)
        fprintf(inv->out, ": serial %s, %d lights, at most %d ms", now->serial[0] ? now->serial : "(none)",
                now->n_lights, now->max_on_ms);
    fputc('\n', inv->out);
    return WEFT_OK;
}

/* -- the whole ------------------------------------------------------------------------------------------ */

static weft_err flash(const weft_invocation *inv, const flash_args *args, flashing *f, weft_error *err)
{
    weft_device_names names;
    char avrdude[PATH_MAX];
    WEFT_TRY(weft_device_options_resolve(&args->devices, &names, err));
    WEFT_TRY(weft_flash_image_load(args->image, &f->image, err));
    WEFT_TRY(weft_flash_find_avrdude(avrdude, err));
    WEFT_TRY(weft_board_port_choose(&names, f->port, err));
    WEFT_TRY(find_by_number(f, err));
    WEFT_TRY(weft_flash_check_free(f->port, err));
    WEFT_TRY(look_before(f, err));
    const double begin_s = weft_clock_s();
    WEFT_TRY(weft_flash_write(f->port, &f->image, args->baud, &f->baud, err));
    f->seconds = weft_clock_s() - begin_s;
    WEFT_TRY(look_after(f, err));
    if (f->was_known && f->before.has_settings && f->now.has_settings)
        (void)weft_flash_board_compare(&f->before, &f->now, f->changes);
    WEFT_TRY(print_result(inv, f, err));
    if (f->changes[0])
        return weft_fail(err, WEFT_ERR_DEVICE,
                         "%s: settings changed: %s; set them again with \"weft light set\"", f->port,
                         f->changes);
    return WEFT_OK;
}

static weft_err run(const weft_invocation *inv, const void *args, weft_error *err)
{
    flashing *const f = weft_alloc(1, sizeof *f, err);
    if (!f)
        return WEFT_ERR_NOMEM;
    const weft_err status = flash(inv, args, f, err);
    weft_free(f);
    return status;
}

const weft_command weft_cmd_flash = {
    .name = "flash",
    .summary = "program the light controller with the firmware of this build",
    .operands = "",
    .args_size = sizeof(flash_args),
    .fields = fields,
    .details =
        "Calls avrdude, which talks to the bootloader of the board and verifies what it wrote; then asks "
        "the\n"
        "new firmware who it is.  The settings in the EEPROM stay.  An empty board is fine, and so is one\n"
        "whose last flashing was broken off.  A port that another program has open is refused.",
    .example = "weft flash --port /dev/ttyACM0",
    .run = run,
};
