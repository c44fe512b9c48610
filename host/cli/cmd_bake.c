/* weft bake: a material's text to textures with mips and exports; rebuilds only what changed. */
#include "host/cli/command.h"
#include "host/cli/scan_input.h"

#include "core/file.h"
#include "core/log.h"
#include "core/mem.h"
#include "core/progress.h"
#include "core/shipped.h"
#include "shading/material/build.h"
#include "shading/u3m/u3m_keep.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef struct bake_args {
    const char *output, *material, *exports, *library;
    weft_size size;
    int mips;
    double coverage, reach_mm, detail_mm;
    bool why, check, format, explain, periodic;
} bake_args;

static const weft_field fields[] = {
    {.key = "output",
     .short_opt = 'o',
     .type = WEFT_FIELD_TEXT,
     .offset = offsetof(bake_args, output),
     .unit = "DIR",
     .help = "folder of the baked material; made, or brought up to date"},
    {.key = "material",
     .type = WEFT_FIELD_TEXT,
     .offset = offsetof(bake_args, material),
     .unit = "NAME",
     .help = "which of the file's materials; without it the last"},
    {.key = "export",
     .type = WEFT_FIELD_TEXT,
     .offset = offsetof(bake_args, exports),
     .unit = "LIST",
     .help = "exports to write, separated by commas, or all"},
    {.key = "size",
     .type = WEFT_FIELD_SIZE,
     .offset = offsetof(bake_args, size),
     .help = "of the maps; without it that of the largest scan or picture"},
    {.key = "periodic",
     .type = WEFT_FIELD_FLAG,
     .offset = offsetof(bake_args, periodic),
     .help = "the maps repeat: relief and mips go on over the edges"},
    {.key = "mips",
     .type = WEFT_FIELD_CHOICE,
     .offset = offsetof(bake_args, mips),
     .choices = weft_mip_rule_names,
     .def = "closest",
     .help = "how averaged normals become roughness; docs/materials.md compares the rules"},
    {.key = "coverage",
     .type = WEFT_FIELD_F64,
     .offset = offsetof(bake_args, coverage),
     .min = 0,
     .max = 1,
     .def = "0",
     .help = "opacity at which the engine cuts: mips keep the share of texels above it; 0: do not"},
    {.key = "reach-mm",
     .type = WEFT_FIELD_F64,
     .offset = offsetof(bake_args, reach_mm),
     .min = 0,
     .max = 1000,
     .unit = "MM",
     .def = "2",
     .help = "how far away relief can hide the sky"},
    {.key = "detail-mm",
     .type = WEFT_FIELD_F64,
     .offset = offsetof(bake_args, detail_mm),
     .min = 0,
     .max = 1000,
     .unit = "MM",
     .def = "0",
     .help = "make detail maps: what is finer than this Gaussian's sigma; 0: none"},
    {.key = "why",
     .type = WEFT_FIELD_FLAG,
     .offset = offsetof(bake_args, why),
     .help = "say of each step whether it is rebuilt, and why"},
    {.key = "check",
     .type = WEFT_FIELD_FLAG,
     .offset = offsetof(bake_args, check),
     .help = "only check the text and that its pictures are there"},
    {.key = "format",
     .type = WEFT_FIELD_FLAG,
     .offset = offsetof(bake_args, format),
     .help = "only rewrite the text in the one way it is written; with --check only say whether it is"},
    {.key = "explain",
     .type = WEFT_FIELD_FLAG,
     .offset = offsetof(bake_args, explain),
     .help = "only print every property with the material that set it"},
    {.key = "library",
     .type = WEFT_FIELD_TEXT,
     .offset = offsetof(bake_args, library),
     .unit = "DIR",
     .help = "folder of include <...>; without it the library that comes with Weft"},
    {0},
};

/* -- the text ----------------------------------------------------------------------------------------- */

static weft_err rewrite(const weft_invocation *inv, const char *path, bool only_check, weft_error *err)
{
    char *text = NULL, *formatted = NULL;
    size_t n, n_formatted = 0;
    weft_arena arena = {0};
    weft_diagnostics diagnostics = {.arena = &arena};
    WEFT_TRY(weft_file_read(path, 16 << 20, &text, &n, err));
    const weft_source source = {path, text, n};
    const weft_rad_file *const file = weft_rad_parse(&source, &arena, &diagnostics);
    weft_err status = weft_diagnostics_status(&diagnostics, err);
    FILE *const out = file ? open_memstream(&formatted, &n_formatted) : NULL;
    if (out) {
        weft_rad_format(file, out);
        (void)fclose(out);
    } else if (status == WEFT_OK) {
        status = weft_fail(err, WEFT_ERR_NOMEM, "out of memory");
    }
    if (status != WEFT_OK) {
        weft_diagnostics_print(&diagnostics, stderr);
    } else {
        const bool same = n_formatted == n && memcmp(text, formatted, n) == 0;
        if (!same && only_check)
            status = weft_fail(err, WEFT_ERR_FORMAT,
                               "%s: is not in the one form; weft bake --format rewrites it", path);
        else if (!same)
            status = weft_file_write(path, formatted, n_formatted, err);
        if (status == WEFT_OK)
            fprintf(inv->out, "%s: %s\n", path, same ? "is as it should be" : "rewritten");
    }
    free(formatted);
    weft_free(text);
    weft_arena_fini(&arena);
    return status;
}

static void count_input(void *context, const char *path, bool is_scan)
{
    (void)path, (void)is_scan;
    *(int *)context += 1;
}

static weft_err check(const weft_invocation *inv, weft_assets *assets, weft_error *err)
{
    int materials = 0, inputs = 0;
    for (const weft_asset *asset; (asset = weft_assets_get(assets, materials)); materials++)
        WEFT_TRY(weft_composite_inputs(assets, asset, count_input, &inputs, err));
    if (inv->json)
        return weft_print_json(inv,
                               json_pack("{s:i, s:i, s:i}", "materials", materials, "inputs", inputs,
                                         "warnings", weft_assets_diagnostics(assets)->n_warnings),
                               err);
    fprintf(inv->out, "%d materials, %d pictures and scans, %d warnings\n", materials, inputs,
            weft_assets_diagnostics(assets)->n_warnings);
    return WEFT_OK;
}

/* -- the bake ----------------------------------------------------------------------------------------- */

enum { MAX_EXPORTS = 32 };

static weft_err parse_exports(const char *list, const weft_exporter **exporters, weft_error *err)
{
    int n = 0;
    if (list && strcmp(list, "all") == 0) {
        for (const weft_exporter *const *e = weft_exporters; *e && n < MAX_EXPORTS; e++)
            exporters[n++] = *e;
        return WEFT_OK;
    }
    while (list && *list) {
        char name[64];
        const size_t length = strcspn(list, ",");
        (void)snprintf(name, sizeof name, "%.*s", (int)length, list);
        if (n >= MAX_EXPORTS)
            return weft_fail(err, WEFT_ERR_USAGE, "--export names more than %d", MAX_EXPORTS);
        WEFT_TRY(weft_exporter_find(name, &exporters[n++], err));
        list += length + (list[length] == ',');
    }
    return WEFT_OK;
}

static void say_why(void *context, const char *step, const char *what, const char *why)
{
    const weft_invocation *const inv = context;
    if (!inv->json)
        fprintf(inv->out, "%-28s %-8s %s\n", step, what, why);
}

static weft_err bake(const weft_invocation *inv, const bake_args *args, weft_assets *assets,
                     const weft_asset *asset, weft_error *err)
{
    const weft_exporter *exporters[MAX_EXPORTS + 1] = {NULL};
    weft_build_result result;
    WEFT_TRY(parse_exports(args->exports, exporters, err));
    const weft_build_options options = {
        .folder = args->output,
        .composite = {.width = args->size.width,
                      .height = args->size.height,
                      .periodic = args->periodic,
                      .load_scan = weft_scan_input_load},
        .mips = {.rule = (weft_mip_rule)args->mips, .coverage_at = args->coverage},
        .reach_mm = args->reach_mm,
        .detail_mm = args->detail_mm,
        .exporters = exporters,
        .note = args->why ? say_why : NULL,
        .context = (void *)(uintptr_t)inv,
    };
    const double start = weft_clock_s();
    WEFT_TRY(weft_build(assets, asset, &options, &result, err));
    const double seconds = weft_clock_s() - start;
    if (inv->json)
        return weft_print_json(inv,
                               json_pack("{s:s, s:s, s:i, s:i, s:f}", "material", asset->name, "folder",
                                         args->output, "rebuilt", result.rebuilt, "kept", result.kept,
                                         "seconds", seconds),
                               err);
    fprintf(inv->out, "%s: %s: %d rebuilt, %d kept, %.2f s\n", args->output, asset->name, result.rebuilt,
            result.kept, seconds);
    return WEFT_OK;
}

static weft_err work(const weft_invocation *inv, const bake_args *args, weft_assets *assets, weft_error *err)
{
    const weft_asset *asset = weft_assets_main(assets);
    if (args->check)
        return check(inv, assets, err);
    if (args->material)
        WEFT_TRY(weft_assets_find(assets, args->material, &asset, err));
    if (!asset)
        return weft_fail(err, WEFT_ERR_MISSING, "%s: defines no material", inv->operands[0]);
    if (args->explain) {
        weft_asset_print(asset, inv->out);
        return WEFT_OK;
    }
    if (!args->output)
        return weft_fail(err, WEFT_ERR_USAGE, "say where to with -o NAME.material");
    return bake(inv, args, assets, asset, err);
}

/* A U3M is a material as it stands: the text that one would write for it. */
static weft_err load_u3m(const char *path, weft_assets **assets, weft_error *err)
{
    weft_u3m *u3m;
    char name[200];
    WEFT_TRY(weft_u3m_open(path, &u3m, err));
    weft_u3m_identifier(u3m->name, name, sizeof name);
    char *const text = strchr(path, '"') ? NULL
                                         : weft_asprintf(err, ":%s := ( %s :u3m = \"%s\" )\n", name,
                                                         weft_u3m_type(u3m), weft_path_name(path));
    weft_u3m_close(u3m);
    if (!text)
        return weft_fail(err, WEFT_ERR_FORMAT, "%s: has a quotation mark in its name; rename it", path);
    const weft_err status = weft_assets_load_text(path, text, assets, err);
    weft_free(text);
    return status;
}

static bool is_u3m(const char *path)
{
    return weft_path_has_suffix(path, ".u3m") || weft_path_has_suffix(path, ".u3ma");
}

static weft_err run(const weft_invocation *inv, const void *void_args, weft_error *err)
{
    const bake_args *const args = void_args;
    weft_assets *assets = NULL;
    char shipped[PATH_MAX];
    if (args->format && is_u3m(inv->operands[0]))
        return weft_fail(err, WEFT_ERR_USAGE, "--format is for texts (.radattr)");
    if (args->format)
        return rewrite(inv, inv->operands[0], args->check, err);
    const char *library = args->library;
    if (!library && weft_shipped_path("library", shipped, NULL) == WEFT_OK)
        library = shipped; /* without it a text that includes from it says so */
    weft_err status = is_u3m(inv->operands[0]) ? load_u3m(inv->operands[0], &assets, err)
                                               : weft_assets_load(inv->operands[0], library, &assets, err);
    if (assets && (status != WEFT_OK || weft_log_get_level() > WEFT_LOG_QUIET))
        weft_diagnostics_print(weft_assets_diagnostics(assets), stderr);
    if (status == WEFT_OK)
        status = work(inv, args, assets, err);
    weft_assets_destroy(assets);
    return status;
}

const weft_command weft_cmd_bake = {
    .name = "bake",
    .summary = "make a material's maps with mips, and exports; only what changed",
    .operands = "MATERIAL.radattr|SWATCH.u3ma",
    .min_operands = 1,
    .max_operands = 1,
    .args_size = sizeof(bake_args),
    .fields = fields,
    .details =
        "The text says what the material derives from and what it changes; docs/materials.md is the "
        "language.  A U3M (.u3m, .u3ma) is a material too; exported as u3m again it keeps all that Weft does "
        "not know.  Run it again after any change: it rebuilds what depends on it, and --why tells.",
    .example = "weft bake shirting.radattr -o shirting.material --export all --why",
    .run = run,
};
