// The water's inertia at bodies: what a step of the water answers to each of their rigid motions (fluid/impedance.c), as a matrix. In the plane, and
// for one body, all of it is solved for in every step. In space with more bodies it is kept, in the bodies' frames, and one body in turn is solved for
// anew (docs/method.md, "Bodies in water").
#include "bodies.h"

#define WET_CHANGED 0.25 // of a body's wet nodes: then what is kept of the water at it is old
#define NEAR 2.0         // of two bodies' reaches, together: farther apart they do nothing to each other but by what is owed to them

// rigid modes of a dimension
static const int mode_plane[] = {0, 1, 5}, mode_space[] = {0, 1, 2, 3, 4, 5};

static int modes(const silt_run *run, const int **mode) {
    const bool space = silt_nodes_dim(&run->nodes) == 3;
    *mode = space ? mode_space : mode_plane;
    return space ? 6 : 3;
}

// velocity at a node of a body, or its slave, for a unit of one of the body's modes
static void mode_at(const silt_run *run, int b, int mode, int i, double v[3]) {
    double axis[3] = {0}, arm[3];
    axis[mode % 3] = 1;
    silt_body_arm(run, b, i, arm);
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

void silt_impedance_clear(silt_impedance *z) {
    free(z->body);
    free(z->water);
    free(z->mass);
    free(z->answer);
    free(z->live);
}

void silt_body_tensor(const struct silt_body *body, double tensor[3][3]) {
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

double silt_body_reach(const struct silt_body *body, int dim) {
    double reach = 0;
    for (int p = 0; p < body->n_point; p++)
        reach = silt_max(reach, silt_length(dim, body->point + dim * p));
    return reach;
}

silt_impedance silt_impedance_begin(const silt_run *run) {
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
        silt_body_tensor(body, tensor);
        for (int d = 0; d < 3; d++) {
            z.mass[(ROW * k + d) * z.size + ROW * k + d] = body->mass;
            for (int c = 0; c < 3; c++)
                z.mass[(ROW * k + 3 + d) * z.size + ROW * k + 3 + c] = tensor[d][c];
        }
        const silt_body_def *def = &run->scene->body[z.body[k]];
        for (int m = 0; m < n_mode; m++)
            if (silt_body_moves(def, mode[m]) && !silt_body_waits(run, z.body[k]))
                z.live[z.n_live++] = ROW * k + mode[m];
    }
    return z;
}

/** modes that are solved, of one impedance */
typedef struct mode_room {
    int n_mode, *row;  // owned, the rows
    silt_mode *mode;   // owned
    double *motion;    // owned
} mode_room;

static void room_forget(mode_room *room) {
    for (int m = 0; m < room->n_mode; m++)
        silt_mode_clear(&room->mode[m]);
    room->n_mode = 0;
}

// One solve: what the mode has with those before it, the work of its forces on their motions, is a row and a column.
static silt_status impedance_column(silt_run *run, const silt_step *step, silt_impedance *z, mode_room *room, int row, silt_error *err) {
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
static silt_status impedance_whole(silt_run *run, const silt_step *step, silt_impedance *z, mode_room *room, silt_error *err) {
    for (int l = 0; l < z->n_live; l++)
        SILT_TRY(impedance_column(run, step, z, room, z->live[l], err));
    return SILT_OK;
}

// ---- kept

// a block between two bodies with the first one's frame turned by p, the second one's by q
static void block_turned(const double p[4], const double q[4], const double *block, double *out) {
    double half[ROW * ROW], x[3], y[3];
    for (int r = 0; r < ROW; r++)
        for (int h = 0; h < ROW; h += 3)
            silt_turn(q, false, block + ROW * r + h, half + ROW * r + h);
    for (int c = 0; c < ROW; c++)
        for (int h = 0; h < ROW; h += 3) {
            for (int d = 0; d < 3; d++)
                x[d] = half[ROW * (h + d) + c];
            silt_turn(p, false, x, y);
            for (int d = 0; d < 3; d++)
                out[ROW * (h + d) + c] = y[d];
        }
}

static void turned_back(const struct silt_body *body, double back[4]) {
    back[0] = body->q[0];
    for (int d = 1; d < 4; d++)
        back[d] = -body->q[d];
}

// keeps what body a feels of body b, and b of a (the transpose), in their frames
static void block_keep(silt_run *run, int a, int b, const double *block) {
    const int n = ROW * run->n_body_before;
    double own[ROW * ROW], back_a[4], back_b[4];
    turned_back(&run->body_before[a], back_a);
    turned_back(&run->body_before[b], back_b);
    block_turned(back_a, back_b, block, own);
    for (int r = 0; r < ROW; r++)
        for (int c = 0; c < ROW; c++) {
            run->body_inertia[(ROW * a + r) * n + ROW * b + c] = own[ROW * r + c];
            run->body_inertia[(ROW * b + c) * n + ROW * a + r] = own[ROW * r + c];
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

static bool near(const silt_run *run, int a, int b) {
    const struct silt_body *p = &run->body_before[a], *q = &run->body_before[b];
    const double way[3] = {p->x[0] - q->x[0], p->x[1] - q->x[1], p->x[2] - q->x[2]};
    return silt_length(3, way) < NEAR * (silt_body_reach(p, 3) + silt_body_reach(q, 3));
}

// What body a feels of the modes in the room, those of body b: work of their forces on its motions, which need no solve of their own
static silt_status impedance_between(silt_run *run, const silt_step *step, int a, int b, const mode_room *room, silt_error *err) {
    double block[ROW * ROW] = {0};
    for (int r = 0; r < ROW && room->n_mode && near(run, a, b); r++) {
        silt_mode mode;
        if (!mode_motion(run, a, r, room->motion))
            break;
        silt_status status = silt_fluid_mode(&run->fluid, step, room->motion, -1, &mode, err);
        for (int m = 0; m < room->n_mode && status == SILT_OK; m++)
            block[ROW * r + room->row[m] % ROW] = run->fluid.theta * run->dt * silt_mode_work(&run->fluid, &mode, &room->mode[m]);
        silt_mode_clear(&mode);
        SILT_TRY(status);
    }
    block_keep(run, a, b, block);
    return SILT_OK;
}

static silt_status impedance_anew(silt_run *run, const silt_step *step, silt_impedance *z, int k, mode_room *room, silt_error *err) {
    double block[ROW * ROW];
    for (int m = 0; m < ROW; m++)
        SILT_TRY(impedance_column(run, step, z, room, ROW * k + m, err));
    for (int r = 0; r < ROW; r++)
        memcpy(block + ROW * r, z->water + (ROW * k + r) * z->size + ROW * k, ROW * sizeof *block);
    block_keep(run, z->body[k], z->body[k], block);
    for (int other = 0; other < z->n; other++)
        if (other != k && lives(z, other))
            SILT_TRY(impedance_between(run, step, z->body[other], z->body[k], room, err));
    return SILT_OK;
}

/** As it was kept in the bodies' frames; one body in turn is solved for anew, and each whose wet surface has changed much or that the water answered
 * otherwise than foreseen. */
static silt_status impedance_kept(silt_run *run, const silt_step *step, silt_impedance *z, mode_room *room, silt_error *err) {
    const int n = ROW * run->n_body_before;
    double block[ROW * ROW], own[ROW * ROW];
    SILT_RESERVE(run->body_water, run->body_water_capacity, run->n_body_before + 1);
    SILT_RESERVE(run->body_inertia, run->body_inertia_capacity, n * n + 1);
    for (int k = 0; k < z->n; k++) {
        const int b = z->body[k], wet = wet_nodes(run, b), under = nodes_under(run, b);
        if (!lives(z, k))
            continue;
        silt_body_water *kept = &run->body_water[b];
        const bool stale = fabs(wet - kept->wet) > WET_CHANGED * kept->wet || fabs(under - kept->under) > WET_CHANGED * kept->under;
        if (run->step % z->n != k && kept->known > 0 && !stale) {
            kept->known = 1;
            continue;
        }
        SILT_TRY(impedance_anew(run, step, z, k, room, err));
        room_forget(room);
        kept->known = 2;
        kept->wet = wet;
        kept->under = under;
    }
    for (int j = 0; j < z->n; j++)
        for (int k = 0; k < z->n; k++) {
            const int a = z->body[j], b = z->body[k];
            for (int r = 0; r < ROW; r++)
                memcpy(own + ROW * r, run->body_inertia + (ROW * a + r) * n + ROW * b, ROW * sizeof *own);
            block_turned(run->body_before[a].q, run->body_before[b].q, own, block);
            for (int r = 0; r < ROW; r++)
                memcpy(z->water + (ROW * j + r) * z->size + ROW * k, block + ROW * r, ROW * sizeof *block);
        }
    return SILT_OK;
}

silt_status silt_impedance_solve(silt_run *run, const silt_step *step, silt_impedance *z, silt_error *err) {
    const int D = silt_nodes_dim(&run->nodes);
    const size_t n = (size_t)(D * run->nodes.count) + 1, m = (size_t)z->size + 1;
    mode_room room = {.row = silt_alloc(m, sizeof(int)), .mode = silt_alloc(m, sizeof(silt_mode)), .motion = silt_alloc(n, sizeof(double))};
    const silt_status status = (D == 3 && z->n > 1 ? impedance_kept : impedance_whole)(run, step, z, &room, err);
    room_forget(&room);
    free(room.row);
    free(room.mode);
    free(room.motion);
    return status;
}

silt_status silt_run_bodies_inertia(silt_run *run, const silt_step *step, int *size, double **inertia, silt_error *err) {
    silt_impedance z = silt_impedance_begin(run);
    const silt_status status = silt_impedance_solve(run, step, &z, err);
    *size = z.size;
    *inertia = z.water;
    z.water = NULL;
    silt_impedance_clear(&z);
    return status;
}
