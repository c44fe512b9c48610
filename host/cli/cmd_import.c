/* weft import: sets that others captured. */
#include "host/cli/command.h"

#include "host/set/import.h"

typedef struct import_args {
    const char *output, *calibration;
    int transfer;
    bool copy;
} import_args;

static const weft_field fields[] = {
    {.key = "output",
     .short_opt = 'o',
     .type = WEFT_FIELD_TEXT,
     .offset = offsetof(import_args, output),
     .unit = "SET",
     .required = true,
     .help = "set folder to write"},
    {.key = "cal",
     .type = WEFT_FIELD_TEXT,
     .offset = offsetof(import_args, calibration),
     .unit = "CAL",
     .help = "calibration to write; else NAME.cal beside NAME.set"},
    {.key = "transfer",
     .type = WEFT_FIELD_CHOICE,
     .offset = offsetof(import_args, transfer),
     .choices = "auto|linear|srgb",
     .def = "auto",
     .help = "what the codes of the pictures stand for; auto: 8 bits are sRGB, more are linear"},
    {.key = "copy",
     .type = WEFT_FIELD_FLAG,
     .offset = offsetof(import_args, copy),
     .help = "copy the pictures into the set; else it names them where they are"},
    {0},
};

static weft_err run(const weft_invocation *inv, const void *args_, weft_error *err)
{
    const import_args *const args = args_;
    const weft_import_options options = {
        .transfer = (weft_import_transfer)args->transfer, .copy = args->copy, .force = inv->force};
    weft_import_result r;
    WEFT_TRY(weft_import(inv->operands[0], args->output, args->calibration, &options, &r, err));
    if (inv->json)
        return weft_print_json(inv,
                               json_pack("{s:s, s:s, s:i, s:i, s:i, s:b, s:s, s:i, s:f, s:f}", "set",
                                         args->output, "kind", r.kind, "lights", r.n_lights, "width", r.width,
                                         "height", r.height, "calibration", r.has_calibration, "transfer",
                                         r.srgb ? "srgb" : "linear", "bits", r.bits, "misfit_linear",
                                         r.misfit_linear, "misfit_srgb", r.misfit_srgb),
                               err);
    fprintf(inv->out, "%s: %d lights, %d x %d px%s\n", args->output, r.n_lights, r.width, r.height,
            r.has_calibration ? ", with a calibration of distant lights" : "");
    return WEFT_OK;
}

const weft_command weft_cmd_import = {
    .name = "import",
    .summary = "make a set of what others captured",
    .operands = "PATH",
    .min_operands = 1,
    .max_operands = 1,
    .args_size = sizeof(import_args),
    .fields = fields,
    .details = "PATH is an RTI light-position file (.lp) or a folder that holds one, a folder with\n"
               "light_directions.txt, or a folder of camera raws in the order of the lights\n"
               "(docs/import.md).",
    .example = "weft import coin/coin.lp -o coin.set --transfer linear",
    .run = run,
};
