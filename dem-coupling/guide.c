// guide.c: what the worker is told of bodies that are held, prescribed, tied or set free, and of walls whose speed changes in a run
#include "guide.h"

#include "pose.h"
#include "state.h"

// s, end of substep k of the n that end when the walls stand where they are
static double guide_time(const silt_coupling *c, int n, int k) { return c->walls->time - (n - k) * c->step; }

void silt_coupling_bodies_gone(const silt_coupling *c) {
    for (int i = 0; i < c->bodies->count; i++) {
        struct silt_body *b = &c->bodies->body[i];
        const double radius = c->dim == 3 ? c->body[i].skin.radius : c->body[i].shape.radius, margin = c->box_margin;
        // half way out at most, so far from the end of the box that it stays in it
        const double most = silt_min(0.9 * margin, silt_max(0.5 * margin, radius + 0.1 * margin));
        b->gone = false;
        for (int d = c->dem_def.periodic ? 1 : 0; d < c->dim && c->scene->body[i].motion == MOTION_FREE; d++)
            b->gone |= b->x[d] < c->dem_def.lo[d] + most || b->x[d] > c->dem_def.hi[d] - most;
    }
}

static bool guide_holds(const silt_body_def *def) { return def->held || def->release.on; }

// of the scene's bodies, in the order that the worker has the free ones
static int guide_slot(const silt_coupling *c, int body) {
    int slot = 0;
    for (int i = 0; i < body; i++)
        slot += !c->body[i].fixed;
    return slot;
}

void silt_coupling_place(const silt_coupling *c, int i, double time, double place[4]) {
    const silt_body_def *def = &c->scene->body[i];
    silt_path_at(&def->path, time, place);
    for (int d = 0; d < 3; d++)
        place[d] += def->at[d];
    place[3] += c->dim == 3 ? 0 : def->angle * M_PI / 180;
}

// how far the path has turned a body: in space from x to z, besides what `angle` says
static double guide_turned(const silt_coupling *c, int i) {
    const struct silt_body *b = &c->bodies->body[i];
    double x[3] = {1, 0, 0};
    if (c->dim != 3)
        return silt_pose_angle(b->q);
    silt_turn(c->body[i].first, true, x, x);
    silt_turn(b->q, false, x, x);
    return atan2(x[2], x[0]);
}

static void guide_body(const silt_coupling *c, dem_guide *guide, dem_guided *to, int i, int *n_path) {
    const silt_body_def *def = &c->scene->body[i];
    const int n = guide->n_step;
    *to = (dem_guided){.slot = guide_slot(c, i), .held = def->held, .path = -1, .release = INT32_MAX, .force = HUGE_VAL};
    if (c->bodies->body[i].gone)
        to->held = HELD_ALL;
    else if (def->motion == MOTION_PRESCRIBED) {
        to->path = (*n_path)++;
        double(*row)[4] = dem_guide_path(guide, to->path);
        for (int k = 0; k <= n; k++) {
            silt_coupling_place(c, i, guide_time(c, n, k + 1), row[k]);
            row[k][3] -= guide_turned(c, i);
        }
    } else if (def->release.on && !c->body[i].freed) {
        to->held = HELD_ALL;
        if (!isnan(def->release.force))
            to->force = def->release.force * c->width;
        // free at the end of the first substep that ends then or later
        for (int k = 0; k <= n && !isnan(def->release.time) && to->release == INT32_MAX; k++)
            if (guide_time(c, n, k) >= def->release.time - 1e-9 * c->step)
                to->release = k;
    }
}

static void guide_ties(const silt_coupling *c, int i, dem_tie *to) {
    const silt_body_def *def = &c->scene->body[i];
    for (int k = 0; k < def->n_spring; k++) {
        const silt_spring_def *s = &def->spring[k];
        to[k] = (dem_tie){.slot = guide_slot(c, i), .line = s->line, .stiffness = s->stiffness * c->width, .damping = s->damping * c->width,
                          .length = s->length};
        for (int d = 0; d < 3; d++)
            to[k].arm[d] = s->at[d] - def->at[d];
        silt_turn(c->body[i].first, true, to[k].arm, to[k].arm);
        silt_turn(c->bodies->body[i].q, false, to[k].arm, to[k].arm);
        memcpy(to[k].to, s->to, sizeof to[k].to);
    }
}

// a held body that was freed keeps what the scene holds for good
static bool guide_needed(const silt_coupling *c, int i) {
    const silt_body_def *def = &c->scene->body[i];
    return def->motion == MOTION_PRESCRIBED || c->bodies->body[i].gone || (guide_holds(def) && (def->held || !c->body[i].freed));
}

static void guide_walls(silt_coupling *c, dem_guide *guide) {
    for (int m = 0; m < guide->n_wall; m++) {
        double(*row)[4] = dem_guide_wall(guide, m);
        silt_coupling_wall_rates(c, m, guide->n_step, row);
    }
}

void silt_coupling_guide(silt_coupling *c, int n) {
    dem_guide head = {.n_step = n, .n_wall = c->accelerates ? c->n_motion : 0, .n_trace = silt_trace_count(c)};
    for (int i = 0; i < c->bodies->count; i++) {
        head.n_body += guide_needed(c, i);
        head.n_path += c->scene->body[i].motion == MOTION_PRESCRIBED;
        head.n_tie += c->scene->body[i].n_spring;
    }
    if (n == 0 || (!head.n_body && !head.n_tie && !head.n_wall && !head.n_trace))
        return;
    const size_t size = dem_guide_size(&head);
    SILT_RESERVE(c->guide, c->guide_capacity, (int)size);
    memset(c->guide, 0, size);
    dem_guide *guide = (dem_guide *)(void *)c->guide;
    *guide = head;
    dem_guided *body = dem_guide_body(guide);
    dem_tie *tie = dem_guide_tie(guide);
    for (int i = 0, n_path = 0; i < c->bodies->count; i++) {
        if (guide_needed(c, i))
            guide_body(c, guide, body++, i, &n_path);
        guide_ties(c, i, tie);
        tie += c->scene->body[i].n_spring;
    }
    guide_walls(c, guide);
    if (head.n_trace)
        silt_trace_ask(c, guide);
    silt_dem_guide(c->dem, c->guide, size);
}

silt_status silt_coupling_freed(silt_coupling *c, bool out, silt_store *store, silt_error *err) {
    const int n = c->bodies->count;
    uint8_t *freed = silt_alloc((size_t)n + 1, 1);
    bool any = false;
    for (int i = 0; i < n; i++) {
        any |= c->scene->body[i].release.on;
        freed[i] = c->body[i].freed;
    }
    silt_status status = SILT_OK;
    if (any)
        status = out ? silt_store_put(store, "coupling/freed", STORE_BYTE, (size_t)n, freed, err)
                     : silt_store_take(store, "coupling/freed", STORE_BYTE, (size_t)n, freed, err);
    for (int i = 0; i < n && status == SILT_OK; i++)
        c->body[i].freed = freed[i];
    free(freed);
    return status;
}

silt_status silt_coupling_guided(silt_coupling *c, silt_error *err) {
    const dem_guide *told = silt_dem_guided(c->dem);
    for (int i = 0, k = 0; told && i < c->bodies->count; i++) {
        if (!guide_needed(c, i))
            continue;
        const dem_guided *body = &dem_guide_body((dem_guide *)(uintptr_t)told)[k++];
        const silt_release_def *release = &c->scene->body[i].release;
        if (release->on && (body->freed || body->release <= told->n_step))
            c->body[i].freed = true;
    }
    return silt_trace_write(c, told, err);
}
