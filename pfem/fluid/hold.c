// what surroundings hold: tank walls, bed, bodies, inlets; and the friction that they exert where water slides
#include "fluid.h"

#define BED_SQUARE 0.1  // cosine between a line of free motion and a wall that it may go along
#define BODY_SMOOTH 0.866 // cosine of the largest turn, 30 degrees, of a body's facet from the normal of a node that slides
#define BED_FLUSH 0.866 // cosine of the largest turn, 30 degrees, between bed and a wall that goes on from it
#define HOLD_LIGHT 1e-6  // of h^dim, volume of a node that has no cells to speak of

void silt_hold_project_held(const silt_fluid *f, int i, double *v) {
    const int D = f->dim;
    if (f->hold[i] == HOLD_ALL) {
        for (int d = 0; d < D; d++)
            v[d] = 0;
        return;
    }
    const double *n = f->normal + D * i;
    double along = 0;
    for (int d = 0; d < D; d++)
        along += v[d] * n[d];
    for (int d = 0; d < D; d++)
        v[d] = f->hold[i] == HOLD_NORMAL ? v[d] - along * n[d] : along * n[d];
}

void silt_hold_impose(const silt_fluid *f, int i, double *v) {
    silt_hold_project(f, i, v);
    if (f->hold[i] != HOLD_FREE)
        for (int d = 0; d < f->dim; d++)
            v[d] += f->given[f->dim * i + d];
}

void silt_hold_turn(const silt_fluid *f, int i, double *v) {
    const int D = f->dim;
    double whole = 0, along = 0;
    if (!f->wall_normals.n_row || f->wall_normals.row[i] < 0 || f->hold[i] != HOLD_NORMAL) {
        silt_hold_impose(f, i, v);
        return;
    }
    for (int d = 0; d < D; d++) {
        v[d] -= f->given[D * i + d];
        whole += v[d] * v[d];
    }
    silt_hold_project(f, i, v);
    for (int d = 0; d < D; d++)
        along += v[d] * v[d];
    const double factor = along > 0.5 * whole ? sqrt(whole / along) : 1;
    for (int d = 0; d < D; d++)
        v[d] = f->given[D * i + d] + factor * v[d];
}

// normal of a facet into the water, as long as the edge, in space the face's area
static void facet_normal(const silt_mesh *mesh, const double *x, const int *facet, double n[3]) {
    if (mesh->dim != 3) {
        n[0] = -(x[2 * facet[1] + 1] - x[2 * facet[0] + 1]);
        n[1] = x[2 * facet[1]] - x[2 * facet[0]];
        return;
    }
    double u[3], v[3];
    for (int d = 0; d < 3; d++) {
        u[d] = silt_shortest(mesh, d, x[3 * facet[1] + d] - x[3 * facet[0] + d]);
        v[d] = silt_shortest(mesh, d, x[3 * facet[2] + d] - x[3 * facet[0] + d]);
    }
    for (int d = 0; d < 3; d++) // the facet is counter-clockwise from outside the water
        n[d] = -0.5 * (u[(d + 1) % 3] * v[(d + 2) % 3] - u[(d + 2) % 3] * v[(d + 1) % 3]);
}

// In space the bed's node at a wall slides along the line that both leave free; a wall without slip, or a third one, holds it.
static void hold_bed_line(silt_fluid *f, int i, bool sticks, const double *wall) {
    double *n = f->normal + 3 * i, line[3];
    if (f->hold[i] == HOLD_LINE) {
        const double across = silt_dot(3, n, wall) / silt_length(3, wall);
        if (sticks || fabs(across) > BED_SQUARE)
            f->hold[i] = HOLD_ALL;
        return;
    }
    for (int d = 0; d < 3; d++)
        line[d] = n[(d + 1) % 3] * wall[(d + 2) % 3] - n[(d + 2) % 3] * wall[(d + 1) % 3];
    const double length = silt_length(3, line);
    f->hold[i] = sticks || !(length > 0) ? HOLD_ALL : HOLD_LINE;
    for (int d = 0; d < 3 && f->hold[i] == HOLD_LINE; d++)
        n[d] = line[d] / length;
}

// Slip on the bed ends where it meets something else that is shut: in a corner with a wall, where a node that slid on would go
// through that wall; and at the mouth of a slit between bed and body, whose nodes cannot follow a surface: what a sliding one
// leaves behind is new water in every step, driven on by its own pressure. A wall that goes on from the bed has its share of the normal.
static void hold_bed_ends(silt_fluid *f, const silt_step *s) {
    const silt_mesh *mesh = s->mesh;
    const uint8_t *kind = s->nodes->kind;
    const int D = f->dim;
    // walls that go on from the bed first: the others are held against the whole normal
    for (int pass = 0; pass < 2; pass++)
        for (int k = 0; k < mesh->n_facet; k++)
            for (int c = 0; c < D; c++) {
                const int i = mesh->facet[k][c], other = mesh->facet[k][(c + 1) % D];
                if (kind[i] != NODE_BED || (f->hold[i] != HOLD_NORMAL && f->hold[i] != HOLD_LINE))
                    continue;
                const bool slit = mesh->facet_kind[k] == FACET_FREE && kind[other] == NODE_BODY;
                if (!slit && mesh->facet_kind[k] != FACET_WALL)
                    continue;
                double n[3], *bed = f->normal + D * i;
                facet_normal(mesh, s->nodes->x, mesh->facet[k], n);
                const double turn = silt_dot(D, n, bed) / (silt_length(D, n) * silt_length(D, bed));
                if (slit || D == 2) {
                    if (pass == 0 && (slit || !(turn > BED_FLUSH)))
                        f->hold[i] = HOLD_ALL;
                    else if (pass == 0)
                        for (int d = 0; d < 2; d++)
                            bed[d] += n[d];
                    continue;
                }
                if (pass == 1 && (f->hold[i] == HOLD_LINE || !(turn > BED_FLUSH))) {
                    double roughness;
                    const bool sticks = silt_facet_condition(s->scene, s->walls, s->nodes, mesh, k, &roughness) == WALL_NO_SLIP;
                    hold_bed_line(f, i, sticks, n);
                } else if (pass == 0 && turn > BED_FLUSH)
                    for (int d = 0; d < 3; d++)
                        bed[d] += n[d];
            }
}

// Where free facets begin, at a shore, at a brink, around a hollow, a node that stays cannot go where the surface goes: water that slid
// out through it would be gone, since nothing moves there.
static void hold_bed_rims(silt_fluid *f, const silt_step *s) {
    const silt_mesh *mesh = s->mesh;
    for (int k = 0; k < mesh->n_facet; k++)
        for (int c = 0; c < f->dim && mesh->facet_kind[k] != FACET_BED && mesh->facet_kind[k] != FACET_WALL; c++)
            if (s->nodes->kind[mesh->facet[k][c]] == NODE_BED)
                f->hold[mesh->facet[k][c]] = HOLD_ALL;
}

// slip on the bed: the normal of its facets around the node
static void hold_bed(silt_fluid *f, const silt_step *s) {
    const silt_mesh *mesh = s->mesh;
    const int D = f->dim;
    for (int k = 0; k < mesh->n_facet; k++) {
        if (mesh->facet_kind[k] != FACET_BED)
            continue;
        double n[3];
        facet_normal(mesh, s->nodes->x, mesh->facet[k], n);
        for (int c = 0; c < D; c++) {
            const int i = mesh->facet[k][c];
            for (int d = 0; d < D; d++)
                f->normal[D * i + d] += n[d];
            f->hold[i] = HOLD_NORMAL;
        }
    }
    hold_bed_ends(f, s);
    hold_bed_rims(f, s);
    SILT_RESERVE(f->still, f->still_capacity, f->n_node + 1);
    for (int i = 0; i < f->n_node; i++)
        if (s->nodes->kind[i] == NODE_BED && f->hold[i] == HOLD_NORMAL) {
            double *n = f->normal + D * i;
            const double length = D == 3 ? silt_length(3, n) : hypot(n[0], n[1]);
            if (length > 0) {
                for (int d = 0; d < D; d++)
                    n[d] /= length;
            } else
                f->hold[i] = HOLD_ALL;
        }
    for (int i = 0; i < f->n_node; i++)
        f->still[i] = s->nodes->kind[i] == NODE_BED;
}

// what the pressure of water at rest gives a node of a facet for its being lower at the others, per measure of the facet
static double rest_push(const silt_fluid *f, const silt_step *s, const double *x, const int *facet, int i) {
    const int D = f->dim;
    double rise = 0;
    for (int a = 0; a < D; a++)
        for (int d = 0; d < D; d++)
            rise += s->scene->gravity[d] * silt_shortest(s->mesh, d, x[D * facet[a] + d] - x[D * i + d]);
    return s->scene->fluid.density * rise / (D * (D + 1)); // int N_i N_j of an edge is 1/6 of its length, of a face 1/12 of its area
}

// On a bed that bends, the pressure of water at rest pushes a node along the one direction that stands for all its facets: on the
// facet that goes down it is higher. With p - p_i = rho g.(x - x_i) that push is known, and taken back: water over a hill of bed stays at
// rest (1.8 m/s and 7 % of the volume before, tests/scenes/bed-rest.yaml).
static void hold_bed_rest(silt_fluid *f, const silt_step *s) {
    const silt_mesh *mesh = s->mesh;
    const int D = f->dim;
    const double *x = s->nodes->x;
    SILT_RESERVE(f->bed_force, f->bed_force_capacity, D * f->n_node + 1);
    memset(f->bed_force, 0, (size_t)(D * f->n_node) * sizeof(double));
    for (int k = 0; k < mesh->n_facet; k++) {
        if (mesh->facet_kind[k] != FACET_BED && mesh->facet_kind[k] != FACET_WALL)
            continue;
        const int *facet = mesh->facet[k];
        double n[3];
        facet_normal(mesh, x, facet, n);
        for (int c = 0; c < D; c++) {
            const int i = facet[c];
            if (s->nodes->kind[i] != NODE_BED || f->hold[i] == HOLD_ALL)
                continue;
            const double push = rest_push(f, s, x, facet, i);
            for (int d = 0; d < D; d++)
                f->bed_force[D * i + d] += push * n[d];
        }
    }
    for (int i = 0; i < f->n_node; i++)
        if (s->nodes->kind[i] == NODE_BED)
            silt_hold_project(f, i, f->bed_force + D * i);
}

// ---------------------------------------------------------------- slip on bodies

bool silt_hold_slips(const silt_step *s, int i) {
    return s->nodes->kind[i] == NODE_BODY && silt_body_slips(&s->scene->body[s->nodes->owner[i]]);
}

void silt_hold_replace(const silt_fluid *f, int i, const double *own, double *v) {
    double held[3], loose[3];
    for (int d = 0; d < f->dim; d++)
        held[d] = loose[d] = own[d];
    silt_hold_project(f, i, loose);
    silt_hold_project(f, i, v);
    for (int d = 0; d < f->dim; d++)
        v[d] = f->hold[i] == HOLD_ALL ? held[d] : v[d] + (held[d] - loose[d]);
}

void silt_facet_mean_normal(const silt_mesh *mesh, const double *x, const double *x_mid, const int *facet, double n[3]) {
    facet_normal(mesh, x_mid, facet, n);
    if (mesh->dim != 3 || x_mid == x)
        return;
    double end[9], first[3], last[3];
    const int own[3] = {0, 1, 2};
    for (int c = 0; c < 3; c++)
        for (int d = 0; d < 3; d++)
            end[3 * c + d] = 2 * x_mid[3 * facet[c] + d] - x[3 * facet[c] + d];
    facet_normal(mesh, x, facet, first);
    facet_normal(mesh, end, own, last);
    for (int d = 0; d < 3; d++)
        n[d] = (first[d] + 4 * n[d] + last[d]) / 6;
}

// velocity of the body at its node
static void body_given(silt_fluid *f, const silt_step *s, int i) {
    for (int d = 0; d < f->dim; d++)
        f->given[f->dim * i + d] = s->body_velocity ? s->body_velocity[f->dim * i + d] : 0;
}

static bool body_loose(const silt_fluid *f, const silt_step *s, int i) {
    return f->hold[i] == HOLD_NORMAL && silt_hold_slips(s, i);
}

/** Normals of nodes that are held along theirs only: with the sum of their facets', weighted with size, what goes through the body's
 * surface is what the body's motion asks for, whatever water does along it. The push of water at rest along a bent body is taken back
 * as on a bed. */
static void body_normals(silt_fluid *f, const silt_step *s, const double *x_mid) {
    const silt_mesh *mesh = s->mesh;
    const int D = f->dim;
    for (int i = 0; i < f->n_node; i++)
        for (int d = 0; d < D && body_loose(f, s, i); d++)
            f->normal[D * i + d] = f->bed_force[D * i + d] = 0;
    for (int k = 0; k < mesh->n_facet; k++) {
        const int *facet = mesh->facet[k];
        if (mesh->facet_kind[k] != FACET_BODY || !silt_hold_slips(s, facet[0]))
            continue;
        double n[3];
        silt_facet_mean_normal(mesh, s->nodes->x, x_mid, facet, n);
        for (int c = 0; c < D; c++) {
            const int i = facet[c];
            if (!body_loose(f, s, i))
                continue;
            const double push = rest_push(f, s, x_mid, facet, i);
            for (int d = 0; d < D; d++) {
                f->normal[D * i + d] += n[d];
                f->bed_force[D * i + d] += push * n[d];
            }
        }
    }
    for (int i = 0; i < f->n_node; i++) {
        if (!body_loose(f, s, i))
            continue;
        double *n = f->normal + D * i, own[3];
        const double length = sqrt(silt_dot(D, n, n));
        for (int d = 0; d < D; d++)
            n[d] /= length;
        silt_hold_project(f, i, f->bed_force + D * i);
        body_given(f, s, i);
        memcpy(own, f->given + D * i, (size_t)D * sizeof(double));
        silt_hold_project(f, i, own);
        for (int d = 0; d < D; d++)
            f->given[D * i + d] -= own[d];
    }
}

// Where the body has an edge, and where its surface ends, at a waterline, a wall, another body, a node has no normal that would do:
// it goes with the body.
static void hold_body_edges(silt_fluid *f, const silt_step *s) {
    const silt_mesh *mesh = s->mesh;
    const int D = f->dim;
    for (int i = 0; i < f->n_node; i++)
        if (silt_hold_slips(s, i)) {
            f->hold[i] = HOLD_ALL;
            memset(f->normal + D * i, 0, (size_t)D * sizeof(double));
        }
    for (int pass = 0; pass < 2; pass++)
        for (int k = 0; k < mesh->n_facet; k++)
            for (int c = 0; c < D; c++) {
                const int i = mesh->facet[k][c];
                if (!silt_hold_slips(s, i))
                    continue;
                double n[3], *whole = f->normal + D * i;
                facet_normal(mesh, s->nodes->x, mesh->facet[k], n);
                if (pass == 0) {
                    f->hold[i] = HOLD_NORMAL;
                    for (int d = 0; d < D; d++)
                        whole[d] += n[d];
                } else if (mesh->facet_kind[k] != FACET_BODY ||
                           !(silt_dot(D, n, whole) > BODY_SMOOTH * sqrt(silt_dot(D, n, n) * silt_dot(D, whole, whole))))
                    f->hold[i] = HOLD_ALL;
            }
}

// something solid besides the body
static bool other_solid(const silt_nodes *nodes, int body, int j) {
    if (nodes->kind[j] == NODE_BODY)
        return nodes->owner[j] != body;
    return nodes->kind[j] == NODE_BED || nodes->kind[j] == NODE_CORNER || (nodes->kind[j] == NODE_FLUID && nodes->wall[j][0] >= 0);
}

// In a film of one cell between the body and something else water sticks: it has no velocity along it that the mesh could show.
static void hold_body_films(silt_fluid *f, const silt_step *s) {
    const int corners = f->dim + 1;
    for (int e = 0; e < f->n_cell; e++) {
        const int *cell = s->mesh->cell[e];
        for (int a = 0; a < corners; a++)
            for (int b = 0; b < corners && silt_hold_slips(s, cell[a]); b++)
                if (other_solid(s->nodes, s->nodes->owner[cell[a]], cell[b]))
                    f->hold[cell[a]] = HOLD_ALL;
    }
}

// places of nodes that water slips at: they go with the body
static void body_ride(silt_fluid *f, const silt_step *s) {
    for (int i = 0; i < f->n_node; i++) {
        if (!silt_hold_slips(s, i))
            continue;
        f->still[i] = 1;
        for (int k = f->dim * i; k < f->dim * (i + 1); k++)
            f->ride[k] = s->body_velocity ? s->body_velocity[k] + s->body_shift[k] : 0;
    }
}

static void hold_bodies(silt_fluid *f, const silt_step *s) {
    const int n = f->n_node, D = f->dim;
    bool any = false;
    for (int b = 0; b < s->scene->n_body; b++)
        any |= silt_body_slips(&s->scene->body[b]);
    if (!any)
        return;
    const bool bed = s->scene->bed.on && s->scene->bed.condition != WALL_NO_SLIP;
    SILT_RESERVE(f->ride, f->ride_capacity, D * n + 1);
    SILT_RESERVE(f->still, f->still_capacity, n + 1);
    SILT_RESERVE(f->bed_force, f->bed_force_capacity, D * n + 1);
    memset(f->ride, 0, (size_t)(D * n) * sizeof(double));
    if (!bed) {
        memset(f->still, 0, (size_t)n);
        memset(f->bed_force, 0, (size_t)(D * n) * sizeof(double));
    }
    for (int i = 0; i < n; i++)
        if (silt_hold_slips(s, i))
            body_given(f, s, i);
    hold_body_edges(f, s);
    hold_body_films(f, s);
    body_ride(f, s);
    body_normals(f, s, s->nodes->x);
}

// Nodes at the mouths of films go along walls as the body does. @param fresh  what holds them was found anew for all; else on bent walls
static void hold_slaves(silt_fluid *f, const silt_step *s, bool fresh) {
    const int D = f->dim;
    for (int k = 0; f->film && k < f->film->n_slave; k++) {
        const int i = f->film->slave[k];
        struct silt_film_way *way = &f->film->way[k];
        if (fresh || f->hold[i] != HOLD_ALL) {
            way->hold = f->hold[i];
            memcpy(way->vector, f->normal + D * i, (size_t)D * sizeof(double));
            memcpy(way->given, f->given + D * i, (size_t)D * sizeof(double));
        }
        double v[3] = {0};
        if (s->body_velocity)
            memcpy(v, s->body_velocity + D * i, (size_t)D * sizeof(double));
        silt_film_free_part(f->film, k, D, v);
        f->hold[i] = HOLD_ALL;
        for (int d = 0; d < D; d++)
            f->given[D * i + d] = way->given[d] + v[d];
    }
}

void silt_hold_bodies_again(silt_fluid *f, const silt_step *s) {
    const int D = f->dim;
    for (int i = 0; i < f->n_node; i++) {
        if (s->nodes->kind[i] != NODE_BODY)
            continue;
        body_given(f, s, i);
        if (s->mesh->wet[i])
            silt_hold_replace(f, i, f->given + D * i, f->w + D * i);
        else
            memset(f->w + D * i, 0, (size_t)D * sizeof(double));
    }
    hold_slaves(f, s, false);
    for (int k = 0; f->film && k < f->film->n_slave; k++)
        memcpy(f->w + D * f->film->slave[k], f->given + D * f->film->slave[k], (size_t)D * sizeof(double));
    if (!f->ride)
        return;
    body_ride(f, s);
    f->shaped = false; // the normals are renewed with the midpoint mesh, whether it is another one or not
}

void silt_hold_bent(silt_fluid *f, const silt_step *s) {
    const int D = f->dim;
    if (f->ride)
        body_normals(f, s, f->x_mid);
    if (!f->wall_normals.n_row)
        return;
    silt_wall_normals_take(&f->wall_normals, s->walls, s->nodes, s->mesh, f->x_mid);
    for (int i = 0; i < f->n_node; i++) {
        if (s->nodes->kind[i] != NODE_FLUID || f->wall_normals.row[i] < 0)
            continue;
        double vector[3], given[3];
        f->hold[i] = (uint8_t)silt_walls_held(s->walls, s->scene, &f->wall_normals, s->nodes, i, vector, given);
        memcpy(f->normal + D * i, vector, (size_t)D * sizeof(double));
        memcpy(f->given + D * i, given, (size_t)D * sizeof(double));
    }
    hold_slaves(f, s, false);
}

// A node between walls may have nothing but a flat cell, 1e-17 of what others have: without a mass it would slip at any speed that the
// pressure beside it asks for (cases/pier). It stays where it is; one that is free is spray.
void silt_hold_light(silt_fluid *f, const silt_step *s) {
    const int D = f->dim;
    for (int i = 0; i < f->n_node; i++) {
        if (f->hold[i] == HOLD_FREE || f->hold[i] == HOLD_ALL || !s->mesh->wet[i] ||
            !(f->volume[i] < HOLD_LIGHT * pow(silt_node_h(s->nodes, i, s->scene->fluid.size), D)))
            continue;
        f->hold[i] = HOLD_ALL;
        memcpy(f->w + D * i, f->given + D * i, (size_t)D * sizeof(double));
    }
}

void silt_hold_nodes(silt_fluid *f, const silt_step *s) {
    const int D = f->dim;
    const silt_nodes *nodes = s->nodes;
    memset(f->given, 0, (size_t)D * (size_t)f->n_node * sizeof(double));
    if (f->belt)
        memset(f->belt, 0, (size_t)D * (size_t)f->n_node * sizeof(double));
    silt_wall_normals_take(&f->wall_normals, s->walls, nodes, s->mesh, nodes->x);
    for (int i = 0; i < f->n_node; i++) {
        double vector[3] = {0}, given[3];
        f->hold[i] = HOLD_ALL;
        // bodies and inlets move as they were told, walls as they do, the bed not at all
        if (nodes->kind[i] == NODE_BODY && s->body_velocity)
            memcpy(f->given + D * i, s->body_velocity + D * i, (size_t)D * sizeof(double));
        else if (nodes->kind[i] == NODE_BODY || nodes->kind[i] == NODE_INLET || nodes->kind[i] == NODE_CORNER)
            memcpy(f->given + D * i, nodes->v + D * i, (size_t)D * sizeof(double));
        else if (nodes->kind[i] == NODE_FLUID && nodes->wall[i][0] < 0)
            f->hold[i] = HOLD_FREE;
        else if (nodes->kind[i] == NODE_OPEN)
            f->hold[i] = (uint8_t)silt_level_hold(s, i, vector);
        else if (nodes->kind[i] == NODE_FLUID) {
            f->hold[i] = (uint8_t)silt_walls_held(s->walls, s->scene, &f->wall_normals, nodes, i, vector, given);
            memcpy(f->given + D * i, given, (size_t)D * sizeof(double));
            if (f->belt && f->hold[i] == HOLD_ALL)
                memcpy(f->belt + D * i, s->scene->wall[s->walls->wall[nodes->wall[i][0]]].velocity, (size_t)D * sizeof(double));
        }
        memcpy(f->normal + D * i, vector, (size_t)D * sizeof(double));
    }
    if (s->scene->bed.on && s->scene->bed.condition != WALL_NO_SLIP) {
        hold_bed(f, s);
        hold_bed_rest(f, s);
    }
    hold_bodies(f, s);
    hold_slaves(f, s, true);
}
