/* silt-dem: the program that links LIGGGHTS. Started by silt (dem.c) with a socket, the shared memory and a restart
 * file open; it does one instruction after the other until it is told to end or its parent is gone. */
#define _GNU_SOURCE
#include "motion.h"
#include "response.h"
#include "script.h"
#include "touch.h"

#include <errno.h>
#include <liggghts/library.h>
#include <math.h>
#include <mpi.h>
#include <signal.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

#define LIGGGHTS_SCREEN 16 // pointers into the LAMMPS object

// C++ functions of LIGGGHTS' coupling library under their link names
extern int lg_max_body(void *lmp) __asm__("_Z22liggghts_get_maxtag_msPv");
extern void lg_push(const char *name, const char *type, void *lmp, void **data,
                    const char *number) __asm__("_Z19data_liggghts_to_ofPKcS0_PvRS1_S0_");

static struct {
    dem_shared *shared;
    uint64_t mapped; // bytes of shared
    pid_t parent;
    void *lmp;
    int scratch; // descriptor of a memory file for what LIGGGHTS reads
    int *plane;  // owned, one per wall and triangle, see script_open
    int *row;    // owned, local index by tag, -1: not here
    int n_row;
    int *order; // owned, tags of the last answer
    int n_order;
    int n_body;         // free bodies
    int *body_first;    // owned, first row of each body's spheres; the tag is one more
    double *weight;     // owned, per row of the bodies' spheres: shares of a force that add up to one at the centroid
    double *body_state; // owned, scratch, 3 per body
    double **body_row;  // owned, rows of body_state
    FILE *screen;       // closed by LIGGGHTS, NULL while it is the log
    double (*rate)[4];  // owned, velocity and spin of every motion of the walls
    int settled;        // forces and neighbour lists are those of the present state
} worker;

// the end of the worker with a reason: the client reads it from the shared memory and finds the socket closed
__attribute__((noreturn, format(printf, 1, 2))) static void worker_fail(const char *format, ...) {
    char text[sizeof worker.shared->text];
    va_list list;
    va_start(list, format);
    vsnprintf(text, sizeof text, format, list);
    va_end(list);
    // one line
    for (char *c = text; *c; c++)
        if (*c == '\n')
            *c = ' ';
    if (worker.shared)
        memcpy(worker.shared->text, text, sizeof text);
    if (worker.screen) {
        rewind(worker.screen);
        for (int c = getc(worker.screen); c != EOF; c = getc(worker.screen))
            putchar(c);
    }
    fflush(NULL);
    fprintf(stderr, "%s\n", text);
    _exit(70);
}

// ---- LIGGGHTS' own error functions, replaced: it would end MPI and exit without a word to the client
#define WORKER_EXPORT __attribute__((visibility("default"), noreturn))
WORKER_EXPORT void worker_error_all(void *, const char *, int, const char *) __asm__("_ZN9LAMMPS_NS5Error3allEPKciS2_");
WORKER_EXPORT void worker_error_one(void *, const char *, int, const char *) __asm__("_ZN9LAMMPS_NS5Error3oneEPKciS2_");
WORKER_EXPORT void worker_error_universe(void *, const char *, int,
                                         const char *) __asm__("_ZN9LAMMPS_NS5Error12universe_allEPKciS2_");
WORKER_EXPORT void worker_error_universe_one(void *, const char *, int,
                                             const char *) __asm__("_ZN9LAMMPS_NS5Error12universe_oneEPKciS2_");
WORKER_EXPORT void worker_error_fix(void *, const char *, int, void *,
                                    const char *) __asm__("_ZN9LAMMPS_NS5Error9fix_errorEPKciPNS_3FixES2_");
WORKER_EXPORT void worker_error_fix_style(void *, const char *, int, void *, const char *,
                                          const char *) __asm__("_ZN9LAMMPS_NS5Error9fix_errorEPKciPNS_3FixES2_S2_");
WORKER_EXPORT void
worker_error_compute(void *, const char *, int, void *,
                     const char *) __asm__("_ZN9LAMMPS_NS5Error13compute_errorEPKciPNS_7ComputeES2_");

static const char *worker_base(const char *file) {
    const char *slash = strrchr(file, '/');
    return slash ? slash + 1 : file;
}

void worker_error_all(void *self, const char *file, int line, const char *text) {
    (void)self;
    worker_fail("LIGGGHTS: %s (%s:%d)", text, worker_base(file), line);
}
void worker_error_one(void *self, const char *file, int line, const char *text) {
    worker_error_all(self, file, line, text);
}
void worker_error_universe(void *self, const char *file, int line, const char *text) {
    worker_error_all(self, file, line, text);
}
void worker_error_universe_one(void *self, const char *file, int line, const char *text) {
    worker_error_all(self, file, line, text);
}
void worker_error_fix(void *self, const char *file, int line, void *fix, const char *text) {
    (void)fix;
    worker_error_all(self, file, line, text);
}
void worker_error_fix_style(void *self, const char *file, int line, void *fix, const char *style, const char *text) {
    (void)self;
    (void)fix;
    worker_fail("LIGGGHTS: fix %s: %s (%s:%d)", style, text, worker_base(file), line);
}
void worker_error_compute(void *self, const char *file, int line, void *compute, const char *text) {
    (void)compute;
    worker_error_all(self, file, line, text);
}

// warnings go to the log whatever the screen is; the first hundred of them
#define WORKER_WARNING __attribute__((visibility("default")))
WORKER_WARNING void worker_warning(void *, const char *, int, const char *,
                                   int) __asm__("_ZN9LAMMPS_NS5Error7warningEPKciS2_i");
WORKER_WARNING void worker_warning_all(void *, const char *, int, const char *,
                                       int) __asm__("_ZN9LAMMPS_NS5Error10warningAllEPKciS2_i");

void worker_warning(void *self, const char *file, int line, const char *text, int log) {
    static int count;
    (void)self;
    (void)log;
    if (count++ < 100)
        fprintf(stderr, "WARNING: %s (%s:%d)\n", text, worker_base(file), line);
}
void worker_warning_all(void *self, const char *file, int line, const char *text, int log) {
    worker_warning(self, file, line, text, log);
}

// ---- memory
static void *worker_grow(void *data, size_t count, size_t size) {
    void *grown = realloc(data, (count ? count : 1) * size);
    if (!grown)
        worker_fail("out of memory");
    return grown;
}

static int *worker_zeros(size_t count) {
    int *data = worker_grow(NULL, count, sizeof *data);
    memset(data, 0, count * sizeof *data);
    return data;
}

static double worker_seconds(clockid_t clock) {
    struct timespec now;
    clock_gettime(clock, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

// maps the shared memory, again when the client made it larger
static void worker_map(void) {
    struct stat file;
    if (fstat(DEM_FD_MEMORY, &file) != 0)
        worker_fail("shared memory: %s", strerror(errno));
    if ((uint64_t)file.st_size == worker.mapped)
        return;
    dem_shared *old = worker.shared;
    void *fresh = mmap(NULL, (size_t)file.st_size, PROT_READ | PROT_WRITE, MAP_SHARED, DEM_FD_MEMORY, 0);
    if (fresh == MAP_FAILED)
        worker_fail("shared memory: %s", strerror(errno));
    worker.shared = fresh;
    if (old)
        munmap(old, worker.mapped);
    worker.mapped = (uint64_t)file.st_size;
}

static const char *worker_path(int fd) {
    static char path[2][64];
    static int k;
    k = !k;
    snprintf(path[k], sizeof path[k], "/proc/self/fd/%d", fd);
    return path[k];
}

// ---- LIGGGHTS' arrays
typedef struct worker_atoms {
    int n, *tag, *type;
    double **x, **v, **omega, **force, **torque, *radius, *mass;
} worker_atoms;

static worker_atoms worker_look(void) {
    worker_atoms a = {.n = *(int *)lammps_extract_global(worker.lmp, "nlocal"),
                      .tag = lammps_extract_atom(worker.lmp, "id"),
                      .type = lammps_extract_atom(worker.lmp, "type"),
                      .x = lammps_extract_atom(worker.lmp, "x"),
                      .v = lammps_extract_atom(worker.lmp, "v"),
                      .omega = lammps_extract_atom(worker.lmp, "omega"),
                      .force = lammps_extract_atom(worker.lmp, "f"),
                      .torque = lammps_extract_atom(worker.lmp, "torque"),
                      .radius = lammps_extract_atom(worker.lmp, "radius"),
                      .mass = lammps_extract_atom(worker.lmp, "rmass")};
    return a;
}

// local index by tag
static void worker_index(const worker_atoms *a) {
    int most = 0;
    for (int i = 0; i < a->n; i++)
        most = a->tag[i] > most ? a->tag[i] : most;
    worker.row = worker_grow(worker.row, (size_t)most + 1, sizeof *worker.row);
    worker.n_row = most + 1;
    for (int t = 0; t <= most; t++)
        worker.row[t] = -1;
    for (int i = 0; i < a->n; i++)
        worker.row[a->tag[i]] = i;
}

static int worker_find(int tag) {
    return tag > 0 && tag < worker.n_row ? worker.row[tag] : -1;
}

static double **worker_body_read(const char *name) {
    memset(worker.body_state, 0, 3 * (size_t)worker.n_body * sizeof(double));
    void *data = worker.body_row;
    lg_push(name, "vector-multisphere", worker.lmp, &data, "double");
    return worker.body_row;
}

// rounding must not carry spheres out of the plane; bodies have no freedom to leave it
static void worker_flatten(const worker_atoms *a) {
    for (int i = 0; i < a->n; i++)
        a->x[i][2] = a->v[i][2] = a->omega[i][0] = a->omega[i][1] = 0;
}

static void worker_check(const worker_atoms *a, const char *when) {
    for (int i = 0; i < a->n; i++)
        if (!isfinite(a->x[i][0] + a->x[i][1] + a->x[i][2] + a->v[i][0] + a->v[i][1] + a->v[i][2] + a->omega[i][2]))
            worker_fail("a sphere of type %d is not finite %s: x (%g, %g, %g), v (%g, %g, %g), omega_z %g", a->type[i], when, a->x[i][0],
                        a->x[i][1], a->x[i][2], a->v[i][0], a->v[i][1], a->v[i][2], a->omega[i][2]);
}

// ---- the answer: state of grains and bodies
static int worker_compare(const void *a, const void *b) {
    int p = *(const int *)a, q = *(const int *)b;
    return (p > q) - (p < q);
}

static void worker_answer_bodies(void) {
    dem_body *body = DEM_SECTION(worker.shared, dem_body, body);
    static const char *const name[] = {"xcm", "vcm", "angmom", "ex_space", "ey_space", "ez_space"};
    const bool space = worker.shared->dim == 3;
    for (int k = 0; worker.n_body && k < (space ? 6 : 4); k++) {
        double **row = worker_body_read(name[k]);
        for (int b = 0; b < worker.n_body; b++) {
            double *to = k == 0 ? body[b].x : k == 1 ? body[b].v : k == 2 ? body[b].omega : body[b].axis[k - 3];
            memcpy(to, row[b], 3 * sizeof(double));
        }
    }
    // angular momentum came; in the slab the inertia is the same about all axes
    for (int b = 0; b < worker.n_body; b++) {
        for (int c = 0; c < 3 && !space; c++)
            body[b].omega[c] /= body[b].inertia;
        // LIGGGHTS drops a body when its centroid has left, and its spheres one by one: no axis came then
        const double *axis = body[b].axis[0];
        body[b].present =
            worker_find(worker.body_first[b] + 1) >= 0 && axis[0] * axis[0] + axis[1] * axis[1] + (space ? axis[2] * axis[2] : 0) > 0;
    }
}

static void worker_answer(void) {
    worker_atoms a = worker_look();
    dem_grain *grain = DEM_SECTION(worker.shared, dem_grain, grain);
    int *contacts = worker_zeros((size_t)a.n), *on_bed = worker_zeros((size_t)a.n);

    worker_check(&a, "after the run");
    worker_index(&a);
    if (!worker.shared->no_contacts && touch_count(a.n, a.x, a.radius, a.type, worker.shared, worker.plane, contacts, on_bed) != 0)
        worker_fail("out of memory");
    // rising tags
    worker.order = worker_grow(worker.order, (size_t)a.n, sizeof *worker.order);
    worker.n_order = 0;
    bool sorted = true;
    for (int i = 0; i < a.n; i++)
        if (a.type[i] == DEM_TYPE_GRAIN) {
            sorted &= worker.n_order == 0 || worker.order[worker.n_order - 1] < a.tag[i];
            worker.order[worker.n_order++] = a.tag[i];
        }
    if (!sorted)
        qsort(worker.order, (size_t)worker.n_order, sizeof *worker.order, worker_compare);
    if (worker.n_order > worker.shared->max_grain)
        worker_fail("%d grains, expected at most %d", worker.n_order, worker.shared->max_grain);
    worker.shared->n_grain = worker.n_order;
    for (int k = 0; k < worker.n_order; k++) {
        int i = worker.row[worker.order[k]];
        dem_grain *g = &grain[k];
        *g = (dem_grain){
            .tag = a.tag[i], .contacts = contacts[i], .on_bed = on_bed[i], .radius = a.radius[i], .mass = a.mass[i]};
        memcpy(g->x, a.x[i], sizeof g->x);
        memcpy(g->v, a.v[i], sizeof g->v);
        memcpy(g->omega, a.omega[i], sizeof g->omega);
    }
    worker_answer_bodies();
    free(contacts);
    free(on_bed);
}

// ---- instructions

// shares w = a + b . d of a body's spheres at d from the centroid, with sum w = 1 and sum w d = 0: a force shared out
// so acts at the centroid however the body turns during the run
static void worker_share(const dem_body *body, const double *sphere, double *weight) {
    double s[2] = {0, 0}, m[3] = {0, 0, 0};
    int n = body->n_sphere;
    for (int i = 0; i < n; i++) {
        const double *d = &sphere[3 * i];
        for (int c = 0; c < 2; c++)
            s[c] += d[c];
        m[0] += d[0] * d[0];
        m[1] += d[0] * d[1];
        m[2] += d[1] * d[1];
    }
    // spheres on a line have a singular matrix
    double ridge = 1e-12 * (m[0] + m[2]) + 1e-300;
    m[0] += ridge;
    m[2] += ridge;
    double det = m[0] * m[2] - m[1] * m[1];
    double r[2] = {(m[2] * s[0] - m[1] * s[1]) / det, (m[0] * s[1] - m[1] * s[0]) / det};
    double left = n - (s[0] * r[0] + s[1] * r[1]);
    for (int i = 0; i < n; i++) {
        const double *d = &sphere[3 * i];
        // one sphere beside the centroid cannot do it: it takes all, and worker_load mends the torque
        weight[i] = left > 1e-6 ? (1 - r[0] * d[0] - r[1] * d[1]) / left : i == 0;
    }
}

// the same in space
static void worker_share_space(const dem_body *body, const double *sphere, double *weight) {
    const int n = body->n_sphere;
    double m[3][4] = {{0}}, r[3], left = n, trace = 0;
    for (int i = 0; i < n; i++)
        for (int c = 0; c < 3; c++) {
            m[c][3] += sphere[4 * i + c];
            for (int k = 0; k < 3; k++)
                m[c][k] += sphere[4 * i + c] * sphere[4 * i + k];
        }
    double sum[3] = {m[0][3], m[1][3], m[2][3]};
    for (int c = 0; c < 3; c++)
        trace += m[c][c];
    for (int c = 0; c < 3; c++)
        m[c][c] += 1e-12 * trace + 1e-300;
    // positive definite: no pivots
    for (int c = 0; c < 3; c++)
        for (int k = c + 1; k < 3; k++) {
            const double factor = m[k][c] / m[c][c];
            for (int e = c; e < 4; e++)
                m[k][e] -= factor * m[c][e];
        }
    for (int c = 2; c >= 0; c--) {
        r[c] = m[c][3];
        for (int k = c + 1; k < 3; k++)
            r[c] -= m[c][k] * r[k];
        r[c] /= m[c][c];
    }
    for (int c = 0; c < 3; c++)
        left -= sum[c] * r[c];
    for (int i = 0; i < n; i++) {
        const double *d = &sphere[4 * i];
        weight[i] = left > 1e-6 ? (1 - r[0] * d[0] - r[1] * d[1] - r[2] * d[2]) / left : i == 0;
    }
}

static void worker_body_table(void) {
    const dem_body *body = DEM_SECTION(worker.shared, const dem_body, body);
    const double *sphere = DEM_SECTION(worker.shared, const double, body_sphere);
    worker.n_body = worker.shared->n_body;
    worker.body_first = worker_grow(worker.body_first, (size_t)worker.n_body, sizeof *worker.body_first);
    worker.body_state = worker_grow(worker.body_state, 3 * (size_t)worker.n_body, sizeof *worker.body_state);
    worker.body_row = worker_grow(worker.body_row, (size_t)worker.n_body, sizeof *worker.body_row);
    worker.weight = worker_grow(worker.weight, (size_t)worker.shared->n_body_sphere, sizeof *worker.weight);
    for (int b = 0; b < worker.n_body; b++) {
        worker.body_first[b] = body[b].first;
        worker.body_row[b] = &worker.body_state[3 * b];
        if (worker.shared->dim == 3)
            worker_share_space(&body[b], &sphere[4 * body[b].first], &worker.weight[body[b].first]);
        else
            worker_share(&body[b], &sphere[3 * body[b].first], &worker.weight[body[b].first]);
    }
}

static void worker_open(void) {
    dem_shared *s = worker.shared;

    // its screen is our standard output, which is the log; a line at a time, so that the last one is there when it dies
    char *argument[] = {"silt-dem", "-log", "none", "-nocite", NULL};
    lammps_open(4, argument, MPI_COMM_WORLD, &worker.lmp);
    if (!worker.lmp)
        worker_fail("LIGGGHTS does not start");
    worker.plane = worker_grow(worker.plane, (size_t)(s->n_wall + s->n_triangle), sizeof *worker.plane);
    script_open(worker.lmp, s, worker_path(DEM_FD_RESTART), worker.plane);
    if (!response_open(worker.lmp))
        worker_fail("LIGGGHTS has no fix external");
    if (s->resume) {
        worker_body_table();
        script_integrate(worker.lmp, s, worker_path(worker.scratch), worker.scratch);
        script_set_up(worker.lmp, s);
        worker_answer();
    }
    // from here on five lines a run would fill the disk: the screen, a known member of LIGGGHTS' object, becomes a
    // memory file that is emptied before every instruction and shown when something fails
    FILE **screen = &((FILE **)worker.lmp)[LIGGGHTS_SCREEN];
    int memory = memfd_create("silt-dem-screen", MFD_CLOEXEC);
    printf("ready\n");
    fflush(stdout);
    if (*screen == stdout && memory >= 0 && (worker.screen = fdopen(memory, "w+")))
        *screen = worker.screen;
}

static void worker_bodies(void) {
    dem_shared *s = worker.shared;
    const dem_body *body = DEM_SECTION(s, const dem_body, body);

    worker_body_table();
    script_integrate(worker.lmp, s, worker_path(worker.scratch), worker.scratch);
    for (int b = 0; b < worker.n_body; b++) {
        script_insert(worker.lmp, s, b);
        int there = lg_max_body(worker.lmp), spheres = lammps_get_natoms(worker.lmp);
        if (there != b + 1 || spheres != body[b].first + body[b].n_sphere)
            worker_fail("body %d could not be placed at (%g, %g, %g): LIGGGHTS has %d bodies and %d spheres", b,
                        body[b].x[0], body[b].x[1], body[b].x[2], there, spheres);
    }
    worker_answer();
}

// forces of this run: on every grain its own, on every body through its spheres
static void worker_load(void) {
    dem_shared *s = worker.shared;
    worker_atoms a = worker_look();
    const double *force = DEM_SECTION(s, const double, force), *torque = DEM_SECTION(s, const double, torque);
    const double *shift = DEM_SECTION(s, const double, shift);
    const dem_body *body = DEM_SECTION(s, const dem_body, body);
    double **f = lammps_extract_fix(worker.lmp, "dragforce", 1, 2, 0, 0),
           **t = lammps_extract_fix(worker.lmp, "hdtorque", 1, 2, 0, 0);

    worker_index(&a);
    if (s->dim == 2)
        worker_flatten(&a);
    worker_check(&a, "before the run");
    for (int i = 0; i < a.n; i++) {
        for (int c = 0; c < s->dim; c++)
            a.force[i][c] -= f[i][c];
        for (int c = s->dim == 3 ? 0 : 2; c < 3 && a.type[i] == DEM_TYPE_GRAIN; c++)
            a.torque[i][c] -= t[i][c];
        memset(f[i], 0, 3 * sizeof(double)), memset(t[i], 0, 3 * sizeof(double));
    }
    for (int k = 0; k < s->n_force && k < worker.n_order; k++) {
        int i = worker_find(worker.order[k]);
        if (i >= 0 && a.type[i] == DEM_TYPE_GRAIN)
            memcpy(f[i], &force[3 * k], (size_t)s->dim * sizeof(double));
        // LIGGGHTS sees a way beyond its skin before the first forces, and looks for neighbours anew
        for (int c = 0; c < s->dim && i >= 0 && a.type[i] == DEM_TYPE_GRAIN && k < s->n_shift; c++)
            a.x[i][c] += shift[3 * k + c];
        for (int c = s->dim == 3 ? 0 : 2; c < 3 && i >= 0 && a.type[i] == DEM_TYPE_GRAIN && k < s->n_torque; c++)
            a.torque[i][c] += t[i][c] = torque[3 * k + c];
    }
    // a run that goes on begins with the sum of forces at the last one's end: the old load goes out of it, the new one comes in
    for (int i = 0; i < a.n; i++)
        if (a.type[i] == DEM_TYPE_GRAIN)
            for (int c = 0; c < s->dim; c++)
                a.force[i][c] += f[i][c];
    // bodies stand where the last answer said
    for (int b = 0; b < worker.n_body; b++) {
        const double *F = body[b].force;
        double moment[3] = {0, 0, 0};
        for (int k = body[b].first; k < body[b].first + body[b].n_sphere; k++) {
            int i = worker_find(k + 1);
            if (i < 0)
                break;
            for (int c = 0; c < s->dim; c++)
                f[i][c] = worker.weight[k] * F[c];
            for (int c = s->dim == 3 ? 0 : 2; c < 3; c++) {
                const int p = (c + 1) % 3, q = (c + 2) % 3;
                moment[c] += (a.x[i][p] - body[b].x[p]) * f[i][q] - (a.x[i][q] - body[b].x[q]) * f[i][p];
            }
        }
        int i = worker_find(worker.body_first[b] + 1);
        for (int c = s->dim == 3 ? 0 : 2; c < 3 && i >= 0; c++)
            t[i][c] = body[b].torque[c] - moment[c];
    }
}

// Sets LIGGGHTS up anew. This computes the forces of the first half kick, but does not advance the tangential springs: a
// sliding contact then stands exactly at Coulomb's limit, counts as sticking, and is braked by the full tangential dashpot,
// once a set-up. So it sees everything at rest: springs and forces as they are, no dashpots.
static void worker_set_up(void) {
    worker_atoms a = worker_look();
    worker_index(&a);
    int n_row = worker.n_row;
    double *keep = worker_grow(NULL, 6 * (size_t)n_row, sizeof *keep);
    for (int i = 0; i < a.n; i++) {
        double *row = &keep[6 * a.tag[i]];
        memcpy(row, a.v[i], 3 * sizeof *row);
        memcpy(row + 3, a.omega[i], 3 * sizeof *row);
        memset(a.v[i], 0, 3 * sizeof *row);
        memset(a.omega[i], 0, 3 * sizeof *row);
    }
    script_set_up(worker.lmp, worker.shared);
    // atoms outside the box are gone now, others have moved up
    a = worker_look();
    for (int i = 0; i < a.n; i++) {
        const double *row = &keep[6 * a.tag[i]];
        memcpy(a.v[i], row, 3 * sizeof *row);
        memcpy(a.omega[i], row + 3, 3 * sizeof *row);
    }
    free(keep);
    worker.settled = 1;
}

static dem_guide *worker_guide(void) {
    return worker.shared->n_guide ? DEM_SECTION(worker.shared, dem_guide, guide) : NULL;
}

// how the walls move in the substeps from this one on
static void worker_walls(int substep) {
    const dem_shared *s = worker.shared;
    const dem_motion *motion = DEM_SECTION(s, const dem_motion, motion);
    dem_guide *guide = worker_guide();
    worker.rate = worker_grow(worker.rate, (size_t)s->n_motion, sizeof *worker.rate);
    for (int m = 0; m < s->n_motion; m++) {
        memcpy(worker.rate[m], motion[m].velocity, 3 * sizeof(double));
        worker.rate[m][3] = motion[m].spin;
        if (guide && m < guide->n_wall)
            memcpy(worker.rate[m], dem_guide_wall(guide, m)[substep], sizeof worker.rate[m]);
    }
    script_motion(worker.lmp, s, (const double(*)[4])worker.rate);
}

// contact forces at the end of a substep: on grains all forces less weight and load, on bodies what they are told
static void worker_trace(int substep) {
    const dem_shared *s = worker.shared;
    dem_guide *guide = worker_guide();
    const dem_traced *traced = dem_guide_traced(guide);
    double *out = dem_guide_trace(guide) + 3 * (size_t)substep * (size_t)guide->n_trace;
    if (guide->n_trace == 0)
        return;
    worker_atoms a = worker_look();
    double **load = lammps_extract_fix(worker.lmp, "dragforce", 1, 2, 0, 0);
    worker_index(&a);
    for (int k = 0; k < guide->n_trace; k++, out += 3) {
        const int i = traced[k].order >= 0 && traced[k].order < worker.n_order ? worker_find(worker.order[traced[k].order]) : -1;
        for (int c = 0; c < 3 && traced[k].slot < 0; c++)
            out[c] = i >= 0 ? a.force[i][c] - load[i][c] - a.mass[i] * s->gravity[c] : NAN;
        if (traced[k].slot >= 0)
            motion_contact(traced[k].slot, out);
    }
}

static void worker_advance(int n_step) {
    const double since = worker_seconds(CLOCK_MONOTONIC), cpu = worker_seconds(CLOCK_PROCESS_CPUTIME_ID);
    const dem_guide *guide = worker_guide();
    motion_run();
    if (guide && (guide->n_wall || guide->n_trace))
        for (int k = 0; k < n_step; k++) {
            if (guide->n_wall)
                worker_walls(k);
            script_run(worker.lmp, 1);
            worker_trace(k);
        }
    else
        script_run(worker.lmp, n_step);
    worker.shared->seconds = worker_seconds(CLOCK_MONOTONIC) - since;
    worker.shared->cpu = worker_seconds(CLOCK_PROCESS_CPUTIME_ID) - cpu;
}

static void worker_run(void) {
    dem_shared *s = worker.shared;
    const int *gone = DEM_SECTION(s, const int, remove);

    s->seconds = s->cpu = 0;
    if (s->n_remove) {
        worker_atoms a = worker_look();
        worker_index(&a);
        int n = 0;
        for (int k = 0; k < s->n_remove; k++) {
            int i = worker_find(gone[k]);
            if (i >= 0)
                a.type[i] = DEM_TYPE_DEAD, n++;
        }
        // once between two runs: twice would spoil the contacts' history
        if (n)
            script_delete(worker.lmp);
    }
    if (s->n_add)
        script_add(worker.lmp, s, worker_path(worker.scratch), worker.scratch);
    if (s->n_remove || s->n_add || worker.n_body || !s->keep)
        worker.settled = 0;
    if (s->n_step > 0) {
        worker_load();
        worker_walls(0);
        motion_begin(worker_guide(), s);
        if (!response_begin(worker.lmp, s))
            worker_fail("out of memory");
    }
    // the multisphere bodies' sums of forces cannot be reached: they are set up for every run (ten thousand grains: 5 ms)
    if (!worker.settled && (s->n_step > 0 || s->n_remove || s->n_add))
        worker_set_up();
    if (s->n_step > 0)
        worker_advance(s->n_step);
    response_end();
    motion_end();
    worker_answer();
}

// a worker that starts from this file sets itself up once before it takes edits; so does this one, to stay its equal
static void worker_save(void) {
    script_save(worker.lmp, worker_path(DEM_FD_RESTART));
    script_set_up(worker.lmp, worker.shared);
    worker.settled = 0;
}

// ---- life
// the parent's death; its thread's death alone is none
static void worker_orphan(int number) {
    (void)number;
    if (getppid() != worker.parent)
        _exit(71);
}

static void worker_signals(void) {
    // the parent decides what a signal from the terminal or the queue means
    static const int ignored[] = {SIGINT, SIGTERM, SIGHUP, SIGUSR1, SIGUSR2, SIGPIPE, SIGQUIT};
    for (size_t k = 0; k < sizeof ignored / sizeof *ignored; k++)
        signal(ignored[k], SIG_IGN);
    struct sigaction action = {.sa_handler = worker_orphan, .sa_flags = SA_RESTART};
    sigaction(SIGRTMIN, &action, NULL);
    prctl(PR_SET_PDEATHSIG, SIGRTMIN);
    worker_orphan(0);
}

static void worker_mpi(void) {
    // a single rank by itself: no daemon, no network, even when silt itself was started by a launcher
    static const char *const launcher[] = {"PMIX_", "PMI_", "OMPI_"};
    for (size_t k = 0; k < sizeof launcher / sizeof *launcher; k++)
        for (char **e = environ; *e;) {
            char name[256];
            size_t length = strcspn(*e, "=");
            if (strncmp(*e, launcher[k], strlen(launcher[k])) == 0 && length < sizeof name) {
                memcpy(name, *e, length);
                name[length] = 0;
                unsetenv(name);
                e = environ;
            } else {
                e++;
            }
        }
    setenv("OMPI_MCA_pml", "ob1", 1);
    setenv("OMPI_MCA_btl", "self", 1);
    setenv("OMPI_MCA_ess_singleton_isolated", "1", 1);
    setenv("OMPI_MCA_orte_create_session_dirs", "0", 1); // a killed worker leaves nothing behind
    setenv("OMPI_ALLOW_RUN_AS_ROOT", "1", 1);
    setenv("OMPI_ALLOW_RUN_AS_ROOT_CONFIRM", "1", 1);
    if (MPI_Init(NULL, NULL) != MPI_SUCCESS)
        worker_fail("MPI does not start");
    // a crash is reported by the client; no second trace in the log
    static const int crash[] = {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT};
    for (size_t k = 0; k < sizeof crash / sizeof *crash; k++)
        signal(crash[k], SIG_DFL);
}

int main(int argc, char **argv) {
    struct stat file;

    char word[48];
    dem_serve_word(word);
    if (argc == 3 && strncmp(argv[1], "serve", 5) == 0 && strcmp(argv[1], word) != 0) {
        fprintf(stderr, "this silt-dem is of another version than the silt that started it (asked for: %s, here: %s)\n", argv[1], word);
        return 2;
    }
    if (argc != 3 || strcmp(argv[1], word) != 0 || fstat(DEM_FD_SOCKET, &file) != 0 || !S_ISSOCK(file.st_mode)) {
        fprintf(stderr, "silt-dem is the worker that silt starts for grains and bodies; it cannot be used by hand\n");
        return 2;
    }
    setvbuf(stdout, NULL, _IOLBF, 0);
    worker.parent = (pid_t)atoi(argv[2]);
    worker_signals();
    worker_map();
    worker.scratch = memfd_create("silt-dem-scratch", MFD_CLOEXEC);
    if (worker.scratch < 0)
        worker_fail("memory file: %s", strerror(errno));
    worker_mpi();

    for (double told = 0;;) {
        char byte = 0;
        ssize_t got = recv(DEM_FD_SOCKET, &byte, 1, 0);
        if (got < 0 && errno == EINTR)
            continue;
        if (got != 1 || byte == DEM_CLOSE)
            break;
        worker_map();
        worker.shared->text[0] = 0;
        if (worker.screen) {
            rewind(worker.screen);
            if (ftruncate(fileno(worker.screen), 0) != 0)
                worker_fail("memory file: %s", strerror(errno));
        }
        if (byte == DEM_OPEN)
            worker_open();
        else if (byte == DEM_BODIES)
            worker_bodies();
        else if (byte == DEM_RUN)
            worker_run();
        else if (byte == DEM_SAVE)
            worker_save();
        const double cpu = worker_seconds(CLOCK_PROCESS_CPUTIME_ID);
        worker.shared->cpu_all = cpu - told;
        told = cpu;
        byte = DEM_DONE;
        if (send(DEM_FD_SOCKET, &byte, 1, MSG_NOSIGNAL) != 1)
            break;
    }
    if (worker.lmp)
        lammps_close(worker.lmp);
    MPI_Finalize();
    return 0;
}
