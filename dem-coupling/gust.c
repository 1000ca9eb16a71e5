// gust.c: gusts at grains: the eddies that the mesh does not show, as velocities that come and go
#include "../pfem/fluid/viscosity.h"
#include "state.h"

// Standard deviations over the local friction velocity along the stream, across it and upwards, near a bed: Nezu and Nakagawa, Turbulence in
// Open-Channel Flows, 1993. The correlation of the first and the last makes the stress, -u'w' = u*^2.
static const double along_share = 2.30, across_share = 1.63, up_share = 1.27;

void silt_gust_numbers(uint64_t random, double out[3]) {
    double normal[4];
    for (int k = 0; k < 4; k += 2) {
        const double radius = sqrt(-2.0 * log(1.0 - silt_uniform(&random))), angle = 2.0 * M_PI * silt_uniform(&random);
        normal[k] = radius * cos(angle);
        normal[k + 1] = radius * sin(angle);
    }
    const double joint = -1.0 / up_share; // of the upward part in that along the stream
    out[0] = joint * normal[2] + sqrt(along_share * along_share - joint * joint) * normal[0];
    out[1] = across_share * normal[1];
    out[2] = up_share * normal[2];
}

// square of the local friction velocity in a cell, m2/s2: eddy viscosity times the rate of shear
static double gust_stress(const silt_coupling *c, const silt_nodes *nodes, const silt_mesh *mesh, int e, double viscosity) {
    const int D = c->dim;
    const double eddy = silt_max(viscosity - c->scene->fluid.viscosity, 0.0) / c->scene->fluid.density;
    double corner[12], m[3][3] = {{0.0}}, gradient[9] = {0.0};
    silt_cell_corners(mesh, nodes->x, mesh->cell[e], corner);
    for (int a = 0; a < D; a++)
        for (int d = 0; d < D; d++)
            m[a][d] = corner[D * (a + 1) + d] - corner[d];
    if (D == 2)
        m[2][2] = 1.0;
    // rows of the inverse of m by its minors
    double minor[3][3], det = 0.0;
    for (int a = 0; a < 3; a++)
        for (int d = 0; d < 3; d++)
            minor[a][d] = m[(a + 1) % 3][(d + 1) % 3] * m[(a + 2) % 3][(d + 2) % 3] - m[(a + 1) % 3][(d + 2) % 3] * m[(a + 2) % 3][(d + 1) % 3];
    for (int d = 0; d < 3; d++)
        det += m[0][d] * minor[0][d];
    if (!(det > 0.0))
        return 0.0;
    for (int a = 0; a < D; a++)
        for (int j = 0; j < D; j++)
            for (int k = 0; k < D; k++)
                gradient[D * j + k] += minor[a][k] / det * (nodes->v[D * mesh->cell[e][a + 1] + j] - nodes->v[D * mesh->cell[e][0] + j]);
    return eddy * silt_shear_rate(D, gradient);
}

// the same at the nodes, the mean of the cells around by their size, as pairs of sum and size
static void gust_stresses(silt_coupling *c, const silt_nodes *nodes, const silt_mesh *mesh, const double *viscosity) {
    SILT_RESERVE(c->eddy, c->eddy_capacity, 2 * mesh->n_node + 2);
    memset(c->eddy, 0, 2 * (size_t)mesh->n_node * sizeof *c->eddy);
    for (int e = 0; e < mesh->n_cell; e++) {
        const double size = silt_cell_volume(mesh, nodes->x, e), square = gust_stress(c, nodes, mesh, e, viscosity[e]);
        for (int a = 0; a <= c->dim && size > 0.0; a++) {
            c->eddy[2 * mesh->cell[e][a]] += size * square;
            c->eddy[2 * mesh->cell[e][a] + 1] += size;
        }
    }
}

// directions along the stream at the grain, across it and up. @return false: there is no stream
static bool gust_axes(const silt_coupling *c, const double *stream, double axis[3][3]) {
    const int D = c->dim, up = D - 1;
    const double *gravity = c->scene->gravity, g = silt_length(3, gravity);
    double rise = 0.0;
    for (int d = 0; d < 3; d++) {
        axis[2][d] = g > 0.0 ? -gravity[d] / g : d == up;
        rise += d < D ? axis[2][d] * stream[d] : 0.0;
    }
    for (int d = 0; d < 3; d++)
        axis[0][d] = d < D ? stream[d] - rise * axis[2][d] : 0.0;
    const double speed = silt_length(3, axis[0]);
    if (!(speed > 0.0))
        return false;
    for (int d = 0; d < 3; d++)
        axis[0][d] /= speed;
    for (int d = 0; d < 3; d++)
        axis[1][d] = axis[2][(d + 1) % 3] * axis[0][(d + 2) % 3] - axis[2][(d + 2) % 3] * axis[0][(d + 1) % 3];
    return true;
}

void silt_coupling_gusts(silt_coupling *c, const silt_nodes *nodes, const silt_mesh *mesh, const double *viscosity, double time) {
    const silt_scene *scene = c->scene;
    if (!c->wet)
        return;
    gust_stresses(c, nodes, mesh, viscosity);
    for (int i = 0; i < c->n_grain && i < c->n_loaded; i++) {
        coupling_grain *g = &c->grain[i];
        const silt_exchange_grain *e = &c->exchange.grain[i];
        double square = 0.0, axis[3][3], share[3];
        memset(g->gust, 0, sizeof g->gust);
        for (int a = 0; a <= c->dim && e->cell >= 0; a++) {
            const double *sum = c->eddy + 2 * mesh->cell[e->cell][a];
            square += sum[1] > 0.0 ? e->weight[a] * sum[0] / sum[1] : 0.0;
        }
        if (!(square > 0.0) || !gust_axes(c, e->water, axis))
            continue;
        // each grain's gusts begin at times of its own
        uint64_t random = silt_hash(silt_hash(0, &scene->fluid.seed, sizeof scene->fluid.seed), &g->id, sizeof g->id), phase = random;
        const int64_t turn = (int64_t)floor(time / scene->grains.gusts + silt_uniform(&phase));
        silt_gust_numbers(silt_hash(random, &turn, sizeof turn), share);
        for (int k = 0; k < 3; k++)
            for (int d = 0; d < c->dim; d++)
                g->gust[d] += share[k] * sqrt(square) * axis[k][d];
    }
    c->found = c->view->fresh = false;
}
