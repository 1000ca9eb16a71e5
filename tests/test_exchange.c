// grains in water: what is spread is conserved, what grains gain the water loses, drag laws, stiff drag; outlines and clumps
#include "../dem-coupling/shape.h"
#include "fluid.h"

#include <setjmp.h>
#include <stdarg.h>
#include <unistd.h>

#include <cmocka.h>

#include "tank.h"

// H^-1 by elimination, from the definition, for wet nodes; row-major n x n
static double *tank_inverse(const tank *t, double width) {
    int n = t->mesh.n_node;
    double *h = silt_alloc((size_t)(n * n), sizeof *h), *inverse = silt_alloc((size_t)(n * n), sizeof *inverse);
    for (int i = 0; i < n; i++) {
        inverse[i * n + i] = 1;
        h[i * n + i] = t->mesh.wet[i] ? 0 : 1;
    }
    for (int e = 0; e < t->mesh.n_cell; e++) {
        const int *c = t->mesh.cell[e];
        double area = silt_cell_area(t->nodes.x, c);
        for (int a = 0; a < 3; a++)
            for (int b = 0; b < 3; b++) {
                // grad N_a . grad N_b = opposite edges' product / (4 A^2)
                const double *x = t->nodes.x;
                int a1 = c[(a + 1) % 3], a2 = c[(a + 2) % 3], b1 = c[(b + 1) % 3], b2 = c[(b + 2) % 3];
                double dot = (x[2 * a2] - x[2 * a1]) * (x[2 * b2] - x[2 * b1]) +
                             (x[2 * a2 + 1] - x[2 * a1 + 1]) * (x[2 * b2 + 1] - x[2 * b1 + 1]);
                h[c[a] * n + c[b]] += width * width / 4 * dot / (4 * area) + (a == b ? area / 3 : 0);
            }
    }
    for (int k = 0; k < n; k++)
        for (int i = 0; i < n; i++) {
            if (i == k)
                continue;
            double factor = h[i * n + k] / h[k * n + k];
            for (int j = 0; j < n; j++) {
                h[i * n + j] -= factor * h[k * n + j];
                inverse[i * n + j] -= factor * inverse[k * n + j];
            }
        }
    for (int i = 0; i < n; i++)
        for (int j = 0; j < n; j++)
            inverse[i * n + j] /= h[i * n + i];
    free(h);
    return inverse;
}

// ---------------------------------------------------------------- kernel

static void test_kernel_conserves(void **unused) {
    (void)unused;
    tank t;
    tank_open(&t, 24, 16, 0.01);
    tank_fill(&t, 200, 0.24, 0.16);
    double spread = 0, held = 0;
    OK(silt_exchange_prepare(&t.exchange, &t.nodes, &t.mesh, 1e-3, &error));
    for (int p = 0; p < t.exchange.n_grain; p++)
        spread += t.exchange.grain[p].cell >= 0 ? t.exchange.grain[p].solid : 0;
    for (int i = 0; i < t.mesh.n_node; i++) {
        held += t.exchange.kernel.volume[i] * t.exchange.solid[i];
        assert_true(t.exchange.solid[i] >= 0);
    }
    near(held / spread, 1, 1e-12, "solid volume in the water over that of the grains");
    // the drop in flight holds nothing
    near(t.exchange.solid[t.mesh.n_node - 1], 0, 0, "solid at a dry node");

    // H^-1 M 1 = 1: the weights of every grain add up to one
    double *one = silt_alloc((size_t)t.mesh.n_node, sizeof *one);
    for (int i = 0; i < t.mesh.n_node; i++)
        one[i] = t.exchange.kernel.volume[i];
    silt_kernel_smooth(&t.exchange.kernel, one);
    for (int i = 0; i < t.mesh.n_node - 1; i++)
        near(one[i], 1, 1e-12, "sum of a grain's weights");
    free(one);

    // moved a little, as another mesh, and where it stood: all conserve
    for (int round = 0; round < 3; round++) {
        for (int i = 0; i < t.mesh.n_node; i++)
            t.nodes.x[2 * i] *= round < 2 ? 1.01 : 1;
        t.mesh.revision += round == 1;
        held = 0;
        OK(silt_exchange_prepare(&t.exchange, &t.nodes, &t.mesh, 1e-3, &error));
        for (int i = 0; i < t.mesh.n_node; i++)
            held += t.exchange.kernel.volume[i] * t.exchange.solid[i];
        near(held / spread, 1, 1e-12, "solid volume after moving");
    }
    tank_close(&t);
}

// A long tank with grains at its end: the kernel holds the nodes near them only, and still conserves and closes. A uniform
// velocity and a linear pressure are felt exactly: water = u, force of pressure = -V grad p.
static void test_kernel_reaches_as_far_as_needed(void **unused) {
    (void)unused;
    tank t;
    tank_open(&t, 160, 6, 0.01);
    tank_fill(&t, 60, 0.3, 0.06);
    silt_exchange *e = &t.exchange;
    double *velocity = silt_alloc(2 * (size_t)t.mesh.n_node, sizeof *velocity);
    double *pressure = silt_alloc((size_t)t.mesh.n_node, sizeof *pressure);
    const double u[2] = {0.3, -0.2}, slope[2] = {70, -9810};
    for (int i = 0; i < t.mesh.n_node; i++) {
        memcpy(velocity + 2 * i, u, sizeof u);
        pressure[i] = slope[0] * t.nodes.x[2 * i] + slope[1] * t.nodes.x[2 * i + 1];
    }
    memcpy(t.nodes.v, velocity, 2 * (size_t)t.mesh.n_node * sizeof *velocity);
    memcpy(t.nodes.p, pressure, (size_t)t.mesh.n_node * sizeof *pressure);
    OK(silt_exchange_prepare(e, &t.nodes, &t.mesh, 1e-3, &error));
    assert_in_range(e->kernel.n_node, t.mesh.n_node / 4, t.mesh.n_node * 3 / 4);
    silt_exchange_load(e, velocity, pressure, 1e-3, NULL);
    double spread = 0, held = 0, given[2] = {0, 0}, taken[2] = {0, 0};
    for (int p = 0; p < e->n_grain; p++) {
        const silt_exchange_grain *g = &e->grain[p];
        for (int k = 0; k < 2 && g->cell >= 0; k++) {
            near(g->water[k], u[k], 1e-12, "uniform velocity at a grain");
            near(g->pressure[k] / (g->solid * slope[1]), -slope[k] / slope[1], 1e-10, "linear pressure at a grain");
            taken[k] += g->force[k] - g->pressure[k];
        }
        spread += g->cell >= 0 ? g->solid : 0;
    }
    for (int i = 0; i < t.mesh.n_node; i++) {
        held += e->kernel.volume[i] * e->solid[i];
        for (int k = 0; k < 2; k++)
            given[k] += e->push[2 * i + k] - e->coefficient[i] * u[k];
    }
    near(held / spread, 1, 1e-12, "solid volume");
    for (int k = 0; k < 2; k++)
        near((given[k] + taken[k]) / e->totals.size, 0, 1e-13, "drag on the water and on the grains");
    free(velocity);
    free(pressure);
    tank_close(&t);
}

static void test_kernel_against_elimination(void **unused) {
    (void)unused;
    tank t;
    tank_open(&t, 6, 5, 0.01);
    tank_fill(&t, 7, 0.06, 0.05);
    silt_exchange *e = &t.exchange;
    int n = t.mesh.n_node;
    double *velocity = silt_alloc(2 * (size_t)n, sizeof *velocity), *pressure = silt_alloc((size_t)n, sizeof *pressure);
    tank_stir(&t, velocity, pressure);
    double dt = 2e-3, *inverse = tank_inverse(&t, e->width);
    OK(silt_exchange_prepare(e, &t.nodes, &t.mesh, dt, &error));
    e->drag.update(e->drag.self, velocity, pressure, dt);
    double worst_solid = 0, worst_coefficient = 0, worst_push = 0, worst_velocity = 0;
    silt_exchange_load(e, velocity, pressure, dt, NULL);
    for (int i = 0; i < n; i++) {
        double solid = 0, coefficient = 0, push[2] = {0, 0}, volume = e->kernel.volume[i];
        for (int p = 0; p < e->n_grain; p++) {
            const silt_exchange_grain *g = &e->grain[p];
            if (g->cell < 0)
                continue;
            double spread = 0;
            for (int a = 0; a < 3; a++)
                spread += inverse[i * n + t.mesh.cell[g->cell][a]] * g->weight[a];
            solid += g->solid * spread;
            coefficient += g->effective * volume * spread;
            for (int d = 0; d < 2; d++)
                push[d] += g->effective * g->free[d] * volume * spread;
        }
        worst_solid = silt_max(worst_solid, fabs(solid - e->solid[i]) / 1e-3);
        worst_coefficient = silt_max(worst_coefficient, fabs(coefficient - e->coefficient[i]));
        for (int d = 0; d < 2; d++)
            worst_push = silt_max(worst_push, fabs(push[d] - e->push[2 * i + d]));
    }
    for (int p = 0; p < e->n_grain; p++) {
        const silt_exchange_grain *g = &e->grain[p];
        for (int d = 0; d < 2 && g->cell >= 0; d++) {
            double u = 0;
            for (int i = 0; i < n; i++)
                for (int a = 0; a < 3; a++)
                    u += e->kernel.volume[i] * inverse[i * n + t.mesh.cell[g->cell][a]] * g->weight[a] *
                         velocity[2 * i + d];
            double drag = g->force[d] - g->pressure[d];
            worst_velocity = silt_max(worst_velocity, fabs(drag - g->effective * (u - g->free[d])) / g->effective);
        }
    }
    near(worst_solid, 0, 1e-12, "solid fraction");
    near(worst_coefficient, 0, 1e-12, "coefficient");
    near(worst_push, 0, 1e-12, "push");
    near(worst_velocity, 0, 1e-12, "sampled velocity");
    free(inverse);
    free(velocity);
    free(pressure);
    tank_close(&t);
}

static void test_kernel_in_layers(void **unused) {
    (void)unused;
    // conserves, and takes means along x: what grains hold hangs on the height alone
    tank t;
    tank_open(&t, 24, 16, 0.01);
    t.exchange.layer_grain = 0.002;
    t.exchange.width = 0.013;
    tank_fill(&t, 200, 0.24, 0.16);
    OK(silt_exchange_prepare(&t.exchange, &t.nodes, &t.mesh, 1e-3, &error));
    double spread = 0, held = 0;
    for (int p = 0; p < t.exchange.n_grain; p++)
        spread += t.exchange.grain[p].cell >= 0 ? t.exchange.grain[p].solid : 0;
    for (int i = 0; i < t.mesh.n_node; i++)
        held += t.exchange.kernel.volume[i] * t.exchange.solid[i];
    near(held / spread, 1, 1e-12, "solid volume in the water over that of the grains");
    for (int i = 1; i <= 24; i++)
        near(t.exchange.solid[i] - t.exchange.solid[0], 0, 1e-15, "solid along the floor");
    assert_true(t.exchange.solid[0] > 0);
    tank_close(&t);
}

static void test_kernel_refuses_a_flat_cell(void **unused) {
    (void)unused;
    tank t;
    tank_open(&t, 4, 4, 0.01);
    tank_grain(&t, 0.021, 0.022, 1e-3);
    t.nodes.x[2 * 6] = 1; // inside node 6 far out: cells around it turn over
    error = (silt_error){0};
    assert_int_equal(silt_exchange_prepare(&t.exchange, &t.nodes, &t.mesh, 1e-3, &error), SILT_FAILED);
    assert_non_null(strstr(error.text, "area"));
    tank_close(&t);
}

// ---------------------------------------------------------------- momentum and continuity

static void test_what_grains_gain_the_water_loses(void **unused) {
    (void)unused;
    tank t;
    tank_open(&t, 24, 16, 0.01);
    tank_fill(&t, 300, 0.24, 0.16);
    silt_exchange *e = &t.exchange;
    int n = t.mesh.n_node;
    double dt = 2e-3;
    double *velocity = silt_alloc(2 * (size_t)n, sizeof *velocity), *pressure = silt_alloc((size_t)n, sizeof *pressure);
    OK(silt_exchange_prepare(e, &t.nodes, &t.mesh, dt, &error));
    // iterates as a solver makes them, with the coefficients of the start and with new ones; the last velocity is
    // accepted without a further update
    for (int refresh = 0; refresh < 2; refresh++) {
        e->refresh = refresh;
        for (int k = 0; k < 3; k++) {
            tank_stir(&t, velocity, pressure);
            e->drag.update(e->drag.self, velocity, pressure, dt);
        }
        double *x = silt_alloc(2 * (size_t)n, sizeof *x);
        for (int i = 0; i < 2 * n; i++)
            x[i] = t.nodes.x[i] + 0.5 * dt * velocity[i];
        for (int i = 0; i < 2 * n; i++)
            velocity[i] *= 1.1;
        silt_exchange_load(e, velocity, pressure, dt, NULL);

        // drag
        double scale = 0, water[2] = {0, 0}, drag[2] = {0, 0}, gradient[2] = {0, 0}, lost[2] = {0, 0}, pull = 0;
        for (int p = 0; p < e->n_grain; p++)
            for (int d = 0; d < 2; d++) {
                drag[d] += e->grain[p].force[d] - e->grain[p].pressure[d];
                gradient[d] += e->grain[p].pressure[d];
                scale += fabs(e->grain[p].force[d] - e->grain[p].pressure[d]);
                pull += fabs(e->grain[p].pressure[d]);
            }
        for (int i = 0; i < n; i++)
            for (int d = 0; d < 2; d++)
                water[d] += e->drag.push[2 * i + d] - e->drag.coefficient[i] * velocity[2 * i + d];
        for (int d = 0; d < 2; d++) {
            near(water[d] / scale, -drag[d] / scale, 1e-12, "drag on the water");
            near(e->totals.drag[d] / scale, drag[d] / scale, 1e-12, "total of drag");
            near(e->totals.water[d] / scale, water[d] / scale, 1e-12, "total on the water");
        }

        // pressure gradient: what the water's term loses on the midpoint mesh, elementwise as the fluid sums it
        for (int c = 0; c < t.mesh.n_cell; c++) {
            const int *node = t.mesh.cell[c];
            double area = silt_cell_area(x, node), solid = 0;
            for (int a = 0; a < 3; a++)
                for (int b = 0; b < 3; b++)
                    solid += e->drag.solid[node[b]] * (a == b ? 2 : 1) / 12;
            for (int a = 0; a < 3; a++) {
                const double *b1 = x + 2 * node[(a + 1) % 3], *b2 = x + 2 * node[(a + 2) % 3];
                lost[0] += solid * pressure[node[a]] * (b1[1] - b2[1]) / 2;
                lost[1] += solid * pressure[node[a]] * (b2[0] - b1[0]) / 2;
            }
            assert_true(area > 0);
        }
        for (int d = 0; d < 2; d++) {
            near(lost[d] / pull, -gradient[d] / pull, 1e-12, "pressure force on the water");
            near(e->totals.pressure[d] / pull, gradient[d] / pull, 1e-12, "total of the pressure gradient");
        }

        // continuity: grains move volume about, they make none
        double sum = 0, size = 0;
        for (int i = 0; i < n; i++) {
            sum += e->drag.source[i];
            size += fabs(e->drag.source[i]);
        }
        near(sum / size, 0, 1e-12, "sum of the source");
        free(x);
    }
    free(velocity);
    free(pressure);
    tank_close(&t);
}

static void test_still_water_lifts_and_uniform_flow_carries(void **unused) {
    (void)unused;
    tank t;
    tank_open(&t, 24, 16, 0.01);
    tank_fill(&t, 50, 0.24, 0.16);
    silt_exchange *e = &t.exchange;
    int n = t.mesh.n_node;
    double dt = 1e-3, flow[2] = {0.3, -0.2};
    for (int i = 0; i < n; i++) {
        t.nodes.p[i] = 1000 * 9.81 * (0.16 - t.nodes.x[2 * i + 1]);
        for (int d = 0; d < 2; d++)
            t.nodes.v[2 * i + d] = flow[d];
    }
    for (int p = 0; p < e->n_grain; p++)
        for (int d = 0; d < 2; d++) {
            e->grain[p].v[d] = flow[d];
            // held by contact against its submerged weight
            e->grain[p].contact[d] = d == 1 ? (e->grain[p].mass - 1000 * e->grain[p].solid) * 9.81 : 0;
        }
    OK(silt_exchange_prepare(e, &t.nodes, &t.mesh, dt, &error));
    silt_exchange_load(e, t.nodes.v, t.nodes.p, dt, NULL);
    for (int p = 0; p < e->n_grain; p++) {
        const silt_exchange_grain *g = &e->grain[p];
        if (g->cell < 0) {
            near(hypot(g->force[0], g->force[1]), 0, 0, "force in the air");
            continue;
        }
        double weight = 1000 * 9.81 * g->solid;
        near(g->force[0] / weight, 0, 1e-11, "sideways force");
        near(g->force[1] / weight, 1, 1e-11, "Archimedes' force over the weight of the water");
    }

    // grains that move as one with speed c: source_j = sum over cells of area grad N_j . c (mean of solid)
    double scale = 0, worst = 0, *source = silt_alloc((size_t)n, sizeof *source);
    for (int c = 0; c < t.mesh.n_cell; c++) {
        const int *node = t.mesh.cell[c];
        double solid = (e->solid[node[0]] + e->solid[node[1]] + e->solid[node[2]]) / 3;
        for (int a = 0; a < 3; a++) {
            const double *b1 = t.nodes.x + 2 * node[(a + 1) % 3], *b2 = t.nodes.x + 2 * node[(a + 2) % 3];
            source[node[a]] += solid * (flow[0] * (b1[1] - b2[1]) + flow[1] * (b2[0] - b1[0])) / 2;
        }
    }
    for (int i = 0; i < n; i++) {
        scale = silt_max(scale, fabs(source[i]));
        worst = silt_max(worst, fabs(source[i] - e->source[i]));
    }
    near(worst / scale, 0, 1e-11, "source of grains that move as one");
    free(source);
    tank_close(&t);
}

static void test_a_step_of_the_water_closes(void **unused) {
    (void)unused;
    // a block of water with grains falls and is sheared: what the fluid's own ledger says it got from the grains
    tank t;
    tank_open(&t, 24, 16, 0.01);
    tank_fill(&t, 200, 0.24, 0.16);
    silt_exchange *e = &t.exchange;
    silt_scene scene = {.dimension = 2, .gravity = {0, -9.81, 0}};
    scene.fluid = (silt_fluid_def){.on = true,
                                   .density = 1000,
                                   .viscosity = 1e-3,
                                   .size = 0.01,
                                   .tolerance = 1e-9,
                                   .iterations = 40,
                                   .volume_steps = 15};
    silt_walls walls = {0};
    silt_fluid fluid = {0};
    double dt = 1e-3;
    for (int scheme = SCHEME_IMPLICIT; scheme <= SCHEME_FRACTIONAL; scheme++)
        for (int refresh = 0; refresh < 2; refresh++)
            for (int half = 0; half < 2; half++) {
                scene.fluid.scheme = scheme;
                scene.fluid.theta = half ? 0.5 : 1;
                e->refresh = refresh;
                for (int i = 0; i < t.nodes.count; i++) {
                    t.nodes.v[2 * i] = 3 * t.nodes.x[2 * i + 1];
                    t.nodes.v[2 * i + 1] = -0.5 * sin(20 * t.nodes.x[2 * i]);
                    t.nodes.p[i] = 0;
                }
                OK(silt_exchange_prepare(e, &t.nodes, &t.mesh, dt, &error));
                const silt_step step = {.scene = &scene, .walls = &walls, .mesh = &t.mesh, .drag = &e->drag, .nodes = &t.nodes, .dt = dt};
                OK(silt_fluid_step(&fluid, &step, &error));
                silt_exchange_load(e, fluid.w, t.nodes.p, dt, NULL);
                double scale = 0, gained[2] = {0, 0};
                for (int p = 0; p < e->n_grain; p++)
                    for (int d = 0; d < 2; d++) {
                        gained[d] += e->grain[p].force[d];
                        scale += fabs(e->grain[p].force[d]);
                    }
                assert_true(scale > 1e-3);
                for (int d = 0; d < 2; d++)
                    near((fluid.from_grains[d] + gained[d]) / scale, 0, 1e-12, "force on water and grains");
            }
    silt_fluid_clear(&fluid);
    tank_close(&t);
}

// grains crowd at a node until there is more solid than room: the water's masses stay above nought, the step is taken and closes
static void test_a_crowd_leaves_the_water_its_mass(void **unused) {
    (void)unused;
    tank t;
    tank_open(&t, 24, 16, 0.01);
    silt_exchange *e = &t.exchange;
    for (int k = 0; k < 40; k++) {
        silt_exchange_grain *g = tank_grain(&t, 0.12 + 1e-4 * k, 0.08, 0.01);
        g->solid *= 10;
        g->mass *= 10;
        g->number *= 10;
    }
    silt_scene scene = {.dimension = 2, .gravity = {0, -9.81, 0}};
    scene.fluid = (silt_fluid_def){.on = true, .density = 1000, .viscosity = 1e-3, .size = 0.01, .tolerance = 1e-9, .iterations = 40,
                                   .volume_steps = 15, .theta = 0.55};
    silt_walls walls = {0};
    silt_fluid fluid = {0};
    const double dt = 1e-3;
    OK(silt_exchange_prepare(e, &t.nodes, &t.mesh, dt, &error));
    double most = 0, volume = 0, scale = 0, gained[2] = {0, 0};
    for (int i = 0; i < t.mesh.n_node; i++) {
        most = silt_max(most, e->solid[i]);
        volume += e->kernel.volume[i] * e->solid[i];
    }
    near(volume / (40 * e->grain[0].solid), 1, 1e-12, "solid volume");
    assert_true(most > 1.5);
    const silt_step step = {.scene = &scene, .walls = &walls, .mesh = &t.mesh, .drag = &e->drag, .nodes = &t.nodes, .dt = dt};
    OK(silt_fluid_step(&fluid, &step, &error));
    silt_exchange_load(e, fluid.w, t.nodes.p, dt, NULL);
    for (int i = 0; i < t.mesh.n_node - 1; i++) {
        assert_true(fluid.mass[i] >= 0.0499 * 1000 * fluid.volume[i]);
        assert_true(hypot(t.nodes.v[2 * i], t.nodes.v[2 * i + 1]) < 0.1);
    }
    for (int p = 0; p < e->n_grain; p++)
        for (int d = 0; d < 2; d++) {
            gained[d] += e->grain[p].force[d];
            scale += fabs(e->grain[p].force[d]);
        }
    for (int d = 0; d < 2; d++)
        near((fluid.from_grains[d] + gained[d]) / scale, 0, 1e-12, "force on water and grains");
    silt_fluid_clear(&fluid);
    tank_close(&t);
}

// ---------------------------------------------------------------- drag laws

static void test_drag_laws(void **unused) {
    (void)unused;
    // beta in kg/s of a grain of 1 mm in water at three Reynolds numbers d w rho/mu, from the formulas as printed (Cd,
    // not its product with the speed), computed apart from this code
    const double re[3] = {0.1, 50, 2000}, porosity[3] = {1, 0.7, 0.4};
    const double schiller[3] = {9.715422646451145e-06, 3.020043557511725e-05, 0.00034557519189487725};
    const double felice[3][3] = {{9.814427941785413e-06, 2.5203469730952546e-05, 0.00011209963066205573},
                                 {3.363499762488841e-05, 5.9335200898607666e-05, 0.00015084307028060835},
                                 {0.0004269875166281216, 0.0007800338263765984, 0.0019089272065013069}};
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 3; k++) {
            double w = re[i] * 1e-3, solid = 1 - porosity[k];
            near(silt_drag_factor(DRAG_SCHILLER_NAUMANN, 1000, 1e-3, 1e-3, solid, w) / schiller[i], 1, 1e-12,
                 "Schiller-Naumann");
            near(silt_drag_factor(DRAG_DI_FELICE, 1000, 1e-3, 1e-3, solid, w) / felice[i][k], 1, 1e-12, "Di Felice");
        }

    // at rest: Stokes; Di Felice has 4.8^2/24 = 0.96 of it and eps^(1 - 3.7) of that (Re holds one eps)
    double stokes = 3 * M_PI * 1e-3 * 1e-3;
    near(silt_drag_factor(DRAG_SCHILLER_NAUMANN, 1000, 1e-3, 1e-3, 0, 0) / stokes, 1, 1e-14, "Stokes");
    near(silt_drag_factor(DRAG_DI_FELICE, 1000, 1e-3, 1e-3, 0.4, 0) / stokes, 0.96 * pow(0.6, 1 - 3.7), 1e-12,
         "Di Felice at rest");
    near(silt_drag_factor(DRAG_NONE, 1000, 1e-3, 1e-3, 0.4, 1), 0, 0, "no drag");
    // denser than any packing counts as 0.75
    near(silt_drag_factor(DRAG_DI_FELICE, 1000, 1e-3, 1e-3, 1.3, 1),
         silt_drag_factor(DRAG_DI_FELICE, 1000, 1e-3, 1e-3, 0.75, 1), 0, "packed beyond 0.75");
}

static void test_terminal_velocity(void **unused) {
    (void)unused;
    // one grain in deep still water, stepped by the exchange itself: v_end = v_free + dt/m F_drag
    for (size_t k = 0; k < sizeof terminal / sizeof *terminal; k++)
        for (int law = DRAG_SCHILLER_NAUMANN; law <= DRAG_DI_FELICE; law++) {
            double d = terminal[k][0], expected = terminal[k][law];
            tank t;
            tank_open(&t, 8, 8, 0.5);
            t.exchange.law = law;
            silt_exchange_grain *g = tank_grain(&t, 2.1, 2.2, d);
            g->contact[0] = g->contact[1] = 0;
            for (int i = 0; i < t.mesh.n_node; i++)
                t.nodes.p[i] = 1000 * 9.81 * (4 - t.nodes.x[2 * i + 1]);
            double dt = 0.1 * expected / 9.81;
            for (int step = 0; step < 400; step++) {
                OK(silt_exchange_prepare(&t.exchange, &t.nodes, &t.mesh, dt, &error));
                silt_exchange_load(&t.exchange, t.nodes.v, t.nodes.p, dt, NULL);
                g->v[1] += dt * (g->force[1] / g->mass - 9.81);
            }
            near(-g->v[1] / expected, 1, 1e-5, "terminal velocity");
            tank_close(&t);
        }
}

static void test_stiff_drag_never_overshoots(void **unused) {
    (void)unused;
    // water at 1 m/s, a grain at rest, no gravity: v_end = x/(1 + x) with x = dt/tau, never beyond the water's; Re = 900 (the
    // law jumps at 1000)
    for (double x = 1e-3; x < 2e6; x *= 10) {
        tank t;
        tank_open(&t, 8, 8, 0.01);
        t.exchange.law = DRAG_SCHILLER_NAUMANN;
        t.exchange.gravity[1] = 0;
        silt_exchange_grain *g = tank_grain(&t, 0.041, 0.042, 0.9e-3);
        for (int i = 0; i < t.mesh.n_node; i++)
            t.nodes.v[2 * i] = 1;
        double beta = g->number * silt_drag_factor(DRAG_SCHILLER_NAUMANN, 1000, 1e-3, 0.9e-3, 0, 1),
               dt = x * g->mass / beta;
        // one node of the mesh must not travel: the geometry is not what is asked about
        OK(silt_exchange_prepare(&t.exchange, &t.nodes, &t.mesh, dt, &error));
        silt_exchange_load(&t.exchange, t.nodes.v, t.nodes.p, dt, NULL);
        double end = dt * g->force[0] / g->mass;
        near(end, x / (1 + x), 1e-9, "velocity after one step");
        assert_true(end <= 1);

        // and step after step from far beyond
        g->v[0] = -30;
        double gap = 31;
        for (int step = 0; step < 20; step++) {
            OK(silt_exchange_prepare(&t.exchange, &t.nodes, &t.mesh, dt, &error));
            silt_exchange_load(&t.exchange, t.nodes.v, t.nodes.p, dt, NULL);
            g->v[0] += dt * g->force[0] / g->mass;
            assert_true(1 - g->v[0] <= gap && g->v[0] <= 1 + 1e-9);
            gap = 1 - g->v[0];
        }
        tank_close(&t);
    }
}

// ---------------------------------------------------------------- outlines and clumps

static silt_outline shape_of(silt_shape kind, double scale, double height) {
    silt_outline shape;
    silt_body_def def = {.name = "it", .shape = kind, .scale = scale, .height = height};
    OK(silt_outline_create(&shape, &def, &error));
    return shape;
}

// extent, centroid at the origin, and every corner counter-clockwise about something
static void shape_extent(const silt_outline *shape, double width, double height) {
    double lo[2] = {HUGE_VAL, HUGE_VAL}, hi[2] = {-HUGE_VAL, -HUGE_VAL};
    for (int i = 0; i < shape->n_point; i++)
        for (int d = 0; d < 2; d++) {
            lo[d] = silt_min(lo[d], shape->point[2 * i + d]);
            hi[d] = silt_max(hi[d], shape->point[2 * i + d]);
        }
    near(hi[0] - lo[0], width, 1e-14, "width");
    near(hi[1] - lo[1], height, 1e-14, "height");
}

static void test_outlines(void **unused) {
    (void)unused;
    // box: b h, b h (b^2 + h^2)/12
    silt_outline box = shape_of(SHAPE_BOX, 0.4, 0.3);
    near(box.area, 0.12, 1e-15, "area of a box");
    near(box.inertia, 0.12 * (0.16 + 0.09) / 12, 1e-16, "inertia of a box");
    shape_extent(&box, 0.4, 0.3);
    silt_outline_clear(&box);
    box = shape_of(SHAPE_BOX, 0.4, 0);
    shape_extent(&box, 0.4, 0.4);
    silt_outline_clear(&box);

    // disc: regular polygon of the circle's area; of n points on radius r: n/2 r^2 sin(2 pi/n), A r^2 (2 + cos(2 pi/n))/6
    silt_outline disc = shape_of(SHAPE_DISC, 0.2, 0);
    double step = 2 * M_PI / disc.n_point, area = M_PI * 0.01, square = 2 * area / (disc.n_point * sin(step));
    assert_true(disc.n_point >= 64);
    near(disc.area, area, 1e-15, "area of a disc");
    near(disc.inertia, area * square * (2 + cos(step)) / 6, 1e-16, "inertia of a disc");
    silt_outline_clear(&disc);

    // triangle given anywhere and clockwise, base 3, height 2, scaled to 0.6: A = bh/2, about the centroid bh(b^2 - ba
    // + a^2 + h^2)/36
    double point[9] = {10, 5, 0, 11, 7, 0, 13, 5, 0};
    silt_body_def def = {.name = "it", .shape = SHAPE_POLYGON, .scale = 0.6, .n_point = 3, .point = point};
    silt_outline triangle;
    OK(silt_outline_create(&triangle, &def, &error));
    double b = 0.6, h = 0.4, a = 0.2;
    near(triangle.area, b * h / 2, 1e-15, "area of a triangle");
    near(triangle.inertia, b * h * (b * b - b * a + a * a + h * h) / 36, 1e-15, "inertia of a triangle");
    shape_extent(&triangle, 0.6, 0.4);
    silt_outline_clear(&triangle);

    // temple of width 1: three columns 0.12 x 0.40, slab 1 x 0.12, gable 1 x 0.23; parts by the parallel axis theorem
    silt_outline temple = shape_of(SHAPE_TEMPLE, 1, 0);
    double column = 0.12 * 0.40, slab = 0.12, gable = 0.115, whole = 3 * column + slab + gable;
    double y = (3 * column * 0.20 + slab * 0.46 + gable * (0.52 + 0.23 / 3)) / whole;
    double inertia = 3 * column * ((0.12 * 0.12 + 0.40 * 0.40) / 12 + silt_square(y - 0.20)) +
                     2 * column * 0.44 * 0.44 + slab * ((1 + 0.12 * 0.12) / 12 + silt_square(y - 0.46)) +
                     0.23 * (1 - 0.5 + 0.25 + 0.23 * 0.23) / 36 + gable * silt_square(y - 0.52 - 0.23 / 3);
    near(temple.area, whole, 1e-15, "area of the temple");
    near(temple.inertia, inertia, 1e-15, "inertia of the temple");
    shape_extent(&temple, 1, 0.75);
    silt_outline_clear(&temple);

    // polygons that are none
    double bow[12] = {0, 0, 0, 1, 1, 0, 1, 0, 0, 0, 1, 0};
    def = (silt_body_def){.name = "bow", .shape = SHAPE_POLYGON, .n_point = 4, .point = bow};
    error = (silt_error){0};
    assert_int_equal(silt_outline_create(&temple, &def, &error), SILT_INPUT);
    assert_non_null(strstr(error.text, "bow"));
    def.n_point = 2;
    assert_int_equal(silt_outline_create(&temple, &def, &error), SILT_INPUT);
    silt_outline_clear(&temple);
}

static void test_outline_nodes(void **unused) {
    (void)unused;
    silt_outline box = shape_of(SHAPE_BOX, 0.4, 0.3), disc = shape_of(SHAPE_DISC, 0.2, 0);
    double point[200];
    // 4 + 3 + 4 + 3 pieces of 0.1, corners kept
    assert_int_equal(silt_outline_nodes(&box, 0.1, point, 100), 14);
    near(point[0], -0.2, 1e-15, "corner");
    near(point[2 * 4], 0.2, 1e-15, "corner");
    near(point[2 * 7 + 1], 0.15, 1e-15, "corner");
    // a disc has no corners: spacing of h whatever its polygon
    int n = silt_outline_nodes(&disc, 0.05, point, 100);
    assert_int_equal(n, 13);
    assert_int_equal(silt_outline_nodes(&disc, 0.05, NULL, 0), 13);
    for (int i = 0; i < n; i++) {
        const double *a = point + 2 * i, *b = point + 2 * ((i + 1) % n);
        // 13 points around the circle's area
        near(hypot(a[0] - b[0], a[1] - b[1]), 2 * sin(M_PI / 13) * sqrt(2 * M_PI * 0.01 / (13 * sin(2 * M_PI / 13))), 1e-4, "spacing on a disc");
    }
    assert_int_equal(silt_outline_nodes(&disc, 5, NULL, 0), 3);
    near(silt_outline_distance(&box, (double[2]){0.5, 0}), 0.3, 1e-15, "distance");
    near(silt_outline_distance(&box, (double[2]){0.5, 0.55}), 0.5, 1e-15, "distance from a corner");
    near(silt_outline_distance(&box, (double[2]){0.1, -0.1}), 0, 0, "distance inside");
    silt_outline_clear(&box);
    silt_outline_clear(&disc);
}

static void test_clumps(void **unused) {
    (void)unused;
    const silt_shape kind[3] = {SHAPE_BOX, SHAPE_DISC, SHAPE_TEMPLE};
    // 0.06 of the width, of the disc's polygon
    const double radius[3] = {0.06, 0.06 * sqrt(M_PI / 64 / sin(M_PI / 64)), 0.03}, height[3] = {0.3, 0, 0};
    // smooth: the scallop between spheres spacing apart, r (1 - sqrt(1 - (s/2)^2)); corner of 90 degrees: 0.414 of the
    // smallest
    const double spacing[3] = {0.4, 0.3, 0.2};
    for (int k = 0; k < 3; k++)
        for (int s = 0; s < 3; s++) {
            silt_outline shape = shape_of(kind[k], 1, height[k]);
            silt_clump clump = {0};
            silt_clump_create(&clump, &shape, 0, spacing[s]);
            near(clump.largest, radius[k], 1e-12, "radius of the clump's spheres");
            assert_true(clump.smallest >= 0.2499 * clump.largest);
            // nothing stands out
            for (int i = 0; i < clump.n_sphere; i++) {
                const double *c = clump.sphere + 3 * i;
                assert_true(silt_outline_distance(&shape, c) == 0);
                for (int m = 0; m < shape.n_point; m++) {
                    const double *a = shape.point + 2 * m, *b = shape.point + 2 * ((m + 1) % shape.n_point);
                    double e[2] = {b[0] - a[0], b[1] - a[1]};
                    double t =
                        silt_clamp((e[0] * (c[0] - a[0]) + e[1] * (c[1] - a[1])) / (e[0] * e[0] + e[1] * e[1]), 0, 1);
                    assert_true(hypot(c[0] - a[0] - t * e[0], c[1] - a[1] - t * e[1]) >= c[2] * (1 - 2.1e-3));
                }
            }
            double scallop = clump.largest * (1 - sqrt(1 - silt_square(spacing[s] / 2)));
            double bound = kind[k] == SHAPE_DISC ? 1.3 * scallop + 2e-4 : 0.13 * clump.largest;
            if (!(clump.error <= bound))
                fail_msg("shape %d spacing %g: error %g of the radius, %d spheres", kind[k], spacing[s],
                         clump.error / clump.largest, clump.n_sphere);
            print_message("shape %d, spacing %.1f r: %4d spheres, error %.3f r\n", kind[k], spacing[s], clump.n_sphere,
                          clump.error / clump.largest);
            silt_clump_clear(&clump);
            silt_outline_clear(&shape);
        }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_kernel_conserves),
        cmocka_unit_test(test_kernel_reaches_as_far_as_needed),
        cmocka_unit_test(test_kernel_against_elimination),
        cmocka_unit_test(test_kernel_in_layers),
        cmocka_unit_test(test_kernel_refuses_a_flat_cell),
        cmocka_unit_test(test_what_grains_gain_the_water_loses),
        cmocka_unit_test(test_still_water_lifts_and_uniform_flow_carries),
        cmocka_unit_test(test_a_step_of_the_water_closes),
        cmocka_unit_test(test_a_crowd_leaves_the_water_its_mass),
        cmocka_unit_test(test_drag_laws),
        cmocka_unit_test(test_terminal_velocity),
        cmocka_unit_test(test_stiff_drag_never_overshoots),
        cmocka_unit_test(test_outlines),
        cmocka_unit_test(test_outline_nodes),
        cmocka_unit_test(test_clumps),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
