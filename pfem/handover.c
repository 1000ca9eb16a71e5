// a rebuild changes the nodes' share of the water: the momentum of what changes hands goes with it
#include "pfem.h"

#define HAND_ROUNDS 6 // passes over a group in which some drop out because they are at the end of their range

// Every group of a rebuild (book.c) is settled on its own. A node takes part with its share of the group's cells and an
// equal part of the rest of its mass; its new velocity is the mean of its parts by mass. Two ways to keep the group's
// momentum: all velocities stay but for one shift by what is missing, taken by those whom it does not carry out of
// their range; or, where that cannot be or would add energy, what the losers lose goes to the winners at the losers'
// mean velocity (never a new extremum, never more energy, but smearing). Energy may go up in one group as far as it
// goes down in others; where walls hold so many nodes that momentum and energy cannot both be kept, momentum is.

typedef struct part {
    int node, now;                   // old and new number; now -1: the node left
    double old, mass;                // kg, before and after
    const double *v;                 // m/s, before
    double at[3], first[3], safe[3]; // m/s: where it stands; by the first way; what it can go back to
    bool open;                       // may still be shifted
    double free[3][3];               // projection onto the directions in which the node is not held
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
    double *least, *most;     // new number, dim each: range of the parts' velocities
    double *gain;             // J, one per group: what it has more than before, when nothing holds it back
    double share;             // of the gains that are allowed
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

// how much of a step a part may take: its velocity stays in the range of its neighbours' and of the group's
static double part_limit(const ledger *l, const part *p, const double lo[3], const double hi[3], const double step[3]) {
    double share = 1;
    for (int d = 0; d < l->dim; d++) {
        double least = silt_min(lo[d], p->at[d]), most = silt_max(hi[d], p->at[d]);
        for (int k = l->mesh->neighbour_start[p->now]; k < l->mesh->neighbour_start[p->now + 1]; k++) {
            const double v = l->v[l->dim * l->origin[l->mesh->neighbour[k]] + d];
            least = silt_min(least, v);
            most = silt_max(most, v);
        }
        const double rounding = 1e-13 * (fabs(least) + fabs(most));
        if (step[d] > 0)
            share = silt_min(share, (most + rounding - p->at[d]) / step[d]);
        else if (step[d] < 0)
            share = silt_min(share, (least - rounding - p->at[d]) / step[d]);
    }
    return share;
}

// Shifts the parts, all by the same where they may, until the group has the wanted momentum. @return false: it has not
static bool group_fill(const ledger *l, part *list, int n, const double wanted[3], const double lo[3],
                       const double hi[3]) {
    for (int k = 0; k < n; k++)
        list[k].open = list[k].now >= 0 && list[k].mass > 0;
    for (int round = 0;; round++) {
        double matrix[3][3] = {{0}}, shift[3], most = 0, size = 0;
        memcpy(shift, wanted, sizeof shift);
        for (int k = 0; k < n; k++)
            for (int d = 0; d < l->dim && list[k].now >= 0; d++) {
                shift[d] -= list[k].mass * list[k].at[d];
                size += fabs(list[k].mass * list[k].at[d]);
                for (int c = 0; c < l->dim && list[k].open; c++)
                    matrix[d][c] += list[k].mass * list[k].free[d][c];
            }
        for (int d = 0; d < l->dim; d++)
            most = silt_max(most, fabs(shift[d]));
        if (most <= 1e-15 * size)
            return true;
        if (round == HAND_ROUNDS || !solve_small(l->dim, matrix, shift))
            return most <= 1e-12 * size;
        for (int k = 0; k < n; k++) {
            double step[3] = {0};
            if (!list[k].open)
                continue;
            for (int d = 0; d < l->dim; d++)
                for (int c = 0; c < l->dim; c++)
                    step[d] += list[k].free[d][c] * shift[c];
            const double share = part_limit(l, &list[k], lo, hi, step);
            for (int d = 0; d < l->dim; d++)
                list[k].at[d] += share * step[d];
            list[k].open = share >= 1;
        }
    }
}

static double group_energy(const ledger *l, const part *list, int n) {
    double sum = 0;
    for (int k = 0; k < n; k++)
        for (int d = 0; d < l->dim && list[k].now >= 0; d++)
            sum += 0.5 * list[k].mass * silt_square(list[k].at[d]);
    return sum;
}

// goes back towards safer velocities until the group has no more energy than it may have
static void group_brake(const ledger *l, part *list, int n, double energy) {
    double base = 0, linear = 0, square = 0;
    for (int k = 0; k < n; k++)
        for (int d = 0; d < l->dim && list[k].now >= 0; d++) {
            const double step = list[k].at[d] - list[k].safe[d];
            base += 0.5 * list[k].mass * silt_square(list[k].safe[d]);
            linear += list[k].mass * list[k].safe[d] * step;
            square += 0.5 * list[k].mass * silt_square(step);
        }
    // base + linear s + square s^2 = energy
    const double room = energy - base;
    const double share = room <= 0 || square <= 0
                             ? 0
                             : silt_clamp((sqrt(linear * linear + 4 * square * room) - linear) / (2 * square), 0, 1);
    for (int k = 0; k < n; k++)
        for (int d = 0; d < l->dim; d++)
            list[k].at[d] = list[k].safe[d] + share * (list[k].at[d] - list[k].safe[d]);
}

static void group_hand_on(ledger *l, int group, part *list, int n) {
    const int dim = l->dim;
    double out = 0, in = 0, given[3] = {0}, lo[3], hi[3], energy = 0, kept = 0, wanted[3] = {0};
    for (int d = 0; d < 3; d++) {
        lo[d] = HUGE_VAL;
        hi[d] = -HUGE_VAL;
    }
    for (int k = 0; k < n; k++) {
        const part *p = &list[k];
        const double change = p->mass - p->old;
        out += silt_max(0, -change);
        in += silt_max(0, change);
        for (int d = 0; d < dim; d++) {
            given[d] += silt_max(0, -change) * p->v[d];
            wanted[d] += p->old * p->v[d];
            energy += 0.5 * p->old * silt_square(p->v[d]);
            kept += 0.5 * p->mass * silt_square(p->v[d]);
            if (p->old > 0 || p->held) {
                lo[d] = silt_min(lo[d], p->v[d]);
                hi[d] = silt_max(hi[d], p->v[d]);
            }
        }
    }
    // what leaves the water (outlets, bed) goes with the losers' velocity
    for (int d = 0; d < dim; d++) {
        given[d] = out > 0 ? given[d] / out : 0;
        wanted[d] -= (out - in) * given[d];
        energy -= 0.5 * (out - in) * silt_square(given[d]);
    }
    // first as if what the change of the shares does to the energy of velocities that stay were no gain (so it is in a
    // linear field), then with the gains cut to what others lose
    const bool trial = l->share >= 1;
    const double before = energy;
    energy = trial ? silt_max(before, kept) : before + l->share * silt_max(0, l->gain[group]);
    // the winners mix what they have with what they are given; who owed more than he had takes what he is given
    for (int k = 0; k < n; k++) {
        part *p = &list[k];
        const double gain = p->mass - p->old, mixed = p->mass > 0 ? silt_clamp(gain / p->mass, 0, 1) : 0;
        for (int d = 0; d < dim; d++) {
            double step = out > 0 ? mixed * (given[d] - p->v[d]) : 0;
            for (int c = 0; c < dim && p->held; c++)
                step += out > 0 ? (p->free[d][c] - (c == d)) * mixed * (given[c] - p->v[c]) : 0;
            p->safe[d] = p->v[d] + step;
            p->at[d] = p->v[d];
        }
    }
    const bool filled = group_fill(l, list, n, wanted, lo, hi);
    energy *= 1 + 1e-14;
    const double first = group_energy(l, list, n);
    if (!filled || first > energy) {
        for (int k = 0; k < n; k++)
            for (int d = 0; d < dim; d++) {
                list[k].first[d] = list[k].at[d];
                list[k].at[d] = list[k].safe[d];
            }
        // what held nodes could not take; momentum comes before energy
        const bool refilled = group_fill(l, list, n, wanted, lo, hi);
        const double least = group_energy(l, list, n);
        if (!filled) {
            if (!refilled && least > energy)
                group_brake(l, list, n, energy);
        } else {
            for (int k = 0; k < n; k++)
                for (int d = 0; d < dim; d++) {
                    list[k].safe[d] = list[k].at[d];
                    list[k].at[d] = list[k].first[d];
                }
            if (refilled && least < first)
                group_brake(l, list, n, silt_max(energy, least));
        }
    }
    for (int k = 0; k < n; k++) {
        const part *p = &list[k];
        if (p->now < 0)
            continue;
        l->mass[p->now] += p->mass;
        for (int d = 0; d < dim; d++) {
            const int at = dim * p->now + d;
            l->momentum[at] += p->mass * p->at[d];
            l->least[at] = silt_min(l->least[at], p->at[d]);
            l->most[at] = silt_max(l->most[at], p->at[d]);
            wanted[d] -= p->mass * p->at[d];
        }
    }
    for (int d = 0; d < dim; d++)
        l->lost[d] += wanted[d];
    if (trial)
        l->gain[group] = group_energy(l, list, n) - before;
}

// settles all groups and sums up what the nodes have of them
static void ledger_run(ledger *l, const double *debt, const int *map) {
    const int count_all = l->dim * l->nodes->count;
    memset(l->mass, 0, (size_t)l->nodes->count * sizeof *l->mass);
    memset(l->momentum, 0, (size_t)count_all * sizeof *l->momentum);
    memset(l->lost, 0, sizeof l->lost);
    for (int k = 0; k < count_all; k++) {
        l->least[k] = HUGE_VAL;
        l->most[k] = -HUGE_VAL;
    }
    int capacity = 0;
    part *list = NULL;
    for (int g = 0; g < l->memory->n_group; g++) {
        const int first = l->memory->group_start[g], count = l->memory->group_start[g + 1] - first;
        SILT_RESERVE(list, capacity, count);
        for (int k = 0; k < count; k++) {
            const struct silt_share *share = &l->memory->exchange[first + k];
            const int i = share->node;
            part *p = &list[k];
            *p = (part){.node = i, .now = map[i], .v = l->v + l->dim * i};
            p->old = l->density * share->before + l->rest[i] / l->count[i];
            p->mass = p->old + l->density * share->change;
            // cancellation leaves crumbs of either sign
            const double crumb = 1e-12 * l->density * (fabs(share->before) + fabs(share->change) + fabs(debt[i]));
            p->old = fabs(p->old) < crumb ? 0 : p->old;
            p->mass = p->now < 0 || fabs(p->mass) < crumb ? 0 : p->mass;
            part_freedom(l, p);
        }
        group_hand_on(l, g, list, count);
    }
    free(list);
}

void silt_momentum_hand_on(const silt_memory *memory, const silt_mesh *mesh, silt_nodes *nodes, double density,
                           const double *mass, const double *debt, const double *v, const int *map, double lost[3]) {
    const int dim = silt_nodes_dim(nodes), n = memory->n_node;
    ledger l = {.memory = memory, .mesh = mesh, .nodes = nodes, .v = v, .density = density, .dim = dim, .share = 1};
    l.count = silt_alloc((size_t)n + 1, sizeof *l.count);
    l.origin = silt_alloc((size_t)nodes->count + 1, sizeof *l.origin);
    l.rest = silt_alloc((size_t)n + 1, sizeof *l.rest);
    l.mass = silt_alloc((size_t)nodes->count + 1, sizeof *l.mass);
    l.momentum = silt_alloc((size_t)(dim * nodes->count) + 1, sizeof *l.momentum);
    l.least = silt_alloc((size_t)(dim * nodes->count) + 1, sizeof *l.least);
    l.most = silt_alloc((size_t)(dim * nodes->count) + 1, sizeof *l.most);
    l.gain = silt_alloc((size_t)memory->n_group + 1, sizeof *l.gain);
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
    ledger_run(&l, debt, map);
    double gains = 0, losses = 0;
    for (int g = 0; g < memory->n_group; g++) {
        gains += silt_max(0, l.gain[g]);
        losses -= silt_min(0, l.gain[g]);
    }
    if (gains > losses) {
        l.share = losses / gains;
        ledger_run(&l, debt, map);
    }
    for (int i = 0; i < nodes->count; i++) {
        for (int d = 0; d < dim; d++) {
            double *at = &nodes->v[dim * i + d], *p = &l.momentum[dim * i + d];
            // parts of negative mass (debts) could carry the mean out of the range
            if (l.mass[i] > 0 && nodes->kind[i] == NODE_FLUID)
                *at = silt_clamp(*p / l.mass[i], l.least[dim * i + d], l.most[dim * i + d]);
            l.lost[d] += *p - l.mass[i] * *at;
        }
    }
    for (int d = 0; d < 3; d++)
        lost[d] = d < dim ? l.lost[d] : 0;
    free(l.gain);
    free(l.count);
    free(l.origin);
    free(l.rest);
    free(l.mass);
    free(l.momentum);
    free(l.least);
    free(l.most);
}
