// decides what is water: Delaunay of the cloud, held against what was water a step ago; books the volume that this makes or loses
#include "delaunay.h"
#include "pfem.h"

static double circumradius(const double *x, const int cell[3], double area) {
    const double *a = x + 2 * cell[0], *b = x + 2 * cell[1], *c = x + 2 * cell[2];
    const double ab = hypot(b[0] - a[0], b[1] - a[1]), bc = hypot(c[0] - b[0], c[1] - b[1]);
    const double ca = hypot(a[0] - c[0], a[1] - c[1]);
    return area > 0 ? ab * bc * ca / (4 * area) : HUGE_VAL;
}

static bool polygon_contains(int n, const double *p, double x, double y) {
    bool in = false;
    for (int k = 0, m = n - 1; k < n; m = k++)
        if ((p[2 * k + 1] > y) != (p[2 * m + 1] > y) &&
            x < (p[2 * m] - p[2 * k]) * (y - p[2 * k + 1]) / (p[2 * m + 1] - p[2 * k + 1]) + p[2 * k])
            in = !in;
    return in;
}

bool silt_barrier_contains(const silt_barrier *barrier, const double point[2]) {
    int segment;
    if (barrier->walls && barrier->walls->count && silt_walls_distance(barrier->walls, point, &segment) < 0)
        return true;
    if (barrier->bed && silt_bed_contains(barrier->bed, point))
        return true;
    for (int b = 0; barrier->bodies && b < barrier->bodies->count; b++) {
        const struct silt_body *body = &barrier->bodies->body[b];
        // into the body's frame: turned back about z
        const double c = 1 - 2 * body->q[3] * body->q[3], s = 2 * body->q[0] * body->q[3];
        const double dx = point[0] - body->x[0], dy = point[1] - body->x[1];
        if (polygon_contains(body->n_point, body->outline, c * dx + s * dy, -s * dx + c * dy))
            return true;
    }
    return false;
}

// ---- a set of cells by their three nodes

typedef struct cell_set {
    int *slot; // index + 1 of the cell, 0 empty
    size_t mask;
    const int *cell; // `stride` numbers a cell
    int stride;
} cell_set;

static void cell_key(const int cell[3], int key[3]) {
    int a = cell[0], b = cell[1], c = cell[2], t;
    if (a > b)
        t = a, a = b, b = t;
    if (b > c)
        t = b, b = c, c = t;
    if (a > b)
        t = a, a = b, b = t;
    key[0] = a;
    key[1] = b;
    key[2] = c;
}

static size_t cell_hash(const int key[3]) {
    uint64_t z = (uint64_t)(uint32_t)key[0] * 0x9e3779b97f4a7c15u ^ (uint64_t)(uint32_t)key[1] * 0xbf58476d1ce4e5b9u ^
                 (uint64_t)(uint32_t)key[2] * 0x94d049bb133111ebu;
    z ^= z >> 29;
    return (size_t)(z * 0x9e3779b97f4a7c15u >> 17);
}

static void set_create(cell_set *set, int n, int stride, const int *cell) {
    size_t size = 16;
    while (size < 2 * (size_t)n + 2)
        size *= 2;
    set->slot = silt_alloc(size, sizeof *set->slot);
    set->mask = size - 1;
    set->cell = cell;
    set->stride = stride;
    for (int e = 0; e < n; e++) {
        int key[3];
        cell_key(cell + stride * e, key);
        size_t k = cell_hash(key) & set->mask;
        while (set->slot[k])
            k = (k + 1) & set->mask;
        set->slot[k] = e + 1;
    }
}

// index of the cell in the set, or -1
static int set_find(const cell_set *set, const int cell[3]) {
    int key[3], other[3];
    cell_key(cell, key);
    for (size_t k = cell_hash(key) & set->mask; set->slot[k]; k = (k + 1) & set->mask) {
        cell_key(set->cell + set->stride * (set->slot[k] - 1), other);
        if (other[0] == key[0] && other[1] == key[1] && other[2] == key[2])
            return set->slot[k] - 1;
    }
    return -1;
}

// three nodes on one straight wall make no cell
static bool cell_on_wall(const silt_nodes *nodes, const int cell[3]) {
    for (int s = 0; s < 2; s++) {
        const int w = nodes->wall[cell[0]][s];
        if (w >= 0 && (nodes->wall[cell[1]][0] == w || nodes->wall[cell[1]][1] == w) &&
            (nodes->wall[cell[2]][0] == w || nodes->wall[cell[2]][1] == w))
            return true;
    }
    return false;
}

static int cell_count_free(const silt_nodes *nodes, const int cell[3]) {
    int n = 0;
    for (int a = 0; a < 3; a++)
        n += nodes->kind[cell[a]] == NODE_FLUID && nodes->wall[cell[a]][0] < 0;
    return n;
}

// a gap that is nearly shut and still closing joins; the water in it is no more than the gap was wide
static bool cell_closes(const silt_nodes *nodes, const int cell[3], double area, double gap) {
    double longest = 0, rate = 0;
    for (int a = 0; a < 3; a++) {
        const int i = cell[a], j = cell[(a + 1) % 3], k = cell[(a + 2) % 3];
        const double *p = nodes->x + 2 * j, *q = nodes->x + 2 * k;
        longest = silt_max(longest, hypot(q[0] - p[0], q[1] - p[1]));
        // twice the area changes with the velocity of i across the opposite edge
        rate += nodes->v[2 * i] * (p[1] - q[1]) + nodes->v[2 * i + 1] * (q[0] - p[0]);
    }
    return 2 * area < gap * longest && rate < 0;
}

static bool cell_behind(const silt_nodes *nodes, const silt_barrier *barrier, const int cell[3]) {
    if (cell_count_free(nodes, cell) >= 2)
        return false; // only an edge between two fixed nodes can cut through something solid
    double centre[2] = {0, 0};
    for (int a = 0; a < 3; a++)
        for (int d = 0; d < 2; d++)
            centre[d] += nodes->x[2 * cell[a] + d] / 3;
    return silt_barrier_contains(barrier, centre);
}

static silt_status cloud_triangles(const silt_nodes *nodes, const uint8_t *dead, int **triangle, int *n_triangle,
                                   silt_error *err) {
    const int n = nodes->count;
    int *live = silt_alloc((size_t)n + 1, sizeof *live);
    double *x = silt_alloc(2 * (size_t)n + 2, sizeof *x);
    int m = 0;
    for (int i = 0; i < n; i++)
        if (!dead || !dead[i]) {
            live[m] = i;
            x[2 * m] = nodes->x[2 * i];
            x[2 * m + 1] = nodes->x[2 * i + 1];
            m++;
        }
    const int failed = silt_delaunay_2d(m, x, triangle, n_triangle);
    for (int k = 0; !failed && k < 3 * *n_triangle; k++)
        (*triangle)[k] = live[(*triangle)[k]];
    free(live);
    free(x);
    return failed ? silt_fail(err, SILT_FAILED, "no memory for the triangulation of %d nodes", m) : SILT_OK;
}

static void mesh_push(silt_mesh *mesh, const int cell[3]) {
    SILT_RESERVE(mesh->cell, mesh->cell_capacity, mesh->n_cell + 1);
    memcpy(mesh->cell[mesh->n_cell], cell, 3 * sizeof *cell);
    mesh->cell[mesh->n_cell++][3] = -1;
}

silt_status silt_mesh_first(silt_mesh *mesh, const silt_nodes *nodes, const silt_scene *scene, const silt_barrier *barrier,
                            silt_error *err) {
    int *triangle = NULL, n_triangle = 0;
    SILT_TRY(cloud_triangles(nodes, NULL, &triangle, &n_triangle, err));
    const double h = scene->fluid.size;
    mesh->n_cell = 0;
    for (int e = 0; e < n_triangle; e++) {
        const int *cell = triangle + 3 * e;
        const double area = silt_cell_area(nodes->x, cell);
        if (area < 1e-6 * h * h || cell_on_wall(nodes, cell) || cell_behind(nodes, barrier, cell))
            continue;
        double centre[3] = {0};
        for (int a = 0; a < 3; a++)
            for (int d = 0; d < 2; d++)
                centre[d] += nodes->x[2 * cell[a] + d] / 3;
        bool in = false;
        for (int r = 0; r < scene->fluid.n_region && !in; r++)
            in = silt_region_contains(&scene->fluid.region[r], centre);
        if (in && circumradius(nodes->x, cell, area) < 2 * scene->fluid.alpha * h)
            mesh_push(mesh, cell);
    }
    free(triangle);
    silt_mesh_connect(mesh, nodes);
    return SILT_OK;
}

// which triangles of the cloud are water now
static void choose_cells(silt_mesh *mesh, const silt_nodes *nodes, const silt_scene *scene, const silt_barrier *barrier,
                         const silt_memory *memory, const int *triangle, int n_triangle, uint8_t *kept) {
    const double h = scene->fluid.size;
    cell_set old, fresh;
    set_create(&old, memory->n_cell, 4, memory->n_cell ? memory->cell[0] : NULL);
    set_create(&fresh, n_triangle, 3, triangle);

    // old cells that the new triangulation has not: new cells in there are water too
    silt_mesh gone = {0};
    for (int e = 0; e < memory->n_cell; e++)
        if (set_find(&fresh, memory->cell[e]) < 0)
            mesh_push(&gone, memory->cell[e]);
    silt_locator locator = {0};
    silt_locator_build(&locator, &gone, nodes->x, h);

    mesh->n_cell = 0;
    memset(kept, 0, (size_t)memory->n_cell + 1);
    for (int e = 0; e < n_triangle; e++) {
        const int *cell = triangle + 3 * e;
        const double area = silt_cell_area(nodes->x, cell);
        if (area < 1e-9 * h * h || cell_on_wall(nodes, cell))
            continue;
        const bool inner = memory->interior[cell[0]] && memory->interior[cell[1]] && memory->interior[cell[2]];
        const double radius = circumradius(nodes->x, cell, area);
        const int before = set_find(&old, cell);
        bool keep = inner || radius < scene->fluid.alpha * h;
        if (keep && before < 0 && !inner) {
            double centre[2] = {0, 0}, weight[3];
            int n_fluid = 0;
            for (int a = 0; a < 3; a++) {
                n_fluid += nodes->kind[cell[a]] == NODE_FLUID || nodes->kind[cell[a]] == NODE_INLET;
                for (int d = 0; d < 2; d++)
                    centre[d] += nodes->x[2 * cell[a] + d] / 3;
            }
            keep = silt_locate(&locator, &gone, nodes->x, centre, weight) >= 0 ||
                   (n_fluid > 0 && cell_closes(nodes, cell, area, scene->fluid.merge * h));
        }
        if (!keep || cell_behind(nodes, barrier, cell))
            continue;
        mesh_push(mesh, cell);
        if (before >= 0)
            kept[before] = 1;
    }
    silt_mesh_clear(&gone);
    silt_locator_clear(&locator);
    free(old.slot);
    free(fresh.slot);
}

// Volume is booked where it changed: a group is the nodes of cells that came or went together, so that a mere flip of an
// edge books nothing. A node that lost all its cells takes its share along as it flies.
static void book_volume(const silt_mesh *mesh, silt_nodes *nodes, silt_memory *memory, const uint8_t *kept,
                        const uint8_t *was_wet) {
    const int n = nodes->count;
    int *parent = silt_alloc((size_t)n + 1, sizeof *parent);
    double *sum = silt_alloc((size_t)n + 1, sizeof *sum), *share = silt_alloc((size_t)n + 1, sizeof *share);
    int *members = silt_alloc((size_t)n + 1, sizeof *members);
    uint8_t *wet = silt_alloc((size_t)n + 1, 1), *touched = silt_alloc((size_t)n + 1, 1);
    for (int i = 0; i < n; i++)
        parent[i] = i;
    cell_set old;
    set_create(&old, memory->n_cell, 4, memory->n_cell ? memory->cell[0] : NULL);

    double made = 0;
    for (int e = 0; e < memory->n_cell; e++)
        if (!kept[e])
            silt_group_join(parent, memory->cell[e]);
    for (int e = 0; e < mesh->n_cell; e++)
        if (set_find(&old, mesh->cell[e]) < 0)
            silt_group_join(parent, mesh->cell[e]);
    for (int e = 0; e < memory->n_taken; e++)
        silt_group_join(parent, memory->taken[e]);

    // what every group lost less what it got
    for (int e = 0; e < memory->n_cell; e++)
        if (!kept[e]) {
            sum[silt_group_find(parent, memory->cell[e][0])] += memory->area[e];
            made -= memory->area[e];
            for (int a = 0; a < 3; a++) {
                share[memory->cell[e][a]] += memory->area[e] / 3;
                touched[memory->cell[e][a]] = 1;
            }
        }
    for (int e = 0; e < memory->n_taken; e++) {
        sum[silt_group_find(parent, memory->taken[e][0])] -= memory->taken_area[e];
        made += memory->taken_area[e];
        touched[memory->taken[e][0]] = 1;
    }
    for (int e = 0; e < mesh->n_cell; e++) {
        const int before = set_find(&old, mesh->cell[e]);
        const double area = silt_cell_area(nodes->x, mesh->cell[e]);
        for (int a = 0; a < 3; a++)
            wet[mesh->cell[e][a]] = 1;
        if (before < 0) {
            sum[silt_group_find(parent, mesh->cell[e][0])] -= area;
            made += area;
            for (int a = 0; a < 3; a++)
                touched[mesh->cell[e][a]] = 1;
        } else { // nodes that were put on a wall or a body moved the cell's rim
            const double moved = area - memory->area[before];
            made += moved;
            for (int a = 0; a < 3; a++)
                nodes->debt[mesh->cell[e][a]] -= moved / 3;
        }
    }

    // debts of nodes that left or came back go into their group; a node that flies off takes its share
    for (int i = 0; i < n; i++) {
        const int g = silt_group_find(parent, i);
        if (memory->dead[i] || (wet[i] && !was_wet[i])) {
            sum[g] += nodes->debt[i];
            nodes->debt[i] = 0;
            touched[i] = 1;
        } else if (!wet[i] && was_wet[i] && nodes->kind[i] == NODE_FLUID) {
            nodes->debt[i] += share[i];
            sum[g] -= share[i];
            touched[i] = 1;
        }
    }
    // where nodes left the domain, what is missing left with them
    memory->left = 0;
    for (int i = 0; i < n; i++)
        if (memory->dead[i] == NODE_LEFT) {
            const int g = silt_group_find(parent, i);
            memory->left += sum[g];
            sum[g] = 0;
        }
    memory->reconnected = made + memory->left;
    for (int i = 0; i < n; i++)
        if (touched[i] && wet[i] && !memory->dead[i])
            members[silt_group_find(parent, i)]++;
    for (int i = 0; i < n; i++) {
        const int g = silt_group_find(parent, i);
        if (touched[i] && wet[i] && !memory->dead[i])
            nodes->debt[i] += sum[g] / members[g];
    }
    // a group without a wet node left: its volume flies with its live nodes, or goes to the nearest wet node
    for (int i = 0; i < n; i++) {
        const int g = silt_group_find(parent, i);
        if (g != i || members[g] || sum[g] == 0)
            continue;
        int heir = -1;
        double nearest = HUGE_VAL;
        for (int k = 0; k < n; k++) {
            if (memory->dead[k])
                continue;
            const bool own = silt_group_find(parent, k) == g && nodes->kind[k] == NODE_FLUID;
            if (!own && !wet[k])
                continue;
            const double distance = own ? -1 : hypot(nodes->x[2 * k] - nodes->x[2 * i], nodes->x[2 * k + 1] - nodes->x[2 * i + 1]);
            if (distance < nearest) {
                nearest = distance;
                heir = k;
            }
        }
        if (heir >= 0)
            nodes->debt[heir] += sum[g];
    }
    free(old.slot);
    free(parent);
    free(sum);
    free(share);
    free(members);
    free(wet);
    free(touched);
}

silt_status silt_mesh_rebuild(silt_mesh *mesh, silt_nodes *nodes, const silt_scene *scene, const silt_barrier *barrier,
                              silt_memory *memory, int *map, silt_error *err) {
    silt_memory_extend(memory, nodes->count);
    int *triangle = NULL, n_triangle = 0;
    SILT_TRY(cloud_triangles(nodes, memory->dead, &triangle, &n_triangle, err));
    uint8_t *kept = silt_alloc((size_t)memory->n_cell + 1, 1), *was_wet = silt_alloc((size_t)nodes->count + 1, 1);
    for (int e = 0; e < memory->n_cell; e++)
        for (int a = 0; a < 3; a++)
            was_wet[memory->cell[e][a]] = 1;
    choose_cells(mesh, nodes, scene, barrier, memory, triangle, n_triangle, kept);
    book_volume(mesh, nodes, memory, kept, was_wet);
    free(triangle);
    free(kept);
    free(was_wet);

    silt_nodes_compact(nodes, memory->dead, map);
    for (int e = 0; e < mesh->n_cell; e++)
        for (int a = 0; a < 3; a++)
            mesh->cell[e][a] = map[mesh->cell[e][a]];
    silt_mesh_connect(mesh, nodes);
    return SILT_OK;
}
