/* Checks of the light controller, from its plug to its counters. */
#include "core/progress.h"
#include "host/cli/board_port.h"
#include "host/cli/device_open.h"
#include "host/cli/doctor.h"
#include "host/light/flash_image.h"
#include "host/light/port_owner.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static void fail(weft_doctor_result *result, const weft_error *why)
{
    weft_doctor_say(result, WEFT_DOCTOR_FAILED, NULL, "%s", why->text);
}

static void skip(weft_doctor_result *result, const char *what)
{
    weft_doctor_say(result, WEFT_DOCTOR_SKIPPED, NULL, "%s", what);
}

/* -- the port ------------------------------------------------------------------------------------------- */

void weft_doctor_board(weft_doctor *doctor, weft_doctor_result *result)
{
    weft_error why = {0};
    if (weft_board_port_choose(&doctor->names, doctor->port, &why) != WEFT_OK) {
        doctor->port[0] = '\0';
        fail(result, &why);
    } else {
        weft_doctor_say(result, WEFT_DOCTOR_OK, NULL, "%s", doctor->port);
    }
}

void weft_doctor_permission(weft_doctor *doctor, weft_doctor_result *result)
{
    if (!doctor->port[0])
        skip(result, "no port");
    else if (strncmp(doctor->port, "serial:", 7) == 0)
        skip(result, "the board is looked for by its number");
    else if (access(doctor->port, F_OK) != 0)
        weft_doctor_say(result, WEFT_DOCTOR_FAILED, "is the light controller plugged in?",
                        "%s: there is no such port", doctor->port);
    else if (access(doctor->port, R_OK | W_OK) != 0)
        weft_doctor_say(result, WEFT_DOCTOR_FAILED,
                        "install udev/70-weft.rules, or sudo usermod -aG dialout $USER and log in again",
                        "you may not read and write %s", doctor->port);
    else
        weft_doctor_say(result, WEFT_DOCTOR_OK, NULL, "you may read and write %s", doctor->port);
    doctor->port_is_free = result->verdict == WEFT_DOCTOR_OK || strncmp(doctor->port, "serial:", 7) == 0;
}

void weft_doctor_other_owner(weft_doctor *doctor, weft_doctor_result *result)
{
    weft_error why = {0};
    weft_port_user user;
    int reservation;
    if (!doctor->port_is_free) {
        skip(result, "no port that may be opened");
        return;
    }
    if (weft_port_reserve(doctor->port, &reservation, &why) != WEFT_OK) {
        fail(result, &why);
    } else if (weft_port_find_user(doctor->port, &user)) {
        (void)weft_port_fail_used(doctor->port, &user, &why);
        fail(result, &why);
        if (strcmp(user.name, "ModemManager") == 0)
            weft_doctor_say(result, WEFT_DOCTOR_FAILED, "install udev/70-weft.rules, which keeps it away",
                            "ModemManager has %s open", doctor->port);
    } else {
        weft_doctor_say(result, WEFT_DOCTOR_OK, NULL, "nobody else has the port open");
    }
    if (reservation >= 0)
        close(reservation);
    doctor->port_is_free = result->verdict == WEFT_DOCTOR_OK;
}

/* -- the board ------------------------------------------------------------------------------------------ */

void weft_doctor_controller(weft_doctor *doctor, weft_doctor_result *result)
{
    weft_error why = {0};
    if (!doctor->port_is_free) {
        skip(result, "no port that may be opened");
        return;
    }
    weft_device_names names = doctor->names;
    memcpy(names.port, doctor->port, sizeof names.port);
    if (weft_device_open_controller(&names, &doctor->controller, &why) != WEFT_OK) {
        fail(result, &why);
        return;
    }
    doctor->info = *weft_controller_get_info(doctor->controller);
    weft_doctor_say(result, WEFT_DOCTOR_OK, NULL, "%s answers on %s at %d baud, %d lights",
                    doctor->info.serial_number[0] ? doctor->info.serial_number
                                                  : "a board without a serial number",
                    doctor->info.port, doctor->info.baud, doctor->info.n_lights);
}

/* "1.10.0" is newer than "1.9.2": number by number. */
static int compare_versions(const char *a, const char *b)
{
    for (;;) {
        char *a_end, *b_end;
        const long x = strtol(a, &a_end, 10), y = strtol(b, &b_end, 10);
        if (x != y || *a_end != '.' || *b_end != '.')
            return (x > y) - (x < y);
        a = a_end + 1;
        b = b_end + 1;
    }
}

void weft_doctor_firmware(weft_doctor *doctor, weft_doctor_result *result)
{
    weft_flash_image image;
    if (!doctor->controller) {
        skip(result, "no controller answers");
        return;
    }
    if (weft_flash_image_load(NULL, &image, NULL) != WEFT_OK) {
        skip(result, "no image to compare it with");
        return;
    }
    const weft_controller_info *const info = &doctor->info;
    const int order = compare_versions(info->firmware, image.firmware);
    if (order < 0)
        weft_doctor_say(result, WEFT_DOCTOR_FAILED, "weft flash",
                        "%s (%s) is older than the %s that this build ships", info->firmware, info->git_id,
                        image.firmware);
    else if (order > 0)
        weft_doctor_say(result, WEFT_DOCTOR_WARNING, "a newer Weft, or weft flash to go back",
                        "%s (%s) is newer than the %s that this build ships", info->firmware, info->git_id,
                        image.firmware);
    else
        weft_doctor_say(result, WEFT_DOCTOR_OK, NULL, "%s (%s), the version that this build ships",
                        info->firmware, info->git_id);
}

void weft_doctor_settings(weft_doctor *doctor, weft_doctor_result *result)
{
    const weft_controller_info *const info = &doctor->info;
    if (!doctor->controller)
        skip(result, "no controller answers");
    else if (!(info->capabilities & WEFT_CAPABILITY_SETTINGS))
        weft_doctor_say(result, WEFT_DOCTOR_WARNING, "weft flash", "this firmware keeps none");
    else if (strcmp(info->settings, "UNREADABLE") == 0)
        weft_doctor_say(result, WEFT_DOCTOR_FAILED, "weft light set defaults, then set them again",
                        "what the EEPROM holds is of another version or damaged; built-in ones are used");
    else if (!info->serial_number[0])
        weft_doctor_say(result, WEFT_DOCTOR_WARNING, "weft light set serial WL-00001",
                        "no serial number: a board that was replugged is not known again among others");
    else
        weft_doctor_say(result, WEFT_DOCTOR_OK, NULL, "serial %s, %d lights, at most %d ms at a time",
                        info->serial_number, info->n_lights, info->max_on_ms);
}

void weft_doctor_last_start(weft_doctor *doctor, weft_doctor_result *result)
{
    const char *const cause = doctor->info.reset_cause;
    if (!doctor->controller)
        skip(result, "no controller answers");
    else if (strcmp(cause, "WATCHDOG") == 0)
        weft_doctor_say(result, WEFT_DOCTOR_FAILED,
                        "weft flash; if it stays so, report it with the sequence that ran",
                        "%s: the firmware had hung", cause);
    else if (strcmp(cause, "BROWN_OUT") == 0)
        weft_doctor_say(result, WEFT_DOCTOR_FAILED,
                        "a better USB cable or socket; the LEDs' 12 V must not come from the Arduino",
                        "%s: the board's supply had broken down", cause);
    else
        weft_doctor_say(result, WEFT_DOCTOR_OK, NULL, "%s", cause);
}

enum { N_QUESTIONS = 200 };

static int by_size(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static weft_err ask_often(weft_controller *c, double ms[N_QUESTIONS], weft_controller_status *status,
                          weft_error *err)
{
    for (int i = 0; i < N_QUESTIONS; i++) {
        const double begin_s = weft_clock_s();
        WEFT_TRY(weft_controller_get_status(c, status, err));
        ms[i] = 1e3 * (weft_clock_s() - begin_s);
    }
    qsort(ms, N_QUESTIONS, sizeof ms[0], by_size);
    return WEFT_OK;
}

void weft_doctor_serial_line(weft_doctor *doctor, weft_doctor_result *result)
{
    weft_error why = {0};
    weft_controller_status first, s;
    double ms[N_QUESTIONS];
    if (!doctor->controller) {
        skip(result, "no controller answers");
        return;
    }
    weft_err status = weft_controller_get_status(doctor->controller, &first, &why);
    if (status == WEFT_OK)
        status = ask_often(doctor->controller, ms, &s, &why);
    weft_controller_close(doctor->controller);
    doctor->controller = NULL;
    if (status != WEFT_OK) {
        fail(result, &why);
        return;
    }
    const unsigned damaged = s.crc_errors - first.crc_errors + (s.bad_replies - first.bad_replies);
    const unsigned lost = s.overruns - first.overruns, again = s.retries - first.retries;
    const bool bad = damaged + lost > 0 || again >= N_QUESTIONS / 50;
    const bool late =
        !bad && again > 0; /* one answer that came late: a busy computer more likely than a cable */
    weft_doctor_say(result,
                    bad    ? WEFT_DOCTOR_FAILED
                    : late ? WEFT_DOCTOR_WARNING
                           : WEFT_DOCTOR_OK,
                    bad ? "a shorter or better USB cable, away from the LEDs' supply; no hub between"
                    : late
                        ? "run it again while the computer does nothing else; if it stays, another USB cable"
                        : NULL,
                    "%d questions: %u damaged, %u bytes lost, %u asked again; answers in %.2f ms (median), "
                    "%.2f ms (99 %%)",
                    N_QUESTIONS, damaged, lost, again, ms[N_QUESTIONS / 2], ms[N_QUESTIONS * 99 / 100]);
}
