// the bed's mesh: nodes, cells, the exposed surface, and what finds a cell by node or by place

#include "bed_mesh.h"

#define HOLDS_SLACK 1e-11 // times the cube of a bin: six times the volume by which a place may lie outside of a cell in space

// ---------------------------------------------------------------- walls

static bool plane_on_wall(const silt_scene *scene, const double *p, const double *q) {
    const double close = 1e-6 * bed_size(scene);
    for (int w = 0; w < scene->n_wall; w++)
        for (int k = 0; k < bed_wall_pieces(&scene->wall[w]); k++) {
            const double *from = bed_wall_point(&scene->wall[w], k), *to = bed_wall_point(&scene->wall[w], k + 1);
            if (bed_segment_distance(from, to, p) <= close && bed_segment_distance(from, to, q) <= close)
                return true;
        }
    return false;
}

bool silt_bed_on_wall(const silt_bed *bed, const silt_scene *scene, const int facet[3]) {
    if (bed_dim(bed) == 2)
        return plane_on_wall(scene, bed->x[facet[0]], bed->x[facet[1]]);
    const int *element[3];
    for (int k = 0; k < 3; k++) {
        element[k] = bed->wall[facet[k]];
        if (element[k][0] < 0)
            return false;
    }
    return silt_walls_share(bed->walls, 3, element);
}

// ---------------------------------------------------------------- index: cells of a node, cells at a place

static int index_bin(const silt_bed_index *index, int dim, const double *x) {
    // what lies outside the grid belongs to its rim: two points closer than a bin stay in the same or in adjoining bins
    int at[3] = {0};
    for (int d = 0; d < dim; d++)
        at[d] = (int)silt_clamp(floor((x[d] - index->lo[d]) / index->bin), 0, index->n[d] - 1);
    return (at[2] * index->n[1] + at[1]) * index->n[0] + at[0];
}

static void cell_centroid(const silt_bed *bed, int cell, double centre[3]) {
    const int *node = bed->cell[cell], dim = bed_dim(bed);
    for (int d = 0; d < 3; d++)
        centre[d] = dim == 3 ? (bed->x[node[0]][d] + bed->x[node[1]][d] + bed->x[node[2]][d] + bed->x[node[3]][d]) / 4
                             : (bed->x[node[0]][d] + bed->x[node[1]][d] + bed->x[node[2]][d]) / 3;
}

static double cell_reach(const silt_bed *bed, int cell) {
    double centre[3], reach = 0;
    cell_centroid(bed, cell, centre);
    for (int a = 0; a <= bed_dim(bed); a++)
        reach = silt_max(reach, bed_apart(bed_dim(bed), centre, bed->x[bed->cell[cell][a]]));
    return reach;
}

static double cell_volume(const silt_bed *bed, int cell) {
    const int *node = bed->cell[cell];
    if (bed_dim(bed) == 3)
        return bed_volume6(bed->x[node[0]], bed->x[node[1]], bed->x[node[2]], bed->x[node[3]]) / 6;
    return 0.5 * bed_cross(bed->x[node[0]], bed->x[node[1]], bed->x[node[2]]);
}

static void index_link(silt_bed *bed, int cell) {
    silt_bed_index *index = bed->index;
    for (int a = 0; a <= bed_dim(bed); a++) {
        const int node = bed->cell[cell][a];
        index->next[4 * cell + a] = index->first[node];
        index->first[node] = 4 * cell + a;
    }
    double centre[3];
    cell_centroid(bed, cell, centre);
    int *head = &index->head[index_bin(index, bed_dim(bed), centre)];
    index->before[cell] = -1;
    index->after[cell] = *head;
    if (*head >= 0)
        index->before[*head] = cell;
    *head = cell;
}

static void index_unlink(silt_bed *bed, int cell) {
    silt_bed_index *index = bed->index;
    for (int a = 0; a <= bed_dim(bed); a++) {
        int *place = &index->first[bed->cell[cell][a]];
        while (*place != 4 * cell + a)
            place = &index->next[*place];
        *place = index->next[4 * cell + a];
    }
    double centre[3];
    cell_centroid(bed, cell, centre);
    const int before = index->before[cell], after = index->after[cell];
    if (before >= 0)
        index->after[before] = after;
    else
        index->head[index_bin(index, bed_dim(bed), centre)] = after;
    if (after >= 0)
        index->before[after] = before;
}

static void index_reserve_nodes(silt_bed *bed, int need) {
    silt_bed_index *index = bed->index;
    int capacity = index->node_capacity;
    // all arrays have one capacity; each call starts from the old one
#define RESERVE(array) (capacity = index->node_capacity, SILT_RESERVE(index->array, capacity, need))
    RESERVE(first);
    RESERVE(outward);
    RESERVE(length);
    RESERVE(surface);
    RESERVE(surface_end);
#undef RESERVE
    index->node_capacity = capacity;
}

static void index_reserve_cells(silt_bed *bed, int need) {
    silt_bed_index *index = bed->index;
    int capacity = index->cell_capacity;
    SILT_RESERVE(index->after, capacity, need);
    capacity = index->cell_capacity;
    SILT_RESERVE(index->before, capacity, need);
    int places = 4 * index->cell_capacity;
    SILT_RESERVE(index->next, places, 4 * capacity);
    index->cell_capacity = capacity;
}

static void index_free(silt_bed_index *index) {
    if (!index)
        return;
    free(index->first);
    free(index->next);
    free(index->outward);
    free(index->length);
    free(index->surface);
    free(index->surface_end);
    free(index->surface_next);
    free(index->head);
    free(index->after);
    free(index->before);
    free(index);
}

static void surface_link(silt_bed *bed, int edge) {
    silt_bed_index *index = bed->index;
    int places = 3 * index->surface_capacity;
    if (edge >= index->surface_capacity) {
        SILT_RESERVE(index->surface_next, places, 3 * bed->edge_capacity);
        index->surface_capacity = bed->edge_capacity;
    }
    for (int a = 0; a < bed_dim(bed); a++) {
        const int node = bed->edge[edge][a], place = 3 * edge + a;
        index->surface_next[place] = -1;
        *(index->surface[node] < 0 ? &index->surface[node] : &index->surface_next[index->surface_end[node]]) = place;
        index->surface_end[node] = place;
    }
}

static void surface_unlink(silt_bed *bed, int edge) {
    silt_bed_index *index = bed->index;
    for (int a = 0; a < bed_dim(bed); a++) {
        const int node = bed->edge[edge][a], place = 3 * edge + a;
        int before = -1, at = index->surface[node];
        for (; at != place; at = index->surface_next[at])
            before = at;
        *(before < 0 ? &index->surface[node] : &index->surface_next[before]) = index->surface_next[place];
        if (index->surface_end[node] == place)
            index->surface_end[node] = before;
    }
}

// closes the list of edges up, in its order, and links its nodes anew
static void surface_build(silt_bed *bed) {
    silt_bed_index *index = bed->index;
    int kept = 0;
    for (int e = 0; e < bed->n_edge; e++) {
        if (bed->edge[e][0] < 0)
            continue;
        if (kept < e)
            memcpy(bed->edge[kept], bed->edge[e], sizeof *bed->edge);
        kept++;
    }
    bed->n_edge = kept;
    index->n_dead = 0;
    for (int i = 0; i < bed->n_node; i++)
        index->surface[i] = index->surface_end[i] = -1;
    for (int e = 0; e < bed->n_edge; e++)
        surface_link(bed, e);
}

static void index_span(silt_bed_index *index, const double *x, bool first) {
    for (int d = 0; d < 3; d++) {
        index->box_lo[d] = first ? x[d] : silt_min(index->box_lo[d], x[d]);
        index->box_hi[d] = first ? x[d] : silt_max(index->box_hi[d], x[d]);
    }
}

void silt_bed_index_build(silt_bed *bed) {
    index_free(bed->index);
    silt_bed_index *index = bed->index = silt_alloc(1, sizeof *index);
    index_reserve_nodes(bed, bed->n_node);
    index_reserve_cells(bed, bed->n_cell);

    // the grid's box is that of the nodes; deposits may lie outside it
    double widest = 0, reach = 0;
    for (int i = 0; i < bed->n_node; i++)
        index_span(index, bed->x[i], i == 0);
    for (int c = 0; c < bed->n_cell; c++)
        reach = silt_max(reach, cell_reach(bed, c));
    for (int d = 0; d < 3; d++) {
        index->lo[d] = index->box_lo[d];
        widest = silt_max(widest, index->box_hi[d] - index->lo[d]);
    }
    index->bin = silt_max(1.3 * reach, 1e-3 * widest);
    if (!(index->bin > 0))
        index->bin = 1;
    for (int d = 0; d < 3; d++)
        index->n[d] = (int)((index->box_hi[d] - index->lo[d]) / index->bin) + 1;
    const int n_bin = index->n[0] * index->n[1] * index->n[2];
    SILT_RESERVE(index->head, index->bin_capacity, n_bin);
    for (int b = 0; b < n_bin; b++)
        index->head[b] = -1;
    for (int i = 0; i < bed->n_node; i++)
        index->first[i] = -1;
    for (int c = 0; c < bed->n_cell; c++)
        index_link(bed, c);
    surface_build(bed);
}

// ---------------------------------------------------------------- nodes, cells, edges

void silt_bed_reserve_nodes(silt_bed *bed, int need) {
    int capacity = bed->node_capacity;
    // all arrays have one capacity; each call starts from the old one
#define RESERVE(array) (capacity = bed->node_capacity, SILT_RESERVE(bed->array, capacity, need))
    RESERVE(x);
    RESERVE(alive);
    RESERVE(exposed);
    RESERVE(work);
    RESERVE(eroded);
    RESERVE(shear);
    RESERVE(fluid_node);
    RESERVE(wall);
    RESERVE(corner);
#undef RESERVE
    bed->node_capacity = capacity;
}

void silt_bed_reserve_cells(silt_bed *bed, int need) {
    int capacity = bed->cell_capacity;
    SILT_RESERVE(bed->cell, capacity, need);
    capacity = bed->cell_capacity;
    SILT_RESERVE(bed->mass, capacity, need);
    capacity = bed->cell_capacity;
    SILT_RESERVE(bed->area, capacity, need);
    bed->cell_capacity = capacity;
}

int silt_bed_node_add(silt_bed *bed, const double *x) {
    const int node = bed->n_node;
    silt_bed_reserve_nodes(bed, node + 1);
    index_reserve_nodes(bed, node + 1);
    bed->n_node++;
    for (int d = 0; d < 3; d++)
        bed->x[node][d] = d < bed_dim(bed) ? x[d] : 0;
    bed->alive[node] = bed->exposed[node] = 0;
    bed->work[node] = bed->eroded[node] = bed->shear[node] = 0;
    bed->fluid_node[node] = bed->corner[node] = -1;
    bed->wall[node][0] = bed->wall[node][1] = bed->wall[node][2] = -1;
    silt_bed_index *index = bed->index;
    index->first[node] = index->surface[node] = index->surface_end[node] = -1;
    index->length[node] = index->outward[node][0] = index->outward[node][1] = index->outward[node][2] = 0;
    index_span(index, bed->x[node], node == 0);
    return node;
}

int silt_bed_cell_add(silt_bed *bed, const int *node, double mass) {
    const int cell = bed->n_cell;
    silt_bed_reserve_cells(bed, cell + 1);
    index_reserve_cells(bed, cell + 1);
    bed->n_cell++;
    memcpy(bed->cell[cell], (int[4]){node[0], node[1], node[2], bed_dim(bed) == 3 ? node[3] : -1}, sizeof bed->cell[cell]);
    bed->area[cell] = cell_volume(bed, cell);
    bed->mass[cell] = mass;
    index_link(bed, cell);
    // a cell that is wider than the bins would not be found
    if (cell_reach(bed, cell) > bed->index->bin)
        silt_bed_index_build(bed);
    for (int a = 0; a <= bed_dim(bed); a++)
        bed->alive[node[a]] = 1;
    return cell;
}

void silt_bed_cell_remove(silt_bed *bed, int cell) {
    const int last = bed->n_cell - 1;
    index_unlink(bed, cell);
    for (int a = 0; a <= bed_dim(bed); a++) {
        const int node = bed->cell[cell][a];
        bed->alive[node] = bed->index->first[node] >= 0;
    }
    if (cell != last) {
        index_unlink(bed, last);
        memcpy(bed->cell[cell], bed->cell[last], sizeof bed->cell[cell]);
        bed->mass[cell] = bed->mass[last];
        bed->area[cell] = bed->area[last];
        index_link(bed, cell);
    }
    bed->n_cell = last;
}

// true for the same nodes in the same sense
static bool facet_same(int dim, const int a[3], const int b[3]) {
    if (dim == 2)
        return a[0] == b[0] && a[1] == b[1];
    for (int k = 0; k < 3; k++)
        if (a[0] == b[k])
            return a[1] == b[(k + 1) % 3] && a[2] == b[(k + 2) % 3];
    return false;
}

int silt_bed_cell_at(const silt_bed *bed, const int facet[3]) {
    const int dim = bed_dim(bed);
    for (int place = bed->index->first[facet[0]]; place >= 0; place = bed->index->next[place]) {
        const int *cell = bed->cell[place / 4];
        for (int k = 0; k <= dim; k++) {
            int own[3];
            if (dim == 3 && (cell[k] == facet[0] || cell[k] == facet[1] || cell[k] == facet[2]))
                continue;
            bed_facet(dim, cell, k, own);
            if (facet_same(dim, own, facet))
                return place / 4;
        }
    }
    return -1;
}

void silt_bed_edge_add(silt_bed *bed, const silt_scene *scene, const int facet[3]) {
    if (silt_bed_on_wall(bed, scene, facet))
        return;
    SILT_RESERVE(bed->edge, bed->edge_capacity, bed->n_edge + 1);
    memcpy(bed->edge[bed->n_edge], facet, sizeof *bed->edge);
    surface_link(bed, bed->n_edge++);
}

void silt_bed_edge_remove(silt_bed *bed, const int facet[3]) {
    silt_bed_index *index = bed->index;
    for (int place = index->surface[facet[0]]; place >= 0; place = index->surface_next[place]) {
        const int e = place / 3;
        if (!facet_same(bed_dim(bed), bed->edge[e], facet))
            continue;
        surface_unlink(bed, e);
        bed->edge[e][0] = bed->edge[e][1] = bed->edge[e][2] = -1;
        index->n_dead++;
        return;
    }
}

void silt_bed_facet_normal(const silt_bed *bed, const int facet[3], double *normal) {
    const double *p = bed->x[facet[0]], *q = bed->x[facet[1]];
    if (bed_dim(bed) == 2) {
        normal[0] = -(q[1] - p[1]);
        normal[1] = q[0] - p[0];
        return;
    }
    const double *r = bed->x[facet[2]];
    for (int d = 0; d < 3; d++) {
        const int e = (d + 1) % 3, f = (d + 2) % 3;
        normal[d] = 0.5 * ((q[e] - p[e]) * (r[f] - p[f]) - (q[f] - p[f]) * (r[e] - p[e]));
    }
}

void silt_bed_refresh_nodes(silt_bed *bed, int n, const int *node) {
    silt_bed_index *index = bed->index;
    const int dim = bed_dim(bed);
    for (int k = 0; k < n; k++) {
        const int i = node[k];
        index->length[i] = index->outward[i][0] = index->outward[i][1] = index->outward[i][2] = 0;
        // in the order of the list: sums keep their bits
        for (int place = index->surface[i]; place >= 0; place = index->surface_next[place]) {
            double normal[3] = {0};
            silt_bed_facet_normal(bed, bed->edge[place / 3], normal);
            for (int d = 0; d < dim; d++)
                index->outward[i][d] += normal[d] / dim;
            index->length[i] += hypot(hypot(normal[0], normal[1]), normal[2]) / dim;
        }
        bed->exposed[i] = index->length[i] > 0;
    }
}

void silt_bed_refresh(silt_bed *bed) {
    if (bed->index->n_dead)
        surface_build(bed);
    for (int i = 0; i < bed->n_node; i++)
        silt_bed_refresh_nodes(bed, 1, &i);

    // Neumaier's sum: the sediment's ledger closes to the last bits
    double sum = 0, lost = 0;
    for (int c = 0; c < bed->n_cell; c++) {
        const double m = bed->mass[c], t = sum + m;
        lost += fabs(sum) >= fabs(m) ? (sum - t) + m : (m - t) + sum;
        sum = t;
    }
    bed->solid_mass = sum + lost;
    bed->revision++;
}

void silt_bed_clear(silt_bed *bed) {
    free(bed->x);
    free(bed->alive);
    free(bed->exposed);
    free(bed->work);
    free(bed->eroded);
    free(bed->shear);
    free(bed->fluid_node);
    free(bed->wall);
    free(bed->corner);
    free(bed->cell);
    free(bed->mass);
    free(bed->area);
    free(bed->edge);
    index_free(bed->index);
    *bed = (silt_bed){0};
}

// ---------------------------------------------------------------- questions

void silt_bed_normal(const silt_bed *bed, int node, double *normal) {
    const int dim = bed_dim(bed);
    double n[3] = {0};
    memcpy(n, bed->index->outward[node], sizeof n);
    double length = hypot(hypot(n[0], n[1]), n[2]);
    if (!(length > 1e-9 * bed->index->length[node])) {
        // the edges cancel (a spike, or a node between two patches): the normal of one of them
        n[0] = n[1] = n[2] = 0;
        n[dim - 1] = length = 1;
        const int place = bed->index->surface[node];
        if (place >= 0) {
            silt_bed_facet_normal(bed, bed->edge[place / 3], n);
            length = hypot(hypot(n[0], n[1]), n[2]);
        }
    }
    for (int d = 0; d < dim; d++)
        normal[d] = n[d] / length;
}

static bool cell_holds(const silt_bed *bed, int cell, const double *x) {
    const int *node = bed->cell[cell];
    const double *p = bed->x[node[0]], *q = bed->x[node[1]], *r = bed->x[node[2]];
    if (bed_dim(bed) == 2)
        return bed_cross(p, q, x) >= 0 && bed_cross(q, r, x) >= 0 && bed_cross(r, p, x) >= 0;
    // a place on a face of a tank is seldom in it to the last bit
    const double *s = bed->x[node[3]], slack = -HOLDS_SLACK * bed->index->bin * bed->index->bin * bed->index->bin;
    return bed_volume6(p, q, r, x) >= slack && bed_volume6(p, s, q, x) >= slack && bed_volume6(q, s, r, x) >= slack &&
           bed_volume6(p, r, s, x) >= slack;
}

// bins that a box around x meets
static void index_range(const silt_bed *bed, const double *x, double reach, int lo[3], int hi[3]) {
    const silt_bed_index *index = bed->index;
    for (int d = 0; d < 3; d++) {
        lo[d] = hi[d] = 0;
        if (d >= bed_dim(bed))
            continue;
        lo[d] = (int)silt_clamp(floor((x[d] - reach - index->lo[d]) / index->bin), 0, index->n[d] - 1);
        hi[d] = (int)silt_clamp(floor((x[d] + reach - index->lo[d]) / index->bin), 0, index->n[d] - 1);
    }
}

// false when x lies farther than reach outside of all nodes
static bool index_spans(const silt_bed *bed, const double *x, double reach) {
    const silt_bed_index *index = bed->index;
    for (int d = 0; d < bed_dim(bed); d++)
        if (x[d] < index->box_lo[d] - reach || x[d] > index->box_hi[d] + reach)
            return false;
    return true;
}

bool silt_bed_contains(const silt_bed *bed, const double *x) {
    const silt_bed_index *index = bed->index;
    if (!index || bed->n_cell == 0 || !index_spans(bed, x, 0))
        return false;
    int lo[3], hi[3];
    index_range(bed, x, index->bin, lo, hi);
    for (int k = lo[2]; k <= hi[2]; k++)
        for (int j = lo[1]; j <= hi[1]; j++)
            for (int i = lo[0]; i <= hi[0]; i++)
                for (int cell = index->head[(k * index->n[1] + j) * index->n[0] + i]; cell >= 0; cell = index->after[cell])
                    if (cell_holds(bed, cell, x))
                        return true;
    return false;
}

bool silt_bed_near(const silt_bed *bed, const double *x, double reach) {
    const silt_bed_index *index = bed->index;
    if (!index || bed->n_cell == 0 || !(reach > 0) || !index_spans(bed, x, reach))
        return false;
    int lo[3], hi[3];
    index_range(bed, x, reach + index->bin, lo, hi);
    for (int k = lo[2]; k <= hi[2]; k++)
        for (int j = lo[1]; j <= hi[1]; j++)
            for (int i = lo[0]; i <= hi[0]; i++)
                for (int cell = index->head[(k * index->n[1] + j) * index->n[0] + i]; cell >= 0; cell = index->after[cell])
                    for (int a = 0; a <= bed_dim(bed); a++) {
                        const int node = bed->cell[cell][a];
                        if (bed->exposed[node] && bed_apart(bed_dim(bed), bed->x[node], x) < reach)
                            return true;
                    }
    return false;
}

double silt_bed_triangle_distance(const double *p, const double *q, const double *r, const double *x) {
    const double *corner[3] = {p, q, r};
    double u[3], v[3], w[3], square = HUGE_VAL;
    for (int d = 0; d < 3; d++) {
        u[d] = q[d] - p[d];
        v[d] = r[d] - p[d];
        w[d] = x[d] - p[d];
    }
    // the foot inside, else the nearest of the sides
    const double uu = silt_dot(3, u, u), vv = silt_dot(3, v, v), uv = silt_dot(3, u, v), wu = silt_dot(3, w, u), wv = silt_dot(3, w, v), under = uu * vv - uv * uv;
    if (under > 0) {
        const double a = (vv * wu - uv * wv) / under, b = (uu * wv - uv * wu) / under;
        if (a >= 0 && b >= 0 && a + b <= 1) {
            const double off = bed_volume6(p, q, r, x);
            return fabs(off) / sqrt(under);
        }
    }
    for (int k = 0; k < 3; k++) {
        const double *a = corner[k], *b = corner[(k + 1) % 3];
        double along = 0, length = 0, near = 0;
        for (int d = 0; d < 3; d++) {
            along += (x[d] - a[d]) * (b[d] - a[d]);
            length += silt_square(b[d] - a[d]);
        }
        const double t = length > 0 ? silt_clamp(along / length, 0, 1) : 0;
        for (int d = 0; d < 3; d++)
            near += silt_square(x[d] - a[d] - t * (b[d] - a[d]));
        square = silt_min(square, near);
    }
    return sqrt(square);
}

double silt_bed_facet_distance(const silt_bed *bed, const int facet[3], const double *x) {
    const double *p = bed->x[facet[0]], *q = bed->x[facet[1]];
    return bed_dim(bed) == 3 ? silt_bed_triangle_distance(p, q, bed->x[facet[2]], x) : bed_segment_distance(p, q, x);
}

static double edge_level(const double *p, const double *q, double x) {
    const double reach = fabs(q[0] - p[0]);
    if (x < silt_min(p[0], q[0]) || x > silt_max(p[0], q[0]))
        return -HUGE_VAL;
    return reach > 0 ? p[1] + (x - p[0]) / (q[0] - p[0]) * (q[1] - p[1]) : silt_max(p[1], q[1]);
}

// where the vertical through (x, y) meets a face; upright ones have their neighbours' rims
static double face_level(const double *p, const double *q, const double *r, const double *x) {
    const double a = bed_cross(q, r, x), b = bed_cross(r, p, x), c = bed_cross(p, q, x), sum = a + b + c;
    const bool in = (a >= 0 && b >= 0 && c >= 0) || (a <= 0 && b <= 0 && c <= 0);
    return in && sum != 0 ? (a * p[2] + b * q[2] + c * r[2]) / sum : -HUGE_VAL;
}

double silt_bed_level(const silt_bed *bed, const double *at) {
    double level = -HUGE_VAL;
    for (int e = 0; e < bed->n_edge; e++) {
        const int *edge = bed->edge[e];
        const double *p = bed->x[edge[0]], *q = bed->x[edge[1]];
        level = silt_max(level, bed_dim(bed) == 3 ? face_level(p, q, bed->x[edge[2]], at) : edge_level(p, q, at[0]));
    }
    return level;
}

double silt_bed_lowest(const silt_bed *bed, double from, double to) {
    const double end[2] = {from, to};
    double lowest = HUGE_VAL;
    // the surface is lowest at one of its nodes or at an end
    for (int k = -2; k < 2 * bed->n_edge; k++) {
        const double *at = k < 0 ? &end[k + 2] : bed->x[bed->edge[k / 2][k % 2]], level = silt_bed_level(bed, at);
        if (at[0] >= from && at[0] <= to && level > -HUGE_VAL)
            lowest = silt_min(lowest, level);
    }
    return lowest;
}
