// depth and distance to walls, eddy viscosity, and the viscosity of every cell
#include "viscosity.h"

#define SMAGORINSKY 0.17
#define WALE 0.5

// ---- distances

static double segment_distance(int dim, const double *p, const double *a, const double *b) {
    double along = 0, length = 0, sum = 0;
    for (int d = 0; d < dim; d++) {
        along += (p[d] - a[d]) * (b[d] - a[d]);
        length += silt_square(b[d] - a[d]);
    }
    const double t = length > 0 ? silt_clamp(along / length, 0, 1) : 0;
    for (int d = 0; d < dim; d++)
        sum += silt_square(p[d] - a[d] - t * (b[d] - a[d]));
    return sqrt(sum);
}

double silt_facet_distance(int dim, const double *point, const double *corner) {
    if (dim != 3)
        return segment_distance(2, point, corner, corner + 2);
    // foot of the perpendicular inside the triangle, else the nearest edge
    double u[3], v[3], w[3];
    for (int d = 0; d < 3; d++) {
        u[d] = corner[3 + d] - corner[d];
        v[d] = corner[6 + d] - corner[d];
        w[d] = point[d] - corner[d];
    }
    double n[3];
    silt_cross(u, v, n);
    const double nn = silt_dot(3, n, n), s = silt_triple(n, w, v), t = silt_triple(n, u, w);
    if (nn > 0 && s >= 0 && t >= 0 && s + t <= nn)
        return fabs(n[0] * w[0] + n[1] * w[1] + n[2] * w[2]) / sqrt(nn);
    return silt_min(segment_distance(3, point, corner, corner + 3),
                    silt_min(segment_distance(3, point, corner + 3, corner + 6), segment_distance(3, point, corner + 6, corner)));
}

static double node_facet_distance(const silt_mesh *mesh, const double *x, int node, const int *facet) {
    const int dim = mesh->dim == 3 ? 3 : 2;
    double origin[3] = {0}, corner[9];
    for (int d = 0; d < dim; d++) {
        corner[d] = silt_shortest(mesh, d, x[dim * facet[0] + d] - x[dim * node + d]);
        for (int a = 1; a < dim; a++)
            corner[dim * a + d] = corner[d] + silt_shortest(mesh, d, x[dim * facet[a] + d] - x[dim * facet[0] + d]);
    }
    return silt_facet_distance(dim, origin, corner);
}

// is facet k one of those looked for: free ones, or ones that brake
static bool wanted(const silt_depth *depth, const silt_mesh *mesh, bool free_ones, int k) {
    return free_ones ? mesh->facet_kind[k] == FACET_FREE : depth->brakes[k] > 0;
}

// nearest facets spread from node to node; a node offers its own and those beside it
static void spread(silt_depth *depth, const silt_mesh *mesh, const double *x, bool free_ones, double *distance, int *nearest) {
    const int n = depth->n_node, dim = mesh->dim == 3 ? 3 : 2;
    int *queue = depth->queue, head = 0, count = 0;
    for (int i = 0; i < n; i++) {
        distance[i] = HUGE_VAL;
        nearest[i] = -1;
        depth->queued[i] = 0;
    }
    for (int k = 0; k < mesh->n_facet; k++)
        for (int a = 0; a < dim && wanted(depth, mesh, free_ones, k); a++) {
            const int i = mesh->facet[k][a];
            if (nearest[i] >= 0)
                continue;
            distance[i] = 0;
            nearest[i] = k;
            depth->queued[i] = 1;
            queue[count++] = i;
        }
    while (count > 0) {
        const int i = queue[head];
        head = head + 1 == n ? 0 : head + 1;
        count--;
        depth->queued[i] = 0;
        const int own = nearest[i];
        for (int m = mesh->neighbour_start[i]; m < mesh->neighbour_start[i + 1]; m++) {
            const int j = mesh->neighbour[m];
            if (j == i || own == nearest[j] || distance[j] == 0)
                continue;
            double best = node_facet_distance(mesh, x, j, mesh->facet[own]);
            if (!(best < distance[j]))
                continue;
            // on to the facets beside it while they are nearer
            int k = own;
            for (bool nearer = true; nearer;) {
                nearer = false;
                const int from = k;
                for (int a = 0; a < dim; a++) {
                    const int c = mesh->facet[from][a];
                    for (int q = depth->start[c]; q < depth->start[c + 1]; q++) {
                        const int other = depth->item[q];
                        if (other == from || other == k || !wanted(depth, mesh, free_ones, other))
                            continue;
                        const double to = node_facet_distance(mesh, x, j, mesh->facet[other]);
                        if (to < best) {
                            best = to;
                            k = other;
                            nearer = true;
                        }
                    }
                }
            }
            distance[j] = best;
            nearest[j] = k;
            if (!depth->queued[j]) {
                depth->queued[j] = 1;
                const int tail = head + count;
                queue[tail >= n ? tail - n : tail] = j;
                count++;
            }
        }
    }
}

static void depth_reserve(silt_depth *depth, int n_node, int n_facet, int dim) {
    if (n_node > depth->node_capacity) {
        const int need = n_node + n_node / 2 + 64;
        int have;
#define ROOM(field) (have = depth->node_capacity, depth->field = silt_grow(depth->field, &have, need, sizeof *depth->field))
        ROOM(wall);
        ROOM(room);
        ROOM(surface);
        ROOM(wall_facet);
        ROOM(surface_facet);
        ROOM(queue);
        ROOM(queued);
#undef ROOM
        depth->node_capacity = need;
    }
    SILT_RESERVE(depth->start, depth->start_capacity, n_node + 1);
    SILT_RESERVE(depth->item, depth->item_capacity, dim * n_facet + 1);
    SILT_RESERVE(depth->brakes, depth->facet_capacity, n_facet + 1);
    depth->n_node = n_node;
    depth->n_facet = n_facet;
}

void silt_depth_update(silt_depth *depth, const silt_scene *scene, const silt_walls *walls, const silt_nodes *nodes,
                       const silt_mesh *mesh, const double *x) {
    const int dim = mesh->dim == 3 ? 3 : 2, n = mesh->n_node;
    depth_reserve(depth, n, mesh->n_facet, dim);
    for (int k = 0; k < mesh->n_facet; k++) {
        double roughness;
        const int condition = silt_facet_condition(scene, walls, nodes, mesh, k, &roughness);
        depth->brakes[k] = condition == WALL_NO_SLIP ? 1 : condition == WALL_LAW ? 2 : 0;
    }

    // facets of every node
    memset(depth->start, 0, (size_t)(n + 1) * sizeof *depth->start);
    for (int k = 0; k < mesh->n_facet; k++)
        for (int a = 0; a < dim; a++)
            depth->start[mesh->facet[k][a]]++;
    int sum = 0;
    for (int i = 0; i <= n; i++) {
        const int count = i < n ? depth->start[i] : 0;
        sum += count;
        depth->start[i] = sum;
    }
    for (int k = mesh->n_facet - 1; k >= 0; k--)
        for (int a = 0; a < dim; a++)
            depth->item[--depth->start[mesh->facet[k][a]]] = k;

    spread(depth, mesh, x, false, depth->wall, depth->wall_facet);
    spread(depth, mesh, x, true, depth->surface, depth->surface_facet);
    memcpy(depth->room, depth->wall, (size_t)n * sizeof *depth->room);
    depth->enclosed = 0;
    for (int i = 0; i < n; i++)
        if (depth->surface[i] == HUGE_VAL && depth->wall[i] < HUGE_VAL)
            depth->enclosed = silt_max(depth->enclosed, depth->wall[i]);
}

struct depth_rank {
    double wall;
    int node;
};

static int rank_compare(const void *a, const void *b) {
    const struct depth_rank *p = a, *q = b;
    if (p->wall != q->wall)
        return p->wall < q->wall ? -1 : 1;
    return p->node - q->node;
}

// from neighbours nearer to the wall, weighted by how straight the edge leads away from it: sum of (fall/length)^2
static double room_of(const silt_depth *depth, const silt_mesh *mesh, const double *x, const double *solid, double limit, int i) {
    const int dim = mesh->dim == 3 ? 3 : 2;
    double sum = 0, weights = 0;
    for (int m = mesh->neighbour_start[i]; m < mesh->neighbour_start[i + 1]; m++) {
        const int j = mesh->neighbour[m];
        const double way = depth->wall[i] - depth->wall[j];
        if (j == i || !(way > 0))
            continue;
        double square = 0;
        for (int d = 0; d < dim; d++)
            square += silt_square(silt_shortest(mesh, d, x[dim * i + d] - x[dim * j + d]));
        const double open = 0.5 * (silt_max(1 - solid[i] / limit, 0) + silt_max(1 - solid[j] / limit, 0));
        const double weight = way * way / square;
        sum += weight * (depth->room[j] + way * open);
        weights += weight;
    }
    return weights > 0 ? sum / weights : depth->wall[i];
}

void silt_depth_crowd(silt_depth *depth, const silt_mesh *mesh, const double *x, const double *solid, double limit) {
    int n = 0;
    SILT_RESERVE(depth->rank, depth->rank_capacity, depth->n_node + 1);
    for (int i = 0; i < depth->n_node; i++)
        if (depth->wall[i] > 0 && depth->wall[i] < HUGE_VAL)
            depth->rank[n++] = (struct depth_rank){depth->wall[i], i};
    qsort(depth->rank, (size_t)n, sizeof *depth->rank, rank_compare);
    for (int k = 0; k < n; k++)
        depth->room[depth->rank[k].node] = room_of(depth, mesh, x, solid, limit, depth->rank[k].node);
}

void silt_depth_clear(silt_depth *depth) {
    free(depth->wall);
    free(depth->room);
    free(depth->rank);
    free(depth->surface);
    free(depth->wall_facet);
    free(depth->surface_facet);
    free(depth->brakes);
    free(depth->queue);
    free(depth->queued);
    free(depth->start);
    free(depth->item);
    *depth = (silt_depth){0};
}

// ---- eddy viscosity

double silt_mixing_length(double d, double s) {
    if (!(d < HUGE_VAL) || d <= 0 || s <= 0)
        return 0;
    return s < HUGE_VAL ? SILT_KAPPA * d * sqrt(s / (d + s)) : SILT_KAPPA * d;
}

double silt_shear_rate(int dim, const double *gradient) {
    double sum = 0;
    for (int d = 0; d < dim; d++) {
        sum += 2 * silt_square(gradient[dim * d + d]);
        for (int k = 0; k < d; k++)
            sum += silt_square(gradient[dim * d + k] + gradient[dim * k + d]);
    }
    return sqrt(sum);
}

double silt_eddy_smagorinsky(double delta, double d, double rate) {
    return silt_square(silt_min(SMAGORINSKY * delta, SILT_KAPPA * d)) * rate;
}

double silt_eddy_wale(int dim, double delta, const double *gradient) {
    // traceless symmetric part of the gradient's square, always in three dimensions
    double square[3][3] = {{0}}, trace = 0;
    for (int i = 0; i < dim; i++)
        for (int j = 0; j < dim; j++)
            for (int k = 0; k < dim; k++)
                square[i][j] += gradient[dim * i + k] * gradient[dim * k + j];
    for (int i = 0; i < dim; i++)
        trace += square[i][i];
    double ss = silt_square(silt_shear_rate(dim, gradient)) / 2, dd = 0;
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            dd += silt_square(0.5 * (square[i][j] + square[j][i]) - (i == j ? trace / 3 : 0));
    if (!(dd > 0))
        return 0;
    const double root = sqrt(sqrt(dd)); // dd^1/4
    return silt_square(WALE * delta) * dd * root * root / (ss * ss * sqrt(ss) + dd * root);
}

silt_turbulence silt_turbulence_model(const silt_scene *scene) {
    const silt_fluid_def *fluid = &scene->fluid;
    if (fluid->turbulence != TURBULENCE_AUTO)
        return fluid->turbulence;
    if (fluid->flow == FLOW_LAMINAR)
        return TURBULENCE_NONE;
    return scene->dimension == 3 ? TURBULENCE_WALE : TURBULENCE_MIXING_LENGTH;
}

bool silt_viscosity_varies(const silt_scene *scene) {
    return scene->fluid.rheology != RHEOLOGY_NEWTONIAN || silt_turbulence_model(scene) != TURBULENCE_NONE;
}

void silt_viscosity_update(const silt_scene *scene, const silt_nodes *nodes, const silt_mesh *mesh, const silt_depth *depth,
                           const silt_eddy *carried, const double *flux, const double *inverse, const double *v, double blend, double *mu,
                           silt_viscosity_report *report) {
    const silt_fluid_def *fluid = &scene->fluid;
    const silt_turbulence model = silt_turbulence_model(scene);
    const int dim = mesh->dim == 3 ? 3 : 2;
    const double height = silt_wall_height(fluid);
    double whole = 0, sum = 0, most = 0, fastest = 0;
    for (int e = 0; e < mesh->n_cell; e++) {
        const int *cell = mesh->cell[e];
        double gradient[9] = {0};
        for (int a = 0; a <= dim; a++)
            for (int d = 0; d < dim; d++)
                for (int k = 0; k < dim; k++)
                    gradient[dim * d + k] += v[dim * cell[a] + d] * inverse[e] * flux[((dim + 1) * e + a) * dim + k];
        const double rate = silt_shear_rate(dim, gradient);

        double eddy = 0;
        if (model == TURBULENCE_SPALART_ALLMARAS)
            eddy = silt_eddy_of_cell(carried, nodes, mesh, e, fluid->viscosity / fluid->density);
        else if (model != TURBULENCE_NONE) {
            double d = 0, room = 0, s = 0, h = 0;
            bool law = false;
            for (int a = 0; a <= dim; a++) {
                const int i = cell[a], facet = depth->wall_facet[i];
                d += depth->wall[i] / (dim + 1);
                room += depth->room[i] / (dim + 1);
                s += depth->surface[i] / (dim + 1);
                h += silt_node_h(nodes, i, fluid->size) / (dim + 1);
                law |= facet >= 0 && depth->brakes[facet] == 2;
            }
            // between walls all around the middle stands for the surface
            if (s == HUGE_VAL && d < HUGE_VAL)
                s = silt_max(depth->enclosed - d, 0);
            const double mixing = silt_square(silt_mixing_length(room, s)) * rate;
            const double delta = 1 / (dim == 3 ? cbrt(inverse[e]) : sqrt(inverse[e]));
            if (model == TURBULENCE_MIXING_LENGTH)
                eddy = mixing;
            else
                eddy = model == TURBULENCE_WALE ? silt_eddy_wale(dim, delta, gradient) : silt_eddy_smagorinsky(delta, room, rate);
            if (law && d < height * h)
                eddy = silt_max(eddy, mixing);
        }
        eddy *= fluid->density;
        const double fresh = silt_apparent_viscosity(fluid, rate) + eddy;
        mu[e] = blend < 1 ? (1 - blend) * mu[e] + blend * fresh : fresh;
        whole += 1 / inverse[e];
        sum += eddy / inverse[e];
        most = silt_max(most, eddy);
        fastest = silt_max(fastest, rate);
    }
    if (report)
        *report = (silt_viscosity_report){whole > 0 ? sum / whole : 0, most, fastest};
}
