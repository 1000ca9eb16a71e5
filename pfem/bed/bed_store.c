// the bed in checkpoints

#include "bed_mesh.h"

typedef struct bed_array {
    const char *name;
    silt_store_type type;
    int per, width; // count[per] rows of this many numbers
    void *data;
} bed_array;

enum { PER_NODE, PER_CELL, PER_EDGE, PER_BED, N_ARRAY = 15 };

static void bed_arrays(silt_bed *bed, double sum[5], bed_array array[N_ARRAY]) {
    const bed_array all[N_ARRAY] = {
        {"bed/x", STORE_DOUBLE, PER_NODE, 3, bed->x},
        {"bed/alive", STORE_BYTE, PER_NODE, 1, bed->alive},
        {"bed/exposed", STORE_BYTE, PER_NODE, 1, bed->exposed},
        {"bed/work", STORE_DOUBLE, PER_NODE, 1, bed->work},
        {"bed/eroded", STORE_DOUBLE, PER_NODE, 1, bed->eroded},
        {"bed/shear", STORE_DOUBLE, PER_NODE, 1, bed->shear},
        {"bed/fluid_node", STORE_INT, PER_NODE, 1, bed->fluid_node},
        {"bed/wall", STORE_INT, PER_NODE, 3, bed->wall},
        {"bed/corner", STORE_INT, PER_NODE, 1, bed->corner},
        {"bed/cell", STORE_INT, PER_CELL, 4, bed->cell},
        {"bed/mass", STORE_DOUBLE, PER_CELL, 1, bed->mass},
        {"bed/area", STORE_DOUBLE, PER_CELL, 1, bed->area},
        {"bed/edge", STORE_INT, PER_EDGE, 3, bed->edge},
        {"bed/revision", STORE_LONG, PER_BED, 1, &bed->revision},
        {"bed/sum", STORE_DOUBLE, PER_BED, 5, sum},
    };
    memcpy(array, all, sizeof all);
}

silt_status silt_bed_save(const silt_bed *bed, silt_store *store, silt_error *err) {
    silt_bed borrowed = *bed;
    double sum[5] = {bed->solid_mass, bed->initial_mass, bed->pore_water, bed->pore_rest, bed->n_first};
    bed_array array[N_ARRAY];
    bed_arrays(&borrowed, sum, array);
    const int64_t count[5] = {bed->n_node, bed->n_cell, bed->n_edge, 1, bed_dim(bed)};
    SILT_TRY(silt_store_put(store, "bed/count", STORE_LONG, 5, count, err));
    // a bed that is washed away has no cells: nothing is written for what is empty
    for (int k = 0; k < N_ARRAY; k++) {
        const size_t n = (size_t)count[array[k].per] * (size_t)array[k].width;
        if (n > 0)
            SILT_TRY(silt_store_put(store, array[k].name, array[k].type, n, array[k].data, err));
    }
    return SILT_OK;
}

silt_status silt_bed_load(silt_bed *bed, const silt_walls *walls, silt_store *store, silt_error *err) {
    silt_bed_clear(bed);
    int64_t count[5];
    SILT_TRY(silt_store_take(store, "bed/count", STORE_LONG, 5, count, err));
    for (int k = 0; k < 4; k++)
        if (count[k] < 0 || count[k] > INT32_MAX / 4)
            return silt_fail(err, SILT_FAILED, "checkpoint: bed/count[%d] is %lld; allowed: 0 to %d", k,
                             (long long)count[k], INT32_MAX / 4);
    bed->n_node = (int)count[0];
    bed->n_cell = (int)count[1];
    bed->n_edge = (int)count[2];
    bed->dim = (int)count[4];
    bed->walls = walls;
    silt_bed_reserve_nodes(bed, bed->n_node);
    silt_bed_reserve_cells(bed, bed->n_cell);
    SILT_RESERVE(bed->edge, bed->edge_capacity, bed->n_edge);

    double sum[5] = {0};
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
        for (int a = 0; a <= bed_dim(bed) && !status; a++)
            if (bed->cell[c][a] < 0 || bed->cell[c][a] >= bed->n_node)
                status = silt_fail(err, SILT_FAILED, "checkpoint: bed/cell[%d][%d] is %d; there are %d nodes", c, a,
                                   bed->cell[c][a], bed->n_node);
    for (int e = 0; e < bed->n_edge && !status; e++)
        for (int a = 0; a < bed_dim(bed) && !status; a++)
            if (bed->edge[e][a] < 0 || bed->edge[e][a] >= bed->n_node)
                status = silt_fail(err, SILT_FAILED, "checkpoint: bed/edge[%d][%d] is %d; there are %d nodes", e, a,
                                   bed->edge[e][a], bed->n_node);
    for (int i = 0; i < bed->n_node && !status; i++)
        for (int a = 0; a < 4 && !status; a++) {
            const int element = a < 3 ? bed->wall[i][a] : bed->corner[i], n = walls ? walls->count : 0;
            if (element >= n)
                status = silt_fail(err, SILT_FAILED, "checkpoint: the bed's node %d lies on element %d of %d of the walls", i, element, n);
        }
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
    bed->pore_rest = sum[3];
    bed->n_first = (int)sum[4];
    return SILT_OK;
}
