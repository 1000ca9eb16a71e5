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

void silt_hold_turn(const silt_fluid *f, int i, double *v) {
    const int D = f->dim;
    double whole = 0, along = 0;
    if (!f->wall_normals.n_row || f->wall_normals.row[i] < 0 || f->hold[i] != HOLD_NORMAL) {
        silt_hold_impose(f, i, v);
        return;
    }
    for (int d = 0; d < D; d++) {
        v[d] -= f->given[D * i + d];
        whole += v[d] * v[d];
    }
    silt_hold_project(f, i, v);
    for (int d = 0; d < D; d++)
        along += v[d] * v[d];
    const double factor = along > 0.5 * whole ? sqrt(whole / along) : 1;
    for (int d = 0; d < D; d++)
        v[d] = f->given[D * i + d] + factor * v[d];
}

void silt_hold_bent(silt_fluid *f, const silt_step *s) {
    const int D = f->dim;
    silt_wall_normals_take(&f->wall_normals, s->walls, s->nodes, s->mesh, f->x_mid);
    for (int i = 0; i < f->n_node; i++) {
        if (s->nodes->kind[i] != NODE_FLUID || f->wall_normals.row[i] < 0)
            continue;
        double vector[3], given[3];
        f->hold[i] = (uint8_t)silt_walls_held(s->walls, s->scene, &f->wall_normals, s->nodes, i, vector, given);
        memcpy(f->normal + D * i, vector, (size_t)D * sizeof(double));
        memcpy(f->given + D * i, given, (size_t)D * sizeof(double));
    }
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
    silt_wall_normals_take(&f->wall_normals, s->walls, nodes, s->mesh, nodes->x);
    for (int i = 0; i < f->n_node; i++) {
        double vector[3] = {0}, given[3];
        f->hold[i] = HOLD_ALL;
        // bodies and inlets move as they were told, walls as they do, the bed not at all
        if (nodes->kind[i] == NODE_BODY || nodes->kind[i] == NODE_INLET || nodes->kind[i] == NODE_CORNER)
            memcpy(f->given + D * i, nodes->v + D * i, (size_t)D * sizeof(double));
        else if (nodes->kind[i] == NODE_FLUID && nodes->wall[i][0] < 0)
            f->hold[i] = HOLD_FREE;
        else if (nodes->kind[i] == NODE_OPEN)
            f->hold[i] = (uint8_t)silt_level_hold(s, i, vector);
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
