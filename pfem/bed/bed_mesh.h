/** @file bed_mesh.h
 * The bed's mesh from inside: cells come and go one by one, and what finds them stays up to date. For bed*.c only.
 */
#ifndef SILT_BED_MESH_H
#define SILT_BED_MESH_H

#include "bed.h"

/** What is derived from nodes and cells. Never saved: it is made again on loading, and nothing depends on its order. */
typedef struct silt_bed_index {
    int node_capacity, cell_capacity;
    int *first;           // owned, one per node: a place 3 cell + corner that holds the node, or -1
    int *next;            // owned, three per cell: the node's next place, or -1
    double (*outward)[2]; // owned, one per node: half the sum of its exposed edges' normals times their lengths, m
    double *length;       // owned, one per node: half the sum of its exposed edges' lengths, m
    double lo[2], bin;    // a grid of bins as wide as the largest distance of a corner from its cell's centroid
    int nx, ny, bin_capacity;
    int *head;           // owned, one per bin: a cell whose centroid lies there, or -1
    int *after, *before; // owned, one per cell: its neighbours in the bin
} silt_bed_index;

int silt_bed_node_add(silt_bed *bed, const double x[2]);
/** a, b, c counter-clockwise. @return the new cell, the last one */
int silt_bed_cell_add(silt_bed *bed, int a, int b, int c, double mass);
/** Takes the cell out; the last cell takes its number. */
void silt_bed_cell_remove(silt_bed *bed, int cell);
/** the cell that has a -> b as one of its counter-clockwise edges, or -1 */
int silt_bed_cell_at(const silt_bed *bed, int a, int b);
/** Adds a -> b (bed on the right) to the surface unless it lies on a wall. */
void silt_bed_edge_add(silt_bed *bed, const silt_scene *scene, int a, int b);
void silt_bed_edge_remove(silt_bed *bed, int a, int b);
/** After cells or edges changed: exposed, index->outward and length, solid_mass; raises the revision. */
void silt_bed_refresh(silt_bed *bed);
/** Makes the index for the nodes and cells that there are (creation, loading). */
void silt_bed_index_build(silt_bed *bed);
/** true when both ends lie on one and the same straight piece of a wall */
bool silt_bed_on_wall(const silt_scene *scene, const double p[2], const double q[2]);

/** twice the signed area of p, q, r */
static inline double bed_cross(const double p[2], const double q[2], const double r[2]) {
    return (q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0]);
}
static inline double bed_distance(const double p[2], const double q[2]) {
    return hypot(q[0] - p[0], q[1] - p[1]);
}

/** distance of x from the segment p-q */
static inline double bed_segment_distance(const double p[2], const double q[2], const double x[2]) {
    const double dx = q[0] - p[0], dy = q[1] - p[1], length2 = dx * dx + dy * dy;
    const double s = length2 > 0 ? silt_clamp(((x[0] - p[0]) * dx + (x[1] - p[1]) * dy) / length2, 0, 1) : 0;
    return hypot(x[0] - p[0] - s * dx, x[1] - p[1] - s * dy);
}

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
