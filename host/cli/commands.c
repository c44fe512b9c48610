#include "host/cli/command.h"

extern const weft_command weft_cmd_batch;
extern const weft_command weft_cmd_brdf;
extern const weft_command weft_cmd_calibrate_colour;
extern const weft_command weft_cmd_calibrate_report;
extern const weft_command weft_cmd_calibrate_linearity;
extern const weft_command weft_cmd_calibrate_white;
extern const weft_command weft_cmd_capture;
extern const weft_command weft_cmd_calibrate_lens;
extern const weft_command weft_cmd_calibrate_lights;
extern const weft_command weft_cmd_check;
extern const weft_command weft_cmd_compare;
extern const weft_command weft_cmd_completion;
extern const weft_command weft_cmd_devices;
extern const weft_command weft_cmd_doctor;
extern const weft_command weft_cmd_flash;
extern const weft_command weft_cmd_import;
extern const weft_command weft_cmd_rig;
extern const weft_command weft_cmd_light_level;
extern const weft_command weft_cmd_light_off;
extern const weft_command weft_cmd_light_on;
extern const weft_command weft_cmd_light_run;
extern const weft_command weft_cmd_light_set;
extern const weft_command weft_cmd_light_status;
extern const weft_command weft_cmd_layout;
extern const weft_command weft_cmd_library_find;
extern const weft_command weft_cmd_library_list;
extern const weft_command weft_cmd_library_reindex;
extern const weft_command weft_cmd_library_show;
extern const weft_command weft_cmd_live;
extern const weft_command weft_cmd_solve;
extern const weft_command weft_cmd_contact;
extern const weft_command weft_cmd_bake;
extern const weft_command weft_cmd_lint;
extern const weft_command weft_cmd_weave;
extern const weft_command weft_cmd_preview;

/* In the order of the help: the way of the data, from the lights to the picture.  One a line. */
/* clang-format off */
const weft_command *const weft_commands[] = {
    &weft_cmd_rig,
    &weft_cmd_devices,
    &weft_cmd_doctor,
    &weft_cmd_flash,
    &weft_cmd_light_on,
    &weft_cmd_light_level,
    &weft_cmd_light_off,
    &weft_cmd_light_run,
    &weft_cmd_light_set,
    &weft_cmd_light_status,
    &weft_cmd_live,
    &weft_cmd_capture,
    &weft_cmd_calibrate_lens,
    &weft_cmd_calibrate_linearity,
    &weft_cmd_calibrate_white,
    &weft_cmd_calibrate_lights,
    &weft_cmd_calibrate_colour,
    &weft_cmd_calibrate_report,
    &weft_cmd_import,
    &weft_cmd_solve,
    &weft_cmd_check,
    &weft_cmd_layout,
    &weft_cmd_batch,
    &weft_cmd_compare,
    &weft_cmd_lint,
    &weft_cmd_weave,
    &weft_cmd_bake,
    &weft_cmd_preview,
    &weft_cmd_contact,
    &weft_cmd_brdf,
    &weft_cmd_library_list,
    &weft_cmd_library_show,
    &weft_cmd_library_find,
    &weft_cmd_library_reindex,
    &weft_cmd_completion,
    NULL,
};
/* clang-format on */
