// volume that remeshing took or gave and that is owed; water that cannot keep its volume
#include "fluid.h"

#define DEBT_CAP 0.3 // largest share of a node's volume that its debt may ask for

static double gravity_size(const silt_scene *scene) {
    return sqrt(silt_square(scene->gravity[0]) + silt_square(scene->gravity[1]) + silt_square(scene->gravity[2]));
}

// a piece of water without free surface or opening with a level can neither grow nor shrink: there debts only move
static void keep_closed(silt_fluid *f, const silt_mesh *mesh) {
    int *parent = silt_alloc((size_t)f->n_node + 1, sizeof *parent);
    double *rate = silt_alloc((size_t)f->n_node + 1, sizeof *rate), *volume = silt_alloc((size_t)f->n_node + 1, sizeof *volume);
    for (int i = 0; i < f->n_node; i++)
        parent[i] = i;
    for (int e = 0; e < f->n_cell; e++)
        silt_group_join(parent, mesh->cell[e]);
    for (int i = 0; i < f->n_node; i++) {
        const int r = silt_group_find(parent, i);
        rate[r] += f->rate[i];
        volume[r] += mesh->surface[i] ? HUGE_VAL : f->volume[i];
    }
    for (int k = 0; k < mesh->n_facet; k++)
        if (mesh->facet_kind[k] == FACET_OPEN)
            volume[silt_group_find(parent, mesh->facet[k][0])] = HUGE_VAL;
    for (int i = 0; i < f->n_node; i++) {
        const int r = silt_group_find(parent, i);
        if (isfinite(volume[r]) && volume[r] > 0)
            f->rate[i] -= rate[r] * f->volume[i] / volume[r];
    }
    free(parent);
    free(rate);
    free(volume);
}

void silt_debts_ask(silt_fluid *f, const silt_step *s) {
    const silt_mesh *mesh = s->mesh;
    double *debt = s->nodes->debt;
    memset(f->rate, 0, (size_t)f->n_node * sizeof(double));
    f->given_back = 0;
    if (!s->scene->fluid.volume_control)
        return;
    const double g = gravity_size(s->scene);
    const silt_fluid_def *def = &s->scene->fluid;
    const double least = def->volume_time > 0 ? def->volume_time : g > 0 ? 2 * sqrt(def->size / g) : 0;
    const double time = silt_max(def->volume_steps * s->dt, least);
    double *change = f->residual;
    for (int sweep = 0; sweep < 4; sweep++) {
        memset(change, 0, (size_t)f->n_node * sizeof(double));
        for (int i = 0; i < f->n_node; i++)
            for (int k = mesh->neighbour_start[i]; mesh->wet[i] && k < mesh->neighbour_start[i + 1]; k++) {
                const int j = mesh->neighbour[k];
                if (j <= i || f->volume[i] <= 0 || f->volume[j] <= 0)
                    continue;
                const double flow = (debt[i] / f->volume[i] - debt[j] / f->volume[j]) * silt_min(f->volume[i], f->volume[j]) /
                                    (f->dim == 3 ? 30 : 12);
                change[i] -= flow;
                change[j] += flow;
            }
        for (int i = 0; i < f->n_node; i++)
            debt[i] += change[i];
    }
    for (int i = 0; i < f->n_node; i++)
        // with the Laplacian the surface's nodes cannot be asked
        if (mesh->wet[i] && !(mesh->surface[i] && s->scene->fluid.pressure == PRESSURE_LAPLACIAN))
            f->rate[i] = silt_clamp(debt[i], -DEBT_CAP * f->volume[i], DEBT_CAP * f->volume[i]) / time;
    keep_closed(f, mesh);
}

bool silt_debts_relent(silt_fluid *f) {
    bool any = false;
    for (int i = 0; i < f->n_node; i++)
        if (f->rate[i] != 0 && fabs(f->residual[i]) > 0.2 * fabs(f->rate[i])) {
            f->rate[i] = 0;
            any = true;
        }
    return any;
}

void silt_mobile_find(silt_fluid *f, const silt_mesh *mesh, double *p) {
    // a node whose whole surroundings are held has no say in its volume. But in the corner of a lid it keeps its equation, which the
    // smoothing meets: what the lid drags into that corner and out of the other must have its like, or a closed tank cannot be full
    for (int i = 0; i < f->n_node; i++) {
        f->mobile[i] = 0;
        for (int k = mesh->neighbour_start[i]; k < mesh->neighbour_start[i + 1]; k++) {
            const int j = mesh->neighbour[k];
            f->mobile[i] |= f->hold[j] != HOLD_ALL || (f->belt && silt_length(f->dim, f->belt + f->dim * j) > 0);
        }
        if (!f->mobile[i])
            f->rate[i] = 0;
    }
    // films and crumbs of water on bed, walls or bodies, with a node or two that are free: too few to keep a volume; they
    // run as drops do, at no pressure, and what they gain is owed
    int *parent = silt_alloc((size_t)f->n_node + 1, sizeof *parent), *n_free = silt_alloc((size_t)f->n_node + 1, sizeof *n_free);
    uint8_t *held = silt_alloc((size_t)f->n_node + 1, 1);
    for (int i = 0; i < f->n_node; i++)
        parent[i] = i;
    for (int e = 0; e < f->n_cell; e++)
        silt_group_join(parent, mesh->cell[e]);
    for (int i = 0; i < f->n_node; i++) {
        n_free[silt_group_find(parent, i)] += f->hold[i] != HOLD_ALL;
        held[silt_group_find(parent, i)] |= f->hold[i] != HOLD_FREE;
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

// a piece of water none of whose nodes keeps its volume any more has no pressure to take: it runs as drops do
static void loose_pieces(const silt_fluid *f, const silt_mesh *mesh, double *p) {
    int *parent = silt_alloc((size_t)f->n_node + 1, sizeof *parent);
    uint8_t *kept = silt_alloc((size_t)f->n_node + 1, 1);
    for (int i = 0; i < f->n_node; i++)
        parent[i] = i;
    for (int e = 0; e < f->n_cell; e++)
        silt_group_join(parent, mesh->cell[e]);
    for (int i = 0; i < f->n_node; i++)
        kept[silt_group_find(parent, i)] |= f->mobile[i] == 1;
    for (int i = 0; i < f->n_node; i++)
        if (mesh->wet[i] && !kept[silt_group_find(parent, i)])
            p[i] = 0;
    free(parent);
    free(kept);
}

// Water hemmed in between bed, walls, bodies and grains may have no velocity that keeps its volume, and then its pressure
// means nothing: such a node takes that of its surroundings, and what it gains is owed; at last also a node that is free,
// a crumpled drop, when it is little.
bool silt_pockets_relent(silt_fluid *f, const silt_mesh *mesh, silt_pocket which, double limit, double dt, double *p) {
    bool any = false;
    for (int i = 0; i < f->n_node; i++) {
        if (!mesh->wet[i] || f->mobile[i] != 1 || fabs(f->residual[i]) * dt <= limit * f->volume[i])
            continue;
        double sum = 0;
        int held = 0, count = 0;
        for (int k = mesh->neighbour_start[i]; k < mesh->neighbour_start[i + 1]; k++) {
            const int j = mesh->neighbour[k];
            held += f->hold[j] != HOLD_FREE;
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
    if (any)
        loose_pieces(f, mesh, p);
    return any;
}
