// coupling.c: the time loop's door to the discrete elements: scales between a metre of width and real spheres, keeps
// what LIGGGHTS does not know of grains (parcel mass, forces), and tells it of releases, deposits and the bed's surface
#include "state.h"

static const double parcel_least = 0.4, parcel_most = 2.0; // radii of parcels in contact, times that of grains.parcel
static const double parcel_usual = 0.75;                   // radius that the time step is chosen for
static const double room_overlap = 0.01;                   // of the radius
static const double heap_porosity = 0.4;                   // of what fills the regions, when it has settled
static const double period_share = 3.2;                    // slab thickness over the largest sphere's diameter
static const double period_pieces = 2000;                  // walls are cut into pieces as long as the slab is thick: about as many at most

static void coupling_close(silt_coupling **coupling);

// ---------------------------------------------------------------- sizes

static double coupling_sphere_density(const silt_coupling *c, double mass, double radius) {
    return mass * c->width / (4.0 / 3.0 * M_PI * radius * radius * radius);
}

static double coupling_rayleigh(const silt_contact_def *contact, double radius, double density) {
    return silt_dem_rayleigh(radius, density, contact->youngs_modulus, contact->poissons_ratio);
}

// a crumb of the bed becomes a sphere that the time step can bear: larger than its mass asks for, see silt_coupling_burden
static double coupling_parcel_radius(const silt_coupling *c, double mass) {
    double radius = cbrt(6.0 * c->width * mass / c->scene->bed.density / M_PI) / 2.0;
    return silt_max(radius, parcel_least * c->parcel);
}

double silt_coupling_burden(const silt_coupling *c, const coupling_grain *g) {
    double crumb = parcel_least * c->parcel;
    if (c->parcel <= 0.0 || g->radius > crumb)
        return 1.0;
    double sphere = 4.0 / 3.0 * M_PI * crumb * crumb * crumb * g->mass / g->solid;
    return silt_max(1.0, sphere / (g->mass * c->width));
}

// Thickness of the slab in the plane. Its walls are strips of triangles no longer than it: of a small grain in a large tank there would be
// millions of them, and as many bins. Nothing moves across it, so that it may be thicker.
static double coupling_period(const silt_walls *walls, double largest) {
    double length = 0.0;
    for (int i = 0; i < walls->count; i++)
        length += hypot(walls->to[i][0] - walls->from[i][0], walls->to[i][1] - walls->from[i][1]);
    return silt_max(period_share * 2.0 * largest, length / period_pieces);
}

// widths, radii, time step and everything else that the worker is told once
static void coupling_measure(silt_coupling *c, const silt_coupling_def *def) {
    const silt_scene *scene = c->scene;
    const silt_contact_def *contact = &scene->contact;
    const silt_grains_def *grains = &scene->grains;
    double largest = 0.0, smallest = HUGE_VAL, clump = 0.0, listed = 0.0, squares = 0.0, cubes = 0.0;
    for (int i = 0; i < silt_scene_grains(scene); i++) {
        const double d = silt_scene_grain(scene, i)->diameter;
        listed = silt_max(listed, d);
        smallest = silt_min(smallest, d / 2.0);
        squares += d * d;
        cubes += d * d * d;
    }
    largest = listed / 2.0;
    for (int i = 0; i < scene->n_body; i++) {
        clump = silt_max(clump, c->body[i].clump.largest);
        smallest = silt_min(smallest, c->body[i].clump.smallest);
    }
    largest = silt_max(largest, clump);
    if (scene->bed.on) {
        c->parcel = grains->parcel / 2.0;
        c->crust = c->parcel > 0.0 ? silt_min(0.35 * scene->bed.size, c->parcel) : 0.35 * scene->bed.size;
        largest = silt_max(largest, silt_max(parcel_most * c->parcel, c->crust));
        smallest =
            silt_min(smallest, c->parcel > 0.0 ? silt_min(parcel_least * c->parcel, 0.25 * c->crust) : 0.25 * c->crust);
    }
    if (!(largest > 0.0))
        largest = smallest = scene->fluid.size > 0.0 ? scene->fluid.size : 0.01;

    // physics: with the sphere's own diameter as width a random pack is too loose
    double diameter = silt_max(listed, 2.0 * c->parcel);
    c->width = c->dim == 3 ? 1.0 : grains->width;
    if (!(c->width > 0.0)) {
        if (c->parcel > 0.0)
            c->width = 2.0 / 3.0 * 0.82 * 2.0 * c->parcel / (1.0 - scene->bed.porosity);
        else if (grains->n_filled > 0)
            c->width = 2.0 / 3.0 * 0.82 * cubes / squares / (1.0 - heap_porosity);
        else
            c->width = listed > 0.0 ? 5.0 * listed : 2.0 * largest;
    }

    // the stiffest sphere sets the time step; a body's spheres share its mass
    double rayleigh = HUGE_VAL;
    for (int i = 0; i < silt_scene_grains(scene); i++) {
        const silt_grain_def *g = silt_scene_grain(scene, i);
        rayleigh = silt_min(rayleigh, coupling_rayleigh(contact, g->diameter / 2.0, g->density));
    }
    if (c->parcel > 0.0)
        rayleigh = silt_min(rayleigh, coupling_rayleigh(contact, parcel_usual * c->parcel, scene->bed.density));
    for (int i = 0; i < scene->n_body; i++) {
        const silt_clump *k = &c->body[i].clump;
        double density = coupling_sphere_density(c, c->bodies->body[i].mass / k->n_sphere, k->largest);
        if (!c->body[i].fixed)
            rayleigh =
                silt_min(rayleigh, coupling_rayleigh(contact, k->largest, silt_min(density, scene->body[i].density)));
    }
    if (rayleigh == HUGE_VAL)
        rayleigh = coupling_rayleigh(contact, smallest, 1000.0);
    // a whole number of steps makes a frame, so that the clocks of water and grains are one
    c->step = contact->step * rayleigh;
    if (scene->time.output > 0)
        c->step = scene->time.output / ceil(scene->time.output / c->step);

    c->exchange.law = grains->drag;
    c->exchange.density = scene->fluid.density;
    c->exchange.viscosity = scene->fluid.viscosity;
    c->exchange.refresh = true;
    c->exchange.force.def = (silt_force_def){grains->added_mass, scene->fluid.theta, grains->viscous_force,
                                             grains->lift == LIFT_SAFFMAN, grains->rotational_drag};
    memcpy(c->exchange.gravity, scene->gravity, sizeof c->exchange.gravity);
    c->exchange.layer_grain = !grains->kernel_layers ? 0.0 : squares > 0.0 ? cubes / squares : diameter;
    c->exchange.gusts = grains->gusts > 0.0;
    c->exchange.width = grains->kernel > 0.0 ? grains->kernel : silt_max(3.0 * diameter, 2.0 * scene->fluid.size);

    const bool space = c->dim == 3, periodic = scene->period[0] < scene->period[1];
    silt_coupling_walls(c);
    c->dem_def = (silt_dem_def){
        .worker = def->worker,
        .log = def->log,
        .dim = c->dim,
        .lo = {periodic ? scene->period[0] : def->lo[0], def->lo[1], def->lo[2]},
        .hi = {periodic ? scene->period[1] : def->hi[0], def->hi[1], def->hi[2]},
        .way_lo = {def->way_lo[0], def->way_lo[1], def->way_lo[2]},
        .way_hi = {def->way_hi[0], def->way_hi[1], def->way_hi[2]},
        .periodic = periodic,
        .across = grains->across,
        .period = space ? 0.0 : coupling_period(c->walls, largest),
        .gravity = {scene->gravity[0], scene->gravity[1], scene->gravity[2]},
        .youngs_modulus = contact->youngs_modulus,
        .wall_modulus = contact->wall_modulus,
        .poissons_ratio = contact->poissons_ratio,
        .restitution = contact->restitution,
        .friction = contact->friction,
        .rolling_friction = contact->rolling_friction,
        .body_friction = contact->body_friction,
        .step = c->step,
        .n_wall = space ? 0 : c->walls->count,
        .wall = (const double(*)[4])c->wall,
        .n_triangle = space ? c->walls->count : 0,
        .triangle = (const double(*)[10])c->triangle,
        .wall_motion = c->wall_motion,
        .n_motion = c->n_motion,
        .motion = (const double(*)[3])c->pivot,
        .max_radius = largest,
        .min_radius = smallest,
        .no_contacts = !scene->bed.on || !scene->bed.deposition,
    };
    if (grains->across)
        silt_coupling_sides(c);
}

// ---------------------------------------------------------------- grains

// grains came, went or moved: what was made of them is out of date
static void coupling_touched(silt_coupling *c) {
    c->found = c->view->fresh = c->crowds->fresh[0] = false;
}

static coupling_grain *coupling_append(silt_coupling *c, const double *x, const double *v, double radius) {
    SILT_RESERVE(c->grain, c->grain_capacity, c->n_grain + 1);
    coupling_grain *g = &c->grain[c->n_grain++];
    coupling_touched(c);
    *g = (coupling_grain){.id = c->next_id++, .near = -1, .radius = radius};
    memcpy(g->x, x, (size_t)c->dim * sizeof *x);
    memcpy(g->v, v, (size_t)c->dim * sizeof *v);
    return g;
}

// takes grains that are gone out of the list
static void coupling_compact(silt_coupling *c) {
    if (c->n_gone == 0)
        return;
    int kept = 0;
    coupling_touched(c);
    c->n_gone = 0;
    for (int i = 0; i < c->n_grain; i++)
        if (!c->grain[i].gone)
            c->grain[kept++] = c->grain[i];
    c->n_grain = kept;
}

static void coupling_forget(void *context, int64_t id) {
    silt_coupling *c = context;
    SILT_RESERVE(c->drop, c->drop_capacity, c->n_drop + 1);
    c->drop[c->n_drop++] = id;
}

static void coupling_take(silt_coupling *c, coupling_grain *g) {
    g->gone = true;
    c->n_gone++;
    coupling_touched(c);
    if (g->sent)
        coupling_forget(c, g->id);
}

static const silt_grain_state *coupling_grains(const silt_coupling *c) {
    coupling_view *w = c->view;
    int n = c->n_grain, count = 0;
    if (w->fresh)
        return &w->state;
    SILT_RESERVE(w->id, w->capacity[0], n);
    SILT_RESERVE(w->x, w->capacity[1], 3 * n);
    SILT_RESERVE(w->v, w->capacity[2], 3 * n);
    SILT_RESERVE(w->omega, w->capacity[3], 3 * n);
    SILT_RESERVE(w->radius, w->capacity[4], n);
    SILT_RESERVE(w->mass, w->capacity[5], n);
    SILT_RESERVE(w->net, w->capacity[6], n);
    SILT_RESERVE(w->contacts, w->capacity[7], n);
    SILT_RESERVE(w->on_bed, w->capacity[8], n);
    SILT_RESERVE(w->contact, w->capacity[9], 3 * n);
    SILT_RESERVE(w->map, w->map_capacity, n);
    for (int i = 0; i < n; i++) {
        const coupling_grain *g = &c->grain[i];
        if (g->gone)
            continue;
        w->id[count] = g->id;
        memcpy(w->x + 3 * count, g->x, sizeof g->x);
        memcpy(w->v + 3 * count, g->v, sizeof g->v);
        memcpy(w->omega + 3 * count, g->omega, sizeof g->omega);
        w->radius[count] = g->radius;
        w->mass[count] = g->mass;
        w->net[count] = g->net;
        memcpy(w->contact + 3 * count, g->contact, sizeof g->contact);
        w->contacts[count] = g->contacts;
        w->on_bed[count] = g->on_bed;
        w->map[count++] = i;
    }
    w->state = (silt_grain_state){.count = count,
                                  .id = w->id,
                                  .x = w->x,
                                  .v = w->v,
                                  .omega = w->omega,
                                  .radius = w->radius,
                                  .mass = w->mass,
                                  .contacts = w->contacts,
                                  .on_bed = w->on_bed,
                                  .contact = w->contact,
                                  .net_force = w->net};
    w->fresh = true;
    return &w->state;
}

static void coupling_release(silt_coupling *c, int n, const silt_release *release) {
    const silt_scene *scene = c->scene;
    for (int i = 0; i < n; i++) {
        double radius = coupling_parcel_radius(c, release[i].mass);
        if (!(radius <= parcel_most * c->parcel)) {
            silt_fail(&c->refused, SILT_FAILED,
                      "parcel released at (%g, %g): %g kg per metre make a radius of %g m, allowed: up to %g m (twice "
                      "that of "
                      "grains.parcel); make grains.parcel larger or bed.size smaller",
                      release[i].x[0], release[i].x[1], release[i].mass, radius, parcel_most * c->parcel);
            return;
        }
        coupling_grain *g = coupling_append(c, release[i].x, release[i].v, radius);
        g->mass = release[i].mass;
        g->solid = release[i].mass / scene->bed.density;
        // drag sees the grains that the parcel stands for
        g->diameter = scene->grains.diameter > 0.0 ? scene->grains.diameter : cbrt(6.0 * c->width * g->solid / M_PI);
        g->number = g->solid / (M_PI / 6.0 * g->diameter * g->diameter * g->diameter);
    }
}

static void coupling_deposit(silt_coupling *c, int grain) {
    coupling_grain *g = &c->grain[c->view->map[grain]];
    silt_frozen_add(&c->frozen, g->x, g->radius, &c->next_id);
    c->crowds->fresh[1] = false;
    coupling_take(c, g);
}

// ---------------------------------------------------------------- room

static double coupling_wall_distance(const silt_walls *walls, int i, const double x[2]) {
    const double *a = walls->from[i], *b = walls->to[i], e[2] = {b[0] - a[0], b[1] - a[1]}, d[2] = {x[0] - a[0], x[1] - a[1]};
    const double t = silt_clamp((e[0] * d[0] + e[1] * d[1]) / (e[0] * e[0] + e[1] * e[1]), 0.0, 1.0);
    return hypot(d[0] - t * e[0], d[1] - t * e[1]);
}

// bins as wide as the usual sphere
static const silt_crowd *coupling_moving(const silt_coupling *c) {
    silt_crowd *crowd = &c->crowds->moving;
    if (c->crowds->fresh[0])
        return crowd;
    silt_crowd_start(crowd, 2.0 * (c->parcel > 0.0 ? c->parcel : c->dem_def.max_radius));
    for (int i = 0; i < c->n_grain; i++)
        if (!c->grain[i].gone)
            silt_crowd_add(crowd, c->grain[i].x, c->grain[i].radius);
    c->crowds->fresh[0] = true;
    return crowd;
}

static const silt_crowd *coupling_crust(const silt_coupling *c) {
    silt_crowd *crowd = &c->crowds->frozen;
    if (c->crowds->fresh[1])
        return crowd;
    silt_crowd_start(crowd, 2.0 * (c->crust > 0.0 ? c->crust : c->dem_def.max_radius));
    for (int i = 0; i < c->frozen.count; i++)
        silt_crowd_add(crowd, c->frozen.sphere[i].x, c->frozen.sphere[i].radius);
    c->crowds->fresh[1] = true;
    return crowd;
}

// free distance from a point to grains and bodies
static double coupling_gap(const void *context, const double *x, double far) {
    const silt_coupling *c = context;
    double gap = silt_crowd_gap(coupling_moving(c), x, far);
    for (int i = 0; i < c->bodies->count; i++)
        gap = silt_min(gap, silt_coupling_body_distance(c, i, x, gap));
    return gap;
}

static bool coupling_room(const silt_coupling *c, const double *x, double radius) {
    double need = (1.0 - room_overlap) * radius;
    if (coupling_gap(c, x, need) < need || silt_crowd_gap(coupling_crust(c), x, need) < need)
        return false;
    if (c->dim == 3)
        return c->walls->count == 0 || silt_walls_distance(c->walls, x, &(int){0}) >= need;
    for (int i = 0; i < c->walls->count; i++)
        if (coupling_wall_distance(c->walls, i, x) < need)
            return false;
    return true;
}

static void coupling_bed_changed(silt_coupling *c, const silt_bed *bed) {
    silt_frozen_update(&c->frozen, bed, c->crust, &c->next_id, coupling_gap, coupling_forget, c);
    c->crowds->fresh[1] = false;
}

// ---------------------------------------------------------------- exchange with the water

// The water's cell that holds a grain: by a walk from where it was last (10k grains: 0.3 ms), in the locator when that leads
// to the water's edge. Locator and walk agree: a point well inside a cell is in that one only.
static int coupling_locate(silt_coupling *c, coupling_grain *g, const silt_nodes *nodes, const silt_mesh *mesh,
                           bool *located, double *weight) {
    int cell = -1;
    double x[3] = {g->x[0], silt_coupling_across(c, g->x[1]), g->x[2]};
    if (g->near >= 0 && g->near < mesh->n_node && mesh->wet[g->near])
        cell = silt_locate_from(mesh, nodes->x, x, mesh->node_cell[mesh->node_cell_start[g->near]], weight);
    if (cell < 0) {
        if (!*located)
            silt_locator_build(&c->locator, mesh, nodes->x, c->scene->fluid.size);
        *located = true;
        cell = silt_locate(&c->locator, mesh, nodes->x, x, weight);
    }
    g->near = cell >= 0 ? mesh->cell[cell][0] : -1;
    return cell;
}

// grains into the exchange, once for the end of a step and the start of the next; @return false: mesh and grains stand where they
// stood, and so do their cells
static bool coupling_find(silt_coupling *c, const silt_nodes *nodes, const silt_mesh *mesh) {
    silt_exchange *e = &c->exchange;
    bool located = false;
    if (c->found && silt_exchange_stands(e, nodes, mesh))
        return false;
    SILT_RESERVE(e->grain, e->grain_capacity, c->n_grain);
    e->n_grain = c->n_grain;
    c->wet = false;
    for (int i = 0; i < c->n_grain; i++) {
        coupling_grain *g = &c->grain[i];
        silt_exchange_grain *to = &e->grain[i];
        memcpy(to->x, g->x, sizeof to->x);
        memcpy(to->v, g->v, sizeof to->v);
        memcpy(to->contact, g->contact, sizeof to->contact);
        to->solid = g->solid;
        to->mass = g->mass;
        to->diameter = g->diameter;
        to->number = g->number;
        memcpy(to->spin, g->omega, sizeof to->spin);
        to->gyration = sqrt(0.4) * g->radius;
        to->held = g->fixed;
        memcpy(to->gust, g->gust, sizeof to->gust);
        memset(to->force, 0, sizeof to->force);
        memset(to->torque, 0, sizeof to->torque);
        to->cell = coupling_locate(c, g, nodes, mesh, &located, to->weight);
        c->wet = c->wet || to->cell >= 0;
    }
    c->found = true;
    return true;
}

static silt_status coupling_prepare(silt_coupling *c, const silt_nodes *nodes, const silt_mesh *mesh, double dt,
                                    const silt_drag **drag, silt_error *err) {
    *drag = NULL;
    coupling_compact(c);
    c->n_loaded = c->n_grain;
    if (c->n_grain == 0 || nodes == NULL || mesh == NULL || mesh->n_cell == 0) {
        c->wet = c->found = false;
        return SILT_OK;
    }
    const bool moved = coupling_find(c, nodes, mesh);
    if (moved)
        c->exchange.placed = false;
    if (!c->wet)
        return SILT_OK;
    // at the end of a step and at the start of the next the same is asked for: it is done once
    if (!c->exchange.placed)
        SILT_TRY(silt_exchange_place(&c->exchange, nodes, mesh, err));
    if (dt > 0.0)
        silt_exchange_begin(&c->exchange, nodes, dt);
    *drag = &c->exchange.drag;
    return SILT_OK;
}

static void coupling_load(silt_coupling *c, const silt_nodes *nodes, const silt_mesh *mesh, double dt) {
    (void)mesh; // the exchange holds on to the one of prepare
    if (c->wet)
        silt_exchange_load(&c->exchange, nodes->v, nodes->p, dt, nodes->x);
    else
        c->exchange.totals = (silt_exchange_totals){0};
    for (int i = 0; i < c->n_grain; i++) {
        const bool loaded = c->wet && i < c->n_loaded;
        for (int k = 0; k < c->dim; k++)
            c->grain[i].force[k] = loaded ? c->exchange.grain[i].force[k] : 0.0;
        for (int k = 0; k < 3; k++)
            c->grain[i].torque[k] = loaded ? c->exchange.grain[i].torque[k] : 0.0;
    }
}

static void coupling_exchanged(const silt_coupling *c, silt_exchanged *exchanged) {
    const silt_exchange_totals *t = &c->exchange.totals;
    *exchanged = (silt_exchanged){.size = t->size};
    for (int k = 0; k < c->dim; k++) {
        exchanged->grains[k] = t->pressure[k] + t->drag[k];
        exchanged->water[k] = t->water[k];
        exchanged->contact[k] = c->contact[k];
    }
}

// ---------------------------------------------------------------- substeps

// spheres that LIGGGHTS has not heard of, in rising id: grains and frozen ones merged
static void coupling_add(silt_coupling *c) {
    if (c->sent_id == c->next_id)
        return;
    int n = 0, i = 0, k = 0;
    c->sent_id = c->next_id;
    SILT_RESERVE(c->add, c->add_capacity, c->n_grain + c->frozen.count);
    while (i < c->n_grain || k < c->frozen.count) {
        if (k == c->frozen.count || (i < c->n_grain && c->grain[i].id < c->frozen.sphere[k].id)) {
            coupling_grain *g = &c->grain[i++];
            if (g->sent)
                continue;
            silt_dem_sphere *s = &c->add[n++];
            *s = (silt_dem_sphere){.id = g->id,
                                   .kind = g->fixed ? DEM_FROZEN : DEM_GRAIN,
                                   .radius = g->radius,
                                   .density = coupling_sphere_density(c, g->mass, g->radius) * silt_coupling_burden(c, g)};
            memcpy(s->x, g->x, sizeof s->x);
            memcpy(s->v, g->v, sizeof s->v);
            memcpy(s->omega, g->omega, sizeof s->omega);
            g->sent = true;
        } else {
            silt_frozen_sphere *f = &c->frozen.sphere[k++];
            if (f->sent)
                continue;
            c->add[n++] = (silt_dem_sphere){
                .id = f->id, .kind = DEM_FROZEN, .x = {f->x[0], f->x[1], f->x[2]}, .radius = f->radius,
                .density = c->scene->bed.on ? c->scene->bed.density : 1000.0};
            f->sent = true;
        }
    }
    if (n > 0)
        silt_dem_add(c->dem, n, c->add);
}

static void coupling_keep(silt_coupling *c) { silt_dem_keep(c->dem); }

static silt_status coupling_start(silt_coupling *c, int n, silt_error *err) {
    if (c->refused.count > 0)
        return silt_fail(err, c->refused.status, "%s", c->refused.text);

    // forces in the order of the last state, of spheres as they are in the slab
    coupling_compact(c);
    if (n > 0 && c->responds)
        silt_coupling_keep_old(c);
    SILT_RESERVE(c->force, c->force_capacity, 3 * c->n_last);
    if (c->n_last > 0) // else there may be no array
        memset(c->force, 0, 3 * (size_t)c->n_last * sizeof *c->force);
    for (int i = 0, k = 0; i < c->n_grain; i++) {
        coupling_grain *g = &c->grain[i];
        memcpy(g->old_x, g->x, sizeof g->old_x);
        memcpy(g->old_v, g->v, sizeof g->old_v);
        while (k < c->n_last && c->last[k] < g->id)
            k++;
        for (int d = 0; d < c->dim && k < c->n_last && c->last[k] == g->id; d++)
            c->force[3 * k + d] = g->force[d] * c->width * silt_coupling_burden(c, g);
    }
    silt_coupling_twist(c);
    silt_coupling_shift(c);
    for (int i = 0; i < c->bodies->count; i++)
        for (int k = 0; k < 3; k++) {
            c->body_force[3 * i + k] = c->bodies->body[i].force[k] * c->width;
            c->body_torque[3 * i + k] = c->bodies->body[i].torque[k] * c->width;
            c->body[i].old_v[k] = c->bodies->body[i].v[k];
        }
    if (c->n_drop > 0)
        silt_dem_remove(c->dem, c->n_drop, c->drop);
    c->n_drop = 0;
    coupling_add(c);
    c->elapsed = n * c->step;
    if (n > 0)
        silt_coupling_walls_go(c, n);
    silt_coupling_guide(c, n);
    return silt_dem_start(c->dem, n, c->force, c->body_force, c->body_torque, err);
}

static void coupling_leave(silt_coupling *c, coupling_grain *g) {
    silt_sum(&c->left_mass, &c->left_rest, g->mass);
    const int i = (int)(g - c->grain);
    if (i < c->n_loaded && c->exchange.grain[i].cell >= 0)
        c->left_solid += c->exchange.grain[i].immersed;
    c->left_count++;
    coupling_take(c, g);
}

// a grain's new state, and what contacts did to it
static void coupling_receive(silt_coupling *c, coupling_grain *g, const silt_dem_state *state, int k) {
    memcpy(g->x, state->x + 3 * k, sizeof g->x);
    memcpy(g->v, state->v + 3 * k, sizeof g->v);
    memcpy(g->omega, state->omega + 3 * k, sizeof g->omega);
    g->contacts = state->contacts[k];
    g->on_bed = state->on_bed[k];
    if (!(c->elapsed > 0.0))
        return;
    double net[3];
    for (int d = 0; d < c->dim; d++) {
        net[d] = g->mass * (g->v[d] - g->old_v[d]) / c->elapsed;
        g->contact[d] = net[d] - g->force[d] - g->mass * c->scene->gravity[d];
        c->contact[d] += g->contact[d];
    }
    g->net = silt_length(c->dim, net);
}

// nothing is changed before it is sure that no grain is lost
static silt_status coupling_complete(const silt_coupling *c, const silt_dem_state *state, silt_error *err) {
    for (int i = 0, k = 0; i < c->n_grain && state->n_grain != c->n_grain; i++) {
        const coupling_grain *g = &c->grain[i];
        while (k < state->n_grain && state->id[k] < g->id)
            k++;
        if (!g->fixed && (k == state->n_grain || state->id[k] != g->id) && !silt_coupling_left_domain(c, g))
            return silt_fail(
                err, SILT_FAILED,
                "grain %lld vanished: last seen at (%g, %g) with the velocity (%g, %g) m/s and the radius %g m; it "
                "crossed no outlet, so it went through a wall or out of the scene where nothing closes it",
                (long long)g->id, g->old_x[0], g->old_x[1], g->v[0], g->v[1], g->radius);
    }
    return SILT_OK;
}

static silt_status coupling_finish(silt_coupling *c, silt_error *err) {
    SILT_TRY(silt_dem_wait(c->dem, err));
    const silt_dem_state *state = silt_dem_state_now(c->dem);
    SILT_TRY(silt_coupling_guided(c, err));
    SILT_TRY(coupling_complete(c, state, err));
    memset(c->contact, 0, sizeof c->contact);
    if (c->elapsed > 0.0)
        silt_coupling_walls_stand(c);
    coupling_touched(c);
    for (int i = 0, k = 0; i < c->n_grain; i++) {
        coupling_grain *g = &c->grain[i];
        while (k < state->n_grain && state->id[k] < g->id)
            k++;
        if (g->fixed) {
            silt_coupling_hold(c, g);
        } else if (k < state->n_grain && state->id[k] == g->id) {
            coupling_receive(c, g, state, k);
            if (silt_coupling_leaves(c, g->old_x, g->x, 0.0))
                coupling_leave(c, g);
        } else {
            g->sent = false;
            coupling_leave(c, g);
        }
    }

    SILT_RESERVE(c->last, c->last_capacity, state->n_grain);
    c->n_last = state->n_grain;
    if (state->n_grain > 0)
        memcpy(c->last, state->id, (size_t)state->n_grain * sizeof *c->last);
    silt_coupling_bodies_receive(c, state);
    return SILT_OK;
}

// ---------------------------------------------------------------- open and close

// all but the worker: scene, shapes, sizes
static silt_status coupling_create(silt_coupling **coupling, const silt_coupling_def *def, silt_error *err) {
    silt_coupling *c = *coupling = silt_alloc(1, sizeof *c);
    c->scene = def->scene;
    c->walls = def->walls;
    c->box_margin = def->margin;
    c->dim = def->scene->dimension == 3 ? 3 : 2;
    c->next_id = c->sent_id = 1;
    c->view = silt_alloc(1, sizeof *c->view);
    c->crowds = silt_alloc(1, sizeof *c->crowds);
    SILT_TRY(silt_coupling_bodies(c, err));
    coupling_measure(c, def);
    return silt_trace_open(c, def->trace, def->resumed, def->walls->time, err);
}

static silt_status coupling_open_dem(silt_coupling *c, silt_error *err) {
    SILT_TRY(silt_dem_open(&c->dem, &c->dem_def, err));
    return silt_coupling_send_bodies(c, err);
}

static silt_status coupling_recover(silt_coupling *c, silt_error *err) {
    if (!silt_dem_own_fault(c->dem))
        return SILT_FAILED;
    silt_dem_close(&c->dem);
    silt_coupling_take_old(c);
    coupling_touched(c);
    c->dem_def.append = true;
    SILT_TRY(coupling_open_dem(c, err));
    // it is told of everything anew
    coupling_compact(c);
    for (int i = 0; i < c->n_grain; i++)
        c->grain[i].sent = false;
    for (int k = 0; k < c->frozen.count; k++)
        c->frozen.sphere[k].sent = false;
    c->sent_id = 0;
    c->n_drop = c->n_last = 0;
    SILT_TRY(coupling_start(c, 0, err));
    return coupling_finish(c, err);
}

static void coupling_listed(silt_coupling *c) {
    for (int i = 0; i < silt_scene_grains(c->scene); i++) {
        const silt_grain_def *def = silt_scene_grain(c->scene, i);
        coupling_grain *g = coupling_append(c, def->at, def->velocity, def->diameter / 2.0);
        g->solid = M_PI / 6.0 * def->diameter * def->diameter * def->diameter / c->width;
        g->mass = def->density * g->solid;
        g->diameter = def->diameter;
        g->number = 1.0 / c->width;
        g->fixed = coupling_fixes(c, g->id);
        memset(g->v, 0, g->fixed ? sizeof g->v : 0);
    }
}

static silt_status coupling_open(silt_coupling **coupling, const silt_coupling_def *def, silt_error *err) {
    silt_status status = coupling_create(coupling, def, err);
    silt_coupling *c = *coupling;
    if (status == SILT_OK)
        status = coupling_open_dem(c, err);
    if (status != SILT_OK)
        goto done;

    // the spheres of the start, told at once so that the first step has an order of forces
    coupling_listed(c);
    if (def->bed != NULL)
        coupling_bed_changed(c, def->bed);
    status = coupling_start(c, 0, err);
    if (status == SILT_OK)
        status = coupling_finish(c, err);
done:
    if (status != SILT_OK)
        coupling_close(coupling);
    return status;
}

static void coupling_close(silt_coupling **coupling) {
    silt_coupling *c = *coupling;
    if (c == NULL)
        return;
    silt_dem_close(&c->dem);
    free(c->wall);
    free(c->triangle);
    free(c->guide);
    if (c->trace != NULL)
        fclose(c->trace);
    silt_coupling_bodies_clear(c);
    coupling_view *w = c->view;
    void *owned[] = {w->contact, w->id,       w->x,          w->v,           w->omega, w->radius, w->mass, w->net,
                     w->contacts, w->map,        w->on_bed,      w,        c->grain,  c->drop, c->last,
                     c->body,     c->body_force, c->body_torque, c->force, c->add,    c->torque,
                     c->wall_motion, c->moving, c->centre, c->towards, c->pivot, c->rate,
                     c->eddy,     c->shift,      c->walk,          c->response};
    silt_coupling_forget_old(c);
    for (size_t i = 0; i < sizeof owned / sizeof *owned; i++)
        free(owned[i]);
    silt_frozen_clear(&c->frozen);
    silt_crowd_clear(&c->crowds->moving);
    silt_crowd_clear(&c->crowds->frozen);
    free(c->crowds);
    silt_exchange_clear(&c->exchange);
    silt_locator_clear(&c->locator);
    free(c);
    *coupling = NULL;
}

// ---------------------------------------------------------------- small answers

static double coupling_step(const silt_coupling *c) { return c->step; }

static silt_body_state *coupling_bodies(const silt_coupling *c) {
    silt_coupling_bodies_gone(c);
    return c->bodies;
}

static int coupling_process(const silt_coupling *c) { return silt_dem_process(c->dem); }

static int coupling_outline(const silt_coupling *c, int body, double h, double *point, int capacity) {
    const silt_solid *skin = &c->body[body].skin;
    if (c->dim == 2)
        return silt_outline_nodes(&c->body[body].shape,
                                  c->scene->fluid.on ? silt_min(h, silt_coupling_body_size(c->scene, &c->scene->body[body], h)) : h, point,
                                  capacity);
    if (point != NULL)
        memcpy(point, skin->point, (size_t)(capacity < skin->n_point ? capacity : skin->n_point) * sizeof *skin->point);
    return skin->n_point;
}

static void coupling_left(const silt_coupling *c, double *mass, double *solid, int64_t *count) {
    *mass = c->left_mass;
    *solid = c->left_solid;
    *count = c->left_count;
}

// ---------------------------------------------------------------- checkpoint

static silt_status coupling_save(silt_coupling *c, silt_store *store, silt_error *err) {
    // edits in the queue are done first: what is saved is what LIGGGHTS has
    SILT_TRY(coupling_start(c, 0, err));
    SILT_TRY(coupling_finish(c, err));
    SILT_TRY(silt_checkpoint_save(c, store, err));
    return silt_dem_save(c->dem, store, err);
}

static silt_status coupling_load_state(silt_coupling **coupling, const silt_coupling_def *def, silt_store *store,
                                       silt_error *err) {
    silt_status status = coupling_create(coupling, def, err);
    silt_coupling *c = *coupling;
    if (status == SILT_OK)
        status = silt_checkpoint_load(c, store, err);
    if (status == SILT_OK)
        status = silt_dem_load(&c->dem, &c->dem_def, store, err);
    if (status != SILT_OK)
        coupling_close(coupling);
    return status;
}

const silt_coupling_type silt_coupling_dem = {
    .open = coupling_open,
    .step = coupling_step,
    .parcel_radius = coupling_parcel_radius,
    .grains = coupling_grains,
    .bodies = coupling_bodies,
    .prepare = coupling_prepare,
    .load = coupling_load,
    .respond = silt_coupling_respond,
    .walk = silt_coupling_walk,
    .gusts = silt_coupling_gusts,
    .exchanged = coupling_exchanged,
    .outline = coupling_outline,
    .describe = silt_coupling_describe,
    .room = coupling_room,
    .release = coupling_release,
    .deposit = coupling_deposit,
    .bed_changed = coupling_bed_changed,
    .keep = coupling_keep,
    .start = coupling_start,
    .finish = coupling_finish,
    .recover = coupling_recover,
    .left = coupling_left,
    .save = coupling_save,
    .load_state = coupling_load_state,
    .process = coupling_process,
    .close = coupling_close,
};
