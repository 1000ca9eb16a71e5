/** @file pocket.h
 * Closed pockets of air: air.c finds what is air around the water, pocket.c which parts of it are shut in, how much air they hold
 * from step to step, and what it presses with. Only for scenes with fluid.air_pressure > 0; two and three dimensions; not across
 * periodic borders.
 *
 * In a run:
 *   after every rebuild of the mesh    silt_air_find, silt_pockets_update
 *   in the water's step                silt_pockets_load at the midpoint's positions, then in the momentum silt_pockets_force
 *   after the nodes have moved         silt_pockets_advance (before walls, outlets and the rebuild touch the cloud)
 */
#ifndef SILT_POCKET_H
#define SILT_POCKET_H

#include "pfem.h"

// ---------------------------------------------------------------- air.c

/** Cells of air: the Delaunay triangulation of the nodes and of points on dry walls, less water and solid. Where walls are dry the
 * cloud has no nodes; the points stand in for them, far enough off the water that its own cells stay as they are. */
typedef struct silt_air {
    int dim, n_node;       // points up to n_node are the cloud's nodes
    int n_point, n_cell, point_capacity, cell_capacity, open_capacity;
    double *x;             // owned, dim per point, m
    int (*cell)[4];        // owned, points; cell[3] = -1 in 2-D
    uint8_t *open;         // owned, one per cell: 1 when one of its facets has open air beyond
    int n_missing;         // water cells that this triangulation has not (their place counts as water all the same)
} silt_air;

/** Points of the triangulation: water's, bed's, bodies' and corner nodes (drops in flight are left out), then points on dry walls
 * at spacing h and their corners. */
void silt_air_points(silt_air *air, const silt_scene *scene, const silt_nodes *nodes, const silt_mesh *mesh,
                     const silt_walls *walls);
/** true when the triangulation is to leave out a point (a drop in flight, a node without a cell that belongs to nothing) */
bool silt_air_skips(const silt_nodes *nodes, const silt_mesh *mesh, int point);
/** Takes the cells of a triangulation of those points (dim + 1 points each) that are air, and marks what has open air beyond. */
void silt_air_cells(silt_air *air, const silt_scene *scene, const silt_mesh *mesh, const silt_barrier *barrier, int n,
                    const int *cell);
/** All of it: points, Delaunay, cells. Errors: SILT_FAILED, no memory for the triangulation. */
silt_status silt_air_find(silt_air *air, const silt_scene *scene, const silt_nodes *nodes, const silt_mesh *mesh,
                          const silt_barrier *barrier, silt_error *err);
void silt_air_clear(silt_air *air);

/** facets by their nodes, for joining cells */
typedef struct silt_facet_map {
    size_t mask;
    int (*key)[3];  // owned, rising, key[0] = -1: empty
    int *value;     // owned
} silt_facet_map;
void silt_facet_map_create(silt_facet_map *map, int n_facet);
/** Value under the facet; where there is none it becomes `value` and -1 is returned. value < 0: only looks */
int silt_facet_map_put(silt_facet_map *map, int dim, const int *facet, int value);
void silt_facet_map_clear(silt_facet_map *map);

// ---------------------------------------------------------------- pocket.c

typedef struct silt_pocket_state {
    int64_t id;        // never used twice
    double amount;     // m3, volume of its air at fluid.air_pressure
    double volume;     // m3, now
    double jump;       // m3, part of the volume that remeshing made and that the pressure is not told of yet
    double pressure;   // Pa, above the open air's: p_a ((amount/(volume - jump))^exponent - 1)
    double stiffness;  // Pa/m3, -dp/dV = exponent (p_a + pressure)/(volume - jump)
    int first, n_facet;       // its free facets: facet[first] and on
    int first_node, n_node;   // their nodes: node[first_node] and on
} silt_pocket_state;

/** the pockets and their memory; valid when zeroed */
typedef struct silt_pockets {
    int count, capacity, facet_capacity, node_capacity, vector_capacity, member_capacity;
    silt_pocket_state *pocket; // owned
    int *facet;                // owned, free facets of the mesh
    int *node;                 // owned, nodes on pockets, rising in each
    double *vector;            // owned, dim per entry of `node`: its share of the surface, m or m2, out of the water (load)
    int n_member;
    int64_t (*member)[2];      // owned, id of a node and of its pocket, rising: what a pocket is known by after a rebuild
    int64_t next_id;
    double opened;             // m3 of air (at fluid.air_pressure) that was in pockets when they opened or vanished, cumulative
    double enclosed;           // m3 of air that new pockets shut in, cumulative
} silt_pockets;

/** Finds the pockets of a fresh mesh and hands the air of the old ones on: one that splits shares it by volume, those that merge
 * add theirs, one that opens loses it, a new one has the open air's pressure. Pockets under three cells' volume are none.
 * What the rebuild did to a pocket's volume reaches its pressure over fluid.volume_steps calls, so that it does not knock. */
void silt_pockets_update(silt_pockets *pockets, const silt_scene *scene, const silt_nodes *nodes, const silt_mesh *mesh,
                         const silt_air *air);
/** Volumes and pressures after the nodes moved from x_old to x on a straight line: exact for the swept volume. */
void silt_pockets_advance(silt_pockets *pockets, const silt_scene *scene, const silt_mesh *mesh, const double *x_old,
                          const double *x);
/** Surface vectors of the nodes at positions x, and the pressure that belongs to the volume at the step's start. */
void silt_pockets_load(silt_pockets *pockets, const silt_mesh *mesh, const double *x);
/** out += force of the air on the water, N: -(pressure + stiffness dt sum B.w) B with B the vectors; dt: the length of time that w
 * compresses the air for, theta times the step (0: the pressure as it is). The part with w is the symmetric operator
 * stiffness dt B B^T; taken with the last iterate's w it converges where silt_pockets_stiff is well below one. */
void silt_pockets_force(const silt_pockets *pockets, int dim, double dt, const double *w, double *out);
/** Largest dt^2 stiffness sum |B|^2/mass of a pocket: above one the part with w must be solved for. mass: kg per node */
double silt_pockets_stiff(const silt_pockets *pockets, int dim, double dt, const double *mass);
/** checkpoint: "pockets/..." */
silt_status silt_pockets_save(const silt_pockets *pockets, silt_store *store, silt_error *err);
/** as they were when the same mesh was saved */
silt_status silt_pockets_restore(silt_pockets *pockets, const silt_mesh *mesh, silt_store *store, silt_error *err);
void silt_pockets_clear(silt_pockets *pockets);

#endif
