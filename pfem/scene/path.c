/** @file path.c
 * Where walls and bodies go that are moved by a table: places that are given, or accelerations, which are integrated exactly.
 */
#include "scene.h"

static const char *const path_name[PATH_COLUMNS] = {"x", "y", "angle", "ax", "ay", "aangle", "z", "az"};
static const char *const path_place[4] = {"x", "y", "z", "angle"};

int silt_path_columns(int dimension, const char *const **name) {
    *name = path_name;
    return dimension == 3 ? PATH_COLUMNS : PATH_COLUMNS - 2;
}

static int path_column(const silt_series *path, const char *prefix, int k) {
    char name[16];
    snprintf(name, sizeof name, "%s%s", prefix, path_place[k]);
    return silt_series_column(path, name);
}

bool silt_path_accelerates(const silt_series *path) {
    for (int k = 0; k < 4; k++)
        if (path_column(path, "a", k) > 0)
            return true;
    return false;
}

int silt_path_doubled(const silt_series *path) {
    for (int k = 0; k < 4; k++)
        if (path_column(path, "a", k) > 0 && path_column(path, "", k) > 0)
            return path_column(path, "a", k);
    return -1;
}

static double *path_cell(const silt_series *path, int row, int column) {
    return path->value + (size_t)row * (size_t)path->n_column + (size_t)column;
}

static int path_append(silt_series *path, const char *prefix, int k) {
    const int n = path->n_column, more = n + 1;
    double *value = silt_alloc((size_t)path->n_row * (size_t)more, sizeof *value);
    for (int i = 0; i < path->n_row; i++)
        memcpy(value + (size_t)i * (size_t)more, path->value + (size_t)i * (size_t)n, (size_t)n * sizeof *value);
    free(path->value);
    path->value = value;
    char **name = silt_alloc((size_t)more, sizeof *name);
    memcpy(name, path->name, (size_t)n * sizeof *name);
    free(path->name);
    path->name = name;
    path->name[n] = silt_text("%s%s", prefix, path_place[k]);
    path->n_column = more;
    return n;
}

// velocity and place at the rows, from rest at the first one: linear, quadratic, cubic between rows
static void path_sum(const silt_series *path, int a, int v, int x) {
    *path_cell(path, 0, v) = *path_cell(path, 0, x) = 0;
    for (int i = 0; i + 1 < path->n_row; i++) {
        const double s = *path_cell(path, i + 1, 0) - *path_cell(path, i, 0);
        const double from = *path_cell(path, i, a), to = *path_cell(path, i + 1, a), v0 = *path_cell(path, i, v);
        *path_cell(path, i + 1, v) = v0 + s * (from + to) / 2;
        *path_cell(path, i + 1, x) = *path_cell(path, i, x) + s * (v0 + s * (2 * from + to) / 6);
    }
}

// takes b0 + b1 t off the acceleration, so that the end is at rest, or at rest where it began
static void path_correct(const silt_series *path, silt_baseline baseline, int a, int v, int x) {
    const int last = path->n_row - 1;
    const double begin = *path_cell(path, 0, 0), T = *path_cell(path, last, 0) - begin;
    const double V = *path_cell(path, last, v), X = *path_cell(path, last, x);
    if (baseline == BASELINE_NONE || !(T > 0))
        return;
    const double b1 = baseline == BASELINE_PLACE ? 12 * (V * T / 2 - X) / (T * T * T) : 0, b0 = V / T - b1 * T / 2;
    for (int i = 0; i <= last; i++)
        *path_cell(path, i, a) -= b0 + b1 * (*path_cell(path, i, 0) - begin);
    path_sum(path, a, v, x);
    // what rounding leaves would go on for ever
    *path_cell(path, last, v) = 0;
}

void silt_path_settle(silt_series *path, double scale, silt_baseline baseline) {
    for (int i = 0; i < path->n_row; i++)
        for (int c = 1; c < path->n_column; c++)
            *path_cell(path, i, c) *= scale;
    for (int k = 0; k < 4; k++) {
        const int a = path_column(path, "a", k);
        if (a <= 0)
            continue;
        const int v = path_append(path, "v", k), x = path_append(path, "", k);
        path_sum(path, a, v, x);
        path_correct(path, baseline, a, v, x);
    }
}

// last row at or before the time
static int path_row(const silt_series *path, double time) {
    int low = 0, high = path->n_row - 1;
    while (high - low > 1) {
        const int middle = low + (high - low) / 2;
        if (*path_cell(path, middle, 0) <= time)
            low = middle;
        else
            high = middle;
    }
    return low;
}

static double path_component(const silt_series *path, int k, double time) {
    const int x = path_column(path, "", k), a = path_column(path, "a", k), v = a > 0 ? path_column(path, "v", k) : -1;
    if (x <= 0)
        return 0;
    const int last = path->n_row - 1;
    if (v <= 0 || time <= *path_cell(path, 0, 0))
        return silt_series_at(path, x, time);
    if (time >= *path_cell(path, last, 0))
        return *path_cell(path, last, x) + *path_cell(path, last, v) * (time - *path_cell(path, last, 0));
    const int i = path_row(path, time);
    const double span = *path_cell(path, i + 1, 0) - *path_cell(path, i, 0), s = time - *path_cell(path, i, 0);
    const double from = *path_cell(path, i, a), to = *path_cell(path, i + 1, a);
    return *path_cell(path, i, x) + s * (*path_cell(path, i, v) + s * (from / 2 + s * (to - from) / (6 * span)));
}

void silt_path_at(const silt_series *path, double time, double place[4]) {
    for (int k = 0; k < 4; k++)
        place[k] = path_component(path, k, time);
    place[3] *= M_PI / 180;
}
