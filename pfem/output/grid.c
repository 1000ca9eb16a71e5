// frames read back: points, cells and one array of a VTKHDF file

#include "output.h"

#include <hdf5.h>
#include <unistd.h>

void silt_grid_clear(silt_grid *grid) {
    free(grid->x);
    free(grid->offset);
    free(grid->link);
    free(grid->value);
    free(grid->radius);
    free(grid->kind);
    memset(grid, 0, sizeof *grid);
}

// all values of a data set as doubles (integers with whole: as ints); NULL when it is absent
static void *grid_array(hid_t root, const char *name, bool whole, size_t *n) {
    hid_t set = H5Dopen2(root, name, H5P_DEFAULT);
    if (set < 0)
        return NULL;
    hid_t space = H5Dget_space(set);
    *n = (size_t)H5Sget_simple_extent_npoints(space);
    H5Sclose(space);
    void *data = silt_alloc(*n + 1, whole ? sizeof(int) : sizeof(double));
    hid_t type = whole ? H5T_NATIVE_INT : H5T_NATIVE_DOUBLE;
    if (*n > 0 && H5Dread(set, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, data) < 0) {
        free(data);
        data = NULL;
    }
    H5Dclose(set);
    return data;
}

bool silt_grid_read(silt_grid *grid, const char *out, const char *part, int number, const char *array) {
    size_t n = 0, cells = 0, links = 0;
    H5Eset_auto2(H5E_DEFAULT, NULL, NULL);
    memset(grid, 0, sizeof *grid);
    char *path = silt_text("%s/%s_%06d.hdf", out, part, number);
    hid_t file = access(path, R_OK) == 0 ? H5Fopen(path, H5F_ACC_RDONLY, H5P_DEFAULT) : -1;
    free(path);
    if (file < 0)
        return false;
    hid_t root = H5Gopen2(file, "VTKHDF", H5P_DEFAULT);
    grid->x = grid_array(root, "Points", false, &n);
    grid->n_point = (int)(n / 3);
    grid->offset = grid_array(root, "Offsets", true, &cells);
    grid->n_cell = (int)cells - 1;
    grid->link = grid_array(root, "Connectivity", true, &links);
    double *time = grid_array(root, "FieldData/TimeValue", false, &n);
    grid->time = time ? *time : 0;
    free(time);
    grid->radius = grid_array(root, "PointData/radius", false, &n);
    grid->kind = grid_array(root, "PointData/kind", true, &n);
    if (!grid->kind)
        grid->kind = grid_array(root, "CellData/kind", true, &n);
    if (array)
        grid->value = grid_array(root, array, false, &n);
    const size_t one = (size_t)(array && strncmp(array, "Cell", 4) == 0 ? grid->n_cell : grid->n_point);
    grid->width = grid->value && one > 0 ? (int)(n / one) : 0;
    bool whole = grid->x && grid->offset && grid->link;
    if (root >= 0)
        H5Gclose(root);
    H5Fclose(file);
    if (!whole)
        silt_grid_clear(grid);
    return whole;
}
