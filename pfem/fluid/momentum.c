// the viscous momentum system, by conjugate gradients; where viscosity is stiff preconditioned by the factor of its first geometry
#include "fluid.h"

#define MOMENTUM_LIMIT 3000

silt_status silt_momentum_solve(silt_fluid *f, const silt_step *step, const double *right, double drop, double *v,
                                silt_error *err) {
    const int D = f->dim, n = f->n_node;
    const silt_mesh *mesh = step->mesh;
    double *r = f->cg[0], *s = f->cg[1], *as = f->cg[2], *diagonal = f->increment;
    for (int i = 0; i < n; i++)
        diagonal[i] = f->inertia[i];
    silt_assemble_viscous_diagonal(f, mesh, diagonal);
    for (int i = 0; i < n; i++)
        for (int d = 0; d < D; d++)
            r[D * i + d] = right[D * i + d] - f->inertia[i] * v[D * i + d];
    silt_assemble_viscous(f, mesh, v, -1, r);
    const bool factored = silt_stiff_ready(f->stiff, false);
    double rz = 0, scale = 0, whole = 0;
    for (int i = 0; i < n; i++) {
        double loose[3];
        memcpy(loose, right + D * i, (size_t)D * sizeof(double));
        silt_hold_project(f, i, loose);
        silt_hold_project(f, i, r + D * i);
        for (int d = 0; d < D; d++) {
            const int k = D * i + d;
            s[k] = r[k] / diagonal[i];
            rz += r[k] * s[k];
            scale += silt_square(loose[d]) / diagonal[i];
            whole += silt_square(right[k]) / diagonal[i];
        }
    }
    // what walls hold is no measure of what is solved for, only of its rounding
    const double share = silt_clamp(1e-6 * step->scene->fluid.tolerance, 1e-12, 1e-9);
    const double target = silt_max(silt_max(silt_square(share) * scale, silt_square(drop) * rz), 1e-30 * whole);
    int iterations = 0;
    double size = rz; // what is left of the residual
    if (factored && size > target) {
        SILT_TRY(silt_stiff_momentum(f->stiff, f, r, s, err));
        rz = 0;
        for (int k = 0; k < D * n; k++)
            rz += r[k] * s[k];
    }
    double *z = factored ? f->scratch : NULL;
    while (size > target) {
        if (++iterations > MOMENTUM_LIMIT)
            return silt_fail(err, SILT_FAILED, "the momentum system did not converge in %d iterations (%d nodes)", MOMENTUM_LIMIT, n);
        for (int i = 0; i < n; i++)
            for (int d = 0; d < D; d++)
                as[D * i + d] = f->inertia[i] * s[D * i + d];
        silt_assemble_viscous(f, mesh, s, 1, as);
        double sas = 0;
        for (int i = 0; i < n; i++) {
            silt_hold_project(f, i, as + D * i);
            for (int d = 0; d < D; d++)
                sas += s[D * i + d] * as[D * i + d];
        }
        const double alpha = rz / sas;
        double fresh = 0;
        for (int i = 0; i < n; i++)
            for (int d = 0; d < D; d++) {
                const int k = D * i + d;
                v[k] += alpha * s[k];
                r[k] -= alpha * as[k];
                fresh += r[k] * r[k] / diagonal[i];
            }
        size = fresh;
        if (factored && size > target) {
            SILT_TRY(silt_stiff_momentum(f->stiff, f, r, z, err));
            fresh = 0;
            for (int k = 0; k < D * n; k++)
                fresh += r[k] * z[k];
        }
        const double beta = fresh / rz;
        for (int i = 0; i < n; i++)
            for (int d = 0; d < D; d++)
                s[D * i + d] = (factored ? z[D * i + d] : r[D * i + d] / diagonal[i]) + beta * s[D * i + d];
        rz = fresh;
        if (!isfinite(rz))
            return silt_fail(err, SILT_FAILED, "the momentum system gave numbers that are not finite");
    }
    f->momentum_iterations += iterations;
    return SILT_OK;
}
