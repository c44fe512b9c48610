#include "shading/u3m/u3m_picture.h"

#include "core/formats/jpeg_bytes.h"
#include "core/formats/png_file.h"
#include "core/formats/tiff_file.h"
#include "core/mem.h"

#include <stdio.h>
#include <string.h>
#include <sys/mman.h>
#include <unistd.h>

/* The readers of PNG and TIFF take files: one in memory. */
static weft_err read_as_file(const char *bytes, size_t n,
                             weft_err (*read)(const char *, weft_raster *, weft_error *), weft_raster *raster,
                             weft_error *err)
{
    char path[64];
    const int fd = memfd_create("weft-u3m", MFD_CLOEXEC);
    size_t done = 0;
    while (fd >= 0 && done < n) {
        const ssize_t wrote = write(fd, bytes + done, n - done);
        if (wrote <= 0)
            break;
        done += (size_t)wrote;
    }
    (void)snprintf(path, sizeof path, "/proc/self/fd/%d", fd);
    const weft_err status = fd >= 0 && done == n
                                ? read(path, raster, err)
                                : weft_fail_errno(err, WEFT_ERR_IO, "a picture cannot be held in memory");
    if (fd >= 0)
        (void)close(fd);
    return status;
}

static weft_err decode(const char *bytes, size_t n, weft_raster *raster, weft_error *err)
{
    if (n >= 8 && memcmp(bytes, "\x89PNG\r\n\x1a\n", 8) == 0)
        return read_as_file(bytes, n, weft_png_read, raster, err);
    if (n >= 4 && (memcmp(bytes, "II*\0", 4) == 0 || memcmp(bytes, "MM\0*", 4) == 0))
        return read_as_file(bytes, n, weft_tiff_read, raster, err);
    if (n >= 3 && memcmp(bytes, "\xff\xd8\xff", 3) == 0)
        return weft_jpeg_decode((const unsigned char *)bytes, n, raster, err);
    return weft_fail(err, WEFT_ERR_FORMAT, "is neither PNG nor TIFF nor JPEG, all that U3M has");
}

static weft_err read_raster(const weft_u3m_files *files, int index, weft_raster *raster, weft_error *err)
{
    char *bytes;
    size_t n;
    WEFT_TRY(weft_u3m_files_read(files, index, &bytes, &n, err));
    const weft_err status = decode(bytes, n, raster, err);
    weft_free(bytes);
    return status == WEFT_OK
               ? WEFT_OK
               : weft_prefix(err, status, "its picture \"%s\"", weft_u3m_files_name(files, index));
}

weft_err weft_u3m_picture_read(const weft_u3m_files *files, int index, weft_transfer transfer,
                               weft_image *image, weft_error *err)
{
    weft_raster raster = {0};
    WEFT_TRY(read_raster(files, index, &raster, err));
    const weft_err status = weft_image_from_raster(image, &raster, transfer, err);
    weft_raster_fini(&raster);
    return status;
}

weft_err weft_u3m_picture_size(const weft_u3m_files *files, int index, int *width, int *height,
                               weft_error *err)
{
    weft_raster raster = {0};
    WEFT_TRY(read_raster(files, index, &raster, err));
    *width = raster.width;
    *height = raster.height;
    weft_raster_fini(&raster);
    return WEFT_OK;
}
