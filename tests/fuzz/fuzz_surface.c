// surfaces: any bytes are refused with the file's name, or are triangles of points that there are
#include "fuzz.h"
#include "wall.h"

static void read_as(const char *name, const uint8_t *data, size_t size) {
    silt_surface surface;
    silt_error err = {0};
    const char *path = fuzz_file(name, data, size);
    const silt_status status = silt_surface_read(path, 1, false, &surface, &err);
    FUZZ_HOLDS(status == SILT_OK || (status == SILT_INPUT && strstr(err.text, name)));
    FUZZ_HOLDS(status != SILT_OK || surface.n_triangle > 0);
    for (int i = 0; i < surface.n_point; i++)
        for (int d = 0; d < 3; d++)
            FUZZ_HOLDS(fabs(surface.point[i][d]) < 1e12);
    for (int t = 0; t < surface.n_triangle; t++)
        for (int k = 0; k < 3; k++)
            FUZZ_HOLDS(surface.triangle[t][k] >= 0 && surface.triangle[t][k] < surface.n_point);
    silt_surface_clear(&surface);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    fuzz_folder_make();
    read_as(size && data[0] == '$' ? "plate.msh" : "plate.stl", data, size);
    return 0;
}
