/** Pictures of a U3M: PNG, TIFF and JPEG by their first bytes, as planes of codes 0..1. */
#ifndef WEFT_SHADING_U3M_U3M_PICTURE_H
#define WEFT_SHADING_U3M_U3M_PICTURE_H

#include "core/formats/raster.h"
#include "shading/u3m/u3m_files.h"

/**
 * Reads a picture of the list.
 * @param transfer  whether its codes are sRGB
 * @param image     1 or 3 planes
 * @return WEFT_ERR_FORMAT naming the picture; WEFT_ERR_NOMEM
 */
weft_err weft_u3m_picture_read(const weft_u3m_files *files, int index, weft_transfer transfer,
                               weft_image *image, weft_error *err);

/** Its size alone; the picture is read to see that it can be. */
weft_err weft_u3m_picture_size(const weft_u3m_files *files, int index, int *width, int *height,
                               weft_error *err);

#endif
