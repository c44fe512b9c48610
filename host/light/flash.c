/* The board before and after: what it is, what its EEPROM holds, and whose its port is. */
#include "host/light/flash.h"

#include "host/light/port_owner.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { LEASE_MS = 1000 };

/* -- settings ------------------------------------------------------------------------------------------- */

static weft_err read_number(weft_controller *c, int key, int index, int *number, weft_error *err)
{
    uint8_t value[8];
    WEFT_TRY(weft_controller_get_setting(c, key, index, value, err));
    *number = value[0] | value[1] << 8;
    return WEFT_OK;
}

static weft_err read_settings(weft_controller *c, weft_flash_board *board, weft_error *err)
{
    uint8_t value[8];
    WEFT_TRY(weft_controller_get_setting(c, WEFT_KEY_SERIAL_NUMBER, 0, value, err));
    memcpy(board->serial, value, sizeof value);
    WEFT_TRY(read_number(c, WEFT_KEY_N_LIGHTS, 0, &board->n_lights, err));
    WEFT_TRY(read_number(c, WEFT_KEY_MAX_ON, 0, &board->max_on_ms, err));
    for (int i = 0; i < 10; i++)
        WEFT_TRY(read_number(c, WEFT_KEY_TRIM, i, &board->trims[i], err));
    board->has_settings = true;
    return WEFT_OK;
}

weft_err weft_flash_board_read(const char *port, weft_flash_board *board, weft_error *err)
{
    weft_controller *c = NULL;
    WEFT_TRY(weft_controller_open(port, LEASE_MS, &c, err));
    *board = (weft_flash_board){.info = *weft_controller_get_info(c)};
    weft_err status = WEFT_OK;
    if (board->info.capabilities & WEFT_CAPABILITY_SETTINGS &&
        strcmp(board->info.settings, "UNREADABLE") != 0)
        status = read_settings(c, board, err);
    weft_controller_close(c);
    return status;
}

static int compare_number(const char *name, int before, int after, char text[256])
{
    const size_t used = strlen(text);
    if (before == after)
        return 0;
    snprintf(text + used, 256 - used, "%s%s %d -> %d", used ? ", " : "", name, before, after);
    return 1;
}

int weft_flash_board_compare(const weft_flash_board *before, const weft_flash_board *after, char text[256])
{
    int n = 0;
    text[0] = '\0';
    if (strcmp(before->serial, after->serial) != 0) {
        snprintf(text, 256, "serial %s -> %s", before->serial[0] ? before->serial : "(none)",
                 after->serial[0] ? after->serial : "(none)");
        n++;
    }
    n += compare_number("lights", before->n_lights, after->n_lights, text);
    n += compare_number("max-on", before->max_on_ms, after->max_on_ms, text);
    for (int i = 0; i < 10; i++) {
        char name[16];
        snprintf(name, sizeof name, "trim-%d", i);
        n += compare_number(name, before->trims[i], after->trims[i], text);
    }
    return n;
}

/* -- whose the port is ---------------------------------------------------------------------------------- */

weft_err weft_flash_check_free(const char *port, weft_error *err)
{
    weft_port_user user;
    int reservation;
    WEFT_TRY(weft_port_reserve(port, &reservation, err));
    if (reservation >= 0)
        close(reservation);
    if (weft_port_find_user(port, &user))
        return weft_port_fail_used(port, &user, err);
    return WEFT_OK;
}

/* -- avrdude -------------------------------------------------------------------------------------------- */

weft_err weft_flash_find_avrdude(char path[PATH_MAX], weft_error *err)
{
    const char *const all = getenv("PATH");
    for (const char *p = all ? all : "/usr/local/bin:/usr/bin:/bin"; *p;) {
        const size_t n = strcspn(p, ":");
        if (n > 0 && snprintf(path, PATH_MAX, "%.*s/avrdude", (int)n, p) < PATH_MAX &&
            access(path, X_OK) == 0)
            return WEFT_OK;
        p += n + (p[n] == ':');
    }
    return weft_fail(err, WEFT_ERR_MISSING,
                     "avrdude, which programs the board, is not installed: sudo apt install avrdude");
}
