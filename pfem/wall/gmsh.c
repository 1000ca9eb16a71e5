// surfaces that only gmsh can read, through a module that is loaded when one is met
#include <dlfcn.h>

#include "gmsh_module.h"
#include "wall.h"

// ---- gmsh turns the triangles of each face as the face lies in its shape: they are turned alike here

typedef struct side {
    int low, high, triangle;
    bool backwards; // runs from the higher to the lower point
} side;

static int compare_sides(const void *a, const void *b) {
    const side *p = a, *q = b;
    return p->low != q->low ? (p->low > q->low) - (p->low < q->low) : (p->high > q->high) - (p->high < q->high);
}

static double volume_under(const silt_surface *s, int t) {
    const double *a = s->point[s->triangle[t][0]], *b = s->point[s->triangle[t][1]], *c = s->point[s->triangle[t][2]];
    double n[3];
    silt_cross(b, c, n);
    return wall_dot(a, n) / 6;
}

// Neighbours alike, over edges that two triangles share; pieces that enclose a volume turned out of it.
static void turn_alike(silt_surface *s) {
    const int n = 3 * s->n_triangle;
    side *edge = silt_alloc((size_t)n + 1, sizeof *edge);
    int *across = silt_alloc((size_t)n + 1, sizeof *across), *stack = silt_alloc((size_t)s->n_triangle + 1, sizeof *stack);
    uint8_t *state = silt_alloc((size_t)s->n_triangle + 1, 1); // 0: not met, 1: stays, 2: turned
    for (int k = 0; k < n; k++) {
        const int a = s->triangle[k / 3][k % 3], b = s->triangle[k / 3][(k + 1) % 3];
        edge[k] = (side){a < b ? a : b, a < b ? b : a, k, b < a};
        across[k] = -1;
    }
    qsort(edge, (size_t)n, sizeof *edge, compare_sides);
    for (int k = 0, end; k < n; k = end) {
        for (end = k + 1; end < n && compare_sides(&edge[k], &edge[end]) == 0;)
            end++;
        if (end != k + 2)
            continue;
        // the neighbour, and whether both run the same way: then one of them must turn
        const int same = edge[k].backwards == edge[k + 1].backwards;
        across[edge[k].triangle] = 2 * (edge[k + 1].triangle / 3) + same;
        across[edge[k + 1].triangle] = 2 * (edge[k].triangle / 3) + same;
    }
    for (int first = 0; first < s->n_triangle; first++) {
        if (state[first])
            continue;
        int n_stack = 0, met = 0;
        double volume = 0;
        state[stack[n_stack++] = first] = 1;
        while (met < n_stack) {
            const int t = stack[met++];
            volume += (state[t] == 1 ? 1 : -1) * volume_under(s, t);
            for (int k = 3 * t; k < 3 * t + 3; k++) {
                const int other = across[k] / 2;
                if (across[k] < 0 || state[other])
                    continue;
                state[other] = across[k] % 2 ? 3 - state[t] : state[t];
                stack[n_stack++] = other;
            }
        }
        for (int m = 0; m < n_stack; m++) {
            const int t = stack[m], swap = s->triangle[t][1];
            if ((state[t] == 2) == (volume < 0))
                continue;
            s->triangle[t][1] = s->triangle[t][2];
            s->triangle[t][2] = swap;
        }
    }
    free(edge);
    free(across);
    free(stack);
    free(state);
}

bool wall_gmsh_there(void) {
    char why[512];
    return silt_module_open("silt-gmsh.so", why) != NULL;
}

silt_status wall_gmsh_read(const char *path, silt_surface *surface, silt_error *err) {
    char why[512];
    void *module = silt_module_open("silt-gmsh.so", why);
    if (!module)
        return silt_fail(err, SILT_INPUT, "%s: found a file that needs the module silt-gmsh.so (%s; it is made where libgmsh-dev is), allowed without it: STL, .msh as text",
                         path, why);
    silt_gmsh_reader *reader;
    *(void **)&reader = dlsym(module, "silt_gmsh_read");
    silt_gmsh_surface found = {0};
    silt_status status = SILT_OK;
    if (!reader || reader(path, &found, why, sizeof why))
        status = silt_fail(err, SILT_INPUT, "%s: found a file that cannot serve as a surface, allowed what gmsh can read: %s", path,
                           reader ? why : "silt-gmsh.so is of another version");
    else if (found.n_point > INT32_MAX / 3 || found.n_triangle > INT32_MAX / 3)
        status = silt_fail(err, SILT_INPUT, "%s: found %zu triangles, allowed fewer", path, found.n_triangle);
    else {
        surface->n_point = (int)found.n_point;
        surface->point = silt_alloc(found.n_point + 1, sizeof *surface->point);
        memcpy(surface->point, found.point, found.n_point * sizeof *surface->point);
        surface->n_triangle = (int)found.n_triangle;
        surface->triangle = silt_alloc(found.n_triangle + 1, sizeof *surface->triangle);
        memcpy(surface->triangle, found.triangle, found.n_triangle * sizeof *surface->triangle);
        surface->source = silt_alloc(found.n_triangle + 1, sizeof *surface->source);
        for (int t = 0; t < surface->n_triangle; t++)
            surface->source[t] = t + 1;
        if (silt_surface_is_shape(path))
            turn_alike(surface);
    }
    free(found.point);
    free(found.triangle);
    // the module stays: gmsh's libraries do not like to be taken out again
    return status;
}
