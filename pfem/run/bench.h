/** @file bench.h
 * silt bench: what a step costs, phase by phase, over sizes; in times that CGAL needs for the same points, which hold on a noisy
 * machine. bench.c measures, bench_scene.c makes the scenes, bench_report.c tells.
 */
#ifndef SILT_BENCH_H
#define SILT_BENCH_H

#include "run.h"

typedef struct silt_bench_def {
    const char *scenes; // names or scene files, commas between; NULL: water alone in 2-D and 3-D
    const char *sizes;  // nodes (or N, for a collapse), commas between, k for thousands; NULL: what the scene has
    int steps, warm_up; // that are measured, and before; 0: 9 and 6
    int threads;        // 0: one; more: every other step is done on one, to compare
    int n_set;
    const char *const *set; // -D
    const char *json;   // file, NULL: none
    const char *worker; // see silt_run_def
    bool quiet;
} silt_bench_def;

/** Measures, prints a table a scene. Errors: SILT_INPUT for names, sizes and scenes, SILT_FAILED when a run failed. */
silt_status silt_bench(const silt_bench_def *def, FILE *to, silt_error *err);

// bench_scene.c ---------------------------------------------------------------------------------------
typedef struct bench_scene {
    const char *name, *document;
    int dimension;
    bool whole;        // runs to its end; its size is N, nodes over the width of the column
    int n_grain;
    const char *sizes; // that it has when none are asked for
} bench_scene;
/** NULL: no such scene; a file is a scene of its own, of which nothing is known here */
const bench_scene *bench_scene_find(const char *name);
const bench_scene *bench_scene_list(int *n);
/** The scene with about this many nodes. @param folder  where its text may stand */
silt_status bench_scene_make(silt_scene **scene, const bench_scene *kind, double size, const char *folder, int n_set, const char *const *set,
                             silt_error *err);

// bench_report.c --------------------------------------------------------------------------------------
/** what was measured of one scene at one size; plain data, it goes through a pipe */
typedef struct bench_row {
    char name[128];
    double size;                  // asked for
    int dimension, threads, steps, warm_up;
    bool whole;                   // a run to its end: sums over it, else medians over steps
    bool cpu;                     // times are the processor's, else the wall's
    double nodes, cells, grains;  // means over the steps
    double phase[CLOCK_COUNT];    // s per node and step
    double phase_one[CLOCK_COUNT]; // s per node and step, on one thread, where more are measured
    double faster;                // steps on one thread over those on all, pair by pair
    double step, mean;            // s per node and step: sum of the phases, and the mean over the steps
    double unit;                  // U1: s per point
    double in_unit;               // steps in units; pair by pair where steps were measured
    double worst_in_unit;         // the largest of them
    double iterations, momentum_iterations, pressure_iterations, retries; // per step
    double dt, courant;           // s; share of h that the fastest node goes in a step
    double start;                 // s, to the state at t = 0
    double bytes;                 // peak of the process, less what it had before the scene, per node
    double substeps;              // of the grains, per step
    double coupling;              // s per grain and step: mean over the steps, without the grains' own
    double seconds, time, unit_2; // s: whole run, model time, U2
    double volume_early, volume;  // largest volume error until 0.3 s, and at all
} bench_row;
void bench_table(FILE *to, const bench_row *row, int n);
silt_status bench_json(const char *path, const bench_row *row, int n, silt_error *err);

#endif
