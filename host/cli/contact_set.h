/** The frames of a captured set as tiles of a contact sheet. */
#ifndef WEFT_HOST_CLI_CONTACT_SET_H
#define WEFT_HOST_CLI_CONTACT_SET_H

#include "host/set/set.h"
#include "shading/preview/sheet.h"

/** Whether the path is a set (has a set.json, or is one). */
bool weft_contact_is_set(const char *path);

/** Rows that the frames of a set take. */
int weft_contact_set_rows(const weft_set *set, int columns);

/**
 * Places every frame, from `first_row` on, with its role and exposure.
 *
 * Frames are shown in the camera's colours, balanced so that all light frames together are grey, and under
 * one exposure for all lights, set so that 1 % of the brightest frame's pixels are above white: one sees at
 * once which light is weak, blocked or missing.
 */
weft_err weft_contact_set(weft_sheet *sheet, int first_row, const weft_set *set, weft_error *err);

#endif
