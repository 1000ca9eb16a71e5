// solid_mesh.c: a closed surface with triangles of another size: edges are split, contracted and turned, points moved along the
// surface, in turn (Botsch and Kobbelt 2004), with the bends kept
#include "solid.h"

#include "wall.h"

#define MESH_LONG 1.33  // times the target: longer edges are split
#define MESH_SHORT 0.75 // shorter ones are contracted
#define MESH_TARGET 0.92
static const double mesh_bend = 0.93969262078590842; // cosine of 20 degrees
static const double mesh_turn = 0.4;                 // least cosine between a face before and after an edit
enum { MESH_ROUNDS = 6, MESH_PASSES = 60 };

typedef enum { POINT_SMOOTH = 0, POINT_LINE, POINT_CORNER } point_kind;

typedef struct shell_edge {
    double length;
    int a, b, face[2]; // a < b
} shell_edge;

/** the surface at work; faces that died have face[0] = -1 */
typedef struct shell {
    const silt_solid *fine;
    int *fine_patch;   // owned, per face of fine
    uint8_t *round;    // owned, per patch: 1 where it is not plane
    int *first;        // owned, per patch: one of its faces, whose normal is that of a plane patch
    uint8_t *wanted;   // owned, scratch, per face of fine
    int wanted_patch;
    int n_line;
    int (*line)[4];    // owned, edges of fine between patches: points, then patches, the lower first
    double size;       // m, target
    int n_point, point_capacity, kind_capacity;
    double (*x)[3];    // owned
    uint8_t *kind;     // owned
    int n_face, face_capacity, patch_capacity;
    int (*face)[3];    // owned
    int *patch;        // owned, per face
    int *start, *ring; // owned, faces of each point
    int n_edge;
    shell_edge *edge;  // owned
    uint8_t *locked;   // owned, per point
} shell;

// ---------------------------------------------------------------- patches of the given surface

static void shell_patches(shell *s) {
    const silt_solid *fine = s->fine;
    int n_patch = 0, *stack = silt_alloc((size_t)fine->n_face + 1, sizeof *stack);
    s->fine_patch = silt_alloc((size_t)fine->n_face + 1, sizeof *s->fine_patch);
    for (int f = 0; f < fine->n_face; f++)
        s->fine_patch[f] = -1;
    for (int f = 0; f < fine->n_face; f++) {
        if (s->fine_patch[f] >= 0)
            continue;
        int top = 0;
        stack[top++] = f;
        s->fine_patch[f] = n_patch;
        while (top) {
            const int g = stack[--top];
            for (int k = 0; k < 3; k++) {
                const int other = fine->beside[g][k];
                if (s->fine_patch[other] < 0 && wall_dot(fine->normal[g], fine->normal[other]) > mesh_bend) {
                    s->fine_patch[other] = n_patch;
                    stack[top++] = other;
                }
            }
        }
        n_patch++;
    }
    free(stack);
    s->round = silt_alloc((size_t)n_patch + 1, 1);
    s->first = silt_alloc((size_t)n_patch + 1, sizeof *s->first);
    for (int f = fine->n_face - 1; f >= 0; f--)
        s->first[s->fine_patch[f]] = f;
    s->line = silt_alloc(3 * (size_t)fine->n_face + 1, sizeof *s->line);
    for (int f = 0; f < fine->n_face; f++)
        for (int k = 0; k < 3; k++) {
            const int g = fine->beside[f][k], p = s->fine_patch[f], q = s->fine_patch[g];
            if (p == q && wall_dot(fine->normal[f], fine->normal[g]) < 1 - 1e-10)
                s->round[p] = 1;
            if (p < q)
                memcpy(s->line[s->n_line++], (int[4]){fine->face[f][k], fine->face[f][(k + 1) % 3], p, q}, sizeof *s->line);
        }
}

// points where bends meet, end or turn, and tips
static void shell_kinds(shell *s) {
    const silt_solid *fine = s->fine;
    int(*end)[2] = silt_alloc((size_t)fine->n_point + 1, sizeof *end), *count = silt_alloc((size_t)fine->n_point + 1, sizeof *count);
    for (int l = 0; l < s->n_line; l++)
        for (int k = 0; k < 2; k++) {
            const int i = s->line[l][k];
            if (count[i] < 2)
                end[i][count[i]] = s->line[l][1 - k];
            count[i]++;
        }
    for (int i = 0; i < fine->n_point; i++) {
        s->kind[i] = count[i] == 0 ? POINT_SMOOTH : count[i] == 2 ? POINT_LINE : POINT_CORNER;
        if (count[i] != 2)
            continue;
        double u[3], v[3];
        for (int d = 0; d < 3; d++) {
            u[d] = s->x[i][d] - s->x[end[i][0]][d];
            v[d] = s->x[end[i][1]][d] - s->x[i][d];
        }
        if (wall_dot(u, v) < mesh_bend * silt_length(3, u) * silt_length(3, v))
            s->kind[i] = POINT_CORNER;
    }
    for (int f = 0; f < fine->n_face; f++)
        for (int k = 0; k < 3; k++) {
            const int i = fine->face[f][k];
            const double *n = fine->corner[i];
            if (s->kind[i] == POINT_SMOOTH && wall_dot(n, fine->normal[f]) < 0.8 * silt_length(3, n))
                s->kind[i] = POINT_CORNER;
        }
    free(end);
    free(count);
}

// ---------------------------------------------------------------- adjacency

static int compare_lengths(const void *a, const void *b) {
    const shell_edge *p = a, *q = b;
    return p->length != q->length ? (p->length < q->length ? -1 : 1) : p->a != q->a ? (p->a < q->a ? -1 : 1) : p->b - q->b;
}

static double shell_apart(const shell *s, int a, int b) {
    const double d[3] = {s->x[b][0] - s->x[a][0], s->x[b][1] - s->x[a][1], s->x[b][2] - s->x[a][2]};
    return silt_length(3, d);
}

static bool shell_has(const int *face, int i) { return face[0] == i || face[1] == i || face[2] == i; }

// drops dead faces; faces of each point, edges that are below `below` or above `above` long, no locks
static void shell_index(shell *s, double below, double above) {
    int kept = 0;
    for (int f = 0; f < s->n_face; f++)
        if (s->face[f][0] >= 0) {
            memmove(s->face[kept], s->face[f], sizeof *s->face);
            s->patch[kept++] = s->patch[f];
        }
    s->n_face = kept;
    free(s->start);
    free(s->ring);
    free(s->edge);
    free(s->locked);
    s->start = silt_alloc((size_t)s->n_point + 2, sizeof *s->start);
    s->ring = silt_alloc(3 * (size_t)s->n_face + 1, sizeof *s->ring);
    s->edge = silt_alloc(3 * (size_t)s->n_face / 2 + 1, sizeof *s->edge);
    s->locked = silt_alloc((size_t)s->n_point + 1, 1);
    for (int f = 0; f < s->n_face; f++)
        for (int k = 0; k < 3; k++)
            s->start[s->face[f][k] + 1]++;
    for (int i = 0; i < s->n_point; i++)
        s->start[i + 1] += s->start[i];
    int *at = silt_alloc((size_t)s->n_point + 1, sizeof *at);
    for (int f = 0; f < s->n_face; f++)
        for (int k = 0; k < 3; k++)
            s->ring[s->start[s->face[f][k]] + at[s->face[f][k]]++] = f;
    free(at);
    s->n_edge = 0;
    for (int f = 0; f < s->n_face; f++)
        for (int k = 0; k < 3; k++) {
            const int i = s->face[f][k], j = s->face[f][(k + 1) % 3];
            const double length = i < j ? shell_apart(s, i, j) : 0;
            if (i > j || (length >= below && length <= above))
                continue;
            int other = -1;
            for (int m = s->start[i]; m < s->start[i + 1]; m++)
                if (s->ring[m] != f && shell_has(s->face[s->ring[m]], j))
                    other = s->ring[m];
            s->edge[s->n_edge++] = (shell_edge){length, i, j, {f, other}};
        }
}

static void shell_sort(shell *s) { qsort(s->edge, (size_t)s->n_edge, sizeof *s->edge, compare_lengths); }

static int shell_third(const int *face, int a, int b) {
    for (int k = 0; k < 3; k++)
        if (face[k] != a && face[k] != b)
            return face[k];
    return -1;
}

// true when the face runs from a to b
static bool shell_forward(const int *face, int a, int b) {
    return (face[0] == a && face[1] == b) || (face[1] == a && face[2] == b) || (face[2] == a && face[0] == b);
}

static void face_normal(const double *a, const double *b, const double *c, double n[3]) {
    const double u[3] = {b[0] - a[0], b[1] - a[1], b[2] - a[2]}, v[3] = {c[0] - a[0], c[1] - a[1], c[2] - a[2]};
    silt_cross(u, v, n);
}

// the normal that faces of a plane patch keep, else NULL: a face that has shrunk to nothing has none of its own to keep it from folding over
static const double *shell_plane(const shell *s, int patch) { return s->round[patch] ? NULL : s->fine->normal[s->first[patch]]; }

// the cosine between a face's normal and what it is with point i at `to`; -1 where it would have no area
static double shell_turned(const shell *s, int f, int i, const double *to) {
    double before[3], after[3];
    const int *face = s->face[f];
    const double *plane = shell_plane(s, s->patch[f]), *c[3] = {s->x[face[0]], s->x[face[1]], s->x[face[2]]};
    face_normal(c[0], c[1], c[2], before);
    for (int k = 0; k < 3; k++)
        c[k] = face[k] == i ? to : c[k];
    face_normal(c[0], c[1], c[2], after);
    const double p = silt_length(3, before), q = silt_length(3, after);
    if (plane && !(wall_dot(plane, after) > 0))
        return -1;
    return q < 1e-3 * silt_square(s->size) && q < 0.5 * p ? -1 : p > 1e-6 * silt_square(s->size) ? wall_dot(before, after) / (p * q) : 1;
}

// ---------------------------------------------------------------- onto the given surface

// the patches of a face's edge a-b, the lower first
static void edge_patches(const shell *s, const shell_edge *e, int pair[2]) {
    const int p = s->patch[e->face[0]], q = s->patch[e->face[1]];
    pair[0] = p < q ? p : q;
    pair[1] = p < q ? q : p;
}

static void onto_line(const shell *s, const int pair[2], double *x) {
    double best = HUGE_VAL, on[3] = {x[0], x[1], x[2]};
    for (int l = 0; l < s->n_line; l++) {
        if (s->line[l][2] != pair[0] || s->line[l][3] != pair[1])
            continue;
        const double *a = s->fine->point[s->line[l][0]], *b = s->fine->point[s->line[l][1]];
        const double e[3] = {b[0] - a[0], b[1] - a[1], b[2] - a[2]}, d[3] = {x[0] - a[0], x[1] - a[1], x[2] - a[2]};
        const double t = silt_clamp(wall_dot(e, d) / wall_dot(e, e), 0, 1);
        double square = 0;
        for (int k = 0; k < 3; k++)
            square += silt_square(a[k] + t * e[k] - x[k]);
        if (square < best) {
            best = square;
            for (int k = 0; k < 3; k++)
                on[k] = a[k] + t * e[k];
        }
    }
    memcpy(x, on, sizeof on);
}

static void onto_patch(shell *s, int patch, double *x) {
    if (!s->round[patch])
        return;
    if (s->wanted_patch != patch) {
        for (int f = 0; f < s->fine->n_face; f++)
            s->wanted[f] = s->fine_patch[f] == patch;
        s->wanted_patch = patch;
    }
    double on[3];
    if (silt_solid_nearest(s->fine, x, 2 * s->size, s->wanted, on, NULL) < HUGE_VAL)
        memcpy(x, on, sizeof on);
}

// ---------------------------------------------------------------- edits

static int shell_add_point(shell *s, const double *x, point_kind kind) {
    SILT_RESERVE(s->x, s->point_capacity, s->n_point + 1);
    SILT_RESERVE(s->kind, s->kind_capacity, s->n_point + 1);
    memcpy(s->x[s->n_point], x, sizeof *s->x);
    s->kind[s->n_point] = (uint8_t)kind;
    return s->n_point++;
}

static void shell_add_face(shell *s, int a, int b, int c, int patch) {
    SILT_RESERVE(s->face, s->face_capacity, s->n_face + 1);
    SILT_RESERVE(s->patch, s->patch_capacity, s->n_face + 1);
    memcpy(s->face[s->n_face], (int[3]){a, b, c}, sizeof *s->face);
    s->patch[s->n_face++] = patch;
}

static int shell_split(shell *s) {
    int n = 0;
    shell_index(s, 0, MESH_LONG * s->size);
    shell_sort(s);
    for (int k = s->n_edge - 1; k >= 0; k--) {
        const shell_edge e = s->edge[k];
        const int c = shell_third(s->face[e.face[0]], e.a, e.b), d = shell_third(s->face[e.face[1]], e.a, e.b);
        if (s->locked[e.a] || s->locked[e.b] || s->locked[c] || s->locked[d])
            continue;
        s->locked[e.a] = s->locked[e.b] = s->locked[c] = s->locked[d] = 1;
        double x[3];
        int pair[2];
        for (int q = 0; q < 3; q++)
            x[q] = 0.5 * (s->x[e.a][q] + s->x[e.b][q]);
        edge_patches(s, &e, pair);
        const bool line = pair[0] != pair[1];
        if (line)
            onto_line(s, pair, x);
        else
            onto_patch(s, pair[0], x);
        const int m = shell_add_point(s, x, line ? POINT_LINE : POINT_SMOOTH);
        for (int side = 0; side < 2; side++) {
            const int f = e.face[side];
            int fresh[3];
            memcpy(fresh, s->face[f], sizeof fresh);
            for (int q = 0; q < 3; q++) {
                fresh[q] = fresh[q] == e.a ? m : fresh[q];
                s->face[f][q] = s->face[f][q] == e.b ? m : s->face[f][q];
            }
            shell_add_face(s, fresh[0], fresh[1], fresh[2], s->patch[f]);
        }
        n++;
    }
    return n;
}

// points that both a and b have an edge to
static int shell_common(const shell *s, int a, int b) {
    int n = 0, seen[128];
    for (int k = s->start[a]; k < s->start[a + 1]; k++)
        for (int c = 0; c < 3; c++) {
            const int i = s->face[s->ring[k]][c];
            bool known = i == a || i == b;
            for (int m = 0; m < n && m < 128; m++)
                known |= seen[m] == i;
            bool at_b = false;
            for (int m = s->start[b]; m < s->start[b + 1] && !known && !at_b; m++)
                at_b = shell_has(s->face[s->ring[m]], i);
            if (at_b && n < 128)
                seen[n++] = i;
        }
    return n;
}

static bool shell_ring_locked(const shell *s, int i) {
    for (int k = s->start[i]; k < s->start[i + 1]; k++) {
        const int *face = s->face[s->ring[k]];
        if (face[0] < 0) // died in this pass: its corners were locked then
            return true;
        for (int c = 0; c < 3; c++)
            if (s->locked[face[c]])
                return true;
    }
    return false;
}

static void shell_ring_lock(shell *s, int i) {
    for (int k = s->start[i]; k < s->start[i + 1]; k++)
        for (int c = 0; c < 3; c++)
            s->locked[s->face[s->ring[k]][c]] = 1;
}

// true when the faces around i, but for those at `other`, stay sound and short with i at x
static bool shell_bears(const shell *s, int i, int other, const double *x) {
    for (int k = s->start[i]; k < s->start[i + 1]; k++) {
        const int *face = s->face[s->ring[k]];
        if (other >= 0 && shell_has(face, other))
            continue;
        if (!(shell_turned(s, s->ring[k], i, x) >= mesh_turn))
            return false;
        for (int c = 0; c < 3 && other >= 0; c++) {
            const double d[3] = {s->x[face[c]][0] - x[0], s->x[face[c]][1] - x[1], s->x[face[c]][2] - x[2]};
            if (face[c] != i && silt_length(3, d) > MESH_LONG * s->size)
                return false;
        }
    }
    return true;
}

static int shell_contract(shell *s) {
    int n = 0;
    shell_index(s, MESH_SHORT * s->size, HUGE_VAL);
    shell_sort(s);
    for (int k = 0; k < s->n_edge; k++) {
        const shell_edge e = s->edge[k];
        int pair[2], goes = e.a, stays = e.b;
        edge_patches(s, &e, pair);
        const bool line = pair[0] != pair[1];
        if (s->kind[goes] > s->kind[stays] || (s->kind[goes] == s->kind[stays] && goes < stays)) {
            goes = e.b;
            stays = e.a;
        }
        if (s->kind[goes] == POINT_CORNER || (s->kind[goes] == POINT_LINE && !line))
            continue;
        if (shell_ring_locked(s, goes) || shell_ring_locked(s, stays) || shell_common(s, goes, stays) != 2)
            continue;
        // where both may move, to the middle, or to one of the two
        bool bears = false;
        double x[3];
        for (int way = s->kind[goes] == s->kind[stays] ? 0 : 1; way < (s->kind[goes] == s->kind[stays] ? 3 : 2) && !bears; way++) {
            for (int d = 0; d < 3; d++)
                x[d] = way == 0 ? 0.5 * (s->x[goes][d] + s->x[stays][d]) : s->x[way == 1 ? stays : goes][d];
            if (way == 0 && line)
                onto_line(s, pair, x);
            else if (way == 0)
                onto_patch(s, pair[0], x);
            bears = shell_bears(s, goes, stays, x) && shell_bears(s, stays, goes, x);
        }
        if (!bears)
            continue;
        shell_ring_lock(s, goes);
        shell_ring_lock(s, stays);
        memcpy(s->x[stays], x, sizeof x);
        for (int m = s->start[goes]; m < s->start[goes + 1]; m++) {
            int *face = s->face[s->ring[m]];
            if (shell_has(face, stays))
                face[0] = -1;
            else
                for (int c = 0; c < 3; c++)
                    face[c] = face[c] == goes ? stays : face[c];
        }
        n++;
    }
    return n;
}

static double shell_angle(const shell *s, int at, int a, int b) {
    double u[3], v[3], n[3];
    for (int d = 0; d < 3; d++) {
        u[d] = s->x[a][d] - s->x[at][d];
        v[d] = s->x[b][d] - s->x[at][d];
    }
    silt_cross(u, v, n);
    return atan2(silt_length(3, n), wall_dot(u, v));
}

static int shell_turn(shell *s) {
    int n = 0;
    shell_index(s, HUGE_VAL, 0);
    for (int k = s->n_edge - 1; k >= 0; k--) {
        const shell_edge e = s->edge[k];
        int *f = s->face[e.face[0]], *g = s->face[e.face[1]];
        if (s->patch[e.face[0]] != s->patch[e.face[1]])
            continue;
        const bool forward = shell_forward(f, e.a, e.b);
        const int a = forward ? e.a : e.b, b = forward ? e.b : e.a, c = shell_third(f, a, b), d = shell_third(g, a, b);
        if (s->locked[a] || s->locked[b] || s->locked[c] || s->locked[d] || shell_angle(s, c, a, b) + shell_angle(s, d, a, b) < M_PI + 1e-6)
            continue;
        bool there = false;
        for (int m = s->start[c]; m < s->start[c + 1]; m++)
            there |= shell_has(s->face[s->ring[m]], d);
        // f is a b c, g is b a d; they become d b c and d c a
        double before[2][3], after[2][3];
        face_normal(s->x[a], s->x[b], s->x[c], before[0]);
        face_normal(s->x[b], s->x[a], s->x[d], before[1]);
        face_normal(s->x[d], s->x[b], s->x[c], after[0]);
        face_normal(s->x[d], s->x[c], s->x[a], after[1]);
        const double *plane = shell_plane(s, s->patch[e.face[0]]);
        bool sound = !there && (!plane || (wall_dot(plane, after[0]) > 0 && wall_dot(plane, after[1]) > 0));
        for (int p = 0; p < 2; p++)
            for (int q = 0; q < 2; q++)
                sound &= wall_dot(before[p], after[q]) >= 0 && silt_length(3, after[q]) > 1e-6 * silt_square(s->size);
        if (!sound || wall_dot(after[0], after[1]) < mesh_turn * silt_length(3, after[0]) * silt_length(3, after[1]))
            continue;
        memcpy(f, (int[3]){d, b, c}, sizeof *s->face);
        memcpy(g, (int[3]){d, c, a}, sizeof *s->face);
        s->locked[a] = s->locked[b] = s->locked[c] = s->locked[d] = 1;
        n++;
    }
    return n;
}

// points to the middle of their neighbours, along the surface
static void shell_smooth(shell *s) {
    shell_index(s, HUGE_VAL, 0);
    int(*pair)[2] = silt_alloc((size_t)s->n_point + 1, sizeof *pair), *ends = silt_alloc((size_t)s->n_point + 1, sizeof *ends);
    double(*sum)[3] = silt_alloc((size_t)s->n_point + 1, sizeof *sum);
    for (int k = 0; k < s->n_edge; k++) {
        int own[2];
        edge_patches(s, &s->edge[k], own);
        for (int end = 0; end < 2 && own[0] != own[1]; end++) {
            const int i = end ? s->edge[k].b : s->edge[k].a, j = end ? s->edge[k].a : s->edge[k].b;
            ends[i]++;
            memcpy(pair[i], own, sizeof own);
            for (int d = 0; d < 3; d++)
                sum[i][d] += s->x[j][d];
        }
    }
    for (int i = 0; i < s->n_point; i++) {
        const int n = s->start[i + 1] - s->start[i];
        if (n == 0 || s->kind[i] == POINT_CORNER || (s->kind[i] == POINT_LINE && ends[i] != 2))
            continue;
        double x[3] = {0}, normal[3] = {0};
        for (int k = s->start[i]; k < s->start[i + 1]; k++) {
            const int *face = s->face[s->ring[k]];
            double own[3];
            face_normal(s->x[face[0]], s->x[face[1]], s->x[face[2]], own);
            for (int d = 0; d < 3; d++) {
                normal[d] += own[d];
                for (int c = 0; c < 3; c++)
                    x[d] += face[c] == i ? 0 : s->x[face[c]][d] / (2 * n);
            }
        }
        const double length = silt_length(3, normal);
        double off = 0;
        if (!(length > 0))
            continue;
        for (int d = 0; d < 3; d++) {
            if (s->kind[i] == POINT_LINE)
                x[d] = 0.5 * sum[i][d];
            off += (x[d] - s->x[i][d]) * normal[d] / length;
        }
        for (int d = 0; d < 3; d++)
            x[d] = s->kind[i] == POINT_LINE ? x[d] : x[d] - off * normal[d] / length;
        if (s->kind[i] == POINT_LINE)
            onto_line(s, pair[i], x);
        else
            onto_patch(s, s->patch[s->ring[s->start[i]]], x);
        if (shell_bears(s, i, -1, x))
            memcpy(s->x[i], x, sizeof x);
    }
    free(pair);
    free(ends);
    free(sum);
}

// ---------------------------------------------------------------- the volume

// Directions in which points may go so that what is plane stays so: out of each round part by the same way.
static void shell_outwards(const shell *s, double (*way)[3]) {
    for (int i = 0; i < s->n_point; i++) {
        int n = 0, own[3];
        double normal[3][3] = {{0}}, value[3];
        bool many = false;
        for (int k = s->start[i]; k < s->start[i + 1]; k++) {
            const int f = s->ring[k], *face = s->face[f];
            double of[3];
            int slot = 0;
            face_normal(s->x[face[0]], s->x[face[1]], s->x[face[2]], of);
            const double length = silt_max(silt_length(3, of), 1e-300);
            while (slot < n && own[slot] != s->patch[f])
                slot++;
            if (slot == 3) {
                many = true;
                break;
            }
            if (slot == n)
                own[n++] = s->patch[f];
            for (int d = 0; d < 3; d++)
                normal[slot][d] += of[d] / length;
        }
        bool round = false;
        const double *pointer[3];
        for (int slot = 0; slot < n; slot++) {
            const double length = silt_length(3, normal[slot]);
            bool bent = false;
            for (int d = 0; d < 3; d++)
                normal[slot][d] /= length;
            for (int k = s->start[i]; k < s->start[i + 1] && s->round[own[slot]]; k++) {
                const int *face = s->face[s->ring[k]];
                double of[3];
                face_normal(s->x[face[0]], s->x[face[1]], s->x[face[2]], of);
                bent |= s->patch[s->ring[k]] == own[slot] && wall_dot(of, normal[slot]) < (1 - 1e-9) * silt_length(3, of);
            }
            value[slot] = bent;
            round |= bent;
            pointer[slot] = normal[slot];
        }
        memset(way[i], 0, sizeof way[i]);
        if (round && !many && !wall_solve(n, pointer, value, way[i]))
            memset(way[i], 0, sizeof way[i]);
    }
}

static double shell_volume(const shell *s, const double (*way)[3], double t) {
    double volume = 0;
    for (int f = 0; f < s->n_face; f++) {
        double c[3][3], n[3];
        for (int k = 0; k < 3; k++)
            for (int d = 0; d < 3; d++)
                c[k][d] = s->x[s->face[f][k]][d] - s->fine->centroid[d] + t * way[s->face[f][k]][d];
        silt_cross(c[1], c[2], n);
        volume += wall_dot(c[0], n) / 6;
    }
    return volume;
}

static void shell_fill(shell *s) {
    double(*way)[3] = silt_alloc((size_t)s->n_point + 1, sizeof *way);
    shell_index(s, HUGE_VAL, 0);
    shell_outwards(s, way);
    double t = 0, step = 1e-3 * s->size;
    for (int k = 0; k < 20; k++) {
        const double off = shell_volume(s, (const double(*)[3])way, t) - s->fine->volume;
        const double slope = (shell_volume(s, (const double(*)[3])way, t + step) - shell_volume(s, (const double(*)[3])way, t - step)) / (2 * step);
        if (!(slope > 0) || fabs(off) < 1e-15 * s->fine->volume)
            break;
        t -= off / slope;
    }
    for (int i = 0; i < s->n_point && fabs(t) < 0.5 * s->size; i++)
        for (int d = 0; d < 3; d++)
            s->x[i][d] += t * way[i][d];
    free(way);
}

// ---------------------------------------------------------------- all of it

static void shell_start(shell *s, const silt_solid *fine) {
    for (int i = 0; i < fine->n_point; i++)
        shell_add_point(s, fine->point[i], POINT_SMOOTH);
    for (int f = 0; f < fine->n_face; f++)
        shell_add_face(s, fine->face[f][0], fine->face[f][1], fine->face[f][2], s->fine_patch[f]);
    shell_kinds(s);
}

// points that have faces, in their order
static void shell_hand_over(const shell *s, silt_solid *mesh) {
    int *number = silt_alloc((size_t)s->n_point + 1, sizeof *number);
    *mesh = (silt_solid){.n_face = s->n_face};
    mesh->point = silt_alloc((size_t)s->n_point + 1, sizeof *mesh->point);
    mesh->face = silt_alloc((size_t)s->n_face + 1, sizeof *mesh->face);
    for (int i = 0; i < s->n_point; i++) {
        number[i] = s->start[i + 1] > s->start[i] ? mesh->n_point : -1;
        if (number[i] >= 0)
            memcpy(mesh->point[mesh->n_point++], s->x[i], sizeof *s->x);
    }
    for (int f = 0; f < s->n_face; f++)
        for (int k = 0; k < 3; k++)
            mesh->face[f][k] = number[s->face[f][k]];
    free(number);
}

static void shell_clear(shell *s) {
    free(s->fine_patch);
    free(s->round);
    free(s->first);
    free(s->wanted);
    free(s->line);
    free(s->x);
    free(s->kind);
    free(s->face);
    free(s->patch);
    free(s->start);
    free(s->ring);
    free(s->edge);
    free(s->locked);
}

silt_status silt_solid_mesh(const silt_solid *fine, double h, const char *what, silt_solid *mesh, silt_error *err) {
    shell s = {.fine = fine, .size = MESH_TARGET * h, .wanted_patch = -1};
    s.wanted = silt_alloc((size_t)fine->n_face + 1, 1);
    shell_patches(&s);
    shell_start(&s, fine);
    for (int round = 0; round < MESH_ROUNDS; round++) {
        for (int pass = 0; pass < MESH_PASSES && shell_split(&s); pass++)
            ;
        for (int pass = 0; pass < MESH_PASSES && shell_contract(&s) > (round < MESH_ROUNDS - 2 ? s.n_face / 800 : 0); pass++)
            ;
        for (int pass = 0; pass < 4 && shell_turn(&s); pass++)
            ;
        for (int pass = 0; pass < 3; pass++)
            shell_smooth(&s);
    }
    for (int pass = 0; pass < MESH_PASSES && shell_turn(&s); pass++)
        ;
    shell_fill(&s);
    shell_hand_over(&s, mesh);
    shell_clear(&s);
    return silt_solid_close(mesh, what, err);
}
