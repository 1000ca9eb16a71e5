// deposition in space: a new node over faces of the surface, joined to as many of them as make a sound place

#include "bed_grow.h"
#include "bed_mesh.h"

#define GROW_LONG 1.8   // times the spacing: longest edge of a new cell
#define GROW_HIGH 0.2   // times the spacing: its smallest height
#define GROW_APART 0.25 // times the spacing: how near the new node may come to faces that it is not joined to
#define GROW_NOTCH (M_PI / 3) // narrower notches beside the new cells are left to no water
#define GROW_WALL 0.5   // times the spacing: a node nearer to a wall where the surface ends goes onto it

// ---- geometry

static double dot3(const double *a, const double *b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

// true when the segment a-b goes through the inside of the triangle
static bool segment_crosses(const double *a, const double *b, const double *p, const double *q, const double *r) {
    const double from = bed_volume6(p, q, r, a), to = bed_volume6(p, q, r, b);
    if (from * to >= 0)
        return false;
    const double u = bed_volume6(a, b, p, q), v = bed_volume6(a, b, q, r), w = bed_volume6(a, b, r, p);
    return (u > 0 && v > 0 && w > 0) || (u < 0 && v < 0 && w < 0);
}

// a cell over a face: no edge too long, no height too small
static bool cell_sound(const silt_bed *bed, const int face[3], const double *x, double size) {
    const double *corner[4] = {bed->x[face[0]], bed->x[face[1]], bed->x[face[2]], x};
    const double volume6 = bed_volume6(corner[0], corner[1], corner[2], x);
    double longest = 0, largest = 0;
    for (int a = 0; a < 4; a++) {
        for (int b = 0; b < a; b++)
            longest = silt_max(longest, bed_apart(3, corner[a], corner[b]));
        const double *p = corner[(a + 1) % 4], *q = corner[(a + 2) % 4], *r = corner[(a + 3) % 4];
        double twice[3];
        for (int d = 0; d < 3; d++) {
            const int e = (d + 1) % 3, f = (d + 2) % 3;
            twice[d] = (q[e] - p[e]) * (r[f] - p[f]) - (q[f] - p[f]) * (r[e] - p[e]);
        }
        largest = silt_max(largest, sqrt(dot3(twice, twice)));
    }
    return longest <= GROW_LONG * size && volume6 >= GROW_HIGH * size * largest;
}

// ---- the surface

// Angle about the edge from -> to of a face whose third corner is `third`, from the face through the water to a place, 0 to 2 pi
static double edge_angle(const silt_bed *bed, const int face[3], int from, int to, int third, const double *x) {
    const double *a = bed->x[from], *b = bed->x[to];
    double along[3], u[3], w[3], step[3];
    silt_bed_facet_normal(bed, face, w);
    for (int d = 0; d < 3; d++) {
        along[d] = b[d] - a[d];
        u[d] = bed->x[third][d] - a[d];
        step[d] = x[d] - a[d];
    }
    const double share = dot3(u, along) / dot3(along, along), length = sqrt(dot3(w, w));
    for (int d = 0; d < 3; d++)
        u[d] -= share * along[d];
    const double angle = atan2(dot3(step, w) / length, dot3(step, u) / sqrt(dot3(u, u)));
    return angle < 0 ? angle + 2 * M_PI : angle;
}

// The surface's face beyond the edge from -> to of a face; where surfaces touch in an edge, the one on the same side. -1: it ends at a wall.
static int surface_beyond(const silt_bed *bed, const int face[3], int k, double *angle) {
    const int from = face[k], to = face[(k + 1) % 3], third = face[(k + 2) % 3];
    int best = -1;
    *angle = HUGE_VAL;
    for (int e = 0; e < bed->n_edge; e++)
        for (int a = 0; a < 3; a++) {
            const int *other = bed->edge[e];
            if (other[a] != to || other[(a + 1) % 3] != from)
                continue;
            const double water = edge_angle(bed, face, from, to, third, bed->x[other[(a + 2) % 3]]);
            if (water < *angle) {
                *angle = water;
                best = e;
            }
        }
    return best;
}

static bool growth_has(const bed_growth3 *growth, int face) {
    for (int k = 0; k < growth->n; k++)
        if (growth->face[k] == face)
            return true;
    return false;
}

// true when another face of the growth lies beyond the edge
static bool growth_inner(const silt_bed *bed, const bed_growth3 *growth, int from, int to) {
    for (int k = 0; k < growth->n; k++)
        for (int a = 0; a < 3; a++) {
            const int *other = bed->edge[growth->face[k]];
            if (other[a] == to && other[(a + 1) % 3] == from)
                return true;
        }
    return false;
}

// A node close to a wall that the face reaches goes onto the wall: no slit stays between.
static bool growth_snap(const silt_bed *bed, double size, int face, bed_growth3 *growth) {
    const silt_walls *walls = bed->walls;
    int near[3], element;
    double on[3];
    growth->wall[0] = growth->wall[1] = growth->wall[2] = -1;
    if (!walls || walls->count == 0)
        return true;
    const int n = silt_walls_touching(walls, growth->x, GROW_WALL * size, near, on);
    int kept = 0;
    for (int k = 0; k < n; k++) {
        bool reached = false;
        for (int a = 0; a < 3; a++)
            for (int s = 0; s < 3; s++) {
                const int own = bed->wall[bed->edge[face][a]][s];
                reached |= own >= 0 && walls->patch[own] == walls->patch[near[k]];
            }
        if (reached)
            growth->wall[kept++] = near[k];
    }
    if (kept == n && n > 0)
        memcpy(growth->x, on, sizeof on);
    for (int k = 0; k < kept && kept < n; k++) {
        const double *normal = walls->normal[growth->wall[k]], *corner = walls->corner[growth->wall[k]][0];
        double off = 0;
        for (int d = 0; d < 3; d++)
            off += (growth->x[d] - corner[d]) * normal[d];
        for (int d = 0; d < 3; d++)
            growth->x[d] -= off * normal[d];
    }
    return silt_walls_distance(walls, growth->x, &element) > -1e-6 * size;
}

// Takes in what lies beyond its edges while the notch there is narrower than `notch` and a sound cell fills it.
// @return false when a notch would stay where the water's mesh could not follow
static bool growth_fill(const silt_bed *bed, double size, double notch, bed_growth3 *growth) {
    for (int k = 0; k < growth->n; k++)
        for (int a = 0; a < 3; a++) {
            const int *face = bed->edge[growth->face[k]], from = face[a], to = face[(a + 1) % 3];
            if (growth_inner(bed, growth, from, to))
                continue;
            double water;
            const int beyond = surface_beyond(bed, face, a, &water);
            if (beyond < 0)
                continue;
            const double left = water - edge_angle(bed, face, from, to, face[(a + 2) % 3], growth->x);
            if (left <= 0)
                return false;
            if (left >= notch)
                continue;
            const bool sound = growth->n < GROW_FACES && cell_sound(bed, bed->edge[beyond], growth->x, size);
            if (!sound && left < GROW_NOTCH)
                return false;
            if (sound)
                growth->face[growth->n++] = beyond;
        }
    return true;
}

// Nothing of the surface comes near to the new node or goes through the new faces, and they cross no wall.
static bool growth_clear(const silt_bed *bed, double size, const bed_growth3 *growth) {
    double lo[3], hi[3];
    memcpy(lo, growth->x, sizeof lo);
    memcpy(hi, growth->x, sizeof hi);
    for (int k = 0; k < 3 * growth->n; k++)
        for (int d = 0; d < 3; d++) {
            const double at = bed->x[bed->edge[growth->face[k / 3]][k % 3]][d];
            lo[d] = silt_min(lo[d], at - GROW_APART * size);
            hi[d] = silt_max(hi[d], at + GROW_APART * size);
        }
    for (int e = 0; e < bed->n_edge; e++) {
        const double *p = bed->x[bed->edge[e][0]], *q = bed->x[bed->edge[e][1]], *r = bed->x[bed->edge[e][2]];
        bool apart = false;
        for (int d = 0; d < 3; d++)
            apart |= silt_min(p[d], silt_min(q[d], r[d])) > hi[d] + GROW_APART * size ||
                     silt_max(p[d], silt_max(q[d], r[d])) < lo[d] - GROW_APART * size;
        if (apart || growth_has(growth, e))
            continue;
        if (silt_bed_facet_distance(bed, bed->edge[e], growth->x) < GROW_APART * size)
            return false;
        for (int k = 0; k < growth->n; k++)
            for (int a = 0; a < 3; a++) {
                const int *face = bed->edge[growth->face[k]], *other = bed->edge[e], from = face[a], to = face[(a + 1) % 3];
                bool has = false;
                for (int c = 0; c < 3; c++)
                    has |= other[c] == from;
                if (!has && segment_crosses(bed->x[from], growth->x, p, q, r))
                    return false;
                for (int c = 0; c < 3 && !growth_inner(bed, growth, from, to); c++) {
                    const int s = other[c], t = other[(c + 1) % 3];
                    if (s != from && s != to && t != from && t != to &&
                        segment_crosses(bed->x[s], bed->x[t], bed->x[from], bed->x[to], growth->x))
                        return false;
                }
            }
    }
    for (int k = 0; k < 3 * growth->n && bed->walls && bed->walls->count; k++) {
        const double *from = bed->x[bed->edge[growth->face[k / 3]][k % 3]];
        double middle[3];
        int element;
        for (int d = 0; d < 3; d++)
            middle[d] = 0.5 * (from[d] + growth->x[d]);
        if (silt_walls_distance(bed->walls, middle, &element) < -1e-6 * size)
            return false;
    }
    return true;
}

bool silt_bed_grow_try(const silt_bed *bed, const silt_scene *scene, int face, const double *x, double lift, double notch, double mass,
                       const silt_bed_others *others, bed_growth3 *growth) {
    const double size = bed_size(scene);
    double normal[3];
    *growth = (bed_growth3){.n = 1, .face = {face}};
    silt_bed_facet_normal(bed, bed->edge[face], normal);
    const double length = sqrt(dot3(normal, normal));
    for (int d = 0; d < 3; d++)
        growth->x[d] = x[d] + lift * normal[d] / length;
    if (!growth_snap(bed, size, face, growth) || !cell_sound(bed, bed->edge[face], growth->x, size) ||
        !growth_fill(bed, size, notch, growth))
        return false;
    for (int k = 0; k < growth->n; k++) {
        const int *own = bed->edge[growth->face[k]];
        const double *const corner[4] = {bed->x[own[0]], bed->x[own[1]], bed->x[own[2]], growth->x};
        growth->volume += bed_volume6(corner[0], corner[1], corner[2], corner[3]) / 6;
        if (!silt_bed_others_in(3, corner, others, &growth->taking))
            return false;
    }
    const double porosity = 1 - (mass + growth->taking.mass) / scene->bed.density / growth->volume;
    return porosity >= 0.2 && porosity <= 0.8 && growth_clear(bed, size, growth);
}

void silt_bed_grow(silt_bed *bed, const silt_scene *scene, const bed_growth3 *growth, double mass, silt_deposit *deposit) {
    int face[GROW_FACES][3], rim[3 * GROW_FACES][3], n_rim = 0;
    const int node = deposit->node = silt_bed_node_add(bed, growth->x);
    memcpy(bed->wall[node], growth->wall, sizeof bed->wall[node]);
    for (int k = 0; k < growth->n; k++) {
        memcpy(face[k], bed->edge[growth->face[k]], sizeof face[k]);
        for (int a = 0; a < 3; a++)
            if (!growth_inner(bed, growth, face[k][a], face[k][(a + 1) % 3]))
                memcpy(rim[n_rim++], (int[3]){face[k][a], face[k][(a + 1) % 3], node}, sizeof rim[0]);
    }
    double left = mass;
    for (int k = 0; k < growth->n; k++) {
        const int cell = silt_bed_cell_add(bed, (int[4]){face[k][0], face[k][1], face[k][2], node}, 0);
        // shared by volume; the last cell takes what rounding left
        bed->mass[cell] = k + 1 < growth->n ? mass * (bed->area[cell] / growth->volume) : left;
        left -= bed->mass[cell];
        deposit->cell[deposit->n_cell++] = cell;
        silt_bed_edge_remove(bed, face[k]);
    }
    for (int k = 0; k < n_rim; k++)
        silt_bed_edge_add(bed, scene, rim[k]);
    silt_bed_refresh(bed);
    // what lies under the new cells is surface no more
    for (int k = 0; k < 3 * growth->n; k++) {
        const int i = face[k / 3][k % 3];
        if (!bed->exposed[i])
            bed->work[i] = bed->eroded[i] = bed->shear[i] = 0;
    }
}

int silt_bed_face_below(const silt_bed *bed, const double *x, double reach, double *distance) {
    int below = -1;
    for (int e = 0; e < bed->n_edge; e++) {
        const double *p = bed->x[bed->edge[e][0]], *q = bed->x[bed->edge[e][1]], *r = bed->x[bed->edge[e][2]];
        if (bed_volume6(p, q, r, x) <= 0)
            continue;
        const double near = silt_bed_facet_distance(bed, bed->edge[e], x);
        if (near <= reach && (below < 0 || near < *distance)) {
            *distance = near;
            below = e;
        }
    }
    return below;
}
