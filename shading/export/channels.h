/**
 * Channels of exported pictures by name: what packing presets are written in.
 *
 *     albedo.r albedo.g albedo.b         diffuse reflectance (coded as sRGB where the picture is colour);
 *                                        of GGX and cloth side by side that of both together
 *     base.r base.g base.b               base colour of metallic models: albedo, or F0 of metals
 *     metallic                           1 where there is no diffuse part and F0 is a metal's
 *     roughness, smoothness, alpha       sqrt(alpha), 1 - sqrt(alpha), alpha of the lobe
 *     normal.x normal.y normal.z         0.5 + 0.5 n; -normal.y for green down
 *     height                             0..1 over the range of the map
 *     smooth                             1 - cloth
 *     occlusion cavity opacity cloth specular.r ... front.r ... rim.r ... detail_normal.x ... detail_albedo.r
 * ... zero half one                      constants
 */
#ifndef WEFT_SHADING_EXPORT_CHANNELS_H
#define WEFT_SHADING_EXPORT_CHANNELS_H

#include "core/formats/raster.h"
#include "shading/bake/baked.h"

#define WEFT_CHANNELS_MAX 4

/** A picture in the terms of an exporter. */
typedef struct weft_channels {
    const char *names[WEFT_CHANNELS_MAX]; /* NULL behind the last */
    int bits;                             /* 8 or 16 */
    bool srgb;                            /* the first three channels are coded as sRGB, a fourth is not */
} weft_channels;

/** Whether a name is a channel's. */
bool weft_channel_known(const char *name);

/** Whether the channel varies over the material; constants need no picture. */
bool weft_channel_varies(const weft_baked *baked, const char *name);

/** The value of a channel where it does not vary, else its mean; not sRGB-coded. */
double weft_channel_mean(const weft_baked *baked, const char *name);

/**
 * One level of a picture.
 * @return WEFT_ERR_USAGE for a name that is no channel; WEFT_ERR_NOMEM
 */
weft_err weft_channels_raster(const weft_baked *baked, const weft_channels *channels, int level,
                              weft_raster *raster, weft_error *err);

/**
 * One level of a picture at another size, not smaller than the level's own: cubic between the texels
 * (Catmull-Rom), over the edge as the material goes on there.  Beyond the last level the last one is shown.
 * @return as weft_channels_raster()
 */
weft_err weft_channels_raster_sized(const weft_baked *baked, const weft_channels *channels, int level,
                                    int width, int height, weft_raster *raster, weft_error *err);

/**
 * The numbers of one level before they become codes: linear, one plane a channel.
 * @return as weft_channels_raster()
 */
weft_err weft_channels_planes(const weft_baked *baked, const weft_channels *channels, int level,
                              weft_image *planes, weft_error *err);

/** Lowest and highest height in mm, which `height` is coded between; 0, 0 without a map. */
void weft_channels_height_range(const weft_baked *baked, double range_mm[2]);

#endif
