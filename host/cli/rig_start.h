/** Waiting for a virtual scanner that has just been started: `weft rig --dir r & weft capture twill.set --rig
 * r`. */
#ifndef WEFT_HOST_CLI_RIG_START_H
#define WEFT_HOST_CLI_RIG_START_H

#include "core/error.h"

/**
 * Waits until the scanner of a folder is ready, that is until DIR/rig.json is there.  A scanner opens
 * DIR/control.sock first and writes rig.json when it has rendered its sample, seconds later: while the socket
 * is held this waits, and where there is none it waits half a second, for a process that is only beginning.
 *
 * @return WEFT_ERR_CANCELLED by Ctrl-C; else WEFT_OK, also when no scanner came: the caller finds no rig.json
 */
weft_err weft_rig_start_wait(const char *folder, weft_error *err);

#endif
