// the viscous momentum system, by conjugate gradients; in the plane, where viscosity is stiff, preconditioned by a factor of the step's
#include "fluid.h"
#include "kernel.h"

#define MOMENTUM_LIMIT 3000
#define MOMENTUM_PATIENCE 30 // iterations of a solve after which a factor pays, in the plane: it costs as much as that many
#define MOMENTUM_WORN 12     // iterations after which that of an earlier viscosity is made anew

void silt_momentum_look(silt_fluid *f, const silt_mesh *mesh, const double *v) {
    memset(f->scratch, 0, (size_t)(f->dim * f->n_node) * sizeof *f->scratch);
    memcpy(f->increment, f->inertia, (size_t)f->n_node * sizeof *f->increment);
    silt_assemble_viscous_both(f, mesh, v, f->scratch, f->increment);
}

typedef struct silt_descent {
    double rz, size, target, strict; // r . z, r . D^-1 r, where that may stop, and where all is solved
    double bound;                    // what a step along D^-1 r leaves of r, at most
    int iterations;
} silt_descent;

/** what a chunk of the nodes adds */
typedef struct silt_tally {
    double size, scale, whole, most; // r . D^-1 r; the same of the right side, its free components and all; share of K in the diagonal
} silt_tally;

KERNEL begin_chunk(const int D, silt_fluid *f, int first, int last, int c, const double *right, const double *v, silt_tally *tally) {
    double *r = f->cg[0], *s = f->cg[1];
    silt_tally t = {0};
    for (int i = first; i < last; i++) {
        const double per = 1 / f->increment[i];
        double loose[3];
        t.most = silt_max(t.most, (f->increment[i] - f->inertia[i]) * per);
        for (int d = 0; d < D; d++) {
            const int k = D * i + d;
            loose[d] = right[k];
            r[k] = right[k] - f->inertia[i] * v[k] - f->scratch[k];
            t.whole += silt_square(right[k]) * per;
        }
        silt_hold_project(f, i, loose);
        silt_hold_project(f, i, r + D * i);
        for (int d = 0; d < D; d++) {
            const int k = D * i + d;
            s[k] = r[k] * per;
            t.size += r[k] * s[k];
            t.scale += silt_square(loose[d]) * per;
        }
    }
    tally[c] = t;
}

// Residual of v, from what silt_momentum_look left; first direction; what to reach; the bound. With the diagonal D of A = inertia + K,
// v + D^-1 r leaves the residual (D - A) D^-1 r. In the norm of D^-1 that is at most the bound times r: K and its diagonal are
// positive, and a cell's w K w = mu V (L:L + L:L^T - 2/3 tr^2) <= 2 mu V L:L is no more than 2 (dim + 1)/(1 + 4/(3 dim)) times what
// the cell has in the diagonal.
static silt_descent begin(silt_fluid *f, const double *right, const double *v, double share, double drop) {
    silt_tally tally[CHUNK_MOST], all = {0};
    BY_CHUNK(begin_chunk, right, v, tally);
    for (int c = 0; c < silt_chunks(f->n_node); c++) {
        all.size += tally[c].size;
        all.scale += tally[c].scale;
        all.whole += tally[c].whole;
        all.most = silt_max(all.most, tally[c].most);
    }
    // what walls hold is no measure of what is solved for, only of its rounding
    const double strict = silt_max(silt_square(share) * all.scale, 1e-30 * all.whole);
    return (silt_descent){.rz = all.size, .size = all.size, .strict = strict, .target = silt_max(strict, silt_square(drop) * all.size),
                          .bound = 2 * (f->dim + 1) / (1 + 4.0 / (3 * f->dim)) * all.most};
}

KERNEL product_chunk(const int D, silt_fluid *f, int first, int last, int c, double *part) {
    const double *s = f->cg[1];
    double *as = f->cg[2];
    part[c] = 0;
    for (int i = first; i < last; i++) {
        silt_hold_project(f, i, as + D * i);
        for (int d = 0; d < D; d++)
            part[c] += s[D * i + d] * as[D * i + d];
    }
}

// as = A s. @return s . A s
static double along(silt_fluid *f, const silt_mesh *mesh) {
    const double *s = f->cg[1];
    double *as = f->cg[2], part[CHUNK_MOST];
    const int D = f->dim;
    SILT_PARALLEL(f->n_node)
    for (int i = 0; i < f->n_node; i++)
        for (int d = 0; d < D; d++)
            as[D * i + d] = f->inertia[i] * s[D * i + d];
    silt_assemble_viscous(f, mesh, s, 1, as);
    BY_CHUNK(product_chunk, part);
    return silt_total(silt_chunks(f->n_node), part);
}

KERNEL advance_chunk(const int D, silt_fluid *f, int first, int last, int c, double alpha, double *v, double *part) {
    double *r = f->cg[0], *s = f->cg[1], *as = f->cg[2], size = 0;
    for (int i = first; i < last; i++) {
        const double per = 1 / f->increment[i];
        for (int d = 0; d < D; d++) {
            const int k = D * i + d;
            v[k] += alpha * s[k];
            r[k] -= alpha * as[k];
            size += r[k] * r[k] * per;
        }
    }
    part[c] = size;
}

// v += alpha s, r -= alpha as. @return r . D^-1 r
static double advance(silt_fluid *f, double alpha, double *v) {
    double part[CHUNK_MOST];
    BY_CHUNK(advance_chunk, alpha, v, part);
    return silt_total(silt_chunks(f->n_node), part);
}

// s = z + beta s; z: NULL for D^-1 r
KERNEL turn_chunk(const int D, silt_fluid *f, int first, int last, int c, const double *z, double beta) {
    (void)c;
    double *r = f->cg[0], *s = f->cg[1];
    for (int i = first; i < last; i++)
        for (int d = 0; d < D; d++)
            s[D * i + d] = (z ? z[D * i + d] : r[D * i + d] / f->increment[i]) + beta * s[D * i + d];
}

// From diagonal to factor: directions start anew
static silt_status descent_factor(silt_fluid *f, const silt_step *step, silt_descent *c, silt_error *err) {
    silt_status status = SILT_OK;
    if (!silt_stiff_ready(f->stiff, false))
        SILT_CLOCKED(matrix, status = silt_stiff_factor(&f->stiff, f, step, false, err));
    SILT_TRY(status);
    silt_stiff_momentum(f->stiff, f, f->cg[0], f->cg[1]);
    c->rz = silt_products(f->dim * f->n_node, f->cg[0], f->cg[1]);
    return SILT_OK;
}

silt_status silt_momentum_solve(silt_fluid *f, const silt_step *step, const double *right, double drop, double *v, bool *solved,
                                silt_error *err) {
    const int n = f->n_node, D = f->dim;
    double *r = f->cg[0], *z = NULL;
    int worn = MOMENTUM_LIMIT;
    silt_descent c = begin(f, right, v, silt_clamp(1e-6 * step->scene->fluid.tolerance, 1e-12, 1e-9), drop);
    while (c.size > c.target) {
        // the last step needs no product where viscosity is small: that it is enough is known beforehand
        if (!z && silt_square(c.bound) * c.size <= c.target) {
            SILT_PARALLEL(n)
            for (int i = 0; i < n; i++)
                for (int d = 0; d < D; d++)
                    v[D * i + d] += r[D * i + d] / f->increment[i];
            c.size *= silt_square(c.bound);
            break;
        }
        if (!z && D == 2 && (c.iterations == MOMENTUM_PATIENCE || silt_stiff_ready(f->stiff, false))) {
            SILT_TRY(descent_factor(f, step, &c, err));
            z = f->scratch;
            worn = c.iterations + MOMENTUM_WORN;
        }
        if (++c.iterations > MOMENTUM_LIMIT)
            return silt_fail(err, SILT_FAILED, "the momentum system did not converge in %d iterations (%d nodes)", MOMENTUM_LIMIT, n);
        c.size = advance(f, c.rz / along(f, step->mesh), v);
        double fresh = c.size;
        if (z && c.size > c.target) {
            silt_stiff_momentum(f->stiff, f, r, z);
            fresh = silt_products(D * n, r, z);
        }
        BY_CHUNK(turn_chunk, z, fresh / c.rz);
        c.rz = fresh;
        if (!isfinite(c.rz))
            return silt_fail(err, SILT_FAILED, "the momentum system gave numbers that are not finite");
    }
    if (c.iterations > worn)
        silt_stiff_end(f->stiff);
    f->momentum_iterations += c.iterations;
    *solved = c.size <= c.strict;
    return SILT_OK;
}
