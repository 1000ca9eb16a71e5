// what goes from the bed to the grains and back: release, parcels that wait for room, deposition
#include "bed_law.h"
#include "crowd.h"
#include "run.h"

#define DEPOSIT_SPEED 0.05  // of sqrt((s - 1) g d)
#define DEPOSIT_FORCE 0.1   // net force, of the submerged weight
#define DEPOSIT_TIME 10     // times sqrt(d/g), at rest for so long
#define PARCELS_MOST 256    // of one patch
#define DEPOSIT_PATIENCE 5  // times that: what finds no sound place goes into pores
#define DEPOSIT_PORES 0.5   // of the bed's porosity: what pores are filled to at most
#define DEPOSIT_SHIELDS 0.8 // of the stress that moves grains
#define ROOM_SIDES 19       // places beside each on the way out
#define RELEASE_LONG 4      // radii: a parcel that had to look farther goes up through the heap on it
#define RELEASE_FAR 12      // radii, the farthest that it looks
#define RELEASE_LIFTS 0.5   // upward part of the normal above which seepage can lift grains off
#define RELEASE_HANGS (-0.3) // upward part of the normal out of the bed below which sand does not hold

static double gravity_of(const silt_scene *scene) {
    return hypot(hypot(scene->gravity[0], scene->gravity[1]), scene->gravity[2]);
}

static void remember_cell(silt_run *run, const int cell[4], double area, bool freed) {
    if (freed) {
        SILT_RESERVE(run->freed, run->freed_capacity, run->n_freed + 1);
        SILT_RESERVE(run->freed_area, run->freed_area_capacity, run->n_freed + 1);
        memcpy(run->freed[run->n_freed], cell, sizeof run->freed[0]);
        run->freed_area[run->n_freed++] = area;
    } else {
        SILT_RESERVE(run->grown, run->grown_capacity, run->n_grown + 1);
        SILT_RESERVE(run->grown_area, run->grown_area_capacity, run->n_grown + 1);
        memcpy(run->grown[run->n_grown], cell, sizeof run->grown[0]);
        run->grown_area[run->n_grown++] = area;
    }
}

// of a bed cell's area, what water and grains fill once it is bed no more: the solid, and the pores as far as they are wet
static double cell_water(const silt_run *run, int cell) {
    const double solid = run->bed.mass[cell] / run->scene->bed.density;
    return solid + run->scene->bed.saturation * (run->bed.area[cell] - solid);
}

// a parcel's mass is a power of its diameter: 2 or 3 in the plane, by the width that it is counted with, 3 in space
static double parcel_power(const silt_run *run, double mass) {
    return log(8) / log(silt_coupling_dem.parcel_radius(run->coupling, 8 * mass) / silt_coupling_dem.parcel_radius(run->coupling, mass));
}

// kg/m of the parcels that a patch becomes, whose sum is its mass to the last bit: equal ones, or by the sieve curve
static int parcel_shares(const silt_run *run, const silt_patch *patch, double share[PARCELS_MOST]) {
    const silt_scene *scene = run->scene;
    const double d_patch = 2 * silt_coupling_dem.parcel_radius(run->coupling, patch->mass);
    int n = scene->grains.per_patch;
    bool drawn = false;
    if (scene->grains.sieve.n_row) {
        const uint64_t seed = silt_hash(silt_hash(0, &scene->fluid.seed, sizeof scene->fluid.seed), &patch->node, sizeof patch->node);
        n = silt_sieve_draw(&scene->grains.sieve, seed, d_patch, parcel_power(run, patch->mass), PARCELS_MOST, share);
        drawn = true;
    } else if (n == 0)
        n = (int)silt_clamp(floor(pow(d_patch / scene->grains.parcel, run->bed.dim == 3 ? 3 : 2) + 0.5), 1, PARCELS_MOST);
    double left = patch->mass;
    for (int k = 0; k < n; k++) {
        share[k] = k + 1 < n ? patch->mass * (drawn ? share[k] : 1.0 / n) : left;
        left -= share[k];
    }
    return n;
}

static void release_node(silt_run *run, int node) {
    const silt_scene *scene = run->scene;
    silt_patch patch;
    silt_bed_patch(&run->bed, node, &patch);
    if (patch.n_cell == 0)
        return;
    for (int k = 0; k < patch.n_cell; k++)
        remember_cell(run, run->bed.cell[patch.cell[k]], cell_water(run, patch.cell[k]), true);
    silt_bed_take_out(&run->bed, scene, &patch);
    silt_sum(&run->ledger.released_mass, &run->ledger.released_rest, patch.mass);

    double share[PARCELS_MOST];
    const int n = parcel_shares(run, &patch, share);
    for (int k = 0; k < n; k++) {
        SILT_RESERVE(run->waiting, run->waiting_capacity, run->n_waiting + 1);
        silt_waiting *waiting = &run->waiting[run->n_waiting++];
        *waiting = (silt_waiting){.mass = share[k], .reach = silt_max(patch.height, 2 * silt_coupling_dem.parcel_radius(run->coupling, patch.mass))};
        memcpy(waiting->x, patch.centre, sizeof waiting->x);
        memcpy(waiting->normal, patch.normal, sizeof waiting->normal);
    }
}

// Those of run->pick that still stand: a neighbour's release may have taken a node along, or buried it.
static void release_picked(silt_run *run, int n) {
    int left = 0;
    for (int k = 0; k < n; k++)
        if (run->bed.alive[run->pick[k]] && run->bed.exposed[run->pick[k]]) {
            release_node(run, run->pick[k]);
            left++;
        }
    if (left)
        silt_bed_refresh(&run->bed);
}

// Sand has no strength to hang over what was washed out below it: nodes in a roof fall, a row in a step. Those between an
// edge that faces down and one that does not are a rough wall, and stay.
static int pick_hanging(silt_run *run) {
    const silt_bed *bed = &run->bed;
    const double *g = run->scene->gravity, size = gravity_of(run->scene);
    if (!(size > 0))
        return 0;
    int *count = silt_alloc((size_t)bed->n_node + 1, sizeof *count), n = 0;
    const int dim = bed->dim == 3 ? 3 : 2;
    for (int e = 0; e < bed->n_edge; e++) {
        double out[3] = {0};
        silt_bed_facet_normal(bed, bed->edge[e], out);
        const double up = -silt_dot(dim, out, g) / (hypot(hypot(out[0], out[1]), out[2]) * size);
        for (int c = 0; c < dim; c++)
            count[bed->edge[e][c]] += up < RELEASE_HANGS ? 1 : -1000;
    }
    for (int k = 0; k < bed->n_node; k++)
        if (count[k] >= dim)
            run->pick[n++] = k;
    free(count);
    return n;
}

// Seepage that outweighs the grains lifts them off: nodes on a surface that looks up, where its force is their weight under water
static int pick_lifted(silt_run *run) {
    const silt_bed *bed = &run->bed;
    const double *g = run->scene->gravity, size = gravity_of(run->scene);
    if (!bed->seepage || !run->scene->bed.fluidise || !(size > 0))
        return 0;
    int n = 0;
    for (int k = 0; k < run->seep.n_node; k++) {
        double normal[3] = {0};
        if (!bed->alive[k] || !bed->exposed[k] || bed->seepage[k] < 1)
            continue;
        silt_bed_normal(bed, k, normal);
        if (-silt_dot(3, normal, g) > RELEASE_LIFTS * size)
            run->pick[n++] = k;
    }
    return n;
}

// All that is due leaves: one layer, since what a release exposes is due in the next step.
void silt_run_release(silt_run *run) {
    silt_bed *bed = &run->bed;
    const silt_scene *scene = run->scene;
    if (!scene->bed.on)
        return;
    SILT_RESERVE(run->pick, run->pick_capacity, bed->n_node + 1);
    release_picked(run, silt_bed_due(bed, scene, bed->n_node, run->pick));
    release_picked(run, pick_lifted(run));
    if (bed->revision != run->bed_revision) {
        // a patch of a loose piece goes, whether it has surface or not
        const int n = silt_bed_loose(bed, scene, bed->n_node, run->pick);
        for (int k = 0; k < n; k++)
            if (bed->alive[run->pick[k]])
                release_node(run, run->pick[k]);
        if (n)
            silt_bed_refresh(bed);
    }
    if (silt_bed_erodes(&scene->bed)) {
        release_picked(run, pick_hanging(run));
        release_picked(run, silt_bed_steep(bed, scene, bed->n_node, run->pick));
    }
    if (run->coupling && bed->revision != run->bed_revision) {
        silt_coupling_dem.bed_changed(run->coupling, bed);
        run->bed_revision = bed->revision;
    }
}

// true when a parcel fits there
static bool room_at(const silt_run *run, const double *x, double radius, const silt_crowd *placed) {
    int element;
    if (run->walls.count && silt_walls_distance(&run->walls, x, &element) < radius)
        return false;
    if (run->bed.dim == 3 && silt_bed_contains(&run->bed, x))
        return false;
    return silt_crowd_gap(placed, x, 2 * radius) > radius && silt_coupling_dem.room(run->coupling, x, radius);
}

// steps to the side, the first is none: along the surface in the plane, in rings in space. @return how many
static int room_sides(int dim, const double *n, double radius, double side[ROOM_SIDES][3]) {
    int count = 0;
    memset(side, 0, ROOM_SIDES * sizeof *side);
    if (dim == 2) {
        for (; count < 5; count++) {
            const double along = (count + 1) / 2 * (count % 2 ? 1 : -1) * 0.5 * radius;
            side[count][0] = -along * n[1];
            side[count][1] = along * n[0];
        }
        return count;
    }
    double u[3], v[3], least[3] = {0};
    least[fabs(n[0]) < 0.6 ? 0 : 1] = 1;
    for (int pass = 0; pass < 2; pass++) {
        const double *from = pass ? u : least;
        double *to = pass ? v : u;
        for (int d = 0; d < 3; d++)
            to[d] = n[(d + 1) % 3] * from[(d + 2) % 3] - n[(d + 2) % 3] * from[(d + 1) % 3];
        const double length = silt_length(3, to);
        for (int d = 0; d < 3; d++)
            to[d] /= length;
    }
    count = 1;
    for (int ring = 1; ring <= 2; ring++)
        for (int k = 0; k < 6 * ring; k++, count++)
            for (int d = 0; d < 3; d++)
                side[count][d] = ring * radius * (cos(M_PI / 3 * k / ring) * u[d] + sin(M_PI / 3 * k / ring) * v[d]);
    return count;
}

// a place for the parcel: out along the normal and to the sides; one that has waited long also straight up
static bool find_room(const silt_run *run, const silt_waiting *waiting, double radius, const silt_crowd *placed, double out[3]) {
    const double *g = run->scene->gravity, size = gravity_of(run->scene);
    const double up[3] = {size > 0 ? -g[0] / size : 0, size > 0 ? -g[1] / size : 0, size > 0 ? -g[2] / size : 0};
    const int steps = (int)silt_max(12, ceil(3 * (waiting->reach + radius) / radius)), dim = run->bed.dim == 3 ? 3 : 2;
    const bool long_since = waiting->reach > RELEASE_LONG * radius && size > 0;
    double side[ROOM_SIDES][3];
    for (int way = 0; way <= steps * (1 + long_since); way++) {
        const int out_step = way <= steps ? way : way - steps;
        const double *n = way <= steps ? waiting->normal : up;
        const int n_side = room_sides(dim, n, radius, side);
        for (int k = 0; k < n_side; k++) {
            const double outward = out_step * (waiting->reach + radius) / steps;
            for (int d = 0; d < 3; d++)
                out[d] = waiting->x[d] + outward * n[d] + side[k][d];
            if (room_at(run, out, radius, placed))
                return true;
        }
    }
    return false;
}

void silt_run_place(silt_run *run) {
    int n_placed = 0, kept = 0, capacity = 0;
    silt_release *placed = NULL;
    silt_crowd crowd = {0};
    for (int k = 0; k < run->n_waiting; k++) {
        const silt_waiting *waiting = &run->waiting[k];
        silt_release release = {.mass = waiting->mass};
        memcpy(release.v, waiting->v, sizeof release.v);
        release.radius = silt_coupling_dem.parcel_radius(run->coupling, waiting->mass);
        if (k == 0)
            silt_crowd_start(&crowd, 2 * release.radius);
        if (find_room(run, waiting, release.radius, &crowd, release.x)) {
            SILT_RESERVE(placed, capacity, n_placed + 1);
            placed[n_placed++] = release;
            silt_crowd_add(&crowd, release.x, release.radius);
        } else {
            // it looks farther in the next step
            run->waiting[kept] = *waiting;
            run->waiting[kept].reach = silt_max(waiting->reach, silt_min(1.02 * waiting->reach, RELEASE_FAR * release.radius));
            kept++;
        }
    }
    run->n_waiting = kept;
    if (n_placed)
        silt_coupling_dem.release(run->coupling, n_placed, placed);
    silt_crowd_clear(&crowd);
    free(placed);
}

// slow: a clock of rest is kept while it is so
static bool grain_slow(const silt_run *run, const silt_grain_state *grains, int k) {
    const silt_scene *scene = run->scene;
    const double lighter = scene->fluid.on ? scene->bed.density / scene->fluid.density - 1 : 1;
    return silt_length(3, grains->v + 3 * k) <
           DEPOSIT_SPEED * sqrt(silt_max(lighter, 0.01) * gravity_of(scene) * 2 * grains->radius[k]);
}

// balanced and carried by the bed: the clock goes on; the jolts of a neighbour stop it for the step
static bool grain_rests(const silt_run *run, const silt_grain_state *grains, int k) {
    const silt_scene *scene = run->scene;
    const double weight =
        grains->mass[k] * gravity_of(scene) * (scene->fluid.on ? 1 - scene->fluid.density / scene->bed.density : 1);
    return grains->net_force[k] < DEPOSIT_FORCE * weight && grains->on_bed[k];
}

// the water there would not move it again
static bool water_calm(const silt_run *run, const double *x) {
    return !run->scene->fluid.on || silt_bed_shear_at(&run->bed, x) < DEPOSIT_SHIELDS * silt_bed_motion(run->scene);
}

// A parcel at rest becomes bed: in looser cells where the scene says so, as new cells, and where these find no sound place for long, or
// it lies under them, in the pores of the cells around it. rested: in sqrt(d/g)
static bool deposit_parcel(silt_run *run, const double *x, double r, double mass, double rested, const silt_bed_others *others,
                           silt_deposit *deposit) {
    const silt_scene *scene = run->scene;
    const double size = scene->bed.size, near = r + size, far = r + 3 * size, loose = scene->bed.porosity;
    const bool buried = silt_bed_contains(&run->bed, x);
    if (!buried && !water_calm(run, x))
        return false;
    if (scene->bed.densify && silt_bed_densify(&run->bed, scene, x, near, loose, mass, deposit) != DEPOSIT_REFUSED)
        return true;
    if (!buried && silt_bed_deposit(&run->bed, scene, x, r, mass, others, deposit) != DEPOSIT_REFUSED)
        return true;
    if (!buried && rested < DEPOSIT_PATIENCE * DEPOSIT_TIME)
        return false;
    return silt_bed_densify(&run->bed, scene, x, far, loose, mass, deposit) != DEPOSIT_REFUSED ||
           silt_bed_densify(&run->bed, scene, x, far, DEPOSIT_PORES * loose, mass, deposit) != DEPOSIT_REFUSED;
}

// new bed cells take their place from the water at the next rebuild
static void remember_grown(silt_run *run, const silt_deposit *deposit) {
    for (int e = 0; e < deposit->n_cell; e++)
        remember_cell(run, run->bed.cell[deposit->cell[e]], cell_water(run, deposit->cell[e]), false);
}

static void take_others(const silt_run *run, const silt_grain_state *grains, silt_bed_others *others) {
    uint8_t *at_rest = silt_alloc((size_t)grains->count + 1, 1);
    for (int k = 0; k < grains->count; k++)
        at_rest[k] = grain_slow(run, grains, k) && grain_rests(run, grains, k);
    silt_bed_others_take(others, grains, at_rest);
    free(at_rest);
}

static void become_bed(silt_run *run, const silt_grain_state *grains, int k, uint8_t *gone) {
    silt_coupling_dem.deposit(run->coupling, k);
    silt_sum(&run->ledger.deposited_mass, &run->ledger.deposited_rest, grains->mass[k]);
    gone[k] = 1;
}

silt_status silt_run_deposit(silt_run *run, silt_error *err) {
    (void)err;
    const silt_scene *scene = run->scene;
    const silt_grain_state *grains = silt_coupling_dem.grains(run->coupling);
    if (!scene->bed.on || !scene->bed.deposition || !silt_bed_erodes(&scene->bed))
        return SILT_OK;
    const double g = gravity_of(scene);
    // the clocks of rest, merged by id
    int old = 0, kept = 0;
    silt_rest *fresh = silt_alloc((size_t)grains->count + 1, sizeof *fresh);
    bool changed = false;
    silt_bed_others others = {0};
    uint8_t *gone = silt_alloc((size_t)grains->count + 1, 1);
    for (int k = 0; k < grains->count; k++) {
        while (old < run->n_rest && run->rest[old].id < grains->id[k])
            old++;
        const double had = old < run->n_rest && run->rest[old].id == grains->id[k] ? run->rest[old].time : 0;
        if (gone[k] || !grain_slow(run, grains, k))
            continue;
        // what new cells have buried is bed
        const bool rests = grain_rests(run, grains, k) || silt_bed_contains(&run->bed, grains->x + 3 * k);
        // balanced on one point: the clock runs slowly
        const double pace = grains->contacts[k] >= (scene->dimension == 3 ? 3 : 2) ? 1 : 1.0 / DEPOSIT_PATIENCE;
        const double now = had + (rests ? pace * run->dt : 0);
        if (rests && now > DEPOSIT_TIME * sqrt(2 * grains->radius[k] / silt_max(g, 1e-12))) {
            silt_deposit deposit = {0};
            const double *x = grains->x + 3 * k, r = grains->radius[k], mass = grains->mass[k];
            if (!others.grain)
                take_others(run, grains, &others);
            silt_bed_others_mark(&others, x, true);
            if (deposit_parcel(run, x, r, mass, now * sqrt(g / (2 * r)), &others, &deposit)) {
                become_bed(run, grains, k, gone);
                for (int m = 0; m < deposit.n_other; m++) {
                    become_bed(run, grains, deposit.other[m], gone);
                    silt_bed_others_mark(&others, grains->x + 3 * deposit.other[m], true);
                }
                remember_grown(run, &deposit);
                changed = true;
                continue;
            }
            silt_bed_others_mark(&others, x, false);
        }
        fresh[kept++] = (silt_rest){grains->id[k], now};
    }
    SILT_RESERVE(run->rest, run->rest_capacity, kept + 1);
    memcpy(run->rest, fresh, (size_t)kept * sizeof *fresh);
    run->n_rest = kept;
    free(fresh);
    free(gone);
    silt_bed_others_clear(&others);
    if (changed) {
        silt_coupling_dem.bed_changed(run->coupling, &run->bed);
        run->bed_revision = run->bed.revision;
    }
    return SILT_OK;
}

// A node of the water that the bed gave free knows the walls that it lies on.
static void touch_walls(silt_run *run, int i) {
    silt_nodes *nodes = &run->nodes;
    const double *x = nodes->x + 2 * i;
    for (int s = 0, found = 0; s < run->walls.count && found < 2; s++) {
        const double *from = run->walls.from[s], *to = run->walls.to[s], *n = run->walls.normal[s];
        const double length = hypot(to[0] - from[0], to[1] - from[1]), tiny = 1e-6 * run->scene->fluid.size;
        const double off = (x[0] - from[0]) * n[0] + (x[1] - from[1]) * n[1];
        const double along = ((x[0] - from[0]) * (to[0] - from[0]) + (x[1] - from[1]) * (to[1] - from[1])) / length;
        if (fabs(off) >= tiny || along <= -tiny || along >= length + tiny)
            continue;
        // nearly straight joints are no corners
        const double *first = run->walls.normal[nodes->wall[i][0] < 0 ? s : nodes->wall[i][0]];
        if (found == 0 || fabs(first[0] * n[1] - first[1] * n[0]) > 0.3)
            nodes->wall[i][found++] = s;
    }
}

// a node whose bed is gone is water now
static void free_node(silt_run *run, int node) {
    silt_bed *bed = &run->bed;
    silt_nodes *nodes = &run->nodes;
    if (bed->fluid_node[node] < 0)
        bed->fluid_node[node] = silt_nodes_add(nodes, NODE_FLUID, -1, bed->x[node]);
    const int i = bed->fluid_node[node];
    if (nodes->kind[i] != NODE_BED && nodes->owner[i] != -1)
        return;
    nodes->kind[i] = bed->corner[node] >= 0 ? NODE_CORNER : NODE_FLUID;
    nodes->owner[i] = bed->corner[node];
    if (bed->dim != 3)
        touch_walls(run, i);
    else if (bed->corner[node] < 0)
        memcpy(nodes->wall[i], bed->wall[node], sizeof nodes->wall[i]);
}

// water nodes too near to a new bed node leave
static void clear_grown(silt_run *run) {
    const silt_bed *bed = &run->bed;
    const silt_nodes *nodes = &run->nodes;
    const int dim = silt_nodes_dim(nodes);
    silt_memory_extend(&run->memory, nodes->count);
    for (int k = 0; k < run->n_grown; k++)
        for (int a = 0; a <= dim; a++) {
            const double *x = bed->x[run->grown[k][a]];
            for (int i = 0; i < nodes->count; i++) {
                if (nodes->kind[i] != NODE_FLUID || nodes->wall[i][1] >= 0)
                    continue;
                const double flat = hypot(nodes->x[dim * i] - x[0], nodes->x[dim * i + 1] - x[1]);
                if ((dim == 3 ? hypot(flat, nodes->x[3 * i + 2] - x[2]) : flat) < 0.4 * run->scene->fluid.size)
                    run->memory.dead[i] = 1;
            }
        }
}

void silt_run_bed_sync(silt_run *run) {
    if (!run->scene->bed.on || !run->scene->fluid.on)
        return;
    silt_bed *bed = &run->bed;
    silt_nodes *nodes = &run->nodes;
    // nodes of freed cells that have no bed left become water, and of grown cells that are new stand on the bed
    for (int k = 0; k < run->n_freed; k++)
        for (int a = 0; a < 4; a++)
            if (run->freed[k][a] >= 0 && !bed->alive[run->freed[k][a]])
                free_node(run, run->freed[k][a]);
    for (int k = 0; k < bed->n_node; k++) {
        const int i = bed->fluid_node[k];
        if (bed->alive[k] && bed->exposed[k] && i < 0)
            bed->fluid_node[k] = silt_nodes_add(nodes, NODE_BED, k, bed->x[k]);
        else if (bed->alive[k] && !bed->exposed[k] && i >= 0) {
            silt_memory_extend(&run->memory, nodes->count);
            run->memory.dead[i] = 1; // buried
        }
    }
    clear_grown(run);
}
