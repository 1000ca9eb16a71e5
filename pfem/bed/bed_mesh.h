/** @file bed_mesh.h
 * The bed's mesh from inside: cells come and go one by one, and what finds them stays up to date. For bed*.c only.
 */
#ifndef SILT_BED_MESH_H
#define SILT_BED_MESH_H

#include "bed.h"

/** What is derived from nodes and cells. Never saved: it is made again on loading, and nothing depends on its order. */
typedef struct silt_bed_index {
    int node_capacity, cell_capacity;
    int *first;           // owned, one per node: a place 4 cell + corner that holds the node, or -1
    int *next;            // owned, four per cell: the node's next place, or -1
    double (*outward)[3]; // owned, one per node: its share of its exposed edges' normals times their lengths (half), m; faces: a third, m2
    double *length;       // owned, one per node: its share of its exposed edges' lengths, m, in space of faces, m2
    int *surface, *surface_end; // owned, one per node: the first and the last of its places 3 edge + corner in the surface, or -1
    int *surface_next;    // owned, three per edge: the node's next place, rising, or -1
    int surface_capacity, n_dead; // edges that were taken out and still have their place
    double box_lo[3], box_hi[3]; // m, of all nodes that there ever were
    double lo[3], bin;    // a grid of bins as wide as the largest distance of a corner from its cell's centroid
    int n[3], bin_capacity;
    int *head;           // owned, one per bin: a cell whose centroid lies there, or -1
    int *after, *before; // owned, one per cell: its neighbours in the bin
} silt_bed_index;

/** room for so many */
void silt_bed_reserve_nodes(silt_bed *bed, int need);
void silt_bed_reserve_cells(silt_bed *bed, int need);
int silt_bed_node_add(silt_bed *bed, const double *x);
/** node: counter-clockwise (the fourth is -1), or of positive volume. @return the new cell, the last one */
int silt_bed_cell_add(silt_bed *bed, const int *node, double mass);
/** Takes the cell out; the last cell takes its number. */
void silt_bed_cell_remove(silt_bed *bed, int cell);
/** the cell that has the facet among its own (bed_facet), or -1 */
int silt_bed_cell_at(const silt_bed *bed, const int facet[3]);
/** Adds a facet to the surface unless it lies on a wall. */
void silt_bed_edge_add(silt_bed *bed, const silt_scene *scene, const int facet[3]);
/** Its place in the list stays, with -1 for its nodes, until the next refresh. */
void silt_bed_edge_remove(silt_bed *bed, const int facet[3]);
/** After cells or edges changed around these nodes: exposed, index->outward and length of each. */
void silt_bed_refresh_nodes(silt_bed *bed, int n, const int *node);
/** Makes the index for the nodes and cells that there are (creation, loading). */
void silt_bed_index_build(silt_bed *bed);
/** true when the facet lies on a wall */
bool silt_bed_on_wall(const silt_bed *bed, const silt_scene *scene, const int facet[3]);
/** the bed in space (bed_space.c), empty before; index and surface are left to the caller */
silt_status silt_bed_fill_space(silt_bed *bed, const silt_scene *scene, silt_error *err);

static inline int bed_dim(const silt_bed *bed) { return bed->dim == 3 ? 3 : 2; }

/** Facet k of a cell as the surface lists it: the bed on the right of an edge, a face counter-clockwise from outside. */
static inline void bed_facet(int dim, const int *cell, int k, int facet[3]) {
    if (dim == 3) {
        silt_cell_facet(3, cell, k, facet);
        return;
    }
    facet[0] = cell[(k + 1) % 3];
    facet[1] = cell[k];
    facet[2] = -1;
}
/** the same facet from its other side */
static inline void bed_facet_turned(const int facet[3], int turned[3]) {
    turned[0] = facet[1];
    turned[1] = facet[0];
    turned[2] = facet[2];
}

/** twice the signed area of p, q, r */
static inline double bed_cross(const double p[2], const double q[2], const double r[2]) {
    return (q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0]);
}
/** six times the signed volume of p, q, r, s: positive where s sees p, q, r counter-clockwise */
static inline double bed_volume6(const double *p, const double *q, const double *r, const double *s) {
    double a[3], b[3], c[3];
    for (int d = 0; d < 3; d++) {
        a[d] = q[d] - p[d];
        b[d] = r[d] - p[d];
        c[d] = s[d] - p[d];
    }
    return silt_triple(c, a, b);
}
static inline double bed_distance(const double p[2], const double q[2]) {
    return hypot(q[0] - p[0], q[1] - p[1]);
}
/** the same in `dim` dimensions */
static inline double bed_apart(int dim, const double *p, const double *q) {
    const double flat = bed_distance(p, q);
    return dim == 3 ? hypot(flat, q[2] - p[2]) : flat;
}

/** distance of x from the segment p-q */
static inline double bed_segment_distance(const double p[2], const double q[2], const double x[2]) {
    const double dx = q[0] - p[0], dy = q[1] - p[1], length2 = dx * dx + dy * dy;
    const double s = length2 > 0 ? silt_clamp(((x[0] - p[0]) * dx + (x[1] - p[1]) * dy) / length2, 0, 1) : 0;
    return hypot(x[0] - p[0] - s * dx, x[1] - p[1] - s * dy);
}

/** what a new cell would take in besides the parcel */
typedef struct bed_taking {
    int n, other[DEPOSIT_OTHERS]; // in silt_bed_others
    double mass;                  // kg/m, of these
} bed_taking;
/** Adds the grains that a new cell with these corners (dim numbers each, positive volume) holds or comes too near to; see silt_bed_deposit.
 * @return false when one of them is not at rest, or they are too many */
bool silt_bed_others_in(int dim, const double *const corner[4], const silt_bed_others *others, bed_taking *taking);
/** tells the deposit of them */
void silt_bed_others_tell(const silt_bed_others *others, const bed_taking *taking, double mass, silt_deposit *deposit);
/** distance of x from the triangle p, q, r */
double silt_bed_triangle_distance(const double *p, const double *q, const double *r, const double *x);

/** the scene's spacing of the bed's nodes and of the water's */
static inline double bed_size(const silt_scene *scene) {
    return scene->bed.size > 0 ? scene->bed.size : scene->fluid.size;
}

/** straight piece k of a wall */
static inline int bed_wall_pieces(const silt_wall *wall) {
    return wall->closed ? wall->n_point : wall->n_point - 1;
}
static inline const double *bed_wall_point(const silt_wall *wall, int k) {
    return wall->point + 3 * (size_t)(k % wall->n_point);
}

#endif
