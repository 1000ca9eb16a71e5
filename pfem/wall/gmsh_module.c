/** @file gmsh_module.c
 * Reads surfaces with gmsh: a module of its own, loaded when a wall needs it (wall/gmsh.c). Built only where libgmsh is.
 */
#include <gmshc.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "gmsh_module.h"

static bool failed(int error, char *text, size_t room) {
    if (!error)
        return false;
    char *why = NULL;
    int ignored;
    gmshLoggerGetLastError(&why, &ignored);
    snprintf(text, room, "gmsh: %s", why && *why ? why : "it gave no reason");
    gmshFree(why);
    return true;
}

static void start(int *error) {
#if GMSH_API_VERSION_MAJOR > 4 || GMSH_API_VERSION_MINOR >= 9
    gmshInitialize(0, NULL, 0, 0, error);
#else
    gmshInitialize(0, NULL, 0, error);
#endif
    int ignored;
    gmshOptionSetNumber("General.Terminal", 0, &ignored);
    gmshOptionSetNumber("Mesh.MeshSizeFromCurvature", 24, &ignored); // triangles a turn
}

// a shape without triangles gets them
static void mesh_surfaces(int *error) {
    size_t *tag = NULL, n_tag = 0, n_coord = 0, n_parameter = 0;
    double *coord = NULL, *parameter = NULL;
    gmshModelMeshGetNodes(&tag, &n_tag, &coord, &n_coord, &parameter, &n_parameter, 2, -1, 1, 0, error);
    gmshFree(tag);
    gmshFree(coord);
    gmshFree(parameter);
    if (*error || n_tag)
        return;
    gmshModelMeshGenerate(2, error);
}

static void nodes_take(silt_gmsh_surface *s, size_t **number, size_t *n_number, int *error) {
    size_t *tag = NULL, n_tag = 0, n_coord = 0, n_parameter = 0;
    double *coord = NULL, *parameter = NULL;
    gmshModelMeshGetNodes(&tag, &n_tag, &coord, &n_coord, &parameter, &n_parameter, -1, -1, 0, 0, error);
    for (size_t k = 0; k < n_tag; k++)
        *n_number = tag[k] >= *n_number ? tag[k] + 1 : *n_number;
    *number = calloc(*n_number + 1, sizeof **number);
    s->point = calloc(3 * n_tag + 1, sizeof *s->point);
    if (*number && s->point) {
        memcpy(s->point, coord, 3 * n_tag * sizeof *coord);
        for (size_t k = 0; k < n_tag; k++)
            (*number)[tag[k]] = k;
        s->n_point = n_tag;
    } else
        *error = 1;
    gmshFree(tag);
    gmshFree(coord);
    gmshFree(parameter);
}

// triangles and quadrilaterals, these in two
static void triangles_take(silt_gmsh_surface *s, const size_t *number, int *error) {
    int *type = NULL;
    size_t n_type = 0, **tag = NULL, *n_tag = NULL, nn_tag = 0, **node = NULL, *n_node = NULL, nn_node = 0, room = 0;
    gmshModelMeshGetElements(&type, &n_type, &tag, &n_tag, &nn_tag, &node, &n_node, &nn_node, 2, -1, error);
    for (size_t t = 0; t < n_type; t++)
        room += type[t] == 2 ? n_node[t] : type[t] == 3 ? n_node[t] / 4 * 6 : 0;
    s->triangle = calloc(room + 1, sizeof *s->triangle);
    for (size_t t = 0; t < n_type && s->triangle; t++) {
        const size_t corners = type[t] == 2 ? 3 : type[t] == 3 ? 4 : 0;
        for (size_t k = 0; corners && k + corners <= n_node[t]; k += corners)
            for (size_t half = 0; half + 2 < corners; half++, s->n_triangle++) {
                s->triangle[3 * s->n_triangle] = (int)number[node[t][k]];
                s->triangle[3 * s->n_triangle + 1] = (int)number[node[t][k + half + 1]];
                s->triangle[3 * s->n_triangle + 2] = (int)number[node[t][k + half + 2]];
            }
    }
    *error |= !s->triangle;
    for (size_t t = 0; t < n_type; t++) {
        gmshFree(tag[t]);
        gmshFree(node[t]);
    }
    gmshFree(type);
    gmshFree(tag);
    gmshFree(n_tag);
    gmshFree(node);
    gmshFree(n_node);
}

__attribute__((visibility("default"))) int silt_gmsh_read(const char *path, silt_gmsh_surface *surface, char *text, size_t room) {
    int error = 0, ignored;
    size_t *number = NULL, n_number = 0;
    memset(surface, 0, sizeof *surface);
    start(&error);
    if (!error)
        gmshOpen(path, &error);
    if (!error)
        mesh_surfaces(&error);
    if (!error)
        nodes_take(surface, &number, &n_number, &error);
    if (!error)
        triangles_take(surface, number, &error);
    const bool bad = failed(error, text, room);
    free(number);
    gmshFinalize(&ignored);
    return bad;
}
