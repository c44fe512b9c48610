/** Running a command in the daemon, which owns the scanner, as if it ran here. */
#ifndef WEFT_HOST_CLI_REMOTE_H
#define WEFT_HOST_CLI_REMOTE_H

#include "host/cli/command.h"

/**
 * Whether the command goes through a daemon: it needs the scanner, and a daemon runs.
 *
 * @param socket  gets where
 * @return WEFT_ERR_DEVICE when WEFT_SOCKET names a daemon that does not answer
 */
weft_err weft_remote_wanted(const weft_command *command, char socket[108], bool *wanted, weft_error *err);

/**
 * Has the daemon run it, prints what it prints, shows its progress, cancels it on Ctrl-C.
 *
 * @param argc, argv   the words behind the command's name, already known to be good
 * @param exit_status  gets that of the command
 */
weft_err weft_remote_run(const weft_command *command, int argc, char *const *argv, const weft_invocation *inv,
                         const char *socket, int *exit_status, weft_error *err);

#endif
