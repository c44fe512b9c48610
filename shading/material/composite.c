#include "shading/material/composite.h"

#include "core/file.h"
#include "core/mem.h"
#include "shading/material/blend.h"
#include "shading/material/mask.h"
#include "shading/material/texture.h"
#include "shading/u3m/u3m_document.h"

#include <math.h>
#include <string.h>

enum { DEFAULT_SIDE = 256, MAX_DEPTH = 64 };

void weft_scan_fini(weft_scan *scan)
{
    weft_image *const images[] = {&scan->albedo,    &scan->normal, &scan->specular,
                                  &scan->roughness, &scan->height, &scan->opacity};
    for (size_t i = 0; i < sizeof images / sizeof images[0]; i++)
        weft_image_fini(images[i]);
    *scan = (weft_scan){0};
}

/* A texture property and where it goes. */
typedef struct texture_row {
    const char *property;
    weft_texture_use use;
    weft_baked_kind kind;
    bool multiplies; /* the constant of the property beside it */
} texture_row;

static const texture_row textures[] = {
    {"albedo_map", WEFT_TEXTURE_COLOUR, WEFT_BAKED_ALBEDO, false},
    {"specular_map", WEFT_TEXTURE_SCALAR, WEFT_BAKED_SPECULAR, true},
    {"roughness_map", WEFT_TEXTURE_SCALAR, WEFT_BAKED_ROUGHNESS, true},
    {"normal_map", WEFT_TEXTURE_NORMAL, WEFT_BAKED_NORMAL, false},
    {"height_map", WEFT_TEXTURE_SCALAR, WEFT_BAKED_HEIGHT, false},
    {"occlusion_map", WEFT_TEXTURE_SCALAR, WEFT_BAKED_OCCLUSION, false},
    {"opacity_map", WEFT_TEXTURE_SCALAR, WEFT_BAKED_OPACITY, true},
};

void weft_runtime_layers_fini(weft_runtime_layers *layers)
{
    weft_baked_fini(&layers->base);
    for (int k = 0; k < WEFT_RUNTIME_LAYERS_MAX; k++) {
        weft_baked_fini(&layers->layers[k].baked);
        weft_image_fini(&layers->layers[k].alpha);
    }
    *layers = (weft_runtime_layers){0};
}

typedef struct compositor {
    weft_assets *assets;
    const weft_composite_options *options;
    int width, height;
    double size_mm[2], thickness_mm, weight_gsm;
    bool periodic;
    weft_runtime_layers *runtime; /* gets the outermost material's; NULL: nobody asks */
} compositor;

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

/* Of a scan or a U3M: beside the text that names it. */
static weft_err source_path(const weft_rad_member *source, char **path, weft_error *err)
{
    char *const folder = weft_path_folder(source->value->place.source->path, err);
    *path =
        folder ? weft_path_join(strcmp(folder, ".") == 0 ? NULL : folder, source->value->text, err) : NULL;
    weft_free(folder);
    return *path ? WEFT_OK : WEFT_ERR_NOMEM;
}

static weft_err load_scan(const compositor *c, const weft_rad_member *member, weft_scan *scan,
                          weft_error *err)
{
    char *path;
    if (!c->options->load_scan)
        return weft_fail(err, WEFT_ERR_UNSUPPORTED, "%s: scans cannot be read here",
                         weft_place_text(member->place));
    WEFT_TRY(source_path(member, &path, err));
    *scan = (weft_scan){0};
    weft_err status = c->options->load_scan(c->options->context, path, scan, err);
    weft_free(path);
    if (status == WEFT_OK && scan->normal.planes == 0 && scan->albedo.planes == 0)
        status = weft_fail(err, WEFT_ERR_MISSING, "the scan has neither normals nor albedo");
    return status == WEFT_OK ? WEFT_OK
                             : weft_prefix(err, status, "%s", weft_place_text(member->value->place));
}

static weft_err open_u3m(const weft_rad_member *member, weft_u3m **u3m, weft_error *err)
{
    char *path;
    WEFT_TRY(source_path(member, &path, err));
    const weft_err status = weft_u3m_open(path, u3m, err);
    weft_free(path);
    return status == WEFT_OK ? WEFT_OK
                             : weft_prefix(err, status, "%s", weft_place_text(member->value->place));
}

/* -- the files and the size --------------------------------------------------------------------------- */

typedef weft_err visit_fn(void *context, weft_assets *assets, const weft_rad_record *properties,
                          weft_error *err);

/* Calls `fn` for the material and all that lies in its layers. */
static weft_err visit(weft_assets *assets, const weft_rad_record *properties, visit_fn *fn, void *context,
                      int depth, weft_error *err)
{
    WEFT_TRY(fn(context, assets, properties, err));
    static const char *const lists[] = {"layers", "runtime_layers"};
    for (int k = 0; k < 2; k++) {
        const weft_rad_member *const layers = weft_rad_at(properties, lists[k]);
        for (const weft_rad_value *item = layers ? layers->value->items : NULL; item && depth < MAX_DEPTH;
             item = item->next) {
            weft_asset layer;
            WEFT_TRY(weft_assets_layer(assets, &item->record, &layer, err));
            WEFT_TRY(visit(assets, &layer.properties, fn, context, depth + 1, err));
        }
    }
    return WEFT_OK;
}

typedef struct input_visit {
    weft_composite_input_fn *fn;
    void *context;
} input_visit;

static weft_err visit_texture(const input_visit *v, const weft_rad_record *record, weft_error *err)
{
    const weft_rad_member *const name = weft_rad_at(record, "name");
    char *path;
    if (!name)
        return WEFT_OK;
    WEFT_TRY(weft_texture_path(name->value, &path, err));
    v->fn(v->context, path, false);
    weft_free(path);
    return WEFT_OK;
}

/* The document, and of one that is no archive the files beside it. */
static weft_err visit_u3m(const input_visit *v, const weft_rad_member *member, weft_error *err)
{
    char *path, *folder = NULL;
    weft_u3m *u3m = NULL;
    WEFT_TRY(source_path(member, &path, err));
    v->fn(v->context, path, false);
    weft_err status = WEFT_OK;
    if (!weft_path_has_suffix(path, ".u3ma")) {
        folder = weft_path_folder(path, err);
        status = folder ? open_u3m(member, &u3m, err) : WEFT_ERR_NOMEM;
    }
    for (int i = 1; u3m && i < weft_u3m_files_count(u3m->files) && status == WEFT_OK; i++) {
        char *const file = weft_path_join(folder, weft_u3m_files_name(u3m->files, i), err);
        if (file)
            v->fn(v->context, file, false);
        else
            status = WEFT_ERR_NOMEM;
        weft_free(file);
    }
    weft_u3m_close(u3m);
    weft_free(folder);
    weft_free(path);
    return status;
}

static weft_err visit_inputs(void *context, weft_assets *assets, const weft_rad_record *p, weft_error *err)
{
    const input_visit *const v = context;
    (void)assets;
    for (size_t i = 0; i < sizeof textures / sizeof textures[0]; i++) {
        const weft_rad_member *const m = weft_rad_at(p, textures[i].property);
        if (m)
            WEFT_TRY(visit_texture(v, &m->value->record, err));
    }
    const weft_rad_member *const mask = weft_rad_at(p, "mask"), *const scan = weft_rad_at(p, "scan");
    const weft_rad_member *const u3m = weft_rad_at(p, "u3m");
    if (mask)
        WEFT_TRY(visit_texture(v, &mask->value->record, err));
    if (u3m)
        WEFT_TRY(visit_u3m(v, u3m, err));
    if (scan) {
        char *path;
        WEFT_TRY(source_path(scan, &path, err));
        v->fn(v->context, path, true);
        weft_free(path);
    }
    return WEFT_OK;
}

weft_err weft_composite_inputs(weft_assets *assets, const weft_asset *asset, weft_composite_input_fn *fn,
                               void *context, weft_error *err)
{
    input_visit v = {fn, context};
    return visit(assets, &asset->properties, visit_inputs, &v, 0, err);
}

static void grow(compositor *c, int width, int height)
{
    if ((long)width * height > (long)c->width * c->height) {
        c->width = width;
        c->height = height;
    }
}

static weft_err grow_by_u3m(compositor *c, const weft_rad_member *member, weft_error *err)
{
    weft_u3m *u3m;
    int width, height;
    WEFT_TRY(open_u3m(member, &u3m, err));
    const weft_err status = weft_u3m_measure(u3m, &width, &height, err);
    if (status == WEFT_OK) {
        grow(c, width, height);
        if (!(c->thickness_mm > 0))
            c->thickness_mm = u3m->thickness_mm;
        if (!(c->weight_gsm > 0))
            c->weight_gsm = u3m->weight_gsm;
        if (!(c->size_mm[0] > 0)) {
            memcpy(c->size_mm, u3m->size_mm, sizeof c->size_mm);
            c->periodic = true; /* U3M's pictures repeat */
        }
    }
    weft_u3m_close(u3m);
    return status == WEFT_OK ? WEFT_OK
                             : weft_prefix(err, status, "%s", weft_place_text(member->value->place));
}

/* The largest picture decides the size; the outermost scan of known scale the millimetres. */
static weft_err visit_size(void *context, weft_assets *assets, const weft_rad_record *p, weft_error *err)
{
    compositor *const c = context;
    (void)assets;
    const weft_rad_member *const scan_name = weft_rad_at(p, "scan");
    if (scan_name) {
        weft_scan scan;
        WEFT_TRY(load_scan(c, scan_name, &scan, err));
        const weft_image *const one = scan.normal.planes ? &scan.normal : &scan.albedo;
        grow(c, one->width, one->height);
        if (!(c->size_mm[0] > 0)) {
            c->size_mm[0] = scan.mm_per_px * one->width;
            c->size_mm[1] = scan.mm_per_px * one->height;
            c->periodic = c->periodic || scan.periodic;
        }
        weft_scan_fini(&scan);
    }
    if (weft_rad_at(p, "u3m"))
        WEFT_TRY(grow_by_u3m(c, weft_rad_at(p, "u3m"), err));
    for (size_t i = 0; i < sizeof textures / sizeof textures[0]; i++) {
        const weft_rad_member *const m = weft_rad_at(p, textures[i].property);
        if (!m || !weft_rad_at(&m->value->record, "name"))
            continue;
        weft_image image;
        WEFT_TRY(weft_texture_read(&m->value->record, textures[i].use, &image, err));
        grow(c, image.width, image.height);
        weft_image_fini(&image);
    }
    return WEFT_OK;
}

/* -- one material's own properties -------------------------------------------------------------------- */

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
static weft_err put(const compositor *c, weft_baked *baked, weft_baked_kind kind, const weft_image *image,
                    weft_texture_use use, const double tiling[2], bool multiplies, weft_error *err)
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

static weft_err put_scan(const compositor *c, weft_baked *baked, const weft_rad_member *member,
                         weft_error *err)
{
    weft_scan scan;
    WEFT_TRY(load_scan(c, member, &scan, err));
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
static weft_err put_u3m(const compositor *c, weft_baked *baked, const weft_rad_member *member,
                        weft_error *err)
{
    weft_u3m *u3m;
    weft_baked from = {0};
    WEFT_TRY(open_u3m(member, &u3m, err));
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

static weft_err put_texture(const compositor *c, weft_baked *baked, const texture_row *row,
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

/* @param inherited  over a composite: what lies above the asset that has the layers, and is not its own */
static weft_err apply_own(const compositor *c, weft_baked *baked, const weft_rad_record *p,
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
    for (size_t i = 0; i < sizeof textures / sizeof textures[0]; i++) {
        const weft_rad_member *const m = own(p, textures[i].property, inherited);
        if (m && weft_rad_at(&m->value->record, "name"))
            WEFT_TRY(put_texture(c, baked, &textures[i], &m->value->record, err));
    }
    apply_factors(baked, p, inherited);
    return WEFT_OK;
}

/* -- layers ------------------------------------------------------------------------------------------- */

static weft_err composite(const compositor *c, const weft_asset *asset, int depth, weft_baked *baked,
                          weft_error *err);

static unsigned channels_of(const weft_rad_record *p)
{
    static const struct {
        const char *name;
        unsigned channels;
    } names[] = {{"albedo", WEFT_BLEND_ALBEDO},
                 {"specular", WEFT_BLEND_SPECULAR},
                 {"normal", WEFT_BLEND_NORMAL},
                 {"albedo_specular", WEFT_BLEND_ALBEDO | WEFT_BLEND_SPECULAR},
                 {"specular_normal", WEFT_BLEND_SPECULAR | WEFT_BLEND_NORMAL}};
    for (size_t i = 0; i < sizeof names / sizeof names[0]; i++)
        if (strcmp(weft_rad_text(p, "channels", "all"), names[i].name) == 0)
            return names[i].channels;
    return WEFT_BLEND_ALL;
}

/* The library's name, or with a number where the layer sets anything of the material itself. */
static void name_layer(const weft_rad_value *item, int index, weft_runtime_layer *layer)
{
    static const char *const of_layers[] = {"alpha", "mask", "channels", "blend"};
    bool is_own = false;
    for (const weft_rad_member *m = item->record.members; m; m = m->next) {
        bool known = false;
        for (int k = 0; k < 4; k++)
            known = known || strcmp(m->name, of_layers[k]) == 0;
        is_own = is_own || !known;
    }
    if (is_own)
        (void)snprintf(layer->name, sizeof layer->name, "%.100s_%d", item->record.base, index);
    else
        (void)snprintf(layer->name, sizeof layer->name, "%.100s", item->record.base);
}

/* Keeps a layer as it was laid: `above` and `mask` are taken over. */
static void keep_layer(weft_runtime_layer *to, weft_baked *above, weft_image *mask, float alpha)
{
    to->baked = *above;
    to->alpha = *mask;
    to->constant = alpha;
    *above = (weft_baked){0};
    *mask = (weft_image){0};
    for (size_t i = 0; to->alpha.planes && i < weft_image_plane_size(&to->alpha); i++)
        to->alpha.data[i] = fminf(fmaxf(alpha * to->alpha.data[i], 0), 1);
}

/* @param keep  gets the layer; NULL: nobody asks */
static weft_err lay(const compositor *c, const weft_rad_value *item, int depth, weft_baked *below,
                    weft_runtime_layer *keep, weft_error *err)
{
    weft_asset layer;
    weft_baked above = {0};
    weft_image mask = {0};
    WEFT_TRY(weft_assets_layer(c->assets, &item->record, &layer, err));
    weft_err status = composite(c, &layer, depth + 1, &above, err);
    const weft_rad_member *const record = weft_rad_at(&layer.properties, "mask");
    if (status == WEFT_OK && record)
        status = weft_mask_make(&record->value->record, below, &mask, err);
    const double alpha = weft_rad_number(&layer.properties, "alpha", 1);
    const unsigned channels = channels_of(&layer.properties);
    const bool reorient = strcmp(weft_rad_text(&layer.properties, "blend", "slope"), "rnm") == 0;
    if (status == WEFT_OK)
        status = weft_blend(below, &above, mask.planes ? mask.data : NULL, alpha, channels, reorient, err);
    if (status == WEFT_OK && keep) {
        keep->channels = channels;
        keep->reorient = reorient;
        keep_layer(keep, &above, &mask, (float)alpha);
    }
    if (status != WEFT_OK)
        weft_prefix(err, status, "%s: layer '%s'", weft_place_text(item->place), item->record.base);
    weft_image_fini(&mask);
    weft_baked_fini(&above);
    return status;
}

/* What an engine would blend lies over everything else; here it is flattened. */
static weft_err lay_runtime(const compositor *c, const weft_asset *asset, int depth, weft_baked *baked,
                            weft_error *err)
{
    const weft_rad_member *const list = weft_rad_at(&asset->properties, "runtime_layers");
    weft_runtime_layers *const keep = depth == 0 ? c->runtime : NULL;
    const weft_rad_value *item = list ? list->value->items : NULL;
    if (item && keep)
        WEFT_TRY(weft_baked_copy(baked, &keep->base, err));
    for (int index = 0; item; item = item->next, index++) {
        weft_runtime_layer *const layer =
            keep && keep->n < WEFT_RUNTIME_LAYERS_MAX ? &keep->layers[keep->n++] : NULL;
        if (layer)
            name_layer(item, index, layer);
        WEFT_TRY(lay(c, item, depth, baked, layer, err));
    }
    return WEFT_OK;
}

static weft_err composite(const compositor *c, const weft_asset *asset, int depth, weft_baked *baked,
                          weft_error *err)
{
    if (depth > MAX_DEPTH)
        return weft_fail(err, WEFT_ERR_FORMAT, "%s: layers lie in layers deeper than %d", asset->name,
                         MAX_DEPTH);
    WEFT_TRY(weft_baked_init(baked, asset->name, asset->type, err));
    baked->width = c->width;
    baked->height = c->height;
    memcpy(baked->size_mm, c->size_mm, sizeof baked->size_mm);
    baked->periodic = c->periodic;
    const weft_rad_member *const layers = weft_rad_at(&asset->properties, "layers");
    weft_err status = WEFT_OK;
    for (const weft_rad_value *item = layers ? layers->value->items : NULL; item && status == WEFT_OK;
         item = item->next) {
        if (item == layers->value->items) { /* nothing of the type's defaults lies under the lowest */
            weft_asset lowest;
            status = weft_assets_layer(c->assets, &item->record, &lowest, err);
            if (status == WEFT_OK)
                baked->type = lowest.type;
            baked->maps[WEFT_BAKED_CLOTH].constant[0] = baked->type->model == WEFT_MATERIAL_CLOTH;
        }
        if (status == WEFT_OK)
            status = lay(c, item, depth, baked, NULL, err);
    }
    const weft_asset *layered =
        NULL; /* the asset whose text has the layers: what it derives from is below them */
    if (status == WEFT_OK && layers && layers->value->items)
        status = weft_assets_find(c->assets, layers->set_by, &layered, err);
    if (status == WEFT_OK)
        status = apply_own(c, baked, &asset->properties, layered ? layered->base : NULL, err);
    if (status == WEFT_OK)
        status = lay_runtime(c, asset, depth, baked, err);
    if (status != WEFT_OK)
        weft_baked_fini(baked);
    return status;
}

weft_err weft_composite_u3m(const weft_asset *asset, char **path, weft_error *err)
{
    const weft_rad_member *const member = weft_rad_at(&asset->properties, "u3m");
    *path = NULL;
    return member ? source_path(member, path, err) : WEFT_OK;
}

static weft_err run(weft_assets *assets, const weft_asset *asset, const weft_composite_options *options,
                    weft_runtime_layers *runtime, weft_baked *baked, weft_error *err)
{
    compositor c = {.assets = assets, .options = options, .periodic = options->periodic, .runtime = runtime};
    const weft_rad_record *const p = &asset->properties;
    c.size_mm[0] = weft_rad_number(p, "width_mm", 0);
    c.size_mm[1] = weft_rad_number(p, "height_mm", 0);
    c.thickness_mm = weft_rad_number(p, "thickness_mm", 0);
    c.weight_gsm = weft_rad_number(p, "weight_gsm", 0);
    *baked = (weft_baked){0};
    WEFT_TRY(visit(assets, p, visit_size, &c, 0, err));
    if (options->width > 0) {
        c.width = options->width;
        c.height = options->height;
    } else if (c.width == 0) {
        c.width = c.height = DEFAULT_SIDE;
    }
    const weft_err status = composite(&c, asset, 0, baked, err);
    if (status == WEFT_OK) {
        baked->thickness_mm = c.thickness_mm;
        baked->weight_gsm = c.weight_gsm;
    }
    return status;
}

weft_err weft_composite(weft_assets *assets, const weft_asset *asset, const weft_composite_options *options,
                        weft_baked *baked, weft_error *err)
{
    return run(assets, asset, options, NULL, baked, err);
}

weft_err weft_composite_runtime(weft_assets *assets, const weft_asset *asset,
                                const weft_composite_options *options, weft_runtime_layers *layers,
                                weft_error *err)
{
    weft_baked flat;
    *layers = (weft_runtime_layers){0};
    const weft_err status = run(assets, asset, options, layers, &flat, err);
    if (status == WEFT_OK)
        weft_baked_fini(&flat);
    else
        weft_runtime_layers_fini(layers);
    return status;
}
