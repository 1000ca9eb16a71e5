// exchange.c: grains in water: spreading and sampling, forces on both sides
#include "exchange.h"

#include "vector.h"

static const double exchange_negative = 0.1; // of a node's inertia: negative drag that is taken as a push
static const double kernel_reach = 6.0; // kernel widths in the plane; the kernel falls off with exp(-2 r/width)
static const double sweep_reach = 3.0;  // in space, where it falls off with exp(-(r/width)^2)
static const double solid_bound = 0.9;  // largest solid fraction in space
static const double flat_cell =
    0.05; // of its area: a cell flatter than this at the middle of the step counts as at its start

// ---------------------------------------------------------------- fields through the kernel

// Fields that pass the kernel together stand node by node in the kernel's order, one row more for nodes that it does not hold: what
// the grains read (velocity, pressure gradient), and what they spread (effective drag, this times the free velocity, flux of solid)
enum { GIVE_DRAG = 0, GIVE_FIELDS = NESTED_FIELDS, READ_MOST = 6, GIVE_MOST = 7 };
#define READ_FIELDS(D) ((D) == 3 ? 8 : 4) // of a row
#define READ_VELOCITY(k) (k)
#define READ_GRADIENT(D, k) ((D) + (k))
#define GIVE_PUSH(k) (1 + (k))
#define GIVE_FLUX(D, k) (1 + (D) + (k))

// what is written once and compiled for two and for three dimensions
#define EXCHANGE VECTOR_INLINE void
#define BY_DIM(e, kernel, ...) ((e)->dim == 3 ? kernel(3, ##__VA_ARGS__) : kernel(2, ##__VA_ARGS__))

// the water's velocity and pressure at the nodes that are looked at
EXCHANGE gather(const int D, const silt_exchange *e, const double *velocity, const double *pressure, double *out) {
    for (int k = 0; k < e->n_look; k++) {
        const int i = e->look[k];
        for (int d = 0; d < D; d++)
            out[(D + 1) * k + d] = velocity[D * i + d];
        out[(D + 1) * k + D] = pressure[i];
    }
}

static void exchange_gather(const silt_exchange *e, const double *velocity, const double *pressure, double *out) {
    BY_DIM(e, gather, e, velocity, pressure, out);
}

EXCHANGE midpoint(const int D, const silt_exchange *e, double dt) {
    for (int k = 0; k < e->n_look; k++)
        for (int d = 0; d < D; d++)
            e->middle[D * k + d] = e->rest[D * k + d] + 0.5 * dt * e->seen[(D + 1) * k + d];
}

// nodes at the middle of the step, where the water's forces see them, for the velocity that was seen last
static void exchange_midpoint(silt_exchange *e, double dt) { BY_DIM(e, midpoint, e, dt); }

// edges of a cell, from the first corner, the shortest way across a periodic border
EXCHANGE edges(const int D, const silt_exchange *e, const double *x, const int *at, double edge[3][3]) {
    const double period = e->mesh->period[0];
    for (int a = 0; a < 3; a++) {
        // in the plane the third one is that across from the first corner
        const int from = at[D == 2 && a == 2 ? 1 : 0], to = at[D == 2 && a == 2 ? 2 : a + 1];
        for (int d = 0; d < D; d++)
            edge[a][d] = x[D * to + d] - x[D * from + d];
        if (period > 0.0)
            edge[a][0] -= period * floor(edge[a][0] / period + 0.5);
    }
}

// what a third (a quarter) of the cell's area (volume) makes of its shape functions' gradients, at the edges given
EXCHANGE gradients(const int D, double u[3][3], double slope[4][3]) {
    if (D == 2) {
        slope[1][0] = u[1][1] / 6.0;
        slope[1][1] = -u[1][0] / 6.0;
        slope[2][0] = -u[0][1] / 6.0;
        slope[2][1] = u[0][0] / 6.0;
        slope[0][0] = -u[2][1] / 6.0;
        slope[0][1] = u[2][0] / 6.0;
    }
    for (int a = 0; a < 3 && D == 3; a++) {
        const double *p = u[(a + 1) % 3], *q = u[(a + 2) % 3];
        slope[a + 1][0] = (p[1] * q[2] - p[2] * q[1]) / 24.0;
        slope[a + 1][1] = (p[2] * q[0] - p[0] * q[2]) / 24.0;
        slope[a + 1][2] = (p[0] * q[1] - p[1] * q[0]) / 24.0;
    }
}

// A third (a quarter) of the cell's area (volume) times the gradients of its shape functions at the middle of the step, as the
// water has them (silt_assemble_geometry): in space with a third of those of the way from the start to there. (Kept for all cells
// they take as long to read as to make: 10k grains, 2 % of a step.)
EXCHANGE exchange_slope(const int D, const silt_exchange *e, const exchange_cell *cell, double slope[4][3]) {
    double u[3][3];
    edges(D, e, e->middle, cell->at, u);
    if (D == 2) {
        if (!(u[0][0] * u[1][1] - u[0][1] * u[1][0] >= cell->least))
            edges(D, e, e->rest, cell->at, u);
        gradients(D, u, slope);
    } else {
        double start[3][3], more[4][3];
        gradients(D, u, slope);
        edges(D, e, e->rest, cell->at, start);
        for (int a = 0; a < 3; a++)
            for (int d = 0; d < 3; d++)
                u[a][d] -= start[a][d];
        gradients(D, u, more);
        for (int a = 1; a <= 3; a++)
            for (int d = 0; d < 3; d++)
                slope[a][d] += more[a][d] / 3.0;
    }
    for (int d = 0; d < 3 && D == 3; d++)
        slope[0][d] = -(slope[1][d] + slope[2][d] + slope[3][d]);
}

EXCHANGE smooth(const int D, silt_exchange *e, const double *water) {
    const int n_field = READ_FIELDS(D);
    double *read = e->read;
    for (int m = 0; m < e->kernel.n_node; m++) {
        double *row = read + n_field * m;
        for (int k = 0; k < n_field; k++)
            row[k] = k < D ? e->volume[m] * water[(D + 1) * m + k] : 0.0;
    }
    // nodes that the kernel does not hold
    memset(read + n_field * e->kernel.n_node, 0, (size_t)(n_field * (e->n_look + 1 - e->kernel.n_node)) * sizeof *read);
    for (int m = 0; m < e->kernel.n_near; m++) {
        const exchange_cell *cell = &e->cell[m];
        double slope[4][3], sum[3];
        exchange_slope(D, e, cell, slope);
        for (int k = 0; k < D; k++) {
            sum[k] = slope[0][k] * water[(D + 1) * cell->at[0] + D];
            for (int a = 1; a <= D; a++)
                sum[k] += slope[a][k] * water[(D + 1) * cell->at[a] + D];
        }
        for (int a = 0; a <= D; a++)
            for (int k = 0; k < D; k++)
                read[n_field * cell->at[a] + READ_GRADIENT(D, k)] += sum[k];
    }
    silt_kernel_sample(&e->kernel, n_field, read);
}

void silt_exchange_slope(const silt_exchange *e, int near, double slope[4][3]) { BY_DIM(e, exchange_slope, e, &e->cell[near], slope); }

// Velocity and pressure gradient as grains feel them: sum_i w_ip u_i is the value of H^-1 M u at a grain, and that of
// H^-1 sum_e A_e/3 grad p_e the gradient. One solve for both. water: velocity and pressure at the nodes that are looked at
static void exchange_smooth(silt_exchange *e, const double *water) { BY_DIM(e, smooth, e, water); }

// ---------------------------------------------------------------- parts of a step

// the rows of the kernel that a grain has to do with
static void exchange_rows(const silt_exchange *e, const silt_exchange_grain *g, int place[4], double weight[4]) {
    const int D = e->dim, *node = e->mesh->cell[g->cell];
    for (int a = 0; a <= D; a++) {
        place[a] = e->layer_grain > 0.0 ? 0 : e->kernel.place[node[a]];
        weight[a] = e->layer_grain > 0.0 ? 0.0 : g->weight[a];
    }
    if (e->layer_grain > 0.0) {
        place[0] = silt_kernel_layer(&e->kernel, g->x[D - 1], &weight[1]);
        place[1] = place[0] + 1;
        weight[0] = 1.0 - weight[1];
    }
}

// what does not change within a step, of grains in the water in groups of eight
static void exchange_pack(silt_exchange *e, double dt) {
    const int D = e->dim;
    SILT_RESERVE(e->group, e->group_capacity, e->n_wet / DRAG_GROUP + 1);
    e->n_group = (e->n_wet + DRAG_GROUP - 1) / DRAG_GROUP;
    for (int m = 0; m < e->n_group; m++) {
        exchange_group *to = &e->group[m];
        double diameter[DRAG_GROUP], number[DRAG_GROUP], solid[DRAG_GROUP];
        for (int i = 0; i < DRAG_GROUP; i++) {
            // the last group is filled up with the last grain, which weighs nothing there
            const bool idle = DRAG_GROUP * m + i >= e->n_wet;
            const silt_exchange_grain *g = &e->grain[e->wet[idle ? e->n_wet - 1 : DRAG_GROUP * m + i]];
            const int *node = e->mesh->cell[g->cell];
            solid[i] = 0.0;
            exchange_rows(e, g, to->place[i], to->weight[i]);
            for (int a = 0; a <= D; a++) {
                to->weight[i][a] = idle ? 0.0 : to->weight[i][a];
                solid[i] += g->weight[a] * e->solid[node[a]];
            }
            diameter[i] = g->diameter;
            number[i] = idle ? 0.0 : g->number;
            to->pace[i] = g->held ? 0.0 : dt / g->mass;
            to->solid[i] = idle ? 0.0 : g->immersed;
            for (int k = 0; k < D; k++) {
                to->v[k][i] = g->v[k];
                to->gust[k][i] = e->gusts ? g->gust[k] : 0.0;
                to->start[k][i] = g->v[k] + (g->held ? 0.0 : dt * e->gravity[k] + to->pace[i] * g->contact[k]);
            }
        }
        silt_drag_numbers(e->law, e->density, e->viscosity, diameter, number, solid, to->number);
        if (silt_forces_on(&e->force))
            silt_force_pack(e, m, dt);
    }
}

// what grains feel of the smoothed fields
EXCHANGE feel(const int D, const double *read, const exchange_group *g, eight felt[READ_MOST]) {
    double *out = (double *)felt;
    for (int i = 0; i < DRAG_GROUP; i++) {
        if (D == 2) {
            four sum = {0.0};
            for (int a = 0; a < 3; a++)
                sum += g->weight[i][a] * *(const four *)(read + 4 * g->place[i][a]);
            for (int k = 0; k < 4; k++)
                out[DRAG_GROUP * k + i] = sum[k];
        } else {
            eight sum = {0.0};
            for (int a = 0; a < 4; a++)
                sum += g->weight[i][a] * *(const eight *)(read + 8 * g->place[i][a]);
            for (int k = 0; k < 6; k++)
                out[DRAG_GROUP * k + i] = sum[k];
        }
    }
}

VECTOR_INLINE eight square_of(const int D, const eight *v) {
    eight sum = v[0] * v[0] + v[1] * v[1];
    if (D == 3)
        sum += v[2] * v[2];
    return sum;
}

EXCHANGE give(const int D, silt_exchange *e, bool renew) {
    const bool more = silt_forces_on(&e->force);
    for (int m = 0; m < e->n_group; m++) {
        exchange_group *g = &e->group[m];
        eight felt[READ_MOST], *v = (eight *)g->v, *start = (eight *)g->start, *free_v = (eight *)g->free;
        eight *effective = (eight *)g->effective, *factor = (eight *)g->factor, out[GIVE_MOST];
        const eight *gust = (const eight *)g->gust;
        const eight pace = *(eight *)g->pace, solid = *(eight *)g->solid;
        feel(D, e->read, g, felt);
        if (renew) {
            eight u[3];
            for (int k = 0; k < D; k++)
                u[k] = felt[READ_VELOCITY(k)] + gust[k] - v[k];
            const eight square = square_of(D, u);
            silt_drag_group(e->law, (const double(*)[DRAG_GROUP])g->number, (const double *)&square, g->factor);
            *effective = *factor / (1.0 + pace * *factor);
        }
        out[GIVE_DRAG] = *effective;
        for (int k = 0; k < D; k++) {
            free_v[k] = start[k] - pace * solid * felt[READ_GRADIENT(D, k)];
            const eight force = *effective * (felt[READ_VELOCITY(k)] + gust[k] - free_v[k]), end = free_v[k] + pace * force;
            out[GIVE_PUSH(k)] = *effective * (free_v[k] - gust[k]);
            out[GIVE_FLUX(D, k)] = solid * (v[k] + end) / 2.0;
        }
        if (more)
            silt_force_give(e, m, (const double *)felt, (double *)out);
        for (int i = 0; i < DRAG_GROUP; i++) {
            eight one = {out[0][i], out[1][i], out[2][i], out[3][i], out[4][i]};
            for (int k = 5; k < 1 + 2 * D; k++)
                one[k] = out[k][i];
            for (int a = 0; a <= D; a++)
                *(eight *)(e->give + GIVE_FIELDS * g->place[i][a]) += g->weight[i][a] * one;
        }
    }
}

VECTOR_CLONES static void exchange_give_plane(silt_exchange *e, bool renew) { give(2, e, renew); }

VECTOR_CLONES static void exchange_give_space(silt_exchange *e, bool renew) { give(3, e, renew); }

// Free velocity and drag of every grain, with new coefficients when `renew`; what it gives is added to the nodes. Eight grains at a
// time: ten thousand take 0.3 ms, one by one 0.7 ms.
static void exchange_give(silt_exchange *e, bool renew) {
    e->dim == 3 ? exchange_give_space(e, renew) : exchange_give_plane(e, renew);
}

EXCHANGE force(const int D, silt_exchange *e, silt_exchange_totals *t) {
    const bool more = silt_forces_on(&e->force);
    eight drag_sum[3] = {{0.0}}, pressure_sum[3] = {{0.0}}, size = {0.0};
    for (int m = 0; m < e->n_group; m++) {
        const exchange_group *g = &e->group[m];
        const eight *free_v = (const eight *)g->free, *gust = (const eight *)g->gust;
        const eight effective = *(const eight *)g->effective, solid = *(const eight *)g->solid;
        eight felt[READ_MOST], drag[3], pressure[3];
        feel(D, e->read, g, felt);
        for (int k = 0; k < D; k++) {
            pressure[k] = -solid * felt[READ_GRADIENT(D, k)];
            drag[k] = effective * (felt[READ_VELOCITY(k)] + gust[k] - free_v[k]);
            if (more)
                drag[k] = *(const eight *)e->force.group[m].coefficient * felt[READ_VELOCITY(k)] -
                          *(const eight *)e->force.group[m].push[k];
            drag_sum[k] += drag[k];
            pressure_sum[k] += pressure[k];
        }
        size += eight_root(square_of(D, drag)) + eight_root(square_of(D, pressure));
        for (int i = 0; i < DRAG_GROUP && DRAG_GROUP * m + i < e->n_wet; i++) {
            silt_exchange_grain *to = &e->grain[e->wet[DRAG_GROUP * m + i]];
            to->effective = effective[i];
            for (int k = 0; k < D; k++) {
                to->water[k] = felt[READ_VELOCITY(k)][i];
                to->free[k] = free_v[k][i];
                to->pressure[k] = pressure[k][i];
                to->force[k] = drag[k][i] + pressure[k][i];
            }
            for (int k = 0; k < (more ? 3 : 0); k++)
                to->torque[k] = 0.0;
            for (int k = D == 3 ? 0 : 2; k < (e->force.def.spin ? 3 : 0); k++)
                to->torque[k] = e->force.group[m].torque[D == 3 ? k : 0][i];
        }
    }
    for (int i = 0; i < DRAG_GROUP; i++) {
        t->size += size[i];
        for (int k = 0; k < D; k++) {
            t->drag[k] += drag_sum[k][i];
            t->pressure[k] += pressure_sum[k][i];
        }
    }
}

VECTOR_CLONES static void exchange_force_plane(silt_exchange *e, silt_exchange_totals *t) { force(2, e, t); }

VECTOR_CLONES static void exchange_force_space(silt_exchange *e, silt_exchange_totals *t) { force(3, e, t); }

// forces on all grains in the water, eight at a time, and their sums
static void exchange_force(silt_exchange *e, silt_exchange_totals *t) {
    e->dim == 3 ? exchange_force_space(e, t) : exchange_force_plane(e, t);
}

EXCHANGE source(const int D, silt_exchange *e) {
    const double *flux = e->give + GIVE_FLUX(D, 0);
    memset(e->flow, 0, (size_t)e->n_look * sizeof *e->flow);
    for (int m = 0; m < e->kernel.n_near; m++) {
        const exchange_cell *cell = &e->cell[m];
        double slope[4][3], sum[3];
        exchange_slope(D, e, cell, slope);
        for (int k = 0; k < D; k++) {
            sum[k] = flux[GIVE_FIELDS * cell->at[0] + k];
            for (int a = 1; a <= D; a++)
                sum[k] += flux[GIVE_FIELDS * cell->at[a] + k];
        }
        for (int a = 0; a <= D; a++) {
            double flow = slope[a][0] * sum[0];
            for (int k = 1; k < D; k++)
                flow += slope[a][k] * sum[k];
            e->flow[cell->at[a]] += flow;
        }
    }
    for (int k = 0; k < e->n_look; k++)
        e->source[e->look[k]] = e->flow[k];
}

// source_j = integral of grad N_j . s, s the smoothed flux of solid at the middle of the step
static void exchange_source(silt_exchange *e) { BY_DIM(e, source, e); }

// True when the last update saw this velocity and pressure at all nodes that it looks at: what it found stands. The water's first
// iterate is what the step began with, one update in five.
static bool exchange_seen(silt_exchange *e, const double *velocity, const double *pressure) {
    double *before = e->seen;
    e->seen = e->spare;
    e->spare = before;
    exchange_gather(e, velocity, pressure, e->seen);
    return memcmp(before, e->seen, (size_t)((e->dim + 1) * e->n_look) * sizeof *before) == 0;
}

// What the nodes get of the smoothed fields. In space the kernel is not positive: beside much heavier ones a node of a thin film may get
// less drag than none, and inertia below none with it. Such drag is a push at the iterate's velocity, the same at the last iterate.
static void exchange_take(silt_exchange *e, const double *velocity, double dt) {
    const int D = e->dim;
    for (int m = 0; m < e->kernel.n_node; m++) {
        const int i = e->kernel.node[m];
        const double *row = e->give + GIVE_FIELDS * m;
        e->coefficient[i] = e->volume[m] * row[GIVE_DRAG];
        for (int k = 0; k < D; k++)
            e->push[D * i + k] = e->volume[m] * row[GIVE_PUSH(k)];
        if (D == 3 && e->coefficient[i] * dt < -exchange_negative * e->density * e->volume[m]) {
            for (int k = 0; k < D; k++)
                e->push[D * i + k] -= e->coefficient[i] * velocity[D * i + k];
            e->coefficient[i] = 0.0;
        }
    }
}

// silt_drag's update: coefficient, push and source for an iterate of the water's velocity and pressure. Two solves, of all
// fields that can be made together, and one pass over the grains between them. (To let an update that changed the drag by less than
// a thousandth be the step's last spares a tenth of the coupling, but the temple's run then broke off at 9 s, three times of three.)
static void exchange_update(void *self, const double *velocity, const double *pressure, double dt) {
    silt_exchange *e = self;
    const bool fresh = dt != e->dt, seen = exchange_seen(e, velocity, pressure);
    if (!fresh && seen)
        return;
    if (fresh)
        exchange_pack(e, dt);
    exchange_midpoint(e, dt);
    exchange_smooth(e, e->seen);
    if (silt_forces_sheared(&e->force))
        silt_force_fields(e);
    memset(e->give, 0, GIVE_FIELDS * ((size_t)e->n_row + 1) * sizeof *e->give);
    exchange_give(e, e->refresh || fresh);
    silt_kernel_spread(&e->kernel, GIVE_FIELDS, e->give);
    exchange_take(e, velocity, dt);
    if (e->force.def.spin)
        silt_force_couple(e);
    exchange_source(e);
    e->dt = dt;
}

// ---------------------------------------------------------------- the step

// the grains in the water, and the corners of their cells
static void exchange_mark(silt_exchange *e) {
    const silt_mesh *mesh = e->mesh;
    memset(e->chosen, 0, (size_t)mesh->n_node);
    SILT_RESERVE(e->wet, e->wet_capacity, e->n_grain);
    e->n_wet = 0;
    for (int p = 0; p < e->n_grain; p++) {
        const int c = e->grain[p].cell;
        if (c < 0)
            continue;
        e->wet[e->n_wet++] = p;
        for (int a = 0; a <= e->dim; a++)
            e->chosen[mesh->cell[c][a]] = 1;
    }
}

// Nodes within reach of the grains' cells: what stands farther off hears e^-12 of a grain. Nothing of the exchange is done for the others (ten
// thousand grains in a third of a tank: half of the nodes, and a third of the time for the factor). The kernel closes
// whatever the choice is.
static void exchange_choose_plane(silt_exchange *e) {
    const silt_mesh *mesh = e->mesh;
    const double reach = kernel_reach * e->width, most = 4.0 * mesh->n_node + 64;
    double lo[2] = {HUGE_VAL, HUGE_VAL}, hi[2] = {-HUGE_VAL, -HUGE_VAL}, size = reach / 8.0;
    for (int i = 0; i < mesh->n_node; i++)
        for (int k = 0; k < 2 && e->chosen[i]; k++) {
            lo[k] = silt_min(lo[k], e->x[2 * i + k] - reach);
            hi[k] = silt_max(hi[k], e->x[2 * i + k] + reach);
        }
    while ((hi[0] - lo[0]) / size * ((hi[1] - lo[1]) / size) > most)
        size *= 1.5;

    // a grid over their nodes: those near it are counted in squares of bins by sums along rows, then columns
    const int wide = (int)ceil(reach / size), n[2] = {(int)((hi[0] - lo[0]) / size) + 1, (int)((hi[1] - lo[1]) / size) + 1};
    SILT_RESERVE(e->bin, e->bin_capacity, 2 * n[0] * n[1]);
    int *count = e->bin, *rows = e->bin + n[0] * n[1];
    memset(count, 0, (size_t)(n[0] * n[1]) * sizeof *count);
    for (int i = 0; i < mesh->n_node; i++)
        if (e->chosen[i])
            count[(int)((e->x[2 * i + 1] - lo[1]) / size) * n[0] + (int)((e->x[2 * i] - lo[0]) / size)] = 1;
    for (int j = 0; j < n[1]; j++)
        for (int i = 0, sum = 0; i < n[0] + wide; i++) {
            sum += i < n[0] ? count[j * n[0] + i] : 0;
            sum -= i > 2 * wide ? count[j * n[0] + i - 2 * wide - 1] : 0;
            if (i >= wide)
                rows[j * n[0] + i - wide] = sum > 0;
        }
    for (int i = 0; i < n[0]; i++)
        for (int j = 0, sum = 0; j < n[1] + wide; j++) {
            sum += j < n[1] ? rows[j * n[0] + i] : 0;
            sum -= j > 2 * wide ? rows[(j - 2 * wide - 1) * n[0] + i] : 0;
            if (j >= wide)
                count[(j - wide) * n[0] + i] = sum > 0;
        }
    for (int i = 0; i < mesh->n_node; i++) {
        const double at[2] = {(e->x[2 * i] - lo[0]) / size, (e->x[2 * i + 1] - lo[1]) / size};
        if (mesh->wet[i] && at[0] >= 0.0 && at[1] >= 0.0 && at[0] < n[0] && at[1] < n[1])
            e->chosen[i] |= count[(int)at[1] * n[0] + (int)at[0]] > 0;
    }
}

// The same from neighbour to neighbour, each with a place among the grains' corners that it was reached from: in space, and across
// a periodic border
static void exchange_choose_along(silt_exchange *e, double reach) {
    const silt_mesh *mesh = e->mesh;
    const int D = e->dim;
    const double period = mesh->period[0];
    SILT_RESERVE(e->look, e->look_capacity[0], mesh->n_node);
    SILT_RESERVE(e->bin, e->bin_capacity, mesh->n_node);
    int n = 0;
    for (int i = 0; i < mesh->n_node; i++)
        if (e->chosen[i]) {
            e->bin[n] = i;
            e->look[n++] = i;
        }
    for (int k = 0; k < n; k++) {
        const int i = e->look[k];
        for (int m = mesh->neighbour_start[i]; m < mesh->neighbour_start[i + 1]; m++) {
            const int j = mesh->neighbour[m];
            double square = 0.0;
            for (int d = 0; d < D && !e->chosen[j]; d++) {
                double way = e->x[D * j + d] - e->x[D * e->bin[k] + d];
                if (d == 0 && period > 0.0)
                    way -= period * floor(way / period + 0.5);
                square += way * way;
            }
            if (e->chosen[j] || square > reach * reach)
                continue;
            e->chosen[j] = 1;
            e->bin[n] = e->bin[k];
            e->look[n++] = j;
        }
    }
}

static void exchange_choose(silt_exchange *e) {
    exchange_mark(e);
    if (e->n_wet > 0 && e->layer_grain > 0.0)
        memcpy(e->chosen, e->mesh->wet, (size_t)e->mesh->n_node);
    else if (e->n_wet > 0 && (e->dim == 3 || e->mesh->period[0] > 0.0))
        exchange_choose_along(e, (e->dim == 3 ? sweep_reach : kernel_reach) * e->width);
    else if (e->n_wet > 0)
        exchange_choose_plane(e);
}

// The nodes of all cells near: those of the kernel in its order, then the others; what an update needs of them stands together
static void exchange_look(silt_exchange *e) {
    const silt_kernel *kernel = &e->kernel;
    const silt_mesh *mesh = e->mesh;
    SILT_RESERVE(e->look, e->look_capacity[0], mesh->n_node);
    SILT_RESERVE(e->cell, e->cell_capacity, kernel->n_near);
    e->n_look = kernel->n_node;
    memcpy(e->look, kernel->node, (size_t)kernel->n_node * sizeof *e->look);
    int *at = e->index;
    memcpy(at, kernel->place, (size_t)mesh->n_node * sizeof *at);
    const int D = e->dim;
    for (int m = 0; m < kernel->n_near; m++) {
        for (int a = 0; a <= D; a++) {
            const int i = mesh->cell[kernel->near[m]][a];
            if (at[i] == kernel->n_node && !e->chosen[i]) {
                e->chosen[i] = 1;
                at[i] = e->n_look;
                e->look[e->n_look++] = i;
            }
            e->cell[m].at[a] = at[i];
        }
        e->cell[m].least = 2.0 * flat_cell * kernel->area[kernel->near[m]];
    }
    SILT_RESERVE(e->rest, e->look_capacity[1], D * e->n_look);
    SILT_RESERVE(e->seen, e->look_capacity[2], (D + 1) * e->n_look);
    SILT_RESERVE(e->spare, e->look_capacity[3], (D + 1) * e->n_look);
    SILT_RESERVE(e->flow, e->look_capacity[4], e->n_look);
    SILT_RESERVE(e->volume, e->look_capacity[5], e->n_look);
    SILT_RESERVE(e->middle, e->look_capacity[6], D * e->n_look);
    for (int k = 0; k < e->n_look; k++) {
        memcpy(e->rest + D * k, e->x + D * e->look[k], (size_t)D * sizeof *e->rest);
        e->volume[k] = kernel->volume[e->look[k]];
    }
}

// the same in layers, with room that what is read has no use for yet
static void exchange_solid_layers(silt_exchange *e) {
    memset(e->read, 0, ((size_t)e->n_row + 1) * sizeof *e->read);
    for (int p = 0; p < e->n_wet; p++) {
        const silt_exchange_grain *g = &e->grain[e->wet[p]];
        int place[4];
        double weight[4];
        exchange_rows(e, g, place, weight);
        for (int a = 0; a < 2; a++)
            e->read[place[a]] += weight[a] * g->immersed;
    }
    silt_kernel_spread(&e->kernel, 1, e->read);
    for (int m = 0; m < e->kernel.n_node; m++)
        e->solid[e->kernel.node[m]] = e->read[m];
}

// solid fraction
static void exchange_solid(silt_exchange *e) {
    const silt_mesh *mesh = e->mesh;
    memset(e->solid, 0, (size_t)e->n_node * sizeof *e->solid);
    if (e->layer_grain > 0.0) {
        exchange_solid_layers(e);
        return;
    }
    for (int p = 0; p < e->n_wet; p++) {
        const silt_exchange_grain *g = &e->grain[e->wet[p]];
        for (int a = 0; a <= e->dim; a++)
            e->solid[mesh->cell[g->cell][a]] += g->weight[a] * g->immersed;
    }
    silt_kernel_smooth(&e->kernel, e->solid);
}

// Where there is more solid than room for it, in drops of spray that are smaller than a grain, the grains are but half in the water:
// more than this share turned the water's pressure round, and shot the drop away. @return whether any is
static bool exchange_bound(silt_exchange *e) {
    bool any = false;
    for (int p = 0; p < e->n_wet; p++) {
        silt_exchange_grain *g = &e->grain[e->wet[p]];
        double solid = 0.0;
        for (int a = 0; a <= e->dim; a++)
            solid += g->weight[a] * e->solid[e->mesh->cell[g->cell][a]];
        if (solid <= solid_bound)
            continue;
        g->immersed *= solid_bound / solid;
        any = true;
    }
    return any;
}

// true when mesh and grains stand where they stood at the last place
bool silt_exchange_stands(const silt_exchange *e, const silt_nodes *nodes, const silt_mesh *mesh) {
    return e->placed && e->mesh == mesh && e->revision == mesh->revision && e->n_node == mesh->n_node &&
           e->n_placed_cell == mesh->n_cell &&
           memcmp(e->placed_x, nodes->x, (size_t)(e->dim * mesh->n_node) * sizeof *e->placed_x) == 0;
}

silt_status silt_exchange_place(silt_exchange *e, const silt_nodes *nodes, const silt_mesh *mesh, silt_error *err) {
    const int n = mesh->n_node, D = mesh->dim == 3 ? 3 : 2;
    e->placed = false;
    e->dim = D;
    e->mesh = mesh;
    e->x = nodes->x;
    e->n_node = n;
    SILT_RESERVE(e->solid, e->node_capacity[0], n);
    SILT_RESERVE(e->coefficient, e->node_capacity[1], n);
    SILT_RESERVE(e->push, e->node_capacity[2], D * n);
    SILT_RESERVE(e->source, e->node_capacity[3], n);
    SILT_RESERVE(e->chosen, e->node_capacity[6], n);
    SILT_RESERVE(e->index, e->node_capacity[8], n);
    SILT_RESERVE(e->placed_x, e->node_capacity[7], D * n);
    exchange_choose(e);
    SILT_TRY(silt_kernel_build(&e->kernel, mesh, nodes->x, e->chosen, e->width, e->layer_grain, err));
    exchange_look(e);
    e->n_row = silt_kernel_rows(&e->kernel) > e->n_look ? silt_kernel_rows(&e->kernel) : e->n_look;
    SILT_RESERVE(e->read, e->node_capacity[4], READ_FIELDS(D) * (e->n_row + 1));
    SILT_RESERVE(e->give, e->node_capacity[5], GIVE_FIELDS * (e->n_row + 1));

    for (int p = 0; p < e->n_wet; p++)
        e->grain[e->wet[p]].immersed = e->grain[e->wet[p]].solid;
    exchange_solid(e);
    if (D == 3 && exchange_bound(e))
        exchange_solid(e);
    e->drag = (silt_drag){.solid = e->solid,
                          .coefficient = e->coefficient,
                          .push = e->push,
                          .source = e->source,
                          .update = exchange_update,
                          .self = e};
    memcpy(e->placed_x, nodes->x, (size_t)(D * n) * sizeof *e->placed_x);
    e->revision = mesh->revision;
    e->n_placed_cell = mesh->n_cell;
    e->placed = true;
    return SILT_OK;
}

void silt_exchange_begin(silt_exchange *e, const silt_nodes *nodes, double dt) {
    e->x = nodes->x;
    memset(e->coefficient, 0, (size_t)e->n_node * sizeof *e->coefficient);
    memset(e->push, 0, (size_t)(e->dim * e->n_node) * sizeof *e->push);
    memset(e->source, 0, (size_t)e->n_node * sizeof *e->source);
    e->dt = NAN; // whatever dt is, the coefficients are of another step
    e->force.starting = true;
    exchange_update(e, nodes->v, nodes->p, dt);
    e->force.starting = false;
}

silt_status silt_exchange_prepare(silt_exchange *e, const silt_nodes *nodes, const silt_mesh *mesh, double dt,
                                  silt_error *err) {
    SILT_TRY(silt_exchange_place(e, nodes, mesh, err));
    silt_exchange_begin(e, nodes, dt);
    return SILT_OK;
}

void silt_exchange_load(silt_exchange *e, const double *velocity, const double *pressure, double dt, const double *middle) {
    const int D = e->dim;
    silt_exchange_totals *t = &e->totals;
    *t = (silt_exchange_totals){0};
    if (dt != e->dt) // the water was told of another step than it took: nothing to hold on to but the new one
        exchange_update(e, velocity, pressure, dt);
    // the pressure on the grains acts where the water's does: on the mesh of the last iterate
    exchange_midpoint(e, dt);
    for (int k = 0; k < e->n_look && middle; k++)
        memcpy(e->middle + D * k, middle + D * e->look[k], (size_t)D * sizeof *middle);
    exchange_gather(e, velocity, pressure, e->spare);
    for (int m = 0; m < e->n_look; m++)
        for (int k = 0, i = e->look[m]; k < D; k++)
            t->water[k] += e->push[D * i + k] - e->coefficient[i] * e->spare[(D + 1) * m + k];

    // drag as the water felt it: accepted velocity, free velocity of the last update
    exchange_smooth(e, e->spare);
    exchange_force(e, t);
}

void silt_exchange_clear(silt_exchange *e) {
    silt_kernel_clear(&e->kernel);
    silt_forces_clear(&e->force);
    free(e->grain);
    free(e->solid);
    free(e->coefficient);
    free(e->push);
    free(e->source);
    free(e->read);
    free(e->give);
    free(e->seen);
    free(e->spare);
    free(e->rest);
    free(e->middle);
    free(e->flow);
    free(e->volume);
    free(e->index);
    free(e->look);
    free(e->chosen);
    free(e->placed_x);
    free(e->bin);
    free(e->cell);
    free(e->wet);
    free(e->group);
    *e = (silt_exchange){0};
}
