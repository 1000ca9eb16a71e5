// the bed's seepage in the water's pressure system
#include "fluid.h"

#define SEEPAGE_LIMIT 200

// numbers of working space, arrays of the water's nodes one after the other
static double *space(silt_fluid *f, int arrays) {
    return SILT_RESERVE(f->seep->work, f->seep->work_capacity, arrays * f->n_node + 1);
}

const double *silt_seepage_taken(silt_fluid *f, const double *p) {
    double *taken = space(f, 1);
    memset(taken, 0, (size_t)f->n_node * sizeof *taken);
    silt_seep_take(f->seep, p, taken);
    return taken;
}

// out = (S + L + B) x, without the pins that pieces of closed water have in their factor: here the bed may hold their level
static void apply(silt_fluid *f, const silt_step *s, const double *x, double *v, double *out) {
    memset(v, 0, (size_t)(f->dim * f->n_node) * sizeof *v);
    silt_fluid_correct(f, s, x, v);
    silt_assemble_divergence(f, s->mesh, v, x, out);
    silt_seep_apply(f->seep, x, out);
    for (int i = 0; i < f->n_node; i++)
        if (!s->mesh->wet[i])
            out[i] = x[i];
}

static double dot(int n, const double *a, const double *b) {
    double sum = 0;
    for (int i = 0; i < n; i++)
        sum += a[i] * b[i];
    return sum;
}

silt_status silt_seepage_solve(silt_fluid *f, const silt_step *s, const double *right, double tolerance, double *x, silt_error *err) {
    const int n = f->n_node;
    double *r = space(f, 4 + f->dim), *d = r + n, *ad = d + n, *z = ad + n, *v = z + n;
    memcpy(r, right, (size_t)n * sizeof *r);
    memset(x, 0, (size_t)n * sizeof *x);
    double before = 0, start = 0;
    for (int k = 0; k < SEEPAGE_LIMIT; k++) {
        // what comes before them need not be the same every time (multigrid): the direction is made orthogonal to the last alone
        const double last = k ? dot(n, z, r) : 0;
        SILT_TRY(silt_pressure_solve(f->pressure, f, r, tolerance, z, err));
        const double rz = dot(n, r, z), beta = k ? (rz - last) / before : 0;
        if (k == 0)
            start = rz;
        if (rz <= silt_square(tolerance) * start)
            return SILT_OK;
        for (int i = 0; i < n; i++)
            d[i] = z[i] + (k ? beta * d[i] : 0);
        apply(f, s, d, v, ad);
        const double curvature = dot(n, d, ad), alpha = dot(n, d, r) / curvature;
        if (!(curvature > 0))
            break;
        for (int i = 0; i < n; i++) {
            x[i] += alpha * d[i];
            r[i] -= alpha * ad[i];
        }
        before = rz;
        f->pressure_iterations += k > 0;
    }
    return silt_fail(err, SILT_FAILED, "the pressure system with the bed's seepage could not be solved (%d nodes)", n);
}
