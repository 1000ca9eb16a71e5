/** @file remesh.h
 * What the files of a rebuild share: remesh.c decides what is water, heal.c mends slivers, book.c books the volume.
 */
#ifndef SILT_REMESH_H
#define SILT_REMESH_H

#include "pfem.h"

#define CELL_FLAT 0.02 // cells of less height than this times h are slivers: none is left at the surface, few inside

/** A cell's nodes rising, each times four plus its place in the cell; a triangle's fourth is the largest number.
 * @return 1 when that turns the cell inside out */
static inline int silt_cell_sort(const int *cell, uint32_t rising[4]) {
    uint32_t a = 4 * (uint32_t)cell[0], b = 4 * (uint32_t)cell[1] + 1, c = 4 * (uint32_t)cell[2] + 2;
    uint32_t d = cell[3] < 0 ? UINT32_MAX : 4 * (uint32_t)cell[3] + 3, low;
    const int turned = (a > b) ^ (c > d);
    low = a < b ? a : b, b = a < b ? b : a, a = low;
    low = c < d ? c : d, d = c < d ? d : c, c = low;
    const int again = (a > c) ^ (b > d);
    low = a < c ? a : c, c = a < c ? c : a, a = low;
    low = b < d ? b : d, d = b < d ? d : b, b = low;
    const int last = b > c;
    low = b < c ? b : c, c = b < c ? c : b, b = low;
    rising[0] = a, rising[1] = b, rising[2] = c, rising[3] = d;
    return turned ^ again ^ last;
}

/** Items by a number that each has (a node, mostly), for several threads: each counts the items of its part, then puts them where their
 * turn is. The order within a number is that of the items. */
typedef struct silt_bins {
    int n_bin, n_item, n_part;
    int *start; // owned, n_bin + 1: where each number's items begin
    int *at;    // owned, n_bin a part: counts, then places
} silt_bins;
silt_bins silt_bins_create(int n_bin, int n_item);
void silt_bins_place(silt_bins *bins); // between counting and putting
void silt_bins_clear(silt_bins *bins);
static inline int silt_bins_first(const silt_bins *bins, int part) { return (int)((int64_t)bins->n_item * part / bins->n_part); }

/** a set of cells (or of facets, which have no fourth node) by their nodes, in whatever order these are */
typedef struct silt_cell_set {
    int n_node;
    int *start; // owned, n_node + 1: the items whose highest node it is
    struct silt_cell_item {
        int node[3]; // the others, falling
        int cell;    // index
    } * item;        // owned
} silt_cell_set;
void silt_cell_set_create(silt_cell_set *set, int n_node, int n, const int (*cell)[4]);
int silt_cell_set_find(const silt_cell_set *set, const int cell[4]); /**< index of the cell, or -1 */
void silt_cell_set_clear(silt_cell_set *set);

/** Cells by their lowest node, triangles also turned so that it is their first, and then by their second: the order hangs on the
 * nodes' alone.
 * @param node    n_corner each; turned too
 * @param sorted  out, n; a triangle's fourth node is -1 */
void silt_cells_sort(int n_node, int n_corner, int n, int *node, int (*sorted)[4]);

/** The order in which nodes near in space are near in number too, where it pays: many nodes, whose numbers are mixed by now. It hangs on
 * positions and numbers alone, so that a resumed run does the same.
 * @param map    the nodes' numbers from those in the mesh's cells
 * @param order  out, n: the node that is to be the k-th. @return whether it pays */
bool silt_nodes_order(const silt_mesh *mesh, const int *map, const silt_nodes *nodes, double h, int *order);

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
/** true for nodes all on one patch of the walls: they make no cell of water where they lie flat on it */
bool silt_cell_on_wall(const silt_mesh *mesh, const silt_nodes *nodes, const int *cell, const silt_cell_shape *shape, double h);
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

void silt_draft_push(silt_draft *draft, const int cell[4], int before, double quality);
/** Fills the hollows of the draft on edges of the bed, in space on faces of bed and bodies, that the triangulation has lost. Needs
 * mesh->across, which it leaves as it was, and the bed's fluid_node. @return how many cells came, at the end */
int silt_mesh_fit(silt_draft *draft, const silt_nodes *nodes, const silt_barrier *barrier, double size);
/** Mends slivers of tetrahedra by removing edges and facets inside the water, the worst first; the water's volume and
 * its boundary stay. Where that does not help an inner node gives way by a few hundredths of h. Needs mesh->across and
 * keeps it.
 * @param x  the nodes' places (nodes->x); NULL: none gives way
 * @return how many cells flatter than CELL_FLAT are left */
int silt_mesh_heal(silt_draft *draft, const silt_nodes *nodes, double *x, double size);
/** Books what the rebuild did to the volume on the nodes' debt (and the exchange of every group in the memory, if
 * asked).
 * @param was_wet  one per node: had a cell before */
void silt_book_volume(const silt_draft *draft, silt_nodes *nodes, silt_memory *memory, const silt_cell_set *old,
                      const uint8_t *was_wet, double size);

#endif
