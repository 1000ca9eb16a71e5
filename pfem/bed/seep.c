// seepage: the pressure in the bed's pores, what goes through its surface, and what that does to its grains

#include "seep.h"

#define SEEP_DRY 1e-3    // share of its mobility that empty ground keeps: lines of no flow would leave its pressure without an equation
#define SEEP_FULL 0.01   // share of a cell's pores by which it must change before the matrix follows
#define SEEP_FIRST 100   // passes until dry surface and full pores are found, at the start
#define SEEP_PASSES 3    // the same in a step
#define SEEP_TINY 1e-9   // of the largest flow into a node: rounding, not a direction

static int seep_dim(const silt_bed *bed) { return bed->dim == 3 ? 3 : 2; }

static void cell_corner(const silt_bed *bed, int c, double *corner) {
    const int D = seep_dim(bed);
    for (int a = 0; a <= D; a++)
        memcpy(corner + D * a, bed->x[bed->cell[c][a]], (size_t)D * sizeof(double));
}

// gradients of a simplex's shape functions. @return its volume
static double shape(int D, const double *x, double g[4][3]) {
    const double volume = silt_simplex_volume(D, x);
    for (int a = 0; a <= D; a++) {
        const double *p = x + D * ((a + 1) % (D + 1)), *q = x + D * ((a + 2) % (D + 1));
        if (D == 2) {
            g[a][0] = (p[1] - q[1]) / (2 * volume);
            g[a][1] = (q[0] - p[0]) / (2 * volume);
            continue;
        }
        // across the face on the other side, towards the corner
        const double *r = x + D * ((a + 3) % (D + 1));
        double u[3], v[3], n[3], up = 0;
        for (int d = 0; d < 3; d++) {
            u[d] = q[d] - p[d];
            v[d] = r[d] - p[d];
        }
        for (int d = 0; d < 3; d++)
            n[d] = u[(d + 1) % 3] * v[(d + 2) % 3] - u[(d + 2) % 3] * v[(d + 1) % 3];
        for (int d = 0; d < 3; d++)
            up += n[d] * (x[3 * a + d] - p[d]);
        for (int d = 0; d < 3; d++)
            g[a][d] = n[d] / up;
    }
    return volume;
}

void silt_seep_clear(silt_seep *seep) {
    double *owned[] = {seep->pressure, seep->lag, seep->gradient, seep->darcy, seep->mobility, seep->value, seep->load,
                       seep->solution, seep->right, seep->into, seep->work, seep->basis};
    for (size_t k = 0; k < sizeof owned / sizeof *owned; k++)
        free(owned[k]);
    free(seep->face);
    free(seep->kind);
    free(seep->water);
    free(seep->foot);
    free(seep->start);
    free(seep->index);
    silt_factor_clear(&seep->factor);
    *seep = (silt_seep){0};
}

// ---------------------------------------------------------------- room

void silt_seep_fit(silt_seep *seep, silt_bed *bed, const silt_nodes *nodes) {
#define ROOM(field, per, capacity, need)                                                                               \
    do {                                                                                                               \
        int have = (capacity) * (per);                                                                                 \
        seep->field = silt_grow(seep->field, &have, (need) * (per), sizeof *seep->field);                              \
    } while (0)
    if (bed->n_node > seep->node_capacity) {
        const int need = bed->n_node + bed->n_node / 4 + 64, have_nodes = seep->node_capacity;
        ROOM(pressure, 1, have_nodes, need);
        ROOM(lag, 1, have_nodes, need);
        ROOM(face, 1, have_nodes, need);
        ROOM(gradient, 1, have_nodes, need);
        ROOM(kind, 1, have_nodes, need);
        ROOM(water, 1, have_nodes, need);
        ROOM(foot, 1, have_nodes, need);
        ROOM(start, 1, have_nodes, need + 1);
        ROOM(load, 1, have_nodes, need);
        ROOM(solution, 1, have_nodes, need);
        ROOM(right, 1, have_nodes, need);
        ROOM(into, 1, have_nodes, need);
        seep->node_capacity = need;
    }
    if (bed->n_cell > seep->cell_capacity) {
        const int need = bed->n_cell + bed->n_cell / 4 + 64, have_cells = seep->cell_capacity;
        ROOM(darcy, seep_dim(bed), have_cells, need);
        ROOM(mobility, 1, have_cells, need);
        seep->cell_capacity = need;
    }
#undef ROOM
    for (int k = seep->n_node; k < bed->n_node; k++) {
        const int i = bed->fluid_node[k];
        // with no pressure known the ground counts as full
        seep->pressure[k] = seep->lag[k] = i >= 0 && i < nodes->count ? silt_max(nodes->p[i], 0) : 0;
        seep->gradient[k] = 0;
        seep->face[k] = 0;
    }
    seep->n_node = bed->n_node;
    seep->n_cell = bed->n_cell;
    bed->pressure = seep->pressure;
    bed->seepage = seep->gradient;
    bed->darcy = seep->darcy;
}

// ---------------------------------------------------------------- the matrix

// rows of the graph of nodes that share a cell, rising
static void rows_make(silt_seep *seep, const silt_bed *bed) {
    const int M = seep_dim(bed) + 1, n = bed->n_node;
    int *first = silt_alloc((size_t)n + 2, sizeof *first), *item = silt_alloc((size_t)(M * bed->n_cell) + 1, sizeof *item);
    for (int c = 0; c < bed->n_cell; c++)
        for (int a = 0; a < M; a++)
            first[bed->cell[c][a] + 2]++;
    for (int k = 0; k < n; k++)
        first[k + 2] += first[k + 1];
    for (int c = 0; c < bed->n_cell; c++)
        for (int a = 0; a < M; a++)
            item[first[bed->cell[c][a] + 1]++] = c;
    int filled = 0, capacity = seep->row_capacity;
    int *list = NULL, list_capacity = 0;
    for (int k = 0; k < n; k++) {
        const int most = M * (first[k + 1] - first[k]) + 1;
        int count = 0;
        SILT_RESERVE(list, list_capacity, most);
        list[count++] = k;
        for (int m = first[k]; m < first[k + 1]; m++)
            for (int a = 0; a < M; a++)
                list[count++] = bed->cell[item[m]][a];
        silt_sort_few(count, list);
        seep->start[k] = filled;
        SILT_RESERVE(seep->index, capacity, filled + count);
        for (int m = 0; m < count; m++)
            if (m == 0 || list[m] != list[m - 1])
                seep->index[filled++] = list[m];
    }
    seep->start[n] = filled;
    seep->value = silt_grow(seep->value, &seep->row_capacity, capacity, sizeof *seep->value);
    seep->row_capacity = capacity;
    free(first);
    free(item);
    free(list);

    int lower = 0;
    for (int k = 0; k < n; k++)
        for (int m = seep->start[k]; m < seep->start[k + 1]; m++)
            lower += seep->index[m] >= k;
    int *start = silt_factor_pattern(&seep->factor, n, lower);
    lower = 0;
    for (int k = 0; k < n; k++) {
        start[k] = lower;
        for (int m = seep->start[k]; m < seep->start[k + 1]; m++)
            if (seep->index[m] >= k)
                seep->factor.index[lower++] = seep->index[m];
    }
    start[n] = lower;
    silt_factor_analyse(&seep->factor);
    seep->revision = bed->revision;
}

static double *entry(const silt_seep *seep, int a, int b) {
    int m = seep->start[a];
    while (seep->index[m] != b)
        m++;
    return &seep->value[m];
}

// how full a cell's pores are: the share of pressure above nought, which is that of its height where pressure is that of rest
static double fullness(const silt_bed *bed, int c, const double *p) {
    double wet = 0, all = 0;
    for (int a = 0; a <= seep_dim(bed); a++) {
        const double own = p[bed->cell[c][a]];
        wet += silt_max(own, 0);
        all += fabs(own);
    }
    return SEEP_DRY + (1 - SEEP_DRY) * (all > 0 ? wet / all : 1);
}

// k/mu of full ground; Kozeny and Carman from the grain and the cell's own pores
static double mobility(const silt_bed *bed, const silt_scene *scene, int c) {
    double k = scene->bed.permeability;
    if (scene->bed.seepage == SEEPAGE_KOZENY_CARMAN) {
        const double solid = silt_clamp(bed->mass[c] / (bed->area[c] * scene->bed.density), 1e-3, 1), open = 1 - solid;
        k = silt_square(scene->grains.diameter) * open * open * open / (180 * solid * solid);
    }
    return k / scene->fluid.viscosity;
}

static void matrix_make(silt_seep *seep, const silt_bed *bed, const silt_scene *scene) {
    const int D = seep_dim(bed);
    memset(seep->value, 0, (size_t)seep->start[bed->n_node] * sizeof(double));
    memset(seep->load, 0, (size_t)bed->n_node * sizeof(double));
    for (int c = 0; c < bed->n_cell; c++) {
        double corner[12], g[4][3];
        cell_corner(bed, c, corner);
        seep->mobility[c] = fullness(bed, c, seep->lag) * mobility(bed, scene, c);
        const double weight = shape(D, corner, g) * seep->mobility[c];
        for (int a = 0; a <= D; a++) {
            seep->load[bed->cell[c][a]] += weight * scene->fluid.density * silt_dot(D, g[a], scene->gravity);
            for (int b = 0; b <= D; b++)
                *entry(seep, bed->cell[c][a], bed->cell[c][b]) += weight * silt_dot(D, g[a], g[b]);
        }
    }
}

// what the water or the air prescribe keeps its row of the factor, with 1 in it: its pattern stays while the bed does
static silt_status matrix_factor(silt_seep *seep, const silt_bed *bed, silt_error *err) {
    int at = 0;
    for (int k = 0; k < bed->n_node; k++)
        for (int m = seep->start[k]; m < seep->start[k + 1]; m++) {
            const int j = seep->index[m];
            if (j < k)
                continue;
            const bool inside = seep->kind[k] == SEEP_INSIDE && seep->kind[j] == SEEP_INSIDE;
            seep->factor.value[at++] = inside ? seep->value[m] : j == k ? 1 : 0;
        }
    if (silt_factor_compute(&seep->factor))
        return SILT_OK;
    const double *x = bed->x[seep->factor.bad];
    return silt_fail(err, SILT_FAILED, "the matrix of the seepage is not positive definite near (%g, %g)", x[0], x[1]);
}

// Fills in solution inside, from what is prescribed in it elsewhere; with the load of gravity, or without
static bool solve_inside(silt_seep *seep, bool loaded) {
    for (int k = 0; k < seep->n_node; k++) {
        if (seep->kind[k] != SEEP_INSIDE) {
            seep->right[k] = seep->solution[k];
            continue;
        }
        double sum = loaded ? seep->load[k] : 0;
        for (int m = seep->start[k]; m < seep->start[k + 1]; m++)
            if (seep->kind[seep->index[m]] != SEEP_INSIDE)
                sum -= seep->value[m] * seep->solution[seep->index[m]];
        seep->right[k] = sum;
    }
    return silt_factor_solve(&seep->factor, seep->right, seep->solution);
}

// what goes into the bed at node k with the pressure in solution, m3/s
static double into_node(const silt_seep *seep, int k, bool loaded) {
    double sum = loaded ? -seep->load[k] : 0;
    for (int m = seep->start[k]; m < seep->start[k + 1]; m++)
        sum += seep->value[m] * seep->solution[seep->index[m]];
    return sum;
}

// ---------------------------------------------------------------- which nodes are what

// Under water: with a node of the water's inside beside it. Drops and films have pressures that mean nothing, or none: what they stand
// on counts as dry.
static bool under_water(const silt_bed *bed, const silt_nodes *nodes, const silt_mesh *mesh, int k) {
    const int i = bed->fluid_node[k];
    if (!bed->alive[k] || !bed->exposed[k] || i < 0 || i >= mesh->n_node || !mesh->wet[i])
        return false;
    for (int m = mesh->neighbour_start[i]; m < mesh->neighbour_start[i + 1]; m++) {
        const int j = mesh->neighbour[m];
        if (!mesh->surface[j] && nodes->kind[j] != NODE_BED && nodes->kind[j] != NODE_BODY)
            return true;
    }
    return false;
}

// A piece of bed that nothing holds the pressure of: its level is that of its lowest node on the surface, or of any
static void hold_pieces(silt_seep *seep, const silt_bed *bed, const double g[3]) {
    const int n = bed->n_node, D = seep_dim(bed);
    int *walk = silt_alloc((size_t)n + 1, sizeof *walk);
    uint8_t *seen = silt_alloc((size_t)n + 1, 1);
    for (int k = 0; k < n; k++) {
        if (seen[k] || seep->kind[k] == SEEP_NONE)
            continue;
        int count = 0, lowest = -1;
        bool held = false;
        walk[count++] = k;
        seen[k] = 1;
        for (int at = 0; at < count; at++) {
            const int i = walk[at];
            held |= seep->kind[i] != SEEP_INSIDE;
            if (lowest < 0 || bed->exposed[i] > bed->exposed[lowest] ||
                (bed->exposed[i] == bed->exposed[lowest] && silt_dot(D, bed->x[i], g) > silt_dot(D, bed->x[lowest], g)))
                lowest = i;
            for (int m = seep->start[i]; m < seep->start[i + 1]; m++)
                if (!seen[seep->index[m]]) {
                    seen[seep->index[m]] = 1;
                    walk[count++] = seep->index[m];
                }
        }
        if (!held)
            seep->kind[lowest] = SEEP_FACE;
    }
    free(walk);
    free(seen);
}

// What comes out on dry surface runs down along it, by the steepest neighbour, to the first water
static int face_foot(const silt_seep *seep, const silt_bed *bed, const double g[3], int k) {
    const int D = seep_dim(bed);
    for (int steps = 0; steps < bed->n_node; steps++) {
        int next = -1;
        double deepest = 0;
        for (int m = seep->start[k]; m < seep->start[k + 1]; m++) {
            const int j = seep->index[m];
            if (j == k || !bed->exposed[j])
                continue;
            double fall = 0, way = 0;
            for (int d = 0; d < D; d++) {
                fall += g[d] * (bed->x[j][d] - bed->x[k][d]);
                way += silt_square(bed->x[j][d] - bed->x[k][d]);
            }
            if (fall / sqrt(way) > deepest) {
                deepest = fall / sqrt(way);
                next = j;
            }
        }
        if (next < 0)
            return -1;
        k = next;
        if (seep->kind[k] == SEEP_WATER)
            return k;
    }
    return -1;
}

// @return whether any node is another kind than before
static bool classify(silt_seep *seep, const silt_bed *bed, const silt_nodes *nodes, const silt_mesh *mesh, const double g[3]) {
    int *before = silt_alloc((size_t)bed->n_node + 1, sizeof *before);
    memcpy(before, seep->kind, (size_t)bed->n_node * sizeof *before);
    seep->n_water = 0;
    for (int k = 0; k < bed->n_node; k++) {
        seep->water[k] = under_water(bed, nodes, mesh, k) ? bed->fluid_node[k] : -1;
        const bool dry = bed->exposed[k] && bed->fluid_node[k] >= 0;
        seep->kind[k] = !bed->alive[k] ? SEEP_NONE : seep->water[k] >= 0 ? SEEP_WATER : dry && seep->face[k] ? SEEP_FACE : SEEP_INSIDE;
        seep->n_water += seep->kind[k] == SEEP_WATER;
    }
    hold_pieces(seep, bed, g);
    const bool changed = memcmp(before, seep->kind, (size_t)bed->n_node * sizeof *before) != 0;
    for (int k = 0; k < bed->n_node; k++)
        seep->foot[k] = seep->kind[k] == SEEP_FACE ? face_foot(seep, bed, g, k) : -1;
    free(before);
    return changed;
}

// Dry surface lets water out, not in: where it would come in the face closes, where the pressure of closed surface rises above the
// air's it opens. And pores empty where the pressure falls below nought. @return whether anything changed
static bool revise(silt_seep *seep, const silt_bed *bed, double share) {
    bool changed = false;
    double most = 0;
    for (int k = 0; k < bed->n_node; k++) {
        seep->into[k] = seep->kind[k] == SEEP_WATER || seep->kind[k] == SEEP_FACE ? into_node(seep, k, true) : 0;
        most = silt_max(most, fabs(seep->into[k]));
    }
    for (int k = 0; k < bed->n_node; k++) {
        if (seep->kind[k] == SEEP_FACE && seep->face[k] && seep->into[k] > SEEP_TINY * most) {
            seep->face[k] = 0;
            changed = true;
        } else if (seep->kind[k] == SEEP_INSIDE && bed->exposed[k] && bed->fluid_node[k] >= 0 && seep->solution[k] > 0) {
            seep->face[k] = 1;
            changed = true;
        } else if (seep->kind[k] == SEEP_WATER)
            seep->face[k] = 1; // when it falls dry what is in the bed comes out
    }
    bool emptied = false;
    for (int c = 0; c < bed->n_cell && !emptied; c++)
        emptied = fabs(fullness(bed, c, seep->solution) - fullness(bed, c, seep->lag)) > SEEP_FULL;
    for (int k = 0; k < bed->n_node && emptied; k++)
        seep->lag[k] += share * (seep->solution[k] - seep->lag[k]);
    return changed || emptied;
}

silt_status silt_seep_prepare(silt_seep *seep, silt_bed *bed, const silt_scene *scene, const silt_nodes *nodes, const silt_mesh *mesh,
                              silt_error *err) {
    const bool first = !seep->begun, fresh = seep->revision != bed->revision || !seep->factor.inside;
    silt_seep_fit(seep, bed, nodes);
    seep->begun = true;
    if (bed->n_cell == 0) {
        seep->n_water = 0;
        return SILT_OK;
    }
    if (fresh)
        rows_make(seep, bed);
    bool stale = fresh;
    for (int pass = 0;; pass++) {
        if (classify(seep, bed, nodes, mesh, scene->gravity) || stale) {
            matrix_make(seep, bed, scene);
            SILT_TRY(matrix_factor(seep, bed, err));
        }
        if (pass == (first ? SEEP_FIRST : SEEP_PASSES))
            return SILT_OK;
        for (int k = 0; k < bed->n_node; k++)
            seep->solution[k] = seep->kind[k] == SEEP_WATER ? nodes->p[seep->water[k]] : 0;
        if (!solve_inside(seep, true))
            return silt_fail(err, SILT_FAILED, "the seepage could not be solved (%d nodes)", bed->n_node);
        stale = revise(seep, bed, pass < 5 ? 1 : 0.5);
        if (!stale)
            return SILT_OK;
    }
}

// ---------------------------------------------------------------- what the water sees

// out += what goes into the bed from the water's nodes, with their pressure in solution; what comes out of a face reaches its foot
static void hand_over(silt_seep *seep, bool loaded, double *out) {
    solve_inside(seep, loaded);
    for (int k = 0; k < seep->n_node; k++) {
        const int to = seep->kind[k] == SEEP_WATER ? k : seep->kind[k] == SEEP_FACE ? seep->foot[k] : -1;
        if (to >= 0)
            out[seep->water[to]] += into_node(seep, k, loaded);
    }
}

void silt_seep_take(silt_seep *seep, const double *p, double *taken) {
    for (int k = 0; k < seep->n_node; k++)
        seep->solution[k] = seep->kind[k] == SEEP_WATER ? p[seep->water[k]] : 0;
    hand_over(seep, true, taken);
}

void silt_seep_apply(silt_seep *seep, const double *x, double *out) {
    for (int k = 0; k < seep->n_node; k++)
        seep->solution[k] = seep->kind[k] == SEEP_WATER ? x[seep->water[k]] : 0;
    hand_over(seep, false, out);
}

// ---------------------------------------------------------------- results

// Darcy's velocity of the cells, and per node the upward force of the seepage on the grains over their weight under water
void silt_seep_results(silt_seep *seep, const silt_bed *bed, const silt_scene *scene) {
    const int D = seep_dim(bed);
    const double rho = scene->fluid.density, size = silt_length(3, scene->gravity);
    double *weight = seep->right;
    memset(seep->gradient, 0, (size_t)bed->n_node * sizeof(double));
    memset(weight, 0, (size_t)bed->n_node * sizeof(double));
    for (int c = 0; c < bed->n_cell; c++) {
        double corner[12], g[4][3], push[3], up = 0;
        cell_corner(bed, c, corner);
        const double volume = shape(D, corner, g), full = fullness(bed, c, seep->lag);
        for (int d = 0; d < D; d++) {
            push[d] = rho * scene->gravity[d];
            for (int a = 0; a <= D; a++)
                push[d] -= g[a][d] * seep->pressure[bed->cell[c][a]];
            seep->darcy[D * c + d] = full * mobility(bed, scene, c) * push[d];
            up -= size > 0 ? push[d] * scene->gravity[d] / size : 0;
        }
        for (int a = 0; a <= D; a++) {
            seep->gradient[bed->cell[c][a]] += full * volume * up;
            weight[bed->cell[c][a]] += bed->mass[c] * (1 - rho / scene->bed.density) * size;
        }
    }
    for (int k = 0; k < bed->n_node; k++)
        seep->gradient[k] = weight[k] > 0 ? seep->gradient[k] / weight[k] : 0;
}

void silt_seep_accept(silt_seep *seep, silt_bed *bed, const silt_scene *scene, const double *p) {
    seep->entered = seep->lost = 0;
    if (bed->n_cell == 0)
        return;
    for (int k = 0; k < seep->n_node; k++)
        seep->solution[k] = seep->kind[k] == SEEP_WATER ? p[seep->water[k]] : 0;
    solve_inside(seep, true);
    for (int k = 0; k < seep->n_node; k++) {
        seep->pressure[k] = seep->solution[k];
        const double into = seep->kind[k] == SEEP_WATER || seep->kind[k] == SEEP_FACE ? into_node(seep, k, true) : 0;
        seep->entered += silt_max(into, 0);
        if (seep->kind[k] == SEEP_FACE && seep->foot[k] < 0)
            seep->lost -= into;
    }
    silt_seep_results(seep, bed, scene);
}

bool silt_seep_pressure_at(const silt_bed *bed, const double *x, double *pressure) {
    const int D = seep_dim(bed);
    if (!bed->pressure)
        return false;
    for (int c = 0; c < bed->n_cell; c++) {
        double corner[12], g[4][3], sum = 0, least = HUGE_VAL;
        cell_corner(bed, c, corner);
        shape(D, corner, g);
        for (int a = 0; a <= D; a++) {
            double weight = 1;
            for (int d = 0; d < D; d++)
                weight += g[a][d] * (x[d] - corner[D * a + d]);
            sum += weight * bed->pressure[bed->cell[c][a]];
            least = silt_min(least, weight);
        }
        if (least < -1e-9)
            continue;
        *pressure = sum;
        return true;
    }
    return false;
}

// ---------------------------------------------------------------- checkpoint

silt_status silt_seep_save(const silt_seep *seep, silt_store *store, silt_error *err) {
    const size_t n = (size_t)seep->n_node;
    const int64_t count[2] = {seep->n_node, seep->begun};
    SILT_TRY(silt_store_put(store, "seep/count", STORE_LONG, 2, count, err));
    if (n == 0)
        return SILT_OK;
    SILT_TRY(silt_store_put(store, "seep/pressure", STORE_DOUBLE, n, seep->pressure, err));
    SILT_TRY(silt_store_put(store, "seep/lag", STORE_DOUBLE, n, seep->lag, err));
    return silt_store_put(store, "seep/face", STORE_BYTE, n, seep->face, err);
}

silt_status silt_seep_load(silt_seep *seep, silt_bed *bed, const silt_nodes *nodes, silt_store *store, silt_error *err) {
    int64_t count[2];
    silt_seep_fit(seep, bed, nodes);
    SILT_TRY(silt_store_take(store, "seep/count", STORE_LONG, 2, count, err));
    if (count[0] != bed->n_node)
        return silt_fail(err, SILT_FAILED, "checkpoint: seep/count is %lld; the bed has %d nodes", (long long)count[0], bed->n_node);
    seep->begun = count[1] != 0;
    const size_t n = (size_t)count[0];
    if (n == 0)
        return SILT_OK;
    SILT_TRY(silt_store_take(store, "seep/pressure", STORE_DOUBLE, n, seep->pressure, err));
    SILT_TRY(silt_store_take(store, "seep/lag", STORE_DOUBLE, n, seep->lag, err));
    return silt_store_take(store, "seep/face", STORE_BYTE, n, seep->face, err);
}
