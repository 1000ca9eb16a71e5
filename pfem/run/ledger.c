// the ledger: what there is of water and sediment, where it went, what moves it
#include "parallel.h"
#include "run.h"

/** what cells hold */
typedef struct tally {
    double mesh_volume, water, momentum[3], kinetic, potential;
} tally;

static tally cells_tally(const silt_run *run, int first, int last) {
    const silt_nodes *nodes = &run->nodes;
    const int D = silt_nodes_dim(nodes);
    const double rho = run->scene->fluid.density;
    tally t = {0};
    for (int e = first; e < last; e++) {
        const int *cell = run->mesh.cell[e];
        const double volume = silt_cell_volume(&run->mesh, nodes->x, e);
        double water = volume, corner[12], height = 0;
        silt_cell_corners(&run->mesh, nodes->x, cell, corner);
        t.mesh_volume += volume;
        for (int a = 0; a <= D; a++) {
            if (run->drag)
                water -= volume * run->drag->solid[cell[a]] / (D + 1);
            for (int d = 0; d < D; d++)
                height += corner[D * a + d] * run->scene->gravity[d] / (D + 1);
        }
        t.water += water;
        for (int a = 0; a <= D; a++)
            for (int d = 0; d < D; d++) {
                const double m = rho * water / (D + 1), v = nodes->v[D * cell[a] + d];
                t.momentum[d] += m * v;
                t.kinetic += 0.5 * m * v * v;
            }
        t.potential -= rho * water * height;
    }
    return t;
}

static void ledger_cells(silt_run *run) {
    silt_ledger *ledger = &run->ledger;
    const int n = run->mesh.n_cell;
    tally part[CHUNK_MOST];
    SILT_PARALLEL(n)
    for (int c = 0; c < silt_chunks(n); c++)
        part[c] = cells_tally(run, silt_chunk_first(n, c), silt_chunk_first(n, c + 1));
    for (int c = 0; c < silt_chunks(n); c++) {
        ledger->mesh_volume += part[c].mesh_volume;
        ledger->fluid_volume += part[c].water;
        for (int d = 0; d < 3; d++)
            ledger->momentum[d] += part[c].momentum[d];
        ledger->kinetic_energy += part[c].kinetic;
        ledger->potential_energy += part[c].potential;
    }
}

// energy of the bodies that move; those that are fixed have none
static void ledger_bodies(silt_run *run) {
    silt_ledger *ledger = &run->ledger;
    const silt_body_state *bodies = silt_coupling_dem.bodies(run->coupling);
    ledger->body_kinetic = ledger->body_potential = 0;
    for (int i = 0; bodies && i < bodies->count; i++) {
        const struct silt_body *b = &bodies->body[i];
        if (run->scene->body[i].motion == MOTION_FIXED)
            continue;
        double w[3], spin = b->inertia[2] * silt_square(b->w[2]); // in the plane
        if (run->scene->dimension == 3) {
            const double *J = b->inertia; // xx, yy, zz, xy, xz, yz
            silt_turn(b->q, true, b->w, w);
            spin = J[0] * w[0] * w[0] + J[1] * w[1] * w[1] + J[2] * w[2] * w[2] +
                   2 * (J[3] * w[0] * w[1] + J[4] * w[0] * w[2] + J[5] * w[1] * w[2]);
        }
        ledger->body_kinetic += 0.5 * (b->mass * silt_dot(3, b->v, b->v) + spin);
        ledger->body_potential -= b->mass * silt_dot(3, b->x, run->scene->gravity);
    }
}

void silt_run_ledger(silt_run *run) {
    silt_ledger *ledger = &run->ledger;
    const silt_nodes *nodes = &run->nodes;
    const silt_scene *scene = run->scene;
    const double rho = scene->fluid.density;
    ledger->kinetic_energy = ledger->potential_energy = 0;
    memset(ledger->momentum, 0, sizeof ledger->momentum);
    ledger->mesh_volume = ledger->flying_volume = ledger->fluid_volume = 0;
    const int D = silt_nodes_dim(nodes);
    ledger_cells(run);
    for (int i = 0; i < nodes->count; i++) {
        if (run->mesh.wet[i])
            continue;
        const double volume = nodes->debt[i];
        ledger->flying_volume += volume;
        for (int d = 0; d < D; d++) {
            ledger->momentum[d] += rho * volume * nodes->v[D * i + d];
            ledger->kinetic_energy += 0.5 * rho * volume * silt_square(nodes->v[D * i + d]);
            ledger->potential_energy -= rho * volume * nodes->x[D * i + d] * scene->gravity[d];
        }
    }
    ledger->max_speed = 0;
    for (int i = 0; i < nodes->count; i++)
        if (run->mesh.wet[i] || nodes->kind[i] == NODE_FLUID)
            ledger->max_speed = silt_max(ledger->max_speed, silt_length(D, nodes->v + D * i));
    // parcels that wait are solid in the place where they were released
    for (int k = 0; k < run->n_waiting && scene->fluid.on; k++)
        ledger->fluid_volume -= run->waiting[k].mass / scene->bed.density;
    ledger->fluid_volume += ledger->flying_volume;
    for (int b = 0; b < scene->n_body && run->body_water; b++)
        ledger->fluid_volume += run->body_water[b].film;
    ledger->fluid_mass = rho * ledger->fluid_volume;
    ledger->volume_owed = ledger->owed_energy = 0;
    for (int i = 0; i < nodes->count; i++) {
        if (!run->mesh.wet[i] || nodes->debt[i] == 0)
            continue;
        const double *v = nodes->v + D * i;
        ledger->volume_owed += nodes->debt[i];
        ledger->owed_energy += rho * nodes->debt[i] * (0.5 * silt_dot(D, v, v) - silt_dot(D, nodes->x + D * i, scene->gravity));
    }
    if (scene->fluid.on)
        silt_water_moment(nodes, &run->mesh, run->drag ? run->drag->solid : NULL, rho, (const double[3]){0}, ledger->angular_momentum);
    ledger->y_plus = run->fluid.law.n_point ? run->fluid.law.y_plus[1] : NAN;
    ledger->bed_mass = run->bed.solid_mass;
    ledger->bed_shear = ledger->bed_work = 0;
    for (int k = 0; k < run->bed.n_node; k++)
        if (run->bed.exposed[k]) {
            ledger->bed_shear = silt_max(ledger->bed_shear, run->bed.shear[k]);
            ledger->bed_work = silt_max(ledger->bed_work, run->bed.work[k]);
        }
    ledger->bed_y_plus = run->bed.y_plus;
    ledger->pore_water_mass = run->bed.pore_water;
    ledger->grain_count = 0;
    ledger->grain_mass = 0;
    memset(ledger->grain_velocity, 0, sizeof ledger->grain_velocity);
    ledger->grain_kinetic = ledger->grain_potential = 0;
    if (run->coupling) {
        const silt_grain_state *grains = silt_coupling_dem.grains(run->coupling);
        double moving = 0;
        for (int k = 0; k < grains->count; k++) {
            const double *x = grains->x + 3 * k, *v = grains->v + 3 * k, *spin = grains->omega + 3 * k;
            moving += grains->mass[k];
            ledger->grain_kinetic += 0.5 * grains->mass[k] *
                                     (silt_dot(3, v, v) + 0.4 * silt_square(grains->radius[k]) * silt_dot(3, spin, spin));
            ledger->grain_potential -= grains->mass[k] * silt_dot(3, x, scene->gravity);
            for (int d = 0; d < 3; d++)
                ledger->grain_velocity[d] += grains->mass[k] * grains->v[3 * k + d];
        }
        for (int d = 0; d < 3 && moving > 0; d++)
            ledger->grain_velocity[d] /= moving;
        ledger_bodies(run);
        ledger->grain_count = grains->count + run->n_waiting;
        // summed with care: the sediment must close to rounding
        double carry = 0;
        for (int k = 0; k < grains->count + run->n_waiting; k++) {
            const double m = (k < grains->count ? grains->mass[k] : run->waiting[k - grains->count].mass) - carry;
            const double sum = ledger->grain_mass + m;
            carry = (sum - ledger->grain_mass) - m;
            ledger->grain_mass = sum;
        }
        int64_t count;
        const double left = ledger->left_mass, displaced = ledger->left_solid;
        silt_coupling_dem.left(run->coupling, &ledger->left_mass, &ledger->left_solid, &count);
        // what left the mesh was water and what it carried
        if (scene->bed.on)
            ledger->outflow_mass -= rho * (ledger->left_mass - left) / scene->bed.density;
        else if (scene->fluid.on)
            ledger->outflow_mass -= rho * (ledger->left_solid - displaced);
    }
    if (run->step == 0) {
        ledger->initial_volume = ledger->fluid_volume;
        ledger->initial_sediment = ledger->bed_mass + ledger->grain_mass;
    }
    const double base = ledger->initial_volume + ledger->inflow_mass / rho;
    const double expected = base - ledger->outflow_mass / rho + ledger->pore_water_mass / rho;
    ledger->volume_error = scene->fluid.on && base > 0 ? (ledger->fluid_volume - expected) / base : 0;
    const double sediment = ledger->bed_mass + ledger->grain_mass + ledger->left_mass - ledger->fed_mass - ledger->initial_sediment;
    ledger->sediment_error = ledger->initial_sediment > 0 ? sediment / ledger->initial_sediment : 0;

    silt_summary *summary = &run->summary;
    summary->worst_volume_error = silt_max(summary->worst_volume_error, fabs(ledger->volume_error));
    summary->worst_sediment_error = silt_max(summary->worst_sediment_error, fabs(ledger->sediment_error));
    summary->worst_momentum_error = silt_max(summary->worst_momentum_error, ledger->momentum_error);
}

// forces of the step that was solved: what the water's momentum leaves open, and whether what grains got the water lost
void silt_run_balance(silt_run *run) {
    silt_ledger *ledger = &run->ledger;
    const silt_fluid *fluid = &run->fluid;
    ledger->momentum_error = fluid->momentum_scale > 0 ? fluid->momentum_residual / fluid->momentum_scale : 0;
    if (!run->coupling)
        return;
    ledger->momentum_error = silt_max(ledger->momentum_error, run->body_error);
    silt_exchanged exchanged;
    silt_coupling_dem.exchanged(run->coupling, &exchanged);
    double open[3] = {0};
    for (int d = 0; d < 3; d++) {
        open[d] = fluid->from_grains[d] + exchanged.grains[d];
        ledger->grain_water[d] = exchanged.grains[d];
        ledger->grain_contact[d] = exchanged.contact[d];
    }
    if (exchanged.size > 0)
        ledger->momentum_error = silt_max(ledger->momentum_error, silt_length(3, open) / exchanged.size);
}
