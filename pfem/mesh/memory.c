// the rebuild's memory: what was water before the cloud is edited
#include "delaunay.h"
#include "parallel.h"
#include "remesh.h"

static void *array_rest(void *data, int *capacity) {
    if (!silt_borrowed(data))
        return data;
    silt_return(data);
    *capacity = 0;
    return NULL;
}

void silt_memory_rest(silt_memory *memory) {
    memory->x = array_rest(memory->x, &memory->place_capacity);
    memory->area = array_rest(memory->area, &memory->area_capacity);
    memory->cell = array_rest(memory->cell, &memory->cell_capacity);
}

// room in lent memory if there is such, else room that lasts
static void *array_room(void *data, int *capacity, int need, size_t size) {
    void *lent = data ? NULL : silt_borrow((size_t)need, size);
    if (silt_borrowed(lent)) {
        *capacity = need;
        return lent;
    }
    free(lent);
    return silt_grow(data, capacity, need, size);
}

void silt_memory_clear(silt_memory *memory) {
    free(memory->cell);
    free(memory->area);
    free(memory->taken);
    free(memory->taken_area);
    free(memory->interior);
    free(memory->dead);
    free(memory->x);
    free(memory->group_start);
    free(memory->exchange);
    silt_delaunay_free(&memory->kept);
    *memory = (silt_memory){0};
}

void silt_memory_extend(silt_memory *memory, int n_node) {
    SILT_RESERVE(memory->interior, memory->flag_capacity, n_node + 1);
    SILT_RESERVE(memory->dead, memory->dead_capacity, n_node + 1);
    for (int i = memory->n_node; i < n_node; i++)
        memory->interior[i] = memory->dead[i] = 0;
    memory->n_node = n_node;
}

void silt_memory_take(silt_memory *memory, const silt_mesh *mesh, const silt_nodes *nodes) {
    memory->n_node = 0;
    silt_memory_extend(memory, nodes->count);
    memory->cell = array_room(memory->cell, &memory->cell_capacity, mesh->n_cell + 1, sizeof *memory->cell);
    memory->area = array_room(memory->area, &memory->area_capacity, mesh->n_cell + 1, sizeof *memory->area);
    memory->n_cell = mesh->n_cell;
    memory->n_taken = 0;
    SILT_PARALLEL(mesh->n_cell)
    for (int e = 0; e < mesh->n_cell; e++) {
        memcpy(memory->cell[e], mesh->cell[e], sizeof memory->cell[e]);
        memory->area[e] = silt_cell_volume(mesh, nodes->x, e);
    }
    const int dim = silt_nodes_dim(nodes);
    memory->dim = dim;
    memcpy(memory->period, mesh->period, sizeof memory->period);
    memory->n_place = nodes->count;
    memory->x = array_room(memory->x, &memory->place_capacity, dim * nodes->count + 1, sizeof *memory->x);
    if (nodes->count) // without nodes there may be no array of places
        memcpy(memory->x, nodes->x, (size_t)(dim * nodes->count) * sizeof *memory->x);
    for (int i = 0; i < nodes->count; i++)
        memory->interior[i] = i < mesh->n_node && mesh->wet[i] && !mesh->surface[i];
}
