#include "host/camera/camera_serve.h"

#include <stdlib.h>
#include <string.h>
#include <strings.h>

static const struct {
    const char *name;
    weft_camera_deed deed;
} deeds[] = {
    {"crash", WEFT_DEED_CRASH},     {"exit", WEFT_DEED_EXIT},   {"hang", WEFT_DEED_HANG},
    {"stray", WEFT_DEED_STRAY},     {"loose", WEFT_DEED_LOOSE}, {"short", WEFT_DEED_SHORT},
    {"garbage", WEFT_DEED_GARBAGE},
};

/* "crash@EXPOSE:3" of n characters */
static weft_camera_deed one_deed(const char *text, size_t n, weft_camera_call call, int count)
{
    const char *const at = memchr(text, '@', n);
    if (!at)
        return WEFT_DEED_NONE;
    const char *const end = text + n, *const colon = memchr(at, ':', (size_t)(end - at));
    const size_t n_call = (size_t)((colon ? colon : end) - at - 1);
    const char *const wanted = weft_camera_call_name(call);
    if (strlen(wanted) != n_call || strncasecmp(at + 1, wanted, n_call) != 0 ||
        (colon && strtol(colon + 1, NULL, 10) != count))
        return WEFT_DEED_NONE;
    for (size_t i = 0; i < sizeof deeds / sizeof deeds[0]; i++)
        if (strlen(deeds[i].name) == (size_t)(at - text) &&
            strncmp(deeds[i].name, text, (size_t)(at - text)) == 0)
            return deeds[i].deed;
    return WEFT_DEED_NONE;
}

weft_camera_deed weft_camera_deed_for(const char *faults, weft_camera_call call, int count)
{
    while (faults && *faults) {
        const size_t n = strcspn(faults, ",");
        const weft_camera_deed deed = one_deed(faults, n, call, count);
        if (deed != WEFT_DEED_NONE)
            return deed;
        faults += n + (faults[n] == ',');
    }
    return WEFT_DEED_NONE;
}
