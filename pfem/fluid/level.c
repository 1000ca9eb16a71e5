// openings behind which still water stands at a level: how they hold the nodes that lie on them, and what they press with
#include "fluid.h"

#define LEVEL_SIDE 0.9 // walls turned by less than this cosine from the opening lie beside it, others go on in its plane

bool silt_levels_any(const silt_scene *scene) {
    for (int k = 0; k < silt_opening_count(scene); k++)
        if (silt_opening_of(scene, k).level)
            return true;
    return false;
}

int silt_level_sides(const silt_walls *walls, const silt_opening *o, const int wall[3], const double *side[3]) {
    int n = 0;
    for (int k = 0; k < 3 && wall[k] >= 0; k++)
        if (fabs(silt_dot(3, walls->normal[wall[k]], o->normal)) < LEVEL_SIDE)
            side[n++] = walls->normal[wall[k]];
    return n;
}

void silt_level_way(const silt_opening *o, int n, const double *const side[3], double way[3]) {
    memcpy(way, o->normal, 3 * sizeof *way);
    if (n >= 2 && o->dim == 3) {
        for (int d = 0; d < 3; d++)
            way[d] = side[0][(d + 1) % 3] * side[1][(d + 2) % 3] - side[0][(d + 2) % 3] * side[1][(d + 1) % 3];
    } else if (n) {
        const double along = silt_dot(o->dim, way, side[0]);
        for (int d = 0; d < o->dim; d++)
            way[d] -= along * side[0][d];
    }
    const double length = silt_dot(o->dim, way, o->normal) < 0 ? -silt_length(o->dim, way) : silt_length(o->dim, way);
    for (int d = 0; d < 3; d++)
        way[d] = length != 0 ? way[d] / length : o->normal[d];
}

silt_hold silt_level_hold(const silt_step *s, int i, double vector[3]) {
    const silt_nodes *nodes = s->nodes;
    const silt_opening o = silt_opening_of(s->scene, nodes->owner[i]);
    const double *side[3] = {NULL};
    for (int k = 0; k < 3 && nodes->wall[i][k] >= 0; k++)
        if (!s->walls->slip[nodes->wall[i][k]])
            return HOLD_ALL;
    const int n = silt_level_sides(s->walls, &o, nodes->wall[i], side);
    // on the rim a wall in the opening's own plane holds the water back
    if (n < 3 && nodes->wall[i][n] >= 0) {
        memcpy(vector, o.normal, 3 * sizeof *vector);
        return s->mesh->surface[i] && n == 0 ? HOLD_NORMAL : HOLD_ALL;
    }
    // the surface slides up and down the opening; below it water passes straight through
    if (s->mesh->surface[i] && n == 0)
        return HOLD_FREE;
    if (s->mesh->surface[i] && n == 1 && o.dim == 3) {
        memcpy(vector, side[0], 3 * sizeof *vector);
        return HOLD_NORMAL;
    }
    silt_level_way(&o, n, side, vector);
    return HOLD_LINE;
}

void silt_facet_vector(const silt_mesh *mesh, int dim, const double *x, const int *facet, double vector[3]) {
    double u[3] = {0}, w[3] = {0};
    for (int d = 0; d < dim; d++) {
        u[d] = silt_shortest(mesh, d, x[dim * facet[1] + d] - x[dim * facet[0] + d]);
        w[d] = silt_shortest(mesh, d, x[dim * facet[dim - 1] + d] - x[dim * facet[0] + d]);
    }
    vector[0] = u[1];
    vector[1] = -u[0];
    vector[2] = 0;
    for (int d = 0; d < 3 && dim == 3; d++) {
        const int e = (d + 1) % 3, f = (d + 2) % 3;
        vector[d] = 0.5 * (u[e] * w[f] - u[f] * w[e]);
    }
}

void silt_levels_load(silt_fluid *f, const silt_step *s) {
    const silt_mesh *mesh = s->mesh;
    const int D = f->dim, up = silt_scene_up(s->scene);
    const double rho = s->scene->fluid.density, weight = -rho * s->scene->gravity[up];
    memset(f->level_force, 0, (size_t)(D * f->n_node) * sizeof(double));
    memset(f->level_brake, 0, (size_t)f->n_node * sizeof(double));
    for (int k = 0; k < mesh->n_facet; k++) {
        if (mesh->facet_kind[k] != FACET_OPEN)
            continue;
        const int *facet = mesh->facet[k];
        const silt_opening o = silt_opening_of(s->scene, s->nodes->owner[facet[0]]);
        const double level = silt_series_at(o.level, 1, s->time + 0.5 * s->dt);
        double vector[3], p[3], sum = 0;
        silt_facet_vector(mesh, D, f->x_mid, facet, vector);
        for (int a = 0; a < D; a++)
            sum += p[a] = weight * silt_max(0, level - f->x_mid[D * facet[a] + up]);
        for (int a = 0; a < D; a++) {
            const int i = facet[a];
            for (int d = 0; d < D; d++)
                f->level_force[D * i + d] -= vector[d] * (sum + p[a]) / (D * (D + 1));
            // what comes in from rest has left rho u^2/2 of its pressure behind: taken about the iterate's speed
            const double speed = silt_dot(D, f->w + D * i, o.normal), area = silt_length(D, vector) / D;
            if (!(speed > 0))
                continue;
            f->level_brake[i] += rho * speed * area;
            for (int d = 0; d < D; d++)
                f->level_force[D * i + d] += 0.5 * rho * speed * speed * area * o.normal[d];
        }
    }
    for (int i = 0; i < f->n_node; i++)
        f->friction[i] += f->level_brake[i];
}
