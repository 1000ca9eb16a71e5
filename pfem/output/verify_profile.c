// profiles of a run along a line at a time, from its frames

#include "verify.h"

// a time this close to a frame's (times the distance of frames) is that frame's
#define PROFILE_SAME 1e-6
// a point this far outside of a cell, as a share of its size, is taken to lie on its border
#define PROFILE_SLACK 0.02

/** the water of a frame */
typedef struct profile_frame {
    silt_grid grid;
    int dim;
    int *group; // owned, one per point: groups of points joined by cells
    int main;   // the largest group by volume, -1
} profile_frame;

static const char *profile_array(silt_profile profile) {
    switch (profile) {
    case PROFILE_SURFACE:
        return NULL;
    case PROFILE_PRESSURE:
        return "PointData/pressure";
    default:
        return "PointData/velocity";
    }
}

static void profile_close(profile_frame *f) {
    silt_grid_clear(&f->grid);
    free(f->group);
    f->group = NULL;
}

// twice the area of a triangle seen from above z, six times the volume of a tetrahedron
static double profile_measure(int dim, const double *a, const double *b, const double *c, const double *d) {
    const double u[3] = {b[0] - a[0], b[1] - a[1], b[2] - a[2]}, v[3] = {c[0] - a[0], c[1] - a[1], c[2] - a[2]};
    if (dim == 2)
        return u[0] * v[1] - u[1] * v[0];
    const double w[3] = {d[0] - a[0], d[1] - a[1], d[2] - a[2]};
    return silt_triple(u, v, w);
}

static bool profile_cell(const profile_frame *f, int cell) {
    return silt_grid_corners(&f->grid, cell) == f->dim + 1;
}

static void profile_corners(const profile_frame *f, int cell, const double *x[4]) {
    const int *node = f->grid.link + f->grid.offset[cell];
    for (int k = 0; k < 4; k++)
        x[k] = f->grid.x + 3 * node[k <= f->dim ? k : 0];
}

static bool profile_open(profile_frame *f, const silt_scene *scene, const char *out, int number, silt_profile profile) {
    *f = (profile_frame){.dim = scene->dimension == 3 ? 3 : 2, .main = -1};
    if (!silt_grid_read(&f->grid, out, "fluid", number, profile_array(profile)) ||
        (profile != PROFILE_SURFACE && !f->grid.value)) {
        silt_grid_clear(&f->grid);
        return false;
    }
    const silt_grid *grid = &f->grid;
    double *volume = silt_alloc((size_t)grid->n_point + 1, sizeof *volume);
    f->group = silt_alloc((size_t)grid->n_point + 1, sizeof *f->group);
    for (int i = 0; i < grid->n_point; i++)
        f->group[i] = i;
    for (int i = 0; i < grid->n_cell; i++) {
        const int *node = grid->link + grid->offset[i];
        if (profile_cell(f, i))
            silt_group_join(f->group, (const int[4]){node[0], node[1], node[2], f->dim == 3 ? node[3] : -1});
    }
    for (int i = 0; i < grid->n_cell; i++) {
        const double *x[4];
        if (!profile_cell(f, i))
            continue;
        profile_corners(f, i, x);
        volume[silt_group_find(f->group, grid->link[grid->offset[i]])] +=
            profile_measure(f->dim, x[0], x[1], x[2], x[3]);
    }
    for (int i = 0; i < grid->n_point; i++)
        if (volume[i] > 0 && (f->main < 0 || volume[i] > volume[f->main]))
            f->main = i;
    free(volume);
    return true;
}

// highest point of connected water on a vertical line
static double profile_top(const profile_frame *f, const double *point) {
    const silt_grid *grid = &f->grid;
    double best = -HUGE_VAL;
    for (int i = 0; i < grid->n_cell; i++) {
        const double *x[4];
        if (!profile_cell(f, i))
            continue;
        profile_corners(f, i, x);
        bool left = true, right = true;
        for (int k = 0; k <= f->dim; k++) {
            left &= x[k][0] < point[0];
            right &= x[k][0] > point[0];
        }
        if (left || right || silt_group_find(f->group, grid->link[grid->offset[i]]) != f->main)
            continue;
        for (int k = 0; k <= f->dim; k++) {
            const double *a = x[(k + 1) % (f->dim + 1)], *b = x[(k + 2) % (f->dim + 1)], *c = x[(k + 3) % 4];
            if (f->dim == 2) {
                const double step = b[0] - a[0], s = step != 0 ? (point[0] - a[0]) / step : 0;
                if (s >= 0 && s <= 1 && (step != 0 || point[0] == a[0]))
                    best = silt_max(best, step != 0 ? a[1] + s * (b[1] - a[1]) : silt_max(a[1], b[1]));
                continue;
            }
            const double area = profile_measure(2, a, b, c, NULL), u = profile_measure(2, a, point, c, NULL) / area,
                         v = profile_measure(2, a, b, point, NULL) / area;
            if (area != 0 && u >= -1e-12 && v >= -1e-12 && u + v <= 1 + 1e-12)
                best = silt_max(best, a[2] + u * (b[2] - a[2]) + v * (c[2] - a[2]));
        }
    }
    return best > -HUGE_VAL ? best : NAN;
}

// the field at a point, in the cell that holds it best
static double profile_value(const profile_frame *f, const double *point, silt_profile profile) {
    const silt_grid *grid = &f->grid;
    double best = -PROFILE_SLACK, value[3] = {NAN, NAN, NAN};
    for (int i = 0; i < grid->n_cell && best < 0; i++) {
        const double *x[4];
        if (!profile_cell(f, i))
            continue;
        profile_corners(f, i, x);
        const double all = profile_measure(f->dim, x[0], x[1], x[2], x[3]);
        double w[4] = {0}, least = HUGE_VAL, sum = 0;
        for (int k = 0; k <= f->dim; k++) {
            const double *y[4] = {x[0], x[1], x[2], x[3]};
            y[k] = point;
            w[k] = profile_measure(f->dim, y[0], y[1], y[2], y[3]) / all;
            least = silt_min(least, w[k]);
        }
        if (!(least > best))
            continue;
        best = least;
        for (int k = 0; k <= f->dim; k++)
            sum += w[k] = silt_max(0, w[k]);
        for (int d = 0; d < grid->width; d++) {
            value[d] = 0;
            for (int k = 0; k <= f->dim; k++)
                value[d] += w[k] / sum * grid->value[grid->width * grid->link[grid->offset[i] + k] + d];
        }
    }
    switch (profile) {
    case PROFILE_VELOCITY_Y:
        return value[1];
    case PROFILE_VELOCITY_Z:
        return value[2];
    case PROFILE_SPEED:
        return sqrt(value[0] * value[0] + value[1] * value[1] + value[2] * value[2]);
    default:
        return value[0];
    }
}

// 2-D: height of the highest wall that has the water above it, NaN: there is none
static double profile_floor(const silt_scene *scene, double x) {
    double best = -HUGE_VAL;
    for (int i = 0; i < scene->n_wall && scene->dimension != 3; i++) {
        const silt_wall *wall = &scene->wall[i];
        const int n = wall->n_point - (wall->closed ? 0 : 1);
        for (int k = 0; k < n && wall->motion.n_row == 0; k++) {
            const double *a = wall->point + 3 * k, *b = wall->point + 3 * ((k + 1) % wall->n_point);
            if (b[0] > a[0] && x >= a[0] && x <= b[0])
                best = silt_max(best, a[1] + (b[1] - a[1]) * (x - a[0]) / (b[0] - a[0]));
        }
    }
    return best > -HUGE_VAL ? best : NAN;
}

bool silt_profile_sample(const silt_scene *scene, const char *out, const silt_check_def *def,
                         const silt_curve *reference, silt_curve *profile, char *note) {
    silt_frame_entry *entry = NULL;
    const int n = silt_frame_index(out, &entry);
    bool read = false;

    // the frame at the time, or the two around it
    int first = 0;
    while (first + 1 < n && entry[first + 1].time <= def->at)
        first++;
    const double apart = n > 1 ? (entry[n - 1].time - entry[0].time) / (n - 1) : scene->time.output;
    if (first + 1 < n && entry[first + 1].time - def->at < PROFILE_SAME * apart)
        first++;
    const bool on = n > 0 && fabs(entry[first].time - def->at) <= PROFILE_SAME * apart;
    if (n == 0 || (!on && (def->at < entry[0].time || first + 1 == n))) {
        snprintf(note, 256, n ? "the frames are from %g to %g s, the profile is wanted at %g" : "there are no frames",
                 n ? entry[0].time : 0, n ? entry[n - 1].time : 0, def->at);
        free(entry);
        return false;
    }
    const int count = on ? 1 : 2;
    const double later = on ? 0 : (def->at - entry[first].time) / (entry[first + 1].time - entry[first].time);

    // along the x axis without a line
    double direction[3] = {1, 0, 0}, length = 0;
    for (int d = 0; d < 3; d++)
        length += silt_square(def->line[3 + d] - def->line[d]);
    length = sqrt(length);
    for (int d = 0; d < 3 && length > 0; d++)
        direction[d] = (def->line[3 + d] - def->line[d]) / length;

    double *value = silt_alloc(2 * (size_t)reference->n + 1, sizeof *value);
    for (int k = 0; k < count; k++) {
        profile_frame frame;
        read = profile_open(&frame, scene, out, entry[first + k].number, def->profile);
        if (!read) {
            snprintf(note, 256, "frame %d cannot be read or has no such field", entry[first + k].number);
            break;
        }
        for (int i = 0; i < reference->n; i++) {
            const double s = reference->x[i] / def->place_scale - def->place_shift;
            double point[3];
            for (int d = 0; d < 3; d++)
                point[d] = def->line[d] + s * direction[d];
            value[2 * i + k] = NAN;
            if (length > 0 && (s < -1e-9 * length || s > (1 + 1e-9) * length))
                continue;
            if (def->profile == PROFILE_SURFACE) {
                value[2 * i + k] = profile_top(&frame, point);
                if (isnan(value[2 * i + k]))
                    value[2 * i + k] = profile_floor(scene, point[0]);
            } else {
                value[2 * i + k] = profile_value(&frame, point, def->profile);
            }
        }
        profile_close(&frame);
    }
    for (int i = 0; i < reference->n && read; i++) {
        const double v = on ? value[2 * i] : (1 - later) * value[2 * i] + later * value[2 * i + 1];
        silt_curve_add(profile, reference->x[i], def->scale * (v + def->shift));
    }
    free(value);
    free(entry);
    return read;
}
