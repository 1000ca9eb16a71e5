// the pressure system: S + L in the plane (plane.c) and in space (space.c), here its Laplacian counterpart
#include "factor.h"
#include "plane.h"
#include "space.h"

/** a symmetric matrix over nodes and their neighbours, and its factor */
typedef struct silt_system {
    silt_factor factor;     // owned
    int64_t revision;       // of the mesh that the pattern belongs to
} silt_system;

struct silt_pressure {
    silt_system main, stiff;   // the Laplacian; L and the mass matrix over the viscosity
    silt_plane *plane;         // owned, S + L in 2-D
    silt_space *space;         // owned, S + L in 3-D
    bool in_plane, in_space;   // it is that
    int n;
    double *row;            // owned
    int row_capacity;
};

silt_pressure *silt_pressure_create(void) { return silt_alloc(1, sizeof(silt_pressure)); }

void silt_pressure_forget(silt_pressure *pressure) {
    if (!pressure)
        return;
    silt_factor_clear(&pressure->main.factor);
    silt_factor_clear(&pressure->stiff.factor);
    silt_plane_forget(pressure->plane);
    pressure->main.revision = pressure->stiff.revision = -1;
}

void *silt_pressure_rest(silt_pressure *pressure, size_t *bytes) {
    *bytes = 0;
    return pressure && pressure->in_plane ? silt_plane_rest(pressure->plane, bytes) : NULL;
}

void silt_pressure_free(silt_pressure **pressure) {
    if (!*pressure)
        return;
    silt_pressure *p = *pressure;
    silt_pressure_forget(p);
    silt_plane_free(&p->plane);
    silt_space_free(&p->space);
    free(p->row);
    free(p);
    *pressure = NULL;
}

// lower triangle of the compact matrix, by columns
static void pattern_build(silt_pressure *p, silt_system *system, const silt_mesh *mesh) {
    const int n = mesh->n_node;
    SILT_RESERVE(p->row, p->row_capacity, n + 1);
    const int filled = (mesh->neighbour_start[n] + n) / 2; // lists hold the node itself
    int *start = silt_factor_pattern(&system->factor, n, filled), *index = system->factor.index;
    silt_mesh_lower(mesh, start, index);
    system->revision = mesh->revision;
}

// stabilisation, and with `inertial` the Laplacian in place of the consistent operator
static void column_laplacian(silt_pressure *p, const silt_fluid *f, const silt_mesh *mesh, int j, bool inertial) {
    const int D = f->dim;
    for (int k = mesh->node_cell_start[j]; k < mesh->node_cell_start[j + 1]; k++) {
        const int e = mesh->node_cell[k], *cell = mesh->cell[e];
        const double *flux = f->flux + (D + 1) * D * e;
        int a = 0;
        while (cell[a] != j)
            a++;
        double weight = f->tau[e] * f->inverse[e];
        if (inertial) {
            double inertia = 0, volume = 0;
            for (int c = 0; c <= D; c++) {
                inertia += f->inertia[cell[c]];
                volume += f->volume[cell[c]];
            }
            weight += f->inverse[e] * volume / inertia;
        }
        for (int c = 0; c <= D; c++)
            for (int d = 0; d < D; d++)
                p->row[cell[c]] += weight * flux[D * a + d] * flux[D * c + d];
    }
}

static silt_status system_factor(silt_system *system, const silt_step *s, bool fresh, silt_error *err) {
    bool done;
    if (fresh)
        SILT_CLOCKED(analyse, silt_factor_analyse(&system->factor));
    SILT_CLOCKED(factor, done = silt_factor_compute(&system->factor));
    if (done)
        return SILT_OK;
    system->revision = -1;
    return silt_pressure_indefinite(s, system->factor.bad, err);
}

// 3/(4 mu) of the lumped mass and the stabilisation: what is left of the pressure's operator when viscosity outweighs inertia
// (3/4: a gradient field meets 4/3 mu of the deviatoric stress)
silt_status silt_pressure_factor_stiff(silt_pressure *p, silt_fluid *f, const silt_step *s, silt_error *err) {
    if (p->in_space)
        return silt_space_build(&p->space, f, s, silt_closed_pieces(f, s->mesh), true, err);
    const silt_mesh *mesh = s->mesh;
    silt_system *system = &p->stiff;
    const bool fresh = system->revision != mesh->revision || !system->factor.inside;
    if (fresh)
        pattern_build(p, system, mesh);
    double *fluidity = f->scratch;
    memset(fluidity, 0, (size_t)p->n * sizeof(double));
    for (int e = 0; e < mesh->n_cell; e++)
        for (int a = 0; a <= f->dim; a++)
            fluidity[mesh->cell[e][a]] += 0.75 * f->cell_volume[e] / ((f->dim + 1) * f->mu[e]);
    const int *start = system->factor.start, *index = system->factor.index;
    double *value = system->factor.value;
    memset(p->row, 0, (size_t)p->n * sizeof *p->row);
    for (int j = 0; j < p->n; j++) {
        column_laplacian(p, f, mesh, j, false);
        p->row[j] += mesh->wet[j] ? fluidity[j] : 1;
        for (int k = start[j]; k < start[j + 1]; k++)
            value[k] = p->row[index[k]];
        for (int k = mesh->neighbour_start[j]; k < mesh->neighbour_start[j + 1]; k++)
            p->row[mesh->neighbour[k]] = 0;
        p->row[j] = 0;
    }
    return system_factor(system, s, fresh, err);
}

static silt_status factor_laplacian(silt_pressure *p, silt_fluid *f, const silt_step *s, silt_error *err) {
    const silt_mesh *mesh = s->mesh;
    const uint8_t *pinned = silt_closed_pieces(f, mesh);
    silt_system *system = &p->main;
    const bool fresh = system->revision != mesh->revision || !system->factor.inside;
    if (fresh)
        pattern_build(p, system, mesh);
    const int *start = system->factor.start, *index = system->factor.index;
    double *value = system->factor.value;
    memset(p->row, 0, (size_t)p->n * sizeof *p->row);
    for (int j = 0; j < p->n; j++) {
        if (mesh->wet[j])
            column_laplacian(p, f, mesh, j, true);
        double *diagonal = &value[start[j]];
        for (int k = start[j]; k < start[j + 1]; k++)
            value[k] = p->row[index[k]];
        *diagonal = mesh->wet[j] ? *diagonal + silt_pressure_pin(mesh, pinned, j, *diagonal) : 1;
        if (mesh->surface[j]) // pressure increment prescribed on the free surface
            *diagonal += 1e12 * fabs(*diagonal);
        // clear what this column touched
        for (int k = mesh->neighbour_start[j]; k < mesh->neighbour_start[j + 1]; k++)
            p->row[mesh->neighbour[k]] = 0;
        p->row[j] = 0;
    }
    return system_factor(system, s, fresh, err);
}

silt_status silt_pressure_factor(silt_pressure *p, silt_fluid *f, const silt_step *s, silt_error *err) {
    const bool consistent = s->scene->fluid.pressure == PRESSURE_CONSISTENT;
    p->in_plane = f->dim == 2 && consistent;
    p->in_space = f->dim == 3 && consistent;
    p->n = s->mesh->n_node;
    if (p->in_space)
        return silt_space_build(&p->space, f, s, silt_closed_pieces(f, s->mesh), false, err);
    return p->in_plane ? silt_plane_factor(&p->plane, f, s, silt_closed_pieces(f, s->mesh), err) : factor_laplacian(p, f, s, err);
}

static silt_status factor_solve(silt_system *system, const double *right, double *out, silt_error *err) {
    if (!silt_factor_solve(&system->factor, right, out))
        return silt_fail(err, SILT_FAILED, "the pressure system could not be solved (%d nodes)", system->factor.n);
    return SILT_OK;
}

silt_status silt_pressure_solve(silt_pressure *p, silt_fluid *f, const double *right, double tolerance, double *x, silt_error *err) {
    if (p->in_space)
        return silt_space_solve(p->space, right, tolerance, x, &f->pressure_iterations, err);
    if (!p->in_plane)
        return factor_solve(&p->main, right, x, err);
    return silt_plane_solve(p->plane, f, right, tolerance, x, err);
}

silt_status silt_pressure_solve_stiff(silt_pressure *p, const double *right, double *increment, silt_error *err) {
    return p->in_space ? silt_space_solve_stiff(p->space, right, increment, err) : factor_solve(&p->stiff, right, increment, err);
}
