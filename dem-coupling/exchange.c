// exchange.c: grains in water: drag laws, spreading and sampling, forces on both sides
#include "exchange.h"

static const double solid_most = 0.75; // densest packing that the drag formulas are asked about
static const double kernel_reach = 8.0; // kernel widths; the kernel falls off with exp(-2 r/width)
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
        double chi = re > 0.0 ? 3.7 - 0.65 * exp(-silt_square(1.5 - log(re) / M_LN10) / 2.0) : 3.7;
        return root * root * M_PI * d * d / 8.0 * density * exp((2.0 - chi) * log(porosity));
    }
    default:
        return 0.0;
    }
}

// ---------------------------------------------------------------- fields through the kernel

// Fields that pass the kernel together stand node by node: what the grains read (velocity, pressure gradient), and what they
// spread (effective drag, this times the free velocity, flux of solid; one is idle, which makes the sweep's loops even)
enum { READ_VELOCITY, READ_GRADIENT = 2, READ_FIELDS = 4 };
enum { GIVE_DRAG, GIVE_PUSH, GIVE_FLUX = 3, GIVE_FIELDS = 6 };

// cells at the middle of the step, as the water's forces see them
static void exchange_midpoint(silt_exchange *e, const double *velocity, double dt) {
    for (int m = 0; m < e->kernel.n_near; m++) {
        const int c = e->kernel.near[m];
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

// Velocity and pressure gradient as grains feel them: sum_i w_ip u_i is the value of H^-1 M u at a grain, and that of
// H^-1 sum_e A_e/3 grad p_e the gradient. One solve for both.
static void exchange_smooth(silt_exchange *e, const double *velocity, const double *pressure) {
    double *read = e->read;
    memset(read, 0, READ_FIELDS * (size_t)e->n_node * sizeof *read);
    for (int m = 0; m < e->kernel.n_node; m++)
        for (int k = 0, i = e->kernel.node[m]; k < 2; k++)
            read[READ_FIELDS * i + READ_VELOCITY + k] = e->kernel.volume[i] * velocity[2 * i + k];
    for (int m = 0; m < e->kernel.n_near; m++) {
        const int c = e->kernel.near[m], *node = e->mesh->cell[c];
        for (int k = 0; k < 2; k++) {
            double slope = 0.0;
            for (int a = 0; a < 3; a++)
                slope += e->gradient[c][a][k] * pressure[node[a]];
            for (int a = 0; a < 3; a++)
                read[READ_FIELDS * node[a] + READ_GRADIENT + k] += e->area[c] / 3.0 * slope;
        }
    }
    silt_kernel_solve(&e->kernel, READ_FIELDS, read);
}

// ---------------------------------------------------------------- parts of a step

// what the grain feels of the smoothed fields
static void exchange_feel(const silt_exchange *e, silt_exchange_grain *g) {
    double felt[READ_FIELDS] = {0};
    for (int a = 0; a < 3; a++)
        for (int k = 0; k < READ_FIELDS; k++)
            felt[k] += g->weight[a] * e->read[READ_FIELDS * e->mesh->cell[g->cell][a] + k];
    for (int k = 0; k < 2; k++) {
        g->water[k] = felt[READ_VELOCITY + k];
        g->pressure[k] = -g->solid * felt[READ_GRADIENT + k];
    }
}

static void exchange_coefficient(const silt_exchange *e, silt_exchange_grain *g, double dt) {
    const int *node = e->mesh->cell[g->cell];
    double u[2] = {g->water[0] - g->v[0], g->water[1] - g->v[1]}, w = sqrt(u[0] * u[0] + u[1] * u[1]);
    double solid =
        g->weight[0] * e->solid[node[0]] + g->weight[1] * e->solid[node[1]] + g->weight[2] * e->solid[node[2]];
    g->drag_factor = g->number * silt_drag_factor(e->law, e->density, e->viscosity, g->diameter, solid, w);
    g->effective = g->drag_factor / (1.0 + dt * g->drag_factor / g->mass);
}

// free velocity, drag; adds to the nodes what the grain gives to them
static void exchange_give(const silt_exchange *e, silt_exchange_grain *g, double dt) {
    double give[GIVE_FIELDS] = {[GIVE_DRAG] = g->effective};
    for (int k = 0; k < 2; k++) {
        g->free[k] = g->v[k] + dt * (e->gravity[k] + (g->pressure[k] + g->contact[k]) / g->mass);
        g->force[k] = g->effective * (g->water[k] - g->free[k]);
        double end = g->free[k] + dt / g->mass * g->force[k];
        give[GIVE_PUSH + k] = g->effective * g->free[k];
        give[GIVE_FLUX + k] = g->solid * (g->v[k] + end) / 2.0;
    }
    for (int a = 0; a < 3; a++)
        for (int k = 0; k < GIVE_FIELDS; k++)
            e->give[GIVE_FIELDS * e->mesh->cell[g->cell][a] + k] += g->weight[a] * give[k];
}

// source_j = integral of grad N_j . s, s the smoothed flux of solid at the middle of the step
static void exchange_source(silt_exchange *e) {
    const double *flux = e->give + GIVE_FLUX;
    memset(e->source, 0, (size_t)e->n_node * sizeof *e->source);
    for (int m = 0; m < e->kernel.n_near; m++) {
        const int c = e->kernel.near[m], *node = e->mesh->cell[c];
        for (int k = 0; k < 2; k++) {
            double mean = 0.0;
            for (int a = 0; a < 3; a++)
                mean += flux[GIVE_FIELDS * node[a] + k] / 3.0;
            for (int a = 0; a < 3; a++)
                e->source[node[a]] += e->area[c] * e->gradient[c][a][k] * mean;
        }
    }
}

// true when the last update saw this velocity and pressure: what it found stands. The water's first iterate is what the
// step began with, one update in five.
static bool exchange_seen(silt_exchange *e, const double *velocity, const double *pressure) {
    const size_t n = (size_t)e->n_node;
    if (memcmp(e->seen, velocity, 2 * n * sizeof(double)) == 0 &&
        memcmp(e->seen + 2 * n, pressure, n * sizeof(double)) == 0)
        return true;
    memcpy(e->seen, velocity, 2 * n * sizeof(double));
    memcpy(e->seen + 2 * n, pressure, n * sizeof(double));
    return false;
}

// silt_drag's update: coefficient, push and source for an iterate of the water's velocity and pressure. Two solves, of all
// fields that can be made together, and one pass over the grains between them.
static void exchange_update(void *self, const double *velocity, const double *pressure, double dt) {
    silt_exchange *e = self;
    const bool seen = exchange_seen(e, velocity, pressure);
    if (seen && dt == e->dt)
        return;
    const bool renew = e->refresh || dt != e->dt;
    exchange_midpoint(e, velocity, dt);
    exchange_smooth(e, velocity, pressure);
    memset(e->give, 0, GIVE_FIELDS * (size_t)e->n_node * sizeof *e->give);
    for (int p = 0; p < e->n_grain; p++) {
        silt_exchange_grain *g = &e->grain[p];
        if (g->cell < 0)
            continue;
        exchange_feel(e, g);
        if (renew)
            exchange_coefficient(e, g, dt);
        exchange_give(e, g, dt);
    }
    silt_kernel_solve(&e->kernel, GIVE_FIELDS, e->give);
    for (int m = 0; m < e->kernel.n_node; m++) {
        const int i = e->kernel.node[m];
        const double *give = e->give + GIVE_FIELDS * i;
        e->coefficient[i] = e->kernel.volume[i] * give[GIVE_DRAG];
        for (int k = 0; k < 2; k++)
            e->push[2 * i + k] = e->kernel.volume[i] * give[GIVE_PUSH + k];
    }
    exchange_source(e);
    e->dt = dt;
}

// ---------------------------------------------------------------- the step

// Nodes within reach of a grain: what stands farther off hears e^-16 of it. Nothing of the exchange is done for the others (ten
// thousand grains in a third of a tank: half of the nodes, and a third of the time for the factor). The kernel closes
// whatever the choice is.
static void exchange_choose(silt_exchange *e) {
    const silt_mesh *mesh = e->mesh;
    const double reach = kernel_reach * e->width, most = 4.0 * mesh->n_node + 64;
    double lo[2] = {HUGE_VAL, HUGE_VAL}, hi[2] = {-HUGE_VAL, -HUGE_VAL}, size = reach / 4.0;
    memset(e->chosen, 0, (size_t)mesh->n_node);
    for (int p = 0; p < e->n_grain; p++) {
        const silt_exchange_grain *g = &e->grain[p];
        for (int k = 0; k < 2 && g->cell >= 0; k++) {
            lo[k] = silt_min(lo[k], g->x[k] - reach);
            hi[k] = silt_max(hi[k], g->x[k] + reach);
        }
        for (int a = 0; a < 3 && g->cell >= 0; a++)
            e->chosen[mesh->cell[g->cell][a]] = 1;
    }
    if (!(lo[0] <= hi[0]))
        return;
    while ((hi[0] - lo[0]) / size * ((hi[1] - lo[1]) / size) > most)
        size *= 1.5;

    // a grid over the grains: those near it are counted in squares of bins by sums along rows, then columns
    const int wide = (int)ceil(reach / size), n[2] = {(int)((hi[0] - lo[0]) / size) + 1, (int)((hi[1] - lo[1]) / size) + 1};
    SILT_RESERVE(e->bin, e->bin_capacity, 2 * n[0] * n[1]);
    int *count = e->bin, *rows = e->bin + n[0] * n[1];
    memset(count, 0, (size_t)(n[0] * n[1]) * sizeof *count);
    for (int p = 0; p < e->n_grain; p++) {
        const silt_exchange_grain *g = &e->grain[p];
        if (g->cell >= 0)
            count[(int)((g->x[1] - lo[1]) / size) * n[0] + (int)((g->x[0] - lo[0]) / size)] = 1;
    }
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

// true when mesh and grains stand where they stood at the last place
bool silt_exchange_stands(const silt_exchange *e, const silt_nodes *nodes, const silt_mesh *mesh) {
    return e->placed && e->mesh == mesh && e->revision == mesh->revision && e->n_node == mesh->n_node &&
           e->n_placed_cell == mesh->n_cell &&
           memcmp(e->placed_x, nodes->x, 2 * (size_t)mesh->n_node * sizeof *e->placed_x) == 0;
}

silt_status silt_exchange_place(silt_exchange *e, const silt_nodes *nodes, const silt_mesh *mesh, silt_error *err) {
    int n = mesh->n_node;
    e->placed = false;
    e->mesh = mesh;
    e->x = nodes->x;
    e->n_node = n;
    SILT_RESERVE(e->area, e->cell_capacity[0], mesh->n_cell);
    SILT_RESERVE(e->gradient, e->cell_capacity[1], mesh->n_cell);
    SILT_RESERVE(e->solid, e->node_capacity[0], n);
    SILT_RESERVE(e->coefficient, e->node_capacity[1], n);
    SILT_RESERVE(e->push, e->node_capacity[2], 2 * n);
    SILT_RESERVE(e->source, e->node_capacity[3], n);
    SILT_RESERVE(e->read, e->node_capacity[4], READ_FIELDS * n);
    SILT_RESERVE(e->give, e->node_capacity[5], GIVE_FIELDS * n);
    SILT_RESERVE(e->seen, e->node_capacity[8], 3 * n);
    SILT_RESERVE(e->chosen, e->node_capacity[6], n);
    SILT_RESERVE(e->placed_x, e->node_capacity[7], 2 * n);
    exchange_choose(e);
    SILT_TRY(silt_kernel_build(&e->kernel, mesh, nodes->x, e->chosen, e->width, err));

    // solid fraction
    memset(e->solid, 0, (size_t)n * sizeof *e->solid);
    for (int p = 0; p < e->n_grain; p++) {
        const silt_exchange_grain *g = &e->grain[p];
        for (int a = 0; a < 3 && g->cell >= 0; a++)
            e->solid[mesh->cell[g->cell][a]] += g->weight[a] * g->solid;
    }
    silt_kernel_solve(&e->kernel, 1, e->solid);
    e->drag = (silt_drag){.solid = e->solid,
                          .coefficient = e->coefficient,
                          .push = e->push,
                          .source = e->source,
                          .update = exchange_update,
                          .self = e};
    memcpy(e->placed_x, nodes->x, 2 * (size_t)n * sizeof *e->placed_x);
    e->revision = mesh->revision;
    e->n_placed_cell = mesh->n_cell;
    e->placed = true;
    return SILT_OK;
}

void silt_exchange_begin(silt_exchange *e, const silt_nodes *nodes, double dt) {
    e->x = nodes->x;
    memset(e->coefficient, 0, (size_t)e->n_node * sizeof *e->coefficient);
    memset(e->push, 0, 2 * (size_t)e->n_node * sizeof *e->push);
    for (int p = 0; p < e->n_grain; p++) {
        silt_exchange_grain *g = &e->grain[p];
        g->drag_factor = g->effective = 0.0;
        for (int k = 0; k < 2; k++)
            g->free[k] = g->pressure[k] = g->force[k] = 0.0;
    }
    e->dt = NAN; // whatever dt is, the coefficients are of another step
    exchange_update(e, nodes->v, nodes->p, dt);
}

silt_status silt_exchange_prepare(silt_exchange *e, const silt_nodes *nodes, const silt_mesh *mesh, double dt,
                                  silt_error *err) {
    SILT_TRY(silt_exchange_place(e, nodes, mesh, err));
    silt_exchange_begin(e, nodes, dt);
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
    exchange_smooth(e, velocity, pressure);
    for (int p = 0; p < e->n_grain; p++) {
        silt_exchange_grain *g = &e->grain[p];
        if (g->cell < 0)
            continue;
        exchange_feel(e, g);
        double drag[2];
        for (int k = 0; k < 2; k++) {
            drag[k] = g->effective * (g->water[k] - g->free[k]);
            g->force[k] = drag[k] + g->pressure[k];
            t->drag[k] += drag[k];
            t->pressure[k] += g->pressure[k];
        }
        t->size += sqrt(drag[0] * drag[0] + drag[1] * drag[1]) +
                   sqrt(g->pressure[0] * g->pressure[0] + g->pressure[1] * g->pressure[1]);
    }
}

void silt_exchange_clear(silt_exchange *e) {
    silt_kernel_clear(&e->kernel);
    free(e->grain);
    free(e->solid);
    free(e->coefficient);
    free(e->push);
    free(e->source);
    free(e->read);
    free(e->give);
    free(e->seen);
    free(e->chosen);
    free(e->placed_x);
    free(e->bin);
    free(e->area);
    free(e->gradient);
    *e = (silt_exchange){0};
}
