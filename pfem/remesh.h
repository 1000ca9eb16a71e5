/** @file remesh.h
 * What the files of a rebuild share: remesh.c decides what is water, heal.c mends slivers, book.c books the volume.
 */
#ifndef SILT_REMESH_H
#define SILT_REMESH_H

#include "pfem.h"

#define CELL_FLAT 0.02 // cells of less height than this times h are slivers: none is left at the surface, few inside

/** a set of cells by their nodes, in whatever order these are */
typedef struct silt_cell_set {
    int *slot; // owned, index + 1 of the cell, 0 empty
    size_t mask;
    const int (*cell)[4]; // borrowed
} silt_cell_set;
void silt_cell_set_create(silt_cell_set *set, int n, const int (*cell)[4]);
int silt_cell_set_find(const silt_cell_set *set, const int cell[4]); /**< index of the cell, or -1 */

/** a cell's measures */
typedef struct silt_cell_shape {
    double volume; // m2 or m3
    double radius; // m, of the circumscribed circle or sphere
    double height; // m, the smallest: 1/height is the largest gradient of a shape function
} silt_cell_shape;
/** @param corner  dim numbers each, see silt_cell_corners */
silt_cell_shape silt_cell_measure(int dim, const double *corner);
/** wanted size at a cell: the mean of its nodes', m */
double silt_cell_h(const silt_nodes *nodes, int n_corner, const int *cell, double size);
silt_facet_kind silt_facet_kind_of(const silt_mesh *mesh, const silt_nodes *nodes, const int facet[3]);
/** silt_mesh_connect of a mesh whose `across` is right already */
void silt_mesh_connect_known(silt_mesh *mesh, const silt_nodes *nodes);

/** the water while a rebuild works on it: the mesh's cells and what is known about each */
typedef struct silt_draft {
    silt_mesh *mesh;
    int *before;     // owned, one per cell: index in the memory's cells, -1: none, -2: not known yet
    double *quality; // owned, 3-D, one per cell: smallest height over h
    int before_capacity, quality_capacity;
} silt_draft;

/** Mends slivers of tetrahedra by removing edges and facets inside the water, the worst first; the water's volume and its
 * boundary stay. Needs mesh->across and keeps it. @return how many cells flatter than CELL_FLAT are left */
int silt_mesh_heal(silt_draft *draft, const silt_nodes *nodes, double size);
/** Books what the rebuild did to the volume on the nodes' debt (and the exchange of every group in the memory, if asked).
 * @param was_wet  one per node: had a cell before */
void silt_book_volume(const silt_draft *draft, silt_nodes *nodes, silt_memory *memory, const silt_cell_set *old,
                      const uint8_t *was_wet, double size);

#endif
