// one step of the water: FIC-stabilised P1-P1, updated Lagrangian, all integrals on the midpoint mesh (docs/method.md)
#include "fluid.h"

#define FLUID_FLAT 0.05      // a cell that shrinks below this share on its way keeps the shape it had at the start
#define FLUID_DEBT_CAP 0.3   // largest share of a node's volume that its debt may ask for
#define FLUID_CG_LIMIT 3000
#define FLUID_STIFF 0.5     // weight of the viscous part of the pressure correction

void silt_fluid_clear(silt_fluid *fluid) {
    free(fluid->x_mid);
    free(fluid->area);
    free(fluid->grad);
    free(fluid->share);
    free(fluid->mass);
    free(fluid->volume);
    free(fluid->inertia);
    free(fluid->friction);
    free(fluid->w);
    free(fluid->star);
    free(fluid->force);
    free(fluid->reaction);
    free(fluid->scratch);
    free(fluid->projection);
    free(fluid->projection_weight);
    free(fluid->residual);
    free(fluid->rate);
    free(fluid->increment);
    free(fluid->hold);
    free(fluid->mobile);
    free(fluid->withheld);
    free(fluid->normal);
    free(fluid->given);
    silt_wall_normals_clear(&fluid->wall_normals);
    free(fluid->tau);
    for (int k = 0; k < 3; k++)
        free(fluid->cg[k]);
    silt_pressure_free(&fluid->pressure);
    *fluid = (silt_fluid){0};
}

static void fluid_reserve(silt_fluid *f, int n_node, int n_cell) {
#define ROOM(field, per, capacity, need)                                                                               \
    do {                                                                                                               \
        int have = (capacity) * (per);                                                                                 \
        f->field = silt_grow(f->field, &have, (need) * (per), sizeof *f->field);                                       \
    } while (0)
    if (n_node > f->node_capacity) {
        const int need = n_node + n_node / 2 + 64, have_nodes = f->node_capacity;
        ROOM(x_mid, 2, have_nodes, need);
        ROOM(w, 2, have_nodes, need);
        ROOM(star, 2, have_nodes, need);
        ROOM(force, 2, have_nodes, need);
        ROOM(reaction, 2, have_nodes, need);
        ROOM(scratch, 2, have_nodes, need);
        ROOM(projection, 2, have_nodes, need);
        ROOM(projection_weight, 1, have_nodes, need);
        ROOM(normal, 2, have_nodes, need);
        ROOM(given, 2, have_nodes, need);
        ROOM(mass, 1, have_nodes, need);
        ROOM(volume, 1, have_nodes, need);
        ROOM(inertia, 1, have_nodes, need);
        ROOM(friction, 1, have_nodes, need);
        ROOM(residual, 1, have_nodes, need);
        ROOM(rate, 1, have_nodes, need);
        ROOM(increment, 1, have_nodes, need);
        ROOM(hold, 1, have_nodes, need);
        ROOM(mobile, 1, have_nodes, need);
        ROOM(withheld, 1, have_nodes, need);
        for (int k = 0; k < 3; k++)
            ROOM(cg[k], 2, have_nodes, need);
        f->node_capacity = need;
    }
    if (n_cell > f->cell_capacity) {
        const int need = n_cell + n_cell / 2 + 64, have_cells = f->cell_capacity;
        ROOM(area, 1, have_cells, need);
        ROOM(grad, 1, have_cells, need);
        ROOM(share, 1, have_cells, need);
        ROOM(tau, 1, have_cells, need);
        f->cell_capacity = need;
    }
#undef ROOM
    f->n_node = n_node;
    f->n_cell = n_cell;
}

// which velocity components the surroundings hold
static void hold_nodes(silt_fluid *f, const silt_scene *scene, const silt_walls *walls, const silt_nodes *nodes,
                       const silt_mesh *mesh) {
    silt_wall_normals_take(&f->wall_normals, walls, nodes, mesh, nodes->x);
    for (int i = 0; i < f->n_node; i++) {
        f->hold[i] = nodes->kind[i] == NODE_FLUID ? 0 : 2;
        f->normal[2 * i] = f->normal[2 * i + 1] = 0;
        f->given[2 * i] = f->given[2 * i + 1] = 0;
        if (nodes->kind[i] == NODE_FLUID && nodes->wall[i][0] >= 0) {
            double vector[3], given[3];
            f->hold[i] = silt_walls_held(walls, scene, &f->wall_normals, nodes, i, vector, given) == HOLD_NORMAL ? 1 : 2;
            memcpy(f->normal + 2 * i, vector, 2 * sizeof(double));
            memcpy(f->given + 2 * i, given, 2 * sizeof(double));
        }
    }
    if (!scene->bed.on || scene->bed.condition == WALL_NO_SLIP)
        return;
    // slip on the bed: the normal of its edges around the node
    for (int k = 0; k < mesh->n_facet; k++) {
        if (mesh->facet_kind[k] != FACET_BED)
            continue;
        const int a = mesh->facet[k][0], b = mesh->facet[k][1];
        const double dx = nodes->x[2 * b] - nodes->x[2 * a], dy = nodes->x[2 * b + 1] - nodes->x[2 * a + 1];
        for (int c = 0; c < 2; c++) {
            f->normal[2 * mesh->facet[k][c]] -= dy;
            f->normal[2 * mesh->facet[k][c] + 1] += dx;
            f->hold[mesh->facet[k][c]] = 1;
        }
    }
    for (int i = 0; i < f->n_node; i++)
        if (nodes->kind[i] == NODE_BED && f->hold[i] == 1) {
            const double length = hypot(f->normal[2 * i], f->normal[2 * i + 1]);
            if (length > 0) {
                f->normal[2 * i] /= length;
                f->normal[2 * i + 1] /= length;
            } else
                f->hold[i] = 2;
        }
}

// films and crumbs of water on bed, walls or bodies, with a node or two that are free: too few to keep a volume; they run
// as drops do, at no pressure, and what they gain is owed
static void find_crumbs(silt_fluid *f, const silt_mesh *mesh, double *p) {
    int *parent = silt_alloc((size_t)f->n_node + 1, sizeof *parent), *n_free = silt_alloc((size_t)f->n_node + 1, sizeof *n_free);
    uint8_t *held = silt_alloc((size_t)f->n_node + 1, 1);
    for (int i = 0; i < f->n_node; i++)
        parent[i] = i;
    for (int e = 0; e < f->n_cell; e++)
        silt_group_join(parent, mesh->cell[e]);
    for (int i = 0; i < f->n_node; i++) {
        n_free[silt_group_find(parent, i)] += f->hold[i] < 2;
        held[silt_group_find(parent, i)] |= f->hold[i] > 0;
    }
    for (int i = 0; i < f->n_node; i++) {
        const int r = silt_group_find(parent, i);
        if (!mesh->wet[i] || n_free[r] > 2 || !held[r] || f->mobile[i] != 1)
            continue;
        f->mobile[i] = 2;
        f->rate[i] = p[i] = 0;
    }
    free(parent);
    free(n_free);
    free(held);
}

// a node whose whole surroundings are held has no say in its volume
static void find_mobile(silt_fluid *f, const silt_mesh *mesh) {
    for (int i = 0; i < f->n_node; i++) {
        f->mobile[i] = 0;
        for (int k = mesh->neighbour_start[i]; k < mesh->neighbour_start[i + 1]; k++)
            f->mobile[i] |= f->hold[mesh->neighbour[k]] < 2;
        if (!f->mobile[i])
            f->rate[i] = 0;
    }
}

// takes held components out of a vector
static void project(const silt_fluid *f, int i, double v[2]) {
    if (f->hold[i] == 2)
        v[0] = v[1] = 0;
    else if (f->hold[i] == 1) {
        const double *n = f->normal + 2 * i, vn = v[0] * n[0] + v[1] * n[1];
        v[0] -= vn * n[0];
        v[1] -= vn * n[1];
    }
}

// the held part of a node's velocity: bodies, inlets and fixed nodes of walls have theirs, water on walls what those make of it
static void held_velocity(const silt_fluid *f, const silt_nodes *nodes, int i, double v[2]) {
    const bool moves = nodes->kind[i] == NODE_BODY || nodes->kind[i] == NODE_INLET || nodes->kind[i] == NODE_CORNER;
    v[0] = moves ? nodes->v[2 * i] : f->given[2 * i];
    v[1] = moves ? nodes->v[2 * i + 1] : f->given[2 * i + 1];
}

static bool cell_shape(const double *x, const int cell[3], double *area, double grad[3][2]) {
    const double *a = x + 2 * cell[0], *b = x + 2 * cell[1], *c = x + 2 * cell[2];
    const double twice = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
    *area = 0.5 * twice;
    if (!(twice > 0))
        return false;
    grad[0][0] = (b[1] - c[1]) / twice;
    grad[0][1] = (c[0] - b[0]) / twice;
    grad[1][0] = (c[1] - a[1]) / twice;
    grad[1][1] = (a[0] - c[0]) / twice;
    grad[2][0] = (a[1] - b[1]) / twice;
    grad[2][1] = (b[0] - a[0]) / twice;
    return true;
}

// u*^2/u of the law of the wall for the speed u at the height y: u/u* = ln(9.8 y u*/nu)/kappa on a smooth wall, or
// ln(30 y/k_s)/kappa on a rough one, whichever resists more; linear below y+ = 11
static double wall_law(double speed, double y, double nu, double roughness) {
    const double kappa = 0.41;
    if (speed <= 0)
        return 0;
    double star = sqrt(nu * speed / y);
    if (y * star > 11 * nu) {
        // Newton on u* (ln(9.8 y u*/nu)/kappa) = u
        star = 0.06 * speed;
        for (int k = 0; k < 20; k++) {
            const double log_part = log(silt_max(9.8 * y * star / nu, 2));
            const double step = (star * log_part / kappa - speed) / ((log_part + 1) / kappa);
            star = silt_max(star - step, 1e-3 * speed);
            if (fabs(step) < 1e-12 * speed)
                break;
        }
    }
    if (roughness > 0)
        star = silt_max(star, kappa * speed / log(silt_max(30 * y / roughness, 3)));
    return star * star / speed;
}

// traction of the wall law on nodes that slide along walls and the bed, per speed; the water's speed at the wall's node
// stands for the one at the height h
static void wall_friction(silt_fluid *f, const silt_scene *scene, const silt_walls *walls, const silt_nodes *nodes,
                          const silt_mesh *mesh) {
    memset(f->friction, 0, (size_t)f->n_node * sizeof *f->friction);
    const double h = scene->fluid.size, rho = scene->fluid.density, nu = scene->fluid.viscosity / rho;
    for (int k = 0; k < mesh->n_facet; k++) {
        const int *edge = mesh->facet[k];
        double roughness = -1;
        if (mesh->facet_kind[k] == FACET_BED && scene->bed.condition == WALL_LAW)
            roughness = 2.5 * scene->grains.diameter;
        else if (mesh->facet_kind[k] == FACET_WALL)
            for (int s = 0; s < 2; s++)
                for (int t = 0; t < 2; t++)
                    if (nodes->wall[edge[0]][s] >= 0 && nodes->wall[edge[0]][s] == nodes->wall[edge[1]][t])
                        roughness = walls->roughness[nodes->wall[edge[0]][s]];
        if (roughness < 0)
            continue;
        const double length = hypot(nodes->x[2 * edge[1]] - nodes->x[2 * edge[0]], nodes->x[2 * edge[1] + 1] - nodes->x[2 * edge[0] + 1]);
        for (int c = 0; c < 2; c++) {
            const double speed = hypot(f->w[2 * edge[c]], f->w[2 * edge[c] + 1]);
            f->friction[edge[c]] += 0.5 * length * rho * wall_law(speed, h, nu, roughness);
        }
    }
}

// geometry, masses and stabilisation on the midpoint mesh
static void midpoint(silt_fluid *f, const silt_scene *scene, const silt_nodes *nodes, const silt_mesh *mesh,
                     const silt_drag *drag, double dt) {
    const double rho = scene->fluid.density, mu = scene->fluid.viscosity, theta_dt = scene->fluid.theta * dt;
    for (int i = 0; i < 2 * f->n_node; i++)
        f->x_mid[i] = nodes->x[i] + 0.5 * dt * f->w[i];
    // on bent walls the normals are those of this mesh's facets, else a full tank cannot keep its volume
    if (f->wall_normals.n_row) {
        silt_wall_normals_take(&f->wall_normals, f->walls, nodes, mesh, f->x_mid);
        for (int i = 0; i < f->n_node; i++)
            if (f->hold[i] == 1 && nodes->kind[i] == NODE_FLUID && f->wall_normals.row[i] >= 0) {
                double vector[3], given[3];
                silt_walls_held(f->walls, scene, &f->wall_normals, nodes, i, vector, given);
                memcpy(f->normal + 2 * i, vector, 2 * sizeof(double));
                memcpy(f->given + 2 * i, given, 2 * sizeof(double));
            }
    }
    for (int i = 0; i < f->n_node; i++)
        f->mass[i] = f->volume[i] = 0;
    for (int e = 0; e < f->n_cell; e++) {
        const int *cell = mesh->cell[e];
        const double start = silt_cell_area(nodes->x, cell);
        if (!cell_shape(f->x_mid, cell, &f->area[e], f->grad[e]) || f->area[e] < FLUID_FLAT * start)
            cell_shape(nodes->x, cell, &f->area[e], f->grad[e]);
        const double area = f->area[e];
        f->tau[e] = 1 / (2 * rho / theta_dt + 8 * mu / (3 * 2 * area));
        for (int a = 0; a < 3; a++) {
            double share = 0;
            if (drag)
                for (int c = 0; c < 3; c++)
                    share += drag->solid[cell[c]] * (a == c ? 2 : 1) / 12;
            f->share[e][a] = share;
            f->volume[cell[a]] += area / 3;
            f->mass[cell[a]] += rho * area * (1.0 / 3 - share);
        }
    }
    for (int i = 0; i < f->n_node; i++)
        f->inertia[i] = mesh->wet[i] ? f->mass[i] / theta_dt + (drag ? drag->coefficient[i] : 0) + f->friction[i] : 1;
}

// out += G p: pressure force on the nodes; returns its sum over the grains' share through `lost`
static void add_pressure(const silt_fluid *f, const silt_mesh *mesh, const double *p, double *out, double lost[2]) {
    for (int e = 0; e < f->n_cell; e++) {
        const int *cell = mesh->cell[e];
        const double area = f->area[e], mean = (p[cell[0]] + p[cell[1]] + p[cell[2]]) / 3;
        for (int d = 0; d < 2; d++) {
            const double slope = p[cell[0]] * f->grad[e][0][d] + p[cell[1]] * f->grad[e][1][d] + p[cell[2]] * f->grad[e][2][d];
            for (int a = 0; a < 3; a++)
                out[2 * cell[a] + d] += area * (f->grad[e][a][d] * mean + f->share[e][a] * slope);
            if (lost)
                lost[d] += area * slope * (f->share[e][0] + f->share[e][1] + f->share[e][2]);
        }
    }
}

// out += factor K v: viscous force, deviatoric
static void add_viscous(const silt_fluid *f, const silt_mesh *mesh, double mu, const double *v, double factor, double *out) {
    if (mu == 0)
        return;
    for (int e = 0; e < f->n_cell; e++) {
        const int *cell = mesh->cell[e];
        double l[2][2] = {{0}};
        for (int a = 0; a < 3; a++)
            for (int d = 0; d < 2; d++)
                for (int k = 0; k < 2; k++)
                    l[d][k] += v[2 * cell[a] + d] * f->grad[e][a][k];
        const double third = 2.0 / 3 * (l[0][0] + l[1][1]), scale = factor * mu * f->area[e];
        const double sxx = 2 * l[0][0] - third, syy = 2 * l[1][1] - third, sxy = l[0][1] + l[1][0];
        for (int a = 0; a < 3; a++) {
            out[2 * cell[a]] += scale * (sxx * f->grad[e][a][0] + sxy * f->grad[e][a][1]);
            out[2 * cell[a] + 1] += scale * (sxy * f->grad[e][a][0] + syy * f->grad[e][a][1]);
        }
    }
}

// force on the nodes but for inertia, viscosity and drag's own share: M v/(theta dt) + M g + push + G p
static void momentum_right(silt_fluid *f, const silt_scene *scene, const silt_nodes *nodes, const silt_mesh *mesh,
                           const silt_drag *drag, double dt, const double *p, double *out) {
    const double theta_dt = scene->fluid.theta * dt;
    for (int i = 0; i < f->n_node; i++)
        for (int d = 0; d < 2; d++)
            out[2 * i + d] = f->mass[i] * (nodes->v[2 * i + d] / theta_dt + scene->gravity[d]) + (drag ? drag->push[2 * i + d] : 0);
    add_pressure(f, mesh, p, out, NULL);
}

// (inertia + K) v = right on the free components, preconditioned by the inertia and the viscous diagonal
static silt_status momentum_implicit(silt_fluid *f, const silt_scene *scene, const silt_nodes *nodes, const silt_mesh *mesh,
                                     const double *right, double *v, silt_error *err) {
    const double mu = scene->fluid.viscosity;
    double *r = f->cg[0], *s = f->cg[1], *as = f->cg[2], *diagonal = f->increment;
    for (int i = 0; i < f->n_node; i++)
        diagonal[i] = f->inertia[i];
    for (int e = 0; e < f->n_cell; e++)
        for (int a = 0; a < 3; a++)
            diagonal[mesh->cell[e][a]] += 5.0 / 3 * mu * f->area[e] * (silt_square(f->grad[e][a][0]) + silt_square(f->grad[e][a][1]));
    for (int k = 0; k < 2 * f->n_node; k++)
        r[k] = right[k] - f->inertia[k / 2] * v[k];
    add_viscous(f, mesh, mu, v, -1, r);
    double rz = 0, scale = 0, whole = 0;
    for (int i = 0; i < f->n_node; i++) {
        double loose[2] = {right[2 * i], right[2 * i + 1]};
        project(f, i, loose);
        project(f, i, r + 2 * i);
        for (int d = 0; d < 2; d++) {
            const int k = 2 * i + d;
            s[k] = r[k] / diagonal[i];
            rz += r[k] * s[k];
            scale += silt_square(loose[d]) / diagonal[i];
            whole += silt_square(right[k]) / diagonal[i];
        }
    }
    // what walls hold is no measure of what is solved for, only of its rounding
    const double target = silt_max(1e-24 * scale, 1e-30 * whole);
    f->momentum_iterations = 0;
    while (rz > target) {
        if (++f->momentum_iterations > FLUID_CG_LIMIT)
            return silt_fail(err, SILT_FAILED, "the momentum system did not converge in %d iterations (%d nodes)", FLUID_CG_LIMIT,
                             nodes->count);
        for (int k = 0; k < 2 * f->n_node; k++)
            as[k] = f->inertia[k / 2] * s[k];
        add_viscous(f, mesh, mu, s, 1, as);
        double sas = 0;
        for (int i = 0; i < f->n_node; i++) {
            project(f, i, as + 2 * i);
            sas += s[2 * i] * as[2 * i] + s[2 * i + 1] * as[2 * i + 1];
        }
        const double alpha = rz / sas;
        double fresh = 0;
        for (int k = 0; k < 2 * f->n_node; k++) {
            v[k] += alpha * s[k];
            r[k] -= alpha * as[k];
            fresh += r[k] * r[k] / diagonal[k / 2];
        }
        const double beta = fresh / rz;
        for (int k = 0; k < 2 * f->n_node; k++)
            s[k] = r[k] / diagonal[k / 2] + beta * s[k];
        rz = fresh;
        if (!isfinite(rz))
            return silt_fail(err, SILT_FAILED, "the momentum system gave numbers that are not finite");
    }
    return SILT_OK;
}

// residual of continuity: G^T v + L p + Q pi - source - rate; where no velocity can mend it, of its smoothing alone
static void continuity(silt_fluid *f, const silt_mesh *mesh, const silt_drag *drag, const double *v, const double *p) {
    for (int j = 0; j < f->n_node; j++) {
        const double asked = -f->rate[j] - (drag ? drag->source[j] : 0);
        f->residual[j] = f->mobile[j] == 1 ? asked : 0;
        f->withheld[j] = f->mobile[j] == 1 ? 0 : asked;
    }
    for (int e = 0; e < f->n_cell; e++) {
        const int *cell = mesh->cell[e];
        double divergence = 0, carried[2] = {0, 0}, flux[2];
        for (int a = 0; a < 3; a++)
            for (int d = 0; d < 2; d++) {
                divergence += v[2 * cell[a] + d] * f->grad[e][a][d];
                carried[d] += f->share[e][a] * v[2 * cell[a] + d];
            }
        for (int d = 0; d < 2; d++) {
            double slope = 0, mean = 0;
            for (int a = 0; a < 3; a++) {
                slope += p[cell[a]] * f->grad[e][a][d];
                mean += f->projection[2 * cell[a] + d] / 3;
            }
            flux[d] = f->tau[e] * (slope + mean);
        }
        for (int a = 0; a < 3; a++) {
            const double *grad = f->grad[e][a];
            const double gain = f->area[e] * (divergence / 3 + grad[0] * carried[0] + grad[1] * carried[1]);
            f->residual[cell[a]] += f->area[e] * (grad[0] * flux[0] + grad[1] * flux[1]);
            *(f->mobile[cell[a]] == 1 ? &f->residual[cell[a]] : &f->withheld[cell[a]]) += gain;
        }
    }
}

// pi = -M^-1 Q^T p: the recovered pressure gradient, lumped
static void project_gradient(silt_fluid *f, const silt_mesh *mesh, const double *p) {
    memset(f->projection, 0, 2 * (size_t)f->n_node * sizeof(double));
    memset(f->projection_weight, 0, (size_t)f->n_node * sizeof(double));
    for (int e = 0; e < f->n_cell; e++) {
        const int *cell = mesh->cell[e];
        const double weight = f->tau[e] * f->area[e];
        double slope[2] = {0, 0};
        for (int a = 0; a < 3; a++)
            for (int d = 0; d < 2; d++)
                slope[d] += p[cell[a]] * f->grad[e][a][d];
        for (int a = 0; a < 3; a++) {
            f->projection_weight[cell[a]] += weight;
            for (int d = 0; d < 2; d++)
                f->projection[2 * cell[a] + d] -= weight * slope[d];
        }
    }
    for (int i = 0; i < f->n_node; i++)
        if (f->projection_weight[i] > 0)
            for (int d = 0; d < 2; d++)
                f->projection[2 * i + d] /= f->projection_weight[i];
}

// debts spread a little among neighbours, then ask for their volume back
static void debts_ask(silt_fluid *f, const silt_scene *scene, silt_nodes *nodes, const silt_mesh *mesh, double dt) {
    memset(f->rate, 0, (size_t)f->n_node * sizeof(double));
    f->given_back = 0;
    if (!scene->fluid.volume_control)
        return;
    const double g = hypot(scene->gravity[0], scene->gravity[1]);
    const double time = silt_max(scene->fluid.volume_steps * dt, g > 0 ? 2 * sqrt(scene->fluid.size / g) : 0);
    double *change = f->residual;
    for (int sweep = 0; sweep < 4; sweep++) {
        memset(change, 0, (size_t)f->n_node * sizeof(double));
        for (int i = 0; i < f->n_node; i++)
            for (int k = mesh->neighbour_start[i]; mesh->wet[i] && k < mesh->neighbour_start[i + 1]; k++) {
                const int j = mesh->neighbour[k];
                if (j <= i || f->volume[i] <= 0 || f->volume[j] <= 0)
                    continue;
                const double flow = (nodes->debt[i] / f->volume[i] - nodes->debt[j] / f->volume[j]) *
                                    silt_min(f->volume[i], f->volume[j]) / 12;
                change[i] -= flow;
                change[j] += flow;
            }
        for (int i = 0; i < f->n_node; i++)
            nodes->debt[i] += change[i];
    }
    for (int i = 0; i < f->n_node; i++)
        if (mesh->wet[i]) {
            f->rate[i] = silt_clamp(nodes->debt[i], -FLUID_DEBT_CAP * f->volume[i], FLUID_DEBT_CAP * f->volume[i]) / time;
        }
    // a piece of water without free surface can neither grow nor shrink: there debts only move
    int *parent = silt_alloc((size_t)f->n_node + 1, sizeof *parent);
    double *sum = silt_alloc(2 * (size_t)f->n_node + 2, sizeof *sum);
    for (int i = 0; i < f->n_node; i++)
        parent[i] = i;
    for (int e = 0; e < f->n_cell; e++)
        silt_group_join(parent, mesh->cell[e]);
    for (int i = 0; i < f->n_node; i++) {
        const int r = silt_group_find(parent, i);
        sum[2 * r] += f->rate[i];
        sum[2 * r + 1] += mesh->surface[i] ? HUGE_VAL : f->volume[i];
    }
    for (int i = 0; i < f->n_node; i++) {
        const int r = silt_group_find(parent, i);
        if (isfinite(sum[2 * r + 1]) && sum[2 * r + 1] > 0)
            f->rate[i] -= sum[2 * r] * f->volume[i] / sum[2 * r + 1];
    }
    free(parent);
    free(sum);
}

// where water is hemmed in, a debt cannot be paid: it waits. @return whether any was let off
static bool debts_relent(silt_fluid *f) {
    bool any = false;
    for (int i = 0; i < f->n_node; i++)
        if (f->rate[i] != 0 && fabs(f->residual[i]) > 0.2 * fabs(f->rate[i])) {
            f->rate[i] = 0;
            any = true;
        }
    return any;
}

// which nodes may be let off: between held ones; also where little is missing; all
typedef enum { POCKET_HELD = 0, POCKET_LITTLE, POCKET_ANY } silt_pocket;

// Water hemmed in between bed, walls, bodies and grains may have no velocity that keeps its volume, and then its pressure
// means nothing: such a node takes that of its surroundings, and what it gains is owed; at last also a node that is free,
// a crumpled drop, when it is little. @return whether there was any
static bool pockets_relent(silt_fluid *f, const silt_mesh *mesh, silt_pocket which, double limit, double dt, double *p) {
    bool any = false;
    for (int i = 0; i < f->n_node; i++) {
        if (!mesh->wet[i] || f->mobile[i] != 1 || fabs(f->residual[i]) * dt <= limit * f->volume[i])
            continue;
        double sum = 0;
        int held = 0, count = 0;
        for (int k = mesh->neighbour_start[i]; k < mesh->neighbour_start[i + 1]; k++) {
            const int j = mesh->neighbour[k];
            held += f->hold[j] > 0;
            if (j != i && f->mobile[j] == 1) {
                sum += p[j];
                count++;
            }
        }
        const bool little = which == POCKET_LITTLE && fabs(f->residual[i]) * dt < 20 * limit * f->volume[i];
        if (2 * held <= mesh->neighbour_start[i + 1] - mesh->neighbour_start[i] && !little && which != POCKET_ANY)
            continue;
        f->mobile[i] = 2;
        p[i] = count ? sum / count : 0;
        any = true;
    }
    return any;
}

// forces that hold the held components; what is left on the free ones is the solver's error
static void reactions(silt_fluid *f, const silt_scene *scene, const silt_nodes *nodes, const silt_mesh *mesh,
                      const silt_drag *drag, double dt, const double *p) {
    double *out = f->reaction;
    momentum_right(f, scene, nodes, mesh, drag, dt, p, out);
    for (int k = 0; k < 2 * f->n_node; k++)
        out[k] = f->inertia[k / 2] * f->w[k] - out[k];
    add_viscous(f, mesh, scene->fluid.viscosity, f->w, 1, out);

    f->from_grains[0] = f->from_grains[1] = 0;
    double lost[2] = {0, 0}, unbalanced[2] = {0, 0};
    f->momentum_scale = 0;
    f->worked = 0;
    memset(f->scratch, 0, 2 * (size_t)f->n_node * sizeof(double));
    add_pressure(f, mesh, p, f->scratch, lost);
    for (int i = 0; i < f->n_node; i++) {
        if (!mesh->wet[i]) {
            out[2 * i] = out[2 * i + 1] = 0;
            continue;
        }
        double free_part[2] = {out[2 * i], out[2 * i + 1]};
        project(f, i, free_part);
        for (int d = 0; d < 2; d++) {
            out[2 * i + d] -= free_part[d];
            f->worked += dt * out[2 * i + d] * f->w[2 * i + d];
            if (drag)
                f->worked += dt * (drag->push[2 * i + d] - drag->coefficient[i] * f->w[2 * i + d]) * f->w[2 * i + d];
            unbalanced[d] += free_part[d];
            f->momentum_scale += fabs(f->mass[i] * scene->gravity[d]) + fabs(f->inertia[i] * (f->w[2 * i + d] - nodes->v[2 * i + d]));
            if (drag)
                f->from_grains[d] += drag->push[2 * i + d] - drag->coefficient[i] * f->w[2 * i + d];
        }
    }
    if (drag)
        for (int d = 0; d < 2; d++)
            f->from_grains[d] += lost[d];
    f->momentum_residual = hypot(unbalanced[0], unbalanced[1]);

    // viscous dissipation w . K w
    memset(f->scratch, 0, 2 * (size_t)f->n_node * sizeof(double));
    add_viscous(f, mesh, scene->fluid.viscosity, f->w, 1, f->scratch);
    f->dissipated = 0;
    for (int k = 0; k < 2 * f->n_node; k++)
        f->dissipated += dt * f->scratch[k] * f->w[k];
}

static silt_status fluid_iterate(silt_fluid *f, const silt_scene *scene, const silt_nodes *nodes, const silt_mesh *mesh,
                                 const silt_drag *drag, double dt, double *p, silt_error *err) {
    const silt_fluid_def *def = &scene->fluid;
    const bool consistent = def->pressure == PRESSURE_CONSISTENT;
    const double stiff = def->viscosity * def->theta * dt / (def->density * def->size * def->size);
    int worst_node = 0;
    double before = HUGE_VAL;
    for (f->iterations = 0;; f->iterations++) {
        double tick = silt_seconds();
        if (drag && drag->update)
            drag->update(drag->self, f->w, p, dt);
        midpoint(f, scene, nodes, mesh, drag, dt);
        if (f->iterations == 0) {
            find_mobile(f, mesh);
            find_crumbs(f, mesh, p);
        }
        if (f->iterations == 0 || !consistent)
            project_gradient(f, mesh, p);
        momentum_right(f, scene, nodes, mesh, drag, dt, p, f->force);
        if (f->iterations == 0) {
            f->seconds_assemble += silt_seconds() - tick;
            tick = silt_seconds();
            SILT_TRY(silt_pressure_factor(f->pressure, scene, f, nodes, mesh, err));
            f->seconds_solve += silt_seconds() - tick;
        } else
            f->seconds_assemble += silt_seconds() - tick;
        tick = silt_seconds();

        // velocity with the pressure of the last iterate
        if (def->scheme == SCHEME_IMPLICIT && def->viscosity > 0) {
            memcpy(f->star, f->w, 2 * (size_t)f->n_node * sizeof(double));
            for (int i = 0; i < f->n_node && f->wall_normals.n_row; i++)
                if (f->hold[i] == 1) { // normals that have changed with the midpoint mesh
                    project(f, i, f->star + 2 * i);
                    for (int d = 0; d < 2; d++)
                        f->star[2 * i + d] += f->given[2 * i + d];
                }
            SILT_TRY(momentum_implicit(f, scene, nodes, mesh, f->force, f->star, err));
        } else {
            add_viscous(f, mesh, def->viscosity, f->w, -1, f->force);
            for (int i = 0; i < f->n_node; i++) {
                double v[2] = {f->force[2 * i] / f->inertia[i], f->force[2 * i + 1] / f->inertia[i]}, held[2];
                project(f, i, v);
                held_velocity(f, nodes, i, held);
                for (int d = 0; d < 2; d++)
                    f->star[2 * i + d] = v[d] + held[d];
            }
        }
        for (int i = 0; i < f->n_node; i++)
            if (!mesh->wet[i])
                f->star[2 * i] = f->star[2 * i + 1] = 0;
        continuity(f, mesh, drag, f->star, p);
        f->seconds_assemble += silt_seconds() - tick;

        // share of its volume that a node would gain or lose in the step
        f->worst = 0;
        for (int j = 0; j < f->n_node; j++) {
            if (!mesh->wet[j])
                continue;
            const double held = (!consistent && mesh->surface[j]) || f->mobile[j] != 1 ? 0 : fabs(f->residual[j]) * dt / f->volume[j];
            if (held > f->worst || !isfinite(held)) {
                f->worst = held;
                worst_node = j;
            }
        }
        if (!isfinite(f->worst))
            return silt_fail(err, SILT_FAILED, "the velocity is not finite near (%g, %g)", nodes->x[2 * worst_node],
                             nodes->x[2 * worst_node + 1]);
        const bool fine = f->worst <= def->tolerance;
        // at the end of the iterations a small residual is accepted
        if (fine || (f->iterations >= def->iterations && f->worst < 1e3 * def->tolerance)) {
            memcpy(f->w, f->star, 2 * (size_t)f->n_node * sizeof(double));
            return SILT_OK;
        }
        if (f->iterations >= def->iterations && f->iterations % 4 == 0 && debts_relent(f))
            continue;
        // only when the residual stands still, and it is no small matter
        if (f->iterations > def->iterations && f->iterations % 4 == 2 && f->worst > 0.9 * before &&
            pockets_relent(f, mesh, f->iterations >= 2 * def->iterations ? POCKET_LITTLE : POCKET_HELD, silt_max(1e3 * def->tolerance, 1e-4), dt, p))
            continue;
        // the last try of a step lets every node off that will not come: its volume is owed
        const bool astray = f->iterations > 3 && f->worst > 10 * before && f->worst > 0.1;
        if (f->last_try && f->iterations < 6 * def->iterations &&
            (astray || (f->iterations > 2 * def->iterations && f->iterations % 4 == 1)) &&
            pockets_relent(f, mesh, POCKET_ANY, silt_max(1e3 * def->tolerance, 1e-4), dt, p)) {
            before = HUGE_VAL;
            continue;
        }
        if (f->iterations >= (f->last_try ? 6 : 3) * def->iterations || astray)
            return silt_fail(err, SILT_FAILED,
                             "continuity did not converge: a node at (%g, %g) would still gain %.2g of its volume after %d iterations",
                             nodes->x[2 * worst_node], nodes->x[2 * worst_node + 1], f->worst, f->iterations);
        before = f->worst;

        tick = silt_seconds();
        for (int j = 0; j < f->n_node; j++)
            f->residual[j] = mesh->wet[j] ? -f->residual[j] : 0;
        SILT_TRY(silt_pressure_solve(f->pressure, f->residual, f->increment, err));
        f->seconds_solve += silt_seconds() - tick;
        tick = silt_seconds();
        memset(f->scratch, 0, 2 * (size_t)f->n_node * sizeof(double));
        add_pressure(f, mesh, f->increment, f->scratch, NULL);
        for (int i = 0; i < f->n_node; i++) {
            double dv[2] = {f->scratch[2 * i] / f->inertia[i], f->scratch[2 * i + 1] / f->inertia[i]};
            project(f, i, dv);
            for (int d = 0; d < 2; d++)
                f->w[2 * i + d] = f->star[2 * i + d] + (mesh->wet[i] ? dv[d] : 0);
            p[i] += f->increment[i];
            // stiff viscosity: the Schur complement is nearer to the viscous one; with the stabilisation in it 0.5 converges
            if (stiff > 1 && mesh->wet[i])
                p[i] += FLUID_STIFF * def->viscosity * f->residual[i] / f->volume[i];
        }
        project_gradient(f, mesh, p);
        f->seconds_assemble += silt_seconds() - tick;
    }
}

silt_status silt_fluid_step(silt_fluid *f, const silt_scene *scene, const silt_walls *walls, silt_nodes *nodes,
                            const silt_mesh *mesh, const silt_drag *drag, double dt, silt_error *err) {
    fluid_reserve(f, nodes->count, mesh->n_cell);
    if (!f->pressure)
        f->pressure = silt_pressure_create();
    f->seconds_assemble = f->seconds_solve = 0;
    f->iterations = 0;
    f->walls = walls;
    hold_nodes(f, scene, walls, nodes, mesh);
    for (int i = 0; i < f->n_node; i++) {
        double v[2] = {nodes->v[2 * i], nodes->v[2 * i + 1]}, held[2];
        project(f, i, v);
        held_velocity(f, nodes, i, held);
        for (int d = 0; d < 2; d++)
            f->w[2 * i + d] = !mesh->wet[i] ? 0 : v[d] + held[d];
    }
    wall_friction(f, scene, walls, nodes, mesh);
    for (int i = 0; i < f->n_node; i++) {
        f->mobile[i] = 1;
        f->withheld[i] = f->residual[i] = 0;
    }
    midpoint(f, scene, nodes, mesh, drag, dt);
    debts_ask(f, scene, nodes, mesh, dt);

    double *p = silt_alloc((size_t)f->n_node + 1, sizeof *p); // kept apart until the step is accepted
    for (int i = 0; i < f->n_node; i++)
        // with the Laplacian the surface's pressure is prescribed
        p[i] = mesh->wet[i] && !(scene->fluid.pressure == PRESSURE_LAPLACIAN && mesh->surface[i]) ? nodes->p[i] : 0;
    const silt_status status = mesh->n_cell ? fluid_iterate(f, scene, nodes, mesh, drag, dt, p, err) : SILT_OK;
    if (status == SILT_OK) {
        reactions(f, scene, nodes, mesh, drag, dt, p);
        f->solved_volume = 0;
        for (int i = 0; i < f->n_node; i++) {
            nodes->p[i] = p[i];
            f->solved_volume += f->residual[i] * dt;
            nodes->debt[i] -= (f->rate[i] + (f->mobile[i] != 1 ? f->withheld[i] : 0)) * dt;
            f->given_back += f->rate[i] * dt;
            if (!mesh->wet[i])
                continue;
            // what was held keeps its velocity, the rest goes on to the end of the step
            for (int d = 0; d < 2; d++)
                nodes->v[2 * i + d] = f->hold[i] == 2 ? f->w[2 * i + d]
                                                      : nodes->v[2 * i + d] + (f->w[2 * i + d] - nodes->v[2 * i + d]) / scene->fluid.theta;
            // on a bent wall the velocity turns on: contact takes it along the wall
            const bool bent = f->wall_normals.n_row && f->wall_normals.row[i] >= 0;
            if (f->hold[i] == 1 && !bent) {
                project(f, i, nodes->v + 2 * i);
                for (int d = 0; d < 2; d++)
                    nodes->v[2 * i + d] += f->given[2 * i + d];
            }
        }
    }
    free(p);
    return status;
}
