/** @file gmsh_module.h
 * What wall/gmsh.c asks of the module silt-gmsh.so.
 */
#ifndef SILT_GMSH_MODULE_H
#define SILT_GMSH_MODULE_H

#include <stdbool.h>
#include <stddef.h>

typedef struct silt_gmsh_surface {
    size_t n_point, n_triangle;
    double *point; // malloc'ed, owned by the caller, 3 per point
    int *triangle; // malloc'ed, owned by the caller, 3 per triangle
} silt_gmsh_surface;

/** Reads a shape or mesh, triangulates its surfaces where they have no triangles. @return 0, or 1 with the reason in text */
typedef int silt_gmsh_reader(const char *path, silt_gmsh_surface *surface, char *text, size_t room);
silt_gmsh_reader silt_gmsh_read;

#endif
