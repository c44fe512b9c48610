/** The secret that clients over TCP show. */
#ifndef WEFT_HOST_DAEMON_TOKEN_H
#define WEFT_HOST_DAEMON_TOKEN_H

#include "core/error.h"

#include <stdbool.h>

#define WEFT_TOKEN_LENGTH_MIN 16
#define WEFT_TOKEN_LENGTH_MAX 512

/** Compares in a time that depends on the length of `given` alone, not on how much of it is right. */
bool weft_token_equal(const char *given, const char *token);

/**
 * The token of a file: its first line.  A file that is not there is made, for its owner alone, with 256
 * random bits.
 *
 * @return on the heap.  WEFT_ERR_FORMAT for one of less than 16 or more than 512 visible characters,
 *         WEFT_ERR_RANGE when others may read it, WEFT_ERR_IO
 */
weft_err weft_token_load(const char *path, char **token, weft_error *err);

#endif
