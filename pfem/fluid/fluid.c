// one step of the water: FIC-stabilised P1-P1, updated Lagrangian, all integrals on the midpoint mesh (docs/method.md)
#include "fluid.h"

#define FLUID_WORK 6        // arrays in silt_fluid.work
#define FLUID_STIFF 0.3     // mu dt/(rho h^2) from which viscosity has its say in the pressure correction
#define FLUID_WHOLE 2.5     // the same, in the mean, from which momentum and continuity are factored as one
#define FLUID_SLOW 12        // passes after which stiff cells, few as they are, bring that too
#define FLUID_DAMPED 10.0   // mu dt/(rho h^2) above which the trapezoidal rule would let the shortest modes ring on and on
#define FLUID_CLOSURE 2     // how often a step looks at the eddy viscosity again: it is smooth, and halved steps towards it end slowly
#define FLUID_AGAIN 10      // iterations of a step that is solved again, at least: to cut it now costs LIGGGHTS' step too
#define FLUID_REFRESH 2     // how often a step refreshes what converges slowly and is small: the projected pressure gradient (0.9 an
                            // iteration) and the excess of the mass (0.75 in the highest modes)
#define FLUID_FILM 8        // the same where bodies squeeze films, which goes on through the smoothing: after two looks a block's heave on the floor
                            // meets 0.8 of its inertia, after eight 0.99
#define FLUID_INNER 1e4     // accuracy of a pressure increment over that of the step, at least: refreshes are counted, so what an
                            // increment lacks does not all come back
#define FLUID_ROUGH 10      // times that in space, before a refresh, which leaves a third of the residual whatever the increment was: 9
                            // of 46 conjugate gradients a step in the collapse
#define FLUID_PAID  0.1     // the same of each of the two solves for debts in space: 4 of 41

void silt_fluid_clear(silt_fluid *f) {
    double *owned[] = {f->x_mid, f->flux, f->cell_volume, f->start, f->inverse, f->mu, f->tau, f->share, f->stand, f->potential, f->belt, f->wall_force, f->shift,
                       f->blow, f->level_force, f->bed_force, f->ride, f->level_brake, f->mass, f->volume,
                       f->friction, f->inertia, f->w, f->work, f->reaction, f->scratch,
                       f->projection_weight, f->residual, f->rate, f->increment, f->withheld, f->pressure_new, f->v_start, f->v_first, f->debt_first, f->normal, f->given};
    for (size_t k = 0; k < sizeof owned / sizeof *owned; k++)
        free(owned[k]);
    free(f->piece);
    free(f->walk);
    free(f->closed);
    free(f->hold);
    free(f->mobile);
    free(f->still);
    silt_pressure_free(&f->pressure);
    silt_stiff_free(&f->stiff);
    silt_mix_free(&f->mix);
    silt_wall_normals_clear(&f->wall_normals);
    silt_depth_clear(&f->depth);
    silt_wall_law_clear(&f->law);
    silt_eddy_clear(&f->eddy);
    silt_parts_clear(&f->parts);
    *f = (silt_fluid){0};
}

void *silt_fluid_rest(silt_fluid *f, size_t *bytes) { return silt_pressure_rest(f->pressure, bytes); }

static void fluid_reserve(silt_fluid *f, const silt_step *s) {
    const int D = silt_nodes_dim(s->nodes), n_node = s->nodes->count, n_cell = s->mesh->n_cell;
    f->dim = D;
#define ROOM(field, per, capacity, need)                                                                               \
    do {                                                                                                               \
        int have = (capacity) * (per);                                                                                 \
        f->field = silt_grow(f->field, &have, (need) * (per), sizeof *f->field);                                       \
    } while (0)
    if (n_node > f->node_capacity) {
        const int need = n_node + n_node / 32 + 64, have_nodes = f->node_capacity;
        ROOM(x_mid, D, have_nodes, need);
        ROOM(w, D, have_nodes, need);
        ROOM(reaction, D, have_nodes, need);
        ROOM(scratch, D, have_nodes, need);
        ROOM(normal, D, have_nodes, need);
        ROOM(given, D, have_nodes, need);
        ROOM(work, FLUID_WORK * D, have_nodes, need);
        double **const lie[FLUID_WORK] = {&f->star, &f->force, &f->excess, &f->projection, &f->cg[0], &f->cg[1]};
        for (int k = 0; k < FLUID_WORK; k++)
            *lie[k] = f->work + (size_t)(k * D) * (size_t)need;
        f->cg[2] = f->reaction; // found when all is solved
        ROOM(v_start, D, have_nodes, need);
        ROOM(pressure_new, 1, have_nodes, need);
        ROOM(projection_weight, 1, have_nodes, need);
        ROOM(mass, 1, have_nodes, need);
        ROOM(volume, 1, have_nodes, need);
        ROOM(inertia, 1, have_nodes, need);
        ROOM(friction, 1, have_nodes, need);
        ROOM(residual, 1, have_nodes, need);
        ROOM(rate, 1, have_nodes, need);
        ROOM(increment, 1, have_nodes, need);
        ROOM(hold, 1, have_nodes, need);
        ROOM(mobile, 1, have_nodes, need);
        ROOM(withheld, 1, have_nodes, need);
        f->node_capacity = need;
    }
    if (n_cell > f->cell_capacity) {
        const int need = n_cell + n_cell / 32 + 64, have_cells = f->cell_capacity;
        ROOM(flux, (D + 1) * D, have_cells, need);
        ROOM(cell_volume, 1, have_cells, need);
        ROOM(start, 1, have_cells, need);
        ROOM(inverse, 1, have_cells, need);
        ROOM(mu, 1, have_cells, need);
        ROOM(tau, 1, have_cells, need);
        f->cell_capacity = need;
    }
#undef ROOM
    // what only some scenes have
    if (s->drag)
        SILT_RESERVE(f->share, f->share_capacity, (D + 1) * n_cell + 1);
    else {
        free(f->share);
        f->share = NULL;
        f->share_capacity = 0;
    }
    if (s->scene->fluid.force.kind == FORMULA_CENTRAL && !s->drag)
        SILT_RESERVE(f->potential, f->potential_capacity, n_node + 1);
    bool belts = false;
    for (int k = 0; k < s->scene->n_wall; k++)
        for (int d = 0; d < 3; d++)
            belts |= s->scene->wall[k].velocity[d] != 0;
    if (belts)
        SILT_RESERVE(f->belt, f->belt_capacity, D * n_node + 1);
    if (s->scene->fluid.scheme == SCHEME_FRACTIONAL)
        SILT_RESERVE(f->stand, f->stand_capacity, n_node + 1);
    if (silt_levels_any(s->scene)) {
        SILT_RESERVE(f->level_force, f->level_capacity, D * n_node + 1);
        SILT_RESERVE(f->level_brake, f->level_brake_capacity, n_node + 1);
        memset(f->level_force, 0, (size_t)(D * n_node) * sizeof(double));
    }
    if (s->scene->fluid.volume_control || s->body_velocity)
        SILT_RESERVE(f->shift, f->shift_capacity, D * n_node + 1);
    if (s->body_velocity) {
        SILT_RESERVE(f->v_first, f->v_first_capacity, D * n_node + 1);
        SILT_RESERVE(f->debt_first, f->debt_first_capacity, n_node + 1);
    }
    f->n_node = n_node;
    f->n_cell = n_cell;
}

// mu theta dt/(rho h^2): the largest, and the mean over the water
static double stiffness(const silt_fluid *f, const silt_step *s) {
    return f->mu_max * f->theta * s->dt / (s->scene->fluid.density * silt_square(s->scene->fluid.size));
}

static double mean_stiffness(const silt_fluid *f, const silt_step *s) {
    double mu = 0, volume = 0;
    for (int e = 0; e < f->n_cell; e++) {
        mu += f->cell_volume[e] * f->mu[e];
        volume += f->cell_volume[e];
    }
    return mu / volume * f->theta * s->dt / (s->scene->fluid.density * silt_square(s->scene->fluid.size));
}

// acceleration besides gravity that is loaded at the nodes, half way through the step. A central one is not: its potential is
// taken as a P1 field (silt_assemble_potential), since rest under a load at the nodes is true to h^2 only.
static void body_force(const silt_fluid *f, const silt_step *s, int i, double a[3]) {
    if (f->potential)
        memcpy(a, s->scene->fluid.force.vector, 3 * sizeof *a);
    else
        silt_formula_acceleration(&s->scene->fluid.force, s->time + 0.5 * s->dt, f->x_mid + f->dim * i, a);
}

// Lumped masses make waves slow, by 0.3 % at 40 nodes a wave. One sweep towards the consistent mass: with the acceleration
// a = M_l^-1 F the force gets (M_l - M_c) a, so that the mass's inverse is M_l^-1 (2 M_l - M_c) M_l^-1: symmetric, between 1 and
// 1.75 times that of the lumped one, and the sum of the momenta stays what it is. Where viscosity is stiff its share is left out;
// with grains, whose drag may be stiff, the masses stay lumped. After silt_momentum_look at w where there is viscosity.
static void find_excess(silt_fluid *f, const silt_step *s, double stiff, const double *right) {
    const int D = f->dim;
    const double theta_dt = f->theta * s->dt, *v = s->nodes->v;
    double *a = f->cg[0];
    memset(f->excess, 0, (size_t)(D * f->n_node) * sizeof(double));
    if (s->drag)
        return;
    SILT_PARALLEL(f->n_node)
    for (int k = 0; k < D * f->n_node; k++)
        a[k] = right[k];
    SILT_PARALLEL(f->n_node)
    for (int i = 0; i < f->n_node; i++)
        for (int d = 0; d < D; d++)
            a[D * i + d] -= f->mass[i] * v[D * i + d] / theta_dt + (f->inertia[i] - f->mass[i] / theta_dt) * f->w[D * i + d];
    if (stiff > 0 && stiff < 0.1)
        for (int k = 0; k < D * f->n_node; k++)
            a[k] += (stiff / 0.1 - 1) * f->scratch[k];
    SILT_PARALLEL(f->n_node)
    for (int i = 0; i < f->n_node; i++) {
        for (int d = 0; d < D; d++)
            a[D * i + d] = s->mesh->wet[i] && f->mass[i] > 0 ? a[D * i + d] / f->mass[i] : 0;
        // such a body force is loaded at the nodes, not as a P1 field: it has no excess, whatever holds the nodes
        silt_hold_project(f, i, a + D * i);
        if (s->body_velocity && s->nodes->kind[i] == NODE_BODY) {
            double own[3];
            for (int d = 0; d < D; d++)
                own[d] = (f->w[D * i + d] - v[D * i + d]) / theta_dt;
            silt_hold_replace(f, i, own, a + D * i);
        }
        if (s->scene->fluid.force.kind != FORMULA_NONE) {
            double b[3];
            body_force(f, s, i, b);
            for (int d = 0; d < D && s->mesh->wet[i]; d++)
                a[D * i + d] -= b[d];
        }
    }
    for (int k = 0; f->film && k < f->film->n_slave; k++) { // these go with a body
        double *own = a + D * f->film->slave[k];
        for (int d = 0; d < D; d++)
            own[d] = (f->w[D * f->film->slave[k] + d] - v[D * f->film->slave[k] + d]) / theta_dt;
        silt_film_free_part(f->film, k, D, own);
    }
    silt_assemble_mass_excess(f, s->mesh, s->scene->fluid.density, a, f->excess);
}

// force on the nodes but for inertia, viscosity and drag's own share: M v/(theta dt) + M g + push + G p
static void momentum_right(silt_fluid *f, const silt_step *s, const double *p, double *out) {
    const int D = f->dim;
    const double per_time = 1 / (f->theta * s->dt), *v = s->nodes->v, *g = s->scene->gravity;
    SILT_PARALLEL(f->n_node)
    for (int i = 0; i < f->n_node; i++)
        for (int d = 0; d < D; d++)
            out[D * i + d] = f->mass[i] * (v[D * i + d] * per_time + g[d]) + (s->drag ? s->drag->push[D * i + d] : 0);
    if (s->scene->fluid.force.kind != FORMULA_NONE)
        for (int i = 0; i < f->n_node; i++) {
            double a[3];
            body_force(f, s, i, a);
            for (int d = 0; d < D; d++)
                out[D * i + d] += f->mass[i] * a[d];
        }
    if (f->potential)
        silt_assemble_potential(f, s->mesh, out);
    if (f->law.n_point)
        for (int k = 0; k < D * f->n_node; k++)
            out[k] += f->wall_force[k];
    for (int k = 0; f->level_force && k < D * f->n_node; k++)
        out[k] += f->level_force[k];
    for (int k = 0; f->bed_force && k < D * f->n_node; k++)
        out[k] += f->bed_force[k];
    if (s->scene->fluid.surface_tension > 0)
        silt_tension_force(s->mesh, f->x_mid, s->scene->fluid.surface_tension, out);
    if (s->pockets)
        silt_pockets_force(s->pockets, D, 0.5 * s->dt, f->w, out);
    silt_assemble_pressure(f, s->mesh, p, out);
}

// points on bodies move with them
static void law_follow_bodies(silt_fluid *f, const silt_step *s) {
    for (int q = 0; q < f->law.n_point; q++) {
        silt_wall_point *point = &f->law.point[q];
        if (s->nodes->kind[point->node] == NODE_BODY && s->body_velocity)
            memcpy(point->velocity, s->body_velocity + f->dim * point->node, (size_t)f->dim * sizeof(double));
    }
}

// resistance of the present iterate: traction of walls, then geometry, then viscosity of every cell
static void resist(silt_fluid *f, const silt_step *s) {
    if (f->law.n_point || f->level_force)
        memset(f->friction, 0, (size_t)f->n_node * sizeof *f->friction);
    if (f->law.n_point) {
        memset(f->wall_force, 0, (size_t)(f->dim * f->n_node) * sizeof *f->wall_force);
        law_follow_bodies(f, s);
        silt_wall_law_traction(&f->law, s->scene, f->dim, f->w, f->friction, f->wall_force);
    }
    if (f->level_force)
        silt_levels_load(f, s);
    silt_assemble_geometry(f, s, s->dt);
    if (silt_viscosity_varies(s->scene) && (f->iterations < FLUID_CLOSURE || s->scene->fluid.rheology != RHEOLOGY_NEWTONIAN)) {
        silt_viscosity_update(s->scene, s->nodes, s->mesh, &f->depth, &f->eddy, f->flux, f->inverse, f->w, f->iterations ? 0.5 : 1,
                              f->mu, &f->viscosity);
        f->mu_max = 0;
        for (int e = 0; e < f->n_cell; e++)
            f->mu_max = silt_max(f->mu_max, f->mu[e]);
    }
}

// what resistance needs once a step
static void resist_begin(silt_fluid *f, const silt_step *s) {
    for (int e = 0; e < f->n_cell; e++)
        f->mu[e] = s->scene->fluid.viscosity;
    f->mu_max = f->n_cell ? s->scene->fluid.viscosity : 0;
    memset(f->friction, 0, (size_t)f->n_node * sizeof *f->friction);
    if (silt_viscosity_varies(s->scene))
        silt_depth_update(&f->depth, s->scene, s->walls, s->nodes, s->mesh, s->nodes->x);
    if (s->drag && s->scene->grains.eddy_limit > 0 && silt_turbulence_model(s->scene) != TURBULENCE_NONE)
        silt_depth_crowd(&f->depth, s->mesh, s->nodes->x, s->drag->solid, s->scene->grains.eddy_limit);
    if (silt_scene_law(s->scene))
        silt_wall_law_place(&f->law, s->scene, s->walls, s->nodes, s->mesh, s->nodes->x);
    if (f->law.n_point)
        SILT_RESERVE(f->wall_force, f->wall_capacity, f->dim * f->n_node + 1);
    if (s->nodes->eddy)
        silt_eddy_place(&f->eddy, s->nodes, s->mesh, &f->depth, &f->law);
}

// velocity with the pressure of the last iterate, from the right side in f->force, after silt_momentum_look at w where there is
// viscosity. solved: to all digits
static silt_status velocity_star(silt_fluid *f, const silt_step *s, bool viscid, double drop, bool *solved, silt_error *err) {
    *solved = true;
    const int D = f->dim;
    if (s->scene->fluid.scheme == SCHEME_IMPLICIT && viscid) {
        memcpy(f->star, f->w, (size_t)D * (size_t)f->n_node * sizeof(double));
        for (int i = 0; i < f->n_node && f->wall_normals.n_row; i++)
            silt_hold_impose(f, i, f->star + D * i); // normals that have changed with the midpoint mesh
        silt_status status;
        if (f->wall_normals.n_row)
            SILT_CLOCKED(momentum, silt_momentum_look(f, s->mesh, f->star));
        SILT_CLOCKED(momentum, status = silt_momentum_solve(f, s, f->force, drop, f->star, solved, err));
        SILT_TRY(status);
    } else {
        for (int k = 0; k < D * f->n_node && viscid; k++)
            f->force[k] -= f->scratch[k];
        SILT_PARALLEL(f->n_node)
        for (int i = 0; i < f->n_node; i++) {
            const double stand = viscid ? f->stand[i] : 0;
            for (int d = 0; d < D; d++)
                f->star[D * i + d] = (f->force[D * i + d] + stand * f->w[D * i + d]) / (f->inertia[i] + stand);
            silt_hold_impose(f, i, f->star + D * i);
        }
    }
    for (int i = 0; i < f->n_node; i++)
        if (!s->mesh->wet[i])
            for (int d = 0; d < D; d++)
                f->star[D * i + d] = 0;
    return SILT_OK;
}

void silt_fluid_correct(silt_fluid *f, const silt_step *s, const double *q, double *v) {
    const int D = f->dim;
    memset(f->scratch, 0, (size_t)D * (size_t)f->n_node * sizeof(double));
    silt_assemble_pressure(f, s->mesh, q, f->scratch);
    SILT_PARALLEL(f->n_node)
    for (int i = 0; i < f->n_node; i++) {
        if (!s->mesh->wet[i])
            continue;
        double dv[3];
        for (int d = 0; d < D; d++)
            dv[d] = f->scratch[D * i + d] / f->inertia[i];
        silt_hold_project(f, i, dv);
        for (int d = 0; d < D; d++)
            v[D * i + d] += dv[d];
    }
}

silt_status silt_fluid_increment(silt_fluid *f, const silt_step *s, bool seeps, double tolerance, silt_error *err) {
    silt_status status;
    SILT_PARALLEL(f->n_node)
    for (int j = 0; j < f->n_node; j++)
        f->residual[j] = s->mesh->wet[j] ? -f->residual[j] : 0;
    tolerance *= silt_min(1, 100 * FLUID_INNER * s->scene->fluid.tolerance);
    if (seeps && f->seep)
        SILT_CLOCKED(solve, status = silt_seepage_solve(f, s, f->residual, tolerance, f->increment, err));
    else
        SILT_CLOCKED(solve, status = silt_pressure_solve(f->pressure, f, f->residual, tolerance, f->increment, err));
    return status;
}

// Debts are paid by moving the nodes, not by pushing the water: a velocity without momentum, shift = P G q / inertia with
// div shift = rate on the midpoint mesh, carries positions beside w. Asked of w itself the payment would be an impulse every step.
static silt_status shift_find(silt_fluid *f, const silt_step *s, silt_error *err) {
    const int D = f->dim;
    bool any = false;
    for (int i = 0; i < f->n_node && !any; i++)
        any = f->rate[i] != 0;
    memset(f->shift, 0, (size_t)(D * f->n_node) * sizeof *f->shift);
    for (int i = 0; i < f->n_node && s->body_shift; i++)
        for (int d = 0; s->nodes->kind[i] == NODE_BODY && s->mesh->wet[i] && d < D; d++) {
            f->shift[D * i + d] = s->body_shift[D * i + d];
            any |= f->shift[D * i + d] != 0;
        }
    for (int pass = 0; pass < 2 && any; pass++) {
        memset(f->increment, 0, (size_t)f->n_node * sizeof(double));
        silt_assemble_divergence(f, s->mesh, f->shift, f->increment, f->residual);
        if (f->film) {
            silt_film_squeeze(f->film, D, NULL, s->body_shift);
            silt_film_source(f->film, f->residual);
            silt_film_squeeze(f->film, D, s->body_velocity, s->body_shift);
        }
        for (int i = 0; i < f->n_node; i++)
            f->residual[i] = f->mobile[i] == 1 ? f->residual[i] - f->rate[i] : 0;
        SILT_TRY(silt_fluid_increment(f, s, false, D == 3 ? FLUID_PAID : 0.03, err));
        silt_fluid_correct(f, s, f->increment, f->shift);
    }
    return SILT_OK;
}

// forces that hold the held components; what is left on the free ones is the solver's error
static void reactions(silt_fluid *f, const silt_step *s, const double *p) {
    const int D = f->dim;
    const silt_drag *drag = s->drag;
    const double dt = s->dt, *v = s->nodes->v;
    double *out = f->reaction, lost[3] = {0}, unbalanced[3] = {0};
    momentum_right(f, s, p, out);
    memset(f->scratch, 0, (size_t)D * (size_t)f->n_node * sizeof(double));
    silt_assemble_viscous(f, s->mesh, f->w, 1, f->scratch);
    f->dissipated = 0;
    for (int i = 0; i < f->n_node; i++)
        for (int d = 0; d < D; d++) {
            const int k = D * i + d;
            out[k] = f->inertia[i] * f->w[k] - out[k] - f->excess[k] + f->scratch[k];
            f->dissipated += dt * f->scratch[k] * f->w[k]; // w . K w
        }

    memset(f->from_grains, 0, sizeof f->from_grains);
    f->momentum_scale = 0;
    f->worked = 0;
    if (drag)
        silt_assemble_pressure_lost(f, s->mesh, p, lost);
    for (int i = 0; i < f->n_node; i++) {
        if (!s->mesh->wet[i]) {
            for (int d = 0; d < D; d++)
                out[D * i + d] = 0;
            continue;
        }
        double loose[3];
        memcpy(loose, out + D * i, (size_t)D * sizeof(double));
        silt_hold_project(f, i, loose);
        for (int d = 0; d < D; d++) {
            const int k = D * i + d;
            out[k] -= loose[d];
            f->worked += dt * out[k] * f->w[k];
            if (f->level_force)
                f->worked += dt * (f->level_force[k] - f->level_brake[i] * f->w[k]) * f->w[k];
            unbalanced[d] += loose[d];
            f->momentum_scale += fabs(f->mass[i] * s->scene->gravity[d]) + fabs(f->inertia[i] * (f->w[k] - v[k]));
            if (drag) {
                const double push = drag->push[k] - drag->coefficient[i] * f->w[k];
                f->worked += dt * push * f->w[k];
                f->from_grains[d] += push;
            }
        }
    }
    double square = 0;
    for (int d = 0; d < D; d++) {
        f->from_grains[d] += drag ? lost[d] : 0;
        square += silt_square(unbalanced[d]);
    }
    f->momentum_residual = sqrt(square);

    for (int k = 0; f->bed_force && k < D * f->n_node; k++)
        out[k] += s->mesh->wet[k / D] ? f->bed_force[k] : 0;
    if (f->film)
        silt_film_press(f->film, D, p, out);
    for (int k = 0; f->blow && k < D * f->n_node; k++) {
        out[k] += f->blow[k] / dt;
        f->worked += f->blow[k] * f->w[k];
    }
    // the law of the wall brakes what is free
    for (int k = 0; k < f->law.n_point; k++) {
        const int i = f->law.point[k].node;
        for (int d = 0; d < D && s->mesh->wet[i]; d++)
            out[D * i + d] += f->wall_force[D * i + d] - f->friction[i] * f->w[D * i + d];
    }
}

// the factor that correct_stiff solves with, once a step
static silt_status prepare_stiff(silt_fluid *f, const silt_step *s, bool *ready, silt_error *err) {
    silt_status status = SILT_OK;
    if (!*ready)
        SILT_CLOCKED(matrix, status = silt_pressure_factor_stiff(f->pressure, f, s, err));
    *ready = status == SILT_OK;
    return status;
}

// stiff viscosity: the pressure's operator is nearly the mass matrix over the viscosity, its inverse adds to that of S + L
// (Cahouet and Chabard, Int. J. Numer. Meth. Fluids 8, 1988)
static silt_status correct_stiff(silt_fluid *f, silt_error *err) {
    silt_status status;
    SILT_CLOCKED(solve, status = silt_pressure_solve_stiff(f->pressure, f->residual, f->scratch, err));
    for (int i = 0; i < f->n_node; i++)
        f->increment[i] += f->scratch[i];
    return status;
}

// The trapezoidal rule turns the sign of modes that viscosity brings to rest within the step and hardly damps them: where
// N = mu dt/(rho h^2) is large the step goes over to backward Euler, whose error such modes do not feel.
static bool choose_theta(silt_fluid *f, const silt_step *s) {
    const double mu = s->scene->fluid.flow == FLOW_LAMINAR ? f->mu_max : 0;
    const double number = mu * s->dt / (s->scene->fluid.density * silt_square(s->scene->fluid.size));
    const double before = f->theta;
    if (number > FLUID_DAMPED)
        f->theta = silt_max(f->theta, 1 - sqrt(0.25 * FLUID_DAMPED / number));
    return f->theta > before;
}

// The momentum, or momentum and continuity as one system, once a step: passes make up for what viscosity has changed by since (mud that
// collapses, 13 passes with a factor for each, 12.5 with one).
static silt_status factor_stiff(silt_fluid *f, const silt_step *s, bool pressure, silt_error *err) {
    silt_status status;
    if (silt_stiff_ready(f->stiff, pressure))
        return SILT_OK;
    SILT_CLOCKED(matrix, status = silt_stiff_factor(&f->stiff, f, s, pressure, err));
    return status;
}

static silt_status correct_whole(silt_fluid *f, const silt_step *s, silt_error *err) {
    SILT_TRY(factor_stiff(f, s, true, err));
    for (int j = 0; j < f->n_node; j++)
        f->residual[j] = s->mesh->wet[j] ? -f->residual[j] : 0;
    SILT_CLOCKED(solve, silt_stiff_correct(f->stiff, f, f->residual, f->increment, f->w));
    return SILT_OK;
}

// once a step, before its first iteration: theta, and which nodes have a say
static silt_status step_kind(silt_fluid *f, const silt_step *s, double *p, silt_error *err) {
    if (choose_theta(f, s))
        silt_assemble_geometry(f, s, s->dt);
    if (s->scene->fluid.scheme == SCHEME_FRACTIONAL)
        SILT_TRY(silt_explicit_limit(f, s, err));
    silt_mobile_find(f, s->mesh, p);
    silt_spray_find(f, s, p);
    return SILT_OK;
}

// What the fronts wait on lies in arrays that are written after it: 66 bytes a node of the peak at 40k nodes.
static silt_status factor_pressure(silt_fluid *f, const silt_step *s, silt_error *err) {
    silt_lend(f->work, (size_t)(FLUID_WORK * f->dim) * (size_t)f->node_capacity * sizeof *f->work);
    const silt_status status = silt_pressure_factor(f->pressure, f, s, err);
    silt_lend(NULL, 0);
    return status;
}

static silt_status fluid_iterate(silt_fluid *f, const silt_step *s, double *p, bool again, silt_error *err) {
    const silt_fluid_def *def = &s->scene->fluid;
    const bool consistent = def->pressure == PRESSURE_CONSISTENT;
    const int D = f->dim;
    const double strict = silt_strictness(f, s);
    const bool direct = D == 2 && consistent && def->scheme == SCHEME_IMPLICIT; // momentum and continuity can be factored as one
    const size_t bytes = (size_t)D * (size_t)f->n_node * sizeof(double);
    double before = HUGE_VAL;
    // a first pressure has nothing to start from
    bool first = true, whole = false, split = false, twofold = false;
    silt_mix_restart(&f->mix);
    for (int i = 0; i < f->n_node && first; i++)
        first = p[i] == 0;
    const int most = again ? silt_max(def->iterations, FLUID_AGAIN) : def->iterations * (first ? 10 : 1);
    for (f->iterations = 0;; f->iterations++) {
        silt_status status;
        if (s->drag && s->drag->update)
            SILT_CLOCKED(coupling, s->drag->update(s->drag->self, f->w, p, s->dt));
        resist(f, s);
        if (f->iterations == 0) {
            if (!again)
                SILT_TRY(step_kind(f, s, p, err));
            // in the plane a stiff cell here and there is no reason
            whole = direct && mean_stiffness(f, s) > FLUID_WHOLE;
            split = !direct && stiffness(f, s) > FLUID_STIFF;
            if (!again)
                SILT_CLOCKED(matrix, status = factor_pressure(f, s, err));
            else
                status = SILT_OK;
            SILT_TRY(status);
            if (split)
                SILT_TRY(prepare_stiff(f, s, &twofold, err));
            if (f->theta < 0.75 && !s->drag && !again) {
                // a first pressure, nought, does not balance the smoothing of the potential
                double *potential = f->potential;
                f->potential = first ? NULL : potential;
                status = silt_fluid_start(f, s, p, err);
                f->potential = potential;
                SILT_TRY(status);
            }
            if (f->shift) {
                silt_assemble_geometry(f, s, s->dt);
                SILT_TRY(shift_find(f, s, err));
            }
            resist(f, s);
        }
        if (whole)
            SILT_TRY(factor_stiff(f, s, false, err));
        if (f->iterations == 0 || !consistent)
            silt_assemble_projection(f, s->mesh, p);
        const double stiff = stiffness(f, s);
        const bool squeezed = s->pockets && silt_pockets_stiff(s->pockets, D, 0.5 * s->dt, f->mass) > 0.1;
        momentum_right(f, s, p, f->force);
        const bool refresh = (first && stiff <= FLUID_STIFF) || f->iterations < (f->film ? FLUID_FILM : FLUID_REFRESH);
        if (stiff > 0)
            SILT_CLOCKED(momentum, silt_momentum_look(f, s->mesh, f->w));
        if (refresh)
            find_excess(f, s, stiff, f->force);
        SILT_PARALLEL(f->n_node)
        for (int k = 0; k < D * f->n_node; k++)
            f->force[k] += f->excess[k];
        // on the way the momentum is solved no further than it is worth: what refreshes are taken from farther; the iterate that ends
        // it is solved out
        const double worth = f->iterations == 0 ? 1e-5 : refresh ? 1e-3 : 1e-2;
        const double drop = def->scheme == SCHEME_IMPLICIT && before > 10 * strict * def->tolerance ? worth : 0;
        bool solved;
        SILT_TRY(velocity_star(f, s, stiff > 0, drop, &solved, err));
        int worst_node = silt_star_continuity(f, s, p);
        const bool late = f->iterations >= most;
        const double loose = 1e3 * def->tolerance; // enough then
        if (!solved && (f->worst <= strict * def->tolerance || silt_spray_lags(f, strict * def->tolerance) || (late && f->worst < loose))) {
            SILT_CLOCKED(momentum, silt_momentum_look(f, s->mesh, f->star));
            SILT_CLOCKED(momentum, status = silt_momentum_solve(f, s, f->force, 0, f->star, &solved, err));
            SILT_TRY(status);
            worst_node = silt_star_continuity(f, s, p);
        }
        const double *place = s->nodes->x + D * worst_node;
        if (!isfinite(f->worst))
            return silt_fail(err, SILT_FAILED, "the velocity is not finite near (%g, %g)", place[0], place[1]);
        const bool passed = def->scheme == SCHEME_IMPLICIT || stiff == 0 || f->iterations > 0;
        const bool fine = passed && f->worst <= (first ? 0.1 : 1) * strict * def->tolerance && (!first || silt_swirl(f, s) <= def->tolerance);
        // at the end of the iterations a small residual is accepted; a first pressure takes longer to meet its projection
        if (fine || (!first && silt_spray_lags(f, strict * def->tolerance)) || (late && f->worst < loose)) {
            memcpy(f->w, f->star, bytes);
            return silt_astray_node(f, s, err);
        }
        if (f->iterations >= most && f->iterations % 4 == 0 && silt_debts_relent(f))
            continue;
        // only when the residual stands still, and it is no small matter
        const double little = silt_max(1e3 * def->tolerance, 1e-4);
        if (f->iterations > most && f->iterations % 4 == 2 && f->worst > 0.9 * before &&
            silt_pockets_relent(f, s->mesh, f->iterations >= 2 * most ? POCKET_LITTLE : POCKET_HELD, little, s->dt, p))
            continue;
        // the last try of a step lets every node off that will not come: its volume is owed
        const bool astray = f->iterations > 3 && f->worst > 10 * before && f->worst > 0.1;
        if (f->last_try && f->iterations < 6 * most &&
            (astray || (f->iterations > 2 * most && f->iterations % 4 == 1)) &&
            silt_pockets_relent(f, s->mesh, POCKET_ANY, little, s->dt, p)) {
            before = HUGE_VAL;
            continue;
        }
        if (f->iterations >= (f->last_try ? 6 : 3) * most || astray)
            return silt_fail(err, SILT_FAILED, "continuity did not converge: a node at (%g, %g) would still gain %.2g of its volume after %d iterations",
                             place[0], place[1], f->worst, f->iterations);
        before = f->worst;
        if (direct && !whole && stiff > FLUID_STIFF && f->iterations == FLUID_SLOW) {
            whole = true;
            silt_mix_restart(&f->mix); // corrections of another kind
        }

        memcpy(f->w, f->star, bytes);
        if (whole)
            SILT_TRY(correct_whole(f, s, err));
        else
            SILT_TRY(silt_fluid_increment(f, s, true, refresh && !first && D == 3 ? FLUID_ROUGH * 0.01 : 0.01, err));
        if (!whole)
            silt_fluid_correct(f, s, f->increment, f->w);
        if (!direct && (split || stiff > FLUID_STIFF)) {
            SILT_TRY(prepare_stiff(f, s, &twofold, err)); // viscosity may have grown since the first iteration
            SILT_TRY(correct_stiff(f, err));
        }
        SILT_PARALLEL(f->n_node)
        for (int i = 0; i < f->n_node; i++)
            p[i] += f->increment[i];
        if (stiff > FLUID_STIFF || squeezed)
            silt_mix_next(f->mix, D, f->n_node, f->increment, f->residual, p, f->w);
        if (refresh)
            silt_assemble_projection(f, s->mesh, p);
    }
}

// velocity, pressure and debts of the step, or all as before
static silt_status fluid_accept(silt_fluid *f, const silt_step *s, silt_status status) {
    const silt_fluid_def *def = &s->scene->fluid;
    silt_nodes *nodes = s->nodes;
    const int D = f->dim;
    const double *p = f->pressure_new, *v = f->v_start;
    if (status != SILT_OK) {
        memcpy(nodes->v, v, (size_t)D * (size_t)f->n_node * sizeof(double));
        return status;
    }
    reactions(f, s, p);
    memset(f->impulse, 0, sizeof f->impulse);
    for (int i = 0; i < f->n_node; i++)
        for (int d = 0; d < D && s->mesh->wet[i]; d++)
            f->impulse[d] += f->mass[i] * (nodes->v[D * i + d] - v[D * i + d]);
    f->solved_volume = 0;
    for (int i = 0; i < f->n_node; i++) {
        nodes->p[i] = p[i];
        f->solved_volume += f->residual[i] * s->dt;
        const double answered = (f->rate[i] + (f->mobile[i] != 1 ? f->withheld[i] : 0)) * s->dt;
        nodes->debt[i] -= answered;
        if (def->pressure == PRESSURE_LAPLACIAN && s->mesh->surface[i]) // no continuity there: what the node gained
            nodes->debt[i] -= f->residual[i] * s->dt;
        f->given_back += answered;
        if (!s->mesh->wet[i])
            continue;
        // what is held keeps its velocity, the rest goes on to the end of the step
        for (int d = 0; d < D; d++)
            nodes->v[D * i + d] += (f->w[D * i + d] - nodes->v[D * i + d]) / f->theta;
        // on a bent wall the velocity turns on: contact takes it along the wall
        if (!silt_fluid_own_start(s, i) && !(f->wall_normals.n_row && f->wall_normals.row[i] >= 0 && f->hold[i] == HOLD_NORMAL))
            silt_hold_impose(f, i, nodes->v + D * i);
    }
    return SILT_OK;
}

silt_status silt_fluid_step(silt_fluid *f, const silt_step *s, silt_error *err) {
    const silt_fluid_def *def = &s->scene->fluid;
    silt_nodes *nodes = s->nodes;
    fluid_reserve(f, s);
    silt_parts_make(&f->parts, s->mesh);
    const int D = f->dim;
    f->seep = s->seep && s->seep->n_water ? s->seep : NULL;
    f->film = s->film;
    silt_stiff_end(f->stiff);
    if (!f->pressure)
        f->pressure = silt_pressure_create();
    f->theta = def->theta;
    f->iterations = f->momentum_iterations = f->pressure_iterations = 0;
    f->projected = 0;
    memset(f->impulse, 0, sizeof f->impulse);
    if (s->scene->n_body) {
        SILT_RESERVE(f->blow, f->blow_capacity, D * f->n_node + 1);
        memset(f->blow, 0, (size_t)(D * f->n_node) * sizeof *f->blow);
    }
    silt_hold_nodes(f, s);
    // kept apart until the step is accepted
    double *p = f->pressure_new, *v = f->v_start;
    memcpy(v, nodes->v, (size_t)D * (size_t)f->n_node * sizeof(double));
    // with the normals of the start: with those of the midpoint a body that turns blows water into the first velocity
    for (int i = 0; i < f->n_node && s->body_start; i++)
        if (silt_hold_slips(s, i) && s->mesh->wet[i])
            silt_hold_replace(f, i, s->body_start + D * i, nodes->v + D * i);
    for (int i = 0; i < f->n_node; i++) {
        for (int d = 0; d < D; d++)
            f->w[D * i + d] = s->mesh->wet[i] ? nodes->v[D * i + d] : 0;
        if (s->mesh->wet[i])
            silt_hold_turn(f, i, f->w + D * i);
        f->mobile[i] = 1;
        f->withheld[i] = f->residual[i] = 0;
    }
    if (f->seep)
        silt_seepage_begin(f, s);
    resist_begin(f, s);
    if (f->shift)
        memset(f->shift, 0, (size_t)(D * f->n_node) * sizeof *f->shift);
    f->shaped = false;
    silt_assemble_geometry(f, s, s->dt);
    if (s->pockets)
        silt_pockets_load(s->pockets, s->mesh, f->x_mid);
    silt_debts_ask(f, s);

    for (int i = 0; i < f->n_node; i++)
        // with the Laplacian the surface's pressure is prescribed
        p[i] = s->mesh->wet[i] && !(def->pressure == PRESSURE_LAPLACIAN && s->mesh->surface[i]) ? nodes->p[i] : 0;
    const silt_status status = s->mesh->n_cell ? fluid_iterate(f, s, p, false, err) : SILT_OK;
    if (s->body_velocity) {
        memcpy(f->v_first, nodes->v, (size_t)D * (size_t)f->n_node * sizeof(double));
        memcpy(f->debt_first, nodes->debt, (size_t)f->n_node * sizeof(double));
        f->given_first = f->given_back;
    } else
        silt_stiff_end(f->stiff);
    return fluid_accept(f, s, status);
}

silt_status silt_fluid_again(silt_fluid *f, const silt_step *s, silt_error *err) {
    silt_nodes *nodes = s->nodes;
    const int D = f->dim;
    memcpy(nodes->v, f->v_first, (size_t)D * (size_t)f->n_node * sizeof(double));
    memcpy(nodes->debt, f->debt_first, (size_t)f->n_node * sizeof(double));
    f->given_back = f->given_first;
    silt_hold_bodies_again(f, s);
    const int before = f->iterations;
    const silt_status status = s->mesh->n_cell ? fluid_iterate(f, s, f->pressure_new, true, err) : SILT_OK;
    f->iterations += before;
    silt_stiff_end(f->stiff);
    if (s->drag && s->drag->update && status == SILT_OK)
        s->drag->update(s->drag->self, f->w, f->pressure_new, s->dt);
    return fluid_accept(f, s, status);
}
