#include "host/cli/doctor.h"

#include <stdio.h>

/* One a line. */
const weft_doctor_check weft_doctor_checks[] = {
    {"clock", weft_doctor_clock},
    {"disk", weft_doctor_disk},
    {"lens module", weft_doctor_lens_module},
    {"avrdude", weft_doctor_avrdude},
    {"firmware image", weft_doctor_image},
    {"udev rules", weft_doctor_udev_rules},
    {"controller's port", weft_doctor_board},
    {"permission", weft_doctor_permission},
    {"other programs", weft_doctor_other_owner},
    {"controller", weft_doctor_controller},
    {"firmware", weft_doctor_firmware},
    {"settings", weft_doctor_settings},
    {"last start", weft_doctor_last_start},
    {"serial line", weft_doctor_serial_line},
    {"camera backends", weft_doctor_camera_helpers},
    {"USB cameras", weft_doctor_usb_cameras},
    {"camera", weft_doctor_camera},
    {"receive buffer", weft_doctor_receive_buffer},
    {"lamps", weft_doctor_lamps},
    {0},
};

void weft_doctor_say(weft_doctor_result *result, weft_doctor_verdict verdict, const char *remedy,
                     const char *format, ...)
{
    va_list args;
    result->verdict = verdict;
    va_start(args, format);
    vsnprintf(result->text, sizeof result->text, format, args);
    va_end(args);
    snprintf(result->remedy, sizeof result->remedy, "%s", remedy ? remedy : "");
}
