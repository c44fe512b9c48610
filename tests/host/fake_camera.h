/** The picture of the tests' fake camera, and how to run it. */
#ifndef WEFT_TESTS_HOST_FAKE_CAMERA_H
#define WEFT_TESTS_HOST_FAKE_CAMERA_H

#include <stdint.h>
#include <stdio.h>
#include <sys/types.h>

/** The sample at column x, row y; the low bits where the format has fewer. */
static inline uint16_t fake_camera_sample(int x, int y, uint32_t exposure_us, uint32_t gain)
{
    uint32_t h = (uint32_t)x * 2654435761u ^ (uint32_t)y * 2246822519u ^ exposure_us * 3266489917u ^ gain;
    h ^= h >> 15;
    h *= 2246822519u;
    return (uint16_t)(h >> 13);
}

/** The camera's process. */
typedef struct fake_camera {
    pid_t pid;
    FILE *in, *out; /* its stdin, its stdout */
} fake_camera;

/** Takes the machine's lock on port 3956 and starts it; skips the test when the port is taken. */
void fake_camera_start(fake_camera *camera, const char *format, const char *size);
/** Sends a line and waits for "ok". */
void fake_camera_tell(fake_camera *camera, const char *line);
/** Kills it, if it still runs, and waits for its end. */
void fake_camera_kill(fake_camera *camera);

#endif
