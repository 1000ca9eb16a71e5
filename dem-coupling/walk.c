// walk.c: what the water does to grains besides forces on what moves: torques, and what holds those that are fixed
#include "state.h"

void silt_coupling_hold(silt_coupling *c, coupling_grain *g) {
    for (int d = 0; d < 2 && c->elapsed > 0.0; d++) {
        g->contact[d] = -g->force[d] - g->mass * c->scene->gravity[d];
        c->contact[d] += g->contact[d];
    }
    g->net = 0.0;
}

// in the order of the last state; a crumb's sphere is heavier than the crumb: scaled as its inertia is
void silt_coupling_twist(silt_coupling *c) {
    if (!c->exchange.force.def.spin)
        return;
    SILT_RESERVE(c->torque, c->torque_capacity, 3 * c->n_last + 3);
    memset(c->torque, 0, 3 * (size_t)c->n_last * sizeof *c->torque);
    for (int i = 0, k = 0; i < c->n_grain; i++) {
        const coupling_grain *g = &c->grain[i];
        while (k < c->n_last && c->last[k] < g->id)
            k++;
        for (int d = 0; d < 3 && k < c->n_last && c->last[k] == g->id; d++)
            c->torque[3 * k + d] = g->torque[d] * c->width * silt_coupling_burden(c, g);
    }
    silt_dem_twist(c->dem, c->torque);
}
