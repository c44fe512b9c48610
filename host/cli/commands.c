#include "host/cli/command.h"

/* In the order of the help: the way of the data, from the lights to the picture. */
const weft_command *const weft_commands[] = {
    NULL,
};
