// the first cloud in space and with a size field: edges by quantiles, then faces, then the inside, each grown from its rim and
// relaxed like bubbles that press on each other; boxes of one size in space get a body-centred lattice
#include "seed.h"

#define FILL_LATTICE 1.08 // times h: side of a lattice cube whose 14 joints to the neighbours are h long in the mean
#define FILL_RIM 0.5      // times h: nodes inside keep that distance from their rim
#define FILL_RATE 0.2     // of the bubbles' force, times h, in a sweep
#define FILL_STEP 0.15    // times h: longest way in a sweep
#define FILL_MEET 0.65    // times h: of two nodes that are closer one goes
#define FILL_BUBBLE 0.95  // times h: in space
#define FILL_SPIRAL 40
#define FILL_ROUNDS 4
static const double fill_gap[FILL_ROUNDS] = {0.85, 0.75, 0.75, 0.75}; // times h: room for a node in each round of growing
static const int fill_sweeps[FILL_ROUNDS] = {20, 12, 12, 8};          // after it

// ---- edges

// a node of the outline, when it is outline
static void fill_rim(seed *s, int region, const double *x) {
    const double h = seed_h(s, x);
    if (seed_open(s, region, x))
        seed_water(s, x, 0.35 * h, 0.35 * h);
}

static void arc_at(const double *a, const double *b, const silt_region *circle, double t, double x[3]) {
    for (int d = 0; d < 3; d++)
        x[d] = a[d] + t * (b[d] - a[d]);
    if (circle) {
        x[0] = circle->centre[0] + circle->radius * cos(2 * M_PI * t);
        x[1] = circle->centre[1] + circle->radius * sin(2 * M_PI * t);
    }
}

// nodes on the edge from a to b, or round a circle, where int ds/h is a whole number
static void fill_edge(seed *s, int region, const double *a, const double *b, const silt_region *circle) {
    enum { SAMPLES = 400 };
    double sum[SAMPLES + 1], x[3];
    double length = circle ? 2 * M_PI * circle->radius : 0;
    for (int d = 0; d < 3 && !circle; d++)
        length = hypot(length, b[d] - a[d]);
    sum[0] = 0;
    for (int k = 0; k < SAMPLES; k++) {
        arc_at(a, b, circle, (k + 0.5) / SAMPLES, x);
        sum[k + 1] = sum[k] + length / SAMPLES / seed_h(s, x);
    }
    const int pieces = (int)silt_max(circle ? 8 : 1, floor(sum[SAMPLES] + 0.5));
    for (int m = 0, k = 0; m <= pieces - (circle ? 1 : 0); m++) {
        const double want = sum[SAMPLES] * m / pieces;
        while (k < SAMPLES - 1 && sum[k + 1] < want)
            k++;
        const double t = m == pieces ? 1 : (k + silt_clamp((want - sum[k]) / (sum[k + 1] - sum[k]), 0, 1)) / SAMPLES;
        arc_at(a, b, circle, m == 0 ? 0 : t, x);
        if (!circle && m == pieces)
            memcpy(x, b, sizeof x);
        fill_rim(s, region, x);
    }
}

// ---- parts: where their nodes may be

static void part_place(const seed_part *p, const double flat[2], double x[3]) {
    for (int d = 0; d < 3; d++)
        x[d] = p->origin[d] + flat[0] * p->u[d] + flat[1] * p->v[d];
}

// m, distance at which bubbles rest: a little less than h where they press from all sides, so that edges are h in the mean
static double part_h(const seed *s, const seed_part *p, const double *x) {
    return (p->kind == PART_INSIDE && s->dim == 3 ? FILL_BUBBLE : 1) * seed_h(s, x);
}

// m, how deep a place lies within the part; its rim is at 0
static double part_depth(const seed *s, const seed_part *p, const double *x) {
    const silt_region *region = &s->scene->fluid.region[p->region];
    if (p->kind == PART_SPHERE)
        return HUGE_VAL;
    if (p->kind == PART_INSIDE)
        return -silt_region_distance(region, s->dim, x);
    double flat[2] = {0, 0};
    for (int d = 0; d < 3; d++) {
        flat[0] += (x[d] - p->origin[d]) * p->u[d];
        flat[1] += (x[d] - p->origin[d]) * p->v[d];
    }
    return -silt_region_distance(&p->flat, 2, flat);
}

// m, how far a place is off the part's plane or sphere; puts it on
static double part_onto(const seed *s, const seed_part *p, double *x) {
    double off = 0;
    if (p->kind == PART_FACE) {
        for (int d = 0; d < 3; d++)
            off += (x[d] - p->origin[d]) * p->normal[d];
        for (int d = 0; d < 3; d++)
            x[d] -= off * p->normal[d];
    } else if (p->kind == PART_SPHERE) {
        const silt_region *ball = &s->scene->fluid.region[p->region];
        double r[3];
        for (int d = 0; d < 3; d++)
            r[d] = x[d] - ball->centre[d];
        const double length = silt_length(3, r);
        off = length - ball->radius;
        for (int d = 0; d < 3; d++)
            x[d] = ball->centre[d] + (length > 0 ? ball->radius / length : 0) * r[d];
    }
    return off;
}

// Directions in which neighbours are looked for. In a plane six, turned so that one points to the nearest node; inside a
// volume those of the body-centred lattice; more for what that left open. Lengths times h. @return how many
static int part_directions(const seed *s, const seed_part *p, const double *x, bool open, double direction[FILL_SPIRAL][3]) {
    if (p->kind == PART_INSIDE && s->dim == 3 && open) {
        for (int k = 0; k < FILL_SPIRAL; k++) {
            const double z = 1 - (2 * k + 1.0) / FILL_SPIRAL, flat = sqrt(1 - z * z), angle = M_PI * (3 - sqrt(5)) * k;
            direction[k][0] = flat * cos(angle);
            direction[k][1] = flat * sin(angle);
            direction[k][2] = z;
        }
        return FILL_SPIRAL;
    }
    if (p->kind == PART_INSIDE && s->dim == 3) {
        const double side = FILL_LATTICE;
        int n = 0;
        for (int k = 0; k < 8; k++, n++)
            for (int d = 0; d < 3; d++)
                direction[n][d] = (k >> d & 1 ? 0.5 : -0.5) * side;
        for (int k = 0; k < 6; k++, n++)
            for (int d = 0; d < 3; d++)
                direction[n][d] = d == k / 2 ? (k % 2 ? side : -side) : 0;
        return n;
    }
    double u[3] = {1, 0, 0}, v[3] = {0, 1, 0}, best = HUGE_VAL, phase = 0;
    if (p->kind == PART_FACE) {
        memcpy(u, p->u, sizeof u);
        memcpy(v, p->v, sizeof v);
    } else if (p->kind == PART_SPHERE) {
        const double *c = s->scene->fluid.region[p->region].centre;
        const double n[3] = {x[0] - c[0], x[1] - c[1], x[2] - c[2]}, length = silt_length(3, n);
        const int axis = fabs(n[0]) < 0.6 * length ? 0 : 1;
        double e[3] = {axis == 0, axis == 1, 0};
        const double along = n[axis] / length;
        for (int d = 0; d < 3; d++)
            u[d] = (e[d] - along * n[d] / length) / sqrt(1 - along * along);
        for (int d = 0; d < 3; d++)
            v[d] = (n[(d + 1) % 3] * u[(d + 2) % 3] - n[(d + 2) % 3] * u[(d + 1) % 3]) / length;
    }
    int list[64];
    const int near = seed_near(s, x, 1.5 * seed_h(s, x), 64, list);
    for (int k = 0; k < near; k++) {
        const double *y = s->nodes->x + s->dim * list[k];
        const double apart = seed_apart(s, x, y);
        double along = 0, across = 0;
        for (int d = 0; d < s->dim; d++) {
            along += (y[d] - x[d]) * u[d];
            across += (y[d] - x[d]) * v[d];
        }
        if (apart > 1e-6 * s->h && apart < best && hypot(along, across) > 0.8 * apart) {
            best = apart;
            phase = atan2(across, along);
        }
    }
    const int n = open ? 18 : 6;
    for (int k = 0; k < n; k++)
        for (int d = 0; d < 3; d++)
            direction[k][d] = cos(phase + 2 * M_PI * k / n) * u[d] + sin(phase + 2 * M_PI * k / n) * v[d];
    return n;
}

// true when a node may stand here
static bool part_allows(const seed *s, const seed_part *p, const double *x, double h) {
    int nearest;
    if (part_depth(s, p, x) < FILL_RIM * h)
        return false;
    if (p->kind == PART_INSIDE && s->walls->count && silt_walls_distance(s->walls, x, &nearest) < 0.4 * h)
        return false;
    return !s->solid || !s->solid(s->context, x, 0.5 * h);
}

static bool part_add(seed *s, const seed_part *p, const double *x) {
    const int before = s->nodes->count;
    if (p->kind == PART_INSIDE)
        seed_add(s, NODE_FLUID, -1, x);
    else
        fill_rim(s, p->region, x);
    return s->nodes->count > before;
}

// ---- growing and relaxing

// the part grows from its rim: every node in turn looks for neighbours at the local distance
static void part_grow(seed *s, const seed_part *p, int first, double gap, bool open) {
    silt_nodes *nodes = s->nodes;
    int *queue = NULL, n = 0, capacity = 0;
    for (int i = 0; i < nodes->count; i++) {
        double x[3] = {0};
        memcpy(x, nodes->x + s->dim * i, (size_t)s->dim * sizeof *x);
        const double h = seed_h(s, x);
        if (i < first && (fabs(part_onto(s, p, x)) > 1e-6 * s->h || part_depth(s, p, x) < -0.6 * h))
            continue;
        SILT_RESERVE(queue, capacity, n + 1);
        queue[n++] = i;
    }
    for (int q = 0; q < n; q++) {
        double x[3] = {0}, direction[FILL_SPIRAL][3];
        memcpy(x, nodes->x + s->dim * queue[q], (size_t)s->dim * sizeof *x);
        const int n_direction = part_directions(s, p, x, open, direction);
        const double h_own = part_h(s, p, x);
        for (int k = 0; k < n_direction; k++) {
            double y[3], h = h_own;
            for (int d = 0; d < 3; d++)
                y[d] = x[d] + h * direction[k][d];
            if (seed_crowded(s, y, 0.6 * gap * h)) // the cheap question first
                continue;
            for (int pass = 0; pass < 2 && s->size; pass++) { // at the distance that is wanted half way
                for (int d = 0; d < 3; d++)
                    y[d] = x[d] + 0.5 * h * direction[k][d];
                h = part_h(s, p, y);
            }
            for (int d = 0; d < 3; d++)
                y[d] = x[d] + h * direction[k][d];
            part_onto(s, p, y);
            h = part_h(s, p, y);
            if (!part_allows(s, p, y, h) || seed_crowded(s, y, gap * h))
                continue;
            const int i = nodes->count;
            if (part_add(s, p, y)) {
                SILT_RESERVE(queue, capacity, n + 1);
                queue[n++] = i;
            }
        }
    }
    free(queue);
}

// Bubbles (Shimada and Gossard 1995): force 1.25 l^3 - 2.375 l^2 + 1.125 along the line between two nodes, l their distance over h,
// up to l = 1.5. Nodes of the part move, the others stand.
static void part_relax(seed *s, const seed_part *p, int first, int sweeps) {
    silt_nodes *nodes = s->nodes;
    const int dim = s->dim;
    double *x = silt_alloc((size_t)(dim * nodes->count) + 1, sizeof *x);
    double *size = silt_alloc((size_t)nodes->count + 1, sizeof *size);
    for (int sweep = 0; sweep < sweeps; sweep++) {
        for (int i = sweep ? first : 0; i < nodes->count && sweep % 5 == 0; i++)
            size[i] = part_h(s, p, nodes->x + dim * i);
        for (int i = first; i < nodes->count; i++) {
            const double *at = nodes->x + dim * i, h = size[i];
            double force[3] = {0}, to[3] = {0};
            int list[160];
            const int n = seed_near(s, at, 1.6 * h, 160, list);
            for (int k = 0; k < n; k++) {
                const double *y = nodes->x + dim * list[k], apart = seed_apart(s, at, y);
                const double l = apart / (0.5 * (h + size[list[k]]));
                if (list[k] == i || l >= 1.5 || apart == 0)
                    continue;
                const double f = 1.25 * l * l * l - 2.375 * l * l + 1.125;
                for (int d = 0; d < dim; d++) {
                    double step = at[d] - y[d];
                    if (d == 0 && s->period > 0)
                        step -= s->period * floor(step / s->period + 0.5);
                    force[d] += f * step / apart;
                }
            }
            const double way = FILL_RATE * silt_length(dim, force);
            const double rate = FILL_RATE * h * (way > FILL_STEP ? FILL_STEP / way : 1);
            for (int d = 0; d < dim; d++)
                to[d] = at[d] + rate * force[d];
            part_onto(s, p, to);
            const bool stays = nodes->kind[i] != NODE_FLUID || (p->kind != PART_INSIDE && nodes->wall[i][1] >= 0);
            const bool ok = !stays && part_allows(s, p, to, h);
            memcpy(x + dim * i, ok ? to : at, (size_t)dim * sizeof *x);
        }
        memcpy(nodes->x + dim * first, x + dim * first, (size_t)(dim * (nodes->count - first)) * sizeof *x);
        seed_sort(s);
    }
    free(size);
    free(x);
}

// of two that are too close the younger goes
static void part_thin(seed *s, const seed_part *p, int first) {
    silt_nodes *nodes = s->nodes;
    uint8_t *dead = silt_alloc((size_t)nodes->count + 1, 1);
    int *map = silt_alloc((size_t)nodes->count + 1, sizeof *map);
    for (int i = nodes->count - 1; i >= first; i--) {
        int list[64];
        const double *x = nodes->x + s->dim * i;
        const int n = seed_near(s, x, FILL_MEET * part_h(s, p, x), 64, list);
        for (int k = 0; k < n; k++)
            dead[i] |= list[k] != i && !dead[list[k]];
    }
    silt_nodes_compact(nodes, dead, map);
    seed_sort(s);
    free(dead);
    free(map);
}

static void part_fill(seed *s, const seed_part *p) {
    const int first = s->nodes->count;
    for (int round = 0; round < FILL_ROUNDS; round++) {
        part_grow(s, p, first, fill_gap[round], round > 0);
        part_relax(s, p, first, fill_sweeps[round]);
        if (round < FILL_ROUNDS - 1)
            part_thin(s, p, first);
    }
    if (p->kind == PART_INSIDE)
        return;
    // onto the walls exactly, after what the sweeps moved
    for (int i = first; i < s->nodes->count; i++) {
        double on[3];
        int wall[3];
        if (s->nodes->wall[i][0] < 0 || !silt_walls_touching(s->walls, s->nodes->x + s->dim * i, 1e-3 * s->h, wall, on))
            continue;
        memcpy(s->nodes->x + s->dim * i, on, (size_t)s->dim * sizeof *on);
        memcpy(s->nodes->wall[i], wall, sizeof wall);
    }
}

// ---- faces in space

// the plane of a face, its corners in it; normal from the corners' sense
static void part_plane(seed_part *p, int n, const double *corner) {
    double normal[3] = {0};
    for (int k = 1; k + 1 < n; k++)
        for (int d = 0; d < 3; d++) {
            const int e = (d + 1) % 3, f = (d + 2) % 3;
            const double *a = corner, *b = corner + 3 * k, *c = corner + 3 * (k + 1);
            normal[d] += (b[e] - a[e]) * (c[f] - a[f]) - (b[f] - a[f]) * (c[e] - a[e]);
        }
    const double size = silt_length(3, normal);
    double length = 0;
    for (int d = 0; d < 3; d++) {
        p->origin[d] = corner[d];
        p->u[d] = corner[3 + d] - corner[d];
        length = hypot(length, p->u[d]);
    }
    for (int d = 0; d < 3; d++) {
        p->normal[d] = normal[d] / size;
        p->u[d] /= length;
    }
    for (int d = 0; d < 3; d++)
        p->v[d] = p->normal[(d + 1) % 3] * p->u[(d + 2) % 3] - p->normal[(d + 2) % 3] * p->u[(d + 1) % 3];
    p->flat = (silt_region){.kind = REGION_POLYGON, .n_point = n, .point = silt_alloc((size_t)(3 * n), sizeof(double))};
    for (int k = 0; k < n; k++)
        for (int d = 0; d < 3; d++) {
            p->flat.point[3 * k] += (corner[3 * k + d] - p->origin[d]) * p->u[d];
            p->flat.point[3 * k + 1] += (corner[3 * k + d] - p->origin[d]) * p->v[d];
        }
}

// corners of face k of a box or an upright prism, 3 numbers each. @return how many; 0: no such face
static int region_face(const silt_region *region, int k, double *corner) {
    if (region->kind == REGION_BOX) {
        if (k >= 6)
            return 0;
        const int axis = k / 2, e = (axis + 1) % 3, f = (axis + 2) % 3;
        for (int c = 0; c < 4; c++) {
            corner[3 * c + axis] = k % 2 ? region->hi[axis] : region->lo[axis];
            corner[3 * c + e] = c == 1 || c == 2 ? region->hi[e] : region->lo[e];
            corner[3 * c + f] = c >= 2 ? region->hi[f] : region->lo[f];
        }
        return 4;
    }
    const int n = region->n_point;
    if (region->kind != REGION_POLYGON || k >= n + 2)
        return 0;
    for (int c = 0; c < (k < 2 ? n : 4); c++) {
        const double *point = region->point + 3 * (k < 2 ? c : (k - 2 + (c == 1 || c == 2)) % n);
        corner[3 * c] = point[0];
        corner[3 * c + 1] = (k < 2 ? k == 1 : c >= 2) ? region->hi[1] : region->lo[1];
        corner[3 * c + 2] = point[1];
    }
    return k < 2 ? n : 4;
}

// ---- regions

// a box of one size in space: the body-centred lattice, fitted
static void fill_lattice(seed *s, int region, bool rim) {
    const silt_region *box = &s->scene->fluid.region[region];
    const double h = s->h, jitter = s->scene->fluid.jitter;
    int n[3];
    double side[3];
    for (int d = 0; d < 3; d++) {
        n[d] = (int)silt_max(1, floor((box->hi[d] - box->lo[d]) / (FILL_LATTICE * h) + 0.5));
        side[d] = (box->hi[d] - box->lo[d]) / n[d];
    }
    // corners of the cubes and their middles by half steps
    for (int k = 0; k <= 2 * n[2]; k++)
        for (int j = k % 2; j <= 2 * n[1]; j += 2)
            for (int i = k % 2; i <= 2 * n[0]; i += 2) {
                const int at[3] = {i, j, k};
                double x[3];
                bool on_rim = false;
                for (int d = 0; d < 3; d++) {
                    x[d] = at[d] == 2 * n[d] ? box->hi[d] : box->lo[d] + 0.5 * at[d] * side[d];
                    on_rim |= at[d] == 0 || at[d] == 2 * n[d];
                }
                if (rim) {
                    if (on_rim)
                        fill_rim(s, region, x);
                    continue;
                }
                // what is rim to this box and not to the water is inside
                for (int d = 0; d < 3 && jitter > 0 && !on_rim; d++)
                    x[d] += jitter * h * (2 * silt_uniform(&s->random) - 1);
                const seed_part part = {.region = region, .kind = PART_INSIDE};
                int nearest;
                if ((s->walls->count && silt_walls_distance(s->walls, x, &nearest) < 0.4 * h) || part_depth(s, &part, x) < 0 ||
                    (on_rim && seed_crowded(s, x, 0.6 * h)) || seed_crowded(s, x, 0.45 * h) ||
                    (s->solid && s->solid(s->context, x, 0.5 * h)))
                    continue;
                seed_add(s, NODE_FLUID, -1, x);
            }
}

// Boxes of one size in space; not where a bed reaches into them: a lattice would meet it anyhow.
static bool region_has_lattice(const seed *s, int r) {
    const silt_region *region = &s->scene->fluid.region[r];
    if (region->kind != REGION_BOX || s->size)
        return false;
    for (int i = 0; i < s->nodes->count && s->on_bed; i++)
        if (s->nodes->kind[i] == NODE_BED && silt_region_distance(region, 3, s->nodes->x + 3 * i) < -1e-6 * s->h)
            return false;
    return true;
}

void seed_fill_outline(seed *s, int r) {
    const silt_region *region = &s->scene->fluid.region[r];
    if (s->dim == 2) {
        const double none[3] = {0};
        if (region->kind == REGION_CIRCLE || region->kind == REGION_SPHERE)
            fill_edge(s, r, none, none, region);
        const double box[12] = {region->lo[0], region->lo[1], 0, region->hi[0], region->lo[1], 0,
                                region->hi[0], region->hi[1], 0, region->lo[0], region->hi[1], 0};
        const int n = region->kind == REGION_BOX ? 4 : region->kind == REGION_POLYGON ? region->n_point : 0;
        const double *point = region->kind == REGION_BOX ? box : region->point;
        for (int k = 0; k < n; k++)
            fill_edge(s, r, point + 3 * k, point + 3 * ((k + 1) % n), NULL);
        return;
    }
    if (region_has_lattice(s, r)) {
        fill_lattice(s, r, true);
        return;
    }
    if (region->kind == REGION_SPHERE || region->kind == REGION_CIRCLE) {
        const seed_part ball = {.region = r, .kind = PART_SPHERE};
        const double pole[3] = {region->centre[0], region->centre[1], region->centre[2] + region->radius};
        fill_rim(s, r, pole);
        part_fill(s, &ball);
        return;
    }
    double *corner = silt_alloc((size_t)(3 * silt_max(region->n_point, 4)), sizeof *corner);
    int n;
    for (int k = 0; (n = region_face(region, k, corner)) > 0; k++)
        for (int c = 0; c < n; c++)
            fill_edge(s, r, corner + 3 * c, corner + 3 * ((c + 1) % n), NULL);
    for (int k = 0; (n = region_face(region, k, corner)) > 0; k++) {
        seed_part face = {.region = r, .kind = PART_FACE};
        part_plane(&face, n, corner);
        part_fill(s, &face);
        free(face.flat.point);
    }
    free(corner);
}

void seed_fill_region(seed *s, int r) {
    if (s->dim == 3 && region_has_lattice(s, r)) {
        fill_lattice(s, r, false);
        return;
    }
    const seed_part inside = {.region = r, .kind = PART_INSIDE};
    const int first = s->nodes->count;
    part_fill(s, &inside);
    for (int i = first; i < s->nodes->count && s->scene->fluid.jitter > 0; i++) {
        double x[3] = {0}, h = seed_h(s, s->nodes->x + s->dim * i);
        for (int d = 0; d < s->dim; d++)
            x[d] = s->nodes->x[s->dim * i + d] + s->scene->fluid.jitter * h * (2 * silt_uniform(&s->random) - 1);
        if (part_allows(s, &inside, x, 0.8 * h))
            memcpy(s->nodes->x + s->dim * i, x, (size_t)s->dim * sizeof *x);
    }
    seed_sort(s);
}

int seed_outline_samples(const seed *s, int r, double spacing, double **out) {
    const silt_region *region = &s->scene->fluid.region[r];
    double *x = NULL;
    int n = 0, capacity = 0, corners;
    if (region->kind == REGION_CIRCLE || region->kind == REGION_SPHERE) {
        const double radius = region->radius, turn = 2 * M_PI * radius / spacing;
        const int count = (int)silt_max(8, s->dim == 3 ? turn * turn / M_PI : turn);
        SILT_RESERVE(x, capacity, s->dim * count);
        for (; n < count; n++) {
            // a spiral from pole to pole
            const double z = s->dim == 3 ? 1 - (2 * n + 1.0) / count : 0, flat = radius * sqrt(1 - z * z);
            const double angle = s->dim == 3 ? M_PI * (3 - sqrt(5)) * n : 2 * M_PI * n / count;
            x[s->dim * n] = region->centre[0] + flat * cos(angle);
            x[s->dim * n + 1] = region->centre[1] + flat * sin(angle);
            if (s->dim == 3)
                x[3 * n + 2] = region->centre[2] + radius * z;
        }
        *out = x;
        return n;
    }
    if (s->dim == 2) {
        const double box[12] = {region->lo[0], region->lo[1], 0, region->hi[0], region->lo[1], 0,
                                region->hi[0], region->hi[1], 0, region->lo[0], region->hi[1], 0};
        const int count = region->kind == REGION_BOX ? 4 : region->n_point;
        const double *point = region->kind == REGION_BOX ? box : region->point;
        double *flat = silt_alloc((size_t)(2 * count), sizeof *flat);
        for (int k = 0; k < 2 * count; k++)
            flat[k] = point[3 * (k / 2) + k % 2];
        n = silt_outline_points(count, flat, spacing, &x);
        free(flat);
        *out = x;
        return n;
    }
    double *corner = silt_alloc((size_t)(3 * silt_max(region->n_point, 4)), sizeof *corner);
    for (int k = 0; (corners = region_face(region, k, corner)) > 0; k++) {
        seed_part face = {.region = r, .kind = PART_FACE};
        part_plane(&face, corners, corner);
        double lo[3], hi[3];
        silt_region_bounds(&face.flat, lo, hi);
        const int nu = (int)silt_max(1, ceil((hi[0] - lo[0]) / spacing)), nv = (int)silt_max(1, ceil((hi[1] - lo[1]) / spacing));
        for (int i = 0; i <= nu; i++)
            for (int j = 0; j <= nv; j++) {
                const double flat[2] = {lo[0] + (hi[0] - lo[0]) * i / nu, lo[1] + (hi[1] - lo[1]) * j / nv};
                if (silt_region_distance(&face.flat, 2, flat) > 1e-9 * spacing)
                    continue;
                SILT_RESERVE(x, capacity, 3 * (n + 1));
                part_place(&face, flat, x + 3 * n++);
            }
        free(face.flat.point);
    }
    free(corner);
    *out = x;
    return n;
}
