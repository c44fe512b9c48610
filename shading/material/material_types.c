#include "shading/material/material_types.h"

#include "core/fields.h"

#include <string.h>

const weft_material_type weft_material_types[] = {
    {"opaquematerial", WEFT_MATERIAL_OPAQUE, "ggx", "GGX over Lambert, the same in all directions"},
    {"anisotropicmaterial", WEFT_MATERIAL_ANISOTROPIC, "ggx-aniso",
     "GGX stretched along the threads, over Lambert: satin, silk, brushed fibre"},
    {"clothmaterial", WEFT_MATERIAL_CLOTH, "cloth-two-tone",
     "fibres that stand: a rim lobe with its own tint, over Lambert: velvet, flannel, cotton"},
    {0},
};

#define FLAG   .type = WEFT_PROPERTY_FLAG
#define NUMBER .type = WEFT_PROPERTY_NUMBER
#define COLOUR .type = WEFT_PROPERTY_COLOUR, .min = 0, .max = 1
#define TEXT   .type = WEFT_PROPERTY_TEXT
#define CHOICE .type = WEFT_PROPERTY_CHOICE

static const weft_property texture[] = {
    {.name = "name", TEXT, .help = "the image file, beside the text that names it"},
    {.name = "channel",
     CHOICE,
     .choices = "all|r|g|b|a",
     .def = "all",
     .help = "which channel of the image is read"},
    {.name = "transfer",
     CHOICE,
     .choices = "auto|linear|srgb",
     .def = "auto",
     .help = "how its numbers are coded; auto: colour in 8 and 16 bit is sRGB, all else linear"},
    {.name = "green",
     CHOICE,
     .choices = "up|down",
     .def = "up",
     .help = "of a normal map: whether green grows upwards (OpenGL) or downwards (DirectX)"},
    {.name = "scale", NUMBER, .min = -1e6, .max = 1e6, .def = "1", .help = "multiplies what is read"},
    {.name = "offset", NUMBER, .min = -1e6, .max = 1e6, .def = "0", .help = "is added after scale"},
    {.name = "tiling",
     .type = WEFT_PROPERTY_NUMBERS,
     .min = 1e-3,
     .max = 1e3,
     .def = "[1, 1]",
     .help = "repeats across and down over the material"},
    {0},
};

static const weft_property mask[] = {
    {.name = "name", TEXT, .help = "an image file as the mask, beside the text that names it"},
    {.name = "channel",
     CHOICE,
     .choices = "all|r|g|b|a",
     .def = "all",
     .help = "which channel of the image is read"},
    {.name = "from",
     CHOICE,
     .choices = "file|cavity|height|slope|noise",
     .def = "file",
     .help = "an image, or made from the layers below: their cavities, height or slope, or from noise"},
    {.name = "low", NUMBER, .min = -1e6, .max = 1e6, .def = "0", .help = "value that becomes 0"},
    {.name = "high",
     NUMBER,
     .min = -1e6,
     .max = 1e6,
     .def = "1",
     .help = "value that becomes 1; below low inverts"},
    {.name = "period",
     NUMBER,
     .min = 1,
     .max = 4096,
     .def = "16",
     .help = "of noise: cells across the material"},
    {.name = "seed", NUMBER, .min = 0, .max = 1e9, .def = "1", .help = "of noise"},
    {.name = "tiling",
     .type = WEFT_PROPERTY_NUMBERS,
     .min = 1e-3,
     .max = 1e3,
     .def = "[1, 1]",
     .help = "repeats across and down over the material"},
    {0},
};

static const weft_property layer[] = {
    {.name = "alpha",
     NUMBER,
     .min = 0,
     .max = 1,
     .def = "1",
     .help = "opacity of the layer; multiplies the mask"},
    {.name = "mask", .type = WEFT_PROPERTY_RECORD, .members = mask, .help = "where the layer lies"},
    {.name = "channels",
     CHOICE,
     .choices = "all|albedo|specular|normal|albedo_specular|specular_normal",
     .def = "all",
     .help = "which of the layer's properties are blended"},
    {.name = "blend",
     CHOICE,
     .choices = "slope|rnm",
     .def = "slope",
     .help = "how its normals are blended: lerp of slopes, or reoriented on the layers below"},
    {0},
};

#define TEXTURE .type = WEFT_PROPERTY_RECORD, .members = texture

const weft_property weft_material_properties[] = {
    {.name = "scan", TEXT, .help = "a folder of solved maps (NAME.maps): its albedo, normals and scale"},
    {.name = "u3m", TEXT, .help = "a U3M (.u3m or .u3ma): what it says of the surface, and its size"},
    {.name = "width_mm",
     NUMBER,
     .min = 0,
     .max = 1e5,
     .unit = "mm",
     .def = "0",
     .help = "size across; 0: the scan's, or unknown"},
    {.name = "height_mm",
     NUMBER,
     .min = 0,
     .max = 1e5,
     .unit = "mm",
     .def = "0",
     .help = "size up; 0: the scan's, or unknown"},
    {.name = "thickness_mm",
     NUMBER,
     .min = 0,
     .max = 100,
     .unit = "mm",
     .def = "0",
     .help = "of the cloth; 0: unknown"},
    {.name = "weight_gsm",
     NUMBER,
     .min = 0,
     .max = 1e4,
     .unit = "g/m2",
     .def = "0",
     .help = "of the cloth; 0: unknown"},

    {.name = "enable_diffuse",
     .alias = "enable_diffuse_",
     FLAG,
     .def = "true",
     .help = "whether it has a diffuse part"},
    {.name = "albedo_color",
     COLOUR,
     .def = "0.5",
     .help = "diffuse reflectance where there is no map or scan"},
    {.name = "albedo_map", TEXTURE, .help = "diffuse reflectance"},
    {.name = "albedo_tint_color",
     .type = WEFT_PROPERTY_COLOUR,
     .min = 0,
     .max = 4,
     .def = "1",
     .help = "multiplies the diffuse reflectance"},

    {.name = "enable_specular",
     .alias = "enable_specular_",
     FLAG,
     .def = "true",
     .help = "whether it has a specular part"},
    {.name = "specular_intensity",
     NUMBER,
     .min = 0,
     .max = 1,
     .def = "0.04",
     .help = "reflectance at normal incidence, F0"},
    {.name = "specular_tint_color", COLOUR, .def = "1", .help = "multiplies F0: the colour of metal thread"},
    {.name = "specular_map", TEXTURE, .help = "multiplies specular_intensity"},
    {.name = "specular_roughness",
     NUMBER,
     .min = 1e-3,
     .max = 1,
     .def = "0.5",
     .help = "width of the lobe, alpha"},
    {.name = "roughness_map", TEXTURE, .help = "multiplies specular_roughness"},
    {.name = "anisotropy",
     NUMBER,
     .min = 0,
     .max = 1,
     .def = "0",
     .models = WEFT_MATERIAL_ANISOTROPIC,
     .help = "how much narrower the lobe is across the threads: alpha_b = alpha (1 - anisotropy)"},
    {.name = "tangent_rotation_deg",
     NUMBER,
     .min = -360,
     .max = 360,
     .unit = "deg",
     .def = "0",
     .models = WEFT_MATERIAL_ANISOTROPIC,
     .help = "direction of the threads from the map's right, anticlockwise"},
    {.name = "front_tint_color",
     COLOUR,
     .def = "1",
     .models = WEFT_MATERIAL_CLOTH,
     .help = "tint of what the fibres reflect to the front"},
    {.name = "rim_tint_color", COLOUR, .def = "1", .models = WEFT_MATERIAL_CLOTH, .help = "tint of the rim"},
    {.name = "rim_amplitude",
     NUMBER,
     .min = 0,
     .max = 4,
     .def = "4",
     .models = WEFT_MATERIAL_CLOTH,
     .help = "weight of the rim lobe against the constant offset"},

    {.name = "normal_map", TEXTURE, .help = "tangent-space normals"},
    {.name = "normal_strength", NUMBER, .min = 0, .max = 8, .def = "1", .help = "multiplies the slopes"},
    {.name = "height_map", TEXTURE, .help = "height in millimetres after scale and offset"},
    {.name = "occlusion_map", TEXTURE, .help = "ambient occlusion, 1 open"},
    {.name = "opacity", NUMBER, .min = 0, .max = 1, .def = "1", .help = "1: no light passes"},
    {.name = "opacity_map", TEXTURE, .help = "multiplies opacity: holes in lace"},

    {.name = "layers",
     .type = WEFT_PROPERTY_LAYERS,
     .members = layer,
     .help = "materials laid over each other, bottom first; the material's own properties come last"},
    {.name = "runtime_layers",
     .type = WEFT_PROPERTY_LAYERS,
     .members = layer,
     .help = "up to four materials which the engine blends: exported as masks and shared materials"},
    {0},
};

const weft_material_type *weft_material_type_find(const char *name)
{
    for (const weft_material_type *type = weft_material_types; type->name; type++)
        if (strcmp(type->name, name) == 0)
            return type;
    return NULL;
}

const weft_property *weft_property_find(const weft_property *table, const char *name)
{
    for (const weft_property *p = table; p->name; p++)
        if (strcmp(p->name, name) == 0 || (p->alias && strcmp(p->alias, name) == 0))
            return p;
    return NULL;
}

const weft_property *weft_property_nearest(const weft_property *table, unsigned model, const char *name)
{
    const weft_property *nearest = NULL;
    int least = 1 + (int)strlen(name) / 3;
    for (const weft_property *p = table; p->name; p++) {
        const int distance = weft_text_distance(p->name, name);
        if ((!p->models || (p->models & model)) && distance <= least) {
            least = distance - 1;
            nearest = p;
        }
    }
    return nearest;
}

const char *weft_property_type_name(weft_property_type type)
{
    static const char *const names[] = {
        [WEFT_PROPERTY_FLAG] = "true or false", [WEFT_PROPERTY_NUMBER] = "a number",
        [WEFT_PROPERTY_COLOUR] = "a colour",    [WEFT_PROPERTY_TEXT] = "a text",
        [WEFT_PROPERTY_CHOICE] = "a choice",    [WEFT_PROPERTY_NUMBERS] = "a list of numbers",
        [WEFT_PROPERTY_RECORD] = "a record",    [WEFT_PROPERTY_LAYERS] = "a list of layers",
    };
    return names[type];
}
