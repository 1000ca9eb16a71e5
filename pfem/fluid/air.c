// what is air around the water: cells of a triangulation that are neither water nor solid
#include "delaunay.h"
#include "pocket.h"

#define AIR_NEAR 0.5   // times h: a point on a wall nearer to a node than this is left out
#define AIR_ON 1e-3    // times h: a cell without volume this near to a wall lies on it
#define AIR_BEYOND 0.35 // times h: a facet of the hull with a wall nearer than this, or bed or body this far behind, is shut

// ---- facets by their nodes

void silt_facet_map_create(silt_facet_map *map, int n_facet) {
    size_t size = 16;
    while (size < 2 * (size_t)n_facet + 2)
        size *= 2;
    map->mask = size - 1;
    map->key = silt_alloc(size, sizeof *map->key);
    map->value = silt_alloc(size, sizeof *map->value);
    for (size_t k = 0; k < size; k++)
        map->key[k][0] = -1;
}

int silt_facet_map_put(silt_facet_map *map, int dim, const int *facet, int value) {
    int a = facet[0], b = facet[1], c = dim == 3 ? facet[2] : -2, t;
    if (a > b)
        t = a, a = b, b = t;
    if (dim == 3 && b > c)
        t = b, b = c, c = t;
    if (a > b)
        t = a, a = b, b = t;
    uint64_t z = (uint64_t)(uint32_t)a * 0x9e3779b97f4a7c15u ^ (uint64_t)(uint32_t)b * 0xbf58476d1ce4e5b9u ^
                 (uint64_t)(uint32_t)c * 0x94d049bb133111ebu;
    z ^= z >> 29;
    for (size_t k = (size_t)(z * 0x9e3779b97f4a7c15u >> 17) & map->mask;; k = (k + 1) & map->mask) {
        int *key = map->key[k];
        if (key[0] == a && key[1] == b && key[2] == c)
            return map->value[k];
        if (key[0] >= 0)
            continue;
        if (value >= 0) {
            key[0] = a;
            key[1] = b;
            key[2] = c;
            map->value[k] = value;
        }
        return -1;
    }
}

void silt_facet_map_clear(silt_facet_map *map) {
    free(map->key);
    free(map->value);
    *map = (silt_facet_map){0};
}

// the facet of a cell opposite to corner a
static void facet_of(int dim, const int *cell, int a, int *facet) {
    for (int b = 0, n = 0; b <= dim; b++)
        if (b != a)
            facet[n++] = cell[b];
}

// ---- points

bool silt_air_skips(const silt_nodes *nodes, const silt_mesh *mesh, int point) {
    return point < nodes->count && !mesh->wet[point] && (nodes->kind[point] == NODE_FLUID || nodes->kind[point] == NODE_INLET);
}

// nodes by place
typedef struct bins {
    int dim;
    double size;
    size_t mask;
    int *head, *next; // owned
} bins;

static size_t bin_hash(const bins *b, const int64_t at[3]) {
    uint64_t z = (uint64_t)at[0] * 0x9e3779b97f4a7c15u ^ (uint64_t)at[1] * 0xbf58476d1ce4e5b9u ^ (uint64_t)at[2] * 0x94d049bb133111ebu;
    z ^= z >> 29;
    return (size_t)(z * 0x9e3779b97f4a7c15u >> 17) & b->mask;
}

static void bin_place(const bins *b, const double *x, int64_t at[3]) {
    for (int d = 0; d < 3; d++)
        at[d] = d < b->dim ? (int64_t)floor(x[d] / b->size) : 0;
}

static void bins_create(bins *b, int dim, double size, const silt_nodes *nodes, const silt_mesh *mesh) {
    *b = (bins){.dim = dim, .size = size, .mask = 15};
    while (b->mask < 2 * (size_t)nodes->count)
        b->mask = 2 * b->mask + 1;
    b->head = silt_alloc(b->mask + 1, sizeof *b->head);
    b->next = silt_alloc((size_t)nodes->count + 1, sizeof *b->next);
    for (int i = 0; i < nodes->count; i++) {
        if (silt_air_skips(nodes, mesh, i))
            continue;
        int64_t at[3];
        bin_place(b, nodes->x + dim * i, at);
        const size_t k = bin_hash(b, at);
        b->next[i] = b->head[k];
        b->head[k] = i + 1;
    }
}

// is a point too near to a node: of any node half its size; of a wet one so near that it could spoil a cell of the water
static bool bins_near(const bins *b, const silt_scene *scene, const silt_nodes *nodes, const silt_mesh *mesh, const double *x,
                      bool corner) {
    int64_t middle[3], at[3];
    bin_place(b, x, middle);
    const int64_t up = b->dim == 3 ? 1 : 0;
    for (at[2] = middle[2] - up; at[2] <= middle[2] + up; at[2]++)
        for (at[1] = middle[1] - 1; at[1] <= middle[1] + 1; at[1]++)
            for (at[0] = middle[0] - 1; at[0] <= middle[0] + 1; at[0]++)
                for (int i = b->head[bin_hash(b, at)]; i > 0; i = b->next[i - 1]) {
                    double square = 0;
                    for (int d = 0; d < b->dim; d++)
                        square += silt_square(nodes->x[b->dim * (i - 1) + d] - x[d]);
                    const double h = silt_node_h(nodes, i - 1, scene->fluid.size);
                    const double reach = mesh->wet[i - 1] && !corner ? 2 * scene->fluid.alpha * h : AIR_NEAR * h;
                    if (square < reach * reach)
                        return true;
                }
    return false;
}

static void point_add(silt_air *air, const bins *b, const silt_scene *scene, const silt_nodes *nodes, const silt_mesh *mesh,
                      const double *x, bool corner) {
    if (bins_near(b, scene, nodes, mesh, x, corner))
        return;
    SILT_RESERVE(air->x, air->point_capacity, air->dim * (air->n_point + 1));
    memcpy(air->x + air->dim * air->n_point++, x, (size_t)air->dim * sizeof *x);
}

void silt_air_points(silt_air *air, const silt_scene *scene, const silt_nodes *nodes, const silt_mesh *mesh,
                     const silt_walls *walls) {
    const int dim = silt_nodes_dim(nodes);
    const double h = scene->fluid.size;
    air->dim = dim;
    air->n_node = air->n_point = nodes->count;
    SILT_RESERVE(air->x, air->point_capacity, dim * nodes->count + 1);
    memcpy(air->x, nodes->x, (size_t)(dim * nodes->count) * sizeof *air->x);
    double widest = h;
    for (int i = 0; nodes->h && i < nodes->count; i++)
        widest = silt_max(widest, nodes->h[i]);
    bins b;
    bins_create(&b, dim, silt_max(2 * scene->fluid.alpha, AIR_NEAR) * widest, nodes, mesh);
    for (int s = 0; walls && s < walls->count; s++) {
        double c[3][3] = {{0}}, longest = 0;
        for (int a = 0; a < dim; a++)
            for (int d = 0; d < dim; d++)
                c[a][d] = dim == 3 ? walls->corner[s][a][d] : a == 0 ? walls->from[s][d] : walls->to[s][d];
        for (int a = 0; a < 3; a++) {
            const double *p = c[a], *q = c[(a + 1) % 3];
            if (dim == 3 || a == 0)
                longest = silt_max(longest, sqrt(silt_square(q[0] - p[0]) + silt_square(q[1] - p[1]) + silt_square(q[2] - p[2])));
        }
        // a lattice of points on the element
        const int n = (int)ceil(longest / h * (1 - 1e-9));
        for (int i = 0; i <= n; i++)
            for (int j = 0; j <= (dim == 3 ? n - i : 0); j++) {
                double x[3];
                for (int d = 0; d < 3; d++)
                    x[d] = c[0][d] + (c[1][d] - c[0][d]) * i / n + (dim == 3 ? (c[2][d] - c[0][d]) * j / n : 0);
                point_add(air, &b, scene, nodes, mesh, x, (i == 0 && (dim == 2 || j == 0 || j == n)) || i == n);
            }
    }
    free(b.head);
    free(b.next);
}

// ---- cells

static double cell_volume(int dim, const double *x, const int *cell) {
    double e[3][3] = {{0}};
    for (int a = 0; a < dim; a++)
        for (int d = 0; d < dim; d++)
            e[a][d] = x[dim * cell[a + 1] + d] - x[dim * cell[0] + d];
    if (dim == 2)
        return 0.5 * (e[0][0] * e[1][1] - e[0][1] * e[1][0]);
    return (e[0][0] * (e[1][1] * e[2][2] - e[1][2] * e[2][1]) - e[0][1] * (e[1][0] * e[2][2] - e[1][2] * e[2][0]) +
            e[0][2] * (e[1][0] * e[2][1] - e[1][1] * e[2][0])) / 6;
}

static bool same_cell(int dim, const int *a, const int *b) {
    for (int i = 0; i <= dim; i++) {
        bool found = false;
        for (int k = 0; k <= dim; k++)
            found |= a[i] == b[k];
        if (!found)
            return false;
    }
    return true;
}

// is open air beyond a facet of the hull: it does not lie on a wall, and neither bed nor body is a little way behind it
static bool beyond_is_open(const silt_air *air, const silt_barrier *barrier, const int *cell, int a, double h) {
    const int dim = air->dim;
    int facet[3];
    facet_of(dim, cell, a, facet);
    double middle[3] = {0}, normal[3] = {0}, size = 0, out = 0;
    const double *p = air->x + dim * facet[0], *q = air->x + dim * facet[1];
    for (int d = 0; d < dim; d++)
        for (int b = 0; b < dim; b++)
            middle[d] += air->x[dim * facet[b] + d] / dim;
    if (dim == 2) {
        normal[0] = q[1] - p[1];
        normal[1] = p[0] - q[0];
    } else
        for (int d = 0; d < 3; d++) {
            const double *r = air->x + 3 * facet[2];
            const int d1 = (d + 1) % 3, d2 = (d + 2) % 3;
            normal[d] = (q[d1] - p[d1]) * (r[d2] - p[d2]) - (q[d2] - p[d2]) * (r[d1] - p[d1]);
        }
    for (int d = 0; d < dim; d++) {
        size += normal[d] * normal[d];
        out += normal[d] * (middle[d] - air->x[dim * cell[a] + d]);
    }
    if (!(size > 0))
        return false;
    // where a chain of walls ends no side of it is behind: the distance counts, not its sign
    int element;
    if (barrier->walls && barrier->walls->count && fabs(silt_walls_distance(barrier->walls, middle, &element)) < AIR_BEYOND * h)
        return false;
    const silt_barrier other = {.bed = barrier->bed, .bodies = barrier->bodies};
    for (int d = 0; d < dim; d++)
        middle[d] += (out < 0 ? -1 : 1) * AIR_BEYOND * h * normal[d] / sqrt(size);
    return !silt_barrier_contains(&other, middle);
}

void silt_air_cells(silt_air *air, const silt_scene *scene, const silt_mesh *mesh, const silt_barrier *barrier, int n,
                    const int *cell) {
    const int dim = air->dim, stride = dim + 1;
    const double h = scene->fluid.size, flat = 1e-9 * (dim == 3 ? h * h * h : h * h);
    air->n_cell = air->n_missing = 0;
    if (n == 0)
        return;

    // water cells by their first facet's nodes and the others of the triangulation through it
    int facet[3];
    uint8_t *water = silt_alloc((size_t)n, 1);
    silt_facet_map faces = {0}; // of the triangulation: each facet's cells
    silt_facet_map_create(&faces, n * stride);
    int (*across)[4] = silt_alloc((size_t)n, sizeof *across);
    for (int e = 0; e < n; e++)
        for (int a = 0; a <= dim; a++) {
            facet_of(dim, cell + stride * e, a, facet);
            const int code = 4 * e + a, other = silt_facet_map_put(&faces, dim, facet, code);
            across[e][a] = other < 0 ? -1 : other / 4;
            if (other >= 0)
                across[other / 4][other % 4] = e;
        }
    for (int e = 0; e < mesh->n_cell; e++) {
        facet_of(dim, mesh->cell[e], 0, facet);
        const int code = silt_facet_map_put(&faces, dim, facet, -1);
        int here = code < 0 ? -1 : code / 4;
        if (here >= 0 && !same_cell(dim, mesh->cell[e], cell + stride * here))
            here = across[here][code % 4];
        if (here >= 0 && same_cell(dim, mesh->cell[e], cell + stride * here))
            water[here] = 1;
        else
            air->n_missing++;
    }

    // what is neither water nor solid; where the water has cells of its own, the place decides
    uint8_t *kept = silt_alloc((size_t)n, 1), *rim = silt_alloc((size_t)n, 1);
    silt_locator locator = {0};
    if (air->n_missing)
        silt_locator_build(&locator, mesh, air->x, h);
    for (int e = 0; e < n; e++) {
        const int *c = cell + stride * e;
        if (water[e])
            continue;
        double middle[3] = {0};
        for (int a = 0; a <= dim; a++)
            for (int d = 0; d < dim; d++)
                middle[d] += air->x[dim * c[a] + d] / stride;
        double weight[4];
        const bool wet = air->n_missing && silt_locate(&locator, mesh, air->x, middle, weight) >= 0;
        int element;
        // points in a lattice make cells without volume: within the air they join their neighbours, on walls they are nothing
        if (!wet && fabs(cell_volume(dim, air->x, c)) <= flat) {
            for (int a = 0; a <= dim; a++)
                rim[e] |= across[e][a] < 0;
            rim[e] |= barrier->walls && barrier->walls->count &&
                      fabs(silt_walls_distance(barrier->walls, middle, &element)) < AIR_ON * h;
        }
        kept[e] = !wet && !rim[e] && !silt_barrier_contains(barrier, middle);
    }
    for (int e = 0; e < n; e++) {
        if (!kept[e])
            continue;
        const int *c = cell + stride * e;
        SILT_RESERVE(air->cell, air->cell_capacity, air->n_cell + 1);
        SILT_RESERVE(air->open, air->open_capacity, air->n_cell + 1);
        uint8_t open = 0;
        for (int a = 0; a <= dim && !open; a++) {
            if (across[e][a] < 0 || rim[across[e][a]])
                open = beyond_is_open(air, barrier, c, a, h);
        }
        air->cell[air->n_cell][3] = -1;
        memcpy(air->cell[air->n_cell], c, (size_t)stride * sizeof *c);
        air->open[air->n_cell++] = open;
    }
    silt_facet_map_clear(&faces);
    free(across);
    silt_locator_clear(&locator);
    free(water);
    free(kept);
    free(rim);
}

silt_status silt_air_find(silt_air *air, const silt_scene *scene, const silt_nodes *nodes, const silt_mesh *mesh,
                          const silt_barrier *barrier, silt_error *err) {
    const int dim = silt_nodes_dim(nodes);
    silt_air_points(air, scene, nodes, mesh, barrier->walls);
    int *live = silt_alloc((size_t)air->n_point + 1, sizeof *live), m = 0, *cell = NULL, n_cell = 0;
    double *x = silt_alloc((size_t)(dim * air->n_point) + 1, sizeof *x);
    for (int i = 0; i < air->n_point; i++)
        if (!silt_air_skips(nodes, mesh, i)) {
            memcpy(x + dim * m, air->x + dim * i, (size_t)dim * sizeof *x);
            live[m++] = i;
        }
    const int failed = (dim == 3 ? silt_delaunay_3d : silt_delaunay_2d)(m, x, &cell, &n_cell);
    for (int k = 0; !failed && k < (dim + 1) * n_cell; k++)
        cell[k] = live[cell[k]];
    if (!failed)
        silt_air_cells(air, scene, mesh, barrier, n_cell, cell);
    free(cell);
    free(live);
    free(x);
    return failed ? silt_fail(err, SILT_FAILED, "no memory for the triangulation of the air around %d nodes", m) : SILT_OK;
}

void silt_air_clear(silt_air *air) {
    free(air->x);
    free(air->cell);
    free(air->open);
    *air = (silt_air){0};
}
