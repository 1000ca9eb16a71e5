// nodes on openings behind which water stands at a level: where they stay, who joins them, what has passed through
#include "run.h"

#define LEVEL_MEET 0.3 // times h: a node that has come through nearer than this to one on the opening leaves

// back onto the opening along the walls beside it
static void put_back(silt_run *run, const silt_opening *o, int i) {
    silt_nodes *nodes = &run->nodes;
    const int D = silt_nodes_dim(nodes);
    double *x = nodes->x + D * i, way[3];
    const double *side[3];
    silt_level_way(o, silt_level_sides(&run->walls, o, nodes->wall[i], side), side, way);
    const double height = silt_opening_height(o, x) / silt_dot(D, way, o->normal);
    for (int d = 0; d < D; d++)
        x[d] -= height * way[d];
}

// Water that came through the opening k stands on it from now on. Nodes below the surface stay where they were, those on the
// surface slide along the opening.
static void place(silt_run *run, int k) {
    const silt_opening o = silt_opening_of(run->scene, k);
    silt_nodes *nodes = &run->nodes;
    const int D = silt_nodes_dim(nodes);
    for (int i = 0; i < nodes->count; i++) {
        double *x = nodes->x + D * i;
        const double *old = run->x_old + D * i;
        const bool open = nodes->kind[i] == NODE_OPEN && nodes->owner[i] == k;
        if (!run->mesh.wet[i] || (!open && nodes->kind[i] != NODE_FLUID))
            continue;
        if (!open) {
            if (silt_opening_height(&o, x) >= 0 || silt_opening_height(&o, old) < -1e-9 * o.size || silt_opening_depth(&o, x) < 0)
                continue;
            nodes->kind[i] = NODE_OPEN;
            nodes->owner[i] = k;
            put_back(run, &o, i);
        } else if (run->fluid.hold[i] == HOLD_LINE || run->fluid.hold[i] == HOLD_ALL)
            memcpy(x, old, (size_t)D * sizeof *x);
        else {
            put_back(run, &o, i);
            if (silt_opening_depth(&o, x) < 0)
                memcpy(x, old, (size_t)D * sizeof *x);
        }
    }
}

void silt_run_levels(silt_run *run) {
    const double rho = run->scene->fluid.density;
    for (int k = 0; k < silt_opening_count(run->scene); k++) {
        if (!silt_opening_of(run->scene, k).level)
            continue;
        const double before = silt_mesh_volume(&run->mesh, run->nodes.x);
        place(run, k);
        const double passed = silt_mesh_volume(&run->mesh, run->nodes.x) - before;
        if (passed > 0)
            run->ledger.inflow_mass += rho * passed;
        else
            run->ledger.outflow_mass -= rho * passed;
    }
}

void silt_run_levels_thin(silt_run *run) {
    silt_nodes *nodes = &run->nodes;
    const int D = silt_nodes_dim(nodes);
    for (int i = 0; i < nodes->count && silt_levels_any(run->scene); i++) {
        if (nodes->kind[i] != NODE_OPEN)
            continue;
        if (!run->mesh.wet[i]) {
            run->memory.dead[i] = 1;
            continue;
        }
        // only those that came in this step can be too near
        if (memcmp(nodes->x + D * i, run->x_old + D * i, (size_t)D * sizeof(double)) == 0)
            continue;
        const double near = LEVEL_MEET * silt_node_h(nodes, i, run->scene->fluid.size);
        for (int k = run->mesh.neighbour_start[i]; k < run->mesh.neighbour_start[i + 1] && !run->mesh.surface[i]; k++) {
            const int j = run->mesh.neighbour[k];
            double square = 0;
            for (int d = 0; d < D; d++)
                square += silt_square(nodes->x[D * i + d] - nodes->x[D * j + d]);
            if (j != i && nodes->kind[j] == NODE_OPEN && !run->memory.dead[j] && square < near * near)
                run->memory.dead[i] = 1;
        }
    }
}
