// volume that remeshing took or gave and that is owed; water that cannot keep its volume
#include "fluid.h"

#define DEBT_CAP 0.3 // largest share of a node's volume that its debt may ask for
#define HELD_BESIDE 9   // held all round, beside one that is not
#define DEBT_SPRAY 0.1 // of h^3: a node of the free surface that has less is spray

static double gravity_size(const silt_scene *scene) {
    return sqrt(silt_square(scene->gravity[0]) + silt_square(scene->gravity[1]) + silt_square(scene->gravity[2]));
}

// Pieces of water: every node's is called by its lowest node. Found once for a mesh by walking along neighbours, since several ask
// (union-find over the cells, three times a step, was 0.08 us per node).
static const int *pieces(silt_fluid *f, const silt_mesh *mesh) {
    if (f->piece_revision == mesh->revision && f->piece)
        return f->piece;
    f->piece_revision = mesh->revision;
    SILT_RESERVE(f->piece, f->piece_capacity, f->n_node + 1);
    SILT_RESERVE(f->walk, f->walk_capacity, f->n_node + 1);
    for (int i = 0; i < f->n_node; i++)
        f->piece[i] = -1;
    for (int i = 0; i < f->n_node; i++) {
        int count = 0;
        if (f->piece[i] < 0) {
            f->piece[i] = i;
            f->walk[count++] = i;
        }
        while (count > 0) {
            const int at = f->walk[--count];
            for (int k = mesh->neighbour_start[at]; k < mesh->neighbour_start[at + 1]; k++) {
                const int j = mesh->neighbour[k];
                if (f->piece[j] < 0) {
                    f->piece[j] = i;
                    f->walk[count++] = j;
                }
            }
        }
    }
    SILT_RESERVE(f->closed, f->closed_capacity, f->n_node + 1);
    memset(f->closed, 0, (size_t)f->n_node);
    for (int i = 0; i < f->n_node; i++)
        if (mesh->wet[i])
            f->closed[f->piece[i]] = 1;
    for (int i = 0; i < f->n_node; i++)
        if (mesh->surface[i])
            f->closed[f->piece[i]] = 0;
    for (int k = 0; k < mesh->n_facet; k++)
        if (mesh->facet_kind[k] == FACET_OPEN)
            f->closed[f->piece[mesh->facet[k][0]]] = 0;
    return f->piece;
}

const uint8_t *silt_closed_pieces(silt_fluid *f, const silt_mesh *mesh) {
    pieces(f, mesh);
    return f->closed;
}

// a piece of water without free surface or opening with a level can neither grow nor shrink: there debts only move
static void keep_closed(silt_fluid *f, const silt_mesh *mesh) {
    const int *piece = pieces(f, mesh);
    double *rate = f->cg[0], *volume = f->cg[1];
    for (int i = 0; i < f->n_node; i++)
        rate[i] = volume[i] = 0;
    for (int i = 0; i < f->n_node; i++) {
        rate[piece[i]] += f->rate[i];
        volume[piece[i]] += mesh->surface[i] ? HUGE_VAL : f->volume[i];
    }
    for (int k = 0; k < mesh->n_facet; k++)
        if (mesh->facet_kind[k] == FACET_OPEN)
            volume[piece[mesh->facet[k][0]]] = HUGE_VAL;
    for (int i = 0; i < f->n_node; i++) {
        const int r = piece[i];
        if (isfinite(volume[r]) && volume[r] > 0)
            f->rate[i] -= rate[r] * f->volume[i] / volume[r];
    }
}

// what a node owes over its volume evens out between neighbours, four times
static void spread_debts(silt_fluid *f, const silt_mesh *mesh, double *debt) {
    double *change = f->residual, *full = f->increment;
    const double share = 1.0 / (f->dim == 3 ? 30 : 12);
    for (int sweep = 0; sweep < 4; sweep++) {
        for (int i = 0; i < f->n_node; i++) {
            change[i] = 0;
            full[i] = debt[i] / f->volume[i];
        }
        for (int i = 0; i < f->n_node; i++) {
            if (!mesh->wet[i] || !(f->volume[i] > 0))
                continue;
            double sum = 0;
            for (int k = mesh->neighbour_start[i]; k < mesh->neighbour_start[i + 1]; k++) {
                const int j = mesh->neighbour[k];
                if (j <= i || !(f->volume[j] > 0))
                    continue;
                const double flow = (full[i] - full[j]) * silt_min(f->volume[i], f->volume[j]) * share;
                sum += flow;
                change[j] += flow;
            }
            change[i] -= sum;
        }
        for (int i = 0; i < f->n_node; i++)
            debt[i] += change[i];
    }
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
    spread_debts(f, mesh, debt);
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
        f->mobile[i] = f->hold[i] != HOLD_ALL;
        for (int k = mesh->neighbour_start[i]; !f->mobile[i] && k < mesh->neighbour_start[i + 1]; k++) {
            const int j = mesh->neighbour[k];
            f->mobile[i] = f->hold[j] != HOLD_ALL || (f->belt && silt_length(f->dim, f->belt + f->dim * j) > 0);
        }
        if (!f->mobile[i])
            f->rate[i] = 0;
    }
    // at films such nodes keep it too: what a body squeezes there must go on, by the smoothing, or a full tank could not answer
    for (int i = 0; f->film && i < f->n_node; i++)
        for (int k = mesh->neighbour_start[i]; f->mobile[i] == 0 && k < mesh->neighbour_start[i + 1]; k++)
            if (f->hold[mesh->neighbour[k]] == HOLD_ALL && f->mobile[mesh->neighbour[k]] == 1)
                f->mobile[i] = HELD_BESIDE;
    for (int i = 0; f->film && i < f->n_node; i++)
        f->mobile[i] = f->mobile[i] == HELD_BESIDE ? 1 : f->mobile[i];
    // films and crumbs of water on bed, walls or bodies, with a node or two that are free: too few to keep a volume; they
    // run as drops do, at no pressure, and what they gain is owed
    const int *piece = pieces(f, mesh);
    double *n_free = f->cg[0], *held = f->cg[1];
    for (int i = 0; i < f->n_node; i++)
        n_free[i] = held[i] = 0;
    for (int i = 0; i < f->n_node; i++) {
        n_free[piece[i]] += f->hold[i] != HOLD_ALL;
        held[piece[i]] += f->hold[i] != HOLD_FREE;
    }
    for (int i = 0; i < f->n_node; i++) {
        const int r = piece[i];
        if (!mesh->wet[i] || n_free[r] > 2 || held[r] == 0 || f->mobile[i] != 1)
            continue;
        f->mobile[i] = 2;
        f->rate[i] = p[i] = 0;
    }
}

// Nodes on tips of the free surface with a cell or two behind them, in space: at no pressure, as the surface is, and without a say in
// the volume; what they gain is owed. Each volume is kept by cells that heavier nodes share, which a light one can answer
// only by being shot out, and pressures between such nodes are what conjugate gradients crawl for: 94 -> 49 a step in the
// collapse at ten cells, 5.7 -> 4.5 U1 a step. Where the surface has a pressure, of tension or closed air, it is not known there.
void silt_spray_find(silt_fluid *f, const silt_step *s, double *p) {
    const silt_mesh *mesh = s->mesh;
    if (f->dim != 3 || s->pockets || s->scene->fluid.surface_tension > 0 || s->scene->fluid.pressure != PRESSURE_CONSISTENT)
        return;
    for (int i = 0; i < f->n_node; i++) {
        const double h = silt_node_h(s->nodes, i, s->scene->fluid.size);
        if (!mesh->wet[i] || !mesh->surface[i] || f->mobile[i] != 1 || s->nodes->kind[i] != NODE_FLUID ||
            f->volume[i] > DEBT_SPRAY * h * h * h)
            continue;
        f->mobile[i] = MOBILE_SPRAY;
        f->rate[i] = p[i] = 0;
    }
}

// a piece of water none of whose nodes keeps its volume any more has no pressure to take: it runs as drops do
static void loose_pieces(silt_fluid *f, const silt_mesh *mesh, double *p) {
    const int *piece = pieces(f, mesh);
    double *kept = f->cg[0];
    for (int i = 0; i < f->n_node; i++)
        kept[i] = 0;
    for (int i = 0; i < f->n_node; i++)
        kept[piece[i]] += f->mobile[i] == 1;
    for (int i = 0; i < f->n_node; i++)
        if (mesh->wet[i] && kept[piece[i]] == 0)
            p[i] = 0;
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
