// nodes to their new places: water with its velocity, drops in free flight, inlets back to their line, bodies with theirs
#include "run.h"

static bool slip_on_bodies(const silt_scene *scene) {
    bool any = false;
    for (int b = 0; b < scene->n_body; b++)
        any |= silt_body_slips(&scene->body[b]);
    return any;
}

void silt_run_prescribe(silt_run *run) {
    const silt_scene *scene = run->scene;
    silt_nodes *nodes = &run->nodes;
    const int D = silt_nodes_dim(nodes);
    const silt_body_state *bodies = run->coupling ? silt_coupling_dem.bodies(run->coupling) : NULL;
    if (bodies && slip_on_bodies(scene)) {
        SILT_RESERVE(run->body_start, run->body_start_capacity, D * nodes->count + 1);
        memset(run->body_start, 0, (size_t)(D * nodes->count) * sizeof(double));
    }
    for (int i = 0; i < nodes->count; i++) {
        double *v = nodes->v + D * i;
        if (nodes->kind[i] == NODE_INLET) {
            const silt_inlet *inlet = &scene->fluid.inlet[nodes->owner[i]];
            const double factor = inlet->series.n_row ? silt_series_at(&inlet->series, 1, run->time + 0.5 * run->dt) : 1;
            for (int d = 0; d < D; d++)
                v[d] = factor * inlet->velocity[d];
        } else if (nodes->kind[i] == NODE_BODY && bodies) {
            const struct silt_body *body = &bodies->body[nodes->owner[i]];
            if (silt_body_slips(&scene->body[nodes->owner[i]])) {
                double *own = run->body_start + D * i;
                silt_run_body_velocity(body, nodes->x + D * i, D, own);
                if (i < run->mesh.n_node && run->mesh.wet[i]) // it has a velocity of its own along the surface
                    continue;
            }
            silt_run_body_velocity(body, nodes->x + D * i, D, v);
        } else if (nodes->kind[i] == NODE_CORNER) {
            double wall[3] = {0};
            if (nodes->owner[i] >= 0)
                silt_walls_velocity(&run->walls, scene, nodes->owner[i], nodes->x + D * i, wall);
            memcpy(v, wall, (size_t)D * sizeof(double));
        }
    }
}

void silt_run_acceleration(const silt_run *run, const double *x, double a[3]) {
    const int D = silt_nodes_dim(&run->nodes);
    memcpy(a, run->scene->gravity, 3 * sizeof *a);
    if (run->scene->fluid.force.kind == FORMULA_NONE)
        return;
    double place[3] = {0}, more[3];
    memcpy(place, x, (size_t)D * sizeof(double));
    silt_formula_acceleration(&run->scene->fluid.force, run->time + 0.5 * run->dt, place, more);
    for (int d = 0; d < 3; d++)
        a[d] += more[d];
}

// drops: free flight, along walls where they lie on one
static void fly(silt_run *run, int i) {
    silt_nodes *nodes = &run->nodes;
    const int D = silt_nodes_dim(nodes);
    double *x = nodes->x + D * i, *v = nodes->v + D * i, a[3];
    const double dt = run->dt;
    silt_run_acceleration(run, x, a);
    // of the walls that it touches those press on it that it would come nearer to, left alone, than they go away; from a lid
    // it falls, along the wall beside it
    int kept = 0, wall[3] = {-1, -1, -1};
    for (int k = 0; k < 3 && nodes->wall[i][k] >= 0; k++) {
        double own[3];
        silt_walls_velocity(&run->walls, run->scene, nodes->wall[i][k], x, own);
        const double *n = run->walls.normal[nodes->wall[i][k]];
        if (silt_dot(D, v, n) - silt_dot(D, own, n) + 0.5 * dt * silt_dot(D, a, n) <= 0)
            wall[kept++] = nodes->wall[i][k];
    }
    memcpy(nodes->wall[i], wall, sizeof wall);
    if (kept) {
        double vector[3], given[3];
        silt_walls_given(&run->walls, run->scene, nodes->wall[i], x, given);
        const silt_hold hold = silt_walls_hold(&run->walls, nodes->wall[i], vector);
        if (hold == HOLD_ALL) { // stuck, or in a corner
            for (int d = 0; d < D; d++) {
                v[d] = given[d];
                x[d] += dt * v[d];
            }
            return;
        }
        const double along = silt_dot(D, a, vector), speed = silt_dot(D, v, vector);
        for (int d = 0; d < D; d++) {
            a[d] = hold == HOLD_NORMAL ? a[d] - along * vector[d] : along * vector[d];
            v[d] = (hold == HOLD_NORMAL ? v[d] - speed * vector[d] : speed * vector[d]) + given[d];
        }
    }
    for (int d = 0; d < D; d++) {
        x[d] += dt * (v[d] + 0.5 * dt * a[d]);
        v[d] += dt * a[d];
    }
}

// surface nodes that a wall would have to pull on let go
static void let_go(silt_run *run) {
    silt_nodes *nodes = &run->nodes;
    const silt_fluid *fluid = &run->fluid;
    const int D = silt_nodes_dim(nodes);
    for (int i = 0; i < fluid->n_node; i++) {
        if (nodes->kind[i] != NODE_FLUID || nodes->wall[i][0] < 0 || !run->mesh.wet[i] || !run->mesh.surface[i])
            continue;
        // every wall that pulls
        int kept = 0, wall[3] = {-1, -1, -1};
        double a[3];
        silt_run_acceleration(run, nodes->x + D * i, a);
        const double weight = fluid->mass[i] * silt_length(D, a);
        for (int k = 0; k < 3 && nodes->wall[i][k] >= 0; k++) {
            const double pull = -silt_dot(D, fluid->reaction + D * i, run->walls.normal[nodes->wall[i][k]]);
            if (!(pull > 0.05 * weight && pull > 0))
                wall[kept++] = nodes->wall[i][k];
        }
        memcpy(nodes->wall[i], wall, sizeof wall);
    }
}

// bodies where the discrete elements have put them
static void place_bodies(silt_run *run) {
    if (!run->n_body_before)
        return;
    const silt_body_state *bodies = silt_coupling_dem.bodies(run->coupling);
    silt_nodes *nodes = &run->nodes;
    const int D = silt_nodes_dim(nodes);
    for (int i = 0; i < nodes->count; i++) {
        if (nodes->kind[i] != NODE_BODY)
            continue;
        const struct silt_body *now = &bodies->body[nodes->owner[i]];
        double place[3];
        silt_run_body_turn(&run->body_before[nodes->owner[i]], now, run->x_old + D * i, D, place);
        memcpy(nodes->x + D * i, place, (size_t)D * sizeof(double));
        double own[3];
        silt_run_body_velocity(now, place, D, own);
        if (silt_body_slips(&run->scene->body[nodes->owner[i]]) && run->mesh.wet[i])
            silt_hold_replace(&run->fluid, i, own, nodes->v + D * i);
        else
            memcpy(nodes->v + D * i, own, (size_t)D * sizeof(double));
    }
}

// water that crossed an outlet, or left the box of the scene; nodes of bodies, which are out of the water beyond an outlet
static void let_out(silt_run *run) {
    silt_nodes *nodes = &run->nodes;
    const int D = silt_nodes_dim(nodes);
    for (int i = 0; i < nodes->count; i++) {
        if ((nodes->kind[i] != NODE_FLUID && nodes->kind[i] != NODE_BODY) || run->memory.dead[i])
            continue;
        const double *x = nodes->x + D * i, *old = run->x_old + D * i;
        bool gone = false;
        for (int d = 0; d < D; d++)
            gone |= (run->mesh.period[d] <= 0 && (x[d] < run->box_lo[d] || x[d] > run->box_hi[d])) || !isfinite(x[d]);
        for (int k = run->scene->fluid.n_inlet; k < silt_opening_count(run->scene) && !gone; k++) {
            const silt_opening outlet = silt_opening_of(run->scene, k);
            gone = silt_opening_height(&outlet, x) < 0 && silt_opening_height(&outlet, old) >= -1e-12 * outlet.size &&
                   silt_opening_depth(&outlet, x) > -0.05 * outlet.size;
        }
        if (gone)
            run->memory.dead[i] = NODE_LEFT;
    }
}

// water nodes that ended up in something solid: flying ones are put outside, wet ones leave their volume to their cells
static void expel(silt_run *run) {
    silt_nodes *nodes = &run->nodes;
    const int D = silt_nodes_dim(nodes);
    if (!run->barrier.bed && !run->barrier.bodies)
        return;
    const silt_barrier solid = {.bed = run->barrier.bed, .bodies = run->barrier.bodies};
    for (int i = 0; i < nodes->count; i++) {
        if (nodes->kind[i] != NODE_FLUID || run->memory.dead[i] || !silt_barrier_contains(&solid, nodes->x + D * i))
            continue;
        const bool wet = i < run->mesh.n_node && run->mesh.wet[i];
        // a flying one goes back where it came from, at rest; inside there too, or wet: its volume goes to the water around it
        const double *old = run->x_old + D * i;
        if (wet || silt_barrier_contains(&solid, old)) {
            run->memory.dead[i] = 1;
            continue;
        }
        for (int d = 0; d < D; d++) {
            nodes->x[D * i + d] = old[d];
            nodes->v[D * i + d] = 0;
        }
    }
}

// of water along the surface that it slips on
static void slip_velocity(const silt_fluid *fluid, int i, double w[3]) {
    for (int d = 0; d < fluid->dim; d++)
        w[d] = fluid->w[fluid->dim * i + d] - (fluid->ride ? fluid->ride[fluid->dim * i + d] : 0);
}

// Along the facet's edge: the water that stands at an end came from the other one. Adds to fresh.
static void carry_edge(const silt_run *run, const int *facet, double *fresh) {
    const silt_fluid *fluid = &run->fluid;
    const double *v = run->nodes.v;
    for (int c = 0; c < 2; c++) {
        const int i = facet[c], up = facet[1 - c];
        if (fluid->hold[i] != HOLD_NORMAL)
            continue;
        const double dx = run->x_old[2 * i] - run->x_old[2 * up], dy = run->x_old[2 * i + 1] - run->x_old[2 * up + 1];
        double w[3];
        slip_velocity(fluid, i, w);
        const double share = run->dt * (w[0] * dx + w[1] * dy) / (dx * dx + dy * dy);
        for (int d = 0; d < 2 && share > 0; d++)
            fresh[2 * i + d] += silt_min(share, 1) * (v[2 * up + d] - v[2 * i + d]);
    }
}

// In space: where the water that stands at a corner was lies in the face, or it does not. Writes fresh.
static void carry_face(const silt_run *run, const int *facet, double *fresh) {
    const silt_fluid *fluid = &run->fluid;
    const double *v = run->nodes.v;
    for (int c = 0; c < 3; c++) {
        const int i = facet[c], j = facet[(c + 1) % 3], k = facet[(c + 2) % 3];
        if (fluid->hold[i] == HOLD_ALL)
            continue;
        double p[3], q[3], w[3];
        slip_velocity(fluid, i, w);
        for (int d = 0; d < 3; d++) {
            p[d] = silt_shortest(&run->mesh, d, run->x_old[3 * j + d] - run->x_old[3 * i + d]);
            q[d] = silt_shortest(&run->mesh, d, run->x_old[3 * k + d] - run->x_old[3 * i + d]);
        }
        // - w dt = a p + b q
        const double pp = silt_dot(3, p, p), qq = silt_dot(3, q, q), pq = silt_dot(3, p, q);
        const double wp = -run->dt * silt_dot(3, w, p), wq = -run->dt * silt_dot(3, w, q), under = pp * qq - pq * pq;
        double a = (qq * wp - pq * wq) / under, b = (pp * wq - pq * wp) / under;
        if (!(a >= -1e-9 && b >= -1e-9))
            continue;
        const double most = silt_max(a + b, 1);
        a = silt_max(a, 0) / most;
        b = silt_max(b, 0) / most;
        for (int d = 0; d < 3; d++)
            fresh[3 * i + d] = v[3 * i + d] + a * (v[3 * j + d] - v[3 * i + d]) + b * (v[3 * k + d] - v[3 * i + d]);
    }
}

// slip on the nodes of bed and bodies: the water that stands there now came from upstream along the surface
static void carry_slip(silt_run *run) {
    const bool bed = run->scene->bed.on && run->scene->bed.condition != WALL_NO_SLIP, bodies = slip_on_bodies(run->scene);
    if (!bed && !bodies)
        return;
    const silt_mesh *mesh = &run->mesh;
    const silt_fluid *fluid = &run->fluid;
    silt_nodes *nodes = &run->nodes;
    const int D = silt_nodes_dim(nodes);
    double *fresh = run->fluid.scratch;
    memcpy(fresh, nodes->v, (size_t)(D * fluid->n_node) * sizeof(double));
    for (int k = 0; k < mesh->n_facet; k++)
        if ((bed && mesh->facet_kind[k] == FACET_BED) || (bodies && mesh->facet_kind[k] == FACET_BODY))
            (D == 3 ? carry_face : carry_edge)(run, mesh->facet[k], fresh);
    for (int i = 0; i < fluid->n_node; i++) {
        if (!fluid->still[i] || (fluid->hold[i] != HOLD_NORMAL && fluid->hold[i] != HOLD_LINE))
            continue;
        const double *n = fluid->normal + D * i, along = silt_dot(D, fresh + D * i, n);
        for (int d = 0; d < D; d++)
            nodes->v[D * i + d] = fluid->hold[i] == HOLD_LINE ? along * n[d] : fresh[D * i + d] - along * n[d];
    }
}

// A node that lands on a wall without slip stops at once, which no wall could do to it: the momentum along the wall stays in
// the water around it, and the wall brakes through viscosity only. `before` holds walls and velocities before contact.
static void hand_on_landing(silt_run *run, const int *wall_before, const double *v_before) {
    const silt_mesh *mesh = &run->mesh;
    silt_nodes *nodes = &run->nodes;
    const int D = silt_nodes_dim(nodes);
    for (int i = 0; i < mesh->n_node; i++) {
        const int s = nodes->wall[i][0];
        if (wall_before[i] >= 0 || s < 0 || run->walls.slip[s] || !mesh->wet[i])
            continue;
        const double *n = run->walls.normal[s], *v = v_before + D * i;
        double momentum[3], mass = 0;
        for (int d = 0; d < D; d++)
            momentum[d] = run->fluid.mass[i] * (v[d] - silt_dot(D, v, n) * n[d] - nodes->v[D * i + d]);
        for (int pass = 0; pass < 2; pass++)
            for (int k = mesh->neighbour_start[i]; k < mesh->neighbour_start[i + 1]; k++) {
                const int j = mesh->neighbour[k];
                if (j == i || nodes->kind[j] != NODE_FLUID || nodes->wall[j][0] >= 0)
                    continue;
                if (pass == 0)
                    mass += run->fluid.mass[j];
                else
                    for (int d = 0; d < D; d++)
                        nodes->v[D * j + d] += momentum[d] / mass;
            }
    }
}

// a bed cell in the numbers of the nodes; false where one of its corners never was on the surface
static bool water_cell(const silt_run *run, const int *bed_cell, int cell[4]) {
    for (int a = 0; a < 4; a++) {
        cell[a] = bed_cell[a] < 0 ? -1 : run->bed.fluid_node[bed_cell[a]];
        if (bed_cell[a] >= 0 && cell[a] < 0)
            return false;
    }
    return true;
}

// bed cells that became water, and water that became bed, in the numbers of the nodes
static void remember_bed(silt_run *run) {
    silt_memory *memory = &run->memory;
    for (int k = 0; k < run->n_freed; k++) {
        int cell[4];
        if (!water_cell(run, run->freed[k], cell))
            continue;
        SILT_RESERVE(memory->cell, memory->cell_capacity, memory->n_cell + 1);
        SILT_RESERVE(memory->area, memory->area_capacity, memory->n_cell + 1);
        memcpy(memory->cell[memory->n_cell], cell, sizeof cell);
        memory->area[memory->n_cell++] = run->freed_area[k];
    }
    for (int k = 0; k < run->n_grown; k++) {
        int cell[4];
        if (!water_cell(run, run->grown[k], cell))
            continue;
        SILT_RESERVE(memory->taken, memory->taken_capacity, memory->n_taken + 1);
        SILT_RESERVE(memory->taken_area, memory->taken_area_capacity, memory->n_taken + 1);
        memcpy(memory->taken[memory->n_taken], cell, sizeof cell);
        memory->taken_area[memory->n_taken++] = run->grown_area[k];
    }
    run->n_freed = run->n_grown = 0;
    for (int k = 0; k < run->bed.n_node; k++)
        if (!run->bed.alive[k])
            run->bed.fluid_node[k] = -1; // water now
}

// In a central force field it is the pressure with the potential that is smooth: that is what nodes that come get the mean of.
static void potential_add(silt_run *run, double sign) {
    const silt_fluid_def *fluid = &run->scene->fluid;
    silt_nodes *nodes = &run->nodes;
    if (fluid->force.kind == FORMULA_CENTRAL)
        for (int i = 0; i < nodes->count; i++)
            nodes->p[i] += sign * fluid->density * silt_formula_potential(&fluid->force, nodes->x + silt_nodes_dim(nodes) * i);
}

// n numbers a node, as they are now; to be returned
static double *nodes_copy(const silt_nodes *nodes, int n, const double *from) {
    const size_t count = (size_t)n * (size_t)nodes->count;
    double *copy = silt_borrow(count + 1, sizeof *copy);
    return memcpy(copy, from, count * sizeof *copy);
}

static silt_status nodes_move(silt_run *run, silt_error *err) {
    const silt_scene *scene = run->scene;
    silt_nodes *nodes = &run->nodes;
    silt_mesh *mesh = &run->mesh;
    const double h = scene->fluid.size, rho = scene->fluid.density;
    const int n = nodes->count, D = silt_nodes_dim(nodes);

    if (nodes->eddy)
        SILT_CLOCKED(assemble, silt_eddy_advance(&run->fluid.eddy, scene, nodes, mesh, &run->fluid.depth, &run->fluid.law, run->fluid.flux,
                                                 run->fluid.inverse, run->fluid.cell_volume, run->fluid.w, run->dt));
    silt_clock_to(CLOCK_move);
    // material motion; all nodes, so that the old cells hold what continuity gave them
    const double before = silt_mesh_volume(mesh, nodes->x);
    let_go(run);
    const double squeezed = silt_uplift_give(run->uplift, run);
    silt_uplift_open(run->uplift, run);
    for (int i = 0; i < n; i++)
        if (mesh->wet[i])
            for (int k = D * i; k < D * (i + 1); k++)
                nodes->x[k] += run->dt * silt_mesh_velocity(&run->fluid, k);
    const double moved = silt_mesh_volume(mesh, nodes->x);
    // inlets stay on their line: what they leave behind them is new water
    for (int i = 0; i < n; i++)
        if (nodes->kind[i] == NODE_INLET)
            memcpy(nodes->x + D * i, run->x_old + D * i, (size_t)D * sizeof(double));
    const double fed = silt_mesh_volume(mesh, nodes->x);
    run->ledger.inflow_mass += rho * (fed - moved);
    silt_run_levels(run);
    run->ledger.volume_solved += run->fluid.solved_volume;
    run->ledger.volume_given += run->fluid.given_back;
    run->ledger.volume_moved += moved - before - run->fluid.solved_volume - run->fluid.given_back - squeezed;
    if (scene->fluid.air_pressure > 0)
        silt_pockets_advance(&run->pockets, scene, mesh, run->x_old, nodes->x);
    potential_add(run, 1);
    silt_nodes_shuffle(nodes, mesh, scene, run->step);
    silt_memory_take(&run->memory, mesh, nodes);
    silt_run_levels_thin(run);

    // from here on positions are mended: what that does to the volume is booked by the rebuild
    for (int i = 0; i < n; i++) {
        if (!mesh->wet[i] && nodes->kind[i] == NODE_FLUID)
            fly(run, i);
    }
    carry_slip(run);
    place_bodies(run);
    silt_run_bed_sync(run);
    silt_memory_extend(&run->memory, nodes->count);
    SILT_RESERVE(run->x_old, run->x_old_capacity, D * (nodes->count + 1));
    for (int k = D * n; k < D * nodes->count; k++)
        run->x_old[k] = nodes->x[k];
    remember_bed(run);
    int *wall_before = silt_borrow((size_t)nodes->count + 1, sizeof *wall_before); // first wall of every node before contact
    double *v_before = nodes_copy(nodes, D, nodes->v);
    for (int i = 0; i < nodes->count; i++)
        wall_before[i] = nodes->wall[i][0];
    uint8_t *flying = silt_borrow((size_t)nodes->count + 1, 1);
    for (int i = 0; i < n; i++)
        flying[i] = !mesh->wet[i];
    silt_walls_contact(&run->walls, nodes, run->x_old, run->memory.interior, flying, h);
    silt_return(flying);
    hand_on_landing(run, wall_before, v_before);
    silt_return(v_before);
    silt_return(wall_before);
    let_out(run);
    expel(run);
    SILT_CLOCKED(refine, silt_mesh_refine(mesh, nodes, &run->memory, h));

    silt_clock_to(CLOCK_index);
    SILT_RESERVE(run->map, run->map_capacity, nodes->count + 1);
    double *debt_before = nodes_copy(nodes, 1, nodes->debt);
    v_before = nodes_copy(nodes, D, nodes->v);
    run->memory.record = true;
    const silt_status status = silt_mesh_rebuild(mesh, nodes, scene, &run->barrier, &run->memory, run->map, err);
    double lost[3];
    if (status == SILT_OK) {
        potential_add(run, -1);
        SILT_CLOCKED(handover, silt_momentum_hand_on(&run->memory, mesh, nodes, rho, NULL, debt_before, v_before, run->map, lost));
    }
    silt_return(v_before);
    silt_return(debt_before);
    SILT_TRY(status);
    run->ledger.volume_reconnected += run->memory.reconnected;
    // without an outlet nothing may leave: what does anyway shows as a volume error
    if (scene->fluid.n_outlet)
        run->ledger.outflow_mass += rho * run->memory.left;
    for (int k = 0; k < run->bed.n_node; k++)
        if (run->bed.fluid_node[k] >= 0)
            run->bed.fluid_node[k] = run->map[run->bed.fluid_node[k]];
    SILT_CLOCKED(refine, silt_size_update(run->size, nodes, mesh));
    SILT_TRY(silt_run_pockets(run, err));
    silt_run_locate(run);
    silt_clock_to(CLOCK_rest);
    return SILT_OK;
}

// The factor of the pressure rests until the next step, and is larger than all that a new mesh needs for a moment (a tenth of the peak).
silt_status silt_run_move(silt_run *run, silt_error *err) {
    size_t bytes;
    void *rest = silt_fluid_rest(&run->fluid, &bytes);
    silt_lend(rest, bytes);
    const silt_status status = nodes_move(run, err);
    silt_memory_rest(&run->memory);
    silt_lend(NULL, 0);
    return status;
}
