/** The picture of the backend that the tests' own camera helper has. */
#ifndef WEFT_TESTS_HOST_DRAWN_CAMERA_H
#define WEFT_TESTS_HOST_DRAWN_CAMERA_H

#include <stdint.h>

enum { DRAWN_WIDTH = 308, DRAWN_HEIGHT = 204 };

/** Photosite i of the frame with this number. */
static inline uint16_t drawn_camera_sample(int i, uint64_t sequence, double exposure_s)
{
    uint32_t h = (uint32_t)i * 2654435761u ^ (uint32_t)sequence * 2246822519u ^ (uint32_t)(1e6 * exposure_s);
    h ^= h >> 15;
    h *= 2246822519u;
    return (uint16_t)(h >> 18);
}

#endif
