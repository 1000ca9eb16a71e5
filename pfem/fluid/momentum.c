// the viscous momentum system, by conjugate gradients; where viscosity is stiff preconditioned by the factor of its first geometry
#include "fluid.h"
#include "kernel.h"

#define MOMENTUM_LIMIT 3000

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

// Residual of v, from what silt_momentum_look left; first direction; what to reach; the bound. With the diagonal D of A = inertia + K,
// v + D^-1 r leaves the residual (D - A) D^-1 r. In the norm of D^-1 that is at most the bound times r: K and its diagonal are
// positive, and a cell's w K w = mu V (L:L + L:L^T - 2/3 tr^2) <= 2 mu V L:L is no more than 2 (dim + 1)/(1 + 4/(3 dim)) times what
// the cell has in the diagonal.
KERNEL begin(const int D, silt_fluid *f, const double *right, const double *v, double share, double drop, silt_descent *c) {
    double *r = f->cg[0], *s = f->cg[1], scale = 0, whole = 0, rz = 0, most = 0;
    for (int i = 0; i < f->n_node; i++) {
        const double per = 1 / f->increment[i];
        double loose[3];
        most = silt_max(most, (f->increment[i] - f->inertia[i]) * per);
        for (int d = 0; d < D; d++) {
            const int k = D * i + d;
            loose[d] = right[k];
            r[k] = right[k] - f->inertia[i] * v[k] - f->scratch[k];
            whole += silt_square(right[k]) * per;
        }
        silt_hold_project(f, i, loose);
        silt_hold_project(f, i, r + D * i);
        for (int d = 0; d < D; d++) {
            const int k = D * i + d;
            s[k] = r[k] * per;
            rz += r[k] * s[k];
            scale += silt_square(loose[d]) * per;
        }
    }
    // what walls hold is no measure of what is solved for, only of its rounding
    c->strict = silt_max(silt_square(share) * scale, 1e-30 * whole);
    c->target = silt_max(c->strict, silt_square(drop) * rz);
    c->rz = c->size = rz;
    c->bound = 2 * (D + 1) / (1 + 4.0 / (3 * D)) * most;
}

// as = A s. @return s . A s
static inline __attribute__((always_inline)) double along(const int D, silt_fluid *f, const silt_mesh *mesh) {
    const double *s = f->cg[1];
    double *as = f->cg[2], sum = 0;
    for (int i = 0; i < f->n_node; i++)
        for (int d = 0; d < D; d++)
            as[D * i + d] = f->inertia[i] * s[D * i + d];
    silt_assemble_viscous(f, mesh, s, 1, as);
    for (int i = 0; i < f->n_node; i++) {
        silt_hold_project(f, i, as + D * i);
        for (int d = 0; d < D; d++)
            sum += s[D * i + d] * as[D * i + d];
    }
    return sum;
}

KERNEL advance(const int D, silt_fluid *f, double alpha, double *v, silt_descent *c) {
    double *r = f->cg[0], *s = f->cg[1], *as = f->cg[2], size = 0;
    for (int i = 0; i < f->n_node; i++) {
        const double per = 1 / f->increment[i];
        for (int d = 0; d < D; d++) {
            const int k = D * i + d;
            v[k] += alpha * s[k];
            r[k] -= alpha * as[k];
            size += r[k] * r[k] * per;
        }
    }
    c->size = size;
}

// s = z + beta s; z: NULL for D^-1 r
KERNEL turn(const int D, silt_fluid *f, const double *z, double beta) {
    double *r = f->cg[0], *s = f->cg[1];
    for (int i = 0; i < f->n_node; i++)
        for (int d = 0; d < D; d++)
            s[D * i + d] = (z ? z[D * i + d] : r[D * i + d] / f->increment[i]) + beta * s[D * i + d];
}

static double dot(int n, const double *a, const double *b) {
    double sum = 0;
    for (int k = 0; k < n; k++)
        sum += a[k] * b[k];
    return sum;
}

static inline __attribute__((always_inline)) silt_status solve(const int D, silt_fluid *f, const silt_step *step, const double *right,
                                                                double drop, double *v, bool *solved, silt_error *err) {
    const int n = f->n_node;
    const bool factored = silt_stiff_ready(f->stiff, false);
    double *r = f->cg[0], *s = f->cg[1], *z = factored ? f->scratch : NULL;
    silt_descent c = {0};
    begin(D, f, right, v, silt_clamp(1e-6 * step->scene->fluid.tolerance, 1e-12, 1e-9), drop, &c);
    if (factored && c.size > c.target) {
        SILT_TRY(silt_stiff_momentum(f->stiff, f, r, s, err));
        c.rz = dot(D * n, r, s);
    }
    while (c.size > c.target) {
        if (++c.iterations > MOMENTUM_LIMIT)
            return silt_fail(err, SILT_FAILED, "the momentum system did not converge in %d iterations (%d nodes)", MOMENTUM_LIMIT, n);
        // the last step needs no product where viscosity is small: that it is enough is known beforehand
        if (!factored && silt_square(c.bound) * c.size <= c.target) {
            for (int i = 0; i < n; i++)
                for (int d = 0; d < D; d++)
                    v[D * i + d] += r[D * i + d] / f->increment[i];
            c.size *= silt_square(c.bound);
            break;
        }
        advance(D, f, c.rz / along(D, f, step->mesh), v, &c);
        double fresh = c.size;
        if (factored && c.size > c.target) {
            SILT_TRY(silt_stiff_momentum(f->stiff, f, r, z, err));
            fresh = dot(D * n, r, z);
        }
        turn(D, f, z, fresh / c.rz);
        c.rz = fresh;
        if (!isfinite(c.rz))
            return silt_fail(err, SILT_FAILED, "the momentum system gave numbers that are not finite");
    }
    f->momentum_iterations += c.iterations;
    *solved = c.size <= c.strict;
    return SILT_OK;
}

silt_status silt_momentum_solve(silt_fluid *f, const silt_step *step, const double *right, double drop, double *v, bool *solved,
                                silt_error *err) {
    return f->dim == 3 ? solve(3, f, step, right, drop, v, solved, err) : solve(2, f, step, right, drop, v, solved, err);
}
