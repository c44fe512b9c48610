/**
 * A bound on the memory of the program, for work on pictures that are larger than it.
 *
 * With a limit set, large blocks of weft_alloc() (128 KiB and more) that do not fit are kept in files without
 * a name and mapped into memory.  Whoever works on them goes on as before; but between two pieces of work,
 * where weft_mem_trim() is called, what they have touched is given back to the system when the program has
 * grown near its limit, and comes back from the file (mostly from the system's cache of it) when it is
 * touched again.  So the pieces are the bands that pass through memory, as many rows as the limit allows;
 * what is computed does not depend on it.
 *
 * weft_parallel_rows() calls weft_mem_trim() after each band, and serial loops over large blocks do after
 * each row; a thread that looks every 2 ms is there for those that do not.
 *
 * The files lie in $TMPDIR, else in /var/tmp; their room is reserved when the block is made, so that a full
 * disk is an error and no crash.
 */
#ifndef WEFT_CORE_MEM_LIMIT_H
#define WEFT_CORE_MEM_LIMIT_H

#include "core/error.h"

#include <stddef.h>

/** The least limit that makes sense: the program itself, its libraries and threads. */
#define WEFT_MEM_LEAST_LIMIT (64.0 * 1048576)

/** Sets the limit of the whole program in bytes, from now on; 0 takes it away.  Blocks stay where they are.
 */
void weft_mem_set_limit(double bytes);

/** Gives back what large blocks in files have in memory, when the program is near its limit.  Cheap; from any
 *  thread. */
void weft_mem_trim(void);

/** Gives it back in any case: before something large that is not ours, as a library's memory for a frame. */
void weft_mem_give_back(void);

/** Bytes of the program that are in memory now, as the system counts them; 0 where it does not tell. */
double weft_mem_resident(void);

/** The most that were in memory at a time so far. */
double weft_mem_peak(void);

/** Bytes of all blocks that are kept in files now. */
double weft_mem_in_files(void);

#endif
