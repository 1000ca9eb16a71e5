/** @file water_column.h
 * A column of water with periodic sides for tests of what makes it viscous: its mesh, its walls, steps of its momentum; after cmocka.h.
 */
#ifndef SILT_WATER_COLUMN_H
#define SILT_WATER_COLUMN_H

#include "viscosity.h"

#define NEAR(value, expected, tolerance)                                                                                 \
    do {                                                                                                                 \
        const double v_ = (value), e_ = (expected);                                                                      \
        if (!(fabs(v_ - e_) <= (tolerance)))                                                                             \
            fail_msg("%s:%d: %s is %.10g, not %.10g within %g", __FILE__, __LINE__, #value, v_, e_, (double)(tolerance)); \
    } while (0)

// ---- a column of water with periodic sides: rows of nodes, cells of Kuhn's subdivision, the wall below, free surface above

#define ACROSS 4

typedef struct column {
    int dim, n_row, plane; // nodes of a row
    double h, height;
    silt_scene scene;
    silt_wall wall;
    silt_walls walls;
    silt_nodes nodes;
    silt_mesh mesh;
    silt_depth depth;
    silt_wall_law law;
    silt_eddy eddy;
    double *flux, *grad, *volume, *inverse, *mu, *v, *friction, *force, *mass; // mass per row
    int passes;
} column;

// what silt_mesh_connect says, by brute force and for both dimensions
static inline void connect(column *c) {
    silt_mesh *m = &c->mesh;
    const int dim = c->dim, n = c->nodes.count, most = 64;
    m->n_node = n;
    m->node_cell_start = silt_alloc((size_t)n + 1, sizeof(int));
    m->node_cell = silt_alloc((size_t)m->n_cell * 4, sizeof(int));
    m->neighbour_start = silt_alloc((size_t)n + 1, sizeof(int));
    m->neighbour = silt_alloc((size_t)n * (size_t)most, sizeof(int));
    for (int e = 0; e < m->n_cell; e++)
        for (int a = 0; a <= dim; a++)
            m->node_cell_start[m->cell[e][a] + 1]++;
    for (int i = 0; i < n; i++)
        m->node_cell_start[i + 1] += m->node_cell_start[i];
    int *filled = silt_alloc((size_t)n, sizeof *filled), count = 0;
    for (int e = 0; e < m->n_cell; e++)
        for (int a = 0; a <= dim; a++) {
            const int i = m->cell[e][a];
            m->node_cell[m->node_cell_start[i] + filled[i]++] = e;
        }
    free(filled);
    for (int i = 0; i < n; i++) {
        m->neighbour_start[i] = count;
        for (int k = m->node_cell_start[i]; k < m->node_cell_start[i + 1]; k++)
            for (int a = 0; a <= dim; a++) {
                const int j = m->cell[m->node_cell[k]][a];
                bool known = false;
                for (int q = m->neighbour_start[i]; q < count; q++)
                    known |= m->neighbour[q] == j;
                int at = count;
                for (; !known && at > m->neighbour_start[i] && m->neighbour[at - 1] > j; at--) // rising
                    m->neighbour[at] = m->neighbour[at - 1];
                m->neighbour[at] = known ? m->neighbour[at] : j;
                count += !known;
            }
    }
    m->neighbour_start[n] = count;
}

static inline void column_open(column *c, int dim, int n_row, double height) {
    *c = (column){.dim = dim, .n_row = n_row, .h = height / (n_row - 1), .height = height};
    c->plane = dim == 3 ? ACROSS * ACROSS : ACROSS;
    const double h = c->h;
    c->scene.dimension = dim;
    c->scene.fluid = (silt_fluid_def){.density = 1000, .viscosity = 1e-3, .size = h, .plastic_rate = 1e-3, .flow_index = 1};
    c->scene.n_wall = 1;
    c->scene.wall = &c->wall;

    // one wall element, its normal upwards
    silt_walls *w = &c->walls;
    w->dim = dim;
    w->count = w->n_wall = 1;
    w->normal = silt_alloc(1, sizeof *w->normal);
    w->normal[0][dim - 1] = 1;
    w->wall = silt_alloc(1, sizeof *w->wall);
    w->patch = silt_alloc(1, sizeof *w->patch);
    w->slip = silt_alloc(1, 1);
    w->slip[0] = 1;
    w->roughness = silt_alloc(1, sizeof *w->roughness);

    silt_nodes *nodes = &c->nodes;
    nodes->dim = dim;
    nodes->count = n_row * c->plane;
    nodes->x = silt_alloc((size_t)(dim * nodes->count), sizeof(double));
    nodes->kind = silt_alloc((size_t)nodes->count, 1);
    nodes->owner = silt_alloc((size_t)nodes->count, sizeof(int));
    nodes->wall = silt_alloc((size_t)nodes->count, sizeof *nodes->wall);
    for (int i = 0; i < nodes->count; i++) {
        const int row = i / c->plane, k = i % c->plane;
        nodes->x[dim * i] = k % ACROSS * h;
        if (dim == 3)
            nodes->x[dim * i + 1] = k / ACROSS * h;
        nodes->x[dim * i + dim - 1] = row * h;
        for (int s = 0; s < 3; s++)
            nodes->wall[i][s] = s == 0 && row == 0 ? 0 : -1;
    }

    // cells: one per order of the axes, along the cube's edges from its lowest to its highest corner
    silt_mesh *m = &c->mesh;
    m->dim = dim;
    for (int d = 0; d < dim - 1; d++)
        m->period[d] = ACROSS * h;
    static const int order[8][3] = {{0, 1, 2}, {1, 2, 0}, {2, 0, 1}, {1, 0, 2}, {0, 2, 1}, {2, 1, 0}, {0, 1, 0}, {1, 0, 0}};
    const int first = dim == 3 ? 0 : 6, n_order = dim == 3 ? 6 : 2;
    m->cell = silt_alloc((size_t)((n_row - 1) * c->plane * n_order), sizeof *m->cell);
    m->facet = silt_alloc((size_t)(4 * c->plane), sizeof *m->facet);
    m->facet_kind = silt_alloc((size_t)(4 * c->plane), 1);
    for (int i = 0; i < (n_row - 1) * c->plane; i++)
        for (int q = 0; q < n_order; q++) {
            int at[3] = {i % c->plane % ACROSS, dim == 3 ? i % c->plane / ACROSS : i / c->plane, i / c->plane}, *cell = m->cell[m->n_cell++];
            for (int a = 0; a <= dim; a++) {
                if (a > 0)
                    at[order[first + q][a - 1]]++;
                const int row = at[dim - 1];
                cell[a] = row * c->plane + (dim == 3 ? at[1] % ACROSS * ACROSS : 0) + at[0] % ACROSS;
            }
            cell[3] = dim == 3 ? cell[3] : -1;
            double corner[12];
            silt_cell_corners(m, nodes->x, cell, corner);
            if (silt_cell_volume(m, nodes->x, m->n_cell - 1) < 0) {
                const int t = cell[0];
                cell[0] = cell[1];
                cell[1] = t;
            }
            // its face on the lowest or the highest row
            for (int side = 0; side < 2; side++) {
                int face[4], n = 0, apex = -1;
                for (int a = 0; a <= dim; a++) {
                    const int row = cell[a] / c->plane;
                    if (row == (side ? n_row - 1 : 0))
                        face[n++] = cell[a];
                    else
                        apex = a;
                }
                if (n != dim)
                    continue;
                // outward: cell[apex] last makes a positive volume with the face seen from inside
                int *facet = m->facet[m->n_facet];
                facet[2] = -1;
                memcpy(facet, face, (size_t)dim * sizeof(int));
                if ((dim - apex) % 2 == (dim == 3 ? 0 : 1)) {
                    facet[0] = face[1];
                    facet[1] = face[0];
                }
                m->facet_kind[m->n_facet++] = side ? FACET_FREE : FACET_WALL;
            }
        }
    connect(c);

    c->grad = silt_alloc((size_t)(m->n_cell * (dim + 1) * dim), sizeof(double));
    c->flux = silt_alloc((size_t)(m->n_cell * (dim + 1) * dim), sizeof(double));
    c->inverse = silt_alloc((size_t)m->n_cell, sizeof(double));
    c->volume = silt_alloc((size_t)m->n_cell, sizeof(double));
    c->mu = silt_alloc((size_t)m->n_cell, sizeof(double));
    c->v = silt_alloc((size_t)(dim * nodes->count), sizeof(double));
    c->friction = silt_alloc((size_t)nodes->count, sizeof(double));
    c->force = silt_alloc((size_t)(dim * nodes->count), sizeof(double));
    c->mass = silt_alloc((size_t)n_row, sizeof(double));
    for (int e = 0; e < m->n_cell; e++) {
        // gradients: rows of the inverse of the edges' matrix
        double x[12], a[3][3] = {{0}};
        silt_cell_corners(m, nodes->x, m->cell[e], x);
        c->volume[e] = silt_cell_volume(m, nodes->x, e);
        for (int k = 0; k < dim; k++)
            for (int d = 0; d < dim; d++)
                a[k][d] = x[dim * (k + 1) + d] - x[d];
        if (dim == 2)
            a[2][2] = 1;
        double *g = c->grad + e * (dim + 1) * dim;
        const double det = a[0][0] * (a[1][1] * a[2][2] - a[1][2] * a[2][1]) - a[0][1] * (a[1][0] * a[2][2] - a[1][2] * a[2][0]) +
                           a[0][2] * (a[1][0] * a[2][1] - a[1][1] * a[2][0]);
        for (int k = 0; k < dim; k++)
            for (int d = 0; d < dim; d++) {
                const int k1 = (k + 1) % 3, k2 = (k + 2) % 3, d1 = (d + 1) % 3, d2 = (d + 2) % 3;
                g[dim * (k + 1) + d] = (a[k1][d1] * a[k2][d2] - a[k1][d2] * a[k2][d1]) / det;
                g[d] -= g[dim * (k + 1) + d];
            }
        c->inverse[e] = 1 / c->volume[e];
        for (int k = 0; k < (dim + 1) * dim; k++)
            c->flux[e * (dim + 1) * dim + k] = c->volume[e] * g[k];
        for (int b = 0; b <= dim; b++)
            c->mass[m->cell[e][b] / c->plane] += 1000 * c->volume[e] / (dim + 1);
    }
}

static inline void column_close(column *c) {
    silt_walls_clear(&c->walls);
    silt_nodes_clear(&c->nodes);
    silt_mesh_clear(&c->mesh);
    silt_depth_clear(&c->depth);
    silt_wall_law_clear(&c->law);
    silt_eddy_clear(&c->eddy);
    free(c->grad);
    free(c->flux);
    free(c->inverse);
    free(c->volume);
    free(c->mu);
    free(c->v);
    free(c->friction);
    free(c->force);
    free(c->mass);
}

// One step of backward Euler under the downhill acceleration g: momentum along x alone, iterated as the water's step does.
// dt = HUGE_VAL: steady. The law of the wall, or sticking where the wall does.
static inline void column_step(column *c, double g, double dt, int most) {
    const int dim = c->dim, n = c->n_row;
    const silt_mesh *m = &c->mesh;
    double *lower = silt_alloc((size_t)n, sizeof(double)), *diagonal = silt_alloc((size_t)n, sizeof(double));
    double *right = silt_alloc((size_t)n, sizeof(double)), *old = silt_alloc((size_t)n, sizeof(double));
    for (int r = 0; r < n; r++)
        old[r] = c->v[dim * r * c->plane];
    double change = HUGE_VAL;
    for (c->passes = 0; c->passes < most && change > 1e-10; c->passes++) {
        silt_viscosity_update(&c->scene, &c->nodes, m, &c->depth, &c->eddy, c->flux, c->inverse, c->v, c->passes == 0 ? 1 : 0.5, c->mu, NULL);
        silt_wall_law_traction(&c->law, &c->scene, dim, c->v, c->friction, c->force);
        for (int r = 0; r < n; r++) {
            diagonal[r] = c->mass[r] / dt;
            right[r] = c->mass[r] * (g + old[r] / dt);
            lower[r] = 0;
            for (int k = 0; k < c->plane; k++) {
                diagonal[r] += c->friction[r * c->plane + k];
                right[r] += c->force[dim * (r * c->plane + k)];
            }
        }
        for (int e = 0; e < m->n_cell; e++)
            for (int a = 0; a <= dim; a++)
                for (int b = 0; b <= dim; b++) {
                    const double *grad = c->grad + e * (dim + 1) * dim;
                    const double k = c->mu[e] * c->volume[e] * grad[dim * a + dim - 1] * grad[dim * b + dim - 1];
                    const int r = m->cell[e][a] / c->plane, q = m->cell[e][b] / c->plane;
                    if (r == q)
                        diagonal[r] += k;
                    else if (q == r - 1)
                        lower[r] += k;
                }
        if (c->walls.slip[0] == 0) {
            diagonal[0] = 1;
            right[0] = 0;
            lower[1] = 0;
        }
        double *upper = silt_alloc((size_t)n, sizeof(double)); // symmetric but for the held row
        for (int r = 0; r < n - 1; r++)
            upper[r] = r == 0 && c->walls.slip[0] == 0 ? 0 : lower[r + 1];
        for (int r = 1; r < n; r++) {
            const double f = lower[r] / diagonal[r - 1];
            diagonal[r] -= f * upper[r - 1];
            right[r] -= f * right[r - 1];
        }
        change = 0;
        double size = 1e-12, above = 0;
        for (int r = n - 1; r >= 0; r--) {
            above = (right[r] - upper[r] * above) / diagonal[r];
            change = silt_max(change, fabs(above - c->v[dim * r * c->plane]));
            size = silt_max(size, fabs(above));
            for (int k = 0; k < c->plane; k++)
                c->v[dim * (r * c->plane + k)] = above;
        }
        change /= size;
        free(upper);
    }
    free(lower);
    free(diagonal);
    free(right);
    free(old);
}

static inline void column_place(column *c) {
    silt_depth_update(&c->depth, &c->scene, &c->walls, &c->nodes, &c->mesh, c->nodes.x);
    silt_wall_law_place(&c->law, &c->scene, &c->walls, &c->nodes, &c->mesh, c->nodes.x);
    if (c->nodes.eddy)
        silt_eddy_place(&c->eddy, &c->nodes, &c->mesh, &c->depth, &c->law);
}

static inline double column_mean(const column *c) {
    double sum = 0, mass = 0;
    for (int r = 0; r < c->n_row; r++) {
        sum += c->mass[r] * c->v[c->dim * r * c->plane];
        mass += c->mass[r];
    }
    return sum / mass;
}

static inline double column_shear(const column *c) { return c->law.point[0].shear[0]; }

#endif
