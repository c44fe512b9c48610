#include "host/cli/board_port.h"

#include "host/light/controller.h"
#include "host/light/usb_boards.h"

#include <stdio.h>
#include <string.h>

enum { MAX_BOARDS = 16 };

static weft_err several(const weft_usb_board *boards, int n, weft_error *err)
{
    char list[600] = "";
    int with_port = 0;
    for (int i = 0; i < n; i++) {
        const size_t used = strlen(list);
        if (!boards[i].port[0])
            continue;
        with_port++;
        snprintf(list + used, sizeof list - used, "%s%s (%s%s%s)", used ? ", " : "", boards[i].port,
                 boards[i].id->name, boards[i].serial[0] ? ", serial " : "", boards[i].serial);
    }
    return weft_fail(err, WEFT_ERR_MISSING, "there are %d boards: choose with --port: %s", with_port, list);
}

static weft_err portless(const weft_usb_board *board, weft_error *err)
{
    return weft_fail(
        err, WEFT_ERR_MISSING,
        "the %s (%04x:%04x, %s) is on USB but has no serial port: its driver is missing or brltty "
        "holds it; sudo apt remove brltty, or sudo modprobe %s, then plug it in again",
        board->id->name, board->id->vendor, board->id->product, board->place,
        board->id->vendor == 0x1a86 ? "ch341" : "cdc_acm");
}

static weft_err none(weft_error *err)
{
    char **ports = NULL, list[600] = "";
    WEFT_TRY(weft_controller_list_ports(&ports, err));
    for (int i = 0; ports[i]; i++) {
        const size_t used = strlen(list);
        snprintf(list + used, sizeof list - used, "%s%s", used ? ", " : "", ports[i]);
    }
    weft_controller_free_ports(ports);
    if (list[0])
        return weft_fail(err, WEFT_ERR_MISSING,
                         "no Arduino was found on USB; if one of these is the light controller, name it with "
                         "--port: %s",
                         list);
    return weft_fail(
        err, WEFT_ERR_MISSING,
        "no Arduino was found on USB; plug it in (a cable that only charges will not do) or name its "
        "port with --port");
}

weft_err weft_board_port_choose(const weft_device_names *names, char port[256], weft_error *err)
{
    weft_usb_board boards[MAX_BOARDS];
    int n = 0, with_port = 0, which = 0;
    if (names->port[0]) {
        snprintf(port, 256, "%s", names->port);
        return WEFT_OK;
    }
    WEFT_TRY(weft_usb_boards_list(boards, MAX_BOARDS, &n, err));
    for (int i = 0; i < n; i++)
        if (boards[i].port[0]) {
            with_port++;
            which = i;
        }
    if (with_port > 1)
        return several(boards, n, err);
    if (n == 0)
        return none(err);
    if (with_port == 0)
        return portless(&boards[0], err);
    snprintf(port, 256, "%s", boards[which].port);
    return WEFT_OK;
}
