/**
 * libcamera as a C library: as much of it as cam_libcamera.c needs, and no judgement of its own.
 *
 * Frames come from libcamera's thread into a queue; everything else is for one thread.
 */
#ifndef WEFT_HOST_CAMERA_LIBCAMERA_SHIM_H
#define WEFT_HOST_CAMERA_LIBCAMERA_SHIM_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

enum { WEFT_LIBCAMERA_TEXT = 160 };

typedef struct weft_libcamera weft_libcamera;

typedef struct weft_libcamera_mode {
    char format[24]; /* libcamera's name: "SRGGB16", "SBGGR10_CSI2P" */
    int width, height, stride;
} weft_libcamera_mode;

/** What the camera can be told; a range of 0 to 0 is a control that it does not have. */
typedef struct weft_libcamera_ranges {
    double exposure_min_s, exposure_max_s;
    double gain_min, gain_max;
} weft_libcamera_ranges;

typedef struct weft_libcamera_frame {
    const uint8_t *bytes; /* until it is given back */
    size_t size;
    bool good; /* libcamera says that it is whole */
    uint32_t sequence;
    uint64_t timestamp_ns; /* of the sensor, else of the buffer; 0: none */
    double exposure_s;     /* as the pipeline reports it; 0: it does not */
    double gain;           /* likewise */
    bool has_black;
    double black[4]; /* of red, green beside red, green beside blue, blue; 65535 is white */
    void *request;
} weft_libcamera_frame;

/** libcamera says nothing any more on stderr, where it talks much, and of things that are none of the user's.
 */
void weft_libcamera_hush(void);

/** Calls `each` for every camera.  @return false when libcamera does not start, with its reason */
bool weft_libcamera_list(void (*each)(void *context, const char *id, const char *model), void *context,
                         char problem[WEFT_LIBCAMERA_TEXT]);

/** Acquires the camera.  @return NULL with the reason */
weft_libcamera *weft_libcamera_open(const char *id, char model[64], char problem[WEFT_LIBCAMERA_TEXT]);
void weft_libcamera_close(weft_libcamera *camera);

/** Name i of the formats of its raw stream, or of its only one; false behind the last. */
bool weft_libcamera_format(const weft_libcamera *camera, int i, char name[24]);

/** Takes the largest size of a format, and makes its buffers. */
bool weft_libcamera_set_format(weft_libcamera *camera, const char *name, weft_libcamera_mode *mode,
                               char problem[WEFT_LIBCAMERA_TEXT]);

weft_libcamera_ranges weft_libcamera_get_ranges(const weft_libcamera *camera);

/** Streams with these settings fixed and everything automatic off: they hold from the first frame on where
 *  the pipeline can do that, and are in every request in any case. */
bool weft_libcamera_start(weft_libcamera *camera, double exposure_s, double gain,
                          char problem[WEFT_LIBCAMERA_TEXT]);
void weft_libcamera_stop(weft_libcamera *camera);

/** The next frame, or false when none comes within the time. */
bool weft_libcamera_next(weft_libcamera *camera, int timeout_ms, weft_libcamera_frame *frame);
/** Gives it back to be filled again.  @return false when the camera takes no more */
bool weft_libcamera_give_back(weft_libcamera *camera, const weft_libcamera_frame *frame);

/** Whether the camera has been unplugged. */
bool weft_libcamera_is_gone(const weft_libcamera *camera);

#ifdef __cplusplus
}
#endif

#endif
