// how far an iterate of the step is, and when it may be accepted
#include "fluid.h"
#include "parallel.h"

#define FLUID_SPRAY 5        // passes after which the worst node may lag behind the rest
#define FLUID_NODE 0.25     // of h^D: the volume against which the continuity of a smaller node counts
#define EXPLICIT_SHARE 0.02 // of the water that may be too stiff for explicit viscosity: slivers

/** what continuity lacks in a chunk of the nodes */
typedef struct lack {
    double most, all, volume; // largest share of a node's volume, m3 of all, m3
    int node;                 // that has the largest
} lack;

static lack lack_of(const silt_fluid *f, const silt_step *s, int first, int last) {
    const bool consistent = s->scene->fluid.pressure == PRESSURE_CONSISTENT;
    lack l = {0};
    for (int j = first; j < last; j++) {
        if (!s->mesh->wet[j] || (!consistent && s->mesh->surface[j]) || f->mobile[j] != 1)
            continue;
        const double h = silt_node_h(s->nodes, j, s->scene->fluid.size);
        const double share = fabs(f->residual[j]) * s->dt / silt_max(f->volume[j], FLUID_NODE * (f->dim == 3 ? h * h * h : h * h));
        if (share > l.most || !isfinite(share)) {
            l.most = share;
            l.node = j;
        }
        l.all += fabs(f->residual[j]) * s->dt;
        l.volume += f->volume[j];
    }
    return l;
}

// largest share of its volume that a node would gain or lose in the step; spray counts as a quarter of a cell. @return that node
static int worst_residual(silt_fluid *f, const silt_step *s) {
    const int n = f->n_node;
    lack part[CHUNK_MOST], all = {0};
    SILT_PARALLEL(n)
    for (int c = 0; c < silt_chunks(n); c++)
        part[c] = lack_of(f, s, silt_chunk_first(n, c), silt_chunk_first(n, c + 1));
    for (int c = 0; c < silt_chunks(n); c++) {
        if (part[c].most > all.most || !isfinite(part[c].most)) {
            all.most = part[c].most;
            all.node = part[c].node;
        }
        all.all += part[c].all;
        all.volume += part[c].volume;
    }
    f->worst = all.most;
    f->lacking = all.volume > 0 ? all.all / all.volume : 0;
    return all.node;
}

// what continuity lacks with f->star. @return the node that lacks most
int silt_star_continuity(silt_fluid *f, const silt_step *s, const double *p) {
    const double *v = f->star;
    if (f->shift) {
        SILT_PARALLEL(f->n_node)
        for (int k = 0; k < f->dim * f->n_node; k++)
            f->scratch[k] = f->star[k] + f->shift[k];
        v = f->scratch;
    }
    silt_assemble_continuity(f, s->mesh, s->drag, f->rate, v, p);
    return worst_residual(f, s);
}

// A node that came within the courant number and leaves by more than a cell: the step was too long for what happened in it. Where
// no smaller step will follow, over ten cells: no result after that is worth having.
silt_status silt_astray_node(const silt_fluid *f, const silt_step *s, silt_error *err) {
    const int D = f->dim;
    const double most = f->last_try ? 10 : 1.5;
    for (int i = 0; i < f->n_node; i++) {
        const double h = silt_node_h(s->nodes, i, s->scene->fluid.size), way = silt_length(D, f->w + D * i) * s->dt;
        if (!s->mesh->wet[i] || way < most * h || (!f->last_try && silt_length(D, s->nodes->v + D * i) * s->dt > h))
            continue;
        return silt_fail(err, SILT_FAILED, "a node at (%g, %g) would be thrown over %.3g cells in a step", s->nodes->x[D * i],
                         s->nodes->x[D * i + 1], way / h);
    }
    return SILT_OK;
}

// Explicit viscosity: f->stand holds the nodes that it would make unstable (point by point implicit, the fixed point is the same);
// a step in which that is more than what stands in slivers is too long. Two passes are the midpoint rule, which stands steps of 2
// over the largest eigenvalue of M^-1 K: at most twice the largest share of the diagonal (square lattice; 1.5 on even triangles).
silt_status silt_explicit_limit(silt_fluid *f, const silt_step *s, silt_error *err) {
    double held = 0, all = 0;
    memset(f->stand, 0, (size_t)f->n_node * sizeof *f->stand);
    silt_assemble_viscous_diagonal(f, s->mesh, f->stand);
    for (int i = 0; i < f->n_node; i++) {
        f->stand[i] = silt_max(0, 2 * f->stand[i] - f->inertia[i]);
        all += s->mesh->wet[i] ? f->volume[i] : 0;
        held += f->stand[i] > 0 && f->hold[i] != HOLD_ALL ? f->volume[i] : 0;
    }
    if (held <= EXPLICIT_SHARE * all)
        return SILT_OK;
    return silt_fail(err, SILT_FAILED, "a step of %.3g s is too long for explicit viscosity (fluid.scheme: implicit knows no limit)", s->dt);
}

// the largest way that an iterate's change of velocity makes in the step, over the local size: continuity does not see what swirls
double silt_swirl(const silt_fluid *f, const silt_step *s) {
    double most = 0;
    for (int i = 0; i < f->n_node; i++)
        for (int d = 0; d < f->dim && s->mesh->wet[i]; d++)
            most = silt_max(most, fabs(f->star[f->dim * i + d] - f->w[f->dim * i + d]) / silt_node_h(s->nodes, i, s->scene->fluid.size));
    return most * s->dt;
}

// fluid.tolerance is a share of a node's volume in a step of the usual length: many short steps shall not gain more than a few long
// ones, or still water starts to swirl. @return what to multiply it by
double silt_strictness(const silt_fluid *f, const silt_step *s) {
    const double h = s->scene->fluid.size;
    double square = h * silt_length(3, s->scene->gravity);
    for (int i = 0; i < f->n_node; i++)
        if (s->mesh->wet[i])
            square = silt_max(square, silt_dot(f->dim, s->nodes->v + f->dim * i, s->nodes->v + f->dim * i));
    const double fastest = sqrt(square);
    const double least = silt_clamp(1e-12 / s->scene->fluid.tolerance, 0.01, 1); // rounding
    return fastest > 0 && !f->last_try ? silt_clamp(s->dt * fastest / (0.5 * h), least, 1) : 1;
}

// Small cells of spray turn while they are solved, and are not waited for when all that is lacking is little
bool silt_spray_lags(const silt_fluid *f, double tolerance) {
    return f->iterations >= FLUID_SPRAY && f->lacking < 0.01 * tolerance && f->worst < 1e3 * tolerance;
}
