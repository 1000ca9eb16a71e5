// distance to walls, eddy and apparent viscosity, law of the wall: exact values, and uniform channels and films between them
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <cmocka.h>

#include "delaunay.h"
#include "water_column.h"

// ---- distances

static void test_facet_distance(void **state) {
    (void)state;
    const double segment[4] = {0, 0, 2, 0}, p[3][2] = {{1, 3}, {-3, 4}, {5, -4}};
    NEAR(silt_facet_distance(2, p[0], segment), 3, 1e-15);
    NEAR(silt_facet_distance(2, p[1], segment), 5, 1e-15);
    NEAR(silt_facet_distance(2, p[2], segment), 5, 1e-15);
    // face, edge and corner of a triangle
    const double triangle[9] = {0, 0, 0, 4, 0, 0, 0, 4, 0}, q[3][3] = {{1, 1, -2}, {2, -3, 4}, {-2, -3, 6}};
    NEAR(silt_facet_distance(3, q[0], triangle), 2, 1e-15);
    NEAR(silt_facet_distance(3, q[1], triangle), 5, 1e-15);
    NEAR(silt_facet_distance(3, q[2], triangle), 7, 1e-15);
    const double beyond[3] = {4, 4, 0};
    NEAR(silt_facet_distance(3, beyond, triangle), sqrt(8), 1e-15);
}

static void test_depth_of_a_periodic_column(void **state) {
    (void)state;
    for (int dim = 2; dim <= 3; dim++) {
        column c;
        column_open(&c, dim, 9, 0.4);
        column_place(&c);
        for (int i = 0; i < c.nodes.count; i++) {
            const double y = c.nodes.x[dim * i + dim - 1];
            NEAR(c.depth.wall[i], y, 1e-14);
            NEAR(c.depth.surface[i], 0.4 - y, 1e-14);
        }
        // a wall that water slides along is none
        c.walls.roughness[0] = -1;
        column_place(&c);
        for (int i = 0; i < c.nodes.count; i++)
            assert_true(c.depth.wall[i] == HUGE_VAL && c.depth.wall_facet[i] == -1);
        NEAR(silt_mixing_length(c.depth.wall[20], c.depth.surface[20]), 0, 0);
        column_close(&c);
    }
}

// eddies between grains: the integral of 1 - solid/limit from the wall, here of a layer whose share falls linearly to nought over two
// rows, and of one so dense that nothing is left below
static void test_grains_leave_eddies_less_room(void **state) {
    (void)state;
    for (int dim = 2; dim <= 3; dim++) {
        column c;
        column_open(&c, dim, 17, 0.4);
        column_place(&c);
        double *solid = silt_alloc((size_t)c.nodes.count, sizeof *solid);
        const double step = 0.4 / 16, top = 4 * step;
        for (int dense = 0; dense < 2; dense++) {
            const double most = dense ? 0.7 : 0.3, limit = 0.6;
            for (int i = 0; i < c.nodes.count; i++) {
                const double y = c.nodes.x[dim * i + dim - 1];
                solid[i] = most * silt_clamp((top + 2 * step - y) / (2 * step), 0, 1);
            }
            silt_depth_crowd(&c.depth, &c.mesh, c.nodes.x, solid, limit);
            for (int i = 0; i < c.nodes.count; i++) {
                const double y = c.nodes.x[dim * i + dim - 1], k = round((y - top) / step);
                // 1 - share/limit is 1/2, 3/4, 1 on the rows from the layer's top; 0, 1 - 7/12, 1 over the dense one
                const double half = k <= 0 ? 0.5 * y : top / 2 + (k <= 2 ? 0.5 * k + k * k / 8 : 1.5 + k - 2) * step;
                const double row = 5.0 / 12, none = k <= 0 ? 0 : ((k < 1.5 ? row / 2 : row + 0.5) + (k > 2.5 ? k - 2 : 0)) * step;
                NEAR(c.depth.room[i], dense ? none : half, 1e-12);
            }
            // without grains it is the distance again
            memset(solid, 0, (size_t)c.nodes.count * sizeof *solid);
            silt_depth_crowd(&c.depth, &c.mesh, c.nodes.x, solid, limit);
            for (int i = 0; i < c.nodes.count; i++)
                NEAR(c.depth.room[i], c.depth.wall[i], 1e-12);
        }
        free(solid);
        column_close(&c);
    }
}

// a cloud inside a bent outline, walls below and surface above, against trying all facets: a cloud as the solver has it, then
// one that is scattered without any order
static void depth_of_cloud(bool scattered, double *wrong, double *worst) {
    enum { RIM = 200, MOST = 4000 };
    static double x[2 * MOST];
    uint64_t random = 7;
    const double h = 2 * 3.14159265358979 / RIM;
    int n = 0;
    for (; n < RIM; n++) {
        const double angle = h * n, r = 1 + 0.1 * cos(3 * angle);
        x[2 * n] = r * cos(angle);
        x[2 * n + 1] = 0.7 * r * sin(angle);
    }
    const int side = (int)(2.2 / h) + 1;
    for (int k = 0; k < side * side && n < MOST; k++) {
        const double jitter = scattered ? 20 : 0.4;
        const double px = -1.1 + h * (k % side + jitter * (silt_uniform(&random) - 0.5));
        const double py = -1.1 + h * (k / side + jitter * (silt_uniform(&random) - 0.5));
        const double a = atan2(py / 0.7, px), r = 1 + 0.1 * cos(3 * a);
        if (hypot(px, py / 0.7) > r - 1.2 * h)
            continue;
        x[2 * n] = px;
        x[2 * n++ + 1] = py;
    }
    silt_nodes nodes = {.dim = 2, .count = n, .x = x};
    nodes.kind = silt_alloc((size_t)n, 1);
    nodes.owner = silt_alloc((size_t)n, sizeof(int));
    nodes.wall = silt_alloc((size_t)n, sizeof *nodes.wall);
    int *triangle, n_triangle;
    assert_int_equal(silt_delaunay_2d(n, x, &triangle, &n_triangle), 0);
    silt_mesh mesh = {0};
    for (int e = 0; e < n_triangle; e++) {
        const int *t = triangle + 3 * e;
        if (t[0] < RIM && t[1] < RIM && t[2] < RIM)
            continue;
        SILT_RESERVE(mesh.cell, mesh.cell_capacity, mesh.n_cell + 1);
        memcpy(mesh.cell[mesh.n_cell], t, 3 * sizeof *t);
        mesh.cell[mesh.n_cell++][3] = -1;
    }
    free(triangle);
    silt_mesh_connect(&mesh, &nodes);
    for (int k = 0; k < mesh.n_facet; k++)
        mesh.facet_kind[k] = x[2 * mesh.facet[k][0] + 1] < 0.2 ? FACET_BODY : FACET_FREE;
    silt_body_def body = {.condition = WALL_NO_SLIP};
    silt_scene scene = {.n_body = 1, .body = &body};
    silt_walls walls = {0};
    silt_depth depth = {0};
    silt_depth_update(&depth, &scene, &walls, &nodes, &mesh, x);
    int n_wrong = 0;
    *worst = 0;
    for (int i = 0; i < n; i++) {
        double best[2] = {HUGE_VAL, HUGE_VAL};
        for (int k = 0; k < mesh.n_facet; k++) {
            double corner[4];
            for (int a = 0; a < 2; a++)
                memcpy(corner + 2 * a, x + 2 * mesh.facet[k][a], 2 * sizeof(double));
            double *to = &best[mesh.facet_kind[k] == FACET_FREE];
            *to = silt_min(*to, silt_facet_distance(2, x + 2 * i, corner));
        }
        if (!mesh.wet[i])
            continue;
        const double off = silt_max(fabs(depth.wall[i] - best[0]), fabs(depth.surface[i] - best[1]));
        n_wrong += off > 1e-12;
        *worst = silt_max(*worst, off);
    }
    *wrong = (double)n_wrong / n;
    silt_depth_clear(&depth);
    silt_mesh_clear(&mesh);
    free(nodes.kind);
    free(nodes.owner);
    free(nodes.wall);
}

static void test_depth_of_clouds(void **state) {
    (void)state;
    double wrong, worst;
    depth_of_cloud(false, &wrong, &worst);
    NEAR(wrong, 0, 0);
    depth_of_cloud(true, &wrong, &worst);
    print_message("scattered cloud: %.2g of the nodes miss the nearest facet, by up to %.2g\n", wrong, worst);
    assert_true(wrong < 0.01 && worst < 0.01);
}

// ---- eddy viscosity

// u*^2 (1 - y/D) = (l du/dy)^2 integrated upwards is u*/kappa ln(y/y0) exactly
static void test_mixing_length_makes_the_log_law(void **state) {
    (void)state;
    const double depth = 0.1, star = 0.03, y0 = 1e-3;
    double u = 0, y = y0;
    while (y < 0.98 * depth) {
        // fourth-order Runge-Kutta
        const double dy = 0.005 * y;
        double k[4];
        for (int s = 0; s < 4; s++) {
            const double at = y + (s == 0 ? 0 : s == 3 ? dy : 0.5 * dy);
            k[s] = star * sqrt(1 - at / depth) / silt_mixing_length(at, depth - at);
        }
        u += dy * (k[0] + 2 * k[1] + 2 * k[2] + k[3]) / 6;
        y += dy;
        NEAR(u, star / SILT_KAPPA * log(y / y0), 1e-9);
    }
    NEAR(silt_mixing_length(0.02, HUGE_VAL), SILT_KAPPA * 0.02, 1e-17);
    NEAR(silt_mixing_length(0, 0.1), 0, 0);
    NEAR(silt_mixing_length(0.1, 0), 0, 0);
    NEAR(silt_mixing_length(HUGE_VAL, HUGE_VAL), 0, 0);
}

static void test_eddy_viscosity_models(void **state) {
    (void)state;
    const double rate = 3, delta = 0.2, unit = silt_square(0.5 * delta);
    const double shear2[4] = {0, rate, 0, 0}, shear3[9] = {0, 0, rate};
    const double strain2[4] = {rate, 0, 0, -rate}, strain3[9] = {2 * rate, 0, 0, 0, -rate, 0, 0, 0, -rate};
    const double turn2[4] = {0, -rate, rate, 0}, turn3[9] = {0, -rate, 0, rate, 0, 0, 0, 0, 0};
    NEAR(silt_shear_rate(2, shear2), rate, 1e-15);
    NEAR(silt_shear_rate(3, shear3), rate, 1e-15);
    NEAR(silt_shear_rate(2, strain2), 2 * rate, 1e-15);
    NEAR(silt_shear_rate(3, strain3), sqrt(12) * rate, 1e-14);
    NEAR(silt_shear_rate(3, turn3), 0, 0);

    NEAR(silt_eddy_smagorinsky(delta, 10, rate), silt_square(0.17 * delta) * rate, 1e-16);
    NEAR(silt_eddy_smagorinsky(delta, 0.01, rate), silt_square(0.41 * 0.01) * rate, 1e-18);

    // Nicoud & Ducros (1999): nothing in pure shear; Nicoud et al. (2011), table 1: 0.904 in rotation, 0.15 in axisymmetric strain
    NEAR(silt_eddy_wale(2, delta, shear2), 0, 0);
    NEAR(silt_eddy_wale(3, delta, shear3), 0, 0);
    NEAR(silt_eddy_wale(3, delta, turn3), unit * rate * pow(2.0 / 3, 0.25), 1e-15);
    NEAR(silt_eddy_wale(2, delta, turn2), unit * rate * pow(2.0 / 3, 0.25), 1e-15);
    NEAR(silt_eddy_wale(3, delta, strain3), unit * rate / (6 + pow(6, -0.25)), 1e-15);
    const double isotropic[9] = {rate, 0, 0, 0, rate, 0, 0, 0, rate}, still[9] = {0};
    NEAR(silt_eddy_wale(3, delta, isotropic), 0, 1e-12);
    NEAR(silt_eddy_wale(3, delta, still), 0, 0);

    // no matter how the axes lie
    double q[3][3] = {{0.36, 0.48, -0.8}, {-0.8, 0.6, 0}, {0.48, 0.64, 0.6}}, turned[9] = {0};
    const double some[9] = {0.3, -1, 2, 0.5, 0.1, 0.7, -0.2, 1.5, -0.4};
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            for (int k = 0; k < 3; k++)
                for (int l = 0; l < 3; l++)
                    turned[3 * i + j] += q[i][k] * some[3 * k + l] * q[j][l];
    NEAR(silt_eddy_wale(3, delta, turned), silt_eddy_wale(3, delta, some), 1e-15);
    NEAR(silt_shear_rate(3, turned), silt_shear_rate(3, some), 1e-14);
}

static void test_model_follows_the_scene(void **state) {
    (void)state;
    silt_scene scene = {.dimension = 2};
    assert_int_equal(silt_turbulence_model(&scene), TURBULENCE_MIXING_LENGTH);
    scene.dimension = 3;
    assert_int_equal(silt_turbulence_model(&scene), TURBULENCE_WALE);
    assert_true(silt_viscosity_varies(&scene));
    scene.fluid.flow = FLOW_LAMINAR;
    assert_int_equal(silt_turbulence_model(&scene), TURBULENCE_NONE);
    assert_false(silt_viscosity_varies(&scene));
    scene.fluid.turbulence = TURBULENCE_SMAGORINSKY;
    assert_int_equal(silt_turbulence_model(&scene), TURBULENCE_SMAGORINSKY);
}

// ---- rheology

static void test_apparent_viscosity(void **state) {
    (void)state;
    silt_fluid_def f = {.viscosity = 0.4, .yield_stress = 20, .flow_index = 1, .plastic_rate = 0.01};
    NEAR(silt_apparent_viscosity(&f, 5), 0.4, 0);
    f.rheology = RHEOLOGY_BINGHAM;
    NEAR(silt_apparent_viscosity(&f, 5), 0.4 + 20.0 / 5, 1e-14);
    NEAR(silt_apparent_viscosity(&f, 0), 0.4 + 20 / 0.01, 1e-9);
    NEAR(silt_apparent_viscosity(&f, 0.003), 0.4 + 20 * (1 - exp(-0.3)) / 0.003, 1e-9);
    // Herschel-Bulkley: the same with n = 1, a power law without yield stress, finite at rest
    f.rheology = RHEOLOGY_HERSCHEL_BULKLEY;
    NEAR(silt_apparent_viscosity(&f, 0.003), 0.4 + 20 * (1 - exp(-0.3)) / 0.003, 1e-9);
    f.flow_index = 0.4;
    NEAR(silt_apparent_viscosity(&f, 5), (20 + 0.4 * pow(5, 0.4)) / 5, 1e-14);
    f.yield_stress = 0;
    NEAR(silt_apparent_viscosity(&f, 0), 0.4 * pow(0.01, -0.6), 1e-12);
    f.flow_index = 1.8;
    NEAR(silt_apparent_viscosity(&f, 50), 0.4 * pow(50, 0.8), 1e-12);
    // stress rises with the rate, without a step
    f.flow_index = 0.4;
    f.yield_stress = 20;
    double before = 0;
    for (double rate = 1e-7; rate < 100; rate *= 1.01) {
        const double stress = rate * silt_apparent_viscosity(&f, rate);
        assert_true(stress > before && (before == 0 || stress < 1.011 * before));
        before = stress;
    }
}

// Film of a yield-stress fluid down a plane: stress g rho (H - y), sheared below H - yield/(g rho), a plug above
// (Bingham; Coussot 1994 for Herschel-Bulkley)
static double film_speed(const silt_fluid_def *f, double g, double depth, double y) {
    const double drive = f->density * g, sheared = silt_max(depth - f->yield_stress / drive, 0);
    const double n = f->rheology == RHEOLOGY_NEWTONIAN ? 1 : f->flow_index, m = 1 + 1 / n;
    return pow(drive / f->viscosity, 1 / n) / m * (pow(sheared, m) - pow(silt_max(sheared - y, 0), m));
}

static void test_films_of_mud(void **state) {
    (void)state;
    for (int kind = 0; kind < 4; kind++) {
        double error[2];
        for (int fine = 0; fine < 2; fine++) {
            column c;
            const double depth = 0.1, g = 1;
            column_open(&c, 2 + kind % 2, fine ? 41 : 21, depth);
            c.walls.slip[0] = 0;
            silt_fluid_def *f = &c.scene.fluid;
            f->flow = FLOW_LAMINAR;
            f->viscosity = 2;
            f->plastic_rate = 1e-3;
            f->rheology = kind == 0 ? RHEOLOGY_NEWTONIAN : kind == 1 ? RHEOLOGY_BINGHAM : RHEOLOGY_HERSCHEL_BULKLEY;
            f->yield_stress = kind == 0 ? 0 : 40;
            f->flow_index = kind < 2 ? 1 : kind == 2 ? 0.5 : 1.5;
            column_place(&c);
            column_step(&c, g, HUGE_VAL, 4000);
            error[fine] = 0;
            for (int r = 0; r < c.n_row; r++)
                error[fine] = silt_max(error[fine], fabs(c.v[c.dim * r * c.plane] / film_speed(f, g, depth, depth) -
                                                         film_speed(f, g, depth, r * c.h) / film_speed(f, g, depth, depth)));
            column_close(&c);
        }
        // Newtonian: nodally exact
        if (kind == 0)
            NEAR(error[1], 0, 1e-9);
        else {
            NEAR(error[0], 0, 4e-3);
            NEAR(error[1], 0, 1.5e-3);
        }
    }
}

// ---- law of the wall

static void test_wall_stress(void **state) {
    (void)state;
    const double rho = 1000, nu = 1e-6;
    // rough: 1 mm sand seen at 1 cm, 1 m/s: u* = 0.41/ln(300)
    NEAR(silt_wall_stress(rho, nu, 1, 0.01, 1e-3, NULL), rho * silt_square(0.41 / log(300)), 1e-10);
    // smooth: put the logarithmic profile in, get its u* back
    const double star = 0.05, y = 0.01;
    NEAR(silt_wall_stress(rho, nu, star / 0.41 * log(9.8 * y * star / nu), y, 0, NULL), rho * star * star, 1e-10);
    // viscous sublayer
    NEAR(silt_wall_stress(rho, nu, 0.001, 0.001, 0, NULL), rho * nu, 1e-15);
    // no jump anywhere, and the slope is the derivative
    for (int rough = 0; rough < 2; rough++) {
        double before = 0;
        for (double u = 1e-6; u < 20; u *= 1.002) {
            double slope;
            const double ks = rough ? 1e-3 : 0, stress = silt_wall_stress(rho, nu, u, y, ks, &slope);
            const double d = 1e-6 * u;
            const double ahead = silt_wall_stress(rho, nu, u + d, y, ks, NULL), behind = silt_wall_stress(rho, nu, u - d, y, ks, NULL);
            assert_true(stress > before && (before == 0 || stress < 1.005 * before));
            const double right = (ahead - stress) / d, left = (stress - behind) / d;
            assert_true(fabs(right - slope) < 1e-5 * slope || fabs(left - slope) < 1e-5 * slope);
            before = stress;
        }
    }
    NEAR(silt_wall_stress(rho, nu, 0, y, 0, NULL), 0, 0);
    NEAR(silt_wall_stress(rho, 0, 1, y, 0, NULL), 0, 0);
}

static void test_wall_points(void **state) {
    (void)state;
    for (int dim = 2; dim <= 3; dim++) {
        column c;
        column_open(&c, dim, 5, 0.4);
        c.wall.velocity[0] = 0.5;
        c.walls.roughness[0] = 0.01;
        column_place(&c);
        // one per wall node; shares add up to the wall; looks at 2 h; u = 3 y seen from a wall that moves
        double area = 0;
        assert_int_equal(c.law.n_point, c.plane);
        for (int i = 0; i < c.nodes.count; i++)
            c.v[dim * i] = 3 * c.nodes.x[dim * i + dim - 1];
        silt_wall_law_traction(&c.law, &c.scene, dim, c.v, c.friction, c.force);
        for (int q = 0; q < c.law.n_point; q++) {
            const silt_wall_point *p = &c.law.point[q];
            area += p->area;
            NEAR(p->height, 0.2, 1e-15);
            NEAR(p->normal[dim - 1], 1, 1e-15);
            const double stress = silt_wall_stress(1000, 1e-6, 3 * 0.2 - 0.5, 0.2, 0.01, NULL);
            NEAR(p->shear[0], stress, 1e-9);
            NEAR(c.force[dim * p->node] - c.friction[p->node] * c.v[dim * p->node], -stress * p->area, 1e-9);
            NEAR(p->shear[dim - 1], 0, 1e-12);
        }
        NEAR(area, pow(ACROSS * c.h, dim - 1), 1e-14);
        NEAR(c.law.y_plus[1], 0.2 * sqrt(c.law.point[0].shear[0] / 1000) / 1e-6, 1e-6);
        // thinner water than it wants to see: at its surface
        c.scene.fluid.wall_height = 10;
        column_place(&c);
        assert_true(c.law.point[1].height <= 0.4);
        NEAR(c.law.point[1].height, 0.4, 1e-3);
        column_close(&c);
    }
}

// a body under the water brakes it to the bit as a wall with the same roughness does, one that slips not at all
static void test_wall_points_of_a_body(void **state) {
    (void)state;
    for (int dim = 2; dim <= 3; dim++) {
        column c;
        column_open(&c, dim, 5, 0.4);
        c.walls.roughness[0] = 0.01;
        column_place(&c);
        const size_t n = (size_t)c.nodes.count, bytes = n * (size_t)dim * sizeof(double);
        for (size_t i = 0; i < n; i++)
            c.v[(size_t)dim * i] = 3 * c.nodes.x[(size_t)dim * i + (size_t)dim - 1];
        silt_wall_law_traction(&c.law, &c.scene, dim, c.v, c.friction, c.force);
        double *force = silt_alloc(n, (size_t)dim * sizeof *force), *friction = silt_alloc(n, sizeof *friction);
        memcpy(force, c.force, bytes);
        memcpy(friction, c.friction, n * sizeof *friction);
        assert_true(friction[0] > 0 && force[0] < 0);

        silt_body_def body = {.condition = WALL_LAW, .roughness = 0.01};
        c.scene.body = &body;
        c.scene.n_body = 1;
        for (int i = 0; i < c.plane; i++) {
            c.nodes.kind[i] = NODE_BODY;
            c.nodes.owner[i] = 0;
        }
        for (int k = 0; k < c.mesh.n_facet; k++)
            if (c.mesh.facet_kind[k] == FACET_WALL)
                c.mesh.facet_kind[k] = FACET_BODY;
        assert_true(silt_scene_law(&c.scene));
        column_place(&c);
        assert_int_equal(c.law.n_point, c.plane);
        silt_wall_law_traction(&c.law, &c.scene, dim, c.v, c.friction, c.force);
        assert_memory_equal(c.force, force, bytes);
        assert_memory_equal(c.friction, friction, n * sizeof *friction);
        body.condition = WALL_SLIP;
        column_place(&c);
        assert_int_equal(c.law.n_point, 0);
        c.scene.body = NULL;
        c.scene.n_body = 0;
        free(force);
        free(friction);
        column_close(&c);
    }
}

// behind an edge of water that runs over dry wall the layer is young, and its stress that of Sakiadis
static void test_young_layer(void **state) {
    (void)state;
    column c;
    column_open(&c, 2, 5, 0.4);
    c.nodes.v = silt_alloc((size_t)(2 * c.nodes.count), sizeof(double));
    int gap = -1, left = -1;
    for (int k = 0; k < c.mesh.n_facet && gap < 0; k++)
        if (c.mesh.facet_kind[k] == FACET_WALL)
            gap = k;
    assert_true(gap >= 0);
    c.mesh.facet_kind[gap] = FACET_FREE; // a facet of the wall without water
    for (int a = 0; a < 2; a++) {
        const double step = c.nodes.x[2 * c.mesh.facet[gap][1 - a]] - c.nodes.x[2 * c.mesh.facet[gap][a]];
        if (fabs(step - c.h) < 1e-9 || step < -1.5 * c.h)
            left = c.mesh.facet[gap][a];
    }
    assert_true(left >= 0);
    for (int turn = 0; turn < 2; turn++) {
        // all go to the right: the node left of the gap runs into it; then they stand
        for (int i = 0; i < c.nodes.count; i++)
            c.nodes.v[2 * i] = c.v[2 * i] = turn == 0 ? 2 : 0;
        column_place(&c);
        silt_wall_law_traction(&c.law, &c.scene, 2, c.v, c.friction, c.force);
        for (int q = 0; q < c.law.n_point; q++) {
            const silt_wall_point *p = &c.law.point[q];
            const double grown = silt_wall_stress(1000, 1e-6, c.v[0], p->height, 0, NULL);
            if (p->node == left && turn == 0)
                NEAR(p->toe, 0.125 * c.h, 1e-12);
            else if (turn == 1)
                NEAR(p->toe, 0, 0);
            const double young = p->toe > 0 ? 0.4438 * 1000 * 2 * sqrt(1e-6 * 2 / p->toe) : 0;
            NEAR(p->shear[0], silt_max(grown, young), 1e-9);
        }
    }
    column_close(&c);
}

// ---- uniform rough channel: H = 0.1 m, slope 1e-3, 1 mm sand

#define CHANNEL_SLOPE 9.81e-3

static double channel_mean(double depth, double ks) {
    // log law from y0 = ks/30 up, nothing below
    return sqrt(CHANNEL_SLOPE * depth) / SILT_KAPPA * (log(30 * depth / ks) - 1 + ks / (30 * depth));
}

static void test_rough_channel(void **state) {
    (void)state;
    // sampling height halved and doubled, k_s ten times, other models, two and three dimensions
    static const struct {
        int dim, n_row;
        double height, ks;
        silt_turbulence model;
    } run[] = {
        {2, 11, 2, 1e-3, TURBULENCE_AUTO}, {2, 11, 1, 1e-3, TURBULENCE_AUTO}, {2, 11, 4, 1e-3, TURBULENCE_AUTO},
        {2, 11, 2, 1e-2, TURBULENCE_AUTO}, {2, 21, 2, 1e-3, TURBULENCE_AUTO}, {2, 41, 2, 1e-3, TURBULENCE_AUTO},
        {2, 41, 2, 1e-2, TURBULENCE_AUTO}, {3, 11, 2, 1e-3, TURBULENCE_MIXING_LENGTH}, {3, 21, 2, 1e-3, TURBULENCE_MIXING_LENGTH},
        {2, 11, 2, 2.5e-3, TURBULENCE_AUTO},
    };
    for (int k = 0; k < (int)(sizeof run / sizeof *run); k++) {
        column c;
        column_open(&c, run[k].dim, run[k].n_row, 0.1);
        c.walls.roughness[0] = run[k].ks;
        c.scene.fluid.wall_height = run[k].height;
        c.scene.fluid.turbulence = run[k].model;
        column_place(&c);
        column_step(&c, CHANNEL_SLOPE, HUGE_VAL, 400);
        print_message("channel %d-D, %2d cells, sampled at %g h, k_s %g: mean %.4f of the log law, %d passes\n", run[k].dim,
                      run[k].n_row - 1, run[k].height, run[k].ks, column_mean(&c) / channel_mean(0.1, run[k].ks), c.passes);
        NEAR(column_shear(&c), 1000 * CHANNEL_SLOPE * 0.1, 1e-6);
        NEAR(column_mean(&c) / channel_mean(0.1, run[k].ks), 1, 0.02);
        column_close(&c);
    }
}

// from rest: the bed takes what gravity gives less what the water gains, and nothing overshoots whatever the step
static void test_channel_starts(void **state) {
    (void)state;
    const double scale = 0.1 / sqrt(CHANNEL_SLOPE * 0.1); // H/u*
    for (double ratio = 1e-3; ratio < 2e3; ratio *= 10) {
        column c;
        column_open(&c, 2, 11, 0.1);
        c.walls.roughness[0] = 1e-3;
        column_place(&c);
        const double final = channel_mean(0.1, 1e-3), dt = ratio * scale;
        double before = 0, worst = 0, top = 0;
        int passes = 0;
        for (int step = 0; step < (ratio < 0.1 ? 3000 : 40); step++) {
            column_step(&c, CHANNEL_SLOPE, dt, 60);
            passes = c.passes > passes ? c.passes : passes;
            const double mean = column_mean(&c), balance = 1000 * (CHANNEL_SLOPE * 0.1 - 0.1 * (mean - before) / dt);
            silt_wall_law_traction(&c.law, &c.scene, 2, c.v, c.friction, c.force);
            worst = silt_max(worst, fabs(column_shear(&c) - balance) / (1000 * CHANNEL_SLOPE * 0.1));
            assert_true(mean > before * (1 - 1e-9));
            before = mean;
            top = silt_max(top, mean / final);
        }
        print_message("start, dt %g H/u*: shear off the balance by %.2g, mean up to %.4f, at most %d passes\n", ratio, worst, top, passes);
        assert_true(worst < 0.03);
        assert_true(top < 1.02);
        column_close(&c);
    }
}

// with one evaluation a step (the step's first iterate) the same, as long as steps are short beside H/u*
static void test_channel_starts_without_iterations(void **state) {
    (void)state;
    const double scale = 0.1 / sqrt(CHANNEL_SLOPE * 0.1);
    for (double ratio = 1e-4; ratio < 2e-2; ratio *= 10) {
        column c;
        column_open(&c, 2, 11, 0.1);
        c.walls.roughness[0] = 1e-3;
        column_place(&c);
        double before = 0, worst = 0;
        for (double t = 0; t < 5 * scale; t += ratio * scale) {
            column_step(&c, CHANNEL_SLOPE, ratio * scale, 1);
            const double mean = column_mean(&c);
            const double balance = 1000 * (CHANNEL_SLOPE * 0.1 - 0.1 * (mean - before) / (ratio * scale));
            silt_wall_law_traction(&c.law, &c.scene, 2, c.v, c.friction, c.force);
            worst = silt_max(worst, fabs(column_shear(&c) - balance) / (1000 * CHANNEL_SLOPE * 0.1));
            assert_true(mean > before);
            before = mean;
        }
        print_message("start, one pass a step, dt %g H/u*: shear off the balance by %.2g\n", ratio, worst);
        assert_true(worst < 0.03);
        column_close(&c);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_facet_distance),
        cmocka_unit_test(test_depth_of_a_periodic_column),
        cmocka_unit_test(test_depth_of_clouds),
        cmocka_unit_test(test_grains_leave_eddies_less_room),
        cmocka_unit_test(test_mixing_length_makes_the_log_law),
        cmocka_unit_test(test_eddy_viscosity_models),
        cmocka_unit_test(test_model_follows_the_scene),
        cmocka_unit_test(test_apparent_viscosity),
        cmocka_unit_test(test_films_of_mud),
        cmocka_unit_test(test_wall_stress),
        cmocka_unit_test(test_wall_points),
        cmocka_unit_test(test_wall_points_of_a_body),
        cmocka_unit_test(test_young_layer),
        cmocka_unit_test(test_rough_channel),
        cmocka_unit_test(test_channel_starts),
        cmocka_unit_test(test_channel_starts_without_iterations),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
