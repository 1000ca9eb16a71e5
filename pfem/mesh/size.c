// the size field: how close nodes stand where, from the rules `fluid.sizes`, following what moves
#include "pfem.h"

/* Every rule r has a size s_r, a thing (region, walls, bed, bodies, surface) and a distance D_r around it; d_r(x) is the
 * distance from the thing, g = fluid.size_growth the largest change of size per distance. With e_r = max(0, d_r - D_r):
 *   coarse rules (s_r > fluid.size):   H = max(fluid.size, max_r(s_r - g e_r))
 *   fine rules   (s_r <= fluid.size):  h = min(H, min_r(s_r + g e_r))
 * so that h is the rule's size inside its distance, grows (or falls) at g around it, is fluid.size far away, the finer of two
 * rules wins, and |h(x) - h(y)| <= g |x - y| everywhere.
 * Regions are taken by their exact distance. Surface, bed, bodies and wet walls are the nodes that lie on them: each node gets
 * the nearest of them handed on along the mesh's edges, no farther than the rule reaches. From dry parts of bodies, which have no edges, it
 * goes through the air: the water that a body falls towards is refined before it strikes. */

#define SIZE_NODE_KIND (NEAR_SURFACE + 1)

// places of one kind, sorted into boxes for silt_size_at
typedef struct size_places {
    int n, capacity, item_capacity, start_capacity;
    double *x; // owned, 3 per place
    double lo[3], width;
    int box[3];
    int *start, *item; // owned
} size_places;

struct silt_size {
    const silt_scene *scene; // borrowed
    const silt_walls *walls; // borrowed
    int dim;
    double base, growth;
    double reach[SIZE_NODE_KIND]; // m, beyond which a kind has no say; 0: no rule names it
    double (*lo)[3], (*hi)[3];    // owned, bounds of every rule's region
    size_places places[SIZE_NODE_KIND], dry; // dry: of bodies
    bool updated;
    // work of an update
    double *square[SIZE_NODE_KIND]; // owned, m2, of every node to the nearest place
    int square_capacity[SIZE_NODE_KIND];
    int *source, *from, *front, *next, *round; // owned, one per node
    int source_capacity, from_capacity, front_capacity, next_capacity, round_capacity;
};

static double segment_square(const double *a, const double *b, const double *x) {
    const double dx = b[0] - a[0], dy = b[1] - a[1], square = dx * dx + dy * dy;
    const double t = square > 0 ? silt_clamp(((x[0] - a[0]) * dx + (x[1] - a[1]) * dy) / square, 0, 1) : 0;
    return silt_square(x[0] - a[0] - t * dx) + silt_square(x[1] - a[1] - t * dy);
}

// distance from a product of intervals or of a plane figure and an interval: outside the parts add up, inside the nearest counts
static double distance_join(double a, double b) {
    return a > 0 && b > 0 ? hypot(a, b) : silt_max(a, b);
}

double silt_region_distance(const silt_region *region, int dim, const double *x) {
    if (region->kind == REGION_BOX) {
        double all = -HUGE_VAL;
        for (int d = 0; d < dim; d++)
            all = distance_join(all, silt_max(region->lo[d] - x[d], x[d] - region->hi[d]));
        return all;
    }
    if (region->kind == REGION_POLYGON) {
        const double p[2] = {x[0], x[dim - 1]};
        double square = HUGE_VAL;
        for (int k = 0, m = region->n_point - 1; k < region->n_point; m = k++)
            square = silt_min(square, segment_square(region->point + 3 * m, region->point + 3 * k, p));
        const double flat = silt_polygon_contains(region->n_point, region->point, p) ? -sqrt(square) : sqrt(square);
        return dim == 3 ? distance_join(flat, silt_max(region->lo[1] - x[1], x[1] - region->hi[1])) : flat;
    }
    double square = 0;
    for (int d = 0; d < dim; d++)
        square += silt_square(x[d] - region->centre[d]);
    return sqrt(square) - region->radius;
}

void silt_size_create(silt_size **size, const silt_scene *scene, const silt_walls *walls) {
    const silt_fluid_def *fluid = &scene->fluid;
    *size = NULL;
    if (!fluid->n_size)
        return;
    silt_size *s = silt_alloc(1, sizeof *s);
    *s = (silt_size){.scene = scene, .walls = walls, .dim = scene->dimension == 3 ? 3 : 2, .base = fluid->size};
    s->growth = fluid->size_growth > 0 ? fluid->size_growth : 0.3;
    s->lo = silt_alloc((size_t)fluid->n_size, sizeof *s->lo);
    s->hi = silt_alloc((size_t)fluid->n_size, sizeof *s->hi);
    double coarsest = fluid->size;
    for (int r = 0; r < fluid->n_size; r++)
        coarsest = silt_max(coarsest, fluid->size_at[r].size);
    for (int r = 0; r < fluid->n_size; r++) {
        const silt_size_def *rule = &fluid->size_at[r];
        if (rule->near == NEAR_REGION)
            silt_region_bounds(&rule->region, s->lo[r], s->hi[r]);
        else { // a fine rule may stand against the coarsest one, a coarse one only against fluid.size
            const double against = rule->size > s->base ? s->base : coarsest;
            s->reach[rule->near] = silt_max(s->reach[rule->near], rule->distance + fabs(against - rule->size) / s->growth);
        }
    }
    *size = s;
}

void silt_size_free(silt_size **size) {
    silt_size *s = *size;
    if (!s)
        return;
    free(s->lo);
    free(s->hi);
    for (int k = 0; k < SIZE_NODE_KIND; k++) {
        free(s->places[k].x);
        free(s->places[k].start);
        free(s->places[k].item);
        free(s->square[k]);
    }
    free(s->dry.x);
    free(s->dry.start);
    free(s->dry.item);
    free(s->source);
    free(s->from);
    free(s->front);
    free(s->next);
    free(s->round);
    free(s);
    *size = NULL;
}

// m, to the nearest of a point's images
static double size_square(const silt_size *s, const double *a, const double *b) {
    double dx = a[0] - b[0];
    const double period = s->scene->period[1] - s->scene->period[0];
    if (period > 0)
        dx -= period * floor(dx / period + 0.5);
    return dx * dx + silt_square(a[1] - b[1]) + (s->dim == 3 ? silt_square(a[2] - b[2]) : 0);
}

// the rules together; distance[kind] is from surface, bed, bodies or walls
static double size_combine(const silt_size *s, const double *x, const double *distance) {
    const silt_fluid_def *fluid = &s->scene->fluid;
    double coarse = s->base, fine = HUGE_VAL;
    for (int r = 0; r < fluid->n_size; r++) {
        const silt_size_def *rule = &fluid->size_at[r];
        const bool is_fine = rule->size <= s->base;
        double d = distance[rule->near];
        if (rule->near == NEAR_REGION) {
            // the bounds first: nothing nearer is possible
            double outside = 0;
            for (int k = 0; k < s->dim; k++)
                outside = silt_max(outside, silt_max(s->lo[r][k] - x[k], x[k] - s->hi[r][k]));
            const double best = rule->size + (is_fine ? s->growth : -s->growth) * silt_max(0, outside - rule->distance);
            if (is_fine ? best >= fine : best <= coarse)
                continue;
            d = silt_region_distance(&rule->region, s->dim, x);
        }
        const double beyond = s->growth * silt_max(0, d - rule->distance);
        if (is_fine)
            fine = silt_min(fine, rule->size + beyond);
        else
            coarse = silt_max(coarse, rule->size - beyond);
    }
    return silt_min(coarse, fine);
}

// ---- places in boxes

static void places_box(const size_places *p, int dim, const double *x, int box[3]) {
    for (int d = 0; d < 3; d++)
        box[d] = d < dim ? (int)silt_clamp(floor((x[d] - p->lo[d]) / p->width), 0, p->box[d] - 1) : 0;
}

static void places_sort(size_places *p, int dim) {
    double hi[3] = {-HUGE_VAL, -HUGE_VAL, -HUGE_VAL}, room = 1;
    for (int d = 0; d < 3; d++)
        p->lo[d] = HUGE_VAL;
    for (int k = 0; k < p->n; k++)
        for (int d = 0; d < dim; d++) {
            p->lo[d] = silt_min(p->lo[d], p->x[3 * k + d]);
            hi[d] = silt_max(hi[d], p->x[3 * k + d]);
        }
    // about as many boxes as places
    p->width = 1e-300;
    for (int d = 0; d < dim && p->n; d++)
        p->width = silt_max(p->width, (hi[d] - p->lo[d]) / 1000);
    for (bool fits = false; !fits && p->n; p->width *= fits ? 1 : 1.2) {
        room = 1;
        for (int d = 0; d < dim; d++)
            room *= floor((hi[d] - p->lo[d]) / p->width) + 1;
        fits = room <= 2.0 * p->n + 64;
    }
    int n = 1;
    for (int d = 0; d < 3; d++)
        n *= p->box[d] = d < dim && p->n ? (int)floor((hi[d] - p->lo[d]) / p->width) + 1 : 1;
    SILT_RESERVE(p->start, p->start_capacity, n + 1);
    SILT_RESERVE(p->item, p->item_capacity, p->n + 1);
    memset(p->start, 0, (size_t)(n + 1) * sizeof *p->start);
    for (int pass = 0; pass < 2; pass++) {
        for (int k = p->n - 1; k >= 0; k--) {
            int b[3];
            places_box(p, dim, p->x + 3 * k, b);
            const int at = (b[2] * p->box[1] + b[1]) * p->box[0] + b[0];
            if (pass == 0)
                p->start[at]++;
            else
                p->item[--p->start[at]] = k;
        }
        for (int k = 0, sum = 0; pass == 0 && k <= n; k++) {
            sum += k < n ? p->start[k] : 0;
            p->start[k] = sum;
        }
    }
}

static void places_add(size_places *p, const double *x, int dim) {
    SILT_RESERVE(p->x, p->capacity, 3 * (p->n + 1));
    for (int d = 0; d < 3; d++)
        p->x[3 * p->n + d] = d < dim ? x[d] : 0;
    p->n++;
}

// m2, the nearest place in a box, or best
static double places_box_square(const size_places *p, int dim, const double *x, int box, double best) {
    for (int m = p->start[box]; m < p->start[box + 1]; m++) {
        const double *y = p->x + 3 * p->item[m];
        double square = silt_square(x[0] - y[0]) + silt_square(x[1] - y[1]);
        square += dim == 3 ? silt_square(x[2] - y[2]) : 0;
        best = silt_min(best, square);
    }
    return best;
}

// m, to the nearest place within reach, else HUGE_VAL: shell by shell of boxes around the point's own
static double places_distance(const silt_size *s, const size_places *p, const double *x, double reach) {
    if (!p->n)
        return HUGE_VAL;
    const double period = s->scene->period[1] - s->scene->period[0];
    double best = reach * reach * (1 + 1e-12);
    const double limit = best;
    for (int image = period > 0 ? -1 : 0; image <= (period > 0 ? 1 : 0); image++) {
        const double at[3] = {x[0] + image * period, x[1], s->dim == 3 ? x[2] : 0};
        int own[3];
        double outside = 0, to_rim = HUGE_VAL; // of the boxes; from the own box's sides
        for (int d = 0; d < 3; d++)
            own[d] = d < s->dim ? (int)silt_clamp(floor((at[d] - p->lo[d]) / p->width), -1e6, 1e6) : 0;
        int first = 0, last = 0;
        for (int d = 0; d < s->dim; d++) {
            const int away = own[d] < 0 ? -own[d] : own[d] >= p->box[d] ? own[d] - p->box[d] + 1 : 0;
            const int far = own[d] > p->box[d] - 1 - own[d] ? own[d] : p->box[d] - 1 - own[d];
            first = away > first ? away : first;
            last = far > last ? far : last;
            outside = silt_max(outside, silt_max(p->lo[d] - at[d], at[d] - p->lo[d] - p->box[d] * p->width));
            const double in = at[d] - p->lo[d] - own[d] * p->width;
            to_rim = silt_min(to_rim, silt_min(in, p->width - in));
        }
        if (outside > 0 && outside * outside > best)
            continue;
        for (int shell = first; shell <= last; shell++) {
            const double nearest = shell ? (shell - 1) * p->width + to_rim : 0;
            if (nearest > 0 && nearest * nearest > best)
                break;
            int lo[3], hi[3];
            for (int d = 0; d < 3; d++) {
                lo[d] = d < s->dim && own[d] - shell > 0 ? own[d] - shell : 0;
                hi[d] = d < s->dim && own[d] + shell < p->box[d] - 1 ? own[d] + shell : p->box[d] - 1;
            }
            for (int k = lo[2]; k <= hi[2]; k++)
                for (int j = lo[1]; j <= hi[1]; j++) {
                    const bool side = abs(j - own[1]) == shell || (s->dim == 3 && abs(k - own[2]) == shell);
                    const int row = (k * p->box[1] + j) * p->box[0];
                    for (int i = lo[0]; i <= hi[0]; i++)
                        if (side || abs(i - own[0]) == shell)
                            best = places_box_square(p, s->dim, at, row + i, best);
                }
        }
    }
    return best < limit ? sqrt(best) : HUGE_VAL;
}

void silt_size_near(silt_size *size, silt_near near, int n, const double *x) {
    if (!size || size->updated || near == NEAR_REGION || near == NEAR_WALLS || size->reach[near] == 0)
        return;
    for (int k = 0; k < n; k++)
        places_add(&size->places[near], x + size->dim * k, size->dim);
    places_sort(&size->places[near], size->dim);
}

double silt_size_at(const silt_size *size, const silt_scene *scene, const double *x) {
    if (!size)
        return scene->fluid.size;
    double distance[SIZE_NODE_KIND] = {0};
    for (int k = NEAR_WALLS; k <= NEAR_SURFACE; k++) {
        int element;
        if (size->reach[k] == 0)
            continue;
        distance[k] = k == NEAR_WALLS && size->walls ? fabs(silt_walls_distance(size->walls, x, &element))
                                                     : places_distance(size, &size->places[k], x, size->reach[k]);
    }
    return size_combine(size, x, distance);
}

// ---- the update

static bool size_source(const silt_nodes *nodes, const silt_mesh *mesh, int kind, int i) {
    switch (kind) {
    case NEAR_WALLS:
        return nodes->wall[i][0] >= 0 || nodes->kind[i] == NODE_CORNER;
    case NEAR_BED:
        return nodes->kind[i] == NODE_BED;
    case NEAR_BODIES:
        return nodes->kind[i] == NODE_BODY;
    default:
        return i >= mesh->n_node || mesh->surface[i] || !mesh->wet[i]; // drops are all surface
    }
}

// Hands the nearest source on from node to node in rounds; the sources that a round hands on are those of its beginning, so
// that the order of the nodes does not matter.
static void size_spread(silt_size *s, const silt_nodes *nodes, const silt_mesh *mesh, int kind) {
    const double reach2 = s->reach[kind] * s->reach[kind];
    const double *x = nodes->x;
    double *square = s->square[kind];
    int n_front = 0;
    for (int i = 0; i < nodes->count; i++) {
        const bool is = size_source(nodes, mesh, kind, i);
        square[i] = is ? 0 : HUGE_VAL;
        s->round[i] = -1;
        if (is) {
            s->source[i] = i;
            s->front[n_front++] = i;
        }
    }
    for (int round = 0; n_front; round++) {
        int n_next = 0;
        for (int k = 0; k < n_front; k++)
            s->from[k] = s->source[s->front[k]];
        for (int k = 0; k < n_front; k++) {
            const int i = s->front[k], source = s->from[k];
            if (i >= mesh->n_node)
                continue;
            for (int m = mesh->neighbour_start[i]; m < mesh->neighbour_start[i + 1]; m++) {
                const int j = mesh->neighbour[m];
                if (square[j] == 0)
                    continue;
                const double to = size_square(s, x + s->dim * j, x + s->dim * source);
                if (to >= square[j] || to > reach2)
                    continue;
                square[j] = to;
                s->source[j] = source;
                if (s->round[j] != round) {
                    s->round[j] = round;
                    s->next[n_next++] = j;
                }
            }
        }
        int *swap = s->front;
        s->front = s->next;
        s->next = swap;
        const int capacity = s->front_capacity;
        s->front_capacity = s->next_capacity;
        s->next_capacity = capacity;
        n_front = n_next;
    }
}

// straight from nodes of bodies that no cell holds
static void size_through_air(silt_size *s, const silt_nodes *nodes, const silt_mesh *mesh) {
    double *square = s->square[NEAR_BODIES];
    s->dry.n = 0;
    for (int i = 0; i < nodes->count; i++)
        if (nodes->kind[i] == NODE_BODY && (i >= mesh->n_node || !mesh->wet[i]))
            places_add(&s->dry, nodes->x + s->dim * i, s->dim);
    if (!s->dry.n)
        return;
    places_sort(&s->dry, s->dim);
    for (int i = 0; i < nodes->count; i++)
        if (square[i] > 0)
            square[i] = silt_min(square[i], silt_square(places_distance(s, &s->dry, nodes->x + s->dim * i, s->reach[NEAR_BODIES])));
}

void silt_size_update(silt_size *size, silt_nodes *nodes, const silt_mesh *mesh) {
    if (!size)
        return;
    const int n = nodes->count;
    if (!nodes->h)
        nodes->h = silt_alloc((size_t)silt_max(nodes->capacity, 1), sizeof *nodes->h);
    SILT_RESERVE(size->source, size->source_capacity, n + 1);
    SILT_RESERVE(size->from, size->from_capacity, n + 1);
    SILT_RESERVE(size->front, size->front_capacity, n + 1);
    SILT_RESERVE(size->next, size->next_capacity, n + 1);
    SILT_RESERVE(size->round, size->round_capacity, n + 1);
    for (int k = NEAR_WALLS; k <= NEAR_SURFACE; k++) {
        if (size->reach[k] == 0)
            continue;
        SILT_RESERVE(size->square[k], size->square_capacity[k], n + 1);
        size_spread(size, nodes, mesh, k);
        if (k == NEAR_BODIES)
            size_through_air(size, nodes, mesh);
        if (k == NEAR_WALLS)
            continue;
        size_places *p = &size->places[k];
        p->n = 0;
        for (int i = 0; i < n; i++)
            if (size->square[k][i] == 0)
                places_add(p, nodes->x + size->dim * i, size->dim);
        places_sort(p, size->dim);
    }
    size->updated = true;
    for (int i = 0; i < n; i++) {
        double distance[SIZE_NODE_KIND] = {0};
        for (int k = NEAR_WALLS; k <= NEAR_SURFACE; k++)
            distance[k] = size->reach[k] > 0 ? sqrt(size->square[k][i]) : 0;
        nodes->h[i] = size_combine(size, nodes->x + size->dim * i, distance);
    }
}
