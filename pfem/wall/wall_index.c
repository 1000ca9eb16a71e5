// where walls are: trees of boxes over the elements, the nearest point, the side of the water
#include "wall.h"

enum { LEAF_ITEMS = 4, STACK_DEPTH = 64 };

// ---------------------------------------------------------------- one element

const double *wall_corner(const silt_walls *walls, int e, int k, double room[3]) {
    if (walls->dim == 3)
        return walls->corner[e][k];
    const double *end = k ? walls->to[e] : walls->from[e];
    room[0] = end[0];
    room[1] = end[1];
    room[2] = 0;
    return room;
}

int wall_joined(const silt_walls *walls, int e, int k) {
    return walls->dim == 3 ? walls->joined[e][k] : k ? walls->next[e] : walls->previous[e];
}

double wall_rise(const silt_walls *walls, int e, int k, int f) {
    double at_room[3], far_room[3], to[3];
    const double *at = wall_corner(walls, e, k, at_room), *far_corner = NULL;
    if (walls->dim != 3)
        far_corner = wall_corner(walls, f, k ? 1 : 0, far_room);
    else {
        // the corner of f that is not on the edge
        const int *mine = walls->index->vertex[e], a = mine[k], b = mine[(k + 1) % 3];
        for (int c = 0; c < 3; c++)
            if (walls->index->vertex[f][c] != a && walls->index->vertex[f][c] != b)
                far_corner = walls->corner[f][c];
        if (!far_corner)
            return 0;
    }
    for (int d = 0; d < 3; d++)
        to[d] = far_corner[d] - at[d];
    return wall_dot(to, walls->normal[e]);
}

void wall_inside(const silt_walls *walls, int e, const double x[3], double in[3]) {
    if (walls->dim != 3) {
        const double *a = walls->from[e], *b = walls->to[e], dx = b[0] - a[0], dy = b[1] - a[1], length = hypot(dx, dy);
        in[0] = ((x[0] - a[0]) * dx + (x[1] - a[1]) * dy) / length;
        in[1] = length - in[0];
        in[2] = HUGE_VAL;
        return;
    }
    for (int k = 0; k < 3; k++) {
        const double *a = walls->corner[e][k], *b = walls->corner[e][(k + 1) % 3];
        double edge[3], in_plane[3], to[3];
        for (int d = 0; d < 3; d++) {
            edge[d] = b[d] - a[d];
            to[d] = x[d] - a[d];
        }
        silt_cross(walls->normal[e], edge, in_plane);
        in[k] = wall_dot(to, in_plane) / sqrt(wall_dot(edge, edge));
    }
}

static double nearest_on_segment(const double *a, const double *b, const double *x, double on[3], int *feature) {
    const double dx = b[0] - a[0], dy = b[1] - a[1];
    const double t = silt_clamp(((x[0] - a[0]) * dx + (x[1] - a[1]) * dy) / (dx * dx + dy * dy), 0, 1);
    on[0] = a[0] + t * dx;
    on[1] = a[1] + t * dy;
    on[2] = 0;
    *feature = t <= 0 ? 4 : t >= 1 ? 5 : 0;
    return silt_square(x[0] - on[0]) + silt_square(x[1] - on[1]);
}

// the regions of the triangle's corners, edges and inside in turn (Ericson, Real-Time Collision Detection, 5.1.5)
double wall_nearest_on_triangle(const double c[3][3], const double *x, double on[3], int *feature) {
    double ab[3], ac[3], ax[3], bx[3], cx[3];
    for (int d = 0; d < 3; d++) {
        ab[d] = c[1][d] - c[0][d];
        ac[d] = c[2][d] - c[0][d];
        ax[d] = x[d] - c[0][d];
        bx[d] = x[d] - c[1][d];
        cx[d] = x[d] - c[2][d];
    }
    const double d1 = wall_dot(ab, ax), d2 = wall_dot(ac, ax), d3 = wall_dot(ab, bx), d4 = wall_dot(ac, bx);
    const double d5 = wall_dot(ab, cx), d6 = wall_dot(ac, cx);
    const double vc = d1 * d4 - d3 * d2, vb = d5 * d2 - d1 * d6, va = d3 * d6 - d5 * d4;
    double v, w; // weights of the corners 1 and 2
    if (d1 <= 0 && d2 <= 0)
        v = 0, w = 0, *feature = 4;
    else if (d3 >= 0 && d4 <= d3)
        v = 1, w = 0, *feature = 5;
    else if (d6 >= 0 && d5 <= d6)
        v = 0, w = 1, *feature = 6;
    else if (vc <= 0 && d1 >= 0 && d3 <= 0)
        v = d1 / (d1 - d3), w = 0, *feature = 1;
    else if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0)
        w = (d4 - d3) / ((d4 - d3) + (d5 - d6)), v = 1 - w, *feature = 2;
    else if (vb <= 0 && d2 >= 0 && d6 <= 0)
        v = 0, w = d2 / (d2 - d6), *feature = 3;
    else
        v = vb / (va + vb + vc), w = vc / (va + vb + vc), *feature = 0;
    double sum = 0;
    for (int d = 0; d < 3; d++) {
        on[d] = c[0][d] + v * ab[d] + w * ac[d];
        sum += silt_square(x[d] - on[d]);
    }
    return sum;
}

double wall_nearest(const silt_walls *walls, int e, const double x[3], double on[3], int *feature) {
    return walls->dim == 3 ? wall_nearest_on_triangle(walls->corner[e], x, on, feature)
                           : nearest_on_segment(walls->from[e], walls->to[e], x, on, feature);
}

// normal that decides about the side at a feature: of the element, or the sum over those that meet there
static void feature_normal(const silt_walls *walls, int e, int feature, double n[3]) {
    memcpy(n, walls->normal[e], 3 * sizeof *n);
    if (feature == 0)
        return;
    if (walls->dim == 3 && feature >= 4) {
        memcpy(n, walls->index->vertex_normal[walls->index->vertex[e][feature - 4]], 3 * sizeof *n);
        return;
    }
    const int f = wall_joined(walls, e, walls->dim == 3 ? feature - 1 : feature - 4);
    for (int d = 0; d < 3 && f >= 0; d++)
        n[d] += walls->normal[f][d];
}

bool wall_solve(int n, const double *const normal[3], const double value[3], double out[3]) {
    // sum of the normals with weights from their Gram matrix
    double g[3][4] = {{0}};
    out[0] = out[1] = out[2] = 0;
    for (int i = 0; i < n; i++) {
        for (int j = 0; j < n; j++)
            g[i][j] = wall_dot(normal[i], normal[j]);
        g[i][3] = value[i];
    }
    double determinant = 1;
    for (int i = 0; i < n; i++) {
        determinant *= g[i][i];
        if (determinant < 1e-3)
            return false;
        for (int k = i + 1; k < n; k++) {
            const double factor = g[k][i] / g[i][i];
            for (int j = i; j < 4; j++)
                g[k][j] -= factor * g[i][j];
        }
    }
    for (int i = n - 1; i >= 0; i--) {
        for (int j = i + 1; j < n; j++)
            g[i][3] -= g[i][j] * g[j][3];
        g[i][3] /= g[i][i];
        for (int d = 0; d < 3; d++)
            out[d] += g[i][3] * normal[i][d];
    }
    return true;
}

// ---------------------------------------------------------------- trees

static void element_box(const silt_walls *walls, int e, double lo[3], double hi[3]) {
    double room[3];
    for (int k = 0; k < wall_dim(walls); k++) {
        const double *c = wall_corner(walls, e, k, room);
        for (int d = 0; d < 3; d++) {
            lo[d] = k ? silt_min(lo[d], c[d]) : c[d];
            hi[d] = k ? silt_max(hi[d], c[d]) : c[d];
        }
    }
}

static void box_fit(const silt_walls *walls, int b) {
    wall_box *box = &walls->index->box[b];
    for (int d = 0; d < 3; d++) {
        box->lo[d] = HUGE_VAL;
        box->hi[d] = -HUGE_VAL;
    }
    for (int k = 0; k < (box->count ? box->count : 2); k++) {
        double lo[3], hi[3];
        if (box->count)
            element_box(walls, walls->index->item[box->first + k], lo, hi);
        else {
            memcpy(lo, walls->index->box[box->first + k].lo, sizeof lo);
            memcpy(hi, walls->index->box[box->first + k].hi, sizeof hi);
        }
        for (int d = 0; d < 3; d++) {
            box->lo[d] = silt_min(box->lo[d], lo[d]);
            box->hi[d] = silt_max(box->hi[d], hi[d]);
        }
    }
}

void wall_index_refit(silt_walls *walls, int tree) {
    const wall_tree *t = &walls->index->tree[tree];
    for (int b = t->root + t->n_box - 1; b >= t->root; b--)
        box_fit(walls, b);
}

// orders item[first .. first + count) so that the middle one stands where it would if they were sorted by key
static void item_split(int *item, const double *key, int first, int last, int middle) {
    while (first < last) {
        const double pivot = key[item[(first + last) / 2]];
        int i = first, j = last;
        while (i <= j) {
            while (key[item[i]] < pivot)
                i++;
            while (key[item[j]] > pivot)
                j--;
            if (i <= j) {
                const int t = item[i];
                item[i++] = item[j];
                item[j--] = t;
            }
        }
        if (middle <= j)
            last = j;
        else if (middle >= i)
            first = i;
        else
            return;
    }
}

static void box_split(silt_walls *walls, double (*centre)[3], double *key, int b) {
    struct silt_wall_index *index = walls->index;
    const int first = index->box[b].first, count = index->box[b].count;
    box_fit(walls, b);
    if (count <= LEAF_ITEMS)
        return;
    int longest = 0;
    double lo[3] = {HUGE_VAL, HUGE_VAL, HUGE_VAL}, hi[3] = {-HUGE_VAL, -HUGE_VAL, -HUGE_VAL};
    for (int k = first; k < first + count; k++)
        for (int d = 0; d < 3; d++) {
            lo[d] = silt_min(lo[d], centre[index->item[k]][d]);
            hi[d] = silt_max(hi[d], centre[index->item[k]][d]);
        }
    for (int d = 1; d < 3; d++)
        if (hi[d] - lo[d] > hi[longest] - lo[longest])
            longest = d;
    for (int k = first; k < first + count; k++)
        key[index->item[k]] = centre[index->item[k]][longest];
    item_split(index->item, key, first, first + count - 1, first + count / 2);
    const int child = index->n_box;
    index->n_box += 2;
    index->box[child] = (wall_box){.first = first, .count = count / 2};
    index->box[child + 1] = (wall_box){.first = first + count / 2, .count = count - count / 2};
    index->box[b].first = child;
    index->box[b].count = 0;
    box_split(walls, centre, key, child);
    box_split(walls, centre, key, child + 1);
}

void wall_index_create(silt_walls *walls, const int *component, const uint8_t *obstacle) {
    struct silt_wall_index *index = walls->index;
    const int n = walls->count;
    // a tree for all that stands still, one per obstacle, one per moving wall
    int *tree_of = silt_alloc((size_t)n + 1, sizeof *tree_of), *seat = silt_alloc((size_t)n + walls->n_wall + 2, sizeof *seat);
    int n_seat = 0, tree_capacity = 0;
    for (int e = 0; e < n; e++) {
        const int moving = index->step[walls->wall[e]].moves ? walls->wall[e] : -1;
        int *mine = obstacle[component[e]] ? &seat[walls->n_wall + 1 + component[e]] : &seat[moving + 1];
        if (!*mine) {
            SILT_RESERVE(index->tree, tree_capacity, n_seat + 1);
            index->tree[n_seat] = (wall_tree){.wall = moving, .obstacle = obstacle[component[e]]};
            *mine = ++n_seat;
        }
        tree_of[e] = *mine - 1;
    }
    index->n_tree = n_seat;
    index->item = silt_alloc((size_t)n + 1, sizeof *index->item);
    index->box = silt_alloc(2 * (size_t)n + (size_t)n_seat + 1, sizeof *index->box);
    double(*centre)[3] = silt_alloc((size_t)n + 1, sizeof *centre);
    double *key = silt_alloc((size_t)n + 1, sizeof *key);
    for (int e = 0; e < n; e++) {
        double lo[3], hi[3];
        element_box(walls, e, lo, hi);
        for (int d = 0; d < 3; d++)
            centre[e][d] = 0.5 * (lo[d] + hi[d]);
    }
    // items by tree, in their order
    int *start = silt_alloc((size_t)n_seat + 2, sizeof *start);
    for (int e = 0; e < n; e++)
        start[tree_of[e] + 1]++;
    for (int t = 0; t < n_seat; t++)
        start[t + 1] += start[t];
    int *fill = silt_alloc((size_t)n_seat + 1, sizeof *fill);
    for (int e = 0; e < n; e++)
        index->item[start[tree_of[e]] + fill[tree_of[e]]++] = e;
    for (int t = 0; t < n_seat; t++) {
        const int root = index->n_box++;
        index->box[root] = (wall_box){.first = start[t], .count = start[t + 1] - start[t]};
        box_split(walls, centre, key, root);
        index->tree[t].root = root;
        index->tree[t].n_box = index->n_box - root;
    }
    free(tree_of);
    free(seat);
    free(centre);
    free(key);
    free(start);
    free(fill);
}

void wall_query(const silt_walls *walls, int tree, const double lo[3], const double hi[3], int **list, int *n, int *capacity) {
    const struct silt_wall_index *index = walls->index;
    int stack[STACK_DEPTH], depth = 0;
    stack[depth++] = index->tree[tree].root;
    while (depth) {
        const wall_box *box = &index->box[stack[--depth]];
        if (box->lo[0] > hi[0] || box->hi[0] < lo[0] || box->lo[1] > hi[1] || box->hi[1] < lo[1] || box->lo[2] > hi[2] ||
            box->hi[2] < lo[2])
            continue;
        if (!box->count) {
            stack[depth++] = box->first + 1;
            stack[depth++] = box->first;
            continue;
        }
        SILT_RESERVE(*list, *capacity, *n + box->count);
        for (int k = 0; k < box->count; k++)
            (*list)[(*n)++] = index->item[box->first + k];
    }
}

// ---------------------------------------------------------------- distance

typedef struct wall_hit {
    double distance; // to the nearest element
    double front;    // how far the point is in front of that element's plane
    bool behind;
    int element;
} wall_hit;

static double box_distance2(const wall_box *box, const double x[3]) {
    double sum = 0;
    for (int d = 0; d < 3; d++)
        sum += silt_square(silt_max(silt_max(box->lo[d] - x[d], x[d] - box->hi[d]), 0));
    return sum;
}

// one more element: the nearer one counts; of two that are equally near and not joined there the one that has the point
// behind it (a plate that stands on a floor), else the one with the point farther in front
static void hit_element(const silt_walls *walls, int e, const double x[3], wall_hit *hit) {
    double on[3], n[3], to[3];
    int feature;
    const double square = wall_nearest(walls, e, x, on, &feature);
    if (square > silt_square(hit->distance * (1 + 1e-11) + 1e-11))
        return;
    const double distance = sqrt(square);
    const bool tie = fabs(distance - hit->distance) <= 1e-12 * (1 + distance);
    if (!tie && distance > hit->distance)
        return;
    feature_normal(walls, e, feature, n);
    for (int d = 0; d < 3; d++)
        to[d] = x[d] - on[d];
    const bool behind = wall_dot(to, n) < 0;
    const double front = fabs(wall_dot(to, walls->normal[e]));
    if (tie && (hit->behind != behind ? hit->behind : hit->front > front || (hit->front == front && hit->element < e)))
        return;
    *hit = (wall_hit){.distance = tie ? silt_min(distance, hit->distance) : distance, .front = front, .behind = behind, .element = e};
}

static void hit_tree(const silt_walls *walls, int tree, const double x[3], wall_hit *hit) {
    const struct silt_wall_index *index = walls->index;
    struct {
        int box;
        double square;
    } stack[STACK_DEPTH];
    int depth = 0;
    stack[depth].box = index->tree[tree].root;
    stack[depth++].square = box_distance2(&index->box[index->tree[tree].root], x);
    while (depth) {
        depth--;
        if (stack[depth].square > silt_square(hit->distance + 1e-12 * (1 + hit->distance)))
            continue;
        const wall_box *box = &index->box[stack[depth].box];
        if (box->count) {
            for (int k = 0; k < box->count; k++)
                hit_element(walls, index->item[box->first + k], x, hit);
            continue;
        }
        // the nearer child first
        const double square[2] = {box_distance2(&index->box[box->first], x), box_distance2(&index->box[box->first + 1], x)};
        const int far_one = square[0] <= square[1], first = box->first;
        stack[depth].box = first + far_one;
        stack[depth++].square = square[far_one];
        stack[depth].box = first + 1 - far_one;
        stack[depth++].square = square[1 - far_one];
    }
}

double silt_walls_distance(const silt_walls *walls, const double *point, int *element) {
    *element = -1;
    if (!walls->count)
        return HUGE_VAL;
    const double x[3] = {point[0], point[1], walls->dim == 3 ? point[2] : 0};
    const struct silt_wall_index *index = walls->index;
    wall_hit hit = {.distance = HUGE_VAL, .element = -1};
    for (int t = 0; t < index->n_tree; t++)
        hit_tree(walls, t, x, &hit);
    // in an obstacle that is sunk into another wall the other one may be nearer: inside stays inside
    for (int t = 0; t < index->n_tree && !hit.behind; t++) {
        const wall_box *box = &index->box[index->tree[t].root];
        if (!index->tree[t].obstacle || box_distance2(box, x) > 0)
            continue;
        wall_hit inside = {.distance = HUGE_VAL, .element = -1};
        hit_tree(walls, t, x, &inside);
        if (inside.behind)
            hit = inside;
    }
    *element = hit.element;
    return hit.behind ? -hit.distance : hit.distance;
}

// Takes out of a list what another wall covers at x: the foot of a gate or of a box stands on the floor, between the two there is
// no room for water, and a node in the crease before it must not go up with the foot.
static int leave_covered(const silt_walls *walls, const double x[3], double reach, int *list, int n) {
    int kept = 0;
    for (int k = 0; k < n; k++) {
        const int e = list[k];
        double at[3];
        int feature, other;
        bool covered = false;
        if (wall_nearest(walls, e, x, at, &feature) <= reach * reach && feature != 0)
            for (int m = 0; m < n && !covered; m++) {
                const int f = list[m];
                covered = walls->index->piece[e] != walls->index->piece[f] &&
                          wall_dot(walls->normal[e], walls->normal[f]) < -1 + 1e-6 &&
                          wall_nearest(walls, f, x, at, &other) <= reach * reach;
            }
        if (!covered)
            list[kept++] = e;
    }
    return kept;
}

int silt_walls_touching(const silt_walls *walls, const double *point, double reach, int element[3], double on[3]) {
    const int dim = wall_dim(walls);
    const double x[3] = {point[0], point[1], dim == 3 ? point[2] : 0};
    double lo[3], hi[3];
    for (int d = 0; d < 3; d++) {
        lo[d] = x[d] - reach;
        hi[d] = x[d] + reach;
    }
    memcpy(on, x, sizeof x);
    element[0] = element[1] = element[2] = -1;
    int *list = NULL, n = 0, capacity = 0, found = 0;
    for (int t = 0; walls->count && t < walls->index->n_tree; t++)
        wall_query(walls, t, lo, hi, &list, &n, &capacity);
    n = leave_covered(walls, x, reach, list, n);
    while (found < dim) {
        // the nearest element that turns away from those found, with a point that lies on all of them
        int best = -1;
        double nearest = reach * (1 + 1e-12), best_on[3] = {0};
        for (int k = 0; k < n; k++) {
            const int e = list[k];
            double at[3];
            int feature;
            const double distance = sqrt(wall_nearest(walls, e, x, at, &feature));
            if (distance > nearest || (distance == nearest && best >= 0 && best < e))
                continue;
            bool fits = true;
            const double *normal[3] = {NULL};
            double value[3], shift[3], room[3];
            for (int m = 0; m < found && fits; m++) {
                fits = wall_dot(walls->normal[e], walls->normal[element[m]]) < WALL_BEND;
                normal[m] = walls->normal[element[m]];
                value[m] = wall_dot(normal[m], wall_corner(walls, element[m], 0, room)) - wall_dot(normal[m], x);
            }
            if (!fits)
                continue;
            if (found) {
                normal[found] = walls->normal[e];
                value[found] = wall_dot(normal[found], wall_corner(walls, e, 0, room)) - wall_dot(normal[found], x);
                if (!wall_solve(found + 1, normal, value, shift) || wall_dot(shift, shift) > 4 * reach * reach)
                    continue;
                for (int d = 0; d < 3; d++)
                    shift[d] += x[d];
                fits = wall_nearest(walls, e, shift, at, &feature) <= 1e-6 * reach * reach;
                memcpy(at, shift, sizeof at);
            }
            if (!fits)
                continue;
            best = e;
            nearest = distance;
            memcpy(best_on, at, sizeof best_on);
        }
        if (best < 0)
            break;
        element[found++] = best;
        memcpy(on, best_on, sizeof best_on);
    }
    free(list);
    return found;
}

// ---------------------------------------------------------------- edges that point into the water

typedef struct ridge {
    int vertex, element[3];
    int ends;        // edges that meet here
    double along[3]; // of the first of them
    bool sharp;      // ends or turns here
} ridge;

typedef struct ridge_list {
    int count, point_capacity, element_capacity;
    double *point;
    int (*element)[3];
    double h;
    int *head, *next, next_capacity; // points by place
} ridge_list;

enum { RIDGE_BINS = 1 << 14 };

static int *ridge_bin(const ridge_list *list, const double x[3], int dx, int dy, int dz) {
    const int64_t key[3] = {(int64_t)floor(x[0] / list->h) + dx, (int64_t)floor(x[1] / list->h) + dy, (int64_t)floor(x[2] / list->h) + dz};
    return &list->head[silt_hash(0, key, sizeof key) & (RIDGE_BINS - 1)];
}

// adds a point unless one is closer than gap, or the edge lies on another wall there
static void ridge_add(const silt_walls *walls, ridge_list *list, const double x[3], const int element[3], double gap) {
    for (int c = 0; c < 27; c++)
        for (int k = *ridge_bin(list, x, c % 3 - 1, c / 3 % 3 - 1, c / 9 - 1) - 1; k >= 0; k = list->next[k] - 1) {
            double sum = 0;
            for (int d = 0; d < 3; d++)
                sum += silt_square(list->point[3 * k + d] - x[d]);
            if (sum < gap * gap)
                return;
        }
    const double near = 1e-3 * list->h;
    double lo[3], hi[3];
    for (int d = 0; d < 3; d++) {
        lo[d] = x[d] - near;
        hi[d] = x[d] + near;
    }
    int *near_by = NULL, n = 0, capacity = 0;
    for (int t = 0; t < walls->index->n_tree; t++)
        wall_query(walls, t, lo, hi, &near_by, &n, &capacity);
    bool sealed = false;
    for (int k = 0; k < n && !sealed; k++) {
        double on[3];
        int feature;
        if (wall_nearest(walls, near_by[k], x, on, &feature) > near * near)
            continue;
        // elements of the ridge's own surface meet there at a corner or an edge; others have it in their inside or are not joined
        bool own = false;
        for (int a = 0; a < 3 && !own; a++)
            own = element[a] >= 0 && walls->index->piece[near_by[k]] == walls->index->piece[element[a]];
        sealed = !own;
    }
    free(near_by);
    if (sealed)
        return;
    SILT_RESERVE(list->point, list->point_capacity, 3 * list->count + 3);
    SILT_RESERVE(list->element, list->element_capacity, list->count + 1);
    SILT_RESERVE(list->next, list->next_capacity, list->count + 1);
    memcpy(list->point + 3 * list->count, x, 3 * sizeof *x);
    memcpy(list->element[list->count], element, 3 * sizeof *element);
    int *bin = ridge_bin(list, x, 0, 0, 0);
    list->next[list->count] = *bin;
    *bin = ++list->count;
}

// the element beyond edge k of e when they form a sharp edge that points into the water and e is the first of the two, else -1
static int ridge_other(const silt_walls *walls, int e, int k) {
    const int f = wall_joined(walls, e, k);
    return f > e && wall_dot(walls->normal[e], walls->normal[f]) < WALL_BEND && wall_rise(walls, e, k, f) < 0 ? f : -1;
}

// vertices of the ridges: where they end, fork or turn is sharp
static ridge *ridge_vertices(const silt_walls *walls) {
    const struct silt_wall_index *index = walls->index;
    ridge *at = silt_alloc((size_t)index->n_vertex + 1, sizeof *at);
    for (int e = 0; e < walls->count; e++)
        for (int k = 0; k < 3; k++) {
            const int f = ridge_other(walls, e, k);
            for (int end = 0; end < 2 && f >= 0; end++) {
                ridge *r = &at[index->vertex[e][(k + end) % 3]];
                double along[3], length;
                for (int d = 0; d < 3; d++)
                    along[d] = (end ? -1 : 1) * (walls->corner[e][(k + 1) % 3][d] - walls->corner[e][k][d]);
                length = sqrt(wall_dot(along, along));
                if (r->ends == 0) {
                    r->element[0] = e;
                    r->element[1] = f;
                    r->element[2] = -1;
                    for (int d = 0; d < 3; d++)
                        r->along[d] = along[d] / length;
                } else if (r->ends == 1)
                    r->sharp = wall_dot(r->along, along) > -WALL_BEND * length;
                if (r->ends && r->element[2] < 0 && e != r->element[0] && e != r->element[1])
                    r->element[2] = e;
                r->ends++;
            }
        }
    for (int v = 0; v < index->n_vertex; v++)
        at[v].sharp |= at[v].ends != 2;
    return at;
}

int silt_walls_ridges(const silt_walls *walls, double h, double **point, int (**element)[3]) {
    ridge_list list = {.h = h};
    *point = NULL;
    *element = NULL;
    if (!walls->count)
        return 0;
    list.head = silt_alloc(RIDGE_BINS, sizeof *list.head);
    if (walls->dim != 3) {
        for (int e = 0; e < walls->count; e++) {
            const int f = walls->next[e], pair[3] = {e, f, -1};
            double room[3];
            if (f >= 0 && wall_dot(walls->normal[e], walls->normal[f]) < WALL_BEND && wall_rise(walls, e, 1, f) < 0)
                ridge_add(walls, &list, wall_corner(walls, e, 1, room), pair, 1e-6 * h);
        }
    } else {
        ridge *at = ridge_vertices(walls);
        // corners first, then along the edges, at spacing h; short edges give a point now and then
        for (int pass = 0; pass < 2; pass++)
            for (int e = 0; e < walls->count; e++)
                for (int k = 0; k < 3; k++) {
                    const int f = ridge_other(walls, e, k), pair[3] = {e, f, -1};
                    if (f < 0)
                        continue;
                    const double *a = walls->corner[e][k], *b = walls->corner[e][(k + 1) % 3];
                    double length = 0;
                    for (int d = 0; d < 3; d++)
                        length += silt_square(b[d] - a[d]);
                    const int pieces = (int)silt_max(1, floor(sqrt(length) / h + 0.5));
                    for (int m = 0; m <= pieces; m++) {
                        const ridge *vertex = m == 0 ? &at[walls->index->vertex[e][k]] : m == pieces ? &at[walls->index->vertex[e][(k + 1) % 3]] : NULL;
                        double x[3];
                        if (pass == 0 && !(vertex && vertex->sharp))
                            continue;
                        for (int d = 0; d < 3; d++)
                            x[d] = a[d] + (b[d] - a[d]) * m / pieces;
                        ridge_add(walls, &list, x, vertex ? vertex->element : pair, pass == 0 ? 1e-6 * h : 0.7 * h);
                    }
                }
        free(at);
    }
    free(list.head);
    free(list.next);
    *point = list.point;
    *element = list.element;
    return list.count;
}
