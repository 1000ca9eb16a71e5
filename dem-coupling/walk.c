// walk.c: what the water does to grains besides forces on what moves: torques, what holds those that are fixed, the way out
#include "state.h"

void silt_coupling_hold(silt_coupling *c, coupling_grain *g) {
    for (int d = 0; d < c->dim && c->elapsed > 0.0; d++) {
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

bool silt_coupling_leaves(const silt_coupling *c, const double *a, const double *b, double near) {
    const double period = c->scene->period[1] - c->scene->period[0];
    for (int i = c->scene->fluid.n_inlet; i < silt_opening_count(c->scene); i++) {
        const silt_opening o = silt_opening_of(c->scene, i);
        const double before = silt_opening_height(&o, a), after = silt_opening_height(&o, b);
        if (near > 0.0 && hypot(before, silt_min(silt_opening_depth(&o, a), 0.0)) <= near)
            return true;
        // what comes in at the other end of a period has not come through here
        if (before < 0.0 || after >= 0.0 || (period > 0.0 && fabs(b[0] - a[0]) > 0.5 * period))
            continue;
        double x[3];
        for (int d = 0; d < c->dim; d++)
            x[d] = a[d] + before / (before - after) * (b[d] - a[d]);
        if (silt_opening_depth(&o, x) >= 0.0)
            return true;
    }
    return false;
}

bool silt_coupling_left_domain(const silt_coupling *c, const coupling_grain *g) {
    double ahead[3];
    for (int d = 0; d < 3; d++)
        ahead[d] = g->old_x[d] + 2.0 * c->elapsed * g->v[d];
    return silt_coupling_leaves(c, g->old_x, ahead, 4.0 * g->radius);
}
