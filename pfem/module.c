// parts of the program that are loaded when they are asked for
#include "base.h"

#include <dlfcn.h>
#include <unistd.h>

void *silt_module_open(const char *name, char why[512]) {
    static const char *const folder[] = {"", "../", "../libexec/silt/"};
    char self[4096];
    const ssize_t n = readlink("/proc/self/exe", self, sizeof self - 1);
    self[n > 0 ? n : 0] = 0;
    char *slash = strrchr(self, '/');
    if (slash)
        *slash = 0;
    snprintf(why, 512, "it is not there");
    for (int k = 0; k < 3; k++) {
        char *path = silt_text("%s/%s%s", self, folder[k], name);
        void *module = dlopen(path, RTLD_NOW | RTLD_LOCAL);
        if (!module && access(path, F_OK) == 0)
            snprintf(why, 512, "%s", dlerror());
        free(path);
        if (module)
            return module;
    }
    return NULL;
}
