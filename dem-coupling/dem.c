#include "dem.h"

#include "dem_check.h"
#include "guide.h"
#include "link.h"
#include "pose.h"

// a body as it was given, with what its pose is measured from
typedef struct dem_solid {
    silt_dem_body def; // def.sphere owned
    int slot;          // among the free bodies in the worker, -1: fixed
    double axis;       // slab: direction of the worker's axis in it at the start, radians
    double frame[3][3]; // space: the worker's axes when it had its first orientation
} dem_solid;

struct silt_dem {
    silt_dem_def def; // strings and walls owned
    dem_link link;
    bool begun; // bodies are in the worker
    bool keep;  // the next run may do without a set-up
    // spheres in the worker, rising id and tag
    int n_live, cap_live;
    struct dem_live {
        int64_t id;
        int tag;
        uint8_t kind, gone;
    } * live; // owned
    int64_t last_id;
    int next_tag;
    // queued edits
    int n_remove, cap_remove, n_add, cap_add;
    int64_t *remove;      // owned
    silt_dem_sphere *add; // owned
    int n_guide; // bytes of guide
    const void *guide; // borrowed, of the next run
    const double *torque, *shift, *response; // borrowed, of the next run, NULL: none
    double (*rate)[4]; // owned, velocity and spin of every motion
    int n_solid, cap_solid, n_free, n_free_sphere;
    dem_solid *solid; // owned
    // the last state, owned
    silt_dem_state state;
    int cap_grain[7], cap_body[6];
    int64_t *id;
    double *x, *v, *omega, *radius, *mass;
    int *contacts;
    int cap_bed;
    uint8_t *on_bed;
    double *body_x, *body_v, *body_omega, *body_q, *body_contact, *body_answer;
};

const silt_dem_state *silt_dem_state_now(const silt_dem *dem) { return &dem->state; }

int silt_dem_process(const silt_dem *dem) { return dem->link.pid; }

bool silt_dem_own_fault(const silt_dem *dem) { return !dem->link.failed || dem->link.gave_up; }

// ---- opening and closing

void silt_dem_close(silt_dem **dem) {
    silt_dem *d = dem ? *dem : NULL;
    if (!d)
        return;
    dem_link_close(&d->link);
    for (int k = 0; k < d->n_solid; k++)
        free((void *)d->solid[k].def.sphere);
    void *owned[] = {(void *)d->def.worker, (void *)d->def.log, (void *)d->def.wall, (void *)d->def.triangle, (void *)d->def.wall_motion,
                     (void *)d->def.motion, d->rate, d->live, d->remove, d->add, d->solid, d->id, d->x, d->v, d->omega,
                     d->radius, d->mass, d->contacts, d->on_bed, d->body_x, d->body_v, d->body_omega, d->body_q,
                     d->body_contact, d->body_answer};
    for (size_t k = 0; k < sizeof owned / sizeof *owned; k++)
        free(owned[k]);
    free(d);
    *dem = NULL;
}

// a worker that runs, not yet LIGGGHTS in it
static silt_status dem_create(silt_dem **dem, const silt_dem_def *def, bool append, silt_error *err) {
    *dem = NULL;
    SILT_TRY(silt_dem_check(def, err));
    silt_dem *d = silt_alloc(1, sizeof *d);
    d->def = *def;
    d->def.worker = silt_text("%s", def->worker ? def->worker : "silt-dem");
    d->def.log = def->log ? silt_text("%s", def->log) : NULL;
    double(*wall)[4] = silt_alloc((size_t)def->n_wall + 1, sizeof *wall);
    if (def->n_wall)
        memcpy(wall, def->wall, (size_t)def->n_wall * sizeof *wall);
    d->def.wall = (const double(*)[4])wall;
    double(*triangle)[10] = silt_alloc((size_t)def->n_triangle + 1, sizeof *triangle);
    if (def->n_triangle)
        memcpy(triangle, def->triangle, (size_t)def->n_triangle * sizeof *triangle);
    d->def.triangle = (const double(*)[10])triangle;
    const int n_wall = def->n_wall + def->n_triangle;
    int *moves = silt_alloc((size_t)n_wall + 1, sizeof *moves);
    for (int k = 0; k < n_wall; k++)
        moves[k] = def->wall_motion ? def->wall_motion[k] : -1;
    d->def.wall_motion = moves;
    double(*motion)[3] = silt_alloc((size_t)def->n_motion + 1, sizeof *motion);
    if (def->n_motion)
        memcpy(motion, def->motion, (size_t)def->n_motion * sizeof *motion);
    d->def.motion = (const double(*)[3])motion;
    d->rate = silt_alloc((size_t)def->n_motion + 1, sizeof *d->rate);
    d->last_id = INT64_MIN;
    d->next_tag = 1;
    silt_status status = dem_link_open(&d->link, d->def.worker, d->def.log, append, err);
    if (status == SILT_OK)
        *dem = d;
    else
        silt_dem_close(&d);
    return status;
}

// where the walls are, and how they move
static void dem_write_walls(const silt_dem *dem) {
    const silt_dem_def *def = &dem->def;
    dem_shared *s = dem->link.shared;
    dem_motion *motion = DEM_SECTION(s, dem_motion, motion);
    memcpy(DEM_SECTION(s, double, wall), def->wall, (size_t)def->n_wall * sizeof *def->wall);
    memcpy(DEM_SECTION(s, double, triangle), def->triangle, (size_t)def->n_triangle * sizeof *def->triangle);
    memcpy(DEM_SECTION(s, int, wall_motion), def->wall_motion, (size_t)(def->n_wall + def->n_triangle) * sizeof *def->wall_motion);
    for (int k = 0; k < def->n_motion; k++) {
        memcpy(motion[k].centre, def->motion[k], sizeof motion[k].centre);
        memcpy(motion[k].velocity, dem->rate[k], sizeof motion[k].velocity);
        motion[k].spin = dem->rate[k][3];
    }
}

void silt_dem_move_walls(silt_dem *dem, const double (*rate)[4], const double *wall) {
    memcpy(dem->rate, rate, (size_t)dem->def.n_motion * sizeof *dem->rate);
    if (dem->def.dim == 3)
        memcpy((double(*)[10])(uintptr_t)dem->def.triangle, wall, (size_t)dem->def.n_triangle * sizeof *dem->def.triangle);
    else
        memcpy((double(*)[4])(uintptr_t)dem->def.wall, wall, (size_t)dem->def.n_wall * sizeof *dem->def.wall);
}

// the fixed numbers into the shared memory, the free bodies if asked; then LIGGGHTS starts
static silt_status dem_tell(silt_dem *dem, char word, int max_grain, silt_error *err) {
    const silt_dem_def *def = &dem->def;
    dem_shared *s = dem->link.shared;
    bool bodies = word == DEM_BODIES || s->resume;

    memcpy(s->lo, def->lo, sizeof s->lo);
    memcpy(s->hi, def->hi, sizeof s->hi);
    memcpy(s->way_lo, def->way_lo, sizeof s->way_lo);
    memcpy(s->way_hi, def->way_hi, sizeof s->way_hi);
    memcpy(s->gravity, def->gravity, sizeof s->gravity);
    s->dim = def->dim == 3 ? 3 : 2;
    s->periodic = def->periodic;
    s->across = def->across;
    s->period = def->period;
    s->youngs_modulus = def->youngs_modulus;
    s->wall_modulus = def->wall_modulus > 0 ? def->wall_modulus : def->youngs_modulus;
    s->poissons_ratio = def->poissons_ratio;
    s->restitution = def->restitution;
    s->friction = def->friction;
    s->rolling_friction = def->rolling_friction;
    s->body_friction = def->body_friction;
    s->step = def->step;
    s->max_radius = def->max_radius;
    s->min_radius = def->min_radius;
    s->n_wall = def->n_wall;
    s->n_triangle = def->n_triangle;
    s->n_motion = def->n_motion;
    s->no_contacts = def->no_contacts;
    s->n_body = bodies ? dem->n_free : 0;
    s->n_body_sphere = bodies ? dem->n_free_sphere : 0;
    s->n_remove = s->n_add = s->n_force = s->n_torque = s->n_shift = s->n_guide = s->n_response = 0;
    s->max_grain = max_grain;
    SILT_TRY(dem_link_reserve(&dem->link, err));
    s = dem->link.shared;
    dem_write_walls(dem);
    double *sphere = DEM_SECTION(s, double, body_sphere);
    int first = 0;
    for (int k = 0; bodies && k < dem->n_solid; k++) {
        const dem_solid *solid = &dem->solid[k];
        if (solid->slot < 0)
            continue;
        dem_body *b = &DEM_SECTION(s, dem_body, body)[solid->slot];
        memset(b, 0, sizeof *b);
        b->n_sphere = solid->def.n_sphere;
        b->first = first;
        b->mass = solid->def.mass;
        b->inertia = solid->def.inertia;
        b->angle = solid->def.angle;
        memcpy(b->tensor, solid->def.tensor, sizeof b->tensor);
        memcpy(b->q, solid->def.q, sizeof b->q);
        memcpy(b->x, solid->def.x, sizeof b->x);
        memcpy(b->v, solid->def.v, sizeof b->v);
        memcpy(b->omega, solid->def.omega, sizeof b->omega);
        const size_t width = (size_t)silt_clump_width(s->dim);
        memcpy(&sphere[width * (size_t)first], solid->def.sphere, width * (size_t)b->n_sphere * sizeof(double));
        first += b->n_sphere;
    }
    SILT_TRY(dem_link_send(&dem->link, word, err));
    SILT_TRY(dem_link_collect(&dem->link, err));
    silt_clock_else(dem->link.shared->cpu_all);
    return SILT_OK;
}

silt_status silt_dem_open(silt_dem **dem, const silt_dem_def *def, silt_error *err) {
    silt_dem *d = NULL;
    *dem = NULL;
    silt_status status = dem_create(&d, def, def->append, err);
    if (status == SILT_OK)
        status = dem_tell(d, DEM_OPEN, 0, err);
    if (status == SILT_OK)
        *dem = d;
    else
        silt_dem_close(&d);
    return status;
}

// ---- edits

void silt_dem_remove(silt_dem *dem, int n, const int64_t *id) {
    for (int k = 0; k < n; k++) {
        // one that is still in the queue never comes
        int kept = 0;
        for (int i = 0; i < dem->n_add; i++)
            if (dem->add[i].id != id[k])
                dem->add[kept++] = dem->add[i];
        if (kept < dem->n_add) {
            dem->n_add = kept;
            continue;
        }
        SILT_RESERVE(dem->remove, dem->cap_remove, dem->n_remove + 1);
        dem->remove[dem->n_remove++] = id[k];
    }
}

void silt_dem_add(silt_dem *dem, int n, const silt_dem_sphere *sphere) {
    SILT_RESERVE(dem->add, dem->cap_add, dem->n_add + n);
    for (int k = 0; k < n; k++)
        dem->add[dem->n_add++] = sphere[k];
}

// room in the state's arrays
static void dem_reserve(silt_dem *dem, int n_grain) {
    SILT_RESERVE(dem->id, dem->cap_grain[0], n_grain + 1);
    SILT_RESERVE(dem->x, dem->cap_grain[1], 3 * n_grain + 1);
    SILT_RESERVE(dem->v, dem->cap_grain[2], 3 * n_grain + 1);
    SILT_RESERVE(dem->omega, dem->cap_grain[3], 3 * n_grain + 1);
    SILT_RESERVE(dem->radius, dem->cap_grain[4], n_grain + 1);
    SILT_RESERVE(dem->mass, dem->cap_grain[5], n_grain + 1);
    SILT_RESERVE(dem->contacts, dem->cap_grain[6], n_grain + 1);
    SILT_RESERVE(dem->on_bed, dem->cap_bed, n_grain + 1);
    double **const body[] = {&dem->body_x, &dem->body_v, &dem->body_omega, &dem->body_q, &dem->body_contact, &dem->body_answer};
    static const int per[] = {3, 3, 3, 4, 6, 6};
    for (int k = 0; k < 6; k++)
        SILT_RESERVE(*body[k], dem->cap_body[k], per[k] * dem->n_solid + 1);
    dem->state.id = dem->id;
    dem->state.x = dem->x;
    dem->state.v = dem->v;
    dem->state.omega = dem->omega;
    dem->state.radius = dem->radius;
    dem->state.mass = dem->mass;
    dem->state.contacts = dem->contacts;
    dem->state.on_bed = dem->on_bed;
    dem->state.body_x = dem->body_x;
    dem->state.body_v = dem->body_v;
    dem->state.body_omega = dem->body_omega;
    dem->state.body_q = dem->body_q;
    dem->state.body_contact = dem->body_contact;
    dem->state.body_answer = dem->body_answer;
}

// pose of solid k into the state
static void dem_pose(silt_dem *dem, int k, const double *x, const double *v, const double *omega, const double q[4]) {
    memcpy(&dem->body_x[3 * k], x, 3 * sizeof(double));
    memcpy(&dem->body_v[3 * k], v, 3 * sizeof(double));
    memcpy(&dem->body_omega[3 * k], omega, 3 * sizeof(double));
    memcpy(&dem->body_q[4 * k], q, 4 * sizeof(double));
}

// orientation and angular velocity that the worker's answer stands for
static void dem_turned(const silt_dem *dem, int k, const dem_body *b, double omega[3], double q[4]) {
    const dem_solid *solid = &dem->solid[k];
    if (dem->def.dim == 3) {
        double axis[3][3];
        memcpy(axis, b->axis, sizeof axis);
        silt_pose_carried((const double(*)[3])solid->frame, (const double(*)[3])axis, solid->def.q, &dem->body_q[4 * k], q);
        silt_pose_spin(solid->def.tensor, q, b->omega, omega);
        return;
    }
    const double angle = solid->def.angle + atan2(b->axis[0][1], b->axis[0][0]) - solid->axis;
    memcpy(q, (double[4]){cos(angle / 2), 0, 0, sin(angle / 2)}, 4 * sizeof *q);
    memcpy(omega, b->omega, 3 * sizeof *omega);
}

silt_status silt_dem_add_body(silt_dem *dem, const silt_dem_body *body, silt_error *err) {
    if (dem->begun)
        return silt_fail(err, SILT_FAILED, "rigid body %d was added after the first run; bodies come before it", dem->n_solid);
    SILT_TRY(silt_dem_check_body(&dem->def, dem->n_solid, body, err));
    SILT_RESERVE(dem->solid, dem->cap_solid, dem->n_solid + 1);
    dem_solid *solid = &dem->solid[dem->n_solid++];
    *solid = (dem_solid){.def = *body, .slot = body->fixed ? -1 : dem->n_free++};
    const size_t width = (size_t)silt_clump_width(dem->def.dim);
    double *sphere = silt_alloc(width * (size_t)body->n_sphere, sizeof *sphere);
    memcpy(sphere, body->sphere, width * (size_t)body->n_sphere * sizeof *sphere);
    solid->def.sphere = sphere;
    if (!body->fixed)
        dem->n_free_sphere += body->n_sphere;
    // the state shows it at once
    dem_reserve(dem, dem->state.n_grain);
    dem->state.n_body = dem->n_solid;
    static const double still[3] = {0, 0, 0};
    const double plane[4] = {cos(body->angle / 2), 0, 0, sin(body->angle / 2)};
    dem_pose(dem, dem->n_solid - 1, body->x, body->fixed ? still : body->v, body->fixed ? still : body->omega,
             dem->def.dim == 3 ? body->q : plane);
    return SILT_OK;
}

// ---- the state that came back

// the worker's axis against the body's angle at the start
static void dem_measure_axes(silt_dem *dem) {
    const dem_body *body = DEM_SECTION(dem->link.shared, const dem_body, body);
    for (int k = 0; k < dem->n_solid; k++) {
        dem_solid *solid = &dem->solid[k];
        if (solid->slot < 0)
            continue;
        solid->axis = atan2(body[solid->slot].axis[0][1], body[solid->slot].axis[0][0]);
        memcpy(solid->frame, body[solid->slot].axis, sizeof solid->frame);
    }
}

static silt_status dem_take(silt_dem *dem, silt_error *err) {
    const dem_grain *grain = DEM_SECTION(dem->link.shared, const dem_grain, grain);
    const dem_body *body = DEM_SECTION(dem->link.shared, const dem_body, body);
    int n = dem->link.shared->n_grain, row = 0, kept = 0;

    dem_reserve(dem, n);
    // both lists rise: who is missing has left the box
    for (int i = 0; i < dem->n_live; i++) {
        struct dem_live *live = &dem->live[i];
        bool here = row < n && grain[row].tag == live->tag;
        if (live->kind == DEM_GRAIN && !here)
            continue;
        if (here) {
            const dem_grain *g = &grain[row];
            if (!silt_dem_finite(3, g->x) || !silt_dem_finite(3, g->v) || !silt_dem_finite(3, g->omega)) {
                return dem_link_give_up(&dem->link, err,
                                        "grain %lld is not finite after the run: x %s, v %s", (long long)live->id,
                                        silt_dem_place(&dem->def, g->x).text, silt_dem_place(&dem->def, g->v).text);
            }
            dem->id[row] = live->id;
            memcpy(&dem->x[3 * row], g->x, sizeof g->x);
            memcpy(&dem->v[3 * row], g->v, sizeof g->v);
            memcpy(&dem->omega[3 * row], g->omega, sizeof g->omega);
            dem->radius[row] = g->radius;
            dem->mass[row] = g->mass;
            dem->contacts[row] = g->contacts;
            dem->on_bed[row++] = g->on_bed != 0;
        }
        dem->live[kept++] = *live;
    }
    dem->n_live = kept;
    dem->state.n_grain = row;
    if (row != n) {
        return dem_link_give_up(&dem->link, err, "the LIGGGHTS worker (pid %d) has %d grains, %d of them known",
                                dem->link.pid, n, row);
    }
    for (int k = 0; k < dem->n_solid; k++) {
        const dem_solid *solid = &dem->solid[k];
        if (solid->slot < 0)
            continue;
        const dem_body *b = &body[solid->slot];
        const double *last = &dem->body_x[3 * k];
        if (!b->present || !silt_dem_finite(3, b->x) || !silt_dem_finite(3, b->v) || !silt_dem_finite(3, b->omega) ||
            !silt_dem_finite(3, b->axis[0])) {
            return dem_link_give_up(&dem->link, err, "rigid body %d %s; it was last at %s", k,
                                    b->present ? "is not finite after the run"
                                               : "has left the box of the discrete elements",
                                    silt_dem_place(&dem->def, last).text);
        }
        memcpy(dem->body_contact + 6 * k, b->contact, sizeof b->contact);
        memcpy(dem->body_answer + 6 * k, b->answer, sizeof b->answer);
        double omega[3], q[4];
        dem_turned(dem, k, b, omega, q);
        dem_pose(dem, k, b->x, b->v, omega, q);
    }
    return SILT_OK;
}

// ---- a run

// the free bodies and the fixed ones' spheres, once
static silt_status dem_begin(silt_dem *dem, silt_error *err) {
    if (dem->begun)
        return SILT_OK;
    SILT_TRY(dem_tell(dem, DEM_BODIES, 0, err));
    dem_measure_axes(dem);
    dem->next_tag = dem->n_free_sphere + 1;
    dem->begun = true;
    return SILT_OK;
}

static silt_status dem_check_add(const silt_dem *dem, silt_error *err) {
    const silt_dem_def *def = &dem->def;
    int64_t last = dem->last_id;
    for (int k = 0; k < dem->n_add; k++) {
        const silt_dem_sphere *a = &dem->add[k];
        long long id = a->id;
        if (a->id <= last)
            return silt_fail(err, SILT_FAILED,
                             "sphere %lld was added after sphere %lld; ids must rise and are used once", id,
                             (long long)last);
        if (!silt_dem_finite(3, a->x) || !silt_dem_finite(3, a->v) || !silt_dem_finite(3, a->omega))
            return silt_fail(err, SILT_FAILED, "sphere %lld is not finite: x %s, v %s, omega (%g, %g, %g)", id,
                             silt_dem_place(&dem->def, a->x).text, silt_dem_place(&dem->def, a->v).text, a->omega[0], a->omega[1], a->omega[2]);
        if (!(a->radius > 0) || a->radius > def->max_radius * (1 + 1e-12) || !(a->density > 0) || !isfinite(a->density))
            return silt_fail(
                err, SILT_FAILED,
                "sphere %lld has radius %g m and density %g kg/m3; the radius must be above 0 and at most %g m", id,
                a->radius, a->density, def->max_radius);
        bool outside = false;
        for (int d = 0; d < (def->dim == 3 ? 3 : 2); d++)
            outside |= a->x[d] < def->lo[d] || a->x[d] >= def->hi[d];
        if (outside)
            return silt_fail(err, SILT_FAILED, "sphere %lld at %s lies outside the box %s to %s", id, silt_dem_place(&dem->def, a->x).text,
                             silt_dem_place(&dem->def, def->lo).text, silt_dem_place(&dem->def, def->hi).text);
        last = a->id;
    }
    return SILT_OK;
}

static int dem_find(const silt_dem *dem, int64_t id) {
    int lo = 0, hi = dem->n_live;
    while (lo < hi) {
        int middle = lo + (hi - lo) / 2;
        if (dem->live[middle].id < id)
            lo = middle + 1;
        else
            hi = middle;
    }
    return lo < dem->n_live && dem->live[lo].id == id ? lo : -1;
}

// writes the queued edits; ids become tags, which rise with them
static void dem_write_edits(silt_dem *dem, bool fixed_bodies) {
    dem_shared *s = dem->link.shared;
    int *gone = DEM_SECTION(s, int, remove);
    dem_add *add = DEM_SECTION(s, dem_add, add);
    int n = 0;

    // one that left by itself is gone already
    for (int k = 0; k < dem->n_remove; k++) {
        int i = dem_find(dem, dem->remove[k]);
        if (i >= 0 && !dem->live[i].gone) {
            dem->live[i].gone = 1;
            gone[n++] = dem->live[i].tag;
        }
    }
    s->n_remove = n;
    if (n > 0) {
        int kept = 0;
        for (int i = 0; i < dem->n_live; i++)
            if (!dem->live[i].gone)
                dem->live[kept++] = dem->live[i];
        dem->n_live = kept;
    }
    // fixed bodies are frozen spheres without an id
    n = 0;
    for (int k = 0; fixed_bodies && k < dem->n_solid; k++) {
        const silt_dem_body *b = &dem->solid[k].def;
        for (int i = 0; b->fixed && i < b->n_sphere; i++) {
            add[n] = (dem_add){.tag = dem->next_tag++, .type = DEM_TYPE_FIXED_BODY, .density = 1000};
            add[n].radius = silt_dem_sphere_at(&dem->def, b, i, add[n].x);
            n++;
        }
    }
    SILT_RESERVE(dem->live, dem->cap_live, dem->n_live + dem->n_add + 1);
    for (int k = 0; k < dem->n_add; k++) {
        const silt_dem_sphere *a = &dem->add[k];
        bool moves = a->kind == DEM_GRAIN;
        dem_add *to = &add[n++];
        *to = (dem_add){.tag = dem->next_tag++,
                        .type = moves ? DEM_TYPE_GRAIN : DEM_TYPE_FROZEN,
                        .radius = a->radius,
                        .density = a->density};
        memcpy(to->x, a->x, sizeof to->x);
        if (moves) {
            memcpy(to->v, a->v, sizeof to->v);
            memcpy(to->omega, a->omega, sizeof to->omega);
        }
        dem->live[dem->n_live++] = (struct dem_live){.id = a->id, .tag = to->tag, .kind = (uint8_t)a->kind};
        dem->last_id = a->id;
    }
    s->n_add = n;
    dem->n_remove = dem->n_add = 0;
}

silt_status silt_dem_start(silt_dem *dem, int n_step, const double *force, const double *body_force,
                           const double *body_torque, silt_error *err) {
    if (dem->link.failed)
        return silt_fail(err, SILT_FAILED, "%s", dem->link.why.text);
    if (dem->link.busy || n_step < 0)
        return silt_fail(err, SILT_FAILED, "discrete elements: %s",
                         n_step < 0 ? "a negative number of substeps" : "a run is under way");
    SILT_TRY(dem_check_add(dem, err));
    SILT_TRY(silt_dem_check_load(&dem->def, &dem->state, force, body_force, body_torque, err));
    bool first = !dem->begun;
    SILT_TRY(dem_begin(dem, err));

    int n_fixed = 0, n_grain = 0;
    for (int k = 0; first && k < dem->n_solid; k++)
        n_fixed += dem->solid[k].def.fixed ? dem->solid[k].def.n_sphere : 0;
    for (int i = 0; i < dem->n_live; i++)
        n_grain += dem->live[i].kind == DEM_GRAIN;
    dem_shared *s = dem->link.shared;
    s->n_step = n_step;
    s->keep = dem->keep;
    dem->keep = false;
    s->n_remove = dem->n_remove;
    s->n_add = dem->n_add + n_fixed;
    s->n_force = force ? dem->state.n_grain : 0;
    s->n_torque = dem->torque ? dem->state.n_grain : 0;
    s->n_shift = dem->shift ? dem->state.n_grain : 0;
    s->n_response = dem->response ? 36 * dem->n_free * dem->n_free : 0;
    s->n_guide = dem->n_guide;
    s->max_grain = n_grain + dem->n_add;
    SILT_TRY(dem_link_reserve(&dem->link, err));
    s = dem->link.shared;
    dem_write_edits(dem, first);
    if (dem->def.n_motion)
        dem_write_walls(dem);
    // the layout may have moved: walls and bodies stand before what changes length
    if (force)
        memcpy(DEM_SECTION(s, double, force), force, 3 * (size_t)dem->state.n_grain * sizeof(double));
    if (dem->torque)
        memcpy(DEM_SECTION(s, double, torque), dem->torque, 3 * (size_t)s->n_torque * sizeof(double));
    if (dem->shift)
        memcpy(DEM_SECTION(s, double, shift), dem->shift, 3 * (size_t)s->n_shift * sizeof(double));
    if (dem->response)
        memcpy(DEM_SECTION(s, double, response), dem->response, (size_t)s->n_response * sizeof(double));
    if (dem->n_guide)
        memcpy(DEM_SECTION(s, char, guide), dem->guide, (size_t)dem->n_guide);
    dem->torque = dem->shift = dem->response = NULL;
    dem->n_guide = 0;
    for (int k = 0; k < dem->n_solid; k++) {
        if (dem->solid[k].slot < 0)
            continue;
        dem_body *b = &DEM_SECTION(s, dem_body, body)[dem->solid[k].slot];
        for (int c = 0; c < 3; c++) {
            b->force[c] = body_force ? body_force[3 * k + c] : 0;
            b->torque[c] = body_torque ? body_torque[3 * k + c] : 0;
        }
    }
    return dem_link_send(&dem->link, DEM_RUN, err);
}

void silt_dem_twist(silt_dem *dem, const double *torque) { dem->torque = torque; }
void silt_dem_shift(silt_dem *dem, const double *shift) { dem->shift = shift; }
void silt_dem_respond(silt_dem *dem, const double *matrix) { dem->response = matrix; }

void silt_dem_keep(silt_dem *dem) { dem->keep = true; }

void silt_dem_guide(silt_dem *dem, const void *guide, size_t size) { dem->guide = guide, dem->n_guide = (int)size; }
const dem_guide *silt_dem_guided(const silt_dem *dem) {
    return dem->link.shared->n_guide ? DEM_SECTION(dem->link.shared, const dem_guide, guide) : NULL;
}

silt_status silt_dem_wait(silt_dem *dem, silt_error *err) {
    if (dem->link.failed)
        return silt_fail(err, SILT_FAILED, "%s", dem->link.why.text);
    if (!dem->link.busy)
        return SILT_OK;
    // what was waited for are the substeps first, then what LIGGGHTS does around them
    const double since = silt_seconds();
    SILT_TRY(dem_link_collect(&dem->link, err));
    const dem_shared *s = dem->link.shared;
    silt_clock_book(CLOCK_grains,
                    silt_clock_else(s->cpu_all) ? s->cpu : silt_min(silt_seconds() - since, s->seconds));
    return dem_take(dem, err);
}

// ---- checkpoint

enum { SAVED_BEGUN, SAVED_LIVE, SAVED_REMOVE, SAVED_ADD, SAVED_SOLID, SAVED_SPHERE, SAVED_TAG, SAVED_LENGTH };
enum { ADD_LENGTH = 11, SOLID_LENGTH = 34 };

// the bodies: what they are, and the axis that their angle is measured from
static silt_status dem_save_solids(const silt_dem *dem, silt_store *store, int n_sphere, silt_error *err) {
    double *number = silt_alloc((size_t)SOLID_LENGTH * (size_t)dem->n_solid + 1, sizeof *number);
    const size_t width = (size_t)silt_clump_width(dem->def.dim);
    double *sphere = silt_alloc(width * (size_t)n_sphere + 1, sizeof *sphere);
    int first = 0;

    for (int k = 0; k < dem->n_solid; k++) {
        const silt_dem_body *b = &dem->solid[k].def;
        double row[SOLID_LENGTH] = {b->n_sphere, b->fixed,    b->mass,     b->inertia, b->x[0],
                                    b->x[1],     b->x[2],     b->v[0],     b->v[1],    b->v[2],
                                    b->omega[0], b->omega[1], b->omega[2], b->angle,   dem->solid[k].axis};
        memcpy(row + 15, b->tensor, sizeof b->tensor);
        memcpy(row + 21, b->q, sizeof b->q);
        memcpy(row + 25, dem->solid[k].frame, sizeof dem->solid[k].frame);
        memcpy(&number[SOLID_LENGTH * k], row, sizeof row);
        memcpy(&sphere[width * (size_t)first], b->sphere, width * (size_t)b->n_sphere * sizeof *sphere);
        first += b->n_sphere;
    }
    silt_status status =
        silt_store_put(store, "dem/body", STORE_DOUBLE, (size_t)SOLID_LENGTH * (size_t)dem->n_solid, number, err);
    if (status == SILT_OK)
        status = silt_store_put(store, "dem/body_sphere", STORE_DOUBLE, width * (size_t)n_sphere, sphere, err);
    free(number);
    free(sphere);
    return status;
}

static silt_status dem_load_solids(silt_dem *dem, silt_store *store, int n_solid, int n_sphere, silt_error *err) {
    double *number = silt_alloc((size_t)SOLID_LENGTH * (size_t)n_solid + 1, sizeof *number);
    const size_t width = (size_t)silt_clump_width(dem->def.dim);
    double *sphere = silt_alloc(width * (size_t)n_sphere + 1, sizeof *sphere);
    int first = 0;

    silt_status status =
        silt_store_take(store, "dem/body", STORE_DOUBLE, (size_t)SOLID_LENGTH * (size_t)n_solid, number, err);
    if (status == SILT_OK)
        status = silt_store_take(store, "dem/body_sphere", STORE_DOUBLE, width * (size_t)n_sphere, sphere, err);
    for (int k = 0; status == SILT_OK && k < n_solid; k++) {
        const double *row = &number[SOLID_LENGTH * k];
        silt_dem_body body = {
            .n_sphere = (int)row[0], .fixed = row[1] != 0, .mass = row[2], .inertia = row[3], .angle = row[13]};
        if (body.n_sphere < 1 || body.n_sphere > n_sphere - first) {
            status = silt_fail(err, SILT_FAILED, "dem/body: rigid body %d has %d spheres of %d", k, body.n_sphere,
                               n_sphere - first);
            break;
        }
        memcpy(body.x, &row[4], sizeof body.x);
        memcpy(body.v, &row[7], sizeof body.v);
        memcpy(body.omega, &row[10], sizeof body.omega);
        memcpy(body.tensor, &row[15], sizeof body.tensor);
        memcpy(body.q, &row[21], sizeof body.q);
        body.sphere = &sphere[width * (size_t)first];
        first += body.n_sphere;
        status = silt_dem_add_body(dem, &body, err);
        if (status != SILT_OK)
            break;
        dem->solid[k].axis = row[14];
        memcpy(dem->solid[k].frame, &row[25], sizeof dem->solid[k].frame);
    }
    free(number);
    free(sphere);
    return status;
}

// the edits that wait for the next run
static silt_status dem_save_queue(const silt_dem *dem, silt_store *store, silt_error *err) {
    double *number = silt_alloc((size_t)ADD_LENGTH * (size_t)dem->n_add + 1, sizeof *number);
    int64_t *id = silt_alloc(2 * (size_t)dem->n_add + 1, sizeof *id);

    for (int k = 0; k < dem->n_add; k++) {
        const silt_dem_sphere *a = &dem->add[k];
        double row[ADD_LENGTH] = {a->x[0],     a->x[1],     a->x[2],     a->v[0],   a->v[1],   a->v[2],
                                  a->omega[0], a->omega[1], a->omega[2], a->radius, a->density};
        memcpy(&number[ADD_LENGTH * k], row, sizeof row);
        id[2 * k] = a->id;
        id[2 * k + 1] = a->kind;
    }
    silt_status status =
        silt_store_put(store, "dem/add", STORE_DOUBLE, (size_t)ADD_LENGTH * (size_t)dem->n_add, number, err);
    if (status == SILT_OK)
        status = silt_store_put(store, "dem/add_id", STORE_LONG, 2 * (size_t)dem->n_add, id, err);
    if (status == SILT_OK)
        status = silt_store_put(store, "dem/remove", STORE_LONG, (size_t)dem->n_remove, dem->remove, err);
    free(number);
    free(id);
    return status;
}

static silt_status dem_load_queue(silt_dem *dem, silt_store *store, int n_add, int n_remove, silt_error *err) {
    double *number = silt_alloc((size_t)ADD_LENGTH * (size_t)n_add + 1, sizeof *number);
    int64_t *id = silt_alloc(2 * (size_t)n_add + 1, sizeof *id);

    SILT_RESERVE(dem->remove, dem->cap_remove, n_remove + 1);
    silt_status status =
        silt_store_take(store, "dem/add", STORE_DOUBLE, (size_t)ADD_LENGTH * (size_t)n_add, number, err);
    if (status == SILT_OK)
        status = silt_store_take(store, "dem/add_id", STORE_LONG, 2 * (size_t)n_add, id, err);
    if (status == SILT_OK)
        status = silt_store_take(store, "dem/remove", STORE_LONG, (size_t)n_remove, dem->remove, err);
    for (int k = 0; status == SILT_OK && k < n_add; k++) {
        const double *row = &number[ADD_LENGTH * k];
        silt_dem_sphere a = {
            .id = id[2 * k], .kind = (silt_dem_kind)id[2 * k + 1], .radius = row[9], .density = row[10]};
        memcpy(a.x, row, sizeof a.x);
        memcpy(a.v, row + 3, sizeof a.v);
        memcpy(a.omega, row + 6, sizeof a.omega);
        silt_dem_add(dem, 1, &a);
    }
    if (status == SILT_OK)
        dem->n_remove = n_remove;
    free(number);
    free(id);
    return status;
}

silt_status silt_dem_save(silt_dem *dem, silt_store *store, silt_error *err) {
    unsigned char *bytes = NULL;
    int64_t *id = NULL;
    size_t size = 0;
    int n_sphere = 0;
    silt_status status;

    if (dem->link.failed || dem->link.busy)
        return silt_fail(err, SILT_FAILED, "%s",
                         dem->link.failed ? dem->link.why.text : "discrete elements: saved while a run is under way");
    for (int k = 0; k < dem->n_solid; k++)
        n_sphere += dem->solid[k].def.n_sphere;
    if (dem->begun) {
        SILT_TRY(dem_link_send(&dem->link, DEM_SAVE, err));
        SILT_TRY(dem_link_collect(&dem->link, err));
        SILT_TRY(dem_link_read(&dem->link, &bytes, &size, err));
    }
    int64_t length[SAVED_LENGTH] = {dem->begun,   dem->n_live, dem->n_remove, dem->n_add,
                                    dem->n_solid, n_sphere,    dem->next_tag};
    id = silt_alloc(3 * (size_t)dem->n_live + 1, sizeof *id);
    for (int i = 0; i < dem->n_live; i++) {
        id[3 * i] = dem->live[i].id;
        id[3 * i + 1] = dem->live[i].tag;
        id[3 * i + 2] = dem->live[i].kind;
    }
    status = silt_store_put(store, "dem/length", STORE_LONG, SAVED_LENGTH, length, err);
    if (status == SILT_OK)
        status = silt_store_put(store, "dem/last_id", STORE_LONG, 1, &dem->last_id, err);
    if (status == SILT_OK)
        status = silt_store_put(store, "dem/id", STORE_LONG, 3 * (size_t)dem->n_live, id, err);
    if (status == SILT_OK && dem->begun)
        status = silt_store_put(store, "dem/restart", STORE_BYTE, size, bytes, err);
    if (status == SILT_OK)
        status = dem_save_queue(dem, store, err);
    if (status == SILT_OK)
        status = dem_save_solids(dem, store, n_sphere, err);
    free(bytes);
    free(id);
    return status;
}

// LIGGGHTS' restart through the worker's file
static silt_status dem_load_restart(silt_dem *dem, silt_store *store, silt_error *err) {
    size_t size = 0;
    SILT_TRY(silt_store_count(store, "dem/restart", &size, err));
    unsigned char *bytes = silt_alloc(size + 1, 1);
    silt_status status = silt_store_take(store, "dem/restart", STORE_BYTE, size, bytes, err);
    if (status == SILT_OK)
        status = dem_link_write(&dem->link, bytes, size, err);
    free(bytes);
    return status;
}

static silt_status dem_load_live(silt_dem *dem, silt_store *store, int n, int *n_grain, silt_error *err) {
    int64_t *id = silt_alloc(3 * (size_t)n + 1, sizeof *id);
    silt_status status = silt_store_take(store, "dem/id", STORE_LONG, 3 * (size_t)n, id, err);
    *n_grain = 0;
    if (status == SILT_OK) {
        SILT_RESERVE(dem->live, dem->cap_live, n + 1);
        for (int i = 0; i < n; i++) {
            dem->live[i] =
                (struct dem_live){.id = id[3 * i], .tag = (int)id[3 * i + 1], .kind = (uint8_t)id[3 * i + 2]};
            *n_grain += dem->live[i].kind == DEM_GRAIN;
        }
        dem->n_live = n;
    }
    free(id);
    return status;
}

silt_status silt_dem_load(silt_dem **dem, const silt_dem_def *def, silt_store *store, silt_error *err) {
    silt_dem *d = NULL;
    int64_t length[SAVED_LENGTH];
    int n_grain = 0;

    *dem = NULL;
    SILT_TRY(silt_store_take(store, "dem/length", STORE_LONG, SAVED_LENGTH, length, err));
    for (int k = SAVED_LIVE; k < SAVED_LENGTH; k++)
        if (length[k] < 0 || length[k] > INT32_MAX / SOLID_LENGTH)
            return silt_fail(err, SILT_FAILED, "dem/length: number %d is %lld", k, (long long)length[k]);
    SILT_TRY(dem_create(&d, def, true, err));
    silt_status status = dem_load_solids(d, store, (int)length[SAVED_SOLID], (int)length[SAVED_SPHERE], err);
    if (status == SILT_OK)
        status = dem_load_queue(d, store, (int)length[SAVED_ADD], (int)length[SAVED_REMOVE], err);
    if (status == SILT_OK)
        status = dem_load_live(d, store, (int)length[SAVED_LIVE], &n_grain, err);
    if (status == SILT_OK)
        status = silt_store_take(store, "dem/last_id", STORE_LONG, 1, &d->last_id, err);
    if (status == SILT_OK && length[SAVED_BEGUN])
        status = dem_load_restart(d, store, err);
    if (status == SILT_OK) {
        d->next_tag = (int)length[SAVED_TAG];
        d->begun = length[SAVED_BEGUN] != 0;
        d->link.shared->resume = d->begun;
        status = dem_tell(d, DEM_OPEN, n_grain, err);
    }
    if (status == SILT_OK && d->begun)
        status = dem_take(d, err);
    if (status == SILT_OK)
        *dem = d;
    else
        silt_dem_close(&d);
    return status;
}
