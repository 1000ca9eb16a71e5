// surfaces that only gmsh can read, through a module that is loaded when one is met
#include <dlfcn.h>
#include <unistd.h>

#include "gmsh_module.h"
#include "wall.h"

// beside the program, or in ../libexec/silt, as the worker is
static void *module_open(char why[512]) {
    char self[4096];
    const ssize_t n = readlink("/proc/self/exe", self, sizeof self - 1);
    self[n > 0 ? n : 0] = 0;
    char *slash = strrchr(self, '/');
    if (slash)
        *slash = 0;
    static const char *const place[] = {"%s/silt-gmsh.so", "%s/../silt-gmsh.so", "%s/../libexec/silt/silt-gmsh.so"};
    snprintf(why, 512, "it was not built: libgmsh was not there");
    for (int k = 0; k < 3; k++) {
        char path[4200];
        snprintf(path, sizeof path, k == 0 ? place[0] : k == 1 ? place[1] : place[2], self);
        void *module = dlopen(path, RTLD_NOW | RTLD_LOCAL);
        if (module)
            return module;
        if (access(path, F_OK) == 0)
            snprintf(why, 512, "%s", dlerror());
    }
    return NULL;
}

bool wall_gmsh_there(void) {
    char why[512];
    return module_open(why) != NULL; // opened once more it is the same
}

silt_status wall_gmsh_read(const char *path, silt_surface *surface, silt_error *err) {
    char why[512];
    void *module = module_open(why);
    if (!module)
        return silt_fail(err, SILT_INPUT, "%s: found a file that needs the module silt-gmsh.so (%s), allowed without it: STL, .msh as text",
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
    }
    free(found.point);
    free(found.triangle);
    // the module stays: gmsh's libraries do not like to be taken out again
    return status;
}
