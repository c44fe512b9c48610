/** Programs as Intel hex files (Intel, "Hexadecimal Object File Format Specification", revision A, 1988). */
#ifndef WEFT_CORE_FORMATS_IHEX_FILE_H
#define WEFT_CORE_FORMATS_IHEX_FILE_H

#include "core/error.h"

#include <stddef.h>
#include <stdint.h>

/**
 * Reads a file with addresses of up to 32 bits into memory that begins at address 0.  Bytes that the file
 * does not give stay as they are.
 *
 * @param size   bytes of memory
 * @param begin  gets the lowest address given
 * @param end    gets the highest one, plus 1
 * @return WEFT_ERR_IO; WEFT_ERR_FORMAT naming the line of a record that is damaged (each has a checksum) or
 *         does not fit, or of a file that is cut: its end record is missing.  Memory may have changed then.
 */
weft_err weft_ihex_read(const char *path, uint8_t *memory, size_t size, uint32_t *begin, uint32_t *end,
                        weft_error *err);

#endif
