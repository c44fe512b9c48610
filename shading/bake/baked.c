#include "shading/bake/baked.h"

#include "core/mem.h"

#include <string.h>

const weft_baked_row weft_baked_rows[WEFT_BAKED_COUNT] = {
    [WEFT_BAKED_ALBEDO] = {"albedo", 3, {0.5F, 0.5F, 0.5F}, "", {"R", "G", "B"}, "diffuse reflectance"},
    [WEFT_BAKED_SPECULAR] =
        {"specular", 3, {0.04F, 0.04F, 0.04F}, "", {"R", "G", "B"}, "reflectance at normal incidence"},
    [WEFT_BAKED_ROUGHNESS] =
        {"roughness", 1, {0.5F}, "", {"Y"}, "width of the lobe along the tangent, alpha"},
    [WEFT_BAKED_ANISOTROPY] = {"anisotropy", 1, {0}, "", {"Y"}, "s in alpha_b = alpha (1 - s)"},
    [WEFT_BAKED_TANGENT] = {"tangent", 2, {1, 0}, "", {"X", "Y"}, "direction of the threads"},
    [WEFT_BAKED_NORMAL] = {"normal", 3, {0, 0, 1}, "", {"X", "Y", "Z"}, "unit normal"},
    [WEFT_BAKED_NORMAL_LENGTH] = {"normal_length", 1, {1}, "", {"Y"}, "length of the averaged normal"},
    [WEFT_BAKED_HEIGHT] = {"height", 1, {0}, "mm", {"Z"}, "height about its mean"},
    [WEFT_BAKED_OCCLUSION] = {"occlusion", 1, {1}, "", {"Y"}, "ambient visibility, 1 open"},
    [WEFT_BAKED_BENT_CONE] = {"bent_cone",
                              4,
                              {0, 0, 1, 0},
                              "",
                              {"X", "Y", "Z", "W"},
                              "mean open direction, cosine of the cone's half angle"},
    [WEFT_BAKED_CAVITY] = {"cavity", 1, {0.5F}, "", {"Y"}, "0 in grooves, 1 on ridges"},
    [WEFT_BAKED_CURVATURE] = {"curvature", 1, {0}, "1/mm", {"Y"}, "mean curvature, positive on ridges"},
    [WEFT_BAKED_OPACITY] = {"opacity", 1, {1}, "", {"Y"}, "1 where no light passes"},
    [WEFT_BAKED_CLOTH] = {"cloth", 1, {0}, "", {"Y"}, "weight of the cloth lobe against GGX"},
    [WEFT_BAKED_FRONT_TINT] =
        {"front_tint", 3, {1, 1, 1}, "", {"R", "G", "B"}, "tint of the cloth lobe's front"},
    [WEFT_BAKED_RIM_TINT] = {"rim_tint", 3, {1, 1, 1}, "", {"R", "G", "B"}, "tint of the cloth lobe's rim"},
    [WEFT_BAKED_RIM_AMPLITUDE] = {"rim_amplitude", 1, {4}, "", {"Y"}, "weight of the rim"},
    [WEFT_BAKED_DETAIL_ALBEDO] = {"detail_albedo", 3, {1, 1, 1}, "", {"R", "G", "B"}, "albedo over its base"},
    [WEFT_BAKED_DETAIL_NORMAL] =
        {"detail_normal", 3, {0, 0, 1}, "", {"X", "Y", "Z"}, "normal without its base"},
    [WEFT_BAKED_CLOTH_ALBEDO] =
        {"cloth_albedo", 3, {0.5F, 0.5F, 0.5F}, "", {"R", "G", "B"}, "diffuse reflectance of the cloth part"},
    [WEFT_BAKED_CLOTH_SPECULAR] =
        {"cloth_specular", 3, {0.04F, 0.04F, 0.04F}, "", {"R", "G", "B"}, "F0 of the cloth part"},
    [WEFT_BAKED_CLOTH_ROUGHNESS] = {"cloth_roughness", 1, {0.5F}, "", {"Y"}, "alpha of the cloth part"},
};

weft_err weft_baked_init(weft_baked *baked, const char *name, const weft_material_type *type, weft_error *err)
{
    char *const copy = weft_strdup(name, err);
    if (!copy)
        return WEFT_ERR_NOMEM;
    *baked = (weft_baked){.name = copy, .type = type, .enable_diffuse = true, .enable_specular = true};
    for (int k = 0; k < WEFT_BAKED_COUNT; k++)
        memcpy(baked->maps[k].constant, weft_baked_rows[k].def, sizeof baked->maps[k].constant);
    if (type && type->model == WEFT_MATERIAL_CLOTH)
        baked->maps[WEFT_BAKED_CLOTH].constant[0] = 1;
    return WEFT_OK;
}

void weft_baked_fini(weft_baked *baked)
{
    for (int k = 0; k < WEFT_BAKED_COUNT; k++)
        for (int level = 0; level < WEFT_BAKED_MAX_MIPS; level++)
            weft_image_fini(&baked->maps[k].mips[level]);
    weft_free(baked->name);
    weft_free(baked->u3m);
    json_decref(baked->provenance);
    *baked = (weft_baked){0};
}

weft_err weft_baked_copy(const weft_baked *from, weft_baked *to, weft_error *err)
{
    WEFT_TRY(weft_baked_init(to, from->name, from->type, err));
    weft_err status = WEFT_OK;
    to->width = from->width;
    to->height = from->height;
    memcpy(to->size_mm, from->size_mm, sizeof to->size_mm);
    to->thickness_mm = from->thickness_mm;
    to->weight_gsm = from->weight_gsm;
    to->periodic = from->periodic;
    to->enable_diffuse = from->enable_diffuse;
    to->enable_specular = from->enable_specular;
    to->two_lobes = from->two_lobes;
    for (int k = 0; k < WEFT_BAKED_COUNT && status == WEFT_OK; k++) {
        memcpy(to->maps[k].constant, from->maps[k].constant, sizeof to->maps[k].constant);
        if (from->maps[k].n_mips > 0)
            status = weft_image_copy(&to->maps[k].mips[0], &from->maps[k].mips[0], err);
        to->maps[k].n_mips = from->maps[k].n_mips > 0 && status == WEFT_OK;
    }
    if (status != WEFT_OK)
        weft_baked_fini(to);
    return status;
}

int weft_baked_levels(int width, int height)
{
    int levels = 1;
    for (int side = width > height ? width : height; side > 1; side /= 2)
        levels++;
    return levels;
}

weft_err weft_baked_add(weft_baked *baked, weft_baked_kind kind, int width, int height, weft_error *err)
{
    weft_baked_map *const map = &baked->maps[kind];
    if (baked->width && (width != baked->width || height != baked->height))
        return weft_fail(err, WEFT_ERR_MISMATCH, "%s: the map %s is %d x %d, the others are %d x %d",
                         baked->name, weft_baked_rows[kind].name, width, height, baked->width, baked->height);
    weft_image image;
    WEFT_TRY(weft_image_init(&image, width, height, weft_baked_rows[kind].planes, err));
    for (int level = 0; level < WEFT_BAKED_MAX_MIPS; level++)
        weft_image_fini(&map->mips[level]);
    map->mips[0] = image;
    map->n_mips = 1;
    baked->width = width;
    baked->height = height;
    return WEFT_OK;
}

weft_baked_kind weft_baked_of_cloth(const weft_baked *baked, weft_baked_kind kind)
{
    if (!baked->two_lobes)
        return kind;
    return kind == WEFT_BAKED_ALBEDO      ? WEFT_BAKED_CLOTH_ALBEDO
           : kind == WEFT_BAKED_SPECULAR  ? WEFT_BAKED_CLOTH_SPECULAR
           : kind == WEFT_BAKED_ROUGHNESS ? WEFT_BAKED_CLOTH_ROUGHNESS
                                          : kind;
}

const char *weft_baked_brdf(const weft_baked *baked)
{
    return baked->two_lobes ? "ggx-cloth" : baked->type->brdf;
}

weft_baked_kind weft_baked_find(const char *name)
{
    int kind = 0;
    while (kind < WEFT_BAKED_COUNT && strcmp(weft_baked_rows[kind].name, name) != 0)
        kind++;
    return (weft_baked_kind)kind;
}
