/** The folder of a set under capture: begun anew, or taken up where it was left. */
#ifndef WEFT_HOST_CAPTURE_SET_FOLDER_H
#define WEFT_HOST_CAPTURE_SET_FOLDER_H

#include "host/capture/plan.h"

/** What is at the place of the set. */
typedef enum weft_set_found {
    WEFT_SET_NONE,        /* nothing, or an empty folder: begin */
    WEFT_SET_INTERRUPTED, /* to be resumed */
    WEFT_SET_REPLACE,     /* to be replaced (force) */
} weft_set_found;

/**
 * Looks at the folder and decides; changes nothing.
 *
 * @param set  for WEFT_SET_INTERRUPTED the set as it was left, else untouched
 * @return WEFT_ERR_EXISTS when something is there and the options do not say what to do with it
 */
weft_err weft_set_folder_inspect(const weft_capture_options *options, weft_set_found *found, weft_set *set,
                                 weft_error *err);

/** Creates the folder; removes the frames of a set that is replaced, and what a killed capture left half
 *  written (".weft-*").  Files that are not the set's own stay. */
weft_err weft_set_folder_begin(const weft_capture_options *options, weft_set_found found, weft_error *err);

/** Takes over the settings the set was begun with; those given in `options` must agree.
 *  @return WEFT_ERR_MISMATCH naming the option */
weft_err weft_set_folder_adopt(const weft_set *set, weft_capture_options *options, weft_error *err);

/** Writes the settings into set->other for a later weft_set_folder_adopt(). */
weft_err weft_set_folder_remember(weft_set *set, const weft_capture_options *options,
                                  const weft_controller_info *controller, weft_error *err);

/** Refuses a camera that is not the one the set was begun with. */
weft_err weft_set_folder_check_camera(const weft_set *set, const char *backend,
                                      const weft_camera_state *camera, weft_error *err);

/** Refuses to write over files that are no frames of a set that is replaced: --force puts a set beside other
 *  things, not in their place.  @return WEFT_ERR_EXISTS naming the file */
weft_err weft_set_folder_check_names(const weft_capture_options *options, weft_set_found found,
                                     const weft_capture_plan *plan, weft_error *err);

/** Gives the planned frames the entries that the set has of them (whatever their files are called: by role,
 *  light and place in the bracket), and marks those whose file has the hash that was recorded; warns of the
 *  others. */
weft_err weft_set_folder_find_frames(const weft_set *set, weft_capture_plan *plan, weft_error *err);

#endif
