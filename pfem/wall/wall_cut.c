// holes in walls: where water passes through an opening that lies in a wall, the wall is not there
#include "wall.h"

typedef struct piece_list {
    int n, capacity;
    wall_piece *piece; // owned
} piece_list;

static void piece_add(piece_list *list, const double *a, const double *b, const double *c, int source) {
    SILT_RESERVE(list->piece, list->capacity, list->n + 1);
    wall_piece *p = &list->piece[list->n++];
    *p = (wall_piece){.source = source};
    memcpy(p->corner[0], a, sizeof p->corner[0]);
    memcpy(p->corner[1], b, sizeof p->corner[1]);
    if (c)
        memcpy(p->corner[2], c, sizeof p->corner[2]);
}

// what is left of a segment on both sides of the opening
static void cut_segment(piece_list *list, const silt_opening *o, const wall_piece *piece) {
    const double *a = piece->corner[0], *b = piece->corner[1], gap = 1e-9 * o->size;
    const double end[2][3] = {{o->from[0], o->from[1], 0}, {o->to[0], o->to[1], 0}};
    double at[2], length = hypot(b[0] - a[0], b[1] - a[1]);
    for (int k = 0; k < 2; k++)
        at[k] = ((end[k][0] - a[0]) * (b[0] - a[0]) + (end[k][1] - a[1]) * (b[1] - a[1])) / length;
    const int first = at[0] < at[1] ? 0 : 1;
    if (at[1 - first] <= gap || at[first] >= length - gap) {
        piece_add(list, a, b, NULL, piece->source);
        return;
    }
    if (at[first] > gap)
        piece_add(list, a, end[first], NULL, piece->source);
    if (at[1 - first] < length - gap)
        piece_add(list, end[1 - first], b, NULL, piece->source);
}

// the part of a convex polygon on one side of a line. @return its corners
static int clip(int n, const double (*x)[3], const double p[3], const double in[3], double sign, double gap, double (*out)[3]) {
    int m = 0;
    for (int k = 0; k < n; k++) {
        double h[2] = {0, 0};
        const double *a = x[k], *b = x[(k + 1) % n];
        for (int d = 0; d < 3; d++) {
            h[0] += sign * (a[d] - p[d]) * in[d];
            h[1] += sign * (b[d] - p[d]) * in[d];
        }
        if (h[0] >= -gap)
            memcpy(out[m++], a, 3 * sizeof *a);
        if ((h[0] > gap && h[1] < -gap) || (h[0] < -gap && h[1] > gap)) {
            for (int d = 0; d < 3; d++)
                out[m][d] = a[d] + (b[d] - a[d]) * h[0] / (h[0] - h[1]);
            m++;
        }
    }
    return m;
}

static double corner_area(const double *a, const double *b, const double *c) {
    double u[3], v[3], n[3];
    for (int d = 0; d < 3; d++) {
        u[d] = b[d] - a[d];
        v[d] = c[d] - a[d];
    }
    silt_cross(u, v, n);
    return 0.5 * sqrt(wall_dot(n, n));
}

// what is left of a triangle: beyond each side of the opening in turn
static void cut_triangle(piece_list *list, const silt_opening *o, const wall_piece *piece) {
    // a cut adds a corner at most
    const size_t room = (size_t)o->n_corner + 8;
    double(*rest)[3] = silt_alloc(3 * room, sizeof *rest), (*beyond)[3] = rest + room, (*kept)[3] = beyond + room;
    int n = 3;
    const double gap = 1e-9 * o->size;
    const int first = list->n;
    memcpy(rest, piece->corner, sizeof piece->corner);
    for (int c = 0; c < o->n_corner && n >= 3; c++) {
        const double *p = o->corner + 3 * c, *q = o->corner + 3 * ((c + 1) % o->n_corner);
        const double edge[3] = {q[0] - p[0], q[1] - p[1], q[2] - p[2]};
        double in[3];
        silt_cross(o->normal, edge, in);
        const double length = sqrt(wall_dot(in, in));
        for (int d = 0; d < 3; d++)
            in[d] /= length;
        const int m = clip(n, (const double(*)[3])rest, p, in, -1, gap, beyond);
        for (int k = 1; k + 1 < m; k++)
            if (corner_area(beyond[0], beyond[k], beyond[k + 1]) > gap * o->size)
                piece_add(list, beyond[0], beyond[k], beyond[k + 1], piece->source);
        n = clip(n, (const double(*)[3])rest, p, in, 1, gap, kept);
        memcpy(rest, kept, (size_t)n * sizeof *rest);
    }
    double left = 0;
    for (int k = 1; k + 1 < n; k++)
        left += corner_area(rest[0], rest[k], rest[k + 1]);
    free(rest);
    if (left > gap * o->size)
        return;
    // nothing of it lies in the opening: whole as it was
    list->n = first;
    piece_add(list, piece->corner[0], piece->corner[1], piece->corner[2], piece->source);
}

// true when v lies on the edge from a to b, at neither of its ends
static bool on_edge(const double *a, const double *b, const double *v, double gap) {
    double along = 0, square = 0, off = 0;
    for (int d = 0; d < 3; d++) {
        along += (v[d] - a[d]) * (b[d] - a[d]);
        square += silt_square(b[d] - a[d]);
    }
    const double share = along / square, margin = gap / sqrt(square);
    if (!(share > margin && share < 1 - margin))
        return false;
    for (int d = 0; d < 3; d++)
        off += silt_square(v[d] - a[d] - share * (b[d] - a[d]));
    return off < gap * gap;
}

// Where a corner of one triangle lies on another one's edge the other is split there: elements join corner by corner.
static void split_edges(piece_list *list, const uint8_t *cut, double gap) {
    piece_list corner = {0};
    for (int i = 0; i < list->n; i++)
        if (cut[list->piece[i].source])
            piece_add(&corner, list->piece[i].corner[0], list->piece[i].corner[1], list->piece[i].corner[2], 0);
    for (int i = 0; i < list->n; i++)
        for (int m = 0; m < 3 * corner.n; m++) {
            const double *v = corner.piece[m / 3].corner[m % 3];
            const wall_piece p = list->piece[i];
            for (int k = 0; k < 3; k++) {
                const double *a = p.corner[k], *b = p.corner[(k + 1) % 3], *c = p.corner[(k + 2) % 3];
                if (!on_edge(a, b, v, gap))
                    continue;
                piece_add(list, v, b, c, p.source);
                memcpy(list->piece[i].corner[(k + 1) % 3], v, 3 * sizeof *v);
                break;
            }
        }
    free(corner.piece);
}

int wall_turned(const silt_walls *walls, const silt_scene *scene) {
    for (int k = 0; k < silt_opening_count(scene); k++) {
        const silt_opening o = silt_opening_of(scene, k);
        double middle[3] = {0}, in[3];
        for (int c = 0; c < o.n_corner; c++)
            for (int d = 0; d < 3; d++)
                middle[d] += o.corner[3 * c + d] / o.n_corner;
        for (int e = 0; e < walls->count && walls->dim == 3; e++) {
            if (wall_dot(walls->normal[e], o.normal) > 1e-9 - 1 || walls->index->step[walls->wall[e]].moves ||
                fabs(silt_opening_height(&o, walls->corner[e][0])) > 1e-6 * o.size)
                continue;
            wall_inside(walls, e, middle, in);
            if (in[0] >= 0 && in[1] >= 0 && in[2] >= 0)
                return k;
        }
    }
    return -1;
}

int wall_cut(const silt_walls *walls, const silt_scene *scene, wall_piece **piece) {
    piece_list list = {0};
    const int dim = wall_dim(walls);
    uint8_t *cut = silt_alloc((size_t)walls->count + 1, 1);
    double size = HUGE_VAL;
    for (int e = 0; e < walls->count; e++) {
        double room[3][3];
        const double *c[3] = {NULL};
        for (int k = 0; k < dim; k++)
            c[k] = wall_corner(walls, e, k, room[k]);
        piece_add(&list, c[0], c[1], c[2], e);
    }
    for (int k = 0; k < silt_opening_count(scene); k++) {
        const silt_opening o = silt_opening_of(scene, k);
        if (o.inlet && !o.level && dim == 2)
            continue; // prescribed velocity: a wall behind it does no harm; in space its creases would want nodes of their own
        piece_list next = {0};
        for (int i = 0; i < list.n; i++) {
            const wall_piece *p = &list.piece[i];
            const int e = p->source;
            bool in = wall_dot(walls->normal[e], o.normal) > 1 - 1e-9 && !walls->index->step[walls->wall[e]].moves;
            for (int c = 0; c < dim && in; c++)
                in = fabs(silt_opening_height(&o, p->corner[c])) <= 1e-6 * o.size;
            if (!in)
                piece_add(&next, p->corner[0], p->corner[1], dim == 3 ? p->corner[2] : NULL, e);
            else if (dim == 3) {
                const int n = next.n;
                cut_triangle(&next, &o, p);
                cut[e] |= next.n != n + 1 || memcmp(next.piece[n].corner, p->corner, sizeof p->corner) != 0;
            } else
                cut_segment(&next, &o, p);
        }
        size = silt_min(size, o.size);
        free(list.piece);
        list = next;
    }
    if (dim == 3)
        split_edges(&list, cut, 1e-7 * size);
    free(cut);
    *piece = list.piece;
    return list.n;
}
