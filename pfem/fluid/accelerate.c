// Anderson acceleration of a step's iterations: the next pressure and velocity are the mixture of the last few iterates whose
// corrections cancel best (Walker and Ni, SIAM J. Numer. Anal. 49, 2011); on a linear step that is a Krylov method
#include "fluid.h"

#define MIX_DEPTH 8

struct silt_mix {
    int count;                  // iterates so far in this step
    double *change[MIX_DEPTH];  // owned, per node, pressure corrections
    double *residual[MIX_DEPTH]; // owned, per node, what asked for them
    double *pressure[MIX_DEPTH]; // owned, per node, corrected pressures
    double *velocity[MIX_DEPTH]; // owned, dim per node, corrected velocities
    int capacity[4][MIX_DEPTH];
};

void silt_mix_free(silt_mix **mix) {
    for (int k = 0; *mix && k < MIX_DEPTH; k++) {
        free((*mix)->change[k]);
        free((*mix)->residual[k]);
        free((*mix)->pressure[k]);
        free((*mix)->velocity[k]);
    }
    free(*mix);
    *mix = NULL;
}

void silt_mix_restart(silt_mix **mix) {
    if (!*mix)
        *mix = silt_alloc(1, sizeof **mix);
    (*mix)->count = 0;
}

// solves the small symmetric system by elimination; a pivot that is all but nought drops its iterate
static void small_solve(int n, double a[MIX_DEPTH][MIX_DEPTH], double *b) {
    for (int k = 0; k < n; k++) {
        const double pivot = a[k][k];
        if (!(pivot > 1e-14)) {
            for (int j = 0; j < n; j++)
                a[k][j] = a[j][k] = 0;
            a[k][k] = 1;
            b[k] = 0;
            continue;
        }
        for (int i = k + 1; i < n; i++) {
            const double f = a[i][k] / pivot;
            for (int j = k; j < n; j++)
                a[i][j] -= f * a[k][j];
            b[i] -= f * b[k];
        }
    }
    for (int k = n - 1; k >= 0; k--) {
        for (int j = k + 1; j < n; j++)
            b[k] -= a[k][j] * b[j];
        b[k] /= a[k][k];
    }
}

void silt_mix_next(silt_mix *mix, int dim, int n, const double *change, const double *residual, double *pressure, double *velocity) {
    const int slot = mix->count % MIX_DEPTH;
    SILT_RESERVE(mix->change[slot], mix->capacity[0][slot], n + 1);
    SILT_RESERVE(mix->residual[slot], mix->capacity[1][slot], n + 1);
    SILT_RESERVE(mix->pressure[slot], mix->capacity[2][slot], n + 1);
    SILT_RESERVE(mix->velocity[slot], mix->capacity[3][slot], dim * n + 1);
    memcpy(mix->change[slot], change, (size_t)n * sizeof(double));
    memcpy(mix->residual[slot], residual, (size_t)n * sizeof(double));
    memcpy(mix->pressure[slot], pressure, (size_t)n * sizeof(double));
    memcpy(mix->velocity[slot], velocity, (size_t)(dim * n) * sizeof(double));
    mix->count++;
    const int m = mix->count < MIX_DEPTH ? mix->count : MIX_DEPTH;
    if (m < 2)
        return;

    // weights of the older iterates j against the newest: minimise |c + sum g_j (c_j - c)| in the norm of the system
    double a[MIX_DEPTH][MIX_DEPTH], b[MIX_DEPTH];
    int other[MIX_DEPTH], k = 0;
    for (int j = 0; j < m; j++)
        if (j != slot)
            other[k++] = j;
    double own = 0;
    for (int i = 0; i < n; i++)
        own += change[i] * residual[i];
    if (!(own > 0))
        return;
    for (int p = 0; p < k; p++) {
        const double *cp = mix->change[other[p]];
        for (int q = p; q < k; q++) {
            const double *rq = mix->residual[other[q]];
            double sum = 0;
            for (int i = 0; i < n; i++)
                sum += (cp[i] - change[i]) * (rq[i] - residual[i]);
            a[p][q] = a[q][p] = sum;
        }
        double sum = 0;
        for (int i = 0; i < n; i++)
            sum += (cp[i] - change[i]) * residual[i];
        b[p] = -sum;
    }
    // scaled to ones on the diagonal
    double scale[MIX_DEPTH];
    for (int p = 0; p < k; p++)
        scale[p] = a[p][p] > 0 ? 1 / sqrt(a[p][p]) : 0;
    for (int p = 0; p < k; p++) {
        for (int q = 0; q < k; q++)
            a[p][q] *= scale[p] * scale[q];
        b[p] *= scale[p];
    }
    small_solve(k, a, b);
    for (int p = 0; p < k; p++) {
        const double g = b[p] * scale[p];
        const double *pj = mix->pressure[other[p]], *vj = mix->velocity[other[p]];
        if (!isfinite(g))
            continue;
        for (int i = 0; i < n; i++)
            pressure[i] += g * (pj[i] - mix->pressure[slot][i]);
        for (int i = 0; i < dim * n; i++)
            velocity[i] += g * (vj[i] - mix->velocity[slot][i]);
    }
}
