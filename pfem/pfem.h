/** @file pfem.h
 * The data model on a page, in the order of the flow: nodes -> mesh -> fluid -> bed -> coupling -> ledger -> run.
 * Vectors are interleaved, `dim` numbers a node; in 2-D masses, volumes and forces are per metre of width. Cells are triangles
 * (the fourth node is -1) or tetrahedra, facets their edges (third node -1) or faces.
 * All structs are valid when zeroed. "owned": freed by the struct's own *_clear.
 */
#ifndef SILT_PFEM_H
#define SILT_PFEM_H

#include "scene.h"

typedef struct silt_bed silt_bed;

// ---------------------------------------------------------------- nodes

typedef enum {
    NODE_FLUID = 0, // a particle of water: moves with its velocity; may slide or stick on tank walls (wall[])
    NODE_CORNER,    // stays at a vertex or crease of the walls that points into the water; owner: element of the walls
    NODE_BED,       // on the bed's surface, fixed while the bed stands; owner: bed node
    NODE_BODY,      // on the outline of a rigid object, moves with it; owner: body
    NODE_INLET,     // stays on the inlet line or polygon, velocity prescribed; owner: inlet
    NODE_OPEN,      // stays on an opening behind which water stands at a level, on the surface slides along it; owner: opening
} silt_node_kind;

typedef struct silt_nodes {
    int dim;         // 2 or 3; 0 counts as 2
    int count;
    int capacity;
    double *x;       // owned, dim per node, position, m
    double *v;       // owned, dim per node, velocity, m/s
    double *p;       // owned, pressure, Pa
    double *h;       // owned, wanted distance to the neighbours, m; NULL where it is fluid.size everywhere (silt_node_h)
    double *eddy;    // owned, m2/s, what Spalart and Allmaras carry with the water; NULL with another model or none
    double *debt;    // owned, m3: volume that remeshing took from the water here and that is owed to it (negative: too much)
    int64_t *id;     // owned, never used twice
    uint8_t *kind;   // owned, silt_node_kind
    int *owner;      // owned, see silt_node_kind, else -1
    int (*wall)[3];  // owned, elements of silt_walls that the node lies on (two in a crease, three in a corner), -1
    int64_t next_id;
} silt_nodes;

static inline int silt_nodes_dim(const silt_nodes *nodes) { return nodes->dim == 3 ? 3 : 2; }
/** wanted distance of node i to its neighbours; size: fluid.size */
static inline double silt_node_h(const silt_nodes *nodes, int i, double size) {
    return nodes->h && nodes->h[i] > 0 ? nodes->h[i] : size; // 0: added since the last silt_size_update
}

// ---------------------------------------------------------------- walls (wall.c)

/** where a moving wall of the scene stands and how it moves */
typedef struct silt_wall_motion {
    double shift[3], angle;   // m and rad, from the place in the scene; the angle turns from x to y, in 3-D from x to z
    double velocity[3], spin; // m/s of the centre, rad/s
    double centre[3];         // m, what it turns about, at its present place
} silt_wall_motion;

/** The tank: flat elements, segments in 2-D (water on the left of from -> to), triangles in 3-D (counter-clockwise as the
 * water sees them). */
typedef struct silt_walls {
    int dim;
    int count;
    double (*from)[2], (*to)[2]; // owned, m, 2-D: ends of the segment
    double (*corner)[3][3];      // owned, m, 3-D: corners of the triangle
    double (*normal)[3];         // owned, unit, into the water
    int *wall;                   // owned, index in scene->wall
    int *patch;                  // owned, elements that bend gently into each other share a number: nodes of one patch
    uint8_t *slip;               // owned, 1: water slides along
    double *roughness;           // owned, m, k_s of the wall law, 0 smooth, -1: no wall law
    int *next, *previous;        // owned, 2-D: segment joined at `to` / at `from`, -1
    int (*joined)[3];            // owned, 3-D: element across the edge that starts at each corner, -1
    int n_wall;
    double time;                 // s, at which those that move stand where they are
    silt_wall_motion *motion;    // owned, one per wall of the scene
    int n_degenerate;            // triangles of surface files without area, left out
    struct silt_wall_index *index; // owned, elements by place, what moves (wall.h)
} silt_walls;

/** which components of a node's velocity are held */
typedef enum { HOLD_FREE = 0, HOLD_NORMAL, HOLD_ALL, HOLD_LINE } silt_hold; // LINE: free along one direction only

/** Builds the walls of a scene where they stand at time 0: polylines in 2-D, boxes and surfaces from files in 3-D. Elements that
 * meet are joined, also of different walls, but not with a wall that moves. Errors (SILT_INPUT): a surface file that cannot
 * serve, see wall.h; the walls are empty then. */
silt_status silt_walls_create(silt_walls *walls, const silt_scene *scene, silt_error *err);
void silt_walls_clear(silt_walls *walls);
/** Places the walls that move where they are at `time`; their velocities are those that carry them there from `time - dt`.
 * @param dt  s, the step that ends at `time`; 0: the velocity of that moment */
void silt_walls_move(silt_walls *walls, const silt_scene *scene, double time, double dt);
/** How the elements hold a node: vector is the unit normal (HOLD_NORMAL) or the free direction (HOLD_LINE) */
silt_hold silt_walls_hold(const silt_walls *walls, const int element[3], double vector[3]);
/** Velocity of the wall's material that was at x at the start of the step, m/s: the way that it goes in the step over dt, and
 * the surface's velocity along itself. */
void silt_walls_velocity(const silt_walls *walls, const silt_scene *scene, int element, const double *x, double v[3]);
/** The held part of the velocity of a node at x (start of the step): along the normal (HOLD_NORMAL), across the line (HOLD_LINE),
 * all of it (HOLD_ALL), 0 (HOLD_FREE). A node that moves with it and any free part lands on the walls where they are now. */
void silt_walls_given(const silt_walls *walls, const silt_scene *scene, const int element[3], const double *x, double v[3]);
/** Normals at nodes on patches that bend: those of the water's own facets on the patch around the node, weighted with their size.
 * With the elements' normals water would pass between nodes on two sides of a bend (Engelman, Sani and Gresho 1982). */
typedef struct silt_wall_normals {
    int n_row, row_capacity, normal_capacity;
    int *row;               // owned, one per node: its row of normals, -1: the elements' normals; NULL without bent patches
    double (*normal)[3][3]; // owned, one for each of the node's elements, unit
} silt_wall_normals;
struct silt_mesh;
/** @param x  positions that the facets have when what passes through them is counted: those of the midpoint mesh. Normals of any
 * other moment leave a rest that a full tank can only answer with a pressure without bounds. */
void silt_wall_normals_take(silt_wall_normals *normals, const silt_walls *walls, const silt_nodes *nodes, const struct silt_mesh *mesh,
                            const double *x);
void silt_wall_normals_clear(silt_wall_normals *normals);
/** silt_walls_hold and silt_walls_given in one, with those normals. @param normals  NULL: the elements' */
silt_hold silt_walls_held(const silt_walls *walls, const silt_scene *scene, const silt_wall_normals *normals, const silt_nodes *nodes,
                          int i, double vector[3], double given[3]);
/** true when the nodes share a patch: a facet between them lies on the wall */
bool silt_walls_share(const silt_walls *walls, int n, const int *const element[]);
/** Signed distance of a point to the nearest element, positive on the water's side; *element is that element (-1: no walls,
 * distance +inf). At edges and vertices the side is decided by the elements that meet there; inside of a closed obstacle it
 * is negative whatever else is near. */
double silt_walls_distance(const silt_walls *walls, const double *point, int *element);
/** Elements within reach of x that turn by more than 30 degrees from each other: none, or up to as many as dimensions, the nearest
 * first, the rest -1; on is the point that lies exactly on all of them (x itself where there is none). @return how many */
int silt_walls_touching(const silt_walls *walls, const double *x, double reach, int element[3], double on[3]);
/** Where fixed nodes (NODE_CORNER) keep the shape of walls that point into the water: corners in 2-D, edges in 3-D with points at
 * spacing h, bends above 30 degrees. Not where the edge lies on another wall (the foot of a gate, of a box on the floor).
 * @return how many; *point (3 numbers each) and *element (owner first, then others, -1) are malloc'ed, owned by the caller */
int silt_walls_ridges(const silt_walls *walls, double h, double **point, int (**element)[3]);
/** Nodes that lie on walls, after all nodes have moved from x_old: carries fixed nodes and those on walls without slip with their
 * walls, puts the others exactly on, lets them slide over bends and along creases, stop in corners and come free at edges,
 * attaches what has come through a wall or touches it, fills empty creases and corners with the nearest node.
 * @param flying  one per node: 1 for drops, which fill no creases; NULL: none */
void silt_walls_contact(const silt_walls *walls, silt_nodes *nodes, const double *x_old, const uint8_t *interior,
                        const uint8_t *flying, double h);

// ---------------------------------------------------------------- nodes (node.c, seed.c)

void silt_nodes_clear(silt_nodes *nodes);
/** appends a node with zero fields; @return its index. silt_nodes_eddies: from here on they have an eddy viscosity */
void silt_nodes_eddies(silt_nodes *nodes);
int silt_nodes_add(silt_nodes *nodes, silt_node_kind kind, int owner, const double *x);
/** Removes nodes with dead[i] != 0, keeps the order; map[i] is the new index or -1 */
void silt_nodes_compact(silt_nodes *nodes, const uint8_t *dead, int *map);
/** Puts the nodes in another order: order[k] becomes the k-th */
void silt_nodes_arrange(silt_nodes *nodes, const int *order);
/** Fills the scene's regions with water nodes, inlets and tank corners; leaves out what lies in `solid` (bed, bodies). With
 * fluid.sizes the spacing is the local one and nodes->h is written. */
typedef bool (*silt_solid_test)(const void *context, const double *x, double margin);
void silt_nodes_seed(silt_nodes *nodes, const silt_scene *scene, const silt_walls *walls, silt_solid_test solid,
                     const void *context);
/** The same with the water's nodes from the file fluid.cloud: columns x, y[, z] and, if there, vx, vy[, vz], which then win over
 * fluid.velocity. Nodes on walls are put onto them, those on inlets and tank corners are left out.
 * Errors: SILT_INPUT, file and line of what is missing, not a number, behind a wall, in a solid, or there twice. */
silt_status silt_nodes_read(silt_nodes *nodes, const silt_scene *scene, const silt_walls *walls, silt_solid_test solid,
                            const void *context, silt_error *err);
/** Points along a closed outline at spacing h, corners kept. @return how many; xy malloc'ed, owned by the caller */
int silt_outline_points(int n, const double *outline, double h, double **xy);

// ---------------------------------------------------------------- size field (size.c)

typedef struct silt_size silt_size; // NULL: fluid.size everywhere
/** Made from fluid.sizes; NULL without them. */
void silt_size_create(silt_size **size, const silt_scene *scene, const silt_walls *walls);
/** Follows what moves (surface, bed, bodies, wet walls) and writes nodes->h of every node; to be called after every rebuild. */
struct silt_mesh;
void silt_size_update(silt_size *size, silt_nodes *nodes, const struct silt_mesh *mesh);
/** Points that stand for surface, bed or bodies until the first update, dim numbers each (the first cloud needs them). */
void silt_size_near(silt_size *size, silt_near near, int n, const double *x);
/** wanted distance between nodes at a point, m (at the last update); size NULL: fluid.size */
double silt_size_at(const silt_size *size, const silt_scene *scene, const double *x);
void silt_size_free(silt_size **size);
/** signed distance from a region, m, negative inside; dim 3: polygons are upright prisms in x-z, circles are spheres */
double silt_region_distance(const silt_region *region, int dim, const double *x);

// ---------------------------------------------------------------- mesh (mesh.c)

/** kinds of boundary facets */
typedef enum { FACET_FREE = 0, FACET_WALL, FACET_BED, FACET_BODY, FACET_INLET, FACET_OPEN } silt_facet_kind;

typedef struct silt_mesh {
    int64_t revision;  // rises at every rebuild; what is derived from the topology remembers it
    int dim;           // 2 or 3; 0 counts as 2
    double period[3];  // m, length of the domain where it is periodic, else 0: cells join nodes across it by the shortest way
    int n_node;        // nodes that the arrays below were made for
    int n_cell;
    int cell_capacity;
    int (*cell)[4];    // owned, nodes of the water's cells: counter-clockwise triangles (cell[3] = -1), or tetrahedra of positive volume
    int n_facet;
    int facet_capacity;
    int (*facet)[3];   // owned, the water's boundary: edges with water on the left (facet[2] = -1), or faces, counter-clockwise from outside
    uint8_t *facet_kind; // owned, silt_facet_kind
    const silt_walls *walls; // borrowed, tells which nodes share a wall's patch; NULL: nodes of one element do (set by the rebuild)
    int (*across)[4];  // owned, cell on the other side of the facet opposite each node of a cell, -1 on the boundary
    uint8_t *wet;      // owned, one per node: 1 when the node has a cell
    uint8_t *surface;  // owned, one per node: 1 when the node has a free facet
    int *node_cell_start, *node_cell; // owned, cells of a node (start has n_node + 1)
    int *neighbour_start, *neighbour; // owned, nodes joined to a node by an edge, itself included, rising
    int wet_capacity, surface_capacity, start_capacity, neighbour_start_capacity, node_cell_capacity, neighbour_capacity;
    int facet_kind_capacity, across_capacity;
} silt_mesh;

/** Derived data of the topology: adjacency, boundary facets, wet and surface flags. Raises the revision. Takes the dimension
 * from the nodes; the caller of a mesh read back sets mesh->walls and mesh->period before. */
void silt_mesh_connect(silt_mesh *mesh, const silt_nodes *nodes);
/** Cells on the other side of each facet (opposite each node), -1: none. Any set of cells in which a facet has at most two. */
void silt_cells_across(int dim, int n_node, int n_cell, const int (*cell)[4], int (*across)[4]);
/** nodes of the facet opposite node a of a cell, turned as facets of the boundary are */
void silt_cell_facet(int dim, const int *cell, int a, int facet[3]);
/** true when the nodes share a patch of the mesh's walls */
bool silt_mesh_share(const silt_mesh *mesh, const silt_nodes *nodes, int n, const int *node);
void silt_mesh_clear(silt_mesh *mesh);
/** Pattern of a symmetric matrix over nodes and their neighbours: the lower triangle by columns, rows rising. start: n_node + 1 numbers,
 * index: as many as the lists hold pairs with j >= i */
void silt_mesh_lower(const silt_mesh *mesh, int *start, int *index);
/** where the neighbour j of node i stands in mesh->neighbour */
int silt_neighbour_index(const silt_mesh *mesh, int i, int j);
double silt_cell_area(const double *x, const int *cell); // 2-D
/** m2 or m3 of a triangle or tetrahedron from its corners, dim numbers each */
double silt_simplex_volume(int dim, const double *corner);
/** m2 or m3 of a cell of the mesh, across a periodic border too */
double silt_cell_volume(const silt_mesh *mesh, const double *x, int e);
/** corners of a cell, dim numbers each, joined the shortest way across a periodic border */
void silt_cell_corners(const silt_mesh *mesh, const double *x, const int *cell, double *corner);
/** Groups of nodes (parent[i] = i at the start): the group's lowest node; and one group of a cell's three */
int silt_group_find(int *parent, int i);
void silt_group_join(int *parent, const int *cell); // a cell's nodes (cell[3] < 0: three) into one group
/** m3, sum of the cells */
double silt_mesh_volume(const silt_mesh *mesh, const double *x);

/** What was water before a rebuild, and what was done to the cloud since: the rebuild's memory (remesh.c). Node numbers are
 * those of the cloud with dead nodes still in place and new ones appended. */
#define NODE_LEFT 2
typedef struct silt_memory {
    int dim;          // as the mesh's
    double period[3]; // as the mesh's
    int n_cell, cell_capacity, area_capacity;
    int (*cell)[4];   // owned, cells that were water: the old mesh, and bed cells that became water
    double *area;     // owned, m2 or m3, what each of them held before the cloud was edited
    int n_place, place_capacity;
    double *x;        // owned, dim per node, m, where the first n_place nodes were then
    int n_taken, taken_capacity, taken_area_capacity;
    int (*taken)[4];  // owned, bed cells that grew into the water
    double *taken_area; // owned, m2
    int n_node, flag_capacity, dead_capacity;
    uint8_t *interior; // owned, one per node: had cells and no free facet
    uint8_t *dead;     // owned, one per node: leaves the cloud at the rebuild; NODE_LEFT: takes its water out of the domain
    struct silt_delaunay *kept; // owned, the plane's triangulation (delaunay.h), which follows the nodes
    double reconnected;     // m3, volume that the rebuild itself made (positive) or lost
    double left;            // m3, volume that went with the nodes that left
    int flat;               // 3-D: cells flatter than a fiftieth of h that could not be mended
    bool record;            // set by the caller: the rebuild writes the exchange below (silt_momentum_hand_on)
    int n_group, n_exchange, group_capacity, exchange_capacity;
    int *group_start;       // owned, n_group + 1: groups of cells that came and went together, each with its nodes
    struct silt_share {
        int node;      // in the memory's numbers
        double before; // m3, what the node had of the group's cells: a share of each
        double change; // m3, what it has of the new ones more than that, its debt counted as its own; sums to 0 over a group
    } *exchange;          // owned
} silt_memory;
void silt_memory_clear(silt_memory *memory);
/** Gives back what it has borrowed (silt_lend): cells, areas and places, until the next silt_memory_take */
void silt_memory_rest(silt_memory *memory);
/** Takes down the present mesh with its areas at positions x (before the cloud is edited). */
void silt_memory_take(silt_memory *memory, const silt_mesh *mesh, const silt_nodes *nodes);
/** Makes the memory's flags as long as the cloud is now. */
void silt_memory_extend(silt_memory *memory, int n_node);
/** Marks crowded nodes dead and adds nodes where the mesh is stretched, against the local size (refine.c). Nodes added on
 * curved walls are put onto them (mesh->walls); velocity and pressure are those of the edge they split. The momentum that this
 * moves is silt_momentum_hand_on's business.
 * @param h  fluid.size */
void silt_mesh_refine(const silt_mesh *mesh, silt_nodes *nodes, silt_memory *memory, double h);
/** Shifts inner nodes by up to fluid.shuffle * h in each direction, their pressure and velocity with them along the mesh's
 * gradients. The random numbers hang on fluid.seed, the step and the node's id. Before silt_memory_take. */
void silt_nodes_shuffle(silt_nodes *nodes, const silt_mesh *mesh, const silt_scene *scene, int64_t step);

/** what the water cannot enter */
typedef struct silt_barrier {
    const silt_walls *walls;
    const silt_bed *bed;             // NULL: none
    const struct silt_body_state *bodies; // NULL: none
} silt_barrier;
bool silt_barrier_contains(const silt_barrier *barrier, const double *point);
bool silt_bed_contains(const silt_bed *bed, const double *x); // bed_mesh.c

/** The first mesh: cells whose centroid lies in a region of the scene. */
silt_status silt_mesh_first(silt_mesh *mesh, const silt_nodes *nodes, const silt_scene *scene, const silt_barrier *barrier,
                            silt_error *err);
/** Triangulates the cloud, decides what is water, books what that did to the volume on the nodes' debt, drops dead nodes.
 * @param map  out, new index of every node of the old numbering (n_node of the memory), or -1; owned by the caller */
silt_status silt_mesh_rebuild(silt_mesh *mesh, silt_nodes *nodes, const silt_scene *scene, const silt_barrier *barrier,
                              silt_memory *memory, int *map, silt_error *err);

/** Hands on momentum when a rebuild has changed the nodes' share of the water (handover.c). With masses that count the debts,
 * m = density (share of the cells + debt), sum m v stays to rounding; no velocity goes farther from its group's mean than the
 * farthest of group and neighbours;
 * a group's kinetic energy does not rise above the larger of what it was and what it would be with velocities as they are (so
 * that a linear field, whose momentum no change of mesh alters, is left alone); prescribed velocities and the walls' normals are
 * kept. Old numbering is the memory's, with the nodes that refinement added.
 * @param memory  of the rebuild just made, with record set before it
 * @param mesh    the new one
 * @param mass    kg, old numbering: masses to use in place of m; NULL: m before the rebuild
 * @param debt    m3, old numbering, the nodes' debts before the rebuild
 * @param v       m/s, dim per node, old numbering, velocities before the rebuild
 * @param map     of the rebuild
 * @param lost    out, kg m/s, what could not be placed within the limits (groups that walls hold) */
void silt_momentum_hand_on(const silt_memory *memory, const silt_mesh *mesh, silt_nodes *nodes, double density,
                           const double *mass, const double *debt, const double *v, const int *map, double lost[3]);

/** Finds points in the water. Rebuilt when mesh->revision or the positions changed (locate_build). */
typedef struct silt_locator {
    double lo[3], size[3]; // m, of the grid's bins
    int n[3];              // bins along each axis; a periodic axis wraps
    int *start, *item; // owned, grid cell -> mesh cells that may hold it
    int start_capacity, item_capacity;
} silt_locator;
void silt_locator_build(silt_locator *locator, const silt_mesh *mesh, const double *x, double h);
/** Cell that holds the point, or -1; across a periodic border any image of the point will do.
 * @param weight  out, dim + 1 barycentric weights */
int silt_locate(const silt_locator *locator, const silt_mesh *mesh, const double *x, const double *point, double *weight);
/** The same by a walk from a cell near by, without a locator; 2-D, no periodic border.
 * @return -1 when the walk meets the water's edge or the point lies on a facet: ask the locator */
int silt_locate_from(const silt_mesh *mesh, const double *x, const double *point, int cell, double *weight);
void silt_locator_clear(silt_locator *locator);

// ---------------------------------------------------------------- what grains do to the water in a step

/** Filled by dem-coupling, read by the fluid. All arrays one (or dim) per node, owned by the coupling; NULL pointer: no grains.
 * Momentum of node i: (M_i/dt + coefficient_i) u_i = M_i v_i/dt + push_i + ...;  continuity: see docs/method.md */
typedef struct silt_drag {
    const double *solid;       // 1 - porosity, nodal, P1
    const double *coefficient; // kg/s, sum of the grains' effective drag coefficients at the node
    const double *push;        // N, the same sum times each grain's own velocity
    const double *source;      // m3/s, right-hand side of continuity from the grains' motion
    /** refreshes push and source for the iterate's pressure and velocity; called in every iteration */
    void (*update)(void *self, const double *velocity, const double *pressure, double dt);
    void *self;
} silt_drag;

// ---------------------------------------------------------------- bed (bed.c)

/** The bed: a mesh of bed material of its own. Nodes are never renumbered while they live; dead ones have alive = 0. In the plane
 * the third coordinate is 0 and the last number of cells and edges -1. */
struct silt_bed {
    int dim;             // 2 or 3; 0 counts as 2
    int n_node, node_capacity;
    double (*x)[3];      // owned, m
    uint8_t *alive;      // owned, 1 while a bed cell holds the node
    uint8_t *exposed;    // owned, 1 when the node lies on the bed's surface (an edge of one bed cell only, not on a tank wall)
    double *work;        // owned, J/m3, frictional work since exposure (accumulator)
    double *eroded;      // owned, kg/m2, mass per area worn off since exposure (accumulator)
    double *shear;       // owned, Pa, bed shear stress of the last step
    int *fluid_node;     // owned, index of the NODE_BED in silt_nodes, -1 while not exposed
    int (*wall)[3];      // owned, in space: elements of the walls that the node lies on, -1
    int *corner;         // owned, in space: the element that owns a corner of the walls where the node is one, -1
    // of the water in its pores (seep.h), which owns them; NULL without seepage
    const double *pressure; // Pa, per node
    const double *seepage;  // per node, upward force of the seepage on the grains over their weight under water: 1 lifts them
    const double *darcy;    // m/s, per cell, volume of water through the bed per area and time
    int n_cell, cell_capacity;
    int (*cell)[4];      // owned, counter-clockwise triangles, or tetrahedra of positive volume
    double *mass;        // owned, kg per m of width, solid mass of the cell
    double *area;        // owned, m2, in space m3
    int n_edge, edge_capacity;
    int (*edge)[3];      // owned, exposed edges, the bed on the right, the water's side on the left; in space faces,
                         // counter-clockwise as the water sees them
    const silt_walls *walls; // borrowed, what `wall` counts; NULL in the plane
    int64_t revision;    // rises when cells change
    double solid_mass;   // kg/m, sum of mass
    double initial_mass; // kg/m
    double pore_water, pore_rest; // kg/m, released to the water since the start less taken up, and what rounding left out (silt_sum)
    int n_first;         // nodes at the start: later ones are deposits
    double y_plus;       // of the first cell on the bed in the last step, the largest; 0: the law takes no gradient
    struct silt_bed_index *index; // owned, cells by node and by place (bed_mesh.h); every change keeps it up to date
};

// ---------------------------------------------------------------- coupling (dem-coupling, behind this table)

/** state of the discrete elements after a step, for bed, output and ledger; in 2-D z = 0 */
typedef struct silt_grain_state {
    int count;
    const int64_t *id;       // all borrowed from the coupling, valid until its next call
    const double *x, *v, *omega; // 3 per grain
    const double *radius;
    const double *mass;      // kg per m of width that the parcel stands for
    const int *contacts;     // number of contacts of the last substep
    const uint8_t *on_bed;   // 1 when one of them is with the bed
    const double *contact;   // 3 per grain, N per m of width, of contacts, mean of the last step; may be NULL
    const double *net_force; // N per m of width, magnitude, mean of the last step (with gravity and water)
} silt_grain_state;

typedef struct silt_body_state {
    int count;           // as in the scene
    struct silt_body {
        double x[3], v[3], q[4], w[3]; // centroid, velocity, orientation (w, x, y, z), angular velocity
        double force[3], torque[3];    // of the water, N and N m per m of width, last step
        double contact[3];             // of contacts, mean of the last step
        bool gone;                     // it has left what the scene spans: held where it is, without part in anything
        double mass;                   // kg
        double inertia[6];             // kg m2 about the centroid in the body's frame: xx, yy, zz, xy, xz, yz; in 2-D zz alone counts
        double volume;                 // m3; 2-D: m2
        int n_sphere;                  // of the clump that makes its contacts
        double clump_error;            // m, how far they leave the surface
        int n_point;
        const double *point;           // of the surface, dim each, in the body's frame about the centroid, borrowed; in 2-D in order,
                                       // counter-clockwise
        int n_face;
        const int (*face)[3];          // 3-D: triangles of points, counter-clockwise from outside, borrowed
        const struct silt_solid *solid; // 3-D: the same surface to search in (solid.h), borrowed
    } *body; // owned by the coupling
} silt_body_state;

/** a parcel that leaves the bed */
typedef struct silt_release {
    double x[3];      // centre; in 2-D z = 0
    double v[3];
    double radius;    // m
    double mass;      // kg per m of width; solid volume is mass / bed.density
} silt_release;

// ---------------------------------------------------------------- ledger, one row of history.csv

typedef struct silt_ledger {
    double fluid_volume, flying_volume, mesh_volume, fluid_mass, volume_error; // m3, kg per m width, relative
    double kinetic_energy, potential_energy, momentum[3];                      // J/m, kg/s
    double initial_volume;    // water at the start
    double inflow_mass, outflow_mass;             // water, cumulative, kg
    double pore_water_mass;                       // released less taken up, cumulative, kg
    double seepage;        // m3/s, what goes from the water into the bed (and comes out elsewhere), of the last step
    double seepage_volume; // m3, the same, cumulative
    double seepage_lost;   // m3, cumulative: came out of the bed where no water is to take it; part of outflow_mass
    double bed_mass, released_mass, deposited_mass, left_mass;      // sediment, cumulative, kg
    double fed_mass;                              // came in with the water of inlets
    double released_rest, deposited_rest, fed_rest; // kg, what rounding left out of the three (silt_sum)
    double bed_shear, bed_work, bed_y_plus;       // Pa, J/m3, largest on the bed's surface; see bed.y_plus
    double initial_sediment;
    double left_solid; // m3, water that the grains that left displaced, cumulative
    int grain_count;
    double grain_mass, sediment_error;
    double grain_velocity[3];                     // m/s, mean by mass
    double grain_kinetic, grain_potential;        // J/m, with the spin's; against the height 0
    double body_kinetic, body_potential;          // J/m, of bodies that move, with the spin's; against the height 0
    double grain_water[3], grain_contact[3];      // N/m, force of the water and of contacts on all grains, mean of the last step
    double external_work, dissipation;            // J/m, cumulative
    double max_speed;                             // m/s, of the water's nodes
    // where volume went, cumulative, m3: solved (divergence left), moved (integration), reconnected (remeshing, nodes added and removed)
    double volume_solved, volume_moved, volume_reconnected;
    double volume_refined; // nodes added and removed, cumulative
    double volume_given;   // debts paid, cumulative
    double volume_owed;    // debts of wet nodes that are still to be paid
    double owed_energy;    // J, kinetic and potential, that these debts have with their nodes
    double y_plus;         // distance of the wall law's sample in wall units, mean by length or area of its facets; NaN: none
    double angular_momentum[3]; // kg m/s times m, of the water about the origin; in 2-D the last only
    // the larger of two, of the last step's solve: force on the water that its inertia does not answer, relative to weight and
    // inertia; force of the grains on the water plus force of the water on the grains, relative to what they exchange
    double momentum_error;
} silt_ledger;

// ---------------------------------------------------------------- checkpoint (store.c): a tree of named arrays

typedef struct silt_store silt_store;
typedef enum { STORE_BYTE = 1, STORE_INT, STORE_LONG, STORE_DOUBLE } silt_store_type;
/** writing and reading; names like "nodes/x". Reading fails (SILT_FAILED, message names file and array) when it is absent or has another count. */
silt_status silt_store_create(silt_store **store, const char *path, silt_error *err); // written aside, renamed by commit
silt_status silt_store_commit(silt_store **store, silt_error *err);                   // closes, renames into place
silt_status silt_store_open(silt_store **store, const char *path, silt_error *err);
void silt_store_close(silt_store **store); // a store that was not committed leaves no file
silt_status silt_store_put(silt_store *store, const char *name, silt_store_type type, size_t n, const void *data, silt_error *err);
silt_status silt_store_count(silt_store *store, const char *name, size_t *n, silt_error *err);
silt_status silt_store_take(silt_store *store, const char *name, silt_store_type type, size_t n, void *data, silt_error *err);

#endif
