// The model of Spalart and Allmaras (La Recherche Aerospatiale 1, 1994, without trip): an eddy viscosity that the nodes carry with the
// water, made by its turning, eaten near walls, spread by itself. Rough walls: Aupoix and Spalart (Int. J. Heat Fluid Flow 24, 2003).
// All terms of a cell are taken from its means: where velocity and eddies are those of a log layer they cancel exactly, on any mesh.
#include "parallel.h"
#include "viscosity.h"

#define SIGMA (2.0 / 3)
#define CB1 0.1355
#define CB2 0.622
#define CV1 7.1
#define CW1 (CB1 / (SILT_KAPPA * SILT_KAPPA) + (1 + CB2) / SIGMA)
#define CW2 0.3
#define CW3 2.0
#define R_MOST 10.0
#define TURN_LOW 0.7   // c_2 and c_3 that keep S~ positive (Allmaras, Johnson and Spalart, ICCFD7-1902, 2012)
#define TURN_HIGH 0.9
#define ROUGH_SHIFT 0.03 // of k_s, by which a rough wall lies back
#define ROUGH_CHI 0.5
#define FRESH 3.0      // times the water's own viscosity: of water that nothing is known of
#define EVEN 3.0       // destruction takes from a node in proportion to the cell's mean over this, at least, where the node has less
#define SOLVED 1e-9    // of the largest value
#define SWEEPS 200

// ---- terms at a point

static double damping(double ratio) {
    const double cube = ratio * ratio * ratio;
    return cube / (cube + CV1 * CV1 * CV1);
}

static double viscous_damping(double nu, double value, double d, double rough) {
    return nu > 0 ? damping(value / nu + (rough > 0 ? ROUGH_CHI * rough / d : 0)) : 1;
}

double silt_eddy_viscosity(double nu, double value, double d, double rough) {
    return value > 0 ? value * viscous_damping(nu, value, d, rough) : 0;
}

void silt_eddy_sources(double nu, double value, double d, double rough, double omega, double *production, double *destruction) {
    *production = *destruction = 0;
    if (!(value > 0) || !(d > 0))
        return;
    if (d == HUGE_VAL) {
        *production = CB1 * omega * value;
        return;
    }
    const double square = silt_square(SILT_KAPPA * d), fv1 = viscous_damping(nu, value, d, rough);
    const double wall = value / square * (1 - value / (nu + value * fv1)); // f_v2 with nu~/nu for chi: true on rough walls too
    const double turn = wall >= -TURN_LOW * omega
                            ? omega + wall
                            : omega + omega * (TURN_LOW * TURN_LOW * omega + TURN_HIGH * wall) / ((TURN_HIGH - 2 * TURN_LOW) * omega - wall);
    const double r = value < R_MOST * turn * square ? value / (turn * square) : R_MOST;
    const double r3 = r * r * r, g = r + CW2 * (r3 * r3 - r), g6 = pow(g, 6), c6 = pow(CW3, 6);
    *production = CB1 * turn * value;
    *destruction = CW1 * g * pow((1 + c6) / (g6 + c6), 1.0 / 6) * silt_square(value / d);
}

double silt_vorticity(int dim, const double *gradient) {
    double sum = 0;
    for (int d = 0; d < dim; d++)
        for (int k = 0; k < d; k++)
            sum += silt_square(gradient[dim * d + k] - gradient[dim * k + d]);
    return sqrt(sum);
}

// ---- where walls are

void silt_eddy_clear(silt_eddy *e) {
    double *owned[] = {e->reach, e->rough, e->held, e->share, e->gain, e->loss, e->solve[0], e->solve[1], e->solve[2], e->solve[3], e->link};
    for (size_t k = 0; k < sizeof owned / sizeof *owned; k++)
        free(owned[k]);
    *e = (silt_eddy){0};
}

static void eddy_reserve(silt_eddy *e, int n_node, int n_link) {
    if (n_node > e->node_capacity) {
        const int need = n_node + n_node / 8 + 64;
        double **list[] = {&e->reach, &e->rough, &e->held, &e->share, &e->gain, &e->loss, &e->solve[0], &e->solve[1], &e->solve[2], &e->solve[3]};
        for (size_t k = 0; k < sizeof list / sizeof *list; k++) {
            int have = e->node_capacity;
            *list[k] = silt_grow(*list[k], &have, need, sizeof(double));
        }
        e->node_capacity = need;
    }
    SILT_RESERVE(e->link, e->link_capacity, n_link + 1);
}

// the law's point at a node, NULL: none
static const silt_wall_point *law_point(const silt_wall_law *law, int node) {
    const silt_wall_point *point = law->n_point ? &law->point[law->entry[node]] : NULL;
    return point && point->node == node ? point : NULL;
}

void silt_eddy_place(silt_eddy *e, const silt_nodes *nodes, const silt_mesh *mesh, const silt_depth *depth, const silt_wall_law *law) {
    eddy_reserve(e, nodes->count, mesh->neighbour_start[mesh->n_node]);
    for (int i = 0; i < mesh->n_node; i++) {
        const int facet = depth->wall_facet[i];
        const silt_wall_point *point = facet >= 0 && depth->brakes[facet] == 2 ? law_point(law, mesh->facet[facet][0]) : NULL;
        e->rough[i] = point ? point->roughness : 0;
        e->reach[i] = depth->room[i] + ROUGH_SHIFT * e->rough[i];
    }
}

// eddies of a log law, or the same everywhere
static double eddy_given(const silt_eddy_def *def, const silt_depth *depth, int i, double nu) {
    if (!(def->shear > 0) || depth->wall[i] == HUGE_VAL)
        return def->viscosity > 0 ? def->viscosity : FRESH * nu;
    const double d = depth->wall[i], above = depth->surface[i] < HUGE_VAL ? depth->surface[i] : silt_max(depth->enclosed - d, 0);
    return d > 0 ? SILT_KAPPA * def->shear * d * above / (d + above) : 0;
}

void silt_eddy_start(const silt_scene *scene, silt_nodes *nodes, const silt_depth *depth) {
    const double nu = scene->fluid.viscosity / scene->fluid.density;
    for (int i = 0; i < nodes->count; i++)
        nodes->eddy[i] = eddy_given(&scene->fluid.eddy, depth, i, nu);
}

// What walls and inlets prescribe. Up to the height where the law of the wall looks at the water the eddies are those of its log layer, nought
// where water sticks; openings with a level pass on what comes (silt_eddy_advance).
static void hold(silt_eddy *e, const silt_scene *scene, const silt_nodes *nodes, const silt_mesh *mesh, const silt_depth *depth,
                 const silt_wall_law *law) {
    const int dim = mesh->dim == 3 ? 3 : 2;
    const double rho = scene->fluid.density, nu = scene->fluid.viscosity / rho;
    for (int i = 0; i < mesh->n_node; i++) {
        const int facet = depth->wall_facet[i], owner = nodes->owner[i];
        e->held[i] = -1;
        if (!mesh->wet[i]) {
            e->held[i] = nodes->eddy[i];
            continue;
        }
        if (nodes->kind[i] == NODE_INLET || (nodes->kind[i] == NODE_OPEN && owner < scene->fluid.n_inlet)) {
            e->held[i] = eddy_given(&scene->fluid.inlet[owner].eddy, depth, i, nu);
            continue;
        }
        if (nodes->kind[i] == NODE_OPEN)
            e->held[i] = nodes->eddy[i];
        if (facet < 0)
            continue;
        if (depth->brakes[facet] == 1) {
            e->held[i] = depth->wall[i] > 0 ? e->held[i] : 0;
            continue;
        }
        double star = 0, height = 0;
        for (int a = 0; a < dim; a++) {
            const silt_wall_point *point = law_point(law, mesh->facet[facet][a]);
            if (!point)
                continue;
            star += sqrt(sqrt(silt_dot(dim, point->shear, point->shear)) / rho) / dim;
            height = silt_max(height, point->height);
        }
        if (depth->wall[i] < height * (1 - 1e-9) || depth->wall[i] <= 0)
            e->held[i] = SILT_KAPPA * star * e->reach[i];
    }
}

// ---- a step

static double cell_mean(int dim, const int *cell, const double *value) {
    double sum = 0;
    for (int a = 0; a <= dim; a++)
        sum += value[cell[a]];
    return sum / (dim + 1);
}

double silt_eddy_of_cell(const silt_eddy *e, const silt_nodes *nodes, const silt_mesh *mesh, int c, double nu) {
    const int dim = mesh->dim == 3 ? 3 : 2, *cell = mesh->cell[c];
    return silt_eddy_viscosity(nu, cell_mean(dim, cell, nodes->eddy), cell_mean(dim, cell, e->reach), cell_mean(dim, cell, e->rough));
}

// sources of a cell to its nodes, and its diffusion to their links
static void add_cell(silt_eddy *e, const silt_nodes *nodes, const silt_mesh *mesh, int c, double nu, const double *flux, double inverse,
                     double volume, const double *v) {
    const int dim = mesh->dim == 3 ? 3 : 2, *cell = mesh->cell[c];
    double gradient[9] = {0}, slope[3] = {0}, production, destruction;
    for (int a = 0; a <= dim; a++)
        for (int k = 0; k < dim; k++) {
            slope[k] += nodes->eddy[cell[a]] * inverse * flux[dim * a + k];
            for (int d = 0; d < dim; d++)
                gradient[dim * d + k] += v[dim * cell[a] + d] * inverse * flux[dim * a + k];
        }
    const double mean = cell_mean(dim, cell, nodes->eddy), part = volume / (dim + 1);
    silt_eddy_sources(nu, mean, cell_mean(dim, cell, e->reach), cell_mean(dim, cell, e->rough), silt_vorticity(dim, gradient), &production,
                      &destruction);
    production += CB2 / SIGMA * silt_dot(dim, slope, slope);
    for (int a = 0; a <= dim; a++) {
        const int i = cell[a];
        e->share[i] += part;
        e->gain[i] += part * production;
        if (destruction > 0)
            e->loss[i] += part * destruction / silt_max(nodes->eddy[i], mean / EVEN);
        for (int b = 0; b < a; b++) {
            const double k = (nu + mean) / SIGMA * inverse * silt_dot(dim, flux + dim * a, flux + dim * b);
            e->link[silt_neighbour_index(mesh, i, cell[b])] += k;
            e->link[silt_neighbour_index(mesh, cell[b], i)] += k;
        }
    }
}

// Links that would carry eddies uphill, of obtuse cells, are taken as they were at the start of the step: the matrix has none.
static void settle_links(silt_eddy *e, const silt_nodes *nodes, const silt_mesh *mesh) {
    for (int i = 0; i < mesh->n_node; i++)
        for (int m = mesh->neighbour_start[i]; m < mesh->neighbour_start[i + 1]; m++) {
            if (!(e->link[m] > 0))
                continue;
            const double carried = e->link[m] * (nodes->eddy[i] - nodes->eddy[mesh->neighbour[m]]);
            if (carried > 0)
                e->gain[i] += carried;
            else if (nodes->eddy[i] > 0)
                e->loss[i] -= carried / nodes->eddy[i];
            e->link[m] = 0;
        }
}

// out = matrix x at free nodes, nought at held ones
static void apply(const silt_eddy *e, const silt_mesh *mesh, const double *diagonal, const double *x, double *out) {
    SILT_PARALLEL(mesh->n_node)
    for (int i = 0; i < mesh->n_node; i++) {
        double sum = 0;
        for (int m = mesh->neighbour_start[i]; m < mesh->neighbour_start[i + 1]; m++)
            sum += e->link[m] * x[mesh->neighbour[m]];
        out[i] = e->held[i] < 0 ? diagonal[i] * x[i] + sum : 0;
    }
}

// conjugate gradients from what is there, diagonal before them; nodes->eddy holds first guess and result
static void solve(silt_eddy *e, silt_nodes *nodes, const silt_mesh *mesh, double dt) {
    const int n = mesh->n_node;
    double *x = nodes->eddy, *diagonal = e->solve[0], *r = e->solve[1], *p = e->solve[2], *q = e->solve[3], most = 0;
    for (int i = 0; i < n; i++) {
        diagonal[i] = e->share[i] / dt + e->loss[i];
        for (int m = mesh->neighbour_start[i]; m < mesh->neighbour_start[i + 1]; m++)
            diagonal[i] -= mesh->neighbour[m] == i ? 0 : e->link[m];
        e->gain[i] += e->share[i] / dt * x[i];
        x[i] = e->held[i] < 0 ? x[i] : e->held[i];
        most = silt_max(most, x[i]);
    }
    apply(e, mesh, diagonal, x, q);
    double rz = 0;
    for (int i = 0; i < n; i++) {
        const bool free_one = e->held[i] < 0 && diagonal[i] > 0;
        r[i] = free_one ? e->gain[i] - q[i] : 0;
        p[i] = free_one ? r[i] / diagonal[i] : 0;
        rz += r[i] * p[i];
    }
    for (e->iterations = 0; e->iterations < SWEEPS; e->iterations++) {
        double worst = 0, pq = 0, next = 0;
        for (int i = 0; i < n; i++)
            worst = diagonal[i] > 0 ? silt_max(worst, fabs(r[i]) / diagonal[i]) : worst;
        if (!(worst > SOLVED * most))
            break;
        apply(e, mesh, diagonal, p, q);
        for (int i = 0; i < n; i++)
            pq += p[i] * q[i];
        for (int i = 0; i < n; i++) {
            x[i] += rz / pq * p[i];
            r[i] -= rz / pq * q[i];
            next += diagonal[i] > 0 ? r[i] * r[i] / diagonal[i] : 0;
        }
        for (int i = 0; i < n; i++)
            p[i] = (diagonal[i] > 0 ? r[i] / diagonal[i] : 0) + next / rz * p[i];
        rz = next;
    }
    for (int i = 0; i < n; i++)
        x[i] = silt_max(x[i], 0);
}

// nodes that stand on outlets with a level while the water goes past them: what comes to them
static void pass_on(const silt_scene *scene, silt_nodes *nodes, const silt_mesh *mesh) {
    for (int i = 0; i < mesh->n_node; i++) {
        if (nodes->kind[i] != NODE_OPEN || nodes->owner[i] < scene->fluid.n_inlet || !mesh->wet[i])
            continue;
        double sum = 0;
        int n = 0;
        for (int m = mesh->neighbour_start[i]; m < mesh->neighbour_start[i + 1]; m++)
            if (nodes->kind[mesh->neighbour[m]] != NODE_OPEN) {
                sum += nodes->eddy[mesh->neighbour[m]];
                n++;
            }
        nodes->eddy[i] = n ? sum / n : nodes->eddy[i];
    }
}

void silt_eddy_advance(silt_eddy *e, const silt_scene *scene, silt_nodes *nodes, const silt_mesh *mesh, const silt_depth *depth,
                       const silt_wall_law *law, const double *flux, const double *inverse, const double *volume, const double *v, double dt) {
    const int dim = mesh->dim == 3 ? 3 : 2, n = mesh->n_node, n_link = mesh->neighbour_start[n];
    const double nu = scene->fluid.viscosity / scene->fluid.density;
    hold(e, scene, nodes, mesh, depth, law);
    for (int i = 0; i < n; i++)
        e->share[i] = e->gain[i] = e->loss[i] = 0;
    memset(e->link, 0, (size_t)n_link * sizeof *e->link);
    for (int c = 0; c < mesh->n_cell; c++)
        add_cell(e, nodes, mesh, c, nu, flux + (dim + 1) * dim * c, inverse[c], volume[c], v);
    settle_links(e, nodes, mesh);
    solve(e, nodes, mesh, dt);
    pass_on(scene, nodes, mesh);
}
