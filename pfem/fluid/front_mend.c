// what single precision leaves of a solution: conjugate gradients on the matrix itself, the fronts' factor before them
#include "front.h"

#define MEND_LIMIT 200
#define MEND_TRUST 3 // a solve may leave that many times what the measured one left

void silt_front_apply(const silt_front_matrix *q, const double *x, double *out) {
    for (int i = 0; i < q->n; i++)
        out[i] = q->diagonal[i] * x[i];
    for (int i = 0; i < q->n; i++) {
        const int begin = q->neighbour_start[i], end = q->neighbour_start[i + 1];
        const float *row = q->row + 3 * begin;
        const double own = x[i];
        double u = 0, v = 0, coupled = 0;
        for (int k = begin; k < end; k++, row += 3) {
            const double other = x[q->neighbour[k]];
            u += row[0] * other;
            v += row[1] * other;
            coupled += row[2] * other;
        }
        u *= q->weight[i];
        v *= q->weight[i];
        row = q->row + 3 * begin;
        for (int k = begin; k < end; k++, row += 3)
            out[q->neighbour[k]] += row[0] * u + row[1] * v + row[2] * own;
        out[i] += coupled;
    }
}

static double dot(int n, const double *a, const double *b) {
    double sum = 0;
    for (int i = 0; i < n; i++)
        sum += a[i] * b[i];
    return sum;
}

// square of a residual in units of the diagonal
static double size(const silt_front_matrix *q, const double *r) {
    double sum = 0;
    for (int i = 0; i < q->n; i++)
        sum += r[i] * r[i] / q->whole[i];
    return sum;
}

bool silt_front_mend(silt_front *front, const silt_front_matrix *q, const double *right, double tolerance, double *x,
                     double *const work[3], double *share, int *iterations) {
    const int n = q->n;
    if (*share > 0 && MEND_TRUST * *share <= tolerance) {
        silt_front_solve(front, right, x);
        return true;
    }
    double *r = work[0], *d = work[1], *z = work[2], *ad = work[2], before = 0;
    memcpy(r, right, (size_t)n * sizeof *r);
    memset(x, 0, (size_t)n * sizeof *x);
    memset(d, 0, (size_t)n * sizeof *d);
    const double start = size(q, r);
    for (int k = 0; k < MEND_LIMIT && start > 0; k++) {
        silt_front_solve(front, r, z);
        const double rz = dot(n, r, z), beta = k ? rz / before : 0;
        for (int i = 0; i < n; i++)
            d[i] = z[i] + beta * d[i];
        silt_front_apply(q, d, ad);
        const double curvature = dot(n, d, ad), alpha = rz / curvature;
        if (!(rz > 0 && curvature > 0))
            return false;
        for (int i = 0; i < n; i++) {
            x[i] += alpha * d[i];
            r[i] -= alpha * ad[i];
        }
        before = rz;
        *iterations += k > 0;
        const double left = sqrt(size(q, r) / start);
        if (k == 0) // the factor alone would have taken a step of 1
            *share = silt_max(*share, silt_max(left, fabs(alpha - 1)));
        if (left <= tolerance)
            return true;
    }
    return start == 0;
}
