// grains and bodies in a step: the water's load on them, their substeps, and what is told when these fail
#include "run.h"

#define SET_UP_EVERY 16  // steps, between the discrete elements' set-ups
#define SET_UP_LONG 4096 // of their steps, in one of the run

// The discrete elements are set up anew where a frame begins, and every sixteenth step: ten thousand grains cost 5 ms then, in
// place of 5 ms a step. Checkpoints are taken at such places only, so that a run that goes on from one has the same set-ups.
// Grains without water make long steps, beside which a set-up is nothing.
bool silt_run_set_up_due(const silt_run *run, double last) {
    const bool dry = !run->scene->fluid.on && run->coupling && last > SET_UP_LONG * silt_coupling_dem.step(run->coupling);
    return dry || run->tick == 0 || run->step % SET_UP_EVERY == 0;
}

silt_status silt_run_grains(silt_run *run, int n, bool again, silt_error *err) {
    silt_nodes moving = run->nodes; // with the velocity that the drag was solved with
    moving.v = run->fluid.w ? run->fluid.w : run->nodes.v;
    moving.x = run->fluid.x_mid ? run->fluid.x_mid : run->nodes.x; // where its pressure acted
    silt_coupling_dem.load(run->coupling, &moving, &run->mesh, run->dt);
    if (run->scene->grains.random_walk && run->fluid.mu)
        silt_coupling_dem.walk(run->coupling, &run->nodes, &run->mesh, run->fluid.mu, run->dt, run->step);
    if (run->scene->grains.gusts > 0 && run->fluid.mu)
        silt_coupling_dem.gusts(run->coupling, &run->nodes, &run->mesh, run->fluid.mu, run->time + run->dt);
    if (!again && !silt_run_set_up_due(run, run->dt_old))
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
