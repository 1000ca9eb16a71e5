// the state at t = 0: box of the scene, bed, bodies, the cloud of nodes and the first mesh
#include "run.h"
#include "solid.h"

#define GRAIN_CELLS 2.0 // largest diameter of a grain in cells without a word
#define WATER_MADE 0.1 // largest share by which the first cells may miss the regions without a word

static bool run_solid(const void *context, const double *x, double margin) {
    const silt_barrier *barrier = context;
    if (barrier->bed && (silt_bed_contains(barrier->bed, x) || silt_bed_near(barrier->bed, x, margin)))
        return true;
    const silt_barrier bodies = {.bodies = barrier->bodies};
    if (silt_barrier_contains(&bodies, x))
        return true;
    for (int b = 0; margin > 0 && barrier->bodies && b < barrier->bodies->count && barrier->bodies->body[b].solid; b++) {
        const struct silt_body *body = &barrier->bodies->body[b];
        double local[3] = {x[0] - body->x[0], x[1] - body->x[1], x[2] - body->x[2]};
        if (silt_length(3, local) > body->solid->radius + margin)
            continue;
        silt_turn(body->q, true, local, local);
        if (silt_solid_distance(body->solid, local, NULL, NULL) < margin)
            return true;
    }
    for (int k = 0; margin > 0 && barrier->bodies && barrier->bodies->count && !barrier->bodies->body[0].solid && k < 8; k++) {
        const double probe[2] = {x[0] + margin * cos(k * M_PI / 4), x[1] + margin * sin(k * M_PI / 4)};
        if (silt_barrier_contains(&bodies, probe))
            return true;
    }
    return false;
}

void silt_coupling_def_fill(const silt_run *run, silt_coupling_def *def) {
    *def = (silt_coupling_def){.scene = run->scene,
                               .walls = &run->walls,
                               .bed = run->scene->bed.on ? &run->bed : NULL,
                               .worker = run->worker,
                               .log = run->log,
                               .trace = run->trace};
    memcpy(def->lo, run->box_lo, sizeof def->lo);
    memcpy(def->hi, run->box_hi, sizeof def->hi);
    def->margin = run->box_margin;
    memcpy(def->way_lo, run->way_lo, sizeof def->way_lo);
    memcpy(def->way_hi, run->way_hi, sizeof def->way_hi);
}

// everything that walls wherever they go, regions and bodies span, and room for splashes
static void box_span(double lo[3], double hi[3], const double *x, int dim, double reach) {
    for (int d = 0; d < dim; d++) {
        lo[d] = silt_min(lo[d], x[d] - reach);
        hi[d] = silt_max(hi[d], x[d] + reach);
    }
}

// where they are now; only: this one of the scene, -1: all
static void box_walls(const silt_run *run, int only, double lo[3], double hi[3]) {
    for (int s = 0; s < run->walls.count; s++)
        if (only >= 0 && run->walls.wall[s] != only)
            continue;
        else if (run->scene->dimension == 3)
            for (int c = 0; c < 3; c++)
                box_span(lo, hi, run->walls.corner[s][c], 3, 0);
        else {
            box_span(lo, hi, run->walls.from[s], 2, 0);
            box_span(lo, hi, run->walls.to[s], 2, 0);
        }
}

// Where walls come in the course of their motion, from row to row, with places between for those that turn: the discrete elements
// lose what leaves the box.
static void box_motion(silt_run *run, int dim, double lo[3], double hi[3]) {
    enum { BETWEEN = 16 };
    const silt_scene *scene = run->scene;
    for (int d = 0; d < dim; d++) {
        run->way_lo[d] = HUGE_VAL;
        run->way_hi[d] = -HUGE_VAL;
    }
    for (int w = 0; w < scene->n_wall; w++) {
        const silt_series *motion = &scene->wall[w].motion;
        for (int r = 0; r < BETWEEN * motion->n_row; r++) {
            const double *row = motion->value + (size_t)(r / BETWEEN) * (size_t)motion->n_column;
            const double next = r / BETWEEN + 1 < motion->n_row ? row[motion->n_column] : row[0];
            const double time = row[0] + (double)(r % BETWEEN) / BETWEEN * (next - row[0]);
            silt_walls_move(&run->walls, scene, silt_min(time, scene->time.end), 0);
            box_walls(run, w, run->way_lo, run->way_hi);
        }
        // a record of accelerations may leave it with a velocity
        if (motion->n_row && silt_path_accelerates(motion)) {
            silt_walls_move(&run->walls, scene, scene->time.end, 0);
            box_walls(run, w, run->way_lo, run->way_hi);
        }
    }
    silt_walls_move(&run->walls, scene, 0, 0);
    if (run->way_lo[0] <= run->way_hi[0]) {
        box_span(lo, hi, run->way_lo, dim, 0);
        box_span(lo, hi, run->way_hi, dim, 0);
    }
}

void silt_run_box(silt_run *run) {
    const silt_scene *scene = run->scene;
    const int D = scene->dimension == 3 ? 3 : 2;
    double lo[3] = {HUGE_VAL, HUGE_VAL, HUGE_VAL}, hi[3] = {-HUGE_VAL, -HUGE_VAL, -HUGE_VAL};
    box_walls(run, -1, lo, hi);
    const silt_region *lists[2] = {scene->fluid.region, scene->bed.region};
    const int counts[2] = {scene->fluid.n_region, scene->bed.n_region};
    for (int l = 0; l < 2; l++)
        for (int r = 0; r < counts[l]; r++) {
            double a[3], b[3];
            silt_region_bounds(&lists[l][r], a, b);
            box_span(lo, hi, a, D, 0);
            box_span(lo, hi, b, D, 0);
        }
    if (silt_scene_has_dem(scene))
        box_motion(run, D, lo, hi);
    for (int i = 0; i < run->nodes.count; i++)
        box_span(lo, hi, run->nodes.x + D * i, D, 0);
    for (int b = 0; b < scene->n_body; b++)
        box_span(lo, hi, scene->body[b].at, D, silt_max(scene->body[b].scale, silt_max(scene->body[b].height, scene->body[b].depth)));
    for (int k = 0; k < silt_scene_grains(scene); k++)
        box_span(lo, hi, silt_scene_grain(scene, k)->at, D, silt_scene_grain(scene, k)->diameter);
    // nothing holds water that has no walls: it may go far
    double margin = 0;
    for (int d = 0; d < D; d++)
        margin = silt_max(margin, (run->walls.count ? 0.5 : 20) * (hi[d] - lo[d]));
    run->box_margin = margin;
    for (int d = 0; d < D; d++) {
        run->box_lo[d] = lo[d] - margin;
        run->box_hi[d] = hi[d] + margin;
    }
}

// closed air of a fresh mesh
silt_status silt_run_pockets(silt_run *run, silt_error *err) {
    if (!(run->scene->fluid.air_pressure > 0))
        return SILT_OK;
    SILT_TRY(silt_air_find(&run->air, run->scene, &run->nodes, &run->mesh, &run->barrier, err));
    silt_pockets_update(&run->pockets, run->scene, &run->nodes, &run->mesh, &run->air);
    return SILT_OK;
}

// 50 ns a node that only who asks for the water at a point has to pay
void silt_run_locate(silt_run *run) {
    if (run->scene->bed.on || run->scene->n_gauge > 0)
        silt_locator_build(&run->locator, &run->mesh, run->nodes.x, run->scene->fluid.size);
}

// some node lies on no facet of the boundary
static bool water_deep(const silt_mesh *mesh) {
    const int D = mesh->dim == 3 ? 3 : 2;
    uint8_t *rim = silt_alloc((size_t)mesh->n_node + 1, sizeof *rim);
    bool deep = false;
    for (int f = 0; f < mesh->n_facet; f++)
        for (int a = 0; a < D; a++)
            rim[mesh->facet[f][a]] = 1;
    for (int i = 0; i < mesh->n_node && !deep; i++)
        deep = mesh->wet[i] && !rim[i];
    free(rim);
    return deep;
}

// m, the least of width, length and height of the water
static double water_extent(const silt_run *run) {
    const int D = silt_nodes_dim(&run->nodes);
    double lo[3] = {HUGE_VAL, HUGE_VAL, HUGE_VAL}, hi[3] = {-HUGE_VAL, -HUGE_VAL, -HUGE_VAL}, least = HUGE_VAL;
    for (int i = 0; i < run->nodes.count; i++)
        if (run->mesh.wet[i])
            box_span(lo, hi, run->nodes.x + D * i, D, 0);
    for (int d = 0; d < D; d++)
        least = silt_min(least, hi[d] - lo[d]);
    return run->mesh.n_cell > 0 ? least : HUGE_VAL;
}

// Regions and clouds too thin for any cell hold no water, nor those thinner than one without a node inside; those that are coarsely met are told. Where bed or bodies stand in regions, or
// the water is a cloud, nobody knows beforehand how much there is.
static silt_status water_there(const silt_run *run, silt_error *err) {
    const silt_scene *scene = run->scene;
    const silt_fluid_def *fluid = &scene->fluid;
    if (run->mesh.n_cell == 0 && fluid->n_inlet == 0)
        return silt_fail(err, SILT_INPUT, fluid->cloud ? "key 'fluid.cloud': found nodes of which no three make a cell of water (in space no four), allowed nodes about "
                                                         "fluid.size = %g m apart that fill an area (a volume)"
                                                       : "key 'fluid.regions': found water in which no cell of fluid.size = %g m has room, allowed regions that are "
                                                         "wider than a cell; smaller fluid.size", fluid->size);
    if (fluid->cloud)
        return SILT_OK;
    const bool deep = fluid->n_inlet > 0 || water_deep(&run->mesh);
    if (!deep && fluid->n_size == 0 && water_extent(run) < fluid->size * (1 - 1e-6))
        return silt_fail(err, SILT_INPUT, "key 'fluid.regions': found water that is %.3g m thin, with no node inside, allowed a cell of fluid.size = %g m at least; "
                                          "smaller fluid.size", water_extent(run), fluid->size);
    if (!deep)
        silt_run_warn(run, "no node lies inside of the water, whose pressure is then that of its walls and its surface alone: it is no deeper than "
                           "fluid.size = %g m; smaller fluid.size", fluid->size);
    if (scene->bed.on || scene->n_body)
        return SILT_OK;
    double wanted = 0, made = 0;
    for (int r = 0; r < fluid->n_region; r++)
        wanted += silt_region_area(&fluid->region[r]);
    for (int e = 0; e < run->mesh.n_cell; e++)
        made += silt_cell_volume(&run->mesh, run->nodes.x, e);
    if (fabs(made - wanted) > WATER_MADE * wanted)
        silt_run_warn(run, "the water's regions hold %.4g m%d, its cells %.4g at the start: smaller fluid.size, or regions that overlap", wanted, scene->dimension,
                      made);
    return SILT_OK;
}

// grains are points to the water, which takes their volume by a kernel some diameters wide
static void grains_small(const silt_run *run) {
    const silt_scene *scene = run->scene;
    double largest = 0;
    for (int k = 0; k < silt_scene_grains(scene); k++)
        if (!silt_scene_grain(scene, k)->fixed)
            largest = silt_max(largest, silt_scene_grain(scene, k)->diameter);
    if (largest > GRAIN_CELLS * scene->fluid.size * (1 + 1e-9))
        silt_run_warn(run, "a grain of %.3g m in water with cells of %.3g m: grains are points to the water, right up to %g cells; larger ones are bodies", largest,
                      scene->fluid.size, GRAIN_CELLS);
    // a kernel that is wider than the water spreads the grain's volume all over it: what sinks lifts nothing
    const double width = scene->grains.kernel > 0 ? scene->grains.kernel : silt_max(3 * largest, 2 * scene->fluid.size);
    const double room = largest > 0 ? water_extent(run) : HUGE_VAL;
    if (width > room)
        silt_run_warn(run, "the kernel of the grains' volume is %.3g m wide, the water %.3g m: smaller grains, or grains.kernel", width, room);
}

silt_status silt_run_first(silt_run *run, silt_error *err) {
    const silt_scene *scene = run->scene;
    if (scene->bed.on)
        SILT_TRY(silt_bed_create(&run->bed, scene, &run->walls, err));
    run->bed_revision = run->bed.revision;
    if (silt_scene_has_dem(scene)) {
        silt_coupling_def def;
        silt_coupling_def_fill(run, &def);
        SILT_TRY(silt_coupling_dem.open(&run->coupling, &def, err));
        run->barrier.bodies = silt_coupling_dem.bodies(run->coupling);
    }
    if (scene->bed.on)
        run->barrier.bed = &run->bed;
    run->barrier.walls = &run->walls;
    if (!scene->fluid.on)
        return SILT_OK;

    // bodies and bed first: the water keeps its distance
    run->nodes.dim = scene->dimension;
    for (int b = 0; run->barrier.bodies && b < run->barrier.bodies->count; b++) {
        const struct silt_body *body = &run->barrier.bodies->body[b];
        const double c = 1 - 2 * silt_square(body->q[3]), s = 2 * body->q[0] * body->q[3];
        const int n = silt_coupling_dem.outline(run->coupling, b, scene->fluid.size, NULL, 0);
        double *point = silt_alloc(3 * (size_t)n + 3, sizeof *point);
        silt_coupling_dem.outline(run->coupling, b, scene->fluid.size, point, n);
        for (int k = 0; k < n && body->solid; k++) {
            double x[3];
            silt_turn(body->q, false, point + 3 * k, x);
            for (int d = 0; d < 3; d++)
                x[d] += body->x[d];
            silt_nodes_add(&run->nodes, NODE_BODY, b, x);
        }
        for (int k = 0; k < n && !body->solid; k++) {
            const double x[2] = {body->x[0] + c * point[2 * k] - s * point[2 * k + 1],
                                 body->x[1] + s * point[2 * k] + c * point[2 * k + 1]};
            silt_nodes_add(&run->nodes, NODE_BODY, b, x);
        }
        free(point);
    }
    if (silt_seep_on(scene))
        silt_seep_fit(&run->seep, &run->bed, &run->nodes);
    for (int k = 0; k < run->bed.n_node; k++)
        if (run->bed.exposed[k])
            run->bed.fluid_node[k] = silt_nodes_add(&run->nodes, NODE_BED, k, run->bed.x[k]);
    silt_size_create(&run->size, scene, &run->walls);
    if (scene->fluid.cloud)
        SILT_TRY(silt_nodes_read(&run->nodes, scene, &run->walls, run_solid, &run->barrier, err));
    else
        silt_nodes_seed(&run->nodes, scene, &run->walls, run_solid, &run->barrier);
    SILT_TRY(silt_mesh_first(&run->mesh, &run->nodes, scene, &run->barrier, err));
    SILT_TRY(water_there(run, err));
    grains_small(run);
    silt_size_update(run->size, &run->nodes, &run->mesh);
    SILT_TRY(silt_run_pockets(run, err));
    if (silt_turbulence_model(scene) == TURBULENCE_SPALART_ALLMARAS) {
        silt_nodes_eddies(&run->nodes);
        silt_depth_update(&run->fluid.depth, scene, &run->walls, &run->nodes, &run->mesh, run->nodes.x);
        silt_eddy_start(scene, &run->nodes, &run->fluid.depth);
    }
    // nodes of the cloud that got no cell at the start are no drops: they hold no water
    silt_run_locate(run);
    return SILT_OK;
}
