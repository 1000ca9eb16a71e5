/** @file film.h
 * Water too thin for cells, between a body and something solid. Its pressure is that of the water at its rim, extended over the
 * body's surface without sources (Laplace), which in the plane is a line from end to end. What the body's motion squeezes out of it leaves
 * through the rim by the same weights: forces and volume are each other's adjoints, so the film does no work of its own. At a mouth, where
 * the water's mesh ends at a film, nothing passes by itself and no node slides: what of the film a facet there sweeps changes hands.
 */
#ifndef SILT_FILM_H
#define SILT_FILM_H

#include "pfem.h"

typedef enum { FILM_INNER = 0, FILM_WET, FILM_AIR } film_rim; // pressure by extension; that of the water's node; nought

typedef struct silt_film {
    // found before a step
    int n_mouth, mouth_capacity;
    int *mouth;              // owned, facets of the water's mesh that end at a film, which presses back on them
    int n_slave, slave_capacity, slave_body_capacity;
    int *slave;              // owned, nodes of the water at mouths that may slide along a wall: they go with the body instead
    int *slave_body;         // owned, the body
    int n_node, node_capacity, rim_capacity;
    int *node;               // owned, nodes of bodies under films
    uint8_t *rim;            // owned, film_rim
    int n_element, element_capacity;
    int (*element)[3];       // owned, pieces of the bodies' surfaces there, in the numbers of `node`, in order as the surface: edges
                             // counter-clockwise, faces counter-clockwise from outside (edges: the third -1)
    // made of these
    int mouth_room, normal_room, stiffness_room, work_room;
    double (*mouth_normal)[3]; // owned, out of the water, as large as the facet, mean over the step
    double (*normal)[3];       // owned, out of the body, the same
    double (*stiffness)[3];    // owned, of the Laplacian on a piece: weights of its edges, the k-th opposite corner k (an edge: the third)
    double *place;             // owned, 2 dim per node, m: where the nodes are, and half way through the step
    double *work;              // owned, seven per node: the solver's
    double *squeezed;          // owned, per node: m3/s that come into the water at it; nought where it is no rim
    int squeezed_room, place_room, way_room;
    struct silt_film_way {
        uint8_t hold;          // silt_hold of the wall alone
        double vector[3], given[3];
    } *way;                    // owned, per slave: how walls hold it
} silt_film;

struct silt_step;
void silt_film_clear(silt_film *film);
/** once mouths, nodes and pieces are found */
void silt_film_ready(silt_film *film, const silt_mesh *mesh, const double *x);
/** Normals and `squeezed` of the step's motion. @param x_mid  dim per node of the mesh  @param dt  s, 0: where the nodes are */
void silt_film_place(silt_film *film, const struct silt_step *step, const double *x_mid, double dt);
/** `squeezed` of velocities of the bodies' nodes, the sum of two (dim per node of the mesh; NULL: none) */
void silt_film_squeeze(silt_film *film, int dim, const double *v, const double *more);
/** what is squeezed comes in: out -= squeezed */
void silt_film_source(const silt_film *film, double *out);
/** continuity without what goes through the mouths: out -= int N v.n there, of nodes that are not mobile to `withheld`
 * @param mobile  silt_fluid.mobile; NULL: all are */
void silt_film_mouths(const silt_film *film, const silt_mesh *mesh, const uint8_t *mobile, const double *v, double *out, double *withheld);
/** the same and the source, in the residual of continuity */
void silt_film_continuity(const silt_film *film, const silt_mesh *mesh, const uint8_t *mobile, const double *v, double *residual,
                          double *withheld);
/** what the film presses back with at the mouths: out -= int N p n */
void silt_film_push(const silt_film *film, const silt_mesh *mesh, const double *p, double *out);
/** force of the bodies' nodes on the film: out += int N p n */
void silt_film_press(silt_film *film, int dim, const double *p, double *out);
/** the part of a vector at slave k along which the wall leaves it free */
void silt_film_free_part(const silt_film *film, int k, int dim, double *v);

#endif
