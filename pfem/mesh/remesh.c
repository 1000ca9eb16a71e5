// decides what is water: Delaunay of the cloud, held against what was water a step ago; books the volume that this
// makes or loses
#include "delaunay.h"
#include "parallel.h"
#include "remesh.h"
#include "solid.h"

static const double cloud_parts = 17592186044416.0; // 2^44, of a period
#define WEDGE_LONG 3.5 // times h: longest edge of a cell in a wedge on a wall

static bool polygon_contains(int n, const double *p, double x, double y) {
    bool in = false;
    for (int k = 0, m = n - 1; k < n; m = k++)
        if ((p[2 * k + 1] > y) != (p[2 * m + 1] > y) &&
            x < (p[2 * m] - p[2 * k]) * (y - p[2 * k + 1]) / (p[2 * m + 1] - p[2 * k + 1]) + p[2 * k])
            in = !in;
    return in;
}

bool silt_barrier_contains(const silt_barrier *barrier, const double *point) {
    int segment;
    if (barrier->walls && barrier->walls->count && silt_walls_distance(barrier->walls, point, &segment) < 0)
        return true;
    if (barrier->bed && silt_bed_contains(barrier->bed, point))
        return true;
    for (int b = 0; barrier->bodies && b < barrier->bodies->count; b++) {
        const struct silt_body *body = &barrier->bodies->body[b];
        if (body->solid) {
            double local[3] = {point[0] - body->x[0], point[1] - body->x[1], point[2] - body->x[2]};
            if (silt_dot(3, local, local) > silt_square(body->solid->radius))
                continue;
            silt_turn(body->q, true, local, local);
            if (silt_solid_contains(body->solid, local))
                return true;
            continue;
        }
        // into the body's frame: turned back about z
        const double c = 1 - 2 * body->q[3] * body->q[3], s = 2 * body->q[0] * body->q[3];
        const double dx = point[0] - body->x[0], dy = point[1] - body->x[1];
        if (polygon_contains(body->n_point, body->point, c * dx + s * dy, -s * dx + c * dy))
            return true;
    }
    return false;
}

// ---- a set of cells by their nodes: sorted by the highest one, which keeps neighbours together in memory

// nodes from the highest to the lowest
static void cell_key(const int cell[4], int key[4]) {
    uint32_t node[4];
    silt_cell_sort(cell, node);
    const bool solid = cell[3] >= 0;
    key[0] = (int)(node[solid ? 3 : 2] >> 2);
    key[1] = (int)(node[solid ? 2 : 1] >> 2);
    key[2] = (int)(node[solid ? 1 : 0] >> 2);
    key[3] = solid ? (int)(node[0] >> 2) : -1;
}

void silt_cell_set_create(silt_cell_set *set, int n_node, int n, const int (*cell)[4]) {
    silt_bins bins = silt_bins_create(n_node, n);
    set->n_node = n_node;
    set->item = silt_borrow((size_t)n + 1, sizeof *set->item);
    for (int pass = 0; pass < 2; pass++) {
        SILT_PRAGMA(omp parallel for schedule(static) num_threads(bins.n_part))
        for (int part = 0; part < bins.n_part; part++)
            for (int e = silt_bins_first(&bins, part), last = silt_bins_first(&bins, part + 1); e < last; e++) {
                int key[4];
                cell_key(cell[e], key);
                const int at = bins.at[(size_t)part * (size_t)n_node + (size_t)key[0]]++;
                if (pass)
                    set->item[at] = (struct silt_cell_item){{key[1], key[2], key[3]}, e};
            }
        if (pass == 0)
            silt_bins_place(&bins);
    }
    set->start = bins.start;
    bins.start = NULL;
    silt_bins_clear(&bins);
}

int silt_cell_set_find(const silt_cell_set *set, const int cell[4]) {
    int key[4];
    cell_key(cell, key);
    if (key[0] >= set->n_node)
        return -1;
    for (int k = set->start[key[0]]; k < set->start[key[0] + 1]; k++) {
        const int *other = set->item[k].node;
        if (other[0] == key[1] && other[1] == key[2] && other[2] == key[3])
            return set->item[k].cell;
    }
    return -1;
}

void silt_cell_set_clear(silt_cell_set *set) {
    silt_return(set->item);
    silt_return(set->start);
    *set = (silt_cell_set){0};
}

// ---- what a cell of the cloud is

bool silt_cell_on_wall(const silt_mesh *mesh, const silt_nodes *nodes, const int *cell, const silt_cell_shape *shape, double h) {
    if (shape->height >= CELL_FLAT * h)
        return false;
    if (silt_mesh_share(mesh, nodes, mesh->dim + 1, cell))
        return true;
    int n_body = 0; // in space also all on one body
    for (int a = 0; a < 4 && mesh->dim == 3; a++)
        n_body += nodes->kind[cell[a]] == NODE_BODY && nodes->owner[cell[a]] == nodes->owner[cell[0]];
    if (n_body == 4)
        return true;
    // in space also between nodes of an opening or of the bed, and of the wall around it
    bool opening = false, free_facet = false;
    for (int a = 0; a < 4 && mesh->dim == 3; a++)
        opening |= nodes->kind[cell[a]] == NODE_INLET || nodes->kind[cell[a]] == NODE_OPEN || nodes->kind[cell[a]] == NODE_BED;
    for (int a = 0; a < 4 && opening && !free_facet; a++) {
        int facet[3];
        silt_cell_facet(3, cell, a, facet);
        free_facet = silt_facet_kind_of(mesh, nodes, facet) == FACET_FREE;
    }
    return opening && !free_facet;
}

static int cell_count_free(const silt_nodes *nodes, int n_corner, const int *cell) {
    int n = 0;
    for (int a = 0; a < n_corner; a++)
        n += nodes->kind[cell[a]] == NODE_FLUID && nodes->wall[cell[a]][0] < 0;
    return n;
}

static bool were_joined(const silt_mesh *mesh, int i, int j) {
    if (i >= mesh->n_node || j >= mesh->n_node)
        return false;
    for (int k = mesh->neighbour_start[i]; k < mesh->neighbour_start[i + 1]; k++)
        if (mesh->neighbour[k] == j)
            return true;
    return false;
}

// How wide a gap a tetrahedron spans: a flat one may lie across a wide gap, so what counts is how far those of its
// corners are apart that no edge of the water joins. `mesh` still has the adjacency of the old cells, `rim` the old
// boundary's facets.
static double gap_width(const silt_mesh *mesh, const silt_cell_set *rim, const int *cell, const double *corner,
                        const silt_cell_shape *shape) {
    int group[4] = {0, 1, 2, 3}, n_group = 4, size[4] = {0};
    double length[4][4];
    for (int a = 0; a < 4; a++)
        for (int b = 0; b < a; b++) {
            double square = 0;
            for (int d = 0; d < 3; d++)
                square += silt_square(corner[3 * a + d] - corner[3 * b + d]);
            length[a][b] = length[b][a] = sqrt(square);
            if (group[a] != group[b] && were_joined(mesh, cell[a], cell[b])) {
                const int from = group[a], to = group[b];
                for (int c = 0; c < 4; c++)
                    group[c] = group[c] == from ? to : group[c];
                n_group--;
            }
        }
    for (int a = 0; a < 4; a++)
        size[group[a]]++;
    if (n_group == 1) {
        // a fold or a pit of one surface: two of its facets at least are the surface
        int n_rim = 0;
        for (int a = 0; a < 4; a++) {
            int facet[4];
            silt_cell_facet(3, cell, a, facet);
            facet[3] = -1;
            n_rim += silt_cell_set_find(rim, facet) >= 0;
        }
        return n_rim >= 2 ? shape->height : HUGE_VAL;
    }
    for (int a = 0; a < 4 && n_group == 2; a++)
        if (size[group[a]] == 1) { // a node before a facet
            const double *p = corner + 3 * ((a + 1) % 4), *q = corner + 3 * ((a + 2) % 4),
                         *r = corner + 3 * ((a + 3) % 4);
            double square = 0;
            for (int d = 0; d < 3; d++) {
                const int m = (d + 1) % 3, n = (d + 2) % 3;
                square += silt_square((q[m] - p[m]) * (r[n] - p[n]) - (q[n] - p[n]) * (r[m] - p[m]));
            }
            return 6 * shape->volume / sqrt(square);
        }
    if (n_group == 2) { // an edge before an edge, 0 and b before c and d
        const int b = group[1] == group[0] ? 1 : group[2] == group[0] ? 2 : 3, c = b == 1 ? 2 : 1, d = 6 - b - c;
        double u[3], v[3], w[3], n[3], uv = 0, nn = 0;
        for (int k = 0; k < 3; k++) {
            u[k] = (corner[3 * b + k] - corner[k]) / length[0][b];
            v[k] = (corner[3 * d + k] - corner[3 * c + k]) / length[c][d];
            w[k] = 0.5 * (corner[3 * c + k] + corner[3 * d + k] - corner[3 * b + k] - corner[k]);
            uv += u[k] * v[k];
        }
        for (int k = 0; k < 3; k++) {
            n[k] = u[(k + 1) % 3] * v[(k + 2) % 3] - u[(k + 2) % 3] * v[(k + 1) % 3];
            nn += n[k] * n[k];
        }
        double along = 0, wn = 0, ww = 0, mean = 0;
        for (int k = 0; k < 3; k++) {
            const double m = u[k] + (uv < 0 ? -v[k] : v[k]);
            wn += w[k] * n[k];
            ww += w[k] * w[k];
            along += w[k] * m;
            mean += m * m;
        }
        // crossing edges are as far apart as their lines, parallel ones as their middles across them
        return nn > 0.1 ? fabs(wn) / sqrt(nn) : sqrt(silt_max(0, ww - along * along / mean));
    }
    // single nodes: the longest of the shortest links between them
    double widest = 0;
    bool reached[4] = {true, false, false, false};
    for (int step = 0; step < 3; step++) {
        int next = -1;
        double shortest = HUGE_VAL;
        for (int a = 0; a < 4; a++)
            for (int b = 0; b < 4 && reached[a]; b++)
                if (!reached[b] && (group[a] == group[b] ? 0 : length[a][b]) < shortest) {
                    shortest = group[a] == group[b] ? 0 : length[a][b];
                    next = b;
                }
        if (next < 0) // lengths that are no numbers
            return HUGE_VAL;
        reached[next] = true;
        widest = silt_max(widest, shortest);
    }
    return widest;
}

// a gap that is nearly shut and still closing joins; the water in it is no more than the gap was wide
static bool cell_closes(const silt_mesh *mesh, const silt_nodes *nodes, const silt_cell_set *rim, const int *cell,
                        const double *corner, const silt_cell_shape *shape, double gap) {
    if (shape->height >= gap || (mesh->dim == 3 && gap_width(mesh, rim, cell, corner, shape) >= gap))
        return false;
    // dim! times the volume changes with the velocity of every node across the facet opposite it
    double rate = 0;
    for (int a = 0; a <= mesh->dim; a++) {
        const double *v = nodes->v + mesh->dim * cell[a];
        if (mesh->dim == 2) {
            const double *p = corner + 2 * ((a + 1) % 3), *q = corner + 2 * ((a + 2) % 3);
            rate += v[0] * (p[1] - q[1]) + v[1] * (q[0] - p[0]);
            continue;
        }
        static const int local[4] = {0, 1, 2, 3};
        int side[3];
        silt_cell_facet(3, local, a, side);
        const double *p = corner + 3 * side[0], *q = corner + 3 * side[1], *r = corner + 3 * side[2];
        for (int d = 0; d < 3; d++) {
            const int m = (d + 1) % 3, n = (d + 2) % 3;
            rate -= v[d] * ((q[m] - p[m]) * (r[n] - p[n]) - (q[n] - p[n]) * (r[m] - p[m]));
        }
    }
    return rate < 0;
}

// Radius of the smallest sphere around a tetrahedron. Between the surface and a node close under it lie cells as flat as caps,
// whose circumscribed sphere may be large though no node is far from another: the water does not part there.
static double enclosing_radius(const double *c) {
    double best = HUGE_VAL;
    for (int a = 0; a < 4; a++)
        for (int b = 0; b < a; b++) {
            double middle[3], square = 0;
            bool in = true;
            for (int d = 0; d < 3; d++) {
                middle[d] = 0.5 * (c[3 * a + d] + c[3 * b + d]);
                square += 0.25 * silt_square(c[3 * a + d] - c[3 * b + d]);
            }
            for (int k = 0; k < 4; k++) {
                double off = 0;
                for (int d = 0; d < 3; d++)
                    off += silt_square(c[3 * k + d] - middle[d]);
                in &= off <= square * (1 + 1e-12);
            }
            best = in ? silt_min(best, square) : best;
        }
    const bool edge = best < HUGE_VAL;
    for (int a = 0; a < 4 && !edge; a++) {
        const double *p = c + 3 * ((a + 1) % 4), *q = c + 3 * ((a + 2) % 4), *r = c + 3 * ((a + 3) % 4);
        double u[3], v[3], uu = 0, vv = 0, uv = 0, off = 0, square = 0;
        for (int d = 0; d < 3; d++) {
            u[d] = q[d] - p[d];
            v[d] = r[d] - p[d];
            uu += u[d] * u[d];
            vv += v[d] * v[d];
            uv += u[d] * v[d];
        }
        const double under = 2 * (uu * vv - uv * uv);
        for (int d = 0; d < 3; d++) {
            const double centre = p[d] + (vv * (uu - uv) * u[d] + uu * (vv - uv) * v[d]) / under;
            square += silt_square(p[d] - centre);
            off += silt_square(c[3 * a + d] - centre);
        }
        best = off <= square ? silt_min(best, square) : best;
    }
    return sqrt(best);
}

// a cell's middle, within the period
static void cell_centre(const silt_mesh *mesh, const silt_scene *scene, const double *corner, double centre[3]) {
    memset(centre, 0, 3 * sizeof *centre);
    for (int a = 0; a <= mesh->dim; a++)
        for (int d = 0; d < mesh->dim; d++)
            centre[d] += corner[mesh->dim * a + d] / (mesh->dim + 1);
    if (mesh->period[0] > 0)
        centre[0] -= mesh->period[0] * floor((centre[0] - scene->period[0]) / mesh->period[0]);
}

static bool cell_behind(const silt_mesh *mesh, const silt_nodes *nodes, const silt_barrier *barrier, const int *cell,
                        const double centre[3]) {
    // only an edge between two fixed nodes can cut through something solid
    return cell_count_free(nodes, mesh->dim + 1, cell) < mesh->dim && silt_barrier_contains(barrier, centre);
}

// ---- the cloud's triangulation

static void mesh_prepare(silt_mesh *mesh, const silt_nodes *nodes, const silt_scene *scene,
                         const silt_barrier *barrier) {
    mesh->dim = silt_nodes_dim(nodes);
    mesh->walls = barrier->walls;
    mesh->period[0] = silt_max(0, scene->period[1] - scene->period[0]);
    mesh->period[1] = mesh->period[2] = 0;
}

// A shallow dent of the surface, in 2-D, is no wedge of water on a wall: its node stays on the surface. Covered by a flat cell it would
// count as one from within.
static bool cell_is_dent(const silt_mesh *mesh, const int *cell, const double *corner) {
    for (int a = 0; a < 3 && mesh->dim == 2; a++) {
        const int b = (a + 1) % 3, c = (a + 2) % 3;
        double u[2], w[2];
        for (int d = 0; d < 2; d++) {
            u[d] = corner[2 * b + d] - corner[2 * a + d];
            w[d] = corner[2 * c + d] - corner[2 * a + d];
        }
        // flatter than 120 degrees
        if (silt_dot(2, u, w) < -0.5 * silt_length(2, u) * silt_length(2, w))
            return were_joined(mesh, cell[a], cell[b]) && were_joined(mesh, cell[a], cell[c]) && !were_joined(mesh, cell[b], cell[c]);
    }
    return false;
}

// Across a dented surface the cloud's hull has flat cells of any length. Where x is periodic such cells are not the same at both ends, and one
// of half the period has no nearest copy: none is water.
static bool cell_straddles(const silt_mesh *mesh, const double *corner, double bound) {
    return mesh->dim == 3 && mesh->period[0] > 0 && !(enclosing_radius(corner) < 1.5 * bound);
}

// in whole parts of the period, see cloud_points
static bool cell_too_long(int n_corner, const int *cell, const double *x, double period) {
    double low = HUGE_VAL, high = -HUGE_VAL;
    for (int a = 0; a < n_corner; a++) {
        low = silt_min(low, x[(n_corner - 1) * cell[a]]);
        high = silt_max(high, x[(n_corner - 1) * cell[a]]);
    }
    return high - low >= 0.5 * period;
}

// The live nodes; where x is periodic, nodes nearer to its ends than `margin` are put beyond the other end too. Coordinates are
// whole parts of the period then: both copies of a cell have the same numbers but for a whole shift, so that ties are broken alike.
// @param live  out, owned by the caller, the points' nodes, *n_live that are no copies first  @return how many points
static int cloud_points(const silt_mesh *mesh, const silt_nodes *nodes, const silt_scene *scene, const uint8_t *dead,
                        double margin, int **live, double **x, int *n_live) {
    const int n = nodes->count, dim = mesh->dim;
    const double period = mesh->period[0], parts = cloud_parts, scale = period > 0 ? parts / period : 1;
    int m = 0, room = 0, x_room = 0;
    SILT_RESERVE(*live, room, n + 1);
    SILT_RESERVE(*x, x_room, dim * n + 1);
    for (int i = 0; i < n; i++)
        if (!dead || !dead[i]) {
            (*live)[m] = i;
            for (int d = 0; d < dim; d++)
                (*x)[dim * m + d] = scale * nodes->x[dim * i + d];
            if (period > 0) {
                const double at = floor((nodes->x[dim * i] - scene->period[0]) / period * parts + 0.5);
                (*x)[dim * m] = at - parts * floor(at / parts);
            }
            m++;
        }
    *n_live = m;
    for (int k = 0; period > 0 && k < *n_live; k++)
        for (int side = -1; side <= 1; side += 2) {
            const double at = (*x)[dim * k];
            if (side > 0 ? at > margin * scale : at < parts - margin * scale)
                continue;
            SILT_RESERVE(*live, room, m + 1);
            SILT_RESERVE(*x, x_room, dim * (m + 1));
            (*live)[m] = (*live)[k];
            memcpy(*x + dim * m, *x + dim * k, (size_t)dim * sizeof **x);
            (*x)[dim * m++] = at + side * parts;
        }
    return m;
}

// Cells of the live nodes, sorted. In the plane they follow from those of the rebuild before (memory: NULL, of none); of the
// copies of a cell in a periodic cloud the one is kept in which its lowest node is no copy.
static silt_status cloud_cells(const silt_mesh *mesh, const silt_nodes *nodes, const silt_scene *scene,
                               silt_memory *memory, double margin, int (**cells)[4], int *n_cell, silt_error *err) {
    const int dim = mesh->dim, n_corner = dim + 1;
    const uint8_t *dead = memory ? memory->dead : NULL;
    int *found = NULL, n_found = 0, kept = 0, failed;
    if (memory && dim == 2 && mesh->period[0] <= 0) {
        SILT_CLOCKED(triangulate,
                     failed = silt_delaunay_follow(&memory->kept, nodes->count, nodes->x, dead, &found, &n_found));
        kept = n_found;
    } else {
        int *live = NULL, n_live;
        double *x = NULL;
        const int m = cloud_points(mesh, nodes, scene, dead, margin, &live, &x, &n_live);
        SILT_CLOCKED(triangulate, failed = (dim == 3 ? silt_delaunay_3d : silt_delaunay_2d)(m, x, &found, &n_found));
        for (int e = 0; e < n_found; e++) {
            const int *cell = found + n_corner * e;
            int lowest = 0;
            for (int a = 1; a < n_corner; a++)
                if (live[cell[a]] < live[cell[lowest]])
                    lowest = a;
            if (cell[lowest] >= n_live || (mesh->period[0] > 0 && cell_too_long(n_corner, cell, x, cloud_parts)))
                continue;
            for (int a = 0; a < n_corner; a++)
                found[n_corner * kept + a] = live[cell[a]];
            kept++;
        }
        free(live);
        free(x);
    }
    *n_cell = kept;
    *cells = NULL;
    if (!failed) {
        *cells = silt_borrow((size_t)kept + 1, sizeof **cells);
        silt_cells_sort(nodes->count, n_corner, kept, found, *cells);
    }
    free(found);
    return failed ? silt_fail(err, SILT_FAILED, "no memory for the triangulation of %d nodes", nodes->count) : SILT_OK;
}

void silt_draft_push(silt_draft *draft, const int cell[4], int before, double quality) {
    silt_mesh *mesh = draft->mesh;
    SILT_RESERVE(mesh->cell, mesh->cell_capacity, mesh->n_cell + 1);
    SILT_RESERVE(draft->before, draft->before_capacity, mesh->n_cell + 1);
    draft->before[mesh->n_cell] = before;
    if (mesh->dim == 3) {
        SILT_RESERVE(draft->quality, draft->quality_capacity, mesh->n_cell + 1);
        draft->quality[mesh->n_cell] = quality;
    }
    memcpy(mesh->cell[mesh->n_cell++], cell, sizeof *mesh->cell);
}

static void draft_clear(silt_draft *draft) {
    free(draft->before);
    free(draft->quality);
}

// Slivers that can be reached from the open go, those within the water stay (without them there would be holes of no
// volume). Through walls nothing is reached.
static void peel_slivers(silt_draft *draft, const silt_nodes *nodes, const uint8_t *sliver) {
    silt_mesh *mesh = draft->mesh;
    const int n = mesh->n_cell;
    int *stack = silt_alloc((size_t)n + 1, sizeof *stack), *index = silt_alloc((size_t)n + 1, sizeof *index), top = 0;
    uint8_t *gone = silt_alloc((size_t)n + 1, 1), *held = silt_alloc((size_t)n + 1, 1);
    // slivers that hang on no real cell are no water
    for (int e = 0; e < n; e++)
        if (!sliver[e])
            for (int a = 0; a < 4; a++) {
                const int other = mesh->across[e][a];
                if (other >= 0 && sliver[other] && !held[other]) {
                    held[other] = 1;
                    stack[top++] = other;
                }
            }
    while (top) {
        const int e = stack[--top];
        for (int a = 0; a < 4; a++) {
            const int other = mesh->across[e][a];
            if (other >= 0 && sliver[other] && !held[other]) {
                held[other] = 1;
                stack[top++] = other;
            }
        }
    }
    for (int e = 0; e < n; e++) {
        bool open = sliver[e] && !held[e];
        for (int a = 0; a < 4 && sliver[e] && !open; a++) {
            int facet[3];
            silt_cell_facet(3, mesh->cell[e], a, facet);
            open = mesh->across[e][a] < 0 && silt_facet_kind_of(mesh, nodes, facet) == FACET_FREE;
        }
        if (open) {
            gone[e] = 1;
            stack[top++] = e;
        }
    }
    while (top) {
        const int e = stack[--top];
        for (int a = 0; a < 4; a++) {
            const int other = mesh->across[e][a];
            int facet[3];
            if (other < 0 || gone[other])
                continue;
            for (int b = 0; b < 4; b++)
                if (mesh->across[other][b] == e)
                    mesh->across[other][b] = -1;
            silt_cell_facet(3, mesh->cell[e], a, facet);
            if (sliver[other] && silt_facet_kind_of(mesh, nodes, facet) == FACET_FREE) {
                gone[other] = 1;
                stack[top++] = other;
            }
        }
    }
    int k = 0;
    for (int e = 0; e < n; e++)
        index[e] = gone[e] ? -1 : k++;
    for (int e = 0; e < n; e++) {
        if (gone[e])
            continue;
        const int to = index[e];
        memmove(mesh->cell[to], mesh->cell[e], sizeof *mesh->cell);
        draft->before[to] = draft->before[e];
        draft->quality[to] = draft->quality[e];
        for (int a = 0; a < 4; a++)
            mesh->across[to][a] = mesh->across[e][a] < 0 ? -1 : index[mesh->across[e][a]];
    }
    mesh->n_cell = k;
    free(stack);
    free(index);
    free(gone);
    free(held);
}

// the chosen cells' neighbours; in 3-D slivers are taken off the surface and mended inside. @return flat cells left
static int draft_finish(silt_draft *draft, const silt_nodes *nodes, double *x, uint8_t **sliver, const silt_barrier *barrier, double size) {
    silt_mesh *mesh = draft->mesh;
    SILT_RESERVE(mesh->across, mesh->across_capacity, mesh->n_cell + 1);
    silt_cells_across(mesh->dim, nodes->count, mesh->n_cell, (const int(*)[4])mesh->cell, mesh->across);
    int flat;
    const int before = mesh->n_cell, more = silt_mesh_fit(draft, nodes, barrier, size);
    if (more) {
        int capacity = before;
        SILT_RESERVE(*sliver, capacity, mesh->n_cell);
        memset(*sliver + before, 0, (size_t)more);
        SILT_RESERVE(mesh->across, mesh->across_capacity, mesh->n_cell + 1);
        silt_cells_across(mesh->dim, nodes->count, mesh->n_cell, (const int(*)[4])mesh->cell, mesh->across);
    }
    if (mesh->dim != 3)
        return 0;
    SILT_CLOCKED(heal, peel_slivers(draft, nodes, *sliver); flat = silt_mesh_heal(draft, nodes, x, size));
    return flat;
}

// ---- the first mesh

silt_status silt_mesh_first(silt_mesh *mesh, const silt_nodes *nodes, const silt_scene *scene,
                            const silt_barrier *barrier, silt_error *err) {
    int(*cells)[4] = NULL, n_cells = 0, sliver_capacity = 0;
    uint8_t *sliver = NULL;
    mesh_prepare(mesh, nodes, scene, barrier);
    const int dim = mesh->dim;
    double largest = scene->fluid.size;
    for (int i = 0; nodes->h && i < nodes->count; i++)
        largest = silt_max(largest, nodes->h[i]);
    SILT_TRY(cloud_cells(mesh, nodes, scene, NULL, 4 * scene->fluid.alpha * largest, &cells, &n_cells, err));
    silt_draft draft = {.mesh = mesh};
    mesh->n_cell = 0;
    for (int e = 0; e < n_cells; e++) {
        const int *cell = cells[e];
        double corner[12], centre[3];
        silt_cell_corners(mesh, nodes->x, cell, corner);
        const silt_cell_shape shape = silt_cell_measure(dim, corner);
        const double h = silt_cell_h(nodes, dim + 1, cell, scene->fluid.size);
        const bool flat = dim == 3 && shape.height < CELL_FLAT * h;
        if ((dim == 2 && shape.volume < 1e-6 * h * h) || silt_cell_on_wall(mesh, nodes, cell, &shape, h))
            continue;
        cell_centre(mesh, scene, corner, centre);
        if (cell_behind(mesh, nodes, barrier, cell, centre))
            continue;
        bool in = false;
        for (int r = 0; r < scene->fluid.n_region && !in; r++)
            in = silt_region_contains(&scene->fluid.region[r], centre);
        if ((!flat && !(in && shape.radius < 2 * scene->fluid.alpha * h)) ||
            (flat && cell_straddles(mesh, corner, scene->fluid.alpha * h)))
            continue;
        SILT_RESERVE(sliver, sliver_capacity, mesh->n_cell + 1);
        sliver[mesh->n_cell] = flat;
        silt_draft_push(&draft, cell, -1, shape.height / h);
    }
    silt_return(cells);
    draft_finish(&draft, nodes, NULL, &sliver, barrier, scene->fluid.size);
    free(sliver);
    draft_clear(&draft);
    silt_mesh_connect_known(mesh, nodes);
    return SILT_OK;
}

// ---- the next mesh

// A wedge of water that runs out on a plane wall has flat cells with large circumcircles: they count by their longest edge.
static bool wedge_cell(const silt_mesh *mesh, const silt_nodes *nodes, const int *cell, const double *corner, double h) {
    bool on = false;
    double longest = 0;
    for (int a = 0; a < 3 && mesh->dim == 2; a++) {
        const int b = (a + 1) % 3;
        on |= nodes->wall[cell[a]][0] >= 0;
        longest = silt_max(longest, hypot(corner[2 * a] - corner[2 * b], corner[2 * a + 1] - corner[2 * b + 1]));
    }
    return on && longest < WEDGE_LONG * h;
}

/** what decides whether a cell of the cloud is water */
typedef struct chooser {
    const silt_mesh *mesh, *gone; // the old mesh; its cells that the new triangulation has not
    const silt_nodes *nodes;
    const silt_scene *scene;
    const silt_barrier *barrier;
    const silt_memory *memory;
    const silt_locator *locator; // of those that are gone
    const silt_cell_set *rim;    // the old surface, as cells without a fourth node
} chooser;

typedef enum { CELL_NO = 0, CELL_WATER, CELL_SLIVER } choice;

// @param before  the old cell that it is, -1  @param quality, radius  out, of what is water
static choice cell_choose(const chooser *c, const int *cell, int before, double *quality, double *radius) {
    const silt_mesh *mesh = c->mesh;
    const silt_nodes *nodes = c->nodes;
    const silt_scene *scene = c->scene;
    const int dim = mesh->dim;
    bool inner = true;
    for (int a = 0; a <= dim; a++)
        inner &= c->memory->interior[cell[a]];
    double corner[12], centre[3];
    silt_cell_corners(mesh, nodes->x, cell, corner);
    const silt_cell_shape shape = silt_cell_measure(dim, corner);
    const double h = silt_cell_h(nodes, dim + 1, cell, scene->fluid.size);
    const bool flat = dim == 3 && shape.height < CELL_FLAT * h;
    if ((dim == 2 && shape.volume < 1e-9 * h * h) || silt_cell_on_wall(mesh, nodes, cell, &shape, h))
        return CELL_NO;
    const double bound = scene->fluid.alpha * h;
    const bool round = shape.radius < bound;
    if (flat && cell_straddles(mesh, corner, bound))
        return CELL_NO;
    const bool wedge = !round && wedge_cell(mesh, nodes, cell, corner, h) && !(before < 0 && cell_is_dent(mesh, cell, corner));
    if (!(inner || flat || wedge || round || (dim == 3 && enclosing_radius(corner) < bound)))
        return CELL_NO;
    cell_centre(mesh, scene, corner, centre);
    if (before < 0 && !inner && !flat) {
        double weight[4];
        int n_fluid = 0, n_inner = 0;
        for (int a = 0; a <= dim; a++) {
            n_fluid += nodes->kind[cell[a]] == NODE_FLUID || nodes->kind[cell[a]] == NODE_INLET || nodes->kind[cell[a]] == NODE_OPEN;
            n_inner += c->memory->interior[cell[a]];
        }
        // in space a gap is between surfaces: a node from within has none to close
        const bool closes = round && n_fluid > 0 && (dim == 2 || n_inner == 0);
        if (silt_locate(c->locator, c->gone, nodes->x, centre, weight) < 0 &&
            !(closes && cell_closes(mesh, nodes, c->rim, cell, corner, &shape, scene->fluid.merge * h)))
            return CELL_NO;
    }
    if (cell_behind(mesh, nodes, c->barrier, cell, centre))
        return CELL_NO;
    *quality = shape.height / h;
    *radius = shape.radius;
    return flat ? CELL_SLIVER : CELL_WATER;
}

// Which cells of the cloud are water now. @return largest circumradius of these, m
static double choose_cells(silt_draft *draft, const silt_nodes *nodes, const silt_scene *scene,
                           const silt_barrier *barrier, const silt_memory *memory, const silt_cell_set *old,
                           int (*const cells)[4], int n_cells, uint8_t **sliver) {
    silt_mesh *mesh = draft->mesh;
    const int dim = mesh->dim;
    int sliver_capacity = 0;
    double largest = 0;

    // old cells that the new triangulation has not: new cells in there are water too
    uint8_t *stays = silt_borrow((size_t)memory->n_cell + 1, 1), *chosen = silt_borrow((size_t)n_cells + 1, 1);
    int *before = silt_borrow((size_t)n_cells + 1, sizeof *before);
    double *quality = silt_borrow((size_t)n_cells + 1, sizeof *quality);
    SILT_PARALLEL(n_cells)
    for (int e = 0; e < n_cells; e++) {
        before[e] = silt_cell_set_find(old, cells[e]);
        if (before[e] >= 0)
            stays[before[e]] = 1;
    }
    silt_mesh gone = {.dim = dim};
    memcpy(gone.period, mesh->period, sizeof gone.period);
    for (int e = 0; e < memory->n_cell; e++)
        if (!stays[e]) {
            SILT_RESERVE(gone.cell, gone.cell_capacity, gone.n_cell + 1);
            memcpy(gone.cell[gone.n_cell++], memory->cell[e], sizeof *gone.cell);
        }
    silt_locator locator = {0};
    silt_locator_build(&locator, &gone, nodes->x, scene->fluid.size);
    int(*facet)[4] = silt_borrow((size_t)mesh->n_facet + 1, sizeof *facet);
    for (int k = 0; dim == 3 && k < mesh->n_facet; k++) {
        memcpy(facet[k], mesh->facet[k], sizeof mesh->facet[k]);
        facet[k][3] = -1;
    }
    silt_cell_set rim;
    silt_cell_set_create(&rim, mesh->n_node, dim == 3 ? mesh->n_facet : 0, (const int(*)[4])facet);

    const chooser c = {mesh, &gone, nodes, scene, barrier, memory, &locator, &rim};
    SILT_PRAGMA(omp parallel for schedule(static) num_threads(silt_threads(n_cells)) reduction(max:largest))
    for (int e = 0; e < n_cells; e++) {
        double radius;
        chosen[e] = (uint8_t)cell_choose(&c, cells[e], before[e], &quality[e], &radius);
        if (chosen[e] == CELL_WATER)
            largest = silt_max(largest, radius);
    }
    mesh->n_cell = 0;
    for (int e = 0; e < n_cells; e++) {
        if (chosen[e] == CELL_NO)
            continue;
        if (dim == 3) {
            SILT_RESERVE(*sliver, sliver_capacity, mesh->n_cell + 1);
            (*sliver)[mesh->n_cell] = chosen[e] == CELL_SLIVER;
        }
        silt_draft_push(draft, cells[e], before[e], quality[e]);
    }
    silt_mesh_clear(&gone);
    silt_locator_clear(&locator);
    silt_cell_set_clear(&rim);
    silt_return(facet);
    silt_return(stays);
    silt_return(chosen);
    silt_return(before);
    silt_return(quality);
    return largest;
}

// New numbers where the present ones lie across each other; the mesh's cells still have those before map.
static void nodes_arrange(const silt_mesh *mesh, silt_nodes *nodes, double h, int n_before, int *map) {
    int *order = silt_borrow((size_t)nodes->count + 1, sizeof *order), *number = silt_borrow((size_t)nodes->count + 1, sizeof *number);
    if (silt_nodes_order(mesh, map, nodes, h, order)) {
        silt_nodes_arrange(nodes, order);
        for (int k = 0; k < nodes->count; k++)
            number[order[k]] = k;
        for (int i = 0; i < n_before; i++)
            map[i] = map[i] < 0 ? -1 : number[map[i]];
    }
    silt_return(order);
    silt_return(number);
}

silt_status silt_mesh_rebuild(silt_mesh *mesh, silt_nodes *nodes, const silt_scene *scene, const silt_barrier *barrier,
                              silt_memory *memory, int *map, silt_error *err) {
    silt_memory_extend(memory, nodes->count);
    mesh_prepare(mesh, nodes, scene, barrier);
    const int dim = mesh->dim;
    const double period = mesh->period[0];
    double h = scene->fluid.size;
    for (int i = 0; nodes->h && i < nodes->count; i++)
        h = silt_max(h, nodes->h[i]);
    for (int i = 0; period > 0 && i < nodes->count; i++) {
        double *x = nodes->x + dim * i;
        if (x[0] < scene->period[0] || x[0] >= scene->period[1])
            x[0] -= period * floor((x[0] - scene->period[0]) / period);
        if (x[0] >= scene->period[1]) // rounding
            x[0] = scene->period[0];
    }
    silt_cell_set old;
    silt_cell_set_create(&old, memory->n_node, memory->n_cell, (const int(*)[4])memory->cell);
    silt_draft draft = {.mesh = mesh};
    uint8_t *sliver = NULL;
    // copies beyond a periodic border must reach as far as the largest empty sphere of the water
    for (double margin = 3 * scene->fluid.alpha * h;; margin *= 2) {
        int(*cells)[4] = NULL, n_cells = 0;
        const silt_status status = cloud_cells(mesh, nodes, scene, memory, margin, &cells, &n_cells, err);
        if (status != SILT_OK) {
            silt_cell_set_clear(&old);
            free(sliver);
            draft_clear(&draft);
            return status;
        }
        free(sliver);
        sliver = NULL;
        double largest;
        SILT_CLOCKED(decide, largest = choose_cells(&draft, nodes, scene, barrier, memory, &old, cells, n_cells, &sliver));
        silt_return(cells);
        if (period <= 0 || 2 * largest <= margin || margin >= period)
            break;
    }
    memory->flat = draft_finish(&draft, nodes, nodes->x, &sliver, barrier, scene->fluid.size);

    uint8_t *was_wet = silt_borrow((size_t)nodes->count + 1, 1);
    for (int e = 0; e < memory->n_cell; e++)
        for (int a = 0; a <= dim; a++)
            was_wet[memory->cell[e][a]] = 1;
    SILT_CLOCKED(book, silt_book_volume(&draft, nodes, memory, &old, was_wet, scene->fluid.size));
    silt_return(was_wet);
    silt_cell_set_clear(&old);
    free(sliver);
    draft_clear(&draft);

    const int n_before = nodes->count;
    silt_nodes_compact(nodes, memory->dead, map);
    nodes_arrange(mesh, nodes, scene->fluid.size, n_before, map);
    silt_delaunay_renumber(memory->kept, map, nodes->count);
    for (int e = 0; e < mesh->n_cell; e++)
        for (int a = 0; a <= dim; a++)
            mesh->cell[e][a] = map[mesh->cell[e][a]];
    silt_mesh_connect_known(mesh, nodes);
    return SILT_OK;
}
