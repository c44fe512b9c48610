#include "core/formats/jpeg_bytes.h"

#include "core/mem.h"

#include <turbojpeg.h>

/* Even a progressive picture of one colour needs a byte for as many pixels. */
#define MAX_PIXELS_A_BYTE 4096

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

weft_err weft_jpeg_decode(const unsigned char *bytes, size_t n, weft_raster *raster, weft_error *err)
{
    int width, height, sampling, space;
    const tjhandle decoder = tjInitDecompress();
    if (!decoder)
        return weft_fail(err, WEFT_ERR_NOMEM, "out of memory");
    unsigned char *rgb = NULL;
    weft_err status = WEFT_OK;
    if (tjDecompressHeader3(decoder, bytes, n, &width, &height, &sampling, &space) != 0)
        status = weft_fail(err, WEFT_ERR_FORMAT, "is a damaged JPEG: %s", tjGetErrorStr2(decoder));
    else if (width < 1 || height < 1) /* the file ends before it says so */
        status = weft_fail(err, WEFT_ERR_FORMAT, "is a damaged JPEG: it ends in its header");
    else if ((uint64_t)width * (uint64_t)height > (uint64_t)n * MAX_PIXELS_A_BYTE)
        status = weft_fail(err, WEFT_ERR_FORMAT, "is a damaged JPEG: %d x %d px do not fit into it", width,
                           height);
    if (status == WEFT_OK)
        status = weft_raster_init(raster, width, height, 3, 8, err);
    if (status == WEFT_OK) {
        const size_t samples = 3 * (size_t)width * (size_t)height;
        rgb = weft_alloc(samples, 1, err);
        if (!rgb)
            status = WEFT_ERR_NOMEM;
        else if (tjDecompress2(decoder, bytes, n, rgb, width, 0, height, TJPF_RGB, TJFLAG_ACCURATEDCT) != 0)
            status = weft_fail(err, WEFT_ERR_FORMAT, "is a damaged JPEG: %s", tjGetErrorStr2(decoder));
        for (size_t i = 0; i < samples && status == WEFT_OK; i++)
            raster->data[i] = rgb[i];
        if (status != WEFT_OK)
            weft_raster_fini(raster);
    }
    weft_free(rgb);
    tjDestroy(decoder);
    return status;
}
