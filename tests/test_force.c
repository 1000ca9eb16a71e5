// forces of the water on grains besides drag: added mass, viscous force, Saffman's lift, torque on the spin: each against its
// formula, and what grains gain the water loses, momentum and moment
#include "../dem-coupling/exchange.h"
#include "fluid.h"

#include <setjmp.h>
#include <stdarg.h>

#include <cmocka.h>

#include "check.h"

// ---------------------------------------------------------------- a tank of water, n x n squares of size h, jittered inside

typedef struct tank {
    silt_nodes nodes;
    silt_mesh mesh;
    silt_locator locator;
    silt_exchange exchange;
    uint64_t random;
} tank;

static void tank_open(tank *t, int n, double h, double jitter) {
    memset(t, 0, sizeof *t);
    t->random = 11;
    for (int j = 0; j <= n; j++)
        for (int i = 0; i <= n; i++) {
            const bool inside = i > 0 && j > 0 && i < n && j < n;
            double x[2] = {i * h, j * h};
            for (int k = 0; k < 2 && inside; k++)
                x[k] += jitter * h * (silt_uniform(&t->random) - 0.5);
            silt_nodes_add(&t->nodes, NODE_FLUID, -1, x);
        }
    SILT_RESERVE(t->mesh.cell, t->mesh.cell_capacity, 2 * n * n);
    for (int j = 0; j < n; j++)
        for (int i = 0; i < n; i++) {
            const int a = j * (n + 1) + i, b = a + 1, c = a + n + 1, d = c + 1;
            const int two[2][4] = {{a, b, d, -1}, {a, d, c, -1}};
            memcpy(t->mesh.cell[t->mesh.n_cell], two, sizeof two);
            t->mesh.n_cell += 2;
        }
    silt_mesh_connect(&t->mesh, &t->nodes);
    silt_locator_build(&t->locator, &t->mesh, t->nodes.x, h);
    t->exchange.density = 1000;
    t->exchange.viscosity = 1e-3;
    t->exchange.gravity[1] = -9.81;
    t->exchange.width = 2.5 * h;
    t->exchange.law = DRAG_STOKES;
    t->exchange.refresh = true;
    t->exchange.force.def.theta = 0.55;
}

static void tank_close(tank *t) {
    silt_nodes_clear(&t->nodes);
    silt_mesh_clear(&t->mesh);
    silt_locator_clear(&t->locator);
    silt_exchange_clear(&t->exchange);
}

static silt_exchange_grain *tank_grain(tank *t, double x, double y, double d, double density) {
    silt_exchange *e = &t->exchange;
    SILT_RESERVE(e->grain, e->grain_capacity, e->n_grain + 1);
    silt_exchange_grain *g = &e->grain[e->n_grain++];
    *g = (silt_exchange_grain){.x = {x, y}, .diameter = d, .number = 1 / (5 * d), .gyration = sqrt(0.4) * d / 2};
    g->solid = M_PI / 6 * d * d * d * g->number;
    g->mass = density * g->solid;
    g->cell = silt_locate(&t->locator, &t->mesh, t->nodes.x, g->x, g->weight);
    return g;
}

static void tank_hydrostatic(tank *t, double top, double acceleration) {
    for (int i = 0; i < t->nodes.count; i++)
        t->nodes.p[i] = 1000 * acceleration * (top - t->nodes.x[2 * i + 1]);
}

// ---------------------------------------------------------------- added mass

// Stokes' sphere from rest: v = v_t (1 - exp(-t/tau)), tau = (rho_s + C rho) d^2/(18 mu)
static void test_added_mass_stokes(void **unused) {
    (void)unused;
    const double density[3] = {2650, 1100, 10};
    for (int k = 0; k < 3; k++)
        for (int half = 0; half < 2; half++) {
            const double d = 1e-4, added = half ? 0.5 : 0, tau = (density[k] + added * 1000) * d * d / 18e-3;
            const double terminal = (density[k] - 1000) * 9.81 * d * d / 18e-3, dt = tau / 400;
            tank t;
            tank_open(&t, 6, 0.5, 0.4);
            t.exchange.force.def.added_mass = added;
            silt_exchange_grain *g = tank_grain(&t, 1.6, 1.4, d, density[k]);
            tank_hydrostatic(&t, 3, 9.81);
            for (int step = 1; step <= 1600; step++) {
                OK(silt_exchange_prepare(&t.exchange, &t.nodes, &t.mesh, dt, &error));
                silt_exchange_load(&t.exchange, t.nodes.v, t.nodes.p, dt, NULL);
                g->v[1] += dt * (g->force[1] / g->mass - 9.81);
                if (step % 100 == 0)
                    near(-g->v[1] / terminal, 1 - exp(-step * dt / tau), 0.002, "Stokes' sphere");
            }
            tank_close(&t);
        }
}

// without drag, water that is pushed with the acceleration a: (m + m_a) dv/dt = (rho V + m_a) a; light as air: 3 a
static void test_added_mass_of_water_that_accelerates(void **unused) {
    (void)unused;
    const double density[3] = {1000, 2650, 1e-3}, dt = 1e-3, a = 7;
    for (int k = 0; k < 3; k++) {
        tank t;
        tank_open(&t, 8, 0.1, 0.4);
        silt_exchange *e = &t.exchange;
        e->law = DRAG_NONE;
        e->gravity[1] = 0;
        e->force.def.added_mass = 0.5;
        silt_exchange_grain *g = tank_grain(&t, 0.41, 0.43, 1e-3, density[k]);
        tank_hydrostatic(&t, 0.8, a); // grad p = -rho a: the water goes up with a
        double *w = silt_alloc(2 * (size_t)t.nodes.count, sizeof *w);
        for (int step = 0; step < 20; step++) {
            OK(silt_exchange_prepare(e, &t.nodes, &t.mesh, dt, &error));
            for (int i = 0; i < t.nodes.count; i++)
                w[2 * i + 1] = t.nodes.v[2 * i + 1] + 0.55 * dt * a;
            e->drag.update(e->drag.self, w, t.nodes.p, dt);
            silt_exchange_load(e, w, t.nodes.p, dt, NULL);
            g->v[1] += dt * g->force[1] / g->mass;
            for (int i = 0; i < t.nodes.count; i++)
                t.nodes.v[2 * i + 1] += dt * a;
        }
        near(g->v[1] / (20 * dt * a * 1500 / (density[k] + 500)), 1, 1e-7, "velocity in water that accelerates");
        free(w);
        tank_close(&t);
    }
}

// drag by orders stiffer than inertia, and grains by orders lighter than water: no swinging, no overshoot
static void test_added_mass_is_stable(void **unused) {
    (void)unused;
    for (double density = 1e-3; density < 1e4; density *= 10)
        for (double x = 1e-3; x < 2e6; x *= 10) {
            tank t;
            tank_open(&t, 6, 0.01, 0);
            silt_exchange *e = &t.exchange;
            e->gravity[1] = 0;
            e->force.def.added_mass = 0.5;
            silt_exchange_grain *g = tank_grain(&t, 0.031, 0.032, 1e-3, density);
            for (int i = 0; i < t.nodes.count; i++)
                t.nodes.v[2 * i] = 1;
            const double dt = x * (density + 500) * 1e-6 / 18e-3;
            g->v[0] = -3;
            for (int step = 0; step < 6; step++) {
                const double before = g->v[0];
                OK(silt_exchange_prepare(e, &t.nodes, &t.mesh, dt, &error));
                silt_exchange_load(e, t.nodes.v, t.nodes.p, dt, NULL);
                g->v[0] += dt * g->force[0] / g->mass;
                near((1 - g->v[0]) * (1 + x) / 4, (1 - before) / 4, 1e-7 * (1 + x), "gap to the water's velocity");
                assert_true(g->v[0] <= 1 + 1e-7);
            }
            tank_close(&t);
        }
}

// ---------------------------------------------------------------- viscous force, lift, torque

// u = c y^2: V mu 2 c along the flow, away from the rim of the tank
static void test_viscous_force(void **unused) {
    (void)unused;
    tank t;
    tank_open(&t, 24, 0.01, 0);
    silt_exchange *e = &t.exchange;
    e->law = DRAG_NONE;
    e->gravity[1] = 0;
    e->force.def.viscous = true;
    silt_exchange_grain *g = tank_grain(&t, 0.122, 0.117, 1e-3, 2650);
    for (int i = 0; i < t.nodes.count; i++)
        t.nodes.v[2 * i] = 30 * silt_square(t.nodes.x[2 * i + 1]);
    // a step so short that the mesh does not move
    OK(silt_exchange_prepare(e, &t.nodes, &t.mesh, 1e-9, &error));
    silt_exchange_load(e, t.nodes.v, t.nodes.p, 1e-9, NULL);
    near(g->force[0] / (g->solid * 1e-3 * 60), 1, 1e-3, "viscous force");
    near(g->force[1] / (g->solid * 1e-3 * 60), 0, 1e-3, "viscous force across");
    tank_close(&t);
}

// F = 1.615 d^2 sqrt(rho mu/|omega|) (u - v) x omega; a grain that lags in a shear is carried to where the water is faster
static void test_lift(void **unused) {
    (void)unused;
    for (int side = -1; side <= 1; side += 2) {
        tank t;
        tank_open(&t, 8, 0.01, 0.4);
        silt_exchange *e = &t.exchange;
        e->law = DRAG_NONE;
        e->gravity[1] = 0;
        e->force.def.lift = true;
        silt_exchange_grain *g = tank_grain(&t, 0.042, 0.041, 1e-3, 2650);
        for (int i = 0; i < t.nodes.count; i++)
            t.nodes.v[2 * i] = side * 20 * t.nodes.x[2 * i + 1];
        OK(silt_exchange_prepare(e, &t.nodes, &t.mesh, 1e-9, &error));
        silt_exchange_load(e, t.nodes.v, t.nodes.p, 1e-9, NULL);
        const double u = g->water[0] - g->v[0], size = 1.615 * 1e-6 * sqrt(1000 * 1e-3 * 20) * g->number;
        assert_true(fabs(u) > 0.7);
        near(g->force[1] / (size * fabs(u)), 1, 1e-6, "Saffman's lift towards the faster water");
        near(g->force[0] / (size * fabs(u)), 0, 1e-6, "lift along the flow");

        // any step is stable: the slip ends where drag and lift leave it, never beyond
        e->law = DRAG_STOKES;
        const double beta = g->number * 3 * M_PI * 1e-6;
        for (double x = 1e-2; x < 2e6; x *= 10) {
            double gap = hypot(u, 0.3);
            g->v[0] = g->water[0] - u, g->v[1] = g->water[1] - 0.3;
            for (int step = 0; step < 8; step++) {
                // the mesh stands: only the grain's side is asked about
                const double dt = x * g->mass / beta;
                OK(silt_exchange_prepare(e, &t.nodes, &t.mesh, dt, &error));
                silt_exchange_load(e, t.nodes.v, t.nodes.p, dt, NULL);
                for (int k = 0; k < 2; k++)
                    g->v[k] += dt * g->force[k] / g->mass;
                const double now = hypot(g->water[0] - g->v[0], g->water[1] - g->v[1]);
                assert_true(now <= gap * (1 + 1e-6) + 1e-8);
                gap = now;
            }
        }
        tank_close(&t);
    }
}

// spin in water at rest falls off with exp(-60 mu t/(rho_s d^2)) (10 pi mu d/m); in water that turns it ends at half the curl
static void test_spin(void **unused) {
    (void)unused;
    const double d = 1e-3, density = 2650, rate = 60e-3 / (density * d * d);
    tank t;
    tank_open(&t, 8, 0.01, 0.4);
    silt_exchange *e = &t.exchange;
    e->gravity[1] = 0;
    e->force.def.spin = true;
    silt_exchange_grain *g = tank_grain(&t, 0.042, 0.041, d, density);
    const double inertia = g->mass * d * d / 10;
    near(rate, 10 * M_PI * 1e-3 * d * g->number / g->mass, 1e-12 * rate, "two ways to say it");
    g->spin[2] = 30;
    const double dt = 1e-3 / rate;
    for (int step = 1; step <= 2000; step++) {
        OK(silt_exchange_prepare(e, &t.nodes, &t.mesh, dt, &error));
        silt_exchange_load(e, t.nodes.v, t.nodes.p, dt, NULL);
        if (step == 1) // the torque itself, but for what the spin loses within the step
            near(g->torque[2] / (-M_PI * 1e-3 * d * d * d * g->number * 30), 1 / 1.001, 1e-9, "torque");
        g->spin[2] += dt * g->torque[2] / inertia;
        if (step % 500 == 0)
            near(g->spin[2] / 30, exp(-rate * step * dt), 1e-3, "spin");
    }
    // water that turns, the torque of it; and drag on the spin a million times faster than the step
    for (int i = 0; i < t.nodes.count; i++) {
        t.nodes.v[2 * i] = -3 * t.nodes.x[2 * i + 1];
        t.nodes.v[2 * i + 1] = 5 * t.nodes.x[2 * i];
    }
    for (double x = 1e-6; x < 2e6; x *= 10) {
        const double step = 1e-6; // the mesh stands nearly still; less inertia makes the relaxation fast
        g->spin[2] = 0;
        g->gyration = sqrt(0.1 * d * d * rate * step / x);
        double before = 0;
        for (int k = 0; k < 10; k++) {
            OK(silt_exchange_prepare(e, &t.nodes, &t.mesh, step, &error));
            silt_exchange_load(e, t.nodes.v, t.nodes.p, step, NULL);
            g->spin[2] += step * g->torque[2] / (g->mass * g->gyration * g->gyration);
            near(4 - g->spin[2], (4 - before) / (1 + x), 1e-4, "spin in water that turns");
            assert_true(g->spin[2] <= 4 + 1e-4);
            before = g->spin[2];
        }
    }
    tank_close(&t);
}

// ---------------------------------------------------------------- both sides

// n grains of any density between air and steel anywhere, moving and spinning
static void tank_fill(tank *t, int n, double length) {
    for (int k = 0; k < n; k++) {
        silt_exchange_grain *g = tank_grain(t, length * silt_uniform(&t->random), length * silt_uniform(&t->random),
                                            1e-3 * (1 + silt_uniform(&t->random)), pow(10, 4 * silt_uniform(&t->random)));
        g->held = k % 7 == 0;
        g->spin[2] = 200 * (silt_uniform(&t->random) - 0.5);
        for (int d = 0; d < 2; d++) {
            g->v[d] = g->held ? 0 : silt_uniform(&t->random) - 0.5;
            g->contact[d] = g->mass * 20 * (silt_uniform(&t->random) - 0.5);
        }
    }
}

static void all_on(silt_forces *f) {
    f->def.added_mass = 0.5;
    f->def.viscous = f->def.lift = f->def.spin = true;
}

static void test_what_grains_gain_the_water_loses(void **unused) {
    (void)unused;
    for (int which = 0; which < 5; which++) {
        tank t;
        tank_open(&t, 16, 0.01, 0.5);
        tank_fill(&t, 203, 0.16);
        silt_exchange *e = &t.exchange;
        e->law = DRAG_DI_FELICE;
        if (which == 4)
            all_on(&e->force);
        else
            e->force.def = (silt_force_def){.added_mass = which == 0 ? 0.5 : 0, .theta = 0.55, .viscous = which == 1,
                                            .lift = which == 2, .spin = which == 3};
        const int n = t.mesh.n_node;
        const double dt = 2e-3;
        double *w = silt_alloc(2 * (size_t)n, sizeof *w), *p = silt_alloc((size_t)n, sizeof *p);
        OK(silt_exchange_prepare(e, &t.nodes, &t.mesh, dt, &error));
        for (int k = 0; k < 3; k++) {
            for (int i = 0; i < n; i++) {
                for (int d = 0; d < 2; d++)
                    w[2 * i + d] = silt_uniform(&t.random) - 0.5;
                p[i] = 5e3 * silt_uniform(&t.random);
            }
            e->drag.update(e->drag.self, w, p, dt);
        }
        // the moment of the torques alone: what push is more than without them, on the mesh that the update saw
        if (which == 3) {
            double moment = 0, torque = 0, size = 0;
            double *push = silt_alloc(2 * (size_t)n, sizeof *push);
            memcpy(push, e->push, 2 * (size_t)n * sizeof *push);
            e->force.def.spin = false;
            e->dt = NAN; // the update looks again
            e->drag.update(e->drag.self, w, p, dt);
            for (int i = 0; i < n; i++) {
                const double f[2] = {push[2 * i] - e->push[2 * i], push[2 * i + 1] - e->push[2 * i + 1]};
                const double x[2] = {t.nodes.x[2 * i] + 0.5 * dt * w[2 * i], t.nodes.x[2 * i + 1] + 0.5 * dt * w[2 * i + 1]};
                moment += x[0] * f[1] - x[1] * f[0];
            }
            e->force.def.spin = true;
            e->dt = NAN;
            e->drag.update(e->drag.self, w, p, dt);
            silt_exchange_load(e, w, p, dt, NULL);
            for (int k = 0; k < e->n_grain; k++) {
                torque += e->grain[k].torque[2];
                size += fabs(e->grain[k].torque[2]);
            }
            assert_true(size > 1e-9);
            near((moment + torque) / size, 0, 1e-9, "moment on grains and water");
            free(push);
        }
        // accepted without a further update
        for (int i = 0; i < 2 * n; i++)
            w[i] *= 1.1;
        silt_exchange_load(e, w, p, dt, NULL);
        double water[2] = {0}, grains[2] = {0}, size = 0;
        for (int k = 0; k < e->n_grain; k++)
            for (int d = 0; d < 2; d++) {
                grains[d] += e->grain[k].force[d] - e->grain[k].pressure[d];
                size += fabs(e->grain[k].force[d] - e->grain[k].pressure[d]);
            }
        for (int i = 0; i < n; i++)
            for (int d = 0; d < 2; d++)
                water[d] += e->drag.push[2 * i + d] - e->drag.coefficient[i] * w[2 * i + d];
        for (int d = 0; d < 2; d++) {
            near((water[d] + grains[d]) / size, 0, 1e-12, "force on grains and water");
            near((e->totals.water[d] - water[d]) / size, 0, 1e-12, "total on the water");
            near((e->totals.drag[d] - grains[d]) / size, 0, 1e-12, "total on the grains");
        }
        for (int i = 0; i < n; i++)
            assert_true(e->drag.coefficient[i] >= 0);
        free(w);
        free(p);
        tank_close(&t);
    }
}

// whole steps of the water with all forces on, grains of any density in it: what the fluid's ledger says it got is what they got,
// and the speeds stay in bounds
static void test_steps_of_the_water_close(void **unused) {
    (void)unused;
    tank t;
    tank_open(&t, 16, 0.01, 0.5);
    tank_fill(&t, 150, 0.16);
    silt_exchange *e = &t.exchange;
    e->law = DRAG_DI_FELICE;
    all_on(&e->force);
    for (int k = 0; k < e->n_grain; k++)
        e->grain[k].contact[0] = e->grain[k].contact[1] = 0;
    silt_scene scene = {.dimension = 2, .gravity = {0, -9.81, 0}};
    scene.fluid = (silt_fluid_def){.on = true, .density = 1000, .viscosity = 1e-3, .size = 0.01, .tolerance = 1e-9, .iterations = 40,
                                   .volume_steps = 15, .theta = 0.55};
    silt_walls walls = {0};
    silt_fluid fluid = {0};
    const double dt = 1e-3;
    for (int step = 0; step < 20; step++) {
        OK(silt_exchange_prepare(e, &t.nodes, &t.mesh, dt, &error));
        const silt_step now = {.scene = &scene, .walls = &walls, .mesh = &t.mesh, .drag = &e->drag, .nodes = &t.nodes, .dt = dt};
        OK(silt_fluid_step(&fluid, &now, &error));
        silt_exchange_load(e, fluid.w, t.nodes.p, dt, NULL);
        double size = 0, gained[2] = {0};
        for (int p = 0; p < e->n_grain; p++) {
            silt_exchange_grain *g = &e->grain[p];
            for (int d = 0; d < 2; d++) {
                gained[d] += g->force[d];
                size += fabs(g->force[d]);
                if (!g->held)
                    g->v[d] += dt * (g->force[d] / g->mass + e->gravity[d]);
            }
            assert_true(hypot(g->v[0], g->v[1]) < 2);
        }
        for (int d = 0; d < 2; d++)
            near((fluid.from_grains[d] + gained[d]) / size, 0, 1e-12, "force on water and grains");
    }
    silt_fluid_clear(&fluid);
    tank_close(&t);
}

// A block of water at rest and grains at 1 as heavy as the water, but small, spread as evenly as its masses: in a step of backward
// Euler on both sides the relative velocity falls to 1/(1 + 2 dt/tau), whatever dt/tau is: neither overshoots, momentum stays.
static void test_stiff_drag_on_both_sides(void **unused) {
    (void)unused;
    silt_scene scene = {.dimension = 2};
    scene.fluid = (silt_fluid_def){.on = true, .density = 1000, /* the drag alone is stiff */ .viscosity = 0, .size = 0.01, .tolerance = 1e-9, .iterations = 40,
                                   .volume_steps = 15, .theta = 1};
    silt_walls walls = {0};
    print_message("dt/tau      left     exact e^-2x   momentum open\n");
    for (double x = 1e-3; x < 2e6; x *= 10) {
        tank t;
        silt_fluid fluid = {0};
        tank_open(&t, 8, 0.01, 0.3);
        silt_exchange *e = &t.exchange;
        e->gravity[1] = 0;
        e->force.def.theta = 1;
        const double d = 1e-4, density = 1e10, mass = density * M_PI / 6 * d * d * d, tau = mass / (3 * M_PI * 1e-3 * d), dt = x * tau;
        const double speed = 1e-3 * 0.01 / dt; // the mesh stands nearly still
        double total = 0;
        for (int i = 0; i < t.mesh.n_node; i++) {
            // a grain at every node, which stands for as many as are as heavy as its water
            SILT_RESERVE(e->grain, e->grain_capacity, e->n_grain + 1);
            silt_exchange_grain *g = &e->grain[e->n_grain++];
            double water = 0;
            for (int k = t.mesh.node_cell_start[i]; k < t.mesh.node_cell_start[i + 1]; k++)
                water += 1000 * silt_cell_area(t.nodes.x, t.mesh.cell[t.mesh.node_cell[k]]) / 3;
            *g = (silt_exchange_grain){.x = {t.nodes.x[2 * i], t.nodes.x[2 * i + 1]}, .v = {speed, 0}, .diameter = d, .number = water / mass,
                                       .solid = water / density, .mass = water, .cell = t.mesh.node_cell[t.mesh.node_cell_start[i]]};
            for (int a = 0; a < 3; a++)
                g->weight[a] = t.mesh.cell[g->cell][a] == i;
            total += water * speed;
        }
        OK(silt_exchange_prepare(e, &t.nodes, &t.mesh, dt, &error));
        const silt_step now = {.scene = &scene, .walls = &walls, .mesh = &t.mesh, .drag = &e->drag, .nodes = &t.nodes, .dt = dt};
        OK(silt_fluid_step(&fluid, &now, &error));
        silt_exchange_load(e, fluid.w, t.nodes.p, dt, NULL);
        double momentum = 0, worst = 0, left = 0;
        for (int i = 0; i < t.mesh.n_node; i++) {
            const silt_exchange_grain *g = &e->grain[i];
            const double v = g->v[0] + dt * g->force[0] / g->mass, u = t.nodes.v[2 * i], gap = (v - u) / speed;
            momentum += g->mass * v + fluid.mass[i] * u;
            worst = silt_max(worst, fabs(gap - 1 / (1 + 2 * x)));
            left = silt_max(left, gap);
            assert_true(gap >= -1e-9 && v <= speed * (1 + 1e-9) && u >= -1e-9 * speed);
        }
        print_message("%-9.0e %.3e  %.3e     %.0e\n", x, left, exp(-2 * x), fabs(momentum / total - 1));
        near(worst, 0, 1e-6, "relative velocity after a step");
        near(momentum / total, 1, 1e-9, "momentum of grains and water");
        silt_fluid_clear(&fluid);
        tank_close(&t);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_added_mass_stokes),
        cmocka_unit_test(test_added_mass_of_water_that_accelerates),
        cmocka_unit_test(test_added_mass_is_stable),
        cmocka_unit_test(test_viscous_force),
        cmocka_unit_test(test_lift),
        cmocka_unit_test(test_spin),
        cmocka_unit_test(test_what_grains_gain_the_water_loses),
        cmocka_unit_test(test_steps_of_the_water_close),
        cmocka_unit_test(test_stiff_drag_on_both_sides),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
