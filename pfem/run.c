// the time loop, and what stands before and after it
#include <errno.h>
#include <fcntl.h>
#include <omp.h>
#include <signal.h>
#include <sys/stat.h>
#include <unistd.h>

#include "run.h"

static volatile sig_atomic_t run_signal; // the last signal that asked for a checkpoint

static void on_signal(int number) { run_signal = number; }

static void phase_add(silt_run *run, silt_phase phase, double since) { run->phase[phase] += silt_seconds() - since; }

#define PHASE(name, ...)                                                                                               \
    do {                                                                                                               \
        const double since_ = silt_seconds();                                                                          \
        __VA_ARGS__;                                                                                                   \
        phase_add(run, PHASE_##name, since_);                                                                          \
    } while (0)

static void run_view(const silt_run *run, silt_view *view) {
    const silt_scene *scene = run->scene;
    *view = (silt_view){.scene = scene, .ledger = &run->ledger, .step = run->step, .time = run->time, .dt = run->dt};
    if (scene->fluid.on) {
        view->nodes = &run->nodes;
        view->mesh = &run->mesh;
        view->locator = &run->locator;
        view->solid = run->drag ? run->drag->solid : NULL;
        view->iterations = run->fluid.iterations;
    }
    if (scene->bed.on)
        view->bed = &run->bed;
    if (run->coupling) {
        view->grains = silt_coupling_dem.grains(run->coupling);
        view->bodies = silt_coupling_dem.bodies(run->coupling);
    }
    memcpy(view->wall, run->phase, sizeof view->wall);
}

// ---------------------------------------------------------------- the ledger

static void ledger_take(silt_run *run) {
    silt_ledger *ledger = &run->ledger;
    const silt_nodes *nodes = &run->nodes;
    const silt_scene *scene = run->scene;
    const double rho = scene->fluid.density;
    ledger->kinetic_energy = ledger->potential_energy = 0;
    memset(ledger->momentum, 0, sizeof ledger->momentum);
    ledger->mesh_volume = ledger->flying_volume = ledger->fluid_volume = 0;
    for (int e = 0; e < run->mesh.n_cell; e++) {
        const int *cell = run->mesh.cell[e];
        const double area = silt_cell_area(nodes->x, cell);
        double water = area, centre[2] = {0, 0};
        ledger->mesh_volume += area;
        for (int a = 0; a < 3; a++) {
            if (run->drag)
                water -= area * run->drag->solid[cell[a]] / 3;
            for (int d = 0; d < 2; d++)
                centre[d] += nodes->x[2 * cell[a] + d] / 3;
        }
        ledger->fluid_volume += water;
        for (int a = 0; a < 3; a++)
            for (int d = 0; d < 2; d++) {
                const double m = rho * water / 3, v = nodes->v[2 * cell[a] + d];
                ledger->momentum[d] += m * v;
                ledger->kinetic_energy += 0.5 * m * v * v;
            }
        ledger->potential_energy -= rho * water * (centre[0] * scene->gravity[0] + centre[1] * scene->gravity[1]);
    }
    for (int i = 0; i < nodes->count; i++) {
        if (run->mesh.wet[i])
            continue;
        const double volume = nodes->debt[i];
        ledger->flying_volume += volume;
        for (int d = 0; d < 2; d++) {
            ledger->momentum[d] += rho * volume * nodes->v[2 * i + d];
            ledger->kinetic_energy += 0.5 * rho * volume * silt_square(nodes->v[2 * i + d]);
            ledger->potential_energy -= rho * volume * nodes->x[2 * i + d] * scene->gravity[d];
        }
    }
    ledger->fluid_volume += ledger->flying_volume;
    ledger->fluid_mass = rho * ledger->fluid_volume;
    ledger->bed_mass = run->bed.solid_mass;
    ledger->pore_water_mass = run->bed.pore_water;
    ledger->grain_count = 0;
    ledger->grain_mass = 0;
    if (run->coupling) {
        const silt_grain_state *grains = silt_coupling_dem.grains(run->coupling);
        ledger->grain_count = grains->count + run->n_waiting;
        // summed with care: the sediment must close to rounding
        double carry = 0;
        for (int k = 0; k < grains->count + run->n_waiting; k++) {
            const double m = (k < grains->count ? grains->mass[k] : run->waiting[k - grains->count].mass) - carry;
            const double sum = ledger->grain_mass + m;
            carry = (sum - ledger->grain_mass) - m;
            ledger->grain_mass = sum;
        }
        int64_t count;
        silt_coupling_dem.left(run->coupling, &ledger->left_mass, &count);
    }
    if (run->step == 0) {
        ledger->initial_volume = ledger->fluid_volume;
        ledger->initial_sediment = ledger->bed_mass + ledger->grain_mass;
    }
    const double base = ledger->initial_volume + ledger->inflow_mass / rho;
    const double expected = base - ledger->outflow_mass / rho + ledger->pore_water_mass / rho;
    ledger->volume_error = scene->fluid.on && base > 0 ? (ledger->fluid_volume - expected) / base : 0;
    const double sediment = ledger->bed_mass + ledger->grain_mass + ledger->left_mass - ledger->initial_sediment;
    ledger->sediment_error = ledger->initial_sediment > 0 ? sediment / ledger->initial_sediment : 0;

    silt_summary *summary = &run->summary;
    summary->worst_volume_error = silt_max(summary->worst_volume_error, fabs(ledger->volume_error));
    summary->worst_sediment_error = silt_max(summary->worst_sediment_error, fabs(ledger->sediment_error));
    summary->worst_momentum_error = silt_max(summary->worst_momentum_error, ledger->momentum_error);
}

// ---------------------------------------------------------------- steps in time

// largest step that accuracy allows: courant number, cells that do not turn over, gravity, growth
static double step_wanted(const silt_run *run) {
    const silt_scene *scene = run->scene;
    const silt_nodes *nodes = &run->nodes;
    const double h = scene->fluid.size, g = hypot(scene->gravity[0], scene->gravity[1]);
    double dt = scene->time.step > 0 ? scene->time.step : HUGE_VAL;
    dt = silt_min(dt, scene->time.output);
    if (!scene->fluid.on)
        return dt;
    double fastest = 0;
    for (int i = 0; i < nodes->count; i++)
        if (nodes->kind[i] != NODE_CORNER && nodes->kind[i] != NODE_BED)
            fastest = silt_max(fastest, hypot(nodes->v[2 * i], nodes->v[2 * i + 1]));
    if (fastest > 0)
        dt = silt_min(dt, scene->time.cfl * h / fastest);
    if (g > 0)
        dt = silt_min(dt, scene->time.cfl * sqrt(h / g));
    if (run->dt > 0)
        dt = silt_min(dt, 1.5 * run->dt);

    // a cell may lose four fifths of its area; slivers do not decide
    const double least = 0.25 * dt;
    for (int e = 0; e < run->mesh.n_cell && dt > least; e++) {
        const int *cell = run->mesh.cell[e];
        const double area = silt_cell_area(nodes->x, cell);
        if (area < 0.1 * h * h)
            continue;
        double x[6];
        while (dt > least) {
            for (int a = 0; a < 3; a++)
                for (int d = 0; d < 2; d++)
                    x[2 * a + d] = nodes->x[2 * cell[a] + d] + dt * nodes->v[2 * cell[a] + d];
            if (silt_cell_area(x, (const int[3]){0, 1, 2}) > 0.2 * area)
                break;
            dt *= 0.8;
        }
    }
    return dt;
}

// next step: ends of frames are met exactly, and with grains it is a whole number of their steps
static int64_t step_choose(silt_run *run, double wanted) {
    const double output = run->scene->time.output;
    if (run->coupling) {
        const double small = silt_coupling_dem.step(run->coupling);
        const int64_t per_frame = (int64_t)floor(output / small + 0.5), left = per_frame - run->tick;
        int64_t n = (int64_t)floor(wanted / small);
        n = n < 1 ? 1 : n > left ? left : n;
        if (n < left && left < 2 * n)
            n = (left + 1) / 2; // two even steps rather than a long and a tiny one
        run->dt = (double)n * small;
        return n;
    }
    const double left = output - run->offset;
    const double pieces = silt_max(1, ceil(left / wanted - 1e-9));
    run->dt = pieces < 16 ? left / pieces : wanted;
    return 0;
}

static void clock_advance(silt_run *run, int64_t n) {
    const double output = run->scene->time.output;
    bool frame;
    if (run->coupling) {
        const double small = silt_coupling_dem.step(run->coupling);
        run->tick += n;
        frame = run->tick >= (int64_t)floor(output / small + 0.5);
        run->offset = (double)run->tick * small;
    } else {
        run->offset += run->dt;
        frame = run->offset >= output * (1 - 1e-12);
    }
    if (frame) {
        run->frame++;
        run->tick = 0;
        run->offset = 0;
    }
    run->time = (double)run->frame * output + run->offset;
    run->step++;
}

// ---------------------------------------------------------------- one step

static silt_status water_step(silt_run *run, int64_t *n, silt_error *err) {
    const silt_scene *scene = run->scene;
    for (int attempt = 0;; attempt++) {
        silt_status status = SILT_OK;
        silt_run_prescribe(run);
        if (run->coupling)
            PHASE(dem, status = silt_coupling_dem.prepare(run->coupling, &run->nodes, &run->mesh, run->dt, &run->drag, err));
        if (status != SILT_OK)
            return status;
        status = silt_fluid_step(&run->fluid, scene, &run->walls, &run->nodes, &run->mesh, run->drag, run->dt, err);
        run->phase[PHASE_assemble] += run->fluid.seconds_assemble;
        run->phase[PHASE_solve] += run->fluid.seconds_solve;
        if (status == SILT_OK)
            return SILT_OK;
        const bool least = run->coupling && *n <= 1;
        if (attempt >= scene->time.retries || least) {
            char why[sizeof err->text];
            snprintf(why, sizeof why, "%s", err ? err->text : "");
            if (err)
                *err = (silt_error){0};
            return silt_fail(err, SILT_FAILED, "step %lld at t = %.9g s gave up after %d tries, the last with dt = %.3g s: %s",
                             (long long)run->step + 1, run->time, attempt + 1, run->dt, why);
        }
        if (err)
            *err = (silt_error){0};
        run->summary.retries++;
        silt_pressure_forget(run->fluid.pressure);
        if (run->coupling) {
            *n /= 2;
            run->dt = (double)*n * silt_coupling_dem.step(run->coupling);
        } else
            run->dt *= 0.5;
    }
}

// what the water does to bodies: the reaction of their nodes, turned round
static void load_bodies(silt_run *run) {
    silt_body_state *bodies = silt_coupling_dem.bodies(run->coupling);
    for (int b = 0; b < bodies->count; b++) {
        memset(bodies->body[b].force, 0, sizeof bodies->body[b].force);
        memset(bodies->body[b].torque, 0, sizeof bodies->body[b].torque);
    }
    for (int i = 0; i < run->nodes.count; i++) {
        if (run->nodes.kind[i] != NODE_BODY || !run->mesh.wet[i])
            continue;
        struct silt_body *body = &bodies->body[run->nodes.owner[i]];
        const double fx = -run->fluid.reaction[2 * i], fy = -run->fluid.reaction[2 * i + 1];
        body->force[0] += fx;
        body->force[1] += fy;
        body->torque[2] += (run->nodes.x[2 * i] - body->x[0]) * fy - (run->nodes.x[2 * i + 1] - body->x[1]) * fx;
    }
    SILT_RESERVE(run->body_before, run->body_before_capacity, bodies->count + 1);
    memcpy(run->body_before, bodies->body, (size_t)bodies->count * sizeof *bodies->body);
    run->n_body_before = bodies->count;
}

static silt_status run_step(silt_run *run, silt_error *err) {
    const silt_scene *scene = run->scene;
    memset(run->phase, 0, sizeof run->phase);
    int64_t n = step_choose(run, step_wanted(run));

    SILT_RESERVE(run->x_old, run->x_old_capacity, 2 * run->nodes.count + 2);
    memcpy(run->x_old, run->nodes.x, 2 * (size_t)run->nodes.count * sizeof(double));
    if (scene->fluid.on)
        SILT_TRY(water_step(run, &n, err));
    else if (run->coupling)
        SILT_TRY(silt_coupling_dem.prepare(run->coupling, &run->nodes, &run->mesh, run->dt, &run->drag, err));

    if (scene->bed.on)
        PHASE(bed, {
            if (scene->fluid.on)
                silt_bed_wear(&run->bed, scene, &run->nodes, &run->mesh, &run->locator, run->dt);
            silt_run_release(run);
        });
    if (run->coupling) {
        silt_status status = SILT_OK;
        PHASE(dem, {
            silt_run_place(run);
            load_bodies(run);
            silt_nodes moving = run->nodes; // with the velocity that the drag was solved with
            moving.v = run->fluid.w ? run->fluid.w : run->nodes.v;
            silt_coupling_dem.load(run->coupling, &moving, &run->mesh, run->dt);
            status = silt_coupling_dem.start(run->coupling, (int)n, err);
            if (status == SILT_OK)
                status = silt_coupling_dem.finish(run->coupling, err);
        });
        SILT_TRY(status);
        if (scene->bed.on)
            PHASE(bed, status = silt_run_deposit(run, err));
        SILT_TRY(status);
    }
    if (scene->fluid.on) {
        SILT_TRY(silt_run_move(run, err));
        run->ledger.dissipation += run->fluid.dissipated;
        run->ledger.momentum_error =
            run->fluid.momentum_scale > 0 ? run->fluid.momentum_residual / run->fluid.momentum_scale : 0;
    }
    clock_advance(run, n);
    return SILT_OK;
}

// porosity at the new places, for the ledger and the frames
static silt_status step_close(silt_run *run, silt_error *err) {
    if (run->coupling && run->scene->fluid.on)
        SILT_TRY(silt_coupling_dem.prepare(run->coupling, &run->nodes, &run->mesh, run->dt, &run->drag, err));
    ledger_take(run);
    return SILT_OK;
}

static silt_status step_output(silt_run *run, silt_error *err) {
    // a row cannot hold the time that writing it takes: it shows that of the row before
    const double since = silt_seconds();
    run->phase[PHASE_output] = run->output_seconds;
    silt_view view;
    run_view(run, &view);
    silt_gauges_read(run->gauges, &view, run->gauge);
    SILT_TRY(silt_history_row(run->history, &view, run->gauge, err));
    if (run->tick == 0 && run->offset == 0)
        SILT_TRY(silt_frame_write(run->out, (int)run->frame, &view, err));
    for (int k = 0; k < PHASE_COUNT; k++)
        run->summary.phase[k] += run->phase[k];
    run->summary.node_steps += run->nodes.count;
    run->summary.iterations += run->fluid.iterations;
    run->summary.steps++;
    run->output_seconds = silt_seconds() - since;
    return SILT_OK;
}

static silt_status checkpoint_write(silt_run *run, silt_error *err) {
    // the history must reach the disk first: a checkpoint is never ahead of it
    SILT_TRY(silt_history_sync(run->history, err));
    char *path = silt_text("%s/checkpoint-%c.h5", run->out, 'a' + run->checkpoint_slot);
    const silt_status status = silt_run_save(run, path, err);
    free(path);
    if (status == SILT_OK)
        run->checkpoint_slot = 1 - run->checkpoint_slot;
    return status;
}

// ---------------------------------------------------------------- open and close

static bool run_solid(const void *context, const double x[2], double margin) {
    const silt_barrier *barrier = context;
    if (barrier->bed) {
        if (silt_bed_contains(barrier->bed, x))
            return true;
        for (int k = 0; k < barrier->bed->n_node; k++)
            if (barrier->bed->exposed[k] && hypot(barrier->bed->x[k][0] - x[0], barrier->bed->x[k][1] - x[1]) < margin)
                return true;
    }
    const silt_barrier bodies = {.bodies = barrier->bodies};
    if (silt_barrier_contains(&bodies, x))
        return true;
    for (int k = 0; margin > 0 && barrier->bodies && k < 8; k++) {
        const double probe[2] = {x[0] + margin * cos(k * M_PI / 4), x[1] + margin * sin(k * M_PI / 4)};
        if (silt_barrier_contains(&bodies, probe))
            return true;
    }
    return false;
}

void silt_coupling_def_fill(const silt_run *run, silt_coupling_def *def) {
    *def = (silt_coupling_def){.scene = run->scene, .walls = &run->walls, .bed = run->scene->bed.on ? &run->bed : NULL,
                               .worker = run->worker, .log = run->log};
    memcpy(def->lo, run->box_lo, sizeof def->lo);
    memcpy(def->hi, run->box_hi, sizeof def->hi);
}

// everything that walls, regions and bodies span, and room for splashes
static void run_box(silt_run *run) {
    const silt_scene *scene = run->scene;
    double lo[2] = {HUGE_VAL, HUGE_VAL}, hi[2] = {-HUGE_VAL, -HUGE_VAL};
#define SPAN(px, py)                                                                                                   \
    do {                                                                                                               \
        const double span_[2] = {(px), (py)};                                                                          \
        for (int d_ = 0; d_ < 2; d_++) {                                                                               \
            lo[d_] = silt_min(lo[d_], span_[d_]);                                                                      \
            hi[d_] = silt_max(hi[d_], span_[d_]);                                                                      \
        }                                                                                                              \
    } while (0)
    for (int s = 0; s < run->walls.count; s++) {
        SPAN(run->walls.from[s][0], run->walls.from[s][1]);
        SPAN(run->walls.to[s][0], run->walls.to[s][1]);
    }
    const silt_region *lists[2] = {scene->fluid.region, scene->bed.region};
    const int counts[2] = {scene->fluid.n_region, scene->bed.n_region};
    for (int l = 0; l < 2; l++)
        for (int r = 0; r < counts[l]; r++) {
            const silt_region *region = &lists[l][r];
            if (region->kind == REGION_BOX) {
                SPAN(region->lo[0], region->lo[1]);
                SPAN(region->hi[0], region->hi[1]);
            } else if (region->kind == REGION_CIRCLE) {
                SPAN(region->centre[0] - region->radius, region->centre[1] - region->radius);
                SPAN(region->centre[0] + region->radius, region->centre[1] + region->radius);
            }
            for (int k = 0; k < region->n_point; k++)
                SPAN(region->point[3 * k], region->point[3 * k + 1]);
        }
    for (int b = 0; b < scene->n_body; b++) {
        const double reach = silt_max(scene->body[b].scale, scene->body[b].height);
        SPAN(scene->body[b].at[0] - reach, scene->body[b].at[1] - reach);
        SPAN(scene->body[b].at[0] + reach, scene->body[b].at[1] + reach);
    }
    for (int k = 0; k < scene->grains.n_grain; k++) {
        const silt_grain_def *grain = &scene->grains.grain[k];
        SPAN(grain->at[0] - grain->diameter, grain->at[1] - grain->diameter);
        SPAN(grain->at[0] + grain->diameter, grain->at[1] + grain->diameter);
    }
#undef SPAN
    for (int d = 0; d < 2; d++) {
        const double margin = 0.5 * silt_max(hi[0] - lo[0], hi[1] - lo[1]);
        run->box_lo[d] = lo[d] - margin;
        run->box_hi[d] = hi[d] + margin;
    }
}

static silt_status run_first(silt_run *run, silt_error *err) {
    const silt_scene *scene = run->scene;
    if (scene->bed.on)
        SILT_TRY(silt_bed_create(&run->bed, scene, err));
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
    for (int b = 0; run->barrier.bodies && b < run->barrier.bodies->count; b++) {
        const struct silt_body *body = &run->barrier.bodies->body[b];
        const double c = 1 - 2 * silt_square(body->q[3]), s = 2 * body->q[0] * body->q[3];
        const int n = silt_coupling_dem.outline(run->coupling, b, scene->fluid.size, NULL, 0);
        double *point = silt_alloc(2 * (size_t)n + 2, sizeof *point);
        silt_coupling_dem.outline(run->coupling, b, scene->fluid.size, point, n);
        for (int k = 0; k < n; k++) {
            const double x[2] = {body->x[0] + c * point[2 * k] - s * point[2 * k + 1],
                                 body->x[1] + s * point[2 * k] + c * point[2 * k + 1]};
            silt_nodes_add(&run->nodes, NODE_BODY, b, x);
        }
        free(point);
    }
    for (int k = 0; k < run->bed.n_node; k++)
        if (run->bed.exposed[k])
            run->bed.fluid_node[k] = silt_nodes_add(&run->nodes, NODE_BED, k, run->bed.x[k]);
    silt_nodes_seed(&run->nodes, scene, &run->walls, run_solid, &run->barrier);
    SILT_TRY(silt_mesh_first(&run->mesh, &run->nodes, scene, &run->barrier, err));
    // nodes of the cloud that got no cell at the start are no drops: they hold no water
    silt_locator_build(&run->locator, &run->mesh, run->nodes.x, scene->fluid.size);
    return SILT_OK;
}

static void run_free(silt_run *run) {
    silt_coupling_dem.close(&run->coupling);
    silt_fluid_clear(&run->fluid);
    silt_mesh_clear(&run->mesh);
    silt_memory_clear(&run->memory);
    silt_locator_clear(&run->locator);
    silt_nodes_clear(&run->nodes);
    silt_bed_clear(&run->bed);
    silt_walls_clear(&run->walls);
    silt_gauges_free(&run->gauges);
    free(run->gauge);
    free(run->waiting);
    free(run->rest);
    free(run->freed);
    free(run->freed_area);
    free(run->grown);
    free(run->grown_area);
    free(run->body_before);
    free(run->x_old);
    free(run->map);
    free(run->out);
    free(run->worker);
    free(run->log);
}

// silt-dem stands beside the program, or in libexec of the installed tree
static char *worker_find(const char *asked) {
    if (asked)
        return silt_text("%s", asked);
    char self[4096];
    const ssize_t n = readlink("/proc/self/exe", self, sizeof self - 1);
    if (n <= 0)
        return silt_text("silt-dem");
    self[n] = 0;
    char *slash = strrchr(self, '/');
    *slash = 0;
    for (int k = 0; k < 3; k++) {
        char path[4200];
        snprintf(path, sizeof path, k == 0 ? "%s/silt-dem" : k == 1 ? "%s/../silt-dem" : "%s/../libexec/silt/silt-dem", self);
        if (access(path, X_OK) == 0)
            return silt_text("%s", path);
    }
    return silt_text("%s/silt-dem", self);
}

static void run_begin(silt_run *run, const silt_scene *scene, const silt_run_def *def, const char *out) {
    *run = (silt_run){.scene = scene, .def = *def};
    run->out = silt_text("%s", out);
    run->log = silt_text("%s/dem.log", out);
    run->worker = worker_find(def->worker);
    run->started = silt_seconds();
    run->summary.status = "running";
    if (def->threads > 0)
        omp_set_num_threads(def->threads);
    silt_walls_create(&run->walls, scene);
    run_box(run);
    run->gauge = silt_alloc((size_t)silt_gauges_count(scene) + 1, sizeof *run->gauge);
}

// ---------------------------------------------------------------- the loop

static silt_status run_loop(silt_run *run, silt_error *err) {
    const silt_scene *scene = run->scene;
    const double end = run->def.until > 0 ? run->def.until : scene->time.end;
    const double every = scene->time.checkpoint > 0 ? scene->time.checkpoint : 10 * scene->time.output;
    const int64_t frames_between = (int64_t)silt_max(1, floor(every / scene->time.output + 0.5));
    silt_status status = SILT_OK;
    silt_view view;

    while (run->time < end * (1 - 1e-12) && (scene->time.steps == 0 || run->step < scene->time.steps)) {
        status = run_step(run, err);
        if (status == SILT_OK)
            status = step_close(run, err);
        if (status == SILT_OK)
            status = step_output(run, err);
        if (status != SILT_OK)
            break;
        const bool frame = run->tick == 0 && run->offset == 0;
        if (run_signal) {
            const int number = run_signal;
            run_signal = 0;
            status = checkpoint_write(run, err);
            if (status == SILT_OK && number == SIGTERM)
                status = silt_fail(err, SILT_STOPPED, "stopped by a signal at t = %.9g s; a checkpoint is written, go on with: silt resume %s",
                                   run->time, run->out);
        } else if (frame && run->frame % frames_between == 0)
            status = checkpoint_write(run, err);
        if (status != SILT_OK)
            break;
        run_view(run, &view);
        if (!run->def.quiet)
            silt_progress(&view, end, silt_seconds() - run->started, false);
    }
    // the end of a run is a place to go on from too
    if (status == SILT_OK && !(run->tick == 0 && run->offset == 0 && run->frame % frames_between == 0))
        status = checkpoint_write(run, err);

    run->summary.status = status == SILT_OK ? "done" : status == SILT_STOPPED ? "stopped" : "failed";
    run->summary.message = status == SILT_OK || !err ? NULL : err->text;
    run->summary.seconds = silt_seconds() - run->started;
    run_view(run, &view);
    if (!run->def.quiet)
        silt_progress(&view, end, run->summary.seconds, true);
    silt_error late = {0};
    if (silt_history_close(&run->history, &late) != SILT_OK && status == SILT_OK) {
        status = late.status;
        if (err)
            *err = late;
    }
    late = (silt_error){0};
    if (silt_summary_write(run->out, &view, &run->summary, &late) != SILT_OK && status == SILT_OK) {
        status = late.status;
        if (err)
            *err = late;
    }
    return status;
}

static void signals_catch(void) {
    struct sigaction action = {.sa_handler = on_signal, .sa_flags = SA_RESTART};
    sigemptyset(&action.sa_mask);
    sigaction(SIGTERM, &action, NULL);
    sigaction(SIGUSR1, &action, NULL);
    run_signal = 0;
}

// an existing folder is refused unless told otherwise; then only what silt wrote is removed
static silt_status out_prepare(const char *out, bool force, silt_error *err) {
    if (mkdir(out, 0777) == 0)
        return SILT_OK;
    if (errno != EEXIST)
        return silt_fail(err, SILT_FAILED, "%s: cannot make the output folder: %s", out, strerror(errno));
    if (!force)
        return silt_fail(err, SILT_INPUT, "%s: exists already; name another folder with -o, replace it with --force, or go on with: silt resume %s",
                         out, out);
    const char *const old[] = {"checkpoint-a.h5", "checkpoint-b.h5", "summary.json", "run.log", "history.csv", "dem.log"};
    for (size_t k = 0; k < sizeof old / sizeof *old; k++) {
        char *path = silt_text("%s/%s", out, old[k]);
        unlink(path);
        free(path);
    }
    return silt_frame_cut(out, -1, err);
}

// the scene's folder name plus .out, in the current folder
static char *out_default(const silt_scene *scene) {
    char *full = realpath(scene->path, NULL);
    char *slash = full ? strrchr(full, '/') : NULL;
    if (slash)
        *slash = 0;
    const char *name = slash ? strrchr(full, '/') : NULL;
    char *out = silt_text("%s.out", name && name[1] ? name + 1 : "silt");
    free(full);
    return out;
}

silt_status silt_scene_run(const silt_scene *scene, const silt_run_def *def, silt_error *err) {
    silt_run state, *run = &state;
    char *out = def->out ? silt_text("%s", def->out) : out_default(scene);
    silt_status status = out_prepare(out, def->force, err);
    if (status != SILT_OK) {
        free(out);
        return status;
    }
    run_begin(run, scene, def, out);
    free(out);
    signals_catch();
    silt_view view;
    status = silt_verify_copy(scene, run->out, err);
    if (status == SILT_OK)
        status = run_first(run, err);
    run->dt = 0;
    if (status == SILT_OK)
        status = step_close(run, err);
    run_view(run, &view);
    if (status == SILT_OK)
        status = silt_gauges_create(&run->gauges, &view, err);
    if (status == SILT_OK)
        status = silt_history_create(&run->history, run->out, scene, err);
    if (status == SILT_OK)
        status = step_output(run, err);
    if (status == SILT_OK)
        status = run_loop(run, err);
    run_free(run);
    return status;
}

// the newest of the two checkpoints that can be read whole
static silt_status checkpoint_find(const char *out, silt_store **store, int64_t *step, int *slot, silt_error *err) {
    *store = NULL;
    *step = -1;
    silt_error first = {0};
    for (int k = 0; k < 2; k++) {
        char *path = silt_text("%s/checkpoint-%c.h5", out, 'a' + k);
        silt_store *candidate = NULL;
        int64_t at = -1;
        silt_error bad = {0};
        if (silt_store_open(&candidate, path, &bad) == SILT_OK &&
            silt_store_take(candidate, "run/step", STORE_LONG, 1, &at, &bad) == SILT_OK && at > *step) {
            silt_store_close(store);
            *store = candidate;
            *step = at;
            *slot = k;
        } else {
            silt_store_close(&candidate);
            if (!first.count)
                first = bad;
        }
        free(path);
    }
    if (!*store)
        return silt_fail(err, SILT_FAILED, "%s: no checkpoint to go on from: %s", out, first.text);
    return SILT_OK;
}

silt_status silt_run_resume(const silt_run_def *def, silt_error *err) {
    char *path = silt_text("%s/scene.yaml", def->out);
    silt_scene *scene = NULL;
    silt_store *store = NULL;
    int64_t step;
    int slot = 0;
    silt_status status = silt_scene_read(path, 0, NULL, &scene, err);
    free(path);
    if (status != SILT_OK)
        return status;
    silt_run state, *run = &state;
    run_begin(run, scene, def, def->out);
    signals_catch();
    status = checkpoint_find(def->out, &store, &step, &slot, err);
    if (status == SILT_OK)
        status = silt_run_load(run, store, err);
    silt_store_close(&store);
    run->checkpoint_slot = 1 - slot;
    if (status == SILT_OK)
        status = silt_frame_cut(run->out, (int)run->frame, err);
    if (status == SILT_OK)
        status = silt_history_reopen(&run->history, run->out, scene, run->step, err);
    if (status == SILT_OK)
        status = run_loop(run, err);
    run_free(run);
    silt_scene_free(&scene);
    return status;
}
