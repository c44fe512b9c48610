/* One material's own properties over what lies below: U3M, constants, scan, pictures, factors. */
#include "shading/material/composite_private.h"

#include "core/file.h"
#include "core/mem.h"

#include <math.h>
#include <string.h>

/* The property, unless it comes from `inherited` or from what that derives from; NULL: whoever set it. */
static const weft_rad_member *own(const weft_rad_record *record, const char *name,
                                  const weft_asset *inherited)
{
    const weft_rad_member *const m = weft_rad_at(record, name);
    for (const weft_asset *a = inherited; m && a; a = a->base)
        if (strcmp(m->set_by, a->name) == 0)
            return NULL;
    return m;
}

static void drop_map(weft_baked *baked, weft_baked_kind kind)
{
    for (int level = 0; level < WEFT_BAKED_MAX_MIPS; level++)
        weft_image_fini(&baked->maps[kind].mips[level]);
    baked->maps[kind].n_mips = 0;
}

static void set_constant(weft_baked *baked, weft_baked_kind kind, int planes, const double *values)
{
    drop_map(baked, kind);
    for (int p = 0; p < weft_baked_rows[kind].planes; p++)
        baked->maps[kind].constant[p] = (float)values[planes == 1 ? 0 : p];
    if (weft_baked_of_cloth(baked, kind) != kind) /* what is set holds for both parts */
        set_constant(baked, weft_baked_of_cloth(baked, kind), planes, values);
}

static void multiply(weft_baked *baked, weft_baked_kind kind, const double *factors, int planes)
{
    weft_baked_map *const map = &baked->maps[kind];
    for (int p = 0; p < weft_baked_rows[kind].planes; p++) {
        const float factor = (float)factors[planes == 1 ? 0 : p];
        map->constant[p] *= factor;
        for (size_t i = 0; map->n_mips > 0 && i < weft_image_plane_size(&map->mips[0]); i++)
            weft_image_plane(&map->mips[0], p)[i] *= factor;
    }
    if (weft_baked_of_cloth(baked, kind) != kind)
        multiply(baked, weft_baked_of_cloth(baked, kind), factors, planes);
}

/* A picture becomes a map; with fewer planes than the map it multiplies the constant that is there. */
static weft_err put(const weft_compositor *c, weft_baked *baked, weft_baked_kind kind,
                    const weft_image *image, weft_texture_use use, const double tiling[2], bool multiplies,
                    weft_error *err)
{
    weft_image at_size;
    WEFT_TRY(weft_texture_resample(image, use, c->width, c->height, tiling, &at_size, err));
    float factor[4];
    memcpy(factor, baked->maps[kind].constant, sizeof factor);
    weft_err status = weft_baked_add(baked, kind, c->width, c->height, err);
    weft_image *const to = &baked->maps[kind].mips[0];
    for (int p = 0; status == WEFT_OK && p < to->planes; p++) {
        const float *const from = weft_image_plane(&at_size, at_size.planes == 1 ? 0 : p);
        const float scale = multiplies ? factor[p] : 1;
        for (size_t i = 0; i < weft_image_plane_size(to); i++)
            weft_image_plane(to, p)[i] = from[i] * scale;
    }
    weft_image_fini(&at_size);
    if (status == WEFT_OK && weft_baked_of_cloth(baked, kind) != kind)
        status = put(c, baked, weft_baked_of_cloth(baked, kind), image, use, tiling, multiplies, err);
    return status;
}

static weft_err put_scan(const weft_compositor *c, weft_baked *baked, const weft_rad_member *member,
                         weft_error *err)
{
    weft_scan scan;
    WEFT_TRY(weft_composite_load_scan(c, member, &scan, err));
    const struct {
        const weft_image *image;
        weft_texture_use use;
        weft_baked_kind kind;
    } parts[] = {{&scan.albedo, WEFT_TEXTURE_COLOUR, WEFT_BAKED_ALBEDO},
                 {&scan.normal, WEFT_TEXTURE_NORMAL, WEFT_BAKED_NORMAL},
                 {&scan.specular, WEFT_TEXTURE_SCALAR, WEFT_BAKED_SPECULAR},
                 {&scan.roughness, WEFT_TEXTURE_SCALAR, WEFT_BAKED_ROUGHNESS},
                 {&scan.height, WEFT_TEXTURE_SCALAR, WEFT_BAKED_HEIGHT},
                 {&scan.opacity, WEFT_TEXTURE_SCALAR, WEFT_BAKED_OPACITY}};
    weft_err status = WEFT_OK;
    for (size_t i = 0; i < sizeof parts / sizeof parts[0] && status == WEFT_OK; i++) {
        if (parts[i].image->planes == 0)
            continue;
        double tiling[2] = {1, 1};
        const int w = parts[i].image->width, h = parts[i].image->height;
        if (scan.mm_per_px > 0 && c->size_mm[0] > 0) { /* every scan at its own true size */
            tiling[0] = c->size_mm[0] / (scan.mm_per_px * w);
            tiling[1] = c->size_mm[1] / (scan.mm_per_px * h);
        }
        status = put(c, baked, parts[i].kind, parts[i].image, parts[i].use, tiling, false, err);
    }
    weft_scan_fini(&scan);
    return status;
}

/* Takes over what the U3M says, of quantities that the type has. */
static weft_err put_u3m(const weft_compositor *c, weft_baked *baked, const weft_rad_member *member,
                        weft_error *err)
{
    weft_u3m *u3m;
    weft_baked from = {0};
    WEFT_TRY(weft_composite_open_u3m(member, &u3m, err));
    const weft_err status = weft_u3m_bake(u3m, c->width, c->height, c->size_mm, &from, err);
    for (int k = 0; k < WEFT_BAKED_COUNT && status == WEFT_OK; k++) {
        const weft_baked_kind kind = (weft_baked_kind)k;
        const bool of_threads = kind == WEFT_BAKED_ANISOTROPY || kind == WEFT_BAKED_TANGENT;
        const bool of_cloth = kind == WEFT_BAKED_CLOTH || kind == WEFT_BAKED_FRONT_TINT ||
                              kind == WEFT_BAKED_RIM_TINT || kind == WEFT_BAKED_RIM_AMPLITUDE;
        if (!weft_u3m_has(u3m, kind) || (of_threads && baked->type->model != WEFT_MATERIAL_ANISOTROPIC) ||
            (of_cloth && baked->type->model != WEFT_MATERIAL_CLOTH))
            continue;
        drop_map(baked, kind);
        baked->maps[kind] = from.maps[kind];
        from.maps[kind] = (weft_baked_map){0};
        baked->two_lobes = false; /* a U3M has one surface */
    }
    weft_baked_fini(&from);
    weft_u3m_close(u3m);
    return status;
}

static weft_err put_texture(const weft_compositor *c, weft_baked *baked, const weft_composite_texture *row,
                            const weft_rad_record *record, weft_error *err)
{
    double tiling[2] = {1, 1};
    weft_image image;
    weft_rad_numbers(record, "tiling", 2, tiling);
    WEFT_TRY(weft_texture_read(record, row->use, &image, err));
    const weft_err status = put(c, baked, row->kind, &image, row->use, tiling, row->multiplies, err);
    weft_image_fini(&image);
    return status;
}

static void steepen(weft_baked *baked, double strength)
{
    weft_baked_map *const map = &baked->maps[WEFT_BAKED_NORMAL];
    for (size_t i = 0; map->n_mips > 0 && i < weft_image_plane_size(&map->mips[0]); i++) {
        float *const x = weft_image_plane(&map->mips[0], 0) + i, *const y =
                                                                     weft_image_plane(&map->mips[0], 1) + i;
        float *const z = weft_image_plane(&map->mips[0], 2) + i;
        const double a = strength * (double)*x, b = strength * (double)*y, d = (double)*z;
        const double length = sqrt(a * a + b * b + d * d);
        *x = (float)(a / length);
        *y = (float)(b / length);
        *z = (float)(d / length);
    }
}

/* Numbers and colours that replace: property, quantity, how many components.
 * @param only_said  leave out the defaults of built-in types */
static void apply_constants(weft_baked *baked, const weft_rad_record *p, const weft_asset *inherited,
                            bool only_said)
{
    static const struct {
        const char *property;
        weft_baked_kind kind;
        int planes;
    } rows[] = {
        {"albedo_color", WEFT_BAKED_ALBEDO, 3},          {"specular_intensity", WEFT_BAKED_SPECULAR, 1},
        {"specular_roughness", WEFT_BAKED_ROUGHNESS, 1}, {"anisotropy", WEFT_BAKED_ANISOTROPY, 1},
        {"front_tint_color", WEFT_BAKED_FRONT_TINT, 3},  {"rim_tint_color", WEFT_BAKED_RIM_TINT, 3},
        {"rim_amplitude", WEFT_BAKED_RIM_AMPLITUDE, 1},  {"opacity", WEFT_BAKED_OPACITY, 1}};
    for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++) {
        double values[4] = {0};
        const weft_rad_member *const m = own(p, rows[i].property, inherited);
        if (!m || (only_said && weft_material_type_find(m->set_by)))
            continue;
        if (rows[i].planes == 3)
            weft_rad_colour(p, rows[i].property, 1, values);
        else
            values[0] = weft_rad_number(p, rows[i].property, 0);
        set_constant(baked, rows[i].kind, rows[i].planes, values);
    }
    const weft_rad_member *const rotation = own(p, "tangent_rotation_deg", inherited);
    if (rotation && !(only_said && weft_material_type_find(rotation->set_by))) {
        const double turn = weft_rad_number(p, "tangent_rotation_deg", 0) * acos(-1) / 180;
        const double direction[4] = {cos(turn), sin(turn), 0, 0};
        set_constant(baked, WEFT_BAKED_TANGENT, 2, direction);
    }
}

static void apply_factors(weft_baked *baked, const weft_rad_record *p, const weft_asset *inherited)
{
    static const double black[4] = {0, 0, 0, 0};
    double tint[3];
    if (own(p, "albedo_tint_color", inherited)) {
        weft_rad_colour(p, "albedo_tint_color", 1, tint);
        multiply(baked, WEFT_BAKED_ALBEDO, tint, 3);
    }
    if (own(p, "specular_tint_color", inherited)) {
        weft_rad_colour(p, "specular_tint_color", 1, tint);
        multiply(baked, WEFT_BAKED_SPECULAR, tint, 3);
    }
    const double strength =
        own(p, "normal_strength", inherited) ? weft_rad_number(p, "normal_strength", 1) : 1;
    if (fabs(strength - 1) > 0)
        steepen(baked, strength);
    if (own(p, "enable_diffuse", inherited) && !weft_rad_flag(p, "enable_diffuse", true))
        set_constant(baked, WEFT_BAKED_ALBEDO, 3, black);
    if (own(p, "enable_specular", inherited) && !weft_rad_flag(p, "enable_specular", true))
        set_constant(baked, WEFT_BAKED_SPECULAR, 3, black);
}

weft_err weft_composite_apply_own(const weft_compositor *c, weft_baked *baked, const weft_rad_record *p,
                                  const weft_asset *inherited, weft_error *err)
{
    const weft_rad_member *const u3m = own(p, "u3m", inherited);
    if (u3m) { /* what its own asset and those derived from it set lies over it, what it derives from below */
        const weft_asset *setter;
        WEFT_TRY(weft_assets_find(c->assets, u3m->set_by, &setter, err));
        WEFT_TRY(put_u3m(c, baked, u3m, err));
        apply_constants(baked, p, setter->base, true);
    } else {
        apply_constants(baked, p, inherited, false);
    }
    const weft_rad_member *const scan = own(p, "scan", inherited);
    if (scan)
        WEFT_TRY(put_scan(c, baked, scan, err));
    for (int i = 0; i < WEFT_COMPOSITE_TEXTURES; i++) {
        const weft_rad_member *const m = own(p, weft_composite_textures[i].property, inherited);
        if (m && weft_rad_at(&m->value->record, "name"))
            WEFT_TRY(put_texture(c, baked, &weft_composite_textures[i], &m->value->record, err));
    }
    apply_factors(baked, p, inherited);
    return WEFT_OK;
}
