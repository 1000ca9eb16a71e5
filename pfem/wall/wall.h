/** @file wall.h
 * What the files about walls share: search trees over the elements, the step of walls that move, geometry of one element.
 * Points and vectors have three components here, in 2-D the third is 0; corners, edges and joints of an element are counted
 * the same way in both dimensions: edge k starts at corner k, in 2-D "edge" k is the end k (0: from, 1: to).
 */
#ifndef SILT_WALL_H
#define SILT_WALL_H

#include "pfem.h"

#define WALL_BEND 0.8660254037844386 // cosine of 30 degrees: patches bend less than that from element to element
#define WALL_SNAP 1e-9               // times h: nearer than that is on

/** a box of the tree: a leaf with `count` items, or the parent of the boxes `first` and first + 1 (count 0) */
typedef struct wall_box {
    double lo[3], hi[3];
    int first, count;
} wall_box;

/** elements that are searched together: what stands still, one moving wall, or one closed obstacle */
typedef struct wall_tree {
    int root, n_box; // boxes root to root + n_box - 1, parents before children
    int wall;        // the wall that moves, -1: stands still
    bool obstacle;   // closed, the water outside
} wall_tree;

/** what a wall did in the step that ends at its present place */
typedef struct wall_step {
    bool moves;
    double dt;              // s, 0: placed without a step
    double before[3];       // m, what it turned about at the start of the step
    double cosine, sine;    // of the turn in the step
    double whole_cosine, whole_sine; // of the turn from the scene's place
} wall_step;

struct silt_wall_index {
    int n_tree, n_box;
    wall_tree *tree;               // owned
    wall_box *box;                 // owned
    int *item;                     // owned, elements in the order of the leaves
    int n_vertex;
    int (*vertex)[3];              // owned, welded corners of the elements
    int *piece;                    // owned, one per element: joined elements share a number
    uint8_t *closed, *obstacle;    // owned, one per element: its piece has no free edges; and the water outside
    uint8_t *bent;                 // owned, one per element: its patch is not plane
    bool any_bent;
    double (*vertex_normal)[3];    // owned, 3-D: normals summed by angle (Baerentzen and Aanaes 2005)
    double (*place)[3][3];         // owned, corners at the scene's place, NULL: nothing moves
    double (*place_normal)[3];     // owned, one per element
    double (*place_vertex)[3];     // owned, vertex normals
    double (*surface)[3];          // owned, one per wall, m/s: velocity of the surface along itself
    wall_step *step;               // owned, one per wall
};

static inline double wall_dot(const double *a, const double *b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
static inline int wall_dim(const silt_walls *walls) { return walls->dim == 3 ? 3 : 2; }

// wall_index.c ----------------------------------------------------------------------------------------
/** corner k of an element */
const double *wall_corner(const silt_walls *walls, int e, int k, double room[3]);
/** Nearest point of the element to x; feature: 0 the inside, 1 + k edge k, 4 + k corner k. @return the distance squared */
double wall_nearest(const silt_walls *walls, int e, const double x[3], double on[3], int *feature);
/** the same for a triangle's corners; feature as above */
double wall_nearest_on_triangle(const double c[3][3], const double *x, double on[3], int *feature);
/** how far x lies inside of each edge (3-D) or end (2-D), in the plane of the element */
void wall_inside(const silt_walls *walls, int e, const double x[3], double in[3]);
/** element joined across edge k, -1 */
int wall_joined(const silt_walls *walls, int e, int k);
/** height of the element f over the plane of e on the water's side: > 0 when the water sits in the corner */
double wall_rise(const silt_walls *walls, int e, int k, int f);
/** Smallest vector with normal_k . out = value_k. @return false when the normals are (nearly) not independent */
bool wall_solve(int n, const double *const normal[3], const double value[3], double out[3]);
void wall_index_create(silt_walls *walls, const int *component, const uint8_t *obstacle);
void wall_index_refit(silt_walls *walls, int tree);
/** elements of a tree whose boxes meet the box; appended to *list */
void wall_query(const silt_walls *walls, int tree, const double lo[3], const double hi[3], int **list, int *n, int *capacity);
/** point that was at x at the start of the step, carried along with the wall */
void wall_carry(const silt_walls *walls, int wall, const double x[3], double out[3]);
/** where that point was at the start of the step */
void wall_carry_back(const silt_walls *walls, int wall, const double x[3], double out[3]);
/** tangential velocity of the element's surface, m/s */
void wall_sliding(const silt_walls *walls, int e, double v[3]);
/** What held elements ask of a vector when each of them asks own[k]: normal components of all; along what they leave free the
 * mean of those without slip. @return true when nothing is left free */
bool wall_given(const silt_walls *walls, int n, const int element[3], const double *const normal[3], const double own[3][3],
                double out[3]);

// wall_cut.c ------------------------------------------------------------------------------------------
/** a part of an element, from the scene's place */
typedef struct wall_piece {
    double corner[3][3];
    int source; // element that it is of
} wall_piece;
/** the opening whose back is turned to the water of an element that it lies in (3-D), or -1 */
int wall_turned(const silt_walls *walls, const silt_scene *scene);
/** What is left of the elements, before they are joined, where openings through which the water's own motion carries it lie in
 * them: outlets, and inlets with a head. @return how many pieces; *piece is owned by the caller */
int wall_cut(const silt_walls *walls, const silt_scene *scene, wall_piece **piece);

// surface.c -------------------------------------------------------------------------------------------
/** a triangulated surface */
typedef struct silt_surface {
    int n_point, n_triangle;
    double (*point)[3];   // owned, m
    int (*triangle)[3];   // owned, counter-clockwise as the water sees it
    int *source;          // owned, number of the triangle in the file, from 1
    int n_degenerate;     // triangles without area that were left out
} silt_surface;
/** Reads an STL file (text or binary) or a gmsh file (.msh, versions 2.2 and 4.1 as text; triangles and quadrilaterals).
 * Corners closer than 1e-7 of the surface's extent are one. Open surfaces are allowed.
 * Errors (SILT_INPUT, with file and line or triangle): unreadable, no triangles, two neighbours that are turned differently. */
silt_status silt_surface_read(const char *path, double scale, bool inside_out, silt_surface *surface, silt_error *err);
void silt_surface_clear(silt_surface *surface);

// gmsh.c ----------------------------------------------------------------------------------------------
/** true when the module that reads with gmsh is there */
bool wall_gmsh_there(void);
/** Reads what only gmsh can: shapes (.geo, .step, .brep, .iges), which it triangulates, and meshes in other forms.
 * Errors (SILT_INPUT): no such module, or what gmsh says. */
silt_status wall_gmsh_read(const char *path, silt_surface *surface, silt_error *err);
/** Numbers points so that those closer than gap share one (gap 0: equal ones). @return how many numbers */
int wall_weld(int n, const double (*point)[3], double gap, int *number);

#endif
