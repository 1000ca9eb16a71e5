// deposition: a parcel at rest gives its mass back, as a cell between it and the surface or into the pores of one there

#include "bed_grow.h"
#include "bed_mesh.h"

enum { CHAIN = 7 }; // most nodes of the surface that one new node is joined to

// a new node x and the stretch of surface node[0] -> ... -> node[n - 1] that it would cover
typedef struct bed_growth {
    double x[2];
    int n, node[CHAIN];
    double area;
    bed_taking taking;
} bed_growth;

// angle swept counter-clockwise from at -> p to at -> q, 0 to 2 pi
static double growth_angle(const double at[2], const double p[2], const double q[2]) {
    const double a = atan2(q[1] - at[1], q[0] - at[0]) - atan2(p[1] - at[1], p[0] - at[0]);
    return a < 0 ? a + 2 * M_PI : a;
}

static bool growth_sound(const double p[2], const double q[2], const double r[2], double size) {
    const double longest = silt_max(bed_distance(p, q), silt_max(bed_distance(q, r), bed_distance(r, p)));
    return longest <= 1.8 * size && bed_cross(p, q, r) > 0.25 * size * longest;
}

// distance between two segments, 0 when they cross
static double segment_gap(const double a[2], const double b[2], const double c[2], const double d[2]) {
    if (bed_cross(a, b, c) * bed_cross(a, b, d) < 0 && bed_cross(c, d, a) * bed_cross(c, d, b) < 0)
        return 0;
    return silt_min(silt_min(bed_segment_distance(a, b, c), bed_segment_distance(a, b, d)),
                    silt_min(bed_segment_distance(c, d, a), bed_segment_distance(c, d, b)));
}

// The surface's next node after the edge from -> at (forward), or the one before at -> from (backward): where surfaces
// touch in a node, the one on the same side. -1: the surface ends here at a wall.
static int surface_next(const silt_bed *bed, int at, int from, bool forward) {
    int best = -1;
    double least = HUGE_VAL;
    for (int e = 0; e < bed->n_edge; e++) {
        if (bed->edge[e][!forward] != at)
            continue;
        const int k = bed->edge[e][forward];
        // the water's angle at the node, between the two edges
        const double angle = forward ? growth_angle(bed->x[at], bed->x[k], bed->x[from])
                                     : growth_angle(bed->x[at], bed->x[from], bed->x[k]);
        if (angle < least) {
            least = angle;
            best = k;
        }
    }
    return best;
}

// A node close to a wall where the surface ends goes onto the wall: no slit stays between.
static void growth_snap(const silt_bed *bed, const silt_scene *scene, bed_growth *growth) {
    const double size = bed_size(scene);
    double nearest = 0.5 * size, place[2] = {growth->x[0], growth->x[1]};
    for (int w = 0; w < scene->n_wall; w++)
        for (int k = 0; k < bed_wall_pieces(&scene->wall[w]); k++) {
            const double *p = bed_wall_point(&scene->wall[w], k), *q = bed_wall_point(&scene->wall[w], k + 1);
            const double distance = bed_segment_distance(p, q, growth->x);
            if (distance >= nearest || (bed_segment_distance(p, q, bed->x[growth->node[0]]) > 1e-6 * size &&
                                        bed_segment_distance(p, q, bed->x[growth->node[1]]) > 1e-6 * size))
                continue;
            const double length2 = silt_square(bed_distance(p, q));
            const double s = ((growth->x[0] - p[0]) * (q[0] - p[0]) + (growth->x[1] - p[1]) * (q[1] - p[1])) / length2;
            if (s <= 0 || s >= 1)
                continue;
            nearest = distance;
            place[0] = p[0] + s * (q[0] - p[0]);
            place[1] = p[1] + s * (q[1] - p[1]);
        }
    memcpy(growth->x, place, sizeof place);
}

// Lengthens the stretch at one end while the notch beside the new node is narrower than 100 degrees and a sound cell
// fills it. @return false when a notch of less than 60 degrees would stay, where the water's mesh could not follow
static bool growth_fill(const silt_bed *bed, double size, bed_growth *growth, bool forward) {
    while (growth->n < CHAIN) {
        const int end = growth->node[forward ? growth->n - 1 : 0], inner = growth->node[forward ? growth->n - 2 : 1];
        const int next = surface_next(bed, end, inner, forward);
        if (next < 0)
            return true;
        const double *at = bed->x[end], *far = bed->x[next];
        const double water = forward ? growth_angle(at, far, bed->x[inner]) : growth_angle(at, bed->x[inner], far);
        const double notch = forward ? growth_angle(at, far, growth->x) : growth_angle(at, growth->x, far);
        // the new node must lie on the water's side of this edge too
        if (notch >= water)
            return false;
        if (notch >= 100 * M_PI / 180)
            return true;
        const bool sound = forward ? growth_sound(at, far, growth->x, size) : growth_sound(far, at, growth->x, size);
        if (!sound)
            return notch >= M_PI / 3;
        if (next == growth->node[forward ? 0 : growth->n - 1])
            return false;
        if (!forward)
            memmove(growth->node + 1, growth->node, (size_t)growth->n * sizeof *growth->node);
        growth->node[forward ? growth->n : 0] = next;
        growth->n++;
    }
    return false;
}

static bool growth_covers(const bed_growth *growth, int a, int b) {
    for (int k = 0; k + 1 < growth->n; k++)
        if (growth->node[k] == a && growth->node[k + 1] == b)
            return true;
    return false;
}

// Nothing of the bed lies inside the new cells, their outer sides keep clear of the surface elsewhere and cross no
// wall; no needles: sides of at least half a spacing and 70 degrees between them.
static bool growth_clear(const silt_bed *bed, const silt_scene *scene, const bed_growth *growth) {
    const double size = bed_size(scene);
    const double *left = bed->x[growth->node[0]], *right = bed->x[growth->node[growth->n - 1]];
    if (growth_angle(growth->x, left, right) < 70 * M_PI / 180)
        return false;
    for (int end = 0; end < 2; end++) {
        const int node = growth->node[end ? growth->n - 1 : 0];
        if (bed_distance(bed->x[node], growth->x) < 0.5 * size)
            return false;
        for (int e = 0; e < bed->n_edge; e++) {
            const int a = bed->edge[e][0], b = bed->edge[e][1];
            if (a == node || b == node || growth_covers(growth, a, b))
                continue;
            if (segment_gap(bed->x[node], growth->x, bed->x[a], bed->x[b]) < 0.15 * size)
                return false;
        }
        for (int w = 0; w < scene->n_wall; w++)
            for (int k = 0; k < bed_wall_pieces(&scene->wall[w]); k++) {
                const double *p = bed_wall_point(&scene->wall[w], k), *q = bed_wall_point(&scene->wall[w], k + 1);
                const double close = 1e-6 * size * bed_distance(p, q);
                const double s = bed_cross(p, q, bed->x[node]), t = bed_cross(p, q, growth->x);
                if (((s > close && t < -close) || (s < -close && t > close)) &&
                    bed_cross(bed->x[node], growth->x, p) * bed_cross(bed->x[node], growth->x, q) < 0)
                    return false;
            }
    }
    for (int e = 0; e < bed->n_edge; e++)
        for (int k = 0; k + 1 < growth->n; k++) {
            const int i = bed->edge[e][0], a = growth->node[k], b = growth->node[k + 1];
            if (i != a && i != b && bed_cross(bed->x[a], bed->x[b], bed->x[i]) >= 0 &&
                bed_cross(bed->x[b], growth->x, bed->x[i]) >= 0 && bed_cross(growth->x, bed->x[a], bed->x[i]) >= 0)
                return false;
        }
    return true;
}

// Would the bed grow soundly by cells between the edge and x, with a porosity between 0.2 and 0.8? Where the parcel's
// centre leaves it too little room the new node goes up to the parcel's top.
static bool growth_try(const silt_bed *bed, const silt_scene *scene, int edge, const double x[2], double lift,
                       double mass, const silt_bed_others *others, bed_growth *growth) {
    const double size = bed_size(scene);
    const double *p = bed->x[bed->edge[edge][0]], *q = bed->x[bed->edge[edge][1]], length = bed_distance(p, q);
    *growth = (bed_growth){.n = 2, .node = {bed->edge[edge][0], bed->edge[edge][1]}};
    growth->x[0] = x[0] - lift * (q[1] - p[1]) / length;
    growth->x[1] = x[1] + lift * (q[0] - p[0]) / length;
    growth_snap(bed, scene, growth);
    if (!growth_sound(bed->x[growth->node[0]], bed->x[growth->node[1]], growth->x, size) ||
        !growth_fill(bed, size, growth, true) || !growth_fill(bed, size, growth, false) ||
        !growth_clear(bed, scene, growth))
        return false;
    for (int k = 0; k + 1 < growth->n; k++) {
        const double *const corner[4] = {bed->x[growth->node[k]], bed->x[growth->node[k + 1]], growth->x};
        growth->area += 0.5 * bed_cross(corner[0], corner[1], corner[2]);
        if (!silt_bed_others_in(2, corner, others, &growth->taking))
            return false;
    }
    const double porosity = 1 - (mass + growth->taking.mass) / scene->bed.density / growth->area;
    return porosity >= 0.2 && porosity <= 0.8;
}

static void growth_commit(silt_bed *bed, const silt_scene *scene, const bed_growth *growth, double mass,
                          silt_deposit *deposit) {
    deposit->node = silt_bed_node_add(bed, growth->x);
    double left = mass;
    for (int k = 0; k + 1 < growth->n; k++) {
        const int a = growth->node[k], b = growth->node[k + 1];
        const int cell = silt_bed_cell_add(bed, (int[3]){a, b, deposit->node}, 0);
        // shared by area; the last cell takes what rounding left
        bed->mass[cell] = k + 2 < growth->n ? mass * (bed->area[cell] / growth->area) : left;
        left -= bed->mass[cell];
        deposit->cell[deposit->n_cell++] = cell;
        silt_bed_edge_remove(bed, (int[3]){a, b, -1});
    }
    silt_bed_edge_add(bed, scene, (int[3]){growth->node[0], deposit->node, -1});
    silt_bed_edge_add(bed, scene, (int[3]){deposit->node, growth->node[growth->n - 1], -1});
    silt_bed_refresh(bed);
    // what lies under the new cells is surface no more
    for (int k = 0; k < growth->n; k++)
        if (!bed->exposed[growth->node[k]])
            bed->work[growth->node[k]] = bed->eroded[growth->node[k]] = bed->shear[growth->node[k]] = 0;
    deposit->area = growth->area;
}

// The edge nearest to x with x on the water's side, and cells over it. @return the edge, -1: none within reach
static int deposit_plane(silt_bed *bed, const silt_scene *scene, const double *x, double r, double mass, const silt_bed_others *others,
                         silt_deposit *deposit) {
    // at a convex node two edges are equally near
    const double reach = r + 0.35 * bed_size(scene), tie = 0.01 * bed_size(scene);
    double nearest = reach;
    int below = -1;
    for (int e = 0; e < bed->n_edge; e++) {
        const double *p = bed->x[bed->edge[e][0]], *q = bed->x[bed->edge[e][1]];
        const double distance = bed_segment_distance(p, q, x);
        if (bed_cross(p, q, x) > 0 && (distance < nearest || (below < 0 && distance <= reach))) {
            nearest = distance;
            below = e;
        }
    }
    if (below < 0 || silt_bed_contains(bed, x))
        return -1;
    bed_growth growth;
    for (int pass = 0; pass < 2; pass++)
        for (int e = 0; e < bed->n_edge; e++) {
            const double *p = bed->x[bed->edge[e][0]], *q = bed->x[bed->edge[e][1]];
            if ((pass == 0) != (e == below) || bed_cross(p, q, x) <= 0 ||
                bed_segment_distance(p, q, x) > silt_min(nearest + tie, reach))
                continue;
            for (int lift = 0; lift <= 4; lift++)
                if (growth_try(bed, scene, e, x, 0.25 * lift * r, mass, others, &growth)) {
                    silt_bed_others_tell(others, &growth.taking, mass, deposit);
                    growth_commit(bed, scene, &growth, deposit->mass, deposit);
                    return below;
                }
        }
    return below;
}

// the same with faces; where few of them leave the mass too little room, the notches beside the new cells are filled up
static int deposit_space(silt_bed *bed, const silt_scene *scene, const double *x, double r, double mass, const silt_bed_others *others,
                         silt_deposit *deposit) {
    static const double notch[] = {100, 140, 170};
    double distance;
    const int below = silt_bed_face_below(bed, x, r + 0.35 * bed_size(scene), &distance);
    if (below < 0 || silt_bed_contains(bed, x))
        return -1;
    bed_growth3 growth;
    for (int width = 0; width < 3; width++)
        for (int lift = 0; lift <= 4; lift++)
            if (silt_bed_grow_try(bed, scene, below, x, 0.25 * lift * r, notch[width] * M_PI / 180, mass, others, &growth)) {
                silt_bed_others_tell(others, &growth.taking, mass, deposit);
                silt_bed_grow(bed, scene, &growth, deposit->mass, deposit);
                deposit->area = growth.volume;
                return below;
            }
    return below;
}

silt_deposit_kind silt_bed_deposit(silt_bed *bed, const silt_scene *scene, const double *x, double r, double mass,
                                   const silt_bed_others *others, silt_deposit *deposit) {
    *deposit = (silt_deposit){.kind = DEPOSIT_REFUSED, .node = -1};
    if (!(mass > 0) || bed->n_edge == 0)
        return deposit->kind;
    const int below = (bed_dim(bed) == 3 ? deposit_space : deposit_plane)(bed, scene, x, r, mass, others, deposit);
    if (below < 0)
        return deposit->kind;
    if (deposit->n_cell > 0) {
        deposit->kind = DEPOSIT_CELL;
        deposit->pore_water = scene->bed.saturation * (deposit->area - deposit->mass / scene->bed.density) * scene->fluid.density;
        silt_sum(&bed->pore_water, &bed->pore_rest, -deposit->pore_water);
        return deposit->kind;
    }

    // no room for a cell: into the pores of the one under the edge
    const int cell = silt_bed_cell_at(bed, bed->edge[below]);
    if (1 - (bed->mass[cell] + mass) / scene->bed.density / bed->area[cell] < 0.2)
        return deposit->kind;
    bed->mass[cell] += deposit->mass = mass;
    silt_bed_refresh(bed);
    deposit->kind = DEPOSIT_DENSER;
    deposit->pore_water = -scene->bed.saturation * mass / scene->bed.density * scene->fluid.density;
    silt_sum(&bed->pore_water, &bed->pore_rest, -deposit->pore_water);
    return deposit->kind;
}
