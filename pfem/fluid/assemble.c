// integrals over the cells; every kernel is written once and compiled for two and for three dimensions
#include "fluid.h"
#include "kernel.h"

// a cell's V grad N_a, and nodal vectors: copies, since the compiler must read anew after every store what it may have changed
KERNEL cell_flux(const int D, const silt_fluid *f, int e, double g[4][3]) {
    for (int a = 0; a <= D; a++)
        for (int d = 0; d < D; d++)
            g[a][d] = f->flux[((D + 1) * e + a) * D + d];
}

// The V grad N_a of a cell add up to nought: sums over its nodes are sums over all but the first, of differences from the first.
// A quarter to a third less to multiply.
KERNEL cell_slope(const int D, double g[4][3], const double p[4], double slope[3]) {
    for (int d = 0; d < D; d++) {
        slope[d] = (p[1] - p[0]) * g[1][d];
        for (int a = 2; a <= D; a++)
            slope[d] += (p[a] - p[0]) * g[a][d];
    }
}

KERNEL cell_nodal(const int D, const double *x, const int *cell, double v[4][3]) {
    for (int a = 0; a <= D; a++)
        for (int d = 0; d < D; d++)
            v[a][d] = x[D * cell[a] + d];
}

KERNEL pressure(const int D, const silt_fluid *f, const silt_mesh *mesh, int e, const silt_to to, const double *p, const double *shares) {
    const int *cell = mesh->cell[e];
    const double *share = shares ? shares + (D + 1) * e : NULL;
    double g[4][3], slope[3] = {0}, mean = 0;
    cell_flux(D, f, e, g);
    for (int a = 0; a <= D; a++)
        mean += p[cell[a]];
    mean *= 1.0 / (D + 1);
    for (int a = 0; a <= D && shares; a++)
        for (int d = 0; d < D; d++)
            slope[d] += p[cell[a]] * g[a][d];
    for (int a = 0; a <= D; a++)
        for (int d = 0; d < D; d++)
            to.wide[D * to.at[a] + d] += shares ? g[a][d] * mean + share[a] * slope[d] : g[a][d] * mean;
}

void silt_assemble_pressure(const silt_fluid *f, const silt_mesh *mesh, const double *p, double *out) {
    if (f->share)
        BY_CELL(SUMS(f->dim, out, NULL), pressure, p, f->share);
    else
        BY_CELL(SUMS(f->dim, out, NULL), pressure, p, NULL);
    if (f->film)
        silt_film_push(f->film, mesh, p, out);
}

KERNEL pressure_lost(const int D, const silt_fluid *f, const silt_mesh *mesh, const double *p, double *lost) {
    for (int e = 0; e < f->n_cell; e++) {
        double g[4][3], slope[3] = {0}, sum = 0;
        cell_flux(D, f, e, g);
        for (int a = 0; a <= D; a++) {
            sum += f->share[(D + 1) * e + a];
            for (int d = 0; d < D; d++)
                slope[d] += p[mesh->cell[e][a]] * g[a][d];
        }
        for (int d = 0; d < D; d++)
            lost[d] += slope[d] * sum;
    }
}

void silt_assemble_pressure_lost(const silt_fluid *f, const silt_mesh *mesh, const double *p, double lost[3]) {
    BY_DIM(pressure_lost, f, mesh, p, lost);
}

KERNEL potential(const int D, const silt_fluid *f, const silt_mesh *mesh, int e, const silt_to to) {
    const int *cell = mesh->cell[e];
    const double *flux = f->flux + (D + 1) * D * e;
    for (int d = 0; d < D; d++) {
        double slope = 0;
        for (int a = 0; a <= D; a++)
            slope += f->potential[cell[a]] * flux[D * a + d];
        for (int a = 0; a <= D; a++)
            to.wide[D * to.at[a] + d] -= slope / (D + 1);
    }
}

void silt_assemble_potential(const silt_fluid *f, const silt_mesh *mesh, double *out) {
    BY_CELL(SUMS(f->dim, out, NULL), potential);
}

// diagonal: the operator's is added too
KERNEL viscous(const int D, const silt_fluid *f, const silt_mesh *mesh, int e, const silt_to to, const double *v, double factor,
               bool diagonal) {
    const int *cell = mesh->cell[e];
    double g[4][3], u[4][3], l[3][3], stress[3][3], trace = 0;
    cell_flux(D, f, e, g);
    cell_nodal(D, v, cell, u);
    for (int d = 0; d < D; d++)
        for (int k = 0; k < D; k++) {
            l[d][k] = (u[1][d] - u[0][d]) * g[1][k];
            for (int a = 2; a <= D; a++)
                l[d][k] += (u[a][d] - u[0][d]) * g[a][k];
        }
    for (int d = 0; d < D; d++)
        trace += l[d][d];
    const double scale = f->mu[e] * f->inverse[e], force = factor * scale;
    for (int d = 0; d < D; d++)
        for (int k = 0; k <= d; k++)
            stress[d][k] = stress[k][d] = force * (l[d][k] + l[k][d] - (d == k ? 2.0 / 3 * trace : 0));
    for (int d = 0; d < D; d++) {
        double rest = 0;
        for (int a = 1; a <= D; a++) {
            double sum = stress[d][0] * g[a][0];
            for (int k = 1; k < D; k++)
                sum += stress[d][k] * g[a][k];
            to.wide[D * to.at[a] + d] += sum;
            rest += sum;
        }
        to.wide[D * to.at[0] + d] -= rest;
    }
    for (int a = 0; a <= D && diagonal; a++) {
        double square = 0;
        for (int d = 0; d < D; d++)
            square += silt_square(g[a][d]);
        to.one[to.at[a]] += (1 + 4.0 / (3 * D)) * scale * square;
    }
}

void silt_assemble_viscous(const silt_fluid *f, const silt_mesh *mesh, const double *v, double factor, double *out) {
    BY_CELL(SUMS(f->dim, out, NULL), viscous, v, factor, false);
}

void silt_assemble_viscous_both(const silt_fluid *f, const silt_mesh *mesh, const double *v, double *out, double *diagonal) {
    BY_CELL(SUMS(f->dim, out, diagonal), viscous, v, 1, true);
}

KERNEL viscous_diagonal(const int D, const silt_fluid *f, const silt_mesh *mesh, int e, const silt_to to) {
    (void)mesh;
    for (int a = 0; a <= D; a++) {
        double square = 0;
        for (int d = 0; d < D; d++)
            square += silt_square(f->flux[(D + 1) * D * e + D * a + d]);
        to.one[to.at[a]] += (1 + 4.0 / (3 * D)) * f->mu[e] * f->inverse[e] * square;
    }
}

void silt_assemble_viscous_diagonal(const silt_fluid *f, const silt_mesh *mesh, double *diagonal) {
    BY_CELL(SUMS(f->dim, NULL, diagonal), viscous_diagonal);
}

KERNEL mass_excess(const int D, const silt_fluid *f, const silt_mesh *mesh, int e, const silt_to to, double density,
                   const double *a) {
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
            to.wide[D * to.at[b] + d] += m * ((D + 1) * a[D * cell[b] + d] - sum);
    }
}

void silt_assemble_mass_excess(const silt_fluid *f, const silt_mesh *mesh, double density, const double *a, double *out) {
    BY_CELL(SUMS(f->dim, out, NULL), mass_excess, density, a);
}

KERNEL continuity(const int D, const silt_fluid *f, const silt_mesh *mesh, int e, const silt_to to, const double *v, const double *p, const double *potential,
                  const double *shares) {
    const int *cell = mesh->cell[e];
    const double *share = shares ? shares + (D + 1) * e : NULL;
    double g[4][3], u[4][3], pi[4][3], head[4], divergence = 0, carried[3] = {0}, stable[3];
    cell_flux(D, f, e, g);
    cell_nodal(D, v, cell, u);
    cell_nodal(D, f->projection, cell, pi);
    for (int a = 0; a <= D; a++)
        head[a] = p[cell[a]] + (potential ? potential[cell[a]] : 0);
    cell_slope(D, g, head, stable);
    for (int a = 1; a <= D; a++)
        for (int d = 0; d < D; d++)
            divergence += (u[a][d] - u[0][d]) * g[a][d];
    for (int a = 0; a <= D && shares; a++)
        for (int d = 0; d < D; d++)
            carried[d] += share[a] * u[a][d];
    const double weight = f->tau[e] * f->inverse[e], part = f->cell_volume[e] * (1.0 / (D + 1));
    for (int d = 0; d < D; d++) {
        double sum = 0;
        for (int a = 0; a <= D; a++)
            sum += pi[a][d];
        stable[d] = weight * (stable[d] + part * sum);
    }
    bool all = true;
    for (int a = 0; a <= D; a++)
        all &= f->mobile[cell[a]] == 1;
    for (int a = 0; a <= D; a++) {
        double gain = divergence * (1.0 / (D + 1)), smooth = 0;
        for (int d = 0; d < D; d++) {
            smooth += g[a][d] * stable[d];
            if (shares)
                gain += g[a][d] * carried[d];
        }
        if (all || f->mobile[cell[a]] == 1)
            to.one[to.at[a]] += smooth + gain;
        else {
            to.one[to.at[a]] += smooth;
            to.wide[to.at[a]] += gain;
        }
    }
}

void silt_assemble_continuity(silt_fluid *f, const silt_mesh *mesh, const silt_drag *drag, const double *rate, const double *v,
                              const double *p) {
    const double *taken = f->seep ? silt_seepage_taken(f, mesh, p) : NULL;
    SILT_PARALLEL(f->n_node)
    for (int j = 0; j < f->n_node; j++) {
        const double asked = -(rate ? rate[j] : 0) - (drag ? drag->source[j] : 0) + (taken ? taken[j] : 0);
        f->residual[j] = f->mobile[j] == 1 ? asked : 0;
        f->withheld[j] = f->mobile[j] == 1 ? 0 : asked;
    }
    if (f->potential || f->share)
        BY_CELL(SUMS(1, f->withheld, f->residual), continuity, v, p, f->potential, f->share);
    else
        BY_CELL(SUMS(1, f->withheld, f->residual), continuity, v, p, NULL, NULL);
    if (f->film)
        silt_film_continuity(f->film, mesh, f->mobile, v, f->residual, f->withheld);
    SILT_PARALLEL(f->n_node)
    for (int j = 0; j < f->n_node; j++)
        if (f->mobile[j] == MOBILE_SPRAY) { // its pressure is given: the smoothing's share is owed too
            f->withheld[j] += f->residual[j];
            f->residual[j] = 0;
        }
}

KERNEL projection(const int D, const silt_fluid *f, const silt_mesh *mesh, int e, const silt_to to, const double *p, const double *potential) {
    const int *cell = mesh->cell[e];
    const double tau = f->tau[e], weight = tau * f->cell_volume[e];
    double g[4][3], head[4], slope[3];
    cell_flux(D, f, e, g);
    for (int a = 0; a <= D; a++)
        head[a] = p[cell[a]] + (potential ? potential[cell[a]] : 0);
    cell_slope(D, g, head, slope);
    for (int a = 0; a <= D; a++) {
        to.one[to.at[a]] += weight;
        for (int d = 0; d < D; d++)
            to.wide[D * to.at[a] + d] -= tau * slope[d];
    }
}

void silt_assemble_projection(silt_fluid *f, const silt_mesh *mesh, const double *p) {
    const int D = f->dim;
    memset(f->projection, 0, (size_t)D * (size_t)f->n_node * sizeof(double));
    memset(f->projection_weight, 0, (size_t)f->n_node * sizeof(double));
    if (f->potential)
        BY_CELL(SUMS(D, f->projection, f->projection_weight), projection, p, f->potential);
    else
        BY_CELL(SUMS(D, f->projection, f->projection_weight), projection, p, NULL);
    SILT_PARALLEL(f->n_node)
    for (int i = 0; i < f->n_node; i++)
        if (f->projection_weight[i] > 0)
            for (int d = 0; d < D; d++)
                f->projection[D * i + d] /= f->projection_weight[i];
}

KERNEL divergence(const int D, const silt_fluid *f, const silt_mesh *mesh, int e, const silt_to to, const double *v, const double *p,
                  const double *shares) {
    const int *cell = mesh->cell[e];
    const double *share = shares ? shares + (D + 1) * e : NULL;
    double g[4][3], u[4][3], head[4], sum = 0, along[3];
    cell_flux(D, f, e, g);
    cell_nodal(D, v, cell, u);
    for (int a = 0; a <= D; a++)
        head[a] = p[cell[a]];
    cell_slope(D, g, head, along);
    for (int a = 1; a <= D; a++)
        for (int d = 0; d < D; d++)
            sum += (u[a][d] - u[0][d]) * g[a][d];
    sum *= 1.0 / (D + 1);
    for (int d = 0; d < D; d++) {
        along[d] *= f->tau[e] * f->inverse[e];
        for (int a = 0; a <= D && shares; a++)
            along[d] += share[a] * u[a][d];
    }
    double rest = 0;
    for (int a = 1; a <= D; a++) {
        double flow = 0;
        for (int d = 0; d < D; d++)
            flow += g[a][d] * along[d];
        to.one[to.at[a]] += sum + flow;
        rest += flow;
    }
    to.one[to.at[0]] += sum - rest;
}

void silt_assemble_divergence(const silt_fluid *f, const silt_mesh *mesh, const double *v, const double *p, double *out) {
    memset(out, 0, (size_t)f->n_node * sizeof(double));
    if (f->share)
        BY_CELL(SUMS(1, NULL, out), divergence, v, p, f->share);
    else
        BY_CELL(SUMS(1, NULL, out), divergence, v, p, NULL);
    if (f->film)
        silt_film_mouths(f->film, mesh, NULL, v, out, NULL);
}
