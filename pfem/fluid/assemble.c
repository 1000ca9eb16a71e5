// integrals over the cells; every kernel is written once and compiled for two and for three dimensions
#include "fluid.h"

#define FLAT_STEP 0.05 // a cell that shrinks below this share on its way keeps the shape it had at the start
#define SLIVER 0.02    // gradients of a tetrahedron are bounded as if its volume were this share of a regular one's

#define KERNEL static inline __attribute__((always_inline)) void
#define BY_DIM(kernel, ...)                                                                                            \
    do {                                                                                                               \
        if (f->dim == 3)                                                                                               \
            kernel(3, __VA_ARGS__);                                                                                    \
        else                                                                                                           \
            kernel(2, __VA_ARGS__);                                                                                    \
    } while (0)

// corners of a cell, joined the shortest way across a periodic border
KERNEL gather(const int D, const silt_mesh *mesh, const double *x, const int *cell, double c[4][3]) {
    for (int a = 0; a <= D; a++)
        for (int d = 0; d < D; d++)
            c[a][d] = x[D * cell[a] + d];
    if (mesh->period[0] > 0)
        for (int a = 1; a <= D; a++)
            c[a][0] -= mesh->period[0] * floor((c[a][0] - c[0][0]) / mesh->period[0] + 0.5);
}

// volume and V grad N_a
static inline __attribute__((always_inline)) double shape(const int D, double c[4][3], double flux[4][3]) {
    memset(flux, 0, 12 * sizeof(double));
    if (D == 2) {
        flux[0][0] = 0.5 * (c[1][1] - c[2][1]);
        flux[0][1] = 0.5 * (c[2][0] - c[1][0]);
        flux[1][0] = 0.5 * (c[2][1] - c[0][1]);
        flux[1][1] = 0.5 * (c[0][0] - c[2][0]);
        flux[2][0] = 0.5 * (c[0][1] - c[1][1]);
        flux[2][1] = 0.5 * (c[1][0] - c[0][0]);
        return 0.5 * ((c[1][0] - c[0][0]) * (c[2][1] - c[0][1]) - (c[1][1] - c[0][1]) * (c[2][0] - c[0][0]));
    }
    double u[3][3];
    for (int a = 0; a < 3; a++)
        for (int d = 0; d < 3; d++)
            u[a][d] = c[a + 1][d] - c[0][d];
    for (int d = 0; d < 3; d++)
        flux[0][d] = 0;
    for (int a = 0; a < 3; a++) {
        const double *p = u[(a + 1) % 3], *q = u[(a + 2) % 3];
        flux[a + 1][0] = (p[1] * q[2] - p[2] * q[1]) / 6;
        flux[a + 1][1] = (p[2] * q[0] - p[0] * q[2]) / 6;
        flux[a + 1][2] = (p[0] * q[1] - p[1] * q[0]) / 6;
        for (int d = 0; d < 3; d++)
            flux[0][d] -= flux[a + 1][d];
    }
    return u[0][0] * flux[1][0] + u[0][1] * flux[1][1] + u[0][2] * flux[1][2];
}

// 1/volume; of a tetrahedron that is flat for its edges that of a fuller one
static inline __attribute__((always_inline)) double bounded_inverse(const int D, double c[4][3], double volume) {
    if (D == 2)
        return 1 / volume;
    double square = 0;
    for (int a = 0; a < 4; a++)
        for (int b = a + 1; b < 4; b++)
            square += silt_square(c[b][0] - c[a][0]) + silt_square(c[b][1] - c[a][1]) + silt_square(c[b][2] - c[a][2]);
    const double edge = sqrt(square / 6);
    return 1 / silt_max(volume, SLIVER * 0.1178511 * edge * edge * edge);
}

KERNEL geometry(const int D, silt_fluid *f, const silt_step *s, double dt) {
    const silt_mesh *mesh = s->mesh;
    const double rho = s->scene->fluid.density, theta_dt = f->theta * s->dt;
    const double *solid = s->drag ? s->drag->solid : NULL, *x = s->nodes->x;
    for (int k = 0; k < D * f->n_node; k++)
        f->x_mid[k] = x[k] + 0.5 * dt * silt_mesh_velocity(f, k);
    for (int i = 0; i < f->n_node; i++)
        f->mass[i] = f->volume[i] = 0;
    for (int e = 0; e < f->n_cell; e++) {
        const int *cell = mesh->cell[e];
        double c[4][3], flux[4][3];
        gather(D, mesh, x, cell, c);
        const double start = shape(D, c, flux);
        double volume = start, inverse = bounded_inverse(D, c, start);
        if (dt > 0) {
            double m[4][3], middle[4][3];
            gather(D, mesh, f->x_mid, cell, m);
            const double moved = shape(D, m, middle);
            const bool whole = moved > FLAT_STEP * start;
            if (whole) {
                volume = moved;
                inverse = bounded_inverse(D, m, moved);
            }
            if (whole || D == 3)
                memcpy(flux, middle, sizeof flux);
            if (D == 3) { // fluxes are quadratic in time: their mean over the step is that in the middle and a third of this
                double way[4][3], more[4][3];
                for (int a = 0; a < 4; a++)
                    for (int d = 0; d < 3; d++)
                        way[a][d] = m[a][d] - c[a][d];
                shape(D, way, more);
                for (int a = 0; a < 4; a++)
                    for (int d = 0; d < 3; d++)
                        flux[a][d] += more[a][d] / 3;
            }
        }
        f->cell_volume[e] = volume;
        f->inverse[e] = inverse;
        double *out = f->flux + (D + 1) * D * e;
        for (int a = 0; a <= D; a++)
            for (int d = 0; d < D; d++)
                out[D * a + d] = flux[a][d];
        // square of the edge, as twice the area of a triangle
        const double square = D == 2 ? 2 / inverse : 0.866 * cbrt(silt_square(8.4853 / inverse));
        f->tau[e] = 1 / (2 * rho / theta_dt + 8 * f->mu[e] / (3 * square));
        for (int a = 0; a <= D; a++) {
            double share = 0;
            if (solid) {
                for (int b = 0; b <= D; b++)
                    share += solid[cell[b]] * (a == b ? 2 : 1) / ((D + 1) * (D + 2));
                f->share[(D + 1) * e + a] = share;
            }
            f->volume[cell[a]] += volume / (D + 1);
            f->mass[cell[a]] += rho * volume * (1.0 / (D + 1) - share);
        }
    }
    for (int i = 0; i < f->n_node; i++)
        f->inertia[i] = mesh->wet[i] ? f->mass[i] / theta_dt + (s->drag ? s->drag->coefficient[i] : 0) + f->friction[i] : 1;
}

void silt_assemble_geometry(silt_fluid *f, const silt_step *step, double dt) {
    BY_DIM(geometry, f, step, dt);
    if (f->wall_normals.n_row)
        silt_hold_bent(f, step);
    for (int i = 0; f->potential && i < f->n_node; i++)
        f->potential[i] = step->scene->fluid.density * silt_formula_potential(&step->scene->fluid.force, f->x_mid + f->dim * i);
}

KERNEL pressure(const int D, const silt_fluid *f, const silt_mesh *mesh, const double *p, double *out, double *lost) {
    for (int e = 0; e < f->n_cell; e++) {
        const int *cell = mesh->cell[e];
        const double *flux = f->flux + (D + 1) * D * e, *share = f->share ? f->share + (D + 1) * e : NULL;
        double mean = 0;
        for (int a = 0; a <= D; a++)
            mean += p[cell[a]] / (D + 1);
        for (int a = 0; a <= D; a++)
            for (int d = 0; d < D; d++)
                out[D * cell[a] + d] += flux[D * a + d] * mean;
        if (share)
            for (int d = 0; d < D; d++) {
                double slope = 0, sum = 0;
                for (int a = 0; a <= D; a++)
                    slope += p[cell[a]] * flux[D * a + d];
                for (int a = 0; a <= D; a++) {
                    out[D * cell[a] + d] += share[a] * slope;
                    sum += share[a];
                }
                if (lost)
                    lost[d] += slope * sum;
            }
    }
}

void silt_assemble_pressure(const silt_fluid *f, const silt_mesh *mesh, const double *p, double *out, double *lost) {
    BY_DIM(pressure, f, mesh, p, out, lost);
}

KERNEL potential(const int D, const silt_fluid *f, const silt_mesh *mesh, double *out) {
    for (int e = 0; e < f->n_cell; e++) {
        const int *cell = mesh->cell[e];
        const double *flux = f->flux + (D + 1) * D * e;
        for (int d = 0; d < D; d++) {
            double slope = 0;
            for (int a = 0; a <= D; a++)
                slope += f->potential[cell[a]] * flux[D * a + d];
            for (int a = 0; a <= D; a++)
                out[D * cell[a] + d] -= slope / (D + 1);
        }
    }
}

void silt_assemble_potential(const silt_fluid *f, const silt_mesh *mesh, double *out) { BY_DIM(potential, f, mesh, out); }

KERNEL viscous(const int D, const silt_fluid *f, const silt_mesh *mesh, const double *v, double factor, double *out) {
    for (int e = 0; e < f->n_cell; e++) {
        const int *cell = mesh->cell[e];
        const double *flux = f->flux + (D + 1) * D * e;
        double l[3][3] = {{0}}, trace = 0;
        for (int a = 0; a <= D; a++)
            for (int d = 0; d < D; d++)
                for (int k = 0; k < D; k++)
                    l[d][k] += v[D * cell[a] + d] * flux[D * a + k];
        for (int d = 0; d < D; d++)
            trace += l[d][d];
        const double scale = factor * f->mu[e] * f->inverse[e];
        for (int d = 0; d < D; d++)
            for (int k = 0; k < D; k++) {
                const double stress = scale * (l[d][k] + l[k][d] - (d == k ? 2.0 / 3 * trace : 0));
                for (int a = 0; a <= D; a++)
                    out[D * cell[a] + d] += stress * flux[D * a + k];
            }
    }
}

void silt_assemble_viscous(const silt_fluid *f, const silt_mesh *mesh, const double *v, double factor, double *out) {
    BY_DIM(viscous, f, mesh, v, factor, out);
}

KERNEL viscous_diagonal(const int D, const silt_fluid *f, const silt_mesh *mesh, double *diagonal) {
    for (int e = 0; e < f->n_cell; e++)
        for (int a = 0; a <= D; a++) {
            double square = 0;
            for (int d = 0; d < D; d++)
                square += silt_square(f->flux[(D + 1) * D * e + D * a + d]);
            diagonal[mesh->cell[e][a]] += (1 + 4.0 / (3 * D)) * f->mu[e] * f->inverse[e] * square;
        }
}

void silt_assemble_viscous_diagonal(const silt_fluid *f, const silt_mesh *mesh, double *diagonal) {
    BY_DIM(viscous_diagonal, f, mesh, diagonal);
}

KERNEL mass_excess(const int D, const silt_fluid *f, const silt_mesh *mesh, double density, const double *a, double *out) {
    for (int e = 0; e < f->n_cell; e++) {
        const int *cell = mesh->cell[e];
        double m = density * f->cell_volume[e] / ((D + 1) * (D + 2));
        if (f->share)
            for (int b = 0; b <= D; b++)
                m -= density * f->cell_volume[e] * f->share[(D + 1) * e + b] / ((D + 1) * (D + 2));
        for (int d = 0; d < D; d++) {
            double sum = 0;
            for (int b = 0; b <= D; b++)
                sum += a[D * cell[b] + d];
            for (int b = 0; b <= D; b++)
                out[D * cell[b] + d] += m * ((D + 1) * a[D * cell[b] + d] - sum);
        }
    }
}

void silt_assemble_mass_excess(const silt_fluid *f, const silt_mesh *mesh, double density, const double *a, double *out) {
    BY_DIM(mass_excess, f, mesh, density, a, out);
}

KERNEL continuity(const int D, silt_fluid *f, const silt_mesh *mesh, const double *v, const double *p) {
    for (int e = 0; e < f->n_cell; e++) {
        const int *cell = mesh->cell[e];
        const double *flux = f->flux + (D + 1) * D * e, *share = f->share ? f->share + (D + 1) * e : NULL;
        double divergence = 0, carried[3] = {0}, stable[3];
        for (int a = 0; a <= D; a++)
            for (int d = 0; d < D; d++)
                divergence += v[D * cell[a] + d] * flux[D * a + d];
        if (share)
            for (int a = 0; a <= D; a++)
                for (int d = 0; d < D; d++)
                    carried[d] += share[a] * v[D * cell[a] + d];
        for (int d = 0; d < D; d++) {
            double slope = 0, mean = 0;
            for (int a = 0; a <= D; a++) {
                slope += (p[cell[a]] + (f->potential ? f->potential[cell[a]] : 0)) * flux[D * a + d];
                mean += f->projection[D * cell[a] + d] / (D + 1);
            }
            stable[d] = f->tau[e] * f->inverse[e] * (slope + f->cell_volume[e] * mean);
        }
        for (int a = 0; a <= D; a++) {
            double gain = divergence / (D + 1), smooth = 0;
            for (int d = 0; d < D; d++) {
                smooth += flux[D * a + d] * stable[d];
                gain += flux[D * a + d] * carried[d];
            }
            f->residual[cell[a]] += smooth;
            *(f->mobile[cell[a]] == 1 ? &f->residual[cell[a]] : &f->withheld[cell[a]]) += gain;
        }
    }
}

void silt_assemble_continuity(silt_fluid *f, const silt_mesh *mesh, const silt_drag *drag, const double *rate, const double *v,
                              const double *p) {
    for (int j = 0; j < f->n_node; j++) {
        const double asked = -(rate ? rate[j] : 0) - (drag ? drag->source[j] : 0);
        f->residual[j] = f->mobile[j] == 1 ? asked : 0;
        f->withheld[j] = f->mobile[j] == 1 ? 0 : asked;
    }
    BY_DIM(continuity, f, mesh, v, p);
}

KERNEL projection(const int D, silt_fluid *f, const silt_mesh *mesh, const double *p) {
    memset(f->projection, 0, (size_t)D * (size_t)f->n_node * sizeof(double));
    memset(f->projection_weight, 0, (size_t)f->n_node * sizeof(double));
    for (int e = 0; e < f->n_cell; e++) {
        const int *cell = mesh->cell[e];
        const double *flux = f->flux + (D + 1) * D * e, weight = f->tau[e] * f->cell_volume[e];
        for (int a = 0; a <= D; a++)
            f->projection_weight[cell[a]] += weight;
        for (int d = 0; d < D; d++) {
            double slope = 0;
            for (int a = 0; a <= D; a++)
                slope += (p[cell[a]] + (f->potential ? f->potential[cell[a]] : 0)) * flux[D * a + d];
            for (int a = 0; a <= D; a++)
                f->projection[D * cell[a] + d] -= f->tau[e] * slope;
        }
    }
    for (int i = 0; i < f->n_node; i++)
        if (f->projection_weight[i] > 0)
            for (int d = 0; d < D; d++)
                f->projection[D * i + d] /= f->projection_weight[i];
}

void silt_assemble_projection(silt_fluid *f, const silt_mesh *mesh, const double *p) { BY_DIM(projection, f, mesh, p); }

KERNEL divergence(const int D, const silt_fluid *f, const silt_mesh *mesh, const double *v, const double *p, double *out) {
    memset(out, 0, (size_t)f->n_node * sizeof(double));
    for (int e = 0; e < f->n_cell; e++) {
        const int *cell = mesh->cell[e];
        const double *flux = f->flux + (D + 1) * D * e, *share = f->share ? f->share + (D + 1) * e : NULL;
        double sum = 0, carried[3] = {0}, slope[3] = {0};
        for (int a = 0; a <= D; a++)
            for (int d = 0; d < D; d++) {
                sum += v[D * cell[a] + d] * flux[D * a + d];
                slope[d] += p[cell[a]] * flux[D * a + d];
                if (share)
                    carried[d] += share[a] * v[D * cell[a] + d];
            }
        const double weight = f->tau[e] * f->inverse[e];
        for (int a = 0; a <= D; a++) {
            double gain = sum / (D + 1);
            for (int d = 0; d < D; d++)
                gain += flux[D * a + d] * (weight * slope[d] + carried[d]);
            out[cell[a]] += gain;
        }
    }
}

void silt_assemble_divergence(const silt_fluid *f, const silt_mesh *mesh, const double *v, const double *p, double *out) {
    BY_DIM(divergence, f, mesh, v, p, out);
}
