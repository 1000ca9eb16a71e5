// the cloud's density: crowded nodes leave, stretched places get nodes
#include "parallel.h"
#include "remesh.h"

/* Lengths are held against h, the mean of the local sizes of both ends. Candidates are taken in the order of how far off they
 * are, never of their numbers. A node leaves with its surroundings locked for the step; a node comes only where it has room,
 * and the room it needs is more than what it takes to be crowded: what came does not leave again. */
#define REFINE_CROWDED 0.5  // edges shorter than this times h lose a node; on the surface
#define REFINE_SURFACE 0.35 // this: the surface's shape hangs on them; up to the former where the surface is so flat that
#define REFINE_SHAPE 0.01   // less than this times h^dim comes or goes with the node
#define REFINE_FLAT 0.25    // a node nearer to a wall than this times h is pressed out
#define REFINE_SMOOTH 0.7   // cosine of the largest bend of the free surface over which a cubic is laid
#define REFINE_UNDER 0.1    // in space a node from within nearer than this times h to the free surface: slivers would follow, and go
#define REFINE_CREASE 1.5   // edges along creases that are longer than this times h get nodes
#define REFINE_ROOM 0.6     // but no node comes inside nearer than this times h to another
#define REFINE_MEET 0.15    // on the boundary what is less dear may be as near as this times h: it leaves
#define REFINE_PIECES 4     // into which an edge is split at most
// by the dimension, times h: edges of the surface and those inside get nodes when longer (with less the cloud grows denser than
// h in strong strain, and in space the diagonals of a lattice's faces would be split); room for a node on the boundary, where
// an edge that is not split tears
static const double refine_taut[4] = {0, 0, 1.5, 1.7}, refine_slack[4] = {0, 0, 1.6, 1.7}, refine_rim[4] = {0, 0, 0.36, 0.5};
// Water on a plane wall runs out in a thin wedge, which has nodes down to this thickness times h: with fewer the wedge ends
// in a step, water falls into it, and what is cut off and paid back there keeps the shore in motion for ever. 2-D only.
#define REFINE_WEDGE 0.1
#define REFINE_FRESH 0.15   // and gets new ones down to this
// cells at the surface that are smaller than this times h^dim are films
static const double refine_film[4] = {0, 0, 0.25, 0.068};

static double cell_measure(const silt_mesh *mesh, const double *x, const int *cell) {
    if (mesh->dim != 3 && mesh->period[0] == 0)
        return silt_cell_area(x, cell);
    const silt_mesh one = {.dim = mesh->dim, .period = {mesh->period[0], mesh->period[1], mesh->period[2]}, .cell = (int(*)[4])cell};
    return silt_cell_volume(&one, x, 0);
}

typedef struct candidate {
    double key;     // how far from what it should be: the largest first
    int a, b, cell; // edge, or node and -1
} candidate;

typedef struct refinement {
    const silt_mesh *mesh;
    silt_nodes *nodes;
    silt_memory *memory;
    const silt_walls *walls;
    int dim;
    double h; // fluid.size
    uint8_t *locked, *long_edge; // one per node: has an edge that may be too long
    int *facet_start, *facet; // boundary facets of every node
    candidate *list;
    int n, capacity;
    int *fresh, *fresh_next; // nodes added in this step by the nodes around them: first of a list, next
    int *fresh_node;
    int n_fresh, fresh_next_capacity, fresh_node_capacity;
} refinement;

static double refine_h(const refinement *r, int a, int b) {
    return r->nodes->h ? 0.5 * (silt_node_h(r->nodes, a, r->h) + silt_node_h(r->nodes, b, r->h)) : r->h;
}

// from a to a point, the shortest way
static double refine_apart(const refinement *r, int a, const double *to, double d[3]) {
    const double *x = r->nodes->x + r->dim * a;
    d[2] = 0;
    for (int c = 0; c < r->dim; c++) {
        d[c] = to[c] - x[c];
        if (r->mesh->period[c] > 0)
            d[c] -= r->mesh->period[c] * floor(d[c] / r->mesh->period[c] + 0.5);
    }
    return r->dim == 3 ? sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]) : hypot(d[0], d[1]);
}

static double refine_length(const refinement *r, int a, int b) {
    double d[3];
    return refine_apart(r, a, r->nodes->x + r->dim * b, d);
}

static void refine_lock(refinement *r, int i) {
    for (int k = r->mesh->neighbour_start[i]; k < r->mesh->neighbour_start[i + 1]; k++)
        r->locked[r->mesh->neighbour[k]] = 1;
}

static void refine_remove(refinement *r, int i) {
    r->memory->dead[i] = 1;
    refine_lock(r, i);
}

// how dear a node is: the dearer of two crowded ones stays; from 8 on none leaves
static int refine_rank(const refinement *r, int i) {
    int n_wall = 0;
    for (int s = 0; s < 3; s++)
        n_wall += r->nodes->wall[i][s] >= 0;
    if (r->nodes->kind[i] == NODE_OPEN)
        return n_wall >= r->dim - 1 ? 9 : r->mesh->surface[i] ? 7 : 5 + n_wall;
    if (r->nodes->kind[i] != NODE_FLUID)
        return 9;
    if (n_wall >= r->dim)
        return 8; // fills a corner
    return (n_wall == 2 ? 4 : n_wall) + (r->mesh->surface[i] ? 2 : 0);
}

static void refine_propose(refinement *r, double key, int a, int b, int cell) {
    SILT_RESERVE(r->list, r->capacity, r->n + 1);
    r->list[r->n++] = (candidate){key, a, b, cell};
}

static int candidate_order(const void *p, const void *q) {
    const candidate *a = p, *b = q;
    if (a->key != b->key)
        return a->key > b->key ? -1 : 1;
    if (a->a != b->a)
        return a->a - b->a;
    return a->b != b->b ? a->b - b->b : a->cell - b->cell;
}

static void refine_sort(refinement *r) {
    if (r->n > 1)
        qsort(r->list, (size_t)r->n, sizeof *r->list, candidate_order);
}

static void refine_facets(refinement *r) {
    const silt_mesh *mesh = r->mesh;
    r->facet_start = silt_borrow((size_t)mesh->n_node + 2, sizeof *r->facet_start);
    r->facet = silt_borrow((size_t)(3 * mesh->n_facet) + 1, sizeof *r->facet);
    for (int pass = 0; pass < 2; pass++) {
        for (int k = 0; k < mesh->n_facet; k++)
            for (int a = 0; a < r->dim; a++) {
                int *start = &r->facet_start[mesh->facet[k][a]];
                if (pass == 0)
                    ++*start;
                else
                    r->facet[--*start] = k;
            }
        for (int i = 0, sum = 0; pass == 0 && i <= mesh->n_node; i++)
            r->facet_start[i] = sum += i < mesh->n_node ? r->facet_start[i] : 0;
    }
}

// m2 or m3 between the surface with node i and without: the fan of its free facets over the middle of their rim
static double refine_shape(const refinement *r, int i) {
    const silt_mesh *mesh = r->mesh;
    double middle[3] = {0}, sum = 0, d[3], e[3];
    int n = 0;
    for (int k = r->facet_start[i]; k < r->facet_start[i + 1]; k++)
        for (int a = 0; a < r->dim; a++) {
            const int j = mesh->facet[r->facet[k]][a];
            if (j == i || mesh->facet_kind[r->facet[k]] != FACET_FREE)
                continue;
            refine_apart(r, i, r->nodes->x + r->dim * j, d);
            for (int c = 0; c < 3; c++)
                middle[c] += d[c];
            n++;
        }
    if (n < 2)
        return HUGE_VAL;
    for (int c = 0; c < 3; c++)
        middle[c] /= n;
    for (int k = r->facet_start[i]; k < r->facet_start[i + 1]; k++) {
        const int *facet = mesh->facet[r->facet[k]];
        if (mesh->facet_kind[r->facet[k]] != FACET_FREE)
            continue;
        const int at = facet[0] == i ? 0 : facet[1] == i ? 1 : 2, other = facet[(at + 1) % r->dim];
        refine_apart(r, i, r->nodes->x + r->dim * other, d);
        if (r->dim == 2) {
            sum += (at == 0 ? 0.5 : -0.5) * (d[0] * middle[1] - d[1] * middle[0]);
            continue;
        }
        refine_apart(r, i, r->nodes->x + 3 * facet[(at + 2) % 3], e);
        sum += (d[0] * (e[1] * middle[2] - e[2] * middle[1]) + d[1] * (e[2] * middle[0] - e[0] * middle[2]) +
                d[2] * (e[0] * middle[1] - e[1] * middle[0])) / 6;
    }
    return fabs(sum);
}

// how far the farthest node is that has to be joined to `stays` when `goes` leaves
static double refine_stretch(const refinement *r, int goes, int stays) {
    double most = 0;
    for (int k = r->mesh->neighbour_start[goes]; k < r->mesh->neighbour_start[goes + 1]; k++)
        if (r->mesh->neighbour[k] != goes)
            most = silt_max(most, refine_length(r, stays, r->mesh->neighbour[k]));
    return most;
}

static bool refine_on_wall(const refinement *r, int i) {
    return r->nodes->wall[i][0] >= 0 || r->nodes->kind[i] == NODE_CORNER;
}

// true when the edge spans a film of water from the wall to the surface
static bool refine_spans(const refinement *r, int i, int j) {
    const int foot = refine_on_wall(r, i) ? i : j, top = foot == i ? j : i;
    return r->dim == 2 && refine_on_wall(r, foot) && !refine_on_wall(r, top) && r->mesh->surface[top];
}

static void refine_crowded(refinement *r) {
    const silt_mesh *mesh = r->mesh;
    const bool periodic = mesh->period[0] > 0 || mesh->period[1] > 0 || mesh->period[2] > 0;
    r->n = 0;
    for (int i = 0; i < mesh->n_node; i++) {
        const double *p = r->nodes->x + r->dim * i;
        for (int k = mesh->neighbour_start[i]; k < mesh->neighbour_start[i + 1]; k++) {
            const int j = mesh->neighbour[k];
            if (j <= i)
                continue;
            // most edges are neither: no root for them
            const double *q = r->nodes->x + r->dim * j, h = refine_h(r, i, j);
            double square = silt_square(q[0] - p[0]) + silt_square(q[1] - p[1]);
            square += r->dim == 3 ? silt_square(q[2] - p[2]) : 0;
            if (!periodic && square > silt_square(1.001 * REFINE_CROWDED * h) && square < silt_square(0.999 * REFINE_CREASE * h))
                continue;
            const double ratio = refine_length(r, i, j) / h;
            if (ratio >= REFINE_CREASE)
                r->long_edge[i] = r->long_edge[j] = 1;
            if (ratio < REFINE_CROWDED && !r->locked[i] && !r->locked[j] && (ratio < REFINE_WEDGE || !refine_spans(r, i, j)))
                refine_propose(r, -ratio, i, j, -1);
        }
    }
    refine_sort(r);
    for (int c = 0; c < r->n; c++) {
        const int i = r->list[c].a, j = r->list[c].b;
        if (r->locked[i] || r->locked[j])
            continue;
        const int ri = refine_rank(r, i), rj = refine_rank(r, j);
        if (ri >= 8 && rj >= 8)
            continue;
        // the less dear one goes; of equals the one that changes least; of those the younger
        const bool both_surface = mesh->surface[i] && mesh->surface[j];
        int goes = ri < rj ? i : j;
        if (ri == rj) {
            const double ci = both_surface ? refine_shape(r, i) : refine_stretch(r, i, j);
            const double cj = both_surface ? refine_shape(r, j) : refine_stretch(r, j, i);
            goes = ci != cj ? (ci < cj ? i : j) : r->nodes->id[i] > r->nodes->id[j] ? i : j;
        }
        if (both_surface && -r->list[c].key >= REFINE_SURFACE &&
            refine_shape(r, goes) >= REFINE_SHAPE * pow(refine_h(r, i, j), r->dim))
            continue;
        refine_remove(r, goes);
    }
}

// the cell behind a boundary facet, and its node that the facet lacks
static int refine_behind(const refinement *r, int k, int *apex) {
    const int *facet = r->mesh->facet[k];
    for (int m = r->mesh->node_cell_start[facet[0]]; m < r->mesh->node_cell_start[facet[0] + 1]; m++) {
        const int *cell = r->mesh->cell[r->mesh->node_cell[m]];
        int found = 0;
        *apex = -1;
        for (int c = 0; c <= r->dim; c++) {
            bool in = false;
            for (int a = 0; a < r->dim; a++)
                in |= cell[c] == facet[a];
            found += in;
            *apex = in ? *apex : cell[c];
        }
        if (found == r->dim)
            return r->mesh->node_cell[m];
    }
    return -1;
}

// m or m2 of a facet
static double refine_facet_measure(const refinement *r, const int *facet) {
    double d[3], e[3];
    const double length = refine_apart(r, facet[0], r->nodes->x + r->dim * facet[1], d);
    if (r->dim == 2)
        return length;
    refine_apart(r, facet[0], r->nodes->x + 3 * facet[2], e);
    silt_cross(d, e, d);
    return 0.5 * silt_length(3, d);
}

// inner nodes pressed against a wall, the bed or a body, in space against the free surface
static void refine_flat(refinement *r) {
    r->n = 0;
    for (int k = 0; k < r->mesh->n_facet; k++) {
        const bool surface = r->mesh->facet_kind[k] == FACET_FREE;
        if ((surface && r->dim == 2) || r->mesh->facet_kind[k] == FACET_INLET)
            continue;
        int apex;
        const int e = refine_behind(r, k, &apex);
        if (e < 0 || r->locked[apex] || refine_rank(r, apex) != 0)
            continue;
        const int *facet = r->mesh->facet[k];
        const double height = r->dim * cell_measure(r->mesh, r->nodes->x, r->mesh->cell[e]) / refine_facet_measure(r, facet);
        const double ratio = height / silt_node_h(r->nodes, apex, r->h);
        if (ratio < (surface ? REFINE_UNDER : REFINE_FLAT))
            refine_propose(r, -ratio, apex, -1, e);
    }
    refine_sort(r);
    for (int c = 0; c < r->n; c++)
        if (!r->locked[r->list[c].a])
            refine_remove(r, r->list[c].a);
}

// A node that was put on a wall has pressed cells flat onto it, which the rebuild leaves out: an edge under them lies on the wall
// now. As one from within it would get a node without walls, and with it a hole in the wall's facets.
static bool refine_pressed(const refinement *r, const int *cell) {
    double corner[12];
    if (!r->walls)
        return false;
    silt_cell_corners(r->mesh, r->nodes->x, cell, corner);
    const silt_cell_shape shape = silt_cell_measure(r->dim, corner);
    return silt_cell_on_wall(r->mesh, r->nodes, cell, &shape, silt_cell_h(r->nodes, r->dim + 1, cell, r->h));
}

// cells around the edge a-b that are water still; *closed: no boundary facet has the edge
static int refine_around(const refinement *r, int a, int b, int room, int *around, bool *closed) {
    int n = 0, n_other = 0, other[64];
    *closed = true;
    for (int k = r->mesh->node_cell_start[a]; k < r->mesh->node_cell_start[a + 1] && n < room; k++) {
        const int *cell = r->mesh->cell[r->mesh->node_cell[k]];
        bool has = false;
        for (int c = 0; c <= r->dim; c++)
            has |= cell[c] == b;
        if (!has || refine_pressed(r, cell))
            continue;
        around[n++] = r->mesh->node_cell[k];
        for (int c = 0; c <= r->dim; c++) {
            int known = 0;
            while (known < n_other && other[known] != cell[c])
                known++;
            if (cell[c] != a && cell[c] != b && known == n_other && n_other < 64)
                other[n_other++] = cell[c];
        }
    }
    // a ring of tetrahedra has as many nodes as cells, a fan one more; an inner edge of the plane has two triangles
    *closed = r->dim == 3 ? n_other == n : n == 2;
    return n;
}

// true when a node with another owner than a wall (corner, bed, inlet) stands on the element's plane
static bool refine_stands_on(const refinement *r, int i, int element) {
    const silt_walls *walls = r->walls;
    if (r->nodes->kind[i] == NODE_FLUID || !walls || element >= walls->count)
        return false;
    const double *at = r->dim == 3 ? walls->corner[element][0] : walls->from[element], *n = walls->normal[element];
    double off = 0;
    for (int d = 0; d < r->dim; d++)
        off += (r->nodes->x[r->dim * i + d] - at[d]) * n[d];
    return fabs(off) < 1e-3 * r->h;
}

// Walls that both ends of an edge lie on. @return how many
static int refine_walls(const refinement *r, int a, int b, int wall[3]) {
    const silt_nodes *nodes = r->nodes;
    int n = 0;
    wall[0] = wall[1] = wall[2] = -1;
    for (int s = 0; s < 3; s++)
        for (int t = 0; t < 3 && nodes->wall[a][s] >= 0; t++) {
            const int w = nodes->wall[a][s], o = nodes->wall[b][t];
            const bool same = w == o || (o >= 0 && r->walls && w < r->walls->count && o < r->walls->count &&
                                         r->walls->patch[w] == r->walls->patch[o]);
            if (same && n < 3 && (n == 0 || wall[n - 1] != w))
                wall[n++] = w;
        }
    // an inlet's node or a corner has none of its own: all that it stands on, both of a crease
    const bool fixed = n == 0;
    for (int s = 0; s < 3 && fixed; s++)
        for (int end = 0; end < 2 && n < 3; end++) {
            const int w = nodes->wall[end ? b : a][s];
            if (w >= 0 && refine_stands_on(r, end ? a : b, w))
                wall[n++] = w;
        }
    return n;
}

// puts a point onto the walls that it shall lie on: the nearest element of the patch, then its plane
static void refine_onto(const refinement *r, int n, int wall[3], double *x) {
    const silt_walls *walls = r->walls;
    if (!walls || !walls->count)
        return;
    for (int s = 0; s < n; s++) {
        int element;
        silt_walls_distance(walls, x, &element);
        if (element >= 0 && n == 1 && walls->patch[element] == walls->patch[wall[s]])
            wall[s] = element;
    }
    // alternating projections; planes of a crease meet within a few
    for (int sweep = 0; sweep < (n > 1 ? 20 : 1); sweep++)
        for (int s = 0; s < n; s++) {
            const double *at = r->dim == 3 ? walls->corner[wall[s]][0] : walls->from[wall[s]], *normal = walls->normal[wall[s]];
            double off = 0;
            for (int d = 0; d < r->dim; d++)
                off += (x[d] - at[d]) * normal[d];
            for (int d = 0; d < r->dim && fabs(off) > 1e-12 * r->h; d++)
                x[d] -= off * normal[d];
        }
}

// True when no node, new ones included, is nearer to x than room; those less dear than rank may be as near as REFINE_MEET and
// leave afterwards, those across a wedge nearer. a and b: ends of the edge that x lies on, h: size there
static bool refine_has_room(const refinement *r, int a, int b, const double *x, double room, int rank, double h, bool wedge) {
    double d[3];
    const bool on = refine_on_wall(r, a);
    for (int end = 0; end < 2; end++) {
        const int i = end ? b : a;
        for (int k = r->mesh->neighbour_start[i]; k < r->mesh->neighbour_start[i + 1]; k++) {
            const int j = r->mesh->neighbour[k];
            if (wedge && refine_on_wall(r, j) != on)
                continue;
            if (j != a && j != b && !r->memory->dead[j] &&
                refine_apart(r, j, x, d) < (refine_rank(r, j) < rank ? REFINE_MEET * h : room))
                return false;
            for (int m = r->fresh[j]; m >= 0; m = r->fresh_next[m])
                if (refine_apart(r, r->fresh_node[m], x, d) < room)
                    return false;
        }
    }
    return true;
}

// true for an edge along a wedge of water on a wall: of the wall's side or of the surface
static bool refine_along_wedge(const refinement *r, int a, int b) {
    int wall[3];
    const bool both = r->mesh->surface[a] && r->mesh->surface[b];
    return r->dim == 2 && (both || refine_walls(r, a, b, wall) > 0);
}

// way from node a to the node before it on the free surface, seen from b. @return its length, 0: there is none
static double refine_before(const refinement *r, int a, int b, int *node, double way[3]) {
    int before = -1;
    for (int k = r->facet_start[a]; k < r->facet_start[a + 1]; k++) {
        const int *facet = r->mesh->facet[r->facet[k]], j = facet[0] == a ? facet[1] : facet[0];
        if (r->mesh->facet_kind[r->facet[k]] != FACET_FREE || (j != b && before >= 0))
            return 0;
        before = j != b ? j : before;
    }
    if (before < 0)
        return 0;
    refine_apart(r, a, r->nodes->x + 2 * before, way);
    *node = before;
    return hypot(way[0], way[1]);
}

// A node that comes on the free surface, in 2-D, lies on the cubic through the edge's ends and their neighbours. On the chord it
// would be a dent, and a surface that is accelerated towards the water tears open from dents. Its velocity likewise: more is what
// it has beyond that of the edge.
static void refine_bend(const refinement *r, int a, int b, double share, double x[3], double more[3]) {
    double d[3], u[3], w[3];
    int p = -1, q = -1;
    refine_apart(r, a, r->nodes->x + 2 * b, d);
    const double length = hypot(d[0], d[1]), before = refine_before(r, a, b, &p, u), after = refine_before(r, b, a, &q, w);
    if (before < 0.2 * length || after < 0.2 * length || u[0] * d[0] + u[1] * d[1] > -REFINE_SMOOTH * before * length ||
        w[0] * d[0] + w[1] * d[1] < REFINE_SMOOTH * after * length)
        return;
    // heights of the neighbours over the chord; their shares by Lagrange in the length along the four points
    const double n[2] = {-d[1] / length, d[0] / length}, t = share * length, end = length + after;
    const double first = t * (t - length) * (t - end) / (-before * (before + length) * (before + end));
    const double last = (t + before) * t * (t - length) / ((end + before) * end * after);
    const double height = first * (u[0] * n[0] + u[1] * n[1]) + last * (w[0] * n[0] + w[1] * n[1]);
    const double off = silt_clamp(height, -0.15 * length, 0.15 * length), *v = r->nodes->v;
    for (int c = 0; c < 2; c++) {
        const double slope = (v[2 * b + c] - v[2 * a + c]) / length;
        more[c] = first * (v[2 * p + c] - v[2 * a + c] + slope * before) + last * (v[2 * q + c] - v[2 * b + c] - slope * after);
    }
    x[0] += off * n[0];
    x[1] += off * n[1];
}

static void refine_insert(refinement *r, int a, int b, double share, bool closed, const int *around, int n_around) {
    silt_nodes *nodes = r->nodes;
    const int dim = r->dim;
    double d[3], x[3] = {0}, more[3] = {0};
    int wall[3];
    refine_apart(r, a, nodes->x + dim * b, d);
    for (int c = 0; c < dim; c++)
        x[c] = nodes->x[dim * a + c] + share * d[c];
    // on a wall only along its surface, not on edges that bridge the water in a corner
    const int n_wall = closed ? 0 : refine_walls(r, a, b, wall);
    if (n_wall)
        refine_onto(r, n_wall, wall, x);
    else if (dim == 2 && !closed)
        refine_bend(r, a, b, share, x, more);
    const double h = refine_h(r, a, b);
    const bool surface = !closed && r->mesh->surface[a] && r->mesh->surface[b], wedge = !closed && refine_along_wedge(r, a, b);
    const int rank = (n_wall >= 2 ? 4 : n_wall) + (surface ? 2 : 0);
    int element;
    if (wedge && !n_wall && r->walls && silt_walls_distance(r->walls, x, &element) < REFINE_FRESH * h)
        return;
    if (!refine_has_room(r, a, b, x, (closed ? REFINE_ROOM : refine_rim[dim]) * h, rank, h, wedge))
        return;
    const bool open = !closed && nodes->kind[a] == NODE_OPEN && nodes->kind[b] == NODE_OPEN && nodes->owner[a] == nodes->owner[b];
    const int i = silt_nodes_add(nodes, open ? NODE_OPEN : NODE_FLUID, open ? nodes->owner[a] : -1, x);
    for (int c = 0; c < dim; c++)
        nodes->v[dim * i + c] = (1 - share) * nodes->v[dim * a + c] + share * nodes->v[dim * b + c] + more[c];
    nodes->p[i] = (1 - share) * nodes->p[a] + share * nodes->p[b];
    if (nodes->eddy)
        nodes->eddy[i] = (1 - share) * nodes->eddy[a] + share * nodes->eddy[b];
    if (nodes->h)
        nodes->h[i] = (1 - share) * silt_node_h(nodes, a, r->h) + share * silt_node_h(nodes, b, r->h);
    for (int s = 0; s < n_wall; s++)
        nodes->wall[i][s] = wall[s];
    silt_memory_extend(r->memory, nodes->count);
    // on a wall in space the edge's ends say it: nothing is free around it. Stretched cells on walls would go otherwise, and leave
    // dents
    r->memory->interior[i] = closed || (dim == 3 && (n_wall || open) && r->memory->interior[a] && r->memory->interior[b]);
    for (int k = 0; k < n_around; k++)
        for (int c = 0; c <= dim; c++) {
            const int j = r->mesh->cell[around[k]][c];
            SILT_RESERVE(r->fresh_next, r->fresh_next_capacity, r->n_fresh + 1);
            SILT_RESERVE(r->fresh_node, r->fresh_node_capacity, r->n_fresh + 1);
            r->fresh_next[r->n_fresh] = r->fresh[j];
            r->fresh_node[r->n_fresh] = i;
            r->fresh[j] = r->n_fresh++;
        }
}

// the longest edge of n nodes, as multiple of the size
static double refine_longest(const refinement *r, int n, const int *node, int edge[2]) {
    double most = 0;
    for (int s = 0; s < n; s++)
        for (int t = s + 1; t < n; t++) {
            const double ratio = refine_length(r, node[s], node[t]) / refine_h(r, node[s], node[t]);
            if (ratio > most) {
                most = ratio;
                edge[0] = node[s] < node[t] ? node[s] : node[t];
                edge[1] = node[s] < node[t] ? node[t] : node[s];
            }
        }
    return most;
}

// true for an edge along a crease of the walls or along the line where the surface meets them
static bool refine_crease(const refinement *r, int a, int b) {
    int wall[3];
    if (r->nodes->wall[a][0] < 0 || r->nodes->wall[b][0] < 0)
        return false;
    const int n = refine_walls(r, a, b, wall);
    return n >= 2 || (n == 1 && r->mesh->surface[a] && r->mesh->surface[b]);
}

// Edges that are too long: each cell's longest; in space also each boundary facet's longest and those along creases, which
// the diagonals of cells and facets would always outrun.
static void refine_propose_long(refinement *r) {
    const uint8_t *surface = r->mesh->surface;
    int edge[2] = {0, 0};
    r->n = 0;
    for (int e = 0; e < r->mesh->n_cell; e++) {
        int ends = 0;
        for (int a = 0; a <= r->dim; a++)
            ends += r->long_edge[r->mesh->cell[e][a]];
        if (ends < 2)
            continue;
        const double most = refine_longest(r, r->dim + 1, r->mesh->cell[e], edge);
        if (most >= (surface[edge[0]] && surface[edge[1]] ? refine_taut[r->dim] : refine_slack[r->dim]))
            refine_propose(r, most, edge[0], edge[1], -1);
    }
    for (int k = 0; k < r->mesh->n_facet && r->dim == 3; k++) {
        const int *facet = r->mesh->facet[k];
        if (r->long_edge[facet[0]] + r->long_edge[facet[1]] + r->long_edge[facet[2]] < 2)
            continue;
        const double most = refine_longest(r, 3, facet, edge);
        if (most < REFINE_CREASE)
            continue;
        if (most >= refine_taut[3])
            refine_propose(r, most, edge[0], edge[1], -1);
        for (int a = 0; a < 3; a++) {
            const int pair[2] = {facet[a], facet[(a + 1) % 3]};
            const double ratio = refine_longest(r, 2, pair, edge);
            if (ratio >= REFINE_CREASE && (ratio < most || most < refine_taut[3]) && refine_crease(r, pair[0], pair[1]))
                refine_propose(r, ratio, edge[0], edge[1], -1);
        }
    }
    refine_sort(r);
}

// Thin cells at the free surface: they break rather than fill with nodes. In space the wedges along creases are as thin, but
// belong to the inside.
static bool refine_is_film(const refinement *r, const int *cell, double h) {
    bool surface = r->dim == 2;
    for (int a = 0; a <= r->dim; a++) {
        const int i = cell[a];
        surface |= r->mesh->surface[i];
        if (r->dim == 3 && !r->mesh->surface[i] && r->nodes->kind[i] == NODE_FLUID && r->nodes->wall[i][0] < 0)
            return false;
    }
    return surface && cell_measure(r->mesh, r->nodes->x, cell) < refine_film[r->dim] * pow(h, r->dim);
}

static void refine_stretched(refinement *r) {
    const silt_nodes *nodes = r->nodes;
    const int dim = r->dim;
    refine_propose_long(r);
    r->fresh = silt_borrow((size_t)r->mesh->n_node + 1, sizeof *r->fresh);
    for (int i = 0; i < r->mesh->n_node; i++)
        r->fresh[i] = -1;
    for (int c = 0; c < r->n; c++) {
        const int a = r->list[c].a, b = r->list[c].b;
        if (c && r->list[c - 1].a == a && r->list[c - 1].b == b)
            continue;
        // bed, bodies and inlets keep their own nodes; openings with a level do not
        if (nodes->kind[a] != NODE_FLUID && nodes->kind[a] != NODE_OPEN && nodes->kind[a] == nodes->kind[b])
            continue;
        int around[64];
        bool closed, locked = false;
        bool film = true;
        const int n_around = refine_around(r, a, b, 64, around, &closed);
        for (int k = 0; k < n_around; k++) {
            film &= refine_is_film(r, r->mesh->cell[around[k]], refine_h(r, a, b));
            for (int s = 0; s <= dim; s++)
                locked |= r->locked[r->mesh->cell[around[k]][s]];
        }
        bool wedge = false;
        for (int k = 0; k < n_around && film; k++)
            for (int s = 0; s <= dim && dim == 2; s++)
                wedge |= refine_on_wall(r, r->mesh->cell[around[k]][s]);
        if (locked || (film && !(wedge && refine_along_wedge(r, a, b))))
            continue;
        const int pieces = (int)silt_clamp(floor(r->list[c].key + 0.5), 2, REFINE_PIECES);
        for (int m = 1; m < pieces; m++)
            refine_insert(r, a, b, (double)m / pieces, closed, around, n_around);
    }
    silt_return(r->fresh);
    free(r->fresh_next);
    free(r->fresh_node);
}

void silt_mesh_refine(const silt_mesh *mesh, silt_nodes *nodes, silt_memory *memory, double h) {
    refinement r = {.mesh = mesh, .nodes = nodes, .memory = memory, .walls = mesh->walls, .dim = silt_nodes_dim(nodes), .h = h};
    r.locked = silt_borrow((size_t)mesh->n_node + 1, 1);
    r.long_edge = silt_borrow((size_t)mesh->n_node + 1, 1);
    for (int i = 0; i < mesh->n_node; i++)
        r.locked[i] = memory->dead[i];
    refine_facets(&r);
    refine_crowded(&r);
    refine_flat(&r);
    refine_stretched(&r);
    silt_return(r.facet_start);
    silt_return(r.facet);
    free(r.list);
    silt_return(r.locked);
    silt_return(r.long_edge);
}

// ---- a test of remeshing

// gradient of field number `of` at a node: the mean over its cells by volume; values holds `width` numbers per node
static void shuffle_gradient(const silt_mesh *mesh, int dim, const double *x, int i, int width, const double *const *value,
                             double gradient[4][3]) {
    double total = 0;
    memset(gradient, 0, 4 * sizeof *gradient);
    for (int k = mesh->node_cell_start[i]; k < mesh->node_cell_start[i + 1]; k++) {
        const int *cell = mesh->cell[mesh->node_cell[k]];
        double c[12], g[4][3] = {{0}};
        silt_cell_corners(mesh, x, cell, c);
        const double volume = cell_measure(mesh, x, cell), part = dim == 3 ? 6 : 2;
        // volume times the gradient of each corner's shape function
        for (int a = 0; a <= dim; a++) {
            const double *p = c + dim * ((a + 1) % (dim + 1)), *q = c + dim * ((a + 2) % (dim + 1));
            if (dim == 2) {
                g[a][0] = (p[1] - q[1]) / part;
                g[a][1] = (q[0] - p[0]) / part;
                continue;
            }
            const double *s = c + 3 * ((a + 3) % 4), sign = a % 2 ? 1 : -1;
            double u[3], w[3];
            for (int d = 0; d < 3; d++) {
                u[d] = q[d] - p[d];
                w[d] = s[d] - p[d];
            }
            for (int d = 0; d < 3; d++)
                g[a][d] = sign * (u[(d + 1) % 3] * w[(d + 2) % 3] - u[(d + 2) % 3] * w[(d + 1) % 3]) / part;
        }
        for (int f = 0; f < width; f++)
            for (int a = 0; a <= dim; a++)
                for (int d = 0; d < dim; d++)
                    gradient[f][d] += g[a][d] * (f ? value[1][dim * cell[a] + f - 1] : value[0][cell[a]]);
        total += volume;
    }
    for (int f = 0; f < width; f++)
        for (int d = 0; d < dim; d++)
            gradient[f][d] /= total;
}

// smallest ratio of a cell's volume with node i at `to` to what it was
static double shuffle_squeeze(const silt_mesh *mesh, int dim, const double *x, int i, const double *step) {
    double least = 1;
    for (int k = mesh->node_cell_start[i]; k < mesh->node_cell_start[i + 1]; k++) {
        const int *cell = mesh->cell[mesh->node_cell[k]];
        static const int plain[4] = {0, 1, 2, 3};
        const silt_mesh alone = {.dim = dim};
        double c[12];
        silt_cell_corners(mesh, x, cell, c);
        const double before = cell_measure(&alone, c, plain);
        for (int a = 0; a <= dim; a++)
            for (int d = 0; d < dim && cell[a] == i; d++)
                c[dim * a + d] += step[d];
        least = silt_min(least, cell_measure(&alone, c, plain) / before);
    }
    return least;
}

void silt_nodes_shuffle(silt_nodes *nodes, const silt_mesh *mesh, const silt_scene *scene, int64_t step) {
    const int dim = silt_nodes_dim(nodes), n = nodes->count;
    if (scene->fluid.shuffle <= 0)
        return;
    double *shift = silt_alloc((size_t)(3 * n) + 1, sizeof *shift), *change = silt_alloc((size_t)(4 * n) + 1, sizeof *change);
    const double *const value[2] = {nodes->p, nodes->v}, *const eddy[1] = {nodes->eddy};
    double *more = nodes->eddy ? silt_alloc((size_t)n + 1, sizeof *more) : NULL;
    for (int i = 0; i < n; i++) {
        if (i >= mesh->n_node || !mesh->wet[i] || mesh->surface[i] || nodes->kind[i] != NODE_FLUID || nodes->wall[i][0] >= 0)
            continue;
        uint64_t random = silt_hash(0, &scene->fluid.seed, sizeof scene->fluid.seed);
        random = silt_hash(silt_hash(random, &step, sizeof step), &nodes->id[i], sizeof nodes->id[i]);
        for (int d = 0; d < dim; d++)
            shift[3 * i + d] = scene->fluid.shuffle * silt_node_h(nodes, i, scene->fluid.size) * (2 * silt_uniform(&random) - 1);
        // no cell may be crushed
        for (int tries = 0; tries < 8 && shuffle_squeeze(mesh, dim, nodes->x, i, shift + 3 * i) < 0.3; tries++)
            for (int d = 0; d < dim; d++)
                shift[3 * i + d] *= 0.5;
        double gradient[4][3];
        shuffle_gradient(mesh, dim, nodes->x, i, dim + 1, value, gradient);
        for (int f = 0; f <= dim; f++)
            for (int d = 0; d < dim; d++)
                change[4 * i + f] += gradient[f][d] * shift[3 * i + d];
        if (!more)
            continue;
        shuffle_gradient(mesh, dim, nodes->x, i, 1, eddy, gradient);
        for (int d = 0; d < dim; d++)
            more[i] += gradient[0][d] * shift[3 * i + d];
    }
    for (int i = 0; i < n; i++) {
        nodes->p[i] += change[4 * i];
        if (more)
            nodes->eddy[i] = silt_max(nodes->eddy[i] + more[i], 0);
        for (int d = 0; d < dim; d++) {
            nodes->x[dim * i + d] += shift[3 * i + d];
            nodes->v[dim * i + d] += change[4 * i + 1 + d];
        }
    }
    free(shift);
    free(change);
    free(more);
}
