// exchange.c: grains in water: drag laws, spreading and sampling, forces on both sides
#include "exchange.h"

static const double solid_most = 0.75; // densest packing that the drag formulas are asked about
static const double flat_cell =
    0.05; // of its area: a cell flatter than this at the middle of the step counts as at its start

// ---------------------------------------------------------------- drag laws

double silt_drag_factor(silt_drag_law law, double density, double viscosity, double d, double solid, double w) {
    double porosity = 1.0 - silt_clamp(solid, 0.0, solid_most);
    switch (law) {
    case DRAG_SCHILLER_NAUMANN: {
        // Cd = 24/Re (1 + 0.15 Re^0.687) below Re = 1000, 0.44 above; beta = Cd pi d^2/8 rho w
        double re = density * w * d / viscosity;
        if (re >= 1000.0)
            return 0.44 * M_PI * d * d / 8.0 * density * w;
        return 3.0 * M_PI * viscosity * d * (1.0 + 0.15 * pow(re, 0.687));
    }
    case DRAG_DI_FELICE: {
        // Cd = (0.63 + 4.8/sqrt Re)^2, beta = Cd pi d^2/8 rho w eps^(2 - chi), chi = 3.7 - 0.65 exp(-(1.5 - lg
        // Re)^2/2); sqrt(Cd w) instead of Cd, so that a grain at rest has its Stokes limit
        double re = porosity * density * w * d / viscosity;
        double root = 0.63 * sqrt(w) + 4.8 * sqrt(viscosity / (porosity * density * d));
        double chi = re > 0.0 ? 3.7 - 0.65 * exp(-silt_square(1.5 - log10(re)) / 2.0) : 3.7;
        return root * root * M_PI * d * d / 8.0 * density * pow(porosity, 2.0 - chi);
    }
    default:
        return 0.0;
    }
}

// ---------------------------------------------------------------- fields through the kernel

// the value at a grain of component k of a field stored field by field
static double exchange_at(const silt_exchange *e, const silt_exchange_grain *g, const double *field, int k) {
    const int *node = e->mesh->cell[g->cell];
    const double *f = field + (size_t)k * (size_t)e->n_node;
    return g->weight[0] * f[node[0]] + g->weight[1] * f[node[1]] + g->weight[2] * f[node[2]];
}

static void exchange_spread(const silt_exchange *e, const silt_exchange_grain *g, double *field, int k, double amount) {
    const int *node = e->mesh->cell[g->cell];
    double *f = field + (size_t)k * (size_t)e->n_node;
    for (int a = 0; a < 3; a++)
        f[node[a]] += g->weight[a] * amount;
}

static void exchange_zero(silt_exchange *e, int n_field) {
    memset(e->field, 0, (size_t)n_field * (size_t)e->n_node * sizeof *e->field);
}

// cells at the middle of the step, as the water's forces see them
static void exchange_midpoint(silt_exchange *e, const double *velocity, double dt) {
    for (int c = 0; c < e->mesh->n_cell; c++) {
        double x[3][2];
        for (int a = 0; a < 3; a++)
            for (int k = 0; k < 2; k++) {
                int i = 2 * e->mesh->cell[c][a] + k;
                x[a][k] = e->x[i] + 0.5 * dt * velocity[i];
            }
        double twice = (x[1][0] - x[0][0]) * (x[2][1] - x[0][1]) - (x[1][1] - x[0][1]) * (x[2][0] - x[0][0]);
        if (!(twice / 2.0 >= flat_cell * e->kernel.area[c])) {
            e->area[c] = e->kernel.area[c];
            memcpy(e->gradient[c], e->kernel.gradient[c], sizeof e->gradient[c]);
            continue;
        }
        e->area[c] = twice / 2.0;
        for (int a = 0; a < 3; a++) {
            const double *p = x[(a + 1) % 3], *q = x[(a + 2) % 3];
            e->gradient[c][a][0] = (p[1] - q[1]) / twice;
            e->gradient[c][a][1] = (q[0] - p[0]) / twice;
        }
    }
}

// the water's velocity at the grains: sum_i w_ip u_i, the value of H^-1 M u there
static void exchange_sample(silt_exchange *e, const double *velocity) {
    for (int i = 0; i < e->n_node; i++)
        for (int k = 0; k < 2; k++)
            e->field[k * e->n_node + i] = e->kernel.volume[i] * velocity[2 * i + k];
    silt_kernel_solve(&e->kernel, 2, e->field);
    for (int p = 0; p < e->n_grain; p++)
        for (int k = 0; k < 2 && e->grain[p].cell >= 0; k++)
            e->grain[p].water[k] = exchange_at(e, &e->grain[p], e->field, k);
}

// field = H^-1 sum_e A_e/3 grad p_e, whose value at a grain is the pressure gradient that it feels
static void exchange_smooth_gradient(silt_exchange *e, const double *pressure) {
    exchange_zero(e, 2);
    for (int c = 0; c < e->mesh->n_cell; c++) {
        const int *node = e->mesh->cell[c];
        for (int k = 0; k < 2; k++) {
            double slope = 0.0;
            for (int a = 0; a < 3; a++)
                slope += e->gradient[c][a][k] * pressure[node[a]];
            for (int a = 0; a < 3; a++)
                e->field[k * e->n_node + node[a]] += e->area[c] / 3.0 * slope;
        }
    }
    silt_kernel_solve(&e->kernel, 2, e->field);
}

// ---------------------------------------------------------------- parts of a step

// drag coefficients of the grains and at the nodes, from the sampled velocity
static void exchange_coefficients(silt_exchange *e, double dt) {
    for (int p = 0; p < e->n_grain; p++) {
        silt_exchange_grain *g = &e->grain[p];
        if (g->cell < 0)
            continue;
        const int *node = e->mesh->cell[g->cell];
        double w = hypot(g->water[0] - g->v[0], g->water[1] - g->v[1]);
        double solid =
            g->weight[0] * e->solid[node[0]] + g->weight[1] * e->solid[node[1]] + g->weight[2] * e->solid[node[2]];
        g->drag_factor = g->number * silt_drag_factor(e->law, e->density, e->viscosity, g->diameter, solid, w);
        g->effective = g->drag_factor / (1.0 + dt * g->drag_factor / g->mass);
    }
    exchange_zero(e, 1);
    for (int p = 0; p < e->n_grain; p++)
        if (e->grain[p].cell >= 0)
            exchange_spread(e, &e->grain[p], e->field, 0, e->grain[p].effective);
    silt_kernel_solve(&e->kernel, 1, e->field);
    for (int i = 0; i < e->n_node; i++)
        e->coefficient[i] = e->kernel.volume[i] * e->field[i];
    e->dt = dt;
}

// pressure-gradient force and free velocity of the grains
static void exchange_free(silt_exchange *e, const double *pressure, double dt) {
    exchange_smooth_gradient(e, pressure);
    for (int p = 0; p < e->n_grain; p++) {
        silt_exchange_grain *g = &e->grain[p];
        for (int k = 0; k < 2 && g->cell >= 0; k++) {
            g->pressure[k] = -g->solid * exchange_at(e, g, e->field, k);
            g->free[k] = g->v[k] + dt * (e->gravity[k] + (g->pressure[k] + g->contact[k]) / g->mass);
        }
    }
}

// push: effective drag times free velocity at the nodes
static void exchange_push(silt_exchange *e) {
    exchange_zero(e, 2);
    for (int p = 0; p < e->n_grain; p++)
        for (int k = 0; k < 2 && e->grain[p].cell >= 0; k++)
            exchange_spread(e, &e->grain[p], e->field, k, e->grain[p].effective * e->grain[p].free[k]);
    silt_kernel_solve(&e->kernel, 2, e->field);
    for (int i = 0; i < e->n_node; i++)
        for (int k = 0; k < 2; k++)
            e->push[2 * i + k] = e->kernel.volume[i] * e->field[k * e->n_node + i];
}

// source_j = integral of grad N_j . s, s the smoothed flux of solid at the middle of the step; needs F_drag in force
static void exchange_source(silt_exchange *e, double dt) {
    exchange_zero(e, 2);
    for (int p = 0; p < e->n_grain; p++) {
        const silt_exchange_grain *g = &e->grain[p];
        for (int k = 0; k < 2 && g->cell >= 0; k++) {
            double end = g->free[k] + dt / g->mass * g->force[k];
            exchange_spread(e, g, e->field, k, g->solid * (g->v[k] + end) / 2.0);
        }
    }
    silt_kernel_solve(&e->kernel, 2, e->field);
    memset(e->source, 0, (size_t)e->n_node * sizeof *e->source);
    for (int c = 0; c < e->mesh->n_cell; c++) {
        const int *node = e->mesh->cell[c];
        for (int k = 0; k < 2; k++) {
            const double *s = e->field + k * e->n_node;
            double mean = (s[node[0]] + s[node[1]] + s[node[2]]) / 3.0;
            for (int a = 0; a < 3; a++)
                e->source[node[a]] += e->area[c] * e->gradient[c][a][k] * mean;
        }
    }
}

// silt_drag's update: push and source for an iterate of the water's velocity and pressure
static void exchange_update(void *self, const double *velocity, const double *pressure, double dt) {
    silt_exchange *e = self;
    exchange_midpoint(e, velocity, dt);
    exchange_sample(e, velocity);
    if (e->refresh || dt != e->dt)
        exchange_coefficients(e, dt);
    exchange_free(e, pressure, dt);
    exchange_push(e);
    for (int p = 0; p < e->n_grain; p++) {
        silt_exchange_grain *g = &e->grain[p];
        for (int k = 0; k < 2 && g->cell >= 0; k++)
            g->force[k] = g->effective * (g->water[k] - g->free[k]);
    }
    exchange_source(e, dt);
}

// ---------------------------------------------------------------- the step

silt_status silt_exchange_prepare(silt_exchange *e, const silt_nodes *nodes, const silt_mesh *mesh, double dt,
                                  silt_error *err) {
    int n = mesh->n_node;
    e->mesh = mesh;
    e->x = nodes->x;
    e->n_node = n;
    SILT_RESERVE(e->area, e->cell_capacity[0], mesh->n_cell);
    SILT_RESERVE(e->gradient, e->cell_capacity[1], mesh->n_cell);
    SILT_RESERVE(e->solid, e->node_capacity[0], n);
    SILT_RESERVE(e->coefficient, e->node_capacity[1], n);
    SILT_RESERVE(e->push, e->node_capacity[2], 2 * n);
    SILT_RESERVE(e->source, e->node_capacity[3], n);
    SILT_RESERVE(e->field, e->node_capacity[4], 2 * n);
    SILT_TRY(silt_kernel_build(&e->kernel, mesh, nodes->x, e->width, err));

    // solid fraction
    exchange_zero(e, 1);
    for (int p = 0; p < e->n_grain; p++) {
        silt_exchange_grain *g = &e->grain[p];
        g->drag_factor = g->effective = 0.0;
        for (int k = 0; k < 2; k++)
            g->free[k] = g->pressure[k] = g->force[k] = 0.0;
        if (g->cell >= 0)
            exchange_spread(e, g, e->field, 0, g->solid);
    }
    silt_kernel_solve(&e->kernel, 1, e->field);
    memcpy(e->solid, e->field, (size_t)n * sizeof *e->solid);

    exchange_sample(e, nodes->v);
    exchange_coefficients(e, dt);
    e->drag = (silt_drag){.solid = e->solid,
                          .coefficient = e->coefficient,
                          .push = e->push,
                          .source = e->source,
                          .update = exchange_update,
                          .self = e};
    exchange_update(e, nodes->v, nodes->p, dt);
    return SILT_OK;
}

void silt_exchange_load(silt_exchange *e, const double *velocity, const double *pressure, double dt) {
    silt_exchange_totals *t = &e->totals;
    *t = (silt_exchange_totals){0};
    if (dt != e->dt) // the water was told of another step than it took: nothing to hold on to but the new one
        exchange_update(e, velocity, pressure, dt);
    for (int i = 0; i < e->n_node; i++)
        for (int k = 0; k < 2; k++)
            t->water[k] += e->push[2 * i + k] - e->coefficient[i] * velocity[2 * i + k];

    // drag as the water felt it: accepted velocity, free velocity of the last update
    exchange_sample(e, velocity);
    for (int p = 0; p < e->n_grain; p++) {
        silt_exchange_grain *g = &e->grain[p];
        for (int k = 0; k < 2 && g->cell >= 0; k++) {
            g->force[k] = g->effective * (g->water[k] - g->free[k]);
            t->drag[k] += g->force[k];
        }
        t->size += hypot(g->force[0], g->force[1]);
    }
    exchange_smooth_gradient(e, pressure);
    for (int p = 0; p < e->n_grain; p++) {
        silt_exchange_grain *g = &e->grain[p];
        for (int k = 0; k < 2 && g->cell >= 0; k++) {
            g->pressure[k] = -g->solid * exchange_at(e, g, e->field, k);
            g->force[k] += g->pressure[k];
            t->pressure[k] += g->pressure[k];
        }
        t->size += hypot(g->pressure[0], g->pressure[1]);
    }
}

void silt_exchange_clear(silt_exchange *e) {
    silt_kernel_clear(&e->kernel);
    free(e->grain);
    free(e->solid);
    free(e->coefficient);
    free(e->push);
    free(e->source);
    free(e->field);
    free(e->area);
    free(e->gradient);
    *e = (silt_exchange){0};
}
