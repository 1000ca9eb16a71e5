// the velocity that a step starts from: free of divergence, and what that does to bodies
#include "fluid.h"

#define FLUID_IMPACT 1.0 // energy that the first projection may give, over that of the water at bodies' nodes, before it is an impact

static double kinetic_energy(const silt_fluid *f, const silt_step *s, const double *v) {
    double sum = 0;
    for (int i = 0; i < f->n_node; i++)
        for (int d = 0; d < f->dim && s->mesh->wet[i]; d++)
            sum += 0.5 * f->mass[i] * silt_square(v[f->dim * i + d]);
    return sum;
}

// The impulse on bodies of what makes the first velocity free of divergence, with f->scratch as silt_fluid_correct leaves it. Where a body
// strikes water it is most of the blow: the cells that come have the water's velocity on one side and the body's on the other. What a scene
// gives at its start is made free of divergence without: the field is what the scene means, and no blow.
static void start_blow(silt_fluid *f, const silt_step *s) {
    const int D = f->dim;
    if (!f->blow || !(s->time > 0))
        return;
    for (int i = 0; i < f->n_node; i++) {
        double held[3], loose[3];
        for (int d = 0; d < D; d++)
            held[d] = loose[d] = s->mesh->wet[i] && s->nodes->kind[i] == NODE_BODY ? f->scratch[D * i + d] : 0;
        silt_hold_project(f, i, loose);
        for (int d = 0; d < D; d++)
            f->blow[D * i + d] = -f->theta * s->dt * (held[d] - loose[d]);
    }
}

// The trapezoidal rule keeps whatever divergence the first velocity has and turns its sign from step to step: remeshing and
// the mesh's motion put some in, so it is taken out first, on the mesh where the nodes are (projected Runge-Kutta method for
// index-2 systems: Ascher and Petzold, SIAM J. Numer. Anal. 28, 1991).
static silt_status project_start(silt_fluid *f, const silt_step *s, const double *p, silt_error *err) {
    const int D = f->dim;
    double *v = s->nodes->v;
    silt_assemble_geometry(f, s, 0);
    for (int i = 0; i < f->n_node; i++)
        if (s->mesh->wet[i] && !silt_fluid_own_start(s, i))
            silt_hold_turn(f, i, v + D * i);
    silt_assemble_projection(f, s->mesh, p);
    const double before = kinetic_energy(f, s, v);
    // once: what is left is the smoothing's, and more of it makes the pressure rougher
    silt_assemble_continuity(f, s->mesh, s->drag, NULL, v, p);
    SILT_TRY(silt_fluid_increment(f, s, false, 1e-2, err));
    silt_fluid_correct(f, s, f->increment, v);
    start_blow(f, s);
    f->projected = before - kinetic_energy(f, s, v);
    for (int i = 0; i < f->n_node; i++)
        if (s->mesh->wet[i]) {
            memcpy(f->w + D * i, v + D * i, (size_t)D * sizeof(double));
            if (silt_fluid_own_start(s, i))
                silt_hold_replace(f, i, f->given + D * i, f->w + D * i);
        }
    return SILT_OK;
}

// kinetic energy of the water's share at nodes of bodies
static double body_energy(const silt_fluid *f, const silt_step *s, const double *v) {
    double sum = 0;
    for (int i = 0; i < f->n_node; i++)
        for (int d = 0; d < f->dim && s->mesh->wet[i] && silt_fluid_own_start(s, i); d++)
            sum += 0.5 * f->mass[i] * silt_square(v[f->dim * i + d]);
    return sum;
}

// What makes the start free of divergence comes from nowhere: right for what remeshing did, not where a body has just met the water,
// which it then sets in motion for nothing (a light box at 10 m/s: 700 J where it had 200). That step is backward Euler's from the
// start as it is: the pressure of the impact brakes the body.
silt_status silt_fluid_start(silt_fluid *f, const silt_step *s, const double *p, silt_error *err) {
    const int D = f->dim;
    const size_t bytes = (size_t)D * (size_t)f->n_node * sizeof(double);
    double *v = s->nodes->v;
    if (s->body_velocity)
        memcpy(f->v_first, v, bytes);
    SILT_TRY(project_start(f, s, p, err));
    if (!s->body_velocity || s->time == 0 || -f->projected <= FLUID_IMPACT * body_energy(f, s, f->v_first))
        return SILT_OK;
    silt_status status;
    memcpy(v, f->v_first, bytes);
    for (int i = 0; i < f->n_node; i++)
        if (s->mesh->wet[i]) {
            memcpy(f->w + D * i, v + D * i, (size_t)D * sizeof(double));
            silt_hold_turn(f, i, f->w + D * i);
        }
    f->projected = 0;
    f->theta = 1;
    if (f->blow)
        memset(f->blow, 0, bytes);
    silt_assemble_geometry(f, s, s->dt);
    SILT_CLOCKED(matrix, status = silt_pressure_factor(f->pressure, f, s, err));
    return status;
}
