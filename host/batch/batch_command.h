/** Runs a program and keeps what it says: sbatch, squeue. */
#ifndef WEFT_HOST_BATCH_BATCH_COMMAND_H
#define WEFT_HOST_BATCH_BATCH_COMMAND_H

#include "core/error.h"

typedef struct weft_command_output {
    char *out, *err; /* on the heap, without the last newline */
    int exit_status; /* 128 + signal when it was killed */
} weft_command_output;

void weft_command_output_fini(weft_command_output *output);

/**
 * Runs words[0], found along PATH, until it ends.
 *
 * @param words  ends with NULL
 * @param input  its stdin; NULL: none
 * @return WEFT_ERR_MISSING when there is no such program; WEFT_ERR_IO.  Its own failure is in exit_status.
 */
weft_err weft_command_capture(char *const *words, const char *input, weft_command_output *output,
                              weft_error *err);

#endif
