#include "core/formats/jpeg_bytes.h"

#include <turbojpeg.h>

weft_err weft_jpeg_encode(const uint8_t *rgb, int width, int height, int quality, unsigned char **bytes,
                          size_t *n, weft_error *err)
{
    unsigned char *coded = NULL; /* libjpeg-turbo's own heap */
    unsigned long size = 0;
    const tjhandle coder = tjInitCompress();
    const int failed = !coder || tjCompress2(coder, rgb, width, 0, height, TJPF_RGB, &coded, &size,
                                             TJSAMP_420, quality, TJFLAG_FASTDCT) != 0;
    const weft_err status =
        failed ? weft_fail(err, WEFT_ERR_NOMEM, "a picture of %d x %d px cannot be coded: %s", width, height,
                           coder ? tjGetErrorStr2(coder) : "out of memory")
               : WEFT_OK;
    if (coder)
        tjDestroy(coder);
    if (failed) {
        tjFree(coded);
        return status;
    }
    *bytes = coded;
    *n = size;
    return WEFT_OK;
}

void weft_jpeg_free(unsigned char *bytes)
{
    tjFree(bytes);
}
