// the cloud's density: crowded nodes leave, stretched edges get a node; each change locks its surroundings for the step
#include "pfem.h"

#define REFINE_CROWDED 0.5  // edges shorter than this times h lose a node; on the surface
#define REFINE_SURFACE 0.35 // this: the surface's shape hangs on them
#define REFINE_FLAT 0.25    // a node nearer to a wall than this times h is pressed out
#define REFINE_LONG 1.5     // edges longer than this times h get a node
#define REFINE_FILM 0.25    // cells smaller than this times h^2 are films: they break rather than fill with nodes

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
    SILT_RESERVE(memory->cell, memory->cell_capacity, mesh->n_cell + 1);
    SILT_RESERVE(memory->area, memory->area_capacity, mesh->n_cell + 1);
    memory->n_cell = mesh->n_cell;
    memory->n_taken = 0;
    for (int e = 0; e < mesh->n_cell; e++) {
        memcpy(memory->cell[e], mesh->cell[e], sizeof memory->cell[e]);
        memory->area[e] = silt_cell_volume(mesh, nodes->x, e);
    }
    const int dim = silt_nodes_dim(nodes);
    memory->dim = dim;
    memcpy(memory->period, mesh->period, sizeof memory->period);
    memory->n_place = nodes->count;
    SILT_RESERVE(memory->x, memory->place_capacity, dim * nodes->count + 1);
    memcpy(memory->x, nodes->x, (size_t)(dim * nodes->count) * sizeof *memory->x);
    for (int i = 0; i < nodes->count; i++)
        memory->interior[i] = i < mesh->n_node && mesh->wet[i] && !mesh->surface[i];
}

typedef struct refinement {
    const silt_mesh *mesh;
    silt_nodes *nodes;
    silt_memory *memory;
    uint8_t *locked;
    double h;
} refinement;

static void refine_lock(refinement *r, int i) {
    for (int k = r->mesh->neighbour_start[i]; k < r->mesh->neighbour_start[i + 1]; k++)
        r->locked[r->mesh->neighbour[k]] = 1;
}

// how dear a node is: the dearer of two crowded ones stays
static int refine_rank(const refinement *r, int i) {
    if (r->nodes->kind[i] != NODE_FLUID)
        return 9;
    if (r->nodes->wall[i][1] >= 0)
        return 8; // fills a corner
    return (r->mesh->surface[i] ? 2 : 0) + (r->nodes->wall[i][0] >= 0 ? 1 : 0);
}

static void refine_remove(refinement *r, int i) {
    r->memory->dead[i] = 1;
    refine_lock(r, i);
}

static void refine_crowded(refinement *r) {
    const double *x = r->nodes->x;
    for (int i = 0; i < r->mesh->n_node; i++)
        for (int k = r->mesh->neighbour_start[i]; k < r->mesh->neighbour_start[i + 1]; k++) {
            const int j = r->mesh->neighbour[k];
            if (j <= i || r->locked[i] || r->locked[j])
                continue;
            const double length = hypot(x[2 * j] - x[2 * i], x[2 * j + 1] - x[2 * i + 1]);
            const int ri = refine_rank(r, i), rj = refine_rank(r, j);
            const bool both_surface = r->mesh->surface[i] && r->mesh->surface[j];
            if (length >= (both_surface ? REFINE_SURFACE : REFINE_CROWDED) * r->h)
                continue;
            // the less dear one goes; of equals the younger
            const int goes = ri != rj ? (ri < rj ? i : j) : r->nodes->id[i] > r->nodes->id[j] ? i : j;
            if (refine_rank(r, goes) < 8)
                refine_remove(r, goes);
        }
}

// inner nodes pressed against a wall, the bed or a body
static void refine_flat(refinement *r) {
    const double *x = r->nodes->x;
    for (int k = 0; k < r->mesh->n_facet; k++) {
        if (r->mesh->facet_kind[k] == FACET_FREE || r->mesh->facet_kind[k] == FACET_INLET)
            continue;
        const int a = r->mesh->facet[k][0], b = r->mesh->facet[k][1];
        for (int m = r->mesh->node_cell_start[a]; m < r->mesh->node_cell_start[a + 1]; m++) {
            const int *cell = r->mesh->cell[r->mesh->node_cell[m]];
            int third = -1;
            for (int c = 0; c < 3; c++)
                if (cell[c] == a && cell[(c + 1) % 3] == b)
                    third = cell[(c + 2) % 3];
            if (third < 0 || r->locked[third] || refine_rank(r, third) != 0)
                continue;
            const double length = hypot(x[2 * b] - x[2 * a], x[2 * b + 1] - x[2 * a + 1]);
            if (2 * silt_cell_area(x, cell) < REFINE_FLAT * r->h * length)
                refine_remove(r, third);
        }
    }
}

static bool refine_may_split(const refinement *r, int a, int b, int wall[2]) {
    const silt_nodes *nodes = r->nodes;
    const silt_node_kind ka = nodes->kind[a], kb = nodes->kind[b];
    wall[0] = wall[1] = -1;
    if (ka != NODE_FLUID && kb != NODE_FLUID && ka == kb)
        return false; // bed, body and inlet keep their own nodes
    for (int s = 0; s < 2; s++)
        for (int t = 0; t < 2; t++)
            if (nodes->wall[a][s] >= 0 && nodes->wall[a][s] == nodes->wall[b][t])
                wall[0] = nodes->wall[a][s];
    return true;
}

static void refine_stretched(refinement *r) {
    silt_nodes *nodes = r->nodes;
    for (int e = 0; e < r->mesh->n_cell; e++) {
        const int *cell = r->mesh->cell[e];
        if (r->locked[cell[0]] || r->locked[cell[1]] || r->locked[cell[2]])
            continue;
        int longest = 0;
        double length = 0;
        for (int a = 0; a < 3; a++) {
            const double *p = nodes->x + 2 * cell[a], *q = nodes->x + 2 * cell[(a + 1) % 3];
            const double l = hypot(q[0] - p[0], q[1] - p[1]);
            if (l > length) {
                length = l;
                longest = a;
            }
        }
        const int a = cell[longest], b = cell[(longest + 1) % 3];
        int wall[2];
        if (length < REFINE_LONG * r->h || silt_cell_area(nodes->x, cell) < REFINE_FILM * r->h * r->h ||
            !refine_may_split(r, a, b, wall))
            continue;
        const double middle[2] = {0.5 * (nodes->x[2 * a] + nodes->x[2 * b]), 0.5 * (nodes->x[2 * a + 1] + nodes->x[2 * b + 1])};
        const int i = silt_nodes_add(nodes, NODE_FLUID, -1, middle);
        for (int d = 0; d < 2; d++) {
            nodes->v[2 * i + d] = 0.5 * (nodes->v[2 * a + d] + nodes->v[2 * b + d]);
            nodes->wall[i][d] = wall[d];
        }
        nodes->p[i] = 0.5 * (nodes->p[a] + nodes->p[b]);
        silt_memory_extend(r->memory, nodes->count);
        // inside unless it sits on a boundary edge
        bool boundary = wall[0] >= 0;
        for (int k = 0; k < r->mesh->n_facet && !boundary; k++)
            boundary = r->mesh->facet[k][0] == a && r->mesh->facet[k][1] == b;
        r->memory->interior[i] = !boundary;
        for (int c = 0; c < 3; c++)
            r->locked[cell[c]] = 1;
        for (int k = r->mesh->node_cell_start[a]; k < r->mesh->node_cell_start[a + 1]; k++) {
            const int *other = r->mesh->cell[r->mesh->node_cell[k]];
            if (other[0] == b || other[1] == b || other[2] == b)
                for (int c = 0; c < 3; c++)
                    r->locked[other[c]] = 1;
        }
    }
}

void silt_mesh_refine(const silt_mesh *mesh, silt_nodes *nodes, silt_memory *memory, double h) {
    if (silt_nodes_dim(nodes) == 3)
        return; // the rules above are those of the plane
    refinement r = {.mesh = mesh, .nodes = nodes, .memory = memory, .h = h};
    r.locked = silt_alloc((size_t)mesh->n_node + 1, 1);
    for (int i = 0; i < mesh->n_node; i++)
        r.locked[i] = memory->dead[i];
    refine_crowded(&r);
    refine_flat(&r);
    refine_stretched(&r);
    free(r.locked);
}
