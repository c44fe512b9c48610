#include "host/light/flash_image.h"

#include "core/file.h"
#include "core/formats/ihex_file.h"
#include "core/shipped.h"
#include "core/text.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

/* The chip has 32 KiB; the largest bootloader begins at 28. */
enum { FLASH_BYTES = 32768, PROGRAM_BYTES = 28672 };

static weft_err find_image(char path[PATH_MAX], weft_error *err)
{
    static const char *const places[] = {"../firmware", "../share/weft", NULL};
    if (weft_shipped_find("weft-firmware.hex", places, path, err) == WEFT_OK)
        return WEFT_OK;
    return weft_prefix(err, WEFT_ERR_MISSING,
                       "the firmware image is not there; build it (cmake --build build --target "
                       "weft_firmware) or give --image FILE.hex");
}

/* The firmware carries the line that it answers to a person's "?". */
static bool read_identity(const uint8_t *memory, weft_flash_image *image)
{
    static const char begin[] = "Weft light controller ";
    const char *const at = memmem(memory, FLASH_BYTES, begin, sizeof begin - 1);
    char line[96] = "";
    if (!at || at + sizeof line > (const char *)memory + FLASH_BYTES)
        return false;
    memcpy(line, at + sizeof begin - 1, sizeof line - 1);
    char major[8], minor[8];
    return sscanf(line, "%31[0-9.] (%15[^)]), protocol %7[0-9].%7[0-9]", image->firmware, image->git_id,
                  major, minor) == 4 &&
           weft_text_to_int(major, &image->protocol_major) && weft_text_to_int(minor, &image->protocol_minor);
}

weft_err weft_flash_image_load(const char *path, weft_flash_image *image, weft_error *err)
{
    uint8_t memory[FLASH_BYTES];
    uint32_t begin, end;
    *image = (weft_flash_image){0};
    if (!path)
        WEFT_TRY(find_image(image->path, err));
    else if (!weft_file_exists(path))
        return weft_fail(err, WEFT_ERR_MISSING, "%s: there is no such firmware image", path);
    else if (snprintf(image->path, sizeof image->path, "%s", path) >= (int)sizeof image->path ||
             strchr(path, ':')) /* avrdude would take it for flash:w:FILE:FORMAT */
        return weft_fail(err, WEFT_ERR_USAGE, "%s: the name of the image is too long or has a colon in it",
                         path);
    memset(memory, 0xff, sizeof memory);
    WEFT_TRY(weft_ihex_read(image->path, memory, sizeof memory, &begin, &end, err));
    if (end > PROGRAM_BYTES)
        return weft_fail(err, WEFT_ERR_FORMAT, "%s: the image reaches to %#x, where the bootloader is",
                         image->path, (unsigned)end);
    if (begin != 0 || !read_identity(memory, image))
        return weft_fail(
            err, WEFT_ERR_FORMAT,
            "%s: this is no firmware of a Weft light controller; avrdude itself flashes other programs",
            image->path);
    image->bytes = end - begin;
    return WEFT_OK;
}
