// the first cloud: water in its regions, nodes on inlets and on the tank's corners
#include "pfem.h"

typedef struct seed {
    silt_nodes *nodes;
    const silt_scene *scene;
    const silt_walls *walls;
    silt_solid_test solid;
    const void *context;
    double h;
    int *grid, nx, ny; // cells of h, each with the last node put there, for spacing tests
    int *link;         // next node in the same grid cell
    int link_capacity;
    double lo[2];
} seed;

static int *seed_bin(const seed *s, int i, int j) {
    return i < 0 || j < 0 || i >= s->nx || j >= s->ny ? NULL : &s->grid[j * s->nx + i];
}

// true when a node lies closer than `gap`
static bool seed_crowded(const seed *s, const double *x, double gap) {
    const int ci = (int)floor((x[0] - s->lo[0]) / s->h), cj = (int)floor((x[1] - s->lo[1]) / s->h);
    for (int j = cj - 1; j <= cj + 1; j++)
        for (int i = ci - 1; i <= ci + 1; i++) {
            const int *bin = seed_bin(s, i, j);
            for (int k = bin ? *bin : -1; k >= 0; k = s->link[k])
                if (hypot(s->nodes->x[2 * k] - x[0], s->nodes->x[2 * k + 1] - x[1]) < gap)
                    return true;
        }
    return false;
}

static void seed_enter(seed *s, int k) {
    SILT_RESERVE(s->link, s->link_capacity, k + 1);
    const double *x = s->nodes->x + 2 * k;
    int *bin = seed_bin(s, (int)floor((x[0] - s->lo[0]) / s->h), (int)floor((x[1] - s->lo[1]) / s->h));
    s->link[k] = bin ? *bin : -1;
    if (bin)
        *bin = k;
}

static int seed_add(seed *s, silt_node_kind kind, int owner, const double *x) {
    const int k = silt_nodes_add(s->nodes, kind, owner, x);
    seed_enter(s, k);
    return k;
}

// a node on the tank's wall knows its segments; closer than a thousandth of h counts as on
static bool seed_on_walls(const seed *s, const double *x, int wall[2], double on[2]) {
    wall[0] = wall[1] = -1;
    on[0] = x[0];
    on[1] = x[1];
    for (int k = 0; k < s->walls->count; k++) {
        const double *a = s->walls->from[k], *b = s->walls->to[k], *n = s->walls->normal[k];
        const double dx = b[0] - a[0], dy = b[1] - a[1], length = hypot(dx, dy);
        const double along = ((x[0] - a[0]) * dx + (x[1] - a[1]) * dy) / length;
        const double off = (x[0] - a[0]) * n[0] + (x[1] - a[1]) * n[1];
        if (fabs(off) > 1e-3 * s->h || along < -1e-3 * s->h || along > length + 1e-3 * s->h)
            continue;
        if (wall[0] < 0)
            wall[0] = k;
        else if (wall[1] < 0 && fabs(s->walls->normal[wall[0]][0] * n[1] - s->walls->normal[wall[0]][1] * n[0]) > 0.3)
            wall[1] = k; // nearly straight joints hold nothing
        if (along < 1e-3 * s->h || along > length - 1e-3 * s->h)
            memcpy(on, along < 1e-3 * s->h ? a : b, 2 * sizeof *on);
        else
            for (int d = 0; d < 2; d++)
                on[d] = a[d] + along * (b[d] - a[d]) / length;
    }
    return wall[0] >= 0;
}

static void seed_water(seed *s, const double *x, double gap, double margin) {
    double on[2];
    int wall[2], nearest;
    const bool on_wall = seed_on_walls(s, x, wall, on);
    if (!on_wall && silt_walls_distance(s->walls, x, &nearest) < 0.25 * s->h && s->walls->count)
        return;
    if (s->solid && s->solid(s->context, on, margin))
        return;
    if (seed_crowded(s, on, gap))
        return;
    const int k = seed_add(s, NODE_FLUID, -1, on);
    s->nodes->wall[k][0] = wall[0];
    s->nodes->wall[k][1] = wall[1];
}

// the outline of a region as points
static int seed_outline(const silt_region *region, double h, double **xy) {
    double *corner = NULL;
    int n = 0;
    if (region->kind == REGION_BOX) {
        const double c[8] = {region->lo[0], region->lo[1], region->hi[0], region->lo[1],
                             region->hi[0], region->hi[1], region->lo[0], region->hi[1]};
        n = 4;
        corner = silt_alloc(8, sizeof *corner);
        memcpy(corner, c, sizeof c);
    } else if (region->kind == REGION_POLYGON) {
        n = region->n_point;
        corner = silt_alloc((size_t)(2 * n), sizeof *corner);
        for (int k = 0; k < n; k++)
            for (int d = 0; d < 2; d++)
                corner[2 * k + d] = region->point[3 * k + d];
    } else {
        n = (int)silt_max(8, ceil(2 * M_PI * region->radius / h));
        corner = silt_alloc((size_t)(2 * n), sizeof *corner);
        for (int k = 0; k < n; k++) {
            corner[2 * k] = region->centre[0] + region->radius * cos(2 * M_PI * k / n);
            corner[2 * k + 1] = region->centre[1] + region->radius * sin(2 * M_PI * k / n);
        }
    }
    const int count = silt_outline_points(n, corner, h, xy);
    free(corner);
    return count;
}

// true when the point lies inside another region, not on its rim
static bool seed_inside_other(const seed *s, int region, const double *x) {
    const silt_fluid_def *fluid = &s->scene->fluid;
    for (int r = 0; r < fluid->n_region; r++) {
        bool all = r != region;
        for (int k = 0; k < 8 && all; k++) {
            const double probe[3] = {x[0] + 1e-3 * s->h * cos(k * M_PI / 4), x[1] + 1e-3 * s->h * sin(k * M_PI / 4), 0};
            all = silt_region_contains(&fluid->region[r], probe);
        }
        if (all)
            return true;
    }
    return false;
}

// two regions that share a piece of outline: the piece lies inside their union
static bool seed_inside_union(const seed *s, const double *x) {
    const silt_fluid_def *fluid = &s->scene->fluid;
    for (int k = 0; k < 8; k++) {
        const double angle = (k + 0.37) * M_PI / 4;
        const double probe[3] = {x[0] + 1e-3 * s->h * cos(angle), x[1] + 1e-3 * s->h * sin(angle), 0};
        bool in = false;
        for (int r = 0; r < fluid->n_region && !in; r++)
            in = silt_region_contains(&fluid->region[r], probe);
        if (!in)
            return false;
    }
    return true;
}

static void seed_region(seed *s, int r, const double lo[2], const double hi[2], uint64_t *random) {
    const silt_fluid_def *fluid = &s->scene->fluid;
    const double h = s->h, row = h * sqrt(3) / 2;
    // rows that fill the region's height evenly, so that the lattice meets the outline well
    const int n_row = (int)silt_max(1, floor((hi[1] - lo[1]) / row + 0.5));
    const double dy = (hi[1] - lo[1]) / n_row;
    for (int j = 0; j <= n_row; j++) {
        const int n_column = (int)silt_max(1, floor((hi[0] - lo[0]) / h + 0.5));
        const double dx = (hi[0] - lo[0]) / n_column;
        for (int i = 0; i <= n_column; i++) {
            double x[3] = {lo[0] + (i + (j % 2 ? 0.5 : 0)) * dx, lo[1] + j * dy, 0};
            if (fluid->jitter > 0)
                for (int d = 0; d < 2; d++)
                    x[d] += fluid->jitter * h * (2 * silt_uniform(random) - 1);
            if (!silt_region_contains(&fluid->region[r], x))
                continue;
            int nearest;
            if (silt_walls_distance(s->walls, x, &nearest) < 0.4 * h)
                continue;
            if (s->solid && s->solid(s->context, x, 0.5 * h))
                continue;
            if (seed_crowded(s, x, 0.6 * h))
                continue;
            seed_add(s, NODE_FLUID, -1, x);
        }
    }
}

// where inlets stand: nodes at spacing h on the segment
static void seed_inlets(seed *s) {
    for (int k = 0; k < s->scene->fluid.n_inlet; k++) {
        const silt_inlet *inlet = &s->scene->fluid.inlet[k];
        const double length = hypot(inlet->to[0] - inlet->from[0], inlet->to[1] - inlet->from[1]);
        const int pieces = (int)silt_max(1, floor(length / s->h + 0.5));
        for (int m = 0; m <= pieces; m++) {
            const double x[2] = {inlet->from[0] + (inlet->to[0] - inlet->from[0]) * m / pieces,
                                 inlet->from[1] + (inlet->to[1] - inlet->from[1]) * m / pieces};
            if (seed_crowded(s, x, 1e-6 * s->h) || (s->solid && s->solid(s->context, x, -1e-6 * s->h)))
                continue;
            seed_add(s, NODE_INLET, k, x);
        }
    }
}

// corners of the tank that point into the water
static void seed_corners(seed *s) {
    double *point;
    int(*element)[3];
    const int n = silt_walls_ridges(s->walls, s->h, &point, &element);
    for (int k = 0; k < n; k++)
        if (!seed_crowded(s, point + 3 * k, 1e-6 * s->h))
            seed_add(s, NODE_CORNER, element[k][0], point + 3 * k);
    free(point);
    free(element);
}

void silt_nodes_seed(silt_nodes *nodes, const silt_scene *scene, const silt_walls *walls, silt_solid_test solid,
                     const void *context) {
    const silt_fluid_def *fluid = &scene->fluid;
    seed s = {.nodes = nodes, .scene = scene, .walls = walls, .solid = solid, .context = context, .h = fluid->size};
    // the box of everything that may be seeded
    double lo[2] = {HUGE_VAL, HUGE_VAL}, hi[2] = {-HUGE_VAL, -HUGE_VAL};
    double *outline[fluid->n_region ? fluid->n_region : 1];
    int n_outline[fluid->n_region ? fluid->n_region : 1];
    for (int r = 0; r < fluid->n_region; r++) {
        n_outline[r] = seed_outline(&fluid->region[r], fluid->size, &outline[r]);
        for (int k = 0; k < n_outline[r]; k++)
            for (int d = 0; d < 2; d++) {
                lo[d] = silt_min(lo[d], outline[r][2 * k + d]);
                hi[d] = silt_max(hi[d], outline[r][2 * k + d]);
            }
    }
    for (int k = 0; k < walls->count; k++)
        for (int d = 0; d < 2; d++) {
            lo[d] = silt_min(lo[d], walls->from[k][d]);
            hi[d] = silt_max(hi[d], walls->from[k][d]);
        }
    if (lo[0] > hi[0])
        return;
    for (int d = 0; d < 2; d++)
        s.lo[d] = lo[d] - s.h;
    s.nx = (int)((hi[0] - lo[0]) / s.h) + 4;
    s.ny = (int)((hi[1] - lo[1]) / s.h) + 4;
    s.grid = silt_alloc((size_t)s.nx * (size_t)s.ny, sizeof *s.grid);
    for (int k = 0; k < s.nx * s.ny; k++)
        s.grid[k] = -1;
    for (int k = 0; k < nodes->count; k++)
        seed_enter(&s, k);

    // fixed things first, then outlines, then the inside
    seed_inlets(&s);
    seed_corners(&s);
    uint64_t random = (uint64_t)fluid->seed;
    for (int r = 0; r < fluid->n_region; r++)
        for (int k = 0; k < n_outline[r]; k++)
            if (!seed_inside_other(&s, r, outline[r] + 2 * k) && !seed_inside_union(&s, outline[r] + 2 * k))
                seed_water(&s, outline[r] + 2 * k, 0.35 * s.h, 0.35 * s.h);
    for (int r = 0; r < fluid->n_region; r++) {
        double a[2] = {HUGE_VAL, HUGE_VAL}, b[2] = {-HUGE_VAL, -HUGE_VAL};
        for (int k = 0; k < n_outline[r]; k++)
            for (int d = 0; d < 2; d++) {
                a[d] = silt_min(a[d], outline[r][2 * k + d]);
                b[d] = silt_max(b[d], outline[r][2 * k + d]);
            }
        seed_region(&s, r, a, b, &random);
        free(outline[r]);
    }
    free(s.grid);
    free(s.link);

    // initial velocity
    const double g = sqrt(silt_square(scene->gravity[0]) + silt_square(scene->gravity[1]));
    for (int i = 0; i < nodes->count; i++) {
        if (nodes->kind[i] != NODE_FLUID || fluid->velocity.kind == FORMULA_NONE)
            continue;
        double v[3] = {0}, x[3] = {nodes->x[2 * i], nodes->x[2 * i + 1], 0};
        silt_formula_velocity(&fluid->velocity, g, x, v);
        nodes->v[2 * i] = v[0];
        nodes->v[2 * i + 1] = v[1];
    }
}
