/** The firmware that this build ships, as the file that is flashed. */
#ifndef WEFT_HOST_LIGHT_FLASH_IMAGE_H
#define WEFT_HOST_LIGHT_FLASH_IMAGE_H

#include "core/error.h"

#include <limits.h>
#include <stdint.h>

typedef struct weft_flash_image {
    char path[PATH_MAX];
    uint32_t bytes;
    char firmware[32]; /* "1.1.0", as the program in it says of itself */
    char git_id[16];
    int protocol_major, protocol_minor;
} weft_flash_image;

/**
 * Finds and reads the image: `path`, or when that is NULL the one of this build, beside the program in
 * ../firmware (where it was built) or ../share/weft (where it was installed).
 *
 * @return WEFT_ERR_MISSING saying how to make it; WEFT_ERR_FORMAT for a damaged file, and for one that is no
 *         firmware of a Weft light controller or would overwrite the bootloader
 */
weft_err weft_flash_image_load(const char *path, weft_flash_image *image, weft_error *err);

#endif
