// a rebuild changes the nodes' share of the water: the momentum of what changes hands goes with it
#include "pfem.h"

#define HAND_ROOM 1.5 // times the largest velocity relative to the group's mean
#define HAND_ROUNDS 6 // passes over a group in which some drop out because they are at the end of their range

// Every group of a rebuild (book.c) is settled on its own. A node takes part with its share of the group's cells and an equal
// part of the rest of its mass; its new velocity is the mean of its parts by mass. Two ways to keep the group's momentum: all
// velocities stay but for one shift by what is missing, taken by those whom it does not carry out of their range; or, where
// that cannot be or would add energy, what the losers lose goes to the winners at the losers' mean velocity (never out of the
// range, never more energy, but smearing). Velocities and energies are those relative to the group's mean, and a range is a ball
// about it: neither the speed of the whole nor the axes have a say.

typedef struct part {
    int node, now;       // old and new number; now -1: the node left
    double old, mass;    // kg, before and after
    double v[3];         // m/s, before, relative to the group's mean
    double at[3], first[3], safe[3]; // m/s: where it stands; by the first way; what it can go back to
    bool open;             // may still be shifted
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
    double *result;           // dim per part: the velocities found
    double frame[3];          // m/s, mean velocity of the group in hand
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

// radius of the ball about the group's mean that a part's velocity may not leave: a little beyond the farthest of the group and of
// its neighbours, or groups at walls have nowhere to put what is missing
static double part_range(const ledger *l, const part *p, double group) {
    double square = silt_max(silt_square(group), silt_dot(l->dim, p->at, p->at));
    for (int k = l->mesh->neighbour_start[p->now]; k < l->mesh->neighbour_start[p->now + 1]; k++) {
        const double *v = l->v + l->dim * l->origin[l->mesh->neighbour[k]];
        double sum = 0;
        for (int d = 0; d < l->dim; d++)
            sum += silt_square(v[d] - l->frame[d]);
        square = silt_max(square, sum);
    }
    return HAND_ROOM * sqrt(square);
}

// how much of a step a part may take
static double part_limit(const ledger *l, const part *p, double group, const double step[3]) {
    const double radius = part_range(l, p, group) * (1 + 1e-13);
    const double square = silt_dot(l->dim, step, step), linear = silt_dot(l->dim, p->at, step);
    const double room = silt_square(radius) - silt_dot(l->dim, p->at, p->at);
    // |at + s step| = radius
    return square > 0 ? silt_min(1, (sqrt(linear * linear + square * silt_max(room, 0)) - linear) / square) : 1;
}

// Shifts the parts, all by the same where they may, until the group has the wanted momentum. @return false: it has not
static bool group_fill(const ledger *l, part *list, int n, const double wanted[3], double radius) {
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
            const double share = part_limit(l, &list[k], radius, step);
            for (int d = 0; d < l->dim; d++)
                list[k].at[d] += share * step[d];
            list[k].open = share > 1 - 1e-9;
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
    const double share =
        room <= 0 || square <= 0 ? 0 : silt_clamp((sqrt(linear * linear + 4 * square * room) - linear) / (2 * square), 0, 1);
    for (int k = 0; k < n; k++)
        for (int d = 0; d < l->dim; d++)
            list[k].at[d] = list[k].safe[d] + share * (list[k].at[d] - list[k].safe[d]);
}

// velocities relative to the mean of what the group held
static void group_frame(ledger *l, part *list, int n) {
    double mass = 0;
    memset(l->frame, 0, sizeof l->frame);
    for (int k = 0; k < n; k++) {
        const double share = silt_max(list[k].old, 0) + 1e-300;
        mass += share;
        for (int d = 0; d < l->dim; d++)
            l->frame[d] += share * list[k].v[d];
    }
    for (int d = 0; d < l->dim; d++) {
        l->frame[d] /= mass;
        for (int k = 0; k < n; k++)
            list[k].v[d] -= l->frame[d];
    }
}

// @param result  dim per part, m/s, the velocities found
static void group_hand_on(ledger *l, part *list, int n, double *result) {
    const int dim = l->dim;
    double out = 0, in = 0, given[3] = {0}, radius = 0, energy = 0, kept = 0, wanted[3] = {0};
    group_frame(l, list, n);
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
        }
        if (p->old > 0 || p->held)
            radius = silt_max(radius, silt_length(dim, p->v));
    }
    // what leaves the water (outlets, bed) goes with the losers' velocity
    for (int d = 0; d < dim; d++) {
        given[d] = out > 0 ? given[d] / out : 0;
        wanted[d] -= (out - in) * given[d];
        energy -= 0.5 * (out - in) * silt_square(given[d]);
    }
    // what the change of the shares does to the energy of velocities that stay is no gain: so it is in a linear field
    energy = silt_max(energy, kept);
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
    const bool filled = group_fill(l, list, n, wanted, radius);
    energy *= 1 + 1e-14;
    if (!filled || group_energy(l, list, n) > energy) {
        for (int k = 0; k < n; k++)
            for (int d = 0; d < dim; d++) {
                const double first = list[k].at[d];
                list[k].at[d] = list[k].safe[d];
                list[k].first[d] = first;
            }
        // what held nodes could not take
        group_fill(l, list, n, wanted, radius);
        if (group_energy(l, list, n) > energy)
            group_brake(l, list, n, energy);
        else if (filled) {
            for (int k = 0; k < n; k++)
                for (int d = 0; d < dim; d++) {
                    list[k].safe[d] = list[k].at[d];
                    list[k].at[d] = list[k].first[d];
                }
            group_brake(l, list, n, energy);
        }
    }
    for (int k = 0; k < n; k++) {
        const part *p = &list[k];
        for (int d = 0; d < dim; d++)
            result[dim * k + d] = l->frame[d] + p->at[d];
        if (p->now < 0)
            continue;
        l->mass[p->now] += p->mass;
        for (int d = 0; d < dim; d++) {
            l->momentum[dim * p->now + d] += p->mass * (l->frame[d] + p->at[d]);
            wanted[d] -= p->mass * p->at[d];
        }
    }
    for (int d = 0; d < dim; d++)
        l->lost[d] += wanted[d];
}

void silt_momentum_hand_on(const silt_memory *memory, const silt_mesh *mesh, silt_nodes *nodes, double density,
                           const double *mass, const double *debt, const double *v, const int *map, double lost[3]) {
    const int dim = silt_nodes_dim(nodes), n = memory->n_node;
    ledger l = {.memory = memory, .mesh = mesh, .nodes = nodes, .v = v, .density = density, .dim = dim};
    l.count = silt_borrow((size_t)n + 1, sizeof *l.count);
    l.origin = silt_borrow((size_t)nodes->count + 1, sizeof *l.origin);
    l.rest = silt_borrow((size_t)n + 1, sizeof *l.rest);
    l.mass = silt_borrow((size_t)nodes->count + 1, sizeof *l.mass);
    l.momentum = silt_borrow((size_t)(dim * nodes->count) + 1, sizeof *l.momentum);
    l.result = silt_borrow((size_t)(dim * memory->n_exchange) + 1, sizeof *l.result);
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
            *p = (part){.node = i, .now = map[i]};
            memcpy(p->v, v + dim * i, (size_t)dim * sizeof *p->v);
            p->old = density * share->before + l.rest[i] / l.count[i];
            p->mass = p->old + density * share->change;
            // cancellation leaves crumbs of either sign
            const double crumb = 1e-12 * density * (fabs(share->before) + fabs(share->change) + fabs(debt[i]));
            p->old = fabs(p->old) < crumb ? 0 : p->old;
            p->mass = p->now < 0 || fabs(p->mass) < crumb ? 0 : p->mass;
            part_freedom(&l, p);
        }
        group_hand_on(&l, list, count, l.result + dim * first);
    }
    // parts of negative mass (debts) could carry a node's mean away: it stays in the ball about its parts' velocities
    double *centre = silt_borrow((size_t)(dim * nodes->count) + 1, sizeof *centre);
    double *radius = silt_borrow((size_t)nodes->count + 1, sizeof *radius);
    for (int pass = 0; pass < 2; pass++)
        for (int k = 0; k < memory->n_exchange; k++) {
            const int i = memory->exchange[k].node, now = map[i];
            double square = 0;
            for (int d = 0; d < dim && now >= 0; d++)
                if (pass == 0)
                    centre[dim * now + d] += l.result[dim * k + d] / l.count[i];
                else
                    square += silt_square(l.result[dim * k + d] - centre[dim * now + d]);
            if (pass && now >= 0)
                radius[now] = silt_max(radius[now], sqrt(square));
        }
    for (int i = 0; i < nodes->count; i++) {
        double *at = nodes->v + dim * i, *p = l.momentum + dim * i, way[3];
        if (l.mass[i] > 0 && nodes->kind[i] == NODE_FLUID) {
            for (int d = 0; d < dim; d++)
                way[d] = p[d] / l.mass[i] - centre[dim * i + d];
            const double length = silt_length(dim, way), most = HAND_ROOM * radius[i], share = length > most ? most / length : 1;
            for (int d = 0; d < dim; d++)
                at[d] = centre[dim * i + d] + share * way[d];
        }
        for (int d = 0; d < dim; d++)
            l.lost[d] += p[d] - l.mass[i] * at[d];
    }
    silt_return(centre);
    silt_return(radius);
    for (int d = 0; d < 3; d++)
        lost[d] = d < dim ? l.lost[d] : 0;
    free(list);
    silt_return(l.count);
    silt_return(l.origin);
    silt_return(l.rest);
    silt_return(l.mass);
    silt_return(l.momentum);
    silt_return(l.result);
}
