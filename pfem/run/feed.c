// grains that come in with the water of inlets
#include "run.h"

#define FEED_TRIES 64 // random places in the box around an inlet; its middle when none lies within

// kg of a parcel of the diameter grains.parcel; radii go with the cube root of the mass
static double feed_parcel(const silt_run *run) {
    const double d = run->scene->grains.parcel, trial = run->scene->bed.density * d * d * (run->bed.dim == 3 ? d : 1);
    return trial * pow(0.5 * d / silt_coupling_dem.parcel_radius(run->coupling, trial), 3);
}

// a place of the inlet, a radius within its rim and in front of it; the same for the same fluid.seed, inlet and mass that came before
static void feed_place(const silt_run *run, int k, double radius, double x[3]) {
    const silt_opening o = silt_opening_of(run->scene, k);
    double lo[3] = {0}, hi[3] = {0};
    const int n = o.dim == 3 ? o.n_corner : 2;
    for (int c = 0; c < n; c++)
        for (int d = 0; d < o.dim; d++) {
            const double at = o.dim == 3 ? o.corner[3 * c + d] : (c ? o.to : o.from)[d];
            lo[d] = c ? silt_min(lo[d], at) : at;
            hi[d] = c ? silt_max(hi[d], at) : at;
        }
    uint64_t random = silt_hash(silt_hash(0, &run->scene->fluid.seed, sizeof run->scene->fluid.seed), &k, sizeof k);
    random = silt_hash(random, &run->ledger.fed_mass, sizeof run->ledger.fed_mass);
    for (int tries = 0; tries <= FEED_TRIES; tries++) {
        // in the plane the segment is the diagonal of its box
        const double share = silt_uniform(&random);
        for (int d = 0; d < 3; d++) {
            const double s = tries == FEED_TRIES ? 0.5 : o.dim == 3 ? silt_uniform(&random) : share;
            x[d] = o.dim == 3 ? lo[d] + s * (hi[d] - lo[d]) : o.from[d] + s * (o.to[d] - o.from[d]);
        }
        const double height = silt_opening_height(&o, x);
        for (int d = 0; d < o.dim; d++)
            x[d] += (radius - height) * o.normal[d];
        if (silt_opening_depth(&o, x) >= radius)
            return;
    }
}

// a parcel in the place of as much water, with the water's speed
static void feed_one(silt_run *run, int k, double mass, double factor) {
    const silt_inlet *inlet = &run->scene->fluid.inlet[k];
    const double radius = silt_coupling_dem.parcel_radius(run->coupling, mass);
    SILT_RESERVE(run->waiting, run->waiting_capacity, run->n_waiting + 1);
    silt_waiting *waiting = &run->waiting[run->n_waiting++];
    *waiting = (silt_waiting){.mass = mass, .reach = 2 * radius};
    feed_place(run, k, radius, waiting->x);
    const silt_opening o = silt_opening_of(run->scene, k);
    memcpy(waiting->normal, o.normal, sizeof waiting->normal);
    for (int d = 0; d < 3; d++)
        waiting->v[d] = factor * inlet->velocity[d];
    silt_sum(&run->ledger.fed_mass, &run->ledger.fed_rest, mass);
    run->ledger.inflow_mass -= run->scene->fluid.density * mass / run->scene->bed.density;
}

void silt_run_feed(silt_run *run, double dt) {
    const silt_fluid_def *fluid = &run->scene->fluid;
    for (int k = 0; k < fluid->n_inlet; k++) {
        const silt_inlet *inlet = &fluid->inlet[k];
        if (!(inlet->grains > 0) || !run->coupling)
            continue;
        SILT_RESERVE(run->owed, run->owed_capacity, fluid->n_inlet);
        while (run->n_owed < fluid->n_inlet)
            run->owed[run->n_owed++] = 0;
        const double factor = inlet->series.n_row ? silt_series_at(&inlet->series, 1, run->time + 0.5 * dt) : 1;
        const double mass = feed_parcel(run);
        run->owed[k] += silt_max(factor, 0) * inlet->grains * dt;
        for (; run->owed[k] >= mass; run->owed[k] -= mass)
            feed_one(run, k, mass, factor);
    }
}
