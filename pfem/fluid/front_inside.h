/** @file front_inside.h
 * What front_order.c (order of elimination, fronts) and front.c (factor, solve) share.
 */
#ifndef SILT_FRONT_INSIDE_H
#define SILT_FRONT_INSIDE_H

#include "dense.h"
#include "front.h"

#define BRANCH_MOST 16 // subtrees that threads take one by one, at most

/** a node on its way through the dissection */
struct item {
    double x[2];
    double reach; // farthest neighbour, along an axis
    int node;
};

/** columns that are eliminated together, with the rows below them */
struct block {
    int begin, end;  // places in the order
    int negative;    // that many of them, the last, have negative pivots
    int n_child;     // that many blocks before it in the tree
    int first;       // first block of the subtree that it is the last of
    int side;        // stack that its update waits on: parents and children take turns, so that none has to move
    int row_begin, row_end;
    double work;     // of the subtree, multiplications
    size_t value;    // of the panel (end - begin columns of own and row_end - row_begin entries)
};

/** numbers of a block's update */
static inline size_t silt_front_update(const struct block *b) {
    const int rest = b->row_end - b->row_begin;
    return silt_dense_size(rest, 0, rest);
}

/** A node of the tree's top, or a subtree that one thread does. Its last block's update waits here for its parent. */
struct branch {
    int begin, end;  // blocks; of the top: one
    int bad;         // node where the matrix is not positive definite, -1
    bool top;
    float *update;   // owned, until its parent has it
    float *give;     // owned, what the subtree adds to the right side at its last block's rows
    size_t give_capacity;
};

/** what a thread works with */
struct worker {
    float *stack[2];        // owned, updates that wait for their parent; of a factor's time only
    float **column;         // owned, of the present front
    int *waiting;           // owned, blocks on the stacks
    int *local;             // owned, per place: row in the front
    int *at;                // owned, rows of the front that a star or an update goes to
    int *run;               // owned, ends of runs among these
    float *part_right;      // owned, the right side's numbers in a front
    float *right;           // owned, per place: the right side in a subtree and above it
    int column_capacity, waiting_capacity, local_capacity, at_capacity, run_capacity, part_capacity, right_capacity;
};

struct silt_front {
    int n;                  // unknowns
    int unknowns;           // of a node
    int n_block, block_capacity;
    struct block *block;    // owned, children before their parents
    int *order, *place;     // owned, unknown at a place, place of an unknown; nodes until the fronts are known
    int *row;               // owned, places, rising in a block
    int *first;             // owned, of each star, the lowest place
    int *local;             // the first worker's; in the dissection: part
    struct item *item;      // owned, while the order is looked for
    float *value;           // owned, panels, columns one after the other, 1/diagonal in the diagonal's place
    size_t n_value;
    float *whole;           // owned, in the order of elimination: the matrix's diagonal
    float *right;           // owned, in the order of elimination
    int n_branch;
    struct branch branch[BRANCH_MOST]; // children before their parents
    int n_worker;
    struct worker *worker;  // owned
    int order_capacity, place_capacity, row_capacity, first_capacity, right_capacity, whole_capacity, worker_capacity;
    size_t value_capacity, stacked[2]; // most of any subtree
    int widest; // front
    int part;
};

#endif
