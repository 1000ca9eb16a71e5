// sweep.c: the porosity kernel in space: a polynomial of the mesh's diffusion
#include "sweep.h"

#include "parallel.h"
#include "vector.h"

static const double sweep_left = 0.02;   // what is left of the roughest fields
static const double sweep_cap = 10.0;    // see sweep_soften
static const double sweep_sliver = 0.02; // of a regular tetrahedron: gradients are bounded as if a cell had this share of its volume

double silt_sweep_cell(const double c[12], double t, double edge[6]) {
    static const double regular = 0.1178511; // volume at edges of 1
    double u[3][3], g[4][3], square = 0.0;
    for (int a = 0; a < 3; a++)
        for (int d = 0; d < 3; d++)
            u[a][d] = c[3 * (a + 1) + d] - c[d];
    for (int a = 0; a < 3; a++) {
        const double *p = u[(a + 1) % 3], *q = u[(a + 2) % 3];
        for (int d = 0; d < 3; d++)
            g[a + 1][d] = (p[(d + 1) % 3] * q[(d + 2) % 3] - p[(d + 2) % 3] * q[(d + 1) % 3]) / 6.0;
        square += silt_square(silt_length(3, p)) + silt_square(u[a][0] - p[0]) + silt_square(u[a][1] - p[1]) + silt_square(u[a][2] - p[2]);
    }
    for (int d = 0; d < 3; d++)
        g[0][d] = -(g[1][d] + g[2][d] + g[3][d]);
    const double volume = silt_dot(3, u[0], g[1]), mean = square / 6.0;
    const double weight = t / silt_max(volume, sweep_sliver * regular * mean * sqrt(mean));
    for (int a = 0, k = 0; a < 4; a++)
        for (int b = a + 1; b < 4; b++)
            edge[k++] = weight * silt_dot(3, g[a], g[b]);
    return volume;
}

// ---------------------------------------------------------------- the matrix

static const int sweep_pair[4][4] = {{-1, 0, 1, 2}, {0, -1, 3, 4}, {1, 3, -1, 5}, {2, 4, 5, -1}}; // place of an edge

// Slivers make rows that are many times what a good mesh has, about 5 t M^(1/3), and ask for twice as many sweeps. Whole cells are
// made less stiff, and count only where all their nodes are held: the sum stays positive semi-definite, without which a
// polynomial is no kernel.
static void sweep_soften(silt_sweep *w, const silt_mesh *mesh, int n_near, const int *near, const int *place, const double *volume,
                         double t, double *edge) {
    memset(w->row, 0, (size_t)(w->n + 1) * sizeof *w->row);
    for (int k = 0; k < n_near; k++) {
        const int e = near[k], *cell = mesh->cell[e];
        bool whole = true;
        for (int a = 0; a < 4; a++)
            whole &= place[cell[a]] < w->n;
        for (int c = 0; c < 6 && !whole; c++)
            edge[6 * e + c] = 0.0;
        for (int a = 0; a < 4; a++)
            for (int b = 0; b < 4; b++)
                w->row[place[cell[a]]] -= a == b ? 0.0 : edge[6 * e + sweep_pair[a][b]];
    }
    for (int k = 0; k < n_near; k++) {
        const int e = near[k], *cell = mesh->cell[e];
        double share = 1.0;
        for (int a = 0; a < 4; a++)
            if (place[cell[a]] < w->n)
                share = silt_min(share, sweep_cap * t * cbrt(volume[cell[a]]) / silt_max(w->row[place[cell[a]]], 1e-300));
        for (int c = 0; c < 6 && share < 1.0; c++)
            edge[6 * e + c] *= share;
    }
}

// rows of M^-1 K. @return the largest eigenvalue that they can have (Gershgorin)
static double sweep_rows(silt_sweep *w, const silt_mesh *mesh, const int *node, const int *place, const double *volume,
                         const double *edge) {
    double most = 0.0;
    int filled = 0;
    memset(w->row, 0, (size_t)(w->n + 1) * sizeof *w->row);
    for (int k = 0; k < w->n; k++) {
        const int i = node[k];
        double around = 0.0, sum = 0.0;
        w->start[k] = filled;
        w->inverse[k] = volume[i] > 0.0 ? 1.0 / volume[i] : 1.0; // a node without a cell keeps what is asked of it
        for (int m = mesh->node_cell_start[i]; m < mesh->node_cell_start[i + 1]; m++) {
            const int e = mesh->node_cell[m], *cell = mesh->cell[e];
            int a = 0;
            while (cell[a] != i)
                a++;
            for (int b = 0; b < 4; b++)
                if (b != a)
                    w->row[place[cell[b]]] -= edge[6 * e + sweep_pair[a][b]] * w->inverse[k];
        }
        for (int m = mesh->neighbour_start[i]; m < mesh->neighbour_start[i + 1]; m++) {
            const int j = place[mesh->neighbour[m]];
            if (j == w->n || j == k)
                continue;
            w->index[filled] = j;
            w->weight[filled++] = w->row[j];
            sum += w->row[j];
            around += fabs(w->row[j]);
            w->row[j] = 0.0;
        }
        w->row[w->n] = 0.0;
        w->diagonal[k] = sum;
        most = silt_max(most, sum + around);
    }
    w->start[w->n] = filled;
    return most;
}

// P(z) = T_s(w0 - w1 z)/T_s(w0), w0 = cosh a, w0 - w1 most = -1, and P'(0) = -1: s tanh(s a) = most tanh(a/2). As few sweeps
// as leave little enough of the roughest fields; where nothing is rough one will do.
static void sweep_polynomial(silt_sweep *w, double most) {
    double angle = 0.0;
    for (w->degree = 1; w->degree < SWEEP_MOST; w->degree++) {
        const double s = w->degree;
        double low = 0.0, high = 40.0;
        if (most > 2.0 * s * s)
            continue;
        for (int k = 0; k < 60; k++) {
            angle = 0.5 * (low + high);
            *(s * tanh(s * angle) > most * tanh(0.5 * angle) ? &low : &high) = angle;
        }
        if (1.0 / cosh(s * angle) <= sweep_left || s + 1.0 > most)
            break;
    }
    w->shift = cosh(angle);
    w->pace = silt_min((1.0 + w->shift) / silt_max(most, 1e-300), w->shift);
    w->fade[0] = 0.0;
    w->fade[1] = 1.0 / w->shift;
    for (int k = 2; k <= w->degree; k++)
        w->fade[k] = 1.0 / (2.0 * w->shift - w->fade[k - 1]);
}

void silt_sweep_build(silt_sweep *w, const silt_mesh *mesh, int n, const int *node, const int *place, int n_near, const int *near,
                      const double *volume, double t, double *edge) {
    int most = 0;
    for (int k = 0; k < n; k++)
        most += mesh->neighbour_start[node[k] + 1] - mesh->neighbour_start[node[k]];
    w->n = n;
    SILT_RESERVE(w->start, w->node_capacity[0], n + 1);
    SILT_RESERVE(w->diagonal, w->node_capacity[1], n + 1);
    SILT_RESERVE(w->inverse, w->node_capacity[2], n + 1);
    SILT_RESERVE(w->row, w->node_capacity[3], n + 1);
    SILT_RESERVE(w->index, w->weight_capacity[0], most + 1);
    SILT_RESERVE(w->weight, w->weight_capacity[1], most + 1);
    for (int k = 0; k < 2; k++)
        SILT_RESERVE(w->work[k], w->work_capacity[k], SWEEP_FIELDS * (n + 1));
    sweep_soften(w, mesh, n_near, near, place, volume, t, edge);
    sweep_polynomial(w, sweep_rows(w, mesh, node, place, volume, edge));
}

// ---------------------------------------------------------------- fields

// out = a x - b M^-1 K x - c old, m times four fields a row, of the nodes from first to last
VECTOR_INLINE void sweep_once(const int m, const silt_sweep *w, double a, double b, double c, const four *x, const four *old, four *out,
                              int first, int last) {
    for (int k = first; k < last; k++) {
        const double own = a - b * w->diagonal[k];
        four sum[2];
        for (int f = 0; f < m; f++)
            sum[f] = own * x[m * k + f] - c * old[m * k + f];
        for (int j = w->start[k]; j < w->start[k + 1]; j++) {
            const double weight = b * w->weight[j];
            const four *from = x + m * w->index[j];
            for (int f = 0; f < m; f++)
                sum[f] += weight * from[f];
        }
        for (int f = 0; f < m; f++)
            out[m * k + f] = sum[f];
    }
}

VECTOR_CLONES static void sweep_four(const silt_sweep *w, double a, double b, double c, const double *x, const double *old, double *out,
                                     int first, int last) {
    sweep_once(1, w, a, b, c, (const four *)x, (const four *)old, (four *)out, first, last);
}

VECTOR_CLONES static void sweep_eight(const silt_sweep *w, double a, double b, double c, const double *x, const double *old, double *out,
                                      int first, int last) {
    sweep_once(2, w, a, b, c, (const four *)x, (const four *)old, (four *)out, first, last);
}

void silt_sweep_solve(const silt_sweep *w, int n_field, double *field) {
    const int n = w->n, n_chunk = silt_chunks(n);
    const double *old = field, *x = field;
    for (int k = 0; k < n; k++)
        for (int f = 0; f < n_field; f++)
            field[n_field * k + f] *= w->inverse[k];
    for (int s = 1; s <= w->degree; s++) {
        // the last result may take the place of what it is made from
        double *out = s == w->degree && x != field ? field : w->work[s % 2];
        const double rate = s == 1 ? w->fade[1] : 2.0 * w->fade[s], last = s == 1 ? 0.0 : w->fade[s] * w->fade[s - 1];
        SILT_PARALLEL(n)
        for (int c = 0; c < n_chunk; c++)
            (n_field == 4 ? sweep_four : sweep_eight)(w, rate * w->shift, rate * w->pace, last, x, old, out, silt_chunk_first(n, c),
                                                      silt_chunk_first(n, c + 1));
        old = x;
        x = out;
    }
    if (x != field)
        memcpy(field, x, (size_t)(n_field * n) * sizeof *field);
}

void silt_sweep_clear(silt_sweep *w) {
    void *owned[] = {w->start, w->index, w->weight, w->diagonal, w->inverse, w->row, w->work[0], w->work[1]};
    for (size_t k = 0; k < sizeof owned / sizeof *owned; k++)
        free(owned[k]);
    *w = (silt_sweep){0};
}
