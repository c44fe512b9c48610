/**
 * A camera under libgphoto2: connecting, settings by name, and its errors in words.
 *
 * Every call here may block as long as libgphoto2 does; the helper process is ended from outside when that is
 * too long (camera_child.h).
 */
#ifndef WEFT_HOST_CAMERA_GPHOTO_SESSION_H
#define WEFT_HOST_CAMERA_GPHOTO_SESSION_H

#include "core/error.h"

#include <gphoto2/gphoto2.h>
#include <stdbool.h>

enum { GPHOTO_MAX_CHOICES = 128, GPHOTO_TEXT = 64 };

typedef struct gphoto_session {
    Camera *camera;     /* NULL: not connected */
    GPContext *context; /* NULL: not begun */
    char address[112];  /* as given; names the camera in messages */
    char port[120];     /* where it was found: "usb:001,042" */
    char words[200];    /* what libgphoto2 last complained of */
} gphoto_session;

/** A setting as it is now.  Fetched with gphoto_get(), freed with gphoto_choice_free(). */
typedef struct gphoto_choice {
    CameraWidget *widget;
    char value[GPHOTO_TEXT];
    int n;                                 /* of texts; 0 for a free text */
    const char *texts[GPHOTO_MAX_CHOICES]; /* the widget's own */
    bool read_only;
} gphoto_choice;

/** Connects to the camera at a port ("usb:001,042", "ptpip:192.168.1.1") or with a serial number
 *  ("serial:6001234").  The session is zeroed before the first call. */
weft_err gphoto_connect(gphoto_session *s, const char *address, weft_error *err);
/** Harmless when it is not connected. */
void gphoto_disconnect(gphoto_session *s);

/** A camera on the USB bus that can photograph. */
typedef struct gphoto_seen {
    char model[GPHOTO_TEXT], port[GPHOTO_TEXT];
} gphoto_seen;
/** At most `max` of them, in the order of the bus. */
weft_err gphoto_look(gphoto_seen *seen, int max, int *n, weft_error *err);

/** "camera ADDRESS: DOING: ..." with what the code means and what to do. */
weft_err gphoto_fail(const gphoto_session *s, int code, const char *doing, weft_error *err);

/** False when the body has no such setting (now). */
bool gphoto_get(gphoto_session *s, const char *name, gphoto_choice *choice);
void gphoto_choice_free(gphoto_choice *choice);
/** The value alone; false when there is none. */
bool gphoto_read(gphoto_session *s, const char *name, char value[GPHOTO_TEXT]);
/** The serial number without the zeros that Nikon pads it with; "" when the body has none. */
void gphoto_read_serial(gphoto_session *s, char serial[GPHOTO_TEXT]);
/** Sets it.  @return libgphoto2's code */
int gphoto_set(gphoto_session *s, gphoto_choice *choice, const char *name, const char *value);

/** Whether it still answers. */
bool gphoto_is_alive(gphoto_session *s);

/** Calls libgphoto2 with its own chatter on stderr swallowed: `code` gets the result. */
#define GPHOTO_CALL(s, code, call)                                                                           \
    do {                                                                                                     \
        (s)->words[0] = '\0';                                                                                \
        const int gphoto_stderr = gphoto_hush();                                                             \
        (code) = (call);                                                                                     \
        gphoto_unhush(gphoto_stderr);                                                                        \
    } while (0)
int gphoto_hush(void);
void gphoto_unhush(int kept);

#endif
