// grains and bodies in a step: the water's load on them, their substeps, and what is told when these fail
#include "run.h"

#define SET_UP_EVERY 16 // steps, between the discrete elements' set-ups

// The discrete elements are set up anew where a frame begins, and every sixteenth step: ten thousand grains cost 5 ms then, in
// place of 5 ms a step. Checkpoints are taken at such places only, so that a run that goes on from one has the same set-ups.
bool silt_run_set_up_due(const silt_run *run) { return run->tick == 0 || run->step % SET_UP_EVERY == 0; }

// force and torque of the water on body b: the reaction of its nodes, turned round. @return false: it is dry
static bool water_on_body(const silt_run *run, int b, double force[3], double torque[3]) {
    const struct silt_body *body = &silt_coupling_dem.bodies(run->coupling)->body[b];
    const int D = silt_nodes_dim(&run->nodes);
    bool wet = false;
    memset(force, 0, 3 * sizeof *force);
    memset(torque, 0, 3 * sizeof *torque);
    for (int i = 0; i < run->nodes.count; i++) {
        if (run->nodes.kind[i] != NODE_BODY || run->nodes.owner[i] != b || !run->mesh.wet[i])
            continue;
        double own[3] = {0}, arm[3] = {0};
        for (int d = 0; d < D; d++) {
            own[d] = -run->fluid.reaction[D * i + d];
            arm[d] = run->nodes.x[D * i + d] - body->x[d];
            force[d] += own[d];
        }
        for (int d = D == 3 ? 0 : 2; d < 3; d++)
            torque[d] += arm[(d + 1) % 3] * own[(d + 2) % 3] - arm[(d + 2) % 3] * own[(d + 1) % 3];
        wet = true;
    }
    return wet;
}

// m, the farthest point of a body from its centroid; kg m2, its smallest moment of inertia
static double body_reach(const silt_run *run, const struct silt_body *body) {
    const int D = silt_nodes_dim(&run->nodes);
    double reach = 0;
    for (int k = 0; k < body->n_point; k++)
        reach = silt_max(reach, silt_length(D, body->point + D * k));
    return reach;
}

static double body_inertia(const silt_run *run, const struct silt_body *body) {
    return silt_nodes_dim(&run->nodes) == 3 ? silt_min(body->inertia[0], silt_min(body->inertia[1], body->inertia[2])) : body->inertia[2];
}

// a force that would carry a free body over a cell from rest, or turn it as far, is none: the water's step has failed. LIGGGHTS
// would lose the body without a word.
silt_status silt_run_loads_sane(const silt_run *run, silt_error *err) {
    const silt_scene *scene = run->scene;
    const silt_body_state *bodies = run->coupling ? silt_coupling_dem.bodies(run->coupling) : NULL;
    for (int b = 0; bodies && b < bodies->count; b++) {
        const struct silt_body *body = &bodies->body[b];
        double force[3], torque[3];
        if (scene->body[b].motion != MOTION_FREE || !water_on_body(run, b, force, torque))
            continue;
        const double way = silt_square(run->dt) * (silt_length(3, force) / body->mass + silt_length(3, torque) * body_reach(run, body) / body_inertia(run, body));
        if (!(way < scene->fluid.size))
            return silt_fail(err, SILT_FAILED, "the water's force (%.3g, %.3g, %.3g) N and torque %.3g N m would throw body '%s' at (%g, %g, %g) over %.2g cells in a step",
                             force[0], force[1], force[2], silt_length(3, torque), scene->body[b].name, body->x[0], body->x[1], body->x[2],
                             way / scene->fluid.size);
    }
    return SILT_OK;
}

// What the water does to bodies. The water saw the body's last change of speed
// as its acceleration and answers with its added mass, and with theta below 1 it rings on: the body takes only the share of
// a new force that leaves this loop stable whatever its contacts do; a steady force comes through whole. before: last
// step, s. again: the step was cut
static void load_bodies(silt_run *run, double before, bool again) {
    silt_body_state *bodies = silt_coupling_dem.bodies(run->coupling);
    if (bodies->count == 0)
        return;
    SILT_RESERVE(run->body_load, run->body_load_capacity, bodies->count + 1);
    for (int b = 0; b < bodies->count; b++)
        for (int d = 0; d < 6; d++) {
            double *load = d < 3 ? &bodies->body[b].force[d] : &bodies->body[b].torque[d - 3];
            if (again)
                *load = run->body_load[b][d];
            run->body_load[b][d] = *load;
        }
    const double rho = run->scene->fluid.density, theta = run->scene->fluid.theta;
    const double ratio = (before > 0 ? silt_clamp(before / run->dt, 1, 20) : 1) / theta;
    const double most = silt_max(2 - 1 / theta, 0.1); // half of what the linear loop bears
    const bool space = silt_nodes_dim(&run->nodes) == 3;
    for (int b = 0; b < bodies->count; b++) {
        struct silt_body *body = &bodies->body[b];
        double force[3], torque[3];
        const bool wet = water_on_body(run, b, force, torque);
        const double reach = body_reach(run, body), disc = rho * M_PI * silt_square(reach);
        // added mass and inertia: those of the disc around it, in space half the sphere's water
        const double added = space ? 2.0 / 3.0 * disc * reach : disc, turned = (space ? 0.2 : 0.25) * added * silt_square(reach);
        const bool held = run->scene->body[b].motion != MOTION_FREE; // no loop
        const double share = held ? 1 : most / (1 + ratio * added / body->mass);
        const double twist = held ? 1 : most / (1 + ratio * turned / body_inertia(run, body));
        for (int d = 0; d < 3; d++) {
            body->force[d] = wet ? body->force[d] + share * (force[d] - body->force[d]) : 0;
            body->torque[d] = wet ? body->torque[d] + twist * (torque[d] - body->torque[d]) : 0;
        }
    }
    SILT_RESERVE(run->body_before, run->body_before_capacity, bodies->count + 1);
    memcpy(run->body_before, bodies->body, (size_t)bodies->count * sizeof *bodies->body);
    run->n_body_before = bodies->count;
}

silt_status silt_run_grains(silt_run *run, int n, double before, bool again, silt_error *err) {
    load_bodies(run, before, again);
    silt_nodes moving = run->nodes; // with the velocity that the drag was solved with
    moving.v = run->fluid.w ? run->fluid.w : run->nodes.v;
    moving.x = run->fluid.x_mid ? run->fluid.x_mid : run->nodes.x; // where its pressure acted
    silt_coupling_dem.load(run->coupling, &moving, &run->mesh, run->dt);
    if (run->scene->grains.random_walk && run->fluid.mu)
        silt_coupling_dem.walk(run->coupling, &run->nodes, &run->mesh, run->fluid.mu, run->dt, run->step);
    if (run->scene->grains.gusts > 0 && run->fluid.mu)
        silt_coupling_dem.gusts(run->coupling, &run->nodes, &run->mesh, run->fluid.mu, run->time + run->dt);
    if (!again && !silt_run_set_up_due(run))
        silt_coupling_dem.keep(run->coupling);
    SILT_TRY(silt_coupling_dem.start(run->coupling, n, err));
    return silt_coupling_dem.finish(run->coupling, err);
}

// what the discrete elements say, with the step and the speed and load of every body that could be the cause
silt_status silt_run_grains_failed(const silt_run *run, silt_status status, silt_error *err) {
    if (!err)
        return status;
    char why[sizeof err->text];
    snprintf(why, sizeof why, "%s", err->text);
    *err = (silt_error){0};
    silt_fail(err, status, "step %lld at t = %.9g s, dt = %.3g s: %s", (long long)run->step + 1, run->time, run->dt, why);
    const silt_body_state *bodies = silt_coupling_dem.bodies(run->coupling);
    for (int b = 0; b < bodies->count; b++) {
        const struct silt_body *body = &bodies->body[b];
        const size_t used = strlen(err->text);
        snprintf(err->text + used, sizeof err->text - used, "\nbody '%s' was at (%g, %g) with the velocity (%.3g, %.3g) m/s; force of the water (%.3g, %.3g) N",
                 run->scene->body[b].name, body->x[0], body->x[1], body->v[0], body->v[1], body->force[0], body->force[1]);
    }
    return status;
}
