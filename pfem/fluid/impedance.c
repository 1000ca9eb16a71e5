// what the water of a step answers to a change of velocity on what it is held by: rigid modes of bodies
#include "fluid.h"

#define MODE_PASSES 4     // the second also takes the excess of the mass; more where viscosity is stiff
#define MODE_SLIDES 8     // the same where water slips on bodies: what the projected gradient lacks at the fourth is 1 % of a disc's added mass
#define MODE_ENOUGH 1e-4  // of the first divergence
#define MODE_DROP   1e-6  // of the residual of a velocity
#define MODE_STIFF  1e-3  // mu theta dt/(rho h^2) below which viscosity has no part in it
#define MODE_PLANE  1e-6  // of a pressure increment
#define MODE_SPACE  1e-3

// velocity of the free components from the force on the nodes, held components in place
static silt_status mode_velocity(silt_fluid *f, const silt_step *s, const double *force, double *w, silt_error *err) {
    const int D = f->dim;
    const double stiff = f->mu_max * f->theta * s->dt / (s->scene->fluid.density * silt_square(s->scene->fluid.size));
    if (stiff > MODE_STIFF && s->scene->fluid.scheme == SCHEME_IMPLICIT) {
        bool solved;
        silt_status status;
        SILT_CLOCKED(momentum, silt_momentum_look(f, s->mesh, w));
        SILT_CLOCKED(momentum, status = silt_momentum_solve(f, s, force, MODE_DROP, w, &solved, err));
        return status;
    }
    for (int i = 0; i < f->n_node; i++) {
        double old[3], fresh[3];
        for (int d = 0; d < D; d++) {
            old[d] = w[D * i + d];
            fresh[d] = force[D * i + d] / f->inertia[i];
        }
        silt_hold_project(f, i, old);
        silt_hold_project(f, i, fresh);
        for (int d = 0; d < D && s->mesh->wet[i]; d++)
            w[D * i + d] += fresh[d] - old[d];
    }
    return SILT_OK;
}

// divergence that is left; @return its sum of squares over nodes that keep their volume
static double mode_divergence(silt_fluid *f, const silt_step *s, const double *w, const double *p) {
    double square = 0;
    silt_assemble_projection(f, s->mesh, p);
    silt_assemble_continuity(f, s->mesh, NULL, NULL, w, p);
    for (int i = 0; i < f->n_node; i++) {
        f->residual[i] = s->mesh->wet[i] ? -f->residual[i] : 0;
        square += silt_square(f->residual[i]);
    }
    return square;
}

static void mode_excess(silt_fluid *f, const silt_step *s, const double *w, double *acceleration, double *excess) {
    const int n = f->dim * f->n_node;
    memset(excess, 0, (size_t)n * sizeof(double));
    if (s->drag)
        return;
    for (int k = 0; k < n; k++)
        acceleration[k] = w[k] / (f->theta * s->dt);
    silt_assemble_mass_excess(f, s->mesh, s->scene->fluid.density, acceleration, excess);
}

silt_status silt_fluid_mode(silt_fluid *f, const silt_step *s, const double *motion, double *w, double *p, silt_error *err) {
    const int D = f->dim;
    const size_t n = (size_t)f->n_node, bytes = (size_t)D * n * sizeof(double);
    double *excess = silt_alloc((size_t)D * n + 1, sizeof *excess), *force = f->reaction, first = 0;
    silt_status status = SILT_OK;
    // what does not hang on the velocity has no part in its change
    double *potential = f->potential;
    silt_seep *seep = f->seep;
    f->potential = NULL;
    f->seep = NULL;
    memset(p, 0, n * sizeof *p);
    memcpy(w, motion, bytes);
    for (int i = 0; i < f->n_node; i++)
        for (int d = 0; d < D && !s->mesh->wet[i]; d++)
            w[D * i + d] = 0;
    if (f->film)
        silt_film_squeeze(f->film, D, motion, NULL);
    const int passes = f->ride ? MODE_SLIDES : MODE_PASSES;
    for (int pass = 0; pass < passes && status == SILT_OK; pass++) {
        memcpy(force, excess, bytes);
        silt_assemble_pressure(f, s->mesh, p, force);
        status = mode_velocity(f, s, force, w, err);
        if (status != SILT_OK)
            break;
        const double left = mode_divergence(f, s, w, p);
        if (pass == 0)
            first = left;
        if (left <= silt_square(MODE_ENOUGH) * first)
            break;
        if (D == 2 && silt_stiff_ready(f->stiff, true))
            SILT_CLOCKED(solve, silt_stiff_correct(f->stiff, f, f->residual, f->increment, w));
        else {
            SILT_CLOCKED(solve, status = silt_pressure_solve(f->pressure, f, f->residual, D == 2 ? MODE_PLANE : MODE_SPACE, f->increment, err));
            if (status == SILT_OK)
                silt_fluid_correct(f, s, f->increment, w);
        }
        for (size_t i = 0; i < n && status == SILT_OK; i++)
            p[i] += f->increment[i];
        mode_excess(f, s, w, f->star, excess);
    }
    f->potential = potential;
    f->seep = seep;
    free(excess);
    return status;
}

void silt_fluid_mode_answer(silt_fluid *f, const silt_step *s, const double *w, const double *p, double *force, double *rate) {
    const int D = f->dim;
    double *potential = f->potential, *nought = f->star;
    silt_seep *seep = f->seep;
    silt_film *film = f->film;
    f->potential = NULL;
    f->seep = NULL;
    f->film = NULL;
    mode_excess(f, s, w, f->star, force);
    memset(f->scratch, 0, (size_t)(D * f->n_node) * sizeof(double));
    silt_assemble_viscous(f, s->mesh, w, 1, f->scratch);
    for (int i = 0; i < f->n_node; i++)
        for (int d = 0; d < D; d++)
            force[D * i + d] = s->mesh->wet[i] ? f->inertia[i] * w[D * i + d] + f->scratch[D * i + d] - force[D * i + d] : 0;
    memset(nought, 0, (size_t)(D * f->n_node) * sizeof(double));
    silt_assemble_projection(f, s->mesh, p);
    silt_assemble_continuity(f, s->mesh, NULL, NULL, nought, p);
    for (int i = 0; i < f->n_node; i++)
        rate[i] = s->mesh->wet[i] ? f->residual[i] : 0;
    f->potential = potential;
    f->seep = seep;
    f->film = film;
}
