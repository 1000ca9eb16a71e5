// the first cloud: water in its regions, nodes on inlets and on the tank's corners
#include "seed.h"

double seed_h(const seed *s, const double *x) {
    return silt_size_at(s->size, s->scene, x);
}

double seed_apart(const seed *s, const double *a, const double *b) {
    double d[3] = {0};
    for (int c = 0; c < s->dim; c++)
        d[c] = a[c] - b[c];
    if (s->period > 0)
        d[0] -= s->period * floor(d[0] / s->period + 0.5);
    return s->dim == 3 ? sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]) : hypot(d[0], d[1]);
}

static int seed_bin(const seed *s, int d, double x) {
    return d < s->dim ? (int)silt_clamp(floor((x - s->lo[d]) / s->width), -1, s->bin[d]) : 0;
}

int seed_near(const seed *s, const double *x, double reach, int room, int *list) {
    int n = 0, lo[3], hi[3];
    for (int image = s->period > 0 ? -1 : 0; image <= (s->period > 0 ? 1 : 0); image++) {
        for (int d = 0; d < 3; d++) {
            const double at = d < s->dim ? x[d] + (d == 0 ? image * s->period : 0) : 0;
            lo[d] = (int)silt_max(seed_bin(s, d, at - reach), 0);
            hi[d] = (int)silt_min(seed_bin(s, d, at + reach), s->bin[d] - 1);
        }
        for (int k = lo[2]; k <= hi[2]; k++)
            for (int j = lo[1]; j <= hi[1]; j++)
                for (int i = lo[0]; i <= hi[0]; i++)
                    for (int m = s->grid[(k * s->bin[1] + j) * s->bin[0] + i]; m >= 0 && n < room; m = s->link[m])
                        if (seed_apart(s, s->nodes->x + s->dim * m, x) < reach)
                            list[n++] = m;
    }
    return n;
}

bool seed_crowded(const seed *s, const double *x, double gap) {
    int one;
    return seed_near(s, x, gap, 1, &one) > 0;
}

void seed_enter(seed *s, int k) {
    SILT_RESERVE(s->link, s->link_capacity, k + 1);
    int at[3];
    bool in = true;
    for (int d = 0; d < 3; d++) {
        at[d] = d < s->dim ? seed_bin(s, d, s->nodes->x[s->dim * k + d]) : 0;
        in &= at[d] >= 0 && at[d] < s->bin[d];
    }
    int *bin = in ? &s->grid[(at[2] * s->bin[1] + at[1]) * s->bin[0] + at[0]] : NULL;
    s->link[k] = bin ? *bin : -1;
    if (bin)
        *bin = k;
}

void seed_sort(seed *s) {
    for (int k = 0; k < s->bin[0] * s->bin[1] * s->bin[2]; k++)
        s->grid[k] = -1;
    for (int k = 0; k < s->nodes->count; k++)
        seed_enter(s, k);
}

int seed_add(seed *s, silt_node_kind kind, int owner, const double *x) {
    const int k = silt_nodes_add(s->nodes, kind, owner, x);
    seed_enter(s, k);
    return k;
}

// a periodic place between both ends
static void seed_wrap(const seed *s, double *x) {
    if (s->period <= 0)
        return;
    x[0] -= s->period * floor((x[0] - s->scene->period[0]) / s->period);
    if (x[0] > s->scene->period[1] - 1e-9 * s->h)
        x[0] = s->scene->period[0];
}

// a node on an opening: of prescribed velocity, or with a level behind it, which knows the walls beside it
static void seed_opening(seed *s, int opening, const double *x) {
    const silt_opening o = silt_opening_of(s->scene, opening);
    double on[3], at[3] = {0};
    memcpy(at, x, (size_t)s->dim * sizeof *at);
    const double height = silt_opening_height(&o, at);
    for (int d = 0; d < s->dim; d++)
        at[d] -= height * o.normal[d];
    const int k = seed_add(s, o.level ? NODE_OPEN : NODE_INLET, opening, at);
    if (o.level && s->walls->count)
        silt_walls_touching(s->walls, at, 1e-3 * s->h, s->nodes->wall[k], on);
}

// a node on the tank's wall knows its elements; closer than a thousandth of h counts as on
void seed_water(seed *s, const double *x, double gap, double margin) {
    double on[3] = {0}, at[3] = {0};
    int wall[3] = {-1, -1, -1}, nearest;
    memcpy(at, x, (size_t)s->dim * sizeof *at);
    seed_wrap(s, at);
    memcpy(on, at, sizeof on);
    const double h = s->size ? seed_h(s, at) : s->h;
    const bool on_wall = s->walls->count && silt_walls_touching(s->walls, at, 1e-3 * s->h, wall, on) > 0;
    if (!on_wall && silt_walls_distance(s->walls, at, &nearest) < 0.25 * h && s->walls->count)
        return;
    if (s->solid && s->solid(s->context, on, margin))
        return;
    if (seed_crowded(s, on, gap))
        return;
    const int opening = silt_opening_on(s->scene, on, 1e-3 * s->h, s->dim == 3);
    if (opening >= 0)
        seed_opening(s, opening, on);
    else {
        const int k = seed_add(s, NODE_FLUID, -1, on);
        memcpy(s->nodes->wall[k], wall, sizeof wall);
    }
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

// a place a little off in direction k of 8 (14 in space)
static void seed_probe(const seed *s, const double *x, int k, double angle, double probe[3]) {
    static const double corner[14][3] = {{1, 0, 0},  {-1, 0, 0}, {0, 1, 0},   {0, -1, 0}, {0, 0, 1},   {0, 0, -1},  {1, 1, 1},
                                         {-1, 1, 1}, {1, -1, 1}, {-1, -1, 1}, {1, 1, -1}, {-1, 1, -1}, {1, -1, -1}, {-1, -1, -1}};
    if (s->dim == 3) { // tilted by `angle`, so that none lies in a face
        for (int d = 0; d < 3; d++)
            probe[d] = x[d] + 1e-3 * s->h * (corner[k][d] + angle * (0.31 * corner[k][(d + 1) % 3] - 0.17 * corner[k][(d + 2) % 3]));
    } else {
        probe[0] = x[0] + 1e-3 * s->h * cos((k + angle) * M_PI / 4);
        probe[1] = x[1] + 1e-3 * s->h * sin((k + angle) * M_PI / 4);
        probe[2] = 0;
    }
    seed_wrap(s, probe);
}

// true when the point lies inside another region, not on its rim
static bool seed_inside_other(const seed *s, int region, const double *x) {
    for (int r = 0; r < s->scene->fluid.n_region; r++) {
        bool all = r != region;
        for (int k = 0; k < (s->dim == 3 ? 14 : 8) && all; k++) {
            double probe[3];
            seed_probe(s, x, k, 0, probe);
            all = silt_region_contains(&s->scene->fluid.region[r], probe);
        }
        if (all)
            return true;
    }
    return false;
}

// two regions that share a piece of outline: the piece lies inside their union
static bool seed_inside_union(const seed *s, const double *x) {
    for (int k = 0; k < (s->dim == 3 ? 14 : 8); k++) {
        double probe[3];
        seed_probe(s, x, k, 0.37, probe);
        bool in = false;
        for (int r = 0; r < s->scene->fluid.n_region && !in; r++)
            in = silt_region_contains(&s->scene->fluid.region[r], probe);
        if (!in)
            return false;
    }
    return true;
}

bool seed_open(const seed *s, int region, const double *x) {
    return !seed_inside_other(s, region, x) && !seed_inside_union(s, x);
}

// the plane's lattice
static void seed_region(seed *s, int r, const double lo[2], const double hi[2]) {
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
                    x[d] += fluid->jitter * h * (2 * silt_uniform(&s->random) - 1);
            if (!silt_region_contains(&fluid->region[r], x))
                continue;
            seed_wrap(s, x);
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
    for (int k = 0; k < s->scene->fluid.n_inlet && s->dim == 2; k++) {
        const silt_inlet *inlet = &s->scene->fluid.inlet[k];
        if (inlet->drive == INLET_HEAD)
            continue; // see seed_rims
        const double length = hypot(inlet->to[0] - inlet->from[0], inlet->to[1] - inlet->from[1]);
        double h = s->h;
        for (int m = 0; m <= 8 && s->size; m++) {
            const double x[2] = {inlet->from[0] + (inlet->to[0] - inlet->from[0]) * m / 8,
                                 inlet->from[1] + (inlet->to[1] - inlet->from[1]) * m / 8};
            h = m ? silt_min(h, seed_h(s, x)) : seed_h(s, x);
        }
        const int pieces = (int)silt_max(1, floor(length / h + 0.5));
        for (int m = 0; m <= pieces; m++) {
            const double x[2] = {inlet->from[0] + (inlet->to[0] - inlet->from[0]) * m / pieces,
                                 inlet->from[1] + (inlet->to[1] - inlet->from[1]) * m / pieces};
            if (seed_crowded(s, x, 1e-6 * s->h) || (s->solid && s->solid(s->context, x, -1e-6 * s->h)))
                continue;
            seed_add(s, NODE_INLET, k, x);
        }
    }
}

// true when there is water before the opening at the share t of its edge from p to q
static bool seed_wet(const seed *s, const silt_opening *o, const double *p, const double *q, double t) {
    double x[3] = {0}, in[3] = {0};
    const double off = 1e-7 * o->size;
    for (int d = 0; d < s->dim; d++)
        x[d] = p[d] + t * (q[d] - p[d]) + off * o->normal[d];
    // off the edge into the opening: a rim may stand on a wall
    for (int d = 0; d < 3 && s->dim == 3; d++) {
        const int e = (d + 1) % 3, f = (d + 2) % 3;
        in[d] = o->normal[e] * (q[f] - p[f]) - o->normal[f] * (q[e] - p[e]);
    }
    const double length = silt_length(3, in);
    for (int d = 0; d < 3 && length > 0; d++)
        x[d] += off * in[d] / length;
    for (int r = 0; r < s->scene->fluid.n_region; r++)
        if (silt_region_contains(&s->scene->fluid.region[r], x))
            return true;
    return false;
}

// nodes at spacing h on a part of an edge of an opening's rim
static void seed_rim_part(seed *s, int opening, const double *p, const double *q, double from, double to) {
    double length = 0;
    for (int d = 0; d < s->dim; d++)
        length = hypot(length, (to - from) * (q[d] - p[d]));
    const int pieces = s->dim == 3 ? (int)silt_max(1, floor(length / s->h + 0.5)) : 1;
    for (int m = 0; m <= pieces; m++) {
        double x[3] = {0};
        const double t = m == pieces ? to : from + (to - from) * m / pieces;
        for (int d = 0; d < s->dim; d++)
            x[d] = t == 1 ? q[d] : p[d] + (q[d] - p[d]) * t;
        if (!seed_crowded(s, x, 1e-3 * s->h))
            seed_opening(s, opening, x);
    }
}

// The rims of openings with a level and of all openings in space, before the water's outline gives them their other nodes. Where
// no water stands an opening with a level has none.
static void seed_rims(seed *s) {
    enum { SAMPLES = 256 };
    for (int k = 0; k < silt_opening_count(s->scene); k++) {
        const silt_opening o = silt_opening_of(s->scene, k);
        const int n = s->dim == 3 ? o.n_corner : 1;
        for (int c = 0; c < n && (o.level || (o.inlet && s->dim == 3)); c++) {
            const double *p = s->dim == 3 ? o.corner + 3 * c : o.from, *q = s->dim == 3 ? o.corner + 3 * ((c + 1) % n) : o.to;
            double from = 0;
            bool before = false;
            for (int m = 0; m <= SAMPLES; m++) {
                // the ends themselves lie on walls, water may begin a hair inside of them
                const double t = silt_clamp((double)m / SAMPLES, 1e-6, 1 - 1e-6);
                const bool wet = !o.level || seed_wet(s, &o, p, q, t);
                double low = (m - 1.0) / SAMPLES, high = t;
                for (int half = 0; half < 60 && m && wet != before; half++) {
                    const double middle = 0.5 * (low + high);
                    *(seed_wet(s, &o, p, q, middle) == before ? &low : &high) = middle;
                }
                if (wet && !before)
                    from = m ? high : 0;
                else if (!wet && before)
                    seed_rim_part(s, k, p, q, from, low);
                if (wet && m == SAMPLES)
                    seed_rim_part(s, k, p, q, from, 1);
                before = wet;
            }
        }
    }
}

// in space: what no water stands before yet of an inlet with a prescribed velocity
static void seed_dry_inlets(seed *s) {
    for (int k = 0; k < s->scene->fluid.n_inlet && s->dim == 3; k++) {
        const silt_opening o = silt_opening_of(s->scene, k);
        double u[3], v[3], length = 0;
        for (int d = 0; d < 3; d++)
            length = hypot(length, u[d] = o.corner[3 + d] - o.corner[d]);
        for (int d = 0; d < 3; d++)
            v[d] = (o.normal[(d + 1) % 3] * u[(d + 2) % 3] - o.normal[(d + 2) % 3] * u[(d + 1) % 3]) / length;
        const int n = (int)ceil(o.size / s->h) + 1;
        for (int j = -n; j <= n && !o.level; j++)
            for (int i = -n; i <= n; i++) {
                double x[3];
                for (int d = 0; d < 3; d++)
                    x[d] = o.corner[d] + (i + 0.5 * (j & 1)) * s->h * u[d] / length + j * s->h * sqrt(0.75) * v[d];
                if (silt_opening_depth(&o, x) > 0.5 * s->h && !seed_crowded(s, x, 0.75 * s->h))
                    seed_opening(s, k, x);
            }
    }
}

// corners of the tank that point into the water
static void seed_corners(seed *s) {
    double *point, finest = s->h;
    int(*element)[3];
    for (int r = 0; r < s->scene->fluid.n_size; r++)
        finest = silt_min(finest, s->scene->fluid.size_at[r].size);
    const int n = silt_walls_ridges(s->walls, finest, &point, &element);
    // corners in any case, along edges what the size field leaves
    for (int pass = 0; pass < 2; pass++)
        for (int k = 0; k < n; k++) {
            const double *x = point + 3 * k;
            const bool corner = element[k][2] >= 0 || s->dim == 2 || !s->size;
            // in space the bed has nodes of its own on them
            if (s->dim == 3 && s->solid && s->solid(s->context, x, -1))
                continue;
            if (corner == (pass == 0) && !seed_crowded(s, x, corner ? 1e-6 * s->h : 0.75 * seed_h(s, x)))
                seed_add(s, NODE_CORNER, element[k][0], x);
        }
    free(point);
    free(element);
}

// bins over everything that may be seeded; finest: the smallest distance
static bool seed_start(seed *s, silt_nodes *nodes, const silt_scene *scene, const silt_walls *walls, silt_solid_test solid,
                       const void *context) {
    const silt_fluid_def *fluid = &scene->fluid;
    *s = (seed){.nodes = nodes, .scene = scene, .walls = walls, .solid = solid, .context = context, .h = fluid->size};
    s->dim = scene->dimension == 3 ? 3 : 2;
    s->period = silt_max(scene->period[1] - scene->period[0], 0);
    s->random = (uint64_t)fluid->seed;
    nodes->dim = s->dim;
    for (int d = 0; d < 3; d++) {
        s->lo[d] = HUGE_VAL;
        s->hi[d] = -HUGE_VAL;
    }
    for (int r = 0; r < fluid->n_region; r++) {
        double lo[3], hi[3];
        silt_region_bounds(&fluid->region[r], lo, hi);
        for (int d = 0; d < s->dim; d++) {
            s->lo[d] = silt_min(s->lo[d], lo[d]);
            s->hi[d] = silt_max(s->hi[d], hi[d]);
        }
    }
    for (int k = 0; k < walls->count; k++)
        for (int c = 0; c < s->dim; c++)
            for (int d = 0; d < s->dim; d++) {
                const double x = s->dim == 3 ? walls->corner[k][c][d] : c ? walls->to[k][d] : walls->from[k][d];
                s->lo[d] = silt_min(s->lo[d], x);
                s->hi[d] = silt_max(s->hi[d], x);
            }
    if (s->lo[0] > s->hi[0])
        return false;
    // between the finest and the coarsest distance, and not more bins than memory has room for
    double finest = s->h;
    for (int r = 0; r < fluid->n_size; r++)
        finest = silt_min(finest, fluid->size_at[r].size);
    s->width = sqrt(finest * s->h);
    for (double bins = HUGE_VAL; bins > 2e7; s->width *= bins > 2e7 ? 1.3 : 1) {
        bins = 1;
        for (int d = 0; d < 3; d++)
            bins *= s->bin[d] = d < s->dim ? (int)((s->hi[d] - s->lo[d]) / s->width) + 4 : 1;
    }
    for (int d = 0; d < s->dim; d++)
        s->lo[d] -= s->width;
    s->grid = silt_alloc((size_t)(s->bin[0] * s->bin[1] * s->bin[2]), sizeof *s->grid);
    seed_sort(s);

    for (int i = 0; i < nodes->count; i++)
        s->on_bed |= nodes->kind[i] == NODE_BED;
    silt_size_create(&s->size, scene, walls);
    if (!s->size)
        return true;
    // bodies and bed stand already; the surface is the outline that no wall holds
    for (int i = 0; i < nodes->count; i++)
        if (nodes->kind[i] == NODE_BED || nodes->kind[i] == NODE_BODY)
            silt_size_near(s->size, nodes->kind[i] == NODE_BED ? NEAR_BED : NEAR_BODIES, 1, nodes->x + s->dim * i);
    for (int r = 0; r < fluid->n_region; r++) {
        double *x;
        const int n = seed_outline_samples(s, r, finest, &x);
        int free_points = 0;
        for (int k = 0; k < n; k++) {
            int element;
            if (fabs(silt_walls_distance(walls, x + s->dim * k, &element)) > 1e-3 * s->h && seed_open(s, r, x + s->dim * k))
                memmove(x + s->dim * free_points++, x + s->dim * k, (size_t)s->dim * sizeof *x);
        }
        silt_size_near(s->size, NEAR_SURFACE, free_points, x);
        free(x);
    }
    return true;
}

static void seed_end(seed *s) {
    silt_size_free(&s->size);
    free(s->grid);
    free(s->link);
}

static void seed_velocity(seed *s, int first) {
    const silt_scene *scene = s->scene;
    silt_nodes *nodes = s->nodes;
    const double g = silt_length(3, scene->gravity);
    for (int i = first; i < nodes->count; i++) {
        // water that slips on the bed moves with the rest
        const bool slips = nodes->kind[i] == NODE_BED && scene->bed.condition != WALL_NO_SLIP;
        if ((nodes->kind[i] != NODE_FLUID && nodes->kind[i] != NODE_OPEN && !slips) || scene->fluid.velocity.kind == FORMULA_NONE)
            continue;
        double v[3] = {0}, x[3] = {0};
        memcpy(x, nodes->x + s->dim * i, (size_t)s->dim * sizeof *x);
        silt_formula_velocity(&scene->fluid.velocity, g, x, v);
        memcpy(nodes->v + s->dim * i, v, (size_t)s->dim * sizeof *v);
    }
}

static void seed_sizes(seed *s) {
    silt_nodes *nodes = s->nodes;
    if (!s->size)
        return;
    if (!nodes->h)
        nodes->h = silt_alloc((size_t)silt_max(nodes->capacity, 1), sizeof *nodes->h);
    for (int i = 0; i < nodes->count; i++)
        nodes->h[i] = seed_h(s, nodes->x + s->dim * i);
}

void silt_nodes_seed(silt_nodes *nodes, const silt_scene *scene, const silt_walls *walls, silt_solid_test solid,
                     const void *context) {
    const silt_fluid_def *fluid = &scene->fluid;
    seed s;
    if (!seed_start(&s, nodes, scene, walls, solid, context))
        return;
    // fixed things first, then outlines, then the inside
    seed_inlets(&s);
    seed_rims(&s);
    seed_corners(&s);
    if (s.dim == 3 || s.size) {
        for (int r = 0; r < fluid->n_region; r++)
            seed_fill_outline(&s, r);
        for (int r = 0; r < fluid->n_region; r++)
            seed_fill_region(&s, r);
    } else {
        double *outline[fluid->n_region ? fluid->n_region : 1];
        int n_outline[fluid->n_region ? fluid->n_region : 1];
        for (int r = 0; r < fluid->n_region; r++) {
            n_outline[r] = seed_outline(&fluid->region[r], fluid->size, &outline[r]);
            for (int k = 0; k < n_outline[r]; k++)
                if (seed_open(&s, r, outline[r] + 2 * k))
                    seed_water(&s, outline[r] + 2 * k, 0.35 * s.h, 0.35 * s.h);
        }
        for (int r = 0; r < fluid->n_region; r++) {
            double a[2] = {HUGE_VAL, HUGE_VAL}, b[2] = {-HUGE_VAL, -HUGE_VAL};
            for (int k = 0; k < n_outline[r]; k++)
                for (int d = 0; d < 2; d++) {
                    a[d] = silt_min(a[d], outline[r][2 * k + d]);
                    b[d] = silt_max(b[d], outline[r][2 * k + d]);
                }
            seed_region(&s, r, a, b);
            free(outline[r]);
        }
    }
    seed_dry_inlets(&s);
    seed_velocity(&s, 0);
    seed_sizes(&s);
    seed_end(&s);
}

// ---- a cloud from a file

static silt_status cloud_take(seed *s, const silt_series *table, silt_error *err) {
    static const char *const name[6] = {"x", "y", "z", "vx", "vy", "vz"};
    int column[6];
    bool moving = true;
    for (int c = 0; c < 6; c++) {
        column[c] = silt_series_column(table, name[c]);
        if (c < s->dim && column[c] < 0)
            return silt_fail(err, SILT_INPUT, "%s: no column %s; a cloud has the columns x, y%s and may have vx, vy%s",
                             table->path, name[c], s->dim == 3 ? ", z" : "", s->dim == 3 ? ", vz" : "");
        moving &= column[c] >= 0 || c < 3 || c >= 3 + s->dim;
    }
    const int first = s->nodes->count;
    int *row_of = silt_alloc((size_t)table->n_row + 1, sizeof *row_of);
    silt_status status = SILT_OK;
    for (int row = 0; row < table->n_row && status == SILT_OK; row++) {
        const double *value = table->value + (size_t)row * (size_t)table->n_column;
        double x[3] = {0}, on[3];
        int wall[3] = {-1, -1, -1}, element, other;
        for (int c = 0; c < 3 + s->dim; c++) {
            const bool wanted = c < s->dim || (c >= 3 && moving);
            if (wanted && !isfinite(value[column[c]]))
                status = silt_fail(err, SILT_INPUT, "%s:%d: no number for %s", table->path, table->line[row], name[c]);
            else if (c < s->dim)
                x[c] = value[column[c]];
        }
        if (status != SILT_OK)
            break;
        for (int d = 0; d < s->dim; d++)
            if (x[d] < s->lo[d] || x[d] > s->hi[d] + s->width)
                status = silt_fail(err, SILT_INPUT, "%s:%d: %s = %g lies outside of regions and walls", table->path,
                                   table->line[row], name[d], x[d]);
        if (status != SILT_OK)
            break;
        seed_wrap(s, x);
        memcpy(on, x, sizeof on);
        if (s->walls->count && !silt_walls_touching(s->walls, x, 1e-3 * s->h, wall, on) &&
            silt_walls_distance(s->walls, x, &element) < 0) {
            status = silt_fail(err, SILT_INPUT, "%s:%d: the node lies behind a wall", table->path, table->line[row]);
            break;
        }
        if (s->solid && s->solid(s->context, on, -1e-6 * s->h)) {
            status = silt_fail(err, SILT_INPUT, "%s:%d: the node lies in the bed or in a body", table->path, table->line[row]);
            break;
        }
        if (seed_near(s, on, 1e-6 * s->h, 1, &other)) {
            if (s->nodes->kind[other] == NODE_FLUID)
                status = silt_fail(err, SILT_INPUT, "%s:%d: the same place as line %d", table->path, table->line[row],
                                   table->line[row_of[other - first]]);
            continue; // inlets, corners, bed and bodies have their own nodes
        }
        const int opening = silt_opening_on(s->scene, on, 1e-3 * s->h, s->dim == 3), k = s->nodes->count;
        if (opening >= 0)
            seed_opening(s, opening, on);
        else {
            seed_add(s, NODE_FLUID, -1, on);
            memcpy(s->nodes->wall[k], wall, sizeof wall);
        }
        row_of[k - first] = row;
    }
    if (status == SILT_OK) {
        seed_velocity(s, first);
        for (int i = first; i < s->nodes->count && moving; i++)
            for (int d = 0; d < s->dim; d++)
                s->nodes->v[s->dim * i + d] = table->value[(size_t)row_of[i - first] * (size_t)table->n_column + (size_t)column[3 + d]];
        seed_sizes(s);
    }
    free(row_of);
    return status;
}

silt_status silt_nodes_read(silt_nodes *nodes, const silt_scene *scene, const silt_walls *walls, silt_solid_test solid,
                            const void *context, silt_error *err) {
    silt_series table = {0};
    SILT_TRY(silt_series_read(scene->folder, scene->fluid.cloud, &table, err));
    seed s;
    silt_status status = SILT_OK;
    if (seed_start(&s, nodes, scene, walls, solid, context)) {
        seed_inlets(&s);
        seed_rims(&s);
        seed_corners(&s);
        status = cloud_take(&s, &table, err);
    } else
        status = silt_fail(err, SILT_INPUT, "%s: a cloud needs a region or a wall in the scene to lie in", table.path);
    seed_end(&s);
    silt_series_clear(&table);
    return status;
}
