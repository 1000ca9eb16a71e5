/** @file parts.h
 * The mesh's cells in parts, one a thread, so that integrals over cells add to their nodes at the same time and yet in the order of the
 * cells: the sums have the bits that one thread gives. A node belongs to the part of its first cell. What cells of later parts have for it
 * is put aside and added after all parts are through, cell by cell. Cells lie in memory as they lie in space, so that few are such: 3 to
 * 8 % with two parts.
 */
#ifndef SILT_PARTS_H
#define SILT_PARTS_H

#include "pfem.h"
#include "parallel.h"

enum { SPILL_SCALAR = 12, SPILL = 16 }; // what a border cell puts aside: up to three numbers for each of its nodes, then one for each

/** what a kernel adds to */
typedef struct silt_sums {
    int width;    // 1 to 3
    double *wide; // width numbers a node; NULL: none
    double *one;  // one number a node; NULL: none
} silt_sums;

typedef struct silt_parts {
    int n;                          // at least 1
    int first[PARALLEL_MOST + 1];   // first cell of each part, and n_cell
    int border[PARALLEL_MOST + 1];  // first border cell of each part, and how many there are
    int *cell;                      // owned, cells that have a node of an earlier part, rising
    uint8_t *late;                  // owned, per cell: bit a is set where its node a is one of an earlier part
    double *spill;                  // owned, SPILL numbers a border cell
    int n_late, *node, *place;      // owned, nodes that something is put aside for, rising, in the order of the cells; 4 b + a: where
    int split[PARALLEL_MOST + 1];   // where each thread begins with these, and n_late
    int cell_capacity, late_capacity, spill_capacity, node_capacity, place_capacity;
} silt_parts;

/** as many parts as threads are worth it for this mesh */
void silt_parts_make(silt_parts *parts, const silt_mesh *mesh);
void silt_parts_clear(silt_parts *parts);
/** adds what was put aside, for a part of the nodes; after all parts of the cells */
void silt_parts_finish(const silt_parts *parts, silt_sums sums, int part);

/** where a cell's contributions go: to its nodes, or aside */
typedef struct silt_to {
    double *wide, *one;
    const int *at; // place of each of its nodes there
} silt_to;
/** room for border cell b */
static inline silt_to silt_parts_aside(const silt_parts *parts, int b) {
    static const int at[4] = {0, 1, 2, 3};
    double *spill = parts->spill + SPILL * b;
    for (int k = 0; k < SPILL; k++)
        spill[k] = -0.0; // -0 + x has the bits of x for every x
    return (silt_to){spill, spill + SPILL_SCALAR, at};
}
/** after border cell b: what is the part's own is added in its turn */
void silt_parts_settle(const silt_parts *parts, const silt_mesh *mesh, silt_sums sums, int b);

#endif
