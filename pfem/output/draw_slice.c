// a plane cut through a frame of three dimensions, as a frame of two: the cells' sections, and those of the walls

#include "draw.h"

/** points on edges of the cut cells, found by the edge's nodes */
typedef struct slice {
    const silt_grid *from;
    silt_grid *to;
    int axis, right, up; // across the plane, along the picture
    double at;
    int x_capacity, value_capacity, link_capacity, offset_capacity;
    size_t room;   // of the table, a power of two
    int (*key)[3]; // owned, nodes and point; point -1: free
} slice;

// axes of the picture for a cut across an axis
static void slice_axes(int axis, int *right, int *up) {
    *right = axis == 0 ? 1 : 0;
    *up = axis == 2 ? 1 : 2;
}

static int slice_point(slice *s, int a, int b) {
    const int low = a < b ? a : b, high = a < b ? b : a;
    size_t k = ((size_t)low * 2654435761u ^ (size_t)high * 40503u) & (s->room - 1);
    while (s->key[k][2] >= 0 && (s->key[k][0] != low || s->key[k][1] != high))
        k = (k + 1) & (s->room - 1);
    if (s->key[k][2] >= 0)
        return s->key[k][2];
    const silt_grid *from = s->from;
    silt_grid *to = s->to;
    const double *x = from->x + 3 * low, *y = from->x + 3 * high;
    const double t = (s->at - x[s->axis]) / (y[s->axis] - x[s->axis]);
    const int n = to->n_point++;
    SILT_RESERVE(to->x, s->x_capacity, 3 * (n + 1));
    to->x[3 * n] = x[s->right] + t * (y[s->right] - x[s->right]);
    to->x[3 * n + 1] = x[s->up] + t * (y[s->up] - x[s->up]);
    to->x[3 * n + 2] = 0;
    if (from->value) {
        SILT_RESERVE(to->value, s->value_capacity, n + 1);
        to->value[n] = from->value[low] + t * (from->value[high] - from->value[low]);
    }
    s->key[k][0] = low, s->key[k][1] = high;
    return s->key[k][2] = n;
}

static void slice_triangle(slice *s, int a, int b, int c) {
    silt_grid *to = s->to;
    const int n = to->n_cell++, corner[3] = {a, b, c};
    SILT_RESERVE(to->link, s->link_capacity, 3 * (n + 1));
    SILT_RESERVE(to->offset, s->offset_capacity, n + 2);
    memcpy(to->link + 3 * n, corner, sizeof corner);
    to->offset[n + 1] = 3 * (n + 1);
}

void silt_draw_slice(const silt_draw_canvas *c, silt_grid *grid) {
    silt_grid cut = {.time = grid->time};
    slice s = {.from = grid, .to = &cut, .axis = c->slice - 1, .at = c->slice_at};
    slice_axes(s.axis, &s.right, &s.up);
    SILT_RESERVE(cut.x, s.x_capacity, 3);
    SILT_RESERVE(cut.link, s.link_capacity, 3);
    SILT_RESERVE(cut.offset, s.offset_capacity, 1);
    cut.offset[0] = 0;
    if (grid->value)
        SILT_RESERVE(cut.value, s.value_capacity, 1);
    // at most four cut edges a cell
    size_t n_cut = 0;
    for (int pass = 0; pass < 2; pass++) {
        for (int i = 0; i < grid->n_cell; i++) {
            const int *node = grid->link + grid->offset[i];
            int before[4], behind[4], n = 0, m = 0;
            for (int k = 0; k < 4 && silt_grid_corners(grid, i) == 4; k++)
                if (grid->x[3 * node[k] + s.axis] < s.at)
                    before[n++] = node[k];
                else
                    behind[m++] = node[k];
            if (n == 0 || m == 0)
                continue;
            n_cut++;
            if (pass == 0)
                continue;
            if (n == 2) {
                const int p = slice_point(&s, before[0], behind[0]), q = slice_point(&s, before[0], behind[1]),
                          r = slice_point(&s, before[1], behind[1]), t = slice_point(&s, before[1], behind[0]);
                slice_triangle(&s, p, q, r);
                slice_triangle(&s, p, r, t);
            } else {
                const int *one = n == 1 ? before : behind, *three = n == 1 ? behind : before;
                slice_triangle(&s, slice_point(&s, one[0], three[0]), slice_point(&s, one[0], three[1]),
                               slice_point(&s, one[0], three[2]));
            }
        }
        if (pass == 0) {
            for (s.room = 64; s.room < 8 * n_cut; s.room *= 2)
                continue;
            s.key = silt_alloc(s.room, sizeof *s.key);
            for (size_t k = 0; k < s.room; k++)
                s.key[k][2] = -1;
        }
    }
    free(s.key);
    cut.width = cut.value ? 1 : 0;
    silt_grid_clear(grid);
    *grid = cut;
}

void silt_draw_slice_grains(const silt_draw_canvas *c, silt_grid *grid) {
    const int axis = c->slice - 1;
    int right, up, n = 0;
    slice_axes(axis, &right, &up);
    for (int i = 0; i < grid->n_point; i++) {
        const double *x = grid->x + 3 * i, at[3] = {x[right], x[up], 0};
        const double rest = silt_square(grid->radius ? grid->radius[i] : 0) - silt_square(x[axis] - c->slice_at);
        if (!(rest > 0))
            continue;
        memcpy(grid->x + 3 * n, at, sizeof at);
        grid->radius[n] = sqrt(rest);
        if (grid->value)
            grid->value[n] = grid->value[i];
        grid->link[n] = grid->offset[n] = n;
        n++;
    }
    grid->offset[n] = n;
    grid->n_point = grid->n_cell = n;
}

// the line in which the plane cuts a triangle; @return false: it does not
static bool slice_line(const silt_draw_canvas *c, const double *const corner[3], int right, int up, double at[4]) {
    int ends = 0;
    for (int k = 0; k < 3; k++) {
        const double *a = corner[k], *b = corner[(k + 1) % 3];
        const double p = a[c->slice - 1] - c->slice_at, q = b[c->slice - 1] - c->slice_at;
        if ((p < 0) == (q < 0) || ends == 2)
            continue;
        at[2 * ends] = a[right] + (b[right] - a[right]) * p / (p - q);
        at[2 * ends + 1] = a[up] + (b[up] - a[up]) * p / (p - q);
        ends++;
    }
    return ends == 2;
}

int silt_draw_slice_faces(const silt_draw_canvas *c, const silt_grid *grid, double (**line)[4]) {
    int n = 0, capacity = 0, right, up;
    slice_axes(c->slice - 1, &right, &up);
    *line = NULL;
    for (int i = 0; i < grid->n_cell; i++)
        for (int k = grid->offset[i] + 1; k + 1 < grid->offset[i + 1]; k++) {
            const double *const corner[3] = {grid->x + 3 * grid->link[grid->offset[i]], grid->x + 3 * grid->link[k],
                                             grid->x + 3 * grid->link[k + 1]};
            SILT_RESERVE(*line, capacity, n + 1);
            n += slice_line(c, corner, right, up, (*line)[n]);
        }
    return n;
}

int silt_draw_lines(const silt_draw_canvas *c, double (**line)[4]) {
    const silt_walls *walls = c->walls;
    int n = 0, right = 0, up = 1;
    *line = silt_alloc((size_t)(walls ? walls->count : 0) + 1, sizeof **line);
    if (c->slice)
        slice_axes(c->slice - 1, &right, &up);
    for (int i = 0; walls && i < walls->count; i++) {
        double *at = (*line)[n];
        if (!c->slice) {
            // walls that stand are drawn whole, with their corners
            if (c->scene->wall[walls->wall[i]].motion.n_row == 0)
                continue;
            memcpy(at, walls->from[i], 2 * sizeof *at);
            memcpy(at + 2, walls->to[i], 2 * sizeof *at);
            n++;
            continue;
        }
        const double *const corner[3] = {walls->corner[i][0], walls->corner[i][1], walls->corner[i][2]};
        n += slice_line(c, corner, right, up, at);
    }
    return n;
}
