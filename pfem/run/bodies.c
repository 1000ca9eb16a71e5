// Rigid bodies in water. The water's step is solved with every body going on as it does; then it is an impedance for the discrete
// elements, which move the bodies under contacts with it; then it takes the motion that came of that (docs/method.md, "Bodies").
#include "bodies.h"

#define BODY_THROWN 10 // cells that a body may be thrown over in a step that cannot be cut any more
#define BODY_MOST 0.5  // of them, that it then moves
#define WATER_WRONG 0.15 // of all that acts on a body and moves it with its water: when the water gives it that much otherwise than foreseen, it is old too,
#define WATER_AGAIN 0.5  // and the step is taken again, where what is owed would carry the body over
#define WATER_WAY 0.01   // of a cell

// p q, with w first
static void quaternion_times(const double p[4], const double q[4], double out[4]) {
    double v[3];
    silt_cross(p + 1, q + 1, v);
    out[0] = p[0] * q[0] - silt_dot(3, p + 1, q + 1);
    for (int d = 0; d < 3; d++)
        out[d + 1] = p[0] * q[d + 1] + q[0] * p[d + 1] + v[d];
}

// the turn that takes a to b
static void quaternion_between(const double a[4], const double b[4], double out[4]) {
    const double back[4] = {a[0], -a[1], -a[2], -a[3]};
    quaternion_times(b, back, out);
}

void silt_run_body_turn(const struct silt_body *before, const struct silt_body *now, const double *x, int dim, double out[3]) {
    double arm[3] = {0}, turn[4];
    for (int d = 0; d < dim; d++)
        arm[d] = x[d] - before->x[d];
    quaternion_between(before->q, now->q, turn);
    silt_turn(turn, false, arm, out);
    for (int d = 0; d < 3; d++)
        out[d] += now->x[d];
}

void silt_run_body_velocity(const struct silt_body *body, const double *x, int dim, double *v) {
    double arm[3] = {0}, turning[3];
    for (int d = 0; d < dim; d++)
        arm[d] = x[d] - body->x[d];
    silt_cross(body->w, arm, turning);
    for (int d = 0; d < dim; d++)
        v[d] = body->v[d] + turning[d];
}

int silt_run_bodies_free(const silt_run *run) {
    return run->coupling ? silt_scene_moves(run->scene) : 0;
}

// the body as it is when it goes on for dt as it does
static struct silt_body coasting(const struct silt_body *body, double dt) {
    struct silt_body next = *body;
    const double angle = dt * silt_length(3, body->w);
    for (int d = 0; d < 3; d++)
        next.x[d] += dt * body->v[d];
    if (angle > 0) {
        double turn[4] = {cos(0.5 * angle)};
        for (int d = 0; d < 3; d++)
            turn[d + 1] = sin(0.5 * angle) * dt * body->w[d] / angle;
        quaternion_times(turn, body->q, next.q);
    }
    return next;
}

/** Velocities of the nodes on a body that goes from one pose and velocity to another: that of the step's momentum, theta of the way from
 * the first velocity to the second, about the place half way; and what carries the nodes beside it to where they come. */
static void rigid_motion(const silt_run *run, int i, const struct silt_body *a, const struct silt_body *b, double theta, double *v, double *shift) {
    const int D = silt_nodes_dim(&run->nodes);
    const double *x = run->nodes.x + D * i;
    double end[3], arm[3] = {0}, spin[3], turning[3];
    silt_run_body_turn(a, b, x, D, end);
    for (int d = 0; d < D; d++)
        arm[d] = 0.5 * (x[d] - a->x[d] + end[d] - b->x[d]);
    for (int d = 0; d < 3; d++)
        spin[d] = a->w[d] + theta * (b->w[d] - a->w[d]);
    silt_cross(spin, arm, turning);
    for (int d = 0; d < D; d++) {
        v[d] = a->v[d] + theta * (b->v[d] - a->v[d]) + turning[d];
        shift[d] = (end[d] - x[d]) / run->dt - v[d];
    }
}

// Slaves of films have the velocity alone: walls, which they stay on, carry their places.
static void node_motion(silt_run *run, const struct silt_body *before, const struct silt_body *now, double theta) {
    const silt_nodes *nodes = &run->nodes;
    const int D = silt_nodes_dim(nodes);
    SILT_RESERVE(run->body_velocity, run->body_velocity_capacity, D * (nodes->count + 1));
    SILT_RESERVE(run->body_shift, run->body_shift_capacity, D * (nodes->count + 1));
    for (int i = 0; i < nodes->count; i++) {
        if (nodes->kind[i] != NODE_BODY)
            continue;
        const int own = nodes->owner[i];
        rigid_motion(run, i, &before[own], &now[own], theta, run->body_velocity + D * i, run->body_shift + D * i);
    }
    for (int k = 0; run->film && k < run->film->n_slave; k++) {
        const int i = run->film->slave[k], own = run->film->slave_body[k];
        rigid_motion(run, i, &before[own], &now[own], theta, run->body_velocity + D * i, run->body_shift + D * i);
    }
}

bool silt_body_moves(const silt_body_def *def, int mode) {
    return def->motion == MOTION_FREE && !(def->held >> (mode < 3 ? mode : 3) & 1);
}

bool silt_body_waits(const silt_run *run, int b) {
    const struct silt_body *body = &run->body_before[b];
    return body->gone || (run->scene->body[b].release.on && silt_length(3, body->v) == 0 && silt_length(3, body->w) == 0);
}

void silt_run_bodies_coast(silt_run *run) {
    const silt_body_state *bodies = silt_coupling_dem.bodies(run->coupling);
    SILT_RESERVE(run->body_before, run->body_before_capacity, bodies->count + 1);
    SILT_RESERVE(run->body_after, run->body_after_capacity, bodies->count + 1);
    run->n_body_before = bodies->count;
    for (int b = 0; b < bodies->count; b++) {
        run->body_before[b] = bodies->body[b];
        run->body_after[b] = coasting(&bodies->body[b], run->dt);
    }
    run->film = silt_uplift_find(&run->uplift, run);
    silt_uplift_owe(run->uplift, run);
    node_motion(run, run->body_before, run->body_after, 1);
}

void silt_body_arm(const silt_run *run, int b, int i, double arm[3]) {
    const int D = silt_nodes_dim(&run->nodes);
    arm[2] = 0;
    for (int d = 0; d < D; d++) {
        const int k = D * i + d;
        const double at = run->mesh.wet[i] ? run->fluid.x_mid[k] : run->nodes.x[k] + 0.5 * run->dt * (run->body_velocity[k] + run->body_shift[k]);
        arm[d] = at - 0.5 * (run->body_before[b].x[d] + run->body_after[b].x[d]);
    }
}

// a force on body b at its node, or its slave, i
static void force_add(const silt_run *run, int b, int i, const double force[3], double *out) {
    double arm[3], torque[3];
    silt_body_arm(run, b, i, arm);
    silt_cross(arm, force, torque);
    for (int d = 0; d < 3; d++) {
        out[ROW * b + d] += force[d];
        out[ROW * b + 3 + d] += torque[d];
    }
}

// The blow that makes the first velocity free of divergence acts where the body is as the step begins, the rest half way: about that place it
// would turn a body that turns by the pressure's level, which hangs on nothing.
static void blow_turn(const silt_run *run, double *out) {
    const silt_nodes *nodes = &run->nodes;
    const int D = silt_nodes_dim(nodes);
    for (int i = 0; run->fluid.blow && i < run->fluid.n_node; i++) {
        if (nodes->kind[i] != NODE_BODY || !run->mesh.wet[i])
            continue;
        const int b = nodes->owner[i];
        double way[3] = {0}, blow[3] = {0}, torque[3];
        for (int d = 0; d < D; d++) {
            way[d] = nodes->x[D * i + d] - run->fluid.x_mid[D * i + d] + 0.5 * (run->body_after[b].x[d] - run->body_before[b].x[d]);
            blow[d] = -run->fluid.blow[D * i + d] / run->dt;
        }
        silt_cross(way, blow, torque);
        for (int d = 0; d < 3; d++)
            out[ROW * b + 3 + d] += torque[d];
    }
}

/** Force and torque of the water on every body, about its place half way through the step; ROW per body. Slaves give it what walls do not
 * take. */
static void sum_bodies(const silt_run *run, double *out) {
    const silt_nodes *nodes = &run->nodes;
    const int D = silt_nodes_dim(nodes);
    const double *reaction = run->fluid.reaction;
    memset(out, 0, (size_t)(ROW * run->n_body_before) * sizeof(double));
    for (int i = 0; i < run->fluid.n_node; i++) {
        double force[3] = {0};
        for (int d = 0; d < D; d++)
            force[d] = -reaction[D * i + d];
        if (nodes->kind[i] == NODE_BODY)
            force_add(run, nodes->owner[i], i, force, out);
    }
    blow_turn(run, out);
    for (int k = 0; run->film && k < run->film->n_slave; k++) {
        double force[3] = {0};
        for (int d = 0; d < D; d++)
            force[d] = -reaction[D * run->film->slave[k] + d];
        silt_film_free_part(run->film, k, D, force);
        force_add(run, run->film->slave_body[k], run->film->slave[k], force, out);
    }
}

// what slaves gave to bodies is none of the walls'
static void slaves_settle(silt_run *run) {
    const int D = silt_nodes_dim(&run->nodes);
    for (int k = 0; run->film && k < run->film->n_slave; k++) {
        double *own = run->fluid.reaction + D * run->film->slave[k], part[3];
        memcpy(part, own, (size_t)D * sizeof(double));
        silt_film_free_part(run->film, k, D, part);
        for (int d = 0; d < D; d++)
            own[d] -= part[d];
    }
}

// ---------------------------------------------------------------- the impedance

// acceleration of the free motions under `force` (size numbers); factor of mass + water over the live rows
static void impedance_move(const silt_impedance *z, const double *factor, const double *force, double *live, double *acceleration) {
    for (int l = 0; l < z->n_live; l++)
        live[l] = force[z->live[l]];
    silt_cholesky_solve(z->n_live, factor, live);
    memset(acceleration, 0, (size_t)z->size * sizeof(double));
    for (int l = 0; l < z->n_live; l++)
        acceleration[z->live[l]] = live[l];
}

static void times(int n, const double *a, const double *x, double *out) {
    for (int r = 0; r < n; r++) {
        out[r] = 0;
        for (int c = 0; c < n; c++)
            out[r] += a[r * n + c] * x[c];
    }
}

// weight, and what keeps a turning body's angular momentum
static void impedance_weight(const silt_run *run, const silt_impedance *z, double *weight, double *gyration) {
    memset(gyration, 0, (size_t)z->size * sizeof(double));
    for (int k = 0; k < z->n; k++) {
        const struct silt_body *body = &run->body_before[z->body[k]];
        double tensor[3][3], moment[3];
        silt_body_tensor(body, tensor);
        for (int d = 0; d < 3; d++) {
            moment[d] = silt_dot(3, tensor[d], body->w);
            weight[ROW * k + d] = body->mass * run->scene->gravity[d];
            weight[ROW * k + 3 + d] = 0;
        }
        silt_cross(body->w, moment, gyration + ROW * k + 3);
    }
}

// A free body that would be carried over a cell from rest in the step, or turned as far: the water's step has failed. LIGGGHTS
// would lose the body without a word. Where no smaller step will follow the body takes what half a cell needs, and is owed the rest.
static silt_status impedance_sane(const silt_run *run, const silt_impedance *z, const double *force, double *acceleration, silt_error *err) {
    const silt_scene *scene = run->scene;
    const int D = silt_nodes_dim(&run->nodes);
    for (int k = 0; k < z->n; k++) {
        const struct silt_body *body = &run->body_before[z->body[k]];
        double *a = acceleration + ROW * k;
        const double *f = force + ROW * k;
        const double way = silt_square(run->dt) * (silt_length(3, a) + silt_length(3, a + 3) * silt_body_reach(body, D));
        const double most = scene->fluid.size;
        if (run->fluid.last_try && way >= most && way < BODY_THROWN * most)
            for (int d = 0; d < ROW; d++)
                a[d] *= BODY_MOST * most / way;
        else if (!(way < most))
            return silt_fail(err, SILT_FAILED, "the water's force (%.3g, %.3g, %.3g) N and torque (%.3g, %.3g, %.3g) N m would throw body '%s' at (%g, %g) over %.2g cells in a step",
                             f[0], f[1], f[2], f[3], f[4], f[5], scene->body[z->body[k]].name, body->x[0], body->x[1], way / scene->fluid.size);
    }
    return SILT_OK;
}

// factor of mass + water over the live rows. @return false: it is not positive
static bool impedance_factor(const silt_impedance *z, double *factor) {
    const int n = z->size, m = z->n_live;
    for (int r = 0; r < m; r++)
        for (int c = 0; c < m; c++)
            factor[r * m + c] = z->mass[z->live[r] * n + z->live[c]] + z->water[z->live[r] * n + z->live[c]];
    return silt_cholesky(m, factor);
}

// Takes out of the water's inertia what is less than nought, rows in units of the bodies' mass. @return how many motions
static int impedance_clip(silt_impedance *z) {
    const int n = z->size, m = z->n_live;
    double *part = silt_alloc((size_t)(m * m) + 1, sizeof *part);
    for (int r = 0; r < m; r++)
        for (int c = 0; c < m; c++)
            part[r * m + c] = z->water[z->live[r] * n + z->live[c]] /
                              sqrt(z->mass[z->live[r] * n + z->live[r]] * z->mass[z->live[c] * n + z->live[c]]);
    const int clipped = silt_matrix_clip(m, part);
    for (int r = 0; r < m; r++)
        for (int c = 0; c < m; c++)
            z->water[z->live[r] * n + z->live[c]] =
                part[r * m + c] * sqrt(z->mass[z->live[r] * n + z->live[r]] * z->mass[z->live[c] * n + z->live[c]]);
    free(part);
    return clipped;
}

// B and R of the step from the force on bodies that go on as they do
static silt_status impedance_tell(silt_run *run, silt_impedance *z, const double *force, silt_error *err) {
    silt_body_state *bodies = silt_coupling_dem.bodies(run->coupling);
    const int n = z->size, m = z->n_live;
    double *factor = silt_alloc((size_t)m * (size_t)m + 1, sizeof *factor), *work = silt_alloc(6 * (size_t)n + 1, sizeof *work);
    double *load = work, *weight = work + n, *gyration = work + 2 * n, *a = work + 3 * n, *live = work + 4 * n, *out = work + 5 * n;
    silt_status status = SILT_OK;
    if (!impedance_factor(z, factor)) {
        // what is added to the bodies' mass shall not be less than nought: what is, is left out, in the body's own units of mass
        run->summary.clipped += impedance_clip(z);
        silt_run_warn(run, "step %lld at t = %.9g s: the water's inertia at the bodies is not positive, its negative part is left out", (long long)run->step + 1, run->time);
        if (!impedance_factor(z, factor)) {
            status = silt_fail(err, SILT_FAILED, "the water's inertia at the bodies is no number");
            goto done;
        }
    }
    impedance_weight(run, z, weight, gyration);
    for (int r = 0; r < n; r++)
        load[r] = force[ROW * z->body[r / ROW] + r % ROW] + run->body_carry[z->body[r / ROW]][r % ROW] / run->dt + weight[r] - gyration[r];
    impedance_move(z, factor, load, live, a);
    status = impedance_sane(run, z, load, a, err);
    if (status != SILT_OK)
        goto done;
    times(n, z->mass, a, out);
    for (int k = 0; k < z->n; k++)
        for (int d = 0; d < 3; d++) { // what is not live is held or led
            bodies->body[z->body[k]].force[d] = out[ROW * k + d] - weight[ROW * k + d];
            bodies->body[z->body[k]].torque[d] = out[ROW * k + 3 + d] + gyration[ROW * k + 3 + d];
        }
    for (int k = 0; k < z->n; k++)
        for (int d = 0; d < 3 && silt_body_waits(run, z->body[k]); d++) {
            bodies->body[z->body[k]].force[d] = force[ROW * z->body[k] + d];
            bodies->body[z->body[k]].torque[d] = force[ROW * z->body[k] + 3 + d];
        }
    for (int c = 0; c < n; c++) {
        memset(load, 0, (size_t)n * sizeof *load);
        load[c] = 1;
        impedance_move(z, factor, load, live, a);
        times(n, z->mass, a, out);
        for (int r = 0; r < n; r++)
            z->answer[r * n + c] = out[r] - (r == c);
    }
    // what does not move under forces has no answer
    uint8_t *free_row = silt_alloc((size_t)n + 1, 1);
    for (int l = 0; l < m; l++)
        free_row[z->live[l]] = 1;
    for (int r = 0; r < n; r++)
        for (int c = 0; c < n; c++)
            if (!free_row[r] || !free_row[c])
                z->answer[r * n + c] = 0;
    free(free_row);
done:
    free(factor);
    free(work);
    return status;
}

silt_status silt_run_bodies_load(silt_run *run, const silt_step *step, silt_error *err) {
    SILT_RESERVE(run->body_carry, run->body_carry_capacity, run->n_body_before + 1);
    double *force = silt_alloc((size_t)(ROW * run->n_body_before) + 1, sizeof *force);
    sum_bodies(run, force);
    if (!silt_run_bodies_free(run)) {
        silt_body_state *bodies = silt_coupling_dem.bodies(run->coupling);
        for (int b = 0; b < bodies->count; b++) {
            memcpy(bodies->body[b].force, force + ROW * b, sizeof bodies->body[b].force);
            memcpy(bodies->body[b].torque, force + ROW * b + 3, sizeof bodies->body[b].torque);
        }
        slaves_settle(run);
        free(force);
        return SILT_OK;
    }
    silt_impedance z = silt_impedance_begin(run);
    silt_status status = silt_impedance_solve(run, step, &z, err);
    if (status == SILT_OK)
        status = impedance_tell(run, &z, force, err);
    if (status == SILT_OK && z.n)
        silt_coupling_dem.respond(run->coupling, z.size, z.answer);
    silt_impedance_clear(&z);
    free(force);
    return status;
}

// ---------------------------------------------------------------- the answer

/** What grains have received is what the water gives them, whatever comes of its step: forces of the first solve. */
typedef struct held_drag {
    silt_drag drag;
    const silt_fluid *fluid;
    const silt_mesh *mesh;
    const silt_drag *first;        // borrowed
    double *push, *given, *w, *lost; // owned; given, w and lost: push, velocity and the pressure's force on grains at the nodes then
} held_drag;

// what of the pressure's force on the nodes acts on grains
static void pressure_on_grains(const silt_fluid *fluid, const silt_mesh *mesh, const double *p, double *out) {
    silt_fluid clear = *fluid;
    clear.share = NULL;
    const int n = fluid->dim * fluid->n_node;
    memset(out, 0, (size_t)n * sizeof *out);
    silt_assemble_pressure(&clear, mesh, p, out);
    for (int k = 0; k < n; k++)
        out[k] = -out[k];
    silt_assemble_pressure(fluid, mesh, p, out);
}

static void held_update(void *self, const double *velocity, const double *pressure, double dt) {
    held_drag *h = self;
    (void)dt;
    const int D = h->fluid->dim, n = D * h->fluid->n_node;
    pressure_on_grains(h->fluid, h->mesh, pressure, h->push);
    for (int k = 0; k < n; k++)
        h->push[k] = h->given[k] - h->first->coefficient[k / D] * (h->w[k] - velocity[k]) + h->lost[k] - h->push[k];
}

static void held_begin(held_drag *h, const silt_run *run, const silt_drag *drag) {
    const size_t n = (size_t)run->fluid.n_node, numbers = n * (size_t)run->fluid.dim;
    *h = (held_drag){.drag = *drag, .fluid = &run->fluid, .mesh = &run->mesh, .first = drag};
    h->push = silt_alloc(numbers + 1, sizeof(double));
    h->given = silt_alloc(numbers + 1, sizeof(double));
    h->w = silt_alloc(numbers + 1, sizeof(double));
    h->lost = silt_alloc(numbers + 1, sizeof(double));
    memcpy(h->given, drag->push, numbers * sizeof(double));
    memcpy(h->w, run->fluid.w, numbers * sizeof(double));
    pressure_on_grains(&run->fluid, &run->mesh, run->fluid.pressure_new, h->lost);
    h->drag.push = h->push;
    h->drag.update = held_update;
    h->drag.self = h;
}

static void held_end(held_drag *h) {
    free(h->push);
    free(h->given);
    free(h->w);
    free(h->lost);
}

/** How far the water gave the bodies otherwise than its inertia at them foresaw. Where that is what was kept of an earlier step it is found anew
 * in the next one, and where a body would be thrown by what it is owed, in this one, which is taken again: a film that closes under a body has eighty times
 * the inertia that the open one had. @param force  what the water gives, ROW per body */
static silt_status bodies_foreseen(silt_run *run, const double *force, silt_error *err) {
    const silt_body_state *bodies = silt_coupling_dem.bodies(run->coupling);
    const int n = ROW * run->n_body_before;
    silt_status status = SILT_OK;
    for (int b = 0; b < run->n_body_before && run->body_inertia; b++) {
        const struct silt_body *body = &bodies->body[b], *old = &run->body_before[b];
        silt_body_water *water = &run->body_water[b];
        double wrong = 0, all = 0;
        if (water->known != 1 || silt_body_waits(run, b))
            continue;
        for (int d = 0; d < 3; d++) {
            if (!silt_body_moves(&run->scene->body[b], d))
                continue;
            const double moved = (body->v[d] - old->v[d]) / run->dt;
            wrong += fabs(force[ROW * b + d] - body->force[d] + run->body_carry[b][d] / run->dt);
            all += fabs(moved) * (body->mass + run->body_inertia[(ROW * b + d) * (n + 1)]) + body->mass * fabs(run->scene->gravity[d]) + fabs(body->contact[d]) + fabs(body->force[d]);
        }
        if (!(wrong > WATER_WRONG * all))
            continue;
        water->known = 0;
        const double way = wrong / body->mass * silt_square(run->dt);
        if (wrong > WATER_AGAIN * all && way > WATER_WAY * run->scene->fluid.size && !run->fluid.last_try)
            status = silt_fail(err, SILT_FAILED, "the water gave body '%s' at (%g, %g) %.3g N more than was foreseen", run->scene->body[b].name, body->x[0],
                               body->x[1], wrong);
    }
    return status;
}

// what the water gave bodies and they have not received, and what is left open of their momentum
static void bodies_owe(silt_run *run, const double *force) {
    const silt_body_state *bodies = silt_coupling_dem.bodies(run->coupling);
    run->body_error = 0;
    for (int b = 0; b < run->n_body_before; b++) {
        struct silt_body *body = &bodies->body[b];
        const silt_body_def *def = &run->scene->body[b];
        const struct silt_body *old = &run->body_before[b];
        const bool still = silt_body_waits(run, b);
        double off[3] = {0}, size = 0;
        for (int d = 0; d < 3 && !still; d++) {
            // what moved it came of weight, contacts and water
            const double moved = body->mass * (body->v[d] - old->v[d]) / run->dt, weight = body->mass * run->scene->gravity[d];
            off[d] = silt_body_moves(def, d) ? moved - weight - body->contact[d] - body->force[d] : 0;
            size += fabs(moved) + fabs(weight) + fabs(body->contact[d]) + fabs(body->force[d]);
        }
        if (size > 0)
            run->body_error = silt_max(run->body_error, silt_length(3, off) / size);
        for (int d = 0; d < 6; d++) {
            double *told = d < 3 ? &body->force[d] : &body->torque[d - 3], *carry = &run->body_carry[b][d];
            *carry = !still && silt_body_moves(def, d) ? *carry + run->dt * (force[ROW * b + d] - *told) : 0;
            *told = force[ROW * b + d];
        }
    }
}

silt_status silt_run_bodies_answer(silt_run *run, const silt_step *step, silt_error *err) {
    silt_body_state *bodies = silt_coupling_dem.bodies(run->coupling);
    memcpy(run->body_after, bodies->body, (size_t)run->n_body_before * sizeof *bodies->body);
    node_motion(run, run->body_before, run->body_after, run->fluid.theta);
    silt_step again = *step;
    again.body_velocity = run->body_velocity;
    again.body_shift = run->body_shift;
    held_drag held = {0};
    if (step->drag) {
        held_begin(&held, run, step->drag);
        again.drag = &held.drag;
    }
    const silt_status status = silt_fluid_again(&run->fluid, &again, err);
    held_end(&held);
    SILT_TRY(status);
    double *force = silt_alloc((size_t)(ROW * run->n_body_before) + 1, sizeof *force);
    sum_bodies(run, force);
    slaves_settle(run);
    const silt_status foreseen = bodies_foreseen(run, force, err);
    if (foreseen == SILT_OK)
        bodies_owe(run, force);
    free(force);
    return foreseen;
}
