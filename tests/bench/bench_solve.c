/*
 * Nanoseconds per pixel of the solver with near lights, each figure beside
 *   - moving the same bytes: every input plane read once, every output plane written once (89 bytes a pixel),
 *     same threads, and
 *   - what others do with the same systems: singular values and QR (LAPACK), singular values and the normal
 *     equations of RelightLab's pattern (Eigen), vectorised NumPy (peers/, built or run only where found).
 * Everything is measured in turn in the same process, minimum of the rounds.
 */
#include "core/mem.h"
#include "core/parallel.h"
#include "tests/bench/peers/peer_eigen.h"
#include "tests/bench/solve_work.h"
#include "tests/host/dome.h"

#include <lapacke.h>
#include <malloc.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { N = 10, ROUNDS = 5, PEER_PIXELS = 20000 };

/* ---- the same systems for others: PEER_PIXELS pixels of a row band, rows of L and samples in double ---- */

typedef struct systems {
    double *rows;    /* [pixels][n][3] */
    double *samples; /* [pixels][n] */
    double *normals; /* [pixels][3], ours */
} systems;

/* The systems as the solver sees them. */
static void make_systems(work *w, systems *s)
{
    *s = (systems){weft_alloc((size_t)PEER_PIXELS * N * 3, sizeof(double), NULL),
                   weft_alloc((size_t)PEER_PIXELS * N, sizeof(double), NULL),
                   weft_alloc((size_t)PEER_PIXELS * 3, sizeof(double), NULL)};
    const weft_solve_plan plan = {
        .incidence = &w->incidence, .method = &weft_method_lsq, .width = w->width, .cfa = WEFT_CFA_RGGB};
    static weft_solve_samples block;
    const int per_row = w->width / WEFT_SOLVE_LANES * WEFT_SOLVE_LANES;
    for (int i = 0; i < PEER_PIXELS; i += WEFT_SOLVE_LANES) {
        const int v = w->height / 2 + i / per_row, u = i % per_row;
        const size_t at = (size_t)v * (size_t)w->width;
        weft_solve_row_in in[N];
        weft_solve_answers answers;
        for (int j = 0; j < N; j++)
            in[j] = (weft_solve_row_in){.rgb = {w->in[j] + at, w->in[j] + at, w->in[j] + at}};
        weft_solve_gather(&plan, v, u / WEFT_SOLVE_LANES, in, &block);
        weft_method_lsq.solve(&block, &answers);
        for (int k = 0; k < WEFT_SOLVE_LANES; k++)
            for (int j = 0; j < N; j++)
                for (int c = 0; c < 3; c++) {
                    s->rows[((size_t)(i + k) * N + (size_t)j) * 3 + (size_t)c] =
                        (double)block.at[j].light[c][k];
                    s->samples[(size_t)(i + k) * N + (size_t)j] = (double)block.at[j].grey[k];
                    s->normals[(size_t)(i + k) * 3 + (size_t)c] = (double)answers.normal[c][k];
                }
    }
}

/* Largest angle between scaled normals and ours, degrees. */
static double disagreement(const systems *s, const double *scaled)
{
    double worst = 0;
    for (int i = 0; i < PEER_PIXELS; i++)
        worst =
            fmax(worst, dome_angle_deg(scaled + (size_t)3 * (size_t)i, s->normals + (size_t)3 * (size_t)i));
    return worst;
}

static double lapack_ns(const systems *s, bool svd, double *scaled)
{
    const double begin = work_now_s();
    for (size_t i = 0; i < PEER_PIXELS; i++) {
        double a[N * 3], b[N], singular[3];
        int rank;
        memcpy(a, s->rows + i * N * 3, sizeof a);
        memcpy(b, s->samples + i * N, sizeof b);
        if ((svd ? LAPACKE_dgelsd(LAPACK_ROW_MAJOR, N, 3, 1, a, 3, b, 1, singular, 0, &rank)
                 : LAPACKE_dgels(LAPACK_ROW_MAJOR, 'N', N, 3, 1, a, 3, b, 1)) != 0)
            return NAN;
        memcpy(scaled + 3 * i, b, 3 * sizeof *b);
    }
    return (work_now_s() - begin) * 1e9 / PEER_PIXELS;
}

/* NumPy in a process of its own, on the same systems from a file; NaN where it is not installed. */
static double numpy_ns(const systems *s, double *worst_deg)
{
    char path[] = "/tmp/weft-bench-XXXXXX", command[512];
    double ns = NAN;
    const int file = mkstemp(path);
    if (file < 0)
        return NAN;
    FILE *const f = fdopen(file, "wb");
    fwrite(s->rows, sizeof(double), (size_t)PEER_PIXELS * N * 3, f);
    fwrite(s->samples, sizeof(double), (size_t)PEER_PIXELS * N, f);
    fwrite(s->normals, sizeof(double), (size_t)PEER_PIXELS * 3, f);
    fclose(f);
    snprintf(command, sizeof command,
             "/usr/bin/python3 %s/tests/bench/peers/peer_numpy.py %s %d %d 2>/dev/null", WEFT_SOURCE, path,
             PEER_PIXELS, N);
    FILE *const pipe = popen(command, "r"); /* a benchmark of a fixed script */
    if (pipe) {
        if (fscanf(pipe, "%lf %lf", &ns, worst_deg) != 2)
            ns = NAN;
        pclose(pipe);
    }
    remove(path);
    return ns;
}

/* ---- the table ---- */

typedef struct figures {
    double move, lsq, robust, search, gloss, svd, demosaic, seams;
    double dgels, dgelsd, jacobi, relight, numpy;
    double worst[5];
} figures;

static void measure_round(work *w, const systems *s, double *scaled, bool peers, figures *f)
{
    static const weft_gloss gloss = {0.05F, 0.2F, 0.45F, {{1, 0}, {0, 1}}};
    work_take_less(&f->move, work_move_ns(w));
    work_take_less(&f->lsq, work_solve_ns(w, &weft_method_lsq, NULL, false));
    work_take_less(&f->demosaic, work_demosaic_ns(w));
    work_take_less(&f->seams, work_seams_ns(w));
    work_take_less(&f->robust, work_solve_ns(w, &weft_method_robust, NULL, false));
    work_take_less(&f->search, work_solve_ns(w, &weft_method_robust, NULL, true));
    if (!peers)
        return;
    work_take_less(&f->gloss, work_solve_ns(w, &weft_method_robust, &gloss, false));
    work_take_less(&f->svd, work_solve_ns(w, &weft_method_svd, NULL, false));
    work_take_less(&f->dgels, lapack_ns(s, false, scaled));
    f->worst[0] = disagreement(s, scaled);
    work_take_less(&f->dgelsd, lapack_ns(s, true, scaled));
    f->worst[1] = disagreement(s, scaled);
    if (weft_peer_eigen()) {
        work_take_less(&f->jacobi, weft_peer_eigen()->jacobi_ns(PEER_PIXELS, N, s->rows, s->samples, scaled));
        f->worst[2] = disagreement(s, scaled);
        work_take_less(&f->relight,
                       weft_peer_eigen()->relight_ns(PEER_PIXELS, N, s->rows, s->samples, scaled));
        f->worst[3] = disagreement(s, scaled);
    }
}

static void print_row(const char *name, double ns, double bytes, double lsq, double worst)
{
    if (isnan(ns)) {
        printf("%-44s not found here\n", name);
        return;
    }
    printf("%-44s %9.1f %8.2f %9.1f", name, ns, ns / bytes, ns / lsq);
    if (worst >= 0)
        printf("   %.1e deg", worst);
    printf("\n");
}

static void print_figures(const figures *f)
{
    const struct {
        const char *name;
        double ns;
    } whole[] = {{"lsq", f->lsq},
                 {"robust, matte cloth", f->robust},
                 {"robust, every pixel searched", f->search},
                 {"robust, glossy cloth", f->gloss},
                 {"svd", f->svd}};
    const struct {
        const char *name;
        double ns, worst;
    } peers[] = {{"Eigen JacobiSVD, double", f->jacobi, f->worst[2]},
                 {"Eigen dynamic, normal equations, LDLT", f->relight, f->worst[3]},
                 {"LAPACKE dgels", f->dgels, f->worst[0]},
                 {"LAPACKE dgelsd", f->dgelsd, f->worst[1]},
                 {"NumPy, vectorised, float32 planes", f->numpy, f->worst[4]}};
    printf("4928 x 3264, ten near lights, one core       %9s %8s %9s\n", "ns/px", "x bytes", "x lsq");
    print_row("the same bytes read and written", f->move, f->move, f->lsq + f->demosaic, -1);
    for (size_t i = 0; i < sizeof whole / sizeof whole[0]; i++)
        print_row(whole[i].name, whole[i].ns + f->demosaic, f->move, f->lsq + f->demosaic, -1);
    printf("of which the albedo's three planes           %9.1f\n", f->demosaic);
    printf("beside these: what seams add to the uncertainty %6.1f\n", f->seams);
    printf("normals of given systems, against lsq without those planes%17s\n", "from lsq");
    print_row("lsq", f->lsq, f->move, f->lsq, -1);
    for (size_t i = 0; i < sizeof peers / sizeof peers[0]; i++)
        print_row(peers[i].name, peers[i].ns, f->move, f->lsq, peers[i].worst);
}

static int print_table(void)
{
    static work w;
    systems s;
    figures f;
    double *const scaled = weft_alloc((size_t)PEER_PIXELS * 3, sizeof(double), NULL);
    double *const all = (double *)&f;
    for (size_t i = 0; i < sizeof f / sizeof *all; i++)
        all[i] = (double)NAN;
    work_init(&w, 4928, 3264, N);
    make_systems(&w, &s);
    weft_parallel_set_threads(1);
    /* the peers allocate for every pixel: not from the system each time */
    mallopt(M_TRIM_THRESHOLD, 1 << 28);
    mallopt(M_TOP_PAD, 1 << 24);
    for (int round = 0; round < ROUNDS; round++)
        measure_round(&w, &s, scaled, round < 2, &f);
    f.numpy = numpy_ns(&s, &f.worst[4]);
    print_figures(&f);
    weft_free(s.rows);
    weft_free(s.samples);
    weft_free(s.normals);
    weft_free(scaled);
    work_fini(&w);
    return 0;
}

int main(void)
{
    return print_table();
}
