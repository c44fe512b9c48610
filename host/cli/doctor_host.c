/* Checks of this computer: what Weft needs of it whatever is plugged in. */
#include "host/cli/doctor.h"

#include "calibration/lens/lens_module.h"
#include "core/file.h"
#include "host/light/flash.h"

#include <grp.h>
#include <string.h>
#include <sys/timex.h>
#include <time.h>
#include <unistd.h>

/* Sets and the names of scans carry the date.  Nothing was scanned before this program was written. */
#define FIRST_SCAN_S 1763856000 /* 2025-11-23 */

void weft_doctor_clock(weft_doctor *doctor, weft_doctor_result *result)
{
    char now[32];
    struct timex state = {0};
    (void)doctor;
    weft_time_now_iso(now);
    const int synchronised = adjtimex(&state);
    if (time(NULL) < FIRST_SCAN_S)
        weft_doctor_say(result, WEFT_DOCTOR_FAILED, "sudo timedatectl set-ntp true, or set the date",
                        "says %s", now);
    else if (synchronised == TIME_ERROR)
        weft_doctor_say(result, WEFT_DOCTOR_WARNING, "sudo timedatectl set-ntp true",
                        "says %s, and no time server corrects it", now);
    else
        weft_doctor_say(result, WEFT_DOCTOR_OK, NULL, "%s, synchronised", now);
}

/* A set of ten frames of 16 million photosites and 16 bits, ambient and dark frames, and its maps. */
#define ONE_SCAN_BYTES (1.5e9)

void weft_doctor_disk(weft_doctor *doctor, weft_doctor_result *result)
{
    weft_error why = {0};
    uint64_t bytes;
    if (weft_disk_free(doctor->folder, &bytes, &why) != WEFT_OK)
        weft_doctor_say(result, WEFT_DOCTOR_FAILED, NULL, "%s", why.text);
    else if ((double)bytes < ONE_SCAN_BYTES)
        weft_doctor_say(result, WEFT_DOCTOR_FAILED, "free some, or scan into another folder",
                        "%.1f GB free in %s; a large scan takes %.1f", 1e-9 * (double)bytes, doctor->folder,
                        1e-9 * ONE_SCAN_BYTES);
    else
        weft_doctor_say(result, WEFT_DOCTOR_OK, NULL, "%.0f GB free in %s", 1e-9 * (double)bytes,
                        doctor->folder);
}

void weft_doctor_lens_module(weft_doctor *doctor, weft_doctor_result *result)
{
    weft_error why = {0};
    const weft_lens_opencv *opencv = NULL;
    (void)doctor;
    if (weft_lens_opencv_load(&opencv, &why) == WEFT_OK)
        weft_doctor_say(result, WEFT_DOCTOR_OK, NULL, "loads: weft calibrate lens works");
    else
        weft_doctor_say(result, WEFT_DOCTOR_FAILED, NULL, "%s", why.text);
}

void weft_doctor_avrdude(weft_doctor *doctor, weft_doctor_result *result)
{
    weft_error why = {0};
    char path[PATH_MAX];
    (void)doctor;
    if (weft_flash_find_avrdude(path, &why) == WEFT_OK)
        weft_doctor_say(result, WEFT_DOCTOR_OK, NULL, "%.600s", path);
    else
        weft_doctor_say(result, WEFT_DOCTOR_FAILED, NULL, "%s", why.text);
}

void weft_doctor_image(weft_doctor *doctor, weft_doctor_result *result)
{
    weft_error why = {0};
    weft_flash_image image;
    (void)doctor;
    if (weft_flash_image_load(NULL, &image, &why) == WEFT_OK)
        weft_doctor_say(result, WEFT_DOCTOR_OK, NULL, "%s (%s), %.500s", image.firmware, image.git_id,
                        image.path);
    else
        weft_doctor_say(result, WEFT_DOCTOR_FAILED, NULL, "%s", why.text);
}

/* Whether this process is in a group by that name. */
static bool is_in_group(const char *name)
{
    gid_t groups[256];
    const struct group *const wanted = getgrnam(name);
    const int n = getgroups(256, groups);
    for (int i = 0; wanted && i < n; i++)
        if (groups[i] == wanted->gr_gid)
            return true;
    return wanted && getegid() == wanted->gr_gid;
}

void weft_doctor_udev_rules(weft_doctor *doctor, weft_doctor_result *result)
{
    static const char *const places[] = {"/etc/udev/rules.d/70-weft.rules", "/run/udev/rules.d/70-weft.rules",
                                         "/usr/local/lib/udev/rules.d/70-weft.rules",
                                         "/usr/lib/udev/rules.d/70-weft.rules",
                                         "/lib/udev/rules.d/70-weft.rules"};
    static const char remedy[] =
        "sudo cp udev/70-weft.rules /etc/udev/rules.d/ && sudo udevadm control --reload && "
        "sudo udevadm trigger";
    if (doctor->is_rig) {
        weft_doctor_say(result, WEFT_DOCTOR_SKIPPED, NULL, "the virtual scanner needs none");
        return;
    }
    for (size_t i = 0; i < sizeof places / sizeof places[0]; i++)
        if (weft_file_exists(places[i])) {
            weft_doctor_say(result, WEFT_DOCTOR_OK, NULL, "%s", places[i]);
            return;
        }
    if (geteuid() == 0 || is_in_group("dialout"))
        weft_doctor_say(result, WEFT_DOCTOR_WARNING, remedy,
                        "not installed: ModemManager and desktops may seize controller and camera");
    else
        weft_doctor_say(result, WEFT_DOCTOR_FAILED, remedy,
                        "not installed, and you are not in the group dialout: no right to the controller");
}
