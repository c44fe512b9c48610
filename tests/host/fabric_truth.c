/* fabric_truth FOLDER SEED WIDTHxHEIGHT MM_PER_PX SAMPLE...: the truth of samples as the virtual scanner
 * writes it (FOLDER/SAMPLE.truth), without the scanner running. */
#include "core/file.h"
#include "core/mem.h"
#include "host/rig/stage.h"

#include <stdio.h>
#include <stdlib.h>

static weft_err write_truth(weft_rig_stage **stage, const weft_rig_setup *setup, const char *folder,
                            const char *sample, double mm_per_px, weft_error *err)
{
    if (*stage)
        WEFT_TRY(weft_rig_stage_set_sample(*stage, sample, err));
    else
        WEFT_TRY(weft_rig_stage_create(setup, sample, stage, err));
    char *const path = weft_asprintf(err, "%s/%s.truth", folder, sample);
    if (!path)
        return WEFT_ERR_NOMEM;
    const weft_err status = weft_rig_truth_write(*stage, path, mm_per_px, err);
    weft_free(path);
    return status;
}

int main(int argc, char **argv)
{
    weft_error error = {0};
    weft_rig_setup setup;
    weft_rig_stage *stage = NULL;
    weft_err status = WEFT_OK;
    weft_rig_setup_init(&setup);
    if (argc < 6 || sscanf(argv[3], "%dx%d", &setup.size.width, &setup.size.height) != 2) {
        fprintf(stderr, "usage: fabric_truth FOLDER SEED WIDTHxHEIGHT MM_PER_PX SAMPLE...\n");
        return 2;
    }
    setup.seed = strtoull(argv[2], NULL, 10);
    for (int i = 5; i < argc && status == WEFT_OK; i++)
        status = write_truth(&stage, &setup, argv[1], argv[i], strtod(argv[4], NULL), &error);
    if (status != WEFT_OK)
        fprintf(stderr, "fabric_truth: %s\n", error.text);
    weft_rig_stage_destroy(stage);
    return status == WEFT_OK ? 0 : 1;
}
