/** The manual pages, from the tables of the programs: weft(1), one page per command, weftd(8). */
#ifndef WEFT_HOST_DOCS_DOCS_MAN_H
#define WEFT_HOST_DOCS_DOCS_MAN_H

#include "core/error.h"
#include "core/fields.h"

/** What is true of every command, a sentence each, with `code` in backquotes; ends with NULL. */
extern const char *const weft_docs_rules[];

/** What an option takes: "NAME, 0 to 10", "auto|off", "" for a flag; room for 160 bytes. */
void weft_docs_value(const weft_field *field, char text[160]);

/**
 * Writes DIR/man1/weft.1, DIR/man1/weft-COMMAND.1 ("weft-calibrate-lens.1") and DIR/man8/weftd.8 in mdoc.
 *
 * @param folder  is there
 * @param date    of the pages, "2026-11-23"
 * @return WEFT_ERR_USAGE for another date, WEFT_ERR_IO
 */
weft_err weft_docs_write_man(const char *folder, const char *date, weft_error *err);

#endif
