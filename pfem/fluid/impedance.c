// what the water of a step answers to a change of velocity on what it is held by: rigid modes of bodies
#include "fluid.h"

#define MODE_DIRECTIONS 60 // of conjugate gradients, at most
#define MODE_ENOUGH_PLANE 1e-3 // of the residual of a pressure at its start: the inertia is right to the square of that
#define MODE_ENOUGH_SPACE 1e-2
#define MODE_DROP   1e-6  // of the residual of a velocity
#define MODE_STIFF  1e-3  // mu theta dt/(rho h^2) below which viscosity has no part in it
#define MODE_PLANE  1e-6  // of what the matrix before it is solved to
#define MODE_SPACE  1e-3

/** room for one mode */
typedef struct mode_room {
    double *one, *two, *z, *d, *kd, *before; // owned, velocities and pressures
} mode_room;

void silt_mode_clear(silt_mode *mode) {
    free(mode->motion);
    free(mode->force);
    free(mode->load);
    free(mode->p);
    free(mode->left);
    *mode = (silt_mode){0};
}

static bool viscid(const silt_fluid *f, const silt_step *s) {
    const double stiff = f->mu_max * f->theta * s->dt / (s->scene->fluid.density * silt_square(s->scene->fluid.size));
    return stiff > MODE_STIFF && s->scene->fluid.scheme == SCHEME_IMPLICIT;
}

// free components of a force over the inertia of their nodes; out += that
static void add_lumped(const silt_fluid *f, const silt_step *s, const double *force, double *out) {
    const int D = f->dim;
    for (int i = 0; i < f->n_node; i++) {
        double v[3];
        for (int d = 0; d < D; d++)
            v[d] = s->mesh->wet[i] ? force[D * i + d] / f->inertia[i] : 0;
        silt_hold_project(f, i, v);
        for (int d = 0; d < D; d++)
            out[D * i + d] += v[d];
    }
}

// Force that turns the lumped mass towards the consistent one, for a change w of the step's velocity: the step takes it once, from what
// the lumped mass does.
static void mode_excess(silt_fluid *f, const silt_step *s, const double *w, double *out) {
    const int n = f->dim * f->n_node;
    memset(out, 0, (size_t)n * sizeof(double));
    if (s->drag)
        return;
    for (int k = 0; k < n; k++)
        f->star[k] = w[k] / (f->theta * s->dt);
    silt_assemble_mass_excess(f, s->mesh, s->scene->fluid.density, f->star, out);
}

// velocity of the free components from `force`, with those of w that are held
static silt_status mode_velocity(silt_fluid *f, const silt_step *s, const double *force, double *w, silt_error *err) {
    silt_status status;
    bool solved;
    SILT_CLOCKED(momentum, silt_momentum_look(f, s->mesh, w));
    SILT_CLOCKED(momentum, status = silt_momentum_solve(f, s, force, MODE_DROP, w, &solved, err));
    return status;
}

// nodes whose pressure has a say in the mode
static bool has_say(const silt_fluid *f, const silt_step *s, int i) {
    const bool given = s->scene->fluid.pressure == PRESSURE_LAPLACIAN && s->mesh->surface[i];
    return s->mesh->wet[i] && f->mobile[i] <= 1 && !given;
}

// what continuity makes of a velocity, and a pressure; out is less than nought where water gathers
static void mode_lack(silt_fluid *f, const silt_step *s, const double *w, const double *p, double *out) {
    silt_assemble_projection(f, s->mesh, p);
    silt_assemble_continuity(f, s->mesh, NULL, NULL, w, p);
    for (int i = 0; i < f->n_node; i++)
        out[i] = has_say(f, s, i) ? f->residual[i] : 0;
}

// The pressure's operator: what continuity makes of p and of the velocity that it drives. Symmetric, not negative; after silt_film_still.
static silt_status mode_apply(silt_fluid *f, const silt_step *s, const double *p, mode_room *room, double *out, silt_error *err) {
    const size_t bytes = (size_t)(f->dim * f->n_node) * sizeof(double);
    double *w = room->one, *force = room->two;
    memset(force, 0, bytes);
    memset(w, 0, bytes);
    silt_assemble_pressure(f, s->mesh, p, force);
    add_lumped(f, s, force, w);
    mode_excess(f, s, w, f->force);
    if (viscid(f, s)) {
        memset(w, 0, bytes);
        SILT_TRY(mode_velocity(f, s, force, w, err));
    }
    add_lumped(f, s, f->force, w);
    mode_lack(f, s, w, p, out);
    return SILT_OK;
}

// the step's own matrix, nearly
static silt_status mode_precondition(silt_fluid *f, const silt_step *s, const double *r, double *z, silt_error *err) {
    silt_status status = SILT_OK;
    if (f->dim == 2 && silt_stiff_ready(f->stiff, true))
        SILT_CLOCKED(solve, silt_stiff_correct(f->stiff, f, r, z, f->star));
    else
        SILT_CLOCKED(solve, status = silt_pressure_solve(f->pressure, f, r, f->dim == 2 ? MODE_PLANE : MODE_SPACE, z, err));
    for (int i = 0; i < f->n_node; i++)
        z[i] = has_say(f, s, i) ? z[i] : 0;
    return status;
}

// Pressure of the mode from what continuity lacks at first: conjugate gradients. In space the matrix before them is solved by some of
// their own, so that a direction is made orthogonal to the one before it by itself.
static silt_status mode_pressure(silt_fluid *f, const silt_step *s, silt_mode *mode, double enough, mode_room *room, silt_error *err) {
    const int n = f->n_node;
    double *r = mode->left, *z = room->z, *d = room->d, *kd = room->kd, *before = room->before;
    memcpy(r, mode->load, (size_t)n * sizeof *r);
    SILT_TRY(mode_precondition(f, s, r, z, err));
    memcpy(d, z, (size_t)n * sizeof *d);
    double rz = silt_dot(n, r, z);
    const double least = silt_square(enough) * rz;
    for (mode->directions = 0; mode->directions < MODE_DIRECTIONS && rz > least; mode->directions++) {
        SILT_TRY(mode_apply(f, s, d, room, kd, err));
        const double dkd = silt_dot(n, d, kd);
        if (!(dkd > 0)) // rounding
            break;
        const double way = silt_dot(n, d, r) / dkd;
        memcpy(before, r, (size_t)n * sizeof *r);
        for (int i = 0; i < n; i++) {
            mode->p[i] += way * d[i];
            r[i] -= way * kd[i];
        }
        SILT_TRY(mode_precondition(f, s, r, z, err));
        const double next = silt_dot(n, r, z), turn = (next - silt_dot(n, before, z)) / rz;
        for (int i = 0; i < n; i++)
            d[i] = z[i] + turn * d[i];
        rz = next;
    }
    return SILT_OK;
}

// the motion with what it brings about without a pressure: the force that holds it, and what continuity lacks then
static silt_status mode_begin(silt_fluid *f, const silt_step *s, silt_mode *mode, mode_room *room, silt_error *err) {
    const int D = f->dim, n = D * f->n_node;
    double *w = room->one;
    for (int i = 0; i < f->n_node; i++)
        for (int d = 0; d < D; d++)
            w[D * i + d] = s->mesh->wet[i] ? mode->motion[D * i + d] : 0;
    mode_excess(f, s, w, mode->force);
    memcpy(f->force, mode->force, (size_t)n * sizeof(double));
    for (int i = 0; i < f->n_node; i++)
        for (int d = 0; d < D; d++)
            mode->force[D * i + d] = f->inertia[i] * w[D * i + d] - mode->force[D * i + d];
    if (viscid(f, s)) {
        memset(room->two, 0, (size_t)n * sizeof(double));
        SILT_TRY(mode_velocity(f, s, room->two, w, err));
    }
    silt_assemble_viscous(f, s->mesh, w, 1, mode->force);
    add_lumped(f, s, f->force, w);
    if (f->film)
        silt_film_squeeze(f->film, D, mode->motion, NULL);
    mode_lack(f, s, w, mode->p, mode->load);
    for (int i = 0; i < f->n_node; i++)
        mode->load[i] = -mode->load[i];
    if (f->film)
        silt_film_squeeze(f->film, D, NULL, NULL);
    return SILT_OK;
}

silt_status silt_fluid_mode(silt_fluid *f, const silt_step *s, const double *motion, double enough, silt_mode *mode, silt_error *err) {
    const size_t n = (size_t)f->n_node + 1, wide = (size_t)(f->dim * f->n_node) + 1;
    mode_room room = {.one = silt_alloc(wide, sizeof(double)), .two = silt_alloc(wide, sizeof(double)), .z = silt_alloc(n, sizeof(double)),
                      .d = silt_alloc(n, sizeof(double)), .kd = silt_alloc(n, sizeof(double)), .before = silt_alloc(n, sizeof(double))};
    *mode = (silt_mode){.motion = silt_alloc(wide, sizeof(double)), .force = silt_alloc(wide, sizeof(double)), .load = silt_alloc(n, sizeof(double)),
                        .p = silt_alloc(n, sizeof(double)), .left = silt_alloc(n, sizeof(double))};
    memcpy(mode->motion, motion, (wide - 1) * sizeof(double));
    // what does not hang on the velocity has no part in its change
    double *potential = f->potential;
    silt_seep *seep = f->seep;
    f->potential = NULL;
    f->seep = NULL;
    silt_status status = mode_begin(f, s, mode, &room, err);
    if (status == SILT_OK && !(enough < 0))
        status = mode_pressure(f, s, mode, enough > 0 ? enough : f->dim == 2 ? MODE_ENOUGH_PLANE : MODE_ENOUGH_SPACE, &room, err);
    f->potential = potential;
    f->seep = seep;
    double *owned[] = {room.one, room.two, room.z, room.d, room.kd, room.before};
    for (size_t k = 0; k < sizeof owned / sizeof *owned; k++)
        free(owned[k]);
    return status;
}

double silt_mode_work(const silt_fluid *f, const silt_mode *a, const silt_mode *b) {
    return silt_dot(f->dim * f->n_node, a->motion, b->force) + silt_dot(f->n_node, a->load, b->p) + silt_dot(f->n_node, a->p, b->left);
}
