// suspend.c: the random walk of suspended grains in eddies that the water's mesh does not show
#include "state.h"

static const double touching = 0.01; // of the weight: a grain that contacts carry more of is not suspended

// eddy diffusivity at the nodes, m2/s: the mean of the cells around by their size
static void suspend_diffusivity(silt_coupling *c, const silt_nodes *nodes, const silt_mesh *mesh, const double *viscosity) {
    const silt_fluid_def *fluid = &c->scene->fluid;
    const int D = c->dim;
    SILT_RESERVE(c->eddy, c->eddy_capacity, 2 * mesh->n_node + 2);
    memset(c->eddy, 0, 2 * (size_t)mesh->n_node * sizeof *c->eddy);
    for (int e = 0; e < mesh->n_cell; e++) {
        const double size = silt_cell_volume(mesh, nodes->x, e);
        const double eddy = silt_max(viscosity[e] - fluid->viscosity, 0.0) / fluid->density / c->scene->grains.schmidt;
        for (int a = 0; a <= D; a++) {
            c->eddy[2 * mesh->cell[e][a]] += size * eddy;
            c->eddy[2 * mesh->cell[e][a] + 1] += size;
        }
    }
}

static double suspend_eddy(const silt_coupling *c, int node) {
    return c->eddy[2 * node + 1] > 0.0 ? c->eddy[2 * node] / c->eddy[2 * node + 1] : 0.0;
}

// gradient of the diffusivity in a cell, and its value at the weights
static double suspend_slope(const silt_coupling *c, const silt_mesh *mesh, const double *x, const int *cell, const double *weight,
                            double slope[3]) {
    const int D = c->dim;
    double corner[12], m[3][3] = {{0.0}}, right[3] = {0.0}, value = 0.0;
    silt_cell_corners(mesh, x, cell, corner);
    for (int a = 0; a <= D; a++)
        value += weight[a] * suspend_eddy(c, cell[a]);
    for (int a = 0; a < D; a++) {
        right[a] = suspend_eddy(c, cell[a + 1]) - suspend_eddy(c, cell[0]);
        for (int d = 0; d < D; d++)
            m[a][d] = corner[D * (a + 1) + d] - corner[d];
    }
    if (D == 2)
        m[2][2] = 1.0;
    // Cramer
    const double minor[3] = {m[1][1] * m[2][2] - m[1][2] * m[2][1], m[1][2] * m[2][0] - m[1][0] * m[2][2],
                             m[1][0] * m[2][1] - m[1][1] * m[2][0]};
    const double det = m[0][0] * minor[0] + m[0][1] * minor[1] + m[0][2] * minor[2];
    for (int k = 0; k < 3; k++) {
        double n[3][3];
        memcpy(n, m, sizeof n);
        for (int a = 0; a < 3; a++)
            n[a][k] = right[a];
        slope[k] = (n[0][0] * (n[1][1] * n[2][2] - n[1][2] * n[2][1]) + n[0][1] * (n[1][2] * n[2][0] - n[1][0] * n[2][2]) +
                    n[0][2] * (n[1][0] * n[2][1] - n[1][1] * n[2][0])) / det;
    }
    return silt_max(value, 0.0);
}

// ---------------------------------------------------------------- room: grains in squares of the plane's first two directions

typedef struct suspend_grid {
    double lo[2], size;
    int n[2], *head, *next; // next: one per grain
} suspend_grid;

// the bin's place along direction d; those beyond the rim count to the rim's
static int suspend_place(const suspend_grid *grid, int d, double x) {
    return (int)silt_clamp(floor((x - grid->lo[d]) / grid->size), 0.0, grid->n[d] - 1.0);
}

static int suspend_bin(const suspend_grid *grid, const double *x) {
    return suspend_place(grid, 1, x[1]) * grid->n[0] + suspend_place(grid, 0, x[0]);
}

static void suspend_link(suspend_grid *grid, int i, const double *x) {
    const int bin = suspend_bin(grid, x);
    grid->next[i] = grid->head[bin];
    grid->head[bin] = i;
}

static void suspend_move(suspend_grid *grid, int i, const double *from, const double *to) {
    int *at = &grid->head[suspend_bin(grid, from)];
    while (*at != i)
        at = &grid->next[*at];
    *at = grid->next[i];
    suspend_link(grid, i, to);
}

static void suspend_grid_open(suspend_grid *grid, const silt_coupling *c) {
    double hi[2] = {-HUGE_VAL, -HUGE_VAL}, widest = 0.0;
    grid->lo[0] = grid->lo[1] = HUGE_VAL;
    for (int i = 0; i < c->n_grain; i++) {
        widest = silt_max(widest, 2.0 * c->grain[i].radius);
        for (int d = 0; d < 2; d++) {
            grid->lo[d] = silt_min(grid->lo[d], c->grain[i].x[d]);
            hi[d] = silt_max(hi[d], c->grain[i].x[d]);
        }
    }
    grid->size = widest;
    while ((hi[0] - grid->lo[0]) / grid->size * ((hi[1] - grid->lo[1]) / grid->size) > 4.0 * c->n_grain + 64)
        grid->size *= 1.5;
    for (int d = 0; d < 2; d++)
        grid->n[d] = (int)((hi[d] - grid->lo[d]) / grid->size) + 1;
    grid->head = silt_alloc((size_t)grid->n[0] * (size_t)grid->n[1], sizeof *grid->head);
    grid->next = silt_alloc((size_t)c->n_grain + 1, sizeof *grid->next);
    memset(grid->head, -1, (size_t)grid->n[0] * (size_t)grid->n[1] * sizeof *grid->head);
    for (int i = c->n_grain - 1; i >= 0; i--)
        suspend_link(grid, i, c->grain[i].x);
}

// grain i would touch none at x, or at an image of it; those that have walked already stand where they went
static bool suspend_clear(const suspend_grid *grid, const silt_coupling *c, int i, const double *x) {
    int from[2], to[2];
    for (int d = 0; d < 2; d++) {
        from[d] = suspend_place(grid, d, x[d] - grid->size);
        to[d] = suspend_place(grid, d, x[d] + grid->size);
    }
    for (int row = from[1]; row <= to[1]; row++)
        for (int bin = row * grid->n[0] + from[0]; bin <= row * grid->n[0] + to[0]; bin++)
            for (int k = grid->head[bin]; k >= 0; k = grid->next[k]) {
                double square = 0.0;
                for (int d = 0; d < c->dim; d++)
                    square += silt_square(c->grain[k].x[d] + c->shift[3 * k + d] - x[d]);
                if (k != i && square < silt_square(c->grain[k].radius + c->grain[i].radius))
                    return false;
            }
    return true;
}

static double suspend_period(const silt_coupling *c) {
    return silt_max(c->scene->period[1] - c->scene->period[0], 0.0);
}

// the same across the ends of a period
static bool suspend_room(const suspend_grid *grid, const silt_coupling *c, int i, const double *x) {
    const double period = suspend_period(c);
    for (int image = period > 0.0 ? -1 : 0; image <= (period > 0.0 ? 1 : 0); image++) {
        const double at[3] = {x[0] + image * period, x[1], x[2]};
        if (!suspend_clear(grid, c, i, at))
            return false;
    }
    return true;
}

// ---------------------------------------------------------------- the walk

static double suspend_normal(uint64_t *random) {
    const double u = 1.0 - silt_uniform(random), v = silt_uniform(random);
    return sqrt(-2.0 * log(u)) * cos(2.0 * M_PI * v);
}

// where a grain goes from x: drift K' dt, then sqrt(2 K dt) times a normal number with K half a drift on (Visser 1997); a wall
// throws it back. @return false: out of the water
static bool suspend_step(silt_coupling *c, const silt_nodes *nodes, const silt_mesh *mesh, const coupling_grain *g, const int *cell,
                         const double *weight, double dt, uint64_t random, double to[3]) {
    const int D = c->dim;
    double slope[3], where[4], way = 0.0;
    double eddy = suspend_slope(c, mesh, nodes->x, cell, weight, slope);
    for (int d = 0; d < D; d++)
        way += 0.5 * dt * slope[d] * slope[d];
    eddy = silt_max(eddy + way, 0.0);
    for (int d = 0; d < D; d++)
        to[d] = g->x[d] + slope[d] * dt + sqrt(2.0 * eddy * dt) * suspend_normal(&random);
    for (int tries = 0; tries < 3; tries++) {
        int element;
        double image[3] = {to[0], to[1], to[2]};
        if (suspend_period(c) > 0.0) // walls end where the period does
            image[0] -= suspend_period(c) * floor((to[0] - c->scene->period[0]) / suspend_period(c));
        const double inside = silt_walls_distance(c->walls, image, &element) - g->radius;
        if (element < 0 || inside >= 0.0)
            break;
        for (int d = 0; d < D; d++)
            to[d] -= 2.0 * inside * c->walls->normal[element][d];
    }
    return silt_locate(&c->locator, mesh, nodes->x, to, where) >= 0;
}

void silt_coupling_walk(silt_coupling *c, const silt_nodes *nodes, const silt_mesh *mesh, const double *viscosity, double dt, int64_t step) {
    const silt_scene *scene = c->scene;
    const double g = silt_length(3, scene->gravity);
    suspend_grid grid = {0};
    c->walks = scene->grains.random_walk && c->wet;
    if (!c->walks)
        return;
    SILT_RESERVE(c->shift, c->shift_capacity, 3 * c->n_grain + 3);
    memset(c->shift, 0, 3 * (size_t)c->n_grain * sizeof *c->shift);
    suspend_diffusivity(c, nodes, mesh, viscosity);
    suspend_grid_open(&grid, c);
    silt_locator_build(&c->locator, mesh, nodes->x, scene->fluid.size);
    for (int i = 0; i < c->n_grain && i < c->n_loaded; i++) {
        coupling_grain *p = &c->grain[i];
        const silt_exchange_grain *e = &c->exchange.grain[i];
        const bool rests = silt_length(c->dim, p->contact) > touching * p->mass * g;
        if (p->gone || p->fixed || e->cell < 0 || (rests && !scene->grains.pick_up))
            continue;
        uint64_t random = silt_hash(0, &scene->fluid.seed, sizeof scene->fluid.seed);
        random = silt_hash(silt_hash(random, &step, sizeof step), &p->id, sizeof p->id);
        double to[3] = {0.0};
        if (!suspend_step(c, nodes, mesh, p, mesh->cell[e->cell], e->weight, dt, random, to) || !suspend_room(&grid, c, i, to))
            continue;
        for (int d = 0; d < c->dim; d++)
            c->shift[3 * i + d] = to[d] - p->x[d];
        suspend_move(&grid, i, p->x, to);
    }
    free(grid.head);
    free(grid.next);
}

// in the order of the last state, as the torques are
void silt_coupling_shift(silt_coupling *c) {
    if (!c->walks)
        return;
    SILT_RESERVE(c->walk, c->walk_capacity, 3 * c->n_last + 3);
    memset(c->walk, 0, 3 * (size_t)c->n_last * sizeof *c->walk);
    for (int i = 0, k = 0; i < c->n_grain; i++) {
        while (k < c->n_last && c->last[k] < c->grain[i].id)
            k++;
        if (k < c->n_last && c->last[k] == c->grain[i].id)
            memcpy(c->walk + 3 * k, c->shift + 3 * i, 3 * sizeof *c->walk);
    }
    silt_dem_shift(c->dem, c->walk);
    c->walks = false;
}
