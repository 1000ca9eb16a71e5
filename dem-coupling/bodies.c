// bodies.c: rigid objects of the scene: surfaces, clumps, masses and places, and what the discrete elements are told of them
#include "pose.h"
#include "state.h"

static const double clump_spacing = 0.3; // between the spheres of an outline, times their radius
static const double clump_finer = 0.7;   // from one radius to the next when a clump has to follow its outline more closely
static const double skin_slack = 0.05;   // times h: how far behind a wall a surface may stand that stands for a round one

double silt_coupling_body_size(const silt_scene *scene, const silt_body_def *def, double radius) {
    double h = scene->fluid.size;
    if (!scene->fluid.on)
        return radius / 6.0;
    for (int k = 0; k < scene->fluid.n_size; k++) {
        const silt_size_def *size = &scene->fluid.size_at[k];
        if (size->near == NEAR_BODIES || (size->near == NEAR_REGION && silt_region_distance(&size->region, scene->dimension == 3 ? 3 : 2, def->at) < 0.0))
            h = silt_min(h, size->size);
    }
    return h;
}

static silt_status body_plane(coupling_body *body, struct silt_body *state, const silt_body_def *def, double angle, silt_error *err) {
    SILT_TRY(silt_outline_create(&body->shape, def, err));
    silt_clump_create(&body->clump, &body->shape, 0.0, clump_spacing);
    for (int k = 0; k < 40 && def->clump_error > 0.0 && body->clump.error > def->clump_error; k++)
        silt_clump_create(&body->clump, &body->shape, clump_finer * body->clump.largest, clump_spacing);
    state->q[0] = cos(angle / 2.0);
    state->q[3] = sin(angle / 2.0);
    state->mass = def->density * body->shape.area;
    state->inertia[2] = def->density * body->shape.inertia;
    state->volume = body->shape.area;
    state->n_point = body->shape.n_point;
    state->point = body->shape.point;
    return SILT_OK;
}

void silt_coupling_orientation(const silt_body_def *def, double angle, double q[4]) {
    const double length = silt_length(3, def->axis), half = angle / 2.0;
    q[0] = cos(half);
    for (int d = 0; d < 3; d++)
        q[1 + d] = length > 0.0 ? sin(half) * def->axis[d] / length : 0.0;
}

static silt_status body_space(const silt_scene *scene, coupling_body *body, struct silt_body *state, const silt_body_def *def, double angle,
                              silt_error *err) {
    char what[96];
    SILT_TRY(silt_form_create(&body->form, def, err));
    const double h = silt_coupling_body_size(scene, def, body->form.radius), thickness = silt_form_thickness(&body->form);
    if (scene->fluid.on && thickness < h)
        return silt_fail(err, SILT_INPUT, "body %s: scale: found parts only %g m thick, allowed at least the water's size there, %g m: make it thicker or the mesh finer",
                         def->name, thickness, h);
    snprintf(what, sizeof what, "body %.40s at the mesh's size of %g m", def->name, h);
    SILT_TRY(silt_solid_mesh(&body->form, h, what, &body->skin, err));
    silt_form_clump(&body->clump, &body->form, def->clump_error);
    silt_coupling_orientation(def, angle, state->q);
    for (int d = 0; d < 3; d++)
        state->w[d] = body->fixed ? 0.0 : def->spin[d];
    state->mass = def->density * body->form.volume;
    for (int k = 0; k < 6; k++)
        state->inertia[k] = def->density * body->form.inertia[k];
    state->volume = body->form.volume;
    state->n_point = body->skin.n_point;
    state->point = body->skin.point[0];
    state->n_face = body->skin.n_face;
    state->face = (const int(*)[3])body->skin.face;
    state->solid = &body->skin;
    return SILT_OK;
}

// ---------------------------------------------------------------- places

// the surface where the body stands, to be cleared
static void body_placed(const silt_coupling *c, int i, silt_solid *placed) {
    const struct silt_body *b = &c->bodies->body[i];
    const silt_solid *skin = &c->body[i].skin;
    *placed = (silt_solid){.n_point = skin->n_point, .n_face = skin->n_face};
    placed->point = silt_alloc((size_t)skin->n_point, sizeof *placed->point);
    placed->face = silt_alloc((size_t)skin->n_face, sizeof *placed->face);
    memcpy(placed->face, skin->face, (size_t)skin->n_face * sizeof *placed->face);
    for (int k = 0; k < skin->n_point; k++) {
        silt_turn(b->q, false, skin->point[k], placed->point[k]);
        for (int d = 0; d < 3; d++)
            placed->point[k][d] += b->x[d];
    }
}

static silt_status body_behind(const silt_coupling *c, int i, const silt_solid *placed, silt_error *err) {
    const double slack = skin_slack * c->scene->fluid.size + 1e-6 * placed->radius;
    for (int k = 0; k < placed->n_point && c->walls != NULL && c->walls->count; k++) {
        int element;
        if (silt_walls_distance(c->walls, placed->point[k], &element) < -slack)
            return silt_fail(err, SILT_INPUT, "body %s: at: found its surface behind a wall at (%g, %g, %g), allowed bodies inside of the walls",
                             c->scene->body[i].name, placed->point[k][0], placed->point[k][1], placed->point[k][2]);
    }
    return SILT_OK;
}

static silt_status bodies_apart(const silt_coupling *c, silt_error *err) {
    const int n = c->bodies->count;
    silt_status status = SILT_OK;
    silt_solid *placed = silt_alloc((size_t)n, sizeof *placed);
    for (int i = 0; i < n && status == SILT_OK; i++) {
        body_placed(c, i, &placed[i]);
        status = silt_solid_close(&placed[i], c->scene->body[i].name, err);
        if (status == SILT_OK)
            status = body_behind(c, i, &placed[i], err);
        for (int k = 0; k < i && status == SILT_OK; k++) {
            const double d[3] = {placed[i].centroid[0] - placed[k].centroid[0], placed[i].centroid[1] - placed[k].centroid[1],
                                 placed[i].centroid[2] - placed[k].centroid[2]};
            if (silt_length(3, d) < placed[i].radius + placed[k].radius &&
                (silt_solid_crossing(&placed[i], &placed[k]) >= 0 || silt_solid_contains(&placed[i], placed[k].point[0]) ||
                 silt_solid_contains(&placed[k], placed[i].point[0])))
                status = silt_fail(err, SILT_INPUT, "body %s: at: found the body overlapping body '%s', allowed bodies apart from each other",
                                   c->scene->body[i].name, c->scene->body[k].name);
        }
    }
    for (int i = 0; i < n; i++)
        silt_solid_clear(&placed[i]);
    free(placed);
    return status;
}

silt_status silt_coupling_bodies(silt_coupling *c, silt_error *err) {
    const silt_scene *scene = c->scene;
    size_t n = (size_t)scene->n_body;
    c->body = silt_alloc(n, sizeof *c->body);
    c->body_force = silt_alloc(3 * n, sizeof(double));
    c->body_torque = silt_alloc(3 * n, sizeof(double));
    c->bodies = silt_alloc(1, sizeof *c->bodies);
    c->bodies->body = silt_alloc(n, sizeof *c->bodies->body);
    c->bodies->count = scene->n_body;
    for (int i = 0; i < scene->n_body; i++) {
        const silt_body_def *def = &scene->body[i];
        struct silt_body *state = &c->bodies->body[i];
        c->body[i].fixed = def->motion == MOTION_FIXED;
        double place[4];
        silt_coupling_place(c, i, 0.0, place);
        for (int k = 0; k < c->dim; k++) {
            state->x[k] = place[k];
            state->v[k] = c->body[i].fixed ? 0.0 : def->velocity[k];
        }
        SILT_TRY(c->dim == 3 ? body_space(scene, &c->body[i], state, def, def->angle * M_PI / 180.0, err)
                             : body_plane(&c->body[i], state, def, place[3], err));
        memcpy(c->body[i].first, state->q, sizeof state->q);
    }
    for (int i = 0; i < scene->n_body; i++) {
        c->bodies->body[i].n_sphere = c->body[i].clump.n_sphere;
        c->bodies->body[i].clump_error = c->body[i].clump.error;
    }
    return c->dim == 3 ? bodies_apart(c, err) : SILT_OK;
}

silt_status silt_coupling_describe(const silt_scene *scene, FILE *to, silt_error *err) {
    silt_coupling c = {.scene = scene, .dim = scene->dimension == 3 ? 3 : 2};
    const silt_status status = silt_coupling_bodies(&c, err);
    for (int i = 0; i < scene->n_body && status == SILT_OK; i++) {
        const struct silt_body *b = &c.bodies->body[i];
        fprintf(to, "  body       %s: %g %s, %g kg%s, clump of %d spheres within %.3g m of its surface\n", scene->body[i].name, b->volume,
                c.dim == 3 ? "m3" : "m2", b->mass, c.dim == 3 ? "" : " per m", b->n_sphere, b->clump_error);
    }
    silt_coupling_bodies_clear(&c);
    free(c.body);
    free(c.body_force);
    free(c.body_torque);
    return status;
}

void silt_coupling_bodies_clear(silt_coupling *c) {
    for (int i = 0; i < c->bodies->count; i++) {
        silt_outline_clear(&c->body[i].shape);
        silt_solid_clear(&c->body[i].form);
        silt_solid_clear(&c->body[i].skin);
        silt_clump_clear(&c->body[i].clump);
    }
    free(c->bodies->body);
    free(c->bodies);
}

silt_status silt_coupling_send_bodies(silt_coupling *c, silt_error *err) {
    silt_status status = SILT_OK;
    for (int i = 0; i < c->bodies->count && status == SILT_OK; i++) {
        const struct silt_body *b = &c->bodies->body[i];
        const silt_clump *clump = &c->body[i].clump;
        silt_dem_body body = {.n_sphere = clump->n_sphere,
                              .sphere = clump->sphere,
                              .mass = b->mass * c->width,
                              .inertia = b->inertia[2] * c->width,
                              .angle = c->dim == 3 ? 0.0 : silt_pose_angle(b->q),
                              .fixed = c->body[i].fixed};
        for (int k = 0; k < 6; k++)
            body.tensor[k] = b->inertia[k] * c->width;
        memcpy(body.q, b->q, sizeof body.q);
        memcpy(body.x, b->x, sizeof body.x);
        memcpy(body.v, b->v, sizeof body.v);
        memcpy(body.omega, b->w, sizeof body.omega);
        status = silt_dem_add_body(c->dem, &body, err);
    }
    return status;
}

double silt_coupling_body_distance(const silt_coupling *c, int i, const double *x, double far) {
    const struct silt_body *b = &c->bodies->body[i];
    if (c->dim == 3) {
        double d[3] = {x[0] - b->x[0], x[1] - b->x[1], x[2] - b->x[2]}, bound = silt_length(3, d) - c->body[i].skin.radius;
        if (bound > far)
            return bound;
        silt_turn(b->q, true, d, d);
        return silt_max(0.0, silt_solid_distance(&c->body[i].skin, d, NULL, NULL));
    }
    double d[2] = {x[0] - b->x[0], x[1] - b->x[1]}, bound = hypot(d[0], d[1]) - c->body[i].shape.radius;
    if (bound > far)
        return bound;
    double angle = silt_pose_angle(b->q);
    double local[2] = {cos(angle) * d[0] + sin(angle) * d[1], cos(angle) * d[1] - sin(angle) * d[0]};
    return silt_outline_distance(&c->body[i].shape, local);
}
