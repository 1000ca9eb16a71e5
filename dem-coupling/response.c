#include "response.h"

#include <liggghts/library.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#define LIGGGHTS_MODIFY 10 // pointers into the LAMMPS object
#define ROW 6              // numbers of a body: force, torque

// C++ functions of LIGGGHTS under their link names
typedef void response_call(void *self, long step, int n, int *tag, double **x, double **force);
extern void *lg_find_fix_id(void *modify, const char *id) __asm__("_ZN9LAMMPS_NS6Modify11find_fix_idEPKc");
extern void lg_set_callback(void *fix, response_call *call, void *self)
    __asm__("_ZN9LAMMPS_NS11FixExternal12set_callbackEPFvPvliPiPPdS4_ES1_");
extern void lg_push(const char *name, const char *type, void *lmp, void **data,
                    const char *number) __asm__("_Z19data_liggghts_to_ofPKcS0_PvRS1_S0_");

static struct {
    void *lmp;
    dem_shared *shared;
    int call;              // since the run began; the first is that of its set-up
    double *sum;           // owned, contact forces of the present substep, ROW per body
    double *tie;           // owned, the same of springs and lines
    double *centre;        // owned, 3 per body
    double **centre_row;   // owned, rows of centre
    int *first;            // owned, local index of each body's first sphere, -1: it has left
} response;

// Half kicks at the ends: the forces of the set-up and of the last substep count half
static double response_weight(int call) {
    const int n = response.shared->n_step;
    return (call == 0 || call == n ? 0.5 : 1.0) / n;
}

static void response_contacts(int n, const int *tag, double **x, double **force, double **torque) {
    const dem_shared *s = response.shared;
    const dem_body *body = DEM_SECTION(s, const dem_body, body);
    for (int b = 0; b < s->n_body; b++)
        response.first[b] = -1;
    for (int i = 0; i < n; i++) {
        if (tag[i] > s->n_body_sphere)
            continue;
        // the body whose spheres these tags are
        int lo = 0, hi = s->n_body - 1;
        while (lo < hi) {
            const int middle = (lo + hi + 1) / 2;
            if (body[middle].first < tag[i])
                lo = middle;
            else
                hi = middle - 1;
        }
        if (tag[i] == body[lo].first + 1)
            response.first[lo] = i;
        double *sum = response.sum + ROW * lo, arm[3];
        for (int c = 0; c < 3; c++)
            arm[c] = x[i][c] - response.centre[3 * lo + c];
        if (s->periodic)
            arm[0] -= (s->hi[0] - s->lo[0]) * round(arm[0] / (s->hi[0] - s->lo[0]));
        for (int c = 0; c < 3; c++) {
            const int p = (c + 1) % 3, q = (c + 2) % 3;
            sum[c] += force[i][c];
            sum[3 + c] += torque[i][c] + arm[p] * force[i][q] - arm[q] * force[i][p];
        }
    }
}

// rows of body b
static void response_times(int b, const double *force, double *out) {
    const dem_shared *s = response.shared;
    const double *matrix = DEM_SECTION(s, const double, response);
    const size_t n = ROW * (size_t)s->n_body;
    for (int r = 0; r < ROW; r++)
        for (size_t k = 0; k < n; k++)
            if (force[k] != 0)
                out[r] += matrix[((size_t)ROW * (size_t)b + (size_t)r) * n + k] * force[k];
}

// the water's answer, on each body's first sphere
static void response_answer(double **x, double **force, double **torque) {
    const dem_shared *s = response.shared;
    dem_body *body = DEM_SECTION(s, dem_body, body);
    for (int b = 0; b < s->n_body; b++) {
        const int i = response.first[b];
        double out[ROW] = {0}, arm[3];
        if (i >= 0)
            response_times(b, response.sum, out);
        for (int r = 0; r < ROW; r++) {
            body[b].contact[r] += response_weight(response.call) * response.sum[ROW * b + r];
            body[b].answer[r] += response_weight(response.call) * out[r];
        }
        for (int c = 0; c < 3 && i >= 0; c++)
            arm[c] = x[i][c] - response.centre[3 * b + c];
        if (s->periodic && i >= 0)
            arm[0] -= (s->hi[0] - s->lo[0]) * round(arm[0] / (s->hi[0] - s->lo[0]));
        for (int c = 0; c < 3 && i >= 0; c++) {
            const int p = (c + 1) % 3, q = (c + 2) % 3;
            force[i][c] += out[c];
            torque[i][c] += out[3 + c] - (arm[p] * out[q] - arm[q] * out[p]);
        }
    }
}

static void response_step(void *self, long step, int n, int *tag, double **x, double **added) {
    (void)self;
    // what this holds is added every thousand millionth substep, the first one too
    if (step % 1000000000 == 0 && n > 0)
        memset(added[0], 0, 3 * (size_t)n * sizeof(double));
    if (!response.shared || !response.shared->n_response || response.call > response.shared->n_step)
        return;
    const int n_body = response.shared->n_body;
    double **force = lammps_extract_atom(response.lmp, "f"), **torque = lammps_extract_atom(response.lmp, "torque");
    void *data = response.centre_row;
    memset(response.centre, 0, 3 * (size_t)n_body * sizeof(double));
    memset(response.sum, 0, ROW * (size_t)n_body * sizeof(double));
    memset(response.tie, 0, ROW * (size_t)n_body * sizeof(double));
    lg_push("xcm", "vector-multisphere", response.lmp, &data, "double");
    response_contacts(n, tag, x, force, torque);
    response_answer(x, force, torque);
    response.call++;
}

int response_open(void *lmp) {
    void *fix = lg_find_fix_id(((void **)lmp)[LIGGGHTS_MODIFY], "imp");
    if (fix)
        lg_set_callback(fix, response_step, NULL);
    return fix != NULL;
}

int response_begin(void *lmp, dem_shared *shared) {
    dem_body *body = DEM_SECTION(shared, dem_body, body);
    const size_t n = (size_t)shared->n_body;
    response.lmp = lmp;
    response.shared = shared;
    response.call = 0;
    response.sum = realloc(response.sum, (ROW * n + 1) * sizeof(double));
    response.tie = realloc(response.tie, (ROW * n + 1) * sizeof(double));
    response.centre = realloc(response.centre, (3 * n + 1) * sizeof(double));
    response.centre_row = realloc(response.centre_row, (n + 1) * sizeof *response.centre_row);
    response.first = realloc(response.first, (n + 1) * sizeof *response.first);
    if (!response.sum || !response.tie || !response.centre || !response.centre_row || !response.first)
        return 0;
    for (size_t b = 0; b < n; b++) {
        response.centre_row[b] = response.centre + 3 * b;
        memset(body[b].contact, 0, sizeof body[b].contact);
        memset(body[b].answer, 0, sizeof body[b].answer);
    }
    return 1;
}

static int response_tied(void) { return response.shared && response.shared->n_response && response.call > 0; }

void response_tie(int slot, const double pull[6]) {
    for (int r = 0; r < ROW && response_tied(); r++)
        response.tie[ROW * slot + r] += pull[r];
}

void response_ties(int slot, double answer[6]) {
    memset(answer, 0, ROW * sizeof *answer);
    if (!response_tied())
        return;
    dem_body *body = &DEM_SECTION(response.shared, dem_body, body)[slot];
    response_times(slot, response.tie, answer);
    for (int r = 0; r < ROW; r++) {
        body->contact[r] += response_weight(response.call - 1) * response.tie[ROW * slot + r];
        body->answer[r] += response_weight(response.call - 1) * answer[r];
    }
}

void response_end(void) {
    response.shared = NULL;
}
