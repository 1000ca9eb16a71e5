// slivers: four nodes nearly in a plane, which the Delaunay criterion lets pass, taken out by local exchanges of
// tetrahedra
#include "remesh.h"

#define HEAL_BELOW  0.12 // cells with a smaller height than this times h are tried
#define HEAL_RING   8    // an edge with more cells around it is left alone
#define HEAL_PASSES 6
#define HEAL_CELLS  (2 * HEAL_RING)
#define HEAL_STAR   128  // most cells around a node that gives way
#define HEAL_STEP   0.02 // by which it gives way, times h, and twice and three times that

typedef struct healer {
    silt_draft *draft;
    silt_mesh *mesh;
    const silt_nodes *nodes;
    double size;
    int *spare; // slots of cells that are gone
    int n_spare, spare_capacity, tried_capacity;
    uint8_t *tried; // one per cell: nothing can be done about it as long as its neighbours stay
} healer;

// the nodes that an exchange is about, about the first of them
typedef struct patch {
    int node[HEAL_RING + 2];
    double x[HEAL_RING + 2][3];
    double h[HEAL_RING + 2];
} patch;

static void patch_put(const healer *s, patch *p, int k, int node) {
    p->node[k] = node;
    p->h[k] = silt_node_h(s->nodes, node, s->size);
    for (int d = 0; d < 3; d++) {
        double step = s->nodes->x[3 * node + d] - s->nodes->x[3 * p->node[0] + d];
        if (s->mesh->period[d] > 0)
            step -= s->mesh->period[d] * floor(step / s->mesh->period[d] + 0.5);
        p->x[k][d] = step;
    }
}

static double patch_quality(const patch *p, int a, int b, int c, int d) {
    double corner[12];
    memcpy(corner, p->x[a], sizeof p->x[a]);
    memcpy(corner + 3, p->x[b], sizeof p->x[b]);
    memcpy(corner + 6, p->x[c], sizeof p->x[c]);
    memcpy(corner + 9, p->x[d], sizeof p->x[d]);
    return silt_cell_measure(3, corner).height * 4 / (p->h[a] + p->h[b] + p->h[c] + p->h[d]);
}

// what is best done about a cell
typedef struct remedy {
    int n_old, n_new;
    int old[HEAL_RING];
    int fresh[HEAL_CELLS][4];
    double quality[HEAL_CELLS];
    double gain; // smallest quality after less before
    double cost; // sum of 1/quality after less before: decides where the worst cell is the same
} remedy;

#define HEAL_TIE 1e-10 // qualities closer than this are the same: rounding must not decide

static bool better(double value, double cost, double than, double than_cost) {
    return value > than + HEAL_TIE || (value > than - HEAL_TIE && cost < than_cost - HEAL_TIE);
}

// cells and nodes around the edge a-b, starting at cell e; false: it lies on the boundary, or the ring is too long
static bool ring_walk(const healer *s, int e, const int corner[4], int *ring, int *cell, int *n) {
    const silt_mesh *mesh = s->mesh;
    const int a = mesh->cell[e][corner[0]], b = mesh->cell[e][corner[1]];
    int from = mesh->cell[e][corner[2]], to = mesh->cell[e][corner[3]], at = e;
    *n = 0;
    do {
        if (*n == HEAL_RING)
            return false;
        ring[*n] = from;
        cell[(*n)++] = at;
        int k = 0;
        while (mesh->cell[at][k] != from)
            k++;
        at = mesh->across[at][k];
        if (at < 0)
            return false;
        from = to;
        for (int m = 0; m < 4; m++)
            if (mesh->cell[at][m] != a && mesh->cell[at][m] != b && mesh->cell[at][m] != from)
                to = mesh->cell[at][m];
    } while (at != e);
    return *n >= 3;
}

// triangles of a ring's polygon, each with a tetrahedron to either end of the edge; -2: not looked at yet
typedef struct fan {
    int n;
    patch p;
    double upper[HEAL_RING][HEAL_RING][HEAL_RING], lower[HEAL_RING][HEAL_RING][HEAL_RING];
} fan;

// the worse of a triangle's two cells; -1: worse than `least`
static double fan_worst(fan *f, int i, int k, int j, double least) {
    double *upper = &f->upper[i][k][j], *lower = &f->lower[i][k][j];
    if (*upper == -2)
        *upper = patch_quality(&f->p, 2 + i, 2 + k, 2 + j, 1);
    if (*upper <= least)
        return -1;
    if (*lower == -2)
        *lower = patch_quality(&f->p, 2 + i, 2 + j, 2 + k, 0);
    return *lower <= least ? -1 : silt_min(*upper, *lower);
}

// Takes out the edge: the polygon of its ring is divided into triangles so that the worst cell is as good as can be
// (Klincsek's dynamic programme), and of divisions with the same worst cell the one with the least sum of 1/quality.
static void try_edge(const healer *s, int e, const int corner[4], remedy *best) {
    int ring[HEAL_RING], cell[HEAL_RING], n;
    if (!ring_walk(s, e, corner, ring, cell, &n))
        return;
    fan f = {.n = n};
    patch_put(s, &f.p, 0, s->mesh->cell[e][corner[0]]);
    patch_put(s, &f.p, 1, s->mesh->cell[e][corner[1]]);
    double before = HUGE_VAL, cost_before = 0;
    for (int k = 0; k < n; k++) {
        patch_put(s, &f.p, 2 + k, ring[k]);
        before = silt_min(before, s->draft->quality[cell[k]]);
        cost_before += 1 / silt_max(s->draft->quality[cell[k]], HEAL_TIE);
    }
    for (int i = 0; i < n; i++)
        for (int k = i + 1; k < n; k++)
            for (int j = k + 1; j < n; j++)
                f.upper[i][k][j] = f.lower[i][k][j] = -2;
    // a division with a cell that is turned over heals nothing
    const double bar = silt_max(before + silt_max(best->gain - HEAL_TIE, HEAL_TIE), 0);
    double worst[HEAL_RING][HEAL_RING], cost[HEAL_RING][HEAL_RING];
    int split[HEAL_RING][HEAL_RING];
    for (int span = 1; span < n; span++)
        for (int i = 0; i + span < n; i++) {
            const int j = i + span;
            worst[i][j] = span == 1 ? HUGE_VAL : -1;
            for (int k = i + 1; k < j; k++) {
                const double least = silt_max(worst[i][j], bar), rest = silt_min(worst[i][k], worst[k][j]);
                if (rest > least)
                    worst[i][j] = silt_max(worst[i][j], silt_min(rest, fan_worst(&f, i, k, j, least)));
            }
        }
    if (worst[0][n - 1] <= bar)
        return;
    const double least = worst[0][n - 1] - HEAL_TIE;
    for (int span = 1; span < n; span++)
        for (int i = 0; i + span < n; i++) {
            const int j = i + span;
            cost[i][j] = span == 1 ? 0 : HUGE_VAL;
            for (int k = i + 1; k < j; k++) {
                const double rest = cost[i][k] + cost[k][j];
                if (!(rest < cost[i][j]) || fan_worst(&f, i, k, j, least) < 0)
                    continue;
                const double sum = rest + 1 / f.upper[i][k][j] + 1 / f.lower[i][k][j];
                if (sum < cost[i][j]) {
                    cost[i][j] = sum;
                    split[i][j] = k;
                }
            }
        }
    const double gain = worst[0][n - 1] - before, more = cost[0][n - 1] - cost_before;
    if (!better(gain, more, best->gain, best->cost))
        return;
    best->gain = gain;
    best->cost = more;
    best->n_old = n;
    memcpy(best->old, cell, sizeof cell);
    best->n_new = 0;
    int stack[HEAL_RING][2] = {{0, n - 1}}, top = 1;
    while (top) {
        top--;
        const int i = stack[top][0], j = stack[top][1], k = split[i][j], m = best->n_new;
        best->n_new += 2;
        memcpy(best->fresh[m], (const int[4]){ring[i], ring[k], ring[j], f.p.node[1]}, sizeof best->fresh[m]);
        memcpy(best->fresh[m + 1], (const int[4]){ring[i], ring[j], ring[k], f.p.node[0]}, sizeof best->fresh[m]);
        best->quality[m] = f.upper[i][k][j];
        best->quality[m + 1] = f.lower[i][k][j];
        const int piece[2][2] = {{i, k}, {k, j}};
        for (int q = 0; q < 2; q++)
            if (piece[q][1] - piece[q][0] > 1)
                memcpy(stack[top++], piece[q], sizeof piece[q]);
    }
}

// takes out the facet opposite node a: three cells around the line between the two nodes that faced each other across
// it
static void try_facet(const healer *s, int e, int a, remedy *best) {
    const silt_mesh *mesh = s->mesh;
    const int f = mesh->across[e][a];
    if (f < 0)
        return;
    int facet[3], far = -1;
    silt_cell_facet(3, mesh->cell[e], a, facet);
    for (int k = 0; k < 4; k++)
        if (mesh->across[f][k] == e)
            far = mesh->cell[f][k];
    patch p;
    patch_put(s, &p, 0, mesh->cell[e][a]);
    patch_put(s, &p, 1, far);
    for (int k = 0; k < 3; k++)
        patch_put(s, &p, 2 + k, facet[k]);
    const double q[2] = {s->draft->quality[e], s->draft->quality[f]}, before = silt_min(q[0], q[1]);
    double quality[3], more = -1 / silt_max(q[0], HEAL_TIE) - 1 / silt_max(q[1], HEAL_TIE);
    for (int k = 0; k < 3; k++) {
        quality[k] = patch_quality(&p, 2 + k, 2 + (k + 1) % 3, 0, 1);
        if (quality[k] <= before + best->gain - HEAL_TIE)
            return;
        more += 1 / quality[k];
    }
    const double gain = silt_min(quality[0], silt_min(quality[1], quality[2])) - before;
    if (gain <= HEAL_TIE || !better(gain, more, best->gain, best->cost))
        return;
    best->gain = gain;
    best->cost = more;
    best->n_old = 2;
    best->old[0] = e;
    best->old[1] = f;
    best->n_new = 3;
    for (int k = 0; k < 3; k++) {
        memcpy(best->fresh[k], (const int[4]){facet[k], facet[(k + 1) % 3], p.node[0], p.node[1]},
               sizeof best->fresh[k]);
        best->quality[k] = quality[k];
    }
}

// a facet without its turn: equal for both cells that have it
static void facet_key(const int *cell, int a, int key[3]) {
    silt_cell_facet(3, cell, a, key);
    for (int pass = 0; pass < 3; pass++) {
        const int k = pass % 2, t = key[k];
        if (key[k] > key[k + 1]) {
            key[k] = key[k + 1];
            key[k + 1] = t;
        }
    }
}

static void remedy_apply(healer *s, const remedy *r) {
    silt_mesh *mesh = s->mesh;
    silt_draft *draft = s->draft;
    // facets around the cavity, and the cells beyond
    struct half {
        int key[3], cell, side;
    } rim[4 * HEAL_CELLS];
    int n_rim = 0, slot[HEAL_CELLS];
    for (int k = 0; k < r->n_old; k++)
        for (int a = 0; a < 4; a++) {
            const int other = mesh->across[r->old[k]][a];
            bool inside = false;
            for (int m = 0; m < r->n_old; m++)
                inside |= r->old[m] == other;
            if (inside)
                continue;
            struct half *h = &rim[n_rim++];
            facet_key(mesh->cell[r->old[k]], a, h->key);
            h->cell = other;
            h->side = -1;
            for (int b = 0; other >= 0 && b < 4; b++)
                if (mesh->across[other][b] == r->old[k])
                    h->side = b;
        }
    for (int k = 0; k < r->n_new; k++) {
        if (k < r->n_old)
            slot[k] = r->old[k];
        else if (s->n_spare)
            slot[k] = s->spare[--s->n_spare];
        else {
            slot[k] = mesh->n_cell++;
            SILT_RESERVE(mesh->cell, mesh->cell_capacity, mesh->n_cell);
            SILT_RESERVE(mesh->across, mesh->across_capacity, mesh->n_cell);
            SILT_RESERVE(draft->before, draft->before_capacity, mesh->n_cell);
            SILT_RESERVE(draft->quality, draft->quality_capacity, mesh->n_cell);
            SILT_RESERVE(s->tried, s->tried_capacity, mesh->n_cell);
        }
    }
    for (int k = r->n_new; k < r->n_old; k++) {
        SILT_RESERVE(s->spare, s->spare_capacity, s->n_spare + 1);
        s->spare[s->n_spare++] = r->old[k];
        draft->quality[r->old[k]] = HUGE_VAL;
        mesh->cell[r->old[k]][0] = -1;
    }
    for (int k = 0; k < r->n_new; k++) {
        memcpy(mesh->cell[slot[k]], r->fresh[k], sizeof r->fresh[k]);
        draft->quality[slot[k]] = r->quality[k];
        draft->before[slot[k]] = -2;
        s->tried[slot[k]] = 0;
    }
    // every facet of the new cells is on the rim or has its partner among the new cells
    for (int k = 0; k < r->n_new; k++)
        for (int a = 0; a < 4; a++) {
            int key[3], m = 0;
            facet_key(r->fresh[k], a, key);
            while (m < n_rim && memcmp(rim[m].key, key, sizeof key) != 0)
                m++;
            if (m == n_rim) {
                struct half *h = &rim[n_rim++];
                memcpy(h->key, key, sizeof key);
                h->cell = slot[k];
                h->side = a;
                continue;
            }
            mesh->across[slot[k]][a] = rim[m].cell;
            if (rim[m].cell >= 0) {
                mesh->across[rim[m].cell][rim[m].side] = slot[k];
                s->tried[rim[m].cell] = 0;
            }
        }
}

typedef struct patient {
    double quality;
    int cell;
} patient;

static int patient_worse(const void *a, const void *b) {
    const patient *p = a, *q = b;
    return p->quality != q->quality ? (p->quality > q->quality) - (p->quality < q->quality)
                                    : (p->cell > q->cell) - (p->cell < q->cell);
}

static void heal_cell(healer *s, int e) {
    // corners of the edge first, so that all four stand as the cell's nodes do
    static const int edge[6][4] = {{0, 1, 2, 3}, {0, 2, 3, 1}, {0, 3, 1, 2}, {1, 2, 0, 3}, {1, 3, 2, 0}, {2, 3, 0, 1}};
    remedy best = {.gain = 0};
    for (int k = 0; k < 6; k++)
        try_edge(s, e, edge[k], &best);
    for (int a = 0; a < 4; a++)
        try_facet(s, e, a, &best);
    if (best.n_new)
        remedy_apply(s, &best);
    else
        s->tried[e] = 1;
}

// ---- what exchanges cannot mend: one of its nodes gives way a little

// cells around a node, starting at one of them; false: the node lies on the boundary, or there are too many
static bool star_walk(const silt_mesh *mesh, int e, int i, int *star, int *n) {
    *n = 0;
    star[(*n)++] = e;
    for (int k = 0; k < *n; k++)
        for (int a = 0; a < 4; a++) {
            if (mesh->cell[star[k]][a] == i)
                continue;
            const int other = mesh->across[star[k]][a];
            if (other < 0)
                return false;
            bool known = false;
            for (int m = 0; m < *n && !known; m++)
                known = star[m] == other;
            if (known)
                continue;
            if (*n == HEAL_STAR)
                return false;
            star[(*n)++] = other;
        }
    return true;
}

static double cell_quality(const healer *s, int e) {
    double corner[12];
    silt_cell_corners(s->mesh, s->nodes->x, s->mesh->cell[e], corner);
    return silt_cell_measure(3, corner).height / silt_cell_h(s->nodes, 4, s->mesh->cell[e], s->size);
}

// change of a node's pressure on a step along its mean gradient in the cells around it
static double pressure_along(const healer *s, const double *x, int i, const int *star, int n, const double step[3]) {
    const silt_mesh *mesh = s->mesh;
    double sum = 0, volume = 0;
    for (int k = 0; k < n; k++) {
        const int *cell = mesh->cell[star[k]];
        static const int local[4] = {0, 1, 2, 3};
        double corner[12], mean = 0;
        int a = 0, side[3];
        while (cell[a] != i)
            a++;
        silt_cell_corners(mesh, x, cell, corner);
        silt_cell_facet(3, local, a, side);
        const double *o = corner + 3 * side[0], *u = corner + 3 * side[1], *v = corner + 3 * side[2];
        for (int b = 0; b < 3; b++)
            mean += s->nodes->p[cell[side[b]]] / 3;
        for (int d = 0; d < 3; d++) {
            const int p = (d + 1) % 3, q = (d + 2) % 3;
            sum += 0.5 * mean * step[d] * ((u[p] - o[p]) * (v[q] - o[q]) - (u[q] - o[q]) * (v[p] - o[p]));
        }
        volume += silt_simplex_volume(3, corner);
    }
    return volume > 0 ? sum / volume : 0;
}

// The water's volume does not change when an inner node moves; the worst of the cells around it must gain.
static void give_way(healer *s, double *x, int e) {
    int best_node = -1, star[HEAL_STAR], n;
    double best_step[3] = {0}, best = s->draft->quality[e] + HEAL_TIE;
    for (int a = 0; a < 4; a++) {
        const int i = s->mesh->cell[e][a];
        if (s->nodes->kind[i] != NODE_FLUID || s->nodes->wall[i][0] >= 0 || !star_walk(s->mesh, e, i, star, &n))
            continue;
        double corner[12], normal[3], length = 0, home[3];
        int side[3];
        static const int local[4] = {0, 1, 2, 3};
        silt_cell_corners(s->mesh, x, s->mesh->cell[e], corner);
        silt_cell_facet(3, local, a, side);
        for (int d = 0; d < 3; d++) {
            const int p = (d + 1) % 3, q = (d + 2) % 3;
            const double *o = corner + 3 * side[0], *u = corner + 3 * side[1], *v = corner + 3 * side[2];
            normal[d] =
                (v[p] - o[p]) * (u[q] - o[q]) - (v[q] - o[q]) * (u[p] - o[p]); // away from the facet, into the cell
            length += normal[d] * normal[d];
        }
        memcpy(home, x + 3 * i, sizeof home);
        for (int try = 1; try <= 3; try++) {
            const double reach = HEAL_STEP * try * silt_node_h(s->nodes, i, s->size) / sqrt(length);
            for (int d = 0; d < 3; d++)
                x[3 * i + d] = home[d] + reach * normal[d];
            double worst = HUGE_VAL;
            for (int k = 0; k < n && worst > best; k++)
                worst = silt_min(worst, cell_quality(s, star[k]));
            if (worst > best) {
                best = worst;
                best_node = i;
                for (int d = 0; d < 3; d++)
                    best_step[d] = reach * normal[d];
            }
        }
        memcpy(x + 3 * i, home, sizeof home);
    }
    if (best_node < 0 || !star_walk(s->mesh, e, best_node, star, &n))
        return;
    s->nodes->p[best_node] += pressure_along(s, x, best_node, star, n, best_step);
    for (int d = 0; d < 3; d++)
        x[3 * best_node + d] += best_step[d];
    for (int k = 0; k < n; k++)
        s->draft->quality[star[k]] = cell_quality(s, star[k]);
}

int silt_mesh_heal(silt_draft *draft, const silt_nodes *nodes, double *x, double size) {
    silt_mesh *mesh = draft->mesh;
    healer s = {.draft = draft, .mesh = mesh, .nodes = nodes, .size = size};
    SILT_RESERVE(s.tried, s.tried_capacity, mesh->n_cell + 1);
    patient *list = NULL;
    int list_capacity = 0;
    for (int pass = 0; pass < HEAL_PASSES; pass++) {
        int n = 0;
        for (int e = 0; e < mesh->n_cell; e++)
            if (draft->quality[e] < HEAL_BELOW && !s.tried[e]) {
                SILT_RESERVE(list, list_capacity, n + 1);
                list[n++] = (patient){draft->quality[e], e};
            }
        if (n == 0)
            break;
        // the worst first: the outcome hangs on the places of the nodes, not on their numbers
        qsort(list, (size_t)n, sizeof *list, patient_worse);
        for (int k = 0; k < n; k++)
            if (draft->quality[list[k].cell] == list[k].quality && mesh->cell[list[k].cell][0] >= 0)
                heal_cell(&s, list[k].cell);
    }
    // the last cells fill the free slots
    int n_flat = 0, last = mesh->n_cell;
    for (int k = 0; k < s.n_spare; k++) {
        while (last > 0 && mesh->cell[last - 1][0] < 0)
            last--;
        const int to = s.spare[k], from = last - 1;
        if (to >= last)
            continue;
        memcpy(mesh->cell[to], mesh->cell[from], sizeof *mesh->cell);
        memcpy(mesh->across[to], mesh->across[from], sizeof *mesh->across);
        draft->before[to] = draft->before[from];
        draft->quality[to] = draft->quality[from];
        for (int a = 0; a < 4; a++)
            for (int b = 0; mesh->across[to][a] >= 0 && b < 4; b++)
                if (mesh->across[mesh->across[to][a]][b] == from)
                    mesh->across[mesh->across[to][a]][b] = to;
        last--;
    }
    while (last > 0 && mesh->cell[last - 1][0] < 0)
        last--;
    mesh->n_cell = last;
    int n = 0;
    for (int e = 0; x && e < mesh->n_cell; e++)
        if (draft->quality[e] < CELL_FLAT) {
            SILT_RESERVE(list, list_capacity, n + 1);
            list[n++] = (patient){draft->quality[e], e};
        }
    if (n)
        qsort(list, (size_t)n, sizeof *list, patient_worse);
    for (int k = 0; k < n; k++)
        if (draft->quality[list[k].cell] < CELL_FLAT)
            give_way(&s, x, list[k].cell);
    for (int e = 0; e < mesh->n_cell; e++)
        n_flat += draft->quality[e] < CELL_FLAT;
    free(list);
    free(s.spare);
    free(s.tried);
    return n_flat;
}
