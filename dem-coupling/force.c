// force.c: added mass, lift, viscous force and torque of the water on grains
#include "exchange.h"

#include "vector.h"

static const double least_curl = 1e-100; // 1/s, below which there is no direction of it
static const double saffman = 1.615;     // Saffman 1965 with the correction of 1968: 6.46/4

enum { FORCE_STRESS = 10 }; // numbers of a node's stress: 3 x 3 and what it is the mean over

static int force_dim(const silt_exchange *e) { return e->mesh->dim == 3 ? 3 : 2; }
static int force_row(int dim) { return dim == 3 ? 8 : 4; }
static int force_curls(int dim) { return dim == 3 ? 3 : 1; }

void silt_force_pack(silt_exchange *e, int m, double dt) {
    silt_forces *f = &e->force;
    const int D = force_dim(e), n_curl = force_curls(D);
    SILT_RESERVE(f->group, f->group_capacity, m + 1);
    exchange_group *group = &e->group[m];
    force_group *to = &f->group[m];
    f->dt = dt;
    for (int i = 0; i < DRAG_GROUP; i++) {
        const bool idle = DRAG_GROUP * m + i >= e->n_wet;
        const silt_exchange_grain *g = &e->grain[e->wet[idle ? e->n_wet - 1 : DRAG_GROUP * m + i]];
        const double number = idle ? 0.0 : g->number, d = g->diameter, inertia = g->mass * g->gyration * g->gyration;
        to->added[i] = idle ? 0.0 : f->def.added_mass * e->density * g->solid;
        to->share[i] = g->held ? 0.0 : to->added[i] / (g->mass + to->added[i]);
        to->own[i] = g->held ? 1.0 : g->mass / (g->mass + to->added[i]);
        group->pace[i] *= to->own[i];
        for (int k = 0; k < D; k++)
            group->start[k][i] = g->v[k] + (group->start[k][i] - g->v[k]) * to->own[i];
        to->lift[i] = saffman * d * d * number * sqrt(e->density * e->viscosity);
        to->twist[i] = M_PI * e->viscosity * d * d * d * number;
        to->yield[i] = g->held || !(inertia > 0.0) ? to->twist[i] : to->twist[i] / (1.0 + dt * to->twist[i] / inertia);
        for (int k = 0; k < n_curl; k++)
            to->spin[k][i] = g->spin[D == 3 ? k : 2];
    }
}

// ---------------------------------------------------------------- the water's shear

// the mean of the cells' gradients of the velocity around each node, d u_j/d x_k at 3 j + k; then the stress that they make
static void force_stress(silt_exchange *e, int D, const double *velocity) {
    silt_forces *f = &e->force;
    SILT_RESERVE(f->stress, f->stress_capacity, FORCE_STRESS * (e->n_look + 1));
    memset(f->stress, 0, FORCE_STRESS * (size_t)(e->n_look + 1) * sizeof *f->stress);
    for (int c = 0; c < e->kernel.n_near; c++) {
        const int *at = e->cell[c].at;
        double slope[4][3], sum[FORCE_STRESS] = {0.0};
        silt_exchange_slope(e, c, slope);
        for (int a = 0; a <= D; a++)
            for (int j = 0; j < D; j++)
                for (int k = 0; k < D; k++)
                    sum[3 * j + k] += slope[a][k] * velocity[(D + 1) * at[a] + j];
        sum[9] = e->kernel.area[e->kernel.near[c]] / (D + 1);
        for (int a = 0; a <= D; a++)
            for (int k = 0; k < FORCE_STRESS; k++)
                f->stress[FORCE_STRESS * at[a] + k] += sum[k];
    }
    for (int i = 0; i < e->n_look; i++) {
        double *t = f->stress + FORCE_STRESS * i, gradient[9];
        memcpy(gradient, t, sizeof gradient);
        const double mean = e->viscosity / t[9], spread = 2.0 / 3.0 * (gradient[0] + gradient[4] + gradient[8]);
        for (int j = 0; j < D; j++)
            for (int k = 0; k < D; k++)
                t[3 * j + k] = mean * (gradient[3 * j + k] + gradient[3 * k + j] - (j == k ? spread : 0.0));
    }
}

void silt_force_fields(silt_exchange *e) {
    silt_forces *f = &e->force;
    const int D = force_dim(e), n_row = force_row(D), n_curl = force_curls(D);
    const double *velocity = (const double *)e->seen;
    SILT_RESERVE(f->field, f->field_capacity, n_row * (e->n_row + 1));
    memset(f->field, 0, (size_t)(n_row * (e->n_row + 1)) * sizeof *f->field);
    if (f->def.viscous)
        force_stress(e, D, velocity);
    for (int c = 0; c < e->kernel.n_near; c++) {
        const int *at = e->cell[c].at;
        double slope[4][3], curl[3] = {0.0}, pull[3] = {0.0};
        silt_exchange_slope(e, c, slope);
        for (int a = 0; a <= D; a++) {
            const double *u = velocity + (D + 1) * at[a], *s = slope[a];
            curl[D == 3 ? 2 : 0] += s[0] * u[1] - s[1] * u[0];
            if (D == 3) {
                curl[0] += s[1] * u[2] - s[2] * u[1];
                curl[1] += s[2] * u[0] - s[0] * u[2];
            }
            for (int j = 0; j < D && f->def.viscous; j++)
                for (int k = 0; k < D; k++)
                    pull[j] += f->stress[FORCE_STRESS * at[a] + 3 * j + k] * s[k];
        }
        for (int a = 0; a <= D; a++) {
            double *row = f->field + n_row * at[a];
            for (int k = 0; k < n_curl; k++)
                row[k] += curl[k];
            for (int k = 0; k < D; k++)
                row[n_curl + k] += pull[k];
        }
    }
    silt_kernel_sample(&e->kernel, n_row, f->field);
}

// ---------------------------------------------------------------- eight grains

// a x b; in the plane b has its third component only, which stands first
VECTOR_INLINE void force_cross(const int D, const eight *a, const eight *b, eight *out) {
    if (D == 2) {
        out[0] = a[1] * b[0];
        out[1] = -a[0] * b[0];
    } else {
        out[0] = a[1] * b[2] - a[2] * b[1];
        out[1] = a[2] * b[0] - a[0] * b[2];
        out[2] = a[0] * b[1] - a[1] * b[0];
    }
}

// Lift L s x n of the slip s = u - v_end that it leaves, (1 + pace beta) s + pace L s x n = slip without drag and lift: any step is
// stable. n: direction of the curl
VECTOR_INLINE void force_lift(const int D, eight size, const eight *slip, const eight *curl, eight pace, eight factor, eight *lift) {
    eight square = curl[0] * curl[0], n[3], turned[3], s[3], along = 0.0 * size;
    if (D == 3)
        square += curl[1] * curl[1] + curl[2] * curl[2];
    const eight length = eight_most(eight_root(square), least_curl);
    for (int k = 0; k < (D == 3 ? 3 : 1); k++)
        n[k] = curl[k] / length;
    const eight strength = size * eight_root(length), a = 1.0 + pace * factor, b = pace * strength;
    force_cross(D, slip, n, turned);
    for (int k = 0; k < D && D == 3; k++)
        along += slip[k] * n[k];
    for (int k = 0; k < D; k++)
        s[k] = (a * slip[k] - b * turned[k] + (D == 3 ? b * b / a * along * n[k] : 0.0 * b)) / (a * a + b * b);
    force_cross(D, s, n, lift);
    for (int k = 0; k < D; k++)
        lift[k] *= strength;
}

VECTOR_INLINE void force_group_give(const int D, silt_exchange *e, int m, const eight *felt, eight *out) {
    const silt_force_def *def = &e->force.def;
    const double theta = def->theta > 0.0 ? def->theta : 1.0;
    exchange_group *g = &e->group[m];
    force_group *to = &e->force.group[m];
    const int n_row = D == 3 ? 8 : 4, n_curl = D == 3 ? 3 : 1;
    const eight pace = *(eight *)g->pace, effective = *(eight *)g->effective, factor = *(eight *)g->factor;
    const eight solid = *(eight *)g->solid, share = *(eight *)to->share, own = *(eight *)to->own, *v = (eight *)g->v;
    const eight *gust = (const eight *)g->gust;
    const eight rate = *(eight *)to->added / e->force.dt, carried = share / theta, *before = (eight *)to->before;
    eight *free_v = (eight *)g->free, *push = (eight *)to->push, shear[6] = {{0.0}};
    if (e->force.starting)
        memcpy(to->before, felt, (size_t)D * sizeof *felt);

    if (silt_forces_sheared(&e->force))
        for (int i = 0; i < DRAG_GROUP; i++)
            for (int k = 0; k < n_curl + D; k++) {
                double sum = 0.0;
                for (int a = 0; a <= D; a++)
                    sum += g->weight[i][a] * e->force.field[n_row * g->place[i][a] + k];
                shear[k][i] = sum;
            }
    eight given[3] = {{0.0}}, lift[3], slip[3];
    for (int k = 0; k < D; k++) {
        if (def->viscous)
            given[k] = solid * shear[n_curl + k];
        free_v[k] += pace * (given[k] - rate * before[k] / theta);
        slip[k] = (1.0 - carried) * felt[k] + gust[k] - free_v[k];
    }
    if (def->lift) {
        force_lift(D, *(eight *)to->lift, slip, shear, pace, factor, lift);
        for (int k = 0; k < D; k++) {
            given[k] += lift[k];
            free_v[k] += pace * lift[k];
        }
    }
    for (int k = 0; k < n_curl && def->spin; k++)
        ((eight *)to->torque)[k] = -*(eight *)to->yield * (((eight *)to->spin)[k] - 0.5 * shear[k]);

    // drag and added mass together, as a coefficient of the water's velocity and a rest; see docs/grains.md
    const eight coefficient = own * ((1.0 - carried) * effective + rate / theta);
    *(eight *)to->coefficient = out[0] = coefficient;
    for (int k = 0; k < D; k++) {
        push[k] = own * effective * (free_v[k] - gust[k]) + rate * (before[k] / theta + free_v[k] - v[k]) - given[k];
        const eight end = free_v[k] + carried * felt[k] + pace * effective * ((1.0 - carried) * felt[k] + gust[k] - free_v[k]);
        out[1 + k] = push[k];
        out[1 + D + k] = solid * (v[k] + end) / 2.0;
    }
}

VECTOR_CLONES static void force_give_plane(silt_exchange *e, int m, const double *felt, double *out) {
    force_group_give(2, e, m, (const eight *)felt, (eight *)out);
}

VECTOR_CLONES static void force_give_space(silt_exchange *e, int m, const double *felt, double *out) {
    force_group_give(3, e, m, (const eight *)felt, (eight *)out);
}

void silt_force_give(silt_exchange *e, int m, const double *felt, double *out) {
    if (force_dim(e) == 3)
        force_give_space(e, m, felt, out);
    else
        force_give_plane(e, m, felt, out);
}

// ---------------------------------------------------------------- torque on the water

void silt_force_couple(silt_exchange *e) {
    silt_forces *f = &e->force;
    const int D = force_dim(e), n_row = 4, n_curl = force_curls(D);
    const double *x = (const double *)e->middle;
    SILT_RESERVE(f->field, f->field_capacity, n_row * (e->n_row + 1));
    memset(f->field, 0, (size_t)(n_row * (e->n_row + 1)) * sizeof *f->field);
    for (int m = 0; m < e->n_group; m++)
        for (int i = 0; i < DRAG_GROUP; i++)
            for (int a = 0; a <= D; a++)
                for (int k = 0; k < n_curl; k++)
                    f->field[n_row * e->group[m].place[i][a] + k] -= e->group[m].weight[i][a] * f->group[m].torque[k][i];
    silt_kernel_spread(&e->kernel, n_row, f->field);
    memset(f->field + n_row * e->kernel.n_node, 0, (size_t)(n_row * (e->n_look + 1 - e->kernel.n_node)) * sizeof *f->field);
    for (int k = e->kernel.n_node; k < e->n_look; k++)
        for (int d = 0; d < D; d++)
            e->push[D * e->look[k] + d] = 0.0;
    for (int c = 0; c < e->kernel.n_near; c++) {
        const int *at = e->cell[c].at;
        double slope[4][3], sum[3] = {0.0}, middle = 0.0;
        silt_exchange_slope(e, c, slope);
        // the density was spread over the cell as it is at the start of the step
        for (int a = 0; a <= D; a++)
            for (int k = 0; k < D; k++)
                middle += slope[a][k] * x[D * at[a] + k] / D;
        const double start = e->kernel.area[e->kernel.near[c]] / (D + 1), share = middle > 0.0 ? 0.5 * start / middle : 0.5;
        for (int a = 0; a <= D; a++)
            for (int k = 0; k < n_curl; k++)
                sum[k] += share * f->field[n_row * at[a] + k];
        for (int a = 0; a <= D; a++) {
            double *push = e->push + D * e->look[at[a]];
            const double *s = slope[a];
            if (D == 2) {
                push[0] -= sum[0] * s[1];
                push[1] += sum[0] * s[0];
                continue;
            }
            push[0] += sum[1] * s[2] - sum[2] * s[1];
            push[1] += sum[2] * s[0] - sum[0] * s[2];
            push[2] += sum[0] * s[1] - sum[1] * s[0];
        }
    }
}

void silt_forces_clear(silt_forces *forces) {
    free(forces->group);
    free(forces->field);
    free(forces->stress);
    *forces = (silt_forces){0};
}
