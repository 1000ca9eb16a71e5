// Uplift: where a body stands so close to a wall, the bed or another body that no cell of the water is between them, water is there all
// the same, a film (fluid/film.h). Found here: which pieces of the bodies' surfaces lie under films, and which facets of the water are
// their mouths.
#include "run.h"

#include "solid.h"
#include "wall.h"

#define UPLIFT_SHUT 0.1  // of the local size: a mouth that is narrower lets no air through
#define SLAVE (-3)       // in `place`: a node that has been listed
#define UPLIFT_GAP 0.5   // of it: what is nearer to something solid has no air between
#define UPLIFT_FLAT 0.02 // of its dim-th power, volume at a node of flat cells

/** what is behind a piece of a body's surface */
typedef enum { PIECE_AIR = 0, PIECE_WATER, PIECE_FILM } uplift_piece;

struct silt_uplift {
    silt_film film;
    int n_piece, piece_capacity, state_capacity;
    int (*piece)[3];  // owned, nodes of the pieces of a body's surface, in order; in the plane the third -1
    uint8_t *state;   // owned, uplift_piece
    int group_capacity, place_capacity, first_capacity, list_capacity, at_capacity, open_capacity, closed_capacity;
    int *group;       // owned, per node: nodes of one film are a group; -1: of none
    uint8_t *open;    // owned, per group: air comes to it
    int *place;       // owned, per node: in film.node, -1; then whatever is asked
    uint8_t *closed;  // owned, per facet of the water: a film presses back on it
    int parent_capacity, sealed_capacity, volume_capacity;
    double *volume;   // owned, per body, m3 in its films as the step begins
    int *parent;      // owned, per node: pieces of water (silt_group_find)
    uint8_t *sealed;  // owned, per piece: 1 films are all that it has besides what is shut, 2: and it stays so; then whatever is asked
    int *at;          // owned, node of each number that bodies' nodes were given, -1
    int *first, *list; // owned, pieces by their nodes
};

void silt_uplift_free(silt_uplift **uplift) {
    silt_uplift *u = *uplift;
    if (!u)
        return;
    silt_film_clear(&u->film);
    free(u->piece);
    free(u->state);
    free(u->group);
    free(u->open);
    free(u->place);
    free(u->closed);
    free(u->parent);
    free(u->sealed);
    free(u->volume);
    free(u->at);
    free(u->first);
    free(u->list);
    free(u);
    *uplift = NULL;
}

// ---- what is near

static double segment_distance(const double *a, const double *b, const double *x) {
    const double e[2] = {b[0] - a[0], b[1] - a[1]}, d[2] = {x[0] - a[0], x[1] - a[1]};
    const double t = silt_clamp((e[0] * d[0] + e[1] * d[1]) / (e[0] * e[0] + e[1] * e[1]), 0, 1);
    return hypot(d[0] - t * e[0], d[1] - t * e[1]);
}

static double bed_distance(const silt_bed *bed, int dim, const double *x, double reach) {
    double least = reach;
    for (int k = 0; k < bed->n_edge; k++) {
        const int *own = bed->edge[k];
        if (dim == 2) {
            least = silt_min(least, segment_distance(bed->x[own[0]], bed->x[own[1]], x));
            continue;
        }
        double corner[3][3], on[3];
        bool far = false;
        for (int d = 0; d < 3; d++) {
            double lo = HUGE_VAL, hi = -HUGE_VAL;
            for (int a = 0; a < 3; a++) {
                corner[a][d] = bed->x[own[a]][d];
                lo = silt_min(lo, corner[a][d]);
                hi = silt_max(hi, corner[a][d]);
            }
            far |= x[d] < lo - least || x[d] > hi + least;
        }
        int feature;
        if (!far)
            least = silt_min(least, sqrt(wall_nearest_on_triangle((const double(*)[3])corner, x, on, &feature)));
    }
    return least;
}

static double body_distance(const struct silt_body *body, int dim, const double *x, double reach) {
    double local[3] = {0}, least = reach, on[3];
    int face;
    for (int d = 0; d < dim; d++)
        local[d] = x[d] - body->x[d];
    silt_turn(body->q, true, local, local);
    if (body->solid)
        return silt_dot(3, local, local) > silt_square(body->solid->radius + reach)
                   ? reach
                   : silt_min(reach, silt_solid_nearest(body->solid, local, reach, NULL, on, &face));
    for (int k = 0; k < body->n_point; k++)
        least = silt_min(least, segment_distance(body->point + 2 * k, body->point + 2 * ((k + 1) % body->n_point), local));
    return least;
}

// from x to what is solid besides body b, no more than reach
static double solid_distance(const silt_run *run, int b, const double *x, double reach) {
    const int D = silt_nodes_dim(&run->nodes);
    int element;
    double least = reach;
    if (run->walls.count)
        least = silt_min(least, fabs(silt_walls_distance(&run->walls, x, &element)));
    least = bed_distance(&run->bed, D, x, least);
    for (int o = 0; o < run->n_body_before; o++)
        if (o != b)
            least = body_distance(&run->body_before[o], D, x, least);
    return least;
}

static bool near_solid(const silt_run *run, int i, double share) {
    const silt_nodes *nodes = &run->nodes;
    const double reach = share * silt_node_h(nodes, i, run->scene->fluid.size);
    return solid_distance(run, nodes->owner[i], nodes->x + silt_nodes_dim(nodes) * i, reach) < reach;
}

// ---- the bodies' surfaces

// nodes of bodies by their ids: they were the first, in order, and keep them. @return how many ids
static int nodes_by_id(silt_uplift *u, const silt_nodes *nodes) {
    int n = 0;
    for (int i = 0; i < nodes->count; i++)
        if (nodes->kind[i] == NODE_BODY && nodes->id[i] >= n)
            n = (int)nodes->id[i] + 1;
    SILT_RESERVE(u->at, u->at_capacity, n + 1);
    for (int k = 0; k < n; k++)
        u->at[k] = -1;
    for (int i = 0; i < nodes->count; i++)
        if (nodes->kind[i] == NODE_BODY)
            u->at[nodes->id[i]] = i;
    return n;
}

// the pieces of body b; `from` is the first of its nodes' ids
static void pieces_make(silt_uplift *u, const silt_run *run, int b, int from, int n_id) {
    const struct silt_body *body = &run->body_before[b];
    u->n_piece = 0;
    if (body->solid) {
        SILT_RESERVE(u->piece, u->piece_capacity, body->n_face + 1);
        for (int k = 0; k < body->n_face; k++) {
            int *own = u->piece[u->n_piece];
            bool whole = true;
            for (int a = 0; a < 3; a++) {
                const int id = from + body->face[k][a];
                own[a] = id < n_id ? u->at[id] : -1;
                whole &= own[a] >= 0;
            }
            u->n_piece += whole;
        }
        return;
    }
    for (int id = from, last = -1; id < n_id; id++) {
        const int i = u->at[id];
        if (i < 0)
            continue;
        if (run->nodes.owner[i] != b)
            break;
        SILT_RESERVE(u->piece, u->piece_capacity, u->n_piece + 2);
        if (last >= 0)
            u->piece[u->n_piece - 1][1] = i;
        memcpy(u->piece[u->n_piece++], (int[3]){last = i, -1, -1}, sizeof *u->piece);
    }
    if (u->n_piece)
        u->piece[u->n_piece - 1][1] = u->piece[0][0];
}

// pieces by the nodes that they have
static void pieces_list(silt_uplift *u, int n_node, int corners) {
    SILT_RESERVE(u->first, u->first_capacity, n_node + 2);
    SILT_RESERVE(u->list, u->list_capacity, corners * u->n_piece + 1);
    memset(u->first, 0, (size_t)(n_node + 2) * sizeof *u->first);
    for (int k = 0; k < u->n_piece; k++)
        for (int a = 0; a < corners; a++)
            u->first[u->piece[k][a] + 2]++;
    for (int i = 2; i < n_node + 2; i++)
        u->first[i] += u->first[i - 1];
    for (int k = 0; k < u->n_piece; k++)
        for (int a = 0; a < corners; a++)
            u->list[u->first[u->piece[k][a] + 1]++] = k;
}

static bool piece_has(const int piece[3], int corners, int i) {
    bool has = false;
    for (int a = 0; a < corners; a++)
        has |= piece[a] == i;
    return has;
}

// a facet of the water on the body: its piece is wet. @return false: it is no piece
static bool piece_wet(silt_uplift *u, const int *facet, int corners) {
    bool found = false;
    for (int a = 0; a < corners; a++)
        for (int k = u->first[facet[a]]; k < u->first[facet[a] + 1]; k++) {
            int *own = u->piece[u->list[k]], shared = 0;
            for (int c = 0; c < corners; c++)
                shared += piece_has(own, corners, facet[c]);
            if (shared == corners) {
                u->state[u->list[k]] = PIECE_WATER;
                found = true;
            }
        }
    return found;
}

// a piece with corners i and j, but not k, of which it has the third; -1: none
static int piece_beside(const silt_uplift *u, int i, int j, int k, int *third) {
    for (int l = u->first[i]; l < u->first[i + 1]; l++) {
        const int *own = u->piece[u->list[l]];
        if (!piece_has(own, 3, j) || piece_has(own, 3, k))
            continue;
        *third = own[0] + own[1] + own[2] - i - j;
        return u->list[l];
    }
    return -1;
}

// a facet that no piece is lies on two pieces that share another diagonal
static void piece_crossed(silt_uplift *u, const int *facet) {
    for (int a = 0; a < 3; a++) {
        const int i = facet[a], j = facet[(a + 1) % 3], k = facet[(a + 2) % 3];
        for (int l = u->first[i]; l < u->first[i + 1]; l++) {
            // both pieces around the edge from i to a fourth node
            const int *own = u->piece[u->list[l]];
            if (!piece_has(own, 3, j) || piece_has(own, 3, k))
                continue;
            const int fourth = own[0] + own[1] + own[2] - i - j;
            int third;
            const int other = piece_beside(u, i, k, j, &third);
            if (other >= 0 && third == fourth)
                u->state[u->list[l]] = u->state[other] = PIECE_WATER;
        }
    }
}

// what is behind the pieces of body b. @return whether there is any film
static bool pieces_look(silt_uplift *u, const silt_run *run, int b) {
    const silt_nodes *nodes = &run->nodes;
    const silt_mesh *mesh = &run->mesh;
    const int D = mesh->dim;
    bool water = false, film = false;
    SILT_RESERVE(u->state, u->state_capacity, u->n_piece + 1);
    memset(u->state, PIECE_AIR, (size_t)u->n_piece + 1);
    pieces_list(u, nodes->count, D);
    for (int f = 0; f < mesh->n_facet; f++) {
        if (mesh->facet_kind[f] != FACET_BODY || nodes->owner[mesh->facet[f][0]] != b)
            continue;
        if (!piece_wet(u, mesh->facet[f], D) && D == 3)
            piece_crossed(u, mesh->facet[f]);
        water = true;
    }
    for (int k = 0; k < u->n_piece && water; k++) {
        double middle[3] = {0}, h = 0;
        for (int a = 0; a < D && u->state[k] == PIECE_AIR; a++) {
            h += silt_node_h(nodes, u->piece[k][a], run->scene->fluid.size) / D;
            for (int d = 0; d < D; d++)
                middle[d] += nodes->x[D * u->piece[k][a] + d] / D;
        }
        if (u->state[k] == PIECE_AIR && solid_distance(run, b, middle, UPLIFT_GAP * h) < UPLIFT_GAP * h) {
            u->state[k] = PIECE_FILM;
            film = true;
        }
    }
    return film;
}

// pieces under films join the film's
static void film_add(silt_uplift *u, const silt_run *run) {
    silt_film *m = &u->film;
    const int D = run->mesh.dim;
    for (int k = 0; k < u->n_piece; k++) {
        if (u->state[k] != PIECE_FILM)
            continue;
        SILT_RESERVE(m->element, m->element_capacity, m->n_element + 1);
        m->element[m->n_element][2] = -1;
        for (int a = 0; a < D; a++) {
            const int i = u->piece[k][a];
            if (u->place[i] < 0) {
                u->place[i] = m->n_node;
                u->group[i] = i;
                SILT_RESERVE(m->node, m->node_capacity, m->n_node + 1);
                SILT_RESERVE(m->rim, m->rim_capacity, m->n_node + 1);
                m->rim[m->n_node] = run->mesh.wet[i] ? FILM_WET : FILM_INNER;
                m->node[m->n_node++] = i;
            }
            m->element[m->n_element][a] = u->place[i];
        }
        m->n_element++;
    }
    for (int k = 0; k < u->n_piece; k++)
        for (int a = 0; a < D && u->state[k] == PIECE_AIR; a++)
            if (u->place[u->piece[k][a]] >= 0 && m->rim[u->place[u->piece[k][a]]] == FILM_INNER)
                m->rim[u->place[u->piece[k][a]]] = FILM_AIR;
}

// ---- mouths

// a node of the water that something solid holds
static bool held(const silt_nodes *nodes, int i) {
    return nodes->kind[i] == NODE_BODY || nodes->kind[i] == NODE_BED || nodes->kind[i] == NODE_CORNER ||
           (nodes->kind[i] == NODE_FLUID && nodes->wall[i][0] >= 0);
}

// A facet between a body and what it is near to, with no node that is free: the mouth of a film, though it may have no piece beyond
static bool is_mouth(const silt_run *run, const int *facet) {
    const silt_nodes *nodes = &run->nodes;
    bool body = false, all = true;
    for (int a = 0; a < run->mesh.dim && all; a++) {
        all = held(nodes, facet[a]);
        body |= nodes->kind[facet[a]] == NODE_BODY;
    }
    for (int a = 0; a < run->mesh.dim && all && body; a++)
        all = nodes->kind[facet[a]] != NODE_BODY || near_solid(run, facet[a], UPLIFT_GAP);
    return all && body;
}

static int group_of(silt_uplift *u, int i) {
    while (u->group[i] != i)
        i = u->group[i] = u->group[u->group[i]];
    return i;
}

static void group_join(silt_uplift *u, int i, int j) {
    const int p = group_of(u, i), q = group_of(u, j);
    u->group[p < q ? q : p] = p < q ? p : q;
}

// Films are groups of bodies' nodes; air comes to those that have an end in it, or whose mouths have a free node beside them
static void films_group(silt_uplift *u, const silt_run *run) {
    const silt_nodes *nodes = &run->nodes;
    const silt_mesh *mesh = &run->mesh;
    const silt_film *m = &u->film;
    const int D = mesh->dim;
    for (int e = 0; e < m->n_element; e++)
        for (int a = 1; a < D; a++)
            group_join(u, m->node[m->element[e][0]], m->node[m->element[e][a]]);
    SILT_RESERVE(u->closed, u->closed_capacity, mesh->n_facet + 1);
    for (int f = 0; f < mesh->n_facet; f++) {
        u->closed[f] = mesh->facet_kind[f] == FACET_FREE && is_mouth(run, mesh->facet[f]);
        for (int a = 0, last = -1; a < D && u->closed[f]; a++) {
            const int i = mesh->facet[f][a];
            if (nodes->kind[i] != NODE_BODY)
                continue;
            if (u->group[i] < 0)
                u->group[i] = i;
            if (last >= 0)
                group_join(u, last, i);
            last = i;
        }
    }
    SILT_RESERVE(u->open, u->open_capacity, nodes->count + 1);
    memset(u->open, 0, (size_t)nodes->count);
    for (int k = 0; k < m->n_node; k++)
        u->open[group_of(u, m->node[k])] |= m->rim[k] == FILM_AIR;
    for (int f = 0; f < mesh->n_facet; f++)
        for (int a = 0; a < D && mesh->facet_kind[f] == FACET_FREE && !u->closed[f]; a++)
            if (u->group[mesh->facet[f][a]] >= 0)
                u->open[group_of(u, mesh->facet[f][a])] = 1;
}

// Pieces of water that nothing but mouths opens. One that has all the rims of its films is closed indeed, a full tank; a puddle under a body
// is not: its film goes on to air or to other water.
static void pieces_seal(silt_uplift *u, const silt_run *run) {
    const silt_mesh *mesh = &run->mesh;
    const silt_nodes *nodes = &run->nodes;
    SILT_RESERVE(u->parent, u->parent_capacity, nodes->count + 1);
    SILT_RESERVE(u->sealed, u->sealed_capacity, nodes->count + 1);
    for (int i = 0; i < nodes->count; i++)
        u->parent[i] = i;
    for (int e = 0; e < mesh->n_cell; e++)
        silt_group_join(u->parent, mesh->cell[e]);
    for (int i = 0; i < nodes->count; i++)
        u->sealed[i] = 1;
    for (int f = 0; f < mesh->n_facet; f++)
        if ((mesh->facet_kind[f] == FACET_FREE && !u->closed[f]) || mesh->facet_kind[f] == FACET_OPEN)
            u->sealed[silt_group_find(u->parent, mesh->facet[f][0])] = 0;
    // one piece for each film, or they are not closed: u->place is not used any more
    int *piece = u->place;
    for (int i = 0; i < nodes->count; i++)
        piece[i] = -1;
    for (int pass = 0; pass < 2; pass++)
        for (int i = 0; i < nodes->count; i++) {
            if (u->group[i] < 0 || !mesh->wet[i])
                continue;
            const int g = group_of(u, i), own = silt_group_find(u->parent, i);
            if (pass == 0)
                piece[g] = piece[g] < 0 || piece[g] == own ? own : -2;
            else if (u->sealed[own] && (u->open[g] || piece[g] == -2))
                u->sealed[own] = 2;
        }
    for (int f = 0; f < mesh->n_facet; f++)
        if (u->closed[f] && u->sealed[silt_group_find(u->parent, mesh->facet[f][0])] == 2)
            u->closed[f] = 0;
    // where it touches a body the film goes by, as if it were not there
    for (int k = 0; k < u->film.n_node; k++) {
        const int i = u->film.node[k];
        if (u->film.rim[k] == FILM_WET && u->sealed[silt_group_find(u->parent, i)] == 2)
            u->film.rim[k] = FILM_INNER;
    }
}

// a node of a mouth that slides along a wall goes with the body, of several with the first that asks
static void slave_add(silt_uplift *u, const silt_run *run, const int *facet, int a) {
    silt_film *m = &u->film;
    const int i = facet[a];
    if (run->nodes.kind[i] != NODE_FLUID || u->place[i] == SLAVE)
        return;
    int body = -1;
    for (int c = 0; c < run->mesh.dim && body < 0; c++)
        body = run->nodes.kind[facet[c]] == NODE_BODY ? run->nodes.owner[facet[c]] : -1;
    u->place[i] = SLAVE;
    SILT_RESERVE(m->slave, m->slave_capacity, m->n_slave + 1);
    SILT_RESERVE(m->slave_body, m->slave_body_capacity, m->n_slave + 1);
    m->slave[m->n_slave] = i;
    m->slave_body[m->n_slave++] = body;
}

// Which mouths are shut: all of a film that air does not come to, else those that are narrow. Their nodes are no free surface.
static void mouths_shut(silt_uplift *u, silt_run *run) {
    silt_mesh *mesh = &run->mesh;
    silt_film *m = &u->film;
    const int D = mesh->dim;
    bool any = false;
    for (int f = 0; f < mesh->n_facet; f++) {
        for (int a = 0; a < D && u->closed[f]; a++) {
            const int i = mesh->facet[f][a];
            if (run->nodes.kind[i] == NODE_BODY)
                u->closed[f] = !u->open[group_of(u, i)] || near_solid(run, i, UPLIFT_SHUT);
        }
        any |= u->closed[f];
    }
    // a wide film that air comes to is air
    for (int k = 0; k < m->n_node; k++)
        if (u->open[group_of(u, m->node[k])] && m->rim[k] == FILM_WET && !near_solid(run, m->node[k], UPLIFT_SHUT))
            m->rim[k] = FILM_AIR;
    if (any)
        pieces_seal(u, run);
    for (int f = 0; f < mesh->n_facet && any; f++) {
        for (int a = 0; a < D && u->closed[f]; a++)
            mesh->surface[mesh->facet[f][a]] = 0;
        for (int a = 0; a < D && u->closed[f]; a++)
            slave_add(u, run, mesh->facet[f], a);
        if (u->closed[f]) {
            SILT_RESERVE(m->mouth, m->mouth_capacity, m->n_mouth + 1);
            m->mouth[m->n_mouth++] = f;
        }
    }
    for (int f = 0; f < mesh->n_facet && any; f++)
        for (int a = 0; a < D && mesh->facet_kind[f] == FACET_FREE && !u->closed[f]; a++)
            mesh->surface[mesh->facet[f][a]] = 1;
}

// flat cells, of which nothing moves but as bodies and walls do
static bool all_stuck(const silt_uplift *u, const silt_run *run, int i) {
    const silt_nodes *nodes = &run->nodes;
    const int D = run->mesh.dim;
    double volume = 0;
    for (int k = run->mesh.node_cell_start[i]; k < run->mesh.node_cell_start[i + 1]; k++)
        volume += silt_cell_volume(&run->mesh, nodes->x, run->mesh.node_cell[k]) / (D + 1);
    if (volume > UPLIFT_FLAT * pow(silt_node_h(nodes, i, run->scene->fluid.size), D))
        return false;
    for (int k = run->mesh.neighbour_start[i]; k < run->mesh.neighbour_start[i + 1]; k++) {
        const int j = run->mesh.neighbour[k], kind = nodes->kind[j];
        const bool sticks = kind == NODE_FLUID && nodes->wall[j][0] >= 0 &&
                            run->scene->wall[run->walls.wall[nodes->wall[j][0]]].condition == WALL_NO_SLIP;
        if (kind != NODE_BODY && kind != NODE_BED && kind != NODE_CORNER && u->place[j] != SLAVE && !sticks)
            return false;
    }
    return true;
}

// What a film gives to a rim whose cells can go nowhere would have to go through them by a pressure that nothing bounds: 35 MPa under a cube
// that lifts off. The film goes on past such cells, as long as it has another rim.
static void rims_stuck(silt_uplift *u, const silt_run *run) {
    silt_film *m = &u->film;
    SILT_RESERVE(u->sealed, u->sealed_capacity, run->nodes.count + 1);
    uint8_t *way = u->sealed; // per group: it has a rim
    memset(way, 0, (size_t)run->nodes.count);
    for (int pass = 0; pass < 2; pass++)
        for (int k = 0; k < m->n_node; k++) {
            const bool stuck = m->rim[k] == FILM_WET && all_stuck(u, run, m->node[k]);
            if (pass == 0)
                way[group_of(u, m->node[k])] |= m->rim[k] != FILM_INNER && !stuck;
            else if (stuck && way[group_of(u, m->node[k])])
                m->rim[k] = FILM_INNER;
        }
}

// ---- what films hold

static double node_gap(const silt_run *run, int i) {
    const int D = run->mesh.dim;
    return solid_distance(run, run->nodes.owner[i], run->nodes.x + D * i, run->scene->fluid.size);
}

static int mouth_body(const silt_run *run, int f) {
    int body = -1;
    for (int a = 0; a < run->mesh.dim && body < 0; a++)
        body = run->nodes.kind[run->mesh.facet[f][a]] == NODE_BODY ? run->nodes.owner[run->mesh.facet[f][a]] : -1;
    return body;
}

// Water in the films that air does not come to: the way across, mean of a piece's corners, times its size; beyond a mouth too
static void films_measure(silt_uplift *u, const silt_run *run) {
    const silt_film *m = &u->film;
    const int D = run->mesh.dim;
    SILT_RESERVE(u->volume, u->volume_capacity, run->n_body_before + 1);
    memset(u->volume, 0, (size_t)run->n_body_before * sizeof *u->volume);
    double *gap = silt_alloc((size_t)m->n_node + 1, sizeof *gap);
    for (int a = 0; a < m->n_node; a++)
        gap[a] = u->open[group_of(u, m->node[a])] ? 0 : node_gap(run, m->node[a]);
    for (int e = 0; e < m->n_element; e++) {
        int corner[3] = {-1, -1, -1};
        double normal[3], mean = 0;
        for (int a = 0; a < D; a++) {
            corner[a] = m->node[m->element[e][a]];
            mean += gap[m->element[e][a]] / D;
        }
        silt_facet_mean_normal(&run->mesh, run->nodes.x, run->nodes.x, corner, normal);
        u->volume[run->nodes.owner[corner[0]]] += mean * silt_length(D, normal);
    }
    free(gap);
    for (int k = 0; k < m->n_mouth; k++) {
        const int *facet = run->mesh.facet[m->mouth[k]];
        double normal[3], mean = 0;
        for (int a = 0; a < D; a++)
            if (run->nodes.kind[facet[a]] == NODE_BODY && !u->open[group_of(u, facet[a])])
                mean += node_gap(run, facet[a]) / D;
        silt_facet_mean_normal(&run->mesh, run->nodes.x, run->nodes.x, facet, normal);
        u->volume[mouth_body(run, m->mouth[k])] += mean * silt_length(D, normal);
    }
}

void silt_uplift_owe(silt_uplift *u, silt_run *run) {
    silt_nodes *nodes = &run->nodes;
    SILT_RESERVE(run->body_water, run->body_water_capacity, run->n_body_before + 1);
    films_measure(u, run);
    for (int b = 0; b < run->n_body_before; b++) {
        silt_body_water *water = &run->body_water[b];
        if (!water->film_known) {
            water->film_known = 1;
            water->film = u->volume[b];
            if (run->step == 0)
                run->ledger.initial_volume += u->volume[b];
        }
        const double owed = water->film - u->volume[b];
        if (owed == 0)
            continue;
        // its rim's nodes, or all that are wet
        int n = 0, n_wet = 0;
        for (int k = 0; k < u->film.n_node; k++)
            n += u->film.rim[k] == FILM_WET && nodes->owner[u->film.node[k]] == b;
        for (int k = 0; k < u->film.n_node && n; k++)
            if (u->film.rim[k] == FILM_WET && nodes->owner[u->film.node[k]] == b)
                nodes->debt[u->film.node[k]] += owed / n;
        for (int pass = 0; pass < 2 && !n; pass++)
            for (int i = 0; i < nodes->count; i++) {
                const bool own = nodes->kind[i] == NODE_BODY && nodes->owner[i] == b && run->mesh.wet[i];
                if (pass == 0)
                    n_wet += own;
                else if (own)
                    nodes->debt[i] += owed / n_wet;
            }
        if (!n && !n_wet)
            u->volume[b] = water->film;
    }
}

double silt_uplift_give(const silt_uplift *u, silt_run *run) {
    double all = 0;
    if (!u)
        return 0;
    const silt_film *m = &u->film;
    const int D = run->mesh.dim;
    for (int b = 0; b < run->n_body_before; b++)
        run->body_water[b].film = u->volume[b];
    for (int a = 0; a < m->n_node; a++) {
        run->body_water[run->nodes.owner[m->node[a]]].film -= run->dt * m->squeezed[a];
        all += run->dt * m->squeezed[a];
    }
    for (int k = 0; k < m->n_mouth; k++) {
        const int *facet = run->mesh.facet[m->mouth[k]];
        double rate = 0;
        for (int a = 0; a < D; a++)
            for (int d = 0; d < D; d++)
                rate += m->mouth_normal[k][d] * silt_mesh_velocity(&run->fluid, D * facet[a] + d) / D;
        run->body_water[mouth_body(run, m->mouth[k])].film -= run->dt * rate;
        all += run->dt * rate;
    }
    return all;
}

// the wall of the scene that x is nearest to, within reach; -1: something else is nearer
static int nearest_wall(const silt_run *run, int b, const double *x, double reach) {
    int element;
    const double distance = run->walls.count ? fabs(silt_walls_distance(&run->walls, x, &element)) : HUGE_VAL;
    return distance < reach && !(solid_distance(run, b, x, reach) < distance) ? run->walls.wall[element] : -1;
}

// middle of a facet or piece; @return its mean pressure
static double facet_load(const silt_run *run, const int *corner, const double *p, const int *at, double middle[3]) {
    const int D = run->mesh.dim;
    double mean = 0;
    memset(middle, 0, 3 * sizeof *middle);
    for (int a = 0; a < D; a++) {
        mean += p[at[a]] / D;
        for (int d = 0; d < D; d++)
            middle[d] += run->nodes.x[D * corner[a] + d] / D;
    }
    return mean;
}

void silt_uplift_walls(const silt_uplift *u, const silt_run *run, double (*force)[3]) {
    const silt_film *m = u ? &u->film : NULL;
    const int D = run->mesh.dim;
    const double reach = run->scene->fluid.size;
    for (int e = 0; m && e < m->n_element; e++) {
        int corner[3] = {-1, -1, -1};
        double middle[3];
        for (int a = 0; a < D; a++)
            corner[a] = m->node[m->element[e][a]];
        const double p = facet_load(run, corner, m->work, m->element[e], middle);
        const int wall = nearest_wall(run, run->nodes.owner[corner[0]], middle, reach);
        for (int d = 0; d < D && wall >= 0; d++)
            force[wall][d] += p * m->normal[e][d];
    }
    for (int k = 0; m && k < m->n_mouth; k++) {
        const int *facet = run->mesh.facet[m->mouth[k]];
        double middle[3];
        const double p = facet_load(run, facet, run->nodes.p, facet, middle);
        const int wall = nearest_wall(run, mouth_body(run, m->mouth[k]), middle, reach);
        for (int d = 0; d < D && wall >= 0; d++)
            force[wall][d] += p * m->mouth_normal[k][d];
    }
}

void silt_uplift_open(const silt_uplift *u, silt_run *run) {
    for (int k = 0; u && k < u->film.n_mouth; k++)
        for (int a = 0; a < run->mesh.dim; a++)
            run->mesh.surface[run->mesh.facet[u->film.mouth[k]][a]] = 1;
}

silt_film *silt_uplift_find(silt_uplift **uplift, silt_run *run) {
    if (!*uplift)
        *uplift = silt_alloc(1, sizeof **uplift);
    silt_uplift *u = *uplift;
    const silt_nodes *nodes = &run->nodes;
    silt_film *m = &u->film;
    m->n_node = m->n_element = m->n_mouth = m->n_slave = 0;
    if (!run->mesh.n_cell)
        return NULL;
    SILT_RESERVE(u->group, u->group_capacity, nodes->count + 1);
    SILT_RESERVE(u->place, u->place_capacity, nodes->count + 1);
    for (int i = 0; i < nodes->count; i++)
        u->group[i] = u->place[i] = -1;
    const int n_id = nodes_by_id(u, nodes);
    for (int b = 0, from = 0; b < run->n_body_before; b++) {
        while (from < n_id && (u->at[from] < 0 || nodes->owner[u->at[from]] < b))
            from++;
        pieces_make(u, run, b, from, n_id);
        if (u->n_piece && pieces_look(u, run, b))
            film_add(u, run);
    }
    films_group(u, run);
    mouths_shut(u, run);
    rims_stuck(u, run);
    silt_film_ready(m, &run->mesh, nodes->x);
    return m->n_mouth || m->n_element ? m : NULL;
}
