// a step in time, and what is shown of it
#include <unistd.h>

#include "bed_law.h"
#include "run.h"

#define BED_Y_PLUS 5.0     // largest height of the first cell in wall units: the viscous sublayer
#define PRESSURE_SLOPE 0.2 // largest share by which output carries the pressure on to the end of the step

// what history and summary tell of the clocks; `rest` is none of them
#define PHASE_NONE PHASE_COUNT
static const silt_phase run_phase[CLOCK_COUNT] = {
    [CLOCK_triangulate] = PHASE_mesh, [CLOCK_decide] = PHASE_mesh,       [CLOCK_heal] = PHASE_mesh,
    [CLOCK_book] = PHASE_mesh,        [CLOCK_index] = PHASE_mesh,        [CLOCK_refine] = PHASE_mesh,
    [CLOCK_handover] = PHASE_mesh,    [CLOCK_assemble] = PHASE_assemble, [CLOCK_momentum] = PHASE_solve,
    [CLOCK_matrix] = PHASE_solve,     [CLOCK_analyse] = PHASE_solve,     [CLOCK_factor] = PHASE_solve,
    [CLOCK_apply] = PHASE_solve,      [CLOCK_solve] = PHASE_solve,       [CLOCK_bed] = PHASE_bed,
    [CLOCK_coupling] = PHASE_dem,     [CLOCK_grains] = PHASE_dem,        [CLOCK_move] = PHASE_move,
    [CLOCK_output] = PHASE_output,    [CLOCK_rest] = PHASE_NONE,
};

static void run_phases(silt_run *run) {
    double seconds[CLOCK_COUNT];
    silt_clock_read(seconds);
    memset(run->phase, 0, sizeof run->phase);
    for (int c = 0; c < CLOCK_COUNT; c++)
        if (run_phase[c] != PHASE_NONE)
            run->phase[run_phase[c]] += seconds[c];
}

void silt_run_view(silt_run *run, silt_view *view) {
    const silt_scene *scene = run->scene;
    *view = (silt_view){.scene = scene, .ledger = &run->ledger, .step = run->step, .time = run->time, .dt = run->dt};
    if (scene->fluid.on) {
        run->shown = run->nodes;
        if (run->n_shown == run->nodes.count)
            run->shown.p = run->p_shown;
        view->nodes = &run->shown;
        view->mesh = &run->mesh;
        view->locator = &run->locator;
        view->solid = run->drag ? run->drag->solid : NULL;
        view->iterations = run->fluid.iterations;
        view->wall_force = (const double(*)[3])run->wall_force;
    }
    if (scene->bed.on)
        view->bed = &run->bed;
    if (run->coupling) {
        view->grains = silt_coupling_dem.grains(run->coupling);
        view->bodies = silt_coupling_dem.bodies(run->coupling);
    }
    memcpy(view->wall, run->phase, sizeof view->wall);
}

// ---------------------------------------------------------------- steps in time

// next step: ends of frames are met exactly, and with grains it is a whole number of their steps
static int64_t step_choose(silt_run *run, double wanted) {
    const double output = run->scene->time.output;
    if (run->coupling) {
        const double small = silt_coupling_dem.step(run->coupling);
        const int64_t per_frame = (int64_t)floor(output / small + 0.5), left = per_frame - run->tick;
        int64_t n = (int64_t)floor(wanted / small * (1 + 1e-9));
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

// what a try at the water's step changes is put back: prescribed velocities, debts that spread
static void water_keep(silt_run *run) {
    const int D = silt_nodes_dim(&run->nodes);
    const size_t n = (size_t)run->nodes.count;
    SILT_RESERVE(run->v_old, run->v_old_capacity, D * run->nodes.count + D);
    SILT_RESERVE(run->debt_old, run->debt_old_capacity, run->nodes.count + 1);
    memcpy(run->v_old, run->nodes.v, (size_t)D * n * sizeof(double));
    memcpy(run->debt_old, run->nodes.debt, n * sizeof(double));
    SILT_RESERVE(run->p_old, run->p_old_capacity, run->nodes.count + 1);
    memcpy(run->p_old, run->nodes.p, n * sizeof(double));
    run->n_shown = -1;
    run->n_old = run->nodes.count;
}

static void water_restore(silt_run *run) {
    const size_t n = (size_t)run->nodes.count;
    memcpy(run->nodes.v, run->v_old, (size_t)silt_nodes_dim(&run->nodes) * n * sizeof(double));
    memcpy(run->nodes.debt, run->debt_old, n * sizeof(double));
    memcpy(run->nodes.p, run->p_old, n * sizeof(double));
    silt_pressure_forget(run->fluid.pressure);
    silt_stiff_forget(run->fluid.stiff);
}

silt_step silt_run_see(silt_run *run) {
    const silt_scene *scene = run->scene;
    silt_step step = {.scene = scene, .walls = &run->walls, .mesh = &run->mesh, .drag = run->drag,
                      .pockets = scene->fluid.air_pressure > 0 ? &run->pockets : NULL,
                      .seep = silt_seep_on(scene) ? &run->seep : NULL,
                      .nodes = &run->nodes, .time = run->time, .dt = run->dt};
    if (silt_run_bodies_free(run)) {
        step.body_velocity = run->body_velocity;
        step.body_shift = run->body_shift;
    }
    step.body_start = run->body_start;
    step.film = run->film;
    return step;
}

static silt_status water_gave_up(const silt_run *run, int tries, bool least, silt_error *err) {
    char why[sizeof err->text];
    snprintf(why, sizeof why, "%s", err ? err->text : "");
    if (err)
        *err = (silt_error){0};
    return silt_fail(err, SILT_FAILED, "step %lld at t = %.9g s gave up after %d tries, the last with dt = %.3g s%s: %s",
                     (long long)run->step + 1, run->time, tries, run->dt,
                     least ? ", which is one of the grains' and cannot be halved (contact.step, contact.youngs_modulus)" : "", why);
}

static silt_status water_step(silt_run *run, int64_t *n, silt_error *err) {
    const silt_scene *scene = run->scene;
    water_keep(run);
    if (silt_seep_on(scene))
        SILT_TRY(silt_seep_prepare(&run->seep, &run->bed, scene, &run->nodes, &run->mesh, err));
    for (int attempt = 0;; attempt++) {
        silt_status status = SILT_OK;
        silt_walls_move(&run->walls, scene, run->time + run->dt, run->dt);
        silt_run_prescribe(run);
        if (run->coupling)
            SILT_CLOCKED(coupling, status = silt_coupling_dem.prepare(run->coupling, &run->nodes, &run->mesh, run->dt, &run->drag, err));
        if (status != SILT_OK) {
            water_restore(run);
            return status;
        }
        run->fluid.last_try = (attempt > 0 && attempt >= scene->time.retries) || (run->coupling && *n <= 1);
        if (scene->n_body)
            silt_run_bodies_coast(run);
        const silt_step step = silt_run_see(run);
        silt_clock_to(CLOCK_assemble);
        status = silt_fluid_step(&run->fluid, &step, err);
        silt_clock_to(CLOCK_rest);
        if (status == SILT_OK && scene->n_body)
            SILT_CLOCKED(coupling, status = silt_run_bodies_load(run, &step, err));
        if (status == SILT_OK) {
            if (silt_seep_on(scene) && !silt_run_bodies_free(run))
                silt_seep_accept(&run->seep, &run->bed, scene, run->nodes.p);
            return SILT_OK;
        }
        water_restore(run);
        const bool least = run->coupling && *n <= 1;
        if (attempt >= scene->time.retries || least)
            return water_gave_up(run, attempt + 1, least, err);
        if (err)
            *err = (silt_error){0};
        run->summary.retries++;
        if (run->coupling) {
            *n /= 2;
            run->dt = (double)*n * silt_coupling_dem.step(run->coupling);
        } else
            run->dt *= 0.5;
    }
}

// a run that has lost its footing says so: steps that shrink without end, water that multiplies or vanishes
static silt_status step_sane(const silt_run *run, double wanted, silt_error *err) {
    const silt_scene *scene = run->scene;
    const silt_nodes *nodes = &run->nodes;
    if (!scene->fluid.on)
        return SILT_OK;
    const int D = silt_nodes_dim(nodes);
    const double g = silt_length(3, scene->gravity);
    double usual = silt_min(scene->time.output, g > 0 ? scene->time.cfl * sqrt(scene->fluid.size / g) : HUGE_VAL);
    if (scene->time.step > 0)
        usual = silt_min(usual, scene->time.step); // short steps that were asked for are no sign of trouble
    if (wanted < 1e-7 * usual) {
        int k = 0;
        for (int i = 0; i < nodes->count; i++)
            if (silt_length(D, nodes->v + D * i) > silt_length(D, nodes->v + D * k))
                k = i;
        return silt_fail(err, SILT_FAILED, "step %lld at t = %.9g s: a speed of %.3g m/s at (%g, %g) asks for steps of %.3g s; the run has lost its footing",
                         (long long)run->step + 1, run->time, silt_length(D, nodes->v + D * k), nodes->x[D * k],
                         nodes->x[D * k + 1], wanted);
    }
    if (fabs(run->ledger.volume_error) > 0.5)
        return silt_fail(err, SILT_FAILED, "step %lld at t = %.9g s: the water's volume is off by %.0f %%; no result after this is worth having",
                         (long long)run->step + 1, run->time, 100 * run->ledger.volume_error);
    return SILT_OK;
}

// The discrete elements failed: the step is cut as when the water's does, and tried again with what was worn off and released left so.
// @return false: there is nothing more to try, or no fault of the step
static bool grains_again(silt_run *run, int64_t *n, int attempt, silt_error *err) {
    silt_error late = {0};
    if (*n <= 1 || attempt >= run->scene->time.retries || silt_coupling_dem.recover(run->coupling, &late) != SILT_OK)
        return false;
    if (err)
        *err = (silt_error){0};
    if (run->scene->fluid.on)
        water_restore(run);
    *n /= 2;
    const double dt = (double)*n * silt_coupling_dem.step(run->coupling);
    run->wear_ahead += run->dt - dt;
    run->dt = dt;
    run->summary.retries++;
    return true;
}

// a gradient that one cell spans is no gradient at the bed: told once a run
static void bed_resolved(silt_run *run) {
    if (run->bed_told || run->bed.y_plus <= BED_Y_PLUS)
        return;
    run->bed_told = true;
    silt_run_warn(run, "the first cell over the bed is %.3g wall units high (y+), the gradient of bed.shear needs at most %g: the shear is "
                       "too low; finer water at the bed, or bed.shear: log-law", run->bed.y_plus, BED_Y_PLUS);
}

// a body that has left: where, and what went with it
static void bodies_gone(const silt_run *run) {
    const silt_body_state *bodies = silt_coupling_dem.bodies(run->coupling);
    for (int b = 0; b < run->n_body_before; b++) {
        const struct silt_body *body = &bodies->body[b];
        if (body->gone && !run->body_before[b].gone)
            silt_run_warn(run, "body '%s' has left at (%g, %g, %g) and is held there: %g kg, momentum (%g, %g, %g) kg m/s", run->scene->body[b].name,
                          body->x[0], body->x[1], body->x[2], body->mass, body->mass * body->v[0], body->mass * body->v[1],
                          body->mass * body->v[2]);
    }
}

static void bed_step(silt_run *run) {
    const double dt = silt_max(run->dt - run->wear_ahead, 0);
    run->wear_ahead = silt_max(run->wear_ahead - run->dt, 0);
    if (run->scene->fluid.on && dt > 0) {
        const silt_grain_state *grains = run->coupling && run->scene->bed.cover ? silt_coupling_dem.grains(run->coupling) : NULL;
        double *cover = grains && grains->count ? silt_alloc((size_t)run->bed.n_node + 1, sizeof *cover) : NULL;
        if (cover)
            silt_bed_cover(&run->bed, run->scene, grains, cover);
        silt_bed_wear(&run->bed, run->scene, &run->nodes, &run->mesh, &run->locator, cover, dt);
        free(cover);
    }
    bed_resolved(run);
    silt_run_release(run);
    silt_run_feed(run, dt);
}

// what went through the bed, and room for what it has become
static void seepage_book(silt_run *run) {
    silt_ledger *ledger = &run->ledger;
    if (!silt_seep_on(run->scene))
        return;
    ledger->seepage = run->seep.entered;
    ledger->seepage_volume += run->seep.entered * run->dt;
    ledger->seepage_lost += run->seep.lost * run->dt;
    ledger->outflow_mass += run->scene->fluid.density * run->seep.lost * run->dt;
    silt_seep_fit(&run->seep, &run->bed, &run->nodes);
    silt_seep_results(&run->seep, &run->bed, run->scene);
}

static silt_status run_step(silt_run *run, silt_error *err) {
    const silt_scene *scene = run->scene;
    silt_clock_reset();
    const double before = run->dt;
    run->dt_old = run->step > 0 ? before : 0;
    const double wanted = silt_run_pace(run);
    if (step_sane(run, wanted, err) != SILT_OK) {
        run->whole = false; // not worth a checkpoint
        run->back = -1;
        return SILT_FAILED;
    }
    int64_t n = step_choose(run, wanted);

    const int D = silt_nodes_dim(&run->nodes);
    SILT_RESERVE(run->x_old, run->x_old_capacity, D * (run->nodes.count + 1));
    if (run->nodes.count)
        memcpy(run->x_old, run->nodes.x, (size_t)(D * run->nodes.count) * sizeof(double));
    silt_status status = SILT_OK;
    for (int attempt = 0;; attempt++) {
        if (scene->fluid.on)
            status = water_step(run, &n, err);
        else if (run->coupling) {
            silt_walls_move(&run->walls, scene, run->time + run->dt, run->dt);
            status = silt_coupling_dem.prepare(run->coupling, &run->nodes, &run->mesh, run->dt, &run->drag, err);
        }
        if (status != SILT_OK) {
            run->dt = attempt == 0 ? before : run->dt;
            return status;
        }
        run->whole = false;
        if (scene->bed.on && attempt == 0)
            SILT_CLOCKED(bed, bed_step(run));
        if (!run->coupling)
            break;
        SILT_CLOCKED(coupling, {
            if (attempt == 0)
                silt_run_place(run);
            status = silt_run_grains(run, (int)n, attempt > 0, err);
        });
        const bool moved = status == SILT_OK;
        if (moved && scene->fluid.on && silt_run_bodies_free(run)) {
            const silt_step step = silt_run_see(run);
            silt_clock_to(CLOCK_assemble);
            status = silt_run_bodies_answer(run, &step, err);
            silt_clock_to(CLOCK_rest);
        }
        if (status == SILT_OK)
            break;
        if (!grains_again(run, &n, attempt, err)) {
            // the step may be a good one for another worker, with the same bits where the set-ups are the same
            run->back = moved ? run->back : run->back_set_up;
            return moved ? water_gave_up(run, attempt + 1, n <= 1, err) : silt_run_grains_failed(run, status, err);
        }
    }
    if (scene->fluid.on && silt_run_bodies_free(run) && silt_seep_on(scene))
        silt_seep_accept(&run->seep, &run->bed, scene, run->nodes.p);
    if (run->coupling && scene->bed.on)
        SILT_CLOCKED(bed, status = silt_run_deposit(run, err));
    SILT_TRY(status);
    if (scene->fluid.on) {
        silt_wall_forces(&run->walls, &run->nodes, &run->mesh, run->fluid.reaction, run->wall_force);
        if (run->film)
            silt_uplift_walls(run->uplift, run, run->wall_force);
        SILT_TRY(silt_run_move(run, err));
        seepage_book(run);
        run->ledger.dissipation += run->fluid.dissipated;
        run->ledger.external_work += run->fluid.worked;
    }
    if (run->coupling)
        bodies_gone(run);
    silt_run_balance(run);
    clock_advance(run, n);
    return SILT_OK;
}

// The solver's pressure belongs to the middle of the step. Output shows that of its end: carried on from the step before, node by
// node, by no more than a fifth of what it is (impacts are no slopes).
static void pressure_show(silt_run *run) {
    const silt_nodes *nodes = &run->nodes;
    SILT_RESERVE(run->p_shown, run->p_shown_capacity, nodes->count + 1);
    if (nodes->count)
        memcpy(run->p_shown, nodes->p, (size_t)nodes->count * sizeof(double));
    const bool known = run->dt_old > 0 && run->scene->fluid.theta < 0.75 && run->scene->fluid.shuffle == 0;
    for (int i = 0; known && i < run->n_old; i++) {
        const int now = run->map[i];
        if (now < 0 || !run->mesh.wet[now] || run->p_old[i] == 0)
            continue;
        const double p = nodes->p[now], most = PRESSURE_SLOPE * silt_max(fabs(p), fabs(run->p_old[i]));
        run->p_shown[now] += silt_clamp((p - run->p_old[i]) * run->dt / (run->dt + run->dt_old), -most, most);
    }
    run->n_shown = nodes->count;
}

// porosity at the new places, for the ledger and the frames
silt_status silt_run_measure(silt_run *run, silt_error *err) {
    silt_status status = SILT_OK;
    if (run->coupling && run->scene->fluid.on)
        SILT_CLOCKED(coupling,
                     status = silt_coupling_dem.prepare(run->coupling, &run->nodes, &run->mesh, 0, &run->drag, err));
    SILT_TRY(status);
    silt_run_ledger(run);
    if (run->scene->fluid.on)
        pressure_show(run);
    return SILT_OK;
}

// water that is owed is not lost, but where there is so much of it the cells are too large for what it does: told once a run
static void volume_held(silt_run *run) {
    const silt_ledger *ledger = &run->ledger;
    if (run->volume_told || !run->scene->fluid.on || !(fabs(ledger->volume_error) > run->scene->bounds.volume))
        return;
    run->volume_told = true;
    silt_run_warn(run, "the water's volume is off by %.3g %%, %.3g m3 of it are owed and come back later: the cells are too large for what the water "
                       "does there; smaller fluid.size", 100 * ledger->volume_error, ledger->volume_owed);
}

silt_status silt_run_output(silt_run *run, silt_error *err) {
    // a row cannot hold the time that writing it takes: it shows that of the row before
    run_phases(run);
    run->phase[PHASE_output] = run->output_seconds;
    silt_clock_to(CLOCK_output);
    silt_view view;
    silt_run_view(run, &view);
    silt_gauges_read(run->gauges, &view, run->gauge);
    run->back = -1; // where rows cannot be written checkpoints cannot either
    if (!run->again)
        SILT_TRY(silt_history_row(run->history, &view, run->gauge, err));
    if (run->tick == 0 && run->offset == 0 && !run->again)
        SILT_TRY(silt_frame_write(run->out, (int)run->frame, &view, err));
    for (int k = 0; k < PHASE_COUNT; k++)
        run->summary.phase[k] += run->phase[k];
    run->summary.node_steps += run->nodes.count;
    run->summary.iterations += run->fluid.iterations;
    if (run->fluid.iterations > run->summary.most_iterations)
        run->summary.most_iterations = run->fluid.iterations;
    run->summary.steps++;
    run->whole = true;
    run->back = run->step;
    run->back_set_up = silt_run_set_up_due(run, run->dt) ? run->step : run->back_set_up;
    double seconds[CLOCK_COUNT];
    silt_clock_read(seconds);
    run->output_seconds = seconds[CLOCK_output];
    silt_clock_to(CLOCK_rest);
    return SILT_OK;
}

silt_status silt_run_advance(silt_run *run, silt_error *err) {
    SILT_TRY(run_step(run, err));
    SILT_TRY(silt_run_measure(run, err));
    volume_held(run);
    return silt_run_output(run, err);
}

// ---------------------------------------------------------------- open and close

void silt_run_free(silt_run *run) {
    silt_coupling_dem.close(&run->coupling);
    silt_fluid_clear(&run->fluid);
    silt_size_free(&run->size);
    silt_air_clear(&run->air);
    silt_pockets_clear(&run->pockets);
    free(run->wall_force);
    silt_mesh_clear(&run->mesh);
    silt_memory_clear(&run->memory);
    silt_locator_clear(&run->locator);
    silt_nodes_clear(&run->nodes);
    silt_bed_clear(&run->bed);
    silt_seep_clear(&run->seep);
    silt_walls_clear(&run->walls);
    silt_gauges_free(&run->gauges);
    silt_history_close(&run->history, NULL);
    if (run->lock >= 0)
        close(run->lock);
    free(run->gauge);
    free(run->waiting);
    free(run->rest);
    free(run->owed);
    free(run->pick);
    free(run->freed);
    free(run->freed_area);
    free(run->grown);
    free(run->grown_area);
    free(run->body_before);
    free(run->body_after);
    free(run->body_velocity);
    free(run->body_shift);
    free(run->body_start);
    free(run->body_carry);
    free(run->body_water);
    free(run->body_inertia);
    silt_uplift_free(&run->uplift);
    free(run->x_old);
    free(run->p_old);
    free(run->p_shown);
    free(run->v_old);
    free(run->debt_old);
    free(run->map);
    free(run->out);
    free(run->worker);
    free(run->log);
    free(run->trace);
}
