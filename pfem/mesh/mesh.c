// the water's cells: adjacency, boundary and measures; what is water is decided in remesh.c
#include "parallel.h"
#include "remesh.h"

double silt_cell_area(const double *x, const int *cell) {
    const double *a = x + 2 * cell[0], *b = x + 2 * cell[1], *c = x + 2 * cell[2];
    return 0.5 * ((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]));
}

int silt_group_find(int *parent, int i) {
    while (parent[i] != i)
        i = parent[i] = parent[parent[i]];
    return i;
}

void silt_group_join(int *parent, const int *cell) {
    for (int a = 1; a < 4 && cell[a] >= 0; a++) {
        const int p = silt_group_find(parent, cell[0]), q = silt_group_find(parent, cell[a]);
        parent[p > q ? p : q] = p > q ? q : p;
    }
}

void silt_mesh_lower(const silt_mesh *mesh, int *start, int *index) {
    int at = 0;
    for (int j = 0; j < mesh->n_node; j++) {
        start[j] = at;
        for (int k = mesh->neighbour_start[j]; k < mesh->neighbour_start[j + 1]; k++)
            if (mesh->neighbour[k] >= j)
                index[at++] = mesh->neighbour[k];
    }
    start[mesh->n_node] = at;
}

double silt_mesh_volume(const silt_mesh *mesh, const double *x) {
    const int n = mesh->n_cell;
    double part[CHUNK_MOST];
    SILT_PARALLEL(n)
    for (int c = 0; c < silt_chunks(n); c++) {
        part[c] = 0;
        for (int e = silt_chunk_first(n, c); e < silt_chunk_first(n, c + 1); e++)
            part[c] += silt_cell_volume(mesh, x, e);
    }
    return silt_total(silt_chunks(n), part);
}

// nodes of the facet opposite each node of a cell; in 2-D water on its left, in 3-D counter-clockwise seen from outside
static const int side_2d[3][3] = {{1, 2, -1}, {2, 0, -1}, {0, 1, -1}};
static const int side_3d[4][3] = {{1, 2, 3}, {0, 3, 2}, {0, 1, 3}, {0, 2, 1}};

void silt_cell_facet(int dim, const int *cell, int a, int facet[3]) {
    const int *side = dim == 3 ? side_3d[a] : side_2d[a];
    for (int k = 0; k < 3; k++)
        facet[k] = side[k] < 0 ? -1 : cell[side[k]];
}

void silt_cells_across(int dim, int n_node, int n_cell, const int (*cell)[4], int (*across)[4]) {
    // facets by their lowest node; of those only the other nodes have to be told apart
    silt_bins bins = silt_bins_create(n_node, n_cell);
    uint64_t *key = silt_borrow((size_t)n_cell * (size_t)(dim + 1) + 1, sizeof *key);
    int *item = silt_borrow((size_t)n_cell * (size_t)(dim + 1) + 1, sizeof *item);
    for (int pass = 0; pass < 2; pass++) {
        SILT_PRAGMA(omp parallel for schedule(static) num_threads(bins.n_part))
        for (int part = 0; part < bins.n_part; part++) {
            int *at = bins.at + (size_t)part * (size_t)n_node;
            for (int e = silt_bins_first(&bins, part), last = silt_bins_first(&bins, part + 1); e < last; e++) {
                // the cell's lowest node is that of all facets but the one opposite it
                uint32_t node[4];
                silt_cell_sort(cell[e], node);
                if (pass == 0) {
                    at[node[0] >> 2] += dim;
                    at[node[1] >> 2]++;
                    continue;
                }
                for (int a = 0; a <= dim; a++) {
                    const uint64_t lo = node[a < 2 ? 2 : 1] >> 2, hi = dim == 2 ? 0 : node[a < 3 ? 3 : 2] >> 2;
                    const int k = at[node[a ? 0 : 1] >> 2]++;
                    key[k] = lo << 32 | hi;
                    item[k] = 4 * e + (int)(node[a] & 3);
                }
                across[e][0] = across[e][1] = across[e][2] = across[e][3] = -1;
            }
        }
        if (pass == 0)
            silt_bins_place(&bins);
    }
    const int *start = bins.start;
    SILT_PARALLEL(n_node)
    for (int i = 0; i < n_node; i++) {
        // facets still without a partner are kept together at the bucket's front
        int open = start[i];
        for (int k = start[i]; k < start[i + 1]; k++) {
            int m = start[i];
            while (m < open && key[m] != key[k])
                m++;
            if (m < open) {
                across[item[m] / 4][item[m] % 4] = item[k] / 4;
                across[item[k] / 4][item[k] % 4] = item[m] / 4;
                key[m] = key[--open];
                item[m] = item[open];
            } else {
                const uint64_t t = key[k];
                const int u = item[k];
                key[open] = t;
                item[open++] = u;
            }
        }
    }
    silt_bins_clear(&bins);
    silt_return(key);
    silt_return(item);
}

// true when a fixed node without walls of its own lies in the plane of a wall element, against the facet's length
static bool facet_on_plane(const silt_mesh *mesh, const silt_nodes *nodes, int i, int on, int element) {
    if (mesh->dim != 3 || !mesh->walls)
        return true;
    double off = 0, length = 0;
    for (int d = 0; d < 3; d++) {
        double step = nodes->x[3 * i + d] - nodes->x[3 * on + d];
        if (mesh->period[d] > 0)
            step -= mesh->period[d] * floor(step / mesh->period[d] + 0.5);
        off += step * mesh->walls->normal[element][d];
        length += step * step;
    }
    return fabs(off) <= 0.1 * sqrt(length);
}

silt_facet_kind silt_facet_kind_of(const silt_mesh *mesh, const silt_nodes *nodes, const int facet[3]) {
    const int dim = mesh->dim == 3 ? 3 : 2;
    int n_inlet = 0, n_open = 0, n_bed = 0, n_body = 0;
    for (int k = 0; k < dim; k++) {
        const int i = facet[k];
        n_inlet += nodes->kind[i] == NODE_INLET;
        n_open += nodes->kind[i] == NODE_OPEN && nodes->owner[i] == nodes->owner[facet[0]];
        n_bed += nodes->kind[i] == NODE_BED;
        n_body += nodes->kind[i] == NODE_BODY && nodes->owner[i] == nodes->owner[facet[0]];
    }
    if (n_inlet == dim)
        return FACET_INLET;
    if (n_open == dim)
        return FACET_OPEN;
    if (n_bed == dim)
        return FACET_BED;
    if (n_body == dim)
        return FACET_BODY;
    if (silt_mesh_share(mesh, nodes, dim, facet))
        return FACET_WALL;
    // tank corners count for all walls that they may touch; inlets and the bed end on walls: the others must share one
    int other[3], fixed[3], n_other = 0, n_fixed = 0;
    for (int k = 0; k < dim; k++) {
        const int kind = nodes->kind[facet[k]];
        if (kind == NODE_CORNER || kind == NODE_BED || kind == NODE_INLET)
            fixed[n_fixed++] = facet[k];
        else
            other[n_other++] = facet[k];
    }
    if (n_fixed == 0)
        return FACET_FREE;
    if (n_other == 0)
        return FACET_WALL;
    if (!silt_mesh_share(mesh, nodes, n_other, other))
        return FACET_FREE;
    // an inlet's rim, and in space that of the bed, may lie in the second wall of a crease
    for (int s = 0; s < (n_inlet || (n_bed && dim == 3) ? 3 : 1) && nodes->wall[other[0]][s] >= 0; s++) {
        bool all = true;
        for (int k = 0; k < n_fixed && all; k++)
            all = facet_on_plane(mesh, nodes, fixed[k], other[0], nodes->wall[other[0]][s]);
        if (all)
            return FACET_WALL;
    }
    return FACET_FREE;
}

bool silt_mesh_share(const silt_mesh *mesh, const silt_nodes *nodes, int n, const int *node) {
    const int *element[4] = {0};
    for (int k = 0; k < n && k < 4; k++) {
        element[k] = nodes->wall[node[k]];
        if (element[k][0] < 0)
            return false;
    }
    if (mesh->walls)
        return silt_walls_share(mesh->walls, n, element);
    // a mesh without walls at hand: the elements themselves
    for (int s = 0; s < 3; s++) {
        bool all = element[0][s] >= 0;
        for (int k = 1; k < n && all; k++)
            all = element[k][0] == element[0][s] || element[k][1] == element[0][s] || element[k][2] == element[0][s];
        if (all)
            return true;
    }
    return false;
}

static void list_sort(int *list, int count) {
    for (int k = 1; k < count; k++) {
        const int value = list[k];
        int m = k;
        for (; m > 0 && list[m - 1] > value; m--)
            list[m] = list[m - 1];
        list[m] = value;
    }
}

void silt_mesh_connect(silt_mesh *mesh, const silt_nodes *nodes) {
    mesh->dim = silt_nodes_dim(nodes);
    SILT_RESERVE(mesh->across, mesh->across_capacity, mesh->n_cell + 1);
    silt_cells_across(mesh->dim, nodes->count, mesh->n_cell, (const int(*)[4])mesh->cell, mesh->across);
    silt_mesh_connect_known(mesh, nodes);
}

// cells of every node, rising
static void connect_cells(silt_mesh *mesh, int n, int n_corner) {
    silt_bins bins = silt_bins_create(n, mesh->n_cell);
    for (int pass = 0; pass < 2; pass++) {
        SILT_PRAGMA(omp parallel for schedule(static) num_threads(bins.n_part))
        for (int part = 0; part < bins.n_part; part++) {
            int *at = bins.at + (size_t)part * (size_t)n;
            for (int e = silt_bins_first(&bins, part), last = silt_bins_first(&bins, part + 1); e < last; e++)
                for (int a = 0; a < n_corner; a++) {
                    const int k = at[mesh->cell[e][a]]++;
                    if (pass)
                        mesh->node_cell[k] = e;
                }
        }
        if (pass == 0)
            silt_bins_place(&bins);
    }
    memcpy(mesh->node_cell_start, bins.start, (size_t)(n + 1) * sizeof *bins.start);
    silt_bins_clear(&bins);
}

// Neighbours of the nodes of a part, themselves included, rising. @param seen  per node, 1 + the last node that has it as neighbour
// @param list  grows  @return how many
static int connect_nodes(silt_mesh *mesh, int first, int last, int n_corner, int *seen, int **list, int *capacity) {
    const int *start = mesh->node_cell_start;
    int filled = 0;
    for (int i = first; i < last; i++) {
        SILT_RESERVE(*list, *capacity, filled + (n_corner - 1) * (start[i + 1] - start[i]) + 1);
        int *own = *list + filled, count = 0;
        mesh->neighbour_start[i] = filled;
        own[count++] = i;
        seen[i] = i + 1;
        for (int k = start[i]; k < start[i + 1]; k++)
            for (int a = 0; a < n_corner; a++) {
                const int j = mesh->cell[mesh->node_cell[k]][a];
                if (seen[j] != i + 1) {
                    seen[j] = i + 1;
                    own[count++] = j;
                }
            }
        list_sort(own, count);
        filled += count;
        mesh->wet[i] = start[i + 1] > start[i];
    }
    return filled;
}

// the first part straight into the mesh, the others' after it
static void connect_neighbours(silt_mesh *mesh, int n, int n_corner) {
    const int n_part = silt_threads(n);
    int *list[PARALLEL_MOST] = {mesh->neighbour}, capacity[PARALLEL_MOST] = {mesh->neighbour_capacity}, count[PARALLEL_MOST];
    SILT_PARALLEL(n)
    for (int part = 0; part < n_part; part++) {
        int *seen = silt_borrow((size_t)n + 1, sizeof *seen);
        count[part] = connect_nodes(mesh, (int)((int64_t)n * part / n_part), (int)((int64_t)n * (part + 1) / n_part), n_corner, seen,
                                    &list[part], &capacity[part]);
        silt_return(seen);
    }
    mesh->neighbour = list[0];
    mesh->neighbour_capacity = capacity[0];
    int filled = count[0];
    for (int part = 1; part < n_part; part++) {
        SILT_RESERVE(mesh->neighbour, mesh->neighbour_capacity, filled + count[part]);
        memcpy(mesh->neighbour + filled, list[part], (size_t)count[part] * sizeof **list);
        for (int i = (int)((int64_t)n * part / n_part); i < (int)((int64_t)n * (part + 1) / n_part); i++)
            mesh->neighbour_start[i] += filled;
        filled += count[part];
        free(list[part]);
    }
    mesh->neighbour_start[n] = filled;
}

void silt_mesh_connect_known(silt_mesh *mesh, const silt_nodes *nodes) {
    const int n = nodes->count, dim = silt_nodes_dim(nodes), n_corner = dim + 1;
    mesh->revision++;
    mesh->n_node = n;
    SILT_RESERVE(mesh->wet, mesh->wet_capacity, n + 1);
    SILT_RESERVE(mesh->surface, mesh->surface_capacity, n + 1);
    SILT_RESERVE(mesh->node_cell_start, mesh->start_capacity, n + 1);
    SILT_RESERVE(mesh->neighbour_start, mesh->neighbour_start_capacity, n + 1);
    SILT_RESERVE(mesh->node_cell, mesh->node_cell_capacity, n_corner * mesh->n_cell + 1);
    memset(mesh->surface, 0, (size_t)n);
    connect_cells(mesh, n, n_corner);
    connect_neighbours(mesh, n, n_corner);

    // a facet that only one cell has is boundary; in the order of their first nodes, in 3-D the lowest, then of the
    // cells
    int *place = silt_borrow((size_t)n + 1, sizeof *place);
    for (int pass = 0; pass < 2; pass++) {
        for (int e = 0; e < mesh->n_cell; e++)
            for (int a = 0; a < n_corner; a++) {
                if (mesh->across[e][a] >= 0)
                    continue;
                int facet[3];
                silt_cell_facet(dim, mesh->cell[e], a, facet);
                while (dim == 3 && (facet[1] < facet[0] || facet[2] < facet[0])) {
                    const int t = facet[0];
                    facet[0] = facet[1];
                    facet[1] = facet[2];
                    facet[2] = t;
                }
                if (pass == 0)
                    place[facet[0]]++;
                else
                    memcpy(mesh->facet[place[facet[0]]++], facet, sizeof facet);
            }
        if (pass == 0) {
            mesh->n_facet = 0;
            for (int i = 0; i < n; i++) {
                const int count = place[i];
                place[i] = mesh->n_facet;
                mesh->n_facet += count;
            }
            SILT_RESERVE(mesh->facet, mesh->facet_capacity, mesh->n_facet + 1);
            SILT_RESERVE(mesh->facet_kind, mesh->facet_kind_capacity, mesh->n_facet + 1);
        }
    }
    silt_return(place);
    SILT_PARALLEL(mesh->n_facet)
    for (int k = 0; k < mesh->n_facet; k++)
        mesh->facet_kind[k] = (uint8_t)silt_facet_kind_of(mesh, nodes, mesh->facet[k]);
    for (int k = 0; k < mesh->n_facet; k++)
        for (int a = 0; a < dim; a++)
            if (mesh->facet_kind[k] == FACET_FREE)
                mesh->surface[mesh->facet[k][a]] = 1;
}

void silt_mesh_clear(silt_mesh *mesh) {
    free(mesh->cell);
    free(mesh->facet);
    free(mesh->facet_kind);
    free(mesh->wet);
    free(mesh->surface);
    free(mesh->node_cell_start);
    free(mesh->node_cell);
    free(mesh->neighbour_start);
    free(mesh->neighbour);
    free(mesh->across);
    *mesh = (silt_mesh){0};
}

void silt_cell_corners(const silt_mesh *mesh, const double *x, const int *cell, double *corner) {
    const int dim = mesh->dim == 3 ? 3 : 2;
    for (int d = 0; d < dim; d++) {
        const double first = x[dim * cell[0] + d], period = mesh->period[d];
        for (int a = 0; a <= dim; a++) {
            const double at = x[dim * cell[a] + d];
            corner[dim * a + d] = period > 0 ? first + (at - first - period * floor((at - first) / period + 0.5)) : at;
        }
    }
}

static double tetrahedron_volume(const double *a, const double *b, const double *c, const double *d) {
    double u[3], v[3], w[3];
    for (int k = 0; k < 3; k++) {
        u[k] = b[k] - a[k];
        v[k] = c[k] - a[k];
        w[k] = d[k] - a[k];
    }
    return silt_triple(u, v, w) / 6;
}

double silt_simplex_volume(int dim, const double *c) {
    if (dim != 3)
        return 0.5 * ((c[2] - c[0]) * (c[5] - c[1]) - (c[3] - c[1]) * (c[4] - c[0]));
    return tetrahedron_volume(c, c + 3, c + 6, c + 9);
}

double silt_cell_volume(const silt_mesh *mesh, const double *x, int e) {
    const int *cell = mesh->cell[e];
    if (mesh->period[0] > 0 || mesh->period[1] > 0 || mesh->period[2] > 0) {
        double c[12];
        silt_cell_corners(mesh, x, cell, c);
        return silt_simplex_volume(mesh->dim, c);
    }
    if (mesh->dim != 3)
        return silt_cell_area(x, cell);
    return tetrahedron_volume(x + 3 * cell[0], x + 3 * cell[1], x + 3 * cell[2], x + 3 * cell[3]);
}

double silt_cell_h(const silt_nodes *nodes, int n_corner, const int *cell, double size) {
    if (!nodes->h)
        return size;
    double sum = 0;
    for (int a = 0; a < n_corner; a++)
        sum += nodes->h[cell[a]];
    return sum / n_corner;
}

silt_cell_shape silt_cell_measure(int dim, const double *corner) {
    if (dim != 3) {
        const double *a = corner, *b = corner + 2, *c = corner + 4;
        const double area = 0.5 * ((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]));
        const double ab = hypot(b[0] - a[0], b[1] - a[1]), bc = hypot(c[0] - b[0], c[1] - b[1]);
        const double ca = hypot(a[0] - c[0], a[1] - c[1]);
        const double longest = silt_max(ab, silt_max(bc, ca));
        return (silt_cell_shape){area, area > 0 ? ab * bc * ca / (4 * area) : HUGE_VAL,
                                 longest > 0 ? 2 * area / longest : 0};
    }
    double u[3], v[3], w[3], vw[3], wu[3], uv[3], opposite[3], centre[3];
    for (int d = 0; d < 3; d++) {
        u[d] = corner[3 + d] - corner[d];
        v[d] = corner[6 + d] - corner[d];
        w[d] = corner[9 + d] - corner[d];
    }
    silt_cross(v, w, vw);
    silt_cross(w, u, wu);
    silt_cross(u, v, uv);
    const double six = silt_dot(3, u, vw), uu = silt_dot(3, u, u), vv = silt_dot(3, v, v), ww = silt_dot(3, w, w);
    for (int d = 0; d < 3; d++) {
        opposite[d] = vw[d] + wu[d] + uv[d]; // twice the area of the facet that the first node does not have
        centre[d] = uu * vw[d] + vv * wu[d] + ww * uv[d];
    }
    const double largest = silt_max(silt_max(silt_dot(3, vw, vw), silt_dot(3, wu, wu)), silt_max(silt_dot(3, uv, uv), silt_dot(3, opposite, opposite)));
    return (silt_cell_shape){six / 6, six > 0 ? sqrt(silt_dot(3, centre, centre)) / (2 * six) : HUGE_VAL,
                             largest > 0 ? six / sqrt(largest) : 0};
}

int silt_neighbour_index(const silt_mesh *mesh, int i, int j) {
    int lo = mesh->neighbour_start[i], hi = mesh->neighbour_start[i + 1] - 1;
    while (lo < hi) {
        const int mid = (lo + hi) / 2;
        if (mesh->neighbour[mid] < j)
            lo = mid + 1;
        else
            hi = mid;
    }
    return lo;
}
