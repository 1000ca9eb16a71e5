// what surroundings hold: tank walls, bed, bodies, inlets; and the friction that they exert where water slides
#include "fluid.h"

void silt_hold_project(const silt_fluid *f, int i, double *v) {
    const int D = f->dim;
    if (f->hold[i] == HOLD_FREE)
        return;
    if (f->hold[i] == HOLD_ALL) {
        for (int d = 0; d < D; d++)
            v[d] = 0;
        return;
    }
    const double *n = f->normal + D * i;
    double along = 0;
    for (int d = 0; d < D; d++)
        along += v[d] * n[d];
    for (int d = 0; d < D; d++)
        v[d] = f->hold[i] == HOLD_NORMAL ? v[d] - along * n[d] : along * n[d];
}

void silt_hold_impose(const silt_fluid *f, int i, double *v) {
    silt_hold_project(f, i, v);
    if (f->hold[i] != HOLD_FREE)
        for (int d = 0; d < f->dim; d++)
            v[d] += f->given[f->dim * i + d];
}

// slip on the bed: the normal of its facets around the node
static void hold_bed(silt_fluid *f, const silt_step *s) {
    const silt_mesh *mesh = s->mesh;
    const double *x = s->nodes->x;
    for (int k = 0; k < mesh->n_facet; k++) {
        if (mesh->facet_kind[k] != FACET_BED)
            continue;
        const int a = mesh->facet[k][0], b = mesh->facet[k][1];
        const double dx = x[2 * b] - x[2 * a], dy = x[2 * b + 1] - x[2 * a + 1];
        for (int c = 0; c < 2; c++) {
            const int i = mesh->facet[k][c];
            f->normal[2 * i] -= dy;
            f->normal[2 * i + 1] += dx;
            f->hold[i] = HOLD_NORMAL;
        }
    }
    for (int i = 0; i < f->n_node; i++)
        if (s->nodes->kind[i] == NODE_BED && f->hold[i] == HOLD_NORMAL) {
            const double length = hypot(f->normal[2 * i], f->normal[2 * i + 1]);
            if (length > 0) {
                f->normal[2 * i] /= length;
                f->normal[2 * i + 1] /= length;
            } else
                f->hold[i] = HOLD_ALL;
        }
}

void silt_hold_nodes(silt_fluid *f, const silt_step *s) {
    const int D = f->dim;
    const silt_nodes *nodes = s->nodes;
    memset(f->given, 0, (size_t)D * (size_t)f->n_node * sizeof(double));
    if (f->belt)
        memset(f->belt, 0, (size_t)D * (size_t)f->n_node * sizeof(double));
    silt_wall_normals_take(&f->wall_normals, s->walls, nodes, s->mesh);
    for (int i = 0; i < f->n_node; i++) {
        double vector[3] = {0}, given[3];
        f->hold[i] = HOLD_ALL;
        // bodies and inlets move as they were told, walls as they do, the bed not at all
        if (nodes->kind[i] == NODE_BODY || nodes->kind[i] == NODE_INLET || nodes->kind[i] == NODE_CORNER)
            memcpy(f->given + D * i, nodes->v + D * i, (size_t)D * sizeof(double));
        else if (nodes->kind[i] == NODE_FLUID && nodes->wall[i][0] < 0)
            f->hold[i] = HOLD_FREE;
        else if (nodes->kind[i] == NODE_FLUID) {
            f->hold[i] = (uint8_t)silt_walls_held(s->walls, s->scene, &f->wall_normals, nodes, i, vector, given);
            memcpy(f->given + D * i, given, (size_t)D * sizeof(double));
            if (f->belt && f->hold[i] == HOLD_ALL)
                memcpy(f->belt + D * i, s->scene->wall[s->walls->wall[nodes->wall[i][0]]].velocity, (size_t)D * sizeof(double));
        }
        memcpy(f->normal + D * i, vector, (size_t)D * sizeof(double));
    }
    if (s->scene->bed.on && s->scene->bed.condition != WALL_NO_SLIP)
        hold_bed(f, s);
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
void silt_hold_friction(silt_fluid *f, const silt_step *s) {
    const silt_mesh *mesh = s->mesh;
    const silt_nodes *nodes = s->nodes;
    memset(f->friction, 0, (size_t)f->n_node * sizeof *f->friction);
    if (f->dim != 2)
        return;
    const double h = s->scene->fluid.size, rho = s->scene->fluid.density, nu = s->scene->fluid.viscosity / rho;
    for (int k = 0; k < mesh->n_facet; k++) {
        const int *edge = mesh->facet[k];
        double roughness = -1;
        if (mesh->facet_kind[k] == FACET_BED && s->scene->bed.condition == WALL_LAW)
            roughness = 2.5 * s->scene->grains.diameter;
        else if (mesh->facet_kind[k] == FACET_WALL)
            for (int a = 0; a < 2; a++)
                for (int b = 0; b < 2; b++)
                    if (nodes->wall[edge[0]][a] >= 0 && nodes->wall[edge[0]][a] == nodes->wall[edge[1]][b])
                        roughness = s->walls->roughness[nodes->wall[edge[0]][a]];
        if (roughness < 0)
            continue;
        const double length = hypot(nodes->x[2 * edge[1]] - nodes->x[2 * edge[0]], nodes->x[2 * edge[1] + 1] - nodes->x[2 * edge[0] + 1]);
        for (int c = 0; c < 2; c++) {
            const double speed = hypot(f->w[2 * edge[c]], f->w[2 * edge[c] + 1]);
            f->friction[edge[c]] += 0.5 * length * rho * wall_law(speed, h, nu, roughness);
        }
    }
}
