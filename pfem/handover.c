// a rebuild changes the nodes' share of the water: the momentum of what changes hands goes with it
#include "pfem.h"

// Every group of a rebuild (book.c) is settled on its own. A node takes part with its share of the group's cells and an equal
// part of the rest of its mass; its new velocity is the mean of its parts by mass. Two ways to keep the group's momentum: what
// the losers lose goes to the winners at the losers' mean velocity (never a new extremum, never more energy, but smearing); or
// all velocities stay and are shifted together by what is missing. The second is followed as far as limits allow.

typedef struct part {
    int node, now;       // old and new number; now -1: the node left
    double old, mass;    // kg, before and after
    const double *v;     // m/s, before
    double low[3], add[3]; // m/s: the first way, and what the second adds
    double free[3][3];   // projection onto the directions in which the node is not held
    bool held;
} part;

typedef struct ledger {
    const silt_memory *memory;
    const silt_mesh *mesh;
    silt_nodes *nodes;
    const double *v;
    double density;
    int dim, *count, *origin; // groups of a node (old number); old number of a node (new number)
    double *rest;             // kg, old number: each of a node's parts has this much besides its share of the group
    double *mass, *momentum;  // new number: sums over the parts
    double lost[3];
} ledger;

static void part_freedom(const ledger *l, part *p) {
    memset(p->free, 0, sizeof p->free);
    silt_hold hold = HOLD_FREE;
    double vector[3] = {0};
    if (p->now >= 0 && l->nodes->kind[p->now] != NODE_FLUID)
        hold = HOLD_ALL;
    else if (p->now >= 0 && l->mesh->walls && l->nodes->wall[p->now][0] >= 0)
        hold = silt_walls_hold(l->mesh->walls, l->nodes->wall[p->now], vector);
    p->held = hold != HOLD_FREE;
    for (int d = 0; d < l->dim; d++)
        for (int k = 0; k < l->dim; k++)
            p->free[d][k] = hold == HOLD_ALL    ? 0
                            : hold == HOLD_LINE ? vector[d] * vector[k]
                                                : (d == k) - (hold == HOLD_NORMAL ? vector[d] * vector[k] : 0);
}

// solves a x = b, symmetric; false: some direction is held everywhere
static bool solve_small(int n, double a[3][3], double b[3]) {
    const double scale = a[0][0] + a[1][1] + (n == 3 ? a[2][2] : 0);
    for (int k = 0; k < n; k++) {
        if (!(a[k][k] > 1e-6 * scale))
            return false;
        for (int i = k + 1; i < n; i++) {
            const double f = a[i][k] / a[k][k];
            for (int j = k; j < n; j++)
                a[i][j] -= f * a[k][j];
            b[i] -= f * b[k];
        }
    }
    for (int k = n - 1; k >= 0; k--) {
        for (int j = k + 1; j < n; j++)
            b[k] -= a[k][j] * b[j];
        b[k] /= a[k][k];
    }
    return true;
}

// how far a part may follow the second way: its velocity stays in the range of its neighbours' and of the group's
static double part_limit(const ledger *l, const part *p, const double lo[3], const double hi[3]) {
    double share = 1;
    for (int d = 0; d < l->dim; d++) {
        double least = silt_min(lo[d], p->low[d]), most = silt_max(hi[d], p->low[d]);
        for (int k = l->mesh->neighbour_start[p->now]; k < l->mesh->neighbour_start[p->now + 1]; k++) {
            const double v = l->v[l->dim * l->origin[l->mesh->neighbour[k]] + d];
            least = silt_min(least, v);
            most = silt_max(most, v);
        }
        if (p->add[d] > 0)
            share = silt_min(share, (most - p->low[d]) / p->add[d]);
        else if (p->add[d] < 0)
            share = silt_min(share, (least - p->low[d]) / p->add[d]);
    }
    return share;
}

static void group_hand_on(ledger *l, part *list, int n) {
    const int dim = l->dim;
    double out = 0, in = 0, given[3] = {0}, lo[3], hi[3], energy = 0, wanted[3] = {0};
    bool sound = true;
    for (int d = 0; d < 3; d++) {
        lo[d] = HUGE_VAL;
        hi[d] = -HUGE_VAL;
    }
    for (int k = 0; k < n; k++) {
        part *p = &list[k];
        const double change = p->mass - p->old;
        sound &= p->old >= 0 && p->mass >= 0;
        out += silt_max(0, -change);
        in += silt_max(0, change);
        for (int d = 0; d < dim; d++) {
            given[d] += silt_max(0, -change) * p->v[d];
            wanted[d] += p->old * p->v[d];
            energy += 0.5 * p->old * silt_square(p->v[d]);
            if (p->old > 0 || p->held) {
                lo[d] = silt_min(lo[d], p->v[d]);
                hi[d] = silt_max(hi[d], p->v[d]);
            }
        }
    }
    sound &= in <= 0 || out > 0;
    // what leaves the water (outlets, bed) goes with the losers' velocity
    for (int d = 0; d < dim; d++) {
        given[d] = out > 0 ? given[d] / out : 0;
        wanted[d] -= (out - in) * given[d];
        energy -= 0.5 * (out - in) * silt_square(given[d]);
    }

    double missing[3], shift[3], matrix[3][3] = {{0}};
    memcpy(missing, wanted, sizeof missing);
    memcpy(shift, wanted, sizeof shift);
    for (int k = 0; k < n; k++) {
        part *p = &list[k];
        if (p->now < 0)
            continue;
        const double gain = silt_max(0, p->mass - p->old);
        double step[3];
        for (int d = 0; d < dim; d++)
            step[d] = sound && p->mass > 0 ? gain / p->mass * (given[d] - p->v[d]) : 0;
        for (int d = 0; d < dim; d++) {
            p->low[d] = p->v[d];
            for (int c = 0; c < dim; c++) {
                p->low[d] += p->held ? p->free[d][c] * step[c] : c == d ? step[c] : 0;
                matrix[d][c] += p->mass * p->free[d][c];
            }
            missing[d] -= p->mass * p->low[d];
            shift[d] -= p->mass * p->v[d];
        }
    }
    double share = 0;
    if (solve_small(dim, matrix, shift)) {
        double linear = 0, square = 0, base = 0;
        share = 1;
        for (int k = 0; k < n; k++) {
            part *p = &list[k];
            if (p->now < 0)
                continue;
            for (int d = 0; d < dim; d++) {
                p->add[d] = p->v[d] - p->low[d];
                for (int c = 0; c < dim; c++)
                    p->add[d] += p->free[d][c] * shift[c];
                base += 0.5 * p->mass * silt_square(p->low[d]);
                linear += p->mass * p->low[d] * p->add[d];
                square += 0.5 * p->mass * silt_square(p->add[d]);
            }
            if (p->mass > 0)
                share = silt_min(share, part_limit(l, p, lo, hi));
        }
        // base + linear s + square s^2 = energy
        const double room = energy - base;
        if (base > 0 && base + share * (linear + share * square) > energy)
            share = room <= 0 || square <= 0
                        ? 0
                        : silt_min(share, (sqrt(linear * linear + 4 * square * room) - linear) / (2 * square));
        share = silt_max(0, share);
    }
    for (int k = 0; k < n; k++) {
        const part *p = &list[k];
        if (p->now < 0)
            continue;
        l->mass[p->now] += p->mass;
        for (int d = 0; d < dim; d++)
            l->momentum[dim * p->now + d] += p->mass * (p->low[d] + share * p->add[d]);
    }
    for (int d = 0; d < dim; d++)
        l->lost[d] += (1 - share) * missing[d];
}

void silt_momentum_hand_on(const silt_memory *memory, const silt_mesh *mesh, silt_nodes *nodes, double density,
                           const double *mass, const double *debt, const double *v, const int *map, double lost[3]) {
    const int dim = silt_nodes_dim(nodes), n = memory->n_node;
    ledger l = {.memory = memory, .mesh = mesh, .nodes = nodes, .v = v, .density = density, .dim = dim};
    l.count = silt_alloc((size_t)n + 1, sizeof *l.count);
    l.origin = silt_alloc((size_t)nodes->count + 1, sizeof *l.origin);
    l.rest = silt_alloc((size_t)n + 1, sizeof *l.rest);
    l.mass = silt_alloc((size_t)nodes->count + 1, sizeof *l.mass);
    l.momentum = silt_alloc((size_t)(dim * nodes->count) + 1, sizeof *l.momentum);
    for (int i = 0; i < n; i++)
        if (map[i] >= 0)
            l.origin[map[i]] = i;
    // what every node has besides its share of cells that changed
    for (int e = 0; !mass && e < memory->n_cell; e++)
        for (int a = 0; a <= dim; a++)
            l.rest[memory->cell[e][a]] += density * memory->area[e] / (dim + 1);
    for (int i = 0; i < n; i++)
        l.rest[i] = mass ? mass[i] : l.rest[i] + density * debt[i];
    for (int k = 0; k < memory->n_exchange; k++) {
        l.count[memory->exchange[k].node]++;
        l.rest[memory->exchange[k].node] -= density * memory->exchange[k].before;
    }
    int capacity = 0;
    part *list = NULL;
    for (int g = 0; g < memory->n_group; g++) {
        const int first = memory->group_start[g], count = memory->group_start[g + 1] - first;
        SILT_RESERVE(list, capacity, count);
        for (int k = 0; k < count; k++) {
            const struct silt_share *share = &memory->exchange[first + k];
            const int i = share->node;
            part *p = &list[k];
            *p = (part){.node = i, .now = map[i], .v = v + dim * i};
            p->old = density * share->before + l.rest[i] / l.count[i];
            p->mass = p->old + density * share->change;
            // cancellation leaves crumbs of either sign
            const double crumb = 1e-12 * density * (fabs(share->before) + fabs(share->change) + fabs(debt[i]));
            p->old = fabs(p->old) < crumb ? 0 : p->old;
            p->mass = p->now < 0 || fabs(p->mass) < crumb ? 0 : p->mass;
            part_freedom(&l, p);
        }
        group_hand_on(&l, list, count);
    }
    for (int i = 0; i < nodes->count; i++) {
        if (l.mass[i] <= 0 || nodes->kind[i] != NODE_FLUID)
            continue;
        for (int d = 0; d < dim; d++)
            nodes->v[dim * i + d] = l.momentum[dim * i + d] / l.mass[i];
    }
    for (int d = 0; d < 3; d++)
        lost[d] = d < dim ? l.lost[d] : 0;
    free(list);
    free(l.count);
    free(l.origin);
    free(l.rest);
    free(l.mass);
    free(l.momentum);
}
