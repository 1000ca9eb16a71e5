// Rigid bodies in water. The water's step is solved with every body going on as it does; then it is an impedance for the discrete
// elements, which move the bodies under contacts with it; then it takes the motion that came of that (docs/method.md, "Bodies").
#include "run.h"

#define BODY_THROWN 10 // cells that a body may be thrown over in a step that cannot be cut any more
#define BODY_MOST 0.5  // of them, that it then moves
#define ROW 6 // numbers of a body: force and torque, or velocity and angular velocity
#define WET_CHANGED 0.25 // of a body's wet nodes: then what is kept of the water at it is old
#define WATER_WRONG 0.15 // of all that acts on a body and moves it with its water: when the water gives it that much otherwise than foreseen, it is old too,
#define WATER_AGAIN 0.5  // and the step is taken again, where what is owed would carry the body over
#define WATER_WAY 0.01   // of a cell

// rigid modes of a dimension
static const int mode_plane[] = {0, 1, 5}, mode_space[] = {0, 1, 2, 3, 4, 5};

static int modes(const silt_run *run, const int **mode) {
    const bool space = silt_nodes_dim(&run->nodes) == 3;
    *mode = space ? mode_space : mode_plane;
    return space ? 6 : 3;
}

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

// from body b's place half way through the step to a node's then; those under films are none of the water's mesh
static void node_arm(const silt_run *run, int b, int i, double arm[3]) {
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
    node_arm(run, b, i, arm);
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

// velocity at a node of a body, or its slave, for a unit of one of the body's modes
static void mode_at(const silt_run *run, int b, int mode, int i, double v[3]) {
    double axis[3] = {0}, arm[3];
    axis[mode % 3] = 1;
    node_arm(run, b, i, arm);
    silt_cross(axis, arm, v);
    if (mode < 3)
        memcpy(v, axis, sizeof axis);
}

// velocity of the nodes on body b for a unit of one of its modes; @return false: it is dry
static bool mode_motion(const silt_run *run, int b, int mode, double *motion) {
    const silt_nodes *nodes = &run->nodes;
    const int D = silt_nodes_dim(nodes);
    bool wet = false;
    memset(motion, 0, (size_t)(D * nodes->count) * sizeof(double));
    for (int i = 0; i < run->fluid.n_node; i++) {
        if (nodes->kind[i] != NODE_BODY || nodes->owner[i] != b)
            continue;
        wet |= run->mesh.wet[i];
        double v[3];
        mode_at(run, b, mode, i, v);
        memcpy(motion + D * i, v, (size_t)D * sizeof(double));
        if (!run->mesh.wet[i])
            continue;
        // along a surface where it slips the water does what it does
        silt_hold_project(&run->fluid, i, v);
        for (int d = 0; d < D; d++)
            motion[D * i + d] -= v[d];
    }
    for (int k = 0; run->film && k < run->film->n_slave; k++) {
        const int i = run->film->slave[k];
        double v[3];
        if (run->film->slave_body[k] != b)
            continue;
        mode_at(run, b, mode, i, v);
        silt_film_free_part(run->film, k, D, v);
        memcpy(motion + D * i, v, (size_t)D * sizeof(double));
    }
    return wet;
}

// ---------------------------------------------------------------- the impedance

/** what the bodies of a step are for the discrete elements: n free ones, ROW rows each */
typedef struct silt_impedance {
    int n, size, capacity, n_live;
    int *body;       // owned, the free ones, in order
    double *water;   // owned, size * size, kg: the water's force per acceleration, turned round
    double *mass;    // owned, the same, of the bodies
    double *answer;  // owned, the same: R of dem-coupling/response.h
    int *live;       // owned, rows of motion that is free
} silt_impedance;

static void impedance_clear(silt_impedance *z) {
    free(z->body);
    free(z->water);
    free(z->mass);
    free(z->answer);
    free(z->live);
}

// the tensor of inertia of a body in space's axes
static void inertia_turned(const struct silt_body *body, double tensor[3][3]) {
    const double *k = body->inertia;
    const double own[3][3] = {{k[0], k[3], k[4]}, {k[3], k[1], k[5]}, {k[4], k[5], k[2]}};
    double axis[3][3];
    for (int a = 0; a < 3; a++) {
        const double unit[3] = {a == 0, a == 1, a == 2};
        silt_turn(body->q, false, unit, axis[a]);
    }
    memset(tensor, 0, 9 * sizeof(double));
    for (int a = 0; a < 3; a++)
        for (int b = 0; b < 3; b++)
            for (int d = 0; d < 3; d++)
                for (int c = 0; c < 3; c++)
                    tensor[d][c] += own[a][b] * axis[a][d] * axis[b][c];
}

// whether forces move a body in this mode
static bool moves(const silt_body_def *def, int mode) {
    return def->motion == MOTION_FREE && !(def->held >> (mode < 3 ? mode : 3) & 1);
}

// it has left for good, or waits for its release, which hangs on the force that acts on it as it stands; in the rest of the step in which that comes it moves
// with its own mass
static bool waits(const silt_run *run, int b) {
    const struct silt_body *body = &run->body_before[b];
    return body->gone || (run->scene->body[b].release.on && silt_length(3, body->v) == 0 && silt_length(3, body->w) == 0);
}

static silt_impedance impedance_begin(const silt_run *run) {
    silt_impedance z = {0};
    const int *mode, n_mode = modes(run, &mode);
    z.body = silt_alloc((size_t)run->n_body_before + 1, sizeof *z.body);
    for (int b = 0; b < run->n_body_before; b++)
        if (run->scene->body[b].motion != MOTION_FIXED)
            z.body[z.n++] = b;
    z.size = ROW * z.n;
    const size_t numbers = (size_t)z.size * (size_t)z.size + 1;
    z.water = silt_alloc(numbers, sizeof(double));
    z.mass = silt_alloc(numbers, sizeof(double));
    z.answer = silt_alloc(numbers, sizeof(double));
    z.live = silt_alloc((size_t)z.size + 1, sizeof *z.live);
    for (int k = 0; k < z.n; k++) {
        const struct silt_body *body = &run->body_before[z.body[k]];
        double tensor[3][3];
        inertia_turned(body, tensor);
        for (int d = 0; d < 3; d++) {
            z.mass[(ROW * k + d) * z.size + ROW * k + d] = body->mass;
            for (int c = 0; c < 3; c++)
                z.mass[(ROW * k + 3 + d) * z.size + ROW * k + 3 + c] = tensor[d][c];
        }
        const silt_body_def *def = &run->scene->body[z.body[k]];
        for (int m = 0; m < n_mode; m++)
            if (moves(def, mode[m]) && !waits(run, z.body[k]))
                z.live[z.n_live++] = ROW * k + mode[m];
    }
    return z;
}

/** modes that are solved, of one impedance */
typedef struct silt_mode_room {
    int n_mode, *row;  // owned, the rows
    silt_mode *mode;   // owned
    double *motion;    // owned
} silt_mode_room;

static void room_forget(silt_mode_room *room) {
    for (int m = 0; m < room->n_mode; m++)
        silt_mode_clear(&room->mode[m]);
    room->n_mode = 0;
}

// One solve: what the mode has with those before it, the work of its forces on their motions, is a row and a column.
static silt_status impedance_column(silt_run *run, const silt_step *step, silt_impedance *z, silt_mode_room *room, int row, silt_error *err) {
    const double per_acceleration = run->fluid.theta * run->dt;
    silt_mode *mode = &room->mode[room->n_mode];
    if (!mode_motion(run, z->body[row / ROW], row % ROW, room->motion))
        return SILT_OK;
    room->row[room->n_mode++] = row;
    SILT_TRY(silt_fluid_mode(&run->fluid, step, room->motion, 0, mode, err));
    for (int m = 0; m < room->n_mode; m++) {
        const int other = room->row[m];
        z->water[other * z->size + row] = per_acceleration * silt_mode_work(&run->fluid, &room->mode[m], mode);
        z->water[row * z->size + other] = per_acceleration * silt_mode_work(&run->fluid, mode, &room->mode[m]);
    }
    return SILT_OK;
}

// every mode of every body, with what they do to each other
static silt_status impedance_whole(silt_run *run, const silt_step *step, silt_impedance *z, silt_mode_room *room, silt_error *err) {
    for (int l = 0; l < z->n_live; l++)
        SILT_TRY(impedance_column(run, step, z, room, z->live[l], err));
    return SILT_OK;
}

// body k's own block with both its frames turned by q
static void block_turned(const double q[4], const double *block, double *out) {
    double half[ROW * ROW], x[3], y[3];
    for (int r = 0; r < ROW; r++)
        for (int h = 0; h < ROW; h += 3)
            silt_turn(q, false, block + ROW * r + h, half + ROW * r + h);
    for (int c = 0; c < ROW; c++)
        for (int h = 0; h < ROW; h += 3) {
            for (int d = 0; d < 3; d++)
                x[d] = half[ROW * (h + d) + c];
            silt_turn(q, false, x, y);
            for (int d = 0; d < 3; d++)
                out[ROW * (h + d) + c] = y[d];
        }
}

static int wet_nodes(const silt_run *run, int b) {
    int n = 0;
    for (int i = 0; i < run->fluid.n_node; i++)
        n += run->nodes.kind[i] == NODE_BODY && run->nodes.owner[i] == b && run->mesh.wet[i];
    return n;
}

static int nodes_under(const silt_run *run, int b) {
    int n = 0;
    for (int k = 0; run->film && k < run->film->n_node; k++)
        n += run->nodes.owner[run->film->node[k]] == b;
    return n;
}

static bool lives(const silt_impedance *z, int k) {
    for (int l = 0; l < z->n_live; l++)
        if (z->live[l] / ROW == k)
            return true;
    return false;
}

/** Every body's own block as it was kept in its own frame; one body in turn is solved for anew, and each whose wet surface has changed
 * much. What bodies do to each other is left to what is owed to them. */
static silt_status impedance_kept(silt_run *run, const silt_step *step, silt_impedance *z, silt_mode_room *room, silt_error *err) {
    double block[ROW * ROW];
    SILT_RESERVE(run->body_water, run->body_water_capacity, run->n_body_before + 1);
    for (int k = 0; k < z->n; k++) {
        const int b = z->body[k], wet = wet_nodes(run, b), under = nodes_under(run, b);
        if (!lives(z, k))
            continue;
        const double *q = run->body_before[b].q, back[4] = {q[0], -q[1], -q[2], -q[3]};
        silt_body_water *kept = &run->body_water[b];
        const bool stale = fabs(wet - kept->wet) > WET_CHANGED * kept->wet || fabs(under - kept->under) > WET_CHANGED * kept->under;
        if (run->step % z->n != k && kept->known > 0 && !stale) {
            kept->known = 1;
            continue;
        }
        for (int m = 0; m < ROW; m++)
            SILT_TRY(impedance_column(run, step, z, room, ROW * k + m, err));
        room_forget(room);
        for (int r = 0; r < ROW; r++)
            memcpy(block + ROW * r, z->water + (ROW * k + r) * z->size + ROW * k, ROW * sizeof *block);
        block_turned(back, block, kept->inertia);
        kept->known = 2;
        kept->wet = wet;
        kept->under = under;
    }
    memset(z->water, 0, (size_t)z->size * (size_t)z->size * sizeof *z->water);
    for (int k = 0; k < z->n; k++) {
        block_turned(run->body_before[z->body[k]].q, run->body_water[z->body[k]].inertia, block);
        for (int r = 0; r < ROW; r++)
            memcpy(z->water + (ROW * k + r) * z->size + ROW * k, block + ROW * r, ROW * sizeof *block);
    }
    return SILT_OK;
}

static silt_status impedance_solve(silt_run *run, const silt_step *step, silt_impedance *z, silt_error *err) {
    const int D = silt_nodes_dim(&run->nodes);
    const size_t n = (size_t)(D * run->nodes.count) + 1, m = (size_t)z->size + 1;
    silt_mode_room room = {.row = silt_alloc(m, sizeof(int)), .mode = silt_alloc(m, sizeof(silt_mode)), .motion = silt_alloc(n, sizeof(double))};
    const silt_status status = (D == 3 && z->n > 1 ? impedance_kept : impedance_whole)(run, step, z, &room, err);
    room_forget(&room);
    free(room.row);
    free(room.mode);
    free(room.motion);
    return status;
}

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
        inertia_turned(body, tensor);
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
        double reach = 0;
        for (int p = 0; p < body->n_point; p++)
            reach = silt_max(reach, silt_length(D, body->point + D * p));
        const double way = silt_square(run->dt) * (silt_length(3, a) + silt_length(3, a + 3) * reach);
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

silt_status silt_run_bodies_inertia(silt_run *run, const silt_step *step, int *size, double **inertia, silt_error *err) {
    silt_impedance z = impedance_begin(run);
    const silt_status status = impedance_solve(run, step, &z, err);
    *size = z.size;
    *inertia = z.water;
    z.water = NULL;
    impedance_clear(&z);
    return status;
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
        for (int d = 0; d < 3 && waits(run, z->body[k]); d++) {
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
    silt_impedance z = impedance_begin(run);
    silt_status status = impedance_solve(run, step, &z, err);
    if (status == SILT_OK)
        status = impedance_tell(run, &z, force, err);
    if (status == SILT_OK && z.n)
        silt_coupling_dem.respond(run->coupling, z.size, z.answer);
    impedance_clear(&z);
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
    silt_status status = SILT_OK;
    for (int b = 0; b < run->n_body_before && run->body_water; b++) {
        const struct silt_body *body = &bodies->body[b], *old = &run->body_before[b];
        silt_body_water *water = &run->body_water[b];
        double wrong = 0, all = 0;
        for (int d = 0; d < 3 && water->known == 1 && moves(&run->scene->body[b], d) && !waits(run, b); d++) {
            const double moved = (body->v[d] - old->v[d]) / run->dt;
            wrong += fabs(force[ROW * b + d] - body->force[d] + run->body_carry[b][d] / run->dt);
            all += fabs(moved) * (body->mass + water->inertia[7 * d]) + body->mass * fabs(run->scene->gravity[d]) + fabs(body->contact[d]) + fabs(body->force[d]);
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
        const bool still = waits(run, b);
        double off[3] = {0}, size = 0;
        for (int d = 0; d < 3 && !still; d++) {
            // what moved it came of weight, contacts and water
            const double moved = body->mass * (body->v[d] - old->v[d]) / run->dt, weight = body->mass * run->scene->gravity[d];
            off[d] = moves(def, d) ? moved - weight - body->contact[d] - body->force[d] : 0;
            size += fabs(moved) + fabs(weight) + fabs(body->contact[d]) + fabs(body->force[d]);
        }
        if (size > 0)
            run->body_error = silt_max(run->body_error, silt_length(3, off) / size);
        for (int d = 0; d < 6; d++) {
            double *told = d < 3 ? &body->force[d] : &body->torque[d - 3], *carry = &run->body_carry[b][d];
            *carry = !still && moves(def, d) ? *carry + run->dt * (force[ROW * b + d] - *told) : 0;
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
