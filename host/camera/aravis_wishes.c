/* What the address of a camera says behind its first comma. */
#include "host/camera/aravis_private.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { LEAST_PACKET = 220, LARGEST_PACKET = 65535 };

static bool read_packet(const char *value, aravis_wishes *w)
{
    char *end = NULL;
    const long bytes = strtol(value, &end, 10);
    w->packet_bytes = (int)bytes;
    return *value && !*end && bytes >= LEAST_PACKET && bytes <= LARGEST_PACKET;
}

static bool read_resend(const char *value, aravis_wishes *w)
{
    w->resend = strcmp(value, "on") == 0;
    return w->resend || strcmp(value, "off") == 0;
}

static bool read_line(const char *value, aravis_wishes *w)
{
    return *value && snprintf(w->line, sizeof w->line, "%s", value) < (int)sizeof w->line;
}

static const struct {
    const char *key, *wanted;
    bool (*read)(const char *value, aravis_wishes *wishes);
} keys[] = {
    {"packet", "220 to 65535 bytes", read_packet},
    {"resend", "on or off", read_resend},
    {"line", "the name of an input", read_line},
};

enum { N_KEYS = sizeof keys / sizeof keys[0] };

static weft_err read_one(const char *word, size_t n, aravis_wishes *w, weft_error *err)
{
    char text[64];
    snprintf(text, sizeof text, "%.*s", (int)n, word);
    char *const equals = strchr(text, '=');
    if (equals)
        *equals = '\0';
    for (int i = 0; equals && i < N_KEYS; i++) {
        if (strcmp(keys[i].key, text) != 0)
            continue;
        if (n < sizeof text && keys[i].read(equals + 1, w))
            return WEFT_OK;
        return weft_fail(err, WEFT_ERR_USAGE, "camera setting %s=%s: wanted %s", text, equals + 1,
                         keys[i].wanted);
    }
    return weft_fail(err, WEFT_ERR_USAGE,
                     "camera setting \"%s\": wanted packet=BYTES, resend=on, resend=off or line=NAME, as in "
                     "aravis:192.168.1.20,packet=1400",
                     text);
}

weft_err aravis_read_wishes(const char *words, aravis_wishes *wishes, weft_error *err)
{
    *wishes = (aravis_wishes){.resend = -1};
    while (*words == ',') {
        const size_t n = strcspn(words + 1, ",");
        WEFT_TRY(read_one(words + 1, n, wishes, err));
        words += 1 + n;
    }
    return WEFT_OK;
}
