// what happens to water nodes that meet walls: they are put on, slide, turn corners, stop in them, come free
#include "wall.h"

#define CONTACT_REACH 0.1  // times h: a surface node that comes nearer while approaching touches
#define CONTACT_MARGIN 0.5 // times h: so far around a node in the open walls are looked for
#define CONTACT_FILL 0.3   // times h: so near a node is put into an empty crease or corner
#define CONTACT_SPACE 0.6  // times h: nodes in a crease leave that much room
#define CONTACT_ON 1e-6    // times h: what counts as on an element when planes were cut with each other
#define CONTACT_HOPS 200   // from element to element in one step

typedef struct contact {
    const silt_walls *walls;
    silt_nodes *nodes;
    const double *x_old;
    int dim;
    int *list; // elements near by, owned
    int capacity;
} contact;

/** a node while it is dealt with */
typedef struct contact_node {
    double x[3], v[3], old[3];
    int e[3], n; // elements it lies on
    double h, snap;
    bool behind;  // at least one plane near by has it behind
    bool changed; // the elements are not those it came with, its velocity has to be mended
} contact_node;

static void node_load(const contact *c, int i, double h, contact_node *p) {
    *p = (contact_node){.h = silt_node_h(c->nodes, i, h)};
    p->snap = WALL_SNAP * p->h;
    for (int d = 0; d < c->dim; d++) {
        p->x[d] = c->nodes->x[c->dim * i + d];
        p->v[d] = c->nodes->v[c->dim * i + d];
        p->old[d] = c->x_old[c->dim * i + d];
    }
    for (int k = 0; k < 3; k++)
        p->e[k] = -1;
    while (p->n < c->dim && c->nodes->wall[i][p->n] >= 0) {
        p->e[p->n] = c->nodes->wall[i][p->n];
        p->n++;
    }
}

static void node_store(const contact *c, int i, const contact_node *p) {
    for (int d = 0; d < c->dim; d++) {
        c->nodes->x[c->dim * i + d] = p->x[d];
        c->nodes->v[c->dim * i + d] = p->v[d];
    }
    for (int k = 0; k < 3; k++)
        c->nodes->wall[i][k] = k < p->n ? p->e[k] : -1;
}

// velocity of the wall's material that is at x now, m/s
static void material_velocity(const silt_walls *walls, int wall, const double x[3], double v[3]) {
    const wall_step *step = &walls->index->step[wall];
    v[0] = v[1] = v[2] = 0;
    if (!step->moves || step->dt <= 0)
        return;
    wall_carry_back(walls, wall, x, v);
    for (int d = 0; d < 3; d++)
        v[d] = (x[d] - v[d]) / step->dt;
}

static double height_over(const silt_walls *walls, int e, const double x[3]) {
    double room[3];
    const double *a = wall_corner(walls, e, 0, room);
    return (x[0] - a[0]) * walls->normal[e][0] + (x[1] - a[1]) * walls->normal[e][1] + (x[2] - a[2]) * walls->normal[e][2];
}

// onto all of its elements' planes; elements that contradict the others are dropped
static void node_project(const silt_walls *walls, contact_node *p) {
    const double *normal[3] = {NULL};
    double value[3], shift[3];
    while (p->n) {
        for (int k = 0; k < p->n; k++) {
            normal[k] = walls->normal[p->e[k]];
            value[k] = -height_over(walls, p->e[k], p->x);
        }
        if (wall_solve(p->n, normal, value, shift))
            break;
        p->n--;
        p->changed = true;
    }
    for (int d = 0; d < 3 && p->n; d++)
        p->x[d] += shift[d];
}

static void node_remove(contact_node *p, int k) {
    for (; k + 1 < p->n; k++)
        p->e[k] = p->e[k + 1];
    p->n--;
    p->changed = true;
}

// takes out of the velocity what the walls do not allow; without slip it is the walls'
static void node_mend_velocity(const silt_walls *walls, contact_node *p) {
    double own[3][3], value[3], out[3];
    const double *normal[3] = {NULL};
    bool slip = true;
    for (int k = 0; k < p->n; k++) {
        material_velocity(walls, walls->wall[p->e[k]], p->x, own[k]);
        normal[k] = walls->normal[p->e[k]];
        value[k] = wall_dot(normal[k], p->v) - wall_dot(normal[k], own[k]);
        if (walls->slip[p->e[k]])
            continue;
        slip = false;
        double surface[3];
        wall_sliding(walls, p->e[k], surface);
        for (int d = 0; d < 3; d++)
            own[k][d] += surface[d];
    }
    if (!p->n)
        return;
    if (!slip)
        wall_given(walls, p->n, p->e, normal, (const double(*)[3])own, p->v);
    else if (wall_solve(p->n, normal, value, out))
        for (int d = 0; d < 3; d++)
            p->v[d] -= out[d];
}

// Over a gentle bend from element e to f: the way beyond `at` and the velocity relative to the wall turn with the surface.
static void node_bend(const silt_walls *walls, contact_node *p, int e, int edge, int f, const double at[3]) {
    double along[3] = {0, 0, edge ? -1 : 1}, out[3], into[3], wall[3];
    if (walls->dim == 3) {
        for (int d = 0; d < 3; d++)
            along[d] = walls->corner[e][(edge + 1) % 3][d] - walls->corner[e][edge][d];
        const double length = sqrt(wall_dot(along, along));
        for (int d = 0; d < 3; d++)
            along[d] /= length;
    }
    silt_cross(along, walls->normal[e], out);
    silt_cross(along, walls->normal[f], into);
    // edge x normal points out of e, and into f when seen with the edge of e
    material_velocity(walls, walls->wall[e], p->x, wall);
    double way[3], speed[3];
    for (int d = 0; d < 3; d++) {
        way[d] = p->x[d] - at[d];
        speed[d] = p->v[d] - wall[d];
    }
    const double way_along = wall_dot(way, along), way_out = wall_dot(way, out);
    const double speed_along = wall_dot(speed, along), speed_out = wall_dot(speed, out), speed_off = wall_dot(speed, walls->normal[e]);
    for (int d = 0; d < 3; d++) {
        p->x[d] = at[d] + way_along * along[d] + way_out * into[d];
        p->v[d] = wall[d] + speed_along * along[d] + speed_out * into[d] + speed_off * walls->normal[f][d];
    }
}

// On a bent patch the velocity turns with the wall and keeps its size: no work is done by turning.
static void node_turn(const silt_walls *walls, contact_node *p) {
    const double *n = walls->normal[p->e[0]];
    double wall[3], speed[3];
    material_velocity(walls, walls->wall[p->e[0]], p->x, wall);
    for (int d = 0; d < 3; d++)
        speed[d] = p->v[d] - wall[d];
    const double off = wall_dot(speed, n), whole = wall_dot(speed, speed), along = whole - off * off;
    const double factor = along > 0.5 * whole ? sqrt(whole / along) : 1;
    for (int d = 0; d < 3; d++)
        p->v[d] = wall[d] + factor * (speed[d] - off * n[d]);
}

// an element that goes on where e ends without being joined to it, -1
static int element_beyond(contact *c, const contact_node *p, int e) {
    double lo[3], hi[3];
    for (int d = 0; d < 3; d++) {
        lo[d] = p->x[d] - CONTACT_ON * p->h;
        hi[d] = p->x[d] + CONTACT_ON * p->h;
    }
    int n = 0;
    for (int t = 0; t < c->walls->index->n_tree; t++)
        wall_query(c->walls, t, lo, hi, &c->list, &n, &c->capacity);
    for (int k = 0; k < n; k++) {
        double on[3];
        int feature;
        if (c->list[k] != e && wall_dot(c->walls->normal[c->list[k]], c->walls->normal[e]) > WALL_BEND &&
            wall_nearest(c->walls, c->list[k], p->x, on, &feature) <= silt_square(CONTACT_ON * p->h))
            return c->list[k];
    }
    return -1;
}

// the edge through which the way from q to x leaves the element; *share: of the way, -1 edge: it does not leave
static int element_exit(const silt_walls *walls, int e, const double q[3], const double x[3], double snap, double *share) {
    double in[3], before[3];
    int edge = -1;
    wall_inside(walls, e, x, in);
    for (int k = 0; k < wall_dim(walls); k++) {
        if (in[k] >= -snap)
            continue;
        if (edge < 0) {
            wall_inside(walls, e, q, before);
            *share = 2;
        }
        const double start = silt_max(before[k], 0), t = start / (start - in[k]);
        if (t < *share) {
            *share = t;
            edge = k;
        }
    }
    return edge;
}

// Slides a node over its elements: on over gentle bends, in creases and corners that hold water it gets one more element, past
// an edge in the open it loses one. q: a point on the first element from where it came.
static void node_slide(contact *c, contact_node *p, const double q[3]) {
    const silt_walls *walls = c->walls;
    double start[3] = {q[0], q[1], q[2]};
    for (int hop = 0; hop < CONTACT_HOPS && p->n; hop++) {
        node_project(walls, p);
        int k = 0, edge = -1;
        double share = 0, at[3], room[3];
        for (; k < p->n; k++)
            if ((edge = element_exit(walls, p->e[k], start, p->x, p->snap, &share)) >= 0)
                break;
        if (k >= p->n)
            return;
        const int e = p->e[k], f = wall_joined(walls, e, edge);
        if (f < 0) {
            const int other = element_beyond(c, p, e);
            if (other < 0)
                node_remove(p, k);
            else
                p->e[k] = other;
            continue;
        }
        if (wall_dot(walls->normal[e], walls->normal[f]) > WALL_BEND) {
            if (p->n == 1) {
                for (int d = 0; d < 3; d++)
                    at[d] = start[d] + share * (p->x[d] - start[d]);
                if (walls->dim != 3)
                    memcpy(at, wall_corner(walls, e, edge, room), sizeof at);
                node_bend(walls, p, e, edge, f, at);
                memcpy(start, at, sizeof start);
            }
            p->e[k] = f;
            continue;
        }
        if (wall_rise(walls, e, edge, f) <= 0) {
            node_remove(p, k);
            continue;
        }
        bool known = p->n >= c->dim;
        for (int m = 0; m < p->n; m++)
            known |= walls->patch[p->e[m]] == walls->patch[f];
        if (known)
            return;
        p->e[p->n++] = f;
        p->changed = true;
    }
}

// The element that a node has come through since the start of the step, or touches while it moves towards it; -1: none. For a node
// that lies on walls already only other walls that it has come through count. *q: where the way meets the element.
static int node_meets(contact *c, contact_node *p, double reach, double q[3]) {
    const silt_walls *walls = c->walls;
    // nodes in the open are looked after when they got behind walls some time ago
    const double margin = p->n ? reach + p->snap : CONTACT_MARGIN * p->h;
    int best = -1;
    double best_share = HUGE_VAL, best_now = 0;
    for (int t = 0; t < walls->index->n_tree; t++) {
        // the way as the wall sees it
        const int wall = walls->index->tree[t].wall;
        double from[3], lo[3], hi[3];
        if (wall >= 0)
            wall_carry(walls, wall, p->old, from);
        else
            memcpy(from, p->old, sizeof from);
        for (int d = 0; d < 3; d++) {
            lo[d] = silt_min(from[d], p->x[d]) - margin;
            hi[d] = silt_max(from[d], p->x[d]) + margin;
        }
        int n = 0;
        wall_query(walls, t, lo, hi, &c->list, &n, &c->capacity);
        for (int k = 0; k < n; k++) {
            const int e = c->list[k];
            const double now = height_over(walls, e, p->x), before = height_over(walls, e, from);
            double at[3], in[3], v[3];
            p->behind |= now < -p->snap;
            if (before < -reach - p->snap)
                continue; // was behind it already: another wall's business
            if (p->n == 0) {
                material_velocity(walls, walls->wall[e], p->x, v);
                if (now >= reach || (now >= 0 && wall_dot(p->v, walls->normal[e]) >= wall_dot(v, walls->normal[e])))
                    continue;
            } else {
                bool other = now < -p->snap;
                for (int m = 0; m < p->n && other; m++)
                    other = wall_dot(walls->normal[e], walls->normal[p->e[m]]) < WALL_BEND;
                if (!other)
                    continue;
            }
            // what started on the plane has met it there
            const double share = now < 0 && before > 0 ? before / (before - now) : p->n || (now < 0 && before >= -p->snap) ? 0 : 1;
            for (int d = 0; d < 3; d++)
                at[d] = from[d] + share * (p->x[d] - from[d]);
            wall_inside(walls, e, at, in);
            if (in[0] < -p->snap || in[1] < -p->snap || in[2] < -p->snap)
                continue;
            const bool tie = share == best_share && (fabs(now) > best_now || (fabs(now) == best_now && e > best));
            if (share > best_share || tie)
                continue;
            best = e;
            best_share = share;
            best_now = fabs(now);
            memcpy(q, at, sizeof at);
        }
    }
    if (best < 0)
        return -1;
    const double off = height_over(walls, best, q);
    for (int d = 0; d < 3; d++)
        q[d] -= off * walls->normal[best][d];
    return best;
}

// A node that got behind a closed wall all the same is put on its nearest face: out of an obstacle from wherever it is, back into
// a tank when it is not far.
static void node_expel(const silt_walls *walls, contact_node *p) {
    const struct silt_wall_index *index = walls->index;
    bool near = p->behind;
    for (int t = 0; t < index->n_tree && !near; t++) {
        const wall_box *box = &index->box[index->tree[t].root];
        near = index->tree[t].obstacle;
        for (int d = 0; d < walls->dim && near; d++)
            near = p->x[d] > box->lo[d] && p->x[d] < box->hi[d];
    }
    int e, feature;
    const double distance = near ? silt_walls_distance(walls, p->x, &e) : 0;
    if (distance >= -p->snap || !index->closed[e] || (!index->obstacle[e] && distance < -p->h))
        return;
    double on[3];
    wall_nearest(walls, e, p->x, on, &feature);
    memcpy(p->x, on, sizeof on);
    p->e[0] = e;
    p->n = 1;
    p->changed = true;
}

static void node_contact(contact *c, contact_node *p, bool interior) {
    const silt_walls *walls = c->walls;
    double q[3];
    if (p->n) {
        bool stuck = false;
        double own[3][3], way[3];
        const double *normal[3] = {NULL};
        for (int k = 0; k < p->n; k++) {
            normal[k] = walls->normal[p->e[k]];
            stuck |= !walls->slip[p->e[k]];
            wall_carry(walls, walls->wall[p->e[k]], p->old, own[k]);
            memcpy(q, own[0], sizeof q);
            for (int d = 0; d < 3; d++)
                own[k][d] -= p->old[d];
        }
        // without slip a node stays where it is on the wall, whatever the surface does along itself
        if (stuck) {
            wall_given(walls, p->n, p->e, normal, (const double(*)[3])own, way);
            for (int d = 0; d < 3; d++)
                p->x[d] = p->old[d] + way[d];
        }
        const double off = height_over(walls, p->e[0], q);
        for (int d = 0; d < 3; d++)
            q[d] -= off * walls->normal[p->e[0]][d];
        node_slide(c, p, q);
        if (!stuck && !p->changed && p->n == 1 && walls->index->bent[p->e[0]])
            node_turn(walls, p);
    }
    // other walls in its way: one more holds it
    for (int turn = 0; turn < c->dim; turn++) {
        const int e = p->n < c->dim ? node_meets(c, p, interior ? 0 : CONTACT_REACH * p->h, q) : -1;
        if (e < 0)
            break;
        p->e[p->n++] = e;
        p->changed = true;
        const int before = p->n;
        node_slide(c, p, q);
        if (p->n < before)
            break;
    }
    if (p->n == 0)
        node_expel(walls, p);
    if (p->changed)
        node_mend_velocity(walls, p);
}

// ---------------------------------------------------------------- creases and corners that are empty

/** a place in a crease or corner that a node could take */
typedef struct contact_slot {
    double distance, x[3];
    int node, e[3], n;
} contact_slot;

static int compare_slots(const void *a, const void *b) {
    const contact_slot *p = a, *q = b;
    if (p->n != q->n)
        return q->n - p->n; // corners first
    if (p->distance != q->distance)
        return p->distance < q->distance ? -1 : 1;
    if (p->node != q->node)
        return p->node < q->node ? -1 : 1;
    return p->e[p->n - 1] - q->e[q->n - 1];
}

// places within reach of a node on a wall: where the planes of its elements cut another one that rises before it
static void slots_find(contact *c, const contact_node *p, int i, contact_slot **slot, int *n_slot, int *capacity) {
    const silt_walls *walls = c->walls;
    const double limit = CONTACT_FILL * p->h, near = CONTACT_ON * p->h;
    double lo[3], hi[3];
    for (int d = 0; d < 3; d++) {
        lo[d] = p->x[d] - limit;
        hi[d] = p->x[d] + limit;
    }
    int n = 0;
    for (int t = 0; t < walls->index->n_tree; t++)
        wall_query(walls, t, lo, hi, &c->list, &n, &c->capacity);
    for (int k = 0; k < n; k++) {
        const int e = c->list[k];
        const double over = height_over(walls, e, p->x);
        bool fits = over > 0 && over < limit;
        for (int m = 0; m < p->n && fits; m++)
            fits = wall_dot(walls->normal[e], walls->normal[p->e[m]]) < WALL_BEND;
        if (!fits)
            continue;
        contact_node at = *p;
        at.e[at.n++] = e;
        node_project(walls, &at);
        double in[3], way2 = 0;
        for (int d = 0; d < 3; d++)
            way2 += silt_square(at.x[d] - p->x[d]);
        wall_inside(walls, e, at.x, in);
        if (at.n != p->n + 1 || way2 >= limit * limit || in[0] < -near || in[1] < -near || in[2] < -near)
            continue;
        // the other walls must reach there too
        for (int m = 0; m < p->n && fits; m++) {
            fits = false;
            for (int j = 0; j < n && !fits; j++) {
                double on[3];
                int feature;
                fits = wall_dot(walls->normal[c->list[j]], walls->normal[p->e[m]]) > WALL_BEND &&
                       wall_nearest(walls, c->list[j], at.x, on, &feature) <= near * near;
                if (fits)
                    at.e[m] = c->list[j];
            }
        }
        if (!fits)
            continue;
        SILT_RESERVE(*slot, *capacity, *n_slot + 1);
        contact_slot *s = &(*slot)[(*n_slot)++];
        *s = (contact_slot){.distance = sqrt(way2), .node = i, .n = at.n};
        memcpy(s->x, at.x, sizeof s->x);
        memcpy(s->e, at.e, sizeof s->e);
    }
}

// true when the place is taken, or in a crease one too near
static bool slot_taken(const contact *c, const contact_slot *s, const int *seated, int n_seated, double h) {
    const int dim = c->dim;
    const double space = (s->n == dim ? 1e-3 : CONTACT_SPACE) * h;
    for (int k = 0; k < n_seated; k++) {
        const int i = seated[k];
        double sum = 0;
        for (int d = 0; d < dim; d++)
            sum += silt_square(c->nodes->x[dim * i + d] - s->x[d]);
        if (sum > space * space)
            continue;
        int shared = 0;
        for (int m = 0; m < s->n; m++)
            for (int j = 0; j < 3; j++)
                if (c->nodes->wall[i][j] >= 0 && c->walls->patch[c->nodes->wall[i][j]] == c->walls->patch[s->e[m]]) {
                    shared++;
                    break;
                }
        if (shared >= s->n)
            return true;
    }
    return false;
}

// the first water node that comes within reach of an empty crease or corner is put into it
static void fill_corners(contact *c, const uint8_t *flying, double h) {
    silt_nodes *nodes = c->nodes;
    contact_slot *slot = NULL;
    int n_slot = 0, capacity = 0, *seated = NULL, n_seated = 0, seated_capacity = 0;
    for (int i = 0; i < nodes->count; i++) {
        if ((nodes->kind[i] != NODE_FLUID && nodes->kind[i] != NODE_OPEN) || nodes->wall[i][0] < 0)
            continue;
        contact_node p;
        node_load(c, i, h, &p);
        if (p.n < c->dim && nodes->kind[i] == NODE_FLUID && !(flying && flying[i]))
            slots_find(c, &p, i, &slot, &n_slot, &capacity);
        if (p.n > 1) {
            SILT_RESERVE(seated, seated_capacity, n_seated + 1);
            seated[n_seated++] = i;
        }
    }
    if (n_slot)
        qsort(slot, (size_t)n_slot, sizeof *slot, compare_slots);
    for (int k = 0; k < n_slot; k++) {
        contact_node p;
        node_load(c, slot[k].node, h, &p);
        // it has got a place already, or another one has this
        if (p.n >= slot[k].n || slot_taken(c, &slot[k], seated, n_seated, p.h))
            continue;
        p.n = slot[k].n;
        memcpy(p.e, slot[k].e, sizeof p.e);
        memcpy(p.x, slot[k].x, sizeof p.x);
        node_mend_velocity(c->walls, &p);
        node_store(c, slot[k].node, &p);
        SILT_RESERVE(seated, seated_capacity, n_seated + 1);
        seated[n_seated++] = slot[k].node;
    }
    free(slot);
    free(seated);
}

void silt_walls_contact(const silt_walls *walls, silt_nodes *nodes, const double *x_old, const uint8_t *interior,
                        const uint8_t *flying, double h) {
    if (!walls->count)
        return;
    contact c = {.walls = walls, .nodes = nodes, .x_old = x_old, .dim = wall_dim(walls)};
    for (int i = 0; i < nodes->count; i++) {
        contact_node p;
        if (nodes->kind[i] == NODE_FLUID) {
            node_load(&c, i, h, &p);
            node_contact(&c, &p, interior[i]);
            node_store(&c, i, &p);
        } else if (nodes->kind[i] == NODE_CORNER && nodes->owner[i] >= 0 && nodes->owner[i] < walls->count) {
            const int wall = walls->wall[nodes->owner[i]];
            if (!walls->index->step[wall].moves)
                continue;
            node_load(&c, i, h, &p);
            wall_carry(walls, wall, p.old, p.x);
            node_store(&c, i, &p);
        }
    }
    fill_corners(&c, flying, h);
    free(c.list);
}
