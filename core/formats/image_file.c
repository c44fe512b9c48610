#include "core/formats/image_file.h"

#include "core/file.h"
#include "core/formats/exr_file.h"
#include "core/formats/jpeg_bytes.h"
#include "core/formats/png_file.h"
#include "core/formats/tiff_file.h"
#include "core/mem.h"

#define MAX_JPEG_BYTES ((size_t)1 << 30)

typedef enum file_kind { KIND_EXR, KIND_PNG, KIND_TIFF, KIND_JPEG } file_kind;

static weft_err kind_of(const char *path, bool write, file_kind *kind, weft_error *err)
{
    static const struct {
        const char *suffix;
        file_kind kind;
    } kinds[] = {{".exr", KIND_EXR},   {".png", KIND_PNG},  {".tif", KIND_TIFF},
                 {".tiff", KIND_TIFF}, {".jpg", KIND_JPEG}, {".jpeg", KIND_JPEG}};
    for (size_t i = 0; i < sizeof kinds / sizeof kinds[0]; i++)
        if (weft_path_has_suffix(path, kinds[i].suffix) && !(write && kinds[i].kind == KIND_JPEG)) {
            *kind = kinds[i].kind;
            return WEFT_OK;
        }
    return weft_fail(err, WEFT_ERR_FORMAT, "%s: a picture's name must end in .exr, .png, .tif%s%s", path,
                     write ? " or .tiff" : ", .tiff, .jpg or .jpeg", write ? "" : " (convert it)");
}

/* RGB when the file has it, else its one grey channel. */
static weft_err read_exr(const char *path, weft_image *image, weft_error *err)
{
    static const char *const rgb[] = {"R", "G", "B"}, *const grey[] = {"Y"};
    weft_error first = {0};
    weft_err status = weft_exr_read(path, rgb, 3, image, &first);
    if (status == WEFT_ERR_MISSING) {
        weft_error second = {0};
        status = weft_exr_read(path, grey, 1, image, &second);
        if (status != WEFT_ERR_MISSING) /* else the first text: it says what the file has */
            first = second;
    }
    if (err && status != WEFT_OK)
        *err = first;
    return status;
}

static weft_err read_jpeg(const char *path, weft_raster *raster, weft_error *err)
{
    char *bytes = NULL;
    size_t n;
    WEFT_TRY(weft_file_read(path, MAX_JPEG_BYTES, &bytes, &n, err));
    const weft_err status = weft_jpeg_decode((const unsigned char *)bytes, n, raster, err);
    weft_free(bytes);
    return status == WEFT_OK ? WEFT_OK : weft_prefix(err, status, "%s", path);
}

static weft_err read_raster(const char *path, file_kind kind, weft_raster *raster, weft_error *err)
{
    switch (kind) {
    case KIND_PNG:
        return weft_png_read(path, raster, err);
    case KIND_JPEG:
        return read_jpeg(path, raster, err);
    default:
        return weft_tiff_read(path, raster, err);
    }
}

weft_err weft_image_read(const char *path, weft_transfer transfer, weft_image *image, weft_error *err)
{
    file_kind kind;
    weft_raster raster;
    WEFT_TRY(kind_of(path, false, &kind, err));
    if (kind == KIND_EXR)
        return read_exr(path, image, err);
    WEFT_TRY(read_raster(path, kind, &raster, err));
    const weft_err status = weft_image_from_raster(image, &raster, transfer, err);
    weft_raster_fini(&raster);
    return status;
}

weft_err weft_image_check_name(const char *path, weft_error *err)
{
    file_kind kind;
    return kind_of(path, true, &kind, err);
}

weft_err weft_image_write(const char *path, const weft_image *image, int bits, weft_transfer transfer,
                          weft_error *err)
{
    static const char *const rgb[] = {"R", "G", "B"}, *const grey[] = {"Y"};
    file_kind kind;
    weft_raster raster;
    WEFT_TRY(kind_of(path, true, &kind, err));
    if (image->planes != 1 && image->planes != 3)
        return weft_fail(err, WEFT_ERR_RANGE, "%s: a picture file holds 1 or 3 planes, not %d", path,
                         image->planes);
    if (kind == KIND_EXR)
        return weft_exr_write(path, image, image->planes == 3 ? rgb : grey, WEFT_EXR_HALF, err);
    const weft_err made = weft_raster_from_image(&raster, image, bits, transfer, err);
    if (made != WEFT_OK)
        return weft_prefix(err, made, "%s", path);
    const weft_err status =
        kind == KIND_PNG ? weft_png_write(path, &raster, err) : weft_tiff_write(path, &raster, err);
    weft_raster_fini(&raster);
    return status;
}
