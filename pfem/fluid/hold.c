// what surroundings hold: tank walls, bed, bodies, inlets; and the friction that they exert where water slides
#include "fluid.h"

#define BED_FLUSH 0.866 // cosine of the largest turn, 30 degrees, between bed and a wall that goes on from it

void silt_hold_project_held(const silt_fluid *f, int i, double *v) {
    const int D = f->dim;
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

// normal of a facet into the water, as long as the facet
static void facet_normal(const double *x, const int *facet, double n[2]) {
    n[0] = -(x[2 * facet[1] + 1] - x[2 * facet[0] + 1]);
    n[1] = x[2 * facet[1]] - x[2 * facet[0]];
}

// Slip on the bed ends where it meets something else that is shut: in a corner with a wall, where a node that slid on would go
// through that wall; and at the mouth of a slit between bed and body, whose nodes cannot follow a surface: what a sliding one
// leaves behind is new water in every step, driven on by its own pressure. A wall that goes on from the bed has its share of the normal.
static void hold_bed_ends(silt_fluid *f, const silt_step *s) {
    const silt_mesh *mesh = s->mesh;
    const uint8_t *kind = s->nodes->kind;
    for (int k = 0; k < mesh->n_facet; k++)
        for (int c = 0; c < 2; c++) {
            const int i = mesh->facet[k][c], other = mesh->facet[k][1 - c];
            if (kind[i] != NODE_BED || f->hold[i] != HOLD_NORMAL)
                continue;
            const bool slit = mesh->facet_kind[k] == FACET_FREE && kind[other] == NODE_BODY;
            double n[2], *bed = f->normal + 2 * i;
            facet_normal(s->nodes->x, mesh->facet[k], n);
            const double turn = (n[0] * bed[0] + n[1] * bed[1]) / (silt_length(2, n) * silt_length(2, bed));
            if (slit || (mesh->facet_kind[k] == FACET_WALL && !(turn > BED_FLUSH)))
                f->hold[i] = HOLD_ALL;
            else if (mesh->facet_kind[k] == FACET_WALL)
                for (int d = 0; d < 2; d++)
                    bed[d] += n[d];
        }
}

// slip on the bed: the normal of its facets around the node
static void hold_bed(silt_fluid *f, const silt_step *s) {
    const silt_mesh *mesh = s->mesh;
    for (int k = 0; k < mesh->n_facet; k++) {
        if (mesh->facet_kind[k] != FACET_BED)
            continue;
        double n[2];
        facet_normal(s->nodes->x, mesh->facet[k], n);
        for (int c = 0; c < 2; c++) {
            const int i = mesh->facet[k][c];
            for (int d = 0; d < 2; d++)
                f->normal[2 * i + d] += n[d];
            f->hold[i] = HOLD_NORMAL;
        }
    }
    hold_bed_ends(f, s);
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
