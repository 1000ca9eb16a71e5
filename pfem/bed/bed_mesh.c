// the bed's mesh: nodes, cells, the exposed surface, and what finds a cell by node or by place

#include "bed_mesh.h"

// ---------------------------------------------------------------- walls

bool silt_bed_on_wall(const silt_scene *scene, const double p[2], const double q[2]) {
    const double close = 1e-6 * bed_size(scene);
    for (int w = 0; w < scene->n_wall; w++)
        for (int k = 0; k < bed_wall_pieces(&scene->wall[w]); k++) {
            const double *from = bed_wall_point(&scene->wall[w], k), *to = bed_wall_point(&scene->wall[w], k + 1);
            if (bed_segment_distance(from, to, p) <= close && bed_segment_distance(from, to, q) <= close)
                return true;
        }
    return false;
}

// ---------------------------------------------------------------- index: cells of a node, cells at a place

static int index_bin(const silt_bed_index *index, const double x[2]) {
    // what lies outside the grid belongs to its rim: two points closer than a bin stay in the same or in adjoining bins
    const double i = silt_clamp(floor((x[0] - index->lo[0]) / index->bin), 0, index->nx - 1);
    const double j = silt_clamp(floor((x[1] - index->lo[1]) / index->bin), 0, index->ny - 1);
    return (int)j * index->nx + (int)i;
}

static void cell_centroid(const silt_bed *bed, int cell, double centre[2]) {
    const int *node = bed->cell[cell];
    for (int d = 0; d < 2; d++)
        centre[d] = (bed->x[node[0]][d] + bed->x[node[1]][d] + bed->x[node[2]][d]) / 3;
}

static double cell_reach(const silt_bed *bed, int cell) {
    double centre[2], reach = 0;
    cell_centroid(bed, cell, centre);
    for (int a = 0; a < 3; a++)
        reach = silt_max(reach, bed_distance(centre, bed->x[bed->cell[cell][a]]));
    return reach;
}

static void index_link(silt_bed *bed, int cell) {
    silt_bed_index *index = bed->index;
    for (int a = 0; a < 3; a++) {
        const int node = bed->cell[cell][a];
        index->next[3 * cell + a] = index->first[node];
        index->first[node] = 3 * cell + a;
    }
    double centre[2];
    cell_centroid(bed, cell, centre);
    int *head = &index->head[index_bin(index, centre)];
    index->before[cell] = -1;
    index->after[cell] = *head;
    if (*head >= 0)
        index->before[*head] = cell;
    *head = cell;
}

static void index_unlink(silt_bed *bed, int cell) {
    silt_bed_index *index = bed->index;
    for (int a = 0; a < 3; a++) {
        int *place = &index->first[bed->cell[cell][a]];
        while (*place != 3 * cell + a)
            place = &index->next[*place];
        *place = index->next[3 * cell + a];
    }
    double centre[2];
    cell_centroid(bed, cell, centre);
    const int before = index->before[cell], after = index->after[cell];
    if (before >= 0)
        index->after[before] = after;
    else
        index->head[index_bin(index, centre)] = after;
    if (after >= 0)
        index->before[after] = before;
}

static void index_reserve_nodes(silt_bed *bed, int need) {
    silt_bed_index *index = bed->index;
    int capacity = index->node_capacity;
    for (int pass = 0; pass < 3; pass++) {
        capacity = index->node_capacity;
        if (pass == 0)
            SILT_RESERVE(index->first, capacity, need);
        else if (pass == 1)
            SILT_RESERVE(index->outward, capacity, need);
        else
            SILT_RESERVE(index->length, capacity, need);
    }
    index->node_capacity = capacity;
}

static void index_reserve_cells(silt_bed *bed, int need) {
    silt_bed_index *index = bed->index;
    int capacity = index->cell_capacity;
    SILT_RESERVE(index->after, capacity, need);
    capacity = index->cell_capacity;
    SILT_RESERVE(index->before, capacity, need);
    int places = 3 * index->cell_capacity;
    SILT_RESERVE(index->next, places, 3 * capacity);
    index->cell_capacity = capacity;
}

static void index_free(silt_bed_index *index) {
    if (!index)
        return;
    free(index->first);
    free(index->next);
    free(index->outward);
    free(index->length);
    free(index->head);
    free(index->after);
    free(index->before);
    free(index);
}

void silt_bed_index_build(silt_bed *bed) {
    index_free(bed->index);
    silt_bed_index *index = bed->index = silt_alloc(1, sizeof *index);
    index_reserve_nodes(bed, bed->n_node);
    index_reserve_cells(bed, bed->n_cell);

    // the grid's box is that of the nodes; deposits may lie outside it
    double hi[2] = {0, 0}, reach = 0;
    for (int i = 0; i < bed->n_node; i++)
        for (int d = 0; d < 2; d++) {
            index->lo[d] = i ? silt_min(index->lo[d], bed->x[i][d]) : bed->x[i][d];
            hi[d] = i ? silt_max(hi[d], bed->x[i][d]) : bed->x[i][d];
        }
    for (int c = 0; c < bed->n_cell; c++)
        reach = silt_max(reach, cell_reach(bed, c));
    const double wide = hi[0] - index->lo[0], high = hi[1] - index->lo[1];
    index->bin = silt_max(1.3 * reach, 1e-3 * silt_max(wide, high));
    if (!(index->bin > 0))
        index->bin = 1;
    index->nx = (int)(wide / index->bin) + 1;
    index->ny = (int)(high / index->bin) + 1;
    SILT_RESERVE(index->head, index->bin_capacity, index->nx * index->ny);
    for (int b = 0; b < index->nx * index->ny; b++)
        index->head[b] = -1;
    for (int i = 0; i < bed->n_node; i++)
        index->first[i] = -1;
    for (int c = 0; c < bed->n_cell; c++)
        index_link(bed, c);
}

// ---------------------------------------------------------------- nodes, cells, edges

static void node_reserve(silt_bed *bed, int need) {
    int capacity = bed->node_capacity;
    // all arrays have one capacity; each call starts from the old one
#define RESERVE(array) (capacity = bed->node_capacity, SILT_RESERVE(bed->array, capacity, need))
    RESERVE(x);
    RESERVE(alive);
    RESERVE(exposed);
    RESERVE(work);
    RESERVE(eroded);
    RESERVE(shear);
    RESERVE(fluid_node);
#undef RESERVE
    bed->node_capacity = capacity;
}

static void cell_reserve(silt_bed *bed, int need) {
    int capacity = bed->cell_capacity;
    SILT_RESERVE(bed->cell, capacity, need);
    capacity = bed->cell_capacity;
    SILT_RESERVE(bed->mass, capacity, need);
    capacity = bed->cell_capacity;
    SILT_RESERVE(bed->area, capacity, need);
    bed->cell_capacity = capacity;
}

int silt_bed_node_add(silt_bed *bed, const double x[2]) {
    const int node = bed->n_node;
    node_reserve(bed, node + 1);
    index_reserve_nodes(bed, node + 1);
    bed->n_node++;
    bed->x[node][0] = x[0];
    bed->x[node][1] = x[1];
    bed->alive[node] = bed->exposed[node] = 0;
    bed->work[node] = bed->eroded[node] = bed->shear[node] = 0;
    bed->fluid_node[node] = -1;
    bed->index->first[node] = -1;
    bed->index->length[node] = bed->index->outward[node][0] = bed->index->outward[node][1] = 0;
    return node;
}

int silt_bed_cell_add(silt_bed *bed, int a, int b, int c, double mass) {
    const int cell = bed->n_cell;
    cell_reserve(bed, cell + 1);
    index_reserve_cells(bed, cell + 1);
    bed->n_cell++;
    memcpy(bed->cell[cell], (int[3]){a, b, c}, sizeof bed->cell[cell]);
    bed->area[cell] = 0.5 * bed_cross(bed->x[a], bed->x[b], bed->x[c]);
    bed->mass[cell] = mass;
    index_link(bed, cell);
    // a cell that is wider than the bins would not be found
    if (cell_reach(bed, cell) > bed->index->bin)
        silt_bed_index_build(bed);
    bed->alive[a] = bed->alive[b] = bed->alive[c] = 1;
    return cell;
}

void silt_bed_cell_remove(silt_bed *bed, int cell) {
    const int last = bed->n_cell - 1;
    index_unlink(bed, cell);
    for (int a = 0; a < 3; a++) {
        const int node = bed->cell[cell][a];
        bed->alive[node] = bed->index->first[node] >= 0;
    }
    if (cell != last) {
        index_unlink(bed, last);
        memcpy(bed->cell[cell], bed->cell[last], sizeof bed->cell[cell]);
        bed->mass[cell] = bed->mass[last];
        bed->area[cell] = bed->area[last];
        index_link(bed, cell);
    }
    bed->n_cell = last;
}

int silt_bed_cell_at(const silt_bed *bed, int a, int b) {
    for (int place = bed->index->first[a]; place >= 0; place = bed->index->next[place])
        if (bed->cell[place / 3][(place % 3 + 1) % 3] == b)
            return place / 3;
    return -1;
}

void silt_bed_edge_add(silt_bed *bed, const silt_scene *scene, int a, int b) {
    if (silt_bed_on_wall(scene, bed->x[a], bed->x[b]))
        return;
    SILT_RESERVE(bed->edge, bed->edge_capacity, bed->n_edge + 1);
    bed->edge[bed->n_edge][0] = a;
    bed->edge[bed->n_edge][1] = b;
    bed->n_edge++;
}

void silt_bed_edge_remove(silt_bed *bed, int a, int b) {
    // the order of the others stays, so that sums over a node's edges keep their bits
    for (int e = 0; e < bed->n_edge; e++)
        if (bed->edge[e][0] == a && bed->edge[e][1] == b) {
            bed->n_edge--;
            memmove(bed->edge[e], bed->edge[e + 1], (size_t)(bed->n_edge - e) * sizeof *bed->edge);
            return;
        }
}

void silt_bed_refresh(silt_bed *bed) {
    silt_bed_index *index = bed->index;
    for (int i = 0; i < bed->n_node; i++)
        index->length[i] = index->outward[i][0] = index->outward[i][1] = 0;
    for (int e = 0; e < bed->n_edge; e++) {
        const double *p = bed->x[bed->edge[e][0]], *q = bed->x[bed->edge[e][1]];
        for (int end = 0; end < 2; end++) {
            const int node = bed->edge[e][end];
            index->outward[node][0] -= 0.5 * (q[1] - p[1]);
            index->outward[node][1] += 0.5 * (q[0] - p[0]);
            index->length[node] += 0.5 * bed_distance(p, q);
        }
    }
    for (int i = 0; i < bed->n_node; i++)
        bed->exposed[i] = index->length[i] > 0;

    // Neumaier's sum: the sediment's ledger closes to the last bits
    double sum = 0, lost = 0;
    for (int c = 0; c < bed->n_cell; c++) {
        const double m = bed->mass[c], t = sum + m;
        lost += fabs(sum) >= fabs(m) ? (sum - t) + m : (m - t) + sum;
        sum = t;
    }
    bed->solid_mass = sum + lost;
    bed->revision++;
}

void silt_bed_clear(silt_bed *bed) {
    free(bed->x);
    free(bed->alive);
    free(bed->exposed);
    free(bed->work);
    free(bed->eroded);
    free(bed->shear);
    free(bed->fluid_node);
    free(bed->cell);
    free(bed->mass);
    free(bed->area);
    free(bed->edge);
    index_free(bed->index);
    *bed = (silt_bed){0};
}

// ---------------------------------------------------------------- questions

void silt_bed_normal(const silt_bed *bed, int node, double normal[2]) {
    const double *outward = bed->index->outward[node];
    const double length = hypot(outward[0], outward[1]);
    if (length > 1e-9 * bed->index->length[node]) {
        normal[0] = outward[0] / length;
        normal[1] = outward[1] / length;
        return;
    }
    // the edges cancel (a spike, or a node between two patches): the normal of one of them
    normal[0] = 0;
    normal[1] = 1;
    for (int e = 0; e < bed->n_edge; e++)
        if (bed->edge[e][0] == node || bed->edge[e][1] == node) {
            const double *p = bed->x[bed->edge[e][0]], *q = bed->x[bed->edge[e][1]];
            normal[0] = -(q[1] - p[1]) / bed_distance(p, q);
            normal[1] = (q[0] - p[0]) / bed_distance(p, q);
            return;
        }
}

static bool cell_holds(const silt_bed *bed, int cell, const double x[2]) {
    const double *p = bed->x[bed->cell[cell][0]], *q = bed->x[bed->cell[cell][1]], *r = bed->x[bed->cell[cell][2]];
    return bed_cross(p, q, x) >= 0 && bed_cross(q, r, x) >= 0 && bed_cross(r, p, x) >= 0;
}

bool silt_bed_contains(const silt_bed *bed, const double x[2]) {
    const silt_bed_index *index = bed->index;
    if (!index || bed->n_cell == 0)
        return false;
    const int bin = index_bin(index, x), i = bin % index->nx, j = bin / index->nx;
    for (int v = j > 0 ? j - 1 : 0; v <= j + 1 && v < index->ny; v++)
        for (int u = i > 0 ? i - 1 : 0; u <= i + 1 && u < index->nx; u++)
            for (int cell = index->head[v * index->nx + u]; cell >= 0; cell = index->after[cell])
                if (cell_holds(bed, cell, x))
                    return true;
    return false;
}

double silt_bed_level(const silt_bed *bed, double x) {
    double level = -HUGE_VAL;
    for (int e = 0; e < bed->n_edge; e++) {
        const double *p = bed->x[bed->edge[e][0]], *q = bed->x[bed->edge[e][1]];
        const double reach = fabs(q[0] - p[0]);
        if (x < silt_min(p[0], q[0]) || x > silt_max(p[0], q[0]))
            continue;
        level = silt_max(level, reach > 0 ? p[1] + (x - p[0]) / (q[0] - p[0]) * (q[1] - p[1]) : silt_max(p[1], q[1]));
    }
    return level;
}

// ---------------------------------------------------------------- checkpoint

typedef struct bed_array {
    const char *name;
    silt_store_type type;
    int per, width; // count[per] rows of this many numbers
    void *data;
} bed_array;

enum { PER_NODE, PER_CELL, PER_EDGE, PER_BED, N_ARRAY = 13 };

static void bed_arrays(silt_bed *bed, double sum[3], bed_array array[N_ARRAY]) {
    const bed_array all[N_ARRAY] = {
        {"bed/x", STORE_DOUBLE, PER_NODE, 2, bed->x},
        {"bed/alive", STORE_BYTE, PER_NODE, 1, bed->alive},
        {"bed/exposed", STORE_BYTE, PER_NODE, 1, bed->exposed},
        {"bed/work", STORE_DOUBLE, PER_NODE, 1, bed->work},
        {"bed/eroded", STORE_DOUBLE, PER_NODE, 1, bed->eroded},
        {"bed/shear", STORE_DOUBLE, PER_NODE, 1, bed->shear},
        {"bed/fluid_node", STORE_INT, PER_NODE, 1, bed->fluid_node},
        {"bed/cell", STORE_INT, PER_CELL, 3, bed->cell},
        {"bed/mass", STORE_DOUBLE, PER_CELL, 1, bed->mass},
        {"bed/area", STORE_DOUBLE, PER_CELL, 1, bed->area},
        {"bed/edge", STORE_INT, PER_EDGE, 2, bed->edge},
        {"bed/revision", STORE_LONG, PER_BED, 1, &bed->revision},
        {"bed/sum", STORE_DOUBLE, PER_BED, 3, sum},
    };
    memcpy(array, all, sizeof all);
}

silt_status silt_bed_save(const silt_bed *bed, silt_store *store, silt_error *err) {
    silt_bed borrowed = *bed;
    double sum[3] = {bed->solid_mass, bed->initial_mass, bed->pore_water};
    bed_array array[N_ARRAY];
    bed_arrays(&borrowed, sum, array);
    const int64_t count[4] = {bed->n_node, bed->n_cell, bed->n_edge, 1};
    SILT_TRY(silt_store_put(store, "bed/count", STORE_LONG, 4, count, err));
    // a bed that is washed away has no cells: nothing is written for what is empty
    for (int k = 0; k < N_ARRAY; k++) {
        const size_t n = (size_t)count[array[k].per] * (size_t)array[k].width;
        if (n > 0)
            SILT_TRY(silt_store_put(store, array[k].name, array[k].type, n, array[k].data, err));
    }
    return SILT_OK;
}

silt_status silt_bed_load(silt_bed *bed, silt_store *store, silt_error *err) {
    silt_bed_clear(bed);
    int64_t count[4];
    SILT_TRY(silt_store_take(store, "bed/count", STORE_LONG, 4, count, err));
    for (int k = 0; k < 4; k++)
        if (count[k] < 0 || count[k] > INT32_MAX / 4)
            return silt_fail(err, SILT_FAILED, "checkpoint: bed/count[%d] is %lld; allowed: 0 to %d", k,
                             (long long)count[k], INT32_MAX / 4);
    bed->n_node = (int)count[0];
    bed->n_cell = (int)count[1];
    bed->n_edge = (int)count[2];
    node_reserve(bed, bed->n_node);
    cell_reserve(bed, bed->n_cell);
    SILT_RESERVE(bed->edge, bed->edge_capacity, bed->n_edge);

    double sum[3] = {0};
    bed_array array[N_ARRAY];
    bed_arrays(bed, sum, array);
    silt_status status = SILT_OK;
    for (int k = 0; k < N_ARRAY && !status; k++) {
        const size_t n = (size_t)count[array[k].per] * (size_t)array[k].width;
        if (n > 0)
            status = silt_store_take(store, array[k].name, array[k].type, n, array[k].data, err);
    }
    // numbers from a file are looked at before they are used as indices
    for (int c = 0; c < bed->n_cell && !status; c++)
        for (int a = 0; a < 3 && !status; a++)
            if (bed->cell[c][a] < 0 || bed->cell[c][a] >= bed->n_node)
                status = silt_fail(err, SILT_FAILED, "checkpoint: bed/cell[%d][%d] is %d; there are %d nodes", c, a,
                                   bed->cell[c][a], bed->n_node);
    for (int e = 0; e < bed->n_edge && !status; e++)
        for (int a = 0; a < 2 && !status; a++)
            if (bed->edge[e][a] < 0 || bed->edge[e][a] >= bed->n_node)
                status = silt_fail(err, SILT_FAILED, "checkpoint: bed/edge[%d][%d] is %d; there are %d nodes", e, a,
                                   bed->edge[e][a], bed->n_node);
    if (status) {
        silt_bed_clear(bed);
        return status;
    }
    const int64_t revision = bed->revision;
    silt_bed_index_build(bed);
    silt_bed_refresh(bed);
    bed->revision = revision;
    bed->solid_mass = sum[0];
    bed->initial_mass = sum[1];
    bed->pore_water = sum[2];
    return SILT_OK;
}
