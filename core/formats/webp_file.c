#include "core/formats/webp_file.h"

#include "core/file.h"
#include "core/mem.h"

#include <math.h>
#include <webp/encode.h>
#include <webp/mux.h>

struct weft_webp {
    WebPAnimEncoder *encoder;
    WebPConfig config;
    int width, height, n_frames;
    double ms_a_frame;
};

weft_err weft_webp_begin(weft_webp **webp, int width, int height, double frames_per_s, int quality,
                         weft_error *err)
{
    WebPAnimEncoderOptions options;
    if (width < 1 || height < 1 || width > WEBP_MAX_DIMENSION || height > WEBP_MAX_DIMENSION)
        return weft_fail(err, WEFT_ERR_RANGE, "WebP holds pictures of up to %d x %d pixels, not %d x %d",
                         WEBP_MAX_DIMENSION, WEBP_MAX_DIMENSION, width, height);
    if (!(frames_per_s >= 0.1 && frames_per_s <= 100) || quality < 0 || quality > 100)
        return weft_fail(err, WEFT_ERR_RANGE, "wanted 0.1 to 100 frames a second and a quality of 0 to 100");
    weft_webp *const made = weft_alloc(1, sizeof *made, err);
    if (!made)
        return WEFT_ERR_NOMEM;
    *made = (weft_webp){.width = width, .height = height, .ms_a_frame = 1000 / frames_per_s};
    const bool good = WebPConfigInit(&made->config) && WebPAnimEncoderOptionsInit(&options);
    made->config.lossless = quality == 100;
    made->config.exact = made->config.lossless;
    made->config.quality = made->config.lossless ? 50 : (float)quality; /* of lossless: effort */
    options.anim_params.loop_count = 0;
    made->encoder = good ? WebPAnimEncoderNew(width, height, &options) : NULL;
    if (!made->encoder) {
        weft_free(made);
        return weft_fail(err, WEFT_ERR_NOMEM, "no memory for an animation of %d x %d pixels", width, height);
    }
    *webp = made;
    return WEFT_OK;
}

static void fill_row(const weft_raster *picture, int y, uint32_t *argb)
{
    const uint16_t *const from =
        picture->data + (size_t)y * (size_t)picture->width * (size_t)picture->channels;
    for (int x = 0; x < picture->width; x++) {
        const uint16_t *const p = from + (size_t)x * (size_t)picture->channels;
        const uint32_t r = p[0], g = picture->channels == 3 ? p[1] : r, b = picture->channels == 3 ? p[2] : r;
        argb[x] = 0xff000000u | r << 16 | g << 8 | b;
    }
}

weft_err weft_webp_add(weft_webp *webp, const weft_raster *picture, weft_error *err)
{
    WebPPicture frame;
    if (picture->width != webp->width || picture->height != webp->height || picture->bits != 8 ||
        (picture->channels != 1 && picture->channels != 3))
        return weft_fail(
            err, WEFT_ERR_MISMATCH,
            "a frame of %d x %d pixels, %d channels of %d bits; wanted %d x %d, grey or RGB of 8",
            picture->width, picture->height, picture->channels, picture->bits, webp->width, webp->height);
    if (!WebPPictureInit(&frame))
        return weft_fail(err, WEFT_ERR_NOMEM, "libwebp is of another version than its header");
    frame.use_argb = 1;
    frame.width = webp->width;
    frame.height = webp->height;
    bool good = WebPPictureAlloc(&frame);
    for (int y = 0; y < frame.height && good; y++)
        fill_row(picture, y, frame.argb + (size_t)y * (size_t)frame.argb_stride);
    const int at_ms = (int)lround(webp->n_frames * webp->ms_a_frame);
    good = good && WebPAnimEncoderAdd(webp->encoder, &frame, at_ms, &webp->config);
    WebPPictureFree(&frame);
    if (!good)
        return weft_fail(err, WEFT_ERR_NOMEM, "frame %d could not be compressed: %s", webp->n_frames,
                         WebPAnimEncoderGetError(webp->encoder));
    webp->n_frames++;
    return WEFT_OK;
}

weft_err weft_webp_write(weft_webp *webp, const char *path, weft_error *err)
{
    WebPData data;
    const int end_ms = (int)lround(webp->n_frames * webp->ms_a_frame);
    if (webp->n_frames == 0)
        return weft_fail(err, WEFT_ERR_NODATA, "%s: an animation of no frames", path);
    WebPDataInit(&data);
    weft_err status = WEFT_OK;
    if (!WebPAnimEncoderAdd(webp->encoder, NULL, end_ms, NULL) ||
        !WebPAnimEncoderAssemble(webp->encoder, &data))
        status = weft_fail(err, WEFT_ERR_NOMEM, "%s: %s", path, WebPAnimEncoderGetError(webp->encoder));
    if (status == WEFT_OK)
        status = weft_file_write(path, data.bytes, data.size, err);
    WebPDataClear(&data);
    return status;
}

void weft_webp_destroy(weft_webp *webp)
{
    if (!webp)
        return;
    WebPAnimEncoderDelete(webp->encoder);
    weft_free(webp);
}
