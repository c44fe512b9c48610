#include "host/camera/gphoto_bodies.h"

#include "core/text.h"

#include <math.h>
#include <stdio.h>
#include <string.h>
#include <strings.h>

#define TO_M      "turn the mode dial to M"
#define LENS_TO_M "switch lens and body to manual focus"

static const gphoto_body bodies[] = {
    /* Proved on the virtual D5100, whose settings and values are those of the real one. */
    {.vendor = "Nikon",
     .model = "",
     .shutter = "shutterspeed2|shutterspeed",
     .iso = "iso",
     .base_iso = 100,
     .settings =
         {
             {"expprogram", "M", TO_M, false},
             {"capturetarget", "Internal RAM", "update libgphoto2", false},
             {"recordingmedia", "SDRAM", "", true},
             {"imagequality", "NEF (Raw)|NEF", "choose NEF (RAW) as image quality in the body's menu", false},
             {"capturemode", "Single Shot",
              "set the release mode to single frame (not timer, burst, mirror up)", false},
             {"longexpnr", "Off", "switch long-exposure noise reduction off in the body's menu", false},
             {"isoauto", "Off", "switch automatic ISO off in the body's menu", false},
             {"autoiso", "Off", "switch automatic ISO off in the body's menu", false},
             {"bracketing", "Off", "switch bracketing off in the body's menu", false},
             {"hdrmode", "Off", "switch HDR off in the body's menu", false},
             {"exposuredelaymode", "Off", "", true},
             {"focusmode", "Manual", LENS_TO_M, false},
         }},
    /* After libgphoto2's names for EOS bodies; not tried on one. */
    {.vendor = "Canon",
     .model = "",
     .shutter = "shutterspeed",
     .iso = "iso",
     .base_iso = 100,
     .settings =
         {
             {"autoexposuremode", "Manual", TO_M, false},
             {"capturetarget", "Internal RAM", "update libgphoto2", false},
             {"imageformat", "RAW", "choose RAW as image quality in the body's menu", false},
             {"drivemode", "Single|Single silent|Single: Silent shooting", "set the drive mode to single",
              false},
             {"aeb", "off", "switch bracketing off in the body's menu", false},
             {"focusmode", "Manual", LENS_TO_M, false},
         }},
    /* After libgphoto2's names; not tried on one. */
    {.vendor = "Sony",
     .model = "",
     .shutter = "shutterspeed",
     .iso = "iso",
     .base_iso = 100,
     .settings =
         {
             {"expprogram", "M", TO_M, false},
             {"capturetarget", "sdram", "", true},
             {"imagequality", "RAW", "choose RAW as file format in the body's menu", false},
             {"capturemode", "Single Shot", "set the drive mode to single shooting", false},
             {"focusmode", "Manual", LENS_TO_M, false},
         }},
    /* Any other camera that speaks PTP. */
    {.vendor = "",
     .model = "",
     .shutter = "shutterspeed2|shutterspeed|exptime",
     .iso = "iso",
     .base_iso = 100,
     .settings =
         {
             {"expprogram", "M|Manual", TO_M, false},
             {"capturetarget", "Internal RAM|sdram", "", true},
             {"imagequality", "RAW|NEF (Raw)", "choose raw files in the body's menu", false},
             {"imageformat", "RAW", "choose raw files in the body's menu", false},
             {"capturemode", "Single Shot", "set the release mode to single", false},
             {"focusmode", "Manual", LENS_TO_M, false},
         }},
};

static bool begins(const char *text, const char *with)
{
    return strncasecmp(text, with, strlen(with)) == 0;
}

const gphoto_body *gphoto_body_find(const char *vendor, const char *model)
{
    const gphoto_body *body = bodies;
    while (!begins(vendor, body->vendor) || !begins(model, body->model))
        body++; /* the last row fits all */
    return body;
}

/* Canon and Panasonic write 0"8 for 0.8 s and 2" for 2 s. */
static void spell_point(const char *text, char plain[32])
{
    snprintf(plain, 32, "%s", text);
    char *const mark = strchr(plain, '"');
    if (mark)
        *mark = mark[1] ? '.' : '\0';
    const size_t n = strlen(plain);
    if (n > 0 && plain[n - 1] == 's')
        plain[n - 1] = '\0';
}

bool gphoto_parse_shutter(const char *text, double *seconds)
{
    char plain[32];
    double numerator, denominator = 1;
    spell_point(text, plain);
    const char *const rest = weft_text_scan_double(plain, &numerator);
    if (!rest || (*rest == '/' ? !weft_text_to_double(rest + 1, &denominator) : *rest != '\0'))
        return false;
    if (!(numerator > 0) || !(denominator > 0))
        return false;
    *seconds = numerator / denominator;
    return true;
}

int gphoto_nearest_shutter(const char *const *texts, int n, double seconds, double *achieved_s)
{
    int best = -1;
    double least = INFINITY, this_s;
    for (int i = 0; i < n; i++)
        if (gphoto_parse_shutter(texts[i], &this_s) && fabs(log(this_s / seconds)) < least) {
            least = fabs(log(this_s / seconds));
            best = i;
            *achieved_s = this_s;
        }
    return best;
}

int gphoto_nearest_iso(const char *const *texts, int n, double iso, double *achieved)
{
    int best = -1;
    double least = INFINITY, this_one;
    for (int i = 0; i < n; i++)
        if (weft_text_to_double(texts[i], &this_one) && this_one > 0 && fabs(log(this_one / iso)) < least) {
            least = fabs(log(this_one / iso));
            best = i;
            *achieved = this_one;
        }
    return best;
}

bool gphoto_split(const char *values, int k, char *one, size_t size)
{
    for (; k > 0; k--) {
        values = strchr(values, '|');
        if (!values)
            return false;
        values++;
    }
    snprintf(one, size, "%.*s", (int)strcspn(values, "|"), values);
    return true;
}

int gphoto_find_value(const char *const *texts, int n, const char *values)
{
    char one[64];
    for (int k = 0; gphoto_split(values, k, one, sizeof one); k++)
        for (int i = 0; i < n; i++)
            if (strcmp(texts[i], one) == 0)
                return i;
    return -1;
}
