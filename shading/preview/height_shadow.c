#include "shading/preview/height_shadow.h"

#include <math.h>

#define BIAS 0.001 /* texels that a ray starts above the surface */

static double finite_or_zero(float value)
{
    return isfinite(value) ? (double)value : 0;
}

/* The highest texel of each tile, then of each tile and its neighbours: a ray that is looked at once a tile
 * cannot pass a summit by. */
static weft_err find_tiles(weft_height_field *field, weft_error *err)
{
    const weft_image *const map = field->height;
    const int columns = (map->width + WEFT_HEIGHT_TILE - 1) / WEFT_HEIGHT_TILE;
    const int rows = (map->height + WEFT_HEIGHT_TILE - 1) / WEFT_HEIGHT_TILE;
    weft_image own;
    WEFT_TRY(weft_image_init(&own, columns, rows, 1, err));
    const weft_err status = weft_image_init(&field->tiles, columns, rows, 1, err);
    for (size_t i = 0; i < weft_image_plane_size(&own); i++)
        own.data[i] = -INFINITY;
    for (int y = 0; y < map->height; y++)
        for (int x = 0; x < map->width; x++) {
            const float h = (float)(finite_or_zero(weft_image_row(map, 0, y)[x]) * field->per_mm);
            float *const tile = &weft_image_row(&own, 0, y / WEFT_HEIGHT_TILE)[x / WEFT_HEIGHT_TILE];
            *tile = h > *tile ? h : *tile;
        }
    for (int y = 0; y < rows && status == WEFT_OK; y++)
        for (int x = 0; x < columns; x++) {
            float highest = -INFINITY;
            for (int j = y > 0 ? y - 1 : 0; j <= y + 1 && j < rows; j++)
                for (int i = x > 0 ? x - 1 : 0; i <= x + 1 && i < columns; i++)
                    highest = fmaxf(highest, weft_image_row(&own, 0, j)[i]);
            weft_image_row(&field->tiles, 0, y)[x] = highest;
        }
    weft_image_fini(&own);
    return status;
}

weft_err weft_height_field_init(weft_height_field *field, const weft_image *height_mm, double mm_per_px,
                                weft_error *err)
{
    if (!(mm_per_px > 0) || !isfinite(mm_per_px))
        return weft_fail(err, WEFT_ERR_RANGE, "a height map throws shadows only where its scale is known");
    weft_height_field made = {.height = height_mm,
                              .per_mm = 1 / mm_per_px,
                              .width = height_mm->width,
                              .height_px = height_mm->height};
    WEFT_TRY(find_tiles(&made, err));
    *field = made;
    return WEFT_OK;
}

void weft_height_field_mirror(weft_height_field *field, int x, int y, int width, int height)
{
    field->x = x;
    field->y = y;
    field->width = width;
    field->height_px = height;
    field->mirrored = true;
}

void weft_height_field_fini(weft_height_field *field)
{
    weft_image_fini(&field->tiles);
    *field = (weft_height_field){0};
}

/* A coordinate inside [low - 0.5, low + size - 0.5), mirrored at the ends. */
static double fold(double t, int low, int size)
{
    const double from_edge = t - low + 0.5;
    if (from_edge >= 0 && from_edge < size)
        return t;
    const double periods = from_edge / (2.0 * size), within = 2.0 * size * (periods - floor(periods));
    return low - 0.5 + (within < size ? within : 2.0 * size - within);
}

static int clamp_index(int i, int n)
{
    return i < 0 ? 0 : i < n ? i : n - 1;
}

/* Bilinear; the map's edge texels go on outside. */
static double height_inside(const weft_height_field *field, double u, double v)
{
    const weft_image *const map = field->height;
    const double left = floor(u), top = floor(v), fu = u - left, fv = v - top;
    const int x0 = clamp_index((int)left, map->width), x1 = clamp_index((int)left + 1, map->width);
    const float *const a = weft_image_row(map, 0, clamp_index((int)top, map->height));
    const float *const b = weft_image_row(map, 0, clamp_index((int)top + 1, map->height));
    const double upper = (1 - fu) * finite_or_zero(a[x0]) + fu * finite_or_zero(a[x1]);
    const double lower = (1 - fu) * finite_or_zero(b[x0]) + fu * finite_or_zero(b[x1]);
    return field->per_mm * ((1 - fv) * upper + fv * lower);
}

double weft_height_field_at(const weft_height_field *field, double u, double v)
{
    if (field->mirrored)
        return height_inside(field, fold(u, field->x, field->width), fold(v, field->y, field->height_px));
    return height_inside(field, u, v);
}

static bool outside(const weft_height_field *field, double u, double v)
{
    return !field->mirrored &&
           !(u >= -0.5 && v >= -0.5 && u <= field->width - 0.5 && v <= field->height_px - 0.5);
}

static double highest_near(const weft_height_field *field, double u, double v)
{
    if (field->mirrored) {
        u = fold(u, field->x, field->width);
        v = fold(v, field->y, field->height_px);
    }
    const int x = clamp_index((int)(u + 0.5) / WEFT_HEIGHT_TILE, field->tiles.width);
    const int y = clamp_index((int)(v + 0.5) / WEFT_HEIGHT_TILE, field->tiles.height);
    return (double)weft_image_row(&field->tiles, 0, y)[x];
}

/* A ray over the map: places in texels, `rise` texels up for each texel across. */
typedef struct ray {
    double u, v, z, du, dv, rise;
} ray;

/* The stretch of the ray, in texels across, where something is high enough; false when there is none. */
static bool find_stretch(const weft_height_field *field, const ray *r, double stretch[2])
{
    bool found = false;
    for (int k = 0; k < WEFT_HEIGHT_REACH / WEFT_HEIGHT_TILE; k++) {
        const double t = k * (double)WEFT_HEIGHT_TILE;
        const double u = r->u + t * r->du, v = r->v + t * r->dv;
        if (outside(field, u, v))
            break;
        const double over = highest_near(field, u, v) - (r->z + t * r->rise);
        if (over <= 0)
            continue;
        const double meets = r->rise > 0 ? over / r->rise : WEFT_HEIGHT_TILE;
        stretch[0] = found ? stretch[0] : t;
        stretch[1] = t + fmin(meets, WEFT_HEIGHT_TILE);
        found = true;
    }
    return found;
}

weft_height_look weft_height_field_look(const weft_height_field *field, double u, double v,
                                        const double light[3], weft_height_march march)
{
    const double across = hypot(light[0], light[1]);
    double stretch[2];
    if (light[2] <= 0)
        return (weft_height_look){false, false};
    if (across < 1e-9 * light[2])
        return (weft_height_look){true, false};
    const ray r = {.u = u,
                   .v = v,
                   .z = weft_height_field_at(field, u, v) + BIAS,
                   .du = light[0] / across,
                   .dv = -light[1] / across,
                   .rise = light[2] / across};
    if (!find_stretch(field, &r, stretch))
        return (weft_height_look){true, false};
    const double length = stretch[1] - stretch[0], wanted = ceil(length / WEFT_HEIGHT_STEP);
    const bool coarse = wanted > march.steps;
    const int steps = coarse ? march.steps : (int)wanted;
    const double dither = coarse ? march.dither : 0.5;
    for (int k = 0; k < steps; k++) {
        const double t = stretch[0] + length * (k + dither) / steps;
        const double at_u = r.u + t * r.du, at_v = r.v + t * r.dv;
        if (outside(field, at_u, at_v))
            break;
        if (r.z + t * r.rise < weft_height_field_at(field, at_u, at_v))
            return (weft_height_look){false, coarse};
    }
    return (weft_height_look){true, coarse};
}
