// solid.c: closed triangulated surfaces: what is wrong with one, integrals, nearest points, rays, crossings
#include "solid.h"

#include "wall.h"

enum { LEAF = 4, DEEP = 64 };
static const double solid_flat = 1e-12; // of the extent's third power: less volume is none

void silt_solid_clear(silt_solid *s) {
    free(s->point);
    free(s->face);
    free(s->beside);
    free(s->normal);
    free(s->corner);
    free(s->box);
    free(s->item);
    *s = (silt_solid){0};
}

static void solid_corners(const silt_solid *s, int f, double c[3][3]) {
    for (int k = 0; k < 3; k++)
        memcpy(c[k], s->point[s->face[f][k]], sizeof c[k]);
}

// ---------------------------------------------------------------- edges

typedef struct solid_edge {
    int low, high, face, at;
    bool backwards; // runs from the higher to the lower point
} solid_edge;

static int compare_edges(const void *a, const void *b) {
    const solid_edge *p = a, *q = b;
    if (p->low != q->low)
        return p->low < q->low ? -1 : 1;
    if (p->high != q->high)
        return p->high < q->high ? -1 : 1;
    return p->face - q->face;
}

static silt_status solid_join(silt_solid *s, const char *what, silt_error *err) {
    const int n = 3 * s->n_face;
    solid_edge *edge = silt_alloc((size_t)n + 1, sizeof *edge);
    for (int f = 0; f < s->n_face; f++)
        for (int k = 0; k < 3; k++) {
            const int a = s->face[f][k], b = s->face[f][(k + 1) % 3];
            edge[3 * f + k] = (solid_edge){a < b ? a : b, a < b ? b : a, f, k, a > b};
        }
    qsort(edge, (size_t)n, sizeof *edge, compare_edges);
    silt_status status = SILT_OK;
    for (int first = 0, last; first < n && status == SILT_OK; first = last) {
        for (last = first; last < n && edge[last].low == edge[first].low && edge[last].high == edge[first].high;)
            last++;
        const double *x = s->point[edge[first].low];
        if (last - first == 2 && edge[first].backwards != edge[first + 1].backwards) {
            s->beside[edge[first].face][edge[first].at] = edge[first + 1].face;
            s->beside[edge[first + 1].face][edge[first + 1].at] = edge[first].face;
        } else if (last - first == 1) {
            status = silt_fail(err, SILT_INPUT, "%s: found the surface open at (%g, %g, %g), allowed a closed one: an edge there has one triangle", what, x[0], x[1], x[2]);
        } else if (last - first == 2) {
            status = silt_fail(err, SILT_INPUT, "%s: found two triangles turned against each other at (%g, %g, %g), allowed triangles that are all counter-clockwise from outside", what, x[0], x[1], x[2]);
        } else {
            status = silt_fail(err, SILT_INPUT, "%s: found %d triangles at an edge at (%g, %g, %g), allowed two", what, last - first, x[0], x[1], x[2]);
        }
    }
    free(edge);
    return status;
}

// ---------------------------------------------------------------- integrals

// volume, first and second moments over the tetrahedra between the origin of the first point and the faces
static void solid_integrate(silt_solid *s) {
    double volume = 0, first[3] = {0}, second[3][3] = {{0}};
    const double *origin = s->point[0];
    for (int f = 0; f < s->n_face; f++) {
        double c[3][3], n[3], sum[3] = {0};
        solid_corners(s, f, c);
        for (int k = 0; k < 3; k++)
            for (int d = 0; d < 3; d++)
                sum[d] += c[k][d] -= origin[d];
        silt_cross(c[1], c[2], n);
        const double det = wall_dot(c[0], n);
        volume += det / 6;
        for (int i = 0; i < 3; i++) {
            first[i] += det / 24 * sum[i];
            for (int j = 0; j < 3; j++)
                second[i][j] += det / 120 * (c[0][i] * c[0][j] + c[1][i] * c[1][j] + c[2][i] * c[2][j] + sum[i] * sum[j]);
        }
    }
    s->volume = volume;
    for (int i = 0; i < 3; i++)
        s->centroid[i] = volume != 0 ? first[i] / volume : 0;
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            second[i][j] -= volume * s->centroid[i] * s->centroid[j];
    const double trace = second[0][0] + second[1][1] + second[2][2];
    for (int i = 0; i < 3; i++) {
        s->inertia[i] = trace - second[i][i];
        s->centroid[i] += origin[i];
    }
    s->inertia[3] = -second[0][1];
    s->inertia[4] = -second[0][2];
    s->inertia[5] = -second[1][2];
    s->radius = 0;
    for (int i = 0; i < s->n_point; i++) {
        const double d[3] = {s->point[i][0] - s->centroid[0], s->point[i][1] - s->centroid[1], s->point[i][2] - s->centroid[2]};
        s->radius = silt_max(s->radius, silt_length(3, d));
    }
}

static void solid_normals(silt_solid *s) {
    memset(s->corner, 0, (size_t)s->n_point * sizeof *s->corner);
    for (int f = 0; f < s->n_face; f++) {
        double c[3][3], u[3], v[3], *n = s->normal[f];
        solid_corners(s, f, c);
        for (int k = 0; k < 3; k++) {
            for (int d = 0; d < 3; d++) {
                u[d] = c[(k + 1) % 3][d] - c[k][d];
                v[d] = c[(k + 2) % 3][d] - c[k][d];
            }
            if (k == 0) {
                silt_cross(u, v, n);
                const double length = silt_length(3, n);
                for (int d = 0; d < 3; d++)
                    n[d] /= length > 0 ? length : 1;
            }
            const double angle = acos(silt_clamp(wall_dot(u, v) / (silt_length(3, u) * silt_length(3, v) + 1e-300), -1, 1));
            for (int d = 0; d < 3; d++)
                s->corner[s->face[f][k]][d] += angle * n[d];
        }
    }
}

// ---------------------------------------------------------------- the tree

static void box_fit(silt_solid *s, silt_solid_box *box, int first, int n) {
    for (int d = 0; d < 3; d++) {
        box->lo[d] = HUGE_VAL;
        box->hi[d] = -HUGE_VAL;
    }
    for (int k = first; k < first + n; k++)
        for (int c = 0; c < 3; c++)
            for (int d = 0; d < 3; d++) {
                const double x = s->point[s->face[s->item[k]][c]][d];
                box->lo[d] = silt_min(box->lo[d], x);
                box->hi[d] = silt_max(box->hi[d], x);
            }
}

typedef struct solid_key {
    double at;
    int face;
} solid_key;

static int compare_keys(const void *a, const void *b) {
    const solid_key *p = a, *q = b;
    return p->at != q->at ? (p->at < q->at ? -1 : 1) : p->face - q->face;
}

// halves by the longest side of the box
static void solid_tree(silt_solid *s) {
    typedef struct span {
        int box, first, n;
    } span;
    span *stack = silt_alloc((size_t)s->n_face + DEEP, sizeof *stack);
    solid_key *key = silt_alloc((size_t)s->n_face + 1, sizeof *key);
    int top = 0;
    for (int f = 0; f < s->n_face; f++)
        s->item[f] = f;
    s->n_box = 1;
    stack[top++] = (span){0, 0, s->n_face};
    while (top) {
        const span now = stack[--top];
        silt_solid_box *box = &s->box[now.box];
        box_fit(s, box, now.first, now.n);
        box->first = now.first;
        box->count = now.n;
        if (now.n <= LEAF)
            continue;
        int axis = 0;
        for (int d = 1; d < 3; d++)
            axis = box->hi[d] - box->lo[d] > box->hi[axis] - box->lo[axis] ? d : axis;
        for (int k = 0; k < now.n; k++) {
            const int f = s->item[now.first + k];
            key[k] = (solid_key){0, f};
            for (int c = 0; c < 3; c++)
                key[k].at += s->point[s->face[f][c]][axis];
        }
        qsort(key, (size_t)now.n, sizeof *key, compare_keys);
        for (int k = 0; k < now.n; k++)
            s->item[now.first + k] = key[k].face;
        box->first = s->n_box;
        box->count = 0;
        const int half = now.n / 2;
        stack[top++] = (span){s->n_box, now.first, half};
        stack[top++] = (span){s->n_box + 1, now.first + half, now.n - half};
        s->n_box += 2;
    }
    free(stack);
    free(key);
}

void silt_solid_refit(silt_solid *s) {
    solid_normals(s);
    solid_integrate(s);
    for (int b = s->n_box - 1; b >= 0; b--) {
        silt_solid_box *box = &s->box[b];
        if (box->count) {
            box_fit(s, box, box->first, box->count);
            continue;
        }
        for (int d = 0; d < 3; d++) {
            box->lo[d] = silt_min(s->box[box->first].lo[d], s->box[box->first + 1].lo[d]);
            box->hi[d] = silt_max(s->box[box->first].hi[d], s->box[box->first + 1].hi[d]);
        }
    }
}

static double box_distance(const silt_solid_box *box, const double x[3]) {
    double sum = 0;
    for (int d = 0; d < 3; d++)
        sum += silt_square(silt_max(0, silt_max(box->lo[d] - x[d], x[d] - box->hi[d])));
    return sum;
}

// nearest face with the feature that holds the point; @return the distance squared
static double solid_search(const silt_solid *s, const double x[3], double far, const uint8_t *wanted, double on[3], int *face, int *feature) {
    double best = far < HUGE_VAL ? far * far : HUGE_VAL;
    int stack[DEEP], top = 0;
    *face = -1;
    stack[top++] = 0;
    while (top) {
        const silt_solid_box *box = &s->box[stack[--top]];
        if (box_distance(box, x) > best)
            continue;
        for (int k = 0; k < box->count; k++) {
            const int f = s->item[box->first + k];
            double c[3][3], point[3];
            int of;
            if (wanted && !wanted[f])
                continue;
            solid_corners(s, f, c);
            const double distance = wall_nearest_on_triangle((const double(*)[3])c, x, point, &of);
            if (distance < best || (distance == best && *face >= 0 && f < *face)) {
                best = distance;
                *face = f;
                *feature = of;
                memcpy(on, point, sizeof point);
            }
        }
        if (!box->count) {
            const bool swap = box_distance(&s->box[box->first], x) < box_distance(&s->box[box->first + 1], x);
            stack[top++] = box->first + (swap ? 1 : 0);
            stack[top++] = box->first + (swap ? 0 : 1);
        }
    }
    return *face < 0 ? HUGE_VAL : best;
}

double silt_solid_nearest(const silt_solid *s, const double x[3], double far, const uint8_t *wanted, double on[3], int *face) {
    double point[3];
    int of, feature;
    const double square = solid_search(s, x, far, wanted, on ? on : point, face ? face : &of, &feature);
    return sqrt(square);
}

double silt_solid_distance(const silt_solid *s, const double x[3], double on[3], int *face) {
    double point[3], n[3];
    int of, feature;
    const double square = solid_search(s, x, HUGE_VAL, NULL, point, &of, &feature);
    memcpy(n, feature >= 4 ? s->corner[s->face[of][feature - 4]] : s->normal[of], sizeof n);
    for (int d = 0; d < 3 && feature > 0 && feature < 4; d++)
        n[d] += s->normal[s->beside[of][feature - 1]][d];
    double side = 0;
    for (int d = 0; d < 3; d++)
        side += (x[d] - point[d]) * n[d];
    if (on)
        memcpy(on, point, sizeof point);
    if (face)
        *face = of;
    return side < 0 ? -sqrt(square) : sqrt(square);
}

bool silt_solid_contains(const silt_solid *s, const double x[3]) {
    for (int d = 0; d < 3; d++)
        if (x[d] < s->box[0].lo[d] || x[d] > s->box[0].hi[d])
            return false;
    return silt_solid_distance(s, x, NULL, NULL) < 0;
}

void silt_solid_query(const silt_solid *s, const double lo[3], const double hi[3], int **list, int *n, int *capacity) {
    int stack[DEEP], top = 0;
    stack[top++] = 0;
    while (top) {
        const silt_solid_box *box = &s->box[stack[--top]];
        bool apart = false;
        for (int d = 0; d < 3; d++)
            apart |= box->lo[d] > hi[d] || box->hi[d] < lo[d];
        if (apart)
            continue;
        for (int k = 0; k < box->count; k++) {
            SILT_RESERVE(*list, *capacity, *n + 1);
            (*list)[(*n)++] = s->item[box->first + k];
        }
        if (!box->count) {
            stack[top++] = box->first;
            stack[top++] = box->first + 1;
        }
    }
}

// ---------------------------------------------------------------- rays and crossings

// Where the line x + t u goes through the triangle, strictly inside of it. @return false: beside it, or along it
static bool line_meets(const double c[3][3], const double x[3], const double u[3], double *t) {
    double e[3], g[3], p[3], q[3], w[3];
    for (int d = 0; d < 3; d++) {
        e[d] = c[1][d] - c[0][d];
        g[d] = c[2][d] - c[0][d];
        w[d] = x[d] - c[0][d];
    }
    silt_cross(u, g, p);
    const double det = wall_dot(e, p), size = silt_length(3, e) * silt_length(3, g) * silt_length(3, u);
    if (fabs(det) <= 1e-10 * size)
        return false;
    silt_cross(w, e, q);
    const double a = wall_dot(w, p) / det, b = wall_dot(u, q) / det;
    *t = wall_dot(g, q) / det;
    return a > 1e-9 && b > 1e-9 && a + b < 1 - 1e-9;
}

// true when the ray may meet the box before it has gone `far`
static bool box_met(const silt_solid_box *box, const double x[3], const double u[3], double far) {
    double enter = 0, leave = far;
    for (int d = 0; d < 3; d++) {
        if (u[d] == 0) {
            if (x[d] < box->lo[d] || x[d] > box->hi[d])
                return false;
            continue;
        }
        const double a = (box->lo[d] - x[d]) / u[d], b = (box->hi[d] - x[d]) / u[d];
        enter = silt_max(enter, silt_min(a, b));
        leave = silt_min(leave, silt_max(a, b));
    }
    return enter <= leave * (1 + 1e-12) + 1e-300;
}

double silt_solid_ray(const silt_solid *s, const double x[3], const double u[3], double least, int *face) {
    double best = HUGE_VAL;
    int stack[DEEP], top = 0;
    stack[top++] = 0;
    while (top) {
        const silt_solid_box *box = &s->box[stack[--top]];
        if (!box_met(box, x, u, best))
            continue;
        for (int k = 0; k < box->count; k++) {
            double c[3][3], t;
            solid_corners(s, s->item[box->first + k], c);
            if (line_meets((const double(*)[3])c, x, u, &t) && t > least && t < best) {
                best = t;
                if (face)
                    *face = s->item[box->first + k];
            }
        }
        if (!box->count) {
            stack[top++] = box->first;
            stack[top++] = box->first + 1;
        }
    }
    return best;
}

static bool segment_crosses(const double c[3][3], const double *a, const double *b) {
    const double u[3] = {b[0] - a[0], b[1] - a[1], b[2] - a[2]};
    double t;
    return line_meets(c, a, u, &t) && t > 1e-9 && t < 1 - 1e-9;
}

// true when an edge of one triangle goes through the inside of the other; edges that have a corner in common with it do not count
static bool faces_cross(const silt_solid *p, int f, const silt_solid *q, int g) {
    double a[3][3], b[3][3];
    solid_corners(p, f, a);
    solid_corners(q, g, b);
    for (int k = 0; k < 3; k++) {
        bool own = false, other = false;
        for (int m = 0; m < 3 && p == q; m++)
            for (int end = 0; end < 2; end++) {
                own |= p->face[f][(k + end) % 3] == q->face[g][m];
                other |= q->face[g][(k + end) % 3] == p->face[f][m];
            }
        if ((!own && segment_crosses((const double(*)[3])b, a[k], a[(k + 1) % 3])) ||
            (!other && segment_crosses((const double(*)[3])a, b[k], b[(k + 1) % 3])))
            return true;
    }
    return false;
}

int silt_solid_crossing(const silt_solid *s, const silt_solid *other) {
    int *list = NULL, capacity = 0, found = -1;
    for (int g = 0; g < other->n_face && found < 0; g++) {
        double lo[3], hi[3], c[3][3];
        int n = 0;
        solid_corners(other, g, c);
        for (int d = 0; d < 3; d++) {
            lo[d] = silt_min(c[0][d], silt_min(c[1][d], c[2][d]));
            hi[d] = silt_max(c[0][d], silt_max(c[1][d], c[2][d]));
        }
        silt_solid_query(s, lo, hi, &list, &n, &capacity);
        for (int k = 0; k < n && found < 0; k++)
            if ((s != other || list[k] > g) && faces_cross(s, list[k], other, g))
                found = g;
    }
    free(list);
    return found;
}

silt_status silt_solid_close(silt_solid *s, const char *what, silt_error *err) {
    free(s->beside);
    free(s->normal);
    free(s->corner);
    free(s->box);
    free(s->item);
    s->beside = silt_alloc((size_t)s->n_face + 1, sizeof *s->beside);
    s->normal = silt_alloc((size_t)s->n_face + 1, sizeof *s->normal);
    s->corner = silt_alloc((size_t)s->n_point + 1, sizeof *s->corner);
    s->box = silt_alloc(2 * (size_t)s->n_face + 1, sizeof *s->box);
    s->item = silt_alloc((size_t)s->n_face + 1, sizeof *s->item);
    if (s->n_face < 4)
        return silt_fail(err, SILT_INPUT, "%s: found %d triangles, allowed a closed surface of at least 4", what, s->n_face);
    SILT_TRY(solid_join(s, what, err));
    solid_normals(s);
    solid_integrate(s);
    solid_tree(s);
    double extent = 0;
    for (int d = 0; d < 3; d++)
        extent = silt_max(extent, s->box[0].hi[d] - s->box[0].lo[d]);
    if (!(fabs(s->volume) > solid_flat * extent * extent * extent))
        return silt_fail(err, SILT_INPUT, "%s: found no volume, allowed a surface that has water outside and body inside", what);
    if (s->volume < 0)
        return silt_fail(err, SILT_INPUT, "%s: found the surface turned inside out (volume %g m3), allowed triangles that are counter-clockwise from outside", what, s->volume);
    const int crossed = silt_solid_crossing(s, s);
    if (crossed >= 0) {
        const double *x = s->point[s->face[crossed][0]];
        return silt_fail(err, SILT_INPUT, "%s: found the surface crossing itself near (%g, %g, %g), allowed one that does not", what, x[0], x[1], x[2]);
    }
    return SILT_OK;
}
