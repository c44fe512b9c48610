#include "core/formats/image_file.h"

#include "core/file.h"
#include "core/formats/exr_file.h"
#include "core/formats/png_file.h"
#include "core/formats/tiff_file.h"

typedef enum file_kind { KIND_EXR, KIND_PNG, KIND_TIFF } file_kind;

static weft_err kind_of(const char *path, file_kind *kind, weft_error *err)
{
    static const struct {
        const char *suffix;
        file_kind kind;
    } kinds[] = {{".exr", KIND_EXR}, {".png", KIND_PNG}, {".tif", KIND_TIFF}, {".tiff", KIND_TIFF}};
    for (size_t i = 0; i < sizeof kinds / sizeof kinds[0]; i++)
        if (weft_path_has_suffix(path, kinds[i].suffix)) {
            *kind = kinds[i].kind;
            return WEFT_OK;
        }
    return weft_fail(err, WEFT_ERR_FORMAT,
                     "%s: a picture's name must end in .exr, .png, .tif or .tiff (convert it)", path);
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

weft_err weft_image_read(const char *path, weft_transfer transfer, weft_image *image, weft_error *err)
{
    file_kind kind;
    weft_raster raster;
    WEFT_TRY(kind_of(path, &kind, err));
    if (kind == KIND_EXR)
        return read_exr(path, image, err);
    WEFT_TRY(kind == KIND_PNG ? weft_png_read(path, &raster, err) : weft_tiff_read(path, &raster, err));
    const weft_err status = weft_image_from_raster(image, &raster, transfer, err);
    weft_raster_fini(&raster);
    return status;
}

weft_err weft_image_write(const char *path, const weft_image *image, int bits, weft_transfer transfer,
                          weft_error *err)
{
    static const char *const rgb[] = {"R", "G", "B"}, *const grey[] = {"Y"};
    file_kind kind;
    weft_raster raster;
    WEFT_TRY(kind_of(path, &kind, err));
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
