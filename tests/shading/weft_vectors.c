/* weft-vectors DIR|FILE...: tables of reference values against the functions of this build. */
#include "calibration/charts/colour_vectors.h"
#include "core/file.h"
#include "core/text.h"
#include "host/solve/solve_vectors.h"
#include "shading/vectors/vectors_single.h"
#include "shading/vectors/vectors_tables.h"

#include <dirent.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

typedef struct tally {
    int passed, failed, skipped;
} tally;

/* The tolerance that MANIFEST.csv beside the table gives, but not less than the model's. */
static double suggested_rtol(const char *path, const char *stem, double least)
{
    char manifest[4096], file[256];
    const char *const name = weft_path_name(path);
    snprintf(manifest, sizeof manifest, "%.*sMANIFEST.csv", (int)(name - path), path);
    snprintf(file, sizeof file, "%s.csv", stem);
    weft_csv csv;
    double rtol = least;
    if (!weft_file_exists(manifest) || weft_csv_read(manifest, &csv, NULL) != WEFT_OK)
        return least;
    const int file_column = weft_csv_column(&csv, "file"), column = weft_csv_column(&csv, "suggested_rtol");
    for (int row = 0; row < csv.rows && file_column >= 0 && column >= 0; row++)
        if (strcmp(weft_csv_cell(&csv, row, file_column), file) == 0)
            (void)weft_csv_number(&csv, row, column, manifest, &rtol, NULL);
    weft_csv_fini(&csv);
    return rtol > least ? rtol : least;
}

static bool print_columns(const weft_vectors_column *columns, int n, double rtol)
{
    bool good = true;
    for (int k = 0; k < n; k++) {
        const weft_vectors_column *const c = &columns[k];
        const bool within = c->worst_share <= 1;
        printf("  %-20s rel %.2e  abs %.2e  (rtol %.0e, %.1e of what is allowed)%s\n", c->name, c->max_rel,
               c->max_abs, rtol, c->worst_share, within ? "" : "  FAILED");
        if (!within)
            printf("    row %d: got %.17g, wanted %.17g\n", c->worst_row, c->worst_got, c->worst_want);
        good &= within;
    }
    return good;
}

/* A row for each model whose evaluation in single precision gives columns of the table. */
static bool print_single(const weft_csv *csv, const char *stem, const char *path, weft_error *err)
{
    bool good = true;
    for (const weft_vectors_single *s = weft_vectors_singles; s->stem; s++) {
        weft_vectors_single_result r;
        if (strcmp(s->stem, stem) != 0)
            continue;
        if (weft_vectors_single_run(s, csv, path, &r, err) != WEFT_OK) {
            fprintf(stderr, "weft-vectors: %s\n", err->text);
            return false;
        }
        const bool within = r.worst_share <= 1;
        printf(
            "  %-20s single precision: rel %.2e, %.2e of double at the same arguments  (rtol %.0e, %.1e of "
            "what is allowed)%s\n",
            s->brdf, r.table_rel, r.kernel_rel, WEFT_VECTORS_SINGLE_RTOL, r.worst_share,
            within ? "" : "  FAILED");
        if (!within)
            printf("    row %d: got %.9g, wanted %.17g\n", r.worst_row, r.worst_got, r.worst_want);
        good &= within;
    }
    return good;
}

static const weft_vectors_model *find(const char *stem)
{
    static const weft_vectors_model *const others[] = {weft_calibration_vectors, weft_solve_vectors};
    const weft_vectors_model *found = weft_vectors_find(stem);
    for (int i = 0; i < 2 && !found; i++)
        found = weft_vectors_find_in(others[i], stem);
    return found;
}

static void run_file(const char *path, tally *count)
{
    char stem[128];
    const char *const name = weft_path_name(path);
    snprintf(stem, sizeof stem, "%.*s", (int)strcspn(name, "."), name);
    const weft_vectors_model *const model = find(stem);
    if (!model) {
        printf("%s: no model in this build\n", stem);
        count->skipped++;
        return;
    }
    weft_error error = {0};
    weft_csv csv;
    weft_vectors_column columns[WEFT_VECTORS_MAX_COLUMNS];
    int n_columns = 0;
    weft_err status = weft_csv_read(path, &csv, &error);
    if (status == WEFT_OK) {
        const double rtol = suggested_rtol(path, stem, model->rtol);
        status = weft_vectors_run(model, &csv, path, rtol, columns, &n_columns, &error);
        if (status == WEFT_OK) {
            printf("%s: %d rows (%s)\n", stem, csv.rows, model->ids);
            const bool precise = print_columns(columns, n_columns, rtol);
            const bool single = print_single(&csv, stem, path, &error);
            *(precise && single ? &count->passed : &count->failed) += 1;
        }
        weft_csv_fini(&csv);
    }
    if (status != WEFT_OK) {
        fprintf(stderr, "weft-vectors: %s\n", error.text);
        count->failed++;
    }
}

static int is_table(const struct dirent *entry)
{
    return weft_path_has_suffix(entry->d_name, ".csv") && strcmp(entry->d_name, "MANIFEST.csv") != 0;
}

static void run_folder(const char *folder, tally *count)
{
    struct dirent **entries = NULL;
    const int n = scandir(folder, &entries, is_table, alphasort);
    for (int i = 0; i < n; i++) {
        char path[4096];
        snprintf(path, sizeof path, "%s/%s", folder, entries[i]->d_name);
        run_file(path, count);
        free(entries[i]);
    }
    free(entries);
    if (n <= 0) {
        fprintf(stderr, "weft-vectors: %s: no tables (*.csv) here\n", folder);
        count->failed++;
    }
}

int main(int argc, char **argv)
{
    tally count = {0};
    if (argc < 2 || strcmp(argv[1], "--help") == 0) {
        fprintf(
            argc < 2 ? stderr : stdout,
            "usage: weft-vectors DIR|FILE...\n\nCompares tables of reference values (NAME.csv with columns "
            "out_*) with the function NAME of this build;\nexits 1 when a value is off by more than 1e-12 "
            "+ rtol |wanted|, rtol from MANIFEST.csv beside the table or the "
            "model's own,\nor in single precision by more than 1e-5 at the rounded arguments.\n");
        return argc < 2 ? 2 : 0;
    }
    for (int i = 1; i < argc; i++) {
        if (weft_folder_exists(argv[i]))
            run_folder(argv[i], &count);
        else
            run_file(argv[i], &count);
    }
    printf("%d passed, %d failed, %d skipped\n", count.passed, count.failed, count.skipped);
    return count.failed ? 1 : 0;
}
