/** @file delaunay.h
 * Delaunay triangulation of a cloud behind a C interface (CGAL, GPL-3+). The only C++ in silt is behind this header.
 */
#ifndef SILT_DELAUNAY_H
#define SILT_DELAUNAY_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/** Triangulates n points.
 * @param x         2 n coordinates, m
 * @param triangle  out, malloc'ed, 3 indices a triangle, counter-clockwise; order depends on the points only
 * @param n_triangle out
 * @return 0, or -1 when memory is exhausted. Coinciding points: the later one gets no triangle. */
int silt_delaunay_2d(int n, const double *x, int **triangle, int *n_triangle);

/** A triangulation of the plane that is kept from one cloud to the next: nodes that moved a little leave most edges as they were.
 * The triangles are those of silt_delaunay_2d, ties among them (CGAL breaks them by the coordinates' order); only the order in
 * which they come is another one.
 * @param kept  NULL at first, owned by the caller
 * @param x     2 n coordinates; nodes of the cloud before have the numbers that silt_delaunay_renumber gave them
 * @param dead  nodes that leave the triangulation, NULL: none */
typedef struct silt_delaunay silt_delaunay;
int silt_delaunay_follow(silt_delaunay **kept, int n, const double *x, const uint8_t *dead, int **triangle, int *n_triangle);
/** The live nodes get the numbers map[i], all below n_new; the next cloud has these and new ones after them. */
void silt_delaunay_renumber(silt_delaunay *kept, const int *map, int n_new);
int silt_delaunay_followed(const silt_delaunay *kept); /**< 0: the last one was made from scratch, as where nodes moved too far */
void silt_delaunay_free(silt_delaunay **kept);

/** The same in space: 3 n coordinates, 4 indices a tetrahedron, of positive volume (the fourth on the side of the first three
 * from which they are seen counter-clockwise). Slivers are left in: four nodes nearly in a plane have a small sphere. */
int silt_delaunay_3d(int n, const double *x, int **tetrahedron, int *n_tetrahedron);

/** What CGAL alone needs for the triangulation of these points from scratch, s of CPU, -1 when memory is exhausted: the unit that costs
 * of a step are told in (silt bench). @param dim  2 or 3 */
double silt_delaunay_seconds(int dim, int n, const double *x);

#ifdef __cplusplus
}
#endif
#endif
