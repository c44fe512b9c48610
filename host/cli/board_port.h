/** Which serial port has the board, for commands that must not touch another device by mistake. */
#ifndef WEFT_HOST_CLI_BOARD_PORT_H
#define WEFT_HOST_CLI_BOARD_PORT_H

#include "host/cli/device_options.h"

/**
 * names->port when it was given, else the only Arduino on USB: other serial ports are not tried.
 *
 * @return WEFT_ERR_MISSING when there is none, or one that the kernel gives no serial port, or several, each
 * with what to do
 */
weft_err weft_board_port_choose(const weft_device_names *names, char port[256], weft_error *err);

#endif
