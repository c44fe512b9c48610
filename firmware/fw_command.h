/** The commands of protocol.def: from a request to its reply. */
#ifndef WEFT_FIRMWARE_FW_COMMAND_H
#define WEFT_FIRMWARE_FW_COMMAND_H

#include "firmware/protocol.h"

/** Runs the request in `frame` and turns the frame into its reply.  A request that is longer than known is
 *  run by the fields that are known (a newer minor version); a shorter one is a WEFT_STATUS_BAD_ARG. */
void fw_command_run(weft_frame *frame);

#endif
