// silt bench: the time loop's own steps, timed by its own clocks; every scene and size in a process of its own
#include <errno.h>
#include <malloc.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include "bench.h"
#include "delaunay.h"
#include "parallel.h"

#define BENCH_STEPS 9
#define BENCH_WARM_UP 6
#define UNIT_2_SIDE 1000  // points along a side of U2's cloud
#define UNIT_2_TIMES 5    // how often U2 is measured in a whole run, at least
#define UNIT_2_EVERY 20.0 // s between
#define EARLY 0.3         // s, time of the first bound on the volume

// ---------------------------------------------------------------- memory

// bytes that a line of /proc/self/status tells
static double memory_line(const char *name) {
    char line[256];
    double kilobytes = 0;
    FILE *from = fopen("/proc/self/status", "r");
    while (from && fgets(line, sizeof line, from))
        if (strncmp(line, name, strlen(name)) == 0)
            kilobytes = atof(line + strlen(name) + 1);
    if (from)
        fclose(from);
    return 1024 * kilobytes;
}

// the peak begins anew: what units took is no part of it
static void memory_forget(void) {
    malloc_trim(0);
    FILE *to = fopen("/proc/self/clear_refs", "w");
    if (!to)
        return;
    fputs("5", to);
    fclose(to);
}

// ---------------------------------------------------------------- units

static int compare(const void *a, const void *b) {
    const double p = *(const double *)a, q = *(const double *)b;
    return (p > q) - (p < q);
}

// of n numbers `stride` apart
static double median(int n, const double *value, int stride) {
    double *sorted = silt_alloc((size_t)n + 1, sizeof *sorted);
    for (int k = 0; k < n; k++)
        sorted[k] = value[k * stride];
    qsort(sorted, (size_t)n, sizeof *sorted, compare);
    const double middle = n == 0 ? NAN : 0.5 * (sorted[(n - 1) / 2] + sorted[n / 2]);
    free(sorted);
    return middle;
}

// U2: the seconds for a million points of a plane lattice, each shifted by up to half a spacing
static double unit_2(void) {
    const int n = UNIT_2_SIDE * UNIT_2_SIDE;
    double *x = silt_alloc(2 * (size_t)n, sizeof *x);
    uint64_t state = 1;
    for (int k = 0; k < n; k++) {
        x[2 * k] = k % UNIT_2_SIDE + silt_uniform(&state);
        x[2 * k + 1] = k / UNIT_2_SIDE + silt_uniform(&state);
    }
    const double seconds = silt_delaunay_seconds(2, n, x);
    free(x);
    return seconds;
}

// ---------------------------------------------------------------- measuring

/** what is known of a step, or summed over steps; doubles only */
typedef struct sample {
    double phase[CLOCK_COUNT]; // s
    double total, unit;        // s
    double nodes, cells, grains, iterations, momentum_iterations, pressure_iterations, dt, courant, substeps;
} sample;
enum { SAMPLE_LENGTH = sizeof(sample) / sizeof(double) };

static silt_status step_measure(silt_run *run, sample *s, silt_error *err) {
    *s = (sample){0};
    SILT_TRY(silt_run_advance(run, err));
    silt_clock_read(s->phase);
    for (int c = 0; c < CLOCK_COUNT; c++)
        s->total += s->phase[c];
    s->nodes = run->nodes.count;
    s->cells = run->mesh.n_cell;
    s->iterations = run->fluid.iterations;
    s->momentum_iterations = run->fluid.momentum_iterations;
    s->pressure_iterations = run->fluid.pressure_iterations;
    s->dt = run->dt;
    s->courant = run->ledger.max_speed * run->dt / run->scene->fluid.size;
    if (run->coupling) {
        s->grains = silt_coupling_dem.grains(run->coupling)->count;
        s->substeps = floor(run->dt / silt_coupling_dem.step(run->coupling) + 0.5);
    }
    return SILT_OK;
}

static double mean(int n, const sample *s, size_t offset) {
    double sum = 0;
    for (int k = 0; k < n; k++)
        sum += *(const double *)((const char *)&s[k] + offset) / n;
    return sum;
}
#define MEAN(n, s, field) mean(n, s, offsetof(sample, field))

// With more than one thread every other step is done on one, so that what disturbs the machine disturbs both: the bits are the same.
static silt_status pair_measure(silt_run *run, const bench_row *row, int k, sample *one, sample *all, silt_error *err) {
    for (int turn = 0; turn < 2; turn++) {
        const bool alone = turn == k % 2;
        silt_threads_ask(alone ? 1 : row->threads);
        SILT_TRY(step_measure(run, alone ? one : all, err));
    }
    return SILT_OK;
}

// the steps one by one: medians, since what disturbs one step lasts for a few only
static silt_status measure_steps(silt_run *run, bench_row *row, silt_error *err) {
    const int n = row->steps;
    sample *s = silt_alloc((size_t)n + 1, sizeof *s), *one = silt_alloc((size_t)n + 1, sizeof *one);
    double *ratio = silt_alloc((size_t)n + 1, sizeof *ratio);
    silt_status status = SILT_OK;
    for (int k = 0; k < row->warm_up && status == SILT_OK; k++)
        status = step_measure(run, s, err);
    for (int k = 0; k < n && status == SILT_OK; k++) {
        status = row->threads > 1 ? pair_measure(run, row, k, &one[k], &s[k], err) : step_measure(run, &s[k], err);
        // the unit after each step, so that what slows one slows both
        row->bytes = silt_max(row->bytes, memory_line("VmHWM"));
        s[k].unit = silt_delaunay_seconds(row->dimension, run->nodes.count, run->nodes.x);
        memory_forget();
    }
    row->retries = run->summary.steps ? (double)run->summary.retries / (double)run->summary.steps : 0;
    row->nodes = MEAN(n, s, nodes);
    row->cells = MEAN(n, s, cells);
    row->grains = MEAN(n, s, grains);
    row->substeps = MEAN(n, s, substeps);
    row->iterations = MEAN(n, s, iterations);
    row->momentum_iterations = MEAN(n, s, momentum_iterations);
    row->pressure_iterations = MEAN(n, s, pressure_iterations);
    row->dt = MEAN(n, s, dt);
    row->courant = MEAN(n, s, courant);
    row->mean = MEAN(n, s, total) / row->nodes;
    for (int c = 0; c < CLOCK_COUNT; c++) {
        row->phase[c] = median(n, &s->phase[c], SAMPLE_LENGTH) / row->nodes;
        row->step += row->phase[c];
    }
    row->coupling = row->grains > 0 ? MEAN(n, s, phase[CLOCK_coupling]) / row->grains : 0;
    row->unit = median(n, &s->unit, SAMPLE_LENGTH) / row->nodes;
    for (int k = 0; k < n; k++) {
        ratio[k] = s[k].total / s[k].unit;
        row->worst_in_unit = silt_max(row->worst_in_unit, ratio[k]);
    }
    row->in_unit = median(n, ratio, 1);
    for (int c = 0; c < CLOCK_COUNT && row->threads > 1; c++)
        row->phase_one[c] = median(n, &one->phase[c], SAMPLE_LENGTH) / row->nodes;
    for (int k = 0; k < n; k++)
        ratio[k] = row->threads > 1 ? one[k].total / s[k].total : 1;
    row->faster = median(n, ratio, 1);
    free(one);
    free(s);
    free(ratio);
    return status;
}

// a run to its end: sums, and U2 on the way
static silt_status measure_run(silt_run *run, double started, bench_row *row, silt_error *err) {
    const double end = run->scene->time.end;
    sample sum = {0}, s;
    double *unit = NULL, apart = 0, last = -HUGE_VAL;
    int n_unit = 0, capacity = 0, n = 0;
    silt_status status = SILT_OK;
    while (status == SILT_OK) {
        const double now = silt_clock_now();
        if (now - last > UNIT_2_EVERY || run->time >= n_unit * end / (UNIT_2_TIMES - 1) * (1 - 1e-9)) {
            row->bytes = silt_max(row->bytes, memory_line("VmHWM"));
            SILT_RESERVE(unit, capacity, n_unit + 1);
            unit[n_unit++] = unit_2();
            sum.unit += silt_delaunay_seconds(row->dimension, run->nodes.count, run->nodes.x) / run->nodes.count;
            memory_forget();
            last = silt_clock_now();
            apart += last - now;
        }
        if (run->time >= end * (1 - 1e-12))
            break;
        status = step_measure(run, &s, err);
        const double error = fabs(run->ledger.volume_error);
        row->volume = silt_max(row->volume, error);
        if (run->time <= EARLY * (1 + 1e-9))
            row->volume_early = silt_max(row->volume_early, error);
        s.unit = 0;
        for (int k = 0; k < SAMPLE_LENGTH; k++)
            ((double *)&sum)[k] += ((double *)&s)[k];
        n++;
    }
    row->seconds = silt_clock_now() - started - apart;
    row->time = run->time;
    row->steps = n;
    const double steps = silt_max(n, 1);
    row->nodes = sum.nodes / steps;
    row->cells = sum.cells / steps;
    row->iterations = sum.iterations / steps;
    row->momentum_iterations = sum.momentum_iterations / steps;
    row->pressure_iterations = sum.pressure_iterations / steps;
    row->retries = (double)run->summary.retries / steps;
    row->dt = sum.dt / steps;
    row->courant = sum.courant / steps;
    for (int c = 0; c < CLOCK_COUNT; c++) {
        row->phase[c] = sum.phase[c] / sum.nodes;
        row->step += row->phase[c];
    }
    row->mean = row->step;
    row->unit = sum.unit / n_unit;
    row->in_unit = row->worst_in_unit = row->step / row->unit;
    row->unit_2 = median(n_unit, unit, 1);
    free(unit);
    return status;
}

// ---------------------------------------------------------------- a scene at a size

static silt_status row_measure(const silt_bench_def *def, const char *folder, bench_row *row, silt_error *err) {
    const bench_scene *kind = bench_scene_find(row->name);
    const silt_run_def run_def = {.quiet = true, .threads = row->threads, .worker = def->worker};
    silt_scene *scene = NULL;
    silt_run run = {0};
    silt_status status = kind ? bench_scene_make(&scene, kind, row->size, folder, def->n_set, def->set, err)
                              : silt_scene_read(row->name, def->n_set, def->set, &scene, err);
    if (status == SILT_OK) {
        // on one thread what counts is the processor's time: a busy machine adds none to it
        row->cpu = row->threads == 1;
        silt_clock_cpu(row->cpu);
        const double before = memory_line("VmRSS"), started = silt_clock_now();
        row->dimension = scene->dimension;
        status = silt_run_open(&run, scene, &run_def, folder, -1, err);
        row->start = silt_clock_now() - started;
        if (status == SILT_OK && !scene->fluid.on)
            status = silt_fail(err, SILT_INPUT, "%s: bench needs a scene with water", row->name);
        if (status == SILT_OK)
            status = row->whole ? measure_run(&run, started, row, err) : measure_steps(&run, row, err);
        row->bytes = (row->bytes - before) / row->nodes;
        silt_run_free(&run);
    }
    silt_scene_free(&scene);
    return status;
}

static bool pipe_write(int to, const void *data, size_t size) {
    while (size) {
        const ssize_t put = write(to, data, size);
        if (put < 0 && errno != EINTR)
            return false;
        data = (const char *)data + (put > 0 ? put : 0);
        size -= put > 0 ? (size_t)put : 0;
    }
    return true;
}

static bool pipe_read(int from, void *data, size_t size) {
    while (size) {
        const ssize_t got = read(from, data, size);
        if (got == 0 || (got < 0 && errno != EINTR))
            return false;
        data = (char *)data + (got > 0 ? got : 0);
        size -= got > 0 ? (size_t)got : 0;
    }
    return true;
}

// In a process of its own: memory is that of this scene alone, and no heap is left of the one before
static silt_status row_fork(const silt_bench_def *def, bench_row *row, silt_error *err) {
    const char *base = getenv("TMPDIR");
    char *folder = silt_text("%s/silt-bench-XXXXXX", base && *base ? base : "/tmp");
    silt_error *answer = silt_alloc(1, sizeof *answer);
    silt_status status = SILT_OK;
    int ends[2] = {-1, -1};
    pid_t child = -1;
    if (!mkdtemp(folder))
        status = silt_fail(err, SILT_FAILED, "%s: cannot be made (%s)", folder, strerror(errno));
    else if (pipe(ends) != 0 || (child = fork()) < 0)
        status = silt_fail(err, SILT_FAILED, "bench: no process for %s (%s)", row->name, strerror(errno));
    if (child == 0) {
        prctl(PR_SET_PDEATHSIG, SIGKILL);
        const silt_status done = row_measure(def, folder, row, answer);
        const bool told = pipe_write(ends[1], row, sizeof *row) && pipe_write(ends[1], answer, sizeof *answer);
        _exit(told ? (int)done : SILT_FAILED);
    }
    if (child > 0) {
        int code = 0;
        close(ends[1]);
        ends[1] = -1;
        const bool told = pipe_read(ends[0], row, sizeof *row) && pipe_read(ends[0], answer, sizeof *answer);
        while (waitpid(child, &code, 0) < 0 && errno == EINTR)
            ;
        if (!told)
            status = silt_fail(err, SILT_FAILED, "bench: %s of size %g was ended by signal %d", row->name, row->size,
                               WIFSIGNALED(code) ? WTERMSIG(code) : 0);
        else if (answer->status != SILT_OK)
            status = silt_fail(err, answer->status, "%s", answer->text);
    }
    for (int k = 0; k < 2; k++)
        if (ends[k] >= 0)
            close(ends[k]);
    silt_folder_remove(folder);
    free(folder);
    free(answer);
    return status;
}

// ---------------------------------------------------------------- what is asked

// next word of a list with commas; @return what is behind it, NULL at the end
static const char *list_next(const char *list, char word[128]) {
    const size_t n = strcspn(list, ",");
    snprintf(word, 128, "%.*s", (int)n, list);
    return list[n] ? list + n + 1 : NULL;
}

static silt_status size_read(const char *word, double *size, silt_error *err) {
    char *end;
    *size = strtod(word, &end);
    if (*end == 'k') {
        *size *= 1000;
        end++;
    }
    if (end == word || *end || !(*size >= 4) || *size > 1e8)
        return silt_fail(err, SILT_INPUT, "bench: found the size '%s', allowed: numbers from 4 to 1e8, with k for thousands", word);
    return SILT_OK;
}

static silt_status scene_known(const char *name, silt_error *err) {
    if (bench_scene_find(name) || access(name, R_OK) == 0)
        return SILT_OK;
    char known[1024] = "";
    int n;
    const bench_scene *list = bench_scene_list(&n);
    for (int k = 0; k < n; k++)
        snprintf(known + strlen(known), sizeof known - strlen(known), "%s%s", k ? ", " : "", list[k].name);
    return silt_fail(err, SILT_INPUT, "bench: found no scene '%s', allowed: %s, or a scene's file", name, known);
}

// all sizes of a scene, then its table
static silt_status scene_measure(const silt_bench_def *def, const char *name, FILE *to, bench_row **row, int *n, int *capacity,
                                 silt_error *err) {
    const bench_scene *kind = bench_scene_find(name);
    const int first = *n;
    silt_status status = SILT_OK;
    char word[128];
    for (const char *list = kind ? def->sizes ? def->sizes : kind->sizes : "4"; list && status == SILT_OK;) {
        list = list_next(list, word);
        SILT_RESERVE(*row, *capacity, *n + 1);
        bench_row *r = &(*row)[*n];
        *r = (bench_row){.steps = def->steps ? def->steps : BENCH_STEPS, .warm_up = def->warm_up ? def->warm_up : BENCH_WARM_UP,
                         .threads = def->threads ? def->threads : 1, .whole = kind && kind->whole};
        snprintf(r->name, sizeof r->name, "%s", name);
        SILT_TRY(size_read(word, &r->size, err));
        if (!def->quiet)
            fprintf(stderr, "%s %s ...\n", name, kind ? word : "");
        status = row_fork(def, r, err);
        *n += status == SILT_OK;
    }
    if (*n > first)
        bench_table(to, *row + first, *n - first);
    fflush(to);
    return status;
}

silt_status silt_bench(const silt_bench_def *def, FILE *to, silt_error *err) {
    const char *scenes = def->scenes ? def->scenes : "dam-2d,still-2d,dam-3d,still-3d";
    bench_row *row = NULL;
    int n = 0, capacity = 0;
    char name[128];
    for (const char *list = scenes; list;) {
        list = list_next(list, name);
        SILT_TRY(scene_known(name, err));
    }
    double size;
    for (const char *list = def->sizes; list;) {
        list = list_next(list, name);
        SILT_TRY(size_read(name, &size, err));
    }
    fflush(to);
    silt_status status = SILT_OK;
    for (const char *list = scenes; list && status == SILT_OK;) {
        list = list_next(list, name);
        status = scene_measure(def, name, to, &row, &n, &capacity, err);
        // after each scene: what was measured before something failed is told too
        const silt_status written = def->json && n ? bench_json(def->json, row, n, status == SILT_OK ? err : NULL) : SILT_OK;
        status = status == SILT_OK ? written : status;
    }
    free(row);
    return status;
}
