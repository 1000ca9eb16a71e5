// small symmetric matrices: of the bodies' motion
#include "run.h"

#define SWEEPS 30
#define TURNED 1e-14 // of the diagonal, of an entry that is nought

bool silt_cholesky(int n, double *a) {
    for (int j = 0; j < n; j++) {
        for (int k = 0; k < j; k++)
            for (int i = j; i < n; i++)
                a[i * n + j] -= a[i * n + k] * a[j * n + k];
        if (!(a[j * n + j] > 0))
            return false;
        const double root = sqrt(a[j * n + j]);
        for (int i = j; i < n; i++)
            a[i * n + j] /= root;
    }
    return true;
}

void silt_cholesky_solve(int n, const double *a, double *x) {
    for (int i = 0; i < n; i++) {
        for (int k = 0; k < i; k++)
            x[i] -= a[i * n + k] * x[k];
        x[i] /= a[i * n + i];
    }
    for (int i = n - 1; i >= 0; i--) {
        for (int k = i + 1; k < n; k++)
            x[i] -= a[k * n + i] * x[k];
        x[i] /= a[i * n + i];
    }
}

// turns rows and columns p and q so that the entry between them is nought, and keeps the turn in the columns of `axis`
static void turn(int n, double *a, double *axis, int p, int q) {
    const double half = (a[q * n + q] - a[p * n + p]) / (2 * a[p * n + q]);
    const double t = (half < 0 ? -1 : 1) / (fabs(half) + sqrt(half * half + 1)), c = 1 / sqrt(t * t + 1), s = t * c;
    for (int k = 0; k < n; k++) {
        const double x = a[k * n + p], y = a[k * n + q];
        a[k * n + p] = c * x - s * y;
        a[k * n + q] = s * x + c * y;
    }
    for (int k = 0; k < n; k++) {
        const double x = a[p * n + k], y = a[q * n + k];
        a[p * n + k] = c * x - s * y;
        a[q * n + k] = s * x + c * y;
    }
    for (int k = 0; k < n; k++) {
        const double x = axis[k * n + p], y = axis[k * n + q];
        axis[k * n + p] = c * x - s * y;
        axis[k * n + q] = s * x + c * y;
    }
}

int silt_matrix_clip(int n, double *a) {
    double *axis = silt_alloc((size_t)(n * n) + 1, sizeof *axis), *value = silt_alloc((size_t)n + 1, sizeof *value);
    int clipped = 0;
    for (int i = 0; i < n; i++)
        axis[i * n + i] = 1;
    for (int i = 0; i < n; i++)
        for (int j = 0; j < i; j++)
            a[i * n + j] = a[j * n + i] = 0.5 * (a[i * n + j] + a[j * n + i]);
    bool more = true;
    for (int sweep = 0; sweep < SWEEPS && more; sweep++) { // Jacobi's
        more = false;
        for (int p = 0; p < n; p++)
            for (int q = p + 1; q < n; q++)
                if (fabs(a[p * n + q]) > TURNED * sqrt(fabs(a[p * n + p] * a[q * n + q])) && a[p * n + q] != 0) {
                    turn(n, a, axis, p, q);
                    more = true;
                }
    }
    for (int i = 0; i < n; i++) {
        value[i] = silt_max(a[i * n + i], 0);
        clipped += a[i * n + i] < 0;
    }
    for (int i = 0; i < n; i++)
        for (int j = 0; j < n; j++) {
            a[i * n + j] = 0;
            for (int k = 0; k < n; k++)
                a[i * n + j] += axis[i * n + k] * value[k] * axis[j * n + k];
        }
    free(axis);
    free(value);
    return clipped;
}
