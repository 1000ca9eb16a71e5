// the way to the module that draws
#include "output.h"

#include <dlfcn.h>

silt_status silt_pictures_load(const silt_pictures **pictures, silt_error *err) {
    char why[512];
    void *module = silt_module_open("silt-draw.so", why);
    const silt_pictures *(*table)(void) = NULL;
    if (module)
        *(void **)&table = dlsym(module, "silt_pictures_table");
    if (!table)
        return silt_fail(err, SILT_FAILED, "silt-draw.so, which draws, cannot be loaded from the program's folder or ../libexec/silt: %s",
                         module ? "it is of another version" : why);
    *pictures = table();
    return SILT_OK;
}
